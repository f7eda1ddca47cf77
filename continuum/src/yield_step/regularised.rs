//! Regularised viscosity with a largest value, as volume-of-fluid codes treat μ(I): the comparison
//! that shows what the default method is worth.
//!
//! The stress is s = η γ with η = min(κ(γ̇, p)/γ̇, η_max), taken from the previous pass (Picard
//! iteration) or, with one pass, from the previous step. Matter below the threshold creeps at
//! γ̇ = |s|/η_max, and with one pass Δt is limited although each step is implicit.

use serde::{Deserialize, Serialize};

use super::coefficients::StepMatrix;
use super::{
    FlowState, LinearSolver, StepProblem, StepReport, YieldSolver, divergence_residual,
    largest_or_nan, momentum_residual, threshold_pressure,
};
use crate::discretisation::{COMPONENTS, Discretisation};
use crate::error::{Error, is_solved, require};
use crate::rheology::{Rheology, strain_rate_norm};

/// Settings of [`RegularisedViscosity`].
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct RegularisedOptions {
    /// Largest viscosity η_max, in ρ √(g H³).
    pub largest_viscosity: f64,
    /// Passes per step; with one the viscosity lags one step behind.
    pub passes: usize,
}

impl Default for RegularisedOptions {
    fn default() -> Self {
        Self {
            largest_viscosity: 100.0,
            passes: 1,
        }
    }
}

/// Relative residual of the linear system, which is all there is to converge in a pass.
const LINEAR_TOLERANCE: f64 = 1e-10;

/// Solver of time steps with a viscosity of limited size.
///
/// A step counts as converged after its passes, as it does in the codes that work this way; the
/// stress residual of the report says how far the stress then is from the law.
pub struct RegularisedViscosity {
    options: RegularisedOptions,
    matrix: StepMatrix,
    trial: FlowState,
    viscosity: Vec<f64>,
    /// No cell: here the pressure has no lower bound.
    released: Vec<bool>,
    right_hand_side: Vec<f64>,
    change: Vec<f64>,
}

impl RegularisedViscosity {
    /// Analyses the grid's matrix and sets the work arrays up.
    ///
    /// # Errors
    /// Options out of range, or a pattern that cannot be analysed.
    pub fn new(
        discretisation: &Discretisation,
        options: RegularisedOptions,
    ) -> Result<Self, Error> {
        require(
            options.largest_viscosity > 0.0,
            "solver.largest_viscosity",
            options.largest_viscosity,
            "greater than 0 and finite",
        )?;
        require(
            options.passes >= 1,
            "solver.passes",
            options.passes as f64,
            "at least 1",
        )?;
        let cells = discretisation.cells();
        let size = discretisation.velocities() + cells;
        Ok(Self {
            options,
            matrix: StepMatrix::new(discretisation, LINEAR_TOLERANCE, LinearSolver::Factors)?,
            trial: FlowState::at_rest(discretisation, vec![0.0; cells]),
            viscosity: vec![0.0; discretisation.points().len()],
            released: vec![false; cells],
            right_hand_side: vec![0.0; size],
            change: vec![0.0; size],
        })
    }

    fn evaluate_viscosity<R: Rheology>(&mut self, problem: &StepProblem<'_, R>) {
        let points = problem.discretisation.points();
        for (point, viscosity) in points.iter().zip(&mut self.viscosity) {
            let rate = strain_rate_norm(point.strain_rate(&self.trial.u));
            let (pressure, _) = threshold_pressure(point.pressure(&self.trial.p));
            let stress = point.law.threshold(problem.rheology, rate, pressure).stress;
            // The comparison form of the minimum has no division by a strain rate of zero.
            *viscosity = if stress < self.options.largest_viscosity * rate {
                stress / rate
            } else {
                self.options.largest_viscosity
            };
        }
    }

    fn evaluate_stress<R>(&mut self, problem: &StepProblem<'_, R>) {
        let points = problem.discretisation.points();
        for ((point, s), viscosity) in points.iter().zip(&mut self.trial.s).zip(&self.viscosity) {
            *s = point.strain_rate(&self.trial.u).map(|g| viscosity * g);
        }
    }

    /// Largest |s − η γ| relative to the threshold, with η evaluated anew.
    fn stress_residual<R: Rheology>(&mut self, problem: &StepProblem<'_, R>) -> f64 {
        self.evaluate_viscosity(problem);
        let mut worst = 0.0;
        for (q, point) in problem.discretisation.points().iter().enumerate() {
            let gamma = point.strain_rate(&self.trial.u);
            let s = self.trial.s[q];
            let miss = [
                s[0] - self.viscosity[q] * gamma[0],
                s[1] - self.viscosity[q] * gamma[1],
            ];
            let scale = self.viscosity[q] * strain_rate_norm(gamma) + 1e-3;
            worst = largest_or_nan(worst, strain_rate_norm(miss) / scale);
        }
        worst
    }
}

impl<R: Rheology> YieldSolver<R> for RegularisedViscosity {
    fn step(
        &mut self,
        problem: &StepProblem<'_, R>,
        state: &mut FlowState,
    ) -> Result<StepReport, Error> {
        let discretisation = problem.discretisation;
        let velocities = discretisation.velocities();
        self.trial.clone_from(state);
        let mut report = StepReport::default();
        for _ in 0..self.options.passes {
            self.evaluate_viscosity(problem);
            self.evaluate_stress(problem);
            let viscosity = &self.viscosity;
            self.matrix
                .fill(discretisation, problem.dt, &self.released, |q| {
                    let eta = viscosity[q];
                    ([[eta, 0.0], [0.0, eta]], [0.0; COMPONENTS])
                });
            let (momentum, continuity) = self.right_hand_side.split_at_mut(velocities);
            momentum_residual(problem, &state.u, &self.trial, momentum);
            momentum.iter_mut().for_each(|r| *r = -*r);
            divergence_residual(discretisation, &self.trial.u, continuity);
            report.iterations += 1;
            report.linear_solves += 1;
            let solved = self.matrix.system.factorise().and_then(|()| {
                self.matrix
                    .system
                    .solve(&self.right_hand_side, &mut self.change, LINEAR_TOLERANCE)
            });
            if !is_solved(solved)? {
                return Ok(report);
            }
            let (du, dp) = self.change.split_at(velocities);
            for (u, d) in self.trial.u.iter_mut().zip(du) {
                *u += d;
            }
            for (p, d) in self.trial.p.iter_mut().zip(dp) {
                *p += d;
            }
            self.evaluate_stress(problem);
        }
        let (momentum, continuity) = self.right_hand_side.split_at_mut(velocities);
        report.residuals.momentum = momentum_residual(problem, &state.u, &self.trial, momentum);
        report.residuals.divergence =
            divergence_residual(discretisation, &self.trial.u, continuity);
        report.residuals.stress = self.stress_residual(problem);
        report.converged = true;
        state.clone_from(&self.trial);
        Ok(report)
    }
}
