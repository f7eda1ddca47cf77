//! LDLᵀ factors of the symmetric quasi-definite part [[K, Cᵀ], [C, −δ]], without pivoting:
//! quasi-definite matrices have such factors in any order (Vanderbei, *SIAM J. Optim.* 5 (1995) 100).
//! The order is nested dissection where places on a grid are known and minimum degree elsewhere.
//!
//! Factors are computed in double precision. Where the iteration may be loose they are kept rounded to single:
//! substitution, which takes most of its time, is bound by the memory it reads. Rounding errs by 6e-8/δ of
//! the pressure terms, far below what a loose iteration has to mend anyway as long as δ ≥ 1e-6; with viscosities
//! that differ by 1e8 a tight one would not come to its end.

use faer::dyn_stack::{MemBuffer, MemStack};
use faer::linalg::cholesky::ldlt::factor::LdltRegularization;
use faer::perm::PermRef;
use faer::sparse::linalg::SupernodalThreshold;
use faer::sparse::linalg::cholesky::{
    CholeskySymbolicParams, LdltRef, SymbolicCholesky, SymbolicCholeskyRaw, SymmetricOrdering,
    factorize_symbolic_cholesky,
};
use faer::sparse::{SparseColMatRef, SymbolicSparseColMatRef};
use faer::{Conj, MatMut, Par, Side};

use super::dissection::Pieces;
use super::panels::Panels;
use super::subtrees::Subtree;
use super::supernodal::{Bench, Factorisation, Layout, SMALLEST_PIVOT};
use crate::error::Error;
use crate::threads;

/// LDLᵀ factors of the lower triangle of a matrix of fixed pattern, with −δ on the diagonal of the
/// second block.
pub(super) struct QuasiDefinite {
    kind: Kind,
    factors: Vec<f64>,
    values: Vec<f64>,
    diagonal: Vec<u32>,
    definite: usize,
    regularisation: f64,
}

enum Kind {
    Tight {
        symbolic: SymbolicCholesky<usize>,
        signs: Vec<i8>,
        scratch: MemBuffer,
    },
    /// Used in single precision.
    Loose {
        symbolic: SymbolicCholesky<usize>,
        layout: Layout,
        tree: Subtree,
        bench: Bench,
        panels: Panels,
    },
}

/// Supernodes are merged up to so many columns while zeros are less than this part of them. Substitution reads zeros,
/// too: with faer's own choice factors of plane flows are a tenth larger.
const MERGED: [(usize, f64); 3] = [(4, 0.5), (16, 0.2), (48, 0.05)];

impl QuasiDefinite {
    pub(super) fn new(
        pattern: SymbolicSparseColMatRef<'_, usize>,
        definite: usize,
        regularisation: f64,
        diagonal: Vec<u32>,
        order: Option<(Vec<usize>, Pieces)>,
        loose: bool,
    ) -> Result<Self, Error> {
        let (order, pieces) = order.unzip();
        let order = order.map(|forward| {
            let mut back = vec![0; forward.len()];
            for (place, &unknown) in forward.iter().enumerate() {
                back[unknown] = place;
            }
            (forward, back)
        });
        let ordering = match &order {
            Some((forward, back)) => {
                SymmetricOrdering::Custom(PermRef::new_checked(forward, back, forward.len()))
            }
            None => SymmetricOrdering::Amd,
        };
        let mut parameters = CholeskySymbolicParams::default();
        if loose {
            // Small fill must not lead to factors entry by entry, which take twice the time of a step.
            parameters.supernodal_flop_ratio_threshold = SupernodalThreshold::FORCE_SUPERNODAL;
            parameters.supernodal_params.relax = Some(&MERGED);
        }
        let symbolic = factorize_symbolic_cholesky(pattern, Side::Lower, ordering, parameters)
            .map_err(|e| Error::LinearSolver(format!("{e:?}")))?;
        let factors = vec![0.0; symbolic.len_val()];
        let sign = |unknown: usize| if unknown < definite { 1 } else { -1 };
        let kind = match (symbolic.raw(), symbolic.perm()) {
            (SymbolicCholeskyRaw::Supernodal(supernodes), Some(order)) if loose => {
                let tree = Subtree::new(supernodes, pieces.as_ref());
                let (panels, (layout, bench)) = threads::join(
                    diagonal.len() >= threads::MANY,
                    || Panels::new(supernodes, &tree, order.arrays().0),
                    || {
                        let layout = Layout::new(pattern, order, supernodes, sign);
                        let bench = Bench::new(supernodes, &layout, &tree);
                        (layout, bench)
                    },
                );
                Kind::Loose {
                    bench,
                    layout,
                    tree,
                    panels,
                    symbolic,
                }
            }
            _ => {
                let need = symbolic
                    .factorize_numeric_ldlt_scratch::<f64>(Par::Seq, Default::default())
                    .or(symbolic.solve_in_place_scratch::<f64>(1, Par::Seq));
                Kind::Tight {
                    signs: (0..diagonal.len()).map(sign).collect(),
                    scratch: MemBuffer::try_new(need)
                        .map_err(|_| Error::LinearSolver("out of memory".to_owned()))?,
                    symbolic,
                }
            }
        };
        Ok(Self {
            kind,
            factors,
            values: vec![0.0; pattern.row_idx().len()],
            diagonal,
            definite,
            regularisation,
        })
    }

