//! Flow with a moving free surface, in natural units (ρ = 1).
//!
//! Positions and velocities leap over each other: material moves by a full Δt with the velocity of
//! the middle of that step, then the velocity moves on by the mean of two steps under the forces of
//! the new positions. Both are implicit where they have to be (yield, pressure) and the pair is of
//! second order in Δt for forces that depend on position.

use serde::{Deserialize, Serialize};

use super::faces::{ACTIVE, Face, Faces, ThinLayer};
use super::fields::CellFields;
use super::fraction::reconstruct;
use super::ground::contact::sliding_place;
use super::ground::faces::faces_over;
use super::ground::{Contact, DUST, Ground, Terrain};
use super::open_ends::{Inflow, can_open};
use super::operators::{Material, Operators, POINTS, points_of};
use super::outside::Outside;
use super::plane::Plane;
use super::topology::{NONE, Topology};
use super::transport::{MASSLESS, Motion, Transport};
use crate::discretisation::{COMPONENTS, Discretisation, VELOCITIES};
use crate::error::{Error, require};
use crate::grid::{Axis, DIMENSIONS, Grid};
use crate::rheology::Rheology;
use crate::strain::{SPACE_COMPONENTS, SPACE_VELOCITIES};
use crate::wall_friction::SideWalls;
use crate::yield_step::{
    FlowState, PrimalDual, PrimalDualOptions, Residuals, StepProblem, YieldSolver,
};

/// Settings of a flow with a moving surface, in natural units.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct SurfaceOptions {
    /// Largest Δt Σ |u|/h over the axes, at most 1. Above ½ material moves in two parts with one
    /// velocity.
    pub courant: f64,
    /// Largest time step.
    pub largest_step: f64,
    /// Factor by which a time step may exceed the one before.
    pub growth: f64,
    /// How layers thinner than half a cell move over rough walls.
    pub thin_layer: ThinLayer,
    /// The solver of the implicit part.
    pub solver: PrimalDualOptions,
}

impl Default for SurfaceOptions {
    fn default() -> Self {
        Self {
            courant: 0.45,
            largest_step: 0.05,
            growth: 1.3,
            thin_layer: ThinLayer::default(),
            solver: PrimalDualOptions {
                strain_rate_floor: 1e-5,
                momentum_tolerance: 1e-5,
                divergence_tolerance: 1e-8,
                stress_tolerance: 1e-4,
                tolerance_in_motion: 50.0,
                one_sided_pressure: true,
                ..PrimalDualOptions::default()
            },
        }
    }
}

impl SurfaceOptions {
    /// Refuses settings that cannot work.
    ///
    /// # Errors
    /// [`Error::OutOfRange`] with the key, the value and the allowed range.
    pub fn validate(&self) -> Result<(), Error> {
        require(
            self.courant > 0.0 && self.courant <= 1.0,
            "solver.courant",
            self.courant,
            "greater than 0, at most 1: no velocity is known farther than a cell from the material",
        )?;
        require(
            self.largest_step > 0.0,
            "solver.largest_step",
            self.largest_step,
            "greater than 0 and finite",
        )?;
        require(
            self.growth > 1.0,
            "solver.growth",
            self.growth,
            "greater than 1 and finite",
        )
    }
}

/// What one step of a flow with a moving surface did.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize)]
pub struct SurfaceStep {
    /// Time at the end of the step.
    pub time: f64,
    /// Time step.
    pub dt: f64,
    /// Cells with a pressure.
    pub active_cells: usize,
    /// Newton iterations, those of failed attempts included.
    pub newton_iterations: usize,
    /// Steps that were cut and tried again.
    pub cuts: usize,
    /// Points whose friction went by the pressure before the step ([`crate::yield_step::StepReport::held_points`]).
    pub held_points: usize,
    /// Residuals of the equations.
    pub residuals: Residuals,
    /// Largest speed of material.
    pub max_speed: f64,
}

/// Largest Courant number of a part of a step: beyond, a fraction may leave [0, 1].
const LONGEST_PASS: f64 = 0.5;
/// Least time by which the velocity moves on, over the time step.
const LEAST_PUSH: f64 = 0.5;
/// Free fall may shrink a cell at this rate: the round-off of a velocity over a cell.
const FREE_FALL: f64 = 1e-12;
/// A cell of larger divergence has let go.
const DILATES: f64 = 1e-6;
/// Stands for the pressure of cells that have none.
const INACTIVE: f64 = -1.0;
/// Most times that a step is halved.
const MAX_CUTS: usize = 8;
/// First step from rest, over the time of free fall through a cell.
const FIRST_STEP: f64 = 0.2;
/// Cells over ground that miss less of being full count as full.
const FULL_TO: f64 = 1e-11;

