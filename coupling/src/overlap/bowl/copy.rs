//! The continuum's copy beyond the handshake surface is made anew from the grains at every exchange.
//!
//! What lies there is not counted, so it may be what the grains say: in each column of cells its surface rises and
//! falls with the mass of the grains above it, and it ends at ξ_a,
//!
//! ```text
//! f = clamp(H_i/h − k, 0, 1) for ξ < ξ_a, else 0,      H_i = H + (M_i − M_i(0))/(ρ A)
//! ```
//! and its velocity follows theirs (`following.rs`). The volume that this adds is booked.

use super::{Bowl, OverlapError};
use crate::overlap::following::Following;

impl Bowl {
    /// Makes the copy anew, after a time (s) with the last one.
    pub(super) fn copy_the_grains(&mut self, dt: f64) -> Result<(), OverlapError> {
        let before = self.flow.volume();
        let mut state = self.flow.state().clone();
        let (cells, zone) = (&self.layout.cells, &self.layout.zone);
        let [handshake, inner] = self.layout.widths;
        let full = self.full();
        let is_copy = |cell: usize| zone.label_of_cell(cells.index(cell)) > handshake;
        let layer = cells.counts[0] * cells.counts[1];
        let now = self.column_masses();
        for (cell, fraction) in state.fractions.iter_mut().enumerate() {
            let index = cells.index(cell);
            let label = zone.label_of_cell(index);
            if label > handshake {
                let column = cell % layer;
                let height = self.layout.height / cells.spacing[2]
                    + (now[column] - self.columns[column]) / full;
                let covered = (height - index[2] as f64).clamp(0.0, 1.0);
                *fraction = if label < inner { covered } else { 0.0 };
            }
        }
        let part = -(-dt / self.spec.settings.following_time).exp_m1();
        let following = Following {
            counts: cells.counts,
            walls: [0; 3],
            full,
            part,
            unit: self.units.velocity,
        };
        let cover = &self.sums.cover;
        following.follow(&mut state.velocity, &state.fractions, is_copy, |cell| {
            (cover[cell].mass, cover[cell].momentum)
        });
        self.flow.set_state(state)?;
        self.flow
            .renew_step(self.exchange_time() / self.units.time());
        self.account.copied += self.flow.volume() - before;
        self.view
            .look(&self.flow, &self.layout.cells, &self.units, 0.0);
        Ok(())
    }
}
