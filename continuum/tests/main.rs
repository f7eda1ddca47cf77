//! The continuum against exact solutions, conservation laws and independent figures.

#![allow(clippy::unwrap_used)] // a test may panic

mod bagnold;
mod column_collapse;
mod creep;
mod cylinders_on_ground;
mod dam_break;
mod free_surface;
mod ground;
mod ground_in_space;
mod hard_cases;
mod laws;
mod manufactured;
mod multigrid;
mod open_ends;
mod open_ends_in_space;
mod outside;
mod sheared_layers;
mod shores;
mod silo;
mod space;
mod specks;
mod steep_ground;
mod terrain;
mod threads;
mod time_order;
mod two_dimensions;
mod walls;
mod walls_in_space;
mod well_posedness;
