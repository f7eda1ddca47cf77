//! Geometric multigrid on velocities and pressures together, as a preconditioner.
//!
//! Each coarser grid has cells twice as long, with velocities on faces and pressures in cells like the finest
//! one; its matrix is the Galerkin product RᵀAR (`galerkin.rs`, `transfer.rs`). A sweep of the smoother
//! solves, cell by cell, for the pressure of a cell and the velocities on its faces together (Vanka,
//! *J. Comput. Phys.* 65 (1986) 138; `cell_blocks.rs`), which needs no diagonal where the pressures
//! stand. What the strain rate lacks to resist a change of volume is added to the finest matrix
//! (`augmentation.rs`). The coarsest grid is solved with LDLᵀ factors of its symmetric part.
//! Everything is done in one order.
//!
//! Where friction makes a pressure brake what leaves its cell by more than it pushes, the block of the cell has no
//! stable solution and its smoothing none either; such blocks leave friction out.
//!
//! Work and memory grow in proportion to the number of unknowns, where those of factors of a grid in
//! space grow with its 2nd and 4/3rd power.

mod augmentation;
mod cell_blocks;
mod galerkin;
mod transfer;

use faer::sparse::{SymbolicSparseColMat, SymbolicSparseColMatRef};

use super::Place;
use super::dissection::dissect;
use super::ldlt::QuasiDefinite;
use crate::error::Error;
use augmentation::Augmentation;
use cell_blocks::CellBlocks;
use galerkin::Product;
use transfer::Transfer;

/// A sparse matrix by columns.
#[derive(Debug, Clone, Default)]
struct Columns {
    starts: Vec<usize>,
    rows: Vec<u32>,
    values: Vec<f64>,
}

impl Columns {
    fn size(&self) -> usize {
        self.starts.len() - 1
    }

    #[inline]
    fn column(&self, j: usize) -> (&[u32], &[f64]) {
        let range = self.starts[j]..self.starts[j + 1];
        (&self.rows[range.clone()], &self.values[range])
    }

    /// r −= A x.
    fn subtract_product(&self, x: &[f64], r: &mut [f64]) {
        for (j, &x) in x.iter().enumerate() {
            let (rows, values) = self.column(j);
            for (&row, value) in rows.iter().zip(values) {
                r[row as usize] -= value * x;
            }
        }
    }
}

/// One grid that is smoothed on, and the way to the next coarser one.
struct Level {
    matrix: Columns,
    blocks: CellBlocks,
    transfer: Transfer,
    product: Product,
    residual: Vec<f64>,
    solution: Vec<f64>,
}

/// The coarsest grid.
struct Coarsest {
    pattern: SymbolicSparseColMat<usize>,
    values: Vec<f64>,
    factors: QuasiDefinite,
    solution: Vec<f64>,
}

/// A V-cycle for a matrix of fixed pattern.
pub(super) struct Multigrid {
    levels: Vec<Level>,
    coarsest: Coarsest,
    augmentation: Augmentation,
}

/// A grid of fewer pressures is solved with factors.
const COARSEST: usize = 150;
/// Sweeps before and after the coarser grids.
const SWEEPS: usize = 2;

impl Multigrid {
    /// Sets the grids up. `definite` velocities come first.
    ///
    /// # Errors
    /// [`Error::LinearSolver`] if the pattern of the coarsest grid cannot be analysed.
    pub(super) fn new<const D: usize>(
        pattern: SymbolicSparseColMatRef<'_, usize>,
        definite: usize,
        regularisation: f64,
        places: &[Place<D>],
    ) -> Result<Self, Error> {
        let mut matrix = Columns {
            starts: pattern.col_ptr().to_vec(),
            rows: pattern.row_idx().iter().map(|&row| row as u32).collect(),
            values: vec![0.0; pattern.row_idx().len()],
        };
        let augmentation = Augmentation::new(&matrix, definite);
        let mut places = places.to_vec();
        let mut definite = definite;
        let mut regularisation = regularisation;
        let mut levels: Vec<Level> = Vec::new();
        loop {
            let size = matrix.size();
            let blocks = CellBlocks::new(&matrix, definite, &places, levels.is_empty());
            let (transfer, coarse_places, coarse_definite) = Transfer::new(&places, definite);
            let (product, coarse) = Product::new(&matrix, &transfer);
            levels.push(Level {
                matrix,
                blocks,
                transfer,
                product,
                residual: vec![0.0; size],
                solution: vec![0.0; size],
            });
            matrix = coarse;
            let is_coarsest = matrix.size() - coarse_definite < COARSEST
                || coarse_places.len() * 2 > places.len();
            places = coarse_places;
            definite = coarse_definite;
            regularisation *= (1 << D) as f64;
            if is_coarsest {
                break;
            }
        }
        Ok(Self {
            augmentation,
            levels,
            coarsest: Coarsest::new(matrix, definite, regularisation, &places)?,
        })
    }

