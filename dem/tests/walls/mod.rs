//! Walls of every shape, at rest and in motion, against closed forms and conservation laws.

mod meshes;
mod moving;
mod scene;
mod shapes;
