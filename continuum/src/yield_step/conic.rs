//! The yield step as a second-order cone program: without any strain-rate floor, on small grids.
//!
//! At given pressure in the threshold a step is the convex problem
//!
//! ```text
//! least ½ (u − u*)ᵀ M (u − u*)/Δt − F·u + Σ W Ψ(g, p̄)   over   D u = 0,  g ≥ |B u|,
//! ```
//!
//! whose multipliers are the pressure (of D u = 0) and the stress (of the cones). Ψ is replaced by its
//! second-order expansion about the present rates, which leaves the problem conic for every law whose
//! threshold leaves zero rate with a finite slope, and pressures and rates are put in anew from the solution until nothing changes: a fixed point solves
//! the step exactly, plugs included, where γ = 0 and |s| ≤ κ. It is the reference that the other
//! solvers are checked against; the interior-point method (Goulart & Chen, *Clarabel*, 2024) costs a
//! hundred times as much.
//!
//! Where matter is rigid, friction leaves the split of the normal stress into p and s open, as it does
//! for a block at rest on a rough plane: fixed points differ in p there, and through it a little in the
//! motion next to it. A strain-rate floor chooses one of them. So another solver's step is certified at
//! *its* pressure ([`PressureOf::Start`]): the program then has one velocity, and its multiplier must
//! give that pressure back wherever matter moves.

use clarabel::algebra::CscMatrix;
use clarabel::solver::{DefaultSettings, DefaultSolver, IPSolver, SolverStatus, SupportedConeT};
use serde::{Deserialize, Serialize};

use super::{
    FlowState, Residuals, StepProblem, StepReport, YieldSolver, divergence_residual,
    largest_or_nan, momentum_residual, threshold_pressure,
};
use crate::discretisation::{COMPONENTS, Discretisation};
use crate::error::{Error, require};
use crate::rheology::{Rheology, Threshold, strain_rate_norm};

/// Which pressure the threshold takes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum PressureOf {
    /// The pressure of the solution, by passes: a solver of its own.
    #[default]
    Solution,
    /// The pressure that the state comes with: a check of what another solver has found.
    Start,
}

/// Settings of [`ConicProgram`].
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct ConicOptions {
    /// Passes after which a step is given up.
    pub max_passes: usize,
    /// A step has converged when rates and pressures of the threshold change velocities, in
    /// √(g H), and pressures at yielded points, in ρ g H, by less than this.
    pub tolerance: f64,
    /// Which pressure the threshold takes.
    pub pressure: PressureOf,
    /// Tolerance of the stress law, relative to the threshold: what an expansion that suits the law
    /// ends far below.
    pub stress_tolerance: f64,
    /// Tolerance of each program, relative to its objective and to its constraints.
    pub program_tolerance: f64,
}

impl Default for ConicOptions {
    fn default() -> Self {
        Self {
            max_passes: 60,
            tolerance: 1e-7,
            pressure: PressureOf::Solution,
            stress_tolerance: 1e-4,
            program_tolerance: 1e-10,
        }
    }
}

/// Rows of a cone: the rate and the components of γ.
const CONE: usize = 1 + COMPONENTS;
/// A point counts as yielded where its rate exceeds this, in √(g/H).
const YIELDED_RATE: f64 = 1e-5;

/// Solver of time steps by conic programs.
pub struct ConicProgram {
    options: ConicOptions,
    constraints: CscMatrix<f64>,
    right_hand_side: Vec<f64>,
    cones: Vec<SupportedConeT<f64>>,
}

