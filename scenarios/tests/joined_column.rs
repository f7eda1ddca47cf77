//! A column that is grains in front and a continuum behind, from the command line.

use crate::command::{
    MOVING_EDGE, SMALL_JOINED_COLUMN, colluvium, hash, succeed, summary, table, value,
};
use crate::packings::JOINED_COLUMN;
use colluvium_coupling::overlap::Reason;
use std::path::Path;

fn arguments<'a>(out: &'a str, more: &[&'a str]) -> Vec<&'a str> {
    let mut list = vec!["run", "column-collapse", "--out", out];
    for set in SMALL_JOINED_COLUMN.iter().chain(more) {
        list.extend(["--set", set]);
    }
    list
}

/// Area below a profile: of the deposit, or of the first instant of profiles (m²).
fn area(folder: &Path, file: &str) -> f64 {
    let (header, rows) = table(&folder.join(file));
    let column = |name: &str| header.iter().position(|h| h == name).unwrap();
    let (x, h) = (column("x"), column("h"));
    let spacing = rows[1][x] - rows[0][x];
    let first = header.iter().position(|h| h == "t");
    let of_first = |row: &&Vec<f64>| first.is_none_or(|t| row[t] == rows[0][t]);
    rows.iter()
        .filter(of_first)
        .map(|row| row[h] * spacing)
        .sum()
}

/// Of the same settled column: all grains, joined with one thread and with two, and with nothing exchanged. The joint
/// runs out as the grains do and keeps all books; what exchanges nothing falls into the gap.
#[test]
fn a_joined_column_collapses_as_its_grains_do() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    JOINED_COLUMN.put(folder.path());
    let [dem, none] = [["model=dem"], ["overlap.uncoupled=true"]];
    succeed(folder.path(), &arguments("grains", &dem));
    let mut one = arguments("joined", &[]);
    one.extend(["--threads", "1"]);
    succeed(folder.path(), &one);
    let mut two = arguments("two", &[]);
    two.extend(["--threads", "2"]);
    succeed(folder.path(), &two);
    assert_eq!(hash(&at("joined")), hash(&at("two")));
    succeed(folder.path(), &arguments("control", &none));
    let forgets = ["overlap.rest_strain=0"];
    succeed(folder.path(), &arguments("forgets", &forgets));

    let [grains, joined, control, forgets] =
        ["grains", "joined", "control", "forgets"].map(|name| summary(&at(name)));
    for name in [
        "x_front",
        "x_of_share",
        "runout_scaled",
        "deposit_height",
        "force_of_grains",
    ] {
        let all = [&grains, &joined, &control, &forgets].map(|s| value(s, name));
        println!(
            "{name}: grains {:.4}, joined {:.4}, nothing exchanged {:.4}, no memory of rest {:.4}",
            all[0], all[1], all[2], all[3]
        );
    }
    for name in [
        "slip",
        "largest_slip",
        "force_ratio",
        "force_of_continuum",
        "rest_ratio",
        "overlap_packing",
        "relaxation_share",
        "grains_escaped",
        "handshake_mass",
        "ledger_grains",
        "ledger_exchange",
        "grain_steps_share",
    ] {
        println!(
            "{name}: joined {:.3e}, control {:.3e}",
            value(&joined, name),
            value(&control, name)
        );
    }
    // Books.
    assert!(value(&joined, "ledger_grains") < 1e-10);
    assert!(value(&joined, "ledger_exchange") < 1e-10);
    assert!(value(&joined, "ledger_volume").abs() < 1e-12);
    assert!(value(&joined, "handshake_mass").abs() < 0.01);
    // The error of mass is that of all of it, not of the continuum's volume alone.
    let mass = joined["ledger"]["mass_relative"].as_f64().unwrap();
    assert!(mass > 0.0 && mass >= value(&joined, "handshake_mass").abs());
    let [before, after] = ["profiles.csv", "deposit.csv"].map(|file| area(&at("joined"), file));
    assert!((after / before - 1.0).abs() < 0.01, "{before} {after}");
    // The same heap as all grains leave, within what two runs of so few grains differ by; without an exchange the
    // continuum's foot and the grains' back fall into each other.
    let heap = |name: &str| table(&at(name).join("deposit.csv")).1;
    let grains_heap = heap("grains");
    let apart = |name: &str| {
        let (own, all) = (heap(name), grains_heap.iter());
        let miss: f64 = own.iter().zip(all).map(|(a, b)| (a[1] - b[1]).abs()).sum();
        miss / grains_heap.iter().map(|row| row[1]).sum::<f64>()
    };
    let (joint, without) = (apart("joined"), apart("control"));
    println!("deposits apart: joined {joint:.4}, nothing exchanged {without:.4}");
    assert!(joint < 0.06 && without > 0.08, "{joint} {without}");
    // Where 99 % of it end: measured -1.6 and -1.3 % in two builds that differ by round-off. The front at the threshold is a matter
    // of single grains, +6.7 and +14 % in these; it is asked for loosely. That of the control, whose grains in front know
    // nothing of it, is as near; the deposit above is what tells them apart.
    let beside = |name: &str| value(&joined, name) / value(&grains, name) - 1.0;
    let fronts = ["x_front", "x_of_share", "deposit_height"].map(beside);
    assert!(fronts[0].abs() < 0.25, "{fronts:?}");
    assert!(
        fronts[1].abs() < 0.05 && fronts[2].abs() < 0.03,
        "{fronts:?}"
    );
    // The monitors tell of temperatures and energies.
    for zone in ["buffer", "inner", "beyond"] {
        assert!(
            value(&joined, &format!("{zone}_temperature")) > 0.0,
            "{zone}"
        );
    }
    let energy = |name: &str| joined["ledger"]["energy"][name].as_f64().unwrap();
    assert!(energy("impedance_J") < 0.0 && energy("relaxation_J").is_finite());
    // What the joint does to the grains that it leaves: they bear what they bear alone.
    let borne = |found| value(found, "force_of_grains") / value(&grains, "force_of_grains");
    let forces = [&joined, &control, &forgets].map(borne);
    println!("forces over those of grains alone: {forces:?}");
    assert!((forces[0] - 1.0).abs() < 0.15, "{forces:?}");
    assert!(forces[1] < 0.6 && forces[2] > 1.2, "{forces:?}");
    assert_eq!(value(&joined, "grains_escaped"), 0.0);
    assert!(value(&control, "grains_escaped") > 10.0);
    assert!(value(&joined, "grain_steps_share") < 0.75);
    let report = std::fs::read_to_string(at("joined").join("report.html")).unwrap();
    assert!(report.contains("handshake"));
}

