//! Time stepping of the momentum balance on one grid, in natural units (ρ = 1).
//!
//! Each step is implicit in viscosity, pressure and yield at once, so Δt is limited by what one
//! wants to resolve, not by stability. Advection of momentum is absent: ∇·(u ⊗ u) is zero in the
//! unidirectional flows that this module serves so far.

use std::ops::ControlFlow;

use serde::{Deserialize, Serialize};

use crate::discretisation::{Discretisation, QuadraturePoint, ThresholdPressure};
use crate::error::{Error, require};
use crate::grid::{DIMENSIONS, Grid};
use crate::rheology::{Rheology, strain_rate_norm};
use crate::wall_friction::{PointLaw, SideWalls};
use crate::yield_step::{
    FlowState, PrimalDual, PrimalDualOptions, RegularisedOptions, RegularisedViscosity, Residuals,
    StepProblem, StepReport, YieldSolver,
};

/// The method that makes a time step.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum YieldMethod {
    /// Primal–dual Newton method with the pressure in the threshold: the default.
    PrimalDual(PrimalDualOptions),
    /// Viscosity of limited size, for comparison.
    Regularised(RegularisedOptions),
}

impl Default for YieldMethod {
    fn default() -> Self {
        YieldMethod::PrimalDual(PrimalDualOptions::default())
    }
}

/// How time is marched to a steady state; all values in natural units.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Marching {
    /// First time step. The default, far above any time scale of the flow, goes to the steady
    /// state at once.
    pub time_step: f64,
    /// Factor by which the time step grows from step to step.
    pub growth: f64,
    /// Steps after which the march is given up.
    pub max_steps: usize,
    /// The flow is steady when no velocity changes faster than this, as a fraction of g, …
    pub steady_acceleration: f64,
    /// … nor by more than this fraction of the largest velocity in one step.
    pub steady_change: f64,
    /// Time at which to stop whether the flow is steady or not.
    pub end_time: Option<f64>,
}

impl Default for Marching {
    fn default() -> Self {
        Self {
            time_step: 1e8,
            growth: 1.0,
            max_steps: 100_000,
            steady_acceleration: 1e-8,
            steady_change: 1e-6,
            end_time: None,
        }
    }
}

impl Marching {
    /// Refuses settings that cannot march.
    ///
    /// # Errors
    /// [`Error::OutOfRange`] with the key, the value and the allowed range.
    pub fn validate(&self) -> Result<(), Error> {
        for (key, value) in [
            ("marching.time_step", self.time_step),
            ("marching.steady_acceleration", self.steady_acceleration),
            ("marching.steady_change", self.steady_change),
        ] {
            require(value > 0.0, key, value, "greater than 0 and finite")?;
        }
        require(
            self.growth >= 1.0,
            "marching.growth",
            self.growth,
            "at least 1 and finite",
        )?;
        if let Some(end) = self.end_time {
            require(
                end > 0.0,
                "marching.end_time",
                end,
                "greater than 0 and finite",
            )?;
        }
        Ok(())
    }
}

/// A march under way: with the flow's state it is all that a march needs to go on with the same bits.
#[derive(Debug, Clone, PartialEq)]
pub struct March {
    /// Every step made.
    pub history: Vec<StepRecord>,
    /// Time step that growth alone would ask for now.
    pub scheduled: f64,
    /// Time step to be tried next.
    pub next: f64,
    /// Whether the flow is steady, or its end time reached.
    pub over: bool,
}

impl March {
    /// The beginning of a march.
    pub fn new(marching: &Marching) -> March {
        March {
            history: Vec::new(),
            scheduled: marching.time_step,
            next: marching.time_step,
            over: false,
        }
    }
}

