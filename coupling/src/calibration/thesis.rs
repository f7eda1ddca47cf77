//! The three estimators of Thuillet's thesis (section 2.3) and its published fits (Table 2.6).
//!
//! There stress is not measured: P = ρ g cos θ (h − z), so μ = tan θ, I is uniform and
//! v(z) = (2 I h^{3/2}/3d) √(g cos θ) [1 − (1 − z/h)^{3/2}] (its Eq. 2.51–2.54).

use super::least_squares::FitError;
use super::mu_i::solve;
use crate::coarse_graining::Profile;
use serde::{Deserialize, Serialize};

/// How I is taken from a velocity profile.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Estimator {
    /// The value at the top of the flow, z = h_0.
    Top,
    /// The mean of the values of all layers below h_0.
    Mean,
    /// Least squares on (I, h), Eq. 2.55.
    MinimalResidual,
}

/// A row of parameters, each with its standard error.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Row {
    /// μ_s and its error.
    pub mu_s: [f64; 2],
    /// μ_2 and its error.
    pub mu_2: [f64; 2],
    /// I_0 and its error.
    pub i_0: [f64; 2],
}

/// A published fit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PublishedRow {
    /// `moderate` or `gravel`.
    pub material: &'static str,
    /// Estimator of I.
    pub estimator: Estimator,
    /// P from φρ_s instead of ρ_s.
    pub with_phi: bool,
    /// The parameters.
    pub row: Row,
}

const fn published(
    material: &'static str,
    estimator: Estimator,
    with_phi: bool,
    mu_s: [f64; 2],
    mu_2: [f64; 2],
    i_0: [f64; 2],
) -> PublishedRow {
    PublishedRow {
        material,
        estimator,
        with_phi,
        row: Row { mu_s, mu_2, i_0 },
    }
}

/// Table 2.6 of the thesis; the gravel-like material's residual fits are not usable there (μ_2, I_0 > 10⁶).
pub const TABLE_2_6: [PublishedRow; 6] = [
    published(
        "gravel",
        Estimator::Top,
        false,
        [0.573, 0.027],
        [2.067, 0.347],
        [2.223, 0.851],
    ),
    published(
        "gravel",
        Estimator::Top,
        true,
        [0.527, 0.015],
        [1.549, 0.045],
        [1.732, 0.191],
    ),
    published(
        "moderate",
        Estimator::Top,
        false,
        [0.508, 0.018],
        [0.827, 0.020],
        [0.259, 0.065],
    ),
    published(
        "moderate",
        Estimator::Top,
        true,
        [0.506, 0.019],
        [0.815, 0.017],
        [0.332, 0.081],
    ),
    published(
        "moderate",
        Estimator::MinimalResidual,
        false,
        [0.438, 0.075],
        [0.748, 0.010],
        [0.097, 0.045],
    ),
    published(
        "moderate",
        Estimator::MinimalResidual,
        true,
        [0.444, 0.069],
        [0.747, 0.010],
        [0.137, 0.061],
    ),
];

/// The published row of a material, if there is one.
pub fn published_row(material: &str, estimator: Estimator, with_phi: bool) -> Option<&'static Row> {
    TABLE_2_6
        .iter()
        .find(|r| r.material == material && r.estimator == estimator && r.with_phi == with_phi)
        .map(|r| &r.row)
}

impl Row {
    /// (ours − theirs)/√(σ² + σ'²) of μ_s, μ_2 and I_0.
    pub fn differences(&self, other: &Row) -> [f64; 3] {
        [
            (self.mu_s, other.mu_s),
            (self.mu_2, other.mu_2),
            (self.i_0, other.i_0),
        ]
        .map(|(a, b)| (a[0] - b[0]) / a[1].hypot(b[1]))
    }
}

/// What the estimators need of one steady flow.
#[derive(Clone, Debug, PartialEq)]
pub struct VelocityProfile {
    /// Slope θ (rad).
    pub slope: f64,
    /// Gravity [m/s²].
    pub gravity: f64,
    /// Mean diameter (m).
    pub diameter: f64,
    /// Heights of the layers (m), rising.
    pub z: Vec<f64>,
    /// Mean velocities downslope [m/s].
    pub u: Vec<f64>,
    /// Solid fractions.
    pub phi: Vec<f64>,
}

impl VelocityProfile {
    /// From an averaged profile, layers above the base only.
    pub fn of(profile: &Profile, slope: f64, gravity: f64, diameter: f64) -> Self {
        let rows: Vec<_> = profile.rows.iter().filter(|r| r.z > 0.0).collect();
        Self {
            slope,
            gravity,
            diameter,
            z: rows.iter().map(|r| r.z).collect(),
            u: rows.iter().map(|r| r.u.value).collect(),
            phi: rows.iter().map(|r| r.phi.value).collect(),
        }
    }

    /// Index of the highest layer with φ > 0.2; its middle is h_0.
    fn top(&self) -> Option<usize> {
        self.phi.iter().rposition(|phi| *phi > 0.2)
    }

