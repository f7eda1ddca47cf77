//! A step: forces and motion in one sweep over the grains.
//!
//! Pairs are ordered by their lower grain i. A block of grains at a time, all pairs with i in the block
//! are evaluated into *slots*, those that touch are added to the sums of both grains in their order,
//! and the block's grains, which then have all their forces, are moved while their rows are in the
//! cache. Slots live for a block; sums from the first pair of a grain until it is moved, in a ring.
//!
//! **Threads.** Each chunk is swept on its own. A grain that is partner in a pair of an earlier chunk
//! is *shared* (`links.rs`): it is moved after all chunks are through, from copies of its slots. So
//! rows are moved in place, although chunks read rows of later ones: only those of shared grains. The
//! order of every sum is the same for any cuts.

use crate::chunk::{BLOCK, Chunk, End};
use crate::contact::Interaction;
use crate::forces::{Batch, Field, batch, like_coefficients, slot_rows};
use crate::lanes::{Lanes, Lanes4, Portable, Width};
use crate::loads::Loads;
use crate::motion::{Body, Motion, Sum};
use crate::neighbours::Row;
use crate::rows::Rows;
use crate::walls::WallContacts;

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

/// What a sweep leaves for consecutive rows of grains.
pub(crate) struct Moved<'a> {
    /// Number of the first row and fixed grain.
    pub first: [usize; 2],
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
        let [r, f] = self.first;
        let (fastest, fastest_b) = self.fastest.split_at_mut(row - r);
        let (taken, taken_b) = self.taken.split_at_mut(held - f);
        let front = Moved {
            first: self.first,
            fastest,
            taken,
        };
        let back = Moved {
            first: [row, held],
            fastest: fastest_b,
            taken: taken_b,
        };
        (front, back)
    }

    fn reborrow(&mut self) -> Moved<'_> {
        Moved {
            first: self.first,
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
    let rows = slot_rows::<I>();
    for chunk in chunks.iter_mut() {
        chunk.make_room(sweep.pass, rows);
    }
    let deepest = first(law, sweep, chunks, moved.reborrow());
    if sweep.pass == Pass::Step && chunks.len() > 1 {
        second::<I>(sweep, chunks, chunks, moved);
    }
    deepest
}

/// Sweeps each chunk.
fn first<I: Interaction>(law: &I, sweep: &Sweep, chunks: &mut [Chunk], moved: Moved) -> f64 {
    if let [chunk] = chunks {
        return match sweep.width {
            Width::Portable => chunk_rows::<Portable, I>(law, sweep, chunk, moved),
            // SAFETY: the width is one that the processor has.
            #[cfg(target_arch = "x86_64")]
            Width::Avx2 => unsafe { chunk_avx2(law, sweep, chunk, moved) },
            // SAFETY: the width is one that the processor has.
            #[cfg(target_arch = "x86_64")]
            Width::Avx512 => unsafe { chunk_avx512(law, sweep, chunk, moved) },
        };
    }
    let (front, back) = chunks.split_at_mut(chunks.len() / 2);
    let (moved_front, moved_back) = moved.cut(&back[0], sweep.fixed);
    let front = || first(law, sweep, front, moved_front);
    let back = || first(law, sweep, back, moved_back);
    let (a, b) = if sweep.parallel {
        rayon::join(front, back)
    } else {
        (front(), back())
    };
    a.max(b)
}

/// Moves the shared grains of each chunk.
fn second<I: Interaction>(sweep: &Sweep, all: &[Chunk], chunks: &[Chunk], moved: Moved) {
    if let [chunk] = chunks {
        return match sweep.width {
            Width::Portable => shared_in::<Portable, I>(sweep, all, chunk, moved),
            // SAFETY: the width is one that the processor has; the widest ones include AVX2.
            #[cfg(target_arch = "x86_64")]
            Width::Avx2 | Width::Avx512 => unsafe { shared_avx2::<I>(sweep, all, chunk, moved) },
        };
    }
    let (front, back) = chunks.split_at(chunks.len() / 2);
    let (moved_front, moved_back) = moved.cut(&back[0], sweep.fixed);
    let front = || second::<I>(sweep, all, front, moved_front);
    let back = || second::<I>(sweep, all, back, moved_back);
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
    chunk_rows::<crate::lanes::avx2::Avx2, I>(law, sweep, chunk, moved)
}

