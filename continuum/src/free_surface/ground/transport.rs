//! Moving volume over ground.
//!
//! Matter and ground together are reconstructed as if they were one; what moves through the free part of
//! a face is the share of matter in the free part of what lies behind it. A full cell therefore passes
//! on exactly its face's flux. What cells with a small free part receive too much is [settled](super::settling) afterwards.

use super::Ground;
use crate::free_surface::fraction::volume_in;
use crate::free_surface::plane::Plane;

/// Parts of a slab below this are round-off.
const ROUND_OFF: f64 = 1e-13;

impl<const D: usize> Ground<D> {
    /// Share of matter in the free part of a slab behind a face (corners in cell coordinates).
    pub(crate) fn matter(
        &self,
        cell: usize,
        fraction: f64,
        plane: Option<&Plane>,
        low: [f64; 3],
        high: [f64; 3],
    ) -> f64 {
        if fraction <= 0.0 {
            return 0.0;
        }
        let Some(plane) = plane else { return 1.0 };
        let slab: f64 = (0..3).map(|axis| high[axis] - low[axis]).product();
        let solid = match &self.planes[cell] {
            Some(ground) => ground.volume_in(low, high),
            None => self.solid[cell] * slab,
        };
        let free = slab - solid;
        if free <= ROUND_OFF * slab {
            return (fraction / self.free[cell]).min(1.0);
        }
        ((volume_in(1.0, Some(plane), low, high) - solid) / free).clamp(0.0, 1.0)
    }
}
