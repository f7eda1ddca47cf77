//! Impacts of pairs and on walls: restitution, contact time, energy, momentum.

use colluvium_dem::*;
use nalgebra::Vector3;

/// Unit-mass, unit-diameter grains (SI units of a made-up world).
const DENSITY: f64 = 6.0 / std::f64::consts::PI;

fn law(restitution: f64, friction: f64, beta: Option<f64>) -> ContactLaw {
    ContactLaw::linear(
        Hooke::matched(2e5, restitution),
        TangentialSpring::matched(2.0 / 7.0, restitution, friction),
        beta.map(|beta| ShapeParameter {
            beta,
            rolling_friction: 1.05,
            twisting_friction: 1.3,
        }),
    )
}

fn open_box() -> Domain {
    Domain {
        lower: Vector3::repeat(-50.0),
        upper: Vector3::repeat(50.0),
        periodic: [false; 3],
    }
}

fn setup(law: ContactLaw, grains: Vec<Grain>, walls: Vec<Wall>, steps_per_contact: f64) -> Setup {
    Setup {
        domain: open_box(),
        gravity: Vector3::zeros(),
        bodies: Vec::new(),
        timestep: law.contact_time(0.5, 0.25, 1.0) / steps_per_contact,
        law: law.into(),
        grains,
        walls,
        threads: Threads::Serial,
    }
}

/// Two equal grains; the second flies at `speed` at `degrees` from the line of centres, spinning.
fn pair(law: ContactLaw, degrees: f64, spin: Vector3<f64>, steps: f64) -> Simulation {
    let (s, c) = degrees.to_radians().sin_cos();
    let still = Grain::at_rest(Vector3::zeros(), 0.5, DENSITY);
    let mut flying = Grain::at_rest(Vector3::new(1.0 + 1e-9, 0.0, 0.0), 0.5, DENSITY);
    flying.velocity = Vector3::new(-c, s, 0.0);
    flying.spin = spin;
    Simulation::new(setup(law, vec![still, flying], vec![], steps)).unwrap()
}

fn drop_on_floor(law: ContactLaw, degrees: f64, spin: Vector3<f64>, steps: f64) -> Simulation {
    let (s, c) = degrees.to_radians().sin_cos();
    let mut grain = Grain::at_rest(Vector3::new(0.0, 0.0, 0.5 + 1e-9), 0.5, DENSITY);
    grain.velocity = Vector3::new(s, 0.0, -c);
    grain.spin = spin;
    let floor = Wall::plane(Vector3::zeros(), Vector3::z());
    Simulation::new(setup(law, vec![grain], vec![floor], steps)).unwrap()
}

/// Runs until nothing touches any more; steps with contact.
fn fly_apart(simulation: &mut Simulation) -> u64 {
    let mut snapshot = Snapshot::default();
    let mut touched = 0;
    loop {
        simulation.advance(1).unwrap();
        simulation.snapshot(&mut snapshot);
        if !snapshot.contacts.is_empty() {
            touched += 1;
        } else if touched > 0 {
            return touched;
        }
        assert!(
            simulation.steps_done() < 5_000_000,
            "the impact never ended"
        );
    }
}

#[test]
fn restitution_and_contact_time_of_a_pair() {
    // Thuillet 2019, Eq. 2.8 and SM 17: ε_n within 1e-3 and τ = √(m(π² + ln² ε)/k).
    for e in [0.1, 0.3, 0.5, 0.9, 1.0] {
        let law = law(e, 0.5, Some(0.2));
        let mut s = pair(law, 0.0, Vector3::zeros(), 3000.0);
        let touched = fly_apart(&mut s);
        let mut snapshot = Snapshot::default();
        s.snapshot(&mut snapshot);
        let v: Vec<_> = snapshot
            .grains
            .iter()
            .map(|g| (g.id, g.velocity.x))
            .collect();
        let apart = (v[0].1 - v[1].1).abs();
        assert!((apart - e).abs() < 1e-3, "ε {e}: {apart}");
        let time = touched as f64 * s.timestep() / law.contact_time(0.5, 0.25, 1.0);
        assert!(
            (time - 1.0).abs() < 2e-3,
            "ε {e}: contact time off by {time}"
        );
    }
}

