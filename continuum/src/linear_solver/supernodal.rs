//! Numerical LDLᵀ factors in supernodes, subtrees side by side.
//!
//! A supernode takes what earlier ones contribute to it in their order, by whatever thread, and is then divided by its own
//! factors: nothing is summed across subtrees, so that the bits do not depend on what runs beside what. Wide supernodes, the
//! strips between large halves, are worked on in blocks of columns.

use std::ops::Range;

use faer::dyn_stack::{MemBuffer, MemStack};
use faer::linalg::cholesky::ldlt::factor::{
    LdltRegularization, cholesky_in_place, cholesky_in_place_scratch,
};
use faer::linalg::matmul::matmul;
use faer::linalg::triangular_solve::solve_unit_lower_triangular_in_place;
use faer::perm::PermRef;
use faer::prelude::{Reborrow, ReborrowMut};
use faer::sparse::SymbolicSparseColMatRef;
use faer::sparse::linalg::cholesky::supernodal::SymbolicSupernodalCholesky;
use faer::{Accum, MatMut, MatRef, Par};

use super::panels::Panels;
use super::subtrees::Subtree;
use crate::error::Error;
use crate::threads;

/// Columns that are worked on at once.
const BLOCK: usize = 48;
/// Blocks of a wide supernode are worth another thread from so many operations on.
const WORTH_SHARING: usize = 400_000;
/// Pivots smaller than this, or of the wrong sign by round-off, are replaced by it.
pub(super) const SMALLEST_PIVOT: f64 = 1e-14;

/// What an earlier supernode contributes to a later one.
#[derive(Debug, Clone, Copy)]
struct Update {
    from: u32,
    /// Rows of it that are columns of the later one: from this one on,
    first: u32,
    /// and so many.
    count: u32,
}

/// What belongs to each supernode of a pattern.
pub(super) struct Layout {
    /// What each supernode takes, one after the other, and where that ends.
    updates: Vec<Update>,
    ends_of_updates: Vec<u32>,
    /// Coefficients of the lower triangle of the matrix, by supernodes: which one, and where it goes.
    entries: Vec<[u32; 2]>,
    ends_of_entries: Vec<u32>,
    /// Signs of the pivots.
    signs: Vec<i8>,
}

/// Memory of a subtree.
pub(super) struct Bench {
    halves: Option<Box<[Bench; 2]>>,
    /// Where a row stands in the present supernode.
    places: Vec<u32>,
    strands: [Strand; 2],
}

/// Memory of the work on a block of columns.
struct Strand {
    product: Vec<f64>,
    scaled: Vec<f64>,
    scratch: MemBuffer,
}

