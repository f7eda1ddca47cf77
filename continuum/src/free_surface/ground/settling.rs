//! What moves on from cells beside the ground that hold more than they can, or less than nothing, after a transport: to
//! cells beside and above them, so that volume is kept and no cell stays overfull.
//!
//! In a plane one cell comes after the other. In space all move at once, by what there was before: with one after the other
//! the first of two cells beside the same room would fill it, and a flow that mirrors itself would not go on doing so.

use super::{ALIKE, Ground};
use crate::free_surface::topology::{NONE, Topology};

/// More than a cell holds, or less than nothing, by this much is left to the residual of the divergence.
const EXCESS: f64 = 1e-10;
/// Most cells through which what does not fit is handed on.
const LONGEST_WAY: usize = 256;
/// Times that excess is looked for in a plane.
const ROUNDS: usize = 4;

/// Work arrays of cells that settle at once.
#[derive(Debug, Default)]
pub(crate) struct Settling {
    before: Vec<f64>,
    /// What the cells beside each one ask of it.
    asked: Vec<f64>,
    cells: Vec<usize>,
}

/// What cells do with an amount that is wrong.
#[derive(Clone, Copy, PartialEq)]
enum Exchange {
    /// Take what they have less than nothing.
    Take,
    /// Give what they have too much.
    Give,
}

impl<const D: usize> Ground<D> {
    /// Moves what does not fit into cells beside the ground to where there is room. Returns the cells that hold more than
    /// they can or less than nothing all the same: what they have is kept, and the next transport begins with it.
    pub(crate) fn settle(
        &self,
        topology: &Topology<D>,
        fractions: &mut [f64],
        work: &mut Settling,
    ) -> usize {
        if D == 2 {
            self.settle_in_turn(topology, fractions);
        } else {
            self.settle_at_once(topology, fractions, work);
        }
        let cells = fractions.iter().zip(&self.free);
        cells
            .filter(|(fraction, free)| **fraction < -EXCESS || *fraction - *free > EXCESS)
            .count()
    }

    fn settle_at_once(&self, topology: &Topology<D>, fractions: &mut [f64], work: &mut Settling) {
        work.asked.clear();
        work.asked.resize(fractions.len(), 0.0);
        for _ in 0..LONGEST_WAY {
            let taken = self.exchange(topology, fractions, work, Exchange::Take);
            let given = self.exchange(topology, fractions, work, Exchange::Give);
            if !taken && !given {
                return;
            }
        }
    }

    /// Takes or gives all at once, as far as cells beside have something or have room; those of which several ask give each
    /// its share. What is left to give goes to the cell above, or where that is shut off to those with the widest way to
    /// them. Says whether anything moved.
    fn exchange(
        &self,
        topology: &Topology<D>,
        fractions: &mut [f64],
        work: &mut Settling,
        exchange: Exchange,
    ) -> bool {
        let Settling {
            before,
            asked,
            cells,
        } = work;
        let amount = |cell: usize, fraction: f64| match exchange {
            Exchange::Take => -fraction,
            Exchange::Give => fraction - self.free[cell],
        };
        let room = |cell: usize, fraction: f64| match exchange {
            Exchange::Take => fraction.max(0.0),
            Exchange::Give => (self.free[cell] - fraction).max(0.0),
        };
        cells.clear();
        let wrong = fractions.iter().enumerate();
        cells.extend(
            wrong
                .filter(|&(cell, f)| amount(cell, *f) > EXCESS)
                .map(|(cell, _)| cell),
        );
        if cells.is_empty() {
            return false;
        }
        before.clear();
        before.extend_from_slice(fractions);
        let open = |cell: usize| {
            let beside = self.beside(topology, cell).into_iter().flatten();
            beside.filter(|&next| next != NONE)
        };
        // What a cell asks of those beside it, over what they have room for.
        let share = |cell: usize| {
            let all: f64 = open(cell).map(|next| room(next, before[next])).sum();
            (amount(cell, before[cell]) / all).min(1.0)
        };
        for &cell in &*cells {
            let share = share(cell);
            for next in open(cell) {
                asked[next] += share * room(next, before[next]);
            }
        }
        let sign = if exchange == Exchange::Give {
            1.0
        } else {
            -1.0
        };
        let mut moved = false;
        for &cell in &*cells {
            let (share, mut left) = (share(cell), amount(cell, before[cell]));
            for next in open(cell) {
                let has = room(next, before[next]);
                if has > 0.0 {
                    let part = (share * has * (has / asked[next]).min(1.0)).min(left);
                    fractions[next] += sign * part;
                    fractions[cell] -= sign * part;
                    left -= part;
                    moved |= part > 0.0;
                }
            }
            if exchange == Exchange::Give && left > EXCESS {
                moved |= self.lift(topology, fractions, cell, left);
            }
        }
        for &cell in &*cells {
            for next in open(cell) {
                asked[next] = 0.0;
            }
        }
        moved
    }

