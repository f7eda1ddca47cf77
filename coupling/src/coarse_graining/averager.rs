//! Time averages with block sums, so that every mean has a standard error.

use super::profile::{BalanceCheck, Profile, mean_rows};
use super::{Kernel, Layering, sums};
use colluvium_dem::{Record, Snapshot};

/// Why an averager cannot be made or read back.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum AveragerError {
    /// A number is out of range.
    #[error("coarse_graining.{key} = {value}: must be {allowed}")]
    OutOfRange {
        /// Name of the key.
        key: &'static str,
        /// The value found.
        value: f64,
        /// What is allowed.
        allowed: &'static str,
    },
    /// A checkpoint lacks an array, or the array has the wrong length.
    #[error("checkpoint array `{name}` has {found} numbers: must have {expected}")]
    Record {
        /// Name of the array.
        name: String,
        /// Its length (0 if absent).
        found: usize,
        /// The length it must have.
        expected: usize,
    },
}

/// Sums of snapshots in time. Holds 32 to 64 blocks of equal numbers of samples: when the 64th block is full
/// neighbours are joined, so the length of the run need not be known before. Nothing is allocated by
/// [`Averager::sample`].
#[derive(Clone, Debug)]
pub struct Averager<K> {
    kernel: K,
    layers: Layering,
    floor_area: f64,
    gravity: [f64; 3],
    block_samples: u64,
    full_blocks: usize,
    /// `MAX_BLOCKS + 1` arrays; the one after the full blocks is being filled.
    blocks: Vec<f64>,
    current_samples: u64,
    first_time: f64,
    last_time: f64,
    first_momentum: Vec<f64>,
    last_momentum: Vec<f64>,
}

/// Blocks are joined when there are this many.
const MAX_BLOCKS: usize = 64;

impl<K: Kernel> Averager<K> {
    /// An empty averager over the given layers.
    ///
    /// # Errors
    /// If the layers' thickness or count is not positive.
    pub fn new(kernel: K, layers: Layering) -> Result<Self, AveragerError> {
        if !(layers.thickness > 0.0 && layers.thickness.is_finite()) {
            return Err(AveragerError::OutOfRange {
                key: "thickness",
                value: layers.thickness,
                allowed: "a positive length in m",
            });
        }
        if layers.count == 0 || layers.count > 100_000 {
            return Err(AveragerError::OutOfRange {
                key: "count",
                value: layers.count as f64,
                allowed: "1 to 100000 layers",
            });
        }
        if !layers.lower.is_finite() {
            return Err(AveragerError::OutOfRange {
                key: "lower",
                value: layers.lower,
                allowed: "a height in m",
            });
        }
        Ok(Self {
            kernel,
            layers,
            floor_area: 0.0,
            gravity: [0.0; 3],
            block_samples: 1,
            full_blocks: 0,
            blocks: vec![0.0; (MAX_BLOCKS + 1) * sums::length(layers.count)],
            current_samples: 0,
            first_time: 0.0,
            last_time: 0.0,
            first_momentum: vec![0.0; 6 * layers.count],
            last_momentum: vec![0.0; 6 * layers.count],
        })
    }

    /// The layers.
    pub fn layers(&self) -> &Layering {
        &self.layers
    }

    /// Number of samples taken.
    pub fn samples(&self) -> u64 {
        self.full_blocks as u64 * self.block_samples + self.current_samples
    }

    /// Adds one snapshot.
    pub fn sample(&mut self, snapshot: &Snapshot) {
        if self.samples() == 0 {
            self.first_time = snapshot.time;
            sums::momentum_above(
                &self.kernel,
                &self.layers,
                snapshot,
                &mut self.first_momentum,
            );
        }
        self.floor_area = snapshot.domain.floor_area();
        self.gravity = snapshot.gravity.into();
        self.last_time = snapshot.time;
        sums::momentum_above(
            &self.kernel,
            &self.layers,
            snapshot,
            &mut self.last_momentum,
        );

        let length = sums::length(self.layers.count);
        let start = self.full_blocks * length;
        sums::add(
            &self.kernel,
            &self.layers,
            snapshot,
            self.first_time,
            &mut self.blocks[start..start + length],
        );
        self.current_samples += 1;
        if self.current_samples == self.block_samples {
            self.current_samples = 0;
            self.full_blocks += 1;
            if self.full_blocks == MAX_BLOCKS {
                self.join_neighbours();
            }
        }
    }

    fn join_neighbours(&mut self) {
        let length = sums::length(self.layers.count);
        for pair in 0..MAX_BLOCKS / 2 {
            for i in 0..length {
                self.blocks[pair * length + i] =
                    self.blocks[2 * pair * length + i] + self.blocks[(2 * pair + 1) * length + i];
            }
        }
        self.blocks[MAX_BLOCKS / 2 * length..].fill(0.0);
        self.full_blocks = MAX_BLOCKS / 2;
        self.block_samples *= 2;
    }

