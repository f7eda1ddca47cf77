//! How a command can end other than well, and the exit status each ending has.

use crate::scene::SceneError;
use std::path::PathBuf;
use thiserror::Error;

/// Exit status of bad input: nothing was written.
pub const BAD_INPUT: u8 = 2;
/// Exit status of a run that failed.
pub const RUN_FAILED: u8 = 1;
/// Exit status of an interrupted run whose checkpoint was written.
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
    /// Stopped by the user; the checkpoint is in the directory.
    #[error("interrupted; `--resume --out {}` goes on from the checkpoint", .directory.display())]
    Interrupted {
        /// The run directory that holds the checkpoint.
        directory: PathBuf,
    },
}

impl Failure {
    /// The process exit status that scripts rely on.
    pub fn exit_status(&self) -> u8 {
        match self {
            Failure::Scene(_) | Failure::Input(_) => BAD_INPUT,
            Failure::Run(_) => RUN_FAILED,
            Failure::Interrupted { .. } => INTERRUPTED,
        }
    }
}
