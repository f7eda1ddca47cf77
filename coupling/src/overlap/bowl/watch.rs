//! What the monitors look at after every exchange.

use super::Bowl;
use super::zone::Side;
use crate::overlap::slips::{temperatures, variances};
use crate::overlap::windows::Of;
use colluvium_dem::GrainSample;
use nalgebra::Vector3;

/// Part of a full cell's mass from which on it is bed.
const FILLED: f64 = 0.5;
/// How far beyond the box a grain has escaped, in diameters.
const ESCAPED: f64 = 1.0;

impl Bowl {
    /// Takes in the impulses of what the grains were given.
    pub(super) fn watch_impulses(&mut self) {
        let dt = self.exchange_time();
        let variances = variances(self.met(), self.layout.cells.count(), |g| {
            self.fluctuation(g)
        });
        self.joint.watch_relaxation(&variances);
        for (face, traction) in self.faces.all.iter().zip(&self.held.traction) {
            let impulse = (traction * dt).into();
            self.joint
                .windows
                .add(Of::Traction, face.cells[0], impulse, [dt, 0.0]);
        }
    }

    /// Normal force (N) of the contacts that cross the handshake surface, from the nearest side of the grain outside. Averages over
    /// cells would be too low by what the shell, which bears forces from outside, has of them: a sixth with cells as wide as it.
    fn through_handshake(&self) -> f64 {
        let (cells, zone) = (&self.layout.cells, &self.layout.zone);
        let (belongs, handshake) = (self.spec.belongs(), self.layout.widths[0]);
        let inside =
            |g: &GrainSample| belongs(g).then(|| zone.label(cells, &g.position) > handshake);
        let mut sum = 0.0;
        for (outer, force) in self.sighting.crossing(inside) {
            let depth = |side: &Side| zone.depth(cells, side, &outer.position);
            let sides = zone.sides.iter();
            if let Some(side) = sides.min_by(|a, b| depth(a).total_cmp(&depth(b))) {
                sum -= side.outwards * force[side.axis];
            }
        }
        sum
    }

    /// Velocity of a grain less the mean velocity of the cells around it, v′ (m/s).
    pub(super) fn fluctuation(&self, grain: &GrainSample) -> Vector3<f64> {
        let hats = self.layout.cells.hats(&grain.position).into_iter();
        let mean = hats.map(|(cell, hat)| hat * self.sums.cover[cell].velocity());
        grain.velocity - mean.sum::<Vector3<f64>>()
    }

    /// Looks at both sides of the handshake surface, after a time (s).
    pub(super) fn watch(&mut self, dt: f64) {
        let (cells, zone) = (&self.layout.cells, &self.layout.zone);
        // How many faces of the surface a cell has.
        let mut beside = vec![0.0; cells.count()];
        let mut force = [self.through_handshake(), 0.0];
        for face in &self.handshake.all {
            let axis = zone.sides[face.side].axis;
            let Some((fraction, stress, _)) = self.view.between(face.cells) else {
                continue;
            };
            let area = fraction * cells.face_area(axis);
            force[1] -= area * stress[(axis, axis)];
            for cell in face.cells {
                beside[cell] += 1.0;
            }
        }
        let variances = variances(self.met(), cells.count(), |g| self.fluctuation(g));
        for (cell, &faces) in beside.iter().enumerate().filter(|(_, n)| **n > 0.0) {
            let slip = &self.joint.slips[cell];
            let mass = slip.mass() * faces;
            let slip = slip.both() * faces * dt;
            let weights = [mass, variances[cell][1] * faces * faces];
            self.joint
                .windows
                .add(Of::Slip, cell, slip.into(), weights.map(|w| w * dt));
        }
        let beyond = -ESCAPED * self.spec.law.diameter / self.spec.settings.cell;
        let belongs = self.spec.belongs();
        let escaped = self.sighting.snapshot.grains.iter();
        let escaped = escaped.filter(|g| belongs(g) && zone.label(cells, &g.position) < beyond);
        let escaped = escaped.count();
        let filled = FILLED * self.full();
        for (moved, face) in self.moved.iter_mut().zip(&self.faces.all) {
            let side = &zone.sides[face.side];
            let [out, inside] = face.cells;
            // What flies over the bed is no motion of the box.
            if !self.view.is_full(out) || self.sums.cover[inside].mass < filled {
                continue;
            }
            *moved += side.outwards * self.sums.cover[inside].velocity()[side.axis] * dt;
        }
        let widths = self.layout.widths;
        let temperatures = temperatures(self.labelled(), widths, |g| self.fluctuation(g));
        self.joint.watch(force, escaped, temperatures);
    }
}
