//! Shapes in their own coordinates; a pose puts them into space.
//!
//! A shape answers one question: where is its surface nearest to a centre? Walls are shapes that stand
//! or move as they are told; a rigid body may be made of the same shapes.

use super::cuboid::Cuboid;
use super::cylinder::Cylinder;
use super::disk::Disk;
use super::frustum::{Ends, Frustum};
use super::mesh::Mesh;
use super::plane::Plane;
use super::rectangle::Rectangle;
use super::sphere_shell::SphereShell;
use crate::setup::{SetupError, check};
use nalgebra::Vector3;
use std::sync::Arc;

/// On which side of a closed or endless surface grains live.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Side {
    /// Within; a centre beyond the surface counts as pressed through it.
    Inside,
    /// Without; a centre within counts as pressed through.
    Outside,
    /// On both: the surface is a plate without thickness, and pushes towards the side a centre is on.
    Both,
}

/// The point of a surface that is nearest to a centre c: c − distance · normal.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Foot {
    /// Distance of the centre (m), negative if it has been pressed through.
    pub distance: f64,
    /// Unit vector from the surface into the grains.
    pub normal: Vector3<f64>,
}

/// A surface.
#[derive(Clone, Debug, PartialEq)]
pub enum Shape {
    /// An unbounded plane.
    Plane(Plane),
    /// A round plate.
    Disk(Disk),
    /// A rectangular plate.
    Rectangle(Rectangle),
    /// A cylinder without lids.
    Cylinder(Cylinder),
    /// A cone or its stump, open or solid.
    Frustum(Frustum),
    /// A solid cuboid.
    Cuboid(Cuboid),
    /// A sphere.
    SphereShell(SphereShell),
    /// A triangle mesh; a sphere may touch it in several points.
    Mesh(Arc<Mesh>),
}

impl Shape {
    /// Foot of a centre in the shape's own coordinates (m).
    #[inline(always)]
    pub fn foot(&self, centre: &Vector3<f64>) -> Foot {
        match self {
            Shape::Plane(shape) => shape.foot(centre),
            Shape::Disk(shape) => shape.foot(centre),
            Shape::Rectangle(shape) => shape.foot(centre),
            Shape::Cylinder(shape) => shape.foot(centre),
            Shape::Frustum(shape) => shape.foot(centre),
            Shape::Cuboid(shape) => shape.foot(centre),
            Shape::SphereShell(shape) => shape.foot(centre),
            Shape::Mesh(mesh) => mesh.foot(centre),
        }
    }

    /// Distance of the farthest point of the surface from the shape's origin (m).
    pub fn extent(&self) -> f64 {
        match self {
            Shape::Plane(_) => f64::INFINITY,
            Shape::Disk(disk) => disk.radius,
            Shape::Rectangle(r) => (r.half_sides[0] + r.half_sides[1]).norm(),
            Shape::Cylinder(c) => c.radius.hypot(c.half_length),
            Shape::Frustum(f) => f.radii[0].max(f.radii[1].hypot(f.height)),
            Shape::Cuboid(cuboid) => cuboid.half_sides.norm(),
            Shape::SphereShell(shell) => shell.radius,
            Shape::Mesh(mesh) => mesh.extent(),
        }
    }

    /// Whether grains may lie on both sides of the surface, so that one pressed through it is not seen
    /// by its distance.
    pub(crate) fn is_plate(&self) -> bool {
        match self {
            Shape::Plane(_) | Shape::Cuboid(_) => false,
            Shape::Disk(_) | Shape::Rectangle(_) | Shape::Mesh(_) => true,
            Shape::Cylinder(Cylinder { side, .. }) => *side == Side::Both,
            Shape::Frustum(frustum) => frustum.ends == Ends::Open(Side::Both),
            Shape::SphereShell(shell) => shell.side == Side::Both,
        }
    }

    /// Checks the numbers of a shape; `key` says whose they are.
    pub fn validate(&self, key: &str) -> Result<(), SetupError> {
        let length =
            |name: &str, value: f64| check(&format!("{key}.{name}"), value, "> 0 m", |v| v > 0.0);
        match self {
            Shape::Plane(plane) => unit(&format!("{key}.normal"), &plane.normal),
            Shape::Disk(disk) => {
                unit(&format!("{key}.axis"), &disk.axis)?;
                length("radius", disk.radius)
            }
            Shape::Rectangle(rectangle) => {
                let [u, v] = &rectangle.half_sides;
                length("half_sides[0]", u.norm())?;
                length("half_sides[1]", v.norm())?;
                let slant = u.dot(v) / (u.norm() * v.norm());
                let allowed = "0, the cosine of a right angle";
                let key = format!("{key}.half_sides");
                check(&key, slant, allowed, |v| v.abs() < 1e-9)
            }
            Shape::Cylinder(cylinder) => {
                unit(&format!("{key}.axis"), &cylinder.axis)?;
                length("radius", cylinder.radius)?;
                if cylinder.half_length == f64::INFINITY {
                    return Ok(());
                }
                length("half_length", cylinder.half_length)
            }
            Shape::Frustum(frustum) => {
                unit(&format!("{key}.axis"), &frustum.axis)?;
                length("height", frustum.height)?;
                for (end, radius) in frustum.radii.into_iter().enumerate() {
                    let key = format!("{key}.radii[{end}]");
                    check(&key, radius, "≥ 0 m", |v| v >= 0.0)?;
                }
                length("radii, the larger", frustum.radii[0].max(frustum.radii[1]))
            }
            Shape::Cuboid(cuboid) => {
                let sides = cuboid.half_sides.iter().enumerate();
                let mut sides = sides.map(|(k, side)| length(&format!("half_sides[{k}]"), *side));
                sides.try_for_each(|side| side)
            }
            Shape::SphereShell(shell) => length("radius", shell.radius),
            // Checked when it was made.
            Shape::Mesh(_) => Ok(()),
        }
    }
}

/// Checks that a vector has the length 1.
pub(crate) fn unit(key: &str, vector: &Vector3<f64>) -> Result<(), SetupError> {
    check(key, vector.norm(), "a unit vector", |v| {
        (v - 1.0).abs() < 1e-9
    })
}
