//! Surfaces of bodies as triangles, for pictures and series: sharp shapes, as their makers gave them.

use colluvium_dem::{Body, Part, Pose, Solid};
use nalgebra::Vector3;
use std::f64::consts::TAU;

/// A triangle of space (m).
pub type Facet = [Vector3<f64>; 3];

/// Triangles of all parts of a body, at its pose now; circles and half meridians of balls get so many corners.
pub fn of(body: &Body, pose: &Pose, corners: usize) -> Vec<Facet> {
    let part = |part: &Part| -> Vec<Facet> {
        let place = |v: Vector3<f64>| {
            let own = part.pose.position + part.pose.outward(&v);
            pose.position + pose.outward(&own)
        };
        let facets = solid(&part.solid, corners).into_iter();
        facets.map(|facet| facet.map(place)).collect()
    };
    body.parts.iter().flat_map(part).collect()
}

/// Triangles of a solid in its own coordinates.
fn solid(solid: &Solid, corners: usize) -> Vec<Facet> {
    match solid {
        Solid::Sphere { radius } => {
            let meridian = |k: usize| {
                let angle = 0.5 * TAU * k as f64 / corners as f64;
                [radius * angle.sin(), radius * angle.cos()]
            };
            let points: Vec<[f64; 2]> = (0..=corners).map(meridian).collect();
            turned(&points, corners)
        }
        Solid::Cuboid { half_sides } => cuboid(half_sides),
        Solid::Frustum { radii, height } => {
            let outline = [
                [0.0, 0.0],
                [radii[0], 0.0],
                [radii[1], *height],
                [0.0, *height],
            ];
            turned(&outline, corners)
        }
        Solid::Mesh(mesh) => {
            let vertices = mesh.vertices();
            let corner = |k: u32| vertices[k as usize];
            mesh.corners().iter().map(|t| t.map(corner)).collect()
        }
    }
}

/// The surface that a line of points (distance from the axis, height) sweeps about the axis z.
fn turned(points: &[[f64; 2]], corners: usize) -> Vec<Facet> {
    let at = |[r, z]: [f64; 2], k: usize| {
        let angle = TAU * (k % corners) as f64 / corners as f64;
        Vector3::new(r * angle.cos(), r * angle.sin(), z)
    };
    let mut facets = Vec::new();
    for pair in points.windows(2) {
        for k in 0..corners {
            let [a, b] = [at(pair[0], k), at(pair[0], k + 1)];
            let [c, d] = [at(pair[1], k), at(pair[1], k + 1)];
            facets.push([a, b, c]);
            facets.push([b, d, c]);
        }
    }
    // Those that end on the axis have no area.
    facets.retain(|[a, b, c]| (b - a).cross(&(c - a)) != Vector3::zeros());
    facets
}

fn cuboid(half: &Vector3<f64>) -> Vec<Facet> {
    let mut facets = Vec::with_capacity(12);
    for axis in 0..3 {
        for side in [-1.0, 1.0] {
            let corner = |u: f64, v: f64| {
                let mut signs = Vector3::zeros();
                signs[axis] = side;
                signs[(axis + 1) % 3] = u;
                signs[(axis + 2) % 3] = v;
                signs.component_mul(half)
            };
            let [a, b] = [corner(-1.0, -1.0), corner(1.0, -1.0)];
            let [c, d] = [corner(1.0, 1.0), corner(-1.0, 1.0)];
            facets.push([a, b, c]);
            facets.push([a, c, d]);
        }
    }
    facets
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::PI;

    fn area(facets: &[Facet]) -> f64 {
        let one = |[a, b, c]: &Facet| 0.5 * (b - a).cross(&(c - a)).norm();
        facets.iter().map(one).sum()
    }

    #[test]
    fn areas_are_those_of_the_solids() {
        let half = Vector3::new(1.0, 2.0, 3.0);
        let cuboid = area(&solid(&Solid::Cuboid { half_sides: half }, 48));
        assert!((cuboid - 8.0 * (2.0 + 6.0 + 3.0)).abs() < 1e-12);
        let ball = area(&solid(&Solid::Sphere { radius: 2.0 }, 48));
        assert!((ball / (16.0 * PI) - 1.0).abs() < 5e-3, "{ball}");
        let (radii, height) = ([2.0, 1.0], 3.0);
        let stump = area(&solid(&Solid::Frustum { radii, height }, 48));
        let exact = PI * (5.0 + 3.0 * 10f64.sqrt());
        assert!((stump / exact - 1.0).abs() < 5e-3, "{stump} {exact}");
        let part = Part::cuboid(half, 1.0).at(Vector3::x());
        let body = Body::new(vec![part]);
        let moved = of(&body, &Pose::at(Vector3::new(10.0, 0.0, 0.0)), 48);
        let far = moved.iter().flatten().map(|v| v.x);
        assert_eq!(far.fold(f64::NEG_INFINITY, f64::max), 12.0);
    }
}
