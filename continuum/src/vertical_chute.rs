//! Half of a vertical chute: material that falls between rough vertical walls, with a rigid plug
//! in the middle.
//!
//! The coordinate y runs from the plane of symmetry (0) to the wall (W), velocity is positive
//! downwards. The walls press with P, so p = P everywhere and τ = ρ g y. Matter moves as a plug up to
//! y_p = (c + μ_s P)/(ρ g), and outside it, with m(y) = (ρ g y − c)/P = μ(I),
//!
//! ```text
//! u(y) = (P/(ρ g)) (I_0/d) √(P/ρ_s) [F(m(W)) − F(max(m(y), μ_s))],
//! F(m) = ∫ (m − μ_s)/(μ_2 − m) dm = −m − (μ_2 − μ_s) ln(μ_2 − m)
//! ```
//!
//! for μ(I), and for any law the integral of the rate at which it bears τ under P.
//!
//! If y_p ≥ W the material rests; if m(W) ≥ μ_2 it accelerates for ever. Source: GDR MiDi,
//! *Eur. Phys. J. E* 14 (2004) 341 (geometry), integration of μ(I).

use std::ops::ControlFlow;

use serde::{Deserialize, Serialize};

use crate::error::{Error, require};
use crate::grid::Boundary;
use crate::layer::{Layer, LayerRun, LayerSolution, Options, Progress, validate_grid};
use crate::rheology::shear_law::integral;
use crate::rheology::{MuI, ShearLaw};
use crate::units::Units;

/// One half of a vertical chute.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct VerticalChuteCase<L = MuI> {
    /// Half width W (m), from the plane of symmetry to the wall.
    pub half_width: f64,
    /// Normal stress P on the wall (Pa).
    pub load: f64,
    /// Gravity g along the chute (m/s²).
    pub gravity: f64,
    /// The material.
    pub rheology: L,
    /// Cells across the half width.
    pub cells: usize,
    /// Columns of a periodic grid of square cells; none computes a flow that does not vary along
    /// the chute.
    #[serde(default)]
    pub columns: Option<usize>,
}

impl<L: ShearLaw> VerticalChuteCase<L> {
    /// Refuses parameters out of range, among them loads too small to hold the material.
    ///
    /// # Errors
    /// [`Error::OutOfRange`] with the key, the value and the allowed range.
    pub fn validate(&self) -> Result<(), Error> {
        let law = &self.rheology;
        law.validate()?;
        require(
            self.half_width > 0.0,
            "half_width",
            self.half_width,
            "greater than 0 m and finite",
        )?;
        require(
            self.gravity > 0.0,
            "gravity",
            self.gravity,
            "greater than 0 m/s² and finite",
        )?;
        validate_grid(self.cells, self.columns)?;
        let wall_stress = self.exact_shear_stress(self.half_width) - law.cohesion();
        let [still, fastest] = law.friction_limits();
        require(
            self.load > 0.0
                && (wall_stress <= still * self.load || wall_stress < fastest * self.load),
            "load",
            self.load,
            format!(
                "greater than {:.6} Pa: a smaller load lets the material accelerate for ever",
                (wall_stress / fastest).max(0.0)
            ),
        )
    }

    /// Weight per volume ρ g (Pa/m).
    fn weight(&self) -> f64 {
        self.rheology.bulk_density() * self.gravity
    }

    /// Distance y_p (m) from the plane of symmetry to the edge of the rigid plug.
    pub fn plug_half_width(&self) -> f64 {
        let threshold = self.rheology.cohesion() + self.rheology.friction_limits()[0] * self.load;
        (threshold / self.weight()).min(self.half_width)
    }

    /// Exact velocity (m/s) at distance y (m) from the plane of symmetry.
    pub fn exact_velocity(&self, y: f64) -> f64 {
        let plug = self.plug_half_width();
        if plug >= self.half_width {
            return 0.0;
        }
        integral(y.abs().clamp(plug, self.half_width), self.half_width, |y| {
            self.rheology.rate_under(self.weight() * y, self.load)
        })
    }

    /// Shear stress ρ g y (Pa) at distance y (m) from the plane of symmetry, exact wherever matter shears or not.
    pub fn exact_shear_stress(&self, y: f64) -> f64 {
        self.weight() * y
    }

    /// Exact pressure (Pa), the same everywhere.
    pub fn exact_pressure(&self) -> f64 {
        self.load
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
            units: Units::of_load(self.half_width, self.rheology.bulk_density(), self.load),
            cells: self.cells,
            columns: self.columns,
            low: Boundary::FreeSlip,
            high: Boundary::LoadedWall {
                velocity: 0.0,
                pressure: self.load,
            },
            acceleration: [self.gravity, 0.0],
            rheology: &self.rheology,
            side_walls: None,
        };
        layer.begin(options, &|_| self.exact_pressure())
    }

    /// A run's flow as it is, beside the exact solution.
    pub fn solution(&self, run: &LayerRun<L>) -> LayerSolution {
        run.solution(|y| self.exact_velocity(y), |_| self.exact_pressure())
    }
}
