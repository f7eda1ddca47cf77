//! How a command can end other than well, and the exit status each ending has.

use crate::scene::SceneError;
use std::path::{Path, PathBuf};
use thiserror::Error;

/// Exit status of bad input: nothing was written.
pub const BAD_INPUT: u8 = 2;
/// Exit status of a run that failed.
pub const RUN_FAILED: u8 = 1;
/// Exit status of an interrupted run; its message says whether it goes on or starts again.
pub const INTERRUPTED: u8 = 130;

/// Why a command did not end well.
#[derive(Debug, Error)]
pub enum Failure {
    /// A scene that cannot be run.
    #[error(transparent)]
    Scene(#[from] SceneError),
    /// Any other input that cannot be used: a path, an option, a checkpoint.
    #[error("{0}")]
    Input(String),
    /// The run began and could not be finished.
    #[error("{0}")]
    Run(String),
    /// Stopped by the user.
    #[error("interrupted; {}", .resumes.words(.directory))]
    Interrupted {
        /// The run directory.
        directory: PathBuf,
        /// What becomes of it.
        resumes: Resumes,
    },
}

/// What an interrupted command does when it is called again.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Resumes {
    /// It goes on from what was saved.
    GoesOn,
    /// Nothing was saved yet.
    StartsAgain,
    /// The command knows no `--resume`.
    Never,
}

impl Resumes {
    /// Goes on if something was saved.
    pub fn from_saved(saved: bool) -> Resumes {
        if saved {
            Resumes::GoesOn
        } else {
            Resumes::StartsAgain
        }
    }

    fn words(self, directory: &Path) -> String {
        let shown = directory.display();
        match self {
            Resumes::GoesOn => format!("`--resume --out {shown}` goes on from what was saved"),
            Resumes::StartsAgain => {
                format!("nothing was saved yet: `--resume --out {shown}` starts again")
            }
            Resumes::Never => {
                format!("{shown} keeps the finished runs; called again, it starts again")
            }
        }
    }
}

impl Failure {
    /// A checkpoint that cannot be gone on from.
    pub fn damaged(why: &str) -> Failure {
        Failure::Input(format!("--resume: the checkpoint is damaged: {why}"))
    }

    /// The same failure once work has been done: no longer bad input with nothing written.
    pub fn after_work(self) -> Failure {
        match self {
            Failure::Scene(error) => Failure::Run(error.to_string()),
            Failure::Input(message) => Failure::Run(message),
            other => other,
        }
    }

    /// The process exit status that scripts rely on.
    pub fn exit_status(&self) -> u8 {
        match self {
            Failure::Scene(_) | Failure::Input(_) => BAD_INPUT,
            Failure::Run(_) => RUN_FAILED,
            Failure::Interrupted { .. } => INTERRUPTED,
        }
    }
}
