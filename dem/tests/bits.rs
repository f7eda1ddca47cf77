//! The same bits for any number of threads, after a checkpoint, and for any numbering of grains.

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
        walls: vec![Wall::plane(
            Vector3::new(0.0, 0.0, bed().domain.lower.z),
            Vector3::z(),
        )],
        bodies: Vec::new(),
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
    // Nor does a change of threads on the way.
    let mut s = flowing(Threads::Serial);
    s.advance(1400).unwrap();
    s.energy();
    let changed = in_pool(2, move || {
        s.set_threads(Threads::Rayon);
        s.advance(1600).unwrap();
        s.state_hash()
    });
    assert_eq!(changed, serial.0);
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
    assert!(message.contains("grains/numbered"), "{message}");
    let mut other = setup(Threads::Serial);
    other.timestep *= 0.5;
    let message = Simulation::resume(other, &record).unwrap_err().to_string();
    assert!(
        message.contains("steps of 5e-4 s, not 2.5e-4 s"),
        "{message}"
    );
    let mut other = setup(Threads::Serial);
    if let Tangential::Linear(spring) = &mut other.law.own[0].tangential {
        spring.friction += 0.1;
    }
    let message = Simulation::resume(other, &record).unwrap_err().to_string();
    assert!(message.contains("materials 0 and 0"), "{message}");
    let mut other = setup(Threads::Serial);
    other.law.own[0].lever = Lever::Radius;
    let message = Simulation::resume(other, &record).unwrap_err().to_string();
    assert!(message.contains("law/kind"), "{message}");
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

/// Feeds grains in from above and takes out those that have left a window, in between stepping.
fn fed(threads: Threads, restart: bool) -> (String, Vector3<f64>, u32) {
    let mut s = flowing(threads);
    let (mut known, mut gone) = (s.grain_count() as u32, 0);
    for round in 0..6 {
        s.advance(150).unwrap();
        let top = s.domain().upper.z;
        let new: Vec<Grain> = (0..9)
            .map(|k| {
                let at = Vector3::new(1.33 * f64::from(k), 5.0, top + 1.0 + 2.0 * f64::from(round));
                let mut grain = Grain::at_rest(at, if k == 4 { 0.92 } else { 0.4 }, 1.0);
                grain.velocity = Vector3::new(1.0, 0.0, -1.0);
                grain
            })
            .collect();
        let ids = s.insert(&new).unwrap();
        assert_eq!(ids, known..known + 9);
        known += 9;
        s.advance(50).unwrap();
        gone += s.remove(|g| g.id % 37 == round && !g.fixed);
        if restart && round == 3 {
            let record = s.checkpoint();
            s = Simulation::resume(setup(threads), &record).unwrap();
        }
    }
    s.advance(300).unwrap();
    assert_eq!(s.grain_count(), known as usize - gone);
    assert!(gone > 100, "{gone}");
    assert!(s.momentum_error() < 1e-11, "{:e}", s.momentum_error());
    (s.state_hash(), s.wall_impulse(), known)
}

#[test]
fn grains_come_and_go_with_the_same_bits_for_any_threads_and_restarts() {
    let serial = fed(Threads::Serial, false);
    for threads in [1, 2] {
        let parallel = in_pool(threads, || fed(Threads::Rayon, false));
        assert_eq!(parallel, serial, "{threads}");
    }
    let resumed = fed(Threads::Serial, true);
    assert_eq!((&resumed.0, resumed.2), (&serial.0, serial.2));
}

#[test]
fn who_stays_keeps_contacts_and_histories() {
    let mut s = flowing(Threads::Serial);
    s.advance(400).unwrap();
    let springs = |s: &mut Simulation| {
        let record = s.checkpoint();
        let ids = record.counts("grains/id").unwrap();
        let pairs = record.counts("contacts/pair").unwrap();
        let histories = record.numbers("contacts/history").unwrap();
        let mut springs: Vec<_> = pairs
            .as_chunks::<2>()
            .0
            .iter()
            .zip(histories.chunks_exact(7))
            .map(|(&[i, j], h)| {
                let (a, b) = (ids[i as usize], ids[j as usize]);
                // Vectors of a against b turn round with their order.
                let sign = if a < b { 1.0 } else { -1.0 };
                let h: Vec<u64> = (0..7)
                    .map(|k| if k < 6 { sign * h[k] } else { h[k] }.to_bits())
                    .collect();
                (a.min(b), a.max(b), h)
            })
            .collect();
        springs.sort();
        springs
    };
    let before = springs(&mut s);
    assert!(before.len() > 1000, "{}", before.len());
    let removed = s.remove(|g| g.id % 10 == 3);
    assert!(removed > 100);
    let mut left = before;
    left.retain(|&(a, b, _)| a % 10 != 3 && b % 10 != 3);
    assert_eq!(springs(&mut s), left);
    let high = s.domain().upper + Vector3::new(-3.0, -3.0, 5.0);
    s.insert(&[Grain::at_rest(high, 0.5, 1.0)]).unwrap();
    assert_eq!(springs(&mut s), left);
}

#[test]
fn an_inserted_grain_falls_as_if_it_had_always_been_there() {
    let mut s = flowing(Threads::Serial);
    s.advance(10).unwrap();
    let (from, v) = (s.domain().upper + Vector3::new(-3.0, -3.0, 50.0), 2.0);
    let mut grain = Grain::at_rest(from, 0.5, 1.0);
    grain.velocity = Vector3::new(0.0, 0.0, v);
    let ids = s.insert(&[grain]).unwrap();
    s.advance(100).unwrap();
    let mut seen = Snapshot::default();
    s.snapshot(&mut seen);
    let grain = seen.grains.iter().find(|g| ids.contains(&g.id)).unwrap();
    let (t, g) = (100.0 * s.timestep(), s.gravity().z);
    let expected = from.z + v * t + 0.5 * g * t * t;
    // Leap-frog is exact under constant acceleration, if the first kick is half a step.
    assert!(
        (grain.position.z - expected).abs() < 1e-11,
        "{}",
        grain.position.z - expected
    );
    assert!((grain.velocity.z - v - g * t).abs() < 1e-12);
    let bad = Grain::at_rest(from, -1.0, 1.0);
    assert!(s.insert(&[bad]).unwrap_err().to_string().contains("radius"));
    let wide = Grain::at_rest(from, 4.0, 1.0);
    assert!(
        s.insert(&[wide])
            .unwrap_err()
            .to_string()
            .contains("periodic")
    );
}
