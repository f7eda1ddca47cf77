//! Cleaning a mesh: vertices that coincide become one, triangles without area and repeated ones go.

use super::MeshError;
use nalgebra::Vector3;
use rstar::RTree;
use rstar::primitives::GeomWithData;
use std::collections::{BTreeMap, BTreeSet};

/// Vertices closer than this times the mesh's size are one.
const WELD: f64 = 1e-10;

/// A triangle whose height is below this times its longest side has no area.
const FLAT: f64 = 1e-10;

/// What was found in a mesh.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct MeshReport {
    /// Vertices that were merged into others.
    pub welded_vertices: usize,
    /// Triangles that had no area or were there before.
    pub dropped_triangles: usize,
    /// Edges of one triangle only: where the surface ends.
    pub open_edges: usize,
    /// Edges of more than two triangles.
    pub branching_edges: usize,
}

/// Vertices and triangles without doubles.
pub(super) struct Clean {
    pub vertices: Vec<Vector3<f64>>,
    pub triangles: Vec<[u32; 3]>,
    pub report: MeshReport,
}

type Point = GeomWithData<[f64; 3], u32>;

/// For each vertex, the first one at its place.
fn first_at_place(vertices: &[Vector3<f64>], tolerance: f64) -> Vec<u32> {
    let points = vertices.iter().zip(0..);
    let points = points.map(|(v, k)| Point::new((*v).into(), k)).collect();
    let tree = RTree::bulk_load(points);
    let mut first: Vec<u32> = (0..vertices.len() as u32).collect();
    for (k, v) in vertices.iter().enumerate() {
        if first[k] as usize != k {
            continue;
        }
        for other in tree.locate_within_distance((*v).into(), tolerance * tolerance) {
            let at = &mut first[other.data as usize];
            if other.data as usize > k && *at == other.data {
                *at = k as u32;
            }
        }
    }
    first
}

fn has_area([a, b, c]: [&Vector3<f64>; 3]) -> bool {
    let sides = [(b - a).norm(), (c - b).norm(), (a - c).norm()];
    let longest = sides.iter().fold(0.0_f64, |x, y| x.max(*y));
    (b - a).cross(&(c - a)).norm() > FLAT * longest * longest
}

/// Checks and cleans a mesh.
pub(super) fn clean(
    vertices: Vec<Vector3<f64>>,
    triangles: &[[u32; 3]],
) -> Result<Clean, MeshError> {
    // A larger number could not be squared.
    let usable = |v: &Vector3<f64>| v.iter().all(|c| c.abs() < 1e100);
    if let Some(vertex) = vertices.iter().position(|v| !usable(v)) {
        return Err(MeshError::NotFinite { vertex });
    }
    let known = |t: &[u32; 3]| t.iter().all(|&v| (v as usize) < vertices.len());
    if let Some(triangle) = triangles.iter().position(|t| !known(t)) {
        return Err(MeshError::Index {
            triangle,
            vertices: vertices.len(),
        });
    }
    let low = vertices
        .iter()
        .fold(Vector3::repeat(f64::MAX), |a, v| a.inf(v));
    let high = vertices
        .iter()
        .fold(Vector3::repeat(f64::MIN), |a, v| a.sup(v));
    let first = first_at_place(&vertices, WELD * (high - low).norm());
    let mut report = MeshReport::default();
    let mut number = vec![0; vertices.len()];
    let mut kept = Vec::new();
    for (k, v) in vertices.iter().enumerate() {
        if first[k] as usize == k {
            number[k] = kept.len() as u32;
            kept.push(*v);
        } else {
            number[k] = number[first[k] as usize];
            report.welded_vertices += 1;
        }
    }
    let (mut seen, mut left) = (BTreeSet::new(), Vec::new());
    for triangle in triangles {
        let triangle = triangle.map(|v| number[v as usize]);
        let mut sorted = triangle;
        sorted.sort_unstable();
        if has_area(triangle.map(|v| &kept[v as usize])) && seen.insert(sorted) {
            left.push(triangle);
        } else {
            report.dropped_triangles += 1;
        }
    }
    if left.is_empty() {
        return Err(MeshError::Empty {
            dropped: report.dropped_triangles,
        });
    }
    count_edges(&left, &mut report);
    Ok(Clean {
        vertices: kept,
        triangles: left,
        report,
    })
}

fn count_edges(triangles: &[[u32; 3]], report: &mut MeshReport) {
    let mut edges: BTreeMap<[u32; 2], u32> = BTreeMap::new();
    for &[a, b, c] in triangles {
        for [from, to] in [[a, b], [b, c], [c, a]] {
            *edges.entry([from.min(to), from.max(to)]).or_default() += 1;
        }
    }
    report.open_edges = edges.values().filter(|&&n| n == 1).count();
    report.branching_edges = edges.values().filter(|&&n| n > 2).count();
}
