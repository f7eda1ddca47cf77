//! Turning of a free rigid body: the Euler top.
//!
//! ```text
//! dL/dt = 0          L = R I ω       angular momentum, in directions of space
//! dR/dt = R [ω_b]×   ω_b = I⁻¹ Rᵀ L  angular velocity in the body's principal axes, I = diag(I_1, I_2, I_3)
//! H = Σ m_k²/(2 I_k),  m = Rᵀ L
//! ```
//! Each H_k alone turns the body about its k-th axis by the angle t m_k/I_k, exactly. The symmetric product
//! of these turns (Dullweber, Leimkuhler & McLachlan 1997, doi 10.1063/1.474310) is symplectic and
//! reversible; nine of them with the weights of Kahan & Li (1997, doi 10.1090/S0025-5718-97-00873-9) make a
//! map of sixth order. Steps are cut so that a piece turns by [`PIECE`] at most, and the orientation is
//! the only thing that changes: L keeps its bits.

use nalgebra::{Quaternion, UnitQuaternion, Vector3};

/// Weights of the symmetric product.
const WEIGHTS: [f64; 9] = [
    0.392_161_444_007_314_139_279_250_56,
    0.332_599_136_789_359_438_599_748_64,
    -0.706_246_172_557_639_359_809_964_82,
    0.082_213_596_293_550_800_231_490_45,
    0.798_543_990_934_829_963_398_950_35,
    0.082_213_596_293_550_800_231_490_45,
    -0.706_246_172_557_639_359_809_964_82,
    0.332_599_136_789_359_438_599_748_64,
    0.392_161_444_007_314_139_279_250_56,
];

/// Largest angle of a piece (rad), by a bound that is the same for the whole flight.
const PIECE: f64 = 0.05;

/// Orientation (principal axes to space) and the angular momentum in principal axes, on their way.
struct Turning {
    /// w, x, y, z.
    q: [f64; 4],
    m: [f64; 3],
}

impl Turning {
    /// Turns about principal axis `K` for a time over its moment of inertia.
    #[inline(always)]
    fn about<const K: usize>(&mut self, time_over_inertia: f64) {
        let (i, j) = ((K + 1) % 3, (K + 2) % 3);
        let half = 0.5 * time_over_inertia * self.m[K];
        let (s, c) = half.sin_cos();
        // q ← q (cos, e_K sin): components along 1 and e_K mix, and so do the other two.
        let [w, k, a, b] = [self.q[0], self.q[1 + K], self.q[1 + i], self.q[1 + j]];
        self.q[0] = w * c - k * s;
        self.q[1 + K] = k * c + w * s;
        self.q[1 + i] = a * c + b * s;
        self.q[1 + j] = b * c - a * s;
        // m turns the other way by the whole angle.
        let (sin, cos) = (2.0 * s * c, 1.0 - 2.0 * s * s);
        let (a, b) = (self.m[i], self.m[j]);
        self.m[i] = a * cos + b * sin;
        self.m[j] = b * cos - a * sin;
    }

    /// The product of second order.
    #[inline(always)]
    fn product(&mut self, time: f64, inverse: &Vector3<f64>) {
        let half = 0.5 * time;
        self.about::<0>(half * inverse[0]);
        self.about::<1>(half * inverse[1]);
        self.about::<2>(time * inverse[2]);
        self.about::<1>(half * inverse[1]);
        self.about::<0>(half * inverse[0]);
    }
}

/// Turns a free body for a time (s): orientation of its principal axes, angular momentum in directions of
/// space (kg m²/s), inverse principal moments of inertia (1/(kg m²)).
pub(crate) fn turn(
    orientation: &UnitQuaternion<f64>,
    momentum: &Vector3<f64>,
    inverse: &Vector3<f64>,
    time: f64,
) -> UnitQuaternion<f64> {
    let bound = momentum.norm() * inverse.max() * time;
    if bound == 0.0 {
        return *orientation;
    }
    let m = orientation.inverse_transform_vector(momentum);
    let q = orientation.quaternion();
    let mut turning = Turning {
        q: [q.w, q.i, q.j, q.k],
        m: m.into(),
    };
    // Not a number makes one piece, and stays.
    let pieces = (bound / PIECE).ceil().clamp(1.0, 1e6);
    for _ in 0..pieces as u32 {
        for weight in WEIGHTS {
            turning.product(weight * time / pieces, inverse);
        }
    }
    let [w, i, j, k] = turning.q;
    UnitQuaternion::new_normalize(Quaternion::new(w, i, j, k))
}

/// Angular velocity in directions of space (rad/s).
pub(crate) fn spin(
    orientation: &UnitQuaternion<f64>,
    momentum: &Vector3<f64>,
    inverse: &Vector3<f64>,
) -> Vector3<f64> {
    let m = orientation.inverse_transform_vector(momentum);
    orientation * m.component_mul(inverse)
}

