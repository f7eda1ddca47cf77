//! Strain rates at the quadrature points of material over ground, by Gauss' theorem on what is free of it.

use super::Ground;
use super::contact::Interpolation;
use crate::discretisation::QuadraturePoint;
use crate::free_surface::faces::Face;
use crate::free_surface::fraction::volume_in;
use crate::free_surface::operators::{EMPTY, Material, POINTS};
use crate::free_surface::topology::NONE;
use crate::grid::DIMENSIONS;

/// Ground whose normal has less than this of another axis lies along one.
const ALONG_AXIS: f64 = 1e-9;
/// Part of the stretching of a cell in the middle of a quarter of it on ground along an axis.
const STRETCHING_ON_GROUND: f64 = 0.5;

impl Material<'_> {
    /// Material in a quarter of a cell, in cells.
    fn quarter(&self, ground: &Ground, cell: usize, corner: usize) -> f64 {
        let free = ground.quarters[cell][corner];
        let fraction = self.fractions[cell];
        if self.planes[cell].is_none() || free == 0.0 {
            return if fraction > 0.0 { free } else { 0.0 };
        }
        let low = [0.5 * (corner % 2) as f64, 0.5 * (corner / 2) as f64, 0.0];
        let high = [low[0] + 0.5, low[1] + 0.5, 1.0];
        let all = volume_in(1.0, self.planes[cell].as_ref(), low, high);
        (all - (0.25 - free)).clamp(0.0, free)
    }

    /// Adds the quadrature points of one cell, one for each corner.
    pub(super) fn add_cell(
        &self,
        ground: &Ground,
        cell: usize,
        points: &mut Vec<QuadraturePoint>,
        places: &mut Vec<usize>,
    ) {
        for corner in 0..POINTS {
            let side = [corner % 2, corner / 2];
            let around = self.cells_around(cell, side);
            let on_ground = self.share_on_ground(ground, side, around);
            let volume = match on_ground {
                Some(share) => share * ground.quarters[cell][corner],
                None => self.quarter(ground, cell, corner),
            };
            if volume <= 0.0 {
                continue;
            }
            if let Some(walls) = self.side_walls
                && let Some(point) = self.rubbing_over(ground, walls, cell, side, volume)
            {
                points.push(point);
                places.push((self.fractions.len() + cell) * POINTS + corner);
            }
            let mut point = QuadraturePoint::new(volume * self.grid.cell_volume());
            for (axis, orientation) in [(0, 1.0), (1, -1.0)] {
                self.add_stretching_over(ground, cell, axis, orientation, &mut point);
            }
            if on_ground.is_some() && Self::sticks_along_axis(ground, cell, side, around) {
                point.scale_rate(0, STRETCHING_ON_GROUND);
            }
            self.add_shear_over(ground, cell, side, around, &mut point);
            let mut pressure = Interpolation::default();
            for place in 0..around.len() {
                pressure.add_all(&self.pressure_over(ground, place, around), 0.25);
            }
            for &(p, factor) in &pressure.terms[..pressure.count] {
                point.add_pressure(p, factor);
            }
            point.pressure_offset = pressure.known;
            if !point.velocities().is_empty() {
                points.push(point);
                places.push(cell * POINTS + corner);
            }
        }
    }

    /// The cells around a corner: its own, those beyond it along each axis, and the one across.
    fn cells_around(&self, cell: usize, side: [usize; DIMENSIONS]) -> [usize; 4] {
        let neighbours = &self.topology.cell_neighbours;
        let [x, z] = [0, 1].map(|axis| neighbours[cell][axis][side[axis]]);
        let across = match (x, z) {
            (NONE, _) | (_, NONE) => NONE,
            (x, _) => neighbours[x][1][side[1]],
        };
        [cell, x, z, across]
    }

    /// Free parts of the quarters around a corner.
    fn quarters_around(
        ground: &Ground,
        [x, z]: [usize; DIMENSIONS],
        around: [usize; 4],
    ) -> [f64; 4] {
        let corners = [x + 2 * z, 1 - x + 2 * z, x + 2 - 2 * z, 3 - x - 2 * z];
        std::array::from_fn(|n| match around[n] {
            NONE => 0.0,
            cell => ground.quarters[cell][corners[n]],
        })
    }

    /// At a corner on the ground the traction acts on all of the ground's surface, however thin the
    /// layer: the factor by which the free quarter of a cell there counts, so that the quarters of cells
    /// without material or with a thin layer of its own friction are made up for.
    fn share_on_ground(
        &self,
        ground: &Ground,
        side: [usize; DIMENSIONS],
        around: [usize; 4],
    ) -> Option<f64> {
        let parts = Self::quarters_around(ground, side, around);
        let is_shut = parts.contains(&0.0);
        let on_ground = |part: f64| part > 0.0 && (is_shut || part < 0.25 - 1e-12);
        if !on_ground(parts[0]) {
            return None;
        }
        let [mut all, mut bearing] = [0.0; 2];
        for (&cell, part) in around.iter().zip(parts) {
            if on_ground(part) {
                all += part;
                if self.fractions[cell] > EMPTY && !self.has_layer(cell) {
                    bearing += part;
                }
            }
        }
        Some(all / bearing)
    }

    /// Whether matter at a corner sticks to ground that lies along an axis, as it does to a wall of the grid: then its
    /// stretching grows in proportion to the distance from it.
    fn sticks_along_axis(
        ground: &Ground,
        cell: usize,
        side: [usize; DIMENSIONS],
        around: [usize; 4],
    ) -> bool {
        if ground.contact.slides() {
            return false;
        }
        let [x, z] = match ground.wall[cell] {
            [0.0, 0.0] => {
                // It lies on faces of the grid: the quarters tell on which side. A wall beside the grid is no ground.
                let [own, mut beside, above, mut across] =
                    Self::quarters_around(ground, side, around);
                if around[1] == NONE {
                    (beside, across) = (own, above);
                }
                [own + above - beside - across, own + beside - above - across]
            }
            normal => normal,
        };
        let [least, most] = [x.abs().min(z.abs()), x.abs().max(z.abs())];
        most > 0.0 && least <= ALONG_AXIS * most
    }

    /// Free part of the cell around a corner.
    fn free_around(&self, ground: &Ground, side: [usize; DIMENSIONS], around: [usize; 4]) -> f64 {
        Self::quarters_around(ground, side, around).iter().sum()
    }

    /// Adds the stretching of a cell along an axis to γ₁, unless one of its faces flies.
    fn add_stretching_over(
        &self,
        ground: &Ground,
        cell: usize,
        axis: usize,
        orientation: f64,
        point: &mut QuadraturePoint,
    ) {
        let faces = self.topology.cell_faces[cell][axis];
        let roles = faces.map(|face| self.faces.role[axis][face]);
        if roles.contains(&Face::Loose) {
            return;
        }
        let areas = weights(ground, faces.map(|face| ground.aperture[axis][face]));
        let inverse = orientation / (ground.free[cell] * self.grid.axes()[axis].spacing());
        for (n, sign) in [-1.0, 1.0].into_iter().enumerate() {
            if let Some(j) = moved_by(roles[n]) {
                let share = self.faces.share(axis, faces[n]);
                point.add_velocity(j, 0, sign * inverse * areas[n] * share);
            }
        }
    }

    /// Adds γ₂ = ∂u/∂z + ∂w/∂x at a corner. Where a boundary of the grid cannot hold shear there is none.
    fn add_shear_over(
        &self,
        ground: &Ground,
        cell: usize,
        side: [usize; DIMENSIONS],
        around: [usize; 4],
        point: &mut QuadraturePoint,
    ) {
        for axis in 0..DIMENSIONS {
            let edge = [0, self.grid.axes()[axis].cells()][side[axis]];
            if around[1 + axis] == NONE
                && self.grid.axes()[axis]
                    .boundary_at(edge)
                    .is_some_and(|boundary| boundary.wall_velocity().is_none())
            {
                return;
            }
        }
        let whole = self.free_around(ground, side, around);
        for component in 0..DIMENSIONS {
            let along = 1 - component;
            let own = self.topology.cell_faces[cell][component][side[component]];
            let beyond = match own {
                NONE => NONE,
                own => self.topology.face_neighbours[component][own][along][side[along]],
            };
            let pair = if side[along] == 1 {
                [own, beyond]
            } else {
                [beyond, own]
            };
            let edges = pair.map(|face| match face {
                NONE => 0.0,
                face => ground.edge[component][face],
            });
            let role = |n: usize| match pair[n] {
                NONE => Face::Still,
                face => self.faces.role[component][face],
            };
            let roles = [role(0), role(1)];
            if (0..2).any(|n| roles[n] == Face::Loose && edges[n] > 0.0) {
                continue;
            }
            let lengths = weights(ground, edges);
            let inverse = 1.0 / (whole * self.grid.axes()[along].spacing());
            for (n, sign) in [-1.0, 1.0].into_iter().enumerate() {
                if let Some(j) = moved_by(roles[n]) {
                    let share = match &self.faces.shares {
                        Some(shares) => shares[component][pair[n]][1],
                        None => 1.0,
                    };
                    point.add_velocity(j, 1, sign * inverse * lengths[n] * share);
                }
            }
        }
    }
}

/// The unknown that moves a face, of either component.
pub(super) fn moved_by(role: Face) -> Option<usize> {
    match role {
        Face::Own(j) | Face::Follows(j) | Face::Slides(j) => Some(j),
        Face::Still | Face::Loose => None,
    }
}

/// How the two free areas of a difference count: as they are where matter at the ground stands still;
/// where it slides it has the velocity next to it, which leaves their harmonic mean.
fn weights(ground: &Ground, areas: [f64; 2]) -> [f64; 2] {
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
