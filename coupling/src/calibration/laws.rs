//! Friction laws that are compared with μ(I) of Jop et al.

mod deviation;
mod joint;

pub use deviation::Deviation;
pub use joint::{Fraction, JointAlternative, JointComparison, compare_joint_laws};

use super::least_squares::{FitError, levenberg_marquardt};
use super::mu_i::{Stress, between_runs, checked_points, run_numbers};
use super::points::LocalPoint;
use nalgebra::{SMatrix, SVector};
use serde::{Deserialize, Serialize};

/// A law of friction against the inertial number.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Law {
    /// μ = μ_s: Coulomb.
    Constant,
    /// μ = μ_s + b I (da Cruz et al. 2005): parameters μ_s, b.
    Linear,
    /// μ = μ_s + (μ_2 − μ_s)/(1 + I_0/I) (Jop et al. 2006): μ_s, μ_2, I_0.
    Jop,
    /// μ = (μ_s I_0 + μ_2 I + μ_∞ I²)/(I_0 + I) (Barker and Gray 2017, above their I_1): μ_s, μ_2, I_0, μ_∞.
    /// Rises without bound at high I where μ_∞ > 0, falls where it is negative.
    BarkerGray,
}

impl Law {
    /// All of them, the simplest first.
    pub const ALL: [Law; 4] = [Law::Constant, Law::Linear, Law::Jop, Law::BarkerGray];

    /// Names of the parameters.
    pub fn parameter_names(self) -> &'static [&'static str] {
        match self {
            Law::Constant => &["mu_s"],
            Law::Linear => &["mu_s", "b"],
            Law::Jop => &["mu_s", "mu_2", "i_0"],
            Law::BarkerGray => &["mu_s", "mu_2", "i_0", "mu_inf"],
        }
    }

    /// A name for people.
    pub fn title(self) -> &'static str {
        match self {
            Law::Constant => "constant (Coulomb)",
            Law::Linear => "linear",
            Law::Jop => "mu(I) of Jop et al.",
            Law::BarkerGray => "Barker and Gray, with mu_inf",
        }
    }

    /// μ at I; `parameters` in the order of [`Law::parameter_names`].
    pub fn friction(self, parameters: &[f64], i: f64) -> f64 {
        match (self, parameters) {
            (Law::Constant, [mu]) => *mu,
            (Law::Linear, [mu_s, b]) => mu_s + b * i,
            (Law::Jop, [mu_s, mu_2, i_0]) => mu_s + (mu_2 - mu_s) * i / (i + i_0),
            (Law::BarkerGray, [mu_s, mu_2, i_0, mu_inf]) => {
                (mu_s * i_0 + mu_2 * i + mu_inf * i * i) / (i + i_0)
            }
            _ => f64::NAN,
        }
    }

    /// ∂μ/∂(parameters) at I; `None` where the law has a pole at positive I.
    fn gradient(self, parameters: &[f64], i: f64) -> Option<Vec<f64>> {
        match (self, parameters) {
            (Law::Constant, _) => Some(vec![1.0]),
            (Law::Linear, _) => Some(vec![1.0, i]),
            (Law::Jop, [mu_s, mu_2, i_0]) if *i_0 > 0.0 => {
                let s = i / (i + i_0);
                Some(vec![1.0 - s, s, -(mu_2 - mu_s) * s / (i + i_0)])
            }
            (Law::BarkerGray, [mu_s, _, i_0, _]) if *i_0 > 0.0 => {
                let sum = i + i_0;
                let miss = (mu_s - self.friction(parameters, i)) / sum;
                Some(vec![i_0 / sum, i / sum, miss, i * i / sum])
            }
            _ => None,
        }
    }
}

/// A law fitted to the same points as the others.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Alternative {
    /// The law.
    pub law: Law,
    /// Best parameters, in the order of [`Law::parameter_names`].
    pub parameters: Vec<f64>,
    /// Their standard errors, widened as the scatter asks for.
    pub errors: Vec<f64>,
    /// Σ (μ − μ(I))²/σ², with the errors of I by the slope of Jop's fit, the same for all laws.
    pub chi_square: f64,
    /// Root-mean-square of μ − μ(I).
    pub rms_residual: f64,
    /// χ²/ĉ + 2k + 2k(k + 1)/(n − k − 1): Akaike's criterion for k parameters, corrected for few data and for data that
    /// scatter more than their errors say (Burnham and Anderson 2002, QAICc). The lowest is the best supported.
    pub criterion: f64,
    /// exp(−Δ/2) over its sum for all laws.
    pub weight: f64,
}

/// One law fitted to weighted points.
struct Fitted {
    parameters: Vec<f64>,
    variances: Vec<f64>,
    chi_square: f64,
}

