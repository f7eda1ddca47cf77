//! Clumps of grains in scenes of one's own: a heap of them, restarts, what is refused.

#![allow(clippy::unwrap_used)] // a test may panic

mod command;

use command::{colluvium, hash, succeed, summary, table, value};
use std::process::{Command, Stdio};

/// Jacks of four balls that fall on a floor within a tube, on a few grains.
const HEAP: &str = r#"
scene = "grains"
seed = 3
duration = 0.4

[output]
rows = 40
frames = 0
pictures = 0
ledger = true

[contact]
normal = "hertz"
youngs_modulus = 1.0e7
poissons_ratio = 0.3
restitution = 0.4
friction = 0.5

[grains.gravel]
density = 2500.0
sizes = { law = "uniform", smallest = 0.004, largest = 0.005 }

[gravity]
uniform = [0.0, 0.0, -9.81]

[walls.floor]
shape = "plane"
axis = [0.0, 0.0, 1.0]

[walls.tube]
shape = "cylinder"
axis = [0.0, 0.0, 1.0]
radius = 0.05

[clumps.jack]
balls = [
    { point = [0.0, 0.0, 0.0], radius = 0.005 },
    { point = [0.006, 0.0, 0.0], radius = 0.004 },
    { point = [0.0, 0.006, 0.0], radius = 0.004 },
    { point = [0.0, 0.0, -0.006], radius = 0.003 },
]
count = 60
velocity = [0.0, 0.0, -0.5]
within = [
    { shape = "cylinder", axis = [0.0, 0.0, 1.0], point = [0.0, 0.0, 0.0], radius = 0.05 },
    { shape = "block", lower = [-1.0, -1.0, 0.03], upper = [1.0, 1.0, 0.2] },
]

[[prepare]]
do = "pour"
count = 40
within = [
    { shape = "cylinder", axis = [0.0, 0.0, 1.0], point = [0.0, 0.0, 0.0], radius = 0.045 },
    { shape = "block", lower = [-1.0, -1.0, 0.03], upper = [1.0, 1.0, 0.08] },
]
"#;

#[test]
fn clumps_settle_with_accounts_closed_and_resume_to_the_bit() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    std::fs::write(at("heap.toml"), HEAP).unwrap();
    let plan = succeed(folder.path(), &["plan", "heap.toml"]);
    assert!(plan.contains("60 of 240 balls"), "{plan}");
    succeed(folder.path(), &["run", "heap.toml", "--out", "a"]);
    let found = summary(&at("a"));
    assert!(found["ledger"]["momentum_relative"].as_f64().unwrap() < 1e-9);
    let (header, rows) = table(&at("a/history.csv"));
    let column = |name: &str| header.iter().position(|h| h == name).unwrap();
    let error = column("ledger_error");
    assert!(rows.iter().all(|row| row[error].abs() < 1e-9));
    assert!(rows.iter().all(|row| row[column("grains")] == 280.0));
    let kinetic = |row: &[f64]| row[column("translation")] + row[column("rotation")];
    assert!(kinetic(&rows[rows.len() - 1]) < 1e-3 * kinetic(&rows[5]));
    assert!(value(&found, "largest_overlap") < 0.2);
    // Two threads, killed on the way: the same bits.
    let mut two = vec!["run", "heap.toml", "--out", "two"];
    two.extend(["--threads", "2", "--checkpoint-every", "0"]);
    let mut child = Command::new(env!("CARGO_BIN_EXE_colluvium"))
        .args(&two)
        .current_dir(folder.path())
        .stdout(Stdio::null())
        .spawn()
        .unwrap();
    while !at("two/checkpoint.h5").exists() && child.try_wait().unwrap().is_none() {}
    child.kill().unwrap();
    child.wait().unwrap();
    two.push("--resume");
    succeed(folder.path(), &two);
    assert_eq!(hash(&at("two")), hash(&at("a")));
}

#[test]
fn clumps_that_cannot_be_are_refused_by_key() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("heap.toml"), HEAP).unwrap();
    let cases: [(&str, &[&str]); 10] = [
        ("clumps.jack.count=0", &["clumps.jack.count", "0"]),
        ("clumps.jack.balls=[]", &["clumps.jack.balls"]),
        (
            "clumps.jack.balls=[{point=[0,0,0]}]",
            &["clumps.jack.balls[0].radius", "missing"],
        ),
        (
            "clumps.jack.balls=[{point=[0,0,0],radius=-1}]",
            &["clumps.jack.balls[0].radius", "-1"],
        ),
        (
            "clumps.jack.material=\"wood\"",
            &["clumps.jack.material", "wood", "gravel"],
        ),
        ("clumps.jack.mass=0", &["clumps.jack.mass", "0"]),
        (
            "clumps.jack.inertia=[1,1,1,0,0,0]",
            &["clumps.jack.mass", "missing"],
        ),
        (
            "clumps.jack.centre=[0,0,0]",
            &["clumps.jack.centre", "inertia"],
        ),
        (
            "clumps.jack.count=100000",
            &["clumps.jack.count", "no room"],
        ),
        ("clumps.jack.within=[]", &["clumps.jack.within"]),
    ];
    for (set, words) in cases {
        let arguments = ["run", "heap.toml", "--out", "none", "--set", set];
        let refused = colluvium(folder.path(), &arguments);
        let message = String::from_utf8_lossy(&refused.stderr).into_owned();
        assert_eq!(refused.status.code(), Some(2), "{set}: {message}");
        for word in words {
            assert!(message.contains(word), "{set}: {word}: {message}");
        }
        assert!(!folder.path().join("none").exists(), "{set}");
    }
}
