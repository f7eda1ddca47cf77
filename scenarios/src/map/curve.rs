//! The curve μ(I) of a cell: its fitted law, or what is left of it where the points do not tell three parameters.

use colluvium_coupling::calibration::least_squares::levenberg_marquardt;
use colluvium_coupling::calibration::{Curve, LocalPoint, MuIFit, Stress, WithError};
use nalgebra::{Matrix2, Matrix3x2, SVector};

/// Inertial numbers at which curves are kept: within what every cell measures.
pub(super) const INERTIAL_NUMBERS: [f64; 3] = [0.1, 0.25, 0.5];

/// I_0 where the points tell none.
pub(super) const HELD: f64 = INERTIAL_NUMBERS[1];

/// What a map keeps of a campaign's flows.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Measured {
    pub curve: Curve,
    pub solid_fraction: WithError,
    pub valid_i: [f64; 2],
}

/// The fitted law where it is one that a material can have, else [`with_i_0_held`].
pub(super) fn measured(
    fit: Option<&MuIFit>,
    points: &[LocalPoint],
    stress: Stress,
) -> Option<Measured> {
    match fit.filter(|f| f.physical) {
        Some(fit) => Some(Measured {
            curve: Curve::of(fit, INERTIAL_NUMBERS),
            solid_fraction: WithError {
                value: fit.solid_fraction,
                error: fit.solid_fraction_error?,
            },
            valid_i: fit.valid_i,
        }),
        None => with_i_0_held(points, stress),
    }
}

