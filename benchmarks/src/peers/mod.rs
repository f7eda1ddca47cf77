//! Side by side with other DEM codes: the same grains, the same law as far as each has it, in turns on
//! the same cores.
//!
//! * [`case`] describes a comparison once; decks and start files of every code are written from it.
//! * [`find`] looks for the codes; [`run`](mod@run) runs one of them once.
//! * [`rounds`] takes turns; [`report`] turns the traces into tables.
//!
//! Rates on shared machines scatter by tens of per cent, so only ratios of runs of the same round mean
//! something. No test depends on any of this.

pub mod case;
pub mod esys;
pub mod find;
pub mod lammps;
pub mod law;
pub mod liggghts;
pub mod machine;
pub mod ours;
pub mod report;
pub mod rounds;
pub mod run;
pub mod start_files;
pub mod statistics;
pub mod trace;
pub mod yade;
