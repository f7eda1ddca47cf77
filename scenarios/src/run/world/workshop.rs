//! Where packings are made: one step after the other, each with a note on what it achieved.
//!
//! A step takes the packing, puts it into a simulation with the law, the walls and the pull that it needs,
//! and takes it back. It has a time step of its own, from its own speeds.

mod clumps;
mod cutting;
mod report;
mod surroundings;

pub use surroundings::{Surroundings, open_space, softened, stand_ins, step_for, with_friction};

use crate::failure::Failure;
use crate::journal::Journal;
use crate::scene::world::Materials;
use crate::summary::Note;
use colluvium_dem::preparation::{
    Aggregate, Amount, CentralCompaction, Insertion, Jamming, Packing, Pouring, Relaxation,
    RestMeasures, Stages, TRIES, compact, grow, insert_loose, jam, pour, relax, settle_in_stages,
};
use colluvium_dem::timestep::{Conditions, Shares};
use colluvium_dem::{BoxMotion, Edge, Grain, Laws, Region, Setup, SetupError, Simulation, Threads};
use nalgebra::Vector3;
use std::ops::ControlFlow;

/// A packing in the making.
pub struct Workshop<'a> {
    /// The packing so far.
    pub packing: Packing,
    /// What was done, and how it went.
    pub notes: Vec<Note>,
    /// Steps times grains so far.
    pub grain_steps: u64,
    /// What grains are made of.
    pub materials: &'a Materials,
    /// Seed of all random numbers.
    pub seed: u64,
    /// Step over that which the limits allow.
    pub safety: f64,
    /// How steps are shared out.
    pub threads: Threads,
    /// Grains that are still to come and must find a step that does for them, too: those of a clump.
    coming: Vec<Grain>,
    journal: Option<&'a Journal>,
    watch: &'a mut dyn FnMut(&RestMeasures) -> ControlFlow<()>,
}

/// How a periodic box is shrunk, or widened, about its centre.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Squeeze {
    /// Solid fraction wanted.
    pub solid_fraction: f64,
    /// Time that it takes (s).
    pub time: f64,
}

