//! Moving volume over ground.
//!
//! Matter and ground together are reconstructed as if they were one; what moves through the free part of
//! a face is the share of matter in the free part of what lies behind it. A full cell therefore passes
//! on exactly its face's flux. Cells with a small free part may receive more than they hold, or give more
//! than they have: the rest moves on to cells beside and above them, so that volume is kept and no cell
//! stays overfull.

use super::Ground;
use crate::free_surface::fraction::volume_in;
use crate::free_surface::plane::Plane;
use crate::free_surface::topology::{NONE, Topology};

/// Parts of a slab below this are round-off.
const ROUND_OFF: f64 = 1e-13;
/// More than a cell holds, or less than nothing, by this much is left to the residual of the divergence.
const EXCESS: f64 = 1e-10;
/// Most cells through which what does not fit is handed on.
const LONGEST_WAY: usize = 256;
/// Times that excess is looked for.
const ROUNDS: usize = 4;

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

    /// Moves what does not fit into cells beside the ground to where there is room.
    pub(crate) fn settle(&self, topology: &Topology<D>, fractions: &mut [f64]) {
        for _ in 0..ROUNDS {
            let mut moved = false;
            for cell in 0..fractions.len() {
                moved |= self.fill_up(topology, fractions, cell);
                let mut at = cell;
                // What has no room beside it lifts the column above.
                for _ in 0..LONGEST_WAY {
                    let Some(next) = self.push_out(topology, fractions, at) else {
                        break;
                    };
                    moved = true;
                    at = next;
                }
            }
            if !moved {
                return;
            }
        }
    }

    /// Open neighbours of a cell, the one above last.
    fn beside(&self, topology: &Topology<D>, cell: usize) -> [[usize; 2]; D] {
        std::array::from_fn(|axis| {
            [0, 1].map(|side| {
                let face = topology.cell_faces[cell][axis][side];
                if face != NONE && self.aperture[axis][face] > 0.0 {
                    topology.cell_neighbours[cell][axis][side]
                } else {
                    NONE
                }
            })
        })
    }

    /// Gives what a cell holds too much to its neighbours, as much as they have room for, and the rest
    /// to the one above, or where that is shut off to the one with the widest way to it. Says which one may
    /// hold too much now.
    fn push_out(
        &self,
        topology: &Topology<D>,
        fractions: &mut [f64],
        cell: usize,
    ) -> Option<usize> {
        let mut excess = fractions[cell] - self.free[cell];
        if excess <= EXCESS {
            return None;
        }
        let beside = self.beside(topology, cell);
        let room = |fractions: &[f64], next: usize| (self.free[next] - fractions[next]).max(0.0);
        // In space no neighbour comes first.
        let share = share_of(excess, beside, |next| room(fractions, next));
        for next in beside.into_iter().flatten().filter(|&next| next != NONE) {
            let part = (share * room(fractions, next)).min(excess);
            fractions[next] += part;
            fractions[cell] -= part;
            excess -= part;
        }
        let mut next = beside[D - 1][1];
        if next == NONE {
            let mut widest = 0.0;
            for (n, &other) in beside.as_flattened().iter().enumerate() {
                let face = topology.cell_faces[cell][n / 2][n % 2];
                if other != NONE && self.aperture[n / 2][face] > widest {
                    widest = self.aperture[n / 2][face];
                    next = other;
                }
            }
        }
        if excess <= EXCESS || next == NONE {
            return None;
        }
        fractions[next] += excess;
        fractions[cell] -= excess;
        Some(next)
    }

    /// Takes what a cell has less than nothing from its neighbours. Says whether there was any.
    fn fill_up(&self, topology: &Topology<D>, fractions: &mut [f64], cell: usize) -> bool {
        if fractions[cell] >= -EXCESS {
            return false;
        }
        let beside = self.beside(topology, cell);
        let share = share_of(-fractions[cell], beside, |next| fractions[next].max(0.0));
        for next in beside.into_iter().flatten() {
            if next != NONE {
                let part = (share * fractions[next].max(0.0)).min(-fractions[cell]);
                fractions[next] -= part;
                fractions[cell] += part;
            }
        }
        true
    }
}

/// The part of what neighbours have that an amount needs, if all give or take alike; in a plane they come one after the
/// other.
fn share_of<const D: usize>(
    amount: f64,
    beside: [[usize; 2]; D],
    has: impl Fn(usize) -> f64,
) -> f64 {
    if D == 2 {
        return 1.0;
    }
    let open = beside.into_iter().flatten().filter(|&next| next != NONE);
    let all: f64 = open.map(has).sum();
    if all > amount { amount / all } else { 1.0 }
}
