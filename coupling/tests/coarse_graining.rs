//! Averages of made-up snapshots, where every answer is known.

use colluvium_coupling::coarse_graining::{
    Averager, Gauss, Heaviside, Kernel, Layering, Layers, Lucy, Profile,
};
use colluvium_dem::{
    BondSample, BondStress, ContactSample, Domain, GrainSample, Partner, Record, Snapshot,
};
use nalgebra::Vector3;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::StandardNormal;

fn domain() -> Domain {
    Domain {
        lower: Vector3::new(0.0, 0.0, -2.0),
        upper: Vector3::new(3.0, 2.0, 12.0),
        periodic: [true, true, false],
    }
}

fn grain(id: u32, position: Vector3<f64>, radius: f64, fixed: bool) -> GrainSample {
    GrainSample {
        id,
        position,
        velocity: Vector3::zeros(),
        spin: Vector3::zeros(),
        radius,
        mass: 2600.0 * 4.0 / 3.0 * std::f64::consts::PI * radius.powi(3),
        fixed,
        clump: None,
    }
}

fn random_vector(rng: &mut ChaCha8Rng) -> Vector3<f64> {
    Vector3::from_fn(|_, _| rng.random_range(-1.0..1.0))
}

/// Random forces on random branches between random grains, free and fixed; every free grain is held by one
/// more contact with a wall, at a random arm, so that all of them are in equilibrium.
fn network_at_rest(seed: u64) -> Snapshot {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let gravity = Vector3::new(4.0, -1.0, -8.0);
    let grains: Vec<_> = (0..60)
        .map(|id| {
            let position = Vector3::new(
                rng.random_range(0.0..3.0),
                rng.random_range(0.0..2.0),
                rng.random_range(-1.0..9.0),
            );
            grain(id, position, rng.random_range(0.2..0.4), id % 5 == 0)
        })
        .collect();
    let mut net: Vec<Vector3<f64>> = grains.iter().map(|g| g.mass * gravity).collect();
    let (mut contacts, mut bonds) = (Vec::new(), Vec::new());
    for i in 0..grains.len() {
        for k in 0..4 {
            let j = rng.random_range(0..grains.len());
            if j == i {
                continue;
            }
            let force = 300.0 * random_vector(&mut rng);
            // The contact point lies anywhere; both arms end in it along z (x and y are periodic).
            let arm = 0.5 * random_vector(&mut rng);
            let mut partner_arm = 0.5 * random_vector(&mut rng);
            partner_arm.z = grains[i].position.z + arm.z - grains[j].position.z;
            if k == 3 {
                bonds.push(BondSample {
                    grains: [i, j],
                    force,
                    moment: Vector3::zeros(),
                    arm,
                    partner_arm,
                    radius: 0.1,
                    stress: BondStress::default(),
                });
            } else {
                contacts.push(ContactSample {
                    grain: i,
                    partner: Partner::Grain(j),
                    overlap: 0.01,
                    force,
                    arm,
                    partner_arm,
                    torque: Vector3::zeros(),
                    partner_torque: Vector3::zeros(),
                });
            }
            net[i] += force;
            net[j] -= force;
        }
    }
    for (i, g) in grains.iter().enumerate().filter(|(_, g)| !g.fixed) {
        contacts.push(ContactSample {
            grain: i,
            partner: Partner::Wall(0),
            overlap: 0.01,
            force: -net[i],
            arm: g.radius * random_vector(&mut rng),
            partner_arm: Vector3::zeros(),
            torque: Vector3::zeros(),
            partner_torque: Vector3::zeros(),
        });
    }
    Snapshot {
        time: 0.0,
        domain: domain(),
        gravity,
        grains,
        contacts,
        bonds,
        bodies: Vec::new(),
        body_contacts: Vec::new(),
    }
}

fn layers() -> Layering {
    Layering {
        lower: -6.0,
        thickness: 0.37,
        count: 60,
    }
}

fn profile_of<K: Kernel>(kernel: K, snapshot: &Snapshot) -> Profile {
    let mut averager = Averager::new(kernel, layers()).expect("layers are sound");
    averager.sample(snapshot);
    averager.profile(0.6, 2600.0)
}

