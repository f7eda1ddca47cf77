//! Scenes with sections of one's own: checkpoints, stored packings, what is refused.

use crate::command::{colluvium, succeed, summary, value};
use serde_json::Value;
use std::path::Path;
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

/// A short run of the bundled example.
const SHORT: [&str; 4] = ["--set", "duration=0.05", "--set", "output.frames=2"];

fn run<'a>(out: &'a str, more: &[&'a str]) -> Vec<&'a str> {
    [&["run", "grains", "--out", out], &SHORT[..], more].concat()
}

fn hash(directory: &Path) -> Value {
    let summary = summary(directory);
    assert_eq!(summary["status"], "done");
    summary["state_hash"].clone()
}

/// Kills a run with a signal as soon as its log holds a word.
fn kill(folder: &Path, arguments: &[&str], out: &str, signal: &str, word: &str) {
    let mut child = Command::new(env!("CARGO_BIN_EXE_colluvium"))
        .args(arguments)
        .current_dir(folder)
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .spawn()
        .unwrap();
    let log = folder.join(out).join("log.txt");
    let start = Instant::now();
    let seen = || std::fs::read_to_string(&log).is_ok_and(|log| log.contains(word));
    while !seen() && start.elapsed() < Duration::from_secs(120) {
        std::thread::sleep(Duration::from_millis(5));
    }
    let id = child.id().to_string();
    let sent = Command::new("kill").args([signal, &id]).status().unwrap();
    assert!(sent.success());
    child.wait().unwrap();
}

#[test]
fn killed_anywhere_on_one_thread_or_two_it_ends_in_the_same_bits() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    succeed(folder.path(), &run("whole", &["--threads", "1"]));
    let whole = hash(&at("whole"));
    succeed(folder.path(), &run("two", &["--threads", "2"]));
    assert_eq!(hash(&at("two")), whole);
    // Without warning while grains are poured; on request after that; without warning after that.
    let cases = [
        ("early", "-KILL", "threads"),
        ("asked", "-INT", "pour:"),
        ("late", "-KILL", "packing:"),
    ];
    for (out, signal, word) in cases {
        kill(folder.path(), &run(out, &[]), out, signal, word);
        succeed(folder.path(), &run(out, &["--resume"]));
        assert_eq!(hash(&at(out)), whole, "{out}");
        for file in ["report.html", "packing.h5", "grains.vtkhdf", "history.csv"] {
            assert!(at(out).join(file).exists(), "{out}: {file}");
        }
        assert!(!at(out).join("frames").exists() && !at(out).join("checkpoint.h5").exists());
    }
    let found = summary(&at("whole"));
    assert_eq!(found["preparation"][0]["step"], "pour");
    assert_eq!(value(&found, "bonds"), 146.0);
    let report = std::fs::read_to_string(at("whole").join("report.html")).unwrap();
    assert!(report.contains("data:image/png;base64,") && report.contains("Kolmogorov"));
}

#[test]
fn a_packing_is_made_once_and_used_by_name_or_file() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    let named = ["--set", "packing=cup"];
    succeed(folder.path(), &run("first", &named));
    succeed(folder.path(), &run("second", &named));
    assert_eq!(hash(&at("first")), hash(&at("second")));
    let log = std::fs::read_to_string(at("second").join("log.txt")).unwrap();
    assert!(log.contains("stored packing") && !log.contains("pour:"));
    assert_eq!(
        summary(&at("first"))["preparation"],
        summary(&at("second"))["preparation"]
    );
    // What happens afterwards may differ, what it was made by may not.
    let other = [
        "--set",
        "packing=first/packing.h5",
        "--set",
        "bonds.sinter.gap=0.1",
    ];
    succeed(folder.path(), &run("other", &other));
    assert_ne!(hash(&at("first")), hash(&at("other")));
    for (key, set) in [
        ("seed", "seed=2"),
        ("contact.friction", "contact.friction=0.4"),
        ("grains.ice.parts", "grains.ice.parts=3"),
        ("walls.cup.radius", "walls.cup.radius=0.03"),
    ] {
        let refused = colluvium(
            folder.path(),
            &run("bad", &[&named[..], &["--set", set]].concat()),
        );
        let message = String::from_utf8_lossy(&refused.stderr).into_owned();
        assert_eq!(refused.status.code(), Some(2), "{message}");
        assert!(
            message.contains(key) && message.contains("packings/cup.h5"),
            "{message}"
        );
    }
    let whole = std::fs::read(at("packings").join("cup.h5")).unwrap();
    std::fs::write(at("packings").join("cup.h5"), &whole[..whole.len() / 2]).unwrap();
    let refused = colluvium(folder.path(), &run("bad", &named));
    assert_eq!(refused.status.code(), Some(2));
    assert!(!at("bad").exists());
}

