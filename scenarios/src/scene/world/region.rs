//! Parts of space: `within = [{ shape = "cylinder", … }, { shape = "block", … }]` is where all of these are.

use super::{Place, Triple};
use crate::scene::SceneError;
use colluvium_dem::Region;
use nalgebra::Vector3;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Shape of a region.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum RegionKind {
    /// A block along the axes; a corner that is left out is infinitely far.
    Block,
    /// A ball.
    Ball,
    /// What lies between two planes.
    Slab,
    /// A cylinder without ends.
    Cylinder,
    /// A truncated cone from `point` along `axis` over `length`, of `radii` at both ends.
    Frustum,
}

/// A part of space (m).
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct RegionKeys {
    /// Its shape.
    pub shape: RegionKind,
    /// Lower corner of a block (m).
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub lower: Option<Triple>,
    /// Upper corner of a block (m).
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub upper: Option<Triple>,
    /// Centre of a ball, a point half way between the planes of a slab, one of a cylinder's axis (m).
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub point: Option<Triple>,
    /// Direction of a cylinder's axis, or across a slab.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub axis: Option<Triple>,
    /// Radius of a ball or a cylinder (m).
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend("exclusiveMinimum" = 0.0, "maximum" = 1.0e6))]
    pub radius: Option<f64>,
    /// Radii of a frustum at `point` and at its other end (m).
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub radii: Option<[f64; 2]>,
    /// Length of a frustum (m).
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend("exclusiveMinimum" = 0.0, "maximum" = 1.0e6))]
    pub length: Option<f64>,
    /// Thickness of a slab (m).
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend("exclusiveMinimum" = 0.0, "maximum" = 1.0e6))]
    pub thickness: Option<f64>,
    /// What is meant is all that is not in it.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub outside: bool,
}

impl RegionKeys {
    fn region(&self, at: Place) -> Result<Region, SceneError> {
        let point = || -> Result<Vector3<f64>, SceneError> {
            Ok(at.need(&self.point, "point", "a point in m")?.into())
        };
        let radius = || at.need(&self.radius, "radius", "a radius in m");
        let axis = || at.direction(at.need(&self.axis, "axis", "a direction")?, "axis");
        let inside = match self.shape {
            RegionKind::Block => Region::Block {
                lower: self
                    .lower
                    .map_or(Vector3::repeat(f64::NEG_INFINITY), Vector3::from),
                upper: self
                    .upper
                    .map_or(Vector3::repeat(f64::INFINITY), Vector3::from),
            },
            RegionKind::Ball => Region::Ball {
                center: point()?,
                radius: radius()?,
            },
            RegionKind::Slab => Region::Slab {
                point: point()?,
                normal: axis()?,
                thickness: at.need(&self.thickness, "thickness", "a length in m")?,
            },
            RegionKind::Cylinder => Region::Cylinder {
                point: point()?,
                axis: axis()?,
                radius: radius()?,
            },
            RegionKind::Frustum => Region::Frustum {
                point: point()?,
                axis: axis()?,
                length: at.need(&self.length, "length", "a length in m")?,
                radii: at.need(&self.radii, "radii", "two radii in m")?,
            },
        };
        use RegionKind::{Ball, Block, Cylinder, Frustum, Slab};
        let only = |given: bool, shapes: &[RegionKind]| given && !shapes.contains(&self.shape);
        at.unread(
            &[
                ("lower", only(self.lower.is_some(), &[Block])),
                ("upper", only(self.upper.is_some(), &[Block])),
                (
                    "point",
                    only(self.point.is_some(), &[Ball, Slab, Cylinder, Frustum]),
                ),
                (
                    "axis",
                    only(self.axis.is_some(), &[Slab, Cylinder, Frustum]),
                ),
                ("radii", only(self.radii.is_some(), &[Frustum])),
                ("length", only(self.length.is_some(), &[Frustum])),
                ("radius", only(self.radius.is_some(), &[Ball, Cylinder])),
                ("thickness", only(self.thickness.is_some(), &[Slab])),
            ],
            &format!("a {:?}", self.shape).to_lowercase(),
        )?;
        Ok(if self.outside {
            Region::Outside(Box::new(inside))
        } else {
            inside
        })
    }
}

/// Where all of these are; everywhere if there are none.
pub fn region(parts: &[RegionKeys], at: Place) -> Result<Region, SceneError> {
    let mut regions = Vec::new();
    for (k, part) in parts.iter().enumerate() {
        let section = format!("{}[{k}]", at.section);
        let place = Place {
            section: &section,
            ..at
        };
        regions.push(part.region(place)?);
    }
    let region = match regions.len() {
        0 => Region::Everywhere,
        1 => regions.remove(0),
        _ => Region::All(regions),
    };
    region
        .validate(at.section)
        .map_err(|error| SceneError::Unreadable {
            file: at.origin.to_owned(),
            message: error.to_string(),
        })?;
    Ok(region)
}
