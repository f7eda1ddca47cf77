//! Flow with a moving free surface, in natural units (ρ = 1).
//!
//! Positions and velocities leap over each other: material moves by a full Δt with the velocity of
//! the middle of that step, then the velocity moves on by the mean of two steps under the forces of
//! the new positions. Both are implicit where they have to be (yield, pressure) and the pair is of
//! second order in Δt for forces that depend on position; [`History`] makes it so for stress and advection.

mod accelerate;
mod history;
mod mean_stress;
mod setup;
mod state;

pub use history::History;
pub use state::{SpaceFields, SpaceState, Spent, SurfaceOptions, SurfaceState, SurfaceStep};

use super::faces::ACTIVE;
use super::ground::shores::Shores;
use super::ground::{DUST, Ground};
use super::open_ends::OpenEnds;
use super::operators::points_of;
use super::outside::Outside;
use super::plane::Plane;
use super::sliding::SlidingPlaces;
use super::topology::{NONE, Topology};
use super::transport::{MASSLESS, Motion, Transport, Velocity};
use crate::discretisation::{COMPONENTS, VELOCITIES};
use crate::error::Error;
use crate::grid::{Axis, DIMENSIONS, Grid};
use crate::rheology::Rheology;
use crate::strain::{SPACE_COMPONENTS, SPACE_VELOCITIES};
use crate::wall_friction::SideWalls;
use crate::yield_step::{FlowState, PrimalDual, Residuals};

/// Largest Courant number of a part of a step: beyond, a fraction may leave [0, 1].
const LONGEST_PASS: f64 = 0.5;
/// Least time by which the velocity moves on, over the time step.
const LEAST_PUSH: f64 = 0.5;
/// A cell of larger divergence has let go.
const DILATES: f64 = 1e-6;
/// Fractions of states from outside: transport leaves them within round-off of [0, 1], but for cells over ground that hold
/// too much for a step.
const FRACTIONS: [f64; 2] = [-1e-6, 2.0];
/// Stands for the pressure of cells that have none.
const INACTIVE: f64 = -1.0;
/// Most times that a step is halved.
const MAX_CUTS: usize = 8;
/// First step from rest, over the time of free fall through a cell.
const FIRST_STEP: f64 = 0.2;

/// A flow with a moving surface, in a plane or in space.
pub struct SurfaceFlow<
    R,
    const D: usize = DIMENSIONS,
    const C: usize = COMPONENTS,
    const V: usize = VELOCITIES,
> {
    grid: Grid<D>,
    topology: Topology<D>,
    rheology: R,
    acceleration: [f64; D],
    options: SurfaceOptions,
    state: SurfaceState<D, C>,
    saved: SurfaceState<D, C>,
    planes: Vec<Option<Plane>>,
    shores: Shores,
    transport: Transport<D>,
    /// The velocity that carries material in a step.
    carrier: Velocity<D>,
    /// Leads of one component that faces have of themselves.
    own_leads: Vec<f64>,
    side_walls: Option<SideWalls>,
    sliding: SlidingPlaces<D>,
    bed: Option<Ground<D>>,
    /// What acts from outside.
    outside: Option<Outside<D, C>>,
    /// Impulse of forces from outside that nobody has taken.
    untaken: [f64; D],
    ends: Option<OpenEnds>,
    /// Matter and ground together.
    filled: Vec<f64>,
    solver: Option<(Vec<u32>, PrimalDual<C>)>,
    unknowns: FlowState<C>,
    momentum: Vec<f64>,
    divergence: Vec<f64>,
    spent: Spent,
}

/// A flow with a moving surface in space.
pub type SpaceFlow<R> = SurfaceFlow<R, 3, SPACE_COMPONENTS, SPACE_VELOCITIES>;

impl<R: Rheology, const D: usize, const C: usize, const V: usize> SurfaceFlow<R, D, C, V> {
    /// From now on this acts from outside.
    ///
    /// # Errors
    /// What belongs to another grid, or is out of range.
    pub fn set_outside(&mut self, outside: Outside<D, C>) -> Result<(), Error> {
        outside.validate(self.topology.cells())?;
        self.outside = Some(outside);
        Ok(())
    }

    /// What acts from outside.
    pub fn outside(&self) -> Option<&Outside<D, C>> {
        self.outside.as_ref()
    }

    /// Impulse of forces from outside on cells without a velocity of their own since the last call; forgotten
    /// by it.
    pub fn take_untaken(&mut self) -> [f64; D] {
        std::mem::replace(&mut self.untaken, [0.0; D])
    }

