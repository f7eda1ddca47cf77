//! Consecutive rows of grains and the pairs within reach whose lower grain is among them.
//!
//! Pairs have an *order*, that of the Verlet list: by their lower grain. All sums run in it. For
//! evaluation they lie at *places*, a block of grains after the other and within a block those that
//! touch first: batches are then full of contacts, or empty.

use crate::contact::HISTORY_MAX;
use crate::contacts::Touching;
use crate::forces::WIDEST;
use crate::links::{Import, Shared};
use crate::reach::Making;
use std::ops::Range;

/// Grains that are moved together, directly after their forces, while their rows are in the cache.
pub(crate) const BLOCK: usize = 128;

/// Where a block of grains ends.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct End {
    /// In the order of pairs.
    pub pairs: u32,
    /// In their places.
    pub places: u32,
    /// In the grains that its pairs and those before reach: the last of the chunk's own.
    pub reached: u32,
}

/// See the module.
#[derive(Clone, Debug, Default)]
pub(crate) struct Chunk {
    pub rows: Range<usize>,
    pub grains: Range<usize>,
    /// Pairs by place; each block is padded with the dummy grain to whole batches.
    pub i: Vec<u32>,
    /// See `i`.
    pub j: Vec<u32>,
    /// Places of the pairs in their order.
    pub order: Vec<u32>,
    /// Ends of the blocks of grains.
    pub ends: Vec<End>,
    /// Most places of a block.
    pub widest: usize,
    /// For each four places, which of the pairs touched when they were evaluated last, by bits.
    pub lanes: Vec<u8>,
    /// `width` rows for each four places.
    pub history: Vec<[f64; 4]>,
    /// Force, moment of the tangential force, further moment of pairs: of a block, or of all.
    pub slots: Vec<[f64; 4]>,
    /// Touching pairs of a block, while it is swept.
    pub found: Vec<u32>,
    /// Sums over the pairs of the grains that have any by now, in a ring.
    pub sums: Vec<[f64; 4]>,
    /// Grains in that ring: a power of two.
    pub ring: usize,
    /// Pairs whose slots outlive their block, in order, and those slots.
    pub exported: Vec<u32>,
    pub exports: Vec<[f64; 4]>,
    /// Grains that take from earlier chunks, in order, and all they take.
    pub shared: Vec<Shared>,
    pub imports: Vec<Import>,
    /// Pairs with a gap of more than half the skin.
    pub outer: usize,
    /// Partners that grain `grains.start + g` touches, while the list is made:
    /// `touched[first_touched[g]..first_touched[g + 1]]`.
    touched: Vec<u32>,
    first_touched: Vec<u32>,
    /// Pairs of a block, and their histories, on the way to or from their places.
    listed: Vec<Listed>,
    moved: Vec<[f64; 4]>,
    /// Histories before an observation.
    before: Vec<[f64; 4]>,
}

/// A pair of a block on its way to a place.
#[derive(Clone, Copy, Debug)]
struct Listed {
    i: u32,
    j: u32,
    overlaps: bool,
}

/// All of four pairs.
const ALL_LANES: u8 = 0b1111;

impl Chunk {
    /// Brings the histories of touching contacts to the front, contact by contact and in order;
    /// `touched` then lists the partners that each grain touches.
    pub fn compact(&mut self, width: usize) {
        let mut kept = 0;
        self.touched.clear();
        self.first_touched.clear();
        self.first_touched.push(0);
        let mut grain = self.grains.start as u32;
        let flat = self.history.as_flattened_mut();
        let mut from = End::default();
        for &end in &self.ends {
            // No more histories were kept than pairs have passed: the block's are overwritten at most.
            let first = from.places as usize;
            self.moved.resize(self.widest / 4 * width, [0.0; 4]);
            let moved = self.moved.as_flattened_mut();
            let length = (end.places - from.places) as usize * width;
            moved[..length].copy_from_slice(&flat[first * width..][..length]);
            for &place in &self.order[from.pairs as usize..end.pairs as usize] {
                let place = place as usize;
                let mut history = [0.0; HISTORY_MAX];
                read(&self.moved, place - first, &mut history[..width]);
                if history.iter().all(|&h| h == 0.0) {
                    continue;
                }
                flat[kept * width..][..width].copy_from_slice(&history[..width]);
                while grain < self.i[place] {
                    self.first_touched.push(kept as u32);
                    grain += 1;
                }
                make_room(&mut self.touched, 1);
                self.touched.push(self.j[place]);
                kept += 1;
            }
            from = end;
        }
        self.first_touched
            .resize(self.grains.len() + 1, kept as u32);
    }

    /// Shows the histories that [`Chunk::compact`] has left: `see(i, j, history)`.
    pub fn compacted(&self, width: usize, see: &mut impl FnMut(u32, u32, &[f64])) {
        let histories = self.history.as_flattened().chunks_exact(width);
        let mut contacts = self.touched.iter().zip(histories);
        for (g, own) in self.first_touched.windows(2).enumerate() {
            let i = (self.grains.start + g) as u32;
            for (&j, history) in contacts.by_ref().take((own[1] - own[0]) as usize) {
                see(i, j, history);
            }
        }
    }

