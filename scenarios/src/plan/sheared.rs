//! The plan of a flow between plates or walls.

use super::Lines;
use crate::failure::Failure;
use crate::run;
use crate::scene::ShearedScene;

/// The plan as text.
pub fn sheared(scene: &ShearedScene) -> Result<String, Failure> {
    let mut lines = Lines::default();
    let exact = scene.exact().map_err(run::steady_layer::failure)?;
    let what = match scene {
        ShearedScene::PlaneShear(keys) => format!(
            "material between plates {} m apart, one of which moves with {} m/s under {} Pa",
            keys.gap, keys.wall_velocity, keys.load
        ),
        ShearedScene::VerticalChute(keys) => format!(
            "material that falls between walls {} m from the middle, which press with {} Pa",
            keys.half_width, keys.load
        ),
    };
    let from_rest = "from rest to steady flow";
    lines.say("scene", &format!("{}: {what}, {from_rest}", scene.name()));
    lines.say_rheology(scene.rheology());
    lines.say_layer_grid(scene.cells(), scene.grid().columns());
    lines.say("left out", &run::sheared::LEFT_OUT.join(", "));
    if exact.velocity == 0.0 {
        lines.say("flow", "none: friction and cohesion carry the weight");
    } else {
        let posed = if exact.well_posed {
            "well posed there"
        } else {
            "ill posed there in 2D and 3D"
        };
        lines.say(
            "flow",
            &format!(
                "I = {:.4} at the wall, {posed}; fastest {:.4} m/s, {:.4e} Pa on the wall (exact)",
                exact.wall_inertial_number, exact.velocity, exact.wall_stress
            ),
        );
        if exact.plug > 0.0 {
            lines.say(
                "plug",
                &format!("rigid to {:.4e} m from the middle", exact.plug),
            );
        }
        if let Some(remark) = run::sheared::validity_remark(scene, &exact) {
            lines.say("warning", &remark);
        }
    }
    for remark in scene.rheology().remarks() {
        lines.say("warning", &remark);
    }
    lines.say_march(scene.solver(), scene.natural_time());
    Ok(lines.0)
}
