//! The discrete operators of material over ground: masses, divergence, pressure, thin layers.

use super::contact::sliding_place;
use super::{Contact, Ground};
use crate::discretisation::{Discretisation, Parts, QuadraturePoint};
use crate::free_surface::faces::Face;
use crate::free_surface::operators::{EMPTY, Material, Operators, POINTS};
use crate::free_surface::topology::NONE;
use crate::grid::DIMENSIONS;
use crate::wall_friction::PointLaw;

impl Material<'_> {
    pub(crate) fn operators_over(&self, ground: &Ground) -> Operators {
        let count = self.faces.own.len();
        let mut total = vec![0.0; count];
        let mut parts = Parts {
            mass: vec![0.0; count],
            components: self.faces.own.iter().map(|&(c, _)| c).collect(),
            boundary_load: vec![0.0; count],
            cells: self.faces.active.len(),
            places: self.places(),
            ..Parts::default()
        };
        let volume = self.grid.cell_volume();
        for (component, roles) in self.faces.role.iter().enumerate() {
            for (face, role) in roles.iter().enumerate() {
                if let Some(j) = role.unknown() {
                    let mass = volume * self.filled_part(ground, j, component, face);
                    total[j] += mass;
                    parts.mass[j] += mass * self.faces.share(component, face);
                }
            }
        }
        // All of the mass is heavy, whatever its share of the unknown.
        for (j, total) in total.iter().enumerate() {
            let g = self.acceleration[parts.components[j]];
            parts.boundary_load[j] = g * (total - parts.mass[j]);
        }
        let mut places = Vec::new();
        self.add_layers(ground, &total, &mut parts, &mut places);
        self.add_pressures(ground, &total, &mut parts);
        for (cell, &fraction) in self.fractions.iter().enumerate() {
            if fraction > EMPTY && ground.free[cell] > 0.0 && !self.has_layer(cell) {
                self.add_cell(ground, cell, &mut parts.points, &mut places);
                if let Contact::Coulomb(friction) = ground.contact
                    && let Some(point) = self.sliding(ground, friction, cell)
                {
                    parts.points.push(point);
                    places.push(sliding_place(self.fractions.len(), cell));
                }
            }
        }
        Operators {
            discretisation: Discretisation::of_parts(self.grid.clone(), parts),
            places,
        }
    }

    /// Material that a velocity moves, in cells: over the free part of its face, filled as the cells on both
    /// sides are. The pressure then pushes it with the area through which its flux passes. A thin layer is
    /// what lies in both halves.
    fn filled_part(&self, ground: &Ground, j: usize, component: usize, face: usize) -> f64 {
        let cells = self.topology.face_cells[component][face];
        let free: f64 = cells.iter().map(|&cell| ground.free[cell]).sum();
        if self.faces.is_thin[j] || free == 2.0 {
            return self.topology.face_mean(component, face, self.fractions);
        }
        let filled: f64 = cells.iter().map(|&cell| self.fractions[cell]).sum();
        ground.aperture[component][face] * filled / free
    }

    /// Whether a cell belongs to a thin layer, whose friction acts on its unknown alone.
    pub(super) fn has_layer(&self, cell: usize) -> bool {
        (0..DIMENSIONS).any(|axis| {
            let pair = self.topology.cell_faces[cell][axis];
            pair.iter().any(|&face| match self.faces.role[axis][face] {
                Face::Own(j) => self.faces.is_thin[j],
                Face::Slides(_) => true,
                _ => false,
            })
        })
    }

    /// Thin layers slide as blocks on their slope: (1 + σ²) m du/dt = m (g_x − |g_z| ∂η/∂x) − friction,
    /// σ being the rise of the ground and η the height of the layer's surface.
    fn add_layers(
        &self,
        ground: &Ground,
        total: &[f64],
        parts: &mut Parts,
        places: &mut Vec<usize>,
    ) {
        for (j, &(component, face)) in self.faces.own.iter().enumerate() {
            if !self.faces.is_thin[j] {
                continue;
            }
            let slope = ground.slope(self.topology, self.acceleration, component, face);
            let Some(slope) = slope else { continue };
            let axis = 1 - component;
            let spacing = self.grid.axes()[component].spacing();
            let [low, high] = self.topology.face_cells[component][face];
            let rise = ground.surface_rise(self.topology, self.fractions, axis, [low, high])
                * self.grid.axes()[axis].spacing()
                / spacing;
            parts.mass[j] *= 1.0 + slope.rise * slope.rise;
            let g = self.acceleration[component];
            parts.boundary_load[j] = total[j] * (g - slope.press * rise) - g * parts.mass[j];
            // Half a cell deep over a whole face: weight times rate is the area of the ground.
            let mut point = QuadraturePoint::new(0.5 * self.grid.cell_volume());
            point.add_velocity(j, 1, 2.0 / self.grid.axes()[axis].spacing());
            point.pressure_offset = total[j] / spacing * slope.weight;
            point.law = match ground.contact {
                Contact::Coulomb(friction) => PointLaw::OnWall(friction),
                _ => PointLaw::Material,
            };
            if ground.contact != Contact::FreeSlip && slope.weight > 0.0 {
                parts.points.push(point);
                places.push(high * POINTS + component);
            }
        }
    }

    /// Divergence of active cells and of those that share their pressure, and the force of it.
    fn add_pressures(&self, ground: &Ground, total: &[f64], parts: &mut Parts) {
        let mut pushed = vec![0.0; total.len()];
        for (axis, roles) in self.faces.role.iter().enumerate() {
            for (face, role) in roles.iter().enumerate() {
                if let Face::Follows(j) = *role
                    && self.pushes(ground, j, axis, face)
                {
                    pushed[j] += self.grid.cell_volume() * self.filled_part(ground, j, axis, face);
                }
            }
        }
        for (p, &cell) in self.faces.active.iter().enumerate() {
            for member in std::iter::once(cell).chain(ground.parts_of(cell)) {
                for axis in 0..DIMENSIONS {
                    for side in 0..2 {
                        let face = self.topology.cell_faces[member][axis][side];
                        if face == NONE {
                            continue;
                        }
                        let (j, is_own) = match self.faces.role[axis][face] {
                            Face::Own(j) => (j, true),
                            Face::Follows(j) | Face::Slides(j) => (j, false),
                            Face::Still | Face::Loose => continue,
                        };
                        let outwards = if side == 1 { 1.0 } else { -1.0 };
                        let area = self.grid.face_area(axis)
                            * ground.aperture[axis][face]
                            * self.faces.share(axis, face);
                        // A face that follows pushes with the pressures beside it where both are known; else
                        // its mass goes with the gradient at the face that leads it.
                        let other = self.topology.cell_neighbours[member][axis][side];
                        let mass = if is_own {
                            total[j] - pushed[j]
                        } else if self.pushes(ground, j, axis, face) {
                            self.grid.cell_volume() * self.filled_part(ground, j, axis, face)
                        } else {
                            0.0
                        };
                        let mut force = 0.0;
                        if mass > 0.0 {
                            let distance = if self.faces.pressure[other] == NONE {
                                self.surface_distance(member, other, axis, side)
                            } else {
                                1.0
                            };
                            force = outwards * mass / (distance * self.grid.axes()[axis].spacing());
                        }
                        parts.divergence.push((p, j, outwards * area));
                        parts.gradient.push(force);
                    }
                }
            }
        }
    }

    /// Whether a face that follows pushes with the pressures beside it: where matter slides on the ground and
    /// it lies between two cells with pressures of their own. Pressure then has no force along plane ground.
    /// (Where matter stands still at it, the gradient at the leading face is the better one.)
    fn pushes(&self, ground: &Ground, j: usize, component: usize, face: usize) -> bool {
        ground.contact.slides()
            && ground.aperture[component][face] > 0.0
            && self.faces.own[j].0 == component
            && !self.faces.is_thin[j]
            && self.topology.face_cells[component][face]
                .iter()
                .all(|&cell| self.faces.pressure[cell] != NONE)
    }
}
