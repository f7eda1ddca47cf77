//! Places that cannot be written: a clear message, and the last good state is left.

use crate::command::{colluvium, hash, pause, succeed, summary};
use std::path::Path;
use std::process::{Command, Output};

const SMALL: [&str; 8] = [
    "--set",
    "scale=0.5",
    "--set",
    "steps=400",
    "--set",
    "record_every=100",
    "--checkpoint-every",
    "0",
];

/// Runs `colluvium` with files of at most so many blocks of 512 bytes: writing more fails as it does on a
/// full disk.
fn limited(folder: &Path, blocks: u32, arguments: &[&str]) -> Output {
    let program = env!("CARGO_BIN_EXE_colluvium");
    let line = format!("trap '' XFSZ; ulimit -f {blocks}; exec \"$0\" \"$@\"");
    Command::new("sh")
        .args(["-c", &line, program])
        .args(arguments)
        .current_dir(folder)
        .output()
        .unwrap()
}

#[test]
fn a_disk_that_fills_up_ends_the_run_and_leaves_the_last_good_state() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    let run = |out: &'static str, more: &[&'static str]| {
        [&["run", "settle", "--out", out][..], &SMALL, more].concat()
    };
    succeed(folder.path(), &run("whole", &["--set", "frames=0"]));
    // A checkpoint of 2 500 grains takes some 350 kB, a frame of them more than 150 kB.
    for (blocks, frames, what) in [
        (500, "frames=0", "checkpoint.h5"),
        (200, "frames=4", "frames"),
    ] {
        let _ = std::fs::remove_dir_all(at("a"));
        let failed = limited(folder.path(), blocks, &run("a", &["--set", frames]));
        let message = String::from_utf8_lossy(&failed.stderr).into_owned();
        assert_eq!(failed.status.code(), Some(1), "{message}");
        assert!(
            message.contains(what) && message.contains("File too large"),
            "{message}"
        );
        assert!(!message.contains("panicked"), "{message}");
        assert_eq!(summary(&at("a"))["status"], "failed");
        let left = std::fs::read_dir(at("a")).unwrap().flatten();
        let mut names = left.map(|e| e.file_name().into_string().unwrap());
        assert!(!names.any(|name| name.ends_with("partial")));
        // With room again it goes on.
        succeed(folder.path(), &run("a", &["--set", frames, "--resume"]));
        assert_eq!(hash(&at("a")), hash(&at("whole")));
    }
    // A checkpoint that stands is kept when the next one does not fit.
    let _ = std::fs::remove_dir_all(at("a"));
    let half = run("a", &["--set", "frames=0"]);
    let failed = limited(folder.path(), 500, &half);
    assert!(String::from_utf8_lossy(&failed.stderr).contains("none was written before"));
    let mut child = Command::new(env!("CARGO_BIN_EXE_colluvium"))
        .args(half.iter().chain(&["--resume"]))
        .current_dir(folder.path())
        .stdout(std::process::Stdio::null())
        .spawn()
        .unwrap();
    while !at("a").join("checkpoint.h5").exists() && child.try_wait().unwrap().is_none() {
        pause();
    }
    child.kill().unwrap();
    child.wait().unwrap();
    let saved = std::fs::read(at("a").join("checkpoint.h5")).unwrap();
    let resume = run("a", &["--set", "frames=0", "--resume"]);
    let failed = limited(folder.path(), 500, &resume);
    let message = String::from_utf8_lossy(&failed.stderr).into_owned();
    assert!(message.contains("the last one is kept"), "{message}");
    assert_eq!(std::fs::read(at("a").join("checkpoint.h5")).unwrap(), saved);
    succeed(folder.path(), &resume);
    assert_eq!(hash(&at("a")), hash(&at("whole")));
}

#[test]
fn places_that_cannot_be_written_are_bad_input() {
    let folder = tempfile::tempdir().unwrap();
    // No process may make a folder here, not even root's.
    for out in ["/proc/colluvium", "/sys/kernel/colluvium", "/dev/null/a"] {
        let refused = colluvium(folder.path(), &["run", "two-spheres", "--out", out]);
        let message = String::from_utf8_lossy(&refused.stderr).into_owned();
        assert_eq!(refused.status.code(), Some(2), "{message}");
        assert!(
            message.contains(out) && message.contains("cannot write"),
            "{message}"
        );
        assert!(!Path::new(out).exists());
    }
    let missing = ["run", "two-spheres", "--out", "nowhere", "--resume"];
    let refused = colluvium(folder.path(), &missing);
    assert_eq!(refused.status.code(), Some(2));
    assert!(String::from_utf8_lossy(&refused.stderr).contains("nowhere"));
    assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 0);
}

#[test]
fn a_folder_that_goes_away_during_a_run_is_said() {
    let folder = tempfile::tempdir().unwrap();
    let a = folder.path().join("a");
    let arguments = [&["run", "settle", "--out", "a"][..], &SMALL].concat();
    let child = Command::new(env!("CARGO_BIN_EXE_colluvium"))
        .args(&arguments)
        .current_dir(folder.path())
        .stdout(std::process::Stdio::null())
        .stderr(std::process::Stdio::piped())
        .spawn()
        .unwrap();
    while !a.join("log.txt").exists() {
        pause();
    }
    // Another name is as good as none: nothing writes there any more.
    std::fs::rename(&a, folder.path().join("b")).unwrap();
    let done = child.wait_with_output().unwrap();
    let message = String::from_utf8_lossy(&done.stderr).into_owned();
    assert_eq!(done.status.code(), Some(1), "{message}");
    assert!(message.contains("No such file or directory"), "{message}");
    assert!(!message.contains("panicked"), "{message}");
}
