//! Plane waves on a uniform flow: whether small disturbances decay, and how fast short ones grow.
//!
//! A periodic square of side L holds material that strains at the uniform rate γ̇ under the pressure p.
//! A velocity A n cos(k·x), n ⊥ k, is added and one time step made; the wave then has the amplitude
//! A/(1 − σ Δt), which gives σ. Exactly (and without the advection of the wave by the flow),
//!
//! ```text
//! ρσ/k² = (κ/γ̇ − κ_γ)(1 − b²)/(1 − κ_p b) − κ/γ̇
//! ```
//!
//! with b = ξ·2D ξ/γ̇ for the direction ξ = k/|k|: see [`well_posedness`](crate::rheology::well_posedness).
//! Where that is positive, the law is ill posed and a finer grid brings faster growth. Source: Barker,
//! Schaeffer, Bohorquez & Gray, *J. Fluid Mech.* 779 (2015) 794.

use serde::{Deserialize, Serialize};

use crate::discretisation::{Discretisation, ThresholdPressure};
use crate::error::{Error, require};
use crate::grid::{Axis, Grid};
use crate::rheology::ShearLaw;
use crate::units::Units;
use crate::yield_step::{FlowState, PrimalDual, PrimalDualOptions, StepProblem, YieldSolver};

/// A wave on a uniform flow.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PlaneWaveCase<L> {
    /// Side L of the periodic square (m).
    pub side: f64,
    /// Strain rate γ̇ (1/s) of the flow.
    pub rate: f64,
    /// Pressure p (Pa) of the flow.
    pub pressure: f64,
    /// Direction b of the wave in the frame of the flow, −1 to 1.
    pub direction: f64,
    /// Periods of the wave along x and z.
    pub waves: [usize; 2],
    /// The material.
    pub rheology: L,
    /// Cells along x; as many along z, or three if the wave does not vary there.
    pub cells: usize,
}

/// What became of a wave; SI units.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct PlaneWave {
    /// |k| (1/m).
    pub wavenumber: f64,
    /// σ (1/s) on the grid.
    pub growth: f64,
    /// σ (1/s) of the equations.
    pub exact_growth: f64,
}

/// Strain of the wave as a fraction of that of the flow: small enough for the wave to be linear.
const AMPLITUDE: f64 = 1e-6;
/// Rows of the grid of a wave that does not vary along z: the fewest of a periodic axis.
const ROWS_OF_A_WAVE_ALONG_X: usize = 3;
/// Time step as a fraction of the fastest time that the viscosity of the flow sets on the wave.
const TIME_STEP: f64 = 0.05;

/// The uniform flow on its grid, in natural units.
struct UniformFlow<L> {
    discretisation: Discretisation,
    rheology: L,
    state: FlowState,
    rate: f64,
    viscosity: f64,
    time_unit: f64,
}

impl<L: ShearLaw> UniformFlow<L> {
    /// A solver whose tolerances see disturbances of the given size.
    fn solver(&self, size: f64, dt: f64) -> Result<PrimalDual, Error> {
        let options = PrimalDualOptions {
            momentum_tolerance: 1e-6 * size / dt,
            divergence_tolerance: 1e-6 * AMPLITUDE * self.rate,
            strain_rate_floor: (1e-4 * self.rate).clamp(1e-7, 1e-6),
            ..PrimalDualOptions::default()
        };
        PrimalDual::new(&self.discretisation, options)
    }

    fn step(&mut self, solver: &mut PrimalDual, dt: f64) -> Result<(), Error> {
        let load = vec![0.0; self.state.u.len()];
        let problem = StepProblem {
            discretisation: &self.discretisation,
            rheology: &self.rheology,
            load: &load,
            dt,
        };
        let report = solver.step(&problem, &mut self.state)?;
        if report.converged {
            return Ok(());
        }
        Err(Error::NotConverged {
            time: 0.0,
            dt,
            momentum: report.residuals.momentum,
            divergence: report.residuals.divergence,
            stress: report.residuals.stress,
            strain_rate_floor: report.residuals.strain_rate_floor,
        })
    }
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

impl<L: ShearLaw> PlaneWaveCase<L> {
    /// Refuses parameters out of range.
    ///
    /// # Errors
    /// [`Error::OutOfRange`] with the key, the value and the allowed range.
    pub fn validate(&self) -> Result<(), Error> {
        self.rheology.validate()?;
        for (key, value) in [
            ("side", self.side),
            ("rate", self.rate),
            ("pressure", self.pressure),
        ] {
            require(value > 0.0, key, value, "greater than 0 and finite")?;
        }
        require(
            self.direction.abs() <= 1.0,
            "direction",
            self.direction,
            "-1 to 1",
        )?;
        let [along, across] = self.waves;
        require(
            along >= 1 && 2 * along.max(across) < self.cells,
            "waves",
            along.max(across) as f64,
            format!(
                "at least 1 along x, and fewer than half of the cells, {}",
                self.cells
            ),
        )?;
        require(self.cells >= 3, "cells", self.cells as f64, "at least 3")
    }

    fn wave_vector(&self) -> [f64; 2] {
        self.waves
            .map(|waves| std::f64::consts::TAU * waves as f64 / self.side)
    }

    /// σ (1/s) of the equations.
    pub fn exact_growth(&self) -> f64 {
        let [kx, kz] = self.wave_vector();
        let threshold = self.rheology.threshold(self.rate, self.pressure);
        (kx * kx + kz * kz) * threshold.wave_growth(self.rate, self.direction)
            / self.rheology.bulk_density()
    }

