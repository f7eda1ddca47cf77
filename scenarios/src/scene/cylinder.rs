//! Keys of the collapse of a cylinder.

use super::collapse::{check_rheology, check_size_of_grains, out_of_range};
use super::{CollapseSolver, FrictionLaw, ReliefKeys, RheologyKeys, SceneError, SurfaceKeys};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// A cylinder that collapses on a floor, in space.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct CylinderScene {
    /// Height over radius of the cylinder.
    #[schemars(extend("minimum" = 0.05, "maximum" = 50.0))]
    pub aspect: f64,
    /// Height of the cylinder (m).
    #[schemars(extend("exclusiveMinimum" = 0.0, "maximum" = 1.0e5))]
    pub height: f64,
    /// Gravity (m/s²).
    #[schemars(extend("exclusiveMinimum" = 0.0, "maximum" = 1000.0))]
    pub gravity: f64,
    /// Longest time over √(height/gravity); the run ends before where everything rests.
    #[schemars(extend("exclusiveMinimum" = 0.0, "maximum" = 1.0e4))]
    pub duration_scaled: f64,
    /// Height over the cylinder's at which the heap has its edge.
    #[schemars(extend("exclusiveMinimum" = 0.0, "exclusiveMaximum" = 1.0))]
    pub front_height_scaled: f64,
    /// Size of the run: cells along each axis grow with it.
    #[schemars(extend("minimum" = 0.1, "maximum" = 16.0))]
    pub scale: f64,
    /// The material.
    pub rheology: RheologyKeys,
    /// What holds on the floor.
    #[serde(default)]
    pub floor: SurfaceKeys,
    /// Ground instead of a level floor.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub terrain: Option<ReliefKeys>,
    /// The grid.
    pub grid: CylinderGrid,
    /// The solver.
    pub solver: CollapseSolver,
}

/// The grid.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct CylinderGrid {
    /// Cells from the axis to the edge at scale 1; they are cubes.
    #[schemars(extend("minimum" = 8, "maximum" = 512))]
    pub cells: u64,
    /// Length of the grid from the axis over the height of the cylinder.
    #[schemars(extend("exclusiveMinimum" = 0.0, "maximum" = 1000.0))]
    pub length_scaled: f64,
    /// Whether the grid holds the whole cylinder, instead of a quarter between planes of symmetry.
    #[serde(default)]
    pub whole: bool,
}

/// Most cells that hold material: their matrix has to fit into memory.
const LARGEST_CYLINDER: f64 = 40_000.0;

impl CylinderScene {
    /// Cells from the axis to the edge at this scale.
    pub fn cells(&self) -> usize {
        (self.grid.cells as f64 * self.scale).round().max(8.0) as usize
    }

    /// Cells that hold material.
    pub fn filled(&self) -> f64 {
        let per_height = self.cells() as f64 / self.grid.length_scaled;
        let quarter = 0.25 * std::f64::consts::PI * per_height.powi(3) / self.aspect.powi(2);
        if self.grid.whole {
            4.0 * quarter
        } else {
            quarter
        }
    }

    pub(super) fn check_together(&self, origin: &str) -> Result<(), SceneError> {
        let filled = self.filled();
        if filled > LARGEST_CYLINDER {
            return Err(out_of_range(
                origin,
                "grid.cells",
                self.grid.cells.to_string(),
                format!(
                    "at most {LARGEST_CYLINDER} cells in the cylinder, here {filled:.0} at scale {}",
                    self.scale
                ),
            ));
        }
        self.floor.check_together(origin, "floor")?;
        if let Some(terrain) = &self.terrain {
            terrain.check_together(origin, self.grid.whole)?;
            if self.floor != SurfaceKeys::default() {
                return Err(out_of_range(
                    origin,
                    "floor.contact",
                    "given".into(),
                    "left out over [terrain], which has a contact of its own".into(),
                ));
            }
        }
        let law = self.rheology.law;
        if law != FrictionLaw::MuI {
            return Err(out_of_range(
                origin,
                "rheology.law",
                law.word().into(),
                "mu-i: cylinders collapse under this law alone".into(),
            ));
        }
        check_size_of_grains(&self.rheology, self.height, origin)?;
        check_rheology(&self.rheology, origin)
    }
}
