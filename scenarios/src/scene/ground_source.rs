//! Where ground comes from: points, a raster of heights or a surface mesh.

use super::SceneError;

/// What a `[terrain]` says of the shape of the ground.
#[derive(Clone, Copy, Debug)]
pub struct GroundSource<'a> {
    /// Points (x, z) (m).
    pub profile: Option<&'a [[f64; 2]]>,
    /// File of heights.
    pub heights: Option<&'a str>,
    /// File of a triangle surface.
    pub mesh: Option<&'a str>,
    /// Metres in a unit of the mesh.
    pub unit: Option<f64>,
    /// Position (x, y) (m) in the file where x = 0 lies.
    pub start: Option<[f64; 2]>,
}

impl<'a> GroundSource<'a> {
    /// The file that the ground is read from, and its key.
    pub fn file(&self) -> Option<(&'static str, &'a str)> {
        let heights = self.heights.map(|f| ("heights", f));
        heights.or(self.mesh.map(|f| ("mesh", f)))
    }

    /// Refuses none or more than one of the three, and keys that belong to another.
    pub(super) fn check_together(&self, origin: &str) -> Result<(), SceneError> {
        let refused = |key: &str, value: String, range: &str| {
            Err(SceneError::OutOfRange {
                file: origin.to_owned(),
                key: format!("terrain.{key}"),
                value,
                range: range.to_owned(),
            })
        };
        let given = [
            ("profile", self.profile.is_some()),
            ("heights", self.heights.is_some()),
            ("mesh", self.mesh.is_some()),
        ];
        let names: Vec<&str> = given.iter().filter(|g| g.1).map(|g| g.0).collect();
        if names.is_empty() {
            return Err(SceneError::MissingKey {
                file: origin.to_owned(),
                key: "terrain.profile".into(),
                wanted: "points [[x, z], ...] in m, or terrain.heights or terrain.mesh, a file"
                    .into(),
            });
        }
        if names.len() > 1 {
            return refused(
                names[1],
                "given".into(),
                &format!(
                    "only one of profile, heights and mesh; terrain.{} is there",
                    names[0]
                ),
            );
        }
        if let (Some(unit), None) = (self.unit, self.mesh) {
            return refused(
                "unit",
                unit.to_string(),
                "left out, unless there is a terrain.mesh",
            );
        }
        if let (Some(start), Some(_)) = (self.start, self.profile) {
            return refused(
                "start",
                format!("{start:?}"),
                "left out, unless the ground comes from a file",
            );
        }
        Ok(())
    }
}