#[test]
fn networks_at_rest_balance_for_every_kernel() {
    for seed in 0..20 {
        let s = network_at_rest(seed);
        let profiles = [
            profile_of(Layers, &s),
            profile_of(Lucy { half_width: 0.9 }, &s),
            profile_of(Gauss { deviation: 0.3 }, &s),
            profile_of(Heaviside { half_width: 0.5 }, &s),
        ];
        for profile in profiles {
            let b = profile.balance;
            assert!(b.mass_relative < 1e-13 && b.mass_outside < 1e-14, "{b:?}");
            assert!(b.normal_relative < 1e-10, "{b:?}");
            assert!(b.downslope_relative < 1e-10, "{b:?}");
        }
    }
}

#[test]
fn a_dropped_wall_force_or_a_wrong_arm_breaks_the_balance() {
    let s = network_at_rest(3);
    let mut without_walls = s.clone();
    without_walls
        .contacts
        .retain(|c| matches!(c.partner, Partner::Grain(_)));
    assert!(profile_of(Layers, &without_walls).balance.normal_relative > 1e-2);

    // The whole branch in place of the arm, as if the pair were not split at its contact point.
    let mut whole_branch = s.clone();
    for contact in &mut whole_branch.contacts {
        contact.arm *= 2.0;
    }
    assert!(
        profile_of(Lucy { half_width: 0.9 }, &whole_branch)
            .balance
            .normal_relative
            > 1e-3
    );

    let mut lost_mass = s;
    lost_mass.grains[1].mass *= 1.001;
    assert!(profile_of(Layers, &lost_mass).balance.normal_relative > 1e-6);
}

/// Three grains on top of each other over a fixed one.
fn stack() -> Snapshot {
    let g = 9.81;
    let mut grains: Vec<_> = (0..4)
        .map(|i| grain(i, Vector3::new(1.0, 1.0, f64::from(i)), 0.5, i == 0))
        .collect();
    for g in &mut grains {
        g.mass = 2.0;
    }
    let contacts = (1..4)
        .map(|i| ContactSample {
            grain: i,
            partner: Partner::Grain(i - 1),
            overlap: 0.0,
            force: Vector3::new(0.0, 0.0, 2.0 * g * (4 - i) as f64),
            arm: Vector3::new(0.0, 0.0, -0.5),
            partner_arm: Vector3::new(0.0, 0.0, 0.5),
            torque: Vector3::zeros(),
            partner_torque: Vector3::zeros(),
        })
        .collect();
    Snapshot {
        time: 0.0,
        domain: domain(),
        gravity: Vector3::new(0.0, 0.0, -g),
        grains,
        contacts,
        bonds: Vec::new(),
        bodies: Vec::new(),
        body_contacts: Vec::new(),
    }
}

#[test]
fn a_stack_carries_its_weight() {
    let s = stack();
    let mut averager = Averager::new(
        Layers,
        Layering {
            lower: -1.0,
            thickness: 0.25,
            count: 30,
        },
    )
    .unwrap();
    averager.sample(&s);
    let profile = averager.profile(1.0, 2600.0);
    assert!(
        profile.balance.normal_relative < 1e-13,
        "{:?}",
        profile.balance
    );
    assert!(profile.balance.weight_relative < 1e-13);
    // Just above the second free grain's centre one weight is carried.
    let area = 6.0;
    let row = profile
        .rows
        .iter()
        .find(|r| (r.z - 2.125).abs() < 1e-12)
        .unwrap();
    assert!((row.stress[2][2].value + 2.0 * 9.81 / area).abs() < 1e-12);
    assert!((row.sigma_zz.value - 2.0 * 9.81 / area).abs() < 1e-12);
    // Volume by slices: the whole of three spheres.
    let phi: f64 = profile.rows.iter().map(|r| r.phi.value * 0.25 * area).sum();
    assert!(phi < 3.0 * std::f64::consts::PI / 6.0 + 1e-12);
}

#[test]
fn sliced_volumes_add_up() {
    let s = network_at_rest(9);
    let mut averager = Averager::new(Layers, layers()).unwrap();
    averager.sample(&s);
    // Rows without centres are not listed, so use layers thick enough to hold all.
    let mut one = Averager::new(
        Layers,
        Layering {
            lower: -6.0,
            thickness: 20.0,
            count: 1,
        },
    )
    .unwrap();
    one.sample(&s);
    let p = one.profile(0.6, 2600.0);
    let mass: f64 = s.grains.iter().filter(|g| !g.fixed).map(|g| g.mass).sum();
    let volume = 20.0 * 6.0;
    assert!((p.rows[0].phi.value * volume * 2600.0 / mass - 1.0).abs() < 1e-12);
    assert!((p.rows[0].density.value * volume / mass - 1.0).abs() < 1e-12);
}

