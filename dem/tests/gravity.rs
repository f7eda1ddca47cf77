//! Gravity that changes with time and place: orbits, accounts, restarts.

use crate::world::laws;
use colluvium_dem::*;
use nalgebra::{Rotation3, Vector3};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use std::f64::consts::TAU;

fn space(grains: Vec<Grain>, timestep: f64, threads: Threads) -> Setup {
    Setup {
        domain: Domain {
            lower: Vector3::repeat(-5.0),
            upper: Vector3::repeat(5.0),
            periodic: [false; 3],
        },
        gravity: Vector3::zeros(),
        law: laws()[0].1.into(),
        grains,
        walls: Vec::new(),
        bodies: Vec::new(),
        timestep,
        threads,
    }
}

fn seen(simulation: &mut Simulation) -> Vec<GrainSample> {
    let mut snapshot = Snapshot::default();
    simulation.snapshot(&mut snapshot);
    snapshot.grains.sort_by_key(|g| g.id);
    snapshot.grains
}

/// How far from its start a grain is after one turn of an ellipse of Kepler with e = 0.5, over its size.
fn miss(steps: u64) -> f64 {
    let (mu, apart, e) = (2.0, 3.0, 0.5);
    let major = apart / (1.0 + e);
    let period = TAU * f64::sqrt(major * major * major / mu);
    let mut grain = Grain::at_rest(Vector3::new(apart, 0.2, -0.1), 0.05, 1000.0);
    grain.velocity.y = f64::sqrt(mu / major * (1.0 - e) / (1.0 + e)) * 0.6;
    grain.velocity.z = f64::sqrt(mu / major * (1.0 - e) / (1.0 + e)) * 0.8;
    let setup = space(vec![grain], period / steps as f64, Threads::Serial);
    let mut simulation = Simulation::new(setup).unwrap();
    let sphere = HeavySphere {
        center: Vector3::new(0.0, 0.2, -0.1),
        parameter: mu,
        radius: 0.5,
    };
    simulation.set_heavy_sphere(Some(sphere)).unwrap();
    simulation.open_energy_ledger();
    simulation.advance(steps / 2).unwrap();
    let half = seen(&mut simulation)[0].position - sphere.center;
    assert!((half.norm() - apart / 3.0).abs() < 0.02 * apart, "{half}");
    simulation.advance(steps - steps / 2).unwrap();
    let ledger = simulation.energy_ledger().unwrap();
    assert!(ledger.error() < 1e-12, "{:e}", ledger.error());
    assert!(ledger.fields.gained().abs() < 1e-2 * ledger.kinetic);
    assert!(simulation.momentum_error() < 1e-11);
    (seen(&mut simulation)[0].position - grain.position).norm() / apart
}

#[test]
fn an_orbit_of_kepler_closes_with_the_square_of_the_step() {
    let (coarse, fine) = (miss(1000), miss(4000));
    assert!(fine < 1e-4, "{fine:e}");
    let order = (coarse / fine).log2() / 2.0;
    assert!((1.8..2.2).contains(&order), "order {order}");
}

/// Two bonded clumps of 27 grains on a circle about each other: where they are after one turn.
fn clumps(opening: f64) -> (f64, TreeError) {
    let (radius, apart): (f64, f64) = (0.05, 2.0);
    let spacing = 2.0 * radius * 1.001;
    let mut grains = Vec::new();
    for side in [-1.0, 1.0] {
        for k in 0..27_i32 {
            let cell = Vector3::new(k % 3, k / 3 % 3, k / 9).map(|c| f64::from(c) - 1.0);
            let at = 0.5 * side * apart * Vector3::x() + spacing * cell;
            grains.push(Grain::at_rest(at, radius, 1000.0));
        }
    }
    let mass = 27.0 * grains[0].mass();
    let constant = 1e-3;
    // Cubes attract like points but for a hexadecapole: 1e-4 here.
    let rate = f64::sqrt(constant * 2.0 * mass / apart.powi(3));
    for grain in &mut grains {
        grain.spin = rate * Vector3::z();
        grain.velocity = grain.spin.cross(&grain.position);
    }
    let steps = 40_000_u32;
    let mut simulation = Simulation::new(space(
        grains,
        TAU / rate / f64::from(steps),
        Threads::Serial,
    ))
    .unwrap();
    simulation
        .bond(&BondRule {
            cement: Cement {
                radius_ratio: 0.5,
                tensile_strength: f64::INFINITY,
                shear_strength: f64::INFINITY,
                ..Cement::sinter(1e5)
            },
            gap: 0.1,
            materials: Vec::new(),
            within: Region::Everywhere,
        })
        .unwrap();
    let own = SelfGravity { constant, opening };
    simulation.set_self_gravity(Some(own)).unwrap();
    simulation.open_energy_ledger();
    let start = simulation.clusters();
    simulation.advance(steps.into()).unwrap();
    let ledger = simulation.energy_ledger().unwrap();
    assert!(ledger.error() < 1e-11, "{:e}", ledger.error());
    let made = ledger.fields.gained().abs() / ledger.fields.potential.abs();
    assert!(made < 1e-4, "{made:e} of the potential energy");
    assert!(simulation.momentum_error() < 1e-10);
    let end = simulation.clusters();
    assert_eq!([start.list.len(), end.list.len()], [2, 2]);
    let off = (end.list[0].center - start.list[0].center).norm() / apart;
    (off, simulation.self_gravity_error(usize::MAX).unwrap())
}

