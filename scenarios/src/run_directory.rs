//! The directory of a run: where it lies, what may be overwritten, how files are put in place.

mod hold;
mod inputs;

pub use hold::abandon_all;
pub use inputs::checksums_of;

use crate::failure::Failure;
use crate::journal::Journal;
use crate::report;
use crate::results_file::put_in_place;
use crate::run::world::kept_steps;
use crate::scene::Scene;
use crate::summary::{Status, Summary};
use crate::table::Table;
use hold::{Hold, LOCK};
use inputs::INPUTS;
use std::fs;
use std::io::Write;
use std::path::{Path, PathBuf};

/// Name of the resolved scene in a run directory.
pub const SCENE: &str = "scene.toml";
/// Name of the summary; one of ours marks the directory as a run.
pub const SUMMARY: &str = "summary.json";
/// Name of the report.
pub const REPORT: &str = "report.html";
/// Name of the results.
pub const RESULTS: &str = "results.h5";
/// The units of the columns of all CSV tables.
pub const UNITS: &str = "units.csv";
/// Name of the last checkpoint.
pub const CHECKPOINT: &str = "checkpoint.h5";
/// Name of the one before.
pub const CHECKPOINT_BEFORE: &str = "checkpoint_before.h5";
/// Name of the packing that a run starts from.
pub const PACKING: &str = "packing.h5";
/// Name of the packings in steady shear that a run takes grains from.
pub const SHEARED: &str = "sheared.h5";
/// Name of the log.
pub const LOG: &str = "log.txt";
/// Name of the finished runs of a campaign that may be stopped and resumed.
pub const ANGLES: &str = "angles.json";
/// The run in motion.
pub const ANIMATION: &str = "animation.gif";

/// Every file that a run, a campaign or a comparison writes.
const OWN_FILES: [&str; 57] = [
    UNITS,
    ANIMATION,
    SCENE,
    INPUTS,
    LOCK,
    REPORT,
    RESULTS,
    CHECKPOINT,
    CHECKPOINT_BEFORE,
    PACKING,
    SHEARED,
    LOG,
    "grains.vtkhdf",
    "contacts.vtkhdf",
    "fields.vtkhdf",
    "continuum.vtkhdf",
    "bodies.vtkhdf",
    "clumps.vtkhdf",
    "fields.csv",
    "posterior.csv",
    "profile.csv",
    "energy.csv",
    "trajectory.csv",
    "history.csv",
    "avalanches.csv",
    "ball.csv",
    "rates.csv",
    "points.csv",
    "stress.csv",
    "angles.csv",
    "estimators.csv",
    "continuum.csv",
    "pareto.csv",
    "steps.csv",
    "front.csv",
    "deposit.csv",
    "discharge.csv",
    "profiles.csv",
    "flowing.csv",
    "balance.csv",
    "speeds.csv",
    "map.csv",
    "beside.csv",
    "moves.csv",
    "zones.csv",
    "sides.csv",
    "ends.csv",
    "fronts.csv",
    "boulders.csv",
    "fragments.csv",
    "free_form.csv",
    "instalments.csv",
    "samples.csv",
    "stop_curve.csv",
    "rheology.toml",
    "campaign.json",
    ANGLES,
];

/// A run directory that has been created.
#[derive(Debug)]
pub struct RunDirectory {
    path: PathBuf,
    command: &'static str,
    scene: String,
    /// The outermost folder that was made for this run, for [`RunDirectory::abandon`].
    made: Option<PathBuf>,
    /// The log.
    pub journal: Journal,
    /// Keeps other processes out.
    _hold: Hold,
}

/// What a new run may replace besides a finished one.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Replaces {
    /// A run that could be gone on with is kept.
    #[default]
    Finished,
    /// Any run.
    Any,
}

/// Where a run will be written: `--out`, or the first free `results/<scene>-<n>`.
pub fn place(out: Option<&Path>, scene: &str) -> PathBuf {
    match out {
        Some(path) => path.to_owned(),
        None => (1..)
            .map(|n| Path::new("results").join(format!("{scene}-{n}")))
            .find(|path| !path.exists())
            .unwrap_or_else(|| PathBuf::from("results")),
    }
}

