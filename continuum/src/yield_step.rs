//! One implicit time step of yield-stress flow: velocity, pressure and stress at the new time.
//!
//! The discrete problem, in natural units (ρ = 1): given u* find u, p and s with
//!
//! ```text
//! M (u − u*)/Δt + Bᵀ W s − Dᵀ p = F,    D u = 0,    s √(|γ|² + ε²) = κ(γ̇, p) γ,  γ = B u,
//! ```
//!
//! where M is mass, D the divergence, B the strain rate at quadrature points of volume W, F the
//! load. The strain-rate floor ε makes the law smooth: where the material is rigid it creeps at
//! γ̇ of the order of ε, and nowhere is a largest viscosity imposed.
//!
//! Solvers stand behind [`YieldSolver`]: [`PrimalDual`] is the default, [`RegularisedViscosity`]
//! is what is common elsewhere, for comparison. With the crate's feature `conic`, `ConicProgram` solves
//! the step without a floor, as a conic program: the reference for both on small grids.

mod coefficients;
mod conflict;
#[cfg(feature = "conic")]
mod conic;
mod primal_dual;
mod regularised;

#[cfg(feature = "conic")]
pub use conic::{ConicOptions, ConicProgram, PressureOf};
pub use primal_dual::{LinearSolver, PrimalDual, PrimalDualOptions, SolverTimes};
pub use regularised::{RegularisedOptions, RegularisedViscosity};

use serde::Serialize;

use crate::discretisation::{COMPONENTS, Discretisation, VELOCITIES};
use crate::error::Error;
use crate::grid::DIMENSIONS;
use crate::rheology::Rheology;

/// Velocity, pressure and stress on a grid, in natural units.
#[derive(Debug, PartialEq)]
pub struct FlowState<const C: usize = COMPONENTS> {
    /// Unknown velocities, in the grid's numbering.
    pub u: Vec<f64>,
    /// Pressure of each cell, positive in compression.
    pub p: Vec<f64>,
    /// Stress at each quadrature point: ((τ_xx − τ_zz)/2, τ_xz) in a plane flow.
    pub s: Vec<[f64; C]>,
}

impl<const C: usize> Clone for FlowState<C> {
    fn clone(&self) -> Self {
        Self {
            u: self.u.clone(),
            p: self.p.clone(),
            s: self.s.clone(),
        }
    }

    /// Into the memory that is there.
    fn clone_from(&mut self, other: &Self) {
        let Self { u, p, s } = other;
        self.u.clone_from(u);
        self.p.clone_from(p);
        self.s.clone_from(s);
    }
}

impl<const C: usize> FlowState<C> {
    /// A state at rest with the given pressure in the cells.
    pub fn at_rest<const D: usize, const V: usize>(
        discretisation: &Discretisation<D, C, V>,
        pressure: Vec<f64>,
    ) -> Self {
        Self {
            u: vec![0.0; discretisation.velocities()],
            p: pressure,
            s: vec![[0.0; C]; discretisation.points().len()],
        }
    }
}

/// What a time step has to solve.
pub struct StepProblem<
    'a,
    R,
    const D: usize = DIMENSIONS,
    const C: usize = COMPONENTS,
    const V: usize = VELOCITIES,
> {
    /// The discrete operators.
    pub discretisation: &'a Discretisation<D, C, V>,
    /// The law of the material, in natural units.
    pub rheology: &'a R,
    /// Force on each velocity.
    pub load: &'a [f64],
    /// Time step Δt.
    pub dt: f64,
}

/// How far a step is from solving its equations; all values in natural units.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize)]
pub struct Residuals {
    /// Largest force imbalance per mass, as a fraction of g.
    pub momentum: f64,
    /// Largest divergence of velocity.
    pub divergence: f64,
    /// Largest |s √(|γ|² + ε²) − κ γ|/(√(|γ|² + ε²) (κ + 0.001)).
    pub stress: f64,
    /// Strain-rate floor ε at which the stress law holds.
    pub strain_rate_floor: f64,
}

