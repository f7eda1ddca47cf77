//! The ball, the silos and the slope: what is exact in them, and what must fail.

use crate::command::{colluvium, hash, pause, succeed, summary, table, value};
use std::path::Path;
use std::process::{Command, Stdio};

fn run<'a>(scene: &'a str, out: &'a str, sets: &[&'a str]) -> Vec<&'a str> {
    let mut list = vec!["run", scene, "--out", out];
    for set in sets {
        list.extend(["--set", set]);
    }
    list
}

/// A quarter of the benchmark's lengths: some 400 grains, a ball of five of their radii.
const SMALL_BALL: [&str; 3] = ["scale=0.25", "output.rows=500", "output.pictures=0"];

#[test]
fn a_ball_falls_freely_and_stops_in_the_bed() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    succeed(folder.path(), &run("ball-impact", "a", &SMALL_BALL));
    let found = summary(&at("a"));
    let (header, rows) = table(&at("a/ball.csv"));
    assert_eq!(header, ["t", "z", "vz"]);
    let struck = value(&found, "impact_time");
    let (z0, g) = (0.25 * 0.06, 9.8);
    let flight: Vec<_> = rows.iter().filter(|row| row[0] < 0.98 * struck).collect();
    assert!(flight.len() > 50, "{struck}");
    for row in flight {
        let (t, z, vz) = (row[0], row[1], row[2]);
        assert!(
            (z - (z0 - 5.0 * t - 0.5 * g * t * t)).abs() < 1e-9,
            "{row:?}"
        );
        assert!((vz + 5.0 + g * t).abs() < 1e-6, "{row:?}");
    }
    // It is slowed down all the way, and does not reach the floor.
    let (deepest, surface) = (value(&found, "penetration"), value(&found, "surface"));
    let depth = surface + 0.25 * 0.0902431;
    assert!(
        deepest > 0.3 * depth && deepest < depth,
        "{deepest} {depth}"
    );
    assert!(value(&found, "clearance") > 0.0);
    assert!(value(&found, "final_velocity").abs() < 0.5);
    let phi = value(&found, "bed_solid_fraction");
    assert!((0.5..0.66).contains(&phi), "{phi}");
    assert!(found["ledger"]["momentum_relative"].as_f64().unwrap() < 1e-9);
    let page = std::fs::read_to_string(at("a/report.html")).unwrap();
    assert!(page.contains("Dosta") && page.contains("height of the ball"));
    // Two threads, stopped on the way: the same bits.
    let mut two = run("ball-impact", "two", &SMALL_BALL);
    two.extend(["--threads", "2", "--checkpoint-every", "0"]);
    let mut child = Command::new(env!("CARGO_BIN_EXE_colluvium"))
        .args(&two)
        .current_dir(folder.path())
        .stdout(Stdio::null())
        .spawn()
        .unwrap();
    while !at("two/checkpoint.h5").exists() && child.try_wait().unwrap().is_none() {
        pause();
    }
    child.kill().unwrap();
    child.wait().unwrap();
    two.push("--resume");
    succeed(folder.path(), &two);
    assert_eq!(hash(&at("two")), hash(&at("a")));
}

#[test]
fn without_a_bed_the_ball_bounces_as_its_law_says() {
    // The control: nothing but the steel floor, whose restitution against the ball is 0.32.
    let folder = tempfile::tempdir().unwrap();
    let mut sets = SMALL_BALL.to_vec();
    // One grain, in a far corner.
    sets.extend([
        "container.grains=64",
        "container.length=1",
        "container.width=1",
        "duration=0.2",
    ]);
    succeed(folder.path(), &run("ball-impact", "a", &sets));
    let (_, rows) = table(&folder.path().join("a/ball.csv"));
    let fastest = rows.iter().map(|row| row[2]).fold(0.0, f64::min);
    let back = rows.iter().map(|row| row[2]).fold(0.0, f64::max);
    assert!((back / -fastest - 0.32).abs() < 0.02, "{back} {fastest}");
}

#[test]
fn silos_run_out_as_beverloo_says() {
    let folder = tempfile::tempdir().unwrap();
    let sets = [
        "openings_diameters=[5.0, 6.0, 7.5]",
        "depth_diameters=8",
        "duration=0.4",
        "output.pictures=0",
    ];
    succeed(folder.path(), &run("silo", "a", &sets));
    let found = summary(&folder.path().join("a"));
    let (_, rows) = table(&folder.path().join("a/rates.csv"));
    assert_eq!(rows.len(), 3);
    for row in &rows {
        assert!((row[2] / row[4] - 1.0).abs() < 0.35, "{row:?}");
    }
    let exponent = value(&found, "exponent");
    assert!((exponent - 2.5).abs() < 0.4, "{exponent}");
    // The control: openings without the empty ring have another exponent.
    assert!(value(&found, "exponent_of_bare_opening") > exponent + 0.5);
    let page = std::fs::read_to_string(folder.path().join("a/report.html")).unwrap();
    assert!(page.contains("Nedderman"));
}

#[test]
fn what_is_wrong_with_these_scenes_is_said_with_its_key() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("bed.txt"), "r x y z\n0.001 0 0\n").unwrap();
    std::fs::write(folder.path().join("far.txt"), "r x y z\n0.001 1 0 0\n").unwrap();
    for (scene, sets, words) in [
        (
            "ball-impact",
            &["model=fluid"][..],
            &["model", "fluid", "dem", "hybrid"][..],
        ),
        // The benchmark's own bed has no room for a continuum.
        (
            "ball-impact",
            &["model=hybrid"],
            &["zones.half_width", "continuum"],
        ),
        (
            "ball-impact",
            &["ball.material=wood"],
            &["ball.material", "wood", "steel"],
        ),
        (
            "ball-impact",
            &["ball.height=-0.1"],
            &["ball.height", "-0.1"],
        ),
        (
            "ball-impact",
            &["container.width=0.01"],
            &["container.width", "0.01"],
        ),
        ("ball-impact", &["bed=bed.txt"], &["scale", "0.5"]),
        (
            "ball-impact",
            &["scale=1", "bed=bed.txt"],
            &["bed.txt", "line 2"],
        ),
        (
            "ball-impact",
            &["scale=1", "bed=far.txt"],
            &["far.txt", "outside"],
        ),
        (
            "ball-impact",
            &["timestep.seconds=1e-3"],
            &["timestep", "unstable"],
        ),
        (
            "silo",
            &["openings_diameters=[2]"],
            &["openings_diameters[0]", "clog"],
        ),
        ("silo", &["openings_diameters=[]"], &["openings_diameters"]),
        ("silo", &["wall_material=wood"], &["wall_material", "wood"]),
        ("silo", &["scale=0.1"], &["scale", "0.1"]),
        (
            "angle-of-repose",
            &["search.high=18.5"],
            &["search.high", "18.5"],
        ),
        ("angle-of-repose", &["search.low=95"], &["search.low", "95"]),
        ("angle-of-repose", &["contact.beta=0"], &["contact.beta"]),
        ("angle-of-repose", &["floor.filling=0"], &["floor.filling"]),
    ] {
        let done = colluvium(folder.path(), &run(scene, "bad", sets));
        let message = String::from_utf8_lossy(&done.stderr).into_owned();
        assert_eq!(done.status.code(), Some(2), "{sets:?}: {message}");
        for word in words {
            assert!(
                message.contains(word),
                "{sets:?}: no `{word}` in: {message}"
            );
        }
        assert!(!Path::new(&folder.path().join("bad")).exists(), "{sets:?}");
    }
}
