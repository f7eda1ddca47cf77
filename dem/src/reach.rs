//! The pairs within reach of touching, in batches of four, and the histories of those that touch.
//!
//! A second, shorter list under the Verlet list: pairs with a gap below a small share of a diameter.
//! Histories lie in blocks of four beside the pairs, and each pair owns a *slot* for its force and
//! moments. A pair that does not touch leaves zeros in its slot, so neither the moment at which this
//! list is made nor its skin changes a bit of the sums.
//!
//! The list is cut into [`Chunk`]s of consecutive rows, one or more for each thread. See `sweep.rs`
//! for what the cuts mean to a step.

use crate::contacts::Touching;
use crate::domain::Images;
use crate::grains::Grains;
use crate::neighbours::Neighbours;
use crate::validity::Allowance;
use rayon::prelude::*;
use std::ops::Range;

/// A slot's part in the sum of a grain.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Term(u32);

/// Bits of a [`Term`]: the grain's first one, and whether it is none at all or the pair's `j`.
const FIRST: u32 = 1;
const NONE: u32 = 2;
const OTHER: u32 = 4;
const BITS: u32 = 3;

impl Term {
    fn new(pair: usize, bits: u32) -> Self {
        Term((pair as u32) << BITS | bits)
    }

    /// The pair whose slot it is.
    #[inline(always)]
    pub fn pair(self) -> usize {
        (self.0 >> BITS) as usize
    }

    /// 1 where it is the first of a grain's terms, else 0.
    #[inline(always)]
    pub fn first(self) -> usize {
        (self.0 & FIRST) as usize
    }

    /// Index into [`SHARES`].
    #[inline(always)]
    pub fn share(self) -> usize {
        (self.0 >> 1 & 3) as usize
    }
}

/// How a grain takes a slot: force and further moment as `i`, nothing, or opposite as `j`; the moment
/// of the tangential force has the same sign for both.
pub(crate) const SHARES: [[f64; 2]; 4] = [[1.0, 1.0], [0.0, 0.0], [-1.0, 1.0], [0.0, 0.0]];

/// A grain that also takes forces from pairs of earlier chunks.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Shared {
    /// Number of the grain.
    pub grain: u32,
    /// Its imports: `first_import` up to that of the next one.
    pub first_import: u32,
}

/// A slot of an earlier chunk.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Import {
    pub chunk: u32,
    /// Index into the exports of that chunk.
    pub export: u32,
    /// The grain it acts on.
    grain: u32,
}

/// Consecutive rows of grains and all pairs (i, j) whose lower grain i is among them.
#[derive(Clone, Debug, Default)]
pub(crate) struct Chunk {
    pub rows: Range<usize>,
    pub grains: Range<usize>,
    /// Pairs, ordered by i and padded with the dummy grain to a multiple of four.
    pub i: Vec<u32>,
    /// See `i`.
    pub j: Vec<u32>,
    /// Pairs before padding.
    pub count: usize,
    /// Pairs with a gap of more than half the skin.
    outer: usize,
    /// Terms of the sum of grain `grains.start + g`: `terms[first_term[g]..first_term[g + 1]]`.
    pub first_term: Vec<u32>,
    pub terms: Vec<Term>,
    /// Pairs that must have been evaluated before each block of grains is moved.
    pub pairs_before: Vec<u32>,
    /// `history_width` rows of four for each batch.
    pub history: Vec<[f64; 4]>,
    /// Rows for each pair: force, moment of the tangential force, further moment.
    pub slots: Vec<[f64; 4]>,
    /// Slots that must be kept at a time while the chunk is swept: a multiple of four.
    pub ring: usize,
    /// Pairs whose `j` lies in a later chunk, and copies of their slots.
    pub exported: Vec<u32>,
    pub exports: Vec<[f64; 4]>,
    /// Grains that take from earlier chunks, in order.
    pub shared: Vec<Shared>,
    /// What they take, the last pair first.
    pub imports: Vec<Import>,
    /// Sums over the chunk's own pairs for each shared grain.
    pub partial: Vec<[[f64; 4]; 3]>,
    /// Partners that grain `grains.start + g` touches, while the list is made:
    /// `touched[first_touched[g]..first_touched[g + 1]]`.
    touched: Vec<u32>,
    first_touched: Vec<u32>,
    /// Histories before an observation.
    before: Vec<[f64; 4]>,
}

