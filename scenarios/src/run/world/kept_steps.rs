//! What a preparation keeps in the directory of its run, so that it goes on where it was stopped.
//!
//! A preparation is done anew from its beginning, which gives the same bits, but for two things: steps that took
//! long are taken from the packings that they came to (`preparation/step_N.h5`), and the step that was under way
//! goes on from the checkpoint.

use super::packing_file::{self, Stored};
use crate::checkpoint::Checkpoint;
use crate::failure::Failure;
use crate::journal::Journal;
use crate::progress::Bar;
use crate::run::Under;
use colluvium_dem::preparation::{Look, Midway, Watch};
use std::cell::RefCell;
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

/// Folder of what finished steps came to.
pub const FOLDER: &str = "preparation";
/// Stage of a checkpoint within a preparation.
const STAGE: &str = "preparation";
/// Array of such a checkpoint: the step's number, then the counts of its loops.
const LOOPS: &str = "preparation/loops";
/// Steps that took less are done again rather than kept.
const LONG: Duration = Duration::from_secs(2);

/// Takes the state of a preparation out of a run that goes on; what is left is that of the run itself.
pub fn take_midway(under: &mut Under) -> Option<Checkpoint> {
    under.resumed.take_if(|saved| saved.stage == STAGE)
}

/// Whether steps are kept in a run directory.
pub fn exist(directory: &Path) -> bool {
    directory.join(FOLDER).is_dir()
}

/// Removes them; files of other names stay.
pub fn remove(directory: &Path) -> std::io::Result<()> {
    let folder = directory.join(FOLDER);
    if !folder.is_dir() {
        return Ok(());
    }
    for entry in std::fs::read_dir(&folder)? {
        let entry = entry?;
        let own = |name: &str| name.starts_with("step_");
        if entry.file_name().to_str().is_some_and(own) {
            std::fs::remove_file(entry.path())?;
        }
    }
    // Not empty if there is anything else in it.
    let _ = std::fs::remove_dir(&folder);
    Ok(())
}

/// Watches a preparation and keeps what it has come to.
#[derive(Debug)]
pub struct Keeper<'a> {
    under: &'a Under<'a>,
    materials: &'a [String],
    bar: Bar,
    /// The step that goes on, and from where.
    midway: RefCell<Option<(u64, Midway)>>,
    /// Why the preparation was stopped.
    failure: RefCell<Option<Failure>>,
}

impl<'a> Keeper<'a> {
    /// A keeper of a run's preparation, which goes on from a checkpoint if it is given one.
    ///
    /// # Errors
    /// If the checkpoint has no step.
    pub fn new(
        under: &'a Under<'a>,
        materials: &'a [String],
        saved: Option<Checkpoint>,
    ) -> Result<Keeper<'a>, Failure> {
        let midway = saved.map(|mut saved| {
            let mut counts = saved.record.counts.remove(LOOPS).unwrap_or_default();
            if counts.is_empty() {
                let why = "--resume: the checkpoint is damaged: its preparation has no step";
                return Err(Failure::Input(why.into()));
            }
            let loops = counts.split_off(1);
            let record = saved.record;
            Ok((counts[0], Midway { record, loops }))
        });
        Ok(Keeper {
            under,
            materials,
            bar: Bar::new("preparation"),
            midway: RefCell::new(midway.transpose()?),
            failure: RefCell::default(),
        })
    }

    /// The log of the run.
    pub fn journal(&self) -> &'a Journal {
        &self.under.directory.journal
    }

    /// Ends the watch; the error is what stopped the preparation.
    pub fn end(self) -> Result<(), Failure> {
        self.bar.clear();
        self.failure.into_inner().map_or(Ok(()), Err)
    }

    fn path(&self, step: u64) -> PathBuf {
        let folder = self.under.directory.file(FOLDER);
        folder.join(format!("step_{step}.h5"))
    }

    /// What a step came to before the run was stopped, if that was kept.
    pub fn outcome(&self, step: u64) -> Result<Option<Stored>, Failure> {
        let path = self.path(step);
        if !path.exists() {
            return Ok(None);
        }
        let stored = packing_file::read(&path).map_err(|why| {
            let shown = path.display();
            Failure::Run(format!(
                "{shown} cannot be used: {why}; without it the step is done again"
            ))
        })?;
        self.journal()
            .note(&format!("preparation: step {step} was done before"));
        Ok(Some(stored))
    }

    /// Keeps what a step came to, which began at an instant, if it took long.
    pub fn keep(
        &self,
        step: u64,
        began: Instant,
        outcome: impl FnOnce() -> Stored,
    ) -> Result<(), Failure> {
        let long = self.under.given_pause.map_or(LONG, |pause| LONG.min(pause));
        if began.elapsed() < long {
            return Ok(());
        }
        let folder = self.under.directory.file(FOLDER);
        std::fs::create_dir_all(&folder).map_err(|error| {
            let shown = folder.display();
            Failure::Run(format!("cannot make the folder {shown}: {error}"))
        })?;
        let stored = Stored {
            materials: self.materials.to_vec(),
            ..outcome()
        };
        packing_file::write(&self.path(step), &self.under.scene.name, &stored)
    }

    /// Watches a step.
    pub fn step(&self, number: u64) -> Step<'_> {
        let midway = self.midway.borrow_mut().take_if(|(of, _)| *of == number);
        if midway.is_some() {
            let note = format!("preparation: step {number} goes on");
            self.journal().note(&note);
        }
        Step {
            under: self.under,
            bar: &self.bar,
            failure: &self.failure,
            number,
            from: midway.map(|(_, midway)| midway),
        }
    }
}

/// A step of a preparation under way.
#[derive(Debug)]
pub struct Step<'a> {
    under: &'a Under<'a>,
    bar: &'a Bar,
    failure: &'a RefCell<Option<Failure>>,
    number: u64,
    from: Option<Midway>,
}

impl Step<'_> {
    /// Keeps the state if that is due, and stops the step if the user asked to.
    pub fn pass(&self, midway: impl FnOnce() -> Midway) -> ControlFlow<()> {
        let passed = self.under.checkpoint(STAGE, || {
            let Midway { mut record, loops } = midway();
            let counts = [&[self.number], &loops[..]].concat();
            record.counts.insert(LOOPS.into(), counts);
            record
        });
        self.stopped_by(passed)
    }

    /// Stops a step that begins again, if the user asked to.
    fn pass_without_state(&self) -> ControlFlow<()> {
        self.stopped_by(match crate::interruption::requested() {
            true => Err(self.under.interrupted()),
            false => Ok(()),
        })
    }

    fn stopped_by(&self, passed: Result<(), Failure>) -> ControlFlow<()> {
        let Err(why) = passed else {
            return ControlFlow::Continue(());
        };
        *self.failure.borrow_mut() = Some(why);
        ControlFlow::Break(())
    }
}

impl Watch for Step<'_> {
    fn look(&mut self, look: &mut Look) -> ControlFlow<()> {
        self.bar.say(&look.measures.to_string());
        match look.can_go_on() {
            true => self.pass(|| look.midway().unwrap_or_default()),
            false => self.pass_without_state(),
        }
    }

    fn goes_on(&self) -> Option<&Midway> {
        self.from.as_ref()
    }
}
