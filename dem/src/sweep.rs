//! A step: forces and motion in one sweep over the grains.
//!
//! Pairs are ordered by their lower grain i. A block of grains at a time, the pairs with i in the block that
//! touch are evaluated and added to the sums of both grains, and the block's grains, which then have all
//! their forces, are moved while their rows are in the cache. Sums live from the first pair of a grain until
//! it is moved, in a ring.
//!
//! **Threads.** Each chunk is swept on its own. Rows that it reads of other chunks' grains are copied before
//! any grain is moved, so that rows are moved in place. Pairs of grains of two chunks are evaluated by both,
//! each for its own grain, from the same numbers. The order of every sum is the same for any cuts.

use crate::chunk::{Block, Chunk, filled, late_sum};
use crate::contact::{COEFFICIENTS, Interaction};
use crate::forces::{
    Field, Into, Pairs, WIDEST, find, like_coefficients, press, put_back, slot_rows, sum_eights,
};
use crate::lanes::{Eight, Lanes, Lanes4, Portable, Width, flat};
use crate::loads::Loads;
use crate::motion::{Body, Motion, Sum};
use crate::neighbours::Row;
use crate::rows::{Rows, fetch};
use crate::team::Team;
use crate::walls::WallContacts;
use std::time::Instant;

/// What a sweep does.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Pass {
    /// Forces and motion.
    Step,
    /// Forces alone, with the slots of all pairs, for observers.
    Forces,
    /// Motion from the sums of all grains.
    Motion,
}

/// What a sweep reads.
#[derive(Clone, Copy)]
pub(crate) struct Sweep<'a> {
    pub pass: Pass,
    pub width: Width,
    /// Whether chunks are shared out over threads.
    pub parallel: bool,
    pub team: &'a Team,
    pub field: Field<'a>,
    pub walls: &'a WallContacts,
    pub loads: &'a Loads,
    /// Sums of all grains, for [`Pass::Motion`].
    pub totals: &'a [[[f64; 4]; 3]],
    pub rows: &'a [Row],
    pub motion: Motion,
    /// Fixed grains, in order.
    pub fixed: &'a [u32],
}

/// Runs a pass over all chunks; the largest overlap over the harmonic mean radius.
pub(crate) fn run<I: Interaction>(law: &I, sweep: &Sweep, chunks: &mut [Chunk]) -> f64 {
    let rows = slot_rows::<I>();
    for chunk in chunks.iter_mut() {
        chunk.make_room(sweep.pass, rows, I::HISTORY);
    }
    if chunks.len() > 1 && sweep.pass != Pass::Motion {
        sweep
            .team
            .each(sweep.parallel, chunks, &|chunk: &mut Chunk| {
                sweep.field.rows.copy(&chunk.ghosts, chunk.first_ghost);
            });
    }
    sweep
        .team
        .each(sweep.parallel, chunks, &|chunk: &mut Chunk| {
            let begin = Instant::now();
            chunk.deepest = match sweep.width {
                Width::Portable => chunk_rows::<Portable, I>(law, sweep, chunk),
                // SAFETY: the width is one that the processor has.
                #[cfg(target_arch = "x86_64")]
                Width::Avx2 => unsafe { chunk_avx2(law, sweep, chunk) },
                // SAFETY: the width is one that the processor has.
                #[cfg(target_arch = "x86_64")]
                Width::Avx512 => unsafe { chunk_avx512(law, sweep, chunk) },
            };
            if sweep.pass == Pass::Step {
                chunk.time = chunk.time.min(begin.elapsed().as_secs_f64());
            }
        });
    chunks.iter().map(|c| c.deepest).fold(0.0, f64::max)
}

/// The sweep compiled for AVX2.
///
/// # Safety
/// The processor must have AVX2.
#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2,popcnt")]
unsafe fn chunk_avx2<I: Interaction>(law: &I, sweep: &Sweep, chunk: &mut Chunk) -> f64 {
    chunk_rows::<crate::lanes::avx2::Avx2, I>(law, sweep, chunk)
}

/// The sweep compiled for AVX-512.
///
/// # Safety
/// The processor must have AVX-512 (F, DQ, VL).
#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2,popcnt,avx512f,avx512dq,avx512vl")]
unsafe fn chunk_avx512<I: Interaction>(law: &I, sweep: &Sweep, chunk: &mut Chunk) -> f64 {
    chunk_rows::<crate::lanes::avx512::Avx512, I>(law, sweep, chunk)
}

#[inline(always)]
fn chunk_rows<L: Lanes, I: Interaction>(law: &I, sweep: &Sweep, chunk: &mut Chunk) -> f64 {
    if I::ROLLING {
        chunk_in::<L, I, 3>(law, sweep, chunk)
    } else {
        chunk_in::<L, I, 2>(law, sweep, chunk)
    }
}

