//! A slope in three ways: grains, continuum, and both joined; what of the error is the model's and what the coupling's.

use super::{Check, Found, Options};
use crate::failure::Failure;
use crate::report::page::figure;
use crate::report::plot::{Mark, Plot};
use crate::run::{self, RunOptions};
use crate::scene::{Scene, SceneBody};
use crate::summary::Summary;
use crate::table::Table;
use crate::{report, run_directory};
use maud::{Markup, html};

/// Runs: folder and what is set.
const RUNS: [(&str, &[&str]); 4] = [
    ("dem", &["model=dem"]),
    ("continuum", &["model=continuum"]),
    ("hybrid", &["model=hybrid"]),
    ("uncoupled", &["model=hybrid", "overlap.uncoupled=true"]),
];

/// Shorter than the scene, and softer: half as many steps.
const SHORT: [&str; 1] = ["contact.stiffness_scaled=5e3"];

/// Layers at the base and below the surface that are of their own, in diameters.
const BASE: f64 = 3.0;
const SURFACE: f64 = 3.0;

/// What is compared: column, name, and how far a joined run may be off. One run's u scatters by 3–5 %, its stresses by 1 %.
const FIGURES: [(&str, &str, f64); 3] = [
    ("u", "velocity", 0.12),
    ("sigma_zz", "normal stress", 0.04),
    ("tau", "shear stress", 0.05),
];

/// A finished run.
struct Ran {
    profile: Table,
    summary: Summary,
}

pub(super) fn run(options: &Options) -> Result<Found, Failure> {
    let mut found = Found::default();
    let mut runs = Vec::new();
    let mut diameter = 0.0;
    for (name, own) in RUNS {
        let own = SHORT.iter().chain(own).map(|s| (*s).to_owned());
        let set: Vec<String> = own.chain(options.set.clone()).collect();
        let scene = Scene::load("incline", &set)?;
        if let SceneBody::Incline(body) = &scene.body {
            diameter = body.grains.diameter;
        }
        let out = options.out.join("overlap").join(name);
        let ended = run::run(
            &scene,
            &RunOptions {
                resume: run_directory::is_run(&out),
                out: Some(out.clone()),
                threads: options.threads,
                ..RunOptions::default()
            },
        )?;
        found.reports.push(format!("overlap/{name}/report.html"));
        let profile = Table::from_csv(&out.join("profile.csv"))
            .map_err(|error| Failure::Run(format!("{}: {error}", out.display())))?;
        runs.push(Ran {
            summary: report::read_summary(&ended.directory)?,
            profile,
        });
    }
    let [dem, continuum, hybrid, uncoupled] = &runs[..] else {
        return Err(Failure::Run("a run is missing".into()));
    };
    judge(&mut found, diameter, [dem, continuum, hybrid, uncoupled]);
    Ok(found)
}

/// The value of a result.
fn value(run: &Ran, name: &str) -> f64 {
    let result = run.summary.results.get(name);
    result.and_then(|q| q.value).unwrap_or(f64::NAN)
}

