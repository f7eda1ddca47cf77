//! Ground under a flow: how it cuts the cells of a grid.
//!
//! Ground comes as a [`Profile`] in the plane, as a [`Surface`] of triangles in space, or as a
//! [`HeightRaster`], which becomes triangles. What a grid has to know of it is exact for these
//! piecewise plane shapes: the part of each cell and of each face that is free of ground, and the
//! ground's surface in each cell as an area and a vector.
//!
//! All of it is one sum. Ground fills the points below the surface, counted with the sign of its outer
//! normal where the surface folds over itself: a point under a roof lies below the roof (+1) and below
//! its soffit (−1). So every piece of surface adds, with its sign, what lies under it, cut to the cell.
//! Nothing is sampled, overhangs need no special case, and per cell the free parts of the faces and the
//! wall close to a vector of zero to round-off.

mod bends;
mod heights;
mod nearest;
mod profile;
mod raster;
mod section;
mod surface;

pub use bends::{Shape, Under};
pub use heights::HeightSum;
pub use profile::Profile;
pub use raster::HeightRaster;
pub use surface::Surface;

use crate::error::{Error, require};

/// A shape of ground: what a grid has to know of it.
pub trait Relief<const N: usize> {
    /// How the ground cuts the cells of a grid, which it has to span along the horizontal axes.
    ///
    /// # Errors
    /// [`Error::OutOfRange`] for a grid that reaches beyond the ground.
    fn cut(&self, lines: &GridLines<N>) -> Result<CutCells<N>, Error>;

    /// The distance of points of a grid from the ground's surface (m); what lies far off may count as some cells away.
    fn distances(&self, lines: &GridLines<N>) -> impl Fn([f64; N]) -> f64;

    /// The ground in cells within which its surface bends, piece by piece and in the order of the cells; in others a plane says
    /// where it lies.
    fn bends(&self, lines: &GridLines<N>) -> Vec<Under>;
}

impl Relief<2> for Profile {
    fn cut(&self, lines: &GridLines<2>) -> Result<CutCells<2>, Error> {
        Profile::cut(self, lines)
    }

    fn distances(&self, _: &GridLines<2>) -> impl Fn([f64; 2]) -> f64 {
        |point| self.distance(point)
    }

    fn bends(&self, lines: &GridLines<2>) -> Vec<Under> {
        Profile::bends(self, lines)
    }
}

/// Open terrain: ground below it without end.
impl Relief<3> for Surface {
    fn cut(&self, lines: &GridLines<3>) -> Result<CutCells<3>, Error> {
        Surface::cut(self, lines, false)
    }

    fn distances(&self, lines: &GridLines<3>) -> impl Fn([f64; 3]) -> f64 {
        let nearest = nearest::Nearest::new(self, lines);
        move |point| nearest.distance(point)
    }

    fn bends(&self, lines: &GridLines<3>) -> Vec<Under> {
        Surface::bends(self, lines)
    }
}

/// A grid of equal cells in N dimensions; the last axis points up.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct GridLines<const N: usize> {
    /// Corner of the first cell (m).
    pub origin: [f64; N],
    /// Size of a cell (m).
    pub spacing: [f64; N],
    /// Cells along each axis.
    pub cells: [usize; N],
}

impl<const N: usize> GridLines<N> {
    /// Refuses grids without cells or without size.
    ///
    /// # Errors
    /// [`Error::OutOfRange`] with the key, the value and the allowed range.
    pub fn validate(&self) -> Result<(), Error> {
        for axis in 0..N {
            require(
                self.spacing[axis] > 0.0,
                "grid.spacing",
                self.spacing[axis],
                "greater than 0 m and finite",
            )?;
            require(
                self.cells[axis] >= 1,
                "grid.cells",
                self.cells[axis] as f64,
                "at least 1",
            )?;
            require(
                true,
                "grid.origin",
                self.origin[axis],
                "any finite position",
            )?;
        }
        Ok(())
    }

    /// Position of a grid line of an axis (m).
    pub fn line(&self, axis: usize, number: usize) -> f64 {
        self.origin[axis] + number as f64 * self.spacing[axis]
    }

    /// Number of cells.
    pub fn count(&self) -> usize {
        self.cells.iter().product()
    }

    /// Volume of a cell (m^N).
    pub fn cell_volume(&self) -> f64 {
        self.spacing.iter().product()
    }

    /// Area of a face normal to an axis (m^(N−1)).
    pub fn face_area(&self, axis: usize) -> f64 {
        self.cell_volume() / self.spacing[axis]
    }

    /// Number of a cell, or of the face below it along `axis`; x runs fastest.
    fn number(&self, index: [usize; N], axis: Option<usize>) -> usize {
        let mut number = 0;
        for a in (0..N).rev() {
            number = number * (self.cells[a] + usize::from(axis == Some(a))) + index[a];
        }
        number
    }

