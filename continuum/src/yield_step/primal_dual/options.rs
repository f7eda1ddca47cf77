//! Settings of the method.

use serde::{Deserialize, Serialize};

use crate::error::{Error, require};

/// Relative residual to which the linear system of a Newton iteration is solved when it is solved
/// iteratively: a tighter one saves no iteration.
const NEWTON_TOLERANCE: f64 = 1e-3;

/// Settings of [`PrimalDual`](super::PrimalDual); times and lengths in natural units.
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

impl PrimalDualOptions {
    /// Refuses numbers with which the method means nothing.
    pub(crate) fn validate(&self) -> Result<(), Error> {
        require(
            self.strain_rate_floor >= SMALLEST_STRAIN_RATE_FLOOR
                && self.strain_rate_floor <= self.first_strain_rate_floor,
            "solver.strain_rate_floor",
            self.strain_rate_floor,
            format!(
                "{SMALLEST_STRAIN_RATE_FLOOR:e} to solver.first_strain_rate_floor = {}",
                self.first_strain_rate_floor
            ),
        )?;
        for (key, value) in [
            ("solver.momentum_tolerance", self.momentum_tolerance),
            ("solver.divergence_tolerance", self.divergence_tolerance),
            ("solver.stress_tolerance", self.stress_tolerance),
            ("solver.tolerance_in_motion", self.tolerance_in_motion),
            (
                "solver.first_strain_rate_floor",
                self.first_strain_rate_floor,
            ),
        ] {
            require(value > 0.0, key, value, "greater than 0 and finite")?;
        }
        require(
            self.floor_factor > 0.0 && self.floor_factor < 1.0,
            "solver.floor_factor",
            self.floor_factor,
            "between 0 and 1, both excluded",
        )?;
        require(
            self.linear_tolerance > 0.0 && self.linear_tolerance < 1.0,
            "solver.linear_tolerance",
            self.linear_tolerance,
            "between 0 and 1, both excluded",
        )
    }
}
