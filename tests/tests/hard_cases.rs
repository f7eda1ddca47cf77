//! Cases that break codes: each runs at the step the limits choose, with its energy accounted for.

use colluvium_dem::timestep::{Choice, Conditions, Shares};
use colluvium_dem::*;
use colluvium_tests::DENSITY;
use nalgebra::Vector3;
use std::f64::consts::PI;

fn uniform(seed: u64) -> impl FnMut() -> f64 {
    let mut random = seed;
    move || {
        random = random
            .wrapping_mul(6364136223846793005)
            .wrapping_add(1442695040888963407);
        (random >> 11) as f64 / (1_u64 << 53) as f64
    }
}

fn floor() -> Vec<Wall> {
    vec![Wall::plane(Vector3::zeros(), Vector3::z())]
}

fn setup(law: impl Into<Laws>, grains: Vec<Grain>, walls: Vec<Wall>, gravity: f64) -> Setup {
    let reach = grains
        .iter()
        .map(|g| g.position.norm() + 4.0 * g.radius)
        .fold(0.0, f64::max);
    Setup {
        domain: Domain {
            lower: Vector3::repeat(-reach),
            upper: Vector3::repeat(reach),
            periodic: [false; 3],
        },
        gravity: Vector3::new(0.0, 0.0, -gravity),
        law: law.into(),
        grains,
        walls,
        bodies: Vec::new(),
        timestep: 1.0,
        threads: Threads::Serial,
    }
}

/// The simulation at the step that the limits choose; a step beyond the hard limit is refused.
fn at_chosen_step(mut setup: Setup) -> (Simulation, Choice) {
    let conditions = Conditions::of(&setup.grains, &setup.gravity);
    let choice = setup.choose_step(&conditions, &Shares::default()).unwrap();
    setup.timestep = 1.01 * choice.hard().unwrap().seconds;
    let refusal = setup.check_timestep(&conditions).unwrap_err().to_string();
    assert!(
        refusal.starts_with("timestep = ") && refusal.contains("must be below"),
        "{refusal}"
    );
    setup.timestep = choice.seconds;
    setup.check_timestep(&conditions).unwrap();
    (Simulation::new(setup).unwrap(), choice)
}

/// Kinetic, elastic and gravity's energy (J).
fn energy(simulation: &mut Simulation) -> f64 {
    let mut snapshot = Snapshot::default();
    simulation.snapshot(&mut snapshot);
    let free = snapshot.grains.iter().filter(|g| !g.fixed);
    let height: f64 = free
        .map(|g| g.mass * simulation.gravity().dot(&g.position))
        .sum();
    simulation.energy().total() - height
}

/// Runs and asserts that the energy never rises above its lowest by more than `tolerance` of what has
/// moved or been stored at most.
fn watch(simulation: &mut Simulation, looks: u32, steps: u64, tolerance: f64) -> f64 {
    let mut lowest = energy(simulation);
    let first = lowest;
    let mut scale: f64 = 0.0;
    for _ in 0..looks {
        simulation.advance(steps).unwrap();
        let parts = simulation.energy();
        scale = scale.max(parts.kinetic() + parts.elastic().abs());
        let now = energy(simulation);
        let rise = (now - lowest) / scale;
        assert!(
            rise < tolerance,
            "energy rises by {rise:e} at t = {:e} s",
            simulation.time()
        );
        lowest = lowest.min(now);
    }
    first - lowest
}

fn rock(youngs_modulus: f64) -> ContactLaw {
    let material = Elasticity {
        youngs_modulus,
        poissons_ratio: 0.25,
    };
    ContactLaw::hertz_mindlin(material, 0.5, 0.5)
}

#[test]
fn a_boulder_fifty_times_larger_falls_on_a_layer() {
    let mut grains = Vec::new();
    for k in 0..196 {
        let at = Vector3::new(f64::from(k % 14) - 6.5, f64::from(k / 14) - 6.5, 0.5) * 2.02;
        grains.push(Grain::at_rest(at, 1.0, DENSITY));
    }
    grains.push(Grain::at_rest(Vector3::new(0.3, 0.2, 53.0), 50.0, DENSITY));
    let (mut simulation, choice) = at_chosen_step(setup(rock(3e7), grains, floor(), 1.0));
    assert!(choice.limit().unwrap().pair.radii.contains(&1.0));
    let lost = watch(&mut simulation, 150, 200, 2e-3);
    assert!(
        lost > 0.0 && simulation.time() > 3.0,
        "{}",
        simulation.time()
    );
    assert!(simulation.largest_overlap() < 0.2);
}

