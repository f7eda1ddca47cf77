//! Primal–dual Newton method on velocity, pressure and stress together.
//!
//! After Chan, Golub & Mulet (*SIAM J. Sci. Comput.* 20 (1999) 1964): the stress law is written as
//! s √(|γ|² + ε²) = κ γ and linearised with s as an unknown of its own, which keeps Newton's method
//! fast down to very small ε where the law solved for s alone makes it stall. The pressure in the
//! threshold is an unknown of the same Newton step: taking it from the previous step or iterating
//! on it outside costs accuracy or time. ε starts at 0.3 √(g/H) and falls tenfold per iteration.
//!
//! Friction that grows with the pressure can leave p ≥ 0 ⟂ ∇·u ≥ 0 without a solution, as in Painlevé's
//! paradox of the sliding rod: where a film is much thinner than a cell, a pressure brakes what leaves the
//! cell by more than it pushes it, so the cell contracts more the more it is pressed. Newton's method then
//! lets the cell go and seizes it in turn. Such cells are found by that, and the thresholds which depend on
//! their pressure keep the pressure that the step began with: friction is then given, and the step has a
//! solution. [`StepReport::held_points`] counts them.

mod descent;
mod evaluation;
mod linearised;
mod options;
mod part;
mod residuals;

use std::time::Instant;

use serde::Serialize;

use super::coefficients::StepMatrix;
use super::conflict::Conflicts;
use super::{FlowState, Residuals, StepProblem, StepReport, YieldSolver};
use crate::discretisation::{COMPONENTS, Discretisation};
use crate::error::{Error, is_solved};
use crate::rheology::Rheology;
use crate::threads;
use evaluation::Evaluation;
use linearised::LinearisedPoint;
pub use options::{LinearSolver, PrimalDualOptions};
use part::Outcome;

/// Most times that thresholds next to cells in conflict are held and the step is tried again.
const MOST_HELD_ROUNDS: usize = 4;
/// Iterations after which a start from the previous stress at the final ε is given up in favour of
/// a cold start.
const WARM_ITERATIONS: usize = 20;

/// Residual of the first linear system of an attempt in a plane, over [`PrimalDualOptions::linear_tolerance`]: what the law
/// bends by leaves more.
const FIRST_LOOSE: f64 = 10.0;
/// Residual of a linear system, as a part of what the nonlinear ones may be over what they are.
const FORCING: f64 = 0.3;
/// Loosest residual of a linear system over [`PrimalDualOptions::linear_tolerance`].
const LOOSEST: f64 = 50.0;
/// A linear solution that leaves more than this is hardly one.
const WEAKEST: f64 = 0.3;

/// Cells may go to and fro as long as what is left falls below this part of what it was.
const PROGRESS: f64 = 0.5;

/// Most parts that are solved between two iterations of the whole: what is left of one lies beside it.
const MOST_PARTS: usize = 4;

/// How an attempt begins and descends.
struct Strategy {
    first_floor: f64,
    factor: f64,
    max_iterations: usize,
    line_search: bool,
    /// Whether what is left in few places is solved there by itself.
    solves_parts: bool,
}

/// How one iteration of an attempt is made.
struct Iteration {
    is_first: bool,
    floor: f64,
    /// Relative residual of the linear system.
    tolerance: f64,
    /// Whether factors of the iteration before may serve.
    keeps_factors: bool,
    line_search: bool,
}

/// The default solver of time steps. It holds the matrix and the work arrays of one grid.
pub struct PrimalDual<const C: usize = COMPONENTS> {
    options: PrimalDualOptions,
    matrix: StepMatrix,
    trial: FlowState<C>,
    points: Vec<LinearisedPoint<C>>,
    /// Cells without pressure that may dilate.
    released: Vec<bool>,
    /// Cells whose pressure came out negative and was cut at zero.
    cut: Vec<bool>,
    conflicts: Conflicts,
    right_hand_side: Vec<f64>,
    change: Vec<f64>,
    candidate: Vec<f64>,
    candidate_pressure: Vec<f64>,
    /// Residual of the stress law at each point.
    misses: Vec<f64>,
    /// Strain rate and threshold of the trial state at each point,
    evaluations: Vec<Evaluation<C>>,
    /// at this ε; NaN if the state has changed since.
    evaluated_at: f64,
    times: SolverTimes,
}

/// Wall time that went into the costly parts of steps (s); the rest of a step evaluates the law, assembles and updates.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize)]
pub struct SolverTimes {
    /// Numerical factors, whether of the symmetric part or of the whole.
    pub factors: f64,
    /// Krylov iterations, most of it substitution in the factors.
    pub krylov: f64,
    /// Newton's method on parts of the unknowns, with the factors and iterations of these.
    pub parts: f64,
}

impl SolverTimes {
    /// Adds those of other steps.
    pub fn add(&mut self, other: &Self) {
        self.factors += other.factors;
        self.krylov += other.krylov;
        self.parts += other.parts;
    }
}

