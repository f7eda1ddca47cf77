//! From grains to a continuum law: averages of a discrete run, tests for steady state, and the calibration
//! of the μ(I) rheology with its uncertainties.

pub mod calibration;
pub mod campaign;
pub mod coarse_graining;
pub mod debris_ground;
pub mod handover;
pub mod incline;
pub mod overlap;
pub mod steady_state;
pub mod zones;
