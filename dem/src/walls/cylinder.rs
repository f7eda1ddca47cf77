//! A circular cylinder about an axis through the shape's origin, endless or cut on both sides.

use super::meridian;
use super::shape::{Foot, Side};
use nalgebra::{Vector2, Vector3};

/// A cylinder without lids, as thin as paper.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cylinder {
    /// Unit vector along its axis.
    pub axis: Vector3<f64>,
    /// Radius (m).
    pub radius: f64,
    /// Half its length (m); infinite for an endless one.
    pub half_length: f64,
    /// Where grains live.
    pub side: Side,
}

impl Cylinder {
    /// Foot of a centre: along the radius, or from the nearest point of a rim.
    pub fn foot(&self, centre: &Vector3<f64>) -> Foot {
        let z = centre.dot(&self.axis);
        let h = if self.half_length.is_finite() {
            self.half_length
        } else {
            // Any length that keeps the ends out of sight.
            2.0 * (z.abs() + self.radius)
        };
        let segment = [Vector2::new(self.radius, -h), Vector2::new(self.radius, h)];
        meridian::plate(centre, &self.axis, segment, self.side)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn both_sides_and_the_rim() {
        let mut tube = Cylinder {
            axis: Vector3::z(),
            radius: 2.0,
            half_length: f64::INFINITY,
            side: Side::Inside,
        };
        let inside = tube.foot(&Vector3::new(0.0, 1.5, 1e6));
        assert_eq!((inside.distance, inside.normal), (0.5, -Vector3::y()));
        let through = tube.foot(&Vector3::new(0.0, 2.5, 3.0));
        assert_eq!((through.distance, through.normal), (-0.5, -Vector3::y()));
        tube.side = Side::Both;
        let outside = tube.foot(&Vector3::new(-2.5, 0.0, 3.0));
        assert_eq!((outside.distance, outside.normal), (0.5, -Vector3::x()));
        tube.half_length = 1.0;
        let rim = tube.foot(&Vector3::new(5.0, 0.0, 5.0));
        assert!((rim.distance - 5.0).abs() < 1e-15);
        assert!((rim.normal - Vector3::new(0.6, 0.0, 0.8)).norm() < 1e-15);
    }
}
