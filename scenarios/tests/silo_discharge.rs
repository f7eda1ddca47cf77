//! A silo that runs out as a continuum, from the command line.

use crate::command::{
    colluvium, shares_say_what_the_summary_says, steps_say_what_the_summary_says, succeed, summary,
    table, value,
};
use colluvium::vtkhdf;

/// Under μ(I) the rate is constant until the silo is nearly empty, and what has left is what is missing; without friction (control) it
/// falls. The whole silo runs out as half of it does.
#[test]
fn silos_run_out_at_a_constant_rate() {
    let folder = tempfile::tempdir().unwrap();
    let run = |out: &str, sets: &[&str]| {
        let mut list = vec!["run", "silo-discharge", "--out", out];
        let small = ["scale=0.5", "duration_scaled=7"];
        for set in small.iter().chain(sets) {
            list.extend(["--set", set]);
        }
        succeed(folder.path(), &list);
        let found = summary(&folder.path().join(out));
        assert_eq!(found["status"], "done");
        assert!(value(&found, "volume_error").abs() < 1e-13);
        found
    };
    let grains = run("grains", &[]);
    let change = value(&grains, "rate_change");
    assert!(change.abs() < 0.02, "{change}");
    let scaled = value(&grains, "rate_scaled");
    assert!((1.2..1.6).contains(&scaled), "{scaled}");
    let unit = 9.81_f64.sqrt() * 0.0225_f64.powf(1.5);
    assert!((value(&grains, "rate") / unit / scaled - 1.0).abs() < 1e-12);

    let fluid = run(
        "fluid",
        &[
            "rheology.mu_s=0",
            "rheology.mu_2=1e-6",
            "walls.contact=free-slip",
            "floor.contact=free-slip",
            "height=0.18",
        ],
    );
    let change = value(&fluid, "rate_change");
    assert!(change < -0.04, "{change}");
    let whole = run("whole", &["grid.whole=true", "duration_scaled=2"]);
    // Too short for a steady rate.
    assert!(whole["results"]["rate"]["value"].is_null());

    let at = |out: &str, name: &str| folder.path().join(out).join(name);
    let (header, rows) = table(&at("grains", "discharge.csv"));
    assert_eq!(header, ["t", "volume", "discharged", "rate"]);
    assert!(rows[0][3].is_nan());
    for row in &rows {
        assert!((row[1] + row[2] - 0.09 * 0.09).abs() < 1e-15, "{row:?}");
    }
    let discharged = |out: &str, time: f64| {
        let (_, rows) = table(&at(out, "discharge.csv"));
        let after = rows.iter().position(|row| row[0] >= time).unwrap();
        let (a, b) = (&rows[after - 1], &rows[after]);
        a[2] + (time - a[0]) / (b[0] - a[0]) * (b[2] - a[2])
    };
    let time = 1.9 * (0.0225_f64 / 9.81).sqrt();
    let [half, all] = ["grains", "whole"].map(|out| discharged(out, time));
    assert!((half / all - 1.0).abs() < 5e-3, "{half} {all}");
    steps_say_what_the_summary_says(&folder.path().join("grains"));
    shares_say_what_the_summary_says(&folder.path().join("grains"));
    let report = std::fs::read_to_string(at("grains", "report.html")).unwrap();
    assert!(report.contains("runs out per time") && report.contains("what has left it"));
    let frames = vtkhdf::read_series(&at("whole", "fields.vtkhdf")).unwrap();
    assert!(frames.len() > 5 && frames[0].scalars("pressure").unwrap().len() == 16 * 16);
}

#[test]
fn silos_are_planned_and_bad_ones_refused_by_key() {
    let folder = tempfile::tempdir().unwrap();
    let wall = "walls={contact=\"coulomb\",friction=0.3}";
    let planned = colluvium(folder.path(), &["plan", "silo-discharge", "--set", wall]);
    let planned = String::from_utf8_lossy(&planned.stdout).into_owned();
    assert!(
        planned.contains("runs out of a slot of 0.0225 m (22.5")
            && planned.contains("friction coefficient 0.3")
            && planned.contains("cell-steps"),
        "{planned}"
    );
    for (set, key, allowed) in [
        ("outlet=0.1", "outlet", "at most the width"),
        ("outlet=0", "outlet", "(0, 100000]"),
        ("width=0.1", "width", "whole cells"),
        ("grid.cells=2", "grid.cells", "4"),
        ("grid.cells=7", "grid.cells", "even"),
        ("scale=0.25", "grid.cells", "at least 4"),
        ("grid.cells=1000", "grid.cells", "at most 200000"),
        ("height=0.005", "height", "at least"),
        ("walls.contact=coulomb", "walls.friction", "coulomb"),
        ("floor.friction=0.3", "floor.friction", "left out"),
        ("rheology.mu_s=-1", "rheology.mu_s", "0"),
        ("solver.courant=2", "solver.courant", "1"),
        ("openings=3", "openings", "outlet"),
    ] {
        let arguments = ["run", "silo-discharge", "--out", "x", "--set", set];
        let refused = colluvium(folder.path(), &arguments);
        assert_eq!(refused.status.code(), Some(2), "{set}");
        let message = String::from_utf8_lossy(&refused.stderr).into_owned();
        assert!(
            message.contains(key) && message.contains(allowed),
            "{set}: {message}"
        );
        assert!(!folder.path().join("x").exists());
    }
}
