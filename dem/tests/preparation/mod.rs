//! Preparations against known packings, and against what they promise.
use colluvium_dem::preparation::*;
use colluvium_dem::*;
use nalgebra::{UnitQuaternion, Vector3};
use std::f64::consts::PI;
use std::ops::ControlFlow;

mod goes_on;

fn go(_: &RestMeasures) -> ControlFlow<()> {
    ControlFlow::Continue(())
}

fn block(lower: [f64; 3], upper: [f64; 3]) -> Region {
    Region::Block {
        lower: lower.into(),
        upper: upper.into(),
    }
}

fn cube(edge: f64, periodic: [bool; 3]) -> Domain {
    Domain {
        lower: Vector3::zeros(),
        upper: Vector3::repeat(edge),
        periodic,
    }
}

fn equal(radius: f64) -> RadiusLaw {
    RadiusLaw::Uniform {
        low: radius,
        high: radius,
    }
}

/// Density of unit spheres by diameter with mass 1.
const UNIT: f64 = 6.0 / PI;

fn insertion(region: Region, domain: Domain, radius: RadiusLaw, amount: Amount) -> Insertion {
    Insertion {
        region,
        domain,
        ingredients: vec![Ingredient::alone(radius, UNIT)],
        amount,
        gap: 0.0,
        velocity: Vector3::zeros(),
        tries: TRIES,
        seed: 7,
    }
}

fn nearest_gap(grains: &[Grain], domain: &Domain) -> f64 {
    let mut nearest = f64::INFINITY;
    for (k, a) in grains.iter().enumerate() {
        for b in &grains[..k] {
            let apart = domain.nearest_image(a.position - b.position).norm();
            nearest = nearest.min(apart - a.radius - b.radius);
        }
    }
    nearest
}

#[test]
fn inserted_grains_lie_in_their_region_and_never_overlap() {
    let power = RadiusLaw::PowerLaw {
        smallest: 0.1,
        largest: 0.6,
        index: 2.5,
    };
    let pipe = Region::All(vec![
        Region::Cylinder {
            point: Vector3::new(4.0, 4.0, 0.0),
            axis: Vector3::z(),
            radius: 3.5,
        },
        block([0.0; 3], [8.0; 3]),
    ]);
    let ball = Region::Ball {
        center: Vector3::repeat(4.0),
        radius: 3.9,
    };
    for (region, periodic) in [
        (pipe, [false; 3]),
        (ball, [false; 3]),
        (Region::Everywhere, [true; 3]),
        (block([0.0; 3], [8.0, 8.0, 5.0]), [true, true, false]),
    ] {
        let domain = cube(8.0, periodic);
        let amount = Amount::SolidFraction(0.25);
        let spec = insertion(region, domain, power.clone(), amount);
        let (grains, report) = insert_loose(&spec, &[]).unwrap();
        assert!(nearest_gap(&grains, &domain) >= 0.0);
        // Met to half a grain.
        let grain = 4.0 / 3.0 * PI * 0.6_f64.powi(3) / report.region_volume;
        assert!(
            (report.solid_fraction - 0.25).abs() < 0.6 * grain,
            "{report}"
        );
        assert!(report.sizes[0].distance < report.sizes[0].distance_of_chance);
        let inside = |g: &Grain| spec.region.depth(&g.position) >= g.radius - 1e-12;
        if periodic == [false; 3] {
            assert!(grains.iter().all(inside));
        } else {
            assert!(!grains.iter().all(|g| {
                let free = |k: usize| g.position[k] > g.radius && g.position[k] < 8.0 - g.radius;
                free(0) && free(1)
            }));
            assert!(
                grains
                    .iter()
                    .all(|g| periodic[2] || g.position.z >= g.radius)
            );
        }
        assert_eq!(
            insert_loose(&spec, &[]).unwrap().0,
            grains,
            "the seed decides"
        );
        // More among them, not touching either.
        let more = Insertion {
            ingredients: vec![Ingredient::alone(equal(0.05), UNIT)],
            amount: Amount::Grains(200),
            gap: 0.01,
            seed: 8,
            ..spec
        };
        let (mut all, _) = insert_loose(&more, &grains).unwrap();
        assert_ne!(all[0].position, grains[0].position);
        assert!(nearest_gap(&all, &domain) >= 0.01);
        all.extend(&grains);
        assert!(nearest_gap(&all, &domain) >= 0.0);
    }
}

