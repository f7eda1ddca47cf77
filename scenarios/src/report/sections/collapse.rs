//! A collapse: profiles through time, and where the front was when.

use super::{HEIGHT, WIDTH, figure};
use crate::report::page::number;
use crate::report::plot::{Mark, Plot};
use crate::table::Table;
use maud::{Markup, html};

/// Profiles drawn, beside the deposit.
const CURVES: usize = 6;

/// The profiles (t, x, h) as they follow each other in the table.
fn instants(table: &Table) -> Vec<(f64, Vec<(f64, f64)>)> {
    let mut instants: Vec<(f64, Vec<(f64, f64)>)> = Vec::new();
    let rows = table.column("t").iter().zip(table.pairs("x", "h"));
    for (&time, point) in rows {
        match instants.last_mut() {
            Some((last, points)) if *last == time => points.push(point),
            _ => instants.push((time, vec![point])),
        }
    }
    instants
}

/// Pictures of a collapse.
pub(super) fn collapse(profiles: &Table, front: Option<&Table>) -> Markup {
    let instants = instants(profiles);
    let every = instants.len().div_ceil(CURVES).max(1);
    let mut shapes = Plot::new("x [m]", "height of the heap h [m]");
    shapes.from_zero = true;
    for (n, (time, points)) in instants.iter().step_by(every).enumerate() {
        let mark = if n == 0 { Mark::Dashes } else { Mark::Line };
        shapes = shapes.with(&format!("{} s", number(*time)), mark, n, points.clone());
    }
    html! {
        h2 { "Collapse" }
        div.figures {
            (figure(&shapes.svg(WIDTH, HEIGHT), "Profiles through time, heights and lengths not to the same scale."))
            @if let Some(front) = front {
                @let plot = Plot::new("time t [s]", "position, height [m]")
                    .with("front", Mark::Line, 0, front.pairs("t", "x_front"))
                    .with("greatest height", Mark::Line, 1, front.pairs("t", "height"));
                (figure(&plot.svg(WIDTH, HEIGHT), "The front, where the heap is as high as front_height_scaled asks, and its greatest height."))
            }
        }
    }
}
