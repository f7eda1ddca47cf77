//! Smoothing kernels along z, given by their running integrals.
//!
//! A field of this crate is a mean over a layer `[a, b]` of a kernel-smoothed field, so what it needs is
//! not the kernel W itself but Φ(x) = ∫₋∞ˣ W and Ψ(x) = ∫₋∞ˣ Φ, both in closed form:
//! - a point at z₀ puts the share Φ(b − z₀) − Φ(a − z₀) of itself into the layer: the shares of all
//!   layers add up to one to round-off, for any kernel, so mass and weight are recovered exactly;
//! - a segment from z₀ to z₀ + l puts ∫₀¹ [Φ(b − z₀ − s l) − Φ(a − z₀ − s l)] ds
//!   = [Ψ(b − z₀) − Ψ(b − z₀ − l) − Ψ(a − z₀) + Ψ(a − z₀ − l)] / l into it: the line integral of the
//!   contact stress (Goldhirsch 2010) without quadrature.

use statrs::function::erf::erf;
use std::f64::consts::{FRAC_1_SQRT_2, PI};

/// A symmetric kernel W(x) ≥ 0 with ∫W = 1 and compact support [−`reach`, `reach`].
pub trait Kernel {
    /// Half-width of the support (m).
    fn reach(&self) -> f64;
    /// Φ(x) = ∫₋∞ˣ W, from 0 to 1; x in metres.
    fn cumulative(&self, x: f64) -> f64;
    /// Ψ(x) = ∫₋∞ˣ Φ (m); equals x above the support.
    fn double_cumulative(&self, x: f64) -> f64;
}

/// No smoothing beyond the layer itself: a centre belongs to the layer it lies in, W = δ.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Layers;

impl Kernel for Layers {
    fn reach(&self) -> f64 {
        0.0
    }
    fn cumulative(&self, x: f64) -> f64 {
        // Zero at x = 0: a centre on a face belongs to the layer above it.
        if x > 0.0 { 1.0 } else { 0.0 }
    }
    fn double_cumulative(&self, x: f64) -> f64 {
        x.max(0.0)
    }
}

/// W = 1/(2w) for |x| ≤ w.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Heaviside {
    /// Half-width w (m), positive.
    pub half_width: f64,
}

impl Kernel for Heaviside {
    fn reach(&self) -> f64 {
        self.half_width
    }
    fn cumulative(&self, x: f64) -> f64 {
        (0.5 * (x / self.half_width + 1.0)).clamp(0.0, 1.0)
    }
    fn double_cumulative(&self, x: f64) -> f64 {
        let w = self.half_width;
        if x >= w {
            x
        } else if x <= -w {
            0.0
        } else {
            (x + w) * (x + w) / (4.0 * w)
        }
    }
}

/// Lucy's kernel in one dimension, W = 5/(4w) (1 − q)³ (1 + 3q), q = |x|/w ≤ 1: twice continuously
/// differentiable (Lucy 1977).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Lucy {
    /// Half-width w of the support (m), positive.
    pub half_width: f64,
}

impl Kernel for Lucy {
    fn reach(&self) -> f64 {
        self.half_width
    }
    fn cumulative(&self, x: f64) -> f64 {
        let q = (x / self.half_width).clamp(-1.0, 1.0);
        let a = q.abs();
        0.5 + 1.25 * q * (1.0 + a * a * (-2.0 + a * (2.0 - 0.6 * a)))
    }
    fn double_cumulative(&self, x: f64) -> f64 {
        let w = self.half_width;
        if x >= w {
            return x;
        }
        if x <= -w {
            return 0.0;
        }
        let odd_integral = |q: f64| 1.25 * w * q * q * (0.5 + q * q * (-0.5 + q * (0.4 - 0.1 * q)));
        0.5 * (x + w) + odd_integral((x / w).abs()) - odd_integral(1.0)
    }
}

/// Gauss' kernel of standard deviation s, cut at 3 s and scaled up so that ∫W = 1.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Gauss {
    /// Standard deviation s (m), positive.
    pub deviation: f64,
}

impl Gauss {
    const CUT: f64 = 3.0;

    /// What the cut leaves of ∫W, erf(3/√2).
    fn kept() -> f64 {
        erf(Self::CUT * FRAC_1_SQRT_2)
    }
}

impl Kernel for Gauss {
    fn reach(&self) -> f64 {
        Self::CUT * self.deviation
    }
    fn cumulative(&self, x: f64) -> f64 {
        let y = (x / self.deviation).clamp(-Self::CUT, Self::CUT);
        0.5 + 0.5 * erf(y * FRAC_1_SQRT_2) / Self::kept()
    }
    fn double_cumulative(&self, x: f64) -> f64 {
        let reach = self.reach();
        if x >= reach {
            return x;
        }
        if x <= -reach {
            return 0.0;
        }
        let even = |y: f64| {
            self.deviation / Self::kept()
                * (0.5 * y * erf(y * FRAC_1_SQRT_2) + (-0.5 * y * y).exp() / (2.0 * PI).sqrt())
        };
        0.5 * (x + reach) + even(x / self.deviation) - even(Self::CUT)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn integrals_agree(kernel: &impl Kernel, tolerance: f64) {
        let r = kernel.reach();
        assert!(kernel.cumulative(-1.0001 * r).abs() < 1e-14);
        assert!((kernel.cumulative(1.0001 * r) - 1.0).abs() < 1e-14);
        assert!((kernel.double_cumulative(0.9999999999 * r) - r).abs() < 1e-9 * r);
        assert_eq!(kernel.double_cumulative(2.0 * r), 2.0 * r);
        let h = 1e-5 * r;
        for k in -18..=18 {
            let x = 0.05 * f64::from(k) * r;
            let slope =
                (kernel.double_cumulative(x + h) - kernel.double_cumulative(x - h)) / (2.0 * h);
            assert!(
                (slope - kernel.cumulative(x)).abs() < tolerance,
                "Ψ' ≠ Φ at {x}"
            );
            // Symmetry: Φ(x) + Φ(−x) = 1.
            assert!((kernel.cumulative(x) + kernel.cumulative(-x) - 1.0).abs() < 1e-14);
        }
    }

    #[test]
    fn running_integrals_belong_together() {
        integrals_agree(&Heaviside { half_width: 0.7 }, 1e-9);
        integrals_agree(&Lucy { half_width: 1.3 }, 1e-9);
        integrals_agree(&Gauss { deviation: 0.4 }, 1e-9);
    }

    #[test]
    fn densities_are_the_named_ones() {
        let slope =
            |k: &dyn Kernel, x: f64| (k.cumulative(x + 1e-6) - k.cumulative(x - 1e-6)) / 2e-6;
        let lucy = Lucy { half_width: 2.0 };
        let q: f64 = 0.3;
        let value = 5.0 / 8.0 * (1.0 - q).powi(3) * (1.0 + 3.0 * q);
        assert!((slope(&lucy, 0.6) - value).abs() < 1e-9);
        let gauss = Gauss { deviation: 0.5 };
        let value = (-0.5f64 * 0.36).exp() / ((2.0 * PI).sqrt() * 0.5 * 0.997_300_203_936_74);
        assert!((slope(&gauss, 0.3) - value).abs() < 1e-8);
        assert!((slope(&Heaviside { half_width: 0.25 }, 0.1) - 2.0).abs() < 1e-9);
    }
}
