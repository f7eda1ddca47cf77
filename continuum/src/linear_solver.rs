//! Solution of the sparse linear systems of a time step.
//!
//! A system is [[K, B], [C, 0]] with K symmetric positive definite over velocities and −C the
//! divergence; B = Cᵀ + G is not quite its transpose, because the pressure acts on the threshold
//! too. Three methods:
//! - [`Method::Direct`]: LU factors. Best where the fill is small, as in flows that vary along one
//!   axis only.
//! - [`Method::Preconditioned`]: LDLᵀ factors of the symmetric part, made definite by −δ on the
//!   pressures, precondition GMRES on the full system: several times faster in two dimensions. If
//!   GMRES stalls, the system is solved directly.
//! - [`Method::Multigrid`]: a multigrid cycle on the full system preconditions GMRES. Work and memory are
//!   in proportion to the number of unknowns; in space that is cheaper from some thousand
//!   cells on while most of the material flows: at the start of a cylinder's collapse it takes 38, 48 and 75 µs per cell and
//!   Newton iteration on 1050, 2100 and 8400 cells (factors 40, 62, 148). Over the whole of it, at 1050 cells, it takes
//!   twice as long as factors, because rigid matter costs iterations. If GMRES
//!   stalls, the factors take over.
//!
//! The pattern is analysed once. Factors of earlier coefficients may go on preconditioning as long as GMRES
//! comes to its end with them in few directions ([`SparseSystem::keep_or_factorise`]). Halves of large systems are worked on
//! side by side and every sum has one order, so the bits do not depend on the number of threads.

mod dissection;
mod gmres;
mod lanes;
mod ldlt;
mod lu;
mod multigrid;
mod panels;
mod pattern;
mod product;
mod subtrees;
mod supernodal;

use std::time::Instant;

use faer::sparse::SymbolicSparseColMat;

use crate::error::Error;
use crate::threads;
pub use dissection::Place;
use dissection::{Pieces, dissect};
use gmres::{Gmres, Goal};
use ldlt::QuasiDefinite;
use lu::Lu;
use multigrid::Multigrid;
pub use pattern::Blocks;
use product::Product;

/// Relative residual from which on factors in single precision are enough.
pub(crate) const LOOSE: f64 = 1e-6;

/// Factors of earlier coefficients are kept as long as a solution takes no more directions than this.
const KEPT_UNTIL: usize = 30;
/// Directions after which a solution with factors of earlier coefficients goes on with new ones, or as soon as it can be
/// foreseen that it will.
const KEPT_DIRECTIONS: usize = 30;

/// How systems are solved.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Method {
    /// LU factors of the whole matrix.
    Direct,
    /// GMRES with LDLᵀ factors of the symmetric part.
    Preconditioned(Krylov),
    /// GMRES with a multigrid cycle. It needs the places of the unknowns; without them it is
    /// [`Preconditioned`](Self::Preconditioned).
    Multigrid(Krylov),
}

/// What the iterative methods have to know of a system.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Krylov {
    /// Number of unknowns in the positive definite block K, which come first.
    pub definite: usize,
    /// δ, subtracted from the diagonal of the other block where factors precondition.
    pub regularisation: f64,
    /// Least residual at which GMRES is to end, relative to the right-hand side.
    pub tolerance: f64,
    /// How much more the rows of the other block count in the residual than those of K.
    pub weight: f64,
}

/// A square sparse matrix of fixed pattern with its factors.
pub struct SparseSystem {
    pattern: SymbolicSparseColMat<usize>,
    values: Vec<f64>,
    residual: Vec<f64>,
    iterative: Option<Iterative>,
    direct: Option<Lu>,
    state: Factors,
    /// Whether the factors are of earlier coefficients.
    is_kept: bool,
    /// Wall time spent on factors since it was asked for last (s).
    factor_time: f64,
}

/// The iteration and its preconditioners.
struct Iterative {
    gmres: Gmres,
    product: Product,
    multigrid: Option<Multigrid>,
    analysis: Analysis,
}

/// The factors with what they are made from.
struct Analysis {
    /// With multigrid these are made when it stalls.
    factors: Option<QuasiDefinite>,
    krylov: Krylov,
    diagonal: Vec<u32>,
    order: Option<(Vec<usize>, Pieces)>,
}

/// Which factors belong to the present coefficients.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Factors {
    None,
    Multigrid,
    Symmetric,
    Full,
}

impl Analysis {
    /// Analyses the pattern for LDLᵀ factors, once.
    fn of(&mut self, pattern: &SymbolicSparseColMat<usize>) -> Result<&mut QuasiDefinite, Error> {
        match &mut self.factors {
            Some(factors) => Ok(factors),
            empty => Ok(empty.insert(QuasiDefinite::new(
                pattern.as_ref(),
                self.krylov.definite,
                self.krylov.regularisation,
                std::mem::take(&mut self.diagonal),
                self.order.take(),
                self.krylov.tolerance >= LOOSE,
            )?)),
        }
    }
}

