//! The local μ(I) law with cohesion.

use serde::{Deserialize, Serialize};

use super::friction::validate_grains;
use super::{Rheology, ShearLaw, Threshold, well_posedness};
use crate::error::{Error, require};
use crate::units::Units;

/// The μ(I) law: τ = c + μ(I) p, μ(I) = μ_s + (μ_2 − μ_s) I/(I_0 + I), I = γ̇ d/√(p/ρ_s).
///
/// Here ρ_s is the density of the *grains*; the bulk density is ρ = φ ρ_s. With μ_2 = μ_s the law
/// is Coulomb's. Sources: GDR MiDi, *Eur. Phys. J. E* 14 (2004) 341; Jop, Forterre & Pouliquen,
/// *Nature* 441 (2006) 727.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct MuI {
    /// Static friction coefficient μ_s.
    pub mu_s: f64,
    /// Friction coefficient μ_2 at large inertial number.
    pub mu_2: f64,
    /// Inertial number I_0 at which μ is half-way between μ_s and μ_2.
    pub i_0: f64,
    /// Grain diameter d (m).
    pub diameter: f64,
    /// Solid volume fraction φ.
    pub solid_fraction: f64,
    /// Density of the grains ρ_s (kg/m³).
    pub grain_density: f64,
    /// Cohesion c (Pa): the stress borne at zero pressure.
    #[serde(default)]
    pub cohesion: f64,
}

impl MuI {
    /// A cohesionless law; diameter in m, density of the grains in kg/m³.
    pub fn new(
        mu_s: f64,
        mu_2: f64,
        i_0: f64,
        diameter: f64,
        solid_fraction: f64,
        grain_density: f64,
    ) -> Self {
        Self {
            mu_s,
            mu_2,
            i_0,
            diameter,
            solid_fraction,
            grain_density,
            cohesion: 0.0,
        }
    }

    /// Refuses parameters with which the law means nothing.
    ///
    /// # Errors
    /// [`Error::OutOfRange`] with the key, the value and the allowed range.
    pub fn validate(&self) -> Result<(), Error> {
        require(
            self.mu_s >= 0.0,
            "rheology.mu_s",
            self.mu_s,
            "at least 0 and finite",
        )?;
        require(
            self.mu_2 >= self.mu_s,
            "rheology.mu_2",
            self.mu_2,
            format!("at least rheology.mu_s = {} and finite", self.mu_s),
        )?;
        require(
            self.i_0 > 0.0,
            "rheology.i_0",
            self.i_0,
            "greater than 0 and finite",
        )?;
        validate_grains(
            self.diameter,
            self.solid_fraction,
            self.grain_density,
            self.cohesion,
        )
    }

    /// Bulk density ρ = φ ρ_s (kg/m³).
    pub fn bulk_density(&self) -> f64 {
        self.solid_fraction * self.grain_density
    }

    /// Inertial number I = γ̇ d √(ρ_s/p) at strain rate γ̇ (1/s) and pressure p > 0 (Pa).
    pub fn inertial_number(&self, rate: f64, pressure: f64) -> f64 {
        rate * self.diameter * (self.grain_density / pressure).sqrt()
    }

    /// Friction coefficient μ(I) = μ_s + (μ_2 − μ_s) I/(I_0 + I).
    pub fn mu(&self, inertial_number: f64) -> f64 {
        self.mu_s + (self.mu_2 - self.mu_s) * inertial_number / (self.i_0 + inertial_number)
    }

    /// Inertial number at which μ(I) = `mu`: I = I_0 (μ − μ_s)/(μ_2 − μ), for μ_s ≤ μ < μ_2.
    pub fn inertial_number_at(&self, mu: f64) -> f64 {
        self.i_0 * (mu - self.mu_s) / (self.mu_2 - mu)
    }

    /// C(I) of [`well_posedness`]: the equations of plane flow are well posed where it is negative. In space the middle
    /// eigenvalue of the stretching counts, too ([`Rheology::is_well_posed_in_space`]).
    pub fn well_posedness(&self, inertial_number: f64) -> f64 {
        let sum = self.i_0 + inertial_number;
        let slope = (self.mu_2 - self.mu_s) * self.i_0 / (sum * sum);
        well_posedness(inertial_number, self.mu(inertial_number), slope)
    }

    /// Strain rate a = I_0 √(p/ρ_s)/d (1/s) at which I = I_0. Writing μ with γ̇/(γ̇ + a) stays
    /// finite at p = 0, where I itself does not.
    #[inline]
    fn crossover_rate(&self, pressure: f64) -> f64 {
        self.i_0 * (pressure / self.grain_density).sqrt() / self.diameter
    }
}

