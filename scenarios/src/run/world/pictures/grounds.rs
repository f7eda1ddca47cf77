//! Walls that are seen from their side, as ground in a picture.

use colluvium_dem::walls::Mesh;
use colluvium_dem::{Pose, Shape};
use nalgebra::Vector3;

/// Normals this close to the picture's plane are seen from the side.
const EDGE_ON: f64 = 1e-9;

/// Ground in a picture; lengths in m.
#[derive(Clone, Debug, PartialEq)]
pub enum Ground {
    /// What a plane bounds: a point of it and its normal.
    Behind([[f64; 2]; 2]),
    /// What lies below a line, pieces from left to right.
    Below(Vec<[[f64; 2]; 2]>),
}

impl Ground {
    /// What a wall is in a picture with these axes to the right and up, seen along `view`; none where it is not seen from the
    /// side, or where it does not reach from one end of the picture to the other (m), as a hopper's sides do not.
    pub fn of(
        shape: &Shape,
        pose: &Pose,
        [right, up, view]: [Vector3<f64>; 3],
        ends: [f64; 2],
    ) -> Option<Ground> {
        let flat = |v: &Vector3<f64>| [v.dot(&right), v.dot(&up)];
        let edge_on = |normal: &Vector3<f64>| normal.dot(&view).abs() < EDGE_ON;
        match shape {
            Shape::Plane(plane) => {
                let normal = pose.outward(&plane.normal);
                edge_on(&normal).then(|| Ground::Behind([flat(&pose.position), flat(&normal)]))
            }
            Shape::Mesh(mesh) => {
                let seen = |v: &Vector3<f64>| pose.position + pose.outward(v);
                below(
                    mesh,
                    |v| flat(&seen(v)),
                    |n| edge_on(&pose.outward(n)),
                    ends,
                )
            }
            _ => None,
        }
    }

    /// Whether a place lies in it.
    pub fn holds(&self, x: [f64; 2]) -> bool {
        match self {
            Ground::Behind([p, n]) => (x[0] - p[0]) * n[0] + (x[1] - p[1]) * n[1] < 0.0,
            Ground::Below(pieces) => pieces.iter().any(|[a, b]| {
                let along = (x[0] - a[0]) / (b[0] - a[0]);
                (0.0..=1.0).contains(&along) && x[1] < a[1] + along * (b[1] - a[1])
            }),
        }
    }
}

/// The pieces of a mesh all of whose triangles are seen from the side, if they join from end to end.
fn below(
    mesh: &Mesh,
    flat: impl Fn(&Vector3<f64>) -> [f64; 2],
    edge_on: impl Fn(&Vector3<f64>) -> bool,
    [low, high]: [f64; 2],
) -> Option<Ground> {
    let mut pieces = Vec::new();
    for triangle in mesh.triangles() {
        let [a, b, c] = &triangle.corners;
        if !edge_on(&(b - a).cross(&(c - a)).normalize()) {
            return None;
        }
        let mut ends = [flat(a), flat(b), flat(c)];
        ends.sort_by(|p, q| p[0].total_cmp(&q[0]));
        if ends[2][0] > ends[0][0] {
            pieces.push([ends[0], ends[2]]);
        }
    }
    pieces.sort_by(|p, q| p[0][0].total_cmp(&q[0][0]));
    let mut reached = pieces.first().map_or(f64::INFINITY, |piece| piece[0][0]);
    let slack = EDGE_ON * (high - low);
    if reached > low {
        return None;
    }
    for [from, to] in &pieces {
        if from[0] > reached + slack {
            break;
        }
        reached = reached.max(to[0]);
    }
    (reached >= high).then_some(Ground::Below(pieces))
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::Arc;

    const AXES: [[f64; 3]; 3] = [[1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, 1.0, 0.0]];

    fn strips(lines: &[&[[f64; 2]]]) -> Shape {
        let (mut vertices, mut triangles) = (Vec::new(), Vec::new());
        for line in lines {
            for pair in line.windows(2) {
                let first = vertices.len() as u32;
                for [x, z] in pair {
                    vertices.extend([0.0, 5.0].map(|y| Vector3::new(*x, y, *z)));
                }
                triangles.extend([
                    [first, first + 2, first + 1],
                    [first + 1, first + 2, first + 3],
                ]);
            }
        }
        Shape::Mesh(Arc::new(Mesh::new(vertices, &triangles).unwrap()))
    }

    #[test]
    fn land_is_ground_and_a_hopper_is_not() {
        let axes = AXES.map(Vector3::from);
        let pose = Pose::at(Vector3::zeros());
        let land = strips(&[&[[-9.0, 2.0], [0.0, 2.0], [0.0, 0.0], [9.0, -3.0]]]);
        let ground = Ground::of(&land, &pose, axes, [-8.0, 8.0]).unwrap();
        for (x, z, holds) in [
            (-5.0, 1.9, true),
            (-5.0, 2.1, false),
            (3.0, -1.1, true),
            (3.0, -0.9, false),
        ] {
            assert_eq!(ground.holds([x, z]), holds, "{x} {z}");
        }
        assert_eq!(Ground::of(&land, &pose, axes, [-8.0, 10.0]), None);
        let hopper = strips(&[&[[-9.0, 5.0], [-1.0, 0.0]], &[[1.0, 0.0], [9.0, 5.0]]]);
        assert_eq!(Ground::of(&hopper, &pose, axes, [-8.0, 8.0]), None);
        // From above it is no ground.
        let above = [axes[0], axes[2], axes[1]];
        assert_eq!(Ground::of(&land, &pose, above, [-8.0, 8.0]), None);
    }
}
