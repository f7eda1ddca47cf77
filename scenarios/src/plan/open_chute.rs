//! The plan of a fed chute.

use super::Lines;
use crate::run::{self, collapse_ground::words_of, surface_steps::steps_of};
use crate::scene::{OpenChuteScene, Scene};
use colluvium_continuum::open_chute::Sides;

/// What a chute's plan says of the speed of what enters.
pub(super) fn open_chute(
    scene: &Scene,
    body: &OpenChuteScene,
) -> Result<String, crate::failure::Failure> {
    let mut lines = Lines::default();
    let surface = run::open_chute::entering_speed(scene, body)?;
    let time = (body.depth / body.gravity).sqrt();
    let spacing = body.depth / body.cells() as f64;
    let length = body.grid.length_scaled * body.depth;
    lines.say(
        "scene",
        &format!(
            "open-chute: a layer {} m deep enters a rough chute {length} m long at {} degrees and leaves it at the lower end",
            body.depth, body.slope_degrees
        ),
    );
    lines.say_rheology(&body.rheology);
    let profile = match (body.inflow.bagnold_factor, body.inflow.speed) {
        (Some(factor), _) => format!("{factor} times the steady profile of that depth"),
        _ => "the same at all heights".to_owned(),
    };
    lines.say(
        "inflow",
        &format!("{surface:.4} m/s at the surface, {profile}"),
    );
    let mut shape = format!("squares of {spacing:.4e} m");
    if let Some(across) = run::open_chute::across(body) {
        let sides = match across.sides {
            Sides::Periodic => "periodic across".to_owned(),
            Sides::Walls(contact) => format!("side walls: {}", words_of(contact)),
        };
        lines.say("in space", &format!("{} m broad; {sides}", across.breadth));
        let part = if across.whole { "all" } else { "half" };
        shape = format!(
            "cells of {spacing:.4e} m along x and z, {} across {part} of the chute",
            across.cells
        );
    }
    lines.say(
        "grid",
        &format!(
            "{shape}, {} across the depth; {:.0} hold material",
            body.cells(),
            body.filled()
        ),
    );
    lines.say("left out", &run::open_chute::left_out(body).join(", "));
    for remark in body.rheology.remarks() {
        lines.say("warning", &remark);
    }
    let largest = body.solver.largest_step_scaled * time;
    let courant = run::open_chute::options(body).courant;
    let step = (courant * spacing / surface).min(largest);
    lines.say(
        "time step",
        &format!("about {step:.4e} s (courant {courant}, at most {largest:.4e} s)"),
    );
    let steps = steps_of(body.duration_scaled * time, step);
    lines.say(
        "cost",
        &format!(
            "about {steps:.0} steps, {:.2e} cell-steps",
            steps * body.filled()
        ),
    );
    Ok(lines.0)
}
