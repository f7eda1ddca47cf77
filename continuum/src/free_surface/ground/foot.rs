//! The threshold pressure at the ground's foot: beside a corner of a cell that the ground cuts.

use super::contact::Interpolation;
use super::points::{Mirrored, sides_of};
use super::{Ground, unit};
use crate::free_surface::operators::Material;
use crate::free_surface::topology::NONE;

/// Part of the way from a corner down to the ground at which what sticks to it bears its pressure.
///
/// What follows an unknown weighs on it with its share of the velocity. Of a layer H deep over level ground, δ below a corner and
/// sheared up to half a cell above it, δ moves with s = (δ/2)/(δ + 1/2). It yields at its friction where the mean pressure of what is
/// sheared, δ below the corner and 1/2 above, is that at a depth of H − δ (1 − s): above it is that of the corner, H − δ, so below it is
/// that half way. On slopes of 1/8 to 3/8 films yield by 0.003 to 0.03 cells of their depth too late then.
const HALF_WAY: f64 = 0.5;

impl<const D: usize, const C: usize> Material<'_, D, C> {
    /// The pressure at a corner, or on the ground there, which bears a press: interpolated between the cells around it, and of
    /// a layer in which one cell has a pressure its weight.
    pub(super) fn pressure_at_corner(
        &self,
        ground: &Ground<D>,
        corner: usize,
        around: &Mirrored,
        press: Option<f64>,
    ) -> Interpolation {
        let mut pressure = Interpolation::default();
        let foot = if press.is_some() {
            foot_of::<D>(ground, around.cells[0], corner)
        } else {
            [0.0; D]
        };
        let share = |place: usize| {
            (0..D).fold(1.0, |share, axis| {
                // Towards the middle of the cell at that place.
                let is_low = (corner ^ place) >> axis & 1 == 1;
                share * (0.5 + if is_low { -foot[axis] } else { foot[axis] })
            })
        };
        let upwards = 1 << (D - 1);
        for column in 0..upwards {
            let high = column | corner & upwards;
            let low = high ^ upwards;
            let depth = press.filter(|press| *press > 0.0).and_then(|press| {
                Some(press * self.depth_of_one_cell(around.cells[high], around.cells[low])?)
            });
            if let Some(weight) = depth {
                let above = self.topology.cell_neighbours[around.cells[high]][D - 1][1];
                let weight = weight + self.pressure_beyond(above, 0.0);
                pressure.known += (share(low) + share(high)) * weight;
                continue;
            }
            for place in [low, high] {
                let there = self.pressure_over(ground, place, &around.cells);
                pressure.add_all(&there, share(place));
            }
        }
        pressure
    }

    /// What matter weighs on the ground in a cell per height of its column, |g·n| n_z, if it sticks there to ground whose
    /// normal n leans upwards most, in it or on its face across an axis; else nothing.
    pub(super) fn press_on_ground(
        &self,
        ground: &Ground<D>,
        cell: usize,
        across: Option<usize>,
    ) -> f64 {
        let last = D - 1;
        let mut normal = unit(ground.wall[cell]);
        if normal == [0.0; D] && across == Some(last) {
            normal[last] = 1.0;
        }
        let leans_up = normal.iter().all(|n| n.abs() <= normal[last]);
        if ground.contact.slides() || !leans_up {
            return 0.0;
        }
        let pairs = self.acceleration.iter().zip(normal);
        let towards = pairs.fold(0.0, |sum, (g, n)| sum - g * n);
        towards.max(0.0) * normal[last]
    }

    /// Height of the matter in a column of which a cell is the only one that has a pressure: the ground lies in it or below it.
    /// See [`Self::weight_of_one_cell`], on a floor.
    fn depth_of_one_cell(&self, cell: usize, below: usize) -> Option<f64> {
        let last = D - 1;
        let has_own = |cell: usize| cell != NONE && self.faces.pressure[cell] != NONE;
        if !has_own(cell) || has_own(below) {
            return None;
        }
        let above = self.topology.cell_neighbours[cell][last][1];
        if above == NONE || has_own(above) {
            return None;
        }
        let filled = |cell: usize| {
            if cell == NONE {
                0.0
            } else {
                self.fractions[cell]
            }
        };
        let depth = filled(below) + filled(cell) + filled(above);
        Some(depth * self.grid.axes()[last].spacing())
    }
}

/// Where the ground lies next to a corner of a cell that it cuts, in cells from the corner. There the traction acts: under
/// the pressure at the corner, up to half a cell deeper or less deep, a heap a few cells thick over level ground would end
/// short or run on.
fn foot_of<const D: usize>(ground: &Ground<D>, cell: usize, corner: usize) -> [f64; D] {
    let Some(plane) = &ground.planes[cell] else {
        return [0.0; D];
    };
    let mut at = [0.0; 3];
    for (axis, side) in sides_of::<D>(corner).into_iter().enumerate() {
        at[axis] = side as f64;
    }
    let square: f64 = plane.normal.iter().map(|n| n * n).sum();
    let depth = match plane.depth(at) / square {
        above if above < 0.0 && !ground.contact.slides() => HALF_WAY * above,
        depth => depth,
    };
    std::array::from_fn(|axis| (depth * plane.normal[axis]).clamp(-0.5, 0.5))
}
