//! What a user does by mistake does not cost a run: signals that come twice, a forgotten `--resume`, a second process,
//! files that change, a stdout that takes nothing.

use crate::command::{colluvium, hash, pause, succeed, summary};
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Output, Stdio};
use std::time::{Duration, Instant};

/// A run that takes far longer than its test.
const LONG: [&str; 10] = [
    "run",
    "settle",
    "--out",
    "a",
    "--checkpoint-every",
    "0",
    "--set",
    "steps=100000000",
    "--set",
    "frames=0",
];

/// The grains that it begins from.
const START: &str = "radius,density,x,y,z,vx,vy,vz\n0.002,2500,0.02,0.02,0.01,0,0,0\n0.002,2500,0.06,0.06,0.01,0,0,0\n";

fn start(folder: &Path, arguments: &[&str]) -> Child {
    Command::new(env!("CARGO_BIN_EXE_colluvium"))
        .args(arguments)
        .current_dir(folder)
        .stdout(Stdio::null())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap()
}

fn wait_for(what: &str, there: impl Fn() -> bool) {
    let begin = Instant::now();
    while !there() {
        assert!(begin.elapsed() < Duration::from_secs(120), "{what}");
        pause();
    }
}

fn interrupt(child: &Child) {
    let id = child.id().to_string();
    let sent = Command::new("kill").args(["-INT", &id]).status().unwrap();
    assert!(sent.success());
}

fn message(done: &Output) -> String {
    String::from_utf8_lossy(&done.stderr).into_owned()
}

/// A long run of few grains from a file that has written a checkpoint.
fn begun(more: &[&str]) -> (tempfile::TempDir, Vec<String>, Child) {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("start.csv"), START).unwrap();
    let own = ["--set", "start=\"start.csv\""];
    let arguments: Vec<&str> = LONG.iter().chain(&own).chain(more).copied().collect();
    let child = start(folder.path(), &arguments);
    let checkpoint = folder.path().join("a/checkpoint.h5");
    wait_for("a checkpoint", || checkpoint.exists());
    let arguments = arguments.into_iter().map(String::from).collect();
    (folder, arguments, child)
}

/// Every argument list, each with another word at its end, is refused with all of these words.
fn refused(folder: &Path, arguments: &[String], more: &str, words: &[&str]) {
    let list: Vec<&str> = arguments.iter().map(String::as_str).collect();
    let list = [&list[..], &[more][..usize::from(!more.is_empty())]].concat();
    let done = colluvium(folder, &list);
    let said = message(&done);
    assert_eq!(done.status.code(), Some(2), "{list:?}: {said}");
    for word in words {
        assert!(said.contains(word), "{list:?}: `{word}` is not in: {said}");
    }
}

#[test]
fn a_signal_that_comes_twice_writes_its_checkpoint() {
    let (folder, _, child) = begun(&[]);
    for _ in 0..5 {
        interrupt(&child);
    }
    let done = child.wait_with_output().unwrap();
    let said = message(&done);
    assert_eq!(done.status.code(), Some(130), "{said}");
    for words in ["press again", "goes on from what was saved"] {
        assert_eq!(said.matches(words).count(), 1, "{said}");
    }
    assert!(!said.contains("abandoned"), "{said}");
    let a = folder.path().join("a");
    assert!(a.join("checkpoint.h5").exists());
    assert_eq!(summary(&a)["status"], "interrupted");
}

/// A step of this continuum takes far longer than the two seconds within which signals count as one.
#[test]
fn a_later_press_abandons_the_run_and_its_summary_says_so() {
    let folder = tempfile::tempdir().unwrap();
    let log = folder.path().join("a/log.txt");
    // Some 50 000 cells: the first step takes several seconds, and nothing looks at signals within one.
    let set = ["--set", "grid.cells=400", "--set", "grid.length_scaled=2.5"];
    let run = ["run", "column-collapse", "--threads", "1", "--out", "a"];
    let mut child = start(folder.path(), &[&run[..], &set].concat());
    wait_for("a log", || {
        fs::read_to_string(&log).is_ok_and(|log| log.contains("threads"))
    });
    std::thread::sleep(Duration::from_millis(500));
    interrupt(&child);
    std::thread::sleep(Duration::from_millis(2500));
    assert!(child.try_wait().unwrap().is_none(), "its step was over");
    interrupt(&child);
    let done = child.wait_with_output().unwrap();
    assert_eq!(done.status.code(), Some(130));
    assert!(message(&done).contains("abandoned"), "{}", message(&done));
    let found = summary(&folder.path().join("a"));
    assert_eq!(found["status"], "interrupted");
    assert!(found["remarks"].to_string().contains("abandoned"));
}

