//! What lies between campaigns: their weighted sum.

use super::curve::Curve;
use super::interpolation_error::InterpolationError;
use super::{Interpolated, MapCell, WithError};

/// A weighted sum of cells.
pub(super) struct Mixture {
    pub(super) cells: usize,
    pub(super) curve: Curve,
    curve_zz: Option<Curve>,
    pub(super) repose: WithError,
    pub(super) solid_fraction: WithError,
    valid_i: [f64; 2],
}

impl Default for Mixture {
    fn default() -> Self {
        let nothing = Curve {
            friction: [0.0; 3],
            covariance: [[0.0; 3]; 3],
        };
        let zero = WithError {
            value: 0.0,
            error: 0.0,
        };
        Self {
            cells: 0,
            curve: nothing,
            curve_zz: Some(nothing),
            repose: zero,
            solid_fraction: zero,
            valid_i: [0.0, f64::INFINITY],
        }
    }
}

fn add_curve(sum: &mut Curve, curve: &Curve, weight: f64) {
    for k in 0..3 {
        sum.friction[k] += weight * curve.friction[k];
        for l in 0..3 {
            sum.covariance[k][l] += weight * weight * curve.covariance[k][l];
        }
    }
}

fn add_number(sum: &mut WithError, number: &WithError, weight: f64) {
    sum.value += weight * number.value;
    sum.error = sum.error.hypot(weight * number.error);
}

impl Mixture {
    pub(super) fn add(&mut self, cell: &MapCell, weight: f64) {
        self.cells += 1;
        add_curve(&mut self.curve, &cell.curve, weight);
        match (&mut self.curve_zz, &cell.curve_zz) {
            (Some(sum), Some(curve)) => add_curve(sum, curve, weight),
            _ => self.curve_zz = None,
        }
        add_number(&mut self.repose, &cell.repose, weight);
        add_number(&mut self.solid_fraction, &cell.solid_fraction, weight);
        self.valid_i[0] = self.valid_i[0].max(cell.valid_i[0]);
        self.valid_i[1] = self.valid_i[1].min(cell.valid_i[1]);
    }

    pub(super) fn finish(
        mut self,
        i: [f64; 3],
        error: &InterpolationError,
    ) -> Option<Interpolated> {
        for k in 0..3 {
            let square = error.friction[k] * error.friction[k];
            self.curve.covariance[k][k] += square;
            if let Some(curve) = &mut self.curve_zz {
                curve.covariance[k][k] += square;
            }
        }
        let (law, covariance) = self.curve.law(i)?;
        Some(Interpolated {
            law,
            covariance,
            law_zz: self.curve_zz.and_then(|c| c.law(i)),
            repose: WithError {
                error: self.repose.error.hypot(error.repose),
                ..self.repose
            },
            solid_fraction: WithError {
                error: self.solid_fraction.error.hypot(error.solid_fraction),
                ..self.solid_fraction
            },
            valid_i: self.valid_i,
        })
    }
}