#[cfg(test)]
mod tests {
    use super::*;

    const MOMENTS: [f64; 3] = [1.0, 2.0, 3.5];

    fn inverse() -> Vector3<f64> {
        Vector3::from(MOMENTS).map(f64::recip)
    }

    fn energy(q: &UnitQuaternion<f64>, momentum: &Vector3<f64>) -> f64 {
        0.5 * momentum.dot(&spin(q, momentum, &inverse()))
    }

    /// Start with spins along the principal axes, which are those of space at first.
    fn momentum(spins: [f64; 3]) -> Vector3<f64> {
        Vector3::from(spins).component_mul(&Vector3::from(MOMENTS))
    }

    /// Euler's equations in principal axes by Runge–Kutta, for comparison.
    fn euler(mut w: Vector3<f64>, time: f64, steps: u32) -> Vector3<f64> {
        let [a, b, c] = MOMENTS;
        let rate = |w: &Vector3<f64>| {
            Vector3::new(
                (b - c) / a * w.y * w.z,
                (c - a) / b * w.z * w.x,
                (a - b) / c * w.x * w.y,
            )
        };
        let h = time / f64::from(steps);
        for _ in 0..steps {
            let k1 = rate(&w);
            let k2 = rate(&(w + 0.5 * h * k1));
            let k3 = rate(&(w + 0.5 * h * k2));
            let k4 = rate(&(w + h * k3));
            w += h / 6.0 * (k1 + 2.0 * k2 + 2.0 * k3 + k4);
        }
        w
    }

    #[test]
    fn it_turns_as_euler_s_equations_say() {
        let start = [0.3, 1.0, 0.4];
        let l = momentum(start);
        let mut q = UnitQuaternion::identity();
        for _ in 0..1000 {
            q = turn(&q, &l, &inverse(), 0.01);
        }
        let w = q.inverse_transform_vector(&spin(&q, &l, &inverse()));
        let exact = euler(Vector3::from(start), 10.0, 200_000);
        assert!((w - exact).norm() < 1e-12, "{:e}", (w - exact).norm());
    }

    #[test]
    fn a_piece_is_of_sixth_order() {
        let l = momentum([0.3, 1.0, 0.4]);
        let start = UnitQuaternion::from_euler_angles(0.3, -0.2, 0.9);
        let run = |pieces: u32| {
            let m = start.inverse_transform_vector(&l);
            let q = start.quaternion();
            let mut turning = Turning {
                q: [q.w, q.i, q.j, q.k],
                m: m.into(),
            };
            for _ in 0..pieces {
                for weight in WEIGHTS {
                    turning.product(weight * 4.0 / f64::from(pieces), &inverse());
                }
            }
            let [w, i, j, k] = turning.q;
            UnitQuaternion::new_normalize(Quaternion::new(w, i, j, k))
        };
        let exact = run(320);
        let [coarse, fine] = [8, 16].map(|n| run(n).angle_to(&exact));
        let order = (coarse / fine).log2();
        assert!((order - 6.0).abs() < 0.4, "{coarse:e} {fine:e}: {order}");
    }

    #[test]
    fn a_symmetric_top_precesses_as_its_closed_form() {
        // I_1 = I_2: the axis circles L at L/I_1, and the body turns about it at m_3 (1/I_3 - 1/I_1).
        let inverse = Vector3::new(0.5, 0.5, 1.0 / 3.0);
        let l = Vector3::new(0.7, 0.0, 1.1);
        let time = 12.0;
        let q = turn(&UnitQuaternion::identity(), &l, &inverse, time);
        let circling = UnitQuaternion::from_scaled_axis(l * (0.5 * time));
        let own = l.z * (inverse.z - inverse.x) * time;
        let exact = circling * UnitQuaternion::from_scaled_axis(Vector3::z() * own);
        assert!(q.angle_to(&exact) < 1e-11, "{:e}", q.angle_to(&exact));
    }

    #[test]
    fn energy_stays_about_the_middle_axis_too() {
        for spins in [[0.3, 1.0, 0.4], [1e-6, 1.0, 1e-6], [1.0, 1e-3, 0.0]] {
            let l = momentum(spins);
            let mut q = UnitQuaternion::identity();
            let before = energy(&q, &l);
            let mut flipped = 0;
            let mut side = 1.0;
            for _ in 0..20_000 {
                q = turn(&q, &l, &inverse(), 0.01);
                let along = q.inverse_transform_vector(&l).y;
                if along * side < 0.0 {
                    side = -side;
                    flipped += 1;
                }
            }
            let error = (energy(&q, &l) / before - 1.0).abs();
            assert!(error < 1e-13, "{spins:?}: {error:e}");
            assert!(flipped > 3 || spins[1] < 0.1, "{flipped}");
        }
    }
}
