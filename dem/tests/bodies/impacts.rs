//! Impacts of bodies on walls and on each other.

use super::scene::*;
use colluvium_dem::walls::Mesh;
use colluvium_dem::*;
use nalgebra::{UnitQuaternion, Vector3};
use std::f64::consts::{FRAC_PI_2, FRAC_PI_4};
use std::sync::Arc;

/// A closed mesh without symmetry: a bent octahedron.
fn stone() -> Part {
    let vertices = vec![
        Vector3::new(0.12, 0.01, 0.0),
        Vector3::new(0.02, 0.11, 0.02),
        Vector3::new(-0.01, 0.0, 0.14),
        Vector3::new(-0.15, 0.02, -0.01),
        Vector3::new(0.0, -0.1, 0.03),
        Vector3::new(0.01, -0.02, -0.12),
    ];
    let upper = [[0, 1, 2], [1, 3, 2], [3, 4, 2], [4, 0, 2]];
    let lower = upper.map(|[a, b, _]| [b, a, 5]);
    let mesh = Mesh::new(vertices, &[upper, lower].concat()).unwrap();
    Part::mesh(Arc::new(mesh), DENSITY).rounded(0.02)
}

/// A cuboid with a bump on one face and a mast, as landers have them.
fn lander() -> Vec<Part> {
    let box_of =
        |x: f64, y: f64, z: f64| Part::cuboid(Vector3::new(x, y, z), DENSITY).rounded(0.015);
    vec![
        box_of(HALF[0], HALF[1], HALF[2]),
        box_of(0.03, 0.03, 0.02).at(Vector3::new(0.05, 0.02, -HALF[2] - 0.02)),
        Part::sphere(0.03, DENSITY).at(Vector3::new(0.0, -0.05, HALF[2] + 0.02)),
    ]
}

fn shapes() -> Vec<(&'static str, Vec<Part>)> {
    let tilt = UnitQuaternion::from_euler_angles(0.4, 0.7, -0.3);
    vec![
        ("sphere", vec![Part::sphere(0.1, DENSITY)]),
        (
            "cuboid",
            vec![Part::cuboid(HALF.into(), DENSITY).rounded(0.02)],
        ),
        (
            "cylinder",
            vec![
                Part::cylinder(0.1, 0.25, DENSITY)
                    .rounded(0.02)
                    .turned(tilt),
            ],
        ),
        (
            "cone",
            vec![Part::frustum([0.12, 0.0], 0.2, DENSITY).rounded(0.02)],
        ),
        ("mesh", vec![stone()]),
        ("lander", lander()),
    ]
}

/// How far the lowest point of a body lies below its own origin, roughly from above (m).
fn depth(body: &Body) -> f64 {
    let parts = body.parts.iter().map(|part| {
        let centre = body.pose.orientation * part.pose.position;
        let turn = body.pose.orientation * part.pose.orientation;
        let up = turn.inverse_transform_vector(&Vector3::z());
        let reach = match &part.solid {
            Solid::Sphere { radius } => *radius,
            Solid::Cuboid { half_sides } => half_sides.dot(&up.abs()),
            Solid::Frustum { radii, height } => {
                let side = (1.0 - up.z * up.z).max(0.0).sqrt();
                (radii[0] * side).max(radii[1] * side - up.z * height)
            }
            Solid::Mesh(mesh) => {
                let below = mesh.vertices().iter().map(|v| -v.dot(&up));
                below.fold(0.0, f64::max) + part.rounding
            }
        };
        reach - centre.z
    });
    parts.fold(0.0, f64::max)
}

/// A body that comes down on the floor from close by.
fn over_floor(
    parts: Vec<Part>,
    turn: UnitQuaternion<f64>,
    velocity: Vector3<f64>,
    spin: Vector3<f64>,
) -> Body {
    let body = Body::new(parts).turned(turn);
    let height = depth(&body) + 1e-3;
    body.at(Vector3::z() * height).moving(velocity, spin)
}

/// Relative change of energy of an elastic impact on the floor, and contacts at once.
fn on_floor(body: Body, law: ContactLaw, timestep: f64) -> (f64, usize) {
    let mut s = Simulation::new(setup(law, vec![body], vec![floor()], timestep)).unwrap();
    let before = kinetic(&mut s);
    let touched = through_impact(&mut s, 100, 20_000);
    (kinetic(&mut s) / before - 1.0, touched)
}

