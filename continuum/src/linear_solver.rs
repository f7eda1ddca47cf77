//! Solution of the sparse linear systems of a time step.
//!
//! A system is [[K, B], [C, 0]] with K symmetric positive definite over velocities and −C the
//! divergence; B = Cᵀ + G is not quite its transpose, because the pressure acts on the threshold
//! too. Two methods:
//! - [`Method::Direct`]: LU factors. Best where the fill is small, as in flows that vary along one
//!   axis only.
//! - [`Method::Preconditioned`]: LDLᵀ factors of the symmetric part, made definite by −δ on the
//!   pressures, precondition GMRES on the full system: several times faster in two dimensions. If
//!   GMRES stalls, the system is solved directly.
//!
//! The pattern is analysed once, numerical factors are made anew for every Newton iteration, always
//! on one thread and in one order, so the bits do not depend on the number of threads.

mod dissection;
mod gmres;
mod ldlt;
mod lu;
mod substitution;

use faer::sparse::SymbolicSparseColMat;

use crate::error::Error;
pub use dissection::Place;
use dissection::dissect;
use gmres::Gmres;
use ldlt::QuasiDefinite;
use lu::Lu;

/// Relative residual from which on factors in single precision are enough.
pub(crate) const LOOSE: f64 = 1e-6;

/// How systems are solved.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Method {
    /// LU factors of the whole matrix.
    Direct,
    /// GMRES with LDLᵀ factors of the symmetric part.
    Preconditioned {
        /// Number of unknowns in the positive definite block K, which come first.
        definite: usize,
        /// δ, subtracted from the diagonal of the other block in the preconditioner.
        regularisation: f64,
        /// Residual at which GMRES ends, relative to the right-hand side.
        tolerance: f64,
    },
}

/// Row and column of a coefficient.
pub type Pair = [u32; 2];

/// A square sparse matrix of fixed pattern with its factors.
pub struct SparseSystem {
    pattern: SymbolicSparseColMat<usize>,
    values: Vec<f64>,
    residual: Vec<f64>,
    iterative: Option<(QuasiDefinite, Gmres)>,
    direct: Option<Lu>,
    state: Factors,
}

/// Which factors belong to the present coefficients.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Factors {
    None,
    Symmetric,
    Full,
}

impl SparseSystem {
    /// Analyses the pattern given by (row, column) pairs, which may repeat. The second value maps
    /// each pair to the place of its coefficient in [`values_mut`](Self::values_mut). Where the places of
    /// the unknowns on a grid are known they make the analysis cheaper.
    ///
    /// # Errors
    /// [`Error::LinearSolver`] if the pattern cannot be analysed.
    pub fn new<const D: usize>(
        size: usize,
        entries: Vec<Pair>,
        method: Method,
        places: Option<&[Place<D>]>,
    ) -> Result<(Self, Vec<u32>), Error> {
        let mut pairs = entries;
        let given = pairs.len();
        // The preconditioner needs a diagonal everywhere.
        if method != Method::Direct {
            pairs.extend((0..size as u32).map(|i| [i, i]));
        }
        let (pattern, mut slots) = pattern_of(size, &pairs);
        let diagonal_slots = slots.split_off(given);
        let coefficients = pattern.row_idx().len();
        let mut system = Self {
            pattern,
            values: vec![0.0; coefficients],
            residual: vec![0.0; size],
            iterative: None,
            direct: None,
            state: Factors::None,
        };
        match method {
            Method::Direct => system.direct = Some(Lu::new(system.pattern.as_ref())?),
            Method::Preconditioned {
                definite,
                regularisation,
                tolerance,
            } => {
                let preconditioner = QuasiDefinite::new(
                    system.pattern.as_ref(),
                    definite,
                    regularisation,
                    diagonal_slots,
                    places.map(|places| dissect(places, definite)),
                    tolerance >= LOOSE,
                )?;
                system.iterative = Some((preconditioner, Gmres::new(size, tolerance)));
            }
        }
        Ok((system, slots))
    }

    /// The coefficients, to be filled before [`factorise`](Self::factorise).
    pub fn values_mut(&mut self) -> &mut [f64] {
        self.state = Factors::None;
        &mut self.values
    }

    /// Makes the numerical factors of the present coefficients.
    ///
    /// # Errors
    /// [`Error::LinearSolver`] if the matrix is singular or memory runs out.
    pub fn factorise(&mut self) -> Result<(), Error> {
        if let Some((preconditioner, _)) = &mut self.iterative
            && preconditioner
                .factorise(self.pattern.as_ref(), &self.values)
                .is_ok()
        {
            self.state = Factors::Symmetric;
            return Ok(());
        }
        self.factorise_directly()
    }

    fn factorise_directly(&mut self) -> Result<(), Error> {
        let lu = match &mut self.direct {
            Some(lu) => lu,
            empty => empty.insert(Lu::new(self.pattern.as_ref())?),
        };
        lu.factorise(self.pattern.as_ref(), &self.values)?;
        self.state = Factors::Full;
        Ok(())
    }

