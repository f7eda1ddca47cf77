//! Where in a bed the grains are: a box of whole cells, open at the top.

use super::cells::Cells;
use nalgebra::Vector3;

/// A side of the box on which grains end.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Side {
    /// Axis that it lies across.
    pub axis: usize,
    /// The face of the grid that it lies on, in cells.
    pub face: usize,
    /// Direction from the grains outwards along the axis.
    pub outwards: f64,
}

/// Sides that a box may have: low and high along x, low and high along y, and its bottom.
pub const SIDES: usize = 5;

impl Side {
    /// Its number in that order.
    pub fn number(&self) -> usize {
        2 * self.axis + usize::from(self.outwards > 0.0)
    }

    /// The cells outside and inside it, at a place along its own axis.
    fn cells(&self) -> [usize; 2] {
        match self.outwards > 0.0 {
            true => [self.face, self.face - 1],
            false => [self.face - 1, self.face],
        }
    }

    /// The two axes along it.
    pub fn along(&self) -> [usize; 2] {
        match self.axis {
            0 => [1, 2],
            1 => [0, 2],
            _ => [0, 1],
        }
    }
}

/// The box: cells from `low` up to but not including `high`; where it reaches a wall of the bed it has no side. At
/// the top it is open.
#[derive(Clone, Debug, PartialEq)]
pub struct Zone {
    /// First cell along each axis.
    pub low: [usize; 3],
    /// Cell behind the last along each axis.
    pub high: [usize; 3],
    /// Its sides.
    pub sides: Vec<Side>,
}

impl Zone {
    /// The box of these cells.
    pub fn new(cells: &Cells, low: [usize; 3], [x, y]: [usize; 2]) -> Self {
        let high = [x, y, cells.counts[2]];
        let mut sides = Vec::new();
        for axis in 0..3 {
            let mut add = |face: usize, outwards: f64| {
                sides.push(Side {
                    axis,
                    face,
                    outwards,
                });
            };
            if low[axis] > 0 {
                add(low[axis], -1.0);
            }
            if axis < 2 && high[axis] < cells.counts[axis] {
                add(high[axis], 1.0);
            }
        }
        Self { low, high, sides }
    }

    /// The box whose sides lie so many cells farther inside.
    pub fn narrowed(&self, cells: &Cells, by: usize) -> Self {
        let low = self.low.map(|low| if low > 0 { low + by } else { 0 });
        let high = [0, 1].map(|axis| match self.high[axis] {
            high if high < cells.counts[axis] => high - by,
            high => high,
        });
        Self::new(cells, low, high)
    }

    /// The box with a side so many cells farther out, or in if negative; a side that comes to a wall is gone.
    pub fn moved(&self, cells: &Cells, side: &Side, by: isize) -> Self {
        let (mut low, mut high) = (self.low, self.high);
        let axis = side.axis;
        match side.outwards > 0.0 {
            true => high[axis] = high[axis].saturating_add_signed(by).min(cells.counts[axis]),
            false => low[axis] = low[axis].saturating_add_signed(-by),
        }
        Self::new(cells, low, [high[0], high[1]])
    }

    /// Its first cells along all axes and those behind its last along x and y, as numbers.
    pub fn corners(&self) -> [f64; 5] {
        let [x, y, z] = self.low;
        [x, y, z, self.high[0], self.high[1]].map(|n| n as f64)
    }

    /// Cells along an axis that lie farther inside than this from both of its sides, of so many filled ones upwards.
    pub fn inside(&self, axis: usize, filled: usize, width: f64) -> f64 {
        let sides = self.sides.iter().filter(|s| s.axis == axis).count() as f64;
        let high = if axis < 2 { self.high[axis] } else { filled };
        high as f64 - self.low[axis] as f64 - sides * width
    }

    /// Distance of a place from a side into the grains, in cells.
    pub fn depth(&self, cells: &Cells, side: &Side, at: &Vector3<f64>) -> f64 {
        -side.outwards * (cells.offset(side.axis, at[side.axis]) - side.face as f64)
    }

    /// Label of a place: its distance from the nearest side into the grains, in cells.
    pub fn label(&self, cells: &Cells, at: &Vector3<f64>) -> f64 {
        let depths = self.sides.iter().map(|side| self.depth(cells, side, at));
        depths.fold(f64::INFINITY, f64::min)
    }

    /// Label of the middle of a cell.
    pub fn label_of_cell(&self, index: [usize; 3]) -> f64 {
        let depths = self
            .sides
            .iter()
            .map(|side| -side.outwards * (index[side.axis] as f64 + 0.5 - side.face as f64));
        depths.fold(f64::INFINITY, f64::min)
    }
}

/// A face of the grid on a side of the box.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Face {
    /// Side it belongs to.
    pub side: usize,
    /// The cells outside and inside.
    pub cells: [usize; 2],
    /// The face below it on an upright side: that whose grains bear what presses on it where it has none.
    pub below: Option<usize>,
}

/// All faces of the sides, and where those of each side begin.
#[derive(Clone, Debug, Default)]
pub struct Faces {
    /// The faces.
    pub all: Vec<Face>,
    first: Vec<usize>,
}

