//! The pattern of a sparse matrix that is a sum of dense blocks.

use std::ops::Range;
use std::sync::atomic::{AtomicU32, Ordering};

use faer::sparse::SymbolicSparseColMat;

use crate::threads;

/// Dense blocks, each given by its rows and columns, that a matrix is the sum of.
#[derive(Debug, Clone, Default)]
pub struct Blocks {
    rows: Vec<u32>,
    columns: Vec<u32>,
    /// Where the rows and columns of each block end.
    ends: Vec<[u32; 2]>,
    coefficients: usize,
}

impl Blocks {
    /// No blocks, with room for so many with so many rows and columns in all.
    pub fn with_capacity(blocks: usize, rows: usize) -> Self {
        Self {
            rows: Vec::with_capacity(rows),
            columns: Vec::with_capacity(2 * rows),
            ends: Vec::with_capacity(blocks),
            coefficients: 0,
        }
    }

    /// Adds a block.
    pub fn push(
        &mut self,
        rows: impl IntoIterator<Item = usize>,
        columns: impl IntoIterator<Item = usize>,
    ) {
        let [first_row, first_column] = [self.rows.len(), self.columns.len()];
        self.rows.extend(rows.into_iter().map(|row| row as u32));
        self.columns
            .extend(columns.into_iter().map(|column| column as u32));
        let ends = [self.rows.len(), self.columns.len()];
        self.coefficients += (ends[0] - first_row) * (ends[1] - first_column);
        self.ends.push(ends.map(|end| end as u32));
    }

    /// Number of coefficients of all blocks.
    pub fn coefficients(&self) -> usize {
        self.coefficients
    }

    /// Compressed columns of the sum, and the place in them of each coefficient: block after block, row after row.
    pub(super) fn pattern(&self, size: usize) -> (SymbolicSparseColMat<usize>, Vec<u32>) {
        // Blocks by their columns.
        let mut ends = vec![0_u32; size + 1];
        for &column in &self.columns {
            ends[column as usize + 1] += 1;
        }
        for column in 0..size {
            ends[column + 1] += ends[column];
        }
        let mut next = ends.clone();
        let mut members = vec![Member::default(); self.columns.len()];
        let (mut begin, mut first_slot) = ([0_u32; 2], 0_u32);
        for &end in &self.ends {
            let [rows, columns] = [end[0] - begin[0], end[1] - begin[1]];
            for nth in 0..columns {
                let next = &mut next[self.columns[(begin[1] + nth) as usize] as usize];
                members[*next as usize] = Member {
                    rows: [begin[0], end[0]],
                    first_slot: first_slot + nth,
                    step: columns,
                };
                *next += 1;
            }
            first_slot += rows * columns;
            begin = end;
        }
        // Columns are looked at in two halves, where there are many. A coefficient belongs to one column.
        let slots: Vec<AtomicU32> = (0..self.coefficients).map(|_| AtomicU32::new(0)).collect();
        let members_of = |column: usize| &members[ends[column] as usize..ends[column + 1] as usize];
        let rows_of = |columns: Range<usize>| {
            let mut rows: Vec<usize> = Vec::with_capacity(self.coefficients / 4);
            let mut ends = Vec::with_capacity(columns.len());
            // The column that a row was last met in.
            let mut met_in = vec![u32::MAX; size];
            for column in columns {
                let first = rows.len();
                for member in members_of(column) {
                    for &row in &self.rows[member.rows[0] as usize..member.rows[1] as usize] {
                        let met_in = &mut met_in[row as usize];
                        if *met_in != column as u32 {
                            *met_in = column as u32;
                            rows.push(row as usize);
                        }
                    }
                }
                rows[first..].sort_unstable();
                ends.push(rows.len());
            }
            (rows, ends)
        };
        let pays = size >= threads::MANY;
        let middle = if pays { size / 2 } else { size };
        let ((mut rows, mut starts), (more, later)) =
            threads::join(pays, || rows_of(0..middle), || rows_of(middle..size));
        starts.insert(0, 0);
        starts.extend(later.iter().map(|end| rows.len() + end));
        rows.extend(more);
        let set_slots = |columns: Range<usize>| {
            // Where in the present column a row stands.
            let mut place = vec![0_u32; size];
            for column in columns {
                for slot in starts[column]..starts[column + 1] {
                    place[rows[slot]] = slot as u32;
                }
                for member in members_of(column) {
                    let mut slot = member.first_slot as usize;
                    for &row in &self.rows[member.rows[0] as usize..member.rows[1] as usize] {
                        slots[slot].store(place[row as usize], Ordering::Relaxed);
                        slot += member.step as usize;
                    }
                }
            }
        };
        threads::join(pays, || set_slots(0..middle), || set_slots(middle..size));
        let slots = slots.into_iter().map(AtomicU32::into_inner).collect();
        let pattern = SymbolicSparseColMat::new_checked(size, size, starts, None, rows);
        (pattern, slots)
    }
}

/// A column of a block.
#[derive(Debug, Clone, Copy, Default)]
struct Member {
    rows: [u32; 2],
    /// Slot of the coefficient in the first row, and how far it is from one row to the next.
    first_slot: u32,
    step: u32,
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two blocks that share a coefficient, and one by itself.
    #[test]
    fn slots_of_blocks_lie_in_their_columns() {
        let mut blocks = Blocks::default();
        blocks.push([2, 0], [0, 1]);
        blocks.push([0], [1, 2]);
        blocks.push([1], [1]);
        let (pattern, slots) = blocks.pattern(3);
        assert_eq!(blocks.coefficients(), 7);
        assert_eq!(pattern.col_ptr(), [0, 2, 5, 6]);
        assert_eq!(pattern.row_idx(), [0, 2, 0, 1, 2, 0]);
        assert_eq!(slots, [1, 4, 0, 2, 2, 5, 3]);
    }
}
