//! A plane through a unit cell: the volume under it, and the plane that cuts off a given volume.
//!
//! Material fills m·x < α in the unit cell [0, 1]³, m pointing out of it. For 0 ≤ m₁ ≤ m₂ ≤ m₃ with
//! sum 1 and α ≤ ½ the volume is one of five polynomials (Scardovelli & Zaleski, *J. Comput. Phys.*
//! 164 (2000) 228), and so is its inverse the root of a polynomial; an axis along which the plane is level is a component of zero, so two
//! dimensions are a special case and not another formula.

/// Steps of Newton's method after the closed form of the inverse.
const POLISHING: usize = 3;
/// Axes of the unit cell.
const AXES: usize = 3;

/// A plane m·x = α in the coordinates of a unit cell.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Plane {
    /// Normal m, out of the material, of unit length.
    pub normal: [f64; AXES],
    /// α.
    pub offset: f64,
}

/// Normal with |m₁| + |m₂| + |m₃| = 1, and that sum.
fn scaled(normal: [f64; AXES]) -> ([f64; AXES], f64) {
    let sum: f64 = normal.iter().map(|m| m.abs()).sum();
    (normal.map(|m| m.abs() / sum), sum)
}

fn sorted(mut m: [f64; AXES]) -> [f64; AXES] {
    m.sort_unstable_by(f64::total_cmp);
    m
}

/// Volume of α ≤ ½ under sorted components of sum 1.
fn lower_volume([m1, m2, m3]: [f64; AXES], alpha: f64) -> f64 {
    let both = m1 + m2;
    if alpha < m1 {
        alpha * alpha * alpha / (6.0 * m1 * m2 * m3)
    } else if alpha < m2 {
        alpha * (alpha - m1) / (2.0 * m2 * m3) + m1 * m1 / (6.0 * m2 * m3)
    } else if alpha < both {
        // What lies beyond the cell along the first axis, and then along the others: small pieces, so
        // that nothing cancels however small m₁ is.
        let beyond = |m: f64| (alpha - m).max(0.0).powi(3);
        (3.0 * alpha * (alpha - m1) + m1 * m1) / (6.0 * m2 * m3)
            - (beyond(m2) + beyond(m3)) / (6.0 * m1 * m2 * m3)
    } else {
        (2.0 * alpha - both) / (2.0 * m3)
    }
}

/// Volume under sorted components of sum 1, any α.
fn sorted_volume(m: [f64; AXES], alpha: f64) -> f64 {
    if alpha <= 0.0 {
        0.0
    } else if alpha >= 1.0 {
        1.0
    } else if alpha <= 0.5 {
        lower_volume(m, alpha)
    } else {
        1.0 - lower_volume(m, 1.0 - alpha)
    }
}

/// α of a volume of at most ½ under sorted components of sum 1.
fn lower_offset(m: [f64; AXES], volume: f64) -> f64 {
    let [m1, m2, m3] = m;
    if m1 == 0.0 {
        // In the plane both branches have an inverse.
        return if volume < 0.5 * m2 / m3 {
            (2.0 * volume * m2 * m3).sqrt()
        } else {
            volume * m3 + 0.5 * m2
        };
    }
    let both = m1 + m2;
    let product = m1 * m2 * m3;
    if volume <= m1 * m1 / (6.0 * m2 * m3) {
        return (6.0 * product * volume).cbrt();
    }
    // Beyond the first axis only: 3 α² − 3 m₁ α + m₁² = 6 m₂ m₃ V.
    let square = 0.5 * (m1 + ((8.0 * m2 * m3 * volume) - m1 * m1 / 3.0).max(0.0).sqrt());
    if square <= m2 {
        return square;
    }
    let last = both.min(m3);
    if volume >= lower_volume(m, both) && both <= 0.5 {
        return volume * m3 + 0.5 * both;
    }
    let squares = m1 * m1 + m2 * m2;
    let cubes = m1 * m1 * m1 + m2 * m2 * m2;
    let (from, to, start) = if volume < lower_volume(m, last) {
        let root = middle_root(-3.0 * both, 3.0 * squares, 6.0 * product * volume - cubes);
        (m2, last, root)
    } else {
        let squares = squares + m3 * m3;
        let cubes = cubes + m3 * m3 * m3;
        let root = middle_root(-1.5, 1.5 * squares, 3.0 * product * volume - 0.5 * cubes);
        (m3, both.min(0.5), root)
    };
    // The roots of a cubic lose digits where m₁ is small: two steps of Newton's method bring them back.
    let mut alpha = start.clamp(from, to);
    for _ in 0..POLISHING {
        let beyond = |m: f64| (alpha - m).max(0.0).powi(2);
        let area = (m1 * (2.0 * alpha - m1) - beyond(m2) - beyond(m3)) / (2.0 * product);
        if area > 0.0 {
            alpha = (alpha - (lower_volume(m, alpha) - volume) / area).clamp(from, to);
        }
    }
    alpha
}

/// The middle one of three real roots of x³ + a x² + b x + c.
fn middle_root(a: f64, b: f64, c: f64) -> f64 {
    let p = (a * a / 9.0 - b / 3.0).max(0.0);
    let q = (a * b - 3.0 * c) / 6.0 - a * a * a / 27.0;
    let root = p.sqrt();
    let cosine = if p > 0.0 { q / (p * root) } else { 0.0 };
    let angle = cosine.clamp(-1.0, 1.0).acos() / 3.0;
    root * (3.0_f64.sqrt() * angle.sin() - angle.cos()) - a / 3.0
}

