//! Nonlinear least squares by Levenberg and Marquardt (Marquardt 1963, scaled by the diagonal).

use nalgebra::allocator::Allocator;
use nalgebra::{Const, DefaultAllocator, Dim, OMatrix, OVector, SMatrix, SVector};

/// Why a fit has no answer.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum FitError {
    /// Too few points for the number of parameters.
    #[error("the fit has {found} points: needs at least {needed}")]
    TooFewPoints {
        /// Points given.
        found: usize,
        /// Points needed.
        needed: usize,
    },
    /// A point or weight is not a finite number, or an error is not positive.
    #[error("point {index} of the fit has {what} = {value}: must be finite, and errors positive")]
    BadPoint {
        /// Position of the point.
        index: usize,
        /// Which number.
        what: &'static str,
        /// Its value.
        value: f64,
    },
    /// The points do not tell the parameters apart.
    #[error("the points do not determine the parameters (singular normal matrix)")]
    Degenerate,
}

/// A converged fit of N parameters.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Solution<const N: usize> {
    /// Best parameters.
    pub parameters: SVector<f64, N>,
    /// Inverse of JᵀWJ at the best parameters.
    pub covariance: SMatrix<f64, N, N>,
    /// Σ w (y − f)².
    pub chi_square: f64,
}

/// JᵀWJ, JᵀW(y − f) and Σ w (y − f)² at some parameters.
pub(super) type System<D> = (OMatrix<f64, D, D>, OVector<f64, D>, f64);

/// Goes down to where the sum of squares is least; `system` gives `None` where parameters are not allowed. Ends when a step
/// promises to lower it by less than `enough`, or is too small to be told. `None` if the start is not allowed.
pub(super) fn minimise<D: Dim>(
    start: OVector<f64, D>,
    enough: f64,
    system: impl Fn(&OVector<f64, D>) -> Option<System<D>>,
) -> Option<(OVector<f64, D>, System<D>)>
where
    DefaultAllocator: Allocator<D> + Allocator<D, D>,
{
    let count = start.len();
    let mut p = start;
    let (mut normal, mut gradient, mut chi_square) = system(&p)?;
    let mut damping = 1e-3;
    for _ in 0..500 {
        let mut damped = normal.clone();
        for i in 0..count {
            damped[(i, i)] += damping * normal[(i, i)].max(1e-300);
        }
        let Some(factor) = damped.cholesky() else {
            damping *= 10.0;
            if damping > 1e16 {
                break;
            }
            continue;
        };
        let step = factor.solve(&gradient);
        // What a step promises: twice what it gives where the sum is a parabola.
        if damping < 1.0 && gradient.dot(&step) < enough {
            break;
        }
        let trial = &p + &step;
        match system(&trial) {
            Some(next) if next.2 <= chi_square => {
                let small = (0..count).all(|i| step[i].abs() <= 1e-12 * (p[i].abs() + 1e-12));
                p = trial;
                (normal, gradient, chi_square) = next;
                damping = (damping * 0.1).max(1e-15);
                if small {
                    break;
                }
            }
            _ => {
                damping *= 10.0;
                if damping > 1e16 {
                    break;
                }
            }
        }
    }
    Some((p, (normal, gradient, chi_square)))
}

/// Minimises Σ wₖ (yₖ − f(xₖ; p))²; `model(p, x)` returns f and ∂f/∂p, or `None` where p is not allowed.
///
/// # Errors
/// [`FitError::TooFewPoints`] below N points; [`FitError::Degenerate`] if the normal matrix is singular at the
/// solution or the start is not allowed.
pub fn levenberg_marquardt<const N: usize>(
    points: &[(f64, f64, f64)],
    start: SVector<f64, N>,
    model: impl Fn(&SVector<f64, N>, f64) -> Option<(f64, SVector<f64, N>)>,
) -> Result<Solution<N>, FitError> {
    if points.len() < N {
        return Err(FitError::TooFewPoints {
            found: points.len(),
            needed: N,
        });
    }
    let system = |p: &SVector<f64, N>| {
        let mut normal = SMatrix::<f64, N, N>::zeros();
        let mut gradient = SVector::<f64, N>::zeros();
        let mut chi_square = 0.0;
        for &(x, y, weight) in points {
            let (f, slope) = model(p, x)?;
            normal += weight * slope * slope.transpose();
            gradient += weight * (y - f) * slope;
            chi_square += weight * (y - f) * (y - f);
        }
        chi_square
            .is_finite()
            .then_some((normal, gradient, chi_square))
    };
    let (p, (normal, _, chi_square)) =
        minimise::<Const<N>>(start, 0.0, system).ok_or(FitError::Degenerate)?;
    let covariance = normal.try_inverse().ok_or(FitError::Degenerate)?;
    if (0..N).any(|i| !(covariance[(i, i)] > 0.0 && covariance[(i, i)].is_finite())) {
        return Err(FitError::Degenerate);
    }
    Ok(Solution {
        parameters: p,
        covariance,
        chi_square,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_line_is_fitted_as_by_hand() {
        let points: Vec<_> = [(0.0, 1.0), (1.0, 3.1), (2.0, 4.9), (3.0, 7.0)]
            .iter()
            .map(|&(x, y)| (x, y, 4.0))
            .collect();
        let line = |p: &SVector<f64, 2>, x: f64| Some((p[0] + p[1] * x, SVector::from([1.0, x])));
        let fit = levenberg_marquardt(&points, SVector::from([0.0, 0.0]), line).unwrap();
        // b = 19.8/10, a = 4 − 1.5 b (normal equations by hand).
        assert!((fit.parameters[1] - 1.98).abs() < 1e-10);
        assert!((fit.parameters[0] - 1.03).abs() < 1e-10);
        assert!((fit.covariance[(1, 1)] - 0.25 / 5.0).abs() < 1e-12);
        assert_eq!(
            levenberg_marquardt(&points[..1], SVector::from([0.0, 0.0]), line),
            Err(FitError::TooFewPoints {
                found: 1,
                needed: 2
            })
        );
        let same = vec![(1.0, 2.0, 1.0); 5];
        assert_eq!(
            levenberg_marquardt(&same, SVector::from([0.0, 0.0]), line),
            Err(FitError::Degenerate)
        );
    }
}
