//! The discrete operators of material over ground: masses, divergence, pressure.

use super::{Contact, Ground};
use crate::discretisation::{Discretisation, Parts};
use crate::free_surface::faces::Face;
use crate::free_surface::operators::{EMPTY, Material, Operators};
use crate::free_surface::topology::NONE;

impl<const D: usize, const C: usize> Material<'_, D, C> {
    pub(crate) fn operators_over<const V: usize>(&self, ground: &Ground<D>) -> Operators<D, C, V> {
        let count = self.faces.own.len();
        let mut heavy = vec![0.0; count];
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
                    let share = self.faces.share(component, face);
                    heavy[j] += mass * share.min(1.0);
                    parts.mass[j] += mass * share;
                }
            }
        }
        // By virtual work what moves with a share of an unknown weighs on it with that share, and so it is in balance with stresses
        // that work on what it is sheared by. Where the share is above one, beyond the height of the unknown, what is there moves with
        // the next one as well.
        for (j, heavy) in heavy.iter().enumerate() {
            let g = self.acceleration[parts.components[j]];
            parts.boundary_load[j] = g * (heavy - parts.mass[j]);
        }
        let most = self.most_points();
        parts.points.reserve(most);
        let mut places = Vec::with_capacity(most);
        self.add_layers(ground, &heavy, &mut parts, &mut places);
        self.add_pressures(ground, &heavy, &mut parts);
        self.add_pressure_on_layers(&heavy, &mut parts);
        for (cell, &fraction) in self.fractions.iter().enumerate() {
            if fraction <= EMPTY || ground.free[cell] == 0.0 {
                continue;
            }
            self.add_rubbing(ground, cell, &mut parts.points, &mut places);
            if !self.has_layer(cell) {
                self.add_cell(ground, cell, &mut parts.points, &mut places);
                if let Contact::Coulomb(friction) = ground.contact
                    && let Some(point) = self.sliding(ground, friction, cell)
                {
                    parts.points.push(point);
                    places.push(self.sliding.on_ground(self.fractions.len(), cell));
                }
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

    /// Material that a velocity moves, in cells: over the free part of its face, filled as the cells on both
    /// sides are. The pressure then pushes it with the area through which its flux passes. A thin layer is
    /// what lies in both halves.
    fn filled_part(&self, ground: &Ground<D>, j: usize, component: usize, face: usize) -> f64 {
        let cells = self.topology.face_cells[component][face];
        let free: f64 = cells.iter().map(|&cell| ground.free[cell]).sum();
        if self.faces.is_thin[j] || free == 2.0 {
            return self.topology.face_mean(component, face, self.fractions);
        }
        let filled: f64 = cells.iter().map(|&cell| self.fractions[cell]).sum();
        ground.aperture[component][face] * filled / free
    }

    /// Divergence of active cells and of those that share their pressure, and the force of it.
    fn add_pressures<const V: usize>(
        &self,
        ground: &Ground<D>,
        heavy: &[f64],
        parts: &mut Parts<D, C, V>,
    ) {
        let mut pushed = vec![0.0; heavy.len()];
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
                for axis in 0..D {
                    for side in 0..2 {
                        let face = self.topology.cell_faces[member][axis][side];
                        if face == NONE {
                            continue;
                        }
                        let role = self.faces.role[axis][face];
                        let outwards = if side == 1 { 1.0 } else { -1.0 };
                        let area = self.grid.face_area(axis) * ground.aperture[axis][face];
                        // A face that follows pushes with the pressures beside it where both are known; else
                        // its mass goes with the gradient at the face that leads it.
                        let other = self.topology.cell_neighbours[member][axis][side];
                        let mass = match role {
                            Face::Own(j) => heavy[j] - pushed[j],
                            Face::Follows(j) if self.pushes(ground, j, axis, face) => {
                                self.grid.cell_volume() * self.filled_part(ground, j, axis, face)
                            }
                            _ => 0.0,
                        };
                        let (mut force, mut pressed) = (0.0, 0.0);
                        if mass > 0.0 {
                            let fall = if self.faces.pressure[other] == NONE {
                                self.beyond(member, other, axis, side).fall()
                            } else {
                                1.0
                            };
                            force = outwards * mass * fall / self.grid.axes()[axis].spacing();
                            if let Some(outside) = self.outside
                                && self.faces.pressure[ground.master[other]] == NONE
                            {
                                // A shore has no surface on the way.
                                let way = fall.recip().min(1.0);
                                pressed = force * outside.on_surface(member, other, way);
                            }
                        }
                        for (j, share) in self.faces.moved_by(axis, face, axis) {
                            if j != NONE {
                                parts.divergence.push((p, j, outwards * area * share));
                                parts.gradient.push(force);
                                parts.boundary_load[j] -= pressed;
                            }
                        }
                    }
                }
            }
        }
    }

    /// Whether a face that follows pushes with the pressures beside it: where matter slides on the ground and
    /// it lies between two cells with pressures of their own. Pressure then has no force along plane ground.
    /// (Where matter stands still at it, the gradient at the leading face is the better one.)
    fn pushes(&self, ground: &Ground<D>, j: usize, component: usize, face: usize) -> bool {
        ground.contact.slides()
            && ground.aperture[component][face] > 0.0
            && self.faces.own[j].0 == component
            && !self.faces.is_thin[j]
            && self.topology.face_cells[component][face]
                .iter()
                .all(|&cell| self.faces.pressure[cell] != NONE)
    }
}