/// Its edge begins far behind the front and goes out over what rests: whole strips of grains become continuum, every book
/// closes, and two threads give the same bits.
#[test]
fn an_edge_that_moves_hands_grains_over_and_keeps_its_books() {
    let folder = tempfile::tempdir().unwrap();
    JOINED_COLUMN.put(folder.path());
    for threads in ["1", "2"] {
        let mut run = arguments(threads, MOVING_EDGE);
        run.extend(["--threads", threads]);
        succeed(folder.path(), &run);
    }
    let [one, two] = ["1", "2"].map(|name| folder.path().join(name));
    assert_eq!(hash(&one), hash(&two));
    let (header, moves) = table(&one.join("moves.csv"));
    let column = |name: &str| header.iter().position(|h| h == name).unwrap();
    let [mass, grains, edge, reason] = ["mass", "grains", "edge", "reason"].map(column);
    println!("moves: {moves:?}");
    assert!(!moves.is_empty() && moves.iter().all(|row| row[mass] < 0.0));
    // All of them because the grains beside the edge rested.
    let rest = Reason::Rest.number() as f64;
    assert!(moves.iter().all(|row| row[reason] == rest));
    let told = summary(&one)["remarks"].to_string();
    assert!(told.contains(&format!("{} by rest", moves.len())), "{told}");
    let pairs = moves.iter().zip(&moves[1..]);
    for (before, after) in pairs {
        assert!(after[grains] < before[grains]);
        assert!((after[edge] - before[edge] - 0.3).abs() < 1e-9);
    }
    let found = summary(&one);
    // An edge that stayed there would leave 0.59 of the grains.
    assert!(value(&found, "grain_steps_share") < 0.45);
    assert!(value(&found, "handshake_mass").abs() < 0.01);
    assert!(value(&found, "ledger_grains") < 1e-10);
    assert!(value(&found, "ledger_exchange") < 1e-10);
    assert!(value(&found, "ledger_volume").abs() < 1e-12);
}

