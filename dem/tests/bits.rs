//! The same bits for any number of threads, after a checkpoint, and for any numbering of grains.

#![allow(clippy::unwrap_used)]

use colluvium_dem::preparation::{Bed, InclineBed, RadiusLaw, settle_incline_bed};
use colluvium_dem::*;
use nalgebra::Vector3;
use std::ops::ControlFlow;
use std::sync::OnceLock;

fn law() -> ContactLaw {
    ContactLaw::linear(
        Hooke::matched(2e4, 0.5),
        TangentialSpring::matched(2.0 / 7.0, 0.5, 1.0),
        Some(ShapeParameter {
            beta: 0.2,
            rolling_friction: 1.05,
            twisting_friction: 1.3,
        }),
    )
}

/// 1 500 grains: enough for a step to be split over threads.
fn bed() -> &'static Bed {
    static BED: OnceLock<Bed> = OnceLock::new();
    BED.get_or_init(|| {
        let spec = InclineBed {
            grains: 1500,
            radius: RadiusLaw::Gaussian {
                mean: 0.5,
                relative_deviation: 0.1,
                cut: 1.0,
            },
            density: 6.0 / std::f64::consts::PI,
            length: 12.0,
            width: 10.0,
            law: law(),
            gravity: 1.0,
            timestep: 5e-4,
            seed: 5,
        };
        settle_incline_bed(&spec, Threads::Serial, &mut |_| ControlFlow::Continue(())).unwrap()
    })
}

fn setup(threads: Threads) -> Setup {
    let slope = 33_f64.to_radians();
    Setup {
        domain: bed().domain,
        gravity: Vector3::new(slope.sin(), 0.0, -slope.cos()),
        law: law().into(),
        grains: bed().grains.clone(),
        planes: vec![Plane {
            point: Vector3::new(0.0, 0.0, bed().domain.lower.z),
            normal: Vector3::z(),
            material: 0,
        }],
        timestep: 5e-4,
        threads,
    }
}

/// A sheared flow from the first step, so that lists are rebuilt and contacts change hands.
fn flowing(threads: Threads) -> Simulation {
    let mut s = Simulation::new(setup(threads)).unwrap();
    s.give_velocity(|g| Vector3::new(1.2 * g.position.z, 0.0, 0.0));
    s
}

fn in_pool<T: Send>(threads: usize, work: impl FnOnce() -> T + Send) -> T {
    rayon::ThreadPoolBuilder::new()
        .num_threads(threads)
        .build()
        .unwrap()
        .install(work)
}

#[test]
fn threads_do_not_change_a_bit() {
    let run = |threads| {
        let mut s = flowing(threads);
        s.advance(3000).unwrap();
        assert!(
            s.list_builds() > 5,
            "lists must have been rebuilt: {}",
            s.list_builds()
        );
        (s.state_hash(), s.wall_impulse())
    };
    let serial = run(Threads::Serial);
    for threads in [1, 2, 3] {
        assert_eq!(in_pool(threads, || run(Threads::Rayon)), serial);
    }
    // The hash must see a change of one bit of state.
    let mut s = flowing(Threads::Serial);
    s.advance(2999).unwrap();
    assert_ne!(s.state_hash(), serial.0);
}

#[test]
fn a_checkpoint_goes_on_with_the_same_bits() {
    let mut whole = flowing(Threads::Serial);
    whole.advance(1500).unwrap();
    let mut snapshot = Snapshot::default();
    let mut part = flowing(Threads::Serial);
    part.advance(777).unwrap();
    // Looking must change nothing, before and after a checkpoint is taken.
    part.snapshot(&mut snapshot);
    let record = part.checkpoint();
    part.energy();
    let mut resumed = Simulation::resume(setup(Threads::Serial), &record).unwrap();
    assert_eq!(resumed.state_hash(), part.state_hash());
    resumed.advance(723).unwrap();
    part.advance(723).unwrap();
    assert_eq!(part.state_hash(), whole.state_hash());
    assert_eq!(resumed.state_hash(), whole.state_hash());
    assert_eq!(resumed.steps_done(), 1500);
}

#[test]
fn a_foreign_checkpoint_is_refused() {
    let mut s = flowing(Threads::Serial);
    let record = s.checkpoint();
    let mut other = setup(Threads::Serial);
    other.grains.pop();
    let message = Simulation::resume(other, &record).unwrap_err().to_string();
    assert!(message.contains("grains/place"), "{message}");
    for name in record.numbers.keys() {
        let mut damaged = record.clone();
        damaged.numbers.remove(name);
        let message = Simulation::resume(setup(Threads::Serial), &damaged)
            .unwrap_err()
            .to_string();
        assert!(message.contains(name), "{name}: {message}");
    }
}

#[test]
fn the_numbering_of_grains_does_not_matter() {
    // The bits may differ (sums change order); the motion may not.
    let run = |reverse: bool| {
        let mut setup = setup(Threads::Serial);
        if reverse {
            setup.grains.reverse();
        }
        let mut s = Simulation::new(setup).unwrap();
        s.give_velocity(|g| Vector3::new(1.2 * g.position.z, 0.0, 0.0));
        s.advance(100).unwrap();
        s.energy()
    };
    let (a, b) = (run(false), run(true));
    assert!((a.translation / b.translation - 1.0).abs() < 1e-9);
    assert!((a.rotation / b.rotation - 1.0).abs() < 1e-8);
    assert!((a.rolling / b.rolling - 1.0).abs() < 1e-6, "{a:?} {b:?}");
    assert!((a.twisting / b.twisting - 1.0).abs() < 1e-6);
}

#[test]
fn walls_and_gravity_account_for_all_momentum() {
    let mut s = flowing(Threads::Serial);
    s.advance(1).unwrap();
    let weight = s.free_mass() * s.gravity();
    let before = s.leapfrog_momentum() + s.wall_impulse();
    s.advance(2000).unwrap();
    let after = s.leapfrog_momentum() + s.wall_impulse();
    let given = weight * (2000.0 * s.timestep());
    let error = (after - before - given).norm() / given.norm();
    assert!(error < 1e-11, "{error:e}");
    assert!(s.momentum_error() < 1e-12, "{:e}", s.momentum_error());
    // Without what the base took the balance must fail.
    assert!((s.leapfrog_momentum() - before - given).norm() / given.norm() > 0.1);
}

#[test]
fn a_step_that_is_too_long_is_reported() {
    let mut setup = setup(Threads::Serial);
    setup.timestep = 0.05;
    let mut s = Simulation::new(setup).unwrap();
    let error = s.advance(20_000).unwrap_err();
    assert!(error.to_string().contains("time step of 5e-2 s"), "{error}");
}
