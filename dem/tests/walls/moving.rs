//! Walls in motion.

use super::scene::*;
use colluvium_dem::walls::{Rotation, Servo, Sine, Staircase, Table, Target};
use colluvium_dem::*;
use nalgebra::Vector3;
use std::f64::consts::TAU;

/// A few layers of grains over the origin, apart from each other.
fn cloud(count: u32) -> Vec<Grain> {
    (0..count)
        .map(|k| {
            let shift = 0.003 * f64::from((k * 11) % 7);
            let place = [
                0.22 * f64::from(k % 4) + shift + 0.12,
                0.22 * f64::from(k / 4 % 4) - shift + 0.13,
                0.12 + 0.22 * f64::from(k / 16),
            ];
            ball(place, [0.1, 0.0, -0.2])
        })
        .collect()
}

/// A box of five planes, 0.9 m wide.
fn tub(floor: Motion) -> Vec<Wall> {
    let wall = |point: Vector3<f64>, normal| Wall::plane(point, normal);
    let far = Vector3::new(0.9, 0.9, 0.0);
    vec![
        wall(Vector3::zeros(), Vector3::z()).moving(floor),
        wall(Vector3::zeros(), Vector3::x()),
        wall(Vector3::zeros(), Vector3::y()),
        wall(far, -Vector3::x()),
        wall(far, -Vector3::y()),
    ]
}

fn motions() -> Vec<(&'static str, Motion)> {
    let jumps = Staircase {
        velocity: Vector3::new(0.0, 0.0, 0.5),
        duration: 0.02,
        period: 0.1,
        first: 0.02,
        growing: 3,
    };
    vec![
        ("steady", Motion::Steady(Vector3::new(0.1, 0.0, 0.05))),
        (
            "sine",
            Motion::Sine(Sine {
                amplitude: Vector3::new(0.01, 0.0, 0.01),
                frequency: Vector3::new(10.0, 0.0, 15.0),
                phase: Vector3::new(1.0, 0.0, 0.0),
            }),
        ),
        ("staircase", Motion::Staircase(jumps)),
        (
            "rotation",
            Motion::Rotation(Rotation {
                point: Vector3::new(0.45, 0.45, 0.0),
                axis: Vector3::z(),
                rate: 3.0,
            }),
        ),
        (
            "table",
            Motion::Table(Table {
                times: vec![0.0, 0.1, 0.2],
                displacements: vec![
                    Vector3::zeros(),
                    Vector3::z() * 0.02,
                    Vector3::new(0.0, 0.01, 0.0),
                ],
            }),
        ),
        (
            "servo",
            Motion::Servo(Servo {
                axis: Vector3::z(),
                target: Target::Force(900.0),
                mass: 5.0,
                gain: 1e-3,
                speed_limit: 0.3,
            }),
        ),
    ]
}

fn shaken(motion: Motion, threads: Threads) -> Setup {
    let mut setup = setup(rough(2e5, 0.5), cloud(96), tub(motion), 1e-4);
    setup.gravity = Vector3::new(0.0, 0.0, -9.81);
    setup.threads = threads;
    setup
}

#[test]
fn momentum_and_energy_are_accounted_for_with_walls_in_motion() {
    for (name, motion) in motions() {
        let mut s = Simulation::new(shaken(motion, Threads::Serial)).unwrap();
        s.advance(7).unwrap();
        s.open_energy_ledger();
        s.advance(2_500).unwrap();
        assert!(
            s.momentum_error() < 1e-12,
            "{name}: {:e}",
            s.momentum_error()
        );
        let ledger = s.energy_ledger().unwrap();
        assert!(ledger.error() < 1e-11, "{name}: {:e}", ledger.error());
        assert!(ledger.drive.abs() > 1e-3, "{name}: {ledger:?}");
        let lost = ledger.dissipated();
        assert!(
            lost.normal > 0.0 && lost.tangential > 0.0,
            "{name}: {lost:?}"
        );
    }
}

