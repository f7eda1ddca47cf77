//! Columns of grains that run out over terrain, with a continuum beside them or behind.

use crate::command::{SMALL_JOINED_COLUMN, colluvium, succeed, summary, table, value};

fn arguments<'a>(out: &'a str, more: &[&'a str]) -> Vec<&'a str> {
    let mut list = vec!["run", "column-collapse", "--threads", "1", "--out", out];
    for set in SMALL_JOINED_COLUMN.iter().chain(more) {
        list.extend(["--set", set]);
    }
    list
}

/// Half a height down, a little before the column's foot.
const STEP: &str = "terrain.profile=[[0,2],[3.1,2],[3.1,1.5],[6,1.5]]";

/// The same column on a level floor and beside a step: its grains, the continuum beside them and grains joined to a
/// continuum all run farther over the step; the joined ones leave the heap that all grains leave.
#[test]
fn a_column_runs_out_over_a_step() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    let [dem, all, over] = ["model=dem", "grains.packing=all", "grains.packing=over"];
    succeed(folder.path(), &arguments("level", &[dem, all]));
    succeed(folder.path(), &arguments("grains", &[dem, over, STEP]));
    succeed(folder.path(), &arguments("joined", &[over, STEP]));
    let [level, grains, joined] = ["level", "grains", "joined"].map(|name| summary(&at(name)));
    for name in ["runout_scaled", "deposit_height", "time_of_rest"] {
        println!(
            "{name}: {:?}",
            [&level, &grains, &joined].map(|s| s["results"][name]["value"].as_f64())
        );
    }
    let continuum = [&level, &grains].map(|s| value(s, "continuum_runout_scaled"));
    println!("continuum_runout_scaled {continuum:?}");
    let runout = [&level, &grains, &joined].map(|s| value(s, "runout_scaled"));
    assert!(runout[1] > 1.05 * runout[0] && runout[2] > 1.05 * runout[0]);
    assert!(continuum[1] > 1.05 * continuum[0]);
    let heap = |name: &str| {
        let (header, rows) = table(&at(name).join("deposit.csv"));
        assert_eq!(header, ["x", "h", "z_ground"]);
        rows
    };
    let (own, theirs) = (heap("joined"), heap("grains"));
    for row in own.iter().chain(&theirs) {
        let ground = if row[0] > 3.1 { -0.5 } else { 0.0 };
        assert!((row[2] - ground).abs() < 1e-12, "{row:?}");
    }
    let miss: f64 = own
        .iter()
        .zip(&theirs)
        .map(|(a, b)| (a[1] - b[1]).abs())
        .sum();
    let apart = miss / theirs.iter().map(|row| row[1]).sum::<f64>();
    println!("deposits apart: {apart:.4}");
    assert!(apart < 0.06, "{apart}");
    assert!(value(&joined, "ledger_grains") < 1e-10);
    assert!(value(&joined, "ledger_exchange") < 1e-10);
    // No grain has come through the ground.
    let (header, rows) = table(&at("grains").join("profiles.csv"));
    assert_eq!(header, ["t", "x", "h", "z_ground"]);
    let places = theirs.len();
    let area = |rows: &[Vec<f64>]| rows.iter().map(|row| row[2]).sum::<f64>();
    let (first, last) = (area(&rows[..places]), area(&rows[rows.len() - places..]));
    assert!((last / first - 1.0).abs() < 1e-9, "{first} {last}");
}

/// A joint that comes to where its level floor ends says so.
#[test]
fn a_joint_stays_on_level_ground() {
    let folder = tempfile::tempdir().unwrap();
    let near = "terrain.profile=[[0,0],[2.8,0],[2.8,-0.5],[6,-0.5]]";
    let sets = [near, "zones.edge_scaled=1.75"];
    let stopped = colluvium(folder.path(), &arguments("x", &sets));
    let message = String::from_utf8_lossy(&stopped.stderr).into_owned();
    assert_eq!(stopped.status.code(), Some(1), "{message}");
    assert!(
        message.contains("no longer level (2.8 m)") && message.contains("zones.edge_scaled"),
        "{message}"
    );
}

#[test]
fn bad_ground_is_refused_by_key() {
    let folder = tempfile::tempdir().unwrap();
    for (sets, key, allowed) in [
        (
            ["terrain.profile=[[0,0],[2.5,0],[9,-1]]", "model=dem"],
            "terrain.profile",
            "level under the column, up to 2.777",
        ),
        (
            ["terrain.profile=[[0,0],[4,0]]", "model=hybrid"],
            "terrain.profile",
            "the end of the floor",
        ),
        (
            [STEP, "terrain.contact=free-slip"],
            "terrain.contact",
            "no-slip",
        ),
        (
            [STEP, "grains.floor=smooth"],
            "terrain.contact",
            "free-slip",
        ),
    ] {
        let refused = colluvium(folder.path(), &arguments("x", &sets));
        let message = String::from_utf8_lossy(&refused.stderr).into_owned();
        assert_eq!(refused.status.code(), Some(2), "{sets:?}: {message}");
        assert!(
            message.contains(key) && message.contains(allowed),
            "{sets:?}: {message}"
        );
        assert!(!folder.path().join("x").exists());
    }
}