#[test]
fn two_clumps_close_their_orbit_by_the_tree() {
    // Each clump acts on the other as a whole, its own grains on each other one by one.
    let (off, error) = clumps(0.2);
    assert!(error.rms > 0.0, "the tree must have approximated");
    assert!(error.rms < 1e-3 && error.net_force < 1e-3, "{error:?}");
    assert!(off < 2e-3, "{off:e}");
    // What is left of it comes from their shapes, not from the tree.
    let (direct, error) = clumps(0.0);
    assert!(error.rms < 1e-13, "{error:?}");
    assert!((direct - off).abs() < 1e-3, "{direct:e} {off:e}");
}

#[test]
fn two_grains_close_their_orbit_and_leave_their_centre_where_it_is() {
    let apart = 1.0;
    let mut grains = [-0.25, 0.75]
        .map(|x| Grain::at_rest(Vector3::x() * x * apart, 0.05, 1000.0))
        .to_vec();
    grains[0].density = 3000.0;
    let masses = [grains[0].mass(), grains[1].mass()];
    let constant = 0.2;
    let rate = f64::sqrt(constant * (masses[0] + masses[1]) / apart);
    for grain in &mut grains {
        grain.velocity = rate * Vector3::z().cross(&grain.position);
    }
    let miss = |steps: u64| {
        let step = TAU / rate / steps as f64;
        let mut simulation = Simulation::new(space(grains.clone(), step, Threads::Serial)).unwrap();
        let own = SelfGravity {
            constant,
            opening: 0.5,
        };
        simulation.set_self_gravity(Some(own)).unwrap();
        simulation.advance(steps).unwrap();
        let now = seen(&mut simulation);
        let center = masses[0] * now[0].position + masses[1] * now[1].position;
        assert!(center.norm() < 1e-10 * masses[1]);
        (now[0].position - grains[0].position).norm() / apart
    };
    let (coarse, fine) = (miss(500), miss(2000));
    assert!(fine < 1e-5, "{fine:e}");
    assert!(
        (coarse / fine / 16.0 - 1.0).abs() < 0.1,
        "{coarse:e} {fine:e}"
    );
}

#[test]
fn gravity_follows_its_schedule() {
    let tilted = |degrees: f64| {
        Rotation3::from_axis_angle(&Vector3::y_axis(), degrees.to_radians()) * Vector3::z() * -2.0
    };
    let points = vec![(0.1, tilted(0.0)), (0.3, tilted(30.0)), (0.4, tilted(10.0))];
    let schedule = Schedule::new(points).unwrap();
    assert_eq!(schedule.at(-1.0), tilted(0.0));
    assert_eq!(schedule.at(9.0), tilted(10.0));
    assert!((schedule.at(0.2) - 0.5 * (tilted(0.0) + tilted(30.0))).norm() < 1e-15);
    let step = 1e-3;
    let setup = || {
        space(
            vec![Grain::at_rest(Vector3::zeros(), 0.05, 1000.0)],
            step,
            Threads::Serial,
        )
    };
    let mut simulation = Simulation::new(setup()).unwrap();
    simulation.set_gravity_schedule(Some(schedule.clone()));
    simulation.open_energy_ledger();
    simulation.advance(250).unwrap();
    let record = simulation.checkpoint();
    simulation = Simulation::resume(setup(), &record).unwrap();
    simulation.advance(250).unwrap();
    // Velocities are the trapezoids of gravity: exact on its straight lines.
    let mut expected = 0.1 * tilted(0.0) + 0.1 * tilted(10.0);
    expected += 0.1 * (tilted(0.0) + tilted(30.0)) + 0.05 * (tilted(30.0) + tilted(10.0));
    let grain = seen(&mut simulation)[0];
    assert!(
        (grain.velocity - expected).norm() < 1e-12,
        "{}",
        grain.velocity - expected
    );
    let ledger = simulation.energy_ledger().unwrap();
    assert!(ledger.error() < 1e-12 && simulation.momentum_error() < 1e-12);
    simulation.set_gravity(Vector3::zeros()).unwrap();
    let odd = simulation.set_gravity(Vector3::x() * f64::NAN).unwrap_err();
    assert!(odd.to_string().contains("gravity[0]"), "{odd}");
    simulation.advance(1).unwrap();
    assert_eq!(simulation.gravity(), Vector3::zeros());
}

