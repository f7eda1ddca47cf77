//! A step: forces and motion in one sweep over the grains.
//!
//! Pairs are ordered by their lower grain i. Once all pairs with i ≤ g are evaluated, grain g has all
//! its forces and no later pair reads its position: it is moved at once, while its rows and slots are
//! in the cache. A slot is needed from then until the partner j is moved, so slots live in a ring.
//!
//! **Threads.** Each chunk is swept on its own. A grain that is partner in a pair of an earlier chunk
//! is *shared*: the sweep leaves the sum over its own chunk's pairs, and it is moved after all chunks
//! are through, from copies of the slots it lacks. Chunks read the old rows of all grains and write
//! the new rows of their own, so no two threads meet, and the order of every sum is the same for any
//! cuts.

use crate::contact::Interaction;
use crate::forces::{Field, batch, like_coefficients, slot_rows};
use crate::lanes::{Lanes4, Portable, has_avx2};
use crate::loads::Loads;
use crate::motion::{Body, Motion, Ring, Sum, sums};
use crate::neighbours::Row;
use crate::planes::PlaneContacts;
use crate::reach::{BLOCK, Chunk};

/// What a sweep does.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Pass {
    /// Forces and motion.
    Step,
    /// Forces alone, with the slots of all pairs, for observers.
    Forces,
    /// Motion from the slots of all pairs.
    Motion,
}

/// What a sweep reads.
#[derive(Clone, Copy)]
pub(crate) struct Sweep<'a> {
    pub pass: Pass,
    /// Whether chunks are shared out over threads.
    pub parallel: bool,
    pub field: Field<'a>,
    pub planes: &'a PlaneContacts,
    pub loads: &'a Loads,
    pub rows: &'a [Row],
    pub motion: Motion,
    /// Fixed grains, in order.
    pub fixed: &'a [u32],
}

/// What a sweep writes for consecutive rows of grains.
pub(crate) struct Moved<'a> {
    /// Number of the first grain, row and fixed grain.
    pub first: [usize; 3],
    pub place: &'a mut [[f64; 4]],
    pub motion: &'a mut [[f64; 4]],
    pub turn: &'a mut [[f64; 4]],
    /// Square of the largest speed against the row's drift (m²/s²).
    pub fastest: &'a mut [f64],
    /// Momentum that each fixed grain has taken from free ones (N s).
    pub taken: &'a mut [[f64; 4]],
}

impl Moved<'_> {
    /// Cuts in front of a chunk.
    fn cut(self, chunk: &Chunk, fixed: &[u32]) -> (Self, Self) {
        let (grain, row) = (chunk.grains.start, chunk.rows.start);
        let held = fixed.partition_point(|&f| (f as usize) < grain);
        let [g, r, f] = self.first;
        let (place, place_b) = self.place.split_at_mut(grain - g);
        let (motion, motion_b) = self.motion.split_at_mut(grain - g);
        let (turn, turn_b) = self.turn.split_at_mut(grain - g);
        let (fastest, fastest_b) = self.fastest.split_at_mut(row - r);
        let (taken, taken_b) = self.taken.split_at_mut(held - f);
        let front = Moved {
            first: self.first,
            place,
            motion,
            turn,
            fastest,
            taken,
        };
        let back = Moved {
            first: [grain, row, held],
            place: place_b,
            motion: motion_b,
            turn: turn_b,
            fastest: fastest_b,
            taken: taken_b,
        };
        (front, back)
    }

    fn reborrow(&mut self) -> Moved<'_> {
        Moved {
            first: self.first,
            place: self.place,
            motion: self.motion,
            turn: self.turn,
            fastest: self.fastest,
            taken: self.taken,
        }
    }
}

/// Runs a pass over all chunks; the largest overlap over the harmonic mean radius.
pub(crate) fn run<I: Interaction>(
    law: &I,
    sweep: &Sweep,
    chunks: &mut [Chunk],
    mut moved: Moved,
) -> f64 {
    let wide = has_avx2();
    let rows = slot_rows::<I>();
    for chunk in chunks.iter_mut() {
        let kept = match sweep.pass {
            Pass::Step => chunk.ring,
            Pass::Forces | Pass::Motion => chunk.i.len(),
        };
        // A term without weight may point at the first slot.
        let needed = kept.max(1) * rows;
        if chunk.slots.len() < needed {
            chunk.slots.resize(needed, [0.0; 4]);
        }
        chunk.exports.resize(chunk.exported.len() * rows, [0.0; 4]);
    }
    let deepest = first(law, sweep, chunks, moved.reborrow(), wide);
    if sweep.pass != Pass::Forces && chunks.len() > 1 {
        second::<I>(sweep, chunks, chunks, moved, wide);
    }
    deepest
}

