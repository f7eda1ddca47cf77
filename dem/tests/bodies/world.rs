//! Loads, fields, launches, clumps, and what is refused.

use super::scene::*;
use colluvium_dem::*;
use nalgebra::{Matrix3, Vector3};

#[test]
fn loads_and_launches_move_a_body_as_newton_says() {
    let mut s = Simulation::new(setup(smooth(1e5), vec![cuboid()], vec![], 1e-3)).unwrap();
    s.open_energy_ledger();
    let force = Vector3::new(3.0, 0.0, -1.0);
    let moment = Vector3::z() * 0.02;
    s.set_body_loads(&[BodyLoad {
        body: 0,
        force,
        moment,
    }])
    .unwrap();
    s.advance(2000).unwrap();
    let b = s.body(0);
    let inertia = s.body_mass(0).inertia;
    assert!((b.centre - force / b.mass * 2.0).norm() < 1e-11);
    assert!((b.velocity - force / b.mass * 2.0).norm() < 1e-11);
    assert!((b.spin.z - 2.0 * moment.z / inertia.m33).abs() < 1e-12);
    let ledger = s.energy_ledger().unwrap();
    assert!(ledger.error() < 1e-12 && ledger.loads > 0.0);
    assert!(s.momentum_error() < 1e-12);
    s.set_body_loads(&[]).unwrap();
    let (v, w) = (Vector3::new(0.0, 2.0, 0.0), Vector3::x());
    s.launch(0, v, w).unwrap();
    assert!((s.body(0).velocity - v).norm() < 1e-15 && (s.body(0).spin - w).norm() < 1e-14);
    s.advance(500).unwrap();
    assert!((s.body(0).centre - b.centre - 0.5 * v).norm() < 1e-12);
    assert!(s.momentum_error() < 1e-12);
    assert!(s.energy_ledger().unwrap().error() < 1e-12);
}

#[test]
fn a_body_circles_a_heavy_sphere() {
    // Once round in 2π √(r³/μ), turning on its own meanwhile.
    let (r, mu): (f64, f64) = (500.0, 30.0);
    let period = std::f64::consts::TAU * (r.powi(3) / mu).sqrt();
    let body = cuboid()
        .at(Vector3::x() * r)
        .moving(Vector3::y() * (mu / r).sqrt(), Vector3::new(0.1, 0.2, 0.0));
    let steps = 20_000;
    let timestep = period / f64::from(steps);
    let mut s = Simulation::new(setup(smooth(1e5), vec![body], vec![], timestep)).unwrap();
    s.set_heavy_sphere(Some(HeavySphere {
        center: Vector3::zeros(),
        parameter: mu,
        radius: 100.0,
    }))
    .unwrap();
    s.open_energy_ledger();
    let total = s.energy().total();
    s.advance(u64::from(steps as u32)).unwrap();
    let b = s.body(0);
    assert!((b.centre - Vector3::x() * r).norm() < 1e-3, "{}", b.centre);
    assert!((s.energy().total() / total - 1.0).abs() < 1e-10);
    assert!(s.energy_ledger().unwrap().error() < 1e-11);
    assert!(s.momentum_error() < 1e-11);
}

#[test]
fn a_clump_of_one_sphere_is_a_grain() {
    // The same ball as a body and as a grain falls, bounces, slides and rolls alike.
    let ball = |as_body: bool| {
        let (place, velocity) = (Vector3::z() * 0.12, Vector3::new(0.7, 0.2, -0.5));
        let mut setup = setup(rough(1e5, 0.5, 0.3), vec![], vec![floor()], 2e-5);
        setup.gravity = -Vector3::z() * 9.81;
        if as_body {
            let body = Body::new(vec![Part::sphere(0.1, 1000.0)]);
            setup
                .bodies
                .push(body.at(place).moving(velocity, Vector3::x()));
        } else {
            let mut grain = Grain::at_rest(place, 0.1, 1000.0);
            (grain.velocity, grain.spin) = (velocity, Vector3::x());
            setup.grains.push(grain);
        }
        let mut s = Simulation::new(setup).unwrap();
        s.advance(30_000).unwrap();
        let mut snapshot = Snapshot::default();
        s.snapshot(&mut snapshot);
        snapshot
    };
    let (body, grain) = (ball(true).bodies[0], ball(false).grains[0]);
    assert!((body.centre - grain.position).norm() < 1e-10);
    assert!((body.velocity - grain.velocity).norm() < 1e-9);
    assert!((body.spin - grain.spin).norm() < 1e-8);
}

