//! Gravity: uniform, on a schedule, of a heavy sphere, of the grains themselves.
//!
//! Uniform gravity stands in the sweep. Fields that differ from place to place are loads (`loads.rs`),
//! filled only where a scene has them. Fixed grains attract, but nothing attracts them.

mod schedule;
mod sphere;
mod tree;

pub use schedule::Schedule;
pub use sphere::HeavySphere;
pub use tree::TreeError;

use crate::grains::{Grains, vector};
use crate::record::Record;
use crate::setup::{SetupError, check};
use crate::simulation::Simulation;
use nalgebra::Vector3;
use tree::Tree;

/// Newton's constant of gravitation (m³/(kg s²)), CODATA 2018.
pub const GRAVITATION: f64 = 6.674_30e-11;

/// Attraction of all grains by each other.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SelfGravity {
    /// G (m³/(kg s²)); larger where parcels stand for more than their mass.
    pub constant: f64,
    /// Opening angle θ of the tree; 0 sums over all pairs.
    pub opening: f64,
}

impl SelfGravity {
    /// With Newton's constant and an opening angle at which accelerations are right to some 1e-4.
    pub fn newton() -> Self {
        SelfGravity {
            constant: GRAVITATION,
            opening: 0.4,
        }
    }

    fn validate(&self) -> Result<(), SetupError> {
        check("gravity.constant", self.constant, "> 0 m³/(kg s²)", |v| {
            v > 0.0
        })?;
        check("gravity.opening", self.opening, "in [0, 0.9]", |v| {
            (0.0..=0.9).contains(&v)
        })
    }
}

/// All gravity but the uniform part of the present step.
#[derive(Clone, Debug, Default)]
pub(crate) struct Gravity {
    pub schedule: Option<Schedule>,
    sphere: Option<HeavySphere>,
    own: Option<SelfGravity>,
    tree: Tree,
    /// Force (N) on each grain and the part of the potential energy that is booked on it (J).
    pub pulls: Vec<[f64; 4]>,
}

impl Gravity {
    /// Whether any field differs from place to place.
    pub fn has_fields(&self) -> bool {
        self.sphere.is_some() || self.own.is_some()
    }

    /// Lays the forces of all fields on the grains where they are.
    pub fn evaluate(&mut self, grains: &Grains, parallel: bool) {
        let n = grains.len();
        self.pulls.clear();
        self.pulls.resize(n, [0.0; 4]);
        if let Some(sphere) = &self.sphere {
            for (g, pull) in self.pulls.iter_mut().enumerate() {
                if grains.is_fixed(g) {
                    continue;
                }
                let m = grains.mass[g];
                let (field, potential) = sphere.field(&vector(&grains.place[g]));
                *pull = [m * field.x, m * field.y, m * field.z, m * potential];
            }
        }
        let Some(own) = self.own else {
            return;
        };
        let places = grains.id.iter().zip(&grains.mass).zip(&grains.place);
        self.tree
            .build(places.map(|((&id, &m), x)| (id, [x[0], x[1], x[2], m])));
        self.tree.evaluate(own.opening, parallel);
        for (row, field) in self.tree.fields() {
            let gm = own.constant * grains.mass[row];
            let pull = &mut self.pulls[row];
            // Each pair has its energy once, half of it on either side.
            pull[3] += 0.5 * gm * field[3];
            if !grains.is_fixed(row) {
                for k in 0..3 {
                    pull[k] += gm * field[k];
                }
            }
        }
    }

    /// Acceleration (m/s²) and potential (m²/s²) of the heavy sphere at a point.
    pub fn at(&self, x: &Vector3<f64>) -> (Vector3<f64>, f64) {
        let sphere = self.sphere.as_ref();
        sphere.map_or((Vector3::zeros(), 0.0), |sphere| sphere.field(x))
    }

    /// Potential energy of all grains in the fields (J).
    pub fn potential(&self) -> f64 {
        self.pulls.iter().map(|pull| pull[3]).sum()
    }

    /// Writes all but the uniform part into a checkpoint.
    pub fn record(&self, record: &mut Record) {
        let mut numbers = |name: &str, values: Option<Vec<f64>>| {
            let values = values.unwrap_or_default();
            record.numbers.insert(format!("gravity/{name}"), values);
        };
        numbers("schedule", self.schedule.as_ref().map(Schedule::numbers));
        numbers("sphere", self.sphere.as_ref().map(HeavySphere::numbers));
        numbers("own", self.own.map(|own| vec![own.constant, own.opening]));
    }

    /// Reads it back.
    pub fn read(&mut self, record: &Record) -> Result<(), String> {
        self.schedule = Schedule::from_numbers(record.numbers("gravity/schedule")?)?;
        self.sphere = HeavySphere::from_numbers(record.numbers("gravity/sphere")?)?;
        self.own = match *record.numbers("gravity/own")? {
            [] => None,
            [constant, opening] => Some(SelfGravity { constant, opening }),
            _ => return Err("array `gravity/own` must have 2 numbers".into()),
        };
        let checked = self.own.map_or(Ok(()), |own| own.validate());
        checked.map_err(|e| e.to_string())
    }
}

impl Simulation {
    /// Lets uniform gravity follow a schedule from now on, or stay as it is.
    pub fn set_gravity_schedule(&mut self, schedule: Option<Schedule>) {
        self.fields.schedule = schedule;
        self.follow_schedule();
    }

    /// Brings uniform gravity to the present time.
    pub(crate) fn follow_schedule(&mut self) {
        if let Some(schedule) = &self.fields.schedule {
            self.gravity = schedule.at(self.time());
        }
    }

    /// Puts a heavy sphere into the world, or takes it out.
    ///
    /// # Errors
    /// If a number is out of its range, or an axis is periodic.
    pub fn set_heavy_sphere(&mut self, sphere: Option<HeavySphere>) -> Result<(), SetupError> {
        if let Some(sphere) = &sphere {
            sphere.validate()?;
            self.check_open("gravity.sphere")?;
        }
        self.forget_observation();
        self.fields.sphere = sphere;
        self.fields_changed();
        Ok(())
    }

    /// Lets grains attract each other, or not.
    ///
    /// # Errors
    /// If a number is out of its range, or an axis is periodic.
    pub fn set_self_gravity(&mut self, own: Option<SelfGravity>) -> Result<(), SetupError> {
        if let Some(own) = &own {
            own.validate()?;
            self.check_open("gravity.opening")?;
            let bodies = self.body_count() as f64;
            let word = "0: bodies do not attract";
            check(
                "gravity.opening in a scene with bodies",
                bodies,
                word,
                |n| n == 0.0,
            )?;
        }
        self.forget_observation();
        self.fields.own = own;
        self.fields_changed();
        Ok(())
    }

    fn fields_changed(&mut self) {
        if !self.fields.has_fields() {
            self.fields.pulls.clear();
        }
        if self.ledger.is_some() {
            self.open_energy_ledger();
        }
    }

    /// A field that falls off with distance knows no images.
    fn check_open(&self, key: &str) -> Result<(), SetupError> {
        let periodic = self.domain.periodic.iter().filter(|p| **p).count() as f64;
        let key = format!("{key} in a box with periodic axes");
        check(&key, periodic, "0: fields have no images", |p| p == 0.0)
    }

    /// The tree against the direct sum at this instant, over at most so many grains, evenly picked: a check of the
    /// opening angle that costs a term for each of them and every grain. None without self-gravity.
    pub fn self_gravity_error(&mut self, most: usize) -> Option<TreeError> {
        self.observe();
        self.fields.own.map(|_| self.fields.tree.error(most))
    }
}
