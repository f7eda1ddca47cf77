//! The pairs within reach of touching, in batches of four, and the histories of those that touch.
//!
//! A second, shorter list under the Verlet list: pairs with a gap below a small share of a diameter.
//! Pairs that do not touch take no part in sums, and those that do are summed in the order of the
//! Verlet list: neither the moment at which this list is made nor its skin changes a bit of them.
//!
//! The list is cut into [`Chunk`]s of consecutive rows, one or more for each thread. See `sweep.rs`
//! for what the cuts mean to a step.

use crate::chunk::Chunk;
use crate::contacts::Touching;
use crate::domain::Images;
use crate::grains::Grains;
use crate::links::{Link, link};
use crate::neighbours::Neighbours;
use crate::validity::Allowance;
use rayon::prelude::*;

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
    links: Vec<Link>,
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

/// Fewest grains of a chunk: below that a thread costs more than it gives.
const GRAINS_A_CHUNK: usize = 700;

/// Grains from which on the sums of all are too many for the cache.
const GRAINS_TO_HALVE: usize = 8192;

/// Chunks for each thread: more than one, so that a thread that is held up can be helped.
const CHUNKS_A_THREAD: usize = 2;

/// Skin at the start and its range, in smallest-grain diameters.
const SKIN: f64 = 0.015;
const SKINS: [f64; 2] = [0.003, 0.1];

/// Cost of a pair of the Verlet list when the list is made, over that of a listed pair in a step.
const COST_OF_MAKING: f64 = 2.0;

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
            links: Vec::new(),
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
            // The first rows touch the last ones: between halves, their sums need not wait.
            if around && n >= GRAINS_TO_HALVE { 2 } else { 1 }
        } else {
            (threads * CHUNKS_A_THREAD).min(n / GRAINS_A_CHUNK).max(1)
        };
        // Moving a grain costs about as much as the pairs of the Verlet list it has.
        let work = |g: usize| u64::from(first[g]) + 4 * g as u64;
        let start = |row: usize| rows.get(row).map_or(n, |r| r.start as usize);
        let mut used = 0;
        // Levels are cut apart: between them sums would have to wait for too long.
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

    /// Ties the chunks together; the list begins its life.
    fn link(&mut self, making: &Making) {
        link(&mut self.chunks, &mut self.links, self.parallel);
        self.travel.clear();
        self.travel.resize(making.list.rows.len(), 0.0);
        self.age = 0.0;
        self.steps = 0;
        self.allowance = Allowance::default();
    }

    /// Shows the histories of all touching contacts, ordered by i: `see(i, j, history)`.
    pub fn touching(&self, width: usize, mut see: impl FnMut(u32, u32, &[f64])) {
        let mut history = vec![0.0; width];
        for (chunk, place) in self.pairs() {
            chunk.history(place, &mut history);
            if history.iter().any(|&h| h != 0.0) {
                see(chunk.i[place], chunk.j[place], &history);
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
            chunk.compacted(width, &mut see);
        }
    }

    /// All pairs in order: the chunk and the pair's place in it.
    pub fn pairs(&self) -> impl Iterator<Item = (&Chunk, usize)> {
        self.chunks.iter().flat_map(|chunk| {
            let places = chunk.order.iter();
            places.map(move |&place| (chunk, place as usize))
        })
    }

    /// Remembers the histories as they are.
    pub fn remember(&mut self) {
        for chunk in &mut self.chunks {
            chunk.remember();
        }
    }

    /// Goes back to the histories that were remembered.
    pub fn recall(&mut self) {
        for chunk in &mut self.chunks {
            chunk.recall();
        }
    }
}
