//! Running a scene: directory, checkpoints, results.

mod angle_of_repose;
pub mod bagnold;
pub mod ball_impact;
pub mod bed;
mod boulder;
pub mod channel;
pub mod chute;
pub mod cliff;
pub mod collapse;
pub mod collapse_ground;
mod column_land;
mod column_of_grains;
mod column_seen;
mod comet;
mod comet_block;
pub mod continuum_incline;
pub mod cylinder;
pub mod cylinder_ground;
mod cylinder_of_grains;
pub mod energy_table;
pub mod grain_table;
mod grains;
pub(crate) mod heap;
pub mod impact;
pub mod impact_scales;
pub mod incline;
pub mod joined_column;
pub mod joined_incline;
mod land;
mod march_record;
pub mod open_chute;
mod overlap_state;
pub mod precheck;
pub mod settle;
pub mod sheared;
mod silo;
pub mod silo_discharge;
pub mod steady_layer;
pub mod step;
mod step_table;
mod surface_fields;
mod surface_run;
pub mod surface_steps;
mod tensile;
mod tumbling_box;
pub mod world;

use crate::checkpoint::{Checkpoint, Checkpoints};
use crate::failure::{Failure, Resumes};
use crate::frames;
use crate::report;
use crate::results_file;
use crate::run_directory::{self, Replaces, RunDirectory};
use crate::scene::{InclineModel, Scene, SceneBody};
use crate::summary::{Status, Summary};
use crate::table::Table;
pub use angle_of_repose::PUBLISHED_ANGLES;
use colluvium_dem::{Record, Threads};
use std::cell::{Cell, RefCell};
use std::path::PathBuf;
use std::time::{Duration, Instant};

/// How a run is to be made.
#[derive(Clone, Debug, Default)]
pub struct RunOptions {
    /// Directory; none picks a free one under `results/`.
    pub out: Option<PathBuf>,
    /// Threads; none takes as many as the machine has cores.
    pub threads: Option<usize>,
    /// Goes on from the checkpoint in the directory.
    pub resume: bool,
    /// What may be replaced in the directory.
    pub replaces: Replaces,
    /// Wall time between two checkpoints; none for [`CHECKPOINT_EVERY`].
    pub checkpoint_every: Option<Duration>,
}

/// Wall time between two checkpoints, where nobody says another one.
pub const CHECKPOINT_EVERY: Duration = Duration::from_secs(20);
/// Times the wall time of writing a checkpoint that pass before the next one: writing takes at most a
/// twentieth of a run.
const WRITES_APART: u32 = 19;

/// What a finished run hands over.
#[derive(Debug)]
pub struct Findings {
    /// The summary, without cost and status.
    pub summary: Summary,
    /// Tables for CSV and HDF5.
    pub tables: Vec<Table>,
    /// The grains at the end: HDF5 only, they are many.
    pub grains: Option<Table>,
}

/// How a run that ended well left things.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Ended {
    /// The directory.
    pub directory: PathBuf,
    /// It was done before: nothing was computed now.
    pub already_done: bool,
    /// What the user has to know beyond the summary.
    pub warnings: Vec<String>,
}

/// A run under way: its directory, its clock and its checkpoints.
#[derive(Debug)]
pub struct Under<'a> {
    /// The scene.
    pub scene: &'a Scene,
    /// The directory.
    pub directory: &'a RunDirectory,
    /// State to go on from.
    pub resumed: Option<Checkpoint>,
    /// Threads.
    pub threads: usize,
    start: Instant,
    wall_before: f64,
    saving: RefCell<Saving>,
    given_pause: Option<Duration>,
    /// Whether the state is there and work may begin: until then a resumed run writes nothing.
    begun: Cell<bool>,
}

/// When checkpoints are written, and where.
#[derive(Debug)]
struct Saving {
    checkpoints: Checkpoints,
    last: Instant,
    /// Wall time from one checkpoint to the next.
    pause: Duration,
}

