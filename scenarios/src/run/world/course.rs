//! A run from its packing to its end.

use super::build::Stand;
use super::history::History;
use super::kept_steps::{self, Keeper};
use super::live_averages::LiveAverages;
use super::packing_file::{self, Stored};
use super::pictures::Pictures;
use super::recipe::{Course, Recipe};
use super::store;
use super::workshop::{Workshop, stand_ins};
use crate::cost::Cost;
use crate::failure::Failure;
use crate::frames::Frames;
use crate::mesh_files::{self, Surface};
use crate::progress::Bar;
use crate::render::render_own;
use crate::run::{Findings, Under, bed, grain_table, step};
use crate::run_directory;
use crate::scene::Scene;
use crate::scene::world::{Materials, Place};
use crate::summary::{Model, Quantity, Summary};
use crate::table::Table;
use colluvium_dem::preparation::{Coordination, HELD_BY_FRICTION, Packing};
use colluvium_dem::{Record, SetupError, Shape, Simulation, Snapshot, Threads};
use std::time::Instant;

/// Steps between two looks at the clock.
const STEPS_PER_LOOK: u64 = 100;

/// Grains whose attraction by all others is summed directly at the end, as a check of the tree.
const TREE_CHECKED: usize = 2000;

/// Name of the recipe's memory in a checkpoint.
const STATE: &str = "recipe/state";

/// A run that has come to its end.
#[derive(Debug)]
pub struct Ran {
    /// The packing that it began with.
    pub packing: Packing,
    /// What it was made from.
    pub stand: Stand,
    /// The state at the end.
    pub simulation: Simulation,
    /// Grains, contacts and bonds at the end.
    pub seen: Snapshot,
    /// Rows of `history.csv`.
    pub history: Table,
    /// The recipe's memory.
    pub state: Vec<f64>,
}

/// Checks a scene before anything is written: keys, files, laws, walls, bonds and the step, on the smallest
/// and the largest grain of each kind.
pub fn check(scene: &Scene, recipe: &dyn Recipe) -> Result<(), Failure> {
    recipe.check()?;
    let origin = &scene.origin;
    let materials = recipe.materials(origin)?;
    let found = store::find(recipe, &materials, origin)?;
    if found.is_none() {
        recipe.check_room(&materials, origin)?;
    }
    let packing = found.map_or_else(|| trial(&materials), |stored| stored.packing);
    let stand = Stand::new(recipe, &packing, &materials, Threads::Serial, origin)?;
    // Lengths and cells depend on the grains, which are not there yet; keys do not.
    if let Some(average) = &recipe.keys().output.average {
        average.choice(Place {
            origin,
            section: "output.average",
        })?;
    }
    let trial = stand.start();
    trial
        .map(drop)
        .map_err(|error| Failure::Input(format!("{origin}: {error}")))
}

/// The smallest and the largest grain of each kind, far enough from each other.
pub fn trial(materials: &Materials) -> Packing {
    let mut grains = stand_ins(materials);
    let mut at = 0.0;
    for grain in &mut grains {
        at += 2.0 * grain.radius;
        grain.position.x = at;
        at += 2.0 * grain.radius;
    }
    Packing {
        domain: super::workshop::open_space(),
        grains,
        contacts: Vec::new(),
        clumps: Vec::new(),
    }
}

/// The packing of a run: of this run before it was stopped, stored, or made now.
fn packing(
    recipe: &dyn Recipe,
    materials: &Materials,
    under: &mut Under,
) -> Result<(Stored, bool), Failure> {
    let own = under.directory.file(run_directory::PACKING);
    if own.exists() {
        // Killed before the run itself was saved.
        kept_steps::forget_midway(under);
        let stored = packing_file::read(&own).map_err(|why| {
            Failure::Input(format!(
                "--resume: {} cannot be used: {why}; nothing was changed",
                own.display()
            ))
        })?;
        return Ok((stored, true));
    }
    // What another run has kept meanwhile is the same; this one goes on with its own.
    let own_part = kept_steps::midway(under).is_some() || kept_steps::exist(under.directory.path());
    let found = match own_part {
        true => None,
        false => store::find(recipe, materials, &under.scene.origin)?,
    };
    if let Some(mut stored) = found {
        under.begin()?;
        // The run that made it has paid for it.
        stored.grain_steps = 0;
        under.directory.journal.note("starts from a stored packing");
        packing_file::write(&own, &under.scene.name, &stored)?;
        return Ok((stored, false));
    }
    let stored = make(recipe, materials, under)?;
    under.begin()?;
    kept_steps::forget_midway(under);
    packing_file::write(&own, &under.scene.name, &stored)?;
    if let Err(error) = kept_steps::remove(under.directory.path()) {
        let note = format!("finished steps of the preparation are still there: {error}");
        under.directory.journal.note(&note);
    }
    if let Some(path) = store::keep(recipe, &under.scene.name, &stored)? {
        let kept = format!("packing kept as {}", path.display());
        under.directory.journal.note(&kept);
    }
    Ok((stored, false))
}

