//! YADE: driven by a script of ours that reads the case as JSON.

use super::case::Case;
use super::law::{Law, plain};

/// What YADE runs.
pub const SCRIPT: &str = include_str!("scripts/run_yade.py");

/// Why a case is not within our script's reach.
pub fn unfit(case: &Case) -> Option<&'static str> {
    (!plain(case)).then_some("our script has springs and Hertz–Mindlin only")
}

/// The law YADE solves.
pub fn law(case: &Case) -> String {
    let words = match case.law {
        Law::Hooke { .. } => {
            "ViscElPhys: the case's but no pull at release; arms to the contact point"
        }
        _ => {
            "MindlinPhys, damping ratios of the same dashpots; no pull at release; walls as curved as grains"
        }
    };
    words.into()
}
