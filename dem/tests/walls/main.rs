//! Walls of every shape, at rest and in motion, against closed forms and conservation laws.

#![allow(clippy::unwrap_used)]

mod meshes;
mod moving;
mod scene;
mod shapes;
