//! What is left of the equations, and what may be.

use super::PrimalDual;
use super::evaluation::POINTS;
use crate::discretisation::Discretisation;
use crate::rheology::Rheology;
use crate::threads;
use crate::yield_step::{
    Residuals, StepProblem, divergence_residual, largest_or_nan, momentum_residual,
};

impl<const C: usize> PrimalDual<C> {
    /// All residuals of the trial state; overwrites the right-hand side.
    pub(super) fn residuals<R: Rheology, const D: usize, const V: usize>(
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
    pub(super) fn continuity_residual<const D: usize, const V: usize>(
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
    pub(super) fn tolerances<R, const D: usize, const V: usize>(
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
    pub(super) fn over(&self, allowed: &Self) -> f64 {
        (self.momentum / allowed.momentum).max(self.stress / allowed.stress)
    }

    /// Whether none is larger than allowed.
    pub(super) fn are_within(&self, allowed: &Self) -> bool {
        self.momentum <= allowed.momentum
            && self.divergence <= allowed.divergence
            && self.stress <= allowed.stress
    }
}
