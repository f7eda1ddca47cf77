//! What joints by cells have in common: a column in the plane x–z (D = 2 axes, spins about y alone, S = 1) and a bed in space
//! (D = S = 3).
//!
//! Both sides give each other the same impulses, cell by cell. With the sums of [`Slip`] and r(t) = min(Δt/t, 1)/Δt,
//!
//! ```text
//! a_c = r(t_r) Σ m h (u − v)/Σ m h,      α_c = r(t_s) (ω_c − Σ I h ω/Σ I h)
//! ```
//! are the accelerations that bring mean velocities and spins of a cell's buffer to those of the continuum, u and ω_c (half of its
//! curl), until the next exchange, Δt later. What they give is laid as forces on the grains, booked while it acts ([`Given`]), and *owed*
//! by the continuum, which takes the opposite in its next step.

use super::cell_monitors::CellMonitors;
use super::joint::{LEAST_BUFFER, acting, in_three, towards, vector_over};
use super::settings::Resolved;
use super::slips::Slip;
use super::windows::Windows;
use colluvium_dem::Simulation;
use nalgebra::{ArrayStorage, SVector};

/// Sums of forces that are laid (N), or of their impulses since the last exchange (N s).
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Given<const D: usize, const S: usize> {
    /// Of the relaxation, and of what carries grains that lie in the continuum, by cell.
    pub relaxation: Vec<SVector<f64, D>>,
    /// Moments of the relaxation of spins, by cell (N m, or N m s).
    pub spin: Vec<SVector<f64, S>>,
    pub traction: SVector<f64, D>,
    pub impedance: SVector<f64, D>,
    /// Powers of traction, impedance and relaxation when they were laid (W); of what is laid alone.
    pub powers: [f64; 3],
}

impl<const D: usize, const S: usize> Given<D, S> {
    fn nothing(cells: usize) -> Self {
        Self {
            relaxation: vec![SVector::zeros(); cells],
            spin: vec![SVector::zeros(); cells],
            traction: SVector::zeros(),
            impedance: SVector::zeros(),
            powers: [0.0; 3],
        }
    }

    /// Back to nothing.
    pub fn clear(&mut self) {
        self.relaxation.fill(SVector::zeros());
        self.spin.fill(SVector::zeros());
        (self.traction, self.impedance) = (SVector::zeros(), SVector::zeros());
        self.powers = [0.0; 3];
    }
}

/// The shell at a row or face of the edge, where grains with shares q of their masses bear what the continuum presses with.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Shell<const D: usize> {
    /// Σ q h (kg).
    pub weight: f64,
    /// Σ q h (v − u), u the continuum's velocity at the grain (N s).
    slip: SVector<f64, D>,
    /// Σ q h v (N s).
    momentum: SVector<f64, D>,
    /// What presses on it and on those that it bears for (N).
    pub force: SVector<f64, D>,
}

impl<const D: usize> Shell<D> {
    /// No grains.
    pub const NONE: Self = Self {
        weight: 0.0,
        slip: SVector::from_array_storage(ArrayStorage([[0.0; D]])),
        momentum: SVector::from_array_storage(ArrayStorage([[0.0; D]])),
        force: SVector::from_array_storage(ArrayStorage([[0.0; D]])),
    };

    /// Adds a grain's share q h (kg) with its velocity and the continuum's there (m/s).
    pub fn add(&mut self, share: f64, velocity: SVector<f64, D>, continuum: SVector<f64, D>) {
        self.weight += share;
        self.slip += share * (velocity - continuum);
        self.momentum += share * velocity;
    }

    /// Mean of v − u (m/s).
    pub fn slip(&self) -> SVector<f64, D> {
        vector_over(self.slip, self.weight)
    }

    /// Mean of v (m/s).
    pub fn velocity(&self) -> SVector<f64, D> {
        vector_over(self.momentum, self.weight)
    }
}

/// What both sides do to each other, and when.
#[derive(Clone, Debug)]
pub(super) struct CellJoint<const D: usize, const S: usize> {
    /// Both sides compared, cell by cell.
    pub slips: Vec<Slip<D, S>>,
    /// Accelerations of mean velocities of the buffer until the next exchange (m/s²).
    pub accelerations: Vec<SVector<f64, D>>,
    /// Angular accelerations of their mean spins (rad/s²).
    pub spins: Vec<SVector<f64, S>>,
    pub laid: Given<D, S>,
    pub given: Given<D, S>,
    /// Steps that the grains had made when this was laid.
    pub laid_at: u64,
    /// Impulse that the continuum has still to take from the relaxation (N s).
    pub owed: Vec<SVector<f64, D>>,
    pub monitors: CellMonitors,
    /// The window of slip and relaxation that is open.
    pub windows: Windows,
    /// Steps for which loads are held, how often until an exchange, and how often since the last one.
    pub steps_of_loads: u64,
    pub loads_of_exchange: u64,
    pub made: u64,
    pub exchanges: u64,
    pub timestep: f64,
}