impl Plane {
    /// The plane of the given outward normal (of any length but zero) under which the fraction
    /// `fraction` of the unit cell lies.
    pub fn of_fraction(normal: [f64; AXES], fraction: f64) -> Self {
        let length = normal.iter().map(|m| m * m).sum::<f64>().sqrt();
        let normal = normal.map(|m| m / length);
        let (m, sum) = scaled(normal);
        let m = sorted(m);
        let alpha = if fraction <= 0.5 {
            lower_offset(m, fraction.max(0.0))
        } else {
            1.0 - lower_offset(m, (1.0 - fraction).max(0.0))
        };
        // Back from mirrored axes.
        let below: f64 = normal.iter().map(|m| m.min(0.0)).sum();
        Self {
            normal,
            offset: alpha * sum + below,
        }
    }

    /// Volume of material in the box from `low` to `high` (corners in cell coordinates).
    pub fn volume_in(&self, low: [f64; AXES], high: [f64; AXES]) -> f64 {
        let mut size = 1.0;
        let mut offset = self.offset;
        let mut normal = [0.0; AXES];
        for axis in 0..AXES {
            let extent = high[axis] - low[axis];
            size *= extent;
            normal[axis] = self.normal[axis] * extent;
            offset -= self.normal[axis] * low[axis] + normal[axis].min(0.0);
        }
        if size <= 0.0 {
            return 0.0;
        }
        let (m, sum) = scaled(normal);
        if sum == 0.0 {
            return if offset > 0.0 { size } else { 0.0 };
        }
        size * sorted_volume(sorted(m), offset / sum)
    }

    /// Depth of a point below the plane, in units of the cell: positive in the material.
    pub fn depth(&self, point: [f64; AXES]) -> f64 {
        let along: f64 = self.normal.iter().zip(point).map(|(m, x)| m * x).sum();
        self.offset - along
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const UNIT: ([f64; 3], [f64; 3]) = ([0.0; 3], [1.0; 3]);

    fn normals() -> Vec<[f64; 3]> {
        let mut all = Vec::new();
        for i in 0..40_u32 {
            let angle = f64::from(i) * 0.157_079_632_679;
            all.push([angle.cos(), angle.sin(), 0.0]);
            all.push([angle.cos(), 0.3, angle.sin()]);
            all.push([1e-9 * angle.cos(), 1.0, 1e-5 * angle.sin()]);
        }
        all.extend([[1.0, 0.0, 0.0], [0.0, -1.0, 0.0], [1.0, 1.0, 1.0]]);
        all
    }

    #[test]
    fn plane_cuts_off_the_volume_it_was_made_for() {
        for normal in normals() {
            for fraction in [0.0, 1e-12, 0.01, 0.11, 0.3, 0.5, 0.77, 1.0 - 1e-9, 1.0] {
                let plane = Plane::of_fraction(normal, fraction);
                let volume = plane.volume_in(UNIT.0, UNIT.1);
                assert!(
                    (volume - fraction).abs() < 1e-14,
                    "{normal:?} {fraction} {volume}"
                );
            }
        }
    }

    /// The parts of a cell cut in two anywhere hold together what the cell holds.
    #[test]
    fn parts_add_up() {
        for normal in normals() {
            let plane = Plane::of_fraction(normal, 0.37);
            for axis in 0..3 {
                for cut in [0.1, 0.5, 0.83] {
                    let (mut low, mut high) = UNIT;
                    low[axis] = cut;
                    high[axis] = cut;
                    let sum = plane.volume_in(UNIT.0, high) + plane.volume_in(low, UNIT.1);
                    assert!((sum - 0.37).abs() < 1e-14, "{normal:?} {axis} {sum}");
                }
            }
        }
    }

    /// The volume is Σ (±) (α − m·c)₊³/(6 m₁ m₂ m₃) over the corners c of the cell, + where c has an even
    /// number of ones: another formula, good where no component is small.
    #[test]
    fn volume_is_that_of_pyramids_over_the_corners() {
        for normal in normals() {
            if normal.iter().any(|m| m.abs() < 0.2) {
                continue;
            }
            for offset in (-12..=24).map(|n| 0.1 * f64::from(n) + 0.013) {
                let plane = Plane { normal, offset };
                let mut exact = 0.0;
                for corner in 0..8_u32 {
                    // Distance below the plane of the corner, seen from where the material is deepest.
                    let mut depth = offset;
                    let mut sign = 1.0;
                    for (axis, m) in normal.iter().enumerate() {
                        let far = corner >> axis & 1 == 1;
                        depth -= if far == (*m > 0.0) { *m } else { 0.0 };
                        sign *= if far { -1.0 } else { 1.0 };
                    }
                    exact += sign * depth.max(0.0).powi(3);
                }
                let exact = exact / (6.0 * normal.iter().map(|m| m.abs()).product::<f64>());
                let volume = plane.volume_in(UNIT.0, UNIT.1);
                assert!(
                    (volume - exact).abs() < 2e-13,
                    "{normal:?} {offset} {volume} {exact}"
                );
            }
        }
    }

    /// A triangle and a tetrahedron by hand.
    #[test]
    fn corner_volumes() {
        let triangle = Plane {
            normal: [0.6, 0.8, 0.0],
            offset: 0.48,
        };
        // Legs 0.8 and 0.6.
        assert!((triangle.volume_in(UNIT.0, UNIT.1) - 0.24).abs() < 1e-15);
        let third = 1.0 / 3.0_f64.sqrt();
        let tetrahedron = Plane {
            normal: [third, -third, third],
            offset: (0.5 - 1.0) * third,
        };
        // Legs 0.5 from the corner (0, 1, 0).
        assert!((tetrahedron.volume_in(UNIT.0, UNIT.1) - 0.125 / 6.0).abs() < 1e-15);
    }
}