impl<const C: usize> PrimalDual<C> {
    /// Analyses the grid's matrix and sets the work arrays up.
    ///
    /// # Errors
    /// Options out of range, or a pattern that cannot be analysed.
    pub fn new<const D: usize, const V: usize>(
        discretisation: &Discretisation<D, C, V>,
        options: PrimalDualOptions,
    ) -> Result<Self, Error> {
        options.validate()?;
        let velocities = discretisation.velocities();
        let cells = discretisation.cells();
        let pays = velocities + cells >= threads::MANY;
        let matrix = threads::with_help(pays, || {
            let (tolerance, solver) = (options.linear_tolerance, options.linear_solver);
            StepMatrix::new(discretisation, tolerance, solver)
        })?;
        Ok(Self {
            options,
            matrix,
            trial: FlowState::at_rest(discretisation, vec![0.0; cells]),
            points: vec![LinearisedPoint::default(); discretisation.points().len()],
            released: vec![false; cells],
            cut: vec![false; cells],
            conflicts: Conflicts::new(cells, discretisation.points().len()),
            right_hand_side: vec![0.0; velocities + cells],
            change: vec![0.0; velocities + cells],
            candidate: vec![0.0; velocities],
            candidate_pressure: vec![0.0; cells],
            misses: vec![0.0; discretisation.points().len()],
            evaluations: vec![Evaluation::default(); discretisation.points().len()],
            evaluated_at: f64::NAN,
            times: SolverTimes::default(),
        })
    }

    /// What has been spent since the last call.
    pub fn take_times(&mut self) -> SolverTimes {
        std::mem::take(&mut self.times)
    }

    /// One run of Newton's method on `self.trial`, which starts as a copy of `start`; it ends at the residuals
    /// given, or those that the speed allows.
    fn attempt<R: Rheology, const D: usize, const V: usize>(
        &mut self,
        problem: &StepProblem<'_, R, D, C, V>,
        u_old: &[f64],
        start: &FlowState<C>,
        strategy: &Strategy,
        given: Option<&Residuals>,
        report: &mut StepReport,
    ) -> Result<(), Error> {
        self.trial.clone_from(start);
        self.conflicts.begin();
        self.evaluated_at = f64::NAN;
        self.cut.fill(false);
        let mut floor = strategy.first_floor;
        // The pressure that a stress was found with may not be that which is interpolated now.
        self.evaluate(problem, floor);
        self.bring_stress_to_threshold();
        let pays = self.right_hand_side.len() >= threads::MANY;
        // In space mirrored flows are to stay alike, to which loose systems and choices do not contribute.
        let keeps = D == 2;
        let solves_parts = strategy.solves_parts
            && keeps
            && problem.discretisation.places().is_some()
            && self.conflicts.held() == 0;
        // Floor with which the factors were made. Those of an earlier step would not be there after a restart.
        let mut floor_of_factors = f64::NAN;
        let mut tolerance = self.options.linear_tolerance;
        if keeps {
            tolerance = (FIRST_LOOSE * tolerance).min(WEAKEST);
        }
        // Points whose law was missed when a part could not be solved: there is hope again when they are fewer.
        let mut in_vain = usize::MAX;
        // What was left over what is allowed when the count of changes to and fro began.
        let mut left_when_counting = f64::INFINITY;
        for iteration in 0..strategy.max_iterations {
            report.iterations += 1;
            report.linear_solves += 1;
            let this = Iteration {
                is_first: iteration == 0,
                floor,
                tolerance,
                keeps_factors: keeps && floor == floor_of_factors,
                line_search: strategy.line_search,
            };
            floor_of_factors = floor;
            let Some(fraction) =
                threads::with_help(pays, || self.iterate(problem, u_old, &this, report))?
            else {
                return Ok(());
            };
            let is_last_floor = floor <= self.options.strain_rate_floor;
            let mut allowed = given.copied().unwrap_or_else(|| self.tolerances(problem));
            for _ in 0..MOST_PARTS {
                let before = report.residuals;
                if !is_last_floor || !solves_parts || before.are_within(&allowed) {
                    break;
                }
                let misses = self.misses.iter();
                let missed = misses.filter(|miss| **miss > allowed.stress).count();
                if 2 * missed > in_vain {
                    break;
                }
                let clock = Instant::now();
                let outcome = self.solve_part(problem, u_old, &allowed, report)?;
                self.times.parts += clock.elapsed().as_secs_f64();
                if outcome == Outcome::TooLarge {
                    break;
                }
                if outcome == Outcome::Failed {
                    in_vain = missed;
                }
                self.evaluated_at = f64::NAN;
                report.residuals = self.residuals(problem, u_old, floor);
                allowed = given.copied().unwrap_or_else(|| self.tolerances(problem));
                if report.residuals.over(&allowed) > 0.5 * before.over(&allowed) {
                    break;
                }
            }
            if keeps {
                tolerance = self.forcing(&allowed, &report.residuals);
            }
            report.allowed = allowed;
            if is_last_floor && report.residuals.are_within(&allowed) {
                report.converged = true;
                return Ok(());
            }
            let left = report.residuals.over(&allowed);
            let left = left.max(report.residuals.divergence / allowed.divergence);
            let falls = !is_last_floor && fraction >= 0.5;
            if falls || iteration == 0 {
                // What changes on the way down is no conflict yet,
                left_when_counting = left;
                self.conflicts.begin();
            } else if self.conflicts.is_cycling() {
                // nor is what changes while the rest converges.
                let converges = left <= PROGRESS * left_when_counting;
                if !converges {
                    return Ok(());
                }
                left_when_counting = left;
                self.conflicts.begin();
            }
            if fraction >= 0.5 {
                floor = (floor * strategy.factor).max(self.options.strain_rate_floor);
            }
        }
        Ok(())
    }

