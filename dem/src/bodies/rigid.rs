//! A body during a run: where it is, how it moves, what it carries.

use super::{Body, Freedom, MassProperties, top};
use crate::setup::SetupError;
use crate::walls::{Carrier, Pose, Standing, WallImpulse, WallLoad};
use nalgebra::{Matrix3, UnitQuaternion, UnitVector3, Vector3};
use std::ops::Range;

/// A body and its state.
///
/// It turns about its *pivot*: the centre of mass of a free body, the hinge's point of a hinged one, the own
/// origin of a driven one. Its *frame* are the principal axes of a free body and the own axes of others.
#[derive(Clone, Debug)]
pub(crate) struct Rigid {
    pub body: Body,
    pub mass: MassProperties,
    /// Inverse principal moments of inertia of a free body (1/(kg m²)).
    inverse: Vector3<f64>,
    /// 1/I about the axis of a hinged body (1/(kg m²)).
    inverse_turning: f64,
    /// Turns the frame into the body's own axes.
    frame: UnitQuaternion<f64>,
    /// The body's own origin and its centre of mass, from the pivot in the frame (m).
    origin: Vector3<f64>,
    centre: Vector3<f64>,
    /// Its parts among the walls, and where they sit in the frame.
    pub parts: Range<usize>,
    fixtures: Vec<Pose>,
    /// Orientation of the frame at the start.
    start: UnitQuaternion<f64>,
    /// Pivot (m) and frame.
    pub place: Vector3<f64>,
    pub orientation: UnitQuaternion<f64>,
    /// Velocity of the pivot half a step back (m/s); of a driven body the mean of the last step.
    pub velocity: Vector3<f64>,
    /// Angular momentum about the centre half a step back (kg m²/s), of a free body.
    pub momentum: Vector3<f64>,
    /// Angular velocity (rad/s) with the orientation of now and the angular momentum of then.
    pub spin: Vector3<f64>,
    /// Angle (rad) and rate (rad/s) of a hinged body.
    pub angle: f64,
    pub rate: f64,
    /// Force of contacts, and their torque about the pivot.
    pub load: WallLoad,
    /// Steady force at the centre of mass (N) and moment (N m) from outside.
    pub given: [Vector3<f64>; 2],
    /// Acceleration (m/s²) and potential (m²/s²) at the centre by fields that differ from place to place.
    pub field: (Vector3<f64>, f64),
    /// What contacts have given since it was last asked to forget, about the pivot.
    pub impulse: WallImpulse,
}

/// How a body moves at an instant: velocity of its pivot and angular velocity.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Twist {
    pub velocity: Vector3<f64>,
    pub spin: Vector3<f64>,
}

impl Twist {
    /// Velocity at an arm from the pivot (m/s).
    #[inline(always)]
    pub fn at(&self, arm: &Vector3<f64>) -> Vector3<f64> {
        self.velocity + self.spin.cross(arm)
    }

    /// Power of a force and a torque about the pivot (W).
    pub fn power(&self, force: &Vector3<f64>, torque: &Vector3<f64>) -> f64 {
        force.dot(&self.velocity) + torque.dot(&self.spin)
    }
}

impl Rigid {
    /// A body at its start; its parts will be walls from this number on.
    pub fn new(body: Body, first: usize, timestep: f64, key: &str) -> Result<Rigid, SetupError> {
        let driven = matches!(body.freedom, Freedom::Driven(_));
        let mass = match body.mass_properties(key) {
            Ok(mass) => mass,
            // A body that moves as it is told needs none.
            Err(_) if driven => MassProperties::default(),
            Err(error) => return Err(error),
        };
        let own = body.pose;
        let centre = own.position + own.orientation * mass.centre;
        let (mut frame, mut inverse) = (UnitQuaternion::identity(), Vector3::zeros());
        let mut inverse_turning = 0.0;
        let place = match &body.freedom {
            Freedom::Free => {
                let moments;
                (frame, moments) = mass.principal();
                inverse = moments.map(f64::recip);
                centre
            }
            Freedom::Hinged(hinge) => {
                let axis = own.orientation.inverse_transform_vector(&hinge.axis);
                let arm = (centre - hinge.point).cross(&hinge.axis);
                let about = axis.dot(&(mass.inertia * axis)) + mass.mass * arm.norm_squared();
                inverse_turning = 1.0 / about;
                hinge.point
            }
            Freedom::Driven(_) => own.position,
        };
        let start = own.orientation * frame;
        let inward = |point: Vector3<f64>| start.inverse_transform_vector(&(point - place));
        let fixtures = body.parts.iter().map(|part| {
            let core = super::rounded::core(part);
            let at = part.pose.position + part.pose.orientation * core.origin;
            Pose {
                position: inward(own.position + own.orientation * at),
                orientation: frame.inverse() * part.pose.orientation,
            }
        });
        let mut rigid = Rigid {
            mass,
            inverse,
            inverse_turning,
            frame,
            origin: inward(own.position),
            centre: inward(centre),
            parts: first..first + body.parts.len(),
            fixtures: fixtures.collect(),
            start,
            place,
            orientation: start,
            velocity: body.velocity,
            momentum: Vector3::zeros(),
            spin: body.spin,
            angle: 0.0,
            rate: 0.0,
            load: WallLoad::default(),
            given: [Vector3::zeros(); 2],
            field: (Vector3::zeros(), 0.0),
            impulse: WallImpulse::default(),
            body,
        };
        rigid.set_spin(rigid.body.spin);
        if let Freedom::Driven(motion) = &rigid.body.freedom {
            [rigid.velocity, rigid.spin] = motion.velocity(&rigid.body.pose, -timestep, 0.0);
        }
        Ok(rigid)
    }

