//! Flow that enters at the low end of x and leaves at the high one.
//!
//! At the inflow speed and depth are given, on each face of the edge: volume and momentum enter with them, and the
//! strain rate of the first cells knows the speeds on their edge. At the outflow ∂u/∂x = 0: a face on the edge moves with
//! the one before it, so the last column moves along the floor under the pressure of its weight, and what crosses the
//! edge is gone. Nothing comes back in there. What crosses an edge moves along x: the other components are zero on it.

use super::faces::{ACTIVE, Face, Faces};
use super::operators::Material;
use super::topology::NONE;
use crate::discretisation::{Parts, QuadraturePoint};
use crate::error::{Error, require};
use crate::grid::{Axis, Boundary};
use crate::strain::shear_row;

/// What flows in, face by face of the edge, in natural units: row by row from the floor, in space with y faster than z.
#[derive(Debug, Clone, PartialEq)]
pub struct Inflow {
    /// Speed along x in the middle of each face.
    pub speeds: Vec<f64>,
    /// Part of each face that is filled.
    pub fractions: Vec<f64>,
}

impl Inflow {
    /// Refuses what does not flow in, or not on this grid.
    ///
    /// # Errors
    /// [`Error::OutOfRange`] with the key, the value and the allowed range.
    pub(super) fn validate(&self, faces: usize) -> Result<(), Error> {
        for (key, values, most) in [
            ("inflow.speeds", &self.speeds, f64::MAX),
            ("inflow.fractions", &self.fractions, 1.0),
        ] {
            require(
                values.len() == faces,
                key,
                values.len() as f64,
                format!("one for each of {faces} faces of the edge"),
            )?;
            for &value in values {
                let range = format!("0 to {most:e}");
                require((0.0..=most).contains(&value), key, value, range)?;
            }
        }
        let flux: f64 = self
            .speeds
            .iter()
            .zip(&self.fractions)
            .map(|(u, f)| u * f)
            .sum();
        let range = "greater than 0 in all: speeds times filled parts";
        require(flux > 0.0, "inflow", flux, range)
    }
}

/// Ends of x that are open: the high one, and the low one where something flows in.
#[derive(Debug, Clone)]
pub(crate) struct OpenEnds {
    /// What flows in; none where the low end is a wall.
    pub inflow: Option<Inflow>,
    /// Cells along x.
    pub columns: usize,
}

impl OpenEnds {
    /// The face at the low end and that at the high one of each row of cells along x, of `faces` across x in all, with the
    /// part of the first through which something flows in.
    pub(super) fn faces(&self, faces: usize) -> impl Iterator<Item = (usize, usize, f64)> + '_ {
        let width = self.columns + 1;
        (0..faces / width).map(move |row| {
            let filled = self.inflow.as_ref().map_or(0.0, |i| i.fractions[row]);
            (row * width, row * width + self.columns, filled)
        })
    }

    /// Gives the faces on the edge their speed along x.
    pub(super) fn impose(&self, u: &mut [f64]) {
        if let Some(inflow) = &self.inflow {
            let edge = u.iter_mut().step_by(self.columns + 1);
            for (u, speed) in edge.zip(&inflow.speeds) {
                *u = *speed;
            }
        }
    }

    /// Faces at the outflow move with those before them.
    pub(super) fn open<const D: usize>(&self, faces: &mut Faces<D>) {
        for (_, last, _) in self.faces(faces.role[0].len()) {
            if let Some(j) = faces.role[0][last - 1].unknown() {
                faces.role[0][last] = Face::Follows(j);
            }
        }
    }
}

impl<const D: usize, const C: usize> Material<'_, D, C> {
    /// Whether faces across x at this position are an open end.
    pub(super) fn is_open(&self, position: usize) -> bool {
        self.ends.is_some_and(|ends| {
            position == ends.columns || (position == 0 && ends.inflow.is_some())
        })
    }

    /// Speed that is given on a face: that of the inflow.
    pub(super) fn known_velocity(&self, component: usize, face: usize) -> f64 {
        let Some(ends) = self.ends.filter(|_| component == 0) else {
            return 0.0;
        };
        let width = ends.columns + 1;
        match &ends.inflow {
            Some(inflow) if face.is_multiple_of(width) => inflow.speeds[face / width],
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

    /// Adds ∂u/∂x_a + ∂u_a/∂x at an edge of a cell that lies on an open end, where a is the other axis `across` which
    /// the `edge` lies.
    pub(super) fn add_shear_at_end<const V: usize>(
        &self,
        cell: usize,
        edge: [usize; D],
        across: usize,
        point: &mut QuadraturePoint<C, V>,
    ) {
        let axes = self.grid.axes();
        let axis = &axes[across];
        let wall = axis.boundary_at(edge[across]);
        let held = wall.map(|wall| wall.wall_velocity());
        let Some(wall_velocity) = held.unwrap_or(Some(0.0)) else {
            return;
        };
        let side = usize::from(edge[0] > 0);
        let own = self.grid.cell_counts()[0] - 1;
        let beside = axis.cells_at_face(edge[across]).map(|position| {
            let mut at = edge;
            at[0] = edge[0].min(own);
            at[across] = position?;
            Some(self.grid.cell(at))
        });
        // Beyond the surface there is nothing to take a difference with.
        let is_active = |&cell: &usize| self.fractions[cell] > ACTIVE;
        if !beside.iter().flatten().all(is_active) {
            return;
        }
        let row = shear_row::<D>(0, across);
        // A mirrored velocity beyond a wall doubles the difference across half a cell.
        let factor = if wall.is_some() { 2.0 } else { 1.0 } / axis.spacing();
        for (cell, sign) in beside.into_iter().zip([-1.0, 1.0]) {
            let Some(cell) = cell.filter(|_| *axis != Axis::Flat) else {
                continue;
            };
            let rate = sign * factor;
            let face = self.topology.cell_faces[cell][0][side];
            match self.faces.role[0][face].unknown() {
                Some(j) => point.add_velocity(j, row, rate),
                None => point.add_known_rate(row, rate * self.known_velocity(0, face)),
            }
            if wall.is_some() {
                point.add_known_rate(row, -rate * wall_velocity);
            }
        }
        // On the end nothing moves across: so the shear stress on it bears on the column beside it.
        if wall.is_none() {
            let face = match (self.topology.cell_faces[cell][across], beside[1]) {
                ([NONE, _], _) => cell,
                (_, Some(above)) => self.topology.cell_faces[above][across][0],
                _ => return,
            };
            if let Some(j) = self.faces.role[across][face].unknown() {
                let inwards = if side == 0 { 1.0 } else { -1.0 };
                point.add_velocity(j, row, inwards * 2.0 / axes[0].spacing());
            }
        }
    }
}

/// Whether a boundary can be opened: a smooth wall.
pub(super) fn can_open(boundary: Option<&Boundary>) -> bool {
    matches!(boundary, Some(Boundary::FreeSlip))
}
