//! Settings and state of a flow with a moving surface, and what a step of it reports.

use serde::{Deserialize, Serialize};

use super::history::History;
use crate::discretisation::COMPONENTS;
use crate::error::{Error, require};
use crate::free_surface::faces::ThinLayer;
use crate::free_surface::fields::CellFields;
use crate::grid::DIMENSIONS;
use crate::strain::SPACE_COMPONENTS;
use crate::yield_step::{PrimalDualOptions, Residuals, SolverTimes};

/// Settings of a flow with a moving surface, in natural units.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct SurfaceOptions {
    /// Largest Δt Σ |u|/h over the axes, at most 1. Above ½ material moves in two parts with one
    /// velocity. At 0.9 plane columns come to rest with their fronts within 0.25 % and their profiles within 0.2 % of the area
    /// of those at 0.1125.
    pub courant: f64,
    /// Largest time step.
    pub largest_step: f64,
    /// Factor by which a time step may exceed the one before.
    pub growth: f64,
    /// Whether stress and advection are those of the middle of a step, for an error of second order in the time step.
    /// Of flows whose state is changed from outside step by step nothing is known of the step before, so they do without.
    pub second_order: bool,
    /// How layers thinner than half a cell move over rough walls.
    pub thin_layer: ThinLayer,
    /// The solver of the implicit part.
    pub solver: PrimalDualOptions,
}

impl Default for SurfaceOptions {
    fn default() -> Self {
        Self {
            courant: 0.45,
            largest_step: 0.05,
            growth: 1.3,
            second_order: true,
            thin_layer: ThinLayer::default(),
            solver: PrimalDualOptions {
                strain_rate_floor: 1e-5,
                momentum_tolerance: 1e-5,
                divergence_tolerance: 1e-8,
                stress_tolerance: 1e-4,
                tolerance_in_motion: 50.0,
                one_sided_pressure: true,
                ..PrimalDualOptions::default()
            },
        }
    }
}

/// Largest Courant number of flows of first order in the time step.
const FIRST_ORDER_COURANT: f64 = 0.45;

impl SurfaceOptions {
    /// The same for a flow whose state is changed from outside step by step: nothing is taken from the step before, and the
    /// steps are as short as the larger error then asks.
    pub fn of_first_order(self) -> Self {
        Self {
            second_order: false,
            courant: self.courant.min(FIRST_ORDER_COURANT),
            ..self
        }
    }

    /// Refuses settings that cannot work.
    ///
    /// # Errors
    /// [`Error::OutOfRange`] with the key, the value and the allowed range.
    pub fn validate(&self) -> Result<(), Error> {
        require(
            self.courant > 0.0 && self.courant <= 1.0,
            "solver.courant",
            self.courant,
            "greater than 0, at most 1: no velocity is known farther than a cell from the material",
        )?;
        require(
            self.largest_step > 0.0,
            "solver.largest_step",
            self.largest_step,
            "greater than 0 and finite",
        )?;
        require(
            self.growth > 1.0,
            "solver.growth",
            self.growth,
            "greater than 1 and finite",
        )?;
        self.solver.validate()
    }
}

/// What one step of a flow with a moving surface did.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize)]
pub struct SurfaceStep {
    /// Time at the end of the step.
    pub time: f64,
    /// Time step.
    pub dt: f64,
    /// Cells with a pressure.
    pub active_cells: usize,
    /// Newton iterations, those of failed attempts included.
    pub newton_iterations: usize,
    /// Steps that were cut and tried again.
    pub cuts: usize,
    /// Points whose friction went by the pressure before the step ([`crate::yield_step::StepReport::held_points`]).
    pub held_points: usize,
    /// Points whose threshold pressure comes from more cells than there is room for, so that the nearest one stands for
    /// some: where a surface is torn to shreds.
    pub crowded_points: usize,
    /// Cells beside ground that hold more than they can or less than nothing after the transport, because what does not fit
    /// found no room within the rounds that it is handed on.
    pub unsettled_cells: usize,
    /// Residuals of the equations.
    pub residuals: Residuals,
    /// What they were allowed to be ([`crate::yield_step::StepReport::allowed`]).
    pub allowed: Residuals,
    /// Largest speed of material.
    pub max_speed: f64,
}

/// State of a flow with a moving surface, on all of its grid.
#[derive(Debug, PartialEq)]
pub struct SurfaceState<const D: usize = DIMENSIONS, const C: usize = COMPONENTS> {
    /// Fraction of each cell that is filled.
    pub fractions: Vec<f64>,
    /// Velocity on each face of each component, at the time of the velocity.
    pub velocity: [Vec<f64>; D],
    /// Pressure of each cell, negative where there is none.
    pub pressure: Vec<f64>,
    /// Stress at each corner of each cell, then the traction of side walls there if there are any, then
    /// that of ground in each cell under Coulomb friction, then the friction of thin layers on ground.
    pub stress: Vec<[f64; C]>,
    /// What the next step takes from the last one.
    pub history: History<D, C>,
    /// Time of the fractions.
    pub time: f64,
    /// Time of the velocity, half a step ahead.
    pub velocity_time: f64,
    /// Time step that the velocity is meant for; zero before the first.
    pub next_step: f64,
    /// Volumes that have flowed in and out through open ends.
    pub passed: [f64; 2],
    /// Steps made.
    pub steps: usize,
}

impl<const D: usize, const C: usize> Clone for SurfaceState<D, C> {
    fn clone(&self) -> Self {
        let mut copy = Self::default();
        copy.clone_from(self);
        copy
    }

    /// Into the memory that is there: every step keeps what it began with.
    fn clone_from(&mut self, other: &Self) {
        let Self {
            fractions,
            velocity,
            pressure,
            stress,
            history,
            time,
            velocity_time,
            next_step,
            passed,
            steps,
        } = other;
        self.fractions.clone_from(fractions);
        self.velocity.clone_from(velocity);
        self.pressure.clone_from(pressure);
        self.stress.clone_from(stress);
        self.history.clone_from(history);
        self.time = *time;
        self.velocity_time = *velocity_time;
        self.next_step = *next_step;
        self.passed = *passed;
        self.steps = *steps;
    }
}

impl<const D: usize, const C: usize> Default for SurfaceState<D, C> {
    fn default() -> Self {
        Self {
            fractions: Vec::new(),
            velocity: std::array::from_fn(|_| Vec::new()),
            pressure: Vec::new(),
            stress: Vec::new(),
            history: History::default(),
            time: 0.0,
            velocity_time: 0.0,
            next_step: 0.0,
            steps: 0,
            passed: [0.0; 2],
        }
    }
}

/// Wall time by phase of the step (s).
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize)]
pub struct Spent {
    /// Moving volume and momentum.
    pub transport: f64,
    /// Finding the unknowns and making their operators.
    pub operators: f64,
    /// Analysing the pattern of the matrix.
    pub analysis: f64,
    /// Newton's method: evaluation and assembly, factors, Krylov iterations, parts.
    pub newton: f64,
    /// What of Newton's method has a clock of its own.
    pub within_newton: SolverTimes,
}

/// Fields of a cell of a [`super::SpaceFlow`].
pub type SpaceFields = CellFields<3, SPACE_COMPONENTS>;
/// The state of a [`super::SpaceFlow`].
pub type SpaceState = SurfaceState<3, SPACE_COMPONENTS>;
