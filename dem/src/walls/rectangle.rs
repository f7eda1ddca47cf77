//! A rectangular plate without thickness, centred on the shape's origin; grains may lie on both faces.

use super::shape::Foot;
use nalgebra::Vector3;

/// A rectangle: all points s u + t v with |s|, |t| ≤ 1.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Rectangle {
    /// u and v: from the centre to the middles of two sides, at right angles (m).
    pub half_sides: [Vector3<f64>; 2],
}

impl Rectangle {
    /// Unit normal u × v / |u × v|.
    pub fn normal(&self) -> Vector3<f64> {
        let [u, v] = &self.half_sides;
        u.cross(v).normalize()
    }

    /// Foot of a centre: on a face along the normal, on a side or corner from its nearest point.
    pub fn foot(&self, centre: &Vector3<f64>) -> Foot {
        let [s, t] = self.half_sides.map(|h| centre.dot(&h) / h.norm_squared());
        let [u, v] = &self.half_sides;
        let apart = centre - (u * s.clamp(-1.0, 1.0) + v * t.clamp(-1.0, 1.0));
        let distance = apart.norm();
        if (s.abs() > 1.0 || t.abs() > 1.0) && distance > 0.0 {
            return Foot {
                distance,
                normal: apart / distance,
            };
        }
        let normal = self.normal();
        let height = centre.dot(&normal);
        let front = 1.0_f64.copysign(height);
        Foot {
            distance: height * front,
            normal: normal * front,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn faces_sides_and_corners_are_exact() {
        let plate = Rectangle {
            half_sides: [Vector3::x() * 2.0, Vector3::y()],
        };
        let foot = plate.foot(&Vector3::new(1.9, -0.9, -0.3));
        assert_eq!((foot.distance, foot.normal), (0.3, -Vector3::z()));
        let side = plate.foot(&Vector3::new(0.5, 4.0, 4.0));
        assert_eq!(
            (side.distance, side.normal),
            (5.0, Vector3::new(0.0, 0.6, 0.8))
        );
        let corner = plate.foot(&Vector3::new(4.0, 2.0, 2.0));
        assert_eq!(corner.distance, 3.0);
        let exact = Vector3::new(2.0, 1.0, 2.0) / 3.0;
        assert!((corner.normal - exact).norm() < 1e-15);
    }
}
