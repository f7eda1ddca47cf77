//! Keys of the ground before a cliff.

use super::GroundSource;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Ground before a cliff instead of a plane, as points or as a section along x of a raster or a mesh, from the foot of the
/// face on. Heights count from its own at the foot. Grains fall on it and their continuum runs out over it.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct CliffTerrainKeys {
    /// Points (x, z) (m) in the order of x; two of the same x make a step. What lies behind the foot (x < 0) is not read.
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
    /// Position (x, y) (m) in the file of the foot of the face; the section runs along x from there. Left out: the
    /// file's zero.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub start: Option<[f64; 2]>,
}

impl CliffTerrainKeys {
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
}
