//! The discrete operators of material that fills part of a grid.
//!
//! A velocity has the mass of its face and of the faces that follow it. The pressure gradient across
//! the surface is taken to p = 0 at the distance θ h where the surface crosses the line from an
//! active cell to its neighbour (Gibou, Fedkiw, Cheng & Kang, *J. Comput. Phys.* 176 (2002) 205),
//! and acts on all the mass of the velocity: a slanted surface normal to gravity is in equilibrium
//! to round-off. Quadrature points have the volume of material in their quarter of a cell, so what
//! lies outside bears nothing and the surface is free of stress.

use super::faces::{ACTIVE, ALIKE, Face, Faces, weight_onto};
use super::fraction::volume_in;
use super::ground::shores::Shores;
use super::open_ends::OpenEnds;
use super::outside::Outside;
use super::plane::Plane;
use super::sliding::SlidingPlaces;
use super::topology::{NONE, Topology};
use crate::discretisation::{
    COMPONENTS, Discretisation, Parts, QuadraturePoint, VELOCITIES, VelocityAt, add_corner_shear,
};
use crate::grid::{Axis, Boundary, DIMENSIONS, Grid, flatten, unflatten};
use crate::linear_solver::Place;
use crate::strain::{shear_row, stretching};
use crate::wall_friction::{PointLaw, SideWalls};

/// Smallest θ in the extrapolation of pressure beyond the surface.
pub(super) const NEAREST_EXTRAPOLATION: f64 = 0.25;
/// An axis along which gravity has less than this part of all of it lies across upright faces.
const UPRIGHT: f64 = 1e-9;
/// Distance of an outlet from the centres of the cells above it, in cells.
const TO_OUTLET: f64 = 0.5;
/// Ways from a cell to those beside it, in space.
const MOST_WAYS: usize = 6;
/// Cells with less material have no quadrature points.
pub(super) const EMPTY: f64 = 1e-9;
/// Most quadrature points of a cell: fewer along flat axes.
pub(crate) const POINTS: usize = points_of(DIMENSIONS);

/// Most quadrature points of a cell with so many axes.
pub(crate) const fn points_of(axes: usize) -> usize {
    1 << axes
}

/// One of the ways along which a pressure is extrapolated through the surface.
#[derive(Debug, Clone, Copy)]
pub(super) struct Way {
    /// The unknown pressure of the active cell.
    pub pressure: usize,
    /// Weight of this way: those of all of them sum to one.
    pub share: f64,
    /// What comes of the unknown pressure along it.
    pub factor: f64,
}

/// Material on a grid: what the operators are made from.
pub(crate) struct Material<'a, const D: usize = DIMENSIONS, const C: usize = COMPONENTS> {
    pub grid: &'a Grid<D>,
    pub topology: &'a Topology<D>,
    pub fractions: &'a [f64],
    pub planes: &'a [Option<Plane>],
    /// The surface where it meets ground.
    pub shores: &'a Shores,
    pub faces: &'a Faces<D>,
    /// Walls beside the plane, which rub.
    pub side_walls: Option<SideWalls>,
    /// Ends of x that are open.
    pub ends: Option<&'a OpenEnds>,
    /// Acceleration by gravity.
    pub acceleration: [f64; D],
    /// What lies beyond the surface, if it is not free.
    pub outside: Option<&'a Outside<D, C>>,
    /// Where the tractions of walls are kept along which material slides.
    pub sliding: &'a SlidingPlaces<D>,
    /// Whether its friction holds a free upright face ([`super::standing`]).
    pub stands: bool,
}

/// The operators, and the place of each quadrature point on the grid: cell times [`points_of`] plus
/// corner, and the points of walls after those of all cells.
pub(crate) struct Operators<
    const D: usize = DIMENSIONS,
    const C: usize = COMPONENTS,
    const V: usize = VELOCITIES,
> {
    pub discretisation: Discretisation<D, C, V>,
    pub places: Vec<usize>,
}

