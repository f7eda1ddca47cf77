//! A table μ(I) of no given form: the least squares under the constraints that friction never falls with I and, if
//! asked for, never bends upwards. Solved as a quadratic program by `clarabel`.

use super::least_squares::FitError;
use super::mu_i::{Stress, checked_points};
use super::points::LocalPoint;
use clarabel::algebra::CscMatrix;
use clarabel::solver::{
    DefaultSettingsBuilder, DefaultSolver, IPSolver, NonnegativeConeT, SolverStatus,
};
use serde::{Deserialize, Serialize};

/// Friction at knots, linear in between.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct FreeForm {
    /// I of the knots, rising.
    pub inertial_number: Vec<f64>,
    /// μ there.
    pub friction: Vec<f64>,
    /// Was the curve held to bend downwards only?
    pub concave: bool,
    /// Σ (μ − μ(I))²/σ².
    pub chi_square: f64,
    /// Root-mean-square of μ − μ(I).
    pub rms_residual: f64,
    /// Constraints that bind: there the data would rather fall or bend the other way.
    pub binding: usize,
}

impl FreeForm {
    /// μ at I, constant outside the knots.
    pub fn friction_at(&self, i: f64) -> f64 {
        let knots = &self.inertial_number;
        let last = knots.len() - 1;
        if i <= knots[0] {
            return self.friction[0];
        }
        if i >= knots[last] {
            return self.friction[last];
        }
        let k = knots.partition_point(|x| *x <= i) - 1;
        let t = (i - knots[k]) / (knots[k + 1] - knots[k]);
        self.friction[k] + t * (self.friction[k + 1] - self.friction[k])
    }
}

/// The table with the given number of knots, at equal steps of ln I over the data.
///
/// # Errors
/// As [`fit_mu_i`](super::fit_mu_i); [`FitError::Degenerate`] also if the program is not solved or there are fewer than
/// 2 knots or more than points.
pub fn fit_free_form(
    points: &[LocalPoint],
    stress: Stress,
    knots: usize,
    concave: bool,
) -> Result<FreeForm, FitError> {
    let data = checked_points(points, stress)?;
    if knots < 2 || knots > data.len() {
        return Err(FitError::Degenerate);
    }
    let low = data.iter().map(|d| d.0).fold(f64::INFINITY, f64::min);
    let high = data.iter().map(|d| d.0).fold(0.0, f64::max);
    if high <= low * (1.0 + 1e-9) {
        return Err(FitError::Degenerate);
    }
    let ratio = (high / low).ln() / (knots - 1) as f64;
    let mut at: Vec<f64> = (0..knots).map(|k| low * (ratio * k as f64).exp()).collect();
    at[knots - 1] = high;
    // Weights differ by decades: scaled by their mean, so that the solver's tolerances mean something.
    let mean = data.iter().map(|d| d.2).sum::<f64>() / data.len() as f64;
    // Normal matrix of hat functions, with a little of the second difference: a knot without data lies on the line
    // between its neighbours.
    let mut normal = vec![vec![0.0; knots]; knots];
    let mut right = vec![0.0; knots];
    for &(i, mu, weight) in &data {
        let k = (at.partition_point(|x| *x <= i).max(1) - 1).min(knots - 2);
        let t = ((i - at[k]) / (at[k + 1] - at[k])).clamp(0.0, 1.0);
        for (a, share) in [(k, 1.0 - t), (k + 1, t)] {
            right[a] += weight / mean * share * mu;
            for (b, other) in [(k, 1.0 - t), (k + 1, t)] {
                normal[a][b] += weight / mean * share * other;
            }
        }
    }
    const SMOOTHING: f64 = 1e-6;
    for k in 1..knots - 1 {
        let row = [(k - 1, 1.0), (k, -2.0), (k + 1, 1.0)];
        for (a, x) in row {
            for (b, y) in row {
                normal[a][b] += SMOOTHING * x * y;
            }
        }
    }
    for (k, row) in normal.iter_mut().enumerate() {
        row[k] += 1e-12;
        // clarabel reads the upper triangle.
        row[..k].fill(0.0);
    }
    let mut constraints: Vec<Vec<f64>> = Vec::new();
    for k in 0..knots - 1 {
        let mut row = vec![0.0; knots];
        (row[k], row[k + 1]) = (1.0, -1.0);
        constraints.push(row);
    }
    if concave {
        for k in 1..knots - 1 {
            let (before, after) = (at[k] - at[k - 1], at[k + 1] - at[k]);
            let mut row = vec![0.0; knots];
            // (μ_{k+1} − μ_k)/after − (μ_k − μ_{k−1})/before ≤ 0, times before.
            row[k - 1] = 1.0;
            row[k] = -1.0 - before / after;
            row[k + 1] = before / after;
            constraints.push(row);
        }
    }
    let p = CscMatrix::from(&normal);
    let a = CscMatrix::from(&constraints);
    let q: Vec<f64> = right.iter().map(|x| -x).collect();
    let b = vec![0.0; constraints.len()];
    let cones = [NonnegativeConeT(constraints.len())];
    let settings = DefaultSettingsBuilder::default()
        .verbose(false)
        .max_threads(1)
        .tol_gap_abs(1e-10)
        .tol_gap_rel(1e-10)
        .tol_feas(1e-10)
        .build()
        .map_err(|_| FitError::Degenerate)?;
    let mut solver =
        DefaultSolver::new(&p, &q, &a, &b, &cones, settings).map_err(|_| FitError::Degenerate)?;
    solver.solve();
    if !matches!(
        solver.solution.status,
        SolverStatus::Solved | SolverStatus::AlmostSolved
    ) {
        return Err(FitError::Degenerate);
    }
    let binding = solver.solution.s.iter().filter(|s| **s < 1e-7).count();
    let mut table = FreeForm {
        inertial_number: at,
        friction: solver.solution.x.clone(),
        concave,
        chi_square: 0.0,
        rms_residual: 0.0,
        binding,
    };
    // The solver stays a hair's breadth off the constraints: a table must keep them to the bit.
    for k in 1..knots {
        table.friction[k] = table.friction[k].max(table.friction[k - 1]);
    }
    let mut squares = 0.0;
    for &(i, mu, weight) in &data {
        let miss = mu - table.friction_at(i);
        table.chi_square += weight * miss * miss;
        squares += miss * miss;
    }
    table.rms_residual = (squares / data.len() as f64).sqrt();
    Ok(table)
}
