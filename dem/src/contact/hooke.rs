//! Linear normal spring with a dashpot matched to the restitution.
//!
//! ```text
//! F_n = k_n x + C_n v            v = approach speed, x = overlap, F_n > 0 pushes apart
//! C_n = -2 ln ε_n √( k_n m / (π² + ln² ε_n) )             m = m_i m_j/(m_i + m_j)
//! τ   = √( m (π² + ln² ε_n) / k_n )                        duration of a contact
//! ```
//! k_n [N/m] stiffness, ε_n [–] ratio of separation to approach speed, C_n [N s/m].
//! Source: Thuillet 2019, Eq. 2.1, 2.3, 2.8, 2.9; τ from its Eq. SM 17–19. The force is not clamped
//! in the last moments of a contact, where the dashpot outweighs the spring and pulls: ε_n and τ
//! above belong to the unclamped law.
//!
//! **Steps of finite length.** A leap-frog step applies the dashpot with the velocity half a step
//! old, and over whole steps only, although a contact begins and ends within one. Two corrections
//! make the restitution second order in the step (`Fitted`):
//! * the amplitude of the free oscillation shrinks by exactly `exp(-C dt/2m)` a step when the
//!   coefficient is multiplied by `(1 - e^{-y})/y`, y = C_n dt/m;
//! * where the overlap is less than one step's travel, the dashpot counts for the part of the
//!   neighbouring steps in which the surfaces touch, `1/2 + x/(|v| dt)`.

use super::Step;
use crate::lanes::Lane;
use serde::{Deserialize, Serialize};
use std::f64::consts::PI;

/// Linear normal spring and dashpot.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Hooke {
    /// k_n [N/m].
    pub stiffness: f64,
    /// ε_n, in (0, 1].
    pub restitution: f64,
}

impl Hooke {
    /// `C_n / √m` [N s m⁻¹ kg⁻¹ᐟ²].
    pub fn damping_factor(&self) -> f64 {
        damping_factor(self.stiffness, self.restitution)
    }

    /// Duration of an isolated contact, τ [s], at a reduced mass [kg].
    pub fn contact_time(&self, reduced_mass: f64) -> f64 {
        let ln = self.restitution.ln();
        (reduced_mass * (PI * PI + ln * ln) / self.stiffness).sqrt()
    }

    pub(super) fn coefficients(&self, fitted: bool) -> Coefficients {
        Coefficients {
            stiffness: self.stiffness,
            damping_factor: self.damping_factor(),
            fitted,
        }
    }
}

/// `-2 ln ε √(k/(π² + ln² ε))`: times √m it is the dashpot coefficient of a spring k.
pub(super) fn damping_factor(stiffness: f64, restitution: f64) -> f64 {
    let ln = restitution.ln();
    -2.0 * ln * (stiffness / (PI * PI + ln * ln)).sqrt()
}

/// `(1 - e^{-y})/y` to 1e-4 for y ≤ 0.5, and between 0 and 1 for every y > 0.
#[inline(always)]
pub(super) fn fitted_to_step<L: Lane>(y: L) -> L {
    let one = L::splat(1.0);
    // y/(1 - e^{-y}) = 1 + y/2 + y²/12 - …: its reciprocal stays positive for any step.
    one / (one + y * (L::splat(0.5) + y * L::splat(1.0 / 12.0)))
}

/// The law in the inner loop.
#[derive(Clone, Copy, Debug)]
pub struct Coefficients {
    stiffness: f64,
    damping_factor: f64,
    fitted: bool,
}

impl Coefficients {
    /// Normal force, positive when it pushes apart [N].
    #[inline(always)]
    pub fn force<L: Lane>(&self, overlap: L, approach: L, inverse_mass: L, step: Step) -> L {
        let one = L::splat(1.0);
        // C/m = factor/√m, since C = factor·√m.
        let root = inverse_mass.sqrt();
        let mut damping = L::splat(self.damping_factor) / root;
        if self.fitted {
            let dt = L::splat(step.length);
            let y = L::splat(self.damping_factor) * root * dt;
            let travel = approach.abs() * dt;
            let part = L::select(
                overlap.less(travel),
                L::splat(0.5) + overlap / travel,
                one,
            );
            damping = damping * fitted_to_step(y) * part;
        }
        L::splat(self.stiffness) * overlap + damping * approach
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Head-on impact of a unit reduced mass, leap-frog, phase of first touch `offset` of a step.
    fn restitution(law: Hooke, steps_per_contact: f64, offset: f64, fitted: bool) -> (f64, f64) {
        let dt = law.contact_time(1.0) / steps_per_contact;
        let step = Step {
            length: dt,
            stretch: dt,
        };
        let c = law.coefficients(fitted);
        let (mut gap, mut v) = (offset * dt, -1.0);
        let mut touching = 0.0;
        loop {
            if gap < 0.0 {
                v += dt * c.force(-gap, -v, 1.0, step);
                touching += dt;
            } else if v > 0.0 {
                return (v, touching);
            }
            gap += dt * v;
        }
    }

    #[test]
    fn restitution_and_contact_time_are_those_asked_for() {
        for e in [0.1, 0.5, 0.9, 1.0] {
            let law = Hooke {
                stiffness: 3e4,
                restitution: e,
            };
            for offset in [0.01, 0.37, 0.99] {
                let (out, time) = restitution(law, 1000.0, offset, true);
                assert!((out - e).abs() < 1e-4, "e {e}: {out}");
                assert!((time / law.contact_time(1.0) - 1.0).abs() < 2e-3);
            }
        }
    }

    /// Worst error of the restitution over the phase of first touch.
    fn worst(steps: f64, fitted: bool) -> f64 {
        let law = Hooke {
            stiffness: 1.0,
            restitution: 0.5,
        };
        (0..50)
            .map(|k| (restitution(law, steps, (k as f64 + 0.5) / 50.0, fitted).0 - 0.5).abs())
            .fold(0.0, f64::max)
    }

    #[test]
    fn fitted_dashpot_is_second_order_and_the_plain_one_first() {
        let fitted = (worst(30.0, true) / worst(120.0, true)).log(4.0);
        let plain = (worst(30.0, false) / worst(120.0, false)).log(4.0);
        assert!(fitted > 1.7, "fitted {fitted}, error {:e}", worst(30.0, true));
        assert!((0.7..1.4).contains(&plain), "plain {plain}");
        // At the usual 30 steps a contact.
        assert!(worst(30.0, true) < 3e-3, "{:e}", worst(30.0, true));
        assert!(worst(30.0, false) > 1e-2, "{:e}", worst(30.0, false));
    }

    #[test]
    fn step_factor_is_the_exponential_mean() {
        for y in [1e-3_f64, 0.05, 0.2, 0.5] {
            let exact = (1.0 - (-y).exp()) / y;
            assert!((fitted_to_step(y) - exact).abs() < 1e-4);
        }
        assert!(fitted_to_step(50.0) > 0.0);
    }
}
