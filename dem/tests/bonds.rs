//! Bonds in a simulation: oscillations in closed form, breaking, accounts, clusters, restarts.

use crate::world::{MATERIAL, laws, setup};
use colluvium_dem::*;
use nalgebra::Vector3;

const RADIUS: f64 = 0.05;
const GAP: f64 = 1e-4;

fn cement() -> Cement {
    Cement {
        youngs_modulus: 1e6,
        stiffness_ratio: 3.5,
        radius_ratio: 0.4,
        tensile_strength: f64::INFINITY,
        shear_strength: f64::INFINITY,
    }
}

fn rule(cement: Cement) -> BondRule {
    BondRule {
        cement,
        gap: 0.1,
        materials: Vec::new(),
        within: Region::Everywhere,
    }
}

fn free_space(grains: Vec<Grain>, timestep: f64) -> Setup {
    Setup {
        domain: Domain {
            lower: Vector3::repeat(-5.0),
            upper: Vector3::repeat(5.0),
            periodic: [false; 3],
        },
        gravity: Vector3::zeros(),
        law: laws()[0].1.into(),
        grains,
        walls: Vec::new(),
        bodies: Vec::new(),
        timestep,
        threads: Threads::Serial,
    }
}

/// Two grains side by side along x, not touching.
fn pair() -> Vec<Grain> {
    let half = RADIUS + 0.5 * GAP;
    [half, -half]
        .map(|x| Grain::at_rest(Vector3::new(x, 0.3, -0.2), RADIUS, 1000.0))
        .to_vec()
}

fn bonded(grains: Vec<Grain>, timestep: f64, cement: Cement) -> Simulation {
    let mut simulation = Simulation::new(free_space(grains, timestep)).unwrap();
    simulation.bond(&rule(cement)).unwrap();
    simulation
}

/// One way to vibrate: what to start with, its stiffness against displacement, its ω², and the
/// displacement seen in a sample.
struct Mode {
    name: &'static str,
    start: fn(&mut [Grain], f64),
    stiffness: f64,
    square: f64,
    seen: fn(&BondSample) -> f64,
    /// Stress that a unit of force or moment means, tensile or shear.
    stress: f64,
    tears: bool,
}

fn modes() -> [Mode; 4] {
    let section = cement().section(RADIUS, RADIUS);
    let mass = pair()[0].mass();
    let inertia = 0.4 * mass * RADIUS * RADIUS;
    let distance = 2.0 * RADIUS + GAP;
    let rim = section.radius / section.second_moment;
    [
        Mode {
            name: "tension",
            start: |grains, v| {
                grains[0].velocity.x = 0.5 * v;
                grains[1].velocity.x = -0.5 * v;
            },
            stiffness: section.axial,
            square: section.axial * 2.0 / mass,
            seen: |b| -b.force.x,
            stress: 1.0 / section.area,
            tears: true,
        },
        Mode {
            name: "shear",
            // Equal spins: surfaces slide by d ω.
            start: |grains, v| {
                for grain in grains {
                    grain.spin.z = -v / (2.0 * RADIUS + GAP);
                }
            },
            stiffness: section.shear,
            square: section.shear * (2.0 / mass + 0.5 * distance * distance / inertia),
            seen: |b| -b.force.y,
            stress: 1.0 / section.area,
            tears: false,
        },
        Mode {
            name: "bending",
            start: |grains, v| {
                grains[0].spin.z = 0.5 * v;
                grains[1].spin.z = -0.5 * v;
            },
            stiffness: section.bending,
            square: section.bending * 2.0 / inertia,
            seen: |b| -b.moment.z,
            stress: rim,
            tears: true,
        },
        Mode {
            name: "twisting",
            start: |grains, v| {
                grains[0].spin.x = 0.5 * v;
                grains[1].spin.x = -0.5 * v;
            },
            stiffness: section.twisting,
            square: section.twisting * 2.0 / inertia,
            seen: |b| -b.moment.x,
            stress: 0.5 * rim,
            tears: false,
        },
    ]
}

/// The displacement of leap-frog after n steps: `v Δt sin(nθ)/sin θ`, `cos θ = 1 - ω²Δt²/2`.
fn leapfrog(mode: &Mode, speed: f64, timestep: f64, n: u64) -> f64 {
    let angle = (1.0 - 0.5 * mode.square * timestep * timestep).acos();
    speed * timestep * (n as f64 * angle).sin() / angle.sin()
}

