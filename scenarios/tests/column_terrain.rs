//! Columns of grains that run out over terrain, with a continuum beside them or behind.

use crate::command::{
    FRONT_ON_A_SLOPE, SMALL_JOINED_COLUMN, colluvium, hash, succeed, summary, table, value,
};

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

/// What runs down a slope is a continuum, and grains lie behind it.
#[test]
fn a_front_of_continuum_runs_down_a_slope_as_grains_do() {
    // Deposit 4.5 % apart, place 6.4 % short: as the continuum alone, which runs out by 0.48 of the column's width where grains do by 0.73.
    front_as_grains(FRONT_ON_A_SLOPE, [0.07, 0.08]);
}

/// Over a step, and with a second continuum behind the grains.
#[test]
#[ignore = "half a minute: a wider column, twice"]
fn a_front_of_continuum_runs_over_a_step_as_grains_do() {
    let sets = [
        "aspect=0.25",
        "grid.length_scaled=7",
        "grains.packing=over",
        "zones.x=[0.8, 3.2]",
        "terrain.profile=[[0, 0], [4.2, 0], [4.2, -0.5], [8, -0.5]]",
    ];
    // 6.1 and 1.8 %.
    front_as_grains(&sets, [0.08, 0.03]);
}

/// The face of a cliff of continuum leans out over the terrain.
#[test]
#[ignore = "half a minute"]
fn a_leaning_front_of_continuum_falls_as_grains_do() {
    let sets = [
        "overhang_degrees=15",
        "grid.length_scaled=7",
        "grains.packing=leaning",
        "zones.x=[[0, 1.5]]",
        "terrain.profile=[[0, 0], [3.3, 0], [4.3, -0.3], [8, -0.3]]",
    ];
    // 5.9 and 13.5 %: grains run on down the slope where the continuum, alone too, ends short.
    front_as_grains(&sets, [0.08, 0.15]);
}

/// All grains, this front with one thread and with two, and with nothing exchanged, on the same ground: deposits and places of 99 % of the
/// area are apart by no more than these parts.
fn front_as_grains(sets: &[&str], [most_apart, most_off]: [f64; 2]) {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    let run = |out: &str, more: &[&str], threads: &str| {
        let more: Vec<&str> = sets.iter().chain(more).copied().collect();
        let mut list = arguments(out, &more);
        if let Some(count) = list.iter().position(|word| *word == "--threads") {
            list[count + 1] = threads;
        }
        succeed(folder.path(), &list);
    };
    run("grains", &["model=dem", "grains.calibrated=none"], "1");
    run("joined", &[], "1");
    run("two", &[], "2");
    run("control", &["overlap.uncoupled=true"], "1");
    assert_eq!(hash(&at("joined")), hash(&at("two")));
    let [grains, joined, control] = ["grains", "joined", "control"].map(|name| summary(&at(name)));
    let heap = |name: &str| table(&at(name).join("deposit.csv"));
    let (header, all) = heap("grains");
    assert_eq!(header, ["x", "h", "z_ground"]);
    let apart = |name: &str| {
        let (own_header, own) = heap(name);
        assert_eq!(own_header, header);
        let pairs = own.iter().zip(&all);
        assert!(pairs.clone().all(|(a, b)| a[2] == b[2]));
        let miss: f64 = pairs.map(|(a, b)| (a[1] - b[1]).abs()).sum();
        miss / all.iter().map(|row| row[1]).sum::<f64>()
    };
    let (joint, without) = (apart("joined"), apart("control"));
    println!("deposits apart: joined {joint:.4}, nothing exchanged {without:.4}");
    for name in ["x_front", "x_of_share", "deposit_height", "time_of_rest"] {
        let all = [&grains, &joined, &control].map(|s| s["results"][name]["value"].as_f64());
        println!("{name}: grains, joined, control {all:?}");
    }
    for name in [
        "handshake_mass",
        "ledger_grains",
        "ledger_exchange",
        "grain_steps_share",
        "impulse_continuum_walls_x",
        "impulse_continuum_walls_z",
    ] {
        println!("{name}: {:.3e}", value(&joined, name));
    }
    let cost = ["grains", "joined"].map(|name| summary(&at(name))["cost"].clone());
    println!(
        "cost: {:?}",
        cost.map(|c| (c["grain_steps"].clone(), c["wall_s"].clone()))
    );
    let place = value(&joined, "x_of_share") / value(&grains, "x_of_share");
    println!("place of 99 % of the area: {place:.4} of that of grains");
    assert!(
        joint < most_apart && without > 2.0 * joint,
        "{joint} {without}"
    );
    assert!((place - 1.0).abs() < most_off, "{place}");
    let escaped = |found: &serde_json::Value| {
        let all = found["results"].as_object().unwrap().iter();
        let own = all.filter(|(name, _)| name.ends_with("grains_escaped"));
        own.map(|(_, found)| found["value"].as_f64().unwrap())
            .sum::<f64>()
    };
    let [own, without] = [escaped(&joined), escaped(&control)];
    println!("grains escaped: joined {own}, nothing exchanged {without}");
    assert!(own < 0.1 * without, "{own} {without}");
    for name in ["ledger_grains", "ledger_exchange"] {
        assert!(value(&joined, name) < 1e-10, "{name}");
    }
    assert!(value(&joined, "handshake_mass").abs() < 0.02);
    assert!(value(&joined, "ledger_volume").abs() < 1e-11);
    // The front has come down from where the column stood.
    let level = all[0][2];
    let reached = all.iter().filter(|row| row[1] > 0.05).map(|row| row[2]);
    assert!(reached.fold(level, f64::min) < level - 0.1);
}

