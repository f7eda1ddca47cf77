//! The steps: grains under what is held, and the exchange that follows so many of them.

use super::continuum::{components, sideways};
use super::gradients::{gradient, rotation};
use super::{Bowl, OverlapError};
use crate::overlap::angular::{AngularBook, Counterpart, Parts};
use crate::overlap::joint::{self, LEAST_BUFFER, inertia, towards, vector_over as over};
use colluvium_dem::{GrainSample, Load, Simulation};
use nalgebra::Vector3;

/// The shell's weight at a face of the box, and its slip.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Shell {
    /// Σ q h (kg).
    pub weight: f64,
    /// Σ q h (v − u), u the continuum's velocity at the grain (N s).
    pub slip: Vector3<f64>,
    /// Σ q h v (N s).
    momentum: Vector3<f64>,
    /// What presses on it and on those above it without grains (N).
    force: Vector3<f64>,
}

/// Room for what is formed and forgotten in a step.
#[derive(Clone, Debug, Default)]
pub struct Scratch {
    near: Vec<GrainSample>,
    pub(super) shell: Vec<Shell>,
    loads: Vec<Load>,
}

impl Bowl {
    /// What follows the steps of the grains for which loads are held: books what they gave, exchanges where it is
    /// time to, and lays the next loads.
    ///
    /// # Errors
    /// If the continuum's step fails or the grains refuse a load.
    pub fn go_on(&mut self, simulation: &mut Simulation) -> Result<(), OverlapError> {
        self.book_grains(simulation);
        self.made += 1;
        if self.made == self.loads_of_exchange {
            self.exchange(simulation)?;
            self.made = 0;
            self.exchanges += 1;
            let before = self
                .angular
                .is_some()
                .then(|| simulation.leapfrog_angular_momentum());
            self.grow(simulation)?;
            if let Some((book, before)) = self.angular.as_mut().zip(before) {
                book.hand(&(simulation.leapfrog_angular_momentum() - before));
            }
        }
        self.lay(simulation)
    }

    /// Books the impulses of what was laid over the steps made since.
    pub(super) fn book_grains(&mut self, simulation: &Simulation) {
        self.monitors.grain_steps += simulation.grain_count() as f64 * self.steps_of_loads as f64;
        let time = self.acting(simulation);
        for (work, power) in self.monitors.work.iter_mut().zip(self.laid.powers) {
            *work += power * time;
        }
        for (sum, force) in self.given.relaxation.iter_mut().zip(&self.laid.relaxation) {
            *sum += force * time;
        }
        for (sum, moment) in self.given.spin.iter_mut().zip(&self.laid.spin) {
            *sum += moment * time;
        }
        self.given.traction += self.laid.traction * time;
        self.given.impedance += self.laid.impedance * time;
        let relaxation: Vector3<f64> = self.laid.relaxation.iter().sum();
        self.account.relaxation += relaxation * time;
        self.account.weight += simulation.gravity() * self.grain_mass * time;
    }

    /// q of a grain for a side: its mass, less the farther it lies inside, down to none at the shell's end.
    fn weight(&self, grain: &GrainSample, side: usize) -> f64 {
        let layout = &self.layout;
        let depth = layout
            .zone
            .depth(&layout.cells, &layout.zone.sides[side], &grain.position);
        let shell = self.spec.settings.shell / self.spec.settings.cell;
        grain.mass * (1.0 - depth / shell).clamp(0.0, 1.0)
    }

    /// The faces that bear parts of a grain, with them: q h.
    fn shares(&self, grain: &GrainSample) -> impl Iterator<Item = (usize, f64)> {
        let layout = &self.layout;
        let sides = 0..layout.zone.sides.len();
        sides.flat_map(move |side| {
            let q = self.weight(grain, side);
            let around = self
                .faces
                .around(&layout.cells, &layout.zone, side, &grain.position);
            around
                .into_iter()
                .filter(move |_| q > 0.0)
                .map(move |(face, hat)| (face, q * hat))
        })
    }

    /// Lays the loads of the next steps.
    pub(super) fn lay(&mut self, simulation: &mut Simulation) -> Result<(), OverlapError> {
        self.laid_at = simulation.steps_done();
        self.laid.clear();
        let mut angular = self.angular.take();
        let laid = self.lay_noting(simulation, angular.as_mut());
        self.angular = angular;
        laid
    }