impl Faces {
    /// Those of a box.
    pub fn of(cells: &Cells, zone: &Zone) -> Self {
        let mut faces = Self::default();
        for (number, side) in zone.sides.iter().enumerate() {
            faces.first.push(faces.all.len());
            let [a, b] = side.along();
            for v in zone.low[b]..zone.high[b] {
                for u in zone.low[a]..zone.high[a] {
                    let beside = side.cells().map(|at| {
                        let mut index = [0; 3];
                        (index[side.axis], index[a], index[b]) = (at, u, v);
                        cells.cell(index)
                    });
                    let width = zone.high[a] - zone.low[a];
                    let upright = side.axis < 2 && v > zone.low[b];
                    faces.all.push(Face {
                        side: number,
                        cells: beside,
                        below: upright.then(|| faces.all.len() - width),
                    });
                }
            }
        }
        faces
    }

    /// The faces of a side around a place with their hats.
    pub fn around(
        &self,
        cells: &Cells,
        zone: &Zone,
        side: usize,
        at: &Vector3<f64>,
    ) -> [(usize, f64); 4] {
        let [a, b] = zone.sides[side].along();
        let range = |axis: usize| [zone.low[axis], zone.high[axis] - 1];
        let (u, v) = (
            cells.along(a, at[a], range(a)),
            cells.along(b, at[b], range(b)),
        );
        let width = zone.high[a] - zone.low[a];
        std::array::from_fn(|n| {
            let ((i, s), (k, t)) = (u[n % 2], v[n / 2]);
            let place = self.first[side] + (i - zone.low[a]) + width * (k - zone.low[b]);
            (place, s * t)
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const CELLS: Cells = Cells {
        counts: [8, 6, 5],
        low: [0.0; 3],
        spacing: [1.0, 2.0, 0.5],
    };

    #[test]
    fn labels_are_distances_from_the_nearest_side() {
        let zone = Zone::new(&CELLS, [2, 0, 1], [6, 4]);
        // x low and high, y high, the bottom: at y low it reaches the wall.
        assert_eq!(zone.sides.len(), 4);
        let label = |at: [f64; 3]| zone.label(&CELLS, &at.into());
        assert_eq!(label([3.0, 1.0, 2.0]), 1.0);
        assert_eq!(label([4.0, 7.0, 2.0]), 0.5);
        assert_eq!(label([4.0, 1.0, 0.75]), 0.5);
        assert_eq!(label([1.5, 1.0, 2.0]), -0.5);
        assert_eq!(zone.label_of_cell([3, 0, 1]), 0.5);
        assert_eq!(Zone::new(&CELLS, [0, 0, 0], [8, 6]).sides.len(), 0);
    }

    #[test]
    fn a_side_that_comes_to_a_wall_is_gone() {
        let zone = Zone::new(&CELLS, [2, 0, 1], [6, 4]);
        let numbers = |zone: &Zone| zone.sides.iter().map(Side::number).collect::<Vec<_>>();
        assert_eq!(numbers(&zone), [0, 1, 3, 4]);
        let wider = zone.moved(&CELLS, &zone.sides[0], 1);
        assert_eq!((wider.low, wider.high), ([1, 0, 1], [6, 4, 5]));
        assert_eq!(wider.moved(&CELLS, &wider.sides[0], -1), zone);
        let open = wider.moved(&CELLS, &wider.sides[1], 5);
        assert_eq!((numbers(&open), open.high[0]), (vec![0, 3, 4], 8));
        let deep = open.moved(&CELLS, &open.sides[2], 3);
        assert_eq!(numbers(&deep), [0, 3]);
        assert_eq!(zone.inside(0, 4, 1.0), 2.0);
        assert_eq!(zone.inside(2, 4, 1.0), 2.0);
    }

    #[test]
    fn faces_of_a_side_lie_between_its_cells() {
        let zone = Zone::new(&CELLS, [2, 1, 1], [6, 4]);
        let faces = Faces::of(&CELLS, &zone);
        // Two sides across x of 3 x 4 faces, two across y of 4 x 4, the bottom of 4 x 3.
        assert_eq!(faces.all.len(), 2 * 12 + 2 * 16 + 12);
        for face in &faces.all {
            let [out, inside] = face.cells.map(|cell| CELLS.index(cell));
            assert!(zone.label_of_cell(out) < 0.0 && zone.label_of_cell(inside) > 0.0);
            if let Some(below) = face.below {
                assert_eq!(faces.all[below].side, face.side);
                let [under, _] = faces.all[below].cells.map(|cell| CELLS.index(cell));
                assert_eq!(under[2] + 1, out[2]);
            }
        }
        for side in 0..zone.sides.len() {
            let around = faces.around(&CELLS, &zone, side, &[4.2, 5.1, 1.3].into());
            let sum: f64 = around.iter().map(|f| f.1).sum();
            assert!((sum - 1.0).abs() < 1e-14);
            assert!(around.iter().all(|f| faces.all[f.0].side == side));
        }
    }
}
