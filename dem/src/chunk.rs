//! A share of the grains, and the pairs within reach that a step needs to move them.
//!
//! Pairs are ordered by their lower grain, as in the Verlet list, a block of grains after the other. All
//! sums run in this order.

use crate::contact::HISTORY_MAX;
use crate::contacts::Touching;
use crate::forces::{Contacts, WIDEST, combine, nearest_image};
use crate::lanes::{Eight, Lanes, Portable, Vec3, Width, flat, flat_mut};
use crate::neighbours::Neighbours;
use crate::reach::Making;
use std::ops::Range;

/// Grains that are moved together, directly after their forces, while their rows are in the cache.
pub(crate) const BLOCK: usize = 64;

/// Pairs of the Verlet list whose lower grain belongs to another chunk that make a block.
const FOREIGN_BLOCK: usize = 256;

/// Consecutive rows of cells and their grains.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Span {
    pub rows: Range<usize>,
    pub grains: Range<usize>,
    /// Where the sum of its first grain is; those of the first span go round in a ring.
    pub sums: usize,
}

/// Pairs whose lower grains follow each other.
#[derive(Clone, Debug, Default)]
pub(crate) struct Block {
    /// The span of the chunk's own grains that are moved after these pairs; none of other chunks' grains.
    pub span: Option<usize>,
    /// These grains.
    pub grains: Range<usize>,
    /// Where the pairs lie.
    pub places: Range<usize>,
    /// The grains of the span that these pairs and those before reach end here.
    pub reached: usize,
    /// Axes along which some pair is one of images.
    pub wraps: [bool; 3],
}

/// See the module.
#[derive(Clone, Debug, Default)]
pub(crate) struct Chunk {
    /// Its own grains, in order.
    pub spans: Vec<Span>,
    /// Grains of other chunks that its pairs meet, in order, and where the copies of their rows begin.
    pub ghosts: Vec<u32>,
    pub first_ghost: usize,
    /// Pairs of the Verlet list whose lower grain is another chunk's, by copy and own grain.
    pub foreign: Vec<[u32; 2]>,
    /// Copies of the partners in other chunks of its own grains, in the order of the Verlet list.
    pub crossing: Vec<u32>,
    /// Pairs by place; each block begins at a whole batch and is filled up with the dummy grain.
    pub i: Vec<u32>,
    /// See `i`.
    pub j: Vec<u32>,
    pub blocks: Vec<Block>,
    /// Most pairs of a block.
    pub widest: usize,
    /// For each eight places, which of the pairs touched when they were evaluated last, by bits.
    pub touching: Vec<u8>,
    /// `width` rows for each eight places.
    pub history: Vec<Eight>,
    /// Force, moment of the tangential force, further moment of all pairs, for observers.
    pub slots: Vec<[f64; 4]>,
    /// Touching pairs of a block, while it is swept.
    pub contacts: Contacts,
    /// Sums over the pairs of the grains that have any by now: a ring, those of later spans, one for the
    /// grains of others.
    pub sums: Vec<Eight>,
    /// Grains in the ring: a power of two.
    pub ring: usize,
    /// Pairs with a gap of more than half the skin.
    pub outer: usize,
    /// Largest overlap of the last forces, over the harmonic mean radius.
    pub deepest: f64,
    /// Work that it was given, by counts, and the shortest time that a step of it took (s).
    pub work: u64,
    pub time: f64,
    /// Touching pairs while the list is made, in order, and where those of each block end.
    touched: Vec<[u32; 2]>,
    ends: Vec<u32>,
    /// Pairs of a block that may be listed.
    candidates: [Vec<u32>; 2],
    /// Histories of a block on the way to or from their places.
    moved: Vec<Eight>,
    /// Histories before an observation.
    before: Vec<Eight>,
}

impl Chunk {
    /// The span that a grain is in.
    fn span_of(&self, grain: usize) -> Option<usize> {
        self.spans.iter().position(|s| s.grains.contains(&grain))
    }

    /// Sums there are.
    pub fn sum_count(&self) -> usize {
        let late = self.spans.iter().skip(1).map(|s| s.grains.len());
        self.ring + late.sum::<usize>() + 1
    }

    /// The grains of a pair.
    pub fn pair(&self, place: usize) -> [usize; 2] {
        [self.i[place], self.j[place]].map(|g| self.grain(g))
    }

