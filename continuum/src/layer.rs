//! A layer of material between two plane boundaries, brought from rest to a steady state: what
//! the cases with exact solutions have in common.

use std::ops::ControlFlow;

use serde::{Deserialize, Serialize};

use crate::discretisation::ThresholdPressure;
use crate::error::{Error, require};
use crate::flow::{Flow, March, Marching, StepRecord, YieldMethod};
use crate::grid::{Axis, Boundary, DIMENSIONS, Grid};
use crate::rheology::Rheology;
use crate::units::Units;
use crate::wall_friction::SideWalls;
use crate::yield_step::FlowState;

/// Settings of a computation, in natural units of the case (time √(H/g) in a layer of depth H).
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Options {
    /// Time stepping and the test for a steady state.
    pub marching: Marching,
    /// The method of a time step.
    pub method: YieldMethod,
    /// Where the pressure of the material's threshold is taken; side walls rub on cells and take that of the cell.
    pub threshold_pressure: ThresholdPressure,
}

/// State of a computation under way.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Progress {
    /// Steps made.
    pub step: usize,
    /// Time (s).
    pub time: f64,
    /// Last time step (s).
    pub dt: f64,
    /// Mean velocity (m/s).
    pub mean_velocity: f64,
    /// Largest acceleration over the acceleration that counts as steady.
    pub distance_to_steady: f64,
}

/// A steady flow across a layer with its exact solution; SI units unless said.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct LayerSolution {
    /// Positions of cell centres across the layer (m).
    pub z: Vec<f64>,
    /// Velocity (m/s).
    pub u: Vec<f64>,
    /// Pressure (Pa).
    pub p: Vec<f64>,
    /// Exact velocity at the same positions (m/s).
    pub exact_u: Vec<f64>,
    /// Exact pressure at the same positions (Pa).
    pub exact_p: Vec<f64>,
    /// √(Σ(u − u_exact)²/Σ u_exact²); the absolute root mean square (m/s) where the exact velocity
    /// is zero.
    pub velocity_error_l2_relative: f64,
    /// max|u − u_exact|/max|u_exact|, likewise.
    pub velocity_error_max_relative: f64,
    /// √(Σ(p − p_exact)²/Σ p_exact²).
    pub pressure_error_l2_relative: f64,
    /// Largest speed on any face (m/s).
    pub max_speed: f64,
    /// Shear stress on the low and on the high side of the layer (Pa): τ_xz, positive where u
    /// grows with z.
    pub boundary_shear_stress: [f64; 2],
    /// Volume fraction that has yielded.
    pub yielded_fraction: f64,
    /// Volume fraction that has yielded where the equations are ill posed.
    pub ill_posed_fraction: f64,
    /// Largest difference of velocity between the columns of a periodic grid (m/s).
    pub spread_along_x: f64,
    /// Whether the flow has become steady: a march that [`Marching::end_time`] ends may leave it on its way, and the exact
    /// velocity is that of the steady flow.
    pub is_steady: bool,
    /// Number of steps.
    pub steps: usize,
    /// Linear systems solved.
    pub linear_solves: usize,
    /// Number of cells.
    pub cells: usize,
    /// Every step: times in s, velocities in m/s, accelerations in m/s², residuals in natural
    /// units.
    pub history: Vec<StepRecord>,
    /// The natural units of the computation.
    pub units: Units,
}

/// A layer to compute; lengths, accelerations and stresses in SI units.
pub(crate) struct Layer<'a, L> {
    pub units: Units,
    pub cells: usize,
    pub columns: Option<usize>,
    pub low: Boundary,
    pub high: Boundary,
    pub acceleration: [f64; DIMENSIONS],
    pub rheology: &'a L,
    pub side_walls: Option<SideWalls>,
}

/// Fewest cells across a layer: a pressure is extrapolated from two.
const MIN_CELLS: usize = 2;
/// Most cells across a layer.
const MAX_CELLS: usize = 1 << 20;

/// Refuses grids that make no sense.
pub(crate) fn validate_grid(cells: usize, columns: Option<usize>) -> Result<(), Error> {
    require(
        (MIN_CELLS..=MAX_CELLS).contains(&cells),
        "grid.cells",
        cells as f64,
        format!("{MIN_CELLS} to {MAX_CELLS}"),
    )?;
    columns.map_or(Ok(()), |columns| {
        require(
            (3..=MAX_CELLS).contains(&columns),
            "grid.columns",
            columns as f64,
            format!("3 to {MAX_CELLS}, or none for a flow that does not vary along x"),
        )
    })
}

