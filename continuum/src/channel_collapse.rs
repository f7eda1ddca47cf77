//! Collapse of a column between two side walls, in space.
//!
//! The column of [`crate::column_collapse`] in a channel of width W whose walls and floor hold material as
//! the case says: not at all, wholly, or by Coulomb friction. The plane solver between side walls
//! ([`crate::wall_friction::SideWalls`]) takes the velocity for the same all across the channel and spreads the
//! friction of the walls over it; here the walls act where they are, and the flow is slower beside them.

use serde::{Deserialize, Serialize};

use crate::column_collapse::{CollapseCase, Front, ROOM_ABOVE};
use crate::error::{Error, require};
use crate::free_surface::{
    Contact, SpaceFields, SpaceFlow, SpaceState, SurfaceOptions, SurfaceStep,
};
use crate::grid::{Axis, Boundary, Grid};
use crate::rheology::{MuI, Rheology};
use crate::units::Units;

/// Material counts as at rest when nothing moves faster than this many ε H.
const REST_SPEED: f64 = 5.0;

/// A column to collapse in a channel; SI units.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ChannelCase {
    /// The column, its material, and the grid along the channel.
    pub column: CollapseCase<MuI>,
    /// Distance W of the side walls (m).
    pub width: f64,
    /// Cells across the part of the channel that is computed.
    pub cells_across: usize,
    /// Whether the grid holds the whole width, instead of half of it beside the middle, a plane of symmetry.
    pub whole: bool,
    /// What holds on both side walls.
    pub walls: Contact,
    /// What holds on the floor.
    pub floor: Contact,
}

impl ChannelCase {
    /// Natural units of the computation: height, bulk density, √(g H).
    pub fn units(&self) -> Units {
        self.column.units()
    }

    /// Refuses parameters out of range.
    ///
    /// # Errors
    /// [`Error::OutOfRange`] with the key, the value and the allowed range.
    pub fn validate(&self) -> Result<(), Error> {
        self.column.validate()?;
        require(
            self.width > 0.0,
            "width",
            self.width,
            "greater than 0 m and finite",
        )?;
        require(
            self.cells_across >= 1,
            "cells_across",
            self.cells_across as f64,
            "at least 1",
        )?;
        require(
            self.column.overhang_degrees == 0.0,
            "overhang_degrees",
            self.column.overhang_degrees,
            "0 in a channel",
        )?;
        for contact in [self.walls, self.floor] {
            if let Contact::Coulomb(friction) = contact {
                friction.validate()?;
            }
        }
        Ok(())
    }

    /// The column at rest, in natural units.
    fn flow(&self, options: &SurfaceOptions) -> Result<SpaceFlow<MuI>, Error> {
        let (column, units) = (&self.column, self.units());
        let spacing = column.length_scaled / column.cells as f64;
        let rows = (ROOM_ABOVE / spacing).ceil().max(1.0) as usize;
        let across = self.width / column.height * if self.whole { 1.0 } else { 0.5 };
        let bounded = |length: f64, cells: usize, low, high| Axis::Bounded {
            length,
            cells,
            low,
            high,
        };
        let [wall, floor] = [self.walls, self.floor].map(|c| c.on_wall().in_units(&units));
        let middle = if self.whole { wall } else { Boundary::FreeSlip };
        let grid = Grid::with_moving_surface([
            bounded(
                column.length_scaled,
                column.cells,
                Boundary::FreeSlip,
                Boundary::FreeSlip,
            ),
            bounded(across, self.cells_across, wall, middle),
            bounded(spacing * rows as f64, rows, floor, Boundary::FreeSlip),
        ])?;
        let mut fractions = Vec::with_capacity(grid.cells());
        for k in 0..rows {
            let row: Vec<f64> = (0..column.cells)
                .map(|i| column.covered(spacing, i, k))
                .collect();
            for _ in 0..self.cells_across {
                fractions.extend_from_slice(&row);
            }
        }
        SpaceFlow::in_space(
            grid,
            fractions,
            column.rheology.in_units(&units),
            [0.0, 0.0, -1.0],
            *options,
        )
    }
}

/// A collapse in a channel under way.
pub struct ChannelCollapse {
    case: ChannelCase,
    units: Units,
    flow: SpaceFlow<MuI>,
    rest_speed: f64,
    start_volume: f64,
}

