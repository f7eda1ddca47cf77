//! Heights: ground made from sums of profiles, and what a surface's heights are.

use super::Surface;
use super::surface::clip;
use crate::error::{Error, require};

/// Heights z(x, y) = f(x) + g(y) + h(r) of broken lines, r being the distance from x = y = 0. A line goes on level beyond
/// its ends; one without points is zero.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct HeightSum {
    /// Points (x, f) (m).
    pub along_x: Vec<[f64; 2]>,
    /// Points (y, g) (m).
    pub along_y: Vec<[f64; 2]>,
    /// Points (r, h) (m).
    pub radial: Vec<[f64; 2]>,
}

/// The height of a broken line at a place.
fn height_of(points: &[[f64; 2]], place: f64) -> f64 {
    let (Some(first), Some(last)) = (points.first(), points.last()) else {
        return 0.0;
    };
    let inside = points
        .windows(2)
        .find(|pair| pair[0][0] <= place && place < pair[1][0]);
    match inside {
        Some(pair) => {
            let ([from, low], [to, high]) = (pair[0], pair[1]);
            low + (high - low) * ((place - from) / (to - from))
        }
        None if place < first[0] => first[1],
        None => last[1],
    }
}

impl HeightSum {
    /// Refuses lines of one point and places that do not increase.
    ///
    /// # Errors
    /// [`Error::OutOfRange`] with the key, the value and the allowed range.
    pub fn validate(&self) -> Result<(), Error> {
        for (key, points) in [
            ("terrain.along_x", &self.along_x),
            ("terrain.along_y", &self.along_y),
            ("terrain.radial", &self.radial),
        ] {
            require(
                points.len() != 1,
                key,
                1.0,
                "at least 2 points [place, height] in m",
            )?;
            for [place, height] in points {
                require(true, key, *place, "finite places")?;
                require(true, key, *height, "finite heights")?;
            }
            for pair in points.windows(2) {
                require(
                    pair[1][0] > pair[0][0],
                    key,
                    pair[1][0],
                    format!("places that increase, here more than {} m", pair[0][0]),
                )?;
            }
        }
        if let Some([first, _]) = self.radial.first() {
            require(
                *first >= 0.0,
                "terrain.radial",
                *first,
                "distances from the axis, at least 0 m",
            )?;
        }
        Ok(())
    }

    /// The height at a place (m).
    pub fn height(&self, [x, y]: [f64; 2]) -> f64 {
        height_of(&self.along_x, x)
            + height_of(&self.along_y, y)
            + height_of(&self.radial, x.hypot(y))
    }

    /// Whether it is the same in all directions.
    pub fn is_radial(&self) -> bool {
        self.along_x.is_empty() && self.along_y.is_empty()
    }

    /// The surface over a rectangle: four triangles round the middle of each of its parts. They end where lines break,
    /// which makes them exact but for the radial part; with one they are no longer than `size` (m), too.
    ///
    /// # Errors
    /// As [`validate`](Self::validate), and for a size of 0.
    pub fn surface(&self, low: [f64; 2], high: [f64; 2], size: f64) -> Result<Surface, Error> {
        self.validate()?;
        require(size > 0.0, "terrain.size", size, "greater than 0 m")?;
        let places = [0, 1].map(|axis| {
            let line = [&self.along_x, &self.along_y][axis];
            let parts = if self.radial.is_empty() {
                1
            } else {
                ((high[axis] - low[axis]) / size).ceil().max(1.0) as usize
            };
            let step = (high[axis] - low[axis]) / parts as f64;
            let even = (0..=parts).map(|n| {
                if n == parts {
                    high[axis]
                } else {
                    low[axis] + n as f64 * step
                }
            });
            let breaks = line.iter().map(|point| point[0]);
            let inside = breaks.filter(|place| *place > low[axis] && *place < high[axis]);
            let mut places: Vec<f64> = even.chain(inside).collect();
            places.sort_by(f64::total_cmp);
            places.dedup_by(|b, a| *b - *a < 1e-9 * size);
            places
        });
        let [xs, ys] = &places;
        let at = |place: [f64; 2]| [place[0], place[1], self.height(place)];
        let mut vertices: Vec<[f64; 3]> = ys
            .iter()
            .flat_map(|&y| xs.iter().map(move |&x| at([x, y])))
            .collect();
        let mut triangles = Vec::new();
        for (j, y) in ys.windows(2).enumerate() {
            for (i, x) in xs.windows(2).enumerate() {
                let middle = vertices.len();
                vertices.push(at([0.5 * (x[0] + x[1]), 0.5 * (y[0] + y[1])]));
                let a = i + j * xs.len();
                let round = [a, a + 1, a + 1 + xs.len(), a + xs.len()];
                triangles.extend((0..4).map(|n| [round[n], round[(n + 1) % 4], middle]));
            }
        }
        Surface::new(vertices, triangles)
    }
}

