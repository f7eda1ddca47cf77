//! What a fed chute has across it, in space: sides that hold material back, or nothing that varies.

use serde::{Deserialize, Serialize};

use super::{OpenChute, OpenChuteCase};
use crate::error::{Error, require};
use crate::free_surface::{Contact, SpaceFlow, SurfaceOptions};
use crate::grid::{Axis, Boundary, Grid};
use crate::rheology::ShearLaw;
use crate::strain::{SPACE_COMPONENTS, SPACE_VELOCITIES};

/// What bounds the chute across it.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Sides {
    /// Nothing: the chute meets itself.
    Periodic,
    /// Two walls on which this holds.
    Walls(Contact),
}

/// The chute across, in SI units.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Across {
    /// Distance of the sides, or the period (m).
    pub breadth: f64,
    /// Cells across the part of it that is computed.
    pub cells: usize,
    /// Whether that is all of it, instead of one half beside the middle, a plane of symmetry.
    pub whole: bool,
    /// What the sides are.
    pub sides: Sides,
}

impl Across {
    /// Refuses parameters out of range.
    ///
    /// # Errors
    /// [`Error::OutOfRange`] with the key, the value and the allowed range.
    pub fn validate(&self) -> Result<(), Error> {
        require(
            self.breadth > 0.0,
            "in_space.breadth",
            self.breadth,
            "greater than 0 m and finite",
        )?;
        let (fewest, of) = match self.sides {
            Sides::Periodic => (3, "at least 3 over a period"),
            Sides::Walls(_) => (1, "at least 1"),
        };
        require(
            self.cells >= fewest,
            "in_space.cells",
            self.cells as f64,
            of,
        )?;
        match self.sides {
            Sides::Periodic => require(
                self.whole,
                "in_space.whole",
                0.0,
                "true: periodic sides have no middle",
            ),
            Sides::Walls(Contact::Coulomb(friction)) => friction.validate(),
            Sides::Walls(_) => Ok(()),
        }
    }

    /// The axis across, in natural units of a case.
    fn axis<L: ShearLaw + Clone>(&self, case: &OpenChuteCase<L>) -> Axis {
        let part = if self.whole { 1.0 } else { 0.5 };
        let (length, cells) = (part * self.breadth / case.depth, self.cells);
        match self.sides {
            Sides::Periodic => Axis::Periodic { length, cells },
            Sides::Walls(contact) => {
                let low = contact.on_wall().in_units(&case.units());
                let high = if self.whole { low } else { Boundary::FreeSlip };
                Axis::Bounded {
                    length,
                    cells,
                    low,
                    high,
                }
            }
        }
    }
}

/// A fed chute in space.
pub type SpaceChute<L> = OpenChute<L, 3, SPACE_COMPONENTS, SPACE_VELOCITIES>;

impl<L: ShearLaw + Clone> SpaceChute<L> {
    /// The chute full of what is fed, flowing as it enters: the same all across.
    ///
    /// # Errors
    /// Parameters or settings out of range.
    pub fn in_space(
        case: &OpenChuteCase<L>,
        across: &Across,
        options: &SurfaceOptions,
    ) -> Result<Self, Error> {
        case.validate()?;
        across.validate()?;
        let grid = Grid::with_moving_surface([case.along(), across.axis(case), case.upwards()])?;
        let (law, g) = (case.rheology.in_units(&case.units()), case.slope.sin_cos());
        let start = case.start(across.cells);
        let flow = SpaceFlow::in_space(grid, start, law, [g.0, 0.0, -g.1], *options)?;
        let mut chute = Self::fed(case, flow, across.cells)?;
        chute.is_whole = across.whole;
        Ok(chute)
    }

    /// Whether all of the breadth is computed, so that the chute has a mirror image.
    pub fn is_whole(&self) -> bool {
        self.is_whole
    }
}