    /// Part of each cell that is free of ground.
    pub fn free_parts(&self) -> Option<&[f64]> {
        self.bed.as_ref().map(|ground| ground.free.as_slice())
    }

    /// The state.
    pub fn state(&self) -> &SurfaceState<D, C> {
        &self.state
    }

    /// Goes on from another state of the same grid.
    ///
    /// # Errors
    /// [`Error::ForeignState`] if the state belongs to another grid, [`Error::OutOfRange`] for fractions that no
    /// flow comes to.
    pub fn set_state(&mut self, state: SurfaceState<D, C>) -> Result<(), Error> {
        let cells = self.topology.cells();
        let fits = state.fractions.len() == cells
            && state.pressure.len() == cells
            && state.stress.len() == self.state.stress.len()
            && (0..D).all(|c| state.velocity[c].len() == self.topology.faces(c))
            && state
                .history
                .fits(|c| self.topology.faces(c), state.stress.len());
        if !fits {
            return Err(Error::ForeignState {
                found: state.fractions.len(),
                expected: cells,
            });
        }
        setup::check_fractions(&state.fractions, cells, FRACTIONS)?;
        self.state = state;
        Ok(())
    }

    /// Stresses at the points of a cell, one for each of its corners.
    pub fn stresses_in(&self, cell: usize) -> &[[f64; C]] {
        let points = points_of(D);
        &self.state.stress[cell * points..(cell + 1) * points]
    }

    /// Where the time went.
    pub fn spent(&self) -> Spent {
        self.spent
    }

    /// The grid.
    pub fn grid(&self) -> &Grid<D> {
        &self.grid
    }

    /// What fields are made from besides the state: neighbours, law, strain-rate floor.
    pub(super) fn parts(&self) -> (&Topology<D>, &R, f64) {
        let floor = self.options.solver.strain_rate_floor;
        (&self.topology, &self.rheology, floor)
    }

    /// Volume of material.
    pub fn volume(&self) -> f64 {
        self.state.fractions.iter().sum::<f64>() * self.grid.cell_volume()
    }

    /// Momentum of the material.
    pub fn momentum(&self) -> [f64; D] {
        std::array::from_fn(|c| {
            let lead = &self.state.history.lead[c];
            let faces = self.state.velocity[c].iter().enumerate();
            faces
                .map(|(face, u)| {
                    let carried = u - lead.get(face).unwrap_or(&0.0);
                    self.topology.face_mean(c, face, &self.state.fractions) * carried
                })
                .sum::<f64>()
                * self.grid.cell_volume()
        })
    }

    /// Largest speed on any face with more material than dust, 10⁻⁹ of a cell: what a rigid heap creeps by lifts as much
    /// into the cells above it, from where it falls back in each step.
    pub fn max_speed(&self) -> f64 {
        let mut most = 0.0_f64;
        for (c, u) in self.state.velocity.iter().enumerate() {
            for (face, u) in u.iter().enumerate() {
                if self.topology.face_mean(c, face, &self.state.fractions) > DUST {
                    most = most.max(u.abs());
                }
            }
        }
        most
    }

    /// Largest Σ |u|/h of a cell with material.
    fn largest_rate(&self) -> f64 {
        self.largest_rate_above(MASSLESS)
    }

    /// Largest Σ |u|/h of a cell that is filled by more than this part.
    fn largest_rate_above(&self, least: f64) -> f64 {
        let mut most = 0.0_f64;
        for (cell, &fraction) in self.state.fractions.iter().enumerate() {
            if fraction <= least {
                continue;
            }
            let mut rate = 0.0;
            for axis in 0..D {
                let faces = self.topology.cell_faces[cell][axis];
                if faces.contains(&NONE) {
                    continue;
                }
                let speed = faces
                    .map(|face| self.state.velocity[axis][face].abs())
                    .into_iter()
                    .fold(0.0, f64::max);
                rate += speed / self.grid.axes()[axis].spacing();
            }
            most = most.max(rate);
        }
        most
    }

    fn smallest_spacing(&self) -> f64 {
        let axes = self.grid.axes().iter().filter(|axis| **axis != Axis::Flat);
        axes.fold(f64::INFINITY, |h, axis| h.min(axis.spacing()))
    }

    /// The time step that the present velocity allows, given the one before.
    fn allowed_step(&self, previous: f64) -> f64 {
        let g = self.acceleration.iter().map(|a| a * a).sum::<f64>().sqrt();
        let first = FIRST_STEP * (self.smallest_spacing() / g.max(1e-12)).sqrt();
        let most = if previous > 0.0 {
            self.options.growth * previous
        } else {
            first
        };
        let rate = self.largest_rate();
        let by_courant = self.options.courant / rate.max(1e-300);
        most.min(by_courant).min(self.options.largest_step)
    }

