//! ESyS-Particle: driven by a script of ours, on the cases whose physics it has.

use super::case::Case;
use super::law::{Law, plain};

/// What ESyS-Particle runs.
pub const SCRIPT: &str = include_str!("scripts/run_esys.py");

/// The law ESyS-Particle solves.
pub fn law(_: &Case) -> String {
    "HertzMindlinVisco between grains; walls are linear springs without damping or friction".into()
}

/// Why a case is not within its reach.
pub fn unfit(case: &Case) -> Option<&'static str> {
    if case.periodic[1] {
        return Some("its boxes are periodic along x only");
    }
    let hertz = matches!(case.law, Law::HertzMindlin { .. });
    (!hertz || !plain(case)).then_some("our script has Hertz–Mindlin only")
}
