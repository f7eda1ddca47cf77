//! Plots of single runs and comparisons.

mod collapse;
mod joined_incline;
mod open_chute;
mod silo_discharge;

use super::Record;
use super::page::{figure, number};
use super::plot::{Mark, Plot};
use crate::table::Table;
use maud::{Markup, html};

const WIDTH: u32 = 560;
const HEIGHT: u32 = 400;

/// All plots that the tables of a run allow.
pub fn plots(record: &Record) -> Markup {
    html! {
        @if let Some(table) = record.table("pareto") { (pareto(&table, record.table("ends").as_ref())) }
        @if let (Some(profiles), Some(speeds)) = (record.table("profiles"), record.table("speeds")) {
            (open_chute::open_chute(&profiles, &speeds, record.table("balance").as_ref()))
        } @else if let (Some(profiles), Some(discharge)) = (record.table("profiles"), record.table("discharge")) {
            (silo_discharge::silo_discharge(&profiles, &discharge))
        } @else if let Some(table) = record.table("profiles") {
            (collapse::collapse(&table, record.table("front").as_ref()))
        }
        @if let Some(table) = record.table("trajectory") { (trajectory(&table)) }
        @if let (Some(grains), Some(continuum)) = (record.table("profile_grains"), record.table("profile_continuum")) {
            (joined_incline::profiles(record, &grains, &continuum))
        } @else if let Some(table) = record.table("profile") {
            @if table.column("u_exact").is_empty() {
                (grains(&table, record.table("energy").as_ref()))
            } @else {
                (layer(&table, record.table("history").as_ref()))
            }
        } @else if let Some(table) = record.table("energy") {
            h2 { "In time" }
            div.figures { (energy(&table)) }
        }
    }
}

/// The error against one of the keys that vary, a line for each combination of the others.
fn by_key(table: &Table, keys: &[&str], key: &str) -> Plot {
    let others: Vec<&str> = keys.iter().copied().filter(|other| *other != key).collect();
    type Points = Vec<(f64, f64)>;
    let mut lines: Vec<(Vec<f64>, Points)> = Vec::new();
    let pairs = table.column(key).iter().zip(table.column("error"));
    for (row, (x, error)) in pairs.enumerate() {
        let at: Vec<f64> = others.iter().map(|k| table.column(k)[row]).collect();
        match lines.iter_mut().find(|(of, _)| *of == at) {
            Some((_, line)) => line.push((*x, *error)),
            None => lines.push((at, vec![(*x, *error)])),
        }
    }
    let mut plot = Plot::new(key, "relative error");
    for (n, (at, line)) in lines.iter().enumerate() {
        let words = others.iter().zip(at).map(|(k, v)| format!("{k} = {v}"));
        let label = match others.len() {
            0 => "runs".to_owned(),
            _ => words.collect::<Vec<_>>().join(", "),
        };
        plot = plot.with("", Mark::Line, n + 1, line.clone()).with(
            &label,
            Mark::Dots,
            n + 1,
            line.clone(),
        );
    }
    let points = table.pairs(key, "error");
    // A guide for keys that refine; others, such as a time step, coarsen as they grow.
    let refines = table.column("order").iter().any(|order| *order > 0.0);
    if let Some((x, y)) = points.first().copied().filter(|p| p.0 > 0.0 && refines) {
        let slope = points
            .iter()
            .map(|p| (p.0, y * (x / p.0).powi(2)))
            .collect();
        plot = plot.with("second order", Mark::Dashes, 6, slope);
    }
    (plot.x_log, plot.y_log) = (true, true);
    plot
}

fn pareto(table: &Table, ends: Option<&Table>) -> Markup {
    // Runs of before processor time was told have wall time alone.
    let (cost, label) = match table.column("processor_s") {
        [] => ("wall_s", "wall time [s]"),
        _ => ("processor_s", "processor time [s]"),
    };
    let points = table.pairs(cost, "error");
    let keys = table.columns.iter().take_while(|c| c.name != "error");
    let keys: Vec<&str> = keys.map(|c| c.name.as_str()).collect();
    // Runs of one key stand in a row; of several, those that nothing beats.
    let line = match keys.len() {
        0 | 1 => points.clone(),
        _ => {
            let best = points.iter().zip(table.column("on_front"));
            let best = best.filter(|(_, on)| **on > 0.0).map(|(p, _)| *p);
            let mut best: Vec<(f64, f64)> = best.collect();
            best.sort_by(|a, b| a.0.total_cmp(&b.0));
            best
        }
    };
    let mut plot = Plot::new(label, "relative error")
        .with("", Mark::Line, 0, line)
        .with("runs", Mark::Dots, 0, points.clone());
    for (seconds, error) in ends.map(|t| t.pairs(cost, "error")).unwrap_or_default() {
        plot = match error > 0.0 {
            true => plot.with("beside", Mark::Dots, 1, vec![(seconds, error)]),
            // Its error, 0, lies below the lowest of a logarithmic axis: a line at its cost.
            false => {
                let among = points.iter().map(|p| (seconds, p.1)).collect();
                plot.with("reference", Mark::Line, 6, among)
            }
        };
    }
    (plot.x_log, plot.y_log) = (true, true);
    // Where several observables are compared, the largest error hides the others.
    let parts = table
        .columns
        .iter()
        .filter(|c| c.name.starts_with("error_"));
    for (n, part) in parts.enumerate().filter(|_| keys.len() < 2) {
        let label = part.name.trim_start_matches("error_").replace('_', " ");
        plot = plot.with(&label, Mark::Dashes, n + 2, table.pairs(cost, &part.name));
    }
    let by_key: Vec<Plot> = keys.iter().map(|key| by_key(table, &keys, key)).collect();
    html! {
        h2 { "Error against cost" }
        div.figures {
            (figure(&plot.svg(WIDTH, HEIGHT), "Each point is one run; down and left is better."))
            @for plot in by_key {
                (figure(&plot.svg(WIDTH, HEIGHT), "The error against a key that was varied."))
            }
        }
        div.wide {
            table {
                tr { @for c in &table.columns { th { (c.name) } } }
                @for row in 0..table.rows() {
                    tr {
                        @for c in &table.columns {
                            td { (number(c.values.get(row).copied().unwrap_or(f64::NAN))) }
                        }
                    }
                }
            }
        }
    }
}

