//! Tangential spring with history, dashpot and Coulomb friction.
//!
//! ```text
//! F_t = -( k_t S + C_t u_t ),   |F_t| ≤ μ |F_n|
//! k_t = ratio · k_n,   C_t = -2 ln ε_t √( k_t m / (π² + ln² ε_t) )
//! S  += u_t dt, kept in the contact plane
//! ```
//! S (m) displacement of the surfaces from where they stuck, u_t (m/s) slip velocity, μ (–), ε_t (–)
//! only a way to name C_t (1 = no dashpot), m the reduced mass. Source: Thuillet 2019, Eq. 2.2, 2.4,
//! 2.5, 2.10. The limit acts as [`super::slider`] says.

use super::hooke::{Hooke, damping_factor};
use super::slider::slide;
use super::{Step, Touch};
use crate::lanes::{Lane, Vec3};
use serde::{Deserialize, Serialize};

/// Tangential spring, dashpot and Coulomb slider.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct TangentialSpring {
    /// k_t/k_n; 2/7 gives the tangential oscillation the normal one's period.
    pub stiffness_ratio: f64,
    /// ε_t, in (0, 1]; 1 = no dashpot.
    pub restitution: f64,
    /// Coulomb coefficient μ.
    pub friction: f64,
}

impl TangentialSpring {
    /// k_t (N/m) over a normal spring.
    pub fn stiffness(&self, normal: &Hooke) -> f64 {
        self.stiffness_ratio * normal.stiffness
    }

    /// `C_t / √m` (N s m⁻¹ kg⁻¹ᐟ²) over a normal spring.
    pub fn damping_factor(&self, normal: &Hooke) -> f64 {
        damping_factor(self.stiffness(normal), self.restitution)
    }

    pub(super) fn coefficients(&self, normal: &Hooke) -> Coefficients {
        Coefficients {
            stiffness: self.stiffness(normal),
            damping_factor: self.damping_factor(normal),
            friction: self.friction,
        }
    }
}

/// The law in the inner loop.
#[derive(Clone, Copy, Debug)]
pub struct Coefficients {
    stiffness: f64,
    damping_factor: f64,
    friction: f64,
}

impl Coefficients {
    /// Force on `i` and the spring's new displacement.
    #[inline(always)]
    pub fn force<L: Lane>(
        &self,
        touch: &Touch<L>,
        spring: Vec3<L>,
        normal_force: L,
        step: Step,
    ) -> (Vec3<L>, Vec3<L>) {
        let slip = touch.velocity.reject(touch.normal);
        let stretched = (spring + slip.scale(L::splat(step.stretch))).reject(touch.normal);
        let damping = L::splat(self.damping_factor) / touch.inverse_mass.sqrt();
        let (resistance, left) = slide(
            stretched,
            slip,
            L::splat(self.stiffness),
            damping,
            L::splat(self.friction) * normal_force,
        );
        (-resistance, left)
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
        }
    }

    fn spring(friction: f64) -> Coefficients {
        let normal = Hooke {
            stiffness: 700.0,
            restitution: 0.5,
        };
        TangentialSpring {
            stiffness_ratio: 2.0 / 7.0,
            restitution: 1.0,
            friction,
        }
        .coefficients(&normal)
    }

    #[test]
    fn opposes_slip_and_stops_at_coulomb() {
        let step = Step { stretch: 1e-3 };
        let (f, s) = spring(10.0).force(&touch([1.0, 0.0, -5.0]), Vec3::zero(), 1.0, step);
        assert!(
            (f.0[0] + 200.0 * 1e-3).abs() < 1e-15,
            "k_t S = 0.2 N against the slip"
        );
        assert_eq!((f.0[2], s.0[2]), (0.0, 0.0));
        let (f, s) = spring(0.1).force(&touch([1.0, 0.0, 0.0]), Vec3::zero(), 1.0, step);
        assert!((f.0[0] + 0.1).abs() < 1e-15);
        assert!(
            (s.0[0] - 0.1 / 200.0).abs() < 1e-15,
            "the spring keeps what friction can hold"
        );
    }

    #[test]
    fn no_time_no_stretch() {
        let step = Step { stretch: 0.0 };
        let (_, s) = spring(1.0).force(&touch([1.0, 0.0, 0.0]), Vec3::zero(), 1.0, step);
        assert_eq!(s.0, [0.0; 3]);
    }
}