    /// The grain whose row or copy this is.
    fn grain(&self, row: u32) -> usize {
        match (row as usize).checked_sub(self.first_ghost) {
            Some(ghost) => self.ghosts.get(ghost).map_or(row as usize, |&g| g as usize),
            None => row as usize,
        }
    }

    /// Whether the pair at a place touched when it was evaluated last.
    pub fn touches(&self, place: usize) -> bool {
        self.touching[place / WIDEST] >> (place % WIDEST) & 1 == 1
    }

    /// Finds pairs with grains of other chunks; copies are counted from 0.
    pub fn meet(&mut self, list: &Neighbours) {
        self.foreign.clear();
        self.crossing.clear();
        self.ghosts.clear();
        let end = self.spans.last().map_or(0, |s| s.grains.end);
        let mut from = 0;
        for s in 0..self.spans.len() {
            let own = self.spans[s].grains.clone();
            for i in from..own.start {
                for &j in list.partners(i) {
                    if (j as usize) < end && self.span_of(j as usize).is_some() {
                        self.foreign.push([i as u32, j]);
                        self.ghosts.push(i as u32);
                    }
                }
            }
            for i in own.clone() {
                for &j in list.partners(i) {
                    if !own.contains(&(j as usize)) && self.span_of(j as usize).is_none() {
                        self.crossing.push(j);
                        self.ghosts.push(j);
                    }
                }
            }
            from = own.end;
        }
        self.ghosts.sort_unstable();
        self.ghosts.dedup();
    }

    /// Takes the numbers of rows at which copies are kept.
    pub fn number_ghosts(&mut self, first: usize) {
        self.first_ghost = first;
        let ghosts = &self.ghosts;
        // All of them are there.
        let row = |grain: u32| (first + ghosts.partition_point(|&g| g < grain)) as u32;
        for pair in &mut self.foreign {
            pair[0] = row(pair[0]);
        }
        for partner in &mut self.crossing {
            *partner = row(*partner);
        }
    }

    /// Brings the histories of touching contacts to the front, contact by contact and in order; `keeps`
    /// says of which.
    pub fn compact(&mut self, width: usize, keeps: &impl Fn(u32, u32) -> bool) {
        let mut kept = 0;
        self.touched.clear();
        self.ends.clear();
        for block in &self.blocks {
            // No more histories were kept than pairs have passed: the block's are overwritten at most.
            let eights = block.places.start / WIDEST * width..;
            let eights = &self.history[eights][..filled(block.places.len()) / WIDEST * width];
            self.moved.clear();
            self.moved.extend_from_slice(eights);
            let (moved, history) = (flat(&self.moved), flat_mut(&mut self.history));
            for eight in (block.places.clone()).step_by(WIDEST) {
                let mut bits = self.touching[eight / WIDEST];
                while bits != 0 {
                    let place = eight + bits.trailing_zeros() as usize;
                    bits &= bits - 1;
                    let mut own = [0.0; HISTORY_MAX];
                    read(moved, place - block.places.start, &mut own[..width]);
                    if place >= block.places.end || own.iter().all(|&h| h == 0.0) {
                        continue;
                    }
                    let (i, j) = (self.i[place], self.j[place]);
                    if !keeps(i, j) {
                        continue;
                    }
                    history[kept * width..][..width].copy_from_slice(&own[..width]);
                    self.touched.push([i, j]);
                    kept += 1;
                }
            }
            self.ends.push(kept as u32);
        }
    }

    /// Shows the histories of its own grains that [`Chunk::compact`] has left: `see(i, j, history)`.
    pub fn compacted(&self, width: usize, see: &mut impl FnMut(u32, u32, &[f64])) {
        let (mut from, histories) = (0, flat(&self.history));
        for (block, &to) in self.blocks.iter().zip(&self.ends) {
            if block.span.is_some() {
                for contact in from..to as usize {
                    let [i, j] = self.touched[contact];
                    let j = self.grain(j) as u32;
                    see(i, j, &histories[contact * width..][..width]);
                }
            }
            from = to as usize;
        }
    }