    pub(super) fn factorise(
        &mut self,
        pattern: SymbolicSparseColMatRef<'_, usize>,
        values: &[f64],
    ) -> Result<(), Error> {
        self.values.copy_from_slice(values);
        for &slot in &self.diagonal[self.definite..] {
            self.values[slot as usize] -= self.regularisation;
        }
        match &mut self.kind {
            Kind::Tight {
                symbolic,
                signs,
                scratch,
            } => symbolic
                .factorize_numeric_ldlt(
                    &mut self.factors,
                    SparseColMatRef::new(pattern, &self.values),
                    Side::Lower,
                    LdltRegularization {
                        dynamic_regularization_signs: Some(signs),
                        dynamic_regularization_delta: SMALLEST_PIVOT,
                        dynamic_regularization_epsilon: SMALLEST_PIVOT,
                    },
                    Par::Seq,
                    MemStack::new(scratch),
                    Default::default(),
                )
                .map(|_| ())
                .map_err(|e| Error::LinearSolver(format!("{e:?}"))),
            Kind::Loose {
                symbolic,
                layout,
                tree,
                bench,
                panels,
            } => {
                let SymbolicCholeskyRaw::Supernodal(symbolic) = symbolic.raw() else {
                    return Err(Error::LinearSolver("no supernodes".to_owned()));
                };
                let work = Factorisation {
                    symbolic,
                    layout,
                    values: &self.values,
                };
                work.factorise(tree, &mut self.factors, bench, panels)
            }
        }
    }

    /// Overwrites x with S⁻¹ x; there must be factors.
    pub(super) fn solve(&mut self, x: &mut [f64]) {
        match &mut self.kind {
            Kind::Tight {
                symbolic, scratch, ..
            } => {
                let rows = x.len();
                LdltRef::new(symbolic, &self.factors).solve_in_place_with_conj(
                    Conj::No,
                    MatMut::from_column_major_slice_mut(x, rows, 1),
                    Par::Seq,
                    MemStack::new(scratch),
                );
            }
            Kind::Loose { panels, .. } => panels.substitute(x),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::linear_solver::Blocks;

    /// The membrane of a square grid with a pressure for each second unknown: supernodes of many widths.
    fn membrane(side: usize) -> (QuasiDefinite, Vec<f64>, Vec<Vec<f64>>) {
        let definite = side * side;
        let size = definite + definite / 2;
        let mut blocks = Blocks::default();
        let mut coefficients = Vec::new();
        let mut add = |rows: [usize; 2], values: [f64; 4]| {
            blocks.push(rows, rows);
            coefficients.extend(values);
        };
        for j in 0..definite {
            if j % side + 1 < side {
                add([j, j + 1], [1.1, -1.0, -1.0, 1.3]);
            }
            if j + side < definite {
                add([j, j + side], [0.9, -0.7, -0.7, 1.0]);
            }
        }
        for cell in 0..definite / 2 {
            add([2 * cell, definite + cell], [0.1, 0.5, 0.5, 0.0]);
        }
        (0..size).for_each(|i| blocks.push([i], [i]));
        let (pattern, slots) = blocks.pattern(size);
        let (slots, diagonal) = slots.split_at(coefficients.len());
        let mut values = vec![0.0; pattern.row_idx().len()];
        for (&slot, c) in slots.iter().zip(&coefficients) {
            values[slot as usize] += c;
        }
        let mut dense = vec![vec![0.0; size]; size];
        for (column, bounds) in pattern.col_ptr().windows(2).enumerate() {
            for slot in bounds[0]..bounds[1] {
                dense[pattern.row_idx()[slot]][column] = values[slot];
            }
        }
        let delta = 0.5;
        (definite..size).for_each(|i| dense[i][i] -= delta);
        let diagonal = diagonal.to_vec();
        let mut factors =
            QuasiDefinite::new(pattern.as_ref(), definite, delta, diagonal, None, true).unwrap();
        factors.factorise(pattern.as_ref(), &values).unwrap();
        let x = (0..size).map(|n| (1.7 * n as f64).sin()).collect();
        (factors, x, dense)
    }

    /// Factors in single precision solve the system to single precision, whatever the widths of supernodes.
    #[test]
    fn panels_solve_the_system_to_single_precision() {
        for side in [2, 7, 19] {
            let (mut factors, expected, dense) = membrane(side);
            assert!(matches!(factors.kind, Kind::Loose { .. }));
            let product = |row: &Vec<f64>| row.iter().zip(&expected).map(|(a, x)| a * x).sum();
            let mut x: Vec<f64> = dense.iter().map(product).collect();
            factors.solve(&mut x);
            let miss = x.iter().zip(&expected).map(|(x, e)| (x - e).abs());
            let miss = miss.fold(0.0_f64, f64::max);
            assert!(miss < 1e-4, "{side}: {miss}");
        }
    }

    /// What the processor is told to do gives the bits of plain loops.
    #[test]
    fn every_processor_gives_the_same_bits() {
        let (mut factors, start, _) = membrane(19);
        let Kind::Loose { panels, .. } = &mut factors.kind else {
            panic!("not in panels");
        };
        let (mut fast, mut plain) = (start.clone(), start);
        panels.substitute(&mut fast);
        panels.substitute_plainly(&mut plain);
        assert!(
            fast.iter()
                .zip(&plain)
                .all(|(a, b)| a.to_bits() == b.to_bits())
        );
    }
}
