//! Supernodal LDLᵀ factors laid out for substitution, and substitution for one right-hand side.
//!
//! Substitution reads the factors once forwards and once backwards and is bound by what it reads, so they are kept in
//! single precision and in the order in which they are read. The columns of a supernode are taken four at a time, a
//! panel: first its triangle with the pivots, then the rows below it, eight rows of one column, eight of the next.
//! What a panel changes is read and written once for its columns, not once for each. Sums run in one order.

use faer::sparse::linalg::cholesky::supernodal::SymbolicSupernodalCholesky;

#[cfg(target_arch = "x86_64")]
use super::lanes::{Halves, Wide};
use super::lanes::{LANES, Lanes, Plain};
use super::subtrees::Subtree;
use crate::threads;

/// Most columns of a panel.
const WIDTH: usize = 4;

/// Columns and rows of a supernode.
#[derive(Debug, Clone, Copy)]
struct Supernode {
    first: u32,
    columns: u32,
    /// Rows below its columns: so many from here on in [`Panels::rows`].
    rows_from: u32,
    rows: u32,
}

/// The factors of a subtree as substitution reads them. Its unknowns stand in a memory of its own, followed by those that it
/// changes outside, which begin at zero and are added to the ones of the tree above once it is done.
#[derive(Debug)]
pub(super) struct Panels {
    halves: Option<Box<[Panels; 2]>>,
    /// The first supernode of its own.
    own: usize,
    supernodes: Vec<Supernode>,
    rows: Vec<u32>,
    values: Vec<f32>,
    /// Where its own unknowns stand among all,
    unknowns: Vec<u32>,
    /// and where those outside stand in the memory of the tree above.
    outside: Vec<u32>,
    /// Its own unknowns, then those outside.
    memory: Vec<f64>,
    /// Unknowns of the present supernode and those below it.
    local: Vec<f64>,
}

/// Numbers of a panel of so many columns with so many rows below it.
const fn size_of_panel(width: usize, below: usize) -> usize {
    width * (WIDTH + below.next_multiple_of(LANES))
}

impl Panels {
    /// Room for the factors of a pattern, in the order `forward` of elimination.
    pub(super) fn new(
        symbolic: &SymbolicSupernodalCholesky<usize>,
        tree: &Subtree,
        forward: &[usize],
    ) -> Self {
        let mut places = vec![0; symbolic.nrows()];
        Self::of(symbolic, tree, forward, &mut places).0
    }

    /// The panels of a subtree, and the rows outside that it changes.
    fn of(
        symbolic: &SymbolicSupernodalCholesky<usize>,
        tree: &Subtree,
        forward: &[usize],
        places: &mut [u32],
    ) -> (Self, Vec<u32>) {
        let (begins, ends) = (symbolic.supernode_begin(), symbolic.supernode_end());
        let mut halves = tree
            .halves
            .as_ref()
            .map(|halves| [0, 1].map(|n| Self::of(symbolic, &halves[n], forward, places)));
        let own = begins[tree.own]..ends[tree.supernodes.end - 1];
        let mut supernodes = Vec::with_capacity(tree.own().len());
        let mut rows = Vec::new();
        let (mut numbers, mut longest) = (0, 0);
        for s in tree.own() {
            let pattern = symbolic.supernode(s).pattern();
            let columns = ends[s] - begins[s];
            supernodes.push(Supernode {
                first: (begins[s] - own.start) as u32,
                columns: columns as u32,
                rows_from: rows.len() as u32,
                rows: pattern.len() as u32,
            });
            rows.extend(pattern.iter().map(|&row| row as u32));
            longest = longest.max(columns + pattern.len());
            numbers += if columns == 1 {
                1 + pattern.len()
            } else {
                panels(columns)
                    .map(|(from, width)| {
                        size_of_panel(width, columns - from - width + pattern.len())
                    })
                    .sum()
            };
        }
        let is_outside = |row: &u32| *row as usize >= own.end;
        let mut outside: Vec<u32> = rows.iter().copied().filter(is_outside).collect();
        for (_, below) in halves.iter().flatten() {
            outside.extend(below.iter().filter(|row| is_outside(row)));
        }
        outside.sort_unstable();
        outside.dedup();
        for (place, row) in own
            .clone()
            .chain(outside.iter().map(|&r| r as usize))
            .enumerate()
        {
            places[row] = place as u32;
        }
        let to_places = |rows: &mut [u32]| {
            rows.iter_mut().for_each(|row| *row = places[*row as usize]);
        };
        to_places(&mut rows);
        for (half, below) in halves.iter_mut().flatten() {
            to_places(below);
            half.outside = std::mem::take(below);
        }
        let panels = Self {
            halves: halves.map(|halves| Box::new(halves.map(|(half, _)| half))),
            own: tree.own,
            supernodes,
            rows,
            values: vec![0.0; numbers],
            unknowns: forward[own.clone()].iter().map(|&n| n as u32).collect(),
            memory: vec![0.0; own.len() + outside.len()],
            outside: Vec::new(),
            local: vec![0.0; longest + LANES],
        };
        (panels, outside)
    }

