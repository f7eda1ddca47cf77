//! Coulomb's law, with cohesion and viscosity: the threshold does not know the size of grains.

use serde::{Deserialize, Serialize};

use super::{Rheology, ShearLaw, Threshold};
use crate::error::{Error, require};
use crate::units::Units;

/// τ = c + μ p + η γ̇.
///
/// Without viscosity it is the law of Coulomb, in plane flow that of Drucker and Prager (*Q. Appl.
/// Math.* 10 (1952) 157); with μ = 0 it is Bingham's, and without viscosity too von Mises'.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Coulomb {
    /// Friction coefficient μ.
    pub mu: f64,
    /// Cohesion c (Pa): the stress borne at zero pressure.
    #[serde(default)]
    pub cohesion: f64,
    /// Viscosity η (Pa s).
    #[serde(default)]
    pub viscosity: f64,
    /// Bulk density ρ (kg/m³).
    pub density: f64,
}

impl Rheology for Coulomb {
    #[inline]
    fn threshold(&self, rate: f64, pressure: f64) -> Threshold {
        let friction = if pressure > 0.0 { self.mu } else { 0.0 };
        Threshold {
            stress: self.cohesion + friction * pressure + self.viscosity * rate,
            by_rate: self.viscosity,
            by_pressure: friction,
        }
    }

    /// Ψ = (c + μ p) γ̇ + ½ η γ̇².
    fn potential(&self, rate: f64, pressure: f64) -> f64 {
        (self.cohesion + self.mu * pressure.max(0.0) + 0.5 * self.viscosity * rate) * rate
    }

    fn in_units(&self, units: &Units) -> Self {
        Self {
            mu: self.mu,
            cohesion: self.cohesion / units.stress(),
            viscosity: self.viscosity / (units.stress() * units.time()),
            density: self.density / units.density,
        }
    }
}

impl ShearLaw for Coulomb {
    fn validate(&self) -> Result<(), Error> {
        for (key, value) in [
            ("rheology.mu_s", self.mu),
            ("rheology.cohesion", self.cohesion),
            ("rheology.viscosity", self.viscosity),
        ] {
            require(value >= 0.0, key, value, "at least 0 and finite")?;
        }
        require(
            self.density > 0.0,
            "rheology.density",
            self.density,
            "greater than 0 and finite",
        )
    }

    fn bulk_density(&self) -> f64 {
        self.density
    }

    fn friction_limits(&self) -> [f64; 2] {
        let largest = if self.viscosity > 0.0 {
            f64::INFINITY
        } else {
            self.mu
        };
        [self.mu, largest]
    }

    fn cohesion(&self) -> f64 {
        self.cohesion
    }

    /// γ̇ = (τ − c − μ p)/η.
    fn rate_under(&self, shear_stress: f64, pressure: f64) -> f64 {
        let excess = shear_stress - self.cohesion - self.mu * pressure;
        if excess <= 0.0 {
            0.0
        } else {
            excess / self.viscosity
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::laws_under_test::{derivatives_agree, rate_inverts_the_threshold, scales};
    use super::*;

    fn mud() -> Coulomb {
        Coulomb {
            mu: 0.4,
            cohesion: 12.0,
            viscosity: 0.7,
            density: 1500.0,
        }
    }

    #[test]
    fn limits_are_the_laws_of_coulomb_bingham_and_von_mises() {
        let coulomb = Coulomb {
            cohesion: 0.0,
            viscosity: 0.0,
            ..mud()
        };
        assert_eq!(coulomb.threshold(3.0, 100.0).stress, 40.0);
        let bingham = Coulomb { mu: 0.0, ..mud() };
        assert_eq!(bingham.threshold(10.0, 1e5).stress, 19.0);
        let mises = Coulomb {
            viscosity: 0.0,
            ..bingham
        };
        assert_eq!(mises.threshold(10.0, 1e5).stress, 12.0);
    }

    #[test]
    fn derivatives_potential_inverse_and_units() {
        for (rate, pressure) in [(0.3, 5.0), (37.0, 420.0), (2e3, 80.0)] {
            derivatives_agree(&mud(), rate, pressure);
            rate_inverts_the_threshold(&mud(), rate, pressure);
        }
        scales(&mud());
    }

    /// Coulomb's law is ill posed at every rate (Schaeffer, *J. Differ. Equ.* 66 (1987) 19), von
    /// Mises' is neutral, Bingham's is well posed.
    #[test]
    fn friction_without_viscosity_is_ill_posed() {
        let coulomb = Coulomb {
            cohesion: 0.0,
            viscosity: 0.0,
            ..mud()
        };
        assert!(!coulomb.is_well_posed(1.0, 100.0));
        assert_eq!(coulomb.threshold(1.0, 100.0).well_posedness(1.0), 0.4 * 0.4);
        let bingham = Coulomb { mu: 0.0, ..mud() };
        assert!(bingham.is_well_posed(1.0, 100.0));
    }

    #[test]
    fn bad_parameters_are_refused_by_name() {
        let message = Coulomb { mu: -0.1, ..mud() }.validate().unwrap_err();
        assert!(message.to_string().contains("rheology.mu_s"));
        let heavy = Coulomb {
            density: f64::NAN,
            ..mud()
        };
        assert!(heavy.validate().is_err() && mud().validate().is_ok());
    }
}
