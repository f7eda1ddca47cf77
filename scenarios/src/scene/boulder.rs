//! Keys of the boulder drop.

use super::comet::{CometBlockKeys, CometKeys};
use super::world::{BondKeys, Materials, OutputKeys, StepKeys, SurfaceKeys};
use super::{LawKeys, SceneError};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// A boulder of cometary material dropped on a plane (Kappel et al. 2020, §3.1).
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct BoulderScene {
    /// Seed of all random numbers.
    #[schemars(extend("minimum" = 0, "maximum" = 9007199254740991_i64))]
    pub seed: u64,
    /// Size of the computed parcels over that of the grains.
    #[schemars(extend("minimum" = 1.0, "maximum" = 1.0e6))]
    pub coarse_graining: f64,
    /// Diameter of the boulder (m).
    #[schemars(extend("exclusiveMinimum" = 0.0, "maximum" = 1.0e4))]
    pub diameter: f64,
    /// A packing to start from: a name, under which the boulder is kept and found again, or a file
    /// `packing.h5` of an earlier run.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub packing: Option<String>,
    /// What it is made of.
    pub material: CometKeys,
    /// How it is made.
    pub preparation: CometBlockKeys,
    /// How it hits the ground.
    pub impact: BoulderImpactKeys,
    /// What the ground is like.
    pub ground: GroundKeys,
    /// The law of all contacts.
    pub contact: LawKeys,
    /// Bonds of ice to ice, where the material is sintered.
    pub sinter: BondKeys,
    /// The step.
    #[serde(default)]
    pub timestep: StepKeys,
    /// What is written.
    #[serde(default)]
    pub output: OutputKeys,
}

/// The impact.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct BoulderImpactKeys {
    /// Speed (m/s).
    #[schemars(extend("exclusiveMinimum" = 0.0, "maximum" = 1.0e3))]
    pub speed: f64,
    /// Angle to the normal of the ground (degrees).
    #[schemars(extend("minimum" = 0.0, "exclusiveMaximum" = 90.0))]
    pub degrees: f64,
    /// Gravity (m/s²).
    #[schemars(extend("minimum" = 0.0, "maximum" = 1.0e3))]
    pub gravity: f64,
    /// Longest time that is simulated; a boulder at rest ends it (s).
    #[schemars(extend("exclusiveMinimum" = 0.0, "maximum" = 1.0e7))]
    pub duration: f64,
}

/// The ground, a plane; friction and cohesion are those of the grains.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct GroundKeys {
    /// Restitution; mixed with that of the grains by the geometric mean.
    #[schemars(extend("minimum" = 0.01, "maximum" = 1.0))]
    pub restitution: f64,
    /// E (Pa).
    #[schemars(extend("exclusiveMinimum" = 0.0, "maximum" = 1.0e13))]
    pub youngs_modulus: f64,
}

impl BoulderScene {
    /// Its materials, of parcels where there are any, and the ground's.
    pub fn materials(&self, origin: &str) -> Result<Materials, SceneError> {
        let ground = SurfaceKeys {
            contact: LawKeys {
                restitution: Some(self.ground.restitution),
                youngs_modulus: Some(self.ground.youngs_modulus),
                ..LawKeys::default()
            },
        };
        let surfaces = BTreeMap::from([("ground".to_owned(), ground)]);
        self.material
            .materials(&self.contact, &surfaces, self.coarse_graining, origin)
    }

    pub(super) fn check_together(&self, origin: &str) -> Result<(), SceneError> {
        self.material.check_together(origin)?;
        self.preparation
            .softness()
            .check_together(&self.contact, origin)?;
        self.materials(origin)?;
        let widest = self.coarse_graining * self.material.largest_diameter;
        if 4.0 * widest > self.diameter {
            return Err(SceneError::OutOfRange {
                file: origin.to_owned(),
                key: "coarse_graining".into(),
                value: self.coarse_graining.to_string(),
                range: format!(
                    "such that four of the largest parcels fit across the boulder: at most {:.3}",
                    self.diameter / (4.0 * self.material.largest_diameter)
                ),
            });
        }
        Ok(())
    }
}