#[test]
fn a_hundred_thousand_grains_are_inserted_by_cells() {
    let domain = cube(60.0, [true; 3]);
    let amount = Amount::SolidFraction(0.25);
    let spec = insertion(Region::Everywhere, domain, equal(0.5), amount);
    let started = std::time::Instant::now();
    let (grains, report) = insert_loose(&spec, &[]).unwrap();
    println!("{report}\n{:.2} s", started.elapsed().as_secs_f64());
    assert!(grains.len() > 100_000);
    // A simulation finds no contact among them.
    let mut simulation = sticking(grains, Threads::Serial);
    assert_eq!(simulation.energy().elastic(), 0.0);
}

#[test]
fn a_region_that_cannot_be_filled_says_how_far_it_got() {
    let domain = cube(8.0, [true; 3]);
    let amount = Amount::SolidFraction(0.45);
    let mut spec = insertion(Region::Everywhere, domain, equal(0.5), amount);
    spec.tries = 3000;
    let error = insert_loose(&spec, &[]).unwrap_err();
    let SetupError::Full { reached, asked, .. } = error else {
        panic!("{error}");
    };
    // Random sequential addition of spheres ends at 0.384.
    assert!(reached > 0.29 && reached < 0.384, "{error}");
    assert!((asked - 0.45).abs() < 2e-3);
    assert!(error.to_string().contains("no room for grain"), "{error}");
    spec.domain.periodic = [false; 3];
    let error = insert_loose(&spec, &[]).unwrap_err().to_string();
    assert!(error.contains("extent along axis 0"), "{error}");
    spec.region = block([0.0; 3], [8.0; 3]);
    spec.ingredients.push(spec.ingredients[0].clone());
    let error = insert_loose(&spec, &[]).unwrap_err().to_string();
    assert!(error.contains("each of a material of its own"), "{error}");
}

#[test]
fn a_mixture_has_its_parts_by_volume() {
    let dust = Ingredient::alone(equal(0.1), 2000.0);
    let ice = Ingredient {
        density: 920.0,
        material: 1,
        parts_by_volume: 0.5,
        ..Ingredient::alone(equal(0.2), 2000.0)
    };
    let domain = cube(8.0, [true; 3]);
    let amount = Amount::SolidFraction(0.1);
    let mut spec = insertion(Region::Everywhere, domain, equal(0.1), amount);
    spec.ingredients = vec![dust, ice];
    let (grains, report) = insert_loose(&spec, &[]).unwrap();
    let volume = |material: u16| -> f64 {
        let own = grains.iter().filter(|g| g.material == material);
        own.map(Grain::volume).sum()
    };
    assert!((volume(0) / volume(1) - 2.0).abs() < 5e-3);
    assert!((volume(0) / report.sizes[0].volume - 1.0).abs() < 1e-12);
    let kilograms: f64 = grains.iter().map(Grain::mass).sum();
    spec.amount = Amount::Mass(kilograms);
    assert_eq!(insert_loose(&spec, &[]).unwrap().0.len(), grains.len());
}

#[test]
fn a_cut_that_few_draws_meet_is_refused() {
    let law = |cut| RadiusLaw::Gaussian {
        mean: 1.0,
        relative_deviation: 0.1,
        cut,
    };
    law(0.01).validate().unwrap();
    let error = law(0.009).validate().unwrap_err().to_string();
    assert!(error.contains("cut_deviations = 0.009"), "{error}");
}

/// Units of d, mean mass and g = 1.
fn rough(friction: f64) -> ContactLaw {
    ContactLaw::linear(
        Hooke::matched(1e4, 0.5),
        TangentialSpring::matched(2.0 / 7.0, 0.5, friction),
        None,
    )
}

/// A periodic floor under nothing or a loose cloud.
fn floor(edge: f64, height: f64, grains: Vec<Grain>, law: ContactLaw) -> Setup {
    let mut domain = cube(edge, [true, true, false]);
    domain.upper.z = height;
    Setup {
        domain,
        gravity: -Vector3::z(),
        law: law.into(),
        grains,
        walls: vec![Wall::plane(Vector3::zeros(), Vector3::z())],
        bodies: Vec::new(),
        timestep: 1e-3,
        threads: Threads::Serial,
    }
}

