//! One law of each kind, and a world that exercises them: shared by the tests beside this folder.

use colluvium_dem::*;
use nalgebra::Vector3;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

pub const MATERIAL: Elasticity = Elasticity {
    youngs_modulus: 1e6,
    poissons_ratio: 0.3,
};

/// One law of each kind that a scene may compose.
pub fn laws() -> Vec<(&'static str, ContactLaw)> {
    let shape = ShapeParameter {
        beta: 0.3,
        rolling_friction: 1.05,
        twisting_friction: 1.3,
    };
    let epsd = Rolling::Epsd(Epsd {
        rolling_friction: 0.2,
        damping_ratio: 0.3,
    });
    let hooke = Hooke::matched(2e3, 0.6);
    let spring = TangentialSpring::matched(2.0 / 7.0, 0.6, 0.5);
    let linear = ContactLaw::linear(hooke, spring, None);
    let hertz = ContactLaw::hertz_mindlin(MATERIAL, 0.6, 0.5);
    let viscoelastic = ContactLaw {
        normal: Normal::Viscoelastic(Viscoelastic::of(MATERIAL, 1e-4)),
        ..hertz
    };
    let jkr = ContactLaw::adhesive(Jkr {
        surface_energy: 2.0,
        elasticity: MATERIAL,
        damping_rate: 1.0,
        critical_rolling: 2e-4,
    });
    let dmt = Cohesion::Dmt {
        work_of_adhesion: 2.0,
        asperity_radius: None,
    };
    vec![
        ("linear", linear),
        (
            "linear, shape springs",
            ContactLaw::linear(hooke, spring, Some(shape)),
        ),
        (
            "linear, EPSD",
            ContactLaw {
                rolling: epsd,
                ..linear
            },
        ),
        ("Hertz–Mindlin", hertz),
        (
            "Hertz–Mindlin, EPSD, DMT",
            ContactLaw {
                rolling: epsd,
                cohesion: dmt,
                ..hertz
            },
        ),
        (
            "Hertz–Mindlin, shape springs",
            ContactLaw {
                rolling: Rolling::Shape(shape),
                ..hertz
            },
        ),
        ("viscoelastic", viscoelastic),
        ("JKR", jkr),
    ]
}

/// A random cloud over a floor in a periodic box; one grain is moved by hand.
pub fn setup(law: ContactLaw, grains: usize, timestep: f64) -> Setup {
    let mut random = ChaCha8Rng::seed_from_u64(3);
    let across = ((grains as f64 / 8.0).sqrt() as usize).max(4);
    let count = grains;
    let mut grains = Vec::new();
    for k in 0..count {
        let cell = [k % across, k / across % across, k / (across * across)];
        let cell = Vector3::from_fn(|axis, _| cell[axis] as f64);
        let jitter = Vector3::from_fn(|_, _| random.random_range(-0.02..0.02));
        let radius = random.random_range(0.035..0.05);
        let mut grain = Grain::at_rest(
            (cell + Vector3::repeat(0.55)) * 0.115 + jitter * 0.3,
            radius,
            1000.0,
        );
        grain.velocity = Vector3::from_fn(|_, _| random.random_range(-0.5..0.5));
        grain.spin = Vector3::from_fn(|_, _| random.random_range(-5.0..5.0));
        grains.push(grain);
    }
    let mut paddle = Grain::at_rest(Vector3::new(0.05, 0.3, 0.5), 0.05, 1000.0);
    paddle.fixed = true;
    paddle.velocity = Vector3::new(0.4, 0.0, 0.0);
    grains.retain(|g| (g.position - paddle.position).norm() > 0.11);
    grains.push(paddle);
    Setup {
        domain: Domain {
            lower: Vector3::zeros(),
            upper: Vector3::new(0.115 * across as f64, 0.115 * across as f64, 1.5),
            periodic: [true, true, false],
        },
        gravity: Vector3::new(2.0, 0.0, -9.81),
        law: law.into(),
        grains,
        walls: vec![Wall::plane(Vector3::zeros(), Vector3::z())],
        bodies: Vec::new(),
        timestep,
        threads: Threads::Serial,
    }
}
