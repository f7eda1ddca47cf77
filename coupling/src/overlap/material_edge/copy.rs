//! The continuum's copy beyond the handshake surface is made anew from the grains at every exchange.
//!
//! What lies there is not counted, so it may be what the grains say: in each column of cells it reaches as high as
//! the grains' volume at the continuum's solid fraction, and forward as far as labels do,
//!
//! ```text
//! f = clamp(H_i/h − k, 0, 1) M(ξ < ξ_a)/M,      H_i = Σ_k M/(ρ h W)
//! ```
//! and its velocity follows theirs, u += (1 − e^{−Δt/t_f}) (v̄ − u), at once on faces beside no full cell. So the
//! surface at ξ_a moves as the grains do, no matter comes loose from it, and the copy weighs what they weigh. Volume
//! and momentum that this adds are booked. Between two exchanges matter does come loose from the copy's end, by little and
//! fast; it is made anew before it gets anywhere, and the next step's length must not remember how fast it was.

use super::{Continuum, MaterialEdge, OverlapError};
use crate::overlap::joint::over;

/// A step planned as long as an exchange but for round-off would be made in two halves.
pub(super) const ROUNDED: f64 = 1.0 + 1e-6;
/// Cells with less than this part of a full cell's mass in grains have no velocity to follow.
const LEAST: f64 = 0.05;

impl MaterialEdge {
    /// Makes the copy anew, after a time (s) with the last one.
    pub(super) fn copy_the_grains(
        &mut self,
        continuum: &mut Continuum,
        dt: f64,
    ) -> Result<(), OverlapError> {
        let side = self.spec.side;
        let before = continuum.collapse.flow().volume();
        let momentum_before = side.in_plane(continuum.momentum());
        let [columns, rows] = self.cells.counts;
        let mut state = continuum.collapse.flow().state().clone();
        continuum.turn(side, &mut state);
        let full = self.spec.density() * self.cells.volume();
        let units = *continuum.collapse.units();
        let is_copy = |cell: usize| {
            let (i, k) = (cell % columns, cell / columns);
            // Heights of grains count from z = 0: where ground is not level there is no copy of them.
            self.cells.face(i) >= self.held.handshake[k].max(self.level)
        };
        for i in 0..columns {
            let column = (0..rows).map(|k| self.sums.cover[i + columns * k].mass);
            let height = column.sum::<f64>() / full;
            let mut inside = 0.0;
            for k in 0..rows {
                let cell = i + columns * k;
                let cover = &self.sums.cover[cell];
                if cover.mass > LEAST * full {
                    inside = over(cover.copied, cover.mass);
                }
                if is_copy(cell) {
                    let level = k as f64 - self.cells.below as f64;
                    state.fractions[cell] = match k < self.cells.below {
                        true => 0.0,
                        false => (height - level).clamp(0.0, 1.0) * inside,
                    };
                }
            }
        }
        let part = -(-dt / self.spec.settings.following_time).exp_m1();
        for axis in 0..2 {
            let (width, step) = match axis {
                0 => (columns + 1, 1),
                _ => (columns, columns),
            };
            for (face, u) in state.velocity[axis].iter_mut().enumerate() {
                let (i, k) = (face % width, face / width);
                // Faces on the edges of the grid are walls, and so is the ground below the grains.
                let first = [0, self.cells.below][axis];
                if [i, k][axis] <= first || [i, k][axis] == self.cells.counts[axis] {
                    continue;
                }
                let high = i + columns * k;
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
                let mean =
                    (covers[0].momentum[axis] + covers[1].momentum[axis]) / mass / units.velocity;
                let is_inside = pair.into_iter().any(|cell| state.fractions[cell] > 0.5);
                *u += if is_inside { part } else { 1.0 } * (mean - *u);
            }
        }
        continuum.turn(side, &mut state);
        let collapse = &mut continuum.collapse;
        collapse.set_state(state)?;
        let exchange = self.exchange_time() / units.time();
        collapse.flow_mut().renew_step(ROUNDED * exchange);
        self.account.copied += collapse.flow().volume() - before;
        let now = side.in_plane(continuum.momentum());
        let changes = now.iter().zip(momentum_before);
        for (sum, (now, before)) in self.account.following.iter_mut().zip(changes) {
            *sum += now - before;
        }
        self.look_at(continuum);
        Ok(())
    }
}
