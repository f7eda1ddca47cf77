//! Supernodal LDLᵀ factors laid out for substitution, and substitution for one right-hand side.
//!
//! Substitution reads the factors once forwards and once backwards and is bound by what it reads, so they are kept in
//! single precision and in the order in which they are read. The columns of a supernode are taken four at a time, a
//! panel: first its triangle with the pivots, then the rows below it, eight rows of one column, eight of the next.
//! What a panel changes is read and written once for its columns, not once for each. Sums run in one order.

use faer::sparse::linalg::cholesky::supernodal::SymbolicSupernodalCholesky;

#[cfg(target_arch = "x86_64")]
use super::lanes::Wide;
use super::lanes::{LANES, Lanes, Plain};

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

/// The factors as substitution reads them.
#[derive(Debug)]
pub(super) struct Panels {
    supernodes: Vec<Supernode>,
    rows: Vec<u32>,
    values: Vec<f32>,
    /// Unknowns of the present supernode and those below it.
    local: Vec<f64>,
}

/// Numbers of a panel of so many columns with so many rows below it.
const fn size_of_panel(width: usize, below: usize) -> usize {
    width * (WIDTH + below.next_multiple_of(LANES))
}

impl Panels {
    /// Room for the factors of a pattern.
    pub(super) fn new(symbolic: &SymbolicSupernodalCholesky<usize>) -> Self {
        let (begins, ends) = (symbolic.supernode_begin(), symbolic.supernode_end());
        let mut supernodes = Vec::with_capacity(begins.len());
        let mut all_rows = Vec::new();
        let (mut numbers, mut longest) = (0, 0);
        for (s, (&begin, &end)) in begins.iter().zip(ends).enumerate() {
            let pattern = symbolic.supernode(s).pattern();
            let columns = end - begin;
            supernodes.push(Supernode {
                first: begin as u32,
                columns: columns as u32,
                rows_from: all_rows.len() as u32,
                rows: pattern.len() as u32,
            });
            all_rows.extend(pattern.iter().map(|&row| row as u32));
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
        Self {
            supernodes,
            rows: all_rows,
            values: vec![0.0; numbers],
            local: vec![0.0; longest + LANES],
        }
    }

    /// Takes the factors over from columns; D stands on the diagonal of L.
    pub(super) fn load(&mut self, symbolic: &SymbolicSupernodalCholesky<usize>, factors: &[f64]) {
        let places = symbolic.col_ptr_for_val();
        let mut values = self.values.as_mut_slice();
        for (node, &place) in self.supernodes.iter().zip(places) {
            let columns = node.columns as usize;
            let height = columns + node.rows as usize;
            let block = &factors[place..place + columns * height];
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

    /// Overwrites x with (L D Lᵀ)⁻¹ x, in the order of the factors. The bits are the same on every processor.
    pub(super) fn substitute(&mut self, x: &mut [f64]) {
        #[cfg(target_arch = "x86_64")]
        {
            if std::arch::is_x86_feature_detected!("avx512f")
                && std::arch::is_x86_feature_detected!("avx512vl")
            {
                // SAFETY: the processor has been asked for AVX-512 F and VL.
                return unsafe { self.substitute_avx512(x) };
            }
            if std::arch::is_x86_feature_detected!("avx2") {
                // SAFETY: the processor has been asked for AVX2.
                return unsafe { self.substitute_avx2(x) };
            }
        }
        self.substitute_by::<Plain>(x);
    }

    /// The substitution compiled for AVX2.
    ///
    /// # Safety
    /// The processor must have AVX2.
    #[cfg(target_arch = "x86_64")]
    #[target_feature(enable = "avx2")]
    unsafe fn substitute_avx2(&mut self, x: &mut [f64]) {
        self.substitute_by::<Plain>(x);
    }

    /// The substitution compiled for AVX-512.
    ///
    /// # Safety
    /// The processor must have AVX-512 (F, VL).
    #[cfg(target_arch = "x86_64")]
    #[target_feature(enable = "avx2,avx512f,avx512vl")]
    unsafe fn substitute_avx512(&mut self, x: &mut [f64]) {
        self.substitute_by::<Wide>(x);
    }

    #[inline(always)]
    pub(super) fn substitute_by<L: Lanes>(&mut self, x: &mut [f64]) {
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
            local[columns..].fill(0.0);
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
            for (&row, change) in rows.iter().zip(&local[columns..]) {
                x[row as usize] += change;
            }
        }
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
