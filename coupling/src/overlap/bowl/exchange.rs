//! The steps: grains under what is held, and the exchange that follows so many of them.

use super::continuum::{components, sideways};
use super::gradients::{gradient, rotation};
use super::{Bowl, OverlapError};
use crate::overlap::angular::{AngularBook, Counterpart, Parts};
use crate::overlap::cell_joint::Shell;
use crate::overlap::joint::{self, inertia};
use crate::overlap::slips::{Met, compare};
use colluvium_dem::{GrainSample, Load, Simulation};
use nalgebra::Vector3;

/// Room for what is formed and forgotten in a step.
#[derive(Clone, Debug, Default)]
pub struct Scratch {
    near: Vec<GrainSample>,
    pub(super) shell: Vec<Shell<3>>,
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
        self.joint.made += 1;
        if self.joint.made == self.joint.loads_of_exchange {
            self.exchange(simulation)?;
            self.joint.made = 0;
            self.joint.exchanges += 1;
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
        self.grain_steps += simulation.grain_count() as f64 * self.joint.steps_of_loads as f64;
        self.account.relaxation += self.joint.book(simulation);
        self.account.weight += self.weight_until_now(simulation);
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
        self.joint.lay_anew(simulation);
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
                let pull = grain.mass * hat * self.joint.accelerations[cell];
                let turn = inertia * hat * self.joint.spins[cell];
                self.joint.laid.relaxation[cell] += pull;
                self.joint.laid.spin[cell] += turn;
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
        self.joint.laid.powers[2] = power;
        if let Some(book) = angular {
            for (cell, force) in self.joint.laid.relaxation.iter().enumerate() {
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
        scratch.shell.resize(self.faces.all.len(), Shell::NONE);
        for grain in &scratch.near {
            let hats = self.layout.cells.hats(&grain.position);
            let beside = self.view.velocity_at(&hats);
            for (face, part) in self.shares(grain) {
                let u = beside.unwrap_or(self.held.velocity[face]);
                scratch.shell[face].add(part, grain.velocity, u);
            }
        }
    }

    /// What presses on each face, on the grains that bear it: its own, or those of the next face below with grains. Says where
    /// the continuum has it.
    fn press_on_shell(&mut self, shells: &mut [Shell<3>]) -> Counterpart {
        let mut answer = Counterpart::default();
        let impedance = self.spec.settings.impedance;
        for number in 0..self.faces.all.len() {
            let side = self.faces.all[number].side;
            let mut bearer = Some(number);
            while let Some(face) = bearer.filter(|&face| shells[face].weight <= self.least[side]) {
                bearer = self.faces.all[face].below;
            }
            let Some(bearer) = bearer else { continue };
            let slip = shells[bearer].slip();
            let axis = self.layout.zone.sides[side].axis;
            let mut resistance = Vector3::zeros();
            resistance[axis] = -impedance * self.held.area[number] * slip[axis];
            shells[bearer].force += self.held.traction[number] + resistance;
            self.joint.laid.traction += self.held.traction[number];
            self.joint.laid.impedance += resistance;
            let velocity = shells[bearer].velocity();
            self.joint.laid.powers[0] += self.held.traction[number].dot(&velocity);
            self.joint.laid.powers[1] += resistance.dot(&velocity);
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
        for (cell, given) in self.joint.given.spin.iter().enumerate() {
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
                self.joint.owed[cells.cell(high)] += force;
                self.joint.owed[cells.cell(low)] -= force;
            }
        }
    }

    /// Averages of the grains to the continuum, its step, and what it does to the grains until the next exchange.
    fn exchange(&mut self, simulation: &mut Simulation) -> Result<(), OverlapError> {
        let dt = self.exchange_time();
        self.sighting.look(simulation);
        self.sum_up(-(-dt / self.spec.settings.stress_time).exp_m1());
        self.joint.owe();
        self.answer_couples();
        self.bear();
        self.watch_impulses();
        self.account.traction += self.joint.given.traction;
        self.account.impedance += self.joint.given.impedance;
        self.joint.given.clear();
        if !self.spec.settings.uncoupled {
            self.copy_the_grains(dt)?;
        }
        self.step_continuum(dt, self.joint.exchanges + 1)?;
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
            outside.force[cell] = (self.joint.owed[cell] * (force / dt)).into();
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
            self.joint.monitors.take_step(&step);
        }
        // Velocities have moved on by this, half a step ahead of the fractions.
        let pushed = (self.flow.state().velocity_time - before) * unit;
        let untaken = Vector3::from(self.flow.take_untaken());
        self.account.untaken += untaken * self.impulse_unit();
        if coupled {
            self.joint.answer(pushed / dt, &mut self.account.answer);
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
        let (account, monitors) = (self.account, self.joint.monitors);
        let rest = self.view.rest.clone();
        self.step_continuum(self.exchange_time(), 1)?;
        self.flow.set_state(before)?;
        self.view.rest = rest;
        (self.account, self.joint.monitors) = (account, monitors);
        Ok(())
    }

    /// Grains of the bed with their labels (cells).
    pub(super) fn labelled(&self) -> impl Iterator<Item = (&GrainSample, f64)> {
        let (cells, zone, belongs) = (&self.layout.cells, &self.layout.zone, self.spec.belongs());
        let bed = self.sighting.snapshot.grains.iter();
        let bed = bed.filter(move |grain| belongs(grain));
        bed.map(|grain| (grain, zone.label(cells, &grain.position)))
    }

    /// Those of the overlap that lie in the continuum.
    pub(super) fn met(&self) -> impl Iterator<Item = Met<'_, 3, 8>> {
        let [handshake, inner] = self.layout.widths;
        let overlap = self.labelled().filter(move |(_, label)| *label < inner);
        overlap.filter_map(move |(grain, label)| {
            let hats = self.layout.cells.hats(&grain.position);
            Some(Met {
                grain,
                is_buffer: label < handshake,
                hats,
                velocity: self.view.velocity_at(&hats)?,
            })
        })
    }

    /// Takes the continuum's traction, and forms the accelerations that bring mean velocities together, and mean spins
    /// to half of the curl.
    pub(super) fn agree(&mut self) {
        let mut slips = std::mem::take(&mut self.joint.slips);
        compare(self.met(), &mut slips);
        self.joint.slips = slips;
        let (full, view) = (self.full(), &self.view);
        self.joint.relax(
            &self.spec.settings,
            full,
            |cell| view.is_full(cell),
            |cell| rotation(&gradient(view, &self.layout.cells, cell)),
        );
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
