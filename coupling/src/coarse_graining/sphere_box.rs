//! Volume that a sphere and a box have in common, in closed form.
//!
//! With the unit ball B and the half-spaces outside the faces of the box, inclusion and exclusion gives
//!
//! V = |B| − Σ C(h) + Σ D(h, h') − Σ T(h, h', h'')
//!
//! over the six faces, twelve edges and eight corners: C, D and T are the parts of the ball beyond one, two and
//! three mutually perpendicular planes at the signed distances h from its centre. Each of them is bounded by
//! pieces of planes and a piece of the sphere, so by the divergence theorem on the field r/3
//!
//! 3 V = A − Σ h F,
//!
//! with the area A of the spherical piece and the areas F of the plane ones. A follows from Gauss and Bonnet:
//! 2π less the angles turned at the vertices and less ∫κ_g ds = h × (angle) along each arc of the circle at
//! height h. All angles are taken by atan2 of the *same* height of the vertex, z = √(1 − a² − b²): then the
//! terms cancel as they should where the piece vanishes. (That the overlap has such a closed form was shown by
//! Strobl, Formella and Pöschel, J. Comput. Phys. 311 (2016) 158; the decomposition here is the one above.)

use std::f64::consts::{FRAC_PI_2, PI};

/// Part of the unit ball beyond the plane x = a: the cap π (1 − a)² (2 + a)/3.
fn beyond_one(a: f64) -> f64 {
    if a >= 1.0 {
        0.0
    } else if a <= -1.0 {
        4.0 / 3.0 * PI
    } else {
        PI / 3.0 * (1.0 - a) * (1.0 - a) * (2.0 + a)
    }
}

/// Part of the unit ball with x > a and y > b.
fn beyond_two(a: f64, b: f64) -> f64 {
    if a < 0.0 {
        return beyond_one(b) - beyond_two(-a, b);
    }
    if b < 0.0 {
        return beyond_one(a) - beyond_two(a, -b);
    }
    let height_squared = 1.0 - a * a - b * b;
    if height_squared <= 0.0 {
        return 0.0;
    }
    let z = height_squared.sqrt();
    // Half of the arc on x = a, seen from its own centre, and on y = b.
    let (on_a, on_b) = (z.atan2(b), z.atan2(a));
    let sphere = 2.0 * (PI - z.atan2(-a * b) - a * on_a - b * on_b);
    let face_a = (1.0 - a * a) * on_a - b * z;
    let face_b = (1.0 - b * b) * on_b - a * z;
    (sphere - a * face_a - b * face_b) / 3.0
}

/// Part of the unit ball with x > a, y > b and z > c.
fn beyond_three(a: f64, b: f64, c: f64) -> f64 {
    if a < 0.0 {
        return beyond_two(b, c) - beyond_three(-a, b, c);
    }
    if b < 0.0 {
        return beyond_two(a, c) - beyond_three(a, -b, c);
    }
    if c < 0.0 {
        return beyond_two(a, b) - beyond_three(a, b, -c);
    }
    if a * a + b * b + c * c >= 1.0 {
        return 0.0;
    }
    let height = |p: f64, q: f64| (1.0 - p * p - q * q).max(0.0).sqrt();
    let (x, y, z) = (height(b, c), height(a, c), height(a, b));
    // Arc on x = a from the vertex on z = c to that on y = b, and so on around.
    let on_a = z.atan2(b) + y.atan2(c) - FRAC_PI_2;
    let on_b = z.atan2(a) + x.atan2(c) - FRAC_PI_2;
    let on_c = y.atan2(a) + x.atan2(b) - FRAC_PI_2;
    let sphere = 2.0 * PI
        - z.atan2(-a * b)
        - x.atan2(-b * c)
        - y.atan2(-a * c)
        - a * on_a
        - b * on_b
        - c * on_c;
    let face = |h: f64, arc: f64, p: f64, along_p: f64, q: f64, along_q: f64| {
        0.5 * ((1.0 - h * h) * arc - p * (along_p - q) - q * (along_q - p))
    };
    let face_a = face(a, on_a, b, z, c, y);
    let face_b = face(b, on_b, a, z, c, x);
    let face_c = face(c, on_c, a, y, b, x);
    (sphere - a * face_a - b * face_b - c * face_c) / 3.0
}