#[test]
fn a_power_law_of_sizes_settles() {
    // N(>R) ~ R^-2.5 from 1 to 20, largest first, wherever there is room.
    let mut random = uniform(3);
    let mut radii: Vec<f64> = (0..240)
        .map(|_| {
            let low = 20.0_f64.powf(-2.5);
            (low + (1.0 - low) * random()).powf(-0.4)
        })
        .collect();
    radii.push(20.0);
    radii.sort_by(|a, b| b.total_cmp(a));
    let mut grains: Vec<Grain> = Vec::new();
    for r in radii {
        loop {
            let at = Vector3::new(random() - 0.5, random() - 0.5, random()) * 60.0;
            let at = at + Vector3::z() * r;
            if grains
                .iter()
                .all(|g| (g.position - at).norm() > g.radius + r)
            {
                grains.push(Grain::at_rest(at, r, DENSITY));
                break;
            }
        }
    }
    let (mut simulation, _) = at_chosen_step(setup(rock(3e7), grains, floor(), 1.0));
    watch(&mut simulation, 150, 500, 2e-3);
    assert!(simulation.time() > 10.0, "{}", simulation.time());
}

#[test]
fn materials_a_million_times_stiffer_meet() {
    let linear = |stiffness: f64| {
        ContactLaw::linear(
            Hooke::matched(stiffness, 0.5),
            TangentialSpring::matched(2.0 / 7.0, 0.5, 0.5),
            None,
        )
    };
    let laws = Laws {
        own: vec![linear(1e9), linear(1e3)],
        pairs: vec![(0, 1, linear(2e3))],
    };
    let grains = (0..27)
        .map(|k| {
            let at = Vector3::new(f64::from(k % 3), f64::from(k / 3 % 3), f64::from(k / 9));
            let at = (at - Vector3::repeat(1.0)) * 1.05;
            let mut grain = Grain::at_rest(at, 0.5, DENSITY);
            grain.material = u16::from(k % 2 == 1);
            grain.velocity = -at + Vector3::new(0.1 * f64::from(k).sin(), 0.0, 0.05);
            grain
        })
        .collect();
    let start = setup(laws, grains, vec![], 0.0);
    // The soft pair's own step is refused, with the stiff pair's limit.
    let soft = Setup {
        timestep: timestep::step(1.0, 1e3, 30.0),
        ..start.clone()
    };
    let error = soft.check_timestep(&Conditions::default()).unwrap_err();
    assert!(
        matches!(error, SetupError::Unstable { pair, .. } if pair.materials == [0, 0]),
        "{error}"
    );
    let (mut simulation, choice) = at_chosen_step(start);
    assert_eq!(choice.limit().unwrap().pair.materials, [0, 0]);
    // Three contact times of the soft pair.
    let lost = watch(&mut simulation, 160, 600, 2e-3);
    assert!(lost > 0.0);
    assert!(simulation.time() > 3.0 * PI * (0.5_f64 / 1e3).sqrt());
}

#[test]
fn a_grain_a_million_times_heavier_lands_on_a_light_one() {
    let law = ContactLaw::linear(
        Hooke::matched(4e9, 0.5),
        TangentialSpring::matched(2.0 / 7.0, 0.5, 0.5),
        None,
    );
    let light = Grain::at_rest(Vector3::new(0.0, 0.0, 0.5), 0.5, DENSITY);
    let mut heavy = Grain::at_rest(Vector3::new(0.05, 0.0, 1.51), 0.5, 1e6 * DENSITY);
    heavy.velocity.z = -1.0;
    let (mut simulation, _) = at_chosen_step(setup(law, vec![light, heavy], floor(), 1.0));
    let lost = watch(&mut simulation, 200, 2000, 1e-3);
    // Dashpots are matched to the light grain: the heavy one, squeezing it, loses √(m/M) of its energy.
    let share = lost / 0.5e6;
    assert!((1e-4..1e-2).contains(&share), "{share}");
    assert!(simulation.time() > 0.1);
    assert!(simulation.largest_overlap() < 0.2);
}

