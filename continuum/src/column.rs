//! A column of material along one axis, part of whose stress may be given from outside.
//!
//! Nothing varies across the column, so matter keeps its height and moves along itself with u(z). Each face
//! bears, in shares that add up to one, the material's own stress and a given one:
//!
//! ```text
//! ρ h (uₖ − uₖ*)/Δt = [(1 − w) τ(u, p) + w τ̂]ₖ₊₁ − [(1 − w) τ(u, p) + w τ̂]ₖ + ρ h g_t + Jₖ/Δt,
//! ```
//! with cells of height h, the share w of a face, the given stress τ̂, the acceleration g_t along the flow and
//! an impulse Jₖ per area that the cell takes in over the step. The pressure follows from the weight and from
//! what presses on an end that is free. With w = 0 and J = 0 this is [`Flow`] itself, and the step is solved by
//! its method: implicit, with a true yield stress.
//!
//! SI units; τ = τ_xz is positive where it pulls what lies above forwards.

use crate::discretisation::ThresholdPressure;
use crate::error::{Error, require};
use crate::flow::{Flow, StepRecord, YieldMethod};
use crate::grid::{Axis, Boundary, Grid};
use crate::rheology::{Rheology, ShearLaw};
use crate::units::Units;
use crate::yield_step::{FlowState, PrimalDualOptions};

/// A column to compute (SI).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ColumnCase<L> {
    /// Length along the axis (m).
    pub length: f64,
    /// Cells along the axis.
    pub cells: usize,
    /// Acceleration along the flow and along the axis (m/s²).
    pub acceleration: [f64; 2],
    /// What holds at the low and at the high end; one of them must set the pressure.
    pub ends: [Boundary; 2],
    /// The material.
    pub rheology: L,
    /// Strain-rate floor ε of the yield step, in √(g/H): rigid matter creeps at about this rate.
    pub strain_rate_floor: f64,
}

/// A column in motion.
pub struct Column<L> {
    units: Units,
    spacing: f64,
    flow: Flow<L>,
    /// Weights of the points where the material bears all stress.
    whole: Vec<f64>,
    /// Load of gravity and of what presses on the ends by themselves, natural units.
    steady: Vec<f64>,
    shares: Vec<f64>,
    /// Range of the velocities along the flow.
    along: std::ops::Range<usize>,
    /// Momentum residual of the last step, as a fraction of g.
    residual: f64,
    /// The parts of the last step, natural units.
    parts: Vec<StepRecord>,
}

/// Steps into which one may fall apart before it is given up.
const MOST_PARTS: usize = 4096;

impl<L: ShearLaw> ColumnCase<L> {
    /// The column at rest under its own weight.
    ///
    /// # Errors
    /// Parameters out of range, or no end that sets the pressure.
    pub fn begin(&self) -> Result<Column<L>, Error> {
        self.rheology.validate()?;
        require(
            self.length > 0.0,
            "column.length",
            self.length,
            "greater than 0 m and finite",
        )?;
        crate::layer::validate_grid(self.cells, None)?;
        for acceleration in self.acceleration {
            require(true, "column.acceleration", acceleration, "finite")?;
        }
        let units = self.units();
        let ends = self.ends.map(|end| end.in_units(&units));
        let grid = Grid::new([
            Axis::Flat,
            Axis::Bounded {
                length: 1.0,
                cells: self.cells,
                low: ends[0],
                high: ends[1],
            },
        ])?;
        let acceleration = self.acceleration.map(|a| a / units.acceleration());
        let free = ends.map(|end| end.outer_pressure());
        let hydrostatic = |z: f64| match free {
            [_, Some(p)] => p - acceleration[1] * (1.0 - z),
            [p, None] => p.unwrap_or(0.0) + acceleration[1] * z,
        };
        let method = YieldMethod::PrimalDual(PrimalDualOptions {
            strain_rate_floor: self.strain_rate_floor,
            ..Default::default()
        });
        let flow = Flow::at_rest(
            grid,
            ThresholdPressure::Corner,
            self.rheology.in_units(&units),
            acceleration,
            method,
            hydrostatic,
        )?;
        let discretisation = flow.discretisation();
        Ok(Column {
            units,
            spacing: self.length / self.cells as f64,
            whole: discretisation.points().iter().map(|p| p.weight).collect(),
            steady: discretisation.load(acceleration),
            shares: vec![0.0; self.cells + 1],
            along: discretisation.grid().component(0),
            residual: 0.0,
            parts: Vec::new(),
            flow,
        })
    }

    /// Natural units: of gravity, of a load without gravity, and 1 s where there is neither.
    fn units(&self) -> Units {
        let density = self.rheology.bulk_density();
        let gravity = self.acceleration[0].hypot(self.acceleration[1]);
        let load = self.ends.iter().filter_map(|end| end.outer_pressure());
        let load = load.fold(0.0, f64::max);
        if gravity > 0.0 {
            Units::of_gravity(self.length, density, gravity)
        } else if load > 0.0 {
            Units::of_load(self.length, density, load)
        } else {
            Units {
                length: self.length,
                density,
                velocity: self.length,
            }
        }
    }
}