/// What one time step did; all values in natural units.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct StepRecord {
    /// Time at the end of the step.
    pub time: f64,
    /// Time step, after any cuts.
    pub dt: f64,
    /// Newton (or Picard) iterations, those of failed attempts included.
    pub newton_iterations: usize,
    /// Linear systems solved, those of failed attempts included.
    pub linear_solves: usize,
    /// Times that the step was cut and tried again.
    pub cuts: usize,
    /// Residuals of the equations, in natural units.
    pub residuals: Residuals,
    /// Mass-weighted mean velocity along x.
    pub mean_velocity: f64,
    /// Largest rate of change of a velocity.
    pub acceleration: f64,
}

/// Most times that a step is cut before the march gives up; each cut is sharper than the last, so
/// that a step of 10⁸ is not halved thirty times.
const MAX_CUTS: i32 = 9;
/// A point counts as yielded when its stress exceeds this fraction of the threshold at rest: less
/// than one, because a flow at constant friction stays a trace of ε² below.
const YIELDED: f64 = 1.0 - 1e-6;
/// Velocity (natural units) below which changes are not measured relative to the velocity.
const REST_VELOCITY: f64 = 1e-3;

/// A value for each cell from its height.
fn rows_of(grid: &Grid, value: impl Fn(f64) -> f64) -> Vec<f64> {
    let [columns, rows] = [grid.axes()[0].cells(), grid.axes()[1].cells()];
    (0..rows)
        .flat_map(|k| std::iter::repeat_n(value(grid.centre_height(k)), columns))
        .collect()
}

/// A flow on one grid: its state and what advances it.
pub struct Flow<R> {
    discretisation: Discretisation,
    rheology: R,
    load: Vec<f64>,
    solver: Box<dyn YieldSolver<R>>,
    state: FlowState,
    previous: Vec<f64>,
    time: f64,
}

impl<R: Rheology> Flow<R> {
    /// A flow at rest under a body acceleration, with a first guess of the pressure of each row of
    /// cells (a function of height).
    ///
    /// # Errors
    /// Settings out of range, or a matrix that cannot be analysed.
    pub fn at_rest(
        grid: Grid,
        threshold_pressure: ThresholdPressure,
        rheology: R,
        acceleration: [f64; DIMENSIONS],
        method: YieldMethod,
        pressure: impl Fn(f64) -> f64,
    ) -> Result<Self, Error> {
        let pressure = rows_of(&grid, pressure);
        let discretisation = Discretisation::new(grid, threshold_pressure);
        Self::on(discretisation, rheology, acceleration, method, pressure)
    }

    /// The same between side walls (in natural units) that a plane grid does not resolve.
    ///
    /// # Errors
    /// As [`at_rest`](Self::at_rest).
    pub fn between_side_walls(
        grid: Grid,
        walls: SideWalls,
        threshold_pressure: ThresholdPressure,
        rheology: R,
        acceleration: [f64; DIMENSIONS],
        method: YieldMethod,
        pressure: impl Fn(f64) -> f64,
    ) -> Result<Self, Error> {
        walls.validate()?;
        let pressure = rows_of(&grid, pressure);
        let mut discretisation = Discretisation::new(grid, threshold_pressure);
        discretisation.add_side_walls(walls);
        Self::on(discretisation, rheology, acceleration, method, pressure)
    }

    fn on(
        discretisation: Discretisation,
        rheology: R,
        acceleration: [f64; DIMENSIONS],
        method: YieldMethod,
        pressure: Vec<f64>,
    ) -> Result<Self, Error> {
        let solver: Box<dyn YieldSolver<R>> = match method {
            YieldMethod::PrimalDual(options) => {
                Box::new(PrimalDual::new(&discretisation, options)?)
            }
            YieldMethod::Regularised(options) => {
                Box::new(RegularisedViscosity::new(&discretisation, options)?)
            }
        };
        let state = FlowState::at_rest(&discretisation, pressure);
        Ok(Self {
            load: discretisation.load(acceleration),
            previous: state.u.clone(),
            discretisation,
            rheology,
            solver,
            state,
            time: 0.0,
        })
    }

