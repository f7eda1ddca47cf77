//! A column whose grains lie between two continua, or its continuum between grains, from the command line.

use crate::command::{
    CORE, INTERVAL, SMALL_JOINED_COLUMN, colluvium, hash, succeed, summary, table, value,
};
use crate::packings::WIDE_COLUMN;

fn arguments<'a>(command: &'a str, out: &'a str, more: &[&'a str]) -> Vec<&'a str> {
    arguments_of(INTERVAL, command, out, more)
}

/// With these zones.
fn arguments_of<'a>(
    zones: &[&'a str],
    command: &'a str,
    out: &'a str,
    more: &[&'a str],
) -> Vec<&'a str> {
    let mut list = vec![command, "column-collapse"];
    if command == "run" {
        list.extend(["--out", out]);
    }
    for set in SMALL_JOINED_COLUMN.iter().chain(zones).chain(more) {
        list.extend(["--set", set]);
    }
    list
}

/// What runs out is the continuum in front of the grains, pushed by what lies behind them.
#[test]
fn a_column_collapses_through_the_grains_in_its_middle() {
    collapse(INTERVAL, 1.3);
}

/// What runs out is grains, and those at the wall hold the continuum up from behind.
#[test]
fn a_column_collapses_through_the_continuum_in_its_middle() {
    collapse(CORE, 2.0);
}

