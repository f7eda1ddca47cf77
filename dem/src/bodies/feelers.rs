//! Feelers: where one side of a contact of bodies asks how far the other side is.
//!
//! A feeler is a ball on the core of a shape; rolled over corners, edges and rims, balls of one radius make
//! up the rounded outline. Two convex solids touch by a corner of one on the other's surface or by edges
//! that cross. Corners are single feelers. Edges are rows of them at most one radius apart, so that a crossing
//! edge sinks by at most 13 % of the radius deeper between two of them (1 - √3/2, where the other side is
//! sharp; less where it is round); the potential has ripples of that size, but no step. Sides of round
//! solids carry rows along their generators, apart by √(R r): an eighth of the radius in depth.
//!
//! Surface nodes against a distance function are how level-set DEM meets grains of any shape (Kawamoto et
//! al. 2016, doi 10.1016/j.jmps.2016.02.021).
//!
//! On a plane only corners matter, and of a rim four points: the lowest one and those a quarter turn from
//! it. The lowest point makes a cylinder roll without ripples; the four keep it upright on its end, where
//! a single lowest point would rock. Their depths are symmetric about the lowest point, so their forces are the
//! gradient of their potential although they move along the rim.

use super::{Part, Solid};
use crate::setup::{SetupError, check};
use crate::walls::{Mesh, Shape, Side};
use nalgebra::Vector3;
use rstar::{AABB, PointDistance, RTree, RTreeObject};
use std::collections::BTreeMap;
use std::f64::consts::TAU;

/// Which feelers a surface needs.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Kind {
    /// Corners: enough for planes, which also meet rims by their lowest points.
    Corner,
    /// Points of rims: with corners, enough for surfaces that curve inwards.
    Rim,
    /// Points of edges and sides.
    Ridge,
}

/// A feeler in its shape's own coordinates.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Feeler {
    pub at: Vector3<f64>,
    pub radius: f64,
}

/// A rim in its shape's own coordinates, felt by a ball.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Rim {
    pub centre: Vector3<f64>,
    pub axis: Vector3<f64>,
    pub radius: f64,
    pub ball: f64,
}

/// All feelers of a shape.
#[derive(Clone, Debug, Default)]
pub(super) struct Feelers {
    /// Corners, then rims, then ridges.
    pub points: Vec<Feeler>,
    /// Where rims and ridges begin.
    ends: [usize; 2],
    pub rims: Vec<Rim>,
    /// A ball that holds all of them with their radii.
    pub middle: Vector3<f64>,
    pub reach: f64,
    tree: Option<RTree<Leaf>>,
}

/// A point in the tree.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Leaf {
    number: u32,
    at: [f64; 3],
}

impl RTreeObject for Leaf {
    type Envelope = AABB<[f64; 3]>;

    fn envelope(&self) -> Self::Envelope {
        AABB::from_point(self.at)
    }
}

impl PointDistance for Leaf {
    fn distance_2(&self, point: &[f64; 3]) -> f64 {
        let pairs = self.at.iter().zip(point);
        pairs.map(|(a, b)| (a - b) * (a - b)).sum()
    }
}

/// Feelers in the making.
#[derive(Default)]
struct Growing {
    corners: Vec<Vector3<f64>>,
    rim_points: Vec<Vector3<f64>>,
    ridges: Vec<Vector3<f64>>,
    rims: Vec<Rim>,
}

/// Pieces of a length no longer than a spacing.
fn pieces(length: f64, spacing: f64) -> u32 {
    (length / spacing).ceil().clamp(1.0, MOST) as u32
}

/// Feelers of a scene at most.
const MOST: f64 = 1e6;

/// Points of a rim at least.
const ROUND: u32 = 8;

/// Edges bent by less than this cosine (2.6°) are flat.
const FLAT: f64 = 0.999;

impl Growing {
    /// The inner points of an edge.
    fn edge(&mut self, [a, b]: [Vector3<f64>; 2], spacing: f64) {
        let pieces = pieces((b - a).norm(), spacing);
        let inner = (1..pieces).map(|k| a + (b - a) * (f64::from(k) / f64::from(pieces)));
        self.ridges.extend(inner);
    }

