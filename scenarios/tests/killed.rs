//! Runs that are killed or stopped at any moment go on to the same state.

use crate::command::{
    CORE, FRONT_ON_A_SLOPE, INSTALMENTS, INTERVAL, MOVING_EDGE, SMALL_COMET_CLIFF, SMALL_HYBRID,
    SMALL_JOINED_COLUMN, colluvium, hash, pause, succeed, summary, table,
};
use crate::own_scenes::preparations::{BASE, EQUAL, TUBE};
use crate::packings::{COMET_CLIFF, JOINED_COLUMN, Kept, WIDE_COLUMN};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

/// Files of frames.
const SERIES: [&str; 3] = ["grains.vtkhdf", "contacts.vtkhdf", "continuum.vtkhdf"];

/// Longest wait for anything.
const PATIENCE: Duration = Duration::from_secs(120);

fn start(folder: &Path, arguments: &[&str]) -> Child {
    Command::new(env!("CARGO_BIN_EXE_colluvium"))
        .args(arguments)
        .current_dir(folder)
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .spawn()
        .unwrap()
}

/// Starts a run and kills it as soon as `now` says so; false where it was done before that.
fn kill(folder: &Path, arguments: &[&str], mut now: impl FnMut() -> bool) -> bool {
    let mut child = start(folder, arguments);
    let begin = Instant::now();
    while !now() && begin.elapsed() < PATIENCE {
        if let Some(status) = child.try_wait().unwrap() {
            assert!(status.success(), "{arguments:?} failed by itself");
            return false;
        }
        pause();
    }
    child.kill().unwrap();
    child.wait().unwrap().code().is_none()
}

/// Points and times of all frames of a series.
fn frames(path: &Path) -> Vec<u64> {
    let root = hdf5::File::open(path).unwrap().group("VTKHDF").unwrap();
    ["Points", "Steps/Values"]
        .iter()
        .flat_map(|name| root.dataset(name).unwrap().read_raw::<f64>().unwrap())
        .map(f64::to_bits)
        .collect()
}

/// Whether a folder holds a file that is just being written.
fn unfinished(folder: &Path) -> bool {
    std::fs::read_dir(folder).is_ok_and(|entries| {
        entries.flatten().any(|entry| {
            let name = entry.file_name().into_string().unwrap_or_default();
            name.ends_with("h5.partial") || name.ends_with("vtkhdf.partial")
        })
    })
}

/// Runs a scene whole on one thread, and on two in parts that are killed at random moments, in the middle of a checkpoint
/// and, where one is caught, of a frame; both must end in the same state, rows and frames. Gives the folder of both.
fn killed_and_whole(
    packing: Option<&Kept>,
    (scene, sets): (&str, &[&str]),
    seed: u64,
    random_kills: u32,
) -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    if let Some(packing) = packing {
        packing.put(folder.path());
    }
    if scene == OWN_FILE {
        std::fs::write(folder.path().join(OWN_FILE), prepared()).unwrap();
    }
    let arguments = |out: &'static str, more: &[&'static str]| {
        let mut list = vec!["run", scene, "--out", out];
        for set in sets {
            list.extend(["--set", set]);
        }
        list.extend(more);
        list
    };
    let begin = Instant::now();
    succeed(folder.path(), &arguments("whole", &["--threads", "1"]));
    let duration = begin.elapsed();
    let [whole, parts] = ["whole", "parts"].map(|name| folder.path().join(name));

    let mut random = ChaCha8Rng::seed_from_u64(seed);
    // What is cut in the middle of a file writes one at every chance, which are ten thousands in a run that exchanges; the rest
    // some fifty.
    let now_and_then = format!("{:.4}", duration.as_secs_f64() / 50.0);
    let resume = |every: &str, now: &mut dyn FnMut() -> bool| {
        // Before its first file stands a run is begun, not resumed.
        let begun = parts.join("summary.json").exists();
        let more = &["--threads", "2", "--resume"];
        let more = &more[..if begun { 3 } else { 2 }];
        let mut list = arguments("parts", more);
        list.extend(["--checkpoint-every", every]);
        kill(folder.path(), &list, now)
    };
    let mut kills = 0;
    // In the middle of writing a checkpoint, and, where there are any, a frame: who waits for one that never comes lets the run
    // end, and nothing is left to be killed.
    let mut cut = [0; 2];
    let framed = SERIES.iter().any(|name| whole.join(name).exists());
    let places = [parts.clone(), parts.join("frames")];
    for (k, place) in places.iter().take(1 + usize::from(framed)).enumerate() {
        for _ in 0..6 {
            let every = ["0", &now_and_then][k];
            if cut[k] < 2 && resume(every, &mut || unfinished(place)) {
                kills += 1;
                cut[k] += u32::from(unfinished(place));
            }
        }
    }
    let mut at_random = 0;
    for _ in 0..random_kills {
        let wait = duration.mul_f64(random.random_range(0.0..0.3));
        let begin = Instant::now();
        at_random += u32::from(resume(&now_and_then, &mut || begin.elapsed() > wait));
    }
    kills += at_random;
    // What waits for a frame that is cut may have let the run end.
    assert!(framed || at_random > 0);
    println!("{scene}: {duration:.1?} whole, {kills} kills, {cut:?} in checkpoints and frames");
    assert!(kills > 0 && cut[0] > 0, "{kills} {cut:?}");
    let last = arguments("parts", &["--threads", "2", "--resume"]);
    let last = colluvium(folder.path(), &last);
    assert!(last.status.success(), "{last:?}");
    assert_eq!(hash(&parts), hash(&whole));
    let series = ["energy.csv", "history.csv"].map(|name| (whole.join(name), parts.join(name)));
    let series: Vec<_> = series.iter().filter(|(whole, _)| whole.exists()).collect();
    assert!(!series.is_empty());
    for (whole, parts) in series {
        assert_eq!(std::fs::read(parts).unwrap(), std::fs::read(whole).unwrap());
    }
    for name in SERIES {
        if whole.join(name).exists() {
            assert_eq!(frames(&parts.join(name)), frames(&whole.join(name)));
        }
    }
    let listing = |d: &Path| {
        let entries = std::fs::read_dir(d).unwrap().flatten();
        let mut names: Vec<_> = entries.map(|e| e.file_name()).collect();
        names.sort();
        names
    };
    assert_eq!(
        listing(&parts),
        listing(&whole),
        "something was left behind"
    );
    folder
}

