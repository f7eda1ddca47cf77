//! One contact where a sphere touches a gently bent surface in several points.
//!
//! Each touch k, with unit normal n_k and overlap δ_k, asks for a way out of at least δ_k along n_k. The
//! shortest displacement that satisfies all of them,
//!
//! ```text
//! u = argmin |u|   with   n_k · u ≥ δ_k  for all k,
//! ```
//! is the contact: overlap |u| along u/|u|. A touch that another one takes care of changes nothing, so faces
//! in one plane count once; u is continuous in all n_k and δ_k; and since d|u| = −(u/|u|) · dc for a move dc
//! of the centre over flat faces, an elastic law keeps energy, whatever its force is as a function of |u|.
//! At most three touches decide, so they are looked for one, two and three at a time.

use super::super::shape::Foot;
use nalgebra::{Matrix2, Matrix3, Vector2, Vector3};

/// Violations below this times the radius are round-off.
const ROUND_OFF: f64 = 1e-13;

/// The shortest way out of touches, the nearest first, as a foot.
pub(super) fn way_out(touches: &[Foot], radius: f64) -> Foot {
    let nearest = touches[0];
    let deepest = radius - nearest.distance;
    let slack = ROUND_OFF * radius;
    let suffices = |u: &Vector3<f64>| {
        touches
            .iter()
            .all(|t| t.normal.dot(u) >= radius - t.distance - slack)
    };
    if touches.len() == 1 || deepest <= 0.0 || suffices(&(nearest.normal * deepest)) {
        return nearest;
    }
    let pairs = (0..touches.len()).flat_map(|j| (0..j).map(move |i| [i, j]));
    let found = pairs
        .clone()
        .filter_map(|[i, j]| two(&touches[i], &touches[j], radius))
        .find(suffices)
        .or_else(|| {
            pairs
                .flat_map(|[i, j]| (0..i).map(move |h| [h, i, j]))
                .filter_map(|[h, i, j]| three([&touches[h], &touches[i], &touches[j]], radius))
                .find(suffices)
        });
    let Some(u) = found else {
        // Round-off at a place where several touches decide equally.
        return nearest;
    };
    let length = u.norm();
    Foot {
        distance: radius - length,
        normal: u / length,
    }
}

/// The displacement that just satisfies two touches, if both push.
fn two(a: &Foot, b: &Foot, radius: f64) -> Option<Vector3<f64>> {
    let c = a.normal.dot(&b.normal);
    let wanted = Vector2::new(radius - a.distance, radius - b.distance);
    let share = Matrix2::new(1.0, c, c, 1.0).try_inverse()? * wanted;
    (share.min() >= 0.0).then(|| a.normal * share.x + b.normal * share.y)
}

/// The displacement that just satisfies three touches, if all push.
fn three(touches: [&Foot; 3], radius: f64) -> Option<Vector3<f64>> {
    let normals = Matrix3::from_columns(&touches.map(|t| t.normal));
    let wanted = Vector3::from_fn(|k, _| radius - touches[k].distance);
    let share = (normals.transpose() * normals).try_inverse()? * wanted;
    (share.min() >= 0.0).then(|| normals * share)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Touch of a unit sphere by a plane at an angle (rad) about y, overlapping by `depth`.
    fn touch(angle: f64, depth: f64) -> Foot {
        Foot {
            distance: 1.0 - depth,
            normal: Vector3::new(angle.sin(), 0.0, angle.cos()),
        }
    }

    #[test]
    fn planes_that_are_taken_care_of_change_nothing() {
        let (a, b) = (touch(0.0, 0.1), touch(0.2, 0.05));
        assert_eq!(way_out(&[a, a], 1.0), a);
        assert_eq!(way_out(&[a, b], 1.0), a);
    }

    #[test]
    fn a_valley_pushes_along_its_middle() {
        let (a, b) = (touch(0.2, 0.1), touch(-0.2, 0.1));
        let out = way_out(&[a, b], 1.0);
        assert!((1.0 - out.distance - 0.1 / 0.2_f64.cos()).abs() < 1e-14);
        assert!((out.normal - Vector3::z()).norm() < 1e-14);
    }

    #[test]
    fn a_pit_of_three_faces_asks_for_all_three() {
        let face = |turn: f64| {
            let tilt: f64 = 0.3;
            let normal = Vector3::new(turn.cos() * tilt.sin(), turn.sin() * tilt.sin(), tilt.cos());
            Foot {
                distance: 0.9,
                normal,
            }
        };
        let third = std::f64::consts::TAU / 3.0;
        let out = way_out(&[face(0.0), face(third), face(2.0 * third)], 1.0);
        assert!((1.0 - out.distance - 0.1 / 0.3_f64.cos()).abs() < 1e-14);
        assert!((out.normal - Vector3::z()).norm() < 1e-14);
    }

    #[test]
    fn the_way_out_is_continuous_and_its_length_a_potential() {
        // Along a path over a valley of two planes through the origin, |u| falls by (u/|u|) · dc.
        let tilt: f64 = 0.25;
        let out = |x: f64, z: f64| {
            let foot = |angle: f64| {
                let normal = Vector3::new(angle.sin(), 0.0, angle.cos());
                Foot {
                    distance: normal.dot(&Vector3::new(x, 0.0, z)),
                    normal,
                }
            };
            let mut touches = [foot(tilt), foot(-tilt)];
            touches.sort_by(|a, b| a.distance.total_cmp(&b.distance));
            let out = way_out(&touches, 1.0);
            (1.0 - out.distance, out.normal)
        };
        let step = 1e-6;
        for k in -300..300 {
            let x = f64::from(k) * 1e-3;
            let (depth, normal) = out(x, 0.95);
            let (next, _) = out(x + step, 0.95);
            assert!((depth - next - normal.x * step).abs() < 1e-10, "{x}");
        }
    }
}
