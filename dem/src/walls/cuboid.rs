//! A solid cuboid, centred on the shape's origin with its edges along the axes.

use super::shape::Foot;
use nalgebra::Vector3;

/// A cuboid: all points with |x_k| ≤ h_k; grains live outside.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cuboid {
    /// Half the lengths of its edges, h (m).
    pub half_sides: Vector3<f64>,
}

impl Cuboid {
    /// Foot of a centre: from a face along its normal, from an edge or a corner by the nearest point;
    /// within, out of the nearest face.
    #[inline(always)]
    pub fn foot(&self, centre: &Vector3<f64>) -> Foot {
        let h = &self.half_sides;
        let apart = centre - centre.sup(&-h).inf(h);
        let distance = apart.norm();
        if distance > 0.0 {
            return Foot {
                distance,
                normal: apart / distance,
            };
        }
        let gaps = h - centre.abs();
        let face = gaps.imin();
        let mut normal = Vector3::zeros();
        normal[face] = 1.0_f64.copysign(centre[face]);
        Foot {
            distance: -gaps[face],
            normal,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn faces_edges_corners_and_the_inside() {
        let cuboid = Cuboid {
            half_sides: Vector3::new(1.0, 2.0, 3.0),
        };
        let foot = |x: f64, y: f64, z: f64| cuboid.foot(&Vector3::new(x, y, z));
        let face = foot(-1.7, 1.9, -2.9);
        assert_eq!((face.distance, face.normal), (0.7, -Vector3::x()));
        let edge = foot(4.0, 6.0, 1.0);
        assert_eq!(edge.distance, 5.0);
        assert!((edge.normal - Vector3::new(0.6, 0.8, 0.0)).norm() < 1e-15);
        let corner = foot(2.0, -4.0, 5.0);
        assert_eq!(corner.distance, 3.0);
        assert!((corner.normal - Vector3::new(1.0, -2.0, 2.0) / 3.0).norm() < 1e-15);
        let inside = foot(0.0, -1.75, 0.5);
        assert_eq!((inside.distance, inside.normal), (-0.25, -Vector3::y()));
    }
}
