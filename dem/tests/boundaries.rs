//! Boundaries that move, and boundaries that let grains go.

use crate::world::laws;
use colluvium_dem::*;
use nalgebra::Vector3;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

const RADIUS: f64 = 0.05;
const STEP: f64 = 5e-5;

/// Grains on a loose lattice in a periodic box, each with a random velocity.
fn cloud(across: i32, spacing: f64, speed: f64, law: ContactLaw) -> Setup {
    let mut random = ChaCha8Rng::seed_from_u64(8);
    let count = across.pow(3);
    let grains = (0..count).map(|k| {
        let cell = Vector3::new(k % across, k / across % across, k / across.pow(2));
        let jitter = Vector3::from_fn(|_, _| random.random_range(-0.5..0.5));
        let at = cell.map(|c| f64::from(c) + 0.5) * spacing + (spacing - 2.0 * RADIUS) * jitter;
        let mut grain = Grain::at_rest(at, RADIUS, 1000.0);
        grain.velocity = speed * Vector3::from_fn(|_, _| random.random_range(-1.0..1.0));
        grain
    });
    Setup {
        grains: grains.collect(),
        domain: Domain {
            lower: Vector3::zeros(),
            upper: Vector3::repeat(f64::from(across) * spacing),
            periodic: [true; 3],
        },
        gravity: Vector3::zeros(),
        law: law.into(),
        walls: Vec::new(),
        bodies: Vec::new(),
        timestep: STEP,
        threads: Threads::Serial,
    }
}

fn samples(simulation: &mut Simulation) -> Vec<GrainSample> {
    let mut seen = Snapshot::default();
    simulation.snapshot(&mut seen);
    seen.grains.sort_by_key(|g| g.id);
    seen.grains
}

fn shear(across: usize, rate: f64, carry: bool) -> BoxMotion {
    BoxMotion::Shear {
        across,
        rate,
        carry,
    }
}

fn stretch(speeds: [f64; 3], carry: bool) -> BoxMotion {
    let edges = speeds.map(|v| if v == 0.0 { Edge::Rest } else { Edge::Speed(v) });
    BoxMotion::Stretch { edges, carry }
}

/// Velocity that a uniform motion of the box has at a place, over its distance from the centre.
fn stream(motion: &BoxMotion, size: f64, away: &Vector3<f64>) -> Vector3<f64> {
    match motion {
        BoxMotion::Shear { across, rate, .. } => Vector3::x() * *rate * away[*across],
        _ => Vector3::x() * (3.0 / size * away.x),
    }
}

/// The same world seen from another box: moved along all axes, with the velocities that belong there.
fn moved_world(motion: &BoxMotion, by: Vector3<f64>) -> Vec<GrainSample> {
    let mut simulation = in_moved_world(motion, by);
    simulation.advance(1000).unwrap();
    assert!(simulation.list_builds() > 2);
    samples(&mut simulation)
}

fn in_moved_world(motion: &BoxMotion, by: Vector3<f64>) -> Simulation {
    let mut setup = cloud(6, 0.12, 1.0, laws()[5].1);
    let size = setup.domain.upper.x;
    let center = Vector3::repeat(0.5 * size);
    for grain in &mut setup.grains {
        grain.velocity += stream(motion, size, &(grain.position - center));
    }
    for grain in &mut setup.grains {
        let at = grain.position + by;
        let inside = at.map(|x| x.rem_euclid(size));
        // What is seen at another place moves as the box does there.
        grain.velocity += stream(motion, size, &(by + inside - at));
        grain.position = inside;
    }
    let mut simulation = Simulation::new(setup).unwrap();
    simulation.set_box_motion(motion.clone()).unwrap();
    simulation
}

