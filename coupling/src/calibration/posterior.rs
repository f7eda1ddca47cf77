//! Samples of the posterior of (μ_s, μ_2, I_0), to be carried into predictions.
//!
//! Likelihood: Gauss' in μ with the effective variance σ² = σ_μ² + (∂μ/∂I)² σ_I² of each point, which depends on the
//! parameters, all of it over the square of the fit's `error_scale` (layers of a run are not independent). Prior: flat
//! in μ_a and μ_b, the friction at the two ends of the data, and in ln I_0, where μ_s ≥ 0 and μ_2 > μ_s, I_0 within a factor of
//! 100 beyond the range of I of the data: what the data do not say stays bounded, and is seen to be only that. (Flat in
//! μ_2 − μ_s instead, laws that are straight through the data would weigh as I_0, and its bound would say what comes out.)
//!
//! μ_2 and I_0 lie along a bent valley, which a random walk follows slowly. So the valley is laid out first ([`Valley`]) and
//! whole samples are proposed from it and taken by the rule of Metropolis and Hastings for proposals that do not depend on
//! where the chain is (Tierney 1994), the random numbers seeded. Where the scale of the errors is known from ν degrees of
//! freedom only, each sample is moved away from the median of (μ_a, μ_b, ln I_0), along the valley, by √(ν/χ²), χ² drawn with ν
//! degrees: Student's tails.

mod valley;

use super::mu_i::{MuIFit, ONE_SIGMA, friction, mu_of_i};
use super::points::LocalPoint;
use crate::steady_state::autocorrelation_time;
use nalgebra::Vector3;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{ChiSquared, Distribution};
use serde::{Deserialize, Serialize};
use statrs::distribution::{ContinuousCDF, StudentsT};
use valley::Valley;

/// Samples and what they say.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Posterior {
    /// (μ_s, μ_2, I_0) of each sample.
    pub samples: Vec<[f64; 3]>,
    /// Quantiles 0.025, 0.16, 0.5, 0.84, 0.975 of each parameter.
    pub quantiles: [[f64; 5]; 3],
    /// Share of proposals that were taken.
    pub acceptance: f64,
    /// Independent samples that the least mixed parameter's are worth.
    pub effective_samples: f64,
}

/// Samples kept.
const KEPT: usize = 1000;
/// Proposals between kept samples.
const THINNING: usize = 5;
/// Proposals before the first.
const BURN_IN: usize = 100;
/// How far I_0 may lie outside the data, as a factor.
const BEYOND_DATA: f64 = 100.0;

/// The law as the chain sees it: friction at the two ends of the data, and ln I_0.
type Walker = Vector3<f64>;

/// (μ_s, μ_2, I_0) for the ends of the data.
fn law(w: &Walker, ends: [f64; 2]) -> [f64; 3] {
    let i_0 = w[2].exp();
    let [a, b] = ends.map(|i| i / (i + i_0));
    let span = (w[1] - w[0]) / (b - a);
    let mu_s = w[0] - span * a;
    [mu_s, mu_s + span, i_0]
}

