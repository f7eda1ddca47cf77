//! The grid of the continuum around a bowl of grains, and the grains seen from its cells.
//!
//! With hats h_c over the centres of cells, which add up to one,
//!
//! ```text
//! M = Σ m h_c,   v̄ = Σ m v h_c/M,   σ V = Σ_contacts f ⊗ l h_c − Σ m v′ ⊗ v′ h_c
//! ```
//! l from the centre of the grain that f acts on to that of its partner, h_c at the middle of it, V the volume of a
//! cell.

use crate::overlap::joint::{beside, lines, vector_over as over};
use colluvium_dem::{GrainSample, Snapshot};
use nalgebra::{Matrix3, Vector3};

/// Cells of a bed in space, x fastest and z slowest (SI).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cells {
    /// How many along each axis.
    pub counts: [usize; 3],
    /// Lower corner of the first (m).
    pub low: [f64; 3],
    /// Edges of a cell (m).
    pub spacing: [f64; 3],
}

impl Cells {
    /// How many there are.
    pub fn count(&self) -> usize {
        self.counts.iter().product()
    }

    /// Volume of a cell (m³).
    pub fn volume(&self) -> f64 {
        self.spacing.iter().product()
    }

    /// Area of a face across an axis (m²).
    pub fn face_area(&self, axis: usize) -> f64 {
        self.volume() / self.spacing[axis]
    }

    /// Place of a cell along each axis.
    pub fn index(&self, cell: usize) -> [usize; 3] {
        let [nx, ny, _] = self.counts;
        [cell % nx, cell / nx % ny, cell / (nx * ny)]
    }

    /// The cell at such a place.
    pub fn cell(&self, [i, j, k]: [usize; 3]) -> usize {
        i + self.counts[0] * (j + self.counts[1] * k)
    }

    /// Centre of a cell (m).
    pub fn centre(&self, cell: usize) -> Vector3<f64> {
        let index = self.index(cell);
        Vector3::from_fn(|axis, _| self.low[axis] + (index[axis] as f64 + 0.5) * self.spacing[axis])
    }

    /// The cell above one, if there is one.
    pub fn above(&self, cell: usize) -> Option<usize> {
        let above = cell + self.counts[0] * self.counts[1];
        (above < self.count()).then_some(above)
    }

    /// Distance from the first cells' lower faces along an axis, in cells.
    pub fn offset(&self, axis: usize, at: f64) -> f64 {
        (at - self.low[axis]) / self.spacing[axis]
    }

    /// Cells before and behind a place along an axis with their hats, from the first to the last that there are.
    pub fn along(&self, axis: usize, at: f64, ends: [usize; 2]) -> [(usize, f64); 2] {
        beside(self.offset(axis, at) - 0.5, ends)
    }

    /// The cells around a place with their hats; beyond the grid they are those at its edge.
    pub fn hats(&self, at: &Vector3<f64>) -> [(usize, f64); 8] {
        let axes = [0, 1, 2].map(|axis| self.along(axis, at[axis], [0, self.counts[axis] - 1]));
        std::array::from_fn(|n| {
            let [x, y, z] = [axes[0][n % 2], axes[1][n / 2 % 2], axes[2][n / 4]];
            (self.cell([x.0, y.0, z.0]), x.1 * y.1 * z.1)
        })
    }
}

/// Sums over the grains that cover a cell.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Cover {
    /// Mass M (kg).
    pub mass: f64,
    /// Σ m v h (N s).
    pub momentum: Vector3<f64>,
}

impl Cover {
    /// Mean velocity (m/s); zero without grains.
    pub fn velocity(&self) -> Vector3<f64> {
        over(self.momentum, self.mass)
    }
}

/// What cells know of the grains.
#[derive(Clone, Debug, Default)]
pub struct Sums {
    /// Of the grains as they are now.
    pub cover: Vec<Cover>,
    /// σ averaged in time, positive in tension (Pa).
    pub stress: Vec<Matrix3<f64>>,
    instant: Vec<Matrix3<f64>>,
}

impl Sums {
    /// Nothing, on these cells.
    pub fn nothing(cells: &Cells) -> Self {
        Self {
            cover: vec![Cover::default(); cells.count()],
            stress: vec![Matrix3::zeros(); cells.count()],
            instant: vec![Matrix3::zeros(); cells.count()],
        }
    }

    /// Sums masses and velocities of the grains that belong to the bed.
    pub fn cover(
        &mut self,
        cells: &Cells,
        snapshot: &Snapshot,
        belongs: impl Fn(&GrainSample) -> bool,
    ) {
        self.cover.fill(Cover::default());
        for grain in snapshot.grains.iter().filter(|grain| belongs(grain)) {
            for (cell, hat) in cells.hats(&grain.position) {
                let (cover, mass) = (&mut self.cover[cell], grain.mass * hat);
                cover.mass += mass;
                cover.momentum += mass * grain.velocity;
            }
        }
    }

    /// Takes the stresses of now into the averages with this weight; what does not belong to the bed is wall.
    pub fn press(
        &mut self,
        cells: &Cells,
        snapshot: &Snapshot,
        weight: f64,
        belongs: impl Fn(&GrainSample) -> bool,
    ) {
        self.instant.fill(Matrix3::zeros());
        let per_volume = 1.0 / cells.volume();
        let mut add = |hats: [(usize, f64); 8], tensor: Matrix3<f64>| {
            for (cell, hat) in hats {
                self.instant[cell] += hat * tensor;
            }
        };
        for [middle, force, line] in lines(snapshot, &belongs) {
            let tensor = per_volume * force * line.transpose();
            add(cells.hats(&middle), 0.5 * (tensor + tensor.transpose()));
        }
        for grain in snapshot.grains.iter().filter(|grain| belongs(grain)) {
            let hats = cells.hats(&grain.position);
            let mean: Vector3<f64> = hats
                .iter()
                .map(|&(cell, hat)| hat * self.cover[cell].velocity())
                .sum();
            let own = grain.velocity - mean;
            add(hats, -grain.mass * per_volume * own * own.transpose());
        }
        for (mean, now) in self.stress.iter_mut().zip(&self.instant) {
            *mean += weight * (now - *mean);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const CELLS: Cells = Cells {
        counts: [5, 4, 3],
        low: [-1.0, 0.5, 0.0],
        spacing: [0.5, 0.4, 0.25],
    };

    #[test]
    fn hats_add_up_to_one_and_interpolate_linearly_inside() {
        let linear = |at: [f64; 3]| 3.0 * at[0] - at[1] + 0.5 * at[2];
        let centre = |cell: usize| {
            let index = CELLS.index(cell);
            [0, 1, 2].map(|axis| CELLS.low[axis] + (index[axis] as f64 + 0.5) * CELLS.spacing[axis])
        };
        for (at, inside) in [
            ([-0.3, 1.2, 0.4], true),
            ([0.7, 1.9, 0.2], true),
            ([-5.0, 9.0, 0.3], false),
        ] {
            let hats = CELLS.hats(&at.into());
            let sum: f64 = hats.iter().map(|h| h.1).sum();
            assert!((sum - 1.0).abs() < 1e-14);
            let value: f64 = hats
                .iter()
                .map(|&(cell, hat)| hat * linear(centre(cell)))
                .sum();
            assert!(!inside || (value - linear(at)).abs() < 1e-13, "{at:?}");
        }
        for cell in 0..CELLS.count() {
            assert_eq!(CELLS.cell(CELLS.index(cell)), cell);
        }
    }
}