    /// Takes over the histories of its pairs from a list of all of them, in the order of the Verlet
    /// list.
    pub fn take_up(&mut self, touching: &Touching, making: &Making, skin: f64) {
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
    pub fn fill(&mut self, making: &Making, skin: f64) {
        self.i.clear();
        self.j.clear();
        self.order.clear();
        self.ends.clear();
        (self.outer, self.widest, self.ring) = (0, 0, 1);
        let (mut next, mut last) = (0, 0);
        for from in self.grains.clone().step_by(BLOCK) {
            let to = (from + BLOCK).min(self.grains.end);
            self.list(from..to, making, skin, &mut next);
            let own = |pair: &Listed| pair.j as usize;
            let own = self.listed.iter().map(own).filter(|&j| j < self.grains.end);
            last = own.fold(last.max(to - 1), usize::max);
            self.ring = self.ring.max((last - from + 1).next_power_of_two());
            self.place(making.grains.len() as u32, last as u32 + 1);
        }
        self.lanes.clear();
        self.lanes.resize(self.i.len() / 4, ALL_LANES);
        self.spread(making.width);
    }

    /// Finds the pairs of a block.
    fn list(&mut self, block: Range<usize>, making: &Making, skin: f64, next: &mut usize) {
        let Making {
            grains,
            list,
            images,
            hold,
            ..
        } = *making;
        self.listed.clear();
        for i in block {
            let xi = &grains.place[i];
            let near = xi[3] + skin + hold;
            let end = self.first_touched[i - self.grains.start + 1] as usize;
            for &j in list.partners(i) {
                let xj = &grains.place[j as usize];
                let r2 = images.distance_squared(xi, xj);
                let near = near + xj[3];
                // A contact that ends in this very step is kept, so that none gets lost on the way.
                let touches = *next < end && self.touched[*next] == j;
                *next += usize::from(touches);
                if r2 < near * near || touches {
                    let (reach, half) = (xi[3] + xj[3], near - 0.5 * skin);
                    self.outer += usize::from(r2 > half * half);
                    self.listed.push(Listed {
                        i: i as u32,
                        j,
                        overlaps: r2 < reach * reach,
                    });
                }
            }
        }
    }

    /// Gives the pairs of a block their places.
    fn place(&mut self, dummy: u32, reached: u32) {
        let first = self.i.len();
        let touching = self.listed.iter().filter(|pair| pair.overlaps).count();
        let [mut touching, mut apart] = [first, first + touching];
        let places = self.listed.len().next_multiple_of(WIDEST);
        make_room(&mut self.i, places);
        make_room(&mut self.j, places);
        make_room(&mut self.order, places);
        self.i.resize(first + places, dummy);
        self.j.resize(first + places, dummy);
        for pair in &self.listed {
            let place = if pair.overlaps {
                &mut touching
            } else {
                &mut apart
            };
            self.i[*place] = pair.i;
            self.j[*place] = pair.j;
            self.order.push(*place as u32);
            *place += 1;
        }
        self.widest = self.widest.max(places);
        self.ends.push(End {
            pairs: self.order.len() as u32,
            places: self.i.len() as u32,
            reached,
        });
    }

    /// Spreads compact histories over the blocks of the new pairs, in place.
    ///
    /// The compact ones are moved to the end first. Every one of them has a pair, so the number of
    /// pairs that follow it is never below the number of histories that follow: those of later blocks
    /// are never overwritten.
    fn spread(&mut self, width: usize) {
        let (places, start) = (self.i.len(), self.grains.start);
        let rows = places / 4 * width;
        let more = rows.saturating_sub(self.history.len());
        make_room(&mut self.history, more);
        self.history.resize(rows, [0.0; 4]);
        let mut rest = (places - self.touched.len()) * width;
        let flat = self.history.as_flattened_mut();
        flat.copy_within(..self.touched.len() * width, rest);
        let (mut next, mut from) = (0, End::default());
        for &end in &self.ends {
            let first = from.places as usize;
            self.moved.resize(self.widest / 4 * width, [0.0; 4]);
            self.moved.fill([0.0; 4]);
            for &place in &self.order[from.pairs as usize..end.pairs as usize] {
                let place = place as usize;
                // Both are in the order of the list.
                let own = self.first_touched[self.i[place] as usize - start + 1] as usize;
                if next < own && self.touched[next] == self.j[place] {
                    write(&mut self.moved, place - first, &flat[rest..rest + width]);
                    next += 1;
                    rest += width;
                }
            }
            let length = (end.places as usize - first) * width;
            let moved = &self.moved.as_flattened()[..length];
            flat[first * width..][..length].copy_from_slice(moved);
            from = end;
        }
        debug_assert_eq!(next, self.touched.len(), "a history has lost its pair");
    }

    /// History of the pair at a place.
    pub fn history(&self, place: usize, history: &mut [f64]) {
        read(&self.history, place, history);
    }

    /// Remembers the histories as they are.
    pub fn remember(&mut self) {
        self.before.clone_from(&self.history);
    }

    /// Goes back to the histories that were remembered.
    pub fn recall(&mut self) {
        std::mem::swap(&mut self.history, &mut self.before);
        self.lanes.fill(ALL_LANES);
    }
}

/// Makes room for so many more: growing by doubling would leave holes in memory.
fn make_room<T>(values: &mut Vec<T>, more: usize) {
    if values.capacity() - values.len() < more {
        values.reserve_exact(more.max(values.len() / 16));
    }
}

/// Reads a history from blocks of four.
fn read(blocks: &[[f64; 4]], place: usize, history: &mut [f64]) {
    let block = &blocks[place / 4 * history.len()..];
    for (h, row) in history.iter_mut().zip(block) {
        *h = row[place % 4];
    }
}

/// Writes a history into blocks of four.
fn write(blocks: &mut [[f64; 4]], place: usize, history: &[f64]) {
    let block = &mut blocks[place / 4 * history.len()..];
    for (h, row) in history.iter().zip(block) {
        row[place % 4] = *h;
    }
}
