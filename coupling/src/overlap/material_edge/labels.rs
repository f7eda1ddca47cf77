//! Labels of grains: where in the overlap each of them is.
//!
//! A label is given once and says how far from the edge a grain lies in the material, however that has deformed. What
//! leaves its neighbours, a grain that rolls off the heap's surface or falls along its back, takes its label along to
//! where it says nothing any more: with the label of the shell it would bear the continuum's traction amid grains that
//! bear none, and its displacement would carry away the mean that says where the edge is. Such labels are *renewed*: in
//! coordinates ζ that are 0, ξ_m and ξ_a on the edge and on the surfaces of those labels, row by row,
//!
//! ```text
//! ξ ← max(ζ, 0)   where |ζ − ξ| > b and min(ζ, ξ) < ξ_a,      b the width of the shell
//! ```

use super::cells::Cells;
use super::exchange::LEAST_ROW;
use super::rows::displacements;
use super::{MaterialEdge, MaterialEdgeSpec};
use colluvium_dem::GrainSample;

/// Stands for the label of what has none.
pub(super) const NO_LABEL: f64 = f64::MAX;
/// Overlaps squeezed to less than this part of their width say nothing of labels.
const SQUEEZED: f64 = 0.2;

/// Half width in diameters of the band of labels in which a surface is looked for.
const BAND: f64 = 1.0;

/// Labels of grains: distances from the edge along x when they were given, at the start or when the edge moved on.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Labels {
    /// By grain number; [`NO_LABEL`] for what has none (m).
    pub given: Vec<f64>,
    /// Where the edge was then, row by row (m).
    pub base: Vec<f64>,
    /// How far it has moved on since the start (m).
    pub edge: f64,
}

impl Labels {
    /// Distance of a grain's label from that of the edge (m); none of what has none.
    pub fn of(&self, grain: &GrainSample) -> Option<f64> {
        let label = self.given.get(grain.id as usize).copied();
        label.filter(|label| *label < NO_LABEL && !grain.fixed)
    }

    /// The label that a grain was given; none of what never had one.
    pub fn given_to(&mut self, grain: u32) -> Option<&mut f64> {
        let label = self.given.get_mut(grain as usize);
        label.filter(|label| **label < NO_LABEL)
    }

    /// Where the surface of a label is, row by row (m): its place at the start, moved by the mean displacement of
    /// the grains of nearby labels.
    pub fn surface(
        &self,
        cells: &Cells,
        grains: &[GrainSample],
        label: f64,
        spec: &MaterialEdgeSpec,
    ) -> Vec<f64> {
        let band = BAND * spec.case.rheology.diameter;
        let mut sums = vec![[0.0; 2]; cells.counts[1]];
        for grain in grains {
            let Some(own) = self.of(grain) else {
                continue;
            };
            if (own - label).abs() < band {
                let base = self.base_at(cells, grain.position.z);
                let moved = grain.position.x - base - own;
                for (row, hat) in cells.rows(grain.position.z) {
                    sums[row][0] += grain.mass * hat;
                    sums[row][1] += grain.mass * hat * moved;
                }
            }
        }
        let least = LEAST_ROW * spec.density() * band * cells.spacing * spec.slab;
        let moved = displacements(&sums, least).into_iter();
        moved
            .zip(&self.base)
            .map(|(moved, base)| base + label + moved)
            .collect()
    }

    /// Renews the labels of grains that are not among their neighbours any more, where surfaces with the labels `at` lie
    /// at `places` row by row, and says how many.
    pub fn renew(
        &mut self,
        cells: &Cells,
        grains: &[GrainSample],
        places: [&[f64]; 3],
        (at, shell): ([f64; 3], f64),
    ) -> f64 {
        let inner = at[2];
        let mut renewed = 0.0;
        for grain in grains {
            let Some(label) = self.of(grain) else {
                continue;
            };
            let rows = cells.rows(grain.position.z);
            let here = places.map(|of| rows.iter().map(|&(row, hat)| hat * of[row]).sum::<f64>());
            let is_squeezed = |k: usize| here[k + 1] - here[k] < SQUEEZED * (at[k + 1] - at[k]);
            if is_squeezed(0) || is_squeezed(1) {
                continue;
            }
            let now = coordinate(grain.position.x, here, at);
            if (now - label).abs() > shell && now.min(label) < inner {
                self.given[grain.id as usize] = now.max(0.0);
                renewed += 1.0;
            }
        }
        renewed
    }

    /// Where the edge was at a height when labels were given (m).
    pub fn base_at(&self, cells: &Cells, z: f64) -> f64 {
        let rows = cells.rows(z).into_iter();
        rows.map(|(row, hat)| hat * self.base[row]).sum()
    }
}

/// Coordinate of a place between surfaces at `places` with the labels `at`, rising both; beyond them at the distance
/// from the first or the last.
fn coordinate(x: f64, places: [f64; 3], at: [f64; 3]) -> f64 {
    let k = match x {
        x if x < places[0] => return at[0] + x - places[0],
        x if x > places[2] => return at[2] + x - places[2],
        x => usize::from(x > places[1]),
    };
    at[k] + (x - places[k]) / (places[k + 1] - places[k]) * (at[k + 1] - at[k])
}

impl MaterialEdge {
    /// Renews the labels of what is not among its neighbours any more.
    pub(super) fn renew_labels(&mut self) {
        let [handshake, inner] = self.spec.zones();
        let edge: Vec<f64> = self.held.rows.iter().map(|row| row.place).collect();
        let far = self.surface_of(inner);
        let places = [&edge, &self.held.handshake, &far].map(Vec::as_slice);
        let at = ([0.0, handshake, inner], self.spec.settings.shell);
        let grains = &self.sighting.snapshot.grains;
        self.renewed += self.labels.renew(&self.cells, grains, places, at);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn coordinates_go_with_the_surfaces() {
        let (places, at) = ([1.0, 3.0, 9.0], [0.0, 3.0, 6.0]);
        for (x, expected) in [
            (0.5, -0.5),
            (1.0, 0.0),
            (2.0, 1.5),
            (6.0, 4.5),
            (9.0, 6.0),
            (9.5, 6.5),
        ] {
            assert!((coordinate(x, places, at) - expected).abs() < 1e-15, "{x}");
        }
    }
}
