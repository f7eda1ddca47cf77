//! What can be wrong with a map.

/// What is wrong with a map, or with a place on it.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum MapError {
    /// The place lies outside.
    #[error("{key} = {value} is outside the map; allowed: [{low}, {high}]")]
    Outside {
        /// `beta` or `mu_r`.
        key: &'static str,
        /// The value.
        value: f64,
        /// Lowest on the map.
        low: f64,
        /// Highest.
        high: f64,
    },
    /// The cells are no grid.
    #[error(
        "the cells are no grid: {betas} values of beta and {mu_rs} of mu_r, at least two each, need {needed} cells; there are {found}"
    )]
    NoGrid {
        /// Different β.
        betas: usize,
        /// Different μ_R.
        mu_rs: usize,
        /// Cells of the full grid.
        needed: usize,
        /// Cells there are.
        found: usize,
    },
    /// A number that cannot be.
    #[error(
        "{key} = {value} of the cell at beta = {beta}, mu_r = {mu_r} is not allowed; allowed: {allowed}"
    )]
    BadCell {
        /// β.
        beta: f64,
        /// μ_R.
        mu_r: f64,
        /// Which number.
        key: &'static str,
        /// The value.
        value: f64,
        /// What is allowed.
        allowed: &'static str,
    },
    /// The three inertial numbers do not rise.
    #[error("inertial_numbers = {0:?} are not allowed; allowed: three positive numbers that rise")]
    InertialNumbers([f64; 3]),
}
