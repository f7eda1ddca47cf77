//! Laws of friction and of solid fraction that are compared as one: μ(I) with one φ, with φ(I), with φ(I) and dilatancy.
//!
//! Every layer gives I, μ and φ. The likelihood of both is that of φ for given I times that of μ for given I and φ, and so is
//! the criterion the sum of two:
//!
//! > φ = φ_0   or   φ(I) = φ_0 − s I,
//! > μ = μ(I)   or   μ = μ(I) + K E[φ − φ(I)],   K ≥ 0.
//!
//! The last is dilatancy: a layer denser than it is in steady flow at its I must dilate as it shears, at an angle with
//! tan ψ = K (φ − φ(I)), and is stronger by that (Roux and Radjai 1998; Pailha and Pouliquen, J. Fluid Mech. 633 (2009) 115).
//! Negative K is not dilatancy: where the layers ask for it the candidate stands at K = 0. E is what of a layer's deviation
//! is not error of counting, see [`Deviation`].
//!
//! *One error in two places.* An error of I moves a layer off μ(I) and off φ(I) at once, by −μ′ and s times it, and would look
//! like a negative K. Its expectation for the deviation seen is taken out of μ, for all candidates alike.
//!
//! *Scatter.* Each half has its ĉ, that of its richest candidate: χ² over its degrees of freedom, widened by (1 + r)/(1 − r)
//! where residuals of neighbouring layers correlate by r > 0, or what the flows scatter by where that is more. Its n is the
//! number of points over ĉ, at least the number of flows.

use super::deviation::{Deviation, shares};
use super::{Law, criterion, fit_law, weights};
use crate::calibration::least_squares::{FitError, levenberg_marquardt, minimise};
use crate::calibration::mu_i::{
    LEAST_FRACTION_ERROR, Stress, between_runs, checked_points, run_numbers, slope, solve,
};
use crate::calibration::points::LocalPoint;
use nalgebra::{DMatrix, DVector, SVector};
use serde::{Deserialize, Serialize};

/// What is said of the solid fraction beside μ(I).
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Fraction {
    /// One φ for all.
    Constant,
    /// φ(I) = φ_0 − s I; friction does not feel what a layer has beside it.
    OfI,
    /// The same, and μ = μ(I) + K (φ − φ(I)).
    Dilatancy,
}

impl Fraction {
    /// All of them, the simplest first.
    pub const ALL: [Fraction; 3] = [Fraction::Constant, Fraction::OfI, Fraction::Dilatancy];

    /// A name for people.
    pub fn title(self) -> &'static str {
        match self {
            Fraction::Constant => "one phi",
            Fraction::OfI => "phi(I)",
            Fraction::Dilatancy => "phi(I) and dilatancy",
        }
    }
}

/// A law of friction and solid fraction, fitted to the same layers as the others.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct JointAlternative {
    /// μ(I).
    pub friction: Law,
    /// φ, and dilatancy.
    pub fraction: Fraction,
    /// Best parameters of μ(I), in the order of [`Law::parameter_names`].
    pub parameters: Vec<f64>,
    /// Their standard errors, widened as the scatter asks for.
    pub errors: Vec<f64>,
    /// K and its standard error; none where it has no part, or nothing of the deviations is real.
    pub dilatancy: Option<[f64; 2]>,
    /// χ² of μ, and of φ.
    pub chi_square: [f64; 2],
    /// Sum of the criteria of μ and of φ, each as in [`compare_laws`](super::compare_laws).
    pub criterion: f64,
    /// exp(−Δ/2) over its sum for all candidates.
    pub weight: f64,
}

/// All candidates, and what they share.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct JointComparison {
    /// The best supported first.
    pub alternatives: Vec<JointAlternative>,
    /// Weight of all candidates with one φ, with φ(I), with dilatancy, in the order of [`Fraction::ALL`].
    pub weights: [f64; 3],
    /// ĉ of μ and of φ.
    pub scatter: [f64; 2],
    /// What the solid fraction has beside φ(I).
    pub deviation: Deviation,
}

impl JointComparison {
    /// The best supported candidate of one kind.
    pub fn best(&self, fraction: Fraction) -> Option<&JointAlternative> {
        self.alternatives.iter().find(|a| a.fraction == fraction)
    }
}

/// One half of a candidate.
struct Half {
    parameters: Vec<f64>,
    variances: Vec<f64>,
    normalised: Vec<f64>,
    chi_square: f64,
}