#[test]
fn contacts_across_a_moving_boundary_are_those_inside_the_box() {
    for motion in [
        shear(2, 8.0, false),
        shear(1, -8.0, false),
        stretch([3.0, 0.0, 0.0], false),
    ] {
        let by = Vector3::new(0.31, 0.23, 0.37);
        let (here, there) = (
            moved_world(&motion, Vector3::zeros()),
            moved_world(&motion, by),
        );
        let size = 0.72;
        let spun = here.iter().filter(|g| g.spin.norm() > 0.1).count();
        assert!(spun > 100, "grains must have met: {spun}");
        for (a, b) in here.iter().zip(&there) {
            assert!(
                (a.spin - b.spin).norm() < 1e-6,
                "{motion:?}: {} {}",
                a.spin,
                b.spin
            );
            let change = b.velocity - a.velocity;
            let place = b.position - a.position;
            let expected = match &motion {
                BoxMotion::Shear { .. } => stream(&motion, size, &place),
                _ => Vector3::x() * (3.0 / (size + 3.0 * 0.05) * place.x),
            };
            assert!(
                (change - expected).norm() < 1e-6,
                "{motion:?}: {change} {expected}"
            );
        }
    }
}

/// All images of a sheared box that stretches are alike: the world does not know where the box begins.
#[test]
fn a_box_that_was_sheared_stretches_its_offset_too() {
    let run = |by: Vector3<f64>| {
        let mut simulation = in_moved_world(&shear(2, 8.0, false), by);
        simulation.advance(400).unwrap();
        simulation
            .set_box_motion(stretch([-6.0, 0.0, 2.0], true))
            .unwrap();
        simulation.advance(500).unwrap();
        samples(&mut simulation)
    };
    let (here, there) = (run(Vector3::zeros()), run(Vector3::new(0.31, 0.23, 0.37)));
    let spun = here.iter().filter(|g| g.spin.norm() > 0.1).count();
    assert!(spun > 100, "grains must have met: {spun}");
    let off = here
        .iter()
        .zip(&there)
        .map(|(a, b)| (a.spin - b.spin).norm());
    let off = off.fold(0.0, f64::max);
    println!("spins in two boxes: {off:.1e}");
    assert!(off < 1e-6, "{off:e}");
}

#[test]
fn lees_and_edwards_keep_a_uniform_shear() {
    let dissipative = ContactLaw::linear(
        Hooke::matched(2e4, 0.6),
        TangentialSpring::matched(2.0 / 7.0, 0.6, 0.3),
        None,
    );
    let setup = cloud(8, 0.108, 0.1, dissipative);
    let (size, rate) = (setup.domain.upper.z, 4.0);
    let mut simulation = Simulation::new(setup).unwrap();
    simulation.set_box_motion(shear(2, rate, true)).unwrap();
    simulation.open_energy_ledger();
    simulation.advance(5000).unwrap();
    let before = simulation.energy_ledger().unwrap().boundary;
    let (mut slope, mut weight, mut layers) = (0.0, 0.0, [[0.0; 2]; 4]);
    let mut work = 0.0;
    for _ in 0..150 {
        simulation.advance(100).unwrap();
        work += simulation.stress().m13 * rate * size.powi(3) * 100.0 * STEP;
        for grain in samples(&mut simulation) {
            let z = grain.position.z - 0.5 * size;
            slope += z * grain.velocity.x;
            weight += z * z;
            let layer = &mut layers[((z / size + 0.5) * 4.0) as usize];
            layer[0] += grain.velocity.x - rate * z;
            layer[1] += 1.0;
        }
    }
    let slope = slope / weight / rate;
    assert!((slope - 1.0).abs() < 0.02, "{slope} of the rate");
    for [sum, count] in layers {
        assert!(
            (sum / count).abs() < 0.02 * rate * size,
            "no layer slips: {}",
            sum / count
        );
    }
    let ledger = simulation.energy_ledger().unwrap();
    assert!(ledger.error() < 1e-11, "{:e}", ledger.error());
    assert!(
        simulation.momentum_error() < 1e-10,
        "{:e}",
        simulation.momentum_error()
    );
    // The boundary works as the mean stress of the box says, sampled 150 times.
    let given = ledger.boundary - before;
    assert!(
        given > 0.0 && (work / given - 1.0).abs() < 0.05,
        "{work} {given}"
    );
}

