//! Scenes, runs and the command line as a user meets them.

#![allow(clippy::unwrap_used)] // a test may panic

mod bad_input;
mod beds;
mod bodies;
mod cliff;
mod cliff_terrain;
mod clumps;
mod collapse;
mod column_terrain;
mod comet;
mod command;
mod cylinder;
mod cylinder_of_grains;
mod friction_map;
mod full_disk;
mod grains;
mod joined_bed;
mod joined_cliff;
mod joined_column;
mod joined_incline;
mod joined_interval;
mod killed;
mod malformed;
mod open_chute;
mod own_scenes;
mod packings;
mod prepared_beds;
mod read_scenes;
mod recipes;
mod restart;
mod safety;
mod scenes;
mod sheared;
mod silo_discharge;
mod tumbling_box;
mod worlds;
