//! The planes that approximate the surface in cells that are partly filled.
//!
//! The normal of a cell is the one, among those that differences of column heights offer, whose
//! plane misses the fractions of the neighbours least: it is exact for plane surfaces (ELVIRA,
//! Pilliod & Puckett, *J. Comput. Phys.* 199 (2004) 465).

use super::plane::Plane;
use super::topology::{NONE, Topology};
use crate::grid::DIMENSIONS;

/// Cells of the neighbourhood, the cell itself in the middle.
const STENCIL: usize = 3_usize.pow(DIMENSIONS as u32);
/// Cells fuller than this count as full.
pub(crate) const FULL: f64 = 1.0 - 1e-12;

/// Fractions around a cell. Beyond the edge of the grid stands the cell inside.
struct Neighbourhood {
    fractions: [f64; STENCIL],
    inside: [bool; STENCIL],
    /// Whether the grid ends below and above along each axis.
    ends: [[bool; 2]; DIMENSIONS],
}

fn stride(axis: usize) -> usize {
    3_usize.pow(axis as u32)
}

fn step(place: usize, axis: usize) -> usize {
    place / stride(axis) % 3
}

impl Neighbourhood {
    fn around(topology: &Topology, fractions: &[f64], cell: usize) -> Self {
        let mut found = Self {
            fractions: [0.0; STENCIL],
            inside: [true; STENCIL],
            ends: topology.cell_neighbours[cell].map(|pair| pair.map(|c| c == NONE)),
        };
        for place in 0..STENCIL {
            let mut at = cell;
            for axis in 0..DIMENSIONS {
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
            found.fractions[place] = fractions[at];
        }
        found
    }

    /// Amount of material by which the high side of an axis exceeds the low one.
    fn excess(&self, axis: usize) -> f64 {
        (0..STENCIL)
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

    /// Sum of squares by which a plane misses the fractions of the neighbours.
    fn miss(&self, plane: &Plane) -> f64 {
        (0..STENCIL)
            .filter(|&place| self.inside[place])
            .map(|place| {
                let mut low = [0.0; 3];
                for (axis, low) in low.iter_mut().enumerate().take(DIMENSIONS) {
                    *low = step(place, axis) as f64 - 1.0;
                }
                let miss = plane.volume_in(low, low.map(|x| x + 1.0)) - self.fractions[place];
                miss * miss
            })
            .sum()
    }
}

/// The plane in a partly filled cell.
fn plane_in(topology: &Topology, fractions: &[f64], cell: usize) -> Plane {
    let around = Neighbourhood::around(topology, fractions, cell);
    let mut up = [0.0; 3];
    up[DIMENSIONS - 1] = 1.0;
    let mut best = Plane::of_fraction(up, fractions[cell]);
    let mut least = f64::INFINITY;
    let middle = (STENCIL - 1) / 2;
    for axis in 0..DIMENSIONS {
        let excess = around.excess(axis);
        if excess == 0.0 {
            continue;
        }
        let lies_low = excess < 0.0;
        let height = |place: usize| around.height(axis, place, lies_low);
        // Backward, central and forward differences along each of the other axes.
        for choice in (0..STENCIL).filter(|&choice| step(choice, axis) == 1) {
            let mut normal = [0.0; 3];
            normal[axis] = if lies_low { 1.0 } else { -1.0 };
            for other in (0..DIMENSIONS).filter(|&other| other != axis) {
                let (low, high) = (middle - stride(other), middle + stride(other));
                normal[other] = -match step(choice, other) {
                    0 => height(middle) - height(low),
                    1 => 0.5 * (height(high) - height(low)),
                    _ => height(high) - height(middle),
                };
            }
            let plane = Plane::of_fraction(normal, fractions[cell]);
            let miss = around.miss(&plane);
            if miss < least {
                least = miss;
                best = plane;
            }
        }
    }
    best
}

/// Planes in all partly filled cells; none in the others.
pub(crate) fn reconstruct(topology: &Topology, fractions: &[f64], planes: &mut Vec<Option<Plane>>) {
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
