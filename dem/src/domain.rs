//! The box that grains live in, with its periodic axes.

use nalgebra::Vector3;
use serde::{Deserialize, Serialize};

/// An axis-aligned box `[lower, upper]` in metres; a periodic axis wraps around.
///
/// Along an axis that is not periodic the bounds hold nothing back: the search goes by where the
/// grains are.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Domain {
    /// Lower corner (m).
    pub lower: Vector3<f64>,
    /// Upper corner (m).
    pub upper: Vector3<f64>,
    /// Which axes wrap around.
    pub periodic: [bool; 3],
}

impl Domain {
    /// Edge lengths (m).
    pub fn lengths(&self) -> Vector3<f64> {
        self.upper - self.lower
    }

    /// Area of the floor, `L_x L_y` (m²).
    pub fn floor_area(&self) -> f64 {
        let l = self.lengths();
        l.x * l.y
    }

    /// The shortest periodic image of a separation vector (m).
    pub fn nearest_image(&self, mut separation: Vector3<f64>) -> Vector3<f64> {
        let l = self.lengths();
        for axis in 0..3 {
            if self.periodic[axis] {
                separation[axis] -= l[axis] * (separation[axis] / l[axis]).round_ties_even();
            }
        }
        separation
    }

    /// The image of a position that lies inside the box along periodic axes (m).
    pub fn wrap(&self, mut position: Vector3<f64>) -> Vector3<f64> {
        let l = self.lengths();
        for axis in 0..3 {
            if self.periodic[axis] {
                position[axis] -= l[axis] * ((position[axis] - self.lower[axis]) / l[axis]).floor();
                // Round-off may land a hair below `lower` on the upper edge itself.
                if position[axis] >= self.upper[axis] {
                    position[axis] = self.lower[axis];
                }
            }
        }
        position
    }
}

/// Ties to even, for |x| < 2⁵¹: adding 3·2⁵¹ leaves no room for a fraction.
///
/// `round_ties_even` is a library call where SSE4.1 is not taken for granted (6 % of a run).
#[inline(always)]
fn nearest_integer(x: f64) -> f64 {
    const NO_FRACTION: f64 = 6_755_399_441_055_744.0;
    (x + NO_FRACTION) - NO_FRACTION
}

/// Periodic images in the inner loops: open axes have no inverse length, so they wrap to themselves.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Images {
    /// Lengths of the box (m).
    pub lengths: [f64; 3],
    /// Their inverses along periodic axes, 0 along open ones (1/m).
    pub inverse: [f64; 3],
}

impl Images {
    pub fn of(domain: &Domain) -> Self {
        let lengths: [f64; 3] = domain.lengths().into();
        Images {
            lengths,
            inverse: std::array::from_fn(|k| {
                if domain.periodic[k] {
                    1.0 / lengths[k]
                } else {
                    0.0
                }
            }),
        }
    }

    /// Squared distance of the nearest images of two centres (m²).
    #[inline(always)]
    pub fn distance_squared(&self, a: &[f64; 4], b: &[f64; 4]) -> f64 {
        let mut sum = 0.0;
        for k in 0..3 {
            let d = a[k] - b[k];
            let d = d - self.lengths[k] * nearest_integer(d * self.inverse[k]);
            sum += d * d;
        }
        sum
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn integers_are_those_of_the_library() {
        for k in -4000..4000 {
            let x = f64::from(k) * 0.125;
            assert_eq!(nearest_integer(x), x.round_ties_even(), "{x}");
        }
    }

    #[test]
    fn images_wrap_only_along_periodic_axes() {
        let domain = Domain {
            lower: Vector3::new(0.0, 0.0, -1.0),
            upper: Vector3::new(2.0, 3.0, 9.0),
            periodic: [true, true, false],
        };
        let s = domain.nearest_image(Vector3::new(1.9, -2.9, 9.5));
        assert!((s - Vector3::new(-0.1, 0.1, 9.5)).norm() < 1e-14);
        let x = domain.wrap(Vector3::new(-0.5, 7.0, 20.0));
        assert!((x - Vector3::new(1.5, 1.0, 20.0)).norm() < 1e-14);
        assert_eq!(domain.floor_area(), 6.0);
    }
}