    /// The next step may be as long as the present velocity of cells with a pressure of their own allows, and at most
    /// `limit`, however short the last one was: for velocities and fractions that were set from outside. Cells with less are
    /// moved in passes as short as they need.
    pub fn renew_step(&mut self, limit: f64) {
        if self.state.next_step > 0.0 {
            let rate = self.largest_rate_above(ACTIVE).max(1e-300);
            let allowed = (self.options.courant / rate).min(self.options.largest_step);
            self.state.next_step = allowed.min(limit);
        }
    }

    /// Moves the velocity on by `dt` without moving material: the way to a steady flow whose surface
    /// stands still.
    ///
    /// # Errors
    /// [`Error::OutOfRange`] for a `dt` that is not above 0; [`Error::NotConverged`].
    pub fn accelerate_in_place(&mut self, dt: f64) -> Result<SurfaceStep, Error> {
        require_forwards("dt", dt)?;
        let mut record = SurfaceStep::default();
        if self.accelerate(dt, &mut record)? {
            record.dt = dt;
            record.max_speed = self.max_speed();
            Ok(record)
        } else {
            Err(self.not_converged(dt, &record.residuals))
        }
    }

    /// Makes one step of at most `limit`. A step that does not converge is halved and tried again.
    ///
    /// # Errors
    /// [`Error::OutOfRange`] for a `limit` that is not above 0; [`Error::NotConverged`] when halving does not help, and what the
    /// solver refuses. The state is then that of before the step, but that from rest the velocity may have its first half of a step.
    pub fn step(&mut self, limit: f64) -> Result<SurfaceStep, Error> {
        require_forwards("limit", limit)?;
        let mut record = SurfaceStep::default();
        if self.state.next_step == 0.0 {
            self.first_half_step(&mut record)?;
        }
        self.saved.clone_from(&self.state);
        let planned = self.state.next_step;
        // Two even steps rather than a long one and a splinter.
        let mut dt = match limit / planned {
            ratio if ratio <= 1.0 => limit,
            ratio if ratio < 2.0 => 0.5 * limit,
            _ => planned,
        };
        let mut growing_from = planned;
        for _ in 0..=MAX_CUTS {
            self.transport(dt);
            record.unsettled_cells = self.transport.unsettled();
            // The velocity moves on to the middle of the next step, from wherever it is: the last one
            // may have become shorter than it was planned.
            let next = self.allowed_step(growing_from);
            if self.options.second_order {
                self.state.history.give_lead(
                    &self.topology,
                    &self.state.fractions,
                    self.transport.carried(),
                    &mut self.state.velocity,
                    0.5 * next / dt,
                    &mut self.own_leads,
                );
            }
            let until = self.state.time + dt + 0.5 * next;
            let ahead = (until - self.state.velocity_time).max(LEAST_PUSH * dt);
            let outcome = self.accelerate(ahead, &mut record);
            if matches!(outcome, Ok(true)) {
                self.state.velocity_time += ahead;
                self.state.next_step = self.allowed_step(growing_from).min(next);
                self.state.time += dt;
                self.state.steps += 1;
                record.time = self.state.time;
                record.dt = dt;
                record.max_speed = self.max_speed();
                return Ok(record);
            }
            self.state.clone_from(&self.saved);
            outcome?;
            record.cuts += 1;
            dt *= 0.5;
            growing_from = dt;
        }
        Err(self.not_converged(dt, &record.residuals))
    }

    fn not_converged(&self, dt: f64, residuals: &Residuals) -> Error {
        Error::NotConverged {
            time: self.state.time,
            dt,
            momentum: residuals.momentum,
            divergence: residuals.divergence,
            stress: residuals.stress,
            strain_rate_floor: residuals.strain_rate_floor,
        }
    }

    /// From rest: half a step for the velocity.
    fn first_half_step(&mut self, record: &mut SurfaceStep) -> Result<(), Error> {
        let mut dt = self.allowed_step(0.0);
        for _ in 0..=MAX_CUTS {
            if self.accelerate(0.5 * dt, record)? {
                self.state.next_step = dt;
                self.state.velocity_time = 0.5 * dt;
                return Ok(());
            }
            record.cuts += 1;
            dt *= 0.5;
        }
        Err(self.not_converged(dt, &record.residuals))
    }

