//! A ball that falls into a bed of grains.

use super::ball_zones::{BallZoneKeys, BedContinuumKeys};
use super::collapse_zones::ColumnOverlapKeys;
use super::world::{
    GrainMaterialKeys, Materials, OutputKeys, Place, StepKeys, SurfaceKeys, materials,
};
use super::{LawKeys, SceneError};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// What computes the bed.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum BallModel {
    /// Grains.
    Dem,
    /// Grains in a box about the ball, a continuum beyond it.
    Hybrid,
}

/// A ball hits a bed of grains in a box. At scale 1 the penetration benchmark of Dosta et al. 2024.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct BallImpactScene {
    /// What computes the bed.
    pub model: BallModel,
    /// Speed of the ball at the start, straight down (m/s).
    #[schemars(extend("exclusiveMinimum" = 0.0, "maximum" = 300.0))]
    pub speed: f64,
    /// All lengths but the grains' own, and the duration, grow with scale; the number of grains with its
    /// cube.
    #[schemars(extend("minimum" = 0.2, "maximum" = 3.0))]
    pub scale: f64,
    /// Time that is simulated at scale 1 (s).
    #[schemars(extend("exclusiveMinimum" = 0.0, "maximum" = 100.0))]
    pub duration: f64,
    /// Magnitude of gravity (m/s²).
    #[schemars(extend("minimum" = 1.0e-9, "maximum" = 1000.0))]
    pub gravity: f64,
    /// Seed of the bed.
    #[schemars(extend("minimum" = 0, "maximum" = 9007199254740991_i64))]
    pub seed: u64,
    /// A file with the bed's grains: four columns, radius and place (m), plain or gzipped; left out: a bed
    /// of its own. Only at scale 1.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub bed: Option<String>,
    /// A name under which the bed is kept and found again, or a file packing.h5 of an earlier run.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub packing: Option<String>,
    /// The ball.
    pub ball: BallKeys,
    /// The box.
    pub container: ContainerKeys,
    /// Where grains stay, with model = "hybrid".
    #[serde(default)]
    pub zones: BallZoneKeys,
    /// How grains and continuum are joined, with model = "hybrid".
    #[serde(default)]
    pub overlap: ColumnOverlapKeys,
    /// The continuum, with model = "hybrid".
    #[serde(default)]
    pub continuum: BedContinuumKeys,
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
    /// Further materials, of the ball and the walls.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub surfaces: BTreeMap<String, SurfaceKeys>,
}

/// The ball, at scale 1.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct BallKeys {
    /// Radius (m).
    #[schemars(extend("exclusiveMinimum" = 0.0, "maximum" = 100.0))]
    pub radius: f64,
    /// Density (kg/m³).
    #[schemars(extend("exclusiveMinimum" = 0.0, "maximum" = 30000.0))]
    pub density: f64,
    /// Height of its centre at the start (m).
    #[schemars(extend("minimum" = -1000.0, "maximum" = 1000.0))]
    pub height: f64,
    /// Its material, of `[grains]` or `[surfaces]`.
    pub material: String,
}

/// The box, at scale 1, about the axis x = y = 0.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ContainerKeys {
    /// Edge along x (m).
    #[schemars(extend("exclusiveMinimum" = 0.0, "maximum" = 1000.0))]
    pub length: f64,
    /// Edge along y (m).
    #[schemars(extend("exclusiveMinimum" = 0.0, "maximum" = 1000.0))]
    pub width: f64,
    /// Height of the floor (m).
    #[schemars(extend("minimum" = -1000.0, "maximum" = 1000.0))]
    pub floor: f64,
    /// Grains in it.
    #[schemars(extend("minimum" = 1, "maximum" = 10000000))]
    pub grains: u64,
    /// Material of floor and sides, of `[grains]` or `[surfaces]`.
    pub material: String,
}

impl BallImpactScene {
    /// Its materials.
    pub fn materials(&self, origin: &str) -> Result<Materials, SceneError> {
        materials(&self.grains, &self.surfaces, &self.contact, 1.0, origin)
    }

    /// Grains of the bed.
    pub fn count(&self) -> usize {
        (self.container.grains as f64 * self.scale.powi(3))
            .round()
            .max(1.0) as usize
    }

    /// Radius of the ball (m).
    pub fn ball_radius(&self) -> f64 {
        self.scale * self.ball.radius
    }

    /// Height of the floor (m).
    pub fn floor(&self) -> f64 {
        self.scale * self.container.floor
    }

    pub(super) fn check_together(&self, origin: &str) -> Result<(), SceneError> {
        let at = |section| Place { origin, section };
        let materials = self.materials(origin)?;
        materials.number(&self.ball.material, "material", at("ball"))?;
        materials.number(&self.container.material, "material", at("container"))?;
        if self.bed.is_some() && self.scale != 1.0 {
            return Err(at("").refuse("scale", self.scale, "1 with the bed of a file"));
        }
        let (ball, floor) = (&self.ball, self.container.floor);
        if ball.height <= floor + ball.radius {
            let least = format!(
                "above {}: the ball's underside above the floor",
                floor + ball.radius
            );
            return Err(at("ball").refuse("height", ball.height, least));
        }
        let widest = materials
            .ingredients
            .iter()
            .map(|i| 2.0 * i.sizes.largest());
        let widest = widest.fold(2.0 * self.ball_radius(), f64::max);
        for (key, edge) in [
            ("length", self.container.length),
            ("width", self.container.width),
        ] {
            if self.scale * edge < 1.2 * widest {
                let least = format!(
                    "at least {}: 1.2 diameters of the ball and of every grain",
                    1.2 * widest / self.scale
                );
                return Err(at("container").refuse(key, edge, least));
            }
        }
        self.check_zones(origin)
    }
}