fn make(recipe: &dyn Recipe, materials: &Materials, under: &Under) -> Result<Stored, Failure> {
    let provenance = store::provenance(recipe)?.unwrap_or_default();
    let keeper = Keeper::new(under, (provenance.clone(), &materials.names))?;
    let keys = (recipe.keys().seed, recipe.keys().step.preparation);
    let threads = under.threads_of_one_run();
    let mut shop = Workshop::new(materials, keys, threads, &keeper);
    let made = recipe.prepare(&mut shop, &under.scene.origin);
    if made.is_ok() {
        shop.compare_sizes();
    }
    let (packing, notes, grain_steps) = (shop.packing, shop.notes, shop.grain_steps);
    keeper.end(made)?;
    Ok(Stored {
        packing,
        materials: materials.names.clone(),
        provenance,
        notes,
        grain_steps,
    })
}

/// Runs a scene of grains.
pub fn run(recipe: &dyn Recipe, under: &mut Under) -> Result<Findings, Failure> {
    let origin = under.scene.origin.clone();
    let materials = recipe.materials(&origin)?;
    let (stored, again) = packing(recipe, &materials, under)?;
    let threads = under.threads_of_one_run();
    let stand = Stand::new(recipe, &stored.packing, &materials, threads, &origin)?;
    let refused = |error: SetupError| Failure::Input(format!("{origin}: {error}"));
    let mut history = History::new(&stand, recipe);
    let mut averages = LiveAverages::new(recipe, &stand, &origin)?;
    let mut state = Vec::new();
    let mut simulation = match &under.resumed {
        Some(saved) => {
            let damaged = |why: String| Failure::damaged(&why);
            history.restore(&saved.record).map_err(damaged)?;
            if let Some(averages) = &mut averages {
                averages.restore(&saved.record).map_err(damaged)?;
            }
            state = saved.record.numbers(STATE).map_err(damaged)?.to_vec();
            stand.resume(&saved.record).map_err(refused)?
        }
        None => {
            let mut simulation = stand.start().map_err(refused)?;
            if !stand.world.bodies.is_empty() {
                stand.check_room(&mut simulation, &origin)?;
            }
            if recipe.keys().output.ledger {
                simulation.open_energy_ledger();
            }
            simulation
        }
    };
    if again {
        under.begin()?;
    }
    // Once there is a stock an interruption waits for the first checkpoint.
    if let Err(why) = recipe.stock(&materials, stand.setup.timestep, under.directory) {
        return Err(match crate::interruption::requested() {
            true => under.interrupted(),
            false => why,
        });
    }
    let clock = Instant::now();
    let bodies = stand.world.bodies.clone();
    let pictures = Pictures::new(recipe, &materials, &bodies, under.directory);
    follow(
        Followed {
            recipe,
            stand: &stand,
            simulation: &mut simulation,
            history: &mut history,
            state: &mut state,
            averages: averages.as_mut(),
            pictures: &pictures,
        },
        under,
    )?;
    let mut seen = Snapshot::default();
    simulation.snapshot(&mut seen);
    let mut ran = Ran {
        packing: stored.packing.clone(),
        stand,
        simulation,
        seen,
        history: history.table(),
        state,
    };
    let seconds = clock.elapsed().as_secs_f64();
    let note = format!("{} steps in {seconds:.1} s", ran.simulation.steps_done());
    under.directory.journal.note(&note);
    let fields = match &averages {
        Some(averages) => averages.conclude(under.directory.path())?,
        None => Vec::new(),
    };
    let mut found = findings(recipe, (&stored, &mut ran), &pictures, under)?;
    let frames = recipe.keys().output.frames as usize;
    render_own(under.directory.path(), frames, &mut found.summary)?;
    found.tables.extend(fields);
    Ok(found)
}

