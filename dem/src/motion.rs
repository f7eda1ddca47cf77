//! Moving a grain: it is kicked by the sum of its forces and drifts.
//!
//! ```text
//! v(n+1/2) = v(n-1/2) + dt (F(n)/m + g)        x(n+1) = x(n) + dt v(n+1/2)
//! ω(n+1/2) = ω(n-1/2) + dt T(n)/I              I = 2/5 m R²
//! ```
//! Leap-frog. The moment of the tangential force is stored as `n × F_t`-type vectors T without the
//! radius, which cancels: `d(Rω)/dt = 5/(2m) (T + M/R)`.
//!
//! Order of a grain's sum: its pairs in the order of the Verlet list, which are those as `j` by rising
//! `i` and then those as `i`, then walls, then loads.

use crate::grains::SPHERE_INERTIA;
use crate::lanes::{Lanes4, Portable};
use crate::loads::Loads;
use crate::reach::Reach;
use crate::walls::WallContacts;

/// Force, moment of the tangential force, further moment on a grain.
#[derive(Clone, Copy)]
pub(crate) struct Sum<L>(pub [L; 3]);

impl<L: Lanes4> Sum<L> {
    /// Adds the walls.
    #[inline(always)]
    pub fn lean(&mut self, walls: &WallContacts, grain: usize) {
        for contact in walls.of(grain) {
            self.add(&Sum::load(&contact.slot));
        }
    }

    /// Adds the loads.
    #[inline(always)]
    pub fn bear(&mut self, loads: &Loads, grain: usize) {
        if let Some([force, moment]) = loads.of(grain) {
            self.0[0] = self.0[0] + L::load(force);
            self.0[2] = self.0[2] + L::load(moment);
        }
    }

    #[inline(always)]
    pub fn add(&mut self, slot: &Self) {
        for (sum, slot) in self.0.iter_mut().zip(&slot.0) {
            *sum = *sum + *slot;
        }
    }

    /// The other side of a pair: force and further moment are opposite, the moment of the
    /// tangential force is the same.
    #[inline(always)]
    pub fn subtract(&mut self, slot: &Self) {
        self.0[0] = self.0[0] - slot.0[0];
        self.0[1] = self.0[1] + slot.0[1];
        self.0[2] = self.0[2] - slot.0[2];
    }

    /// A sum from its rows; without a third one there is no further moment.
    #[inline(always)]
    pub fn load(rows: &[[f64; 4]]) -> Self {
        let mut sum = Sum([L::load(&rows[0]), L::load(&rows[1]), L::splat(0.0)]);
        if rows.len() == 3 {
            sum.0[2] = L::load(&rows[2]);
        }
        sum
    }

    /// Writes the rows there are.
    #[inline(always)]
    pub fn store(self, rows: &mut [[f64; 4]]) {
        for (sum, row) in self.0.into_iter().zip(rows) {
            sum.store(row);
        }
    }
}

/// How grains move in a step.
#[derive(Clone, Copy)]
pub(crate) struct Motion {
    /// Gravity (m/s²) and a zero.
    pub gravity: [f64; 4],
    /// Time over which forces act (s): half a step at the start of a run, else a step.
    pub kick: f64,
    /// Time over which grains move (s).
    pub drift: f64,
}

/// A grain's rows of place, motion and turn.
pub(crate) struct Body<L>(pub [L; 3]);

impl<L: Lanes4> Body<L> {
    /// The same grain a step later.
    #[inline(always)]
    pub fn moved(self, sum: &Sum<L>, motion: &Motion) -> Self {
        let Body([place, velocity, turn]) = self;
        let Sum([force, torque, moment]) = *sum;
        let zero = L::splat(0.0);
        let kick = L::splat(motion.kick);
        let drift = L::load(&[motion.drift, motion.drift, motion.drift, 0.0]);
        let spin_up = L::splat(1.0 / SPHERE_INERTIA);
        let inverse_mass = velocity.splat_last();
        let fall = L::select(zero.less(inverse_mass), L::load(&motion.gravity), zero);
        let moved = velocity + kick * (force * inverse_mass + fall);
        let turned = kick * spin_up * inverse_mass * (torque + moment * turn.splat_last());
        Body([place + drift * moved, moved, turn + turned])
    }

    /// One of the rows.
    #[inline(always)]
    pub fn row(&self, k: usize) -> [f64; 4] {
        let mut row = [0.0; 4];
        self.0[k].store(&mut row);
        row
    }
}

/// Force and both moments on every grain at this instant, added in the order of a step, from the slots
/// of all pairs.
pub(crate) fn total(
    reach: &Reach,
    walls: &WallContacts,
    loads: &Loads,
    rows: usize,
    totals: &mut [[[f64; 4]; 3]],
) {
    totals.fill([[0.0; 4]; 3]);
    let change = |total: &mut [[f64; 4]; 3], add: &dyn Fn(&mut Sum<Portable>)| {
        let mut sum = Sum::<Portable>::load(total);
        add(&mut sum);
        sum.store(total);
    };
    for (chunk, place) in reach.pairs() {
        if chunk.touches(place) {
            let slot = Sum::load(&chunk.slots[place * rows..][..rows]);
            let [i, j] = chunk.pair(place);
            change(&mut totals[i], &|sum| sum.add(&slot));
            change(&mut totals[j], &|sum| sum.subtract(&slot));
        }
    }
    for (g, total) in totals.iter_mut().enumerate() {
        change(total, &|sum| {
            sum.lean(walls, g);
            sum.bear(loads, g);
        });
    }
}
