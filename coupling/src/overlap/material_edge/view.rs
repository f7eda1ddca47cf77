//! The continuum's side in SI units, cell by cell, as an edge sees it along its own axis.

use super::cells::Cells;
use super::side::{Side, mirror_rows};
use crate::overlap::joint::{self, FULL, surface_factor};
use crate::overlap::rest_stress::RestStress;
use colluvium_continuum::column_collapse::Collapse;
use nalgebra::Vector2;

/// Fields of all cells (SI).
#[derive(Clone, Debug, Default)]
pub struct View {
    /// Filled part.
    pub fraction: Vec<f64>,
    /// Velocity along x and z (m/s).
    pub velocity: Vec<Vector2<f64>>,
    /// Pressure (Pa); negative where a cell has none.
    pub pressure: Vec<f64>,
    /// ((σ_xx − σ_zz)/2, σ_xz), positive in tension (Pa).
    pub stress: Vec<[f64; 2]>,
    /// What is remembered of the grains' rest.
    pub rest: RestStress,
}

impl View {
    /// Looks at a collapse, along its axis or against it.
    pub fn look(&mut self, collapse: &Collapse, cells: &Cells, as_seen: Side) {
        let (state, units) = (collapse.flow().state(), collapse.units());
        let (columns, stress) = (cells.counts[0], units.stress());
        self.fraction.clone_from(&state.fractions);
        self.pressure.clear();
        self.pressure
            .extend(state.pressure.iter().map(|p| p * stress));
        self.velocity.clear();
        self.stress.clear();
        for cell in 0..cells.count() {
            let (i, k) = (cell % columns, cell / columns);
            let low = i + (columns + 1) * k;
            let across = state.velocity[0][low] + state.velocity[0][low + 1];
            let up = state.velocity[1][cell] + state.velocity[1][cell + columns];
            self.velocity
                .push(Vector2::new(across, up).map(|sum| 0.5 * sum * units.velocity));
            let own = collapse.flow().stresses_in(cell);
            let mean = |c: usize| own.iter().map(|s| s[c]).sum::<f64>() / own.len() as f64;
            self.stress.push([0, 1].map(|c| mean(c) * stress));
        }
        if as_seen == Side::Above {
            mirror_rows(&mut self.fraction, columns);
            mirror_rows(&mut self.pressure, columns);
            mirror_rows(&mut self.velocity, columns);
            mirror_rows(&mut self.stress, columns);
            for (u, stress) in self.velocity.iter_mut().zip(&mut self.stress) {
                *u = as_seen.in_plane((*u).into()).into();
                *stress = as_seen.stress(*stress);
            }
        }
    }

    /// Whether a cell has a pressure of its own.
    pub fn is_full(&self, cell: usize) -> bool {
        self.fraction[cell] > FULL
    }

    /// Takes the shear of a time (s) into what is remembered: differences of velocities between full cells.
    pub fn shear(&mut self, cells: &Cells, dt: f64) {
        for cell in (0..cells.count()).filter(|cell| self.fraction[*cell] > FULL) {
            let [[ux, wx], [uz, wz]] = self.gradient(cells, cell);
            let strain = &mut self.rest.strain[cell];
            strain[0] += (ux - wz) * dt;
            strain[1] += (uz + wx) * dt;
        }
    }

    /// ∂(u, w)/∂x and ∂(u, w)/∂z of a cell (1/s), from differences between the full cells beside it.
    fn gradient(&self, cells: &Cells, cell: usize) -> [[f64; 2]; 2] {
        let [columns, rows] = cells.counts;
        let slope = |index: usize, count: usize, step: usize| {
            let full = |is_there: bool, to: usize| match is_there && self.is_full(to) {
                true => to,
                false => cell,
            };
            let low = full(index > 0, cell.wrapping_sub(step));
            let high = full(index + 1 < count, cell + step);
            let steps = ((high - low) / step).max(1) as f64;
            let change = |axis: usize| self.velocity[high][axis] - self.velocity[low][axis];
            [0, 1].map(|axis| change(axis) / (steps * cells.spacing))
        };
        [
            slope(cell % columns, columns, 1),
            slope(cell / columns, rows, columns),
        ]
    }

    /// Shear rate γ̇ = √(2 D:D) of the material, D traceless (1/s).
    pub fn shear_rate(&self, cells: &Cells, cell: usize) -> f64 {
        let [[ux, wx], [uz, wz]] = self.gradient(cells, cell);
        f64::hypot(ux - wz, uz + wx)
    }

    /// Rotation rate of the material about y, (∂u/∂z − ∂w/∂x)/2 (1/s).
    pub fn rotation(&self, cells: &Cells, cell: usize) -> f64 {
        let [[_, wx], [uz, _]] = self.gradient(cells, cell);
        0.5 * (uz - wx)
    }

    /// Velocity at a place from the full cells around it; none without any.
    pub fn velocity_at(&self, hats: &[(usize, f64); 4]) -> Option<Vector2<f64>> {
        joint::velocity_at(hats, |cell| self.is_full(cell), &self.velocity)
    }

    /// σ_xx with what is remembered, σ_zz, σ_xz (Pa) of a cell, for so many times its pressure.
    pub fn stress_of_grains(&self, cell: usize, factor: f64) -> [f64; 3] {
        let (p, [s, tau]) = (factor * self.pressure[cell].max(0.0), self.stress[cell]);
        let zz = -s - p;
        [self.rest.of_grains(cell, s - p, zz), zz, tau]
    }

    /// Filled part, σ_xx with what is remembered, σ_zz, σ_xz (Pa) and velocity at a place in a row, from the cells beside it;
    /// none where neither is full.
    pub fn across(
        &self,
        cells: &Cells,
        x: f64,
        row: usize,
    ) -> Option<(f64, [f64; 3], Vector2<f64>)> {
        let columns = cells.counts[0];
        let (mut weight, mut fraction) = (0.0, 0.0);
        let (mut sigma, mut velocity) = ([0.0; 3], Vector2::zeros());
        for (column, hat) in cells.columns(x) {
            let cell = column + columns * row;
            if !self.is_full(cell) {
                continue;
            }
            weight += hat;
            let f = self.fraction[cell].min(1.0);
            fraction += hat * f;
            let above = cell + columns;
            let at_surface = above >= cells.count() || !self.is_full(above);
            let factor = match at_surface {
                true => surface_factor(f),
                false => 1.0,
            };
            for (sum, part) in sigma.iter_mut().zip(self.stress_of_grains(cell, factor)) {
                *sum += hat * part;
            }
            velocity += hat * self.velocity[cell];
        }
        let mean = |sum: f64| sum / weight;
        (weight > 0.0).then(|| (mean(fraction), sigma.map(mean), velocity.map(mean)))
    }
}
