//! Elastic spheres (Hertz) with a dashpot matched to the restitution.
//!
//! ```text
//! F_n = k_n x + g_n v            v = approach speed, x = overlap, F_n > 0 pushes apart
//! a   = √(R x)                   contact radius, 1/R = 1/R_i + 1/R_j
//! S_n = 2 E* a     k_n = 2/3 S_n = 4/3 E* a
//! g_n = -2 √(5/6) b √(S_n m)     b = ln e/√(ln² e + π²)        (Di Renzo & Di Maio; Tsuji)
//! 1/E* = (1 - ν_i²)/E_i + (1 - ν_j²)/E_j
//! ```
//! E (Pa) Young's modulus, ν (–) Poisson's ratio, e (–) restitution, m reduced mass. The dashpot is
//! scaled such that e does not depend on the impact speed. Without it: peak overlap
//! `(15 m v²/(16 E* √R))^{2/5}`, duration `2.87 (m²/(R E*² v))^{1/5}`.
//! Source: Kappel et al. 2020, Eq. 4–12; Antypov & Elliott 2011 for the matched dashpot.

use super::Touch;
use super::composition::{NormalPart, Pressing};
use crate::lanes::Lane;
use serde::{Deserialize, Serialize};
use std::f64::consts::PI;

/// Elastic constants of a material.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Elasticity {
    /// E (Pa).
    pub youngs_modulus: f64,
    /// ν, in (-1, 0.5].
    pub poissons_ratio: f64,
}

impl Elasticity {
    /// E* of a pair (Pa).
    pub fn effective_modulus(&self, other: &Elasticity) -> f64 {
        let compliance = |m: &Elasticity| (1.0 - m.poissons_ratio.powi(2)) / m.youngs_modulus;
        1.0 / (compliance(self) + compliance(other))
    }

    /// G* of a pair (Pa): `1/G* = Σ 2 (2 - ν)(1 + ν)/E`.
    pub fn effective_shear(&self, other: &Elasticity) -> f64 {
        let compliance = |m: &Elasticity| {
            2.0 * (2.0 - m.poissons_ratio) * (1.0 + m.poissons_ratio) / m.youngs_modulus
        };
        1.0 / (compliance(self) + compliance(other))
    }

    /// Shear modulus G = E/(2(1 + ν)) of the material (Pa).
    pub fn shear_modulus(&self) -> f64 {
        self.youngs_modulus / (2.0 * (1.0 + self.poissons_ratio))
    }
}

/// Hertz contact of a pair.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Hertz {
    /// E* (Pa).
    pub effective_modulus: f64,
    /// e, in (0, 1].
    pub restitution: f64,
}

impl Hertz {
    /// Two surfaces of one material.
    pub fn of(material: Elasticity, restitution: f64) -> Hertz {
        Hertz::between(material, material, restitution)
    }

    /// Surfaces of two materials.
    pub fn between(a: Elasticity, b: Elasticity, restitution: f64) -> Hertz {
        Hertz {
            effective_modulus: a.effective_modulus(&b),
            restitution,
        }
    }

    pub(super) fn coefficients(&self) -> [f64; 2] {
        [
            4.0 / 3.0 * self.effective_modulus,
            damping_factor(self.restitution) * (2.0 * self.effective_modulus).sqrt(),
        ]
    }
}

/// k_n = 4/3 E* √(R x) (N/m) of an effective modulus (Pa) at a reduced radius and an overlap (m).
pub fn secant_stiffness(modulus: f64, reduced_radius: f64, overlap: f64) -> f64 {
    4.0 / 3.0 * modulus * (reduced_radius * overlap).sqrt()
}

/// Overlap of an elastic impact, `(15 m v²/(16 E* √R))^{2/5}` (m).
pub fn impact_overlap(modulus: f64, reduced_mass: f64, reduced_radius: f64, speed: f64) -> f64 {
    (15.0 * reduced_mass * speed * speed / (16.0 * modulus * reduced_radius.sqrt())).powf(0.4)
}

