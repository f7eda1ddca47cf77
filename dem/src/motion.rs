//! Moving a grain: it gathers its slots, is kicked and drifts.
//!
//! ```text
//! v(n+1/2) = v(n-1/2) + dt (F(n)/m + g)        x(n+1) = x(n) + dt v(n+1/2)
//! ω(n+1/2) = ω(n-1/2) + dt T(n)/I              I = 2/5 m R²
//! ```
//! Leap-frog. The moment of the tangential force is stored as `n × F_t`-type vectors T without the
//! radius, which cancels: `d(Rω)/dt = 5/(2m) (T + M/R)`.
//!
//! Order of a grain's sum: its pairs as `i` in list order, then its pairs as `j` from the last to the
//! first, then planes, then loads. Pairs of earlier chunks thus come last among pairs, whatever the cuts.

use crate::grains::SPHERE_INERTIA;
use crate::lanes::{Lanes4, Portable};
use crate::loads::Loads;
use crate::planes::PlaneContacts;
use crate::reach::{Chunk, Reach, SHARES, Shared};

/// Where the slots of the pairs evaluated last are found: pair k at k modulo the ring's length.
#[derive(Clone, Copy)]
pub(crate) struct Ring {
    base: usize,
    len: usize,
}

impl Ring {
    /// Slots of all pairs are there: no place is used twice.
    pub const ALL: usize = usize::MAX;

    /// The ring when all pairs before `end` have been evaluated.
    #[inline(always)]
    pub fn at(end: usize, len: usize) -> Self {
        let oldest = end.saturating_sub(len);
        Ring {
            base: oldest - oldest % len,
            len,
        }
    }

    /// Place of the slot of one of the last `len` pairs.
    #[inline(always)]
    pub fn place(self, pair: usize) -> usize {
        let place = pair - self.base;
        if place < self.len {
            place
        } else {
            place - self.len
        }
    }
}

/// Force, moment of the tangential force, further moment on a grain.
#[derive(Clone, Copy)]
pub(crate) struct Sum<L>(pub [L; 3]);

/// Sums over a chunk's own pairs for the grains from `from` to `to` (of the chunk).
///
/// One loop over the terms of all grains without a branch in it: loops over the few terms of each
/// grain end unpredictably, which costs more than the sums.
#[inline(always)]
pub(crate) fn sums<L: Lanes4, const ROWS: usize>(
    chunk: &Chunk,
    [from, to]: [usize; 2],
    ring: Ring,
    sums: &mut [[[f64; 4]; ROWS]],
) {
    let zero = L::splat(0.0);
    let mut sum = [zero; ROWS];
    let slots = chunk.slots.as_chunks::<ROWS>().0;
    let terms = chunk.first_term[from] as usize..chunk.first_term[to] as usize;
    let mut next = 0;
    for &term in &chunk.terms[terms] {
        let slot = &slots[ring.place(term.pair())];
        let [force, torque] = SHARES[term.share()];
        next += term.first();
        let fresh = zero.less(L::splat([0.0, 1.0][term.first()]));
        let out = &mut sums[next - 1];
        for row in 0..ROWS {
            let share = L::splat(if row == 1 { torque } else { force });
            sum[row] = L::select(fresh, zero, sum[row]) + L::load(&slot[row]) * share;
            sum[row].store(&mut out[row]);
        }
    }
}

impl<L: Lanes4> Sum<L> {
    /// Adds the pairs of earlier chunks to shared grain `s` of a chunk.
    #[inline(always)]
    pub fn import(&mut self, chunks: &[Chunk], chunk: &Chunk, s: usize, rows: usize) {
        let end = match chunk.shared.get(s + 1) {
            Some(next) => next.first_import as usize,
            None => chunk.imports.len(),
        };
        for import in &chunk.imports[chunk.shared[s].first_import as usize..end] {
            let exports = &chunks[import.chunk as usize].exports;
            self.subtract(&exports[import.export as usize * rows..][..rows]);
        }
    }

    /// Adds the planes.
    #[inline(always)]
    pub fn lean(&mut self, planes: &PlaneContacts, grain: usize) {
        for contact in planes.of(grain) {
            self.add(&contact.slot);
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
    fn add(&mut self, slot: &[[f64; 4]]) {
        self.0[0] = self.0[0] + L::load(&slot[0]);
        self.0[1] = self.0[1] + L::load(&slot[1]);
        if slot.len() == 3 {
            self.0[2] = self.0[2] + L::load(&slot[2]);
        }
    }

    /// The other side of a pair: force and further moment are opposite, the moment of the
    /// tangential force is the same.
    #[inline(always)]
    fn subtract(&mut self, slot: &[[f64; 4]]) {
        self.0[0] = self.0[0] - L::load(&slot[0]);
        self.0[1] = self.0[1] + L::load(&slot[1]);
        if slot.len() == 3 {
            self.0[2] = self.0[2] - L::load(&slot[2]);
        }
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
}

/// Force and both moments on a grain at this instant, gathered in the order of a step.
pub(crate) fn gather(
    reach: &Reach,
    planes: &PlaneContacts,
    loads: &Loads,
    rows: usize,
    g: usize,
) -> [[f64; 4]; 3] {
    let chunk = reach.chunk_of(g);
    let own = g - chunk.grains.start;
    let (own, ring) = ([own, own + 1], Ring::at(0, Ring::ALL));
    let mut sum = if rows == 2 {
        let mut two = [[[0.0; 4]; 2]];
        sums::<Portable, 2>(chunk, own, ring, &mut two);
        Sum::<Portable>::load(&two[0])
    } else {
        let mut three = [[[0.0; 4]; 3]];
        sums::<Portable, 3>(chunk, own, ring, &mut three);
        Sum::load(&three[0])
    };
    let shared = |s: &Shared| s.grain as usize;
    if let Ok(s) = chunk.shared.binary_search_by_key(&g, shared) {
        sum.import(&reach.chunks, chunk, s, rows);
    }
    sum.lean(planes, g);
    sum.bear(loads, g);
    let mut out = [[0.0; 4]; 3];
    for (out, sum) in out.iter_mut().zip(sum.0) {
        sum.store(out);
    }
    out
}
