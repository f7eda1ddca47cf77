//! Grains that become another material during a run: a crack, a weathered layer.
//!
//! Sizes, masses, motion, contacts with their springs and bonds stay; from the next step on forces follow the
//! other material's laws. An energy ledger that is open is opened anew: what an attraction held is gone.

use crate::setup::{SetupError, known_material};
use crate::simulation::Simulation;
use crate::snapshot::GrainSample;

impl Simulation {
    /// Gives every grain for which `f` names one another material, and says how many.
    ///
    /// # Errors
    /// If a law table has no material of that number. Nothing has changed then.
    pub fn convert(
        &mut self,
        mut f: impl FnMut(&GrainSample) -> Option<u16>,
    ) -> Result<usize, SetupError> {
        let named: Vec<Option<u16>> = self.samples().iter().map(&mut f).collect();
        for material in named.iter().flatten() {
            known_material(*material, self.law.materials())?;
        }
        self.forget_observation();
        let mut count = 0;
        for (own, material) in self.grains.material.iter_mut().zip(&named) {
            if let Some(material) = material {
                *own = *material;
                count += 1;
            }
        }
        if count > 0 {
            // Copies of grains beside other chunks carry materials too.
            self.rebuild();
            if self.ledger.is_some() {
                self.open_energy_ledger();
            }
        }
        Ok(count)
    }
}
