//! YADE: driven by a script of ours that reads the case as JSON.

use super::case::{Case, Law};

/// What YADE runs.
pub const SCRIPT: &str = include_str!("scripts/run_yade.py");

/// The law YADE solves.
pub fn law(case: &Case) -> &'static str {
    match case.law {
        Law::Hooke { .. } => {
            "ViscElPhys: the case's but no pull at release; arms to the contact point"
        }
        Law::HertzMindlin { .. } => {
            "MindlinPhys, damping ratios of the same dashpots; no pull at release; walls as curved as grains"
        }
    }
}
