//! Local points (I, μ, φ) through the depth of a flow.

use crate::coarse_graining::Profile;
use serde::{Deserialize, Serialize};

/// One layer of one run, with standard errors.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct LocalPoint {
    /// Slope of the run (degrees).
    pub slope_degrees: f64,
    /// Height above the base (m).
    pub z: f64,
    /// I = γ̇ d √(ρ_s/p).
    pub inertial_number: f64,
    /// Standard error of I.
    pub inertial_number_error: f64,
    /// |τ|/p, p = trace/3.
    pub friction: f64,
    /// Standard error of |τ|/p.
    pub friction_error: f64,
    /// |τ|/σ_zz.
    pub friction_zz: f64,
    /// Standard error of |τ|/σ_zz.
    pub friction_zz_error: f64,
    /// Solid fraction φ.
    pub solid_fraction: f64,
    /// Standard error of φ.
    pub solid_fraction_error: f64,
}

/// Which layers count: those at least `base_cut` above the top of the base (z = 0) and `top_cut` below the
/// surface, the upper face of the highest layer with φ > `surface_solid_fraction`.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct PointRules {
    /// Cut above the base (m); 3 d: the basal layer slips and is layered.
    pub base_cut: f64,
    /// Cut below the surface (m); 4 d: p → 0, grains saltate, and |τ|/p falls off the law by up to 8 % in
    /// the third and fourth layer (seen alike in LAMMPS).
    pub top_cut: f64,
    /// Solid fraction that marks the surface; 0.2 as in the thesis.
    pub surface_solid_fraction: f64,
}

impl PointRules {
    /// Base 3 d, top 4 d, φ > 0.2.
    pub fn for_diameter(diameter: f64) -> Self {
        Self {
            base_cut: 3.0 * diameter,
            top_cut: 4.0 * diameter,
            surface_solid_fraction: 0.2,
        }
    }
}

/// Height of the flow (m): upper face of the highest layer with φ above the given value; 0 without one.
pub fn flow_height(profile: &Profile, solid_fraction: f64) -> f64 {
    profile
        .rows
        .iter()
        .rev()
        .find(|row| row.phi.value > solid_fraction)
        .map_or(0.0, |row| row.z + 0.5 * profile.layer)
}

/// The points of one run's profile. A layer needs its whole thickness inside the cuts, and I, μ and their
/// errors (so at least 3 blocks in time).
pub fn local_points(profile: &Profile, slope_degrees: f64, rules: &PointRules) -> Vec<LocalPoint> {
    let top = flow_height(profile, rules.surface_solid_fraction) - rules.top_cut;
    let half = 0.5 * profile.layer;
    // Faces that coincide with a cut but for round-off are inside.
    let slack = 1e-9 * profile.layer;
    profile
        .rows
        .iter()
        .filter(|row| row.z - half >= rules.base_cut - slack && row.z + half <= top + slack)
        .filter_map(|row| {
            let (i, mu, mu_zz) = (row.i?, row.mu?, row.mu_zz?);
            let usable = i.value > 0.0 && i.error > 0.0 && mu.error > 0.0 && mu_zz.error > 0.0;
            usable.then_some(LocalPoint {
                slope_degrees,
                z: row.z,
                inertial_number: i.value,
                inertial_number_error: i.error,
                friction: mu.value,
                friction_error: mu.error,
                friction_zz: mu_zz.value,
                friction_zz_error: mu_zz.error,
                solid_fraction: row.phi.value,
                solid_fraction_error: row.phi.error,
            })
        })
        .collect()
}