impl<const D: usize, const C: usize> Material<'_, D, C> {
    pub(crate) fn operators<const V: usize>(&self) -> Operators<D, C, V> {
        let mut parts = Parts {
            mass: self.masses(),
            components: self.faces.own.iter().map(|&(c, _)| c).collect(),
            boundary_load: vec![0.0; self.faces.own.len()],
            cells: self.faces.active.len(),
            places: self.places(),
            ..Parts::default()
        };
        self.add_pressure_forces(&mut parts);
        let mass = std::mem::take(&mut parts.mass);
        self.add_pressure_on_layers(&mass, &mut parts);
        parts.mass = mass;
        self.add_thin_layers(&mut parts);
        let most = self.most_points();
        parts.points.reserve(most);
        let mut places = Vec::with_capacity(most);
        for (cell, &fraction) in self.fractions.iter().enumerate() {
            if fraction > EMPTY {
                self.add_points(cell, &mut parts.points, &mut places);
            }
        }
        if let Some(outside) = self.outside {
            outside.lay(&mut parts, &places, self.faces, self.topology);
        }
        Operators {
            discretisation: Discretisation::of_parts(self.grid.clone(), parts),
            places,
        }
    }

    /// Points of all cells with material, those of walls left out: points are large, and to find room for more and more of
    /// them means to move them.
    pub(super) fn most_points(&self) -> usize {
        let filled = self.fractions.iter().filter(|f| **f > EMPTY).count();
        let sides = self.grid.axes().iter().filter(|axis| **axis != Axis::Flat);
        filled << sides.count()
    }

    /// Where the unknowns are, in half cells.
    pub(super) fn places(&self) -> Vec<Place<D>> {
        let velocities = self.faces.own.iter().map(|&(component, face)| {
            let mut place = unflatten(face, self.grid.faces(component)).map(|i| 2 * i as u32 + 1);
            place[component] -= 1;
            place
        });
        let counts = self.grid.cell_counts();
        let cells = self.faces.active.iter();
        let cells = cells.map(|&cell| unflatten(cell, counts).map(|i| 2 * i as u32 + 1));
        velocities.chain(cells).collect()
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

    /// Divergence of active cells, and the force of their pressure.
    fn add_pressure_forces<const V: usize>(&self, parts: &mut Parts<D, C, V>) {
        for (p, &cell) in self.faces.active.iter().enumerate() {
            for axis in 0..D {
                for side in 0..2 {
                    let face = self.topology.cell_faces[cell][axis][side];
                    if face == NONE {
                        continue;
                    }
                    let Face::Own(j) = self.faces.role[axis][face] else {
                        if self.ends.is_some() && axis == 0 {
                            self.add_flux_at_edge(p, cell, side, parts);
                        }
                        continue;
                    };
                    let outwards = if side == 1 { 1.0 } else { -1.0 };
                    let other = self.topology.cell_neighbours[cell][axis][side];
                    let distance = if other == NONE {
                        TO_OUTLET
                    } else if self.faces.pressure[other] == NONE {
                        self.surface_distance(cell, other, axis, side)
                    } else {
                        1.0
                    };
                    let spacing = self.grid.axes()[axis].spacing();
                    parts
                        .divergence
                        .push((p, j, outwards * self.grid.face_area(axis)));
                    let push = outwards * parts.mass[j] / (distance * spacing);
                    parts.gradient.push(push);
                    if let Some(outside) = self.outside
                        && other != NONE
                        && self.faces.pressure[other] == NONE
                    {
                        parts.boundary_load[j] -= push * outside.on_surface(cell, other, distance);
                    }
                }
            }
        }
    }

    /// Force of the slope of their own surface on the velocities of thin layers.
    fn add_thin_layers<const V: usize>(&self, parts: &mut Parts<D, C, V>) {
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
    fn velocity_at(&self, component: usize, index: [usize; D]) -> VelocityAt {
        let face = flatten(index, self.grid.faces(component));
        match self.faces.role[component][face] {
            Face::Own(j) | Face::Follows(j) => VelocityAt::Unknown(j),
            Face::Slides(_) | Face::Still => VelocityAt::Zero,
            Face::Loose => VelocityAt::Nowhere,
        }
    }

    /// Adds the quadrature points of one cell, one for each corner.
    fn add_points<const V: usize>(
        &self,
        cell: usize,
        points: &mut Vec<QuadraturePoint<C, V>>,
        places: &mut Vec<usize>,
    ) {
        let axes = self.grid.axes();
        let index = unflatten(cell, self.grid.cell_counts());
        let sides = axes.map(|axis| if axis == Axis::Flat { 1 } else { 2 });
        let corners: usize = sides.iter().product();
        let share = 1.0 / corners as f64;
        for corner in 0..corners {
            let side = unflatten(corner, sides);
            let (mut low, mut high) = ([0.0; 3], [1.0; 3]);
            let mut at = index;
            for axis in 0..D {
                if sides[axis] == 2 {
                    low[axis] = 0.5 * side[axis] as f64;
                    high[axis] = low[axis] + 0.5;
                    if let Some(pair) = axes[axis].faces_of_cell(index[axis]) {
                        at[axis] = pair[side[axis]];
                    }
                }
            }
            if let Some(walls) = self.side_walls {
                let filled = volume_in(self.fractions[cell], self.planes[cell].as_ref(), low, high);
                if let Some(point) = self.rubbing(walls, cell, side, filled) {
                    points.push(point);
                    places.push((self.fractions.len() + cell) * points_of(D) + corner);
                }
            }
            let filled = || volume_in(self.fractions[cell], self.planes[cell].as_ref(), low, high);
            if (0..D).any(|axis| self.slides(axis, at)) {
                self.add_sliding(cell, side, [filled(), share], points, places);
            }
            let on_outlet = self.topology.opens(cell, D - 1, side[D - 1]);
            // No thin layer ends at an open end: what crosses it is given, or moves with the column before it.
            let layer = match self.is_open(at[0]) {
                true => None,
                false => self.under_layer(cell, side, share, filled),
            };
            let volume = match (&layer, self.wall_share(cell, at)) {
                (Some(layer), _) => layer.volume,
                (None, Some(factor)) => factor * share,
                (None, None) => filled(),
            };
            if volume <= 0.0 {
                continue;
            }
            let mut point = QuadraturePoint::new(volume * self.grid.cell_volume());
            let part = self.part_beside_wall(cell, at);
            for axis in 0..D {
                for &(row, orientation) in stretching::<D>(axis) {
                    self.add_stretching(cell, axis, row, part * orientation, &mut point);
                }
            }
            for high in 1..D {
                for low in 0..high {
                    if on_outlet || self.slides(low, at) || self.slides(high, at) {
                        continue;
                    }
                    // The edge through the corner: a cell along the other axes.
                    let mut edge = index;
                    edge[low] = at[low];
                    edge[high] = at[high];
                    let row = shear_row::<D>(low, high);
                    if low == 0 && self.is_open(at[0]) {
                        self.add_shear_at_end(cell, edge, high, &mut point);
                    } else {
                        let velocity_at = |c, face| self.velocity_at(c, face);
                        let plane = [low, high];
                        add_corner_shear(self.grid, velocity_at, edge, plane, row, &mut point);
                    }
                    if part < 1.0 && ![low, high].iter().any(|&axis| self.sticks(cell, axis, at)) {
                        point.scale_rate(row, part);
                    }
                }
            }
            match &layer {
                Some(layer) => {
                    layer.scale(&mut point);
                    point.pressure_offset += layer.pressure;
                }
                None => self.add_corner_pressure(at, &mut point),
            }
            if !point.velocities().is_empty() {
                let last = D - 1;
                point.side = axes[last]
                    .boundary_at(at[last])
                    .filter(|_| !on_outlet)
                    .map(|_| usize::from(at[last] > 0));
                points.push(point);
                places.push(cell * points_of(D) + corner);
            }
        }
    }

    /// The friction of side walls on a quarter of a cell, whose velocity is that of the two faces
    /// beside it. A layer too thin for a pressure presses against them with half its weight.
    fn rubbing<const V: usize>(
        &self,
        walls: SideWalls,
        cell: usize,
        side: [usize; D],
        volume: f64,
    ) -> Option<QuadraturePoint<C, V>> {
        let mut point = QuadraturePoint::new(volume * self.grid.cell_volume());
        point.law = PointLaw::SideWalls(walls);
        for (component, side) in side.into_iter().enumerate() {
            // A flat axis has one face for each cell.
            let face = match self.topology.cell_faces[cell][component][side] {
                NONE => cell,
                face => face,
            };
            match self.faces.role[component][face].unknown() {
                Some(j) => point.add_velocity(j, component, 1.0),
                None => point.add_known_rate(component, self.known_velocity(component, face)),
            }
        }
        if self.faces.pressure[cell] != NONE {
            point.add_pressure(self.faces.pressure[cell], 1.0);
        } else {
            let slides = |&j: &usize| self.faces.lies_on[j] != NONE;
            let (axis, side) = if point.velocities().iter().any(slides) {
                (D - 1, 0)
            } else {
                (0..D)
                    .flat_map(|axis| [(axis, 0), (axis, 1)])
                    .find(|&(axis, side)| {
                        self.topology.cell_neighbours[cell][axis][side] == NONE
                            && !self.topology.opens(cell, axis, side)
                            && weight_onto(&self.acceleration, axis, side) > 0.0
                    })?
            };
            let thickness = self.fractions[cell] * self.grid.axes()[axis].spacing();
            point.pressure_offset = 0.5 * thickness * weight_onto(&self.acceleration, axis, side);
        }
        (volume > 0.0 && !point.velocities().is_empty()).then_some(point)
    }

    /// Whether a cell meets at a corner a wall across an axis to which material sticks.
    fn sticks(&self, cell: usize, axis: usize, corner: [usize; D]) -> bool {
        let sticks = matches!(
            self.grid.axes()[axis].boundary_at(corner[axis]),
            Some(Boundary::NoSlip { .. })
        );
        sticks
            && !self
                .topology
                .opens(cell, axis, usize::from(corner[axis] > 0))
    }

    /// How much of what a cell stretches, and shears in the plane of a wall, there is in the quarter of it at a
    /// corner. Along a wall to which material sticks nothing stretches, and in the middle of the quarter half as
    /// much as at the centre of the cell. All of it would take up what the material can bear and leave less traction
    /// for the wall: an error of first order in the cell size where what stretches comes to rest along a
    /// wall, as under the front of a collapse.
    fn part_beside_wall(&self, cell: usize, corner: [usize; D]) -> f64 {
        let sticks = (0..D).any(|axis| self.sticks(cell, axis, corner));
        if sticks { 0.5 } else { 1.0 }
    }

    /// At a corner on a rough wall that carries material the traction acts on the whole face, however thin the layer:
    /// the factor by which the points there count, so that they do as long as one of the cells
    /// holds material. On other walls it acts where material touches them.
    fn wall_share(&self, cell: usize, corner: [usize; D]) -> Option<f64> {
        let carries = |cell: &usize| {
            (0..D).any(|axis| {
                let side = usize::from(corner[axis] > 0);
                self.sticks(*cell, axis, corner)
                    && weight_onto(&self.acceleration, axis, side) > 0.0
            })
        };
        if !carries(&cell) {
            return None;
        }
        let (mut all, mut filled) = (0, 0);
        for cell in self.cells_at_corner(corner).filter(carries) {
            all += 1;
            filled += usize::from(self.fractions[cell] > EMPTY);
        }
        (filled > 0).then(|| all as f64 / filled as f64)
    }

    /// The cells around a corner that lie on the grid, x fastest; along a flat axis twice the same.
    fn cells_at_corner(&self, corner: [usize; D]) -> impl Iterator<Item = usize> + '_ {
        let axes = self.grid.axes();
        let around: [[Option<usize>; 2]; D] =
            std::array::from_fn(|axis| axes[axis].cells_at_face(corner[axis]));
        (0..points_of(D)).filter_map(move |nth| {
            let mut index = [0; D];
            for (axis, index) in index.iter_mut().enumerate() {
                *index = around[axis][nth >> axis & 1]?;
            }
            Some(self.grid.cell(index))
        })
    }

    /// Adds the stretching of a cell along an axis to a component of the strain rate, if both of its faces
    /// move.
    fn add_stretching<const V: usize>(
        &self,
        cell: usize,
        axis: usize,
        row: usize,
        orientation: f64,
        point: &mut QuadraturePoint<C, V>,
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
                point.add_velocity(j, row, orientation * sign * inverse);
            }
        }
        let known = self.known_velocity(axis, faces[0]);
        point.add_known_rate(row, -orientation * inverse * known);
    }

    /// The pressure at the centre of a cell as an active cell times a factor: its own, or one
    /// extrapolated through the surface.
    fn pressure_at(&self, cell: usize, nearest: f64) -> Option<(usize, f64)> {
        if self.faces.pressure[cell] != NONE {
            return Some((self.faces.pressure[cell], 1.0));
        }
        self.ways_inside(cell)
            .reduce(|best, way| if way.0 > best.0 { way } else { best })
            .map(|way| self.extrapolated(cell, way, nearest))
    }

    /// Ways from a cell to active ones beside it: how level the surface is across each, axis and side.
    fn ways_inside(&self, cell: usize) -> impl Iterator<Item = (f64, usize, usize)> + '_ {
        let ways = (0..D).flat_map(|axis| [(axis, 0), (axis, 1)]);
        ways.filter_map(move |(axis, side)| {
            let inner = self.topology.cell_neighbours[cell][axis][side];
            if inner == NONE || self.faces.pressure[inner] == NONE {
                return None;
            }
            let plane = self.plane(cell).or(self.plane(inner));
            let level = plane.map_or(1.0, |plane| {
                plane.normal[axis] * if side == 1 { -1.0 } else { 1.0 }
            });
            Some((level, axis, side))
        })
    }

    /// The pressure of the active cell along a way, continued through p = 0 at the surface.
    ///
    /// On a free surface p is the stress across it, σ_nn = s_nn − p = 0, and |s| ≤ μ p leaves nothing but p = 0 where
    /// μ < 1. With μ ≥ 1 the upright face of a column that stands bears p = s = ρ g z/2, the same on the face as behind
    /// it, so there the pressure goes on across faces along gravity as it is: through p = 0 the last cells behind the face
    /// would bear no more than half of it, and corners stand with μ ≥ 2 only. In space a corner needs more than μ = 1, and
    /// with it all faces of matter that has corners ([`super::standing`]).
    fn extrapolated(
        &self,
        cell: usize,
        (_, axis, side): (f64, usize, usize),
        nearest: f64,
    ) -> (usize, f64) {
        let inner = self.topology.cell_neighbours[cell][axis][side];
        let most = self
            .acceleration
            .iter()
            .fold(0.0_f64, |m, g| m.max(g.abs()));
        let is_free = self
            .outside
            .is_none_or(|outside| outside.cover[cell] == 0.0);
        if self.stands && is_free && self.acceleration[axis].abs() <= UPRIGHT * most {
            return (self.faces.pressure[inner], 1.0);
        }
        let beyond = self.beyond(inner, cell, axis, 1 - side);
        (self.faces.pressure[inner], beyond.extrapolation(nearest))
    }

    /// The same pressure where several ways may be alike, as on the diagonal of what mirrors itself there: the
    /// mean of all.
    pub(super) fn pressures_at(&self, cell: usize, nearest: f64) -> [Option<Way>; MOST_WAYS] {
        let mut all = [None; MOST_WAYS];
        if D == 2 || self.faces.pressure[cell] != NONE {
            all[0] = self
                .pressure_at(cell, nearest)
                .map(|(pressure, factor)| Way {
                    pressure,
                    share: 1.0,
                    factor,
                });
            return all;
        }
        let most = self.ways_inside(cell).map(|way| way.0).fold(0.0, f64::max);
        let alike = || {
            self.ways_inside(cell)
                .filter(|way| most - way.0 <= ALIKE * most)
        };
        let share = 1.0 / alike().count() as f64;
        for (slot, way) in all.iter_mut().zip(alike()) {
            let (pressure, factor) = self.extrapolated(cell, way, nearest);
            *slot = Some(Way {
                pressure,
                share,
                factor,
            });
        }
        all
    }

    /// What the pressure on a surface that is not free adds to the one extrapolated through it into a cell, by
    /// p = f p_active + (1 − f) p_surface.
    pub(super) fn pressure_beyond(&self, cell: usize, factor: f64) -> f64 {
        self.outside.map_or(0.0, |outside| {
            (1.0 - factor) * outside.on_surface(cell, cell, 0.0)
        })
    }

    /// The same for all ways to a cell; where none leads to it the pressure there is that on the surface.
    pub(super) fn pressure_from_outside(
        &self,
        cell: usize,
        ways: &[Option<Way>; MOST_WAYS],
    ) -> f64 {
        if ways[0].is_none() {
            return self.pressure_beyond(cell, 0.0);
        }
        let ways = ways.iter().flatten();
        ways.map(|way| way.share * self.pressure_beyond(cell, way.factor))
            .sum()
    }

    /// Adds the linear interpolation of pressure to a corner. On a wall it is extrapolated from the
    /// two cells above it; under a thin layer it is the layer's weight.
    fn add_corner_pressure<const V: usize>(
        &self,
        corner: [usize; D],
        point: &mut QuadraturePoint<C, V>,
    ) {
        let axes = self.grid.axes();
        // In space smooth walls are planes of symmetry, beyond which lies the same pressure.
        let wall = (0..D)
            .rev()
            .filter(|&axis| axis > 0 || !self.is_open(corner[0]))
            .find(|&axis| {
                axes[axis]
                    .boundary_at(corner[axis])
                    .is_some_and(|side| D == 2 || side.wall_velocity().is_some())
            });
        let count = self.cells_at_corner(corner).count() as f64;
        for cell in self.cells_at_corner(corner) {
            let share = 1.0 / count;
            let Some(axis) = wall else {
                let ways = self.pressures_at(cell, NEAREST_EXTRAPOLATION);
                for way in ways.iter().flatten() {
                    point.add_pressure(way.pressure, share * way.share * way.factor);
                }
                point.pressure_offset += share * self.pressure_from_outside(cell, &ways);
                continue;
            };
            let side = usize::from(corner[axis] > 0);
            match self.weight_of_one_cell(cell, axis, corner) {
                Some(weight) => point.pressure_offset += share * weight,
                None => self.add_pressure_on_wall(cell, axis, side, share, point),
            }
        }
    }

    /// The weight of a layer in which one cell has a pressure, on a floor to which it sticks. Where a flow that
    /// comes to rest is pressed together the pressure in that cell bears the stress across, up to μ p, and exceeds the
    /// weight; along the floor nothing stretches and the pressure is the weight. Extrapolated from the cell it held
    /// the front back, by an error in proportion to the cell.
    fn weight_of_one_cell(&self, cell: usize, axis: usize, corner: [usize; D]) -> Option<f64> {
        let weight = weight_onto(&self.acceleration, axis, 0);
        let above = self.topology.cell_neighbours[cell][axis][1];
        let is_one = axis == D - 1
            && corner[axis] == 0
            && weight > 0.0
            && self.sticks(cell, axis, corner)
            && self.faces.pressure[cell] != NONE
            && above != NONE
            && self.faces.pressure[above] == NONE;
        is_one.then(|| {
            let filled = self.fractions[cell] + self.fractions[above];
            weight * filled * self.grid.axes()[axis].spacing() + self.pressure_beyond(above, 0.0)
        })
    }

    /// Adds a share of the pressure on the wall beside a cell: extrapolated from it and the one behind it, under a
    /// thin layer the layer's weight, in an outlet nothing.
    pub(super) fn add_pressure_on_wall<const V: usize>(
        &self,
        cell: usize,
        axis: usize,
        side: usize,
        share: f64,
        point: &mut QuadraturePoint<C, V>,
    ) {
        if self.topology.opens(cell, axis, side) {
            return;
        }
        if self.fractions[cell] <= ACTIVE {
            let weight = weight_onto(&self.acceleration, axis, side)
                * self.fractions[cell]
                * self.grid.axes()[axis].spacing();
            point.pressure_offset += share * (weight + self.pressure_beyond(cell, 0.0));
            return;
        }
        let first = self.faces.pressure[cell];
        let next = self.topology.cell_neighbours[cell][axis][1 - side];
        let factor = match next {
            NONE => 1.0,
            next if self.faces.pressure[next] != NONE => {
                point.add_pressure(first, 1.5 * share);
                point.add_pressure(self.faces.pressure[next], -0.5 * share);
                return;
            }
            next => self.beyond(cell, next, axis, 1 - side).extrapolation(0.0),
        };
        point.add_pressure(first, 1.5 * share);
        point.add_pressure(first, -0.5 * share * factor);
        if next != NONE {
            point.pressure_offset -= 0.5 * share * self.pressure_beyond(next, factor);
        }
    }
}
