//! A fed chute: its surface through time, speeds half way down, and the balance of volume.

use super::{HEIGHT, WIDTH, collapse, figure};
use crate::report::plot::{Mark, Plot};
use crate::table::Table;
use maud::{Markup, html};

/// Pictures of a chute.
pub(super) fn open_chute(profiles: &Table, speeds: &Table, balance: Option<&Table>) -> Markup {
    let surface = collapse::shapes(profiles, "depth h [m]");
    let speed = Plot::new("speed u [m/s]", "height z [m]")
        .with("steady layer", Mark::Line, 0, speeds.pairs("u_steady", "z"))
        .with("half way down", Mark::Dots, 1, speeds.pairs("u", "z"));
    html! {
        h2 { "Chute" }
        div.figures {
            (figure(&surface.svg(WIDTH, HEIGHT), "Depth along the chute through time, heights and lengths not to the same scale."))
            (figure(&speed.svg(WIDTH, HEIGHT), "Speed half way down at the end, beside that of a steady layer as deep as what enters."))
            @if let Some(balance) = balance {
                @let plot = Plot::new("time t [s]", "volume per width [m²]")
                    .with("in the chute", Mark::Line, 0, balance.pairs("t", "volume"))
                    .with("entered", Mark::Line, 1, balance.pairs("t", "entered"))
                    .with("left", Mark::Line, 2, balance.pairs("t", "left"));
                (figure(&plot.svg(WIDTH, HEIGHT), "What is in the chute, and what has come in and gone out."))
            }
        }
    }
}