/// μ = μ_s + (μ_2 − μ_s) I/(I + I_0) with I_0 held, which is linear in the two that are left: for grains whose friction hardly
/// changes over what was measured. `None` where it falls.
///
/// The errors are those of the scatter of points or of flows, whichever is larger.
fn with_i_0_held(points: &[LocalPoint], stress: Stress) -> Option<Measured> {
    let of = |p: &LocalPoint| match stress {
        Stress::NormalPressure => (p.friction_zz, p.friction_zz_error),
        _ => (p.friction, p.friction_error),
    };
    let data: Vec<(f64, f64, f64)> = points
        .iter()
        .map(|p| (p.inertial_number, of(p).0, of(p).1.powi(-2)))
        .collect();
    let share = |i: f64| i / (i + HELD);
    let law = |p: &SVector<f64, 2>, i: f64| {
        let s = share(i);
        Some((p[0] * (1.0 - s) + p[1] * s, SVector::from([1.0 - s, s])))
    };
    let fit = levenberg_marquardt(&data, SVector::from([0.5, 0.7]), law).ok()?;
    let [mu_s, mu_2] = fit.parameters.into();
    let rises = mu_s >= 0.0 && mu_2 > mu_s;
    // Flow by flow: Σ weights × residual, over the root of its weight.
    let mut flows: Vec<(f64, Vec<usize>)> = Vec::new();
    for (k, p) in points.iter().enumerate() {
        match flows.iter_mut().find(|f| f.0 == p.slope_degrees) {
            Some(flow) => flow.1.push(k),
            None => flows.push((p.slope_degrees, vec![k])),
        }
    }
    let freedom = flows.len().checked_sub(2).filter(|n| *n > 0)? as f64;
    let residual = |k: usize| {
        let (i, mu, weight) = data[k];
        (mu - mu_s - (mu_2 - mu_s) * share(i)) * weight.sqrt()
    };
    let between: f64 = flows
        .iter()
        .map(|(_, own)| own.iter().map(|k| residual(*k)).sum::<f64>().powi(2) / own.len() as f64)
        .sum();
    let among = fit.chi_square / (data.len() as f64 - 2.0).max(1.0);
    let scale = (between / freedom).max(among).max(1.0);
    let gradient = Matrix3x2::from_fn(|row, k| {
        let s = share(INERTIAL_NUMBERS[row]);
        if k == 0 { 1.0 - s } else { s }
    });
    let covariance: Matrix2<f64> = fit.covariance * scale;
    let spread = gradient * covariance * gradient.transpose();
    let n = flows.len() as f64;
    let means: Vec<f64> = flows
        .iter()
        .map(|(_, own)| {
            own.iter().map(|k| points[*k].solid_fraction).sum::<f64>() / own.len() as f64
        })
        .collect();
    let mean = means.iter().sum::<f64>() / n;
    let squares: f64 = means.iter().map(|m| (m - mean).powi(2)).sum();
    let numbers = points.iter().map(|p| p.inertial_number);
    rises.then(|| Measured {
        curve: Curve {
            friction: INERTIAL_NUMBERS.map(|i| mu_s + (mu_2 - mu_s) * share(i)),
            covariance: std::array::from_fn(|r| std::array::from_fn(|k| spread[(r, k)])),
        },
        solid_fraction: WithError {
            value: mean,
            error: (squares / (n * (n - 1.0))).sqrt(),
        },
        valid_i: [
            numbers.clone().fold(f64::INFINITY, f64::min),
            numbers.fold(0.0, f64::max),
        ],
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use colluvium_coupling::calibration::fit_mu_i;

    /// Five flows of which each has one inertial number; what they scatter by is no noise.
    fn points(law: impl Fn(f64) -> f64) -> Vec<LocalPoint> {
        let flow = |k: u32| {
            (0..8).map(move |z| {
                let i = 0.1 * f64::from(k + 1) * (1.0 + 0.02 * f64::from(z));
                (k, z, i)
            })
        };
        (0..5)
            .flat_map(flow)
            .map(|(k, z, i)| {
                let friction = law(i) + [0.004, -0.003, 0.002, -0.004, 0.001][k as usize];
                LocalPoint {
                    slope_degrees: 40.0 + f64::from(k),
                    z: f64::from(z),
                    inertial_number: i,
                    inertial_number_error: 0.01 * i,
                    friction,
                    friction_error: 0.003,
                    friction_zz: 0.9 * friction,
                    friction_zz_error: 0.003,
                    solid_fraction: 0.45 - 0.05 * i,
                    solid_fraction_error: 0.001,
                }
            })
            .collect()
    }

    #[test]
    fn friction_that_hardly_rises_still_has_a_curve() {
        let truth = |i: f64| 0.86 + 0.03 * i / (i + 0.1);
        let points = points(truth);
        let found = measured(None, &points, Stress::MeanPressure).unwrap();
        for (k, i) in INERTIAL_NUMBERS.iter().enumerate() {
            let error = found.curve.covariance[k][k].sqrt();
            let off = found.curve.friction[k] - truth(*i);
            assert!(off.abs() < 2.0 * error && error < 0.01, "{off} {error}");
        }
        let [low, high] = found.valid_i;
        assert!((low - 0.1).abs() < 1e-12 && (high - 0.57).abs() < 1e-12);
        let zz = measured(None, &points, Stress::NormalPressure).unwrap();
        let ratio = zz.curve.friction[1] / found.curve.friction[1];
        assert!((ratio - 0.9).abs() < 1e-9, "{ratio}");
    }

    #[test]
    fn a_law_that_is_one_is_taken_as_it_is_and_one_that_falls_is_none() {
        let points_up = points(|i| 0.5 + 0.4 * i / (i + 0.3));
        let fit = fit_mu_i(&points_up, Stress::MeanPressure).unwrap();
        let found = measured(Some(&fit), &points_up, Stress::MeanPressure).unwrap();
        assert_eq!(found.curve, Curve::of(&fit, INERTIAL_NUMBERS));
        let down = points(|i| 0.9 - 0.3 * i);
        assert_eq!(measured(None, &down, Stress::MeanPressure), None);
        // Two flows tell no scatter.
        assert_eq!(measured(None, &points_up[..16], Stress::MeanPressure), None);
    }
}
