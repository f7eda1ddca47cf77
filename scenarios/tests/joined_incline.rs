//! The scene `incline` as grains, continuum and both: the same start and time, tables, monitors, threads and restarts.

use crate::command::{SMALL_HYBRID, hash, succeed, summary, table, value};
use std::path::Path;

fn run(folder: &Path, out: &str, more: &[&str]) {
    let mut arguments = vec!["run", "incline", "--out", out];
    for set in SMALL_HYBRID {
        arguments.extend(["--set", set]);
    }
    arguments.extend(more);
    succeed(folder, &arguments);
}

fn column(path: &Path, name: &str) -> Vec<f64> {
    let (header, rows) = table(path);
    let at = header.iter().position(|h| h == name).unwrap();
    rows.iter().map(|row| row[at]).collect()
}

/// Largest value of a column at or below a height.
fn greatest(path: &Path, name: &str, below: f64) -> f64 {
    let heights = column(path, "z");
    let rows = heights.iter().zip(column(path, name));
    rows.filter(|(z, x)| **z < below && x.is_finite())
        .fold(0.0, |most, (_, x)| most.max(x))
}

#[test]
fn three_models_tell_of_one_flow() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    for (name, more) in [
        ("dem", &["--set", "model=dem"][..]),
        ("continuum", &["--set", "model=continuum"]),
        ("hybrid", &["--set", "model=hybrid", "--threads", "1"]),
        ("threads", &["--set", "model=hybrid", "--threads", "2"]),
        ("uncoupled", &["--set", "overlap.uncoupled=true"]),
    ] {
        run(folder.path(), name, more);
    }
    // Any number of threads.
    assert_eq!(hash(&at("hybrid")), hash(&at("threads")));
    let profile = |name: &str| at(name).join("profile.csv");
    assert_eq!(
        std::fs::read(profile("hybrid")).unwrap(),
        std::fs::read(profile("threads")).unwrap()
    );

    // One weight: σ_zz on the base is that of all material whatever it is made of.
    let hybrid = summary(&at("hybrid"));
    let weight = |name: &str| greatest(&profile(name), "sigma_zz", 0.02);
    let grains = weight("dem");
    for name in ["hybrid", "continuum"] {
        assert!(
            (weight(name) / grains - 1.0).abs() < 0.12,
            "{name} {} {grains}",
            weight(name)
        );
    }
    assert!(weight("uncoupled") < 0.8 * grains, "nothing lies on them");

    // Monitors, ledger and heights are told, the overlap is marked.
    assert!(value(&hybrid, "slip").abs() < 0.05);
    assert!((value(&hybrid, "pressure_ratio") - 1.0).abs() < 0.1);
    assert_eq!(value(&hybrid, "grains_escaped"), 0.0);
    assert!(value(&hybrid, "ledger_grains") < 1e-10);
    assert!(value(&hybrid, "ledger_continuum") < 1e-10);
    assert!(hybrid["ledger"]["mass_relative"].as_f64().unwrap() < 1e-12);
    let heights = ["height_inner", "height_handshake", "height_edge", "height"]
        .map(|name| value(&hybrid, name));
    assert!(heights.is_sorted(), "{heights:?}");
    let zones = column(&at("hybrid").join("profile_continuum.csv"), "zone");
    assert!(
        zones.is_sorted() && zones[0] == 1.0 && zones.last() == Some(&3.0),
        "{zones:?}"
    );
    let slip = summary(&at("uncoupled"));
    assert!(
        value(&slip, "slip").abs() > 0.05,
        "{}",
        value(&slip, "slip")
    );
    let text = std::fs::read_to_string(at("hybrid").join("report.html")).unwrap();
    assert!(text.contains("Granular") || text.contains("Temperature of the grains"));

    // Every step of the continuum is told; none had to be cut.
    let steps = |name: &str| column(&at("continuum").join("steps.csv"), name);
    let (times, residuals) = (steps("t"), steps("momentum_residual"));
    let told = summary(&at("continuum"))["model"]["dt_s"].as_f64().unwrap();
    assert!((times.len() as f64 * told / times.last().unwrap() - 1.0).abs() < 1e-9);
    assert_eq!(steps("halvings").iter().sum::<f64>(), 0.0);
    assert_eq!(
        residuals.last(),
        Some(&value(&summary(&at("continuum")), "residual"))
    );

    // All of it flows, and what is ill posed is part of it.
    let told = summary(&at("continuum"));
    let [flows, ill_posed] = ["flowing", "ill_posed"].map(|of| {
        let shares = column(&at("continuum").join("history.csv"), &format!("{of}_share"));
        let most = shares.into_iter().fold(0.0, f64::max);
        assert_eq!(most, value(&told, &format!("largest_{of}_share")));
        most
    });
    assert!(
        flows > 0.99 && (0.0..=flows).contains(&ill_posed),
        "{flows} {ill_posed}"
    );

    // Grains above the edge were never made.
    assert!(value(&hybrid, "grain_steps_share") < 0.75);
    let steps = |name: &str| summary(&at(name))["cost"]["grain_steps"].as_u64().unwrap();
    assert!(steps("hybrid") < steps("dem"));
    assert_eq!(steps("continuum"), 0);
    // An exchange does not end where a run looks at its clock and saves its state.
    assert!(500 % value(&hybrid, "steps_of_an_exchange") as u64 != 0);
}