fn poured(
    law: ContactLaw,
    threads: Threads,
    seed: u64,
    count: usize,
) -> (Simulation, PouringReport) {
    let mut simulation = Simulation::new(floor(6.0, 30.0, Vec::new(), law)).unwrap();
    simulation.set_threads(threads);
    let (spec, relaxation) = pouring(seed, count);
    let report = pour(&mut simulation, &spec, &relaxation, &mut go).unwrap();
    (simulation, report)
}

fn pouring(seed: u64, count: usize) -> (Pouring, Relaxation) {
    let spec = Pouring {
        source: block([0.0, 0.0, 20.0], [6.0, 6.0, 26.0]),
        ingredients: vec![Ingredient::alone(
            RadiusLaw::Uniform {
                low: 0.49,
                high: 0.51,
            },
            UNIT,
        )],
        amount: Amount::Grains(count),
        velocity: Vector3::new(0.0, 0.0, -2.0),
        interval: None,
        fill: 0.25,
        seed,
    };
    let relaxation = Relaxation {
        damping: 0.1,
        rest: Rest {
            kinetic: 1e-6,
            unbalanced: 1e-2,
        },
        ..Relaxation::under(1.0)
    };
    (spec, relaxation)
}

/// Inside, away from the floor's layers and the surface.
fn bulk() -> Region {
    block([0.0, 0.0, 3.0], [6.0, 6.0, 10.0])
}

#[test]
fn poured_beds_have_the_known_solid_fractions() {
    let mut fractions = Vec::new();
    for (friction, range, held) in [(0.5, 0.55..0.61, 4.0..5.6), (0.0, 0.62..0.65, 5.8..6.6)] {
        let (mut simulation, poured) = poured(rough(friction), Threads::Serial, 1, 600);
        assert_eq!(poured.grains, 600);
        assert!(
            poured.rest.kinetic <= 1e-6 && poured.rest.unbalanced <= 1e-2,
            "{poured}"
        );
        let report = PackingReport::of(&mut simulation, &bulk(), 1.0).unwrap();
        println!("friction {friction}: {report}\n{poured}");
        assert!(range.contains(&report.solid_fraction), "{report}");
        assert!(
            held.contains(&report.coordination.without_rattlers),
            "{report}"
        );
        // At rest: the same grains a while later have not moved.
        let before = simulation.grain_list();
        simulation.advance(2000).unwrap();
        let moved = simulation.grain_list();
        let farthest = before.iter().zip(&moved);
        let farthest = farthest.map(|(a, b)| {
            simulation
                .domain()
                .nearest_image(a.position - b.position)
                .norm()
        });
        assert!(farthest.fold(0.0, f64::max) < 0.05);
        fractions.push(report.solid_fraction);
    }
    assert!(fractions[1] > fractions[0] + 0.02);
}

#[test]
fn pouring_gives_the_same_bits_for_any_threads_and_another_bed_for_another_seed() {
    let hash = |threads, seed| poured(rough(0.5), threads, seed, 60).0.state_hash();
    let serial = hash(Threads::Serial, 1);
    assert_eq!(serial, hash(Threads::Rayon, 1));
    assert_ne!(serial, hash(Threads::Serial, 2));
}

#[test]
fn a_blocked_source_says_so() {
    let lid = Grain {
        fixed: true,
        ..Grain::at_rest(Vector3::new(3.0, 3.0, 3.0), 2.9, UNIT)
    };
    let mut setup = floor(6.0, 8.0, vec![lid], rough(0.5));
    setup.domain.periodic = [false; 3];
    let mut simulation = Simulation::new(setup).unwrap();
    let spec = Pouring {
        source: block([2.0, 2.0, 2.0], [4.0, 4.0, 4.0]),
        ingredients: vec![Ingredient::alone(equal(0.5), UNIT)],
        amount: Amount::Grains(5),
        velocity: Vector3::zeros(),
        interval: Some(1e-3),
        fill: FILL,
        seed: 1,
    };
    let error = pour(&mut simulation, &spec, &Relaxation::under(1.0), &mut go).unwrap_err();
    assert!(
        matches!(error, SetupError::Full { grain: 0, .. }),
        "{error}"
    );
}