impl Half {
    /// QAICc for the scatter ĉ.
    fn criterion(&self, scatter: f64, runs: usize) -> f64 {
        let k = self.parameters.len() as f64;
        let effective = (self.normalised.len() as f64 / scatter).max(runs as f64);
        criterion(self.chi_square / scatter, k, effective)
    }

    /// ĉ, were this the richest candidate.
    fn scatter(&self, by_run: &[usize]) -> f64 {
        let k = self.parameters.len();
        let free = self.normalised.len().saturating_sub(k).max(1) as f64;
        let alone = self.chi_square / free * neighbours(&self.normalised, by_run);
        alone
            .max(between_runs(&self.normalised, by_run, k))
            .max(1.0)
    }
}

/// (1 + r)/(1 − r) for the correlation r of neighbouring layers about the mean of their flow; 1 where it is negative.
fn neighbours(normalised: &[f64], by_run: &[usize]) -> f64 {
    let (mut products, mut squares) = (0.0, 0.0);
    let runs = by_run.iter().max().map_or(0, |m| m + 1);
    for run in 0..runs {
        let of_run = normalised.iter().zip(by_run).filter(|(_, r)| **r == run);
        let own: Vec<f64> = of_run.map(|(e, _)| *e).collect();
        let mean = own.iter().sum::<f64>() / own.len().max(1) as f64;
        for pair in own.windows(2) {
            let (a, b) = (pair[0] - mean, pair[1] - mean);
            products += a * b;
            squares += 0.5 * (a * a + b * b);
        }
    }
    let r = if squares > 0.0 {
        (products / squares).clamp(0.0, 0.95)
    } else {
        0.0
    };
    (1.0 + r) / (1.0 - r)
}

/// φ against I: the line, or its level alone.
fn fit_fraction<const N: usize>(data: &[(f64, f64, f64)]) -> Result<Half, FitError> {
    let slopes = |i: f64| SVector::<f64, N>::from_fn(|k, _| if k == 0 { 1.0 } else { -i });
    let line = |p: &SVector<f64, N>, i: f64| Some((p.dot(&slopes(i)), slopes(i)));
    let fit = levenberg_marquardt(data, SVector::<f64, N>::zeros(), line)?;
    let miss = |(i, phi, w): &(f64, f64, f64)| (phi - fit.parameters.dot(&slopes(*i))) * w.sqrt();
    Ok(Half {
        parameters: fit.parameters.iter().copied().collect(),
        variances: fit.covariance.diagonal().iter().copied().collect(),
        normalised: data.iter().map(miss).collect(),
        chi_square: fit.chi_square,
    })
}

/// μ against I and, where given, what of the deviation is real; K ≥ 0 is the last parameter then.
fn fit_friction(law: Law, data: &[(f64, f64, f64)], real: Option<&[f64]>) -> Option<Half> {
    let alone = fit_law(law, data).ok()?;
    let own = alone.parameters.len();
    let value = |p: &[f64], k: usize| {
        let beside = real.map_or(0.0, |r| p[own] * r[k]);
        law.friction(&p[..own], data[k].0) + beside
    };
    let half = |parameters: Vec<f64>, variances: Vec<f64>| {
        let points = data.iter().enumerate();
        let normalised: Vec<f64> = points
            .map(|(k, (_, mu, w))| (mu - value(&parameters, k)) * w.sqrt())
            .collect();
        Half {
            chi_square: normalised.iter().map(|e| e * e).sum(),
            parameters,
            variances,
            normalised,
        }
    };
    let Some(real) = real else {
        return Some(half(alone.parameters, alone.variances));
    };
    let system = |p: &DVector<f64>| {
        let count = own + 1;
        let (mut normal, mut gradient) = (DMatrix::zeros(count, count), DVector::zeros(count));
        let mut chi_square = 0.0;
        for (k, &(i, mu, w)) in data.iter().enumerate() {
            let mut slopes = law.gradient(&p.as_slice()[..own], i)?;
            slopes.push(real[k]);
            let slopes = DVector::from_vec(slopes);
            let miss = mu - value(p.as_slice(), k);
            normal.ger(w, &slopes, &slopes, 1.0);
            gradient.axpy(w * miss, &slopes, 1.0);
            chi_square += w * miss * miss;
        }
        f64::is_finite(chi_square).then_some((normal, gradient, chi_square))
    };
    let mut start = alone.parameters.clone();
    start.push(0.0);
    let solved = minimise(DVector::from_vec(start.clone()), 0.0, system);
    let with = solved.and_then(|(p, (normal, _, _))| {
        let variances = normal.try_inverse()?.diagonal();
        let told = variances.iter().all(|v| *v > 0.0 && v.is_finite());
        (told && p[own] > 0.0).then(|| half(p.as_slice().to_vec(), variances.as_slice().to_vec()))
    });
    Some(with.unwrap_or_else(|| {
        let mut variances = alone.variances;
        variances.push(f64::INFINITY);
        half(start, variances)
    }))
}

