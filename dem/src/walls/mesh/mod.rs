//! Triangle meshes as walls.
//!
//! A mesh is a set of triangles without thickness or direction: it may be open, branch, or cut itself.
//! Vertices that coincide are welded and triangles without area dropped when it is made. Grains are found
//! near triangles through a tree of bounding boxes.

mod inside;
mod touches;
mod triangle;
mod way_out;
mod weld;

use super::shape::Foot;
use nalgebra::Vector3;
use rstar::{AABB, PointDistance, RTree, RTreeObject};
use std::ops::ControlFlow;
pub(crate) use touches::{CONTACTS, Offers};
pub use triangle::Triangle;
pub use weld::MeshReport;

/// What no mesh can be made of.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum MeshError {
    /// A coordinate is not a usable number.
    #[error("vertex {vertex} (from 0): coordinates must be finite and below 1e100 m")]
    NotFinite {
        /// Its number.
        vertex: usize,
    },
    /// A triangle names a vertex that is not there.
    #[error("triangle {triangle} (from 0): names a vertex beyond the last of {vertices}")]
    Index {
        /// Its number.
        triangle: usize,
        /// How many vertices there are.
        vertices: usize,
    },
    /// There is nothing to touch.
    #[error(
        "a mesh must have at least one triangle with an area; {dropped} had none or were repeated"
    )]
    Empty {
        /// Triangles that were dropped.
        dropped: usize,
    },
}

/// A triangle in the tree.
#[derive(Clone, Debug)]
struct Leaf {
    number: u32,
    triangle: Triangle,
}

impl RTreeObject for Leaf {
    type Envelope = AABB<[f64; 3]>;

    fn envelope(&self) -> Self::Envelope {
        let [a, b, c] = &self.triangle.corners;
        AABB::from_corners(a.inf(b).inf(c).into(), a.sup(b).sup(c).into())
    }
}

impl PointDistance for Leaf {
    fn distance_2(&self, point: &[f64; 3]) -> f64 {
        self.triangle.foot(&Vector3::from(*point)).distance.powi(2)
    }
}

/// A surface of triangles.
#[derive(Clone, Debug)]
pub struct Mesh {
    vertices: Vec<Vector3<f64>>,
    corners: Vec<[u32; 3]>,
    triangles: Vec<Triangle>,
    report: MeshReport,
    bounds: [Vector3<f64>; 2],
    tree: RTree<Leaf>,
}

impl PartialEq for Mesh {
    fn eq(&self, other: &Mesh) -> bool {
        self.vertices == other.vertices && self.corners == other.corners
    }
}

impl Mesh {
    /// Makes a mesh of vertices (m) and triangles that name three of them each.
    ///
    /// # Errors
    /// If a vertex is not finite, a triangle names a vertex that is not there, or none has an area.
    pub fn new(vertices: Vec<Vector3<f64>>, triangles: &[[u32; 3]]) -> Result<Mesh, MeshError> {
        let clean = weld::clean(vertices, triangles)?;
        let triangle = |t: &[u32; 3]| Triangle::new(t.map(|v| clean.vertices[v as usize]));
        let triangles: Vec<Triangle> = clean.triangles.iter().map(triangle).collect();
        let corners = || triangles.iter().flat_map(|t| &t.corners);
        let low = corners().fold(Vector3::repeat(f64::MAX), |low, v| low.inf(v));
        let high = corners().fold(Vector3::repeat(f64::MIN), |high, v| high.sup(v));
        let leaves = triangles.iter().zip(0..);
        let leaf = |(triangle, number): (&Triangle, u32)| Leaf {
            number,
            triangle: *triangle,
        };
        Ok(Mesh {
            tree: RTree::bulk_load(leaves.map(leaf).collect()),
            bounds: [low, high],
            vertices: clean.vertices,
            corners: clean.triangles,
            triangles,
            report: clean.report,
        })
    }

    /// Vertices (m), each once.
    pub fn vertices(&self) -> &[Vector3<f64>] {
        &self.vertices
    }

    /// The vertices of each triangle.
    pub fn corners(&self) -> &[[u32; 3]] {
        &self.corners
    }

    /// All triangles.
    pub fn triangles(&self) -> &[Triangle] {
        &self.triangles
    }

    /// What was found when the mesh was made.
    pub fn report(&self) -> &MeshReport {
        &self.report
    }

    /// Lower and upper corner of its box (m).
    pub fn bounds(&self) -> [Vector3<f64>; 2] {
        self.bounds
    }

    /// Foot of a centre on the nearest triangle.
    pub fn foot(&self, centre: &Vector3<f64>) -> Foot {
        let nearest = self.tree.nearest_neighbor(&(*centre).into());
        nearest.map_or(
            Foot {
                distance: f64::INFINITY,
                normal: Vector3::z(),
            },
            |leaf| leaf.triangle.foot(centre),
        )
    }

