//! What stands behind the law: competing laws, residuals, posterior, thresholds.

use super::super::page::{figure, number, with_error};
use super::super::plot::{Mark, Plot};
use super::{Campaign, HEIGHT, WIDTH};
use colluvium_coupling::calibration::{FluidityFit, Fraction, JointAlternative, JointComparison};
use colluvium_coupling::campaign::Threshold;
use maud::{Markup, html};

/// Competing laws, the free table, residual tests, the posterior and where flow stops.
pub(super) fn evidence(campaign: &Campaign) -> Markup {
    let result = &campaign.result;
    html! {
        @if !result.alternatives.is_empty() {
            h2 { "Other laws" }
            p {
                "The same points, errors and scatter for all. The criterion is Akaike's, corrected for few data and for scatter "
                "beyond the stated errors; the weight is the support a law has among these."
            }
            div.wide { table {
                tr { th.text { "law" } th.text { "parameters" } th { "rms" } th { "criterion" } th { "weight" } }
                @for a in &result.alternatives {
                    tr {
                        td.text { (a.law.title()) }
                        td.text {
                            @for (k, name) in a.law.parameter_names().iter().enumerate() {
                                @if k > 0 { ", " }
                                (name) " = " (with_error(a.parameters[k], a.errors[k]))
                            }
                        }
                        td { (number(a.rms_residual)) }
                        td { (format!("{:.1}", a.criterion)) }
                        td { (format!("{:.1} %", 100.0 * a.weight)) }
                    }
                }
            } }
        }
        @if let Some(joint) = &result.joint { (joint_laws(joint)) }
        @if let Some(fit) = &result.fluidity { (fluidity(fit)) }
        @if let Some(r) = &result.residuals {
            h3 { "Are the residuals noise?" }
            table {
                tr { th.text { "question" } th { "probability" } }
                tr { td.text { "χ² as large by chance, by the stated errors alone" } td { (number(r.chi_square)) } }
                tr { td.text { "signs in the order of I change so seldom" } td { (number(r.signs)) } }
                tr { td.text { "flows differ so much beyond their layers" } td { (number(r.between_runs)) } }
                tr { td.text { "such a trend with depth at equal I" } td { (number(r.depth)) } }
                tr { td.text { "that trend, from base to surface, in μ" } td { (with_error(r.depth_change, r.depth_change_error)) } }
            }
        }
        div.figures {
            @if let Some(table) = &result.free_form { (free_form(campaign, table)) }
            @if let Some(p) = &result.posterior {
                @let plane: Vec<(f64, f64)> = p.samples.iter().map(|s| (s[2], s[1])).collect();
                @let plot = Plot::new("I_0", "μ_2").with("posterior samples", Mark::Dots, 0, plane);
                (figure(&plot.svg(WIDTH, HEIGHT), &format!(
                    "Posterior of the fit: {} samples, worth {:.0} independent ones. μ_s, 68 %: {:.3} to {:.3}.",
                    p.samples.len(), p.effective_samples, p.quantiles[0][1], p.quantiles[0][3]
                )))
            }
        }
        @if result.stop.is_some() || result.onset.is_some() {
            h3 { "Where half of the beds flow" }
            table {
                tr { th.text { "" } th { "depth [d]" } th { "slope" } th { "spread of beds" } th.text { "flowed of tried" } }
                @for t in &result.stop_curve { (threshold("stop", t, campaign.diameter)) }
                @if let Some(t) = &result.onset { (threshold("onset", t, campaign.diameter)) }
            }
        }
    }
}

