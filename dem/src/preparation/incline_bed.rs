//! A settled bed over a rough base, ready to be tilted.
//!
//! Loose grains fall on a floor to which the first ones stick: a rough base made of the flow's own
//! grains (Thuillet 2019, §2.3.2). The rest settles on it under gravity normal to the floor.

use super::watch::stopped;
use super::{RadiusLaw, Rest};
use crate::contact::ContactLaw;
use crate::domain::Domain;
use crate::grains::Grain;
use crate::record::Record;
use crate::setup::{Setup, SetupError, Threads, check};
use crate::simulation::Simulation;
use crate::snapshot::Snapshot;
use crate::walls::Wall;
use nalgebra::Vector3;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use serde::{Deserialize, Serialize};
use std::ops::ControlFlow;

/// What to prepare.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct InclineBed {
    /// Free grains over the base.
    pub grains: usize,
    /// Their size law; the base has the same.
    pub radius: RadiusLaw,
    /// Density of the grains (kg/m³).
    pub density: f64,
    /// Length of the periodic box downslope (m).
    pub length: f64,
    /// Width of the periodic box (m).
    pub width: f64,
    /// Contact law.
    pub law: ContactLaw,
    /// Magnitude of gravity (m/s²).
    pub gravity: f64,
    /// Step (s).
    pub timestep: f64,
    /// Seed of all random numbers.
    pub seed: u64,
}

/// How the bed came out.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct BedReport {
    /// Free grains.
    pub grains: usize,
    /// Fixed grains of the base.
    pub base_grains: usize,
    /// Height of the free surface above the base's tops (m), from the grains' mean height.
    pub depth: f64,
    /// Volume of free grains over floor area times depth.
    pub solid_fraction: f64,
    /// Contacts a free grain has.
    pub coordination: f64,
    /// Kinetic energy left over m g d a grain.
    pub kinetic_energy: f64,
    /// Time it took to settle (s).
    pub settling_time: f64,
    /// Grains times steps integrated.
    pub grain_steps: u64,
}

/// A prepared bed.
#[derive(Clone, Debug)]
pub struct Bed {
    /// The box; periodic along x and y, z from below the base up.
    pub domain: Domain,
    /// Base (fixed) and free grains; the tops of the base lie near z = 0.
    pub grains: Vec<Grain>,
    /// How it came out.
    pub report: BedReport,
}

/// Settled when the kinetic energy is below this, in m g d a grain.
const AT_REST: f64 = 1e-7;
/// Longest time to settle, in √(d/g).
const PATIENCE: f64 = 400.0;
/// Steps between looks at the grains.
const LOOK_EVERY: u64 = 20;

/// Drops grains on a sticky floor and lets them come to rest.
///
/// `progress` gets the share of the work done so far (an estimate) and may stop it. The same seed
/// gives the same bed.
///
/// # Errors
/// If a number is out of its range, the grains do not come to rest in time, or too many of them stick.
pub fn settle_incline_bed(
    spec: &InclineBed,
    threads: Threads,
    progress: &mut dyn FnMut(f64) -> ControlFlow<()>,
) -> Result<Bed, SetupError> {
    settle_incline_bed_from(None, spec, threads, &mut |share, _| progress(share))
}

/// The same, from the state ([`Simulation::checkpoint`]) that `progress` has been shown before, if it is given one.
///
/// # Errors
/// As [`settle_incline_bed`]; if the state is of another bed.
pub fn settle_incline_bed_from(
    state: Option<&Record>,
    spec: &InclineBed,
    threads: Threads,
    progress: &mut dyn FnMut(f64, &mut Simulation) -> ControlFlow<()>,
) -> Result<Bed, SetupError> {
    spec.radius.validate()?;
    check("grains.count", spec.grains as f64, "> 0", |v| v > 0.0)?;
    check("gravity", spec.gravity, "> 0 m/s²", |v| v > 0.0)?;
    let diameter = 2.0 * spec.radius.mean();
    let time_unit = (diameter / spec.gravity).sqrt();
    let (domain, cloud) = loose_cloud(spec, time_unit);
    let mass: f64 = cloud.iter().map(Grain::mass).sum();
    let scale = mass * spec.gravity * diameter;
    let floor = Wall::plane(Vector3::zeros(), Vector3::z());
    let setup = Setup {
        domain,
        gravity: Vector3::new(0.0, 0.0, -spec.gravity),
        law: spec.law.into(),
        grains: cloud,
        walls: vec![floor],
        bodies: Vec::new(),
        timestep: spec.timestep,
        threads,
    };
    let mut simulation = match state {
        Some(record) => Simulation::resume(setup, record)?,
        None => Simulation::new(setup)?,
    };
    let longest = (PATIENCE * time_unit / spec.timestep) as u64;
    let kinetic = loop {
        for _ in 0..10 {
            simulation.advance(LOOK_EVERY)?;
            simulation.fix(|g| g.position.z < g.radius)?;
        }
        let kinetic = simulation.energy().kinetic() / scale;
        let landed = simulation.time() > 8.0 * time_unit;
        if landed && kinetic < AT_REST {
            break kinetic;
        }
        if simulation.steps_done() > longest {
            return Err(SetupError::Restless {
                measures: Box::new(simulation.rest_measures(spec.gravity)),
                asked: Rest {
                    kinetic: AT_REST,
                    unbalanced: f64::INFINITY,
                },
                patience: PATIENCE,
            });
        }
        // Kinetic energy falls by decades once the cloud has landed: its logarithm measures progress.
        let share = (1.0 - (kinetic / AT_REST).max(1.0).log10() / 9.0).clamp(0.0, 1.0);
        stopped(progress(share, &mut simulation))?;
    };
    let bed = collect(spec, &mut simulation, kinetic);
    let found = bed.report.grains as f64;
    let word = "as many as asked for: more than the floor can hold have stuck to it";
    check("grains.count, free ones over the base", found, word, |n| {
        n == spec.grains as f64
    })?;
    Ok(bed)
}

