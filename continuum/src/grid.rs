//! The staggered (marker-and-cell) grid: pressure in cells, velocities on faces.
//!
//! Axis 0 is x (along the flow), the last axis is z (across it, upwards); in space y lies between them.
//! Everything is indexed by axis, so a third one is a longer array.

use crate::error::{Error, require};
use crate::units::Units;
use crate::wall_friction::WallFriction;

/// Number of axes of a plane grid.
pub const DIMENSIONS: usize = 2;

/// What holds on one side of a bounded axis.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Boundary {
    /// A rigid rough wall that moves along itself with the given velocity.
    NoSlip {
        /// Tangential velocity of the wall.
        velocity: f64,
    },
    /// A rigid wall along which the material slides once it bears all the shear stress it can:
    /// Coulomb friction on a base.
    CoulombWall {
        /// Tangential velocity of the wall.
        velocity: f64,
        /// What the wall bears.
        friction: WallFriction,
    },
    /// A rigid smooth wall, or a plane of symmetry: no normal velocity, no shear stress.
    FreeSlip,
    /// A fixed flat surface with p = 0 on the face and no traction.
    FreeSurface,
    /// A rough wall that moves along itself with the given velocity and is pushed against the
    /// material with the given pressure; each face gives way in its normal direction.
    LoadedWall {
        /// Tangential velocity of the wall.
        velocity: f64,
        /// Normal stress, positive in compression.
        pressure: f64,
    },
}

impl Boundary {
    /// Pressure that acts from outside on the face, if the face is free to move.
    pub(crate) fn outer_pressure(&self) -> Option<f64> {
        match self {
            Boundary::NoSlip { .. } | Boundary::CoulombWall { .. } | Boundary::FreeSlip => None,
            Boundary::FreeSurface => Some(0.0),
            Boundary::LoadedWall { pressure, .. } => Some(*pressure),
        }
    }

    /// The same boundary with velocities and stresses divided by the given units.
    pub(crate) fn in_units(self, units: &Units) -> Self {
        match self {
            Boundary::NoSlip { velocity } => Boundary::NoSlip {
                velocity: velocity / units.velocity,
            },
            Boundary::LoadedWall { velocity, pressure } => Boundary::LoadedWall {
                velocity: velocity / units.velocity,
                pressure: pressure / units.stress(),
            },
            Boundary::CoulombWall { velocity, friction } => Boundary::CoulombWall {
                velocity: velocity / units.velocity,
                friction: friction.in_units(units),
            },
            Boundary::FreeSlip | Boundary::FreeSurface => self,
        }
    }

    /// Tangential velocity that the boundary imposes, if it can hold a shear stress.
    pub(crate) fn wall_velocity(&self) -> Option<f64> {
        match self {
            Boundary::NoSlip { velocity }
            | Boundary::CoulombWall { velocity, .. }
            | Boundary::LoadedWall { velocity, .. } => Some(*velocity),
            Boundary::FreeSlip | Boundary::FreeSurface => None,
        }
    }
}

/// One axis of the grid.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Axis {
    /// Nothing varies along this axis: it is neither stored nor looped over.
    Flat,
    /// The axis closes on itself.
    Periodic {
        /// Period.
        length: f64,
        /// Number of cells.
        cells: usize,
    },
    /// The axis ends on both sides.
    Bounded {
        /// Length.
        length: f64,
        /// Number of cells.
        cells: usize,
        /// Boundary at coordinate 0.
        low: Boundary,
        /// Boundary at the far end.
        high: Boundary,
    },
}

impl Axis {
    /// Number of cells (1 on a flat axis).
    pub fn cells(&self) -> usize {
        match self {
            Axis::Flat => 1,
            Axis::Periodic { cells, .. } | Axis::Bounded { cells, .. } => *cells,
        }
    }

    /// Cell size (1, that is per unit length, on a flat axis).
    pub fn spacing(&self) -> f64 {
        match self {
            Axis::Flat => 1.0,
            Axis::Periodic { length, cells } | Axis::Bounded { length, cells, .. } => {
                length / *cells as f64
            }
        }
    }