    fn rim(&mut self, rim: Rim, spacing: f64) {
        let count = pieces(TAU * rim.radius, spacing).max(ROUND);
        let points =
            (0..count).map(|k| rim.point(&rim.start(), TAU * f64::from(k) / f64::from(count)));
        self.rim_points.extend(points);
        self.rims.push(rim);
    }

    /// A frustum without lids: its rims and the rows along its side.
    fn side(&mut self, ends: [Rim; 2], ball: f64, spacing: f64) {
        for end in ends {
            if end.radius > 0.0 {
                self.rim(end, spacing);
            } else {
                self.corners.push(end.centre);
            }
        }
        let widest = ends[0].radius.max(ends[1].radius);
        let apart = (widest * ball.max(spacing)).sqrt();
        let rows = pieces(TAU * widest, apart).max(ROUND);
        for k in 0..rows {
            let angle = TAU * f64::from(k) / f64::from(rows);
            self.edge(ends.map(|end| end.point(&ends[0].start(), angle)), spacing);
        }
    }

    fn cuboid(&mut self, half_sides: &Vector3<f64>, spacing: f64) {
        let corner = |k: usize| {
            Vector3::from_fn(|axis, _| {
                half_sides[axis] * if k >> axis & 1 == 1 { 1.0 } else { -1.0 }
            })
        };
        self.corners.extend((0..8).map(corner));
        for axis in 0..3 {
            let ends = (0..8).filter(|k| k >> axis & 1 == 0);
            for k in ends {
                self.edge([corner(k), corner(k | 1 << axis)], spacing);
            }
        }
    }

    /// Corners and edges where a mesh is bent or ends.
    fn mesh(&mut self, mesh: &Mesh, spacing: f64) {
        let mut sides: BTreeMap<[u32; 2], Vec<usize>> = BTreeMap::new();
        for (t, &[a, b, c]) in mesh.corners().iter().enumerate() {
            for [from, to] in [[a, b], [b, c], [c, a]] {
                sides
                    .entry([from.min(to), from.max(to)])
                    .or_default()
                    .push(t);
            }
        }
        let normal = |t: usize| mesh.triangles()[t].normal;
        let mut sharp = vec![false; mesh.vertices().len()];
        let mut edges = Vec::new();
        for (&[a, b], sides) in &sides {
            let flat = sides.len() == 2 && normal(sides[0]).dot(&normal(sides[1])).abs() > FLAT;
            if !flat {
                sharp[a as usize] = true;
                sharp[b as usize] = true;
                edges.push([a, b]);
            }
        }
        // Finely bent surfaces have no sharp edge at all: their corners stay all the same.
        let bent = |t: &usize, first: usize| normal(*t).dot(&normal(first)).abs() < 1.0 - 1e-9;
        for ([a, b], sides) in &sides {
            if sides.iter().any(|t| bent(t, sides[0])) {
                sharp[*a as usize] = true;
                sharp[*b as usize] = true;
            }
        }
        let vertices = mesh.vertices();
        let corners = vertices.iter().zip(&sharp).filter(|(_, sharp)| **sharp);
        self.corners.extend(corners.map(|(v, _)| *v));
        for ends in edges {
            self.edge(ends.map(|v| vertices[v as usize]), spacing);
        }
    }

    fn finish(self, radius: f64) -> Feelers {
        let ends = [
            self.corners.len(),
            self.corners.len() + self.rim_points.len(),
        ];
        let all = [self.corners, self.rim_points, self.ridges].concat();
        let low = all.iter().fold(Vector3::repeat(f64::MAX), |a, v| a.inf(v));
        let high = all.iter().fold(Vector3::repeat(f64::MIN), |a, v| a.sup(v));
        let middle = 0.5 * (low + high);
        let far = all.iter().map(|v| (v - middle).norm());
        // Lowest points of rims lie between their feelers.
        let rims = self.rims.iter();
        let rim = rims.map(|rim| (rim.centre - middle).norm() + rim.radius);
        let leaves = all.iter().zip(0..);
        let leaf = |(at, number): (&Vector3<f64>, u32)| Leaf {
            number,
            at: (*at).into(),
        };
        Feelers {
            reach: radius + far.chain(rim).fold(0.0, f64::max),
            middle,
            ends,
            tree: (all.len() > FEW).then(|| RTree::bulk_load(leaves.map(leaf).collect())),
            points: all.into_iter().map(|at| Feeler { at, radius }).collect(),
            rims: self.rims,
        }
    }
}