#[test]
fn no_impact_gains_energy_at_any_angle() {
    let spins = [
        Vector3::zeros(),
        Vector3::new(0.3, -2.0, 1.0),
        Vector3::new(0.0, 3.0, -4.0),
    ];
    let mut worst: f64 = f64::NEG_INFINITY;
    for degrees in 0..90 {
        for (friction, beta) in [(0.0, None), (0.5, None), (1.0, Some(0.2)), (1.0, Some(1.0))] {
            for e in [0.3, 0.95] {
                for spin in spins {
                    let law = law(e, friction, beta);
                    for mut s in [
                        pair(law, f64::from(degrees), spin, 40.0),
                        drop_on_floor(law, f64::from(degrees), spin, 40.0),
                    ] {
                        let before = s.energy().total();
                        fly_apart(&mut s);
                        let gain = s.energy().total() / before - 1.0;
                        worst = worst.max(gain);
                        assert!(
                            gain < 1e-9,
                            "{degrees}° μ {friction} β {beta:?} ε {e}: energy grows by {gain:e}"
                        );
                    }
                }
            }
        }
    }
    // The sweep must come near the conserving limit, or it would not see a small gain.
    assert!(worst > -1e-2, "closest to conserving: {worst:e}");
}

#[test]
fn energy_never_rises_during_an_impact() {
    // At 30 steps a contact the leap-frog's own energy error is (ω dt)²/4 of what is stored, 0.3 %.
    for degrees in (0..90).step_by(3) {
        for beta in [None, Some(0.2), Some(1.0)] {
            for e in [0.3, 0.95] {
                let spin = Vector3::new(0.3, -2.0, 1.0);
                let mut s = pair(law(e, 0.8, beta), f64::from(degrees), spin, 300.0);
                let before = s.energy().total();
                let (mut lowest, mut touched) = (before, false);
                for _ in 0..1500 {
                    s.advance(1).unwrap();
                    let energy = s.energy();
                    touched |= energy.elastic() > 0.0;
                    let rise = (energy.total() - lowest) / before;
                    assert!(
                        rise < 1e-4,
                        "{degrees}° β {beta:?} ε {e}: rises by {rise:e}"
                    );
                    lowest = lowest.min(energy.total());
                }
                assert!(touched);
            }
        }
    }
}

#[test]
fn restitution_at_the_usual_step() {
    // 30 steps a contact: within the 0.4/N that the normal law states, for any phase of first touch.
    for phase in 0..10 {
        let law = law(0.5, 0.5, None);
        let mut setup = setup(
            law,
            vec![
                Grain::at_rest(Vector3::zeros(), 0.5, DENSITY),
                Grain::at_rest(Vector3::new(1.0, 0.0, 0.0), 0.5, DENSITY),
            ],
            vec![],
            30.0,
        );
        setup.grains[1].velocity.x = -1.0;
        setup.grains[1].position.x += 0.1 * f64::from(phase) * setup.timestep;
        let mut s = Simulation::new(setup).unwrap();
        fly_apart(&mut s);
        let mut snapshot = Snapshot::default();
        s.snapshot(&mut snapshot);
        let out = (snapshot.grains[0].velocity - snapshot.grains[1].velocity).norm();
        assert!((out - 0.5).abs() < 0.4 / 30.0, "{out}");
    }
}

#[test]
fn a_step_over_the_other_grain_is_refused() {
    let mut s = pair(law(0.5, 0.5, None), 0.0, Vector3::zeros(), 0.001);
    let error = s.advance(10).unwrap_err().to_string();
    assert!(error.contains("too long"), "{error}");
}

#[test]
fn two_grains_in_a_vast_periodic_box_are_found() {
    let law = law(0.5, 0.5, None);
    let grains = vec![
        Grain::at_rest(Vector3::new(0.1, 0.0, 0.0), 0.5, DENSITY),
        Grain::at_rest(Vector3::new(999.2, 0.0, 0.0), 0.5, DENSITY),
    ];
    for periodic in [[true, true, false], [true; 3]] {
        let mut setup = setup(law, grains.clone(), vec![], 30.0);
        setup.domain = Domain {
            lower: Vector3::repeat(-0.0),
            upper: Vector3::repeat(1000.0),
            periodic,
        };
        let mut s = Simulation::new(setup).unwrap();
        // They overlap by 0.1 across the edge.
        assert!((s.energy().normal / (0.5 * 2e5 * 0.01) - 1.0).abs() < 1e-9);
    }
}

#[test]
fn gross_sliding_follows_coulomb() {
    // A steep hit on a floor slips throughout: v_x' = v_x - μ(1 + ε)v_z, ω' = (5/2) μ (1 + ε) v_z / R.
    let (e, mu, degrees) = (0.9, 0.1, 60.0_f64);
    let mut s = drop_on_floor(law(e, mu, None), degrees, Vector3::zeros(), 20_000.0);
    fly_apart(&mut s);
    let mut snapshot = Snapshot::default();
    s.snapshot(&mut snapshot);
    let g = &snapshot.grains[0];
    let (vx, vz) = (degrees.to_radians().sin(), degrees.to_radians().cos());
    // The dashpot pulls in the last moments and friction acts on |F_n| there: (1+ε) v_z plus twice
    // the tensile impulse, which belongs to the law (see the module of the normal law).
    let impulse = (vx - g.velocity.x) / mu;
    assert!((impulse / ((1.0 + e) * vz) - 1.0).abs() < 5e-3, "{impulse}");
    let spin = 2.5 * mu * impulse / 0.5;
    assert!((g.spin.y / spin - 1.0).abs() < 2e-3, "{} {spin}", g.spin.y);
}

