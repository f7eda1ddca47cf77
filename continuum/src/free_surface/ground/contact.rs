//! Pressure at the ground, and the friction of ground and side walls.

use super::Ground;
use super::points::moved_by;
use crate::discretisation::QuadraturePoint;
use crate::free_surface::faces::weight_onto;
use crate::free_surface::operators::{Material, NEAREST_EXTRAPOLATION, POINTS};
use crate::free_surface::topology::NONE;
use crate::grid::DIMENSIONS;
use crate::wall_friction::{PointLaw, SideWalls, WallFriction};

/// Most cells from whose pressures that of a point is interpolated.
const MOST_PRESSURES: usize = 4;

/// A sum of pressures times factors, and a pressure that is known.
#[derive(Default, Clone, Copy)]
pub(super) struct Interpolation {
    pub terms: [(usize, f64); MOST_PRESSURES],
    pub count: usize,
    pub known: f64,
}

impl Interpolation {
    fn add(&mut self, pressure: usize, factor: f64) {
        let known = self.terms[..self.count]
            .iter()
            .position(|&(p, _)| p == pressure);
        match known {
            Some(n) => self.terms[n].1 += factor,
            None if self.count < MOST_PRESSURES => {
                self.terms[self.count] = (pressure, factor);
                self.count += 1;
            }
            // No room: the first one stands for it.
            None => self.terms[0].1 += factor,
        }
    }

    pub fn add_all(&mut self, other: &Self, factor: f64) {
        self.known += factor * other.known;
        for &(pressure, share) in &other.terms[..other.count] {
            self.add(pressure, factor * share);
        }
    }
}

