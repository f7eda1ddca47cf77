//! What the corners of a grid give to quadrature points: shear rate and interpolated pressure.

use super::{QuadraturePoint, ThresholdPressure};
use crate::grid::{Axis, Boundary, DIMENSIONS, Grid};
use crate::wall_friction::PointLaw;

/// The unknowns on the low and high faces of a cell normal to an axis, with their signs.
pub(super) fn normal_faces(
    grid: &Grid,
    axis: usize,
    cell: [usize; DIMENSIONS],
) -> impl Iterator<Item = (usize, f64)> {
    let faces = grid.axes()[axis].faces_of_cell(cell[axis]);
    faces.into_iter().flat_map(move |pair| {
        [(pair[0], -1.0), (pair[1], 1.0)]
            .into_iter()
            .filter_map(move |(face, sign)| {
                let mut index = cell;
                index[axis] = face;
                grid.unknown(axis, index).map(|unknown| (unknown, sign))
            })
    })
}

/// Adds the quadrature points of one cell, one for each corner.
pub(super) fn push_points(
    grid: &Grid,
    cell: [usize; DIMENSIONS],
    threshold_pressure: ThresholdPressure,
    points: &mut Vec<QuadraturePoint>,
) {
    let sides = |axis: usize| match grid.axes()[axis].faces_of_cell(cell[axis]) {
        None => vec![0],
        Some(pair) => pair.to_vec(),
    };
    let (xs, zs) = (sides(0), sides(1));
    let weight = grid.cell_volume() / (xs.len() * zs.len()) as f64;
    for &fz in &zs {
        for &fx in &xs {
            let mut point = QuadraturePoint::new(weight);
            for (axis, orientation) in [(0, 1.0), (1, -1.0)] {
                for (unknown, sign) in normal_faces(grid, axis, cell) {
                    let rate = orientation * sign / grid.axes()[axis].spacing();
                    point.add_velocity(unknown, 0, rate);
                }
            }
            let velocity_at = |component: usize, face| {
                let unknown = grid.unknown(component, face);
                unknown.map_or(VelocityAt::Zero, VelocityAt::Unknown)
            };
            add_corner_shear(grid, velocity_at, [fx, fz], [0, 1], 1, &mut point);
            match threshold_pressure {
                ThresholdPressure::Corner => add_corner_pressure(grid, [fx, fz], &mut point),
                ThresholdPressure::Cell => point.add_pressure(grid.cell(cell), 1.0),
            }
            point.side = grid.axes()[1].boundary_at(fz).map(|_| usize::from(fz > 0));
            for (axis, face) in [(0, fx), (1, fz)] {
                if let Some(Boundary::CoulombWall { friction, .. }) =
                    grid.axes()[axis].boundary_at(face)
                {
                    point.law = PointLaw::OnWall(friction);
                }
            }
            points.push(point);
        }
    }
}

/// What an operator finds on a face.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum VelocityAt {
    /// An unknown.
    Unknown(usize),
    /// A wall.
    Zero,
    /// No material near: there is no velocity to take a difference with.
    Nowhere,
}

/// Adds γ = ∂u/∂z + ∂w/∂x (for the axes x, z of the `plane`) to component `row` of a point, at the corner
/// of faces across these axes; along others `corner` is a cell. A rough wall acts through a mirrored
/// velocity outside it; where a side of the corner cannot hold shear, γ is left at zero and carries no
/// stress.
pub(crate) fn add_corner_shear<const D: usize, const C: usize, const V: usize>(
    grid: &Grid<D>,
    velocity_at: impl Fn(usize, [usize; D]) -> VelocityAt,
    corner: [usize; D],
    plane: [usize; 2],
    row: usize,
    point: &mut QuadraturePoint<C, V>,
) {
    let axes = grid.axes();
    let smooth = |axis: usize| {
        axes[axis]
            .boundary_at(corner[axis])
            .is_some_and(|side| side.wall_velocity().is_none())
    };
    if smooth(plane[0]) || smooth(plane[1]) {
        return;
    }
    for [along, component] in [[plane[0], plane[1]], [plane[1], plane[0]]] {
        // ∂u_component/∂x_along
        if axes[along] == Axis::Flat {
            continue;
        }
        let inverse = 1.0 / axes[along].spacing();
        let wall = axes[along]
            .boundary_at(corner[along])
            .and_then(|side| side.wall_velocity());
        let found = axes[along].cells_at_face(corner[along]).map(|position| {
            position.map(|position| {
                let mut face = corner;
                face[along] = position;
                velocity_at(component, face)
            })
        });
        if found.contains(&Some(VelocityAt::Nowhere)) {
            continue;
        }
        for (found, sign) in found.into_iter().zip([-1.0, 1.0]) {
            // The mirrored velocity 2 U − u doubles the difference across half a cell.
            let factor = if wall.is_some() { 2.0 } else { 1.0 };
            if let Some(VelocityAt::Unknown(unknown)) = found {
                point.add_velocity(unknown, row, factor * sign * inverse);
                // A wall moves along the first of its axes.
                if component == usize::from(along == 0) {
                    point.add_known_rate(row, -(factor * sign * inverse * wall.unwrap_or(0.0)));
                }
            }
        }
    }
}

/// Adds the linear interpolation of pressure to a corner: halves inside, extrapolation
/// (3 p₁ − p₂)/2 at walls, nothing (p = 0) at a free surface.
fn add_corner_pressure(grid: &Grid, corner: [usize; DIMENSIONS], point: &mut QuadraturePoint) {
    let along = |direction: usize| -> Vec<(usize, f64)> {
        let (axis, face) = (&grid.axes()[direction], corner[direction]);
        let cells = axis.cells();
        match (axis, axis.boundary_at(face)) {
            (Axis::Flat, _) => vec![(0, 1.0)],
            (_, Some(Boundary::FreeSurface)) => vec![],
            (_, Some(_)) if cells == 1 => vec![(0, 1.0)],
            (_, Some(_)) if face == 0 => vec![(0, 1.5), (1, -0.5)],
            (_, Some(_)) => vec![(cells - 1, 1.5), (cells - 2, -0.5)],
            (_, None) => axis
                .cells_at_face(face)
                .into_iter()
                .flatten()
                .map(|cell| (cell, 0.5))
                .collect(),
        }
    };
    let xs = along(0);
    for (k, wz) in along(1) {
        for &(i, wx) in &xs {
            point.add_pressure(grid.cell([i, k]), wx * wz);
        }
    }
}