/// A loose cloud of gravel-like grains of 1 cm (SI).
fn gravel_cloud() -> Setup {
    let domain = Domain {
        upper: Vector3::new(0.06, 0.06, 0.25),
        ..cube(0.06, [true, true, false])
    };
    let law = ContactLaw::linear(
        Hooke::matched(100.0, 0.5),
        TangentialSpring::matched(2.0 / 7.0, 0.5, 1.0),
        Some(ShapeParameter {
            beta: 1.0,
            rolling_friction: 1.05,
            twisting_friction: 1.3,
        }),
    );
    let sizes = RadiusLaw::Gaussian {
        mean: 0.005,
        relative_deviation: 0.33,
        cut: 1.0,
    };
    let region = block([0.0; 3], [0.06, 0.06, 0.2]);
    let mut spec = insertion(region, domain, sizes, Amount::SolidFraction(0.25));
    spec.ingredients[0].density = 2430.0;
    let (grains, _) = insert_loose(&spec, &[]).unwrap();
    Setup {
        gravity: -9.81 * Vector3::z(),
        domain,
        ..floor(0.06, 0.25, grains, law)
    }
}

#[test]
fn gravity_falls_in_stages_without_moving_the_bed() {
    let setup = gravel_cloud();
    let mut stages = Stages::at(&[9.81, 1e-2, 2.5e-4]);
    stages.largest_overlap = 0.05;
    let (mut simulation, reports) = settle_in_stages(setup.clone(), &[], &stages, &mut go).unwrap();
    for report in &reports {
        println!("{report}");
        assert!(stages.rest.holds(&report.rest), "{report}");
        assert!(report.largest_overlap < 0.08, "{report}");
    }
    // Stiffness follows gravity, but for the height of the topmost grain, and so does the square of
    // 1/step; the bed stays as it lies.
    let ratio = |f: fn(&StageReport) -> f64, k: usize| f(&reports[k]) / f(&reports[k + 1]);
    let stiffness = ratio(|r| r.stiffness_factor, 1) / 40.0;
    assert!((stiffness - 1.0).abs() < 0.1, "{stiffness}");
    let steps = ratio(|r| r.timestep, 1).powi(-2) / 40.0;
    assert!((steps - 1.0).abs() < 0.1, "{steps}");
    assert!(reports[0].sank > 0.03);
    for report in &reports[1..] {
        assert!(report.sank.abs() < 2e-5, "{report}");
    }
    let region = block([0.0, 0.0, 0.015], [0.06, 0.06, 0.06]);
    let report = PackingReport::of(&mut simulation, &region, 2.5e-4).unwrap();
    println!("{report}");
    // Gravel-like material: 0.49 to 0.51 in the thesis' container (Tab. 2.3).
    assert!((0.46..0.56).contains(&report.solid_fraction), "{report}");

    // The same bed released at once from springs made for 1 g bursts.
    let mut first = Stages::at(&[9.81]);
    first.largest_overlap = 0.05;
    let (mut simulation, reports) = settle_in_stages(setup, &[], &first, &mut go).unwrap();
    let height = |s: &mut Simulation| {
        let grains = s.grain_list();
        grains.iter().map(|g| g.position.z).sum::<f64>() / grains.len() as f64
    };
    let before = height(&mut simulation);
    let laws = simulation.law().laws()[0].into();
    let weak = -2.5e-4 * Vector3::z();
    simulation
        .go_on_under(&laws, weak, reports[0].timestep)
        .unwrap();
    simulation.advance(60_000).unwrap();
    let rose = height(&mut simulation) - before;
    println!("rose {rose}");
    assert!(rose > 5e-5, "{rose}");
    let other = ContactLaw::linear(
        Hooke::matched(1.0, 0.5),
        TangentialSpring::matched(0.0, 1.0, 0.0),
        None,
    );
    let error = simulation
        .go_on_under(&other.into(), weak, 1e-4)
        .unwrap_err();
    assert!(error.to_string().contains("same parts"), "{error}");
}

#[test]
fn equal_spheres_jam_at_0_64_with_six_contacts() {
    let spec = Jamming {
        grains: 500,
        ingredients: vec![Ingredient::alone(equal(0.5), UNIT)],
        quench: 0.68,
        overlap: 1e-4,
        seed: 4,
    };
    let (packing, report) = jam(&spec, &mut go).unwrap();
    println!("{report}");
    assert!((report.solid_fraction - 0.64).abs() < 0.012, "{report}");
    let contacts = report.coordination.without_rattlers;
    assert!((contacts / 6.0 - 1.0).abs() < 0.02, "{report}");
    assert!(report.coordination.rattlers < 0.06, "{report}");
    assert!(nearest_gap(&packing.grains, &packing.domain) > -2e-3);
    let measured = solid_fraction(&packing.grains, &packing.domain, &Region::Everywhere);
    assert!((measured / report.solid_fraction - 1.0).abs() < 2e-3);
}

