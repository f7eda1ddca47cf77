//! Sparse direct solution of the linear systems of a time step.
//!
//! The pattern is analysed once and the numerical factors are made anew for every Newton
//! iteration, always on one thread and in one order, so results have the same bits on any machine
//! load and thread count.

use faer::dyn_stack::{MemBuffer, MemStack};
use faer::sparse::linalg::lu::{NumericLu, SymbolicLu, factorize_symbolic_lu};
use faer::sparse::{SparseColMatRef, SymbolicSparseColMat};
use faer::{Conj, MatMut, Par};

use crate::error::Error;

/// A square sparse matrix of fixed pattern with its LU factors.
pub struct SparseSystem {
    pattern: SymbolicSparseColMat<usize>,
    values: Vec<f64>,
    symbolic: SymbolicLu<usize>,
    numeric: NumericLu<usize, f64>,
    scratch: MemBuffer,
    residual: Vec<f64>,
    is_factorised: bool,
}

impl SparseSystem {
    /// Analyses the pattern given by (row, column) pairs, which may repeat. The second value maps
    /// each pair to the place of its coefficient in [`values_mut`](Self::values_mut).
    ///
    /// # Errors
    /// [`Error::LinearSolver`] if the pattern cannot be analysed.
    pub fn new(size: usize, entries: &[(usize, usize)]) -> Result<(Self, Vec<usize>), Error> {
        let mut order: Vec<usize> = (0..entries.len()).collect();
        order.sort_unstable_by_key(|&e| (entries[e].1, entries[e].0, e));
        let mut slots = vec![0; entries.len()];
        let mut column_starts = vec![0; size + 1];
        let mut rows: Vec<usize> = Vec::new();
        let mut last = None;
        for e in order {
            let (row, column) = entries[e];
            if last != Some((row, column)) {
                rows.push(row);
                column_starts[column + 1] = rows.len();
                last = Some((row, column));
            }
            slots[e] = rows.len() - 1;
        }
        for column in 0..size {
            column_starts[column + 1] = column_starts[column + 1].max(column_starts[column]);
        }
        let coefficients = rows.len();
        let pattern = SymbolicSparseColMat::new_checked(size, size, column_starts, None, rows);
        let symbolic = factorize_symbolic_lu(pattern.as_ref(), Default::default())
            .map_err(|e| Error::LinearSolver(format!("{e:?}")))?;
        let need = symbolic
            .factorize_numeric_lu_scratch::<f64>(Par::Seq, Default::default())
            .or(symbolic.solve_in_place_scratch::<f64>(1, Par::Seq));
        let scratch = MemBuffer::try_new(need)
            .map_err(|_| Error::LinearSolver("out of memory".to_owned()))?;
        let system = Self {
            pattern,
            values: vec![0.0; coefficients],
            symbolic,
            numeric: NumericLu::new(),
            scratch,
            residual: vec![0.0; size],
            is_factorised: false,
        };
        Ok((system, slots))
    }

    /// The coefficients, to be filled before [`factorise`](Self::factorise).
    pub fn values_mut(&mut self) -> &mut [f64] {
        self.is_factorised = false;
        &mut self.values
    }

    /// Makes the numerical factors of the present coefficients.
    ///
    /// # Errors
    /// [`Error::LinearSolver`] if the matrix is singular or memory runs out.
    pub fn factorise(&mut self) -> Result<(), Error> {
        let matrix = SparseColMatRef::new(self.pattern.as_ref(), &self.values);
        self.symbolic
            .factorize_numeric_lu(
                &mut self.numeric,
                matrix,
                Par::Seq,
                MemStack::new(&mut self.scratch),
                Default::default(),
            )
            .map_err(|e| Error::LinearSolver(format!("{e:?}")))?;
        self.is_factorised = true;
        Ok(())
    }

    /// Solves for one right-hand side, with one round of iterative refinement: the systems mix
    /// viscosities that differ by a factor 1/ε, and refinement restores the digits that costs.
    ///
    /// # Errors
    /// [`Error::LinearSolver`] if there are no factors or the solution is not finite.
    pub fn solve(&mut self, right_hand_side: &[f64], solution: &mut [f64]) -> Result<(), Error> {
        if !self.is_factorised {
            return Err(Error::LinearSolver("no factors".to_owned()));
        }
        solution.copy_from_slice(right_hand_side);
        self.substitute(solution);
        let mut residual = std::mem::take(&mut self.residual);
        residual.copy_from_slice(right_hand_side);
        let (starts, rows) = (self.pattern.col_ptr(), self.pattern.row_idx());
        for (column, x) in solution.iter().enumerate() {
            for slot in starts[column]..starts[column + 1] {
                residual[rows[slot]] -= self.values[slot] * x;
            }
        }
        self.substitute(&mut residual);
        for (x, correction) in solution.iter_mut().zip(&residual) {
            *x += correction;
        }
        self.residual = residual;
        if solution.iter().all(|x| x.is_finite()) {
            Ok(())
        } else {
            Err(Error::LinearSolver("singular matrix".to_owned()))
        }
    }

    fn substitute(&mut self, x: &mut [f64]) {
        let rows = x.len();
        faer::sparse::linalg::lu::LuRef::new_unchecked(&self.symbolic, &self.numeric)
            .solve_in_place_with_conj(
                Conj::No,
                MatMut::from_column_major_slice_mut(x, rows, 1),
                Par::Seq,
                MemStack::new(&mut self.scratch),
            );
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn saddle_point_system_with_a_zero_diagonal_is_solved() {
        // [[2, 1, 1], [1, 3, 0], [1, 0, 0]] x = (5, 4, 1), with an entry given twice.
        let entries = [(0, 0), (0, 1), (0, 2), (1, 0), (1, 1), (2, 0), (1, 1)];
        let coefficients = [2.0, 1.0, 1.0, 1.0, 1.0, 1.0, 2.0];
        let (mut system, slots) = SparseSystem::new(3, &entries).unwrap();
        for (slot, c) in slots.iter().zip(coefficients) {
            system.values_mut()[*slot] += c;
        }
        system.factorise().unwrap();
        let mut x = [0.0; 3];
        system.solve(&[5.0, 4.0, 1.0], &mut x).unwrap();
        for (value, expected) in x.iter().zip([1.0, 1.0, 2.0]) {
            assert!((value - expected).abs() < 1e-14);
        }
    }

    #[test]
    fn singular_matrix_is_an_error() {
        let (mut system, slots) = SparseSystem::new(2, &[(0, 0), (0, 1), (1, 0), (1, 1)]).unwrap();
        for slot in slots {
            system.values_mut()[slot] = 1.0;
        }
        let mut x = [0.0; 2];
        assert!(system.factorise().is_err() || system.solve(&[1.0, 2.0], &mut x).is_err());
    }
}
