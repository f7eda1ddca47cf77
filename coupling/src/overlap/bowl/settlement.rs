//! What changes hands when a side of the box moves: no mass and no momentum of both sides together.

use super::zone::Zone;
use super::{Bowl, OverlapError};
use nalgebra::Vector3;

impl Bowl {
    /// Mass (kg) and momentum (N s) of the grains inside the handshake surface and of the continuum outside it.
    pub(super) fn counted(&self) -> (f64, Vector3<f64>) {
        let (cells, zone) = (&self.layout.cells, &self.layout.zone);
        let handshake = self.layout.widths[0];
        let (mut mass, mut momentum) = (0.0, Vector3::zeros());
        let belongs = self.spec.belongs();
        for grain in self.sighting.snapshot.grains.iter().filter(|g| belongs(g)) {
            if zone.label(cells, &grain.position) > handshake {
                mass += grain.mass;
                momentum += grain.mass * grain.velocity;
            }
        }
        let full = self.full();
        for (cell, fraction) in self.view.fraction.iter().enumerate() {
            if zone.label_of_cell(cells.index(cell)) < handshake {
                mass += full * fraction;
                momentum += full * *fraction * self.view.velocity[cell];
            }
        }
        (mass, momentum)
    }

    /// Height of the continuum over each column of cells, or of its copy where that is its surface, in cells.
    pub(super) fn heights(&self) -> Vec<f64> {
        let cells = &self.layout.cells;
        let layer = cells.counts[0] * cells.counts[1];
        let start = self.layout.height / cells.spacing[2];
        let (now, full) = (self.column_masses(), self.full());
        let height = |column: usize| match self.is_counted_above(column) {
            true => self.view.fraction.iter().skip(column).step_by(layer).sum(),
            false => start + (now[column] - self.columns[column]) / full,
        };
        (0..layer).map(height).collect()
    }

    /// Whether what lies at the surface of a column of cells is continuum that counts.
    fn is_counted_above(&self, column: usize) -> bool {
        let [x, y, _] = self.layout.cells.index(column);
        let top = self.layout.cells.counts[2] - 1;
        self.layout.zone.label_of_cell([x, y, top]) < self.layout.widths[0]
    }

    /// Columns count from masses at which the continuum's surface stays where it was (in cells).
    pub(super) fn keep_heights(&mut self, heights: &[f64]) {
        let start = self.layout.height / self.layout.cells.spacing[2];
        let full = self.full();
        let now = self.column_masses();
        for ((column, now), height) in self.columns.iter_mut().zip(now).zip(heights) {
            *column = now - (height - start) * full;
        }
    }

    /// Where grains have just been put, or bore the continuum's traction, their averages begin with its stress.
    pub(super) fn believe_the_continuum(&mut self, old: &Zone) {
        let (cells, zone) = (&self.layout.cells, &self.layout.zone);
        for (cell, stress) in self.sums.stress.iter_mut().enumerate() {
            let index = cells.index(cell);
            let is_new = old.label_of_cell(index) < self.layout.widths[0];
            if is_new && zone.label_of_cell(index) > 0.0 && self.view.is_full(cell) {
                *stress = self.view.stress[cell];
            }
        }
    }

    /// Lets the continuum take up by how much both sides together differ in mass and momentum from before a move; says by
    /// how much mass (kg).
    pub(super) fn settle(&mut self, before: (f64, Vector3<f64>)) -> Result<f64, OverlapError> {
        let remainder = self.counted().0 - before.0;
        let paid = self.pay(remainder)?;
        self.account.carried += remainder - paid;
        let momentum = self.counted().1 - before.1;
        self.account.settled += momentum;
        self.unborne += momentum;
        self.bear();
        Ok(remainder)
    }