/// Up to so many feelers are all looked at.
const FEW: usize = 64;

impl Rim {
    /// Direction from the centre in which points are counted from.
    pub fn start(&self) -> Vector3<f64> {
        crate::walls::any_normal_to(&self.axis)
    }

    /// The point at an angle from a direction (rad).
    pub fn point(&self, start: &Vector3<f64>, angle: f64) -> Vector3<f64> {
        let (s, c) = angle.sin_cos();
        self.centre + (start * c + self.axis.cross(start) * s) * self.radius
    }
}

impl Feelers {
    /// Feelers of a part whose core is given.
    pub fn of_part(part: &Part, core: &Shape) -> Feelers {
        let r = part.rounding;
        let mut growing = Growing::default();
        if let Solid::Sphere { radius } = part.solid {
            growing.corners.push(Vector3::zeros());
            return growing.finish(radius);
        }
        growing.outline(core, r, r);
        growing.finish(r)
    }

    /// Feelers of a wall, by which its corners and edges find bodies; the finest rounding of all bodies
    /// says how far they lie apart (m). Of a ball wall there is one as large as itself.
    pub fn of_wall(shape: &Shape, finest: f64) -> Feelers {
        let mut growing = Growing::default();
        if let Shape::SphereShell(shell) = shape {
            if shell.side != Side::Outside {
                return Feelers::default();
            }
            growing.corners.push(Vector3::zeros());
            return growing.finish(shell.radius);
        }
        growing.outline(shape, 0.0, finest);
        if growing.corners.is_empty() && growing.ridges.is_empty() && growing.rims.is_empty() {
            return Feelers::default();
        }
        growing.finish(0.0)
    }

    /// Corners that hold without rims and ridges.
    pub fn count(&self, kind: Kind) -> usize {
        match kind {
            Kind::Corner => self.ends[0],
            Kind::Rim => self.ends[1],
            Kind::Ridge => self.points.len(),
        }
    }

    /// Numbers of the feelers up to a kind whose centres are within a ball, in order.
    pub fn near(&self, kind: Kind, centre: &Vector3<f64>, reach: f64, found: &mut Vec<u32>) {
        found.clear();
        let count = self.count(kind) as u32;
        let Some(tree) = self
            .tree
            .as_ref()
            .filter(|_| reach.is_finite() && kind == Kind::Ridge)
        else {
            found.extend(0..count);
            return;
        };
        let near = tree.locate_within_distance((*centre).into(), reach * reach);
        found.extend(near.map(|leaf| leaf.number));
        found.sort_unstable();
    }
}

impl Growing {
    fn outline(&mut self, shape: &Shape, ball: f64, spacing: f64) {
        match shape {
            Shape::Plane(_) | Shape::SphereShell(_) => {}
            Shape::Cuboid(cuboid) => self.cuboid(&cuboid.half_sides, spacing),
            Shape::Mesh(mesh) => self.mesh(mesh, spacing),
            Shape::Rectangle(rectangle) => {
                let [u, v] = &rectangle.half_sides;
                let corners = [-u - v, u - v, u + v, v - u];
                self.corners.extend(corners);
                for k in 0..4 {
                    self.edge([corners[k], corners[(k + 1) % 4]], spacing);
                }
            }
            Shape::Disk(disk) => self.rim(
                Rim {
                    centre: Vector3::zeros(),
                    axis: disk.axis,
                    radius: disk.radius,
                    ball,
                },
                spacing,
            ),
            Shape::Cylinder(cylinder) => {
                if cylinder.half_length.is_finite() {
                    let rim = |z: f64| Rim {
                        centre: cylinder.axis * z,
                        axis: cylinder.axis,
                        radius: cylinder.radius,
                        ball,
                    };
                    let ends = [-cylinder.half_length, cylinder.half_length].map(rim);
                    self.side(ends, ball, spacing);
                }
            }
            Shape::Frustum(frustum) => {
                let rim = |(z, radius): (f64, f64)| Rim {
                    centre: frustum.axis * z,
                    axis: frustum.axis,
                    radius,
                    ball,
                };
                let [low, high] = frustum.radii;
                let ends = [(0.0, low), (frustum.height, high)].map(rim);
                self.side(ends, ball, spacing);
            }
        }
    }
}

