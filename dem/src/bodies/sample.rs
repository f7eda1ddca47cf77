//! What is seen of bodies from outside, and what may be done to them.

use super::rigid::Rigid;
use super::{Body, MassProperties};
use crate::setup::{SetupError, check};
use crate::simulation::Simulation;
use crate::walls::{Pose, WallImpulse, WallLoad};
use nalgebra::Vector3;

/// A body at one instant; velocities belong to the same time as the pose.
#[derive(Clone, Copy, Debug)]
pub struct BodySample {
    /// Where its own axes are.
    pub pose: Pose,
    /// Centre of mass (m).
    pub centre: Vector3<f64>,
    /// Velocity of the centre of mass (m/s).
    pub velocity: Vector3<f64>,
    /// Angular velocity (rad/s).
    pub spin: Vector3<f64>,
    /// Mass (kg).
    pub mass: f64,
    /// Angular momentum about the centre of mass (kg m²/s), of a free body.
    pub angular_momentum: Vector3<f64>,
    /// Force of all contacts (N).
    pub force: Vector3<f64>,
    /// Their torque about the centre of mass (N m).
    pub torque: Vector3<f64>,
    /// Kinetic energy of the centre of mass and of the rotation about it (J); of a hinged body all of it is
    /// rotation about the hinge, a driven one has none.
    pub kinetic: [f64; 2],
}

/// What a body touches.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Touched {
    /// A wall, by its number.
    Wall(usize),
    /// Another body, by its number.
    Body(usize),
}

/// A contact of a body with a wall or with another body at one instant; those with grains are among the
/// grains' contacts.
#[derive(Clone, Copy, Debug)]
pub struct BodyContactSample {
    /// Number of the body that the force acts on.
    pub body: usize,
    /// The other side; it feels the opposite force.
    pub partner: Touched,
    /// Where (m).
    pub point: Vector3<f64>,
    /// Unit normal towards the body.
    pub normal: Vector3<f64>,
    /// Overlap (m).
    pub overlap: f64,
    /// Force on the body (N).
    pub force: Vector3<f64>,
}

/// A steady force and moment on a body, from outside.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BodyLoad {
    /// Number of the body.
    pub body: usize,
    /// Force at the centre of mass (N).
    pub force: Vector3<f64>,
    /// Moment (N m).
    pub moment: Vector3<f64>,
}

impl Simulation {
    /// Number of bodies.
    pub fn body_count(&self) -> usize {
        self.bodies.rigid.len()
    }

    /// A body as it was set up.
    pub fn body_setup(&self, body: usize) -> &Body {
        &self.bodies.rigid[body].body
    }

    /// Mass properties of a body in its own axes.
    pub fn body_mass(&self, body: usize) -> MassProperties {
        self.bodies.rigid[body].mass
    }

    /// A body at this instant.
    pub fn body(&mut self, body: usize) -> BodySample {
        self.observe();
        self.body_sample(&self.bodies.rigid[body])
    }

    fn body_sample(&self, body: &Rigid) -> BodySample {
        let twist = body.kicked(self.half_step(), &self.gravity);
        let arm = body.arm();
        let angular_momentum = if body.is_free() {
            let [_, torque] = body.wrench(&self.gravity);
            body.momentum + self.half_step() * torque
        } else {
            Vector3::zeros()
        };
        BodySample {
            pose: body.pose(),
            centre: body.place + arm,
            velocity: twist.at(&arm),
            spin: twist.spin,
            mass: body.mass.mass,
            angular_momentum,
            force: body.load.force,
            torque: body.load.torque - arm.cross(&body.load.force),
            kinetic: body.kinetic(&twist),
        }
    }

