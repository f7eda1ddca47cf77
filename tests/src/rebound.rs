//! The equation of a normal impact, m ẍ = -F(x, ẋ), solved on its own: the reference for laws without
//! a closed form.
//!
//! Dashpots that grow as a power of the overlap make the equation stiff to touch and part: there the
//! overlap's fourth root is the independent variable, in which solutions are smooth. In between,
//! time is. Classical Runge–Kutta steps throughout; halving them changes nothing above 1e-11.

use colluvium_dem::Hertz;
use colluvium_dem::contact::hertz::impact_overlap;
use std::f64::consts::PI;

/// What a normal impact leaves.
#[derive(Clone, Copy, Debug)]
pub struct Rebound {
    /// Speed of separation (m/s).
    pub speed: f64,
    /// Largest speed of separation: more than the last where the contact pulls before it parts.
    pub fastest: f64,
    /// Duration (s).
    pub time: f64,
    /// Largest overlap (m).
    pub overlap: f64,
}

impl Rebound {
    /// ∫|F| dt / m for an impact at `speed` (m/s): what friction acts with as long as it slides.
    pub fn pressing(&self, speed: f64) -> f64 {
        speed + 2.0 * self.fastest - self.speed
    }
}

/// An impact.
#[derive(Clone, Copy, Debug)]
pub struct Head {
    /// Reduced mass (kg).
    pub mass: f64,
    /// Speed of approach (m/s).
    pub speed: f64,
    /// A length of the order of the overlap (m).
    pub scale: f64,
    /// Whether the contact may pull; if not, it ends where the force does.
    pub pulls: bool,
}

const STEPS: f64 = 4000.0;

/// Solves for a force (N) of overlap (m) and its rate (m/s).
pub fn rebound(head: Head, force: impl Fn(f64, f64) -> f64) -> Rebound {
    let acceleration = |x: f64, v: f64| -force(x.max(0.0), v) / head.mass;
    // With y = x^{1/4}: dv/dy = 4 y³ a/v, dt/dy = 4 y³/v.
    let in_root = |y: f64, s: [f64; 2]| {
        let x = y.powi(4);
        [
            4.0 * y.powi(3) * acceleration(x, s[0]) / s[0],
            4.0 * y.powi(3) / s[0],
        ]
    };
    let in_time = |_: f64, s: [f64; 2]| [s[1], acceleration(s[0], s[1])];

    let top = head.scale.powf(0.25);
    let (mut y, mut s) = (0.0, [head.speed, 0.0]);
    while s[0] > 0.8 * head.speed && y < top {
        s = runge_kutta(&in_root, y, s, top / STEPS);
        y += top / STEPS;
    }
    let (mut time, mut state) = (s[1], [y.powi(4), s[0]]);
    let dt = head.scale / head.speed / (4.0 * STEPS);
    let (mut overlap, mut fastest) = (state[0], 0.0_f64);
    let parts = |x: f64, v: f64| !head.pulls && v < 0.0 && force(x, v) <= 0.0;
    let ended = |speed: f64, time: f64, overlap: f64| Rebound {
        speed: -speed,
        fastest: -speed,
        time,
        overlap,
    };
    while state[1] > 0.0 || state[0] > 0.02 * overlap {
        let go = |h: f64| runge_kutta(&in_time, 0.0, state, h);
        let next = go(dt);
        if parts(next[0], next[1]) {
            let h = bisect(dt, |h| parts(go(h)[0], go(h)[1]));
            return ended(go(h)[1], time + h, overlap);
        }
        if state[1] > 0.0 && next[1] <= 0.0 {
            overlap = go(bisect(dt, |h| go(h)[1] <= 0.0))[0];
        }
        overlap = overlap.max(next[0]);
        fastest = fastest.max(-next[1]);
        state = next;
        time += dt;
    }
    let (mut y, mut s) = (state[0].powf(0.25), [state[1], time]);
    let step = -y / STEPS;
    for _ in 0..STEPS as u32 {
        let go = |h: f64| runge_kutta(&in_root, y, s, h);
        let over = |h: f64| parts((y + h).max(0.0).powi(4), go(h)[0]);
        if over(step) {
            let last = go(bisect(step, over));
            return ended(last[0], last[1], overlap);
        }
        s = go(step);
        y += step;
        fastest = fastest.max(-s[0]);
    }
    Rebound {
        speed: -s[0],
        fastest,
        time: s[1],
        overlap,
    }
}

