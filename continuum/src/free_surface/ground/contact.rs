//! Pressure at the ground, and the friction of ground and side walls.

use super::cuts::{MOST_PARTS, area_of_volume};
use super::{Ground, unit};
use crate::discretisation::QuadraturePoint;
use crate::free_surface::faces::weight_onto;
use crate::free_surface::operators::{Material, NEAREST_EXTRAPOLATION, POINTS, points_of};
use crate::free_surface::topology::NONE;
use crate::wall_friction::{PointLaw, SideWalls, WallFriction};

/// Most cells from whose pressures that of a point is interpolated.
const MOST_PRESSURES: usize = 12;

/// A sum of pressures times factors, and a pressure that is known.
#[derive(Default, Clone, Copy)]
pub(super) struct Interpolation {
    terms: [(usize, f64); MOST_PRESSURES],
    count: usize,
    pub known: f64,
}

impl Interpolation {
    /// Pressures and their factors.
    pub fn terms(&self) -> &[(usize, f64)] {
        &self.terms[..self.count]
    }

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
        for &(pressure, share) in other.terms() {
            self.add(pressure, factor * share);
        }
    }
}

impl<const D: usize, const C: usize> Material<'_, D, C> {
    /// The pressure at the centre of a cell beside a corner. In ground, and in cells that share the
    /// pressure of another one, it is extrapolated; above the surface through p = 0.
    pub(super) fn pressure_over(
        &self,
        ground: &Ground<D>,
        place: usize,
        around: &[usize; MOST_PARTS],
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
            if ground.wall[cell] != [0.0; D] {
                found.known = self.layer_weight(ground, cell);
            } else {
                let ways = self.pressures_at(cell, NEAREST_EXTRAPOLATION);
                for way in ways.iter().flatten() {
                    found.add(way.pressure, way.share * way.factor);
                }
                found.known += self.pressure_from_outside(cell, &ways);
            }
            return found;
        }
        // Along each axis, from the cell beside it at the same corner, and the one behind that.
        let mut ways = 0.0;
        for axis in 0..D {
            let beside = around[place ^ (1 << axis)];
            if pressure(beside) == NONE {
                let is_layer = beside != NONE
                    && ground.master[beside] == beside
                    && ground.wall[beside] != [0.0; D];
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
                let factor = 1.0 + self.beyond(beside, behind, axis, side).fall();
                found.add(p, factor);
                found.known += self.pressure_beyond(behind, factor);
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
            // Across the lines between cells, and then across the corner.
            for steps in 2..=D {
                let across = (0..points_of(D))
                    .filter(|bits| bits.count_ones() as usize == steps)
                    .map(|bits| pressure(around[place ^ bits]))
                    .filter(|p| *p != NONE);
                let count = across.clone().count();
                for p in across {
                    found.add(p, 1.0 / count as f64);
                }
                if count > 0 {
                    break;
                }
            }
        }
        found
    }

    /// The friction of the ground in a cell, against the velocity along it.
    pub(super) fn sliding<const V: usize>(
        &self,
        ground: &Ground<D>,
        friction: WallFriction,
        cell: usize,
    ) -> Option<QuadraturePoint<C, V>> {
        let wall = ground.wall[cell];
        let length = wall.iter().map(|x| x * x).sum::<f64>().sqrt();
        if length == 0.0 {
            return None;
        }
        let normal = unit(wall);
        let area = area_of_volume::<D>(self.grid.cell_volume());
        let mut point = QuadraturePoint::new(length * area);
        point.law = PointLaw::Sliding(friction);
        let along = tangents(normal);
        for axis in 0..D {
            let faces = self.topology.cell_faces[cell][axis];
            let areas = faces.map(|face| ground.aperture[axis][face]);
            let sum = areas[0] + areas[1];
            for (face, area) in faces.into_iter().zip(areas).filter(|(_, area)| *area > 0.0) {
                for (j, share) in self.faces.moved_by(axis, face, axis) {
                    if j != NONE {
                        for (row, along) in along.iter().enumerate().take(D - 1) {
                            point.add_velocity(j, row, along[axis] * share * area / sum);
                        }
                    }
                }
            }
        }
        self.add_pressure_on_ground(ground, cell, normal, &mut point);
        (!point.velocities().is_empty()).then_some(point)
    }

    /// The pressure on the ground in a cell: extrapolated along the axis that its normal leans to.
    fn add_pressure_on_ground<const V: usize>(
        &self,
        ground: &Ground<D>,
        cell: usize,
        normal: [f64; D],
        point: &mut QuadraturePoint<C, V>,
    ) {
        let master = ground.master[cell];
        let p = self.faces.pressure[master];
        if p == NONE {
            point.pressure_offset = self.layer_weight(ground, cell);
            return;
        }
        let leans = |most: usize, axis: usize| {
            if normal[axis].abs() > normal[most].abs() {
                axis
            } else {
                most
            }
        };
        let axis = (0..D).rev().fold(D - 1, leans);
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
            let factor = 1.0 + depth * self.beyond(master, next, axis, away).fall();
            point.add_pressure(p, factor);
            point.pressure_offset += self.pressure_beyond(next, factor);
        } else {
            point.add_pressure(p, 1.0);
        }
    }

    /// The friction of side walls on a quarter of a cell.
    pub(super) fn rubbing_over<const V: usize>(
        &self,
        ground: &Ground<D>,
        walls: SideWalls,
        cell: usize,
        side: [usize; D],
        volume: f64,
    ) -> Option<QuadraturePoint<C, V>> {
        let mut point = QuadraturePoint::new(volume * self.grid.cell_volume());
        point.law = PointLaw::SideWalls(walls);
        for (component, side) in side.into_iter().enumerate() {
            let face = self.topology.cell_faces[cell][component][side];
            for (j, share) in self.faces.moved_by(component, face, component) {
                if j != NONE {
                    point.add_velocity(j, component, share);
                }
            }
        }
        let p = self.faces.pressure[ground.master[cell]];
        if p == NONE {
            // On ground a layer may cross rows of cells; elsewhere it lies on what has a pressure of its own.
            let weight = if ground.wall[cell] == [0.0; D] {
                let thickness = self.fractions[cell] * self.grid.axes()[D - 1].spacing();
                weight_onto(&self.acceleration, D - 1, 0) * thickness
            } else {
                self.layer_weight(ground, cell)
            };
            point.pressure_offset = 0.5 * weight;
        } else {
            point.add_pressure(p, 1.0);
        }
        (!point.velocities().is_empty()).then_some(point)
    }
}

/// Two directions along ground of a unit normal, at right angles; in a plane one.
fn tangents<const D: usize>(normal: [f64; D]) -> [[f64; D]; 2] {
    let mut along = [[0.0; D]; 2];
    if D == 2 {
        [along[0][0], along[0][1]] = [normal[1], -normal[0]];
        return along;
    }
    // The axis that the normal leans to least, less its part along the normal; then across both.
    let least = (1..D).fold(0, |least, axis| {
        if normal[axis].abs() < normal[least].abs() {
            axis
        } else {
            least
        }
    });
    let mut first = normal.map(|n| -n * normal[least]);
    first[least] += 1.0;
    along[0] = unit(first);
    for axis in 0..D {
        let (u, v) = ((axis + 1) % D, (axis + 2) % D);
        along[1][axis] = normal[u] * along[0][v] - normal[v] * along[0][u];
    }
    along
}

/// Where the traction of the ground in a cell of a plane is kept: after the stresses at corners and at side walls.
pub(crate) fn sliding_place(cells: usize, cell: usize) -> usize {
    2 * cells * POINTS + cell
}