#[test]
fn regolith_grains_rest_and_let_go_at_the_force_of_their_cohesion() {
    // 10⁻⁵ g, a millimetre grain under a plane: x from 4/3 E* √(R x³) = F_c ± m g.
    let material = Elasticity {
        youngs_modulus: 1e7,
        poissons_ratio: 0.25,
    };
    let radius = 1e-3;
    let cohesions = [
        Cohesion::Dmt {
            work_of_adhesion: 1e-4,
            asperity_radius: None,
        },
        Cohesion::Constant {
            strength: 0.5,
            patch: 0.4,
        },
    ];
    for cohesion in cohesions {
        let law = ContactLaw {
            cohesion,
            ..ContactLaw::hertz_mindlin(material, 0.3, 0.5)
        };
        let grain = Grain::at_rest(Vector3::new(0.0, 0.0, radius), radius, 2500.0);
        let (mass, micro) = (grain.mass(), 9.81e-5);
        let pull = cohesion.force(radius);
        let modulus = material.effective_modulus(&material);
        let at = |load: f64| (0.75 * load / (modulus * radius.sqrt())).powf(2.0 / 3.0);
        let mut grain = grain;
        grain.position.z -= 0.5 * at(pull);
        let (mut simulation, _) = at_chosen_step(setup(law, vec![grain], floor(), micro));
        // Its own oscillation is soft: 2π √(m/k), k = 3/2 F_c/x.
        let period = 2.0 * PI * (mass * at(pull) / (1.5 * pull)).sqrt();
        let rest = (10.0 * period / simulation.timestep()) as u64;
        watch(&mut simulation, 20, rest / 20, 1e-3);
        let mut snapshot = Snapshot::default();
        simulation.snapshot(&mut snapshot);
        let overlap = snapshot.contacts[0].overlap;
        let exact = at(pull + mass * micro);
        assert!(
            (overlap / exact - 1.0).abs() < 1e-6,
            "{overlap:e} {exact:e}"
        );
        // Gravity turned round and raised slowly.
        for share in [0.5, 0.8, 0.9, 0.95, 0.98, 0.99] {
            simulation
                .set_gravity(Vector3::new(0.0, 0.0, share * pull / mass))
                .unwrap();
            simulation.advance(rest).unwrap();
        }
        simulation.snapshot(&mut snapshot);
        let hanging = at(0.01 * pull);
        assert!((snapshot.contacts[0].overlap / hanging - 1.0).abs() < 1e-2);
        simulation
            .set_gravity(Vector3::new(0.0, 0.0, 1.01 * pull / mass))
            .unwrap();
        simulation.advance(4 * rest).unwrap();
        simulation.snapshot(&mut snapshot);
        assert!(snapshot.contacts.is_empty(), "it should have let go");
    }
}

#[test]
fn rock_at_three_hundred_metres_a_second() {
    // A sampler's projectile (Thuillet 2019, ch. 5): 70 GPa, 300 m/s, centimetre grains.
    let mut grains = Vec::new();
    for k in 0..125 {
        let at = Vector3::new(
            f64::from(k % 5) - 2.0,
            f64::from(k / 5 % 5) - 2.0,
            f64::from(k / 25) + 0.5,
        );
        grains.push(Grain::at_rest(at * 0.01, 0.005, 2500.0));
    }
    let mut projectile = Grain::at_rest(Vector3::new(1e-3, 5e-4, 0.0595), 0.009, 3000.0);
    projectile.velocity.z = -300.0;
    grains.push(projectile);
    let (mut simulation, _) = at_chosen_step(setup(rock(70e9), grains, floor(), 9.81));
    let lost = watch(&mut simulation, 200, 10, 1e-2);
    assert!(
        lost > 0.0 && simulation.time() > 3e-4,
        "{}",
        simulation.time()
    );
    assert!(simulation.largest_overlap() < 0.5);
}

#[test]
fn a_column_a_thousand_high_rests_on_the_sum_of_its_weights() {
    let (n, stiffness) = (1000, 1e5);
    let law = ContactLaw::linear(
        Hooke::matched(stiffness, 0.5),
        TangentialSpring::matched(2.0 / 7.0, 0.5, 0.5),
        None,
    );
    let mut random = uniform(11);
    let mut z = 0.5;
    let mut grains = Vec::new();
    for k in 0..n {
        z -= f64::from(n - k) / stiffness;
        let mut grain = Grain::at_rest(Vector3::new(0.0, 0.0, z), 0.5, DENSITY);
        grain.velocity.z = 1e-4 * (random() - 0.5);
        grains.push(grain);
        z += 1.0;
    }
    let (mut simulation, _) = at_chosen_step(setup(law, grains, floor(), 1.0));
    let first = energy(&mut simulation);
    let moving = simulation.energy().kinetic();
    let mut lowest = first;
    for _ in 0..40 {
        simulation.advance(200).unwrap();
        let now = energy(&mut simulation);
        assert!(now - lowest < 1e-2 * moving, "{:e}", now - lowest);
        lowest = lowest.min(now);
    }
    // What was lost is what moved: the column has not sunk. Long waves hardly feel the dashpots.
    let left = simulation.energy().kinetic();
    assert!(left < 0.03 * moving, "{:e}", left / moving);
    assert!((first - lowest) < 1.01 * moving);
    let mut snapshot = Snapshot::default();
    simulation.snapshot(&mut snapshot);
    assert_eq!(snapshot.contacts.len(), 1000);
    let lowest_of = |c: &ContactSample| {
        let a = snapshot.grains[c.grain].id;
        match c.partner {
            Partner::Grain(b) => a.max(snapshot.grains[b].id),
            Partner::Wall(_) | Partner::Body(_) => 0,
        }
    };
    for contact in &snapshot.contacts {
        let exact = f64::from(n - lowest_of(contact) as i32) / stiffness;
        // Waves of 1e-4 at most in speed pass: v √(m/k) of overlap.
        assert!(
            (contact.overlap - exact).abs() < 2e-6,
            "{} at {}: {exact}",
            contact.overlap,
            lowest_of(contact)
        );
    }
}

