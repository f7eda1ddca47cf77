//! A chute that is fed at its upper end and open at its lower one.
//!
//! A layer of depth h enters at x = 0 with a given profile of speed, flows down a rough incline of length L and
//! leaves at x = L ([`crate::free_surface::Inflow`]). Fed with Bagnold's profile it is in equilibrium with
//! friction and passes through as it is ([`crate::bagnold`]); fed with a plug it speeds up or slows down over a
//! length, and its depth changes with it. Volume is accounted for: what is in the chute is what was there, and
//! came in, less what went out. In space ([`Across`]) the chute has sides, and what it is asked for is a mean across it.

mod across;

pub use across::{Across, Sides, SpaceChute};

use serde::{Deserialize, Serialize};

use crate::bagnold::BagnoldCase;
use crate::discretisation::{COMPONENTS, VELOCITIES};
use crate::error::{Error, require};
use crate::free_surface::{
    CellFields, Inflow, SurfaceFlow, SurfaceOptions, SurfaceState, SurfaceStep,
};
use crate::grid::{Axis, Boundary, DIMENSIONS, Grid};
use crate::rheology::{MuI, ShearLaw};
use crate::units::Units;

/// The speed of what enters.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub enum Feed {
    /// Bagnold's profile, which friction and weight keep as it is, times a factor.
    Bagnold(f64),
    /// The same speed at all heights (m/s).
    Plug(f64),
}

/// A fed chute; SI units.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct OpenChuteCase<L = MuI> {
    /// Slope θ (rad).
    pub slope: f64,
    /// Depth h of the layer that enters, normal to the chute (m).
    pub depth: f64,
    /// Gravity g (m/s²).
    pub gravity: f64,
    /// The material.
    pub rheology: L,
    /// How fast it enters.
    pub feed: Feed,
    /// Cells across the depth h; they are square.
    pub cells: usize,
    /// Length L of the chute over h.
    pub length_scaled: f64,
    /// Height of the grid over h.
    pub room_scaled: f64,
}

/// Fewest cells across the depth, and along the chute.
const FEWEST_CELLS: usize = 4;

impl<L: ShearLaw + Clone> OpenChuteCase<L> {
    /// Natural units of the computation: depth, bulk density, √(g h).
    pub fn units(&self) -> Units {
        Units::of_gravity(self.depth, self.rheology.bulk_density(), self.gravity)
    }

    /// The steady layer of that depth.
    fn layer(&self) -> BagnoldCase<L> {
        BagnoldCase {
            slope: self.slope,
            depth: self.depth,
            gravity: self.gravity,
            rheology: self.rheology.clone(),
            cells: self.cells,
            columns: None,
        }
    }

    /// Cells along the chute.
    fn columns(&self) -> usize {
        (self.length_scaled * self.cells as f64).round() as usize
    }

    /// Cells across the grid.
    fn rows(&self) -> usize {
        (self.room_scaled * self.cells as f64).ceil() as usize
    }

    /// Speed at a height above the chute of what enters (m/s).
    pub fn speed(&self, z: f64) -> f64 {
        match self.feed {
            _ if z > self.depth => 0.0,
            Feed::Bagnold(factor) => factor * self.layer().exact_velocity(z),
            Feed::Plug(speed) => speed,
        }
    }

    /// Speed of the steady layer of that depth (m/s), where the slope has one.
    pub fn steady_speed(&self, z: f64) -> Option<f64> {
        let layer = self.layer();
        let flows = layer.validate().is_ok() && layer.plug_thickness() < self.depth;
        flows.then(|| layer.exact_velocity(z.min(self.depth)))
    }