#[test]
fn a_launched_sphere_ends_slipping_at_five_sevenths() {
    let mut grain = Grain::at_rest(Vector3::new(0.0, 0.0, 0.5 - 5e-6), 0.5, DENSITY);
    grain.velocity = Vector3::new(1.0, 0.0, 0.0);
    let floor = Wall::plane(Vector3::zeros(), Vector3::z());
    let law = law(0.5, 0.5, None);
    let mut setup = setup(law, vec![grain], vec![floor], 40.0);
    setup.gravity = Vector3::new(0.0, 0.0, -1.0);
    let mut s = Simulation::new(setup).unwrap();
    // Slip ends at t = (2/7) v/(μ g).
    let end = 2.0 / 7.0 / 0.5;
    s.advance((2.0 * end / s.timestep()) as u64).unwrap();
    let mut snapshot = Snapshot::default();
    s.snapshot(&mut snapshot);
    let g = &snapshot.grains[0];
    assert!((g.velocity.x - 5.0 / 7.0).abs() < 1e-4, "{}", g.velocity.x);
    assert!((g.spin.y * 0.5 - 5.0 / 7.0).abs() < 1e-4);
}

#[test]
fn a_cloud_keeps_its_momenta() {
    // 60 grains pulled into each other, with friction and rolling springs, no walls.
    let mut random = 9_u64;
    let mut uniform = || {
        random = random
            .wrapping_mul(6364136223846793005)
            .wrapping_add(1442695040888963407);
        (random >> 11) as f64 / (1_u64 << 53) as f64
    };
    let mut grains = Vec::new();
    for k in 0..64 {
        let at = Vector3::new((k % 4) as f64, (k / 4 % 4) as f64, (k / 16) as f64) * 1.15;
        let radius = 0.4 + 0.15 * uniform();
        let mut g = Grain::at_rest(at, radius, DENSITY);
        let centre = Vector3::repeat(1.7);
        g.velocity = (centre - at) * 1.5 + Vector3::new(uniform(), uniform(), uniform());
        g.spin = Vector3::new(uniform(), uniform(), uniform()) * 3.0;
        grains.push(g);
    }
    let sums = |s: &mut Simulation| {
        let mut snapshot = Snapshot::default();
        s.snapshot(&mut snapshot);
        let (mut p, mut l, mut scale) = (Vector3::zeros(), Vector3::zeros(), 0.0);
        for g in &snapshot.grains {
            p += g.mass * g.velocity;
            l += g.mass * g.position.cross(&g.velocity)
                + 0.4 * g.mass * g.radius * g.radius * g.spin;
            scale += g.mass * g.velocity.norm();
        }
        (p, l, scale)
    };
    for beta in [None, Some(1.0)] {
        let mut law = law(0.6, 0.7, beta);
        law.lever = Lever::Radius;
        let mut s = Simulation::new(setup(law, grains.clone(), vec![], 30.0)).unwrap();
        s.advance(1).unwrap();
        let l0 = s.leapfrog_angular_momentum();
        s.advance(6000).unwrap();
        let drift = (s.leapfrog_angular_momentum() - l0).norm() / l0.norm();
        assert!(drift > 1e-6, "the control must drift: {drift:e}");

        law.lever = Lever::ContactPoint;
        let mut s = Simulation::new(setup(law, grains.clone(), vec![], 30.0)).unwrap();
        let (p0, _, scale) = sums(&mut s);
        s.advance(1).unwrap();
        let l0 = s.leapfrog_angular_momentum();
        let e0 = s.energy().total();
        s.advance(6000).unwrap();
        let (p1, l1, _) = sums(&mut s);
        let drift = (s.leapfrog_angular_momentum() - l0).norm() / l0.norm();
        assert!(s.energy().total() < 0.9 * e0, "the cloud never collided");
        assert!(
            (p1 - p0).norm() < 1e-12 * scale,
            "momentum {:e}",
            (p1 - p0).norm() / scale
        );
        // Contact forces meet on the line of centres, so spins and orbits exchange exactly.
        assert!(drift < 1e-12, "angular momentum {drift:e}");
        // Velocities at the time of the positions differ from that by the step's own error.
        assert!((l1 - l0).norm() / l0.norm() < 1e-2);
    }
}
