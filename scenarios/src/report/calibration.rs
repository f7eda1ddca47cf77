//! The report of a calibration.

mod continuum;
mod evidence;
mod thesis;

use super::page::{figure, number, with_error};
use super::plot::{Band, Mark, Plot};
use super::{Record, results};
use crate::calibrate::{CAMPAIGN, published_material};
pub use crate::rheology_file::FrictionOf;
use crate::scene::Scene;
use colluvium_coupling::calibration::MuIFit;
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
    /// Gravity (m/s²).
    pub gravity: f64,
    /// Mean diameter (m).
    pub diameter: f64,
}

/// A continuum layer at the slope and depth of one flow of grains.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Comparison {
    /// Slope (degrees).
    pub slope_degrees: f64,
    /// Which fit it was given.
    pub friction: FrictionOf,
    /// I of its steady flow.
    pub inertial_number: f64,
    /// Whether that I was measured.
    pub inside_valid_i: bool,
    /// Relative L2 error against the exact profile of the same law.
    pub velocity_error: f64,
    /// Wall time (s).
    pub wall_s: f64,
    /// Heights (m).
    pub z: Vec<f64>,
    /// Velocity (m/s).
    pub u: Vec<f64>,
    /// Pressure (Pa).
    pub p: Vec<f64>,
    /// Exact velocity (m/s).
    pub exact_u: Vec<f64>,
    /// Quantiles 0.025, 0.16, 0.5, 0.84 and 0.975 of the velocity over that of the best law, from the posterior and from
    /// how far flows lie off the law.
    #[serde(default)]
    pub band: Option<[f64; 5]>,
    /// The grains' velocity, mean over the height of their flow (m/s).
    #[serde(default)]
    pub grains_u: Option<f64>,
    /// The stress ratio that momentum asks of the grains' bulk: tan θ, less what accelerates them.
    #[serde(default)]
    pub tangent: Option<f64>,
    /// Mean velocity of the bulk above that of its foot, by the continuum and by the grains (m/s).
    #[serde(default)]
    pub gains: Option<[f64; 2]>,
    /// The continuum over the grains, less 1, with one cause after another taken out.
    #[serde(default)]
    pub causes: Vec<(String, f64)>,
}

impl Comparison {
    /// The continuum's velocity over the grains', less 1, above the foot of the bulk where that is known; and whether the
    /// grains' lies within 68 and 95 % of what posterior and discrepancy allow.
    pub fn against_grains(&self) -> Option<(f64, [bool; 2])> {
        let [mean, grains] = match self.gains {
            Some(gains) => gains,
            None => [
                self.u.iter().sum::<f64>() / self.u.len().max(1) as f64,
                self.grains_u?,
            ],
        };
        if !(grains > 0.0 && mean > 0.0) {
            return None;
        }
        let truth = grains / mean;
        let within = |low: usize, high: usize| {
            self.band
                .is_some_and(|b| (b[low]..=b[high]).contains(&truth))
        };
        Some((mean / grains - 1.0, [within(1, 3), within(0, 4)]))
    }
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
    pub fn peer(&self, scene: &Scene) -> Option<PeerPoint> {
        (published_material(scene) == Some("moderate")).then_some(LAMMPS)
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
        (evidence::evidence(campaign))
        (angles(campaign))
        (profiles(campaign))
        (continuum::continuum(campaign))
        (thesis::thesis(record, campaign))
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
    let peer = record.resolved().and_then(|s| campaign.peer(&s));
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
                th { "slope" } th { "bed" } th { "start" } th { "purpose" } th { "moves" } th { "state" }
                th { "mean velocity [m/s]" } th { "drift" } th { "σ_zz/weight − 1" } th { "overlap/R" }
                th { "grain-steps" }
            }
            @for run in &runs {
                tr {
                    td { (format!("{:.2}°", run.slope_degrees)) }
                    td { (run.bed + 1) }
                    td { @match run.start { Start::Rest => "rest", Start::Flow { .. } => "flow" } }
                    td { @match run.purpose { Purpose::Measure => "measure", Purpose::StopSearch => "stop", Purpose::OnsetSearch => "onset" } }
                    td { @if run.flows() { span.tag.good { "flow" } } @else { span.tag { "no flow" } } }
                    td { @match run.unsettled() { Some(why) => (why.words()), None => (outcome(run.outcome)) } }
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
