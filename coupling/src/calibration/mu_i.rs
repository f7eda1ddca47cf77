//! Weighted fit of μ(I) = μ_s + (μ_2 − μ_s)/(1 + I_0/I) with its uncertainty.

use super::least_squares::{FitError, Solution, levenberg_marquardt};
use super::points::LocalPoint;
use nalgebra::{Matrix3, SVector, Vector3};
use serde::{Deserialize, Serialize};
use statrs::distribution::{ContinuousCDF, StudentsT};

/// Gauss' cumulative probability at one standard deviation.
pub(super) const ONE_SIGMA: f64 = 0.841_344_746_068_543;

/// Which friction the fit describes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Stress {
    /// |τ|/p with p = trace/3: what a continuum solver with one pressure needs.
    MeanPressure,
    /// |τ|/σ_zz, measured.
    NormalPressure,
    /// tan θ, the momentum balance of a steady uniform flow taken for granted.
    TangentOfSlope,
}

/// A fitted rheology. Standard errors are roots of the diagonal of `covariance`, which is (JᵀWJ)⁻¹ times
/// `error_scale`² (see [`fit_mu_i`]).
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct MuIFit {
    /// Which friction was fitted.
    pub stress: Stress,
    /// Friction as I → 0.
    pub mu_s: f64,
    /// Friction as I → ∞.
    pub mu_2: f64,
    /// I where μ is half way.
    pub i_0: f64,
    /// Standard error.
    pub mu_s_error: f64,
    /// Standard error.
    pub mu_2_error: f64,
    /// Standard error.
    pub i_0_error: f64,
    /// Covariance of (μ_s, μ_2, I_0).
    pub covariance: [[f64; 3]; 3],
    /// Σ (μ − μ(I))²/σ², σ² = σ_μ² + (∂μ/∂I)² σ_I².
    pub chi_square: f64,
    /// Points less parameters.
    pub degrees_of_freedom: usize,
    /// Runs the points come from.
    pub runs: usize,
    /// Root-mean-square of μ − μ(I).
    pub rms_residual: f64,
    /// How much wider the errors are than counting statistics alone.
    pub error_scale: f64,
    /// Degrees of freedom behind that, where it comes from the scatter between runs: then errors are Student's.
    #[serde(default)]
    pub scale_freedom: Option<f64>,
    /// Range of I of the data: the law is not known outside.
    pub valid_i: [f64; 2],
    /// Mean solid fraction of the points.
    pub solid_fraction: f64,
    /// Standard error of that mean between runs; none of a single run.
    pub solid_fraction_error: Option<f64>,
    /// φ against I.
    pub solid_fraction_of_i: Option<SolidFractionFit>,
    /// Do the data determine all three parameters?
    pub identified: bool,
    /// The same in words.
    pub identifiability: String,
    /// Is it a law that a material can have: μ_s ≥ 0, μ_2 > μ_s, I_0 > 0, all finite? Nothing holds the fit to
    /// that but I_0 > 0.
    pub physical: bool,
}

/// φ = `intercept` − `slope` I.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct SolidFractionFit {
    /// φ as I → 0.
    pub intercept: f64,
    /// −∂φ/∂I.
    pub slope: f64,
    /// Standard error.
    pub intercept_error: f64,
    /// Standard error.
    pub slope_error: f64,
    /// Root-mean-square of φ − φ(I).
    pub rms_residual: f64,
}

/// μ(I) = μ_s + (μ_2 − μ_s)/(1 + I_0/I) (Jop et al. 2006), all dimensionless; μ_s at I = 0.
pub fn mu_of_i(mu_s: f64, mu_2: f64, i_0: f64, i: f64) -> f64 {
    mu_s + (mu_2 - mu_s) * i / (i + i_0)
}

/// ∂μ/∂(μ_s, μ_2, I_0).
fn gradient(p: &Vector3<f64>, i: f64) -> Vector3<f64> {
    let s = i / (i + p[2]);
    Vector3::new(1.0 - s, s, -(p[1] - p[0]) * i / ((i + p[2]) * (i + p[2])))
}

/// ∂μ/∂I.
pub(super) fn slope(p: &Vector3<f64>, i: f64) -> f64 {
    (p[1] - p[0]) * p[2] / ((i + p[2]) * (i + p[2]))
}

impl MuIFit {
    /// μ and its standard error at I.
    pub fn band(&self, i: f64) -> (f64, f64) {
        let p = Vector3::new(self.mu_s, self.mu_2, self.i_0);
        let g = gradient(&p, i);
        let c = Matrix3::from_fn(|r, k| self.covariance[r][k]);
        let variance = (g.transpose() * c * g)[(0, 0)];
        (
            mu_of_i(self.mu_s, self.mu_2, self.i_0, i),
            variance.max(0.0).sqrt(),
        )
    }
}