fn judge(found: &mut Found, diameter: f64, [dem, continuum, hybrid, uncoupled]: [&Ran; 4]) {
    let top = value(dem, "height") - SURFACE * diameter;
    let handshake = value(hybrid, "height_handshake");
    let base = BASE * diameter;
    let zones = [
        ("below m", [base, handshake]),
        ("above m", [handshake, top]),
    ];
    let check = |case: &str, what: String, value: f64, allowed: Option<f64>, source: &str| Check {
        case: case.into(),
        what,
        value,
        error: None,
        reference: 0.0,
        reference_error: None,
        allowed,
        source: source.into(),
    };
    for (case, run, judged, source) in [
        (
            "hybrid",
            hybrid,
            true,
            "full grains: error of coupling and, above m, of the law",
        ),
        (
            "continuum",
            continuum,
            false,
            "full grains: error of the law",
        ),
    ] {
        for (column, name, most) in FIGURES {
            for (zone, range) in zones {
                let error = difference(&run.profile, &dem.profile, column, range);
                // Above m the hybrid inherits what the law lacks.
                let most = (judged && zone == "below m").then_some(most);
                found.checks.push(check(
                    case,
                    format!("{name}, {zone}, L2"),
                    error,
                    most,
                    source,
                ));
            }
        }
    }
    for (name, most) in [
        ("slip", 0.01),
        ("relaxation_share", 0.1),
        ("grains_escaped", 0.5),
    ] {
        let source = "monitors of the overlap";
        found.checks.push(check(
            "hybrid",
            name.replace('_', " "),
            value(hybrid, name),
            Some(most),
            source,
        ));
    }
    for name in ["shear_ratio", "pressure_ratio"] {
        let less = value(hybrid, name) - 1.0;
        let what = format!("{}, less 1", name.replace('_', " "));
        found.checks.push(check(
            "hybrid",
            what,
            less,
            Some(0.05),
            "monitors of the overlap",
        ));
    }
    for name in ["ledger_grains", "ledger_continuum"] {
        let what = name.replace('_', ", ");
        found.checks.push(check(
            "hybrid",
            what,
            value(hybrid, name),
            Some(1e-10),
            "conservation",
        ));
    }
    // Without exchange the same thresholds must be missed.
    let missed = FIGURES.iter().filter(|(column, _, most)| {
        let error = difference(&uncoupled.profile, &dem.profile, column, zones[0].1);
        error.is_nan() || error > *most
    });
    found.checks.push(Check {
        reference: FIGURES.len() as f64,
        ..check(
            "uncoupled",
            "figures below m outside their limits".into(),
            missed.count() as f64,
            Some(0.0),
            "negative control: nothing exchanged",
        )
    });
    let flow = |run: &Ran| run.summary.cost.grain_steps as f64 - settling(run);
    found.remarks.push(format!(
        "Grain-steps of the flow, hybrid over full grains: {:.3}; wall time with the settling of the beds: {:.3}.",
        flow(hybrid) / flow(dem),
        hybrid.summary.cost.wall_s / dem.summary.cost.wall_s
    ));
    found
        .sections
        .push(pictures([dem, continuum, hybrid, uncoupled], handshake));
}

/// Grain-steps of the settling of a bed, where a run tells.
fn settling(run: &Ran) -> f64 {
    run.summary
        .results
        .get("grain_steps_settling")
        .and_then(|q| q.value)
        .unwrap_or(0.0)
}

/// Relative L2 difference of a column at the reference's heights within a range.
fn difference(run: &Table, reference: &Table, column: &str, [low, high]: [f64; 2]) -> f64 {
    let ours = run.pairs("z", column);
    let mut sums = [0.0; 2];
    for (z, right) in reference.pairs("z", column) {
        if z < low || z > high {
            continue;
        }
        let Some(value) = at(&ours, z) else {
            return f64::NAN;
        };
        sums[0] += (value - right) * (value - right);
        sums[1] += right * right;
    }
    (sums[0] / sums[1]).sqrt()
}

/// Linear interpolation in points of rising z; none outside of them.
fn at(points: &[(f64, f64)], z: f64) -> Option<f64> {
    let after = points.iter().position(|p| p.0 >= z)?;
    let (z1, y1) = points[after];
    if z1 == z {
        return Some(y1);
    }
    let (z0, y0) = *points.get(after.checked_sub(1)?)?;
    Some(y0 + (y1 - y0) * (z - z0) / (z1 - z0))
}

fn pictures([dem, continuum, hybrid, uncoupled]: [&Ran; 4], handshake: f64) -> Markup {
    let plot = |column: &str, label: &str| {
        let points = |run: &Ran| run.profile.pairs(column, "z");
        let widest = points(dem).iter().fold(0.0_f64, |most, p| most.max(p.0));
        Plot::new(label, "height z [m]")
            .with("grains", Mark::Dots, 0, points(dem))
            .with("continuum", Mark::Line, 1, points(continuum))
            .with("hybrid", Mark::Line, 2, points(hybrid))
            .with("nothing exchanged", Mark::Dashes, 6, points(uncoupled))
            .with(
                "m",
                Mark::Dashes,
                3,
                vec![(0.0, handshake), (widest, handshake)],
            )
            .svg(560, 400)
    };
    html! {
        div.figures {
            (figure(&plot("u", "velocity u [m/s]"), "Velocity; grains below m and continuum above it."))
            (figure(&plot("tau", "|τ| [Pa]"), "Shear stress."))
        }
    }
}