    /// The halves that the subtree has, to be filled side by side.
    pub(super) fn halves_mut(&mut self) -> Option<&mut [Panels; 2]> {
        self.halves.as_deref_mut()
    }

    /// Takes the factors of its own supernodes over from columns, which begin at `first` of all; D stands on the diagonal of L.
    pub(super) fn load(
        &mut self,
        symbolic: &SymbolicSupernodalCholesky<usize>,
        factors: &[f64],
        first: usize,
    ) {
        let places = &symbolic.col_ptr_for_val()[self.own..];
        let mut values = self.values.as_mut_slice();
        for (node, &place) in self.supernodes.iter().zip(places) {
            let columns = node.columns as usize;
            let height = columns + node.rows as usize;
            let block = &factors[place - first..][..columns * height];
            if columns == 1 {
                let (here, later) = values.split_at_mut(height);
                values = later;
                for (value, factor) in here.iter_mut().zip(block) {
                    *value = *factor as f32;
                }
                // Divisions are slower than products.
                here[0] = (1.0 / block[0]) as f32;
                continue;
            }
            for (from, width) in panels(columns) {
                let below = height - from - width;
                let (here, later) = values.split_at_mut(size_of_panel(width, below));
                values = later;
                let (triangle, rest) = here.split_at_mut(width * WIDTH);
                for j in 0..width {
                    let column = &block[(from + j) * height..(from + j + 1) * height];
                    for (i, value) in triangle[j * WIDTH..].iter_mut().take(width).enumerate() {
                        *value = column[from + i] as f32;
                    }
                    triangle[j * WIDTH + j] = (1.0 / column[from + j]) as f32;
                    let factors = column[from + width..].chunks(LANES);
                    for (rows, factors) in rest.chunks_exact_mut(width * LANES).zip(factors) {
                        for (value, factor) in rows[j * LANES..].iter_mut().zip(factors) {
                            *value = *factor as f32;
                        }
                    }
                }
            }
        }
    }

    /// Overwrites x with (L D Lᵀ)⁻¹ x. The bits are the same on every processor and any number of threads.
    pub(super) fn substitute(&mut self, x: &mut [f64]) {
        self.go_up(x);
        self.go_down(&[]);
        self.hand_out(x);
    }

    /// Substitutes forwards: from the leaves to the root.
    fn go_up(&mut self, x: &[f64]) {
        if let Some([low, high]) = self.halves.as_deref_mut() {
            threads::join(true, || low.go_up(x), || high.go_up(x));
        }
        let (own, outside) = self.memory.split_at_mut(self.unknowns.len());
        for (y, &from) in own.iter_mut().zip(&self.unknowns) {
            *y = x[from as usize];
        }
        outside.fill(0.0);
        for half in self.halves.as_deref().into_iter().flatten() {
            let changes = &half.memory[half.unknowns.len()..];
            for (change, &to) in changes.iter().zip(&half.outside) {
                self.memory[to as usize] += change;
            }
        }
        self.on_processor(true);
    }

    /// Substitutes backwards: from the root to the leaves.
    fn go_down(&mut self, above: &[f64]) {
        let outside = &mut self.memory[self.unknowns.len()..];
        for (y, &from) in outside.iter_mut().zip(&self.outside) {
            *y = above[from as usize];
        }
        self.on_processor(false);
        if let Some([low, high]) = self.halves.as_deref_mut() {
            let above = &self.memory;
            threads::join(true, || low.go_down(above), || high.go_down(above));
        }
    }

