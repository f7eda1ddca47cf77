//! The report of a map.

use super::MapFile;
use super::cell::Cell;
use super::curve::HELD;
use crate::report::page::{figure, number, page, with_error};
use crate::report::plot::{Mark, Plot};
use crate::run::PUBLISHED_ANGLES;
use colluvium_coupling::calibration::{Axis, FrictionMap, mu_of_i};
use maud::{Markup, html};

/// The page.
pub(super) fn report(file: &MapFile, map: &FrictionMap, cells: &[Cell]) -> String {
    let body = html! {
        p { (file.measured) "." }
        div.figures {
            (figure(&repose(map).svg(560, 400), "Angle of repose; dashed: Thuillet 2019, Table 2.2."))
            (figure(&friction(map).svg(560, 400), "Friction |τ|/p at the map's inertial numbers."))
            (figure(&curves(cells).svg(560, 400), "The fitted laws, each over what was measured."))
        }
        h2 { "Cells" }
        (measured(cells))
        h2 { "Interpolation" }
        p {
            "Every grid point with neighbours on both sides along an axis beside what they make of it, over twice the spacing of the "
            "grid: interpolated less measured."
        }
        (missed(map))
    };
    page(
        "Map of materials",
        "β, μ_R → μ(I) and angle of repose.",
        &body,
    )
}

fn measured(cells: &[Cell]) -> Markup {
    html! {
        div.wide { table {
            tr {
                th { "β" } th { "μ_R" } th { "angle of repose [°]" } th { "published [°]" } th { "μ_s" } th { "μ_2" } th { "I_0" } th { "rms" }
                th { "I measured" } th { "φ" } th { "p/σ_zz" } th.text { "determined" } th.text { "report" }
            }
            @for c in cells {
                @let fit = c.campaign.result.fit.as_ref().filter(|f| f.physical);
                tr {
                    td { (c.cell.beta) }
                    td { (c.cell.mu_r) }
                    td { (with_error(c.cell.repose.value, c.cell.repose.error)) }
                    td { @if let Some(there) = published(c.cell.beta, c.cell.mu_r) { (there) } @else { "–" } }
                    @if let Some(f) = fit {
                        td { (with_error(f.mu_s, f.mu_s_error)) }
                        td { (with_error(f.mu_2, f.mu_2_error)) }
                        td { (with_error(f.i_0, f.i_0_error)) }
                        td { (number(f.rms_residual)) }
                        td { (number(f.valid_i[0])) " … " (number(f.valid_i[1])) }
                    } @else {
                        td.text colspan="4" { "no three parameters; the curve has I_0 = " (HELD) }
                        td { (number(c.cell.valid_i[0])) " … " (number(c.cell.valid_i[1])) }
                    }
                    td { (with_error(c.cell.solid_fraction.value, c.cell.solid_fraction.error)) }
                    td { @if let Some((ratio, _)) = c.campaign.result.pressure_ratio { (number(ratio)) } }
                    td.text { @if fit.is_some_and(|f| f.identified) { "yes" } @else { "the curve only" } }
                    td.text { a href=(format!("{}/campaign/report.html", c.folder)) { "campaign" } }
                }
            }
        } }
    }
}

fn missed(map: &FrictionMap) -> Markup {
    let i = map.inertial_numbers();
    let axes = [Axis::Beta, Axis::RollingFriction].into_iter();
    let along = axes.filter_map(|a| Some((name(a), map.error_along(a)?)));
    let rows = along.chain([("all", map.error())]);
    html! {
        @if map.missed().is_empty() { p { "No grid point has neighbours on both sides: a grid this small cannot tell the error of its interpolation." } }
        div.wide { table {
            tr {
                th { "β" } th { "μ_R" } th.text { "along" }
                @for i in i { th { (format!("μ at I = {i}")) } }
                th { "angle of repose [°]" } th { "φ" }
            }
            @for m in map.missed() {
                tr {
                    td { (m.beta) }
                    td { (m.mu_r) }
                    td.text { (name(m.along)) }
                    @for f in m.friction { td { (format!("{f:+.4}")) } }
                    td { (format!("{:+.2}", m.repose)) }
                    td { (format!("{:+.4}", m.solid_fraction)) }
                }
            }
            @for (which, error) in rows {
                tr {
                    td { "rms" }
                    td { "" }
                    td.text { (which) }
                    @for f in error.friction { td { (format!("{f:.4}")) } }
                    td { (format!("{:.2}", error.repose)) }
                    td { (format!("{:.4}", error.solid_fraction)) }
                }
            }
        } }
    }
}

