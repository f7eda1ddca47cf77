//! Histories of touching contacts on their way from one list to the next.

use crate::grains::Grains;
use crate::population::GONE;
use crate::reach::Reach;
use crate::simulation::Layout;
use crate::team::Team;
use std::ops::Range;

/// Touching contacts by their lower grain.
///
/// They live for a moment only, while no step is being made, as far as possible in the spare rows of
/// the grains. A contact takes a row or more, its partner last.
#[derive(Clone, Debug, Default)]
pub(crate) struct Touching {
    width: usize,
    /// Rows of a contact.
    rows: usize,
    /// Contacts of grain i: `first[i]..first[i + 1]`.
    first: Vec<u32>,
    /// The borrowed rows.
    spare: Vec<[f64; 4]>,
    /// More where they do not suffice.
    beyond: Vec<[f64; 4]>,
}

impl Touching {
    /// Collects all contacts of a list, whose pairs are lost; `place` says where a grain of it is now.
    pub fn collect(
        &mut self,
        reach: &mut Reach,
        grains: &mut Grains,
        layout: Layout,
        team: &Team,
        place: &dyn Fn(u32) -> u32,
    ) {
        let (width, n) = (layout.history, grains.len());
        self.open(width, n, &mut grains.spare);
        reach.compact(width, team);
        reach.compacted(width, |i, j, _| {
            let (i, j) = (place(i), place(j));
            if i != GONE && j != GONE {
                self.count(i, j);
            }
        });
        self.lay();
        reach.compacted(width, |i, j, history| {
            let (i, j) = (place(i), place(j));
            if i != GONE && j != GONE {
                self.put(i, j, history, layout.flips);
            }
        });
    }

    /// Makes ready for contacts between `n` grains.
    pub fn open(&mut self, width: usize, n: usize, spare: &mut Vec<[f64; 4]>) {
        self.width = width;
        self.rows = (width + 1).div_ceil(4);
        self.first.clear();
        self.first.resize(n + 2, 0);
        std::mem::swap(&mut self.spare, spare);
    }

    /// Counts a contact, before any is put down.
    pub fn count(&mut self, i: u32, j: u32) {
        self.first[i.min(j) as usize + 2] += 1;
    }

    /// Makes room for those counted.
    pub fn lay(&mut self) {
        for i in 2..self.first.len() {
            self.first[i] += self.first[i - 1];
        }
        let all = self.first.last().map_or(0, |&c| c as usize) * self.rows;
        let beyond = all.saturating_sub(self.spare.len());
        if beyond > self.beyond.capacity() {
            self.beyond.reserve_exact(beyond - self.beyond.len());
        }
        self.beyond.resize(beyond, [0.0; 4]);
    }

    /// Puts down a contact. Where `j < i` it is turned round, and its first `flips` numbers change
    /// sign: vectors of i against j, but not the twist about the normal.
    pub fn put(&mut self, i: u32, j: u32, history: &[f64], flips: usize) {
        let at = &mut self.first[i.min(j) as usize + 1];
        let contact = *at as usize;
        *at += 1;
        let sign = if j < i { -1.0 } else { 1.0 };
        for (k, &h) in history.iter().enumerate() {
            *self.number(contact, k) = if k < flips { sign * h } else { h };
        }
        *self.number(contact, 4 * self.rows - 1) = f64::from(i.max(j));
    }

    fn number(&mut self, contact: usize, k: usize) -> &mut f64 {
        let row = contact * self.rows + k / 4;
        let spare = self.spare.len();
        let rows = if row < spare {
            &mut self.spare[row]
        } else {
            &mut self.beyond[row - spare]
        };
        &mut rows[k % 4]
    }

    fn read(&self, contact: usize, k: usize) -> f64 {
        let row = contact * self.rows + k / 4;
        match row.checked_sub(self.spare.len()) {
            None => self.spare[row][k % 4],
            Some(beyond) => self.beyond[beyond][k % 4],
        }
    }

    /// Contacts whose lower grain is one of `grains`, all being put down.
    pub fn counted(&self, grains: &Range<usize>) -> usize {
        (self.first[grains.end] - self.first[grains.start]) as usize
    }

    /// Copies out the history of the contact of `i` with `j > i`, if there is one.
    pub fn copy(&self, i: usize, j: u32, history: &mut [f64]) -> bool {
        for contact in self.first[i] as usize..self.first[i + 1] as usize {
            if self.read(contact, 4 * self.rows - 1) == f64::from(j) {
                for (k, h) in history.iter_mut().enumerate() {
                    *h = self.read(contact, k);
                }
                return true;
            }
        }
        false
    }

    /// Gives the rows back.
    pub fn close(&mut self, spare: &mut Vec<[f64; 4]>) {
        std::mem::swap(&mut self.spare, spare);
    }
}
