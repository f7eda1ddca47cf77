//! The discrete operators on a staggered grid: mass, divergence, load, and the strain rate at
//! quadrature points.
//!
//! A quadrature point is a pair of a cell and one of its corners. It takes γ₁ = ∂u/∂x − ∂w/∂z from
//! the cell, γ₂ = ∂u/∂z + ∂w/∂x from the corner and the pressure of the threshold interpolated to
//! the corner, so every term is where it lives on the staggered grid and nothing is averaged under
//! the root of γ̇. The stress of the point is s = ((τ_xx − τ_zz)/2, τ_xz), and Σ W s·γ is the
//! dissipated power.

mod corners;
mod point;

pub(crate) use corners::{VelocityAt, add_corner_shear};
pub use point::QuadraturePoint;

use crate::grid::{DIMENSIONS, Grid};
use crate::linear_solver::Place;
use crate::wall_friction::{PointLaw, SideWalls};
use corners::{normal_faces, push_points};

/// Components of the strain rate (and of the deviatoric stress) in a plane flow.
pub const COMPONENTS: usize = 2;
/// Most velocities that one quadrature point of a plane flow depends on: four faces of the cell, and one
/// more of each component across the corner. It is at least the number of pressures, too.
pub const VELOCITIES: usize = 6;

/// Where the pressure of the threshold is taken.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum ThresholdPressure {
    /// Interpolated linearly to the corner, where the shear rate lives.
    #[default]
    Corner,
    /// The pressure of the cell, as codes with a viscosity in cells do: about twenty times the
    /// error in Bagnold flow. Kept for comparison.
    Cell,
}

/// The discrete operators of one grid, in units with ρ = 1.
#[derive(Debug, Clone)]
pub struct Discretisation<
    const D: usize = DIMENSIONS,
    const C: usize = COMPONENTS,
    const V: usize = VELOCITIES,
> {
    grid: Grid<D>,
    points: Vec<QuadraturePoint<C, V>>,
    mass: Vec<f64>,
    /// Component of each velocity.
    components: Vec<usize>,
    divergence: Vec<(usize, usize, f64)>,
    /// For each entry of the divergence, the force of the cell's pressure on the velocity.
    gradient: Vec<f64>,
    boundary_load: Vec<f64>,
    /// Fluxes out of cells through faces whose velocity is given.
    known_fluxes: Vec<(usize, f64)>,
    cells: usize,
    /// Places of velocities and then cells, where they are known.
    places: Vec<Place<D>>,
}

/// The parts of [`Discretisation`] that depend on where the material lies.
#[derive(Debug, Clone, Default)]
pub(crate) struct Parts<
    const D: usize = DIMENSIONS,
    const C: usize = COMPONENTS,
    const V: usize = VELOCITIES,
> {
    pub points: Vec<QuadraturePoint<C, V>>,
    pub mass: Vec<f64>,
    pub components: Vec<usize>,
    pub divergence: Vec<(usize, usize, f64)>,
    pub gradient: Vec<f64>,
    pub boundary_load: Vec<f64>,
    pub known_fluxes: Vec<(usize, f64)>,
    pub cells: usize,
    /// Places of velocities and then cells in half cells; may be left out.
    pub places: Vec<Place<D>>,
}

