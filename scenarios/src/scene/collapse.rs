//! Keys of the collapse of a column.

use super::world::{OutputKeys, StepKeys};
use super::{
    ColumnGrainKeys, ColumnOverlapKeys, ColumnZoneKeys, ContactKind, FrictionLaw, LawKeys,
    RheologyKeys, SceneError, SurfaceKeys, TerrainKeys,
};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// A column that collapses on a rough floor.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct CollapseScene {
    /// What the material is made of.
    pub model: CollapseModel,
    /// Height over width of the column.
    #[schemars(extend("minimum" = 0.05, "maximum" = 50.0))]
    pub aspect: f64,
    /// Height of the column (m).
    #[schemars(extend("exclusiveMinimum" = 0.0, "maximum" = 1.0e5))]
    pub height: f64,
    /// How far the face leans out over its foot, from the vertical: a cliff (degrees).
    #[serde(default)]
    #[schemars(extend("minimum" = 0.0, "maximum" = 60.0))]
    pub overhang_degrees: f64,
    /// Gravity (m/s²).
    #[schemars(extend("exclusiveMinimum" = 0.0, "maximum" = 1000.0))]
    pub gravity: f64,
    /// Longest time over √(height/gravity); the run ends before where everything rests.
    #[schemars(extend("exclusiveMinimum" = 0.0, "maximum" = 1.0e4))]
    pub duration_scaled: f64,
    /// Height over the column's at which the heap has its edge.
    #[schemars(extend("exclusiveMinimum" = 0.0, "exclusiveMaximum" = 1.0))]
    pub front_height_scaled: f64,
    /// Size of the run: cells along each axis grow with it, or the number of grains.
    #[schemars(extend("minimum" = 0.1, "maximum" = 64.0))]
    pub scale: f64,
    /// The material of the continuum.
    pub rheology: RheologyKeys,
    /// Side walls of a narrow channel; a plane of any width without them.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub side_walls: Option<CollapseWalls>,
    /// Ground instead of a level floor.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub terrain: Option<TerrainKeys>,
    /// The grid.
    pub grid: CollapseGrid,
    /// The solver.
    pub solver: CollapseSolver,
    /// The column of grains.
    pub grains: ColumnGrainKeys,
    /// The law of all contacts of grains.
    pub contact: LawKeys,
    /// Their time step.
    #[serde(default)]
    pub timestep: StepKeys,
    /// What a run of grains writes.
    #[serde(default)]
    pub output: OutputKeys,
    /// Where there are grains, with model = "hybrid".
    #[serde(default)]
    pub zones: ColumnZoneKeys,
    /// How they are joined to the continuum behind them.
    #[serde(default)]
    pub overlap: ColumnOverlapKeys,
}

/// What the material is made of.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum CollapseModel {
    /// A continuum with a free surface.
    Continuum,
    /// Grains.
    Dem,
    /// Grains where they are needed, a continuum elsewhere.
    Hybrid,
}

/// Side walls of a channel.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct CollapseWalls {
    /// Distance between them (m).
    #[schemars(extend("exclusiveMinimum" = 0.0, "maximum" = 1.0e5))]
    pub width: f64,
    /// Friction coefficient of the material on each.
    #[schemars(extend("minimum" = 0.0, "maximum" = 10.0))]
    pub friction: f64,
    /// The channel in space, with walls where they are; without it their friction is spread over its width.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub in_space: Option<ChannelKeys>,
}

/// The channel in space.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ChannelKeys {
    /// Cells across half of the channel at scale 1, or across all of it if it is whole.
    #[schemars(extend("minimum" = 1, "maximum" = 256))]
    pub cells: u64,
    /// Whether the grid holds the whole width, instead of half of it beside a plane of symmetry.
    #[serde(default)]
    pub whole: bool,
    /// What holds on the walls; their friction counts under "coulomb" only.
    #[serde(default = "rubbing")]
    pub contact: ContactKind,
    /// What holds on the floor.
    #[serde(default)]
    pub floor: SurfaceKeys,
}

fn rubbing() -> ContactKind {
    ContactKind::Coulomb
}

/// The grid.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct CollapseGrid {
    /// Cells along x at scale 1; they are square.
    #[schemars(extend("minimum" = 8, "maximum" = 8192))]
    pub cells: u64,
    /// Length of the grid over the height of the column.
    #[schemars(extend("exclusiveMinimum" = 0.0, "maximum" = 1000.0))]
    pub length_scaled: f64,
}

/// The solver.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct CollapseSolver {
    /// Largest Δt Σ|u|/h over the axes.
    #[schemars(extend("minimum" = 0.001, "maximum" = 1.0))]
    pub courant: f64,
    /// Largest time step over √(height/gravity).
    #[schemars(extend("minimum" = 1.0e-6, "maximum" = 10.0))]
    pub largest_step_scaled: f64,
    /// Strain rate over √(gravity/height) at which rigid matter creeps.
    #[schemars(extend("minimum" = 1.0e-7, "maximum" = 0.1))]
    pub strain_rate_floor: f64,
    /// How layers thinner than half a cell move over the floor.
    pub thin_layer: ThinLayerKind,
    /// Relative residual to which the linear system of an iteration is solved; 1e-3 where it is left out.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend("minimum" = 1.0e-12, "maximum" = 0.1))]
    pub linear_tolerance: Option<f64>,
}

