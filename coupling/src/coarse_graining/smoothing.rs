//! Radial smoothing kernels in one, two or three dimensions, with exact integrals along segments.
//!
//! W(r) = N w(|r|/R) with ∫W = 1 over the dimensions that are not averaged away. Along a straight segment the
//! distance is ρ = √(b² + u²), with the impact parameter b and the coordinate u from the foot of the
//! perpendicular; of every kernel here ∫W du and ∫u W du are elementary, so the line integrals of the contact and
//! couple stresses (Goldhirsch 2010) need no quadrature.

use serde::{Deserialize, Serialize};
use statrs::function::erf::erf;
use std::f64::consts::{FRAC_1_SQRT_2, PI};

/// The family of a kernel.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Shape {
    /// w = (1 − q)³ (1 + 3q): twice continuously differentiable (Lucy 1977).
    #[default]
    Lucy,
    /// w = exp(−q²/2) with q = |r|/s, cut at q = 3 and scaled up to ∫W = 1.
    Gauss,
    /// w = 1 inside.
    Heaviside,
    /// w = (1 − q²)²: smooth inside, once continuously differentiable.
    Polynomial,
}

/// Where Gauss' kernel is cut, in standard deviations.
const CUT: f64 = 3.0;

/// A kernel of a width in a number of dimensions.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Smoothing {
    shape: Shape,
    /// Radius of the support; of Gauss' kernel, the standard deviation (m).
    width: f64,
    dimensions: usize,
    normalisation: f64,
}

/// Integrals over a segment r₀ + s a, 0 ≤ s ≤ 1.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct AlongSegment {
    /// ∫₀¹ W(r − r₀ − s a) ds.
    pub whole: f64,
    /// ∫₀¹ (1 − s) W(r − r₀ − s a) ds.
    pub near_start: f64,
}

impl Smoothing {
    /// A kernel of the given shape; `width` (m) is the radius of the support, of Gauss' kernel the standard
    /// deviation. `dimensions` from 1 to 3. `None` for anything else.
    pub fn new(shape: Shape, width: f64, dimensions: usize) -> Option<Self> {
        if !(width > 0.0 && width.is_finite()) || !(1..=3).contains(&dimensions) {
            return None;
        }
        // ∫ w dV of the support of radius 1.
        let unit = match (shape, dimensions) {
            (Shape::Lucy, 1) => 4.0 / 5.0,
            (Shape::Lucy, 2) => PI / 5.0,
            (Shape::Lucy, _) => 16.0 * PI / 105.0,
            (Shape::Heaviside, 1) => 2.0,
            (Shape::Heaviside, 2) => PI,
            (Shape::Heaviside, _) => 4.0 * PI / 3.0,
            (Shape::Polynomial, 1) => 16.0 / 15.0,
            (Shape::Polynomial, 2) => PI / 3.0,
            (Shape::Polynomial, _) => 32.0 * PI / 105.0,
            (Shape::Gauss, 1) => (2.0 * PI).sqrt() * erf(CUT * FRAC_1_SQRT_2),
            (Shape::Gauss, 2) => 2.0 * PI * (1.0 - (-0.5 * CUT * CUT).exp()),
            (Shape::Gauss, _) => {
                let tail = (2.0 / PI).sqrt() * CUT * (-0.5 * CUT * CUT).exp();
                (2.0 * PI).powf(1.5) * (erf(CUT * FRAC_1_SQRT_2) - tail)
            }
        };
        Some(Self {
            shape,
            width,
            dimensions,
            normalisation: 1.0 / (unit * width.powi(dimensions as i32)),
        })
    }

    /// The family.
    pub fn shape(&self) -> Shape {
        self.shape
    }

    /// Radius of the support, or standard deviation of Gauss' kernel (m).
    pub fn width(&self) -> f64 {
        self.width
    }

    /// Dimensions in which ∫W = 1.
    pub fn dimensions(&self) -> usize {
        self.dimensions
    }

    /// Radius of the support (m).
    pub fn reach(&self) -> f64 {
        match self.shape {
            Shape::Gauss => CUT * self.width,
            _ => self.width,
        }
    }

