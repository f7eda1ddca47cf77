//! Keys of the tensile test.

use super::comet::{CometBlockKeys, CometKeys};
use super::world::{BondKeys, Materials, OutputKeys, StepKeys};
use super::{LawKeys, SceneError};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// A cylinder of cometary material pulled to its breaking point (Kappel et al. 2020, §3.3).
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct TensileScene {
    /// Seed of the first sample; each further one has the next.
    #[schemars(extend("minimum" = 0, "maximum" = 9007199254740000_i64))]
    pub seed: u64,
    /// Samples, each with a seed of its own: the result is their mean with its standard error.
    #[schemars(extend("minimum" = 1, "maximum" = 100))]
    pub samples: usize,
    /// Size of the computed parcels over that of the grains.
    #[schemars(extend("minimum" = 1.0, "maximum" = 1.0e6))]
    pub coarse_graining: f64,
    /// A packing to start from: a name, under which the sample is kept and found again, or a file
    /// `packing.h5` of an earlier run.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub packing: Option<String>,
    /// What it is made of.
    pub material: CometKeys,
    /// Its shape.
    pub sample: SampleKeys,
    /// How it is made.
    pub preparation: CometBlockKeys,
    /// What holds it.
    pub clamp: ClampKeys,
    /// How it is pulled.
    pub pull: PullKeys,
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

/// The cylinder.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SampleKeys {
    /// Diameter (m).
    #[schemars(extend("exclusiveMinimum" = 0.0, "maximum" = 1.0e3))]
    pub diameter: f64,
    /// Height, the head in the clamp included (m).
    #[schemars(extend("exclusiveMinimum" = 0.0, "maximum" = 1.0e3))]
    pub height: f64,
}

/// The clamp: a truncated cone that widens upwards.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ClampKeys {
    /// How it holds the sample's head.
    pub kind: ClampKind,
    /// Height of the cone (m).
    #[schemars(extend("exclusiveMinimum" = 0.0, "maximum" = 1.0e3))]
    pub height: f64,
    /// Angle of its side to the axis (degrees).
    #[schemars(extend("minimum" = 0.0, "maximum" = 80.0))]
    pub angle_degrees: f64,
}

/// Ways in which a clamp holds.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum ClampKind {
    /// Grains within a mean diameter of the cone are held fast.
    Gripped,
    /// The cone is a wall into which the sample is seated under a small weight.
    Wall,
}

/// The pull on the sample's flat bottom.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct PullKeys {
    /// Rise of the stress over Rumpf's estimate of the strength (1/s).
    #[schemars(extend("exclusiveMinimum" = 0.0, "maximum" = 1.0e6))]
    pub rate: f64,
    /// Step of the stress over the same estimate.
    #[schemars(extend("exclusiveMinimum" = 0.0, "maximum" = 0.5))]
    pub step: f64,
    /// Steps' times that the pull waits at most until the clamp feels what is pulled; 1: it never waits.
    #[schemars(extend("minimum" = 1.0, "maximum" = 1.0e3))]
    pub patience: f64,
    /// Stress at which the test is given up, over the same estimate.
    #[schemars(extend("exclusiveMinimum" = 0.0, "maximum" = 1.0e3))]
    pub limit: f64,
}

impl TensileScene {
    /// Its materials, of parcels where there are any.
    pub fn materials(&self, origin: &str) -> Result<Materials, SceneError> {
        self.material.materials(
            &self.contact,
            &BTreeMap::new(),
            self.coarse_graining,
            origin,
        )
    }

    pub(super) fn check_together(&self, origin: &str) -> Result<(), SceneError> {
        self.material.check_together(origin)?;
        self.preparation
            .softness()
            .check_together(&self.contact, origin)?;
        self.materials(origin)?;
        let refuse = |key: &str, value: f64, range: String| {
            Err(SceneError::OutOfRange {
                file: origin.to_owned(),
                key: key.to_owned(),
                value: value.to_string(),
                range,
            })
        };
        if self.clamp.height >= 0.5 * self.sample.height {
            let range = format!(
                "below half the sample's height, {}",
                0.5 * self.sample.height
            );
            return refuse("clamp.height", self.clamp.height, range);
        }
        let widest = self.coarse_graining * self.material.largest_diameter;
        if 4.0 * widest > self.sample.diameter {
            let range = format!(
                "such that four of the largest parcels fit across the sample: at most {:.3}",
                self.sample.diameter / (4.0 * self.material.largest_diameter)
            );
            return refuse("coarse_graining", self.coarse_graining, range);
        }
        Ok(())
    }
}
