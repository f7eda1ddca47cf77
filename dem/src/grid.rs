//! The cell grid of one level of grain sizes.

use crate::domain::Domain;

/// Cells no narrower than a contact of two of the level's grains plus the skin.
///
/// All cells with the same numbers along two of the axes form a *row*, along x or y: what flows mostly does so
/// at one speed in a horizontal row. Of the two axes across, the one with more cells counts slowest: layers
/// are then small, and with them the share of grains whose neighbours are far away in memory. Where that makes
/// layers much smaller, rows lie along y: a box that is long along x is cut into slices of it.
#[derive(Clone, Debug, Default)]
pub(crate) struct Grid {
    pub origin: [f64; 3],
    pub inverse_cell: [f64; 3],
    pub cells: [usize; 3],
    pub periodic: [bool; 3],
    /// The axis along rows.
    pub along: usize,
    /// The axes across rows, the slow one last.
    pub across: [usize; 2],
}

/// How much smaller layers must become for rows to lie along y.
const WORTH_TURNING: usize = 2;

impl Grid {
    /// A grid for `n` grains between `low` and `high`, with cells of at least `reach`.
    pub fn lay(n: usize, [low, high]: [[f64; 3]; 2], domain: &Domain, reach: f64) -> Grid {
        let mut grid = Grid {
            periodic: domain.periodic,
            ..Grid::default()
        };
        let lengths = domain.lengths();
        // Few grains in a large box, or a lone one far away, must not cost a grid of empty cells.
        let mut stretch = 1.0;
        loop {
            for k in 0..3 {
                let (from, length, size) = if domain.periodic[k] {
                    (domain.lower[k], lengths[k], reach * stretch)
                } else {
                    (low[k], (high[k] - low[k]).max(reach), reach * stretch)
                };
                grid.cells[k] = ((length / size) as usize).max(1);
                grid.origin[k] = from;
                grid.inverse_cell[k] = grid.cells[k] as f64 / length;
            }
            let count = grid.cells.iter().fold(1.0, |c, &m| c * m as f64);
            if count <= 8.0 * n as f64 + 4096.0 {
                break;
            }
            stretch *= 1.5;
        }
        grid.order_axes(false);
        grid
    }

    /// Decides which axis counts fastest and which slowest; rows lie along x where images are shifted along it.
    pub fn order_axes(&mut self, shifted: bool) {
        let [x, y, z] = self.cells;
        let layers = [x * y.min(z), y * x.min(z)];
        let turned = !shifted && WORTH_TURNING * layers[1] < layers[0];
        let [a, b] = if turned { [0, 2] } else { [1, 2] };
        self.along = usize::from(turned);
        self.across = if self.cells[a] > self.cells[b] {
            [b, a]
        } else {
            [a, b]
        };
    }

    /// Number of cells of a row.
    pub fn row_cells(&self) -> usize {
        self.cells[self.along]
    }

    /// Whether the last layer of rows is next to the first.
    pub fn closes(&self) -> bool {
        self.periodic[self.across[1]]
    }

    /// Number of rows.
    pub fn rows(&self) -> usize {
        self.cells[self.across[0]] * self.cells[self.across[1]]
    }

    /// Cell numbers of a row along the two axes across it.
    pub fn row(&self, row: usize) -> [usize; 2] {
        let m = self.cells[self.across[0]];
        [row % m, row / m]
    }

    /// The row with these cell numbers.
    pub fn row_at(&self, [fast, slow]: [usize; 2]) -> usize {
        slow * self.cells[self.across[0]] + fast
    }

    /// Number of the cell along an axis that holds a coordinate.
    pub fn coordinate(&self, axis: usize, x: f64) -> usize {
        let c = (x - self.origin[axis]) * self.inverse_cell[axis];
        (c.max(0.0) as usize).min(self.cells[axis] - 1)
    }

    /// Number of the cell that holds a point.
    pub fn index(&self, x: &[f64; 4]) -> usize {
        let across = self.across.map(|axis| self.coordinate(axis, x[axis]));
        self.row_at(across) * self.row_cells() + self.coordinate(self.along, x[self.along])
    }

    /// Distinct cell numbers along an axis from `reach` cells before `from` to as many after `to`.
    pub fn around(&self, axis: usize, [from, to]: [usize; 2], reach: isize, into: &mut Vec<usize>) {
        into.clear();
        let n = self.cells[axis] as isize;
        for c in from as isize - reach..=to as isize + reach {
            let mut m = c;
            if self.periodic[axis] {
                m = m.rem_euclid(n);
            } else if m < 0 || m >= n {
                continue;
            }
            if !into.contains(&(m as usize)) {
                into.push(m as usize);
            }
        }
    }

    /// Cells along an axis that cell `c` of another grid reaches into.
    pub fn beside(&self, axis: usize, other: &Grid, c: usize) -> [usize; 2] {
        let edge = |c: usize| other.origin[axis] + c as f64 / other.inverse_cell[axis];
        // A grain at the very edge may be on either side of it.
        let hair = 1e-9 / self.inverse_cell[axis];
        [
            self.coordinate(axis, edge(c) - hair),
            self.coordinate(axis, edge(c + 1) + hair),
        ]
    }

    /// Width of the narrowest cell across rows (m).
    pub fn width(&self) -> f64 {
        let [a, b] = self.across.map(|axis| 1.0 / self.inverse_cell[axis]);
        a.min(b)
    }
}
