//! Memory of a grain: `cargo run --release -p colluvium-benchmarks --bin memory`.
//!
//! The chute's 32 000 grains are set side by side along x, 256 000 in all, and run for some thousand steps, each
//! number of threads in a process of its own. What is counted is resident memory: that of the process with the
//! running simulation less that before its start state was read, largest value and last, by moving grain.
//! Prints a Markdown table. Reads `/proc`: Linux only.

use colluvium_benchmarks::peers::machine::{begin_peak_of_memory, memory};
use colluvium_dem::{
    ContactLaw, Damping, Domain, Hooke, Lever, Setup, Simulation, SpringStiffness,
    TangentialSpring, Threads,
};
use nalgebra::Vector3;
use std::error::Error;
use std::process::Command;

/// Chutes set side by side along x.
const TILES: usize = 8;
/// Length of one along x (m).
const LENGTH: f64 = 40.0;
const STEPS: u64 = 2000;

fn setup(threads: usize) -> Setup {
    let spring = TangentialSpring {
        stiffness: SpringStiffness::Ratio(2.0 / 7.0),
        damping: Damping::MassProportional(0.0),
        friction: 0.5,
    };
    let hooke = Hooke {
        stiffness: 2e5,
        damping: Damping::MassProportional(50.0),
    };
    let law = ContactLaw {
        lever: Lever::Radius,
        ..ContactLaw::linear(hooke, spring, None)
    };
    let start = colluvium_tests::chute_start();
    let mut grains = Vec::with_capacity(TILES * start.len());
    for tile in 0..TILES {
        for grain in &start {
            let mut grain = *grain;
            grain.position.x += LENGTH * tile as f64;
            grains.push(grain);
        }
    }
    let slope = 26_f64.to_radians();
    Setup {
        domain: Domain {
            lower: Vector3::zeros(),
            upper: Vector3::new(LENGTH * TILES as f64, 20.0, 60.0),
            periodic: [true, true, false],
        },
        gravity: Vector3::new(slope.sin(), 0.0, -slope.cos()),
        law: law.into(),
        grains,
        walls: Vec::new(),
        bodies: Vec::new(),
        timestep: 1e-4,
        threads: if threads == 1 {
            Threads::Serial
        } else {
            Threads::Rayon
        },
    }
}

fn status(key: &str) -> Result<f64, Box<dyn Error>> {
    Ok(memory(key).ok_or("the system does not tell memory")?)
}

/// Peak and last resident memory of the steps, bytes by moving grain.
fn measure(threads: usize) -> Result<[f64; 2], Box<dyn Error>> {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads);
    pool.build_global()?;
    rayon::broadcast(|_| ());
    let before = status("VmRSS")?;
    let mut chute = Simulation::new(setup(threads))?;
    // Without what the start state took.
    begin_peak_of_memory()?;
    chute.advance(STEPS)?;
    let moving = chute.grain_count() as f64;
    let peak = status("VmHWM")?;
    let last = status("VmRSS")?;
    Ok([peak, last].map(|bytes| (bytes - before) / moving))
}

fn main() -> Result<(), Box<dyn Error>> {
    if let Some(threads) = std::env::args().nth(1) {
        let [peak, last] = measure(threads.parse()?)?;
        println!("| {threads} | {peak:.0} | {last:.0} |");
        return Ok(());
    }
    println!("| threads | bytes a moving grain, peak | at the end |");
    println!("|---|---|---|");
    for threads in ["1", "2"] {
        let status = Command::new(std::env::current_exe()?)
            .arg(threads)
            .status()?;
        if !status.success() {
            return Err(format!("{threads} threads: {status}").into());
        }
    }
    Ok(())
}
