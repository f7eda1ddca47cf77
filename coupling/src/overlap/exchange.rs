//! The steps: grains under what is held, and the exchange that follows so many of them.

use super::angular::AngularBook;
use super::averages::Sight;
use super::edge::ZoneEdge;
use super::joint::towards;
use super::settings::NormalMotion;
use super::shell::Given;
use super::strip::Strip;
use super::{Ledger, Overlap, OverlapError};
use colluvium_continuum::rheology::ShearLaw;
use colluvium_dem::Simulation;

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
        let mut left = steps;
        while left > 0 {
            let of_loads = self.made % self.steps_of_loads;
            if of_loads == 0 {
                if std::mem::take(&mut self.opens_angular) {
                    self.angular = Some(AngularBook::open(simulation));
                }
                self.shell.lay(
                    simulation,
                    (&self.edge, &self.strip),
                    (self.settings.impedance, self.normal_velocity),
                    &self.held,
                    self.angular.as_mut(),
                )?;
            }
            let part = left.min(self.steps_of_loads - of_loads);
            self.step_grains(simulation, part)?;
            left -= part;
            self.made += part;
            if self.made == self.steps {
                self.exchange(simulation)?;
                self.made = 0;
            }
        }
        Ok(())
    }

    /// Steps of the grains under what is laid. Books are kept step by step, so that pieces give the same bits.
    fn step_grains(&mut self, simulation: &mut Simulation, steps: u64) -> Result<(), OverlapError> {
        let gravity = simulation.gravity();
        let n = self.edge.normal(&gravity);
        let weight = [gravity[self.edge.flow_axis], gravity.dot(&n)].map(|g| self.grain_mass * g);
        let timestep = simulation.timestep();
        let mut kick = simulation.next_kick();
        match &mut self.angular {
            None => simulation.advance(steps)?,
            Some(book) => {
                for _ in 0..steps {
                    book.see(simulation);
                    simulation.advance(1)?;
                }
            }
        }
        for _ in 0..steps {
            self.given.add(&self.shell.laid, kick);
            self.shell.acted += kick;
            for (sum, weight) in self.ledger.weight.iter_mut().zip(weight) {
                *sum += kick * weight;
            }
            if self.settings.normal_motion == NormalMotion::Riding {
                let taken = -self.shell.laid.impedance * kick;
                self.normal_velocity += taken / self.mass_beyond;
                self.ledger.riding += taken;
                self.edge.shift(self.normal_velocity * timestep);
            }
            kick = timestep;
        }
        Ok(())
    }

    /// Averages of the grains to the continuum, its step, and what it does to the grains until the next exchange.
    fn exchange(&mut self, simulation: &mut Simulation) -> Result<(), OverlapError> {
        let dt = self.exchange_time(simulation);
        self.sighting.look(simulation);
        self.sample(dt / self.settings.stress_time);
        self.step_continuum(dt)?;
        self.book(dt);
        self.follow(dt);
        // The slips that the next exchange acts on are those against the continuum as it now is.
        self.sample(0.0);
        self.agree(simulation);
        let area = self.edge.area();
        let (edge, cell) = (&self.edge, self.strip.cell);
        let grains = self.sighting.snapshot.grains.iter();
        let escaped = grains.filter(|g| !g.fixed && edge.distance(&g.position) > cell);
        self.monitors.take(
            &self.averages,
            &self.continuum,
            (&self.strip, area),
            &self.given,
            escaped.count(),
            dt,
        );
        self.given.clear();
        Ok(())
    }

    pub(super) fn sample(&mut self, lapse: f64) {
        let sight = Sight {
            snapshot: &self.sighting.snapshot,
            edge: &self.edge,
            strip: &self.strip,
            continuum: self.continuum.velocities(),
        };
        self.averages.sample(&sight, lapse);
    }

    pub(super) fn step_continuum(&mut self, dt: f64) -> Result<(), OverlapError> {
        let (averages, given, strip) = (&self.averages, &self.given, &self.strip);
        let area = self.edge.area();
        let weight = match self.settings.uncoupled {
            true => 0.0,
            false => dt * self.gravity_along(),
        };
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
        self.sighting.snapshot.gravity[self.edge.flow_axis]
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
        let cell = area * self.continuum.cell_mass();
        let copy = match self.settings.uncoupled {
            true => self.strip.nodes() as f64 * cell,
            false => self.averages.nodes.iter().map(|node| node.mass).sum(),
        };
        ledger.continuum_weight += dt * (copy + beyond * cell) * gravity;
        if !self.settings.uncoupled {
            ledger.inner_stress -= dt * area * self.averages.faces[0].shear;
        }
        ledger.far_stress += dt * area * self.continuum.shear_stress(cells);
    }

    /// The copy in the inner overlap follows the grains.
    fn follow(&mut self, dt: f64) {
        if self.settings.uncoupled {
            return;
        }
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
        if self.settings.uncoupled {
            return;
        }
        let dt = self.exchange_time(simulation);
        let edge_face = self.strip.nodes();
        self.held.shear = self.continuum.shear_stress(edge_face);
        self.held.pressure = self.continuum.pressure(edge_face);
        let (rate, turn) = (
            towards(dt, self.settings.relaxation_time),
            towards(dt, self.settings.spin_time),
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