    /// Makes one step of at most `dt`. A step that does not converge is cut and tried again.
    ///
    /// # Errors
    /// [`Error::NotConverged`] when cutting does not help.
    pub fn step(&mut self, dt: f64) -> Result<StepRecord, Error> {
        self.previous.copy_from_slice(&self.state.u);
        let mut dt = dt;
        let mut work = StepReport::default();
        for cut in 0..=MAX_CUTS {
            let problem = StepProblem {
                discretisation: &self.discretisation,
                rheology: &self.rheology,
                load: &self.load,
                dt,
            };
            let report = self.solver.step(&problem, &mut self.state)?;
            work.iterations += report.iterations;
            work.linear_solves += report.linear_solves;
            work.residuals = report.residuals;
            if report.converged {
                self.time += dt;
                return Ok(StepRecord {
                    time: self.time,
                    dt,
                    newton_iterations: work.iterations,
                    linear_solves: work.linear_solves,
                    cuts: cut as usize,
                    residuals: work.residuals,
                    mean_velocity: self.mean_velocity(),
                    acceleration: self.largest_change() / dt,
                });
            }
            if cut < MAX_CUTS {
                dt *= 0.5_f64.powi(cut + 1);
            }
        }
        Err(Error::NotConverged {
            time: self.time,
            dt,
            momentum: work.residuals.momentum,
            divergence: work.residuals.divergence,
            stress: work.residuals.stress,
            strain_rate_floor: work.residuals.strain_rate_floor,
        })
    }

    /// Marches until the flow is steady or the end time is reached; `progress` sees every step and
    /// may break off.
    ///
    /// # Errors
    /// [`Error::NotConverged`], [`Error::NotSteady`], [`Error::Stopped`], settings out of range.
    pub fn march(
        &mut self,
        marching: &Marching,
        progress: &mut dyn FnMut(&StepRecord) -> ControlFlow<()>,
    ) -> Result<Vec<StepRecord>, Error> {
        marching.validate()?;
        let mut march = March::new(marching);
        while !march.over {
            self.march_step(marching, &mut march)?;
            let broken_off = march.history.last().map(&mut *progress);
            if broken_off.is_some_and(|flow| flow.is_break()) {
                return Err(Error::Stopped {
                    steps: march.history.len(),
                });
            }
        }
        Ok(march.history)
    }

    /// Makes the next step of a march.
    ///
    /// # Errors
    /// [`Error::NotConverged`]; [`Error::NotSteady`] if all steps that the settings allow were made.
    pub fn march_step(&mut self, marching: &Marching, march: &mut March) -> Result<(), Error> {
        let steps = march.history.len();
        if steps >= marching.max_steps {
            return Err(Error::NotSteady {
                steps,
                time: self.time,
                acceleration: march.history.last().map_or(f64::NAN, |r| r.acceleration),
                tolerance: marching.steady_acceleration,
            });
        }
        let end = marching.end_time;
        let record = self.step(end.map_or(march.next, |end| march.next.min(end - self.time)))?;
        march.history.push(record);
        march.scheduled *= marching.growth;
        march.next = march
            .scheduled
            .min(2.0_f64.max(marching.growth) * record.dt);
        let is_over = end.is_some_and(|end| self.time >= end * (1.0 - 1e-12));
        march.over = is_over || self.is_steady(&record, marching);
        Ok(())
    }

    /// Takes up a state that [`state`](Self::state) and [`time`](Self::time) gave of such a flow.
    ///
    /// # Errors
    /// In words, if it is that of another grid.
    pub fn take_up(&mut self, state: FlowState, time: f64) -> Result<(), String> {
        let own = &self.state;
        for (name, found, wanted) in [
            ("velocities", state.u.len(), own.u.len()),
            ("pressures", state.p.len(), own.p.len()),
            ("stresses", state.s.len(), own.s.len()),
        ] {
            if found != wanted {
                return Err(format!(
                    "{found} {name} instead of the {wanted} of this grid"
                ));
            }
        }
        self.state = state;
        self.time = time;
        Ok(())
    }

