//! Elastic spheres of viscous material, never attractive.
//!
//! ```text
//! F_n = max{ 0, 2 Y √R/(3(1 - ν²)) (x^{3/2} + A √x ẋ) }        1/R = 1/R_i + 1/R_j
//! ```
//! Y (Pa) Young's modulus, ν (–), A (s) dissipative constant, x (m) overlap. The restitution falls
//! with the impact speed as a function of `β v^{1/5}`, β = γ k^{-3/5}, k = D/m, γ = D A/m (the source
//! by Schwager & Pöschel 2008 writes the dissipative term with a factor 3/2: its A is 2/3 of this one),
//! D = 2 Y √R/(3(1 - ν²)). Contact times follow Hertz.
//! Source: Tancredi et al. 2012, Eq. 6. The clamp ends a contact while surfaces still overlap.

use super::Touch;
use super::composition::{NormalPart, Pressing};
use super::hertz::Elasticity;
use crate::lanes::Lane;
use serde::{Deserialize, Serialize};

/// Viscoelastic contact of a pair.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Viscoelastic {
    /// E* (Pa): Y/(2(1 - ν²)) for two surfaces of one material.
    pub effective_modulus: f64,
    /// A (s).
    pub dissipation: f64,
}

impl Viscoelastic {
    /// Two surfaces of one material.
    pub fn of(material: Elasticity, dissipation: f64) -> Viscoelastic {
        Viscoelastic {
            effective_modulus: material.effective_modulus(&material),
            dissipation,
        }
    }

    pub(super) fn coefficients(&self) -> [f64; 2] {
        [4.0 / 3.0 * self.effective_modulus, self.dissipation]
    }
}

/// In the inner loop: 4/3 E*, A.
#[derive(Clone, Copy, Debug)]
pub struct Viscous;

impl NormalPart for Viscous {
    const COEFFICIENTS: usize = 2;
    const STIFFENS: bool = true;
    const HOLDS: bool = false;

    #[inline(always)]
    fn press<L: Lane>(c: &[L], touch: &Touch<L>, approach: L, _: L) -> Pressing<L> {
        let contact_radius = (touch.overlap / touch.curvature).sqrt();
        let stiffness = c[0] * contact_radius;
        let damping = stiffness * c[1];
        let force = stiffness * touch.overlap + damping * approach;
        Pressing {
            force: force.max(L::splat(0.0)),
            stiffness,
            damping,
            memory: contact_radius,
        }
    }

    #[inline(always)]
    fn hold<L: Lane>(_: &[L], _: L) -> L {
        L::splat(0.0)
    }

    fn stored(c: &[f64], overlap: f64, curvature: f64) -> f64 {
        0.4 * Viscous::secant(c, overlap, curvature) * overlap * overlap
    }

    fn secant(c: &[f64], overlap: f64, curvature: f64) -> f64 {
        c[0] * (overlap.max(0.0) / curvature).sqrt()
    }
}
