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
//! above belong to the unclamped law. Instead of a restitution, a dashpot in proportion to the reduced
//! mass, `C_n = γ m`, may be named: that of LAMMPS' `gran/hooke` styles.
//!
//! **Steps of finite length.** The leap-frog step takes the dashpot's velocity half a step back and
//! counts whole steps only, although a contact begins and ends within one: at N steps a contact the
//! restitution is off by up to 0.4/N (ε_n = 0.5), first order, as in other codes that use this scheme.
//! Scaling both terms to the step, `(1 - e^{-y})/y` with y = C_n dt/m, would make it second order but
//! soften resting contacts by y/2; it is not done.

use super::Touch;
use super::composition::{NormalPart, Pressing};
use crate::lanes::Lane;
use serde::{Deserialize, Serialize};
use std::f64::consts::PI;

/// How strong a linear spring's dashpot is.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Damping {
    /// Matched to a restitution ε in (0, 1]; 1 = no dashpot.
    Restitution(f64),
    /// γ (1/s): the coefficient is γ times the reduced mass.
    MassProportional(f64),
}

impl Damping {
    /// Coefficient (N s/m) beside a spring (N/m) at a reduced mass (kg).
    pub fn coefficient(&self, stiffness: f64, reduced_mass: f64) -> f64 {
        let [root, linear] = self.factors(stiffness);
        root * reduced_mass.sqrt() + linear * reduced_mass
    }

    /// Factors of √m and of m.
    pub(super) fn factors(&self, stiffness: f64) -> [f64; 2] {
        match *self {
            Damping::Restitution(e) => {
                let ln = e.ln();
                [-2.0 * ln * (stiffness / (PI * PI + ln * ln)).sqrt(), 0.0]
            }
            Damping::MassProportional(rate) => [0.0, rate],
        }
    }
}

/// Linear normal spring and dashpot.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Hooke {
    /// k_n (N/m).
    pub stiffness: f64,
    /// Its dashpot.
    pub damping: Damping,
}

impl Hooke {
    /// A spring (N/m) with a dashpot matched to a restitution.
    pub fn matched(stiffness: f64, restitution: f64) -> Hooke {
        Hooke {
            stiffness,
            damping: Damping::Restitution(restitution),
        }
    }

    /// ε_n at a reduced mass (kg).
    pub fn restitution(&self, reduced_mass: f64) -> f64 {
        match self.damping {
            Damping::Restitution(e) => e,
            Damping::MassProportional(rate) => {
                (-0.5 * rate * self.contact_time(reduced_mass)).exp()
            }
        }
    }

    /// Duration of an isolated contact, τ (s), at a reduced mass (kg).
    pub fn contact_time(&self, reduced_mass: f64) -> f64 {
        match self.damping {
            Damping::Restitution(e) => {
                let ln = e.ln();
                (reduced_mass * (PI * PI + ln * ln) / self.stiffness).sqrt()
            }
            // π/√(ω² - γ²/4); an overdamped pair parts only in the limit.
            Damping::MassProportional(rate) => {
                PI / (self.stiffness / reduced_mass - 0.25 * rate * rate)
                    .max(0.0)
                    .sqrt()
            }
        }
    }

    pub(super) fn coefficients(&self) -> [f64; 3] {
        let [root, linear] = self.damping.factors(self.stiffness);
        [self.stiffness, root, linear]
    }
}

/// In the inner loop: k, factors of √m and m in the dashpot.
#[derive(Clone, Copy, Debug)]
pub struct Linear;

impl NormalPart for Linear {
    const COEFFICIENTS: usize = 3;
    const STIFFENS: bool = false;
    const HOLDS: bool = false;

    #[inline(always)]
    fn press<L: Lane>(c: &[L], touch: &Touch<L>, approach: L, _: L) -> Pressing<L> {
        let mass = L::splat(1.0) / touch.inverse_mass;
        let damping = c[1] * mass.sqrt() + c[2] * mass;
        Pressing {
            force: c[0] * touch.overlap + damping * approach,
            stiffness: c[0],
            damping,
            memory: L::splat(0.0),
        }
    }

    #[inline(always)]
    fn hold<L: Lane>(_: &[L], _: L) -> L {
        L::splat(0.0)
    }

    fn stored(c: &[f64], overlap: f64, _: f64) -> f64 {
        0.5 * c[0] * overlap * overlap
    }

    fn secant(c: &[f64], _: f64, _: f64) -> f64 {
        c[0]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lanes::Vec3;

    /// Head-on impact of a unit reduced mass, leap-frog, phase of first touch `offset` of a step:
    /// restitution and duration.
    fn impact(law: Hooke, steps_per_contact: f64, offset: f64) -> (f64, f64) {
        let dt = law.contact_time(1.0) / steps_per_contact;
        let c = law.coefficients();
        let touch = |gap: f64| Touch {
            normal: Vec3([1.0, 0.0, 0.0]),
            overlap: -gap,
            velocity: Vec3::zero(),
            spin: Vec3::zero(),
            inverse_mass: 1.0,
            curvature: 1.0,
            inverse_inertia: 1.0,
        };
        let (mut gap, mut v, mut touching) = (offset * dt, -1.0, 0.0);
        loop {
            if gap < 0.0 {
                v += dt * Linear::press(&c, &touch(gap), -v, 0.0).force;
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
            let law = Hooke::matched(3e4, e);
            for offset in [0.01, 0.37, 0.99] {
                let (out, time) = impact(law, 2000.0, offset);
                assert!((out - e).abs() < 1e-3, "e {e}: {out}");
                assert!((time / law.contact_time(1.0) - 1.0).abs() < 2e-3);
            }
        }
    }

    #[test]
    fn the_step_s_error_is_first_order_and_as_stated() {
        let law = Hooke::matched(1.0, 0.5);
        let worst = |steps: f64| {
            (0..50)
                .map(|k| (impact(law, steps, (k as f64 + 0.5) / 50.0).0 - 0.5).abs())
                .fold(0.0, f64::max)
        };
        let order = (worst(30.0) / worst(240.0)).log(8.0);
        assert!((0.9..1.1).contains(&order), "{order}");
        assert!(worst(30.0) < 0.4 / 30.0);
    }

    #[test]
    fn a_dashpot_in_proportion_to_mass_has_the_restitution_of_the_closed_form() {
        let law = Hooke {
            stiffness: 2e3,
            damping: Damping::MassProportional(20.0),
        };
        let (out, time) = impact(law, 4000.0, 0.3);
        assert!((out - law.restitution(1.0)).abs() < 1e-3, "{out}");
        assert!((time / law.contact_time(1.0) - 1.0).abs() < 2e-3);
        assert!((law.restitution(1.0) - 0.49).abs() < 0.01);
    }
}
