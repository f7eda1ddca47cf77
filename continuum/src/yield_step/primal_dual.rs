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

mod evaluation;
mod part;

use std::time::Instant;

use serde::{Deserialize, Serialize};

use super::coefficients::StepMatrix;
use super::conflict::Conflicts;
use super::{
    FlowState, Residuals, StepProblem, StepReport, YieldSolver, divergence_residual,
    largest_or_nan, momentum_residual,
};
use crate::discretisation::{COMPONENTS, Discretisation};
use crate::error::Error;
use crate::rheology::{Rheology, squared_norm, strain_rate_norm};
use crate::threads;
use evaluation::{Evaluation, POINTS};
use part::Outcome;

/// Settings of [`PrimalDual`]; times and lengths in natural units.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct PrimalDualOptions {
    /// Strain-rate floor ε of the result, in √(g/H): rigid matter creeps at this rate. Below 1e-7
    /// the round-off of γ in a moving plug dominates.
    pub strain_rate_floor: f64,
    /// ε of the first iteration from a cold start.
    pub first_strain_rate_floor: f64,
    /// Factor by which ε falls after each iteration.
    pub floor_factor: f64,
    /// Iterations after which an attempt is given up.
    pub max_iterations: usize,
    /// Tolerance of the momentum balance, as a fraction of g.
    pub momentum_tolerance: f64,
    /// Tolerance of the divergence, in √(g/H).
    pub divergence_tolerance: f64,
    /// Tolerance of the stress law, relative; raised to the round-off of γ/ε where that is larger.
    /// A miss of this size shifts γ̇ by κ/κ_γ times as much, hundreds of times in slow flow.
    pub stress_tolerance: f64,
    /// Factor by which the tolerances of momentum and stress are raised at a speed of √(g H), and in
    /// proportion below (never under 1).
    pub tolerance_in_motion: f64,
    /// Relative residual to which the linear system of an iteration is solved where it is solved
    /// iteratively. A tighter one than the default saves no iteration; it leaves less of what the order of
    /// elimination does to a flow that mirrors itself.
    pub linear_tolerance: f64,
    /// How the linear systems of flows along more than one axis are solved.
    pub linear_solver: LinearSolver,
    /// Whether pressure is one-sided: p ≥ 0 and ∇·u ≥ 0, one of them zero, so that matter that is
    /// pulled apart falls freely instead of being held by suction.
    pub one_sided_pressure: bool,
}

/// What preconditions the Krylov iteration on the linear system.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum LinearSolver {
    /// LDLᵀ factors of the symmetric part.
    #[default]
    Factors,
    /// A multigrid cycle; factors where the places of the unknowns are not known. In space it is cheaper from some
    /// thousand cells on as long as most of the material flows; where much of it is rigid it needs several times
    /// as many iterations.
    Multigrid,
}

impl Default for PrimalDualOptions {
    fn default() -> Self {
        Self {
            strain_rate_floor: 1e-6,
            first_strain_rate_floor: 0.3,
            floor_factor: 0.1,
            max_iterations: 40,
            momentum_tolerance: 1e-9,
            divergence_tolerance: 1e-9,
            stress_tolerance: 1e-8,
            tolerance_in_motion: 1.0,
            linear_tolerance: NEWTON_TOLERANCE,
            linear_solver: LinearSolver::Factors,
            one_sided_pressure: false,
        }
    }
}

/// Smallest ε with which the stress law can be met in double precision.
const SMALLEST_STRAIN_RATE_FLOOR: f64 = 1e-7;
/// Most times that thresholds next to cells in conflict are held and the step is tried again.
const MOST_HELD_ROUNDS: usize = 4;
/// Iterations after which a start from the previous stress at the final ε is given up in favour of
/// a cold start.
const WARM_ITERATIONS: usize = 20;

/// Relative residual to which the linear system of a Newton iteration is solved when it is solved
/// iteratively: a tighter one saves no iteration.
const NEWTON_TOLERANCE: f64 = 1e-3;

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