impl<const D: usize, const S: usize> CellJoint<D, S> {
    /// Nothing exchanged yet on so many cells, at an edge of so many patches.
    pub fn new(cells: usize, edge: usize, settings: &Resolved, simulation: &Simulation) -> Self {
        let timestep = simulation.timestep();
        Self {
            slips: vec![Slip::default(); cells],
            accelerations: vec![SVector::zeros(); cells],
            spins: vec![SVector::zeros(); cells],
            laid: Given::nothing(cells),
            given: Given::nothing(cells),
            laid_at: simulation.steps_done(),
            owed: vec![SVector::zeros(); cells],
            monitors: CellMonitors::default(),
            windows: Windows::new(D, [cells, edge], settings),
            steps_of_loads: settings.steps_of_loads(timestep),
            loads_of_exchange: settings.loads_of_exchange(timestep),
            made: 0,
            exchanges: 0,
            timestep,
        }
    }

    /// Time between two exchanges (s).
    pub fn exchange_time(&self) -> f64 {
        (self.loads_of_exchange * self.steps_of_loads) as f64 * self.timestep
    }

    /// For how long what is laid has acted and is not booked yet (s).
    pub fn acting(&self, simulation: &Simulation) -> f64 {
        acting(simulation, self.laid_at)
    }

    /// Loads are laid anew.
    pub fn lay_anew(&mut self, simulation: &Simulation) {
        self.laid_at = simulation.steps_done();
        self.laid.clear();
    }

    /// Books the impulses of what was laid over the steps made since, and the work of it; says what the relaxation gave (N s).
    pub fn book(&mut self, simulation: &Simulation) -> SVector<f64, D> {
        let time = self.acting(simulation);
        for (work, power) in self.monitors.work.iter_mut().zip(self.laid.powers) {
            *work += power * time;
        }
        let (given, laid) = (&mut self.given, &self.laid);
        for (sum, force) in given.relaxation.iter_mut().zip(&laid.relaxation) {
            *sum += force * time;
        }
        for (sum, moment) in given.spin.iter_mut().zip(&laid.spin) {
            *sum += moment * time;
        }
        given.traction += laid.traction * time;
        given.impedance += laid.impedance * time;
        laid.relaxation.iter().sum::<SVector<f64, D>>() * time
    }

    /// What traction, impedance and relaxation have given that no account has yet (N s).
    pub fn unbooked(&self, simulation: &Simulation) -> [SVector<f64, D>; 3] {
        let (given, laid, time) = (&self.given, &self.laid, self.acting(simulation));
        [
            given.traction + laid.traction * time,
            given.impedance + laid.impedance * time,
            laid.relaxation.iter().sum::<SVector<f64, D>>() * time,
        ]
    }

    /// Momentum that the continuum has still to take from the relaxation (N s).
    pub fn owed(&self, simulation: &Simulation) -> SVector<f64, D> {
        let time = self.acting(simulation);
        let forces = self.laid.relaxation.iter().zip(&self.given.relaxation);
        let all = self.owed.iter().zip(forces);
        all.map(|(owed, (laid, given))| owed - given - laid * time)
            .sum()
    }

    /// At an exchange the continuum comes to owe what the relaxation gave.
    pub fn owe(&mut self) {
        for (owed, given) in self.owed.iter_mut().zip(&self.given.relaxation) {
            *owed -= given;
        }
    }

    /// The continuum has taken this part of what it owed, which is added to its answer.
    pub fn answer(&mut self, part: f64, sum: &mut SVector<f64, D>) {
        for owed in &mut self.owed {
            let answer = *owed * part;
            *owed -= answer;
            *sum += answer;
        }
    }

    /// Compares both sides, and forms the accelerations of cells that are full and hold buffer, `full` being a full cell's mass (kg) and
    /// `rotation` the rotation rate of the material (1/s).
    pub fn relax(
        &mut self,
        settings: &Resolved,
        full: f64,
        is_full: impl Fn(usize) -> bool,
        rotation: impl Fn(usize) -> SVector<f64, S>,
    ) {
        let dt = self.exchange_time();
        let rate = towards(dt, settings.relaxation_time);
        let turn = towards(dt, settings.spin_time);
        for (cell, slip) in self.slips.iter().enumerate() {
            let holds = is_full(cell) && slip.buffer > LEAST_BUFFER * full;
            (self.accelerations[cell], self.spins[cell]) = match holds {
                true => (
                    rate * slip.buffer_slip / slip.buffer,
                    turn * (rotation(cell) - vector_over(slip.spin, slip.turning)),
                ),
                false => (SVector::zeros(), SVector::zeros()),
            };
        }
    }

    /// Takes in an exchange: forces through the handshake surface (N), grains that have escaped, and temperatures (m²/s²).
    pub fn watch(&mut self, force: [f64; 2], escaped: usize, temperatures: [f64; 3]) {
        let dt = self.exchange_time();
        self.windows.pass(dt, &mut self.monitors.windows);
        self.monitors.take(force, escaped, temperatures);
    }

    /// What the monitors have seen, with the window that is open.
    pub fn seen(&self) -> CellMonitors {
        CellMonitors {
            windows: self.windows.closed(&self.monitors.windows),
            ..self.monitors
        }
    }

    /// Takes in what the relaxation gave, with the variances of the momenta of cells' buffers (N² s²).
    pub fn watch_relaxation(&mut self, variances: &[[f64; 2]]) {
        let dt = self.exchange_time();
        let given = self.given.relaxation.iter().zip(variances);
        for (cell, (impulse, [buffer, _])) in given.enumerate() {
            // Cells that relax nothing have no noise of it, either.
            if *impulse != SVector::<f64, D>::zeros() {
                self.windows.relax(cell, in_three(impulse), *buffer, dt);
            }
        }
    }
}
