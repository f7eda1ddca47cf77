//! A map from two parameters of the contact law to μ(I) and the angle of repose, by interpolation between campaigns.
//!
//! μ_s, μ_2 and I_0 of one campaign hang together: where the data see one end of the law only, they run away along a
//! line on which μ(I) hardly changes. So it is the curve that is interpolated, by its values f_1, f_2, f_3 at three
//! inertial numbers within the data.
//!
//! Interpolation is bilinear in ln β and ln μ_R. Its error is found by leaving grid points out.

mod cell;
mod curve;
mod error;
mod interpolation_error;
mod mixture;

pub use cell::MapCell;
pub use curve::Curve;
pub use error::MapError;
pub use interpolation_error::{Axis, InterpolationError, Missed};

use mixture::Mixture;
use serde::{Deserialize, Serialize};

/// A number with its standard error.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct WithError {
    /// The number.
    pub value: f64,
    /// Its standard error.
    pub error: f64,
}

/// Laws on a grid of β and μ_R.
#[derive(Clone, Debug, PartialEq)]
pub struct FrictionMap {
    inertial_numbers: [f64; 3],
    betas: Vec<f64>,
    mu_rs: Vec<f64>,
    /// By β, then μ_R.
    cells: Vec<MapCell>,
    /// The least that the interpolation's error is taken for.
    told: InterpolationError,
}

/// What a map says at a point.
#[derive(Clone, Debug, PartialEq)]
pub struct Interpolated {
    /// (μ_s, μ_2, I_0) of |τ|/p.
    pub law: [f64; 3],
    /// Their covariance: of the campaigns and of the interpolation.
    pub covariance: [[f64; 3]; 3],
    /// The same of |τ|/σ_zz, where all neighbours have one.
    pub law_zz: Option<([f64; 3], [[f64; 3]; 3])>,
    /// Angle of repose (degrees).
    pub repose: WithError,
    /// φ.
    pub solid_fraction: WithError,
    /// Inertial numbers that all neighbours measured.
    pub valid_i: [f64; 2],
}

/// Rising, each once.
fn axis(values: impl Iterator<Item = f64>) -> Vec<f64> {
    let mut all: Vec<f64> = values.collect();
    all.sort_by(f64::total_cmp);
    all.dedup();
    all
}

/// Cells and weights between which a place lies, along one axis.
fn between(axis: &[f64], value: f64) -> [(usize, f64); 2] {
    let right = axis
        .partition_point(|x| *x < value)
        .clamp(1, axis.len() - 1);
    let (a, b) = (axis[right - 1].ln(), axis[right].ln());
    let share = ((value.ln() - a) / (b - a)).clamp(0.0, 1.0);
    [(right - 1, 1.0 - share), (right, share)]
}

impl FrictionMap {
    /// A map from the cells of a full grid, in any order.
    ///
    /// # Errors
    /// If the cells are no grid, a number cannot be, or no law goes through the values of a cell.
    pub fn new(inertial_numbers: [f64; 3], cells: Vec<MapCell>) -> Result<Self, MapError> {
        let [a, b, c] = inertial_numbers;
        if !(a > 0.0 && b > a && c > b && c.is_finite()) {
            return Err(MapError::InertialNumbers(inertial_numbers));
        }
        for cell in &cells {
            cell.check(inertial_numbers)?;
        }
        let betas = axis(cells.iter().map(|c| c.beta));
        let mu_rs = axis(cells.iter().map(|c| c.mu_r));
        let needed = betas.len() * mu_rs.len();
        let mut ordered = Vec::with_capacity(needed);
        for beta in &betas {
            for mu_r in &mu_rs {
                let here = |c: &&MapCell| c.beta == *beta && c.mu_r == *mu_r;
                ordered.extend(cells.iter().find(here).cloned());
            }
        }
        let full = ordered.len() == needed && cells.len() == needed;
        if !full || betas.len() < 2 || mu_rs.len() < 2 {
            return Err(MapError::NoGrid {
                betas: betas.len(),
                mu_rs: mu_rs.len(),
                needed,
                found: cells.len(),
            });
        }
        Ok(Self {
            inertial_numbers,
            betas,
            mu_rs,
            cells: ordered,
            told: InterpolationError::default(),
        })
    }

    /// The map with an error of its interpolation that is known otherwise, from campaigns off the grid: a grid of two by two
    /// cannot tell its own. The larger of both counts.
    #[must_use]
    pub fn with_error(mut self, told: InterpolationError) -> Self {
        self.told = told;
        self
    }

    /// The cells, by rising β, then μ_R.
    pub fn cells(&self) -> &[MapCell] {
        &self.cells
    }

    /// The inertial numbers at which curves are given.
    pub fn inertial_numbers(&self) -> [f64; 3] {
        self.inertial_numbers
    }

    fn cell(&self, beta: usize, mu_r: usize) -> &MapCell {
        &self.cells[beta * self.mu_rs.len() + mu_r]
    }

    /// Law and angle of repose at a place on the map.
    ///
    /// # Errors
    /// If it lies outside: nothing is extrapolated.
    pub fn at(&self, beta: f64, mu_r: f64) -> Result<Interpolated, MapError> {
        for (key, value, axis) in [("beta", beta, &self.betas), ("mu_r", mu_r, &self.mu_rs)] {
            let (low, high) = (axis[0], axis[axis.len() - 1]);
            if !(value >= low && value <= high) {
                return Err(MapError::Outside {
                    key,
                    value,
                    low,
                    high,
                });
            }
        }
        let mut mixed = Mixture::default();
        for (b, share) in between(&self.betas, beta) {
            for (m, other) in between(&self.mu_rs, mu_r) {
                if share * other > 0.0 {
                    mixed.add(self.cell(b, m), share * other);
                }
            }
        }
        // A grid point needs no interpolation.
        let error = if mixed.cells > 1 {
            self.error()
        } else {
            InterpolationError::default()
        };
        let place = MapError::BadCell {
            beta,
            mu_r,
            key: "friction",
            value: mixed.curve.friction[1],
            allowed: "three values through which a law goes",
        };
        mixed.finish(self.inertial_numbers, &error).ok_or(place)
    }
}

