//! Ground in cells within which its surface bends: what lies under each of its plane pieces.

use super::profile::share_within;
use super::surface::{area_vector, clip, shadow, span};
use super::{GridLines, Profile, Surface};

/// Pieces whose directions differ by a smaller angle are one plane.
const STRAIGHT: f64 = 1e-9;
/// Less of a piece than this part of its cell's faces is none.
const SMALLEST: f64 = 1e-12;

/// What lies under a piece of the ground's surface within a cell. The ground is the sum over the pieces, with their signs.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Under {
    /// Number of the cell.
    pub cell: usize,
    /// 1, or −1 under a soffit.
    pub sign: f64,
    /// The piece, or the cell's ceiling under it, in the cell's coordinates from 0 to 1.
    pub shape: Shape,
}

/// A piece of ground's surface.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Shape {
    /// A straight line (x, z), which may lie above the cell and below.
    Line([[f64; 2]; 2]),
    /// A triangle inside the cell, or in its ceiling.
    Triangle([[f64; 3]; 3]),
}

impl Profile {
    /// What lies under the pieces of the line in cells through which two of different directions go.
    pub(super) fn bends(&self, lines: &GridLines<2>) -> Vec<Under> {
        let mut points = lines.local(&self.points);
        lines.snap(&mut points);
        let mut bends = vec![false; lines.count()];
        let mut directions: Vec<Option<[f64; 2]>> = vec![None; lines.count()];
        for_pieces(lines, &points, |cell, piece, low, high| {
            let [from, to] = piece;
            let is_inside = |axis: usize| from[axis] > low[axis] && from[axis] < high[axis];
            if share_within(piece, [low, high], is_inside).is_none() {
                return;
            }
            let direction = [to[0] - from[0], to[1] - from[1]];
            let length = direction[0].hypot(direction[1]);
            if length == 0.0 {
                return;
            }
            let direction = direction.map(|d| d / length);
            bends[cell] |= differ(directions[cell].get_or_insert(direction), &direction);
        });
        let mut all = Vec::new();
        for_pieces(lines, &points, |cell, [from, to], low, high| {
            let (left, right) = if to[0] >= from[0] {
                (from, to)
            } else {
                (to, from)
            };
            let [a, b] = [left[0].max(low[0]), right[0].min(high[0])];
            if !bends[cell] || b <= a {
                return;
            }
            let slope = (right[1] - left[1]) / (right[0] - left[0]);
            let size = [high[0] - low[0], high[1] - low[1]];
            let ends = [a, b].map(|x| {
                let z = left[1] + slope * (x - left[0]);
                [(x - low[0]) / size[0], (z - low[1]) / size[1]]
            });
            all.push(Under {
                cell,
                sign: if to[0] > from[0] { 1.0 } else { -1.0 },
                shape: Shape::Line(ends),
            });
        });
        all.sort_by_key(|under: &Under| under.cell);
        all
    }
}

/// Whether two directions differ. Opposite ones do: a roof and its soffit.
fn differ<const N: usize>(one: &[f64; N], other: &[f64; N]) -> bool {
    let mut pairs = one.iter().zip(other);
    pairs.any(|(a, b)| (a - b).abs() > STRAIGHT)
}

/// Calls for each piece of a line and each cell of the columns that it reaches, with the cell's corners.
fn for_pieces(
    lines: &GridLines<2>,
    points: &[[f64; 2]],
    mut call: impl FnMut(usize, [[f64; 2]; 2], [f64; 2], [f64; 2]),
) {
    for piece in points.windows(2) {
        let (from, to) = (piece[0], piece[1]);
        for i in lines.reach(0, from[0].min(to[0]), from[0].max(to[0])) {
            for k in 0..lines.cells[1] {
                let [low, high] =
                    [0, 1].map(|n| [lines.local_line(0, i + n), lines.local_line(1, k + n)]);
                call(lines.number([i, k], None), [from, to], low, high);
            }
        }
    }
}

impl Surface {
    /// What lies under the triangles in cells through which two of different directions go.
    pub(super) fn bends(&self, lines: &GridLines<3>) -> Vec<Under> {
        let mut vertices = lines.local(&self.vertices);
        lines.snap(&mut vertices);
        let triangles = || {
            self.triangles
                .iter()
                .map(|corners| corners.map(|c| vertices[c]))
        };
        let face = lines.cell_volume().powf(2.0 / 3.0);
        let mut bends = vec![false; lines.count()];
        let mut normals: Vec<Option<[f64; 3]>> = vec![None; lines.count()];
        for triangle in triangles() {
            let (vector, _) = area_vector(&triangle);
            let length = vector.iter().map(|v| v * v).sum::<f64>().sqrt();
            if length == 0.0 {
                continue;
            }
            let normal = vector.map(|v| v / length);
            for_columns(lines, &triangle, |[i, j], column| {
                let heights = span(column, 2);
                for k in lines.reach(2, heights[0], heights[1]) {
                    let [low, high] = [0, 1].map(|n| lines.local_line(2, k + n));
                    let inside = clip(&clip(column, 2, low, true), 2, high, false);
                    let (area, _) = area_vector(&inside);
                    if area.iter().all(|a| a.abs() < SMALLEST * face) {
                        continue;
                    }
                    let cell = lines.number([i, j, k], None);
                    bends[cell] |= differ(normals[cell].get_or_insert(normal), &normal);
                }
            });
        }
        let mut all = Vec::new();
        for triangle in triangles() {
            for_columns(lines, &triangle, |[i, j], column| {
                for k in 0..lines.cells[2] {
                    let cell = lines.number([i, j, k], None);
                    if !bends[cell] {
                        continue;
                    }
                    let [low, high] = [0, 1].map(|n| lines.local_line(2, k + n));
                    let above = clip(column, 2, low, true);
                    let inside = clip(&above, 2, high, false);
                    let mut beyond = clip(&above, 2, high, true);
                    beyond.iter_mut().for_each(|corner| corner[2] = high);
                    let index = [i, j, k];
                    let own = |corner: [f64; 3]| {
                        std::array::from_fn(|a| {
                            (corner[a] - lines.local_line(a, index[a])) / lines.spacing[a]
                        })
                    };
                    for polygon in [inside, beyond] {
                        for n in 1..polygon.len().saturating_sub(1) {
                            let corners = [polygon[0], polygon[n], polygon[n + 1]];
                            let [area, _] = shadow(&corners, 0.0);
                            if area != 0.0 {
                                all.push(Under {
                                    cell,
                                    sign: area.signum(),
                                    shape: Shape::Triangle(corners.map(own)),
                                });
                            }
                        }
                    }
                }
            });
        }
        all.sort_by_key(|under| under.cell);
        all
    }
}

/// Calls for each column of cells with the part of a triangle above or below it.
pub(super) fn for_columns(
    lines: &GridLines<3>,
    triangle: &[[f64; 3]; 3],
    mut call: impl FnMut([usize; 2], &[[f64; 3]]),
) {
    let [across_x, across_y] = [0, 1].map(|axis| span(triangle, axis));
    for i in lines.reach(0, across_x[0], across_x[1]) {
        let [x0, x1] = [lines.local_line(0, i), lines.local_line(0, i + 1)];
        let strip = clip(&clip(triangle, 0, x0, true), 0, x1, false);
        for j in lines.reach(1, across_y[0], across_y[1]) {
            let [y0, y1] = [lines.local_line(1, j), lines.local_line(1, j + 1)];
            let column = clip(&clip(&strip, 1, y0, true), 1, y1, false);
            if column.len() >= 3 {
                call([i, j], &column);
            }
        }
    }
}