#[test]
fn each_mode_of_one_bond_vibrates_as_the_closed_form_says() {
    for mode in modes() {
        let mut grains = pair();
        let speed = 1e-6;
        (mode.start)(&mut grains, speed);
        let timestep = 0.1 / mode.square.sqrt();
        let mut simulation = bonded(grains, timestep, cement());
        let amplitude = mode.stiffness * speed / mode.square.sqrt();
        let mut seen = Snapshot::default();
        for n in 1..=300 {
            simulation.advance(1).unwrap();
            simulation.snapshot(&mut seen);
            let expected = mode.stiffness * leapfrog(&mode, speed, timestep, n);
            let error = ((mode.seen)(&seen.bonds[0]) - expected).abs() / amplitude;
            assert!(error < 1e-4, "{} after {n} steps: {error:e}", mode.name);
        }
        assert!(simulation.leapfrog_momentum().norm() < 1e-12 * amplitude * timestep);
    }
}

#[test]
fn a_bond_breaks_at_the_step_at_which_its_stress_passes_the_strength() {
    for mode in modes() {
        let (speed, timestep) = (1e-6, 0.02 / mode.square.sqrt());
        let stress = |n| mode.stress * mode.stiffness * leapfrog(&mode, speed, timestep, n);
        // Between the stresses of two steps; the other strength must not matter.
        let strength = 0.5 * (stress(40) + stress(41));
        let cement = if mode.tears {
            Cement {
                tensile_strength: strength,
                ..cement()
            }
        } else {
            Cement {
                shear_strength: strength,
                ..cement()
            }
        };
        let mut grains = pair();
        (mode.start)(&mut grains, speed);
        let mut simulation = bonded(grains, timestep, cement);
        simulation.advance(40).unwrap();
        let count = simulation.bond_count();
        assert_eq!((count.whole, count.energy_freed), (1, 0.0), "{}", mode.name);
        simulation.advance(1).unwrap();
        let count = simulation.bond_count();
        let broken = [count.torn, count.sheared];
        assert_eq!(
            broken,
            [mode.tears.into(), (!mode.tears).into()],
            "{}",
            mode.name
        );
        let x = leapfrog(&mode, speed, timestep, 41);
        let energy = 0.5 * mode.stiffness * x * x;
        assert!(
            (count.energy_freed - energy).abs() < 1e-3 * energy,
            "{}",
            mode.name
        );
        assert_eq!(simulation.energy().bonds, 0.0);
        // Broken for good.
        assert_eq!(simulation.bond(&rule(cement)).unwrap(), 0);
    }
}

#[test]
fn pressing_never_tears_a_bond() {
    let weak = Cement {
        tensile_strength: 1e-3,
        ..cement()
    };
    for (sign, whole) in [(-1.0, 1), (1.0, 0)] {
        let mut grains = pair();
        grains[0].velocity.x = 1e-3 * sign;
        let mut simulation = bonded(grains, 1e-5, weak);
        simulation.advance(20).unwrap();
        assert_eq!(simulation.bond_count().whole, whole);
    }
}

/// A bonded cube of 4³ grains, spinning and shaken.
fn cube(timestep: f64, cement: Cement) -> Simulation {
    let mut grains = Vec::new();
    let spin = Vector3::new(3.0, -4.0, 12.0);
    for k in 0..64_i32 {
        let cell = Vector3::new(k % 4, k / 4 % 4, k / 16).map(|c| f64::from(c) - 1.5);
        let at = cell * (2.0 * RADIUS + 10.0 * GAP);
        let mut grain = Grain::at_rest(at, RADIUS, 1000.0);
        let shake = Vector3::new(
            f64::from(k * 37 % 11),
            f64::from(k * 17 % 7),
            f64::from(k % 5),
        );
        grain.velocity = Vector3::new(0.2, 0.1, 0.3) + spin.cross(&at) + 0.003 * shake;
        grain.spin = spin + 0.1 * shake;
        grains.push(grain);
    }
    bonded(grains, timestep, cement)
}

fn turning(seen: &Snapshot) -> Vector3<f64> {
    let part = |g: &GrainSample| {
        g.mass * (g.position.cross(&g.velocity) + 0.4 * g.radius * g.radius * g.spin)
    };
    seen.grains.iter().map(part).sum()
}

