//! What the monitors look at after every exchange.

use super::MaterialEdge;
use super::exchange::STEEPEST;
use super::rows::slopes;
use super::witness::Through;
use crate::overlap::joint::over;
use crate::overlap::windows::Of;
use colluvium_dem::GrainSample;
use nalgebra::Vector3;

/// How far beyond the edge a grain has escaped, in diameters.
const ESCAPED: f64 = 1.0;

impl MaterialEdge {
    /// Takes in the impulses of what the grains were given.
    pub(super) fn watch_impulses(&mut self) {
        let dt = self.exchange_time();
        let variances = self.variances();
        let given = self.given.relaxation.iter().zip(&variances);
        for (cell, (&[x, z], [buffer, _])) in given.enumerate() {
            // Cells that relax nothing have no noise of it, either.
            if [x, z] != [0.0; 2] {
                self.windows.relax(cell, [x, z, 0.0], *buffer, dt);
            }
        }
        for (k, row) in self.held.rows.iter().enumerate() {
            let [x, z] = row.traction.map(|force| force * dt);
            self.windows.add(Of::Traction, k, [x, z, 0.0], [dt, 0.0]);
        }
    }

    /// Variance in a direction of the momenta of the grains that a cell is compared with, if they move independently: of the buffer, and of
    /// the whole overlap (N² s²).
    fn variances(&self) -> Vec<[f64; 2]> {
        let [handshake, inner] = self.spec.zones();
        let mut sums = vec![[0.0; 2]; self.cells.count()];
        for grain in &self.sighting.snapshot.grains {
            let Some(label) = self.labels.of(grain).filter(|label| *label < inner) else {
                continue;
            };
            let hats = self.cells.hats(grain.position.x, grain.position.z);
            if self.view.velocity_at(&hats).is_none() {
                continue;
            }
            let apart = self.fluctuation(grain);
            let square = 0.5 * grain.mass.powi(2) * (apart.x * apart.x + apart.z * apart.z);
            for (cell, hat) in hats {
                let variance = hat * hat * square;
                sums[cell][1] += variance;
                if label < handshake {
                    sums[cell][0] += variance;
                }
            }
        }
        sums
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
            let [u, w] = self.sums.cover[cell].velocity();
            about -= hat * Vector3::new(u, 0.0, w);
        }
        about
    }

    /// Granular temperature ⟨v′²⟩/3 about the mean velocity of the cells around each grain: of the buffer, of the inner overlap,
    /// and of grains beyond it up to its width (m²/s²).
    fn temperatures(&self) -> [f64; 3] {
        let [handshake, inner] = self.spec.zones();
        let ends = [handshake, inner, 2.0 * inner - handshake];
        let mut sums = [[0.0; 2]; 3];
        for grain in &self.sighting.snapshot.grains {
            let label = self.labels.of(grain);
            let Some(zone) = label.and_then(|label| ends.iter().position(|end| label < *end))
            else {
                continue;
            };
            sums[zone][0] += grain.mass * self.fluctuation(grain).norm_squared() / 3.0;
            sums[zone][1] += grain.mass;
        }
        sums.map(|[energy, mass]| over(energy, mass))
    }

    /// Looks at both sides of the handshake surface.
    pub(super) fn watch(&mut self) {
        let columns = self.cells.counts[0];
        let dt = self.exchange_time();
        let variances = self.variances();
        let (mut pressed, mut leaning) = (0.0, 0.0);
        let slopes = slopes(&self.held.handshake, &self.cells);
        for (k, &place) in self.held.handshake.iter().enumerate() {
            let Some((fraction, [xx, _, xz], _)) = self.view.across(&self.cells, place, k) else {
                continue;
            };
            let at = self.cells.offset(place);
            let low = at.floor();
            let hats = [(0, 1.0 - (at - low)), (1, at - low)];
            for (n, hat) in hats {
                let i = (low as i64 + n).clamp(0, columns as i64 - 1) as usize;
                let cell = i + columns * k;
                let cover = &self.sums.cover[cell];
                let mass = cover.buffer + cover.inner;
                let [x, z] =
                    [0, 1].map(|a| (cover.buffer_slip[a] + cover.inner_slip[a]) * hat * dt);
                let weights = [mass * hat, variances[cell][1] * hat * hat];
                self.windows
                    .add(Of::Slip, cell, [x, z, 0.0], weights.map(|w| w * dt));
            }
            pressed -= fraction * xx;
            leaning += fraction * xz * slopes[k].clamp(-STEEPEST, STEEPEST);
        }
        let area = self.cells.spacing * self.spec.slab;
        let through = self.through_handshake();
        let full = self.full();
        let (mut packed, mut cells) = (0.0, 0.0);
        for (cell, cover) in self.sums.cover.iter().enumerate() {
            let own = cover.buffer + cover.inner;
            // Cells all of whose grains belong to the overlap, with continuum on all of them.
            if own > 0.95 * cover.mass && self.view.fraction[cell] > 0.99 && own > 0.5 * full {
                packed += own / full;
                cells += 1.0;
            }
        }
        let escaped = self.escaped() as f64;
        let temperatures = self.temperatures();
        let m = &mut self.monitors;
        self.windows.pass(dt, &mut m.windows);
        m.exchanges += 1.0;
        m.force[0] += through.sum();
        m.force[1] += (pressed + leaning) * area;
        m.packing += over(packed, cells);
        m.escaped = m.escaped.max(escaped);
        for (sum, temperature) in m.temperature.iter_mut().zip(temperatures) {
            *sum += temperature;
        }
    }
}
