//! What ground leaves free of a grid, in halves of cells along each axis.
//!
//! A *part* of a cell lies at one of its corners: a quarter in a plane, an eighth in space. A *sheet* is cut from
//! part of a grid plane or of a plane through the centres of cells, and is known by its own parts. All are numbered
//! by their sides, one bit for each axis; the bit of the axis that a sheet lies across is 0.

use crate::error::Error;
use crate::free_surface::operators::points_of;
use crate::free_surface::plane::Plane;
use crate::free_surface::topology::{NONE, Topology};
use crate::grid::{Grid, flatten, unflatten};
use crate::terrain::{CutCells, GridLines, Relief};

/// Most parts of a cell.
pub(super) const MOST_PARTS: usize = 8;
/// Free share of each part of a sheet.
pub(super) type Sheet = [f64; MOST_PARTS];
/// Ground whose normal has less than this of an axis, over the most, does not lean to it.
const UPRIGHT: f64 = 1e-9;

/// A smaller surface, over the area of a face, is none: the ground touches a corner of the cell, to round-off, and the
/// direction of the surface there is a matter of round-off, too.
const SMALLEST_WALL: f64 = 3e-6;

/// The parts of cells, of faces and of the sheets through the middles of cells.
pub(super) struct Cuts<const D: usize> {
    /// Free part of each part of each cell, in cells.
    pub parts: Vec<f64>,
    /// For each component and face.
    pub faces: [Vec<Sheet>; D],
    /// For each cell, across each axis.
    middles: Vec<[Sheet; D]>,
    /// ∫ n dA of the ground's surface in each cell, out of the ground, over the area of a face of a cube of its size.
    pub wall: Vec<[f64; D]>,
}

/// The lines of a grid with its lower corner at a place.
pub(super) fn lines_of<const D: usize>(grid: &Grid<D>, origin: [f64; D]) -> GridLines<D> {
    GridLines {
        origin,
        spacing: grid.axes().map(|axis| axis.spacing()),
        cells: grid.cell_counts(),
    }
}

/// The numbers of the parts of a sheet across an axis.
pub(super) fn parts_across<const D: usize>(axis: usize) -> impl Iterator<Item = usize> {
    (0..points_of(D)).filter(move |bits| bits >> axis & 1 == 0)
}

fn plus_sides<const D: usize>(mut at: [usize; D], bits: usize) -> [usize; D] {
    for (axis, at) in at.iter_mut().enumerate() {
        *at += bits >> axis & 1;
    }
    at
}

impl<const D: usize> Cuts<D> {
    pub(super) fn of<S: Relief<D>>(
        grid: &Grid<D>,
        lines: &GridLines<D>,
        shape: &S,
    ) -> Result<Self, Error> {
        let whole = shape.cut(lines)?;
        let fine = shape.cut(&GridLines {
            origin: lines.origin,
            spacing: lines.spacing.map(|h| 0.5 * h),
            cells: lines.cells.map(|n| 2 * n),
        })?;
        let share = 1.0 / points_of(D) as f64;
        let index_of = |cell: usize| unflatten(cell, lines.cells);
        let doubled = |index: [usize; D]| index.map(|i| 2 * i);
        let sheet = |axis: usize, at: [usize; D]| {
            let mut sheet = [0.0; MOST_PARTS];
            for bits in parts_across::<D>(axis) {
                sheet[bits] = fine.aperture(axis, plus_sides(at, bits));
            }
            sheet
        };
        let mut parts = Vec::with_capacity(grid.cells() * points_of(D));
        for cell in 0..grid.cells() {
            let at = doubled(index_of(cell));
            parts.extend(
                (0..points_of(D)).map(|bits| share * fine.volume_fraction(plus_sides(at, bits))),
            );
        }
        let middles = (0..grid.cells()).map(|cell| {
            std::array::from_fn(|axis| {
                let mut at = doubled(index_of(cell));
                at[axis] += 1;
                sheet(axis, at)
            })
        });
        let faces = std::array::from_fn(|c| {
            let counts = grid.faces(c);
            (0..counts.iter().product())
                .map(|face| sheet(c, doubled(unflatten(face, counts))))
                .collect()
        });
        Ok(Self {
            parts,
            faces,
            middles: middles.collect(),
            wall: walls(lines, &whole),
        })
    }