#[test]
fn a_spinning_body_keeps_momentum_and_angular_momentum_while_it_breaks() {
    let mut simulation = cube(
        2e-5,
        Cement {
            tensile_strength: 6e3,
            ..cement()
        },
    );
    assert_eq!(simulation.bond_count().whole, 144);
    let (p, l) = (
        simulation.leapfrog_momentum(),
        simulation.leapfrog_angular_momentum(),
    );
    simulation.advance(20_000).unwrap();
    let broken = simulation.bond_count().torn;
    assert!((10..140).contains(&broken), "{broken}");
    assert!((simulation.leapfrog_momentum() - p).norm() < 1e-12 * p.norm());
    let turned = (simulation.leapfrog_angular_momentum() - l).norm() / l.norm();
    assert!(turned < 1e-12, "{turned:e}");
    let mut seen = Snapshot::default();
    simulation.snapshot(&mut seen);
    assert!((turning(&seen) - l).norm() < 1e-3 * l.norm());
}

#[test]
fn energy_of_a_vibrating_body_is_kept_with_the_square_of_the_step() {
    let lost = |timestep: f64| {
        let mut simulation = cube(timestep, cement());
        simulation.advance((0.05 / timestep) as u64).unwrap();
        simulation.open_energy_ledger();
        simulation.advance((0.35 / timestep) as u64).unwrap();
        let ledger = simulation.energy_ledger().unwrap();
        assert!(ledger.error() < 1e-12, "{:e}", ledger.error());
        assert!(ledger.bonds.stored > 1e-3 * ledger.kinetic);
        assert_eq!(ledger.bonds.broken(), 0.0);
        ledger.bonds.lost().abs() / ledger.bonds.stored
    };
    let (coarse, fine) = (lost(8e-5), lost(2e-5));
    assert!(coarse < 2e-2, "{coarse:e}");
    assert!(fine < 0.15 * coarse, "{coarse:e} to {fine:e}");
}

#[test]
fn the_ledger_closes_over_a_boulder_that_breaks_on_the_ground() {
    let mut simulation = cube(2e-5, cement());
    let mut grains = Vec::new();
    let mut seen = Snapshot::default();
    simulation.snapshot(&mut seen);
    for g in &seen.grains {
        let at = g.position + Vector3::new(0.0, 0.0, 0.3);
        grains.push(Grain {
            velocity: Vector3::new(0.5, 0.0, -2.0),
            ..Grain::at_rest(at, RADIUS, 1000.0)
        });
    }
    let setup = Setup {
        gravity: Vector3::new(0.0, 0.0, -9.81),
        walls: vec![Wall::plane(
            Vector3::zeros(),
            Vector3::new(0.2, 0.0, 1.0).normalize(),
        )],
        law: ContactLaw::hertz_mindlin(MATERIAL, 0.5, 0.5).into(),
        ..free_space(grains, 2e-5)
    };
    let mut simulation = Simulation::new(setup).unwrap();
    simulation
        .bond(&rule(Cement {
            tensile_strength: 2e4,
            shear_strength: 2e4,
            ..cement()
        }))
        .unwrap();
    simulation.open_energy_ledger();
    simulation.advance(10_000).unwrap();
    let (ledger, count) = (simulation.energy_ledger().unwrap(), simulation.bond_count());
    assert!((0.1..0.9).contains(&count.broken_share()), "{count:?}");
    assert!(ledger.error() < 1e-12, "{:e}", ledger.error());
    assert!((ledger.bonds.broken() - count.energy_freed).abs() < 1e-15);
    let missing = ledger.bonds.lost().abs() / ledger.bonds.broken();
    assert!(missing < 0.05, "{missing:e} of what breaking cost");
    assert!(simulation.momentum_error() < 1e-11);
    let clusters = simulation.clusters();
    assert_eq!(clusters.list.iter().map(|c| c.grains).sum::<usize>(), 64);
    assert_eq!(
        clusters.list.iter().map(|c| c.bonds).sum::<usize>(),
        count.whole
    );
    assert!(clusters.boulders().count() >= 1 && clusters.list.len() > 1);
}

/// A ring of grains right round a periodic box, and one loose grain.
fn ring() -> Setup {
    let spacing = 2.0 * RADIUS + GAP;
    let mut grains: Vec<Grain> = (0..10)
        .map(|k| {
            Grain::at_rest(
                Vector3::new(spacing * f64::from(k), 0.3, 0.3),
                RADIUS,
                1000.0,
            )
        })
        .collect();
    grains.push(Grain::at_rest(Vector3::new(0.5, 0.8, 0.8), RADIUS, 3000.0));
    Setup {
        domain: Domain {
            lower: Vector3::zeros(),
            upper: Vector3::new(10.0 * spacing, 1.0, 1.0),
            periodic: [true; 3],
        },
        ..free_space(grains, 1e-5)
    }
}

