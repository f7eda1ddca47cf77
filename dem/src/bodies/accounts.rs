//! Bodies in the step, in the accounts of momentum and in the energy ledger.

use super::Freedom;
use super::contacts::twist_of;
use super::rigid::Twist;
use crate::energy::Energy;
use crate::ledger::{Channels, EnergyLedger};
use crate::simulation::Simulation;
use crate::walls::Standing;
use nalgebra::Vector3;

impl Simulation {
    /// Brings the fields at the bodies to their present places and sums what acts from outside.
    pub(crate) fn lay_body_loads(&mut self) {
        let mut external = Vector3::zeros();
        for body in &mut self.bodies.rigid {
            let centre = body.place + body.arm();
            body.field = self.fields.at(&centre);
            if body.is_free() {
                external += body.given[0] + body.mass.mass * body.field.0;
            }
        }
        self.bodies.external = external;
    }

    /// Kicks and moves all bodies, and their parts with them.
    pub(crate) fn step_bodies(&mut self, kick: f64) {
        let next = self.next_step();
        for body in &mut self.bodies.rigid {
            body.impulse.take(&body.load, kick);
            if !body.is_free() {
                for (sum, force) in self.impulse.iter_mut().zip(body.load.force.iter()) {
                    *sum += kick * force;
                }
            }
            body.step(kick, &self.gravity, next);
        }
        self.bodies.place(&mut self.walls);
        self.account += kick * self.bodies.external;
    }

    /// When the next step begins and ends (s).
    pub(crate) fn next_step(&self) -> [f64; 2] {
        [self.steps, self.steps + 1].map(|n| n as f64 * self.timestep)
    }

    /// Brings velocities of bodies to the time of their places; forces are those of now.
    pub(crate) fn synchronise_bodies(&mut self) {
        let half = self.half_step();
        for body in &mut self.bodies.rigid {
            let twist = body.kicked(half, &self.gravity);
            if !body.is_driven() {
                body.velocity = twist.velocity;
                body.set_spin(twist.spin);
            }
        }
    }

    /// How far velocities lag behind places (s).
    pub(crate) fn half_step(&self) -> f64 {
        if self.steps_since_start > 0 {
            0.5 * self.timestep
        } else {
            0.0
        }
    }

    /// Adds kinetic, elastic and potential energy of bodies; forces are those of now.
    pub(crate) fn add_body_energy(&self, energy: &mut Energy) {
        let half = self.half_step();
        for body in &self.bodies.rigid {
            let [translation, rotation] = body.kinetic(&body.kicked(half, &self.gravity));
            energy.translation += translation;
            energy.rotation += rotation;
        }
        energy.potential += self.body_potential();
        self.bodies.stored(&self.law, &self.walls, |stored| {
            energy.normal += stored.normal;
            energy.cohesion += stored.cohesion;
            energy.tangential += stored.tangential;
            energy.rolling += stored.rolling;
            energy.twisting += stored.twisting;
        });
    }

    /// Shows for each body that forces move its kinetic energy (J), the force that is left of all that acts on it
    /// (N; of a hinged one the torque about its hinge over the reach of its parts), twice that reach (m) and its
    /// mass (kg). Returns how many there are.
    pub(crate) fn each_body_at_rest(&self, mut see: impl FnMut([f64; 4])) -> usize {
        let half = self.half_step();
        let yielding = self.bodies.rigid.iter().filter(|body| !body.is_driven());
        let mut count = 0;
        for body in yielding {
            let [translation, rotation] = body.kinetic(&body.kicked(half, &self.gravity));
            let [force, torque] = body.wrench(&self.gravity);
            let reach = body.body.reach();
            let left = match &body.body.freedom {
                Freedom::Hinged(hinge) => torque.dot(&hinge.axis).abs() / reach,
                _ => force.norm(),
            };
            see([translation + rotation, left, 2.0 * reach, body.mass.mass]);
            count += 1;
        }
        count
    }

    /// Potential energy of bodies in fields that differ from place to place (J).
    pub(crate) fn body_potential(&self) -> f64 {
        let yielding = self.bodies.rigid.iter().filter(|body| !body.is_driven());
        yielding.map(|body| body.mass.mass * body.field.1).sum()
    }

