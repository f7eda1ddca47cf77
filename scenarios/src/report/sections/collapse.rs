//! A collapse: profiles through time, and where the front was when.

use super::{HEIGHT, WIDTH, figure};
use crate::report::page::number;
use crate::report::plot::{Band, Mark, Plot};
use crate::table::Table;
use maud::{Markup, html};

/// Profiles drawn, beside the deposit.
const CURVES: usize = 6;

/// Along what profiles go: x, or the distance r from the axis of a cylinder.
fn along(table: &Table) -> &'static str {
    if table.column("r").is_empty() {
        "x"
    } else {
        "r"
    }
}

/// The profiles (t, x, h) as they follow each other in the table, h on top of the ground if there is any.
fn instants(table: &Table) -> Vec<(f64, Vec<(f64, f64)>)> {
    let mut instants: Vec<(f64, Vec<(f64, f64)>)> = Vec::new();
    let ground = table.column("z_ground").iter().copied();
    let rows = table.column("t").iter().zip(table.pairs(along(table), "h"));
    for ((&time, (x, h)), ground) in rows.zip(ground.chain(std::iter::repeat(0.0))) {
        let point = (x, h + ground);
        match instants.last_mut() {
            Some((last, points)) if *last == time => points.push(point),
            _ => instants.push((time, vec![point])),
        }
    }
    instants
}

/// A column against x at the first instant.
fn at_start(table: &Table, column: &str) -> Vec<(f64, f64)> {
    let first = table.column("t").first().copied();
    let times = table.column("t").iter();
    let points = times.zip(table.pairs(along(table), column));
    points
        .take_while(|(time, _)| Some(**time) == first)
        .map(|(_, point)| point)
        .collect()
}

/// The profiles at some instants, and the ground if there is any.
pub(super) fn shapes(profiles: &Table, height: &str) -> Plot {
    let instants = instants(profiles);
    let every = instants.len().div_ceil(CURVES).max(1);
    let ground: Vec<(f64, f64)> = at_start(profiles, "z_ground");
    let mut shapes = if ground.is_empty() {
        Plot::new(&format!("{} [m]", along(profiles)), height)
    } else {
        Plot::new("x [m]", "height z [m]")
    };
    shapes.from_zero = ground.is_empty();
    for (n, (time, points)) in instants.iter().step_by(every).enumerate() {
        let mark = if n == 0 { Mark::Dashes } else { Mark::Line };
        shapes = shapes.with(&format!("{} s", number(*time)), mark, n, points.clone());
    }
    let lowest = ground.iter().map(|p| p.1).fold(f64::INFINITY, f64::min);
    if !ground.is_empty() {
        shapes.bands.push(Band {
            colour: 6,
            points: ground.iter().map(|&(x, z)| (x, lowest, z)).collect(),
        });
        shapes = shapes.with("ground", Mark::Line, 6, ground);
    }
    shapes
}

/// Pictures of a collapse.
pub(super) fn collapse(profiles: &Table, front: Option<&Table>) -> Markup {
    let shapes = shapes(profiles, "height of the heap h [m]");
    html! {
        h2 { "Collapse" }
        div.figures {
            (figure(&shapes.svg(WIDTH, HEIGHT), "Profiles through time, heights and lengths not to the same scale."))
            @if let Some(front) = front {
                @let front_column = if along(profiles) == "r" { "r_front" } else { "x_front" };
                @let plot = Plot::new("time t [s]", "position, height [m]")
                    .with("front", Mark::Line, 0, front.pairs("t", front_column))
                    .with("greatest height", Mark::Line, 1, front.pairs("t", "height"));
                (figure(&plot.svg(WIDTH, HEIGHT), "The front, where the heap is as high as front_height_scaled asks, and its greatest height."))
            }
        }
    }
}