/// The law linearised at one quadrature point.
#[derive(Debug, Clone, Copy)]
struct LinearisedPoint<const C: usize> {
    /// κ γ/√(|γ|² + ε²): the stress that the law asks for now.
    stress: [f64; C],
    /// ∂s/∂γ as the stress update uses it.
    by_rate: [[f64; C]; C],
    /// ∂s/∂p.
    by_pressure: [f64; C],
}

impl<const C: usize> Default for LinearisedPoint<C> {
    fn default() -> Self {
        Self {
            stress: [0.0; C],
            by_rate: [[0.0; C]; C],
            by_pressure: [0.0; C],
        }
    }
}

impl<const C: usize> LinearisedPoint<C> {
    fn set(&mut self, evaluation: &Evaluation<C>, s: &[f64; C]) {
        let Evaluation {
            gamma,
            rate,
            threshold,
            ..
        } = evaluation;
        let viscosity = threshold.stress / rate;
        let inverse_square = 1.0 / (rate * rate);
        for a in 0..C {
            self.stress[a] = viscosity * gamma[a];
            self.by_pressure[a] = threshold.by_pressure * gamma[a] / rate;
            for b in 0..C {
                self.by_rate[a][b] =
                    (threshold.by_rate * gamma[a] - s[a]) * gamma[b] * inverse_square;
            }
            self.by_rate[a][a] += viscosity;
        }
    }
}

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
        crate::error::require(
            options.strain_rate_floor >= SMALLEST_STRAIN_RATE_FLOOR
                && options.strain_rate_floor <= options.first_strain_rate_floor,
            "solver.strain_rate_floor",
            options.strain_rate_floor,
            format!(
                "{SMALLEST_STRAIN_RATE_FLOOR:e} to solver.first_strain_rate_floor = {}",
                options.first_strain_rate_floor
            ),
        )?;
        crate::error::require(
            options.floor_factor > 0.0 && options.floor_factor < 1.0,
            "solver.floor_factor",
            options.floor_factor,
            "between 0 and 1, both excluded",
        )?;
        crate::error::require(
            options.linear_tolerance > 0.0 && options.linear_tolerance < 1.0,
            "solver.linear_tolerance",
            options.linear_tolerance,
            "between 0 and 1, both excluded",
        )?;
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
    ) {
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
                threads::with_help(pays, || self.iterate(problem, u_old, &this, report))
            else {
                return;
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
                let outcome = self.solve_part(problem, u_old, &allowed, report);
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
            if is_last_floor && report.residuals.are_within(&allowed) {
                report.converged = true;
                return;
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
                    return;
                }
                left_when_counting = left;
                self.conflicts.begin();
            }
            if fraction >= 0.5 {
                floor = (floor * strategy.factor).max(self.options.strain_rate_floor);
            }
        }
    }

    /// One iteration of the whole: the part of the change that was made, or none if there was no linear solution.
    fn iterate<R: Rheology, const D: usize, const V: usize>(
        &mut self,
        problem: &StepProblem<'_, R, D, C, V>,
        u_old: &[f64],
        this: &Iteration,
        report: &mut StepReport,
    ) -> Option<f64> {
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
        solved.ok()?;
        let fraction = if this.line_search {
            self.line_search(problem, u_old, this.floor)
        } else {
            1.0
        };
        self.update(problem, this.floor, fraction);
        report.residuals = self.residuals(problem, u_old, this.floor);
        Some(fraction)
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

    /// ∂s/∂γ = κ/γ_ε 1 + (κ_γ γ − s) ⊗ γ/γ_ε² and ∂s/∂p = κ_p γ/γ_ε, with γ_ε = √(|γ|² + ε²).
    fn linearise<R: Rheology, const D: usize, const V: usize>(
        &mut self,
        problem: &StepProblem<'_, R, D, C, V>,
        floor: f64,
    ) {
        self.evaluate(problem, floor);
        let (evaluations, stresses) = (&self.evaluations, &self.trial.s);
        threads::over(&mut self.points, POINTS, &|first, points| {
            let states = evaluations[first..].iter().zip(&stresses[first..]);
            for (linear, (evaluation, s)) in points.iter_mut().zip(states) {
                linear.set(evaluation, s);
            }
        });
        for (q, evaluation) in self.evaluations.iter().enumerate() {
            self.conflicts.note_point(q, evaluation.is_pressed);
        }
    }

    /// Fills the matrix, with ∂s/∂γ symmetrised (positive definite while |s| ≤ κ), and the
    /// right-hand side.
    fn assemble<R: Rheology, const D: usize, const V: usize>(
        &mut self,
        problem: &StepProblem<'_, R, D, C, V>,
        u_old: &[f64],
    ) {
        let discretisation = problem.discretisation;
        let (linear, trial, released) = (&self.points, &self.trial, &self.released);
        let (matrix, right_hand_side) = (&mut self.matrix, &mut self.right_hand_side);
        threads::join(
            linear.len() >= threads::WORTH_HALVING * POINTS,
            || {
                matrix.fill(discretisation, problem.dt, released, |q| {
                    let by_rate = &linear[q].by_rate;
                    let c = std::array::from_fn(|a| {
                        std::array::from_fn(|b| 0.5 * (by_rate[a][b] + by_rate[b][a]))
                    });
                    (c, linear[q].by_pressure)
                });
            },
            || {
                let velocities = discretisation.velocities();
                let (momentum, continuity) = right_hand_side.split_at_mut(velocities);
                let mass = discretisation.mass();
                for (j, r) in momentum.iter_mut().enumerate() {
                    *r = problem.load[j] - mass[j] * (trial.u[j] - u_old[j]) / problem.dt;
                }
                for (point, linear) in discretisation.points().iter().zip(linear) {
                    for (slot, &j) in point.velocities().iter().enumerate() {
                        momentum[j] -= point.weight * point.force(slot, &linear.stress);
                    }
                }
                let forces = discretisation
                    .divergence()
                    .iter()
                    .zip(discretisation.gradient());
                for (&(cell, j, _), force) in forces {
                    momentum[j] += force * trial.p[cell];
                }
                let volume = discretisation.grid().cell_volume();
                for ((r, p), _) in continuity
                    .iter_mut()
                    .zip(&trial.p)
                    .zip(released)
                    .filter(|(_, released)| **released)
                {
                    *r = volume * p;
                }
            },
        );
    }

    /// Decides which cells let go: those that would have to be pulled together to keep their
    /// volume (p ≥ 0 and ∇·u ≥ 0 complement each other). Fills the continuity part of the
    /// right-hand side.
    /// The first iteration goes by the pressure alone, because the velocity that a step begins with
    /// has a divergence of its own. A pressure that has come out negative decides by itself, too: the
    /// divergence beside it is zero but for what the linear solution misses by.
    fn release<const D: usize, const V: usize>(
        &mut self,
        discretisation: &Discretisation<D, C, V>,
        is_first: bool,
    ) {
        let continuity = &mut self.right_hand_side[self.trial.u.len()..];
        divergence_residual(discretisation, &self.trial.u, continuity);
        if self.options.one_sided_pressure {
            let volume = discretisation.grid().cell_volume();
            let cells = self.trial.p.iter().zip(continuity).zip(&self.cut);
            for (released, ((p, d), cut)) in self.released.iter_mut().zip(cells) {
                *released = if is_first {
                    *p <= 0.0
                } else {
                    *cut || p - *d / volume <= 0.0
                };
            }
            self.conflicts.note_cells(&self.released);
        }
    }

    /// Largest fraction 1, ½, ¼, ⅛ of the change of velocity with which the convex functional of
    /// the step at the new pressure does not grow.
    fn line_search<R: Rheology, const D: usize, const V: usize>(
        &mut self,
        problem: &StepProblem<'_, R, D, C, V>,
        u_old: &[f64],
        floor: f64,
    ) -> f64 {
        let (du, dp) = self.change.split_at(self.trial.u.len());
        let pressure = &mut self.candidate_pressure;
        for ((c, p), d) in pressure.iter_mut().zip(&self.trial.p).zip(dp) {
            *c = p + d;
        }
        let held = &self.conflicts;
        let start = functional(problem, u_old, &self.trial.u, pressure, held, floor);
        let mut fraction = 1.0;
        while fraction > 0.125 {
            for ((c, u), d) in self.candidate.iter_mut().zip(&self.trial.u).zip(du) {
                *c = u + fraction * d;
            }
            let value = functional(problem, u_old, &self.candidate, pressure, held, floor);
            if value <= start + 1e-12 * start.abs() {
                break;
            }
            fraction *= 0.5;
        }
        fraction
    }

    /// Adds the change, and brings stresses that ended above the threshold back onto it.
    fn update<R: Rheology, const D: usize, const V: usize>(
        &mut self,
        problem: &StepProblem<'_, R, D, C, V>,
        floor: f64,
        fraction: f64,
    ) {
        let (du, dp) = self.change.split_at(self.trial.u.len());
        let points = problem.discretisation.points();
        let linear = &self.points;
        threads::over(&mut self.trial.s, POINTS, &|first, stresses| {
            let points = points[first..].iter().zip(&linear[first..]);
            for ((point, linear), s) in points.zip(stresses) {
                let rate = point.strain_rate_change(du);
                let pressure = point.pressure_change(dp);
                for (a, s) in s.iter_mut().enumerate() {
                    let mut target = linear.stress[a];
                    for (by_rate, rate) in linear.by_rate[a].iter().zip(&rate) {
                        target += by_rate * rate;
                    }
                    target += linear.by_pressure[a] * pressure;
                    *s += fraction * (target - *s);
                }
            }
        });
        for (u, d) in self.trial.u.iter_mut().zip(du) {
            *u += fraction * d;
        }
        for (p, d) in self.trial.p.iter_mut().zip(dp) {
            *p += d;
        }
        if self.options.one_sided_pressure {
            let cells = self.trial.p.iter_mut().zip(&mut self.cut);
            for ((p, cut), released) in cells.zip(&self.released) {
                *cut = *p < 0.0 && !released;
                *p = p.max(0.0);
            }
        }
        self.evaluated_at = f64::NAN;
        self.evaluate(problem, floor);
        self.bring_stress_to_threshold();
    }

    /// Brings stresses above the threshold of the evaluated state back onto it: beyond, ∂s/∂γ is not positive.
    fn bring_stress_to_threshold(&mut self) {
        for (evaluation, s) in self.evaluations.iter().zip(&mut self.trial.s) {
            let threshold = evaluation.threshold;
            let size = strain_rate_norm(*s);
            if size > threshold.stress {
                let shrink = threshold.stress / size;
                s.iter_mut().for_each(|s| *s *= shrink);
            }
        }
    }

    /// All residuals of the trial state; overwrites the right-hand side.
    fn residuals<R: Rheology, const D: usize, const V: usize>(
        &mut self,
        problem: &StepProblem<'_, R, D, C, V>,
        u_old: &[f64],
        floor: f64,
    ) -> Residuals {
        let divergence = self.continuity_residual(problem.discretisation);
        self.evaluate(problem, floor);
        let momentum = &mut self.right_hand_side[..self.trial.u.len()];
        let (evaluations, trial, misses) = (&self.evaluations, &self.trial, &mut self.misses);
        let (momentum, stress) = threads::join(
            evaluations.len() >= threads::WORTH_HALVING * POINTS,
            || momentum_residual(problem, u_old, trial, momentum),
            || {
                let mut stress = 0.0;
                let states = evaluations.iter().zip(&trial.s);
                for ((evaluation, s), kept) in states.zip(misses) {
                    *kept = evaluation.miss(s);
                    stress = largest_or_nan(stress, *kept);
                }
                stress
            },
        );
        Residuals {
            momentum,
            divergence,
            stress,
            strain_rate_floor: floor,
        }
    }

    /// Largest |∇·u|, or largest miss of p ≥ 0 ⟂ ∇·u ≥ 0.
    fn continuity_residual<const D: usize, const V: usize>(
        &mut self,
        discretisation: &Discretisation<D, C, V>,
    ) -> f64 {
        let continuity = &mut self.right_hand_side[self.trial.u.len()..];
        let divergence = divergence_residual(discretisation, &self.trial.u, continuity);
        if !self.options.one_sided_pressure {
            return divergence;
        }
        let volume = discretisation.grid().cell_volume();
        self.trial
            .p
            .iter()
            .zip(continuity)
            .fold(0.0, |largest, (p, d)| {
                let d = *d / volume;
                largest_or_nan(largest, if p - d <= 0.0 { *p } else { d })
            })
    }

    /// What the residuals of a step may be, by how fast it moves.
    fn tolerances<R, const D: usize, const V: usize>(
        &self,
        problem: &StepProblem<'_, R, D, C, V>,
    ) -> Residuals {
        let axes = problem.discretisation.grid().axes();
        let spacing = axes
            .iter()
            .filter(|axis| **axis != crate::grid::Axis::Flat)
            .fold(f64::INFINITY, |h, axis| h.min(axis.spacing()));
        let speed = self.trial.u.iter().fold(0.0_f64, |m, u| m.max(u.abs()));
        // Digits of γ that a large common velocity costs.
        let round_off = 10.0 * f64::EPSILON * speed / spacing;
        let options = &self.options;
        let motion = (options.tolerance_in_motion * speed.min(1.0)).max(1.0);
        Residuals {
            momentum: motion * options.momentum_tolerance,
            divergence: options.divergence_tolerance.max(round_off),
            stress: (motion * options.stress_tolerance).max(round_off / options.strain_rate_floor),
            strain_rate_floor: options.strain_rate_floor,
        }
    }
}

