//! Walls of the grid along which material slides, against Coulomb friction.
//!
//! Each corner of a cell on such a wall has a quadrature point of its own for each wall through it, so that a floor
//! and a side wall that meet do not share what one of them bears. Its strain rate is that of the half cell beside
//! the wall, γ = 2 (u − U)/h along the wall; its stress is the smaller one of what the material and the wall bear
//! ([`PointLaw::OnWall`]), so what the wall does not hold is slip. The points of the material at these corners see
//! no shear across the wall.

use super::faces::weight_onto;
use super::ground::contact::sliding_place;
use super::operators::{EMPTY, Material, points_of};
use super::topology::NONE;
use crate::discretisation::QuadraturePoint;
use crate::grid::{Boundary, Grid, flatten, unflatten};
use crate::strain::shear_row;
use crate::wall_friction::{PointLaw, WallFriction};

/// Where the tractions of walls are kept: for each axis and side, the place of its first point.
#[derive(Debug, Clone, Copy)]
pub(crate) struct SlidingPlaces<const D: usize> {
    first: [[usize; 2]; D],
    /// One past the last of all.
    pub end: usize,
}

/// The friction of a wall across an axis on its low (0) or high (1) side, and the wall's velocity.
fn friction_of<const D: usize>(
    grid: &Grid<D>,
    axis: usize,
    side: usize,
) -> Option<(WallFriction, f64)> {
    let edge = [0, grid.axes()[axis].cells()][side];
    match grid.axes()[axis].boundary_at(edge) {
        Some(Boundary::CoulombWall { velocity, friction }) => Some((friction, velocity)),
        _ => None,
    }
}

/// Whether some wall holds material by more than friction.
pub(super) fn some_wall_adheres<const D: usize>(grid: &Grid<D>) -> bool {
    (0..D).any(|axis| {
        (0..2).any(|side| {
            friction_of(grid, axis, side).is_some_and(|(friction, _)| friction.cohesion > 0.0)
        })
    })
}

impl<const D: usize> SlidingPlaces<D> {
    /// The places on a grid, after all others that there may be.
    pub(crate) fn new(grid: &Grid<D>) -> Self {
        let mut end = grid.cells() * points_of(D);
        let mut first = [[NONE; 2]; D];
        for (axis, first) in first.iter_mut().enumerate() {
            for (side, first) in first.iter_mut().enumerate() {
                if friction_of(grid, axis, side).is_some() {
                    if D == 2 {
                        // In a plane there may be walls beside it and ground.
                        end = end.max(sliding_place(grid.cells(), grid.cells()));
                    }
                    *first = end;
                    end += grid.cells() / grid.axes()[axis].cells() * points_of(D - 1);
                }
            }
        }
        Self { first, end }
    }
}

impl<const D: usize> SlidingPlaces<D> {
    /// Where the traction of the wall across an axis is kept at a corner of a cell on these sides of it, if there is a
    /// wall along which material slides.
    pub(super) fn at_corner(
        &self,
        grid: &Grid<D>,
        axis: usize,
        cell: usize,
        side: [usize; D],
    ) -> Option<usize> {
        let first = self.first[axis][side[axis]];
        let index = unflatten(cell, grid.cell_counts());
        let edge = index[axis] + side[axis];
        if first == NONE || (edge != 0 && edge != grid.axes()[axis].cells()) {
            return None;
        }
        let strip = |mut numbers: [usize; D], mut counts: [usize; D]| {
            (numbers[axis], counts[axis]) = (0, 1);
            flatten(numbers, counts)
        };
        let cells_before = strip(index, grid.cell_counts()) * points_of(D - 1);
        Some(first + cells_before + strip(side, [2; D]))
    }

    /// Where the traction of the ground in a cell is kept, on a grid of so many cells.
    pub(super) fn on_ground(&self, cells: usize, cell: usize) -> usize {
        if D == 2 {
            sliding_place(cells, cell)
        } else {
            self.end + cell
        }
    }

    /// Where the friction of a thin layer on ground is kept, by the component of its unknown and the cell above its face.
    /// At a corner of that cell the stress of a material point that was there before would be taken for the layer's, and
    /// none of the corners is as near to the layer's mirror image as to the layer.
    pub(super) fn of_layer(&self, cells: usize, component: usize, cell: usize) -> usize {
        self.on_ground(cells, cells) + cell * D + component
    }
}

impl<const D: usize, const C: usize> Material<'_, D, C> {
    /// Whether a corner lies on a wall across an axis along which material slides.
    pub(super) fn slides(&self, axis: usize, corner: [usize; D]) -> bool {
        matches!(
            self.grid.axes()[axis].boundary_at(corner[axis]),
            Some(Boundary::CoulombWall { .. })
        )
    }

    /// Adds the points of sliding walls at a corner of a cell, which lies on these sides of it: over the `filled` part
    /// of the cell there, but where material lies on a floor over the `whole` one, however thin the layer is.
    pub(super) fn add_sliding<const V: usize>(
        &self,
        cell: usize,
        side: [usize; D],
        [filled, whole]: [f64; 2],
        points: &mut Vec<QuadraturePoint<C, V>>,
        places: &mut Vec<usize>,
    ) {
        let axes = self.grid.axes();
        for axis in 0..D {
            let Some(place) = self.sliding.at_corner(self.grid, axis, cell, side) else {
                continue;
            };
            let Some((friction, velocity)) = friction_of(self.grid, axis, side[axis]) else {
                continue;
            };
            if self.topology.opens(cell, axis, side[axis]) {
                continue;
            }
            let carries = weight_onto(&self.acceleration, axis, side[axis]) > 0.0;
            let share = if carries { whole } else { filled };
            if share <= 0.0 || self.fractions[cell] <= EMPTY {
                continue;
            }
            let mut point = QuadraturePoint::new(share * self.grid.cell_volume());
            point.law = PointLaw::OnWall(friction);
            let outwards = if side[axis] == 1 { -1.0 } else { 1.0 };
            let rate = outwards * 2.0 / axes[axis].spacing();
            let mut is_first = true;
            for along in (0..D).filter(|&along| along != axis) {
                let row = shear_row::<D>(along.min(axis), along.max(axis));
                // A flat axis has one face for each cell.
                let face = match self.topology.cell_faces[cell][along][side[along]] {
                    NONE => cell,
                    face => face,
                };
                match self.faces.role[along][face].unknown() {
                    Some(j) => point.add_velocity(j, row, rate),
                    None => point.add_known_rate(row, rate * self.known_velocity(along, face)),
                }
                // A wall moves along the first of its axes.
                if is_first {
                    point.add_known_rate(row, -rate * velocity);
                }
                is_first = false;
            }
            self.add_pressure_on_wall(cell, axis, side[axis], 1.0, &mut point);
            if point.velocities().is_empty() {
                continue;
            }
            point.side = (axis == D - 1).then_some(side[axis]);
            points.push(point);
            places.push(place);
        }
    }
}