/// Whether a directory was written by this program: it holds a summary of ours. A `scene.toml`
/// alone is the user's own input.
pub fn is_run(path: &Path) -> bool {
    let text = fs::read_to_string(path.join(SUMMARY)).unwrap_or_default();
    let summary = serde_json::from_str::<serde_json::Value>(&text).unwrap_or_default();
    summary["format"].is_u64() && summary["command"].is_string() && summary["scene"].is_string()
}

impl RunDirectory {
    /// Makes the directory and puts summary, resolved scene and log in it.
    ///
    /// A finished run of ours that stands there is replaced, one that could be gone on with only if that was asked for;
    /// any other folder with files in it is refused, and so is one that holds what the scene was read from, or in which
    /// another process writes.
    pub fn create(
        path: &Path,
        scene: &Scene,
        command: &'static str,
        may: Replaces,
    ) -> Result<RunDirectory, Failure> {
        refuse_foreign(path)?;
        refuse_own_input(path, scene)?;
        let made = outermost_missing(path);
        let unwritable = |error: std::io::Error| {
            if let Some(made) = &made {
                // Only folders that this call made, and only while they are empty of others' files.
                let _ = fs::remove_dir_all(made);
            }
            Failure::Input(format!(
                "--out {}: cannot write there: {error}; allowed: a folder that can be written",
                path.display()
            ))
        };
        let inputs = inputs::checksums(scene)?;
        fs::create_dir_all(path).map_err(unwritable)?;
        let hold = Hold::take(path)?;
        if may == Replaces::Finished {
            refuse_unfinished(path)?;
        }
        let replaces = is_run(path);
        // The summary first: whatever happens from here on, the folder is known as a run.
        let begun = summary_text(&Summary::begun(&scene.name, command))?;
        write_in_place(&path.join(SUMMARY), begun.as_bytes()).map_err(unwritable)?;
        if replaces {
            remove_old_run(path).map_err(unwritable)?;
        }
        if let Some(text) = inputs {
            write_in_place(&path.join(INPUTS), text.as_bytes()).map_err(unwritable)?;
        }
        write_in_place(&path.join(SCENE), scene.to_toml()?.as_bytes()).map_err(unwritable)?;
        let journal = Journal::open(&path.join(LOG), false).map_err(unwritable)?;
        Ok(RunDirectory {
            path: path.to_owned(),
            command,
            scene: scene.name.clone(),
            made,
            journal,
            _hold: hold,
        })
    }

    /// Opens the directory of a run that is to go on; its command and scene have to be the same.
    /// Also gives the summary that stands there.
    pub fn reopen(
        path: &Path,
        scene: &Scene,
        command: &'static str,
    ) -> Result<(RunDirectory, Summary), Failure> {
        let shown = path.display();
        let read = || {
            report::read_summary(path).map_err(|error| Failure::Input(format!("--resume: {error}")))
        };
        // Only a run has something to hold, and what it says counts once it is held.
        read()?;
        let hold = Hold::take(path)?;
        let summary = read()?;
        if summary.command != command {
            return Err(Failure::Input(format!(
                "--resume: {shown} was written by `{}`, not by `{command}`; allowed: the directory of an interrupted `{command}`",
                summary.command
            )));
        }
        let begun = [SCENE, CHECKPOINT, CHECKPOINT_BEFORE]
            .iter()
            .any(|name| path.join(name).exists());
        if summary.status == Status::Running && !begun {
            // Killed while its folder was made: there is nothing to go on from.
            drop(hold);
            let directory = RunDirectory::create(path, scene, command, Replaces::Finished)?;
            return Ok((directory, summary));
        }
        let text = fs::read_to_string(path.join(SCENE)).map_err(|error| {
            Failure::Input(format!(
                "--resume: {shown} holds no run to go on with: {SCENE}: {error}; allowed: --out with the directory of an interrupted run"
            ))
        })?;
        let old = Scene::from_text(&text, &path.join(SCENE).display().to_string())?;
        if old.resolved != scene.resolved {
            let keys = differing_keys(&old.resolved, &scene.resolved, "");
            return Err(Failure::Input(format!(
                "--resume: {shown} holds a run of another scene; differing: {}; give the same scene and settings",
                keys.join(", ")
            )));
        }
        if summary.status != Status::Done {
            inputs::refuse_others(path, scene)?;
        }
        let journal = Journal::open(&path.join(LOG), true).map_err(|error| {
            Failure::Input(format!("--out {shown}: cannot write there: {error}"))
        })?;
        let directory = RunDirectory {
            path: path.to_owned(),
            command,
            scene: scene.name.clone(),
            made: None,
            journal,
            _hold: hold,
        };
        Ok((directory, summary))
    }

