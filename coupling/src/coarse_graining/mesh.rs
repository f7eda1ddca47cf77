//! Where fields are evaluated, and along which axes they are averaged.

use super::AveragerError;
use nalgebra::Vector3;
use serde::{Deserialize, Serialize};
use std::f64::consts::TAU;

/// Geometry of an average.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Geometry {
    /// Fields at single points (m).
    Points(Vec<[f64; 3]>),
    /// Along z, averaged over x and y of the box.
    LineZ,
    /// In the plane of x and z, averaged over y of the box.
    PlaneXZ,
    /// In space.
    Grid,
    /// Around an axis parallel to z through a point (x, y) (m): x is the distance from the axis, y the angle.
    /// Vectors and tensors are turned into radial, azimuthal and axial parts and averaged over the angles.
    Cylinder {
        /// Where the axis meets z = 0 (m).
        axis: [f64; 2],
        /// Angles the azimuth is averaged over.
        angles: usize,
    },
}

/// Cells of equal size; fields are evaluated at their centres. Axes that the geometry averages away are not used,
/// nor is anything for [`Geometry::Points`]; of a cylinder, x is the radius.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Cells {
    /// Lower corner (m).
    pub lower: [f64; 3],
    /// Edges of a cell (m).
    pub size: [f64; 3],
    /// Cells along each axis.
    pub count: [usize; 3],
}

impl Cells {
    /// Cells of about the given size that fill a box.
    pub fn filling(lower: [f64; 3], upper: [f64; 3], about: f64) -> Self {
        let count = std::array::from_fn(|k| ((upper[k] - lower[k]) / about).round().max(1.0));
        Self {
            lower,
            size: std::array::from_fn(|k| (upper[k] - lower[k]) / count[k]),
            count: count.map(|n| n as usize),
        }
    }
}

/// Most points of a mesh: about 25 GB of sums.
const MOST_POINTS: usize = 50_000_000;

/// The points of a geometry.
#[derive(Clone, Debug, PartialEq)]
pub struct Mesh {
    geometry: Geometry,
    cells: Cells,
    points: Vec<Vector3<f64>>,
}

impl Mesh {
    /// Lays out the points.
    ///
    /// # Errors
    /// If a size is not positive, a count is 0, or there are too many points.
    pub fn new(geometry: Geometry, mut cells: Cells) -> Result<Self, AveragerError> {
        let fail = |key, value, allowed| {
            Err(AveragerError::OutOfRange {
                key,
                value,
                allowed,
            })
        };
        match &geometry {
            Geometry::LineZ => cells.count[..2].fill(1),
            Geometry::PlaneXZ => cells.count[1] = 1,
            Geometry::Cylinder { angles, .. } => {
                if *angles == 0 {
                    return fail("angles", 0.0, "at least 1");
                }
                cells.count[1] = *angles;
                if cells.lower[0] < 0.0 {
                    return fail("lower.x", cells.lower[0], "a radius of at least 0 m");
                }
            }
            Geometry::Points(points) => {
                if points.is_empty() {
                    return fail("points", 0.0, "at least 1");
                }
                cells.count = [points.len(), 1, 1];
            }
            Geometry::Grid => {}
        }
        let uses = |axis: usize| match geometry {
            Geometry::Points(_) => false,
            Geometry::LineZ => axis == 2,
            Geometry::PlaneXZ | Geometry::Cylinder { .. } => axis != 1,
            Geometry::Grid => true,
        };
        for axis in (0..3).filter(|&axis| uses(axis)) {
            let size = cells.size[axis];
            if !(size > 0.0 && size.is_finite()) {
                return fail("cell size", size, "a positive length in m");
            }
            if cells.count[axis] == 0 {
                return fail("cells", 0.0, "at least 1 along each axis");
            }
            if !cells.lower[axis].is_finite() {
                return fail("lower corner", cells.lower[axis], "a position in m");
            }
        }
        let total = cells
            .count
            .iter()
            .try_fold(1usize, |a, &b| a.checked_mul(b));
        if total.is_none_or(|n| n > MOST_POINTS) {
            let found = cells.count.iter().map(|&n| n as f64).product();
            return fail("cells", found, "at most 50 million in all");
        }
        let mut mesh = Self {
            geometry,
            cells,
            points: Vec::new(),
        };
        mesh.points = mesh.lay_out();
        Ok(mesh)
    }

    fn lay_out(&self) -> Vec<Vector3<f64>> {
        if let Geometry::Points(points) = &self.geometry {
            return points.iter().map(|p| Vector3::from(*p)).collect();
        }
        let mut points = Vec::with_capacity(self.cells.count.iter().product());
        for k in 0..self.cells.count[2] {
            for j in 0..self.cells.count[1] {
                for i in 0..self.cells.count[0] {
                    let at = |axis: usize, n: usize| {
                        self.cells.lower[axis] + self.cells.size[axis] * (n as f64 + 0.5)
                    };
                    points.push(match self.geometry {
                        Geometry::LineZ => Vector3::new(0.0, 0.0, at(2, k)),
                        Geometry::PlaneXZ => Vector3::new(at(0, i), 0.0, at(2, k)),
                        Geometry::Cylinder { axis, .. } => {
                            let (sine, cosine) = self.angle(j).sin_cos();
                            Vector3::new(
                                axis[0] + at(0, i) * cosine,
                                axis[1] + at(0, i) * sine,
                                at(2, k),
                            )
                        }
                        _ => Vector3::new(at(0, i), at(1, j), at(2, k)),
                    });
                }
            }
        }
        points
    }

    /// Azimuth of the j-th of the angles of a cylinder (rad).
    pub(super) fn angle(&self, j: usize) -> f64 {
        TAU * (j as f64 + 0.5) / self.cells.count[1] as f64
    }

    /// The geometry.
    pub fn geometry(&self) -> &Geometry {
        &self.geometry
    }

    /// The cells.
    pub fn cells(&self) -> &Cells {
        &self.cells
    }

    /// Points, x fastest, then y, then z.
    pub fn points(&self) -> &[Vector3<f64>] {
        &self.points
    }

    /// Axes that fields vary along; the kernel has as many dimensions.
    pub fn active(&self) -> [bool; 3] {
        match self.geometry {
            Geometry::LineZ => [false, false, true],
            Geometry::PlaneXZ => [true, false, true],
            _ => [true; 3],
        }
    }

    /// How many axes that are.
    pub fn dimensions(&self) -> usize {
        self.active().iter().filter(|a| **a).count()
    }

    /// Points of the n-th block of points that a thread may fill by itself, as a number of points.
    pub(super) fn points_per_block(&self) -> usize {
        match self.geometry {
            Geometry::Points(_) => 64,
            _ => self.cells.count[0] * self.cells.count[1],
        }
    }

    /// Indices i and j of the points of a block that a box around a grain can touch, in a block of points of one z.
    pub(super) fn touched(&self, low: &Vector3<f64>, high: &Vector3<f64>) -> [[usize; 2]; 2] {
        let whole = [[0, self.cells.count[0]], [0, self.cells.count[1]]];
        let range = |axis: usize| {
            let n = self.cells.count[axis] as f64;
            let index = |x: f64| (x - self.cells.lower[axis]) / self.cells.size[axis] - 0.5;
            let from = index(low[axis]).ceil().clamp(0.0, n);
            let to = (index(high[axis]).floor() + 1.0).clamp(from, n);
            [from as usize, to as usize]
        };
        match self.geometry {
            Geometry::Grid => [range(0), range(1)],
            Geometry::PlaneXZ => [range(0), [0, 1]],
            _ => whole,
        }
    }
}
