//! Strain rates at the quadrature points of material over ground, by Gauss' theorem on what is free of it.

use super::Ground;
use super::cuts::MOST_PARTS;
use crate::discretisation::QuadraturePoint;
use crate::free_surface::faces::Face;
use crate::free_surface::fraction::volume_in;
use crate::free_surface::operators::{EMPTY, Material, points_of};
use crate::free_surface::topology::NONE;
use crate::strain::{shear_row, stretching};

/// Ground whose normal has less than this of another axis lies along one.
const ALONG_AXIS: f64 = 1e-9;
/// Part of the stretching of a cell in the middle of a part of it on ground along an axis.
const STRETCHING_ON_GROUND: f64 = 0.5;

/// The cells around a corner of one of them, by its sides that are crossed on the way there: one bit for each axis.
pub(super) type Around = [usize; MOST_PARTS];

/// Cells around a corner, and one bit for each axis across which they are mirror images.
pub(super) struct Mirrored {
    pub cells: Around,
    axes: usize,
}

impl Mirrored {
    /// Free parts around the corner.
    fn parts<const D: usize>(&self, ground: &Ground<D>, corner: usize) -> [f64; MOST_PARTS] {
        let mut parts = [0.0; MOST_PARTS];
        for (bits, part) in parts.iter_mut().enumerate().take(points_of(D)) {
            if self.cells[bits] != NONE {
                *part = ground.part(self.cells[bits], corner ^ bits & !self.axes);
            }
        }
        parts
    }
}

/// The sides of a part of a cell.
pub(super) fn sides_of<const D: usize>(corner: usize) -> [usize; D] {
    std::array::from_fn(|axis| corner >> axis & 1)
}