#[test]
fn walls_in_motion_give_the_same_bits() {
    let run = |motion: &Motion, threads: usize, legs: u64| {
        let kind = if threads > 1 {
            Threads::Rayon
        } else {
            Threads::Serial
        };
        let setup = shaken(motion.clone(), kind);
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads);
        pool.build().unwrap().install(|| {
            let mut s = Simulation::new(setup.clone()).unwrap();
            for leg in 0..legs {
                s.advance(1200 / legs).unwrap();
                if leg + 1 < legs {
                    // Looking changes nothing.
                    s.wall_load(0);
                    let record = s.checkpoint();
                    s = Simulation::resume(setup.clone(), &record).unwrap();
                }
            }
            (s.state_hash(), s.wall_pose(0), s.wall_taken(0))
        })
    };
    for (name, motion) in motions() {
        let reference = run(&motion, 1, 1);
        assert_eq!(reference, run(&motion, 2, 1), "{name}: two threads");
        assert_eq!(reference, run(&motion, 1, 5), "{name}: four restarts");
    }
}

#[test]
fn an_elastic_ball_leaves_a_moving_wall_as_the_closed_form_says() {
    // Against a wall at speed u, a ball at -v leaves at v + 2u; the wall gives m (2u)(v + u).
    let (u, v) = (0.4, 1.0);
    let wall = Wall::plane(Vector3::zeros(), Vector3::z());
    let wall = wall.moving(Motion::Steady(Vector3::new(0.0, 0.0, u)));
    let grain = ball([0.0, 0.0, 0.2], [0.0, 0.0, -v]);
    let mass = grain.mass();
    let mut s = Simulation::new(setup(smooth(), vec![grain], vec![wall], 2e-6)).unwrap();
    s.open_energy_ledger();
    s.advance(100_000).unwrap();
    let left = only(&mut s).velocity.z;
    assert!((left / (v + 2.0 * u) - 1.0).abs() < 1e-8, "{left}");
    let ledger = s.energy_ledger().unwrap();
    let work = mass * 2.0 * u * (v + u);
    assert!((ledger.drive / work - 1.0).abs() < 1e-8, "{}", ledger.drive);
    assert!(ledger.dissipated().normal.abs() < 1e-7 * work);
    let taken = s.wall_taken(0).impulse.z;
    assert!((taken / (-2.0 * mass * (v + u)) - 1.0).abs() < 1e-8);
}

#[test]
fn a_turning_drum_carries_a_ball_along_its_surface() {
    // Held at the bottom by gravity, it slides until its surface moves with the wall, and from then on
    // spins at ω R/r in the mean.
    let (rate, big) = (2.0, 1.0);
    let drum = Wall::cylinder(Vector3::zeros(), Vector3::y(), big, Side::Inside);
    let drum = drum.moving(Motion::Rotation(Rotation {
        point: Vector3::zeros(),
        axis: Vector3::y(),
        rate,
    }));
    let grain = ball([0.0, 0.0, -(big - RADIUS)], [0.0; 3]);
    let mut setup = setup(rough(2e5, 0.3), vec![grain], vec![drum], 1e-4);
    setup.gravity = Vector3::new(0.0, 0.0, -9.81);
    let mut s = Simulation::new(setup).unwrap();
    s.open_energy_ledger();
    let (mut friction, mut surface, mut count) = (0.0, 0.0, 0.0);
    for _ in 0..4_000 {
        s.advance(50).unwrap();
        if s.time() > 5.0 {
            friction += s.wall_load(0).torque.y.abs();
            surface += only(&mut s).spin.y * RADIUS;
            count += 1.0;
        }
    }
    // It rocks on without loss about the bottom: the mean over some seven periods is what the drum
    // dictates.
    let (end, surface) = (only(&mut s), surface / count);
    assert!((surface / (rate * big) - 1.0).abs() < 0.02, "{surface}");
    let weight = end.mass * 9.81;
    assert!(friction / count < 0.3 * weight * big, "{friction}");
    let ledger = s.energy_ledger().unwrap();
    assert!(ledger.error() < 1e-11, "{:e}", ledger.error());
    assert!(s.momentum_error() < 1e-11);
}

