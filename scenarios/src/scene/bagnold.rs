//! Keys of the continuum on an incline.

use super::SceneError;
use super::layer_case::LayerCase;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// A layer of μ(I) material on an incline, from rest to steady flow.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct BagnoldScene {
    /// Inclination to the horizontal (degrees).
    #[schemars(extend("minimum" = 0.0, "exclusiveMaximum" = 90.0))]
    pub slope_degrees: f64,
    /// Depth of the layer, normal to the plane (m).
    #[schemars(extend("exclusiveMinimum" = 0.0, "maximum" = 1.0e5))]
    pub depth: f64,
    /// Gravity (m/s²).
    #[schemars(extend("exclusiveMinimum" = 0.0, "maximum" = 1000.0))]
    pub gravity: f64,
    /// Size of the run: cells across the depth grow with it.
    #[schemars(extend("minimum" = 0.1, "maximum" = 64.0))]
    pub scale: f64,
    /// The material.
    pub rheology: RheologyKeys,
    /// The grid.
    pub grid: BagnoldGrid,
    /// The solver.
    pub solver: SolverKeys,
}

/// The law of friction.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum FrictionLaw {
    /// μ_s + (μ_2 − μ_s) I/(I_0 + I).
    #[default]
    MuI,
    /// A constant friction coefficient mu_s, and a viscosity.
    Coulomb,
    /// The partially regularised μ(I) of Barker and Gray (2017): well posed, never rigid.
    BarkerGray,
    /// Measured points (I, μ), interpolated.
    Table,
}

/// Where on a map of materials a law is taken from; nothing outside the map is.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct MapPlaceKeys {
    /// Shape parameter β of the contact law.
    #[schemars(extend("exclusiveMinimum" = 0.0, "maximum" = 5.0))]
    pub beta: f64,
    /// Rolling friction μ_R of the contact law.
    #[schemars(extend("exclusiveMinimum" = 0.0, "maximum" = 10.0))]
    pub mu_r: f64,
    /// A `map.toml` that `colluvium map` wrote; without it the map that comes with the program.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub map: Option<String>,
}

/// A material, by numbers, from a file that `calibrate` wrote or from a map.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct RheologyKeys {
    /// A `rheology.toml`; its numbers take the place of the keys below.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub file: Option<String>,
    /// A place on a measured map of materials; the law there takes the place of the keys below.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub from: Option<MapPlaceKeys>,
    /// The law of friction; it decides which of the numbers below are read.
    #[serde(default)]
    pub law: FrictionLaw,
    /// Friction μ_s at I → 0.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend("minimum" = 0.0, "maximum" = 5.0))]
    pub mu_s: Option<f64>,
    /// Friction μ_2 at I → ∞.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend("exclusiveMinimum" = 0.0, "maximum" = 1.0e6))]
    pub mu_2: Option<f64>,
    /// Inertial number I_0 half way between.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend("exclusiveMinimum" = 0.0, "maximum" = 1.0e6))]
    pub i_0: Option<f64>,
    /// α of Barker and Gray's branch at small I, √(α/ln(A/I)).
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend("exclusiveMinimum" = 0.0, "exclusiveMaximum" = 2.0))]
    pub alpha: Option<f64>,
    /// μ_∞ of Barker and Gray's branch at large I, where μ grows as μ_∞ I.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend("minimum" = 0.0, "maximum" = 100.0))]
    pub mu_infinity: Option<f64>,
    /// Viscosity η beside Coulomb's friction (Pa s).
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend("minimum" = 0.0, "maximum" = 1.0e12))]
    pub viscosity: Option<f64>,
    /// Points [I, μ] of a measured law, with rising I and μ that does not fall.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend("minItems" = 2, "items" = {"type": "array", "minItems": 2, "maxItems": 2, "items": {"type": "number", "minimum": 0.0, "maximum": 1.0e6}}))]
    pub table: Option<Vec<Vec<f64>>>,
    /// Grain diameter d (m).
    #[schemars(extend("exclusiveMinimum" = 0.0, "maximum" = 10.0))]
    pub diameter: f64,
    /// Solid volume fraction φ.
    #[schemars(extend("exclusiveMinimum" = 0.0, "maximum" = 1.0))]
    pub solid_fraction: f64,
    /// Density of the grains ρ_s (kg/m³).
    #[schemars(extend("exclusiveMinimum" = 0.0, "maximum" = 30000.0))]
    pub grain_density: f64,
    /// Cohesion c (Pa).
    #[serde(default)]
    #[schemars(extend("minimum" = 0.0, "maximum" = 1.0e9))]
    pub cohesion: f64,
    /// Inertial numbers between which the law was measured.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend("minItems" = 2, "maxItems" = 2, "items" = {"type": "number", "minimum": 0.0, "maximum": 1.0e4}))]
    pub valid_i: Option<Vec<f64>>,
    /// Whether the data determine all three of mu_s, mu_2 and i_0.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub identified: Option<bool>,
    /// Whether the calibration was judged fit to feed a continuum.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub good: Option<bool>,
    /// Where the numbers come from.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub source: Option<String>,
}

