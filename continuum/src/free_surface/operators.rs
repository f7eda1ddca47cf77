//! The discrete operators of material that fills part of a grid.
//!
//! A velocity has the mass of its face and of the faces that follow it. The pressure gradient across
//! the surface is taken to p = 0 at the distance θ h where the surface crosses the line from an
//! active cell to its neighbour (Gibou, Fedkiw, Cheng & Kang, *J. Comput. Phys.* 176 (2002) 205),
//! and acts on all the mass of the velocity: a slanted surface normal to gravity is in equilibrium
//! to round-off. Quadrature points have the volume of material in their quarter of a cell, so what
//! lies outside bears nothing and the surface is free of stress.

use super::faces::{ACTIVE, Face, Faces, weight_onto};
use super::fraction::volume_in;
use super::open_ends::Inflow;
use super::plane::Plane;
use super::topology::{NONE, Topology};
use crate::discretisation::{Discretisation, Parts, QuadraturePoint, VelocityAt, add_corner_shear};
use crate::grid::{Axis, DIMENSIONS, Grid};
use crate::linear_solver::Place;
use crate::wall_friction::{PointLaw, SideWalls};

/// Smallest θ in the pressure gradient and in the pressure at walls.
const NEAREST_SURFACE: f64 = 0.005;
/// Smallest θ in the extrapolation of pressure beyond the surface.
pub(super) const NEAREST_EXTRAPOLATION: f64 = 0.25;
/// Cells with less material have no quadrature points.
pub(super) const EMPTY: f64 = 1e-9;
/// Most quadrature points of a cell: fewer along flat axes.
pub(crate) const POINTS: usize = 1 << DIMENSIONS;

/// Material on a grid: what the operators are made from.
pub(crate) struct Material<'a> {
    pub grid: &'a Grid,
    pub topology: &'a Topology,
    pub fractions: &'a [f64],
    pub planes: &'a [Option<Plane>],
    pub faces: &'a Faces,
    /// Walls beside the plane, which rub.
    pub side_walls: Option<SideWalls>,
    /// What flows in at the low end of x, where the ends are open.
    pub inflow: Option<&'a Inflow>,
    /// Acceleration by gravity.
    pub acceleration: [f64; DIMENSIONS],
}

/// The operators, and the place of each quadrature point on the grid: cell times [`POINTS`] plus
/// corner, and the points of side walls after those of all cells.
pub(crate) struct Operators {
    pub discretisation: Discretisation,
    pub places: Vec<usize>,
}

