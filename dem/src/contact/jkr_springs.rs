//! Sliding, rolling and twisting of adhesive contacts.
//!
//! ```text
//! sliding   F = k_s s,  k_s = 8 a_0 G*          yields at s = (2 - ν) a_0/(16 π)
//! rolling   M = k_r R ξ, k_r = 4 F_c/R = 12πγ    yields at ξ = ξ_crit,   ξ = R · rolled angle
//! twisting  M = k_t φ,  k_t = 16 G a_0³/3       yields at φ = 1/(16 π)
//! ```
//! a_0 (m) contact radius without force, γ (J/m²), F_c = 3πγR (N), 1/R = 1/R_i + 1/R_j,
//! `1/G* = (2 - ν_i)/G_i + (2 - ν_j)/G_j`, 1/G = 1/G_i + 1/G_j (Pa). The springs yield plastically: they
//! keep their critical displacement, whatever the load, also in tension.
//! Source: Dominik & Tielens 1997 and Wada et al. 2007, as used by Tatsuuma et al. 2019.

use super::composition::{Pressing, RollingPart, Shear, TangentialPart, Turn, Wound};
use super::jkr::Jkr;
use super::slider::{slide, slide_scalar};
use super::{Step, Touch};
use crate::lanes::{Lane, Vec3};
use std::f64::consts::PI;

impl Jkr {
    /// k_s (N/m).
    pub fn sliding_stiffness(&self, reduced_radius: f64) -> f64 {
        let shear = self.elasticity.effective_shear(&self.elasticity);
        8.0 * shear * self.equilibrium_radius(reduced_radius)
    }

    /// Displacement at which sliding yields (m).
    pub fn critical_sliding(&self, reduced_radius: f64) -> f64 {
        self.slip_ratio() * self.equilibrium_radius(reduced_radius)
    }

    /// k_r R² (N m/rad).
    pub fn rolling_stiffness(&self, reduced_radius: f64) -> f64 {
        12.0 * PI * self.surface_energy * reduced_radius * reduced_radius
    }

    /// k_t (N m/rad).
    pub fn twisting_stiffness(&self, reduced_radius: f64) -> f64 {
        let shear = 0.5 * self.elasticity.shear_modulus();
        16.0 / 3.0 * shear * self.equilibrium_radius(reduced_radius).powi(3)
    }

    /// Critical displacement of sliding over a_0.
    fn slip_ratio(&self) -> f64 {
        (2.0 - self.elasticity.poissons_ratio) / (16.0 * PI)
    }

    pub(super) fn sliding_coefficients(&self) -> [f64; 3] {
        // a_0 = (9πγR²/E*)^{1/3}: the cube root of a factor times the square of what a contact remembers.
        let shear = self.elasticity.effective_shear(&self.elasticity);
        [
            self.cube_of_equilibrium().cbrt(),
            8.0 * shear,
            self.slip_ratio(),
        ]
    }

    pub(super) fn rolling_coefficients(&self) -> [f64; 3] {
        [
            12.0 * PI * self.surface_energy,
            self.critical_rolling,
            8.0 / 3.0 * self.elasticity.shear_modulus() * self.cube_of_equilibrium(),
        ]
    }

    /// a_0³/R² = 9πγ/E* (m).
    fn cube_of_equilibrium(&self) -> f64 {
        9.0 * PI * self.surface_energy / self.effective_modulus()
    }
}

/// Angle at which twisting yields (rad).
const CRITICAL_TWIST: f64 = 1.0 / (16.0 * PI);

/// In the inner loop: a_0/R^{2/3}, 8 G*, critical slip over a_0.
#[derive(Clone, Copy, Debug)]
pub struct Slides;

impl TangentialPart for Slides {
    const COEFFICIENTS: usize = 3;
    const SPRING: bool = true;
    const STIFFENS: bool = false;

