//! Scenes, runs, reports and the command line of the Colluvium granular-flow toolkit.
//!
//! A [`scene::Scene`] (TOML) says what is to be simulated; [`run::run`] simulates it into a run
//! directory with a summary, tables, HDF5 results and a report; [`calibrate::calibrate`] makes a
//! campaign of inclined-plane runs, fits μ(I) to it and compares the continuum with the grains;
//! [`pareto`] sets error against cost. Files are read and written in this crate only: the physics
//! crates take and give plain data.

pub mod averages;
pub mod body_facets;
pub mod calibrate;
pub mod checkpoint;
pub mod coarse_grain;
pub mod command_line;
pub mod cost;
pub mod failure;
pub mod frames;
pub mod grain_files;
pub mod height_files;
pub mod interruption;
pub mod journal;
pub mod map;
pub mod mesh_files;
pub mod pareto;
pub mod plan;
pub mod progress;
pub mod render;
pub mod report;
pub mod results_file;
pub mod rheology_file;
pub mod run;
pub mod run_directory;
pub mod scene;
pub mod seal;
pub mod start_file;
pub mod state_hash;
pub mod summary;
pub mod table;
pub mod validate;
pub mod vtkhdf;