const OWN_FILE: &str = "own.toml";

/// A scene of preparation: grains inserted, at rest, more poured on them, gravity that falls in stages.
fn prepared() -> String {
    let within = |low: f64, high: f64| {
        format!(
            "within = [{{ shape = \"cylinder\", axis = [0.0, 0.0, 1.0], point = [0.0, 0.0, 0.0], radius = 0.029 }}, \
             {{ shape = \"block\", lower = [-1.0, -1.0, {low:?}], upper = [1.0, 1.0, {high:?}] }}]\n"
        )
    };
    let sizes = "[grains.ball]\ndensity = 1000.0\n\
                 sizes = { law = \"uniform\", smallest = 4.0e-3, largest = 5.0e-3 }\n";
    let (below, above) = (within(0.0, 0.1), within(0.08, 0.15));
    let steps = format!(
        "\n[[prepare]]\ndo = \"insert\"\ncount = 150\n{below}\n[[prepare]]\ndo = \"relax\"\n\
         \n[[prepare]]\ndo = \"pour\"\ncount = 100\n{above}\
         \n[[prepare]]\ndo = \"stages\"\ngravities = [9.81, 1.0e-1]\n"
    );
    [BASE, sizes, TUBE, &steps].concat()
}

#[test]
fn a_killed_preparation_goes_on() {
    let folder = killed_and_whole(None, (OWN_FILE, &[]), 31, 5);
    let log =
        |name: &str| std::fs::read_to_string(folder.path().join(name).join("log.txt")).unwrap();
    let times = |text: &str| log("parts").matches(text).count();
    let (again, begun) = (times("goes on"), times("was done before"));
    assert!(again > 0 && begun > 0, "{}", log("parts"));
    assert_eq!(log("whole").matches("goes on").count(), 0);
    let notes = |name: &str| summary(&folder.path().join(name))["preparation"].clone();
    assert_eq!(notes("parts"), notes("whole"));
    let steps = |name: &str| summary(&folder.path().join(name))["cost"]["grain_steps"].clone();
    assert_eq!(steps("parts"), steps("whole"));
}

