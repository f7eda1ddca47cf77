//! Layers less than half a cell deep that slide on material.
//!
//! They have no pressure of their own. If they moved with what lies below, the flow through a column of cells would jump
//! by f h Δu where its surface passes half a cell (f: filled part, h: cell size, Δu: shear over a cell): matter
//! gathers there, and a heap that comes to rest keeps steps that do not become smaller with the cells. So they move by
//! themselves: driven by gravity and the pressure gradient of the cells below, which is that of any depth under a
//! surface that is normal to gravity, and held by friction on the whole length of the face they lie on, under the pressure
//! ρ g f h of their weight, which bears the slope tan θ = μ however thin they are.

use super::faces::Face;
use super::operators::{EMPTY, Material, points_of};
use super::topology::NONE;
use crate::discretisation::{Parts, QuadraturePoint};
use crate::free_surface::faces::weight_onto;
use crate::grid::Axis;
use crate::strain::shear_row;

/// Axes of space.
const SPACE: usize = 3;

/// What layers change at a point beside a corner on which they slide.
pub(super) struct UnderLayer<const D: usize> {
    /// Volume of the point, over that of a cell: its share of the whole length of the face.
    pub volume: f64,
    /// Part of that volume in which there is material to be stretched.
    stretched: f64,
    /// Part of it in which each component is sheared against what lies below.
    sheared: [f64; D],
    /// Threshold pressure.
    pub pressure: f64,
}

impl<const D: usize> UnderLayer<D> {
    /// Leaves of the strain rate at the point what there is in its volume.
    pub(super) fn scale<const C: usize, const V: usize>(&self, point: &mut QuadraturePoint<C, V>) {
        let mut factors = [self.stretched; C];
        for (component, part) in self.sheared.into_iter().enumerate().take(D - 1) {
            factors[shear_row::<D>(component, D - 1)] = part;
        }
        for (row, factor) in factors.into_iter().enumerate() {
            if factor < 1.0 {
                point.scale_rate(row, factor);
            }
        }
    }
}

impl<const D: usize, const C: usize> Material<'_, D, C> {
    /// Layers on material feel the pressure gradient below them, each with all of its mass; they take no part in the
    /// divergence.
    pub(super) fn add_pressure_on_layers<const V: usize>(
        &self,
        mass: &[f64],
        parts: &mut Parts<D, C, V>,
    ) {
        for (j, &(component, _)) in self.faces.own.iter().enumerate() {
            let base = self.faces.lies_on[j];
            let axis = &self.grid.axes()[component];
            if base == NONE || *axis == Axis::Flat {
                continue;
            }
            let push = mass[j] / axis.spacing();
            let cells = self.topology.face_cells[component][base];
            for (cell, push) in cells.into_iter().zip([push, -push]) {
                parts.divergence.push((self.faces.pressure[cell], j, 0.0));
                parts.gradient.push(push);
            }
        }
    }

    /// The point of a cell at one of its corners if a layer slides there; `share` is its part of the cell, `filled` what is
    /// filled. In space two components meet in it, each with the face of its own beside the cell: one may slide where
    /// the other does not.
    pub(super) fn under_layer(
        &self,
        cell: usize,
        side: [usize; D],
        share: f64,
        filled: impl Fn() -> f64,
    ) -> Option<UnderLayer<D>> {
        let last = D - 1;
        // The face of a component above the corner.
        let above = |component: usize| {
            let own = match self.topology.cell_faces[cell][component][side[component]] {
                // A flat axis has one face for each cell.
                NONE => cell,
                own => own,
            };
            match side[last] {
                0 => own,
                _ => self.topology.face_neighbours[component][own][last][1],
            }
        };
        let mut volumes = [0.0; D];
        for (component, volume) in volumes.iter_mut().enumerate().take(last) {
            let face = above(component);
            let slides = face != NONE
                && matches!(self.faces.role[component][face], Face::Own(j) if self.faces.lies_on[j] != NONE);
            if slides {
                let cells = self.topology.face_cells[component][face];
                let ends = cells.iter().any(|&cell| self.fractions[cell] <= EMPTY);
                // An empty cell has no points: those of the other one stand for it.
                *volume = if ends && side[last] == 0 {
                    2.0 * share
                } else {
                    share
                };
            }
        }
        let volume = volumes.into_iter().fold(0.0, f64::max);
        if volume == 0.0 {
            return None;
        }
        let stretched = filled() / volume;
        Some(UnderLayer {
            volume,
            stretched,
            sheared: volumes.map(|own| if own > 0.0 { own / volume } else { stretched }),
            pressure: self.thickness_above(cell, side)? * weight_onto(&self.acceleration, last, 0),
        })
    }

    /// Mean thickness of what fills the cells above a corner of one of them or of a cell below.
    fn thickness_above(&self, cell: usize, side: [usize; D]) -> Option<f64> {
        let last = D - 1;
        let first = match side[last] {
            0 => cell,
            _ => self.topology.cell_neighbours[cell][last][1],
        };
        let mut around = [NONE; points_of(SPACE - 1)];
        *around.first_mut()? = first;
        for axis in 0..last {
            for bits in 0..1 << axis {
                around[bits | 1 << axis] = match around[bits] {
                    NONE => NONE,
                    at => self.topology.cell_neighbours[at][axis][side[axis]],
                };
            }
        }
        let known = || around.iter().filter(|cell| **cell != NONE);
        let sum: f64 = known().map(|&cell| self.fractions[cell]).sum();
        Some(sum / known().count() as f64 * self.grid.axes()[last].spacing())
    }
}