/// The plan says where a front of continuum runs out.
#[test]
fn the_plan_knows_the_ground_of_a_front() {
    let folder = tempfile::tempdir().unwrap();
    let mut plan = vec!["plan", "column-collapse"];
    for set in SMALL_JOINED_COLUMN.iter().chain(FRONT_ON_A_SLOPE) {
        plan.extend(["--set", set]);
    }
    let said = succeed(folder.path(), &plan);
    for word in [
        "beyond 1.5000 m is a continuum, which runs out over the terrain",
        "with the column's front, over the terrain",
        "the line of terrain.profile, for grains and continuum, level up to x = 3.0000 m, from z = -0.5500 to 0.0000 m",
    ] {
        assert!(said.contains(word), "{word}: {said}");
    }
}

/// A joint that comes to where its level floor ends says so.
#[test]
fn a_joint_stays_on_level_ground() {
    let folder = tempfile::tempdir().unwrap();
    let near = "terrain.profile=[[0,0],[2.8,0],[2.8,-0.5],[6,-0.5]]";
    for (zones, words) in [
        (
            "zones.edge_scaled=1.777",
            ["begin farther back", "zones.edge_scaled"],
        ),
        ("zones.x=[[0, 2.4]]", ["end farther back", "zones.x"]),
    ] {
        let stopped = colluvium(folder.path(), &arguments("x", &[near, zones]));
        let message = String::from_utf8_lossy(&stopped.stderr).into_owned();
        assert_eq!(stopped.status.code(), Some(1), "{message}");
        assert!(message.contains("no longer level (2.8 m)"), "{message}");
        assert!(words.iter().all(|word| message.contains(word)), "{message}");
        std::fs::remove_dir_all(folder.path().join("x")).unwrap();
    }
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
        (
            [
                "terrain.profile=[[0,0],[2.5,0],[9,-1]]",
                "zones.x=[[0, 1.5]]",
            ],
            "terrain.profile",
            "level under the column, up to 2.777",
        ),
        (
            [
                "terrain.profile=[[0,0],[3,0],[3,-900000],[9,-900000]]",
                "zones.x=[[0, 1.5]]",
            ],
            "grid.cells",
            "so many that there are at most",
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
