//! What the monitors look at after every exchange.

use super::MaterialEdge;
use super::exchange::STEEPEST;
use super::rows::slopes;
use super::side::in_slab;
use super::witness::Through;
use crate::overlap::joint::{in_three, over};
use crate::overlap::slips::{temperatures, variances};
use crate::overlap::windows::Of;
use colluvium_dem::GrainSample;
use nalgebra::Vector3;

/// How far beyond the edge a grain has escaped, in diameters.
const ESCAPED: f64 = 1.0;

impl MaterialEdge {
    /// Takes in the impulses of what the grains were given.
    pub(super) fn watch_impulses(&mut self) {
        let dt = self.exchange_time();
        let variances = variances(self.met(), self.cells.count(), |g| self.fluctuation(g));
        self.joint.watch_relaxation(&variances);
        for (k, row) in self.held.rows.iter().enumerate() {
            let impulse = in_three(&(row.traction * dt));
            self.joint.windows.add(Of::Traction, k, impulse, [dt, 0.0]);
        }
    }

    /// What goes through the handshake surface as grains. Averages over cells would be too low by what the
    /// shell, which bears forces from outside, has of them.
    fn through_handshake(&self) -> Through {
        Through::of(
            &self.sighting,
            (&self.labels, &self.cells),
            (&self.held.handshake, self.spec.settings.buffer),
            self.spec.case.rheology.diameter,
        )
    }

    /// How many grains lie beyond the edge by more than a diameter, along its normal: where it leans, material at rest below what
    /// has moved lies far behind it along x and close to it all the same.
    fn escaped(&self) -> usize {
        let d = self.spec.case.rheology.diameter;
        let places: Vec<f64> = self.held.rows.iter().map(|row| row.place).collect();
        let slopes = slopes(&places, &self.cells);
        let far = |g: &&GrainSample| {
            let rows = self.cells.rows(g.position.z);
            let at = |of: &[f64]| rows.iter().map(|&(row, hat)| hat * of[row]).sum::<f64>();
            let behind = (at(&places) - g.position.x) / 1.0_f64.hypot(at(&slopes));
            self.labels.of(g).is_some() && behind > ESCAPED * d
        };
        self.sighting.snapshot.grains.iter().filter(far).count()
    }

    /// Velocity of a grain less the mean velocity of the cells around it, v′ (m/s).
    pub(super) fn fluctuation(&self, grain: &GrainSample) -> Vector3<f64> {
        let mut about = grain.velocity;
        for (cell, hat) in self.cells.hats(grain.position.x, grain.position.z) {
            let mean = self.sums.cover[cell].velocity();
            about -= hat * in_slab(mean);
        }
        about
    }

    /// Looks at both sides of the handshake surface.
    pub(super) fn watch(&mut self) {
        let columns = self.cells.counts[0];
        let dt = self.exchange_time();
        let variances = variances(self.met(), self.cells.count(), |g| self.fluctuation(g));
        let (mut pressed, mut leaning) = (0.0, 0.0);
        let slopes = slopes(&self.held.handshake, &self.cells);
        for (k, &place) in self.held.handshake.iter().enumerate() {
            let Some((fraction, [xx, _, xz], _)) = self.view.across(&self.cells, place, k) else {
                continue;
            };
            for (column, hat) in self.cells.columns(place) {
                let cell = column + columns * k;
                let slip = &self.joint.slips[cell];
                let weights = [slip.mass() * hat, variances[cell][1] * hat * hat];
                let slip = in_three(&(slip.both() * hat * dt));
                self.joint
                    .windows
                    .add(Of::Slip, cell, slip, weights.map(|w| w * dt));
            }
            pressed -= fraction * xx;
            leaning += fraction * xz * slopes[k].clamp(-STEEPEST, STEEPEST);
        }
        let area = self.cells.spacing * self.spec.slab;
        let through = self.through_handshake();
        let full = self.full();
        let (mut packed, mut cells) = (0.0, 0.0);
        for (cell, cover) in self.sums.cover.iter().enumerate() {
            let own = self.joint.slips[cell].mass();
            // Cells all of whose grains belong to the overlap, with continuum on all of them.
            if own > 0.95 * cover.mass && self.view.fraction[cell] > 0.99 && own > 0.5 * full {
                packed += own / full;
                cells += 1.0;
            }
        }
        self.packed += over(packed, cells);
        let escaped = self.escaped();
        let zones = self.spec.zones();
        let temperatures = temperatures(self.labelled(), zones, |g| self.fluctuation(g));
        let force = [through.sum(), (pressed + leaning) * area];
        self.joint.watch(force, escaped, temperatures);
    }
}
