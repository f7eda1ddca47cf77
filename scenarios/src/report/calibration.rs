//! The report of a calibration.

use super::page::{figure, number, with_error};
use super::plot::{Band, Mark, Plot};
use super::{Record, results};
use crate::calibrate::{CAMPAIGN, published_material};
use colluvium_coupling::calibration::MuIFit;
use colluvium_coupling::calibration::thesis::{Estimator, Row, TABLE_2_6};
use colluvium_coupling::campaign::CampaignResult;
use colluvium_coupling::incline::{InclineResult, Outcome, Purpose, Start};
use maud::{Markup, html};
use serde::{Deserialize, Serialize};
use std::path::Path;

const WIDTH: u32 = 560;
const HEIGHT: u32 = 400;

/// A campaign as it is kept for reports.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Campaign {
    /// Runs, brackets, fits and verdict.
    pub result: CampaignResult,
    /// The continuum beside the grains.
    pub comparisons: Vec<Comparison>,
    /// Gravity [m/s²].
    pub gravity: f64,
    /// Mean diameter [m].
    pub diameter: f64,
}

/// Which friction a continuum run was given.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum FrictionOf {
    /// |τ|/p, p = trace/3.
    Pressure,
    /// |τ|/σ_zz.
    NormalStress,
}

/// A continuum layer at the slope and depth of one flow of grains.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Comparison {
    /// Slope [degrees].
    pub slope_degrees: f64,
    /// Which fit it was given.
    pub friction: FrictionOf,
    /// I of its steady flow.
    pub inertial_number: f64,
    /// Whether that I was measured.
    pub inside_valid_i: bool,
    /// Relative L2 error against the exact profile of the same law.
    pub velocity_error: f64,
    /// Wall time [s].
    pub wall_s: f64,
    /// Heights [m].
    pub z: Vec<f64>,
    /// Velocity [m/s].
    pub u: Vec<f64>,
    /// Pressure [Pa].
    pub p: Vec<f64>,
    /// Exact velocity [m/s].
    pub exact_u: Vec<f64>,
}

/// A point (I, μ, φ) of the same material from another code.
#[derive(Clone, Copy, Debug)]
pub struct PeerPoint {
    /// I.
    pub inertial_number: f64,
    /// |τ|/p.
    pub friction: f64,
    /// |τ|/σ_zz.
    pub friction_zz: f64,
    /// φ.
    pub solid_fraction: f64,
    /// Which code and deck.
    pub source: &'static str,
}

/// The moderate material at 33 degrees by LAMMPS: same grains, box and scaled stiffness.
const LAMMPS: PeerPoint = PeerPoint {
    inertial_number: 0.251,
    friction: 0.642,
    friction_zz: 0.603,
    solid_fraction: 0.506,
    source: "LAMMPS 22 Jul 2025, pair granular, own deck, 33 degrees",
};

impl Campaign {
    /// Reads the campaign of a run directory, if it holds one.
    pub fn read(directory: &Path) -> Option<Campaign> {
        let text = std::fs::read_to_string(directory.join(CAMPAIGN)).ok()?;
        serde_json::from_str(&text).ok()
    }

    /// The other code's point for a scene.
    pub fn peer(&self, scene: &str) -> Option<PeerPoint> {
        (scene == "incline-moderate").then_some(LAMMPS)
    }

    /// Measured flows with a profile.
    fn flows(&self) -> impl Iterator<Item = &InclineResult> {
        self.result
            .runs
            .iter()
            .filter(|r| r.purpose == Purpose::Measure && r.profile.is_some())
    }
}

/// All sections of the report.
pub fn sections(record: &Record, campaign: &Campaign) -> Markup {
    let result = &campaign.result;
    let good = result.verdict.good;
    html! {
        div.verdict.good[good].bad[!good] {
            p { strong { @if good { "Well described by μ(I)." } @else { "Not well described by μ(I), or not yet." } } }
            @for sentence in sentences(&result.verdict.text) { p { (sentence) } }
        }
        (law(record, campaign))
        (angles(campaign))
        (profiles(campaign))
        (continuum(campaign))
        (thesis(record, campaign))
        (results(&record.summary))
    }
}

/// The verdict, cut where a sentence ends and another begins.
fn sentences(text: &str) -> Vec<String> {
    let mut list: Vec<String> = Vec::new();
    for part in text.split(". ") {
        let part = part.trim_end_matches('.');
        if !part.is_empty() {
            list.push(format!("{part}."));
        }
    }
    list
}

