//! Rigid bodies: `[bodies.NAME]`, parts at poses of the body's own axes, with a mass and a freedom.

use super::{Materials, MotionKeys, Place, Triple};
use crate::failure::Failure;
use crate::mesh_files;
use crate::scene::SceneError;
use colluvium_dem::walls::Pose;
use colluvium_dem::{Body, Freedom, Hinge, MassProperties, Motion, Part};
use nalgebra::{Matrix3, UnitQuaternion, Vector3};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::path::Path;
use std::sync::Arc;

/// Shapes of parts.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum PartKind {
    /// A ball of `radius` about `point`.
    Sphere,
    /// A cuboid of `sides` about `point`.
    Cuboid,
    /// A cylinder of `radius` and `length` about `point`, its axis along `axis`.
    Cylinder,
    /// A cone's stump from `point` along `axis` over `length`, of `radii` at both ends.
    Frustum,
    /// What the triangles of `file` enclose (STL, OBJ, PLY, VTK, VTU, VTP, Gmsh).
    Mesh,
}

/// How a body may move.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum FreedomKind {
    /// Forces move and turn it.
    #[default]
    Free,
    /// Forces turn it about the axis of `hinge`.
    Hinged,
    /// It moves as `motion` says.
    Driven,
    /// It stays where it is.
    Held,
}

/// A part of a body, in the body's own axes.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct PartKeys {
    /// Its shape.
    pub shape: PartKind,
    /// Where it sits (m); left out: the body's origin.
    #[serde(default)]
    pub point: Triple,
    /// Axis of a cylinder or frustum; left out: z.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub axis: Option<Triple>,
    /// Turn of a cuboid or mesh about `point`: a vector along the axis, its length the angle (degrees).
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub turn_degrees: Option<Triple>,
    /// Radius of a sphere or cylinder (m).
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
    /// Lengths of the edges of a cuboid (m).
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub sides: Option<Triple>,
    /// File of a mesh.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub file: Option<String>,
    /// Metres in a unit of that file; left out: 1.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend("exclusiveMinimum" = 0.0, "maximum" = 1.0e6))]
    pub unit: Option<f64>,
    /// Density (kg/m³); left out where the body's mass is given: that is then spread evenly. 0 is a surface
    /// without mass.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend("minimum" = 0.0, "maximum" = 1.0e6))]
    pub density: Option<f64>,
    /// Radius of edges and corners (m); left out: a twentieth of the smallest half width. A mesh lies so far
    /// inside of what is felt.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend("exclusiveMinimum" = 0.0, "maximum" = 1.0e6))]
    pub rounding: Option<f64>,
    /// Name of its material, of `[grains]` or `[surfaces]`; left out: that of the body.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub material: Option<String>,
}

/// The axis that a body hangs on.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct HingeKeys {
    /// A point of it (m).
    pub point: Triple,
    /// Its direction.
    pub axis: Triple,
}

/// A rigid body. Bodies are put in when the grains are in place.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct BodyKeys {
    /// Its parts; where they overlap their masses count twice.
    #[schemars(length(min = 1))]
    pub parts: Vec<PartKeys>,
    /// Where its own origin is at the start (m).
    #[serde(default)]
    pub point: Triple,
    /// Turn of its own axes about that: a vector along the axis, its length the angle (degrees).
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub turn_degrees: Option<Triple>,
    /// How it may move; left out: free.
    #[serde(default)]
    pub freedom: FreedomKind,
    /// Velocity of the centre of mass of a free body at the start (m/s).
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub velocity: Option<Triple>,
    /// Angular velocity at the start, in directions of space (rad/s); of a hinged body along its axis.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub spin: Option<Triple>,
    /// The axis of a hinged body.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub hinge: Option<HingeKeys>,
    /// What a driven body does in time: all motions of walls but the servo.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub motion: Option<MotionKeys>,
    /// Mass (kg); left out: from the densities of its parts.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend("exclusiveMinimum" = 0.0, "maximum" = 1.0e12))]
    pub mass: Option<f64>,
    /// Inertia tensor about the centre of mass in its own axes: xx, yy, zz, yz, zx, xy (kg m²); left out: as
    /// the parts' densities spread the mass. Products are the tensor's own elements, -∫ y z dm.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub inertia: Option<[f64; 6]>,
    /// Centre of mass in its own axes, with `inertia` (m); left out: its origin.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub centre: Option<Triple>,
    /// Name of its material, of `[grains]` or `[surfaces]`; left out: the first kind of grains.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub material: Option<String>,
}