    /// Whether forces move it freely: its momentum counts.
    pub fn is_free(&self) -> bool {
        matches!(self.body.freedom, Freedom::Free)
    }

    /// Whether it moves as it is told.
    pub fn is_driven(&self) -> bool {
        matches!(self.body.freedom, Freedom::Driven(_))
    }

    /// Mass that gravity and forces move freely (kg).
    pub fn free_mass(&self) -> f64 {
        if self.is_free() { self.mass.mass } else { 0.0 }
    }

    /// From the pivot to the centre of mass (m).
    pub fn arm(&self) -> Vector3<f64> {
        self.orientation * self.centre
    }

    /// Where the body's own axes are.
    pub fn pose(&self) -> Pose {
        Pose {
            position: self.place + self.orientation * self.origin,
            orientation: self.orientation * self.frame.inverse(),
        }
    }

    /// Where a part's shape is.
    pub fn part_pose(&self, part: usize) -> Pose {
        let fixture = &self.fixtures[part - self.parts.start];
        Pose {
            position: self.place + self.orientation * fixture.position,
            orientation: self.orientation * fixture.orientation,
        }
    }

    /// What a part knows of the body.
    pub fn carrier(&self, part: usize, body: u32, curvature: f64) -> Carrier {
        let turn = self.orientation.to_rotation_matrix();
        let inverse_inertia = match &self.body.freedom {
            Freedom::Free => turn * Matrix3::from_diagonal(&self.inverse) * turn.transpose(),
            Freedom::Hinged(hinge) => hinge.axis * hinge.axis.transpose() * self.inverse_turning,
            Freedom::Driven(_) => Matrix3::zeros(),
        };
        Carrier {
            body,
            offset: self.part_pose(part).position - self.place,
            inverse_mass: if self.is_free() {
                1.0 / self.mass.mass
            } else {
                0.0
            },
            inverse_inertia,
            curvature,
        }
    }

    /// 1/m that a push on a part, whose feelers reach this far, may feel at the most (1/kg).
    pub fn largest_inverse_mass(&self, part: &Standing, reach: f64) -> f64 {
        let offset = part.carrier.map_or(Vector3::zeros(), |c| c.offset);
        let extent = part.wall.shape.extent() + part.rounding;
        let far = offset.norm() + extent.min(2.0 * reach);
        let free = if self.is_free() {
            1.0 / self.mass.mass
        } else {
            0.0
        };
        free + far * far * self.inverse.max().max(self.inverse_turning)
    }

    pub fn twist(&self) -> Twist {
        Twist {
            velocity: self.velocity,
            spin: self.spin,
        }
    }

    /// Sets the angular velocity (rad/s) and what follows from it.
    pub fn set_spin(&mut self, spin: Vector3<f64>) {
        match &self.body.freedom {
            Freedom::Free => {
                let own = self.orientation.inverse_transform_vector(&spin);
                self.momentum = self.orientation * own.component_div(&self.inverse);
                self.spin = spin;
            }
            Freedom::Hinged(hinge) => {
                self.rate = spin.dot(&hinge.axis);
                self.spin = hinge.axis * self.rate;
            }
            Freedom::Driven(_) => {}
        }
    }

    /// Force and torque about the pivot, of contacts, gravity, fields and loads.
    pub fn wrench(&self, gravity: &Vector3<f64>) -> [Vector3<f64>; 2] {
        let [force, moment] = &self.given;
        let body = force + self.mass.mass * (gravity + self.field.0);
        [
            self.load.force + body,
            self.load.torque + moment + self.arm().cross(&body),
        ]
    }

