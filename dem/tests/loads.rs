//! Steady loads: motion in closed form, accounts, restarts and threads.

use crate::world::{laws, setup};
use colluvium_dem::*;
use nalgebra::Vector3;

const STEP: f64 = 1e-3;

fn lone(fixed: bool) -> Setup {
    let mut grain = Grain::at_rest(Vector3::zeros(), 0.05, 1000.0);
    grain.fixed = fixed;
    Setup {
        grains: vec![grain],
        gravity: Vector3::zeros(),
        walls: Vec::new(),
        ..setup(laws()[0].1, 1, STEP)
    }
}

fn pull(grain: u32) -> Load {
    Load {
        grain,
        force: Vector3::new(3.0, -1.0, 0.5),
        moment: Vector3::new(0.0, 0.02, -0.01),
    }
}

#[test]
fn a_lone_grain_speeds_up_and_spins_up_as_newton_says() {
    let setup = lone(false);
    let (mass, load) = (setup.grains[0].mass(), pull(0));
    let mut simulation = Simulation::new(setup).unwrap();
    simulation.set_loads(&[load]).unwrap();
    simulation.advance(200).unwrap();
    let mut seen = Snapshot::default();
    simulation.snapshot(&mut seen);
    let t = simulation.time();
    let inertia = 0.4 * mass * 0.05 * 0.05;
    let velocity = load.force / mass * t;
    let spin = load.moment / inertia * t;
    assert!((seen.grains[0].velocity - velocity).norm() < 1e-12 * velocity.norm());
    assert!((seen.grains[0].spin - spin).norm() < 1e-12 * spin.norm());
    assert!(simulation.momentum_error() < 1e-13);
}

#[test]
fn a_fixed_grain_and_a_missing_one_bear_nothing() {
    let mut simulation = Simulation::new(lone(true)).unwrap();
    simulation.set_loads(&[pull(0)]).unwrap();
    simulation.advance(50).unwrap();
    assert_eq!(simulation.wall_impulse(), Vector3::zeros());
    let refused = simulation.set_loads(&[pull(7)]).unwrap_err();
    assert!(
        refused.to_string().contains("loads[0].grain = 7"),
        "{refused}"
    );
    let mut bad = pull(0);
    bad.moment.y = f64::NAN;
    assert!(simulation.set_loads(&[bad]).is_err());
}

fn loaded(threads: Threads) -> Simulation {
    let law = laws()[5].1;
    let mut simulation = Simulation::new(Setup {
        threads,
        ..setup(law, 1500, 5e-5)
    })
    .unwrap();
    let loads: Vec<Load> = (0..40).map(|k| pull(31 * k)).collect();
    simulation.set_loads(&loads).unwrap();
    simulation
}

#[test]
fn loads_close_every_account_and_survive_sorting_restarts_and_threads() {
    let mut whole = loaded(Threads::Serial);
    whole.open_energy_ledger();
    whole.advance(3000).unwrap();
    assert!(whole.list_builds() > 2, "grains must be sorted");
    let ledger = whole.energy_ledger().unwrap();
    assert!(ledger.error() < 1e-11, "{:e}", ledger.error());
    assert!(ledger.loads.abs() > 1e-2 * ledger.kinetic);
    assert!(whole.momentum_error() < 1e-11);

    let mut first = loaded(Threads::Rayon);
    first.advance(1500).unwrap();
    let record = first.checkpoint();
    let law = laws()[5].1;
    let mut second = Simulation::resume(setup(law, 1500, 5e-5), &record).unwrap();
    second.advance(1500).unwrap();
    assert_eq!(second.state_hash(), whole.state_hash());
    second.set_loads(&[]).unwrap();
    second.advance(10).unwrap();
    whole.advance(10).unwrap();
    assert_ne!(second.state_hash(), whole.state_hash());
}