/// Samples the posterior of a fit from the points it was made from; the same seed gives the same samples.
pub fn sample_posterior(points: &[LocalPoint], fit: &MuIFit, seed: u64) -> Option<Posterior> {
    if !fit.physical || points.is_empty() {
        return None;
    }
    let student = fit.scale_freedom.and_then(|nu| {
        Some((
            nu,
            StudentsT::new(0.0, 1.0, nu).ok()?.inverse_cdf(ONE_SIGMA),
        ))
    });
    let narrowed = fit.error_scale / student.map_or(1.0, |(_, quantile)| quantile);
    let temperature = narrowed * narrowed;
    let ends = fit.valid_i;
    let limits = [(ends[0] / BEYOND_DATA).ln(), (ends[1] * BEYOND_DATA).ln()];
    let log_posterior = |w: &Walker| {
        let [mu_s, mu_2, i_0] = law(w, ends);
        let allowed = mu_s >= 0.0 && mu_2 > mu_s && (limits[0]..=limits[1]).contains(&w[2]);
        if !allowed {
            return f64::NEG_INFINITY;
        }
        let mut sum = 0.0;
        for p in points {
            let (mu, error) = friction(fit.stress, p);
            let i = p.inertial_number;
            let lever = (mu_2 - mu_s) * i_0 / ((i + i_0) * (i + i_0)) * p.inertial_number_error;
            let variance = error * error + lever * lever;
            let miss = mu - mu_of_i(mu_s, mu_2, i_0, i);
            sum -= 0.5 * (miss * miss / variance + variance.ln());
        }
        sum / temperature
    };
    let data: Vec<[f64; 4]> = points
        .iter()
        .map(|p| {
            let (mu, error) = friction(fit.stress, p);
            [p.inertial_number, mu, error, p.inertial_number_error]
        })
        .collect();
    let valley = Valley::of(&data, fit, limits, temperature)?;
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    // Height above the proposals: what the chain is to be moved by.
    let above = |w: &Walker| log_posterior(w) - valley.log_density(w);
    let [mu_a, mu_b] = ends.map(|i| mu_of_i(fit.mu_s, fit.mu_2, fit.i_0, i));
    let mut here = Vector3::new(mu_a, mu_b, fit.i_0.ln().clamp(limits[0], limits[1]));
    let mut height = above(&here);
    let mut samples = Vec::with_capacity(KEPT);
    let (mut taken, steps) = (0usize, BURN_IN + KEPT * THINNING);
    for step in 0..steps {
        let trial = valley.draw(&mut rng);
        let value = above(&trial);
        if rng.random_range(0.0..1.0f64).ln() < value - height {
            (here, height) = (trial, value);
            taken += 1;
        }
        if step >= BURN_IN && (step - BURN_IN) % THINNING == THINNING - 1 {
            samples.push(here);
        }
    }
    let acceptance = taken as f64 / steps as f64;
    let effective = effective_samples(&samples);
    if let Some(chi_square) = student.and_then(|(nu, _)| ChiSquared::new(nu).ok()) {
        let nu = fit.scale_freedom.unwrap_or(1.0);
        let centre = Walker::from_fn(|k, _| quantile(&samples, |w| w[k], 0.5));
        for sample in &mut samples {
            // Until it is where the prior is; a walk that never gets there stays.
            for _ in 0..50 {
                let widened =
                    centre + (*sample - centre) * (nu / chi_square.sample(&mut rng)).sqrt();
                if log_posterior(&widened) > f64::NEG_INFINITY {
                    *sample = widened;
                    break;
                }
            }
        }
    }
    let samples: Vec<[f64; 3]> = samples.iter().map(|w| law(w, ends)).collect();
    Some(Posterior {
        quantiles: std::array::from_fn(|k| QUANTILES.map(|q| quantile(&samples, |s| s[k], q))),
        samples,
        acceptance,
        effective_samples: effective,
    })
}

/// Probabilities of the quantiles told.
const QUANTILES: [f64; 5] = [0.025, 0.16, 0.5, 0.84, 0.975];

/// A quantile of all samples: what overflows is the largest number there is, so that it counts; one that is not a number counts
/// as no value of what is asked for, and there is no quantile.
fn quantile<T>(samples: &[T], of: impl Fn(&T) -> f64, probability: f64) -> f64 {
    let mut values: Vec<f64> = samples.iter().map(of).collect();
    if values.iter().any(|x| x.is_nan()) {
        return f64::NAN;
    }
    for value in &mut values {
        *value = value.clamp(f64::MIN, f64::MAX);
    }
    values.sort_by(f64::total_cmp);
    let last = values.len().saturating_sub(1);
    values
        .get((last as f64 * probability).round() as usize)
        .copied()
        .unwrap_or(f64::NAN)
}

fn effective_samples(samples: &[Walker]) -> f64 {
    let n = samples.len() as f64;
    let of = |k: usize| {
        let mean = samples.iter().map(|s| s[k]).sum::<f64>() / n;
        let centred: Vec<f64> = samples.iter().map(|s| s[k] - mean).collect();
        n / autocorrelation_time(&centred)
    };
    (0..3).map(of).fold(f64::INFINITY, f64::min)
}

impl Posterior {
    /// Quantiles 0.025, 0.16, 0.5, 0.84 and 0.975 of anything that follows from the law (μ_s, μ_2, I_0); `None` where
    /// no sample gives a number.
    pub fn band(&self, of: impl Fn([f64; 3]) -> f64) -> Option<[f64; 5]> {
        let values: Vec<f64> = self.samples.iter().map(|s| of(*s)).collect();
        Self::quantiles_of(&values)
    }

    /// The same quantiles of numbers, one for each sample.
    pub(super) fn quantiles_of(values: &[f64]) -> Option<[f64; 5]> {
        let band = QUANTILES.map(|q| quantile(values, |x| *x, q));
        band[0].is_finite().then_some(band)
    }
}
