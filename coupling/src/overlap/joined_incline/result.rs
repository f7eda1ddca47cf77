//! What comes out of a joined incline run.

use crate::coarse_graining::Profile;
use crate::overlap::{Ledger, Report, Resolved, Work};
use colluvium_dem::Snapshot;

/// Mean of the continuum in one cell.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ContinuumRow {
    /// Middle of the cell (m).
    pub z: f64,
    /// Velocity along the flow (m/s).
    pub u: f64,
    /// Pressure (Pa).
    pub p: f64,
    /// Shear stress of the continuum's own (Pa): the mean of the two faces.
    pub tau: f64,
    /// Whether the cell is part of the copy, where grains are too.
    pub is_copy: bool,
}

/// One instant of both.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct HistoryPoint {
    /// Time (s).
    pub time: f64,
    /// Mean velocity of all material downslope: grains, and continuum beyond the edge (m/s).
    pub mean_velocity: f64,
    /// Velocity of the continuum beside the edge (m/s).
    pub edge_velocity: f64,
    /// Velocity of the uppermost cell (m/s).
    pub surface_velocity: f64,
    /// Height of the edge (m).
    pub edge_height: f64,
}

/// What came out.
#[derive(Clone, Debug)]
pub struct JoinedInclineResult {
    /// Averages of the grains; in the shell their stress is not that of the flow.
    pub profile: Profile,
    /// Averages of the continuum, from below.
    pub continuum: Vec<ContinuumRow>,
    /// Since the continuum took over, at the times of samples.
    pub history: Vec<HistoryPoint>,
    /// What the monitors say of the averaging time.
    pub report: Report,
    /// Accounts since the continuum took over.
    pub ledger: Ledger,
    /// Errors of mass and of the momenta of grains and continuum, relative.
    pub ledger_errors: [f64; 3],
    /// Work of the exchange on the grains (J).
    pub work: Work,
    /// Settings in use.
    pub settings: Resolved,
    /// Steps for which forces on grains were held, and steps from exchange to exchange.
    pub steps_held: [u64; 2],
    /// Grains left, the fixed ones included, and cells.
    pub sizes: [usize; 2],
    /// Steps of all grains together, and of all cells.
    pub work_done: [u64; 2],
    /// Heights at the end (m): of the inner edge a, the handshake surface m, the edge b, and the continuum's surface.
    pub heights: [f64; 4],
    /// Grains and contacts at the end.
    pub snapshot: Snapshot,
    /// Hash of grains and continuum.
    pub state_hash: String,
}