#[cfg(test)]
mod tests {
    use super::curve::law_through;
    use super::*;
    use crate::calibration::mu_i::mu_of_i;

    const I: [f64; 3] = [0.1, 0.3, 0.7];

    fn cell(beta: f64, mu_r: f64, law: [f64; 3], repose: f64) -> MapCell {
        let friction = I.map(|i| mu_of_i(law[0], law[1], law[2], i));
        let covariance = [[1e-6, 0.0, 0.0], [0.0, 1e-6, 0.0], [0.0, 0.0, 1e-6]];
        MapCell {
            beta,
            mu_r,
            curve: Curve {
                friction,
                covariance,
            },
            curve_zz: None,
            repose: WithError {
                value: repose,
                error: 0.3,
            },
            solid_fraction: WithError {
                value: 0.5,
                error: 0.002,
            },
            valid_i: [0.05 + 0.1 * mu_r, 0.8],
        }
    }

    /// μ linear in ln β and ln μ_R at every I; I_0 shared.
    fn plane() -> FrictionMap {
        let mut cells = Vec::new();
        for beta in [1.0, 0.1, 0.3] {
            for mu_r in [2.0, 0.5, 1.0] {
                let (x, y) = (f64::ln(beta), f64::ln(mu_r));
                let law = [0.6 + 0.07 * x + 0.02 * y, 0.9 + 0.05 * x + 0.03 * y, 0.5];
                cells.push(cell(beta, mu_r, law, 38.0 + 5.0 * x + 2.0 * y));
            }
        }
        FrictionMap::new(I, cells).unwrap()
    }

    #[test]
    fn what_is_linear_in_the_logarithms_is_found_exactly() {
        let map = plane();
        let (beta, mu_r) = (0.2, 1.3);
        let found = map.at(beta, mu_r).unwrap();
        let (x, y) = (f64::ln(beta), f64::ln(mu_r));
        let truth = [0.6 + 0.07 * x + 0.02 * y, 0.9 + 0.05 * x + 0.03 * y, 0.5];
        for (found, truth) in found.law.iter().zip(truth) {
            assert!((found / truth - 1.0).abs() < 1e-9, "{found}");
        }
        assert!((found.repose.value - (38.0 + 5.0 * x + 2.0 * y)).abs() < 1e-9);
        assert!(map.error().friction.iter().all(|e| *e < 1e-12));
        // Of the neighbours at μ_R = 2 and 1 the narrower range.
        assert_eq!(found.valid_i, [0.25, 0.8]);
        assert_eq!(map.missed().len(), 6);
    }

    #[test]
    fn errors_are_those_of_the_linearised_curve_and_grow_with_what_is_left_out() {
        let map = plane();
        let found = map.at(0.3, 1.0).unwrap();
        // On a grid point: the curve's covariance through ∂law/∂f, by differences of the closed form.
        let f = map.cell(1, 1).curve.friction;
        for k in 0..3 {
            let by = |j: usize| {
                let mut other = f;
                other[j] += 1e-7;
                (law_through(I, other).unwrap()[k] - found.law[k]) / 1e-7 * 1e-3
            };
            let error = (0..3).map(|j| by(j).powi(2)).sum::<f64>().sqrt();
            assert!((found.covariance[k][k].sqrt() / error - 1.0).abs() < 1e-4);
        }
        let mut cells = map.cells().to_vec();
        let middle = cells
            .iter_mut()
            .find(|c| c.beta == 0.3 && c.mu_r == 1.0)
            .unwrap();
        middle.curve.friction = middle.curve.friction.map(|f| f + 0.03);
        let bent = FrictionMap::new(I, cells).unwrap();
        let error = bent.error();
        // Missed by 0.03 along both axes, and as a neighbour by two edges never: 2 of 6.
        assert!(
            (error.friction[0] - 0.03 * (2.0f64 / 6.0).sqrt()).abs() < 1e-12,
            "{error:?}"
        );
        let told = InterpolationError {
            friction: [0.05, 0.0, 0.0],
            ..InterpolationError::default()
        };
        let warned = bent.clone().with_error(told).error();
        assert_eq!(
            warned.friction,
            [0.05, error.friction[1], error.friction[2]]
        );
        let (before, after) = (map.at(0.2, 0.8).unwrap(), bent.at(0.2, 0.8).unwrap());
        assert!(after.covariance[0][0] > 4.0 * before.covariance[0][0]);
    }

    #[test]
    fn what_lies_outside_or_is_no_grid_is_refused() {
        let map = plane();
        let why = map.at(0.05, 1.0).unwrap_err().to_string();
        assert!(
            why.contains("beta = 0.05") && why.contains("[0.1, 1]"),
            "{why}"
        );
        assert!(map.at(0.3, 2.1).is_err() && map.at(f64::NAN, 1.0).is_err());
        let cells = map.cells();
        assert!(FrictionMap::new(I, cells[1..].to_vec()).is_err());
        assert!(FrictionMap::new(I, [cells, &cells[..1]].concat()).is_err());
        assert!(FrictionMap::new([0.1, 0.1, 0.2], cells.to_vec()).is_err());
        let mut falling = cells.to_vec();
        falling[0].curve.friction = [0.6, 0.5, 0.4];
        let why = FrictionMap::new(I, falling).unwrap_err().to_string();
        assert!(why.contains("friction"), "{why}");
    }
}