/// Clumps of three spheres that fall in a heap, and grains among them.
fn clumps(threads: Threads) -> Setup {
    let clump = || {
        let ball = |x: f64, r: f64| Part::sphere(r, 2000.0).at(Vector3::x() * x);
        Body::new(vec![ball(-0.03, 0.03), ball(0.0, 0.035), ball(0.035, 0.03)])
    };
    let mut dice = Dice::new(4);
    let bodies = (0..24).map(|k| {
        let cell = Vector3::new(k % 3, k / 3 % 2, k / 6).map(f64::from);
        clump()
            .at(cell * 0.14 + Vector3::new(-0.14, -0.07, 0.1))
            .turned(dice.orientation())
    });
    let bodies: Vec<Body> = bodies.collect();
    let wall = |x: f64, y: f64| {
        let inward = -Vector3::new(x, y, 0.0);
        Wall::plane(-inward * 0.25, inward)
    };
    let walls = vec![
        floor(),
        wall(1.0, 0.0),
        wall(-1.0, 0.0),
        wall(0.0, 1.0),
        wall(0.0, -1.0),
    ];
    let mut setup = setup(rough(2e4, 0.4, 0.5), bodies, walls, 5e-5);
    setup.gravity = -Vector3::z() * 9.81;
    for k in 0..30 {
        let cell = Vector3::new(k % 5, k / 5 % 6, 0).map(f64::from);
        let place = cell * 0.08 + Vector3::new(-0.17, -0.2, 0.75);
        setup.grains.push(Grain::at_rest(place, 0.02, 2000.0));
    }
    setup.threads = threads;
    setup
}

#[test]
fn a_heap_of_clumps_comes_to_rest_with_its_accounts_closed() {
    let mut s = Simulation::new(clumps(Threads::Serial)).unwrap();
    s.open_energy_ledger();
    s.advance(30_000).unwrap();
    let ledger = s.energy_ledger().unwrap();
    assert!(ledger.error() < 1e-11, "{:e}", ledger.error());
    assert!(s.momentum_error() < 1e-12, "{:e}", s.momentum_error());
    let weight: f64 = (0..24).map(|k| s.body(k).mass * 9.81).sum();
    assert!(kinetic(&mut s) < 1e-3 * weight, "{}", kinetic(&mut s));
    let lowest = (0..24).map(|k| s.body(k).centre.z).fold(1.0, f64::min);
    assert!(lowest > 0.02, "{lowest}");
    let other = {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(2);
        pool.build().unwrap().install(|| {
            let mut s = Simulation::new(clumps(Threads::Rayon)).unwrap();
            s.advance(12_345).unwrap();
            let record = s.checkpoint();
            let mut s = Simulation::resume(clumps(Threads::Rayon), &record).unwrap();
            s.advance(30_000 - 12_345).unwrap();
            s.state_hash()
        })
    };
    assert_eq!(s.state_hash(), other);
}

