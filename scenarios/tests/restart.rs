//! The same bits for any number of threads, and after an interruption.

use crate::command::{colluvium, hash, succeed, summary};
use colluvium::checkpoint::Checkpoints;
use std::path::Path;
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

/// A small, soft and short incline: seconds, not minutes.
const SMALL: &[&str] = &[
    "--set",
    "scale=0.85",
    "--set",
    "grains.count=300",
    "--set",
    "contact.stiffness_scaled=2e3",
    "--set",
    "time.relax=0.3",
    "--set",
    "time.average=0.3",
    "--set",
    "time.limit=0.9",
];

fn arguments<'a>(command: &'a str, out: &'a str, more: &[&'a str]) -> Vec<&'a str> {
    let mut list = vec![command, "incline-moderate", "--out", out];
    list.extend(SMALL);
    list.extend(more);
    list
}

/// Interrupts the command once `ready` holds; gives its exit status.
fn interrupt(folder: &Path, arguments: &[&str], ready: impl Fn() -> bool) -> Option<i32> {
    let mut child = Command::new(env!("CARGO_BIN_EXE_colluvium"))
        .args(arguments)
        .current_dir(folder)
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .spawn()
        .unwrap();
    let start = Instant::now();
    while !ready() && start.elapsed() < Duration::from_secs(120) {
        std::thread::sleep(Duration::from_millis(20));
    }
    let id = child.id().to_string();
    assert!(
        Command::new("kill")
            .args(["-INT", &id])
            .status()
            .unwrap()
            .success()
    );
    child.wait().unwrap().code()
}

#[test]
fn threads_do_not_change_a_bit() {
    let folder = tempfile::tempdir().unwrap();
    for (threads, out) in [("1", "one"), ("2", "two")] {
        succeed(
            folder.path(),
            &arguments("run", out, &["--threads", threads]),
        );
    }
    assert_eq!(
        hash(&folder.path().join("one")),
        hash(&folder.path().join("two"))
    );
}

#[test]
fn an_interrupted_run_goes_on_to_the_same_state() {
    let folder = tempfile::tempdir().unwrap();
    let whole = folder.path().join("whole");
    let parts = folder.path().join("parts");
    succeed(folder.path(), &arguments("run", "whole", &[]));
    let log = || std::fs::read_to_string(parts.join("log.txt")).unwrap_or_default();
    // The bed is logged when it has settled: before that an interruption falls into it, then into the flow.
    let status = interrupt(folder.path(), &arguments("run", "parts", &[]), || {
        log().contains("run incline-moderate")
    });
    assert_eq!(status, Some(130));
    let remarks = summary(&parts)["remarks"].to_string();
    assert!(remarks.contains("goes on from what was saved"), "{remarks}");
    assert!(log().contains("checkpoint (bed)"), "{}", log());
    let resume = arguments("run", "parts", &["--resume"]);
    let status = interrupt(folder.path(), &resume, || log().contains("bed:"));
    assert_eq!(status, Some(130));
    assert_eq!(summary(&parts)["status"], "interrupted");
    let checkpoint = parts.join("checkpoint.h5");
    let saved = std::fs::read(&checkpoint).unwrap();

    // A truncated checkpoint without one before it, that of the bed, is refused, and nothing is touched.
    std::fs::remove_file(parts.join("checkpoint_before.h5")).unwrap();
    std::fs::write(&checkpoint, &saved[..saved.len() / 3]).unwrap();
    let refused = colluvium(folder.path(), &arguments("run", "parts", &["--resume"]));
    assert_eq!(refused.status.code(), Some(2));
    let message = String::from_utf8_lossy(&refused.stderr).into_owned();
    assert!(message.contains("checkpoint.h5"), "{message}");
    assert_eq!(std::fs::read(&checkpoint).unwrap().len(), saved.len() / 3);
    // So is a whole one that lacks a part of the state, and the run still counts as interrupted.
    std::fs::write(&checkpoint, &saved).unwrap();
    let mut checkpoints = Checkpoints::of(&parts);
    let (mut state, _) = checkpoints.read("incline-moderate").unwrap().unwrap();
    state.record.numbers.clear();
    checkpoints.write("incline-moderate", &state).unwrap();
    std::fs::remove_file(parts.join("checkpoint_before.h5")).unwrap();
    let refused = colluvium(folder.path(), &arguments("run", "parts", &["--resume"]));
    assert_eq!(refused.status.code(), Some(2));
    assert_eq!(summary(&parts)["status"], "interrupted");
    // A new file: a child of a test beside this one may have inherited the lock of the one written above.
    std::fs::remove_file(&checkpoint).unwrap();
    std::fs::write(&checkpoint, &saved).unwrap();

    // Another scene is refused.
    let other = colluvium(
        folder.path(),
        &arguments("run", "parts", &["--resume", "--set", "slope_degrees=30"]),
    );
    assert_eq!(other.status.code(), Some(2));
    assert!(String::from_utf8_lossy(&other.stderr).contains("slope_degrees"));

    succeed(folder.path(), &arguments("run", "parts", &["--resume"]));
    assert_eq!(hash(&parts), hash(&whole));
    let profile = |d: &Path| std::fs::read_to_string(d.join("profile.csv")).unwrap();
    assert_eq!(profile(&parts), profile(&whole));
    assert!(!checkpoint.exists());
}