    /// W [1/m^dimensions] at a squared distance (m²).
    #[inline]
    pub fn value(&self, squared: f64) -> f64 {
        let q2 = squared / (self.width * self.width);
        let w = match self.shape {
            Shape::Lucy if q2 < 1.0 => {
                let q = q2.sqrt();
                (1.0 - q).powi(3) * (1.0 + 3.0 * q)
            }
            Shape::Gauss if q2 < CUT * CUT => (-0.5 * q2).exp(),
            Shape::Heaviside if q2 <= 1.0 => 1.0,
            Shape::Polynomial if q2 < 1.0 => (1.0 - q2) * (1.0 - q2),
            _ => 0.0,
        };
        self.normalisation * w
    }

    /// (dW/dr)/r at a squared distance: ∇W(r) is r times it. Inside the support only; the jumps of Heaviside's
    /// and Gauss' kernels at its edge are left out.
    #[inline]
    pub fn slope_over_distance(&self, squared: f64) -> f64 {
        let w2 = self.width * self.width;
        let q2 = squared / w2;
        let slope = match self.shape {
            Shape::Lucy if q2 < 1.0 => {
                let q = q2.sqrt();
                -12.0 * (1.0 - q) * (1.0 - q)
            }
            Shape::Gauss if q2 < CUT * CUT => -(-0.5 * q2).exp(),
            Shape::Polynomial if q2 < 1.0 => -4.0 * (1.0 - q2),
            _ => 0.0,
        };
        self.normalisation * slope / w2
    }

    /// ∫ w du from the foot, with lengths in widths: `b2` = b².
    fn zeroth(&self, b2: f64, u: f64) -> f64 {
        let u2 = u * u;
        match self.shape {
            Shape::Heaviside => u,
            Shape::Gauss => (PI / 2.0).sqrt() * (-0.5 * b2).exp() * erf(u * FRAC_1_SQRT_2),
            Shape::Polynomial => {
                let c = 1.0 - b2;
                u * (c * c + u2 * (-2.0 * c / 3.0 + u2 / 5.0))
            }
            Shape::Lucy => {
                let rho = (b2 + u2).sqrt();
                let logarithm = if b2 > 0.0 {
                    b2 * (u / b2.sqrt()).asinh()
                } else {
                    0.0
                };
                let cubes = 0.25 * u * rho * rho * rho + 0.375 * b2 * (u * rho + logarithm);
                let squares = u * (b2 + u2 / 3.0);
                let fourths = u * (b2 * b2 + u2 * (2.0 * b2 / 3.0 + u2 / 5.0));
                u - 6.0 * squares + 8.0 * cubes - 3.0 * fourths
            }
        }
    }

    /// ∫ u w du, with lengths in widths, as a function of ρ².
    fn first(&self, rho2: f64) -> f64 {
        match self.shape {
            Shape::Heaviside => 0.5 * rho2,
            Shape::Gauss => -(-0.5 * rho2).exp(),
            Shape::Polynomial => rho2 * (0.5 + rho2 * (-0.5 + rho2 / 6.0)),
            Shape::Lucy => rho2 * (0.5 + rho2 * (-1.5 + 1.6 * rho2.sqrt() - 0.5 * rho2)),
        }
    }

    /// Integrals over the segment of a point's surroundings: `apart` is r − r₀ (m), `arm` is a (m), both with
    /// zeros along the axes that are averaged away.
    pub fn along(&self, apart: [f64; 3], arm: [f64; 3]) -> AlongSegment {
        let dot = |a: &[f64; 3], b: &[f64; 3]| a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
        let length2 = dot(&arm, &arm);
        let w = self.width;
        // The differences below lose digits as the arm shrinks; a rule of three points then has none to lose.
        if length2 < 1e-6 * w * w {
            return self.along_short(apart, arm);
        }
        let length = length2.sqrt();
        let t = dot(&apart, &arm) / length;
        // The perpendicular itself: |r − r₀|² − t² would lose the digits of a small one.
        let foot: [f64; 3] = std::array::from_fn(|k| apart[k] - t / length * arm[k]);
        let b2 = dot(&foot, &foot) / (w * w);
        let reach = self.reach() / w;
        let half2 = reach * reach - b2;
        if half2 <= 0.0 {
            return AlongSegment::default();
        }
        let half = half2.sqrt();
        let (from, to) = ((-t / w).max(-half), ((length - t) / w).min(half));
        if to <= from {
            return AlongSegment::default();
        }
        let scale = self.normalisation * w / length;
        let zeroth = scale * (self.zeroth(b2, to) - self.zeroth(b2, from));
        let first = scale * w * (self.first(b2 + to * to) - self.first(b2 + from * from));
        AlongSegment {
            whole: zeroth,
            near_start: zeroth * (1.0 - t / length) - first / length,
        }
    }