    /// Puts the unknowns where they stand among all.
    fn hand_out(&self, x: &mut [f64]) {
        for half in self.halves.as_deref().into_iter().flatten() {
            half.hand_out(x);
        }
        for (y, &to) in self.memory.iter().zip(&self.unknowns) {
            x[to as usize] = *y;
        }
    }

    /// Without instructions of some processors, or with those of AVX2 alone, on one subtree; false if the processor has none.
    #[cfg(test)]
    pub(super) fn substitute_plainly(&mut self, x: &mut [f64], by_avx2: bool) -> bool {
        assert!(self.halves.is_none());
        for (y, &from) in self.memory.iter_mut().zip(&self.unknowns) {
            *y = x[from as usize];
        }
        for is_up in [true, false] {
            #[cfg(target_arch = "x86_64")]
            if by_avx2 && std::arch::is_x86_feature_detected!("avx2") {
                // SAFETY: the processor has been asked for AVX2.
                unsafe { self.substitute_avx2(is_up) };
                continue;
            }
            if by_avx2 {
                return false;
            }
            self.substitute_by::<Plain>(is_up);
        }
        self.hand_out(x);
        true
    }

    fn on_processor(&mut self, is_up: bool) {
        #[cfg(target_arch = "x86_64")]
        {
            if std::arch::is_x86_feature_detected!("avx512f")
                && std::arch::is_x86_feature_detected!("avx512vl")
            {
                // SAFETY: the processor has been asked for AVX-512 F and VL.
                return unsafe { self.substitute_avx512(is_up) };
            }
            if std::arch::is_x86_feature_detected!("avx2") {
                // SAFETY: the processor has been asked for AVX2.
                return unsafe { self.substitute_avx2(is_up) };
            }
        }
        self.substitute_by::<Plain>(is_up);
    }

    /// The substitution compiled for AVX2.
    ///
    /// # Safety
    /// The processor must have AVX2.
    #[cfg(target_arch = "x86_64")]
    #[target_feature(enable = "avx2")]
    unsafe fn substitute_avx2(&mut self, is_up: bool) {
        self.substitute_by::<Halves>(is_up);
    }

    /// The substitution compiled for AVX-512.
    ///
    /// # Safety
    /// The processor must have AVX-512 (F, VL).
    #[cfg(target_arch = "x86_64")]
    #[target_feature(enable = "avx2,avx512f,avx512vl")]
    unsafe fn substitute_avx512(&mut self, is_up: bool) {
        self.substitute_by::<Wide>(is_up);
    }

    #[inline(always)]
    fn substitute_by<L: Lanes>(&mut self, is_up: bool) {
        if is_up {
            self.forwards_by::<L>();
        } else {
            self.backwards_by::<L>();
        }
    }

    #[inline(always)]
    fn forwards_by<L: Lanes>(&mut self) {
        let x = self.memory.as_mut_slice();
        let mut place = 0;
        for node in &self.supernodes {
            let (first, columns) = (node.first as usize, node.columns as usize);
            let rows = &self.rows[node.rows_from as usize..][..node.rows as usize];
            if columns == 1 {
                let value = x[first];
                let factors = &self.values[place + 1..][..rows.len()];
                for (&row, l) in rows.iter().zip(factors) {
                    x[row as usize] -= f64::from(*l) * value;
                }
                place += 1 + rows.len();
                continue;
            }
            let height = columns + rows.len();
            let local = &mut self.local[..height + LANES];
            local[..columns].copy_from_slice(&x[first..first + columns]);
            for (value, &row) in local[columns..].iter_mut().zip(rows) {
                *value = x[row as usize];
            }
            local[height..].fill(0.0);
            for (from, width) in panels(columns) {
                let below = height - from - width;
                let panel = &self.values[place..place + size_of_panel(width, below)];
                place += panel.len();
                let local = &mut local[from..];
                match width {
                    4 => forwards::<L, 4>(panel, local),
                    3 => forwards::<L, 3>(panel, local),
                    2 => forwards::<L, 2>(panel, local),
                    _ => forwards::<L, 1>(panel, local),
                }
            }
            x[first..first + columns].copy_from_slice(&local[..columns]);
            for (&row, value) in rows.iter().zip(&local[columns..]) {
                x[row as usize] = *value;
            }
        }
    }

