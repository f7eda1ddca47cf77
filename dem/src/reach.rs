//! The pairs within reach of touching, in batches of four.
//!
//! A second, shorter list under the Verlet list: pairs with a gap below a few per cent of a diameter.
//! Their histories lie in blocks of four beside them, and each pair owns a *slot* for its force and
//! moments; a grain later gathers its slots in list order. A pair that does not touch leaves zeros in
//! its slot, so neither the moment at which this list is made nor the number of threads changes a bit
//! of the sums.

use crate::domain::Images;
use crate::grains::Grains;
use crate::neighbours::Neighbours;

/// Pairs within reach and their slots.
#[derive(Clone, Debug, Default)]
pub(crate) struct Reach {
    /// Pairs, padded with the dummy grain to a multiple of four.
    pub i: Vec<u32>,
    /// See `i`.
    pub j: Vec<u32>,
    /// Pairs before padding.
    pub count: usize,
    /// Which pair of the Verlet list each one is.
    pub source: Vec<u32>,
    /// Slots of grain g as `i`: `first_own(g)..first_own[g + 1]`.
    pub first_own: Vec<u32>,
    /// Slots of grain g as `j`: `other[first_other(g)..first_other[g + 1]]`.
    pub first_other: Vec<u32>,
    pub other: Vec<u32>,
    /// `history_width` rows of four for each batch.
    pub history: Vec<[f64; 4]>,
    /// `slot_rows` rows for each pair: force, moment of the tangential force, further moment.
    pub slots: Vec<[f64; 4]>,
    /// Travel of each row since this list was made (m).
    pub travel: Vec<f64>,
    /// Time since then (s).
    pub age: f64,
    next: Vec<u32>,
}

impl Reach {
    /// Writes the histories back to the Verlet list.
    pub fn store_history(&self, list: &mut Neighbours, width: usize) {
        list.history.fill(0.0);
        for (k, &source) in self.source.iter().enumerate() {
            let block = &self.history[k / 4 * width..][..width];
            let target = &mut list.history[source as usize * width..][..width];
            for (h, row) in target.iter_mut().zip(block) {
                *h = row[k % 4];
            }
        }
    }

    /// Makes the list of pairs with a gap below `skin`, taking histories from the Verlet list.
    pub fn build(
        &mut self,
        grains: &Grains,
        list: &Neighbours,
        images: &Images,
        skin: f64,
        width: usize,
        slot_rows: usize,
    ) {
        let n = grains.len();
        let dummy = n as u32;
        self.i.clear();
        self.j.clear();
        self.source.clear();
        self.first_own.clear();
        self.first_own.push(0);
        for i in 0..n {
            let xi = &grains.place[i];
            let near = xi[3] + skin;
            for k in list.first[i]..list.first[i + 1] {
                let j = list.partner[k as usize];
                let xj = &grains.place[j as usize];
                let r2 = images.distance_squared(xi, xj);
                let near = near + xj[3];
                if r2 < near * near {
                    self.i.push(i as u32);
                    self.j.push(j);
                    self.source.push(k);
                }
            }
            self.first_own.push(self.i.len() as u32);
        }
        self.count = self.i.len();
        let padded = self.count.next_multiple_of(4);
        self.i.resize(padded, dummy);
        self.j.resize(padded, dummy);

        self.history.clear();
        self.history.resize(padded / 4 * width, [0.0; 4]);
        for (k, &source) in self.source.iter().enumerate() {
            let from = &list.history[source as usize * width..][..width];
            let block = &mut self.history[k / 4 * width..][..width];
            for (row, &h) in block.iter_mut().zip(from) {
                row[k % 4] = h;
            }
        }
        self.slots.clear();
        self.slots.resize(padded * slot_rows, [0.0; 4]);
        self.index_partners(n);
        self.travel.clear();
        self.travel.resize(list.rows.len(), 0.0);
        self.age = 0.0;
    }

    fn index_partners(&mut self, n: usize) {
        self.first_other.clear();
        self.first_other.resize(n + 1, 0);
        for &j in &self.j[..self.count] {
            self.first_other[j as usize + 1] += 1;
        }
        for g in 0..n {
            self.first_other[g + 1] += self.first_other[g];
        }
        self.next.clear();
        self.next.extend_from_slice(&self.first_other[..n]);
        self.other.clear();
        self.other.resize(self.count, 0);
        for (k, &j) in self.j[..self.count].iter().enumerate() {
            let at = &mut self.next[j as usize];
            self.other[*at as usize] = k as u32;
            *at += 1;
        }
    }
}