    /// Number of faces normal to the axis, boundary faces included.
    fn faces(&self) -> usize {
        match self {
            Axis::Bounded { cells, .. } => cells + 1,
            _ => self.cells(),
        }
    }

    /// The boundary that lies on a face of this axis, if any.
    pub(crate) fn boundary_at(&self, face: usize) -> Option<Boundary> {
        match self {
            Axis::Bounded { low, .. } if face == 0 => Some(*low),
            Axis::Bounded { cells, high, .. } if face == *cells => Some(*high),
            _ => None,
        }
    }

    /// The faces below and above a cell along this axis; none on a flat axis.
    pub(crate) fn faces_of_cell(&self, cell: usize) -> Option<[usize; 2]> {
        match self {
            Axis::Flat => None,
            Axis::Periodic { cells, .. } => Some([cell, (cell + 1) % cells]),
            Axis::Bounded { .. } => Some([cell, cell + 1]),
        }
    }

    /// The cells below and above a face along this axis, `None` outside the grid; on a flat axis
    /// the one cell lies on both sides.
    pub(crate) fn cells_at_face(&self, face: usize) -> [Option<usize>; 2] {
        match self {
            Axis::Flat => [Some(0), Some(0)],
            Axis::Periodic { cells, .. } => [Some((face + cells - 1) % cells), Some(face)],
            Axis::Bounded { cells, .. } => [face.checked_sub(1), (face < *cells).then_some(face)],
        }
    }
}

/// The index along each axis of a number that counts with the first axis fastest.
pub(crate) fn unflatten<const D: usize>(mut number: usize, counts: [usize; D]) -> [usize; D] {
    counts.map(|count| {
        let index = number % count;
        number /= count;
        index
    })
}

/// The number of an index, the first axis counting fastest.
#[inline]
pub(crate) fn flatten<const D: usize>(index: [usize; D], counts: [usize; D]) -> usize {
    (0..D)
        .rev()
        .fold(0, |number, axis| number * counts[axis] + index[axis])
}

/// A staggered grid with its numbering of unknowns.
///
/// Cells are numbered with x running fastest. A velocity is an unknown unless a rigid wall
/// prescribes it.
#[derive(Debug, Clone)]
pub struct Grid<const D: usize = DIMENSIONS> {
    axes: [Axis; D],
    /// For each component, the number of the unknown on each face (x fastest), if it is one.
    unknowns: [Vec<Option<usize>>; D],
    /// Unknowns of each component.
    ranges: [(usize, usize); D],
}

impl<const D: usize> Grid<D> {
    /// Makes the grid.
    ///
    /// # Errors
    /// An axis without cells or without length, or boundaries that leave the pressure
    /// undetermined.
    pub fn new(axes: [Axis; D]) -> Result<Self, Error> {
        let sets_pressure = axes.iter().any(|axis| match axis {
            Axis::Bounded { low, high, .. } => {
                low.outer_pressure().is_some() || high.outer_pressure().is_some()
            }
            _ => false,
        });
        if !sets_pressure {
            return Err(Error::UndeterminedPressure);
        }
        Self::with_moving_surface(axes)
    }

    /// Makes a grid in which the surface of the material lies somewhere inside and sets the
    /// pressure, so the boundaries need not.
    ///
    /// # Errors
    /// An axis without cells or without length.
    pub fn with_moving_surface(axes: [Axis; D]) -> Result<Self, Error> {
        for axis in &axes {
            require(
                axis.cells() >= 1,
                "grid.cells",
                axis.cells() as f64,
                "at least 1",
            )?;
            if let Axis::Periodic { cells, .. } = axis {
                require(
                    *cells >= 3,
                    "grid.columns",
                    *cells as f64,
                    "at least 3 on a periodic axis",
                )?;
            }
            require(
                axis.spacing() > 0.0,
                "grid.length",
                axis.spacing() * axis.cells() as f64,
                "greater than 0",
            )?;
        }
        let mut grid = Self {
            axes,
            unknowns: std::array::from_fn(|_| Vec::new()),
            ranges: [(0, 0); D],
        };
        let mut next = 0;
        for component in 0..D {
            let counts = grid.faces(component);
            let first = next;
            let table = (0..counts.iter().product()).map(|face| {
                let position = unflatten(face, counts)[component];
                let boundary = grid.axes[component].boundary_at(position);
                let is_unknown = boundary.is_none_or(|side| side.outer_pressure().is_some());
                let number = is_unknown.then_some(next);
                next += usize::from(is_unknown);
                number
            });
            grid.unknowns[component] = table.collect();
            grid.ranges[component] = (first, next);
        }
        Ok(grid)
    }

