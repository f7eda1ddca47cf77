//! The plan of the collapse of a cylinder.

use super::{Lines, whose_steps};
use crate::run::{self, surface_steps::steps_of};
use crate::scene::CylinderScene;
use colluvium_continuum::cylinder_collapse::CylinderGround;

/// Peak memory for each cell with a pressure (bytes), as measured with a thousand of them.
const MEMORY_PER_CELL: f64 = 2.0e5;

pub(super) fn cylinder(body: &CylinderScene, ground: Option<&CylinderGround>) -> String {
    let mut lines = Lines::default();
    let case = run::cylinder::case(body);
    let units = case.units();
    let spacing = body.grid.length_scaled * body.height / case.cells as f64;
    let filled = body.filled();
    lines.say(
        "scene",
        &format!(
            "cylinder-collapse: a cylinder {} m high, {:.4} m in radius, on a floor ({}), in space; {} of it is computed",
            body.height,
            case.radius(),
            match &body.terrain {
                Some(_) => "terrain".to_owned(),
                None => run::collapse_ground::words_of(case.floor),
            },
            if body.grid.whole { "the whole" } else { "a quarter" }
        ),
    );
    lines.say_rheology(&body.rheology);
    if let Some(ground) = ground {
        let length = body.grid.length_scaled * body.height;
        let [low, high] = ground
            .surface
            .heights_over([-length; 2], [length; 2])
            .unwrap_or_default();
        lines.say(
            "terrain",
            &format!(
                "a surface of {} triangles, {low:.4} to {high:.4} m high; it cuts the cells of the grid; {}; layers thinner than half a cell slide as blocks with the slope",
                ground.surface.triangles().len(),
                run::collapse_ground::words_of(ground.contact)
            ),
        );
    }
    lines.say(
        "grid",
        &format!(
            "{} cubes of {spacing:.4e} m from the axis to the edge; {filled:.0} cells hold material, and they cost most",
            case.cells
        ),
    );
    lines.say("left out", &run::cylinder::LEFT_OUT.join(", "));
    for remark in body.rheology.remarks() {
        lines.say("warning", &remark);
    }
    let largest = body.solver.largest_step_scaled * units.time();
    // Fronts move at about √(g H).
    let step = (body.solver.courant * spacing / units.velocity).min(largest);
    lines.say(
        "time step",
        &format!(
            "about {step:.4e} s while the front moves at √(g H) = {:.3} m/s (courant {}), {largest:.4e} s at rest",
            units.velocity, body.solver.courant
        ),
    );
    let steps = steps_of(body.duration_scaled * units.time(), step);
    lines.say(
        "cost",
        &format!(
            "at most {steps:.0} steps{}, {:.2e} cell-steps, about {:.2} GB",
            whose_steps(body.terrain.is_some()),
            steps * filled,
            filled * MEMORY_PER_CELL / 1e9
        ),
    );
    lines.0
}
