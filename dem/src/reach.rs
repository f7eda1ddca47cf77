//! The pairs within reach of touching, in batches of eight, and the histories of those that touch.
//!
//! A second, shorter list under the Verlet list: pairs with a gap below a small share of a diameter.
//! Pairs that do not touch take no part in sums, and those that do are summed in the order of the
//! Verlet list: neither the moment at which this list is made nor its skin changes a bit of them.
//!
//! The grains are dealt out to [`Chunk`]s of consecutive rows, one or more for each thread. See `sweep.rs`
//! for what that means to a step.

use crate::chunk::{Chunk, Span};
use crate::contacts::Touching;
use crate::domain::Images;
use crate::grains::Grains;
use crate::lanes::Width;
use crate::neighbours::Neighbours;
use crate::team::Team;
use crate::validity::Allowance;
use std::ops::Range;

/// All pairs within reach.
#[derive(Clone, Debug)]
pub(crate) struct Reach {
    pub chunks: Vec<Chunk>,
    /// Chunk and span of all spans, in the order of their grains.
    spans: Vec<[usize; 2]>,
    /// Where the grains are cut, in rows of the level that has most.
    cuts: Vec<usize>,
    new_cuts: Vec<usize>,
    /// Steps after which it is looked at whether chunks take equally long.
    patience: u32,
    /// Steps since the grains were dealt out.
    dealt: u32,
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
}

/// Everything that making the list reads.
#[derive(Clone, Copy)]
pub(crate) struct Making<'a> {
    pub grains: &'a Grains,
    pub list: &'a Neighbours,
    pub images: Images,
    pub team: &'a Team,
    /// Registers to be used.
    pub lanes: Width,
    /// Numbers of history of a contact.
    pub width: usize,
    /// Largest gap that any established contact holds across (m).
    pub hold: f64,
}

impl Making<'_> {
    /// Whether the contact of two rows may go on: one that ends in this very step has no history any more
    /// when it is looked at next.
    pub fn keeps(&self, skin: f64) -> impl Fn(u32, u32) -> bool {
        let place = &self.grains.place;
        move |i, j| {
            let (a, b) = (&place[i as usize], &place[j as usize]);
            // Half of the skin, so that the pair is listed whatever the round-off.
            let near = a[3] + b[3] + self.hold + 0.5 * skin;
            self.images.distance_squared(a, b) < near * near
        }
    }
}

/// Fewest grains of a chunk: below that a thread costs more than it gives.
const GRAINS_A_CHUNK: usize = 700;

/// Grains from which on the sums of all are too many for the cache.
const GRAINS_TO_PART: usize = 8192;

/// Chunks for each thread: what chunks read of each other goes from cache to cache in every step.
const CHUNKS_A_THREAD: usize = 1;