#[test]
fn bad_fields_are_refused_with_their_key() {
    let grain = Grain::at_rest(Vector3::zeros(), 0.05, 1000.0);
    let setup = space(vec![grain], 1e-3, Threads::Serial);
    let mut simulation = Simulation::new(setup.clone()).unwrap();
    let own = SelfGravity::newton();
    let wide = SelfGravity {
        opening: 1.0,
        ..own
    };
    let error = simulation
        .set_self_gravity(Some(wide))
        .unwrap_err()
        .to_string();
    assert!(error.contains("gravity.opening = 1"), "{error}");
    let mut sphere = HeavySphere {
        center: Vector3::zeros(),
        parameter: 1.0,
        radius: -1.0,
    };
    let error = simulation
        .set_heavy_sphere(Some(sphere))
        .unwrap_err()
        .to_string();
    assert!(error.contains("gravity.sphere.radius"), "{error}");
    sphere.radius = 0.0;
    let mut periodic = setup;
    periodic.domain.periodic[1] = true;
    let mut simulation = Simulation::new(periodic).unwrap();
    assert!(simulation.set_heavy_sphere(Some(sphere)).is_err());
    assert!(simulation.set_self_gravity(Some(own)).is_err());
    let back = vec![(1.0, Vector3::x()), (1.0, Vector3::x())];
    let error = Schedule::new(back).unwrap_err().to_string();
    assert!(error.contains("gravity.schedule[1].time = 1"), "{error}");
    assert!(Schedule::new(Vec::new()).is_err());
}

/// A cloud that falls together under its own weight onto a heavy sphere.
fn collapse(threads: Threads) -> (Setup, SelfGravity, HeavySphere) {
    let mut random = ChaCha8Rng::seed_from_u64(4);
    let mut grains = Vec::new();
    for k in 0..1200 {
        let cell = Vector3::new(k % 11, k / 11 % 11, k / 121).map(f64::from);
        let jitter = Vector3::from_fn(|_, _| random.random_range(-0.01..0.01));
        let mut grain = Grain::at_rest(0.13 * cell + jitter, 0.05, 1000.0);
        grain.fixed = k % 200 == 7;
        grains.push(grain);
    }
    let own = SelfGravity {
        constant: 4e-3,
        opening: 0.6,
    };
    let sphere = HeavySphere {
        center: Vector3::repeat(0.7),
        parameter: 0.5,
        radius: 0.3,
    };
    (space(grains, 1e-4, threads), own, sphere)
}

#[test]
fn a_collapse_keeps_its_accounts_over_restarts_and_threads() {
    let begun = |threads| {
        let (setup, own, sphere) = collapse(threads);
        let mut simulation = Simulation::new(setup).unwrap();
        simulation.set_self_gravity(Some(own)).unwrap();
        simulation.set_heavy_sphere(Some(sphere)).unwrap();
        simulation
    };
    let mut whole = begun(Threads::Serial);
    whole.open_energy_ledger();
    whole.advance(1200).unwrap();
    assert!(whole.list_builds() > 2);
    let ledger = whole.energy_ledger().unwrap();
    assert!(ledger.error() < 1e-11, "{:e}", ledger.error());
    assert!(ledger.fields.work > 0.5 * ledger.kinetic);
    let made = ledger.fields.gained().abs() / ledger.fields.work;
    assert!(made < 1e-2, "{made:e}");
    assert!(
        whole.momentum_error() < 1e-10,
        "{:e}",
        whole.momentum_error()
    );

    let pool = rayon::ThreadPoolBuilder::new()
        .num_threads(3)
        .build()
        .unwrap();
    let other = pool.install(|| {
        let mut first = begun(Threads::Rayon);
        first.advance(555).unwrap();
        let record = first.checkpoint();
        let (setup, ..) = collapse(Threads::Rayon);
        let mut second = Simulation::resume(setup, &record).unwrap();
        second.advance(645).unwrap();
        second.state_hash()
    });
    assert_eq!(whole.state_hash(), other);
}
