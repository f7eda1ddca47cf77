//! Clumps at random places, turned at random, none touching another: each stands in the ball about it.

use super::ingredients::{Amount, Ingredient};
use super::insertion::{Insertion, TRIES, insert_loose};
use super::sizes::RadiusLaw;
use crate::bodies::MassProperties;
use crate::clumps::{Clump, lightest};
use crate::domain::Domain;
use crate::grains::Grain;
use crate::region::Region;
use crate::setup::{SetupError, check};
use crate::walls::Pose;
use nalgebra::{Quaternion, UnitQuaternion, Vector3};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

/// Balls that make a clump, in its own axes.
#[derive(Clone, Debug, PartialEq)]
pub struct ClumpShape {
    /// Centres (m) and radii (m).
    pub balls: Vec<(Vector3<f64>, f64)>,
    /// Mass, centre and inertia.
    pub mass: MassProperties,
    /// Number of the material in the law table.
    pub material: u16,
}

impl ClumpShape {
    /// Balls of one density (kg/m³); where they overlap the mass counts once.
    pub fn of_balls(balls: Vec<(Vector3<f64>, f64)>, density: f64) -> ClumpShape {
        ClumpShape {
            mass: MassProperties::of_balls(&balls, density),
            balls,
            material: 0,
        }
    }

    /// Radius of the ball about the centre of mass that holds all of it (m).
    pub fn extent(&self) -> f64 {
        let far = |(x, r): &(Vector3<f64>, f64)| (x - self.mass.centre).norm() + r;
        self.balls.iter().map(far).fold(0.0, f64::max)
    }

    /// Mass that a push through the middle of a ball feels at the least (kg).
    pub fn lightest(&self) -> f64 {
        let arms = self.balls.iter().map(|(x, _)| x - self.mass.centre);
        lightest(&self.mass, arms)
    }

    /// Its balls at a pose as grains, of a density such that a grain's mass is the least that a push on the clump
    /// feels: what limits a step.
    pub fn grains(&self, pose: &Pose, velocity: Vector3<f64>) -> Vec<Grain> {
        let lightest = self.lightest();
        let grain = |(place, radius): &(Vector3<f64>, f64)| {
            let at = pose.position + pose.orientation * place;
            let mut grain = Grain::at_rest(at, *radius, 1.0);
            grain.density = lightest / grain.volume();
            grain.velocity = velocity;
            grain.material = self.material;
            grain
        };
        self.balls.iter().map(grain).collect()
    }

    /// A pose that puts its centre of mass somewhere, turned at random.
    pub(super) fn thrown(&self, centre: &Vector3<f64>, random: &mut ChaCha8Rng) -> Pose {
        let mut normal = || StandardNormal.sample(random);
        let q = Quaternion::new(normal(), normal(), normal(), normal());
        let orientation = UnitQuaternion::from_quaternion(q);
        Pose {
            position: centre - orientation * self.mass.centre,
            orientation,
        }
    }

    /// The clump at a pose whose first grain has a number.
    pub(super) fn clump(&self, pose: &Pose, first: u32) -> Clump {
        Clump {
            grains: (first..first + self.balls.len() as u32).collect(),
            mass: Some(self.mass.put(pose)),
        }
    }

    /// The ball about it as an ingredient.
    pub(super) fn hull(&self) -> Ingredient {
        let radii = RadiusLaw::List {
            radii: vec![self.extent()],
            shares: vec![1.0],
        };
        Ingredient::alone(radii, 1.0)
    }

    /// Checks its numbers.
    ///
    /// # Errors
    /// If it has no balls, a number is out of its range, or no distribution of mass has such an inertia.
    pub fn validate(&self, key: &str) -> Result<(), SetupError> {
        let count = self.balls.len() as f64;
        check(&format!("{key}.balls, their number"), count, "≥ 1", |n| {
            n >= 1.0
        })?;
        for (k, (x, r)) in self.balls.iter().enumerate() {
            check(&format!("{key}.balls[{k}].radius"), *r, "> 0 m", |r| {
                r > 0.0
            })?;
            for c in x.iter() {
                check(&format!("{key}.balls[{k}].point"), *c, "finite, m", |_| {
                    true
                })?;
            }
        }
        self.mass.validate(key)
    }
}

/// So many clumps in a region.
#[derive(Clone, Debug)]
pub struct Scattering {
    /// What they are.
    pub shape: ClumpShape,
    /// The balls about them lie in it as a whole.
    pub region: Region,
    /// The box.
    pub domain: Domain,
    /// How many.
    pub count: usize,
    /// Their velocity (m/s).
    pub velocity: Vector3<f64>,
    /// Seed of all random numbers.
    pub seed: u64,
}

/// Clumps in place.
#[derive(Clone, Debug)]
pub struct Scattered {
    /// Their grains, clump by clump (see [`ClumpShape::grains`]).
    pub grains: Vec<Grain>,
    /// Clumps by the numbers of their grains.
    pub clumps: Vec<Clump>,
    /// The balls about them.
    pub hulls: Vec<Grain>,
}

/// Puts clumps in whose first grain will have a number, clear of each other and of any of `among`.
///
/// # Errors
/// If a number is out of its range or a clump finds no room.
pub fn scatter(spec: &Scattering, among: &[Grain], first: u32) -> Result<Scattered, SetupError> {
    spec.shape.validate("clump")?;
    let insertion = Insertion {
        region: spec.region.clone(),
        domain: spec.domain,
        ingredients: vec![spec.shape.hull()],
        amount: Amount::Grains(spec.count),
        gap: 0.0,
        velocity: spec.velocity,
        tries: TRIES,
        seed: spec.seed,
    };
    let (hulls, _) = insert_loose(&insertion, among)?;
    // Not the numbers that places were drawn by.
    let mut random = ChaCha8Rng::seed_from_u64(spec.seed);
    random.set_stream(1);
    let shape = &spec.shape;
    let mut scattered = Scattered {
        grains: Vec::new(),
        clumps: Vec::new(),
        hulls,
    };
    for hull in &scattered.hulls {
        let pose = shape.thrown(&hull.position, &mut random);
        let from = first + scattered.grains.len() as u32;
        scattered.grains.extend(shape.grains(&pose, spec.velocity));
        scattered.clumps.push(shape.clump(&pose, from));
    }
    Ok(scattered)
}