impl Residuals {
    /// The larger of momentum and stress over what is allowed.
    fn over(&self, allowed: &Self) -> f64 {
        (self.momentum / allowed.momentum).max(self.stress / allowed.stress)
    }

    /// Whether none is larger than allowed.
    fn are_within(&self, allowed: &Self) -> bool {
        self.momentum <= allowed.momentum
            && self.divergence <= allowed.divergence
            && self.stress <= allowed.stress
    }
}

/// J(u) = ½ (u − u*)ᵀ M (u − u*)/Δt + Σ W Ψ(γ_ε, p) − F·u: convex in u, least at the solution of
/// the step among velocities without divergence.
fn functional<R: Rheology, const D: usize, const C: usize, const V: usize>(
    problem: &StepProblem<'_, R, D, C, V>,
    u_old: &[f64],
    u: &[f64],
    p: &[f64],
    conflicts: &Conflicts,
    floor: f64,
) -> f64 {
    let mass = problem.discretisation.mass();
    let kinetic: f64 = (0..u.len())
        .map(|j| {
            let change = u[j] - u_old[j];
            0.5 * mass[j] * change * change / problem.dt - problem.load[j] * u[j]
        })
        .sum();
    let dissipated: f64 = problem
        .discretisation
        .points()
        .iter()
        .enumerate()
        .map(|(q, point)| {
            let gamma = point.strain_rate(u);
            let rate = (squared_norm(&gamma) + floor * floor).sqrt();
            let (pressure, _) = conflicts.pressure(q, point, p);
            point.weight * point.law.potential(problem.rheology, rate, pressure)
        })
        .sum();
    kinetic + dissipated
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
                self.attempt(problem, &state.u, state, strategy, None, &mut report);
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