impl Discretisation {
    /// Builds the operators.
    pub fn new(grid: Grid, threshold_pressure: ThresholdPressure) -> Self {
        let [nx, nz] = [grid.axes()[0].cells(), grid.axes()[1].cells()];
        let mut points = Vec::new();
        let mut divergence = Vec::new();
        for k in 0..nz {
            for i in 0..nx {
                let cell = [i, k];
                push_points(&grid, cell, threshold_pressure, &mut points);
                for axis in 0..DIMENSIONS {
                    for (unknown, sign) in normal_faces(&grid, axis, cell) {
                        divergence.push((grid.cell(cell), unknown, sign * grid.face_area(axis)));
                    }
                }
            }
        }
        let mut mass = vec![0.0; grid.velocities()];
        let mut boundary_load = vec![0.0; grid.velocities()];
        for component in 0..DIMENSIONS {
            let [fx, fz] = grid.faces(component);
            for k in 0..fz {
                for i in 0..fx {
                    let Some(unknown) = grid.unknown(component, [i, k]) else {
                        continue;
                    };
                    let position = [i, k][component];
                    match grid.axes()[component].boundary_at(position) {
                        None => mass[unknown] = grid.cell_volume(),
                        Some(side) => {
                            // Half a cell belongs to a face on the edge of the grid.
                            mass[unknown] = 0.5 * grid.cell_volume();
                            let inwards = if position == 0 { 1.0 } else { -1.0 };
                            boundary_load[unknown] = inwards
                                * side.outer_pressure().unwrap_or(0.0)
                                * grid.face_area(component);
                        }
                    }
                }
            }
        }
        let parts = Parts {
            points,
            mass,
            components: (0..DIMENSIONS)
                .flat_map(|c| std::iter::repeat_n(c, grid.component(c).len()))
                .collect(),
            gradient: divergence.iter().map(|&(_, _, area)| area).collect(),
            divergence,
            boundary_load,
            known_fluxes: Vec::new(),
            cells: grid.cells(),
            places: Vec::new(),
        };
        Self::of_parts(grid, parts)
    }

    /// Adds the friction of side walls: points that take the velocity for a rate, one for each pair of
    /// a face across x and one across z of a cell.
    pub(crate) fn add_side_walls(&mut self, walls: SideWalls) {
        let grid = &self.grid;
        let [columns, rows] = [grid.axes()[0].cells(), grid.axes()[1].cells()];
        let faces_of = |axis: usize, cell: usize| match grid.axes()[axis].faces_of_cell(cell) {
            None => vec![0],
            Some(pair) => pair.to_vec(),
        };
        for cell in (0..rows).flat_map(|k| (0..columns).map(move |i| [i, k])) {
            let [xs, zs] = [0, 1].map(|axis| faces_of(axis, cell[axis]));
            for (&fx, &fz) in xs.iter().flat_map(|x| zs.iter().map(move |z| (x, z))) {
                let mut point =
                    QuadraturePoint::new(grid.cell_volume() / (xs.len() * zs.len()) as f64);
                for (component, face) in [(0, [fx, cell[1]]), (1, [cell[0], fz])] {
                    if let Some(unknown) = grid.unknown(component, face) {
                        point.add_velocity(unknown, component, 1.0);
                    }
                }
                point.add_pressure(grid.cell(cell), 1.0);
                point.law = PointLaw::SideWalls(walls);
                self.points.push(point);
            }
        }
    }
}

impl<const D: usize, const C: usize, const V: usize> Discretisation<D, C, V> {
    /// The operators of material that fills part of a grid.
    pub(crate) fn of_parts(grid: Grid<D>, parts: Parts<D, C, V>) -> Self {
        let Parts {
            points,
            mass,
            components,
            divergence,
            gradient,
            boundary_load,
            known_fluxes,
            cells,
            places,
        } = parts;
        Self {
            grid,
            points,
            mass,
            components,
            divergence,
            gradient,
            boundary_load,
            known_fluxes,
            cells,
            places,
        }
    }

    /// Places of all unknowns in half cells, where they are known.
    pub(crate) fn places(&self) -> Option<&[Place<D>]> {
        (!self.places.is_empty()).then_some(self.places.as_slice())
    }

    /// What decides where the matrix has coefficients.
    pub(crate) fn pattern(&self) -> Vec<u32> {
        // Room for all at once: it is made in every step.
        let most = 2 + 2 * self.divergence.len() + (2 + 2 * V) * self.points.len();
        let mut pattern = Vec::with_capacity(most);
        pattern.extend([self.velocities(), self.cells].map(|count| count as u32));
        for &(cell, velocity, _) in &self.divergence {
            pattern.extend([cell as u32, velocity as u32]);
        }
        for point in &self.points {
            let (velocities, pressures) = (point.velocities(), point.pressures().0);
            pattern.extend([velocities.len() as u32, pressures.len() as u32]);
            pattern.extend(velocities.iter().map(|&j| j as u32));
            pattern.extend(pressures.iter().map(|&cell| cell as u32));
        }
        pattern
    }

