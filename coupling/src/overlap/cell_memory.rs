//! A joint by cells as numbers: what a run goes on from with the same bits.
//!
//! In front stands what every load changes, of a length that does not; what an exchange changes stands in rows.

use super::cell_joint::CellJoint;
use super::cell_monitors::CellMonitors;
use super::joint::{flat, vectors};

/// Scalars in front: cells, what was made and when, work and powers.
const SCALARS: usize = 9;

/// Rows of what an exchange changes.
pub(super) type Rows<'a> = [&'a [f64]; 6];

impl<const D: usize, const S: usize> CellJoint<D, S> {
    /// What every load changes, with so much more of a fixed length.
    pub fn front(&self, more: &[f64]) -> Vec<f64> {
        let cells = self.slips.len();
        let mut front = Vec::with_capacity(Self::front_length(cells, more.len()));
        front.extend([cells as f64, self.made as f64, self.laid_at as f64]);
        front.extend(self.monitors.work.iter().chain(&self.laid.powers));
        front.extend(more);
        for given in [&self.laid, &self.given] {
            front.extend(flat(&[given.traction, given.impedance]));
            front.extend(flat(&given.relaxation));
            front.extend(flat(&given.spin));
        }
        front
    }

    fn front_length(cells: usize, more: usize) -> usize {
        SCALARS + more + 2 * (2 * D + (D + S) * cells)
    }

    /// What stands in front, with so much more, of numbers that go on behind it, and those.
    pub fn split(memory: &[f64], more: usize) -> Option<(&[f64], &[f64])> {
        let cells = *memory.first()? as usize;
        memory.split_at_checked(Self::front_length(cells, more))
    }

    /// Puts what an exchange changes.
    pub fn write(&self, put: &mut impl FnMut(&[f64])) {
        put(&[self.exchanges as f64]);
        put(&self.monitors.numbers());
        put(&self.windows.numbers());
        for row in [&self.accelerations, &self.owed] {
            put(&flat(row).collect::<Vec<f64>>());
        }
        put(&flat(&self.spins).collect::<Vec<f64>>());
    }

    /// Takes what was put.
    pub fn rows<'a>(take: &mut impl FnMut() -> Option<&'a [f64]>) -> Option<Rows<'a>> {
        Some([take()?, take()?, take()?, take()?, take()?, take()?])
    }

    /// Makes the joint what it was, from its front, with so much more, and its rows; says what more there was, or nothing if they are not
    /// of as many cells.
    pub fn fill<'a>(&mut self, front: &'a [f64], more: usize, rows: Rows) -> Option<&'a [f64]> {
        let cells = self.slips.len();
        let [exchanges, monitors, windows, accelerations, owed, spins] = rows;
        let lengths = [front, accelerations, owed, spins].map(<[f64]>::len);
        if lengths
            != [
                Self::front_length(cells, more),
                D * cells,
                D * cells,
                S * cells,
            ]
        {
            return None;
        }
        self.exchanges = *exchanges.first()? as u64;
        self.monitors = CellMonitors::of(monitors.try_into().ok()?);
        self.windows.take_up(windows)?;
        (self.accelerations, self.owed) = (vectors(accelerations), vectors(owed));
        self.spins = vectors(spins);
        let (scalars, rest) = front.split_first_chunk::<SCALARS>()?;
        self.made = scalars[1] as u64;
        self.laid_at = scalars[2] as u64;
        self.monitors.work = [scalars[3], scalars[4], scalars[5]];
        self.laid.powers = [scalars[6], scalars[7], scalars[8]];
        let (more, rest) = rest.split_at_checked(more)?;
        let [laid, given] = [0, 1].map(|half| &rest[half * rest.len() / 2..]);
        for (given, numbers) in [(&mut self.laid, laid), (&mut self.given, given)] {
            let (pair, numbers) = numbers.split_at(2 * D);
            given.traction.copy_from_slice(&pair[..D]);
            given.impedance.copy_from_slice(&pair[D..]);
            given.relaxation = vectors(&numbers[..D * cells]);
            given.spin = vectors(&numbers[D * cells..(D + S) * cells]);
        }
        Some(more)
    }
}
