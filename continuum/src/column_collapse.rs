//! Collapse of a column of granular matter on a rough floor.
//!
//! A column of height H and width L fills 0 < x < L beside a smooth wall (a plane of symmetry) and is
//! let go at t = 0. What is asked for is how far it runs out, (x_f − L)/L, and what deposit it
//! leaves, as a function of the aspect ratio a = H/L. Experiments: Lajeunesse, Monnier & Homsy,
//! *Phys. Fluids* 17 (2005) 103302; Lube, Huppert, Sparks & Freundt, *Phys. Rev. E* 72 (2005)
//! 041301. μ(I) continuum: Lagrée, Staron & Popinet, *J. Fluid Mech.* 686 (2011) 378.

mod ground;

pub use ground::{CollapseGround, Matter};

use serde::{Deserialize, Serialize};

use crate::error::{Error, require};
use crate::free_surface::{
    CellFields, History, SurfaceFlow, SurfaceOptions, SurfaceState, SurfaceStep,
};
use crate::grid::{Axis, Boundary, Grid};
use crate::rheology::{MuI, ShearLaw};
use crate::units::Units;
use crate::wall_friction::SideWalls;

/// A column to collapse; SI units.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct CollapseCase<L = MuI> {
    /// Aspect ratio a = height over width.
    pub aspect: f64,
    /// Height H of the column (m).
    pub height: f64,
    /// Gravity (m/s²).
    pub gravity: f64,
    /// The material.
    pub rheology: L,
    /// Cells along x.
    pub cells: usize,
    /// Length of the grid over the height of the column.
    pub length_scaled: f64,
    /// How far the face of the column leans out over its foot, from the vertical (degrees); a cliff.
    #[serde(default)]
    pub overhang_degrees: f64,
}

/// Height of the grid over the height of the column.
pub(crate) const ROOM_ABOVE: f64 = 1.25;
/// Fewest cells across the height or the width of the column.
const FEWEST_CELLS: f64 = 4.0;
/// Material counts as at rest when nothing moves faster than this many ε H.
const REST_SPEED: f64 = 5.0;

impl<L> CollapseCase<L> {
    /// The same column of another material.
    pub fn with_law<M>(self, rheology: M) -> CollapseCase<M> {
        CollapseCase {
            aspect: self.aspect,
            height: self.height,
            gravity: self.gravity,
            rheology,
            cells: self.cells,
            length_scaled: self.length_scaled,
            overhang_degrees: self.overhang_degrees,
        }
    }

    /// Width L = H/a of the column (m).
    pub fn width(&self) -> f64 {
        self.height / self.aspect
    }

    /// tan of the angle by which the face leans out.
    fn overhang(&self) -> f64 {
        self.overhang_degrees.to_radians().tan()
    }
}

impl<L: ShearLaw + Clone> CollapseCase<L> {
    /// Refuses parameters out of range.
    ///
    /// # Errors
    /// [`Error::OutOfRange`] with the key, the value and the allowed range.
    pub fn validate(&self) -> Result<(), Error> {
        self.rheology.validate()?;
        for (key, value) in [
            ("aspect", self.aspect),
            ("height", self.height),
            ("gravity", self.gravity),
        ] {
            require(value > 0.0, key, value, "greater than 0 and finite")?;
        }
        let degrees = self.overhang_degrees;
        require(
            (0.0..=60.0).contains(&degrees),
            "overhang_degrees",
            degrees,
            "in [0, 60]",
        )?;
        let least = 1.0 / self.aspect + self.overhang();
        require(
            self.length_scaled > least,
            "grid.length_scaled",
            self.length_scaled,
            format!("greater than the column with its overhang, {least}"),
        )?;
        let per_height = self.cells as f64 / self.length_scaled;
        let smallest = per_height.min(per_height / self.aspect);
        require(
            smallest >= FEWEST_CELLS,
            "grid.cells",
            self.cells as f64,
            format!(
                "at least {} for {FEWEST_CELLS} cells across the column",
                (self.cells as f64 * FEWEST_CELLS / smallest).ceil()
            ),
        )
    }

    /// Natural units of the computation: height, bulk density, √(g H).
    pub fn units(&self) -> Units {
        Units::of_gravity(self.height, self.rheology.bulk_density(), self.gravity)
    }

    /// A grid of so many rows between smooth walls, on a rough floor.
    fn grid(&self, spacing: f64, rows: usize) -> Result<Grid, Error> {
        let axis = |cells: usize, low| Axis::Bounded {
            length: spacing * cells as f64,
            cells,
            low,
            high: Boundary::FreeSlip,
        };
        Grid::with_moving_surface([
            axis(self.cells, Boundary::FreeSlip),
            axis(rows, Boundary::NoSlip { velocity: 0.0 }),
        ])
    }