    /// Cuts its grains and the pairs of others' into blocks.
    fn lay_blocks(&mut self) {
        self.blocks.clear();
        let mut foreign = 0;
        for (s, span) in self.spans.iter().enumerate() {
            // Those whose lower grain comes before the span.
            let before = |pair: &[u32; 2]| self.grain(pair[0]) < span.grains.start;
            let end = foreign + self.foreign[foreign..].partition_point(before);
            while foreign < end {
                let to = (foreign + FOREIGN_BLOCK).min(end);
                self.blocks.push(Block {
                    grains: foreign..to,
                    ..Block::default()
                });
                foreign = to;
            }
            for from in span.grains.clone().step_by(BLOCK) {
                self.blocks.push(Block {
                    span: Some(s),
                    grains: from..(from + BLOCK).min(span.grains.end),
                    ..Block::default()
                });
            }
        }
    }

    /// Makes room for all pairs of the Verlet list. Pages that are never written take no memory; growing bit by
    /// bit would leave holes in it.
    fn reserve(&mut self, making: &Making) {
        let own = self.spans.iter().map(|s| making.list.count(&s.grains));
        let pairs = self.foreign.len() + own.sum::<usize>();
        let places = pairs + WIDEST * (self.blocks.len() + 2);
        clear_for(&mut self.i, places);
        clear_for(&mut self.j, places);
        clear_for(&mut self.touched, pairs);
        clear_for(&mut self.history, (places / WIDEST + 1) * making.width);
        clear_for(&mut self.touching, places / WIDEST);
    }

    /// Takes over the histories of its pairs from a list of all of them, in the order of the Verlet list.
    pub fn take_up(&mut self, touching: &Touching, making: &Making, skin: f64) {
        let width = making.width;
        self.lay_blocks();
        self.touched.clear();
        self.ends.clear();
        self.reserve(making);
        let count = |s: &Span| touching.counted(&s.grains);
        let most = self.foreign.len() + self.spans.iter().map(count).sum::<usize>();
        self.history
            .resize((most * width).div_ceil(WIDEST), Eight::default());
        let keeps = making.keeps(skin);
        let mut crossing = 0;
        let blocks = std::mem::take(&mut self.blocks);
        for block in &blocks {
            if block.span.is_none() {
                for pair in block.grains.clone() {
                    let [i, j] = self.foreign[pair];
                    self.take(touching, width, self.grain(i), j, [i, j], &keeps);
                }
            } else {
                for i in block.grains.clone() {
                    for &j in making.list.partners(i) {
                        let row = self.row_of(j, &mut crossing);
                        self.take(touching, width, i, j, [i as u32, row], &keeps);
                    }
                }
            }
            self.ends.push(self.touched.len() as u32);
        }
        self.blocks = blocks;
        self.fill(making, skin);
    }

    /// Takes over the history of a pair, if it has one.
    fn take(
        &mut self,
        touching: &Touching,
        width: usize,
        i: usize,
        j: u32,
        rows: [u32; 2],
        keeps: &impl Fn(u32, u32) -> bool,
    ) {
        let at = self.touched.len() * width;
        let flat = flat_mut(&mut self.history);
        // All may have been found already.
        if at + width <= flat.len()
            && touching.copy(i, j, &mut flat[at..at + width])
            && keeps(rows[0], rows[1])
        {
            self.touched.push(rows);
        }
    }

    /// Row of a partner: its own, or its copy if it is another chunk's.
    #[inline(always)]
    fn row_of(&self, j: u32, crossing: &mut usize) -> u32 {
        let first = &self.spans[0].grains;
        if (j as usize).wrapping_sub(first.start) < first.len() {
            return j;
        }
        if self.spans.len() > 1 && self.span_of(j as usize).is_some() {
            return j;
        }
        let copy = self.crossing[*crossing];
        *crossing += 1;
        copy
    }

    /// Lists the pairs; histories and partners stand as [`Chunk::compact`] leaves them.
    pub fn fill(&mut self, making: &Making, skin: f64) {
        match making.lanes {
            Width::Portable => self.fill_in::<Portable>(making, skin),
            // SAFETY: the width is one that the processor has.
            #[cfg(target_arch = "x86_64")]
            Width::Avx2 => unsafe { self.fill_avx2(making, skin) },
            // SAFETY: the width is one that the processor has.
            #[cfg(target_arch = "x86_64")]
            Width::Avx512 => unsafe { self.fill_avx512(making, skin) },
        }
    }

    /// Listing compiled for AVX2.
    ///
    /// # Safety
    /// The processor must have AVX2.
    #[cfg(target_arch = "x86_64")]
    #[target_feature(enable = "avx2,popcnt")]
    unsafe fn fill_avx2(&mut self, making: &Making, skin: f64) {
        self.fill_in::<crate::lanes::avx2::Avx2>(making, skin);
    }

