//! The product of the matrix of a step with a vector, from half of its symmetric block.

use faer::sparse::SymbolicSparseColMat;

/// The coefficients of [[K, B], [C, 0]] without what K has above its diagonal.
pub(super) struct Product {
    /// Where the coefficients of K below the diagonal of each column begin, and the others of that column.
    begins: Vec<[u32; 2]>,
    rows: Vec<u32>,
    /// Where each coefficient stands among all.
    slots: Vec<u32>,
    values: Vec<f64>,
}

impl Product {
    /// The product for a pattern whose first `definite` rows and columns are symmetric.
    pub(super) fn new(pattern: &SymbolicSparseColMat<usize>, definite: usize) -> Self {
        let (starts, all_rows) = (pattern.col_ptr(), pattern.row_idx());
        let mut begins = Vec::with_capacity(starts.len());
        let (mut rows, mut slots) = (Vec::new(), Vec::new());
        for (column, bounds) in starts.windows(2).enumerate() {
            let entries = || (bounds[0]..bounds[1]).map(|slot| (slot, all_rows[slot]));
            let is_symmetric = |row: usize| row < definite && column < definite;
            let mut begin = [rows.len() as u32; 2];
            for (slot, row) in entries().filter(|(_, row)| is_symmetric(*row) && *row > column) {
                rows.push(row as u32);
                slots.push(slot as u32);
            }
            begin[1] = rows.len() as u32;
            for (slot, row) in entries().filter(|(_, row)| !is_symmetric(*row) || *row == column) {
                rows.push(row as u32);
                slots.push(slot as u32);
            }
            begins.push(begin);
        }
        begins.push([rows.len() as u32; 2]);
        Self {
            begins,
            values: vec![0.0; rows.len()],
            rows,
            slots,
        }
    }

    /// Takes the coefficients of now.
    pub(super) fn load(&mut self, values: &[f64]) {
        for (value, &slot) in self.values.iter_mut().zip(&self.slots) {
            *value = values[slot as usize];
        }
    }

    /// y = A x.
    pub(super) fn multiply(&self, x: &[f64], y: &mut [f64]) {
        y.fill(0.0);
        for (column, pair) in self.begins.windows(2).enumerate() {
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
