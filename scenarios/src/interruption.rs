//! Ctrl-C and termination: a flag that long loops look at.

use crate::failure::INTERRUPTED;
use crate::run_directory;
use std::io::Write;
use std::sync::OnceLock;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

static STOP: AtomicBool = AtomicBool::new(false);
static LISTENING: OnceLock<bool> = OnceLock::new();

/// Signals that follow the first one within this time are repeats of it: `timeout` and terminals send one to the
/// process and to its group.
const REPEATS: Duration = Duration::from_secs(2);

/// Starts to listen for SIGINT, SIGTERM and SIGHUP: the first one asks for a checkpoint, a clearly later one gives
/// the run up at once.
pub fn listen() {
    let mut first: Option<Instant> = None;
    LISTENING.get_or_init(|| {
        ctrlc::set_handler(move || match first {
            None => {
                first = Some(Instant::now());
                request();
                let seconds = REPEATS.as_secs();
                say(&format!(
                    "stopping: writing a checkpoint if there is anything to save; press again after {seconds} s to abandon"
                ));
            }
            Some(first) if first.elapsed() < REPEATS => {}
            Some(_) => {
                run_directory::abandon_all();
                say("abandoned");
                std::process::exit(i32::from(INTERRUPTED));
            }
        })
        .is_ok()
    });
}

/// Tells the user; a terminal that has gone away cannot be told.
fn say(text: &str) {
    let _ = writeln!(std::io::stderr(), "colluvium: {text}");
}

/// Whether the user asked to stop.
pub fn requested() -> bool {
    STOP.load(Ordering::SeqCst)
}

/// Asks for the same by the program itself, where going on is of no use.
pub fn request() {
    STOP.store(true, Ordering::SeqCst);
}

/// The flag itself, for loops of other crates.
pub fn flag() -> &'static AtomicBool {
    &STOP
}