    /// Lays them, noting what they consist of.
    fn lay_noting(
        &mut self,
        simulation: &mut Simulation,
        mut angular: Option<&mut AngularBook>,
    ) -> Result<(), OverlapError> {
        if let Some(book) = &mut angular {
            book.begin();
        }
        if self.spec.settings.uncoupled {
            return Ok(());
        }
        let mut scratch = std::mem::take(&mut self.scratch);
        let (cells, zone) = (&self.layout.cells, &self.layout.zone);
        let (belongs, buffer) = (self.spec.belongs(), self.layout.widths[0]);
        scratch.near.clear();
        let near = simulation.held(|at| zone.label(cells, at) < buffer);
        scratch.near.extend(near.filter(|grain| belongs(grain)));
        // Rows may stand in another order after a restart, and sums over them end in other bits.
        scratch.near.sort_unstable_by_key(|grain| grain.id);
        self.weigh(&mut scratch);
        let mut answer = self.press_on_shell(&mut scratch.shell);
        let cells = self.layout.cells;
        let mut power = 0.0;
        scratch.loads.clear();
        for grain in &scratch.near {
            let mut force = Vector3::zeros();
            for (face, part) in self.shares(grain) {
                let shell = &scratch.shell[face];
                if shell.weight > self.least[self.faces.all[face].side] {
                    force += part / shell.weight * shell.force;
                }
            }
            let traction = force;
            let inertia = inertia(grain);
            let mut moment = Vector3::zeros();
            for (cell, hat) in cells.hats(&grain.position) {
                let pull = grain.mass * hat * self.held.accelerations[cell];
                let turn = inertia * hat * self.held.spins[cell];
                self.laid.relaxation[cell] += pull;
                self.laid.spin[cell] += turn;
                force += pull;
                moment += turn;
            }
            power += (force - traction).dot(&grain.velocity) + moment.dot(&grain.spin);
            if force != Vector3::zeros() || moment != Vector3::zeros() {
                scratch.loads.push(Load {
                    grain: grain.id,
                    force,
                    moment,
                });
                if let Some(book) = &mut angular {
                    let parts = Parts {
                        traction,
                        relaxation: force - traction,
                        moment,
                    };
                    book.lay(grain.id, parts);
                }
            }
        }
        self.laid.powers[2] = power;
        if let Some(book) = angular {
            for (cell, force) in self.laid.relaxation.iter().enumerate() {
                answer.add(1, &cells.centre(cell), force);
            }
            book.answered_by(&answer);
        }
        simulation.set_loads(&scratch.loads)?;
        self.scratch = scratch;
        Ok(())
    }

    /// Weights and slips of the shell, face by face.
    fn weigh(&self, scratch: &mut Scratch) {
        scratch.shell.clear();
        scratch.shell.resize(self.faces.all.len(), Shell::default());
        for grain in &scratch.near {
            let hats = self.layout.cells.hats(&grain.position);
            let beside = self.view.velocity_at(&hats);
            for (face, part) in self.shares(grain) {
                let shell = &mut scratch.shell[face];
                shell.weight += part;
                let u = beside.unwrap_or(self.held.velocity[face]);
                shell.slip += part * (grain.velocity - u);
                shell.momentum += part * grain.velocity;
            }
        }
    }

    /// What presses on each face, on the grains that bear it: its own, or those of the next face below with grains. Says where
    /// the continuum has it.
    fn press_on_shell(&mut self, shells: &mut [Shell]) -> Counterpart {
        let mut answer = Counterpart::default();
        let impedance = self.spec.settings.impedance;
        for number in 0..self.faces.all.len() {
            let side = self.faces.all[number].side;
            let mut bearer = Some(number);
            while let Some(face) = bearer.filter(|&face| shells[face].weight <= self.least[side]) {
                bearer = self.faces.all[face].below;
            }
            let Some(bearer) = bearer else { continue };
            let slip = over(shells[bearer].slip, shells[bearer].weight);
            let axis = self.layout.zone.sides[side].axis;
            let mut resistance = Vector3::zeros();
            resistance[axis] = -impedance * self.held.area[number] * slip[axis];
            shells[bearer].force += self.held.traction[number] + resistance;
            self.laid.traction += self.held.traction[number];
            self.laid.impedance += resistance;
            let velocity = over(shells[bearer].momentum, shells[bearer].weight);
            self.laid.powers[0] += self.held.traction[number].dot(&velocity);
            self.laid.powers[1] += resistance.dot(&velocity);
            let beside = self.faces.all[number].cells;
            let [out, inside] = beside.map(|cell| self.layout.cells.centre(cell));
            answer.add(
                0,
                &(0.5 * (out + inside)),
                &(self.held.traction[number] + resistance),
            );
        }
        answer
    }