    #[inline(always)]
    fn shear<L: Lane>(
        c: &[L],
        touch: &Touch<L>,
        spring: Vec3<L>,
        _: L,
        pressing: &Pressing<L>,
        step: Step,
    ) -> Shear<L> {
        let zero = L::splat(0.0);
        let contact_radius = c[0] * pressing.memory * pressing.memory;
        let stiffness = c[1] * contact_radius;
        let slip = touch.velocity.reject(touch.normal);
        let stretched = (spring + slip.scale(L::splat(step.stretch))).reject(touch.normal);
        let limit = stiffness * c[2] * contact_radius;
        let (resistance, left) = slide(stretched, slip, stiffness, zero, limit);
        Shear {
            force: -resistance,
            spring: left,
            stiffness,
            damping: zero,
        }
    }

    fn stiffness(c: &[f64], _: f64, curvature: f64) -> f64 {
        c[1] * c[0] * (1.0 / curvature).cbrt().powi(2)
    }
}

/// In the inner loop: 12πγ, ξ_crit, k_t/R².
#[derive(Clone, Copy, Debug)]
pub struct Rolls;

impl RollingPart for Rolls {
    const COEFFICIENTS: usize = 3;
    const SPRING: bool = true;
    const TWISTS: bool = true;
    const STIFFENS: bool = false;
    const INERTIA: bool = false;

    #[inline(always)]
    fn turn<L: Lane>(
        c: &[L],
        touch: &Touch<L>,
        wound: &Wound<L>,
        pressing: &Pressing<L>,
        _: &Shear<L>,
        step: Step,
    ) -> Turn<L> {
        let zero = L::splat(0.0);
        let radius = pressing.memory * pressing.memory * pressing.memory;
        let stretch = L::splat(step.stretch);
        let twist_rate = touch.spin.dot(touch.normal);
        let roll_rate = touch.spin - touch.normal.scale(twist_rate);
        let rolling_stiffness = c[0] * radius * radius;
        let twisting_stiffness = c[2] * radius * radius;
        let (rolling, rolled) = slide(
            (wound.rolled + roll_rate.scale(stretch)).reject(touch.normal),
            roll_rate,
            rolling_stiffness,
            zero,
            c[0] * radius * c[1],
        );
        let (twisting, twisted) = slide_scalar(
            wound.twisted + twist_rate * stretch,
            twist_rate,
            twisting_stiffness,
            zero,
            twisting_stiffness * L::splat(CRITICAL_TWIST),
        );
        Turn {
            moment: -(rolling + touch.normal.scale(twisting)),
            rolled,
            twisted,
        }
    }

    fn stiffness(c: &[f64], curvature: f64, _: f64, _: f64) -> (f64, f64) {
        let r2 = 1.0 / (curvature * curvature);
        (c[0] * r2, c[2] * r2)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::contact::Elasticity;

    #[test]
    fn inner_loop_and_formulas_agree() {
        let jkr = Jkr {
            surface_energy: 0.1,
            elasticity: Elasticity {
                youngs_modulus: 7e9,
                poissons_ratio: 0.25,
            },
            damping_rate: 0.0,
            critical_rolling: 8e-10,
        };
        let r = 0.5e-7;
        let close = |a: f64, b: f64| assert!((a / b - 1.0).abs() < 1e-12, "{a} {b}");
        let s = jkr.sliding_coefficients();
        close(
            Slides::stiffness(&s, 0.0, 1.0 / r),
            jkr.sliding_stiffness(r),
        );
        let (k_r, k_t) = Rolls::stiffness(&jkr.rolling_coefficients(), 1.0 / r, 0.0, 0.0);
        close(k_r, jkr.rolling_stiffness(r));
        close(k_t, jkr.twisting_stiffness(r));
        // Relative angle π at the limit costs E_roll.
        let limit = k_r / r * jkr.critical_rolling;
        close(limit * PI, jkr.rolling_energy(r));
    }
}
