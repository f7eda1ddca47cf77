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
use crate::run_directory::differing_keys;
use crate::summary::Note;
use colluvium_dem::preparation::{Look, Midway, Packing, Watch};
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
/// Keys of a step's file: its number, and what it answered.
const STEP: &str = "step";
const ANSWER: &str = "answer";
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
    files(&directory.join(FOLDER)).is_ok_and(|files| files.iter().any(|(_, whole)| *whole))
}

/// Removes them; files of other names stay.
pub fn remove(directory: &Path) -> std::io::Result<()> {
    let folder = directory.join(FOLDER);
    for (step, whole) in files(&folder)? {
        let name = name_of(step);
        let partial = format!("{name}.partial");
        std::fs::remove_file(folder.join(if whole { name } else { partial }))?;
    }
    // Not empty if there is anything else in it.
    let _ = std::fs::remove_dir(&folder);
    Ok(())
}

fn name_of(step: u64) -> String {
    format!("step_{step}.h5")
}

/// Numbers of the steps that have files in a folder, and whether those are whole.
fn files(folder: &Path) -> std::io::Result<Vec<(u64, bool)>> {
    if !folder.is_dir() {
        return Ok(Vec::new());
    }
    let mut files = Vec::new();
    for entry in std::fs::read_dir(folder)? {
        let entry = entry?;
        let name = entry.file_name().into_string().unwrap_or_default();
        let whole = name.strip_suffix(".partial").unwrap_or(&name);
        let number = whole
            .strip_prefix("step_")
            .and_then(|n| n.strip_suffix(".h5"));
        let number = number.and_then(|n| n.parse().ok());
        if let Some(step) = number.filter(|&step| name_of(step) == whole)
            && entry.file_type()?.is_file()
        {
            files.push((step, whole == name));
        }
    }
    Ok(files)
}

/// What a step came to.
#[derive(Debug)]
pub struct Outcome {
    /// The packing.
    pub packing: Packing,
    /// Its notes.
    pub notes: Vec<Note>,
    /// Steps times grains that it took.
    pub grain_steps: u64,
    /// Whether it did what was asked for.
    pub answer: bool,
}

/// Watches a preparation and keeps what it has come to.
#[derive(Debug)]
pub struct Keeper<'a> {
    under: &'a Under<'a>,
    /// What the preparation goes by, and the names of its materials.
    recipe: (toml::Table, &'a [String]),
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
    /// If the checkpoint has no step, or a step that is kept cannot be used.
    pub fn new(
        under: &'a Under<'a>,
        recipe: (toml::Table, &'a [String]),
    ) -> Result<Keeper<'a>, Failure> {
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
            None => None,
        };
        let begins = midway.is_none();
        let keeper = Keeper {
            under,
            recipe,
            bar: Bar::new("preparation"),
            midway: RefCell::new(midway),
            failure: RefCell::default(),
        };
        let kept = files(&under.directory.file(FOLDER));
        let kept = kept.map_err(|error| Failure::Run(format!("cannot read {FOLDER}: {error}")))?;
        for (step, _) in kept.into_iter().filter(|(_, whole)| *whole) {
            keeper.stored(step)?;
        }
        if begins {
            under.begin()?;
        }
        Ok(keeper)
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
        if let Err(Failure::Run(_)) = made {
            // Its state was accepted, and it has failed from there.
            self.under.begin()?;
        }
        made?;
        match self.midway.into_inner() {
            Some(_) => Err(Failure::damaged("its preparation has no such step")),
            None => Ok(()),
        }
    }

    fn path(&self, step: u64) -> PathBuf {
        let folder = self.under.directory.file(FOLDER);
        folder.join(name_of(step))
    }

    /// What the file of a step goes by.
    fn provenance(&self, step: u64) -> toml::Table {
        let mut keys = self.recipe.0.clone();
        keys.insert(STEP.into(), (step as i64).into());
        keys
    }

    /// The file of a step, and what it answered.
    fn stored(&self, step: u64) -> Result<(Stored, bool), Failure> {
        let path = self.path(step);
        let refuse = |why: String| {
            Failure::Input(format!(
                "--resume: {} cannot be used: {why}; nothing was changed; without it the step is done again",
                path.display()
            ))
        };
        let mut stored = packing_file::read(&path).map_err(refuse)?;
        let answer = stored.provenance.remove(ANSWER).and_then(|a| a.as_bool());
        let (Some(answer), true) = (answer, stored.materials == self.recipe.1) else {
            return Err(refuse("it was made by another preparation".into()));
        };
        let differing = differing_keys(&stored.provenance, &self.provenance(step), "");
        if !differing.is_empty() {
            let differing = differing.join(", ");
            let why = format!("it was made by another preparation; differing: {differing}");
            return Err(refuse(why));
        }
        Ok((stored, answer))
    }

    /// What a step came to before the run was stopped, if that was kept.
    pub fn outcome(&self, step: u64) -> Result<Option<Outcome>, Failure> {
        if !self.path(step).exists() {
            return Ok(None);
        }
        let (stored, answer) = self.stored(step)?;
        self.journal()
            .note(&format!("preparation: step {step} was done before"));
        // Killed before the next one was saved.
        self.midway.borrow_mut().take_if(|(of, _)| *of <= step);
        let Stored {
            packing,
            notes,
            grain_steps,
            ..
        } = stored;
        Ok(Some(Outcome {
            packing,
            notes,
            grain_steps,
            answer,
        }))
    }

    /// Keeps what a step came to, if it took long from an instant on or went on.
    pub fn keep(
        &self,
        step: &Step,
        began: Instant,
        outcome: impl FnOnce() -> Outcome,
    ) -> Result<(), Failure> {
        if self.must_not_write() {
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
        let outcome = outcome();
        let mut provenance = self.provenance(step.number);
        provenance.insert(ANSWER.into(), outcome.answer.into());
        let stored = Stored {
            packing: outcome.packing,
            materials: self.recipe.1.to_vec(),
            provenance,
            notes: outcome.notes,
            grain_steps: outcome.grain_steps,
        };
        packing_file::write(&self.path(step.number), &self.under.scene.name, &stored)
    }

    /// Whether a later state waits, of this preparation or of the run that it is for: what is done again must not take its place.
    fn must_not_write(&self) -> bool {
        let later = self.under.resumed.as_ref();
        self.midway.borrow().is_some() || later.is_some_and(|saved| saved.stage != STAGE)
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
    /// Says which share of it is done.
    pub fn progress(&self, share: f64) {
        self.keeper.bar.set(share);
    }

    /// Keeps the state if that is due, and stops the step if the user asked to.
    pub fn pass(&self, midway: impl FnOnce() -> Midway) -> ControlFlow<()> {
        if self.keeper.must_not_write() {
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
        match &mut look.state {
            Some(state) => self.pass(|| state.midway()),
            None => self.pass_without_state(),
        }
    }

    fn goes_on(&self) -> Option<&Midway> {
        self.from.as_ref()
    }
}