    /// Takes over the coefficients and makes those of the coarser grids.
    ///
    /// # Errors
    /// [`Error::LinearSolver`] if memory runs out.
    pub(super) fn set_up(&mut self, values: &[f64]) -> Result<(), Error> {
        self.levels[0].matrix.values.copy_from_slice(values);
        self.augmentation.add_to(&mut self.levels[0].matrix);
        for l in 0..self.levels.len() {
            let (fine, coarser) = self.levels.split_at_mut(l + 1);
            let level = &mut fine[l];
            level.blocks.invert(&level.matrix);
            let coarse = match coarser.first_mut() {
                Some(next) => &mut next.matrix.values,
                None => &mut self.coarsest.values,
            };
            level
                .product
                .evaluate(&level.matrix, &mut level.transfer, coarse);
        }
        let coarsest = &mut self.coarsest;
        coarsest
            .factors
            .factorise(coarsest.pattern.as_ref(), &coarsest.values)
    }

    /// Overwrites x with one V-cycle's approximation of A⁻¹ x.
    pub(super) fn solve(&mut self, x: &mut [f64]) {
        let finest = &mut self.levels[0];
        finest.residual.copy_from_slice(x);
        self.augmentation
            .add_to_residual(&finest.matrix, &mut finest.residual);
        cycle(&mut self.levels, &mut self.coarsest);
        x.copy_from_slice(&self.levels[0].solution);
    }
}

/// Solves for the residual of the first level; the result is its `solution`.
fn cycle(levels: &mut [Level], coarsest: &mut Coarsest) {
    let (level, coarser) = match levels {
        [level, coarser @ ..] => (level, coarser),
        [] => return,
    };
    let Level {
        matrix,
        blocks,
        transfer,
        residual,
        solution,
        ..
    } = level;
    solution.fill(0.0);
    for _ in 0..SWEEPS {
        blocks.sweep_forward(matrix, residual, solution);
    }
    let correction = match coarser.first_mut() {
        Some(next) => {
            transfer.restrict(residual, &mut next.residual);
            cycle(coarser, coarsest);
            &coarser[0].solution
        }
        None => {
            transfer.restrict(residual, &mut coarsest.solution);
            coarsest.factors.solve(&mut coarsest.solution);
            &coarsest.solution
        }
    };
    transfer.prolong(matrix, correction, solution, residual);
    for _ in 0..SWEEPS {
        blocks.sweep_backward(matrix, residual, solution);
    }
}

impl Coarsest {
    fn new<const D: usize>(
        matrix: Columns,
        definite: usize,
        regularisation: f64,
        places: &[Place<D>],
    ) -> Result<Self, Error> {
        let size = matrix.size();
        let mut diagonal = Vec::with_capacity(size);
        for j in 0..size {
            let first = matrix.starts[j];
            let (rows, _) = matrix.column(j);
            // The product gives every unknown a diagonal.
            let offset = rows.iter().position(|&row| row as usize == j).unwrap_or(0);
            diagonal.push((first + offset) as u32);
        }
        let rows = matrix.rows.iter().map(|&row| row as usize).collect();
        let pattern = SymbolicSparseColMat::new_checked(size, size, matrix.starts, None, rows);
        let factors = QuasiDefinite::new(
            pattern.as_ref(),
            definite,
            regularisation,
            diagonal,
            Some(dissect(places, definite)),
            false,
        )?;
        Ok(Self {
            values: vec![0.0; pattern.row_idx().len()],
            pattern,
            factors,
            solution: vec![0.0; size],
        })
    }
}

#[cfg(test)]
mod tests {
    use super::super::gmres::{Gmres, Goal};
    use super::super::pattern::Blocks;
    use super::*;