#[test]
fn clusters_are_found_and_measured_across_periodic_boundaries() {
    let mut simulation = Simulation::new(ring()).unwrap();
    assert_eq!(simulation.bond(&rule(cement())).unwrap(), 10);
    assert_eq!(simulation.bond(&rule(cement())).unwrap(), 0, "bonded twice");
    // Cut it between the third and the fourth, and the seventh and eighth.
    for at in [2.5, 6.5] {
        let crack = Region::Slab {
            point: Vector3::x() * at * (2.0 * RADIUS + GAP),
            normal: Vector3::x(),
            thickness: RADIUS,
        };
        assert_eq!(simulation.cut_bonds(&crack), 1);
    }
    let clusters = simulation.clusters();
    let sizes: Vec<_> = clusters.list.iter().map(|c| (c.grains, c.bonds)).collect();
    assert_eq!(sizes, [(6, 5), (4, 3), (1, 0)]);
    let (mass, spacing) = (pair()[0].mass(), 2.0 * RADIUS + GAP);
    let around = &clusters.list[0];
    assert!((around.mass - 6.0 * mass).abs() < 1e-12 * mass);
    // Grains 7, 8, 9, 0, 1, 2: the centre lies half way between 9 and 0, at 9.5 spacings.
    assert!((around.center - Vector3::new(9.5 * spacing, 0.3, 0.3)).norm() < 1e-12);
    let length = 5.0 * spacing + 2.0 * RADIUS;
    let extent = Vector3::new(length, 2.0 * RADIUS, 2.0 * RADIUS);
    assert!((around.extent - extent).norm() < 1e-12);
    let squares = 35.0 / 12.0 * spacing * spacing + 0.6 * RADIUS * RADIUS;
    assert!((around.gyration - squares.sqrt()).abs() < 1e-12);
    assert!((around.diameter() - 2.0 * RADIUS * 6.0_f64.cbrt()).abs() < 1e-12);
    assert_eq!(clusters.boulders().count(), 2);
    assert_eq!(clusters.cumulative_sizes()[2].1, 3);
    assert_eq!(simulation.bond_count().cut, 2);
    assert_eq!(simulation.bond(&rule(cement())).unwrap(), 0, "cracks heal");
}

#[test]
fn rules_hold_for_their_gap_materials_and_region_alone() {
    let mut setup = ring();
    setup.law = Laws {
        own: vec![laws()[0].1; 2],
        ..Laws::from(laws()[0].1)
    };
    for (k, grain) in setup.grains.iter_mut().enumerate() {
        grain.material = u16::from(k < 5);
    }
    let count = |rule: &BondRule| Simulation::new(setup.clone()).unwrap().bond(rule).unwrap();
    let all = rule(cement());
    let gap = GAP / RADIUS;
    assert_eq!(
        count(&BondRule {
            gap: 1.01 * gap,
            ..all.clone()
        }),
        10
    );
    assert_eq!(
        count(&BondRule {
            gap: 0.99 * gap,
            ..all.clone()
        }),
        0
    );
    let materials = |materials: &[u16]| BondRule {
        materials: materials.to_vec(),
        ..all.clone()
    };
    assert_eq!(count(&materials(&[1])), 4);
    assert_eq!(count(&materials(&[0])), 4);
    assert_eq!(count(&materials(&[0, 1])), 10);
    let half = Region::Block {
        lower: Vector3::repeat(f64::NEG_INFINITY),
        upper: Vector3::new(4.9 * 2.0 * RADIUS, f64::INFINITY, f64::INFINITY),
    };
    assert_eq!(
        count(&BondRule {
            within: half,
            ..all.clone()
        }),
        5
    );

    let mut simulation = Simulation::new(setup.clone()).unwrap();
    let stiff = Cement {
        youngs_modulus: 1e14,
        ..cement()
    };
    let error = simulation.bond(&rule(stiff)).unwrap_err().to_string();
    assert!(error.contains("limit: bond"), "{error}");
    for (bad, key) in [
        (
            Cement {
                radius_ratio: 1.5,
                ..cement()
            },
            "bonds.radius_ratio",
        ),
        (
            Cement {
                tensile_strength: f64::NAN,
                ..cement()
            },
            "bonds.tensile_strength",
        ),
        (
            Cement {
                youngs_modulus: 0.0,
                ..cement()
            },
            "bonds.youngs_modulus",
        ),
    ] {
        let error = simulation.bond(&rule(bad)).unwrap_err().to_string();
        assert!(error.contains(key), "{error}");
    }
    assert!(simulation.bond(&materials(&[7])).is_err());
    assert_eq!(simulation.bond_count(), BondCount::default());
}

