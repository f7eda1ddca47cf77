//! Closed forms that LAMMPS' granular unit tests (4 Jul 2026) check, for every law that has them.

use colluvium_dem::contact::Damping;
use colluvium_dem::contact::hertz::secant_stiffness;
use colluvium_dem::{
    Cohesion, ContactLaw, Elasticity, Epsd, Grain, Hooke, Jkr, Lever, Normal, Partner, Rolling,
    ShapeParameter, Simulation, SpringStiffness, Tangential, TangentialSpring, Viscoelastic,
};
use colluvium_tests::impacts::*;
use colluvium_tests::laws;
use nalgebra::Vector3;
use std::f64::consts::PI;

const SOFT: Elasticity = material(1e7, 0.25);
const DENSITY: f64 = 2500.0;
const R: f64 = 0.01;
const G: f64 = 9.81;

fn linear(restitution: f64, friction: f64) -> ContactLaw {
    ContactLaw::linear(
        Hooke::matched(1e5, restitution),
        TangentialSpring::matched(2.0 / 7.0, restitution, friction),
        None,
    )
}

fn mass() -> f64 {
    4.0 / 3.0 * PI * R.powi(3) * DENSITY
}

/// A sphere at rest on the floor under its weight, then set going; the arm of friction is its radius.
fn resting(law: ContactLaw, velocity: [f64; 3], spin: [f64; 3], steps: f64) -> Simulation {
    let mut overlap = 1e-6;
    for _ in 0..200 {
        overlap = match law.normal {
            Normal::Hooke(h) => mass() * G / h.stiffness,
            Normal::Hertz(h) => mass() * G / secant_stiffness(h.effective_modulus, R, overlap),
            _ => unreachable!("not used with others"),
        };
    }
    let law = ContactLaw {
        lever: Lever::Radius,
        ..law
    };
    let mut ball = sphere(R, DENSITY, velocity, spin);
    ball.position.z = R - overlap;
    let k = law.stiffness(R, overlap).normal;
    let mut setup = scene(
        law,
        vec![ball],
        vec![floor()],
        PI * (mass() / k).sqrt() / steps,
    );
    setup.gravity.z = -G;
    simulate(setup)
}

fn at(simulation: &mut Simulation, time: f64) -> colluvium_dem::GrainSample {
    let steps = (time / simulation.timestep()).round() as u64;
    simulation.advance(steps - simulation.steps_done()).unwrap();
    look(simulation).grains[0]
}

#[test]
fn hertz_energy_balance() {
    // ½ μ V² = ⅖ P α at the largest overlap α under the force P, μ the reduced mass.
    for (speed, radii) in [(0.1, [R, R]), (1.0, [R, 3.0 * R]), (3.0, [R, 0.4 * R])] {
        let law = elastic(SOFT, SOFT, 1.0, 0.3);
        let ball = |r: f64, v: f64| sphere(r, DENSITY, [0.0, 0.0, v], [0.0; 3]);
        let [a, b] = radii.map(|r| ball(r, 0.0).mass());
        let m = a * b / (a + b);
        let r = radii[0] * radii[1] / (radii[0] + radii[1]);
        let dt = law.contact_time(m, r, speed) / 4000.0;
        let impact = collide(&mut pair(
            law,
            ball(radii[0], speed),
            ball(radii[1], 0.0),
            dt,
        ));
        let stored = 0.4 * impact.force * impact.overlap;
        assert_close("energy", stored, 0.5 * m * speed * speed, 1e-5);
    }
}

