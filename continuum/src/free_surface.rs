//! Material with a moving free surface: how much of it lies in each cell, where its surface is, and
//! how it moves.
//!
//! There is no air. A step moves volume and momentum ([`SurfaceFlow`]), finds out which velocities
//! and pressures are unknowns where the material now lies, and solves for velocity, pressure and
//! stress at once. Cells without material cost next to nothing.
//!
//! Axes are looped over by number and planes have three components, so that a third axis is a longer
//! array; only the corners of quadrature points are written for a plane.

mod faces;
mod fields;
mod flow;
mod fraction;
mod ground;
mod open_ends;
mod operators;
pub mod plane;
mod topology;
mod transport;

pub use faces::ThinLayer;
pub use fields::CellFields;
pub use flow::{Spent, SurfaceFlow, SurfaceOptions, SurfaceState, SurfaceStep};
pub use ground::{Contact, Terrain};
pub use open_ends::Inflow;
