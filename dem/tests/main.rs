//! Grains against exact solutions, conservation laws and independent figures.

#![allow(clippy::unwrap_used)] // a test may panic

mod bits;
mod bodies;
mod bonds;
mod boundaries;
mod cantilever;
mod clumps;
mod conversion;
mod energy_ledger;
mod gravity;
mod impacts;
mod incline_bed;
mod law_bits;
mod loads;
mod malformed_records;
mod patches;
mod preparation;
mod registers;
mod sheared_cells;
mod walls;
mod world;
