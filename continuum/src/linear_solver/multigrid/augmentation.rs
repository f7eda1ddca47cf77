//! Bulk viscosity from the continuity equations.
//!
//! The strain rate of the material has no part that changes volume: by itself it lets a smoother shift what
//! flows out of a cell to and fro, and in a plane it lets every conformal map pass. So the continuity equations of
//! the cells, times a viscosity of each cell, are added to the momentum equations. The solution stays the same, and the
//! velocities of a cell resist a change of its volume about as much as one of its shape (Fortin & Glowinski, *Augmented
//! Lagrangian Methods*, 1983). No coefficient comes to the pattern: the strain rate couples the faces of a cell
//! already.

use super::Columns;

/// Bulk viscosity over the least stiffness of a face of the cell.
const SHARE: f64 = 0.5;
/// Stands for a pair without a coefficient.
const NONE: u32 = u32::MAX;

/// The continuity equations of the cells of the finest grid.
pub(super) struct Augmentation {
    /// Where the entries of a cell begin.
    starts: Vec<u32>,
    /// Velocities in the continuity equation of a cell.
    velocities: Vec<u32>,
    /// Slots of their coefficients there.
    entries: Vec<u32>,
    /// Slots of the diagonal of velocities.
    diagonal: Vec<u32>,
    /// Slots of the diagonal of cells.
    cells: Vec<u32>,
    /// Slots of the coefficients between two velocities of a cell, cell by cell.
    pairs: Vec<u32>,
    /// What each cell's continuity equation is multiplied with.
    viscosity: Vec<f64>,
}

impl Augmentation {
    pub(super) fn new(matrix: &Columns, definite: usize) -> Self {
        let count = matrix.size() - definite;
        let mut members: Vec<Vec<[u32; 2]>> = vec![Vec::new(); count];
        for j in 0..definite {
            for slot in matrix.starts[j]..matrix.starts[j + 1] {
                let row = matrix.rows[slot] as usize;
                if row >= definite {
                    members[row - definite].push([j as u32, slot as u32]);
                }
            }
        }
        let slot = |row: usize, column: usize| {
            let (rows, _) = matrix.column(column);
            let found = rows.binary_search(&(row as u32));
            found.map_or(NONE, |k| (matrix.starts[column] + k) as u32)
        };
        let mut augmentation = Self {
            starts: vec![0],
            velocities: Vec::new(),
            entries: Vec::new(),
            diagonal: (0..definite).map(|j| slot(j, j)).collect(),
            cells: (definite..matrix.size()).map(|j| slot(j, j)).collect(),
            pairs: Vec::new(),
            viscosity: vec![0.0; count],
        };
        for faces in members {
            for [j, entry] in &faces {
                augmentation.velocities.push(*j);
                augmentation.entries.push(*entry);
                let pairs = faces.iter().map(|[i, _]| slot(*i as usize, *j as usize));
                augmentation.pairs.extend(pairs);
            }
            let end = augmentation.velocities.len() as u32;
            augmentation.starts.push(end);
        }
        augmentation
    }

    /// Adds to the matrix what is due. Cells whose divergence is free add nothing.
    pub(super) fn add_to(&mut self, matrix: &mut Columns) {
        let values = &mut matrix.values;
        let mut pairs = self.pairs.iter();
        // By the stiffness without bulk viscosity.
        for (cell, viscosity) in self.viscosity.iter_mut().enumerate() {
            let range = self.starts[cell] as usize..self.starts[cell + 1] as usize;
            let mut least = f64::INFINITY;
            for (&j, &entry) in self.velocities[range.clone()]
                .iter()
                .zip(&self.entries[range])
            {
                let area = values[entry as usize];
                least = least.min(values[self.diagonal[j as usize] as usize] / (area * area));
            }
            let is_free = values[self.cells[cell] as usize] != 0.0;
            *viscosity = if is_free || !least.is_finite() {
                0.0
            } else {
                SHARE * least
            };
        }
        for (cell, viscosity) in self.viscosity.iter().enumerate() {
            let range = self.starts[cell] as usize..self.starts[cell + 1] as usize;
            for &column in &self.entries[range.clone()] {
                let by_column = viscosity * values[column as usize];
                for (&row, &slot) in self.entries[range.clone()].iter().zip(pairs.by_ref()) {
                    if slot != NONE {
                        values[slot as usize] += by_column * values[row as usize];
                    }
                }
            }
        }
    }

    /// Does to a right-hand side what was done to the matrix.
    pub(super) fn add_to_residual(&self, matrix: &Columns, residual: &mut [f64]) {
        let (momentum, continuity) = residual.split_at_mut(self.diagonal.len());
        for (cell, (viscosity, r)) in self.viscosity.iter().zip(continuity).enumerate() {
            let range = self.starts[cell] as usize..self.starts[cell + 1] as usize;
            let by_cell = viscosity * *r;
            for (&j, &entry) in self.velocities[range.clone()]
                .iter()
                .zip(&self.entries[range])
            {
                momentum[j as usize] += by_cell * matrix.values[entry as usize];
            }
        }
    }
}
