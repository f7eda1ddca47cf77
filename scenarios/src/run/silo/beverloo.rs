//! Rates of discharge, and the law of Beverloo through several of them.

/// C of round grains.
const C: f64 = 0.58;
/// k of round grains and sharp rims.
const K: f64 = 1.4;

/// W (kg/s) of an opening D over grains d (m), of a bulk density (kg/m³) under gravity (m/s²).
pub fn rate(opening: f64, d: f64, bulk: f64, gravity: f64) -> f64 {
    C * bulk * gravity.sqrt() * (opening - K * d).max(0.0).powf(2.5)
}

/// Rate of one opening.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Rate {
    /// Over the whole window (kg/s).
    pub mean: f64,
    /// Half the difference of its two halves.
    pub error: f64,
    /// Second half over first half, less 1.
    pub drift: f64,
}

/// Mass that may have left, at most, for a rate to count.
const SPENT: f64 = 0.6;
/// Rows of half a window, at least.
const ROWS: usize = 4;

impl Rate {
    /// From the mass that is left in time, without the first `start` seconds, until [`SPENT`] of it has gone.
    pub fn of(time: &[f64], mass: &[f64], start: f64) -> Option<Rate> {
        let whole = *mass.first()?;
        let rows: Vec<usize> = (0..time.len())
            .filter(|&k| time[k] >= start && mass[k] >= (1.0 - SPENT) * whole)
            .collect();
        if rows.len() < 2 * ROWS + 1 {
            return None;
        }
        let slope = |rows: &[usize]| {
            let n = rows.len() as f64;
            let (t, m) = rows
                .iter()
                .fold((0.0, 0.0), |(t, m), &k| (t + time[k] / n, m + mass[k] / n));
            let (up, down) = rows.iter().fold((0.0, 0.0), |(up, down), &k| {
                let dt = time[k] - t;
                (up + dt * (mass[k] - m), down + dt * dt)
            });
            -up / down
        };
        let (first, second) = rows.split_at(rows.len() / 2);
        let [mean, first, second] = [slope(&rows), slope(first), slope(second)];
        (first > 0.0 && second > 0.0).then_some(Rate {
            mean,
            error: 0.5 * (second - first).abs(),
            drift: second / first - 1.0,
        })
    }
}

/// Beverloo's law through several openings.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Fit {
    /// k, with the exponent 5/2.
    pub k: f64,
    /// What the scatter of the rates about the line leaves open in it.
    pub k_error: f64,
    /// C, with the exponent 5/2.
    pub c: f64,
    /// Its error.
    pub c_error: f64,
    /// Exponent of D - 1.4 d.
    pub exponent: f64,
    /// Exponent of D.
    pub bare: f64,
}

/// A straight line through points: intercept, slope, and the variance of the residuals over Σ (x - x̄)².
fn line(points: &[(f64, f64)]) -> [f64; 3] {
    let n = points.len() as f64;
    let (x, y) = points
        .iter()
        .fold((0.0, 0.0), |(x, y), p| (x + p.0 / n, y + p.1 / n));
    let xx: f64 = points.iter().map(|p| (p.0 - x).powi(2)).sum();
    let slope = points.iter().map(|p| (p.0 - x) * (p.1 - y)).sum::<f64>() / xx;
    let left: f64 = points
        .iter()
        .map(|p| (p.1 - y - slope * (p.0 - x)).powi(2))
        .sum();
    [y - slope * x, slope, left / (n - 2.0).max(1.0) / xx]
}

/// Fits rates of openings, each with its bulk density, to the law; needs three.
///
/// ```text
/// (W/(ρ_b √g))^{2/5} = C^{2/5} (D - k d)
/// ```
pub fn fit(rates: &[(f64, Rate, f64)], d: f64, gravity: f64) -> Option<Fit> {
    if rates.len() < 3 {
        return None;
    }
    let scaled = |&(opening, rate, bulk): &(f64, Rate, f64)| {
        (
            opening / d,
            rate.mean / (bulk * gravity.sqrt() * d.powf(2.5)),
        )
    };
    let points: Vec<(f64, f64)> = rates.iter().map(scaled).collect();
    let straight: Vec<_> = points
        .iter()
        .map(|&(size, w)| (size, w.powf(0.4)))
        .collect();
    let [intercept, slope, variance] = line(&straight);
    let exponent = |k: f64| {
        let logs: Vec<_> = points
            .iter()
            .map(|&(size, w)| ((size - k).ln(), w.ln()))
            .collect();
        line(&logs)[1]
    };
    let (slope_error, k) = (variance.sqrt(), -intercept / slope);
    let middle = straight.iter().map(|p| p.0).sum::<f64>() / straight.len() as f64;
    Some(Fit {
        k,
        k_error: slope_error / slope * (middle - k).abs(),
        c: slope.powf(2.5),
        c_error: 2.5 * slope.powf(1.5) * slope_error,
        exponent: exponent(K),
        bare: exponent(0.0),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_straight_line_has_its_rate_and_no_drift() {
        let time: Vec<f64> = (0..100).map(f64::from).collect();
        let mass: Vec<f64> = time.iter().map(|t| (500.0 - 4.0 * t).max(0.0)).collect();
        let rate = Rate::of(&time, &mass, 5.0).unwrap();
        assert!(
            (rate.mean - 4.0).abs() < 1e-12 && rate.error < 1e-12,
            "{rate:?}"
        );
        // A liquid's rate falls with the root of its height.
        let liquid: Vec<f64> = time
            .iter()
            .map(|t| 500.0 * (1.0 - t / 125.0).powi(2))
            .collect();
        assert!(Rate::of(&time, &liquid, 5.0).unwrap().drift < -0.1);
        // Clogged.
        assert_eq!(Rate::of(&time, &[500.0; 100], 5.0), None);
        assert_eq!(Rate::of(&time[..5], &mass[..5], 0.0), None);
    }

    #[test]
    fn the_law_is_found_again_and_bare_openings_have_another_exponent() {
        let (d, bulk, g) = (0.004, 1500.0, 9.81);
        let of = |size: f64| {
            let mean = rate(size * d, d, bulk, g);
            let (error, drift) = (0.0, 0.0);
            (size * d, Rate { mean, error, drift }, bulk)
        };
        let rates: Vec<_> = [4.0, 5.0, 7.0, 9.0].map(of).to_vec();
        let found = fit(&rates, d, g).unwrap();
        assert!(
            (found.k - K).abs() < 1e-10 && (found.c - C).abs() < 1e-10,
            "{found:?}"
        );
        assert!((found.exponent - 2.5).abs() < 1e-10 && found.k_error < 1e-6);
        assert!(found.bare > 3.0, "{found:?}");
        assert_eq!(fit(&rates[..2], d, g), None);
    }
}
