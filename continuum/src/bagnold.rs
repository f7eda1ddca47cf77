//! Bagnold flow: a layer of constant depth on a rough incline.
//!
//! Momentum gives p = ρ g cosθ ζ and τ = ρ g sinθ ζ at depth ζ = h − z below the surface, with
//! ρ = φ ρ_s. Without cohesion μ(I) = tanθ everywhere, so I = I_θ = I_0 (tanθ − μ_s)/(μ_2 − tanθ) is
//! uniform and γ̇ = I_θ √(p/ρ_s)/d gives
//!
//! ```text
//! u(z) = (2/3) (I_θ/d) √(φ g cosθ) [h^{3/2} − (h − z)^{3/2}].
//! ```
//!
//! With cohesion c, μ(I) = tanθ − b/ζ where b = c/(ρ g cosθ): matter nearer to the surface than
//! ζ_p = b/A is a rigid plug, and below it, with A = tanθ − μ_s, B = μ_2 − tanθ and y = √ζ,
//!
//! ```text
//! γ̇ = (I_0/d) √(φ g cosθ ζ) (A ζ − b)/(B ζ + b),
//! u  = (I_0/d) √(φ g cosθ) [G(√h) − G(max(y, √ζ_p))],
//! G(y) = (2/3)(A/B) y³ − 2 b (1 + A/B) [y/B − √(b/B³) atan(y √(B/b))].
//! ```
//!
//! For any law, γ̇ is the rate at which it bears τ under p, and u its integral over depth.
//!
//! Up to tanθ = μ_s the layer rests; from μ_2 on there is no steady state. Sources: GDR MiDi,
//! *Eur. Phys. J. E* 14 (2004) 341; Lagrée, Staron & Popinet, *J. Fluid Mech.* 686 (2011) 378.

use std::ops::ControlFlow;

use serde::{Deserialize, Serialize};

use crate::error::{Error, require};
use crate::grid::Boundary;
use crate::layer::{Layer, LayerRun, LayerSolution, Options, Progress, validate_grid};
use crate::rheology::shear_law::integral;
use crate::rheology::{MuI, ShearLaw};
use crate::units::Units;

/// Steady flow on an incline, with exact solution.
pub type BagnoldSolution = LayerSolution;

/// A layer on a rough incline.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct BagnoldCase<L = MuI> {
    /// Slope θ (rad).
    pub slope: f64,
    /// Depth h of the layer, normal to the incline (m).
    pub depth: f64,
    /// Gravity g (m/s²).
    pub gravity: f64,
    /// The material.
    pub rheology: L,
    /// Cells across the depth.
    pub cells: usize,
    /// Columns of a periodic grid of square cells; none computes a flow that does not vary
    /// along x.
    #[serde(default)]
    pub columns: Option<usize>,
}

impl<L: ShearLaw> BagnoldCase<L> {
    /// Refuses parameters out of range, among them slopes without steady state.
    ///
    /// # Errors
    /// [`Error::OutOfRange`] with the key, the value and the allowed range.
    pub fn validate(&self) -> Result<(), Error> {
        self.rheology.validate()?;
        require(
            self.depth > 0.0,
            "depth",
            self.depth,
            "greater than 0 m and finite",
        )?;
        require(
            self.gravity > 0.0,
            "gravity",
            self.gravity,
            "greater than 0 m/s² and finite",
        )?;
        validate_grid(self.cells, self.columns)?;
        let [still, fastest] = self.rheology.friction_limits();
        let tangent = self.slope.tan();
        let is_steady = tangent <= still || tangent < fastest;
        let limit = still.max(fastest);
        require(
            self.slope >= 0.0 && self.slope < std::f64::consts::FRAC_PI_2 && is_steady,
            "slope_degrees",
            self.slope.to_degrees(),
            format!(
                "0 to below {:.4} (the angle whose tangent is {limit}, the largest friction of the \
                 law): steeper layers accelerate for ever",
                limit.atan().to_degrees(),
            ),
        )
    }

    /// Weight component normal to the incline per volume, ρ g cosθ (Pa/m).
    fn normal_weight(&self) -> f64 {
        self.rheology.bulk_density() * self.gravity * self.slope.cos()
    }

    /// Exact pressure (Pa) at height z (m) above the base.
    pub fn exact_pressure(&self, z: f64) -> f64 {
        self.normal_weight() * (self.depth - z)
    }

    /// Exact shear stress (Pa) at height z (m) above the base.
    pub fn exact_shear_stress(&self, z: f64) -> f64 {
        self.exact_pressure(z) * self.slope.tan()
    }

    /// Thickness of the rigid plug under the surface (m): 0 without cohesion, the depth at rest.
    pub fn plug_thickness(&self) -> f64 {
        let excess = self.slope.tan() - self.rheology.friction_limits()[0];
        if excess <= 0.0 {
            return self.depth;
        }
        (self.rheology.cohesion() / (self.normal_weight() * excess)).min(self.depth)
    }

    /// Exact velocity (m/s) at height z (m) above the base.
    pub fn exact_velocity(&self, z: f64) -> f64 {
        let plug = self.plug_thickness();
        if plug >= self.depth {
            return 0.0;
        }
        let below_surface = (self.depth - z).clamp(plug, self.depth);
        // In y = √ζ the integrand is smooth at the surface.
        integral(below_surface.sqrt(), self.depth.sqrt(), |y| {
            let pressure = self.normal_weight() * y * y;
            2.0 * y
                * self
                    .rheology
                    .rate_under(pressure * self.slope.tan(), pressure)
        })
    }

    /// Natural units of the computation: depth, bulk density, √(g h).
    pub fn units(&self) -> Units {
        Units::of_gravity(self.depth, self.rheology.bulk_density(), self.gravity)
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
    ) -> Result<BagnoldSolution, Error> {
        let mut run = self.begin(options)?;
        run.march(progress)?;
        Ok(self.solution(&run))
    }

    /// The layer at rest, ready to be advanced.
    ///
    /// # Errors
    /// Parameters out of range.
    pub fn begin(&self, options: &Options) -> Result<LayerRun<L>, Error> {
        self.validate()?;
        let layer = Layer {
            units: self.units(),
            cells: self.cells,
            columns: self.columns,
            low: Boundary::NoSlip { velocity: 0.0 },
            high: Boundary::FreeSurface,
            acceleration: [
                self.gravity * self.slope.sin(),
                -self.gravity * self.slope.cos(),
            ],
            rheology: &self.rheology,
            side_walls: None,
        };
        layer.begin(options, &|z| self.exact_pressure(z))
    }

    /// A run's flow as it is, beside the exact solution.
    pub fn solution(&self, run: &LayerRun<L>) -> BagnoldSolution {
        run.solution(|z| self.exact_velocity(z), |z| self.exact_pressure(z))
    }
}
