//! The ground under a collapse, from the scene's points or its file.

use crate::failure::Failure;
use crate::scene::{CollapseScene, ContactKind, GroundSource};
use crate::{height_files, mesh_files};
use colluvium_continuum::column_collapse::CollapseGround;
use colluvium_continuum::free_surface::Contact;
use colluvium_continuum::terrain::{Profile, Surface};
use colluvium_continuum::wall_friction::WallFriction;
use std::path::Path;

/// The ground that a scene describes, if it has any; `origin` names the scene in messages.
pub fn ground(scene: &CollapseScene, origin: &str) -> Result<Option<CollapseGround>, Failure> {
    let Some(keys) = &scene.terrain else {
        return Ok(None);
    };
    let refused = |error: String| Failure::Input(format!("{origin}: {error}"));
    let profile = profile(keys.source()).map_err(refused)?;
    Ok(Some(CollapseGround {
        profile,
        contact: contact(keys.contact, keys.friction),
    }))
}

/// What holds on ground, a floor or a wall.
pub(super) fn contact(kind: ContactKind, friction: Option<f64>) -> Contact {
    match kind {
        ContactKind::NoSlip => Contact::NoSlip,
        ContactKind::FreeSlip => Contact::FreeSlip,
        ContactKind::Coulomb => Contact::Coulomb(WallFriction {
            friction: friction.unwrap_or(0.0),
            cohesion: 0.0,
        }),
    }
}

/// Contact in the words of a plan.
pub fn words_of(contact: Contact) -> String {
    match contact {
        Contact::NoSlip => "material at it stands still".to_owned(),
        Contact::FreeSlip => "material slides on it freely".to_owned(),
        Contact::Coulomb(friction) => format!(
            "material slides on it under friction coefficient {}",
            friction.friction
        ),
    }
}

/// The surface of ground in a mesh file, whose unit is so many metres.
pub(super) fn surface_of_mesh(path: &Path, unit: f64) -> Result<Surface, String> {
    let surface = mesh_files::read_surface(path).map_err(|error| error.to_string())?;
    let vertices = surface
        .vertices
        .iter()
        .map(|v| [v.x * unit, v.y * unit, v.z * unit]);
    let triangles = surface
        .triangles
        .iter()
        .map(|t| t.map(|corner| corner as usize));
    Surface::new(vertices.collect(), triangles.collect()).map_err(|error| error.to_string())
}

/// The line of the ground, x = 0 where a scene says that it starts.
pub(super) fn profile(source: GroundSource) -> Result<Profile, String> {
    let said = |error: colluvium_continuum::Error| error.to_string();
    if let Some(points) = source.profile {
        return Profile::new(points.to_vec()).map_err(said);
    }
    let [x, y] = source.start.unwrap_or_default();
    let Some((key, file)) = source.file() else {
        return Err("key `terrain.profile` is missing".into());
    };
    let path = Path::new(file);
    let in_file = |error: String| format!("key `terrain.{key}`: {error}");
    let line = if key == "heights" {
        let raster = height_files::read(path).map_err(|error| in_file(error.to_string()))?;
        let last = raster.origin[1] + raster.spacing[1] * (raster.points[1] - 1) as f64;
        if !(raster.origin[1]..=last).contains(&y) {
            return Err(format!(
                "key `terrain.start` has y = {y} m; {file} has heights from {} to {last} m",
                raster.origin[1]
            ));
        }
        raster.profile(y)
    } else {
        let surface = surface_of_mesh(path, source.unit.unwrap_or(1.0)).map_err(in_file)?;
        surface.profile(y)
    }
    .map_err(|error| in_file(format!("{file}: {error}")))?;
    let points = line.points().iter().map(|[px, z]| [px - x, *z]);
    Profile::new(points.collect()).map_err(said)
}
