//! Numerical LDLᵀ factors in supernodes, subtrees side by side.
//!
//! A supernode takes what earlier ones contribute to it in their order, by whatever thread, and is then divided by its own
//! factors: nothing is summed across subtrees, so that the bits do not depend on what runs beside what. Wide supernodes, the
//! strips between large halves, are worked on in blocks of columns.

mod division;
mod layout;

use std::ops::Range;

use faer::linalg::matmul::matmul;
use faer::sparse::linalg::cholesky::supernodal::SymbolicSupernodalCholesky;
use faer::{Accum, MatMut, MatRef, Par};

use super::panels::Panels;
use super::subtrees::Subtree;
use crate::error::Error;
use crate::threads;
use division::{Strand, divide, shared};
pub(super) use layout::Layout;
use layout::Update;

/// Columns that are worked on at once.
const BLOCK: usize = 48;
/// Blocks of a wide supernode are worth another thread from so many operations on.
const WORTH_SHARING: usize = 400_000;
/// Pivots smaller than this, or of the wrong sign by round-off, are replaced by it.
pub(super) const SMALLEST_PIVOT: f64 = 1e-14;

/// Memory of a subtree.
pub(super) struct Bench {
    halves: Option<Box<[Bench; 2]>>,
    /// Where a row stands in the present supernode.
    places: Vec<u32>,
    strands: [Strand; 2],
}

/// A factorisation: the pattern and the coefficients of the matrix.
#[derive(Clone, Copy)]
pub(super) struct Factorisation<'a> {
    pub symbolic: &'a SymbolicSupernodalCholesky<usize>,
    pub layout: &'a Layout,
    pub values: &'a [f64],
}

impl Factorisation<'_> {
    fn columns(&self, s: usize) -> Range<usize> {
        columns(self.symbolic, s)
    }

    /// Where the factors of a supernode begin among all.
    fn place(&self, s: usize) -> usize {
        self.symbolic.col_ptr_for_val()[s]
    }

    /// Factors of a subtree and their panels.
    pub(super) fn factorise(
        &self,
        tree: &Subtree,
        factors: &mut [f64],
        bench: &mut Bench,
        panels: &mut Panels,
    ) -> Result<(), Error> {
        let first = self.place(tree.supernodes.start);
        if let (Some(trees), Some(benches), Some(halves)) =
            (&tree.halves, &mut bench.halves, panels.halves_mut())
        {
            let middle = self.place(trees[1].supernodes.start) - first;
            let own = self.place(tree.own) - first;
            let (low, high) = factors[..own].split_at_mut(middle);
            let ([bench_low, bench_high], [panels_low, panels_high]) = (&mut **benches, halves);
            let done = threads::join(
                true,
                || self.factorise(&trees[0], low, bench_low, panels_low),
                || self.factorise(&trees[1], high, bench_high, panels_high),
            );
            done.0.and(done.1)?;
        }
        for s in tree.own() {
            self.factorise_supernode(s, factors, first, bench)?;
        }
        panels.load(self.symbolic, factors, first);
        Ok(())
    }

    /// Factors of a supernode; those of earlier ones begin at `first` of all.
    fn factorise_supernode(
        &self,
        s: usize,
        factors: &mut [f64],
        first: usize,
        bench: &mut Bench,
    ) -> Result<(), Error> {
        let columns = self.columns(s);
        let width = columns.len();
        let below = self.symbolic.supernode(s).pattern();
        let height = width + below.len();
        let (earlier, own) = factors.split_at_mut(self.place(s) - first);
        let own = &mut own[..width * height];
        own.fill(0.0);
        let before = |ends: &[u32]| if s == 0 { 0 } else { ends[s - 1] as usize };
        let entries = before(&self.layout.ends_of_entries)..self.layout.ends_of_entries[s] as usize;
        for [slot, place] in &self.layout.entries[entries] {
            own[*place as usize] += self.values[*slot as usize];
        }
        let updates = before(&self.layout.ends_of_updates)..self.layout.ends_of_updates[s] as usize;
        let updates = &self.layout.updates[updates];
        let Bench {
            places, strands, ..
        } = bench;
        for (place, row) in columns.clone().chain(below.iter().copied()).enumerate() {
            places[row] = place as u32;
        }
        let target = Target {
            work: self,
            begin: columns.start,
            height,
            places,
            earlier,
            first,
        };
        target.update(updates, own, strands);
        let signs = &self.layout.signs[columns];
        divide(own, height, signs, strands)
    }
}

/// A supernode that takes what earlier ones contribute.
#[derive(Clone, Copy)]
struct Target<'a> {
    work: &'a Factorisation<'a>,
    begin: usize,
    height: usize,
    places: &'a [u32],
    earlier: &'a [f64],
    first: usize,
}

