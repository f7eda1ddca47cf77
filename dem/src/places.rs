//! Where each grain stands, by its number.

use crate::grains::Grains;
use crate::population::GONE;

/// Row of every grain by its number; only laid for scenes that look grains up by number.
#[derive(Clone, Debug, Default)]
pub(crate) struct Places(Vec<u32>);

impl Places {
    /// Takes down where the grains are now.
    pub fn lay(&mut self, grains: &Grains) {
        let end = grains.id.iter().max().map_or(0, |&id| id as usize + 1);
        self.0.clear();
        self.0.resize(end, GONE);
        for (row, &id) in grains.id.iter().enumerate() {
            self.0[id as usize] = row as u32;
        }
    }

    /// Row of a grain; [`GONE`] if it is not there.
    pub fn of(&self, number: u32) -> u32 {
        self.0.get(number as usize).copied().unwrap_or(GONE)
    }
}
