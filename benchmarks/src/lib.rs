//! Cases that benchmarks share, so that speed is measured on what the tests check.

use colluvium_continuum::bagnold::BagnoldCase;
use colluvium_continuum::rheology::MuI;
use colluvium_dem::preparation::{InclineBed, RadiusLaw, settle_incline_bed};
use colluvium_dem::{
    ContactLaw, Hooke, Lever, Setup, SetupError, ShapeParameter, Simulation, TangentialSpring,
    Threads, timestep,
};
use nalgebra::Vector3;
use std::ops::ControlFlow;

/// A sheared bed on a slope of 33°, in units of d = m = g = 1.
///
/// # Errors
/// If the bed cannot be prepared.
pub fn sheared_bed(
    grains: usize,
    [length, width]: [f64; 2],
    beta: Option<f64>,
    threads: Threads,
) -> Result<Simulation, SetupError> {
    let law = ContactLaw {
        normal: Hooke {
            stiffness: 2e4,
            restitution: 0.5,
        },
        tangential: TangentialSpring {
            stiffness_ratio: 2.0 / 7.0,
            restitution: 0.5,
            friction: 1.0,
        },
        rolling: beta.map(|beta| ShapeParameter {
            beta,
            rolling_friction: 1.05,
            twisting_friction: 1.3,
        }),
        lever: Lever::ContactPoint,
    };
    let step = timestep::step(1.0, law.normal.stiffness, 30.0);
    let spec = InclineBed {
        grains,
        radius: RadiusLaw::Gaussian {
            mean: 0.5,
            relative_deviation: 0.1,
            cut: 1.0,
        },
        density: 6.0 / std::f64::consts::PI,
        length,
        width,
        law,
        gravity: 1.0,
        timestep: step,
        seed: 1,
    };
    let bed = settle_incline_bed(&spec, threads, &mut |_| ControlFlow::Continue(()))?;
    let slope = 33_f64.to_radians();
    let mut simulation = Simulation::new(Setup {
        domain: bed.domain,
        gravity: Vector3::new(slope.sin(), 0.0, -slope.cos()),
        law,
        grains: bed.grains,
        planes: Vec::new(),
        timestep: step,
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