    /// Mean profile with standard errors (see [`Profile`]); `diameter` (m) and `grain_density` [kg/m³] enter the
    /// inertial number only.
    pub fn profile(&self, diameter: f64, grain_density: f64) -> Profile {
        let n = self.layers.count;
        let length = sums::length(n);
        let mut total = vec![0.0; length];
        for block in self.blocks.chunks_exact(length).take(self.full_blocks + 1) {
            add_to(&mut total, block, 1.0);
        }
        let scale = super::profile::Scale {
            floor_area: self.floor_area,
            diameter,
            grain_density,
        };
        let means = mean_rows(&total, self.samples(), &self.layers, &scale);

        // Delete-one-block jackknife, over full blocks only.
        let mut in_blocks = vec![0.0; length];
        for block in self.blocks.chunks_exact(length).take(self.full_blocks) {
            add_to(&mut in_blocks, block, 1.0);
        }
        let kept_samples = (self.full_blocks.saturating_sub(1)) as u64 * self.block_samples;
        let without: Vec<_> = self
            .blocks
            .chunks_exact(length)
            .take(if self.full_blocks > 2 {
                self.full_blocks
            } else {
                0
            })
            .map(|block| {
                let mut rest = in_blocks.clone();
                add_to(&mut rest, block, -1.0);
                mean_rows(&rest, kept_samples, &self.layers, &scale)
            })
            .collect();

        let span = self.last_time - self.first_time;
        let balance = BalanceCheck::of(
            &total,
            self.samples(),
            &means,
            &self.layers,
            self.floor_area,
            self.gravity,
            &|axis, k| {
                let i = axis * n + k;
                if span > 0.0 {
                    (self.last_momentum[i] - self.first_momentum[i]) / span
                } else {
                    0.0
                }
            },
        );
        Profile::assemble(
            &means,
            &without,
            &self.layers,
            balance,
            self.samples(),
            span,
        )
    }

    /// Writes the state into a checkpoint, under names that begin with `prefix`.
    pub fn save(&self, prefix: &str, record: &mut Record) {
        let filled = (self.full_blocks + 1) * sums::length(self.layers.count);
        record
            .numbers
            .insert(format!("{prefix}.blocks"), self.blocks[..filled].to_vec());
        record.numbers.insert(
            format!("{prefix}.first_momentum"),
            self.first_momentum.clone(),
        );
        record.numbers.insert(
            format!("{prefix}.last_momentum"),
            self.last_momentum.clone(),
        );
        let [gx, gy, gz] = self.gravity;
        record.numbers.insert(
            format!("{prefix}.state"),
            vec![self.floor_area, gx, gy, gz, self.first_time, self.last_time],
        );
        record.counts.insert(
            format!("{prefix}.counts"),
            vec![
                self.block_samples,
                self.full_blocks as u64,
                self.current_samples,
            ],
        );
    }

    /// Reads a state back that [`Averager::save`] wrote for the same layers: bit-exact.
    ///
    /// # Errors
    /// If an array is missing or has the wrong length.
    pub fn load(&mut self, prefix: &str, record: &Record) -> Result<(), AveragerError> {
        let lengths = |name: &str, found: usize, expected: usize| {
            if found == expected {
                Ok(())
            } else {
                Err(AveragerError::Record {
                    name: format!("{prefix}.{name}"),
                    found,
                    expected,
                })
            }
        };
        let counts = record
            .counts
            .get(&format!("{prefix}.counts"))
            .map_or(&[][..], |v| v);
        lengths("counts", counts.len(), 3)?;
        let numbers = |name: &str| {
            record
                .numbers
                .get(&format!("{prefix}.{name}"))
                .map_or(&[][..], |v| v)
        };
        let full_blocks = usize::try_from(counts[1]).unwrap_or(usize::MAX);
        if full_blocks >= MAX_BLOCKS || counts[0] == 0 || counts[2] >= counts[0] {
            return Err(AveragerError::OutOfRange {
                key: "counts",
                value: counts[1] as f64,
                allowed: "fewer than 64 full blocks, the last one unfinished",
            });
        }
        let blocks = numbers("blocks");
        lengths(
            "blocks",
            blocks.len(),
            (full_blocks + 1) * sums::length(self.layers.count),
        )?;
        let state = numbers("state");
        lengths("state", state.len(), 6)?;
        let (first, last) = (numbers("first_momentum"), numbers("last_momentum"));
        lengths("first_momentum", first.len(), 6 * self.layers.count)?;
        lengths("last_momentum", last.len(), 6 * self.layers.count)?;

        self.blocks.fill(0.0);
        self.blocks[..blocks.len()].copy_from_slice(blocks);
        self.block_samples = counts[0];
        self.full_blocks = full_blocks;
        self.current_samples = counts[2];
        self.floor_area = state[0];
        self.gravity = [state[1], state[2], state[3]];
        self.first_time = state[4];
        self.last_time = state[5];
        self.first_momentum.copy_from_slice(first);
        self.last_momentum.copy_from_slice(last);
        Ok(())
    }
}

fn add_to(total: &mut [f64], part: &[f64], sign: f64) {
    for (t, p) in total.iter_mut().zip(part) {
        *t += sign * p;
    }
}