/// Dust of 1 to 2 cm, with the sizes of Kappel et al. (2020).
fn dust() -> SizeLaw {
    RadiusLaw::BinnedPowerLaw {
        smallest: 0.005,
        largest: 0.01,
        index: 2.5,
        bins: 8,
    }
    .into()
}

/// Grains that stick and resist rolling.
fn sticking(grains: Vec<Grain>, threads: Threads) -> Simulation {
    Simulation::new(sticking_setup(grains, threads)).unwrap()
}

fn sticking_setup(grains: Vec<Grain>, threads: Threads) -> Setup {
    let law = ContactLaw {
        rolling: Rolling::Epsd(Epsd {
            rolling_friction: 1.0,
            damping_ratio: 1.0,
        }),
        cohesion: Cohesion::Dmt {
            work_of_adhesion: 0.3,
            asperity_radius: None,
        },
        ..ContactLaw::linear(
            Hooke::matched(200.0, 0.3),
            TangentialSpring::matched(2.0 / 7.0, 0.3, 1.0),
            None,
        )
    };
    let domain = Domain {
        lower: Vector3::repeat(-0.4),
        upper: Vector3::repeat(0.4),
        periodic: [false; 3],
    };
    Setup {
        domain,
        gravity: Vector3::zeros(),
        law: law.into(),
        grains,
        walls: Vec::new(),
        bodies: Vec::new(),
        timestep: 2e-4,
        threads,
    }
}

fn boulder(solid_fraction: f64, probe: f64) -> CentralCompaction {
    CentralCompaction {
        center: Vector3::zeros(),
        probe,
        solid_fraction,
        tolerance: 0.02,
        accelerations: [0.1, 20.0],
        relaxation: Relaxation {
            damping: 0.5,
            patience: 200.0,
            rest: Rest {
                kinetic: 1e-4,
                unbalanced: 0.05,
            },
            ..Relaxation::under(0.1)
        },
    }
}

#[test]
fn a_boulder_of_dust_gets_the_porosity_asked_for() {
    // Kappel et al. (2020): porosity 73 %, coordination 2.1 for pure dust.
    let aggregate = Aggregate {
        growth: Growth::ParticleCluster,
        grains: 800,
        sizes: dust(),
        density: 2000.0,
        material: 0,
        overlap: 2e-3,
        seed: 3,
    };
    let (grown, report) = grow(&aggregate).unwrap();
    println!("{report}");
    assert!(report.solid_fraction < 0.2, "{report}");
    let run = |threads| {
        let mut simulation = sticking(grown.grains.clone(), threads);
        let report = compact(&mut simulation, &boulder(0.27, 0.05), &mut go).unwrap();
        (simulation, report)
    };
    let (mut simulation, report) = run(Threads::Serial);
    println!("{report}");
    assert!(
        (report.solid_fraction / 0.27 - 1.0).abs() <= 0.02,
        "{report}"
    );
    assert!(report.rest.kinetic <= 1e-4, "{report}");
    let ball = Region::Ball {
        center: Vector3::zeros(),
        radius: 0.05,
    };
    let packed = PackingReport::of(&mut simulation, &ball, 0.1).unwrap();
    println!("{packed}");
    assert!((packed.solid_fraction - report.solid_fraction).abs() < 1e-12);
    assert!((1.9..2.6).contains(&packed.coordination.all), "{packed}");
    assert_eq!(run(Threads::Rayon).0.state_hash(), simulation.state_hash());

    let mut packing = Packing::of(&mut simulation);
    let (all, whole) = (packing.grains.len(), packing.clone());
    let gone = packing.trim(&ball).unwrap();
    assert_eq!(gone + packing.grains.len(), all);
    assert!(packing.grains.iter().all(|g| g.position.norm() <= 0.05));
    assert!(packing.contacts.len() < whole.contacts.len() && !packing.contacts.is_empty());
    for &[a, b] in &packing.contacts {
        let (a, b) = (&packing.grains[a as usize], &packing.grains[b as usize]);
        assert!((a.position - b.position).norm() < a.radius + b.radius);
    }

    let error = compact(&mut simulation, &boulder(0.1, 0.05), &mut go).unwrap_err();
    assert!(error.to_string().contains("denser before"), "{error}");
}

