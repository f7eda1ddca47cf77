//! Plane shear between rough plates under a constant load, without gravity.
//!
//! The lower plate is fixed, the upper one moves at U and presses with P. Stress is uniform, so
//! u(z) = U z/H, I = (U/H) d √(ρ_s/P) and τ = c + μ(I) P exactly. Source: da Cruz, Emam, Prochnow,
//! Roux & Chevoir, *Phys. Rev. E* 72 (2005) 021309.

use std::ops::ControlFlow;

use serde::{Deserialize, Serialize};

use crate::error::{Error, require};
use crate::grid::Boundary;
use crate::layer::{Layer, LayerRun, LayerSolution, Options, Progress, validate_grid};
use crate::rheology::{MuI, ShearLaw};
use crate::units::Units;

/// Material sheared between two plates.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PlaneShearCase<L = MuI> {
    /// Distance H between the plates (m).
    pub gap: f64,
    /// Velocity U of the upper plate (m/s).
    pub wall_velocity: f64,
    /// Normal stress P on the upper plate (Pa).
    pub load: f64,
    /// The material.
    pub rheology: L,
    /// Cells across the gap.
    pub cells: usize,
    /// Columns of a periodic grid of square cells; none computes a flow that does not vary
    /// along x.
    #[serde(default)]
    pub columns: Option<usize>,
}

impl<L: ShearLaw> PlaneShearCase<L> {
    /// Refuses parameters out of range.
    ///
    /// # Errors
    /// [`Error::OutOfRange`] with the key, the value and the allowed range.
    pub fn validate(&self) -> Result<(), Error> {
        self.rheology.validate()?;
        require(
            self.gap > 0.0,
            "gap",
            self.gap,
            "greater than 0 m and finite",
        )?;
        require(
            self.load > 0.0,
            "load",
            self.load,
            "greater than 0 Pa and finite",
        )?;
        require(
            true,
            "wall_velocity",
            self.wall_velocity,
            "any finite velocity",
        )?;
        validate_grid(self.cells, self.columns)
    }

    /// Exact velocity (m/s) at distance z (m) from the fixed plate.
    pub fn exact_velocity(&self, z: f64) -> f64 {
        self.wall_velocity * z / self.gap
    }

    /// Exact pressure (Pa), the same everywhere.
    pub fn exact_pressure(&self) -> f64 {
        self.load
    }

    /// Exact shear stress (Pa), the same everywhere; with the sign of the wall's velocity.
    pub fn exact_shear_stress(&self) -> f64 {
        let rate = (self.wall_velocity / self.gap).abs();
        self.rheology.threshold(rate, self.load).stress * self.wall_velocity.signum()
    }

    /// Computes the flow from rest to its steady state, or to the end time that the options set
    /// ([`LayerSolution::is_steady`]).
    ///
    /// # Errors
    /// Parameters out of range, no convergence, no steady state, or a stop asked for by
    /// `progress`.
    pub fn solve(
        &self,
        options: &Options,
        progress: &mut dyn FnMut(Progress) -> ControlFlow<()>,
    ) -> Result<LayerSolution, Error> {
        let mut run = self.begin(options)?;
        run.march(progress)?;
        Ok(self.solution(&run))
    }

    /// The material at rest, ready to be advanced.
    ///
    /// # Errors
    /// Parameters out of range.
    pub fn begin(&self, options: &Options) -> Result<LayerRun<L>, Error> {
        self.validate()?;
        let layer = Layer {
            units: Units::of_load(self.gap, self.rheology.bulk_density(), self.load),
            cells: self.cells,
            columns: self.columns,
            low: Boundary::NoSlip { velocity: 0.0 },
            high: Boundary::LoadedWall {
                velocity: self.wall_velocity,
                pressure: self.load,
            },
            acceleration: [0.0, 0.0],
            rheology: &self.rheology,
            side_walls: None,
        };
        layer.begin(options, &|_| self.exact_pressure())
    }

    /// A run's flow as it is, beside the exact solution.
    pub fn solution(&self, run: &LayerRun<L>) -> LayerSolution {
        run.solution(|z| self.exact_velocity(z), |_| self.exact_pressure())
    }
}