/// What a run takes along from step to step.
struct Followed<'a> {
    recipe: &'a dyn Recipe,
    stand: &'a Stand,
    simulation: &'a mut Simulation,
    history: &'a mut History,
    state: &'a mut Vec<f64>,
    averages: Option<&'a mut LiveAverages>,
    pictures: &'a Pictures<'a>,
}

/// Writes walls of triangles as they stand at the start beside the frames, for ParaView: `wall_NAME.vtu`.
fn write_walls(stand: &Stand, under: &Under) -> Result<(), Failure> {
    for (name, wall) in &stand.world.walls {
        let Shape::Mesh(mesh) = &wall.shape else {
            continue;
        };
        let pose = &wall.pose;
        let vertices = mesh.vertices().iter();
        let surface = Surface {
            vertices: vertices.map(|v| pose.position + pose.outward(v)).collect(),
            triangles: mesh.corners().to_vec(),
        };
        let path = under.directory.file(&format!("wall_{name}.vtu"));
        mesh_files::write_surface(&path, &surface)
            .map_err(|error| Failure::Run(error.to_string()))?;
    }
    Ok(())
}

/// Follows the simulation to its end.
fn follow(run: Followed, under: &mut Under) -> Result<(), Failure> {
    let Followed {
        recipe,
        stand,
        simulation,
        history,
        state,
        mut averages,
        pictures,
    } = run;
    let steps = stand.steps;
    let row_every = (steps / recipe.keys().output.rows).max(1);
    let bar = Bar::new(&under.scene.name);
    let mut seen = Snapshot::default();
    let world = &stand.world;
    let frames = Frames::new(under.directory.path(), steps, recipe.keys().output.frames)
        .with_rigid(!world.bodies.is_empty(), !world.clumps.is_empty())
        .with_continuum(recipe.has_continuum());
    // Both sides of an instant, the grains last: who looks for a frame looks for theirs.
    let take = |simulation: &mut Simulation, seen: &mut Snapshot, state: &[f64]| {
        let step = simulation.steps_done();
        if frames.is_due(step)
            && let Some(frame) = recipe.continuum(simulation, state)
        {
            frames.take_continuum(step, frame)?;
        }
        frames.take(simulation, seen)
    };
    let mut course = Course::On;
    if simulation.steps_done() == 0 {
        if recipe.keys().output.frames > 0 {
            write_walls(stand, under)?;
        }
        course = recipe.steer(simulation, state)?;
        history.look(recipe, simulation, &mut seen, state);
        take(simulation, &mut seen, state)?;
        if let Some(averages) = &mut averages {
            averages.take(simulation, &mut seen)?;
        }
        let behind = recipe.continuum(simulation, state);
        pictures.take(simulation, behind.as_ref(), 0, steps)?;
    }
    while simulation.steps_done() < steps && course == Course::On {
        let done = simulation.steps_done();
        let after = |every: u64| (done / every).saturating_add(1).saturating_mul(every);
        let steered = recipe.next_steer(done, stand.setup.timestep, state);
        let mut next = after(row_every).min(steered).min(steps);
        next = next.min(done + STEPS_PER_LOOK);
        next = frames.next(done).map_or(next, |frame| frame.min(next));
        next = next.min(pictures.next(done, steps));
        if let Some(look) = averages.as_ref().and_then(|a| a.next(done)) {
            next = next.min(look);
        }
        simulation
            .advance(next - done)
            .map_err(|error| Failure::Run(error.to_string()))?;
        if next == steered {
            course = recipe.steer(simulation, state)?;
        }
        if next.is_multiple_of(row_every) || next == steps || course == Course::Over {
            history.look(recipe, simulation, &mut seen, state);
        }
        take(simulation, &mut seen, state)?;
        if let Some(averages) = &mut averages {
            averages.take(simulation, &mut seen)?;
        }
        if pictures.is_due(next, steps) {
            let behind = recipe.continuum(simulation, state);
            pictures.take(simulation, behind.as_ref(), next, steps)?;
        }
        bar.set(next as f64 / steps as f64);
        if course == Course::On {
            under.checkpoint("steps", || {
                recipe.keep(state);
                saved(simulation, history, averages.as_deref(), state)
            })?;
        }
    }
    bar.clear();
    recipe.keep(state);
    let done = simulation.steps_done();
    let groups = recipe.groups(simulation, state);
    let behind = recipe.continuum(simulation, state);
    pictures.last(simulation, done, groups.as_deref(), behind.as_ref())?;
    frames.join(done)
}