impl ChannelCollapse {
    /// The column before it is let go.
    ///
    /// # Errors
    /// Parameters or settings out of range.
    pub fn new(case: &ChannelCase, options: &SurfaceOptions) -> Result<Self, Error> {
        case.validate()?;
        let flow = case.flow(options)?;
        Ok(Self {
            case: *case,
            units: case.units(),
            rest_speed: REST_SPEED * options.solver.strain_rate_floor,
            start_volume: flow.volume(),
            flow,
        })
    }

    /// The natural units of the computation.
    pub fn units(&self) -> &Units {
        &self.units
    }

    /// The material, in SI units.
    pub fn rheology(&self) -> &MuI {
        &self.case.column.rheology
    }

    /// The flow, in natural units.
    pub fn flow(&self) -> &SpaceFlow<MuI> {
        &self.flow
    }

    /// Goes on from a state of the same case.
    ///
    /// # Errors
    /// [`Error::ForeignState`] if the state belongs to another grid.
    pub fn set_state(&mut self, state: SpaceState) -> Result<(), Error> {
        self.flow.set_state(state)
    }

    /// Makes one step that ends at time `until` (s) at the latest; what it reports is in natural
    /// units.
    ///
    /// # Errors
    /// [`Error::OutOfRange`] for a time that is not after the flow's; [`Error::NotConverged`].
    pub fn step(&mut self, until: f64) -> Result<SurfaceStep, Error> {
        self.flow
            .step(until / self.units.time() - self.flow.state().time)
    }

    /// Time (s).
    pub fn time(&self) -> f64 {
        self.flow.state().time * self.units.time()
    }

    /// Whether a step left everything at rest: speeds below 5 ε H, which is what the strain-rate
    /// floor ε lets rigid matter creep at.
    pub fn is_at_rest(&self, step: &SurfaceStep) -> bool {
        step.max_speed < self.rest_speed
    }

    /// Speed (m/s) below which everything is at rest.
    pub fn rest_speed(&self) -> f64 {
        self.rest_speed * self.units.velocity
    }

    /// Volume gained since the start, relative.
    pub fn volume_drift(&self) -> f64 {
        self.flow.volume() / self.start_volume - 1.0
    }

    /// Heights of material (m) along the channel in each of its strips, the one beside the wall at y = 0 first.
    pub fn strips(&self) -> Vec<Vec<f64>> {
        let heights = self.flow.heights();
        let strips = heights.chunks_exact(self.case.column.cells);
        let in_metres = |strip: &[f64]| strip.iter().map(|h| h * self.case.column.height).collect();
        strips.map(in_metres).collect()
    }

    /// Positions along the channel (m) and the mean height of material across it at each (m).
    pub fn profile(&self) -> (Vec<f64>, Vec<f64>) {
        let column = &self.case.column;
        let spacing = column.length_scaled * column.height / column.cells as f64;
        let positions = (0..column.cells).map(|i| (i as f64 + 0.5) * spacing);
        let strips = self.strips();
        let mean = |i: usize| strips.iter().map(|h| h[i]).sum::<f64>() / strips.len() as f64;
        (positions.collect(), (0..column.cells).map(mean).collect())
    }

    /// Where the heap reaches down to a height (m), by its mean height across the channel.
    pub fn front(&self, threshold: f64) -> Front {
        let (x, h) = self.profile();
        Front::of_profile(self.time(), &x, &h, threshold)
    }

    /// Where the heap reaches down to a height (m) in the strip beside the wall at y = 0, and in the one in the middle of
    /// the channel.
    pub fn fronts_at_wall_and_inside(&self, threshold: f64) -> [f64; 2] {
        let (x, _) = self.profile();
        let strips = self.strips();
        let inside = if self.case.whole {
            strips.len() / 2
        } else {
            strips.len() - 1
        };
        [0, inside]
            .map(|strip| Front::of_profile(self.time(), &x, &strips[strip], threshold).position)
    }

    /// Largest difference of the filled fraction between a cell and its mirror image across the middle of the
    /// channel, where the grid holds its whole width.
    pub fn asymmetry(&self) -> f64 {
        if self.case.whole {
            self.flow.asymmetry_across()
        } else {
            0.0
        }
    }

    /// Fields of the cells with material, x fastest, in SI units; y = 0 is a wall.
    pub fn fields(&self) -> Vec<SpaceFields> {
        let mut fields = self.flow.cell_fields();
        for f in &mut fields {
            f.scale(self.case.column.height, &self.units);
        }
        fields
    }
}
