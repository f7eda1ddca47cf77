//! Clumps in the step.

use super::Group;
use crate::grains::{SPHERE_INERTIA, vector};
use crate::rows::Rows;
use crate::simulation::Simulation;
use nalgebra::Vector3;

/// What moves clumps.
#[derive(Clone, Copy)]
struct Drive<'a> {
    rows: Rows<'a>,
    gravity: Vector3<f64>,
    /// Time over which forces acted and over which clumps move (s).
    kick: f64,
    drift: f64,
}

impl Group {
    /// Takes the kicks of the members and moves.
    fn step(&mut self, drive: &Drive) {
        let Drive {
            rows,
            gravity,
            kick,
            drift,
        } = *drive;
        let fall = gravity * kick;
        for state in &mut self.states {
            let members = &mut self.members[state.members.clone()];
            let (mut push, mut twist) = (Vector3::zeros(), Vector3::zeros());
            for member in members.iter() {
                let row = member.row as usize;
                let (v, s) = (rows.motion[row].get(), rows.turn[row].get());
                let radius = rows.place[row].get()[3];
                // What a grain without forces would have, in the same operations: no force is exactly none.
                let kicked = vector(&v) - (member.velocity + fall);
                push += kicked;
                twist += member.arm.cross(&kicked);
                twist += (vector(&s) - member.turn) * (SPHERE_INERTIA * radius);
            }
            state.velocity += fall + push;
            state.momentum += twist * state.mass;
            state.place += state.velocity * drift;
            let turned =
                super::turning::turn(&state.orientation, &state.momentum, &state.moments, drift);
            let spin;
            (state.orientation, spin) = turned;
            let turn = state.orientation.to_rotation_matrix();
            for member in members {
                let arm = turn * member.at;
                let travel = (arm - member.arm) / drift;
                let row = member.row as usize;
                let [.., radius] = rows.place[row].get();
                let [.., inverse_mass] = rows.motion[row].get();
                let [.., inverse_radius] = rows.turn[row].get();
                let x = state.place + arm + member.image;
                member.arm = arm;
                member.velocity = state.velocity + travel;
                member.turn = spin * radius;
                let (v, s) = (&member.velocity, &member.turn);
                rows.place[row].set([x.x, x.y, x.z, radius]);
                rows.motion[row].set([v.x, v.y, v.z, inverse_mass]);
                rows.turn[row].set([s.x, s.y, s.z, inverse_radius]);
            }
        }
    }
}

impl Simulation {
    /// Gives the kicks that a sweep has given to members to their clumps, and moves these.
    pub(crate) fn step_clumps(&mut self, kick: f64) {
        let team = self.team.share();
        let grains = &mut self.grains;
        // SAFETY: every row of a member is read and written by the thread of its clump alone.
        let rows = unsafe {
            Rows::of(
                &mut grains.place,
                &mut grains.motion,
                &mut grains.turn,
                &mut [],
                &mut [],
            )
        };
        let drive = Drive {
            rows,
            gravity: self.gravity,
            kick,
            drift: self.timestep,
        };
        let parallel = self.parallel && self.reach.parallel;
        team.each(parallel, &mut self.clumps.groups, &|group: &mut Group| {
            group.step(&drive);
        });
        // Lists go by how far rows may have come.
        for group in &self.clumps.groups {
            for member in &group.members {
                let cells = member.cells as usize;
                let against = member.velocity - Vector3::from(self.list.rows[cells].drift);
                let speed2 = against.norm_squared();
                let fastest = &mut self.fastest[cells];
                // Not a number must stay.
                if speed2 > *fastest || speed2.is_nan() {
                    *fastest = speed2;
                }
            }
        }
    }
}
