//! `log.txt`: what happened when, one line each.

use std::fs::{File, OpenOptions};
use std::io::Write;
use std::path::Path;
use std::sync::Mutex;
use std::time::Instant;

/// The log of one run; lines may come from several threads.
#[derive(Debug)]
pub struct Journal {
    file: Mutex<File>,
    start: Instant,
}

impl Journal {
    /// Opens `log.txt` in a run directory; a resumed run writes behind what is there.
    pub fn open(path: &Path, append: bool) -> std::io::Result<Journal> {
        let file = OpenOptions::new()
            .create(true)
            .write(true)
            .append(append)
            .truncate(!append)
            .open(path)?;
        Ok(Journal {
            file: Mutex::new(file),
            start: Instant::now(),
        })
    }

    /// Writes one line behind the seconds since the start.
    ///
    /// A log line that cannot be written does not end a run: results still can.
    pub fn note(&self, text: &str) {
        let seconds = self.start.elapsed().as_secs_f64();
        if let Ok(mut file) = self.file.lock() {
            let _ = writeln!(file, "{seconds:10.2} s  {text}");
        }
    }
}
