//! Grains in place before a run begins.

mod incline_bed;
mod sizes;

pub use incline_bed::{Bed, BedReport, InclineBed, settle_incline_bed};
pub use sizes::RadiusLaw;
