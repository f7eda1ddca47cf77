//! Strain rate and threshold of the trial state at all points, found once for the three uses of an iteration: stresses
//! brought back under the threshold, residuals, and the next linearisation.

use super::PrimalDual;
use crate::rheology::{Rheology, Threshold, squared_norm, strain_rate_norm};
use crate::threads;
use crate::yield_step::StepProblem;

/// Points that are looked at by one thread, some tens of microseconds.
pub(super) const POINTS: usize = 1024;

/// A point of a state.
#[derive(Debug, Clone, Copy)]
pub(super) struct Evaluation<const C: usize> {
    /// γ, with what moving walls contribute.
    pub gamma: [f64; C],
    /// γ_ε = √(|γ|² + ε²).
    pub rate: f64,
    pub threshold: Threshold,
    /// Whether the threshold depends on the pressure of the cells.
    pub is_pressed: bool,
}

impl<const C: usize> Evaluation<C> {
    /// By how much a stress misses the law.
    pub(super) fn miss(&self, s: &[f64; C]) -> f64 {
        let (rate, threshold) = (self.rate, self.threshold.stress);
        let miss: [f64; C] = std::array::from_fn(|a| s[a] * rate - threshold * self.gamma[a]);
        strain_rate_norm(miss) / (rate * (threshold + 1e-3))
    }
}

impl<const C: usize> Default for Evaluation<C> {
    fn default() -> Self {
        Self {
            gamma: [0.0; C],
            rate: 0.0,
            threshold: Threshold::default(),
            is_pressed: false,
        }
    }
}

impl<const C: usize> PrimalDual<C> {
    /// Evaluates the trial state at an ε, unless that is done.
    pub(super) fn evaluate<R: Rheology, const D: usize, const V: usize>(
        &mut self,
        problem: &StepProblem<'_, R, D, C, V>,
        floor: f64,
    ) {
        if self.evaluated_at == floor {
            return;
        }
        let points = problem.discretisation.points();
        let (conflicts, trial) = (&self.conflicts, &self.trial);
        threads::over(&mut self.evaluations, POINTS, &|first, evaluations| {
            for (q, evaluation) in (first..).zip(evaluations) {
                let point = &points[q];
                let (pressure, is_pressed) = conflicts.pressure(q, point, &trial.p);
                let gamma = point.strain_rate(&trial.u);
                let rate = (squared_norm(&gamma) + floor * floor).sqrt();
                let mut threshold = point.law.threshold(problem.rheology, rate, pressure);
                if !is_pressed {
                    threshold.by_pressure = 0.0;
                }
                *evaluation = Evaluation {
                    gamma,
                    rate,
                    threshold,
                    is_pressed,
                };
            }
        });
        self.evaluated_at = floor;
    }
}
