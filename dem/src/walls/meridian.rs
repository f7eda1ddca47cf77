//! Surfaces of revolution: the nearest point is found in the half plane (ρ, z) through the axis.
//!
//! The turned curve is a chain of straight segments with ρ ≥ 0. Since the half plane through a centre
//! holds the point of the surface that is nearest to it, the problem has two dimensions.

use super::shape::{Foot, Side};
use nalgebra::{Vector2, Vector3};

/// A centre seen from an axis through the origin.
struct Seen {
    /// Unit vector away from the axis.
    outward: Vector3<f64>,
    /// (ρ, z) (m).
    at: Vector2<f64>,
}

fn seen(centre: &Vector3<f64>, axis: &Vector3<f64>) -> Seen {
    let z = centre.dot(axis);
    let across = centre - axis * z;
    let rho = across.norm();
    let outward = if rho > 0.0 {
        across / rho
    } else {
        // On the axis all directions are as near as any.
        any_normal_to(axis)
    };
    Seen {
        outward,
        at: Vector2::new(rho, z),
    }
}

/// A unit vector at right angles to a unit vector.
pub(crate) fn any_normal_to(axis: &Vector3<f64>) -> Vector3<f64> {
    let least = axis.iamin();
    let mut other = Vector3::zeros();
    other[least] = 1.0;
    axis.cross(&other).normalize()
}

/// Nearest point of a segment, and whether it is one of its ends.
fn nearest(at: &Vector2<f64>, [a, b]: [Vector2<f64>; 2]) -> (Vector2<f64>, bool) {
    let along = b - a;
    let share = (at - a).dot(&along) / along.norm_squared();
    if share <= 0.0 {
        (a, true)
    } else if share >= 1.0 {
        (b, true)
    } else {
        (a + along * share, false)
    }
}

/// To the right of a segment, seen along it: away from the axis where it climbs.
fn right_of([a, b]: [Vector2<f64>; 2]) -> Vector2<f64> {
    let along = (b - a).normalize();
    Vector2::new(along.y, -along.x)
}

impl Seen {
    fn foot(&self, distance: f64, normal: Vector2<f64>, axis: &Vector3<f64>) -> Foot {
        Foot {
            distance,
            normal: self.outward * normal.x + axis * normal.y,
        }
    }
}

/// Foot on the surface that one segment sweeps: a plate without thickness.
pub(super) fn plate(
    centre: &Vector3<f64>,
    axis: &Vector3<f64>,
    segment: [Vector2<f64>; 2],
    side: Side,
) -> Foot {
    let seen = seen(centre, axis);
    let (point, end) = nearest(&seen.at, segment);
    let right = right_of(segment);
    let apart = seen.at - point;
    let distance = apart.norm();
    if end && distance > 0.0 {
        return seen.foot(distance, apart / distance, axis);
    }
    // Measured across the segment's line, so that the normal of a face is exact.
    let height = (seen.at - segment[0]).dot(&right);
    let front = match side {
        Side::Outside => 1.0,
        Side::Inside => -1.0,
        Side::Both => 1.0_f64.copysign(height),
    };
    seen.foot(height * front, right * front, axis)
}

/// Foot on a convex solid of revolution; the chain climbs from the axis back to the axis.
pub(super) fn solid(centre: &Vector3<f64>, axis: &Vector3<f64>, chain: &[Vector2<f64>]) -> Foot {
    let seen = seen(centre, axis);
    let mut inside = true;
    let mut best = (f64::INFINITY, Vector2::zeros());
    let mut deepest = (f64::NEG_INFINITY, Vector2::zeros());
    for pair in chain.windows(2) {
        let segment = [pair[0], pair[1]];
        let right = right_of(segment);
        let height = (seen.at - pair[0]).dot(&right);
        inside &= height < 0.0;
        if height > deepest.0 {
            deepest = (height, right);
        }
        let (point, end) = nearest(&seen.at, segment);
        let apart = seen.at - point;
        let distance = apart.norm();
        if distance < best.0 {
            let towards = if end && distance > 0.0 {
                apart / distance
            } else {
                right
            };
            best = (distance, towards);
        }
    }
    let (distance, normal) = if inside { deepest } else { best };
    seen.foot(distance, normal, axis)
}