fn turn(degrees: Option<Triple>) -> UnitQuaternion<f64> {
    UnitQuaternion::from_scaled_axis(Vector3::from(degrees.unwrap_or_default()) * 1f64.to_radians())
}

impl PartKeys {
    fn check_unread(&self, at: Place) -> Result<(), SceneError> {
        use PartKind::{Cuboid, Cylinder, Frustum, Mesh, Sphere};
        let only = |given: bool, shapes: &[PartKind]| given && !shapes.contains(&self.shape);
        at.unread(
            &[
                ("axis", only(self.axis.is_some(), &[Cylinder, Frustum])),
                (
                    "turn_degrees",
                    only(self.turn_degrees.is_some(), &[Cuboid, Mesh]),
                ),
                ("radius", only(self.radius.is_some(), &[Sphere, Cylinder])),
                ("radii", only(self.radii.is_some(), &[Frustum])),
                ("length", only(self.length.is_some(), &[Cylinder, Frustum])),
                ("sides", only(self.sides.is_some(), &[Cuboid])),
                ("file", only(self.file.is_some(), &[Mesh])),
                ("unit", only(self.unit.is_some(), &[Mesh])),
                (
                    "rounding",
                    only(self.rounding.is_some(), &[Cuboid, Cylinder, Frustum, Mesh]),
                ),
            ],
            &format!("a {:?}", self.shape).to_lowercase(),
        )
    }

    /// The part, of a density (kg/m³) and a material where it names none.
    fn part(
        &self,
        materials: &Materials,
        at: Place,
        (density, material): (f64, u16),
    ) -> Result<Part, Failure> {
        self.check_unread(at)?;
        let radius = || at.need(&self.radius, "radius", "a radius in m");
        let length = || at.need(&self.length, "length", "a length in m");
        let along = match self.axis {
            None => UnitQuaternion::identity(),
            Some(axis) => {
                let axis = at.direction(axis, "axis")?;
                let half_turn =
                    UnitQuaternion::from_scaled_axis(Vector3::x() * std::f64::consts::PI);
                UnitQuaternion::rotation_between(&Vector3::z(), &axis).unwrap_or(half_turn)
            }
        };
        let part = match self.shape {
            PartKind::Sphere => Part::sphere(radius()?, density),
            PartKind::Cuboid => {
                let sides = at.need(&self.sides, "sides", "three lengths in m")?;
                Part::cuboid(Vector3::from(sides) * 0.5, density).turned(turn(self.turn_degrees))
            }
            PartKind::Cylinder => Part::cylinder(radius()?, length()?, density).turned(along),
            PartKind::Frustum => {
                let radii = at.need(&self.radii, "radii", "two radii in m")?;
                Part::frustum(radii, length()?, density).turned(along)
            }
            PartKind::Mesh => {
                let file = at.need(&self.file, "file", "a mesh file")?;
                let mesh = mesh_files::read_mesh(Path::new(&file), self.unit.unwrap_or(1.0));
                let mesh = mesh.map_err(|error| {
                    Failure::Input(format!("{}: key `{}`: {error}", at.origin, at.key("file")))
                })?;
                Part::mesh(Arc::new(mesh), density).turned(turn(self.turn_degrees))
            }
        };
        let part = match self.rounding {
            Some(rounding) => part.rounded(rounding),
            None => part,
        };
        let material = match &self.material {
            Some(name) => materials.number(name, "material", at)?,
            None => material,
        };
        Ok(part.at(self.point.into()).material(material))
    }
}

