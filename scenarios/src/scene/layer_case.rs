//! The continuum's layer that a scene describes.

use super::bagnold::BagnoldScene;
use colluvium_continuum::Error;
use colluvium_continuum::bagnold::{BagnoldCase, BagnoldSolution};
use colluvium_continuum::layer::{Options, Progress};
use colluvium_continuum::rheology::{AnyLaw, Rheology, ShearLaw};
use std::ops::ControlFlow;

/// A layer with its law.
pub struct LayerCase(pub BagnoldCase<AnyLaw>);

impl LayerCase {
    /// The case of a scene whose keys are complete.
    ///
    /// # Errors
    /// Numbers with which the law means nothing.
    pub fn of(scene: &BagnoldScene) -> Result<LayerCase, Error> {
        Ok(LayerCase(BagnoldCase {
            slope: scene.slope_degrees.to_radians(),
            depth: scene.depth,
            gravity: scene.gravity,
            rheology: scene.rheology.any_law()?,
            cells: scene.cells(),
            columns: scene.grid.columns(),
        }))
    }

    /// Refuses what has no steady flow.
    ///
    /// # Errors
    /// [`Error::OutOfRange`] with the key, the value and the allowed range.
    pub fn validate(&self) -> Result<(), Error> {
        self.0.validate()
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
        self.0.solve(options, progress)
    }

    /// Shear stress on the base (Pa): the weight along the plane.
    pub fn base_shear_stress(&self) -> f64 {
        self.0.exact_shear_stress(0.0)
    }

    /// Exact velocity at the surface (m/s).
    pub fn surface_velocity(&self) -> f64 {
        self.0.exact_velocity(self.0.depth)
    }

    /// Whether the whole depth rests.
    pub fn rests(&self) -> bool {
        self.0.plug_thickness() >= self.0.depth
    }

    /// Strain rate on the base (1/s), and whether waves do not grow there.
    pub fn base(&self) -> (f64, bool) {
        let case = &self.0;
        let pressure = case.exact_pressure(0.0);
        let rate = case
            .rheology
            .rate_under(case.exact_shear_stress(0.0), pressure);
        (rate, case.rheology.is_well_posed(rate, pressure))
    }

    /// Pressure on the base (Pa).
    pub fn base_pressure(&self) -> f64 {
        self.0.exact_pressure(0.0)
    }
}
