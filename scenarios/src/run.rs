//! Running a scene: directory, checkpoints, results.

pub mod bagnold;
pub mod impact;
pub mod incline;

use crate::checkpoint::{self, Checkpoint};
use crate::failure::Failure;
use crate::report;
use crate::results_file;
use crate::run_directory::{self, RunDirectory};
use crate::scene::{Scene, SceneBody};
use crate::summary::{Status, Summary};
use crate::table::Table;
use colluvium_dem::Record;
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
}

/// Wall time between two checkpoints.
const CHECKPOINT_EVERY: Duration = Duration::from_secs(20);

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
    last_checkpoint: Instant,
}

impl Under<'_> {
    /// Wall time, parts before a restart included (s).
    pub fn wall_s(&self) -> f64 {
        self.wall_before + self.start.elapsed().as_secs_f64()
    }

    /// Writes a checkpoint if one is due or the user asked to stop; the latter ends the run.
    ///
    /// `record` is only called when a checkpoint is written.
    pub fn checkpoint(
        &mut self,
        stage: &str,
        record: impl FnOnce() -> Record,
    ) -> Result<(), Failure> {
        let stop = crate::interruption::requested();
        if !stop && self.last_checkpoint.elapsed() < CHECKPOINT_EVERY {
            return Ok(());
        }
        let checkpoint = Checkpoint {
            record: record(),
            stage: stage.to_owned(),
            wall_s: self.wall_s(),
        };
        let path = self.directory.file(run_directory::CHECKPOINT);
        checkpoint::write(&path, &self.scene.name, &checkpoint)?;
        self.last_checkpoint = Instant::now();
        self.directory
            .journal
            .note(&format!("checkpoint ({stage})"));
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
        }
    }
}

/// Opens or makes the directory of a run.
pub fn open_directory(scene: &Scene, options: &RunOptions) -> Result<RunDirectory, Failure> {
    if options.resume {
        let Some(out) = &options.out else {
            return Err(Failure::Input(
                "--resume: say which run with --out DIR; allowed: the directory of an interrupted run"
                    .into(),
            ));
        };
        RunDirectory::reopen(out, scene)
    } else {
        RunDirectory::create(
            &run_directory::place(options.out.as_deref(), &scene.name),
            scene,
        )
    }
}

/// Runs a scene and writes its directory; gives the directory's path.
pub fn run(scene: &Scene, options: &RunOptions) -> Result<PathBuf, Failure> {
    crate::interruption::listen();
    let threads = options.threads.unwrap_or_else(rayon::current_num_threads);
    let directory = open_directory(scene, options)?;
    let summary_of_before = directory.file(run_directory::SUMMARY);
    if options.resume && report::is_done(&summary_of_before) {
        directory.journal.note("already done: nothing to resume");
        return Ok(directory.path().to_owned());
    }
    let mut resumed = None;
    let path = directory.file(run_directory::CHECKPOINT);
    // A run that was stopped before its first checkpoint starts again.
    if options.resume && path.exists() {
        resumed = Some(checkpoint::read(&path, &scene.name)?);
    }
    let mut summary = Summary::begun(&scene.name, "run");
    directory.write_summary(&summary)?;
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
        last_checkpoint: Instant::now(),
    };
    let pool = rayon::ThreadPoolBuilder::new()
        .num_threads(threads)
        .build()
        .map_err(|error| Failure::Run(format!("cannot start {threads} threads: {error}")))?;
    let found = pool.install(|| match &scene.body {
        SceneBody::Incline(body) => incline::run(body, &mut under),
        SceneBody::Bagnold(body) => bagnold::run(body, &mut under),
        SceneBody::Impact(body) => impact::run(body, &mut under),
    });
    match found.and_then(|findings| finish(scene, &directory, findings)) {
        Ok(()) => Ok(directory.path().to_owned()),
        Err(failure @ (Failure::Scene(_) | Failure::Input(_))) => {
            directory.abandon();
            Err(failure)
        }
        Err(failure) => {
            let interrupted = matches!(failure, Failure::Interrupted { .. });
            summary.status = if interrupted {
                Status::Interrupted
            } else {
                Status::Failed
            };
            summary.remarks.push(failure.to_string());
            directory.journal.note(&failure.to_string());
            directory.write_summary(&summary)?;
            Err(failure)
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
    for table in &tables {
        directory.write_table(table)?;
    }
    let all: Vec<&Table> = tables.iter().chain(&grains).collect();
    results_file::write(&directory.file(run_directory::RESULTS), &scene.name, &all)?;
    summary.status = Status::Done;
    directory.write_summary(&summary)?;
    report::write(directory.path())?;
    let left = directory.file(run_directory::CHECKPOINT);
    if left.exists() {
        std::fs::remove_file(&left)
            .map_err(|error| Failure::Run(format!("cannot remove {}: {error}", left.display())))?;
    }
    directory.journal.note("done");
    Ok(())
}
