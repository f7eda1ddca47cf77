//! Linear normal spring with a dashpot matched to the restitution.
//!
//! ```text
//! F_n = k_n x + C_n v            v = approach speed, x = overlap, F_n > 0 pushes apart
//! C_n = -2 ln ε_n √( k_n m / (π² + ln² ε_n) )             m = m_i m_j/(m_i + m_j)
//! τ   = √( m (π² + ln² ε_n) / k_n )                        duration of a contact
//! ```
//! k_n (N/m) stiffness, ε_n (–) ratio of separation to approach speed, C_n (N s/m).
//! Source: Thuillet 2019, Eq. 2.1, 2.3, 2.8, 2.9; τ from its Eq. SM 17–19. The force is not clamped
//! in the last moments of a contact, where the dashpot outweighs the spring and pulls: ε_n and τ
//! above belong to the unclamped law.
//!
//! **Steps of finite length.** The leap-frog step takes the dashpot's velocity half a step back and
//! counts whole steps only, although a contact begins and ends within one: at N steps a contact the
//! restitution is off by up to 0.4/N (ε_n = 0.5), first order, as in other codes that use this scheme.
//! Scaling both terms to the step, `(1 - e^{-y})/y` with y = C_n dt/m, would make it second order but
//! soften resting contacts by y/2; it is not done.

use crate::lanes::Lane;
use serde::{Deserialize, Serialize};
use std::f64::consts::PI;

/// Linear normal spring and dashpot.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Hooke {
    /// k_n (N/m).
    pub stiffness: f64,
    /// ε_n, in (0, 1].
    pub restitution: f64,
}

impl Hooke {
    /// `C_n / √m` (N s m⁻¹ kg⁻¹ᐟ²).
    pub fn damping_factor(&self) -> f64 {
        damping_factor(self.stiffness, self.restitution)
    }

    /// Duration of an isolated contact, τ (s), at a reduced mass (kg).
    pub fn contact_time(&self, reduced_mass: f64) -> f64 {
        let ln = self.restitution.ln();
        (reduced_mass * (PI * PI + ln * ln) / self.stiffness).sqrt()
    }

    pub(super) fn coefficients(&self) -> Coefficients {
        Coefficients {
            stiffness: self.stiffness,
            damping_factor: self.damping_factor(),
        }
    }
}

/// `-2 ln ε √(k/(π² + ln² ε))`: times √m it is the dashpot coefficient of a spring k.
pub(super) fn damping_factor(stiffness: f64, restitution: f64) -> f64 {
    let ln = restitution.ln();
    -2.0 * ln * (stiffness / (PI * PI + ln * ln)).sqrt()
}

/// The law in the inner loop.
#[derive(Clone, Copy, Debug)]
pub struct Coefficients {
    stiffness: f64,
    damping_factor: f64,
}

impl Coefficients {
    /// Normal force, positive when it pushes apart (N).
    #[inline(always)]
    pub fn force<L: Lane>(&self, overlap: L, approach: L, inverse_mass: L) -> L {
        let damping = L::splat(self.damping_factor) / inverse_mass.sqrt();
        L::splat(self.stiffness) * overlap + damping * approach
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Head-on impact of a unit reduced mass, leap-frog, phase of first touch `offset` of a step:
    /// restitution and duration.
    fn impact(law: Hooke, steps_per_contact: f64, offset: f64) -> (f64, f64) {
        let dt = law.contact_time(1.0) / steps_per_contact;
        let c = law.coefficients();
        let (mut gap, mut v, mut touching) = (offset * dt, -1.0, 0.0);
        loop {
            if gap < 0.0 {
                v += dt * c.force(-gap, -v, 1.0);
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
                let (out, time) = impact(law, 2000.0, offset);
                assert!((out - e).abs() < 1e-3, "e {e}: {out}");
                assert!((time / law.contact_time(1.0) - 1.0).abs() < 2e-3);
            }
        }
    }

    #[test]
    fn the_step_s_error_is_first_order_and_as_stated() {
        let law = Hooke {
            stiffness: 1.0,
            restitution: 0.5,
        };
        let worst = |steps: f64| {
            (0..50)
                .map(|k| (impact(law, steps, (k as f64 + 0.5) / 50.0).0 - 0.5).abs())
                .fold(0.0, f64::max)
        };
        let order = (worst(30.0) / worst(240.0)).log(8.0);
        assert!((0.9..1.1).contains(&order), "{order}");
        assert!(worst(30.0) < 0.4 / 30.0);
    }
}
