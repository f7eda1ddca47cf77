//! Resting shapes.

use super::scene::*;
use colluvium_dem::walls::{Ends, Frustum, Rotation};
use colluvium_dem::*;
use nalgebra::Vector3;
use std::f64::consts::TAU;

/// A ball flies about in a closed shape for a while: relative change of its energy between bounces, and of
/// its angular momentum about `axis` through the origin.
fn bounce(walls: Vec<Wall>, axis: Vector3<f64>, steps: u64) -> (f64, f64, u64) {
    let grain = ball([0.3, 0.1, -0.2], [1.0, 0.6, 0.7]);
    let mut s = Simulation::new(setup(smooth(), vec![grain], walls, 2e-6)).unwrap();
    let energy = s.energy().total();
    let spin_up = |s: &Simulation| s.leapfrog_angular_momentum().dot(&axis);
    let swing = spin_up(&s);
    let (mut bounces, mut touched) = (0, false);
    let mut snapshot = Snapshot::default();
    let (mut lost, mut slowed) = (0.0_f64, 0.0_f64);
    for _ in 0..steps / 100 {
        s.advance(100).unwrap();
        s.snapshot(&mut snapshot);
        let touches = !snapshot.contacts.is_empty();
        bounces += u64::from(touched && !touches);
        touched = touches;
        slowed = slowed.max((spin_up(&s) / swing - 1.0).abs());
        if !touches {
            lost = lost.max((s.energy().total() / energy - 1.0).abs());
        }
    }
    (lost, slowed, bounces)
}

#[test]
fn elastic_bounces_in_shells_keep_energy_and_angular_momentum() {
    let z = Vector3::z();
    let lid = |h: f64| Wall::plane(z * h, -z * h.signum());
    let sphere = Wall::sphere(Vector3::zeros(), 0.8, Side::Inside);
    let cylinder = Wall::cylinder(Vector3::zeros(), z, 0.8, Side::Inside);
    let tube = Wall::tube(Vector3::zeros(), z, 0.8, 3.0);
    let cone = Wall::frustum(
        -z,
        Frustum {
            axis: z,
            height: 2.0,
            radii: [0.5, 1.2],
            ends: Ends::Open(Side::Inside),
        },
    );
    for (name, walls) in [
        ("sphere", vec![sphere]),
        ("cylinder", vec![cylinder, lid(-0.7), lid(0.7)]),
        ("tube", vec![tube, lid(-0.7), lid(0.7)]),
        ("cone", vec![cone, lid(-0.7), lid(0.7)]),
    ] {
        let (lost, slowed, bounces) = bounce(walls, z, 3_000_000);
        assert!(bounces > 4, "{name}: {bounces}");
        assert!(lost < 1e-8, "{name}: energy {lost:e} in {bounces} bounces");
        assert!(slowed < 1e-9, "{name}: angular momentum {slowed:e}");
    }
}

/// Period of a ball that rolls in a trough, from its passages through the middle.
fn rolling_period(wall: Wall) -> f64 {
    let hollow = 1.0 - RADIUS;
    let angle: f64 = 0.05;
    let start = [hollow * angle.sin(), 0.0, -hollow * angle.cos()];
    let mut setup = setup(
        rough(2e6, 1.0),
        vec![ball(start, [0.0; 3])],
        vec![wall],
        2e-5,
    );
    setup.gravity = Vector3::new(0.0, 0.0, -9.81);
    let mut s = Simulation::new(setup).unwrap();
    let mut crossings = Vec::new();
    let mut before = start[0];
    while crossings.len() < 5 {
        s.advance(1).unwrap();
        let x = only(&mut s).position.x;
        if x * before < 0.0 {
            crossings.push(s.time() - s.timestep() * x / (x - before));
        }
        before = x;
    }
    (crossings[4] - crossings[0]) / 2.0
}

#[test]
fn a_ball_rolls_in_a_trough_and_in_a_bowl_at_the_period_of_the_closed_form() {
    // T = 2π √(7 (R - r)/(5 g)) (1 + α²/16).
    let hollow = 1.0 - RADIUS;
    let exact = TAU * (7.0 * hollow / (5.0 * 9.81)).sqrt() * (1.0 + 0.05_f64.powi(2) / 16.0);
    let trough = Wall::cylinder(Vector3::zeros(), Vector3::y(), 1.0, Side::Inside);
    let bowl = Wall::sphere(Vector3::zeros(), 1.0, Side::Inside);
    for wall in [trough, bowl] {
        let period = rolling_period(wall.clone());
        let error = period / exact - 1.0;
        assert!(error.abs() < 3e-4, "{:?}: {error:e}", wall.shape);
    }
}