impl Material<'_> {
    /// The pressure at the centre of a cell beside a corner. In ground, and in cells that share the
    /// pressure of another one, it is extrapolated; above the surface through p = 0.
    pub(super) fn pressure_over(
        &self,
        ground: &Ground,
        place: usize,
        around: [usize; 4],
    ) -> Interpolation {
        let cell = around[place];
        let mut found = Interpolation::default();
        let pressure = |cell: usize| match cell {
            NONE => NONE,
            cell => self.faces.pressure[cell],
        };
        if pressure(cell) != NONE {
            found.add(pressure(cell), 1.0);
            return found;
        }
        if cell != NONE && ground.master[cell] == cell {
            if ground.wall[cell] != [0.0; DIMENSIONS] {
                found.known = self.layer_weight(ground, cell);
            } else if let Some((p, factor)) = self.pressure_at(cell, NEAREST_EXTRAPOLATION) {
                found.add(p, factor);
            }
            return found;
        }
        // Along each axis, from the cell beside it at the same corner, and the one behind that.
        let mut ways = 0.0;
        for axis in 0..DIMENSIONS {
            let beside = around[place ^ (1 << axis)];
            if pressure(beside) == NONE {
                let is_layer = beside != NONE
                    && ground.master[beside] == beside
                    && ground.wall[beside] != [0.0; DIMENSIONS];
                if is_layer {
                    found.known += self.layer_weight(ground, beside);
                    ways += 1.0;
                }
                continue;
            }
            // Away from the cell.
            let side = match cell {
                NONE => usize::from(self.topology.cell_neighbours[beside][axis][0] == NONE),
                cell => usize::from(self.topology.cell_neighbours[beside][axis][0] == cell),
            };
            let behind = self.topology.cell_neighbours[beside][axis][side];
            let p = pressure(beside);
            ways += 1.0;
            if pressure(behind) != NONE {
                found.add(p, 2.0);
                found.add(pressure(behind), -1.0);
            } else if behind != NONE && ground.master[behind] == behind {
                let distance = self.surface_distance(beside, behind, axis, side);
                found.add(p, 1.0 + 1.0 / distance);
            } else {
                found.add(p, 1.0);
            }
        }
        if ways > 1.0 {
            found.known /= ways;
            for (_, factor) in &mut found.terms[..found.count] {
                *factor /= ways;
            }
        }
        if ways == 0.0 {
            // Across the corner.
            let across = around[place ^ 3];
            if pressure(across) != NONE {
                found.add(pressure(across), 1.0);
            }
        }
        found
    }

    /// The friction of the ground in a cell, against the velocity along it.
    pub(super) fn sliding(
        &self,
        ground: &Ground,
        friction: WallFriction,
        cell: usize,
    ) -> Option<QuadraturePoint> {
        let [x, z] = ground.wall[cell];
        let length = x.hypot(z);
        if length == 0.0 {
            return None;
        }
        let normal = [x / length, z / length];
        let mut point = QuadraturePoint::new(length * self.grid.cell_volume().sqrt());
        point.law = PointLaw::Sliding(friction);
        for (axis, along) in [normal[1], -normal[0]].into_iter().enumerate() {
            let faces = self.topology.cell_faces[cell][axis];
            let areas = faces.map(|face| ground.aperture[axis][face]);
            let sum = areas[0] + areas[1];
            for (face, area) in faces.into_iter().zip(areas) {
                if let Some(j) = moved_by(self.faces.role[axis][face])
                    && area > 0.0
                {
                    let share = self.faces.share(axis, face);
                    point.add_velocity(j, 0, along * share * area / sum);
                }
            }
        }
        self.add_pressure_on_ground(ground, cell, normal, &mut point);
        (!point.velocities().is_empty()).then_some(point)
    }

    /// The pressure on the ground in a cell: extrapolated along the axis that its normal leans to.
    fn add_pressure_on_ground(
        &self,
        ground: &Ground,
        cell: usize,
        normal: [f64; DIMENSIONS],
        point: &mut QuadraturePoint,
    ) {
        let master = ground.master[cell];
        let p = self.faces.pressure[master];
        if p == NONE {
            point.pressure_offset = self.layer_weight(ground, cell);
            return;
        }
        let axis = usize::from(normal[1].abs() >= normal[0].abs());
        let away = usize::from(normal[axis] > 0.0);
        // From the centre of the cell that has the pressure to the ground, in cells.
        let mut centre = [0.5; 3];
        for (a, pair) in self.topology.cell_neighbours[cell].iter().enumerate() {
            for (side, &next) in pair.iter().enumerate() {
                if next == master && master != cell {
                    centre[a] += if side == 1 { 1.0 } else { -1.0 };
                }
            }
        }
        let depth = match &ground.planes[cell] {
            Some(plane) => -plane.depth(centre) / plane.normal[axis].abs(),
            None => 0.5,
        };
        let next = self.topology.cell_neighbours[master][axis][away];
        let beyond = if next == NONE {
            NONE
        } else {
            self.faces.pressure[next]
        };
        if beyond != NONE {
            point.add_pressure(p, 1.0 + depth);
            point.add_pressure(beyond, -depth);
        } else if next != NONE && ground.master[next] == next {
            let distance = self.surface_distance(master, next, axis, away);
            point.add_pressure(p, 1.0 + depth / distance);
        } else {
            point.add_pressure(p, 1.0);
        }
    }

    /// Pressure on the ground under a layer too thin to have one: that of its weight.
    fn layer_weight(&self, ground: &Ground, cell: usize) -> f64 {
        let axis = DIMENSIONS - 1;
        let [thickness, _] = ground.thickness(self.topology, self.fractions, axis, cell);
        let spacing = self.grid.axes()[axis].spacing();
        thickness.min(1.0) * spacing * weight_onto(&self.acceleration, axis, 0)
    }

    /// The friction of side walls on a quarter of a cell.
    pub(super) fn rubbing_over(
        &self,
        ground: &Ground,
        walls: SideWalls,
        cell: usize,
        side: [usize; DIMENSIONS],
        volume: f64,
    ) -> Option<QuadraturePoint> {
        let mut point = QuadraturePoint::new(volume * self.grid.cell_volume());
        point.law = PointLaw::SideWalls(walls);
        for (component, side) in side.into_iter().enumerate() {
            let face = self.topology.cell_faces[cell][component][side];
            if let Some(j) = moved_by(self.faces.role[component][face]) {
                point.add_velocity(j, component, self.faces.share(component, face));
            }
        }
        let p = self.faces.pressure[ground.master[cell]];
        if p == NONE {
            point.pressure_offset = 0.5 * self.layer_weight(ground, cell);
        } else {
            point.add_pressure(p, 1.0);
        }
        (!point.velocities().is_empty()).then_some(point)
    }
}

/// Where the traction of the ground in a cell is kept: after the stresses at corners and at side walls.
pub(crate) fn sliding_place(cells: usize, cell: usize) -> usize {
    2 * cells * POINTS + cell
}