/// Ctrl-C in a step and what the messages say; a state that is cut, a step's file that is, and one of another step are refused, and
/// nothing is changed.
#[test]
fn a_preparation_that_is_stopped_says_how_to_go_on() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    std::fs::write(at.join(OWN_FILE), prepared()).unwrap();
    let run = ["run", OWN_FILE, "--out", "parts", "--threads", "1"];
    let resume = [&run[..], &["--resume"]].concat();
    let parts = at.join("parts");
    let log = || std::fs::read_to_string(parts.join("log.txt")).unwrap_or_default();
    // The first step that takes its time is under way.
    let message = stopped_when(at, &run, || log().contains("insert:"));
    assert!(message.contains("goes on from what was saved"), "{message}");
    assert_eq!(summary(&parts)["status"], "interrupted");
    let refused = |list: &[&str], words: &[&str]| {
        let refused = colluvium(at, list);
        assert_eq!(refused.status.code(), Some(2), "{refused:?}");
        let message = String::from_utf8_lossy(&refused.stderr).into_owned();
        for word in words {
            assert!(message.contains(word), "no `{word}` in: {message}");
        }
        assert_eq!(summary(&parts)["status"], "interrupted");
    };
    refused(&run, &["not finished", "checkpoint.h5"]);
    let cut_and_back = |file: &Path, words: &[&str]| {
        let saved = std::fs::read(file).unwrap();
        std::fs::write(file, &saved[..saved.len() / 2]).unwrap();
        refused(&resume, words);
        // A new file, without the lock that a child may have inherited.
        std::fs::remove_file(file).unwrap();
        std::fs::write(file, &saved).unwrap();
    };
    cut_and_back(&parts.join("checkpoint.h5"), &["checkpoint.h5", "damaged"]);
    // A step that went on is kept; the next one is under way.
    stopped_when(at, &resume, || log().contains("relax:"));
    let [first, second] =
        ["step_0.h5", "step_1.h5"].map(|name| parts.join("preparation").join(name));
    cut_and_back(&first, &["step_0.h5", "damaged"]);
    if !second.exists() {
        std::fs::copy(&first, &second).unwrap();
        refused(&resume, &["step_1.h5", "another preparation", "step"]);
        std::fs::remove_file(&second).unwrap();
        // Found before the step that goes before it is done again.
        std::fs::rename(&first, at.join("first")).unwrap();
        std::fs::write(&second, "not a packing").unwrap();
        refused(&resume, &["step_1.h5", "cannot be used"]);
        std::fs::remove_file(&second).unwrap();
        std::fs::rename(at.join("first"), &first).unwrap();
    }
    // Steps are enough to be kept from a new run.
    for name in ["checkpoint.h5", "checkpoint_before.h5"] {
        std::fs::rename(parts.join(name), at.join(name)).unwrap_or_default();
    }
    refused(&run, &["not finished", "preparation"]);
    std::fs::rename(at.join("checkpoint.h5"), parts.join("checkpoint.h5")).unwrap();

    succeed(at, &resume);
    assert!(
        log().contains("step 0 goes on") && log().contains("step 0 was done before"),
        "{}",
        log()
    );
    succeed(at, &["run", OWN_FILE, "--out", "whole"]);
    assert_eq!(hash(&parts), hash(&at.join("whole")));
    assert!(!parts.join("preparation").exists() && !parts.join("checkpoint.h5").exists());
}

/// What cannot be gone on with says so.
#[test]
fn a_jam_that_is_stopped_starts_again() {
    let folder = tempfile::tempdir().unwrap();
    let dry = BASE.replace("cohesion = \"dmt\"\nwork_of_adhesion = 0.1\n", "");
    let scene = format!("{dry}{EQUAL}\n[[prepare]]\ndo = \"jam\"\ncount = 20000\n");
    std::fs::write(folder.path().join(OWN_FILE), scene).unwrap();
    let log = folder.path().join("jam/log.txt");
    let begun = || std::fs::read_to_string(&log).is_ok_and(|log| log.contains("threads"));
    let message = stopped_when(folder.path(), &["run", OWN_FILE, "--out", "jam"], begun);
    assert!(message.contains("starts again"), "{message}");
}

/// Stops a run with Ctrl-C once something holds; gives what it says.
fn stopped_when(folder: &Path, arguments: &[&str], now: impl Fn() -> bool) -> String {
    let child = Command::new(env!("CARGO_BIN_EXE_colluvium"))
        .args(arguments)
        .current_dir(folder)
        .stdout(Stdio::null())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    let begin = Instant::now();
    while !now() && begin.elapsed() < PATIENCE {
        pause();
    }
    let id = child.id().to_string();
    Command::new("kill").args(["-INT", &id]).status().unwrap();
    let ended = child.wait_with_output().unwrap();
    assert_eq!(ended.status.code(), Some(130), "{ended:?}");
    String::from_utf8_lossy(&ended.stderr).into_owned()
}

#[test]
fn a_killed_bed_goes_on_with_rows_and_frames() {
    let sets = ["scale=0.5", "steps=1000", "frames=5"];
    killed_and_whole(None, ("settle", &sets), 5, 4);
}

