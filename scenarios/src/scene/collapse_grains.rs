//! Keys of a column of grains, of the collapse with `model = "dem"`.

use super::world::{
    GrainMaterialKeys, Materials, Place, SizeKeys, SizeKind, SurfaceKeys, materials,
};
use super::{CollapseScene, LawKeys, NormalKind, SceneError};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::f64::consts::PI;

/// A column of grains in a slab that is periodic across.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ColumnGrainKeys {
    /// Mean diameter d (m).
    #[schemars(extend("exclusiveMinimum" = 0.0, "maximum" = 1.0e3))]
    pub diameter: f64,
    /// Standard deviation of the diameters over their mean; they are cut there.
    #[schemars(extend("minimum" = 0.0, "maximum" = 0.5))]
    pub spread: f64,
    /// Density of the grains (kg/m³).
    #[schemars(extend("exclusiveMinimum" = 0.0, "maximum" = 30000.0))]
    pub density: f64,
    /// Width of the slab over d, at scale 1.
    #[schemars(extend("minimum" = 3.0, "maximum" = 1.0e4))]
    pub width_diameters: f64,
    /// k_n d/(m g) of a linear spring, where the law does not give its stiffness.
    #[schemars(extend("minimum" = 100.0, "maximum" = 1.0e9))]
    pub stiffness_scaled: f64,
    /// What the floor is.
    pub floor: ColumnFloorKind,
    /// The law that these grains were calibrated to: the continuum that they are set beside.
    pub calibrated: CalibratedKind,
    /// Seed of all random numbers.
    #[schemars(extend("minimum" = 0, "maximum" = 9007199254740991_i64))]
    pub seed: u64,
    /// A name under which the settled column is kept and found again, or a file packing.h5 of an earlier run.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub packing: Option<String>,
}

/// Floors of a column of grains.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum ColumnFloorKind {
    /// A layer of fixed grains: no slip.
    Rough,
    /// A plane without friction.
    Smooth,
}

/// Calibrated laws that come with the program.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum CalibratedKind {
    /// Of `incline-moderate`.
    Moderate,
    /// Of `incline-gravel`.
    Gravel,
    /// Of `incline-glass`.
    Glass,
    /// None: no continuum is computed.
    None,
}

impl CalibratedKind {
    /// Its name among the bundled laws.
    pub fn word(self) -> Option<&'static str> {
        match self {
            CalibratedKind::Moderate => Some("moderate"),
            CalibratedKind::Gravel => Some("gravel"),
            CalibratedKind::Glass => Some("glass"),
            CalibratedKind::None => None,
        }
    }
}

/// Fewest grains across the column's height or width.
const FEWEST_GRAINS: f64 = 4.0;

/// A law of spheres of a diameter (m) and a density (kg/m³) whose linear spring, where it has no stiffness of its own, is
/// k_n = `scaled` m g/d.
pub(super) fn scaled_law(
    law: LawKeys,
    (diameter, density): (f64, f64),
    scaled: f64,
    gravity: f64,
) -> LawKeys {
    let mass = density * PI / 6.0 * diameter.powi(3);
    match (law.parts().normal, law.stiffness) {
        (NormalKind::Hooke, None) => LawKeys {
            stiffness: Some(scaled * mass * gravity / diameter),
            ..law
        },
        _ => law,
    }
}

/// Spheres of a mean diameter (m) with a relative spread, and walls without friction.
pub(super) fn spheres_between_smooth_walls(
    (diameter, spread): (f64, f64),
    density: f64,
    contact: LawKeys,
    origin: &str,
) -> Result<Materials, SceneError> {
    let sizes = SizeKeys {
        law: SizeKind::Gaussian,
        radius: Some(0.5 * diameter),
        smallest: None,
        largest: None,
        index: None,
        bins: None,
        relative_deviation: Some(spread),
        cut: Some(1.0),
        radii: None,
        shares: None,
        by: None,
    };
    let grains = GrainMaterialKeys {
        density,
        parts: 1.0,
        sizes,
        contact: None,
    };
    let reads = contact.parts().reads();
    let none = |key: &str| reads.contains(&key).then_some(0.0);
    let smooth = SurfaceKeys {
        contact: LawKeys {
            friction: none("friction"),
            rolling_friction: none("rolling_friction"),
            twisting_friction: none("twisting_friction"),
            ..LawKeys::default()
        },
    };
    materials(
        &BTreeMap::from([("grains".to_owned(), grains)]),
        &BTreeMap::from([("smooth".to_owned(), smooth)]),
        &contact,
        1.0,
        origin,
    )
}

impl CollapseScene {
    /// Width of the column (m).
    pub fn width(&self) -> f64 {
        self.height / self.aspect
    }

    /// tan of the angle by which the face leans out.
    pub fn overhang(&self) -> f64 {
        self.overhang_degrees.to_radians().tan()
    }

    /// Where the face ends at the top (m).
    pub fn lip(&self) -> f64 {
        self.width() + self.overhang() * self.height
    }

    /// Area in section of a column with this foot and face, so high (m²).
    pub fn section(&self, height: f64) -> f64 {
        height * (self.width() + 0.5 * self.overhang() * height)
    }

    /// How high a column with this foot and face is whose section has an area (m).
    pub fn height_of(&self, area: f64) -> f64 {
        // The root of section(h) = area without a difference of near numbers.
        let (width, slope) = (self.width(), self.overhang());
        2.0 * area / (width + (width * width + 2.0 * slope * area).sqrt())
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

    pub(super) fn check_grains(&self, origin: &str) -> Result<(), SceneError> {
        let at = |section| Place { origin, section };
        if self.side_walls.is_some() {
            let range = "none with model = \"dem\": the slab of grains is periodic across";
            return Err(at("").refuse("side_walls", "a table", range));
        }
        if let Some(terrain) = &self.terrain {
            terrain.check_together(origin)?;
        }
        let (d, least) = (self.grains.diameter, self.height.min(self.width()));
        if d * FEWEST_GRAINS > least {
            let range = format!(
                "at most {}: {FEWEST_GRAINS} grains across the column",
                least / FEWEST_GRAINS
            );
            return Err(at("grains").refuse("diameter", d, range));
        }
        let least = self.lip() / self.height;
        if self.grid.length_scaled <= least {
            let range = format!("greater than the column with its overhang, {least}");
            return Err(at("grid").refuse("length_scaled", self.grid.length_scaled, range));
        }
        self.grain_materials(origin).map(drop)
    }
}
