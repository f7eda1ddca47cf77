//! What no contact may do: create energy, care about numbering, treat a wall as another law.

use colluvium_dem::{ContactLaw, Grain, Lever, Normal, Simulation};
use colluvium_tests::impacts::*;
use colluvium_tests::laws;
use nalgebra::Vector3;

/// Angles from head-on to the last grazing ones (degrees).
const ANGLES: [f64; 14] = [
    0.0, 5.0, 15.0, 30.0, 45.0, 60.0, 70.0, 75.0, 80.0, 85.0, 87.0, 88.5, 89.5, 89.9,
];

/// Speed (m/s) that suits a law: overlaps of about a percent; adhesive grains fast enough to part again.
fn speed(law: &ContactLaw) -> f64 {
    match law.normal {
        Normal::Jkr(_) => 20.0,
        _ => 0.5,
    }
}

fn step(law: &ContactLaw, normal_speed: f64, steps: f64) -> f64 {
    let (radius, density) = laws::grain(law);
    let mass = sphere(radius, density, [0.0; 3], [0.0; 3]).mass();
    let time = match law.normal {
        // Elastic contacts last longer the slower they are; a step must also follow the springs.
        Normal::Hertz(_) | Normal::Viscoelastic(_) => {
            law.contact_time(0.5 * mass, 0.5 * radius, normal_speed.max(0.05))
        }
        _ => law.contact_time(0.5 * mass, 0.5 * radius, normal_speed),
    };
    time / steps
}

/// Two spheres, or one and the floor, about to meet at an angle, spinning.
fn meeting(
    law: ContactLaw,
    degrees: f64,
    spin: Vector3<f64>,
    wall: bool,
    steps: f64,
) -> Simulation {
    let (radius, density) = laws::grain(&law);
    let (s, c) = degrees.to_radians().sin_cos();
    let v = speed(&law);
    let spin = spin * (v / radius);
    let flying = Grain {
        velocity: Vector3::new(s, 0.0, -c) * v,
        spin,
        ..Grain::at_rest(Vector3::zeros(), radius, density)
    };
    let dt = step(&law, v * c, steps);
    if wall {
        on_floor(law, flying, dt)
    } else {
        pair(
            law,
            Grain::at_rest(Vector3::zeros(), radius, density),
            flying,
            dt,
        )
    }
}

/// Gain of energy over an impact, relative to its start; adhesive contacts may stay.
fn gain(simulation: &mut Simulation, duration: u64) -> f64 {
    let before = simulation.energy().total();
    for _ in 0..40 {
        simulation.advance(duration / 20).unwrap();
        if simulation.largest_overlap() > 0.0 && look(simulation).contacts.is_empty() {
            break;
        }
    }
    assert!(simulation.largest_overlap() > 0.0, "they missed each other");
    simulation.energy().total() / before - 1.0
}

/// Largest gain under any law of the list, at any angle, with several spins, of pairs and on the floor.
fn largest_gain(restitution: f64, steps: f64) -> (String, f64) {
    let spins = [
        Vector3::zeros(),
        Vector3::new(0.3, -1.0, 0.7),
        Vector3::new(-1.0, 2.0, 1.0),
    ];
    let all = laws::all(restitution);
    assert!(all.len() > 60);
    let mut largest = (String::new(), f64::NEG_INFINITY);
    for (name, law) in all {
        for degrees in ANGLES {
            for spin in spins {
                for wall in [false, true] {
                    let mut run = meeting(law, degrees, spin, wall, steps);
                    let gain = gain(&mut run, 4 * steps as u64);
                    if gain > largest.1 {
                        largest = (format!("{name}, {degrees}°, wall {wall}"), gain);
                    }
                }
            }
        }
    }
    largest
}

#[test]
fn no_impact_gains_energy_under_any_law_at_any_angle() {
    // LAMMPS checks the same after a fault that made grazing impacts a source of energy.
    let (which, gain) = largest_gain(0.7, 60.0);
    assert!(gain < 1e-9, "{which}: gains {gain:e}");
    // It must come near the limit, or it would not see a small gain.
    assert!(gain > -1e-4, "{which}: {gain:e}");
}