    /// The continuum has no spin: it takes the opposite of the couples that turned the grains of a cell as forces on the six
    /// cells around it,
    ///
    /// ```text
    /// f(± e_a) = ± K × e_a / (4 h_a),        Σ f = 0,  Σ r × f = K,
    /// ```
    /// K the couple's impulse (N m s), h_a spacing along axis a (m). At the ends of the grid there is nothing to take them.
    pub(super) fn answer_couples(&mut self) {
        let cells = &self.layout.cells;
        for (cell, given) in self.given.spin.iter().enumerate() {
            let index = cells.index(cell);
            let is_inside = (0..3).all(|a| index[a] > 0 && index[a] + 1 < cells.counts[a]);
            if *given == Vector3::zeros() || !is_inside {
                continue;
            }
            for axis in 0..3 {
                let arm = Vector3::ith(axis, 0.25 / cells.spacing[axis]);
                let force = -given.cross(&arm);
                let (mut low, mut high) = (index, index);
                (low[axis], high[axis]) = (index[axis] - 1, index[axis] + 1);
                self.owed[cells.cell(high)] += force;
                self.owed[cells.cell(low)] -= force;
            }
        }
    }

    /// Averages of the grains to the continuum, its step, and what it does to the grains until the next exchange.
    fn exchange(&mut self, simulation: &mut Simulation) -> Result<(), OverlapError> {
        let dt = self.exchange_time();
        self.sighting.look(simulation);
        self.sum_up(-(-dt / self.spec.settings.stress_time).exp_m1());
        for (owed, given) in self.owed.iter_mut().zip(&self.given.relaxation) {
            *owed -= given;
        }
        self.answer_couples();
        self.bear();
        self.watch_impulses();
        self.account.traction += self.given.traction;
        self.account.impedance += self.given.impedance;
        self.given.clear();
        if !self.spec.settings.uncoupled {
            self.copy_the_grains(dt)?;
        }
        self.step_continuum(dt, self.exchanges + 1)?;
        self.agree();
        self.watch(dt);
        Ok(())
    }

    /// Sums of the grains over the cells, stresses taken into their averages with this weight.
    pub(super) fn sum_up(&mut self, weight: f64) {
        self.see_grains();
        let belongs = self.spec.belongs();
        let (cells, snapshot) = (&self.layout.cells, &self.sighting.snapshot);
        self.sums.press(cells, snapshot, weight, belongs);
    }

    /// Masses and velocities of the grains over the cells.
    pub(super) fn see_grains(&mut self) {
        let belongs = self.spec.belongs();
        let (cells, snapshot) = (&self.layout.cells, &self.sighting.snapshot);
        self.sums.cover(cells, snapshot, belongs);
    }

    /// Puts together what acts on the continuum for a time (s).
    fn press_on_continuum(&mut self, dt: f64) {
        let stress = 1.0 / self.units.stress();
        let force = stress / self.units.length.powi(2);
        let zones = self.layout.widths;
        let full = self.full();
        for cell in 0..self.layout.cells.count() {
            let index = self.layout.cells.index(cell);
            let label = self.layout.zone.label_of_cell(index);
            let part = self.sums.cover[cell].mass / full;
            let stress_of_grains = &self.sums.stress[cell];
            let beyond = self.view.rest.beyond(cell, stress_of_grains[(2, 2)]);
            let (deviatoric, pressure) = components(&(stress_of_grains - sideways(beyond)));
            let outside = &mut self.outside;
            outside.pressure[cell] = (pressure * stress).max(0.0);
            outside.stress[cell] = deviatoric.map(|s| s * stress);
            outside.cover[cell] = joint::cover(part);
            outside.share[cell] = joint::share(part, label, zones);
            outside.force[cell] = (self.owed[cell] * (force / dt)).into();
        }
    }

