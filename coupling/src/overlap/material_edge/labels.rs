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

use super::MaterialEdge;
use super::cells::Cells;
use colluvium_dem::GrainSample;

/// Stands for the label of what has none.
pub(super) const NO_LABEL: f64 = f64::MAX;
/// Overlaps squeezed to less than this part of their width say nothing of labels.
const SQUEEZED: f64 = 0.2;

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
        let at = [0.0, handshake, inner];
        let far = self.surface_of(inner);
        let mut renewed = 0.0;
        for grain in &self.sighting.snapshot.grains {
            let Some(label) = self.labels.of(grain) else {
                continue;
            };
            let mut places = [0.0; 3];
            for (row, hat) in self.cells.rows(grain.position.z) {
                let of_row = [
                    self.held.rows[row].place,
                    self.held.handshake[row],
                    far[row],
                ];
                for (place, of_row) in places.iter_mut().zip(of_row) {
                    *place += hat * of_row;
                }
            }
            let is_squeezed = |k: usize| places[k + 1] - places[k] < SQUEEZED * (at[k + 1] - at[k]);
            if is_squeezed(0) || is_squeezed(1) {
                continue;
            }
            let now = coordinate(grain.position.x, places, at);
            if (now - label).abs() > self.spec.settings.shell && now.min(label) < inner {
                self.labels.given[grain.id as usize] = now.max(0.0);
                renewed += 1.0;
            }
        }
        self.monitors.renewed += renewed;
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
