//! The linear system of an iteration: the law linearised at its points, and which cells have a pressure.

use super::PrimalDual;
use super::evaluation::{Evaluation, POINTS};
use crate::discretisation::Discretisation;
use crate::rheology::Rheology;
use crate::threads;
use crate::yield_step::{StepProblem, divergence_residual};

/// The law linearised at one quadrature point.
#[derive(Debug, Clone, Copy)]
pub(super) struct LinearisedPoint<const C: usize> {
    /// κ γ/√(|γ|² + ε²): the stress that the law asks for now.
    pub stress: [f64; C],
    /// ∂s/∂γ as the stress update uses it.
    pub by_rate: [[f64; C]; C],
    /// ∂s/∂p.
    pub by_pressure: [f64; C],
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

impl<const C: usize> PrimalDual<C> {
    /// ∂s/∂γ = κ/γ_ε 1 + (κ_γ γ − s) ⊗ γ/γ_ε² and ∂s/∂p = κ_p γ/γ_ε, with γ_ε = √(|γ|² + ε²).
    pub(super) fn linearise<R: Rheology, const D: usize, const V: usize>(
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
    pub(super) fn assemble<R: Rheology, const D: usize, const V: usize>(
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
    pub(super) fn release<const D: usize, const V: usize>(
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
}
