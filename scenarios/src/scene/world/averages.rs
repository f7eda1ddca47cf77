//! `[output.average]`: coarse-grained fields that a run gathers as it goes on.

use super::{Place, Triple};
use crate::averages::{Choice, Where};
use crate::scene::SceneError;
use colluvium_coupling::coarse_graining::Shape;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Shape of a kernel.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum KernelKind {
    /// Lucy's polynomial.
    #[default]
    Lucy,
    /// Gauss' bell, cut off.
    Gauss,
    /// The same weight everywhere.
    Heaviside,
    /// (1 − r²)².
    Polynomial,
}

/// Where fields are evaluated.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum GeometryKind {
    /// At `points`.
    Points,
    /// Along z, averaged over x and y.
    Line,
    /// In x and z, averaged over y.
    Plane,
    /// In space.
    Grid,
    /// Around `axis`, averaged over the angle.
    Cylinder,
}

/// Fields averaged over time.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct AverageKeys {
    /// Where fields are evaluated.
    pub geometry: GeometryKind,
    /// Time between two instants (s).
    #[schemars(extend("exclusiveMinimum" = 0.0, "maximum" = 1.0e9))]
    pub every: f64,
    /// First instant (s); left out: the start.
    #[serde(default)]
    #[schemars(extend("minimum" = 0.0, "maximum" = 1.0e9))]
    pub from: f64,
    /// Last instant (s); left out: the end of the run.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend("exclusiveMinimum" = 0.0, "maximum" = 1.0e9))]
    pub to: Option<f64>,
    /// Spans of time of equal length that are averaged each on its own: instants of `fields.vtkhdf`. Left out: 1.
    #[serde(default = "one")]
    #[schemars(extend("minimum" = 1, "maximum" = 10000))]
    pub windows: u64,
    /// Shape of the kernel.
    #[serde(default)]
    pub kernel: KernelKind,
    /// Radius of its support, of gauss the standard deviation (m); left out: a mean diameter, half of one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend("exclusiveMinimum" = 0.0, "maximum" = 1.0e6))]
    pub width: Option<f64>,
    /// Edge of a cell (m); left out: half a mean diameter.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend("exclusiveMinimum" = 0.0, "maximum" = 1.0e6))]
    pub cell: Option<f64>,
    /// Lower corner of the cells (m); left out: that of the box where it is periodic, of the grains at the start else.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub lower: Option<Triple>,
    /// Their upper corner (m).
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub upper: Option<Triple>,
    /// The points of `points` (m).
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub points: Vec<Triple>,
    /// Where the axis of `cylinder`, parallel to z, meets z = 0 (m).
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub axis: Option<[f64; 2]>,
    /// Radii at which species part (m), rising.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub species_radii: Vec<f64>,
}

fn one() -> u64 {
    1
}

/// Angles that a cylinder is averaged over.
const ANGLES: usize = 64;

impl AverageKeys {
    /// What is to be averaged.
    ///
    /// # Errors
    /// Which key is missing, superfluous or out of range.
    pub fn choice(&self, place: Place) -> Result<Choice, SceneError> {
        let kind = self.geometry;
        let given = [
            (
                "points",
                kind != GeometryKind::Points && !self.points.is_empty(),
            ),
            (
                "axis",
                kind != GeometryKind::Cylinder && self.axis.is_some(),
            ),
        ];
        place.unread(&given, "this geometry")?;
        if self.to.is_some_and(|to| to <= self.from) {
            let (to, from) = (self.to.unwrap_or_default(), self.from);
            return Err(place.refuse("to", to, format!("later than `from`, {from} s")));
        }
        let rising = |w: &[f64]| w[0] < w[1];
        let positive = self.species_radii.iter().all(|r| *r > 0.0 && r.is_finite());
        if !positive || !self.species_radii.windows(2).all(rising) {
            let list = format!("{:?}", self.species_radii);
            return Err(place.refuse("species_radii", list, "radii in m that rise"));
        }
        if let (Some(lower), Some(upper)) = (self.lower, self.upper)
            && (0..3).any(|k| lower[k] >= upper[k])
        {
            let text = format!("{upper:?}");
            return Err(place.refuse("upper", text, format!("above `lower`, {lower:?}")));
        }
        Ok(Choice {
            shape: match self.kernel {
                KernelKind::Lucy => Shape::Lucy,
                KernelKind::Gauss => Shape::Gauss,
                KernelKind::Heaviside => Shape::Heaviside,
                KernelKind::Polynomial => Shape::Polynomial,
            },
            width: self.width,
            place: match kind {
                GeometryKind::Points if self.points.is_empty() => {
                    return Err(place.missing("points", "a list of points in m"));
                }
                GeometryKind::Points => Where::Points(self.points.clone()),
                GeometryKind::Line => Where::Line,
                GeometryKind::Plane => Where::Plane,
                GeometryKind::Grid => Where::Grid,
                GeometryKind::Cylinder => {
                    let axis = place.need(&self.axis, "axis", "x and y of the axis in m")?;
                    Where::Cylinder(axis, ANGLES)
                }
            },
            cell: self.cell,
            species: self.species_radii.clone(),
        })
    }
}