impl<L: Rheology> Column<L> {
    /// Number of cells.
    pub fn cells(&self) -> usize {
        self.shares.len() - 1
    }

    /// Height of a cell (m).
    pub fn spacing(&self) -> f64 {
        self.spacing
    }

    /// Mass of a cell per area (kg/m²).
    pub fn cell_mass(&self) -> f64 {
        self.units.density * self.spacing
    }

    /// Says which share of each face's stress is given from outside, from 0 to 1.
    ///
    /// # Errors
    /// A share out of range, or not one for each face.
    pub fn share(&mut self, shares: &[f64]) -> Result<(), Error> {
        let faces = self.shares.len();
        require(
            shares.len() == faces,
            "column.shares",
            shares.len() as f64,
            format!("{faces}, one for each face"),
        )?;
        for &share in shares {
            require(
                (0.0..=1.0).contains(&share),
                "column.shares",
                share,
                "0 to 1",
            )?;
        }
        self.shares.copy_from_slice(shares);
        for (q, point) in self.flow.points_mut().iter_mut().enumerate() {
            point.weight = self.whole[q] * (1.0 - shares[face_of(q)]);
        }
        Ok(())
    }

    /// Velocity of a cell along the flow (m/s).
    pub fn velocity(&self, cell: usize) -> f64 {
        self.flow.state().u[self.along.start + cell] * self.units.velocity
    }

    /// Changes the velocity of a cell (m/s).
    pub fn set_velocity(&mut self, cell: usize, velocity: f64) {
        let at = self.along.start + cell;
        self.flow.state_mut().u[at] = velocity / self.units.velocity;
    }

    /// The material's own shear stress on a face (Pa).
    pub fn shear_stress(&self, face: usize) -> f64 {
        let s = &self.flow.state().s;
        let (mut sum, mut points) = (0.0, 0.0);
        for q in points_of(face, self.cells()) {
            sum += s[q][1];
            points += 1.0;
        }
        sum / points * self.units.stress()
    }

    /// Pressure on a face (Pa).
    pub fn pressure(&self, face: usize) -> f64 {
        let points = self.flow.discretisation().points();
        let (mut sum, mut count) = (0.0, 0.0);
        for q in points_of(face, self.cells()) {
            sum += points[q].pressure(&self.flow.state().p);
            count += 1.0;
        }
        sum / count * self.units.stress()
    }

    /// Pressure in a cell (Pa).
    pub fn cell_pressure(&self, cell: usize) -> f64 {
        self.flow.state().p[cell] * self.units.stress()
    }

    /// Momentum residual of the last step, as a fraction of g.
    pub fn residual(&self) -> f64 {
        self.residual
    }

    /// The parts into which the last step fell, in natural units: one where none had to be cut.
    pub fn parts(&self) -> &[StepRecord] {
        &self.parts
    }

    /// Natural units.
    pub fn units(&self) -> &Units {
        &self.units
    }

    /// Shares of the material that has yielded, and that has yielded where the equations are ill posed.
    pub fn yielded_and_ill_posed(&self) -> [f64; 2] {
        self.flow.yielded_and_ill_posed()
    }

    /// Advances by `dt` (s) with given stresses on the faces (Pa, counted by their shares), impulses per area
    /// into the cells (Pa s) and pressures on the ends (Pa; without effect on a rigid one).
    ///
    /// # Errors
    /// [`Error::NotConverged`] when shorter steps do not help.
    pub fn step(
        &mut self,
        dt: f64,
        given: &[f64],
        impulses: &[f64],
        pressures: [f64; 2],
    ) -> Result<(), Error> {
        let (units, cells) = (self.units, self.cells());
        let stress = 1.0 / units.stress();
        let dt = dt / units.time();
        // Areas are 1 and forces stresses; an impulse per area and time is a stress.
        let impulse = 1.0 / (units.stress() * units.time() * dt);
        let load = self.flow.load_mut();
        load.copy_from_slice(&self.steady);
        for k in 0..cells {
            let traction = self.shares[k + 1] * given[k + 1] - self.shares[k] * given[k];
            load[self.along.start + k] += traction * stress + impulses[k] * impulse;
        }
        let grid = self.flow.discretisation().grid();
        let ends = [(0, 1.0), (cells, -1.0)].map(|(face, sign)| (grid.unknown(1, [0, face]), sign));
        for ((unknown, sign), pressure) in ends.into_iter().zip(pressures) {
            if let Some(unknown) = unknown {
                self.flow.load_mut()[unknown] += sign * pressure * stress;
            }
        }
        let mut left = dt;
        self.parts.clear();
        for _ in 0..MOST_PARTS {
            let record = self.flow.step(left)?;
            self.parts.push(record);
            self.residual = record.residuals.momentum;
            left -= record.dt;
            if left <= 1e-12 * dt {
                self.settle();
                return Ok(());
            }
        }
        Err(Error::NotSteady {
            steps: MOST_PARTS,
            time: self.flow.time(),
            acceleration: f64::NAN,
            tolerance: left,
        })
    }

