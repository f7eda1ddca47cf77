//! Bodies at rest, sliding, rolling and piled up.

use super::scene::*;
use colluvium_dem::preparation::Rest;
use colluvium_dem::*;
use nalgebra::{UnitQuaternion, Vector3};

/// Gravity on a plane tilted by an angle (rad) about y, downhill along x.
fn tilted(angle: f64) -> Vector3<f64> {
    9.81 * Vector3::new(angle.sin(), 0.0, -angle.cos())
}

const STIFFNESS: f64 = 1e6;

/// A body put on the floor, just touching.
fn on_floor(part: Part, height: f64, friction: f64, gravity: Vector3<f64>) -> Simulation {
    let body = Body::new(vec![part]).at(Vector3::z() * height);
    let law = rough(STIFFNESS, 0.4, friction);
    let mut setup = setup(law, vec![body], vec![floor()], 2e-5);
    setup.gravity = gravity;
    Simulation::new(setup).unwrap()
}

fn brick() -> Part {
    Part::cuboid(HALF.into(), DENSITY).rounded(0.02)
}

#[test]
fn a_cuboid_on_a_plane_stands_still() {
    for (turn, height, feet) in [
        (UnitQuaternion::identity(), HALF[2], 4.0),
        (
            UnitQuaternion::from_euler_angles(std::f64::consts::FRAC_PI_2, 0.0, 0.7),
            HALF[1],
            4.0,
        ),
    ] {
        let body = Body::new(vec![brick()])
            .at(Vector3::z() * height)
            .turned(turn);
        let law = rough(STIFFNESS, 0.4, 0.5);
        let mut setup = setup(law, vec![body], vec![floor()], 2e-5);
        setup.gravity = tilted(0.0);
        let mut s = Simulation::new(setup).unwrap();
        s.advance(20_000).unwrap();
        let settled = s.body(0);
        s.advance(100_000).unwrap();
        let b = s.body(0);
        // Four springs carry the weight.
        let sunk = b.mass * 9.81 / (feet * STIFFNESS);
        assert!((height - b.centre.z - sunk).abs() < 1e-9, "{}", b.centre.z);
        assert!((b.centre - settled.centre).norm() < 1e-11);
        assert!(b.pose.orientation.angle_to(&settled.pose.orientation) < 1e-11);
        assert!(b.velocity.norm() < 1e-11 && b.spin.norm() < 1e-10);
        assert!((b.force.z / (b.mass * 9.81) - 1.0).abs() < 1e-9);
    }
}

#[test]
fn a_cuboid_sticks_and_slides_as_coulomb_says() {
    let friction = 0.5_f64;
    // It holds below tan θ = μ and slides above at g (sin θ - μ cos θ).
    let held = friction.atan() - 0.02;
    let mut s = on_floor(brick(), HALF[2], friction, tilted(held));
    s.advance(20_000).unwrap();
    let settled = s.body(0);
    s.advance(50_000).unwrap();
    let b = s.body(0);
    assert!(
        (b.centre - settled.centre).norm() < 1e-9,
        "{}",
        b.centre - settled.centre
    );
    assert!(b.spin.norm() < 1e-8);

    let angle = friction.atan() + 0.1;
    let mut s = on_floor(brick(), HALF[2], friction, tilted(angle));
    s.advance(20_000).unwrap();
    let (start, from) = (s.body(0).velocity.x, s.time());
    s.advance(20_000).unwrap();
    let rate = (s.body(0).velocity.x - start) / (s.time() - from);
    let exact = 9.81 * (angle.sin() - friction * angle.cos());
    println!("slides at {rate} m/s², exact {exact}");
    assert!((rate / exact - 1.0).abs() < 1e-3, "{rate} {exact}");
    assert!(s.body(0).spin.norm() < 1e-2);
}

