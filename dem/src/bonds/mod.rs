//! Parallel bonds: elastic cement between grains, which breaks and never heals.
//!
//! A bond acts beside the ordinary contact of its grains, at any gap. Bonds are known by the numbers of
//! their grains; their order, and with it the order in which a grain sums them, is that in which they
//! were made. They survive sorting, restarts and threads bit for bit.
//!
//! `bond.rs` is the law, `cement.rs` its numbers, `formation.rs` says who gets bonded, `clusters.rs` what
//! hangs together.

mod bond;
mod cement;
mod clusters;
mod formation;
mod record;

pub use bond::{BondState, BondStress};
pub use cement::{Cement, Section};
pub use clusters::{Cluster, Clusters};
pub use formation::BondRule;

use crate::domain::Cell;
use crate::grains::{Grains, vector};
use crate::places::Places;
use crate::population::GONE;
use crate::region::Region;
use crate::simulation::Simulation;
use crate::snapshot::BondSample;
use bond::{Pull, Relative, Strain};
use nalgebra::Vector3;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

/// A bond in a table of them.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Bond {
    /// Numbers of the grains, the lower one first.
    pub ids: [u32; 2],
    /// Their rows.
    pub rows: [u32; 2],
    /// Which cement.
    pub cement: u32,
    pub state: BondState,
    pub strain: Strain,
    pub pull: Pull,
    /// Energy set free when it ended (J).
    freed: f64,
}

/// How many bonds there are, and what has become of them.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct BondCount {
    /// Bonds that hold.
    pub whole: usize,
    /// Broken by tension.
    pub torn: usize,
    /// Broken by shear.
    pub sheared: usize,
    /// Taken away.
    pub cut: usize,
    /// Elastic energy that was in broken and cut bonds when they ended (J).
    pub energy_freed: f64,
}

impl BondCount {
    /// Broken bonds over all that were not taken away.
    pub fn broken_share(&self) -> f64 {
        let broken = (self.torn + self.sheared) as f64;
        if broken > 0.0 {
            broken / (broken + self.whole as f64)
        } else {
            0.0
        }
    }
}

/// All bonds there have been between grains that are still there.
#[derive(Clone, Debug, Default)]
pub(crate) struct Bonds {
    pub list: Vec<Bond>,
    pub cements: Vec<Cement>,
    /// The list before an observation.
    before: Vec<Bond>,
    /// Energy of bonds that were dropped with their grains (J).
    dropped: f64,
}

/// Bonds handled by one task of a step.
const BONDS_A_TASK: usize = 512;

impl Bonds {
    /// Whether there are any.
    pub fn is_empty(&self) -> bool {
        self.list.is_empty()
    }

    /// Finds the grains again after they have been sorted; bonds of grains that have gone are dropped.
    pub fn settle(&mut self, places: &Places) {
        let mut dropped = 0.0;
        self.list.retain_mut(|bond| {
            bond.rows = bond.ids.map(|id| places.of(id));
            let stays = !bond.rows.contains(&GONE);
            if !stays {
                dropped += bond.freed;
            }
            stays
        });
        self.dropped += dropped;
    }

    /// Remembers all bonds as they are.
    pub fn remember(&mut self) {
        self.before.clone_from(&self.list);
    }

    /// Goes back to what was remembered.
    pub fn recall(&mut self) {
        std::mem::swap(&mut self.list, &mut self.before);
    }

    /// Stretches all whole bonds by a step of this length (s), breaks those that have to, and says
    /// what the others do.
    pub fn evaluate(&mut self, grains: &Grains, cell: &Cell, step: f64, parallel: bool) {
        let cements = &self.cements;
        let evaluate = |bonds: &mut [Bond]| {
            for bond in bonds.iter_mut().filter(|b| b.state == BondState::Whole) {
                bond.advance(&cements[bond.cement as usize], grains, cell, step);
            }
        };
        if parallel {
            self.list.par_chunks_mut(BONDS_A_TASK).for_each(evaluate);
        } else {
            evaluate(&mut self.list);
        }
    }

    /// Adds up the ends of bonds.
    pub fn count(&self) -> BondCount {
        let mut count = BondCount {
            energy_freed: self.dropped,
            ..BondCount::default()
        };
        for bond in &self.list {
            count.energy_freed += bond.freed;
            *match bond.state {
                BondState::Whole => &mut count.whole,
                BondState::Torn => &mut count.torn,
                BondState::Sheared => &mut count.sheared,
                BondState::Cut => &mut count.cut,
            } += 1;
        }
        count
    }

