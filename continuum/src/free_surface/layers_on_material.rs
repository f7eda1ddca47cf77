//! Layers less than half a cell deep that slide on material.
//!
//! They have no pressure of their own. If they moved with what lies below, the flow through a column of cells would jump
//! by f h Δu where its surface passes half a cell (f: filled part, h: cell size, Δu: shear over a cell): matter
//! gathers there, and a heap that comes to rest keeps steps that do not become smaller with the cells. So they move by
//! themselves: driven by gravity and the pressure gradient of the cells below, which is that of any depth under a
//! surface that is normal to gravity, and held by friction on the whole length of the face they lie on, under the pressure
//! ρ g f h of their weight, which bears the slope tan θ = μ however thin they are.

use super::faces::Face;
use super::operators::{EMPTY, Material};
use super::topology::NONE;
use crate::discretisation::Parts;
use crate::free_surface::faces::weight_onto;
use crate::grid::{Axis, flatten};

/// What a layer changes at the points around a corner on which it slides.
pub(super) struct UnderLayer {
    /// Volume of the point, over that of a cell: its share of the whole length of the face.
    pub volume: f64,
    /// Part of that volume in which there is material to be stretched.
    pub stretched: f64,
    /// Threshold pressure.
    pub pressure: f64,
}

impl<const D: usize, const C: usize> Material<'_, D, C> {
    /// Layers on material feel the pressure gradient below them; they take no part in the divergence.
    pub(super) fn add_pressure_on_layers<const V: usize>(&self, parts: &mut Parts<D, C, V>) {
        for (j, &(component, _)) in self.faces.own.iter().enumerate() {
            let base = self.faces.lies_on[j];
            let axis = &self.grid.axes()[component];
            if base == NONE || *axis == Axis::Flat {
                continue;
            }
            let push = parts.mass[j] / axis.spacing();
            let cells = self.topology.face_cells[component][base];
            for (cell, push) in cells.into_iter().zip([push, -push]) {
                parts.divergence.push((self.faces.pressure[cell], j, 0.0));
                parts.gradient.push(push);
            }
        }
    }

    /// The point of a cell at a corner on which a layer slides; `share` is its part of the cell, `filled` what is filled.
    pub(super) fn under_layer(
        &self,
        cell: usize,
        corner: [usize; D],
        share: f64,
        filled: impl Fn() -> f64,
    ) -> Option<UnderLayer> {
        let last = D - 1;
        let axis = &self.grid.axes()[last];
        // Layers slide in the plane, and on what is inside the grid.
        if D > 2 || axis.boundary_at(corner[last]).is_some() {
            return None;
        }
        let face = flatten(corner, self.grid.faces(0));
        let slides =
            matches!(self.faces.role[0][face], Face::Own(j) if self.faces.lies_on[j] != NONE);
        if !slides {
            return None;
        }
        let above = self.topology.face_cells[0][face];
        let ends = above.iter().any(|&cell| self.fractions[cell] <= EMPTY);
        // An empty cell has no points: those of the other one stand for it.
        let volume = if ends && above.contains(&cell) {
            2.0 * share
        } else {
            share
        };
        let thickness = self.topology.face_mean(0, face, self.fractions) * axis.spacing();
        Some(UnderLayer {
            volume,
            stretched: filled() / volume,
            pressure: thickness * weight_onto(&self.acceleration, last, 0),
        })
    }
}
