//! Collapse of an upright cylinder of granular matter on a floor, in space.
//!
//! A cylinder of height H and radius r_0 = H/a is let go at t = 0. What is asked for is how far it runs
//! out, (r_f − r_0)/r_0, and what deposit it leaves, as a function of the aspect ratio a. Experiments find
//! 1.24 a for a < 1.7, whatever the grains: Lube, Huppert, Sparks & Hallworth, *J. Fluid Mech.* 508 (2004)
//! 175; Lajeunesse, Mangeney-Castelnau & Vilotte, *Phys. Fluids* 16 (2004) 2371.
//!
//! It may stand on ground instead ([`CylinderGround`]), which cuts the cells of the grid.
//!
//! The grid knows nothing of the cylinder's axis: its cells are cubes. A quarter of the cylinder between
//! two planes of symmetry is enough; the whole of it shows how symmetric the computation is.

mod ground;
mod heap;

use serde::{Deserialize, Serialize};

pub use self::ground::CylinderGround;
use self::ground::Laid;
pub use self::heap::CylinderFront;
use crate::error::{Error, require};
use crate::free_surface::{
    Contact, SpaceFields, SpaceFlow, SpaceState, SurfaceOptions, SurfaceStep,
};
use crate::grid::{Axis, Boundary, Grid};
use crate::rheology::{MuI, Rheology};
use crate::units::Units;

/// A cylinder to collapse; SI units.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct CylinderCase {
    /// Aspect ratio a = height over radius.
    pub aspect: f64,
    /// Height H of the cylinder (m).
    pub height: f64,
    /// Gravity (m/s²).
    pub gravity: f64,
    /// The material.
    pub rheology: MuI,
    /// Cells from the axis to the edge of the grid.
    pub cells: usize,
    /// Length of the grid from the axis over the height of the cylinder.
    pub length_scaled: f64,
    /// Whether the grid holds the whole cylinder, instead of a quarter between planes of symmetry.
    pub whole: bool,
    /// What holds on the floor.
    #[serde(default)]
    pub floor: Contact,
}

/// Height of the grid over the height of the cylinder.
const ROOM_ABOVE: f64 = 1.1;
/// Fewest cells across the height or the radius of the cylinder.
const FEWEST_CELLS: f64 = 3.0;
/// Material counts as at rest when nothing moves faster than this many ε H.
const REST_SPEED: f64 = 5.0;

impl CylinderCase {
    /// Radius r_0 = H/a of the cylinder (m).
    pub fn radius(&self) -> f64 {
        self.height / self.aspect
    }

    /// Natural units of the computation: height, bulk density, √(g H).
    pub fn units(&self) -> Units {
        Units::of_gravity(self.height, self.rheology.bulk_density(), self.gravity)
    }

    /// Refuses parameters out of range.
    ///
    /// # Errors
    /// [`Error::OutOfRange`] with the key, the value and the allowed range.
    pub fn validate(&self) -> Result<(), Error> {
        self.rheology.validate()?;
        if let Contact::Coulomb(friction) = self.floor {
            friction.validate()?;
        }
        for (key, value) in [
            ("aspect", self.aspect),
            ("height", self.height),
            ("gravity", self.gravity),
        ] {
            require(value > 0.0, key, value, "greater than 0 and finite")?;
        }
        require(
            self.length_scaled * self.aspect > 1.0,
            "grid.length_scaled",
            self.length_scaled,
            format!(
                "greater than the radius over the height, {}",
                1.0 / self.aspect
            ),
        )?;
        let per_height = self.cells as f64 / self.length_scaled;
        let smallest = per_height.min(per_height / self.aspect);
        require(
            smallest >= FEWEST_CELLS,
            "grid.cells",
            self.cells as f64,
            format!(
                "at least {} for {FEWEST_CELLS} cells across the radius and the height",
                (self.cells as f64 * FEWEST_CELLS / smallest).ceil()
            ),
        )
    }

    /// Cell size in units of the height.
    fn spacing(&self) -> f64 {
        self.length_scaled / self.cells as f64
    }

    /// Cells along x or y.
    fn columns(&self) -> usize {
        if self.whole {
            2 * self.cells
        } else {
            self.cells
        }
    }

    /// Cells from the axis of the cylinder to that cell, the nearest counting 0.
    fn cells_to_axis(&self, cell: usize) -> usize {
        match (self.whole, cell.checked_sub(self.cells)) {
            (false, _) => cell,
            (true, Some(beyond)) => beyond,
            (true, None) => self.cells - 1 - cell,
        }
    }

    /// The cylinder at rest, in natural units.
    fn flow(&self, options: &SurfaceOptions) -> Result<SpaceFlow<MuI>, Error> {
        let spacing = self.spacing();
        let rows = (ROOM_ABOVE / spacing).ceil().max(1.0) as usize;
        let columns = self.columns();
        let axis = |cells: usize, low| Axis::Bounded {
            length: spacing * cells as f64,
            cells,
            low,
            high: Boundary::FreeSlip,
        };
        let grid = Grid::with_moving_surface([
            axis(columns, Boundary::FreeSlip),
            axis(columns, Boundary::FreeSlip),
            axis(rows, self.floor.on_wall().in_units(&self.units())),
        ])?;
        let radius = 1.0 / (self.aspect * spacing);
        let mut layer = Vec::with_capacity(columns * columns);
        for j in 0..columns {
            for i in 0..columns {
                layer.push(disc_in_cell(
                    radius,
                    [i, j].map(|n| self.cells_to_axis(n) as f64),
                ));
            }
        }
        let mut fractions = Vec::with_capacity(rows * layer.len());
        for k in 0..rows {
            let high = (1.0 / spacing - k as f64).clamp(0.0, 1.0);
            fractions.extend(layer.iter().map(|share| share * high));
        }
        SpaceFlow::in_space(
            grid,
            fractions,
            self.rheology.in_units(&self.units()),
            [0.0, 0.0, -1.0],
            *options,
        )
    }
}

