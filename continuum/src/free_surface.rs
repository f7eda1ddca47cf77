//! Material with a moving free surface: how much of it lies in each cell, where its surface is, and
//! how it moves.

mod fraction;
pub mod plane;
mod topology;
mod transport;
