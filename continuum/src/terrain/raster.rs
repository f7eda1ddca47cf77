//! Heights on a regular raster, as maps of terrain come.

use super::Surface;
use crate::error::{Error, require};

/// A y that lies outside by less than this part of the distance of rows lies on the edge.
const ROUND_OFF: f64 = 1e-9;

/// Heights at the points of a regular raster, x running fastest, then y.
#[derive(Debug, Clone, PartialEq)]
pub struct HeightRaster {
    /// Position (x, y) of the first point (m): the one of smallest x and y.
    pub origin: [f64; 2],
    /// Distance of neighbouring points along x and y (m).
    pub spacing: [f64; 2],
    /// Points along x and y.
    pub points: [usize; 2],
    /// Heights (m).
    pub heights: Vec<f64>,
}

impl HeightRaster {
    /// Refuses rasters without area or with holes.
    ///
    /// # Errors
    /// [`Error::OutOfRange`] with the key, the value and the allowed range.
    pub fn validate(&self) -> Result<(), Error> {
        for axis in 0..2 {
            require(
                self.points[axis] >= 2,
                "terrain.points",
                self.points[axis] as f64,
                "at least 2 along each axis",
            )?;
            require(
                self.spacing[axis] > 0.0,
                "terrain.spacing",
                self.spacing[axis],
                "greater than 0 m and finite",
            )?;
        }
        let expected = self.points[0] * self.points[1];
        require(
            self.heights.len() == expected,
            "terrain.heights",
            self.heights.len() as f64,
            format!("{expected}, one for each point"),
        )?;
        for height in &self.heights {
            require(
                true,
                "terrain.heights",
                *height,
                "finite heights: terrain must have no holes",
            )?;
        }
        Ok(())
    }

    /// The surface through the points: two triangles for each square, which meet along the diagonal
    /// with the smaller step in height, so that ridges and valleys are followed.
    ///
    /// # Errors
    /// As [`validate`](Self::validate).
    pub fn surface(&self) -> Result<Surface, Error> {
        self.validate()?;
        let [columns, rows] = self.points;
        let mut vertices = Vec::with_capacity(columns * rows);
        for row in 0..rows {
            for column in 0..columns {
                vertices.push([
                    self.origin[0] + column as f64 * self.spacing[0],
                    self.origin[1] + row as f64 * self.spacing[1],
                    self.heights[column + columns * row],
                ]);
            }
        }
        let mut triangles = Vec::with_capacity(2 * (columns - 1) * (rows - 1));
        for row in 0..rows - 1 {
            for column in 0..columns - 1 {
                let first = column + columns * row;
                let [a, b, c, d] = [first, first + 1, first + columns + 1, first + columns];
                let step = |p: usize, q: usize| (self.heights[p] - self.heights[q]).abs();
                if step(a, c) <= step(b, d) {
                    triangles.extend([[a, b, c], [a, c, d]]);
                } else {
                    triangles.extend([[a, b, d], [b, c, d]]);
                }
            }
        }
        Surface::new(vertices, triangles)
    }

    /// The profile along x at the row nearest to y (m), for a plane flow. The line ends with the raster, and a grid has to
    /// lie within it.
    ///
    /// # Errors
    /// As [`validate`](Self::validate), and for a y outside of the raster.
    pub fn profile(&self, y: f64) -> Result<super::Profile, Error> {
        self.validate()?;
        let [columns, rows] = self.points;
        let (first, last) = (self.origin[1], (rows - 1) as f64);
        let place = (y - first) / self.spacing[1];
        require(
            (-ROUND_OFF..=last + ROUND_OFF).contains(&place),
            "terrain.y",
            y,
            format!(
                "{first} to {} m: where the raster has heights",
                first + last * self.spacing[1]
            ),
        )?;
        let row = place.round().clamp(0.0, last) as usize;
        let points = (0..columns).map(|column| {
            [
                self.origin[0] + column as f64 * self.spacing[0],
                self.heights[column + columns * row],
            ]
        });
        super::Profile::new(points.collect())
    }
}
