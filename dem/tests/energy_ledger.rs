//! The energy ledger: closed to round-off, and no channel creates energy.

#![allow(clippy::unwrap_used)]

use colluvium_dem::*;
use nalgebra::Vector3;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

const MATERIAL: Elasticity = Elasticity {
    youngs_modulus: 1e6,
    poissons_ratio: 0.3,
};

/// One law of each kind that a scene may compose.
fn laws() -> Vec<(&'static str, ContactLaw)> {
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

/// A random cloud that falls on a floor between walls of a periodic box; one grain is moved by hand.
fn cloud(law: ContactLaw, timestep: f64) -> Simulation {
    Simulation::new(setup(law, timestep)).unwrap()
}

fn setup(law: ContactLaw, timestep: f64) -> Setup {
    let mut random = ChaCha8Rng::seed_from_u64(3);
    let mut grains = Vec::new();
    for k in 0..240 {
        let cell = Vector3::new((k % 6) as f64, (k / 6 % 5) as f64, (k / 30) as f64);
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
            upper: Vector3::new(0.69, 0.575, 1.5),
            periodic: [true, true, false],
        },
        gravity: Vector3::new(2.0, 0.0, -9.81),
        law: law.into(),
        grains,
        planes: vec![Plane {
            point: Vector3::zeros(),
            normal: Vector3::z(),
            material: 0,
        }],
        timestep,
        threads: Threads::Serial,
    }
}

#[test]
fn every_joule_is_accounted_for_under_every_law() {
    for (name, law) in laws() {
        let mut simulation = cloud(law, 5e-5);
        simulation.open_energy_ledger();
        simulation.advance(6_000).unwrap();
        let record = simulation.checkpoint();
        let mut simulation = Simulation::resume(setup(law, 5e-5), &record).unwrap();
        simulation.advance(6_000).unwrap();
        let ledger = simulation.energy_ledger().unwrap();
        assert!(ledger.error() < 1e-11, "{name}: {:e}", ledger.error());
        assert!(ledger.drive != 0.0, "{name}: the paddle works");
        assert!(ledger.gravity > 1.0, "{name}");
        let lost = ledger.dissipated();
        // A channel may be off by the step's own error, not more.
        let slack = 2e-3 * lost.sum();
        for (channel, lost) in [
            ("normal", lost.normal),
            ("tangential", lost.tangential),
            ("rolling", lost.rolling),
            ("twisting", lost.twisting),
        ] {
            assert!(lost > -slack, "{name}: {channel} created {:e} J", -lost);
        }
        assert!(lost.normal > 0.05 * lost.sum(), "{name}: {lost:?}");
        assert!(lost.tangential > 0.05 * lost.sum(), "{name}: {lost:?}");
        assert_eq!(lost.rolling != 0.0, law.rolling != Rolling::None, "{name}");
    }
}

#[test]
fn without_dashpots_and_friction_nothing_is_lost() {
    let law = ContactLaw {
        tangential: Tangential::None,
        ..ContactLaw::hertz_mindlin(MATERIAL, 1.0, 0.0)
    };
    let lost = |timestep: f64| {
        let mut simulation = cloud(law, timestep);
        // Opened under way, half a kick of the next step lies before it.
        simulation.advance(10).unwrap();
        simulation.open_energy_ledger();
        simulation.advance((0.3 / timestep) as u64).unwrap();
        let ledger = simulation.energy_ledger().unwrap();
        assert!(ledger.error() < 1e-11, "{:e}", ledger.error());
        ledger.dissipated().normal / ledger.kinetic
    };
    let (coarse, fine) = (lost(4e-5).abs(), lost(1e-5).abs());
    assert!(fine < 1e-5, "{fine:e}");
    assert!(
        fine < 0.3 * coarse,
        "falls with the step: {coarse:e} to {fine:e}"
    );
}
