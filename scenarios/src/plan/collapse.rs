//! The plan of a collapse.

use super::{Lines, whose_steps};
use crate::run::{self, surface_steps::steps_of};
use crate::scene::CollapseScene;
use colluvium_continuum::column_collapse::CollapseGround;

/// The plan, with the ground that the scene describes if it has any.
pub(super) fn collapse(body: &CollapseScene, ground: Option<&CollapseGround>) -> String {
    let mut lines = Lines::default();
    // Of the law only the density counts here.
    let case = run::collapse::case(body, body.rheology.mu_i());
    let units = case.units();
    let spacing = body.grid.length_scaled * body.height / case.cells as f64;
    let mut column = body.section(body.height) / (spacing * spacing);
    lines.say(
        "scene",
        &format!(
            "column-collapse: a column {} m high and {:.4} m wide, its face leaning out by {} degrees, beside a plane of symmetry, \
             on {}",
            body.height,
            case.width(),
            body.overhang_degrees,
            if ground.is_some() { "terrain" } else { "a rough floor" }
        ),
    );
    lines.say_rheology(&body.rheology);
    if let Some(ground) = ground {
        let length = body.grid.length_scaled * body.height;
        let [low, high] = ground.span(length);
        let contact = run::collapse_ground::words_of(ground.contact);
        lines.say(
            "terrain",
            &format!(
                "a line of {} points, {low:.4} to {high:.4} m high; it cuts the cells of the grid; {contact}; layers thinner than half a cell slide as blocks with the slope",
                ground.profile.points().len()
            ),
        );
    }
    if let (Some(walls), None) = (&body.side_walls, body.channel()) {
        lines.say(
            "side walls",
            &format!(
                "{} m apart, each with friction coefficient {}: 2 mu p/W against the velocity in the plane",
                walls.width, walls.friction
            ),
        );
    }
    let mut cells = format!("{} square cells of {spacing:.4e} m along x", case.cells);
    let mut courant = body.solver.courant;
    if let Some(case) = run::channel::case(body) {
        courant = run::channel::options(&body.solver).courant;
        let words = run::collapse_ground::words_of;
        lines.say(
            "side walls",
            &format!(
                "{} m apart, in space: {}; floor: {}",
                case.width,
                words(case.walls),
                words(case.floor)
            ),
        );
        column *= case.cells_across as f64;
        cells = format!(
            "{} cells of {spacing:.4e} m along x and z, {} across {}",
            case.column.cells,
            case.cells_across,
            if case.whole {
                "the channel"
            } else {
                "half of the channel"
            }
        );
    }
    lines.say(
        "grid",
        &format!("{cells}; {column:.0} hold material, and only they cost"),
    );
    lines.say("left out", &run::collapse::LEFT_OUT.join(", "));
    for remark in body.rheology.remarks() {
        lines.say("warning", &remark);
    }
    let largest = body.solver.largest_step_scaled * units.time();
    // Fronts move at about √(g H) and at most twice that.
    let step = (courant * spacing / units.velocity).min(largest);
    lines.say(
        "time step",
        &format!(
            "about {step:.4e} s while the front moves at √(g H) = {:.3} m/s (courant {courant}), {largest:.4e} s at rest",
            units.velocity
        ),
    );
    let steps = steps_of(body.duration_scaled * units.time(), step);
    lines.say(
        "cost",
        &format!(
            "at most {steps:.0} steps{}, {:.2e} cell-steps",
            whose_steps(body.terrain.is_some()),
            steps * column
        ),
    );
    lines.0
}
