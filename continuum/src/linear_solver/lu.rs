//! LU factors with partial pivoting and reused symbolic analysis.

use faer::dyn_stack::{MemBuffer, MemStack};
use faer::sparse::linalg::LuError;
use faer::sparse::linalg::lu::{LuRef, NumericLu, SymbolicLu, factorize_symbolic_lu};
use faer::sparse::{SparseColMatRef, SymbolicSparseColMatRef};
use faer::{Conj, MatMut, Par};

use crate::error::Error;

/// LU factors of a matrix of fixed pattern.
pub(super) struct Lu {
    symbolic: SymbolicLu<usize>,
    numeric: NumericLu<usize, f64>,
    scratch: MemBuffer,
}

impl Lu {
    pub(super) fn new(pattern: SymbolicSparseColMatRef<'_, usize>) -> Result<Self, Error> {
        let symbolic = factorize_symbolic_lu(pattern, Default::default())
            .map_err(|e| Error::LinearSolver(format!("{e:?}")))?;
        let need = symbolic
            .factorize_numeric_lu_scratch::<f64>(Par::Seq, Default::default())
            .or(symbolic.solve_in_place_scratch::<f64>(1, Par::Seq));
        let scratch = MemBuffer::try_new(need)
            .map_err(|_| Error::LinearSolver("out of memory".to_owned()))?;
        Ok(Self {
            symbolic,
            numeric: NumericLu::new(),
            scratch,
        })
    }

    pub(super) fn factorise(
        &mut self,
        pattern: SymbolicSparseColMatRef<'_, usize>,
        values: &[f64],
    ) -> Result<(), Error> {
        self.symbolic
            .factorize_numeric_lu(
                &mut self.numeric,
                SparseColMatRef::new(pattern, values),
                Par::Seq,
                MemStack::new(&mut self.scratch),
                Default::default(),
            )
            .map(|_| ())
            .map_err(|e| match e {
                LuError::SymbolicSingular { .. } => Error::Singular(format!("{e:?}")),
                LuError::Generic(e) => Error::LinearSolver(format!("{e:?}")),
            })
    }

    /// Overwrites x with A⁻¹ x; there must be factors.
    pub(super) fn solve(&mut self, x: &mut [f64]) {
        let rows = x.len();
        LuRef::new_unchecked(&self.symbolic, &self.numeric).solve_in_place_with_conj(
            Conj::No,
            MatMut::from_column_major_slice_mut(x, rows, 1),
            Par::Seq,
            MemStack::new(&mut self.scratch),
        );
    }
}
