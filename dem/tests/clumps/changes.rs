//! Clumps that are made in a run, go, are fixed or given velocities, and what is refused.

use super::scene::*;
use colluvium_dem::*;
use nalgebra::{UnitQuaternion, Vector3};

fn two() -> Simulation {
    let at = |x: f64| {
        put(
            &jack(),
            v(x, 0.0, 0.05),
            orientation(4),
            [v(0.2, 0.0, 0.0), v(1.0, 0.0, 3.0)],
        )
    };
    let grains = [
        at(0.0),
        at(0.1),
        vec![Grain::at_rest(v(0.3, 0.0, 0.05), 0.01, DENSITY)],
    ]
    .concat();
    let mut setup = setup(rough(), grains, 1e-5);
    setup.walls = vec![Wall::plane(Vector3::zeros(), Vector3::z())];
    setup.gravity = v(0.0, 0.0, -9.81);
    let mut two = Simulation::new(setup).unwrap();
    two.clump(&rows_of(0, 2, 4)).unwrap();
    two
}

#[test]
fn a_clump_goes_and_is_fixed_as_a_whole() {
    let mut world = two();
    world.advance(1000).unwrap();
    assert_eq!(world.remove(|grain| grain.id == 2), 4);
    assert_eq!((world.clump_count(), world.grain_count()), (1, 5));
    world.advance(1000).unwrap();
    assert!(
        world.momentum_error() < 1e-12,
        "{:e}",
        world.momentum_error()
    );
    world.fix(|grain| grain.id == 5).unwrap();
    assert_eq!(world.clump_count(), 0);
    let before = world.grain_list();
    assert_eq!(before.iter().filter(|g| g.fixed).count(), 4);
    world.advance(100).unwrap();
    let after = world.grain_list();
    assert!((0..4).all(|k| after[k].position == before[k].position));
}

#[test]
fn new_clumps_join_a_run() {
    let mut world = two();
    world.advance(1000).unwrap();
    let spin = v(0.0, 4.0, 0.0);
    let come = put(
        &dogleg(),
        v(0.0, 0.2, 0.1),
        UnitQuaternion::identity(),
        [v(0.0, 0.0, -1.0), spin],
    );
    let numbers = world.insert(&come).unwrap();
    world
        .clump(&[Clump {
            grains: numbers.collect(),
            mass: None,
        }])
        .unwrap();
    assert_eq!(world.clump_count(), 3);
    let new = world.clump_samples()[2];
    assert!((new.spin - spin).norm() < 1e-12);
    world.advance(2000).unwrap();
    let now = world.clump_samples()[2];
    let (t, g) = (0.02, 9.81);
    let fallen = now.centre.z - new.centre.z;
    assert!(
        (fallen - (new.velocity.z * t - 0.5 * g * t * t)).abs() < 1e-12,
        "{fallen}"
    );
    assert!(world.momentum_error() < 1e-12);
}

#[test]
fn velocities_that_are_given_and_damped_are_those_of_the_whole() {
    let mut world = two();
    world.give_velocity(|_| v(0.0, 0.5, 0.0));
    let sample = world.clump_samples()[0];
    assert!((sample.velocity - v(0.0, 0.5, 0.0)).norm() < 1e-15);
    assert!(sample.spin.norm() > 1.0);
    world.damp(0.5);
    assert!((world.clump_samples()[0].velocity.y - 0.25).abs() < 1e-15);
    world.advance(100).unwrap();
    assert!(world.momentum_error() < 1e-12);
}

