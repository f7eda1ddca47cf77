//! What all laws τ = c + μ(I) p have in common.

use super::Threshold;

/// Friction coefficient of sheared grains at one inertial number.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Friction {
    /// μ(I).
    pub mu: f64,
    /// μ′(I).
    pub slope: f64,
}

/// A friction coefficient as a function of the inertial number I = γ̇ d √(ρ_s/p).
pub(super) trait InertialFriction {
    /// μ and μ′ at I ≥ 0.
    fn friction(&self, inertial_number: f64) -> Friction;
    /// ∫₀^I μ(x) dx.
    fn integral(&self, inertial_number: f64) -> f64;
    /// Strain rate (1/s) at which I = 1 under a pressure (Pa): √(p/ρ_s)/d.
    fn rate_scale(&self, pressure: f64) -> f64;
    /// c (Pa).
    fn cohesion(&self) -> f64;

    /// κ = c + μ p, κ_γ = p μ′ I/γ̇, κ_p = μ − ½ I μ′; only c is left where p ≤ 0.
    #[inline]
    fn threshold_of_friction(&self, rate: f64, pressure: f64) -> Threshold {
        if pressure <= 0.0 {
            return Threshold {
                stress: self.cohesion(),
                by_rate: 0.0,
                by_pressure: 0.0,
            };
        }
        let scale = self.rate_scale(pressure);
        let inertial_number = rate / scale;
        let Friction { mu, slope } = self.friction(inertial_number);
        Threshold {
            stress: self.cohesion() + pressure * mu,
            by_rate: pressure * slope / scale,
            by_pressure: mu - 0.5 * inertial_number * slope,
        }
    }

    /// Ψ = c γ̇ + p √(p/ρ_s)/d ∫₀^I μ dI.
    fn potential_of_friction(&self, rate: f64, pressure: f64) -> f64 {
        if pressure <= 0.0 {
            return self.cohesion() * rate;
        }
        let scale = self.rate_scale(pressure);
        self.cohesion() * rate + pressure * scale * self.integral(rate / scale)
    }
}

/// Refuses a law of grains whose sizes and densities mean nothing.
///
/// # Errors
/// [`Error::OutOfRange`](crate::Error::OutOfRange) with the key, the value and the allowed range.
pub(super) fn validate_grains(
    diameter: f64,
    solid_fraction: f64,
    grain_density: f64,
    cohesion: f64,
) -> Result<(), crate::Error> {
    use crate::error::require;
    for (key, value) in [
        ("rheology.diameter", diameter),
        ("rheology.grain_density", grain_density),
    ] {
        require(value > 0.0, key, value, "greater than 0 and finite")?;
    }
    require(
        solid_fraction > 0.0 && solid_fraction <= 1.0,
        "rheology.solid_fraction",
        solid_fraction,
        "greater than 0, at most 1",
    )?;
    require(
        cohesion >= 0.0,
        "rheology.cohesion",
        cohesion,
        "at least 0 and finite",
    )
}