#[test]
fn gross_slip_and_spin_impact() {
    // v_x' = v_x - μ(1+e) v_z, ω' = (5/2) μ (1+e) v_z/R where nothing pulls (e = 1), for each pair of
    // normal and tangential law; and the same for a sphere that only spins.
    let (mu, vz) = (0.2, 1.0);
    let soft_spring = Tangential::Linear(TangentialSpring {
        stiffness: SpringStiffness::Absolute(3e4),
        damping: Damping::Restitution(1.0),
        friction: mu,
    });
    let hertz = elastic(SOFT, SOFT, 1.0, mu);
    let viscous = Normal::Viscoelastic(Viscoelastic::of(SOFT, 0.0));
    for law in [
        linear(1.0, mu),
        hertz,
        ContactLaw {
            tangential: soft_spring,
            ..hertz
        },
        ContactLaw {
            normal: viscous,
            ..hertz
        },
        ContactLaw {
            normal: viscous,
            tangential: soft_spring,
            ..hertz
        },
    ] {
        let law = ContactLaw {
            lever: Lever::Radius,
            ..law
        };
        let dt = law.contact_time(mass(), R, vz) / 4000.0;
        for (vx, spin) in [(4.0, 0.0), (0.0, -400.0)] {
            let ball = sphere(R, DENSITY, [vx, 0.0, -vz], [0.0, spin, 0.0]);
            let g = collide(&mut on_floor(law, ball, dt)).grains[0];
            assert_close("v_x", g.velocity.x, vx - mu * 2.0 * vz, 1e-3);
            assert_close("ω", g.spin.y - spin, 2.5 * mu * 2.0 * vz / R, 1e-3);
        }
    }
}

#[test]
fn slip_transient_and_cessation() {
    // u = u_0 - μ g t until (2/7) u_0/(μ g), then 5/7 u_0.
    for law in [linear(0.5, 0.3), elastic(SOFT, SOFT, 0.5, 0.3)] {
        let (u, mu) = (0.5, 0.3);
        let end = 2.0 * u / (7.0 * mu * G);
        let mut run = resting(law, [u, 0.0, 0.0], [0.0; 3], 60.0);
        for share in [0.25, 0.5, 0.9] {
            let g = at(&mut run, share * end);
            let t = run.time();
            assert_close("u", g.velocity.x, u - mu * G * t, 1e-3);
            assert_close("ω", g.spin.y, 2.5 * mu * G * t / R, 5e-3);
        }
        let g = at(&mut run, 8.0 * end);
        assert_close("u, rolling", g.velocity.x, 5.0 / 7.0 * u, 1e-4);
        assert_close("R ω", R * g.spin.y, 5.0 / 7.0 * u, 1e-4);
    }
}

#[test]
fn rolling_decay() {
    // A moment μ_r R F_n. Free of friction it stops a spin at 5 μ_r g/(2R): that is LAMMPS' form, which
    // holds for a sphere that turns on the spot. One that rolls without slip carries its momentum along,
    // (7/5) m R² instead of (2/5) m R² about the contact: 5/7 μ_r g/R.
    let mu_r = 0.05;
    let rolling = Rolling::Epsd(Epsd {
        rolling_friction: mu_r,
        damping_ratio: 0.3,
    });
    for law in [linear(0.5, 0.0), elastic(SOFT, SOFT, 0.5, 0.0)] {
        let mut run = resting(
            ContactLaw { rolling, ..law },
            [0.0; 3],
            [0.0, 30.0, 0.0],
            60.0,
        );
        let (a, b) = (at(&mut run, 0.01).spin.y, at(&mut run, 0.11).spin.y);
        assert_close("on the spot", (a - b) / 0.1, 2.5 * mu_r * G / R, 2e-3);
    }
    for law in [linear(0.5, 0.8), elastic(SOFT, SOFT, 0.5, 0.8)] {
        let law = ContactLaw { rolling, ..law };
        let mut run = resting(law, [0.3, 0.0, 0.0], [0.0, 30.0, 0.0], 60.0);
        let (a, b) = (at(&mut run, 0.1).spin.y, at(&mut run, 0.5).spin.y);
        assert_close(
            "along the way",
            (a - b) / 0.4,
            5.0 / 7.0 * mu_r * G / R,
            2e-3,
        );
    }
}

#[test]
fn rolling_down_an_incline() {
    // v = (5/7) g (sin θ - μ_r cos θ) t; rest for μ_r ≥ tan θ.
    for base in [linear(0.5, 0.8), elastic(SOFT, SOFT, 0.5, 0.8)] {
        for (degrees, mu_r) in [
            (15.0_f64, 0.0),
            (15.0, 0.1),
            (15.0, 0.2),
            (5.0, 0.1),
            (11.0, 0.2),
        ] {
            let law = ContactLaw {
                rolling: Rolling::Epsd(Epsd {
                    rolling_friction: mu_r,
                    damping_ratio: 0.3,
                }),
                ..base
            };
            let slope = degrees.to_radians();
            let mut run = resting(law, [0.0; 3], [0.0; 3], 40.0);
            run.set_gravity(Vector3::new(slope.sin(), 0.0, -slope.cos()) * G)
                .unwrap();
            let a = at(&mut run, 0.2).velocity.x;
            let b = at(&mut run, 0.6).velocity.x;
            if mu_r < slope.tan() {
                let expected = 5.0 / 7.0 * G * (slope.sin() - mu_r * slope.cos());
                assert_close("acceleration", (b - a) / 0.4, expected, 3e-3);
            } else {
                assert!(b.abs() < 1e-6, "{degrees}° {mu_r}: {b}");
            }
        }
    }
}