#[test]
fn a_loose_cloud_is_pulled_together_and_not_stopped_in_flight() {
    let ball = Region::Ball {
        center: Vector3::zeros(),
        radius: 0.1,
    };
    let domain = cube(1.0, [false; 3]);
    let mut spec = insertion(ball, domain, equal(0.01), Amount::SolidFraction(0.12));
    spec.ingredients = vec![Ingredient::alone(dust(), 2000.0)];
    let (grains, _) = insert_loose(&spec, &[]).unwrap();
    let mut simulation = sticking(grains.clone(), Threads::Serial);
    let report = compact(&mut simulation, &boulder(0.4, 0.045), &mut go).unwrap();
    println!("{report}");
    assert!(
        (report.solid_fraction / 0.4 - 1.0).abs() <= 0.02,
        "{report}"
    );
    assert!(report.acceleration > 0.1, "{report}");
    // In flight it has 0.27 at some time, but nothing that would hold it there.
    let mut simulation = sticking(grains, Threads::Serial);
    let error = compact(&mut simulation, &boulder(0.27, 0.045), &mut go).unwrap_err();
    assert!(error.to_string().contains("begin softer"), "{error}");
}

#[test]
fn packings_are_trimmed_glued_scaled_and_placed() {
    let lattice = (0..27).map(|k| {
        let cell = Vector3::new(k % 3, k / 3 % 3, k / 9).map(|c| f64::from(c) + 0.5);
        Grain::at_rest(cell, 0.5, 1000.0)
    });
    let mut packing = Packing {
        domain: cube(3.0, [false; 3]),
        grains: lattice.collect(),
        contacts: vec![[0, 1], [1, 2], [0, 9]],
        clumps: Vec::new(),
    };
    let base = block([0.0; 3], [3.0, 3.0, 1.0]);
    assert_eq!(packing.glue(&base).unwrap(), 9);
    assert_eq!(packing.glue(&base).unwrap(), 0);
    let mass = packing.mass();
    packing.scale(2.0).unwrap();
    assert!((packing.mass() / mass - 8.0).abs() < 1e-12);
    assert!((packing.center() - Vector3::repeat(3.0)).norm() < 1e-12);
    let turn = UnitQuaternion::from_axis_angle(&Vector3::y_axis(), 0.5 * PI);
    let by = Vector3::new(10.0, 0.0, 0.0);
    packing.place(Vector3::repeat(3.0), turn, by).unwrap();
    assert!((packing.center() - Vector3::new(13.0, 3.0, 3.0)).norm() < 1e-12);
    // The glued floor looked down, now it looks along -x.
    let glued = packing.grains.iter().filter(|g| g.fixed);
    assert!(
        glued.clone().count() == 9
            && glued
                .into_iter()
                .all(|g| (g.position.x - 11.0).abs() < 1e-12)
    );
    assert!((packing.domain.upper.x - 16.0).abs() < 1e-12);
    let keep = block([9.0, -0.1, -0.1], [16.1, 6.1, 2.1]);
    assert_eq!(packing.clone().trim_whole(&keep).unwrap(), 18);
    assert_eq!(packing.trim(&block([9.0; 3], [9.1; 3])).unwrap(), 27);
    assert!(packing.contacts.is_empty());
    packing.domain.periodic = [true; 3];
    assert!(
        packing
            .place(by, turn, by)
            .unwrap_err()
            .to_string()
            .contains("periodic")
    );
}

#[test]
fn a_narrow_periodic_box_may_begin_empty_and_is_checked_as_grains_come() {
    // Grains of 1 mm in a box of 1 cm (SI): what the list needs is known only with them.
    let setup = |edge: f64| {
        let mut setup = floor(edge, 0.1, Vec::new(), rough(0.5));
        setup.gravity *= 10.0;
        setup.timestep = 1e-6;
        setup
    };
    let put = |edge: f64| {
        let mut simulation = Simulation::new(setup(edge)).unwrap();
        let grain = Grain::at_rest(Vector3::new(1e-3, 1e-3, 0.05), 5e-4, 2500.0);
        simulation.insert(&[grain]).map(drop)
    };
    put(0.01).unwrap();
    let error = put(1.5e-3).unwrap_err();
    assert!(matches!(error, SetupError::NarrowDomain { .. }), "{error}");
}
