//! Cases that benchmarks share, so that speed is measured on what the tests check.

pub mod columns;
pub mod peers;

use colluvium_continuum::bagnold::BagnoldCase;
use colluvium_continuum::rheology::MuI;
use colluvium_dem::{Setup, SetupError, Simulation, Threads};
use colluvium_tests::{bed, material, step};
use nalgebra::Vector3;

/// A sheared bed on a slope of 33°, in units of d = m = g = 1.
///
/// # Errors
/// If the bed cannot be prepared.
pub fn sheared_bed(
    grains: usize,
    floor: [f64; 2],
    beta: Option<f64>,
    threads: Threads,
) -> Result<Simulation, SetupError> {
    let law = material(beta);
    let bed = bed(law, grains, floor, 1)?;
    let slope = 33_f64.to_radians();
    let mut simulation = Simulation::new(Setup {
        domain: bed.domain,
        gravity: Vector3::new(slope.sin(), 0.0, -slope.cos()),
        law: law.into(),
        grains: bed.grains,
        walls: Vec::new(),
        bodies: Vec::new(),
        timestep: step(),
        threads,
    })?;
    simulation.give_velocity(|g| Vector3::new(0.6 * g.position.z.max(0.0), 0.0, 0.0));
    Ok(simulation)
}

/// The layer of the field's comparisons: α = 0.43, d/H = 0.04, μ_s 0.32, Δμ 0.28, I_0 0.4.
pub fn bagnold(cells: usize) -> BagnoldCase {
    BagnoldCase {
        slope: 0.43,
        depth: 1.0,
        gravity: 1.0,
        rheology: MuI {
            mu_s: 0.32,
            mu_2: 0.6,
            i_0: 0.4,
            diameter: 0.04,
            solid_fraction: 1.0,
            grain_density: 1.0,
            cohesion: 0.0,
        },
        cells,
        columns: None,
    }
}