#[test]
fn twist_decay() {
    // Shape springs (Thuillet 2019, Eq. 2.11, 2.13): M_T = μ_T β R μ m g about the normal stops a spin at
    // ω̇ = -(5/2) μ_T β μ g/R.
    let (beta, mu_t, mu) = (0.4, 1.3, 0.5);
    let rolling = Rolling::Shape(ShapeParameter {
        beta,
        rolling_friction: 1.05,
        twisting_friction: mu_t,
    });
    for law in [linear(0.5, mu), elastic(SOFT, SOFT, 0.5, mu)] {
        let spin = [0.0, 0.0, 100.0];
        let mut run = resting(ContactLaw { rolling, ..law }, [0.0; 3], spin, 60.0);
        let a = at(&mut run, 0.02).spin.z;
        let b = at(&mut run, 0.12).spin.z;
        assert_close("ω̇", (a - b) / 0.1, 2.5 * mu_t * beta * mu * G / R, 2e-3);
        let rest = at(&mut run, 1.5).spin;
        assert!(rest.norm() < 1e-6, "{rest}");
    }
}

/// How a contact under a growing pull ended.
struct Pull {
    /// Largest tension carried (N).
    tension: f64,
    /// Overlap before the loss (m).
    lost: f64,
}

/// Grows the pull (N) on a grain above a fixed one, by a weight upwards, to 1.2 `scale` or until they part.
fn pull_apart(law: ContactLaw, radius: f64, start: f64, scale: f64, dt: f64, steps: u64) -> Pull {
    let lower = Grain {
        fixed: true,
        ..Grain::at_rest(Vector3::zeros(), radius, DENSITY)
    };
    let height = 2.0 * radius - start;
    let upper = Grain::at_rest(Vector3::z() * height, radius, DENSITY);
    let m = upper.mass();
    let mut run = simulate(scene(law, vec![lower, upper], vec![], dt));
    let (mut tension, mut lost) = (0.0_f64, 0.0);
    for k in 0..steps {
        let pull = 1.2 * scale * k as f64 / steps as f64;
        run.set_gravity(Vector3::z() * (pull / m)).unwrap();
        run.advance(20).unwrap();
        let now = look(&mut run);
        let Some(contact) = now.contacts.first() else {
            return Pull { tension, lost };
        };
        tension = tension.max(-contact.force.dot(&normal(contact)));
        lost = contact.overlap;
    }
    panic!("they never part");
}

#[test]
fn dmt_pull_off() {
    // F = 2πRw = 4πγR, w = 2γ: the contact parts where the pull exceeds it, at no overlap.
    let (radius, gamma) = (1e-3, 0.05);
    let reduced = 0.5 * radius;
    let law = ContactLaw {
        cohesion: Cohesion::Dmt {
            work_of_adhesion: 2.0 * gamma,
            asperity_radius: None,
        },
        ..elastic(SOFT, SOFT, 0.3, 0.3)
    };
    let force = 4.0 * PI * gamma * reduced;
    let start = (0.75 * force / (SOFT.effective_modulus(&SOFT) * reduced.sqrt())).powf(2.0 / 3.0);
    let dt = law.contact_time(0.5 * mass() * 1e-3, reduced, 1e-3) / 200.0;
    let pull = pull_apart(law, radius, start, force, dt, 6000);
    assert_close("pull-off force", pull.tension, force, 2e-3);
    assert!(pull.lost.abs() < 0.05 * start, "{:e}", pull.lost);
}