    /// Solves for one right-hand side.
    ///
    /// # Errors
    /// [`Error::LinearSolver`] if there are no factors or the solution is not finite.
    pub fn solve(&mut self, right_hand_side: &[f64], solution: &mut [f64]) -> Result<(), Error> {
        if self.state == Factors::Symmetric {
            let pattern = &self.pattern;
            let values = &self.values;
            let multiply = |x: &[f64], y: &mut [f64]| multiply(pattern, values, x, y);
            if let Some((preconditioner, gmres)) = &mut self.iterative
                && gmres.solve(
                    multiply,
                    |x: &mut [f64]| preconditioner.solve(x),
                    right_hand_side,
                    solution,
                )
            {
                return Ok(());
            }
            self.factorise_directly()?;
        }
        let Some(lu) = self.direct.as_mut().filter(|_| self.state == Factors::Full) else {
            return Err(Error::LinearSolver("no factors".to_owned()));
        };
        solution.copy_from_slice(right_hand_side);
        lu.solve(solution);
        // One round of refinement: the systems mix viscosities that differ by a factor 1/ε, and
        // refinement restores the digits that costs.
        multiply(&self.pattern, &self.values, solution, &mut self.residual);
        for (r, b) in self.residual.iter_mut().zip(right_hand_side) {
            *r = b - *r;
        }
        lu.solve(&mut self.residual);
        for (x, correction) in solution.iter_mut().zip(&self.residual) {
            *x += correction;
        }
        if solution.iter().all(|x| x.is_finite()) {
            Ok(())
        } else {
            Err(Error::LinearSolver("singular matrix".to_owned()))
        }
    }
}

/// y = A x.
fn multiply(pattern: &SymbolicSparseColMat<usize>, values: &[f64], x: &[f64], y: &mut [f64]) {
    y.fill(0.0);
    let (starts, rows) = (pattern.col_ptr(), pattern.row_idx());
    for (bounds, x) in starts.windows(2).zip(x) {
        let range = bounds[0]..bounds[1];
        for (&row, value) in rows[range.clone()].iter().zip(&values[range]) {
            y[row] += value * x;
        }
    }
}

/// Compressed columns of the given (row, column) pairs, and the place of each pair among them.
fn pattern_of(size: usize, pairs: &[Pair]) -> (SymbolicSparseColMat<usize>, Vec<u32>) {
    // Rows and numbers of the pairs in the order of their columns, by counting.
    let mut ends = vec![0; size + 1];
    for &[_, column] in pairs {
        ends[column as usize + 1] += 1;
    }
    for column in 0..size {
        ends[column + 1] += ends[column];
    }
    let mut next = ends.clone();
    let mut order = vec![[0_u32; 2]; pairs.len()];
    for (e, &[row, column]) in pairs.iter().enumerate() {
        let next = &mut next[column as usize];
        order[*next] = [row, e as u32];
        *next += 1;
    }
    let mut slots = vec![0_u32; pairs.len()];
    let mut starts = vec![0; size + 1];
    let mut rows: Vec<usize> = Vec::with_capacity(pairs.len() / 4);
    // Where in the present column a row stands; the column it was last met in.
    let mut place = vec![0_u32; size];
    let mut met_in = vec![usize::MAX; size];
    for column in 0..size {
        let first = rows.len();
        let members = &order[ends[column]..ends[column + 1]];
        for &[row, _] in members {
            let row = row as usize;
            if met_in[row] != column {
                met_in[row] = column;
                rows.push(row);
            }
        }
        rows[first..].sort_unstable();
        for (offset, &row) in rows[first..].iter().enumerate() {
            place[row] = (first + offset) as u32;
        }
        for &[row, e] in members {
            slots[e as usize] = place[row as usize];
        }
        starts[column + 1] = rows.len();
    }
    let pattern = SymbolicSparseColMat::new_checked(size, size, starts, None, rows);
    (pattern, slots)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// [[2, 1, 1], [1, 3, g], [1, 0, 0]], with an entry given twice.
    fn saddle(method: Method, g: f64) -> SparseSystem {
        let entries = [
            [0, 0],
            [0, 1],
            [0, 2],
            [1, 0],
            [1, 1],
            [2, 0],
            [1, 1],
            [1, 2],
        ];
        let coefficients = [2.0, 1.0, 1.0, 1.0, 1.0, 1.0, 2.0, g];
        let (mut system, slots) =
            SparseSystem::new(3, entries.to_vec(), method, None::<&[Place]>).unwrap();
        for (slot, c) in slots.iter().zip(coefficients) {
            system.values_mut()[*slot as usize] += c;
        }
        system
    }

    const ITERATIVE: Method = Method::Preconditioned {
        definite: 2,
        regularisation: 1e-6,
        tolerance: 1e-10,
    };

    #[test]
    fn both_methods_solve_a_saddle_point_system() {
        for (method, tolerance) in [(Method::Direct, 1e-14), (ITERATIVE, 1e-9)] {
            for g in [0.0, 0.3] {
                let mut system = saddle(method, g);
                system.factorise().unwrap();
                let mut x = [0.0; 3];
                system.solve(&[5.0, 4.0 + 2.0 * g, 1.0], &mut x).unwrap();
                for (value, expected) in x.iter().zip([1.0, 1.0, 2.0]) {
                    assert!((value - expected).abs() < tolerance, "{value} {expected}");
                }
            }
        }
    }

    #[test]
    fn singular_matrix_is_an_error() {
        for method in [Method::Direct, ITERATIVE] {
            let mut system = saddle(method, 0.0);
            system.values_mut().fill(0.0);
            let mut x = [0.0; 3];
            let outcome = system.factorise();
            assert!(outcome.is_err() || system.solve(&[1.0, 2.0, 3.0], &mut x).is_err());
        }
    }

    #[test]
    fn solving_without_factors_is_an_error() {
        let mut x = [0.0; 3];
        assert!(
            saddle(Method::Direct, 0.0)
                .solve(&[1.0; 3], &mut x)
                .is_err()
        );
    }
}
