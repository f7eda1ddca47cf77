//! A ball that falls into grains with a continuum around them, from the command line.

use crate::command::{BED, colluvium, hash, pause, succeed, summary, table, value};
use crate::packings::{BED_OF_GRAINS, SETTLED_BED};
use std::path::Path;
use std::process::{Command, Stdio};

/// Grains in a box half as large, in an overlap of four diameters.
const BOWL: [&str; 7] = [
    "model=hybrid",
    "overlap.inner_diameters=2",
    "overlap.buffer_diameters=2",
    "overlap.shell_diameters=1.5",
    "zones.cell_diameters=2",
    "zones.half_width=0.0125",
    "zones.depth=0.013",
];

fn arguments<'a>(out: &'a str, sets: &[&'a str]) -> Vec<&'a str> {
    let mut list = vec!["run", "ball-impact", "--out", out];
    for set in BED.iter().chain(sets) {
        list.extend(["--set", set]);
    }
    list
}

fn joined<'a>(out: &'a str, more: &[&'a str]) -> Vec<&'a str> {
    let sets: Vec<&str> = BOWL.iter().chain(more).copied().collect();
    arguments(out, &sets)
}

/// Largest distance between two balls' heights as long as both run, over how deep the first one goes.
fn apart(folder: &Path, names: [&str; 2]) -> f64 {
    let [one, other] = names.map(|name| table(&folder.join(name).join("ball.csv")).1);
    let pairs = one.iter().zip(&other);
    let miss = pairs.map(|(a, b)| (a[1] - b[1]).abs()).fold(0.0, f64::max);
    miss / value(&summary(&folder.join(names[0])), "penetration")
}

/// Of the same settled bed: all grains, joined with one thread and with two, and with nothing exchanged. The ball in the
/// joined bed goes the way it goes in grains alone; grains that nothing holds let it fall
/// through to the overlap.
#[test]
fn a_ball_sinks_into_a_joined_bed_as_into_grains() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    SETTLED_BED.put(folder.path());
    BED_OF_GRAINS.put(folder.path());
    for (name, threads) in [("joined", "1"), ("two", "2")] {
        let mut run = joined(name, &["output.frames=3"]);
        run.extend(["--threads", threads]);
        succeed(folder.path(), &run);
    }
    assert_eq!(hash(&at("joined")), hash(&at("two")));
    succeed(
        folder.path(),
        &joined("control", &["overlap.uncoupled=true"]),
    );
    let series = hdf5::File::open(at("joined/continuum.vtkhdf")).unwrap();
    let times = series.dataset("VTKHDF/Steps/Values").unwrap();
    assert!(times.read_raw::<f64>().unwrap().len() >= 3);
    let [grains, joint, control] = ["grains", "joined", "control"].map(|name| summary(&at(name)));
    for name in [
        "penetration",
        "slip",
        "force_ratio",
        "box_moved",
        "grains_escaped",
        "handshake_mass",
        "ledger_grains",
        "ledger_exchange",
        "grain_steps_share",
    ] {
        let all = [&grains, &joint, &control].map(|s| value(s, name));
        println!(
            "{name}: grains {:.3e}, joined {:.3e}, control {:.3e}",
            all[0], all[1], all[2]
        );
    }
    let [with, without] = ["joined", "control"].map(|name| apart(folder.path(), ["grains", name]));
    println!("ways of the ball apart: joined {with:.4}, nothing exchanged {without:.3}");
    // Two runs of grains of which one ball starts 0.1 mm higher differ by 0.01.
    assert!(with < 0.08 && without > 0.2, "{with} {without}");
    assert!(
        value(&joint, "overlap_clearance") > 0.001 && value(&control, "overlap_clearance") <= 0.0
    );
    assert!(value(&joint, "slip") < 0.02 && value(&control, "slip") > 0.04);
    assert_eq!(value(&joint, "grains_escaped"), 0.0);
    assert!(value(&joint, "box_moved").abs() < 1.0);
    assert!(value(&joint, "handshake_mass").abs() < 0.03);
    assert!(value(&joint, "ledger_grains") < 1e-10);
    assert!(value(&joint, "ledger_exchange") < 1e-10);
    assert!(value(&joint, "ledger_volume").abs() < 1e-12);
    assert!(value(&joint, "grain_steps_share") < 0.4);
}

/// Boxes that are not about the axis and reach the walls on some sides: in a corner of the container, with three sides, and
/// from wall to wall, with the bottom alone. The ball goes the way it goes in grains alone.
#[test]
fn a_box_may_reach_the_walls() {
    let folder = tempfile::tempdir().unwrap();
    SETTLED_BED.put(folder.path());
    BED_OF_GRAINS.put(folder.path());
    let corner = ["zones.x=[-0.017,0.0125]", "zones.y=[-0.0125,1]"];
    let level = ["zones.x=[-0.017,0.017]", "zones.y=[-1,1]"];
    let deep = "zones.depth=0.016";
    for (name, edges, share) in [("corner", corner, 0.4..0.65), ("level", level, 0.6..0.8)] {
        let run = arguments(name, &[]).into_iter();
        let sets = BOWL.iter().filter(|set| !set.contains("half_width"));
        let sets = sets
            .chain(&edges)
            .chain([&deep])
            .flat_map(|set| ["--set", set]);
        let run: Vec<&str> = run.chain(sets).collect();
        succeed(folder.path(), &run);
        let found = summary(&folder.path().join(name));
        let way = apart(folder.path(), ["grains", name]);
        let [steps, books, escaped] =
            ["grain_steps_share", "ledger_grains", "grains_escaped"].map(|key| value(&found, key));
        println!(
            "{name}: ways {way:.4}, grain-steps {steps:.3}, momentum {books:.1e}, escaped {escaped}"
        );
        assert!(way < 0.05 && books < 1e-10, "{way} {books}");
        assert!(share.contains(&steps), "{steps}");
    }
}

/// A box that grows.
const MOVING: [&str; 2] = ["zones.moving=true", "zones.near_diameters=1.5"];

/// And takes grains of sheared packings for what was sheared while it was stored.
const SHEARED: [&str; 6] = [
    "zones.moving=true",
    "zones.near_diameters=1.5",
    "zones.misplaced_shear=0.02",
    "zones.returning=sheared",
    "zones.sheared_inertial=[0.3]",
    "zones.sheared_grains=150",
];

/// Killed twice on the way, its box growing, it goes on to the same bits, with another number of threads.
#[test]
fn a_joined_bed_goes_on_after_a_kill() {
    let folder = tempfile::tempdir().unwrap();
    SETTLED_BED.put(folder.path());
    let mut whole = joined("whole", &SHEARED);
    whole.extend(["--threads", "2"]);
    succeed(folder.path(), &whole);
    let found = summary(&folder.path().join("whole"));
    let replaced = value(&found, "replaced");
    // Grains of packings have higher numbers than the ball; it is the ball that is followed, never faster than it came, 2 m/s.
    let ways = table(&folder.path().join("whole/ball.csv")).1;
    let speeds = ways
        .windows(2)
        .map(|w| (w[1][1] - w[0][1]).abs() / (w[1][0] - w[0][0]));
    assert!(speeds.fold(0.0, f64::max) < 2.2);
    println!("{replaced} replaced at {} moves", value(&found, "moves"));
    assert!(value(&found, "moves") >= 3.0 && replaced > 10.0);
    assert!(value(&found, "ledger_grains") < 1e-10 && value(&found, "ledger_exchange") < 1e-10);
    assert!(value(&found, "ledger_volume").abs() < 1e-12);
    let mut killed = joined("killed", &SHEARED);
    killed.extend(["--checkpoint-every", "0", "--threads", "1"]);
    let checkpoint = folder.path().join("killed/checkpoint.h5");
    for _ in 0..2 {
        let mut child = Command::new(env!("CARGO_BIN_EXE_colluvium"))
            .args(&killed)
            .current_dir(folder.path())
            .stdout(Stdio::null())
            .spawn()
            .unwrap();
        while !checkpoint.exists() && child.try_wait().unwrap().is_none() {
            pause();
        }
        std::thread::sleep(std::time::Duration::from_millis(200));
        child.kill().unwrap();
        child.wait().unwrap();
        let done = folder.path().join("killed/report.html").exists();
        assert!(!done, "it was done before it was killed");
        if killed.last() != Some(&"--resume") {
            killed.push("--resume");
        }
    }
    let mut last = joined("killed", &SHEARED);
    last.push("--resume");
    succeed(folder.path(), &last);
    let [whole, resumed] = ["whole", "killed"].map(|name| hash(&folder.path().join(name)));
    assert_eq!(whole, resumed);
}

/// Where a side of the box lies in the ball's way, the run ends when the ball comes to it, and says so; a box that grows
/// lets it go on as in grains alone, but not beyond its budget.
#[test]
fn a_ball_that_comes_to_the_overlap_ends_the_run_or_lets_the_box_grow() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    SETTLED_BED.put(folder.path());
    let fast = ["speed=4", "duration=0.012"];
    succeed(folder.path(), &arguments("grains", &fast));
    succeed(folder.path(), &joined("fixed", &fast));
    for (name, more) in [("grown", &[][..]), ("short", &["zones.budget=1400"])] {
        let sets = [&fast[..], &MOVING, more].concat();
        succeed(folder.path(), &joined(name, &sets));
    }
    let [fixed, grown, short] = ["fixed", "grown", "short"].map(|name| summary(&at(name)));
    for (found, key) in [(&fixed, "zones.depth"), (&short, "zones.budget")] {
        assert!(value(found, "overlap_clearance") <= 0.0);
        let remarks = found["remarks"].to_string();
        assert!(remarks.contains(key), "{remarks}");
    }
    let end = |name: &str| table(&at(name).join("ball.csv")).1.last().unwrap()[0];
    assert!(end("fixed") < end("grown") && end("short") < end("grown"));
    assert!(
        value(&short, "refused_moves") > 0.0 && short["model"]["grains"].as_f64() < Some(1401.0)
    );
    let away = apart(folder.path(), ["grains", "grown"]);
    for name in [
        "moves",
        "displaced",
        "grain_steps_share",
        "handshake_mass",
        "ledger_grains",
        "ledger_exchange",
    ] {
        println!("{name}: {:.3e}", value(&grown, name));
    }
    println!("ways of the ball apart {away:.4}");
    assert!(
        value(&grown, "overlap_clearance") > 0.001 && away < 0.1,
        "{away}"
    );
    assert!(value(&grown, "moves") >= 2.0 && value(&grown, "grain_steps_share") < 0.8);
    assert!(value(&grown, "handshake_mass").abs() < 0.03);
    assert!(value(&grown, "ledger_grains") < 1e-10 && value(&grown, "ledger_exchange") < 1e-10);
    assert!(value(&grown, "ledger_volume").abs() < 1e-12);
    let (names, rows) = table(&at("grown").join("moves.csv"));
    assert_eq!(names[..4], ["t", "side", "place", "reason"]);
    assert_eq!(rows.len() as f64, value(&grown, "moves"));
}

