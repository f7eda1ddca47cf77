//! Where packings are made: one step after the other, each with a note on what it achieved.
//!
//! A step takes the packing, puts it into a simulation with the law, the walls and the pull that it needs,
//! and takes it back. It has a time step of its own, from its own speeds.

mod clumps;
mod cutting;
mod report;
mod surroundings;

pub use surroundings::{Surroundings, open_space, softened, stand_ins, step_for, with_friction};

use super::kept_steps::{Keeper, Outcome, Step};
use crate::failure::Failure;
use crate::scene::world::Materials;
use crate::summary::Note;
use colluvium_dem::preparation::{
    Aggregate, Amount, CentralCompaction, Insertion, Jamming, Midway, Packing, Pouring, Relaxation,
    Stages, TRIES, Watch, compact, grow, insert_loose, jam, pour, relax, settle_in_stages,
};
use colluvium_dem::timestep::{Conditions, Shares};
use colluvium_dem::{BoxMotion, Edge, Grain, Laws, Region, Setup, SetupError, Simulation, Threads};
use nalgebra::Vector3;
use std::time::Instant;

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
    /// Steps that may take long, so far.
    steps: u64,
    keeper: &'a Keeper<'a>,
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
        keeper: &'a Keeper<'a>,
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
            steps: 0,
            keeper,
        }
    }

    /// Does a step that changes the packing and adds its notes and grain-steps, from where it was stopped if it was. What it came
    /// to is kept if it took long, and taken from there if the run was stopped later.
    pub fn step(
        &mut self,
        work: impl FnOnce(&mut Self, &mut Step) -> Result<(), Failure>,
    ) -> Result<(), Failure> {
        self.answering_step(|shop, step| work(shop, step).map(|()| true))
            .map(drop)
    }

    /// The same of a step that says whether it did what was asked for.
    fn answering_step(
        &mut self,
        work: impl FnOnce(&mut Self, &mut Step) -> Result<bool, Failure>,
    ) -> Result<bool, Failure> {
        let number = self.steps;
        self.steps += 1;
        if let Some(outcome) = self.keeper.outcome(number)? {
            self.packing = outcome.packing;
            self.notes.extend(outcome.notes);
            self.grain_steps += outcome.grain_steps;
            return Ok(outcome.answer);
        }
        let mut step = self.keeper.step(number);
        let (began, noted, paid) = (Instant::now(), self.notes.len(), self.grain_steps);
        let answer = work(self, &mut step)?;
        self.keeper.keep(&step, began, || Outcome {
            packing: self.packing.clone(),
            notes: self.notes[noted..].to_vec(),
            grain_steps: self.grain_steps - paid,
            answer,
        })?;
        Ok(answer)
    }

    /// Writes down what a step achieved.
    pub fn note(&mut self, step: &str, text: impl ToString) {
        let note = Note {
            step: step.to_owned(),
            text: text.to_string(),
        };
        let line = format!("{step}: {}", note.text.replace('\n', "; "));
        self.keeper.journal().note(&line);
        self.notes.push(note);
    }

    /// The packing among its surroundings, at rest or as it moves.
    pub fn simulation(&self, around: &Surroundings) -> Result<Simulation, Failure> {
        let mut simulation = Simulation::new(self.setup(around)?).map_err(refused)?;
        if !self.packing.clumps.is_empty() {
            simulation.clump(&self.packing.clumps).map_err(refused)?;
        }
        Ok(simulation)
    }

    /// The same for a step, as it was when it was stopped if it was.
    fn simulation_of(&self, around: &Surroundings, step: &Step) -> Result<Simulation, Failure> {
        match step.goes_on() {
            Some(midway) => Simulation::resume(self.setup(around)?, &midway.record)
                .map_err(|error| Failure::damaged(&error.to_string())),
            None => self.simulation(around),
        }
    }

    fn setup(&self, around: &Surroundings) -> Result<Setup, Failure> {
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
        Ok(setup)
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
        self.step(|shop, step| {
            let mut simulation = shop.simulation_of(around, step)?;
            let report = pour(&mut simulation, &spec, relaxation, step).map_err(ended)?;
            shop.take(simulation);
            shop.note("pour", report);
            Ok(())
        })
    }

    /// Lets everything come to rest.
    pub fn relax(&mut self, around: &Surroundings, spec: &Relaxation) -> Result<(), Failure> {
        self.step(|shop, step| {
            let mut simulation = shop.simulation_of(around, step)?;
            let rest = relax(&mut simulation, spec, step).map_err(ended)?;
            shop.take(simulation);
            shop.note("relax", rest);
            Ok(())
        })
    }

    /// Lets everything come to rest as far as it does in the time; says whether it does.
    pub fn relax_as_far(
        &mut self,
        around: &Surroundings,
        spec: &Relaxation,
    ) -> Result<bool, Failure> {
        self.answering_step(|shop, step| {
            let mut simulation = shop.simulation_of(around, step)?;
            let (rests, rest) = match relax(&mut simulation, spec, step) {
                Ok(rest) => (true, rest),
                Err(SetupError::Restless { measures, .. }) => (false, *measures),
                Err(error) => return Err(ended(error)),
            };
            shop.take(simulation);
            shop.note("relax", rest);
            Ok(rests)
        })
    }

    /// Lets the grains go for a time (s), and stops what still moves.
    pub fn let_go(&mut self, around: &Surroundings, time: f64) -> Result<(), Failure> {
        self.step(|shop, step| {
            let mut simulation = shop.simulation_of(around, step)?;
            let steps = (time / simulation.timestep()).ceil() as u64;
            advance_to(&mut simulation, steps, step)?;
            simulation.damp(0.0);
            shop.take(simulation);
            Ok(())
        })
    }

    /// Pulls a cloud to a point until it is dense enough.
    pub fn compact(
        &mut self,
        around: &Surroundings,
        spec: &CentralCompaction,
    ) -> Result<(), Failure> {
        self.step(|shop, step| {
            let mut simulation = shop.simulation_of(around, step)?;
            let report = compact(&mut simulation, spec, step).map_err(ended)?;
            shop.take(simulation);
            shop.note("compact", report);
            Ok(())
        })
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
        self.step(|shop, step| {
            let (mut simulation, reports) =
                settle_in_stages(setup, &shop.packing.clumps, stages, step).map_err(ended)?;
            let grains = simulation.grain_count() as u64;
            for report in reports {
                shop.grain_steps += report.steps * grains;
                shop.note("stage", report);
            }
            shop.packing = Packing::of(&mut simulation);
            Ok(())
        })
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
        self.step(|shop, step| {
            let (packing, report) = jam(&spec, step).map_err(ended)?;
            shop.packing = packing;
            shop.note("jam", report);
            Ok(())
        })
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
        self.step(|shop, step| {
            let mut simulation = shop.simulation_of(&around, step)?;
            if step.goes_on().is_none() {
                simulation
                    .set_box_motion(BoxMotion::Stretch {
                        edges: [edge(0), edge(1), edge(2)],
                        carry: true,
                    })
                    .map_err(refused)?;
            }
            // Loops are those of the rest that follows.
            if step.goes_on().is_none_or(|midway| midway.loops.is_empty()) {
                let steps = (spec.time / simulation.timestep()).ceil() as u64 + 1;
                advance_to(&mut simulation, steps, step)?;
                simulation
                    .set_box_motion(BoxMotion::Rest)
                    .map_err(refused)?;
            }
            let rest = relax(&mut simulation, relaxation, step).map_err(ended)?;
            shop.take(simulation);
            let reached = solid / shop.packing.domain.lengths().product();
            shop.note(
                "squeeze",
                format!(
                    "solid fraction {before:.4} to {reached:.4} ({:.4} asked for) in {:.3e} s by a box that shrinks about \
                     its centre; {rest}",
                    spec.solid_fraction, spec.time
                ),
            );
            Ok(())
        })
    }
}

/// Steps between two looks of a step that counts its steps.
const STEPS_PER_LOOK: u64 = 100;

/// Goes on until so many steps are done.
fn advance_to(simulation: &mut Simulation, steps: u64, step: &Step) -> Result<(), Failure> {
    while simulation.steps_done() < steps {
        simulation
            .advance(STEPS_PER_LOOK.min(steps - simulation.steps_done()))
            .map_err(|error| Failure::Run(format!("preparation: {error}")))?;
        step.progress(simulation.steps_done() as f64 / steps as f64);
        let state = || Midway {
            record: simulation.checkpoint(),
            loops: Vec::new(),
        };
        if step.pass(state).is_break() {
            return Err(ended(SetupError::Interrupted));
        }
    }
    Ok(())
}

fn refused(error: SetupError) -> Failure {
    Failure::Input(format!("preparation: {error}"))
}

/// What ends a preparation that had begun; why one was interrupted its keeper knows.
fn ended(error: SetupError) -> Failure {
    match error {
        SetupError::Record(why) => Failure::damaged(&why),
        error => Failure::Run(error.to_string()),
    }
}
