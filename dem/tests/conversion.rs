//! Grains that become another material during a run.

use colluvium_dem::*;
use nalgebra::Vector3;

const RADIUS: f64 = 0.5;

fn law(cohesion: Cohesion) -> ContactLaw {
    let elasticity = Elasticity {
        youngs_modulus: 1e5,
        poissons_ratio: 0.3,
    };
    ContactLaw {
        cohesion,
        ..ContactLaw::hertz_mindlin(elasticity, 0.3, 0.8)
    }
}

/// Chains of grains that hang under a fixed one by their cohesion; the second material has none.
fn hanging(threads: Threads) -> Setup {
    let sticky = Cohesion::Dmt {
        work_of_adhesion: 0.2,
        asperity_radius: None,
    };
    let laws = Laws {
        own: vec![law(sticky), law(Cohesion::None)],
        pairs: Vec::new(),
    };
    let grain = |k: usize| {
        let (chain, below) = (k / 4, k % 4);
        let place = Vector3::new(3.0 * chain as f64, 0.0, -1.999 * RADIUS * below as f64);
        Grain {
            fixed: below == 0,
            ..Grain::at_rest(place, RADIUS, 1000.0)
        }
    };
    Setup {
        domain: Domain {
            lower: Vector3::repeat(-10.0),
            upper: Vector3::repeat(900.0),
            periodic: [false; 3],
        },
        gravity: Vector3::new(0.0, 0.0, -1e-4),
        law: laws,
        grains: (0..800).map(grain).collect(),
        walls: Vec::new(),
        bodies: Vec::new(),
        timestep: 2e-3,
        threads,
    }
}

/// Every fifth chain parts below its second grain.
fn crack(simulation: &mut Simulation) -> usize {
    let parts = |g: &GrainSample| (g.id % 4 == 2 && (g.id / 4).is_multiple_of(5)).then_some(1);
    simulation.convert(parts).unwrap()
}

/// Grains without cohesion let go and fall freely, those that hung from them too; all others stay.
#[test]
fn grains_without_cohesion_let_go() {
    let mut simulation = Simulation::new(hanging(Threads::Serial)).unwrap();
    simulation.advance(5000).unwrap();
    let before = simulation.grain_list();
    assert_eq!(crack(&mut simulation), 40);
    let steps = 50_000;
    simulation.advance(steps).unwrap();
    let time = steps as f64 * 2e-3;
    let fall = 0.5 * 1e-4 * time * time;
    for (k, (now, then)) in simulation.grain_list().iter().zip(&before).enumerate() {
        let sunk = then.position.z - now.position.z;
        let loose = k % 4 >= 2 && (k / 4).is_multiple_of(5);
        // What the attraction had pressed into each other springs apart, at 5e-4 m/s.
        let exact = if loose { fall } else { 0.0 };
        assert!((sunk - exact).abs() < 0.12 * fall, "{k}: {sunk} {exact}");
    }
    let momentum = simulation.momentum_error();
    assert!(momentum < 1e-9, "{momentum:e}");
}

/// The same bits for any number of threads, and across a restart after the change.
#[test]
fn converted_grains_keep_the_same_bits() {
    let run = |threads: Threads, restart: bool| {
        let mut simulation = Simulation::new(hanging(threads)).unwrap();
        simulation.advance(500).unwrap();
        crack(&mut simulation);
        simulation.advance(500).unwrap();
        if restart {
            let record = simulation.checkpoint();
            simulation = Simulation::resume(hanging(threads), &record).unwrap();
        }
        simulation.advance(500).unwrap();
        simulation.state_hash()
    };
    let whole = run(Threads::Serial, false);
    assert_eq!(whole, run(Threads::Rayon, false));
    assert_eq!(whole, run(Threads::Serial, true));
}

#[test]
fn unknown_materials_are_refused_and_change_nothing() {
    let mut simulation = Simulation::new(hanging(Threads::Serial)).unwrap();
    let before = simulation.state_hash();
    let error = simulation
        .convert(|g| Some(if g.id == 7 { 2 } else { 1 }))
        .unwrap_err();
    assert!(error.to_string().contains('2'), "{error}");
    assert_eq!(simulation.state_hash(), before);
    simulation.advance(2000).unwrap();
    let mut other = Simulation::new(hanging(Threads::Serial)).unwrap();
    other.advance(2000).unwrap();
    assert_eq!(simulation.state_hash(), other.state_hash());
}