fn trajectory(table: &Table) -> Markup {
    let pair = !table.column("x2").is_empty();
    let mut velocity = Plot::new("time t [s]", "velocity [m/s]")
        .with(
            if pair { "sphere 1, normal" } else { "normal" },
            Mark::Line,
            0,
            table.pairs("t", "vz1"),
        )
        .with(
            if pair {
                "sphere 1, tangential"
            } else {
                "tangential"
            },
            Mark::Line,
            1,
            table.pairs("t", "vx1"),
        );
    let mut spin = Plot::new("time t [s]", "spin about y [rad/s]").with(
        if pair { "sphere 1" } else { "" },
        Mark::Line,
        3,
        table.pairs("t", "wy1"),
    );
    if pair {
        velocity = velocity
            .with("sphere 2, normal", Mark::Dashes, 0, table.pairs("t", "vz2"))
            .with(
                "sphere 2, tangential",
                Mark::Dashes,
                1,
                table.pairs("t", "vx2"),
            );
        spin = spin.with("sphere 2", Mark::Dashes, 3, table.pairs("t", "wy2"));
    }
    html! {
        h2 { "The impact" }
        div.figures {
            (figure(&velocity.svg(WIDTH, HEIGHT), "Velocities along the contact normal z and the tangent x."))
            (figure(&spin.svg(WIDTH, HEIGHT), "Angular velocity about y."))
        }
    }
}

fn layer(profile: &Table, history: Option<&Table>) -> Markup {
    let velocity = Plot::new("velocity u [m/s]", "distance z across the layer [m]")
        .with("exact", Mark::Dashes, 6, profile.pairs("u_exact", "z"))
        .with("computed", Mark::Dots, 0, profile.pairs("u", "z"));
    let error: Vec<(f64, f64)> = profile
        .column("u")
        .iter()
        .zip(profile.column("u_exact"))
        .zip(profile.column("z"))
        .map(|((u, exact), z)| (u - exact, *z))
        .collect();
    let error = Plot::new("u − u exact [m/s]", "distance z across the layer [m]").with(
        "",
        Mark::Line,
        1,
        error,
    );
    html! {
        h2 { "Profile" }
        div.figures {
            (figure(&velocity.svg(WIDTH, HEIGHT), "Velocity across the layer, beside the exact solution."))
            (figure(&error.svg(WIDTH, HEIGHT), "What is left between them."))
            @if let Some(history) = history {
                @let plot = Plot::new("time t [s]", "mean velocity [m/s]")
                    .with("", Mark::Dots, 2, history.pairs("t", "mean_velocity"));
                @let plot = Plot { x_log: true, ..plot };
                (figure(&plot.svg(WIDTH, HEIGHT), "From rest to the steady flow; each point is one implicit step."))
            }
        }
    }
}

fn energy(table: &Table) -> Markup {
    let mut plot = Plot::new("time t [s]", "kinetic energy [J]").with(
        "",
        Mark::Line,
        1,
        table.pairs("t", "kinetic_energy"),
    );
    plot.from_zero = true;
    figure(
        &plot.svg(WIDTH, HEIGHT),
        "Kinetic energy of the free grains, translation and rotation.",
    )
}

fn grains(profile: &Table, in_time: Option<&Table>) -> Markup {
    let bars = |name: &str| profile.column(name).to_vec();
    let velocity = Plot::new("velocity u [m/s]", "height z [m]").with(
        "",
        Mark::Dots,
        0,
        profile.pairs("u", "z"),
    );
    let fraction = Plot::new("height z [m]", "solid fraction φ")
        .with("", Mark::Dots, 2, profile.pairs("z", "phi"))
        .with_errors(bars("phi_error"));
    let stress = Plot::new("stress [Pa]", "height z [m]")
        .with("σ_zz", Mark::Line, 0, profile.pairs("sigma_zz", "z"))
        .with(
            "p, a third of the trace",
            Mark::Line,
            2,
            profile.pairs("p", "z"),
        )
        .with("|τ|", Mark::Line, 1, profile.pairs("tau", "z"));
    let friction = Plot::new("inertial number I", "friction μ")
        .with("|τ|/p", Mark::Dots, 0, profile.pairs("i", "mu"))
        .with("|τ|/σ_zz", Mark::Dots, 1, profile.pairs("i", "mu_zz"));
    html! {
        h2 { "Through the depth" }
        div.figures {
            (figure(&velocity.svg(WIDTH, HEIGHT), "Mean velocity downslope in layers."))
            (figure(&stress.svg(WIDTH, HEIGHT), "Stress, contact and kinetic parts together."))
            (figure(&fraction.svg(WIDTH, HEIGHT), "Solid fraction with standard errors."))
            (figure(&friction.svg(WIDTH, HEIGHT), "Friction against inertial number, all layers."))
            @if let Some(table) = in_time { (energy(table)) }
        }
    }
}