/// State of a flow with a moving surface, on all of its grid.
#[derive(Debug, Clone, PartialEq)]
pub struct SurfaceState<const D: usize = DIMENSIONS, const C: usize = COMPONENTS> {
    /// Fraction of each cell that is filled.
    pub fractions: Vec<f64>,
    /// Velocity on each face of each component.
    pub velocity: [Vec<f64>; D],
    /// Pressure of each cell, negative where there is none.
    pub pressure: Vec<f64>,
    /// Stress at each corner of each cell, then the traction of side walls there if there are any, then
    /// that of ground in each cell under Coulomb friction.
    pub stress: Vec<[f64; C]>,
    /// Time of the fractions.
    pub time: f64,
    /// Time of the velocity, half a step ahead.
    pub velocity_time: f64,
    /// Time step that the velocity is meant for; zero before the first.
    pub next_step: f64,
    /// Volumes that have flowed in and out through open ends.
    pub passed: [f64; 2],
    /// Steps made.
    pub steps: usize,
}

impl<const D: usize, const C: usize> Default for SurfaceState<D, C> {
    fn default() -> Self {
        Self {
            fractions: Vec::new(),
            velocity: std::array::from_fn(|_| Vec::new()),
            pressure: Vec::new(),
            stress: Vec::new(),
            time: 0.0,
            velocity_time: 0.0,
            next_step: 0.0,
            steps: 0,
            passed: [0.0; 2],
        }
    }
}

/// Ground, and what follows from it; so far it is known in a plane only.
struct Bed<const D: usize, const C: usize, const V: usize> {
    ground: Ground<D>,
    faces: RolesOver<D>,
    operators: OperatorsOver<D, C, V>,
}

/// Makes the roles of faces over ground.
type RolesOver<const D: usize> =
    fn(&Ground<D>, &Topology<D>, &[f64], [f64; D], ThinLayer) -> Faces<D>;
/// Makes the operators of material over ground.
type OperatorsOver<const D: usize, const C: usize, const V: usize> =
    for<'a> fn(&Material<'a, D>, &Ground<D>) -> Operators<D, C, V>;

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
    transport: Transport<D>,
    side_walls: Option<SideWalls>,
    bed: Option<Bed<D, C, V>>,
    /// What acts from outside; so far in a plane only.
    outside: Option<Outside>,
    /// Impulse of forces from outside that nobody has taken.
    untaken: [f64; DIMENSIONS],
    inflow: Option<Inflow>,
    /// Matter and ground together.
    filled: Vec<f64>,
    solver: Option<(Vec<usize>, PrimalDual<C>)>,
    unknowns: FlowState<C>,
    momentum: Vec<f64>,
    divergence: Vec<f64>,
    spent: Spent,
}

/// Wall time by phase of the step (s).
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize)]
pub struct Spent {
    /// Moving volume and momentum.
    pub transport: f64,
    /// Finding the unknowns and making their operators.
    pub operators: f64,
    /// Analysing the pattern of the matrix.
    pub analysis: f64,
    /// Newton's method: assembly, factors, Krylov iterations.
    pub newton: f64,
}

impl<R: Rheology> SurfaceFlow<R> {
    /// Material at rest that fills the given fraction of each cell of a plane grid, x fastest.
    ///
    /// # Errors
    /// Settings out of range.
    pub fn at_rest(
        grid: Grid,
        fractions: Vec<f64>,
        rheology: R,
        acceleration: [f64; DIMENSIONS],
        options: SurfaceOptions,
    ) -> Result<Self, Error> {
        Self::filling(grid, fractions, rheology, acceleration, options)
    }

