//! What acts on a flow from outside: matter that is not part of it lies beyond its surface, or shares its cells.
//!
//! Where a surface lies inside other matter it is not free. With p̂ the pressure there and ŝ the deviatoric stress
//! of that matter,
//!
//! ```text
//! p = c p̂ on the surface,      stress of a cell = w ŝ + (1 − w) s,      force of a cell = F
//! ```
//! c says how far the surface is covered (0: free), w is the share of the given stress. Forces go half to each of
//! the two faces of a cell, or all to the one that moves.

use super::faces::Faces;
use super::operators::points_of;
use super::topology::{NONE, Topology};
use crate::discretisation::{COMPONENTS, Parts};
use crate::error::{Error, require};
use crate::grid::DIMENSIONS;

/// Largest share of a given stress: some of its own keeps a cell determined.
const LARGEST_SHARE: f64 = 0.95;

/// What acts from outside, cell by cell, in the flow's units.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Outside<const D: usize = DIMENSIONS, const C: usize = COMPONENTS> {
    /// Pressure p̂ of the matter outside.
    pub pressure: Vec<f64>,
    /// How far it covers a surface, c in [0, 1].
    pub cover: Vec<f64>,
    /// ŝ = ((σ_xx − σ_zz)/2, σ_xz) of that matter, or the five components of [`crate::strain`], positive in tension.
    pub stress: Vec<[f64; C]>,
    /// Its share w in [0, 1].
    pub share: Vec<f64>,
    /// Force on the matter of each cell.
    pub force: Vec<[f64; D]>,
}

impl<const D: usize, const C: usize> Outside<D, C> {
    /// Nothing, on so many cells.
    pub fn nothing(cells: usize) -> Self {
        Self {
            pressure: vec![0.0; cells],
            cover: vec![0.0; cells],
            stress: vec![[0.0; C]; cells],
            share: vec![0.0; cells],
            force: vec![[0.0; D]; cells],
        }
    }

    /// Refuses what does not belong to a grid of so many cells, and numbers out of range.
    pub(crate) fn validate(&self, cells: usize) -> Result<(), Error> {
        let lengths = [
            self.pressure.len(),
            self.cover.len(),
            self.stress.len(),
            self.share.len(),
            self.force.len(),
        ];
        if let Some(&found) = lengths.iter().find(|&&found| found != cells) {
            return Err(Error::ForeignState {
                found,
                expected: cells,
            });
        }
        let shares = [
            ("outside.cover", &self.cover),
            ("outside.share", &self.share),
        ];
        for (key, values) in shares {
            for &value in values {
                require((0.0..=1.0).contains(&value), key, value, "in [0, 1]")?;
            }
        }
        let stresses = self.stress.iter().flatten();
        let forces = self.force.iter().flatten();
        for &value in self.pressure.iter().chain(stresses).chain(forces) {
            require(value.is_finite(), "outside", value, "finite")?;
        }
        Ok(())
    }

    /// Pressure on the surface between the centre of an active cell and that of another, so far on the way.
    pub(super) fn on_surface(&self, active: usize, other: usize, way: f64) -> f64 {
        let (here, there) = (self.pressure[active], self.pressure[other]);
        self.cover[other] * (here + way * (there - here))
    }

    /// Lays the given share of the stress and the forces on the velocities; `places` are those of the points.
    pub(super) fn lay<const V: usize>(
        &self,
        parts: &mut Parts<D, C, V>,
        places: &[usize],
        faces: &Faces<D>,
        topology: &Topology<D>,
    ) {
        let cells = self.share.len();
        for (point, place) in parts.points.iter_mut().zip(places) {
            let cell = place / points_of(D);
            if cell >= cells || self.share[cell] <= 0.0 {
                continue;
            }
            let share = self.share[cell].min(LARGEST_SHARE);
            for (component, stress) in self.stress[cell].into_iter().enumerate() {
                let rates = point.rates(component).iter().zip(point.velocities());
                for (rate, &j) in rates {
                    parts.boundary_load[j] -= point.weight * share * stress * rate;
                }
            }
            point.weight *= 1.0 - share;
        }
        for cell in 0..cells {
            for (axis, force) in self.force[cell].into_iter().enumerate() {
                let movers = movers(faces, topology, cell, axis);
                let count = movers.iter().flatten().count();
                for j in movers.into_iter().flatten() {
                    parts.boundary_load[j] += force / count as f64;
                }
            }
        }
    }

    /// Forces of cells none of whose faces moves: nobody takes them.
    pub(super) fn untaken(&self, faces: &Faces<D>, topology: &Topology<D>) -> [f64; D] {
        let mut sums = [0.0; D];
        for (cell, force) in self.force.iter().enumerate() {
            for (axis, sum) in sums.iter_mut().enumerate() {
                if force[axis] != 0.0 && movers(faces, topology, cell, axis) == [None; 2] {
                    *sum += force[axis];
                }
            }
        }
        sums
    }
}

/// The unknowns that move the two faces of a cell across an axis.
fn movers<const D: usize>(
    faces: &Faces<D>,
    topology: &Topology<D>,
    cell: usize,
    axis: usize,
) -> [Option<usize>; 2] {
    topology.cell_faces[cell][axis].map(|face| match face {
        NONE => None,
        face => faces.role[axis][face].unknown(),
    })
}

#[cfg(test)]
mod tests;