impl<'a> Workshop<'a> {
    /// An empty workshop.
    pub fn new(
        materials: &'a Materials,
        (seed, safety): (u64, f64),
        threads: Threads,
        watch: &'a mut dyn FnMut(&RestMeasures) -> ControlFlow<()>,
    ) -> Workshop<'a> {
        Workshop {
            packing: Packing {
                domain: open_space(),
                grains: Vec::new(),
                contacts: Vec::new(),
                clumps: Vec::new(),
            },
            coming: Vec::new(),
            notes: Vec::new(),
            grain_steps: 0,
            materials,
            seed,
            safety,
            threads,
            journal: None,
            watch,
        }
    }

    /// Notes go into a journal as they come.
    pub fn tell(mut self, journal: &'a Journal) -> Workshop<'a> {
        self.journal = Some(journal);
        self
    }

    /// Writes down what a step achieved.
    pub fn note(&mut self, step: &str, text: impl ToString) {
        let note = Note {
            step: step.to_owned(),
            text: text.to_string(),
        };
        if let Some(journal) = self.journal {
            journal.note(&format!("{step}: {}", note.text.replace('\n', "; ")));
        }
        self.notes.push(note);
    }

    /// The packing among its surroundings, at rest or as it moves.
    pub fn simulation(&self, around: &Surroundings) -> Result<Simulation, Failure> {
        let mut setup = Setup {
            domain: self.packing.domain,
            gravity: around.gravity,
            law: around.laws.clone(),
            grains: self.packing.grains.clone(),
            walls: around.walls.clone(),
            bodies: Vec::new(),
            timestep: 1.0,
            threads: self.threads,
        };
        let mut all = self.stand_ins();
        all.extend(&self.coming);
        all.extend(&setup.grains);
        let fall = Conditions::of(&all, &around.gravity);
        let conditions = Conditions {
            speed: fall.speed + around.speed,
            ..fall
        };
        let shares = Shares {
            safety: self.safety,
            ..Shares::default()
        };
        let trial = Setup {
            grains: all,
            ..setup.clone()
        };
        setup.timestep = trial
            .choose_step(&conditions, &shares)
            .map_err(refused)?
            .seconds;
        let mut simulation = Simulation::new(setup).map_err(refused)?;
        if !self.packing.clumps.is_empty() {
            simulation.clump(&self.packing.clumps).map_err(refused)?;
        }
        Ok(simulation)
    }

    /// The smallest and the largest grain of each kind, at the origin: what limits are taken from where
    /// grains are still to come.
    pub fn stand_ins(&self) -> Vec<Grain> {
        stand_ins(self.materials)
    }

    fn take(&mut self, mut simulation: Simulation) {
        self.grain_steps += simulation.steps_done() * simulation.grain_count() as u64;
        self.packing = Packing::of(&mut simulation);
    }

    /// Inserts loose grains among those that are there.
    pub fn insert(
        &mut self,
        region: Region,
        amount: Amount,
        velocity: Vector3<f64>,
    ) -> Result<(), Failure> {
        let spec = Insertion {
            region,
            domain: self.packing.domain,
            ingredients: self.materials.ingredients.clone(),
            amount,
            gap: 0.0,
            velocity,
            tries: TRIES,
            seed: self.seed,
        };
        let (grains, report) = insert_loose(&spec, &self.packing.grains).map_err(refused)?;
        self.packing.grains.extend(grains);
        self.note("insert", report);
        Ok(())
    }

    /// Puts grains where they are told to be.
    pub fn put(&mut self, grains: Vec<Grain>) {
        self.note("put", format!("{} grains at given places", grains.len()));
        self.packing.grains.extend(grains);
    }

    /// Pours grains from a source until they rest.
    pub fn pour(
        &mut self,
        around: &Surroundings,
        (source, amount): (Region, Amount),
        (velocity, interval): (Vector3<f64>, Option<f64>),
        relaxation: &Relaxation,
    ) -> Result<(), Failure> {
        let spec = Pouring {
            source,
            ingredients: self.materials.ingredients.clone(),
            amount,
            velocity,
            interval,
            fill: colluvium_dem::preparation::FILL,
            seed: self.seed,
        };
        let mut simulation = self.simulation(around)?;
        let report = pour(&mut simulation, &spec, relaxation, self.watch).map_err(ended)?;
        self.take(simulation);
        self.note("pour", report);
        Ok(())
    }

    /// Lets everything come to rest.
    pub fn relax(&mut self, around: &Surroundings, spec: &Relaxation) -> Result<(), Failure> {
        let mut simulation = self.simulation(around)?;
        let rest = relax(&mut simulation, spec, self.watch).map_err(ended)?;
        self.take(simulation);
        self.note("relax", rest);
        Ok(())
    }

    /// Lets everything come to rest as far as it does in the time; says whether it does.
    pub fn relax_as_far(
        &mut self,
        around: &Surroundings,
        spec: &Relaxation,
    ) -> Result<bool, Failure> {
        let mut simulation = self.simulation(around)?;
        let (rests, rest) = match relax(&mut simulation, spec, self.watch) {
            Ok(rest) => (true, rest),
            Err(SetupError::Restless { measures, .. }) => (false, *measures),
            Err(error) => return Err(ended(error)),
        };
        self.take(simulation);
        self.note("relax", rest);
        Ok(rests)
    }

    /// Lets the grains go for a time (s), and stops what still moves.
    pub fn let_go(&mut self, around: &Surroundings, time: f64) -> Result<(), Failure> {
        let mut simulation = self.simulation(around)?;
        let steps = (time / simulation.timestep()).ceil() as u64;
        simulation
            .advance(steps)
            .map_err(|error| Failure::Run(format!("preparation: {error}")))?;
        simulation.damp(0.0);
        self.take(simulation);
        if crate::interruption::requested() {
            return Err(ended(SetupError::Interrupted));
        }
        Ok(())
    }

    /// Pulls a cloud to a point until it is dense enough.
    pub fn compact(
        &mut self,
        around: &Surroundings,
        spec: &CentralCompaction,
    ) -> Result<(), Failure> {
        let mut simulation = self.simulation(around)?;
        let report = compact(&mut simulation, spec, self.watch).map_err(ended)?;
        self.take(simulation);
        self.note("compact", report);
        Ok(())
    }

    /// Lets everything come to rest under one gravity after the other.
    pub fn stages(&mut self, around: &Surroundings, stages: &Stages) -> Result<(), Failure> {
        let setup = Setup {
            domain: self.packing.domain,
            gravity: around.gravity,
            law: around.laws.clone(),
            grains: self.packing.grains.clone(),
            walls: around.walls.clone(),
            bodies: Vec::new(),
            timestep: 1.0,
            threads: self.threads,
        };
        let (mut simulation, reports) =
            settle_in_stages(setup, &self.packing.clumps, stages, self.watch).map_err(ended)?;
        let grains = simulation.grain_count() as u64;
        for report in reports {
            self.grain_steps += report.steps * grains;
            self.note("stage", report);
        }
        self.packing = Packing::of(&mut simulation);
        Ok(())
    }

    /// Makes a jammed packing in a periodic cube.
    pub fn jam(&mut self, grains: usize) -> Result<(), Failure> {
        let spec = Jamming {
            grains,
            ingredients: self.materials.ingredients.clone(),
            quench: 0.68,
            overlap: 1e-4,
            seed: self.seed,
        };
        let (packing, report) = jam(&spec, self.watch).map_err(ended)?;
        self.packing = packing;
        self.note("jam", report);
        Ok(())
    }

    /// Grows a ballistic aggregate about the origin, of the first kind of grains.
    pub fn grow(&mut self, spec: &Aggregate) -> Result<(), Failure> {
        let (packing, report) = grow(spec).map_err(refused)?;
        self.packing = packing;
        self.note("grow", report);
        Ok(())
    }

    /// Shrinks a periodic box about its centre while its grains are carried along, then lets them rest.
    pub fn squeeze(
        &mut self,
        laws: &Laws,
        spec: &Squeeze,
        relaxation: &Relaxation,
    ) -> Result<(), Failure> {
        let lengths = self.packing.domain.lengths();
        let solid: f64 = self.packing.grains.iter().map(Grain::volume).sum();
        let before = solid / lengths.product();
        let factor = (before / spec.solid_fraction).cbrt();
        let edge =
            |k: usize| Edge::Lengths(vec![(0.0, lengths[k]), (spec.time, factor * lengths[k])]);
        let around = Surroundings {
            // Opposite faces come closer by that much in the time.
            speed: 2.0 * (1.0 - factor).abs() * lengths.max() / spec.time,
            ..Surroundings::none(laws.clone())
        };
        let mut simulation = self.simulation(&around)?;
        simulation
            .set_box_motion(BoxMotion::Stretch {
                edges: [edge(0), edge(1), edge(2)],
                carry: true,
            })
            .map_err(refused)?;
        let steps = (spec.time / simulation.timestep()).ceil() as u64 + 1;
        let look = (steps / 200).max(1);
        while simulation.steps_done() < steps {
            simulation
                .advance(look.min(steps - simulation.steps_done()))
                .map_err(|error| Failure::Run(format!("preparation: {error}")))?;
            if (self.watch)(&simulation.rest_measures(relaxation.acceleration)).is_break() {
                return Err(ended(SetupError::Interrupted));
            }
        }
        simulation
            .set_box_motion(BoxMotion::Rest)
            .map_err(refused)?;
        let rest = relax(&mut simulation, relaxation, self.watch).map_err(ended)?;
        self.take(simulation);
        let reached = solid / self.packing.domain.lengths().product();
        self.note(
            "squeeze",
            format!(
                "solid fraction {before:.4} to {reached:.4} ({:.4} asked for) in {:.3e} s by a box that shrinks about \
                 its centre; {rest}",
                spec.solid_fraction, spec.time
            ),
        );
        Ok(())
    }
}

fn refused(error: SetupError) -> Failure {
    Failure::Input(format!("preparation: {error}"))
}

/// What ends a preparation that had begun.
fn ended(error: SetupError) -> Failure {
    match error {
        SetupError::Interrupted => Failure::Run(INTERRUPTED.into()),
        error => Failure::Run(error.to_string()),
    }
}

/// The message by which the caller knows that the user stopped a preparation.
pub const INTERRUPTED: &str = "preparation was interrupted";
