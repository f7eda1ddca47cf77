//! Rigid bodies: shapes with a mass that forces move and turn.
//!
//! A [`Body`] is made of [`Part`]s, each a [`Solid`] at a pose of the body's own axes with a material of
//! the law table. It is free, hung on a [`Hinge`], or moves as it is told.
//!
//! ```text
//! M dV/dt = F + M g          V(n+1/2) = V(n-1/2) + dt (F/M + g)     X(n+1) = X(n) + dt V(n+1/2)
//! dL/dt = T                  L(n+1/2) = L(n-1/2) + dt T(n)          R(n+1) by the Euler top (`top.rs`)
//! ```
//! Momentum and angular momentum live in directions of space, half a step back like the velocities of
//! grains; a free flight leaves both as they are, bit for bit, and turns the body by a symplectic map of
//! sixth order.
//!
//! **Contacts.** Grains meet parts as they meet walls: the same shapes, the same laws, the same lists.
//! Bodies meet walls and each other by *feelers* (`feelers.rs`): small spheres that sit on corners, along
//! edges and round rims, rolled over the other side's surface. Each feeler asks the same question as a
//! grain, how far the surface is, so its elastic force is the gradient of a potential that is continuous in
//! both poses, and an elastic impact keeps energy whatever the shapes. Forces and torques are equal and
//! opposite at one point: momentum and angular momentum close to round-off.
//!
//! Edges are rounded for this: a part is its shape shrunk by [`Part::rounding`] and then rolled over by a
//! ball of that radius, so outer measures stay, corners become round. A mesh is not shrunk: its surface
//! lies the rounding outside of its triangles. Mass properties are those of the sharp shape.

mod accounts;
mod contacts;
mod encounters;
mod feelers;
mod lookout;
mod mass;
mod record;
mod rigid;
mod rounded;
mod sample;
mod step_limits;
mod top;

pub(crate) use contacts::Bodies;
pub use mass::MassProperties;
pub use sample::{BodyContactSample, BodyLoad, BodySample, Touched};
pub(crate) use step_limits::feeling_parts;
#[cfg(test)]
pub(crate) use top::turn;

use crate::domain::Domain;
use crate::setup::{SetupError, check, known_material};
use crate::walls::{Mesh, Motion, Pose, Seen, Turning};
use nalgebra::{UnitQuaternion, Vector3};
use std::sync::Arc;

/// A solid in its own coordinates (m).
#[derive(Clone, Debug, PartialEq)]
pub enum Solid {
    /// A ball about the origin.
    Sphere {
        /// Radius.
        radius: f64,
    },
    /// A cuboid about the origin.
    Cuboid {
        /// Half the lengths of its edges.
        half_sides: Vector3<f64>,
    },
    /// A cone, its stump, or a cylinder: from the origin along z.
    Frustum {
        /// Radii at the origin and at the other end.
        radii: [f64; 2],
        /// Distance of the ends.
        height: f64,
    },
    /// What a closed mesh encloses, or an open one as a plate.
    Mesh(Arc<Mesh>),
}

impl Solid {
    /// Distance of its farthest point from its origin (m).
    pub fn extent(&self) -> f64 {
        match self {
            Solid::Sphere { radius } => *radius,
            Solid::Cuboid { half_sides } => half_sides.norm(),
            Solid::Frustum { radii, height } => radii[0].max(radii[1].hypot(*height)),
            Solid::Mesh(mesh) => mesh.extent(),
        }
    }
}

/// A part of a body.
#[derive(Clone, Debug, PartialEq)]
pub struct Part {
    /// Its shape.
    pub solid: Solid,
    /// Where it sits in the body's own axes.
    pub pose: Pose,
    /// Number of its material in the law table.
    pub material: u16,
    /// Density (kg/m³), 0 for a surface without mass.
    pub density: f64,
    /// Radius of its edges and corners (m); a sphere has none. Feelers are of this size, so it is also the
    /// length that overlaps of bodies must stay below.
    pub rounding: f64,
}

/// Rounding of a new part over its smallest half width.
const ROUNDING: f64 = 0.05;

impl Part {
    fn new(solid: Solid, density: f64, half_width: f64) -> Part {
        Part {
            solid,
            pose: Pose::at(Vector3::zeros()),
            material: 0,
            density,
            rounding: ROUNDING * half_width,
        }
    }