#[test]
fn a_hybrid_may_begin_as_grains() {
    let folder = tempfile::tempdir().unwrap();
    run(
        folder.path(),
        "later",
        &[
            "--set",
            "overlap.from=0.1",
            "--set",
            "time.average=0.2",
            "--set",
            "time.relax=0.2",
        ],
    );
    let later = summary(&folder.path().join("later"));
    assert!(value(&later, "ledger_grains") < 1e-10);
    assert!(value(&later, "grain_steps_share") < 1.0);
}

#[test]
fn a_plan_prints_what_is_computed() {
    let folder = tempfile::tempdir().unwrap();
    let plan = |model: &str| {
        let set = format!("model={model}");
        let mut arguments = vec!["plan", "incline", "--set", &set];
        for set in SMALL_HYBRID {
            arguments.extend(["--set", set]);
        }
        succeed(folder.path(), &arguments)
    };
    let hybrid = plan("hybrid");
    for word in [
        "overlap.impedance",
        "overlap.load_time",
        "overlap.exchange_time",
        "computed",
        "a = 3.0 d",
        "I = ",
    ] {
        assert!(hybrid.contains(word), "{word}: {hybrid}");
    }
    assert!(plan("continuum").contains("no stability limit"));
    assert!(plan("dem").contains("grains on a rough plane"));
}

#[test]
fn error_against_cost_ends_at_full_grains() {
    let folder = tempfile::tempdir().unwrap();
    let mut arguments = vec![
        "pareto",
        "incline",
        "--vary",
        "overlap.height_diameters=8,11",
        "--vary",
        "overlap.inner_diameters=3,4",
        "--reference",
        "model=dem",
        "--out",
        "p",
    ];
    for set in SMALL_HYBRID {
        arguments.extend(["--set", set]);
    }
    let said = succeed(folder.path(), &arguments);
    assert!(
        said.contains("shear_stress") && said.contains("reference: "),
        "{said}"
    );
    let (header, rows) = table(&folder.path().join("p/pareto.csv"));
    let at = |name: &str| header.iter().position(|h| h == name).unwrap();
    // All combinations, the last key's values changing first.
    assert_eq!(
        header[..2],
        ["overlap.height_diameters", "overlap.inner_diameters"]
    );
    let values: Vec<&[f64]> = rows.iter().map(|row| &row[..2]).collect();
    assert_eq!(values, [[8.0, 3.0], [8.0, 4.0], [11.0, 3.0], [11.0, 4.0]]);
    assert!(rows.iter().any(|row| row[at("on_front")] == 1.0));
    for row in &rows {
        assert!(row[at("error")] > 0.0 && row[at("error")] < 1.0, "{row:?}");
    }
    // More grains, more steps.
    assert!(rows[2][at("grain_and_cell_steps")] > rows[0][at("grain_and_cell_steps")]);
}
