//! What of a layer's solid fraction beside φ(I) is real.
//!
//! A layer j of a flow k shows r_kj = φ − φ(I) = f_k + δ_kj + ε_kj: what its flow has of its own, what the layer has, and the
//! error of counting, of variance v = σ_φ² + (∂φ/∂I)² σ_I². Variances of f and δ are what the scatter between and within flows
//! has beyond v (moments; Searle, Casella and McCulloch 1992). A regression on r itself would be too flat by the share that is
//! counting; on the expectation of f + δ for given r,
//!
//! > E = r̄_k s_f²/(s_f² + (s_δ² + v)/m) + (r − r̄_k) s_δ²/(s_δ² + v),
//!
//! it is not (regression calibration; Carroll, Ruppert, Stefanski and Crainiceanu 2006).

use serde::{Deserialize, Serialize};

/// Standard deviations of the solid fraction about φ(I).
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Deviation {
    /// From flow to flow, beyond counting.
    pub flows: f64,
    /// From layer to layer of a flow, beyond counting.
    pub layers: f64,
    /// Error of counting of a layer, root-mean-square.
    pub counting: f64,
}

/// What each layer's deviation has of it.
pub(super) struct Share {
    /// Expectation of f + δ.
    pub real: f64,
    /// (r − r̄_k)/(s_δ² + v): times a covariance with ε, the expectation of what goes with the layer's error.
    pub by_chance: f64,
}

/// Deviation of residuals r with variances of counting v, by flows.
pub(super) fn shares(
    residuals: &[f64],
    variances: &[f64],
    by_run: &[usize],
) -> (Deviation, Vec<Share>) {
    let runs = by_run.iter().max().map_or(0, |m| m + 1);
    let n = residuals.len() as f64;
    let mut sums = vec![(0.0, 0.0, 0.0); runs];
    for ((r, v), run) in residuals.iter().zip(variances).zip(by_run) {
        sums[*run].0 += r;
        sums[*run].1 += v;
        sums[*run].2 += 1.0;
    }
    let flows: Vec<(f64, f64, f64)> = sums.iter().map(|(r, v, m)| (r / m, v / m, *m)).collect();
    let within: f64 = residuals
        .iter()
        .zip(by_run)
        .map(|(r, run)| (r - flows[*run].0).powi(2))
        .sum();
    let counting = variances.iter().sum::<f64>() / n;
    let layers = (within / (n - runs as f64).max(1.0) - counting).max(0.0);
    // Two degrees of freedom went into φ(I).
    let between: f64 = flows.iter().map(|(r, _, _)| r * r).sum();
    let of_means: f64 = flows.iter().map(|(_, v, m)| (layers + v) / m).sum();
    let own = (between / (runs as f64 - 2.0).max(1.0) - of_means / runs as f64).max(0.0);
    let part = |a: f64, b: f64| if a > 0.0 { a / (a + b) } else { 0.0 };
    let share = |((r, v), run): ((&f64, &f64), &usize)| {
        let (mean, mean_v, m) = flows[*run];
        Share {
            real: mean * part(own, (layers + mean_v) / m) + (r - mean) * part(layers, *v),
            by_chance: (r - mean) / (layers + v),
        }
    };
    let list = residuals.iter().zip(variances).zip(by_run).map(share);
    let list = list.collect();
    let deviation = Deviation {
        flows: own.sqrt(),
        layers: layers.sqrt(),
        counting: counting.sqrt(),
    };
    (deviation, list)
}
