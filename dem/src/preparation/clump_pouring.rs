//! Clumps poured into a running simulation, batch by batch: the balls about them are poured as grains are, and
//! each lets its clump in, turned at random.

use super::ingredients::Amount;
use super::pouring::{Pouring, PouringReport, pour_by};
use super::relaxation::Relaxation;
use super::scattering::ClumpShape;
use super::watch::Watch;
use crate::grains::Grain;
use crate::region::Region;
use crate::setup::SetupError;
use crate::simulation::Simulation;
use nalgebra::Vector3;
use rand_chacha::ChaCha8Rng;

/// What clumps are poured from where.
#[derive(Clone, Debug)]
pub struct ClumpPouring {
    /// Where clumps appear; the balls about them lie in it as a whole.
    pub source: Region,
    /// What they are.
    pub shape: ClumpShape,
    /// How many.
    pub count: usize,
    /// Their velocity (m/s).
    pub velocity: Vector3<f64>,
    /// Time from batch to batch (s); none: the time in which grains leave the source.
    pub interval: Option<f64>,
    /// Share of the source that the balls about the clumps of a batch fill at most.
    pub fill: f64,
    /// Seed of all random numbers.
    pub seed: u64,
}

/// Pours clumps in and lets them come to rest; the report counts clumps, and says nothing of sizes.
///
/// # Errors
/// If a number is out of its range, the source stays blocked, or the clumps do not come to rest.
pub fn pour_clumps(
    simulation: &mut Simulation,
    spec: &ClumpPouring,
    relaxation: &Relaxation,
    watch: &mut dyn Watch,
) -> Result<PouringReport, SetupError> {
    let shape = &spec.shape;
    shape.validate("clump")?;
    let hulls = Pouring {
        source: spec.source.clone(),
        ingredients: vec![shape.hull()],
        amount: Amount::Grains(spec.count),
        velocity: spec.velocity,
        interval: spec.interval,
        fill: spec.fill,
        seed: spec.seed,
    };
    let mut enter = |simulation: &mut Simulation, batch: &[Grain], random: &mut ChaCha8Rng| {
        let poses: Vec<_> = batch
            .iter()
            .map(|hull| shape.thrown(&hull.position, random))
            .collect();
        let grains: Vec<Grain> = poses
            .iter()
            .flat_map(|pose| shape.grains(pose, spec.velocity))
            .collect();
        let balls = shape.balls.len() as u32;
        let clump = |(pose, k)| shape.clump(pose, balls * k);
        let clumps: Vec<_> = poses.iter().zip(0..).map(clump).collect();
        simulation.insert_clumped(&grains, &clumps).map(|_| ())
    };
    let mut report = pour_by(simulation, &hulls, relaxation, watch, &mut enter)?;
    report.sizes.clear();
    Ok(report)
}
