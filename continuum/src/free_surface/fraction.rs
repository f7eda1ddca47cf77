//! The planes that approximate the surface in cells that are partly filled.
//!
//! The normal of a cell is the one, among those that differences of column heights offer, whose
//! plane misses the fractions of the neighbours least: it is exact for plane surfaces (ELVIRA,
//! Pilliod & Puckett, *J. Comput. Phys.* 199 (2004) 465). In space columns are seven cells tall, so that
//! the same holds for planes of any direction (heights as in Popinet, *J. Comput. Phys.* 228 (2009) 5838).

use super::plane::Plane;
use super::topology::{NONE, Topology};

/// Most cells of a neighbourhood, the cell itself in the middle.
pub(super) const STENCIL: usize = 27;
/// Cells fuller than this count as full.
pub(crate) const FULL: f64 = 1.0 - 1e-12;

/// Cells beyond a cell to which columns reach in space; in the plane they have three cells.
const REACH: usize = 3;
/// Axes along which the surface is less level than this, over the most level one, are left out in space.
const LEVEL: f64 = 0.3;
/// Planes whose misses differ by less than this part, or by the round-off of exact ones, are averaged in
/// space: what mirrors itself has mirrored candidates of equal merit.
const ALIKE: f64 = 1e-4;
/// Cells in space with less material are level: dust has no shape.
const SHAPELESS: f64 = 1e-10;
/// The square of round-off.
pub(super) const EXACT: f64 = 1e-24;

/// Cells of the neighbourhood with so many axes.
const fn stencil(axes: usize) -> usize {
    3_usize.pow(axes as u32)
}

/// Fractions around a cell. Beyond the edge of the grid stands the cell inside.
pub(super) struct Neighbourhood<'a, const D: usize> {
    topology: &'a Topology<D>,
    all: &'a [f64],
    cells: [usize; STENCIL],
    fractions: [f64; STENCIL],
    inside: [bool; STENCIL],
    /// Whether the grid ends below and above along each axis.
    ends: [[bool; 2]; D],
}

fn stride(axis: usize) -> usize {
    3_usize.pow(axis as u32)
}

fn step(place: usize, axis: usize) -> usize {
    place / stride(axis) % 3
}

impl<'a, const D: usize> Neighbourhood<'a, D> {
    pub(super) fn around(topology: &'a Topology<D>, fractions: &'a [f64], cell: usize) -> Self {
        let mut found = Self {
            topology,
            all: fractions,
            cells: [cell; STENCIL],
            fractions: [0.0; STENCIL],
            inside: [true; STENCIL],
            ends: topology.cell_neighbours[cell].map(|pair| pair.map(|c| c == NONE)),
        };
        for place in 0..stencil(D) {
            let mut at = cell;
            for axis in 0..D {
                let next = match step(place, axis) {
                    0 => topology.cell_neighbours[at][axis][0],
                    2 => topology.cell_neighbours[at][axis][1],
                    _ => at,
                };
                if next == NONE {
                    found.inside[place] = false;
                } else {
                    at = next;
                }
            }
            found.cells[place] = at;
            found.fractions[place] = fractions[at];
        }
        found
    }

    /// The cell in the middle.
    pub(super) fn cell(&self) -> usize {
        self.cells[(stencil(D) - 1) / 2]
    }

    /// Fraction of it.
    pub(super) fn fraction(&self) -> f64 {
        self.fractions[(stencil(D) - 1) / 2]
    }

    /// Whether it holds for some cell of the grid.
    pub(super) fn any(&self, holds: impl Fn(usize) -> bool) -> bool {
        self.places().any(|(cell, ..)| holds(cell))
    }

    /// The cells of the grid: each with its lower corner, seen from the one in the middle, and its fraction.
    pub(super) fn places(&self) -> impl Iterator<Item = (usize, [f64; 3], f64)> + '_ {
        let inside = (0..stencil(D)).filter(|&place| self.inside[place]);
        inside.map(|place| {
            let mut low = [0.0; 3];
            for (axis, low) in low.iter_mut().enumerate().take(D) {
                *low = step(place, axis) as f64 - 1.0;
            }
            (self.cells[place], low, self.fractions[place])
        })
    }

    /// Amount of material by which the high side of an axis exceeds the low one. Nothing clings to a ceiling.
    fn excess(&self, axis: usize) -> f64 {
        let ceiling = axis == D - 1 && self.ends[axis][1];
        (0..stencil(D))
            .filter(|&place| !(ceiling && step(place, axis) == 2))
            .map(|place| (step(place, axis) as f64 - 1.0) * self.fractions[place])
            .sum()
    }

    /// Height of material in a column along `axis` through `place`, from the side where it lies. A
    /// wall on that side is full, one on the other side is empty.
    fn height(&self, axis: usize, place: usize, lies_low: bool) -> f64 {
        let middle = place - step(place, axis) * stride(axis) + stride(axis);
        let end = |side: usize, other: usize| {
            if self.ends[axis][side] {
                f64::from(lies_low == (side == 0))
            } else {
                self.fractions[other]
            }
        };
        self.fractions[middle] + end(0, middle - stride(axis)) + end(1, middle + stride(axis))
    }

    /// Height of material in a column of up to seven cells along `axis` through `place`: from the first
    /// full cell towards the side where material lies to the first empty one on the other. Columns of three
    /// cells do not hold a surface as steep as 45° along two axes.
    fn tall_height(&self, axis: usize, place: usize, lies_low: bool) -> f64 {
        let middle = self.cells[place - step(place, axis) * stride(axis) + stride(axis)];
        let inner = usize::from(!lies_low);
        let mut height = self.all[middle];
        for side in [inner, 1 - inner] {
            let mut at = middle;
            for walked in 0..REACH {
                let done = if side == inner {
                    self.all[at] >= FULL
                } else {
                    self.all[at] <= SHAPELESS
                };
                let next = self.topology.cell_neighbours[at][axis][side];
                if done || next == NONE {
                    // A wall below is full like the cells below.
                    height += if side == inner {
                        (REACH - walked) as f64
                    } else {
                        0.0
                    };
                    break;
                }
                at = next;
                height += self.all[at];
            }
        }
        height
    }

    /// Sum of squares by which a plane misses the fractions of the neighbours; given up beyond `most`.
    fn miss(&self, plane: &Plane, most: f64) -> f64 {
        let mut sum = 0.0;
        for (_, low, fraction) in self.places() {
            let miss = plane.volume_in(low, low.map(|x| x + 1.0)) - fraction;
            sum += miss * miss;
            if sum > most {
                break;
            }
        }
        sum
    }
}

