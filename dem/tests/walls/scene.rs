//! Small scenes of grains and walls in open space.

use colluvium_dem::*;
use nalgebra::Vector3;

pub const RADIUS: f64 = 0.1;
pub const DENSITY: f64 = 1000.0;

pub fn open_space() -> Domain {
    Domain {
        lower: Vector3::repeat(-100.0),
        upper: Vector3::repeat(100.0),
        periodic: [false; 3],
    }
}

pub fn ball(position: [f64; 3], velocity: [f64; 3]) -> Grain {
    Grain {
        velocity: velocity.into(),
        ..Grain::at_rest(position.into(), RADIUS, DENSITY)
    }
}

/// Elastic spheres without friction.
pub fn smooth() -> ContactLaw {
    let elasticity = Elasticity {
        youngs_modulus: 1e8,
        poissons_ratio: 0.3,
    };
    ContactLaw {
        tangential: Tangential::None,
        ..ContactLaw::hertz_mindlin(elasticity, 1.0, 0.0)
    }
}

/// Stiff linear springs with dashpots that stick.
pub fn rough(stiffness: f64, friction: f64) -> ContactLaw {
    ContactLaw::linear(
        Hooke::matched(stiffness, 0.5),
        TangentialSpring::matched(2.0 / 7.0, 0.5, friction),
        None,
    )
}

pub fn setup(law: ContactLaw, grains: Vec<Grain>, walls: Vec<Wall>, timestep: f64) -> Setup {
    Setup {
        domain: open_space(),
        gravity: Vector3::zeros(),
        law: law.into(),
        grains,
        walls,
        bodies: Vec::new(),
        timestep,
        threads: Threads::Serial,
    }
}

pub fn only(simulation: &mut Simulation) -> GrainSample {
    let mut snapshot = Snapshot::default();
    simulation.snapshot(&mut snapshot);
    snapshot.grains[0]
}
