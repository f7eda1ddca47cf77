//! The field of a heavy sphere that nothing moves.

use crate::setup::{SetupError, check};
use nalgebra::Vector3;

/// A homogeneous sphere, or a point if its radius is 0.
///
/// ```text
/// r ≥ a:  g = -μ r/r³       φ = -μ/r
/// r < a:  g = -μ r/a³       φ = -μ (3 a² - r²)/(2 a³)
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct HeavySphere {
    /// Its centre (m).
    pub center: Vector3<f64>,
    /// μ = G M (m³/s²).
    pub parameter: f64,
    /// Its radius a (m).
    pub radius: f64,
}

impl HeavySphere {
    /// Checks every number.
    pub fn validate(&self) -> Result<(), SetupError> {
        for c in self.center.iter() {
            check("gravity.sphere.center", *c, "finite, m", |_| true)?;
        }
        check(
            "gravity.sphere.parameter",
            self.parameter,
            "> 0 m³/s²",
            |v| v > 0.0,
        )?;
        check("gravity.sphere.radius", self.radius, "≥ 0 m", |v| {
            v >= 0.0
        })
    }

    /// Acceleration (m/s²) and potential (m²/s²) at a point.
    pub fn field(&self, x: &Vector3<f64>) -> (Vector3<f64>, f64) {
        let apart = x - self.center;
        let (mu, a, r) = (self.parameter, self.radius, apart.norm());
        if r >= a && r > 0.0 {
            (apart * (-mu / (r * r * r)), -mu / r)
        } else if a > 0.0 {
            let cube = a * a * a;
            (
                apart * (-mu / cube),
                -0.5 * mu * (3.0 * a * a - r * r) / cube,
            )
        } else {
            (Vector3::zeros(), f64::NEG_INFINITY)
        }
    }

    /// All numbers, for a checkpoint.
    pub(super) fn numbers(&self) -> Vec<f64> {
        let c = &self.center;
        vec![c.x, c.y, c.z, self.parameter, self.radius]
    }

    /// The sphere of a checkpoint; none where there was none.
    pub(super) fn from_numbers(numbers: &[f64]) -> Result<Option<HeavySphere>, String> {
        let sphere = match *numbers {
            [] => return Ok(None),
            [x, y, z, parameter, radius] => HeavySphere {
                center: Vector3::new(x, y, z),
                parameter,
                radius,
            },
            _ => return Err("array `gravity/sphere` must have 5 numbers".into()),
        };
        sphere.validate().map_err(|e| e.to_string())?;
        Ok(Some(sphere))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn field_and_potential_are_smooth_and_belong_together() {
        let sphere = HeavySphere {
            center: Vector3::new(1.0, -2.0, 0.5),
            parameter: 3.0,
            radius: 0.7,
        };
        let point = HeavySphere {
            radius: 0.0,
            ..sphere
        };
        let e = 1e-5;
        for distance in [0.1, 0.5, 0.6999, 0.7001, 1.0, 4.0] {
            let x = sphere.center + distance * Vector3::new(2.0, 3.0, 6.0) / 7.0;
            let (field, _) = sphere.field(&x);
            let slope = Vector3::from_fn(|k, _| {
                let d = e * Vector3::ith(k, 1.0);
                -(sphere.field(&(x + d)).1 - sphere.field(&(x - d)).1) / (2.0 * e)
            });
            assert!((field - slope).norm() < 1e-5 * field.norm(), "{distance}");
            let same = point.field(&x) == sphere.field(&x);
            assert_eq!(same, distance > 0.7, "as a point only outside");
        }
    }
}
