//! Ground in space, as a surface of triangles.

use super::bends::for_columns;
use super::profile::area_below;
use super::{CutCells, GridLines, require_positions};
use crate::error::{Error, require};

/// The surface of ground: triangles whose corners run counterclockwise seen from outside the ground.
///
/// It may be closed, as a body is, or open, as terrain is, with ground below it without end; it may
/// hang over, but must not cross itself, and on the whole grid every vertical line from far above has
/// to meet it with the ground below first.
#[derive(Debug, Clone, PartialEq)]
pub struct Surface {
    pub(super) vertices: Vec<[f64; 3]>,
    pub(super) triangles: Vec<[usize; 3]>,
}

impl Surface {
    /// The surface of the given triangles (m).
    ///
    /// # Errors
    /// [`Error::OutOfRange`] for no triangle, a corner that is not among the vertices, or coordinates
    /// that are not finite.
    pub fn new(vertices: Vec<[f64; 3]>, triangles: Vec<[usize; 3]>) -> Result<Self, Error> {
        require(
            !triangles.is_empty(),
            "terrain.triangles",
            0.0,
            "at least 1",
        )?;
        require_positions("terrain.vertices", &vertices)?;
        for corner in triangles.iter().flatten() {
            require(
                *corner < vertices.len(),
                "terrain.triangles",
                *corner as f64,
                format!("corners from 0 to below {}, the vertices", vertices.len()),
            )?;
        }
        Ok(Self {
            vertices,
            triangles,
        })
    }

    /// The corners of all triangles (m).
    pub fn vertices(&self) -> &[[f64; 3]] {
        &self.vertices
    }

    /// The triangles, by their corners.
    pub fn triangles(&self) -> &[[usize; 3]] {
        &self.triangles
    }

    /// How the ground cuts the cells of a grid. A `closed` body may lie anywhere; open terrain has to
    /// span the grid along x and y.
    ///
    /// # Errors
    /// [`Error::OutOfRange`] for a grid that reaches beyond open terrain.
    pub fn cut(&self, lines: &GridLines<3>, closed: bool) -> Result<CutCells<3>, Error> {
        let mut cut = CutCells::open(*lines)?;
        let mut vertices = lines.local(&self.vertices);
        if !closed {
            for axis in 0..2 {
                let along = || vertices.iter().map(|v| v[axis]);
                let low = along().fold(f64::INFINITY, f64::min);
                let high = along().fold(f64::NEG_INFINITY, f64::max);
                lines.require_inside(axis, low, high, "terrain.triangles")?;
            }
        }
        lines.snap(&mut vertices);
        for corners in &self.triangles {
            add_triangle(&mut cut, &corners.map(|c| vertices[c]));
        }
        Ok(cut.finish())
    }
}

pub(super) fn span(polygon: &[[f64; 3]], axis: usize) -> [f64; 2] {
    polygon
        .iter()
        .fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], corner| {
            [low.min(corner[axis]), high.max(corner[axis])]
        })
}

/// The part of a convex polygon on one side of a grid plane: `above` it or below.
pub(super) fn clip(polygon: &[[f64; 3]], axis: usize, at: f64, above: bool) -> Vec<[f64; 3]> {
    let side = |corner: &[f64; 3]| {
        let d = corner[axis] - at;
        if above { d } else { -d }
    };
    let mut kept = Vec::with_capacity(polygon.len() + 1);
    for (n, corner) in polygon.iter().enumerate() {
        let next = &polygon[(n + 1) % polygon.len()];
        let (here, there) = (side(corner), side(next));
        if here >= 0.0 {
            kept.push(*corner);
        }
        if (here > 0.0 && there < 0.0) || (here < 0.0 && there > 0.0) {
            let share = here / (here - there);
            let mut cut: [f64; 3] =
                std::array::from_fn(|a| corner[a] + share * (next[a] - corner[a]));
            cut[axis] = at;
            kept.push(cut);
        }
    }
    kept
}

/// Area vector ½ Σ a × b and centre of a plane polygon.
pub(super) fn area_vector(polygon: &[[f64; 3]]) -> ([f64; 3], [f64; 3]) {
    let (mut vector, mut moment, mut total) = ([0.0; 3], [0.0; 3], 0.0);
    for n in 1..polygon.len().saturating_sub(1) {
        let [o, p, q] = [polygon[0], polygon[n], polygon[n + 1]];
        let a: [f64; 3] = std::array::from_fn(|c| p[c] - o[c]);
        let b: [f64; 3] = std::array::from_fn(|c| q[c] - o[c]);
        let cross: [f64; 3] = std::array::from_fn(|c| {
            let (u, v) = ((c + 1) % 3, (c + 2) % 3);
            0.5 * (a[u] * b[v] - a[v] * b[u])
        });
        let area = cross.iter().map(|x| x * x).sum::<f64>().sqrt();
        total += area;
        for c in 0..3 {
            vector[c] += cross[c];
            moment[c] += area * (o[c] + p[c] + q[c]) / 3.0;
        }
    }
    let centre = if total > 0.0 {
        moment.map(|m| m / total)
    } else {
        [0.0; 3]
    };
    (vector, centre)
}

/// Area of the polygon's shadow on the plane z = 0, positive if it faces upwards, and the volume
/// between the polygon and the height z.
pub(super) fn shadow(polygon: &[[f64; 3]], z: f64) -> [f64; 2] {
    let (mut area, mut volume) = (0.0, 0.0);
    for n in 1..polygon.len().saturating_sub(1) {
        let [o, p, q] = [polygon[0], polygon[n], polygon[n + 1]];
        let part = 0.5 * ((p[0] - o[0]) * (q[1] - o[1]) - (p[1] - o[1]) * (q[0] - o[0]));
        area += part;
        volume += part * ((o[2] + p[2] + q[2]) / 3.0 - z);
    }
    [area, volume]
}

