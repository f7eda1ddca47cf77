//! Walls: `[walls.NAME]`, each a shape at a pose, of a material, with a motion.

use super::{Materials, MotionKeys, Place, Triple};
use crate::failure::Failure;
use crate::mesh_files;
use crate::scene::SceneError;
use colluvium_dem::walls::{Cylinder, Disk, Ends, Frustum, Plane, Pose, Rectangle, SphereShell};
use colluvium_dem::{Motion, Shape, Side, Wall};
use nalgebra::{UnitQuaternion, Vector3};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::path::Path;
use std::sync::Arc;

/// Shapes of walls.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum WallKind {
    /// An unbounded plane through `point`; `axis` points into the grains.
    Plane,
    /// A round plate about `point`, across `axis`, of `radius`.
    Disk,
    /// A rectangular plate about `point`; `half_sides` lead to the middles of two sides.
    Rectangle,
    /// A cylinder without lids about `axis` through `point`, of `radius`; endless without `length`, else
    /// `point` is its middle.
    Cylinder,
    /// A cone's stump from `point` along `axis` over `length`, of `radii` at both ends.
    Frustum,
    /// A sphere about `point`, of `radius`.
    Sphere,
    /// Triangles from `file` (STL, OBJ, PLY, VTK, VTU, VTP, Gmsh).
    Mesh,
}

/// Where grains live.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum SideKind {
    /// Within.
    Inside,
    /// Without.
    Outside,
    /// On both sides of a plate without thickness.
    Both,
}

/// A wall.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct WallKeys {
    /// Its shape.
    pub shape: WallKind,
    /// Where it is put (m); left out: the origin.
    #[serde(default)]
    pub point: Triple,
    /// Normal of a plane, axis of a disk, cylinder or frustum.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub axis: Option<Triple>,
    /// Radius of a disk, cylinder or sphere (m).
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend("exclusiveMinimum" = 0.0, "maximum" = 1.0e6))]
    pub radius: Option<f64>,
    /// Radii of a frustum at `point` and at its other end (m).
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub radii: Option<[f64; 2]>,
    /// Length of a cylinder or frustum (m).
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend("exclusiveMinimum" = 0.0, "maximum" = 1.0e6))]
    pub length: Option<f64>,
    /// Vectors from the middle of a rectangle to the middles of two sides (m).
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub half_sides: Option<[Triple; 2]>,
    /// On which side of a cylinder, frustum or sphere grains live; left out: inside.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub side: Option<SideKind>,
    /// A frustum with lids: a solid, grains live outside.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub capped: bool,
    /// File of a mesh.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub file: Option<String>,
    /// Metres in a unit of that file; left out: 1.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend("exclusiveMinimum" = 0.0, "maximum" = 1.0e6))]
    pub unit: Option<f64>,
    /// Turn of the shape about `point`: a vector along the axis, its length the angle (degrees).
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub turn_degrees: Option<Triple>,
    /// Name of its material, of `[grains]` or `[surfaces]`; left out: the first kind of grains.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub material: Option<String>,
    /// What it does in time; left out: it stands.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub motion: Option<MotionKeys>,
}

impl WallKeys {
    fn shape(&self, at: Place) -> Result<Shape, Failure> {
        let axis = || at.direction(at.need(&self.axis, "axis", "a direction")?, "axis");
        let radius = || at.need(&self.radius, "radius", "a radius in m");
        let side = match self.side {
            None | Some(SideKind::Inside) => Side::Inside,
            Some(SideKind::Outside) => Side::Outside,
            Some(SideKind::Both) => Side::Both,
        };
        Ok(match self.shape {
            WallKind::Plane => Shape::Plane(Plane { normal: axis()? }),
            WallKind::Disk => Shape::Disk(Disk {
                axis: axis()?,
                radius: radius()?,
            }),
            WallKind::Rectangle => Shape::Rectangle(Rectangle {
                half_sides: at
                    .need(&self.half_sides, "half_sides", "two vectors in m")?
                    .map(Vector3::from),
            }),
            WallKind::Cylinder => Shape::Cylinder(Cylinder {
                axis: axis()?,
                radius: radius()?,
                half_length: self.length.map_or(f64::INFINITY, |l| 0.5 * l),
                side,
            }),
            WallKind::Frustum => Shape::Frustum(Frustum {
                axis: axis()?,
                height: at.need(&self.length, "length", "a length in m")?,
                radii: at.need(&self.radii, "radii", "two radii in m")?,
                ends: if self.capped {
                    Ends::Capped
                } else {
                    Ends::Open(side)
                },
            }),
            WallKind::Sphere => Shape::SphereShell(SphereShell {
                radius: radius()?,
                side,
            }),
            WallKind::Mesh => {
                let file = at.need(&self.file, "file", "a mesh file")?;
                let mesh = mesh_files::read_mesh(Path::new(&file), self.unit.unwrap_or(1.0));
                let mesh = mesh.map_err(|error| {
                    Failure::Input(format!("{}: key `{}`: {error}", at.origin, at.key("file")))
                })?;
                Shape::Mesh(Arc::new(mesh))
            }
        })
    }

    fn check_unread(&self, at: Place) -> Result<(), SceneError> {
        use WallKind::{Cylinder, Disk, Frustum, Mesh, Plane, Rectangle, Sphere};
        let only = |given: bool, shapes: &[WallKind]| given && !shapes.contains(&self.shape);
        at.unread(
            &[
                (
                    "axis",
                    only(self.axis.is_some(), &[Plane, Disk, Cylinder, Frustum]),
                ),
                (
                    "radius",
                    only(self.radius.is_some(), &[Disk, Cylinder, Sphere]),
                ),
                ("radii", only(self.radii.is_some(), &[Frustum])),
                ("length", only(self.length.is_some(), &[Cylinder, Frustum])),
                ("half_sides", only(self.half_sides.is_some(), &[Rectangle])),
                (
                    "side",
                    only(self.side.is_some(), &[Cylinder, Frustum, Sphere]),
                ),
                ("capped", only(self.capped, &[Frustum])),
                ("file", only(self.file.is_some(), &[Mesh])),
                ("unit", only(self.unit.is_some(), &[Mesh])),
            ],
            &format!("a {:?}", self.shape).to_lowercase(),
        )
    }

    /// The wall.
    pub fn wall(&self, materials: &Materials, at: Place) -> Result<Wall, Failure> {
        self.check_unread(at)?;
        let turn = Vector3::from(self.turn_degrees.unwrap_or_default()) * 1f64.to_radians();
        let motion = match &self.motion {
            None => Motion::Fixed,
            Some(keys) => {
                let section = format!("{}.motion", at.section);
                keys.motion(Place {
                    section: &section,
                    ..at
                })?
            }
        };
        let wall = Wall {
            shape: self.shape(at)?,
            pose: Pose {
                position: self.point.into(),
                orientation: UnitQuaternion::from_scaled_axis(turn),
            },
            material: match &self.material {
                Some(name) => materials.number(name, "material", at)?,
                None => 0,
            },
            motion,
        };
        wall.shape
            .validate(at.section)
            .map_err(|error| Failure::Input(format!("{}: {error}", at.origin)))?;
        Ok(wall)
    }
}

/// All walls of a scene, in the order of their names.
pub fn walls(
    walls: &BTreeMap<String, WallKeys>,
    materials: &Materials,
    origin: &str,
) -> Result<Vec<Wall>, Failure> {
    let wall = |(name, keys): (&String, &WallKeys)| {
        let section = format!("walls.{name}");
        keys.wall(
            materials,
            Place {
                origin,
                section: &section,
            },
        )
    };
    walls.iter().map(wall).collect()
}
