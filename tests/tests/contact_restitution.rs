//! Restitution and duration of normal impacts, for every normal law.
//!
//! | law | restitution | duration | source |
//! |---|---|---|---|
//! | Hooke | ε_n at any speed and mass | √(m (π² + ln² ε)/k) | Thuillet 2019, Eq. 2.8, 2.9, SM 17–19 |
//! | Hooke, dashpot γ m | exp(-γ τ/2) | π/√(k/m - γ²/4) | LAMMPS `gran/hooke` |
//! | Hertz | e at any speed | by its own equation | Antypov & Elliott 2011 |
//! | viscoelastic | f(β v^{1/5}) | 5.84 (ρ(1-ν²)/E)^{2/5} r v^{-1/5} | Müller & Pöschel 2011; Tancredi et al. 2012 |

use colluvium_dem::contact::Damping;
use colluvium_dem::{ContactLaw, Hooke, Lever, Normal, Rolling, Tangential, Viscoelastic};
use colluvium_tests::impacts::*;
use colluvium_tests::rebound::{Head, rebound};
use std::f64::consts::PI;

fn only(normal: Normal) -> ContactLaw {
    ContactLaw {
        normal,
        tangential: Tangential::None,
        rolling: Rolling::None,
        cohesion: colluvium_dem::Cohesion::None,
        lever: Lever::ContactPoint,
    }
}

/// Speed of separation over approach and duration, of pairs of two sizes and of a wall.
fn impacts(law: ContactLaw, speed: f64, steps: f64) -> Vec<(f64, [f64; 2], f64, f64)> {
    let mut out = Vec::new();
    for (radius, other) in [(0.5, 0.5), (0.5, 0.2), (0.3, 2.0), (0.5, f64::INFINITY)] {
        let ball = |r: f64, v: f64| sphere(r, 2500.0, [0.0, 0.0, v], [0.0; 3]);
        let a = ball(radius, 0.0).mass();
        let (m, r) = if other.is_finite() {
            let b = ball(other, 0.0).mass();
            (a * b / (a + b), radius * other / (radius + other))
        } else {
            (a, radius)
        };
        let dt = law.contact_time(m, r, speed) / steps;
        let mut simulation = if other.is_finite() {
            pair(
                law,
                ball(radius, 0.6 * speed),
                ball(other, -0.4 * speed),
                dt,
            )
        } else {
            on_floor(law, ball(radius, -speed), dt)
        };
        let impact = collide(&mut simulation);
        let apart = match impact.grains[..] {
            [ref a, ref b] => b.velocity.z - a.velocity.z,
            _ => impact.grains[0].velocity.z,
        };
        out.push((apart / speed, [m, r], impact.time, impact.overlap));
    }
    out
}

#[test]
fn linear_contacts_have_the_restitution_and_duration_of_the_thesis() {
    for e in [0.1_f64, 0.3, 0.5, 0.7, 0.9, 1.0] {
        let law = only(Normal::Hooke(Hooke::matched(3e6, e)));
        for (got, [m, _], time, overlap) in impacts(law, 0.7, 4000.0) {
            assert!((got - e).abs() < 2e-4, "{e}: {got}");
            let tau = (m * (PI * PI + e.ln().powi(2)) / 3e6).sqrt();
            assert_close("duration", time, tau, 1e-3);
            // Peak: x = v/ω₀ exp(-φ/tan φ) with cos φ the damping ratio.
            let ratio = -e.ln() / (PI * PI + e.ln().powi(2)).sqrt();
            let phi = ratio.acos();
            let peak = 0.7 * (m / 3e6).sqrt() * (-phi * ratio / phi.sin()).exp();
            assert_close("overlap", overlap, peak, 1e-3);
        }
    }
}

#[test]
fn a_dashpot_in_proportion_to_mass() {
    let hooke = Hooke {
        stiffness: 3e6,
        damping: Damping::MassProportional(40.0),
    };
    for (got, [m, _], time, _) in impacts(only(Normal::Hooke(hooke)), 0.7, 4000.0) {
        let tau = PI / (3e6 / m - 400.0).sqrt();
        assert_close("duration", time, tau, 1e-3);
        assert!((got - (-20.0 * tau).exp()).abs() < 2e-4, "{got}");
    }
}

