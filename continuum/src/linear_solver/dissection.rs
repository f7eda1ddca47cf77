//! Nested dissection (George, *SIAM J. Numer. Anal.* 10 (1973) 345) of unknowns on a staggered grid, by
//! their places.
//!
//! The velocities are cut in two by a strip that no coefficient reaches across: a column (in
//! space, a layer) of cells with both of its columns of faces. Each half is cut again, and the strip is
//! eliminated last. Pressures go before all velocities: what they leave behind, the product of two
//! rows of the divergence, couples the faces of one cell, which the strain rate couples anyway, so they
//! cost no fill and make no strip wider. The factors are as small as those in a minimum-degree order,
//! which would have to be found anew whenever the surface enters a cell and took a fifth of the time of a
//! step.

use crate::grid::DIMENSIONS;

/// Place of an unknown in half cells along each axis: cells at odd numbers, faces at even ones.
pub type Place<const D: usize = DIMENSIONS> = [u32; D];

/// Pieces of fewer unknowns are not cut.
const SMALLEST_PIECE: usize = 12;

/// Pieces of fewer velocities stay whole: halves of them are not worth another thread.
const SMALLEST_HALVED: usize = 2000;

/// An order of elimination as it came about: where a piece ends in it, and the two halves that come before its strip.
#[derive(Debug)]
pub(super) struct Pieces {
    pub end: usize,
    pub halves: Option<Box<[Pieces; 2]>>,
}

/// The unknowns in the order in which they are eliminated; those from number `definite` on are
/// pressures. Large pieces have their pressures with them, so that halves stand apart in the order.
pub(super) fn dissect<const D: usize>(
    places: &[Place<D>],
    definite: usize,
) -> (Vec<usize>, Pieces) {
    let mut work = Dissection {
        places,
        sorted: vec![0; definite],
        counts: Vec::new(),
    };
    let mut order = Vec::with_capacity(places.len());
    let pressures = (definite..places.len()).collect();
    let pieces = work.halve(pressures, (0..definite).collect(), &mut order);
    (order, pieces)
}

struct Dissection<'a, const D: usize> {
    places: &'a [Place<D>],
    sorted: Vec<usize>,
    counts: Vec<usize>,
}

/// Where a piece is cut: the axis, the column of cells, and the size of the strip.
#[derive(Clone, Copy)]
struct Cut {
    axis: usize,
    column: u32,
    strip: usize,
}

impl Cut {
    /// 0 below the strip, 1 above it, 2 in it.
    fn part_of<const D: usize>(&self, place: &Place<D>) -> usize {
        let place = place[self.axis];
        if place + 1 < self.column {
            0
        } else if place > self.column + 1 {
            1
        } else {
            2
        }
    }
}