/// A gas of N grains with velocities u = γ z + thermal noise.
fn sheared_gas(rng: &mut ChaCha8Rng, time: f64, shear: f64, temperature: f64) -> Snapshot {
    let grains = (0..400)
        .map(|id| {
            let position = Vector3::new(0.5, 0.5, rng.random_range(0.0..10.0));
            let mut g = grain(id, position, 0.3, false);
            g.velocity =
                Vector3::from_fn(|_, _| temperature.sqrt() * rng.sample::<f64, _>(StandardNormal));
            g.velocity.x += shear * position.z;
            g
        })
        .collect();
    Snapshot {
        time,
        domain: domain(),
        gravity: Vector3::new(0.0, 0.0, -1.0),
        grains,
        contacts: vec![],
        bonds: Vec::new(),
        bodies: Vec::new(),
        body_contacts: Vec::new(),
    }
}

#[test]
fn temperature_is_free_of_the_shear_within_a_layer() {
    let mut rng = ChaCha8Rng::seed_from_u64(4);
    let mut averager = Averager::new(
        Layers,
        Layering {
            lower: 0.0,
            thickness: 1.0,
            count: 10,
        },
    )
    .unwrap();
    for i in 0..400 {
        averager.sample(&sheared_gas(&mut rng, f64::from(i), 2.0, 0.5));
    }
    let p = averager.profile(1.0, 2600.0);
    for row in &p.rows[1..9] {
        let t = row.temperature;
        assert!((t.value - 0.5).abs() < 4.0 * t.error, "{t:?}");
        assert!(t.error < 0.01);
        // γ² Δz²/12/3 = 0.111: left in, it would be seen.
        assert!((row.shear_in_layer.value - 4.0 / 36.0).abs() < 0.005);
        assert!(row.shear_in_layer.value > 10.0 * t.error);
        let pressure = row.density.value * 0.5;
        assert!((row.p.value - pressure).abs() < 4.0 * row.p.error + 0.01 * pressure);
        let rate = row.shear_rate.unwrap();
        assert!((rate.value - 2.0).abs() < 4.0 * rate.error);
        let i = row.i.unwrap().value;
        let expected = 2.0 * (2600.0 / row.p.value).sqrt();
        assert!((i / expected - 1.0).abs() < 0.02);
    }
}

#[test]
fn speed_gained_while_averaging_is_no_temperature() {
    let layers = Layering {
        lower: 0.0,
        thickness: 1.0,
        count: 10,
    };
    let mut temperatures = [0.0, 3.0].map(|gain| {
        let mut rng = ChaCha8Rng::seed_from_u64(6);
        let mut averager = Averager::new(Layers, layers).unwrap();
        for i in 0..400 {
            let time = 7.0 + f64::from(i) / 400.0;
            let mut gas = sheared_gas(&mut rng, time, 2.0, 0.5);
            gas.grains
                .iter_mut()
                .for_each(|g| g.velocity.x += gain * (time - 7.0));
            averager.sample(&gas);
        }
        averager.profile(1.0, 2600.0).rows[5].temperature
    });
    // Left in, the drift would add 3²/12/3 = 0.25 to 0.5.
    let [still, gaining] = &mut temperatures;
    assert!(
        (gaining.value - still.value).abs() < 1e-3,
        "{still:?} {gaining:?}"
    );
    assert!((gaining.value - 0.5).abs() < 4.0 * gaining.error);
}

