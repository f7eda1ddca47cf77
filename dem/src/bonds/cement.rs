//! What bonds are made of.
//!
//! ```text
//! R_b = λ min(R_i, R_j)      A = π R_b²      I = π R_b⁴/4      J = π R_b⁴/2
//! k_n = E/(R_i + R_j)        k_t = k_n/ratio                        (Pa/m)
//! ```
//! Source: Potyondy & Cundall 2004, Eq. 16–18; Kappel et al. 2020, Eq. 21–24 (λ = 0.1, ratio 7/2,
//! σ = τ = 1 MPa, E that of the grains). Neither gives bonds a dashpot: what bonds vibrate with is
//! lost in the contacts beside them.

use crate::grains::{Grain, SPHERE_INERTIA};
use crate::setup::{SetupError, check};
use crate::timestep::{Guards, Limit, Pair};
use serde::{Deserialize, Serialize};
use std::f64::consts::PI;

/// Elasticity, size and strength of parallel bonds (SI).
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Cement {
    /// Young's modulus E (Pa).
    pub youngs_modulus: f64,
    /// Normal over shear stiffness, k_n/k_t.
    pub stiffness_ratio: f64,
    /// Radius of a bond over that of the smaller grain, λ.
    pub radius_ratio: f64,
    /// Tensile stress at which a bond breaks, σ (Pa); infinite for bonds that hold for ever.
    pub tensile_strength: f64,
    /// Shear stress at which it breaks, τ (Pa).
    pub shear_strength: f64,
}

/// Stiffnesses and section of one bond.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Section {
    /// Radius R_b (m).
    pub radius: f64,
    /// Area A (m²).
    pub area: f64,
    /// Second moment of area I (m⁴); J is twice as much.
    pub second_moment: f64,
    /// Stretching, k_n A (N/m).
    pub axial: f64,
    /// Shearing, k_t A (N/m).
    pub shear: f64,
    /// Bending, k_n I (N m).
    pub bending: f64,
    /// Twisting, k_t J (N m).
    pub twisting: f64,
}

impl Cement {
    /// The bonds of Kappel et al. 2020 between grains of this Young's modulus (Pa).
    pub fn sinter(youngs_modulus: f64) -> Self {
        Cement {
            youngs_modulus,
            stiffness_ratio: 3.5,
            radius_ratio: 0.1,
            tensile_strength: 1e6,
            shear_strength: 1e6,
        }
    }

    /// The bond of two grains of these radii (m).
    #[inline]
    pub fn section(&self, a: f64, b: f64) -> Section {
        let radius = self.radius_ratio * a.min(b);
        let (normal, area) = (self.youngs_modulus / (a + b), PI * radius * radius);
        let tangential = normal / self.stiffness_ratio;
        let second_moment = 0.25 * area * radius * radius;
        Section {
            radius,
            area,
            second_moment,
            axial: normal * area,
            shear: tangential * area,
            bending: normal * second_moment,
            twisting: tangential * 2.0 * second_moment,
        }
    }

    /// Checks every number.
    pub fn validate(&self) -> Result<(), SetupError> {
        let positive = |key: &str, value: f64| check(key, value, "> 0", |v| v > 0.0);
        positive("bonds.youngs_modulus", self.youngs_modulus)?;
        positive("bonds.stiffness_ratio", self.stiffness_ratio)?;
        check("bonds.radius_ratio", self.radius_ratio, "in (0, 1]", |v| {
            v > 0.0 && v <= 1.0
        })?;
        for (key, strength) in [
            ("bonds.tensile_strength", self.tensile_strength),
            ("bonds.shear_strength", self.shear_strength),
        ] {
            if strength != f64::INFINITY {
                positive(key, strength)?;
            }
        }
        Ok(())
    }

    /// The step at which the bond of two grains alone blows up: the period of its fastest free
    /// oscillation over π, since leap-frog follows ω while ω Δt < 2.
    ///
    /// ```text
    /// stretching  ω² = k_n A/m           shearing  ω² = k_t A (1/m + R_i²/I_i + R_j²/I_j)
    /// bending     ω² = k_n I/I_red       twisting  ω² = k_t J/I_red
    /// ```
    /// with m the reduced mass, `1/I_red = 1/I_i + 1/I_j`. A grain with several bonds oscillates faster:
    /// the share of 0.3 leaves room for 11 times the stiffness.
    pub fn limit(&self, a: &Grain, b: &Grain) -> Limit {
        let inertia = |g: &Grain| {
            if g.fixed {
                [0.0, 0.0]
            } else {
                [
                    1.0 / g.mass(),
                    1.0 / (SPHERE_INERTIA * g.mass() * g.radius * g.radius),
                ]
            }
        };
        self.limit_of(
            [inertia(a), inertia(b)],
            Pair {
                materials: [a.material, b.material],
                radii: [a.radius, b.radius],
            },
        )
    }

    /// The same from inverse masses (1/kg) and moments of inertia (1/(kg m²)).
    pub(crate) fn limit_of(&self, [a, b]: [[f64; 2]; 2], pair: Pair) -> Limit {
        let [ra, rb] = pair.radii;
        let section = self.section(ra, rb);
        let (mass, turn) = (a[0] + b[0], a[1] + b[1]);
        let fastest = [
            section.axial * mass,
            section.shear * (mass + ra * ra * a[1] + rb * rb * b[1]),
            section.bending * turn,
            section.twisting * turn,
        ];
        Limit {
            name: "bond",
            seconds: 2.0 / fastest.into_iter().fold(0.0, f64::max).sqrt(),
            share: SHARE,
            guards: Guards::Stability,
            why: "at which one bond's energy grows without end",
            pair,
        }
    }
}

/// Share of a bond's own limit that a step may take.
const SHARE: f64 = 0.3;
