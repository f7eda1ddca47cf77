//! A flat-bottomed silo that runs out of a slot in its floor.
//!
//! Material of height H fills a plane silo of width W between walls; in the middle of the floor a slot of width L is open
//! ([`crate::free_surface::SurfaceFlow::with_outlet`]) and at t = 0 everything is let go. What is asked for is the rate Q, volume
//! per time and unit length of the slot. By dimensions Q = C √g L^{3/2}, and C depends on L/d, L/W and H/L; that grains run out
//! at a rate that hardly depends on H, and as √g (L − k)^{3/2}, is the law of Beverloo, Leniger & van de Velde
//! (*Chem. Eng. Sci.* 15 (1961) 260) in a plane. A μ(I) continuum does so: Staron, Lagrée & Popinet, *Phys. Fluids* 24 (2012)
//! 103301. A fluid without friction drains with √H.
//!
//! What has left does not act on what is inside: p = 0 holds on the whole plane of the slot. A jet goes on converging below
//! it, which this leaves out.

use serde::{Deserialize, Serialize};

use crate::error::{Error, require};
use crate::free_surface::{
    CellFields, Contact, SurfaceFlow, SurfaceOptions, SurfaceState, SurfaceStep,
};
use crate::grid::{Axis, Boundary, Grid};
use crate::rheology::{MuI, ShearLaw};
use crate::units::Units;

/// Fewest cells across the outlet.
const FEWEST_CELLS: usize = 4;
/// Walls lie on faces of the grid to within this part of a cell.
const ON_FACE: f64 = 1e-6;
/// Rows of cells above the filling.
const ROOM: usize = 2;
/// From this many √(L/g) on the rate counts as steady: what flows has gained its speed.
const GAINED_SPEED: f64 = 4.0;
/// Down to this mean depth of what is left, over the width, it does so.
const SHALLOWEST: f64 = 0.5;

/// A silo; SI units.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SiloCase<L = MuI> {
    /// Width W between the walls (m).
    pub width: f64,
    /// Width L of the outlet in the middle of the floor (m).
    pub outlet: f64,
    /// Height H of the filling (m).
    pub height: f64,
    /// Gravity g (m/s²).
    pub gravity: f64,
    /// The material.
    pub rheology: L,
    /// Cells across the outlet; they are square.
    pub cells: usize,
    /// What holds on the walls.
    pub walls: Contact,
    /// What holds on the floor.
    pub floor: Contact,
    /// Whether all of it is computed, instead of half of it beside a smooth wall in the middle.
    #[serde(default)]
    pub whole: bool,
}

impl<L> SiloCase<L> {
    /// Size of a cell (m).
    pub fn spacing(&self) -> f64 {
        self.outlet / self.cells as f64
    }

    /// Cells of the floor on each side of the outlet, which need not be a whole number.
    fn beside(&self) -> f64 {
        0.5 * (self.width - self.outlet) / self.spacing()
    }

    /// Cells along x of what is computed, and how many of them lie before the outlet and over it.
    fn columns(&self) -> [usize; 3] {
        let beside = self.beside().round() as usize;
        if self.whole {
            [self.cells + 2 * beside, beside, self.cells]
        } else {
            [self.cells / 2 + beside, 0, self.cells / 2]
        }
    }

    /// Rows that the filling reaches.
    fn filled_rows(&self) -> f64 {
        self.height / self.spacing()
    }

    /// Cells that hold material at the start.
    pub fn filled(&self) -> f64 {
        self.columns()[0] as f64 * self.filled_rows()
    }

    /// What is computed of the silo.
    fn part(&self) -> f64 {
        if self.whole { 1.0 } else { 0.5 }
    }

    /// Rows of the grid, which reaches above the filling.
    fn rows(&self) -> usize {
        self.filled_rows().ceil() as usize + ROOM
    }

    /// √g L^{3/2}, by which rates are measured (m²/s).
    pub fn rate_unit(&self) -> f64 {
        self.gravity.sqrt() * self.outlet.powf(1.5)
    }

    /// The rate over the steady part of instants of time (s), volume inside and volume that has left (m²); none if fewer
    /// than three of them lie in it.
    pub fn steady_rate(&self, instants: &[[f64; 3]]) -> Option<SteadyRate> {
        let first = GAINED_SPEED * (self.outlet / self.gravity).sqrt();
        let least = SHALLOWEST * self.width * self.width;
        let steady: Vec<&[f64; 3]> = instants
            .iter()
            .filter(|[t, inside, _]| *t >= first && *inside >= least)
            .collect();
        let (start, end) = (steady.first()?, steady.last()?);
        let rate = |a: &[f64; 3], b: &[f64; 3]| (b[2] - a[2]) / (b[0] - a[0]);
        let middle = steady.get(steady.len() / 2)?;
        let is_long = steady.len() > 2;
        is_long.then(|| SteadyRate {
            from: start[0],
            to: end[0],
            rate: rate(start, end),
            first_half: rate(start, middle),
            second_half: rate(middle, end),
        })
    }
}

/// The rate while the speed is gained and the silo is not yet nearly empty; SI units.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct SteadyRate {
    /// When it begins (s): after 4 √(L/g).
    pub from: f64,
    /// When it ends (s): at a mean depth of W/2, or with the run.
    pub to: f64,
    /// Mean rate Q (m²/s).
    pub rate: f64,
    /// The mean over its first half (m²/s).
    pub first_half: f64,
    /// The mean over its second half (m²/s).
    pub second_half: f64,
}

impl SteadyRate {
    /// By which part the rate changes from one half to the other: 0 where it is constant.
    pub fn change(&self) -> f64 {
        self.second_half / self.first_half - 1.0
    }
}

