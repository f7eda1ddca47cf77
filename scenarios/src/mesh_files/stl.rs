//! STL, through `stl_io`; coordinates are single precision.

use super::Surface;
use std::io::Cursor;
use stl_io::{Normal, Triangle, Vertex};

/// Header and count of a binary file, and bytes of a triangle.
const HEADER: usize = 84;
const TRIANGLE: usize = 50;

/// Whether a file is as long as a binary one of as many triangles as it says.
fn is_binary(bytes: &[u8]) -> bool {
    let Some(count) = bytes.get(80..HEADER).and_then(|c| c.try_into().ok()) else {
        return false;
    };
    let triangles = (u32::from_le_bytes(count) as usize).checked_mul(TRIANGLE);
    triangles.is_some_and(|t| t.checked_add(HEADER) == Some(bytes.len()))
}

pub(super) fn read(bytes: &[u8]) -> Result<Surface, String> {
    let mut bytes = bytes.to_vec();
    if is_binary(&bytes) {
        // A binary file whose title begins with `solid` would be taken for ASCII.
        bytes[..5].fill(b' ');
    }
    let mesh = stl_io::read_stl(&mut Cursor::new(bytes)).map_err(|e| format!("STL: {e}"))?;
    let mut surface = Surface::default();
    for v in &mesh.vertices {
        surface.add_vertex([0, 1, 2].map(|k| f64::from(v[k])));
    }
    for face in &mesh.faces {
        let corners = face.vertices.map(u32::try_from);
        let [Ok(a), Ok(b), Ok(c)] = corners else {
            return Err("STL: more than 2³² vertices".into());
        };
        surface.triangles.push([a, b, c]);
    }
    Ok(surface)
}

pub(super) fn write(surface: &Surface) -> Vec<u8> {
    let triangles = surface.triangles.iter().map(|t| {
        let [a, b, c] = t.map(|v| surface.vertices[v as usize]);
        let normal = (b - a).cross(&(c - a)).normalize();
        let single = |v: nalgebra::Vector3<f64>| [v.x as f32, v.y as f32, v.z as f32];
        Triangle {
            normal: Normal::new(single(normal)),
            vertices: [a, b, c].map(|v| Vertex::new(single(v))),
        }
    });
    let triangles: Vec<Triangle> = triangles.collect();
    let mut bytes = Vec::new();
    // Writing to memory does not fail.
    let _written = stl_io::write_stl(&mut bytes, triangles.iter());
    bytes
}
