//! Coarse-graining, calibration and the overlap against exact solutions and conservation laws.

#![allow(clippy::unwrap_used)] // a test may panic

mod alternatives;
mod calibration;
mod coarse_graining;
mod debris_ground;
mod depth_design;
mod fields;
mod fluidity;
mod incline;
mod joint_laws;
mod overlap;
