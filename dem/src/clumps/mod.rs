//! Clumps: grains that are carried by one rigid body.
//!
//! Members of a clump are grains with rows in the search for pairs, so that a bed of clumps costs what a bed of
//! as many grains does, and they touch whatever grains touch. Members of one clump never touch each other.
//! After a sweep has kicked all rows by the forces on them, the clump takes these kicks together:
//!
//! ```text
//! J_i = M (v_i' - v_i - dt g)              K_i = 2/5 M R_i (s_i' - s_i)        s = R ω, kicks with the mass M
//! V ← V + dt g + Σ J_i / M                 L ← L + Σ (r_i × J_i + K_i)
//! X ← X + dt V                             turned by L (`turning.rs`)
//! x_i = X + r_i,  v_i = V + (r_i(n+1) - r_i(n))/dt,  s_i = R_i ω
//! ```
//! V and L live half a step back like the velocities of grains. The row of a member holds the inverse mass of
//! its clump, so that dashpots are matched to that mass.
//!
//! The mass, the centre and the inertia are given, or those of the members as balls; where these overlap
//! [`MassProperties::of_balls`] counts every place once.

mod accounts;
mod changes;
mod making;
mod record;
mod sample;
mod step;
mod turning;
mod union;
mod weight;

use crate::bodies::MassProperties;
use crate::domain::Domain;
use crate::grains::{Grains, vector};
use crate::neighbours::Neighbours;
use nalgebra::{UnitQuaternion, Vector3};
use std::ops::Range;

pub use sample::ClumpSample;
pub(crate) use weight::lightest;

/// Grains that are to move as one.
#[derive(Clone, Debug, PartialEq)]
pub struct Clump {
    /// Numbers of its grains (see [`crate::GrainSample::id`]).
    pub grains: Vec<u32>,
    /// Mass, centre of mass (m) and inertia tensor, in directions of space and at the places of its grains
    /// now; none: those of its grains as balls, which count twice where they overlap.
    pub mass: Option<MassProperties>,
}

/// Mark of a grain that is in no clump.
pub(crate) const ALONE: u32 = u32::MAX;

/// A member in its clump.
#[derive(Clone, Debug, Default)]
struct Member {
    /// Number of the grain.
    grain: u32,
    /// Its row, and the row of cells it is in.
    row: u32,
    cells: u32,
    /// From the centre of mass in principal axes (m).
    at: Vector3<f64>,
    /// The same in directions of space (m).
    arm: Vector3<f64>,
    /// Whole boxes between the grain and its clump (m).
    image: Vector3<f64>,
    /// Velocity (m/s) and radius times spin (m/s) as its row has them between steps.
    velocity: Vector3<f64>,
    turn: Vector3<f64>,
}

/// A clump on its way.
#[derive(Clone, Debug)]
struct State {
    mass: f64,
    /// Principal moments of inertia (kg m²).
    moments: Vector3<f64>,
    /// Centre of mass (m), principal axes.
    place: Vector3<f64>,
    orientation: UnitQuaternion<f64>,
    /// Half a step back: velocity (m/s) and angular momentum in directions of space (kg m²/s).
    velocity: Vector3<f64>,
    momentum: Vector3<f64>,
    /// Its members in the group.
    members: Range<usize>,
}

impl State {
    /// Angular velocity (rad/s) of an angular momentum (kg m²/s).
    fn spin(&self, momentum: &Vector3<f64>) -> Vector3<f64> {
        let own = self.orientation.inverse_transform_vector(momentum);
        self.orientation * own.component_div(&self.moments)
    }

    /// Kinetic energies of a velocity and an angular momentum (J).
    fn kinetic(&self, velocity: &Vector3<f64>, momentum: &Vector3<f64>) -> [f64; 2] {
        [
            0.5 * self.mass * velocity.norm_squared(),
            0.5 * momentum.dot(&self.spin(momentum)),
        ]
    }
}

/// Clumps that one thread moves.
#[derive(Clone, Debug, Default)]
struct Group {
    states: Vec<State>,
    members: Vec<Member>,
}

/// Most groups, and fewest clumps of one.
const GROUPS: usize = 16;
const CLUMPS_A_GROUP: usize = 64;

/// All clumps of a simulation.
#[derive(Clone, Debug, Default)]
pub(crate) struct Clumps {
    groups: Vec<Group>,
    /// Clumps of every group but the last.
    each: usize,
    /// Clump of each row, or [`ALONE`]; empty where there are no clumps.
    of_row: Vec<u32>,
}

impl Clumps {
    pub fn is_empty(&self) -> bool {
        self.groups.is_empty()
    }

    fn count(&self) -> usize {
        self.groups.iter().map(|group| group.states.len()).sum()
    }