    /// Bonds that hold.
    pub fn whole(&self) -> impl Iterator<Item = &Bond> {
        self.list.iter().filter(|b| b.state == BondState::Whole)
    }
}

impl Bond {
    fn advance(&mut self, cement: &Cement, grains: &Grains, cell: &Cell, step: f64) {
        let at = self.relative(grains, cell);
        let section = cement.section(at.radii[0], at.radii[1]);
        if step > 0.0 {
            self.strain = self.strain.advanced(&at, step);
        }
        let state = self.strain.stress(&section, &at.branch).outcome(cement);
        if state == BondState::Whole {
            self.pull = self.strain.pull(&section, &at);
        } else {
            self.end(state, self.strain.energy(&section, &at.branch));
        }
    }

    fn end(&mut self, state: BondState, freed: f64) {
        self.state = state;
        self.freed = freed;
        self.pull = Pull::default();
    }

    fn relative(&self, grains: &Grains, cell: &Cell) -> Relative {
        let [i, j] = self.rows.map(|row| row as usize);
        let (a, b) = (&grains.place[i], &grains.place[j]);
        let spin = |g: usize| vector(&grains.turn[g]) * grains.turn[g][3];
        let (branch, image) = cell.nearest(vector(a) - vector(b));
        Relative {
            branch,
            velocity: vector(&grains.motion[i]) - vector(&grains.motion[j]) - image,
            spins: [spin(i), spin(j)],
            radii: [a[3], b[3]],
        }
    }

    /// Elastic energy (J).
    pub fn energy(&self, cements: &[Cement], grains: &Grains, cell: &Cell) -> f64 {
        let at = self.relative(grains, cell);
        let section = cements[self.cement as usize].section(at.radii[0], at.radii[1]);
        self.strain.energy(&section, &at.branch)
    }

    /// Point of the line of centres that divides it as the radii do, in the box (m).
    fn middle(&self, grains: &Grains, cell: &Cell) -> Vector3<f64> {
        let at = self.relative(grains, cell);
        let [a, b] = at.radii;
        let own = vector(&grains.place[self.rows[0] as usize]);
        cell.wrap(own - at.branch * (a / (a + b))).0
    }
}

impl Simulation {
    /// Takes away all whole bonds whose contact point lies in a region, and says how many: a crack.
    pub fn cut_bonds(&mut self, within: &Region) -> usize {
        self.forget_observation();
        let cell = self.cell();
        let (grains, cements) = (&self.grains, &self.bonds.cements);
        let mut count = 0;
        for bond in &mut self.bonds.list {
            if bond.state == BondState::Whole && within.contains(&bond.middle(grains, &cell)) {
                let energy = bond.energy(cements, grains, &cell);
                bond.end(BondState::Cut, energy);
                count += 1;
            }
        }
        count
    }

    /// How many bonds there are, and what has become of them.
    pub fn bond_count(&mut self) -> BondCount {
        self.observe();
        self.bonds.count()
    }

    /// All whole bonds at this instant, in the order in which they were made; grains by their rows.
    pub(crate) fn bond_samples(&self, into: &mut Vec<BondSample>) {
        into.clear();
        let (grains, cell) = (&self.grains, self.cell());
        into.extend(self.bonds.whole().map(|bond| {
            let at = bond.relative(grains, &cell);
            let [a, b] = at.radii;
            let section = self.bonds.cements[bond.cement as usize].section(a, b);
            BondSample {
                grains: bond.rows.map(|row| row as usize),
                force: bond.pull.force,
                moment: bond.pull.moments[0],
                arm: -at.branch * (a / (a + b)),
                partner_arm: at.branch * (b / (a + b)),
                radius: section.radius,
                stress: bond.strain.stress(&section, &at.branch),
            }
        }));
    }

    /// Elastic energy of all bonds (J).
    pub(crate) fn bond_energy(&self) -> f64 {
        let (cements, grains, cell) = (&self.bonds.cements, &self.grains, self.cell());
        let energy = |bond: &Bond| bond.energy(cements, grains, &cell);
        self.bonds.whole().map(energy).sum()
    }
}
