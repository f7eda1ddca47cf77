//! Where a shape stands: a position and an orientation.

use nalgebra::{UnitQuaternion, Vector3};

/// Position of a shape's own origin and rotation of its own axes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pose {
    /// Where the shape's origin is (m).
    pub position: Vector3<f64>,
    /// Turns the shape's axes into those of space.
    pub orientation: UnitQuaternion<f64>,
}

impl Pose {
    /// A shape that is moved, but not turned.
    pub fn at(position: Vector3<f64>) -> Pose {
        Pose {
            position,
            orientation: UnitQuaternion::identity(),
        }
    }

    /// Whether the shape's axes are those of space; vectors then need no turning, and keep their bits.
    pub(crate) fn is_upright(&self) -> bool {
        self.orientation == UnitQuaternion::identity()
    }

    /// Turns a vector of space into the shape's axes.
    pub fn inward(&self, v: &Vector3<f64>) -> Vector3<f64> {
        if self.is_upright() {
            return *v;
        }
        self.orientation.inverse_transform_vector(v)
    }

    /// Turns a vector of the shape's axes into space.
    pub fn outward(&self, v: &Vector3<f64>) -> Vector3<f64> {
        if self.is_upright() {
            return *v;
        }
        self.orientation.transform_vector(v)
    }

    /// The pose after a turn about a point of space.
    pub fn turned_about(&self, point: &Vector3<f64>, turn: &UnitQuaternion<f64>) -> Pose {
        Pose {
            position: point + turn * (self.position - point),
            orientation: turn * self.orientation,
        }
    }
}
