//! Is a time series stationary? The test behind the words *steady* and *accelerating* in every result.
//!
//! 1. The start is cut by MSER-5 (White 1997): the series is averaged in batches of 5; the cut k minimises
//!    Var(x_k…x_n)/(n − k), searched over the first half.
//! 2. A straight line is fitted to the rest. Its residuals give the autocorrelation time by Geyer's (1992)
//!    initial positive sequence, τ = −1 + 2 Σ_m (ρ_2m + ρ_2m+1) over the leading positive pairs, and so the
//!    effective number of samples n/τ; the slope's standard error is widened by √τ.
//! 3. The drift b over the rest (slope × duration, relative to the mean) is tested by Student's t with
//!    n/τ − 2 degrees of freedom.
//!
//! The verdict is an equivalence test: *steady* asks for |drift| + its two-sided 95 % error to stay below a
//! tolerance, so a series that is short or noisy is *undecided*, never steady by lack of evidence.

use serde::{Deserialize, Serialize};
use statrs::distribution::{ContinuousCDF, StudentsT};

/// What the series does.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Trend {
    /// The drift is below the tolerance, and known to be.
    Steady,
    /// Rises by more than chance explains, and beyond the tolerance.
    Rising,
    /// Falls by more than chance explains, and beyond the tolerance.
    Falling,
    /// Too short or too noisy to tell.
    Undecided,
}

/// Figures of the test.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct SteadyTest {
    /// The verdict.
    pub trend: Trend,
    /// Where the start is cut (s).
    pub truncation_time: f64,
    /// Mean after the cut; 0 only if it is 0, the series is empty or holds a number that is not finite.
    pub mean: f64,
    /// Standard error of the mean, correlation included; 0 where the drift is not known.
    pub mean_error: f64,
    /// Were there samples enough, and a mean to compare with, for a drift? If not, the 0 in `drift` and
    /// `drift_error` says nothing.
    pub drift_known: bool,
    /// Change over the series after the cut, by the fitted line, relative to the mean; 0 if not known.
    pub drift: f64,
    /// Standard error of the drift; 0 if not known.
    pub drift_error: f64,
    /// Two-sided probability of such a drift by chance in a stationary series.
    pub p_value: f64,
    /// Effective number of independent samples after the cut.
    pub effective_samples: f64,
    /// Autocorrelation time (s).
    pub correlation_time: f64,
    /// Drift that still counts as steady.
    pub tolerance: f64,
}

/// Below this many effective samples nothing is decided.
const FEWEST_EFFECTIVE: f64 = 5.0;
/// Below this many samples after the cut the drift is not known.
const FEWEST_SAMPLES: usize = 20;
/// Samples of a series that are always enough for a drift: the cut takes half of them at most.
pub const ENOUGH_SAMPLES: usize = 2 * FEWEST_SAMPLES;
/// Significance level of the drift.
const LEVEL: f64 = 0.05;

