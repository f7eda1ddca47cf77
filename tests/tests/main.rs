//! The crates together against exact solutions, conservation laws and figures of others.

#![allow(clippy::unwrap_used)] // a test may panic

mod binaries;
mod bulk_column;
mod bulk_gas;
mod bulk_hopper;
mod bulk_repose;
mod cliffs;
mod column_of_grains;
mod comet_strength;
mod contact_chung_ooi;
mod contact_closed_forms;
mod contact_ghosts;
mod contact_peers;
mod contact_restitution;
mod contact_rolling;
mod contact_tancredi;
mod hard_cases;
mod incline_reference;
mod steady_flow;
mod step_limits;