    /// Moves something to the cell above, or where that is shut off to those with the widest way to them. Says whether there
    /// is any.
    fn lift(
        &self,
        topology: &Topology<D>,
        fractions: &mut [f64],
        cell: usize,
        amount: f64,
    ) -> bool {
        let beside = self.beside(topology, cell);
        let above = beside[D - 1][1];
        if above != NONE {
            fractions[above] += amount;
            fractions[cell] -= amount;
            return true;
        }
        let ways = || {
            beside.iter().enumerate().flat_map(|(axis, pair)| {
                let faces = topology.cell_faces[cell][axis];
                pair.iter()
                    .zip(faces)
                    .filter(|(next, _)| **next != NONE)
                    .map(move |(&next, face)| (next, self.aperture[axis][face]))
            })
        };
        let widest = ways().fold(0.0_f64, |widest, (_, way)| widest.max(way));
        let alike = || ways().filter(|(_, way)| *way >= (1.0 - ALIKE) * widest);
        let count = alike().count() as f64;
        for (next, _) in alike() {
            fractions[next] += amount / count;
            fractions[cell] -= amount / count;
        }
        count > 0.0
    }

    /// The same one cell after the other.
    fn settle_in_turn(&self, topology: &Topology<D>, fractions: &mut [f64]) {
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
        for next in beside.into_iter().flatten().filter(|&next| next != NONE) {
            let part = room(fractions, next).min(excess);
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
        for next in beside.into_iter().flatten() {
            if next != NONE {
                let part = fractions[next].max(0.0).min(-fractions[cell]);
                fractions[next] -= part;
                fractions[cell] += part;
            }
        }
        true
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::free_surface::ground::{Contact, Terrain};
    use crate::grid::{Axis, Boundary, Grid};
    use crate::terrain::{Profile, Relief, Surface};

    fn axes<const D: usize>() -> [Axis; D] {
        let wall = Boundary::FreeSlip;
        std::array::from_fn(|_| Axis::Bounded {
            length: 3.0,
            cells: 3,
            low: wall,
            high: wall,
        })
    }

    /// Cells left as they should not be, where a box over level ground is full but for what its last cell lacks, and the
    /// first one holds half a cell too much.
    fn left<const D: usize>(ground: impl Relief<D>, lacks: f64) -> usize {
        let grid = Grid::with_moving_surface(axes::<D>()).unwrap();
        let topology = Topology::new(&grid);
        let terrain = Terrain {
            shape: ground,
            origin: [0.0; D],
            contact: Contact::NoSlip,
            rise: [0; D],
        };
        let ground = Ground::new(&grid, &topology, &terrain).unwrap();
        let mut fractions = ground.free.clone();
        fractions[0] += 0.5;
        *fractions.last_mut().unwrap() -= lacks;
        let before: f64 = fractions.iter().sum();
        let found = ground.settle(&topology, &mut fractions, &mut Settling::default());
        let after: f64 = fractions.iter().sum();
        assert!((after - before).abs() < 1e-13, "{before} {after}");
        found
    }

    /// What finds room is handed on to it; what finds none stays, and is counted.
    #[test]
    fn what_finds_no_room_is_counted() {
        let line = || Profile::new(vec![[-1.0, 0.2], [4.0, 0.2]]).unwrap();
        let corners = [[-1.0, -1.0], [4.0, -1.0], [4.0, 4.0], [-1.0, 4.0]];
        let corners = corners.map(|[x, y]| [x, y, 0.2]).to_vec();
        let plane = || Surface::new(corners.clone(), vec![[0, 1, 2], [0, 2, 3]]).unwrap();
        assert_eq!((left(line(), 0.6), left(plane(), 0.6)), (0, 0));
        assert!(left(line(), 0.0) > 0 && left(plane(), 0.0) > 0);
    }
}
