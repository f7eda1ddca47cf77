//! Small scenes of bodies.

use colluvium_dem::*;
use nalgebra::{UnitQuaternion, Vector3};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

pub fn open_space() -> Domain {
    Domain {
        lower: Vector3::repeat(-100.0),
        upper: Vector3::repeat(100.0),
        periodic: [false; 3],
    }
}

/// Elastic linear springs without friction (N/m).
pub fn smooth(stiffness: f64) -> ContactLaw {
    ContactLaw {
        tangential: Tangential::None,
        ..rough(stiffness, 1.0, 0.0)
    }
}

/// Elastic spheres without friction; the steel of a soft world.
pub fn hertz() -> ContactLaw {
    let elasticity = Elasticity {
        youngs_modulus: 1e9,
        poissons_ratio: 0.3,
    };
    ContactLaw {
        tangential: Tangential::None,
        ..ContactLaw::hertz_mindlin(elasticity, 1.0, 0.0)
    }
}

/// Linear springs and dashpots with Coulomb friction (N/m).
pub fn rough(stiffness: f64, restitution: f64, friction: f64) -> ContactLaw {
    ContactLaw::linear(
        Hooke::matched(stiffness, restitution),
        TangentialSpring::matched(2.0 / 7.0, restitution, friction),
        None,
    )
}

pub fn setup(law: ContactLaw, bodies: Vec<Body>, walls: Vec<Wall>, timestep: f64) -> Setup {
    Setup {
        domain: open_space(),
        gravity: Vector3::zeros(),
        law: law.into(),
        grains: Vec::new(),
        walls,
        bodies,
        timestep,
        threads: Threads::Serial,
    }
}

pub fn floor() -> Wall {
    Wall::plane(Vector3::zeros(), Vector3::z())
}

/// The half sides of most cuboids here (m), and their density (kg/m³).
pub const HALF: [f64; 3] = [0.145, 0.1375, 0.0975];
pub const DENSITY: f64 = 650.0;

pub fn cuboid() -> Body {
    Body::new(vec![Part::cuboid(HALF.into(), DENSITY)])
}

/// Numbers from a seed.
pub struct Dice(ChaCha8Rng);

impl Dice {
    pub fn new(seed: u64) -> Dice {
        Dice(ChaCha8Rng::seed_from_u64(seed))
    }

    pub fn number(&mut self, low: f64, high: f64) -> f64 {
        self.0.random_range(low..high)
    }

    /// A vector in a cube of a half side.
    pub fn vector(&mut self, half: f64) -> Vector3<f64> {
        Vector3::from_fn(|_, _| self.number(-half, half))
    }

    /// Any orientation, all alike likely.
    pub fn orientation(&mut self) -> UnitQuaternion<f64> {
        loop {
            let q = nalgebra::Quaternion::new(
                self.number(-1.0, 1.0),
                self.number(-1.0, 1.0),
                self.number(-1.0, 1.0),
                self.number(-1.0, 1.0),
            );
            let length = q.norm();
            if length > 0.1 && length < 1.0 {
                return UnitQuaternion::from_quaternion(q);
            }
        }
    }
}

/// Kinetic energy of all bodies (J).
pub fn kinetic(s: &mut Simulation) -> f64 {
    (0..s.body_count())
        .map(|k| s.body(k).kinetic.iter().sum::<f64>())
        .sum()
}

/// Angular momentum of all bodies about the origin at this instant (N m s).
pub fn angular_momentum(s: &mut Simulation) -> Vector3<f64> {
    (0..s.body_count())
        .map(|k| s.body(k))
        .map(|b| b.angular_momentum + b.mass * b.centre.cross(&b.velocity))
        .sum()
}

/// Runs until nothing has touched for a while after the first touch; the number of contacts at once at most.
pub fn through_impact(s: &mut Simulation, step_pack: u64, most: u64) -> usize {
    let mut snapshot = Snapshot::default();
    let (mut touched, mut apart) = (0, 0);
    for _ in 0..most {
        s.advance(step_pack).unwrap();
        s.snapshot(&mut snapshot);
        let now = snapshot.body_contacts.len() + snapshot.contacts.len();
        touched = touched.max(now);
        apart = if now > 0 { 0 } else { apart + 1 };
        if touched > 0 && apart > 20 {
            return touched;
        }
    }
    touched
}