impl<const D: usize, const C: usize> Material<'_, D, C> {
    /// Material in a part of a cell, in cells.
    fn material_in_part(&self, ground: &Ground<D>, cell: usize, corner: usize) -> f64 {
        let free = ground.part(cell, corner);
        let fraction = self.fractions[cell];
        if self.planes[cell].is_none() || free == 0.0 {
            return if fraction > 0.0 { free } else { 0.0 };
        }
        let (mut low, mut high) = ([0.0; 3], [1.0; 3]);
        for (axis, side) in sides_of::<D>(corner).into_iter().enumerate() {
            low[axis] = 0.5 * side as f64;
            high[axis] = low[axis] + 0.5;
        }
        let all = volume_in(1.0, self.planes[cell].as_ref(), low, high);
        (all - (1.0 / points_of(D) as f64 - free)).clamp(0.0, free)
    }

    /// Adds the friction of side walls on a cell, a point for each corner. Whatever lies there rubs along its sides with what
    /// there is of it, where the traction of the ground acts on all of the ground's surface, and thin layers do, too.
    pub(super) fn add_rubbing<const V: usize>(
        &self,
        ground: &Ground<D>,
        cell: usize,
        points: &mut Vec<QuadraturePoint<C, V>>,
        places: &mut Vec<usize>,
    ) {
        let Some(walls) = self.side_walls else { return };
        for corner in 0..points_of(D) {
            let beside = self.material_in_part(ground, cell, corner);
            if beside > 0.0
                && let Some(point) =
                    self.rubbing_over(ground, walls, cell, sides_of::<D>(corner), beside)
            {
                points.push(point);
                places.push((self.fractions.len() + cell) * points_of(D) + corner);
            }
        }
    }

    /// Adds the quadrature points of one cell, one for each corner.
    pub(super) fn add_cell<const V: usize>(
        &self,
        ground: &Ground<D>,
        cell: usize,
        points: &mut Vec<QuadraturePoint<C, V>>,
        places: &mut Vec<usize>,
    ) {
        let rows = stretching_rows::<D>(leaning(ground, cell));
        for corner in 0..points_of(D) {
            let side = sides_of::<D>(corner);
            let around = self.cells_around(cell, side);
            let mirrored = self.mirrored(around);
            let on_ground = self.share_on_ground(ground, corner, &mirrored);
            let filled = || self.material_in_part(ground, cell, corner);
            let layer = match on_ground {
                Some(_) => None,
                None => self.under_layer(cell, side, 1.0 / points_of(D) as f64, filled),
            };
            let volume = match (on_ground, &layer) {
                (Some(share), _) => share * ground.part(cell, corner),
                (None, Some(layer)) => layer.volume,
                (None, None) => filled(),
            };
            if volume <= 0.0 {
                continue;
            }
            let mut point = QuadraturePoint::new(volume * self.grid.cell_volume());
            for (axis, rows) in rows.iter().enumerate() {
                for &(row, orientation) in rows {
                    if orientation != 0.0 {
                        self.add_stretching_over(
                            ground,
                            cell,
                            axis,
                            (row, orientation),
                            &mut point,
                        );
                    }
                }
            }
            let axis = on_ground.and_then(|_| Self::sticks_along_axis(ground, corner, &mirrored));
            for high in 1..D {
                for low in 0..high {
                    self.add_shear_over(ground, corner, &around, [low, high], &mut point);
                    if axis.is_some_and(|axis| axis != low && axis != high) {
                        point.scale_rate(shear_row::<D>(low, high), STRETCHING_ON_GROUND);
                    }
                }
            }
            if axis.is_some() {
                for row in 0..D - 1 {
                    point.scale_rate(row, STRETCHING_ON_GROUND);
                }
            }
            if let Some(layer) = &layer {
                layer.scale(&mut point);
                point.pressure_offset = layer.pressure;
            } else {
                let press = on_ground.map(|_| self.press_on_ground(ground, cell, axis));
                let pressure = self.pressure_at_corner(ground, corner, &mirrored, press);
                for &(p, factor) in pressure.terms() {
                    point.add_pressure(p, factor);
                }
                point.pressure_offset = pressure.known;
            }
            if !point.velocities().is_empty() {
                points.push(point);
                places.push(cell * points_of(D) + corner);
            }
        }
    }

    /// The same cells with mirror images beyond smooth walls of the grid, which in space are planes of symmetry.
    fn mirrored(&self, mut cells: Around) -> Mirrored {
        let mut axes = 0;
        for axis in (0..D).filter(|_| D > 2) {
            if cells[1 << axis] == NONE && self.is_smooth(axis, cells[0]) {
                axes |= 1 << axis;
                for bits in (0..points_of(D)).filter(|bits| bits >> axis & 1 == 1) {
                    cells[bits] = cells[bits ^ (1 << axis)];
                }
            }
        }
        Mirrored { cells, axes }
    }

    /// Whether the wall of the grid beside a cell across an axis bears no shear; where it is the only one of its axis,
    /// both have to.
    fn is_smooth(&self, axis: usize, cell: usize) -> bool {
        let beside = self.topology.cell_neighbours[cell][axis];
        let edges = [0, self.grid.axes()[axis].cells()];
        (0..2).filter(|&side| beside[side] == NONE).all(|side| {
            self.grid.axes()[axis]
                .boundary_at(edges[side])
                .is_some_and(|boundary| boundary.wall_velocity().is_none())
        })
    }

    /// The cells around a corner: those beyond its own along each axis, and along several.
    fn cells_around(&self, cell: usize, side: [usize; D]) -> Around {
        let mut around = [NONE; MOST_PARTS];
        around[0] = cell;
        for axis in 0..D {
            for bits in 0..1 << axis {
                around[bits | 1 << axis] = match around[bits] {
                    NONE => NONE,
                    at => self.topology.cell_neighbours[at][axis][side[axis]],
                };
            }
        }
        around
    }

    /// At a corner on the ground the traction acts on all of the ground's surface, however thin the
    /// layer: the factor by which the free part of a cell there counts, so that the parts of cells
    /// without material or with a thin layer of its own friction are made up for.
    fn share_on_ground(&self, ground: &Ground<D>, corner: usize, around: &Mirrored) -> Option<f64> {
        let parts = around.parts(ground, corner);
        let whole = 1.0 / points_of(D) as f64;
        let is_shut = parts[..points_of(D)].contains(&0.0);
        let on_ground = |part: f64| part > 0.0 && (is_shut || part < whole - 1e-12);
        if !on_ground(parts[0]) {
            return None;
        }
        let [mut all, mut bearing] = [0.0; 2];
        for (&cell, part) in around.cells.iter().zip(parts) {
            if on_ground(part) {
                all += part;
                if self.fractions[cell] > EMPTY && !self.has_layer(cell) {
                    bearing += part;
                }
            }
        }
        Some(all / bearing)
    }

    /// The axis across which ground lies at a corner if matter sticks to it there, as it does to a wall of the grid: then
    /// what it stretches grows in proportion to the distance from it.
    fn sticks_along_axis(ground: &Ground<D>, corner: usize, around: &Mirrored) -> Option<usize> {
        if ground.contact.slides() {
            return None;
        }
        let mut normal = ground.wall[around.cells[0]];
        if normal == [0.0; D] {
            // It lies on faces of the grid: the parts tell on which side. A wall beside the grid is no ground.
            let parts = around.parts(ground, corner);
            let beyond = (0..D - 1).filter(|axis| around.cells[1 << axis] == NONE);
            let walls = beyond.fold(0, |bits, axis| bits | 1 << axis);
            for bits in 0..points_of(D) {
                for (axis, n) in normal.iter_mut().enumerate() {
                    let part = parts[bits & !walls];
                    *n += if bits >> axis & 1 == 1 { -part } else { part };
                }
            }
        }
        let size = |axis: &usize| normal[*axis].abs();
        let most = (0..D).max_by(|a, b| size(a).total_cmp(&size(b)))?;
        let others = (0..D).filter(|&axis| axis != most);
        let is_level =
            size(&most) > 0.0 && { others }.all(|axis| size(&axis) <= ALONG_AXIS * size(&most));
        is_level.then_some(most)
    }

    /// Adds the stretching of a cell along an axis to a row of the strain rate, unless one of its faces flies.
    fn add_stretching_over<const V: usize>(
        &self,
        ground: &Ground<D>,
        cell: usize,
        axis: usize,
        (row, orientation): (usize, f64),
        point: &mut QuadraturePoint<C, V>,
    ) {
        let faces = self.topology.cell_faces[cell][axis];
        let roles = faces.map(|face| self.faces.role[axis][face]);
        if roles.contains(&Face::Loose) {
            return;
        }
        let areas = weights(ground, faces.map(|face| ground.aperture[axis][face]));
        let inverse = orientation / (ground.free[cell] * self.grid.axes()[axis].spacing());
        for (n, sign) in [-1.0, 1.0].into_iter().enumerate() {
            for (j, share) in self.faces.moved_by(axis, faces[n], axis) {
                if j != NONE {
                    point.add_velocity(j, row, sign * inverse * areas[n] * share);
                }
            }
        }
    }

    /// Adds ∂u/∂z + ∂w/∂x of two axes at the line between cells through a corner. Where a boundary of the grid cannot
    /// hold shear there is none.
    fn add_shear_over<const V: usize>(
        &self,
        ground: &Ground<D>,
        corner: usize,
        around: &Around,
        pair: [usize; 2],
        point: &mut QuadraturePoint<C, V>,
    ) {
        let (cell, side) = (around[0], sides_of::<D>(corner));
        for axis in pair {
            let edge = [0, self.grid.axes()[axis].cells()][side[axis]];
            if around[1 << axis] == NONE
                && self.grid.axes()[axis]
                    .boundary_at(edge)
                    .is_some_and(|boundary| boundary.wall_velocity().is_none())
            {
                return;
            }
        }
        let row = shear_row::<D>(pair[0], pair[1]);
        let whole = free_around(ground, corner, around, pair);
        for (component, along) in [(pair[0], pair[1]), (pair[1], pair[0])] {
            let own = self.topology.cell_faces[cell][component][side[component]];
            let beyond = match own {
                NONE => NONE,
                own => self.topology.face_neighbours[component][own][along][side[along]],
            };
            let ends = if side[along] == 1 {
                [own, beyond]
            } else {
                [beyond, own]
            };
            let edges = ends.map(|face| match face {
                NONE => 0.0,
                face => ground.edge[component][face][along],
            });
            let role = |n: usize| match ends[n] {
                NONE => Face::Still,
                face => self.faces.role[component][face],
            };
            let roles = [role(0), role(1)];
            if (0..2).any(|n| roles[n] == Face::Loose && edges[n] > 0.0) {
                continue;
            }
            let areas = weights(ground, edges);
            let inverse = 1.0 / (whole * self.grid.axes()[along].spacing());
            for (n, sign) in [-1.0, 1.0].into_iter().enumerate() {
                // In space a point has room for one velocity of each face: the layer beside it, which has its own
                // friction, counts as standing still.
                if ends[n] == NONE || (D > 2 && matches!(roles[n], Face::Slides(_))) {
                    continue;
                }
                for (j, share) in self.faces.moved_by(component, ends[n], along) {
                    if j != NONE {
                        point.add_velocity(j, row, sign * inverse * areas[n] * share);
                    }
                }
            }
        }
    }
}