    /// The column at rest, in natural units.
    fn flow(&self, options: &SurfaceOptions) -> Result<SurfaceFlow<L>, Error> {
        let spacing = self.length_scaled / self.cells as f64;
        let rows = (ROOM_ABOVE / spacing).ceil().max(1.0) as usize;
        let grid = self.grid(spacing, rows)?;
        let fractions = (0..rows)
            .flat_map(|k| (0..self.cells).map(move |i| (i, k)))
            .map(|(i, k)| self.covered(spacing, i, k))
            .collect();
        SurfaceFlow::at_rest(
            grid,
            fractions,
            self.rheology.in_units(&self.units()),
            [0.0, -1.0],
            *options,
        )
    }
}

impl<L> CollapseCase<L> {
    /// Share of a cell of the grid that the column covers: below its top, and behind its face, which leans out
    /// by `tan θ` a unit of height. Exact: the mean over the covered rows of `clamp(x_face(z)/h - i, 0, 1)`.
    pub(crate) fn covered(&self, spacing: f64, i: usize, k: usize) -> f64 {
        let high = (1.0 / spacing - k as f64).clamp(0.0, 1.0);
        if high == 0.0 {
            return 0.0;
        }
        let face = |row: f64| 1.0 / self.aspect / spacing + self.overhang() * row - i as f64;
        let (low_end, high_end) = (face(k as f64), face(k as f64 + high));
        // Integral of the clamp from 0.
        let integral = |u: f64| {
            let v = u.clamp(0.0, 1.0);
            0.5 * v * v + (u - 1.0).max(0.0)
        };
        let along = if high_end - low_end > 1e-12 {
            (integral(high_end) - integral(low_end)) / (high_end - low_end)
        } else {
            low_end.clamp(0.0, 1.0)
        };
        high * along
    }
}

/// Where the heap is at one time; SI units.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize)]
pub struct Front {
    /// Time (s).
    pub time: f64,
    /// The farthest x at which the heap is as high as the threshold (m).
    pub position: f64,
    /// Greatest height of the heap (m).
    pub height: f64,
}

impl Front {
    /// The front of a heap of these heights at these places.
    pub(crate) fn of_profile(time: f64, x: &[f64], h: &[f64], threshold: f64) -> Self {
        let height = h.iter().fold(0.0_f64, |most, h| most.max(*h));
        let last = (0..h.len()).rev().find(|&i| h[i] >= threshold);
        let position = match last {
            None => 0.0,
            Some(i) if i + 1 == h.len() => x[i],
            Some(i) => x[i] + (x[i + 1] - x[i]) * (h[i] - threshold) / (h[i] - h[i + 1]),
        };
        Self {
            time,
            position,
            height,
        }
    }
}

/// A collapse under way.
pub struct Collapse<L = MuI> {
    case: CollapseCase<L>,
    units: Units,
    flow: SurfaceFlow<L>,
    rest_speed: f64,
    start_volume: f64,
    /// Height of the lower edge of the grid (m).
    bottom: f64,
    ground: Option<CollapseGround>,
}

impl<L: ShearLaw + Clone> Collapse<L> {
    /// The column before it is let go.
    ///
    /// # Errors
    /// Parameters or settings out of range.
    pub fn new(case: &CollapseCase<L>, options: &SurfaceOptions) -> Result<Self, Error> {
        case.validate()?;
        Ok(Self::of_flow(case, options, case.flow(options)?))
    }

    /// The column in a channel, whose side walls rub on what moves (SI units).
    ///
    /// # Errors
    /// Parameters or settings out of range.
    pub fn between_side_walls(
        case: &CollapseCase<L>,
        options: &SurfaceOptions,
        walls: SideWalls,
    ) -> Result<Self, Error> {
        case.validate()?;
        walls.validate()?;
        let flow = case
            .flow(options)?
            .between_side_walls(walls.in_units(&case.units()))?;
        Ok(Self::of_flow(case, options, flow))
    }

    /// The column on ground instead of a level floor, with side walls or without.
    ///
    /// # Errors
    /// Parameters or settings out of range, or ground that does not span the grid.
    pub fn over_ground(
        case: &CollapseCase<L>,
        options: &SurfaceOptions,
        ground: &CollapseGround,
        walls: Option<SideWalls>,
    ) -> Result<Self, Error> {
        case.validate()?;
        let (mut flow, bottom) = case.flow_over(ground, options)?;
        if let Some(walls) = walls {
            walls.validate()?;
            flow = flow.between_side_walls(walls.in_units(&case.units()))?;
        }
        Ok(Self {
            bottom,
            ground: Some(ground.clone()),
            ..Self::of_flow(case, options, flow)
        })
    }

    /// Ground without anything on it, to be filled ([`Collapse::fill`]); cells reach up to `top` (m) at least. Of the case's
    /// column only the height is used, as the unit of length.
    ///
    /// # Errors
    /// Parameters or settings out of range, or ground that does not span the grid.
    pub fn bare(
        case: &CollapseCase<L>,
        options: &SurfaceOptions,
        ground: &CollapseGround,
        top: f64,
    ) -> Result<Self, Error> {
        Self::bare_at(case, options, ground, (top, None))
    }