impl Material<'_> {
    pub(crate) fn operators(&self) -> Operators {
        let mut parts = Parts {
            mass: self.masses(),
            components: self.faces.own.iter().map(|&(c, _)| c).collect(),
            boundary_load: vec![0.0; self.faces.own.len()],
            cells: self.faces.active.len(),
            places: self.places(),
            ..Parts::default()
        };
        self.add_pressure_forces(&mut parts);
        self.add_thin_layers(&mut parts);
        let mut places = Vec::new();
        for (cell, &fraction) in self.fractions.iter().enumerate() {
            if fraction > EMPTY {
                self.add_points(cell, &mut parts.points, &mut places);
            }
        }
        Operators {
            discretisation: Discretisation::of_parts(self.grid.clone(), parts),
            places,
        }
    }

    /// Where the unknowns are, in half cells.
    pub(super) fn places(&self) -> Vec<Place> {
        let velocities = self.faces.own.iter().map(|&(component, face)| {
            let width = self.grid.faces(component)[0];
            let mut place = [2 * (face % width) as u32, 2 * (face / width) as u32];
            place[1 - component] += 1;
            place
        });
        let width = self.grid.axes()[0].cells();
        let cells = self.faces.active.iter();
        let cells = cells.map(|cell| [(cell % width) as u32, (cell / width) as u32]);
        velocities
            .chain(cells.map(|index| index.map(|i| 2 * i + 1)))
            .collect()
    }

    /// Mass of each unknown, followers included.
    pub(super) fn masses(&self) -> Vec<f64> {
        let mut mass = vec![0.0; self.faces.own.len()];
        let volume = self.grid.cell_volume();
        for (component, roles) in self.faces.role.iter().enumerate() {
            for (face, role) in roles.iter().enumerate() {
                if let Some(j) = role.unknown() {
                    mass[j] += volume * self.topology.face_mean(component, face, self.fractions);
                }
            }
        }
        mass
    }

    /// Distance θ, in cells, from the centre of an active cell to the surface on the way to its
    /// inactive neighbour along an axis.
    pub(super) fn surface_distance(
        &self,
        active: usize,
        other: usize,
        axis: usize,
        side: usize,
    ) -> f64 {
        let mut step = [0.0; DIMENSIONS];
        step[axis] = if side == 1 { 1.0 } else { -1.0 };
        let back = step.map(|s| -s);
        let here = [0.0; DIMENSIONS];
        let (inner, outer) = match (&self.planes[active], &self.planes[other]) {
            (Some(a), Some(b)) => (depth_of_centre(a, here), depth_of_centre(b, here)),
            (Some(a), None) => (depth_of_centre(a, here), depth_of_centre(a, step)),
            (None, Some(b)) => (depth_of_centre(b, back), depth_of_centre(b, here)),
            (None, None) => (0.5, -0.5),
        };
        if inner <= 0.0 {
            NEAREST_SURFACE
        } else if outer >= 0.0 {
            1.0
        } else {
            (inner / (inner - outer)).clamp(NEAREST_SURFACE, 1.0)
        }
    }

    /// Divergence of active cells, and the force of their pressure.
    fn add_pressure_forces(&self, parts: &mut Parts) {
        for (p, &cell) in self.faces.active.iter().enumerate() {
            for axis in 0..DIMENSIONS {
                for side in 0..2 {
                    let face = self.topology.cell_faces[cell][axis][side];
                    if face == NONE {
                        continue;
                    }
                    let Face::Own(j) = self.faces.role[axis][face] else {
                        if self.inflow.is_some() && axis == 0 {
                            self.add_flux_at_edge(p, cell, side, parts);
                        }
                        continue;
                    };
                    let outwards = if side == 1 { 1.0 } else { -1.0 };
                    let other = self.topology.cell_neighbours[cell][axis][side];
                    let distance = if self.faces.pressure[other] == NONE {
                        self.surface_distance(cell, other, axis, side)
                    } else {
                        1.0
                    };
                    let spacing = self.grid.axes()[axis].spacing();
                    parts
                        .divergence
                        .push((p, j, outwards * self.grid.face_area(axis)));
                    parts
                        .gradient
                        .push(outwards * parts.mass[j] / (distance * spacing));
                }
            }
        }
    }

    /// Force of the slope of their own surface on the velocities of thin layers.
    fn add_thin_layers(&self, parts: &mut Parts) {
        for (j, &(component, face)) in self.faces.own.iter().enumerate() {
            if !self.faces.is_thin[j] {
                continue;
            }
            let wall = self
                .faces
                .wall_under(self.grid, self.topology, component, face);
            let Some((axis, side)) = wall else { continue };
            let [low, high] = self.topology.face_cells[component][face];
            let thickness = self.grid.axes()[axis].spacing();
            let slope = (self.fractions[high] - self.fractions[low]) * thickness
                / self.grid.axes()[component].spacing();
            parts.boundary_load[j] -=
                parts.mass[j] * weight_onto(&self.acceleration, axis, side) * slope;
        }
    }

    /// The velocity on a face, as an operator at a point sees it.
    fn velocity_at(&self, component: usize, index: [usize; DIMENSIONS]) -> VelocityAt {
        let face = index[0] + self.grid.faces(component)[0] * index[1];
        match self.faces.role[component][face] {
            Face::Own(j) | Face::Follows(j) => VelocityAt::Unknown(j),
            Face::Slides(_) | Face::Still => VelocityAt::Zero,
            Face::Loose => VelocityAt::Nowhere,
        }
    }

    /// Adds the quadrature points of one cell, one for each corner.
    fn add_points(&self, cell: usize, points: &mut Vec<QuadraturePoint>, places: &mut Vec<usize>) {
        let nx = self.grid.axes()[0].cells();
        let index = [cell % nx, cell / nx];
        let sides = |axis: usize| {
            if self.grid.axes()[axis] == Axis::Flat {
                1
            } else {
                2
            }
        };
        for (corner, side) in (0..sides(1))
            .flat_map(|k| (0..sides(0)).map(move |i| [i, k]))
            .enumerate()
        {
            let (mut low, mut high) = ([0.0; 3], [1.0; 3]);
            let mut at = index;
            for axis in 0..DIMENSIONS {
                if sides(axis) == 2 {
                    low[axis] = 0.5 * side[axis] as f64;
                    high[axis] = low[axis] + 0.5;
                    if let Some(pair) = self.grid.axes()[axis].faces_of_cell(index[axis]) {
                        at[axis] = pair[side[axis]];
                    }
                }
            }
            if let Some(walls) = self.side_walls {
                let filled = volume_in(self.fractions[cell], self.planes[cell].as_ref(), low, high);
                if let Some(point) = self.rubbing(walls, cell, side, filled) {
                    points.push(point);
                    places.push((self.fractions.len() + cell) * POINTS + corner);
                }
            }
            let share = 1.0 / (sides(0) * sides(1)) as f64;
            let volume = match self.wall_share(at) {
                Some(factor) => factor * share,
                None => volume_in(self.fractions[cell], self.planes[cell].as_ref(), low, high),
            };
            if volume <= 0.0 {
                continue;
            }
            let mut point = QuadraturePoint::new(volume * self.grid.cell_volume());
            for (axis, orientation) in [(0, 1.0), (1, -1.0)] {
                self.add_stretching(cell, axis, orientation, &mut point);
            }
            if !self.add_shear_at_edge(at, &mut point) {
                add_corner_shear(
                    self.grid,
                    |c, face| self.velocity_at(c, face),
                    at,
                    &mut point,
                );
            }
            self.add_corner_pressure(at, &mut point);
            if !point.velocities().is_empty() {
                point.side = self.grid.axes()[1]
                    .boundary_at(at[1])
                    .map(|_| usize::from(at[1] > 0));
                points.push(point);
                places.push(cell * POINTS + corner);
            }
        }
    }

    /// The friction of side walls on a quarter of a cell, whose velocity is that of the two faces
    /// beside it. A layer too thin for a pressure presses against them with half its weight.
    fn rubbing(
        &self,
        walls: SideWalls,
        cell: usize,
        side: [usize; DIMENSIONS],
        volume: f64,
    ) -> Option<QuadraturePoint> {
        let mut point = QuadraturePoint::new(volume * self.grid.cell_volume());
        point.law = PointLaw::SideWalls(walls);
        for (component, side) in side.into_iter().enumerate() {
            // A flat axis has one face for each cell.
            let face = match self.topology.cell_faces[cell][component][side] {
                NONE => cell,
                face => face,
            };
            if let Some(j) = self.faces.role[component][face].unknown() {
                point.add_velocity(j, component, 1.0);
            }
        }
        if self.faces.pressure[cell] != NONE {
            point.add_pressure(self.faces.pressure[cell], 1.0);
        } else {
            let (axis, side) = (0..DIMENSIONS)
                .flat_map(|axis| [(axis, 0), (axis, 1)])
                .find(|&(axis, side)| {
                    self.topology.cell_neighbours[cell][axis][side] == NONE
                        && weight_onto(&self.acceleration, axis, side) > 0.0
                })?;
            let thickness = self.fractions[cell] * self.grid.axes()[axis].spacing();
            point.pressure_offset = 0.5 * thickness * weight_onto(&self.acceleration, axis, side);
        }
        (volume > 0.0 && !point.velocities().is_empty()).then_some(point)
    }

    /// At a corner on a rough wall the traction acts on the whole face, however thin the layer:
    /// the factor by which the points there count, so that they do as long as one of the cells
    /// holds material.
    fn wall_share(&self, corner: [usize; DIMENSIONS]) -> Option<f64> {
        let axes = self.grid.axes();
        let rough = (0..DIMENSIONS).any(|axis| {
            axes[axis]
                .boundary_at(corner[axis])
                .is_some_and(|side| side.wall_velocity().is_some())
        });
        let cells = self.cells_at_corner(corner);
        let all = cells.iter().flatten().count();
        let filled = cells
            .iter()
            .flatten()
            .filter(|&&cell| self.fractions[cell] > EMPTY)
            .count();
        (rough && filled > 0).then(|| all as f64 / filled as f64)
    }

    fn cells_at_corner(&self, corner: [usize; DIMENSIONS]) -> [Option<usize>; 4] {
        let axes = self.grid.axes();
        let xs = axes[0].cells_at_face(corner[0]);
        let zs = axes[1].cells_at_face(corner[1]);
        let cell = |x: Option<usize>, z: Option<usize>| Some(self.grid.cell([x?, z?]));
        [
            cell(xs[0], zs[0]),
            cell(xs[1], zs[0]),
            cell(xs[0], zs[1]),
            cell(xs[1], zs[1]),
        ]
    }

    /// Adds the stretching of a cell along an axis to γ₁, if both of its faces move.
    fn add_stretching(
        &self,
        cell: usize,
        axis: usize,
        orientation: f64,
        point: &mut QuadraturePoint,
    ) {
        let faces = self.topology.cell_faces[cell][axis];
        if faces.contains(&NONE) {
            return;
        }
        let roles = faces.map(|face| self.faces.role[axis][face]);
        if roles.contains(&Face::Loose) {
            return;
        }
        let inverse = 1.0 / self.grid.axes()[axis].spacing();
        for (role, sign) in roles.into_iter().zip([-1.0, 1.0]) {
            if let Some(j) = role.unknown() {
                point.add_velocity(j, 0, orientation * sign * inverse);
            }
        }
        let known = self.known_velocity(axis, faces[0]);
        point.add_known_rate(0, -orientation * inverse * known);
    }

    /// The pressure at the centre of a cell as an active cell times a factor: its own, or one
    /// extrapolated through the surface.
    pub(super) fn pressure_at(&self, cell: usize, nearest: f64) -> Option<(usize, f64)> {
        if self.faces.pressure[cell] != NONE {
            return Some((self.faces.pressure[cell], 1.0));
        }
        let mut best: Option<(f64, usize, f64)> = None;
        for axis in 0..DIMENSIONS {
            for side in 0..2 {
                let inner = self.topology.cell_neighbours[cell][axis][side];
                if inner == NONE || self.faces.pressure[inner] == NONE {
                    continue;
                }
                let level = self.planes[cell]
                    .as_ref()
                    .or(self.planes[inner].as_ref())
                    .map_or(1.0, |plane| {
                        plane.normal[axis] * if side == 1 { -1.0 } else { 1.0 }
                    });
                if best.is_none_or(|(most, _, _)| level > most) {
                    let distance = self
                        .surface_distance(inner, cell, axis, 1 - side)
                        .max(nearest);
                    best = Some((
                        level,
                        self.faces.pressure[inner],
                        (distance - 1.0) / distance,
                    ));
                }
            }
        }
        best.map(|(_, p, factor)| (p, factor))
    }

    /// Adds the linear interpolation of pressure to a corner. On a wall it is extrapolated from the
    /// two cells above it; under a thin layer it is the layer's weight.
    fn add_corner_pressure(&self, corner: [usize; DIMENSIONS], point: &mut QuadraturePoint) {
        let axes = self.grid.axes();
        let wall = (0..DIMENSIONS)
            .rev()
            .filter(|&axis| axis > 0 || self.inflow.is_none())
            .find(|&axis| axes[axis].boundary_at(corner[axis]).is_some());
        let cells = self.cells_at_corner(corner);
        let count = cells.iter().flatten().count() as f64;
        for cell in cells.into_iter().flatten() {
            let share = 1.0 / count;
            let Some(axis) = wall else {
                if let Some((p, factor)) = self.pressure_at(cell, NEAREST_EXTRAPOLATION) {
                    point.add_pressure(p, share * factor);
                }
                continue;
            };
            let side = usize::from(corner[axis] > 0);
            let spacing = axes[axis].spacing();
            if self.fractions[cell] <= ACTIVE {
                let weight =
                    weight_onto(&self.acceleration, axis, side) * self.fractions[cell] * spacing;
                point.pressure_offset += share * weight;
                continue;
            }
            let first = self.faces.pressure[cell];
            let second = match self.topology.cell_neighbours[cell][axis][1 - side] {
                NONE => Some((first, 1.0)),
                next if self.faces.pressure[next] != NONE => Some((self.faces.pressure[next], 1.0)),
                next => {
                    let distance = self.surface_distance(cell, next, axis, 1 - side);
                    Some((first, (distance - 1.0) / distance))
                }
            };
            point.add_pressure(first, 1.5 * share);
            if let Some((p, factor)) = second {
                point.add_pressure(p, -0.5 * share * factor);
            }
        }
    }
}

/// Depth below a plane, in cells, of the centre of the cell that lies so many steps from its own.
fn depth_of_centre(plane: &Plane, steps: [f64; DIMENSIONS]) -> f64 {
    let mut point = [0.5; 3];
    for (x, step) in point.iter_mut().zip(steps) {
        *x += step;
    }
    plane.depth(point)
}