#[test]
fn impossible_bodies_are_refused_by_name() {
    let refuse = |body: Body, words: &str| {
        let setup = setup(smooth(1e5), vec![cuboid(), body], vec![], 1e-4);
        let error = Simulation::new(setup).unwrap_err().to_string();
        assert!(error.contains(words), "{error}");
    };
    refuse(Body::new(vec![]), "bodies[1].parts, their number");
    let mut body = cuboid();
    body.parts[0].density = -1.0;
    refuse(body, "bodies[1].parts[0].density = -1");
    let mut body = cuboid();
    body.parts[0].density = 0.0;
    refuse(body, "bodies[1].mass = 0");
    let mut body = cuboid();
    body.parts[0].rounding = 0.1;
    refuse(body, "bodies[1].parts[0].rounding = 0.1");
    let mut body = cuboid();
    body.parts[0].material = 3;
    refuse(body, "material 3");
    refuse(
        cuboid().moving(Vector3::x() * f64::NAN, Vector3::zeros()),
        "bodies[1].velocity",
    );
    let mut body = cuboid();
    body.mass = Some(MassProperties {
        mass: 1.0,
        centre: Vector3::zeros(),
        inertia: Matrix3::from_diagonal(&Vector3::new(1.0, 1.0, 3.0)),
    });
    refuse(body, "bodies[1].inertia, its largest principal moment");
    let hinge = |axis: Vector3<f64>| {
        Freedom::Hinged(Hinge {
            point: Vector3::zeros(),
            axis,
        })
    };
    refuse(
        cuboid().freedom(hinge(Vector3::x() * 2.0)),
        "bodies[1].hinge.axis",
    );
    refuse(
        cuboid()
            .moving(Vector3::zeros(), Vector3::y())
            .freedom(hinge(Vector3::x())),
        "along the axis of the hinge",
    );
    let servo = Motion::Servo(walls::Servo {
        axis: Vector3::z(),
        target: walls::Target::Force(1.0),
        mass: 1.0,
        gain: 1.0,
        speed_limit: 1.0,
    });
    refuse(
        cuboid().freedom(Freedom::Driven(servo)),
        "bodies[1].motion: servo",
    );
    let open = walls::Mesh::new(
        vec![Vector3::zeros(), Vector3::x(), Vector3::y()],
        &[[0, 1, 2]],
    );
    let plate = Part::mesh(std::sync::Arc::new(open.unwrap()), 1000.0);
    refuse(Body::new(vec![plate]), "open or wrongly turned edges");

    let mut s = Simulation::new(setup(smooth(1e5), vec![cuboid()], vec![], 1e-4)).unwrap();
    let own = s.set_self_gravity(Some(SelfGravity::newton())).unwrap_err();
    assert!(own.to_string().contains("bodies do not attract"), "{own}");
    assert!(s.launch(1, Vector3::zeros(), Vector3::zeros()).is_err());
    let record = s.checkpoint();
    let other = setup(
        smooth(1e5),
        vec![cuboid(), cuboid().at(Vector3::x())],
        vec![],
        1e-4,
    );
    let error = Simulation::resume(other, &record).unwrap_err().to_string();
    assert!(error.contains("bodies/state"), "{error}");
}

#[test]
fn bodies_limit_the_step_and_a_failing_one_says_so() {
    let light = Body::new(vec![Part::cuboid(Vector3::repeat(0.01), 100.0)]);
    let body = light
        .at(Vector3::z() * 0.0101)
        .moving(-Vector3::z(), Vector3::zeros());
    let mut setup = setup(smooth(1e5), vec![body], vec![floor()], 1e-2);
    let conditions = timestep::Conditions {
        speed: 1.0,
        ..timestep::Conditions::default()
    };
    let error = setup.check_timestep(&conditions).unwrap_err().to_string();
    assert!(error.contains("timestep = 1e-2"), "{error}");
    let choice = setup
        .choose_step(&conditions, &timestep::Shares::default())
        .unwrap();
    // Four corners of 100 kg/m³ · 8 cm³ on springs of 1e5 N/m: contact time π √(m/4k) at the most.
    let slowest = std::f64::consts::PI * (8e-4 / 4e5_f64).sqrt() / 30.0;
    assert!(
        choice.seconds < slowest && choice.seconds > 0.1 * slowest,
        "{choice:?}"
    );
    setup.timestep = choice.seconds;
    let mut s = Simulation::new(setup.clone()).unwrap();
    let before = kinetic(&mut s);
    s.advance((0.01 / choice.seconds) as u64).unwrap();
    assert!((kinetic(&mut s) / before - 1.0).abs() < 1e-2);
    setup.timestep = 0.05;
    let mut s = Simulation::new(setup).unwrap();
    let failed = s.advance(50).map_err(|error| error.to_string());
    assert!(failed.is_err_and(|error| error.contains("overlapped")));
}
