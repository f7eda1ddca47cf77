//! Plane columns of the field's comparisons, and the profiles of their heaps.
//!
//! The peer is Basilisk C 25-02-26 (own runs, serial, one core of an EPYC under load, ±30 %), which moves air of a
//! thousandth of the density, too. A film of it under the front carries the front farther, so that its figures are no truth.

use colluvium_continuum::column_collapse::{Collapse, CollapseCase};
use colluvium_continuum::rheology::MuI;

/// A column of the field's comparisons, μ_s 0.32, Δμ 0.28, I_0 0.4.
pub struct Column {
    /// H/L.
    pub aspect: f64,
    /// H over the diameter of grains.
    pub grains: f64,
    /// Length of the grid over H.
    pub length: f64,
    /// Cells along x where nobody says how many.
    pub cells: usize,
    /// (x_f − L)/L of the peer at t = 1 … 6 √(H/g), where h = H/100, by its cells along x.
    pub peer: &'static [(usize, [f64; 6])],
    /// By the peer's cells along x: its processor time to t = 6 √(H/g) (s), and how far its heap at t = 6 lies from that on twice as
    /// many cells, ∫|h_N − h_2N| dx over the column's area.
    pub peer_changes: &'static [(usize, f64, f64)],
}

impl Column {
    /// The collapse on so many cells along x, in units of H and g.
    pub fn case(&self, cells: usize) -> CollapseCase {
        CollapseCase {
            aspect: self.aspect,
            height: 1.0,
            gravity: 1.0,
            rheology: MuI::new(0.32, 0.60, 0.4, 1.0 / self.grains, 1.0, 1.0),
            cells,
            length_scaled: self.length,
            overhang_degrees: 0.0,
        }
    }
}

/// The three of them.
pub const COLUMNS: [Column; 3] = [
    Column {
        aspect: 0.5,
        grains: 30.0,
        length: 5.0,
        cells: 256,
        peer: &[
            (128, [0.200, 0.586, 0.820, 0.936, 0.995, 1.020]),
            (256, [0.212, 0.623, 0.906, 1.060, 1.136, 1.158]),
            (512, [0.212, 0.646, 0.921, 1.064, 1.131, 1.157]),
        ],
        peer_changes: &[(128, 3.0, 3.15e-2), (256, 12.6, 1.24e-2)],
    },
    Column {
        aspect: 1.42,
        grains: 65.0,
        length: 5.0,
        cells: 256,
        peer: &[
            (128, [0.640, 1.844, 2.713, 3.154, 3.393, 3.566]),
            (256, [0.650, 1.971, 3.000, 3.545, 3.772, 3.834]),
            (512, [0.640, 1.976, 3.003, 3.660, 3.923, 4.014]),
        ],
        peer_changes: &[(128, 3.0, 4.60e-2), (256, 12.5, 4.86e-2)],
    },
    Column {
        aspect: 6.26,
        grains: 134.0,
        length: 3.75,
        cells: 384,
        peer: &[
            (192, [2.419, 7.320, 11.587, 13.783, 14.111, 13.519]),
            (384, [2.538, 7.260, 11.367, 13.911, 14.927, 14.902]),
        ],
        peer_changes: &[(192, 8.2, 1.00e-1)],
    },
];

/// Heights of a heap at even places.
#[derive(Default)]
pub struct Profile {
    /// Their middles.
    pub x: Vec<f64>,
    /// Mean heights about them.
    pub h: Vec<f64>,
}

impl Profile {
    /// Of a collapse as it stands.
    pub fn of(collapse: &Collapse) -> Self {
        let (x, h) = collapse.profile();
        Self { x, h }
    }

    fn spacing(&self) -> f64 {
        self.x[1] - self.x[0]
    }

    /// Mean height from `low` to `high`, each height being that of its interval.
    fn mean(&self, low: f64, high: f64) -> f64 {
        let half = 0.5 * self.spacing();
        let parts = self.x.iter().zip(&self.h).map(|(x, h)| {
            let overlap = (high.min(x + half) - low.max(x - half)).max(0.0);
            overlap * h
        });
        parts.sum::<f64>() / (high - low)
    }

    /// ∫|h − h_other| dx on the coarser of both.
    pub fn apart(&self, other: &Self) -> f64 {
        let (coarse, fine) = if self.spacing() > other.spacing() {
            (self, other)
        } else {
            (other, self)
        };
        let spacing = coarse.spacing();
        let misses = coarse.x.iter().zip(&coarse.h).map(|(x, h)| {
            let mean = fine.mean(x - 0.5 * spacing, x + 0.5 * spacing);
            (h - mean).abs() * spacing
        });
        misses.sum()
    }
}