    /// A ball about the body's origin (m, kg/m³).
    pub fn sphere(radius: f64, density: f64) -> Part {
        Part::new(Solid::Sphere { radius }, density, radius)
    }

    /// A cuboid about the body's origin, its edges along the body's axes (m, kg/m³).
    pub fn cuboid(half_sides: Vector3<f64>, density: f64) -> Part {
        Part::new(Solid::Cuboid { half_sides }, density, half_sides.min())
    }

    /// A cylinder about the body's origin, its axis along z (m, kg/m³).
    pub fn cylinder(radius: f64, height: f64, density: f64) -> Part {
        let part = Part::frustum([radius; 2], height, density);
        part.at(-Vector3::z() * (0.5 * height))
    }

    /// A frustum from the body's origin along z (m, kg/m³).
    pub fn frustum(radii: [f64; 2], height: f64, density: f64) -> Part {
        let half_width = (0.5 * height).min(radii[0].max(radii[1]));
        Part::new(Solid::Frustum { radii, height }, density, half_width)
    }

    /// What a mesh encloses, where the mesh has it (kg/m³).
    pub fn mesh(mesh: Arc<Mesh>, density: f64) -> Part {
        let [low, high] = mesh.bounds();
        let half_width = 0.5 * (high - low).norm() * 0.2;
        Part::new(Solid::Mesh(mesh), density, half_width)
    }

    /// The same part put elsewhere: its origin moves by a vector of the body's axes (m).
    pub fn at(mut self, shift: Vector3<f64>) -> Part {
        self.pose.position += shift;
        self
    }

    /// The same part turned about the body's origin.
    pub fn turned(mut self, turn: UnitQuaternion<f64>) -> Part {
        self.pose = self.pose.turned_about(&Vector3::zeros(), &turn);
        self
    }

    /// The same part of another material.
    pub fn material(mut self, material: u16) -> Part {
        self.material = material;
        self
    }

    /// The same part with edges of another radius (m).
    pub fn rounded(mut self, rounding: f64) -> Part {
        self.rounding = rounding;
        self
    }
}

/// An axis fixed in space.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hinge {
    /// A point of the axis (m).
    pub point: Vector3<f64>,
    /// Unit vector along it.
    pub axis: Vector3<f64>,
}

/// How a body may move.
#[derive(Clone, Debug, Default, PartialEq)]
pub enum Freedom {
    /// Forces move and turn it.
    #[default]
    Free,
    /// Forces turn it about an axis.
    Hinged(Hinge),
    /// It moves as it is told, like a wall; a hinge that is turned is a [`crate::walls::Rotation`].
    Driven(Motion),
}

impl Freedom {
    /// Held where it is.
    pub fn held() -> Freedom {
        Freedom::Driven(Motion::Fixed)
    }
}

/// A rigid body.
#[derive(Clone, Debug, PartialEq)]
pub struct Body {
    /// What it is made of.
    pub parts: Vec<Part>,
    /// Its mass properties in its own axes, or nothing to take them from the parts.
    pub mass: Option<MassProperties>,
    /// Where its own axes are at the start.
    pub pose: Pose,
    /// Velocity of the centre of mass at the start (m/s); of free bodies.
    pub velocity: Vector3<f64>,
    /// Angular velocity at the start, in directions of space (rad/s); about its axis for a hinged body.
    pub spin: Vector3<f64>,
    /// How it may move.
    pub freedom: Freedom,
}

impl Body {
    /// A free body at rest whose own axes are those of space.
    pub fn new(parts: Vec<Part>) -> Body {
        Body {
            parts,
            mass: None,
            pose: Pose::at(Vector3::zeros()),
            velocity: Vector3::zeros(),
            spin: Vector3::zeros(),
            freedom: Freedom::Free,
        }
    }

    /// The same body with its own origin at a point (m).
    pub fn at(mut self, position: Vector3<f64>) -> Body {
        self.pose.position = position;
        self
    }

    /// The same body with its own axes turned.
    pub fn turned(mut self, orientation: UnitQuaternion<f64>) -> Body {
        self.pose.orientation = orientation;
        self
    }

    /// The same body in motion: velocity of its centre of mass (m/s) and angular velocity (rad/s).
    pub fn moving(mut self, velocity: Vector3<f64>, spin: Vector3<f64>) -> Body {
        (self.velocity, self.spin) = (velocity, spin);
        self
    }

    /// The same body with another freedom.
    pub fn freedom(mut self, freedom: Freedom) -> Body {
        self.freedom = freedom;
        self
    }