#[test]
fn a_run_that_can_be_gone_on_with_is_replaced_only_if_that_is_asked_for() {
    let (folder, arguments, child) = begun(&[]);
    interrupt(&child);
    child.wait_with_output().unwrap();
    let checkpoint = folder.path().join("a/checkpoint.h5");
    let saved = fs::read(&checkpoint).unwrap();
    let words = [
        "--out a",
        "settle",
        "--resume",
        "--overwrite",
        "checkpoint.h5",
    ];
    let other = ["run", "two-spheres", "--out", "a"].map(String::from);
    refused(folder.path(), &arguments, "", &words);
    refused(folder.path(), &other, "", &words);
    let both = [&other[..], &["--resume".to_owned()]].concat();
    refused(
        folder.path(),
        &both,
        "--overwrite",
        &["cannot be used with"],
    );
    assert_eq!(fs::read(&checkpoint).unwrap(), saved);
    assert_eq!(summary(&folder.path().join("a"))["scene"], "settle");
    succeed(
        folder.path(),
        &["run", "two-spheres", "--out", "a", "--overwrite"],
    );
    assert!(!checkpoint.exists());
    // What is finished may be replaced as it is.
    succeed(folder.path(), &["run", "two-spheres", "--out", "a"]);
}

#[test]
fn a_directory_has_one_process() {
    let (folder, arguments, mut child) = begun(&[]);
    let pid = format!("(pid {})", child.id());
    let words = ["--out a", "in use by another process", &pid];
    let other = ["run", "two-spheres", "--out", "a"].map(String::from);
    for more in ["", "--resume", "--overwrite"] {
        refused(folder.path(), &arguments, more, &words);
    }
    refused(folder.path(), &other, "--overwrite", &words);
    assert!(child.try_wait().unwrap().is_none());
    // What holds it dies with the process.
    child.kill().unwrap();
    child.wait().unwrap();
    succeed(
        folder.path(),
        &["run", "two-spheres", "--out", "a", "--overwrite"],
    );
}

#[test]
fn a_run_goes_on_from_the_same_files_only() {
    let (folder, mut arguments, child) = begun(&[]);
    interrupt(&child);
    child.wait_with_output().unwrap();
    let at = |name: &str| -> PathBuf { folder.path().join(name) };
    let saved = fs::read(at("a/checkpoint.h5")).unwrap();
    fs::write(at("start.csv"), START.replace("0.06,0.06", "0.06,0.05")).unwrap();
    refused(
        folder.path(),
        &arguments,
        "--resume",
        &["start.csv", "have changed"],
    );
    assert_eq!(fs::read(at("a/checkpoint.h5")).unwrap(), saved);
    assert_eq!(summary(&at("a"))["status"], "interrupted");
    // With the file as it was it goes on.
    fs::write(at("start.csv"), START).unwrap();
    arguments.push("--resume".into());
    let list: Vec<&str> = arguments.iter().map(String::as_str).collect();
    let child = start(folder.path(), &list);
    let log = || fs::read_to_string(at("a/log.txt")).unwrap();
    wait_for("it goes on", || log().contains("resumed"));
    interrupt(&child);
    assert_eq!(child.wait_with_output().unwrap().status.code(), Some(130));
}