    /// Distance of the vertex that is farthest from the origin (m).
    pub(crate) fn extent(&self) -> f64 {
        let lengths = self.vertices.iter().map(|v| v.norm());
        lengths.fold(0.0, f64::max)
    }

    /// Distance of a centre from the mesh's box (m).
    pub(crate) fn box_distance(&self, centre: &Vector3<f64>) -> f64 {
        let [low, high] = &self.bounds;
        let beyond = (low - centre).sup(&(centre - high));
        beyond.sup(&Vector3::zeros()).norm()
    }

    /// Shows the triangles nearer than `reach` to a centre.
    pub(crate) fn near(&self, centre: &Vector3<f64>, reach: f64, mut see: impl FnMut(u32)) {
        let around = Vector3::repeat(reach);
        let window = AABB::from_corners((centre - around).into(), (centre + around).into());
        let looked: ControlFlow<()> =
            self.tree
                .locate_in_envelope_intersecting_int(&window, |leaf| {
                    if leaf.triangle.foot(centre).distance < reach {
                        see(leaf.number);
                    }
                    ControlFlow::Continue(())
                });
        debug_assert!(looked.is_continue());
    }

    /// What a triangle offers to a sphere that reaches this far, if it is within reach.
    #[inline(always)]
    pub(crate) fn offer(&self, triangle: u32, centre: &Vector3<f64>, reach: f64) -> Option<Foot> {
        let triangle = &self.triangles[triangle as usize];
        if triangle.height(centre).abs() >= reach {
            return None;
        }
        let foot = triangle.foot(centre);
        (foot.distance < reach).then_some(foot)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn doubles_are_welded_and_triangles_without_area_dropped() {
        let v = |x: f64, y: f64| Vector3::new(x, y, 0.0);
        let vertices = vec![
            v(0.0, 0.0),
            v(1.0, 0.0),
            v(0.0, 1.0),
            v(1.0, 1e-13),
            v(0.0, 1.0),
            v(1.0, 1.0),
            v(0.5, 0.0),
        ];
        let triangles = [[0, 1, 2], [3, 5, 4], [0, 6, 1], [2, 0, 1], [1, 1, 2]];
        let mesh = Mesh::new(vertices, &triangles).unwrap_or_else(|e| panic!("{e}"));
        let report = MeshReport {
            welded_vertices: 2,
            dropped_triangles: 3,
            open_edges: 4,
            branching_edges: 0,
        };
        assert_eq!(mesh.report(), &report);
        assert_eq!(mesh.vertices().len(), 5);
        assert_eq!(mesh.triangles().len(), 2);
    }

    #[test]
    fn what_is_no_mesh_is_refused() {
        let corner = || vec![Vector3::zeros(), Vector3::x(), Vector3::y()];
        let refused = |vertices, triangles: &[[u32; 3]]| Mesh::new(vertices, triangles).err();
        assert_eq!(
            refused(corner(), &[[0, 1, 3]]),
            Some(MeshError::Index {
                triangle: 0,
                vertices: 3
            })
        );
        let mut lost = corner();
        lost[1].y = f64::NAN;
        assert_eq!(
            refused(lost, &[[0, 1, 2]]),
            Some(MeshError::NotFinite { vertex: 1 })
        );
        assert_eq!(
            refused(corner(), &[[0, 1, 1]]),
            Some(MeshError::Empty { dropped: 1 })
        );
        assert_eq!(refused(vec![], &[]), Some(MeshError::Empty { dropped: 0 }));
    }

    #[test]
    fn the_tree_finds_what_a_search_over_all_finds() {
        let mut vertices = Vec::new();
        let mut triangles = Vec::new();
        for k in 0..200_u32 {
            let t = f64::from(k);
            let at = Vector3::new((t * 0.37).sin(), (t * 0.91).cos(), (t * 1.7).sin());
            vertices.extend([
                at,
                at + Vector3::x() * 0.2,
                at + Vector3::new(0.1, 0.2, 0.1),
            ]);
            triangles.push([3 * k, 3 * k + 1, 3 * k + 2]);
        }
        let mesh = Mesh::new(vertices, &triangles).unwrap_or_else(|e| panic!("{e}"));
        let mut met = 0;
        for k in 0..300 {
            let t = f64::from(k);
            let centre = Vector3::new((t * 0.7).cos(), (t * 1.1).sin(), (t * 0.3).cos()) * 1.2;
            let mut near = Vec::new();
            mesh.near(&centre, 0.3, |t| near.push(t));
            near.sort_unstable();
            let feet = mesh.triangles().iter().map(|t| t.foot(&centre).distance);
            let all: Vec<u32> = feet
                .clone()
                .zip(0..)
                .filter(|(d, _)| *d < 0.3)
                .map(|(_, k)| k)
                .collect();
            met += all.len();
            assert_eq!(near, all);
            let nearest = feet.fold(f64::INFINITY, f64::min);
            assert_eq!(mesh.foot(&centre).distance, nearest);
        }
        assert!(met > 100, "{met}");
    }
}