#[test]
fn bad_joined_columns_are_refused_by_key() {
    let folder = tempfile::tempdir().unwrap();
    for (sets, key, allowed) in [
        (
            &["aspect=1.5", "grains.width_diameters=5"][..],
            "aspect",
            "has no room",
        ),
        (&["zones.edge_scaled=0.1"], "zones.edge_scaled", "[0.3"),
        (
            &["zones.edge_scaled=2.5"],
            "zones.edge_scaled",
            "for this column",
        ),
        (&["zones.edges=1"], "zones.edges", "edge_scaled"),
        (
            &["zones.rest_scaled=1.5"],
            "zones.rest_scaled",
            "some continuum lies behind",
        ),
        (
            &["zones.moving=true", "zones.wake_speed_scaled=0.01"],
            "zones.wake_speed_scaled",
            "above zones.rest_speed_scaled",
        ),
        (&["zones.budget=100"], "zones.budget", "zones.moving"),
        (
            &["zones.fastest_inertial=0.1"],
            "zones.fastest_inertial",
            "zones.moving",
        ),
        (
            &["zones.moving=true", "zones.loosest_scaled=1.5"],
            "zones.loosest_scaled",
            "1",
        ),
        (
            &["zones.edge_scaled=1", "zones.tolerance=0.05"],
            "zones.edge_scaled",
            "the oracle puts the edge",
        ),
        (&["zones.budget=1000"], "zones.budget", "zones.tolerance"),
        (
            &["zones.tolerance=0.05", "overhang_degrees=10"],
            "zones.tolerance",
            "upright column on level ground",
        ),
        (
            &[
                "zones.tolerance=0.05",
                "terrain.profile=[[0,0],[1.5,0],[9,-1]]",
            ],
            "zones.tolerance",
            "upright column on level ground",
        ),
        (
            &["aspect=1", "grains.diameter=0.03", "zones.tolerance=1e-9"],
            "zones.tolerance",
            "at least 0.1",
        ),
        (
            &["overlap.shell_diameters=5"],
            "overlap.shell_diameters",
            "at most the buffer",
        ),
        (
            &["overlap.width=0.6", "overlap.buffer_diameters=3"],
            "overlap.width",
            "left out where overlap.buffer_diameters",
        ),
        (&["overlap.width=0.1"], "overlap.width", "[0.2000, "),
        (&["overlap.width=2.5"], "overlap.width", "leaves room"),
        (
            &["overlap.load_time=1"],
            "overlap.load_time",
            "at most the time",
        ),
        (
            &["overlap.height_diameters=5"],
            "overlap.height_diameters",
            "inner_diameters",
        ),
        (
            &["side_walls={width=1.0,friction=0.2}"],
            "side_walls",
            "periodic across",
        ),
    ] {
        let refused = colluvium(folder.path(), &arguments("x", sets));
        let message = String::from_utf8_lossy(&refused.stderr).into_owned();
        assert_eq!(refused.status.code(), Some(2), "{sets:?}: {message}");
        assert!(
            message.contains(key) && message.contains(allowed),
            "{sets:?}: {message}"
        );
        assert!(!folder.path().join("x").exists());
    }
}

#[test]
fn the_plan_says_where_grains_end_and_why() {
    let folder = tempfile::tempdir().unwrap();
    let mut plan = arguments("x", &[]);
    plan[0] = "plan";
    plan.drain(2..4);
    let said = succeed(folder.path(), &plan);
    for word in [
        "zones",
        "overlap",
        "computed",
        "of the grain-steps",
        "moderate",
    ] {
        assert!(said.contains(word), "{word}: {said}");
    }
}

/// `overlap.width` halves itself between buffer and inner overlap: what the parts give that it stands for. Error against cost over
/// it and the oracle's tolerance, beside full grains; a wider overlap has more grains.
#[test]
fn a_width_of_the_overlap_varies_with_the_tolerance() {
    let folder = tempfile::tempdir().unwrap();
    let planned = |sets: &[&str]| {
        let mut plan = arguments("x", sets);
        plan[0] = "plan";
        plan.drain(2..4);
        let said = succeed(folder.path(), &plan);
        let from = said.find("overlap.width").unwrap();
        said[from..].lines().next().unwrap().to_owned()
    };
    let [whole, parts] = [
        &["overlap.width=0.8"][..],
        &[
            "overlap.inner_diameters=4",
            "overlap.buffer_diameters=4",
            "overlap.shell_diameters=2.6666666666666667",
        ],
    ]
    .map(planned);
    assert_eq!(whole, parts);
    assert!(
        whole.starts_with("overlap.width 0.8000 m, of which shell 2.7 d, buffer 4.0 d"),
        "{whole}"
    );
    assert!(planned(&[]).starts_with("overlap.width 0.6000 m, of which shell 2.0 d, buffer 3.0 d"));

    JOINED_COLUMN.put(folder.path());
    let mut arguments = arguments("p", &["duration_scaled=0.5"]);
    arguments[0] = "pareto";
    arguments.extend([
        "--vary",
        "overlap.width=0.6,0.8",
        "--vary",
        "zones.tolerance=0.2,0.4",
    ]);
    arguments.extend(["--reference", "model=dem"]);
    succeed(folder.path(), &arguments);
    let (header, rows) = table(&folder.path().join("p/pareto.csv"));
    assert_eq!(header[..2], ["overlap.width", "zones.tolerance"]);
    let values: Vec<&[f64]> = rows.iter().map(|row| &row[..2]).collect();
    assert_eq!(values, [[0.6, 0.2], [0.6, 0.4], [0.8, 0.2], [0.8, 0.4]]);
    let error = header.iter().position(|h| h == "error").unwrap();
    assert!(
        rows.iter().all(|row| row[error] > 0.0 && row[error] < 1.0),
        "{rows:?}"
    );
}

