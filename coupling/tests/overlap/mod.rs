//! The overlap of grains and continuum against full runs of grains, closed forms and conservation.
//!
//! Units: mean diameter, mean mass and gravity are 1; times are √(d/g).

mod angular;
mod between;
mod books;
mod comparison;
mod growth;
mod hard_cases;
mod incline;
mod interval;
mod joined;
mod loose;
mod material;
mod motion;
mod over_ground;
mod patch_noise;
mod pulse;
mod rest;
mod rest_pressure;
mod sheared;
mod witness;
mod world;
