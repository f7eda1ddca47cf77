//! Rolling resistance: the tests of Ai et al., Powder Technology 206, 269 (2011), with the EPSD law.
//!
//! A sphere launched on a plane without spin slides at deceleration μ g until v = 5/7 v_0, at
//! t = 2 v_0/(7 μ g). From then it rolls. With the rolling moment at its limit M = μ_r R F_n:
//! ```text
//! m v̇ = -f,   (2/5) m R² ω̇ = f R - M,   v = R ω   →   v̇ = -(5/7) μ_r g,   f = (5/7) μ_r m g
//! ```
//! so a rolling sphere loses 5/7 μ_r g, and one that turns on the spot without friction loses
//! ω̇ = -(5/2) μ_r g/R. On a slope: v̇ = (5/7) g (sin θ - μ_r cos θ), rest where μ_r ≥ tan θ.
//!
//! That is for an arm of friction of R. Ours ends at the plane, l = R - x, and a soft sphere's overlap is
//! seen: with q = R/l, slip ends at v = v_0/(1 + 0.4 q²), and rolling is
//! `v̇ = g (sin θ - μ_r q cos θ)/(1 + 0.4 q²)`.

use colluvium_dem::{
    ContactLaw, Elasticity, Epsd, Grain, Partner, Rolling, ShapeParameter, Simulation,
};
use colluvium_tests::impacts::*;
use nalgebra::Vector3;

const R: f64 = 0.05;
const DENSITY: f64 = 1056.0;
const SOFT: Elasticity = material(4e6, 0.3);
const G: f64 = 9.81;

fn rolls(rolling: Option<(f64, f64)>) -> ContactLaw {
    ContactLaw {
        rolling: rolling.map_or(Rolling::None, |(rolling_friction, damping_ratio)| {
            Rolling::Epsd(Epsd {
                rolling_friction,
                damping_ratio,
            })
        }),
        ..elastic(SOFT, SOFT, 0.4, 0.8)
    }
}

/// Overlap (m) under the weight's part across a slope.
fn overlap(slope: f64) -> f64 {
    let weight = sphere(R, DENSITY, [0.0; 3], [0.0; 3]).mass() * G * slope.cos();
    (0.75 * weight / (SOFT.effective_modulus(&SOFT) * R.sqrt())).powf(2.0 / 3.0)
}

/// R over the arm of friction.
fn arm_ratio(slope: f64) -> f64 {
    R / (R - overlap(slope))
}

/// Deceleration of a rolling sphere up a slope, of the equation above.
fn deceleration(mu_r: f64, slope: f64) -> f64 {
    let q = arm_ratio(slope);
    G * (mu_r * q * slope.cos() - slope.sin()) / (1.0 + 0.4 * q * q)
}

/// A sphere of case F that rests on the floor under its weight, launched along x, on a slope.
fn launched(law: ContactLaw, speed: f64, slope: f64, dt: f64) -> Simulation {
    let mut ball = sphere(R, DENSITY, [speed, 0.0, 0.0], [0.0; 3]);
    ball.position.z = R - overlap(slope);
    let mut setup = scene(law, vec![ball], vec![floor()], dt);
    setup.gravity = Vector3::new(slope.sin(), 0.0, -slope.cos()) * G;
    simulate(setup)
}

fn until(simulation: &mut Simulation, time: f64) -> [f64; 2] {
    let steps = (time / simulation.timestep()).round() as u64;
    simulation.advance(steps - simulation.steps_done()).unwrap();
    let now = look(simulation);
    [now.grains[0].velocity.x, now.grains[0].spin.y]
}

const DT: f64 = 5e-6;
const SLIP_END: f64 = 2.0 / (7.0 * 0.8 * G);

