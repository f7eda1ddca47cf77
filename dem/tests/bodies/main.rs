//! Rigid bodies against closed forms and conservation laws.

#![allow(clippy::unwrap_used)]

mod grains;
mod impacts;
mod rest;
mod scene;
mod tops;
mod world;