/// All pairs within reach.
#[derive(Clone, Debug)]
pub(crate) struct Reach {
    pub chunks: Vec<Chunk>,
    /// Largest gap of a listed pair when the list is made (m).
    pub skin: f64,
    /// The diameter that the skin goes by (m).
    diameter: f64,
    /// Steps since the list was made.
    pub steps: u32,
    /// Whether chunks are shared out over threads.
    pub parallel: bool,
    /// Travel of each row since this list was made (m).
    pub travel: Vec<f64>,
    /// Time since then (s).
    pub age: f64,
    pub allowance: Allowance,
    incoming: Vec<Import>,
}

/// Everything that making the list reads.
#[derive(Clone, Copy)]
pub(crate) struct Making<'a> {
    pub grains: &'a Grains,
    pub list: &'a Neighbours,
    pub images: Images,
    /// Numbers of history of a contact.
    pub width: usize,
    /// Largest gap that any established contact holds across (m).
    pub hold: f64,
}

/// Grains that are moved together, directly after their forces, while their rows are in the cache.
pub(crate) const BLOCK: usize = 128;

/// Fewest grains of a chunk: below that a thread costs more than it gives.
const GRAINS_A_CHUNK: usize = 700;

/// Grains from which on slots of all pairs are too many for the cache.
const GRAINS_TO_HALVE: usize = 8192;

/// Chunks for each thread: more than one, so that a thread that is held up can be helped.
const CHUNKS_A_THREAD: usize = 2;

/// Skin at the start and its range, in smallest-grain diameters.
const SKIN: f64 = 0.015;
const SKINS: [f64; 2] = [0.003, 0.1];

/// Cost of a pair of the Verlet list when the list is made, over that of a listed pair in a step.
const COST_OF_MAKING: f64 = 1.0;

impl Reach {
    /// An empty list for grains with this smallest diameter.
    pub fn new(diameter: f64) -> Self {
        Reach {
            chunks: Vec::new(),
            skin: SKIN * diameter,
            diameter,
            steps: 0,
            parallel: false,
            travel: Vec::new(),
            age: 0.0,
            allowance: Allowance::default(),
            incoming: Vec::new(),
        }
    }

    /// Goes by another smallest diameter.
    pub fn set_diameter(&mut self, diameter: f64) {
        self.skin *= diameter / self.diameter;
        self.diameter = diameter;
    }

    /// Goes to the skin at which steps would have been cheapest, at most twice or half of the last.
    ///
    /// Near the present skin s the number of pairs grows as `a s`, and the list lasts about `b s`
    /// steps: the cost of a step, `a s + c V/(b s)` with V pairs in the Verlet list, is least at
    /// `s² = c V/(a b)`. Pairs do not grow in proportion to the skin, as many grains rattle at gaps
    /// below any skin; so a comes from the pairs in the outer half of it. Counts only: the same for
    /// any number of threads. (It would change no bits, if it were not.)
    fn tune(&mut self, list: &Neighbours) {
        let outer: usize = self.chunks.iter().map(|c| c.outer).sum();
        let listing = 2.0 * outer.max(1) as f64 * f64::from(self.steps.max(1));
        let better = self.skin * (COST_OF_MAKING * list.partner.len() as f64 / listing).sqrt();
        let [least, most] = SKINS.map(|s| s * self.diameter);
        self.skin = better
            .clamp(0.5 * self.skin, 2.0 * self.skin)
            .clamp(least, most);
    }

    /// Whether a pair outside the list may have come to touch.
    pub fn outdated(&mut self, list: &Neighbours) -> bool {
        let (travel, allowance) = (&self.travel, &mut self.allowance);
        list.watch
            .outdated(&list.rows, travel, self.age, self.skin, allowance)
    }

