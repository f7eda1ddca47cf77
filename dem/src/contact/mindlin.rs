//! Tangential stiffness of elastic spheres (Mindlin, no slip in the contact), with history.
//!
//! ```text
//! F_t = -( k_t S + g_t u_t ),   |F_t| ≤ μ |F_n|
//! k_t = S_t = 8 G* a            a = √(R x)
//! g_t = -2 √(5/6) b √(S_t m)    b = ln e/√(ln² e + π²)
//! ```
//! G* (Pa) effective shear modulus, `1/G* = Σ 2(2 - ν)(1 + ν)/E`. Source: Kappel et al. 2020, Eq. 5–10.
//!
//! k_t changes with the load. [`SpringMemory::Energy`] keeps the force of a spring that stiffens and
//! the displacement of one that softens, so that no cycle creates energy (`contact` says why);
//! [`SpringMemory::Displacement`] keeps S always, as LIGGGHTS' `history` and LAMMPS' `mindlin` do, for
//! comparison with them.

use super::composition::{Pressing, Shear, TangentialPart};
use super::hertz::{Elasticity, damping_factor};
use super::slider::slide;
use super::{Step, Touch};
use crate::lanes::{Lane, Vec3};
use serde::{Deserialize, Serialize};

/// What a spring keeps when the load makes it stiffer.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum SpringMemory {
    /// Its force: no cycle creates energy.
    #[default]
    Energy,
    /// Its displacement, as other codes do; a cycle of load and shear can create energy.
    Displacement,
}

/// Mindlin's tangential contact of a pair.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Mindlin {
    /// G* (Pa).
    pub effective_shear: f64,
    /// e that the dashpot is matched to, in (0, 1]; 1 = no dashpot.
    pub restitution: f64,
    /// Coulomb coefficient μ.
    pub friction: f64,
    /// What is kept under a growing load.
    pub memory: SpringMemory,
}

impl Mindlin {
    /// Two surfaces of one material.
    pub fn of(material: Elasticity, restitution: f64, friction: f64) -> Mindlin {
        Mindlin::between(material, material, restitution, friction)
    }

    /// Surfaces of two materials.
    pub fn between(a: Elasticity, b: Elasticity, restitution: f64, friction: f64) -> Mindlin {
        Mindlin {
            effective_shear: a.effective_shear(&b),
            restitution,
            friction,
            memory: SpringMemory::Energy,
        }
    }

    /// k_t (N/m).
    pub fn stiffness(&self, reduced_radius: f64, overlap: f64) -> f64 {
        8.0 * self.effective_shear * (reduced_radius * overlap).sqrt()
    }

    pub(super) fn coefficients(&self) -> [f64; 4] {
        [
            8.0 * self.effective_shear,
            damping_factor(self.restitution) * (8.0 * self.effective_shear).sqrt(),
            self.friction,
            match self.memory {
                SpringMemory::Energy => 1.0,
                SpringMemory::Displacement => 0.0,
            },
        ]
    }
}

/// In the inner loop: 8 G*, `-2 √(5/6) b √(8 G*)`, μ, 1 to keep the force of a stiffening spring.
#[derive(Clone, Copy, Debug)]
pub struct Shears;

impl TangentialPart for Shears {
    const COEFFICIENTS: usize = 4;
    const SPRING: bool = true;
    const STIFFENS: bool = true;

    #[inline(always)]
    fn shear<L: Lane>(
        c: &[L],
        touch: &Touch<L>,
        spring: Vec3<L>,
        kept: L,
        pressing: &Pressing<L>,
        step: Step,
    ) -> Shear<L> {
        let one = L::splat(1.0);
        let contact_radius = pressing.memory;
        let slip = touch.velocity.reject(touch.normal);
        let share = one + c[3] * (kept - one);
        let stretched =
            (spring.scale(share) + slip.scale(L::splat(step.stretch))).reject(touch.normal);
        let stiffness = c[0] * contact_radius;
        let damping = c[1] * (contact_radius / touch.inverse_mass).sqrt();
        let limit = c[2] * pressing.force.abs();
        let (resistance, left) = slide(stretched, slip, stiffness, damping, limit);
        Shear {
            force: -resistance,
            spring: left,
            stiffness,
            damping,
        }
    }

    fn stiffness(c: &[f64], overlap: f64, curvature: f64) -> f64 {
        c[0] * (overlap.max(0.0) / curvature).sqrt()
    }
}