    /// Refuses parameters out of range.
    ///
    /// # Errors
    /// [`Error::OutOfRange`] with the key, the value and the allowed range.
    pub fn validate(&self) -> Result<(), Error> {
        self.rheology.validate()?;
        for (key, value) in [("depth", self.depth), ("gravity", self.gravity)] {
            require(value > 0.0, key, value, "greater than 0 and finite")?;
        }
        require(
            (0.0..std::f64::consts::FRAC_PI_2).contains(&self.slope),
            "slope_degrees",
            self.slope.to_degrees(),
            "0 to 90",
        )?;
        require(
            self.cells >= FEWEST_CELLS,
            "grid.cells",
            self.cells as f64,
            format!("at least {FEWEST_CELLS}"),
        )?;
        let shortest = FEWEST_CELLS as f64 / self.cells as f64;
        require(
            self.length_scaled >= shortest,
            "grid.length_scaled",
            self.length_scaled,
            format!("at least {shortest}, {FEWEST_CELLS} cells"),
        )?;
        require(
            self.rows() > self.cells + 1,
            "grid.room_scaled",
            self.room_scaled,
            "room for two cells above the layer that enters",
        )?;
        match self.feed {
            Feed::Plug(speed) => require(
                speed > 0.0,
                "inflow.speed",
                speed,
                "greater than 0 and finite",
            ),
            Feed::Bagnold(factor) => {
                require(
                    factor > 0.0,
                    "inflow.factor",
                    factor,
                    "greater than 0 and finite",
                )?;
                // Slopes beyond the law have no such flow, and say so themselves.
                self.layer().validate()?;
                require(
                    self.steady_speed(self.depth).is_some(),
                    "slope_degrees",
                    self.slope.to_degrees(),
                    "a slope on which a layer of this depth flows, for inflow.bagnold_factor",
                )
            }
        }
    }
}

/// A chute under way.
pub struct OpenChute<
    L: ShearLaw + Clone = MuI,
    const D: usize = DIMENSIONS,
    const C: usize = COMPONENTS,
    const V: usize = VELOCITIES,
> {
    case: OpenChuteCase<L>,
    units: Units,
    flow: SurfaceFlow<L, D, C, V>,
    start_volume: f64,
    /// Whether all of the breadth is computed.
    is_whole: bool,
}

impl<L: ShearLaw + Clone> OpenChute<L> {
    /// The chute full of what is fed, flowing as it enters.
    ///
    /// # Errors
    /// Parameters or settings out of range.
    pub fn new(case: &OpenChuteCase<L>, options: &SurfaceOptions) -> Result<Self, Error> {
        case.validate()?;
        let grid = Grid::with_moving_surface([case.along(), case.upwards()])?;
        let (law, g) = (case.rheology.in_units(&case.units()), case.slope.sin_cos());
        let flow = SurfaceFlow::at_rest(grid, case.start(1), law, [g.0, -g.1], *options)?;
        Self::fed(case, flow, 1)
    }
}

impl<L: ShearLaw + Clone> OpenChuteCase<L> {
    fn axis(&self, cells: usize, low: Boundary) -> Axis {
        Axis::Bounded {
            length: cells as f64 * (1.0 / self.cells as f64),
            cells,
            low,
            high: Boundary::FreeSlip,
        }
    }

    /// The axis from end to end, in natural units.
    fn along(&self) -> Axis {
        self.axis(self.columns(), Boundary::FreeSlip)
    }

    /// The axis from the floor to the top of the grid.
    fn upwards(&self) -> Axis {
        self.axis(self.rows(), Boundary::NoSlip { velocity: 0.0 })
    }

    /// Filled part of the cells of a row of what enters.
    fn filled(&self, row: usize) -> f64 {
        if row < self.cells { 1.0 } else { 0.0 }
    }

    /// Filled parts of all cells at the start, of a grid with so many cells across.
    fn start(&self, across: usize) -> Vec<f64> {
        let layer = self.columns() * across;
        let cells = 0..layer * self.rows();
        cells.map(|cell| self.filled(cell / layer)).collect()
    }
}

