//! Which published material a scene stands for.

use crate::scene::{Scene, bundled};

/// The row of the thesis' Table 2.6 that a scene can be compared with: by its kind, and only as
/// long as contact law and grain sizes are those of the bundled scene.
pub fn published_material(scene: &Scene) -> Option<&'static str> {
    let material = match scene.name.as_str() {
        "incline-moderate" => "moderate",
        "incline-gravel" => "gravel",
        _ => return None,
    };
    is_bundled_material(scene).then_some(material)
}

/// Whether contact law and grain sizes are those of the bundled scene of the same kind.
fn is_bundled_material(scene: &Scene) -> bool {
    let Ok(own) = Scene::load(&scene.name, &[]) else {
        return false;
    };
    let sizes = |scene: &Scene| {
        let mut grains = scene.resolved.get("grains")?.as_table()?.clone();
        // Depth of the bed and density do not change the law.
        grains.remove("count");
        grains.remove("density");
        Some(grains)
    };
    bundled(&scene.name).is_some()
        && scene.resolved.get("contact") == own.resolved.get("contact")
        && sizes(scene) == sizes(&own)
}