    /// (γ₁, γ₂) of the flow, turned so that the wave has its direction b.
    fn strain_rate(&self) -> [f64; 2] {
        let [kx, kz] = self.wave_vector();
        let turn = 2.0 * kz.atan2(kx) + self.direction.acos();
        [self.rate * turn.cos(), self.rate * turn.sin()]
    }

    /// The flow in natural units, at rest but for its uniform strain.
    fn flow(&self, rows: usize) -> Result<UniformFlow<L>, Error> {
        self.validate()?;
        let units = Units::of_load(self.side, self.rheology.bulk_density(), self.pressure);
        let rheology = self.rheology.in_units(&units);
        let strain = self.strain_rate().map(|g| g * units.time());
        let h = 1.0 / self.cells as f64;
        let periodic = |cells: usize| Axis::Periodic {
            length: cells as f64 * h,
            cells,
        };
        // Nothing sets the mean pressure, and nothing changes it either.
        let grid = Grid::with_moving_surface([periodic(self.cells), periodic(rows)])?;
        let mut discretisation = Discretisation::new(grid, ThresholdPressure::Corner);
        discretisation.add_uniform_strain_rate(strain);
        let rate = self.rate * units.time();
        let stress = rheology.threshold(rate, 1.0).stress;
        let mut state =
            FlowState::at_rest(&discretisation, vec![1.0; discretisation.grid().cells()]);
        state.s.fill(strain.map(|g| stress * g / rate));
        Ok(UniformFlow {
            viscosity: stress / rate,
            discretisation,
            rheology,
            state,
            rate,
            time_unit: units.time(),
        })
    }

    /// Makes one time step and compares the wave before and after.
    ///
    /// # Errors
    /// Parameters out of range, or no convergence.
    pub fn solve(&self) -> Result<PlaneWave, Error> {
        let rows = if self.waves[1] == 0 {
            ROWS_OF_A_WAVE_ALONG_X
        } else {
            self.cells
        };
        let mut flow = self.flow(rows)?;
        let wave = shape(flow.discretisation.grid(), self.waves, self.cells);
        let square: f64 = self.wave_vector().iter().map(|k| k * k).sum();
        let natural_square = square * self.side * self.side;
        let size = AMPLITUDE * flow.rate / natural_square.sqrt();
        flow.state.u = wave.iter().map(|w| size * w).collect();
        let dt = TIME_STEP / (flow.viscosity * natural_square);
        let mut solver = flow.solver(size, dt)?;
        flow.step(&mut solver, dt)?;
        let gain = dot(&flow.state.u, &wave) / (size * dot(&wave, &wave));
        Ok(PlaneWave {
            wavenumber: square.sqrt(),
            growth: (1.0 - 1.0 / gain) / (dt * flow.time_unit),
            exact_growth: self.exact_growth(),
        })
    }

    /// By how much a disturbance of all waves along x that four cells resolve has grown after `time`
    /// (s), as the ratio of root mean squares of velocity; `waves` is not used. Time steps follow the
    /// fastest wave that the grid could hold.
    ///
    /// # Errors
    /// Parameters out of range, or no convergence.
    pub fn amplification(&self, time: f64) -> Result<f64, Error> {
        require(time > 0.0, "time", time, "greater than 0 s and finite")?;
        let mut flow = self.flow(ROWS_OF_A_WAVE_ALONG_X)?;
        let shortest = self.cells / 4;
        let mut noise = vec![0.0; flow.state.u.len()];
        for waves in 1..=shortest {
            let wave = shape(flow.discretisation.grid(), [waves, 0], self.cells);
            for (n, w) in noise.iter_mut().zip(wave) {
                *n += w;
            }
        }
        let size = AMPLITUDE * flow.rate / (std::f64::consts::TAU * shortest as f64);
        flow.state.u = noise.iter().map(|w| size * w).collect();
        let before = dot(&flow.state.u, &flow.state.u);
        let fastest = flow.viscosity * (2.0 * self.cells as f64).powi(2);
        let steps = (time / flow.time_unit * fastest).ceil().max(1.0);
        let dt = time / flow.time_unit / steps;
        let mut solver = flow.solver(size, dt)?;
        for _ in 0..steps as usize {
            flow.step(&mut solver, dt)?;
        }
        Ok((dot(&flow.state.u, &flow.state.u) / before).sqrt())
    }
}

/// cos(k·x) on the faces of a square of side one, in the direction that has no divergence on the grid.
fn shape(grid: &Grid, waves: [usize; 2], cells: usize) -> Vec<f64> {
    let h = 1.0 / cells as f64;
    let k = waves.map(|w| std::f64::consts::TAU * w as f64);
    let on_grid = k.map(|k| 2.0 * (0.5 * k * h).sin() / h);
    let length = on_grid[0].hypot(on_grid[1]);
    let normal = [-on_grid[1] / length, on_grid[0] / length];
    let mut wave = vec![0.0; grid.velocities()];
    for component in 0..2 {
        for (n, unknown) in grid.component(component).enumerate() {
            let mut position = [
                ((n % cells) as f64 + 0.5) * h,
                ((n / cells) as f64 + 0.5) * h,
            ];
            position[component] -= 0.5 * h;
            let phase = k[0] * position[0] + k[1] * position[1];
            wave[unknown] = normal[component] * phase.cos();
        }
    }
    wave
}
