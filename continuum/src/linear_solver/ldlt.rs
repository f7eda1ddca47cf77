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
    Tight(Box<Tight>),
    Loose(Box<Loose>),
}

/// Factors that are used in double precision.
struct Tight {
    symbolic: SymbolicCholesky<usize>,
    signs: Vec<i8>,
    scratch: MemBuffer,
}

/// Factors that are used in single precision.
struct Loose {
    symbolic: SymbolicCholesky<usize>,
    layout: Layout,
    tree: Subtree,
    bench: Bench,
    panels: Panels,
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
                Kind::Loose(Box::new(Loose {
                    bench,
                    layout,
                    tree,
                    panels,
                    symbolic,
                }))
            }
            _ => {
                let need = symbolic
                    .factorize_numeric_ldlt_scratch::<f64>(Par::Seq, Default::default())
                    .or(symbolic.solve_in_place_scratch::<f64>(1, Par::Seq));
                Kind::Tight(Box::new(Tight {
                    signs: (0..diagonal.len()).map(sign).collect(),
                    scratch: MemBuffer::try_new(need)
                        .map_err(|_| Error::LinearSolver("out of memory".to_owned()))?,
                    symbolic,
                }))
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
            Kind::Tight(tight) => tight
                .symbolic
                .factorize_numeric_ldlt(
                    &mut self.factors,
                    SparseColMatRef::new(pattern, &self.values),
                    Side::Lower,
                    LdltRegularization {
                        dynamic_regularization_signs: Some(&tight.signs),
                        dynamic_regularization_delta: SMALLEST_PIVOT,
                        dynamic_regularization_epsilon: SMALLEST_PIVOT,
                    },
                    Par::Seq,
                    MemStack::new(&mut tight.scratch),
                    Default::default(),
                )
                .map(|_| ())
                .map_err(|e| Error::Singular(format!("{e:?}"))),
            Kind::Loose(loose) => {
                let Loose {
                    symbolic,
                    layout,
                    tree,
                    bench,
                    panels,
                } = &mut **loose;
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
            Kind::Tight(tight) => {
                let rows = x.len();
                LdltRef::new(&tight.symbolic, &self.factors).solve_in_place_with_conj(
                    Conj::No,
                    MatMut::from_column_major_slice_mut(x, rows, 1),
                    Par::Seq,
                    MemStack::new(&mut tight.scratch),
                );
            }
            Kind::Loose(loose) => loose.panels.substitute(x),
        }
    }
}

#[cfg(test)]
mod tests {
    use faer::sparse::SymbolicSparseColMat;

    use super::*;
    use crate::linear_solver::dissection::dissect;
    use crate::linear_solver::{Blocks, Place};

    /// A matrix by its coefficients, −δ included.
    struct Membrane {
        factors: QuasiDefinite,
        pattern: SymbolicSparseColMat<usize>,
        values: Vec<f64>,
        delta: f64,
    }

    impl Membrane {
        fn size(&self) -> usize {
            self.pattern.ncols()
        }

        fn product(&self, x: &[f64]) -> Vec<f64> {
            let mut y: Vec<f64> = vec![0.0; x.len()];
            for (column, bounds) in self.pattern.col_ptr().windows(2).enumerate() {
                for slot in bounds[0]..bounds[1] {
                    y[self.pattern.row_idx()[slot]] += self.values[slot] * x[column];
                }
            }
            let pressures = self.factors.definite..x.len();
            pressures.for_each(|i| y[i] -= self.delta * x[i]);
            y
        }

        /// Largest error of a solution, of which the right-hand side is made.
        fn miss(&mut self) -> f64 {
            let expected: Vec<f64> = (0..self.size()).map(|n| (1.7 * n as f64).sin()).collect();
            let mut x = self.product(&expected);
            self.factors.solve(&mut x);
            let miss = x.iter().zip(&expected).map(|(x, e)| (x - e).abs());
            miss.fold(0.0_f64, f64::max)
        }
    }