impl Surface {
    /// Lowest and highest point over a rectangle (m); nothing if there is none.
    pub fn heights_over(&self, low: [f64; 2], high: [f64; 2]) -> Option<[f64; 2]> {
        let mut found: Option<[f64; 2]> = None;
        for corners in self.triangles() {
            let mut part = corners.map(|c| self.vertices()[c]).to_vec();
            for axis in 0..2 {
                part = clip(&part, axis, low[axis], true);
                part = clip(&part, axis, high[axis], false);
            }
            for [_, _, z] in part {
                found = Some(found.map_or([z, z], |[a, b]| [a.min(z), b.max(z)]));
            }
        }
        found
    }

    /// Height of the highest ground at a place (m), if there is ground.
    pub fn height_at(&self, place: [f64; 2]) -> Option<f64> {
        self.heights_over(place, place).map(|[_, high]| high)
    }

    /// The same surface with its zero at another place (m) and in another unit of length (m).
    ///
    /// # Errors
    /// As [`new`](Self::new).
    pub fn seen_from(&self, zero: [f64; 3], unit: f64) -> Result<Self, Error> {
        let moved = |v: &[f64; 3]| std::array::from_fn(|a| (v[a] - zero[a]) / unit);
        Self::new(
            self.vertices().iter().map(moved).collect(),
            self.triangles().to_vec(),
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn heights_add_up() {
        let sum = HeightSum {
            along_x: vec![[-1.0, 0.3], [0.5, 0.0]],
            along_y: vec![[0.0, 0.0], [1.0, 0.4]],
            radial: vec![[0.0, 1.0], [1.0, 0.0]],
        };
        assert!((sum.height([-0.25, 0.5]) - (0.15 + 0.2 + 1.0 - 0.3125_f64.sqrt())).abs() < 1e-15);
        assert_eq!(sum.height([-4.0, 5.0]), 0.3 + 0.4);
        let surface = sum.surface([-1.0; 2], [1.0; 2], 0.1).unwrap();
        let found = surface.height_at([-0.25, 0.5]).unwrap();
        // The cone is made of triangles.
        assert!((found - sum.height([-0.25, 0.5])).abs() < 2e-3, "{found}");
        let [low, high] = surface.heights_over([-1.0; 2], [1.0; 2]).unwrap();
        assert!(
            low.abs() < 1e-15 && (high - 1.1).abs() < 1e-3,
            "{low} {high}"
        );
        assert_eq!(surface.height_at([1.5, 0.0]), None);
    }

    #[test]
    fn bad_lines_are_refused_by_key() {
        let message = |sum: HeightSum| sum.validate().unwrap_err().to_string();
        let lone = message(HeightSum {
            along_x: vec![[0.0, 1.0]],
            ..HeightSum::default()
        });
        assert!(
            lone.contains("terrain.along_x") && lone.contains("2 points"),
            "{lone}"
        );
        let back = message(HeightSum {
            along_y: vec![[0.0, 1.0], [0.0, 2.0]],
            ..HeightSum::default()
        });
        assert!(
            back.contains("terrain.along_y") && back.contains("increase"),
            "{back}"
        );
        let inner = message(HeightSum {
            radial: vec![[-1.0, 1.0], [0.0, 2.0]],
            ..HeightSum::default()
        });
        assert!(inner.contains("terrain.radial"), "{inner}");
    }
}