    /// Cuts the rows into chunks of about equal work and deals out the histories.
    pub fn cut(&mut self, making: &Making, touching: &Touching, parallel: bool) {
        let (rows, first) = (&making.list.rows, &making.list.first);
        let n = making.grains.len();
        let threads = if parallel {
            rayon::current_num_threads()
        } else {
            1
        };
        self.parallel = threads > 1;
        let around = making.list.levels.first().is_some_and(|l| l.grid.closes());
        let pieces = if threads == 1 {
            // The first rows touch the last ones: between halves, their slots need not wait.
            if around && n >= GRAINS_TO_HALVE { 2 } else { 1 }
        } else {
            (threads * CHUNKS_A_THREAD).min(n / GRAINS_A_CHUNK).max(1)
        };
        // Moving a grain costs about as much as the pairs of the Verlet list it has.
        let work = |g: usize| u64::from(first[g]) + 4 * g as u64;
        let start = |row: usize| rows.get(row).map_or(n, |r| r.start as usize);
        let mut used = 0;
        // Levels are cut apart: between them slots would have to wait for too long.
        for level in 0..making.list.levels.len() {
            let range = making.list.rows_of(level);
            let (from, to) = (start(range.start), start(range.end));
            if from == to && used > 0 {
                continue;
            }
            let pieces = ((to - from) * pieces).div_ceil(n.max(1)).max(1);
            let mut row = range.start;
            for p in 1..=pieces as u64 {
                let share = work(from) + (work(to) - work(from)) * p / pieces as u64;
                let end = if p == pieces as u64 {
                    range.end
                } else {
                    let rest = &rows[row..range.end];
                    row + rest.partition_point(|r| work(r.end as usize) <= share)
                };
                if used == self.chunks.len() {
                    self.chunks.push(Chunk::default());
                }
                let chunk = &mut self.chunks[used];
                (chunk.rows, chunk.grains) = (row..end, start(row)..start(end));
                row = end;
                used += 1;
            }
        }
        self.chunks.truncate(used);
        let skin = self.skin;
        let deal = |chunk: &mut Chunk| chunk.take_up(touching, making, skin);
        if self.parallel {
            self.chunks.par_iter_mut().for_each(deal);
        } else {
            self.chunks.iter_mut().for_each(deal);
        }
        self.link(making);
    }

    /// Makes the list anew in the same chunks.
    pub fn renew(&mut self, making: &Making) {
        self.tune(making.list);
        let skin = self.skin;
        let renew = |chunk: &mut Chunk| {
            chunk.compact(making.width);
            chunk.fill(making, skin);
        };
        if self.parallel {
            self.chunks.par_iter_mut().for_each(renew);
        } else {
            self.chunks.iter_mut().for_each(renew);
        }
        self.link(making);
    }

    /// Tells each chunk which slots of earlier chunks its grains need.
    fn link(&mut self, making: &Making) {
        self.incoming.clear();
        for (c, chunk) in self.chunks.iter().enumerate() {
            for (e, &k) in chunk.exported.iter().enumerate() {
                self.incoming.push(Import {
                    chunk: c as u32,
                    export: e as u32,
                    grain: chunk.j[k as usize],
                });
            }
        }
        self.incoming
            .sort_unstable_by_key(|x| (x.grain, u32::MAX - x.chunk, u32::MAX - x.export));
        let mut rest = &self.incoming[..];
        for chunk in &mut self.chunks {
            let own = rest.partition_point(|x| (x.grain as usize) < chunk.grains.end);
            chunk.shared.clear();
            chunk.imports.clear();
            chunk.imports.extend_from_slice(&rest[..own]);
            for (k, import) in chunk.imports.iter().enumerate() {
                if chunk.shared.last().is_none_or(|s| s.grain != import.grain) {
                    chunk.shared.push(Shared {
                        grain: import.grain,
                        first_import: k as u32,
                    });
                }
            }
            chunk.partial.clear();
            chunk.partial.resize(chunk.shared.len(), [[0.0; 4]; 3]);
            rest = &rest[own..];
        }
        self.travel.clear();
        self.travel.resize(making.list.rows.len(), 0.0);
        self.age = 0.0;
        self.steps = 0;
        self.allowance = Allowance::default();
    }

    /// Shows the histories of all touching contacts, ordered by i: `see(i, j, history)`.
    pub fn touching(&self, width: usize, mut see: impl FnMut(u32, u32, &[f64])) {
        let mut history = vec![0.0; width];
        for chunk in &self.chunks {
            for k in 0..chunk.count {
                for (h, row) in history.iter_mut().zip(&chunk.history[k / 4 * width..]) {
                    *h = row[k % 4];
                }
                if history.iter().any(|&h| h != 0.0) {
                    see(chunk.i[k], chunk.j[k], &history);
                }
            }
        }
    }

    /// Brings all histories to the front of their chunks; the list is of no use until it is made anew.
    pub fn compact(&mut self, width: usize) {
        let compact = |chunk: &mut Chunk| chunk.compact(width);
        if self.parallel {
            self.chunks.par_iter_mut().for_each(compact);
        } else {
            self.chunks.iter_mut().for_each(compact);
        }
    }

    /// Shows the histories that [`Reach::compact`] has left: `see(i, j, history)`.
    pub fn compacted(&self, width: usize, mut see: impl FnMut(u32, u32, &[f64])) {
        for chunk in &self.chunks {
            let histories = chunk.history.as_flattened().chunks_exact(width);
            let mut contacts = chunk.touched.iter().zip(histories);
            for (g, own) in chunk.first_touched.windows(2).enumerate() {
                let i = (chunk.grains.start + g) as u32;
                for (&j, history) in contacts.by_ref().take((own[1] - own[0]) as usize) {
                    see(i, j, history);
                }
            }
        }
    }

