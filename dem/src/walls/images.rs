//! What a periodic box shows of a wall.
//!
//! A plane has no images, and of any other surface but a mesh a grain sees the one image whose origin is nearest.
//! Along a periodic axis e of length L that is all there is only if
//!
//! ```text
//! max |e · x| ≤ L/2     x points of the surface from its origin, in all its turns
//! ```
//! or the surface is endless along e, or a plate, a tube or a bar with straight sides along e: its middle stands for
//! all of it. A plane must not cross the axis. Meshes show all of their images.

use super::motion::Motion;
use super::shape::Shape;
use super::{Cylinder, Frustum, Wall};
use crate::domain::Domain;
use crate::setup::{SetupError, check};
use nalgebra::{UnitQuaternion, Vector3};

/// How a surface may turn in a run.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Turning {
    Not,
    /// About a unit vector.
    About(Vector3<f64>),
    Any,
}

/// A surface as a periodic box sees it.
pub(crate) struct Seen<'a> {
    pub shape: &'a Shape,
    /// How far the surface lies beyond the shape (m).
    pub rounding: f64,
    /// Turns the shape's axes into those of space at the start.
    pub turn: UnitQuaternion<f64>,
    pub turning: Turning,
}

/// Cosines and lengths that are nothing but round-off.
const ROUND_OFF: f64 = 1e-9;

impl Motion {
    pub(crate) fn turning(&self) -> Turning {
        match self {
            Motion::Rotation(rotation) => Turning::About(rotation.axis),
            _ => Turning::Not,
        }
    }
}

impl Wall {
    /// Refuses a wall of which a periodic box would show no images where there are some.
    pub(crate) fn check_images(&self, domain: &Domain, key: &str) -> Result<(), SetupError> {
        let seen = Seen {
            shape: &self.shape,
            rounding: 0.0,
            turn: self.pose.orientation,
            turning: self.motion.turning(),
        };
        seen.check(domain, key)
    }
}

impl Seen<'_> {
    /// Refuses what reaches beyond half of a periodic box.
    pub fn check(&self, domain: &Domain, key: &str) -> Result<(), SetupError> {
        for (k, name) in ["x", "y", "z"].into_iter().enumerate() {
            if !domain.periodic[k] {
                continue;
            }
            let axis = Vector3::ith(k, 1.0);
            if let Shape::Plane(plane) = self.shape {
                let key = format!("{key}.normal, its part along the periodic axis {name}");
                let part = self.largest_part(&(self.turn * plane.normal), &axis);
                check(&key, part, "0: a plane has no images", |p| p < ROUND_OFF)?;
                continue;
            }
            let half = 0.5 * domain.lengths()[k];
            let key = format!("{key}: reach from its origin along the periodic axis {name}");
            let word = "at most half of the box, m: of walls but meshes one image is seen";
            let reach = self.reach(&axis) + self.rounding;
            let whole = matches!(self.shape, Shape::Mesh(_)) || self.is_straight_along(&axis);
            if !whole {
                check(&key, reach, word, |r| r <= half * (1.0 + ROUND_OFF))?;
            }
        }
        Ok(())
    }

    /// Largest part along an axis that a unit vector of the surface has in its turns.
    fn largest_part(&self, vector: &Vector3<f64>, axis: &Vector3<f64>) -> f64 {
        match &self.turning {
            Turning::Not => vector.dot(axis).abs(),
            Turning::About(pivot) => {
                let along = (vector.dot(pivot) * axis.dot(pivot)).abs();
                along + vector.cross(pivot).norm() * axis.cross(pivot).norm()
            }
            Turning::Any => 1.0,
        }
    }

    /// Whether turning leaves distances along an axis as they are.
    fn keeps(&self, axis: &Vector3<f64>) -> bool {
        match &self.turning {
            Turning::Not => true,
            Turning::About(pivot) => {
                pivot.cross(axis).norm() < ROUND_OFF || self.is_round_about(pivot)
            }
            Turning::Any => false,
        }
    }

    /// Whether a turn about a vector leaves the surface as it is, wherever it takes its origin.
    fn is_round_about(&self, pivot: &Vector3<f64>) -> bool {
        let own = self.turn.inverse_transform_vector(pivot);
        let about = |axis: &Vector3<f64>| axis.cross(&own).norm() < ROUND_OFF;
        match self.shape {
            Shape::Disk(disk) => about(&disk.axis),
            Shape::Cylinder(cylinder) => about(&cylinder.axis),
            Shape::Frustum(frustum) => about(&frustum.axis),
            Shape::SphereShell(_) => true,
            _ => false,
        }
    }

    /// Whether the surface is the same at all places along an axis, but for its ends.
    fn is_straight_along(&self, axis: &Vector3<f64>) -> bool {
        let own = self.turn.inverse_transform_vector(axis);
        let along = |v: &Vector3<f64>| v.cross(&own).norm() < ROUND_OFF * v.norm();
        self.keeps(axis)
            && match self.shape {
                Shape::Rectangle(rectangle) => rectangle.half_sides.iter().any(along),
                Shape::Cylinder(cylinder) => along(&cylinder.axis),
                Shape::Cuboid(_) => (0..3).any(|k| along(&Vector3::ith(k, 1.0))),
                _ => false,
            }
    }

    /// Farthest point along an axis from the surface's origin, either way (m).
    fn reach(&self, axis: &Vector3<f64>) -> f64 {
        if !self.keeps(axis) {
            return self.shape.extent();
        }
        let own = self.turn.inverse_transform_vector(axis);
        let round = |a: &Vector3<f64>, radius: f64| radius * a.cross(&own).norm();
        match self.shape {
            Shape::Plane(_) => f64::INFINITY,
            Shape::Disk(disk) => round(&disk.axis, disk.radius),
            Shape::Rectangle(r) => r.half_sides.iter().map(|v| v.dot(&own).abs()).sum(),
            Shape::Cylinder(Cylinder {
                axis: a,
                radius,
                half_length,
                ..
            }) => {
                let part = a.dot(&own).abs();
                // Endless times nothing is nothing.
                let ends = if part < ROUND_OFF {
                    0.0
                } else {
                    half_length * part
                };
                ends + round(a, *radius)
            }
            Shape::Frustum(Frustum {
                axis: a,
                height,
                radii,
                ..
            }) => {
                let far = height * a.dot(&own).abs() + round(a, radii[1]);
                far.max(round(a, radii[0]))
            }
            Shape::Cuboid(cuboid) => cuboid.half_sides.dot(&own.abs()),
            Shape::SphereShell(shell) => shell.radius,
            Shape::Mesh(mesh) => mesh.extent(),
        }
    }
}