fn name(axis: Axis) -> &'static str {
    match axis {
        Axis::Beta => "β",
        Axis::RollingFriction => "μ_R",
    }
}

fn published(beta: f64, mu_r: f64) -> Option<f64> {
    let same = |row: &&[f64; 3]| (row[0] - mu_r).abs() < 1e-9 && (row[1] - beta).abs() < 1e-9;
    PUBLISHED_ANGLES.iter().find(same).map(|row| row[2])
}

/// The different μ_R of a map.
fn rolling(map: &FrictionMap) -> Vec<f64> {
    let mut all: Vec<f64> = map.cells().iter().map(|c| c.mu_r).collect();
    all.sort_by(f64::total_cmp);
    all.dedup();
    all
}

fn repose(map: &FrictionMap) -> Plot {
    let mut plot = Plot::new("log₁₀ β", "angle of repose [°]");
    for (k, mu_r) in rolling(map).into_iter().enumerate() {
        let row = || map.cells().iter().filter(move |c| c.mu_r == mu_r);
        let points = row()
            .map(|c| (c.beta.log10(), c.repose.value))
            .collect::<Vec<_>>();
        plot = plot
            .with("", Mark::Line, k, points.clone())
            .with(&format!("μ_R = {mu_r}"), Mark::Dots, k, points)
            .with_errors(row().map(|c| c.repose.error).collect());
        let there: Vec<(f64, f64)> = PUBLISHED_ANGLES
            .iter()
            .filter(|r| (r[0] - mu_r).abs() < 1e-9)
            .map(|r| (r[1].log10(), r[2]))
            .collect();
        if !there.is_empty() {
            plot = plot.with(&format!("published, μ_R = {mu_r}"), Mark::Dashes, k, there);
        }
    }
    plot
}

fn friction(map: &FrictionMap) -> Plot {
    let mut plot = Plot::new("log₁₀ β", "friction μ");
    for (colour, mu_r) in rolling(map).into_iter().enumerate() {
        for (k, i) in map.inertial_numbers().into_iter().enumerate() {
            let row = || map.cells().iter().filter(move |c| c.mu_r == mu_r);
            let points = row()
                .map(|c| (c.beta.log10(), c.curve.friction[k]))
                .collect::<Vec<_>>();
            let errors = row().map(|c| c.curve.covariance[k][k].sqrt()).collect();
            plot = plot
                .with("", Mark::Line, colour, points.clone())
                .with(
                    &format!("I = {i}, μ_R = {mu_r}"),
                    Mark::Dots,
                    colour,
                    points,
                )
                .with_errors(errors);
        }
    }
    plot
}

fn curves(cells: &[Cell]) -> Plot {
    let mut plot = Plot::new("inertial number I", "friction μ = |τ|/p");
    for (k, c) in cells.iter().enumerate() {
        let Some(fit) = &c.campaign.result.fit else {
            continue;
        };
        let [low, high] = fit.valid_i;
        let line = (0..=40)
            .map(|n| low + (high - low) * f64::from(n) / 40.0)
            .map(|i| (i, mu_of_i(fit.mu_s, fit.mu_2, fit.i_0, i)))
            .collect();
        let label = format!("β {}, μ_R {}", c.cell.beta, c.cell.mu_r);
        plot = plot.with(&label, Mark::Line, k, line);
    }
    plot
}
