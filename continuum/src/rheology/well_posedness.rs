//! Well-posedness: whether short waves grow at a rate without bound.
//!
//! A plane wave of wavenumber k in a uniform flow of rate γ̇ and pressure p grows at
//!
//! ```text
//! σ = (k²/ρ) [(η − κ_γ)(1 − b²)/(1 − κ_p b) − η],    η = κ/γ̇,
//! ```
//!
//! where b = ξ·A ξ is the direction ξ of the wave seen in the frame of the flow, A = 2D/γ̇: 0 along
//! and across a shear flow, ±1 along its axes of stretching and shortening. (Linearise ρ ∂u/∂t =
//! −∇p + ∇·(κ A) with δu ⊥ ξ and eliminate δp. Advection by the base flow only turns and stretches the
//! wave.) The fastest direction is b = κ_p/(1 + √(1 − κ_p²)), and σ > 0 there wherever
//!
//! ```text
//! C = 4r² − 4r + κ_p² > 0,    r = γ̇ κ_γ/κ < ½.
//! ```
//!
//! For μ(I) without cohesion r = I μ′/μ and κ_p = μ (1 − r/2): the condition of Barker, Schaeffer,
//! Bohorquez & Gray, *J. Fluid Mech.* 779 (2015) 794, in the form of Barker & Gray, *J. Fluid Mech.*
//! 828 (2017) 5, eq. 3.9. From r = ½ on the sign of C no longer decides, because its direction is
//! not one of a wave: there a law is well posed as long as κ_p < 1.

use super::Threshold;

/// C = 4r² − 4r + μ²(1 − r/2)² with r = I μ′/μ (dimensionless): incompressible μ(I) flow is well
/// posed where C < 0 and ill posed where C > 0, where waves grow faster the shorter they are.
///
/// `mu` is μ(I), `slope` is μ′(I), `inertial_number` is I.
pub fn well_posedness(inertial_number: f64, mu: f64, slope: f64) -> f64 {
    let r = inertial_number * slope / mu;
    criterion(r, mu * (1.0 - 0.5 * r))
}

/// C = 4r² − 4r + κ_p².
fn criterion(r: f64, by_pressure: f64) -> f64 {
    4.0 * r * r - 4.0 * r + by_pressure * by_pressure
}

impl Threshold {
    /// r = γ̇ κ_γ/κ, 0 where nothing is borne.
    fn rate_exponent(&self, rate: f64) -> f64 {
        if self.stress > 0.0 {
            rate * self.by_rate / self.stress
        } else {
            0.0
        }
    }

    /// C = 4r² − 4r + κ_p² of this threshold at strain rate γ̇ (1/s), for any law.
    pub fn well_posedness(&self, rate: f64) -> f64 {
        criterion(self.rate_exponent(rate), self.by_pressure)
    }

    /// Growth ρσ/k² (Pa s) of a plane wave in the direction b = ξ·Aξ, −1 to 1: negative where it
    /// decays. Where κ_p b ≥ 1 the pressure no longer restores what it disturbs: +∞.
    pub fn wave_growth(&self, rate: f64, direction: f64) -> f64 {
        let viscosity = self.stress / rate;
        let restoring = 1.0 - self.by_pressure * direction;
        if restoring <= 0.0 {
            return f64::INFINITY;
        }
        (viscosity - self.by_rate) * (1.0 - direction * direction) / restoring - viscosity
    }

    /// The direction b in which waves grow fastest: κ_p/(1 + √(1 − κ_p²)), if κ grows with the rate
    /// less than in proportion; none where κ_p ≥ 1.
    pub fn fastest_direction(&self) -> Option<f64> {
        let rest = 1.0 - self.by_pressure * self.by_pressure;
        (rest > 0.0).then(|| self.by_pressure / (1.0 + rest.sqrt()))
    }

