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

/// Virial of a periodic box, -σ V (J).
fn virial(world: &mut Simulation) -> nalgebra::Matrix3<f64> {
    -world.stress() * world.domain().lengths().product()
}

fn in_a_periodic_box(grains: Vec<Grain>, timestep: f64) -> Simulation {
    let mut setup = setup(smooth(1e4), grains, timestep);
    setup.domain.periodic = [true; 3];
    Simulation::new(setup).unwrap()
}

#[test]
fn a_clump_that_spins_alone_bears_no_stress() {
    let spin = v(3.0, -2.0, 1.0);
    let grains = put(
        &jack(),
        Vector3::zeros(),
        orientation(2),
        [v(0.0, 0.0, 0.0), spin],
    );
    let mut one = in_a_periodic_box(grains, 1e-5);
    one.clump(&rows_of(0, 1, 4)).unwrap();
    one.advance(100).unwrap();
    let sample = one.clump_samples()[0];
    let turning = sample.kinetic[1];
    // Its grains' mean velocity was given, so that the centre drifts a little.
    let drift = sample.mass * sample.velocity * sample.velocity.transpose();
    let off = (virial(&mut one) - drift).norm();
    assert!(off < 1e-12 * turning, "{off:e} {turning:e}");
}

/// The virial with centres of clumps is the rate of Σ M V ⊗ X where none crosses the boundary.
#[test]
fn the_stress_of_colliding_clumps_is_the_change_of_their_moment_of_momentum() {
    let step = 1e-6;
    let along = UnitQuaternion::identity();
    let one = put(
        &jack(),
        v(-0.03, 0.0, 0.004),
        along,
        [v(0.5, 0.0, 0.0), v(0.0, 20.0, 5.0)],
    );
    let other = put(
        &dogleg(),
        v(0.02, 0.0, 0.0),
        along,
        [v(-0.5, 0.0, 0.0), v(9.0, 0.0, 0.0)],
    );
    let mut two = in_a_periodic_box([one, other].concat(), step);
    let clumps = [(0..4).collect(), (4..7).collect()].map(|grains| Clump { grains, mass: None });
    two.clump(&clumps).unwrap();
    let moment = |two: &mut Simulation| {
        let clumps = two.clump_samples();
        let each = clumps
            .iter()
            .map(|c| c.mass * c.velocity * c.centre.transpose());
        each.sum::<nalgebra::Matrix3<f64>>()
    };
    let begun = two.clump_samples()[0].velocity;
    let (before, mut sum) = (moment(&mut two), 0.5 * step * virial(&mut two));
    for _ in 0..40_000 {
        two.advance(1).unwrap();
        sum += step * virial(&mut two);
    }
    sum -= 0.5 * step * virial(&mut two);
    let changed = (two.clump_samples()[0].velocity - begun).norm();
    assert!(changed > 0.2, "they must have met: {changed}");
    let gained = moment(&mut two) - before;
    let off = (sum - gained).norm() / gained.norm();
    println!("virial of two clumps against their moment of momentum: {off:.1e}");
    assert!(off < 1e-5, "{off:e}: {sum} {gained}");
}
