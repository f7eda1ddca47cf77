//! Material with a moving free surface: how much of it lies in each cell, where its surface is, and
//! how it moves.

mod faces;
mod flow;
mod fraction;
mod operators;
pub mod plane;
mod topology;
mod transport;

pub use faces::ThinLayer;
pub use flow::{SurfaceFlow, SurfaceOptions, SurfaceState, SurfaceStep};