#[test]
fn a_ball_circles_in_a_cone_at_the_speed_of_its_height() {
    // Without friction v² = g h at height h over the tip, measured where the surface touches the centre's
    // normal: the centre moves on a cone shifted by R along the normals.
    let g = 9.81;
    let frustum = Frustum {
        axis: Vector3::z(),
        height: 3.0,
        radii: [0.0, 3.0],
        ends: Ends::Open(Side::Inside),
    };
    // Half the opening is 45°: the centre's own cone has its tip R √2 higher.
    let height = 1.5;
    let tip = RADIUS * 2.0_f64.sqrt();
    let grain = ball([height, 0.0, height + tip], [0.0, (g * height).sqrt(), 0.0]);
    let wall = Wall::frustum(Vector3::zeros(), frustum);
    let mut setup = setup(smooth(), vec![grain], vec![wall], 2e-5);
    setup.gravity = Vector3::new(0.0, 0.0, -g);
    let mut s = Simulation::new(setup).unwrap();
    let mut span = (f64::INFINITY, f64::NEG_INFINITY);
    let period = TAU * height / (g * height).sqrt();
    for _ in 0..100 {
        s.advance((0.05 * period / 2e-5) as u64).unwrap();
        let z = only(&mut s).position.z - tip;
        span = (span.0.min(z), span.1.max(z));
    }
    assert!(
        span.0 > height - 0.004 && span.1 < height + 0.004,
        "{span:?}"
    );
}

#[test]
fn rims_and_edges_push_exactly_away_from_their_nearest_point() {
    let (c, s) = (0.6, 0.8);
    let depth = 1e-3;
    let reach = RADIUS - depth;
    let plate = [Vector3::x() * 0.5, Vector3::y() * 0.3];
    let corner = Vector3::new(1.0, 2.0, 2.0) / 3.0;
    let top = Wall::frustum(
        Vector3::zeros(),
        Frustum {
            axis: Vector3::z(),
            height: 1.0,
            radii: [0.7, 0.5],
            ends: Ends::Capped,
        },
    );
    for (wall, point, normal) in [
        (
            Wall::disk(Vector3::zeros(), Vector3::z(), 0.5),
            Vector3::new(0.5 * c, 0.5 * s, 0.0),
            Vector3::new(c * c, c * s, s),
        ),
        (
            Wall::rectangle(Vector3::zeros(), plate),
            Vector3::new(0.5, 0.1, 0.0),
            Vector3::new(c, 0.0, -s),
        ),
        (
            Wall::rectangle(Vector3::zeros(), plate),
            Vector3::new(0.5, 0.3, 0.0),
            corner,
        ),
        (
            Wall::tube(Vector3::zeros(), Vector3::z(), 0.5, 1.0),
            Vector3::new(0.0, 0.5, 0.5),
            Vector3::new(0.0, -c, s),
        ),
        (top, Vector3::new(0.5, 0.0, 1.0), Vector3::new(c, 0.0, s)),
    ] {
        let centre = point + normal * reach;
        let grain = ball(centre.into(), [0.0; 3]);
        let mut simulation =
            Simulation::new(setup(smooth(), vec![grain], vec![wall.clone()], 1e-6)).unwrap();
        let mut snapshot = Snapshot::default();
        simulation.snapshot(&mut snapshot);
        let contact = &snapshot.contacts[0];
        assert!((contact.overlap - depth).abs() < 1e-15, "{wall:?}");
        let turned = (contact.force.normalize() - normal).norm();
        assert!(turned < 4e-15, "{wall:?}: {turned:e}");
        assert!((centre + contact.arm - point).norm() < 1e-15);
    }
}

#[test]
fn a_wall_carries_the_weight_of_a_settled_bed() {
    let grains: Vec<Grain> = (0..64)
        .map(|k| {
            let shift = 0.004 * f64::from((k * 7) % 5);
            ball(
                [
                    0.21 * f64::from(k % 4) + shift,
                    0.21 * f64::from(k / 4 % 4) - shift,
                    0.11 + 0.22 * f64::from(k / 16),
                ],
                [0.0; 3],
            )
        })
        .collect();
    let middle = Vector3::new(0.32, 0.32, 0.0);
    let tube = Wall::cylinder(middle, Vector3::z(), 0.62, Side::Inside);
    let floor = Wall::disk(middle, Vector3::z(), 0.7);
    let mut setup = setup(rough(2e5, 0.5), grains, vec![floor, tube], 1e-4);
    setup.gravity = Vector3::new(0.0, 0.0, -9.81);
    let mut s = Simulation::new(setup).unwrap();
    s.advance(40_000).unwrap();
    for wall in 0..2 {
        s.forget_wall_taken(wall);
    }
    s.advance(2_000).unwrap();
    let weight = s.free_mass() * 9.81;
    let now = s.wall_load(0).force.z + s.wall_load(1).force.z;
    assert!((now / -weight - 1.0).abs() < 1e-3, "{now} {weight}");
    let taken = s.wall_taken(0).impulse.z + s.wall_taken(1).impulse.z;
    assert!((s.wall_taken(0).duration - 0.2).abs() < 1e-12);
    assert!((taken / (-0.2 * weight) - 1.0).abs() < 1e-4, "{taken}");
    // The tube takes a share by friction and none of its pushes adds up to a turn about its axis.
    assert!(s.wall_load(1).force.z < -0.01 * weight);
    assert!(s.momentum_error() < 1e-12, "{:e}", s.momentum_error());
}

