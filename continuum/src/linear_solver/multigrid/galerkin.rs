//! The matrix of the coarser grid: the Galerkin product RᵀAR.

use super::Columns;
use super::transfer::Transfer;

/// Work arrays of the product.
pub(super) struct Product {
    starts: Vec<usize>,
    rows: Vec<u32>,
    /// A times a column of R, by fine unknowns.
    fine: Vec<f64>,
    met_in: Vec<u32>,
    touched: Vec<u32>,
    coarse: Vec<f64>,
}

impl Product {
    /// Finds where the product has coefficients.
    pub(super) fn new(matrix: &Columns, transfer: &Transfer) -> (Self, Columns) {
        let size = transfer.coarse_size();
        let mut product = Self {
            starts: vec![0],
            rows: Vec::new(),
            fine: vec![0.0; matrix.size()],
            met_in: vec![u32::MAX; matrix.size()],
            touched: Vec::new(),
            coarse: vec![0.0; size],
        };
        let mut met_in = vec![u32::MAX; size];
        for c in 0..size {
            product.touch(matrix, transfer, c);
            let first = product.rows.len();
            // Every unknown has a diagonal.
            product.rows.push(c as u32);
            met_in[c] = c as u32;
            for &f in &product.touched {
                for &(row, _) in transfer.parents_of(f as usize) {
                    let met = &mut met_in[row as usize];
                    if *met != c as u32 {
                        *met = c as u32;
                        product.rows.push(row);
                    }
                }
            }
            product.rows[first..].sort_unstable();
            product.starts.push(product.rows.len());
        }
        let coarse = Columns {
            starts: product.starts.clone(),
            rows: product.rows.clone(),
            values: vec![0.0; product.rows.len()],
        };
        product.met_in.fill(u32::MAX);
        (product, coarse)
    }

    /// Rows of A times column `c` of R.
    fn touch(&mut self, matrix: &Columns, transfer: &Transfer, c: usize) {
        self.touched.clear();
        for &(f, _) in transfer.children_of(c) {
            let (rows, _) = matrix.column(f as usize);
            for &row in rows {
                let met = &mut self.met_in[row as usize];
                if *met != c as u32 {
                    *met = c as u32;
                    self.touched.push(row);
                }
            }
        }
    }

    /// The coefficients of the product. Cells without pressure are left out.
    pub(super) fn evaluate(
        &mut self,
        matrix: &Columns,
        transfer: &mut Transfer,
        values: &mut [f64],
    ) {
        let definite = transfer.fine_definite;
        for (cell, is_free) in transfer.is_free.iter_mut().enumerate() {
            let j = definite + cell;
            let (rows, values) = matrix.column(j);
            let diagonal = rows.iter().position(|&row| row as usize == j);
            *is_free = diagonal.is_none_or(|d| values[d] == 0.0);
        }
        for c in 0..transfer.coarse_size() {
            self.touched.clear();
            for &(f, weight) in transfer.children_of(c) {
                if !transfer.takes_part(f as usize) {
                    continue;
                }
                let (rows, values) = matrix.column(f as usize);
                for (&row, value) in rows.iter().zip(values) {
                    let met = &mut self.met_in[row as usize];
                    if *met != c as u32 {
                        *met = c as u32;
                        self.touched.push(row);
                    }
                    self.fine[row as usize] += weight * value;
                }
            }
            for &f in &self.touched {
                let value = std::mem::take(&mut self.fine[f as usize]);
                if transfer.takes_part(f as usize) {
                    for &(row, weight) in transfer.parents_of(f as usize) {
                        self.coarse[row as usize] += weight * value;
                    }
                }
            }
            let range = self.starts[c]..self.starts[c + 1];
            for (&row, value) in self.rows[range.clone()].iter().zip(&mut values[range]) {
                *value = std::mem::take(&mut self.coarse[row as usize]);
                // Nothing left of it.
                if row as usize == c && *value == 0.0 && self.is_empty(transfer, c) {
                    *value = -1.0;
                }
            }
        }
        self.met_in.fill(u32::MAX);
    }

    fn is_empty(&self, transfer: &Transfer, c: usize) -> bool {
        let mut children = transfer.children_of(c).iter();
        !children.any(|(f, _)| transfer.takes_part(*f as usize))
    }
}
