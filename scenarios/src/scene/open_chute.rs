//! Keys of a chute that is fed at its upper end and open at its lower one.

use super::collapse::{check_rheology, check_size_of_grains, out_of_range};
use super::contact::SurfaceKeys;
use super::{CollapseSolver, RheologyKeys, SceneError};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// A layer that enters a rough chute at one end and leaves it at the other.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct OpenChuteScene {
    /// Inclination to the horizontal (degrees).
    #[schemars(extend("minimum" = 0.0, "exclusiveMaximum" = 90.0))]
    pub slope_degrees: f64,
    /// Depth of the layer that enters, normal to the chute (m).
    #[schemars(extend("exclusiveMinimum" = 0.0, "maximum" = 1.0e5))]
    pub depth: f64,
    /// Gravity (m/s²).
    #[schemars(extend("exclusiveMinimum" = 0.0, "maximum" = 1000.0))]
    pub gravity: f64,
    /// Time over √(depth/gravity).
    #[schemars(extend("exclusiveMinimum" = 0.0, "maximum" = 1.0e4))]
    pub duration_scaled: f64,
    /// Size of the run: cells along each axis grow with it.
    #[schemars(extend("minimum" = 0.1, "maximum" = 64.0))]
    pub scale: f64,
    /// The material.
    pub rheology: RheologyKeys,
    /// What enters.
    pub inflow: InflowKeys,
    /// The grid.
    pub grid: OpenChuteGrid,
    /// The chute in space; a plane of any breadth without it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub in_space: Option<AcrossKeys>,
    /// The solver.
    pub solver: CollapseSolver,
}

/// What enters; one of the two is given.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct InflowKeys {
    /// Factor on the steady profile of a layer of that depth.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend("exclusiveMinimum" = 0.0, "maximum" = 100.0))]
    pub bagnold_factor: Option<f64>,
    /// Speed at all heights (m/s).
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend("exclusiveMinimum" = 0.0, "maximum" = 1.0e4))]
    pub speed: Option<f64>,
}

/// The grid.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct OpenChuteGrid {
    /// Cells across the depth at scale 1; they are square.
    #[schemars(extend("minimum" = 4, "maximum" = 1024))]
    pub cells: u64,
    /// Length of the chute over the depth.
    #[schemars(extend("exclusiveMinimum" = 0.0, "maximum" = 1000.0))]
    pub length_scaled: f64,
    /// Height of the grid over the depth; the whole grid has at most ten times as many cells as may hold material.
    #[schemars(extend("exclusiveMinimum" = 1.0, "maximum" = 100.0))]
    pub room_scaled: f64,
}

/// What the chute is across, in space.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct AcrossKeys {
    /// Distance of the side walls, or the period without them (m).
    #[schemars(extend("exclusiveMinimum" = 0.0, "maximum" = 1.0e5))]
    pub breadth: f64,
    /// Cells across half of the chute at scale 1; across all of it if it is whole or periodic.
    #[schemars(extend("minimum" = 1, "maximum" = 256))]
    pub cells: u64,
    /// Whether the grid holds all of it, instead of half of it beside a plane of symmetry.
    #[serde(default)]
    pub whole: bool,
    /// Side walls, and what holds on them; without them the chute is periodic across.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub walls: Option<SurfaceKeys>,
}

/// Fewest cells over a period.
const FEWEST_OF_PERIOD: u64 = 3;

impl AcrossKeys {
    fn check_together(&self, origin: &str) -> Result<(), SceneError> {
        match &self.walls {
            Some(walls) => walls.check_together(origin, "in_space.walls"),
            None if self.whole => Err(out_of_range(
                origin,
                "in_space.whole",
                "true".into(),
                "left out without [in_space.walls]: all of a period is computed".into(),
            )),
            None if self.cells < FEWEST_OF_PERIOD => Err(out_of_range(
                origin,
                "in_space.cells",
                self.cells.to_string(),
                format!("at least {FEWEST_OF_PERIOD} without [in_space.walls]: of a period"),
            )),
            None => Ok(()),
        }
    }
}

/// Keys of which one is given.
pub(super) const INFLOWS: &[&str] = &["inflow.bagnold_factor", "inflow.speed"];

/// Most cells that hold material: their matrix has to fit into memory.
const LARGEST_CHUTE: f64 = 200_000.0;
/// The same in space.
const LARGEST_IN_SPACE: f64 = 40_000.0;
/// Most cells of the grid over those that may hold material.
const LARGEST_ROOM: f64 = 10.0;

impl OpenChuteScene {
    /// Cells across the depth at this scale.
    pub fn cells(&self) -> usize {
        (self.grid.cells as f64 * self.scale).round().max(4.0) as usize
    }

    /// Cells across what is computed in space, at this scale.
    pub fn cells_across(&self, keys: &AcrossKeys) -> usize {
        let fewest = keys.walls.as_ref().map_or(FEWEST_OF_PERIOD, |_| 1);
        (keys.cells as f64 * self.scale).round().max(fewest as f64) as usize
    }

    /// Cells that hold material.
    pub fn filled(&self) -> f64 {
        let cells = self.cells() as f64;
        let across = self.in_space.as_ref().map_or(1, |k| self.cells_across(k));
        cells * cells * self.grid.length_scaled * across as f64
    }

    pub(super) fn check_together(&self, origin: &str) -> Result<(), SceneError> {
        if let Some(across) = &self.in_space {
            across.check_together(origin)?;
        }
        check_size_of_grains(&self.rheology, self.depth, origin)?;
        let filled = self.filled();
        let most = match self.in_space {
            Some(_) => LARGEST_IN_SPACE,
            None => LARGEST_CHUTE,
        };
        if filled > most {
            let across = self.in_space.as_ref();
            let (key, value) = match across.filter(|k| self.cells_across(k) > self.cells()) {
                Some(across) => ("in_space.cells", across.cells),
                None => ("grid.cells", self.grid.cells),
            };
            return Err(out_of_range(
                origin,
                key,
                value.to_string(),
                format!(
                    "at most {most} cells in the chute, here {filled:.0} at scale {} and grid.length_scaled = {}",
                    self.scale, self.grid.length_scaled
                ),
            ));
        }
        let all = filled * self.grid.room_scaled;
        if all > LARGEST_ROOM * most {
            return Err(out_of_range(
                origin,
                "grid.room_scaled",
                self.grid.room_scaled.to_string(),
                format!(
                    "at most {:.3} here: {} cells in the grid",
                    LARGEST_ROOM * most / filled,
                    LARGEST_ROOM * most
                ),
            ));
        }
        if self.inflow.bagnold_factor.is_none() && self.inflow.speed.is_none() {
            return Err(SceneError::MissingKey {
                file: origin.to_owned(),
                key: INFLOWS[0].into(),
                wanted: format!("a factor on the steady profile, or {} in m/s", INFLOWS[1]),
            });
        }
        check_rheology(&self.rheology, origin)
    }
}