/// Laws of friction and solid fraction together.
fn joint_laws(joint: &JointComparison) -> Markup {
    let d = &joint.deviation;
    let beside = |a: &JointAlternative| match (a.fraction, a.dilatancy) {
        (Fraction::Dilatancy, Some([k, error])) => format!(", K = {}", with_error(k, error)),
        (Fraction::Dilatancy, None) => ", K = 0".to_owned(),
        _ => String::new(),
    };
    html! {
        h3 { "Friction and solid fraction together" }
        p {
            "Each layer's μ and φ against one φ, φ(I) = φ_0 − s I, and φ(I) with dilatancy, μ = μ(I) + K (φ − φ(I)), K ≥ 0 (Roux and "
            "Radjai 1998; Pailha and Pouliquen 2009). The criterion is the sum of that of φ for given I and that of μ for given I and φ; "
            "ĉ = " (number(joint.scatter[0])) " and " (number(joint.scatter[1])) ". Beside φ(I) flows differ by " (number(d.flows))
            " and layers by " (number(d.layers)) " more than the " (number(d.counting)) " that counting errs by; only that enters K."
        }
        table {
            tr { th.text { "solid fraction" } th { "weight, all laws" } }
            @for (fraction, weight) in Fraction::ALL.iter().zip(joint.weights) {
                tr { td.text { (fraction.title()) } td { (format!("{:.1} %", 100.0 * weight)) } }
            }
        }
        div.wide { table {
            tr { th.text { "friction" } th.text { "solid fraction" } th { "χ² of μ" } th { "χ² of φ" } th { "criterion" } th { "weight" } }
            @for a in &joint.alternatives {
                tr {
                    td.text { (a.friction.title()) }
                    td.text { (a.fraction.title()) (beside(a)) }
                    td { (format!("{:.0}", a.chi_square[0])) }
                    td { (format!("{:.0}", a.chi_square[1])) }
                    td { (format!("{:.1}", a.criterion)) }
                    td { (format!("{:.1} %", 100.0 * a.weight)) }
                }
            }
        } }
    }
}

/// The local law and one with a length.
fn fluidity(fit: &FluidityFit) -> Markup {
    let law =
        |[mu_s, mu_2, i_0]: [f64; 3]| format!("μ_s = {mu_s:.3}, μ_2 = {mu_2:.3}, I_0 = {i_0:.3}");
    let length = format!(
        "{}, A = {:.2} (68 %: {:.2} – {:.2}), g/g_loc at the base = {:.2}",
        law(fit.law),
        fit.amplitude,
        fit.amplitude_range[0],
        fit.amplitude_range[1],
        fit.base
    );
    let rows = [
        ("local", law(fit.local), 0, 1.0 - fit.weight),
        ("non-local fluidity", length, 1, fit.weight),
    ];
    html! {
        h3 { "A length beside the local law?" }
        p {
            "ξ²∇²g = g − g_loc with ξ = A d √((μ_2 − μ)/((μ_2 − μ_s)|μ − μ_s|)) (Kamrin and Henann 2015) through the depth of each "
            "flow, against A = 0, on " (fit.points) " layers of " (fit.flows) " flows: both foretell I from the stress that momentum "
            "asks. Each flow has a friction of its own; ĉ = " (number(fit.scatter)) ". Of " (fit.left_out.flows) " flows left out of both fits, "
            (fit.left_out.better) " are foretold better with the length (mean gain " (number(fit.left_out.significance)) " standard errors)."
        }
        div.wide { table {
            tr { th.text { "law" } th.text { "parameters" } th { "rms of ln I" } th { "of flows left out" } th { "χ²" } th { "criterion" } th { "weight" } }
            @for (name, parameters, k, weight) in rows {
                tr {
                    td.text { (name) }
                    td.text { (parameters) }
                    td { (format!("{:.4}", fit.rms[k])) }
                    td { (format!("{:.4}", fit.left_out.rms[k])) }
                    td { (format!("{:.0}", fit.chi_square[k])) }
                    td { (format!("{:.1}", fit.criterion[k])) }
                    td { (format!("{:.1} %", 100.0 * weight)) }
                }
            }
        } }
    }
}

fn threshold(name: &str, t: &Threshold, diameter: f64) -> Markup {
    let trials: Vec<String> = t
        .trials
        .iter()
        .map(|t| format!("{:.2}°: {}/{}", t.slope_degrees, t.flowed, t.tried))
        .collect();
    html! {
        tr {
            td.text { (name) }
            td { (format!("{:.1}", t.height / diameter)) }
            td { (format!("{:.2} ± {:.2}°", t.degrees, t.error)) }
            td { (format!("{:.1}°", t.spread)) }
            td.text.wrap { (trials.join(", ")) }
        }
    }
}

fn free_form(campaign: &Campaign, table: &colluvium_coupling::calibration::FreeForm) -> Markup {
    let points = &campaign.result.points;
    let measured = points
        .iter()
        .map(|p| (p.inertial_number, p.friction))
        .collect();
    let knots = table
        .inertial_number
        .iter()
        .copied()
        .zip(table.friction.iter().copied())
        .collect();
    let plot = Plot::new("inertial number I", "friction μ = |τ|/p")
        .with("points", Mark::Dots, 0, measured)
        .with("table", Mark::Line, 1, knots);
    figure(
        &plot.svg(WIDTH, HEIGHT),
        &format!(
            "A table of no given form that only rises and bends downwards; rms {:.4}, {} constraints bind.",
            table.rms_residual, table.binding
        ),
    )
}