impl BodyKeys {
    fn check_unread(&self, at: Place) -> Result<(), SceneError> {
        use FreedomKind::{Driven, Free, Hinged};
        let only = |given: bool, kinds: &[FreedomKind]| given && !kinds.contains(&self.freedom);
        at.unread(
            &[
                ("velocity", only(self.velocity.is_some(), &[Free])),
                ("spin", only(self.spin.is_some(), &[Free, Hinged])),
                ("hinge", only(self.hinge.is_some(), &[Hinged])),
                ("motion", only(self.motion.is_some(), &[Driven])),
                ("mass", only(self.mass.is_some(), &[Free, Hinged])),
                ("inertia", only(self.inertia.is_some(), &[Free, Hinged])),
            ],
            &format!("a {:?} body", self.freedom).to_lowercase(),
        )?;
        let without = self.centre.is_some() && self.inertia.is_none();
        at.unread(&[("centre", without)], "a body without `inertia`")
    }

    fn freedom(&self, at: Place) -> Result<Freedom, SceneError> {
        Ok(match self.freedom {
            FreedomKind::Free => Freedom::Free,
            FreedomKind::Held => Freedom::Driven(Motion::Fixed),
            FreedomKind::Hinged => {
                let hinge = at.need(&self.hinge, "hinge", "{ point, axis }")?;
                let section = at.key("hinge");
                let place = Place {
                    section: &section,
                    ..at
                };
                Freedom::Hinged(Hinge {
                    point: hinge.point.into(),
                    axis: place.direction(hinge.axis, "axis")?,
                })
            }
            FreedomKind::Driven => {
                let motion = at.need(&self.motion, "motion", "a motion: { kind, … }")?;
                let section = at.key("motion");
                Freedom::Driven(motion.motion(Place {
                    section: &section,
                    ..at
                })?)
            }
        })
    }

    /// Density of a part that gives none (kg/m³).
    fn usual_density(&self) -> Option<f64> {
        let told = matches!(self.freedom, FreedomKind::Driven | FreedomKind::Held);
        match (told, self.mass) {
            (true, _) => Some(0.0),
            // It only says how the mass is spread.
            (_, Some(_)) => Some(1.0),
            _ => None,
        }
    }

    /// The body.
    pub fn body(&self, materials: &Materials, at: Place) -> Result<Body, Failure> {
        self.check_unread(at)?;
        let material = match &self.material {
            Some(name) => materials.number(name, "material", at)?,
            None => 0,
        };
        let mut parts = Vec::new();
        for (k, keys) in self.parts.iter().enumerate() {
            let section = at.key(&format!("parts[{k}]"));
            let place = Place {
                section: &section,
                ..at
            };
            let density = keys.density.or(self.usual_density());
            let density = place.need(&density, "density", "kg/m³, or a mass of the body")?;
            parts.push(keys.part(materials, place, (density, material))?);
        }
        let mut body = Body {
            pose: Pose {
                position: self.point.into(),
                orientation: turn(self.turn_degrees),
            },
            velocity: self.velocity.unwrap_or_default().into(),
            spin: self.spin.unwrap_or_default().into(),
            freedom: self.freedom(at)?,
            ..Body::new(parts)
        };
        let refused = |error| Failure::Input(format!("{}: {error}", at.origin));
        // Parts first: what is wrong with one is said with its own key.
        if self.inertia.is_none() {
            body.validate(at.section, materials.names.len())
                .map_err(refused)?;
        }
        if let Some([xx, yy, zz, yz, zx, xy]) = self.inertia {
            body.mass = Some(MassProperties {
                mass: at.need(&self.mass, "mass", "kg, with an inertia")?,
                centre: self.centre.unwrap_or_default().into(),
                inertia: Matrix3::new(xx, xy, zx, xy, yy, yz, zx, yz, zz),
            });
        } else if let Some(mass) = self.mass {
            let spread = body.mass_properties(at.section).map_err(refused)?;
            body.mass = Some(spread.scaled_to(mass));
        }
        body.validate(at.section, materials.names.len())
            .map_err(refused)?;
        Ok(body)
    }
}

/// All bodies of a scene, in the order of their names.
pub fn bodies(
    bodies: &BTreeMap<String, BodyKeys>,
    materials: &Materials,
    origin: &str,
) -> Result<Vec<(String, Body)>, Failure> {
    let body = |(name, keys): (&String, &BodyKeys)| {
        let section = format!("bodies.{name}");
        let place = Place {
            origin,
            section: &section,
        };
        Ok((name.clone(), keys.body(materials, place)?))
    };
    bodies.iter().map(body).collect()
}
