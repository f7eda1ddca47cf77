//! Walls: shapes that stand or move as they are told, and the grains that touch them.
//!
//! A wall is a [`Shape`] at a [`Pose`], with a material of the law table and a [`Motion`]. It calls the
//! same contact laws as pairs, as a partner of infinite mass and radius: the curvature of a cylinder or a
//! sphere does not enter Hertz' law.
//!
//! A shape without edges that curve inwards touches a sphere in one point; meshes may touch it in several
//! (see [`mesh`]). Two walls never know of each other: a grain in the corner between them touches both, and
//! a floor in one plane made of several walls pushes twice along their seams. Make such a floor one mesh.
//!
//! Along periodic axes a bounded wall is met in its nearest image.

mod contacts;
mod cuboid;
mod cylinder;
mod disk;
mod frustum;
mod images;
mod load;
mod meridian;
pub mod mesh;
mod motion;
mod plane;
mod pose;
mod rectangle;
mod servo;
mod shape;
mod sphere_shell;
mod standing;

pub(crate) use contacts::{Age, Scene, WallContact, WallContacts};
pub use cuboid::Cuboid;
pub use cylinder::Cylinder;
pub use disk::Disk;
pub use frustum::{Ends, Frustum};
pub(crate) use images::{Seen, Turning};
pub use load::{WallImpulse, WallLoad};
pub(crate) use meridian::any_normal_to;
pub use mesh::{Mesh, MeshError, MeshReport};
pub use motion::{Motion, Rotation, Sine, Staircase, Table};
pub use plane::Plane;
pub use pose::Pose;
pub use rectangle::Rectangle;
pub(crate) use servo::Course;
pub use servo::{Servo, Target};
pub(crate) use shape::unit;
pub use shape::{Foot, Shape, Side};
pub use sphere_shell::SphereShell;
pub(crate) use standing::{Carrier, Span, Standing};

use crate::setup::{SetupError, check};
use nalgebra::Vector3;
use std::sync::Arc;

/// A wall.
#[derive(Clone, Debug, PartialEq)]
pub struct Wall {
    /// Its surface.
    pub shape: Shape,
    /// Where it is put; motions start from here.
    pub pose: Pose,
    /// Number of its material in the law table.
    pub material: u16,
    /// What it does in time.
    pub motion: Motion,
}

impl Wall {
    /// A resting wall of the first material.
    pub fn new(shape: Shape, pose: Pose) -> Wall {
        Wall {
            shape,
            pose,
            material: 0,
            motion: Motion::Fixed,
        }
    }

    /// An unbounded plane through a point (m); its unit normal points into the grains.
    pub fn plane(point: Vector3<f64>, normal: Vector3<f64>) -> Wall {
        Wall::new(Shape::Plane(Plane { normal }), Pose::at(point))
    }

    /// A round plate with a unit vector along its axis and a radius (m).
    pub fn disk(centre: Vector3<f64>, axis: Vector3<f64>, radius: f64) -> Wall {
        Wall::new(Shape::Disk(Disk { axis, radius }), Pose::at(centre))
    }

    /// A rectangular plate; two vectors lead from its centre to the middles of two sides (m).
    pub fn rectangle(centre: Vector3<f64>, half_sides: [Vector3<f64>; 2]) -> Wall {
        Wall::new(Shape::Rectangle(Rectangle { half_sides }), Pose::at(centre))
    }

    /// An endless cylinder about the axis through a point (m).
    pub fn cylinder(point: Vector3<f64>, axis: Vector3<f64>, radius: f64, side: Side) -> Wall {
        let cylinder = Cylinder {
            axis,
            radius,
            half_length: f64::INFINITY,
            side,
        };
        Wall::new(Shape::Cylinder(cylinder), Pose::at(point))
    }

    /// A tube without lids, about the middle of its axis; grains may be inside and outside.
    pub fn tube(centre: Vector3<f64>, axis: Vector3<f64>, radius: f64, length: f64) -> Wall {
        let cylinder = Cylinder {
            axis,
            radius,
            half_length: 0.5 * length,
            side: Side::Both,
        };
        Wall::new(Shape::Cylinder(cylinder), Pose::at(centre))
    }

    /// A sphere (m).
    pub fn sphere(centre: Vector3<f64>, radius: f64, side: Side) -> Wall {
        Wall::new(
            Shape::SphereShell(SphereShell { radius, side }),
            Pose::at(centre),
        )
    }

    /// A solid cuboid about its centre, with edges along the axes; half their lengths (m).
    pub fn cuboid(centre: Vector3<f64>, half_sides: Vector3<f64>) -> Wall {
        Wall::new(Shape::Cuboid(Cuboid { half_sides }), Pose::at(centre))
    }

    /// A frustum whose first end lies at a point (m).
    pub fn frustum(point: Vector3<f64>, frustum: Frustum) -> Wall {
        Wall::new(Shape::Frustum(frustum), Pose::at(point))
    }

    /// A mesh whose vertices are given in space.
    pub fn mesh(mesh: Arc<Mesh>) -> Wall {
        Wall::new(Shape::Mesh(mesh), Pose::at(Vector3::zeros()))
    }

    /// The same wall of another material.
    pub fn material(mut self, material: u16) -> Wall {
        self.material = material;
        self
    }

    /// The same wall in motion.
    pub fn moving(mut self, motion: Motion) -> Wall {
        self.motion = motion;
        self
    }

    /// Checks its numbers; `key` says whose they are.
    pub(crate) fn validate(&self, key: &str) -> Result<(), SetupError> {
        motion::finite(&format!("{key}.position"), &self.pose.position)?;
        let length = self.pose.orientation.quaternion().norm();
        check(&format!("{key}.orientation"), length, "of length 1", |v| {
            (v - 1.0).abs() < 1e-9
        })?;
        self.shape.validate(key)?;
        self.motion.validate(&format!("{key}.motion"))
    }
}