/// Overlaps (m) and normal forces (N) of a contact moved evenly from one overlap to another, where it is.
fn moved(law: ContactLaw, radius: f64, from: f64, to: f64) -> Vec<(f64, f64)> {
    let (dt, steps) = (1e-6, 2000);
    let lower = Grain {
        fixed: true,
        ..Grain::at_rest(Vector3::zeros(), radius, DENSITY)
    };
    // So heavy that no contact force moves it.
    let mut upper = Grain::at_rest(Vector3::z() * (2.0 * radius - from), radius, 1e12);
    upper.velocity.z = (from - to) / (f64::from(steps) * dt);
    let mut run = simulate(scene(law, vec![lower, upper], vec![], dt));
    let mut seen = Vec::new();
    for _ in 0..steps {
        run.advance(1).unwrap();
        let now = look(&mut run);
        if let Some(c) = now.contacts.first() {
            let n = (now.grains[1].position - now.grains[0].position).normalize();
            let sense = if c.grain == 1 { 1.0 } else { -1.0 };
            seen.push((c.overlap, sense * c.force.dot(&n)));
        }
    }
    seen
}

#[test]
fn jkr_pull_off() {
    let (radius, gamma) = (1e-3, 0.05);
    let reduced = 0.5 * radius;
    let jkr = |damping_rate| Jkr {
        surface_energy: gamma,
        elasticity: SOFT,
        damping_rate,
        critical_rolling: 1e-8,
    };
    let force = 3.0 * PI * gamma * reduced;
    let a0 = (9.0 * PI * gamma * reduced * reduced / SOFT.effective_modulus(&SOFT)).cbrt();
    let gap = a0 * a0 / (2.0 * 6.0_f64.cbrt() * reduced);

    // Moved together: nothing before the surfaces meet, then -8/9 F_c at once.
    let law = ContactLaw::adhesive(jkr(0.0));
    let together = moved(law, radius, -0.9 * gap, 0.5 * gap);
    let (made, first) = together[0];
    assert!((0.0..0.01 * gap).contains(&made), "{made:e}");
    assert_close("force at no overlap", first, -8.0 / 9.0 * force, 5e-3);
    // Moved apart: F_c at the most, -8/9 F_c at no overlap again, -5/9 F_c at the loss at -x_c.
    let apart = moved(law, radius, a0 * a0 / (3.0 * reduced), -1.5 * gap);
    let tension = apart.iter().map(|c| -c.1).fold(0.0, f64::max);
    assert_close("pull-off force", tension, force, 1e-5);
    let nearest = apart.iter().min_by(|a, b| a.0.abs().total_cmp(&b.0.abs()));
    assert_close(
        "force at no overlap",
        nearest.unwrap().1,
        -8.0 / 9.0 * force,
        2e-3,
    );
    assert!(apart[0].1.abs() < 1e-2 * force, "in balance at a_0²/(3R)");
    let &(lost, last) = apart.last().unwrap();
    assert_close("overlap at the loss", lost, -gap, 5e-3);
    // The force is steep there: a step before, it is not yet -5/9.
    assert!(
        (-0.68..-5.0 / 9.0).contains(&(last / force)),
        "{}",
        last / force
    );

    // Under a growing weight the same force parts them; the dashpot adds a little once they run.
    let law = ContactLaw::adhesive(jkr(1e3));
    let dt = law.contact_time(mass() * 1e-3, reduced, 1.0) / 100.0;
    let pull = pull_apart(law, radius, a0 * a0 / (3.0 * reduced), force, dt, 20_000);
    assert_close("pull-off force", pull.tension, force, 4e-3);
    assert!(
        (-1.0..-0.5).contains(&(pull.lost / gap)),
        "{}",
        pull.lost / gap
    );
}

