//! Clumps in energies, momenta and measures of rest.

use super::{Member, State};
use crate::grains::vector;
use crate::simulation::Simulation;
use nalgebra::Vector3;

impl Simulation {
    /// Force on a clump, and the torque about its centre; forces are those of now.
    pub(super) fn clump_load(&self, members: &[Member]) -> [Vector3<f64>; 2] {
        let (mut force, mut torque) = (Vector3::zeros(), Vector3::zeros());
        for member in members {
            let row = member.row as usize;
            let [push, turn, moment] = self.totals[row].map(|sum| vector(&sum));
            force += push;
            torque += member.arm.cross(&push) + turn * self.grains.place[row][3] + moment;
        }
        [force, torque]
    }

    /// Velocity and angular momentum of a clump after a kick of a length (s).
    pub(super) fn clump_kicked(
        &self,
        state: &State,
        members: &[Member],
        kick: f64,
    ) -> (Vector3<f64>, Vector3<f64>) {
        if kick == 0.0 {
            return (state.velocity, state.momentum);
        }
        let [force, torque] = self.clump_load(members);
        (
            state.velocity + kick * (force / state.mass + self.gravity),
            state.momentum + kick * torque,
        )
    }

    /// Velocity and angular velocity of a member after a kick of a length (s) of its clump.
    pub(crate) fn member_kicked(&self, row: usize, kick: f64) -> [Vector3<f64>; 2] {
        let (state, members) = self.clumps.one(self.clumps.of_row[row] as usize);
        let (velocity, momentum) = self.clump_kicked(state, members, kick);
        let spin = state.spin(&momentum);
        let own = members.iter().find(|member| member.row as usize == row);
        let arm = own.map_or_else(Vector3::zeros, |member| member.arm);
        [velocity + spin.cross(&arm), spin]
    }

    /// Whether a grain is moved by what acts on it alone.
    #[inline(always)]
    pub(crate) fn moves_alone(&self, row: usize) -> bool {
        !self.grains.is_fixed(row) && !self.clumps.carry(row)
    }

    /// Kinetic energies of all clumps (J), of translation and rotation.
    pub(crate) fn clump_kinetic(&self) -> [f64; 2] {
        let half = self.half_step();
        let mut sums = [0.0; 2];
        for (state, members) in self.clumps.all() {
            let (velocity, momentum) = self.clump_kicked(state, members, half);
            let own = state.kinetic(&velocity, &momentum);
            sums = [sums[0] + own[0], sums[1] + own[1]];
        }
        sums
    }

    /// Momentum of all clumps (N s) as the integrator holds it, and the sum of its sizes.
    pub(crate) fn clump_momentum(&self) -> (Vector3<f64>, f64) {
        let (mut sum, mut size) = (Vector3::zeros(), 0.0);
        for (state, _) in self.clumps.all() {
            let momentum = state.mass * state.velocity;
            sum += momentum;
            size += momentum.norm();
        }
        (sum, size)
    }

    /// Momentum of the clumps whose members are marked, as the integrator holds it (N s).
    pub(crate) fn momentum_of_marked_clumps(&self, marks: &[bool]) -> Vector3<f64> {
        let marked =
            |(_, members): &(&State, &[Member])| members.iter().any(|m| marks[m.row as usize]);
        let all = self.clumps.all().filter(marked);
        all.map(|(state, _)| state.mass * state.velocity).sum()
    }

    /// Momentum of all clumps at this instant (N s).
    pub(crate) fn clump_momentum_now(&self) -> Vector3<f64> {
        let half = self.half_step();
        let all = self.clumps.all();
        all.map(|(state, members)| state.mass * self.clump_kicked(state, members, half).0)
            .sum()
    }

    /// Shows for each clump its mass (kg), its centre (m) and its velocity at this instant (m/s).
    pub(crate) fn each_clump_now(&self, mut see: impl FnMut(f64, &Vector3<f64>, Vector3<f64>)) {
        let half = self.half_step();
        for (state, members) in self.clumps.all() {
            let (velocity, _) = self.clump_kicked(state, members, half);
            see(state.mass, &state.place, velocity);
        }
    }

    /// For each row the way to its grain from the centre of its clump (m), zero for those in none; nothing
    /// where there are no clumps.
    pub(crate) fn member_arms(&self) -> Vec<Vector3<f64>> {
        if self.clumps.is_empty() {
            return Vec::new();
        }
        let mut arms = vec![Vector3::zeros(); self.grains.len()];
        for member in self.clumps.all().flat_map(|(_, members)| members) {
            arms[member.row as usize] = member.arm;
        }
        arms
    }

    /// Angular momentum of all clumps about the origin as the integrator holds it (N m s).
    pub(crate) fn clump_angular_momentum(&self) -> Vector3<f64> {
        let own = |(state, _): (&State, &[Member])| {
            state.mass * state.place.cross(&state.velocity) + state.momentum
        };
        self.clumps.all().map(own).sum()
    }

    /// Work of gravity on clumps in a kick (J): forces are those of now.
    pub(crate) fn gravity_on_clumps(&self, kick: f64) -> f64 {
        let mean = |(state, members): (&State, &[Member])| {
            let (velocity, _) = self.clump_kicked(state, members, 0.5 * kick.abs());
            kick * state.mass * velocity.dot(&self.gravity)
        };
        self.clumps.all().map(mean).sum()
    }

    /// Shows for each clump its kinetic energy (J), the force that is left with gravity (N), the mean diameter of
    /// its members (m) and its mass (kg).
    pub(crate) fn each_clump_at_rest(&self, mut see: impl FnMut([f64; 4])) {
        let half = self.half_step();
        for (state, members) in self.clumps.all() {
            let (velocity, momentum) = self.clump_kicked(state, members, half);
            let [force, _] = self.clump_load(members);
            let radius = |m: &Member| self.grains.place[m.row as usize][3];
            let diameters: f64 = members.iter().map(|m| 2.0 * radius(m)).sum();
            let [translation, rotation] = state.kinetic(&velocity, &momentum);
            see([
                translation + rotation,
                (force + state.mass * self.gravity).norm(),
                diameters / members.len() as f64,
                state.mass,
            ]);
        }
    }
}