impl Layout {
    /// The layout for the lower triangle of a pattern in an order.
    pub(super) fn new(
        pattern: SymbolicSparseColMatRef<'_, usize>,
        order: PermRef<'_, usize>,
        symbolic: &SymbolicSupernodalCholesky<usize>,
        sign: impl Fn(usize) -> i8,
    ) -> Self {
        let (forward, back) = order.arrays();
        let (begins, ends) = (symbolic.supernode_begin(), symbolic.supernode_end());
        let count = symbolic.n_supernodes();
        let mut owners = vec![0_u32; symbolic.nrows()];
        for (s, (&begin, &end)) in begins.iter().zip(ends).enumerate() {
            owners[begin..end].fill(s as u32);
        }
        let (updates, ends_of_updates) = all_updates(symbolic, &owners);
        // Coefficients by the supernode of their column.
        let lower = || {
            (0..pattern.ncols()).flat_map(|column| {
                let slots = pattern.col_range(column);
                let rows = &pattern.row_idx()[slots.clone()];
                let below = slots.zip(rows).filter(move |(_, row)| **row >= column);
                below.map(move |(slot, &row)| {
                    let [a, b] = [back[row], back[column]];
                    (slot, a.max(b), a.min(b))
                })
            })
        };
        let mut next = vec![0_u32; count + 1];
        for (_, _, column) in lower() {
            next[owners[column] as usize + 1] += 1;
        }
        for s in 0..count {
            next[s + 1] += next[s];
        }
        let total = next[count] as usize;
        let mut entries = vec![[0_u32; 2]; total];
        let mut rows = vec![0_u32; total];
        for (slot, row, column) in lower() {
            let place = &mut next[owners[column] as usize];
            entries[*place as usize] = [slot as u32, column as u32];
            rows[*place as usize] = row as u32;
            *place += 1;
        }
        next.truncate(count);
        let ends_of_entries = next;
        let mut places = vec![0_usize; symbolic.nrows()];
        let mut first = 0;
        for s in 0..count {
            let [begin, end] = [begins[s], ends[s]];
            let below = symbolic.supernode(s).pattern();
            let height = end - begin + below.len();
            for (place, row) in (begin..end).chain(below.iter().copied()).enumerate() {
                places[row] = place;
            }
            let last = ends_of_entries[s] as usize;
            for (entry, &row) in entries[first..last].iter_mut().zip(&rows[first..last]) {
                let column = entry[1] as usize - begin;
                entry[1] = (column * height + places[row as usize]) as u32;
            }
            first = last;
        }
        Self {
            updates,
            ends_of_updates,
            entries,
            ends_of_entries,
            signs: forward.iter().map(|&unknown| sign(unknown)).collect(),
        }
    }
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

/// The factors of a supernode that has taken what earlier ones contribute: D on the diagonal, L below.
fn divide(
    own: &mut [f64],
    height: usize,
    signs: &[i8],
    strands: &mut [Strand; 2],
) -> Result<(), Error> {
    let width = signs.len();
    if width == 1 {
        let sign = f64::from(signs[0]);
        if !own[0].is_finite() {
            return Err(Error::LinearSolver("a pivot is not finite".into()));
        }
        if own[0] * sign <= SMALLEST_PIVOT {
            own[0] = sign * SMALLEST_PIVOT;
        }
        let by = 1.0 / own[0];
        own[1..].iter_mut().for_each(|l| *l *= by);
        return Ok(());
    }
    for from in (0..width).step_by(BLOCK) {
        let to = width.min(from + BLOCK);
        let (block, later) = own[from * height..].split_at_mut((to - from) * height);
        divide_block(block, height, from, &signs[from..to], &mut strands[0])?;
        let block = &*block;
        let blocks = later.len().div_ceil(BLOCK * height);
        let half = |later: &mut [f64], first: usize, strand: &mut Strand| {
            for (n, columns) in later.chunks_mut(BLOCK * height).enumerate() {
                take_away(block, columns, height, [from, first + n * BLOCK], strand);
            }
        };
        let [one, other] = &mut *strands;
        let middle = shared(blocks) * BLOCK * height;
        if blocks < 2 || later.len() * BLOCK < WORTH_SHARING {
            half(later, to, one);
        } else {
            let (left, right) = later.split_at_mut(middle);
            threads::join(
                true,
                || half(left, to, one),
                || half(right, to + middle / height, other),
            );
        }
    }
    Ok(())
}

/// Factors of a block of columns, the first of which is number `from`.
fn divide_block(
    block: &mut [f64],
    height: usize,
    from: usize,
    signs: &[i8],
    strand: &mut Strand,
) -> Result<(), Error> {
    let width = signs.len();
    let block = MatMut::from_column_major_slice_mut(block, height, width);
    let (_, block) = block.split_at_row_mut(from);
    let (mut top, mut below) = block.split_at_row_mut(width);
    cholesky_in_place(
        top.rb_mut(),
        LdltRegularization {
            dynamic_regularization_signs: Some(signs),
            dynamic_regularization_delta: SMALLEST_PIVOT,
            dynamic_regularization_epsilon: SMALLEST_PIVOT,
        },
        Par::Seq,
        MemStack::new(&mut strand.scratch),
        Default::default(),
    )
    .map_err(|e| Error::LinearSolver(format!("{e:?}")))?;
    solve_unit_lower_triangular_in_place(top.rb(), below.rb_mut().transpose_mut(), Par::Seq);
    for j in 0..width {
        let by = 1.0 / top[(j, j)];
        below.rb_mut().col_mut(j).iter_mut().for_each(|l| *l *= by);
    }
    Ok(())
}

/// Takes what a block of a supernode contributes away from a later one; numbers of their first columns.
fn take_away(
    block: &[f64],
    columns: &mut [f64],
    height: usize,
    [from, first]: [usize; 2],
    strand: &mut Strand,
) {
    let width = block.len() / height;
    let count = columns.len() / height;
    let scaled = &mut strand.scaled[..count * width];
    for (n, scaled) in scaled.chunks_exact_mut(width).enumerate() {
        for (k, scaled) in scaled.iter_mut().enumerate() {
            *scaled = block[k * height + from + k] * block[k * height + first + n];
        }
    }
    let rows = height - first;
    matmul(
        MatMut::from_column_major_slice_with_stride_mut(&mut columns[first..], rows, count, height),
        Accum::Add,
        MatRef::from_column_major_slice_with_stride(&block[first..], rows, width, height),
        MatRef::from_column_major_slice(&*scaled, width, count),
        -1.0,
        Par::Seq,
    );
}

/// How many of the blocks of a lower triangle are half the work: later columns are shorter.
fn shared(blocks: usize) -> usize {
    (blocks * 3 / 10).max(1)
}

fn columns(symbolic: &SymbolicSupernodalCholesky<usize>, s: usize) -> Range<usize> {
    symbolic.supernode_begin()[s]..symbolic.supernode_end()[s]
}

/// What each supernode takes from earlier ones, in their order.
fn all_updates(
    symbolic: &SymbolicSupernodalCholesky<usize>,
    owners: &[u32],
) -> (Vec<Update>, Vec<u32>) {
    let count = symbolic.n_supernodes();
    let runs = |s: usize| {
        let pattern = symbolic.supernode(s).pattern();
        let mut first = 0;
        std::iter::from_fn(move || {
            let owner = owners[*pattern.get(first)?];
            let run = pattern[first..].iter();
            let length = run.take_while(|row| owners[**row] == owner).count();
            first += length;
            Some((owner as usize, first - length, length))
        })
    };
    let mut next = vec![0_u32; count + 1];
    for s in 0..count {
        runs(s).for_each(|(owner, ..)| next[owner + 1] += 1);
    }
    for s in 0..count {
        next[s + 1] += next[s];
    }
    let none = Update {
        from: 0,
        first: 0,
        count: 0,
    };
    let mut updates = vec![none; next[count] as usize];
    for s in 0..count {
        for (owner, first, length) in runs(s) {
            updates[next[owner] as usize] = Update {
                from: s as u32,
                first: first as u32,
                count: length as u32,
            };
            next[owner] += 1;
        }
    }
    next.truncate(count);
    (updates, next)
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
            strands: [(); 2].map(|()| Strand {
                product: vec![0.0; product],
                scaled: vec![0.0; scaled],
                scratch: MemBuffer::new(cholesky_in_place_scratch::<f64>(
                    BLOCK,
                    Par::Seq,
                    Default::default(),
                )),
            }),
        }
    }
}
