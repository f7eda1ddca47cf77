//! What interpolation misses of grid points that are left out: each that has neighbours on both sides along an axis is
//! predicted by them, over twice the spacing, so that the error told is rather too large.

use super::mixture::Mixture;
use super::{FrictionMap, MapCell};
use serde::{Deserialize, Serialize};

/// An axis of the grid.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Axis {
    /// β.
    Beta,
    /// μ_R.
    RollingFriction,
}

/// Misses of the grid points that can be left out.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Missed {
    /// Along which it lies between its neighbours.
    pub along: Axis,
    /// β.
    pub beta: f64,
    /// μ_R.
    pub mu_r: f64,
    /// Interpolated less measured μ at the three inertial numbers.
    pub friction: [f64; 3],
    /// Of the angle of repose (degrees).
    pub repose: f64,
    /// Of φ.
    pub solid_fraction: f64,
}

/// Root-mean-squares of the misses: the interpolation's error.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct InterpolationError {
    /// Of μ at the three inertial numbers.
    pub friction: [f64; 3],
    /// Of the angle of repose (degrees).
    pub repose: f64,
    /// Of φ.
    pub solid_fraction: f64,
}

/// Of all that is missed; 0 of nothing.
fn root_mean_square(missed: &[Missed]) -> InterpolationError {
    let of = |part: &dyn Fn(&Missed) -> f64| {
        let squares: f64 = missed.iter().map(|m| part(m).powi(2)).sum();
        (squares / missed.len().max(1) as f64).sqrt()
    };
    InterpolationError {
        friction: std::array::from_fn(|k| of(&|m| m.friction[k])),
        repose: of(&|m| m.repose),
        solid_fraction: of(&|m| m.solid_fraction),
    }
}

impl FrictionMap {
    /// Every grid point that has neighbours on both sides along an axis, beside what they make of it: once for each such
    /// axis.
    pub fn missed(&self) -> Vec<Missed> {
        let mut all = Vec::new();
        for b in 0..self.betas.len() {
            for m in 0..self.mu_rs.len() {
                let here = self.cell(b, m);
                let mut compare = |along: Axis, low: &MapCell, high: &MapCell, share: f64| {
                    let mut mixed = Mixture::default();
                    mixed.add(low, 1.0 - share);
                    mixed.add(high, share);
                    let of = |k: usize| mixed.curve.friction[k] - here.curve.friction[k];
                    all.push(Missed {
                        along,
                        beta: here.beta,
                        mu_r: here.mu_r,
                        friction: std::array::from_fn(of),
                        repose: mixed.repose.value - here.repose.value,
                        solid_fraction: mixed.solid_fraction.value - here.solid_fraction.value,
                    });
                };
                let share = |axis: &[f64], k: usize| {
                    (axis[k] / axis[k - 1]).ln() / (axis[k + 1] / axis[k - 1]).ln()
                };
                if b > 0 && b + 1 < self.betas.len() {
                    let (low, high) = (self.cell(b - 1, m), self.cell(b + 1, m));
                    compare(Axis::Beta, low, high, share(&self.betas, b));
                }
                if m > 0 && m + 1 < self.mu_rs.len() {
                    let (low, high) = (self.cell(b, m - 1), self.cell(b, m + 1));
                    compare(Axis::RollingFriction, low, high, share(&self.mu_rs, m));
                }
            }
        }
        all
    }

    /// Root-mean-squares of [`FrictionMap::missed`], or what was told where that is larger; 0 on a grid of two by two of
    /// which nothing was told.
    pub fn error(&self) -> InterpolationError {
        let InterpolationError {
            friction,
            repose,
            solid_fraction,
        } = root_mean_square(&self.missed());
        let told = &self.told;
        InterpolationError {
            friction: std::array::from_fn(|k| friction[k].max(told.friction[k])),
            repose: repose.max(told.repose),
            solid_fraction: solid_fraction.max(told.solid_fraction),
        }
    }

    /// Root-mean-squares of what is missed along one axis; `None` with two values on it.
    pub fn error_along(&self, axis: Axis) -> Option<InterpolationError> {
        let missed: Vec<Missed> = self
            .missed()
            .into_iter()
            .filter(|m| m.along == axis)
            .collect();
        (!missed.is_empty()).then(|| root_mean_square(&missed))
    }
}
