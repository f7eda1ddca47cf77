//! Fixtures shared by the tests across crates: materials, beds, other codes' figures.

pub mod blow_up;
pub mod fit;
pub mod gas;
pub mod impacts;
pub mod laws;
pub mod rebound;
pub mod silo;
mod starts;

pub use starts::{StartError, chute_start, read_start, settle_start, settled_start};

use colluvium_coupling::incline::{InclineSpec, Purpose, Start};
use colluvium_dem::preparation::{Bed, InclineBed, RadiusLaw, settle_incline_bed};
use colluvium_dem::{
    ContactLaw, Hooke, SetupError, ShapeParameter, TangentialSpring, Threads, timestep,
};
use std::ops::ControlFlow;

/// Density of grains of mean mass 1 in units of d = m = g = 1.
pub const DENSITY: f64 = 6.0 / std::f64::consts::PI;
/// k_n d/(m g) of the reference runs.
pub const STIFFNESS: f64 = 2e4;

/// The thesis' material (Thuillet 2019, Tab. 2.1) at a shape parameter β, or round without one.
pub fn material(beta: Option<f64>) -> ContactLaw {
    ContactLaw::linear(
        Hooke::matched(STIFFNESS, 0.5),
        TangentialSpring::matched(2.0 / 7.0, 0.5, 1.0),
        beta.map(|beta| ShapeParameter {
            beta,
            rolling_friction: 1.05,
            twisting_friction: 1.3,
        }),
    )
}

/// Contact time over 30 (Eq. 2.7).
pub fn step() -> f64 {
    timestep::step(1.0, STIFFNESS, 30.0)
}

/// A settled bed of `grains` on a `length` × `width` base.
///
/// # Errors
/// If the bed cannot be prepared.
pub fn bed(
    law: ContactLaw,
    grains: usize,
    [length, width]: [f64; 2],
    seed: u64,
) -> Result<Bed, SetupError> {
    let spec = InclineBed {
        grains,
        radius: RadiusLaw::Gaussian {
            mean: 0.5,
            relative_deviation: 0.1,
            cut: 1.0,
        },
        density: DENSITY,
        length,
        width,
        law,
        gravity: 1.0,
        timestep: step(),
        seed,
    };
    settle_incline_bed(&spec, Threads::Serial, &mut |_| ControlFlow::Continue(()))
}

/// A run on a slope, in units of d = m = g = 1.
pub fn incline(
    law: ContactLaw,
    bed: &Bed,
    slope_degrees: f64,
    start: Start,
    purpose: Purpose,
    [relax, average]: [f64; 2],
) -> InclineSpec {
    InclineSpec {
        slope: slope_degrees.to_radians(),
        gravity: 1.0,
        diameter: 1.0,
        grain_density: DENSITY,
        law,
        domain: bed.domain,
        bed: bed.grains.clone(),
        start,
        purpose,
        timestep: step(),
        relax_time: relax,
        average_time: average,
        max_time: relax + average,
        sample_every: 20,
        layer: 1.0,
        steady_tolerance: 0.03,
        threads: Threads::Serial,
    }
}

/// A layer of the reference flow: I, |τ|/p (p = trace/3), |τ|/σ_zz, φ.
pub type ReferenceLayer = [f64; 4];

/// The moderate material (β = 0.2) at 33°, layers 3 d to 21 d above the base.
///
/// LAMMPS 22 Jul 2025, `pair granular` (hooke, linear_history, sds rolling and twisting, restitution
/// damping): 1 700 grains over 100 fixed ones, 12 × 6 d, k_n 2e4, Δt 6e-4, averaged over 60 √(d/g) after
/// 84. One seed; single layers scatter by 1.2 % in μ and 0.0035 in φ about a line.
pub const LAMMPS_MODERATE_33: [ReferenceLayer; 18] = [
    [0.392941, 0.653097, 0.607033, 0.492338],
    [0.341115, 0.646165, 0.607831, 0.501539],
    [0.319224, 0.648366, 0.603762, 0.498583],
    [0.313337, 0.653007, 0.603920, 0.497266],
    [0.293849, 0.657273, 0.604813, 0.498738],
    [0.270083, 0.657023, 0.605095, 0.507281],
    [0.250525, 0.646371, 0.603588, 0.505846],
    [0.235237, 0.629288, 0.603490, 0.513765],
    [0.235386, 0.641172, 0.601714, 0.508543],
    [0.234887, 0.638085, 0.603620, 0.507822],
    [0.227052, 0.647029, 0.599292, 0.506045],
    [0.211267, 0.636843, 0.600896, 0.510776],
    [0.211679, 0.626905, 0.601957, 0.510549],
    [0.225526, 0.628349, 0.600423, 0.506796],
    [0.234574, 0.640416, 0.600337, 0.509451],
    [0.225446, 0.630047, 0.603454, 0.518360],
    [0.224827, 0.639069, 0.599422, 0.505516],
    [0.236322, 0.622260, 0.603175, 0.513954],
];

/// Straight line through column `column` against I: value at `i`.
pub fn reference_line(layers: &[ReferenceLayer], column: usize, i: f64) -> f64 {
    let n = layers.len() as f64;
    let mean = |f: &dyn Fn(&ReferenceLayer) -> f64| layers.iter().map(f).sum::<f64>() / n;
    let (x, y) = (mean(&|l| l[0]), mean(&|l| l[column]));
    let covariance = mean(&|l| (l[0] - x) * (l[column] - y));
    let variance = mean(&|l| (l[0] - x).powi(2));
    y + covariance / variance * (i - x)
}