/// Tests a series sampled every `interval` seconds; `tolerance` is the relative drift that still counts as
/// steady. See the module's text for the method.
pub fn steady_test(series: &[f64], interval: f64, tolerance: f64) -> SteadyTest {
    let cut = mser5_truncation(series);
    let rest = &series[cut..];
    let mut test = SteadyTest {
        trend: Trend::Undecided,
        truncation_time: cut as f64 * interval,
        mean: 0.0,
        mean_error: 0.0,
        drift_known: false,
        drift: 0.0,
        drift_error: 0.0,
        p_value: 1.0,
        effective_samples: 0.0,
        correlation_time: 0.0,
        tolerance,
    };
    let n = rest.len() as f64;
    let mean = rest.iter().sum::<f64>() / n;
    if !mean.is_finite() {
        return test;
    }
    test.mean = mean;
    if rest.len() < FEWEST_SAMPLES {
        return test;
    }
    // Abscissa t = (k − middle)/n, so that the slope is the change over the whole rest.
    let t = |k: usize| (k as f64 - 0.5 * (n - 1.0)) / n;
    let tt: f64 = (0..rest.len()).map(|k| t(k) * t(k)).sum();
    let slope = rest
        .iter()
        .enumerate()
        .map(|(k, x)| t(k) * (x - mean))
        .sum::<f64>()
        / tt;
    let residuals: Vec<f64> = rest
        .iter()
        .enumerate()
        .map(|(k, x)| x - mean - slope * t(k))
        .collect();
    let variance = residuals.iter().map(|r| r * r).sum::<f64>() / (n - 2.0);
    let tau = autocorrelation_time(&residuals);
    test.effective_samples = n / tau;
    test.correlation_time = tau * interval;
    test.mean_error = (variance * tau / n).sqrt();
    let slope_error = (variance * tau / tt).sqrt();
    let scale = if mean != 0.0 { mean.abs() } else { return test };
    test.drift = slope / scale;
    test.drift_error = slope_error / scale;
    test.drift_known = test.drift.is_finite() && test.drift_error.is_finite();
    if !test.drift_known {
        (test.drift, test.drift_error) = (0.0, 0.0);
        return test;
    }
    let freedom = (test.effective_samples - 2.0).max(1.0);
    let Ok(student) = StudentsT::new(0.0, 1.0, freedom) else {
        return test;
    };
    test.p_value = if slope_error > 0.0 {
        2.0 * student.cdf(-(slope / slope_error).abs())
    } else if slope == 0.0 {
        1.0
    } else {
        0.0
    };
    let reach = test.drift_error * student.inverse_cdf(1.0 - 0.5 * LEVEL);
    test.trend = if test.effective_samples < FEWEST_EFFECTIVE && variance > 0.0 {
        Trend::Undecided
    } else if test.drift.abs() + reach < tolerance {
        Trend::Steady
    } else if test.p_value < LEVEL && test.drift.abs() > tolerance {
        if slope > 0.0 {
            Trend::Rising
        } else {
            Trend::Falling
        }
    } else {
        Trend::Undecided
    };
    test
}

/// MSER-5 cut: how many leading samples to drop, at most half.
pub fn mser5_truncation(series: &[f64]) -> usize {
    let batches: Vec<f64> = series
        .chunks_exact(5)
        .map(|c| c.iter().sum::<f64>() / 5.0)
        .collect();
    let total = batches.len();
    let (mut count, mut mean, mut squares) = (0.0, 0.0, 0.0);
    let mut best = (f64::INFINITY, 0);
    // From the end: running mean and sum of squares of batches k…n.
    for k in (0..total).rev() {
        count += 1.0;
        let delta = batches[k] - mean;
        mean += delta / count;
        squares += delta * (batches[k] - mean);
        if k <= total / 2 && count >= 2.0 {
            let statistic = squares / (count * count);
            // `<=`: of equal cuts the earliest is taken.
            if statistic <= best.0 {
                best = (statistic, k);
            }
        }
    }
    5 * best.1
}

