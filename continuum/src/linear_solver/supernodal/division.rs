//! Division of a supernode that has taken what earlier ones contribute, in blocks of columns.

use faer::dyn_stack::{MemBuffer, MemStack};
use faer::linalg::cholesky::ldlt::factor::{
    LdltRegularization, cholesky_in_place, cholesky_in_place_scratch,
};
use faer::linalg::matmul::matmul;
use faer::linalg::triangular_solve::solve_unit_lower_triangular_in_place;
use faer::prelude::{Reborrow, ReborrowMut};
use faer::{Accum, MatMut, MatRef, Par};

use super::{BLOCK, SMALLEST_PIVOT, WORTH_SHARING};
use crate::error::Error;
use crate::threads;

/// Memory of the work on a block of columns.
pub(super) struct Strand {
    pub product: Vec<f64>,
    pub scaled: Vec<f64>,
    scratch: MemBuffer,
}

impl Strand {
    /// Memory for products and scaled columns of these lengths.
    pub fn new(product: usize, scaled: usize) -> Self {
        Self {
            product: vec![0.0; product],
            scaled: vec![0.0; scaled],
            scratch: MemBuffer::new(cholesky_in_place_scratch::<f64>(
                BLOCK,
                Par::Seq,
                Default::default(),
            )),
        }
    }
}

/// The factors of a supernode that has taken what earlier ones contribute: D on the diagonal, L below.
pub(super) fn divide(
    own: &mut [f64],
    height: usize,
    signs: &[i8],
    strands: &mut [Strand; 2],
) -> Result<(), Error> {
    let width = signs.len();
    if width == 1 {
        let sign = f64::from(signs[0]);
        if !own[0].is_finite() {
            return Err(Error::Singular("a pivot is not finite".into()));
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
    .map_err(|e| Error::Singular(format!("{e:?}")))?;
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
pub(super) fn shared(blocks: usize) -> usize {
    (blocks * 3 / 10).max(1)
}