    /// The parts of a cell.
    pub(super) fn of_cell(&self, cell: usize) -> &[f64] {
        &self.parts[cell * points_of(D)..(cell + 1) * points_of(D)]
    }

    /// The edge across a face and an axis, which lies in the cells on both sides of the face.
    pub(super) fn edge(
        &self,
        topology: &Topology<D>,
        component: usize,
        face: usize,
        across: usize,
    ) -> Sheet {
        let cells = topology.face_cells[component][face];
        let mut sheet = [0.0; MOST_PARTS];
        for bits in parts_across::<D>(across) {
            let cell = cells[bits >> component & 1];
            if cell != NONE {
                sheet[bits] = self.middles[cell][across][bits ^ (1 << component)];
            }
        }
        sheet
    }

    pub(super) fn make_solid(&mut self, topology: &Topology<D>, cell: usize) {
        self.parts[cell * points_of(D)..(cell + 1) * points_of(D)].fill(0.0);
        self.middles[cell] = [[0.0; MOST_PARTS]; D];
        for (axis, pair) in topology.cell_faces[cell].iter().enumerate() {
            for &face in pair {
                self.faces[axis][face] = [0.0; MOST_PARTS];
            }
        }
    }
}

fn walls<const D: usize>(lines: &GridLines<D>, whole: &CutCells<D>) -> Vec<[f64; D]> {
    let area = 1.0 / area_of_volume::<D>(lines.cell_volume());
    (0..lines.count())
        .map(|cell| match whole.wall(unflatten(cell, lines.cells)) {
            Some(wall) => wall.area_vector.map(|a| a * area),
            None => [0.0; D],
        })
        .map(|wall| {
            if wall.iter().all(|a| a.abs() < SMALLEST_WALL) {
                [0.0; D]
            } else {
                wall
            }
        })
        .collect()
}

/// Area of a face of a cube of that volume.
pub(super) fn area_of_volume<const D: usize>(volume: f64) -> f64 {
    if D == 2 {
        volume.sqrt()
    } else {
        volume.cbrt().powi(2)
    }
}

/// Free part of a sheet.
pub(super) fn mean<const D: usize>(sheet: &Sheet, across: usize) -> f64 {
    let parts = parts_across::<D>(across);
    let sum = parts.fold(0.0, |sum, bits| sum + sheet[bits]);
    sum / points_of(D - 1) as f64
}

/// Where the centre of the free part of a sheet lies, in its lengths from its low end, and 0 along the axis across it;
/// `normal` is that of the ground.
///
/// Where the ground leans to one of the sheet's axes alone the two halves along it say where. Else a line of that
/// normal cuts the sheet.
pub(super) fn centre_of<const D: usize>(
    sheet: &Sheet,
    across: usize,
    normal: [f64; D],
) -> [f64; D] {
    let most = normal.iter().fold(0.0_f64, |most, n| most.max(n.abs()));
    let leans = |axis: &usize| *axis != across && normal[*axis].abs() > UPRIGHT * most;
    let part = mean::<D>(sheet, across);
    let mut centre = [0.0; D];
    let along: Vec<usize> = (0..D).filter(leans).collect();
    if let &[a, b] = along.as_slice()
        && part > 0.0
        && part < 1.0
    {
        let m = [normal[a], normal[b]];
        [centre[a], centre[b]] = centre_above(m, 1.0 - part);
        return centre;
    }
    for axis in (0..D).filter(|&axis| axis != across) {
        let half = |side: usize| {
            let parts = parts_across::<D>(across).filter(|bits| bits >> axis & 1 == side);
            parts.fold(0.0, |sum, bits| sum + sheet[bits]) / (0.5 * points_of(D - 1) as f64)
        };
        centre[axis] = match half(0) - half(1) {
            more if more.abs() < 1e-12 => 0.5,
            more if more > 0.0 => 0.5 * part,
            _ => 1.0 - 0.5 * part,
        };
    }
    centre
}

