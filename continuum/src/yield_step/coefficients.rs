//! The matrix that both solvers fill: [[K, −Dᵀ + G], [−D, 0]] over (u, p), with
//! K = M/Δt + Bᵀ W C B and G = Bᵀ W g P, where C (2 × 2) and g (2) live at quadrature points and P
//! interpolates pressure to them.

use crate::discretisation::Discretisation;
use crate::error::Error;
use crate::grid::Axis;
use crate::linear_solver::{Blocks, Krylov, LOOSE, Method, SparseSystem};
use crate::yield_step::LinearSolver;

/// Velocities of a quadrature point in a plane, to set room aside for.
const MOST_ROWS: usize = 6;

/// The matrix of a step with the places of its coefficients.
pub(super) struct StepMatrix {
    pub(super) system: SparseSystem,
    mass: Vec<u32>,
    divergence: Vec<[u32; 2]>,
    /// Slots of the diagonal of the cells.
    diagonal: Vec<u32>,
    /// Slots of all coefficients but the diagonal of the cells,
    slots: Vec<u32>,
    /// from here on those of all points, one after the other: for each velocity of the point (row), its
    /// velocities and then its pressures (columns).
    points_from: usize,
}

impl StepMatrix {
    /// The matrix of one grid, to be solved to a relative residual `tolerance` where it is solved
    /// iteratively.
    pub(super) fn new<const D: usize, const C: usize, const V: usize>(
        discretisation: &Discretisation<D, C, V>,
        tolerance: f64,
        solver: LinearSolver,
    ) -> Result<Self, Error> {
        let velocities = discretisation.velocities();
        let size = velocities + discretisation.cells();
        let points = discretisation.points();
        let mut blocks = Blocks::with_capacity(
            size + 2 * discretisation.divergence().len() + points.len(),
            size + 2 * discretisation.divergence().len() + MOST_ROWS * points.len(),
        );
        (0..velocities).for_each(|j| blocks.push([j], [j]));
        for &(cell, j, _) in discretisation.divergence() {
            blocks.push([j], [velocities + cell]);
            blocks.push([velocities + cell], [j]);
        }
        for point in points {
            let rows = point.velocities().iter().copied();
            let cells = point.pressures().0.iter().map(|cell| velocities + cell);
            blocks.push(rows.clone(), rows.chain(cells));
        }
        let given = blocks.coefficients();
        (velocities..size).for_each(|i| blocks.push([i], [i]));
        let method = method_for(discretisation, tolerance, solver);
        let (system, slots) = SparseSystem::new(size, blocks, method, discretisation.places())?;
        let mut slots = slots;
        let diagonal = slots.split_off(given);
        let points_from = velocities + 2 * discretisation.divergence().len();
        let (mass, divergence) = slots[..points_from].split_at(velocities);
        Ok(Self {
            system,
            mass: mass.to_vec(),
            divergence: divergence.chunks_exact(2).map(|c| [c[0], c[1]]).collect(),
            points_from,
            diagonal,
            slots,
        })
    }

    /// Fills the matrix; `law` gives C and g at each point. Where a cell is released its pressure
    /// is zero and its divergence free.
    pub(super) fn fill<const D: usize, const C: usize, const V: usize>(
        &mut self,
        discretisation: &Discretisation<D, C, V>,
        dt: f64,
        released: &[bool],
        law: impl Fn(usize) -> ([[f64; C]; C], [f64; C]),
    ) {
        let values = self.system.values_mut();
        values.fill(0.0);
        for (&slot, m) in self.mass.iter().zip(discretisation.mass()) {
            values[slot as usize] += m / dt;
        }
        let entries = discretisation
            .divergence()
            .iter()
            .zip(discretisation.gradient());
        for (slots, (&(cell, _, area), force)) in self.divergence.iter().zip(entries) {
            values[slots[0] as usize] -= force;
            if !released[cell] {
                values[slots[1] as usize] -= area;
            }
        }
        let volume = discretisation.grid().cell_volume();
        for (&slot, _) in self.diagonal.iter().zip(released).filter(|(_, r)| **r) {
            values[slot as usize] -= volume;
        }
        let mut slots = self.slots[self.points_from..].iter();
        for (q, point) in discretisation.points().iter().enumerate() {
            let (c, g) = law(q);
            let velocities = point.velocities().len();
            let pressure_weights = point.pressures().1;
            // C is symmetric.
            for row in 0..velocities {
                // Row of Bᵀ W C, then of Bᵀ W g.
                let left: [f64; C] =
                    std::array::from_fn(|a| point.weight * point.force(row, &c[a]));
                for (column, &slot) in (0..velocities).zip(slots.by_ref()) {
                    values[slot as usize] += point.force(column, &left);
                }
                let by_pressure = point.weight * point.force(row, &g);
                for (weight, &slot) in pressure_weights.iter().zip(slots.by_ref()) {
                    values[slot as usize] += by_pressure * weight;
                }
            }
        }
    }
}

/// δ of the preconditioner, as a fraction of the cell volume: small against the cell volume over the
/// largest viscosity where matter flows, large enough for factors without pivoting that are kept in
/// single precision. Collapses need 12.4, 10.3, 11.5 and 20 iterations at 1e-6, 1e-5, 1e-4 and 1e-3.
const PRESSURE_REGULARISATION: f64 = 1e-5;
/// The same for factors that are kept in double precision.
const SMALL_REGULARISATION: f64 = 1e-8;

/// How much more the divergence counts than momentum in the residual of a loose solution in a plane: it has to be met by
/// so much more closely, and the preconditioner leaves no more of it than δ, so that this costs no iteration.
const CONTINUITY_WEIGHT: f64 = 1e4;

/// Flows along one axis have narrow bands and are solved directly.
fn method_for<const D: usize, const C: usize, const V: usize>(
    discretisation: &Discretisation<D, C, V>,
    tolerance: f64,
    solver: LinearSolver,
) -> Method {
    let grid = discretisation.grid();
    let axes = grid.axes().iter().filter(|axis| **axis != Axis::Flat);
    if axes.count() <= 1 {
        return Method::Direct;
    }
    let share = if tolerance < LOOSE {
        SMALL_REGULARISATION
    } else {
        PRESSURE_REGULARISATION
    };
    let krylov = Krylov {
        definite: discretisation.velocities(),
        regularisation: share * grid.cell_volume(),
        tolerance,
        weight: if D == 2 && tolerance >= LOOSE {
            CONTINUITY_WEIGHT
        } else {
            1.0
        },
    };
    match solver {
        LinearSolver::Multigrid => Method::Multigrid(krylov),
        LinearSolver::Factors => Method::Preconditioned(krylov),
    }
}
