//! Under every law: the same bits for any number of threads and after a checkpoint.

use crate::world::{laws, setup};
use colluvium_dem::*;

const GRAINS: usize = 4000;
const TIMESTEP: f64 = 1e-4;

/// The hash after `legs` of 150 steps, with a checkpoint and a restart between them.
fn hash(setup: &Setup, threads: usize, legs: u64) -> String {
    let pool = rayon::ThreadPoolBuilder::new()
        .num_threads(threads)
        .build()
        .unwrap();
    let mut setup = setup.clone();
    setup.threads = if threads > 1 {
        Threads::Rayon
    } else {
        Threads::Serial
    };
    pool.install(|| {
        let mut simulation = Simulation::new(setup.clone()).unwrap();
        for leg in 0..legs {
            simulation.advance(450 / legs).unwrap();
            if leg + 1 < legs {
                let record = simulation.checkpoint();
                simulation = Simulation::resume(setup.clone(), &record).unwrap();
            }
        }
        simulation.state_hash()
    })
}

fn check(name: &str, setup: &Setup) {
    let reference = hash(setup, 1, 1);
    assert_eq!(reference, hash(setup, 2, 1), "{name}: two threads");
    assert_eq!(
        reference,
        hash(setup, 3, 3),
        "{name}: three threads, two restarts"
    );
}

#[test]
fn every_law_gives_the_same_bits() {
    for (name, law) in laws() {
        check(name, &setup(law, GRAINS, TIMESTEP));
    }
}

#[test]
fn mixed_materials_give_the_same_bits() {
    let list = laws();
    let law = |name: &str| list.iter().find(|(n, _)| *n == name).unwrap().1;
    let mut setup = setup(law("Hertz–Mindlin"), GRAINS, TIMESTEP);
    let mut stiff = law("Hertz–Mindlin");
    stiff.normal = Normal::Hertz(Hertz {
        effective_modulus: 3e6,
        restitution: 0.9,
    });
    setup.law = Laws {
        own: vec![law("Hertz–Mindlin"), law("Hertz–Mindlin, EPSD, DMT"), stiff],
        pairs: vec![(0, 2, law("Hertz–Mindlin, EPSD, DMT"))],
    };
    for (k, grain) in setup.grains.iter_mut().enumerate() {
        grain.material = (k % 3) as u16;
    }
    check("three materials", &setup);
    let mixed = hash(&setup, 1, 1);
    setup.grains.iter_mut().for_each(|g| g.material = 0);
    assert_ne!(mixed, hash(&setup, 1, 1), "materials make a difference");
}
