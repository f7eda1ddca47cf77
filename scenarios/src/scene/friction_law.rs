//! The law of friction that `[rheology]` describes: where its name becomes a law.

use super::bagnold::{FrictionLaw, RheologyKeys};
use colluvium_continuum::Error;
use colluvium_continuum::rheology::{AnyLaw, BarkerGray, Coulomb, FrictionTable, Grains, MuI};

/// A number that the scene's check has seen to be there, as its law reads it.
fn number(value: Option<f64>) -> f64 {
    value.unwrap_or(f64::NAN)
}

impl RheologyKeys {
    /// The law.
    ///
    /// # Errors
    /// Numbers with which the law means nothing.
    pub fn any_law(&self) -> Result<AnyLaw, Error> {
        Ok(match self.law {
            FrictionLaw::MuI => self.mu_i().into(),
            FrictionLaw::Coulomb => self.coulomb().into(),
            FrictionLaw::BarkerGray => self.barker_gray()?.into(),
            FrictionLaw::Table => self.friction_table()?.into(),
        })
    }

    /// The inertial numbers between which the law was measured, if the scene or a table says so.
    pub fn valid_inertial_numbers(&self) -> Option<[f64; 2]> {
        match self.valid_i.as_deref() {
            Some(&[low, high]) => Some([low, high]),
            _ if self.law == FrictionLaw::Table => {
                let table = self.friction_table().ok()?;
                Some(table.valid_inertial_numbers())
            }
            _ => None,
        }
    }

    /// μ(I) with these numbers.
    pub fn mu_i(&self) -> MuI {
        MuI {
            mu_s: number(self.mu_s),
            mu_2: number(self.mu_2),
            i_0: number(self.i_0),
            diameter: self.diameter,
            solid_fraction: self.solid_fraction,
            grain_density: self.grain_density,
            cohesion: self.cohesion,
        }
    }

    /// Coulomb's law with these numbers.
    pub fn coulomb(&self) -> Coulomb {
        Coulomb {
            mu: number(self.mu_s),
            cohesion: self.cohesion,
            viscosity: number(self.viscosity),
            density: self.solid_fraction * self.grain_density,
        }
    }

    /// Barker and Gray's law with these numbers.
    ///
    /// # Errors
    /// Numbers for which there is no such law.
    pub fn barker_gray(&self) -> Result<BarkerGray, Error> {
        BarkerGray::new(self.mu_i(), number(self.alpha), number(self.mu_infinity))
    }

    /// The law through these points.
    ///
    /// # Errors
    /// Points that no law goes through.
    pub fn friction_table(&self) -> Result<FrictionTable, Error> {
        let points: Vec<[f64; 2]> = self
            .table
            .iter()
            .flatten()
            .filter_map(|point| point.as_slice().try_into().ok())
            .collect();
        let grains = Grains {
            diameter: self.diameter,
            solid_fraction: self.solid_fraction,
            grain_density: self.grain_density,
            cohesion: self.cohesion,
        };
        FrictionTable::new(&points, grains)
    }
}
