//! Flat-bottomed silos that run out of round openings.

use super::world::{
    GrainMaterialKeys, Materials, OutputKeys, Place, StepKeys, SurfaceKeys, materials,
};
use super::{LawKeys, SceneError};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// Silos side by side, each with an opening of its own.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SiloScene {
    /// Diameters of the openings, over the mean diameter of the grains; one silo each.
    #[schemars(extend("minItems" = 1, "maxItems" = 12))]
    pub openings_diameters: Vec<f64>,
    /// Diameter of a silo over that of its opening, at scale 1.
    #[schemars(extend("minimum" = 1.5, "maximum" = 100.0))]
    pub container_ratio: f64,
    /// Depth of the filling over the mean diameter of the grains, at scale 1.
    #[schemars(extend("minimum" = 2.0, "maximum" = 10000.0))]
    pub depth_diameters: f64,
    /// Silos and fillings grow with scale, openings do not.
    #[schemars(extend("minimum" = 0.5, "maximum" = 20.0))]
    pub scale: f64,
    /// Time that is simulated once the openings are free (s).
    #[schemars(extend("exclusiveMinimum" = 0.0, "maximum" = 10000.0))]
    pub duration: f64,
    /// Magnitude of gravity (m/s²).
    #[schemars(extend("minimum" = 1.0e-9, "maximum" = 1000.0))]
    pub gravity: f64,
    /// Seed of the fillings.
    #[schemars(extend("minimum" = 0, "maximum" = 9007199254740991_i64))]
    pub seed: u64,
    /// A name under which the fillings are kept and found again, or a file packing.h5 of an earlier run.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub packing: Option<String>,
    /// Material of the walls, of `[grains]` or `[surfaces]`; left out: the first kind of grains.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub wall_material: Option<String>,
    /// The step.
    #[serde(default)]
    pub timestep: StepKeys,
    /// What is written.
    #[serde(default)]
    pub output: OutputKeys,
    /// The law of all contacts.
    pub contact: LawKeys,
    /// Kinds of grains by name.
    pub grains: BTreeMap<String, GrainMaterialKeys>,
    /// Further materials of the walls.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub surfaces: BTreeMap<String, SurfaceKeys>,
}

/// Openings narrower than this clog (diameters).
const NARROWEST: f64 = 2.5;

impl SiloScene {
    /// Its materials.
    pub fn materials(&self, origin: &str) -> Result<Materials, SceneError> {
        materials(&self.grains, &self.surfaces, &self.contact, 1.0, origin)
    }

    pub(super) fn check_together(&self, origin: &str) -> Result<(), SceneError> {
        let top = Place {
            origin,
            section: "",
        };
        let materials = self.materials(origin)?;
        if let Some(name) = &self.wall_material {
            materials.number(name, "wall_material", top)?;
        }
        for (k, &size) in self.openings_diameters.iter().enumerate() {
            if !(NARROWEST..=1000.0).contains(&size) {
                let range = format!("[{NARROWEST}, 1000]: narrower openings clog");
                return Err(top.refuse(&format!("openings_diameters[{k}]"), size, range));
            }
        }
        Ok(())
    }
}
