//! What a closed mesh encloses.

use super::{Mesh, Triangle};
use nalgebra::Vector3;
use std::f64::consts::TAU;

impl Mesh {
    /// Whether every edge has two triangles, so that the mesh encloses something.
    pub fn is_closed(&self) -> bool {
        self.report.open_edges == 0 && self.report.branching_edges == 0
    }

    /// How often the surface goes round a point: ±1 inside of a closed one, 0 outside.
    ///
    /// ```text
    /// w = 1/4π Σ Ω,   tan(Ω/2) = a·(b × c) / (|a||b||c| + (a·b)|c| + (b·c)|a| + (c·a)|b|)
    /// ```
    /// Ω is the solid angle of a triangle with corners a, b, c seen from the point (van Oosterom & Strackee,
    /// IEEE Trans. Biomed. Eng. 30 (1983) 125). A term for each triangle.
    pub fn winding(&self, x: &Vector3<f64>) -> f64 {
        let angle = |triangle: &Triangle| {
            let [a, b, c] = triangle.corners.map(|corner| corner - x);
            let [la, lb, lc] = [a.norm(), b.norm(), c.norm()];
            let volume = a.dot(&b.cross(&c));
            let scale = la * lb * lc + a.dot(&b) * lc + b.dot(&c) * la + c.dot(&a) * lb;
            volume.atan2(scale)
        };
        self.triangles.iter().map(angle).sum::<f64>() / TAU
    }

    /// How deep a point lies inside of a closed mesh (m), whichever way its triangles are turned; negative outside.
    pub fn depth(&self, x: &Vector3<f64>) -> f64 {
        let distance = self.foot(x).distance;
        let [low, high] = &self.bounds;
        let beyond = (0..3).any(|k| x[k] < low[k] || x[k] > high[k]);
        if !beyond && self.winding(x).abs() > 0.5 {
            distance
        } else {
            -distance
        }
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;

    /// A prism over an L, so that it is not convex.
    fn angle_iron(turned: bool) -> Mesh {
        let outline = [
            [0.0, 0.0],
            [2.0, 0.0],
            [2.0, 1.0],
            [1.0, 1.0],
            [1.0, 2.0],
            [0.0, 2.0],
        ];
        let at = |z: f64| outline.map(|[x, y]| Vector3::new(x, y, z));
        let vertices = [at(0.0), at(1.0)].concat();
        let lid = [[0, 1, 2], [0, 2, 3], [0, 3, 4], [0, 4, 5]];
        let mut triangles: Vec<[u32; 3]> = lid.map(|[a, b, c]| [a, c, b]).to_vec();
        triangles.extend(lid.map(|t| t.map(|v: u32| v + 6)));
        for k in 0..6 {
            let next = (k + 1) % 6;
            triangles.extend([[k, next, next + 6], [k, next + 6, k + 6]]);
        }
        if turned {
            triangles.iter_mut().for_each(|t| t.swap(1, 2));
        }
        Mesh::new(vertices, &triangles).unwrap()
    }

    #[test]
    fn a_mesh_holds_what_it_encloses_whichever_way_it_is_turned() {
        for turned in [false, true] {
            let mesh = angle_iron(turned);
            assert!(mesh.is_closed());
            for (x, depth) in [
                ([0.5, 0.5, 0.5], 0.5),
                ([1.9, 0.5, 0.5], 0.1),
                ([0.4, 1.7, 0.5], 0.3),
                // In the notch, and beyond.
                ([1.2, 1.5, 0.5], -0.2),
                ([0.5, 0.5, 1.4], -0.4),
                ([-0.3, 0.5, 0.5], -0.3),
            ] {
                let found = mesh.depth(&x.into());
                assert!((found - depth).abs() < 1e-12, "{x:?}: {found}");
                let winding = mesh.winding(&x.into()).abs();
                let wanted = if depth > 0.0 { 1.0 } else { 0.0 };
                assert!((winding - wanted).abs() < 1e-12, "{x:?}: {winding}");
            }
        }
    }

    #[test]
    fn half_a_mesh_encloses_nothing_whole() {
        let mesh = angle_iron(false);
        let open = Mesh::new(mesh.vertices().to_vec(), &mesh.corners()[..12]).unwrap();
        assert!(!open.is_closed());
        let winding = open.winding(&Vector3::repeat(0.5));
        assert!(winding > 0.1 && winding < 0.95, "{winding}");
    }
}