    #[inline(always)]
    fn backwards_by<L: Lanes>(&mut self) {
        let x = self.memory.as_mut_slice();
        let mut place = self.values.len();
        for node in self.supernodes.iter().rev() {
            let (first, columns) = (node.first as usize, node.columns as usize);
            let rows = &self.rows[node.rows_from as usize..][..node.rows as usize];
            if columns == 1 {
                place -= 1 + rows.len();
                let (pivot, factors) = (self.values[place], &self.values[place + 1..]);
                let below = rows.iter().zip(factors);
                let below: f64 = below.map(|(&row, l)| f64::from(*l) * x[row as usize]).sum();
                x[first] = x[first] * f64::from(pivot) - below;
                continue;
            }
            let height = columns + rows.len();
            let local = &mut self.local[..height + LANES];
            local[..columns].copy_from_slice(&x[first..first + columns]);
            for (value, &row) in local[columns..].iter_mut().zip(rows) {
                *value = x[row as usize];
            }
            local[height..].fill(0.0);
            for (from, width) in panels(columns).rev() {
                let below = height - from - width;
                let end = place;
                place -= size_of_panel(width, below);
                let panel = &self.values[place..end];
                let local = &mut local[from..];
                match width {
                    4 => backwards::<L, 4>(panel, local),
                    3 => backwards::<L, 3>(panel, local),
                    2 => backwards::<L, 2>(panel, local),
                    _ => backwards::<L, 1>(panel, local),
                }
            }
            x[first..first + columns].copy_from_slice(&local[..columns]);
        }
    }
}

/// First column and width of the panels of so many columns.
#[inline(always)]
fn panels(columns: usize) -> impl DoubleEndedIterator<Item = (usize, usize)> {
    (0..columns.div_ceil(WIDTH)).map(move |n| {
        let from = n * WIDTH;
        (from, (columns - from).min(WIDTH))
    })
}

/// Takes what a panel's own unknowns, the first ones, contribute away from those below.
#[inline(always)]
fn forwards<L: Lanes, const W: usize>(panel: &[f32], local: &mut [f64]) {
    let (triangle, below) = panel.split_at(W * WIDTH);
    let (own, local) = local.split_at_mut(W);
    for j in 0..W {
        for i in j + 1..W {
            own[i] -= f64::from(triangle[j * WIDTH + i]) * own[j];
        }
    }
    let own: [L; W] = std::array::from_fn(|j| L::all(own[j]));
    let rows = local.as_chunks_mut::<LANES>().0.iter_mut();
    let factors = below.as_chunks::<LANES>().0.chunks_exact(W);
    for (rows, factors) in rows.zip(factors) {
        let mut sum = L::all(0.0);
        for (own, factors) in own.iter().zip(factors) {
            sum = sum.plus(L::widen(factors), *own);
        }
        L::load(rows).minus(sum).store(rows);
    }
}

/// Divides a panel's own unknowns by the pivots and takes away what those below contribute.
#[inline(always)]
fn backwards<L: Lanes, const W: usize>(panel: &[f32], local: &mut [f64]) {
    let (triangle, below) = panel.split_at(W * WIDTH);
    let (own, local) = local.split_at_mut(W);
    let mut sums = [L::all(0.0); W];
    let rows = local.as_chunks::<LANES>().0.iter();
    let factors = below.as_chunks::<LANES>().0.chunks_exact(W);
    for (rows, factors) in rows.zip(factors) {
        let rows = L::load(rows);
        for (sum, factors) in sums.iter_mut().zip(factors) {
            *sum = sum.plus(L::widen(factors), rows);
        }
    }
    for j in (0..W).rev() {
        let mut value = own[j] * f64::from(triangle[j * WIDTH + j]) - sums[j].sum();
        let row = &triangle[j * WIDTH..j * WIDTH + W];
        for (factor, later) in row.iter().zip(own.iter()).skip(j + 1) {
            value -= f64::from(*factor) * later;
        }
        own[j] = value;
    }
}
