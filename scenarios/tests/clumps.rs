//! Clumps of grains in scenes of one's own: a heap of them, restarts, what is refused.

use crate::command::{colluvium, hash, pause, succeed, summary, table, value};
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
    while !at("two/checkpoint.h5").exists() && child.try_wait().unwrap().is_none() {
        pause();
    }
    child.kill().unwrap();
    child.wait().unwrap();
    two.push("--resume");
    succeed(folder.path(), &two);
    assert_eq!(hash(&at("two")), hash(&at("a")));
}

/// The same jacks poured and inserted by the preparation.
fn poured() -> String {
    let (head, steps) = HEAP.split_once("count = 60").unwrap();
    let (_, steps) = steps.split_once("[[prepare]]").unwrap();
    let head = head.replace("duration = 0.4", "duration = 0.02\npacking = \"jacks\"");
    let head = head.replace("frames = 0", "frames = 2");
    let within = r#"within = [
    { shape = "cylinder", axis = [0.0, 0.0, 1.0], point = [0.0, 0.0, 0.0], radius = 0.05 },
    { shape = "block", lower = [-1.0, -1.0, 0.12], upper = [1.0, 1.0, 0.2] },
]"#;
    format!(
        "{head}\n[[prepare]]{steps}\n[[prepare]]\ndo = \"pour\"\nclumps = \"jack\"\ncount = 30\n{within}\n\
         [[prepare]]\ndo = \"insert\"\nclumps = \"jack\"\ncount = 5\n{within}\n"
    )
}

/// A bed of clumps that is read from its file goes on as the one that was just made, to the bit.
#[test]
fn a_stored_bed_of_clumps_is_the_one_that_was_made() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    std::fs::write(at("bed.toml"), poured()).unwrap();
    let plan = succeed(folder.path(), &["plan", "bed.toml"]);
    assert!(plan.contains("30 clumps jack of 4 balls poured"), "{plan}");
    succeed(folder.path(), &["run", "bed.toml", "--out", "made"]);
    let kept = std::fs::read(at("packings/jacks.h5")).unwrap();
    let plan = succeed(folder.path(), &["plan", "bed.toml"]);
    assert!(plan.contains("35 of 140 balls"), "{plan}");
    succeed(folder.path(), &["run", "bed.toml", "--out", "read"]);
    let log = std::fs::read_to_string(at("read/log.txt")).unwrap();
    assert!(log.contains("starts from a stored packing"), "{log}");
    assert_eq!(hash(&at("made")), hash(&at("read")));
    assert_eq!(std::fs::read(at("packings/jacks.h5")).unwrap(), kept);
    let file = "packing=\"made/packing.h5\"";
    let arguments = [
        "run",
        "bed.toml",
        "--set",
        file,
        "--out",
        "file",
        "--threads",
        "2",
    ];
    succeed(folder.path(), &arguments);
    assert_eq!(hash(&at("made")), hash(&at("file")));
    let found = summary(&at("made"));
    assert!(found["ledger"]["momentum_relative"].as_f64().unwrap() < 1e-9);
    let (header, rows) = table(&at("made/history.csv"));
    let grains = header.iter().position(|h| h == "grains").unwrap();
    assert!(rows.iter().all(|row| row[grains] == 180.0));
    // Told as clumps in the series and the pictures.
    let frames = colluvium::vtkhdf::read_series(&at("made/clumps.vtkhdf")).unwrap();
    assert_eq!(frames.len(), 3);
    assert!(frames.iter().all(|frame| frame.points.len() == 35));
    let frames = colluvium::vtkhdf::read_series(&at("made/grains.vtkhdf")).unwrap();
    let clump = frames[2].counts("clump").unwrap();
    assert_eq!(clump.iter().filter(|&&number| number == 40).count(), 4);
    assert_eq!(clump.iter().filter(|&&number| number == -1).count(), 40);
    for arguments in [
        &["render", "made", "--colour", "clump"],
        &["render", "made", "--colour", "cluster"],
    ] {
        succeed(folder.path(), arguments);
    }
    assert!(at("made/view_000000000000_clumps.png").exists());
    // Another shape is another preparation; clumps that only come afterwards are none.
    let other = |set: &str| {
        let arguments = ["run", "bed.toml", "--out", "other", "--set", set];
        colluvium(folder.path(), &arguments)
    };
    let refused = other("clumps.jack.mass=0.001");
    assert_eq!(refused.status.code(), Some(2));
    let message = String::from_utf8_lossy(&refused.stderr).into_owned();
    assert!(message.contains("clumps.jack.mass"), "{message}");
    let later = other(
        "clumps.rod={balls=[{point=[0,0,0],radius=0.004}],count=3,within=[{shape=\"block\",lower=[-0.03,-0.03,0.25],upper=[0.03,0.03,0.3]}]}",
    );
    let message = String::from_utf8_lossy(&later.stderr).into_owned();
    assert!(later.status.success(), "{message}");
    assert_ne!(hash(&at("other")), hash(&at("made")));
}

#[test]
fn clumps_that_the_preparation_cannot_put_in_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let refused = |text: &str, words: &[&str]| {
        std::fs::write(folder.path().join("bed.toml"), text).unwrap();
        let refused = colluvium(folder.path(), &["run", "bed.toml", "--out", "none"]);
        let message = String::from_utf8_lossy(&refused.stderr).into_owned();
        assert_eq!(refused.status.code(), Some(2), "{words:?}: {message}");
        for word in words {
            assert!(message.contains(word), "{word}: {message}");
        }
        assert!(!folder.path().join("none").exists());
    };
    let bed = poured();
    refused(
        &bed.replace("clumps = \"jack\"", "clumps = \"john\""),
        &["prepare[1].clumps", "john", "jack"],
    );
    refused(
        &bed.replace("count = 30", "solid_fraction = 0.1"),
        &["prepare[1].count", "missing"],
    );
    refused(
        &bed.replace("count = 30", "count = 30\nmass = 0.1"),
        &["prepare[1].mass"],
    );
    refused(
        &bed.replace("do = \"insert\"", "do = \"trim\"")
            .replace("count = 5\n", ""),
        &["prepare[2].clumps"],
    );
    let (without, _) = bed
        .split_once("[[prepare]]\ndo = \"pour\"\nclumps")
        .unwrap();
    refused(without, &["clumps.jack.count", "missing"]);
    let moves = "[boundaries]\nlower = [-0.1, -0.1, 0.0]\nupper = [0.1, 0.1, 1.0]\nperiodic = [true, true, true]\n\
                 motion = { kind = \"shear\", rate = 1.0 }\n";
    refused(&format!("{bed}\n{moves}"), &["boundaries.motion", "clumps"]);
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