    fn along_short(&self, apart: [f64; 3], arm: [f64; 3]) -> AlongSegment {
        let offset = 0.5 * 0.6f64.sqrt();
        let mut sum = AlongSegment::default();
        for (s, weight) in [
            (0.5 - offset, 5.0 / 18.0),
            (0.5, 8.0 / 18.0),
            (0.5 + offset, 5.0 / 18.0),
        ] {
            let squared = (0..3).map(|k| (apart[k] - s * arm[k]).powi(2)).sum();
            let w = weight * self.value(squared);
            sum.whole += w;
            sum.near_start += (1.0 - s) * w;
        }
        sum
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;

    pub const SHAPES: [Shape; 4] = [
        Shape::Lucy,
        Shape::Gauss,
        Shape::Heaviside,
        Shape::Polynomial,
    ];

    #[test]
    fn every_kernel_holds_one() {
        for shape in SHAPES {
            for dimensions in 1..=3 {
                let kernel = Smoothing::new(shape, 0.7, dimensions).unwrap();
                let n = 200_000;
                let dr = kernel.reach() / f64::from(n);
                let sum: f64 = (0..n)
                    .map(|k| dr * (f64::from(k) + 0.5))
                    .map(|r| {
                        let shell = [2.0, 2.0 * PI * r, 4.0 * PI * r * r][dimensions - 1];
                        kernel.value(r * r) * shell * dr
                    })
                    .sum();
                assert!((sum - 1.0).abs() < 1e-9, "{shape:?} {dimensions} {sum}");
            }
        }
        assert!(Smoothing::new(Shape::Lucy, 0.0, 3).is_none());
        assert!(Smoothing::new(Shape::Lucy, 1.0, 4).is_none());
    }

    #[test]
    fn slopes_agree_with_differences() {
        for shape in SHAPES {
            let kernel = Smoothing::new(shape, 1.3, 3).unwrap();
            for r in [0.1, 0.5, 0.9, 1.2] {
                let h = 1e-6;
                let value = |r: f64| kernel.value(r * r);
                let slope = (value(r + h) - value(r - h)) / (2.0 * h);
                let exact = r * kernel.slope_over_distance(r * r);
                assert!((slope - exact).abs() < 1e-8, "{shape:?} {r}");
            }
        }
    }

    #[test]
    fn segments_agree_with_quadrature() {
        let mut rng = ChaCha8Rng::seed_from_u64(5);
        for shape in SHAPES {
            for dimensions in 1..=3 {
                let kernel = Smoothing::new(shape, 0.8, dimensions).unwrap();
                for length in [1e-5, 9e-4, 0.01, 0.5, 4.0] {
                    let mut random = |size: f64| -> [f64; 3] {
                        std::array::from_fn(|k| {
                            if k < dimensions {
                                size * rng.random_range(-1.0..1.0)
                            } else {
                                0.0
                            }
                        })
                    };
                    let (apart, arm) = (random(0.4), random(length));
                    let n = 100_000;
                    let mut sum = AlongSegment::default();
                    for k in 0..n {
                        let s = (f64::from(k) + 0.5) / f64::from(n);
                        let squared = (0..3).map(|k| (apart[k] - s * arm[k]).powi(2)).sum();
                        let w = kernel.value(squared) / f64::from(n);
                        sum.whole += w;
                        sum.near_start += (1.0 - s) * w;
                    }
                    let exact = kernel.along(apart, arm);
                    let peak = kernel.value(0.0);
                    // The midpoint sum of a kernel with a jump is good to one step.
                    let tolerance = match shape {
                        Shape::Lucy | Shape::Polynomial => 1e-8,
                        _ => 2e-5,
                    };
                    assert!(
                        (exact.whole - sum.whole).abs() < tolerance * peak
                            && (exact.near_start - sum.near_start).abs() < tolerance * peak,
                        "{shape:?} {dimensions} {length} {exact:?} {sum:?}"
                    );
                }
            }
        }
    }
}
