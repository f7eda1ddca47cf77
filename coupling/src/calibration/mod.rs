//! Calibration of μ(I) from averaged profiles of inclined flows.

mod fluidity;
mod free_form;
mod friction_map;
mod laws;
pub mod least_squares;
mod mu_i;
mod points;
mod posterior;
mod prediction;
mod residual_tests;
mod table;
pub mod thesis;

pub use fluidity::{FluidityFit, FluidityFlow, FluidityLayer, Foretold, fit_fluidity};
pub use free_form::{FreeForm, fit_free_form};
pub use friction_map::{
    Axis, Curve, FrictionMap, Interpolated, InterpolationError, MapCell, MapError, Missed,
    WithError,
};
pub use laws::{
    Alternative, Deviation, Fraction, JointAlternative, JointComparison, Law, compare_joint_laws,
    compare_laws,
};
pub use least_squares::FitError;
pub use mu_i::{MuIFit, SolidFractionFit, Stress, fit_mu_i, fit_solid_fraction, mu_of_i};
pub use points::{LocalPoint, PointRules, flow_height, local_points};
pub use posterior::{Posterior, sample_posterior};
pub(crate) use prediction::inertial_number;
pub use prediction::{BulkFlow, CONTROL, Discrepancy, LeftOut, band, law_of, left_out};
pub use residual_tests::{ResidualTests, pressure_ratio, residual_tests};
pub use table::friction_table;
