//! The continuum's case that a scene describes: where the name of a law becomes a type.

use super::bagnold::{BagnoldScene, FrictionLaw};
use colluvium_continuum::Error;
use colluvium_continuum::bagnold::{BagnoldCase, BagnoldSolution};
use colluvium_continuum::layer::{Options, Progress};
use colluvium_continuum::rheology::{BarkerGray, Coulomb, FrictionTable, MuI, ShearLaw};
use std::ops::ControlFlow;

/// A layer with its law.
pub enum LayerCase {
    /// μ(I).
    MuI(BagnoldCase<MuI>),
    /// Coulomb's law with viscosity.
    Coulomb(BagnoldCase<Coulomb>),
    /// Barker and Gray's law.
    BarkerGray(BagnoldCase<BarkerGray>),
    /// A table.
    Table(BagnoldCase<FrictionTable>),
}

/// What is done with a case whatever its law.
pub trait LayerVisitor {
    /// What comes of it.
    type Output;
    /// Does it.
    fn visit<L: ShearLaw>(self, case: &BagnoldCase<L>) -> Self::Output;
}

/// Evaluates one expression for the case of whatever law.
macro_rules! of_any_law {
    ($layer:expr, $case:ident => $value:expr) => {
        match $layer {
            LayerCase::MuI($case) => $value,
            LayerCase::Coulomb($case) => $value,
            LayerCase::BarkerGray($case) => $value,
            LayerCase::Table($case) => $value,
        }
    };
}

impl LayerCase {
    /// The case of a scene whose keys are complete.
    ///
    /// # Errors
    /// Numbers with which the law means nothing.
    pub fn of(scene: &BagnoldScene) -> Result<LayerCase, Error> {
        let r = &scene.rheology;
        Ok(match r.law {
            FrictionLaw::MuI => LayerCase::MuI(layer(scene, r.mu_i())),
            FrictionLaw::Coulomb => LayerCase::Coulomb(layer(scene, r.coulomb())),
            FrictionLaw::BarkerGray => LayerCase::BarkerGray(layer(scene, r.barker_gray()?)),
            FrictionLaw::Table => LayerCase::Table(layer(scene, r.friction_table()?)),
        })
    }

    /// Refuses what has no steady flow.
    ///
    /// # Errors
    /// [`Error::OutOfRange`] with the key, the value and the allowed range.
    pub fn validate(&self) -> Result<(), Error> {
        of_any_law!(self, case => case.validate())
    }

    /// Does something with the case.
    pub fn visit<V: LayerVisitor>(&self, visitor: V) -> V::Output {
        of_any_law!(self, case => visitor.visit(case))
    }

    /// Computes the flow.
    ///
    /// # Errors
    /// As [`BagnoldCase::solve`].
    pub fn solve(
        &self,
        options: &Options,
        progress: &mut dyn FnMut(Progress) -> ControlFlow<()>,
    ) -> Result<BagnoldSolution, Error> {
        of_any_law!(self, case => case.solve(options, progress))
    }

    /// Shear stress on the base (Pa): the weight along the plane.
    pub fn base_shear_stress(&self) -> f64 {
        of_any_law!(self, case => case.exact_shear_stress(0.0))
    }

    /// Exact velocity at the surface (m/s).
    pub fn surface_velocity(&self) -> f64 {
        of_any_law!(self, case => case.exact_velocity(case.depth))
    }

    /// Whether the whole depth rests.
    pub fn rests(&self) -> bool {
        of_any_law!(self, case => case.plug_thickness() >= case.depth)
    }

    /// Strain rate on the base (1/s), and whether waves do not grow there.
    pub fn base(&self) -> (f64, bool) {
        of_any_law!(self, case => {
            let pressure = case.exact_pressure(0.0);
            let rate = case.rheology.rate_under(case.exact_shear_stress(0.0), pressure);
            (rate, colluvium_continuum::rheology::Rheology::is_well_posed(&case.rheology, rate, pressure))
        })
    }

    /// Pressure on the base (Pa).
    pub fn base_pressure(&self) -> f64 {
        of_any_law!(self, case => case.exact_pressure(0.0))
    }
}

fn layer<L: ShearLaw>(scene: &BagnoldScene, rheology: L) -> BagnoldCase<L> {
    BagnoldCase {
        slope: scene.slope_degrees.to_radians(),
        depth: scene.depth,
        gravity: scene.gravity,
        rheology,
        cells: scene.cells(),
        columns: scene.grid.columns(),
    }
}