impl Target<'_> {
    /// Takes the contributions.
    fn update(&self, updates: &[Update], own: &mut [f64], strands: &mut [Strand; 2]) {
        let blocks = own.len().div_ceil(BLOCK * self.height);
        let half = |own: &mut [f64], first: usize, strand: &mut Strand| {
            for (n, block) in own.chunks_mut(BLOCK * self.height).enumerate() {
                self.update_block(updates, block, first + n * BLOCK, strand);
            }
        };
        let [one, other] = strands;
        if blocks < 2 || own.len() * updates.len() < WORTH_SHARING {
            return half(own, 0, one);
        }
        let middle = shared(blocks) * BLOCK;
        let (left, right) = own.split_at_mut(middle * self.height);
        threads::join(true, || half(left, 0, one), || half(right, middle, other));
    }

    /// Takes the contributions to a block of columns, the first of which is number `first`.
    fn update_block(&self, updates: &[Update], own: &mut [f64], first: usize, strand: &mut Strand) {
        let symbolic = self.work.symbolic;
        let first = self.begin + first;
        let rows_of_block = first..first + own.len() / self.height;
        for update in updates {
            let d = update.from as usize;
            let width = symbolic.supernode_end()[d] - symbolic.supernode_begin()[d];
            let pattern = symbolic.supernode(d).pattern();
            let height = width + pattern.len();
            let candidates = &pattern[update.first as usize..][..update.count as usize];
            let from = candidates.partition_point(|&row| row < rows_of_block.start);
            let count = candidates[from..].partition_point(|&row| row < rows_of_block.end);
            if count == 0 {
                continue;
            }
            let from = update.first as usize + from;
            let rows = &pattern[from..];
            let factors = &self.earlier[self.work.place(d) - self.first..][..width * height];
            if width == 1 {
                let (pivot, below) = (factors[0], &factors[1 + from..]);
                for (n, &row) in rows[..count].iter().enumerate() {
                    let column = (row - rows_of_block.start) * self.height;
                    let target = &mut own[column..column + self.height];
                    let scaled = pivot * below[n];
                    for (&row, l) in rows[n..].iter().zip(&below[n..]) {
                        target[self.places[row] as usize] -= l * scaled;
                    }
                }
                continue;
            }
            let factors_of = |rows: usize| {
                MatRef::from_column_major_slice_with_stride(
                    &factors[width + from..],
                    rows,
                    width,
                    height,
                )
            };
            let scaled = &mut strand.scaled[..count * width];
            for (n, scaled) in scaled.chunks_exact_mut(width).enumerate() {
                for (k, scaled) in scaled.iter_mut().enumerate() {
                    *scaled = factors[k * height + k] * factors[k * height + width + from + n];
                }
            }
            let product = &mut strand.product[..rows.len() * count];
            matmul(
                MatMut::from_column_major_slice_mut(product, rows.len(), count),
                Accum::Replace,
                factors_of(rows.len()),
                MatRef::from_column_major_slice(scaled, width, count),
                1.0,
                Par::Seq,
            );
            for (n, product) in product.chunks_exact(rows.len()).enumerate() {
                let column = (rows[n] - rows_of_block.start) * self.height;
                let target = &mut own[column..column + self.height];
                for (&row, change) in rows[n..].iter().zip(&product[n..]) {
                    target[self.places[row] as usize] -= change;
                }
            }
        }
    }
}

fn columns(symbolic: &SymbolicSupernodalCholesky<usize>, s: usize) -> Range<usize> {
    symbolic.supernode_begin()[s]..symbolic.supernode_end()[s]
}

impl Bench {
    /// Memory for a subtree.
    pub(super) fn new(
        symbolic: &SymbolicSupernodalCholesky<usize>,
        layout: &Layout,
        tree: &Subtree,
    ) -> Self {
        let halves = tree
            .halves
            .as_ref()
            .map(|halves| Box::new([0, 1].map(|n| Self::new(symbolic, layout, &halves[n]))));
        let (mut product, mut scaled) = (0, BLOCK * BLOCK);
        for s in tree.own() {
            let width = columns(symbolic, s).len();
            scaled = scaled.max(width.min(BLOCK) * BLOCK);
            let first = match s {
                0 => 0,
                _ => layout.ends_of_updates[s - 1] as usize,
            };
            for update in &layout.updates[first..layout.ends_of_updates[s] as usize] {
                let from = update.from as usize;
                let count = (update.count as usize).min(BLOCK);
                let rows = symbolic.supernode(from).pattern().len() - update.first as usize;
                product = product.max(rows * count);
                scaled = scaled.max(columns(symbolic, from).len() * count);
            }
        }
        Self {
            halves,
            places: vec![0; symbolic.nrows()],
            strands: [(); 2].map(|()| Strand::new(product, scaled)),
        }
    }
}
