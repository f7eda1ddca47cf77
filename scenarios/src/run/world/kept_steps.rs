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

/// The state of a preparation in a run that goes on.
pub fn midway<'a>(under: &'a Under) -> Option<&'a Checkpoint> {
    under.resumed.as_ref().filter(|saved| saved.stage == STAGE)
}

/// Takes it out: what is left is the state of the run itself, or none.
pub fn forget_midway(under: &mut Under) {
    under.resumed.take_if(|saved| saved.stage == STAGE);
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
    /// A keeper of a run's preparation, which begins, or goes on from the run's checkpoint.
    ///
    /// # Errors
    /// If the checkpoint has no step.
    pub fn new(under: &'a Under<'a>, materials: &'a [String]) -> Result<Keeper<'a>, Failure> {
        let midway = match midway(under) {
            Some(saved) => {
                let mut record = saved.record.clone();
                let counts = record.counts.remove(LOOPS).unwrap_or_default();
                let Some((&number, loops)) = counts.split_first() else {
                    return Err(Failure::damaged("its preparation has no step"));
                };
                let loops = loops.to_vec();
                Some((number, Midway { record, loops }))
            }
            None => {
                under.begin()?;
                None
            }
        };
        Ok(Keeper {
            under,
            materials,
            bar: Bar::new("preparation"),
            midway: RefCell::new(midway),
            failure: RefCell::default(),
        })
    }

    /// The log of the run.
    pub fn journal(&self) -> &'a Journal {
        &self.under.directory.journal
    }

    /// Ends the watch of a preparation that was made or not; why one was stopped the keeper knows.
    pub fn end(self, made: Result<(), Failure>) -> Result<(), Failure> {
        self.bar.clear();
        if let Some(why) = self.failure.into_inner() {
            return Err(why);
        }
        made?;
        match self.midway.into_inner() {
            Some(_) => Err(Failure::damaged("its preparation has no such step")),
            None => Ok(()),
        }
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
        // Killed before the next one was saved.
        self.midway.borrow_mut().take_if(|(of, _)| *of <= step);
        Ok(Some(stored))
    }

    /// Keeps what a step came to, if it took long from an instant on or went on.
    pub fn keep(
        &self,
        step: &Step,
        began: Instant,
        outcome: impl FnOnce() -> Stored,
    ) -> Result<(), Failure> {
        // The state of a later step is still to be accepted.
        if self.midway.borrow().is_some() {
            return Ok(());
        }
        self.under.begin()?;
        let long = self.under.given_pause.map_or(LONG, |pause| LONG.min(pause));
        if step.from.is_none() && began.elapsed() < long {
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
        packing_file::write(&self.path(step.number), &self.under.scene.name, &stored)
    }

    /// Watches a step.
    pub fn step(&self, number: u64) -> Step<'_> {
        let midway = self.midway.borrow_mut().take_if(|(of, _)| *of == number);
        if midway.is_some() {
            let note = format!("preparation: step {number} goes on");
            self.journal().note(&note);
        }
        Step {
            keeper: self,
            number,
            from: midway.map(|(_, midway)| midway),
        }
    }
}

/// A step of a preparation under way.
#[derive(Debug)]
pub struct Step<'a> {
    keeper: &'a Keeper<'a>,
    number: u64,
    from: Option<Midway>,
}

impl Step<'_> {
    /// Keeps the state if that is due, and stops the step if the user asked to.
    pub fn pass(&self, midway: impl FnOnce() -> Midway) -> ControlFlow<()> {
        // A step that is done again must not take the place of a later one's state.
        if self.keeper.midway.borrow().is_some() {
            return self.pass_without_state();
        }
        let save = || {
            let Midway { mut record, loops } = midway();
            let counts = [&[self.number], &loops[..]].concat();
            record.counts.insert(LOOPS.into(), counts);
            record
        };
        // A state that is gone on from has been accepted by now.
        let under = self.keeper.under;
        self.stopped_by(under.begin().and_then(|()| under.checkpoint(STAGE, save)))
    }

    /// Stops a step without keeping its state, if the user asked to.
    fn pass_without_state(&self) -> ControlFlow<()> {
        self.stopped_by(match crate::interruption::requested() {
            true => Err(self.keeper.under.interrupted()),
            false => Ok(()),
        })
    }

    fn stopped_by(&self, passed: Result<(), Failure>) -> ControlFlow<()> {
        let Err(why) = passed else {
            return ControlFlow::Continue(());
        };
        *self.keeper.failure.borrow_mut() = Some(why);
        ControlFlow::Break(())
    }
}

impl Watch for Step<'_> {
    fn look(&mut self, look: &mut Look) -> ControlFlow<()> {
        self.keeper.bar.say(&look.measures.to_string());
        match look.can_go_on() {
            true => self.pass(|| look.midway().unwrap_or_default()),
            false => self.pass_without_state(),
        }
    }

    fn goes_on(&self) -> Option<&Midway> {
        self.from.as_ref()
    }
}
