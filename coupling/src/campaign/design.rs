//! Which slopes tell most about μ_s, μ_2 and I_0.
//!
//! A steady flow at θ has I = I_0 (tan θ − μ_s)/(μ_2 − tan θ) and gives one pair (I, μ) with the relative errors
//! `relative_i` and `relative_mu`. Its Fisher information on the law is g gᵀ/σ², with g = ∂μ/∂(μ_s, μ_2, I_0) at that I
//! and σ² = (relative_mu μ)² + (∂μ/∂I relative_i I)². A design is the better, the larger the determinant of the sum
//! over its slopes (D-optimal: the smallest volume of the confidence ellipsoid; Fedorov 1972). Slopes together with depths, at a
//! given cost: [`choose_flows`].

mod depths;

pub use depths::{Depths, Flow, choose_flows, cost, prospect_of_flows};

use super::GuessedLaw;
use nalgebra::{Matrix3, Vector3};

/// What is taken for granted about flows when slopes are chosen.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Precision {
    /// Relative standard error of μ of one flow.
    pub relative_mu: f64,
    /// Relative standard error of I of one flow.
    pub relative_i: f64,
}

impl Default for Precision {
    /// 1 % and 5 %: what flows of 50 √(d/g) on 12 d × 6 d scatter by between beds.
    fn default() -> Self {
        Self {
            relative_mu: 0.01,
            relative_i: 0.05,
        }
    }
}

/// Information of one flow; `shift` is a standard error of μ beside those of `precision`.
fn information(
    law: &GuessedLaw,
    precision: &Precision,
    shift: f64,
    slope_degrees: f64,
) -> Matrix3<f64> {
    let t = slope_degrees.to_radians().tan();
    if t <= law.mu_s || t >= law.mu_2 {
        return Matrix3::zeros();
    }
    let i = law.i_0 * (t - law.mu_s) / (law.mu_2 - t);
    let s = i / (i + law.i_0);
    let span = law.mu_2 - law.mu_s;
    let g = Vector3::new(1.0 - s, s, -span * i / (i + law.i_0).powi(2));
    let lever = span * law.i_0 / (i + law.i_0).powi(2) * precision.relative_i * i;
    let variance = (precision.relative_mu * t).powi(2) + lever * lever + shift * shift;
    g * g.transpose() / variance
}

/// What a design says about the law, if the guess is true.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Prospect {
    /// Standard errors of μ_s, μ_2 and I_0 to expect; infinite where the slopes do not determine the law.
    pub errors: [f64; 3],
    /// Determinant of the information.
    pub determinant: f64,
}

impl Prospect {
    fn of(sum: Matrix3<f64>) -> Self {
        // What rounding leaves of the determinant of a singular matrix is no information.
        let size: f64 = (0..3).map(|k| sum[(k, k)]).product();
        let determinant = Some(sum.determinant()).filter(|d| *d > 1e-11 * size);
        let determinant = determinant.unwrap_or(0.0);
        let errors = match sum.try_inverse() {
            Some(c) if determinant > 0.0 => std::array::from_fn(|k| c[(k, k)].max(0.0).sqrt()),
            _ => [f64::INFINITY; 3],
        };
        Self {
            errors,
            determinant,
        }
    }
}

/// What flows at the given slopes (degrees) would say.
pub fn prospect(law: &GuessedLaw, precision: &Precision, slopes: &[f64]) -> Prospect {
    let of = |slope: &f64| information(law, precision, 0.0, *slope);
    Prospect::of(slopes.iter().map(of).sum())
}

/// Slopes from `low` to `high` in steps of a quarter of a degree.
fn grid([low, high]: [f64; 2]) -> Vec<f64> {
    const GRID: f64 = 0.25;
    let steps = ((high - low) / GRID).floor().max(0.0) as usize;
    (0..=steps).map(|k| low + GRID * k as f64).collect()
}

