//! The continuum's side: a bed in space, and its fields in SI units, cell by cell.

use super::cells::Cells;
use super::gradients::{gradient, shear_components};
use crate::overlap::OverlapError;
use crate::overlap::joint::{self, FULL, surface_factor};
use crate::overlap::rest_stress::RestStress;
use colluvium_continuum::free_surface::{SpaceFlow, SurfaceOptions};
use colluvium_continuum::grid::{Axis, Boundary, Grid};
use colluvium_continuum::rheology::{MuI, Rheology};
use colluvium_continuum::strain::deviator;
use colluvium_continuum::units::Units;
use nalgebra::{Matrix3, Vector3};

/// A bed at rest that fills these fractions, over a rough floor and between smooth walls, in natural units.
///
/// # Errors
/// Settings out of range.
pub fn bed(
    cells: &Cells,
    fractions: Vec<f64>,
    law: &MuI,
    units: &Units,
    options: &SurfaceOptions,
) -> Result<SpaceFlow<MuI>, OverlapError> {
    let axis = |axis: usize, low| Axis::Bounded {
        length: cells.spacing[axis] * cells.counts[axis] as f64 / units.length,
        cells: cells.counts[axis],
        low,
        high: Boundary::FreeSlip,
    };
    let grid = Grid::with_moving_surface([
        axis(0, Boundary::FreeSlip),
        axis(1, Boundary::FreeSlip),
        axis(2, Boundary::NoSlip { velocity: 0.0 }),
    ])?;
    Ok(SpaceFlow::in_space(
        grid,
        fractions,
        law.in_units(units),
        [0.0, 0.0, -1.0],
        // The copy is made anew at every exchange.
        options.of_first_order(),
    )?)
}

/// Fields of all cells (SI).
#[derive(Clone, Debug, Default)]
pub struct View {
    /// Filled part.
    pub fraction: Vec<f64>,
    /// Velocity (m/s).
    pub velocity: Vec<Vector3<f64>>,
    /// σ, positive in tension; of a cell at the surface at its filled part's mean (Pa).
    pub stress: Vec<Matrix3<f64>>,
    /// What is remembered of the grains' rest; in `stress`.
    pub rest: RestStress,
}

impl View {
    /// Looks at a flow, a time (s) after it was looked at before: 0 where nothing has moved since.
    pub fn look(&mut self, flow: &SpaceFlow<MuI>, cells: &Cells, units: &Units, dt: f64) {
        let state = flow.state();
        let points = state.stress.len() / state.fractions.len();
        let [nx, ny, _] = cells.counts;
        self.fraction.clone_from(&state.fractions);
        self.velocity.clear();
        self.stress.clear();
        for cell in 0..cells.count() {
            let [i, j, k] = cells.index(cell);
            let pairs = [
                [0, 1].map(|n| i + n + (nx + 1) * (j + ny * k)),
                [0, 1].map(|n| i + nx * (j + n + (ny + 1) * k)),
                [0, 1].map(|n| i + nx * (j + ny * (k + n))),
            ];
            let mean = |axis: usize| {
                let faces = pairs[axis].map(|face| state.velocity[axis][face]);
                0.5 * (faces[0] + faces[1]) * units.velocity
            };
            self.velocity.push(Vector3::new(mean(0), mean(1), mean(2)));
            let own = &state.stress[cell * points..(cell + 1) * points];
            let s: [f64; 5] =
                std::array::from_fn(|c| own.iter().map(|s| s[c]).sum::<f64>() / points as f64);
            let fraction = state.fractions[cell];
            let is_full = |cell: usize| state.fractions[cell] > FULL;
            let factor = match cells.above(cell) {
                Some(above) if is_full(above) => 1.0,
                _ if is_full(cell) => surface_factor(fraction.min(1.0)),
                _ => 0.0,
            };
            let p = factor * state.pressure[cell].max(0.0);
            let [xx, yy, zz] = deviator(s).map(|t| t - p);
            self.stress.push(
                units.stress() * Matrix3::new(xx, s[2], s[3], s[2], yy, s[4], s[3], s[4], zz),
            );
        }
        for cell in (0..cells.count()).filter(|_| dt > 0.0) {
            let rate = shear_components(&gradient(self, cells, cell));
            for (sum, rate) in self.rest.strain[cell].iter_mut().zip(rate) {
                *sum += rate * dt;
            }
        }
        for cell in (0..cells.count()).filter(|cell| state.fractions[*cell] > FULL) {
            let stress = &mut self.stress[cell];
            *stress += sideways(self.rest.beyond(cell, stress[(2, 2)]));
        }
    }

    /// Whether a cell has a pressure of its own.
    pub fn is_full(&self, cell: usize) -> bool {
        self.fraction[cell] > FULL
    }

    /// Velocity at a place from the full cells around it; none without any.
    pub fn velocity_at(&self, hats: &[(usize, f64); 8]) -> Option<Vector3<f64>> {
        joint::velocity_at(hats, |cell| self.is_full(cell), &self.velocity)
    }

    /// Filled part, stress (Pa) and velocity between two cells, from those that are full; none where neither is.
    pub fn between(&self, pair: [usize; 2]) -> Option<(f64, Matrix3<f64>, Vector3<f64>)> {
        let full = || pair.into_iter().filter(|&cell| self.is_full(cell));
        let share = 1.0 / full().count() as f64;
        share.is_finite().then(|| {
            let fraction: f64 = full().map(|cell| self.fraction[cell].min(1.0)).sum();
            let stress: Matrix3<f64> = full().map(|cell| self.stress[cell]).sum();
            let velocity: Vector3<f64> = full().map(|cell| self.velocity[cell]).sum();
            (share * fraction, share * stress, share * velocity)
        })
    }
}

/// A stress that is the same in both horizontal directions (Pa).
pub fn sideways(stress: f64) -> Matrix3<f64> {
    Matrix3::from_diagonal(&Vector3::new(stress, stress, 0.0))
}

/// The components of a stress as [`colluvium_continuum::strain`] has them, and its pressure (Pa).
pub fn components(stress: &Matrix3<f64>) -> ([f64; 5], f64) {
    let s = |i: usize, j: usize| stress[(i, j)];
    let deviatoric = [
        0.5 * (s(0, 0) - s(1, 1)),
        (s(0, 0) + s(1, 1) - 2.0 * s(2, 2)) / (2.0 * 3.0_f64.sqrt()),
        s(0, 1),
        s(0, 2),
        s(1, 2),
    ];
    (deviatoric, -stress.trace() / 3.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_stress_comes_back_from_its_components() {
        let stress = Matrix3::new(-3.0, 0.4, -0.2, 0.4, -5.0, 0.7, -0.2, 0.7, -4.5);
        let (s, p) = components(&stress);
        let [xx, yy, zz] = deviator(s).map(|t| t - p);
        let back = Matrix3::new(xx, s[2], s[3], s[2], yy, s[4], s[3], s[4], zz);
        assert!((back - stress).norm() < 1e-14);
    }
}
