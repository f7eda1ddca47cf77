//! The product of the matrix of a step with a vector, from half of its symmetric block.

use std::ops::Range;

use faer::sparse::SymbolicSparseColMat;

use crate::threads;

/// Coefficients that are looked up by one thread.
const AT_A_TIME: usize = 16_384;

/// The coefficients of [[K, B], [C, 0]] without what K has above its diagonal.
pub(super) struct Product {
    /// Where the coefficients of K below the diagonal of each column begin, and the others of that column.
    begins: Vec<[u32; 2]>,
    rows: Vec<u32>,
    /// Where each coefficient stands among all.
    slots: Vec<u32>,
    values: Vec<f64>,
    /// The columns from this one on are the second half,
    middle: usize,
    /// which makes a sum of its own.
    second: Vec<f64>,
}

impl Product {
    /// The product for a pattern whose first `definite` rows and columns are symmetric.
    pub(super) fn new(pattern: &SymbolicSparseColMat<usize>, definite: usize) -> Self {
        let (starts, all_rows) = (pattern.col_ptr(), pattern.row_idx());
        let mut begins = Vec::with_capacity(starts.len());
        let mut rows = Vec::with_capacity(all_rows.len());
        let mut slots = Vec::with_capacity(all_rows.len());
        for (column, bounds) in starts.windows(2).enumerate() {
            // In the order of their rows: what is left out, the diagonal, the symmetric ones below it, the others.
            let here = &all_rows[bounds[0]..bounds[1]];
            let parts = if column < definite {
                let below = |row: usize| here.partition_point(|&r| r < row);
                [column, column + 1, definite].map(below)
            } else {
                [0; 3]
            };
            let [diagonal, symmetric, others] = parts;
            let mut take = |from: usize, to: usize| {
                rows.extend(here[from..to].iter().map(|&row| row as u32));
                slots.extend((bounds[0] + from..bounds[0] + to).map(|slot| slot as u32));
                rows.len() as u32
            };
            let first = take(0, 0);
            let second = take(symmetric, others);
            take(diagonal, symmetric);
            take(others, here.len());
            begins.push([first, second]);
        }
        begins.push([rows.len() as u32; 2]);
        let size = begins.len() - 1;
        let middle = if size < threads::MANY {
            size
        } else {
            begins.partition_point(|begin| 2 * (begin[0] as usize) < rows.len())
        };
        Self {
            middle,
            second: vec![0.0; if middle < size { size } else { 0 }],
            begins,
            values: vec![0.0; rows.len()],
            rows,
            slots,
        }
    }

    /// Takes the coefficients of now.
    pub(super) fn load(&mut self, values: &[f64]) {
        let slots = &self.slots;
        threads::over(&mut self.values, AT_A_TIME, &|first, here| {
            for (value, &slot) in here.iter_mut().zip(&slots[first..]) {
                *value = values[slot as usize];
            }
        });
    }

    /// y = A x.
    pub(super) fn multiply(&mut self, x: &[f64], y: &mut [f64]) {
        let mut second = std::mem::take(&mut self.second);
        let (one, other) = (0..self.middle, self.middle..x.len());
        if other.is_empty() {
            self.multiply_columns(one, x, y);
        } else {
            threads::join(
                true,
                || self.multiply_columns(one, x, y),
                || self.multiply_columns(other, x, &mut second),
            );
            for (y, second) in y.iter_mut().zip(&second) {
                *y += second;
            }
        }
        self.second = second;
    }

    /// What some columns contribute to A x.
    fn multiply_columns(&self, columns: Range<usize>, x: &[f64], y: &mut [f64]) {
        y.fill(0.0);
        let begins = self.begins[columns.start..=columns.end].windows(2);
        for (column, pair) in columns.zip(begins) {
            let [symmetric, others, end] = [pair[0][0], pair[0][1], pair[1][0]].map(|n| n as usize);
            let here = x[column];
            let mut sum = 0.0;
            let entries = self.rows[symmetric..others].iter();
            for (&row, value) in entries.zip(&self.values[symmetric..others]) {
                y[row as usize] += value * here;
                sum += value * x[row as usize];
            }
            let entries = self.rows[others..end].iter();
            for (&row, value) in entries.zip(&self.values[others..end]) {
                y[row as usize] += value * here;
            }
            y[column] += sum;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::linear_solver::Blocks;

    #[test]
    fn product_is_that_of_the_whole_matrix() {
        let a = [
            [2.0, 1.0, 0.5, 7.0],
            [1.0, 3.0, 0.0, -1.0],
            [0.5, 0.0, 4.0, 0.0],
            [6.0, 2.0, 3.0, 0.1],
        ];
        let mut blocks = Blocks::default();
        blocks.push(0..4, 0..4);
        let (pattern, slots) = blocks.pattern(4);
        let mut values = vec![0.0; 16];
        for (slot, value) in slots.iter().zip(a.as_flattened()) {
            values[*slot as usize] = *value;
        }
        let mut product = Product::new(&pattern, 3);
        product.load(&values);
        let (x, mut y) = ([1.0, -2.0, 0.25, 3.0], [9.0; 4]);
        product.multiply(&x, &mut y);
        for (y, row) in y.iter().zip(&a) {
            let expected: f64 = row.iter().zip(&x).map(|(a, x)| a * x).sum();
            assert!((y - expected).abs() < 1e-14, "{y} {expected}");
        }
    }
}
