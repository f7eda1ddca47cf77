//! How close to rest grains are.
//!
//! ```text
//! kinetic     Σ (m v²/2 + I ω²/2) / Σ m a d̄       free grains; a acceleration, d̄ mean diameter
//! unbalanced  ⟨|F|⟩ / ⟨|F_c|⟩                      F whole force on a grain, F_c force of a contact or bond
//! ```
//! A clump counts as one grain, and so does a body that forces move: of the diameter of its farthest point.
//!
//! The first says how far the grains could still be thrown, in diameters; the second goes to zero only
//! where every grain is carried.

use crate::grains::vector;
use crate::simulation::Simulation;
use nalgebra::Vector3;
use serde::{Deserialize, Serialize};
use std::fmt;

/// Measures of rest.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct RestMeasures {
    /// Kinetic energy over m a d̄ a grain.
    pub kinetic: f64,
    /// Mean force left on a grain over the mean force of a contact; infinite without contacts.
    pub unbalanced: f64,
    /// Acceleration of the unit of energy (m/s²).
    pub acceleration: f64,
    /// Simulated time (s).
    pub time: f64,
}

/// When grains count as resting.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Rest {
    /// Kinetic energy below this, over m a d̄ a grain.
    pub kinetic: f64,
    /// Unbalanced force below this.
    pub unbalanced: f64,
}

impl Default for Rest {
    fn default() -> Self {
        Rest {
            kinetic: 1e-7,
            unbalanced: 1e-2,
        }
    }
}

impl Rest {
    /// Whether grains rest.
    pub fn holds(&self, measures: &RestMeasures) -> bool {
        measures.kinetic <= self.kinetic && measures.unbalanced <= self.unbalanced
    }
}

impl fmt::Display for RestMeasures {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        write!(
            f,
            "kinetic energy {:.2e} m a d a grain (a = {:.3e} m/s²), unbalanced force {:.2e} of a contact's",
            self.kinetic, self.acceleration, self.unbalanced
        )
    }
}

impl Simulation {
    /// Measures rest against an acceleration (m/s²): gravity's, or whatever pulls the grains.
    pub fn rest_measures(&mut self, acceleration: f64) -> RestMeasures {
        self.observe();
        let free: Vec<usize> = (0..self.grains.len())
            .filter(|&i| self.moves_alone(i))
            .collect();
        let (mut kinetic, mut left, mut diameters, mut mass) = (0.0, 0.0, 0.0, 0.0);
        for &i in &free {
            let (v, w) = self.synchronised(i);
            let (m, r) = (self.grains.mass[i], self.grains.place[i][3]);
            kinetic += 0.5 * m * (v.norm_squared() + 0.4 * r * r * w.norm_squared());
            let force: Vector3<f64> = vector(&self.totals[i][0]) + m * self.gravity();
            left += force.norm();
            diameters += 2.0 * r;
            mass += m;
        }
        self.each_clump_at_rest(|[energy, force, diameter, m]| {
            kinetic += energy;
            left += force;
            diameters += diameter;
            mass += m;
        });
        let bodies = self.each_body_at_rest(|[energy, force, diameter, m]| {
            kinetic += energy;
            left += force;
            diameters += diameter;
            mass += m;
        });
        let count = (free.len() + self.clump_count() + bodies).max(1) as f64;
        let rows = self.slot_rows();
        let pushes = self
            .reach
            .pairs()
            .map(|(chunk, k)| vector(&chunk.slots[k * rows]).norm());
        let walls = self.wall_contacts.touching();
        let pushes = pushes.chain(walls.map(|c| vector(&c.slot[0]).norm()));
        let pushes = pushes.chain(self.bodies.forces());
        let pushes = pushes.chain(self.bonds.whole().map(|bond| bond.pull.force.norm()));
        let (sum, contacts) = pushes
            .filter(|&f| f > 0.0)
            .fold((0.0, 0_u64), |(sum, n), f| (sum + f, n + 1));
        RestMeasures {
            kinetic: kinetic / (mass * acceleration * diameters / count),
            unbalanced: if contacts > 0 {
                left / count * contacts as f64 / sum
            } else {
                f64::INFINITY
            },
            acceleration,
            time: self.time(),
        }
    }
}