    /// Matter keeps its height: what the linear solver leaves of a motion along the axis (1e-40) is no part of the
    /// state, and need not be the same after a restart.
    fn settle(&mut self) {
        let across = self.flow.discretisation().grid().component(1);
        let state = self.flow.state_mut();
        state.u[across].fill(0.0);
        state.s.iter_mut().for_each(|stress| stress[0] = 0.0);
    }

    /// Velocity, pressure, stress and time in natural units: what [`take_up`](Self::take_up) goes on from
    /// with the same bits.
    pub fn state(&self) -> (&FlowState, f64) {
        (self.flow.state(), self.flow.time())
    }

    /// Goes on from a state of such a column.
    ///
    /// # Errors
    /// In words, if it is that of another grid.
    pub fn take_up(&mut self, state: FlowState, time: f64) -> Result<(), String> {
        self.flow.take_up(state, time)
    }
}

/// The face on which a point lies: points come in pairs, one for the low and one for the high face of a cell.
fn face_of(point: usize) -> usize {
    point / 2 + point % 2
}

/// The points on a face: the high one of the cell below it and the low one of the cell above it.
fn points_of(face: usize, cells: usize) -> impl Iterator<Item = usize> {
    let below = face.checked_sub(1).map(|cell| 2 * cell + 1);
    let above = (face < cells).then_some(2 * face);
    below.into_iter().chain(above)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bagnold::BagnoldCase;
    use crate::rheology::MuI;

    fn incline(cells: usize) -> (BagnoldCase, ColumnCase<MuI>) {
        let rheology = MuI::new(0.38, 0.64, 0.28, 1e-3, 0.6, 2500.0);
        let (slope, gravity) = (24.0_f64.to_radians(), 9.81);
        let case = BagnoldCase {
            slope,
            depth: 0.02,
            gravity,
            rheology,
            cells,
            columns: None,
        };
        let column = ColumnCase {
            length: case.depth,
            cells,
            acceleration: [gravity * slope.sin(), -gravity * slope.cos()],
            ends: [Boundary::NoSlip { velocity: 0.0 }, Boundary::FreeSurface],
            rheology,
            strain_rate_floor: 1e-6,
        };
        (case, column)
    }

    /// Bagnold's flow, whoever bears the stress: the exact stress may be given on any face.
    #[test]
    fn a_given_stress_stands_in_for_the_material() {
        let cells = 32;
        let (case, column) = incline(cells);
        let h = case.depth / cells as f64;
        let exact: Vec<f64> = (0..=cells)
            .map(|f| case.exact_shear_stress(f as f64 * h))
            .collect();
        let nothing = vec![0.0; cells];
        for part in [0.0, 0.5] {
            let mut run = column.begin().unwrap();
            let shares: Vec<f64> = (0..=cells)
                .map(|f| if f > 8 && f < 20 { part } else { 0.0 })
                .collect();
            run.share(&shares).unwrap();
            for _ in 0..6 {
                run.step(1e6, &exact, &nothing, [0.0; 2]).unwrap();
            }
            for k in 0..cells {
                let z = (k as f64 + 0.5) * h;
                let miss = run.velocity(k) - case.exact_velocity(z);
                let miss = miss / case.exact_velocity(case.depth);
                assert!(miss.abs() < 5e-4, "share {part}, cell {k}: {miss:e}");
                let miss = run.cell_pressure(k) / case.exact_pressure(z) - 1.0;
                assert!(miss.abs() < 1e-9, "{miss:e}");
            }
            assert!((run.shear_stress(0) / exact[0] - 1.0).abs() < 1e-6);
        }
    }

    #[test]
    fn impulses_and_given_stresses_are_taken_in_whole() {
        let cells = 10;
        let (_, column) = incline(cells);
        let column = ColumnCase {
            ends: [Boundary::FreeSlip, Boundary::FreeSurface],
            ..column
        };
        let mut run = column.begin().unwrap();
        let mut shares = vec![0.0; cells + 1];
        (shares[0], shares[1]) = (1.0, 0.5);
        run.share(&shares).unwrap();
        let mut impulses = vec![0.0; cells];
        impulses[3] = 0.7;
        let given = vec![25.0; cells + 1];
        let dt = 1e-3;
        for _ in 0..20 {
            run.step(dt, &given, &impulses, [0.0; 2]).unwrap();
        }
        let momentum: f64 = (0..cells).map(|k| run.cell_mass() * run.velocity(k)).sum();
        let weight = column.acceleration[0] * run.cell_mass() * cells as f64;
        let taken = 20.0 * (0.7 + dt * (weight - 25.0));
        assert!((momentum / taken - 1.0).abs() < 1e-10, "{momentum} {taken}");
        assert!(run.share(&[0.0]).is_err());
        assert!(run.share(&vec![1.5; cells + 1]).is_err());
    }
}
