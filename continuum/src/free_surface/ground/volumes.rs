//! Volume of a unit cell under two planes at once: what of the matter under a surface is ground.

use crate::free_surface::plane::Plane;
use crate::terrain::{Shape, Under};

/// Most corners of a rectangle cut by two lines.
const MOST_CORNERS: usize = 6;

/// Volume of the unit cell under two planes.
pub(super) fn common_volume(one: &Plane, other: &Plane) -> f64 {
    const WHOLE: ([f64; 3], [f64; 3]) = ([0.0; 3], [1.0; 3]);
    if is_above(one) {
        return other.volume_in(WHOLE.0, WHOLE.1);
    }
    if is_above(other) {
        return one.volume_in(WHOLE.0, WHOLE.1);
    }
    if is_above(&turned_over(one)) || is_above(&turned_over(other)) {
        return 0.0;
    }
    if one.normal[2] == 0.0 && other.normal[2] == 0.0 {
        common_area(one, other)
    } else {
        common_volume_in_space(one, other)
    }
}

fn turned_over(plane: &Plane) -> Plane {
    Plane {
        normal: plane.normal.map(|n| -n),
        offset: -plane.offset,
    }
}

/// Whether all of the unit cell lies under a plane.
fn is_above(plane: &Plane) -> bool {
    plane.offset >= plane.normal.iter().map(|n| n.max(0.0)).sum()
}

/// The same where neither plane leans to the third axis.
fn common_area(one: &Plane, other: &Plane) -> f64 {
    Polygon::CELL.under(one).under(other).area()
}

/// A convex polygon.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Polygon {
    corners: [[f64; 2]; MOST_CORNERS],
    count: usize,
}

impl Polygon {
    /// A whole cell.
    const CELL: Self = Self::between([0.0, 1.0]);

    /// The part of a cell between two places along x.
    const fn between([a, b]: [f64; 2]) -> Self {
        let mut corners = [[0.0; 2]; MOST_CORNERS];
        [corners[0], corners[1]] = [[a, 0.0], [b, 0.0]];
        [corners[2], corners[3]] = [[b, 1.0], [a, 1.0]];
        Self { corners, count: 4 }
    }

    /// The part of it that lies under a plane.
    fn under(&self, plane: &Plane) -> Self {
        let depth = |[x, y]: [f64; 2]| plane.depth([x, y, 0.0]);
        let mut left = Self {
            corners: [[0.0; 2]; MOST_CORNERS],
            count: 0,
        };
        let mut keep = |corner: [f64; 2]| {
            if let Some(slot) = left.corners.get_mut(left.count) {
                *slot = corner;
                left.count += 1;
            }
        };
        for n in 0..self.count {
            let (from, to) = (self.corners[n], self.corners[(n + 1) % self.count]);
            let (a, b) = (depth(from), depth(to));
            if a > 0.0 {
                keep(from);
            }
            if (a > 0.0) != (b > 0.0) {
                let part = a / (a - b);
                keep([0, 1].map(|k| from[k] + part * (to[k] - from[k])));
            }
        }
        left
    }

    fn area(&self) -> f64 {
        let corners = &self.corners[..self.count];
        let mut twice = 0.0;
        for pair in corners.windows(2).skip(1) {
            let [a, b] = [pair[0], pair[1]].map(|c| [0, 1].map(|k| c[k] - corners[0][k]));
            twice += a[0] * b[1] - a[1] * b[0];
        }
        0.5 * twice
    }
}

/// Ground in a cell within which its surface bends: what lies under each of its pieces, with a sign.
#[derive(Debug, Clone, PartialEq, Default)]
pub(super) struct Bend {
    slices: Vec<Slice>,
    prisms: Vec<Prism>,
}

/// What lies between a line and the floor of its cell.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Slice {
    polygon: Polygon,
    /// With its sign.
    area: f64,
}

impl Slice {
    /// The area under a plane, with its sign.
    fn under(&self, plane: &Plane) -> f64 {
        let corners = &self.polygon.corners[..self.polygon.count];
        let depths = || corners.iter().map(|&[x, y]| plane.depth([x, y, 0.0]));
        if depths().all(|depth| depth >= 0.0) {
            self.area
        } else if depths().all(|depth| depth <= 0.0) {
            0.0
        } else {
            self.polygon.under(plane).area().copysign(self.area)
        }
    }
}

impl Bend {
    /// Of the pieces of one cell.
    pub(super) fn of(pieces: &[Under]) -> Self {
        let mut bend = Self::default();
        for piece in pieces {
            match piece.shape {
                Shape::Line([from, to]) => {
                    let normal = [from[1] - to[1], to[0] - from[0], 0.0];
                    let line = Plane {
                        normal,
                        offset: normal[0] * from[0] + normal[1] * from[1],
                    };
                    let polygon = Polygon::between([from[0], to[0]]).under(&line);
                    if polygon.count > 0 {
                        let area = piece.sign * polygon.area();
                        bend.slices.push(Slice { polygon, area });
                    }
                }
                Shape::Triangle(top) => bend.prisms.push(Prism::under_triangle(top, piece.sign)),
            }
        }
        bend
    }

    /// Volume of it under a plane.
    pub(super) fn under(&self, plane: &Plane) -> f64 {
        let areas: f64 = self.slices.iter().map(|slice| slice.under(plane)).sum();
        let volumes: f64 = self.prisms.iter().map(|prism| prism.under(plane)).sum();
        areas + volumes
    }
}

/// What lies between a triangle and the floor of its cell.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Prism {
    top: [[f64; 3]; 3],
    /// With its sign.
    volume: f64,
}