    /// The motion after a kick of a length (s) by forces of this instant; a driven body's is not kicked.
    pub fn kicked(&self, kick: f64, gravity: &Vector3<f64>) -> Twist {
        let [force, torque] = self.wrench(gravity);
        match &self.body.freedom {
            Freedom::Free => Twist {
                velocity: self.velocity + force * (kick / self.mass.mass),
                spin: self.spin_of(&(self.momentum + kick * torque)),
            },
            Freedom::Hinged(hinge) => {
                let rate = self.rate + kick * self.inverse_turning * torque.dot(&hinge.axis);
                Twist {
                    velocity: Vector3::zeros(),
                    spin: hinge.axis * rate,
                }
            }
            Freedom::Driven(_) => self.twist(),
        }
    }

    /// The mean of the motions before and after a kick; of a driven body, of the last step and the next, which
    /// ends at a time.
    pub fn mean(&self, kick: f64, gravity: &Vector3<f64>, next: [f64; 2]) -> Twist {
        if let Freedom::Driven(motion) = &self.body.freedom {
            let [velocity, spin] = motion.velocity(&self.body.pose, next[0], next[1]);
            return Twist {
                velocity: 0.5 * (self.velocity + velocity),
                spin: 0.5 * (self.spin + spin),
            };
        }
        self.kicked(0.5 * kick, gravity)
    }

    /// Takes its motion back by a kick of this length (s).
    pub fn take_back(&mut self, kick: f64, force: &Vector3<f64>, torque: &Vector3<f64>) {
        match &self.body.freedom {
            Freedom::Free => {
                self.velocity -= force * (kick / self.mass.mass);
                self.momentum -= kick * torque;
                self.spin = self.spin_of(&self.momentum);
            }
            Freedom::Hinged(hinge) => {
                self.rate -= kick * self.inverse_turning * torque.dot(&hinge.axis);
                self.spin = hinge.axis * self.rate;
            }
            Freedom::Driven(_) => {}
        }
    }

    /// Kicks and moves it; a driven body goes to where it should be at `next`, the times at which the step
    /// begins and ends (s).
    pub fn step(&mut self, kick: f64, gravity: &Vector3<f64>, next: [f64; 2]) {
        let dt = next[1] - next[0];
        let [force, torque] = self.wrench(gravity);
        match &self.body.freedom {
            Freedom::Free => {
                self.velocity += force * (kick / self.mass.mass);
                self.momentum += kick * torque;
            }
            Freedom::Hinged(hinge) => {
                self.rate += kick * self.inverse_turning * torque.dot(&hinge.axis);
            }
            Freedom::Driven(_) => {}
        }
        self.drift(dt, next);
    }

    fn drift(&mut self, dt: f64, next: [f64; 2]) {
        match &self.body.freedom {
            Freedom::Free => {
                self.place += dt * self.velocity;
                self.orientation = top::turn(&self.orientation, &self.momentum, &self.inverse, dt);
                self.spin = self.spin_of(&self.momentum);
            }
            Freedom::Hinged(hinge) => {
                self.angle += dt * self.rate;
                let axis = UnitVector3::new_unchecked(hinge.axis);
                self.orientation = UnitQuaternion::from_axis_angle(&axis, self.angle) * self.start;
                self.spin = hinge.axis * self.rate;
            }
            Freedom::Driven(motion) => {
                let pose = motion.pose(&self.body.pose, next[1], 0.0);
                (self.place, self.orientation) = (pose.position, pose.orientation);
                [self.velocity, self.spin] = motion.velocity(&self.body.pose, next[0], next[1]);
            }
        }
    }

    fn spin_of(&self, momentum: &Vector3<f64>) -> Vector3<f64> {
        top::spin(&self.orientation, momentum, &self.inverse)
    }

    /// Puts it where a checkpoint has it, at a time (s) after a step.
    pub fn restore(&mut self, state: &State, step: [f64; 2]) {
        let [x, y, z, w, i, j, k, u, v, t, a, b, c, angle, rate, ..] = *state;
        self.place = Vector3::new(x, y, z);
        self.orientation = UnitQuaternion::new_unchecked(nalgebra::Quaternion::new(w, i, j, k));
        self.velocity = Vector3::new(u, v, t);
        self.momentum = Vector3::new(a, b, c);
        (self.angle, self.rate) = (angle, rate);
        let [.., fx, fy, fz, mx, my, mz] = *state;
        self.given = [Vector3::new(fx, fy, fz), Vector3::new(mx, my, mz)];
        match &self.body.freedom {
            Freedom::Free => self.spin = self.spin_of(&self.momentum),
            Freedom::Hinged(hinge) => self.spin = hinge.axis * rate,
            Freedom::Driven(motion) => {
                self.spin = motion.velocity(&self.body.pose, step[0], step[1])[1];
            }
        }
    }

