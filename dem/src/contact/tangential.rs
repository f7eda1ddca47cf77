//! Tangential spring with history, dashpot and Coulomb friction.
//!
//! ```text
//! F_t = -( k_t S + C_t u_t ),   |F_t| ≤ μ |F_n|
//! k_t = ratio · k_n, or κ of its own;   C_t = -2 ln ε_t √( k_t m / (π² + ln² ε_t) )
//! S  += u_t dt, kept in the contact plane
//! ```
//! S (m) displacement of the surfaces from where they stuck, u_t (m/s) slip velocity, μ (–), ε_t (–)
//! only a way to name C_t (1 = no dashpot), m the reduced mass. Source: Thuillet 2019, Eq. 2.2, 2.4,
//! 2.5, 2.10; κ: Tancredi et al. 2012. The limit acts as [`super::slider`] says.

use super::composition::{Pressing, Shear, TangentialPart};
use super::hooke::{Damping, Hooke};
use super::slider::slide;
use super::{Normal, Step, Touch};
use crate::lanes::{Lane, Vec3};
use serde::{Deserialize, Serialize};

/// How stiff a tangential spring is.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum SpringStiffness {
    /// k_t/k_n; 2/7 gives the tangential oscillation the normal one's period.
    Ratio(f64),
    /// κ (N/m).
    Absolute(f64),
}

/// Tangential spring, dashpot and Coulomb slider.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct TangentialSpring {
    /// k_t.
    pub stiffness: SpringStiffness,
    /// Its dashpot.
    pub damping: Damping,
    /// Coulomb coefficient μ.
    pub friction: f64,
}

impl TangentialSpring {
    /// A spring in proportion to the normal one, its dashpot named by ε_t.
    pub fn matched(ratio: f64, restitution: f64, friction: f64) -> TangentialSpring {
        TangentialSpring {
            stiffness: SpringStiffness::Ratio(ratio),
            damping: Damping::Restitution(restitution),
            friction,
        }
    }

    /// k_t (N/m) over a normal stiffness (N/m).
    pub fn stiffness(&self, normal: f64) -> f64 {
        match self.stiffness {
            SpringStiffness::Ratio(ratio) => ratio * normal,
            SpringStiffness::Absolute(stiffness) => stiffness,
        }
    }

    pub(super) fn coefficients(&self, normal: &Normal) -> [f64; 4] {
        let normal = match normal {
            Normal::Hooke(Hooke { stiffness, .. }) => *stiffness,
            // Refused with a ratio by the composition: an elastic contact has no one k_n.
            _ => f64::NAN,
        };
        let stiffness = self.stiffness(normal);
        let [root, linear] = self.damping.factors(stiffness);
        [stiffness, root, linear, self.friction]
    }
}

/// In the inner loop: k_t, factors of √m and m in the dashpot, μ.
#[derive(Clone, Copy, Debug)]
pub struct Linear;

impl TangentialPart for Linear {
    const COEFFICIENTS: usize = 4;
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
        let slip = touch.velocity.reject(touch.normal);
        let stretched = (spring + slip.scale(L::splat(step.stretch))).reject(touch.normal);
        let mass = L::splat(1.0) / touch.inverse_mass;
        let damping = c[1] * mass.sqrt() + c[2] * mass;
        let limit = c[3] * pressing.force.abs();
        let (resistance, left) = slide(stretched, slip, c[0], damping, limit);
        Shear {
            force: -resistance,
            spring: left,
            stiffness: c[0],
            damping,
        }
    }

    fn stiffness(c: &[f64], _: f64, _: f64) -> f64 {
        c[0]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn touch(velocity: [f64; 3]) -> Touch<f64> {
        Touch {
            normal: Vec3([0.0, 0.0, 1.0]),
            overlap: 1e-3,
            velocity: Vec3(velocity),
            spin: Vec3::zero(),
            inverse_mass: 2.0,
            curvature: 2.0,
            inverse_inertia: 2.0,
        }
    }

    fn shear(friction: f64, velocity: [f64; 3], load: f64, stretch: f64) -> ([f64; 3], [f64; 3]) {
        let spring = TangentialSpring::matched(2.0 / 7.0, 1.0, friction);
        let normal = Normal::Hooke(Hooke::matched(700.0, 0.5));
        let pressing = Pressing {
            force: load,
            stiffness: 700.0,
            damping: 0.0,
            memory: 0.0,
        };
        let c = spring.coefficients(&normal);
        let step = Step { stretch };
        let out = Linear::shear(&c, &touch(velocity), Vec3::zero(), 1.0, &pressing, step);
        (out.force.0, out.spring.0)
    }

    #[test]
    fn opposes_slip_and_stops_at_coulomb() {
        let (f, s) = shear(10.0, [1.0, 0.0, -5.0], 1.0, 1e-3);
        assert!(
            (f[0] + 200.0 * 1e-3).abs() < 1e-15,
            "k_t S = 0.2 N against the slip"
        );
        assert_eq!((f[2], s[2]), (0.0, 0.0));
        let (f, s) = shear(0.1, [1.0, 0.0, 0.0], 1.0, 1e-3);
        assert!((f[0] + 0.1).abs() < 1e-15);
        assert!(
            (s[0] - 0.1 / 200.0).abs() < 1e-15,
            "the spring keeps what friction can hold"
        );
    }

    #[test]
    fn no_time_no_stretch() {
        let (_, s) = shear(1.0, [1.0, 0.0, 0.0], 1.0, 0.0);
        assert_eq!(s, [0.0; 3]);
    }
}