impl SparseSystem {
    /// Analyses the pattern of a sum of blocks. The second value has the place of each of their coefficients in
    /// [`values_mut`](Self::values_mut), block after block and row after row. Where the places of the unknowns on a
    /// grid are known they make the analysis cheaper.
    ///
    /// # Errors
    /// [`Error::LinearSolver`] if the pattern cannot be analysed.
    pub fn new<const D: usize>(
        size: usize,
        blocks: Blocks,
        method: Method,
        places: Option<&[Place<D>]>,
    ) -> Result<(Self, Vec<u32>), Error> {
        let mut blocks = blocks;
        let given = blocks.coefficients();
        // The preconditioner needs a diagonal everywhere.
        if method != Method::Direct {
            (0..size).for_each(|i| blocks.push([i], [i]));
        }
        let pays = size >= threads::MANY;
        let ((pattern, mut slots), order) = threads::join(
            pays,
            || blocks.pattern(size),
            || match method {
                Method::Direct => None,
                Method::Preconditioned(krylov) | Method::Multigrid(krylov) => {
                    places.map(|places| dissect(places, krylov.definite))
                }
            },
        );
        drop(blocks);
        let diagonal_slots = slots.split_off(given);
        let coefficients = pattern.row_idx().len();
        let mut system = Self {
            pattern,
            values: vec![0.0; coefficients],
            residual: vec![0.0; size],
            iterative: None,
            direct: None,
            state: Factors::None,
            is_kept: false,
            factor_time: 0.0,
        };
        let (krylov, with_multigrid) = match method {
            Method::Direct => {
                system.direct = Some(Lu::new(system.pattern.as_ref())?);
                return Ok((system, slots));
            }
            Method::Preconditioned(krylov) => (krylov, None),
            Method::Multigrid(krylov) => (krylov, places),
        };
        let multigrid = match with_multigrid {
            None => None,
            Some(places) => Some(Multigrid::new(
                system.pattern.as_ref(),
                krylov.definite,
                krylov.regularisation,
                places,
            )?),
        };
        let mut analysis = Analysis {
            factors: None,
            krylov,
            diagonal: diagonal_slots,
            order,
        };
        let with_factors = multigrid.is_none();
        let (product, analysed) = threads::join(
            pays,
            || Product::new(&system.pattern, krylov.definite),
            || match with_factors {
                true => analysis.of(&system.pattern).map(|_| ()),
                false => Ok(()),
            },
        );
        analysed?;
        let iterative = Iterative {
            gmres: Gmres::new(size),
            product,
            multigrid,
            analysis,
        };
        system.iterative = Some(iterative);
        Ok((system, slots))
    }

    /// The coefficients, to be filled before [`factorise`](Self::factorise).
    pub fn values_mut(&mut self) -> &mut [f64] {
        if self.state == Factors::Symmetric {
            self.is_kept = true;
        } else {
            self.state = Factors::None;
        }
        &mut self.values
    }

    /// Leaves the factors of the coefficients before in use if they precondition well, and makes new ones
    /// otherwise.
    ///
    /// # Errors
    /// As [`factorise`](Self::factorise).
    pub fn keep_or_factorise(&mut self) -> Result<(), Error> {
        let serve = self.state == Factors::Symmetric
            && self
                .iterative
                .as_ref()
                .is_some_and(|iterative| iterative.gmres.iterations() <= KEPT_UNTIL);
        if serve { Ok(()) } else { self.factorise() }
    }

    /// Makes the numerical factors of the present coefficients.
    ///
    /// # Errors
    /// [`Error::Singular`] if the matrix is singular, [`Error::LinearSolver`] if memory runs out.
    pub fn factorise(&mut self) -> Result<(), Error> {
        if let Some(iterative) = &mut self.iterative
            && let Some(multigrid) = &mut iterative.multigrid
            && multigrid.set_up(&self.values).is_ok()
        {
            self.state = Factors::Multigrid;
            return Ok(());
        }
        self.factorise_symmetric_part()
    }

    /// The factors that precondition, or those of the whole matrix if there are none.
    fn factorise_symmetric_part(&mut self) -> Result<(), Error> {
        self.is_kept = false;
        let clock = Instant::now();
        if let Some(iterative) = &mut self.iterative
            && let Ok(factors) = iterative.analysis.of(&self.pattern)
            && factors
                .factorise(self.pattern.as_ref(), &self.values)
                .is_ok()
        {
            self.state = Factors::Symmetric;
            self.factor_time += clock.elapsed().as_secs_f64();
            return Ok(());
        }
        self.factor_time += clock.elapsed().as_secs_f64();
        self.factorise_directly()
    }

    fn factorise_directly(&mut self) -> Result<(), Error> {
        let clock = Instant::now();
        let lu = match &mut self.direct {
            Some(lu) => lu,
            empty => empty.insert(Lu::new(self.pattern.as_ref())?),
        };
        lu.factorise(self.pattern.as_ref(), &self.values)?;
        self.state = Factors::Full;
        self.factor_time += clock.elapsed().as_secs_f64();
        Ok(())
    }

    /// Wall time spent on factors since the last call (s).
    pub fn take_factor_time(&mut self) -> f64 {
        std::mem::take(&mut self.factor_time)
    }