#[test]
fn jkr_impacts_lose_the_work_of_parting() {
    // Contact is made at zero overlap and lost at -x_c. In s with x = x_c (s⁴ - 4s)/3 the energy is
    // (8/9) F_c x_c s⁴ (s⁶/60 - s³/6 + 1/4): from s³ = 4 to s = 1 it rises by (8/9)(0.1 + 0.15·4^{4/3}), so
    // ½ m v'² = ½ m v² - 0.9355 F_c x_c, and slower impacts stick.
    let (radius, gamma) = (1e-3, 0.05);
    let reduced = 0.5 * radius;
    let jkr = Jkr {
        surface_energy: gamma,
        elasticity: SOFT,
        damping_rate: 0.0,
        critical_rolling: 1e-8,
    };
    let law = ContactLaw::adhesive(jkr);
    let ball = |v: f64| sphere(radius, DENSITY, [0.0, 0.0, v], [0.0; 3]);
    let m = 0.5 * ball(0.0).mass();
    let loss = 8.0 / 9.0
        * (0.1 + 0.15 * 4.0_f64.powf(4.0 / 3.0))
        * jkr.pull_off_force(reduced)
        * jkr.pull_off_gap(reduced);
    let sticking = (2.0 * loss / m).sqrt();
    let dt = law.contact_time(m, reduced, 1.0) / 4000.0;
    for speed in [1.02 * sticking, 1.5 * sticking, 5.0 * sticking] {
        let impact = collide(&mut pair(law, ball(0.5 * speed), ball(-0.5 * speed), dt));
        let out = impact.grains[1].velocity.z - impact.grains[0].velocity.z;
        let left = speed * speed - sticking * sticking;
        assert_close(
            "v'²",
            out * out / (sticking * sticking),
            left / (sticking * sticking),
            2e-2,
        );
    }
    let speed = 0.98 * sticking;
    let mut run = pair(law, ball(0.5 * speed), ball(-0.5 * speed), dt);
    run.advance(100_000).unwrap();
    assert_eq!(look(&mut run).contacts.len(), 1, "a slow impact sticks");
}

#[test]
fn a_stack_at_rest_stores_what_theory_says() {
    // Ten grains on a floor: contact k carries the weight above it. Hooke: Σ F²/2k; Hertz: Σ ⅖ F x with
    // x = (3F/(4E*√R'))^{2/3}.
    for law in [linear(0.3, 0.5), elastic(SOFT, SOFT, 0.3, 0.5)] {
        let n = 10;
        let modulus = SOFT.effective_modulus(&SOFT);
        let overlap = |force: f64, r: f64| match law.normal {
            Normal::Hooke(h) => force / h.stiffness,
            _ => (0.75 * force / (modulus * r.sqrt())).powf(2.0 / 3.0),
        };
        let (mut z, mut stored, mut grains) = (0.0, 0.0, Vec::new());
        for k in 0..n {
            let force = mass() * G * f64::from(n - k);
            let (r, below) = if k == 0 { (R, 0.0) } else { (0.5 * R, R) };
            let x = overlap(force, r);
            z += below + R - x;
            stored += match law.normal {
                Normal::Hooke(_) => 0.5 * force * x,
                _ => 0.4 * force * x,
            };
            grains.push(Grain::at_rest(Vector3::z() * z, R, DENSITY));
        }
        let dt = 1e-5;
        let mut setup = scene(law, grains, vec![floor()], dt);
        setup.gravity.z = -G;
        let mut run = simulate(setup);
        run.advance(20_000).unwrap();
        let energy = run.energy();
        assert_close("energy", energy.elastic(), stored, 1e-9);
        assert!(energy.kinetic() < 1e-18 * stored, "{:e}", energy.kinetic());
        for c in &look(&mut run).contacts {
            let k = match c.partner {
                Partner::Grain(j) => c.grain.max(j),
                Partner::Wall(_) | Partner::Body(_) => 0,
            };
            let force = mass() * G * (n as usize - k) as f64;
            assert_close("force", c.force.z.abs(), force, 1e-9);
        }
    }
}

#[test]
fn momentum_is_conserved_to_round_off_by_every_law() {
    for (name, law) in laws::all(0.7) {
        let mut run = simulate(laws::cloud(law));
        run.advance(1).unwrap();
        let (p, l) = (run.leapfrog_momentum(), run.leapfrog_angular_momentum());
        let now = look(&mut run);
        let scale: f64 = now.grains.iter().map(|g| g.mass * g.velocity.norm()).sum();
        let mut touched = 0;
        for _ in 0..20 {
            run.advance(100).unwrap();
            touched += look(&mut run).contacts.len();
        }
        assert!(touched > 20, "{name}: the cloud never collided");
        let drift = (run.leapfrog_momentum() - p).norm() / scale;
        assert!(drift < 1e-13, "{name}: momentum {drift:e}");
        let drift = (run.leapfrog_angular_momentum() - l).norm() / (scale * laws::grain(&law).0);
        assert!(drift < 1e-12, "{name}: angular momentum {drift:e}");
    }
}