#[test]
fn a_shaken_floor_follows_its_closed_form_and_throws_where_it_outruns_gravity() {
    // A ball at rest on a floor leaves it where the floor's downward acceleration passes g.
    let (amplitude, frequency) = (2e-3, 20.0);
    let floor = Wall::plane(Vector3::zeros(), Vector3::z()).moving(Motion::Sine(Sine {
        amplitude: Vector3::new(0.0, 0.0, amplitude),
        frequency: Vector3::new(0.0, 0.0, frequency),
        phase: Vector3::zeros(),
    }));
    let stiffness = 5e8;
    let mut grain = ball([0.0; 3], [0.0, 0.0, TAU * frequency * amplitude]);
    grain.position.z = RADIUS - grain.mass() * 9.81 / stiffness;
    let mut setup = setup(rough(stiffness, 0.5), vec![grain], vec![floor], 2e-6);
    setup.gravity = Vector3::new(0.0, 0.0, -9.81);
    let mut s = Simulation::new(setup).unwrap();
    let omega = TAU * frequency;
    let exact = (9.81 / (amplitude * omega * omega)).asin() / omega;
    let mut left = 0.0;
    while s.time() < 0.012 {
        s.advance(10).unwrap();
        let z = s.wall_pose(0).position.z;
        assert!((z - amplitude * (omega * s.time()).sin()).abs() < 1e-16);
        if s.wall_load(0).force.z < 0.0 {
            left = s.time();
        }
    }
    assert!((left - exact).abs() < 1e-4, "{left} {exact}");
}

#[test]
fn a_servo_keeps_up_its_pressure_on_a_bed() {
    let (edge, pressure) = (0.9, 2_000.0);
    let mut walls = tub(Motion::Fixed);
    let servo = Servo {
        axis: -Vector3::z(),
        target: Target::Pressure {
            pressure,
            area: edge * edge,
        },
        mass: 20.0,
        gain: 1e-3,
        speed_limit: 1.0,
    };
    let lid = Wall::plane(Vector3::new(0.0, 0.0, 1.6), -Vector3::z());
    walls.push(lid.moving(Motion::Servo(servo)));
    let mut setup = setup(rough(2e5, 0.5), cloud(96), walls, 1e-4);
    setup.gravity = Vector3::new(0.0, 0.0, -9.81);
    let mut s = Simulation::new(setup).unwrap();
    s.advance(30_000).unwrap();
    s.forget_wall_taken(5);
    let mut worst: f64 = 0.0;
    for _ in 0..100 {
        s.advance(20).unwrap();
        let held = s.wall_load(5).force.z / (edge * edge);
        worst = worst.max((held / pressure - 1.0).abs());
    }
    assert!(worst < 0.01, "{worst}");
    let taken = s.wall_taken(5);
    let mean = taken.impulse.z / taken.duration / (edge * edge);
    assert!((mean / pressure - 1.0).abs() < 1e-3, "{mean}");
    // Without the servo the lid would carry something else.
    let floor = s.wall_load(0).force.z;
    assert!(floor < -pressure * edge * edge * 0.5, "{floor}");
}

#[test]
fn motions_out_of_range_are_refused_by_name() {
    let refuse = |motion: Motion, words: &str| {
        let error = Simulation::new(shaken(motion, Threads::Serial)).unwrap_err();
        assert!(error.to_string().contains(words), "{error}");
    };
    refuse(Motion::Table(Table::default()), "walls[0].motion.times");
    let table = Table {
        times: vec![0.0, 0.0],
        displacements: vec![Vector3::zeros(); 2],
    };
    refuse(Motion::Table(table), "walls[0].motion.times[1]");
    refuse(
        Motion::Steady(Vector3::repeat(f64::NAN)),
        "walls[0].motion.velocity",
    );
    let servo = Servo {
        axis: Vector3::z(),
        target: Target::Force(1.0),
        mass: 0.0,
        gain: 0.0,
        speed_limit: 1.0,
    };
    refuse(Motion::Servo(servo), "walls[0].motion.gain");
}