impl<L: Rheology> Layer<'_, L> {
    /// Computes the steady flow and compares it with the exact velocity and pressure at height z.
    pub(crate) fn solve(
        &self,
        options: &Options,
        exact_velocity: impl Fn(f64) -> f64,
        exact_pressure: impl Fn(f64) -> f64,
        progress: &mut dyn FnMut(Progress) -> ControlFlow<()>,
    ) -> Result<LayerSolution, Error> {
        let mut run = self.begin(options, &exact_pressure)?;
        run.march(progress)?;
        Ok(run.solution(exact_velocity, exact_pressure))
    }

    /// The flow at rest, ready to march.
    pub(crate) fn begin(
        &self,
        options: &Options,
        exact_pressure: &dyn Fn(f64) -> f64,
    ) -> Result<LayerRun<L>, Error> {
        options.marching.validate()?;
        let units = self.units;
        let along = self.columns.map_or(Axis::Flat, |columns| Axis::Periodic {
            length: columns as f64 / self.cells as f64,
            cells: columns,
        });
        let across = Axis::Bounded {
            length: 1.0,
            cells: self.cells,
            low: self.low.in_units(&units),
            high: self.high.in_units(&units),
        };
        let grid = Grid::new([along, across])?;
        let law = self.rheology.in_units(&units);
        let acceleration = self.acceleration.map(|a| a / units.acceleration());
        // A guess from which Newton's method starts: the pressure at rest.
        let pressure = |height: f64| exact_pressure(height * units.length) / units.stress();
        let flow = match self.side_walls {
            None => Flow::at_rest(
                grid,
                options.threshold_pressure,
                law,
                acceleration,
                options.method,
                pressure,
            )?,
            Some(walls) => Flow::between_side_walls(
                grid,
                walls.in_units(&units),
                options.threshold_pressure,
                law,
                acceleration,
                options.method,
                pressure,
            )?,
        };
        Ok(LayerRun {
            units,
            cells: self.cells,
            march: March::new(&options.marching),
            marching: options.marching,
            flow,
        })
    }
}

/// A layer on its way from rest to its steady flow, step by step.
pub struct LayerRun<L> {
    units: Units,
    cells: usize,
    marching: Marching,
    march: March,
    flow: Flow<L>,
}

impl<L: Rheology> LayerRun<L> {
    /// Whether the march has come to its end: the flow is steady, or [`Marching::end_time`] is reached.
    pub fn is_over(&self) -> bool {
        self.march.over
    }

    /// Whether the flow is steady.
    pub fn is_steady(&self) -> bool {
        let last = self.march.history.last();
        last.is_some_and(|record| self.flow.is_steady(record, &self.marching))
    }

    /// Makes one step.
    ///
    /// # Errors
    /// No convergence, or no steady state within the steps that the settings allow.
    pub fn advance(&mut self) -> Result<(), Error> {
        self.flow.march_step(&self.marching, &mut self.march)
    }

    /// Marches until the flow is steady or its end time is reached; `progress` sees every step and may break off.
    pub(crate) fn march(
        &mut self,
        progress: &mut dyn FnMut(Progress) -> ControlFlow<()>,
    ) -> Result<(), Error> {
        while !self.is_over() {
            self.advance()?;
            let now = self.progress();
            if progress(now).is_break() {
                return Err(Error::Stopped { steps: now.step });
            }
        }
        Ok(())
    }

    /// How far it has come.
    pub fn progress(&self) -> Progress {
        let units = &self.units;
        let last = self.march.history.last();
        let of = |read: fn(&StepRecord) -> f64| last.map_or(0.0, read);
        Progress {
            step: self.march.history.len(),
            time: of(|r| r.time) * units.time(),
            dt: of(|r| r.dt) * units.time(),
            mean_velocity: of(|r| r.mean_velocity) * units.velocity,
            distance_to_steady: last.map_or(f64::INFINITY, |r| r.acceleration)
                / self.marching.steady_acceleration,
        }
    }