    /// The membrane of a square grid with a pressure for each second unknown: supernodes of many widths. Where places are
    /// known it is dissected; a bridge goes from one corner to the other, of which places know nothing.
    fn membrane(side: usize, with_places: bool, with_bridge: bool) -> Membrane {
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
        if with_bridge {
            add([0, definite - 1], [0.3, -0.2, -0.2, 0.3]);
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
        let delta = 0.5;
        let diagonal = diagonal.to_vec();
        let place = |node: usize| [2 * (node % side) as u32, 2 * (node / side) as u32];
        let places: Vec<Place> = (0..definite)
            .chain((0..definite / 2).map(|cell| 2 * cell))
            .map(place)
            .collect();
        let order = with_places.then(|| dissect(&places, definite));
        let mut factors =
            QuasiDefinite::new(pattern.as_ref(), definite, delta, diagonal, order, true).unwrap();
        factors.factorise(pattern.as_ref(), &values).unwrap();
        Membrane {
            factors,
            pattern,
            values,
            delta,
        }
    }

    /// Factors in single precision solve the system to single precision, whatever the widths of supernodes.
    #[test]
    fn panels_solve_the_system_to_single_precision() {
        for side in [2, 7, 19] {
            let mut membrane = membrane(side, false, false);
            assert!(matches!(membrane.factors.kind, Kind::Loose(_)));
            let miss = membrane.miss();
            assert!(miss < 1e-4, "{side}: {miss}");
        }
    }

    /// Halves of a large membrane are factorised each by itself, and a system with wide supernodes is solved. What
    /// couples the halves past the strip between them makes one of them, and the solution stays.
    #[test]
    fn halves_stand_apart_unless_they_are_coupled() {
        for (with_bridge, are_apart) in [(false, true), (true, false)] {
            let mut membrane = membrane(120, true, with_bridge);
            let Kind::Loose(loose) = &membrane.factors.kind else {
                panic!("not in panels");
            };
            assert_eq!(loose.tree.halves.is_some(), are_apart);
            let miss = membrane.miss();
            assert!(miss < 1e-4, "{with_bridge}: {miss}");
        }
    }

    /// The factors are those that faer makes of the same supernodes.
    #[test]
    fn factors_are_those_of_another_code() {
        let membrane = membrane(120, true, false);
        let factors = &membrane.factors;
        let Kind::Loose(loose) = &factors.kind else {
            panic!("not in panels");
        };
        let symbolic = &loose.symbolic;
        let need = symbolic.factorize_numeric_ldlt_scratch::<f64>(Par::Seq, Default::default());
        let mut expected = vec![0.0; factors.factors.len()];
        symbolic
            .factorize_numeric_ldlt(
                &mut expected,
                SparseColMatRef::new(membrane.pattern.as_ref(), &factors.values),
                Side::Lower,
                LdltRegularization::default(),
                Par::Seq,
                MemStack::new(&mut MemBuffer::new(need)),
                Default::default(),
            )
            .unwrap();
        let SymbolicCholeskyRaw::Supernodal(supernodes) = symbolic.raw() else {
            panic!("no supernodes");
        };
        let mut widest = 0;
        for s in 0..supernodes.n_supernodes() {
            let width = supernodes.supernode_end()[s] - supernodes.supernode_begin()[s];
            let height = width + supernodes.supernode(s).pattern().len();
            let place = supernodes.col_ptr_for_val()[s];
            widest = widest.max(width);
            for column in 0..width {
                for row in column..height {
                    let at = place + column * height + row;
                    let (found, expected) = (factors.factors[at], expected[at]);
                    let miss = (found - expected).abs();
                    assert!(miss < 1e-12 * expected.abs().max(1.0), "{found} {expected}");
                }
            }
        }
        assert!(widest > 100, "{widest}: no supernode of several blocks");
    }

    /// What the processor is told to do gives the bits of plain loops.
    #[test]
    fn every_processor_gives_the_same_bits() {
        let mut membrane = membrane(19, false, false);
        let start: Vec<f64> = (0..membrane.size())
            .map(|n| (1.7 * n as f64).sin())
            .collect();
        let Kind::Loose(loose) = &mut membrane.factors.kind else {
            panic!("not in panels");
        };
        let mut fast = start.clone();
        loose.panels.substitute(&mut fast);
        for by_avx2 in [false, true] {
            let mut plain = start.clone();
            if loose.panels.substitute_plainly(&mut plain, by_avx2) {
                let mut pairs = fast.iter().zip(&plain);
                assert!(pairs.all(|(a, b)| a.to_bits() == b.to_bits()), "{by_avx2}");
            }
        }
    }
}
