//! Grains that have come out of the edge and lie in the continuum.
//!
//! Traction is shared by mass: it holds the shell up in the mean, not each of its grains. One that no neighbour holds
//! slides out of the edge and down along it, and is thrown back at the heap by the larger pressure below. But behind the
//! edge there is no void: material lies there, and what lies in it goes where it goes. So a grain at a depth s behind
//! the edge's place is carried by the continuum with a weight that rises over a diameter,
//!
//! ```text
//! F = −w m (g + (v − u)/t_e),      w = clamp(s/d, 0, 1) c,      t_e = 0.1 √(d/g)
//! ```
//! c the part of the cells around it that are full, and bears 1 − w of its share of the traction: the pressure is on
//! all its sides. t_e is about the time in which a grain that moves √(g d) is stopped under some diameters of others: the drag on
//! an intruder is friction times pressure times area, with a factor well above one (T. A. Brzinski III, P. Mayor &
//! D. J. Durian, Phys. Rev. Lett. 111 (2013) 168002). The continuum takes the opposite of F, with what the relaxation gave.

use super::MaterialEdge;
use super::side::in_slab;
use colluvium_dem::GrainSample;
use nalgebra::{Vector2, Vector3};

/// t_e over √(d/g).
const STOPPING: f64 = 0.1;
/// Fewest times that the time for which loads are held fits into t_e.
const FEWEST: f64 = 2.0;

/// How a grain lies in the continuum: the weight w, and the velocity u around it (m/s).
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Embedded {
    pub weight: f64,
    pub velocity: Vector2<f64>,
}

impl Embedded {
    /// Force on a grain (N) under gravity (m/s²), with the time in which it is stopped (s). A plane continuum does not
    /// move across.
    pub fn force(
        &self,
        grain: &GrainSample,
        gravity: &Vector3<f64>,
        stopping: f64,
    ) -> Vector3<f64> {
        let slip = grain.velocity - in_slab(self.velocity);
        -self.weight * grain.mass * (gravity + slip / stopping)
    }
}

impl MaterialEdge {
    /// How a grain lies in the continuum, if it does.
    pub(super) fn embedded(&self, grain: &GrainSample) -> Embedded {
        let rows = self.cells.rows(grain.position.z).into_iter();
        let place: f64 = rows.map(|(row, hat)| hat * self.held.rows[row].place).sum();
        let depth = (place - grain.position.x) / self.spec.case.rheology.diameter;
        if depth <= 0.0 {
            return Embedded::default();
        }
        let hats = self.cells.hats(grain.position.x, grain.position.z);
        let Some(velocity) = self.view.velocity_at(&hats) else {
            return Embedded::default();
        };
        let full = hats.iter().filter(|(cell, _)| self.view.is_full(*cell));
        Embedded {
            weight: depth.min(1.0) * full.map(|(_, hat)| hat).sum::<f64>(),
            velocity,
        }
    }

    /// Time in which a grain that lies in the continuum is stopped, t_e (s).
    pub(super) fn embedded_time(&self) -> f64 {
        let case = &self.spec.case;
        let natural = (case.rheology.diameter / case.gravity).sqrt();
        let held = self.joint.steps_of_loads as f64 * self.joint.timestep;
        (STOPPING * natural).max(FEWEST * held)
    }
}