impl ConicProgram {
    /// Sets the constraints of one grid up.
    ///
    /// # Errors
    /// Options out of range.
    pub fn new(discretisation: &Discretisation, options: ConicOptions) -> Result<Self, Error> {
        require(
            options.max_passes >= 1,
            "solver.max_passes",
            options.max_passes as f64,
            "at least 1",
        )?;
        for (key, value) in [
            ("solver.tolerance", options.tolerance),
            ("solver.stress_tolerance", options.stress_tolerance),
            ("solver.program_tolerance", options.program_tolerance),
        ] {
            require(value > 0.0, key, value, "greater than 0 and finite")?;
        }
        let grid = discretisation.grid();
        let (cells, velocities) = (grid.cells(), grid.velocities());
        let points = discretisation.points();
        let rows = cells + CONE * points.len();
        let (mut row, mut column, mut value) = (Vec::new(), Vec::new(), Vec::new());
        for &(cell, j, area) in discretisation.divergence() {
            row.push(cell);
            column.push(j);
            value.push(area);
        }
        let mut right_hand_side = vec![0.0; rows];
        let rest = vec![0.0; velocities];
        for (q, point) in points.iter().enumerate() {
            let first = cells + CONE * q;
            row.push(first);
            column.push(velocities + q);
            value.push(-1.0);
            let of_walls = point.strain_rate(&rest);
            for c in 0..COMPONENTS {
                right_hand_side[first + 1 + c] = of_walls[c];
                for (&j, rate) in point.velocities().iter().zip(point.rates(c)) {
                    row.push(first + 1 + c);
                    column.push(j);
                    value.push(-rate);
                }
            }
        }
        let mut cones = vec![SupportedConeT::ZeroConeT(cells)];
        cones.extend(
            points
                .iter()
                .map(|_| SupportedConeT::SecondOrderConeT(CONE)),
        );
        Ok(Self {
            options,
            constraints: CscMatrix::new_from_triplets(
                rows,
                velocities + points.len(),
                row,
                column,
                value,
            ),
            right_hand_side,
            cones,
        })
    }

    /// Solves the program whose thresholds are expanded about `rates`; false if it has no solution
    /// to the tolerance.
    fn pass<R>(
        &self,
        problem: &StepProblem<'_, R>,
        u_old: &[f64],
        thresholds: &[Threshold],
        rates: &[f64],
        state: &mut FlowState,
    ) -> bool {
        let discretisation = problem.discretisation;
        let points = discretisation.points();
        let (cells, velocities) = (discretisation.grid().cells(), u_old.len());
        // Per cell volume, so that the tolerances mean the same on every grid.
        let scale = 1.0 / discretisation.grid().cell_volume();
        let size = velocities + points.len();
        let mut linear = vec![0.0; size];
        let mut diagonal = vec![0.0; size];
        for (j, mass) in discretisation.mass().iter().enumerate() {
            diagonal[j] = scale * mass / problem.dt;
            linear[j] = -scale * problem.load[j] - diagonal[j] * u_old[j];
        }
        for (q, point) in points.iter().enumerate() {
            let t = &thresholds[q];
            diagonal[velocities + q] = scale * point.weight * t.by_rate;
            linear[velocities + q] = scale * point.weight * (t.stress - t.by_rate * rates[q]);
        }
        let quadratic = CscMatrix::new_from_triplets(
            size,
            size,
            (0..size).collect(),
            (0..size).collect(),
            diagonal,
        );
        let tolerance = self.options.program_tolerance;
        let settings = DefaultSettings {
            verbose: false,
            tol_gap_abs: tolerance,
            tol_gap_rel: tolerance,
            tol_feas: tolerance,
            // One thread, so that bits do not depend on how many there are.
            max_threads: 1,
            // What falls short of the tolerance is judged by the residuals of the step itself.
            reduced_tol_gap_abs: 1e3 * tolerance,
            reduced_tol_gap_rel: 1e3 * tolerance,
            reduced_tol_feas: 1e3 * tolerance,
            ..DefaultSettings::default()
        };
        let solver = DefaultSolver::new(
            &quadratic,
            &linear,
            &self.constraints,
            &self.right_hand_side,
            &self.cones,
            settings,
        );
        let Ok(mut solver) = solver else { return false };
        solver.solve();
        let solution = &solver.solution;
        if !matches!(
            solution.status,
            SolverStatus::Solved | SolverStatus::AlmostSolved
        ) {
            return false;
        }
        state.u.copy_from_slice(&solution.x[..velocities]);
        for (p, z) in state.p.iter_mut().zip(&solution.z) {
            *p = -z / scale;
        }
        let cone_rows = solution.z[cells..].chunks_exact(CONE);
        for ((s, z), point) in state.s.iter_mut().zip(cone_rows).zip(points) {
            for c in 0..COMPONENTS {
                s[c] = -z[1 + c] / (scale * point.weight);
            }
        }
        true
    }

