//! Grains and contacts as the overlap looks at them: the same bits after a restart.
//!
//! A restart may change the order of the grains' rows and of their lists, and with it the last bits of every sum
//! over them, of which a snapshot's velocities are one. Here grains stand in the order of their numbers, contacts in
//! that of their grains, and velocities and spins are those that the integrator holds, half a step back.

use super::material_edge::Side;
use colluvium_dem::{ContactSample, GrainSample, Partner, Simulation, Snapshot};
use nalgebra::Vector3;

/// Free grains as they are held, in the order of their numbers.
pub(super) fn free_grains(simulation: &Simulation) -> Vec<GrainSample> {
    let mut grains: Vec<GrainSample> = simulation.held(|_| true).filter(|g| !g.fixed).collect();
    grains.sort_unstable_by_key(|grain| grain.id);
    grains
}

/// How many they are: what budgets are of. Those that are fixed, a floor or a wall, make no motion of their own and do not count.
pub(super) fn free_count(simulation: &Simulation) -> usize {
    simulation.held(|_| true).filter(|g| !g.fixed).count()
}

/// Their mass (kg).
pub(super) fn free_mass(simulation: &Simulation) -> f64 {
    free_grains(simulation).iter().map(|grain| grain.mass).sum()
}

/// A snapshot in order.
#[derive(Clone, Debug, Default)]
pub(super) struct Sighting {
    /// What is seen.
    pub snapshot: Snapshot,
    /// Rows in the order of numbers, and where each row has gone.
    order: Vec<usize>,
    places: Vec<usize>,
}

impl Sighting {
    /// Contacts that cross a surface: the grain outside it, and the force (N) on the one inside. Grains of which `inside`
    /// knows nothing lie on neither side.
    pub fn crossing(
        &self,
        inside: impl Fn(&GrainSample) -> Option<bool>,
    ) -> impl Iterator<Item = (&GrainSample, Vector3<f64>)> {
        let grains = &self.snapshot.grains;
        self.snapshot.contacts.iter().filter_map(move |contact| {
            let Partner::Grain(other) = contact.partner else {
                return None;
            };
            let pair = [contact.grain, other].map(|n| &grains[n]);
            match pair.map(&inside) {
                [Some(true), Some(false)] => Some((pair[1], contact.force)),
                [Some(false), Some(true)] => Some((pair[0], -contact.force)),
                _ => None,
            }
        })
    }

    /// Looks at the grains as they are now, along the axis of an edge.
    pub fn look_along(&mut self, side: Side, simulation: &mut Simulation) {
        self.look(simulation);
        if side == Side::Above {
            for grain in &mut self.snapshot.grains {
                *grain = side.grain(*grain);
            }
            for contact in &mut self.snapshot.contacts {
                *contact = side.contact(*contact);
            }
        }
    }

    /// Looks at the grains as they are now.
    pub fn look(&mut self, simulation: &mut Simulation) {
        let snapshot = &mut self.snapshot;
        simulation.snapshot(snapshot);
        for (seen, held) in snapshot.grains.iter_mut().zip(simulation.held(|_| true)) {
            (seen.velocity, seen.spin) = (held.velocity, held.spin);
        }
        let rows = snapshot.grains.len();
        self.order.clear();
        self.order.extend(0..rows);
        self.order
            .sort_unstable_by_key(|&row| snapshot.grains[row].id);
        self.places.clear();
        self.places.resize(rows, 0);
        for (place, &row) in self.order.iter().enumerate() {
            self.places[row] = place;
        }
        snapshot.grains.sort_unstable_by_key(|grain| grain.id);
        for contact in &mut snapshot.contacts {
            contact.grain = self.places[contact.grain];
            if let Partner::Grain(other) = contact.partner {
                let other = self.places[other];
                contact.partner = Partner::Grain(other);
                if other < contact.grain {
                    turn(contact, other);
                }
            }
        }
        snapshot.contacts.sort_unstable_by_key(|contact| {
            let (kind, other) = match contact.partner {
                Partner::Grain(other) => (0, other),
                Partner::Wall(other) => (1, other),
                Partner::Body(other) => (2, other),
            };
            (contact.grain, kind, other)
        });
    }
}

/// The same contact seen from the other grain.
fn turn(contact: &mut ContactSample, other: usize) {
    contact.partner = Partner::Grain(contact.grain);
    contact.grain = other;
    contact.force = -contact.force;
    std::mem::swap(&mut contact.arm, &mut contact.partner_arm);
    std::mem::swap(&mut contact.torque, &mut contact.partner_torque);
}
