//! The angle at which an avalanche comes to rest.
//!
//! A bed settles on a rough base of its own grains, periodic along and across the slope, and is set in
//! gentle shear on a slope that is then held. Below some angle the avalanche rests, above it it goes on:
//! that angle is sought by halving. The slope has no ends. Closed boxes tilted until they run, and heaps
//! that drain over the edges of their base, stood up to ten degrees steeper with the two thousand
//! grains that a test affords: walls carry the toe, and layers are thin where they end.
//!
//! What decides is whether the mean velocity is lost within a time. Half a degree below the angle of
//! rest that takes longer than is waited for: the angle is found too low by about that, and known to
//! half the last step of the search.
//!
//! Units d = m = g = 1.

use crate::DENSITY;
use colluvium_dem::preparation::{Bed, InclineBed, RadiusLaw, settle_incline_bed};
use colluvium_dem::{
    ContactLaw, Hooke, Setup, SetupError, ShapeParameter, Simulation, TangentialSpring, Threads,
    timestep,
};
use nalgebra::Vector3;
use std::ops::ControlFlow;

/// k_n d/(m g): grains under 10 d of others overlap by 0.2 % of d.
const STIFFNESS: f64 = 5e3;

/// Steps a contact.
const STEPS: f64 = 20.0;

/// The thesis' grains (Tab. 2.2, ε as in Tab. 2.1) by μ_R and β.
pub fn grains(rolling_friction: f64, beta: f64) -> ContactLaw {
    ContactLaw::linear(
        Hooke::matched(STIFFNESS, 0.5),
        TangentialSpring::matched(2.0 / 7.0, 0.5, 1.0),
        Some(ShapeParameter {
            beta,
            rolling_friction,
            twisting_friction: 1.3,
        }),
    )
}

/// A bed to be tilted.
#[derive(Clone, Copy, Debug)]
pub struct Slope {
    /// Length and width of the periodic base (d).
    pub base: [f64; 2],
    /// Grains a d² of the base; 1.1 make a layer one grain deep.
    pub filling: f64,
    /// Seed of the bed.
    pub seed: u64,
}

/// Shear given to the bed (√(g/d)): an inertial number of 0.05 half way down.
const SHEAR: f64 = 0.1;
/// How long an avalanche is watched (√(d/g)).
const WATCH: f64 = 60.0;
/// Mean velocity of an avalanche at its end (√(g d)).
const STOPPED: f64 = 0.01;

impl Slope {
    /// A settled bed.
    ///
    /// # Errors
    /// If it cannot be prepared.
    pub fn bed(&self, law: ContactLaw) -> Result<Bed, SetupError> {
        let [length, width] = self.base;
        let spec = InclineBed {
            grains: (length * width * self.filling) as usize,
            radius: RadiusLaw::Gaussian {
                mean: 0.5,
                relative_deviation: 0.1,
                cut: 1.0,
            },
            density: DENSITY,
            length,
            width,
            law,
            gravity: 1.0,
            timestep: timestep::step(1.0, STIFFNESS, STEPS),
            seed: self.seed,
        };
        settle_incline_bed(&spec, Threads::Serial, &mut |_| ControlFlow::Continue(()))
    }

    /// Angle between `low`, where avalanches must rest, and `high`, where they must not, to a `step`
    /// (degrees); the middle of the last interval.
    ///
    /// # Errors
    /// If the bed cannot be prepared or its step is too long.
    pub fn angle_of_rest(
        &self,
        law: ContactLaw,
        [mut low, mut high]: [f64; 2],
        step: f64,
    ) -> Result<f64, SetupError> {
        let bed = self.bed(law)?;
        while high - low > step {
            let middle = 0.5 * (low + high);
            if rests(&bed, law, middle)? {
                low = middle;
            } else {
                high = middle;
            }
        }
        Ok(0.5 * (low + high))
    }
}

/// Whether an avalanche rests at a slope (degrees).
///
/// # Errors
/// If the step is too long.
pub fn rests(bed: &Bed, law: ContactLaw, slope: f64) -> Result<bool, SetupError> {
    let (s, c) = slope.to_radians().sin_cos();
    let mut simulation = Simulation::new(Setup {
        domain: bed.domain,
        gravity: Vector3::new(s, 0.0, -c),
        law: law.into(),
        grains: bed.grains.clone(),
        walls: vec![],
        bodies: Vec::new(),
        timestep: timestep::step(1.0, STIFFNESS, STEPS),
        threads: Threads::Serial,
    })?;
    simulation.give_velocity(|g| Vector3::new(SHEAR * g.position.z, 0.0, 0.0));
    let mass = simulation.free_mass();
    let given = simulation.momentum().x / mass;
    let look = (1.0 / simulation.timestep()) as u64;
    let mut velocity = given;
    while simulation.time() < WATCH && velocity > STOPPED && velocity < 3.0 * given {
        simulation.advance(look)?;
        velocity = simulation.momentum().x / mass;
    }
    Ok(velocity < 0.1 * given)
}
