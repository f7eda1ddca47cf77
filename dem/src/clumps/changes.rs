//! What is done to clumps from outside the step: velocities given, damped, clumps that go or are fixed.

use super::{ALONE, Member, State};
use crate::simulation::Simulation;
use crate::snapshot::GrainSample;
use nalgebra::Vector3;

impl Simulation {
    /// Writes the motion of clumps into the rows of their members.
    pub(crate) fn lay_clump_rows(&mut self) {
        let grains = &mut self.grains;
        for (state, members) in self.clumps.all_mut() {
            let spin = state.spin(&state.momentum);
            for member in members {
                let row = member.row as usize;
                member.velocity = state.velocity + spin.cross(&member.arm);
                member.turn = spin * grains.place[row][3];
                grains.motion[row][..3].copy_from_slice(member.velocity.as_slice());
                grains.turn[row][..3].copy_from_slice(member.turn.as_slice());
            }
        }
    }

    /// After clumps have come or gone: lists leave out pairs within them, accounts begin anew.
    pub(super) fn clumps_changed(&mut self) {
        self.list.clumps = self.clumps.by_number();
        self.find_members();
        self.lay_clump_rows();
        self.rebuild();
        self.open_account();
    }

    /// Finds members' rows by number, before lists are made.
    fn find_members(&mut self) {
        let mut rows = vec![ALONE; self.next_id as usize];
        for (row, &id) in self.grains.id.iter().enumerate() {
            rows[id as usize] = row as u32;
        }
        for (_, members) in self.clumps.all_mut() {
            for member in members {
                member.row = rows[member.grain as usize];
            }
        }
    }

    /// Multiplies velocities and spins of all clumps.
    pub(crate) fn damp_clumps(&mut self, factor: f64) {
        for (state, _) in self.clumps.all_mut() {
            state.velocity *= factor;
            state.momentum *= factor;
        }
        self.lay_clump_rows();
    }

    /// Brings motions to the time of places and gives each clump the momentum of what its members are to have
    /// beside its turning, V = Σ m (v - ω × r)/M: members that are given what they have change nothing.
    pub(crate) fn launch_clumps(&mut self, given: &[Vector3<f64>]) {
        let half = self.half_step();
        let own = |(state, members): (&State, &[Member])| {
            let (_, momentum) = self.clump_kicked(state, members, half);
            let spin = state.spin(&momentum);
            let share = |m: &Member| {
                let row = m.row as usize;
                self.grains.mass[row] * (given[row] - spin.cross(&m.arm))
            };
            let sum: Vector3<f64> = members.iter().map(share).sum();
            (sum / state.mass, momentum)
        };
        let motions: Vec<_> = self.clumps.all().map(own).collect();
        for ((state, _), motion) in self.clumps.all_mut().zip(motions) {
            (state.velocity, state.momentum) = motion;
        }
        self.lay_clump_rows();
    }

    /// Takes the motions of clumps that have members in these rows half a step back, by the forces of now.
    pub(crate) fn take_back_clumps(&mut self, rows: &[usize]) {
        let half = 0.5 * self.timestep;
        let mut new: Vec<u32> = rows.iter().filter_map(|&i| self.clumps.of(i)).collect();
        new.sort_unstable();
        new.dedup();
        if new.is_empty() {
            return;
        }
        for clump in new {
            let (state, members) = self.clumps.one(clump as usize);
            let back = self.clump_kicked(state, members, -half);
            let state = self.clumps.state_mut(clump as usize);
            (state.velocity, state.momentum) = back;
        }
        self.lay_clump_rows();
    }

    /// A clump goes, or is fixed, as a whole: marks all members where one is marked.
    pub(crate) fn whole_clumps(&self, marks: &mut [bool]) {
        for (_, members) in self.clumps.all() {
            if members.iter().any(|m| marks[m.row as usize]) {
                members.iter().for_each(|m| marks[m.row as usize] = true);
            }
        }
    }

    /// Forgets clumps whose members are marked; their momentum as the integrator held it (N s).
    pub(crate) fn drop_clumps(&mut self, marks: &[bool]) -> Vector3<f64> {
        if self.clumps.is_empty() {
            return Vector3::zeros();
        }
        let mut gone = Vector3::zeros();
        let mut all = self.clumps.take();
        all.retain(|(state, members)| {
            let goes = members.iter().any(|m| marks[m.row as usize]);
            if goes {
                gone += state.mass * state.velocity;
            }
            !goes
        });
        self.clumps.lay(all);
        self.list.clumps = self.clumps.by_number();
        gone
    }

    /// For each row whether a predicate holds of its grain or of another member of its clump.
    pub(crate) fn marked(&mut self, f: impl FnMut(&GrainSample) -> bool) -> Vec<bool> {
        let mut marks: Vec<bool> = self.samples().iter().map(f).collect();
        self.whole_clumps(&mut marks);
        marks
    }
}
