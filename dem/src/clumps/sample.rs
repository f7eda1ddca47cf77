//! What is seen of clumps from outside.

use super::{Member, State};
use crate::simulation::Simulation;
use nalgebra::{UnitQuaternion, Vector3};

/// A clump at one instant.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ClumpSample {
    /// Number of its first grain, which stays its own when other clumps go.
    pub number: u32,
    /// How many grains it has.
    pub grains: usize,
    /// Centre of mass (m), inside the box along periodic axes.
    pub centre: Vector3<f64>,
    /// Principal axes in space.
    pub orientation: UnitQuaternion<f64>,
    /// Velocity of the centre (m/s).
    pub velocity: Vector3<f64>,
    /// Angular velocity (rad/s).
    pub spin: Vector3<f64>,
    /// Angular momentum about the centre (kg m²/s).
    pub angular_momentum: Vector3<f64>,
    /// Mass (kg).
    pub mass: f64,
    /// Force of contacts and loads (N).
    pub force: Vector3<f64>,
    /// Kinetic energy of translation and rotation (J).
    pub kinetic: [f64; 2],
}

impl Simulation {
    /// Number of clumps.
    pub fn clump_count(&self) -> usize {
        self.clumps.count()
    }

    /// All clumps at this instant, in the order in which they were made.
    pub fn clump_samples(&mut self) -> Vec<ClumpSample> {
        self.observe();
        let half = self.half_step();
        let sample = |(state, own): (&State, &[Member])| {
            let [force, _] = self.clump_load(own);
            let (velocity, momentum) = self.clump_kicked(state, own, half);
            ClumpSample {
                number: own[0].grain,
                grains: own.len(),
                centre: self.domain.wrap(state.place),
                orientation: state.orientation,
                velocity,
                spin: state.spin(&momentum),
                angular_momentum: momentum,
                mass: state.mass,
                force,
                kinetic: state.kinetic(&velocity, &momentum),
            }
        };
        self.clumps.all().map(sample).collect()
    }

    /// Numbers of the grains of each clump, in the order in which clumps were made.
    pub fn clump_grains(&self) -> Vec<Vec<u32>> {
        let numbers = |(_, own): (&State, &[Member])| own.iter().map(|m| m.grain).collect();
        self.clumps.all().map(numbers).collect()
    }
}
