//! Jammed packings of frictionless spheres in a periodic box: the densest random state and the start of
//! homogeneous tests.
//!
//! Random points are swollen at once beyond jamming, brought to rest, and the box is widened step by
//! step until contacts barely press (O'Hern et al. 2003). With ε the mean overlap over d̄ a step is
//!
//! ```text
//! φ → φ (1 - 3 c ε)        c = 0.7: a uniform swelling by ε takes 3 ε of φ
//! ```
//! Equal spheres end at φ_J = 0.64 with 6 contacts a grain without rattlers. Laws and stiffness play no
//! part: only the geometry is handed back.

use super::coordination::{Coordination, HELD_FRICTIONLESS};
use super::ingredients::Ingredient;
use super::insertion::insert_in_cube;
use super::packing::Packing;
use super::relaxation::time_unit;
use super::rest::RestMeasures;
use super::size_report::SizeReport;
use super::watch::{Look, Watch, stopped};
use crate::contact::{ContactLaw, Hooke, Tangential, TangentialSpring};
use crate::grains::Grain;
use crate::setup::{Setup, SetupError, Threads, check};
use crate::simulation::Simulation;
use crate::snapshot::Snapshot;
use nalgebra::Vector3;
use serde::{Deserialize, Serialize};
use std::fmt;

/// A jammed packing to be made.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Jamming {
    /// Grains in the box.
    pub grains: usize,
    /// What they are.
    pub ingredients: Vec<Ingredient>,
    /// Solid fraction that points are swollen to at first.
    pub quench: f64,
    /// Mean overlap at which it is done, over d̄.
    pub overlap: f64,
    /// Seed of all random numbers.
    pub seed: u64,
}

/// How it jammed.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct JammingReport {
    /// Volume of the grains over the box's.
    pub solid_fraction: f64,
    /// Contacts a grain has.
    pub coordination: Coordination,
    /// Mean overlap left, over d̄.
    pub overlap: f64,
    /// Boxes tried.
    pub boxes: u32,
    /// How close to rest it is, in units of the contacts' own forces.
    pub rest: RestMeasures,
    /// Sizes of each ingredient against its law.
    pub sizes: Vec<SizeReport>,
}

impl fmt::Display for JammingReport {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        write!(
            f,
            "jammed at a solid fraction of {:.4} (of the periodic box); {}; mean overlap {:.2e} d, {} boxes; {}",
            self.solid_fraction, self.coordination, self.overlap, self.boxes, self.rest
        )?;
        let mut sizes = self.sizes.iter().enumerate();
        sizes.try_for_each(|(k, sizes)| write!(f, "\ningredient {k}: {sizes}"))
    }
}

/// Share of the way back to jamming that a step takes.
const APPROACH: f64 = 0.7;
/// Boxes that are tried.
const BOXES: u32 = 200;
/// Steps between looks.
const LOOK_EVERY: u64 = 10;
/// Looks at one box.
const LOOKS: u32 = 20_000;
/// Unbalanced force at rest.
const UNBALANCED: f64 = 3e-3;

/// Makes a jammed packing in a cube.
pub fn jam(spec: &Jamming, watch: &mut dyn Watch) -> Result<(Packing, JammingReport), SetupError> {
    check("jamming.quench", spec.quench, "in [0.5, 0.9]", |v| {
        (0.5..=0.9).contains(&v)
    })?;
    check("jamming.overlap", spec.overlap, "in [1e-6, 0.05]", |v| {
        (1e-6..=0.05).contains(&v)
    })?;
    let (mut packing, sizes) = spec.cloud()?;
    let solid: f64 = packing.grains.iter().map(Grain::volume).sum();
    let fill = |packing: &mut Packing, fraction: f64| {
        let edge = (solid / fraction).cbrt();
        let factor = edge / packing.domain.lengths().x;
        packing.domain.upper = Vector3::repeat(edge);
        packing.grains.iter_mut().for_each(|g| g.position *= factor);
    };
    let (mut fraction, mut step) = (spec.quench, 0.02);
    for boxes in 1..=BOXES {
        fill(&mut packing, fraction);
        let rested = rest(&packing, spec.overlap, watch)?;
        packing = rested.packing;
        if rested.overlap > 0.0 && rested.overlap <= spec.overlap {
            let report = JammingReport {
                solid_fraction: fraction,
                coordination: rested.coordination,
                overlap: rested.overlap,
                boxes,
                rest: rested.measures,
                sizes,
            };
            return Ok((packing, report));
        }
        if rested.overlap > 0.0 {
            step = fraction * 3.0 * APPROACH * (rested.overlap - 0.3 * spec.overlap);
            fraction -= step;
        } else {
            // The box was too wide: half of the step back.
            step *= 0.5;
            fraction += step;
        }
    }
    Err(SetupError::Density {
        reached: fraction,
        asked: spec.quench,
        why: "no box was found in which the grains barely jam",
    })
}