#[inline(always)]
fn chunk_in<L: Lanes, I: Interaction, const ROWS: usize>(
    law: &I,
    sweep: &Sweep,
    chunk: &mut Chunk,
) -> f64 {
    let mut deepest = L::splat(0.0);
    let like = like_coefficients::<L, I>(law);
    let mut cursor = Cursor::default();
    for b in 0..chunk.blocks.len() {
        let block = chunk.blocks[b].clone();
        if let Some(next) = chunk.blocks.get(b + 1) {
            let places = next.places.start / WIDEST..next.places.end.div_ceil(WIDEST);
            fetch(&chunk.i[WIDEST * places.start..WIDEST * places.end]);
            fetch(&chunk.j[WIDEST * places.start..WIDEST * places.end]);
            fetch(&chunk.history[I::HISTORY * places.start..I::HISTORY * places.end]);
            if next.span == block.span && block.span.is_some() {
                let reached = block.reached..next.reached.max(block.reached);
                sweep.field.rows.fetch(reached);
            }
        }
        if sweep.pass != Pass::Motion {
            let block_depth = block_forces::<L, I, ROWS>(law, &like, sweep, chunk, &block);
            deepest = deepest.max(block_depth);
        }
        let Some(span) = block.span else {
            continue;
        };
        if sweep.pass == Pass::Forces {
            continue;
        }
        let own = &chunk.spans[span];
        if block.grains.start == own.grains.start {
            cursor.enter(sweep, own.rows.clone(), block.grains.start);
        }
        if sweep.pass == Pass::Motion {
            for g in block.grains.clone() {
                let sum = Sum::<L::Row>::load(&sweep.totals[g]);
                move_grain(sweep, g, &sum, &mut cursor);
            }
            if block.grains.end == own.grains.end {
                cursor.end_row(sweep);
            }
            continue;
        }
        let (first, mask) = if span == 0 {
            (block.grains.start - own.grains.start, chunk.ring - 1)
        } else {
            (own.sums + block.grains.start - own.grains.start, usize::MAX)
        };
        let eights = sum_eights(ROWS);
        let alone = sweep.walls.is_empty() && sweep.loads.is_empty();
        for (k, g) in block.grains.clone().enumerate() {
            let sum = &mut chunk.sums[((first + k) & mask) * eights..][..eights];
            let rows = flat(sum).as_chunks::<4>().0;
            let mut total = Sum::<L::Row>::load(&rows[..ROWS]);
            sum.fill(Eight::default());
            if !alone {
                total.lean(sweep.walls, g);
                total.bear(sweep.loads, g);
            }
            move_grain(sweep, g, &total, &mut cursor);
        }
        if block.grains.end == own.grains.end {
            cursor.end_row(sweep);
        }
    }
    chunk.clear_beyond(ROWS);
    deepest.largest()
}

/// Forces of the pairs of a block, into sums or slots; the largest overlaps.
#[inline(always)]
fn block_forces<L: Lanes, I: Interaction, const ROWS: usize>(
    law: &I,
    like: &[L; COEFFICIENTS],
    sweep: &Sweep,
    chunk: &mut Chunk,
    block: &Block,
) -> L {
    let mut deepest = L::splat(0.0);
    let first = block.places.start;
    let places = first..first + filled(block.places.len());
    let eights = first / WIDEST..places.end / WIDEST;
    let histories = eights.start * I::HISTORY..eights.end * I::HISTORY;
    let mut pairs = Pairs {
        i: &chunk.i[places.clone()],
        j: &chunk.j[places.clone()],
        wraps: block.wraps,
        touching: &mut chunk.touching[eights],
        history: &mut chunk.history[histories],
    };
    let contacts = &mut chunk.contacts;
    let observed = sweep.pass == Pass::Forces;
    // SAFETY: lists hold numbers of rows alone: `Chunk::list` has looked at all of them.
    unsafe { find::<L, I>(law, like, &sweep.field, &mut pairs, observed, contacts) };
    let into = if observed {
        Into::Slots(&mut chunk.slots[first * ROWS..][..places.len() * ROWS])
    } else {
        let eights = sum_eights(ROWS);
        let grains = &chunk.spans[0].grains;
        let (start, own) = (grains.start as u32, grains.len() as u32);
        let (mask, beyond) = (
            chunk.ring as u32 - 1,
            (chunk.sums.len() / eights) as u32 - 1,
        );
        let numbers = (eights * WIDEST) as u32;
        let count = contacts.count;
        for (sums, grains) in contacts.sums.iter_mut().zip([&contacts.i, &contacts.j]) {
            for (sum, grain) in sums[..count].iter_mut().zip(&grains[..count]) {
                let at = grain.wrapping_sub(start);
                *sum = if at < own { at & mask } else { beyond } * numbers;
            }
        }
        if chunk.spans.len() > 1 {
            for (sums, grains) in contacts.sums.iter_mut().zip([&contacts.i, &contacts.j]) {
                for (sum, &grain) in sums[..count].iter_mut().zip(&grains[..count]) {
                    if *sum == beyond * numbers {
                        *sum = late_sum(&chunk.spans, grain, beyond) * numbers;
                    }
                }
            }
        }
        Into::Sums(&mut chunk.sums)
    };
    // SAFETY: there are as many sums as a ring and those behind it, and the ring goes round.
    unsafe { press::<L, I, ROWS>(law, like, &sweep.field, contacts, into, &mut deepest) };
    put_back::<L, I>(&mut pairs, contacts);
    deepest
}

