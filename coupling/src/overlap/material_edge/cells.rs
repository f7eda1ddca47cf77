//! Grains seen from the cells of the continuum's grid: mass, labels, velocities and stresses.
//!
//! With hats h_c over the centres of cells, which add up to one,
//!
//! ```text
//! M = Σ m h_c,   ξ̄ = Σ m ξ h_c/M,   v̄ = Σ m v h_c/M,   σ V = Σ_contacts f ⊗ l h_c − Σ m v′ ⊗ v′ h_c
//! ```
//! l from the centre of the grain that f acts on to that of its partner, h_c at the middle of it; V = h² W.

use crate::overlap::joint::over;
use colluvium_dem::{GrainSample, Partner, Snapshot};

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
        let [(i, s), (k, t)] = [self.along(0, x), self.along(1, z)];
        std::array::from_fn(|n| {
            let (a, b) = (n % 2, n / 2);
            (i[a] + self.counts[0] * k[b], s[a] * t[b])
        })
    }

    /// The rows around a height with their hats.
    pub fn rows(&self, z: f64) -> [(usize, f64); 2] {
        let (k, t) = self.along(1, z);
        [(k[0], t[0]), (k[1], t[1])]
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

    fn along(&self, axis: usize, at: f64) -> ([usize; 2], [f64; 2]) {
        let place = match axis {
            0 => self.offset(at),
            _ => at / self.spacing - 0.5 + self.below as f64,
        };
        let first = [0, self.below as i64][axis];
        let low = place.floor();
        let share = place - low;
        let last = self.counts[axis] as i64 - 1;
        let index = [0, 1].map(|n| (low as i64 + n).clamp(first, last) as usize);
        (index, [1.0 - share, share])
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
    pub momentum: [f64; 2],
    /// Mass of the grains that the continuum has a copy of (kg).
    pub copied: f64,
    /// Mass of the grains of the buffer (kg), and Σ m (u − v) h over them with the continuum's u at their places.
    pub buffer: f64,
    /// See `buffer` (N s).
    pub buffer_slip: [f64; 2],
    /// Σ I h over them, I = 2 m r²/5 (kg m²), and Σ I ω h about y (N m s).
    pub turning: f64,
    /// See `turning`.
    pub spin: f64,
    /// The same of the inner overlap.
    pub inner: f64,
    /// The same of the inner overlap (N s).
    pub inner_slip: [f64; 2],
}

impl Cover {
    /// Mean velocity along x and z (m/s); zero without grains.
    pub fn velocity(&self) -> [f64; 2] {
        self.momentum.map(|p| over(p, self.mass))
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
                cover.momentum[0] += mass * grain.velocity.x;
                cover.momentum[1] += mass * grain.velocity.z;
            }
        }
    }

    /// Takes the stresses of now into the averages with this weight.
    pub fn press(&mut self, cells: &Cells, snapshot: &Snapshot, weight: f64) {
        self.instant.fill([0.0; 3]);
        let per_volume = 1.0 / cells.volume();
        for contact in &snapshot.contacts {
            let grain = &snapshot.grains[contact.grain];
            let other = match contact.partner {
                Partner::Grain(j) => Some(&snapshot.grains[j]).filter(|other| !other.fixed),
                Partner::Wall(_) | Partner::Body(_) => None,
            };
            // What is held in place is wall: its half of the line is not material.
            let (start, force, branch) = match (grain.fixed, other) {
                (false, Some(_)) => (
                    &grain.position,
                    contact.force,
                    contact.arm - contact.partner_arm,
                ),
                (false, None) => (&grain.position, contact.force, contact.arm),
                (true, Some(other)) => (&other.position, -contact.force, contact.partner_arm),
                (true, None) => continue,
            };
            let middle = start + 0.5 * branch;
            let tensor = [
                force.x * branch.x,
                force.z * branch.z,
                0.5 * (force.x * branch.z + force.z * branch.x),
            ]
            .map(|s| s * per_volume);
            self.add(cells.hats(middle.x, middle.z), tensor);
        }
        for grain in snapshot.grains.iter().filter(|g| !g.fixed) {
            let hats = cells.hats(grain.position.x, grain.position.z);
            let mean = |axis: usize| -> f64 {
                let of = hats.iter();
                of.map(|&(cell, hat)| hat * self.cover[cell].velocity()[axis])
                    .sum()
            };
            let (u, w) = (grain.velocity.x - mean(0), grain.velocity.z - mean(1));
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
