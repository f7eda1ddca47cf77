//! Flow on a heap between side walls: a layer that flows on top of the same material at rest.
//!
//! Friction on side walls at a distance W takes a share of the weight that grows with depth, so that
//! at depth ζ below the surface p = ρ g cosθ ζ and
//!
//! ```text
//! τ = ρ g cosθ (tanθ ζ − μ_w ζ²/W),    μ(I) = tanθ − μ_w ζ/W − c/p.
//! ```
//!
//! Without cohesion the layer flows down to ζ_0 = W (tanθ − μ_s)/μ_w and rests below, on any slope above
//! μ_s and however deep the heap is; u is the integral of the rate at which the law bears τ under p.
//! Source: Jop, Forterre & Pouliquen, *J. Fluid Mech.* 541 (2005) 167.

use std::ops::ControlFlow;

use serde::{Deserialize, Serialize};

use crate::error::{Error, require};
use crate::grid::Boundary;
use crate::layer::{Layer, LayerSolution, Options, Progress, validate_grid};
use crate::rheology::shear_law::integral;
use crate::rheology::{MuI, ShearLaw};
use crate::units::Units;
use crate::wall_friction::{SideWalls, WallFriction};

/// A heap between side walls.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct HeapCase<L = MuI> {
    /// Slope θ (rad) of the surface.
    pub slope: f64,
    /// Depth of the grid (m), which has to reach into the material at rest.
    pub depth: f64,
    /// Gravity g (m/s²).
    pub gravity: f64,
    /// Distance W between the walls (m).
    pub width: f64,
    /// Friction coefficient μ_w of the walls.
    pub wall_friction: f64,
    /// The material.
    pub rheology: L,
    /// Cells across the depth.
    pub cells: usize,
    /// Columns of a periodic grid of square cells; none computes a flow that does not vary along x.
    #[serde(default)]
    pub columns: Option<usize>,
}

impl<L: ShearLaw> HeapCase<L> {
    /// Refuses parameters out of range, among them heaps that flow down to their base.
    ///
    /// # Errors
    /// [`Error::OutOfRange`] with the key, the value and the allowed range.
    pub fn validate(&self) -> Result<(), Error> {
        self.rheology.validate()?;
        for (key, value) in [
            ("gravity", self.gravity),
            ("width", self.width),
            ("wall_friction", self.wall_friction),
        ] {
            require(value > 0.0, key, value, "greater than 0 and finite")?;
        }
        validate_grid(self.cells, self.columns)?;
        let [still, fastest] = self.rheology.friction_limits();
        let tangent = self.slope.tan();
        require(
            self.slope >= 0.0
                && self.slope < std::f64::consts::FRAC_PI_2
                && (tangent <= still || tangent < fastest),
            "slope_degrees",
            self.slope.to_degrees(),
            format!("0 to below {:.4}", still.max(fastest).atan().to_degrees()),
        )?;
        let [_, bottom] = self.flowing_depths();
        require(
            self.depth > bottom,
            "depth",
            self.depth,
            format!("greater than the depth of the flowing layer, {bottom:.6} m"),
        )
    }

    fn normal_weight(&self) -> f64 {
        self.rheology.bulk_density() * self.gravity * self.slope.cos()
    }

    /// Depths (m) between which the material shears: from under the rigid plug that cohesion makes to
    /// the material at rest. Both are zero if everything rests.
    pub fn flowing_depths(&self) -> [f64; 2] {
        let excess = self.slope.tan() - self.rheology.friction_limits()[0];
        let slope = self.wall_friction / self.width;
        let b = self.rheology.cohesion() / self.normal_weight();
        let square = excess * excess - 4.0 * slope * b;
        if excess <= 0.0 || square <= 0.0 {
            return [0.0, 0.0];
        }
        let bottom = 0.5 * (excess + square.sqrt()) / slope;
        [b / (slope * bottom), bottom]
    }

    /// Exact pressure (Pa) at height z (m) above the base of the grid.
    pub fn exact_pressure(&self, z: f64) -> f64 {
        self.normal_weight() * (self.depth - z)
    }

    /// Exact velocity (m/s) at height z (m) above the base of the grid.
    pub fn exact_velocity(&self, z: f64) -> f64 {
        let [top, bottom] = self.flowing_depths();
        let below_surface = (self.depth - z).clamp(top, bottom);
        integral(below_surface.sqrt(), bottom.sqrt(), |y| {
            let depth = y * y;
            let stress = self.normal_weight()
                * depth
                * (self.slope.tan() - self.wall_friction * depth / self.width);
            2.0 * y
                * self
                    .rheology
                    .rate_under(stress, self.normal_weight() * depth)
        })
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
        self.validate()?;
        let layer = Layer {
            units: Units::of_gravity(self.depth, self.rheology.bulk_density(), self.gravity),
            cells: self.cells,
            columns: self.columns,
            low: Boundary::NoSlip { velocity: 0.0 },
            high: Boundary::FreeSurface,
            acceleration: [
                self.gravity * self.slope.sin(),
                -self.gravity * self.slope.cos(),
            ],
            rheology: &self.rheology,
            side_walls: Some(SideWalls {
                width: self.width,
                friction: WallFriction {
                    friction: self.wall_friction,
                    cohesion: 0.0,
                },
            }),
        };
        layer.solve(
            options,
            |z| self.exact_velocity(z),
            |z| self.exact_pressure(z),
            progress,
        )
    }
}
