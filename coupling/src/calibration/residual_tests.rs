//! Is what a fit leaves noise? Tests that the friction depends on the inertial number and on nothing else.

use super::mu_i::{MuIFit, Stress, checked_points, mu_of_i, run_numbers};
use super::points::LocalPoint;
use serde::{Deserialize, Serialize};
use statrs::distribution::{ChiSquared, ContinuousCDF, FisherSnedecor, Normal, StudentsT};

/// Probabilities that residuals of a true law with the stated errors would look as they do; below 0.01 something is
/// missing. NaN is never found here: a test that cannot be made says 1.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct ResidualTests {
    /// χ² against the stated errors.
    pub chi_square: f64,
    /// Signs of the residuals in the order of I: too few changes speak of a wrong shape (Wald and Wolfowitz 1940).
    pub signs: f64,
    /// Scatter between runs against that within them: a run has something of its own (F test).
    pub between_runs: f64,
    /// Trend with the depth within runs: μ depends on the place (Student's t of the slope).
    pub depth: f64,
    /// That trend: change of μ − μ(I) over the depth of the flow, from below.
    pub depth_change: f64,
    /// Its standard error.
    pub depth_change_error: f64,
}

/// Below this probability a residual is not noise.
const SIGNIFICANT: f64 = 0.01;

impl ResidualTests {
    /// Does the trend with depth stand out?
    pub fn depends_on_place(&self) -> bool {
        self.depth < SIGNIFICANT
    }

    /// Do runs differ by more than their layers do?
    pub fn depends_on_run(&self) -> bool {
        self.between_runs < SIGNIFICANT
    }

    /// Does the curve have the wrong shape?
    pub fn wrong_shape(&self) -> bool {
        self.signs < SIGNIFICANT
    }
}

/// Tests the residuals of a fit to the points it was made from.
pub fn residual_tests(points: &[LocalPoint], fit: &MuIFit) -> Option<ResidualTests> {
    let data = checked_points(points, fit.stress).ok()?;
    let plain: Vec<f64> = data
        .iter()
        .map(|(i, mu, _)| mu - mu_of_i(fit.mu_s, fit.mu_2, fit.i_0, *i))
        .collect();
    let by_run = run_numbers(points);
    let runs = by_run.iter().max().map_or(0, |m| m + 1);
    let (between_runs, depth) = (
        between(&plain, &by_run, runs),
        depth(points, &plain, &by_run, runs),
    );
    Some(ResidualTests {
        chi_square: ChiSquared::new(fit.degrees_of_freedom.max(1) as f64)
            .map_or(1.0, |d| 1.0 - d.cdf(fit.chi_square)),
        signs: signs(points, &plain),
        between_runs,
        depth: depth.0,
        depth_change: depth.1,
        depth_change_error: depth.2,
    })
}

fn signs(points: &[LocalPoint], residuals: &[f64]) -> f64 {
    let mut order: Vec<usize> = (0..points.len()).collect();
    order.sort_by(|&a, &b| {
        points[a]
            .inertial_number
            .total_cmp(&points[b].inertial_number)
    });
    let above: Vec<bool> = order.iter().map(|&k| residuals[k] > 0.0).collect();
    let up = above.iter().filter(|a| **a).count() as f64;
    let n = above.len() as f64;
    let down = n - up;
    if up < 1.0 || down < 1.0 || n < 10.0 {
        return 1.0;
    }
    let found = 1.0 + above.windows(2).filter(|w| w[0] != w[1]).count() as f64;
    let mean = 1.0 + 2.0 * up * down / n;
    let variance = (mean - 1.0) * (mean - 2.0) / (n - 1.0);
    Normal::new(mean, variance.max(1e-12).sqrt()).map_or(1.0, |d| d.cdf(found))
}

fn between(residuals: &[f64], by_run: &[usize], runs: usize) -> f64 {
    let mut sums = vec![(0.0, 0.0, 0.0); runs];
    for (e, run) in residuals.iter().zip(by_run) {
        let s = &mut sums[*run];
        *s = (s.0 + 1.0, s.1 + e, s.2 + e * e);
    }
    let n: f64 = sums.iter().map(|s| s.0).sum();
    let freedom = (runs as f64 - 3.0, n - runs as f64);
    if freedom.0 < 1.0 || freedom.1 < 1.0 {
        return 1.0;
    }
    let between: f64 = sums.iter().map(|s| s.1 * s.1 / s.0).sum();
    let within: f64 = sums.iter().map(|s| s.2 - s.1 * s.1 / s.0).sum();
    let ratio = (between / freedom.0) / (within / freedom.1).max(1e-300);
    FisherSnedecor::new(freedom.0, freedom.1).map_or(1.0, |d| 1.0 - d.cdf(ratio))
}

/// Probability, change over the depth and its error: a slope common to all runs through the residuals about each run's
/// own mean. Neighbouring layers are correlated, so their number counts half.
fn depth(
    points: &[LocalPoint],
    residuals: &[f64],
    by_run: &[usize],
    runs: usize,
) -> (f64, f64, f64) {
    let (mut ze, mut zz, mut ee, mut n) = (0.0, 0.0, 0.0, 0.0);
    let mut span: f64 = 0.0;
    for run in 0..runs {
        let own: Vec<(f64, f64)> = points
            .iter()
            .zip(residuals)
            .zip(by_run)
            .filter(|(_, r)| **r == run)
            .map(|((p, e), _)| (p.z, *e))
            .collect();
        let count = own.len() as f64;
        let mean = |f: &dyn Fn(&(f64, f64)) -> f64| own.iter().map(f).sum::<f64>() / count;
        let (z, e) = (mean(&|p| p.0), mean(&|p| p.1));
        for p in &own {
            ze += (p.0 - z) * (p.1 - e);
            zz += (p.0 - z) * (p.0 - z);
            ee += (p.1 - e) * (p.1 - e);
        }
        n += count;
        let heights = own.iter().map(|p| p.0);
        let (low, high) = heights.fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), z| {
            (a.min(z), b.max(z))
        });
        span = span.max(high - low);
    }
    let freedom = 0.5 * n - runs as f64 - 1.0;
    if freedom < 3.0 || zz <= 0.0 {
        return (1.0, 0.0, 0.0);
    }
    let slope = ze / zz;
    let left = (ee - slope * ze).max(0.0);
    let error = (left / freedom / zz).sqrt();
    let p = match (error > 0.0, StudentsT::new(0.0, 1.0, freedom)) {
        (true, Ok(d)) => 2.0 * d.cdf(-(slope / error).abs()),
        _ => 1.0,
    };
    (p, slope * span, error * span)
}

/// |τ|/p against |τ|/σ_zz: the mean ratio p/σ_zz of the points, which normal-stress differences make smaller than 1.
pub fn pressure_ratio(points: &[LocalPoint]) -> Option<(f64, f64)> {
    if points.is_empty() {
        return None;
    }
    let n = points.len() as f64;
    let ratio = |p: &LocalPoint| p.friction_zz / p.friction;
    let mean = points.iter().map(ratio).sum::<f64>() / n;
    let squares: f64 = points.iter().map(|p| (ratio(p) - mean).powi(2)).sum();
    Some((mean, (squares / n).sqrt()))
}

impl Stress {
    /// How the friction is written.
    pub fn symbol(self) -> &'static str {
        match self {
            Stress::MeanPressure => "|tau|/p, p = trace/3",
            Stress::NormalPressure => "|tau|/sigma_zz",
            Stress::TangentOfSlope => "tan theta",
        }
    }
}