    /// The same flow with open ends along x: this flows in at the low one, and what comes to the high one flows
    /// out. Both stand for smooth walls of the grid, over a floor that does not cut its cells.
    ///
    /// # Errors
    /// An inflow that does not fit the grid, ends that are not smooth walls, or ground.
    pub fn with_open_ends(mut self, inflow: Inflow) -> Result<Self, Error> {
        let axis = &self.grid.axes()[0];
        let ends = [0, axis.cells()].map(|face| axis.boundary_at(face));
        let fits = self.bed.is_none() && ends.iter().all(|end| can_open(end.as_ref()));
        require(
            fits,
            "inflow",
            axis.spacing() * axis.cells() as f64,
            "a grid of this length with smooth walls at both ends of x and a level floor",
        )?;
        inflow.validate(self.grid.axes()[1].cells())?;
        inflow.impose(&self.topology, &mut self.state.velocity);
        self.saved.clone_from(&self.state);
        self.inflow = Some(inflow);
        Ok(self)
    }

    /// From now on this acts from outside; on a flow over ground nothing does.
    ///
    /// # Errors
    /// What belongs to another grid, or is out of range.
    pub fn set_outside(&mut self, outside: Outside) -> Result<(), Error> {
        outside.validate(self.topology.cells())?;
        self.outside = Some(outside);
        Ok(())
    }

    /// What acts from outside.
    pub fn outside(&self) -> Option<&Outside> {
        self.outside.as_ref()
    }

    /// Impulse of forces from outside on cells without a velocity of their own since the last call; forgotten
    /// by it.
    pub fn take_untaken(&mut self) -> [f64; DIMENSIONS] {
        std::mem::take(&mut self.untaken)
    }

    /// Material at rest over ground, in natural units. Fractions are of whole cells, and at most what the
    /// ground leaves free of each.
    ///
    /// # Errors
    /// Settings out of range, or ground that does not span the grid.
    pub fn over_ground(
        grid: Grid,
        terrain: &Terrain,
        fractions: Vec<f64>,
        rheology: R,
        acceleration: [f64; DIMENSIONS],
        options: SurfaceOptions,
    ) -> Result<Self, Error> {
        let topology = Topology::rising(&grid, terrain.rise);
        let ground = Ground::new(&grid, &topology, terrain)?;
        let mut flow = Self::at_rest(grid, fractions, rheology, acceleration, options)?;
        let full = flow.state.fractions.iter_mut().zip(&ground.free);
        for (fraction, free) in full {
            *fraction = fraction.min(*free);
            // Full but for the round-off of the two ways to the same number.
            if free - *fraction < FULL_TO {
                *fraction = *free;
            }
        }
        if let Contact::Coulomb(_) = terrain.contact {
            let cells = topology.cells();
            let points = sliding_place(cells, cells);
            flow.state.stress.resize(points, [0.0; COMPONENTS]);
        }
        flow.topology = topology;
        flow.set_weight_for_pressure();
        flow.saved.clone_from(&flow.state);
        flow.bed = Some(Bed {
            ground,
            faces: faces_over,
            operators: |material, ground| material.operators_over(ground),
        });
        Ok(flow)
    }

    /// The same flow between side walls at a distance along y, in natural units: they rub on what
    /// moves with 2 c/W + (2 μ/W) p per volume.
    ///
    /// # Errors
    /// Walls out of range.
    pub fn between_side_walls(mut self, walls: SideWalls) -> Result<Self, Error> {
        walls.validate()?;
        self.side_walls = Some(walls);
        let points = 2 * self.topology.cells() * POINTS;
        let points = points.max(self.state.stress.len());
        self.state.stress.resize(points, [0.0; COMPONENTS]);
        self.saved.clone_from(&self.state);
        Ok(self)
    }
}

/// A flow with a moving surface in space.
pub type SpaceFlow<R> = SurfaceFlow<R, 3, SPACE_COMPONENTS, SPACE_VELOCITIES>;
/// Fields of a cell of a [`SpaceFlow`].
pub type SpaceFields = CellFields<3, SPACE_COMPONENTS>;
/// The state of a [`SpaceFlow`].
pub type SpaceState = SurfaceState<3, SPACE_COMPONENTS>;

impl<R: Rheology> SpaceFlow<R> {
    /// Material at rest that fills the given fraction of each cell of a grid in space, x fastest and z
    /// slowest.
    ///
    /// # Errors
    /// Settings out of range.
    pub fn in_space(
        grid: Grid<3>,
        fractions: Vec<f64>,
        rheology: R,
        acceleration: [f64; 3],
        options: SurfaceOptions,
    ) -> Result<Self, Error> {
        Self::filling(grid, fractions, rheology, acceleration, options)
    }
}

