//! Free flight, and one ball as a clump.

use super::scene::*;
use colluvium_dem::*;
use nalgebra::{UnitQuaternion, Vector3};

#[test]
fn a_free_asymmetric_clump_keeps_momenta_to_the_bit_and_energy_to_round_off() {
    let motion = [v(0.1, -0.2, 0.05), v(0.8, 2.4, -1.0)];
    let grains = put(&jack(), v(0.0, 0.0, 0.0), orientation(1), motion);
    // Ten milliseconds: some 0.027 rad a step.
    let mut one = Simulation::new(setup(smooth(1e4), grains, 0.01)).unwrap();
    one.clump(&rows_of(0, 1, 4)).unwrap();
    let start = one.clump_samples()[0];
    let shape = |s: &mut Simulation| {
        let g = s.grain_list();
        [(0, 1), (0, 2), (1, 3)].map(|(a, b)| (g[a].position - g[b].position).norm())
    };
    let sides = shape(&mut one);
    let mut worst = 0.0_f64;
    for _ in 0..100 {
        one.advance(10_000).unwrap();
        let now = one.clump_samples()[0];
        assert_eq!(now.angular_momentum, start.angular_momentum);
        assert_eq!(now.velocity, start.velocity);
        worst = worst.max((now.kinetic[1] / start.kinetic[1] - 1.0).abs());
    }
    println!("energy of a free clump over 1e6 steps: {worst:.1e}");
    assert!(worst < 1e-11, "{worst:e}");
    let time = one.time();
    let now = one.clump_samples()[0];
    assert!((now.centre - start.centre - start.velocity * time).norm() < 1e-9 * time);
    for (a, b) in shape(&mut one).into_iter().zip(sides) {
        assert!((a / b - 1.0).abs() < 1e-10, "{a} {b}");
    }
}

#[test]
fn under_gravity_alone_a_clump_falls_as_a_grain_does() {
    let mut grains = put(
        &jack(),
        v(0.0, 0.0, 0.0),
        orientation(2),
        [v(0.1, 0.0, 1.0), v(3.0, 1.0, 2.0)],
    );
    grains.push(Grain {
        velocity: v(0.1, 0.0, 1.0),
        ..Grain::at_rest(v(0.5, 0.0, 0.0), 0.01, DENSITY)
    });
    let mut setup = setup(smooth(1e4), grains, 1e-3);
    setup.gravity = v(0.0, 0.0, -9.81);
    let mut fall = Simulation::new(setup).unwrap();
    fall.clump(&rows_of(0, 1, 4)).unwrap();
    let before = fall.clump_samples()[0];
    let (grain, turning) = (fall.grain_list()[4].position, before.angular_momentum);
    fall.advance(1000).unwrap();
    let after = fall.clump_samples()[0];
    let fallen = fall.grain_list()[4].position - grain;
    // The clump's velocity is the mean of its members', which it has but for its turning.
    let other = after.centre - before.centre - (before.velocity - v(0.1, 0.0, 1.0)) * fall.time();
    assert!(
        (fallen - other).norm() < 1e-12,
        "{:e}",
        (fallen - other).norm()
    );
    assert_eq!(after.angular_momentum, turning);
    assert!(fall.momentum_error() < 1e-13);
}

#[test]
fn a_clump_of_one_ball_follows_the_grain() {
    let ball = Grain {
        velocity: v(0.4, 0.1, -0.3),
        spin: v(3.0, -5.0, 8.0),
        ..Grain::at_rest(v(0.0, 0.0, 0.03), 0.01, DENSITY)
    };
    let far = Grain {
        position: v(0.0, 0.3, 0.03),
        ..ball
    };
    let mut setup = setup(rough(), vec![ball, far], 2e-6);
    setup.gravity = v(0.0, 0.0, -9.81);
    setup.walls = vec![Wall::plane(Vector3::zeros(), Vector3::z())];
    let mut both = Simulation::new(setup).unwrap();
    both.clump(&rows_of(0, 1, 1)).unwrap();
    for _ in 0..50 {
        both.advance(2000).unwrap();
        let grains = both.grain_list();
        let apart = grains[1].position - grains[0].position - v(0.0, 0.3, 0.0);
        assert!(apart.norm() < 1e-10, "{:e}", apart.norm());
        assert!((grains[1].velocity - grains[0].velocity).norm() < 1e-9);
        assert!((grains[1].spin - grains[0].spin).norm() < 1e-7);
    }
    // It has bounced, and rolls by now.
    let [a, _] = both.grain_list()[..] else {
        panic!()
    };
    assert!(a.position.z < 0.0101 && (a.velocity.x - 0.01 * a.spin.y).abs() < 1e-3);
}

#[test]
fn members_of_one_clump_never_touch_and_the_same_grains_fly_apart() {
    let grains = put(
        &dogleg(),
        Vector3::zeros(),
        UnitQuaternion::identity(),
        [Vector3::zeros(); 2],
    );
    let mut bound = Simulation::new(setup(smooth(1e4), grains.clone(), 1e-5)).unwrap();
    bound.clump(&rows_of(0, 1, 3)).unwrap();
    bound.advance(2000).unwrap();
    for (now, then) in bound.grain_list().iter().zip(&grains) {
        assert_eq!(now.velocity, Vector3::zeros());
        assert!((now.position - then.position).norm() < 1e-17);
    }
    // The control.
    let mut loose = Simulation::new(setup(smooth(1e4), grains, 1e-5)).unwrap();
    loose.advance(2000).unwrap();
    assert!(loose.grain_list()[0].velocity.norm() > 1.0);
}

#[test]
fn a_pendulum_of_a_wall_knows_the_inertia_that_is_given() {
    // A rod that stands on its end and is pushed at the top: it turns by the inertia that is given.
    let rod = [(v(0.0, 0.0, -0.01), 0.005), (v(0.0, 0.0, 0.01), 0.005)];
    for factor in [1.0, 3.0] {
        let grains = put(
            &rod,
            Vector3::zeros(),
            UnitQuaternion::identity(),
            [Vector3::zeros(); 2],
        );
        let mut one = Simulation::new(setup(smooth(1e4), grains, 1e-5)).unwrap();
        let mass = MassProperties {
            mass: 0.02,
            centre: Vector3::zeros(),
            inertia: nalgebra::Matrix3::from_diagonal(&v(2e-6, 2e-6, 1e-6)) * factor,
        };
        one.clump(&[Clump {
            grains: vec![0, 1],
            mass: Some(mass),
        }])
        .unwrap();
        // A pair of forces about y.
        let load = |grain: u32, sign: f64| Load {
            grain,
            force: v(sign * 1e-4, 0.0, 0.0),
            moment: Vector3::zeros(),
        };
        one.set_loads(&[load(0, -1.0), load(1, 1.0)]).unwrap();
        one.advance(100).unwrap();
        let now = one.clump_samples()[0];
        let exact = 2.0 * 0.01 * 1e-4 / (2e-6 * factor) * one.time();
        assert!(
            (now.spin.y / exact - 1.0).abs() < 1e-6,
            "{}",
            now.spin.y / exact
        );
        assert!(now.velocity.norm() < 1e-15);
    }
}