/// The least-squares start: for given I_0 the law is linear in μ_s and μ_2, so I_0 is scanned.
pub(super) fn scanned_start(points: &[(f64, f64, f64)]) -> Option<Vector3<f64>> {
    let middle = {
        let mut all: Vec<f64> = points.iter().map(|p| p.0).collect();
        all.sort_by(f64::total_cmp);
        *all.get(all.len() / 2)?
    };
    let mut best: Option<(f64, Vector3<f64>)> = None;
    for step in -20..=20 {
        let i_0 = middle * 10f64.powf(0.1 * f64::from(step));
        let linear = |p: &SVector<f64, 2>, i: f64| {
            let s = i / (i + i_0);
            Some((p[0] * (1.0 - s) + p[1] * s, SVector::from([1.0 - s, s])))
        };
        if let Ok(fit) = levenberg_marquardt(points, SVector::from([0.4, 0.7]), linear)
            && best.is_none_or(|(chi, _)| fit.chi_square < chi)
        {
            best = Some((
                fit.chi_square,
                Vector3::new(fit.parameters[0], fit.parameters[1], i_0),
            ));
        }
    }
    best.map(|(_, p)| p)
}

/// Unscaled least-squares solution of the law for points (I, μ, weight).
pub(super) fn solve(points: &[(f64, f64, f64)]) -> Result<Solution<3>, FitError> {
    if points.len() < 3 {
        return Err(FitError::TooFewPoints {
            found: points.len(),
            needed: 3,
        });
    }
    let start = scanned_start(points).ok_or(FitError::Degenerate)?;
    levenberg_marquardt(points, start, |p, i| {
        // I_0 ≤ 0 puts the pole of the law among the data.
        (p[2] > 0.0).then(|| (mu_of_i(p[0], p[1], p[2], i), gradient(p, i)))
    })
}

/// Fits the law to the points of one or more runs, run after run and each from below.
///
/// Errors in both coordinates: weights 1/(σ_μ² + (∂μ/∂I)² σ_I²) (effective variance, Orear 1982), iterated.
///
/// The errors are then widened by `error_scale`² = max(1, χ²/(N − 3), B), where
/// B = Σ_runs m ē² /(runs − 3) for runs of m points whose normalised residuals have the mean ē: the layers of
/// one run share its fluctuations and its misfit and are not independent, and B is what the scatter *between*
/// runs says (all of N points' weight counts as that of the runs). With runs − 3 degrees of freedom behind it
/// the error bars are Student's, not Gauss'; with three runs or fewer B is not defined and 1 run's χ² stands.
///
/// # Errors
/// If there are fewer than 4 points, a number is not finite, an error not positive, or the points do not
/// determine the parameters.
pub fn fit_mu_i(points: &[LocalPoint], stress: Stress) -> Result<MuIFit, FitError> {
    let (data, fit) = effective(points, stress)?;
    let p = fit.parameters;
    let normalised: Vec<f64> = data
        .iter()
        .map(|&(i, mu, w)| (mu - mu_of_i(p[0], p[1], p[2], i)) * w.sqrt())
        .collect();
    let by_run = run_numbers(points);
    let runs = by_run.iter().max().map_or(0, |m| m + 1);
    let between = between_runs(&normalised, &by_run, 3);
    let freedom = points.len() - 3;
    let mut scale = (fit.chi_square / freedom as f64).max(1.0);
    let mut scale_freedom = None;
    if runs > 3 {
        let nu = (runs - 3) as f64;
        let student = StudentsT::new(0.0, 1.0, nu).map_or(1.0, |t| t.inverse_cdf(ONE_SIGMA));
        if between > scale {
            scale = between * student * student;
            scale_freedom = Some(nu);
        }
    }
    let covariance = fit.covariance * scale;
    let error = |k: usize| covariance[(k, k)].sqrt();
    let squares: f64 = data
        .iter()
        .map(|&(i, mu, _)| (mu - mu_of_i(p[0], p[1], p[2], i)).powi(2))
        .sum();
    let low = points
        .iter()
        .map(|p| p.inertial_number)
        .fold(f64::INFINITY, f64::min);
    let high = points.iter().map(|p| p.inertial_number).fold(0.0, f64::max);
    let (solid_fraction, solid_fraction_error) = mean_between_runs(points, &by_run, runs);
    let (identified, identifiability) = identifiability(&p, &covariance, [low, high], runs);
    let finite = p.iter().chain(covariance.iter()).all(|x| x.is_finite());
    Ok(MuIFit {
        stress,
        mu_s: p[0],
        mu_2: p[1],
        i_0: p[2],
        mu_s_error: error(0),
        mu_2_error: error(1),
        i_0_error: error(2),
        covariance: std::array::from_fn(|r| std::array::from_fn(|k| covariance[(r, k)])),
        chi_square: fit.chi_square,
        degrees_of_freedom: freedom,
        runs,
        rms_residual: (squares / points.len() as f64).sqrt(),
        error_scale: scale.sqrt(),
        scale_freedom,
        valid_i: [low, high],
        solid_fraction,
        solid_fraction_error,
        solid_fraction_of_i: fit_solid_fraction(points).ok(),
        identified,
        identifiability,
        physical: finite && p[0] >= 0.0 && p[1] > p[0] && p[2] > 0.0,
    })
}