    /// GMRES with the present preconditioner; says whether it came to its end.
    fn iterate(&mut self, right_hand_side: &[f64], solution: &mut [f64], goal: Goal) -> bool {
        let Some(iterative) = &mut self.iterative else {
            return false;
        };
        let product = &mut iterative.product;
        let multiply = |x: &[f64], y: &mut [f64]| product.multiply(x, y);
        let gmres = &mut iterative.gmres;
        let factors = &mut iterative.analysis.factors;
        match (self.state, &mut iterative.multigrid, factors) {
            (Factors::Multigrid, Some(multigrid), _) => {
                let precondition = |x: &mut [f64]| multigrid.solve(x);
                gmres.solve(multiply, precondition, right_hand_side, solution, goal)
            }
            (Factors::Symmetric, _, Some(factors)) => {
                let precondition = |x: &mut [f64]| factors.solve(x);
                gmres.solve(multiply, precondition, right_hand_side, solution, goal)
            }
            _ => false,
        }
    }

    /// Solves for one right-hand side, to a relative residual `tolerance` where it is solved iteratively.
    ///
    /// # Errors
    /// [`Error::LinearSolver`] if there are no factors, [`Error::Singular`] if the solution is not finite.
    pub fn solve(
        &mut self,
        right_hand_side: &[f64],
        solution: &mut [f64],
        tolerance: f64,
    ) -> Result<(), Error> {
        let mut goal = Goal::full(tolerance);
        if let Some(iterative) = &mut self.iterative {
            goal.weighted_from = iterative.analysis.krylov.definite;
            goal.weight = iterative.analysis.krylov.weight;
            iterative.product.load(&self.values);
        }
        if self.state == Factors::Multigrid {
            if self.iterate(right_hand_side, solution, goal) {
                return Ok(());
            }
            self.factorise_symmetric_part()?;
        }
        if self.state == Factors::Symmetric && self.is_kept {
            let short = Goal {
                directions: KEPT_DIRECTIONS,
                foresees: true,
                ..goal
            };
            if self.iterate(right_hand_side, solution, short) {
                return Ok(());
            }
            goal.goes_on = solution.iter().all(|x| x.is_finite());
            self.factorise_symmetric_part()?;
        }
        if self.state == Factors::Symmetric {
            if self.iterate(right_hand_side, solution, goal) {
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
            Err(Error::Singular("its solution is not finite".to_owned()))
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

#[cfg(test)]
mod tests {
    use super::*;

    /// [[2, 1, 1], [1, 3, g], [1, 0, 0]], with an entry given twice.
    fn saddle(method: Method, g: f64) -> SparseSystem {
        let mut blocks = Blocks::default();
        blocks.push([0, 1], [0, 1]);
        blocks.push([0], [2]);
        blocks.push([2], [0]);
        blocks.push([1], [1, 2]);
        let coefficients = [2.0, 1.0, 1.0, 1.0, 1.0, 1.0, 2.0, g];
        // Two faces of a cell.
        let places: [Place; 3] = [[0, 1], [2, 1], [1, 1]];
        let (mut system, slots) = SparseSystem::new(3, blocks, method, Some(&places)).unwrap();
        for (slot, c) in slots.iter().zip(coefficients) {
            system.values_mut()[*slot as usize] += c;
        }
        system
    }

    const KRYLOV: Krylov = Krylov {
        definite: 2,
        regularisation: 1e-6,
        tolerance: 1e-10,
        weight: 1.0,
    };
    const METHODS: [(Method, f64); 3] = [
        (Method::Direct, 1e-14),
        (Method::Preconditioned(KRYLOV), 1e-9),
        (Method::Multigrid(KRYLOV), 1e-9),
    ];

    #[test]
    fn all_methods_solve_a_saddle_point_system() {
        for (method, tolerance) in METHODS {
            for g in [0.0, 0.3] {
                let mut system = saddle(method, g);
                system.factorise().unwrap();
                let mut x = [0.0; 3];
                system
                    .solve(&[5.0, 4.0 + 2.0 * g, 1.0], &mut x, 1e-10)
                    .unwrap();
                for (value, expected) in x.iter().zip([1.0, 1.0, 2.0]) {
                    assert!((value - expected).abs() < tolerance, "{value} {expected}");
                }
            }
        }
    }

    /// Multigrid stalls, the factors of the symmetric part do, and those of the whole matrix say why.
    #[test]
    fn singular_matrix_is_an_error() {
        for (method, _) in METHODS {
            let mut system = saddle(method, 0.0);
            system.values_mut().fill(0.0);
            let mut x = [0.0; 3];
            let outcome = system.factorise();
            let solved = outcome.and_then(|()| system.solve(&[1.0, 2.0, 3.0], &mut x, 1e-10));
            assert!(matches!(solved, Err(Error::Singular(_))), "{solved:?}");
        }
    }

    #[test]
    fn solving_without_factors_is_an_error() {
        let mut x = [0.0; 3];
        assert!(
            saddle(Method::Direct, 0.0)
                .solve(&[1.0; 3], &mut x, 1e-10)
                .is_err()
        );
    }
}