/// Refuses more feelers than anybody waits for.
pub(super) fn check_count(feelers: &[Feelers]) -> Result<(), SetupError> {
    let count: usize = feelers.iter().map(|f| f.points.len()).sum();
    check(
        "bodies: feelers of all bodies and walls",
        count as f64,
        "below 1e6: give parts a larger rounding, or meshes fewer sharp edges",
        |n| n < MOST,
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bodies::rounded::core;

    fn of(part: &Part) -> Feelers {
        Feelers::of_part(part, &core(part).shape)
    }

    #[test]
    fn feelers_lie_the_rounding_within_the_surface_and_close_together() {
        let h = Vector3::new(0.3, 0.2, 0.1);
        let part = Part::cuboid(h, 1.0).rounded(0.02);
        let feelers = of(&part);
        assert_eq!(feelers.count(Kind::Corner), 8);
        assert_eq!(feelers.count(Kind::Rim), 8);
        let core = core(&part);
        for f in &feelers.points {
            assert_eq!(f.radius, 0.02);
            assert!(core.shape.foot(&f.at).distance.abs() < 1e-15);
            let others = feelers.points.iter().filter(|o| *o != f);
            let nearest = others.map(|o| (o.at - f.at).norm()).fold(1.0, f64::min);
            assert!(nearest < 0.02 + 1e-12);
        }
        let far = feelers.points.iter().map(|f| f.at.norm());
        let far = far.fold(0.0, f64::max) + 0.02;
        assert!((feelers.reach - far).abs() < 1e-15);
    }

    #[test]
    fn flat_parts_of_a_mesh_have_no_feelers() {
        let at = |x: f64, y: f64, z: f64| Vector3::new(x, y, z);
        // Two by one squares in a plane, and a third one standing up at the end.
        let vertices = vec![
            at(0.0, 0.0, 0.0),
            at(1.0, 0.0, 0.0),
            at(2.0, 0.0, 0.0),
            at(0.0, 1.0, 0.0),
            at(1.0, 1.0, 0.0),
            at(2.0, 1.0, 0.0),
            at(2.0, 0.0, 1.0),
            at(2.0, 1.0, 1.0),
        ];
        let squares = [[0, 1, 4, 3], [1, 2, 5, 4], [2, 6, 7, 5]];
        let triangles = squares.map(|[a, b, c, d]| [[a, b, c], [a, c, d]]).concat();
        let mesh = Mesh::new(vertices, &triangles).unwrap();
        let feelers = Feelers::of_wall(&Shape::Mesh(mesh.into()), 0.1);
        // All corners are on the rim; along its edges and the fold nine each.
        assert_eq!(feelers.count(Kind::Corner), 8);
        assert_eq!(feelers.points.len(), 8 + 9 * 9);
    }

    #[test]
    fn near_ones_are_all_that_are_near() {
        let part = Part::cylinder(0.1, 0.4, 1.0).rounded(0.01);
        let feelers = of(&part);
        assert!(feelers.tree.is_some());
        let (centre, reach) = (Vector3::new(0.08, 0.05, 0.3), 0.07);
        let mut found = Vec::new();
        feelers.near(Kind::Ridge, &centre, reach, &mut found);
        let numbered = feelers.points.iter().zip(0..);
        let all = numbered.filter(|(f, _)| (f.at - centre).norm() <= reach);
        let all: Vec<u32> = all.map(|(_, k)| k).collect();
        assert!(!all.is_empty());
        assert_eq!(found, all);
    }
}