/// Steps after which it is first looked at whether chunks take equally long, by how much longer than the mean the
/// slowest may take, and how many times longer it takes until the next look.
const PATIENCE: u32 = 40;
const UNEVEN: f64 = 1.03;
const MORE_PATIENCE: u32 = 4;

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
            spans: Vec::new(),
            cuts: Vec::new(),
            new_cuts: Vec::new(),
            patience: PATIENCE,
            dealt: 0,
            skin: SKIN * diameter,
            diameter,
            steps: 0,
            parallel: false,
            travel: Vec::new(),
            age: 0.0,
            allowance: Allowance::default(),
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

    /// Deals the grains out to chunks of about equal work: of each level of size a share of the rows. Says how
    /// many rows chunks read of each other.
    pub fn cut(&mut self, list: &Neighbours, grains: usize, parallel: bool, team: &Team) -> usize {
        let threads = if parallel {
            rayon::current_num_threads()
        } else {
            1
        };
        self.parallel = threads > 1;
        let pieces = if threads == 1 {
            1
        } else {
            (threads * CHUNKS_A_THREAD)
                .min(grains / GRAINS_A_CHUNK)
                .max(1)
        };
        let start = |row: usize| list.rows.get(row).map_or(grains, |r| r.start as usize);
        // Moving a grain costs about as much as the pairs of the Verlet list it has.
        let work = |grain: usize| u64::from(list.first[grain]) + 4 * grain as u64;
        // The rows of all levels up to the same share of their numbers lie in the same part of the box.
        let levels = || (0..list.levels.len()).map(|l| list.rows_of(l));
        let fine = levels().map(|rows| rows.len()).max().unwrap_or(0);
        let row = |rows: &Range<usize>, cut: usize| rows.start + rows.len() * cut / fine.max(1);
        let before = |cut: usize| {
            let works = levels().map(|rows| work(start(row(&rows, cut))) - work(start(rows.start)));
            works.sum::<u64>()
        };
        // Where grains were in a chunk that took long for its work, they count for more.
        let (chunks, cuts) = (&self.chunks, &self.cuts);
        let rows_before = cuts.last().copied().unwrap_or(0).max(1);
        let measured = pieces > 1
            && (chunks.len(), cuts.len()) == (pieces, pieces + 1)
            && chunks.iter().all(|c| c.time.is_finite() && c.work > 0);
        let before = |cut: usize| {
            if !measured {
                return before(cut) as f64;
            }
            let costs = chunks.iter().zip(cuts.windows(2)).map(|(chunk, old)| {
                let [from, to] = [old[0], old[1]].map(|row| (row * fine / rows_before).min(cut));
                chunk.time / chunk.work as f64 * (before(to) - before(from)) as f64
            });
            costs.sum::<f64>()
        };
        let mut cuts = std::mem::take(&mut self.new_cuts);
        cuts.clear();
        cuts.push(0);
        for p in 1..pieces {
            let share = before(fine) * p as f64 / pieces as f64;
            let (mut low, mut high) = (0, fine);
            while low < high {
                let middle = (low + high) / 2;
                if before(middle) < share {
                    low = middle + 1;
                } else {
                    high = middle;
                }
            }
            cuts.push(low);
        }
        cuts.push(fine);
        self.new_cuts = std::mem::replace(&mut self.cuts, cuts);
        self.dealt = 0;
        self.chunks.resize_with(pieces, Chunk::default);
        self.spans.clear();
        for (chunk, cut) in self.chunks.iter_mut().zip(self.cuts.windows(2)) {
            chunk.spans.clear();
            (chunk.time, chunk.work) = (f64::INFINITY, 0);
            let mut add = |rows: Range<usize>| {
                let grains = start(rows.start)..start(rows.end);
                chunk.work += work(grains.end) - work(grains.start);
                if !rows.is_empty() {
                    chunk.spans.push(Span {
                        rows,
                        grains,
                        sums: 0,
                    });
                }
            };
            for (l, rows) in levels().enumerate() {
                let own = row(&rows, cut[0])..row(&rows, cut[1]);
                let grid = &list.levels[l].grid;
                // Where the first rows touch the last ones, sums of these wait for a whole sweep.
                let last = own
                    .end
                    .saturating_sub(grid.cells[grid.across[0]])
                    .max(own.start);
                let waits = own.end == rows.end && grid.closes();
                if l == 0 && waits && grains >= GRAINS_TO_PART {
                    add(own.start..last);
                    add(last..own.end);
                } else {
                    add(own);
                }
            }
            if chunk.spans.is_empty() {
                chunk.spans.push(Span::default());
            }
        }
        for (c, chunk) in self.chunks.iter().enumerate() {
            self.spans.extend((0..chunk.spans.len()).map(|s| [c, s]));
        }
        let chunks = &self.chunks;
        self.spans
            .sort_by_key(|&[c, s]| chunks[c].spans[s].grains.start);
        self.each(team, |chunk| chunk.meet(list));
        let (first, mut rows) = (grains + 1, grains + 1);
        for chunk in &mut self.chunks {
            chunk.number_ghosts(rows);
            rows += chunk.ghosts.len();
        }
        rows - first
    }

    /// Whether chunks take so unequally long that the grains should be dealt out anew.
    pub fn is_uneven(&mut self) -> bool {
        self.dealt += self.steps;
        if !self.parallel || self.chunks.len() < 2 || self.dealt < self.patience {
            return false;
        }
        self.patience = self.dealt.saturating_mul(MORE_PATIENCE);
        let times = self.chunks.iter().map(|c| c.time);
        let (sum, slowest) = times.fold((0.0, 0.0_f64), |(sum, slowest), time| {
            (sum + time, slowest.max(time))
        });
        // Not a number where a chunk has not been timed yet.
        slowest * self.chunks.len() as f64 > UNEVEN * sum
    }

    /// Lists pairs in new chunks, with the histories in `touching`.
    pub fn deal(&mut self, making: &Making, touching: &Touching) {
        let skin = self.skin;
        self.each(making.team, |chunk| chunk.take_up(touching, making, skin));
        self.begin(making);
    }

    /// Makes the list anew in the same chunks.
    pub fn renew(&mut self, making: &Making) {
        self.tune(making.list);
        let skin = self.skin;
        self.each(making.team, |chunk| {
            chunk.compact(making.width, &making.keeps(skin));
            chunk.fill(making, skin);
        });
        self.begin(making);
    }

    /// Changes every chunk.
    fn each(&mut self, team: &Team, change: impl Fn(&mut Chunk) + Sync) {
        team.each(self.parallel, &mut self.chunks, &change);
    }

    /// The list begins its life.
    fn begin(&mut self, making: &Making) {
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
                let [i, j] = chunk.pair(place).map(|grain| grain as u32);
                see(i, j, &history);
            }
        }
    }

    /// Brings all histories to the front of their chunks; the list is of no use until it is made anew.
    pub fn compact(&mut self, width: usize, team: &Team) {
        self.each(team, |chunk| chunk.compact(width, &|_, _| true));
    }

    /// Shows the histories that [`Reach::compact`] has left: `see(i, j, history)`.
    pub fn compacted(&self, width: usize, mut see: impl FnMut(u32, u32, &[f64])) {
        for chunk in &self.chunks {
            chunk.compacted(width, &mut see);
        }
    }

    /// All pairs in order: the chunk and the pair's place in it.
    pub fn pairs(&self) -> impl Iterator<Item = (&Chunk, usize)> {
        self.spans.iter().flat_map(|&[c, s]| {
            let chunk = &self.chunks[c];
            let own = chunk.blocks.iter().filter(move |b| b.span == Some(s));
            own.flat_map(move |block| block.places.clone().map(move |place| (chunk, place)))
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