/// A lattice of grains without contacts, shaken a little; more than asked for, since some will stick.
fn loose_cloud(spec: &InclineBed, time_unit: f64) -> (Domain, Vec<Grain>) {
    let mut random = ChaCha8Rng::seed_from_u64(spec.seed);
    let diameter = 2.0 * spec.radius.mean();
    let spacing = 2.04 * spec.radius.largest();
    let columns = ((spec.length / spacing) as usize).max(1);
    let lanes = ((spec.width / spacing) as usize).max(1);
    let (dx, dy) = (spec.length / columns as f64, spec.width / lanes as f64);
    // A floor covered at random holds at most this many.
    let sticking = (spec.length * spec.width / (0.85 * diameter * diameter)).ceil() as usize;
    let total = spec.grains + sticking;
    let layers = total.div_ceil(columns * lanes);
    let domain = Domain {
        lower: Vector3::new(0.0, 0.0, -diameter),
        upper: Vector3::new(spec.length, spec.width, (layers + 1) as f64 * spacing),
        periodic: [true, true, false],
    };
    let speed = 0.7 * diameter / time_unit;
    let grains = (0..total)
        .map(|k| {
            let (layer, at) = (k / (columns * lanes), k % (columns * lanes));
            let mut jitter = |room: f64| room * (random.random::<f64>() - 0.5);
            let room = 0.02 * spacing;
            let position = Vector3::new(
                ((at % columns) as f64 + 0.5) * dx + jitter(room),
                ((at / columns) as f64 + 0.5) * dy + jitter(room),
                (layer as f64 + 0.5) * spacing + jitter(room),
            );
            let velocity = Vector3::from_fn(|_, _| 2.0 * speed * (random.random::<f64>() - 0.5));
            let radius = spec.radius.draw(&mut random);
            Grain {
                velocity,
                ..Grain::at_rest(position, radius, spec.density)
            }
        })
        .collect();
    (domain, grains)
}

/// Takes the surplus off the top and moves the tops of the base to z = 0.
fn collect(spec: &InclineBed, simulation: &mut Simulation, kinetic: f64) -> Bed {
    let mut snapshot = Snapshot::default();
    simulation.snapshot(&mut snapshot);
    let mut touches = vec![0_usize; snapshot.grains.len()];
    for contact in &snapshot.contacts {
        touches[contact.grain] += 1;
        if let crate::Partner::Grain(j) = contact.partner {
            touches[j] += 1;
        }
    }
    let mut order: Vec<usize> = (0..snapshot.grains.len()).collect();
    let height = |i: usize| snapshot.grains[i].position.z;
    order.sort_by(|&a, &b| height(a).total_cmp(&height(b)));
    let base: Vec<usize> = order
        .iter()
        .copied()
        .filter(|&i| snapshot.grains[i].fixed)
        .collect();
    let free: Vec<usize> = order
        .iter()
        .copied()
        .filter(|&i| !snapshot.grains[i].fixed)
        .take(spec.grains)
        .collect();
    let top = base.iter().map(|&i| height(i) + snapshot.grains[i].radius);
    let shift = top.sum::<f64>() / base.len().max(1) as f64;
    let grains: Vec<Grain> = base
        .iter()
        .chain(&free)
        .map(|&i| {
            let g = &snapshot.grains[i];
            let position = g.position - Vector3::z() * shift;
            Grain {
                fixed: g.fixed,
                ..Grain::at_rest(position, g.radius, spec.density)
            }
        })
        .collect();
    let volume = |i: usize| 4.0 / 3.0 * std::f64::consts::PI * snapshot.grains[i].radius.powi(3);
    let solid: f64 = free.iter().map(|&i| volume(i)).sum();
    let moment: f64 = free.iter().map(|&i| volume(i) * (height(i) - shift)).sum();
    // A layer of even packing has its centre at half its depth.
    let depth = 2.0 * moment / solid;
    let area = spec.length * spec.width;
    let touching: usize = free.iter().map(|&i| touches[i]).sum();
    let mut domain = *simulation.domain();
    domain.lower.z -= shift;
    domain.upper.z -= shift;
    Bed {
        domain,
        report: BedReport {
            grains: free.len(),
            base_grains: base.len(),
            depth,
            solid_fraction: solid / (area * depth),
            coordination: touching as f64 / free.len().max(1) as f64,
            kinetic_energy: kinetic,
            settling_time: simulation.time(),
            grain_steps: simulation.steps_done() * simulation.grain_count() as u64,
        },
        grains,
    }
}