    /// Takes back a directory that was made for input that turned out to be bad.
    pub fn abandon(self) {
        if let Some(made) = self.made {
            let _ = fs::remove_dir_all(made);
        }
    }

    /// The path.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// The path of a file in it.
    pub fn file(&self, name: &str) -> PathBuf {
        self.path.join(name)
    }

    /// Writes a file whole: readers see the old one or the new one, never a part.
    pub fn write(&self, name: &str, content: &[u8]) -> Result<(), Failure> {
        let path = self.file(name);
        write_in_place(&path, content)
            .map_err(|error| Failure::Run(format!("cannot write {}: {error}", path.display())))
    }

    /// Writes tables as CSV, and the units of their columns.
    pub fn write_tables(&self, tables: &[&Table]) -> Result<(), Failure> {
        for table in tables {
            self.write(&format!("{}.csv", table.name), table.to_csv().as_bytes())?;
        }
        self.write(UNITS, Table::units(tables).as_bytes())
    }

    /// Writes the summary.
    pub fn write_summary(&self, summary: &Summary) -> Result<(), Failure> {
        self.write(SUMMARY, summary_text(summary)?.as_bytes())
    }

    /// Says in the summary that the work is under way.
    pub fn mark_running(&self) -> Result<(), Failure> {
        self.write_summary(&Summary::begun(&self.scene, self.command))
    }

    /// Says in summary and log how the work ended when it did not end well, and gives that back. What
    /// it has written stays, and so does what it cost so far.
    ///
    /// Where the summary cannot be written either, as on a full disk, it still says that the run is
    /// under way; that can be gone on with, too.
    pub fn mark_ended(&self, failure: Failure, wall_s: f64) -> Failure {
        let mut summary = Summary::begun(&self.scene, self.command);
        summary.status = match &failure {
            Failure::Interrupted { .. } => Status::Interrupted,
            _ => Status::Failed,
        };
        summary.cost.wall_s = wall_s;
        summary.remarks.push(failure.to_string());
        self.journal.note(&failure.to_string());
        match (self.write_summary(&summary), failure) {
            (Err(also), Failure::Run(message)) => Failure::Run(format!("{message}; {also}")),
            (_, failure) => failure,
        }
    }
}

/// A value as TOML.
pub fn toml_text(what: &str, value: &impl serde::Serialize) -> Result<String, Failure> {
    toml::to_string_pretty(value).map_err(|error| unwritten(what, error))
}

/// A value as a table of keys.
pub fn toml_table(what: &str, value: &impl serde::Serialize) -> Result<toml::Table, Failure> {
    toml::Table::try_from(value).map_err(|error| unwritten(what, error))
}

/// What could not be written, and why.
pub fn unwritten(what: &str, error: toml::ser::Error) -> Failure {
    Failure::Run(format!("{what} cannot be written as TOML: {error}"))
}

/// The text of `summary.json`.
pub fn summary_text(summary: &Summary) -> Result<String, Failure> {
    let text = serde_json::to_string_pretty(summary)
        .map_err(|error| Failure::Run(format!("summary: {error}")))?;
    Ok(format!("{text}\n"))
}

/// Writes under a temporary name in the same folder, flushes and renames.
pub fn write_in_place(path: &Path, content: &[u8]) -> std::io::Result<()> {
    let mut name = path.file_name().unwrap_or_default().to_owned();
    name.push(".partial");
    let partial = path.with_file_name(name);
    let written = fs::File::create(&partial).and_then(|mut file| file.write_all(content));
    match written.and_then(|()| put_in_place(&partial, path)) {
        Ok(()) => Ok(()),
        Err(error) => {
            let _ = fs::remove_file(&partial);
            Err(error)
        }
    }
}