#[test]
fn what_cannot_be_a_clump_is_refused_and_changes_nothing() {
    let mut world = two();
    world.fix(|grain| grain.id == 8).unwrap();
    let hash = world.state_hash();
    let flat = MassProperties {
        mass: 1.0,
        centre: Vector3::zeros(),
        inertia: nalgebra::Matrix3::from_diagonal(&v(1.0, 1.0, 5.0)),
    };
    for (grains, mass, word) in [
        (vec![], None, "clumps[0].grains, their number"),
        (vec![99], None, "clumps[0].grains"),
        (vec![1], None, "in no clump yet"),
        (vec![8], None, "free grain"),
    ] {
        let error = world
            .clump(&[Clump { grains, mass }])
            .unwrap_err()
            .to_string();
        assert!(error.contains(word), "{error}");
    }
    let loose = put(
        &dogleg(),
        v(0.0, 0.3, 0.1),
        orientation(0),
        [Vector3::zeros(); 2],
    );
    let ids: Vec<u32> = world.insert(&loose).unwrap().collect();
    let twice = Clump {
        grains: vec![ids[0], ids[0]],
        mass: None,
    };
    assert!(world.clump(&[twice]).is_err());
    let odd = Clump {
        grains: ids.clone(),
        mass: Some(flat),
    };
    let error = world.clump(&[odd]).unwrap_err().to_string();
    assert!(error.contains("clumps[0].inertia"), "{error}");
    world.remove(|grain| ids.contains(&grain.id));
    assert_eq!(world.state_hash(), hash);
    assert_eq!(world.clump_count(), 2);
}

#[test]
fn velocities_that_are_given_as_they_are_change_nothing() {
    let mut world = two();
    let spin = v(30.0, -20.0, 40.0);
    let come = put(
        &dogleg(),
        v(0.0, 0.3, 0.3),
        orientation(3),
        [v(0.2, 0.1, 0.0), spin],
    );
    let numbers: Vec<u32> = world.insert(&come).unwrap().collect();
    let mass = MassProperties {
        mass: 0.02,
        centre: v(0.0, 0.302, 0.301),
        inertia: nalgebra::Matrix3::from_diagonal(&v(1e-6, 1.2e-6, 1.5e-6)),
    };
    world
        .clump(&[Clump {
            grains: numbers,
            mass: Some(mass),
        }])
        .unwrap();
    world.advance(500).unwrap();
    let before = world.clump_samples();
    world.give_velocity(|grain| grain.velocity);
    for (a, b) in before.iter().zip(world.clump_samples()) {
        assert!((a.velocity - b.velocity).norm() < 1e-14, "{a:?} {b:?}");
        assert!((a.angular_momentum - b.angular_momentum).norm() < 1e-16);
    }
}

#[test]
fn members_that_overlap_come_into_a_run_without_a_force_between_them() {
    let mut world = two();
    world.advance(1000).unwrap();
    let deepest = world.largest_overlap();
    let motion = [v(0.3, 0.0, -1.0), v(0.0, 4.0, 2.0)];
    let come = put(&dogleg(), v(0.0, 0.2, 0.1), orientation(0), motion);
    let clump = Clump {
        grains: vec![0, 1, 2],
        mass: None,
    };
    let odd = Clump {
        grains: vec![0, 3],
        mass: None,
    };
    assert!(world.insert_clumped(&come, &[odd]).is_err());
    assert_eq!((world.clump_count(), world.grain_count()), (2, 9));
    let numbers = world.insert_clumped(&come, &[clump]).unwrap();
    assert_eq!(world.clump_grains()[2], numbers.collect::<Vec<u32>>());
    assert_eq!(world.largest_overlap(), deepest);
    let new = world.clump_samples()[2];
    assert!((new.spin - motion[1]).norm() < 1e-12, "{}", new.spin);
    let steps = 2000;
    world.advance(steps).unwrap();
    assert!(world.largest_overlap() < 0.1, "{}", world.largest_overlap());
    let now = world.clump_samples()[2];
    let (t, g) = (steps as f64 * 1e-5, 9.81);
    let fallen = now.centre.z - new.centre.z;
    let expected = new.velocity.z * t - 0.5 * g * t * t;
    assert!((fallen - expected).abs() < 1e-12, "{fallen} {expected}");
    assert!((now.velocity.x - new.velocity.x).abs() < 1e-13);
    assert!(world.momentum_error() < 1e-12);
}
