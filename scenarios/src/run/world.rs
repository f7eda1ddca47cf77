//! Scenes of grains with walls, bonds, gravity and a preparation: what they share.
//!
//! A scene brings a [`Recipe`]: how its grains are put in place, the [`World`] around them, what is looked
//! at and when it is over. The rest is here: a packing is made in a [`Workshop`] or read from a file, kept
//! in the run directory, put into its world and followed step by step with rows, frames, pictures and
//! checkpoints ([`course`]).
//!
//! The packing is the same to the bit whether it is made or read: a run starts from places, velocities and
//! spins alone, with springs that are not yet stretched.

pub mod boulders;
pub mod build;
pub mod course;
pub mod fragments;
pub mod history;
pub mod kept_steps;
pub mod live_averages;
pub mod packing_file;
pub mod pictures;
pub mod recipe;
pub mod steps;
pub mod store;
pub mod workshop;

pub use build::{Stand, World};
pub use course::Ran;
pub(crate) use recipe::as_the_scene;
pub use recipe::{Course, Expected, Recipe, RecipeKeys};
pub use workshop::Workshop;
