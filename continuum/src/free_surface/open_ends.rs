//! Flow that enters at the low end of x and leaves at the high one.
//!
//! At the inflow speed and depth are given: volume and momentum enter with them, and the strain rate of the
//! first cells knows the speed on their edge. At the outflow ∂u/∂x = 0: a face on the edge moves with the
//! one before it, so the last column moves along the floor under the pressure of its weight, and what crosses the
//! edge is gone. Nothing comes back in there. Flows in a plane only have open ends so far.

use super::faces::{ACTIVE, Face, Faces};
use super::operators::Material;
use super::topology::{NONE, Topology};
use super::transport::Velocity;
use crate::discretisation::{Parts, QuadraturePoint};
use crate::error::{Error, require};
use crate::grid::Boundary;

/// What flows in, row by row from the floor, in natural units.
#[derive(Debug, Clone, PartialEq)]
pub struct Inflow {
    /// Speed along x in the middle of each row.
    pub speeds: Vec<f64>,
    /// Part of each row that is filled.
    pub fractions: Vec<f64>,
}

impl Inflow {
    /// Refuses what does not flow in, or not on this grid.
    ///
    /// # Errors
    /// [`Error::OutOfRange`] with the key, the value and the allowed range.
    pub(super) fn validate(&self, rows: usize) -> Result<(), Error> {
        for (key, values, most) in [
            ("inflow.speeds", &self.speeds, f64::MAX),
            ("inflow.fractions", &self.fractions, 1.0),
        ] {
            require(
                values.len() == rows,
                key,
                values.len() as f64,
                format!("one for each of {rows} rows"),
            )?;
            for &value in values {
                let range = format!("0 to {most:e}");
                require((0.0..=most).contains(&value), key, value, range)?;
            }
        }
        Ok(())
    }

    /// Gives the faces on the edge their speed.
    pub(super) fn impose<const D: usize>(
        &self,
        topology: &Topology<D>,
        velocity: &mut Velocity<D>,
    ) {
        let width = velocity[0].len() / self.speeds.len();
        for (row, speed) in self.speeds.iter().enumerate() {
            debug_assert!(topology.is_edge(0, row * width));
            velocity[0][row * width] = *speed;
        }
    }

    /// Faces at the outflow move with those before them.
    pub(super) fn open<const D: usize>(&self, faces: &mut Faces<D>) {
        let width = faces.role[0].len() / self.speeds.len();
        for row in 0..self.speeds.len() {
            let last = row * width + width - 1;
            if let Some(j) = faces.role[0][last - 1].unknown() {
                faces.role[0][last] = Face::Follows(j);
            }
        }
    }
}

impl<const D: usize, const C: usize> Material<'_, D, C> {
    /// Speed that is given on a face: that of the inflow.
    pub(super) fn known_velocity(&self, component: usize, face: usize) -> f64 {
        match self.inflow {
            Some(inflow) if component == 0 => {
                let width = self.grid.faces(0)[0];
                if face.is_multiple_of(width) {
                    inflow.speeds[face / width]
                } else {
                    0.0
                }
            }
            _ => 0.0,
        }
    }

    /// Flux through a face on the edge, which bears no force of its own.
    pub(super) fn add_flux_at_edge<const V: usize>(
        &self,
        p: usize,
        cell: usize,
        side: usize,
        parts: &mut Parts<D, C, V>,
    ) {
        let face = self.topology.cell_faces[cell][0][side];
        let area = self.grid.face_area(0);
        if side == 0 {
            parts
                .known_fluxes
                .push((p, -area * self.known_velocity(0, face)));
        } else if let Face::Follows(j) = self.faces.role[0][face] {
            parts.divergence.push((p, j, area));
            parts.gradient.push(0.0);
        }
    }

    /// Adds γ₂ = ∂u/∂z + ∂w/∂x at a corner of an open end, if it is one.
    pub(super) fn add_shear_at_edge<const V: usize>(
        &self,
        corner: [usize; D],
        point: &mut QuadraturePoint<C, V>,
    ) -> bool {
        let (fx, fz) = (corner[0], corner[1]);
        let (columns, rows) = (self.grid.axes()[0].cells(), self.grid.axes()[1].cells());
        if self.inflow.is_none() || (fx != 0 && fx != columns) {
            return false;
        }
        let spacings = [0, 1].map(|axis| self.grid.axes()[axis].spacing());
        let (side, column) = (usize::from(fx > 0), fx.min(columns - 1));
        let at = |row: usize| row * columns + column;
        // Beyond the surface there is nothing to take a difference with.
        if fz == rows || self.fractions[at(fz)] <= ACTIVE {
            return true;
        }
        let is_floor = fz == 0;
        let pair = if is_floor {
            // The mirrored velocity doubles the difference across half a cell.
            [None, Some(at(0))]
        } else {
            [Some(at(fz - 1)), Some(at(fz))]
        };
        let factor = if is_floor { 2.0 } else { 1.0 } / spacings[1];
        for (cell, sign) in pair.into_iter().zip([-1.0, 1.0]) {
            let Some(cell) = cell else { continue };
            let face = self.topology.cell_faces[cell][0][side];
            match self.faces.role[0][face].unknown() {
                Some(j) => point.add_velocity(j, 1, sign * factor),
                None => point.add_known_rate(1, sign * factor * self.known_velocity(0, face)),
            }
        }
        // On the edge nothing moves across: what flows in and out there is parallel to the floor. So the shear
        // stress on the edge bears on the column beside it.
        if !is_floor {
            let face = self.topology.cell_faces[at(fz)][1][0];
            if face != NONE
                && let Some(j) = self.faces.role[1][face].unknown()
            {
                let inwards = if side == 0 { 1.0 } else { -1.0 };
                point.add_velocity(j, 1, inwards * 2.0 / spacings[0]);
            }
        }
        true
    }
}

/// Whether a boundary can be opened: a smooth wall.
pub(super) fn can_open(boundary: Option<&Boundary>) -> bool {
    matches!(boundary, Some(Boundary::FreeSlip))
}