/// The work done by one step.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize)]
pub struct StepReport {
    /// Nonlinear iterations, failed attempts included.
    pub iterations: usize,
    /// Linear systems solved.
    pub linear_solves: usize,
    /// Nonlinear iterations on parts of the unknowns, which are not among the others.
    pub part_iterations: usize,
    /// Quadrature points whose threshold kept the pressure that the step began with, because with that of
    /// its end there is no solution.
    pub held_points: usize,
    /// Residuals at the end.
    pub residuals: Residuals,
    /// What they were allowed to be: momentum and stress by how fast the fastest unknown moves, not by where the residual
    /// is ([`PrimalDualOptions::tolerance_in_motion`]).
    pub allowed: Residuals,
    /// Whether all residuals are within tolerance.
    pub converged: bool,
}

/// A method that makes one implicit time step.
pub trait YieldSolver<
    R: Rheology,
    const D: usize = DIMENSIONS,
    const C: usize = COMPONENTS,
    const V: usize = VELOCITIES,
>
{
    /// Advances `state`, which is changed only if the report says that the step converged.
    ///
    /// # Errors
    /// [`Error::LinearSolver`] if memory runs out; a step that merely does not converge, for want of a solution of a
    /// linear system too, is not an
    /// error but a report, and the caller cuts the time step.
    fn step(
        &mut self,
        problem: &StepProblem<'_, R, D, C, V>,
        state: &mut FlowState<C>,
    ) -> Result<StepReport, Error>;
}

/// Smallest threshold pressure: below it only cohesion is left. In natural units.
pub(crate) const PRESSURE_FLOOR: f64 = 1e-10;

/// Threshold pressure at a point, and whether it still depends on the cells' pressure.
#[inline]
fn threshold_pressure(pressure: f64) -> (f64, bool) {
    if pressure > PRESSURE_FLOOR {
        (pressure, true)
    } else {
        (PRESSURE_FLOOR, false)
    }
}

/// M (u − u*)/Δt + Bᵀ W s − Dᵀ p − F into `residual`, and its largest value per mass.
fn momentum_residual<R, const D: usize, const C: usize, const V: usize>(
    problem: &StepProblem<'_, R, D, C, V>,
    u_old: &[f64],
    state: &FlowState<C>,
    residual: &mut [f64],
) -> f64 {
    let discretisation = problem.discretisation;
    let mass = discretisation.mass();
    for (j, r) in residual.iter_mut().enumerate() {
        *r = mass[j] * (state.u[j] - u_old[j]) / problem.dt - problem.load[j];
    }
    for (point, s) in discretisation.points().iter().zip(&state.s) {
        for (slot, &j) in point.velocities().iter().enumerate() {
            residual[j] += point.weight * point.force(slot, s);
        }
    }
    let forces = discretisation
        .divergence()
        .iter()
        .zip(discretisation.gradient());
    for (&(cell, j, _), force) in forces {
        residual[j] -= force * state.p[cell];
    }
    residual
        .iter()
        .zip(mass)
        .fold(0.0, |largest, (r, m)| largest_or_nan(largest, r / m))
}

/// D u into `divergence` (integrated over cells), and its largest value per volume.
fn divergence_residual<const D: usize, const C: usize, const V: usize>(
    discretisation: &Discretisation<D, C, V>,
    u: &[f64],
    divergence: &mut [f64],
) -> f64 {
    divergence.fill(0.0);
    for &(cell, j, area) in discretisation.divergence() {
        divergence[cell] += area * u[j];
    }
    for &(cell, flux) in discretisation.known_fluxes() {
        divergence[cell] += flux;
    }
    let volume = discretisation.grid().cell_volume();
    divergence
        .iter()
        .fold(0.0, |largest, d| largest_or_nan(largest, d / volume))
}

/// Largest absolute value so far; NaN stays, where `f64::max` would drop it and call a broken
/// step converged.
#[inline]
fn largest_or_nan(largest: f64, value: f64) -> f64 {
    if value.is_nan() || value.abs() > largest {
        value.abs()
    } else {
        largest
    }
}