    /// Velocity, pressure, stress, time and march, all in natural units: what
    /// [`take_up`](Self::take_up) goes on from with the same bits.
    pub fn state(&self) -> (&FlowState, f64, &March) {
        (self.flow.state(), self.flow.time(), &self.march)
    }

    /// Goes on from a state of such a layer.
    ///
    /// # Errors
    /// In words, if it is that of another grid.
    pub fn take_up(&mut self, state: FlowState, time: f64, march: March) -> Result<(), String> {
        self.flow.take_up(state, time)?;
        self.march = march;
        Ok(())
    }

    /// The flow as it is, beside the exact velocity and pressure at height z.
    pub(crate) fn solution(
        &self,
        exact_velocity: impl Fn(f64) -> f64,
        exact_pressure: impl Fn(f64) -> f64,
    ) -> LayerSolution {
        let (units, flow) = (self.units, &self.flow);
        let natural = self.march.history.iter();
        let history: Vec<StepRecord> = natural.map(|r| in_si(r, &units)).collect();
        let (mut u, mut p) = flow.profile();
        u.iter_mut().for_each(|u| *u *= units.velocity);
        p.iter_mut().for_each(|p| *p *= units.stress());
        let z: Vec<f64> = (0..self.cells)
            .map(|k| (k as f64 + 0.5) * units.length / self.cells as f64)
            .collect();
        let exact_u: Vec<f64> = z.iter().map(|&z| exact_velocity(z)).collect();
        let exact_p: Vec<f64> = z.iter().map(|&z| exact_pressure(z)).collect();
        let [yielded_fraction, ill_posed_fraction] = flow.yielded_and_ill_posed();
        LayerSolution {
            velocity_error_l2_relative: l2_error(&u, &exact_u),
            velocity_error_max_relative: max_error(&u, &exact_u),
            pressure_error_l2_relative: l2_error(&p, &exact_p),
            max_speed: flow.max_speed() * units.velocity,
            boundary_shear_stress: flow.boundary_shear_stress().map(|s| s * units.stress()),
            yielded_fraction,
            ill_posed_fraction,
            spread_along_x: spread_along_x(flow) * units.velocity,
            is_steady: self.is_steady(),
            steps: history.len(),
            linear_solves: history.iter().map(|r| r.linear_solves).sum(),
            cells: flow.discretisation().grid().cells(),
            history,
            units,
            z,
            u,
            p,
            exact_u,
            exact_p,
        }
    }
}

fn in_si(record: &StepRecord, units: &Units) -> StepRecord {
    StepRecord {
        time: record.time * units.time(),
        dt: record.dt * units.time(),
        mean_velocity: record.mean_velocity * units.velocity,
        acceleration: record.acceleration * units.acceleration(),
        ..*record
    }
}

fn spread_along_x<R: Rheology>(flow: &Flow<R>) -> f64 {
    let grid = flow.discretisation().grid();
    let u = &flow.state().u[grid.component(0)];
    let columns = u.len() / grid.axes()[1].cells();
    u.chunks_exact(columns).fold(0.0, |spread, row| {
        let low = row.iter().fold(f64::INFINITY, |m, u| m.min(*u));
        let high = row.iter().fold(f64::NEG_INFINITY, |m, u| m.max(*u));
        f64::max(spread, high - low)
    })
}

/// √(Σ(a − b)²/Σ b²), or the root mean square of a − b where b is zero.
fn l2_error(values: &[f64], exact: &[f64]) -> f64 {
    let miss: f64 = values
        .iter()
        .zip(exact)
        .map(|(a, b)| (a - b) * (a - b))
        .sum();
    let size: f64 = exact.iter().map(|b| b * b).sum();
    let scale = if size > 0.0 { size } else { exact.len() as f64 };
    (miss / scale).sqrt()
}

/// max|a − b|/max|b|, or max|a − b| where b is zero.
fn max_error(values: &[f64], exact: &[f64]) -> f64 {
    let miss = values
        .iter()
        .zip(exact)
        .fold(0.0_f64, |m, (a, b)| m.max((a - b).abs()));
    let size = exact.iter().fold(0.0_f64, |m, b| m.max(b.abs()));
    if size > 0.0 { miss / size } else { miss }
}