fn law(record: &Record, campaign: &Campaign) -> Markup {
    let result = &campaign.result;
    let peer = campaign.peer(&record.summary.scene);
    let mut plot = Plot::new("inertial number I", "friction μ = |τ|/p");
    let mut fraction = Plot::new("inertial number I", "solid fraction φ");
    for (colour, run) in campaign.flows().enumerate() {
        let points = &run.points;
        let label = format!("{}°", run.slope_degrees);
        plot = plot
            .with(
                &label,
                Mark::Dots,
                colour,
                points
                    .iter()
                    .map(|p| (p.inertial_number, p.friction))
                    .collect(),
            )
            .with_errors(points.iter().map(|p| p.friction_error).collect());
        fraction = fraction
            .with(
                &label,
                Mark::Dots,
                colour,
                points
                    .iter()
                    .map(|p| (p.inertial_number, p.solid_fraction))
                    .collect(),
            )
            .with_errors(points.iter().map(|p| p.solid_fraction_error).collect());
    }
    if let Some(fit) = &result.fit {
        let (low, high) = (0.7 * fit.valid_i[0], 1.15 * fit.valid_i[1]);
        let grid: Vec<f64> = (0..=80)
            .map(|k| low + (high - low) * f64::from(k) / 80.0)
            .collect();
        let band: Vec<(f64, (f64, f64))> = grid.iter().map(|i| (*i, fit.band(*i))).collect();
        plot.bands.push(Band {
            colour: 6,
            points: band.iter().map(|(i, (m, e))| (*i, m - e, m + e)).collect(),
        });
        plot = plot.with(
            "fit ± 1 σ",
            Mark::Line,
            6,
            band.iter().map(|(i, (m, _))| (*i, *m)).collect(),
        );
        if let Some(law) = &fit.solid_fraction_of_i {
            let line = grid
                .iter()
                .map(|i| (*i, law.intercept - law.slope * i))
                .collect();
            fraction = fraction.with("φ(I), linear", Mark::Line, 6, line);
        }
    }
    if let Some(peer) = peer {
        plot = plot.with(
            "LAMMPS",
            Mark::Rings,
            5,
            vec![(peer.inertial_number, peer.friction)],
        );
        fraction = fraction.with(
            "LAMMPS",
            Mark::Rings,
            5,
            vec![(peer.inertial_number, peer.solid_fraction)],
        );
    }
    html! {
        h2 { "The law" }
        p {
            "μ(I) = μ_s + (μ_2 − μ_s)/(1 + I_0/I), fitted by weighted least squares to the layers of all usable flows, "
            "without those near the base and the surface. Standard errors include that layers of one flow are not independent."
        }
        div.figures {
            (figure(&plot.svg(WIDTH, HEIGHT), "Friction against inertial number; each colour is one slope."))
            (figure(&fraction.svg(WIDTH, HEIGHT), "Solid fraction against inertial number."))
        }
        div.wide { table {
            tr { th { "fit" } th { "μ_s" } th { "μ_2" } th { "I_0" } th { "χ²/ν" } th { "measured I" } }
            (fit_row("|τ|/p, p = trace/3", &result.fit))
            (fit_row("|τ|/σ_zz", &result.fit_zz))
            (fit_row("tan θ", &result.fit_slope))
        } }
        @if let Some(peer) = peer { (peer_table(campaign, peer)) }
    }
}

fn fit_row(name: &str, fit: &Option<MuIFit>) -> Markup {
    html! {
        @match fit {
            Some(f) => tr {
                td { (name) }
                td { (with_error(f.mu_s, f.mu_s_error)) }
                td { (with_error(f.mu_2, f.mu_2_error)) }
                td { (with_error(f.i_0, f.i_0_error)) }
                td { (number(f.chi_square / f.degrees_of_freedom.max(1) as f64)) }
                td { (format!("{:.3} – {:.3}", f.valid_i[0], f.valid_i[1])) }
            },
            None => tr { td { (name) } td colspan="5" { "no fit" } },
        }
    }
}

fn peer_table(campaign: &Campaign, peer: PeerPoint) -> Markup {
    let at = |fit: &Option<MuIFit>| fit.as_ref().map(|f| f.band(peer.inertial_number));
    let fraction = campaign
        .result
        .fit
        .as_ref()
        .and_then(|f| f.solid_fraction_of_i.as_ref())
        .map(|law| law.intercept - law.slope * peer.inertial_number);
    let rows = [
        ("|τ|/p", at(&campaign.result.fit), peer.friction),
        ("|τ|/σ_zz", at(&campaign.result.fit_zz), peer.friction_zz),
        ("φ", fraction.map(|f| (f, 0.0)), peer.solid_fraction),
    ];
    html! {
        h3 { "Beside another code" }
        p { (peer.source) ", at I = " (peer.inertial_number) "." }
        table {
            tr { th { "" } th { "ours" } th { "theirs" } th { "difference" } }
            @for (name, ours, theirs) in rows {
                @if let Some((value, error)) = ours {
                    tr {
                        td { (name) }
                        td { (with_error(value, error)) }
                        td { (number(theirs)) }
                        td { (format!("{:+.1} %", 100.0 * (value / theirs - 1.0))) }
                    }
                }
            }
        }
    }
}