/// Integrated autocorrelation time, in samples, by the initial positive sequence; at least 1.
pub fn autocorrelation_time(centred: &[f64]) -> f64 {
    let n = centred.len();
    let covariance = |lag: usize| -> f64 {
        centred[..n - lag]
            .iter()
            .zip(&centred[lag..])
            .map(|(a, b)| a * b)
            .sum::<f64>()
            / n as f64
    };
    if n < 4 {
        return 1.0;
    }
    let variance = covariance(0);
    if variance <= 0.0 {
        return 1.0;
    }
    let mut sum = 0.0;
    let mut last = f64::INFINITY;
    let mut lag = 0;
    while lag + 1 < n {
        let pair = (covariance(lag) + covariance(lag + 1)) / variance;
        if pair <= 0.0 {
            break;
        }
        // Monotone version: pairs of a reversible chain never grow.
        last = pair.min(last);
        sum += last;
        lag += 2;
    }
    (2.0 * sum - 1.0).max(1.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;
    use rand_distr::StandardNormal;

    fn ar1(rng: &mut ChaCha8Rng, n: usize, a: f64, mean: f64, deviation: f64) -> Vec<f64> {
        let kick = deviation * (1.0 - a * a).sqrt();
        let mut x = deviation * rng.sample::<f64, _>(StandardNormal);
        (0..n)
            .map(|_| {
                x = a * x + kick * rng.sample::<f64, _>(StandardNormal);
                mean + x
            })
            .collect()
    }

    #[test]
    fn false_alarms_come_at_the_stated_rate() {
        let mut rng = ChaCha8Rng::seed_from_u64(1);
        let draws = 500;
        let (mut alarms, mut covered) = (0, 0);
        for _ in 0..draws {
            let test = steady_test(&ar1(&mut rng, 2000, 0.9, 10.0, 1.0), 0.1, 0.01);
            alarms += u32::from(test.p_value < 0.05);
            covered += u32::from((test.mean - 10.0).abs() < test.mean_error);
        }
        let rate = f64::from(alarms) / f64::from(draws);
        // MSER picks its cut after seeing the data: a little above the nominal 5 %.
        assert!((0.02..0.11).contains(&rate), "false alarms {rate}");
        let cover = f64::from(covered) / f64::from(draws);
        assert!((0.58..0.74).contains(&cover), "1σ coverage {cover}");
    }

    #[test]
    fn effective_samples_follow_theory() {
        // τ = (1 + a)/(1 − a) = 19 for a = 0.9.
        let mut rng = ChaCha8Rng::seed_from_u64(2);
        let mean: f64 = (0..50)
            .map(|_| autocorrelation_time(&ar1(&mut rng, 4000, 0.9, 0.0, 1.0)))
            .sum::<f64>()
            / 50.0;
        assert!((16.0..22.0).contains(&mean), "{mean}");
        let white = autocorrelation_time(&ar1(&mut rng, 4000, 0.0, 0.0, 1.0));
        assert!(white < 1.5, "{white}");
    }

    #[test]
    fn drifts_are_found_and_noise_is_not_called_steady() {
        let mut rng = ChaCha8Rng::seed_from_u64(3);
        let (mut steady, mut rising, mut falling) = (0, 0, 0);
        for _ in 0..100 {
            let flat = ar1(&mut rng, 2000, 0.8, 10.0, 0.3);
            let up: Vec<f64> = flat
                .iter()
                .enumerate()
                .map(|(k, x)| x + 1.5 * k as f64 / 2000.0)
                .collect();
            let down: Vec<f64> = flat
                .iter()
                .enumerate()
                .map(|(k, x)| x - 1.5 * k as f64 / 2000.0)
                .collect();
            steady += i32::from(steady_test(&flat, 0.1, 0.05).trend == Trend::Steady);
            rising += i32::from(steady_test(&up, 0.1, 0.05).trend == Trend::Rising);
            falling += i32::from(steady_test(&down, 0.1, 0.05).trend == Trend::Falling);
        }
        assert!(
            steady >= 95 && rising >= 90 && falling >= 90,
            "{steady} {rising} {falling}"
        );
        let short = ar1(&mut rng, 40, 0.9, 10.0, 1.0);
        assert_eq!(steady_test(&short, 0.1, 0.05).trend, Trend::Undecided);
        assert_eq!(steady_test(&[1.0; 7], 0.1, 0.05).trend, Trend::Undecided);
    }

    #[test]
    fn too_few_samples_leave_a_mean_but_no_drift() {
        let rising: Vec<f64> = (0..19).map(f64::from).collect();
        let test = steady_test(&rising[10..], 0.1, 0.05);
        assert!(!test.drift_known && test.mean > 10.0, "{test:?}");
        assert!(!steady_test(&[0.0; 100], 0.1, 0.05).drift_known);
        let empty = steady_test(&[], 0.1, 0.05);
        assert!(!empty.drift_known && empty.mean == 0.0, "{empty:?}");
        let broken = steady_test(&[f64::NAN; 100], 0.1, 0.05);
        assert!(!broken.drift_known && broken.mean == 0.0, "{broken:?}");
        // Wherever the cut falls, this many samples are enough.
        let mut rng = ChaCha8Rng::seed_from_u64(5);
        for extra in 0..10 {
            let noise = ar1(&mut rng, ENOUGH_SAMPLES + extra, 0.9, 10.0, 1.0);
            let late: Vec<f64> = (0..noise.len())
                .map(|k| if k < noise.len() / 2 { 0.0 } else { 1.0 })
                .collect();
            assert!(steady_test(&noise, 0.1, 0.05).drift_known);
            assert!(steady_test(&late, 0.1, 0.05).drift_known);
        }
    }

    #[test]
    fn the_start_is_cut() {
        let mut rng = ChaCha8Rng::seed_from_u64(4);
        let series: Vec<f64> = ar1(&mut rng, 2000, 0.7, 10.0, 0.2)
            .iter()
            .enumerate()
            .map(|(k, x)| x - 8.0 * (-(k as f64) / 80.0).exp())
            .collect();
        let test = steady_test(&series, 0.1, 0.03);
        assert!((12.0..80.0).contains(&test.truncation_time), "{test:?}");
        assert_eq!(test.trend, Trend::Steady);
        assert!((test.mean - 10.0).abs() < 4.0 * test.mean_error);
    }
}
