//! μ(I) by its values at three inertial numbers.
//!
//! With A = (I_2 − I_1)/(I_3 − I_2) and r = (f_2 − f_1)/(f_3 − f_2),
//!
//! > I_0 = (A I_3 − r I_1)/(r − A),
//!
//! for A < r < A I_3/I_1, and μ_s and μ_2 follow. These bounds are linear in f: whatever lies between laws (weights
//! positive, sum 1) is a law again.

use crate::calibration::mu_i::{MuIFit, mu_of_i};
use nalgebra::Matrix3;
use serde::{Deserialize, Serialize};

/// A curve μ(I) by its values at the map's three inertial numbers.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Curve {
    /// μ there.
    pub friction: [f64; 3],
    /// Covariance of these.
    pub covariance: [[f64; 3]; 3],
}

/// (μ_s, μ_2, I_0) of the law through three values; `None` where no law goes through them.
pub fn law_through(i: [f64; 3], f: [f64; 3]) -> Option<[f64; 3]> {
    let a = (i[1] - i[0]) / (i[2] - i[1]);
    let (low, high) = (f[1] - f[0], f[2] - f[1]);
    // r between its bounds, without a quotient by what may be zero.
    if !(high > 0.0 && low > a * high && low < a * high * i[2] / i[0]) {
        return None;
    }
    let r = low / high;
    let i_0 = (a * i[2] - r * i[0]) / (r - a);
    let share = |x: f64| x / (x + i_0);
    let span = (f[2] - f[0]) / (share(i[2]) - share(i[0]));
    let mu_s = f[0] - span * share(i[0]);
    (mu_s >= 0.0 && i_0 > 0.0).then_some([mu_s, mu_s + span, i_0])
}

impl Curve {
    /// Of a fit.
    pub fn of(fit: &MuIFit, i: [f64; 3]) -> Curve {
        let span = fit.mu_2 - fit.mu_s;
        let gradient = Matrix3::from_fn(|row, k| {
            let s = i[row] / (i[row] + fit.i_0);
            [
                1.0 - s,
                s,
                -span * i[row] / ((i[row] + fit.i_0) * (i[row] + fit.i_0)),
            ][k]
        });
        let c = Matrix3::from_fn(|r, k| fit.covariance[r][k]);
        let covariance = gradient * c * gradient.transpose();
        Curve {
            friction: i.map(|i| mu_of_i(fit.mu_s, fit.mu_2, fit.i_0, i)),
            covariance: rows(&covariance),
        }
    }

    /// The law and its covariance.
    pub(super) fn law(&self, i: [f64; 3]) -> Option<([f64; 3], [[f64; 3]; 3])> {
        let law = law_through(i, self.friction)?;
        // ∂f/∂law is known in closed form; its inverse turns the covariance back.
        let [mu_s, mu_2, i_0] = law;
        let gradient = Matrix3::from_fn(|row, k| {
            let s = i[row] / (i[row] + i_0);
            let sum = i[row] + i_0;
            [1.0 - s, s, -(mu_2 - mu_s) * i[row] / (sum * sum)][k]
        });
        let back = gradient.try_inverse()?;
        let c = Matrix3::from_fn(|r, k| self.covariance[r][k]);
        Some((law, rows(&(back * c * back.transpose()))))
    }
}

fn rows(m: &Matrix3<f64>) -> [[f64; 3]; 3] {
    std::array::from_fn(|r| std::array::from_fn(|k| m[(r, k)]))
}

#[cfg(test)]
mod tests {
    use super::*;

    const I: [f64; 3] = [0.1, 0.3, 0.7];

    #[test]
    fn a_law_goes_through_its_own_values_and_nothing_else_does() {
        for law in [[0.5, 0.9, 0.6], [0.77, 0.92, 0.076], [0.36, 1.4, 3.0]] {
            let f = I.map(|i| mu_of_i(law[0], law[1], law[2], i));
            let back = law_through(I, f).unwrap();
            for k in 0..3 {
                assert!((back[k] / law[k] - 1.0).abs() < 1e-10, "{back:?} {law:?}");
            }
        }
        // Straight, bent upwards, falling, with a step that no I_0 > 0 makes.
        for f in [
            [0.5, 0.6, 0.8],
            [0.5, 0.55, 0.8],
            [0.6, 0.5, 0.4],
            [0.5, 0.9, 0.9001],
        ] {
            assert_eq!(law_through(I, f), None, "{f:?}");
        }
    }
}