#[test]
fn elastic_impacts_on_a_plane_keep_energy() {
    for (name, parts) in shapes() {
        let mut dice = Dice::new(7);
        let (mut worst, mut most) = (0.0_f64, 0);
        for _ in 0..8 {
            let (velocity, spin) = (dice.vector(0.3) - Vector3::z(), dice.vector(3.0));
            let body = over_floor(parts.clone(), dice.orientation(), velocity, spin);
            let (error, touched) = on_floor(body, hertz(), 1e-6);
            assert!(touched > 0, "{name}");
            (worst, most) = (worst.max(error.abs()), most.max(touched));
        }
        println!("{name}: {worst:e}, {most} contacts at once");
        assert!(worst < 1e-8, "{name}: {worst:e}");
    }
}

#[test]
fn flat_on_edge_and_on_corner_keep_energy() {
    let about = |axis: Vector3<f64>, angle: f64| UnitQuaternion::from_scaled_axis(axis * angle);
    let corner = UnitQuaternion::rotation_between(&Vector3::from(HALF), &Vector3::z()).unwrap();
    for (name, turn, contacts) in [
        ("flat", UnitQuaternion::identity(), 4),
        ("nearly flat", about(Vector3::x(), 1e-4), 4),
        ("edge", about(Vector3::x(), FRAC_PI_4), 2),
        ("corner", corner, 1),
    ] {
        let part = Part::cuboid(HALF.into(), DENSITY).rounded(0.02);
        let body = over_floor(vec![part], turn, -Vector3::z(), Vector3::zeros());
        let (error, touched) = on_floor(body, hertz(), 1e-6);
        println!("cuboid {name}: {error:e}");
        assert_eq!(touched, contacts, "{name}");
        assert!(error.abs() < 1e-8, "{name}: {error:e}");
    }
    for (name, turn, contacts) in [
        ("upright", about(Vector3::x(), 1e-9), 4),
        ("on its side", about(Vector3::x(), FRAC_PI_2), 2),
        ("on its rim", about(Vector3::x(), 0.7), 1),
    ] {
        let part = Part::cylinder(0.1, 0.25, DENSITY).rounded(0.02);
        let body = over_floor(vec![part], turn, -Vector3::z(), Vector3::zeros());
        let (error, touched) = on_floor(body, hertz(), 1e-6);
        println!("cylinder {name}: {error:e}");
        assert_eq!(touched, contacts, "{name}");
        assert!(error.abs() < 1e-8, "{name}: {error:e}");
    }
}

#[test]
fn the_error_of_an_elastic_impact_falls_with_the_square_of_the_step() {
    let mean = |timestep: f64| {
        let mut dice = Dice::new(3);
        let errors = (0..8).map(|_| {
            let part = Part::cuboid(HALF.into(), DENSITY).rounded(0.02);
            let spin = dice.vector(3.0);
            let body = over_floor(vec![part], dice.orientation(), -Vector3::z(), spin);
            on_floor(body, hertz(), timestep).0.abs()
        });
        errors.sum::<f64>() / 8.0
    };
    let [coarse, fine] = [1.6e-5, 4e-6].map(mean);
    let order = 0.5 * (coarse / fine).log2();
    println!("{coarse:e} at 16 µs, {fine:e} at 4 µs: order {order:.2}");
    assert!(order > 1.7, "{coarse:e} {fine:e}");
}

/// Two bodies that run into each other.
struct Pair {
    bodies: Vec<Body>,
    timestep: f64,
}

/// Relative changes of energy, momentum and angular momentum of an impact, and contacts at once.
fn collide(pair: Pair) -> ([f64; 3], usize) {
    let law = hertz();
    let mut s = Simulation::new(setup(law, pair.bodies, vec![], pair.timestep)).unwrap();
    let sizes = |s: &mut Simulation| {
        let all: Vec<BodySample> = (0..2).map(|k| s.body(k)).collect();
        let linear: f64 = all.iter().map(|b| b.mass * b.velocity.norm()).sum();
        let orbit = |b: &BodySample| b.mass * b.centre.norm() * b.velocity.norm();
        let angular: f64 = all
            .iter()
            .map(|b| orbit(b) + b.angular_momentum.norm())
            .sum();
        [linear, angular]
    };
    let (energy, momentum) = (kinetic(&mut s), s.momentum());
    let (turning, size) = (angular_momentum(&mut s), sizes(&mut s));
    let touched = through_impact(&mut s, 100, 20_000);
    let changes = [
        (kinetic(&mut s) / energy - 1.0).abs(),
        (s.momentum() - momentum).norm() / size[0],
        (angular_momentum(&mut s) - turning).norm() / size[1],
    ];
    (changes, touched)
}