#[test]
fn hertz_contacts_have_one_restitution_at_all_speeds() {
    for e in [0.2_f64, 0.5, 0.9, 1.0] {
        let law = ContactLaw {
            tangential: Tangential::None,
            ..ContactLaw::hertz_mindlin(material(1e8, 0.3), e, 0.0)
        };
        let modulus = 1e8 / (2.0 * (1.0 - 0.09));
        let b = e.ln() / (e.ln().powi(2) + PI * PI).sqrt();
        for speed in [1e-3, 0.1, 10.0] {
            for (got, [m, r], time, overlap) in impacts(law, speed, 4000.0) {
                assert!((got - e).abs() < 4e-4, "{e} at {speed}: {got}");
                let head = Head {
                    mass: m,
                    speed,
                    scale: (15.0 * m * speed * speed / (16.0 * modulus * r.sqrt())).powf(0.4),
                    pulls: true,
                };
                let exact = rebound(head, |x, v| {
                    let s = 2.0 * modulus * (r * x).sqrt();
                    2.0 / 3.0 * s * x - 2.0 * (5.0_f64 / 6.0).sqrt() * b * (s * m).sqrt() * v
                });
                assert!((exact.speed / speed - e).abs() < 1e-9);
                assert_close("duration", time, exact.time, 1e-3);
                assert_close("overlap", overlap, exact.overlap, 1e-3);
            }
        }
    }
}

/// Müller & Pöschel 2011's quotient of polynomials of v* = (β^{1/2}) v^{1/10}, fitted to the solution that
/// ends where the force does.
fn quotient(beta_v: f64) -> f64 {
    let s = beta_v.sqrt();
    let below = [1.0, 0.501_086, 1.153_45, 0.577_977, 0.532_178];
    (1.0 + 0.501_086 * s) / below.iter().rev().fold(0.0, |sum, b| sum * s + b)
}

#[test]
fn viscoelastic_restitution_is_a_function_of_one_number() {
    let (youngs, poisson) = (1e9, 0.3);
    for dissipation in [0.0, 1e-4, 1e-3, 4e-3] {
        let law = only(Normal::Viscoelastic(Viscoelastic::of(
            material(youngs, poisson),
            dissipation,
        )));
        for speed in [0.01, 1.0, 30.0] {
            for (got, [m, r], time, _) in impacts(law, speed, 4000.0) {
                let d = 2.0 * youngs * r.sqrt() / (3.0 * (1.0 - poisson * poisson));
                let head = Head {
                    mass: m,
                    speed,
                    scale: (1.25 * m * speed * speed / d).powf(0.4),
                    pulls: false,
                };
                let exact = rebound(head, |x, v| d * (x.powf(1.5) + dissipation * x.sqrt() * v));
                assert!((got - exact.speed / speed).abs() < 3e-4, "{got} {exact:?}");
                // γ = D A/m: the sources' factor 3/2 stands in their law's dissipative term, not in Eq. 6.
                let beta = d * dissipation / m * (d / m).powf(-0.6);
                // The fit itself is good to 0.004, beyond βv^{1/5} = 1 to 0.009.
                let x = beta * speed.powf(0.2);
                let fit = quotient(x);
                let fault = if x < 1.0 { 4e-3 } else { 9e-3 };
                assert!((got - fit).abs() < fault, "{x}: {got}, fit {fit}");
                // Surfaces overlap longer than they press.
                assert!(time >= exact.time * (1.0 - 1e-3));
            }
        }
    }
}

#[test]
fn contact_time_of_equal_viscoelastic_spheres() {
    // Tancredi et al. 2012, Eq. 1 (printed to three digits), for elastic spheres.
    for (density, youngs, poisson, r, v) in [
        (3000.0_f64, 1e10_f64, 0.3_f64, 1.0, 1.0_f64),
        (3000.0, 1e9, 0.3, 0.25, 0.01),
        (2000.0, 1e8, 0.2, 0.01, 10.0),
    ] {
        let law = only(Normal::Viscoelastic(Viscoelastic::of(
            material(youngs, poisson),
            0.0,
        )));
        let printed =
            5.84 * (density * (1.0 - poisson * poisson) / youngs).powf(0.4) * r * v.powf(-0.2);
        let ball = |v| sphere(r, density, [0.0, 0.0, v], [0.0; 3]);
        let m = 0.5 * ball(0.0).mass();
        assert_close("formula", law.contact_time(m, 0.5 * r, v), printed, 1.5e-3);
        let dt = printed / 3000.0;
        let impact = collide(&mut pair(law, ball(0.5 * v), ball(-0.5 * v), dt));
        assert_close("run", impact.time, printed, 2e-3);
    }
}