/// Sweeps each chunk.
fn first<I: Interaction>(
    law: &I,
    sweep: &Sweep,
    chunks: &mut [Chunk],
    moved: Moved,
    wide: bool,
) -> f64 {
    if let [chunk] = chunks {
        #[cfg(target_arch = "x86_64")]
        if wide {
            // SAFETY: `wide` is only set when the processor has AVX2.
            return unsafe { chunk_avx2(law, sweep, chunk, moved) };
        }
        let _ = wide;
        return if I::ROLLING {
            chunk_in::<Portable, I, 3>(law, sweep, chunk, moved)
        } else {
            chunk_in::<Portable, I, 2>(law, sweep, chunk, moved)
        };
    }
    let (front, back) = chunks.split_at_mut(chunks.len() / 2);
    let (moved_front, moved_back) = moved.cut(&back[0], sweep.fixed);
    let front = || first(law, sweep, front, moved_front, wide);
    let back = || first(law, sweep, back, moved_back, wide);
    let (a, b) = if sweep.parallel {
        rayon::join(front, back)
    } else {
        (front(), back())
    };
    a.max(b)
}

/// Moves the shared grains of each chunk.
fn second<I: Interaction>(
    sweep: &Sweep,
    all: &[Chunk],
    chunks: &[Chunk],
    moved: Moved,
    wide: bool,
) {
    if let [chunk] = chunks {
        #[cfg(target_arch = "x86_64")]
        if wide {
            // SAFETY: `wide` is only set when the processor has AVX2.
            unsafe { shared_avx2::<I>(sweep, all, chunk, moved) };
            return;
        }
        let _ = wide;
        return shared_in::<Portable, I>(sweep, all, chunk, moved);
    }
    let (front, back) = chunks.split_at(chunks.len() / 2);
    let (moved_front, moved_back) = moved.cut(&back[0], sweep.fixed);
    let front = || second::<I>(sweep, all, front, moved_front, wide);
    let back = || second::<I>(sweep, all, back, moved_back, wide);
    if sweep.parallel {
        rayon::join(front, back);
    } else {
        front();
        back();
    }
}

/// The sweep compiled for AVX2.
///
/// # Safety
/// The processor must have AVX2.
#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2")]
unsafe fn chunk_avx2<I: Interaction>(
    law: &I,
    sweep: &Sweep,
    chunk: &mut Chunk,
    moved: Moved,
) -> f64 {
    if I::ROLLING {
        chunk_in::<crate::lanes::avx2::Avx2, I, 3>(law, sweep, chunk, moved)
    } else {
        chunk_in::<crate::lanes::avx2::Avx2, I, 2>(law, sweep, chunk, moved)
    }
}

/// Moving the shared grains, compiled for AVX2.
///
/// # Safety
/// The processor must have AVX2.
#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2")]
unsafe fn shared_avx2<I: Interaction>(sweep: &Sweep, all: &[Chunk], chunk: &Chunk, moved: Moved) {
    shared_in::<crate::lanes::avx2::Avx2, I>(sweep, all, chunk, moved);
}

