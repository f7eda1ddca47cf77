//! The steps: grains under what is held, and the exchange that follows so many of them.

use super::averages::Sight;
use super::edge::ZoneEdge;
use super::settings::NormalMotion;
use super::shell::Given;
use super::strip::Strip;
use super::{Ledger, Overlap, OverlapError};
use colluvium_continuum::rheology::ShearLaw;
use colluvium_dem::{Partner, Simulation};

impl<L: ShearLaw + Copy> Overlap<L> {
    /// Opens the ledger with what there is now.
    pub(super) fn open(&mut self, simulation: &mut Simulation) {
        self.ledger = Ledger {
            mass_before: self.grain_mass + self.mass_beyond,
            grains_before: self.grain_momentum(simulation),
            continuum_before: self.continuum_momentum(),
            ..Ledger::default()
        };
    }

    pub(super) fn exchange_time(&self, simulation: &Simulation) -> f64 {
        self.steps as f64 * simulation.timestep()
    }

    /// Advances grains and continuum by so many steps of the grains.
    ///
    /// # Errors
    /// If the grains fly apart or the continuum's step fails.
    pub fn advance(&mut self, simulation: &mut Simulation, steps: u64) -> Result<(), OverlapError> {
        for _ in 0..steps {
            self.step_grains(simulation)?;
            self.made += 1;
            if self.made == self.steps {
                self.exchange(simulation)?;
                self.made = 0;
            }
        }
        Ok(())
    }

    /// One step of the grains under what is held.
    fn step_grains(&mut self, simulation: &mut Simulation) -> Result<(), OverlapError> {
        let impedance = self.settings.impedance;
        let kick = simulation.next_kick();
        let before = self.given.impedance;
        self.shell.lay(
            simulation,
            (&self.edge, &self.strip),
            (impedance, self.normal_velocity),
            &self.held,
            &mut self.given,
        )?;
        let gravity = simulation.gravity();
        let n = self.edge.normal(&gravity);
        self.ledger.weight[0] += kick * self.grain_mass * gravity[self.edge.flow_axis];
        self.ledger.weight[1] += kick * self.grain_mass * gravity.dot(&n);
        simulation.advance(1)?;
        if self.settings.normal_motion == NormalMotion::Riding {
            let taken = before - self.given.impedance;
            self.normal_velocity += taken / self.mass_beyond;
            self.ledger.riding += taken;
            self.edge
                .shift(self.normal_velocity * simulation.timestep());
        }
        Ok(())
    }

    /// Averages of the grains to the continuum, its step, and what it does to the grains until the next exchange.
    fn exchange(&mut self, simulation: &mut Simulation) -> Result<(), OverlapError> {
        let dt = self.exchange_time(simulation);
        self.look(simulation);
        self.sample(dt / self.settings.stress_time);
        self.step_continuum(dt)?;
        self.book(dt);
        self.follow(dt);
        // The slips that the next exchange acts on are those against the continuum as it now is.
        self.sample(0.0);
        self.agree(simulation);
        let area = self.edge.area();
        let relaxation: f64 = self.given.relaxation.iter().sum();
        self.monitors.take(
            &self.averages,
            &self.continuum,
            (&self.strip, area),
            [relaxation, self.given.shear],
            self.shell.beyond,
        );
        self.given.relaxation.fill(0.0);
        self.given.spin.fill(0.0);
        let given = &mut self.given;
        (given.shear, given.pressure, given.impedance, given.time) = (0.0, 0.0, 0.0, 0.0);
        Ok(())
    }

    /// Takes a snapshot whose bits do not depend on the order of the grains' lists, which a restart may change: contacts
    /// are sorted, and velocities are those that the integrator holds, half a step back, free of sums of forces.
    pub(super) fn look(&mut self, simulation: &mut Simulation) {
        simulation.snapshot(&mut self.snapshot);
        self.snapshot.contacts.sort_unstable_by_key(|contact| {
            let (kind, other) = match contact.partner {
                Partner::Grain(other) => (0, other),
                Partner::Wall(other) => (1, other),
                Partner::Body(other) => (2, other),
            };
            (contact.grain, kind, other)
        });
        let held = simulation.held(|_| true);
        for (seen, held) in self.snapshot.grains.iter_mut().zip(held) {
            (seen.velocity, seen.spin) = (held.velocity, held.spin);
        }
    }

