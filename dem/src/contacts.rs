//! Histories of touching contacts on their way from one list to the next.

use std::ops::Range;

/// Touching contacts by their lower grain.
#[derive(Clone, Debug, Default)]
pub(crate) struct Touching {
    width: usize,
    /// Contacts of grain i: `first[i]..first[i + 1]`.
    first: Vec<u32>,
    partner: Vec<u32>,
    history: Vec<f64>,
    /// Contacts as they come in.
    pairs: Vec<[u32; 2]>,
    incoming: Vec<f64>,
}

impl Touching {
    /// Forgets everything.
    pub fn clear(&mut self, width: usize) {
        self.width = width;
        self.pairs.clear();
        self.incoming.clear();
    }

    /// Takes in a contact. Where `j < i` it is turned round, and its first `flips` numbers change
    /// sign: vectors of i against j, but not the twist about the normal.
    pub fn push(&mut self, i: u32, j: u32, history: &[f64], flips: usize) {
        self.pairs.push([i.min(j), i.max(j)]);
        let sign = if j < i { -1.0 } else { 1.0 };
        let turned = history.iter().enumerate();
        self.incoming
            .extend(turned.map(|(k, &h)| if k < flips { sign * h } else { h }));
    }

    /// Orders the contacts of `n` grains by their lower grain.
    pub fn order(&mut self, n: usize) {
        let width = self.width;
        self.first.clear();
        self.first.resize(n + 2, 0);
        for &[i, _] in &self.pairs {
            self.first[i as usize + 2] += 1;
        }
        for i in 2..n + 2 {
            self.first[i] += self.first[i - 1];
        }
        self.partner.clear();
        self.partner.resize(self.pairs.len(), 0);
        self.history.clear();
        self.history.resize(self.pairs.len() * width, 0.0);
        for (c, &[i, j]) in self.pairs.iter().enumerate() {
            let at = self.first[i as usize + 1] as usize;
            self.first[i as usize + 1] += 1;
            self.partner[at] = j;
            self.history[at * width..][..width]
                .copy_from_slice(&self.incoming[c * width..][..width]);
        }
        self.first.truncate(n + 1);
    }

    /// Contacts whose lower grain is one of `grains`.
    pub fn count(&self, grains: &Range<usize>) -> usize {
        (self.first[grains.end] - self.first[grains.start]) as usize
    }

    /// History of the contact of `i` with `j > i`.
    pub fn of(&self, i: usize, j: u32) -> Option<&[f64]> {
        let own = self.first[i] as usize..self.first[i + 1] as usize;
        let at = self.partner[own.clone()].iter().position(|&p| p == j)? + own.start;
        Some(&self.history[at * self.width..][..self.width])
    }
}