    /// Listing compiled for AVX-512.
    ///
    /// # Safety
    /// The processor must have AVX-512 (F, DQ, VL).
    #[cfg(target_arch = "x86_64")]
    #[target_feature(enable = "avx2,popcnt,avx512f,avx512dq,avx512vl")]
    unsafe fn fill_avx512(&mut self, making: &Making, skin: f64) {
        self.fill_in::<crate::lanes::avx512::Avx512>(making, skin);
    }

    #[inline(always)]
    fn fill_in<L: Lanes>(&mut self, making: &Making, skin: f64) {
        self.i.clear();
        self.j.clear();
        (self.outer, self.ring, self.widest) = (0, 1, 0);
        let (mut crossing, mut last) = (0, 0);
        let mut blocks = std::mem::take(&mut self.blocks);
        for block in &mut blocks {
            for rows in &mut self.candidates {
                rows.clear();
            }
            match block.span {
                None => {
                    for &[i, j] in &self.foreign[block.grains.clone()] {
                        self.candidates[0].push(i);
                        self.candidates[1].push(j);
                    }
                }
                Some(s) => {
                    let own = self.spans[s].grains.clone();
                    if s > 0 && block.grains.start == own.start {
                        last = 0;
                    }
                    last = last.max(block.grains.end - 1);
                    for i in block.grains.clone() {
                        for &j in making.list.partners(i) {
                            let row = self.row_of(j, &mut crossing);
                            self.candidates[0].push(i as u32);
                            self.candidates[1].push(row);
                        }
                    }
                }
            }
            self.list::<L>(block, making, skin);
            let reached = self.j[block.places.clone()].iter().map(|&j| j as usize);
            let (span, from) = match block.span {
                Some(s) => (s, block.grains.start),
                // Sums that others' pairs begin wait from the start.
                None => (0, self.spans[0].grains.start),
            };
            let own = &self.spans[span].grains;
            last = reached.filter(|j| own.contains(j)).fold(last, usize::max);
            block.reached = last + 1;
            if span == 0 {
                self.ring = self
                    .ring
                    .max((last + 1).saturating_sub(from).next_power_of_two());
            }
        }
        self.blocks = blocks;
        let mut sums = self.ring;
        for span in self.spans.iter_mut().skip(1) {
            span.sums = sums;
            sums += span.grains.len();
        }
        self.touching.clear();
        self.touching.resize(self.i.len() / WIDEST, u8::MAX);
        self.spread(making.width);
    }

    /// Lists the candidates of a block that are within reach.
    #[inline(always)]
    fn list<L: Lanes>(&mut self, block: &mut Block, making: &Making, skin: f64) {
        let (first, candidates) = (self.i.len(), self.candidates[0].len());
        let dummy = making.grains.len() as u32;
        let room = candidates + WIDEST;
        for (rows, to) in self.candidates.iter_mut().zip([&mut self.i, &mut self.j]) {
            rows.resize(candidates.next_multiple_of(WIDEST), dummy);
            to.resize(first + room, dummy);
        }
        let minus = L::repeat(&[-1.0, -1.0, -1.0, 1.0]);
        let (skin, hold) = (L::splat(skin), L::splat(making.hold));
        let half = L::splat(0.5);
        let images = &making.images;
        let periodic = images.inverse.map(|inverse| inverse != 0.0);
        let place = making.grains.place.as_ptr().cast::<f64>();
        let largest = self.candidates.iter().flatten().max();
        assert!(largest.is_none_or(|&row| (row as usize) < making.grains.place.len()));
        let mut count = first;
        block.wraps = if images.moves { periodic } else { [false; 3] };
        for at in (0..candidates).step_by(L::WIDTH) {
            let [i, j] = [0, 1].map(|side| self.candidates[side][at..].as_ptr());
            // SAFETY: candidates are whole batches, and numbers of rows.
            let [dx, dy, dz, reach] = unsafe { combine(place, i, j, minus) };
            let apart = [dx, dy, dz];
            let mut d = apart;
            nearest_image(images, periodic, &mut d);
            let r2 = Vec3(d).dot(Vec3(d));
            let (near, middle) = (reach + hold + skin, reach + hold + half * skin);
            let rest = (candidates - at).min(L::WIDTH);
            let all = ((1_u16 << rest) - 1) as u8;
            let bits = L::lanes(r2.less(near * near)) & all;
            self.outer += (bits & !L::lanes(r2.less(middle * middle))).count_ones() as usize;
            for k in 0..3 {
                let far = L::splat(0.5 * images.lengths[k]).less(apart[k].abs());
                block.wraps[k] |= periodic[k] && L::lanes(far) & bits != 0;
            }
            let [to_i, to_j] = [&mut self.i, &mut self.j].map(|to| to[count..].as_mut_ptr());
            // SAFETY: no more pairs have been listed than candidates have passed, and there is room for these
            // and a batch more.
            unsafe {
                L::pack_indices(i, bits, to_i);
                L::pack_indices(j, bits, to_j);
            }
            count += bits.count_ones() as usize;
        }
        block.places = first..count;
        self.widest = self.widest.max(count - first);
        for rows in [&mut self.i, &mut self.j] {
            let end = first + filled(count - first);
            rows[count..end].fill(dummy);
            rows.truncate(end);
        }
    }