/// Two bodies that fly at each other from a distance at which they just cannot touch.
fn thrown(a: &[Part], b: &[Part], dice: &mut Dice, timestep: f64) -> Pair {
    let apart = Vector3::new(0.47, 0.0, 0.0)
        + dice
            .vector(0.06)
            .component_mul(&Vector3::new(0.0, 1.0, 1.0));
    let towards = Vector3::x() * 2.0;
    let mut body = |parts: &[Part], place: Vector3<f64>, velocity: Vector3<f64>| {
        Body::new(parts.to_vec())
            .at(place)
            .turned(dice.orientation())
            .moving(velocity, dice.vector(2.0))
    };
    let bodies = vec![
        body(a, Vector3::zeros(), towards),
        body(b, apart, -0.5 * towards),
    ];
    Pair { bodies, timestep }
}

#[test]
fn oblique_impacts_of_two_bodies_keep_energy_and_both_momenta() {
    let all = shapes();
    for (i, j) in [
        (1, 1),
        (1, 0),
        (1, 2),
        (2, 2),
        (4, 4),
        (3, 1),
        (5, 5),
        (5, 4),
    ] {
        let ((a, first), (b, second)) = (&all[i], &all[j]);
        let mut dice = Dice::new(11);
        let (mut worst, mut met) = ([0.0_f64; 3], 0);
        for _ in 0..3 {
            let (changes, touched) = collide(thrown(first, second, &mut dice, 7e-7));
            met += usize::from(touched > 0);
            for (worst, change) in worst.iter_mut().zip(changes) {
                *worst = worst.max(change);
            }
        }
        println!(
            "{a} on {b}: energy {:e}, momentum {:e}, angular {:e}; {met} met",
            worst[0], worst[1], worst[2]
        );
        assert!(met >= 2, "{a} on {b}");
        assert!(
            worst[0] < 1e-8 && worst[1] < 1e-12 && worst[2] < 1e-12,
            "{worst:?}"
        );
    }
}

/// Elastic impacts of a thrown body on something that stands still.
fn on_wall(wall: Wall, parts: &[Part], target: Vector3<f64>, seed: u64) -> (f64, usize) {
    let mut dice = Dice::new(seed);
    let (mut worst, mut met) = (0.0_f64, 0);
    for _ in 0..3 {
        let towards = Vector3::new(0.3, -0.2, -1.0).normalize();
        let body = Body::new(parts.to_vec())
            .at(target - towards * 0.3)
            .turned(dice.orientation())
            .moving(towards * 2.0, dice.vector(2.0));
        let setup = setup(hertz(), vec![body], vec![wall.clone()], 7e-7);
        let mut s = Simulation::new(setup).unwrap();
        let before = kinetic(&mut s);
        met += usize::from(through_impact(&mut s, 100, 4_000) > 0);
        worst = worst.max((kinetic(&mut s) / before - 1.0).abs());
    }
    (worst, met)
}