#[test]
fn slip_ends_at_five_sevenths_and_rolling_goes_on() {
    let mut run = launched(rolls(None), 1.0, 0.0, DT);
    let [v, w] = until(&mut run, 0.5 * SLIP_END);
    assert_close("v, sliding", v, 1.0 - 0.8 * G * 0.5 * SLIP_END, 1e-3);
    let q = arm_ratio(0.0);
    assert_close(
        "ω, sliding",
        w,
        2.5 * 0.8 * G * 0.5 * SLIP_END / (q * R),
        1e-3,
    );
    let [before, _] = until(&mut run, 0.98 * SLIP_END);
    assert!(before > 5.0 / 7.0);
    // The tangential spring swings at 50 Hz for a while.
    let [v, w] = until(&mut run, 0.5);
    let [late, _] = until(&mut run, 2.0);
    // Case F, no rolling resistance: LAMMPS 0.71429 (arm R), LIGGGHTS 0.71261 (arm R - x/2).
    assert_close("v, rolling", v, 1.0 / (1.0 + 0.4 * q * q), 1e-4);
    assert_close("v, rolling, against a rigid sphere", v, 5.0 / 7.0, 6e-3);
    let half = 2.0 * q / (1.0 + q);
    assert_close("LIGGGHTS", 0.712_609, 1.0 / (1.0 + 0.4 * half * half), 1e-4);
    assert_close("v, later", late, v, 1e-9);
    assert_close("no slip", q * v / (R * w), 1.0, 1e-6);
}

#[test]
fn rolling_friction_brings_it_to_rest() {
    // Case F: (η_r, deceleration and time of rest of LAMMPS' spring-dashpot-slider and LIGGGHTS' EPSD).
    for (eta, decelerations, rests) in [
        (0.0, [1.402, 1.393], [0.516, 0.512]),
        (0.3, [1.402, 1.407], [0.512, 0.497]),
    ] {
        let mut run = launched(rolls(Some((0.2, eta))), 1.0, 0.0, DT);
        let early = until(&mut run, 0.1);
        let later = until(&mut run, 0.45);
        let lost = (early[0] - later[0]) / 0.35;
        assert_close("deceleration", lost, deceleration(0.2, 0.0), 1e-3);
        assert_close("that of a rigid sphere", lost, 5.0 / 7.0 * 0.2 * G, 1e-2);
        for peer in decelerations {
            assert_close("deceleration of the codes", lost, peer, 1.5e-2);
        }
        let rest = (0..)
            .map(|k| 0.45 + 1e-3 * f64::from(k))
            .find(|&t| until(&mut run, t)[0] <= 0.0)
            .unwrap();
        assert!(rests.iter().any(|r| (rest - r).abs() < 0.015), "{rest}");
        // After rest it rocks on its rolling spring: for ever without its dashpot (0.67 rad/s in both
        // codes), away with it (a part in 500 of that by 1 s, 1e-8 rad/s by 2 s).
        let mut swing = 0.0_f64;
        for k in 0..200 {
            swing = swing.max(until(&mut run, 1.5 + 2.5e-3 * f64::from(k))[1].abs());
        }
        if eta == 0.0 {
            assert!((0.4..0.8).contains(&swing), "{swing}");
        } else {
            assert!(swing < 1e-4, "{swing}");
            assert!(until(&mut run, 2.5)[1].abs() < 1e-8);
        }
    }
}

#[test]
fn on_a_slope_it_rolls_or_rests() {
    for (degrees, mu_r) in [(10.0_f64, 0.05), (20.0, 0.2), (25.0, 0.0)] {
        let slope = degrees.to_radians();
        let mut run = launched(rolls(Some((mu_r, 0.3))), 0.0, slope, DT);
        let [a, _] = until(&mut run, 0.2);
        let [b, w] = until(&mut run, 0.6);
        assert_close(
            "acceleration",
            (b - a) / 0.4,
            -deceleration(mu_r, slope),
            1e-3,
        );
        let rigid = 5.0 / 7.0 * G * (slope.sin() - mu_r * slope.cos());
        assert_close("that of a rigid sphere", (b - a) / 0.4, rigid, 1.5e-2);
        assert_close("no slip", arm_ratio(slope) * b / (R * w), 1.0, 1e-3);
    }
    for (degrees, mu_r) in [(10.0_f64, 0.2), (11.0, 0.2), (20.0, 0.4)] {
        let mut run = launched(rolls(Some((mu_r, 0.3))), 0.0, degrees.to_radians(), DT);
        let [v, w] = until(&mut run, 2.0);
        assert!(
            v.abs() < 1e-8 && w.abs() < 1e-6,
            "{degrees}° {mu_r}: {v} {w}"
        );
    }
    // tan θ on either side of μ_r: the spring's own swing yields a little below it, not more than 3 %.
    let limit = 0.2_f64.atan().to_degrees();
    for (degrees, rests) in [(0.9 * limit, true), (1.03 * limit, false)] {
        let mut run = launched(rolls(Some((0.2, 0.3))), 0.0, degrees.to_radians(), DT);
        let [v, _] = until(&mut run, 2.0);
        assert_eq!(v < 1e-3, rests, "{degrees}°: {v}");
    }
}