    /// Number of unknown velocities.
    pub fn velocities(&self) -> usize {
        self.mass.len()
    }

    /// Number of unknown pressures.
    pub fn cells(&self) -> usize {
        self.cells
    }

    /// The grid.
    pub fn grid(&self) -> &Grid<D> {
        &self.grid
    }

    /// The quadrature points.
    pub(crate) fn points(&self) -> &[QuadraturePoint<C, V>] {
        &self.points
    }

    /// Points whose threshold pressure comes from more cells than there is room for.
    pub(crate) fn crowded_points(&self) -> usize {
        self.points
            .iter()
            .filter(|point| point.is_crowded())
            .count()
    }

    /// The quadrature points, to be changed.
    pub(crate) fn points_mut(&mut self) -> &mut [QuadraturePoint<C, V>] {
        &mut self.points
    }

    /// Mass of each velocity's control volume.
    pub fn mass(&self) -> &[f64] {
        &self.mass
    }

    /// Component of an unknown velocity.
    pub(crate) fn component_of(&self, velocity: usize) -> usize {
        self.components[velocity]
    }

    /// The divergence, integrated over cells, as entries (cell, velocity, signed face area).
    pub(crate) fn divergence(&self) -> &[(usize, usize, f64)] {
        &self.divergence
    }

    /// Fluxes out of cells through faces whose velocity is given.
    pub(crate) fn known_fluxes(&self) -> &[(usize, f64)] {
        &self.known_fluxes
    }

    /// Superposes a uniform strain rate on that of the unknown velocities, which are then
    /// those of a disturbance.
    pub(crate) fn add_uniform_strain_rate(&mut self, rate: [f64; C]) {
        for point in &mut self.points {
            for (offset, rate) in point.offset.iter_mut().zip(rate) {
                *offset += rate;
            }
        }
    }

    /// The force of the pressure: for each entry of the divergence, force per pressure. It is the
    /// signed area again, except next to a surface inside the grid.
    pub(crate) fn gradient(&self) -> &[f64] {
        &self.gradient
    }

