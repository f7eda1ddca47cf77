//! Attraction of touching grains, constant while they touch, without range.
//!
//! | law | F_c | source |
//! |---|---|---|
//! | DMT | 2 π R w | Kappel et al. 2020, Eq. 20 |
//! | Scheeres | 0.036 J/m² · S_c² R | Kappel et al. 2020, after Scheeres et al. 2010 |
//! | constant strength | c A_eff, A_eff = 4 (βR)² | Zhang et al. 2018, as in Thuillet 2019, §1.6 |
//!
//! 1/R = 1/R_i + 1/R_j (m), w (J/m²) work of adhesion (4πγR = 2πRw with γ = w/2), S_c (–) cleanliness,
//! c (Pa) strength, β (–) size of the contact patch. Grains with asperities of radius R_a touch there:
//! F_c R_a/R. The thesis prints both R = r_i r_j/(r_i + r_j) and figures that fit R = r for equal
//! grains; here R is the reduced radius throughout, as in its moments.
//! So do Kappel et al.: their tensile strengths are those of twice the force that they print.
//!
//! The attraction jumps from 0 to F_c at first touch and back at the last, so an impact neither gains
//! nor loses by it: its energy is -F_c x at an overlap x.

use crate::lanes::Lane;
use serde::{Deserialize, Serialize};
use std::f64::consts::PI;

/// Attraction of touching grains.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Cohesion {
    /// None.
    #[default]
    None,
    /// Derjaguin, Muller & Toporov: `2 π R w`.
    Dmt {
        /// w (J/m²).
        work_of_adhesion: f64,
        /// R_a (m), where asperities touch.
        asperity_radius: Option<f64>,
    },
    /// Van der Waals attraction of lunar regolith: `0.036 J/m² · S_c² R`.
    Scheeres {
        /// S_c, in (0, 1].
        cleanliness: f64,
        /// R_a (m), where asperities touch.
        asperity_radius: Option<f64>,
    },
    /// Constant strength on the contact patch of angular grains: `4 c (βR)²`.
    Constant {
        /// c (Pa).
        strength: f64,
        /// β.
        patch: f64,
    },
}

/// Scheeres' constant (J/m²).
const SCHEERES: f64 = 0.036;

impl Cohesion {
    /// F_c (N) at a reduced radius (m).
    pub fn force(&self, reduced_radius: f64) -> f64 {
        let [c0, c1, c2] = self.coefficients();
        c0 + reduced_radius * (c1 + reduced_radius * c2)
    }

    /// F_c as a polynomial of R.
    pub(super) fn coefficients(&self) -> [f64; 3] {
        let touching = |slope: f64, asperity: Option<f64>| match asperity {
            Some(radius) => [slope * radius, 0.0, 0.0],
            None => [0.0, slope, 0.0],
        };
        match *self {
            Cohesion::None => [0.0; 3],
            Cohesion::Dmt {
                work_of_adhesion,
                asperity_radius,
            } => touching(2.0 * PI * work_of_adhesion, asperity_radius),
            Cohesion::Scheeres {
                cleanliness,
                asperity_radius,
            } => touching(SCHEERES * cleanliness * cleanliness, asperity_radius),
            Cohesion::Constant { strength, patch } => [0.0, 0.0, 4.0 * strength * patch * patch],
        }
    }
}

/// Numbers of the polynomial.
pub(super) const COEFFICIENTS: usize = 3;

/// F_c (N) in the inner loop.
#[inline(always)]
pub(super) fn pull<L: Lane>(c: &[L], curvature: L) -> L {
    let radius = L::splat(1.0) / curvature;
    c[0] + radius * (c[1] + radius * c[2])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn forces_are_those_of_the_sources() {
        let dmt = Cohesion::Dmt {
            work_of_adhesion: 0.028,
            asperity_radius: None,
        };
        // Two equal grains of 1 mm: R = 0.5 mm.
        assert!((dmt.force(5e-4) / (2.0 * PI * 5e-4 * 0.028) - 1.0).abs() < 1e-14);
        let rough = Cohesion::Dmt {
            work_of_adhesion: 0.028,
            asperity_radius: Some(1e-6),
        };
        assert!((rough.force(5e-4) / dmt.force(5e-4) - 1e-6 / 5e-4).abs() < 1e-14);
        // Thuillet 2019, Eq. 3.1: equal grains of radius r, clean: 1.99e-2 r = A S²/(48 Ω²) r/2.
        let clean = Cohesion::Scheeres {
            cleanliness: 1.0,
            asperity_radius: None,
        };
        assert!(
            (clean.force(0.5) / 1.99e-2 - 1.0).abs() < 0.11,
            "0.036 is the paper's rounding"
        );
        let patch = Cohesion::Constant {
            strength: 10.0,
            patch: 0.5,
        };
        assert!((patch.force(0.01) - 10.0 * 4.0 * (0.005_f64).powi(2)).abs() < 1e-18);
        let c = patch.coefficients();
        assert_eq!(pull(&c, 100.0), patch.force(0.01));
    }
}
