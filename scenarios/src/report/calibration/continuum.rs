//! Grains, continuum and theory side by side.

use super::super::page::{figure, number};
use super::super::plot::{Mark, Plot};
use super::{Campaign, FrictionOf, HEIGHT, WIDTH, outcome};
use colluvium_coupling::incline::InclineResult;
use maud::{Markup, html};

/// The continuum at the angles where it was compared with the grains.
pub(super) fn continuum(campaign: &Campaign) -> Markup {
    let flows: Vec<&InclineResult> = campaign
        .flows()
        .filter(|r| {
            campaign
                .comparisons
                .iter()
                .any(|c| c.slope_degrees == r.slope_degrees)
        })
        .collect();
    html! {
        @if !flows.is_empty() {
            h2 { "Grains, continuum, theory" }
            p {
                "The fitted law in the finite-volume solver, at the slope and depth of the grains, from rest to steady flow. "
                "On an incline its single pressure is σ_zz and its friction is tan θ; the grains' p = trace/3 is smaller than σ_zz. "
                "So the fit of |τ|/σ_zz is the one that should reproduce the velocity here, and the gap to the fit of |τ|/p "
                "shows what the normal-stress difference costs a scalar law."
            }
            div.figures {
                @for run in &flows { (velocity(campaign, run)) (pressure(campaign, run)) }
            }
            div.wide { table {
                tr {
                    th { "slope" } th.text { "law" } th { "I" } th { "mean u [m/s]" } th { "grains' mean u [m/s]" }
                    th { "difference" } th { "posterior, 95 %" } th { "grains within" } th { "error against exact" } th { "wall [s]" }
                }
                @for c in &campaign.comparisons {
                    @let grains = c.grains_u.or_else(|| flows.iter().find(|r| r.slope_degrees == c.slope_degrees).map(|r| r.steady.mean));
                    @let mean = c.u.iter().sum::<f64>() / c.u.len().max(1) as f64;
                    tr {
                        td { (c.slope_degrees) "°" }
                        td.text { (friction_name(c.friction)) }
                        td { (number(c.inertial_number)) @if !c.inside_valid_i { " " span.tag.bad { "not measured" } } }
                        td { (number(mean)) }
                        td { @if let Some(g) = grains { (number(g)) } }
                        td { @if let Some(g) = grains { (format!("{:+.1} %", 100.0 * (mean / g - 1.0))) } }
                        td { @if let Some(b) = c.band { (format!("{:+.0} … {:+.0} %", 100.0 * (b[0] - 1.0), 100.0 * (b[4] - 1.0))) } }
                        td { @match c.against_grains() { Some((_, [true, _])) => "68 %", Some((_, [_, true])) => "95 %", Some(_) => "outside", None => "–" } }
                        td { (number(c.velocity_error)) }
                        td { (number(c.wall_s)) }
                    }
                }
            } }
        }
    }
}

fn friction_name(friction: FrictionOf) -> &'static str {
    match friction {
        FrictionOf::Pressure => "|τ|/p",
        FrictionOf::NormalStress => "|τ|/σ_zz",
    }
}

fn velocity(campaign: &Campaign, run: &InclineResult) -> Markup {
    let Some(profile) = &run.profile else {
        return html! {};
    };
    let grains = profile
        .rows
        .iter()
        .filter(|r| r.z > 0.0 && r.z < run.height);
    let mut plot = Plot::new("velocity u [m/s]", "height z [m]").with(
        "grains",
        Mark::Dots,
        0,
        grains.map(|r| (r.u.value, r.z)).collect(),
    );
    for c in campaign
        .comparisons
        .iter()
        .filter(|c| c.slope_degrees == run.slope_degrees)
    {
        let colour = if c.friction == FrictionOf::Pressure {
            1
        } else {
            2
        };
        let label = format!("continuum, {}", friction_name(c.friction));
        plot = plot
            .with(
                &label,
                Mark::Line,
                colour,
                c.u.iter().copied().zip(c.z.iter().copied()).collect(),
            )
            .with(
                "",
                Mark::Dashes,
                6,
                c.exact_u.iter().copied().zip(c.z.iter().copied()).collect(),
            );
    }
    if let Some(last) = plot.series.last_mut() {
        last.label = "exact Bagnold".into();
    }
    let text = format!(
        "Velocity at {}°; {}.",
        run.slope_degrees,
        outcome(run.outcome)
    );
    figure(&plot.svg(WIDTH, HEIGHT), &text)
}

fn pressure(campaign: &Campaign, run: &InclineResult) -> Markup {
    let Some(profile) = &run.profile else {
        return html! {};
    };
    let rows: Vec<_> = profile
        .rows
        .iter()
        .filter(|r| r.z > 0.0 && r.z < run.height)
        .collect();
    let mut plot = Plot::new("pressure [Pa]", "height z [m]")
        .with(
            "grains, σ_zz",
            Mark::Dots,
            0,
            rows.iter().map(|r| (r.sigma_zz.value, r.z)).collect(),
        )
        .with(
            "grains, trace/3",
            Mark::Dots,
            3,
            rows.iter().map(|r| (r.p.value, r.z)).collect(),
        );
    if let Some(c) = campaign
        .comparisons
        .iter()
        .find(|c| c.slope_degrees == run.slope_degrees)
    {
        plot = plot.with(
            "continuum",
            Mark::Line,
            1,
            c.p.iter().copied().zip(c.z.iter().copied()).collect(),
        );
    }
    figure(
        &plot.svg(WIDTH, HEIGHT),
        &format!("Pressure at {}°.", run.slope_degrees),
    )
}
