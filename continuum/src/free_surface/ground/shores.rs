//! The surface of matter where it meets ground inside a cell or beside it.
//!
//! The planes of matter and ground together ([`reconstruct`](crate::free_surface::fraction::reconstruct)) follow the ground
//! where it stands out of the matter. There the surface is the plane, among those of the cell itself and of the cells beside it and
//! the level one, that misses the matter above ground least,
//!
//! ```text
//! V(under the plane) − V(under the plane and under the ground),
//! ```
//!
//! in the neighbours, and holds what there is in the cell. A plane surface is found exactly up to the last cell of the shore.

use super::{DUST, Ground};
use crate::free_surface::fraction::{EXACT, Neighbourhood};
use crate::free_surface::plane::Plane;
use crate::free_surface::topology::{NONE, Topology};

/// Times that planes are handed on from cell to cell: the shore cell itself is the second one from those whose
/// neighbours know nothing of it.
const PASSES: usize = 3;
/// Planes whose misses differ by less than this part are averaged.
const ALIKE: f64 = 1e-4;
/// Steps to the plane that holds a given volume.
const STEPS: usize = 80;
/// Volumes that differ by less, in cells, are the same.
const SAME: f64 = 1e-15;
/// The cell itself, those beside it, the level plane.
const MOST_CANDIDATES: usize = 8;

/// Cells at a shore and the surface in them, in the order of the cells.
#[derive(Debug, Default)]
pub(crate) struct Shores {
    cells: Vec<(usize, Plane)>,
    next: Vec<Plane>,
}

impl Shores {
    /// The surface in a cell, if it lies at a shore.
    pub(crate) fn plane(&self, cell: usize) -> Option<&Plane> {
        let at = self.cells.binary_search_by_key(&cell, |shore| shore.0);
        Some(&self.cells[at.ok()?].1)
    }

    /// Finds them anew; `planes` are those of matter and ground together.
    pub(crate) fn find<const D: usize>(
        &mut self,
        ground: &Ground<D>,
        topology: &Topology<D>,
        fractions: &[f64],
        planes: &[Option<Plane>],
        acceleration: [f64; D],
    ) {
        self.cells.clear();
        for (cell, plane) in planes.iter().enumerate() {
            let Some(plane) = plane.as_ref().filter(|_| fractions[cell] > DUST) else {
                continue;
            };
            let around = Neighbourhood::around(topology, fractions, cell);
            if around.any(|at| ground.solid[at] > 0.0) && ground.miss(&around, plane, EXACT) > EXACT
            {
                self.cells.push((cell, *plane));
            }
        }
        let mut level = [0.0; 3];
        for (n, g) in level.iter_mut().zip(acceleration) {
            *n = -g;
        }
        for _ in 0..PASSES {
            self.next.clear();
            for &(cell, own) in &self.cells {
                let beside = topology.cell_neighbours[cell].iter().flatten();
                let beside = beside.filter_map(|&at| match at {
                    NONE => None,
                    at => self.plane(at).or(planes[at].as_ref()),
                });
                let normals = std::iter::once(own.normal)
                    .chain(beside.map(|plane| plane.normal))
                    .chain((level != [0.0; 3]).then_some(level));
                let around = Neighbourhood::around(topology, fractions, cell);
                let best = ground.best_plane(&around, normals);
                self.next.push(best.unwrap_or(own));
            }
            for (shore, plane) in self.cells.iter_mut().zip(&self.next) {
                shore.1 = *plane;
            }
        }
    }
}

