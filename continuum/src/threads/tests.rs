use std::sync::atomic::AtomicUsize;

/// Tasks that another thread than the caller's has taken.
pub(super) static TAKEN: AtomicUsize = AtomicUsize::new(0);