    /// The same body with a mass of its own (kg): its parts' densities only say how it is spread.
    ///
    /// # Errors
    /// If its parts have no mass properties.
    pub fn weighing(mut self, mass: f64) -> Result<Body, SetupError> {
        self.mass = Some(self.mass_properties("body")?.scaled_to(mass));
        Ok(self)
    }

    /// Checks its numbers; `key` says whose they are. There are laws for so many materials.
    ///
    /// # Errors
    /// If a number is outside its range, named with the key.
    pub fn validate(&self, key: &str, materials: usize) -> Result<(), SetupError> {
        let parts = self.parts.len() as f64;
        check(&format!("{key}.parts, their number"), parts, "≥ 1", |n| {
            n >= 1.0
        })?;
        check_pose(&self.pose, key)?;
        for (name, vector) in [("velocity", &self.velocity), ("spin", &self.spin)] {
            for c in vector.iter() {
                check(&format!("{key}.{name}"), *c, "finite", |_| true)?;
            }
        }
        for (k, part) in self.parts.iter().enumerate() {
            let key = format!("{key}.parts[{k}]");
            check_pose(&part.pose, &key)?;
            check(
                &format!("{key}.density"),
                part.density,
                "≥ 0 kg/m³",
                |d| d >= 0.0,
            )?;
            rounded::validate(part, &key)?;
            known_material(part.material, materials)?;
        }
        if let Freedom::Driven(motion) = &self.freedom {
            return self.validate_driven(motion, key);
        }
        self.mass_properties(key)?;
        let Freedom::Hinged(hinge) = &self.freedom else {
            return Ok(());
        };
        for c in hinge.point.iter() {
            check(&format!("{key}.hinge.point"), *c, "finite, m", |_| true)?;
        }
        crate::walls::unit(&format!("{key}.hinge.axis"), &hinge.axis)?;
        let key = |name: &str| format!("{key}.{name} of a hinged body");
        let speed = self.velocity.norm();
        check(&key("velocity"), speed, "0: its spin says it", |v| v == 0.0)?;
        let spin = self.spin.norm();
        let across = (self.spin - hinge.axis * self.spin.dot(&hinge.axis)).norm();
        check(&key("spin"), across, "along the axis of the hinge", |s| {
            s <= 1e-9 * spin
        })
    }

    /// Distance of its farthest point from its own origin, at most (m).
    pub(crate) fn reach(&self) -> f64 {
        let parts = self.parts.iter();
        let parts = parts.map(|part| part.pose.position.norm() + part.solid.extent());
        parts.fold(0.0, f64::max)
    }

    /// Refuses a part of which a periodic box would show no images where there are some.
    pub(crate) fn check_images(&self, domain: &Domain, key: &str) -> Result<(), SetupError> {
        let turning = match &self.freedom {
            Freedom::Free => Turning::Any,
            Freedom::Hinged(hinge) => Turning::About(hinge.axis),
            Freedom::Driven(motion) => motion.turning(),
        };
        for (k, part) in self.parts.iter().enumerate() {
            let turn = self.pose.orientation * part.pose.orientation;
            let core = rounded::core(part);
            let seen = Seen {
                shape: &core.shape,
                rounding: core.rounding,
                turn,
                turning,
            };
            seen.check(domain, &format!("{key}.parts[{k}]"))?;
        }
        Ok(())
    }

    fn validate_driven(&self, motion: &Motion, key: &str) -> Result<(), SetupError> {
        let key = |name: &str| format!("{key}.{name}");
        let servo = f64::from(u8::from(matches!(motion, Motion::Servo(_))));
        let word = "none: walls have servos, bodies do not";
        check(&key("motion: servo"), servo, word, |s| s == 0.0)?;
        motion.validate(&key("motion"))?;
        let moves = self.velocity.norm() + self.spin.norm();
        let word = "0: its motion says it";
        check(
            &key("velocity and spin of a driven body"),
            moves,
            word,
            |v| v == 0.0,
        )
    }
}

fn check_pose(pose: &Pose, key: &str) -> Result<(), SetupError> {
    for c in pose.position.iter() {
        check(&format!("{key}.position"), *c, "finite, m", |_| true)?;
    }
    let length = pose.orientation.quaternion().norm();
    check(&format!("{key}.orientation"), length, "of length 1", |v| {
        (v - 1.0).abs() < 1e-9
    })
}
