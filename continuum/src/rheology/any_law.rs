//! A law that is chosen when a program runs.

use super::{BarkerGray, Coulomb, FrictionTable, MuI, Rheology, ShearLaw, Threshold};
use crate::error::Error;
use crate::units::Units;

/// Any of the laws as one type: what is read from a file goes through one compiled solver, not through one a law.
#[derive(Debug, Clone, PartialEq)]
pub enum AnyLaw {
    /// μ(I), with or without cohesion.
    MuI(MuI),
    /// Coulomb's law, Bingham's and von Mises' with it.
    Coulomb(Coulomb),
    /// Barker and Gray's.
    BarkerGray(BarkerGray),
    /// Measured points.
    Table(FrictionTable),
}

/// Evaluates one expression with whatever law it is.
macro_rules! of {
    ($any:expr, $law:ident => $value:expr) => {
        match $any {
            AnyLaw::MuI($law) => $value,
            AnyLaw::Coulomb($law) => $value,
            AnyLaw::BarkerGray($law) => $value,
            AnyLaw::Table($law) => $value,
        }
    };
}

macro_rules! from {
    ($($law:ident => $variant:ident),+) => {$(
        impl From<$law> for AnyLaw {
            fn from(law: $law) -> Self {
                AnyLaw::$variant(law)
            }
        }
    )+};
}

from!(MuI => MuI, Coulomb => Coulomb, BarkerGray => BarkerGray, FrictionTable => Table);

impl Rheology for AnyLaw {
    #[inline]
    fn threshold(&self, rate: f64, pressure: f64) -> Threshold {
        of!(self, law => law.threshold(rate, pressure))
    }

    fn potential(&self, rate: f64, pressure: f64) -> f64 {
        of!(self, law => law.potential(rate, pressure))
    }

    fn is_well_posed(&self, rate: f64, pressure: f64) -> bool {
        of!(self, law => law.is_well_posed(rate, pressure))
    }

    fn is_well_posed_in_space(&self, rate: f64, pressure: f64, middle: f64) -> bool {
        of!(self, law => law.is_well_posed_in_space(rate, pressure, middle))
    }

    fn in_units(&self, units: &Units) -> Self {
        of!(self, law => law.in_units(units).into())
    }
}

impl ShearLaw for AnyLaw {
    fn validate(&self) -> Result<(), Error> {
        of!(self, law => ShearLaw::validate(law))
    }

    fn bulk_density(&self) -> f64 {
        of!(self, law => ShearLaw::bulk_density(law))
    }

    fn friction_limits(&self) -> [f64; 2] {
        of!(self, law => law.friction_limits())
    }

    fn cohesion(&self) -> f64 {
        of!(self, law => ShearLaw::cohesion(law))
    }

    fn rate_under(&self, shear_stress: f64, pressure: f64) -> f64 {
        of!(self, law => law.rate_under(shear_stress, pressure))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::rheology::Grains;

    const GRAINS: Grains = Grains {
        diameter: 5.3e-4,
        solid_fraction: 0.6,
        grain_density: 2450.0,
        cohesion: 12.0,
    };

    /// Everything that a solver asks of a law, to the bit.
    fn answers(law: &impl ShearLaw) -> Vec<u64> {
        let mut answers = Vec::new();
        for (rate, pressure) in [
            (0.0, 3.0),
            (0.3, 5.0),
            (37.0, 420.0),
            (2e3, 80.0),
            (1.0, -1.0),
        ] {
            let threshold = law.threshold(rate, pressure);
            answers.extend([threshold.stress, threshold.by_rate, threshold.by_pressure]);
            answers.push(law.potential(rate, pressure));
            for middle in [-0.5, 0.0, 0.5] {
                answers.push(f64::from(u8::from(
                    law.is_well_posed_in_space(rate, pressure, middle),
                )));
            }
            answers.push(f64::from(u8::from(law.is_well_posed(rate, pressure))));
            answers.push(law.rate_under(0.5 * pressure, pressure));
        }
        answers.extend(law.friction_limits());
        answers.extend([law.bulk_density(), law.cohesion()]);
        answers.push(f64::from(u8::from(law.validate().is_ok())));
        answers.into_iter().map(f64::to_bits).collect()
    }

    #[test]
    fn it_answers_as_the_law_in_it_and_as_no_other() {
        let mu_i = MuI {
            cohesion: 12.0,
            ..MuI::new(0.382, 0.643, 0.279, 5.3e-4, 0.6, 2450.0)
        };
        let bad = Coulomb {
            mu: -0.1,
            cohesion: 0.0,
            viscosity: 1.0,
            density: 1500.0,
        };
        let barker_gray = BarkerGray::new(mu_i, 1.9, 0.05).unwrap();
        let table = FrictionTable::new(&[[0.0, 0.3], [0.1, 0.5], [0.4, 0.6]], GRAINS).unwrap();
        let units = Units::of_gravity(3.0, 1500.0, 9.81);
        let mut all = Vec::new();
        macro_rules! same {
            ($law:expr) => {
                let any = AnyLaw::from($law.clone());
                assert_eq!(answers(&any), answers(&$law));
                assert_eq!(
                    answers(&any.in_units(&units)),
                    answers(&$law.in_units(&units))
                );
                all.push(answers(&any));
            };
        }
        same!(mu_i);
        same!(bad);
        same!(barker_gray);
        same!(table);
        all.dedup();
        assert_eq!(all.len(), 4);
    }
}
