//! The plan of a silo that runs out as a continuum.

use super::Lines;
use crate::run::{self, collapse_ground::words_of, surface_steps::steps_of};
use crate::scene::{Scene, SiloDischargeScene};

/// Speeds at the outlet over √(g L), by which the plan counts steps.
const OUTLET_SPEED: f64 = 1.7;

pub(super) fn silo_discharge(
    scene: &Scene,
    body: &SiloDischargeScene,
) -> Result<String, crate::failure::Failure> {
    let mut lines = Lines::default();
    let shape = run::silo_discharge::shape(scene, body)?;
    let time = (body.outlet / body.gravity).sqrt();
    lines.say(
        "scene",
        &format!(
            "silo-discharge: a silo {} m wide, filled {} m high, runs out of a slot of {} m ({:.3} grain diameters); {} of it is computed",
            body.width,
            body.height,
            body.outlet,
            body.outlet / body.rheology.diameter,
            if body.grid.whole { "all" } else { "half" }
        ),
    );
    lines.say_rheology(&body.rheology);
    lines.say("walls", &words_of(shape.walls));
    lines.say("floor", &words_of(shape.floor));
    lines.say(
        "grid",
        &format!(
            "squares of {:.4e} m, {} across the outlet; {:.0} hold material at the start",
            shape.spacing(),
            body.cells(),
            shape.filled()
        ),
    );
    lines.say("left out", &run::silo_discharge::LEFT_OUT.join(", "));
    for remark in body.rheology.remarks() {
        lines.say("warning", &remark);
    }
    let largest = body.solver.largest_step_scaled * time;
    let speed = OUTLET_SPEED * (body.gravity * body.outlet).sqrt();
    let courant = body.solver.courant;
    let step = (courant * shape.spacing() / speed).min(largest);
    lines.say(
        "time step",
        &format!("about {step:.4e} s (courant {courant}, at most {largest:.4e} s)"),
    );
    let steps = steps_of(body.duration_scaled * time, step);
    lines.say(
        "cost",
        &format!(
            "about {steps:.0} steps, {:.2e} cell-steps at most",
            steps * shape.filled()
        ),
    );
    Ok(lines.0)
}
