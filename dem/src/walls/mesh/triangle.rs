//! The point of a triangle that is nearest to a centre.
//!
//! Barycentric regions of the triangle's corners, edges and face, told apart by signs of scalar products
//! (Ericson, *Real-Time Collision Detection*, 2005, §5.1.5).

use super::super::shape::Foot;
use nalgebra::Vector3;

/// A triangle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Triangle {
    /// Corners (m).
    pub corners: [Vector3<f64>; 3],
    /// Unit normal, right-handed to the order of the corners.
    pub normal: Vector3<f64>,
}

impl Triangle {
    pub(super) fn new(corners: [Vector3<f64>; 3]) -> Triangle {
        let [a, b, c] = &corners;
        Triangle {
            normal: (b - a).cross(&(c - a)).normalize(),
            corners,
        }
    }

    /// Height of a centre over the triangle's plane (m).
    #[inline(always)]
    pub(super) fn height(&self, centre: &Vector3<f64>) -> f64 {
        (centre - self.corners[0]).dot(&self.normal)
    }

    /// Foot of a centre; grains may lie on both sides. Over the face the normal is the face's, exactly.
    pub fn foot(&self, centre: &Vector3<f64>) -> Foot {
        let height = self.height(centre);
        let front = 1.0_f64.copysign(height);
        let on_face = Foot {
            distance: height * front,
            normal: self.normal * front,
        };
        let Some(point) = self.rim(centre) else {
            return on_face;
        };
        let apart = centre - point;
        let distance = apart.norm();
        if distance > 0.0 {
            Foot {
                distance,
                normal: apart / distance,
            }
        } else {
            on_face
        }
    }

    /// The nearest point if it is on an edge or a corner.
    fn rim(&self, centre: &Vector3<f64>) -> Option<Vector3<f64>> {
        let [a, b, c] = &self.corners;
        let (ab, ac) = (b - a, c - a);
        let from_a = centre - a;
        let (d1, d2) = (ab.dot(&from_a), ac.dot(&from_a));
        if d1 <= 0.0 && d2 <= 0.0 {
            return Some(*a);
        }
        let from_b = centre - b;
        let (d3, d4) = (ab.dot(&from_b), ac.dot(&from_b));
        if d3 >= 0.0 && d4 <= d3 {
            return Some(*b);
        }
        if d1 * d4 - d3 * d2 <= 0.0 && d1 >= 0.0 && d3 <= 0.0 {
            return Some(a + ab * (d1 / (d1 - d3)));
        }
        let from_c = centre - c;
        let (d5, d6) = (ab.dot(&from_c), ac.dot(&from_c));
        if d6 >= 0.0 && d5 <= d6 {
            return Some(*c);
        }
        if d5 * d2 - d1 * d6 <= 0.0 && d2 >= 0.0 && d6 <= 0.0 {
            return Some(a + ac * (d2 / (d2 - d6)));
        }
        let (past_b, past_c) = (d4 - d3, d5 - d6);
        if d3 * d6 - d5 * d4 <= 0.0 && past_b >= 0.0 && past_c >= 0.0 {
            return Some(b + (c - b) * (past_b / (past_b + past_c)));
        }
        None
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn triangle() -> Triangle {
        Triangle::new([Vector3::zeros(), Vector3::x() * 4.0, Vector3::y() * 4.0])
    }

    #[test]
    fn regions_of_corners_edges_and_face() {
        let t = triangle();
        for (centre, point) in [
            ([1.0, 1.0, 0.5], [1.0, 1.0, 0.0]),
            ([1.0, 1.0, -0.5], [1.0, 1.0, 0.0]),
            ([-3.0, -4.0, 0.0], [0.0, 0.0, 0.0]),
            ([2.0, -1.0, 1.0], [2.0, 0.0, 0.0]),
            ([-1.0, 3.0, 2.0], [0.0, 3.0, 0.0]),
            ([3.0, 3.0, 1.0], [2.0, 2.0, 0.0]),
            ([7.0, -1.0, 0.0], [4.0, 0.0, 0.0]),
            ([-1.0, 9.0, 0.0], [0.0, 4.0, 0.0]),
        ] {
            let (centre, point) = (Vector3::from(centre), Vector3::from(point));
            let foot = t.foot(&centre);
            let found = centre - foot.normal * foot.distance;
            assert!((found - point).norm() < 1e-15, "{centre:?}: {found:?}");
        }
    }

    #[test]
    fn no_point_of_the_triangle_is_nearer() {
        let t = Triangle::new([
            Vector3::new(0.3, -0.2, 0.1),
            Vector3::new(1.1, 0.4, -0.3),
            Vector3::new(0.2, 0.9, 0.6),
        ]);
        let [a, b, c] = t.corners;
        for k in 0..400 {
            let k = f64::from(k);
            let centre = Vector3::new((k * 0.7).sin(), (k * 1.3).cos(), (k * 2.1).sin()) * 1.5;
            let foot = t.foot(&centre);
            let mut best = f64::INFINITY;
            for i in 0..=60 {
                for j in 0..=60 - i {
                    let (s, t) = (f64::from(i) / 60.0, f64::from(j) / 60.0);
                    best = best.min((a + (b - a) * s + (c - a) * t - centre).norm());
                }
            }
            assert!(foot.distance <= best + 1e-12, "{} {best}", foot.distance);
            assert!(foot.distance > best - 0.02, "{} {best}", foot.distance);
        }
    }
}