    /// Whether a flow is steady that comes out of this step.
    pub(crate) fn is_steady(&self, record: &StepRecord, marching: &Marching) -> bool {
        let speed = self.max_speed().max(REST_VELOCITY);
        record.acceleration <= marching.steady_acceleration
            && record.acceleration * record.dt <= marching.steady_change * speed
    }

    fn largest_change(&self) -> f64 {
        let changes = self.state.u.iter().zip(&self.previous);
        changes.fold(0.0, |m, (a, b)| m.max((a - b).abs()))
    }

    /// Force on each velocity, to be changed between steps.
    pub(crate) fn load_mut(&mut self) -> &mut [f64] {
        &mut self.load
    }

    /// Velocity, pressure and stress, to be changed between steps.
    pub(crate) fn state_mut(&mut self) -> &mut FlowState {
        &mut self.state
    }

    /// The quadrature points, to be changed between steps.
    pub(crate) fn points_mut(&mut self) -> &mut [QuadraturePoint] {
        self.discretisation.points_mut()
    }

    /// The discrete operators.
    pub fn discretisation(&self) -> &Discretisation {
        &self.discretisation
    }

    /// Velocity, pressure and stress.
    pub fn state(&self) -> &FlowState {
        &self.state
    }

    /// Time since the start.
    pub fn time(&self) -> f64 {
        self.time
    }

    /// Largest absolute velocity on any face.
    pub fn max_speed(&self) -> f64 {
        self.state.u.iter().fold(0.0, |m, u| m.max(u.abs()))
    }

    /// Mass-weighted mean velocity along x.
    pub fn mean_velocity(&self) -> f64 {
        let range = self.discretisation.grid().component(0);
        let mass = &self.discretisation.mass()[range.clone()];
        let momentum: f64 = mass
            .iter()
            .zip(&self.state.u[range])
            .map(|(m, u)| m * u)
            .sum();
        momentum / mass.iter().sum::<f64>()
    }

    /// Velocity along x and pressure in each row of cells, averaged along x.
    pub fn profile(&self) -> (Vec<f64>, Vec<f64>) {
        let grid = self.discretisation.grid();
        let row_means = |values: &[f64]| -> Vec<f64> {
            let columns = values.len() / grid.axes()[1].cells();
            values
                .chunks_exact(columns)
                .map(|row| row.iter().sum::<f64>() / columns as f64)
                .collect()
        };
        (
            row_means(&self.state.u[grid.component(0)]),
            row_means(&self.state.p),
        )
    }

    /// Mean shear stress τ_xz on the low and on the high boundary of z; zero where there is none.
    pub fn boundary_shear_stress(&self) -> [f64; 2] {
        let mut force = [0.0; 2];
        let mut area = [0.0; 2];
        for (point, s) in self.discretisation.points().iter().zip(&self.state.s) {
            if let Some(side) = point.side {
                force[side] += point.weight * s[1];
                area[side] += point.weight;
            }
        }
        [0, 1].map(|side| {
            if area[side] > 0.0 {
                force[side] / area[side]
            } else {
                0.0
            }
        })
    }

    /// Volume fractions of the material that has yielded, and that has yielded where the equations
    /// are ill posed. Points without pressure are left out.
    pub fn yielded_and_ill_posed(&self) -> [f64; 2] {
        let points = self.discretisation.points().iter().zip(&self.state.s);
        let (mut total, mut yielded, mut ill_posed) = (0.0, 0.0, 0.0);
        for (point, s) in points {
            let pressure = point.pressure(&self.state.p);
            let is_material = !matches!(point.law, PointLaw::SideWalls(_));
            if pressure <= f64::EPSILON || !is_material {
                continue;
            }
            total += point.weight;
            let rate = strain_rate_norm(point.strain_rate(&self.state.u));
            let yield_stress = self.rheology.threshold(0.0, pressure).stress;
            if strain_rate_norm(*s) >= YIELDED * yield_stress {
                yielded += point.weight;
                if !self.rheology.is_well_posed(rate, pressure) {
                    ill_posed += point.weight;
                }
            }
        }
        [yielded / total, ill_posed / total]
    }
}