/// The horizontal direction that the ground leans to in the cells that share a cell's pressure, in space; none where it is
/// level or there is none.
fn leaning<const D: usize>(ground: &Ground<D>, cell: usize) -> Option<[f64; 2]> {
    let master = ground.master[cell];
    if D == 2 || master == NONE {
        return None;
    }
    let mut normal = [0.0; D];
    for member in std::iter::once(master).chain(ground.parts_of(master)) {
        for (n, wall) in normal.iter_mut().zip(ground.wall[member]) {
            *n += wall;
        }
    }
    let size = normal[0].hypot(normal[1]);
    (size > ALONG_AXIS * normal[D - 1].abs()).then(|| [normal[0] / size, normal[1] / size])
}

/// The rows of the strain rate to which ∂u/∂x of each axis belongs, with their factors.
///
/// Of the cells that share a pressure none is free of divergence by itself. What there is of it, d, is no strain of the
/// material: it is taken off as D − d/2 (e_z e_z + e_h e_h), e_h the horizontal direction that the ground leans to, which is
/// what the plane flow across such ground does whatever the direction of e_h. (The deviator alone would take off a third
/// from each axis, and flow in space over ground that is the same all along y would not be plane flow.)
fn stretching_rows<const D: usize>(leaning: Option<[f64; 2]>) -> [[(usize, f64); 3]; D] {
    let mut rows = [[(0, 0.0); 3]; D];
    for (axis, rows) in rows.iter_mut().enumerate() {
        for (slot, &row) in rows.iter_mut().zip(stretching::<D>(axis)) {
            *slot = row;
        }
    }
    let Some([x, y]) = leaning else { return rows };
    // The rows of what is taken off.
    let taken = [0.5 * x * x, 0.5 * y * y, 0.5];
    let mut off = [0.0; 2];
    for (axis, share) in taken.into_iter().enumerate() {
        for &(row, factor) in stretching::<D>(axis) {
            off[row] += share * factor;
        }
    }
    for rows in &mut rows {
        let mut own = [0.0; 2];
        for &(row, factor) in rows.iter() {
            own[row] += factor;
        }
        *rows = [
            (0, own[0] - off[0]),
            (1, own[1] - off[1]),
            (shear_row::<D>(0, 1), -x * y),
        ];
    }
    rows
}

/// Free part of the cell around the line between cells that runs through a corner across two axes.
fn free_around<const D: usize>(
    ground: &Ground<D>,
    corner: usize,
    around: &Around,
    [low, high]: [usize; 2],
) -> f64 {
    let crossed = 1 << low | 1 << high;
    let mut sum = 0.0;
    for bits in (0..points_of(D)).filter(|bits| bits & !crossed == 0) {
        if around[bits] == NONE {
            continue;
        }
        // All along the line: both sides of the other axes.
        for rest in (0..points_of(D)).filter(|rest| rest & crossed == 0) {
            sum += ground.part(around[bits], corner ^ bits ^ rest);
        }
    }
    sum
}

/// How the two free areas of a difference count: as they are where matter at the ground stands still;
/// where it slides it has the velocity next to it, which leaves their harmonic mean.
fn weights<const D: usize>(ground: &Ground<D>, areas: [f64; 2]) -> [f64; 2] {
    if !ground.contact.slides() {
        return areas;
    }
    let sum = areas[0] + areas[1];
    let mean = if sum > 0.0 {
        2.0 * areas[0] * areas[1] / sum
    } else {
        0.0
    };
    [mean; 2]
}
