//! Rigid bodies against closed forms and conservation laws.

mod grains;
mod impacts;
mod rest;
mod scene;
mod tops;
mod world;