impl<R: Rheology, const D: usize, const C: usize, const V: usize> SurfaceFlow<R, D, C, V> {
    fn filling(
        grid: Grid<D>,
        fractions: Vec<f64>,
        rheology: R,
        acceleration: [f64; D],
        options: SurfaceOptions,
    ) -> Result<Self, Error> {
        options.validate()?;
        let topology = Topology::new(&grid);
        let state = SurfaceState {
            velocity: std::array::from_fn(|c| vec![0.0; topology.faces(c)]),
            pressure: vec![INACTIVE; topology.cells()],
            stress: vec![[0.0; C]; topology.cells() * points_of(D)],
            fractions,
            ..SurfaceState::default()
        };
        Ok(Self {
            saved: state.clone(),
            state,
            planes: Vec::new(),
            transport: Transport::default(),
            side_walls: None,
            bed: None,
            inflow: None,
            outside: None,
            untaken: [0.0; DIMENSIONS],
            filled: Vec::new(),
            solver: None,
            unknowns: FlowState {
                u: Vec::new(),
                p: Vec::new(),
                s: Vec::new(),
            },
            momentum: Vec::new(),
            divergence: Vec::new(),
            spent: Spent::default(),
            grid,
            topology,
            rheology,
            acceleration,
            options,
        })
    }

    /// Starts with the pressure of the weight of what lies above, which is exact under level surfaces.
    fn set_weight_for_pressure(&mut self) {
        let axis = D - 1;
        let per_cell = -self.acceleration[axis] * self.grid.axes()[axis].spacing();
        if per_cell <= 0.0 {
            return;
        }
        let fractions = &self.state.fractions;
        for cell in (0..self.topology.cells()).rev() {
            let above = self.topology.cell_neighbours[cell][axis][1];
            if fractions[cell] > 0.0 {
                let load = match above {
                    NONE => 0.0,
                    above if fractions[above] > 0.0 => {
                        self.state.pressure[above] + 0.5 * per_cell * fractions[above].max(0.0)
                    }
                    _ => 0.0,
                };
                self.state.pressure[cell] = load + 0.5 * per_cell * fractions[cell];
            }
        }
    }

    /// Part of each cell that is free of ground.
    pub fn free_parts(&self) -> Option<&[f64]> {
        self.bed.as_ref().map(|bed| bed.ground.free.as_slice())
    }

    /// The state.
    pub fn state(&self) -> &SurfaceState<D, C> {
        &self.state
    }

