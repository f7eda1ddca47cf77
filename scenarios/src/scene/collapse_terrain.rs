//! Keys of the ground under a collapse: `[terrain]`.

use super::{GroundSource, SceneError, SurfaceKeys};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Ground instead of a level floor, as points or as a section along x of a raster or a mesh.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct TerrainKeys {
    /// Points (x, z) (m) of its surface, ground on the right hand of the line; two points of the same x
    /// make a cliff.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub profile: Option<Vec<[f64; 2]>>,
    /// File of heights (ESRI ASCII or GeoTIFF).
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub heights: Option<String>,
    /// File of a triangle surface (STL, OBJ, PLY, VTK, VTU, VTP, Gmsh).
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub mesh: Option<String>,
    /// Metres in a unit of the mesh; left out: 1.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend("exclusiveMinimum" = 0.0, "maximum" = 1.0e6))]
    pub unit: Option<f64>,
    /// Position (x, y) (m) in the file of the plane of symmetry x = 0; the section runs along x from
    /// there. Left out: the file's zero.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub start: Option<[f64; 2]>,
    /// What holds on its surface.
    #[serde(default)]
    pub contact: ContactKind,
    /// Friction coefficient of the material on it, under contact = "coulomb".
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend("minimum" = 0.0, "maximum" = 10.0))]
    pub friction: Option<f64>,
}

/// What holds on the surface of ground.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum ContactKind {
    /// Material at the ground stands still.
    #[default]
    NoSlip,
    /// It slides once the ground bears all the shear stress it can.
    Coulomb,
    /// It slides freely.
    FreeSlip,
}

impl TerrainKeys {
    /// Where the ground comes from.
    pub fn source(&self) -> GroundSource<'_> {
        GroundSource {
            profile: self.profile.as_deref(),
            heights: self.heights.as_deref(),
            mesh: self.mesh.as_deref(),
            unit: self.unit,
            start: self.start,
        }
    }

    pub(super) fn check_together(&self, origin: &str) -> Result<(), SceneError> {
        self.source().check_together(origin)?;
        let surface = SurfaceKeys {
            contact: self.contact,
            friction: self.friction,
        };
        surface.check_together(origin, "terrain")
    }
}
