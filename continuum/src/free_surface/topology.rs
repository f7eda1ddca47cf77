//! Who touches whom on a staggered grid: tables that loops run over instead of recomputing indices.

use std::ops::Range;

use crate::grid::{Axis, DIMENSIONS, Grid, flatten, unflatten};

/// What stands for a neighbour beyond the edge of the grid.
pub(crate) const NONE: usize = usize::MAX;

/// Neighbourhoods of the cells and faces of one grid. Faces of a component are numbered with x
/// running fastest, boundary faces included.
#[derive(Debug, Clone)]
pub(crate) struct Topology<const D: usize = DIMENSIONS> {
    /// For each cell and axis, the faces below and above; none on a flat axis.
    pub cell_faces: Vec<[[usize; 2]; D]>,
    /// For each cell and axis, the cells below and above.
    pub cell_neighbours: Vec<[[usize; 2]; D]>,
    /// For each component and face, the cells on both sides; the same one twice on a flat axis.
    pub face_cells: [Vec<[usize; 2]>; D],
    /// For each component, face and axis, the faces of the same component below and above.
    pub face_neighbours: [Vec<[[usize; 2]; D]>; D],
    /// Cells over an outlet in the floor ([`super::outlet`]), and the faces of the last component below them, which have
    /// the same numbers.
    pub outlet: Range<usize>,
}

/// Positions below and above one along an axis with `count` positions.
fn beside(axis: &Axis, position: usize, count: usize) -> [Option<usize>; 2] {
    match axis {
        Axis::Flat => [None, None],
        Axis::Periodic { .. } => [
            Some((position + count - 1) % count),
            Some((position + 1) % count),
        ],
        Axis::Bounded { .. } => [
            position.checked_sub(1),
            (position + 1 < count).then_some(position + 1),
        ],
    }
}

impl<const D: usize> Topology<D> {
    pub(crate) fn new(grid: &Grid<D>) -> Self {
        Self::rising(grid, [0; D])
    }

    /// A grid whose periodic axes meet themselves so many cells higher up along the last one. Rows close on themselves
    /// for it, the lowest below the highest: ground below and room above keep them apart.
    pub(crate) fn rising(grid: &Grid<D>, rise: [usize; D]) -> Self {
        let axes = grid.axes();
        let cells: [usize; D] = std::array::from_fn(|axis| axes[axis].cells());
        // A step beyond an end of the period, and the row that it leads to.
        let shifted =
            |rise: usize, row: usize, from: usize, to: usize, count: usize, rows: usize| {
                let is_over = rise > 0 && count > 2;
                if is_over && from + 1 == count && to == 0 {
                    (row + rows - rise % rows) % rows
                } else if is_over && from == 0 && to + 1 == count {
                    (row + rise) % rows
                } else {
                    row
                }
            };
        let replaced =
            |index: [usize; D], axis: usize, position: Option<usize>, counts: [usize; D]| {
                position.map_or(NONE, |position| {
                    let mut index = index;
                    let last = D - 1;
                    if axis < last {
                        let (row, from) = (index[last], index[axis]);
                        index[last] =
                            shifted(rise[axis], row, from, position, counts[axis], counts[last]);
                    }
                    index[axis] = position;
                    flatten(index, counts)
                })
            };
        let all_beside = |index: [usize; D], counts: [usize; D]| {
            std::array::from_fn(|axis| {
                beside(&axes[axis], index[axis], counts[axis])
                    .map(|position| replaced(index, axis, position, counts))
            })
        };
        let count: usize = cells.iter().product();
        let cell_neighbours = (0..count)
            .map(|cell| all_beside(unflatten(cell, cells), cells))
            .collect();
        let cell_faces = (0..count)
            .map(|cell| {
                let index = unflatten(cell, cells);
                std::array::from_fn(|axis| match axes[axis].faces_of_cell(index[axis]) {
                    None => [NONE; 2],
                    Some(pair) => {
                        pair.map(|face| replaced(index, axis, Some(face), grid.faces(axis)))
                    }
                })
            })
            .collect();
        let face_cells = std::array::from_fn(|component| {
            let faces = grid.faces(component);
            (0..faces.iter().product())
                .map(|face| {
                    let index = unflatten(face, faces);
                    axes[component]
                        .cells_at_face(index[component])
                        .map(|position| replaced(index, component, position, cells))
                })
                .collect()
        });
        let face_neighbours = std::array::from_fn(|component| {
            let faces = grid.faces(component);
            (0..faces.iter().product())
                .map(|face| all_beside(unflatten(face, faces), faces))
                .collect()
        });
        Self {
            cell_faces,
            cell_neighbours,
            face_cells,
            face_neighbours,
            outlet: 0..0,
        }
    }

    /// Number of cells.
    pub(crate) fn cells(&self) -> usize {
        self.cell_neighbours.len()
    }

    /// Number of faces of a component.
    pub(crate) fn faces(&self, component: usize) -> usize {
        self.face_cells[component].len()
    }

    /// Whether a face lies on the edge of the grid, but not in an outlet.
    pub(crate) fn is_edge(&self, component: usize, face: usize) -> bool {
        self.face_cells[component][face].contains(&NONE) && !self.is_outlet(component, face)
    }

    /// Whether a face lies in an outlet.
    pub(crate) fn is_outlet(&self, component: usize, face: usize) -> bool {
        component + 1 == D && self.outlet.contains(&face)
    }

    /// Whether the side of a cell across an axis lies in an outlet.
    pub(crate) fn opens(&self, cell: usize, axis: usize, side: usize) -> bool {
        side == 0 && self.is_outlet(axis, cell)
    }

    /// Mean of a quantity of cells over the two cells of a face; beyond the edge it is zero.
    pub(crate) fn face_mean(&self, component: usize, face: usize, of_cells: &[f64]) -> f64 {
        let [low, high] = self.face_cells[component][face];
        let value = |cell: usize| if cell == NONE { 0.0 } else { of_cells[cell] };
        0.5 * (value(low) + value(high))
    }
}