impl<L: ShearLaw + Clone> SiloCase<L> {
    /// Natural units of the computation: width of the outlet, bulk density, √(g L).
    pub fn units(&self) -> Units {
        Units::of_gravity(self.outlet, self.rheology.bulk_density(), self.gravity)
    }

    /// Refuses parameters out of range.
    ///
    /// # Errors
    /// [`Error::OutOfRange`] with the key, the value and the allowed range.
    pub fn validate(&self) -> Result<(), Error> {
        self.rheology.validate()?;
        for (key, value) in [
            ("width", self.width),
            ("outlet", self.outlet),
            ("height", self.height),
            ("gravity", self.gravity),
        ] {
            require(value > 0.0, key, value, "greater than 0 and finite")?;
        }
        require(
            self.outlet <= self.width,
            "outlet",
            self.outlet,
            format!("at most the width of the silo, {}", self.width),
        )?;
        require(
            self.cells >= FEWEST_CELLS && (self.whole || self.cells.is_multiple_of(2)),
            "grid.cells",
            self.cells as f64,
            if self.whole {
                format!("at least {FEWEST_CELLS} across the outlet")
            } else {
                format!(
                    "even and at least {FEWEST_CELLS} across the outlet: half of them are computed"
                )
            },
        )?;
        let [beside, h] = [self.beside(), self.spacing()];
        let nearest = |cells: f64| self.outlet + 2.0 * h * cells;
        require(
            (beside - beside.round()).abs() < ON_FACE,
            "width",
            self.width,
            format!(
                "the outlet and whole cells of {h} beside it, as {} or {}",
                nearest(beside.floor()),
                nearest(beside.ceil())
            ),
        )?;
        require(
            self.filled_rows() >= FEWEST_CELLS as f64,
            "height",
            self.height,
            format!("at least {}, {FEWEST_CELLS} cells", FEWEST_CELLS as f64 * h),
        )
    }

    /// The silo filled and closed, in natural units, and then opened.
    fn flow(&self, options: &SurfaceOptions) -> Result<SurfaceFlow<L>, Error> {
        let (units, h) = (self.units(), 1.0 / self.cells as f64);
        let ([columns, before, open], rows) = (self.columns(), self.rows());
        let [wall, floor] = [self.walls, self.floor].map(|c| c.on_wall().in_units(&units));
        let axis = |cells: usize, low, high| Axis::Bounded {
            length: cells as f64 * h,
            cells,
            low,
            high,
        };
        let middle = if self.whole { wall } else { Boundary::FreeSlip };
        let grid = Grid::with_moving_surface([
            axis(columns, middle, wall),
            axis(rows, floor, Boundary::FreeSlip),
        ])?;
        let filled = |row: usize| (self.filled_rows() - row as f64).clamp(0.0, 1.0);
        let fractions = (0..columns * rows).map(|cell| filled(cell / columns));
        let law = self.rheology.in_units(&units);
        SurfaceFlow::at_rest(grid, fractions.collect(), law, [0.0, -1.0], *options)?
            .with_outlet(before as f64 * h, (before + open) as f64 * h)
    }
}

/// A silo that runs out.
pub struct Silo<L: ShearLaw + Clone = MuI> {
    case: SiloCase<L>,
    units: Units,
    flow: SurfaceFlow<L>,
    start_volume: f64,
}

impl<L: ShearLaw + Clone> Silo<L> {
    /// The silo full and at rest.
    ///
    /// # Errors
    /// Parameters or settings out of range.
    pub fn new(case: &SiloCase<L>, options: &SurfaceOptions) -> Result<Self, Error> {
        case.validate()?;
        let flow = case.flow(options)?;
        Ok(Self {
            case: case.clone(),
            units: case.units(),
            start_volume: flow.volume(),
            flow,
        })
    }

    /// The natural units of the computation.
    pub fn units(&self) -> &Units {
        &self.units
    }

    /// The flow, in natural units.
    pub fn flow(&self) -> &SurfaceFlow<L> {
        &self.flow
    }

    /// Goes on from a state of the same case.
    ///
    /// # Errors
    /// [`Error::ForeignState`] if the state belongs to another grid.
    pub fn set_state(&mut self, state: SurfaceState) -> Result<(), Error> {
        self.flow.set_state(state)
    }

    /// Makes one step that ends at time `until` (s) at the latest; what it reports is in natural units.
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

    /// Time (s), and the volume that is in the whole silo and that has left it, per length of the slot (m²).
    pub fn instant(&self) -> [f64; 3] {
        let area = self.case.outlet * self.case.outlet / self.case.part();
        let [_, left] = self.flow.state().passed;
        [self.time(), self.flow.volume() * area, left * area]
    }

    /// Volume gained beside what has left, over what was there.
    pub fn volume_drift(&self) -> f64 {
        let [_, left] = self.flow.state().passed;
        (self.flow.volume() + left - self.start_volume) / self.start_volume
    }

    /// Distances along x from the middle of the outlet, and heights of material there (m).
    pub fn profile(&self) -> (Vec<f64>, Vec<f64>) {
        let [_, before, open] = self.case.columns();
        let middle = if self.case.whole {
            before as f64 + 0.5 * open as f64
        } else {
            0.0
        };
        let heights = self.flow.heights();
        let x = (0..heights.len()).map(|i| (i as f64 + 0.5 - middle) * self.case.spacing());
        let h = heights.iter().map(|h| h * self.case.outlet);
        (x.collect(), h.collect())
    }

    /// Fields of the cells with material, x fastest, in SI units; x from the left edge of what is computed.
    pub fn fields(&self) -> Vec<CellFields> {
        let mut fields = self.flow.cell_fields();
        for f in &mut fields {
            f.scale(self.case.outlet, &self.units);
        }
        fields
    }
}
