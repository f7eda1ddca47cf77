//! The angle at which an avalanche comes to rest.

use super::world::{GrainMaterialKeys, Materials, OutputKeys, Place, StepKeys, materials};
use super::{LawKeys, SceneError};
use colluvium_dem::Rolling;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// A bed on a rough base, periodic along and across the slope, that is set moving on one slope after the
/// other.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct AngleOfReposeScene {
    /// Both edges of the base grow with scale, the number of grains with its square.
    #[schemars(extend("minimum" = 0.5, "maximum" = 50.0))]
    pub scale: f64,
    /// Magnitude of gravity (m/s²).
    #[schemars(extend("minimum" = 1.0e-9, "maximum" = 1000.0))]
    pub gravity: f64,
    /// Seed of the bed.
    #[schemars(extend("minimum" = 0, "maximum" = 9007199254740991_i64))]
    pub seed: u64,
    /// A name under which the bed is kept and found again, or a file packing.h5 of an earlier run.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub packing: Option<String>,
    /// The base.
    pub floor: SlopeFloorKeys,
    /// How the angle is looked for.
    pub search: SearchKeys,
    /// The step.
    #[serde(default)]
    pub timestep: StepKeys,
    /// What is written.
    #[serde(default)]
    pub output: OutputKeys,
    /// The law of all contacts.
    pub contact: LawKeys,
    /// The one kind of grains.
    pub grains: BTreeMap<String, GrainMaterialKeys>,
}

/// The base, at scale 1; lengths over the mean diameter of the grains.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SlopeFloorKeys {
    /// Edge downslope.
    #[schemars(extend("minimum" = 4.0, "maximum" = 1000.0))]
    pub length_diameters: f64,
    /// Edge across.
    #[schemars(extend("minimum" = 4.0, "maximum" = 1000.0))]
    pub width_diameters: f64,
    /// Grains on a square diameter; 1.1 are a layer one grain deep.
    #[schemars(extend("minimum" = 3.0, "maximum" = 200.0))]
    pub filling: f64,
}

/// How the angle is looked for: by halving a bracket.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SearchKeys {
    /// Slope at which avalanches must rest (degrees).
    #[schemars(extend("minimum" = 0.0, "exclusiveMaximum" = 90.0))]
    pub low: f64,
    /// Slope at which they must not (degrees).
    #[schemars(extend("exclusiveMinimum" = 0.0, "exclusiveMaximum" = 90.0))]
    pub high: f64,
    /// Width of the bracket at which the search ends (degrees).
    #[schemars(extend("minimum" = 0.05, "maximum" = 20.0))]
    pub resolution: f64,
    /// Shear rate that an avalanche is given, over √(g/d).
    #[schemars(extend("exclusiveMinimum" = 0.0, "maximum" = 10.0))]
    pub shear_scaled: f64,
    /// Time for which it is watched, over √(d/g).
    #[schemars(extend("minimum" = 5.0, "maximum" = 100000.0))]
    pub watch_scaled: f64,
}

impl AngleOfReposeScene {
    /// Its material.
    pub fn materials(&self, origin: &str) -> Result<Materials, SceneError> {
        materials(&self.grains, &BTreeMap::new(), &self.contact, 1.0, origin)
    }

    pub(super) fn check_together(&self, origin: &str) -> Result<(), SceneError> {
        let at = |section| Place { origin, section };
        let materials = self.materials(origin)?;
        if materials.ingredients.len() != 1 {
            let names = materials.names.join(", ");
            return Err(at("").refuse("grains", names, "one kind of grains"));
        }
        if matches!(materials.first_law().rolling, Rolling::Jkr) {
            return Err(at("contact").refuse("normal", "jkr", "a law without adhesion"));
        }
        let search = &self.search;
        if search.high - search.low <= search.resolution {
            let range = format!(
                "more than {} above search.low = {}",
                search.resolution, search.low
            );
            return Err(at("search").refuse("high", search.high, range));
        }
        Ok(())
    }
}