    pub(super) fn sample(&mut self, lapse: f64) {
        let sight = Sight {
            snapshot: &self.snapshot,
            edge: &self.edge,
            strip: &self.strip,
            continuum: self.continuum.velocities(),
        };
        self.averages.sample(&sight, lapse);
    }

    pub(super) fn step_continuum(&mut self, dt: f64) -> Result<(), OverlapError> {
        let (averages, given, strip) = (&self.averages, &self.given, &self.strip);
        let (area, weight) = (self.edge.area(), dt * self.gravity_along());
        let cell_mass = area * self.continuum.cell_mass();
        self.continuum.step(
            dt,
            |f| averages.faces[f].shear,
            |k| {
                let of_node = averages.nodes.get(k).map_or(0.0, |node| {
                    // The stress that the copy is given bears the grains' weight, so that is what it weighs.
                    weight * (node.mass - cell_mass) - given.relaxation[k]
                });
                (couple(given, strip, k) + of_node) / area
            },
            averages.faces[0].pressure,
        )?;
        Ok(())
    }

    fn gravity_along(&self) -> f64 {
        self.snapshot.gravity[self.edge.flow_axis]
    }

    /// Books what the grains' kicks and the continuum's step have done.
    fn book(&mut self, dt: f64) {
        let (area, gravity) = (self.edge.area(), self.gravity_along());
        let (ledger, given) = (&mut self.ledger, &self.given);
        ledger.shear += given.shear;
        ledger.pressure += given.pressure;
        ledger.impedance += given.impedance;
        ledger.relaxation += given.relaxation.iter().sum::<f64>();
        ledger.spin += given.spin.iter().sum::<f64>();
        let cells = self.continuum.cells();
        let beyond = (cells - self.strip.nodes()) as f64;
        let copy: f64 = self.averages.nodes.iter().map(|node| node.mass).sum();
        let mass = copy + beyond * area * self.continuum.cell_mass();
        ledger.continuum_weight += dt * mass * gravity;
        ledger.inner_stress -= dt * area * self.averages.faces[0].shear;
        ledger.far_stress += dt * area * self.continuum.shear_stress(cells);
    }

    /// The copy in the inner overlap follows the grains.
    fn follow(&mut self, dt: f64) {
        let part = (dt / self.settings.following_time).min(1.0);
        let mass = self.edge.area() * self.continuum.cell_mass();
        for k in 0..self.strip.inner {
            let change = -part * self.averages.nodes[k].slip();
            let velocity = self.continuum.velocities()[k];
            self.continuum.set_velocity(k, velocity + change);
            self.ledger.following += mass * change;
        }
    }

    /// Takes the continuum's traction, and forms the accelerations that bring mean velocities and spins together.
    pub(super) fn agree(&mut self, simulation: &Simulation) {
        let dt = self.exchange_time(simulation);
        let edge_face = self.strip.nodes();
        self.held.shear = self.continuum.shear_stress(edge_face);
        self.held.pressure = self.continuum.pressure(edge_face);
        let towards = |time: f64| (dt / time).min(1.0) / dt;
        let (rate, turn) = (
            towards(self.settings.relaxation_time),
            towards(self.settings.spin_time),
        );
        let velocities = self.continuum.velocities();
        for k in self.strip.inner..self.strip.nodes() {
            let node = &self.averages.nodes[k];
            self.held.accelerations[k] = rate * node.slip();
            // (∇ × u)·(n × t) = ∂u/∂n, by central difference of the cells beside.
            let vorticity = (velocities[k + 1] - velocities[k - 1]) / (2.0 * self.strip.cell);
            self.held.spins[k] = turn * (0.5 * vorticity - node.mean_spin());
        }
    }
}

/// Impulse (N s) into a cell along the flow of the couples that turned the grains' spins: the continuum takes the
/// opposite couple per volume c as a force ½ ∇ × c, which is −½ ∂c/∂n along t and has no sum.
fn couple(given: &Given, strip: &Strip, cell: usize) -> f64 {
    let of = |k: usize| given.spin.get(k).copied().unwrap_or(0.0);
    let below = if cell > 0 { of(cell - 1) } else { 0.0 };
    // c = −spin impulse / volume; faces have the mean of the cells beside them.
    0.5 * (0.5 * (of(cell) + of(cell + 1)) - 0.5 * (below + of(cell))) / strip.cell
}