/// The packing is that of another wall, though its file has the same name.
#[test]
fn a_named_packing_is_that_of_its_files() {
    let folder = tempfile::tempdir().unwrap();
    let bowl = |depth: f64| {
        let z = -depth;
        let text = format!("v -1 -1 {z}\nv 1 -1 {z}\nv 1 1 {z}\nv -1 1 {z}\nf 1 2 3 4\n");
        fs::write(folder.path().join("floor.obj"), text).unwrap();
    };
    let scene = "scene = \"grains\"\nseed = 5\nduration = 0.001\npacking = \"kept\"\noutput = { rows = 2, pictures = 0 }\n\
        [contact]\nnormal = \"hertz\"\nyoungs_modulus = 1.0e6\npoissons_ratio = 0.3\nrestitution = 0.4\nfriction = 0.4\n\
        [grains.ball]\ndensity = 1000.0\nsizes = { law = \"equal\", radius = 0.005 }\n\
        [walls.floor]\nshape = \"mesh\"\nfile = \"floor.obj\"\n\
        [[prepare]]\ndo = \"insert\"\ncount = 10\nwithin = [{ shape = \"block\", lower = [0.0, 0.0, 0.0], upper = [0.1, 0.1, 0.1] }]\n";
    fs::write(folder.path().join("own.toml"), scene).unwrap();
    bowl(0.01);
    succeed(folder.path(), &["run", "own.toml", "--out", "a"]);
    let again = ["run", "own.toml", "--out", "b"].map(String::from);
    bowl(0.02);
    refused(
        folder.path(),
        &again,
        "",
        &["kept.h5", "contents.", "floor.obj"],
    );
    bowl(0.01);
    succeed(folder.path(), &["run", "own.toml", "--out", "b"]);
    let [a, b] = ["a", "b"].map(|name| hash(&folder.path().join(name)));
    assert_eq!(a, b);
}

#[test]
fn a_campaign_that_cannot_save_its_runs_ends() {
    let folder = tempfile::tempdir().unwrap();
    let sets = [
        "scale=0.85",
        "grains.count=300",
        "contact.stiffness_scaled=1e3",
        "time.relax=0.1",
        "time.average=0.15",
        "time.limit=0.3",
        "calibration.flow_degrees=[33, 36]",
        "calibration.search_time=0.1",
    ];
    let mut list = vec![
        "calibrate",
        "incline-moderate",
        "--threads",
        "1",
        "--out",
        "c",
    ];
    for set in sets {
        list.extend(["--set", set]);
    }
    let child = start(folder.path(), &list);
    let c = folder.path().join("c");
    wait_for("a log", || c.join("log.txt").exists());
    // The temporary name is taken by a folder: as good as a full disk.
    fs::create_dir(c.join("angles.json.partial")).unwrap();
    let done = child.wait_with_output().unwrap();
    let said = message(&done);
    assert_eq!(done.status.code(), Some(1), "{said}");
    assert!(
        said.contains("cannot write") && said.contains("angles.json"),
        "{said}"
    );
    assert_eq!(summary(&c)["status"], "failed");
    let log = fs::read_to_string(c.join("log.txt")).unwrap();
    assert_eq!(log.matches(" is done: ").count(), 1, "{log}");
    fs::remove_dir(c.join("angles.json.partial")).unwrap();
}

#[test]
fn a_stdout_that_takes_nothing_is_said_and_one_that_has_gone_is_not() {
    let folder = tempfile::tempdir().unwrap();
    let full = || fs::File::options().write(true).open("/dev/full").unwrap();
    let run = |arguments: &[&str], out: Stdio| {
        Command::new(env!("CARGO_BIN_EXE_colluvium"))
            .args(arguments)
            .current_dir(folder.path())
            .stdout(out)
            .stderr(Stdio::piped())
            .spawn()
            .unwrap()
    };
    for arguments in [
        &["schema"][..],
        &["scenes"],
        &["plan", "two-spheres"],
        &["check", "two-spheres"],
        &["run", "two-spheres", "--out", "a"],
    ] {
        let done = run(arguments, full().into()).wait_with_output().unwrap();
        let said = message(&done);
        assert_eq!(done.status.code(), Some(1), "{arguments:?}: {said}");
        assert!(
            said.contains("stdout") && !said.contains("panicked"),
            "{said}"
        );
        let mut child = run(arguments, Stdio::piped());
        drop(child.stdout.take());
        let done = child.wait_with_output().unwrap();
        let said = message(&done);
        assert_eq!(
            (done.status.code(), said.as_str()),
            (Some(0), ""),
            "{arguments:?}"
        );
    }
}
