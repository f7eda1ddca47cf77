//! The continuum's copy beyond the handshake surface is made anew from the grains at every exchange.
//!
//! What lies there is not counted, so it may be what the grains say: in each column of cells its surface rises and
//! falls with the mass of the grains above it, and it ends at ξ_a,
//!
//! ```text
//! f = clamp(H_i/h − k, 0, 1) for ξ < ξ_a, else 0,      H_i = H + (M_i − M_i(0))/(ρ A)
//! ```
//! and its velocity follows theirs, u += (1 − e^{−Δt/t_f}) (v̄ − u), at once on faces beside no full cell. The volume
//! that this adds is booked.

use super::{Bowl, OverlapError};
use crate::overlap::joint::vector_over as over;

/// Cells with less than this part of a full cell's mass in grains have no velocity to follow.
const LEAST: f64 = 0.05;

impl Bowl {
    /// Makes the copy anew, after a time (s) with the last one.
    pub(super) fn copy_the_grains(&mut self, dt: f64) -> Result<(), OverlapError> {
        let before = self.flow.volume();
        let mut state = self.flow.state().clone();
        let (cells, zone) = (&self.layout.cells, &self.layout.zone);
        let [handshake, inner] = self.layout.widths;
        let full = self.full();
        let unit = self.units.velocity;
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
        for axis in 0..3 {
            let mut counts = cells.counts;
            counts[axis] += 1;
            let step = cells.counts[..axis].iter().product::<usize>();
            for (face, u) in state.velocity[axis].iter_mut().enumerate() {
                let index = [
                    face % counts[0],
                    face / counts[0] % counts[1],
                    face / (counts[0] * counts[1]),
                ];
                // Faces on the edges of the grid are walls.
                if index[axis] == 0 || index[axis] == cells.counts[axis] {
                    continue;
                }
                let high = cells.cell(index);
                let pair = [high - step, high];
                if !pair.into_iter().all(is_copy) {
                    continue;
                }
                let covers = pair.map(|cell| &self.sums.cover[cell]);
                let mass = covers[0].mass + covers[1].mass;
                if mass < LEAST * full {
                    *u = 0.0;
                    continue;
                }
                let mean = over(covers[0].momentum + covers[1].momentum, mass)[axis] / unit;
                let is_inside = pair.into_iter().any(|cell| state.fractions[cell] > 0.5);
                *u += if is_inside { part } else { 1.0 } * (mean - *u);
            }
        }
        self.flow.set_state(state)?;
        self.flow
            .renew_step(self.exchange_time() / self.units.time());
        self.account.copied += self.flow.volume() - before;
        self.view
            .look(&self.flow, &self.layout.cells, &self.units, 0.0);
        Ok(())
    }
}