    fn transport(&mut self, dt: f64) {
        let clock = std::time::Instant::now();
        let axes = self.grid.axes();
        let mut orders = vec![(0..D).collect::<Vec<usize>>()];
        if D > 2 {
            // Neither of the horizontal axes comes first.
            orders.push([1, 0].into_iter().chain(2..D).collect());
        }
        for order in &mut orders {
            order.retain(|&axis| axes[axis] != Axis::Flat);
            if !self.state.steps.is_multiple_of(2) {
                order.reverse();
            }
        }
        orders.dedup();
        let incompressible: Vec<bool> = (0..self.topology.cells())
            .map(|cell| match &self.bed {
                None => {
                    self.state.fractions[cell] > ACTIVE && self.divergence(cell).abs() < DILATES
                }
                Some(ground) => {
                    let fraction = self.state.fractions[cell];
                    fraction > ACTIVE * ground.free[cell]
                        && self.divergence_over(ground, cell).abs() < DILATES
                }
            })
            .collect();
        self.carrier.clone_from(&self.state.velocity);
        let passes = (dt * self.largest_rate() / LONGEST_PASS).ceil().max(1.0);
        if self.options.second_order {
            let (state, topology) = (&mut self.state, &self.topology);
            let history = &mut state.history;
            history.take_lead(topology, &state.fractions, &mut state.velocity);
        }
        self.transport.advance(
            &Motion {
                topology: &self.topology,
                carrier: &self.carrier,
                passes: passes as usize,
                courant: std::array::from_fn(|axis| dt / (passes * axes[axis].spacing())),
                orders: &orders,
                incompressible: &incompressible,
                ground: self.bed.as_ref(),
                ends: self.ends.as_ref(),
            },
            &mut self.state.fractions,
            &mut self.state.velocity,
        );
        let volume = self.grid.cell_volume();
        let passed = self.state.passed.iter_mut().zip(self.transport.passed());
        for (whole, part) in passed {
            *whole += part * volume;
        }
        self.spent.transport += clock.elapsed().as_secs_f64();
    }

    fn divergence(&self, cell: usize) -> f64 {
        let mut sum = 0.0;
        for axis in 0..D {
            let [low, high] = self.topology.cell_faces[cell][axis];
            if low != NONE {
                let u = &self.state.velocity[axis];
                sum += (u[high] - u[low]) / self.grid.axes()[axis].spacing();
            }
        }
        sum
    }

    /// Flux out of the cells that share a pressure with one, per volume of a whole cell.
    fn divergence_over(&self, ground: &Ground<D>, cell: usize) -> f64 {
        let master = match ground.master[cell] {
            NONE => return 0.0,
            master => master,
        };
        let mut sum = 0.0;
        for member in std::iter::once(master).chain(ground.parts_of(master)) {
            for axis in 0..D {
                let [low, high] = self.topology.cell_faces[member][axis];
                let through =
                    |face: usize| self.state.velocity[axis][face] * ground.aperture[axis][face];
                sum += (through(high) - through(low)) / self.grid.axes()[axis].spacing();
            }
        }
        sum
    }

    /// Height of material in each column of cells along the last axis.
    pub fn heights(&self) -> Vec<f64> {
        let columns = self.grid.cell_counts()[..D - 1].iter().product();
        let spacing = self.grid.axes()[D - 1].spacing();
        let mut heights = vec![0.0; columns];
        for row in self.state.fractions.chunks_exact(columns) {
            for (height, fraction) in heights.iter_mut().zip(row) {
                *height += fraction * spacing;
            }
        }
        heights
    }
}

/// Refuses a time step that does not go forwards (natural units).
fn require_forwards(key: &'static str, value: f64) -> Result<(), Error> {
    match value > 0.0 {
        true => Ok(()),
        false => Err(Error::OutOfRange {
            key,
            value,
            allowed: "above 0".into(),
        }),
    }
}

impl<R: Rheology> SpaceFlow<R> {
    /// Largest difference of the filled fraction between a cell and its mirror image across the middle of y.
    pub fn asymmetry_across(&self) -> f64 {
        let [columns, across, _] = self.grid.cell_counts();
        let mut largest = 0.0_f64;
        for layer in self.state.fractions.chunks_exact(columns * across) {
            let strips = layer.chunks_exact(columns);
            for (strip, mirrored) in strips.clone().zip(strips.rev()) {
                for (a, b) in strip.iter().zip(mirrored) {
                    largest = largest.max((a - b).abs());
                }
            }
        }
        largest
    }
}
