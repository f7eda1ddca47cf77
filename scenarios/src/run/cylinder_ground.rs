//! The ground under a cylinder, from the scene's heights or its file.

use super::collapse_ground::{contact, surface_of_mesh};
use super::cylinder::case;
use crate::failure::Failure;
use crate::height_files;
use crate::scene::{CylinderScene, ReliefKeys};
use colluvium_continuum::cylinder_collapse::CylinderGround;
use colluvium_continuum::terrain::Surface;
use std::path::Path;

/// The ground that a scene describes, if it has any; `origin` names the scene in messages.
pub fn ground(scene: &CylinderScene, origin: &str) -> Result<Option<CylinderGround>, Failure> {
    let Some(keys) = &scene.terrain else {
        return Ok(None);
    };
    let surface =
        surface(scene, keys).map_err(|error| Failure::Input(format!("{origin}: {error}")))?;
    Ok(Some(CylinderGround {
        surface,
        contact: contact(keys.contact, keys.friction),
    }))
}

fn surface(scene: &CylinderScene, keys: &ReliefKeys) -> Result<Surface, String> {
    let said = |error: colluvium_continuum::Error| error.to_string();
    let length = scene.grid.length_scaled * scene.height;
    let Some((key, file)) = keys.file() else {
        let size = length / case(scene).cells as f64;
        return keys
            .sum()
            .surface([-length; 2], [length; 2], size)
            .map_err(said);
    };
    let in_file = |error: String| format!("key `terrain.{key}`: {file}: {error}");
    let path = Path::new(file);
    let found = if key == "heights" {
        let raster = height_files::read(path).map_err(|e| format!("key `terrain.{key}`: {e}"))?;
        raster.surface().map_err(said).map_err(in_file)?
    } else {
        surface_of_mesh(path, keys.unit.unwrap_or(1.0)).map_err(in_file)?
    };
    let [x, y] = keys.start.unwrap_or_default();
    let moved = found.seen_from([x, y, 0.0], 1.0).map_err(said)?;
    for corner in [[-1.0, -1.0], [1.0, -1.0], [-1.0, 1.0], [1.0, 1.0]] {
        if moved
            .height_at(corner.map(|c: f64| c * length * (1.0 - 1e-9)))
            .is_none()
        {
            let at = [x + corner[0] * length, y + corner[1] * length];
            return Err(in_file(format!(
                "no ground at {at:?} m in the file; the grid reaches {length} m from terrain.start = {:?} to all sides",
                [x, y]
            )));
        }
    }
    Ok(moved)
}
