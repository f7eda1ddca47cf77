//! A spherical shell about the shape's origin.

use super::shape::{Foot, Side};
use nalgebra::Vector3;

/// A sphere, hollow or solid.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SphereShell {
    /// Radius (m).
    pub radius: f64,
    /// Where grains live.
    pub side: Side,
}

impl SphereShell {
    /// Foot of a centre, along the radius; from the middle itself, along z.
    pub fn foot(&self, centre: &Vector3<f64>) -> Foot {
        let r = centre.norm();
        let outward = if r > 0.0 { centre / r } else { Vector3::z() };
        let height = r - self.radius;
        let front = match self.side {
            Side::Outside => 1.0,
            Side::Inside => -1.0,
            Side::Both => 1.0_f64.copysign(height),
        };
        Foot {
            distance: height * front,
            normal: outward * front,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_foot_lies_on_the_ray_from_the_middle() {
        let shell = |side| SphereShell { radius: 5.0, side };
        let inside = shell(Side::Inside).foot(&Vector3::new(0.0, 3.0, 0.0));
        assert_eq!((inside.distance, inside.normal), (2.0, -Vector3::y()));
        let outside = shell(Side::Outside).foot(&Vector3::new(0.0, 6.0, 8.0));
        assert_eq!(
            (outside.distance, outside.normal),
            (5.0, Vector3::new(0.0, 0.6, 0.8))
        );
        let middle = shell(Side::Inside).foot(&Vector3::zeros());
        assert_eq!(middle.distance, 5.0);
        assert!(middle.normal.iter().all(|c| c.is_finite()));
    }
}