/// Start and end of a run in which bonds break, averaged while it goes on.
const AVERAGED: [&str; 8] = [
    "--set",
    "timestep.seconds=1e-5",
    "--set",
    "output.frames=1",
    "--set",
    "output.average={geometry=\"plane\",every=0.05,width=0.003,cell=0.004,lower=[-0.03,-0.03,-0.01],upper=[0.03,0.03,0.06]}",
    "--set",
    "duration=0.05",
];

fn averaged<'a>(out: &'a str, more: &[&'a str]) -> Vec<&'a str> {
    run(out, &[&AVERAGED[..], more].concat())
}

/// Columns of a table by name.
fn columns(path: &Path) -> Vec<(String, Vec<f64>)> {
    let text = std::fs::read_to_string(path).unwrap();
    let mut lines = text.lines();
    let names = lines.next().unwrap().split(',');
    let mut columns: Vec<_> = names.map(|n| (n.to_owned(), Vec::new())).collect();
    for line in lines {
        for (column, word) in columns.iter_mut().zip(line.split(',')) {
            column.1.push(word.parse().unwrap());
        }
    }
    columns
}

#[test]
fn fields_gathered_on_the_way_are_those_of_the_files() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    succeed(folder.path(), &averaged("live", &["--threads", "2"]));
    let words = "coarse-grain --box=-0.03,0.03,-0.03,0.03,-0.01,0.06 --geometry plane --width 0.003 --cell 0.004 \
                 --gravity 0,0,-9.81 --out after live/grains.vtkhdf";
    succeed(folder.path(), &words.split_whitespace().collect::<Vec<_>>());
    let (live, after) = (
        columns(&at("live").join("fields.csv")),
        columns(&at("after").join("fields.csv")),
    );
    assert_eq!(live.len(), after.len());
    for ((name, live), (other, after)) in live.iter().zip(&after) {
        assert_eq!(name, other);
        let size = live.iter().fold(0.0, |a: f64, x| a.max(x.abs()));
        for (x, y) in live.iter().zip(after) {
            assert!((x - y).abs() <= 1e-9 * size, "{name}: {x} {y}");
        }
    }
    let sum = |name: &str| -> f64 {
        let column = live.iter().find(|c| c.0 == name).unwrap();
        column.1.iter().sum()
    };
    // Something moves, pushes and is bonded.
    assert!(sum("density") > 0.0 && sum("sc_zz") < 0.0 && sum("coordination") > 0.0);

    // Stopped on the way: the instant at the start is in the checkpoint. A signal that comes too early or too late, on a
    // machine with much to do, leaves none.
    let outs = ["stopped", "again", "once_more", "and_again", "at_last"];
    let on_the_way = |out: &&str| {
        kill(
            folder.path(),
            &averaged(out, &["--threads", "1"]),
            out,
            "-INT",
            "packing:",
        );
        at(out).join("checkpoint.h5").exists()
    };
    let stopped = outs.into_iter().find(on_the_way).unwrap();
    let again = averaged(stopped, &["--resume", "--threads", "1"]);
    succeed(folder.path(), &again);
    let bytes = |out: &str| std::fs::read(at(out).join("fields.csv")).unwrap();
    assert_eq!(bytes(stopped), bytes("live"));
}