impl Chunk {
    /// Makes room for what a pass leaves; slots of all pairs begin as zeros.
    fn make_room(&mut self, pass: Pass, rows: usize, history: usize) {
        if pass == Pass::Motion {
            return;
        }
        self.contacts.make_room(self.widest, history);
        if pass == Pass::Step {
            let eights = self.sum_count() * sum_eights(rows);
            self.sums.resize(eights, Eight::default());
        } else {
            self.slots.clear();
            self.slots.resize(self.i.len() * rows, [0.0; 4]);
        }
    }

    /// Clears the sum of others' grains: all are zero between steps.
    fn clear_beyond(&mut self, rows: usize) {
        let beyond = self.sums.len().saturating_sub(sum_eights(rows));
        self.sums[beyond..].fill(Eight::default());
    }
}

/// Row and fixed grain at which a run over rising grains has arrived.
#[derive(Default)]
struct Cursor {
    row: usize,
    /// Where the row's grains end, and its drift.
    end: usize,
    drift: [f64; 4],
    /// Square of its largest speed against it (m²/s²), and zero unless some speed is not a number.
    fastest: f64,
    check: f64,
    fixed: usize,
}

impl Cursor {
    /// Begins at the first grain of a span.
    fn enter(&mut self, sweep: &Sweep, rows: std::ops::Range<usize>, grain: usize) {
        for fastest in &sweep.field.rows.fastest[rows.clone()] {
            fastest.set(0.0);
        }
        self.fixed = sweep.fixed.partition_point(|&f| (f as usize) < grain);
        self.row = rows.start;
        self.begin_row(sweep);
    }

    fn begin_row(&mut self, sweep: &Sweep) {
        let Row { end, drift, .. } = sweep.rows[self.row];
        self.end = end as usize;
        self.drift = [drift[0], drift[1], drift[2], 0.0];
        (self.fastest, self.check) = (0.0, 0.0);
    }

    /// Notes the fastest grain of a row.
    fn end_row(&self, sweep: &Sweep) {
        if let Some(fastest) = sweep.field.rows.fastest.get(self.row) {
            fastest.set(self.fastest + self.check);
        }
    }

    fn next_row(&mut self, sweep: &Sweep) {
        self.end_row(sweep);
        self.row += 1;
        self.begin_row(sweep);
    }
}

#[inline(always)]
fn move_grain<L: Lanes4>(sweep: &Sweep, g: usize, sum: &Sum<L>, cursor: &mut Cursor) {
    let Rows {
        place,
        motion,
        turn,
        taken,
        ..
    } = sweep.field.rows;
    let body = Body([
        L::load(&place[g].get()),
        L::load(&motion[g].get()),
        L::load(&turn[g].get()),
    ]);
    let body = body.moved(sum, &sweep.motion);
    place[g].set(body.row(0));
    motion[g].set(body.row(1));
    turn[g].set(body.row(2));
    while cursor.end <= g {
        cursor.next_row(sweep);
    }
    let against = body.0[1] - L::load(&cursor.drift);
    let speed2 = (against * against).sum_of_three();
    // Not a number must stay: the bound then says that lists are outdated, and the state is checked.
    cursor.fastest = if speed2 > cursor.fastest {
        speed2
    } else {
        cursor.fastest
    };
    cursor.check += 0.0 * speed2;
    if body.row(1)[3] == 0.0 {
        while (sweep.fixed[cursor.fixed] as usize) < g {
            cursor.fixed += 1;
        }
        let taken = &taken[cursor.fixed];
        let mut after = [0.0; 4];
        (L::load(&taken.get()) + L::splat(sweep.motion.kick) * sum.0[0]).store(&mut after);
        taken.set(after);
    }
}
