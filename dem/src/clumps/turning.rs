//! Turning of a free clump: the discrete top of Moser and Veselov.
//!
//! ```text
//! q(n+1) = q(n) (1, e)/√(1 + e²)
//! dt/2 m = (I e + e × I e)/(1 + e²)       m = q(n)⁻¹ L, in principal axes
//! ω = 2 q e/(dt (1 + e²))                 the mean of the angular velocities before and after
//! ```
//! L keeps its bits, and since (I e + e × I e) · I⁻¹ (e × I e) changes sign with e alone, the energy m · I⁻¹ m/2
//! is kept exactly, whatever the step; the course is of second order (Moser & Veselov 1991, doi 10.1007/BF02352494;
//! Hairer & Vilmart 2006, doi 10.1088/0305-4470/39/42/005). A ball turns by asin(ω dt) a step. The equation is
//! solved by iteration, which gains a factor of some |e| a time: three or four at the speeds of contacts.

use nalgebra::{Quaternion, UnitQuaternion, Vector3};

/// Largest e of a piece; longer turns are cut.
const PIECE: f64 = 0.05;

/// Iterations at most: far more than a piece needs.
const ITERATIONS: u32 = 40;

/// Turns for a time (s) by an angular momentum in directions of space (kg m²/s); the orientation after it, and the
/// mean angular velocity (rad/s).
#[inline]
pub(super) fn turn(
    orientation: &UnitQuaternion<f64>,
    momentum: &Vector3<f64>,
    moments: &Vector3<f64>,
    time: f64,
) -> (UnitQuaternion<f64>, Vector3<f64>) {
    let bound = 0.5 * time * momentum.norm() / moments.min();
    if bound == 0.0 {
        return (*orientation, Vector3::zeros());
    }
    // Not a number makes one piece, and stays.
    let pieces = (bound / PIECE).ceil().clamp(1.0, 1e6);
    let piece = time / pieces;
    let (mut now, mut spin) = (*orientation, Vector3::zeros());
    for _ in 0..pieces as u32 {
        let half = now.inverse_transform_vector(momentum) * (0.5 * piece);
        let e = cayley(&half, moments);
        let square = 1.0 + e.norm_squared();
        spin += now * e * (2.0 / (time * square));
        let step = Quaternion::from_parts(1.0, e);
        now = UnitQuaternion::new_normalize(now.quaternion() * step);
    }
    (now, spin)
}

/// Solves (1 + e²) h = I e + e × I e.
#[inline]
fn cayley(half: &Vector3<f64>, moments: &Vector3<f64>) -> Vector3<f64> {
    let mut e = half.component_div(moments);
    for _ in 0..ITERATIONS {
        let angular = e.component_mul(moments);
        let next = half * (1.0 + e.norm_squared()) - e.cross(&angular);
        let next = next.component_div(moments);
        let change = (next - e).abs().max();
        e = next;
        if change <= 1e-17 + 1e-16 * e.abs().max() {
            break;
        }
    }
    e
}

#[cfg(test)]
mod tests {
    use super::*;

    const MOMENTS: [f64; 3] = [1.0, 2.0, 3.5];

    /// Start with spins along the principal axes, which are those of space at first.
    fn momentum(spins: [f64; 3]) -> Vector3<f64> {
        Vector3::from(spins).component_mul(&Vector3::from(MOMENTS))
    }

    fn energy(q: &UnitQuaternion<f64>, l: &Vector3<f64>) -> f64 {
        let m = q.inverse_transform_vector(l);
        0.5 * m.dot(&m.component_div(&Vector3::from(MOMENTS)))
    }

    #[test]
    fn energy_stays_at_any_step() {
        for (spins, step) in [
            ([0.3, 1.0, 0.4], 0.01),
            ([0.3, 1.0, 0.4], 0.7),
            ([1e-5, 3.0, 0.0], 0.01),
        ] {
            let l = momentum(spins);
            let mut q = UnitQuaternion::identity();
            let before = energy(&q, &l);
            for _ in 0..100_000 {
                q = turn(&q, &l, &MOMENTS.into(), step).0;
            }
            let error = (energy(&q, &l) / before - 1.0).abs();
            assert!(error < 2e-13, "{spins:?} {step}: {error:e}");
        }
    }

    #[test]
    fn the_course_is_that_of_the_top_of_sixth_order_to_second_order() {
        let l = momentum([0.3, 1.0, 0.4]);
        let inverse = Vector3::from(MOMENTS).map(f64::recip);
        let exact = (0..1000).fold(UnitQuaternion::identity(), |q, _| {
            crate::bodies::turn(&q, &l, &inverse, 0.002)
        });
        let off = |steps: u32| {
            let mut q = UnitQuaternion::identity();
            for _ in 0..steps {
                q = turn(&q, &l, &MOMENTS.into(), 2.0 / f64::from(steps)).0;
            }
            q.angle_to(&exact)
        };
        let [coarse, fine] = [100, 200].map(off);
        let order = (coarse / fine).log2();
        assert!((order - 2.0).abs() < 0.05, "{coarse:e} {fine:e}: {order}");
    }

    #[test]
    fn a_ball_has_the_spin_of_its_momentum() {
        let (l, moments) = (Vector3::new(0.3, -0.2, 0.7), Vector3::repeat(0.4));
        let (q, spin) = turn(&UnitQuaternion::identity(), &l, &moments, 0.01);
        assert!((spin - l / 0.4).norm() < 1e-15);
        let angle = (l.norm() / 0.4 * 0.01).asin();
        assert!((q.angle() - angle).abs() < 1e-15);
    }
}