/// Ground below one triangle, in all cells.
fn add_triangle(cut: &mut CutCells<3>, triangle: &[[f64; 3]; 3]) {
    let lines = cut.lines;
    let facing = shadow(triangle, 0.0)[0];
    for_columns(&lines, triangle, |index, column| {
        add_column(cut, index, column, triangle);
    });
    if facing == 0.0 {
        return;
    }
    // Ground on the faces across x and y, below the line in which their planes cut the triangle.
    for (axis, along) in [(0, 1), (1, 0)] {
        let ends = span(triangle, axis);
        let reach = lines.reach(axis, ends[0], ends[1]);
        for line in reach.start..=reach.end {
            let at = lines.local_line(axis, line);
            if lines.crosses(line, at, ends[0], ends[1]) {
                add_section(cut, (axis, line, at), along, triangle, facing.signum());
            }
        }
    }
}

/// Volumes, faces across z and walls of one column of cells, from the part of a triangle above it.
fn add_column(
    cut: &mut CutCells<3>,
    [i, j]: [usize; 2],
    column: &[[f64; 3]],
    triangle: &[[f64; 3]; 3],
) {
    let lines = cut.lines;
    let mut above_low = clip(column, 2, 0.0, true);
    let [mut area, mut volume] = shadow(&above_low, 0.0);
    let in_plane = |axis: usize| {
        let [low, high] = span(triangle, axis);
        (low == high).then_some(low)
    };
    let sides = [0, 1].map(|axis| {
        let index = [i, j][axis];
        in_plane(axis).is_none_or(|x| {
            let [low, high] = [
                lines.local_line(axis, index),
                lines.local_line(axis, index + 1),
            ];
            lines.holds(axis, index, x, low, high)
        })
    });
    let lowest = span(column, 2)[0];
    for k in 0..lines.cells[2] {
        if above_low.is_empty() {
            break;
        }
        let (z0, z1) = (lines.local_line(2, k), lines.local_line(2, k + 1));
        if z1 < lowest {
            // All of it lies above the cell.
            let [_, volume_high] = shadow(&above_low, z1);
            cut.volumes[lines.number([i, j, k], None)] += volume - volume_high;
            cut.apertures[2][lines.number([i, j, k], Some(2))] += area;
            if k + 1 == lines.cells[2] {
                cut.apertures[2][lines.number([i, j, k + 1], Some(2))] += area;
            }
            volume = volume_high;
            continue;
        }
        let above_high = clip(&above_low, 2, z1, true);
        let [area_high, volume_high] = shadow(&above_high, z1);
        cut.volumes[lines.number([i, j, k], None)] += volume - volume_high;
        cut.apertures[2][lines.number([i, j, k], Some(2))] += area;
        if k + 1 == lines.cells[2] {
            cut.apertures[2][lines.number([i, j, k + 1], Some(2))] += area_high;
        }
        let is_here = in_plane(2).is_none_or(|z| lines.holds(2, k, z, z0, z1));
        if is_here && sides[0] && sides[1] {
            let inside = clip(&above_low, 2, z1, false);
            let (vector, centre) = area_vector(&inside);
            if vector != [0.0; 3] {
                cut.walls[lines.number([i, j, k], None)].add(vector, centre);
            }
        }
        [area, volume] = [area_high, volume_high];
        above_low = above_high;
    }
}

/// Ground on the faces of one grid plane across `axis`, below its section with a triangle.
fn add_section(
    cut: &mut CutCells<3>,
    (axis, line, at): (usize, usize, f64),
    along: usize,
    triangle: &[[f64; 3]; 3],
    sign: f64,
) {
    let lines = cut.lines;
    // The same side of the plane as `crosses` looks at.
    let is_left = |x: f64| if line == 0 { x <= at } else { x < at };
    let mut ends: Vec<[f64; 2]> = Vec::with_capacity(2);
    for n in 0..3 {
        let (from, to) = (triangle[n], triangle[(n + 1) % 3]);
        if is_left(from[axis]) != is_left(to[axis]) {
            let share = (at - from[axis]) / (to[axis] - from[axis]);
            ends.push([along, 2].map(|a| from[a] + share * (to[a] - from[a])));
        }
    }
    let &[mut left, mut right] = ends.as_slice() else {
        return;
    };
    if left[0] > right[0] {
        (left, right) = (right, left);
    }
    let length = right[0] - left[0];
    if length <= 0.0 {
        return;
    }
    let height = |x: f64| left[1] + (right[1] - left[1]) * ((x - left[0]) / length).clamp(0.0, 1.0);
    for n in lines.reach(along, left[0], right[0]) {
        let a = left[0].max(lines.local_line(along, n));
        let b = right[0].min(lines.local_line(along, n + 1));
        if b <= a {
            continue;
        }
        let (ha, hb) = (height(a), height(b));
        for k in 0..lines.cells[2] {
            let (z0, z1) = (lines.local_line(2, k), lines.local_line(2, k + 1));
            let mut face = [0, 0, k];
            face[axis] = line;
            face[along] = n;
            cut.apertures[axis][lines.number(face, Some(axis))] +=
                sign * (area_below(a, b, ha, hb, z0) - area_below(a, b, ha, hb, z1));
        }
    }
}