    /// Goes on from another state of the same grid.
    ///
    /// # Errors
    /// [`Error::ForeignState`] if the state belongs to another grid.
    pub fn set_state(&mut self, state: SurfaceState<D, C>) -> Result<(), Error> {
        let cells = self.topology.cells();
        let fits = state.fractions.len() == cells
            && state.pressure.len() == cells
            && state.stress.len() == self.state.stress.len()
            && (0..D).all(|c| state.velocity[c].len() == self.topology.faces(c));
        if !fits {
            return Err(Error::ForeignState {
                found: state.fractions.len(),
                expected: cells,
            });
        }
        self.state = state;
        Ok(())
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
            let faces = self.state.velocity[c].iter().enumerate();
            faces
                .map(|(face, u)| self.topology.face_mean(c, face, &self.state.fractions) * u)
                .sum::<f64>()
                * self.grid.cell_volume()
        })
    }

    /// Largest speed on any face with material.
    pub fn max_speed(&self) -> f64 {
        let mut most = 0.0_f64;
        for (c, u) in self.state.velocity.iter().enumerate() {
            for (face, u) in u.iter().enumerate() {
                if self.topology.face_mean(c, face, &self.state.fractions) > MASSLESS {
                    most = most.max(u.abs());
                }
            }
        }
        most
    }

    /// Largest Σ |u|/h of a cell with material.
    fn largest_rate(&self) -> f64 {
        let mut most = 0.0_f64;
        for (cell, &fraction) in self.state.fractions.iter().enumerate() {
            if fraction <= MASSLESS {
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

    /// Moves the velocity on by `dt` without moving material: the way to a steady flow whose surface
    /// stands still.
    ///
    /// # Errors
    /// [`Error::NotConverged`].
    pub fn accelerate_in_place(&mut self, dt: f64) -> Result<SurfaceStep, Error> {
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
    /// [`Error::NotConverged`] when halving does not help.
    pub fn step(&mut self, limit: f64) -> Result<SurfaceStep, Error> {
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
            // The velocity moves on to the middle of the next step, from wherever it is: the last one
            // may have become shorter than it was planned.
            let next = self.allowed_step(growing_from);
            let until = self.state.time + dt + 0.5 * next;
            let ahead = (until - self.state.velocity_time).max(LEAST_PUSH * dt);
            if self.accelerate(ahead, &mut record)? {
                self.state.velocity_time += ahead;
                self.state.next_step = self.allowed_step(growing_from).min(next);
                self.state.time += dt;
                self.state.steps += 1;
                record.time = self.state.time;
                record.dt = dt;
                record.max_speed = self.max_speed();
                return Ok(record);
            }
            record.cuts += 1;
            self.state.clone_from(&self.saved);
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
                Some(Bed { ground, .. }) => {
                    let fraction = self.state.fractions[cell];
                    fraction > ACTIVE * ground.free[cell]
                        && self.divergence_over(ground, cell).abs() < DILATES
                }
            })
            .collect();
        let passes = (dt * self.largest_rate() / LONGEST_PASS).ceil().max(1.0);
        self.transport.advance(
            &Motion {
                topology: &self.topology,
                passes: passes as usize,
                courant: std::array::from_fn(|axis| dt / (passes * axes[axis].spacing())),
                orders: &orders,
                incompressible: &incompressible,
                ground: self.bed.as_ref().map(|bed| &bed.ground),
                inflow: self.inflow.as_ref(),
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

    /// Moves the velocity on by `dt` under gravity, pressure and stress.
    fn accelerate(&mut self, dt: f64, record: &mut SurfaceStep) -> Result<bool, Error> {
        let clock = std::time::Instant::now();
        let fractions = &self.state.fractions;
        let (acceleration, thin_layer) = (self.acceleration, self.options.thin_layer);
        let mut faces = match &self.bed {
            None => {
                reconstruct(&self.topology, fractions, &mut self.planes);
                Faces::of(
                    &self.grid,
                    &self.topology,
                    fractions,
                    acceleration,
                    thin_layer,
                )
            }
            Some(Bed { ground, faces, .. }) => {
                ground.fill(fractions, &mut self.filled);
                reconstruct(&self.topology, &self.filled, &mut self.planes);
                // Nor has the surface of matter a plane where there is only ground.
                for (plane, fraction) in self.planes.iter_mut().zip(fractions) {
                    if *fraction <= DUST {
                        *plane = None;
                    }
                }
                faces(ground, &self.topology, fractions, acceleration, thin_layer)
            }
        };
        if let Some(inflow) = &self.inflow {
            inflow.open(&mut faces);
        }
        let material = Material {
            grid: &self.grid,
            topology: &self.topology,
            fractions,
            planes: &self.planes,
            faces: &faces,
            side_walls: self.side_walls,
            inflow: self.inflow.as_ref(),
            acceleration,
            outside: self.outside.as_ref(),
        };
        let Operators {
            discretisation,
            places,
        } = match &self.bed {
            None => material.operators(),
            Some(bed) => (bed.operators)(&material, &bed.ground),
        };
        self.gather(&faces, &places);
        if self.falls_freely(&discretisation, dt) {
            self.spent.operators += clock.elapsed().as_secs_f64();
            record.active_cells = faces.active.len();
            record.residuals = Residuals::default();
            self.scatter(&faces, &places, dt);
            return Ok(true);
        }
        let pattern = discretisation.pattern();
        self.spent.operators += clock.elapsed().as_secs_f64();
        let clock = std::time::Instant::now();
        if self
            .solver
            .as_ref()
            .is_none_or(|(known, _)| *known != pattern)
        {
            // The old factors make room first: in space they are most of the memory.
            self.solver = None;
            self.solver = Some((
                pattern,
                PrimalDual::new(&discretisation, self.options.solver)?,
            ));
        }
        self.spent.analysis += clock.elapsed().as_secs_f64();
        let clock = std::time::Instant::now();
        record.active_cells = faces.active.len();
        let load = discretisation.load(self.acceleration);
        let problem = StepProblem {
            discretisation: &discretisation,
            rheology: &self.rheology,
            load: &load,
            dt,
        };
        let Some((_, solver)) = &mut self.solver else {
            return Ok(false);
        };
        let report = solver.step(&problem, &mut self.unknowns)?;
        self.spent.newton += clock.elapsed().as_secs_f64();
        record.newton_iterations += report.iterations;
        record.residuals = report.residuals;
        record.held_points = report.held_points;
        if report.converged {
            if let Some(outside) = &self.outside {
                let rates = outside.untaken(&faces, &self.topology);
                for (sum, rate) in self.untaken.iter_mut().zip(rates) {
                    *sum += rate * dt;
                }
            }
            self.scatter(&faces, &places, dt);
        }
        Ok(report.converged)
    }

    /// Without pressure and stress, and if gravity alone lets no cell shrink, free fall is the exact
    /// solution: makes it, to the last bit, and says so.
    fn falls_freely(&mut self, discretisation: &Discretisation<D, C, V>, dt: f64) -> bool {
        let unknowns = &mut self.unknowns;
        let is_loose = self.bed.is_none()
            && self.outside.is_none()
            && self.inflow.is_none()
            && unknowns.p.iter().all(|p| *p <= f64::MIN_POSITIVE)
            && unknowns.s.iter().all(|s| *s == [0.0; C])
            && self.rheology.threshold(1.0, 0.0).stress == 0.0
            && self
                .side_walls
                .is_none_or(|walls| walls.friction.cohesion == 0.0);
        if !is_loose {
            return false;
        }
        self.divergence.clear();
        self.divergence.resize(discretisation.cells(), 0.0);
        let pushes = self.acceleration.map(|a| a * dt);
        for &(cell, j, area) in discretisation.divergence() {
            let push = pushes[discretisation.component_of(j)];
            self.divergence[cell] += area * (unknowns.u[j] + push);
        }
        let volume = self.grid.cell_volume();
        if self.divergence.iter().any(|d| *d < -FREE_FALL * volume) {
            return false;
        }
        for (j, u) in unknowns.u.iter_mut().enumerate() {
            *u += pushes[discretisation.component_of(j)];
        }
        unknowns.p.fill(0.0);
        true
    }

    /// Velocity, pressure and stress of the unknowns from those of the grid.
    fn gather(&mut self, faces: &Faces<D>, places: &[usize]) {
        let count = faces.own.len();
        self.unknowns.u.clear();
        self.unknowns.u.resize(count, 0.0);
        self.momentum.clear();
        self.momentum.resize(count, 0.0);
        for c in 0..D {
            for (face, role) in faces.role[c].iter().enumerate() {
                if let Some(j) = role.unknown() {
                    let mass = self.topology.face_mean(c, face, &self.state.fractions);
                    self.momentum[j] += mass * faces.share(c, face);
                    self.unknowns.u[j] += mass * self.state.velocity[c][face];
                }
            }
        }
        for (u, mass) in self.unknowns.u.iter_mut().zip(&self.momentum) {
            *u /= mass;
        }
        self.unknowns.p.clear();
        self.unknowns
            .p
            .extend(faces.active.iter().map(|&cell| self.state.pressure[cell]));
        // A cell that was not active before has no pressure yet, which is not to say that it has
        // let go.
        for (p, &cell) in self.unknowns.p.iter_mut().zip(&faces.active) {
            if self.state.pressure[cell] < 0.0 {
                *p = f64::MIN_POSITIVE;
            }
        }
        self.unknowns.s.clear();
        self.unknowns
            .s
            .extend(places.iter().map(|&place| self.state.stress[place]));
    }

    fn scatter(&mut self, faces: &Faces<D>, places: &[usize], dt: f64) {
        for c in 0..D {
            let push = self.acceleration[c] * dt;
            for (face, role) in faces.role[c].iter().enumerate() {
                let mass = self.topology.face_mean(c, face, &self.state.fractions);
                if *role == Face::Loose {
                    let u = &mut self.state.velocity[c][face];
                    *u = if mass > MASSLESS { *u + push } else { 0.0 };
                }
            }
        }
        faces.spread(&self.unknowns.u, &mut self.state.velocity);
        if let Some(inflow) = &self.inflow {
            inflow.impose(&self.topology, &mut self.state.velocity);
        }
        self.state.pressure.fill(INACTIVE);
        for (&cell, p) in faces.active.iter().zip(&self.unknowns.p) {
            self.state.pressure[cell] = *p;
        }

        self.state.stress.fill([0.0; C]);
        for (&place, s) in places.iter().zip(&self.unknowns.s) {
            self.state.stress[place] = *s;
        }
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
