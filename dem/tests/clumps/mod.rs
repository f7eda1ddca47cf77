//! Clumps of grains against closed forms, conservation laws and the grains they are made of.

mod beds;
mod changes;
mod impacts;
mod motion;
pub mod packings;
mod scene;
mod slopes;
mod steps;