fn refuse_foreign(path: &Path) -> Result<(), Failure> {
    let shown = path.display();
    if path.exists() && !path.is_dir() {
        return Err(Failure::Input(format!(
            "--out {shown}: is a file; allowed: a new, an empty or an earlier run's directory"
        )));
    }
    // What is left of a run that was killed while it wrote its very first files is nobody's.
    let first = [LOCK, &format!("{SUMMARY}.partial")];
    let others = |entry: fs::DirEntry| !first.iter().any(|name| entry.file_name() == **name);
    let occupied = fs::read_dir(path).is_ok_and(|entries| entries.flatten().any(others));
    if occupied && !is_run(path) {
        return Err(Failure::Input(format!(
            "--out {shown}: is not empty and not a run directory; allowed: a new, an empty or an earlier run's directory"
        )));
    }
    Ok(())
}

/// What a run can be gone on from, in the order in which it is named.
const SAVED: [&str; 3] = [CHECKPOINT, CHECKPOINT_BEFORE, ANGLES];

/// Hours of work must not be lost for a forgotten `--resume`.
fn refuse_unfinished(path: &Path) -> Result<(), Failure> {
    let Ok(text) = fs::read_to_string(path.join(SUMMARY)) else {
        return Ok(());
    };
    let summary = serde_json::from_str::<serde_json::Value>(&text).unwrap_or_default();
    let mut saved = SAVED.into_iter().filter(|name| path.join(name).exists());
    let steps = kept_steps::exist(path).then_some(kept_steps::FOLDER);
    let saved = saved.next().or(steps);
    match saved {
        Some(saved) if summary["status"] != "done" => Err(Failure::Input(format!(
            "--out {}: holds a run of `{}` that is not finished and can be gone on with ({saved}); allowed: --resume to go on with it (if this version wrote it), --overwrite of `run` and `calibrate` to give it up, or another directory",
            path.display(),
            summary["scene"].as_str().unwrap_or("another scene"),
        ))),
        _ => Ok(()),
    }
}

/// A run directory is emptied before a new run: what the scene is read from must not be in it.
fn refuse_own_input(path: &Path, scene: &Scene) -> Result<(), Failure> {
    let Ok(place) = path.canonicalize() else {
        return Ok(());
    };
    for input in &scene.inputs {
        if input.canonicalize().is_ok_and(|i| i.starts_with(&place)) {
            return Err(Failure::Input(format!(
                "--out {}: holds {}, which this scene is read from and a new run would replace; allowed: another directory, or --resume",
                path.display(),
                input.display()
            )));
        }
    }
    Ok(())
}

fn outermost_missing(path: &Path) -> Option<PathBuf> {
    path.ancestors()
        .take_while(|p| !p.as_os_str().is_empty() && !p.exists())
        .last()
        .map(Path::to_owned)
}

/// Removes what an earlier run wrote, so that old tables do not pass for new ones. Files of other
/// names stay.
fn remove_old_run(path: &Path) -> std::io::Result<()> {
    // First what tells of a run that can be gone on with and is not found by its scene.
    kept_steps::remove(path)?;
    let numbered = |name: &String| {
        (name.starts_with("profile_") && name.ends_with(".csv"))
            || (name.starts_with("fields_species_") && name.ends_with(".csv"))
            || (name.starts_with("view_") && name.ends_with(".png"))
            || (name.starts_with("wall_") && name.ends_with(".vtu"))
    };
    let numbered: Vec<String> = fs::read_dir(path)?
        .filter_map(|entry| entry.ok()?.file_name().into_string().ok())
        .filter(numbered)
        .collect();
    // The lock is held.
    for name in OWN_FILES
        .into_iter()
        .filter(|name| *name != LOCK)
        .chain(numbered.iter().map(String::as_str))
    {
        match fs::remove_file(path.join(name)) {
            Err(error) if error.kind() != std::io::ErrorKind::NotFound => return Err(error),
            _ => {}
        }
    }
    crate::render::remove(path)?;
    crate::frames::remove(path)
}

/// Dotted paths of keys that two tables do not agree on.
pub fn differing_keys(a: &toml::Table, b: &toml::Table, path: &str) -> Vec<String> {
    let names: std::collections::BTreeSet<&String> = a.keys().chain(b.keys()).collect();
    let mut keys = Vec::new();
    for name in names {
        let dotted = if path.is_empty() {
            name.clone()
        } else {
            format!("{path}.{name}")
        };
        match (a.get(name), b.get(name)) {
            (Some(toml::Value::Table(x)), Some(toml::Value::Table(y))) => {
                keys.extend(differing_keys(x, y, &dotted));
            }
            (x, y) if x != y => keys.push(dotted),
            _ => {}
        }
    }
    keys
}
