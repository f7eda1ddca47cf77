//! What the tests of clumps share.

use colluvium_dem::*;
use nalgebra::{UnitQuaternion, Vector3};

pub const DENSITY: f64 = 2500.0;

pub fn v(x: f64, y: f64, z: f64) -> Vector3<f64> {
    Vector3::new(x, y, z)
}

/// A normal spring without dashpot and friction.
pub fn smooth(stiffness: f64) -> ContactLaw {
    ContactLaw {
        tangential: Tangential::None,
        ..ContactLaw::linear(
            Hooke::matched(stiffness, 1.0),
            TangentialSpring::matched(2.0 / 7.0, 1.0, 0.0),
            None,
        )
    }
}

/// Elastic spheres without friction.
pub fn elastic() -> ContactLaw {
    let elasticity = Elasticity {
        youngs_modulus: 1e7,
        poissons_ratio: 0.3,
    };
    ContactLaw {
        tangential: Tangential::None,
        ..ContactLaw::hertz_mindlin(elasticity, 1.0, 0.0)
    }
}

/// Springs, dashpots and friction.
pub fn rough() -> ContactLaw {
    ContactLaw::linear(
        Hooke::matched(1e5, 0.5),
        TangentialSpring::matched(2.0 / 7.0, 0.5, 0.6),
        None,
    )
}

/// Balls of a clump: places about some origin and radii (m). Three that overlap, no two axes alike.
pub fn dogleg() -> Vec<(Vector3<f64>, f64)> {
    vec![
        (v(-0.012, 0.0, 0.0), 0.008),
        (v(0.0, 0.003, 0.0), 0.01),
        (v(0.01, -0.004, 0.006), 0.006),
    ]
}

/// Four balls that touch, each of its own axis.
pub fn jack() -> Vec<(Vector3<f64>, f64)> {
    vec![
        (v(0.0, 0.0, 0.0), 0.01),
        (v(0.018, 0.0, 0.0), 0.008),
        (v(0.0, 0.017, 0.0), 0.007),
        (v(0.0, 0.0, -0.015), 0.005),
    ]
}

/// Balls turned about the origin and put at a place, moving as one.
pub fn put(
    balls: &[(Vector3<f64>, f64)],
    at: Vector3<f64>,
    turn: UnitQuaternion<f64>,
    [velocity, spin]: [Vector3<f64>; 2],
) -> Vec<Grain> {
    let grain = |&(place, radius): &(Vector3<f64>, f64)| {
        let arm = turn * place;
        let mut grain = Grain::at_rest(at + arm, radius, DENSITY);
        grain.velocity = velocity + spin.cross(&arm);
        grain.spin = spin;
        grain
    };
    balls.iter().map(grain).collect()
}

/// Clumps of so many grains each, one after the other, from a number on.
pub fn rows_of(first: u32, count: u32, each: u32) -> Vec<Clump> {
    let clump = |k: u32| Clump {
        grains: (first + k * each..first + (k + 1) * each).collect(),
        mass: None,
    };
    (0..count).map(clump).collect()
}

pub fn open_space() -> Domain {
    Domain {
        lower: Vector3::repeat(-1.0),
        upper: Vector3::repeat(1.0),
        periodic: [false; 3],
    }
}

pub fn setup(law: ContactLaw, grains: Vec<Grain>, timestep: f64) -> Setup {
    Setup {
        domain: open_space(),
        gravity: Vector3::zeros(),
        law: law.into(),
        grains,
        walls: Vec::new(),
        bodies: Vec::new(),
        timestep,
        threads: Threads::Serial,
    }
}

/// Any orientation, by number.
pub fn orientation(k: u32) -> UnitQuaternion<f64> {
    let k = f64::from(k);
    UnitQuaternion::from_euler_angles(1.3 * k + 0.3, 2.1 * k - 0.2, 0.7 * k + 0.9)
}