impl<const D: usize> Ground<D> {
    /// The plane of those normals that misses the matter around a cell least; in space the mean of those as good.
    fn best_plane(
        &self,
        around: &Neighbourhood<'_, D>,
        normals: impl Iterator<Item = [f64; 3]>,
    ) -> Option<Plane> {
        let mut found: [Option<(Plane, f64)>; MOST_CANDIDATES] = [None; MOST_CANDIDATES];
        let mut least = f64::INFINITY;
        for (slot, normal) in found.iter_mut().zip(normals) {
            let plane = self.holding(around.cell(), normal, around.fraction());
            let miss = self.miss(around, &plane, (1.0 + ALIKE) * least + EXACT);
            least = least.min(miss);
            *slot = Some((plane, miss));
        }
        let mut sum = [0.0; 3];
        let mut best: Option<(Plane, f64)> = None;
        let mut count = 0;
        for (plane, miss) in found.into_iter().flatten() {
            if best.is_none_or(|(_, least)| miss < least) {
                best = Some((plane, miss));
            }
            if miss <= (1.0 + ALIKE) * least + EXACT {
                count += 1;
                for (sum, n) in sum.iter_mut().zip(plane.normal) {
                    *sum += n;
                }
            }
        }
        if D > 2 && count > 1 && sum != [0.0; 3] {
            return Some(self.holding(around.cell(), sum, around.fraction()));
        }
        best.map(|(plane, _)| plane)
    }

    /// Sum of squares by which a plane of a cell misses the matter in it and around it; given up beyond `most`.
    fn miss(&self, around: &Neighbourhood<'_, D>, plane: &Plane, most: f64) -> f64 {
        let mut sum = 0.0;
        for (cell, low, fraction) in around.places() {
            let there = Plane {
                offset: plane.depth(low),
                ..*plane
            };
            let miss = self.matter_under(cell, &there) - fraction;
            sum += miss * miss;
            if sum > most {
                break;
            }
        }
        sum
    }

    /// Matter under a plane in a cell, in cells.
    fn matter_under(&self, cell: usize, plane: &Plane) -> f64 {
        if self.free[cell] == 0.0 {
            return 0.0;
        }
        let all = plane.volume_in([0.0; 3], [1.0; 3]);
        match &self.planes[cell] {
            None => (all - self.solid[cell]).max(0.0),
            Some(ground) => all - common_volume(plane, ground),
        }
    }

    /// The plane of a normal under which a cell holds so much matter.
    fn holding(&self, cell: usize, normal: [f64; 3], fraction: f64) -> Plane {
        let mut plane = Plane::of_fraction(normal, (fraction + self.solid[cell]).min(1.0));
        // Without ground that stands out this is all. Where some does the plane lies lower.
        let excess = |plane: &Plane| self.matter_under(cell, plane) - fraction;
        let mut high = (plane.offset, excess(&plane));
        if high.1.abs() <= SAME {
            return plane;
        }
        let lowest = plane.normal.iter().map(|m| m.min(0.0)).sum();
        let mut low = (lowest, -fraction);
        // Regula falsi; an end that stays counts half (Illinois).
        let mut last = 0.0;
        for _ in 0..STEPS {
            if high.1 - low.1 <= 0.0 || high.0 <= low.0 {
                break;
            }
            plane.offset = (low.0 * high.1 - high.0 * low.1) / (high.1 - low.1);
            let found = excess(&plane);
            if found.abs() <= SAME {
                break;
            }
            if found > 0.0 {
                high = (plane.offset, found);
                low.1 *= if last > 0.0 { 0.5 } else { 1.0 };
            } else {
                low = (plane.offset, found);
                high.1 *= if last < 0.0 { 0.5 } else { 1.0 };
            }
            last = found;
        }
        plane
    }
}

/// Volume of the unit cell under two planes.
fn common_volume(one: &Plane, other: &Plane) -> f64 {
    const ORDERS: [[usize; 3]; 6] = [
        [0, 1, 2],
        [0, 2, 1],
        [1, 0, 2],
        [1, 2, 0],
        [2, 0, 1],
        [2, 1, 0],
    ];
    // Six tetrahedra about the diagonal (Kuhn).
    let mut sum = 0.0;
    for order in ORDERS {
        let mut corners = [[0.0; 3]; 4];
        for n in 1..4 {
            corners[n] = corners[n - 1];
            corners[n][order[n - 1]] = 1.0;
        }
        sum += volume_under(&corners, &[one, other]);
    }
    sum
}

