//! Where packings are made: one step after the other, each with a note on what it achieved.
//!
//! A step takes the packing, puts it into a simulation with the law, the walls and the pull that it needs,
//! and takes it back. It has a time step of its own, from its own speeds.

mod clumps;
mod report;

use super::fragments;
use crate::failure::Failure;
use crate::journal::Journal;
use crate::scene::world::Materials;
use crate::summary::Note;
use colluvium_dem::preparation::{
    Aggregate, Amount, CentralCompaction, Insertion, Jamming, Packing, Pouring, Relaxation,
    RestMeasures, Stages, TRIES, compact, grow, insert_loose, jam, pour, relax, settle_in_stages,
};
use colluvium_dem::timestep::{Conditions, Shares};
use colluvium_dem::{
    BoxMotion, Domain, Edge, Grain, Laws, Mindlin, Normal, Region, Setup, SetupError, Simulation,
    Tangential, TangentialSpring, Threads, Wall,
};
use nalgebra::{UnitQuaternion, Vector3};
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

/// What surrounds a packing during a step.
#[derive(Clone, Debug)]
pub struct Surroundings {
    /// Contact laws of this step.
    pub laws: Laws,
    /// Walls.
    pub walls: Vec<Wall>,
    /// Uniform acceleration (m/s²).
    pub gravity: Vector3<f64>,
    /// Largest speed of two surfaces against each other (m/s).
    pub speed: f64,
}

impl Surroundings {
    /// Nothing but the law.
    pub fn none(laws: Laws) -> Surroundings {
        Surroundings {
            laws,
            walls: Vec::new(),
            gravity: Vector3::zeros(),
            speed: 0.0,
        }
    }
}

/// The laws with another friction.
pub fn with_friction(laws: &Laws, friction: f64) -> Laws {
    let mut laws = laws.clone();
    let pairs = laws.pairs.iter_mut().map(|(_, _, law)| law);
    for law in laws.own.iter_mut().chain(pairs) {
        law.tangential = match law.tangential {
            Tangential::Linear(spring) => {
                Tangential::Linear(TangentialSpring { friction, ..spring })
            }
            Tangential::Mindlin(mindlin) => Tangential::Mindlin(Mindlin {
                friction,
                ..mindlin
            }),
            other => other,
        };
    }
    laws
}

/// The laws of Hooke and Hertz at a multiple of their stiffness; others as they are.
pub fn softened(laws: &Laws, factor: f64) -> Laws {
    let mut laws = laws.clone();
    let pairs = laws.pairs.iter_mut().map(|(_, _, law)| law);
    for law in laws.own.iter_mut().chain(pairs) {
        match &mut law.normal {
            Normal::Hooke(hooke) => hooke.stiffness *= factor,
            Normal::Hertz(hertz) => hertz.effective_modulus *= factor,
            _ => continue,
        }
        if let Tangential::Mindlin(mindlin) = &mut law.tangential {
            mindlin.effective_shear *= factor;
        }
    }
    laws
}

/// The step (s) of a preparation of such grains in such surroundings, where anything limits it.
pub fn step_for(materials: &Materials, around: &Surroundings, safety: f64) -> Option<f64> {
    let grains = stand_ins(materials);
    let fall = Conditions::of(&grains, &around.gravity);
    let conditions = Conditions {
        speed: fall.speed + around.speed,
        ..fall
    };
    let shares = Shares {
        safety,
        ..Shares::default()
    };
    let setup = Setup {
        domain: open_space(),
        gravity: around.gravity,
        law: around.laws.clone(),
        grains,
        walls: around.walls.clone(),
        bodies: Vec::new(),
        timestep: 1.0,
        threads: Threads::Serial,
    };
    let choice = setup.choose_step(&conditions, &shares).ok()?;
    choice.seconds.is_finite().then_some(choice.seconds)
}

/// How a periodic box is shrunk, or widened, about its centre.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Squeeze {
    /// Solid fraction wanted.
    pub solid_fraction: f64,
    /// Time that it takes (s).
    pub time: f64,
}

/// Open space: a box that holds nothing in.
pub fn open_space() -> Domain {
    Domain {
        lower: Vector3::repeat(-1.0),
        upper: Vector3::repeat(1.0),
        periodic: [false; 3],
    }
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

    /// Takes away what does not hang together, by contacts, with the heaviest piece; says how many grains.
    pub fn keep_heaviest(&mut self) -> usize {
        let grains = &self.packing.grains;
        let masses: Vec<f64> = grains.iter().map(Grain::mass).collect();
        let mut stays = vec![false; grains.len()];
        let pieces = fragments::joined(&masses, &self.packing.contacts);
        let heaviest = pieces.first().map_or(&[][..], |piece| &piece.grains);
        heaviest.iter().for_each(|&grain| stays[grain] = true);
        let gone = self.packing.keep_those(stays);
        self.note(
            "trim",
            format!("{gone} grains taken away that did not hang on"),
        );
        gone
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

    /// Keeps grains in a region: whole ones, or those whose centres lie in it.
    pub fn trim(&mut self, region: &Region, whole: bool) -> Result<(), Failure> {
        let gone = if whole {
            self.packing.trim_whole(region)
        } else {
            self.packing.trim(region)
        };
        let gone = gone.map_err(refused)?;
        let left = self.packing.grains.len();
        self.note(
            "trim",
            format!("{gone} grains taken away, {left} left, in {region}"),
        );
        self.check_left()
    }

    /// Keeps grains of which a rule says so; what it says in words is noted.
    pub fn keep_where(
        &mut self,
        words: &str,
        rule: impl Fn(&Grain) -> bool,
    ) -> Result<(), Failure> {
        let stays = self.packing.grains.iter().map(rule).collect();
        let gone = self.packing.keep_those(stays);
        let left = self.packing.grains.len();
        self.note(
            "trim",
            format!("{gone} grains taken away, {left} left, in {words}"),
        );
        self.check_left()
    }

    fn check_left(&self) -> Result<(), Failure> {
        if self.packing.grains.is_empty() {
            return Err(Failure::Run("preparation: no grains are left".into()));
        }
        Ok(())
    }

    /// Fixes grains in a region.
    pub fn glue(&mut self, region: &Region) -> Result<(), Failure> {
        let count = self.packing.glue(region).map_err(refused)?;
        self.note("glue", format!("{count} grains fixed in {region}"));
        Ok(())
    }

    /// Multiplies all lengths.
    pub fn scale(&mut self, factor: f64) -> Result<(), Failure> {
        self.packing.scale(factor).map_err(refused)?;
        self.note("scale", format!("all lengths times {factor}"));
        Ok(())
    }

    /// Turns the packing about the origin and moves it.
    pub fn place(&mut self, turn: UnitQuaternion<f64>, by: Vector3<f64>) -> Result<(), Failure> {
        self.packing
            .place(Vector3::zeros(), turn, by)
            .map_err(refused)
    }

    /// Opens all axes of the box.
    pub fn open(&mut self) {
        self.packing.domain.periodic = [false; 3];
    }
}

/// The smallest and the largest grain of each kind, at the origin.
pub fn stand_ins(materials: &Materials) -> Vec<Grain> {
    let both = materials.ingredients.iter().flat_map(|i| {
        [i.sizes.smallest(), i.sizes.largest()].map(|radius| Grain {
            material: i.material,
            ..Grain::at_rest(Vector3::zeros(), radius, i.density)
        })
    });
    both.collect()
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