    /// Faces normal to an axis.
    fn faces(&self, axis: usize) -> usize {
        self.count() / self.cells[axis] * (self.cells[axis] + 1)
    }

    /// Positions as seen from the grid's origin, where far-off coordinates lose no digits.
    fn local(&self, positions: &[[f64; N]]) -> Vec<[f64; N]> {
        positions
            .iter()
            .map(|position| std::array::from_fn(|a| position[a] - self.origin[a]))
            .collect()
    }

    /// Position of a grid line seen from the origin (m).
    fn local_line(&self, axis: usize, number: usize) -> f64 {
        number as f64 * self.spacing[axis]
    }

    /// Moves horizontal positions that are the grid's ends but for round-off onto them.
    fn snap(&self, positions: &mut [[f64; N]]) {
        for axis in 0..N - 1 {
            for end in [0.0, self.local_line(axis, self.cells[axis])] {
                for position in positions.iter_mut() {
                    if (position[axis] - end).abs() <= SLACK * self.spacing[axis] {
                        position[axis] = end;
                    }
                }
            }
        }
    }

    /// Refuses a grid that reaches beyond the ground, which spans `low` to `high` (seen from the
    /// origin) along an axis.
    fn require_inside(
        &self,
        axis: usize,
        low: f64,
        high: f64,
        key: &'static str,
    ) -> Result<(), Error> {
        let end = self.local_line(axis, self.cells[axis]);
        let slack = SLACK * self.spacing[axis];
        for (x, holds) in [(0.0, low <= slack), (end, high >= end - slack)] {
            require(
                holds,
                key,
                x + self.origin[axis],
                format!(
                    "a grid between {} and {} m, where there is ground",
                    low + self.origin[axis],
                    high + self.origin[axis]
                ),
            )?;
        }
        Ok(())
    }

    /// Whether an interval reaches across a grid line. Lines see what lies on their left, so that
    /// ground that ends on a line counts once; the first one sees what lies on its right.
    fn crosses(&self, line: usize, x: f64, left: f64, right: f64) -> bool {
        if line == 0 {
            left <= x && right > x
        } else {
            left < x && right >= x
        }
    }

    /// Whether a cell holds ground's surface that runs along one of its faces at `x`, in agreement
    /// with [`crosses`](Self::crosses): the lower face, not the upper one, nor the grid's first one.
    fn holds(&self, axis: usize, cell: usize, x: f64, low: f64, high: f64) -> bool {
        let is_end = cell == 0 && axis + 1 < N;
        if is_end {
            x > low && x < high
        } else {
            x >= low && x < high
        }
    }

    /// The cells along an axis between which an interval lies, one more on each side for round-off.
    fn reach(&self, axis: usize, low: f64, high: f64) -> std::ops::Range<usize> {
        let number = |x: f64| x / self.spacing[axis];
        let cells = self.cells[axis] as f64;
        let first = (number(low).floor() - 1.0).clamp(0.0, cells);
        let last = (number(high).floor() + 2.0).clamp(0.0, cells);
        first as usize..last as usize
    }

    /// The index of each cell, x fastest.
    fn indices(&self) -> impl Iterator<Item = [usize; N]> + use<N> {
        let cells = self.cells;
        (0..self.count()).map(move |mut number| {
            let mut index = [0; N];
            for (i, n) in index.iter_mut().zip(cells) {
                *i = number % n;
                number /= n;
            }
            index
        })
    }
}

/// The ground's surface within one cell.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Wall<const N: usize> {
    /// ∫ n dA (m^(N−1)), n pointing out of the ground.
    pub area_vector: [f64; N],
    /// ∫ dA (m^(N−1)): larger than the vector's length where the surface bends.
    pub area: f64,
    /// ∫ x dA / ∫ dA (m).
    pub centre: [f64; N],
}

impl<const N: usize> Wall<N> {
    const NONE: Self = Self {
        area_vector: [0.0; N],
        area: 0.0,
        centre: [0.0; N],
    };

    /// Mean unit normal, out of the ground; zero where the surface faces itself.
    pub fn normal(&self) -> [f64; N] {
        let length = self.area_vector.iter().map(|a| a * a).sum::<f64>().sqrt();
        if length > 0.0 {
            self.area_vector.map(|a| a / length)
        } else {
            [0.0; N]
        }
    }

    /// Adds a plane piece; `centre` holds ∫ x dA until all are in.
    fn add(&mut self, area_vector: [f64; N], centre: [f64; N]) {
        let area = area_vector.iter().map(|a| a * a).sum::<f64>().sqrt();
        self.area += area;
        for axis in 0..N {
            self.area_vector[axis] += area_vector[axis];
            self.centre[axis] += area * centre[axis];
        }
    }
}

/// How ground cuts the cells of a grid.
#[derive(Debug, Clone, PartialEq)]
pub struct CutCells<const N: usize> {
    lines: GridLines<N>,
    volumes: Vec<f64>,
    apertures: [Vec<f64>; N],
    walls: Vec<Wall<N>>,
}

