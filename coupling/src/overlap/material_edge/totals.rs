//! What there is of both sides, each counted on its own side of the handshake surface.

use super::{MaterialEdge, Side};
use colluvium_continuum::free_surface::CellFields;

impl MaterialEdge {
    /// Fields of the cells with material, copy included, along x and z, each with whether totals count its middle.
    pub fn fields(&self) -> Vec<(CellFields, bool)> {
        let (side, low) = (self.spec.side, self.cells.low);
        let handshake = &self.held.handshake;
        let turned = |mut cell: CellFields| {
            cell.lower[0] += low;
            cell.upper[0] += low;
            let row = (cell.lower[1] / self.cells.spacing).round() as usize;
            let middle = 0.5 * (cell.lower[0] + cell.upper[0]);
            let counted = handshake.get(row).is_none_or(|place| middle < *place);
            if side == Side::Above {
                (cell.lower[0], cell.upper[0]) =
                    (side.along(cell.upper[0]), side.along(cell.lower[0]));
                cell.velocity = side.in_plane(cell.velocity);
                // A shear stress changes its sign in a mirror, a difference of normal stresses does not.
                cell.stress[1] = side.along(cell.stress[1]);
            }
            (cell, counted)
        };
        self.collapse.fields().into_iter().map(turned).collect()
    }

    /// Error of the continuum's volume against what it began with and its copy was given since, relative.
    pub fn volume_error(&self) -> f64 {
        let now = self.collapse.flow().volume();
        let start = now / (1.0 + self.collapse.volume_drift());
        (now - start - self.account.copied) / start
    }

    /// The continuum behind the handshake surface, and what rests behind it, as parcels: places on its own axis (m) and
    /// volumes of grains in them (m³).
    pub fn parcels(&self) -> Vec<[f64; 2]> {
        const PARTS: usize = 4;
        let [columns, rows] = self.cells.counts;
        let places = &self.held.handshake;
        let (h, solid) = (self.cells.spacing, self.spec.case.rheology.solid_fraction);
        let volume = self.cells.volume() * solid / PARTS as f64;
        let fractions = &self.collapse.flow().state().fractions;
        let resting = self.rest_mass / self.spec.case.rheology.grain_density;
        let slices = (PARTS as f64 * self.spec.wall / h).ceil();
        let mut parcels: Vec<[f64; 2]> = (0..slices as usize)
            .map(|slice| {
                let place = (slice as f64 + 0.5) / slices * self.spec.wall;
                [place, resting / slices]
            })
            .collect();
        for (k, &end) in places.iter().enumerate().take(rows) {
            for i in 0..columns {
                let fraction = fractions[i + columns * k];
                if fraction <= 0.0 {
                    continue;
                }
                for part in 0..PARTS {
                    let low = self.cells.face(i) + part as f64 / PARTS as f64 * h;
                    let width = h / PARTS as f64;
                    let share = ((end - low) / width).clamp(0.0, 1.0);
                    if share > 0.0 {
                        parcels.push([low + 0.5 * share * width, fraction * share * volume]);
                    }
                }
            }
        }
        parcels
    }
}