    /// Spreads compact histories over the blocks of the new pairs, in place.
    ///
    /// The compact ones are moved to the end first. Every one of them has a pair, so the number of
    /// pairs that follow it is never below the number of histories that follow: those of later blocks
    /// are never overwritten.
    #[inline(always)]
    fn spread(&mut self, width: usize) {
        let places = self.i.len();
        let eights = places / WIDEST * width;
        self.history.resize(eights, Eight::default());
        let mut rest = (places - self.touched.len()) * width;
        let history = flat_mut(&mut self.history);
        history.copy_within(..self.touched.len() * width, rest);
        let mut next = 0;
        for (block, &end) in self.blocks.iter().zip(&self.ends) {
            let eights = filled(block.places.len()) / WIDEST * width;
            self.moved.clear();
            self.moved.resize(eights, Eight::default());
            let moved = flat_mut(&mut self.moved);
            // Both are in the order of the list.
            let mut place = block.places.start;
            for &[i, j] in &self.touched[next..end as usize] {
                while self.i[place] != i || self.j[place] != j {
                    place += 1;
                }
                write(
                    moved,
                    place - block.places.start,
                    &history[rest..rest + width],
                );
                rest += width;
            }
            next = end as usize;
            let from = block.places.start / WIDEST * width * WIDEST;
            history[from..][..moved.len()].copy_from_slice(moved);
        }
    }

    /// History of the pair at a place.
    pub fn history(&self, place: usize, history: &mut [f64]) {
        read(flat(&self.history), place, history);
    }

    /// Remembers the histories as they are.
    pub fn remember(&mut self) {
        self.before.clone_from(&self.history);
    }

    /// Goes back to the histories that were remembered.
    pub fn recall(&mut self) {
        std::mem::swap(&mut self.history, &mut self.before);
        self.touching.fill(u8::MAX);
    }
}

/// Where the sum of a grain is that is not in the first span: if it is in none, `beyond` all.
pub(crate) fn late_sum(spans: &[Span], grain: u32, beyond: u32) -> u32 {
    let grain = grain as usize;
    let own = spans[1..].iter().find(|s| s.grains.contains(&grain));
    own.map_or(beyond, |s| (s.sums + grain - s.grains.start) as u32)
}

/// So many pairs filled up to whole batches.
pub(crate) fn filled(pairs: usize) -> usize {
    pairs.next_multiple_of(WIDEST)
}

/// Empties a list that is to take so many, and more, since grains are dealt out anew: what is not written takes no
/// memory, but a list that grows leaves a hole as large as it was.
fn clear_for<T>(values: &mut Vec<T>, count: usize) {
    values.clear();
    if values.capacity() < count {
        values.reserve_exact(count + count / 4);
    }
}

/// Reads a history from rows of eight.
#[inline(always)]
fn read(rows: &[f64], place: usize, history: &mut [f64]) {
    let first = place / WIDEST * WIDEST * history.len() + place % WIDEST;
    for (k, h) in history.iter_mut().enumerate() {
        *h = rows[first + k * WIDEST];
    }
}

/// Writes a history into rows of eight.
#[inline(always)]
fn write(rows: &mut [f64], place: usize, history: &[f64]) {
    let first = place / WIDEST * WIDEST * history.len() + place % WIDEST;
    for (k, h) in history.iter().enumerate() {
        rows[first + k * WIDEST] = *h;
    }
}