/// Friction of a point and its standard error.
pub(super) fn friction(stress: Stress, p: &LocalPoint) -> (f64, f64) {
    match stress {
        Stress::MeanPressure => (p.friction, p.friction_error),
        Stress::NormalPressure => (p.friction_zz, p.friction_zz_error),
        // No error of its own: the error of I alone weighs; the measured one keeps the weights finite.
        Stress::TangentOfSlope => (p.slope_degrees.to_radians().tan(), p.friction_zz_error),
    }
}

/// Points (I, μ, weight) with effective variances, and the least-squares solution they belong to.
type Weighted = (Vec<(f64, f64, f64)>, Solution<3>);

fn effective(points: &[LocalPoint], stress: Stress) -> Result<Weighted, FitError> {
    if points.len() < 4 {
        return Err(FitError::TooFewPoints {
            found: points.len(),
            needed: 4,
        });
    }
    for (index, p) in points.iter().enumerate() {
        let (mu, error) = friction(stress, p);
        let checks = [
            ("I", p.inertial_number, p.inertial_number > 0.0),
            (
                "I error",
                p.inertial_number_error,
                p.inertial_number_error >= 0.0,
            ),
            ("mu", mu, true),
            ("mu error", error, error > 0.0),
            ("phi", p.solid_fraction, true),
        ];
        for (what, value, allowed) in checks {
            if !allowed || !value.is_finite() {
                return Err(FitError::BadPoint { index, what, value });
            }
        }
    }
    let mut data = weighted(points, stress, &|_| 0.0);
    let mut fit = solve(&data)?;
    for _ in 0..20 {
        data = weighted(points, stress, &|i| slope(&fit.parameters, i));
        let next = solve(&data)?;
        let change = (next.parameters - fit.parameters).amax();
        fit = next;
        if change < 1e-9 {
            break;
        }
    }
    Ok((data, fit))
}

/// (I, μ, weight) with the errors of I at a slope ∂μ/∂I.
fn weighted(
    points: &[LocalPoint],
    stress: Stress,
    slope: &dyn Fn(f64) -> f64,
) -> Vec<(f64, f64, f64)> {
    let of = |point: &LocalPoint| {
        let (mu, error) = friction(stress, point);
        let from_i = slope(point.inertial_number) * point.inertial_number_error;
        let weight = 1.0 / (error * error + from_i * from_i);
        (point.inertial_number, mu, weight)
    };
    points.iter().map(of).collect()
}

/// The points as other fits take them: (I, μ, weight), with the effective variances of μ(I)'s own fit; where the points
/// do not determine that one, of a straight line.
pub(super) fn checked_points(
    points: &[LocalPoint],
    stress: Stress,
) -> Result<Vec<(f64, f64, f64)>, FitError> {
    match effective(points, stress) {
        Ok((data, _)) => Ok(data),
        Err(FitError::Degenerate) => {
            let line =
                |p: &SVector<f64, 2>, i: f64| Some((p[0] + p[1] * i, SVector::from([1.0, i])));
            let plain = weighted(points, stress, &|_| 0.0);
            let fit = levenberg_marquardt(&plain, SVector::from([0.5, 0.1]), line)?;
            Ok(weighted(points, stress, &|_| fit.parameters[1]))
        }
        Err(error) => Err(error),
    }
}

/// Numbers the runs: a run is a stretch of points of one slope that rise; no run has two at one height.
pub(super) fn run_numbers(points: &[LocalPoint]) -> Vec<usize> {
    let mut run = 0;
    let mut numbers = Vec::with_capacity(points.len());
    for (k, p) in points.iter().enumerate() {
        let before = k.checked_sub(1).map(|k| &points[k]);
        let another = |b: &LocalPoint| b.slope_degrees != p.slope_degrees || b.z >= p.z;
        run += usize::from(before.is_some_and(another));
        numbers.push(run);
    }
    numbers
}