/// All candidates that can be fitted: each law of friction with each of [`Fraction::ALL`].
///
/// # Errors
/// As [`compare_laws`](super::compare_laws), and if φ(I) cannot be fitted.
pub fn compare_joint_laws(
    points: &[LocalPoint],
    stress: Stress,
) -> Result<JointComparison, FitError> {
    let mut data = checked_points(points, stress)?;
    let by_run = run_numbers(points);
    let runs = by_run.iter().max().map_or(0, |m| m + 1);

    let fraction_data = |slope: f64| -> Vec<(f64, f64, f64)> {
        let of = |p: &LocalPoint| {
            let error = p.solid_fraction_error.max(LEAST_FRACTION_ERROR);
            let variance = error * error + (slope * p.inertial_number_error).powi(2);
            (p.inertial_number, p.solid_fraction, 1.0 / variance)
        };
        points.iter().map(of).collect()
    };
    let first = fit_fraction::<2>(&fraction_data(0.0))?;
    let fractions = fraction_data(first.parameters[1]);
    let (level, line) = (
        fit_fraction::<1>(&fractions)?,
        fit_fraction::<2>(&fractions)?,
    );
    let variances: Vec<f64> = fractions.iter().map(|(_, _, w)| 1.0 / w).collect();
    let residuals: Vec<f64> = line
        .normalised
        .iter()
        .zip(&variances)
        .map(|(e, v)| e * v.sqrt())
        .collect();
    let (deviation, shares) = shares(&residuals, &variances, &by_run);

    if let Ok(jop) = solve(&data) {
        for ((point, local), share) in data.iter_mut().zip(points).zip(&shares) {
            let lever = slope(&jop.parameters, point.0) * line.parameters[1];
            point.1 += lever * local.inertial_number_error.powi(2) * share.by_chance;
        }
    }
    let real: Vec<f64> = shares.iter().map(|s| s.real).collect();
    let frictions: Vec<(Law, Half, Half)> = Law::ALL
        .into_iter()
        .filter_map(|law| {
            let plain = fit_friction(law, &data, None)?;
            Some((law, plain, fit_friction(law, &data, Some(&real))?))
        })
        .collect();
    let (_, _, richest) = frictions.last().ok_or(FitError::Degenerate)?;
    let scatter = [richest.scatter(&by_run), line.scatter(&by_run)];

    let mut alternatives = Vec::new();
    for (law, plain, with) in &frictions {
        for fraction in Fraction::ALL {
            let friction = match fraction {
                Fraction::Dilatancy => with,
                _ => plain,
            };
            let solid = match fraction {
                Fraction::Constant => &level,
                _ => &line,
            };
            let free = points.len().saturating_sub(friction.parameters.len());
            let own = (friction.chi_square / free.max(1) as f64).max(scatter[0]);
            let errors: Vec<f64> = friction
                .variances
                .iter()
                .map(|v| (v * own).sqrt())
                .collect();
            let count = plain.parameters.len();
            let last = friction.parameters.get(count).zip(errors.get(count));
            alternatives.push(JointAlternative {
                friction: *law,
                fraction,
                parameters: friction.parameters[..count].to_vec(),
                dilatancy: last
                    .filter(|(_, error)| error.is_finite())
                    .map(|(k, error)| [*k, *error]),
                errors: errors[..count].to_vec(),
                chi_square: [friction.chi_square, solid.chi_square],
                criterion: friction.criterion(scatter[0], runs) + solid.criterion(scatter[1], runs),
                weight: 0.0,
            });
        }
    }
    alternatives.sort_by(|a, b| a.criterion.total_cmp(&b.criterion));
    let criteria: Vec<f64> = alternatives.iter().map(|a| a.criterion).collect();
    for (alternative, weight) in alternatives.iter_mut().zip(weights(&criteria)) {
        alternative.weight = weight;
    }
    let weights = Fraction::ALL.map(|fraction| {
        let of = alternatives.iter().filter(|a| a.fraction == fraction);
        of.map(|a| a.weight).sum()
    });
    Ok(JointComparison {
        alternatives,
        weights,
        scatter,
        deviation,
    })
}