impl<const N: usize> CutCells<N> {
    /// Cells without ground; what is added is ground, until [`finish`](Self::finish).
    fn open(lines: GridLines<N>) -> Result<Self, Error> {
        lines.validate()?;
        Ok(Self {
            volumes: vec![0.0; lines.count()],
            apertures: std::array::from_fn(|axis| vec![0.0; lines.faces(axis)]),
            walls: vec![Wall::NONE; lines.count()],
            lines,
        })
    }

    /// From volumes and areas of ground to fractions free of it. A face onto a cell that is full of
    /// ground is closed, and is then part of the wall of the cell on its other side.
    fn finish(mut self) -> Self {
        let lines = self.lines;
        let free = |ground: f64, whole: f64| (1.0 - ground / whole).clamp(0.0, 1.0);
        for volume in &mut self.volumes {
            *volume = free(*volume, lines.cell_volume());
            // Round-off of the sums must not leave slivers.
            if *volume < SLIVER {
                *volume = 0.0;
            }
        }
        for axis in 0..N {
            for aperture in &mut self.apertures[axis] {
                *aperture = free(*aperture, lines.face_area(axis));
                if *aperture < SLIVER {
                    *aperture = 0.0;
                }
            }
        }
        for index in lines.indices() {
            if self.volumes[lines.number(index, None)] == 0.0 {
                self.close(index);
            }
        }
        for wall in &mut self.walls {
            if wall.area > 0.0 {
                wall.centre = std::array::from_fn(|a| wall.centre[a] / wall.area + lines.origin[a]);
            }
        }
        self
    }

    /// Closes the faces of a cell that is full of ground.
    fn close(&mut self, index: [usize; N]) {
        let lines = self.lines;
        self.walls[lines.number(index, None)] = Wall::NONE;
        for axis in 0..N {
            for side in [0, 1] {
                let mut face = index;
                face[axis] += side;
                let slot = lines.number(face, Some(axis));
                let open = std::mem::take(&mut self.apertures[axis][slot]);
                let mut neighbour = index;
                let inside = if side == 0 {
                    index[axis].checked_sub(1)
                } else {
                    Some(index[axis] + 1).filter(|n| *n < lines.cells[axis])
                };
                let Some(beside) = inside.filter(|_| open > 0.0) else {
                    continue;
                };
                neighbour[axis] = beside;
                let mut area_vector = [0.0; N];
                // Out of the full cell.
                let sign = if side == 0 { -1.0 } else { 1.0 };
                area_vector[axis] = sign * open * lines.face_area(axis);
                let centre = std::array::from_fn(|a| {
                    let middle = lines.local_line(a, face[a]);
                    if a == axis {
                        middle
                    } else {
                        middle + 0.5 * lines.spacing[a]
                    }
                });
                self.walls[lines.number(neighbour, None)].add(area_vector, centre);
            }
        }
    }

    /// The grid.
    pub fn lines(&self) -> &GridLines<N> {
        &self.lines
    }

    /// Fraction of a cell's volume that is free of ground.
    pub fn volume_fraction(&self, index: [usize; N]) -> f64 {
        self.volumes[self.lines.number(index, None)]
    }

    /// Fraction of the face below a cell along an axis that is free of ground; `index[axis]` may be
    /// one beyond the last cell.
    pub fn aperture(&self, axis: usize, index: [usize; N]) -> f64 {
        self.apertures[axis][self.lines.number(index, Some(axis))]
    }

    /// The ground's surface in a cell, if any.
    pub fn wall(&self, index: [usize; N]) -> Option<&Wall<N>> {
        Some(&self.walls[self.lines.number(index, None)]).filter(|wall| wall.area > 0.0)
    }

    /// Volume free of ground (m^N).
    pub fn free_volume(&self) -> f64 {
        self.volumes.iter().sum::<f64>() * self.lines.cell_volume()
    }

    /// Σ (free face areas, outwards) − ∫ n dA of a cell's wall (m^(N−1)): zero but for round-off,
    /// because a uniform pressure exerts no force.
    pub fn closure(&self, index: [usize; N]) -> [f64; N] {
        let wall = self.walls[self.lines.number(index, None)].area_vector;
        std::array::from_fn(|axis| {
            let mut above = index;
            above[axis] += 1;
            let open = self.aperture(axis, above) - self.aperture(axis, index);
            open * self.lines.face_area(axis) - wall[axis]
        })
    }
}

/// Positions are the same if they differ by less than this fraction of a cell.
const SLACK: f64 = 1e-9;
/// Free fractions below this are round-off.
const SLIVER: f64 = 1e-13;

/// A coordinate that no number is: a position must be one.
fn require_positions<const M: usize>(
    key: &'static str,
    positions: &[[f64; M]],
) -> Result<(), Error> {
    let coordinates = positions.iter().flatten();
    for coordinate in coordinates {
        require(true, key, *coordinate, "finite coordinates")?;
    }
    Ok(())
}