#[test]
fn a_campaign_without_a_law_says_so_and_keeps_its_results() {
    let folder = tempfile::tempdir().unwrap();
    // Too shallow and too short for a single point away from base and surface.
    let sets = [
        "scale=0.85",
        "grains.count=400",
        "contact.stiffness_scaled=1e3",
        "time.relax=0.1",
        "time.average=0.15",
        "time.limit=0.3",
        "calibration.flow_degrees=[33, 36]",
        "calibration.search_time=0.1",
        "calibration.stop.resolution=8",
        "calibration.onset.resolution=10",
        "calibration.compare_degrees=[33, 50]",
    ];
    let mut arguments = vec!["calibrate", "incline-moderate", "--out", "c"];
    for set in sets {
        arguments.extend(["--set", set]);
    }
    let done = colluvium(folder.path(), &arguments);
    let message = String::from_utf8_lossy(&done.stderr);
    assert_eq!(done.status.code(), Some(0), "{message}");
    assert!(
        message.contains("No rheology.toml was written"),
        "{message}"
    );
    let c = folder.path().join("c");
    assert!(!c.join("rheology.toml").exists() && c.join("campaign.json").exists());
    let summary = summary(&c);
    assert_eq!(summary["status"], "done");
    assert_eq!(summary["results"]["good"]["value"], 0.0);
    let remarks = summary["remarks"].to_string();
    assert!(remarks.contains("No rheology.toml") && remarks.contains("not compared"));
}

#[test]
fn a_stopped_campaign_keeps_its_angles_and_ends_the_same() {
    let folder = tempfile::tempdir().unwrap();
    // Deep enough to have layers away from base and surface.
    let short = [
        "--set",
        "grains.count=900",
        "--set",
        "calibration.flow_degrees=[31, 33, 36]",
        "--set",
        "calibration.search_time=0.3",
        "--set",
        "calibration.stop.resolution=8",
        "--set",
        "calibration.onset.resolution=10",
        "--set",
        "calibration.compare_degrees=[33]",
        "--set",
        "calibration.compare_cells=16",
    ];
    // Flows this short do not always determine a law: the first seed that does, begun with one that did.
    let whole = folder.path().join("whole");
    let seeds = [3].into_iter().chain(1..=8);
    let seed = seeds.map(|seed| format!("seed={seed}")).find(|seed| {
        let one = [&short[..], &["--set", seed, "--threads", "1"]].concat();
        let done = colluvium(folder.path(), &arguments("calibrate", "whole", &one));
        assert!(done.status.success());
        whole.join("rheology.toml").exists()
    });
    let seed = seed.unwrap();
    let short = [&short[..], &["--set", &seed]].concat();
    let parts = folder.path().join("parts");
    let angles = parts.join("angles.json");
    let status = interrupt(
        folder.path(),
        &arguments("calibrate", "parts", &short),
        || angles.exists(),
    );
    assert_eq!(status, Some(130));
    let log = || std::fs::read_to_string(parts.join("log.txt")).unwrap();
    let resumed = [&short[..], &["--resume"]].concat();
    succeed(folder.path(), &arguments("calibrate", "parts", &resumed));
    assert!(log().contains("finished before"), "{}", log());
    assert_eq!(hash(&parts), hash(&whole));
    for file in ["rheology.toml", "points.csv"] {
        let bytes = |d: &Path| std::fs::read(d.join(file)).unwrap();
        assert_eq!(bytes(&parts), bytes(&whole), "{file}");
    }
    // A finished campaign is not made again.
    let again = succeed(folder.path(), &arguments("calibrate", "parts", &resumed));
    assert!(again.contains("already done"), "{again}");
    // Its record is of a version that this one does not read: its runs are not made again, and say the same.
    std::fs::write(parts.join("campaign.json"), "{}").unwrap();
    succeed(folder.path(), &arguments("calibrate", "parts", &resumed));
    assert!(log().contains("evaluated again"), "{}", log());
    assert_eq!(hash(&parts), hash(&whole));
    // Its bed is softer than the thesis' and LAMMPS' material: nothing published is set beside it.
    let page = std::fs::read_to_string(parts.join("report.html")).unwrap();
    assert!(!page.contains("Table 2.6 beside") && !page.contains("LAMMPS"));

    let law = std::fs::read_to_string(parts.join("rheology.toml")).unwrap();
    for key in [
        "mu_s",
        "mu_2_error",
        "valid_i",
        "covariance",
        "identified",
        "good",
        "[mu_zz]",
        "[provenance]",
    ] {
        assert!(law.contains(key), "{key} is not in {law}");
    }
    let page = std::fs::read_to_string(parts.join("report.html")).unwrap();
    for part in ["Angles tried", "grain-steps"] {
        assert!(page.contains(part), "{part}");
    }
    succeed(
        folder.path(),
        &[
            "run",
            "bagnold",
            "--set",
            "rheology.file=parts/rheology.toml",
            "--set",
            "slope_degrees=20",
            "--out",
            "b",
        ],
    );
}
