//! Wavefront OBJ, through `tobj`.

use super::{Surface, triangle_lines, vertex_lines};
use tobj::LoadOptions;

pub(super) fn read(mut bytes: &[u8]) -> Result<Surface, String> {
    let options = LoadOptions {
        triangulate: true,
        ignore_points: true,
        ignore_lines: true,
        ..LoadOptions::default()
    };
    let nothing = |_: &std::path::Path| Ok(Default::default());
    let loaded = tobj::load_obj_buf(&mut bytes, &options, nothing);
    let (models, _) = loaded.map_err(|e| format!("OBJ: {e}"))?;
    let mut surface = Surface::default();
    for model in models {
        let first = surface.vertices.len();
        for &xyz in model.mesh.positions.as_chunks::<3>().0 {
            surface.add_vertex(xyz);
        }
        for triangle in model.mesh.indices.as_chunks::<3>().0 {
            let known = |&v: &u32| u32::try_from(first + v as usize).ok();
            let corners: Option<Vec<u32>> = triangle.iter().map(known).collect();
            let corners = corners.ok_or("OBJ: more than 2³² vertices")?;
            surface.add_polygon(&corners);
        }
    }
    Ok(surface)
}

pub(super) fn write(surface: &Surface) -> Vec<u8> {
    let text = vertex_lines(surface, "v ") + &triangle_lines(surface, "f ", 1);
    text.into_bytes()
}