    /// v/I of the theory [m/s] for a flow of height h.
    fn unit_velocity(&self, z: f64, h: f64) -> f64 {
        let bracket = 1.0 - (1.0 - z / h).max(0.0).powf(1.5);
        2.0 * h.powf(1.5) / (3.0 * self.diameter)
            * (self.gravity * self.slope.cos()).sqrt()
            * bracket
    }

    /// I by one estimator; `None` if no layer has φ > 0.2 above the base. With φ, I is divided by √φ̄ of the
    /// layers below h_0.
    pub fn inertial_number(&self, estimator: Estimator, with_phi: bool) -> Option<f64> {
        let top = self.top()?;
        let h_0 = self.z[top];
        let i = match estimator {
            Estimator::Top => self.u[top] / self.unit_velocity(h_0, h_0),
            Estimator::Mean => {
                (0..=top)
                    .map(|k| self.u[k] / self.unit_velocity(self.z[k], h_0))
                    .sum::<f64>()
                    / (top + 1) as f64
            }
            Estimator::MinimalResidual => self.least_residual(h_0)?.0,
        };
        let phi = self.phi[..=top].iter().sum::<f64>() / (top + 1) as f64;
        Some(if with_phi { i / phi.sqrt() } else { i })
    }

    /// (I, h) that minimise the mean squared residual over the layers below min(h_0, h). For given h the best
    /// I is a quotient, so h alone is scanned, up to 3 h_0. At least three layers must take part.
    fn least_residual(&self, h_0: f64) -> Option<(f64, f64)> {
        let mut best: Option<(f64, f64, f64)> = None;
        for step in 1..=3000 {
            let h = h_0 * 0.001 * f64::from(step);
            let used: Vec<usize> = (0..self.z.len())
                .filter(|&k| self.z[k] <= h.min(h_0))
                .collect();
            if used.len() < 3 {
                continue;
            }
            let unit = |k: usize| self.unit_velocity(self.z[k], h);
            let (mut vf, mut ff) = (0.0, 0.0);
            for &k in &used {
                vf += self.u[k] * unit(k);
                ff += unit(k) * unit(k);
            }
            let i = vf / ff;
            let residual = used
                .iter()
                .map(|&k| (self.u[k] - i * unit(k)).powi(2))
                .sum::<f64>()
                / used.len() as f64;
            // Our own rule, the thesis states none: a few layers near the base always fit well, so
            // that h below half of h_0 is not taken for a flow height.
            if h >= 0.5 * h_0 && best.is_none_or(|(least, ..)| residual < least) {
                best = Some((residual, i, h));
            }
        }
        best.map(|(_, i, h)| (i, h))
    }
}

/// One estimator's fit of tan θ against I.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct EstimatorFit {
    /// How I was taken.
    pub estimator: Estimator,
    /// P from φρ_s.
    pub with_phi: bool,
    /// (slope in degrees, I) of each flow.
    pub points: Vec<[f64; 2]>,
    /// Parameters and errors, where the fit has them.
    pub row: Option<Row>,
    /// Why there are none.
    pub failure: Option<String>,
}

/// All six fits. Unweighted, covariance scaled by χ²/(N − 3), as scipy's `curve_fit` does it.
pub fn estimator_fits(flows: &[VelocityProfile]) -> Vec<EstimatorFit> {
    let mut fits = Vec::new();
    for estimator in [Estimator::Top, Estimator::Mean, Estimator::MinimalResidual] {
        for with_phi in [false, true] {
            let points: Vec<[f64; 2]> = flows
                .iter()
                .filter_map(|f| {
                    Some([
                        f.slope.to_degrees(),
                        f.inertial_number(estimator, with_phi)?,
                    ])
                })
                .collect();
            let (row, failure) = match unweighted(&points) {
                Ok(row) => (Some(row), None),
                Err(error) => (None, Some(error.to_string())),
            };
            fits.push(EstimatorFit {
                estimator,
                with_phi,
                points,
                row,
                failure,
            });
        }
    }
    fits
}

fn unweighted(points: &[[f64; 2]]) -> Result<Row, FitError> {
    // With three points the curve passes through all and has no errors.
    if points.len() < 4 {
        return Err(FitError::TooFewPoints {
            found: points.len(),
            needed: 4,
        });
    }
    for (index, [_, i]) in points.iter().enumerate() {
        if !(*i > 0.0 && i.is_finite()) {
            return Err(FitError::BadPoint {
                index,
                what: "I",
                value: *i,
            });
        }
    }
    let data: Vec<_> = points
        .iter()
        .map(|[s, i]| (*i, s.to_radians().tan(), 1.0))
        .collect();
    let fit = solve(&data)?;
    let scale = fit.chi_square / (data.len() - 3) as f64;
    let part = |k: usize| [fit.parameters[k], (scale * fit.covariance[(k, k)]).sqrt()];
    Ok(Row {
        mu_s: part(0),
        mu_2: part(1),
        i_0: part(2),
    })
}
