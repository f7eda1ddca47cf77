//! LDLᵀ factors of the symmetric quasi-definite part [[K, Cᵀ], [C, −δ]], without pivoting:
//! quasi-definite matrices have such factors in any order (Vanderbei, *SIAM J. Optim.* 5 (1995) 100).
//! The order is nested dissection where places on a grid are known and minimum degree elsewhere.
//!
//! Factors are computed in double precision. Where the iteration may be loose they are kept rounded to single:
//! substitution, which takes most of its time, is bound by the memory it reads. Rounding errs by 6e-8/δ of
//! the pressure terms, far below what a loose iteration has to mend anyway as long as δ ≥ 1e-6; with viscosities
//! that differ by 1e8 a tight one would not come to its end.

use faer::dyn_stack::{MemBuffer, MemStack};
use faer::linalg::cholesky::ldlt::factor::LdltRegularization;
use faer::perm::PermRef;
use faer::sparse::linalg::SupernodalThreshold;
use faer::sparse::linalg::cholesky::{
    CholeskySymbolicParams, LdltRef, SymbolicCholesky, SymbolicCholeskyRaw, SymmetricOrdering,
    factorize_symbolic_cholesky,
};
use faer::sparse::{SparseColMatRef, SymbolicSparseColMatRef};
use faer::{Conj, MatMut, Par, Side};

use super::substitution::substitute;
use crate::error::Error;

/// LDLᵀ factors of the lower triangle of a matrix of fixed pattern, with −δ on the diagonal of the
/// second block.
pub(super) struct QuasiDefinite {
    symbolic: SymbolicCholesky<usize>,
    factors: Vec<f64>,
    /// The factors in single precision, where they are used so.
    rounded: Option<Vec<f32>>,
    values: Vec<f64>,
    diagonal: Vec<u32>,
    signs: Vec<i8>,
    definite: usize,
    regularisation: f64,
    scratch: MemBuffer,
    /// A right-hand side in the order of the factors.
    ordered: Vec<f64>,
    work: Vec<f64>,
}

/// Supernodes are merged up to so many columns while zeros are less than this part of them. Substitution reads zeros,
/// too: with faer's own choice factors of plane flows are a tenth larger.
const MERGED: [(usize, f64); 3] = [(4, 0.5), (16, 0.2), (48, 0.05)];

/// Pivots smaller than this, or of the wrong sign by round-off, are replaced by it.
const SMALLEST_PIVOT: f64 = 1e-14;

impl QuasiDefinite {
    pub(super) fn new(
        pattern: SymbolicSparseColMatRef<'_, usize>,
        definite: usize,
        regularisation: f64,
        diagonal: Vec<u32>,
        order: Option<Vec<usize>>,
        loose: bool,
    ) -> Result<Self, Error> {
        let order = order.map(|forward| {
            let mut back = vec![0; forward.len()];
            for (place, &unknown) in forward.iter().enumerate() {
                back[unknown] = place;
            }
            (forward, back)
        });
        let ordering = match &order {
            Some((forward, back)) => {
                SymmetricOrdering::Custom(PermRef::new_checked(forward, back, forward.len()))
            }
            None => SymmetricOrdering::Amd,
        };
        let mut parameters = CholeskySymbolicParams::default();
        if loose {
            // Small fill must not lead to factors entry by entry, which take twice the time of a step.
            parameters.supernodal_flop_ratio_threshold = SupernodalThreshold::FORCE_SUPERNODAL;
            parameters.supernodal_params.relax = Some(&MERGED);
        }
        let symbolic = factorize_symbolic_cholesky(pattern, Side::Lower, ordering, parameters)
            .map_err(|e| Error::LinearSolver(format!("{e:?}")))?;
        let need = symbolic
            .factorize_numeric_ldlt_scratch::<f64>(Par::Seq, Default::default())
            .or(symbolic.solve_in_place_scratch::<f64>(1, Par::Seq));
        let scratch = MemBuffer::try_new(need)
            .map_err(|_| Error::LinearSolver("out of memory".to_owned()))?;
        Ok(Self {
            factors: vec![0.0; symbolic.len_val()],
            rounded: loose.then(Vec::new),
            symbolic,
            values: vec![0.0; pattern.row_idx().len()],
            signs: (0..diagonal.len())
                .map(|i| if i < definite { 1 } else { -1 })
                .collect(),
            diagonal,
            definite,
            regularisation,
            scratch,
            ordered: vec![0.0; pattern.nrows()],
            work: Vec::new(),
        })
    }

    pub(super) fn factorise(
        &mut self,
        pattern: SymbolicSparseColMatRef<'_, usize>,
        values: &[f64],
    ) -> Result<(), Error> {
        self.values.copy_from_slice(values);
        for &slot in &self.diagonal[self.definite..] {
            self.values[slot as usize] -= self.regularisation;
        }
        self.symbolic
            .factorize_numeric_ldlt(
                &mut self.factors,
                SparseColMatRef::new(pattern, &self.values),
                Side::Lower,
                LdltRegularization {
                    dynamic_regularization_signs: Some(&self.signs),
                    dynamic_regularization_delta: SMALLEST_PIVOT,
                    dynamic_regularization_epsilon: SMALLEST_PIVOT,
                },
                Par::Seq,
                MemStack::new(&mut self.scratch),
                Default::default(),
            )
            .map_err(|e| Error::LinearSolver(format!("{e:?}")))?;
        if let Some(rounded) = &mut self.rounded {
            rounded.clear();
            rounded.extend(self.factors.iter().map(|f| *f as f32));
        }
        Ok(())
    }

    /// Overwrites x with S⁻¹ x; there must be factors.
    pub(super) fn solve(&mut self, x: &mut [f64]) {
        if let (SymbolicCholeskyRaw::Supernodal(supernodes), Some(order), Some(rounded)) =
            (self.symbolic.raw(), self.symbolic.perm(), &self.rounded)
        {
            let (forward, _) = order.arrays();
            for (y, &from) in self.ordered.iter_mut().zip(forward) {
                *y = x[from];
            }
            substitute(supernodes, rounded, &mut self.ordered, &mut self.work);
            for (y, &to) in self.ordered.iter().zip(forward) {
                x[to] = *y;
            }
            return;
        }
        let rows = x.len();
        LdltRef::new(&self.symbolic, &self.factors).solve_in_place_with_conj(
            Conj::No,
            MatMut::from_column_major_slice_mut(x, rows, 1),
            Par::Seq,
            MemStack::new(&mut self.scratch),
        );
    }
}
