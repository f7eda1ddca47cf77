//! Rolling resistance by an elastic–plastic spring and a dashpot (EPSD, model C of Ai et al. 2011).
//!
//! ```text
//! M   = -( k_r θ + C_r ω_r ),   |M| ≤ μ_r R |F_n|
//! k_r = 2.25 k_n μ_r² R²,       1/R = 1/R_i + 1/R_j
//! C_r = 2 η_r √k_r [ 1/(I_i + m_i R_i²) + 1/(I_j + m_j R_j²) ]^{-1/2}
//! ```
//! θ (rad) rolling displacement, ω_r (rad/s) relative angular velocity in the contact plane, μ_r, η_r
//! (–), k_n (N/m) secant stiffness of the normal spring. Source: Kappel et al. 2020, Eq. 13–19. There
//! the dashpot is switched off while the spring slips; here both are limited together
//! ([`super::slider`]), which takes the switch's jump away and cannot exceed the limit either.

use super::composition::{Pressing, RollingPart, Shear, Turn, Wound};
use super::slider::slide;
use super::{Step, Touch};
use crate::lanes::Lane;
use serde::{Deserialize, Serialize};

/// Elastic–plastic rolling resistance.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Epsd {
    /// μ_r.
    pub rolling_friction: f64,
    /// η_r: 1 is critical damping.
    pub damping_ratio: f64,
}

impl Epsd {
    /// k_r (N m/rad) over a secant normal stiffness (N/m) at a reduced radius (m).
    pub fn stiffness(&self, normal: f64, reduced_radius: f64) -> f64 {
        2.25 * normal * (self.rolling_friction * reduced_radius).powi(2)
    }

    /// C_r (N m s/rad) beside a spring k_r (N m/rad), at `1/(m_i R_i²) + 1/(m_j R_j²)` (kg⁻¹ m⁻²).
    pub(super) fn coefficient(&self, stiffness: f64, inverse_inertia: f64) -> f64 {
        2.0 * self.damping_ratio * (stiffness * ABOUT_THE_CONTACT / inverse_inertia).sqrt()
    }

    pub(super) fn coefficients(&self) -> [f64; 2] {
        [self.rolling_friction, self.damping_ratio]
    }
}

/// In the inner loop: μ_r, η_r.
#[derive(Clone, Copy, Debug)]
pub struct Rolls;

/// `I + m R²` of a sphere is this times `m R²`.
const ABOUT_THE_CONTACT: f64 = 1.4;

impl RollingPart for Rolls {
    const COEFFICIENTS: usize = 2;
    const SPRING: bool = true;
    const TWISTS: bool = false;
    const STIFFENS: bool = true;
    const INERTIA: bool = true;

    #[inline(always)]
    fn turn<L: Lane>(
        c: &[L],
        touch: &Touch<L>,
        wound: &Wound<L>,
        pressing: &Pressing<L>,
        _: &Shear<L>,
        step: Step,
    ) -> Turn<L> {
        let arm = c[0] / touch.curvature;
        let stiffness = L::splat(2.25) * pressing.stiffness * arm * arm;
        let inertia = L::splat(ABOUT_THE_CONTACT) / touch.inverse_inertia;
        let damping = L::splat(2.0) * c[1] * (stiffness * inertia).sqrt();
        let rate = touch.spin.reject(touch.normal);
        let stretched = (wound.rolled.scale(wound.kept) + rate.scale(L::splat(step.stretch)))
            .reject(touch.normal);
        let limit = arm * pressing.force.abs();
        let (resistance, rolled) = slide(stretched, rate, stiffness, damping, limit);
        Turn {
            moment: -resistance,
            rolled,
            twisted: wound.twisted,
        }
    }

    fn stiffness(c: &[f64], curvature: f64, normal: f64, _: f64) -> (f64, f64) {
        (2.25 * normal * (c[0] / curvature).powi(2), 0.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lanes::Vec3;

    #[test]
    fn stiffness_damping_and_limit_are_those_of_the_paper() {
        // A sphere (m 1 kg, R 0.5 m) on a wall, k_n 1000 N/m, F_n 2 N, μ_r 0.2, η_r 0.3.
        let touch = |spin: f64| Touch {
            normal: Vec3([0.0, 0.0, 1.0]),
            overlap: 2e-3,
            velocity: Vec3::zero(),
            spin: Vec3([spin, 0.0, 7.0]),
            inverse_mass: 1.0,
            curvature: 2.0,
            inverse_inertia: 4.0,
        };
        let pressing = Pressing {
            force: 2.0,
            stiffness: 1000.0,
            damping: 0.0,
            memory: 0.0,
        };
        let shear = Shear {
            force: Vec3::zero(),
            spring: Vec3::zero(),
            stiffness: 0.0,
            damping: 0.0,
        };
        let step = Step { stretch: 1e-3 };
        let c = [0.2, 0.3];
        let slack = Wound {
            rolled: Vec3::zero(),
            twisted: 0.0,
            kept: 1.0,
        };
        let turn = |spin| Rolls::turn(&c, &touch(spin), &slack, &pressing, &shear, step);
        let k = 2.25 * 1000.0 * 0.01;
        let damping: f64 = 2.0 * 0.3 * f64::sqrt(k * (0.4 + 1.0) * 0.25);
        let slow = turn(1e-4);
        assert!((slow.moment.0[0] + 1e-4 * (k * 1e-3 + damping)).abs() < 1e-15);
        assert_eq!(slow.moment.0[2], 0.0, "twisting is free");
        assert!((turn(1e5).moment.0[0] + 0.2 * 0.5 * 2.0).abs() < 1e-12);
    }
}