    /// One iteration of the whole: the part of the change that was made, or none if there was no linear solution.
    fn iterate<R: Rheology, const D: usize, const V: usize>(
        &mut self,
        problem: &StepProblem<'_, R, D, C, V>,
        u_old: &[f64],
        this: &Iteration,
        report: &mut StepReport,
    ) -> Result<Option<f64>, Error> {
        self.release(problem.discretisation, this.is_first);
        self.linearise(problem, this.floor);
        self.assemble(problem, u_old);
        let clock = Instant::now();
        let system = &mut self.matrix.system;
        let prepared = if this.keeps_factors {
            system.keep_or_factorise()
        } else {
            system.factorise()
        };
        let (right_hand_side, change) = (&self.right_hand_side, &mut self.change);
        let solved = prepared.and_then(|()| system.solve(right_hand_side, change, this.tolerance));
        let factors = system.take_factor_time();
        self.times.factors += factors;
        self.times.krylov += clock.elapsed().as_secs_f64() - factors;
        if !is_solved(solved)? {
            return Ok(None);
        }
        let fraction = if this.line_search {
            self.line_search(problem, u_old, this.floor)
        } else {
            1.0
        };
        self.update(problem, this.floor, fraction);
        report.residuals = self.residuals(problem, u_old, this.floor);
        Ok(Some(fraction))
    }

    /// Relative residual to which the next linear system is solved: a part of what is left of the way, by which the
    /// iteration loses nothing (Eisenstat & Walker, *SIAM J. Sci. Comput.* 17 (1996) 16).
    fn forcing(&self, allowed: &Residuals, found: &Residuals) -> f64 {
        let left = 1.0 / found.over(allowed);
        let least = self.options.linear_tolerance;
        (FORCING * left)
            .max(least)
            .min(LOOSEST * least)
            .min(WEAKEST)
    }
}

impl<R: Rheology, const D: usize, const C: usize, const V: usize> YieldSolver<R, D, C, V>
    for PrimalDual<C>
{
    /// Three attempts: from the previous stress at the final ε, from a large ε, and from a larger
    /// one with slow descent and line search.
    fn step(
        &mut self,
        problem: &StepProblem<'_, R, D, C, V>,
        state: &mut FlowState<C>,
    ) -> Result<StepReport, Error> {
        let options = self.options;
        let strategies = [
            Strategy {
                first_floor: options.strain_rate_floor,
                factor: options.floor_factor,
                max_iterations: WARM_ITERATIONS,
                line_search: false,
                solves_parts: true,
            },
            Strategy {
                first_floor: options.first_strain_rate_floor,
                factor: options.floor_factor,
                max_iterations: options.max_iterations,
                line_search: false,
                solves_parts: false,
            },
            Strategy {
                first_floor: (1.0_f64).max(options.first_strain_rate_floor),
                factor: options.floor_factor.sqrt(),
                max_iterations: 2 * options.max_iterations,
                line_search: true,
                solves_parts: false,
            },
        ];
        // Without stress there is nothing warm to start from, unless the material has none.
        let is_cold = state.s.iter().all(|s| *s == [0.0; C])
            && problem.rheology.threshold(1.0, 1.0).stress > 0.0;
        let mut report = StepReport::default();
        self.conflicts.forget();
        for round in 0..=MOST_HELD_ROUNDS {
            for strategy in &strategies[usize::from(is_cold)..] {
                self.attempt(problem, &state.u, state, strategy, None, &mut report)?;
                if report.converged {
                    state.clone_from(&self.trial);
                    report.held_points = self.conflicts.held();
                    return Ok(report);
                }
            }
            let points = problem.discretisation.points();
            if round == MOST_HELD_ROUNDS || !self.conflicts.hold(points, &state.p) {
                break;
            }
        }
        Ok(report)
    }
}