/// Share of the grain-steps that a plan predicts (%).
fn predicted(said: &str) -> f64 {
    let before = said.split(" % of the grain-steps").next().unwrap();
    let number = before.rsplit(|c: char| !c.is_ascii_digit()).next();
    number.unwrap().parse().unwrap()
}

/// The oracle puts the edge, tells its reasons, and leaves fewer grains where it may be wrong about more strain or
/// has a budget.
#[test]
fn the_oracle_puts_the_edge() {
    let folder = tempfile::tempdir().unwrap();
    let said = |sets: &[&str]| {
        let column = ["aspect=0.5", "grains.diameter=0.03"];
        let mut plan = arguments("x", &[&column, sets].concat());
        plan[0] = "plan";
        plan.drain(2..4);
        succeed(folder.path(), &plan)
    };
    let (strict, lax) = (
        said(&["zones.tolerance=0.05"]),
        said(&["zones.tolerance=0.3"]),
    );
    println!("{strict}\n{lax}");
    for concern in ["by the oracle", "window", "thickness", "wall"] {
        assert!(strict.contains(concern), "{strict}");
    }
    assert!(predicted(&lax) < predicted(&strict), "{lax}");
    let poor = said(&["zones.tolerance=0.05", "zones.budget=4000"]);
    println!("{poor}");
    assert!(poor.contains("raised from 0.05"), "{poor}");
    assert!(predicted(&poor) < predicted(&strict), "{poor}");
    assert!(!folder.path().join("x").exists());
}

/// The suite tells law, mesh, coupling and packing apart, and its control fails. Columns this small miss its limits by what their
/// packings differ by, which it says by its exit.
#[test]
fn a_suite_parts_the_errors_of_a_joined_column() {
    let folder = tempfile::tempdir().unwrap();
    let mut list = vec!["validate", "column", "--out", "suite", "--threads", "1"];
    let small = SMALL_JOINED_COLUMN
        .iter()
        .filter(|set| !set.starts_with("model") && !set.starts_with("grains.packing"));
    for set in small.chain(&["grid.length_scaled=5", "grains.stiffness_scaled=1e3"]) {
        list.extend(["--set", set]);
    }
    colluvium(folder.path(), &list);
    let file = folder.path().join("suite/checks.json");
    let checks: Vec<serde_json::Value> =
        serde_json::from_slice(&std::fs::read(file).unwrap()).unwrap();
    let figures = |case: &str| -> Vec<f64> {
        let own = checks.iter().filter(|c| c["case"] == case);
        own.map(|c| c["value"].as_f64().unwrap()).collect()
    };
    for check in &checks {
        println!("{} {} {}", check["case"], check["what"], check["value"]);
    }
    // Deposits: of the joined column nearer to the grains' than twice what two packings differ by and than 6 %.
    let deposit = |case: &str| figures(case)[1];
    assert!(deposit("hybrid") < 0.06 && deposit("hybrid") < 2.0 * deposit("grains"));
    // What differs in one thing only differs in something, and by no more than the whole may be off.
    for part in [
        "hybrid, cells half as wide",
        "hybrid, overlap 1.5 times as wide",
        "hybrid, mu_s and mu_2 an error higher",
    ] {
        assert!(deposit(part) > 1e-6 && deposit(part) < 0.06, "{part}");
    }
    assert_eq!(figures("control"), [1.0]);
    assert!(deposit("uncoupled") > 2.0 * deposit("hybrid"));
    let report = std::fs::read_to_string(folder.path().join("suite/report.html")).unwrap();
    assert!(report.contains("other packing") && report.contains("nothing exchanged"));
}
