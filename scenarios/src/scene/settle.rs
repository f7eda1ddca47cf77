//! Keys of the settling box.

use super::bed::{Pace, check_length};
use super::{LEAST_MASS, LawKeys, SceneError};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Loose grains that fall into a box with walls and come to rest.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SettleScene {
    /// Gravity along -z (m/s²).
    #[schemars(extend("exclusiveMinimum" = 0.0, "maximum" = 1000.0))]
    pub gravity: f64,
    /// A start file of one's own, CSV or gzipped CSV: radius, density, x, y, z, vx, vy, vz, and spins
    /// as omegax, omegay, omegaz. Left out: loose grains drawn from the seed.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub start: Option<String>,
    /// Seed of the random numbers that draw the loose grains.
    #[schemars(extend("minimum" = 0, "maximum" = 9007199254740991_i64))]
    pub seed: u64,
    /// Both edges of the floor grow with it, grains with its square; the depth stays.
    #[schemars(extend("minimum" = 0.1, "maximum" = 50.0))]
    pub scale: f64,
    /// Size of the computed parcels over that of the grains: there are fewer of them by its cube; law
    /// and time step change with it.
    #[schemars(extend("minimum" = 1.0, "maximum" = 10.0))]
    pub coarse_graining: f64,
    /// Time step for the grains (s); that of parcels is coarse_graining times as long.
    #[schemars(extend("exclusiveMinimum" = 0.0, "maximum" = 1.0))]
    pub timestep: f64,
    /// Steps of the run; or give its duration.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend("minimum" = 1, "maximum" = 1000000000))]
    pub steps: Option<u64>,
    /// Duration (s); or give the steps.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend("exclusiveMinimum" = 0.0, "maximum" = 1.0e7))]
    pub duration: Option<f64>,
    /// Steps between two rows of `energy.csv`.
    #[schemars(extend("minimum" = 1, "maximum" = 1000000000))]
    pub record_every: u64,
    /// Whether those rows also hold the work of gravity and the heat of each channel of the contacts.
    #[serde(default)]
    pub ledger: bool,
    /// Instants in `grains.vtkhdf` and `contacts.vtkhdf` besides the start, for ParaView; 0 writes none.
    #[serde(default)]
    #[schemars(extend("minimum" = 0, "maximum" = 100000))]
    pub frames: u64,
    /// The grains.
    pub grains: SettleGrains,
    /// The floor, between four walls.
    pub floor: SettleFloor,
    /// The contact law of the grains, and of the walls with them.
    pub contact: LawKeys,
}

/// The grains that settle.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SettleGrains {
    /// Mean radius (m).
    #[schemars(extend("exclusiveMinimum" = 0.0, "maximum" = 10.0))]
    pub radius: f64,
    /// Half width of the uniform law of radii over their mean.
    #[schemars(extend("minimum" = 0.0, "maximum" = 0.5))]
    pub spread: f64,
    /// Density of the grains' material (kg/m³).
    #[schemars(extend("exclusiveMinimum" = 0.0, "maximum" = 30000.0))]
    pub density: f64,
    /// Grains at scale 1.
    #[schemars(extend("minimum" = 1, "maximum" = 10000000))]
    pub count: u64,
}

/// The floor between the walls.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SettleFloor {
    /// Length along x at scale 1 (m).
    #[schemars(extend("exclusiveMinimum" = 0.0, "maximum" = 1.0e4))]
    pub length: f64,
    /// Width along y at scale 1 (m).
    #[schemars(extend("exclusiveMinimum" = 0.0, "maximum" = 1.0e4))]
    pub width: f64,
}

impl SettleScene {
    /// Steps and their length.
    pub fn pace(&self) -> Pace {
        Pace::of(
            self.timestep,
            self.coarse_graining,
            self.steps,
            self.duration,
            [self.record_every, self.frames],
        )
    }

    /// Grains or parcels to be drawn: the mass is that of the grains.
    pub fn count(&self) -> usize {
        let grains = self.grains.count as f64 * self.scale * self.scale;
        (grains / self.coarse_graining.powi(3)).round().max(1.0) as usize
    }

    /// Edges of the floor at this scale (m).
    pub fn edges(&self) -> [f64; 2] {
        [self.floor.length, self.floor.width].map(|l| l * self.scale)
    }

    /// Mean radius of the computed parcels (m).
    pub fn radius(&self) -> f64 {
        self.grains.radius * self.coarse_graining
    }

    pub(super) fn check_together(&self, origin: &str) -> Result<(), SceneError> {
        let out_of_range = |key: &str, value: f64, range: String| {
            Err(SceneError::OutOfRange {
                file: origin.to_owned(),
                key: key.to_owned(),
                value: value.to_string(),
                range,
            })
        };
        self.contact.law(origin)?;
        check_length(self.steps, self.duration, origin)?;
        if self.grains.density * self.grains.radius.powi(3) <= LEAST_MASS {
            return out_of_range(
                "grains.radius",
                self.grains.radius,
                format!("such that a grain is heavier than {LEAST_MASS:e} kg"),
            );
        }
        let widest = 2.0 * self.radius() * (1.0 + self.grains.spread);
        for (key, edge, given) in [
            ("floor.length", self.edges()[0], self.floor.length),
            ("floor.width", self.edges()[1], self.floor.width),
        ] {
            // The loose lattice leaves two hundredths between neighbours.
            if edge < 1.05 * widest {
                return out_of_range(
                    key,
                    given,
                    format!(
                        "at least {}: the largest grain has to fit between the walls",
                        1.05 * widest / self.scale
                    ),
                );
            }
        }
        self.pace()
            .check(self.duration, self.count() as f64, origin)
    }
}