impl Under<'_> {
    /// Wall time, parts before a restart included (s).
    pub fn wall_s(&self) -> f64 {
        self.wall_before + self.start.elapsed().as_secs_f64()
    }

    /// How the steps of this run are shared out.
    pub fn threads_of_one_run(&self) -> Threads {
        if self.threads > 1 {
            Threads::Rayon
        } else {
            Threads::Serial
        }
    }

    /// Says that the start, or the state to go on from, was accepted: from here on the directory is
    /// this run's, and a failure is one of the run and not of the input.
    pub fn begin(&self) -> Result<(), Failure> {
        if self.begun.replace(true) {
            return Ok(());
        }
        if self.resumed.is_some() {
            self.directory.journal.note("resumed");
        }
        self.directory.mark_running()
    }

    /// Writes a checkpoint if one is due or the user asked to stop; the latter ends the run.
    ///
    /// `record` is only called when a checkpoint is written.
    pub fn checkpoint(&self, stage: &str, record: impl FnOnce() -> Record) -> Result<(), Failure> {
        let stop = crate::interruption::requested();
        let mut saving = self.saving.borrow_mut();
        if !stop && saving.last.elapsed() < saving.pause {
            return Ok(());
        }
        let begin = Instant::now();
        let checkpoint = Checkpoint {
            record: record(),
            stage: stage.to_owned(),
            wall_s: self.wall_s(),
        };
        saving.checkpoints.write(&self.scene.name, &checkpoint)?;
        saving.last = Instant::now();
        saving.pause = self
            .given_pause
            .unwrap_or_else(|| CHECKPOINT_EVERY.max(WRITES_APART * begin.elapsed()));
        self.directory
            .journal
            .note(&format!("checkpoint ({stage})"));
        drop(saving);
        if stop {
            Err(self.interrupted())
        } else {
            Ok(())
        }
    }

    /// The failure that says how to go on.
    pub fn interrupted(&self) -> Failure {
        Failure::Interrupted {
            directory: self.directory.path().to_owned(),
            resumes: Resumes::from_saved(
                self.saving.borrow().checkpoints.exist()
                    || world::kept_steps::exist(self.directory.path()),
            ),
        }
    }
}

/// Opens or makes the directory of a run; for one that goes on, also gives its summary.
///
/// Everything that can be checked without computing has to be checked before: an earlier run that
/// may be replaced is removed.
pub fn open_directory(
    scene: &Scene,
    options: &RunOptions,
    command: &'static str,
) -> Result<(RunDirectory, Option<Summary>), Failure> {
    if options.resume {
        let Some(out) = &options.out else {
            return Err(Failure::Input(
                "--resume: say which run with --out DIR; allowed: the directory of an interrupted run"
                    .into(),
            ));
        };
        let (directory, summary) = RunDirectory::reopen(out, scene, command)?;
        Ok((directory, Some(summary)))
    } else {
        let place = run_directory::place(options.out.as_deref(), &scene.name);
        let directory = RunDirectory::create(&place, scene, command, options.replaces)?;
        Ok((directory, None))
    }
}

/// What stands in a directory that is already done. A run that was killed after that was said, but
/// before its report was written and its checkpoints removed, is tidied up.
pub fn already_done(directory: &RunDirectory) -> Result<Ended, Failure> {
    directory.journal.note("already done: nothing to resume");
    if !directory.file(run_directory::REPORT).exists() {
        report::write(directory.path())?;
    }
    tidy(directory)?;
    Ok(Ended {
        directory: directory.path().to_owned(),
        already_done: true,
        warnings: Vec::new(),
    })
}

/// Removes what only a run under way needs.
fn tidy(directory: &RunDirectory) -> Result<(), Failure> {
    Checkpoints::of(directory.path()).remove()?;
    for (folder, removed) in [
        (
            world::kept_steps::FOLDER,
            world::kept_steps::remove(directory.path()),
        ),
        (frames::FOLDER, frames::remove(directory.path())),
    ] {
        removed.map_err(|error| {
            let folder = directory.file(folder);
            Failure::Run(format!("cannot remove {}: {error}", folder.display()))
        })?;
    }
    Ok(())
}

/// Threads that compute.
pub fn pool(threads: usize) -> Result<rayon::ThreadPool, Failure> {
    rayon::ThreadPoolBuilder::new()
        .num_threads(threads)
        .build()
        .map_err(|error| Failure::Run(format!("cannot start {threads} threads: {error}")))
}

/// Checks all that can be checked of a scene without computing.
pub fn check(scene: &Scene) -> Result<(), Failure> {
    match &scene.body {
        SceneBody::Incline(body) => precheck::incline(scene, body),
        SceneBody::Bagnold(body) => bagnold::check(scene, body),
        SceneBody::Sheared(body) => sheared::check(scene, body),
        SceneBody::Impact(body) => impact::check(scene, body),
        SceneBody::Chute(body) => chute::check(scene, body),
        SceneBody::Settle(body) => settle::check(scene, body),
        SceneBody::Grains(kind) => {
            kind.act(&scene.origin, |recipe| world::course::check(scene, recipe))
        }
        SceneBody::Collapse(body) => collapse::check(scene, body),
        SceneBody::Cylinder(body) => cylinder::check(scene, body),
        SceneBody::OpenChute(body) => open_chute::check(scene, body),
        SceneBody::SiloDischarge(body) => silo_discharge::check(scene, body),
    }
}

