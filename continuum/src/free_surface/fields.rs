//! Fields at the centres of filled cells, for pictures and tables.

use super::flow::SurfaceFlow;
use super::topology::NONE;
use crate::discretisation::COMPONENTS;
use crate::grid::{Axis, Boundary, DIMENSIONS, unflatten};
use crate::rheology::{Rheology, strain_rate_norm};
use crate::strain::{middle_stretching, shear_row, stretching};
use crate::units::Units;

/// Matter is rigid where it shears no faster than so many times the strain-rate floor ε.
const RIGID: f64 = 10.0;
/// Cells with less material are left out.
const EMPTY: f64 = 1e-3;

/// Fields of a cell, in the flow's units.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CellFields<const D: usize = DIMENSIONS, const C: usize = COMPONENTS> {
    /// Lower corner.
    pub lower: [f64; D],
    /// Upper corner.
    pub upper: [f64; D],
    /// Share that is filled.
    pub fraction: f64,
    /// Velocity, the mean of opposite faces.
    pub velocity: [f64; D],
    /// Pressure; 0 in cells that have none of their own (less than half full).
    pub pressure: f64,
    /// ((σ_xx − σ_zz)/2, σ_xz), or the five components of [`crate::strain`], positive in tension:
    /// [`SurfaceFlow::mean_stress`].
    pub stress: [f64; C],
    /// γ̇ = √(2 D:D), by central differences.
    pub strain_rate: f64,
    /// Whether it flows: γ̇ above ten times the strain-rate floor.
    pub flows: bool,
    /// Whether the equations of motion are well posed here, by the strain rate in all directions; true where nothing
    /// flows and where a cell has no pressure, of which nothing can be said.
    pub well_posed: bool,
}

impl<const D: usize, const C: usize> CellFields<D, C> {
    /// From natural to SI units, of which the length (m) is given beside the others.
    pub fn scale(&mut self, length: f64, units: &Units) {
        for corner in [&mut self.lower, &mut self.upper] {
            *corner = corner.map(|x| x * length);
        }
        self.velocity = self.velocity.map(|u| u * units.velocity);
        self.pressure *= units.stress();
        self.stress = self.stress.map(|s| s * units.stress());
        self.strain_rate /= units.time();
    }
}

/// Shares of the material's volume in cells of one size: that flows, and that flows where the equations of motion are
/// ill posed ([`crate::rheology::Threshold::is_well_posed`]); cells without a pressure are not among the latter.
pub fn flowing_shares<const D: usize, const C: usize>(cells: &[CellFields<D, C>]) -> [f64; 2] {
    let (mut flows, mut ill_posed, mut whole) = (0.0, 0.0, 0.0);
    for cell in cells {
        whole += cell.fraction;
        flows += if cell.flows { cell.fraction } else { 0.0 };
        ill_posed += if cell.well_posed { 0.0 } else { cell.fraction };
    }
    [flows, ill_posed].map(|part| if whole > 0.0 { part / whole } else { 0.0 })
}

impl<R: Rheology, const D: usize, const C: usize, const V: usize> SurfaceFlow<R, D, C, V> {
    /// Fields of all cells with material, x fastest.
    pub fn cell_fields(&self) -> Vec<CellFields<D, C>> {
        let grid = self.grid();
        let spacing = grid.axes().map(|axis| axis.spacing());
        let (state, (topology, rheology, floor)) = (self.state(), self.parts());
        let filled = |cell: usize| state.fractions[cell] > EMPTY;
        // A flat axis has one face for each cell.
        let faces = |cell: usize, axis: usize| {
            topology.cell_faces[cell][axis].map(|face| match face {
                NONE => state.velocity[axis][cell],
                face => state.velocity[axis][face],
            })
        };
        let velocity = |cell: usize| -> [f64; D] {
            std::array::from_fn(|axis| 0.5 * faces(cell, axis).iter().sum::<f64>())
        };
        let mut fields = Vec::new();
        for cell in (0..state.fractions.len()).filter(|&cell| filled(cell)) {
            let own = velocity(cell);
            // ∂ of a component along another axis, against neighbours with material or the wall.
            let shear = |component: usize, axis: usize| {
                let neighbours = topology.cell_neighbours[cell][axis];
                let walls = match grid.axes()[axis] {
                    Axis::Bounded { low, high, .. } => [
                        Some(low).filter(|_| !topology.opens(cell, axis, 0)),
                        Some(high),
                    ],
                    _ => [None, None],
                };
                let mut ends = [(own[component], 0.0); 2];
                for ((end, &next), wall) in ends.iter_mut().zip(&neighbours).zip(walls) {
                    match (next, wall) {
                        (NONE, Some(Boundary::NoSlip { velocity })) => {
                            // A wall moves along the first of its axes.
                            let moves = component == usize::from(axis == 0);
                            *end = (if moves { velocity } else { 0.0 }, 0.5);
                        }
                        (NONE, _) => {}
                        (next, _) if filled(next) => *end = (velocity(next)[component], 1.0),
                        _ => {}
                    }
                }
                let [(below, back), (above, ahead)] = ends;
                let cells: f64 = back + ahead;
                if cells > 0.0 {
                    (above - below) / (cells * spacing[axis])
                } else {
                    0.0
                }
            };
            let mut rate = [0.0; C];
            for axis in 0..D {
                let [low, high] = faces(cell, axis);
                for &(row, factor) in stretching::<D>(axis) {
                    rate[row] += factor * (high - low) / spacing[axis];
                }
                for lower in 0..axis {
                    rate[shear_row::<D>(lower, axis)] = shear(axis, lower) + shear(lower, axis);
                }
            }
            let strain_rate = strain_rate_norm(rate);
            let pressure = state.pressure[cell].max(0.0);
            let flows = strain_rate > RIGID * floor;
            let index = unflatten(cell, grid.cell_counts());
            fields.push(CellFields {
                lower: std::array::from_fn(|axis| index[axis] as f64 * spacing[axis]),
                upper: std::array::from_fn(|axis| (index[axis] + 1) as f64 * spacing[axis]),
                fraction: state.fractions[cell],
                velocity: own,
                pressure,
                stress: self.mean_stress(cell),
                strain_rate,
                flows,
                well_posed: !flows
                    || pressure <= 0.0
                    || rheology.is_well_posed_in_space(
                        strain_rate,
                        pressure,
                        middle_stretching(&rate),
                    ),
            });
        }
        fields
    }
}
