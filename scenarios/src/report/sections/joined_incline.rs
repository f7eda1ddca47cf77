//! An incline of grains and continuum: both profiles, and where they overlap.

use super::super::Record;
use super::{HEIGHT, WIDTH, figure};
use crate::report::plot::{Mark, Plot};
use crate::table::Table;
use maud::{Markup, html};

/// Names of the results that mark the overlap, and of the lines.
const MARKS: [(&str, &str); 3] = [
    ("height_inner", "a"),
    ("height_handshake", "m"),
    ("height_edge", "b"),
];

/// Pictures of a joined flow.
pub(super) fn profiles(record: &Record, grains: &Table, continuum: &Table) -> Markup {
    let heights: Vec<(f64, &str)> = MARKS
        .iter()
        .filter_map(|(name, mark)| {
            let value = record.summary.results.get(*name)?.value?;
            Some((value, *mark))
        })
        .collect();
    let plot = |column: &str, label: &str, of_continuum: bool| {
        let mut plot = Plot::new(label, "height z [m]").with(
            "grains",
            Mark::Dots,
            0,
            grains.pairs(column, "z"),
        );
        let points = grains.pairs(column, "z").into_iter();
        let mut widest = points
            .map(|p| p.0)
            .fold([0.0_f64; 2], |[low, high], x| [low.min(x), high.max(x)]);
        if of_continuum {
            let points = continuum.pairs(column, "z");
            for (x, _) in &points {
                widest = [widest[0].min(*x), widest[1].max(*x)];
            }
            plot = plot.with("continuum", Mark::Line, 1, points);
        }
        for (n, (height, mark)) in heights.iter().enumerate() {
            let line = widest.map(|x| (x, *height)).to_vec();
            plot = plot.with(mark, Mark::Dashes, 2 + n, line);
        }
        plot.svg(WIDTH, HEIGHT)
    };
    html! {
        h2 { "Through the depth" }
        p {
            "Grains end at b. The continuum has a copy of what lies above a; from a to m it takes the grains' stress in, "
            "from m to b mean velocities relax to each other. In the last layers below b the grains bear the continuum's "
            "traction, and their stress is not that of the flow."
        }
        div.figures {
            (figure(&plot("u", "velocity u [m/s]", true), "Velocity downslope."))
            (figure(&plot("sigma_zz", "σ_zz, pressure of the continuum [Pa]", true), "Normal stress."))
            (figure(&plot("tau", "|τ| [Pa]", true), "Shear stress."))
            (figure(&plot("phi", "solid fraction φ", true), "Solid fraction; the continuum has one value of it."))
            (figure(&plot("temperature", "granular temperature [m²/s²]", false), "Temperature of the grains; the continuum has none."))
            @if let Some(history) = record.table("history") {
                @let velocities = Plot::new("time t [s]", "velocity [m/s]")
                    .with("mean of all", Mark::Line, 0, history.pairs("t", "mean_velocity"))
                    .with("beside the edge", Mark::Line, 1, history.pairs("t", "edge_velocity"))
                    .with("surface", Mark::Line, 2, history.pairs("t", "surface_velocity"));
                (figure(&velocities.svg(WIDTH, HEIGHT), "Velocities in time."))
                @let height = Plot::new("time t [s]", "height of the edge [m]")
                    .with("", Mark::Line, 3, history.pairs("t", "edge_height"));
                (figure(&height.svg(WIDTH, HEIGHT), "The edge moves with the grains."))
            }
        }
    }
}