/// The sweep compiled for AVX-512.
///
/// # Safety
/// The processor must have AVX-512 (F, DQ, VL).
#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2,avx512f,avx512dq,avx512vl")]
unsafe fn chunk_avx512<I: Interaction>(
    law: &I,
    sweep: &Sweep,
    chunk: &mut Chunk,
    moved: Moved,
) -> f64 {
    chunk_rows::<crate::lanes::avx512::Avx512, I>(law, sweep, chunk, moved)
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
fn chunk_rows<L: Lanes, I: Interaction>(
    law: &I,
    sweep: &Sweep,
    chunk: &mut Chunk,
    moved: Moved,
) -> f64 {
    if I::ROLLING {
        chunk_in::<L, I, 3>(law, sweep, chunk, moved)
    } else {
        chunk_in::<L, I, 2>(law, sweep, chunk, moved)
    }
}

#[inline(always)]
fn chunk_in<L: Lanes, I: Interaction, const ROWS: usize>(
    law: &I,
    sweep: &Sweep,
    chunk: &mut Chunk,
    mut moved: Moved,
) -> f64 {
    let mut deepest = L::splat(0.0);
    let like = like_coefficients::<L, I>(law);
    let mut cursor = Cursor::default();
    moved.fastest.fill(0.0);
    if sweep.pass == Pass::Motion {
        for g in chunk.grains.clone() {
            let sum = Sum::<L::Row>::load(&sweep.totals[g]);
            move_grain(sweep, g, &sum, &mut moved, &mut cursor);
        }
        return 0.0;
    }
    let mut from = End::default();
    let (mut exported, mut shared) = (0, 0);
    for block in 0..chunk.ends.len() {
        let end = chunk.ends[block];
        let first = if sweep.pass == Pass::Step {
            from.places as usize
        } else {
            0
        };
        if let Some(next) = chunk.ends.get(block + 1) {
            let ahead = end.reached as usize..next.reached as usize;
            sweep.field.rows.fetch(ahead);
        }
        for place in (from.places as usize..end.places as usize).step_by(L::WIDTH) {
            let fours = L::WIDTH / 4;
            let pairs = Batch {
                i: &chunk.i[place..place + L::WIDTH],
                j: &chunk.j[place..place + L::WIDTH],
                lanes: &mut chunk.lanes[place / 4..][..fours],
                history: &mut chunk.history[place / 4 * I::HISTORY..][..fours * I::HISTORY],
                slots: &mut chunk.slots[(place - first) * ROWS..][..L::WIDTH * ROWS],
            };
            batch::<L, I>(law, &like, &sweep.field, pairs, &mut deepest);
        }
        if sweep.pass == Pass::Step {
            exported = chunk.export_slots(exported, first, end, ROWS);
            chunk.sum_block::<L::Row, ROWS>(first, from, end);
            let grains = chunk.grains.start + block * BLOCK..chunk.grains.end;
            for g in grains.take(BLOCK) {
                let mut sum = chunk.take_sum::<L::Row, ROWS>(g);
                if shared < chunk.shared.len() && chunk.shared[shared].grain as usize == g {
                    shared += 1;
                    continue;
                }
                sum.lean(sweep.walls, g);
                sum.bear(sweep.loads, g);
                move_grain(sweep, g, &sum, &mut moved, &mut cursor);
            }
        }
        from = end;
    }
    chunk.clear_beyond(ROWS);
    deepest.largest()
}

impl Chunk {
    /// Makes room for what a pass leaves; slots of all pairs begin as zeros.
    fn make_room(&mut self, pass: Pass, rows: usize) {
        match pass {
            Pass::Step => {
                let slots = self.widest * rows;
                if self.slots.len() < slots {
                    self.slots.resize(slots, [0.0; 4]);
                }
                let sums = (self.ring + 1) * rows;
                if self.sums.len() < sums {
                    self.sums.resize(sums, [0.0; 4]);
                }
                if self.found.len() < self.widest {
                    self.found.resize(self.widest, 0);
                }
                self.exports.resize(self.exported.len() * rows, [0.0; 4]);
            }
            Pass::Forces => {
                self.slots.clear();
                self.slots.resize(self.i.len() * rows, [0.0; 4]);
            }
            Pass::Motion => {}
        }
    }

    /// Copies the slots of a block that are to outlive it; how many exports are there by now.
    #[inline(always)]
    fn export_slots(&mut self, mut exported: usize, first: usize, end: End, rows: usize) -> usize {
        while exported < self.exported.len() && self.exported[exported] < end.places {
            let place = self.exported[exported] as usize;
            let touches = self.touches(place) == 1;
            let copy = &mut self.exports[exported * rows..][..rows];
            if touches {
                copy.copy_from_slice(&self.slots[(place - first) * rows..][..rows]);
            } else {
                copy.fill([0.0; 4]);
            }
            exported += 1;
        }
        exported
    }

    /// 1 if the pair at a place touched when it was evaluated, else 0.
    #[inline(always)]
    pub(crate) fn touches(&self, place: usize) -> usize {
        usize::from(self.lanes[place / 4] >> (place % 4) & 1)
    }

    /// Adds the touching pairs of a block to the sums of both grains, in their order.
    #[inline(always)]
    fn sum_block<L: Lanes4, const ROWS: usize>(&mut self, first: usize, from: End, end: End) {
        // Which pairs touch cannot be foreseen: they are picked out without a branch.
        let mut touching = 0;
        for &place in &self.order[from.pairs as usize..end.pairs as usize] {
            self.found[touching] = place;
            touching += self.touches(place as usize);
        }
        let (start, n, ring) = (self.grains.start, self.grains.len(), self.ring);
        let slots = self.slots.as_chunks::<ROWS>().0;
        let sums = self.sums.as_chunks_mut::<ROWS>().0;
        for &place in &self.found[..touching] {
            let place = place as usize;
            let slot = Sum::<L>::load(&slots[place - first]);
            let i = (self.i[place] as usize - start) & (ring - 1);
            let j = self.j[place] as usize - start;
            // Partners in later chunks take theirs from the exports.
            let j = if j < n { j & (ring - 1) } else { ring };
            let mut sum = Sum::<L>::load(&sums[i]);
            sum.add(&slot);
            sum.store(&mut sums[i]);
            let mut sum = Sum::<L>::load(&sums[j]);
            sum.subtract(&slot);
            sum.store(&mut sums[j]);
        }
    }

    /// Takes the sum of a grain out of the ring.
    #[inline(always)]
    fn take_sum<L: Lanes4, const ROWS: usize>(&mut self, g: usize) -> Sum<L> {
        let at = (g - self.grains.start) & (self.ring - 1);
        let rows = &mut self.sums.as_chunks_mut::<ROWS>().0[at];
        let sum = Sum::load(rows);
        *rows = [[0.0; 4]; ROWS];
        sum
    }

    /// Clears the sum of partners in later chunks: the ring is empty between steps.
    fn clear_beyond(&mut self, rows: usize) {
        if let Some(beyond) = self.sums.get_mut(self.ring * rows..(self.ring + 1) * rows) {
            beyond.fill([0.0; 4]);
        }
    }
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
        let mut sum = Sum::<L>::import(all, chunk, s, slot_rows::<I>());
        sum.lean(sweep.walls, g);
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
    let Rows {
        place,
        motion,
        turn,
    } = sweep.field.rows;
    let [first_row, first_fixed] = moved.first;
    let body = Body([
        L::load(&place[g].get()),
        L::load(&motion[g].get()),
        L::load(&turn[g].get()),
    ]);
    let body = body.moved(sum, &sweep.motion);
    let v = body.row(1);
    place[g].set(body.row(0));
    motion[g].set(v);
    turn[g].set(body.row(2));
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

#[cfg(test)]
mod tests {
    use crate::lanes::Width;
    use crate::{
        ContactLaw, Domain, Elasticity, Epsd, Grain, Hooke, Laws, Rolling, Setup, Simulation,
        TangentialSpring, Threads, Wall,
    };
    use nalgebra::Vector3;

    /// Grains of three sizes and two materials that rain into a periodic box with a floor.
    fn rain(law: Laws) -> Simulation {
        let mut grains = Vec::new();
        for k in 0..343_u32 {
            let cell = Vector3::new(f64::from(k % 7), f64::from(k / 7 % 7), f64::from(k / 49));
            let shift = Vector3::new(k % 5, k % 3, k % 4).map(|s| 0.01 * f64::from(s));
            let radius = [0.4, 0.45, 0.5][k as usize % 3];
            let mut grain = Grain::at_rest(cell + shift + Vector3::repeat(0.5), radius, 2500.0);
            grain.velocity = Vector3::new(f64::from(k % 3) - 1.0, 0.0, -2.0);
            grain.spin = Vector3::new(0.0, f64::from(k % 4), 1.0);
            grain.material = (k as usize % law.own.len()) as u16;
            grains.push(grain);
        }
        let setup = Setup {
            domain: Domain {
                lower: Vector3::zeros(),
                upper: Vector3::new(7.0, 7.0, 20.0),
                periodic: [true, true, false],
            },
            gravity: Vector3::new(1.0, 0.0, -9.81),
            law,
            grains,
            walls: vec![Wall::plane(Vector3::zeros(), Vector3::z())],
            bodies: Vec::new(),
            timestep: 1e-4,
            threads: Threads::Serial,
        };
        Simulation::new(setup).unwrap()
    }

    #[test]
    fn registers_of_every_width_give_the_same_bits() {
        let elasticity = Elasticity {
            youngs_modulus: 5e6,
            poissons_ratio: 0.3,
        };
        let rolls = Rolling::Epsd(Epsd {
            rolling_friction: 0.1,
            damping_ratio: 0.3,
        });
        let mindlin = ContactLaw {
            rolling: rolls,
            ..ContactLaw::hertz_mindlin(elasticity, 0.6, 0.5)
        };
        let hooke = ContactLaw::linear(
            Hooke::matched(1e6, 0.7),
            TangentialSpring::matched(2.0 / 7.0, 0.7, 0.4),
            None,
        );
        let slick = ContactLaw::hertz_mindlin(elasticity, 0.8, 0.2);
        let pair = Laws {
            own: vec![mindlin, slick],
            pairs: Vec::new(),
        };
        for law in [pair, Laws::from(hooke)] {
            let hashes: Vec<String> = Width::present()
                .map(|width| {
                    let mut rain = rain(law.clone());
                    rain.width = width;
                    rain.advance(4000).unwrap();
                    assert!(rain.energy().kinetic() > 0.0);
                    rain.state_hash()
                })
                .collect();
            assert!(hashes.iter().all(|hash| *hash == hashes[0]), "{hashes:?}");
        }
    }
}