/// How layers thinner than half a cell move over the floor.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum ThinLayerKind {
    /// Driven by the slope of their surface, held by friction under their own weight.
    DepthAveraged,
    /// Not at all.
    Frozen,
    /// With the thicker material beside them.
    Following,
}

/// Most cells that hold material at the start: their matrix has to fit into memory.
const LARGEST_COLUMN: f64 = 200_000.0;
/// The same in space.
const LARGEST_CHANNEL: f64 = 40_000.0;

impl CollapseScene {
    /// Cells along x at this scale.
    pub fn cells(&self) -> usize {
        (self.grid.cells as f64 * self.scale).round().max(8.0) as usize
    }

    /// The channel in space, if the scene asks for it.
    pub fn channel(&self) -> Option<&ChannelKeys> {
        self.side_walls.as_ref()?.in_space.as_ref()
    }

    /// Cells across what is computed of a channel, at this scale.
    pub fn cells_across(&self, keys: &ChannelKeys) -> usize {
        (keys.cells as f64 * self.scale).round().max(1.0) as usize
    }

    pub(super) fn check_together(&self, origin: &str) -> Result<(), SceneError> {
        let refused =
            |key: &str, value: String, range: String| Err(out_of_range(origin, key, value, range));
        match self.model {
            CollapseModel::Hybrid => {
                self.check_law_beside_grains(origin)?;
                return self.check_zones(origin);
            }
            CollapseModel::Dem => return self.check_grains(origin),
            CollapseModel::Continuum => {}
        }
        let per_height = self.cells() as f64 / self.grid.length_scaled;
        let channel = self.channel();
        let across = channel.map_or(1, |keys| self.cells_across(keys));
        let filled = per_height * per_height / self.aspect * across as f64;
        let most = match channel {
            Some(_) => LARGEST_CHANNEL,
            None => LARGEST_COLUMN,
        };
        if filled > most {
            return refused(
                "grid.cells",
                self.grid.cells.to_string(),
                format!(
                    "at most {most} cells in the column, here {filled:.0} at scale {}",
                    self.scale
                ),
            );
        }
        if let Some(keys) = channel {
            keys.floor
                .check_together(origin, "side_walls.in_space.floor")?;
            if self.terrain.is_some() || self.overhang_degrees != 0.0 {
                return refused(
                    "side_walls.in_space",
                    "a table".into(),
                    "left out with [terrain] or an overhang: they are known in a plane".into(),
                );
            }
            if self.rheology.law != FrictionLaw::MuI {
                return refused(
                    "rheology.law",
                    self.rheology.law.word().into(),
                    "mu-i with side_walls.in_space".into(),
                );
            }
        }
        if let Some(terrain) = &self.terrain {
            terrain.check_together(origin)?;
            if self.overhang_degrees != 0.0 {
                return refused(
                    "overhang_degrees",
                    self.overhang_degrees.to_string(),
                    "0 with [terrain]: the column's face stands upright there".into(),
                );
            }
        }
        check_size_of_grains(&self.rheology, self.height, origin)?;
        check_rheology(&self.rheology, origin)
    }

    /// The continuum beside grains that has the scene's own law knows dry μ(I) alone.
    fn check_law_beside_grains(&self, origin: &str) -> Result<(), SceneError> {
        let own = &self.rheology;
        if self.grains.calibrated.word().is_some() {
            return Ok(());
        }
        let (key, value, range) = if own.law != FrictionLaw::MuI {
            ("law", own.law.word().to_owned(), "mu-i")
        } else if own.cohesion != 0.0 {
            ("cohesion", own.cohesion.to_string(), "0")
        } else {
            return check_rheology(own, origin);
        };
        let range = format!("{range} with model = \"hybrid\"");
        Err(out_of_range(
            origin,
            &format!("rheology.{key}"),
            value,
            range,
        ))
    }
}

/// A value that is not allowed.
pub(super) fn out_of_range(origin: &str, key: &str, value: String, range: String) -> SceneError {
    SceneError::OutOfRange {
        file: origin.to_owned(),
        key: key.into(),
        value,
        range,
    }
}

/// Refuses grains that are larger than the column (m) whose material they are.
pub(super) fn check_size_of_grains(
    law: &RheologyKeys,
    height: f64,
    origin: &str,
) -> Result<(), SceneError> {
    if law.diameter <= height {
        return Ok(());
    }
    let range = format!("at most the height of what is made of such grains, {height} m");
    Err(out_of_range(
        origin,
        "rheology.diameter",
        law.diameter.to_string(),
        range,
    ))
}

/// Refuses laws under which nothing can collapse.
pub(super) fn check_rheology(r: &RheologyKeys, origin: &str) -> Result<(), SceneError> {
    let refused =
        |key: &str, value: String, range: String| Err(out_of_range(origin, key, value, range));
    if let Some([low, high]) = r.valid_i.as_deref()
        && low >= high
    {
        return refused(
            "rheology.valid_i",
            format!("[{low}, {high}]"),
            "[low, high] with low < high".into(),
        );
    }
    if let (Some(mu_s), Some(mu_2)) = (r.mu_s, r.mu_2)
        && mu_2 < mu_s
    {
        return refused(
            "rheology.mu_2",
            mu_2.to_string(),
            format!("at least rheology.mu_s = {mu_s}"),
        );
    }
    Ok(())
}