    /// Lets the continuum's cells of the buffer give back what moves of the box added to momenta; without any it waits.
    pub(super) fn bear(&mut self) {
        if self.unborne == Vector3::zeros() {
            return;
        }
        let handshake = self.layout.widths[0];
        let (cells, zone) = (&self.layout.cells, &self.layout.zone);
        let bears = |cell: &usize| {
            let label = zone.label_of_cell(cells.index(*cell));
            label > 0.0 && label < handshake && self.view.is_full(*cell)
        };
        let bearers: Vec<usize> = (0..cells.count()).filter(bears).collect();
        if bearers.is_empty() {
            return;
        }
        let each = self.unborne / bearers.len() as f64;
        for cell in bearers {
            self.joint.owed[cell] -= each;
        }
        self.unborne = Vector3::zeros();
    }

    /// Takes a mass (kg) off the surface of the continuum that counts, evenly; says how much it had to take off.
    fn pay(&mut self, mass: f64) -> Result<f64, OverlapError> {
        let cells = &self.layout.cells;
        let layer = cells.counts[0] * cells.counts[1];
        let columns: Vec<usize> = (0..layer).filter(|c| self.is_counted_above(*c)).collect();
        if columns.is_empty() || mass == 0.0 {
            return Ok(0.0);
        }
        let before = self.flow.volume();
        let mut state = self.flow.state().clone();
        take_off(&mut state.fractions, layer, columns, mass / self.full());
        self.flow.set_state(state)?;
        let change = self.flow.volume() - before;
        self.account.copied += change;
        self.view
            .look(&self.flow, &self.layout.cells, &self.units, 0.0);
        Ok(-change * self.spec.density() * self.units.length.powi(3))
    }
}

/// Takes an amount (in full cells) off the surface of columns of cells, evenly, or adds it if negative; what a column has not,
/// or has no room for, the others give or take. Says what none of them could.
fn take_off(fractions: &mut [f64], layer: usize, mut columns: Vec<usize>, mut amount: f64) -> f64 {
    while !columns.is_empty() && amount != 0.0 {
        let each = amount / columns.len() as f64;
        amount = 0.0;
        columns.retain(|column| {
            let over = take_off_column(fractions, layer, *column, each);
            amount += over;
            over == 0.0
        });
    }
    amount
}

/// The same of one column.
fn take_off_column(fractions: &mut [f64], layer: usize, column: usize, each: f64) -> f64 {
    let rows = (0..fractions.len() / layer).map(|k| column + layer * k);
    let filled = rows.rev().find(|cell| fractions[*cell] > 0.0);
    let mut cell = filled.unwrap_or(column);
    let mut left = fractions[cell] - each;
    while left < 0.0 && cell >= layer {
        fractions[cell] = 0.0;
        cell -= layer;
        left += fractions[cell];
    }
    while left > 1.0 && cell + layer < fractions.len() {
        fractions[cell] = 1.0;
        cell += layer;
        left += fractions[cell] - 1.0;
    }
    fractions[cell] = left.clamp(0.0, 1.0);
    fractions[cell] - left
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two columns side by side, three cells high.
    const COLUMNS: [f64; 6] = [1.0, 1.0, 0.5, 1.0, 0.0, 0.5];

    #[test]
    fn what_a_column_has_not_the_others_give() {
        let mut fractions = COLUMNS;
        assert_eq!(take_off(&mut fractions, 2, vec![0, 1], 1.0), 0.0);
        assert_eq!(fractions, [1.0, 1.0, 0.0, 1.0, 0.0, 0.0]);
        // The first has one cell left, the second two.
        assert_eq!(take_off(&mut fractions, 2, vec![0, 1], 2.5), 0.0);
        assert_eq!(fractions, [0.0, 0.5, 0.0, 0.0, 0.0, 0.0]);
        assert_eq!(take_off(&mut fractions, 2, vec![0, 1], 2.0), 1.5);
        assert_eq!(fractions, [0.0; 6]);
    }

    #[test]
    fn what_a_column_has_no_room_for_the_others_take() {
        let mut fractions = COLUMNS;
        assert_eq!(take_off(&mut fractions, 2, vec![0, 1], -1.5), 0.0);
        assert_eq!(fractions, [1.0, 1.0, 1.0, 1.0, 0.5, 1.0]);
        let over = take_off(&mut fractions, 2, vec![0, 1], -1.5);
        assert_eq!((over, fractions), (-1.0, [1.0; 6]));
    }
}
