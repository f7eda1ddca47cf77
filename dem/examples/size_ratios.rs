//! What a step costs with a few large grains among many small ones:
//! `cargo run --release -p colluvium-dem --example size_ratios`.

use colluvium_dem::{
    ContactLaw, Domain, Grain, Hooke, Lever, Setup, Simulation, Snapshot, TangentialSpring, Threads,
};
use nalgebra::Vector3;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use std::error::Error;
use std::time::Instant;

const STEPS: u64 = 300;

/// Large spheres on a lattice in a crystal of small ones that just overlap.
fn packing(ratio: f64) -> Vec<Grain> {
    let mut random = ChaCha8Rng::seed_from_u64(1);
    let side = 40.0_f64.max(1.3 * ratio);
    let density = 6.0 / std::f64::consts::PI;
    let mut large = Vec::new();
    if ratio > 1.0 {
        let count = (side / (1.3 * ratio)).floor();
        let step = side / count;
        for k in 0..count.powi(3) as u32 {
            let cell = Vector3::new(k, k / count as u32, k / (count * count) as u32);
            let at = cell.map(|c| (f64::from(c % count as u32) + 0.5) * step);
            large.push(Grain::at_rest(at, 0.5 * ratio, density));
        }
    }
    let mut grains = large.clone();
    let spacing = 0.99;
    let along = (side / spacing) as u32;
    for k in 0..along.pow(3) {
        let at = Vector3::new(k, k / along, k / along.pow(2)).map(|c| f64::from(c % along));
        let mut grain = Grain::at_rest(at * spacing, 0.5, density);
        let apart = |big: &Grain| (big.position - grain.position).norm() - big.radius - 0.5;
        if large.iter().all(|big| apart(big) > -0.01) {
            grain.velocity = Vector3::from_fn(|_, _| random.random_range(-0.1..0.1));
            grains.push(grain);
        }
    }
    grains
}

fn main() -> Result<(), Box<dyn Error>> {
    for ratio in [1.0, 5.0, 20.0, 50.0] {
        let grains = packing(ratio);
        let count = grains.len();
        let law = ContactLaw {
            lever: Lever::Radius,
            ..ContactLaw::linear(
                Hooke::matched(2e5, 0.88),
                TangentialSpring::matched(2.0 / 7.0, 1.0, 0.5),
                None,
            )
        };
        let mut simulation = Simulation::new(Setup {
            domain: Domain {
                lower: Vector3::zeros(),
                upper: Vector3::repeat(100.0),
                periodic: [false; 3],
            },
            gravity: Vector3::zeros(),
            law: law.into(),
            grains,
            walls: Vec::new(),
            bodies: Vec::new(),
            timestep: 1e-4,
            threads: Threads::Serial,
        })?;
        simulation.advance(20)?;
        let start = Instant::now();
        simulation.advance(STEPS)?;
        let seconds = start.elapsed().as_secs_f64();
        let mut snapshot = Snapshot::default();
        simulation.snapshot(&mut snapshot);
        let (steps, contacts) = (STEPS as f64, snapshot.contacts.len());
        println!(
            "ratio {ratio:2}: {count:6} grains, {contacts:6} contacts, {:5.1} million grain-steps/s, \
             {:5.1} ns a contact, {} rebuilds",
            1e-6 * steps * count as f64 / seconds,
            1e9 * seconds / (steps * contacts as f64),
            simulation.list_builds(),
        );
    }
    Ok(())
}