    /// Whether the grain of a row is carried by a clump.
    #[inline(always)]
    pub fn carry(&self, row: usize) -> bool {
        self.of_row.get(row).is_some_and(|&clump| clump != ALONE)
    }

    /// Clump of a row, in the order of [`Clumps::all`].
    fn of(&self, row: usize) -> Option<u32> {
        self.of_row
            .get(row)
            .copied()
            .filter(|&clump| clump != ALONE)
    }

    /// Number of the clump that carries the grain of a row: that of its first grain.
    #[inline(always)]
    pub fn number(&self, row: usize) -> Option<u32> {
        Some(self.one(self.of(row)? as usize).1[0].grain)
    }

    /// A clump with its members.
    fn one(&self, clump: usize) -> (&State, &[Member]) {
        let group = &self.groups[clump / self.each];
        let state = &group.states[clump % self.each];
        (state, &group.members[state.members.clone()])
    }

    fn state_mut(&mut self, clump: usize) -> &mut State {
        &mut self.groups[clump / self.each].states[clump % self.each]
    }

    /// Rows of members that follow each other in their clump.
    pub fn chains(&self) -> impl Iterator<Item = [usize; 2]> {
        let rows = |pair: &[Member]| [pair[0].row as usize, pair[1].row as usize];
        self.all()
            .flat_map(move |(_, own)| own.windows(2).map(rows))
    }

    /// All clumps with their members, in order.
    fn all(&self) -> impl Iterator<Item = (&State, &[Member])> {
        self.groups.iter().flat_map(|group| {
            let states = group.states.iter();
            states.map(|state| (state, &group.members[state.members.clone()]))
        })
    }

    /// The same, to be changed.
    fn all_mut(&mut self) -> impl Iterator<Item = (&mut State, &mut [Member])> {
        self.groups.iter_mut().flat_map(|group| {
            let mut rest = group.members.as_mut_slice();
            group.states.iter_mut().map(move |state| {
                let (own, others) = std::mem::take(&mut rest).split_at_mut(state.members.len());
                rest = others;
                (state, own)
            })
        })
    }

    /// Puts clumps into groups.
    fn lay(&mut self, clumps: Vec<(State, Vec<Member>)>) {
        let groups = (clumps.len() / CLUMPS_A_GROUP).clamp(1, GROUPS);
        self.each = clumps.len().div_ceil(groups).max(1);
        self.groups.clear();
        for (k, (mut state, mut own)) in clumps.into_iter().enumerate() {
            if k % self.each == 0 {
                self.groups.push(Group::default());
            }
            if let Some(group) = self.groups.last_mut() {
                state.members = group.members.len()..group.members.len() + own.len();
                group.states.push(state);
                group.members.append(&mut own);
            }
        }
        if self.groups.is_empty() {
            self.of_row.clear();
        }
    }

    /// Takes all clumps out of their groups.
    fn take(&mut self) -> Vec<(State, Vec<Member>)> {
        let all = self.all().map(|(state, own)| (state.clone(), own.to_vec()));
        let all = all.collect();
        self.groups.clear();
        all
    }

    /// Clump of each grain by its number, for the search.
    fn by_number(&self) -> Vec<u32> {
        let numbers = || {
            self.all()
                .flat_map(|(_, own)| own)
                .map(|m| m.grain as usize)
        };
        let mut clump_of = vec![ALONE; numbers().max().map_or(0, |most| most + 1)];
        for (clump, (_, own)) in self.all().enumerate() {
            for member in own {
                clump_of[member.grain as usize] = clump as u32;
            }
        }
        clump_of
    }

    /// Finds the members again after grains have been sorted; where lists are new, centres are taken back into
    /// the box.
    pub fn settle(&mut self, grains: &Grains, list: &Neighbours, domain: &Domain, anew: bool) {
        if self.is_empty() {
            return;
        }
        let clump_of = &list.clumps;
        self.of_row.clear();
        let clump = |id: &u32| clump_of.get(*id as usize).copied().unwrap_or(ALONE);
        self.of_row.extend(grains.id.iter().map(clump));
        let mut rows = vec![[0_u32; 2]; clump_of.len()];
        for (cells, row) in list.rows.iter().enumerate() {
            for at in row.start..row.end {
                if let Some(own) = rows.get_mut(grains.id[at as usize] as usize) {
                    *own = [at, cells as u32];
                }
            }
        }
        let lengths = domain.lengths();
        for (state, own) in self.all_mut() {
            if anew {
                state.place = domain.wrap(state.place);
            }
            for member in own {
                [member.row, member.cells] = rows[member.grain as usize];
                let off = vector(&grains.place[member.row as usize]) - state.place - member.arm;
                member.image = Vector3::from_fn(|k, _| {
                    if domain.periodic[k] {
                        lengths[k] * (off[k] / lengths[k]).round()
                    } else {
                        0.0
                    }
                });
            }
        }
    }
}