/// Runs a scene and writes its directory.
pub fn run(scene: &Scene, options: &RunOptions) -> Result<Ended, Failure> {
    crate::interruption::listen();
    check(scene)?;
    let threads = options.threads.unwrap_or_else(rayon::current_num_threads);
    let (directory, before) = open_directory(scene, options, "run")?;
    if before.is_some_and(|s| s.status == Status::Done) {
        return already_done(&directory);
    }
    let mut checkpoints = Checkpoints::of(directory.path());
    // A run that was stopped before its first checkpoint starts again.
    let found = match options.resume {
        true => checkpoints.read(&scene.name)?,
        false => None,
    };
    let (resumed, warning) = found.map_or((None, None), |(c, warning)| (Some(c), warning));
    let warnings = Vec::from_iter(warning);
    for warning in &warnings {
        directory.journal.note(warning);
    }
    directory
        .journal
        .note(&format!("run {} with {threads} threads", scene.name));
    let wall_before = resumed.as_ref().map_or(0.0, |c: &Checkpoint| c.wall_s);
    let mut under = Under {
        scene,
        directory: &directory,
        resumed,
        threads,
        start: Instant::now(),
        wall_before,
        saving: RefCell::new(Saving {
            checkpoints,
            last: Instant::now(),
            pause: options.checkpoint_every.unwrap_or(CHECKPOINT_EVERY),
        }),
        given_pause: options.checkpoint_every,
        begun: Cell::new(false),
    };
    let found = pool(threads).and_then(|pool| {
        pool.install(|| match &scene.body {
            SceneBody::Incline(body) => match body.model {
                InclineModel::Dem => incline::run(body, &mut under),
                InclineModel::Continuum => continuum_incline::run(body, &mut under),
                InclineModel::Hybrid => joined_incline::run(body, &mut under),
            },
            SceneBody::Bagnold(body) => bagnold::run(body, &mut under),
            SceneBody::Sheared(body) => sheared::run(body, &mut under),
            SceneBody::Impact(body) => impact::run(body, &mut under),
            SceneBody::Chute(body) => chute::run(body, &mut under),
            SceneBody::Settle(body) => settle::run(body, &mut under),
            SceneBody::Grains(kind) => kind.act(&scene.origin, |recipe| {
                world::course::run(recipe, &mut under)
            }),
            SceneBody::Collapse(body) => collapse::run(body, &mut under),
            SceneBody::Cylinder(body) => cylinder::run(body, &mut under),
            SceneBody::OpenChute(body) => open_chute::run(body, &mut under),
            SceneBody::SiloDischarge(body) => silo_discharge::run(body, &mut under),
        })
    });
    let (begun, wall_s, going_on) = (under.begun.get(), under.wall_s(), under.resumed.is_some());
    match found.and_then(|findings| finish(scene, &directory, findings)) {
        Ok(()) => Ok(Ended {
            directory: directory.path().to_owned(),
            already_done: false,
            warnings,
        }),
        Err(failure @ (Failure::Scene(_) | Failure::Input(_))) if !begun => {
            directory.abandon();
            Err(failure)
        }
        // The state to go on from was not touched, and the summary still tells of it.
        Err(failure) if !begun && going_on => Err(failure),
        Err(failure) => {
            let failure = failure.after_work();
            Err(directory.mark_ended(failure, wall_s))
        }
    }
}

/// Writes tables, results, summary and report of a finished run.
pub fn finish(scene: &Scene, directory: &RunDirectory, findings: Findings) -> Result<(), Failure> {
    let Findings {
        mut summary,
        tables,
        grains,
    } = findings;
    directory.write_tables(&tables.iter().collect::<Vec<_>>())?;
    let all: Vec<&Table> = tables.iter().chain(&grains).collect();
    results_file::write(&directory.file(run_directory::RESULTS), &scene.name, &all)?;
    summary.status = Status::Done;
    directory.write_summary(&summary)?;
    report::write(directory.path())?;
    tidy(directory)?;
    directory.journal.note("done");
    Ok(())
}
