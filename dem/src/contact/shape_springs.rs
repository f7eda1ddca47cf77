//! Rolling and twisting springs of angular grains, by one shape parameter β.
//!
//! Grains stay spheres; β is the size of their contact patch in units of the reduced radius
//! R = R_i R_j/(R_i + R_j).
//!
//! ```text
//! M_R = k_R δ_R + C_R ω_R,  |M_R| ≤ μ_R β R |F_n|        k_R = k_n (βR)²     C_R = C_n (βR)²
//! M_T = k_T δ_T + C_T ω_T,  |M_T| ≤ μ_T β R μ |F_n|      k_T = 2 k_t (βR)²   C_T = 2 C_t (βR)²
//! ```
//! ω_R, ω_T (rad/s) relative angular velocity in the contact plane and about its normal, δ their
//! integrals (rad); μ is the sliding coefficient, which stands in the twisting limit only. The moment
//! acts against ω on `i`, opposite on `j`. Source: Thuillet 2019, Eq. 2.11–2.13 (after Zhang et al.
//! 2017). The limit acts as [`super::slider`] says; the source limits the spring only.

use super::hooke::Hooke;
use super::slider::{slide, slide_scalar};
use super::tangential::TangentialSpring;
use super::{Step, Touch};
use crate::lanes::{Lane, Vec3};
use serde::{Deserialize, Serialize};

/// Angularity of grains.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct ShapeParameter {
    /// β: 0.2 "moderate friction", 1 "gravel-like".
    pub beta: f64,
    /// μ_R.
    pub rolling_friction: f64,
    /// μ_T.
    pub twisting_friction: f64,
}

impl ShapeParameter {
    pub(super) fn coefficients(
        &self,
        normal: &Hooke,
        tangential: &TangentialSpring,
    ) -> Coefficients {
        Coefficients {
            beta: self.beta,
            rolling_stiffness: normal.stiffness,
            rolling_damping: normal.damping_factor(),
            rolling_limit: self.rolling_friction,
            twisting_stiffness: 2.0 * tangential.stiffness(normal),
            twisting_damping: 2.0 * tangential.damping_factor(normal),
            twisting_limit: self.twisting_friction * tangential.friction,
        }
    }

    /// Rolling stiffness k_R (N m/rad) at a reduced radius (m).
    pub fn rolling_stiffness(&self, normal: &Hooke, reduced_radius: f64) -> f64 {
        normal.stiffness * (self.beta * reduced_radius).powi(2)
    }

    /// Twisting stiffness k_T (N m/rad) at a reduced radius (m).
    pub fn twisting_stiffness(
        &self,
        normal: &Hooke,
        tangential: &TangentialSpring,
        reduced_radius: f64,
    ) -> f64 {
        2.0 * tangential.stiffness(normal) * (self.beta * reduced_radius).powi(2)
    }
}

/// The law in the inner loop.
#[derive(Clone, Copy, Debug)]
pub struct Coefficients {
    beta: f64,
    rolling_stiffness: f64,
    rolling_damping: f64,
    rolling_limit: f64,
    twisting_stiffness: f64,
    twisting_damping: f64,
    twisting_limit: f64,
}

impl Coefficients {
    /// Moment on `i`, and the rolling and twisting displacements left.
    #[inline(always)]
    pub fn moment<L: Lane>(
        &self,
        touch: &Touch<L>,
        rolled: Vec3<L>,
        twisted: L,
        normal_force: L,
        step: Step,
    ) -> (Vec3<L>, Vec3<L>, L) {
        let patch = L::splat(self.beta) / touch.curvature;
        let patch2 = patch * patch;
        let inverse_root = L::splat(1.0) / touch.inverse_mass.sqrt();
        let stretch = L::splat(step.stretch);
        let limit = patch * normal_force;

        let twist_rate = touch.spin.dot(touch.normal);
        let roll_rate = touch.spin - touch.normal.scale(twist_rate);
        let (rolling, rolled) = slide(
            (rolled + roll_rate.scale(stretch)).reject(touch.normal),
            roll_rate,
            L::splat(self.rolling_stiffness) * patch2,
            L::splat(self.rolling_damping) * inverse_root * patch2,
            L::splat(self.rolling_limit) * limit,
        );
        let (twisting, twisted) = slide_scalar(
            twisted + twist_rate * stretch,
            twist_rate,
            L::splat(self.twisting_stiffness) * patch2,
            L::splat(self.twisting_damping) * inverse_root * patch2,
            L::splat(self.twisting_limit) * limit,
        );
        let moment = -(rolling + touch.normal.scale(twisting));
        (moment, rolled, twisted)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Equal grains of radius 1 (R = 1/2), k_n 1000, k_t 2000/7, no dashpots.
    fn springs(beta: f64) -> Coefficients {
        let normal = Hooke {
            stiffness: 1000.0,
            restitution: 1.0,
        };
        let tangential = TangentialSpring {
            stiffness_ratio: 2.0 / 7.0,
            restitution: 1.0,
            friction: 0.5,
        };
        ShapeParameter {
            beta,
            rolling_friction: 1.05,
            twisting_friction: 1.3,
        }
        .coefficients(&normal, &tangential)
    }

    fn touch(spin: [f64; 3]) -> Touch<f64> {
        Touch {
            normal: Vec3([0.0, 0.0, 1.0]),
            overlap: 1e-3,
            velocity: Vec3::zero(),
            spin: Vec3(spin),
            inverse_mass: 2.0,
            curvature: 2.0,
        }
    }

    const STEP: Step = Step { stretch: 1e-3 };

    #[test]
    fn stiffness_and_limits_are_those_of_the_thesis() {
        let beta = 0.4;
        let (m, rolled, twisted) =
            springs(beta).moment(&touch([0.3, 0.0, 0.5]), Vec3::zero(), 0.0, 1e9, STEP);
        let patch2 = (beta * 0.5_f64).powi(2);
        assert!((m.0[0] + 1000.0 * patch2 * 3e-4).abs() < 1e-15);
        assert!((m.0[2] + 2.0 * 2000.0 / 7.0 * patch2 * 5e-4).abs() < 1e-15);
        assert_eq!((rolled.0[0], twisted), (3e-4, 5e-4));

        let (m, ..) = springs(beta).moment(&touch([1e6, 0.0, 1e6]), Vec3::zero(), 0.0, 2.0, STEP);
        assert!((m.0[0] + 1.05 * beta * 0.5 * 2.0).abs() < 1e-12);
        assert!(
            (m.0[2] + 1.3 * beta * 0.5 * 0.5 * 2.0).abs() < 1e-12,
            "μ stands in the twist"
        );
    }

    #[test]
    fn round_grains_roll_freely() {
        let (m, ..) = springs(0.0).moment(&touch([3.0, 1.0, 2.0]), Vec3::zero(), 0.0, 5.0, STEP);
        assert_eq!(m.norm(), 0.0);
    }
}