/// Silica (Dominik & Tielens 1997): 25 mJ/m², 54 GPa, 0.17; ξ_crit 2 Å.
const SILICA: Jkr = Jkr {
    surface_energy: 0.025,
    elasticity: Elasticity {
        youngs_modulus: 54e9,
        poissons_ratio: 0.17,
    },
    damping_rate: 0.0,
    critical_rolling: 2e-10,
};

#[test]
fn adhesive_micrometre_grains_keep_their_energy_until_they_part() {
    let radius = 0.5e-6;
    let law = ContactLaw::adhesive(SILICA);
    let spacing = 2.0 * radius - SILICA.equilibrium_overlap(0.5 * radius);
    let speed = 1e-3;
    let chain: Vec<_> = (0..12)
        .map(|k| Vector3::new(f64::from(k), 0.0, 0.0))
        .collect();
    let aggregate: Vec<_> = (0..30)
        .map(|k| Vector3::new(f64::from(k % 3), f64::from(k / 3 % 3), f64::from(k / 9)))
        .collect();
    for places in [chain, aggregate] {
        let mut random = uniform(21);
        let grains = places
            .iter()
            .map(|at| {
                let mut grain = Grain::at_rest(at * spacing, radius, 2600.0);
                grain.velocity = Vector3::from_fn(|_, _| random() - 0.5) * speed;
                grain
            })
            .collect();
        let (mut simulation, _) = at_chosen_step(setup(law, grains, vec![], 0.0));
        let first = simulation.energy();
        let scale = first.kinetic();
        let mut snapshot = Snapshot::default();
        simulation.snapshot(&mut snapshot);
        let touching = snapshot.contacts.len();
        // Springs below their limits: nothing is made, broken or worn.
        for _ in 0..100 {
            simulation.advance(50).unwrap();
            let drift = (simulation.energy().total() - first.total()) / scale;
            assert!(drift.abs() < 0.03, "{drift:e}");
        }
        simulation.snapshot(&mut snapshot);
        assert_eq!(snapshot.contacts.len(), touching);
        // Pulled apart: energy is lost where contacts break and wherever they yield, never won.
        let centre = Vector3::repeat(spacing);
        simulation.give_velocity(|g| (g.position - centre) / radius * 2.0);
        watch(&mut simulation, 200, 50, 1e-2);
        simulation.snapshot(&mut snapshot);
        assert!(
            snapshot.contacts.len() < touching / 2,
            "{}",
            snapshot.contacts.len()
        );
    }
}

#[test]
fn a_step_too_long_is_told_what_would_do() {
    // Two grains driven into each other at three times the stability limit.
    let law = ContactLaw::linear(
        Hooke::matched(1e5, 0.9),
        TangentialSpring::matched(2.0 / 7.0, 0.9, 0.5),
        None,
    );
    let mut grains: Vec<Grain> = (0..3)
        .map(|k| {
            Grain::at_rest(
                Vector3::new(0.0, 0.0, 0.5 + 0.995 * f64::from(k)),
                0.5,
                DENSITY,
            )
        })
        .collect();
    grains[1].velocity.z = -0.1;
    let mut start = setup(law, grains, floor(), 1.0);
    let conditions = Conditions::of(&start.grains, &start.gravity);
    let choice = start.choose_step(&conditions, &Shares::default()).unwrap();
    start.timestep = 3.0 * choice.hard().unwrap().seconds;
    let mut simulation = Simulation::new(start.clone()).unwrap();
    let error = simulation.advance(20_000).unwrap_err().to_string();
    assert!(error.contains("s would do (limit: "), "{error}");
    // It does.
    let would_do: f64 = error
        .split("; ")
        .last()
        .and_then(|said| said.split(' ').next())
        .and_then(|seconds| seconds.parse().ok())
        .unwrap();
    start.timestep = would_do;
    let mut simulation = Simulation::new(start).unwrap();
    watch(&mut simulation, 20, 200, 1e-2);
    // Grains that start inside each other are not the step's fault.
    let inside = vec![
        Grain::at_rest(Vector3::zeros(), 0.5, DENSITY),
        Grain::at_rest(Vector3::new(0.1, 0.0, 0.0), 0.5, DENSITY),
    ];
    let mut deep = setup(law, inside, vec![], 0.0);
    deep.timestep = 0.1 * would_do;
    let error = Simulation::new(deep).unwrap().advance(10).unwrap_err();
    assert!(
        error.to_string().contains("started inside each other"),
        "{error}"
    );
}