/// A bonded row right round the box.
fn ring(speed: f64, carry: bool) -> (Simulation, f64, f64) {
    let spacing = 2.0 * RADIUS * 1.001;
    let grains = (0..10).map(|k| {
        let at = Vector3::new(spacing * (f64::from(k) + 0.3), 0.3, 0.3);
        Grain::at_rest(at, RADIUS, 1000.0)
    });
    let length = 10.0 * spacing;
    let mut simulation = Simulation::new(Setup {
        grains: grains.collect(),
        domain: Domain {
            lower: Vector3::zeros(),
            upper: Vector3::new(length, 0.6, 0.6),
            periodic: [true; 3],
        },
        ..cloud(2, 0.2, 0.0, laws()[0].1)
    })
    .unwrap();
    let cement = Cement {
        radius_ratio: 0.5,
        tensile_strength: f64::INFINITY,
        shear_strength: f64::INFINITY,
        ..Cement::sinter(1e6)
    };
    simulation
        .bond(&BondRule {
            cement,
            gap: 0.1,
            materials: Vec::new(),
            within: Region::Everywhere,
        })
        .unwrap();
    simulation.open_energy_ledger();
    simulation
        .set_box_motion(stretch([speed, 0.0, 0.0], carry))
        .unwrap();
    (simulation, length, cement.section(RADIUS, RADIUS).axial)
}

#[test]
fn a_stretched_box_does_the_work_of_stress_times_rate() {
    let speed = 0.1;
    let (mut simulation, length, stiffness) = ring(speed, true);
    let steps = 4000;
    let mut work = 0.0;
    let area = 0.36;
    for _ in 0..steps {
        let before = simulation.stress().m11;
        simulation.advance(1).unwrap();
        work += 0.5 * (before + simulation.stress().m11) * area * speed * STEP;
    }
    let grown = speed * STEP * f64::from(steps);
    assert!((simulation.domain().lengths().x - length - grown).abs() < 1e-12);
    // Carried grains all bonds stretch alike: the row is a spring of a tenth of the stiffness.
    let stored = 0.5 * stiffness / 10.0 * grown * grown;
    let ledger = simulation.energy_ledger().unwrap();
    assert!(ledger.error() < 1e-12, "{:e}", ledger.error());
    assert!(
        (ledger.bonds.stored / stored - 1.0).abs() < 1e-9,
        "{}",
        ledger.bonds.stored
    );
    let given = ledger.boundary - ledger.kinetic;
    assert!((given / stored - 1.0).abs() < 1e-9, "{given} {stored}");
    // Trapezoids are exact for a force that grows in proportion, but for the volume's own change.
    assert!((work / stored - 1.0).abs() < 1e-3, "{work} {stored}");
    assert!(simulation.momentum_error() < 1e-12);
}

#[test]
fn only_the_boundary_moves_where_nobody_is_carried() {
    let (mut simulation, length, stiffness) = ring(1e-3, false);
    simulation.advance(1).unwrap();
    // Nobody moves but the image: the bond across alone is stretched.
    let ledger = simulation.energy_ledger().unwrap();
    let first = 1e-3 * STEP;
    let stored = 0.5 * stiffness * first * first;
    assert!(
        (ledger.bonds.stored / stored - 1.0).abs() < 1e-5,
        "{}",
        ledger.bonds.stored / stored
    );
    simulation.advance(100_000).unwrap();
    let ledger = simulation.energy_ledger().unwrap();
    assert!(ledger.error() < 1e-10, "{:e}", ledger.error());
    let grown = simulation.domain().lengths().x - length;
    let quasi_static = 0.5 * stiffness / 10.0 * grown * grown;
    assert!((ledger.bonds.stored / quasi_static - 1.0).abs() < 0.02);
    assert!((ledger.boundary / quasi_static - 1.0).abs() < 0.02);
}