    /// Momentum of free bodies (N s), as the integrator holds it, and the sum of its sizes.
    pub(crate) fn body_momentum(&self) -> (Vector3<f64>, f64) {
        let (mut sum, mut size) = (Vector3::zeros(), 0.0);
        for body in self.bodies.rigid.iter().filter(|body| body.is_free()) {
            let momentum = body.mass.mass * body.velocity;
            sum += momentum;
            size += momentum.norm();
        }
        (sum, size)
    }

    /// Momentum of free bodies at this instant (N s); forces are those of now.
    pub(crate) fn body_momentum_now(&self) -> Vector3<f64> {
        let half = self.half_step();
        let free = self.bodies.rigid.iter().filter(|body| body.is_free());
        free.map(|b| b.mass.mass * b.kicked(half, &self.gravity).velocity)
            .sum()
    }

    /// Angular momentum of free bodies about the origin, as the integrator holds it (N m s).
    pub(crate) fn body_angular_momentum(&self) -> Vector3<f64> {
        let free = self.bodies.rigid.iter().filter(|body| body.is_free());
        free.map(|b| b.mass.mass * b.place.cross(&b.velocity) + b.momentum)
            .sum()
    }

    /// The mean motion over a kick of a wall that moves or of a part's body.
    pub(crate) fn mean_twist(&self, wall: &Standing, kick: f64) -> Twist {
        if let Some(body) = self.bodies.of_part(wall) {
            return body.mean(kick, &self.gravity, self.next_step());
        }
        if !wall.moves() {
            return Twist::default();
        }
        let stride = wall.stride(crate::walls::Span::ending(self.steps + 1, self.timestep));
        let twist = twist_of(&self.bodies.rigid, wall);
        Twist {
            velocity: 0.5 * (twist.velocity + stride.velocity),
            spin: 0.5 * (twist.spin + stride.spin),
        }
    }

    /// Books gravity, fields and loads on bodies, and the contacts of bodies with walls and each other.
    pub(crate) fn book_bodies(&self, ledger: &mut EnergyLedger, kick: f64) {
        for body in self.bodies.rigid.iter().filter(|body| !body.is_driven()) {
            let twist = body.mean(kick.abs(), &self.gravity, self.next_step());
            let (velocity, mass) = (twist.at(&body.arm()), body.mass.mass);
            ledger.gravity += kick * mass * velocity.dot(&self.gravity);
            ledger.fields.work += kick * mass * velocity.dot(&body.field.0);
            let [force, moment] = &body.given;
            ledger.loads += kick * (force.dot(&velocity) + moment.dot(&twist.spin));
        }
        for contact in &self.bodies.contacts {
            let sides = self.bodies.encounters[contact.encounter as usize];
            let walls = [sides.prober, sides.target].map(|k| &self.walls[k as usize]);
            let [a, b] = walls.map(|wall| self.mean_twist(wall, kick.abs()));
            let relative = Twist {
                velocity: a.at(&contact.arms[0]) - b.at(&contact.arms[1]),
                spin: a.spin - b.spin,
            };
            book(&mut ledger.work, contact, &relative, kick);
            for (k, sign, twist) in [(0, 1.0, &a), (1, -1.0, &b)] {
                let told = self
                    .bodies
                    .of_part(walls[k])
                    .is_none_or(|body| body.is_driven());
                if told {
                    let torque = contact.arms[k].cross(&contact.force) + contact.moment;
                    ledger.drive -= kick * sign * twist.power(&contact.force, &torque);
                }
            }
        }
    }
}

/// Work of one contact on both sides, by the motion of one side against the other.
fn book(work: &mut Channels, contact: &super::contacts::BodyContact, relative: &Twist, kick: f64) {
    let (normal, force, moment) = (
        Vector3::from(contact.normal),
        &contact.force,
        &contact.moment,
    );
    let pressing = force.dot(&normal) * relative.velocity.dot(&normal);
    let twist = moment.dot(&normal) * relative.spin.dot(&normal);
    work.normal += kick * pressing;
    work.tangential += kick * (force.dot(&relative.velocity) - pressing);
    work.twisting += kick * twist;
    work.rolling += kick * (moment.dot(&relative.spin) - twist);
}