fn fitted<const N: usize>(
    data: &[(f64, f64, f64)],
    start: [f64; N],
    law: impl Fn(&SVector<f64, N>, f64) -> Option<(f64, SVector<f64, N>)>,
) -> Result<Fitted, FitError> {
    let fit = levenberg_marquardt(data, SVector::from(start), law)?;
    let covariance: SMatrix<f64, N, N> = fit.covariance;
    Ok(Fitted {
        parameters: fit.parameters.iter().copied().collect(),
        variances: covariance.diagonal().iter().copied().collect(),
        chi_square: fit.chi_square,
    })
}

fn fit_law(law: Law, data: &[(f64, f64, f64)]) -> Result<Fitted, FitError> {
    let jop = || super::mu_i::solve(data);
    match law {
        Law::Constant => fitted(data, [0.5], |p, _| Some((p[0], SVector::from([1.0])))),
        Law::Linear => fitted(data, [0.4, 0.3], |p, i| {
            Some((p[0] + p[1] * i, SVector::from([1.0, i])))
        }),
        Law::Jop => jop().map(|fit| Fitted {
            parameters: fit.parameters.iter().copied().collect(),
            variances: fit.covariance.diagonal().iter().copied().collect(),
            chi_square: fit.chi_square,
        }),
        Law::BarkerGray => {
            let start = jop().map_or([0.4, 0.7, 0.3], |f| f.parameters.into());
            let [mu_s, mu_2, i_0] = start;
            fitted(data, [mu_s, mu_2, i_0, 0.0], |p, i| {
                let sum = i + p[2];
                let mu = (p[0] * p[2] + p[1] * i + p[3] * i * i) / sum;
                (p[2] > 0.0).then(|| {
                    let slope = [p[2] / sum, i / sum, (p[0] - mu) / sum, i * i / sum];
                    (mu, SVector::from(slope))
                })
            })
        }
    }
}

/// QAICc of χ²/ĉ with k parameters and n effective points.
fn criterion(chi_square: f64, k: f64, n: f64) -> f64 {
    chi_square + 2.0 * k + 2.0 * k * (k + 1.0) / (n - k - 1.0).max(1.0)
}

/// Akaike weights of criteria of which the first is the least.
fn weights(criteria: &[f64]) -> Vec<f64> {
    let best = criteria.first().copied().unwrap_or(0.0);
    let likelihood = |c: &f64| (-0.5 * (c - best)).exp();
    let sum: f64 = criteria.iter().map(likelihood).sum();
    criteria.iter().map(|c| likelihood(c) / sum).collect()
}

/// All laws that can be fitted, the best supported first.
///
/// The scatter ĉ is that of the richest law that could be fitted: χ² over its degrees of freedom or, where the runs
/// scatter more, as in [`fit_mu_i`](super::fit_mu_i); n is the number of points over ĉ, at least the number of runs.
///
/// # Errors
/// As [`fit_mu_i`](super::fit_mu_i); not if some law alone cannot be fitted.
pub fn compare_laws(points: &[LocalPoint], stress: Stress) -> Result<Vec<Alternative>, FitError> {
    let data = checked_points(points, stress)?;
    let by_run = run_numbers(points);
    let runs = by_run.iter().max().map_or(0, |m| m + 1);
    let fits: Vec<(Law, Fitted)> = Law::ALL
        .into_iter()
        .filter_map(|law| Some((law, fit_law(law, &data).ok()?)))
        .collect();
    let Some((richest, fit)) = fits.last() else {
        return Err(FitError::Degenerate);
    };
    let free = |k: usize| data.len().saturating_sub(k).max(1) as f64;
    let residual = |law: Law, p: &[f64], (i, mu, _): &(f64, f64, f64)| mu - law.friction(p, *i);
    let of_richest = data
        .iter()
        .map(|point| residual(*richest, &fit.parameters, point) * point.2.sqrt())
        .collect::<Vec<f64>>();
    let scatter = (fit.chi_square / free(fit.parameters.len())).max(1.0);
    let scatter = scatter.max(between_runs(&of_richest, &by_run, fit.parameters.len()));
    let effective = (data.len() as f64 / scatter).max(runs as f64);
    let mut list: Vec<Alternative> = fits
        .into_iter()
        .map(|(law, fit)| {
            let k = fit.parameters.len() as f64;
            let squares: f64 = data
                .iter()
                .map(|point| residual(law, &fit.parameters, point).powi(2))
                .sum();
            let own = (fit.chi_square / free(fit.parameters.len())).max(scatter);
            Alternative {
                law,
                errors: fit.variances.iter().map(|v| (v * own).sqrt()).collect(),
                chi_square: fit.chi_square,
                rms_residual: (squares / data.len() as f64).sqrt(),
                criterion: criterion(fit.chi_square / scatter, k, effective),
                weight: 0.0,
                parameters: fit.parameters,
            }
        })
        .collect();
    list.sort_by(|a, b| a.criterion.total_cmp(&b.criterion));
    let criteria: Vec<f64> = list.iter().map(|a| a.criterion).collect();
    for (alternative, weight) in list.iter_mut().zip(weights(&criteria)) {
        alternative.weight = weight;
    }
    Ok(list)
}