/// Area of the unit square with its lower corner at `low` that lies within a circle about the origin. With
/// x and y exchanged it is the same to the last bit.
fn disc_in_cell(radius: f64, low: [f64; 2]) -> f64 {
    let [x, y] = low;
    let corner = |x: f64, y: f64| x.hypot(y);
    if corner(x + 1.0, y + 1.0) <= radius {
        return 1.0;
    }
    if corner(x, y) >= radius {
        return 0.0;
    }
    let area = |x: f64, y: f64| disc_in_rectangle(radius, x, y);
    let sides = area(x, y + 1.0) + area(x + 1.0, y);
    ((area(x + 1.0, y + 1.0) + area(x, y)) - sides).clamp(0.0, 1.0)
}

/// Area of the rectangle from the origin to (x, y) that lies within a circle about the origin.
fn disc_in_rectangle(radius: f64, x: f64, y: f64) -> f64 {
    let [x, y] = [x, y].map(|side| side.min(radius));
    if x.hypot(y) <= radius {
        return x * y;
    }
    let triangle = |side: f64| side * (radius * radius - side * side).max(0.0).sqrt();
    let angle = |side: f64| (side / radius).asin();
    let sector = (angle(x) + angle(y)) - std::f64::consts::FRAC_PI_2;
    0.5 * ((triangle(x) + triangle(y)) + radius * radius * sector)
}

/// A collapse under way.
pub struct CylinderCollapse {
    case: CylinderCase,
    units: Units,
    flow: SpaceFlow<MuI>,
    ground: Option<Laid>,
    rest_speed: f64,
    start_volume: f64,
}

impl CylinderCollapse {
    /// The cylinder before it is let go.
    ///
    /// # Errors
    /// Parameters or settings out of range.
    pub fn new(case: &CylinderCase, options: &SurfaceOptions) -> Result<Self, Error> {
        case.validate()?;
        Ok(Self::of(case, options, case.flow(options)?, None))
    }

    /// The cylinder on ground before it is let go; the case's floor does not count.
    ///
    /// # Errors
    /// Parameters or settings out of range, or ground that does not span the grid.
    pub fn over_ground(
        case: &CylinderCase,
        options: &SurfaceOptions,
        ground: &CylinderGround,
    ) -> Result<Self, Error> {
        case.validate()?;
        let (flow, laid) = case.flow_over(ground, options)?;
        Ok(Self::of(case, options, flow, Some(laid)))
    }

    fn of(
        case: &CylinderCase,
        options: &SurfaceOptions,
        flow: SpaceFlow<MuI>,
        ground: Option<Laid>,
    ) -> Self {
        Self {
            case: *case,
            units: case.units(),
            rest_speed: REST_SPEED * options.solver.strain_rate_floor,
            start_volume: flow.volume(),
            flow,
            ground,
        }
    }

    /// Mean height of the ground in each column of cells (m), x fastest; none on a level floor.
    pub fn ground_heights(&self) -> &[f64] {
        self.ground.as_ref().map_or(&[], |laid| &laid.heights)
    }

    /// Height of the grid's lower edge (m).
    pub fn bottom(&self) -> f64 {
        self.ground.as_ref().map_or(0.0, |laid| laid.bottom)
    }

    /// The natural units of the computation.
    pub fn units(&self) -> &Units {
        &self.units
    }

    /// The material, in SI units.
    pub fn rheology(&self) -> &MuI {
        &self.case.rheology
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

    /// Largest difference of the filled fraction between a cell and its mirror images: across the diagonal,
    /// and across both axes where the grid holds the whole cylinder.
    pub fn asymmetry(&self) -> f64 {
        let columns = self.case.columns();
        let fractions = &self.flow.state().fractions;
        let mut largest = 0.0_f64;
        for layer in fractions.chunks_exact(columns * columns) {
            let at = |i: usize, j: usize| layer[i + columns * j];
            for (i, j) in (0..columns).flat_map(|j| (0..columns).map(move |i| (i, j))) {
                largest = largest.max((at(i, j) - at(j, i)).abs());
                if self.case.whole {
                    largest = largest.max((at(i, j) - at(columns - 1 - i, j)).abs());
                    largest = largest.max((at(i, j) - at(i, columns - 1 - j)).abs());
                }
            }
        }
        largest
    }

    /// Fields of the cells with material, x fastest, in SI units; the axis of the cylinder is at x = y = 0.
    pub fn fields(&self) -> Vec<SpaceFields> {
        let length = self.case.height;
        let edge = if self.case.whole {
            self.case.length_scaled * length
        } else {
            0.0
        };
        let mut fields = self.flow.cell_fields();
        for f in &mut fields {
            f.scale(length, &self.units);
            for corner in [&mut f.lower, &mut f.upper] {
                corner[0] -= edge;
                corner[1] -= edge;
                corner[2] += self.bottom();
            }
        }
        fields
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cells_share_the_disc() {
        for radius in [3.0, 4.3, 5.0_f64.sqrt(), 9.99] {
            let cells = 12;
            let mut sum = 0.0;
            for (i, j) in (0..cells).flat_map(|j| (0..cells).map(move |i| (i, j))) {
                let share = disc_in_cell(radius, [i as f64, j as f64]);
                assert_eq!(share, disc_in_cell(radius, [j as f64, i as f64]));
                sum += share;
            }
            let exact = std::f64::consts::PI * radius * radius / 4.0;
            assert!((sum / exact - 1.0).abs() < 1e-13, "{radius} {sum} {exact}");
        }
    }
}