    /// Creeping flow in a box of n × n cells that is open on the right, with a disc `contrast` times as viscous:
    /// pattern, coefficients, places, and the number of velocities.
    #[allow(clippy::type_complexity)]
    fn stokes(n: u32, contrast: f64) -> (SymbolicSparseColMat<usize>, Vec<f64>, Vec<Place>, usize) {
        let extent = 2 * n + 1;
        let mut number = vec![None; (extent * extent) as usize];
        let mut places: Vec<Place> = Vec::new();
        let is_face = |x: u32, z: u32| (x + z) % 2 == 1;
        let is_inside =
            |x: u32, z: u32| x > 0 && z > 0 && z < 2 * n && (x < 2 * n || is_face(x, z));
        for kind in 0..2 {
            for (z, x) in (0..extent).flat_map(|z| (0..extent).map(move |x| (z, x))) {
                let wanted = [is_face(x, z), x % 2 == 1 && z % 2 == 1][kind];
                if wanted && is_inside(x, z) {
                    number[(x + extent * z) as usize] = Some(places.len() as u32);
                    places.push([x, z]);
                }
            }
        }
        let definite = places.iter().filter(|[x, z]| is_face(*x, *z)).count();
        let at = |x: u32, z: u32| number.get((x + extent * z) as usize).copied().flatten();
        let viscosity = |x: u32, z: u32| {
            let [dx, dz] = [x, z].map(|p| f64::from(p) / f64::from(2 * n) - 0.45);
            if dx.hypot(dz) < 0.25 { contrast } else { 1.0 }
        };
        let mut entries = Vec::new();
        for j in 0..definite as u32 {
            entries.push(([j, j], 1e-3));
        }
        for (z, x) in (1..extent - 1).flat_map(|z| (1..extent - 1).map(move |x| (z, x))) {
            let sides = [
                (x + 1, z, 1.0),
                (x - 1, z, -1.0),
                (x, z + 1, 1.0),
                (x, z - 1, -1.0),
            ];
            let rates: Vec<(u32, f64)> = if x % 2 == 1 && z % 2 == 1 {
                let cell = at(x, z).unwrap();
                for (x, z, sign) in sides {
                    if let Some(j) = at(x, z) {
                        entries.extend([([cell, j], -sign), ([j, cell], -sign)]);
                    }
                }
                let stretch = sides.map(|(a, b, sign)| (a, b, if b == z { sign } else { -sign }));
                stretch
                    .iter()
                    .filter_map(|&(x, z, r)| Some((at(x, z)?, r)))
                    .collect()
            } else if x % 2 == 0 && z % 2 == 0 {
                sides
                    .iter()
                    .filter_map(|&(x, z, r)| Some((at(x, z)?, r)))
                    .collect()
            } else {
                continue;
            };
            for &(i, a) in &rates {
                for &(j, b) in &rates {
                    entries.push(([i, j], viscosity(x, z) * a * b));
                }
            }
        }
        let size = places.len();
        let mut blocks = Blocks::default();
        for &([row, column], _) in &entries {
            blocks.push([row as usize], [column as usize]);
        }
        (0..size).for_each(|i| blocks.push([i], [i]));
        let (pattern, slots) = blocks.pattern(size);
        let mut values = vec![0.0; pattern.row_idx().len()];
        for (slot, (_, value)) in slots.iter().zip(&entries) {
            values[*slot as usize] += value;
        }
        (pattern, values, places, definite)
    }

    /// Iterations of GMRES to 1e-6, with or without the cycle; none if it gives up.
    fn iterations(n: u32, contrast: f64, with_multigrid: bool) -> Option<usize> {
        let (pattern, values, places, definite) = stokes(n, contrast);
        let mut multigrid = Multigrid::new(pattern.as_ref(), definite, 1e-8, &places).unwrap();
        multigrid.set_up(&values).unwrap();
        let right_hand_side: Vec<f64> = (0..places.len())
            .map(|j| {
                if j < definite {
                    (3.0 * j as f64).sin()
                } else {
                    0.0
                }
            })
            .collect();
        let mut x = vec![0.0; places.len()];
        let mut count = 0;
        let multiply = |x: &[f64], y: &mut [f64]| super::super::multiply(&pattern, &values, x, y);
        let precondition = |x: &mut [f64]| {
            count += 1;
            if with_multigrid {
                multigrid.solve(x);
            }
        };
        let mut gmres = Gmres::new(places.len());
        let solved = gmres.solve(
            multiply,
            precondition,
            &right_hand_side,
            &mut x,
            Goal::full(1e-6),
        );
        solved.then_some(count)
    }

    /// The number of iterations does not grow with the grid; without the cycle there is no end. A stiff disc
    /// afloat, of which the coarser grids see no sharp edge, costs more (6, 9 and 34 iterations at 10, 100 and 1000 times the
    /// viscosity, no end at 10⁶): rigid matter that stands on a floor, as in a heap, does not.
    #[test]
    fn iterations_do_not_grow_with_the_grid() {
        for contrast in [1.0, 10.0, 100.0] {
            let counts = [16, 32, 64].map(|n| iterations(n, contrast, true).unwrap());
            eprintln!("contrast {contrast}: {counts:?}");
            assert!(counts.iter().all(|count| *count <= 12), "{counts:?}");
        }
        assert_eq!(iterations(32, 1.0, false), None);
    }
}