/// A falling cloud in a periodic box, bonded where it is close, with bonds that break one by one.
fn storm(threads: Threads) -> Setup {
    Setup {
        threads,
        ..setup(laws()[5].1, 1500, 5e-5)
    }
}

fn weak() -> BondRule {
    BondRule {
        gap: 0.6,
        ..rule(Cement {
            tensile_strength: 3e4,
            shear_strength: 3e4,
            ..cement()
        })
    }
}

#[test]
fn bonds_outlive_sorting_restarts_and_threads_bit_for_bit() {
    let mut whole = Simulation::new(storm(Threads::Serial)).unwrap();
    let bonds = whole.bond(&weak()).unwrap();
    assert!(bonds > 1000, "{bonds}");
    whole.advance(1500).unwrap();
    whole.remove(|g| g.id % 50 == 3);
    whole.advance(1500).unwrap();
    let count = whole.bond_count();
    assert!(
        whole.list_builds() > 3 && count.torn > 20 && count.whole > 20,
        "{count:?}"
    );

    let pool = rayon::ThreadPoolBuilder::new()
        .num_threads(3)
        .build()
        .unwrap();
    let other = pool.install(|| {
        let mut first = Simulation::new(storm(Threads::Rayon)).unwrap();
        first.bond(&weak()).unwrap();
        first.advance(700).unwrap();
        // Looking must not change anything.
        first.bond_count();
        first.energy();
        first.advance(233).unwrap();
        let record = first.checkpoint();
        let mut second = Simulation::resume(storm(Threads::Rayon), &record).unwrap();
        second.advance(567).unwrap();
        second.remove(|g| g.id % 50 == 3);
        second.advance(1500).unwrap();
        assert_eq!(second.bond_count(), count);
        second.state_hash()
    });
    assert_eq!(whole.state_hash(), other);
}

#[test]
fn a_spoilt_record_of_bonds_is_refused() {
    let mut simulation = bonded(pair(), 1e-5, cement());
    let record = simulation.checkpoint();
    let resumed = |change: &dyn Fn(&mut Record)| {
        let mut spoilt = record.clone();
        change(&mut spoilt);
        Simulation::resume(free_space(pair(), 1e-5), &spoilt).map(|_| ())
    };
    assert!(resumed(&|_| ()).is_ok());
    for (k, value) in [(0, 9), (1, 0), (2, 1), (3, 4)] {
        let error = resumed(&|r| r.counts.get_mut("bonds/bond").unwrap()[k] = value);
        assert!(error.unwrap_err().to_string().contains("bonds/bond"), "{k}");
    }
    let short = resumed(&|r| r.numbers.get_mut("bonds/strain").unwrap().truncate(7));
    assert!(short.is_err());
    let lost = resumed(&|r| r.numbers.get_mut("bonds/strain").unwrap()[2] = f64::NAN);
    assert!(lost.is_err());
    let cement = resumed(&|r| r.numbers.get_mut("bonds/cement").unwrap()[2] = -1.0);
    assert!(cement.is_err());
}

#[test]
fn bonds_carry_what_rests_on_them() {
    let mut grains = pair();
    grains[1].fixed = true;
    let mut setup = free_space(grains, 1e-4);
    setup.gravity = -9.81 * Vector3::x();
    let mut simulation = Simulation::new(setup).unwrap();
    simulation.bond(&rule(cement())).unwrap();
    let weight = simulation.free_mass() * 9.81;
    // At the start nothing is stretched: all of the weight is left.
    assert_eq!(simulation.rest_measures(9.81).unbalanced, f64::INFINITY);
    simulation.advance(5).unwrap();
    let mut seen = Snapshot::default();
    simulation.snapshot(&mut seen);
    let pull = seen.bonds[0].force.norm();
    assert!(seen.contacts.is_empty() && pull > 0.0);
    let left = simulation.rest_measures(9.81).unbalanced;
    let expected = (weight - pull).abs() / pull;
    assert!((left / expected - 1.0).abs() < 1e-9, "{left} {expected}");
}