/// The D-optimal choice of `count` slopes from `low` to `high` (degrees) at least `apart` from each other, on a grid of
/// a quarter of a degree: exchange of single slopes until none helps. Rising; fewer if there is no room.
pub fn choose_slopes(
    law: &GuessedLaw,
    precision: &Precision,
    [low, high]: [f64; 2],
    count: usize,
    apart: f64,
) -> Vec<f64> {
    let candidates = grid([low, high]);
    let room = 1 + ((high - low).max(0.0) / apart + 1e-9) as usize;
    let count = count.min(room);
    if count < 2 {
        return candidates.into_iter().take(count).collect();
    }
    let even = |k: usize| low + (high - low) * k as f64 / (count - 1) as f64;
    let mut chosen: Vec<f64> = (0..count).map(even).collect();
    let mut best = prospect(law, precision, &chosen).determinant;
    loop {
        let mut better = None;
        for place in 0..count {
            for candidate in &candidates {
                let clear =
                    |(k, s): (usize, &f64)| k == place || (s - candidate).abs() >= apart - 1e-9;
                if !chosen.iter().enumerate().all(clear) {
                    continue;
                }
                let mut trial = chosen.clone();
                trial[place] = *candidate;
                let determinant = prospect(law, precision, &trial).determinant;
                if determinant > best * (1.0 + 1e-9) {
                    (best, better) = (determinant, Some(trial));
                }
            }
        }
        match better {
            Some(trial) => chosen = trial,
            None => break,
        }
    }
    chosen.sort_by(f64::total_cmp);
    chosen
}

#[cfg(test)]
mod tests {
    use super::*;

    const LAW: GuessedLaw = GuessedLaw {
        mu_s: 0.45,
        mu_2: 0.95,
        i_0: 0.6,
    };

    #[test]
    fn chosen_slopes_beat_even_ones_and_keep_apart() {
        let precision = Precision::default();
        let range = [27.0, 37.0];
        let chosen = choose_slopes(&LAW, &precision, range, 6, 0.5);
        let even: Vec<f64> = (0..6).map(|k| 27.0 + 2.0 * f64::from(k)).collect();
        let (ours, theirs) = (
            prospect(&LAW, &precision, &chosen),
            prospect(&LAW, &precision, &even),
        );
        assert!(ours.determinant > 1.2 * theirs.determinant, "{chosen:?}");
        assert!(chosen.windows(2).all(|w| w[1] - w[0] > 0.499));
        assert!(chosen[0] >= 27.0 && chosen[5] <= 37.0);
        // Three parameters: two slopes alone leave them open, and so does a range without leverage.
        assert!(prospect(&LAW, &precision, &even[..2]).errors[0].is_infinite());
        let narrow = prospect(&LAW, &precision, &[30.0, 30.5, 31.0]);
        assert!(
            narrow.errors[1] > 5.0 * ours.errors[1],
            "{narrow:?} {ours:?}"
        );
    }

    #[test]
    fn errors_to_expect_are_those_of_a_linear_fit() {
        // Monte Carlo of the linearised problem at three slopes: exactly solvable.
        let precision = Precision {
            relative_mu: 0.01,
            relative_i: 0.0,
        };
        let found = prospect(&LAW, &precision, &[28.0, 32.0, 37.0]);
        // By hand: with as many slopes as parameters the covariance is J⁻¹ diag(σ²) J⁻ᵀ.
        let mut j = Matrix3::zeros();
        let mut sigma = Matrix3::zeros();
        for (row, slope) in [28.0f64, 32.0, 37.0].into_iter().enumerate() {
            let t = slope.to_radians().tan();
            let i = 0.6 * (t - 0.45) / (0.95 - t);
            let s = i / (i + 0.6);
            j.set_row(
                row,
                &nalgebra::RowVector3::new(1.0 - s, s, -0.5 * i / (i + 0.6).powi(2)),
            );
            sigma[(row, row)] = (0.01 * t).powi(2);
        }
        let inverse = j.try_inverse().unwrap();
        let covariance = inverse * sigma * inverse.transpose();
        for k in 0..3 {
            assert!((found.errors[k] / covariance[(k, k)].sqrt() - 1.0).abs() < 1e-8);
        }
    }

    #[test]
    fn little_room_gives_fewer_slopes() {
        let precision = Precision::default();
        assert_eq!(
            choose_slopes(&LAW, &precision, [30.0, 31.0], 9, 0.5).len(),
            3
        );
        assert_eq!(
            choose_slopes(&LAW, &precision, [30.0, 30.0], 9, 0.5),
            [30.0]
        );
    }
}