#[test]
fn edges_follow_their_tables() {
    let setup = cloud(4, 0.15, 0.3, laws()[3].1);
    let mut simulation = Simulation::new(setup).unwrap();
    let points = vec![(0.01, 0.6), (0.02, 0.7), (0.03, 0.65)];
    let edges = [Edge::Rest, Edge::Lengths(points), Edge::Speed(0.5)];
    let motion = BoxMotion::Stretch { edges, carry: true };
    simulation.set_box_motion(motion).unwrap();
    simulation.open_energy_ledger();
    for (steps, y) in [
        (200, 0.6),
        (100, 0.65),
        (100, 0.7),
        (100, 0.675),
        (100, 0.65),
        (50, 0.65),
    ] {
        simulation.advance(steps).unwrap();
        let lengths = simulation.domain().lengths();
        assert!((lengths.y - y).abs() < 1e-12, "{} {y}", lengths.y);
        assert!((lengths.z - 0.6 - 0.5 * simulation.time()).abs() < 1e-12);
    }
    let ledger = simulation.energy_ledger().unwrap();
    assert!(ledger.error() < 1e-11 && simulation.momentum_error() < 1e-10);
    let rest = BoxMotion::Rest;
    simulation.set_box_motion(rest).unwrap();
    simulation.advance(10).unwrap();
    assert!((simulation.domain().lengths().y - 0.65).abs() < 1e-12);
}

fn servo() -> BoxMotion {
    BoxMotion::Servo(StressServo {
        pressure: 500.0,
        rate: 0.5,
        every: 20,
    })
}

fn soft() -> Setup {
    let law = ContactLaw::linear(
        Hooke::matched(2e3, 0.4),
        TangentialSpring::matched(2.0 / 7.0, 0.4, 0.1),
        None,
    );
    cloud(7, 0.11, 0.2, law)
}

#[test]
fn a_shrinking_box_comes_to_the_wanted_pressure() {
    let mut simulation = Simulation::new(soft()).unwrap();
    simulation.set_box_motion(servo()).unwrap();
    simulation.open_energy_ledger();
    simulation.advance(20_000).unwrap();
    let mut pressure = 0.0;
    for _ in 0..20 {
        simulation.advance(50).unwrap();
        pressure -= simulation.stress().trace() / 60.0;
    }
    assert!((pressure / 500.0 - 1.0).abs() < 0.01, "{pressure}");
    let volume = 343.0 * 4.0 / 3.0 * std::f64::consts::PI * RADIUS.powi(3);
    let share = volume / simulation.domain().lengths().product();
    assert!((0.58..0.70).contains(&share), "solid fraction {share}");
    let ledger = simulation.energy_ledger().unwrap();
    assert!(ledger.error() < 1e-10, "{:e}", ledger.error());
    assert!(simulation.momentum_error() < 1e-10);
    assert!(ledger.boundary > 0.0);
}

#[test]
fn moving_boxes_give_the_same_bits_over_restarts_and_threads() {
    for motion in [
        servo(),
        shear(2, 5.0, true),
        stretch([0.4, 0.0, -0.1], false),
    ] {
        let begun = |threads| {
            let mut simulation = Simulation::new(Setup { threads, ..soft() }).unwrap();
            simulation.set_box_motion(motion.clone()).unwrap();
            simulation
        };
        let mut whole = begun(Threads::Serial);
        whole.advance(2000).unwrap();
        assert!(whole.list_builds() > 2);
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(2)
            .build()
            .unwrap();
        let other = pool.install(|| {
            let mut first = begun(Threads::Rayon);
            first.advance(777).unwrap();
            first.stress();
            first.advance(100).unwrap();
            let record = first.checkpoint();
            let mut second = Simulation::resume(soft(), &record).unwrap();
            assert_eq!(second.box_motion(), &motion);
            second.advance(1123).unwrap();
            assert_eq!(second.domain(), whole.domain());
            second.state_hash()
        });
        assert_eq!(whole.state_hash(), other, "{motion:?}");
    }
}