#[test]
fn a_cylinder_rolls_down_as_its_closed_form() {
    // a = g sin θ/(1 + I/(m r²)), r the radius less what the springs give way.
    let side = UnitQuaternion::from_scaled_axis(Vector3::x() * std::f64::consts::FRAC_PI_2);
    let drum = Part::cylinder(0.1, 0.25, DENSITY)
        .rounded(0.02)
        .turned(side);
    let ball = Part::sphere(0.1, DENSITY);
    for (part, inertia, feet) in [(drum, 0.5, 2.0), (ball, 0.4, 1.0)] {
        let angle: f64 = 0.2;
        let mut s = on_floor(part, 0.1, 0.6, tilted(angle));
        s.advance(10_000).unwrap();
        let (start, from) = (s.body(0).velocity.x, s.time());
        s.advance(50_000).unwrap();
        let b = s.body(0);
        let rate = (b.velocity.x - start) / (s.time() - from);
        let radius = 0.1 - b.mass * 9.81 * angle.cos() / (feet * STIFFNESS);
        let exact = 9.81 * angle.sin() / (1.0 + inertia * (0.1 / radius).powi(2));
        println!("rolls at {rate} m/s², exact {exact}");
        assert!((rate / exact - 1.0).abs() < 1e-5, "{rate} {exact}");
        // Without slip, straight on.
        assert!((b.spin.y * 0.1 / b.velocity.x - 1.0).abs() < 1e-3);
        assert!(b.centre.y.abs() < 1e-9 && b.spin.x.abs() < 1e-6);
    }
}

#[test]
fn a_slippery_cylinder_slides_and_spins_up_by_friction() {
    // Above tan θ = 3 μ it slips: a = g (sin θ - μ cos θ), dω/dt = 2 μ g cos θ/R.
    let (angle, friction): (f64, f64) = (0.6, 0.1);
    let side = UnitQuaternion::from_scaled_axis(Vector3::x() * std::f64::consts::FRAC_PI_2);
    let drum = Part::cylinder(0.1, 0.25, DENSITY)
        .rounded(0.02)
        .turned(side);
    let mut s = on_floor(drum, 0.1, friction, tilted(angle));
    s.advance(10_000).unwrap();
    let (start, from) = (s.body(0), s.time());
    s.advance(20_000).unwrap();
    let (b, time) = (s.body(0), s.time() - from);
    let rate = (b.velocity.x - start.velocity.x) / time;
    let spin = (b.spin.y - start.spin.y) / time;
    let exact = 9.81 * (angle.sin() - friction * angle.cos());
    assert!((rate / exact - 1.0).abs() < 1e-3, "{rate} {exact}");
    let exact = 2.0 * friction * 9.81 * angle.cos() / 0.1;
    assert!((spin / exact - 1.0).abs() < 1e-3, "{spin} {exact}");
}

#[test]
fn a_cylinder_stands_on_its_end_and_falls_over_where_it_must() {
    // It tips over where tan θ > (R - r)/(H/2), r its rounding: at 0.65.
    for (angle, stands) in [(0.62_f64, true), (0.68, false)] {
        let pillar = Part::cylinder(0.1, 0.25, DENSITY).rounded(0.005);
        let mut s = on_floor(pillar, 0.125, 2.0, tilted(angle));
        s.advance(40_000).unwrap();
        let up = s.body(0).pose.orientation * Vector3::z();
        assert_eq!(up.z > 0.999, stands, "{angle}: {up}");
    }
}

/// A heap of bricks of a half height each, one on another, the upper ones turned a little.
fn stack(twist: f64) -> Simulation {
    let bodies = (0..3).map(|k| {
        let k = f64::from(k);
        Body::new(vec![brick()])
            .at(Vector3::z() * (2.0 * k + 1.0) * HALF[2])
            .turned(UnitQuaternion::from_scaled_axis(Vector3::z() * twist * k))
    });
    let law = rough(STIFFNESS, 0.4, 0.5);
    let mut setup = setup(law, bodies.collect(), vec![floor()], 2e-5);
    setup.gravity = tilted(0.0);
    Simulation::new(setup).unwrap()
}