/// The plane in a partly filled cell.
fn plane_in<const D: usize>(topology: &Topology<D>, fractions: &[f64], cell: usize) -> Plane {
    let mut up = [0.0; 3];
    up[D - 1] = 1.0;
    let mut best = Plane::of_fraction(up, fractions[cell]);
    if D > 2 && fractions[cell] < SHAPELESS {
        return best;
    }
    let around = Neighbourhood::around(topology, fractions, cell);
    let mut least = f64::INFINITY;
    let mut candidates = Candidates::default();
    let middle = (stencil(D) - 1) / 2;
    let excesses: [f64; D] = std::array::from_fn(|axis| around.excess(axis));
    let largest = excesses.iter().fold(0.0_f64, |m, e| m.max(e.abs()));
    for (axis, excess) in excesses.into_iter().enumerate() {
        if excess == 0.0 || (D > 2 && excess.abs() < LEVEL * largest) {
            continue;
        }
        let lies_low = excess < 0.0;
        let mut heights = [f64::NAN; STENCIL];
        for place in (0..stencil(D)).filter(|&place| step(place, axis) == 1) {
            heights[place] = if D > 2 {
                around.tall_height(axis, place, lies_low)
            } else {
                around.height(axis, place, lies_low)
            };
        }
        // Backward, central and forward differences along each of the other axes.
        for choice in (0..stencil(D)).filter(|&choice| step(choice, axis) == 1) {
            let mut normal = [0.0; 3];
            normal[axis] = if lies_low { 1.0 } else { -1.0 };
            for other in (0..D).filter(|&other| other != axis) {
                let (low, high) = (middle - stride(other), middle + stride(other));
                normal[other] = -match step(choice, other) {
                    0 => heights[middle] - heights[low],
                    1 => 0.5 * (heights[high] - heights[low]),
                    _ => heights[high] - heights[middle],
                };
            }
            let plane = Plane::of_fraction(normal, fractions[cell]);
            let margin = if D > 2 { ALIKE * least + EXACT } else { 0.0 };
            let miss = around.miss(&plane, least + margin);
            if D > 2 && miss <= least + margin {
                candidates.add(plane.normal, miss);
            }
            if miss < least {
                least = miss;
                best = plane;
            }
        }
    }
    match candidates.mean_of_best() {
        Some(normal) => Plane::of_fraction(normal, fractions[cell]),
        None => best,
    }
}

/// Planes in space that were the best, or as good, when they were tried: their normals and misses.
#[derive(Default)]
struct Candidates {
    all: [([f64; 3], f64); STENCIL],
    count: usize,
}

impl Candidates {
    fn add(&mut self, normal: [f64; 3], miss: f64) {
        if let Some(slot) = self.all.get_mut(self.count) {
            *slot = (normal, miss);
            self.count += 1;
        }
    }

    /// Sum of the normals of those as good as the best of all, in whatever order they came, if there are
    /// several.
    fn mean_of_best(&self) -> Option<[f64; 3]> {
        let all = &self.all[..self.count];
        let least = all.iter().fold(f64::INFINITY, |least, c| least.min(c.1));
        let (mut sum, mut count) = ([0.0; 3], 0);
        for (normal, _) in all.iter().filter(|c| c.1 - least <= ALIKE * least + EXACT) {
            count += 1;
            for (sum, n) in sum.iter_mut().zip(normal) {
                *sum += n;
            }
        }
        (count > 1 && sum.iter().any(|n| *n != 0.0)).then_some(sum)
    }
}

/// Planes in all partly filled cells; none in the others.
pub(crate) fn reconstruct<const D: usize>(
    topology: &Topology<D>,
    fractions: &[f64],
    planes: &mut Vec<Option<Plane>>,
) {
    planes.clear();
    planes.extend((0..topology.cells()).map(|cell| {
        let fraction = fractions[cell];
        (fraction > 0.0 && fraction < FULL).then(|| plane_in(topology, fractions, cell))
    }));
}

/// Volume of material in a box inside a cell (corners in cell coordinates), in cell volumes.
pub(crate) fn volume_in(
    fraction: f64,
    plane: Option<&Plane>,
    low: [f64; 3],
    high: [f64; 3],
) -> f64 {
    match plane {
        Some(plane) => plane.volume_in(low, high),
        None if fraction <= 0.0 => 0.0,
        None => (0..3).map(|axis| high[axis] - low[axis]).product(),
    }
}
