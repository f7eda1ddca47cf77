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

/// How the images of a periodic box move against it.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct ImageDrift {
    /// Speeds at which the edges grow (m/s).
    pub speeds: [f64; 3],
    /// The axis whose images are shifted along x, if any are.
    pub gradient: usize,
    /// By how much (m).
    pub offset: f64,
    /// How fast that grows (m/s).
    pub slip: f64,
}

impl ImageDrift {
    /// Whether images are anything but copies one length away.
    pub fn moves(&self) -> bool {
        self.speeds != [0.0; 3] || self.offset != 0.0 || self.slip != 0.0
    }

    /// A speed that no image of a neighbouring box exceeds (m/s).
    pub fn fastest(&self) -> f64 {
        Vector3::from(self.speeds).norm() + self.slip.abs()
    }
}

/// The box with its images.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Cell {
    pub domain: Domain,
    pub drift: ImageDrift,
}

impl From<Domain> for Cell {
    fn from(domain: Domain) -> Self {
        Cell {
            domain,
            drift: ImageDrift::default(),
        }
    }
}

impl Cell {
    /// The shortest image of a separation (m), and the velocity of that image against the box (m/s).
    pub fn nearest(&self, separation: Vector3<f64>) -> (Vector3<f64>, Vector3<f64>) {
        if !self.drift.moves() {
            return (self.domain.nearest_image(separation), Vector3::zeros());
        }
        self.taken_back(separation, |d, length, _| (d / length).round_ties_even())
    }

    /// The image of a position inside the box (m), and the velocity of the one it was (m/s).
    pub fn wrap(&self, position: Vector3<f64>) -> (Vector3<f64>, Vector3<f64>) {
        if !self.drift.moves() {
            return (self.domain.wrap(position), Vector3::zeros());
        }
        let (lower, upper) = (self.domain.lower, self.domain.upper);
        let (mut x, w) = self.taken_back(position, |x, length, k| {
            let turns = ((x - lower[k]) / length).floor();
            // Round-off may land a hair below `lower` on the upper edge itself.
            if x - length * turns >= upper[k] {
                turns + 1.0
            } else {
                turns
            }
        });
        for k in (0..3).filter(|&k| self.domain.periodic[k]) {
            x[k] = x[k].max(lower[k]);
        }
        (x, w)
    }

    /// Takes off so many boxes along each axis, that of the shear first.
    fn taken_back(
        &self,
        mut x: Vector3<f64>,
        turns: impl Fn(f64, f64, usize) -> f64,
    ) -> (Vector3<f64>, Vector3<f64>) {
        let (lengths, drift) = (self.domain.lengths(), &self.drift);
        let mut velocity = Vector3::zeros();
        // x comes last: shear shifts along it.
        for k in [1, 2, 0].into_iter().filter(|&k| self.domain.periodic[k]) {
            let n = turns(x[k], lengths[k], k);
            x[k] -= lengths[k] * n;
            velocity[k] += drift.speeds[k] * n;
            if k == drift.gradient && k > 0 {
                x[0] -= drift.offset * n;
                velocity[0] += drift.slip * n;
            }
        }
        (x, velocity)
    }

    /// Velocity that uniform deformation has at a place (m/s), zero at the centre of the box.
    pub fn stream(&self, x: &Vector3<f64>) -> Vector3<f64> {
        let lengths = self.domain.lengths();
        let away = x - 0.5 * (self.domain.lower + self.domain.upper);
        let mut v = Vector3::from_fn(|k, _| self.drift.speeds[k] / lengths[k] * away[k]);
        if self.drift.slip != 0.0 {
            let g = self.drift.gradient;
            // What the offset grows by with the edge along x is no shear.
            let with_edge = self.drift.offset * (self.drift.speeds[0] / lengths.x);
            v.x += (self.drift.slip - with_edge) / lengths[g] * away[g];
        }
        v
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
    /// Whether images move or are shifted: only then is `drift` looked at.
    pub moves: bool,
    pub drift: ImageDrift,
}

impl Images {
    pub fn of(&Cell { domain, drift }: &Cell) -> Self {
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
            moves: drift.moves(),
            drift,
        }
    }

    /// The axis whose images are shifted along x, if any are.
    pub fn sheared(&self) -> Option<usize> {
        let sheared = self.drift.offset != 0.0 || self.drift.slip != 0.0;
        sheared.then_some(self.drift.gradient)
    }

    /// Squared distance of the nearest images of two centres (m²).
    #[inline(always)]
    pub fn distance_squared(&self, a: &[f64; 4], b: &[f64; 4]) -> f64 {
        let mut sum = 0.0;
        let shift = if self.moves {
            let k = self.drift.gradient;
            self.drift.offset * nearest_integer((a[k] - b[k]) * self.inverse[k])
        } else {
            0.0
        };
        for k in 0..3 {
            let d = a[k] - b[k] - if k == 0 { shift } else { 0.0 };
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
    fn moving_images_keep_their_distance_and_their_velocity_against_each_other() {
        let domain = Domain {
            lower: Vector3::new(-1.0, 0.0, 2.0),
            upper: Vector3::new(1.0, 3.0, 6.0),
            periodic: [true; 3],
        };
        let drift = ImageDrift {
            speeds: [0.0; 3],
            gradient: 2,
            offset: 0.7,
            slip: -0.3,
        };
        let cell = Cell { domain, drift };
        let images = Images::of(&cell);
        let row = |x: &Vector3<f64>| [x.x, x.y, x.z, 0.0];
        let (a, b) = (Vector3::new(0.9, 0.1, 2.1), Vector3::new(-0.1, 2.9, 5.9));
        let (apart, velocity) = cell.nearest(a - b);
        // One box up: b's image lies at (-0.1 - 0.7, -0.1, 1.9), a wraps to it round x.
        assert!(
            (apart - Vector3::new(-0.3, 0.2, 0.2)).norm() < 1e-12,
            "{apart}"
        );
        assert_eq!(velocity, Vector3::new(0.3, 0.0, 0.0));
        assert!((images.distance_squared(&row(&a), &row(&b)) - 0.17).abs() < 1e-12);
        // The same from any image of either.
        for turns in [[0, 0, 1], [3, 1, -2], [-1, 0, 4]] {
            let n = Vector3::from(turns.map(f64::from));
            let mut away = domain.lengths().component_mul(&n);
            away.x += drift.offset * n.z;
            let (same, w) = cell.nearest(a + away - b);
            assert!((same - apart).norm() < 1e-12);
            assert!((w - velocity - Vector3::new(drift.slip * n.z, 0.0, 0.0)).norm() < 1e-12);
            let (inside, w) = cell.wrap(a + away);
            assert!((inside - a).norm() < 1e-12);
            assert!((w.x - drift.slip * n.z).abs() < 1e-12);
        }
        let stretched = Cell {
            domain,
            drift: ImageDrift {
                speeds: [0.5, 0.0, -1.0],
                ..ImageDrift::default()
            },
        };
        let (_, w) = stretched.nearest(Vector3::new(1.9, 0.0, -7.9));
        assert_eq!(w, Vector3::new(0.5, 0.0, 2.0));
        let corner = stretched.stream(&domain.upper);
        assert!((corner - Vector3::new(0.25, 0.0, -0.5)).norm() < 1e-15);
    }

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