    /// The axes, z last.
    pub fn axes(&self) -> &[Axis; D] {
        &self.axes
    }

    /// Numbers of cells along the axes.
    pub fn cell_counts(&self) -> [usize; D] {
        self.axes.map(|axis| axis.cells())
    }

    /// Number of faces that carry a velocity component, along each axis.
    pub(crate) fn faces(&self, component: usize) -> [usize; D] {
        let mut counts = self.cell_counts();
        counts[component] = self.axes[component].faces();
        counts
    }

    /// The unknown on a face of a velocity component, `None` where a rigid wall prescribes zero.
    pub(crate) fn unknown(&self, component: usize, face: [usize; D]) -> Option<usize> {
        self.unknowns[component][flatten(face, self.faces(component))]
    }

    /// The range of unknowns that belong to a velocity component.
    pub fn component(&self, component: usize) -> std::ops::Range<usize> {
        let (first, end) = self.ranges[component];
        first..end
    }

    /// Number of unknown velocities.
    pub fn velocities(&self) -> usize {
        self.ranges[D - 1].1
    }

    /// Number of cells.
    pub fn cells(&self) -> usize {
        self.axes.iter().map(Axis::cells).product()
    }

    /// Number of a cell.
    pub(crate) fn cell(&self, index: [usize; D]) -> usize {
        flatten(index, self.cell_counts())
    }

    /// Volume of a cell (per unit length in the directions that are flat or absent).
    pub fn cell_volume(&self) -> f64 {
        self.axes.iter().map(Axis::spacing).product()
    }

    /// Area of a face normal to an axis.
    pub(crate) fn face_area(&self, axis: usize) -> f64 {
        self.cell_volume() / self.axes[axis].spacing()
    }

    /// Height of the centre of a row of cells.
    pub fn centre_height(&self, row: usize) -> f64 {
        (row as f64 + 0.5) * self.axes[D - 1].spacing()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn layer(x: Axis, high: Boundary) -> Result<Grid, Error> {
        let low = Boundary::NoSlip { velocity: 0.0 };
        let z = Axis::Bounded {
            length: 2.0,
            cells: 4,
            low,
            high,
        };
        Grid::new([x, z])
    }

    #[test]
    fn flat_axis_is_not_stored() {
        let grid = layer(Axis::Flat, Boundary::FreeSurface).unwrap();
        // 4 velocities u; w on 3 inner faces and on the surface, none on the wall.
        assert_eq!(grid.component(0), 0..4);
        assert_eq!(grid.component(1), 4..8);
        assert_eq!((grid.cells(), grid.cell_volume()), (4, 0.5));
        assert_eq!(grid.unknown(1, [0, 0]), None);
    }

    #[test]
    fn periodic_axis_closes_on_itself() {
        let x = Axis::Periodic {
            length: 3.0,
            cells: 3,
        };
        let grid = layer(x, Boundary::FreeSurface).unwrap();
        assert_eq!(grid.velocities(), 12 + 12);
        assert_eq!(x.faces_of_cell(2), Some([2, 0]));
        assert_eq!(x.cells_at_face(0), [Some(2), Some(0)]);
    }

    #[test]
    fn closed_box_and_empty_axes_are_refused() {
        assert_eq!(
            layer(Axis::Flat, Boundary::FreeSlip).unwrap_err(),
            Error::UndeterminedPressure
        );
        let empty = Axis::Periodic {
            length: 1.0,
            cells: 0,
        };
        assert!(layer(empty, Boundary::FreeSurface).is_err());
    }
}