#[test]
fn corners_edges_and_curved_walls_keep_energy() {
    let cuboid = [Part::cuboid(HALF.into(), DENSITY).rounded(0.02)];
    let drum = [Part::cylinder(0.1, 0.25, DENSITY).rounded(0.02)];
    let side = Vector3::new(0.3, 0.0, 0.0);
    let plate = [side, Vector3::new(0.0, 0.2, 0.05)];
    let peak = {
        let base = |x: f64, y: f64| Vector3::new(x, y, -0.3);
        let vertices = vec![
            Vector3::zeros(),
            base(0.3, 0.2),
            base(-0.2, 0.25),
            base(0.0, -0.3),
        ];
        let mesh = Mesh::new(vertices, &[[0, 1, 2], [0, 2, 3], [0, 3, 1]]).unwrap();
        Wall::mesh(Arc::new(mesh))
    };
    let zero = Vector3::zeros();
    for (name, wall, target) in [
        (
            "ball",
            Wall::sphere(-Vector3::z() * 0.1, 0.1, Side::Outside),
            zero,
        ),
        ("edge of a plate", Wall::rectangle(-side, plate), zero),
        ("peak of a mesh", peak, zero),
        (
            "bar",
            Wall::cylinder(-Vector3::z() * 0.05, Vector3::y(), 0.05, Side::Outside),
            zero,
        ),
        (
            "block",
            Wall::cuboid(Vector3::new(-0.2, 0.1, -0.2), Vector3::repeat(0.2)),
            zero,
        ),
        (
            "drum",
            Wall::cylinder(Vector3::zeros(), Vector3::y(), 0.5, Side::Inside),
            Vector3::new(0.0, 0.0, -0.4),
        ),
    ] {
        for (shape, parts) in [("cuboid", &cuboid), ("cylinder", &drum)] {
            let (worst, met) = on_wall(wall.clone(), parts, target, 2);
            println!("{shape} on a {name}: {worst:e}, {met} met");
            assert!(met >= 2, "{shape} on a {name}: {met}");
            assert!(worst < 1e-8, "{shape} on a {name}: {worst:e}");
        }
    }
}

#[test]
fn a_corner_and_a_flat_face_have_the_restitution_of_their_law() {
    // Newton's rule at the contact point, in the limit of a stiff contact.
    let restitution = 0.6;
    let about = |axis: Vector3<f64>, angle: f64| UnitQuaternion::from_scaled_axis(axis * angle);
    for (name, turn) in [
        ("flat", UnitQuaternion::identity()),
        ("edge", about(Vector3::x(), 0.5)),
        ("corner", UnitQuaternion::from_euler_angles(0.5, 0.4, 0.0)),
    ] {
        let law = ContactLaw {
            tangential: Tangential::None,
            ..rough(1e9, restitution, 0.0)
        };
        let part = Part::cuboid(HALF.into(), DENSITY).rounded(0.02);
        let body = over_floor(vec![part], turn, -Vector3::z(), Vector3::zeros());
        let mut s = Simulation::new(setup(law, vec![body], vec![floor()], 2e-7)).unwrap();
        let mut snapshot = Snapshot::default();
        let mut approach = None;
        let normal_speed =
            |b: &BodySample, at: Vector3<f64>| (b.velocity + b.spin.cross(&(at - b.centre))).z;
        let mut last = Vector3::zeros();
        let ratio = loop {
            s.advance(1).unwrap();
            s.snapshot(&mut snapshot);
            let b = &snapshot.bodies[0];
            let count = snapshot.body_contacts.len() as f64;
            if count > 0.0 {
                last = snapshot
                    .body_contacts
                    .iter()
                    .map(|c| c.point)
                    .sum::<Vector3<f64>>()
                    / count;
                approach.get_or_insert(normal_speed(b, last));
            } else if let Some(approach) = approach {
                break -normal_speed(b, last) / approach;
            }
            assert!(s.time() < 0.03);
        };
        println!("{name}: restitution {ratio:.4}, asked for {restitution}");
        assert!((ratio - restitution).abs() < 5e-3, "{name}: {ratio}");
    }
}

#[test]
fn no_impact_of_a_lander_with_a_bump_gains_energy() {
    let mut dice = Dice::new(1);
    let mut highest: f64 = 0.0;
    for _ in 0..100 {
        let law = rough(1e6, 0.6, 0.5);
        let (velocity, spin) = (dice.vector(0.2) - Vector3::z() * 0.3, dice.vector(1.0));
        let body = over_floor(lander(), dice.orientation(), velocity, spin);
        let mut s = Simulation::new(setup(law, vec![body], vec![floor()], 1e-5)).unwrap();
        let before = kinetic(&mut s);
        assert!(through_impact(&mut s, 50, 2_000) > 0);
        highest = highest.max(kinetic(&mut s) / before);
    }
    println!("largest outgoing over incoming energy of 100: {highest}");
    assert!(highest <= 1.0, "{highest}");
}