#[test]
fn a_killed_chute_goes_on_with_rows_and_frames() {
    let sets = [
        "coarse_graining=2",
        "steps=300",
        "record_every=50",
        "frames=3",
    ];
    killed_and_whole(None, ("chute", &sets), 6, 3);
}

#[test]
fn a_killed_incline_goes_on() {
    let sets = [
        "scale=0.85",
        "grains.count=300",
        "contact.stiffness_scaled=2e3",
        "time.relax=0.3",
        "time.average=0.3",
        "time.limit=0.9",
    ];
    killed_and_whole(None, ("incline-moderate", &sets), 7, 3);
}

/// Checkpoints are written every 500 steps, which is not a whole number of exchanges.
#[test]
fn a_killed_hybrid_goes_on_in_the_middle_of_an_exchange() {
    killed_and_whole(None, ("incline", SMALL_HYBRID), 9, 3);
}

/// Its edge moves with the grains, and from strip to strip; everything of it lives in the recipe's memory: labels, the
/// continuum, strips that were put by with their contacts, the cells in its frames.
#[test]
fn a_killed_joined_column_goes_on_in_the_middle_of_an_exchange() {
    let sets = [
        SMALL_JOINED_COLUMN,
        MOVING_EDGE,
        &["duration_scaled=2", "output.frames=4"],
    ]
    .concat();
    let moves = killed_and_whole(Some(&JOINED_COLUMN), ("column-collapse", &sets), 11, 3);
    let moves = table(&moves.path().join("parts/moves.csv")).1;
    assert!(!moves.is_empty());
}

/// Both edges of its grains move, or of the continuum between them.
fn killed_between_edges(zones: &[&str], seed: u64) {
    let sets = [
        SMALL_JOINED_COLUMN,
        zones,
        &[
            "zones.moving=true",
            "zones.rest_speed_scaled=0.25",
            "zones.wake_speed_scaled=0.26",
            "zones.hold_scaled=0.1",
            "duration_scaled=2",
            "output.frames=4",
        ],
    ]
    .concat();
    let run = killed_and_whole(Some(&WIDE_COLUMN), ("column-collapse", &sets), seed, 3);
    let moves = table(&run.path().join("parts/moves.csv")).1;
    assert!(!moves.is_empty());
}

#[test]
fn a_killed_interval_of_grains_goes_on_in_the_middle_of_an_exchange() {
    killed_between_edges(INTERVAL, 19);
}

#[test]
fn a_killed_continuum_between_grains_goes_on_in_the_middle_of_an_exchange() {
    killed_between_edges(CORE, 23);
}

#[test]
fn a_killed_front_over_a_slope_goes_on_in_the_middle_of_an_exchange() {
    let sets = [
        SMALL_JOINED_COLUMN,
        FRONT_ON_A_SLOPE,
        &["duration_scaled=1.5", "output.frames=4"],
    ]
    .concat();
    killed_and_whole(None, ("column-collapse", &sets), 29, 2);
}

/// Before and after its debris has become a continuum.
#[test]
fn a_killed_cliff_goes_on_as_grains_and_as_a_continuum() {
    let sets = [
        SMALL_COMET_CLIFF,
        &[
            "model=hybrid",
            "runout.steepest_degrees=90",
            "output.frames=4",
        ],
    ]
    .concat();
    killed_and_whole(Some(&COMET_CLIFF), ("cliff", &sets), 13, 5);
}

/// Grains that stand beside the continuum that others have become, between and in the middle of exchanges.
#[test]
fn a_killed_cliff_goes_on_in_instalments() {
    let sets = [SMALL_COMET_CLIFF, INSTALMENTS, &["output.frames=4"]].concat();
    let run = killed_and_whole(Some(&COMET_CLIFF), ("cliff", &sets), 17, 6);
    let rows = table(&run.path().join("parts/instalments.csv")).1;
    assert!(!rows.is_empty());
}

#[test]
fn a_run_that_is_killed_at_its_very_end_is_tidied_up() {
    let folder = tempfile::tempdir().unwrap();
    let run = ["run", "two-spheres", "--out", "a"];
    succeed(folder.path(), &run);
    let at = |name: &str| folder.path().join("a").join(name);
    // As if it had been killed behind its summary: no report yet, checkpoints and frames still there.
    std::fs::remove_file(at("report.html")).unwrap();
    std::fs::write(at("checkpoint.h5"), "any").unwrap();
    std::fs::write(at("checkpoint.h5.partial"), "any").unwrap();
    std::fs::create_dir(at("frames")).unwrap();
    std::fs::write(at("frames/grains_000000000000.vtkhdf"), "any").unwrap();
    let said = succeed(folder.path(), &[&run[..], &["--resume"]].concat());
    assert!(said.contains("already done"), "{said}");
    assert!(at("report.html").exists());
    for name in ["checkpoint.h5", "checkpoint.h5.partial", "frames"] {
        assert!(!at(name).exists(), "{name}");
    }
}