impl Rheology for MuI {
    /// κ = c + p [μ_s + Δμ γ̇/(γ̇ + a)], κ_γ = p Δμ a/(γ̇ + a)²,
    /// κ_p = μ_s + Δμ γ̇/(γ̇ + a) − Δμ γ̇ a/(2 (γ̇ + a)²).
    #[inline]
    fn threshold(&self, rate: f64, pressure: f64) -> Threshold {
        if pressure <= 0.0 {
            return Threshold {
                stress: self.cohesion,
                by_rate: 0.0,
                by_pressure: 0.0,
            };
        }
        let span = self.mu_2 - self.mu_s;
        let a = self.crossover_rate(pressure);
        let inverse = 1.0 / (rate + a);
        let mu = self.mu_s + span * rate * inverse;
        let curvature = span * a * inverse * inverse;
        Threshold {
            stress: self.cohesion + pressure * mu,
            by_rate: pressure * curvature,
            by_pressure: mu - 0.5 * rate * curvature,
        }
    }

    /// Ψ = (c + p μ_2) γ̇ − p Δμ a ln(1 + γ̇/a).
    fn potential(&self, rate: f64, pressure: f64) -> f64 {
        if pressure <= 0.0 {
            return self.cohesion * rate;
        }
        let a = self.crossover_rate(pressure);
        (self.cohesion + pressure * self.mu_2) * rate
            - pressure * (self.mu_2 - self.mu_s) * a * (rate / a).ln_1p()
    }

    fn in_units(&self, units: &Units) -> Self {
        Self {
            diameter: self.diameter / units.length,
            grain_density: self.grain_density / units.density,
            cohesion: self.cohesion / units.stress(),
            ..*self
        }
    }
}

impl ShearLaw for MuI {
    fn validate(&self) -> Result<(), Error> {
        MuI::validate(self)
    }

    fn bulk_density(&self) -> f64 {
        MuI::bulk_density(self)
    }

    fn friction_limits(&self) -> [f64; 2] {
        [self.mu_s, self.mu_2]
    }

    fn cohesion(&self) -> f64 {
        self.cohesion
    }

    fn rate_under(&self, shear_stress: f64, pressure: f64) -> f64 {
        let mu = (shear_stress - self.cohesion) / pressure;
        if mu <= self.mu_s {
            0.0
        } else if mu >= self.mu_2 {
            f64::INFINITY
        } else {
            self.inertial_number_at(mu) * (pressure / self.grain_density).sqrt() / self.diameter
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::laws_under_test::{derivatives_agree, rate_inverts_the_threshold, scales};
    use super::*;

    fn glass() -> MuI {
        MuI {
            cohesion: 12.0,
            ..MuI::new(0.382, 0.643, 0.279, 5.3e-4, 0.6, 2450.0)
        }
    }

    #[test]
    fn threshold_is_cohesion_plus_mu_of_i_times_pressure() {
        let law = glass();
        let (rate, pressure) = (37.0, 420.0);
        // I by hand, with the density of the grains: 37 · 5.3e-4 · √(2450/420).
        let inertial_number = 37.0 * 5.3e-4 * (2450.0_f64 / 420.0).sqrt();
        let mu = 0.382 + (0.643 - 0.382) / (1.0 + 0.279 / inertial_number);
        let expected = 12.0 + mu * pressure;
        assert!((law.threshold(rate, pressure).stress / expected - 1.0).abs() < 1e-14);
        assert!((law.mu(law.inertial_number(rate, pressure)) / mu - 1.0).abs() < 1e-14);
        assert!((law.inertial_number_at(mu) / inertial_number - 1.0).abs() < 1e-12);
    }

    #[test]
    fn derivatives_potential_inverse_and_units() {
        for (rate, pressure) in [(0.3, 5.0), (37.0, 420.0), (2e3, 80.0)] {
            derivatives_agree(&glass(), rate, pressure);
            rate_inverts_the_threshold(&glass(), rate, pressure);
        }
        scales(&glass());
    }

    #[test]
    fn only_cohesion_is_left_without_pressure() {
        let at_zero = glass().threshold(10.0, 0.0);
        assert_eq!((at_zero.stress, at_zero.by_rate), (12.0, 0.0));
        let near_zero = glass().threshold(10.0, 1e-12);
        assert!((near_zero.stress - 12.0).abs() < 1e-11 && near_zero.by_pressure.is_finite());
    }

    #[test]
    fn bad_parameters_are_refused_by_name() {
        let message = MuI {
            mu_2: 0.1,
            ..glass()
        }
        .validate()
        .unwrap_err()
        .to_string();
        assert!(message.contains("rheology.mu_2") && message.contains("0.1"));
        assert!(message.contains("0.382"));
        for bad in [
            MuI {
                diameter: 0.0,
                ..glass()
            },
            MuI {
                solid_fraction: 1.5,
                ..glass()
            },
            MuI {
                i_0: f64::NAN,
                ..glass()
            },
            MuI {
                cohesion: -1.0,
                ..glass()
            },
        ] {
            assert!(bad.validate().is_err());
        }
        assert!(glass().validate().is_ok());
    }
}