/// Σ_runs m ē²/(runs − `parameters`) for runs of m points whose normalised residuals have the mean ē; 0 where runs are too few.
pub(super) fn between_runs(normalised: &[f64], by_run: &[usize], parameters: usize) -> f64 {
    let runs = by_run.iter().max().map_or(0, |m| m + 1);
    if runs <= parameters {
        return 0.0;
    }
    let mut sums = vec![(0.0, 0.0); runs];
    for (residual, run) in normalised.iter().zip(by_run) {
        sums[*run].0 += residual;
        sums[*run].1 += 1.0;
    }
    let between: f64 = sums.iter().map(|(sum, n)| sum * sum / n).sum();
    between / (runs - parameters) as f64
}

fn mean_between_runs(points: &[LocalPoint], by_run: &[usize], runs: usize) -> (f64, Option<f64>) {
    let mean = points.iter().map(|p| p.solid_fraction).sum::<f64>() / points.len() as f64;
    let mut squares = 0.0;
    for run in 0..runs {
        let own: Vec<f64> = points
            .iter()
            .zip(by_run)
            .filter(|(_, r)| **r == run)
            .map(|(p, _)| p.solid_fraction)
            .collect();
        let own_mean = own.iter().sum::<f64>() / own.len() as f64;
        squares += (own_mean - mean).powi(2);
    }
    let r = runs as f64;
    let error = (runs > 1).then(|| (squares / (r * (r - 1.0))).sqrt());
    (mean, error)
}

/// Least error of φ: slices of a dense bed fluctuate so little that counting errors alone would weigh absurdly.
pub(super) const LEAST_FRACTION_ERROR: f64 = 1e-4;

/// Straight line through φ(I), weights 1/σ_φ², errors scaled as for μ(I) by χ² alone.
///
/// # Errors
/// As [`fit_mu_i`].
pub fn fit_solid_fraction(points: &[LocalPoint]) -> Result<SolidFractionFit, FitError> {
    if points.len() < 3 {
        return Err(FitError::TooFewPoints {
            found: points.len(),
            needed: 3,
        });
    }
    let data: Vec<_> = points
        .iter()
        .map(|p| {
            let error = p.solid_fraction_error.max(LEAST_FRACTION_ERROR);
            (p.inertial_number, p.solid_fraction, 1.0 / (error * error))
        })
        .collect();
    let line = |p: &SVector<f64, 2>, i: f64| Some((p[0] - p[1] * i, SVector::from([1.0, -i])));
    let fit = levenberg_marquardt(&data, SVector::from([0.6, 0.2]), line)?;
    let scale = (fit.chi_square / (data.len() - 2) as f64).max(1.0);
    let p = fit.parameters;
    let squares: f64 = data
        .iter()
        .map(|(i, phi, _)| (phi - p[0] + p[1] * i).powi(2))
        .sum();
    Ok(SolidFractionFit {
        intercept: p[0],
        slope: p[1],
        intercept_error: (scale * fit.covariance[(0, 0)]).sqrt(),
        slope_error: (scale * fit.covariance[(1, 1)]).sqrt(),
        rms_residual: (squares / data.len() as f64).sqrt(),
    })
}

/// Relative error above which a parameter counts as unknown.
const UNKNOWN: f64 = 0.5;

fn identifiability(
    p: &Vector3<f64>,
    covariance: &Matrix3<f64>,
    range: [f64; 2],
    runs: usize,
) -> (bool, String) {
    let mut reasons = Vec::new();
    let c = |row: usize, column: usize| covariance[(row, column)];
    for (name, value, variance) in [
        ("mu_s", p[0], c(0, 0)),
        ("mu_2", p[1], c(1, 1)),
        ("i_0", p[2], c(2, 2)),
        // The two ends of the law are correlated, and strongly where the data reach only one of them.
        (
            "mu_2 - mu_s",
            p[1] - p[0],
            c(0, 0) + c(1, 1) - 2.0 * c(0, 1),
        ),
    ] {
        // Rounding may leave a difference of equals a little below 0.
        let error = variance.max(0.0).sqrt();
        if variance.is_nan() || error >= UNKNOWN * value.abs() {
            reasons.push(format!(
                "{name} = {value:.3} ± {error:.3} is not known to 50 %"
            ));
        }
    }
    if range[1] < p[2] {
        reasons.push(format!("all data lie below i_0 (I up to {:.3})", range[1]));
    }
    if range[0] > p[2] {
        reasons.push(format!("all data lie above i_0 (I from {:.3})", range[0]));
    }
    if runs <= 3 {
        reasons.push(format!(
            "{runs} runs are too few to see the scatter between runs"
        ));
    }
    let identified = reasons.is_empty();
    let span = format!(
        "data span I = {:.3} to {:.3}, that is {:.2} to {:.2} of i_0",
        range[0],
        range[1],
        range[0] / p[2],
        range[1] / p[2]
    );
    let text = if identified {
        format!("All three parameters are determined; {span}.")
    } else {
        format!(
            "Not all parameters are determined: {}; {span}.",
            reasons.join("; ")
        )
    };
    (identified, text)
}