#[test]
fn a_run_that_is_killed_while_its_folder_is_made_begins_again() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join("a").join(name);
    let run = ["run", "two-spheres", "--out", "a"];
    let resume = [&run[..], &["--resume"]].concat();
    // Its first file unfinished.
    std::fs::create_dir(at("")).unwrap();
    std::fs::write(at("summary.json.partial"), "{").unwrap();
    succeed(folder.path(), &run);
    let whole = hash(&at(""));
    // Its summary alone: nothing else stands yet.
    let text = std::fs::read_to_string(at("summary.json")).unwrap();
    std::fs::remove_dir_all(at("")).unwrap();
    std::fs::create_dir(at("")).unwrap();
    std::fs::write(at("summary.json"), text.replace("\"done\"", "\"running\"")).unwrap();
    succeed(folder.path(), &resume);
    assert_eq!(hash(&at("")), whole);
}

/// Stops a run politely `wait` after it has begun to compute; false where it was done before that.
fn interrupt(folder: &Path, arguments: &[&str], out: &Path, wait: Duration) -> bool {
    let mut child = start(folder, arguments);
    let begun =
        || std::fs::read_to_string(out.join("log.txt")).is_ok_and(|l| l.contains("threads"));
    let begin = Instant::now();
    while !begun() && begin.elapsed() < PATIENCE {
        std::thread::sleep(Duration::from_millis(1));
    }
    std::thread::sleep(wait);
    let id = child.id().to_string();
    Command::new("kill").args(["-INT", &id]).status().unwrap();
    let code = child.wait().unwrap().code();
    assert!(matches!(code, Some(0 | 130)), "{arguments:?}: {code:?}");
    code == Some(130)
}

#[test]
fn hybrids_the_continuum_and_impacts_go_on_after_ctrl_c() {
    let folder = tempfile::tempdir().unwrap();
    let mut random = ChaCha8Rng::seed_from_u64(8);
    let cases: [(&str, &[&str]); 5] = [
        ("incline", SMALL_HYBRID),
        (
            "bagnold",
            &["grid.cells=256", "grid.columns=3", "solver.growth=1.1"],
        ),
        (
            "bagnold",
            &[
                "grid.cells=600",
                "solver.method=regularised",
                "solver.growth=1.1",
            ],
        ),
        (
            "two-spheres",
            &["steps_per_contact=1e6", "impact_degrees=40", "rows=100"],
        ),
        (
            "sphere-on-plane",
            &["steps_per_contact=1e6", "impact_degrees=40", "rows=100"],
        ),
    ];
    for (scene, sets) in cases {
        let out = |name: &str| folder.path().join(name);
        let arguments = |name: &'static str| {
            let mut list = vec!["run", scene, "--out", name];
            for set in sets {
                list.extend(["--set", set]);
            }
            list
        };
        let begin = Instant::now();
        succeed(folder.path(), &arguments("whole"));
        let duration = begin.elapsed();
        let (mut stops, mut tries) = (0, 0);
        let mut resumed = arguments("parts");
        resumed.push("--resume");
        // On a busy machine a short run may be over before a signal comes: then all of it is tried again.
        while stops == 0 && tries < 8 {
            tries += 1;
            let _ = std::fs::remove_dir_all(out("parts"));
            for nth in 0..3 {
                let begun = if nth == 0 {
                    arguments("parts")
                } else {
                    resumed.clone()
                };
                let wait = duration.mul_f64(random.random_range(0.0..0.4));
                if interrupt(folder.path(), &begun, &out("parts"), wait) {
                    stops += 1;
                    assert!(out("parts").join("checkpoint.h5").exists(), "{scene}");
                }
            }
        }
        println!("{scene}: {duration:.1?}, {stops} stops");
        assert!(stops > 0, "{scene} {duration:?}");
        colluvium(folder.path(), &resumed);
        assert_eq!(hash(&out("parts")), hash(&out("whole")), "{scene} {sets:?}");
        for name in ["profile.csv", "trajectory.csv", "history.csv"] {
            let bytes = |d: &str| std::fs::read(out(d).join(name)).ok();
            assert_eq!(bytes("parts"), bytes("whole"), "{scene}: {name}");
        }
    }
}