impl Prism {
    fn under_triangle(top: [[f64; 3]; 3], sign: f64) -> Self {
        let mut prism = Self { top, volume: 1.0 };
        let parts = prism.tetrahedra().map(|part| volume_under(&part, &[]));
        prism.volume = sign * parts.iter().sum::<f64>();
        prism
    }

    fn tetrahedra(&self) -> [[[f64; 3]; 4]; 3] {
        let [a, b, c] = self.top.map(|[x, y, _]| [x, y, 0.0]);
        let [d, e, f] = self.top;
        [[a, b, c, d], [b, c, d, e], [c, d, e, f]]
    }

    /// The volume under a plane, with its sign.
    fn under(&self, plane: &Plane) -> f64 {
        let ends = self.top.map(|corner| {
            let [x, y, _] = corner;
            [plane.depth(corner), plane.depth([x, y, 0.0])]
        });
        if ends.iter().flatten().all(|depth| *depth >= 0.0) {
            return self.volume;
        }
        if ends.iter().flatten().all(|depth| *depth <= 0.0) {
            return 0.0;
        }
        let parts = self.tetrahedra();
        let sum: f64 = parts.iter().map(|part| volume_under(part, &[plane])).sum();
        sum.copysign(self.volume)
    }
}

fn common_volume_in_space(one: &Plane, other: &Plane) -> f64 {
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
    use crate::terrain::{GridLines, Profile, Relief, Surface};

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

    /// Pieces of ground in a cell add up to what cut cells say, under a roof as well, and a plane that cuts all of them
    /// off takes the part that integration says.
    #[test]
    fn pieces_of_ground_add_up() {
        let lines = GridLines {
            origin: [0.0; 2],
            spacing: [1.0, 0.5],
            cells: [4, 6],
        };
        // A valley, then a nose that hangs over.
        let points = vec![
            [-1.0, 2.0],
            [0.7, 0.3],
            [1.6, 1.2],
            [2.9, 2.6],
            [2.3, 0.9],
            [2.3, 0.8],
            [5.0, 0.6],
        ];
        let profile = Profile::new(points).unwrap();
        let cut = profile.cut(&lines).unwrap();
        let pieces = profile.bends(&lines);
        let mut bent = 0;
        let all = Plane::of_fraction([0.0, 1.0, 0.0], 1.0);
        for pieces in pieces.chunk_by(|a, b| a.cell == b.cell) {
            let index = [pieces[0].cell % 4, pieces[0].cell / 4];
            let solid = 1.0 - cut.volume_fraction(index);
            let found = Bend::of(pieces).under(&all);
            assert!((found - solid).abs() < 1e-14, "{index:?} {found} {solid}");
            bent += 1;
        }
        assert!(bent >= 4, "{bent}");
        // A wedge of two triangles in space, 0.6 high over the middle of x: under z = 0.3 there is ∫ min(h, 0.3).
        let at = |x: f64, y: f64, z: f64| [x, y, z];
        let ground = Surface::new(
            vec![
                at(0.0, 0.0, 0.0),
                at(0.5, 0.0, 0.6),
                at(1.0, 0.0, 0.0),
                at(0.0, 1.0, 0.0),
                at(0.5, 1.0, 0.6),
                at(1.0, 1.0, 0.0),
            ],
            vec![[0, 1, 4], [0, 4, 3], [1, 2, 5], [1, 5, 4]],
        )
        .unwrap();
        let lines = GridLines {
            origin: [0.0; 3],
            spacing: [1.0; 3],
            cells: [1; 3],
        };
        let bend = Bend::of(&ground.bends(&lines));
        assert!(ground.bends(&lines).iter().all(|piece| piece.sign == 1.0));
        let level = |z| Plane::of_fraction([0.0, 0.0, 1.0], z);
        for (plane, exact) in [(level(1.0), 0.3), (level(0.3), 0.225), (level(0.6), 0.3)] {
            assert!((bend.under(&plane) - exact).abs() < 1e-15);
        }
    }

    /// In space the same of terrain with a fold that hangs over, in cells that are no cubes.
    #[test]
    fn pieces_of_ground_add_up_under_a_fold() {
        // Along x down, back under itself and on.
        let section = [[-1.0, 1.3], [2.1, 1.7], [1.3, 0.9], [1.2, 0.7], [5.0, 0.4]];
        let at = |n: usize, y: f64| [section[n][0] + 0.1 * y, y, section[n][1] - 0.05 * y];
        let (mut vertices, mut triangles) = (Vec::new(), Vec::new());
        for n in 0..section.len() {
            vertices.extend([at(n, -1.0), at(n, 5.0)]);
        }
        for n in (0..2 * section.len() - 2).step_by(2) {
            triangles.extend([[n, n + 2, n + 3], [n, n + 3, n + 1]]);
        }
        let ground = Surface::new(vertices, triangles).unwrap();
        let lines = GridLines {
            origin: [0.0; 3],
            spacing: [1.0, 0.5, 0.8],
            cells: [3, 4, 3],
        };
        let cut = ground.cut(&lines, false).unwrap();
        let pieces = ground.bends(&lines);
        assert!(pieces.iter().any(|piece| piece.sign < 0.0));
        let all = Plane::of_fraction([0.0, 0.0, 1.0], 1.0);
        let mut bent = 0;
        for pieces in pieces.chunk_by(|a, b| a.cell == b.cell) {
            let cell = pieces[0].cell;
            let index = [cell % 3, cell / 3 % 4, cell / 12];
            let solid = 1.0 - cut.volume_fraction(index);
            let found = Bend::of(pieces).under(&all);
            assert!((found - solid).abs() < 1e-13, "{index:?} {found} {solid}");
            bent += 1;
        }
        assert!(bent >= 8, "{bent}");
    }
}
