//! Where flow begins, when beds of the same material differ: some flow at a slope and others do not.
//!
//! A bed flows at θ with the probability Φ((θ − θ_c)/w). θ_c is what is asked for; the spread w between beds is not
//! known, and is averaged over (flat in ln w from 0.2° to 3°), with θ_c flat over the slopes tried and one spread
//! beyond. One bed a slope thus leaves an honest ±2°, and more beds narrow it.

use serde::{Deserialize, Serialize};
use statrs::distribution::{ContinuousCDF, Normal};

/// One slope at which beds were tried.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Trial {
    /// Slope (degrees).
    pub slope_degrees: f64,
    /// Beds that flowed.
    pub flowed: u64,
    /// Beds tried.
    pub tried: u64,
}

/// The slope where half of the beds flow.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Threshold {
    /// θ_c (degrees).
    pub degrees: f64,
    /// Its standard error (degrees).
    pub error: f64,
    /// Spread between beds w (degrees), its posterior mean.
    pub spread: f64,
    /// Thickness of the layer (m): of the beds at rest.
    pub height: f64,
    /// What was tried, by rising slope.
    pub trials: Vec<Trial>,
}

/// Smallest and largest spread thought of (degrees).
const SPREAD: (f64, f64) = (0.2, 3.0);
/// Grid of θ_c and of ln w.
const GRID: (usize, usize) = (240, 24);

/// The threshold from outcomes (slope in degrees, flows); `None` unless some flowed and some did not.
pub fn threshold(outcomes: &[(f64, bool)], height: f64) -> Option<Threshold> {
    let mut trials: Vec<Trial> = Vec::new();
    for &(slope_degrees, flows) in outcomes {
        let known = trials.iter().position(|t| t.slope_degrees == slope_degrees);
        let at = known.unwrap_or_else(|| {
            trials.push(Trial {
                slope_degrees,
                flowed: 0,
                tried: 0,
            });
            trials.len() - 1
        });
        trials[at].flowed += u64::from(flows);
        trials[at].tried += 1;
    }
    trials.sort_by(|a, b| a.slope_degrees.total_cmp(&b.slope_degrees));
    let flowed = trials.iter().any(|t| t.flowed > 0);
    let rested = trials.iter().any(|t| t.flowed < t.tried);
    if !flowed || !rested {
        return None;
    }
    let low = trials.first()?.slope_degrees - SPREAD.1;
    let high = trials.last()?.slope_degrees + SPREAD.1;
    let normal = Normal::standard();
    let (mut sum, mut first, mut second, mut spread_sum) = (0.0, 0.0, 0.0, 0.0);
    let mut grid = Vec::with_capacity(GRID.0 * GRID.1);
    for a in 0..GRID.0 {
        let theta = low + (high - low) * (a as f64 + 0.5) / GRID.0 as f64;
        for b in 0..GRID.1 {
            let w = SPREAD.0 * (SPREAD.1 / SPREAD.0).powf((b as f64 + 0.5) / GRID.1 as f64);
            let mut log = 0.0;
            for t in &trials {
                let p = normal
                    .cdf((t.slope_degrees - theta) / w)
                    .clamp(1e-9, 1.0 - 1e-9);
                log += t.flowed as f64 * p.ln() + (t.tried - t.flowed) as f64 * (1.0 - p).ln();
            }
            grid.push((theta, w, log));
        }
    }
    let peak = grid.iter().map(|g| g.2).fold(f64::NEG_INFINITY, f64::max);
    for (theta, w, log) in grid {
        let p = (log - peak).exp();
        sum += p;
        first += p * theta;
        second += p * theta * theta;
        spread_sum += p * w;
    }
    let mean = first / sum;
    Some(Threshold {
        degrees: mean,
        error: (second / sum - mean * mean).max(0.0).sqrt(),
        spread: spread_sum / sum,
        height,
        trials,
    })
}

/// h_stop(θ): thickness against the slope at which layers of that thickness stop, and the length it gives to a non-local
/// rheology. A layer on a rough base under a free surface stops where its thickness is a quarter of the wave length of
/// the fluidity's neutral mode, h_stop = (π/2) ξ with the cooperativity length ξ = A d/√(tan θ − μ_s) at small I
/// (Kamrin and Henann, Soft Matter 11 (2015) 179).
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct NonLocal {
    /// Non-local amplitude A.
    pub amplitude: f64,
    /// Friction at which even the thickest layers stop, tan θ_1.
    pub tangent: f64,
    /// Root-mean-square of tan θ_stop about the curve.
    pub rms_residual: f64,
}