/// Volume of a tetrahedron under planes.
fn volume_under(corners: &[[f64; 3]; 4], planes: &[&Plane]) -> f64 {
    let Some((plane, others)) = planes.split_first() else {
        let [a, b, c] = [1, 2, 3].map(|n| {
            let edge: [f64; 3] = std::array::from_fn(|k| corners[n][k] - corners[0][k]);
            edge
        });
        let normal: [f64; 3] = std::array::from_fn(|k| {
            a[(k + 1) % 3] * b[(k + 2) % 3] - a[(k + 2) % 3] * b[(k + 1) % 3]
        });
        return normal.iter().zip(c).map(|(n, c)| n * c).sum::<f64>().abs() / 6.0;
    };
    let depths = corners.map(|corner| plane.depth(corner));
    // Those under the plane first.
    let mut order = [0; 4];
    let mut under = 0;
    for wanted in [true, false] {
        let first = if wanted { 0 } else { under };
        let mut next = first;
        for (n, depth) in depths.iter().enumerate() {
            if (*depth > 0.0) == wanted {
                order[next] = n;
                next += 1;
            }
        }
        if wanted {
            under = next;
        }
    }
    let at = |n: usize| corners[order[n]];
    // Where the plane cuts the edge from a corner under it to one above.
    let cut = |n: usize, m: usize| {
        let (from, to) = (depths[order[n]], depths[order[m]]);
        let part = from / (from - to);
        let point: [f64; 3] = std::array::from_fn(|k| at(n)[k] + part * (at(m)[k] - at(n)[k]));
        point
    };
    let prism = |[a, b, c]: [[f64; 3]; 3], [d, e, f]: [[f64; 3]; 3]| {
        [[a, b, c, d], [b, c, d, e], [c, d, e, f]]
            .iter()
            .map(|part| volume_under(part, others))
            .sum()
    };
    match under {
        0 => 0.0,
        1 => volume_under(&[at(0), cut(0, 1), cut(0, 2), cut(0, 3)], others),
        2 => prism([at(0), cut(0, 2), cut(0, 3)], [at(1), cut(1, 2), cut(1, 3)]),
        3 => prism([at(0), at(1), at(2)], [cut(0, 3), cut(1, 3), cut(2, 3)]),
        _ => volume_under(corners, others),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Under one plane twice there is what is under it; under a plane and its other side nothing; a level plane
    /// and an upright one cut off a box, two slanted ones what integration says.
    #[test]
    fn common_volumes_by_hand() {
        let plane = |normal, fraction| Plane::of_fraction(normal, fraction);
        let back = |p: Plane| Plane {
            normal: p.normal.map(|n| -n),
            offset: -p.offset,
        };
        for normal in [[0.3, 0.8, 0.0], [-0.3, 0.2, 0.9], [1.0, 0.0, 0.0]] {
            for fraction in [0.02, 0.4, 0.77] {
                let one = plane(normal, fraction);
                assert!((common_volume(&one, &one) - fraction).abs() < 1e-14);
                assert!(common_volume(&one, &back(one)).abs() < 1e-14);
                let level = plane([0.1, 0.9, -0.2], 0.6);
                let both = common_volume(&one, &level) + common_volume(&back(one), &level);
                assert!((both - 0.6).abs() < 1e-14, "{both}");
            }
        }
        let level = plane([0.0, 1.0, 0.0], 0.4);
        assert!((common_volume(&level, &plane([1.0, 0.0, 0.0], 0.3)) - 0.12).abs() < 1e-15);
        // Under y = 0.4 and y = x: ∫ min(x, 0.4) dx.
        let slanted = plane([-1.0, 1.0, 0.0], 0.5);
        assert!((common_volume(&level, &slanted) - (0.08 + 0.24)).abs() < 1e-15);
    }
}
