//! Ctrl-C and termination: a flag that long loops look at.

use std::sync::OnceLock;
use std::sync::atomic::{AtomicBool, Ordering};

static STOP: AtomicBool = AtomicBool::new(false);
static LISTENING: OnceLock<bool> = OnceLock::new();

/// Starts to listen for SIGINT, SIGTERM and SIGHUP; the first one asks for a checkpoint, the
/// second one ends the process at once.
pub fn listen() {
    LISTENING.get_or_init(|| {
        ctrlc::set_handler(|| {
            if STOP.swap(true, Ordering::SeqCst) {
                std::process::exit(i32::from(crate::failure::INTERRUPTED));
            }
        })
        .is_ok()
    });
}

/// Whether the user asked to stop.
pub fn requested() -> bool {
    STOP.load(Ordering::SeqCst)
}

/// The flag itself, for loops of other crates.
pub fn flag() -> &'static AtomicBool {
    &STOP
}
