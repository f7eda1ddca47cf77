//! A silo that runs out: its rate, its surface through time, and what is left.

use super::{HEIGHT, WIDTH, collapse, figure};
use crate::report::plot::{Mark, Plot};
use crate::table::Table;
use maud::{Markup, html};

/// Pictures of a silo.
pub(super) fn silo_discharge(profiles: &Table, discharge: &Table) -> Markup {
    let rate = Plot::new("time t [s]", "rate Q [m²/s]").with(
        "",
        Mark::Line,
        0,
        discharge.pairs("t", "rate"),
    );
    let surface = collapse::shapes(profiles, "height h [m]");
    let volumes = Plot::new("time t [s]", "volume per length [m²]")
        .with("in the silo", Mark::Line, 0, discharge.pairs("t", "volume"))
        .with(
            "discharged",
            Mark::Line,
            1,
            discharge.pairs("t", "discharged"),
        );
    html! {
        h2 { "Silo" }
        div.figures {
            (figure(&rate.svg(WIDTH, HEIGHT), "Volume that runs out per time and length of the slot."))
            (figure(&surface.svg(WIDTH, HEIGHT), "Height of material through time, heights and lengths not to the same scale."))
            (figure(&volumes.svg(WIDTH, HEIGHT), "What is in the silo, and what has left it."))
        }
    }
}