#[test]
fn shapes_of_impossible_size_are_refused_by_name() {
    let refuse = |wall: Wall, words: &str| {
        let setup = setup(smooth(), vec![ball([0.0; 3], [0.0; 3])], vec![wall], 1e-6);
        let error = Simulation::new(setup).unwrap_err().to_string();
        assert!(error.contains(words), "{error}");
    };
    let z = Vector3::z();
    refuse(Wall::plane(z, z * 2.0), "walls[0].normal = 2");
    refuse(Wall::disk(z, z, -1.0), "walls[0].radius = -1");
    let slanted = [Vector3::x(), Vector3::x() + z];
    refuse(Wall::rectangle(z, slanted), "walls[0].half_sides");
    refuse(Wall::sphere(z, f64::NAN, Side::Inside), "walls[0].radius");
    refuse(Wall::plane(z * f64::NAN, z), "walls[0].position");
    refuse(Wall::plane(z, z).material(3), "material 3");
}

#[test]
fn walls_that_a_periodic_box_shows_in_part_are_refused() {
    let (x, z) = (Vector3::x(), Vector3::z());
    let try_in = |wall: Wall| {
        let mut setup = setup(smooth(), vec![ball([0.0; 3], [0.0; 3])], vec![wall], 1e-6);
        setup.domain.lower = Vector3::new(-1.0, -1.0, -9.0);
        setup.domain.upper = Vector3::new(1.0, 1.0, 9.0);
        setup.domain.periodic = [true, true, false];
        Simulation::new(setup)
            .map(|_| ())
            .map_err(|error| error.to_string())
    };
    let refuse = |wall: Wall, words: &str| {
        let error = try_in(wall).unwrap_err();
        assert!(
            error.contains("walls[0]") && error.contains(words),
            "{error}"
        );
    };
    let slant = Vector3::new(0.6, 0.0, 0.8);
    let about = |axis| {
        Motion::Rotation(Rotation {
            point: Vector3::zeros(),
            axis,
            rate: 1.0,
        })
    };
    refuse(
        Wall::plane(-z, slant),
        "normal, its part along the periodic axis x = 0.6",
    );
    refuse(Wall::plane(-z, z).moving(about(x)), "periodic axis y = 1");
    refuse(Wall::disk(-z, z, 1.2), "periodic axis x = 1.2");
    refuse(Wall::sphere(-z, 1.01, Side::Outside), "at most half");
    refuse(
        Wall::cylinder(-z, slant, 0.1, Side::Outside),
        "periodic axis x",
    );
    refuse(Wall::tube(-z, slant, 0.1, 4.0), "periodic axis x");
    let plate = |u: Vector3<f64>| Wall::rectangle(-z, [u, Vector3::y()]);
    refuse(plate(1.7 * slant), "periodic axis x = 1.02");
    refuse(plate(1.2 * x).moving(about(z)), "periodic axis x");
    let cone = Frustum {
        axis: x,
        height: 1.5,
        radii: [0.2, 0.1],
        ends: Ends::Capped,
    };
    refuse(Wall::frustum(-z, cone), "periodic axis x = 1.5");
    // What is straight along the axis stands for its images, and what is small is one of them.
    for wall in [
        Wall::plane(-z, z).moving(about(z)),
        Wall::disk(-z, z, 1.0),
        Wall::cylinder(-z, x, 0.5, Side::Inside),
        Wall::tube(-z, x, 0.5, 9.0).moving(about(x)),
        plate(1.7 * x),
        plate(1.6 * slant),
        Wall::cuboid(-z, Vector3::new(5.0, 0.5, 0.2)),
    ] {
        try_in(wall).unwrap();
    }
}

#[test]
#[should_panic(expected = "index out of bounds")]
fn a_part_of_a_body_is_no_wall() {
    let mut setup = setup(smooth(), vec![ball([0.0; 3], [0.0; 3])], vec![], 1e-6);
    setup.bodies = vec![Body::new(vec![Part::sphere(0.1, 1.0)]).at(Vector3::x())];
    let world = Simulation::new(setup).unwrap();
    world.wall_pose(0);
}