/// 216 grains that fall into a heap on a plane; at even intervals their kinetic energy without, and that
/// with, the spin of grains that touch once about that contact's normal.
fn heap(rolling: Rolling, intervals: usize) -> Vec<[f64; 2]> {
    let law = ContactLaw {
        rolling,
        ..rolls(None)
    };
    let mut state = 5_u64;
    let mut random = || {
        state = state
            .wrapping_mul(6364136223846793005)
            .wrapping_add(1442695040888963407);
        (state >> 11) as f64 / (1_u64 << 53) as f64 - 0.5
    };
    let mut grains = Vec::new();
    for k in 0..216 {
        let cell = Vector3::new((k % 6) as f64, (k / 6 % 6) as f64, (k / 36) as f64);
        let jitter = Vector3::new(random(), random(), random()) * 0.2;
        let radius = 0.8 * R * (1.0 + 0.2 * random());
        let at = (cell + jitter + Vector3::new(0.0, 0.0, 0.6)) * 2.2 * R;
        grains.push(Grain::at_rest(at, radius, DENSITY));
    }
    let mut setup = scene(law, grains, vec![floor()], 2e-4);
    setup.gravity.z = -G;
    let mut run = simulate(setup);
    (0..intervals)
        .map(|_| {
            run.advance(1000).unwrap();
            let now = look(&mut run);
            let mut normals = vec![Vec::new(); now.grains.len()];
            for c in &now.contacts {
                normals[c.grain].push(normal(c));
                if let Partner::Grain(j) = c.partner {
                    normals[j].push(normal(c));
                }
            }
            let mut sums = [0.0; 2];
            for (g, normals) in now.grains.iter().zip(&normals) {
                let inertia = 0.4 * g.mass * g.radius * g.radius;
                let all =
                    0.5 * (g.mass * g.velocity.norm_squared() + inertia * g.spin.norm_squared());
                let twist = match normals[..] {
                    [n] => 0.5 * inertia * g.spin.dot(&n).powi(2),
                    _ => 0.0,
                };
                sums[0] += all - twist;
                sums[1] += all;
            }
            sums
        })
        .collect()
}

#[test]
fn a_heap_comes_to_rest_with_rolling_springs_and_dashpots() {
    let epsd = Rolling::Epsd(Epsd {
        rolling_friction: 0.4,
        damping_ratio: 0.3,
    });
    let energy = heap(epsd, 32);
    let start = energy[0][1];
    let [last, with_twist] = energy[31];
    assert!(last < 1e-14 * start, "{:e} of the start", last / start);
    assert!(last < 0.1 * energy[27][0], "it no longer falls");
    // EPSD turns about the normal freely: grains that touch once go on spinning there.
    assert!(with_twist > 1e-4 * start && (with_twist / energy[27][1] - 1.0).abs() < 1e-6);

    // Shape springs resist that too: all comes to rest.
    let shape = Rolling::Shape(ShapeParameter {
        beta: 0.4,
        rolling_friction: 1.05,
        twisting_friction: 1.3,
    });
    let energy = heap(shape, 56);
    let [start, last] = [energy[0][1], energy[55][1]];
    assert!(last < 1e-14 * start, "{:e} of the start", last / start);
    assert!(last < 0.5 * energy[51][1], "it no longer falls");
}

#[test]
fn without_them_it_does_not() {
    // Without the dashpot grains rock on their springs; with friction alone they roll away. (Ai et al. find
    // the same of a moment of constant size, which this library does not have.)
    let undamped = Rolling::Epsd(Epsd {
        rolling_friction: 0.4,
        damping_ratio: 0.0,
    });
    let energy = heap(undamped, 20);
    assert!(energy[19][0] > 1e-8 * energy[0][1], "{:e}", energy[19][0]);
    let energy = heap(Rolling::None, 10);
    assert!(energy[9][0] > 0.1 * energy[0][1], "{:e}", energy[9][0]);
}
