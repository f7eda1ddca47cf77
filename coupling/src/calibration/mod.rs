//! Calibration of μ(I) from averaged profiles of inclined flows.

pub mod least_squares;
mod mu_i;
mod points;
mod table;
pub mod thesis;

pub use least_squares::FitError;
pub use mu_i::{MuIFit, SolidFractionFit, Stress, fit_mu_i, fit_solid_fraction, mu_of_i};
pub use points::{LocalPoint, PointRules, flow_height, local_points};
pub use table::friction_table;
