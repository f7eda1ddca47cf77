//! The change of an iteration: how far along it, and what becomes of the stress.

use super::PrimalDual;
use super::evaluation::POINTS;
use crate::rheology::{Rheology, squared_norm, strain_rate_norm};
use crate::threads;
use crate::yield_step::StepProblem;
use crate::yield_step::conflict::Conflicts;

impl<const C: usize> PrimalDual<C> {
    /// Largest fraction 1, ½, ¼, ⅛ of the change of velocity with which the convex functional of
    /// the step at the new pressure does not grow.
    pub(super) fn line_search<R: Rheology, const D: usize, const V: usize>(
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
    pub(super) fn update<R: Rheology, const D: usize, const V: usize>(
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
    pub(super) fn bring_stress_to_threshold(&mut self) {
        for (evaluation, s) in self.evaluations.iter().zip(&mut self.trial.s) {
            let threshold = evaluation.threshold;
            let size = strain_rate_norm(*s);
            if size > threshold.stress {
                let shrink = threshold.stress / size;
                s.iter_mut().for_each(|s| *s *= shrink);
            }
        }
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
