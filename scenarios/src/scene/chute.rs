//! Keys of the rough chute.

use super::bed::{Pace, check_length};
use super::{LawKeys, SceneError};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Grains on a rough periodic chute, from a start file.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ChuteScene {
    /// Inclination to the horizontal (degrees).
    #[schemars(extend("minimum" = 0.0, "exclusiveMaximum" = 90.0))]
    pub slope_degrees: f64,
    /// Gravity (m/s²).
    #[schemars(extend("exclusiveMinimum" = 0.0, "maximum" = 1000.0))]
    pub gravity: f64,
    /// A start file of one's own, CSV or gzipped CSV: `type` (2 = frozen), radius, density, x, y, z,
    /// vx, vy, vz, and spins as omegax, omegay, omegaz. Left out: the bundled bed.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub start: Option<String>,
    /// Length of the start's periodic box downslope (m).
    #[schemars(extend("exclusiveMinimum" = 0.0, "maximum" = 1.0e5))]
    pub length: f64,
    /// Width of the start's periodic box (m).
    #[schemars(extend("exclusiveMinimum" = 0.0, "maximum" = 1.0e5))]
    pub width: f64,
    /// Copies of the start along x and along y: grains grow with its square.
    #[schemars(extend("minimum" = 1.0, "maximum" = 20.0))]
    pub scale: f64,
    /// Size of the computed parcels over that of the grains: the start is enlarged by it and cut to
    /// the same box and the same mass; law and time step change with it.
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
    /// The contact law of the grains.
    pub contact: LawKeys,
}

impl ChuteScene {
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

    /// Copies of the start along either edge.
    pub fn copies(&self) -> usize {
        self.scale as usize
    }

    /// Edges of the box at this scale (m).
    pub fn edges(&self) -> [f64; 2] {
        [self.length, self.width].map(|l| l * self.scale)
    }

    pub(super) fn check_together(&self, origin: &str) -> Result<(), SceneError> {
        self.contact.law(origin)?;
        check_length(self.steps, self.duration, origin)?;
        if self.scale.fract() != 0.0 {
            return Err(SceneError::OutOfRange {
                file: origin.to_owned(),
                key: "scale".into(),
                value: self.scale.to_string(),
                range: "a whole number in [1, 20]: the start is laid side by side".into(),
            });
        }
        self.pace().check(self.duration, 0.0, origin)
    }
}