/// Of the same settled column: all grains, these zones with one thread and with two, and with nothing exchanged, which misses the deposit
/// by so much more at the least.
fn collapse(zones: &[&str], worse: f64) {
    let arguments = |command, out, more: &[&'static str]| arguments_of(zones, command, out, more);
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    WIDE_COLUMN.put(folder.path());
    for (name, sets) in [
        ("grains", &["model=dem"][..]),
        ("joined", &["output.frames=3"]),
        ("control", &["overlap.uncoupled=true"]),
    ] {
        succeed(folder.path(), &arguments("run", name, sets));
    }
    let mut two = arguments("run", "two", &["output.frames=3"]);
    two.extend(["--threads", "2"]);
    succeed(folder.path(), &two);
    assert_eq!(hash(&at("joined")), hash(&at("two")));
    let [grains, joined, control] = ["grains", "joined", "control"].map(|n| summary(&at(n)));
    for name in ["x_front", "x_of_share", "deposit_height", "wall_height"] {
        let all = [&grains, &joined, &control].map(|s| value(s, name));
        println!(
            "{name}: grains {:.4}, joined {:.4}, control {:.4}",
            all[0], all[1], all[2]
        );
    }
    for edge in ["low_edge", "high_edge"] {
        for name in [
            "slip",
            "force_of_grains",
            "force_ratio",
            "relaxation_share",
            "grains_escaped",
        ] {
            let name = format!("{edge}_{name}");
            let all = [&joined, &control].map(|s| value(s, &name));
            println!("{name}: joined {:.3e}, control {:.3e}", all[0], all[1]);
        }
        assert_eq!(value(&joined, &format!("{edge}_grains_escaped")), 0.0);
        assert!(value(&control, &format!("{edge}_grains_escaped")) > 3.0);
    }
    ends_as_grains(&joined, &grains);
    for name in ["ledger_grains", "ledger_exchange"] {
        println!("{name} {:.1e}", value(&joined, name));
        assert!(value(&joined, name) < 1e-10);
    }
    println!("handshake_mass {:.1e}", value(&joined, "handshake_mass"));
    assert!(value(&joined, "ledger_volume").abs() < 1e-12);
    assert!(value(&joined, "handshake_mass").abs() < 0.02);
    let heap = |name: &str| table(&at(name).join("deposit.csv")).1;
    let all = heap("grains");
    let apart = |name: &str| {
        let own = heap(name);
        let miss: f64 = own.iter().zip(&all).map(|(a, b)| (a[1] - b[1]).abs()).sum();
        miss / all.iter().map(|row| row[1]).sum::<f64>()
    };
    let (joint, without) = (apart("joined"), apart("control"));
    println!("deposits apart: joined {joint:.4}, nothing exchanged {without:.4}");
    assert!(joint < 0.08 && without > worse * joint, "{joint} {without}");
}

/// Where 99 % of the area end is that of the grains alone.
fn ends_as_grains(joined: &serde_json::Value, grains: &serde_json::Value) {
    let ratio = value(joined, "x_of_share") / value(grains, "x_of_share");
    println!("place of 99 % of the area: {ratio:.4} of that of grains");
    assert!((ratio - 1.0).abs() < 0.03, "{ratio}");
}

/// Three edges: grains at the wall and farther on, continua between them and at the front.
#[test]
fn a_list_of_intervals_has_continua_between_them() {
    let folder = tempfile::tempdir().unwrap();
    WIDE_COLUMN.put(folder.path());
    let zones = ["zones.x=[[0, 1], [1.5, 3.1]]", "duration_scaled=1"];
    succeed(folder.path(), &arguments_of(CORE, "run", "x", &zones));
    let found = summary(&folder.path().join("x"));
    for edge in ["edge_1", "edge_2", "edge_3"] {
        let [slip, escaped] =
            ["slip", "grains_escaped"].map(|n| value(&found, &format!("{edge}_{n}")));
        println!("{edge}: slip {slip:.1e}, escaped {escaped}");
        assert!(slip < 0.05 && slip > 0.0);
    }
    for name in ["ledger_grains", "ledger_exchange"] {
        assert!(value(&found, name) < 1e-10, "{name}");
    }
    assert!(value(&found, "handshake_mass").abs() < 0.02);
}

/// Grains that reach up to the front are what one edge leaves, with the same bits.
#[test]
fn an_interval_up_to_the_front_is_one_edge() {
    let folder = tempfile::tempdir().unwrap();
    WIDE_COLUMN.put(folder.path());
    for (name, sets) in [
        ("one", &["zones.x=[1.5, 99.0]", "duration_scaled=0.5"][..]),
        ("given", &["zones.edge_scaled=1.5", "duration_scaled=0.5"]),
    ] {
        let mut run = arguments("run", name, &[]);
        // The interval of the others is not wanted.
        run.truncate(run.len() - 2);
        for set in sets {
            run.extend(["--set", set]);
        }
        succeed(folder.path(), &run);
    }
    let [one, given] = ["one", "given"].map(|name| folder.path().join(name));
    assert_eq!(hash(&one), hash(&given));
    for file in ["history.csv", "deposit.csv"] {
        let [one, given] = [&one, &given].map(|run| std::fs::read(run.join(file)).unwrap());
        assert_eq!(one, given, "{file}");
    }
}

#[test]
fn the_plan_says_where_both_edges_are() {
    let folder = tempfile::tempdir().unwrap();
    let said = succeed(folder.path(), &arguments("plan", "", &[]));
    for word in [
        "to the low edge at 0.8000 m (8.0 d)",
        "from the high edge at 3.2000 m (32.0 d) on",
        "zones.x = [0.8, 3.2]",
        "of the grain-steps",
    ] {
        assert!(said.contains(word), "{word}: {said}");
    }
    let said = succeed(folder.path(), &arguments_of(CORE, "plan", "", &[]));
    for word in [
        "between 1.0000 and 2.6000 m from the wall is a continuum",
        "continuum from the low edge at 1.0000 m (10.0 d) to the high edge at 2.6000 m (26.0 d)",
        "zones.x = [[0, 1], [2.6, 99]]",
        "61 % of the grain-steps",
    ] {
        assert!(said.contains(word), "{word}: {said}");
    }
}

#[test]
fn bad_intervals_are_refused_by_key() {
    let folder = tempfile::tempdir().unwrap();
    for (sets, key, allowed) in [
        (
            &["zones.x=[3.2, 0.8]"][..],
            "zones.x",
            "a list of such intervals that rises",
        ),
        (
            &["zones.x=[[0, 1], [0.9, 99]]"],
            "zones.x",
            "a list of such intervals that rises",
        ),
        (&["zones.x=[]"], "zones.x", "array of 2 values"),
        (
            &["zones.x=[[0, 1], [2.6, 99, 3]]"],
            "zones.x[1]",
            "array of 2 values",
        ),
        (
            &["zones.x=[[0, 1], [1.3, 99]]"],
            "zones.x",
            "some continuum lies between two intervals",
        ),
        (
            &["zones.x=[[0, 0.8], [2.6, 99]]"],
            "zones.x",
            "at least 1.0000 m wide: an overlap",
        ),
        (
            &["zones.x=[[0, 1], [3.2, 99]]"],
            "zones.x",
            "at least 1.0000 m wide: an overlap",
        ),
        (
            &["zones.x=[[0, 1], [4.2, 99]]"],
            "zones.x",
            "within the column",
        ),
        (
            &["zones.x=[[0, 1], [2.6, 99]]", "zones.rest_scaled=0.1"],
            "zones.rest_scaled",
            "up to the wall",
        ),
        (&["zones.x=[0.0, 4.0]"], "zones.x", "leaves no continuum"),
        (
            &["zones.x=[0.8, 2.0]"],
            "zones.x",
            "two overlaps of 0.6000 m",
        ),
        (&["zones.x=[0.1, 3.2]"], "zones.x", "at least 0.3000 m"),
        (&["zones.x=[0.8, 3.9]"], "zones.x", "at least 0.3000 m"),
        (&["zones.edge_scaled=1"], "zones.edge_scaled", "zones.x"),
        (&["zones.tolerance=0.1"], "zones.x", "the oracle"),
        (
            &["zones.x=[0.0, 3.2]", "zones.rest_scaled=0.1"],
            "zones.rest_scaled",
            "up to the wall",
        ),
        (
            &["zones.rest_scaled=0.7"],
            "zones.rest_scaled",
            "some continuum lies behind",
        ),
    ] {
        let refused = colluvium(folder.path(), &arguments("run", "x", sets));
        let message = String::from_utf8_lossy(&refused.stderr).into_owned();
        assert_eq!(refused.status.code(), Some(2), "{sets:?}: {message}");
        assert!(
            message.contains(key) && message.contains(allowed),
            "{sets:?}: {message}"
        );
        assert!(!folder.path().join("x").exists());
    }
}
