//! Material with a moving free surface: how much of it lies in each cell, where its surface is, and
//! how it moves.
//!
//! There is no air. A step moves volume and momentum ([`SurfaceFlow`]), finds out which velocities
//! and pressures are unknowns where the material now lies, and solves for velocity, pressure and
//! stress at once. Cells without material cost next to nothing.
//!
//! The same code moves material in a plane ([`SurfaceFlow`]) and in space ([`SpaceFlow`]): the number of axes
//! is a constant of its types. Walls beside it that the grid does not resolve are known in a plane only.

mod distances;
mod faces;
mod fields;
mod flow;
mod fraction;
mod ground;
mod layers_on_material;
mod open_ends;
mod operators;
mod outlet;
mod outside;
pub mod plane;
mod sliding;
mod standing;
mod topology;
mod transport;

pub use faces::ThinLayer;
pub use fields::{CellFields, flowing_shares};
pub use flow::{
    History, SpaceFields, SpaceFlow, SpaceState, Spent, SurfaceFlow, SurfaceOptions, SurfaceState,
    SurfaceStep,
};
pub use ground::{Contact, Terrain};
pub use open_ends::Inflow;
pub use outside::Outside;
