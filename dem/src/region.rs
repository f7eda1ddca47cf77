//! Parts of space, for rules that hold only there.

use crate::setup::{SetupError, check};
use nalgebra::Vector3;

/// A part of space (m).
#[derive(Clone, Debug, PartialEq)]
pub enum Region {
    /// All of it.
    Everywhere,
    /// A block with edges along the axes.
    Block {
        /// Lower corner (m); may be infinite.
        lower: Vector3<f64>,
        /// Upper corner (m); may be infinite.
        upper: Vector3<f64>,
    },
    /// A ball.
    Ball {
        /// Centre (m).
        center: Vector3<f64>,
        /// Radius (m).
        radius: f64,
    },
    /// What lies between two parallel planes: a layer, or a crack.
    Slab {
        /// A point half way between the planes (m).
        point: Vector3<f64>,
        /// Normal of the planes, of any length.
        normal: Vector3<f64>,
        /// Distance of the planes (m).
        thickness: f64,
    },
    /// A cylinder without ends.
    Cylinder {
        /// A point of the axis (m).
        point: Vector3<f64>,
        /// Direction of the axis, of any length.
        axis: Vector3<f64>,
        /// Radius (m).
        radius: f64,
    },
    /// Where all of these are.
    All(Vec<Region>),
    /// Where any of these is.
    Any(Vec<Region>),
    /// Where this is not.
    Outside(Box<Region>),
}

impl Region {
    /// Whether a point lies in it; the boundary belongs to it.
    pub fn contains(&self, x: &Vector3<f64>) -> bool {
        match self {
            Region::Everywhere => true,
            Region::Block { lower, upper } => (0..3).all(|k| lower[k] <= x[k] && x[k] <= upper[k]),
            Region::Ball { center, radius } => (x - center).norm_squared() <= radius * radius,
            Region::Slab {
                point,
                normal,
                thickness,
            } => (x - point).dot(normal).abs() <= 0.5 * thickness * normal.norm(),
            Region::Cylinder {
                point,
                axis,
                radius,
            } => (x - point).cross(axis).norm() <= radius * axis.norm(),
            Region::All(parts) => parts.iter().all(|part| part.contains(x)),
            Region::Any(parts) => parts.iter().any(|part| part.contains(x)),
            Region::Outside(part) => !part.contains(x),
        }
    }

    /// Checks its numbers; `key` names it in errors.
    pub fn validate(&self, key: &str) -> Result<(), SetupError> {
        let finite = |name: &str, v: &Vector3<f64>| {
            let key = format!("{key}.{name}");
            v.iter()
                .try_for_each(|c| check(&key, *c, "finite", |_| true))
        };
        let direction = |name: &str, v: &Vector3<f64>| {
            finite(name, v)?;
            check(&format!("{key}.{name}"), v.norm(), "longer than 0", |l| {
                l > 0.0
            })
        };
        let length = |name: &str, l: f64| check(&format!("{key}.{name}"), l, "> 0 m", |l| l > 0.0);
        match self {
            Region::Everywhere => Ok(()),
            Region::Block { lower, upper } => (0..3).try_for_each(|k| {
                // Infinite bounds leave a side open.
                if lower[k] < upper[k] {
                    return Ok(());
                }
                Err(SetupError::OutOfRange {
                    key: format!("{key}.upper[{k}]"),
                    value: upper[k],
                    allowed: "above the lower bound",
                })
            }),
            Region::Ball { center, radius } => {
                finite("center", center)?;
                length("radius", *radius)
            }
            Region::Slab {
                point,
                normal,
                thickness,
            } => {
                finite("point", point)?;
                direction("normal", normal)?;
                length("thickness", *thickness)
            }
            Region::Cylinder {
                point,
                axis,
                radius,
            } => {
                finite("point", point)?;
                direction("axis", axis)?;
                length("radius", *radius)
            }
            Region::All(parts) | Region::Any(parts) => parts
                .iter()
                .enumerate()
                .try_for_each(|(k, part)| part.validate(&format!("{key}[{k}]"))),
            Region::Outside(part) => part.validate(key),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shapes_hold_what_lies_in_them_and_nothing_else() {
        let open = f64::INFINITY;
        let top = Region::Block {
            lower: Vector3::new(-open, -open, 2.0),
            upper: Vector3::repeat(open),
        };
        let crack = Region::Slab {
            point: Vector3::new(0.0, 0.0, 2.5),
            normal: Vector3::new(0.0, 3.0, 4.0),
            thickness: 0.2,
        };
        let pipe = Region::Cylinder {
            point: Vector3::zeros(),
            axis: Vector3::new(0.0, 0.0, 7.0),
            radius: 1.0,
        };
        let ball = Region::Ball {
            center: Vector3::new(0.0, 0.0, 3.0),
            radius: 0.5,
        };
        for (region, inside, outside) in [
            (&top, [9.0, -9.0, 2.0], [0.0, 0.0, 1.99]),
            (&crack, [5.0, 0.0, 2.62], [5.0, 0.0, 2.63]),
            (&pipe, [0.6, 0.7, -50.0], [0.8, 0.7, 0.0]),
            (&ball, [0.0, 0.0, 3.5], [0.3, 0.3, 3.3]),
        ] {
            region.validate("region").unwrap();
            assert!(region.contains(&inside.into()), "{region:?}");
            assert!(!region.contains(&outside.into()), "{region:?}");
            let not = Region::Outside(Box::new(region.clone()));
            assert!(!not.contains(&inside.into()) && not.contains(&outside.into()));
        }
        let both = Region::All(vec![top.clone(), pipe.clone()]);
        let either = Region::Any(vec![top, pipe]);
        let below = Vector3::new(0.0, 0.0, 1.0);
        assert!(!both.contains(&below) && either.contains(&below));
    }

    #[test]
    fn a_bad_region_is_named() {
        let flat = Region::Any(vec![Region::Slab {
            point: Vector3::zeros(),
            normal: Vector3::zeros(),
            thickness: 1.0,
        }]);
        let error = flat.validate("bonds.within").unwrap_err().to_string();
        assert!(error.contains("bonds.within[0].normal = 0"), "{error}");
        let turned = Region::Block {
            lower: Vector3::zeros(),
            upper: Vector3::new(1.0, -1.0, 1.0),
        };
        assert!(turned.validate("x").is_err());
    }
}
