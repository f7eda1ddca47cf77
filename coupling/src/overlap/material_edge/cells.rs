//! Grains seen from the cells of the continuum's grid: mass, labels, velocities and stresses.
//!
//! With hats h_c over the centres of cells, which add up to one,
//!
//! ```text
//! M = Σ m h_c,   ξ̄ = Σ m ξ h_c/M,   v̄ = Σ m v h_c/M,   σ V = Σ_contacts f ⊗ l h_c − Σ m v′ ⊗ v′ h_c
//! ```
//! l from the centre of the grain that f acts on to that of its partner, h_c at the middle of it; V = h² W.

use crate::overlap::joint::{along_axes, beside, lines, over, vector_over};
use colluvium_dem::{GrainSample, Snapshot};
use nalgebra::Vector2;

/// Cells side by side over a floor that is level at z = 0, x fastest (SI).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cells {
    /// How many along x and z.
    pub counts: [usize; 2],
    /// Where the first ones begin along x (m).
    pub low: f64,
    /// Rows below z = 0, for ground that goes down.
    pub below: usize,
    /// Edge of a cell (m).
    pub spacing: f64,
    /// Width of the slab across (m).
    pub slab: f64,
}

impl Cells {
    /// How many there are.
    pub fn count(&self) -> usize {
        self.counts[0] * self.counts[1]
    }

    /// Volume of a cell (m³).
    pub fn volume(&self) -> f64 {
        self.spacing * self.spacing * self.slab
    }

    /// The cells around a place with their hats; beyond the grid they are those at its edge.
    pub fn hats(&self, x: f64, z: f64) -> [(usize, f64); 4] {
        let (columns, rows) = (self.columns(x), self.rows(z));
        std::array::from_fn(|n| {
            let [(i, s), (k, t)] = [columns[n % 2], rows[n / 2]];
            (i + self.counts[0] * k, s * t)
        })
    }

    /// The columns around a place along x with their hats.
    pub fn columns(&self, x: f64) -> [(usize, f64); 2] {
        beside(self.offset(x), [0, self.counts[0] - 1])
    }

    /// The rows around a height with their hats.
    pub fn rows(&self, z: f64) -> [(usize, f64); 2] {
        let place = z / self.spacing - 0.5 + self.below as f64;
        beside(place, [self.below, self.counts[1] - 1])
    }

    /// Lower face of the cells of a column (m).
    pub fn face(&self, column: usize) -> f64 {
        self.low + column as f64 * self.spacing
    }

    /// Centre of the cells of a column (m).
    pub fn centre(&self, column: usize) -> f64 {
        self.low + (column as f64 + 0.5) * self.spacing
    }

    /// Height of the centres of the cells of a row (m).
    pub fn height(&self, row: usize) -> f64 {
        (row as f64 + 0.5 - self.below as f64) * self.spacing
    }

    /// Cells between the centres of the first ones and a place along x.
    pub fn offset(&self, x: f64) -> f64 {
        (x - self.low) / self.spacing - 0.5
    }
}

/// Sums over the grains that cover a cell.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Cover {
    /// Mass M (kg).
    pub mass: f64,
    /// Σ m ξ h (kg m).
    pub label: f64,
    /// Σ m v h along x and z (N s).
    pub momentum: Vector2<f64>,
    /// Mass of the grains that the continuum has a copy of (kg).
    pub copied: f64,
}

impl Cover {
    /// Mean velocity along x and z (m/s); zero without grains.
    pub fn velocity(&self) -> Vector2<f64> {
        vector_over(self.momentum, self.mass)
    }

    /// Mean label (m).
    pub fn label(&self) -> f64 {
        over(self.label, self.mass)
    }
}

/// What cells know of the grains.
#[derive(Clone, Debug, Default)]
pub struct Sums {
    /// Of the grains as they are now.
    pub cover: Vec<Cover>,
    /// σ_xx, σ_zz, σ_xz averaged in time, positive in tension (Pa).
    pub stress: Vec<[f64; 3]>,
    instant: Vec<[f64; 3]>,
}

impl Sums {
    /// Nothing, on these cells.
    pub fn nothing(cells: &Cells) -> Self {
        Self {
            cover: vec![Cover::default(); cells.count()],
            stress: vec![[0.0; 3]; cells.count()],
            instant: vec![[0.0; 3]; cells.count()],
        }
    }