fn angles(campaign: &Campaign) -> Markup {
    let result = &campaign.result;
    let mut runs: Vec<&InclineResult> = result.runs.iter().collect();
    runs.sort_by(|a, b| a.slope_degrees.total_cmp(&b.slope_degrees));
    let mut energy = Plot::new("time t [s]", "kinetic energy [J]");
    energy.y_log = true;
    for (colour, run) in campaign.flows().enumerate() {
        let points = run
            .series
            .iter()
            .map(|p| (p.time, p.kinetic_energy))
            .collect();
        energy = energy.with(
            &format!("{}°", run.slope_degrees),
            Mark::Line,
            colour,
            points,
        );
    }
    let mut searches = Plot::new("time t [s]", "mean velocity [m/s]");
    for (colour, run) in runs
        .iter()
        .filter(|r| r.purpose != Purpose::Measure)
        .enumerate()
    {
        let rest = matches!(run.start, Start::Rest);
        let points = run
            .series
            .iter()
            .map(|p| (p.time, p.mean_velocity))
            .collect();
        let label = format!(
            "{:.2}° {}",
            run.slope_degrees,
            if rest { "rest" } else { "flow" }
        );
        searches = searches.with(
            &label,
            if rest { Mark::Dashes } else { Mark::Line },
            colour,
            points,
        );
    }
    let bracket = |b: Option<(f64, f64)>| match b {
        Some((low, high)) => format!("between {low:.2}° and {high:.2}°"),
        None => "outside the angles tried".to_owned(),
    };
    html! {
        h2 { "Angles tried" }
        p {
            "A flow stops " strong { (bracket(result.stop_bracket_degrees)) }
            "; a bed at rest sets off " strong { (bracket(result.onset_bracket_degrees)) } "."
        }
        div.wide { table {
            tr {
                th { "slope" } th { "start" } th { "purpose" } th { "moves" } th { "state" }
                th { "mean velocity [m/s]" } th { "drift" } th { "σ_zz/weight − 1" } th { "overlap/R" }
                th { "grain-steps" }
            }
            @for run in &runs {
                tr {
                    td { (format!("{:.2}°", run.slope_degrees)) }
                    td { @match run.start { Start::Rest => "rest", Start::Flow { .. } => "flow" } }
                    td { @match run.purpose { Purpose::Measure => "measure", Purpose::StopSearch => "stop", Purpose::OnsetSearch => "onset" } }
                    td { @if run.flows() { span.tag.good { "flow" } } @else { span.tag { "no flow" } } }
                    td { (outcome(run.outcome)) }
                    td { (with_error(run.steady.mean, run.steady.mean_error)) }
                    td { (format!("{:+.1} %", 100.0 * run.steady.drift)) }
                    td { @if let Some(c) = &run.checks { (format!("{:.2} %", 100.0 * c.weight_relative)) } @else { "–" } }
                    td { (number(run.largest_overlap)) }
                    td { (format!("{:.2e}", run.cost.grain_steps as f64)) }
                }
            }
        } }
        div.figures {
            (figure(&energy.svg(WIDTH, HEIGHT), "Kinetic energy of the measured flows, translation and rotation."))
            (figure(&searches.svg(WIDTH, HEIGHT), "The searches: started from flow (lines) and from rest (dashes)."))
        }
    }
}

fn outcome(outcome: Outcome) -> &'static str {
    match outcome {
        Outcome::Rest => "at rest",
        Outcome::Steady => "steady",
        Outcome::Accelerating => "gains speed",
        Outcome::Decelerating => "loses speed",
        Outcome::Undecided => "undecided",
    }
}