    /// The same with a row of cells that begins at a height `level` (m): ground that is level there cuts no cell.
    ///
    /// # Errors
    /// As [`bare`](Self::bare).
    pub fn bare_in_rows(
        case: &CollapseCase<L>,
        options: &SurfaceOptions,
        ground: &CollapseGround,
        [level, top]: [f64; 2],
    ) -> Result<Self, Error> {
        Self::bare_at(case, options, ground, (top, Some(level)))
    }

    fn bare_at(
        case: &CollapseCase<L>,
        options: &SurfaceOptions,
        ground: &CollapseGround,
        heights: (f64, Option<f64>),
    ) -> Result<Self, Error> {
        case.validate()?;
        let (flow, bottom) = case.bare(ground, heights, options)?;
        Ok(Self {
            bottom,
            ground: Some(ground.clone()),
            ..Self::of_flow(case, options, flow)
        })
    }

    /// Puts matter of any shape, at rest or on the move, in the place of what there is.
    ///
    /// # Errors
    /// [`Error::ForeignState`] for matter of another grid.
    pub fn fill(&mut self, matter: Matter) -> Result<(), Error> {
        let unit = self.units.velocity;
        self.flow.set_state(SurfaceState {
            fractions: matter.fractions,
            velocity: matter
                .velocity
                .map(|u| u.into_iter().map(|u| u / unit).collect()),
            history: History::default(),
            ..self.flow.state().clone()
        })?;
        self.start_volume = self.flow.volume();
        Ok(())
    }

    /// Lower corner of the grid (m).
    pub fn origin(&self) -> [f64; 2] {
        [0.0, self.bottom]
    }

    /// Edge of a cell (m).
    pub fn spacing(&self) -> f64 {
        self.flow.grid().axes()[0].spacing() * self.case.height
    }

    /// Heights of the ground under the columns of cells (m): zero on a level floor.
    pub fn ground_heights(&self) -> Vec<f64> {
        let (x, _) = self.profile();
        let height = |x: &f64| match &self.ground {
            None => 0.0,
            Some(ground) => ground.profile.height_at(*x).unwrap_or(0.0),
        };
        x.iter().map(height).collect()
    }

    /// The ground under each column of cells, down to the lower edge of the grid, as the corners (m) of a
    /// quadrilateral; none on a level floor.
    pub fn ground_outline(&self) -> Vec<[[f64; 2]; 4]> {
        let Some(ground) = &self.ground else {
            return Vec::new();
        };
        let axis = &self.flow.grid().axes()[0];
        let spacing = axis.spacing() * self.case.height;
        let top = |x: f64| {
            let height = ground.profile.height_at(x).unwrap_or(self.bottom);
            [x, height.max(self.bottom)]
        };
        (0..axis.cells())
            .map(|i| {
                let [x0, x1] = [i as f64, (i + 1) as f64].map(|i| i * spacing);
                [[x0, self.bottom], [x1, self.bottom], top(x1), top(x0)]
            })
            .collect()
    }

    fn of_flow(case: &CollapseCase<L>, options: &SurfaceOptions, flow: SurfaceFlow<L>) -> Self {
        Self {
            case: case.clone(),
            units: case.units(),
            rest_speed: REST_SPEED * options.solver.strain_rate_floor,
            start_volume: flow.volume(),
            flow,
            bottom: 0.0,
            ground: None,
        }
    }

    /// The natural units of the computation.
    pub fn units(&self) -> &Units {
        &self.units
    }

    /// The material, in SI units.
    pub fn rheology(&self) -> &L {
        &self.case.rheology
    }

    /// The flow, in natural units.
    pub fn flow(&self) -> &SurfaceFlow<L> {
        &self.flow
    }

    /// The flow, in natural units, to be acted on from outside.
    pub fn flow_mut(&mut self) -> &mut SurfaceFlow<L> {
        &mut self.flow
    }

    /// The flow by itself, in natural units.
    pub fn into_flow(self) -> SurfaceFlow<L> {
        self.flow
    }

    /// Goes on from a state of the same case.
    ///
    /// # Errors
    /// [`Error::ForeignState`] if the state belongs to another grid.
    pub fn set_state(&mut self, state: SurfaceState) -> Result<(), Error> {
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

    /// Positions of the columns of cells (m) and the height of material in each (m).
    pub fn profile(&self) -> (Vec<f64>, Vec<f64>) {
        let spacing = self.flow.grid().axes()[0].spacing() * self.case.height;
        let heights = self.flow.heights();
        let positions = (0..heights.len()).map(|i| (i as f64 + 0.5) * spacing);
        (
            positions.collect(),
            heights.iter().map(|h| h * self.case.height).collect(),
        )
    }

    /// Fields of the cells with material, x fastest, in SI units.
    pub fn fields(&self) -> Vec<CellFields> {
        let mut fields = self.flow.cell_fields();
        for f in &mut fields {
            f.scale(self.case.height, &self.units);
            if self.ground.is_some() {
                f.lower[1] += self.bottom;
                f.upper[1] += self.bottom;
            }
        }
        fields
    }

    /// Where the heap reaches down to a height (m).
    pub fn front(&self, threshold: f64) -> Front {
        let (x, h) = self.profile();
        Front::of_profile(self.time(), &x, &h, threshold)
    }
}