    /// Sums masses, labels and velocities of free grains; `label` is that of a grain, none of one that has none, and
    /// `inner` that at which the continuum's copy ends.
    pub fn cover(
        &mut self,
        cells: &Cells,
        snapshot: &Snapshot,
        inner: f64,
        label: impl Fn(&GrainSample) -> Option<f64>,
    ) {
        self.cover.fill(Cover::default());
        for grain in &snapshot.grains {
            let Some(label) = label(grain) else { continue };
            for (cell, hat) in cells.hats(grain.position.x, grain.position.z) {
                let (cover, mass) = (&mut self.cover[cell], grain.mass * hat);
                cover.mass += mass;
                cover.copied += if label < inner { mass } else { 0.0 };
                cover.label += mass * label;
                cover.momentum += mass * along_axes(&grain.velocity);
            }
        }
    }

    /// Takes the stresses of now into the averages with this weight; what is held in place is wall.
    pub fn press(&mut self, cells: &Cells, snapshot: &Snapshot, weight: f64) {
        self.instant.fill([0.0; 3]);
        let per_volume = 1.0 / cells.volume();
        for [middle, force, line] in lines(snapshot, |grain| !grain.fixed) {
            let tensor = [
                force.x * line.x,
                force.z * line.z,
                0.5 * (force.x * line.z + force.z * line.x),
            ]
            .map(|s| s * per_volume);
            self.add(cells.hats(middle.x, middle.z), tensor);
        }
        for grain in snapshot.grains.iter().filter(|g| !g.fixed) {
            let hats = cells.hats(grain.position.x, grain.position.z);
            let mean = hats.iter();
            let mean = mean.map(|&(cell, hat)| hat * self.cover[cell].velocity());
            let own = along_axes(&grain.velocity) - mean.sum::<Vector2<f64>>();
            let (u, w) = (own[0], own[1]);
            let mass = grain.mass * per_volume;
            self.add(hats, [-mass * u * u, -mass * w * w, -mass * u * w]);
        }
        for (mean, now) in self.stress.iter_mut().zip(&self.instant) {
            for (mean, now) in mean.iter_mut().zip(now) {
                *mean += weight * (now - *mean);
            }
        }
    }

    fn add(&mut self, hats: [(usize, f64); 4], tensor: [f64; 3]) {
        for (cell, hat) in hats {
            for (sum, part) in self.instant[cell].iter_mut().zip(tensor) {
                *sum += hat * part;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const CELLS: Cells = Cells {
        counts: [5, 4],
        low: 0.0,
        below: 0,
        spacing: 0.5,
        slab: 2.0,
    };

    /// Rows below the floor change the numbers of the others and nothing else.
    #[test]
    fn rows_below_the_floor_have_no_grains() {
        let deep = Cells {
            counts: [5, 7],
            below: 3,
            ..CELLS
        };
        for (x, z) in [(0.3, 0.4), (1.25, 0.75), (2.1, 1.7), (0.4, -0.1)] {
            for (own, level) in deep.hats(x, z).into_iter().zip(CELLS.hats(x, z)) {
                assert_eq!(own.0, level.0 + 15);
                assert!((own.1 - level.1).abs() < 1e-14);
            }
        }
        assert_eq!(deep.height(3), CELLS.height(0));
    }

    #[test]
    fn hats_add_up_to_one_and_interpolate_linearly_inside() {
        let linear = |cell: usize| {
            let (i, k) = ((cell % 5) as f64, (cell / 5) as f64);
            3.0 * (i + 0.5) * 0.5 - (k + 0.5) * 0.5
        };
        for (x, z) in [
            (0.3, 0.4),
            (1.25, 0.75),
            (2.1, 1.7),
            (-1.0, 5.0),
            (0.01, 0.01),
        ] {
            let hats = CELLS.hats(x, z);
            let sum: f64 = hats.iter().map(|h| h.1).sum();
            assert!((sum - 1.0).abs() < 1e-14);
            let value: f64 = hats.iter().map(|&(cell, hat)| hat * linear(cell)).sum();
            if (0.25..2.25).contains(&x) && (0.25..1.75).contains(&z) {
                assert!((value - (3.0 * x - z)).abs() < 1e-13, "{x} {z}");
            }
            let rows: f64 = CELLS.rows(z).iter().map(|r| r.1).sum();
            assert!((rows - 1.0).abs() < 1e-14);
        }
    }
}