#[test]
fn what_is_wrong_with_a_section_is_said_with_its_key() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("bad.stl"), "solid nothing\nendsolid").unwrap();
    for (set, words) in [
        ("walls.cup.radius=-1", &["walls.cup.radius", "-1"][..]),
        ("walls.cup.shape=cilinder", &["walls.cup.shape", "cylinder"]),
        ("walls.cup.radii=[1,2]", &["walls.cup.radii", "cylinder"]),
        (
            "walls.floor.axis=[0,0,0]",
            &["walls.floor.axis", "longer than 0"],
        ),
        (
            "walls.cup.material=glas",
            &["walls.cup.material", "glas", "glass"],
        ),
        (
            "walls.cup.motion.kind=turn",
            &["walls.cup.motion.kind", "rotation"],
        ),
        (
            "walls.cup.motion.rate=1",
            &["walls.cup.motion.rate", "sine"],
        ),
        ("walls.roof.point=[0,0,1]", &["walls.roof.shape", "missing"]),
        (
            "walls.lid={shape=\"mesh\",file=\"none.stl\"}",
            &["walls.lid", "none.stl"],
        ),
        ("walls.lid={shape=\"mesh\",file=\"bad.stl\"}", &["bad.stl"]),
        ("grains.ice.density=0", &["grains.ice.density", "0"]),
        (
            "grains.ice.sizes.law=power",
            &["grains.ice.sizes.law", "power-law"],
        ),
        (
            "grains.ice.sizes.largest=1e-4",
            &["grains.ice.sizes.largest", "smallest"],
        ),
        (
            "grains.ice.sizes.index=2",
            &["grains.ice.sizes.index", "Uniform"],
        ),
        (
            "grains.ice.contact={strength=3}",
            &["grains.ice.contact.strength"],
        ),
        ("surfaces.ice={contact={friction=1}}", &["surfaces.ice"]),
        (
            "bonds.sinter.materials=[\"water\"]",
            &["bonds.sinter.materials", "water", "ice"],
        ),
        (
            "bonds.sinter.radius_ratio=2",
            &["bonds.sinter.radius_ratio", "2"],
        ),
        (
            "cracks.one.within=[{shape=\"ball\",point=[0,0,0]}]",
            &["cracks.one.within[0].radius"],
        ),
        (
            "gravity.schedule=[[0,0,0,-1],[0,0,0,-2]]",
            &["gravity.schedule[1].time"],
        ),
        (
            "output.average={geometry=\"plane\",every=0.0}",
            &["output.average.every", "0"],
        ),
        (
            "output.average={geometry=\"points\",every=0.01}",
            &["output.average.points", "missing"],
        ),
        (
            "output.average={geometry=\"line\",every=0.01,axis=[0,0]}",
            &["output.average.axis"],
        ),
        (
            "output.average={geometry=\"line\",every=0.01,from=0.2,to=0.1}",
            &["output.average.to", "0.1"],
        ),
        ("gravity.file=none.csv", &["gravity.file", "none.csv", "gx"]),
        (
            "boundaries={lower=[0,0,0],upper=[1,1,-1]}",
            &["boundaries.upper[2]", "-1"],
        ),
        ("timestep.seconds=0.01", &["timestep", "unstable"]),
        ("prepare=[{do=\"insert\",count=3}]", &["prepare[0].within"]),
        (
            "prepare=[{do=\"relax\",count=3}]",
            &["prepare[0].count", "relax"],
        ),
        (
            "prepare=[{do=\"insert\",count=100000,within=[{shape=\"ball\",point=[0,0,0],radius=0.1}]}]",
            &["prepare[0].count", "100000", "within", "0.38"],
        ),
        (
            "prepare=[{do=\"insert\",count=3,within=[{shape=\"block\",lower=[0,0,0]}]}]",
            &["prepare[0]", "axis 0", "bounded"],
        ),
        (
            "prepare=[{do=\"stir\"}]",
            &["prepare[0].do", "stir", "pour"],
        ),
        ("contact.normal=hook", &["contact.normal", "hooke"]),
        ("duration=1e9", &["steps", "1e10"]),
        ("wals.cup.radius=1", &["wals", "walls"]),
    ] {
        let done = colluvium(
            folder.path(),
            &["run", "grains", "--out", "bad", "--set", set],
        );
        let message = String::from_utf8_lossy(&done.stderr).into_owned();
        assert_eq!(done.status.code(), Some(2), "{set}: {message}");
        for word in words {
            assert!(message.contains(word), "{set}: no `{word}` in: {message}");
        }
        assert!(!folder.path().join("bad").exists(), "{set}");
    }
}

/// Bodies may stand alone; without them and without grains there is nothing to run.
#[test]
fn a_scene_of_nothing_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let bundled = succeed(folder.path(), &["scenes", "show", "grains"]);
    let mut in_bodies = false;
    let without: Vec<&str> = bundled
        .lines()
        .filter(|line| {
            if line.starts_with('[') {
                in_bodies = line.starts_with("[bodies") || line.starts_with("[[bodies");
            }
            !in_bodies
        })
        .collect();
    std::fs::write(folder.path().join("own.toml"), without.join("\n")).unwrap();
    let list = ["run", "own.toml", "--out", "bad", "--set", "prepare=[]"];
    let refused = colluvium(folder.path(), &list);
    let message = String::from_utf8_lossy(&refused.stderr).into_owned();
    assert_eq!(refused.status.code(), Some(2), "{message}");
    for word in ["own.toml", "prepare", "packing"] {
        assert!(message.contains(word), "no `{word}` in: {message}");
    }
    assert!(!folder.path().join("bad").exists());
}