fn profiles(campaign: &Campaign) -> Markup {
    let mut fraction = Plot::new("solid fraction φ", "height z [m]");
    let mut friction = Plot::new("|τ|/p", "height z [m]");
    let mut inertial = Plot::new("inertial number I", "height z [m]");
    let mut stress = Plot::new("stress σ_zz (lines), |τ| (dashes) [Pa]", "height z [m]");
    for (colour, run) in campaign.flows().enumerate() {
        let Some(profile) = &run.profile else {
            continue;
        };
        let rows: Vec<_> = profile
            .rows
            .iter()
            .filter(|r| r.z > 0.0 && r.z < run.height)
            .collect();
        let label = format!("{}°", run.slope_degrees);
        fraction = fraction.with(
            &label,
            Mark::Line,
            colour,
            rows.iter().map(|r| (r.phi.value, r.z)).collect(),
        );
        friction = friction.with(
            &label,
            Mark::Line,
            colour,
            rows.iter()
                .filter_map(|r| Some((r.mu?.value, r.z)))
                .collect(),
        );
        inertial = inertial.with(
            &label,
            Mark::Line,
            colour,
            rows.iter()
                .filter_map(|r| Some((r.i?.value, r.z)))
                .collect(),
        );
        stress = stress
            .with(
                &label,
                Mark::Line,
                colour,
                rows.iter().map(|r| (r.sigma_zz.value, r.z)).collect(),
            )
            .with(
                "",
                Mark::Dashes,
                colour,
                rows.iter().map(|r| (r.tau.value, r.z)).collect(),
            );
    }
    html! {
        h2 { "Through the depth" }
        div.figures {
            (figure(&stress.svg(WIDTH, HEIGHT), "Measured stress, contact and kinetic parts together."))
            (figure(&fraction.svg(WIDTH, HEIGHT), "Solid fraction."))
            (figure(&inertial.svg(WIDTH, HEIGHT), "Inertial number: uniform in theory."))
            (figure(&friction.svg(WIDTH, HEIGHT), "Friction: uniform in theory."))
        }
    }
}

fn continuum(campaign: &Campaign) -> Markup {
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
                    th { "difference" } th { "error against exact" } th { "wall [s]" }
                }
                @for c in &campaign.comparisons {
                    @let grains = flows.iter().find(|r| r.slope_degrees == c.slope_degrees).map(|r| r.steady.mean);
                    @let mean = c.u.iter().sum::<f64>() / c.u.len().max(1) as f64;
                    tr {
                        td { (c.slope_degrees) "°" }
                        td.text { (friction_name(c.friction)) }
                        td { (number(c.inertial_number)) @if !c.inside_valid_i { " " span.tag.bad { "not measured" } } }
                        td { (number(mean)) }
                        td { @if let Some(g) = grains { (number(g)) } }
                        td { @if let Some(g) = grains { (format!("{:+.1} %", 100.0 * (mean / g - 1.0))) } }
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

fn thesis(record: &Record, campaign: &Campaign) -> Markup {
    let Some(material) = published_material(&record.summary.scene) else {
        return html! {};
    };
    let name = |e: Estimator| match e {
        Estimator::Top => "top",
        Estimator::Mean => "mean",
        Estimator::MinimalResidual => "min(res)",
    };
    html! {
        h2 { "The thesis' Table 2.6 beside ours" }
        p {
            "F. Thuillet (2019) takes stress from the weight and I from the velocity; the rows below do the same with our flows. "
            "Differences are in joint standard errors. Its layer depth, box, stiffness and time step are not printed; ours are in the scene."
        }
        div.wide { table {
            tr { th { "estimator" } th { "" } th { "μ_s" } th { "μ_2" } th { "I_0" } }
            @for fit in &campaign.result.estimators {
                @let published = TABLE_2_6.iter().find(|r| r.material == material && r.estimator == fit.estimator && r.with_phi == fit.with_phi).map(|r| r.row);
                @let label = format!("{}{}", name(fit.estimator), if fit.with_phi { ", with Φ" } else { "" });
                tr.ours {
                    td { (label) } td.text { "ours" }
                    @match (&fit.row, &fit.failure) {
                        (Some(row), _) => (cells(row)),
                        (None, Some(why)) => td.text.wrap colspan="3" { (why) },
                        (None, None) => td colspan="3" { "–" },
                    }
                }
                @if let Some(theirs) = published {
                    tr { td { } td.text { "thesis" } (cells(&theirs)) }
                    @if let Some(ours) = &fit.row {
                        tr { td { } td.text { "difference" } @for d in ours.differences(&theirs) { td { (format!("{d:+.1} σ")) } } }
                    }
                }
            }
        } }
        @if let (Some(fit), Some(theirs)) = (&campaign.result.fit, TABLE_2_6.iter().find(|r| r.material == material && r.estimator == Estimator::Top && r.with_phi)) {
            @let ours = Row { mu_s: [fit.mu_s, fit.mu_s_error], mu_2: [fit.mu_2, fit.mu_2_error], i_0: [fit.i_0, fit.i_0_error] };
            h3 { "The measured-stress fit against “top, with Φ”" }
            table {
                tr { th { "" } th { "μ_s" } th { "μ_2" } th { "I_0" } }
                tr.ours { td { "ours, |τ|/p" } (cells(&ours)) }
                tr { td { "thesis" } (cells(&theirs.row)) }
                tr { td { "difference" } @for d in ours.differences(&theirs.row) { td { (format!("{d:+.1} σ")) } } }
            }
        }
    }
}

fn cells(row: &Row) -> Markup {
    html! { @for [value, error] in [row.mu_s, row.mu_2, row.i_0] { td { (with_error(value, error)) } } }
}
