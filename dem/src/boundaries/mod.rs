//! Boundaries that move, and boundaries that let grains go.
//!
//! `motion.rs` stretches, shrinks and shears a periodic box; `stress.rs` says what it feels; `outlet.rs`
//! takes out grains that leave a region. How images move is `domain.rs`' matter.

mod motion;
mod outlet;
mod stress;

pub use motion::{BoxMotion, Edge, StressServo};
pub use outlet::{Outflow, Outlet};

pub(crate) use motion::MovingBox;
pub(crate) use outlet::Drain;
