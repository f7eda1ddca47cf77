//! What a scene expects its grains to meet, and how far from each limit it stays.

use super::bodies::Body;
use crate::contact::{ContactLaw, Inertia, Normal, hertz};
use crate::grains::Grain;
use nalgebra::Vector3;

/// What grains will meet.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Conditions {
    /// Largest speed of two surfaces against each other (m/s).
    pub speed: f64,
    /// Largest overlap of any contact over the harmonic mean of its radii (–), as
    /// [`crate::Simulation::largest_overlap`] reports it.
    pub overlap: f64,
    /// Largest pressure (Pa): a contact carries it on the product of its diameters.
    pub pressure: f64,
}

impl Default for Conditions {
    /// At rest, with an overlap of 1 %.
    fn default() -> Self {
        Conditions {
            speed: 0.0,
            overlap: 0.01,
            pressure: 0.0,
        }
    }
}

impl Conditions {
    /// Speeds of the start and of a fall through the whole heap, and its weight.
    pub fn of(grains: &[Grain], gravity: &Vector3<f64>) -> Conditions {
        let fastest = grains.iter().map(|g| g.velocity.norm()).fold(0.0, f64::max);
        let g = gravity.norm();
        let height = |grain: &Grain| grain.position.dot(gravity) / g.max(f64::MIN_POSITIVE);
        let low = grains.iter().map(height).fold(f64::INFINITY, f64::min);
        let high = grains.iter().map(height).fold(f64::NEG_INFINITY, f64::max);
        let depth = if g > 0.0 && high > low {
            high - low
        } else {
            0.0
        };
        let heaviest = grains.iter().map(|g| g.density).fold(0.0, f64::max);
        Conditions {
            // Two grains may meet head on.
            speed: 2.0 * fastest + (2.0 * g * depth).sqrt(),
            pressure: DENSE * heaviest * g * depth,
            ..Conditions::default()
        }
    }
}

/// Solid fraction of a dense packing.
const DENSE: f64 = 0.6;

/// Which share of each time a step may take.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Shares {
    /// Steps of a contact (N); elastic laws count only a `contact_time` that is given.
    pub steps_per_contact: f64,
    /// Contact time (s) that those steps divide instead of the shortest one of all pairs: a scene may
    /// count them for its mean grain, as the thesis does.
    pub contact_time: Option<f64>,
    /// Of the Hertz time.
    pub hertz: f64,
    /// Of the Rayleigh time.
    pub rayleigh: f64,
    /// Of the JKR time.
    pub jkr: f64,
    /// Of the stability limit of one contact.
    pub stability: f64,
    /// Of the smallest radius over the speed.
    pub travel: f64,
    /// Of what remains: a scene's own safety factor.
    pub safety: f64,
}

impl Default for Shares {
    fn default() -> Self {
        Shares {
            steps_per_contact: 30.0,
            contact_time: None,
            hertz: 0.1,
            rayleigh: 0.1,
            jkr: 0.1,
            stability: 0.3,
            travel: 0.1,
            safety: 1.0,
        }
    }
}

/// Largest overlap that a pair will meet (m).
pub(super) fn overlap(
    law: &ContactLaw,
    a: &Body,
    b: &Body,
    inertia: &Inertia,
    expected: &Conditions,
) -> f64 {
    let Inertia {
        reduced_mass: mass,
        reduced_radius: radius,
        ..
    } = *inertia;
    let walled = a.radius.is_infinite() || b.radius.is_infinite();
    let (mean, breadth) = if walled {
        (radius, 4.0 * radius * radius)
    } else {
        (2.0 * radius, 4.0 * a.radius * b.radius)
    };
    let load = expected.pressure * breadth + law.cohesion.force(radius);
    let speed = expected.speed;
    let elastic = |modulus: f64| {
        let struck = hertz::impact_overlap(modulus, mass, radius, speed);
        let pressed = (0.75 * load / (modulus * radius.sqrt())).powf(2.0 / 3.0);
        struck.max(pressed)
    };
    let met = match &law.normal {
        Normal::Hooke(hooke) => {
            (load / hooke.stiffness).max(speed * (mass / hooke.stiffness).sqrt())
        }
        Normal::Hertz(hertz) => elastic(hertz.effective_modulus),
        Normal::Viscoelastic(v) => elastic(v.effective_modulus),
        Normal::Jkr(jkr) => elastic(jkr.effective_modulus()).max(jkr.equilibrium_overlap(radius)),
    };
    met.max(expected.overlap * mean)
}
