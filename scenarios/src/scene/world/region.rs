//! Parts of space: `within = [{ shape = "cylinder", … }, { shape = "block", … }]` is where all of these are,
//! `{ shape = "any", of = [ … ] }` where any is.

use super::{Place, Triple};
use crate::mesh_files;
use crate::scene::SceneError;
use colluvium_dem::Region;
use nalgebra::Vector3;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::path::Path;
use std::sync::Arc;

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
    /// What the closed mesh of `file` encloses (STL, OBJ, PLY, VTK, VTU, VTP, Gmsh).
    Mesh,
    /// Where any of the regions in `of` is.
    Any,
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
    /// File of a mesh.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub file: Option<String>,
    /// Metres in a unit of that file; left out: 1.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend("exclusiveMinimum" = 0.0, "maximum" = 1.0e6))]
    pub unit: Option<f64>,
    /// The regions of any.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub of: Vec<RegionKeys>,
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
            RegionKind::Mesh => {
                let file = at.need(&self.file, "file", "a mesh file")?;
                let mesh = mesh_files::read_mesh(Path::new(&file), self.unit.unwrap_or(1.0));
                let mesh = mesh.map_err(|why| {
                    at.refuse("file", &file, format!("the file of a closed mesh ({why})"))
                })?;
                if !mesh.is_closed() {
                    return Err(at.refuse("file", &file, "the file of a mesh that is closed"));
                }
                Region::Mesh(Arc::new(mesh))
            }
            RegionKind::Any => {
                if self.of.is_empty() {
                    return Err(at.missing("of", "a list of regions"));
                }
                let parts = self.of.iter().enumerate().map(|(k, part)| {
                    let section = at.key(&format!("of[{k}]"));
                    part.region(Place {
                        section: &section,
                        ..at
                    })
                });
                Region::Any(parts.collect::<Result<_, _>>()?)
            }
        };
        use RegionKind::{Any, Ball, Block, Cylinder, Frustum, Mesh, Slab};
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
                ("file", only(self.file.is_some(), &[Mesh])),
                ("unit", only(self.unit.is_some(), &[Mesh])),
                ("of", only(!self.of.is_empty(), &[Any])),
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
