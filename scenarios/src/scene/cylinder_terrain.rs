//! Keys of the ground under a cylinder: `[terrain]`.

use super::collapse::out_of_range;
use super::{ContactKind, SceneError, SurfaceKeys};
use colluvium_continuum::terrain::HeightSum;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Ground instead of a level floor: heights that add up, z = f(x) + g(y) + h(r), or a file. The axis of the cylinder is
/// at x = y = 0.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ReliefKeys {
    /// Points (x, f) (m) of a line that goes on level beyond its ends.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub along_x: Vec<[f64; 2]>,
    /// Points (y, g) (m) of a line that goes on level beyond its ends.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub along_y: Vec<[f64; 2]>,
    /// Points (r, h) (m), r the distance from the axis, of a line that goes on level beyond its ends: cones, craters.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub radial: Vec<[f64; 2]>,
    /// File of heights (ESRI ASCII or GeoTIFF).
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub heights: Option<String>,
    /// File of a triangle surface seen from above (STL, OBJ, PLY, VTK, VTU, VTP, Gmsh).
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub mesh: Option<String>,
    /// Metres in a unit of the mesh; left out: 1.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend("exclusiveMinimum" = 0.0, "maximum" = 1.0e6))]
    pub unit: Option<f64>,
    /// Position (x, y) (m) in the file of the axis of the cylinder. Left out: the file's zero.
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

impl ReliefKeys {
    /// The file that the ground is read from, and its key.
    pub fn file(&self) -> Option<(&'static str, &str)> {
        let heights = self.heights.as_deref().map(|f| ("heights", f));
        heights.or(self.mesh.as_deref().map(|f| ("mesh", f)))
    }

    /// The heights that add up.
    pub fn sum(&self) -> HeightSum {
        HeightSum {
            along_x: self.along_x.clone(),
            along_y: self.along_y.clone(),
            radial: self.radial.clone(),
        }
    }

    /// Whether it is the same in all directions from the axis.
    pub fn is_radial(&self) -> bool {
        self.file().is_none() && self.sum().is_radial()
    }

    pub(super) fn check_together(&self, origin: &str, whole: bool) -> Result<(), SceneError> {
        let refused = |key: &str, value: String, range: &str| {
            let key = format!("terrain.{key}");
            Err(out_of_range(origin, &key, value, range.into()))
        };
        let given = [
            ("along_x", !self.along_x.is_empty()),
            ("along_y", !self.along_y.is_empty()),
            ("radial", !self.radial.is_empty()),
            ("heights", self.heights.is_some()),
            ("mesh", self.mesh.is_some()),
        ];
        let names: Vec<&str> = given.iter().filter(|g| g.1).map(|g| g.0).collect();
        let Some(&last) = names.last() else {
            return Err(SceneError::MissingKey {
                file: origin.to_owned(),
                key: "terrain.along_x".into(),
                wanted: "points [[x, height], ...] in m, or terrain.along_y, terrain.radial, or terrain.heights or \
                         terrain.mesh, a file"
                    .into(),
            });
        };
        if self.file().is_some() && names.len() > 1 {
            let range = format!("alone; terrain.{} is there", names[0]);
            return refused(last, "given".into(), &range);
        }
        if let (Some(unit), None) = (self.unit, &self.mesh) {
            let range = "left out, unless there is a terrain.mesh";
            return refused("unit", unit.to_string(), range);
        }
        if let (Some(start), None) = (self.start, self.file()) {
            let range = "left out, unless the ground comes from a file";
            return refused("start", format!("{start:?}"), range);
        }
        if !whole && !self.is_radial() {
            return Err(out_of_range(
                origin,
                "grid.whole",
                "false".into(),
                format!(
                    "true: ground by terrain.{} is not the same in all quarters",
                    names[0]
                ),
            ));
        }
        if let Err(error) = self.sum().validate() {
            return Err(SceneError::Unreadable {
                file: origin.to_owned(),
                message: error.to_string(),
            });
        }
        let surface = SurfaceKeys {
            contact: self.contact,
            friction: self.friction,
        };
        surface.check_together(origin, "terrain")
    }
}
