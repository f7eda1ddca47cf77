//! How far the surface lies from the centres of cells beside it, and what that makes of the pressure beyond.

use super::operators::{EMPTY, Material};
use super::plane::Plane;

/// Smallest θ in the pressure gradient and in the pressure at walls.
const NEAREST_SURFACE: f64 = 0.005;

/// Beyond the surface of an active cell, seen along an axis.
#[derive(Debug, Clone, Copy)]
pub(super) enum Beyond {
    /// The surface at the distance θ, in cells.
    Air(f64),
    /// The shore. Ground takes up so much of the cell beyond that it is not active though its centre lies below the surface: the
    /// pressure there over that in the active cell, as their depths.
    Shore(f64),
}

impl Beyond {
    /// By how much the pressure falls over a cell, over that in the active one.
    pub(super) fn fall(self) -> f64 {
        match self {
            Self::Air(distance) => 1.0 / distance,
            Self::Shore(there) => 1.0 - there,
        }
    }

    /// The pressure a cell away over that in the active one, with θ not below `nearest`.
    pub(super) fn extrapolation(self, nearest: f64) -> f64 {
        match self {
            Self::Air(distance) => {
                let distance = distance.max(nearest);
                (distance - 1.0) / distance
            }
            Self::Shore(there) => there,
        }
    }
}

impl<const D: usize, const C: usize> Material<'_, D, C> {
    /// The surface in a cell. In space dust has none: where some of it lies is a matter of round-off.
    pub(super) fn plane(&self, cell: usize) -> Option<&Plane> {
        let plane = self.shores.plane(cell).or(self.planes[cell].as_ref());
        plane.filter(|_| D == 2 || self.fractions[cell] > EMPTY)
    }

    /// Depth below the surface, in cells along its normal, of the centre of an active cell and that of its inactive
    /// neighbour along an axis.
    fn depths_of_centres(&self, active: usize, other: usize, axis: usize, side: usize) -> [f64; 2] {
        let mut step = [0.0; D];
        step[axis] = if side == 1 { 1.0 } else { -1.0 };
        let back = step.map(|s| -s);
        let here = [0.0; D];
        match (self.plane(active), self.plane(other)) {
            (Some(a), Some(b)) => [depth_of_centre(a, here), depth_of_centre(b, here)],
            (Some(a), None) => [depth_of_centre(a, here), depth_of_centre(a, step)],
            (None, Some(b)) => [depth_of_centre(b, back), depth_of_centre(b, here)],
            (None, None) => [0.5, -0.5],
        }
    }

    /// Distance θ, in cells, from the centre of an active cell to the surface on the way to its
    /// inactive neighbour along an axis.
    pub(super) fn surface_distance(
        &self,
        active: usize,
        other: usize,
        axis: usize,
        side: usize,
    ) -> f64 {
        distance(self.depths_of_centres(active, other, axis, side))
    }

    /// What lies beyond the surface of an active cell on the way to its inactive neighbour along an axis.
    ///
    /// A shore counts as far as planes are known there. Where they are not, a pressure that does not fall leaves a cell
    /// nothing to push and the step without a solution.
    pub(super) fn beyond(&self, active: usize, other: usize, axis: usize, side: usize) -> Beyond {
        let [inner, outer] = self.depths_of_centres(active, other, axis, side);
        if inner > 0.0 && outer >= 0.0 && self.faces.shares.is_some() {
            let [here, there] = [active, other].map(|cell| match self.planes[cell] {
                Some(_) => self.shores.at(cell).map_or(0.0, |shore| shore.weight),
                None => 1.0,
            });
            return Beyond::Shore((outer / inner).min(here).min(there));
        }
        Beyond::Air(distance([inner, outer]))
    }
}

/// θ between two depths.
fn distance([inner, outer]: [f64; 2]) -> f64 {
    if inner <= 0.0 {
        NEAREST_SURFACE
    } else if outer >= 0.0 {
        1.0
    } else {
        (inner / (inner - outer)).clamp(NEAREST_SURFACE, 1.0)
    }
}

/// Depth below a plane, in cells, of the centre of the cell that lies so many steps from its own.
fn depth_of_centre<const D: usize>(plane: &Plane, steps: [f64; D]) -> f64 {
    let mut point = [0.5; 3];
    for (x, step) in point.iter_mut().zip(steps) {
        *x += step;
    }
    plane.depth(point)
}
