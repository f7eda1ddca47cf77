//! Distance of points from a surface of triangles.

use super::{GridLines, Surface};

/// Columns of cells beyond a point's own in which triangles are looked for.
const REACH: usize = 4;

/// The triangles over each column of cells of a grid and a margin round it.
pub(super) struct Nearest {
    lines: GridLines<3>,
    triangles: Vec<[[f64; 3]; 3]>,
    columns: Vec<Vec<u32>>,
    counts: [usize; 2],
}

impl Nearest {
    pub(super) fn new(surface: &Surface, lines: &GridLines<3>) -> Self {
        let counts = [0, 1].map(|axis| lines.cells[axis] + 2 * REACH);
        let mut found = Self {
            lines: *lines,
            triangles: Vec::new(),
            columns: vec![Vec::new(); counts[0] * counts[1]],
            counts,
        };
        for corners in surface.triangles() {
            let triangle = corners.map(|corner| surface.vertices()[corner]);
            let ranges = [0, 1].map(|axis| {
                let along = triangle.map(|corner| found.column(corner, axis));
                let low = along.iter().fold(f64::INFINITY, |m, x| m.min(*x));
                let high = along.iter().fold(f64::NEG_INFINITY, |m, x| m.max(*x));
                let end = counts[axis] as f64;
                // Nothing where it lies beyond the margin.
                if high < 0.0 || low >= end {
                    0..0
                } else {
                    low.max(0.0) as usize..(high.min(end - 1.0) as usize + 1)
                }
            });
            let [across_x, across_y] = ranges;
            if across_x.is_empty() || across_y.is_empty() {
                continue;
            }
            let number = found.triangles.len() as u32;
            found.triangles.push(triangle);
            for j in across_y {
                for i in across_x.clone() {
                    found.columns[i + counts[0] * j].push(number);
                }
            }
        }
        found
    }

    /// Place of a position among the columns of an axis.
    fn column(&self, position: [f64; 3], axis: usize) -> f64 {
        (position[axis] - self.lines.origin[axis]) / self.lines.spacing[axis] + REACH as f64
    }

    /// Distance of a point of the grid from the surface (m), at most four cells.
    pub(super) fn distance(&self, point: [f64; 3]) -> f64 {
        let size = self.lines.spacing[0].min(self.lines.spacing[1]);
        let mut least = REACH as f64 * size;
        let [i, j] = [0, 1].map(|axis| self.column(point, axis).max(0.0) as usize);
        for ring in 0..=REACH {
            let low = [i, j].map(|n| n.saturating_sub(ring));
            let high: [usize; 2] =
                std::array::from_fn(|a| ([i, j][a] + ring).min(self.counts[a] - 1));
            for b in low[1]..=high[1] {
                for a in low[0]..=high[0] {
                    if a.abs_diff(i).max(b.abs_diff(j)) != ring {
                        continue;
                    }
                    for &number in &self.columns[a + self.counts[0] * b] {
                        least = least.min(from_triangle(point, &self.triangles[number as usize]));
                    }
                }
            }
            // What lies in columns farther off is no nearer than they are.
            if least <= ring as f64 * size {
                break;
            }
        }
        least
    }
}

fn minus(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    std::array::from_fn(|c| a[c] - b[c])
}

fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

fn cross(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    std::array::from_fn(|c| {
        let (u, v) = ((c + 1) % 3, (c + 2) % 3);
        a[u] * b[v] - a[v] * b[u]
    })
}

/// Distance of a point from a triangle: from its plane where the point lies above or below it, else from its sides.
fn from_triangle(point: [f64; 3], corners: &[[f64; 3]; 3]) -> f64 {
    let normal = cross(minus(corners[1], corners[0]), minus(corners[2], corners[0]));
    let square = dot(normal, normal);
    let sides = [0, 1, 2].map(|n| (corners[n], corners[(n + 1) % 3]));
    let is_inside = square > 0.0
        && sides
            .iter()
            .all(|&(from, to)| dot(cross(normal, minus(to, from)), minus(point, from)) >= 0.0);
    if is_inside {
        return dot(normal, minus(point, corners[0])).abs() / square.sqrt();
    }
    let from_side = |(from, to): ([f64; 3], [f64; 3])| {
        let (along, away) = (minus(to, from), minus(point, from));
        let length = dot(along, along);
        let share = if length > 0.0 {
            (dot(away, along) / length).clamp(0.0, 1.0)
        } else {
            0.0
        };
        let rest = minus(away, along.map(|x| share * x));
        dot(rest, rest).sqrt()
    };
    sides
        .map(from_side)
        .into_iter()
        .fold(f64::INFINITY, f64::min)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// From the plane, from a side, from a corner of a triangle.
    #[test]
    fn distances_by_hand() {
        let triangle = [[0.0, 0.0, 1.0], [3.0, 0.0, 1.0], [0.0, 3.0, 1.0]];
        for (point, exact) in [
            ([1.0, 1.0, 3.0], 2.0),
            ([1.0, 1.0, 0.5], 0.5),
            ([1.0, -3.0, 5.0], 5.0),
            ([3.0, 3.0, 1.0], 1.5 * std::f64::consts::SQRT_2),
            ([6.0, -4.0, 1.0], 5.0),
        ] {
            assert!((from_triangle(point, &triangle) - exact).abs() < 1e-14);
        }
    }

    /// The nearest triangle is found wherever it lies among the columns: on an incline the distance is the height
    /// above it times the cosine, up to four cells.
    #[test]
    fn distances_from_an_incline() {
        let (n, slope) = (24, 0.75);
        let vertices = (0..n * n).map(|v| {
            let [x, y] = [v % n, v / n].map(|i| -2.0 + 0.25 * i as f64);
            [x, y, slope * x]
        });
        let mut triangles = Vec::new();
        for v in (0..n * (n - 1)).filter(|v| v % n + 1 < n) {
            triangles.extend([[v, v + 1, v + n + 1], [v, v + n + 1, v + n]]);
        }
        let surface = Surface::new(vertices.collect(), triangles).unwrap();
        let lines = GridLines {
            origin: [0.0; 3],
            spacing: [0.2; 3],
            cells: [10, 10, 12],
        };
        let nearest = Nearest::new(&surface, &lines);
        for [x, y, up] in [
            [0.3, 1.1, 0.2],
            [1.9, 0.1, 0.5],
            [1.0, 1.0, 0.9],
            [0.0, 0.0, 0.01],
        ] {
            let found = nearest.distance([x, y, slope * x + up]);
            assert!((found - 0.8 * up).abs() < 1e-14, "{x} {y} {up} {found}");
        }
        assert_eq!(nearest.distance([1.0, 1.0, 40.0]), 0.8);
    }
}