    /// All pairs: the chunk and the pair's place in it.
    pub fn pairs(&self) -> impl Iterator<Item = (&Chunk, usize)> {
        self.chunks
            .iter()
            .flat_map(|chunk| (0..chunk.count).map(move |k| (chunk, k)))
    }

    /// The chunk that grain `g` belongs to.
    pub fn chunk_of(&self, g: usize) -> &Chunk {
        let at = self.chunks.partition_point(|c| c.grains.end <= g);
        &self.chunks[at]
    }

    /// Remembers the histories as they are.
    pub fn remember(&mut self) {
        for chunk in &mut self.chunks {
            chunk.before.clone_from(&chunk.history);
        }
    }

    /// Goes back to the histories that were remembered.
    pub fn recall(&mut self) {
        for chunk in &mut self.chunks {
            std::mem::swap(&mut chunk.history, &mut chunk.before);
        }
    }
}

impl Chunk {
    /// Brings the histories of touching contacts to the front, contact by contact, in place; `touched`
    /// then lists the partners that each grain touches.
    fn compact(&mut self, width: usize) {
        let mut kept = 0;
        let mut block = [[0.0; 4]; crate::contact::HISTORY_MAX];
        let flat = self.history.as_flattened_mut();
        self.touched.clear();
        self.first_touched.clear();
        self.first_touched.push(0);
        let mut grain = self.grains.start as u32;
        for k in 0..self.count {
            if k % 4 == 0 {
                let from = k * width;
                let block = block.as_flattened_mut();
                block[..4 * width].copy_from_slice(&flat[from..from + 4 * width]);
            }
            let mut any = false;
            for row in &block[..width] {
                any |= row[k % 4] != 0.0;
            }
            if !any {
                continue;
            }
            let to = &mut flat[kept * width..][..width];
            for (h, row) in to.iter_mut().zip(&block) {
                *h = row[k % 4];
            }
            while grain < self.i[k] {
                self.first_touched.push(kept as u32);
                grain += 1;
            }
            self.touched.push(self.j[k]);
            kept += 1;
        }
        self.first_touched
            .resize(self.grains.len() + 1, kept as u32);
    }

    /// Takes over the histories of its pairs from a list of all of them, in the order of the Verlet
    /// list.
    fn take_up(&mut self, touching: &Touching, making: &Making, skin: f64) {
        let width = making.width;
        self.touched.clear();
        self.first_touched.clear();
        self.first_touched.push(0);
        self.history.clear();
        let rows = (touching.counted(&self.grains) * width).div_ceil(4);
        self.history.resize(rows, [0.0; 4]);
        let flat = self.history.as_flattened_mut();
        for g in self.grains.clone() {
            for &j in making.list.partners(g) {
                let at = self.touched.len() * width;
                // All may have been found already.
                if at + width <= flat.len() && touching.copy(g, j, &mut flat[at..at + width]) {
                    self.touched.push(j);
                }
            }
            self.first_touched.push(self.touched.len() as u32);
        }
        self.fill(making, skin);
    }

    /// Lists the pairs; histories and partners stand as [`Chunk::compact`] leaves them.
    fn fill(&mut self, making: &Making, skin: f64) {
        let Making {
            grains,
            list,
            images,
            width,
            hold,
        } = *making;
        let (touched, first_touched) = (&self.touched, &self.first_touched);
        self.i.clear();
        self.j.clear();
        if self.i.capacity() == 0 {
            // Growing by doubling would leave holes in memory.
            let listed: usize = self.grains.clone().map(|g| list.partners(g).len()).sum();
            self.i.reserve_exact(listed);
            self.j.reserve_exact(listed);
        }
        self.exported.clear();
        self.outer = 0;
        let mut next = 0;
        for i in self.grains.clone() {
            let xi = &grains.place[i];
            let near = xi[3] + skin + hold;
            let end = first_touched[i - self.grains.start + 1] as usize;
            for &j in list.partners(i) {
                let xj = &grains.place[j as usize];
                let r2 = images.distance_squared(xi, xj);
                let near = near + xj[3];
                // A contact that ends in this very step is kept, so that none gets lost on the way.
                let touches = next < end && touched[next] == j;
                next += usize::from(touches);
                if r2 < near * near || touches {
                    if j as usize >= self.grains.end {
                        self.exported.push(self.i.len() as u32);
                    }
                    self.i.push(i as u32);
                    self.j.push(j);
                    let half = near - 0.5 * skin;
                    self.outer += usize::from(r2 > half * half);
                }
            }
        }
        self.count = self.i.len();
        let padded = self.count.next_multiple_of(4);
        self.i.resize(padded, grains.len() as u32);
        self.j.resize(padded, grains.len() as u32);
        self.spread(width);
        self.list_terms();
        self.fit_ring();
    }

