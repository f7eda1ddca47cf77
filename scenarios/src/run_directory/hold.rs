//! One process in a run directory at a time: an advisory lock that ends with the process.

use super::{SUMMARY, summary_text, write_in_place};
use crate::failure::Failure;
use crate::report;
use crate::summary::Status;
use std::fs::{self, File, TryLockError};
use std::io::{ErrorKind, Write};
use std::path::{Path, PathBuf};
use std::sync::Mutex;

/// Name of the file that is locked; it holds the number of the process. It stays, for a file that is removed and
/// made again can be locked twice.
pub const LOCK: &str = "run.lock";

/// Directories that this process holds.
static HELD: Mutex<Vec<PathBuf>> = Mutex::new(Vec::new());

/// ENOLCK of Linux: no locks available, as on a network file system without a lock daemon.
const NO_LOCKS: i32 = 37;

/// A directory that nobody else writes in.
#[derive(Debug)]
pub struct Hold {
    file: File,
    path: PathBuf,
}

impl Hold {
    /// Takes a directory, which must exist.
    pub fn take(path: &Path) -> Result<Hold, Failure> {
        let shown = path.display();
        let unwritable = |error: std::io::Error| {
            Failure::Input(format!(
                "--out {shown}: cannot write there: {error}; allowed: a folder that can be written"
            ))
        };
        let name = path.join(LOCK);
        let mut file = File::options()
            .read(true)
            .write(true)
            .create(true)
            .truncate(false)
            .open(&name)
            .map_err(unwritable)?;
        match file.try_lock() {
            Ok(()) => {}
            Err(TryLockError::WouldBlock) => {
                let text = fs::read_to_string(&name).unwrap_or_default();
                let number = text.trim().parse::<u32>();
                let process = number.map_or(String::new(), |n| format!(" (pid {n})"));
                return Err(Failure::Input(format!(
                    "--out {shown}: in use by another process{process}; allowed: another directory, or this one when that has ended"
                )));
            }
            // Some network file systems know no locks: there nothing is guarded.
            Err(TryLockError::Error(error))
                if error.kind() == ErrorKind::Unsupported
                    || error.raw_os_error() == Some(NO_LOCKS) => {}
            Err(TryLockError::Error(error)) => return Err(unwritable(error)),
        }
        file.set_len(0)
            .and_then(|()| writeln!(file, "{}", std::process::id()))
            .map_err(unwritable)?;
        if let Ok(mut held) = HELD.lock() {
            held.push(path.to_owned());
        }
        Ok(Hold {
            file,
            path: path.to_owned(),
        })
    }
}

impl Drop for Hold {
    fn drop(&mut self) {
        if let Ok(mut held) = HELD.lock() {
            held.retain(|path| *path != self.path);
        }
        // A child that is just being started shares the file: closing it here would not be enough.
        let _ = self.file.unlock();
    }
}

/// Says in the summary of every run under way that it was given up.
pub fn abandon_all() {
    let Ok(held) = HELD.try_lock() else { return };
    for path in held.iter() {
        let Ok(mut summary) = report::read_summary(path) else {
            continue;
        };
        if summary.status != Status::Running {
            continue;
        }
        summary.status = Status::Interrupted;
        let remark = "abandoned: what was computed after the last checkpoint is lost";
        summary.remarks.push(remark.into());
        let written = summary_text(&summary)
            .is_ok_and(|text| write_in_place(&path.join(SUMMARY), text.as_bytes()).is_ok());
        if !written {
            let _ = writeln!(
                std::io::stderr(),
                "colluvium: cannot write {SUMMARY} in {}",
                path.display()
            );
        }
    }
}
