//! How far the grains beside a side of the box are from dense flow.

use super::Bowl;
use super::zone::Side;
use crate::overlap::dense_limits::{Dilution, LEAST_PRESSURE};

impl Bowl {
    /// Of a side's inner overlap; none where nothing lies beneath the surface there.
    pub(super) fn dilution_beside(&self, side: &Side) -> Option<Dilution> {
        let (cells, zone, view) = (&self.layout.cells, &self.layout.zone, &self.view);
        let [handshake, inner] = self.layout.widths;
        let chosen = |cell: usize| {
            let centre = cells.centre(cell);
            let beneath = cells.above(cell).is_some_and(|above| view.is_full(above));
            beneath
                && view.is_full(cell)
                && zone.label(cells, &centre) >= handshake
                && zone.depth(cells, side, &centre) < inner
        };
        let (mut count, mut mass, mut pressure) = (0.0, 0.0, 0.0);
        for cell in (0..cells.count()).filter(|&cell| chosen(cell)) {
            count += 1.0;
            mass += self.sums.cover[cell].mass;
            pressure -= view.stress[cell].trace() / 3.0;
        }
        if count == 0.0 {
            return None;
        }
        let belongs = self.spec.belongs();
        let energy = self.sighting.snapshot.grains.iter();
        let energy = energy.filter(|g| belongs(g)).map(|grain| {
            let hats = cells.hats(&grain.position).into_iter();
            let here: f64 = hats.filter(|h| chosen(h.0)).map(|h| h.1).sum();
            match here > 0.0 {
                true => here * grain.mass * self.fluctuation(grain).norm_squared() / 3.0,
                false => 0.0,
            }
        });
        let least = LEAST_PRESSURE * self.full() * self.spec.gravity / cells.face_area(2);
        let kinetic = energy.sum::<f64>() / (count * cells.volume());
        Some(Dilution {
            packing: mass / (count * self.full()),
            kinetic: kinetic / (pressure / count).max(least),
        })
    }
}
