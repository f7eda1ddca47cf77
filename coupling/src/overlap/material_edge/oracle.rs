//! Where grains are needed behind an edge that moves.

use super::MaterialEdge;
use super::travel::Travel;
use crate::overlap::dense_limits::{Dilution, LEAST_PRESSURE, Reason};
use crate::overlap::joint::over;

impl MaterialEdge {
    /// Why the strip behind the edge has to be grains, asked in this order: it moves; the grains of the inner overlap are loose,
    /// or warm; it is sheared too fast.
    pub(super) fn needs_grains(&self, travel: &Travel) -> Option<(Reason, f64)> {
        let speed = self.continuum_speed(travel.width);
        let moves = (speed > travel.wake).then_some((Reason::Speed, speed));
        let dense = &travel.dense;
        let dilute = || dense.of_grains(|| self.dilution());
        let fast = || dense.of_continuum(|| self.inertial_behind(travel.width));
        moves.or_else(dilute).or_else(fast)
    }

    /// The full cells of continuum within a width (m) behind the edge.
    fn strip_behind(&self, width: f64) -> impl Iterator<Item = usize> {
        let columns = self.cells.counts[0];
        let rows = self.held.rows.iter().enumerate();
        rows.flat_map(move |(k, row)| {
            let within = row.place - width..=row.place;
            let columns = (0..columns).filter(move |&i| within.contains(&self.cells.centre(i)));
            columns.map(move |i| i + self.cells.counts[0] * k)
        })
        .filter(|&cell| self.view.is_full(cell))
    }

    /// Rms speed of that (m/s).
    fn continuum_speed(&self, width: f64) -> f64 {
        let (mut sum, mut weight) = (0.0, 0.0);
        for cell in self.strip_behind(width) {
            sum += self.view.velocity[cell].norm_squared();
            weight += 1.0;
        }
        over(sum, weight).sqrt()
    }

    /// Whether the cell above one is full, too: at the surface there is no pressure to speak of.
    fn is_beneath(&self, cell: usize) -> bool {
        let above = cell + self.cells.counts[0];
        above < self.cells.count() && self.view.is_full(above)
    }

    /// ρ g h/2 (Pa).
    fn least_pressure(&self) -> f64 {
        LEAST_PRESSURE * self.spec.density() * self.spec.case.gravity * self.cells.spacing
    }

    /// I of the cells behind the edge.
    fn inertial_behind(&self, width: f64) -> Vec<f64> {
        let law = &self.spec.case.rheology;
        let least = self.least_pressure();
        self.strip_behind(width)
            .filter(|&cell| self.is_beneath(cell))
            .map(|cell| {
                let rate = self.view.shear_rate(&self.cells, cell);
                let pressure = self.view.pressure[cell].max(least);
                rate * law.diameter * (law.grain_density / pressure).sqrt()
            })
            .collect()
    }

    /// Of the inner overlap; none where nothing lies beneath the surface there.
    fn dilution(&self) -> Option<Dilution> {
        let [handshake, inner] = self.spec.zones();
        let chosen = |cell: usize| {
            let cover = &self.sums.cover[cell];
            cover.mass > 0.0
                && (handshake..inner).contains(&cover.label())
                && self.view.is_full(cell)
                && self.is_beneath(cell)
        };
        let (mut count, mut mass, mut pressure) = (0.0, 0.0, 0.0);
        for cell in (0..self.cells.count()).filter(|&cell| chosen(cell)) {
            count += 1.0;
            mass += self.sums.cover[cell].mass;
            pressure += self.view.pressure[cell].max(0.0);
        }
        if count == 0.0 {
            return None;
        }
        let mut energy = 0.0;
        for grain in &self.sighting.snapshot.grains {
            if self.labels.of(grain).is_none() {
                continue;
            }
            let hats = self.cells.hats(grain.position.x, grain.position.z);
            let here: f64 = hats.iter().filter(|h| chosen(h.0)).map(|h| h.1).sum();
            if here > 0.0 {
                energy += here * grain.mass * self.fluctuation(grain).norm_squared() / 3.0;
            }
        }
        let kinetic = energy / (count * self.cells.volume());
        Some(Dilution {
            packing: mass / (count * self.full()),
            kinetic: kinetic / (pressure / count).max(self.least_pressure()),
        })
    }
}
