//! ESyS-Particle: driven by a script of ours, on the cases whose physics it has.

use super::case::Case;

/// What ESyS-Particle runs.
pub const SCRIPT: &str = include_str!("scripts/run_esys.py");

/// The law ESyS-Particle solves.
pub fn law(_: &Case) -> &'static str {
    "HertzMindlinVisco between grains; walls are linear springs without damping or friction"
}

/// Why a case is not within its reach.
pub fn unfit(case: &Case) -> Option<&'static str> {
    case.periodic[1].then_some("its boxes are periodic along x only")
}