/// A contact of elastic spheres with the matched dashpot (Kappel et al. 2020, Eq. 4–12), at a reduced
/// mass (kg), reduced radius (m) and speed (m/s).
pub fn elastic_spheres(law: &Hertz, mass: f64, radius: f64, speed: f64) -> Rebound {
    let Hertz {
        effective_modulus: modulus,
        restitution: e,
    } = *law;
    let b = e.ln() / (e.ln().powi(2) + PI * PI).sqrt();
    let head = Head {
        mass,
        speed,
        scale: impact_overlap(modulus, mass, radius, speed),
        pulls: true,
    };
    rebound(head, |x, v| {
        let stiffness = 2.0 * modulus * (radius * x).sqrt();
        let damping = -2.0 * (5.0_f64 / 6.0).sqrt() * b * (stiffness * mass).sqrt();
        2.0 / 3.0 * stiffness * x + damping * v
    })
}

fn runge_kutta(rate: &impl Fn(f64, [f64; 2]) -> [f64; 2], t: f64, s: [f64; 2], h: f64) -> [f64; 2] {
    let along = |k: [f64; 2], h: f64| [s[0] + h * k[0], s[1] + h * k[1]];
    let k1 = rate(t, s);
    let k2 = rate(t + 0.5 * h, along(k1, 0.5 * h));
    let k3 = rate(t + 0.5 * h, along(k2, 0.5 * h));
    let k4 = rate(t + h, along(k3, h));
    [0, 1].map(|i| s[i] + h / 6.0 * (k1[i] + 2.0 * k2[i] + 2.0 * k3[i] + k4[i]))
}

/// The part of a step after which something holds that does not hold at its beginning.
fn bisect(step: f64, holds: impl Fn(f64) -> bool) -> f64 {
    let (mut before, mut after) = (0.0, step);
    for _ in 0..60 {
        let middle = 0.5 * (before + after);
        if holds(middle) {
            after = middle;
        } else {
            before = middle;
        }
    }
    after
}

#[cfg(test)]
mod tests {
    use super::*;

    fn head(speed: f64, scale: f64, pulls: bool) -> Head {
        Head {
            mass: 1.0,
            speed,
            scale,
            pulls,
        }
    }

    #[test]
    fn linear_springs_have_their_closed_form() {
        for e in [0.2_f64, 0.5, 0.9, 1.0] {
            let c = -2.0 * e.ln() / (PI * PI + e.ln().powi(2)).sqrt();
            let r = rebound(head(0.3, 0.3, true), |x, v| x + c * v);
            assert!((r.speed / 0.3 - e).abs() < 1e-10, "{e}: {:?}", r);
            let time = (PI * PI + e.ln().powi(2)).sqrt();
            assert!((r.time / time - 1.0).abs() < 1e-10);
        }
    }

    #[test]
    fn a_dashpot_in_proportion_to_the_root_of_the_stiffness_has_one_restitution() {
        // Antypov & Elliott 2011: √(5/6) scaled to a Hertz spring, exactly, at any speed.
        for e in [0.2_f64, 0.5, 0.98] {
            let b = -2.0 * (5.0_f64 / 6.0).sqrt() * e.ln() / (PI * PI + e.ln().powi(2)).sqrt();
            for speed in [0.01_f64, 3.0] {
                let scale = (1.25 * speed * speed).powf(0.4);
                let r = rebound(head(speed, scale, true), |x, v| {
                    x.powf(1.5) + b * (1.5 * x.sqrt()).sqrt() * v
                });
                assert!((r.speed / speed - e).abs() < 1e-10, "{e}: {:?}", r);
            }
        }
    }
}