    /// Residuals of the exact law: |s| ≤ κ, and s·γ = κ|γ| where matter moves, under the pressures
    /// of the threshold.
    fn residuals<R: Rheology>(
        problem: &StepProblem<'_, R>,
        u_old: &[f64],
        state: &FlowState,
        pressures: &[f64],
    ) -> Residuals {
        let discretisation = problem.discretisation;
        let mut stress = 0.0;
        let points = discretisation.points().iter().zip(&state.s);
        for ((point, s), pressure) in points.zip(pressures) {
            let gamma = point.strain_rate(&state.u);
            let rate = strain_rate_norm(gamma);
            let threshold = point
                .law
                .threshold(problem.rheology, rate, *pressure)
                .stress;
            let excess = (strain_rate_norm(*s) - threshold).max(0.0);
            let idle = (threshold * rate - s[0] * gamma[0] - s[1] * gamma[1]).max(0.0);
            let miss = excess + idle / rate.max(YIELDED_RATE);
            stress = largest_or_nan(stress, miss / (threshold + 1e-3));
        }
        let mut scratch = vec![0.0; state.u.len()];
        let momentum = momentum_residual(problem, u_old, state, &mut scratch);
        let mut scratch = vec![0.0; state.p.len()];
        Residuals {
            momentum,
            divergence: divergence_residual(discretisation, &state.u, &mut scratch),
            stress,
            strain_rate_floor: 0.0,
        }
    }
}

impl<R: Rheology> YieldSolver<R> for ConicProgram {
    /// Passes from the velocity and pressure of `state`, which also serve as the first expansion
    /// point.
    fn step(
        &mut self,
        problem: &StepProblem<'_, R>,
        state: &mut FlowState,
    ) -> Result<StepReport, Error> {
        let points = problem.discretisation.points();
        let mut trial = state.clone();
        let mut report = StepReport::default();
        let pressures = |p: &[f64]| -> Vec<f64> {
            points
                .iter()
                .map(|point| threshold_pressure(point.pressure(p)).0)
                .collect()
        };
        let mut pressure = pressures(&trial.p);
        for _ in 0..self.options.max_passes {
            let rates: Vec<f64> = points
                .iter()
                .map(|point| strain_rate_norm(point.strain_rate(&trial.u)))
                .collect();
            let thresholds: Vec<Threshold> = rates
                .iter()
                .zip(points.iter().zip(&pressure))
                .map(|(rate, (point, p))| point.law.threshold(problem.rheology, *rate, *p))
                .collect();
            let before = trial.u.clone();
            report.iterations += 1;
            report.linear_solves += 1;
            if !self.pass(problem, &state.u, &thresholds, &rates, &mut trial) {
                return Ok(report);
            }
            let moved = trial.u.iter().zip(&before);
            let moved = moved.fold(0.0, |m, (a, b)| largest_or_nan(m, a - b));
            let mut pressed = 0.0;
            if self.options.pressure == PressureOf::Solution {
                let renewed = pressures(&trial.p);
                for (point, (a, b)) in points.iter().zip(renewed.iter().zip(&pressure)) {
                    if strain_rate_norm(point.strain_rate(&trial.u)) > YIELDED_RATE {
                        pressed = largest_or_nan(pressed, a - b);
                    }
                }
                pressure = renewed;
            }
            report.residuals = Self::residuals(problem, &state.u, &trial, &pressure);
            let tolerance = self.options.tolerance;
            if moved <= tolerance && pressed <= tolerance {
                report.converged = report.residuals.stress <= self.options.stress_tolerance;
                if report.converged {
                    *state = trial;
                }
                break;
            }
        }
        Ok(report)
    }
}

#[cfg(test)]
mod tests;
