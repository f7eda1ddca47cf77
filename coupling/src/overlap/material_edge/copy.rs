//! The continuum's copy beyond the handshake surface is made anew from the grains at every exchange.
//!
//! What lies there is not counted, so it may be what the grains say: in each column of cells it reaches as high as
//! the grains' volume at the continuum's solid fraction, and forward as far as labels do,
//!
//! ```text
//! f = clamp(H_i/h − k, 0, 1) M(ξ < ξ_a)/M,      H_i = Σ_k M/(ρ h W)
//! ```
//! and its velocity follows theirs (`following.rs`); faces at or below the ground's level stay. So the surface at ξ_a moves as
//! the grains do, no matter comes loose from it, and the copy weighs what they weigh. Volume and momentum that this adds are booked. Between two exchanges matter does come loose from the copy's end, by little and
//! fast; it is made anew before it gets anywhere, and the next step's length must not remember how fast it was.

use super::{Continuum, MaterialEdge, OverlapError};
use crate::overlap::following::{Following, LEAST};
use crate::overlap::joint::over;
use nalgebra::Vector2;

/// A step planned as long as an exchange but for round-off would be made in two halves.
pub(super) const ROUNDED: f64 = 1.0 + 1e-6;

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
        let following = Following {
            counts: self.cells.counts,
            walls: [0, self.cells.below],
            full,
            part,
            unit: units.velocity,
        };
        let cover = &self.sums.cover;
        following.follow(&mut state.velocity, &state.fractions, is_copy, |cell| {
            (cover[cell].mass, cover[cell].momentum)
        });
        continuum.turn(side, &mut state);
        let collapse = &mut continuum.collapse;
        collapse.set_state(state)?;
        let exchange = self.exchange_time() / units.time();
        collapse.flow_mut().renew_step(ROUNDED * exchange);
        self.account.copied += collapse.flow().volume() - before;
        let now = side.in_plane(continuum.momentum());
        self.account.following += Vector2::from(now) - Vector2::from(momentum_before);
        self.look_at(continuum);
        Ok(())
    }
}
