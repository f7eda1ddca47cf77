//! Grains, continuum and theory side by side.

use super::super::page::{figure, number};
use super::super::plot::{Mark, Plot};
use super::{Campaign, FrictionOf, HEIGHT, WIDTH, outcome};
use colluvium_coupling::calibration::{CONTROL, Stress};
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
                "The fitted law in the finite-volume solver, at the weight of the grains and at the stress ratio that momentum asks of "
                "their bulk: tan θ, less what accelerates them. Velocities are compared above the foot of the bulk, so that slip and "
                "the layers at the base are the grains' own. On an incline the solver's single pressure is σ_zz and its friction "
                "|τ|/σ_zz; the grains' p = trace/3 is smaller. So the fit of |τ|/σ_zz is the one that should reproduce the velocity, "
                "and the fit of |τ|/p is the control that should not."
            }
            div.figures {
                @for run in &flows { (velocity(campaign, run)) (pressure(campaign, run)) }
            }
            div.wide { table {
                tr {
                    th { "slope" } th.text { "law" } th { "τ/σ_zz" } th { "I" } th { "u above foot [m/s]" } th { "grains [m/s]" }
                    th { "difference" } th { "posterior and discrepancy, 95 %" } th { "grains within" } th { "error against exact" } th { "wall [s]" }
                }
                @for c in &campaign.comparisons {
                    @let against = c.against_grains();
                    tr {
                        td { (c.slope_degrees) "°" }
                        td.text { (friction_name(c.friction)) }
                        td { @if let Some(t) = c.tangent { (format!("{t:.4}")) } }
                        td { (number(c.inertial_number)) @if !c.inside_valid_i { " " span.tag.bad { "not measured" } } }
                        td { @if let Some([ours, _]) = c.gains { (number(ours)) } }
                        td { @if let Some([_, grains]) = c.gains { (number(grains)) } }
                        td { @if let Some((difference, _)) = against { (format!("{:+.1} %", 100.0 * difference)) } }
                        td { @if let Some(b) = c.band { (percent(b[0])) " … " (percent(b[4])) } }
                        td { @match against { Some((_, [true, _])) => "68 %", Some((_, [_, true])) => "95 %", Some(_) => "outside", None => "–" } }
                        td { (number(c.velocity_error)) }
                        td { (number(c.wall_s)) }
                    }
                }
            } }
            (causes(campaign))
        }
        (left_out(campaign))
    }
}

/// A factor as a change in per cent; a flow that nothing holds back has no number.
fn percent(factor: f64) -> String {
    if factor < 1e3 {
        format!("{:+.1} %", 100.0 * (factor - 1.0))
    } else {
        "∞".to_owned()
    }
}

/// Continuum over grains, less 1, one cause after another.
fn causes(campaign: &Campaign) -> Markup {
    let told: Vec<_> = campaign
        .comparisons
        .iter()
        .filter(|c| c.friction == FrictionOf::NormalStress && !c.causes.is_empty())
        .collect();
    html! {
        @if let Some(first) = told.first() {
            h3 { "What makes the difference" }
            p { "The continuum's velocity over the grains', less 1, law of |τ|/σ_zz, with one cause after another taken out." }
            div.wide { table {
                tr { th.text { "" } @for c in &told { th { (c.slope_degrees) "°" } } }
                @for (k, (name, _)) in first.causes.iter().enumerate() {
                    tr {
                        td.text { (name) }
                        @for c in &told { td { @if let Some((_, d)) = c.causes.get(k) { (percent(1.0 + d)) } } }
                    }
                }
            } }
        }
    }
}

/// Every flow beside the law of the others.
fn left_out(campaign: &Campaign) -> Markup {
    let rows = &campaign.result.left_out;
    html! {
        @if !rows.is_empty() {
            h3 { "Flows left out of the fit" }
            p {
                "Each flow beside the law that the others give: velocity above the foot of the bulk over the grains', from the stress "
                "that momentum asks. The band holds the posterior and the discrepancy, by which flows lie off the law beyond what its "
                "three parameters take up. The control is the same law with " (format!("{:.0}", 100.0 * CONTROL)) " % more friction."
            }
            div.wide { table {
                tr {
                    th { "slope" } th.text { "law" } th { "μ asked" } th { "law/grains − 1" } th { "posterior, 95 %" } th { "within" }
                    th { "discrepancy in μ" } th { "with it, 68 %" } th { "95 %" } th { "within" } th { "control" } th { "within" }
                }
                @for r in rows {
                    tr {
                        td { (r.slope_degrees) "°" @if !r.inside { " " span.tag.bad { "beyond the others" } } }
                        td.text { (friction_name(if r.stress == Stress::MeanPressure { FrictionOf::Pressure } else { FrictionOf::NormalStress })) }
                        td { (format!("{:.4}", r.asked)) }
                        td { (percent(r.ratio)) }
                        td { (percent(r.by_posterior[0])) " … " (percent(r.by_posterior[4])) }
                        td { (within(r.covered_by_posterior())) }
                        td { (format!("{:.4}", r.discrepancy.friction)) }
                        td { (percent(r.band[1])) " … " (percent(r.band[3])) }
                        td { (percent(r.band[0])) " … " (percent(r.band[4])) }
                        td { (within(r.covered())) }
                        td { (percent(r.control)) }
                        td { (within(r.control_covered())) }
                    }
                }
            } }
        }
    }
}

fn within(covered: [bool; 2]) -> &'static str {
    match covered {
        [true, _] => "68 %",
        [_, true] => "95 %",
        _ => "outside",
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