/// Volume (m³) of the part of a sphere that lies in the box between two corners; an empty box holds nothing.
/// Exact to round-off: a few 10⁻¹⁵ of the sphere's volume.
pub fn sphere_box_volume(centre: [f64; 3], radius: f64, lower: [f64; 3], upper: [f64; 3]) -> f64 {
    // Distances of the faces from the centre, outward positive, in radii.
    let mut low = [0.0; 3];
    let mut high = [0.0; 3];
    let mut farthest = 0.0;
    for axis in 0..3 {
        if upper[axis] <= lower[axis] {
            return 0.0;
        }
        low[axis] = (centre[axis] - lower[axis]) / radius;
        high[axis] = (upper[axis] - centre[axis]) / radius;
        if low[axis] <= -1.0 || high[axis] <= -1.0 {
            return 0.0;
        }
        let reach = low[axis].max(high[axis]);
        farthest += reach * reach;
    }
    if farthest <= 1.0 {
        return (0..3).map(|axis| upper[axis] - lower[axis]).product();
    }
    // Faces that cut the ball, as (axis, distance).
    let mut cuts = [(0usize, 0.0); 6];
    let mut count = 0;
    for axis in 0..3 {
        for distance in [low[axis], high[axis]] {
            if distance < 1.0 {
                cuts[count] = (axis, distance);
                count += 1;
            }
        }
    }
    let mut volume = 4.0 / 3.0 * PI;
    for (first, &(axis, a)) in cuts[..count].iter().enumerate() {
        volume -= beyond_one(a);
        for (second, &(other, b)) in cuts[..count].iter().enumerate().skip(first + 1) {
            if other == axis || (a >= 0.0 && b >= 0.0 && a * a + b * b >= 1.0) {
                continue;
            }
            volume += beyond_two(a, b);
            for &(third, c) in &cuts[second + 1..count] {
                if third != other && third != axis {
                    volume -= beyond_three(a, b, c);
                }
            }
        }
    }
    volume.max(0.0) * radius * radius * radius
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;

    const FAR: f64 = 1e3;

    #[test]
    fn one_face_leaves_a_cap() {
        let mut rng = ChaCha8Rng::seed_from_u64(1);
        let mut worst: f64 = 0.0;
        for _ in 0..100_000 {
            let radius = rng.random_range(0.1..3.0);
            let height = radius * rng.random_range(0.0..2.0);
            let axis = rng.random_range(0..3usize);
            let mut lower = [-FAR; 3];
            let mut upper = [FAR; 3];
            if rng.random_bool(0.5) {
                lower[axis] = radius - height;
            } else {
                upper[axis] = height - radius;
            }
            let cap = PI * height * height * (3.0 * radius - height) / 3.0;
            let volume = sphere_box_volume([0.0; 3], radius, lower, upper);
            worst = worst.max((volume - cap).abs() / (4.0 / 3.0 * PI * radius.powi(3)));
        }
        assert!(worst < 1e-14, "{worst:e}");
    }

    #[test]
    fn boxes_that_fill_space_share_the_whole_sphere() {
        let mut rng = ChaCha8Rng::seed_from_u64(2);
        let mut worst: f64 = 0.0;
        for _ in 0..2_000 {
            let radius: f64 = rng.random_range(0.2..2.0);
            // Faces of 3 x 4 x 5 boxes, some of them touching the sphere or through its centre.
            let faces = |rng: &mut ChaCha8Rng, n: usize| {
                let mut inner: Vec<f64> = (1..n).map(|_| rng.random_range(-2.0..2.0)).collect();
                inner[0] = [0.0, radius, -radius, 1e-9, inner[0]][rng.random_range(0..5usize)];
                inner.sort_by(f64::total_cmp);
                inner.insert(0, -FAR);
                inner.push(FAR);
                inner
            };
            let (x, y, z) = (faces(&mut rng, 3), faces(&mut rng, 4), faces(&mut rng, 5));
            let mut sum = 0.0;
            for i in x.windows(2) {
                for j in y.windows(2) {
                    for k in z.windows(2) {
                        let (lower, upper) = ([i[0], j[0], k[0]], [i[1], j[1], k[1]]);
                        sum += sphere_box_volume([0.0; 3], radius, lower, upper);
                    }
                }
            }
            let whole = 4.0 / 3.0 * PI * radius.powi(3);
            worst = worst.max((sum / whole - 1.0).abs());
        }
        assert!(worst < 5e-14, "{worst:e}");
    }

    /// ∫∫ of the chord along z between the faces, the x and y ranges split where the integrand has kinks.
    fn by_quadrature(lower: [f64; 3], upper: [f64; 3]) -> f64 {
        let n = 1500;
        let step = |axis: usize| (upper[axis] - lower[axis]) / f64::from(n);
        let mut sum = 0.0;
        for i in 0..n {
            let x = lower[0] + step(0) * (f64::from(i) + 0.5);
            for j in 0..n {
                let y = lower[1] + step(1) * (f64::from(j) + 0.5);
                let h = (1.0 - x * x - y * y).max(0.0).sqrt();
                sum += (upper[2].min(h) - lower[2].max(-h)).max(0.0);
            }
        }
        sum * step(0) * step(1)
    }

    #[test]
    fn edges_and_corners_agree_with_quadrature() {
        for (lower, upper) in [
            ([0.1, 0.2, 0.3], [0.7, 0.9, 0.8]),
            ([-0.6, -0.5, -0.4], [0.7, 0.8, 0.9]),
            ([-0.9, 0.3, -0.2], [0.4, 1.0, 0.95]),
            ([-1.0, -1.0, 0.55], [0.2, 0.6, 0.75]),
        ] {
            let exact = sphere_box_volume([0.0; 3], 1.0, lower, upper);
            let summed = by_quadrature(lower, upper);
            assert!((exact - summed).abs() < 3e-6, "{exact} {summed}");
        }
    }

    #[test]
    fn what_lies_apart_or_inside_is_plain() {
        let cube = |h: f64| sphere_box_volume([0.0; 3], 1.0, [-h; 3], [h; 3]);
        assert_eq!(cube(0.5), 1.0);
        assert!((cube(1.0) - 4.0 / 3.0 * PI).abs() < 1e-15);
        let apart = sphere_box_volume([5.0, 0.0, 0.0], 1.0, [-1.0; 3], [1.0; 3]);
        assert_eq!(apart, 0.0);
        // The corner of the box lies outside, though each face alone would be near enough.
        let corner = sphere_box_volume([0.0; 3], 1.0, [0.6, 0.6, 0.6], [2.0; 3]);
        assert!(corner.abs() < 1e-15, "{corner:e}");
        let eighth = sphere_box_volume([0.0; 3], 1.0, [0.0; 3], [2.0; 3]);
        assert!((eighth - PI / 6.0).abs() < 1e-15);
        assert_eq!(sphere_box_volume([0.0; 3], 1.0, [0.0; 3], [0.0; 3]), 0.0);
    }
}