    /// All bodies and their contacts, into buffers that are reused.
    pub(crate) fn body_samples(
        &self,
        bodies: &mut Vec<BodySample>,
        contacts: &mut Vec<BodyContactSample>,
    ) {
        bodies.clear();
        bodies.extend(self.bodies.rigid.iter().map(|body| self.body_sample(body)));
        contacts.clear();
        for contact in &self.bodies.contacts {
            let sides = self.bodies.encounters[contact.encounter as usize];
            let [a, b] = [sides.prober, sides.target].map(|k| k as usize);
            // Seen from the side that is a body, from the one that feels if both are.
            let own = self.walls[a].carrier.map(|c| (c.body as usize, b, 1.0));
            let other = self.walls[b].carrier.map(|c| (c.body as usize, a, -1.0));
            let Some((body, partner, sign)) = own.or(other) else {
                continue;
            };
            let arm = contact.arms[usize::from(sign < 0.0)];
            contacts.push(BodyContactSample {
                body,
                partner: self.touched(partner),
                point: self.bodies.rigid[body].place + arm,
                normal: sign * Vector3::from(contact.normal),
                overlap: contact.overlap,
                force: sign * contact.force,
            });
        }
    }

    /// Which wall or body a number of the walls' list is.
    pub(crate) fn touched(&self, wall: usize) -> Touched {
        match &self.walls[wall].carrier {
            Some(carrier) => Touched::Body(carrier.body as usize),
            None => Touched::Wall(wall),
        }
    }

    /// What contacts have given a body since the start, or since [`Simulation::forget_body_taken`]: the
    /// torque is about the centre of mass of a free body, the hinge's point of a hinged one, and the own
    /// origin of a driven one.
    pub fn body_taken(&self, body: usize) -> WallImpulse {
        self.bodies.rigid[body].impulse
    }

    /// Starts a new interval of [`Simulation::body_taken`] for a body.
    pub fn forget_body_taken(&mut self, body: usize) {
        self.bodies.rigid[body].impulse = WallImpulse::default();
    }

    /// Force and torque about the centre of mass of all contacts of a body at this instant.
    pub fn body_load(&mut self, body: usize) -> WallLoad {
        let sample = self.body(body);
        WallLoad {
            force: sample.force,
            torque: sample.torque,
        }
    }

    /// Gives a body a velocity of its centre of mass (m/s; of free bodies) and an angular velocity (rad/s)
    /// at this instant.
    ///
    /// # Errors
    /// If there is no such body, it is driven, or a number is not finite. Nothing has changed then.
    pub fn launch(
        &mut self,
        body: usize,
        velocity: Vector3<f64>,
        spin: Vector3<f64>,
    ) -> Result<(), SetupError> {
        self.check_body(body)?;
        for (name, vector) in [("velocity", &velocity), ("spin", &spin)] {
            for c in vector.iter() {
                check(&format!("launch.{name}"), *c, "finite", |_| true)?;
            }
        }
        self.observe();
        let (half, gravity) = (self.half_step(), self.gravity);
        let before = self.body_momentum().0;
        let one = &mut self.bodies.rigid[body];
        if one.is_free() {
            one.velocity = velocity;
        }
        one.set_spin(spin);
        // Velocities live half a step back.
        let [force, torque] = one.wrench(&gravity);
        one.take_back(half, &force, &torque);
        self.account += self.body_momentum().0 - before;
        self.forget_observation();
        self.bodies.place(&mut self.walls);
        if self.ledger.is_some() {
            self.open_energy_ledger();
        }
        Ok(())
    }

    /// Puts steady loads on bodies, in place of those there were; they act from now on. A load on a driven
    /// body does nothing.
    ///
    /// # Errors
    /// If a body is not there or a number is not finite. Nothing has changed then.
    pub fn set_body_loads(&mut self, loads: &[BodyLoad]) -> Result<(), SetupError> {
        for (k, load) in loads.iter().enumerate() {
            self.check_body(load.body)?;
            for (name, vector) in [("force", &load.force), ("moment", &load.moment)] {
                for c in vector.iter() {
                    check(&format!("body_loads[{k}].{name}"), *c, "finite", |_| true)?;
                }
            }
        }
        self.forget_observation();
        for body in &mut self.bodies.rigid {
            body.given = [Vector3::zeros(); 2];
        }
        for load in loads {
            let [force, moment] = &mut self.bodies.rigid[load.body].given;
            *force += load.force;
            *moment += load.moment;
        }
        Ok(())
    }

    fn check_body(&self, body: usize) -> Result<(), SetupError> {
        let count = self.bodies.rigid.len();
        let word = "the number of a body of the setup, from 0";
        check("body", body as f64, word, |_| body < count)
    }
}
