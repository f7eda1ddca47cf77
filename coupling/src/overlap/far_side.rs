//! The continuum as the grains see it: cells and faces counted outwards from the inner edge a.

use super::edge::FlatEdge;
use super::strip::Strip;
use colluvium_continuum::column::{Column, ColumnCase};
use colluvium_continuum::grid::Boundary;
use colluvium_continuum::rheology::ShearLaw;
use colluvium_continuum::{Error, yield_step::FlowState};
use nalgebra::Vector3;

/// The column beyond the inner edge of one patch.
pub struct FarSide<L> {
    column: Column<L>,
    /// The column's coordinate runs inwards.
    reversed: bool,
    /// Cells of the copy.
    copied: usize,
    given: Vec<f64>,
    impulses: Vec<f64>,
    velocities: Vec<f64>,
}

impl<L: ShearLaw> FarSide<L> {
    /// The column of `beyond` cells beyond the edge and a copy of those of the strip, whose faces bear the grains'
    /// stress by `shares`.
    pub fn new(
        edge: &FlatEdge,
        strip: &Strip,
        beyond: usize,
        gravity: &Vector3<f64>,
        far_end: Boundary,
        law: (L, f64),
        shares: impl Fn(usize) -> f64,
    ) -> Result<Self, Error> {
        let cells = strip.nodes() + beyond;
        let reversed = !edge.grains_below;
        // The inner end is loaded by the grains' stress alone; where the far end does not set the pressure, it
        // does.
        let inner_end = if sets_pressure(&far_end) {
            Boundary::FreeSlip
        } else {
            Boundary::FreeSurface
        };
        let (rheology, strain_rate_floor) = law;
        let case = ColumnCase {
            length: strip.cell * cells as f64,
            cells,
            acceleration: [gravity[edge.flow_axis], gravity[edge.axis]],
            ends: if reversed {
                [far_end, inner_end]
            } else {
                [inner_end, far_end]
            },
            rheology,
            strain_rate_floor,
        };
        let mut column = case.begin()?;
        let mut shares: Vec<f64> = (0..=cells)
            .map(|f| if f < strip.nodes() { shares(f) } else { 0.0 })
            .collect();
        if reversed {
            shares.reverse();
        }
        column.share(&shares)?;
        Ok(Self {
            column,
            reversed,
            copied: strip.nodes(),
            given: vec![0.0; cells + 1],
            impulses: vec![0.0; cells],
            velocities: vec![0.0; cells],
        })
    }

    fn cell(&self, outwards: usize) -> usize {
        if self.reversed {
            self.column.cells() - 1 - outwards
        } else {
            outwards
        }
    }

    fn face(&self, outwards: usize) -> usize {
        if self.reversed {
            self.column.cells() - outwards
        } else {
            outwards
        }
    }

    /// σ_tn = ±σ_t,axis.
    fn sign(&self) -> f64 {
        if self.reversed { -1.0 } else { 1.0 }
    }

    /// Number of cells, those of the copy included.
    pub fn cells(&self) -> usize {
        self.column.cells()
    }

    /// Mass of a cell per area (kg/m²).
    pub fn cell_mass(&self) -> f64 {
        self.column.cell_mass()
    }

    /// Velocities of all cells (m/s), from a outwards.
    pub fn velocities(&self) -> &[f64] {
        &self.velocities
    }

    /// Reads the velocities again.
    pub fn read_velocities(&mut self) {
        for k in 0..self.velocities.len() {
            self.velocities[k] = self.column.velocity(self.cell(k));
        }
    }

    /// Gives a cell a velocity (m/s).
    pub fn set_velocity(&mut self, cell: usize, velocity: f64) {
        let at = self.cell(cell);
        self.column.set_velocity(at, velocity);
        self.velocities[cell] = velocity;
    }

    /// The material's own σ_tn on a face (Pa).
    pub fn shear_stress(&self, face: usize) -> f64 {
        self.sign() * self.column.shear_stress(self.face(face))
    }

    /// Pressure on a face (Pa).
    pub fn pressure(&self, face: usize) -> f64 {
        self.column.pressure(self.face(face))
    }

    /// Pressure in a cell (Pa).
    pub fn cell_pressure(&self, cell: usize) -> f64 {
        self.column.cell_pressure(self.cell(cell))
    }

    /// Momentum residual of the last step, as a fraction of g.
    pub fn residual(&self) -> f64 {
        self.column.residual()
    }

    /// Advances by `dt` with the grains' shear stress on the faces of the copy, impulses per area into its cells
    /// and the one beyond, and the grains' pressure at a.
    pub fn step(
        &mut self,
        dt: f64,
        shear: impl Fn(usize) -> f64,
        impulse: impl Fn(usize) -> f64,
        pressure: f64,
    ) -> Result<(), Error> {
        for f in 0..=self.copied {
            let at = self.face(f);
            self.given[at] = self.sign() * shear(f);
        }
        // The couple of the outermost node reaches half into the cell beyond the edge.
        for k in 0..=self.copied {
            let at = self.cell(k);
            self.impulses[at] = impulse(k);
        }
        let pressures = if self.reversed {
            [0.0, pressure]
        } else {
            [pressure, 0.0]
        };
        self.column
            .step(dt, &self.given, &self.impulses, pressures)?;
        self.read_velocities();
        Ok(())
    }

    /// State of the solver, natural units.
    pub fn state(&self) -> (&FlowState, f64) {
        self.column.state()
    }

    /// Goes on from such a state.
    pub fn take_up(&mut self, state: FlowState, time: f64) -> Result<(), String> {
        self.column.take_up(state, time)?;
        self.read_velocities();
        Ok(())
    }
}

/// Whether a far end gives way along the normal.
pub(super) fn sets_pressure(far_end: &Boundary) -> bool {
    matches!(far_end, Boundary::FreeSurface | Boundary::LoadedWall { .. })
}