#[test]
fn what_a_swelling_flow_carries_upwards_is_no_stress() {
    // Grains in free flight along parabolas, faster the higher they are and rising together: no contact bears anything,
    // and the mean flow carries much of the weight's worth of momentum through every layer.
    let gravity = Vector3::new(4.0, 0.0, -8.0);
    let mut rng = ChaCha8Rng::seed_from_u64(9);
    let grains: Vec<GrainSample> = (0..400)
        .map(|id| {
            let place = |high: f64, rng: &mut ChaCha8Rng| rng.random_range(0.0..high);
            let position = Vector3::new(
                place(3.0, &mut rng),
                place(2.0, &mut rng),
                place(6.0, &mut rng),
            );
            GrainSample {
                velocity: Vector3::new(3.0 * position.z, 0.0, 2.5),
                ..grain(id, position, 0.2, false)
            }
        })
        .collect();
    let layers = Layering {
        lower: -1.0,
        thickness: 0.5,
        count: 20,
    };
    let mut averager = Averager::new(Lucy { half_width: 0.5 }, layers).unwrap();
    for k in 0..=2000 {
        let t = 2e-4 * f64::from(k);
        let mut s = network_at_rest(1);
        s.time = t;
        s.gravity = gravity;
        (s.contacts, s.bonds) = (Vec::new(), Vec::new());
        s.grains = grains.clone();
        for g in &mut s.grains {
            g.position += g.velocity * t + 0.5 * t * t * gravity;
            g.velocity += gravity * t;
        }
        averager.sample(&s);
    }
    let profile = averager.profile(0.4, 2600.0);
    let balance = profile.balance;
    println!("{balance:?}");
    assert!(balance.downslope_relative < 2e-3, "{balance:?}");
    assert!(balance.normal_relative < 2e-3, "{balance:?}");
    // Without what is carried the balance would miss this much.
    let weight = grains.iter().map(|g| g.mass).sum::<f64>() * 80f64.sqrt() / 6.0;
    let carried = |r: &colluvium_coupling::coarse_graining::ProfileRow| {
        (r.density.value * r.u.value * r.w.value).abs() / weight
    };
    let most = profile.rows.iter().map(carried).fold(0.0, f64::max);
    assert!(most > 0.05, "{most}");
}

#[test]
fn block_errors_cover_correlated_samples() {
    // Mean velocity follows an AR(1) process with coefficient 0.9 over 3000 samples.
    let mut rng = ChaCha8Rng::seed_from_u64(11);
    let layers = Layering {
        lower: 0.0,
        thickness: 1.0,
        count: 1,
    };
    let (mut covered, mut naive_covered) = (0, 0);
    let runs = 200;
    let mut s = stack();
    s.contacts.clear();
    s.grains.truncate(2);
    s.grains[1].position.z = 0.5;
    for _ in 0..runs {
        let mut averager = Averager::new(Layers, layers).unwrap();
        let mut x = rng.sample::<f64, _>(StandardNormal) / (1.0f64 - 0.81).sqrt();
        for _ in 0..3000 {
            x = 0.9 * x + rng.sample::<f64, _>(StandardNormal);
            s.grains[1].velocity.x = x;
            averager.sample(&s);
        }
        let u = averager.profile(1.0, 1.0).rows[0].u;
        covered += i32::from(u.value.abs() < u.error);
        let naive = (1.0 / 0.19f64 / 3000.0).sqrt();
        naive_covered += i32::from(u.value.abs() < naive);
    }
    let rate = f64::from(covered) / f64::from(runs);
    assert!((0.60..0.76).contains(&rate), "1σ coverage {rate}");
    // Taking samples as independent covers far less.
    assert!(f64::from(naive_covered) / f64::from(runs) < 0.4);
}

#[test]
fn a_checkpoint_goes_on_with_the_same_bits() {
    let mut rng = ChaCha8Rng::seed_from_u64(5);
    let snapshots: Vec<_> = (0..150)
        .map(|i| sheared_gas(&mut rng, f64::from(i), 1.0, 0.1))
        .collect();
    let layers = Layering {
        lower: 0.0,
        thickness: 1.0,
        count: 10,
    };
    let mut whole = Averager::new(Layers, layers).unwrap();
    let mut first = Averager::new(Layers, layers).unwrap();
    snapshots.iter().for_each(|s| whole.sample(s));
    snapshots[..93].iter().for_each(|s| first.sample(s));
    let mut record = Record::default();
    first.save("average", &mut record);
    let mut second = Averager::new(Layers, layers).unwrap();
    second.load("average", &record).unwrap();
    snapshots[93..].iter().for_each(|s| second.sample(s));
    assert_eq!(whole.profile(1.0, 1.0), second.profile(1.0, 1.0));

    record.numbers.remove("average.blocks");
    let message = second.load("average", &record).unwrap_err().to_string();
    assert!(message.contains("average.blocks"), "{message}");
    assert!(
        Averager::new(
            Layers,
            Layering {
                thickness: -1.0,
                ..layers
            }
        )
        .is_err()
    );
}
