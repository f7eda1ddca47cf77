//! Keys of a silo that runs out of a slot in its floor, as a continuum.

use super::collapse::{check_rheology, check_size_of_grains, out_of_range};
use super::contact::SurfaceKeys;
use super::{CollapseSolver, RheologyKeys, SceneError};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// A plane silo with a slot in the middle of its floor.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SiloDischargeScene {
    /// Width between the walls (m).
    #[schemars(extend("exclusiveMinimum" = 0.0, "maximum" = 1.0e5))]
    pub width: f64,
    /// Width of the slot (m).
    #[schemars(extend("exclusiveMinimum" = 0.0, "maximum" = 1.0e5))]
    pub outlet: f64,
    /// Height of the filling (m).
    #[schemars(extend("exclusiveMinimum" = 0.0, "maximum" = 1.0e5))]
    pub height: f64,
    /// Gravity (m/s²).
    #[schemars(extend("exclusiveMinimum" = 0.0, "maximum" = 1000.0))]
    pub gravity: f64,
    /// Time over √(outlet/gravity).
    #[schemars(extend("exclusiveMinimum" = 0.0, "maximum" = 1.0e4))]
    pub duration_scaled: f64,
    /// Size of the run: cells along each axis grow with it.
    #[schemars(extend("minimum" = 0.1, "maximum" = 64.0))]
    pub scale: f64,
    /// The material.
    pub rheology: RheologyKeys,
    /// What holds on the walls.
    pub walls: SurfaceKeys,
    /// What holds on the floor beside the slot.
    pub floor: SurfaceKeys,
    /// The grid.
    pub grid: SiloGrid,
    /// The solver; its scaled keys are over √(outlet/gravity).
    pub solver: CollapseSolver,
}

/// The grid.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SiloGrid {
    /// Cells across the outlet at scale 1; they are square.
    #[schemars(extend("minimum" = 4, "maximum" = 1024))]
    pub cells: u64,
    /// Whether the grid holds all of the silo, instead of half of it beside a plane of symmetry.
    #[serde(default)]
    pub whole: bool,
}

/// Most cells that hold material at the start: their matrix has to fit into memory.
const LARGEST_SILO: f64 = 200_000.0;

impl SiloDischargeScene {
    /// Cells across the outlet at this scale.
    pub fn cells(&self) -> usize {
        (self.grid.cells as f64 * self.scale).round() as usize
    }

    pub(super) fn check_together(&self, origin: &str) -> Result<(), SceneError> {
        self.walls.check_together(origin, "walls")?;
        self.floor.check_together(origin, "floor")?;
        let part = if self.grid.whole { 1.0 } else { 0.5 };
        let spacing = self.outlet / self.cells().max(1) as f64;
        let filled = part * self.width * self.height / (spacing * spacing);
        if filled > LARGEST_SILO {
            return Err(out_of_range(
                origin,
                "grid.cells",
                self.grid.cells.to_string(),
                format!(
                    "at most {LARGEST_SILO} cells in the silo, here {filled:.0} at scale {}",
                    self.scale
                ),
            ));
        }
        check_size_of_grains(&self.rheology, self.height, origin)?;
        check_rheology(&self.rheology, origin)
    }
}