    /// Whether no wave grows, in any direction.
    pub fn is_well_posed(&self, rate: f64) -> bool {
        let rest = 1.0 - self.by_pressure * self.by_pressure;
        rest > 0.0 && 2.0 * (1.0 - self.rate_exponent(rate)) <= 1.0 + rest.sqrt()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::rheology::{MuI, Rheology};

    /// Limits of the well-posed window for parameter sets of the literature, from the roots of C.
    #[test]
    fn window_of_published_materials() {
        for (mu_s, mu_2, i_0, low, high) in [
            // Jop, Forterre & Pouliquen's glass beads: tan 20.9°, tan 32.76°.
            (0.381863, 0.643468, 0.279, 0.01935, 0.8523),
            (0.32, 0.60, 0.4, 0.01363, 1.810),
            (0.342, 0.557, 0.069, 0.00397, 0.2802),
        ] {
            let law = MuI::new(mu_s, mu_2, i_0, 1e-3, 0.6, 2500.0);
            assert!(law.well_posedness(low * 0.998) > 0.0);
            assert!(law.well_posedness(low * 1.002) < 0.0);
            assert!(law.well_posedness(high * 0.998) < 0.0);
            assert!(law.well_posedness(high * 1.002) > 0.0);
        }
    }

    /// C of the threshold is C(I), and its sign is that of the fastest growth among directions
    /// tried one by one.
    #[test]
    fn sign_of_c_is_that_of_the_fastest_wave() {
        let law = MuI::new(0.32, 0.60, 0.4, 0.04, 0.6, 1.0);
        let pressure = 0.7;
        for exponent in -30..=10 {
            let inertial_number = 10f64.powf(0.1 * f64::from(exponent));
            let rate = inertial_number / (0.04 * (1.0f64 / pressure).sqrt());
            let threshold = law.threshold(rate, pressure);
            let c = threshold.well_posedness(rate);
            assert!((c - law.well_posedness(inertial_number)).abs() < 1e-13);
            let tried = (-1000..=1000)
                .map(|i| threshold.wave_growth(rate, f64::from(i) * 1e-3))
                .fold(f64::NEG_INFINITY, f64::max);
            let fastest = threshold.wave_growth(rate, threshold.fastest_direction().unwrap());
            assert!(fastest >= tried && fastest - tried < 1e-5 * threshold.stress / rate);
            assert_eq!(c > 0.0, fastest > 0.0, "I = {inertial_number}");
            assert_eq!(c < 0.0, threshold.is_well_posed(rate));
        }
    }

    /// A fluid whose viscosity is proportional to pressure: C > 0, and yet no wave grows while
    /// κ_p < 1.
    #[test]
    fn c_says_nothing_beyond_one_half() {
        for (by_pressure, well_posed) in [(0.3, true), (0.99, true), (1.01, false)] {
            let fluid = Threshold {
                stress: 2.0,
                by_rate: 1.0,
                by_pressure,
            };
            assert!(fluid.well_posedness(2.0) > 0.0);
            assert_eq!(fluid.is_well_posed(2.0), well_posed);
            let tried = (-1000..=1000)
                .map(|i| fluid.wave_growth(2.0, f64::from(i) * 1e-3))
                .fold(f64::NEG_INFINITY, f64::max);
            assert_eq!(tried <= 0.0, well_posed);
        }
    }

    /// The growth rate from the linearised balance itself: the pressure and velocity of a wave
    /// solved as a 2 × 2 system, for directions all round.
    #[test]
    fn growth_agrees_with_the_linearised_balance() {
        let law = MuI {
            cohesion: 0.1,
            ..MuI::new(0.32, 0.60, 0.4, 0.04, 1.0, 1.0)
        };
        let (rate, pressure) = (0.3, 0.8);
        let t = law.threshold(rate, pressure);
        // A flow that shears at some angle: A = [[c, s], [s, −c]].
        let (c, s) = (0.6, 0.8);
        for i in 0..24 {
            let angle = f64::from(i) * std::f64::consts::PI / 24.0;
            let (xi, normal) = ([angle.cos(), angle.sin()], [-angle.sin(), angle.cos()]);
            let apply = |v: [f64; 2]| [c * v[0] + s * v[1], s * v[0] - c * v[1]];
            let dot = |a: [f64; 2], b: [f64; 2]| a[0] * b[0] + a[1] * b[1];
            let (a, b) = (dot(normal, apply(xi)), dot(xi, apply(xi)));
            // δτ·ξ for a velocity δu = n (∂ → i k, factors ik left out) and for a pressure of one.
            let viscosity = t.stress / rate;
            let of_velocity = |d: [f64; 2]| {
                (t.by_rate - viscosity) * a * dot(d, apply(xi)) + viscosity * dot(d, normal)
            };
            let of_pressure = |d: [f64; 2]| t.by_pressure * dot(d, apply(xi));
            // Along ξ: δp = of_velocity(ξ) + of_pressure(ξ) δp, along n: −growth = the rest.
            let dp = of_velocity(xi) / (1.0 - of_pressure(xi));
            let growth = -(of_velocity(normal) + of_pressure(normal) * dp);
            assert!((growth - t.wave_growth(rate, b)).abs() < 1e-13, "{angle}");
        }
    }
}
