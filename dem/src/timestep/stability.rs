//! Where the leap-frog step becomes unstable on one contact.
//!
//! ```text
//! v ← v - dt (k x + c v)/m,  x ← x + dt v          dashpots see the velocity half a step back
//! grows from step to step where  dt² k/m + 2 dt c/m > 4
//! dt = (2/ω)(√(1 + ζ²) - ζ)                         ω² = k/m, ζ = c/(2√(k m)); 2m/c without a spring
//! ```
//! At the limit the motion changes sign each step, v' = -v and x' = -x, which gives the second line
//! for any number of springs and dashpots: dt²K + 2dtC has the eigenvalue 4 M. Two surfaces oscillate
//! along the normal, about it (twisting), and in sliding and rolling, which are one motion of two
//! degrees of freedom unless the surfaces are alike: slip moves centres and turns grains.

use crate::contact::{ContactLaw, Inertia};

/// 1/m R² over the moment of inertia of a sphere.
const TURNING: f64 = 2.5;

/// Two surfaces in contact.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Surfaces {
    /// What dashpots need.
    pub inertia: Inertia,
    /// `1/(m_i R_i) - 1/(m_j R_j)` (1/(kg m)).
    pub skew: f64,
}

/// An oscillation and the step at which it becomes unstable.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Oscillation {
    /// The part that drives it most.
    pub name: &'static str,
    /// The step (s).
    pub seconds: f64,
}

/// A spring and its dashpot over the inertia that they move.
#[derive(Clone, Copy)]
struct Element {
    /// k/m (1/s²).
    spring: f64,
    /// c/m (1/s).
    dashpot: f64,
}

impl Element {
    fn limit(self) -> f64 {
        let half = 0.5 * self.dashpot;
        2.0 / ((self.spring + half * half).sqrt() + half)
    }

    /// `dt² k/m + 2 dt c/m`.
    fn load(self, step: f64) -> f64 {
        step * (step * self.spring + 2.0 * self.dashpot)
    }

    fn oscillation(self, name: &'static str, dashpot: &'static str) -> Oscillation {
        let seconds = self.limit();
        let damped = 2.0 * self.dashpot > seconds * self.spring;
        Oscillation {
            name: if damped { dashpot } else { name },
            seconds,
        }
    }
}

/// The oscillations of two surfaces under `overlap` (m).
pub(super) fn oscillations(
    law: &ContactLaw,
    surfaces: &Surfaces,
    overlap: f64,
) -> [Oscillation; 3] {
    let inertia = &surfaces.inertia;
    let k = law.stiffness(inertia.reduced_radius, overlap);
    let c = law.dashpots(inertia, overlap);
    let over = |inverse: f64, spring: f64, dashpot: f64| Element {
        // Softening branches of adhesive contacts do not oscillate.
        spring: (spring * inverse).max(0.0),
        dashpot: dashpot * inverse,
    };
    let inverse_mass = 1.0 / inertia.reduced_mass;
    let turning = TURNING * inertia.inverse_inertia;
    let normal = over(inverse_mass, k.normal, c.normal);
    let sliding = over((1.0 + TURNING) * inverse_mass, k.tangential, c.tangential);
    let rolling = over(turning, k.rolling, c.rolling);
    let twisting = over(turning, k.twisting, c.twisting);
    // Cosine of the angle between slip and rolling in the metric of the masses.
    let slip = (1.0 + TURNING) * inverse_mass;
    let cosine2 = if turning > 0.0 {
        (TURNING * surfaces.skew).powi(2) / (slip * turning)
    } else {
        0.0
    };
    [
        normal.oscillation("normal spring", "normal dashpot"),
        together(sliding, rolling, cosine2),
        twisting.oscillation("twisting spring", "twisting dashpot"),
    ]
}

/// Limit of sliding and rolling together: the larger eigenvalue of their loads reaches 4.
fn together(sliding: Element, rolling: Element, cosine2: f64) -> Oscillation {
    let mut worst = sliding.oscillation("tangential spring", "tangential dashpot");
    let other = rolling.oscillation("rolling spring", "rolling dashpot");
    if other.seconds < worst.seconds {
        worst = other;
    }
    let sum = Element {
        spring: sliding.spring + rolling.spring,
        dashpot: sliding.dashpot + rolling.dashpot,
    };
    let (mut low, mut high) = (sum.limit(), worst.seconds);
    if !high.is_finite() {
        return worst;
    }
    for _ in 0..60 {
        let step = 0.5 * (low + high);
        let (s, r) = (sliding.load(step), rolling.load(step));
        let root = ((s - r).powi(2) + 4.0 * s * r * cosine2).sqrt();
        if 0.5 * (s + r + root) > 4.0 {
            high = step;
        } else {
            low = step;
        }
    }
    worst.seconds = low;
    worst
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Growth of a damped oscillator under the step, over 4000 steps.
    fn grows(element: Element, step: f64) -> bool {
        let (mut x, mut v) = (1.0, 0.3);
        for _ in 0..4000 {
            v -= step * (element.spring * x + element.dashpot * v);
            x += step * v;
        }
        x.is_nan() || x.abs() > 1e3
    }

    #[test]
    fn a_damped_oscillator_blows_up_at_the_limit() {
        for (spring, dashpot) in [(1.0, 0.0), (1.0, 0.4), (1.0, 2.0), (1.0, 30.0), (0.0, 3.0)] {
            let element = Element { spring, dashpot };
            let limit = element.limit();
            assert!(!grows(element, 0.99 * limit), "k {spring} c {dashpot}");
            assert!(grows(element, 1.01 * limit), "k {spring} c {dashpot}");
        }
        let free = Element {
            spring: 0.0,
            dashpot: 0.0,
        };
        assert_eq!(free.limit(), f64::INFINITY);
    }

    #[test]
    fn like_surfaces_slide_and_roll_apart_and_aligned_ones_together() {
        let element = |spring| Element {
            spring,
            dashpot: 0.0,
        };
        let apart = together(element(4.0), element(9.0), 0.0);
        assert!((apart.seconds - 2.0 / 3.0).abs() < 1e-12);
        assert_eq!(apart.name, "rolling spring");
        let aligned = together(element(4.0), element(9.0), 1.0);
        assert!((aligned.seconds - 2.0 / 13.0_f64.sqrt()).abs() < 1e-12);
    }
}
