//! Where the law can be: proposals for the samples of the posterior.
//!
//! For given I_0 the law is linear in μ_s and μ_2, and its friction at the two ends of the data, μ_a and μ_b, is nearly the
//! same for every I_0: in (μ_a, μ_b, ln I_0) the bent valley of μ_2 and I_0 is straight. ln I_0 is cut into cells; in each, the
//! least squares of the points with the cell's I_0 give a Gauss of (μ_a, μ_b), and its integral under the prior the cell's
//! probability:
//!
//! > ln P = −χ²/2T − Σ ln σ²/2T + ½ ln |C|,
//!
//! T the square of the error scale, C the covariance. Wider by [`WIDER`] and with a share [`ANYWHERE`] of the probability spread
//! over all cells alike, so that the proposals have the longer tails.

use super::{MuIFit, Walker};
use nalgebra::{Matrix2, Vector2};
use rand::{Rng, RngExt};
use rand_distr::StandardNormal;

/// Cells of ln I_0.
const CELLS: usize = 960;
/// Standard deviations of the proposals over those of the cells.
const WIDER: f64 = 1.15;
/// Share of the proposals that may be in any cell.
const ANYWHERE: f64 = 0.02;

/// One cell of ln I_0.
struct Cell {
    probability: f64,
    mean: Vector2<f64>,
    /// Lower Cholesky factor of the covariance of (μ_a, μ_b), widened.
    factor: Matrix2<f64>,
}

/// The cells from one end of ln I_0 to the other.
pub(super) struct Valley {
    limits: [f64; 2],
    cells: Vec<Cell>,
    cumulative: Vec<f64>,
}

impl Valley {
    /// From points (I, μ, σ_μ, σ_I); `None` where no cell determines the friction at the ends.
    pub(super) fn of(
        points: &[[f64; 4]],
        fit: &MuIFit,
        limits: [f64; 2],
        temperature: f64,
    ) -> Option<Self> {
        let ends = fit.valid_i;
        let width = (limits[1] - limits[0]) / CELLS as f64;
        let found: Vec<Option<(f64, Cell)>> = (0..CELLS)
            .map(|k| {
                let i_0 = (limits[0] + (k as f64 + 0.5) * width).exp();
                cell(points, fit, ends, i_0, temperature)
            })
            .collect();
        let highest = found
            .iter()
            .flatten()
            .map(|(log, _)| *log)
            .fold(f64::NEG_INFINITY, f64::max);
        if !highest.is_finite() {
            return None;
        }
        let sum: f64 = found.iter().flatten().map(|f| (f.0 - highest).exp()).sum();
        let known = found.iter().flatten().count() as f64;
        let mut cells = Vec::with_capacity(CELLS);
        for next in found {
            let (log, mut cell) = next.unwrap_or((f64::NEG_INFINITY, Cell::nothing()));
            if log.is_finite() {
                let own = (log - highest).exp() / sum;
                cell.probability = (1.0 - ANYWHERE) * own + ANYWHERE / known;
            }
            cells.push(cell);
        }
        let mut total = 0.0;
        let cumulative = cells
            .iter()
            .map(|c| {
                total += c.probability;
                total
            })
            .collect();
        Some(Self {
            limits,
            cells,
            cumulative,
        })
    }

    fn width(&self) -> f64 {
        (self.limits[1] - self.limits[0]) / CELLS as f64
    }

    /// A proposal.
    pub(super) fn draw(&self, rng: &mut impl Rng) -> Walker {
        let pick = rng.random_range(0.0..1.0f64) * self.cumulative[CELLS - 1];
        let k = self.cumulative.partition_point(|c| *c <= pick);
        let k = k.min(CELLS - 1);
        let cell = &self.cells[k];
        let log_i_0 = self.limits[0] + (k as f64 + rng.random_range(0.0..1.0f64)) * self.width();
        let normal = Vector2::from_fn(|_, _| rng.sample(StandardNormal));
        let at_ends = cell.mean + cell.factor * normal;
        Walker::new(at_ends[0], at_ends[1], log_i_0)
    }

    /// Logarithm of the proposals' density in (μ_a, μ_b, ln I_0), but for a constant.
    pub(super) fn log_density(&self, w: &Walker) -> f64 {
        let place = (w[2] - self.limits[0]) / self.width();
        let k = (place.max(0.0) as usize).min(CELLS - 1);
        let cell = &self.cells[k];
        if cell.probability <= 0.0 {
            return f64::NEG_INFINITY;
        }
        let off = Vector2::new(w[0], w[1]) - cell.mean;
        let f = &cell.factor;
        let first = off[0] / f[(0, 0)];
        let second = (off[1] - f[(1, 0)] * first) / f[(1, 1)];
        cell.probability.ln()
            - (f[(0, 0)] * f[(1, 1)]).ln()
            - 0.5 * (first * first + second * second)
    }
}

impl Cell {
    fn nothing() -> Self {
        Self {
            probability: 0.0,
            mean: Vector2::zeros(),
            factor: Matrix2::identity(),
        }
    }
}

/// ln P of a cell but for a constant, and its Gauss.
fn cell(
    points: &[[f64; 4]],
    fit: &MuIFit,
    ends: [f64; 2],
    i_0: f64,
    temperature: f64,
) -> Option<(f64, Cell)> {
    let share = |i: f64| i / (i + i_0);
    let [a, b] = ends.map(share);
    // The errors of I weigh by the slope: of the fit first, then of the cell's own law.
    let rise = |i: f64| (fit.mu_2 - fit.mu_s) * fit.i_0 / ((i + fit.i_0) * (i + fit.i_0));
    let (mean, _, _) = least_squares(points, rise, share, [a, b])?;
    let span = (mean[1] - mean[0]) / (b - a);
    let own = |i: f64| span * i_0 / ((i + i_0) * (i + i_0));
    let (mean, inverse, twice) = least_squares(points, own, share, [a, b])?;
    let covariance = inverse * temperature;
    let factor = covariance.cholesky()?.l();
    let size = factor[(0, 0)] * factor[(1, 1)];
    let log = -0.5 * twice / temperature + size.ln();
    log.is_finite().then(|| {
        let factor = factor * WIDER;
        let cell = Cell {
            probability: 0.0,
            mean,
            factor,
        };
        (log, cell)
    })
}

/// (μ_a, μ_b), their covariance, and χ² + Σ ln σ², for weights with the slope ∂μ/∂I.
fn least_squares(
    points: &[[f64; 4]],
    slope: impl Fn(f64) -> f64,
    share: impl Fn(f64) -> f64,
    [a, b]: [f64; 2],
) -> Option<(Vector2<f64>, Matrix2<f64>, f64)> {
    let (mut normal, mut right) = (Matrix2::zeros(), Vector2::zeros());
    let mut rows = Vec::with_capacity(points.len());
    for [i, mu, error, error_i] in points {
        let lever = slope(*i) * error_i;
        let variance = error * error + lever * lever;
        let between = (share(*i) - a) / (b - a);
        let row = Vector2::new(1.0 - between, between);
        normal += row * row.transpose() / variance;
        right += row * (mu / variance);
        rows.push((row, *mu, variance));
    }
    let inverse = normal.try_inverse()?;
    let best = inverse * right;
    let sum = rows
        .iter()
        .map(|(row, mu, variance)| (mu - row.dot(&best)).powi(2) / variance + variance.ln())
        .sum();
    Some((best, inverse, sum))
}