    /// All numbers of its state.
    pub fn state(&self) -> State {
        let (x, v, l) = (&self.place, &self.velocity, &self.momentum);
        let q = self.orientation.quaternion();
        let [f, m] = &self.given;
        [
            x.x, x.y, x.z, q.w, q.i, q.j, q.k, v.x, v.y, v.z, l.x, l.y, l.z, self.angle, self.rate,
            f.x, f.y, f.z, m.x, m.y, m.z,
        ]
    }

    /// Kinetic energy of a motion (J), of translation and of rotation; driven bodies have none.
    pub fn kinetic(&self, twist: &Twist) -> [f64; 2] {
        match &self.body.freedom {
            Freedom::Free => {
                let own = self.orientation.inverse_transform_vector(&twist.spin);
                let turning = own.component_mul(&own).component_div(&self.inverse).sum();
                [
                    0.5 * self.mass.mass * twist.velocity.norm_squared(),
                    0.5 * turning,
                ]
            }
            Freedom::Hinged(_) => [0.0, 0.5 * twist.spin.norm_squared() / self.inverse_turning],
            Freedom::Driven(_) => [0.0; 2],
        }
    }
}

/// Numbers of a body in a checkpoint.
pub(crate) type State = [f64; 21];

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bodies::Part;

    const HALF: Vector3<f64> = Vector3::new(0.145, 0.1375, 0.0975);
    const STIFFNESS: f64 = 1e6;

    /// Overlaps of the corners of a cuboid with the plane z = 0, and their arms.
    fn corners(body: &Rigid) -> Vec<(f64, Vector3<f64>)> {
        let signs = |k: usize| Vector3::from_fn(|a, _| if k >> a & 1 == 1 { 1.0 } else { -1.0 });
        let arm = |k: usize| body.orientation * signs(k).component_mul(&HALF);
        let all = (0..8).map(arm).map(|arm| (-(body.place.z + arm.z), arm));
        all.filter(|(overlap, _)| *overlap > 0.0).collect()
    }

    /// Each corner has a spring of its own.
    fn by_corners(body: &Rigid) -> WallLoad {
        let mut load = WallLoad::default();
        for (overlap, arm) in corners(body) {
            let force = Vector3::z() * STIFFNESS * overlap;
            load.force += force;
            load.torque += arm.cross(&force);
        }
        load
    }

    /// One spring for the deepest overlap, at the mean of the corners that touch: a force that looks as
    /// good and is the gradient of nothing.
    fn by_their_mean(body: &Rigid) -> WallLoad {
        let corners = corners(body);
        let deepest = corners.iter().map(|c| c.0).fold(0.0, f64::max);
        let arms: Vector3<f64> = corners.iter().map(|c| c.1).sum();
        let force = Vector3::z() * STIFFNESS * deepest;
        WallLoad {
            force,
            torque: (arms / corners.len().max(1) as f64).cross(&force),
        }
    }

    /// Largest relative change of energy over impacts that come down nearly flat.
    fn largest_change(contact: impl Fn(&Rigid) -> WallLoad) -> f64 {
        let changes = (0..20).map(|k| {
            let tilt = Vector3::new(0.02, -0.013, 0.3) * (f64::from(k) - 9.7) * 0.1;
            let height = Vector3::z() * (HALF.z + 0.006);
            let body = Body::new(vec![Part::cuboid(HALF, 650.0)])
                .at(height)
                .turned(UnitQuaternion::from_scaled_axis(tilt))
                .moving(-Vector3::z(), Vector3::new(0.3, 0.2, -0.1));
            let mut body = Rigid::new(body, 0, 1e-6, "body").unwrap();
            let energy = |b: &Rigid| b.kinetic(&b.twist()).iter().sum::<f64>();
            let before = energy(&body);
            for _ in 0..40_000 {
                body.load = contact(&body);
                body.step(1e-6, &Vector3::zeros(), [0.0, 1e-6]);
            }
            assert!(corners(&body).is_empty() && body.velocity.z > 0.0);
            energy(&body) / before - 1.0
        });
        changes.fold(0.0, |largest: f64, change| largest.max(change))
    }

    #[test]
    fn a_contact_that_is_no_gradient_creates_energy() {
        let (good, naive) = (largest_change(by_corners), largest_change(by_their_mean));
        assert!(good < 1e-6, "{good:e}");
        assert!(naive > 1e-2, "{naive:e}");
    }
}