    /// Spreads compact histories over the blocks of the new pairs, in place.
    ///
    /// The compact ones are moved to the end first. Every one of them has a pair, so the number of
    /// pairs that follow it is never below the number of histories that follow: the place a history
    /// is read from is never behind the block being written.
    fn spread(&mut self, width: usize) {
        let (padded, start) = (self.i.len(), self.grains.start);
        let (touched, first_touched) = (&self.touched, &self.first_touched);
        self.history.resize(padded / 4 * width, [0.0; 4]);
        let flat = self.history.as_flattened_mut();
        let mut from = (padded - touched.len()) * width;
        flat.copy_within(..touched.len() * width, from);
        let mut next = 0;
        let mut block = [[0.0; 4]; crate::contact::HISTORY_MAX];
        for k in (0..padded).step_by(4) {
            block[..width].fill([0.0; 4]);
            for lane in 0..(self.count - k).min(4) {
                // Both are in the order of the list.
                let own = first_touched[self.i[k + lane] as usize - start + 1] as usize;
                if next < own && touched[next] == self.j[k + lane] {
                    for (row, &h) in block.iter_mut().zip(&flat[from..from + width]) {
                        row[lane] = h;
                    }
                    next += 1;
                    from += width;
                }
            }
            flat[k * width..][..4 * width].copy_from_slice(block[..width].as_flattened());
        }
        debug_assert_eq!(next, touched.len(), "a history has lost its pair");
    }

    /// Lists the terms of each grain's sum: its pairs as `i` in order, then those as `j` from the last
    /// to the first. A grain without pairs gets a term without weight, so that sums need no branches.
    fn list_terms(&mut self) {
        let (n, from) = (self.grains.len(), self.grains.start);
        let (i, j) = (&self.i[..self.count], &self.j[..self.count]);
        let first = &mut self.first_term;
        first.clear();
        first.resize(n + 1, 0);
        for (&i, &j) in i.iter().zip(j) {
            first[i as usize - from] += 1;
            let other = j as usize - from;
            if other < n {
                first[other] += 1;
            }
        }
        let mut end = 0;
        for terms in &mut first[..n] {
            end += (*terms).max(1);
            *terms = end;
        }
        first[n] = end;
        // Each grain's terms are filled from the last to the first.
        self.terms.clear();
        self.terms.resize(end as usize, Term(NONE | FIRST));
        for (k, &j) in j.iter().enumerate() {
            let other = j as usize - from;
            if other < n {
                first[other] -= 1;
                self.terms[first[other] as usize] = Term::new(k, OTHER);
            }
        }
        for (k, &i) in i.iter().enumerate().rev() {
            let own = i as usize - from;
            first[own] -= 1;
            self.terms[first[own] as usize] = Term::new(k, 0);
        }
        let mut end = first[n];
        for terms in first[..n].iter_mut().rev() {
            if *terms == end {
                *terms -= 1;
            }
            self.terms[*terms as usize].0 |= FIRST;
            end = *terms;
        }
    }

    /// Finds how many slots are needed at a time when grains are moved block by block.
    fn fit_ring(&mut self) {
        let n = self.grains.len();
        self.pairs_before.clear();
        let (mut longest, mut end) = (4, 0);
        for from in (0..n).step_by(BLOCK) {
            let to = (from + BLOCK).min(n);
            let beyond = (self.grains.start + to) as u32;
            end += self.i[end..self.count].partition_point(|&i| i < beyond);
            let needed = end.next_multiple_of(4);
            self.pairs_before.push(needed as u32);
            let mut oldest = end;
            let terms = self.first_term[from] as usize..self.first_term[to] as usize;
            for term in &mut self.terms[terms] {
                if term.0 & NONE == 0 {
                    oldest = oldest.min(term.pair());
                } else {
                    // Any slot that is there.
                    *term = Term::new(needed.saturating_sub(1), NONE | FIRST);
                }
            }
            longest = longest.max(needed - oldest / 4 * 4);
        }
        self.ring = longest;
    }
}