fn saved(
    simulation: &mut Simulation,
    history: &History,
    averages: Option<&LiveAverages>,
    state: &[f64],
) -> Record {
    let mut record = simulation.checkpoint();
    history.save(&mut record);
    if let Some(averages) = averages {
        averages.save(&mut record);
    }
    record.numbers.insert(STATE.into(), state.to_vec());
    record
}

fn findings(
    recipe: &dyn Recipe,
    (stored, ran): (&Stored, &mut Ran),
    pictures: &Pictures,
    under: &Under,
) -> Result<Findings, Failure> {
    let mut summary = Summary::begun(&under.scene.name, "run");
    let grains = (ran.packing.grains.len() + ran.stand.world.grains.len()) as u64;
    let (taken, choice) = (ran.stand.setup.timestep, &ran.stand.choice);
    summary.model = Model {
        grains,
        cells: 0,
        dt_s: taken,
        dt_limit: match recipe.keys().step.seconds {
            Some(_) => step::given(taken, choice),
            None => step::chosen(choice),
        },
        left_out: left_out(recipe, &ran.stand),
    };
    let steps = ran.simulation.steps_done() * grains + stored.grain_steps;
    summary.cost = Cost::measured(under.wall_s(), under.threads, steps, 0);
    summary.state_hash = ran.simulation.state_hash();
    summary.ledger.momentum_relative = Some(ran.simulation.momentum_error());
    let energy = ran.simulation.energy();
    for (name, value) in [
        ("translation_J", energy.translation),
        ("rotation_J", energy.rotation),
        ("elastic_J", energy.elastic()),
    ] {
        summary.ledger.energy.insert(name.into(), value);
    }
    let coordination = Coordination::of(&ran.seen, HELD_BY_FRICTION);
    summary.put(
        "coordination",
        Quantity::new(coordination.all, "1").from("contacts of a free grain at the end"),
    );
    summary.put(
        "largest_overlap",
        Quantity::new(ran.simulation.largest_overlap(), "R"),
    );
    let bonds = ran.simulation.bond_count();
    if bonds.whole + bonds.torn + bonds.sheared + bonds.cut > 0 {
        summary.put(
            "bonds",
            Quantity::new(bonds.whole as f64, "1").from("whole at the end"),
        );
        summary.put(
            "broken_bond_share",
            Quantity::new(bonds.broken_share(), "1").from("of the bonds at the start"),
        );
    }
    if let Some(error) = ran.simulation.self_gravity_error(TREE_CHECKED) {
        let own = ran.stand.world.own_gravity.map_or(0.0, |own| own.opening);
        let source = format!(
            "tree of opening {own} against the direct sum at the end, over at most {TREE_CHECKED} grains, of the rms acceleration"
        );
        summary.put(
            "self_gravity_rms_error",
            Quantity::new(error.rms, "1").from(&source),
        );
        summary.put(
            "self_gravity_largest_error",
            Quantity::new(error.largest, "1").from(&source),
        );
    }
    summary.preparation.clone_from(&stored.notes);
    let mut tables = vec![ran.history.clone()];
    tables.extend(recipe.conclude(ran, &mut summary)?);
    summary.figures.extend(pictures.figures());
    Ok(Findings {
        summary,
        tables,
        grains: Some(grain_table::of(&ran.seen)),
    })
}

/// What the scene leaves out: its own, and what its law and its world do not have.
pub fn left_out(recipe: &dyn Recipe, stand: &Stand) -> Vec<String> {
    let mut own = bed::left_out(recipe.keys().contact.parts(), &recipe.left_out());
    if stand.world.bonds.is_empty() {
        own.push("bonds".into());
    }
    own
}
