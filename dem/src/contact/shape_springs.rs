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
//! acts against ω on `i`, opposite on `j`. k_n, C_n, k_t and C_t are those of the normal and tangential
//! parts; over a Hertz contact k_n is the secant stiffness. Source: Thuillet 2019, Eq. 2.11–2.13 (after Zhang et al.
//! 2017). The limit acts as [`super::slider`] says; the source limits the spring only.

use super::composition::{Pressing, RollingPart, Shear, Turn, Wound};
use super::slider::{slide, slide_scalar};
use super::{Step, Tangential, Touch};
use crate::lanes::Lane;
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
    pub(super) fn coefficients(&self, tangential: &Tangential) -> [f64; 3] {
        let friction = match tangential {
            Tangential::Linear(spring) => spring.friction,
            Tangential::Mindlin(mindlin) => mindlin.friction,
            Tangential::None | Tangential::Jkr => 0.0,
        };
        [
            self.beta,
            self.rolling_friction,
            self.twisting_friction * friction,
        ]
    }

    /// k_R (N m/rad) over a normal stiffness (N/m) at a reduced radius (m).
    pub fn rolling_stiffness(&self, normal: f64, reduced_radius: f64) -> f64 {
        normal * (self.beta * reduced_radius).powi(2)
    }

    /// k_T (N m/rad) over a tangential stiffness (N/m) at a reduced radius (m).
    pub fn twisting_stiffness(&self, tangential: f64, reduced_radius: f64) -> f64 {
        2.0 * tangential * (self.beta * reduced_radius).powi(2)
    }
}

/// In the inner loop: β, μ_R, μ_T μ.
#[derive(Clone, Copy, Debug)]
pub struct Springs;

impl RollingPart for Springs {
    const COEFFICIENTS: usize = 3;
    const SPRING: bool = true;
    const TWISTS: bool = true;
    const STIFFENS: bool = true;
    const INERTIA: bool = false;

    #[inline(always)]
    fn turn<L: Lane>(
        c: &[L],
        touch: &Touch<L>,
        wound: &Wound<L>,
        pressing: &Pressing<L>,
        shear: &Shear<L>,
        step: Step,
    ) -> Turn<L> {
        let patch = c[0] / touch.curvature;
        let patch2 = patch * patch;
        let two = L::splat(2.0);
        let stretch = L::splat(step.stretch);
        let limit = patch * pressing.force.abs();

        let twist_rate = touch.spin.dot(touch.normal);
        let roll_rate = touch.spin - touch.normal.scale(twist_rate);
        let (rolling, rolled) = slide(
            (wound.rolled.scale(wound.kept) + roll_rate.scale(stretch)).reject(touch.normal),
            roll_rate,
            pressing.stiffness * patch2,
            pressing.damping * patch2,
            c[1] * limit,
        );
        let (twisting, twisted) = slide_scalar(
            wound.twisted * wound.kept + twist_rate * stretch,
            twist_rate,
            two * shear.stiffness * patch2,
            two * shear.damping * patch2,
            c[2] * limit,
        );
        Turn {
            moment: -(rolling + touch.normal.scale(twisting)),
            rolled,
            twisted,
        }
    }

    fn stiffness(c: &[f64], curvature: f64, normal: f64, tangential: f64) -> (f64, f64) {
        let patch2 = (c[0] / curvature).powi(2);
        (normal * patch2, 2.0 * tangential * patch2)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lanes::Vec3;

    /// Equal grains of radius 1 (R = 1/2), k_n 1000, k_t 2000/7, no dashpots, μ 0.5.
    fn moment(beta: f64, spin: [f64; 3], load: f64) -> Turn<f64> {
        let touch = Touch {
            normal: Vec3([0.0, 0.0, 1.0]),
            overlap: 1e-3,
            velocity: Vec3::zero(),
            spin: Vec3(spin),
            inverse_mass: 2.0,
            curvature: 2.0,
            inverse_inertia: 2.0,
        };
        let pressing = Pressing {
            force: load,
            stiffness: 1000.0,
            damping: 0.0,
            memory: 0.0,
        };
        let shear = Shear {
            force: Vec3::zero(),
            spring: Vec3::zero(),
            stiffness: 2000.0 / 7.0,
            damping: 0.0,
        };
        let c = [beta, 1.05, 1.3 * 0.5];
        let step = Step { stretch: 1e-3 };
        let slack = Wound {
            rolled: Vec3::zero(),
            twisted: 0.0,
            kept: 1.0,
        };
        Springs::turn(&c, &touch, &slack, &pressing, &shear, step)
    }

    #[test]
    fn stiffness_and_limits_are_those_of_the_thesis() {
        let beta = 0.4;
        let turn = moment(beta, [0.3, 0.0, 0.5], 1e9);
        let patch2 = (beta * 0.5_f64).powi(2);
        assert!((turn.moment.0[0] + 1000.0 * patch2 * 3e-4).abs() < 1e-15);
        assert!((turn.moment.0[2] + 2.0 * 2000.0 / 7.0 * patch2 * 5e-4).abs() < 1e-15);
        assert_eq!((turn.rolled.0[0], turn.twisted), (3e-4, 5e-4));

        let m = moment(beta, [1e6, 0.0, 1e6], 2.0).moment;
        assert!((m.0[0] + 1.05 * beta * 0.5 * 2.0).abs() < 1e-12);
        assert!(
            (m.0[2] + 1.3 * beta * 0.5 * 0.5 * 2.0).abs() < 1e-12,
            "μ stands in the twist"
        );
    }

    #[test]
    fn round_grains_roll_freely() {
        assert_eq!(moment(0.0, [3.0, 1.0, 2.0], 5.0).moment.norm(), 0.0);
    }
}