#[test]
fn three_bricks_on_top_of_each_other_stand_still() {
    for twist in [0.0, 0.3] {
        let mut s = stack(twist);
        s.advance(40_000).unwrap();
        let settled: Vec<BodySample> = (0..3).map(|k| s.body(k)).collect();
        s.advance(50_000).unwrap();
        let mut snapshot = Snapshot::default();
        s.snapshot(&mut snapshot);
        println!("twist {twist}: {} contacts", snapshot.body_contacts.len());
        for (k, before) in settled.iter().enumerate() {
            let b = &snapshot.bodies[k];
            let moved = (b.centre - before.centre).norm();
            let turned = b.pose.orientation.angle_to(&before.pose.orientation);
            println!(
                "brick {k}: moved {moved:e} m, turned {turned:e} in 1 s; {:e} m/s",
                b.velocity.norm()
            );
            assert!(moved < 1e-9 && turned < 1e-9, "{k}: {moved:e} {turned:e}");
            assert!(b.velocity.norm() < 1e-8);
            assert!(b.force.norm() < 1e-6 + b.mass * 9.81);
        }
        // The floor carries all three.
        let floor = s.wall_load(0).force.z;
        let weight = 3.0 * settled[0].mass * 9.81;
        assert!((floor / weight + 1.0).abs() < 1e-9);
    }
}

#[test]
fn a_brick_slides_off_a_held_one() {
    // The same Coulomb rule between bodies: the lower one is held and tilted with gravity.
    let friction: f64 = 0.3;
    let angle = friction.atan() + 0.1;
    let table = Part::cuboid(Vector3::new(0.5, 0.3, 0.05), 0.0).rounded(0.02);
    let table = Body::new(vec![table]).freedom(Freedom::held());
    let top = Body::new(vec![
        Part::cuboid(Vector3::new(0.1, 0.08, 0.05), DENSITY).rounded(0.02),
    ]);
    let top = top.at(Vector3::new(-0.35, 0.0, 0.1));
    let mut setup = setup(
        rough(STIFFNESS, 0.4, friction),
        vec![table, top],
        vec![],
        2e-5,
    );
    setup.gravity = tilted(angle);
    let mut s = Simulation::new(setup).unwrap();
    s.advance(10_000).unwrap();
    let (start, from) = (s.body(1).velocity.x, s.time());
    s.advance(15_000).unwrap();
    let rate = (s.body(1).velocity.x - start) / (s.time() - from);
    let exact = 9.81 * (angle.sin() - friction * angle.cos());
    println!("slides at {rate} m/s² on a body, exact {exact}");
    assert!((rate / exact - 1.0).abs() < 5e-3, "{rate} {exact}");
    assert!(s.momentum_error() < 1e-12);
}

#[test]
fn measures_of_rest_know_bodies() {
    let mut s = on_floor(brick(), 0.2, 0.5, -9.81 * Vector3::z());
    s.advance(100).unwrap();
    let (mass, speed) = (
        s.body_setup(0).mass_properties("body").unwrap().mass,
        9.81 * s.time(),
    );
    let measures = s.rest_measures(9.81);
    let Solid::Cuboid { half_sides } = brick().solid else {
        panic!("a brick is a cuboid")
    };
    let expected = 0.5 * mass * speed * speed / (mass * 9.81 * 2.0 * half_sides.norm());
    assert!(
        (measures.kinetic / expected - 1.0).abs() < 1e-9,
        "{measures:?} {expected}"
    );
    assert_eq!(measures.unbalanced, f64::INFINITY);
    let mut s = on_floor(brick(), half_sides.z, 0.5, -9.81 * Vector3::z());
    s.advance(100_000).unwrap();
    let measures = s.rest_measures(9.81);
    assert!(Rest::default().holds(&measures), "{measures:?}");
}