#[test]
fn nor_without_dashpots() {
    // Springs alone: what the step's own error leaves, which falls with its length.
    for (steps, allowed) in [(60.0, 3e-4), (240.0, 4e-5)] {
        let (which, gain) = largest_gain(1.0, steps);
        assert!(gain < allowed, "{which}: gains {gain:e}");
    }
}

#[test]
fn a_pair_does_not_care_which_comes_first() {
    for (name, law) in laws::all(0.7) {
        let (radius, density) = laws::grain(&law);
        let v = speed(&law);
        let dt = step(&law, v, 60.0);
        let mut a = Grain::at_rest(Vector3::new(-radius, 0.1 * radius, 0.0), radius, density);
        let mut b = Grain::at_rest(
            Vector3::new(0.81 * radius, 0.0, 0.2 * radius),
            0.8 * radius,
            density,
        );
        a.velocity = Vector3::new(v, 0.2 * v, 0.0);
        b.spin = Vector3::new(0.1, 0.5, -0.3) * (v / radius);
        let run = |grains: Vec<Grain>| {
            let mut run = simulate(scene(law, grains, vec![], dt));
            run.advance(150).unwrap();
            look(&mut run).grains
        };
        let (one, other) = (run(vec![a, b]), run(vec![b, a]));
        for (p, q) in [(&one[0], &other[1]), (&one[1], &other[0])] {
            assert_eq!(p.velocity, q.velocity, "{name}");
            assert_eq!(p.spin, q.spin, "{name}");
            assert_eq!(p.position, q.position, "{name}");
        }
    }
}

#[test]
fn a_cloud_does_not_care_about_its_numbering() {
    // Sums over a grain's contacts come in another order: the same motion to round-off.
    for (name, law) in laws::all(0.7) {
        let setup = laws::cloud(law);
        let (v, n) = (setup.grains[0].velocity.norm(), setup.grains.len());
        let order: Vec<usize> = (0..n).map(|k| (k * 11 + 5) % n).collect();
        let mut shuffled = setup.clone();
        shuffled.grains = order.iter().map(|&k| setup.grains[k]).collect();
        let [one, other] = [setup, shuffled].map(|setup| {
            let mut run = simulate(setup);
            run.advance(400).unwrap();
            assert!(run.largest_overlap() > 0.0, "{name}: they never met");
            look(&mut run)
        });
        for (k, g) in other.grains.iter().enumerate() {
            let was = &one.grains[order[k]];
            let off = (g.velocity - was.velocity).norm() / v;
            assert!(off < 1e-9, "{name}: {off:e}");
        }
    }
}

#[test]
fn a_wall_is_a_grain_of_infinite_mass_and_radius() {
    // The arm of friction is the radius: that of the contact point ends at the plane, R - x, while pairs
    // share the overlap as their radii do.
    for (name, law) in laws::all(0.7) {
        let law = ContactLaw {
            lever: Lever::Radius,
            ..law
        };
        let (radius, density) = laws::grain(&law);
        let v = speed(&law);
        let dt = step(&law, v, 60.0);
        for tilt in [0.1, 1.0] {
            let ball = sphere(
                radius,
                density,
                [tilt * v, 0.0, -v],
                [0.3 * v / radius, 0.0, 0.5 * v / radius],
            );
            let mut above = on_floor(law, ball, dt);
            let mut ball = ball;
            ball.position.z = radius * (1.0 + 1e-9);
            let big = 1e5 * radius;
            let ground = Grain {
                fixed: true,
                ..Grain::at_rest(Vector3::z() * -big, big, density)
            };
            let mut on_grain = simulate(scene(law, vec![ground, ball], vec![], dt));
            above.advance(150).unwrap();
            on_grain.advance(150).unwrap();
            let (p, q) = (look(&mut above).grains[0], look(&mut on_grain).grains[1]);
            let off = (p.velocity - q.velocity).norm() / v;
            assert!(off < 2e-4, "{name}: velocities differ by {off:e}");
            let off = (p.spin - q.spin).norm() * radius / v;
            assert!(off < 5e-4, "{name}: spins differ by {off:e}");
        }
    }
}
