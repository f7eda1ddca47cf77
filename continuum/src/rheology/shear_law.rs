//! Laws whose steady shear flows are known, so that computed ones can be judged.

use super::Rheology;
use crate::error::Error;

/// A law that says at which rate it shears under given stresses.
pub trait ShearLaw: Rheology {
    /// Refuses parameters with which the law means nothing.
    ///
    /// # Errors
    /// [`Error::OutOfRange`] with the key, the value and the allowed range.
    fn validate(&self) -> Result<(), Error>;

    /// Bulk density ρ = φ ρ_s (kg/m³).
    fn bulk_density(&self) -> f64;

    /// Friction coefficients without cohesion, at rest and at an unlimited strain rate (∞ where
    /// stress grows without limit): layers on slopes up to the first one rest, those beyond the
    /// second one accelerate for ever.
    fn friction_limits(&self) -> [f64; 2];

    /// c (Pa).
    fn cohesion(&self) -> f64;

    /// The strain rate γ̇ (1/s) at which κ(γ̇, p) is the given shear stress (Pa): 0 up to the yield
    /// stress, ∞ where no rate bears the stress.
    fn rate_under(&self, shear_stress: f64, pressure: f64) -> f64;
}

/// Nodes and weights of Gauss' five-point rule on [−1, 1].
const NODES: [[f64; 2]; 5] = [
    [-0.906_179_845_938_664, 0.236_926_885_056_189_08],
    [-0.538_469_310_105_683_1, 0.478_628_670_499_366_47],
    [0.0, 0.568_888_888_888_888_9],
    [0.538_469_310_105_683_1, 0.478_628_670_499_366_47],
    [0.906_179_845_938_664, 0.236_926_885_056_189_08],
];
/// Panels of the rule: profiles with cohesion bend within a fraction of the depth.
const PANELS: usize = 16;

/// ∫ f(x) dx between two limits, of degree nine in each of sixteen panels.
pub(crate) fn integral(from: f64, to: f64, f: impl Fn(f64) -> f64) -> f64 {
    let half = 0.5 * (to - from) / PANELS as f64;
    (0..PANELS)
        .map(|panel| {
            let middle = from + (2 * panel + 1) as f64 * half;
            NODES
                .iter()
                .map(|[node, weight]| weight * f(middle + half * node))
                .sum::<f64>()
        })
        .sum::<f64>()
        * half
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn polynomials_of_degree_nine_are_integrated_exactly() {
        let value = integral(-1.0, 2.0, |x| 10.0 * x.powi(9) - 3.0 * x * x);
        assert!((value - (1023.0 - 9.0)).abs() < 1e-10);
        assert!((integral(0.0, 3.0, f64::exp) - 3f64.exp_m1()).abs() < 1e-13 * 20.0);
    }
}