impl RheologyKeys {
    /// What has to be known of the law beyond its numbers, in words.
    pub fn remarks(&self) -> Vec<String> {
        let source = self.source.as_deref().unwrap_or("the scene");
        let mut remarks = Vec::new();
        if self.identified == Some(false) {
            remarks.push(format!(
                "Not identified: the data of the law from {source} do not determine μ_s, μ_2 and I_0 apart; outside the measured range it says nothing."
            ));
        }
        if self.good == Some(false) {
            remarks.push(format!(
                "The calibration of the law from {source} was judged not good enough to feed a continuum."
            ));
        }
        remarks
    }
}

/// The grid.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct BagnoldGrid {
    /// Cells across the layer at scale 1.
    #[schemars(extend("minimum" = 4, "maximum" = 4096))]
    pub cells: u64,
    /// Cells along the flow; 1 stores no axis along it.
    #[schemars(extend("minimum" = 1, "maximum" = 256))]
    pub columns: u64,
}

/// The solver.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SolverKeys {
    /// How yield is treated.
    pub method: SolverMethod,
    /// First time step over the natural time: √(depth/gravity) on an incline, breadth √(ρ/load) between plates or walls.
    #[schemars(extend("minimum" = 1.0e-6, "maximum" = 1.0e10))]
    pub timestep_scaled: f64,
    /// Factor by which the time step grows from step to step.
    #[schemars(extend("minimum" = 1.0, "maximum" = 1.0e6))]
    pub growth: f64,
    /// Steady when the largest acceleration falls below this, over gravity, or between plates or walls over load/(ρ breadth).
    #[schemars(extend("minimum" = 1.0e-14, "maximum" = 1.0e-2))]
    pub steady_tolerance: f64,
    /// Most time steps.
    #[schemars(extend("minimum" = 1, "maximum" = 1000000))]
    pub steps: u64,
}

/// How yield is treated.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum SolverMethod {
    /// Newton on velocity, pressure and stress at once.
    PrimalDual,
    /// A viscosity of limited size.
    Regularised,
}

/// Most cells of a grid: their matrix has to fit into the memory of one machine.
const LARGEST_GRID: u64 = 200_000;

impl BagnoldGrid {
    /// Cells across the layer at a scale.
    pub fn cells_at(&self, scale: f64) -> usize {
        (self.cells as f64 * scale).round().max(4.0) as usize
    }

    /// Columns of a periodic grid; none where nothing varies along the flow.
    pub fn columns(&self) -> Option<usize> {
        (self.columns > 1).then_some(self.columns as usize)
    }
}

/// Refuses grids that make no sense or are too large.
pub(super) fn check_grid(grid: &BagnoldGrid, scale: f64, origin: &str) -> Result<(), SceneError> {
    if grid.columns == 2 {
        return Err(SceneError::OutOfRange {
            file: origin.to_owned(),
            key: "grid.columns".into(),
            value: "2".into(),
            range: "1, or 3 to 256".into(),
        });
    }
    let across = grid.cells_at(scale) as u64;
    if across * grid.columns > LARGEST_GRID {
        let (key, value) = if grid.columns > across {
            ("grid.columns", grid.columns)
        } else {
            ("grid.cells", grid.cells)
        };
        return Err(SceneError::OutOfRange {
            file: origin.to_owned(),
            key: key.into(),
            value: value.to_string(),
            range: format!(
                "at most {LARGEST_GRID} for grid.cells x grid.columns x scale, here {} x {} x {scale}",
                grid.cells, grid.columns
            ),
        });
    }
    Ok(())
}

/// Refuses numbers of a law that contradict each other.
pub(super) fn check_law(r: &RheologyKeys, origin: &str) -> Result<(), SceneError> {
    if let Some([low, high]) = r.valid_i.as_deref()
        && low >= high
    {
        return Err(SceneError::OutOfRange {
            file: origin.to_owned(),
            key: "rheology.valid_i".into(),
            value: format!("[{low}, {high}]"),
            range: "[low, high] with low < high".into(),
        });
    }
    if let (Some(mu_s), Some(mu_2)) = (r.mu_s, r.mu_2)
        && mu_2 < mu_s
    {
        return Err(SceneError::OutOfRange {
            file: origin.to_owned(),
            key: "rheology.mu_2".into(),
            value: mu_2.to_string(),
            range: format!("at least rheology.mu_s = {mu_s}"),
        });
    }
    Ok(())
}

impl BagnoldScene {
    /// Cells across the depth at this scale.
    pub fn cells(&self) -> usize {
        self.grid.cells_at(self.scale)
    }

    pub(super) fn check_together(&self, origin: &str) -> Result<(), SceneError> {
        check_grid(&self.grid, self.scale, origin)?;
        check_law(&self.rheology, origin)?;
        // The same checks as the solver's, with the scene's name in front.
        LayerCase::of(self)
            .and_then(|layer| layer.validate())
            .map_err(|error| match error {
                colluvium_continuum::Error::OutOfRange {
                    key,
                    value,
                    allowed,
                } => SceneError::OutOfRange {
                    file: origin.to_owned(),
                    key: key.into(),
                    // As it was written, not there and back through radians.
                    value: match key {
                        "slope_degrees" => self.slope_degrees.to_string(),
                        _ => value.to_string(),
                    },
                    range: allowed,
                },
                other => SceneError::Unreadable {
                    file: origin.to_owned(),
                    message: other.to_string(),
                },
            })?;
        Ok(())
    }
}