/// Centre of what lies beyond a line in a unit square, below which there is a given part of it.
fn centre_above(normal: [f64; 2], below: f64) -> [f64; 2] {
    let line = Plane::of_fraction([normal[0], normal[1], 0.0], below);
    let corners = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]];
    let height = |x: [f64; 2]| -line.depth([x[0], x[1], 0.0]);
    let mut kept: Vec<[f64; 2]> = Vec::with_capacity(6);
    for (n, &corner) in corners.iter().enumerate() {
        let next = corners[(n + 1) % corners.len()];
        let (here, there) = (height(corner), height(next));
        if here >= 0.0 {
            kept.push(corner);
        }
        if (here > 0.0) != (there > 0.0) {
            let share = here / (here - there);
            kept.push([0, 1].map(|a| corner[a] + share * (next[a] - corner[a])));
        }
    }
    let (mut area, mut moment) = (0.0, [0.0; 2]);
    for n in 1..kept.len().saturating_sub(1) {
        let [o, p, q] = [kept[0], kept[n], kept[n + 1]];
        let part = (p[0] - o[0]) * (q[1] - o[1]) - (p[1] - o[1]) * (q[0] - o[0]);
        area += part;
        for (a, moment) in moment.iter_mut().enumerate() {
            *moment += part * (o[a] + p[a] + q[a]) / 3.0;
        }
    }
    if area > 0.0 {
        moment.map(|m| m / area)
    } else {
        [0.5; 2]
    }
}

/// Cells that lie at most so many cells from one with ground, along each axis.
pub(super) fn near<const D: usize>(
    topology: &Topology<D>,
    has_ground: impl Fn(usize) -> bool,
    reach: usize,
) -> Vec<bool> {
    let mut near: Vec<bool> = (0..topology.cells()).map(has_ground).collect();
    for axis in 0..D {
        for _ in 0..reach {
            let beside = |cell: usize| {
                let pair = topology.cell_neighbours[cell][axis].iter();
                near[cell] || pair.into_iter().any(|&next| next != NONE && near[next])
            };
            near = (0..near.len()).map(beside).collect();
        }
    }
    near
}

/// Position of the lower corner of a face.
pub(super) fn corner_of_face<const D: usize>(
    grid: &Grid<D>,
    lines: &GridLines<D>,
    component: usize,
    face: usize,
) -> ([usize; D], [f64; D]) {
    let index = unflatten(face, grid.faces(component));
    debug_assert_eq!(flatten(index, grid.faces(component)), face);
    let corner = std::array::from_fn(|a| lines.origin[a] + index[a] as f64 * lines.spacing[a]);
    (index, corner)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The centre of a triangle, of a trapezium, and of the whole.
    #[test]
    fn centres_of_cut_squares() {
        for (normal, below, exact) in [
            ([1.0, 1.0], 0.5, [2.0 / 3.0; 2]),
            ([-1.0, -1.0], 0.5, [1.0 / 3.0; 2]),
            // Legs of 1/2 are cut off at a corner.
            ([1.0, 1.0], 0.125, [(0.5 - 0.125 / 6.0) / 0.875; 2]),
            ([1.0, 1e-12], 0.25, [0.625, 0.5]),
        ] {
            let centre = centre_above(normal, below);
            for (a, b) in centre.iter().zip(exact) {
                assert!((a - b).abs() < 1e-9, "{normal:?} {below} {centre:?}");
            }
        }
    }
}