/// Duration of an elastic impact (s): 2.943 times overlap over speed.
pub fn impact_time(modulus: f64, reduced_mass: f64, reduced_radius: f64, speed: f64) -> f64 {
    IMPACT_TIME * impact_overlap(modulus, reduced_mass, reduced_radius, speed) / speed
}

/// `2 ∫₀¹ dξ/√(1 - ξ^{5/2}) = 4√π Γ(2/5)/(5 Γ(9/10))`: duration of an elastic impact in units of overlap
/// over speed.
const IMPACT_TIME: f64 = 2.943_275_184_324_704;

/// `-2 √(5/6) b`.
pub(super) fn damping_factor(restitution: f64) -> f64 {
    let ln = restitution.ln();
    -2.0 * (5.0_f64 / 6.0).sqrt() * ln / (ln * ln + PI * PI).sqrt()
}

/// In the inner loop: 4/3 E*, `-2 √(5/6) b √(2 E*)`.
#[derive(Clone, Copy, Debug)]
pub struct Elastic;

impl NormalPart for Elastic {
    const COEFFICIENTS: usize = 2;
    const STIFFENS: bool = true;
    const HOLDS: bool = false;

    #[inline(always)]
    fn press<L: Lane>(c: &[L], touch: &Touch<L>, approach: L, _: L) -> Pressing<L> {
        let contact_radius = (touch.overlap / touch.curvature).sqrt();
        let stiffness = c[0] * contact_radius;
        let damping = c[1] * (contact_radius / touch.inverse_mass).sqrt();
        Pressing {
            force: stiffness * touch.overlap + damping * approach,
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
        0.4 * Elastic::secant(c, overlap, curvature) * overlap * overlap
    }

    fn secant(c: &[f64], overlap: f64, curvature: f64) -> f64 {
        c[0] * (overlap.max(0.0) / curvature).sqrt()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const GLASS: Elasticity = Elasticity {
        youngs_modulus: 48e9,
        poissons_ratio: 0.2,
    };

    #[test]
    fn moduli_of_like_and_unlike_pairs() {
        assert!((GLASS.effective_modulus(&GLASS) / 25e9 - 1.0).abs() < 1e-14);
        assert!((GLASS.effective_shear(&GLASS) / 5.555_555_555_6e9 - 1.0).abs() < 1e-10);
        let steel = Elasticity {
            youngs_modulus: 210e9,
            poissons_ratio: 0.3,
        };
        // Springs in series: the pair's compliance is the mean of the like pairs'.
        let mean = 0.5 * (1.0 / 25e9 + 1.0 / steel.effective_modulus(&steel));
        assert!((GLASS.effective_modulus(&steel) * mean - 1.0).abs() < 1e-14);
    }

    #[test]
    fn the_time_of_an_impact_is_the_integral() {
        // x = 1 - u² takes the singularity away; the midpoint rule converges at second order.
        let n = 2_000_000;
        let sum: f64 = (0..n)
            .map(|k| {
                let u = (f64::from(k) + 0.5) / f64::from(n);
                2.0 * u / (1.0 - (1.0 - u * u).powf(2.5)).sqrt()
            })
            .sum();
        assert!((2.0 * sum / f64::from(n) - IMPACT_TIME).abs() < 1e-9);
    }

    #[test]
    fn peak_of_an_elastic_impact_is_that_of_chung_and_ooi() {
        // Test 1, glass, 10 mm, ±10 m/s: 10.697 kN at 274.1 µm, 40.3 µs.
        let mass = 4.0 / 3.0 * PI * 1e-6 * 2800.0 / 2.0;
        let modulus = GLASS.effective_modulus(&GLASS);
        let x = impact_overlap(modulus, mass, 0.005, 20.0);
        assert!((x / 274.1e-6 - 1.0).abs() < 1e-3, "{x}");
        let force = secant_stiffness(modulus, 0.005, x) * x;
        assert!((force / 10_697.0 - 1.0).abs() < 1e-3, "{force}");
        assert!((impact_time(modulus, mass, 0.005, 20.0) / 40.3e-6 - 1.0).abs() < 2e-3);
    }
}