/// Grains at rest in a box.
struct Rested {
    packing: Packing,
    /// Mean overlap over d̄; 0 where they do not carry each other.
    overlap: f64,
    coordination: Coordination,
    measures: RestMeasures,
}

/// Volume of the cubes around grains of the largest mean size, over that of the box, that any mixture of the ingredients can begin with.
const LOOSE: f64 = 0.3;

impl Jamming {
    /// A loose cloud in a cube.
    fn cloud(&self) -> Result<(Packing, Vec<SizeReport>), SetupError> {
        check("jamming.grains", self.grains as f64, "≥ 64", |n| {
            n >= 64.0
        })?;
        let (domain, grains, report) =
            insert_in_cube(&self.ingredients, self.grains, self.seed, LOOSE)?;
        let packing = Packing {
            domain,
            grains,
            contacts: Vec::new(),
            clumps: Vec::new(),
        };
        Ok((packing, report.sizes))
    }
}

/// Brings grains to rest in a box. Velocities are taken out whenever their energy begins to fall
/// (kinetic damping): it drops fast where forces push back.
fn rest(packing: &Packing, done: f64, watch: &mut dyn Watch) -> Result<Rested, SetupError> {
    let mut simulation = simulation(packing)?;
    let (mass, diameter) = {
        let n = packing.grains.len() as f64;
        let diameters: f64 = packing.grains.iter().map(|g| 2.0 * g.radius).sum();
        (packing.mass() / n, diameters / n)
    };
    // Energies in those of contacts at the overlap that counts as done.
    let acceleration = STIFFNESS * diameter * done / mass;
    let none = 1e-3 * done;
    let mut kinetic = 0.0;
    let mut measures = simulation.rest_measures(acceleration);
    for look in 0..LOOKS {
        simulation.advance(LOOK_EVERY)?;
        measures = simulation.rest_measures(acceleration);
        stopped(watch.look(&mut Look::passing(&measures)))?;
        if measures.kinetic < kinetic {
            simulation.damp(0.0);
            kinetic = 0.0;
        } else {
            kinetic = measures.kinetic;
        }
        if look % 5 > 0 {
            continue;
        }
        let mut snapshot = Snapshot::default();
        simulation.snapshot(&mut snapshot);
        let overlap = mean_overlap(&snapshot, diameter);
        // Carried by each other, or out of each other's way.
        let carried = measures.unbalanced < UNBALANCED && overlap > none;
        if carried || overlap <= none {
            let coordination = Coordination::of(&snapshot, HELD_FRICTIONLESS);
            return Ok(Rested {
                packing: Packing::of(&mut simulation),
                overlap: if carried && coordination.rattlers < 0.5 {
                    overlap
                } else {
                    0.0
                },
                coordination,
                measures,
            });
        }
    }
    Err(SetupError::Restless {
        measures: Box::new(measures),
        asked: super::rest::Rest {
            kinetic: f64::INFINITY,
            unbalanced: UNBALANCED,
        },
        patience: f64::from(LOOKS) * LOOK_EVERY as f64 * simulation.timestep()
            / time_unit(&simulation, acceleration),
    })
}

/// k_n (N/m); it scales time and force alone.
const STIFFNESS: f64 = 1.0;

fn simulation(packing: &Packing) -> Result<Simulation, SetupError> {
    let law = ContactLaw {
        tangential: Tangential::None,
        ..ContactLaw::linear(
            Hooke::matched(STIFFNESS, 0.5),
            TangentialSpring::matched(0.0, 1.0, 0.0),
            None,
        )
    };
    let smallest = packing
        .grains
        .iter()
        .map(Grain::mass)
        .fold(f64::INFINITY, f64::min);
    Simulation::new(Setup {
        domain: packing.domain,
        gravity: Vector3::zeros(),
        law: law.into(),
        grains: packing.grains.clone(),
        walls: Vec::new(),
        bodies: Vec::new(),
        timestep: 0.1 * (smallest / STIFFNESS).sqrt(),
        threads: Threads::Serial,
    })
}

/// Mean overlap of the contacts over the mean diameter.
fn mean_overlap(snapshot: &Snapshot, diameter: f64) -> f64 {
    let sum: f64 = snapshot.contacts.iter().map(|c| c.overlap).sum();
    sum / snapshot.contacts.len().max(1) as f64 / diameter
}