#[test]
fn what_cannot_move_is_refused() {
    let refused = |setup: Setup, motion: BoxMotion| {
        let mut simulation = Simulation::new(setup).unwrap();
        simulation.set_box_motion(motion).unwrap_err().to_string()
    };
    let mut open = soft();
    open.domain.periodic[2] = false;
    assert!(refused(open, shear(2, 1.0, true)).contains("periodic[2]"));
    assert!(refused(soft(), shear(0, 1.0, true)).contains("box.across = 0"));
    let mut held = soft();
    held.grains[3].fixed = true;
    assert!(refused(held, servo()).contains("fixed"));
    let edges = [
        Edge::Lengths(vec![(0.0, 1.0), (1.0, -1.0)]),
        Edge::Rest,
        Edge::Rest,
    ];
    let negative = BoxMotion::Stretch { edges, carry: true };
    assert!(refused(soft(), negative).contains("box.edges[0], length = -1"));
    let mut simulation = Simulation::new(soft()).unwrap();
    simulation
        .set_box_motion(stretch([-3.0, 0.0, 0.0], true))
        .unwrap();
    let error = simulation.advance(100_000).unwrap_err();
    assert!(
        !error.to_string().is_empty(),
        "a box that closes stops the run"
    );
    // The same after the box has begun to move, and when it rests with an offset.
    let mut sheared = Simulation::new(soft()).unwrap();
    sheared.set_box_motion(shear(2, 1.0, true)).unwrap();
    sheared.advance(10).unwrap();
    for motion in [servo(), BoxMotion::Rest] {
        sheared.set_box_motion(motion).unwrap();
        let mut held = soft().grains[0];
        held.fixed = true;
        assert!(
            sheared
                .insert(&[held])
                .unwrap_err()
                .to_string()
                .contains("fixed")
        );
        assert!(
            sheared
                .fix(|g| g.id == 1)
                .unwrap_err()
                .to_string()
                .contains("fixed")
        );
        let clump = Clump {
            grains: vec![1, 2],
            mass: None,
        };
        assert!(
            sheared
                .clump(&[clump])
                .unwrap_err()
                .to_string()
                .contains("clumps")
        );
        sheared.fix(|_| false).unwrap();
    }
    let record = Simulation::new(soft()).unwrap().checkpoint();
    for (name, at) in [("box/motion", 0), ("box/motion", 3)] {
        let mut spoilt = record.clone();
        spoilt.counts.get_mut(name).unwrap()[at] = 9;
        assert!(Simulation::resume(soft(), &spoilt).is_err());
    }
    let mut spoilt = record;
    spoilt.numbers.get_mut("box/bounds").unwrap()[0] = f64::NAN;
    assert!(Simulation::resume(soft(), &spoilt).is_err());
}

#[test]
fn grains_that_leave_are_booked() {
    let mut setup = cloud(6, 0.12, 0.0, laws()[0].1);
    setup.domain.periodic = [false; 3];
    setup.gravity = Vector3::new(0.0, 0.0, -2.0);
    for grain in &mut setup.grains {
        grain.velocity.x = 0.3;
    }
    let (mass, all) = (setup.grains[0].mass(), setup.grains.len());
    let expected = |time: f64| {
        let inside = |g: &&Grain| g.position.z - time * time >= 0.05;
        setup.grains.iter().filter(inside).count()
    };
    let mut simulation = Simulation::new(setup.clone()).unwrap();
    let keep = Region::Block {
        lower: Vector3::new(f64::NEG_INFINITY, f64::NEG_INFINITY, 0.05),
        upper: Vector3::repeat(f64::INFINITY),
    };
    simulation
        .set_outlet(Some(Outlet { keep, every: 10 }))
        .unwrap();
    simulation.advance(8000).unwrap();
    let left = expected(simulation.time());
    assert_eq!(simulation.grain_count(), left);
    assert!(left > 0 && left < all);
    let out = simulation.outflow();
    let gone = (all - left) as f64;
    assert_eq!(out.grains as usize, all - left);
    assert!((out.mass - gone * mass).abs() < 1e-12 * out.mass);
    assert!((out.momentum.x - 0.3 * out.mass).abs() < 1e-12 * out.mass);
    assert!(out.momentum.z < 0.0);
    assert!(simulation.momentum_error() < 1e-12);
    let mut again = Simulation::resume(setup, &simulation.checkpoint()).unwrap();
    assert_eq!(again.outflow(), out);
    assert!(
        again
            .set_outlet(Some(Outlet {
                keep: Region::Everywhere,
                every: 0
            }))
            .is_err()
    );
}
