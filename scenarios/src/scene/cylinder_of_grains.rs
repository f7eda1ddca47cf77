//! Keys of a cylinder of grains that collapses.

use super::collapse_grains::{CalibratedKind, scaled_law, spheres_between_smooth_walls};
use super::world::{Materials, OutputKeys, Place, StepKeys};
use super::{LawKeys, SceneError};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// An upright cylinder of grains that collapses on a floor of fixed grains.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct GrainCylinderScene {
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
    /// The grains.
    pub grains: GrainCylinderKeys,
    /// The law of all contacts.
    pub contact: LawKeys,
    /// The floor, and the continuum that the grains are set beside.
    pub grid: GrainCylinderGrid,
    /// The time step.
    #[serde(default)]
    pub timestep: StepKeys,
    /// What is written.
    #[serde(default)]
    pub output: OutputKeys,
}

/// The grains of a cylinder.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct GrainCylinderKeys {
    /// Mean diameter d (m).
    #[schemars(extend("exclusiveMinimum" = 0.0, "maximum" = 1.0e3))]
    pub diameter: f64,
    /// Standard deviation of the diameters over their mean; they are cut there.
    #[schemars(extend("minimum" = 0.0, "maximum" = 0.5))]
    pub spread: f64,
    /// Density of the grains (kg/m³).
    #[schemars(extend("exclusiveMinimum" = 0.0, "maximum" = 30000.0))]
    pub density: f64,
    /// k_n d/(m g) of a linear spring, where the law does not give its stiffness.
    #[schemars(extend("minimum" = 100.0, "maximum" = 1.0e9))]
    pub stiffness_scaled: f64,
    /// The law that these grains were calibrated to: the continuum that they are set beside.
    pub calibrated: CalibratedKind,
    /// Seed of all random numbers.
    #[schemars(extend("minimum" = 0, "maximum" = 9007199254740991_i64))]
    pub seed: u64,
    /// A name under which the settled cylinder is kept and found again, or a file packing.h5 of an earlier run.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub packing: Option<String>,
}

/// The floor and the grid of the continuum.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct GrainCylinderGrid {
    /// Radius of the floor and length of the grid from the axis, over the height of the cylinder.
    #[schemars(extend("exclusiveMinimum" = 0.0, "maximum" = 1000.0))]
    pub length_scaled: f64,
    /// Cells of the continuum from the axis to the edge; they are cubes.
    #[schemars(extend("minimum" = 8, "maximum" = 64))]
    pub cells: u64,
}

/// Fewest grains across the cylinder's height or radius.
const FEWEST_GRAINS: f64 = 4.0;
/// Fewest cells of the coarser grid across them: the continuum needs 3, of a cylinder that has settled a little lower.
const FEWEST_CELLS: f64 = 3.5;

impl GrainCylinderScene {
    /// Radius of the cylinder (m).
    pub fn radius(&self) -> f64 {
        self.height / self.aspect
    }

    /// Radius of the floor (m).
    pub fn length(&self) -> f64 {
        self.grid.length_scaled * self.height
    }

    /// Cells from the axis to the edge of a coarser grid, which tells what the grid does.
    pub fn coarse_cells(&self) -> u64 {
        (2 * self.grid.cells / 3).max(8)
    }

    /// The contact law, with the stiffness that the scene gives in scaled form.
    pub fn law_keys(&self) -> LawKeys {
        let g = &self.grains;
        scaled_law(
            self.contact,
            (g.diameter, g.density),
            g.stiffness_scaled,
            self.gravity,
        )
    }

    /// The grains and the smooth walls.
    pub fn grain_materials(&self, origin: &str) -> Result<Materials, SceneError> {
        let g = &self.grains;
        let sizes = (g.diameter, g.spread);
        spheres_between_smooth_walls(sizes, g.density, self.law_keys(), origin)
    }

    pub(super) fn check_together(&self, origin: &str) -> Result<(), SceneError> {
        let at = |section| Place { origin, section };
        let least = self.height.min(self.radius());
        if self.grains.diameter * FEWEST_GRAINS > least {
            let range = format!(
                "at most {}: {FEWEST_GRAINS} grains up the height and along the radius",
                least / FEWEST_GRAINS
            );
            return Err(at("grains").refuse("diameter", self.grains.diameter, range));
        }
        if self.grid.length_scaled * self.aspect <= 1.0 {
            let range = format!(
                "greater than the radius over the height, {}",
                1.0 / self.aspect
            );
            return Err(at("grid").refuse("length_scaled", self.grid.length_scaled, range));
        }
        let across = self.coarse_cells() as f64 / self.grid.length_scaled / self.aspect.max(1.0);
        if self.grains.calibrated.word().is_some() && across < FEWEST_CELLS {
            let least = 1.5 * FEWEST_CELLS * self.grid.length_scaled * self.aspect.max(1.0);
            let range = format!(
                "at least {:.0}, for {FEWEST_CELLS} cells of a grid of two thirds of them up the height and along the radius; \
                 or grains.calibrated = \"none\"",
                least.ceil() + 1.0
            );
            return Err(at("grid").refuse("cells", self.grid.cells, range));
        }
        self.grain_materials(origin).map(drop)
    }
}