impl<const D: usize> Dissection<'_, D> {
    /// Puts pressures and velocities into order behind what is there, halves of large pieces each by themselves.
    fn halve(
        &mut self,
        pressures: Vec<usize>,
        velocities: Vec<usize>,
        order: &mut Vec<usize>,
    ) -> Pieces {
        let is_large = velocities.len() >= SMALLEST_HALVED;
        let Some(cut) = is_large.then(|| self.best_cut(&velocities)).flatten() else {
            order.extend(pressures);
            let first = order.len();
            order.extend(velocities);
            self.cut(&mut order[first..]);
            return Pieces {
                end: order.len(),
                halves: None,
            };
        };
        let places = self.places;
        let divide = |unknowns: Vec<usize>| {
            let mut parts = [const { Vec::new() }; 3];
            for unknown in unknowns {
                parts[cut.part_of(&places[unknown])].push(unknown);
            }
            parts
        };
        let [low_pressures, high_pressures, pressures] = divide(pressures);
        let [low, high, strip] = divide(velocities);
        let low = self.halve(low_pressures, low, order);
        let high = self.halve(high_pressures, high, order);
        order.extend(pressures);
        order.extend(strip);
        Pieces {
            end: order.len(),
            halves: Some(Box::new([low, high])),
        }
    }

    fn best_cut(&mut self, piece: &[usize]) -> Option<Cut> {
        let cuts: [Option<Cut>; D] = std::array::from_fn(|axis| self.middle(piece, axis));
        cuts.into_iter().flatten().min_by_key(|cut| cut.strip)
    }

    fn cut(&mut self, piece: &mut [usize]) {
        if piece.len() < SMALLEST_PIECE {
            return;
        }
        let Some(cut) = self.best_cut(piece) else {
            return;
        };
        let places = self.places;
        let part_of = |unknown: usize| cut.part_of(&places[unknown]);
        let mut counts = [0; 3];
        for &unknown in piece.iter() {
            counts[part_of(unknown)] += 1;
        }
        let mut next = [0, counts[0], counts[0] + counts[1]];
        for &unknown in piece.iter() {
            let part = part_of(unknown);
            self.sorted[next[part]] = unknown;
            next[part] += 1;
        }
        piece.copy_from_slice(&self.sorted[..piece.len()]);
        let (low, rest) = piece.split_at_mut(counts[0]);
        self.cut(low);
        self.cut(&mut rest[..counts[1]]);
    }

    /// The column of cells that leaves as many unknowns on one side of it as on the other; none if it
    /// would leave nothing.
    fn middle(&mut self, piece: &[usize], axis: usize) -> Option<Cut> {
        let place = |unknown: &usize| self.places[*unknown][axis];
        let low = piece.iter().map(place).min()?;
        let high = piece.iter().map(place).max()?;
        self.counts.clear();
        self.counts.resize((high - low + 1) as usize, 0);
        for unknown in piece {
            self.counts[(self.places[*unknown][axis] - low) as usize] += 1;
        }
        let mut below = 0;
        let middle = self.counts.iter().position(|count| {
            below += count;
            2 * below >= piece.len()
        })?;
        let column = (low + middle as u32) | 1;
        let first = (column - 1).max(low);
        let last = (column + 1).min(high);
        if first == low || last == high {
            return None;
        }
        let strip = (first..=last).map(|p| self.counts[(p - low) as usize]);
        Some(Cut {
            axis,
            column,
            strip: strip.sum(),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Faces and cells of a box of cells.
    fn places(columns: u32, rows: u32) -> (Vec<Place>, usize) {
        let all = (0..=2 * rows).flat_map(|z| (0..=2 * columns).map(move |x| [x, z]));
        let (cells, faces): (Vec<Place>, Vec<Place>) = all
            .filter(|[x, z]| x % 2 + z % 2 > 0)
            .partition(|[x, z]| x % 2 + z % 2 == 2);
        let definite = faces.len();
        (faces.into_iter().chain(cells).collect(), definite)
    }

    #[test]
    fn order_holds_every_unknown_once() {
        let (places, definite) = places(13, 7);
        let (mut order, _) = dissect(&places, definite);
        assert_ne!(order, (0..places.len()).collect::<Vec<_>>());
        order.sort_unstable();
        assert_eq!(order, (0..places.len()).collect::<Vec<_>>());
    }

    /// What is eliminated last is the strip across the longer axis; pressures go first.
    #[test]
    fn first_cut_goes_across_the_longer_axis() {
        let (places, definite) = places(21, 5);
        let (order, _) = dissect(&places, definite);
        let pressures = places.len() - definite;
        assert!(order[..pressures].iter().all(|&j| j >= definite));
        let strip = &order[order.len() - (2 * 5 + 5 + 1)..];
        let middle: Vec<u32> = strip.iter().map(|&j| places[j][0]).collect();
        let column = middle[0] | 1;
        assert!((17..=25).contains(&column), "{column}");
        assert!(middle.iter().all(|x| x.abs_diff(column) <= 1));
    }
}