impl<L: ShearLaw + Clone, const D: usize, const C: usize, const V: usize> OpenChute<L, D, C, V> {
    /// Opens the ends of a chute with so many cells across it, and lets it flow as it enters.
    fn fed(
        case: &OpenChuteCase<L>,
        flow: SurfaceFlow<L, D, C, V>,
        across: usize,
    ) -> Result<Self, Error> {
        let units = case.units();
        let h = 1.0 / case.cells as f64;
        let speed = |row: usize| case.speed((row as f64 + 0.5) * h * case.depth) / units.velocity;
        let rows = (0..case.rows()).flat_map(|row| std::iter::repeat_n(row, across));
        let inflow = Inflow {
            speeds: rows.clone().map(speed).collect(),
            fractions: rows.map(|row| case.filled(row)).collect(),
        };
        let speeds = inflow.speeds.clone();
        let mut flow = flow.with_open_ends(inflow)?;
        let mut state = flow.state().clone();
        for (face, u) in state.velocity[0].iter_mut().enumerate() {
            *u = speeds[face / (case.columns() + 1)];
        }
        flow.set_state(state)?;
        Ok(Self {
            case: case.clone(),
            units,
            start_volume: flow.volume(),
            is_whole: true,
            flow,
        })
    }

    /// The natural units of the computation.
    pub fn units(&self) -> &Units {
        &self.units
    }

    /// The flow, in natural units.
    pub fn flow(&self) -> &SurfaceFlow<L, D, C, V> {
        &self.flow
    }

    /// Goes on from a state of the same case.
    ///
    /// # Errors
    /// [`Error::ForeignState`] if the state belongs to another grid.
    pub fn set_state(&mut self, state: SurfaceState<D, C>) -> Result<(), Error> {
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

    /// Volume in the chute, and what has come in and gone out, per width (m²).
    pub fn volumes(&self) -> [f64; 3] {
        let [entered, left] = self.flow.state().passed;
        let area = self.case.depth * self.case.depth / self.breadth();
        [self.flow.volume(), entered, left].map(|volume| volume * area)
    }

    /// Volume gained beside what came in and went out, over what came in and was there.
    pub fn volume_drift(&self) -> f64 {
        let [entered, left] = self.flow.state().passed;
        let gained = self.flow.volume() - self.start_volume - (entered - left);
        gained / (self.start_volume + entered)
    }

    /// Cells across what is computed.
    fn across(&self) -> usize {
        self.flow.grid().cell_counts()[1..D - 1].iter().product()
    }

    /// What is computed across, over the depth; one in a plane.
    fn breadth(&self) -> f64 {
        let axes = &self.flow.grid().axes()[1..D - 1];
        axes.iter()
            .map(|axis| axis.spacing() * axis.cells() as f64)
            .product()
    }

    /// Distances from the upper end and depths there, their means across (m).
    pub fn profile(&self) -> (Vec<f64>, Vec<f64>) {
        let h = self.case.depth / self.case.cells as f64;
        let (columns, across) = (self.case.columns(), self.across());
        let depths = self.flow.heights();
        let mean = |column: usize| {
            let strips = depths[column..].iter().step_by(columns);
            strips.sum::<f64>() / across as f64 * self.case.depth
        };
        let x = (0..columns).map(|column| (column as f64 + 0.5) * h);
        (x.collect(), (0..columns).map(mean).collect())
    }

    /// Heights (m) and speeds along the chute (m/s) half way down, their means across, in the cells of which more than
    /// half holds material.
    pub fn speeds(&self) -> (Vec<f64>, Vec<f64>) {
        let h = self.case.depth / self.case.cells as f64;
        let (columns, across, state) = (self.case.columns(), self.across(), self.flow.state());
        let middle = columns / 2;
        let row = |n: usize| {
            let strips = (n * across..(n + 1) * across).filter(|strip| {
                let cells = strip * columns + middle;
                0.5 * (state.fractions[cells - 1] + state.fractions[cells]) > 0.5
            });
            let u = |strip: usize| state.velocity[0][strip * (columns + 1) + middle];
            let (count, sum) = strips.fold((0, 0.0), |(n, sum), strip| (n + 1, sum + u(strip)));
            (count > 0).then(|| {
                let speed = sum / f64::from(count) * self.units.velocity;
                ((n as f64 + 0.5) * h, speed)
            })
        };
        (0..self.case.rows()).filter_map(row).unzip()
    }

    /// Fields of the cells with material, x fastest, in SI units, x along the chute and z normal to it.
    pub fn fields(&self) -> Vec<CellFields<D, C>> {
        let mut fields = self.flow.cell_fields();
        for f in &mut fields {
            f.scale(self.case.depth, &self.units);
        }
        fields
    }
}