    /// Force of a body acceleration and of the pressure outside the grid on each velocity.
    pub fn load(&self, acceleration: [f64; D]) -> Vec<f64> {
        self.boundary_load
            .iter()
            .zip(&self.mass)
            .zip(&self.components)
            .map(|((load, mass), &component)| load + acceleration[component] * mass)
            .collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::grid::{Axis, Boundary};

    fn bounded(length: f64, cells: usize, low: Boundary, high: Boundary) -> Axis {
        Axis::Bounded {
            length,
            cells,
            low,
            high,
        }
    }

    const WALL: Boundary = Boundary::NoSlip { velocity: 0.0 };
    const LOADED: Boundary = Boundary::LoadedWall {
        velocity: 0.7,
        pressure: 2.0,
    };

    fn operators(axes: [Axis; DIMENSIONS]) -> Discretisation {
        Discretisation::new(Grid::new(axes).unwrap(), ThresholdPressure::Corner)
    }

    #[test]
    fn points_share_the_volume_without_remainder() {
        let periodic = Axis::Periodic {
            length: 3.0,
            cells: 6,
        };
        for (x, volume) in [
            (Axis::Flat, 2.0),
            (periodic, 6.0),
            (bounded(3.0, 6, WALL, LOADED), 6.0),
        ] {
            let z = bounded(2.0, 5, WALL, Boundary::FreeSurface);
            let total: f64 = operators([x, z]).points().iter().map(|q| q.weight).sum();
            assert!((total - volume).abs() < 1e-12);
        }
    }

    /// u = 2x + 3z, w = 0.5x − 2z has γ₁ = 4 and γ₂ = 3.5 everywhere inside.
    #[test]
    fn linear_velocity_has_its_exact_strain_rate() {
        let free = LOADED;
        let d = operators([bounded(3.0, 6, free, free), bounded(2.0, 5, free, free)]);
        let mut u = vec![0.0; d.grid().velocities()];
        for component in 0..DIMENSIONS {
            let [fx, fz] = d.grid().faces(component);
            for (i, k) in (0..fz).flat_map(|k| (0..fx).map(move |i| (i, k))) {
                let half = |on_face: bool| if on_face { 0.0 } else { 0.5 };
                let x = (i as f64 + half(component == 0)) * 0.5;
                let z = (k as f64 + half(component == 1)) * 0.4;
                let unknown = d.grid().unknown(component, [i, k]).unwrap();
                u[unknown] = [2.0 * x + 3.0 * z, 0.5 * x - 2.0 * z][component];
            }
        }
        let mut inside = 0;
        for point in d.points() {
            let gamma = point.strain_rate(&u);
            assert!((gamma[0] - 4.0).abs() < 1e-13);
            // Corners on a wall see the wall's velocity instead.
            if point.side.is_none() && point.offset == [0.0; COMPONENTS] {
                assert!((gamma[1] - 3.5).abs() < 1e-13);
                inside += 1;
            }
        }
        assert_eq!(inside, 4 * 5 * 4);
    }

    #[test]
    fn moving_wall_shears_the_cell_beside_it() {
        let d = operators([Axis::Flat, bounded(1.0, 2, WALL, LOADED)]);
        let u = vec![0.0; d.grid().velocities()];
        // (0.7 − 0) over half a cell of 0.5.
        let top: Vec<f64> = d
            .points()
            .iter()
            .filter(|q| q.side == Some(1))
            .map(|q| q.strain_rate(&u)[1])
            .collect();
        assert_eq!(top, [0.7 / 0.25]);
    }

    #[test]
    fn linear_pressure_is_interpolated_exactly_and_balances_weight() {
        let d = operators([
            bounded(3.0, 3, WALL, WALL),
            bounded(2.0, 4, WALL, Boundary::FreeSurface),
        ]);
        let pressure: Vec<f64> = (0..12)
            .map(|c| 9.0 * (2.0 - 0.5 * ((c / 3) as f64 + 0.5)))
            .collect();
        for point in d.points() {
            let value = point.pressure(&pressure);
            let multiple = value / 4.5;
            assert!((multiple - multiple.round()).abs() < 1e-13 && value <= 18.0 + 1e-12);
        }
        // Hydrostatic: Dᵀ p + F = 0 on every face, the free surface included.
        let mut force = d.load([0.0, -9.0]);
        for &(cell, j, area) in d.divergence() {
            force[j] += area * pressure[cell];
        }
        assert!(force.iter().all(|f| f.abs() < 1e-13));
    }

    /// A seventh pressure has no room at a point of a plane: the first stands for it, and that is counted.
    #[test]
    fn pressures_without_room_are_counted() {
        let grid = Grid::new([bounded(1.0, 3, WALL, WALL), bounded(1.0, 3, WALL, LOADED)]).unwrap();
        let mut discretisation = Discretisation::new(grid, ThresholdPressure::Corner);
        assert_eq!(discretisation.crowded_points(), 0);
        let mut point = QuadraturePoint::new(1.0);
        for cell in 0..VELOCITIES {
            point.add_pressure(cell, 0.1);
            point.add_pressure(cell, 0.0);
        }
        assert!(!point.is_crowded());
        point.add_pressure(VELOCITIES, 0.4);
        discretisation.points_mut()[4] = point;
        assert_eq!(discretisation.crowded_points(), 1);
        let (cells, weights) = discretisation.points()[4].pressures();
        assert_eq!((cells.len(), cells[0], weights[0]), (VELOCITIES, 0, 0.5));
    }
}
