//! Stiffness and time step from what a scene expects.
//!
//! ```text
//! k_n = m (v_max / x_max)²                     m mass, v_max largest expected speed, x_max largest overlap
//! dt  = π √( m/(2 k_n) ) / N                   N steps a contact of two equal grains without damping
//! ```
//! Source: Thuillet 2019, Eq. 2.6 (its square is lost in the print) and 2.7, N = 30; x_max about 1 % of
//! the smallest radius (Schwartz et al. 2012).

use crate::contact::ContactLaw;
use std::f64::consts::PI;

/// k_n (N/m) that keeps the overlap below `largest_overlap` (m) at `speed` (m/s) for mass (kg).
pub fn stiffness(mass: f64, speed: f64, largest_overlap: f64) -> f64 {
    mass * (speed / largest_overlap).powi(2)
}

/// Step (s) that resolves a contact of two grains of `mass` (kg) by `steps_per_contact` steps.
pub fn step(mass: f64, stiffness: f64, steps_per_contact: f64) -> f64 {
    PI * (mass / (2.0 * stiffness)).sqrt() / steps_per_contact
}

/// The step at which leap-frog becomes unstable for a grain of `mass` (kg) and `radius` (m) held by one
/// contact of the law under `overlap` (m) against a fixed partner, `2/ω` (s); packed grains have several
/// contacts and less room.
///
/// Dashpots are left out; at ε = 0.5 they lower it by less than a fifth. The fastest of the normal,
/// tangential (which also turns the grain), rolling and twisting oscillations counts.
pub fn stability_limit(law: &ContactLaw, mass: f64, radius: f64, overlap: f64) -> f64 {
    let k = law.stiffness(radius, overlap);
    // Tangential: 1/m + R²/I = 7/(2m). Rolling and twisting about a wall: over 2/5 m R².
    let stiffest = k
        .normal
        .max(3.5 * k.tangential)
        .max(2.5 * k.rolling.max(k.twisting) / (radius * radius));
    2.0 * (mass / stiffest).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::contact::{Hooke, TangentialSpring};

    #[test]
    fn a_head_on_impact_reaches_the_overlap_asked_for() {
        // Two masses m at ±v: reduced mass m/2, relative speed 2v, x = 2v √(m/2k).
        let (m, v, x) = (0.3, 2.0, 1e-3);
        let k = stiffness(m, v, x);
        assert!((2.0 * v * (m / (2.0 * k)).sqrt() / x - 2.0_f64.sqrt()).abs() < 1e-12);
        // One such grain against a wall: exactly x.
        assert!((v * (m / k).sqrt() / x - 1.0).abs() < 1e-12);
        let tau = PI * (m / 2.0 / k).sqrt();
        assert!((step(m, k, 30.0) * 30.0 / tau - 1.0).abs() < 1e-12);
    }

    #[test]
    fn the_limit_is_two_over_the_fastest_frequency() {
        let law = ContactLaw::linear(
            Hooke::matched(400.0, 1.0),
            TangentialSpring::matched(2.0 / 7.0, 1.0, 0.5),
            None,
        );
        assert!((stability_limit(&law, 1.0, 0.5, 1e-3) - 0.1).abs() < 1e-15);
    }
}