#[inline(always)]
fn chunk_in<L: Lanes4, I: Interaction, const ROWS: usize>(
    law: &I,
    sweep: &Sweep,
    chunk: &mut Chunk,
    mut moved: Moved,
) -> f64 {
    let rows = ROWS;
    let ring = if sweep.pass == Pass::Step {
        chunk.ring
    } else {
        Ring::ALL
    };
    let n = chunk.grains.len();
    let mut block = [[[0.0; 4]; ROWS]; BLOCK];
    let mut deepest = L::splat(0.0);
    let like = like_coefficients::<L, I>(law);
    let (mut evaluated, mut at, mut exported) = (0, 0, 0);
    let mut cursor = Cursor::default();
    let mut shared = 0;
    moved.fastest.fill(0.0);
    let mut from = 0;
    while from < n {
        let to = (from + BLOCK).min(n);
        if sweep.pass != Pass::Motion {
            let end = chunk.pairs_before[from / BLOCK] as usize;
            while evaluated < end {
                let k = evaluated;
                let (i, j) = (&chunk.i[k..k + 4], &chunk.j[k..k + 4]);
                let history = &mut chunk.history[k / 4 * I::HISTORY..][..I::HISTORY];
                let slots = &mut chunk.slots[at * rows..][..4 * rows];
                let field = &sweep.field;
                batch::<L, I>(law, &like, field, i, j, history, slots, &mut deepest);
                evaluated += 4;
                at += 4;
                if at == ring {
                    at = 0;
                }
            }
            let ring = Ring::at(evaluated, ring);
            while exported < chunk.exported.len() && (chunk.exported[exported] as usize) < end {
                let at = ring.place(chunk.exported[exported] as usize) * rows;
                chunk.exports[exported * rows..][..rows]
                    .copy_from_slice(&chunk.slots[at..at + rows]);
                exported += 1;
            }
        }
        if sweep.pass != Pass::Forces {
            let ring = Ring::at(evaluated, ring);
            sums::<L, ROWS>(chunk, [from, to], ring, &mut block);
            for (g, sum) in (chunk.grains.start + from..chunk.grains.start + to).zip(&block) {
                if shared < chunk.shared.len() && chunk.shared[shared].grain as usize == g {
                    chunk.partial[shared][..ROWS].copy_from_slice(sum);
                    shared += 1;
                    continue;
                }
                let mut sum = Sum::<L>::load(sum);
                sum.lean(sweep.planes, g);
                sum.bear(sweep.loads, g);
                move_grain(sweep, g, &sum, &mut moved, &mut cursor);
            }
        }
        from = to;
    }
    let mut out = [0.0; 4];
    deepest.store(&mut out);
    out.iter().fold(0.0, |a: f64, &b| a.max(b))
}

#[inline(always)]
fn shared_in<L: Lanes4, I: Interaction>(
    sweep: &Sweep,
    all: &[Chunk],
    chunk: &Chunk,
    mut moved: Moved,
) {
    let mut cursor = Cursor::default();
    for s in 0..chunk.shared.len() {
        let g = chunk.shared[s].grain as usize;
        let mut sum = Sum::<L>::load(&chunk.partial[s][..slot_rows::<I>()]);
        sum.import(all, chunk, s, slot_rows::<I>());
        sum.lean(sweep.planes, g);
        sum.bear(sweep.loads, g);
        move_grain(sweep, g, &sum, &mut moved, &mut cursor);
    }
}

/// Row and fixed grain at which a run over rising grains has arrived, counted from the first.
#[derive(Default)]
struct Cursor {
    row: usize,
    fixed: usize,
}

#[inline(always)]
fn move_grain<L: Lanes4>(
    sweep: &Sweep,
    g: usize,
    sum: &Sum<L>,
    moved: &mut Moved,
    cursor: &mut Cursor,
) {
    let field = &sweep.field;
    let [first, first_row, first_fixed] = moved.first;
    let body = Body([
        L::load(&field.place[g]),
        L::load(&field.motion[g]),
        L::load(&field.turn[g]),
    ]);
    let Body([place, velocity, turn]) = body.moved(sum, &sweep.motion);
    place.store(&mut moved.place[g - first]);
    turn.store(&mut moved.turn[g - first]);
    let v = &mut moved.motion[g - first];
    velocity.store(v);
    while sweep.rows[first_row + cursor.row].end as usize <= g {
        cursor.row += 1;
    }
    let drift = &sweep.rows[first_row + cursor.row].drift;
    let (a, b, c) = (v[0] - drift[0], v[1] - drift[1], v[2] - drift[2]);
    let speed2 = a * a + b * b + c * c;
    // Not a number must stay: the bound then says that lists are outdated, and the state is checked.
    let fastest = &mut moved.fastest[cursor.row];
    let faster = if speed2 > *fastest { speed2 } else { *fastest };
    *fastest = faster + 0.0 * speed2;
    if v[3] == 0.0 {
        while (sweep.fixed[first_fixed + cursor.fixed] as usize) < g {
            cursor.fixed += 1;
        }
        let taken = &mut moved.taken[cursor.fixed];
        (L::load(taken) + L::splat(sweep.motion.kick) * sum.0[0]).store(taken);
    }
}