/// Least squares of tan θ_stop = tan θ_1 + (π A d/(2h))² over thresholds of at least three thicknesses.
pub fn non_local_length(thresholds: &[Threshold], diameter: f64) -> Option<NonLocal> {
    if thresholds.len() < 3 {
        return None;
    }
    // Linear in tan θ_1 and A².
    let (mut s, mut sx, mut sxx, mut sy, mut sxy) = (0.0, 0.0, 0.0, 0.0, 0.0);
    let rows: Vec<[f64; 3]> = thresholds
        .iter()
        .map(|t| {
            let x = (std::f64::consts::FRAC_PI_2 * diameter / t.height).powi(2);
            let slope = t.degrees.to_radians();
            // d tan θ = dθ/cos²θ.
            let error = (t.error.to_radians() / slope.cos().powi(2)).max(1e-4);
            [x, slope.tan(), 1.0 / (error * error)]
        })
        .collect();
    for [x, y, w] in &rows {
        s += w;
        sx += w * x;
        sxx += w * x * x;
        sy += w * y;
        sxy += w * x * y;
    }
    let determinant = s * sxx - sx * sx;
    if determinant <= 1e-12 * s * sxx {
        return None;
    }
    let square = (s * sxy - sx * sy) / determinant;
    let tangent = (sy - square * sx) / s;
    let misses = rows
        .iter()
        .map(|[x, y, _]| (y - tangent - square * x).powi(2));
    Some(NonLocal {
        // Thin layers that flow more easily than thick ones have no such length.
        amplitude: square.max(0.0).sqrt(),
        tangent,
        rms_residual: (misses.sum::<f64>() / rows.len() as f64).sqrt(),
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;
    use rand_distr::StandardNormal;

    #[test]
    fn errors_cover_the_truth_and_shrink_with_beds() {
        let mut rng = ChaCha8Rng::seed_from_u64(4);
        for (beds, largest) in [(1, 2.2), (4, 1.0), (12, 0.6)] {
            let draws = 60;
            let (mut inside, mut error) = (0.0, 0.0);
            for _ in 0..draws {
                let truth = rng.random_range(26.0..30.0);
                let mut outcomes = Vec::new();
                // A bisection by the majority of beds, each with a threshold of its own.
                let (mut low, mut high) = (24.0, 32.0);
                for _ in 0..4 {
                    let slope = 0.5 * (low + high);
                    let mut flowed = 0;
                    for _ in 0..beds {
                        let own = truth + rng.sample::<f64, _>(StandardNormal);
                        outcomes.push((slope, slope > own));
                        flowed += usize::from(slope > own);
                    }
                    if 2 * flowed > beds {
                        high = slope;
                    } else {
                        low = slope;
                    }
                }
                outcomes.extend([(24.0, false), (32.0, true)]);
                let found = threshold(&outcomes, 1.0).unwrap();
                inside += f64::from(u8::from((found.degrees - truth).abs() < found.error))
                    / f64::from(draws);
                error += found.error / f64::from(draws);
            }
            println!("{beds} beds: error {error:.2}°, covers {inside:.2}");
            assert!(
                error < largest && (0.5..0.95).contains(&inside),
                "{beds} {error} {inside}"
            );
        }
        assert!(threshold(&[(20.0, false), (25.0, false)], 1.0).is_none());
    }

    #[test]
    fn a_curve_of_stops_gives_its_length_back() {
        let (amplitude, tangent, diameter) = (0.5, 0.42, 0.01);
        let list: Vec<Threshold> = [5.0, 8.0, 12.0, 24.0]
            .iter()
            .map(|n| {
                let height: f64 = n * diameter;
                let x = std::f64::consts::FRAC_PI_2 * amplitude * diameter / height;
                Threshold {
                    degrees: (tangent + x * x).atan().to_degrees(),
                    error: 0.5,
                    spread: 1.0,
                    height,
                    trials: Vec::new(),
                }
            })
            .collect();
        let found = non_local_length(&list, diameter).unwrap();
        assert!(
            (found.amplitude / amplitude - 1.0).abs() < 1e-9
                && (found.tangent - tangent).abs() < 1e-9
        );
        assert!(non_local_length(&list[..2], diameter).is_none());
    }
}