/// The last value of a key holds.
const WITHOUT_A_SIDE: [&str; 3] = ["zones.x=[-1,1]", "zones.half_width=0.0165", "zones.depth=1"];

#[test]
fn bad_joined_beds_are_refused_by_key() {
    let folder = tempfile::tempdir().unwrap();
    for (sets, key, allowed) in [
        (&["zones.half_width=0.009"][..], "zones.half_width", "above"),
        (&["zones.half_width=0.02"], "zones.half_width", "below"),
        (&["zones.depth=0.005"], "zones.depth", "above"),
        (
            &["zones.x=[-0.012,0.009]"],
            "zones.x[1]",
            "at or beyond 0.0105",
        ),
        // From wall to wall and down to the floor there is no continuum.
        (&WITHOUT_A_SIDE, "zones.depth", "some continuum is left"),
        (
            &["zones.x=[-0.012,0.012]", "zones.y=[-1,1]"],
            "zones.half_width",
            "left out",
        ),
        (&["zones.budget=100"], "zones.budget", "zones.moving = true"),
        (
            &["zones.moving=true", "zones.wake_speed_scaled=0.0001"],
            "zones.wake_speed_scaled",
            "above zones.rest_speed_scaled",
        ),
        (
            &["zones.returning=sheared"],
            "zones.returning",
            "zones.moving = true",
        ),
        (
            &["zones.moving=true", "zones.returning=sheared"],
            "zones.returning",
            "zones.misplaced_shear",
        ),
        (
            &["zones.loosest_scaled=0.9"],
            "zones.loosest_scaled",
            "zones.moving = true",
        ),
        (
            &["zones.moving=true", "zones.warmest_share=0"],
            "zones.warmest_share",
            "(0",
        ),
        (
            &["zones.moving=true", "zones.sheared_grains=200"],
            "zones.sheared_grains",
            "zones.returning",
        ),
        (
            &["zones.cell_diameters=3"],
            "zones.cell_diameters",
            "at most the widths",
        ),
        (
            &["continuum.calibrated=none"],
            "continuum.calibrated",
            "needs a law",
        ),
        (
            &["overlap.load_time=1"],
            "overlap.load_time",
            "at most the time",
        ),
        (&["zones.edge_scaled=1"], "zones.edge_scaled", "zones"),
        // The overlap has room, but no whole cell above it.
        (
            &["zones.depth=0.0085"],
            "zones.depth",
            "a cell of grains is left",
        ),
    ] {
        let refused = colluvium(folder.path(), &joined("x", sets));
        let message = String::from_utf8_lossy(&refused.stderr).into_owned();
        assert_eq!(refused.status.code(), Some(2), "{sets:?}: {message}");
        assert!(
            message.contains(key) && message.contains(allowed),
            "{sets:?}: {message}"
        );
        assert!(!folder.path().join("x").exists());
    }
}