    /// Steps of the continuum up to the end of an exchange.
    fn step_continuum(&mut self, dt: f64, exchanges: u64) -> Result<(), OverlapError> {
        let unit = self.units.time();
        let until = exchanges as f64 * dt / unit;
        let coupled = !self.spec.settings.uncoupled;
        if coupled {
            self.press_on_continuum(dt);
            self.flow.set_outside(self.outside.clone())?;
        }
        let before = self.flow.state().velocity_time;
        while self.flow.state().time < until * (1.0 - 1e-12) {
            let step = self.flow.step(until - self.flow.state().time)?;
            self.monitors.steps[0] += 1.0;
            self.monitors.steps[1] += step.active_cells as f64;
            self.monitors.iterations += step.newton_iterations as f64;
            self.monitors.residual = self.monitors.residual.max(step.residuals.momentum);
        }
        // Velocities have moved on by this, half a step ahead of the fractions.
        let pushed = (self.flow.state().velocity_time - before) * unit;
        let untaken = Vector3::from(self.flow.take_untaken());
        self.account.untaken += untaken * self.impulse_unit();
        if coupled {
            for owed in &mut self.owed {
                let answer = *owed * (pushed / dt);
                *owed -= answer;
                self.account.answer += answer;
            }
        }
        self.view
            .look(&self.flow, &self.layout.cells, &self.units, dt);
        Ok(())
    }

    /// A step of the continuum that is taken back but for its stress and pressure, for grains to meet at once.
    pub(super) fn prime(&mut self) -> Result<(), OverlapError> {
        self.view
            .look(&self.flow, &self.layout.cells, &self.units, 0.0);
        let before = self.flow.state().clone();
        let (account, monitors) = (self.account, self.monitors);
        let rest = self.view.rest.clone();
        self.step_continuum(self.exchange_time(), 1)?;
        self.flow.set_state(before)?;
        self.view.rest = rest;
        (self.account, self.monitors) = (account, monitors);
        Ok(())
    }

    /// Slips between both sides, with the same hats at the grains' own places.
    fn slips(&mut self) {
        let [handshake, inner] = self.layout.widths;
        for cover in &mut self.sums.cover {
            (cover.buffer, cover.buffer_slip) = (0.0, Vector3::zeros());
            (cover.turning, cover.spin) = (0.0, Vector3::zeros());
            (cover.inner, cover.inner_slip) = (0.0, Vector3::zeros());
        }
        let belongs = self.spec.belongs();
        let (cells, zone) = (&self.layout.cells, &self.layout.zone);
        for grain in self.sighting.snapshot.grains.iter().filter(|g| belongs(g)) {
            let label = zone.label(cells, &grain.position);
            if label >= inner {
                continue;
            }
            let hats = cells.hats(&grain.position);
            let Some(u) = self.view.velocity_at(&hats) else {
                continue;
            };
            let slip = u - grain.velocity;
            for (cell, hat) in hats {
                let cover = &mut self.sums.cover[cell];
                let mass = grain.mass * hat;
                let (sum, slips) = match label < handshake {
                    true => (&mut cover.buffer, &mut cover.buffer_slip),
                    false => (&mut cover.inner, &mut cover.inner_slip),
                };
                *sum += mass;
                *slips += mass * slip;
                if label < handshake {
                    let turning = inertia(grain) * hat;
                    cover.turning += turning;
                    cover.spin += turning * grain.spin;
                }
            }
        }
    }

    /// Takes the continuum's traction, and forms the accelerations that bring mean velocities together, and mean spins
    /// to half of the curl.
    pub(super) fn agree(&mut self) {
        self.slips();
        let dt = self.exchange_time();
        let rate = towards(dt, self.spec.settings.relaxation_time);
        let turn = towards(dt, self.spec.settings.spin_time);
        let full = self.full();
        for cell in 0..self.layout.cells.count() {
            let cover = &self.sums.cover[cell];
            let holds = self.view.is_full(cell) && cover.buffer > LEAST_BUFFER * full;
            self.held.accelerations[cell] = match holds {
                true => rate * cover.buffer_slip / cover.buffer,
                false => Vector3::zeros(),
            };
            self.held.spins[cell] = match holds {
                true => {
                    let material = rotation(&gradient(&self.view, &self.layout.cells, cell));
                    turn * (material - over(cover.spin, cover.turning))
                }
                false => Vector3::zeros(),
            };
        }
        let (cells, zone) = (&self.layout.cells, &self.layout.zone);
        for (number, face) in self.faces.all.iter().enumerate() {
            let side = &zone.sides[face.side];
            let (fraction, stress, velocity) = self.view.between(face.cells).unwrap_or_default();
            let area = cells.face_area(side.axis) * fraction;
            self.held.area[number] = area;
            self.held.velocity[number] = velocity;
            self.held.traction[number] = stress.column(side.axis) * (side.outwards * area);
        }
    }
}
