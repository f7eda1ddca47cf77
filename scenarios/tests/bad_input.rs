//! Bad input: exit status 2, one message that names key, value and range, nothing written.

#![allow(clippy::unwrap_used)] // a test may panic

mod command;

use command::colluvium;
use std::fs;

/// Arguments, and what the message has to contain.
const CASES: &[(&[&str], &[&str])] = &[
    (
        &["run", "incline", "--set", "model=grains"],
        &["model", "grains", "dem, continuum, hybrid"],
    ),
    (
        &["run", "incline-moderate", "--set", "model=hybrid"],
        &["rheology", "missing", "hybrid"],
    ),
    (
        &["run", "incline", "--set", "overlap.hight_diameters=9"],
        &["overlap.hight_diameters", "`overlap.height_diameters`"],
    ),
    (
        &["run", "incline", "--set", "overlap.height_diameters=5"],
        &["overlap.height_diameters", "5", "at least a cell"],
    ),
    (
        &["run", "incline", "--set", "overlap.height_diameters=90"],
        &["overlap.height_diameters", "90", "[7.0000, "],
    ),
    (
        &["run", "incline", "--set", "overlap.shell_diameters=4"],
        &["overlap.shell_diameters", "= 4", "buffer"],
    ),
    (
        &["run", "incline", "--set", "overlap.from=3"],
        &["overlap.from", "3", "time.relax"],
    ),
    (
        &["run", "incline", "--set", "overlap.load_time=0.01"],
        &["overlap.load_time", "0.01", "at most"],
    ),
    (
        &["run", "incline", "--set", "overlap.normal_motion=sinking"],
        &["overlap.normal_motion", "sinking", "held, riding"],
    ),
    (
        &["run", "incline", "--set", "overlap.impedance=-1"],
        &["overlap.impedance", "-1", "[0"],
    ),
    (
        &["run", "incline", "--set", "rheology.mu_2=0.1"],
        &["rheology.mu_2", "0.1", "mu_s"],
    ),
    (
        &["run", "incline", "--set", "rheology.file=\"nowhere.toml\""],
        &["rheology.file", "nowhere.toml", "moderate"],
    ),
    (
        &["run", "incline", "--set", "rheology.law=table"],
        &["rheology.law", "table", "mu-i"],
    ),
    (&["calibrate", "incline"], &["model", "hybrid", "dem"]),
    (
        &["run", "incline-moderate", "--set", "slope_degrees=90"],
        &["slope_degrees", "90", "[0, 90)"],
    ),
    (
        &["run", "incline-moderate", "--set", "slope_degrees=-1"],
        &["slope_degrees", "-1", "[0, 90)"],
    ),
    (
        &["run", "incline-moderate", "--set", "slope_degrees=nan"],
        &["slope_degrees", "nan", "[0, 90)"],
    ),
    (
        &["run", "incline-moderate", "--set", "slope_degrees=steep"],
        &["slope_degrees", "steep", "number"],
    ),
    (
        &["run", "incline-moderate", "--set", "slop_degrees=30"],
        &["slop_degrees", "did you mean `slope_degrees`"],
    ),
    (
        &["run", "incline-moderate", "--set", "contact.fricton=1"],
        &["contact.fricton", "`contact.friction`"],
    ),
    (
        &["run", "incline-moderate", "--set", "contact=3"],
        &["contact", "3", "table"],
    ),
    (
        &["run", "incline-moderate", "--set", "seed=1.5"],
        &["seed", "1.5", "integer"],
    ),
    (
        &["run", "incline-moderate", "--set", "seed=-1"],
        &["seed", "-1", "[0"],
    ),
    (
        &["run", "incline-moderate", "--set", "start=\"running\""],
        &["start", "running", "rest, flow"],
    ),
    (
        &["run", "incline-moderate", "--set", "scale=0"],
        &["scale", "0", "[0.84, 50]"],
    ),
    (
        &["run", "incline-moderate", "--set", "grains.diameter=-0.01"],
        &["grains.diameter", "-0.01", "(0, 10]"],
    ),
    (
        &[
            "run",
            "incline-moderate",
            "--set",
            "contact.restitution=1.5",
        ],
        &["contact.restitution", "1.5", "1]"],
    ),
    (
        &["run", "incline-moderate", "--set", "contact.friction=0"],
        &["contact.friction", "0", "rolling"],
    ),
    (
        &["run", "incline-moderate", "--set", "time.limit=0.1"],
        &["time.limit", "0.1", "2.56"],
    ),
    (
        &[
            "run",
            "incline-moderate",
            "--set",
            "calibration.stop.high=10",
        ],
        &["calibration.stop.high", "10", "24"],
    ),
    (
        &[
            "run",
            "incline-moderate",
            "--set",
            "calibration.flow_degrees=[30, 95]",
        ],
        &["calibration.flow_degrees[1]", "95", "90"],
    ),
    (
        &[
            "run",
            "incline-moderate",
            "--set",
            "contact.stiffness=1e5",
            "--set",
            "contact.stiffness_scaled=1e4",
        ],
        &["contact.stiffness", "contact.stiffness_scaled", "exclude"],
    ),
    (
        &["run", "incline-moderate", "--set", "slope_degrees"],
        &["KEY=VALUE", "slope_degrees"],
    ),
    (
        &["run", "incline-moderate", "--set", "scene=bagnold"],
        &["scene", "bagnold"],
    ),
    (
        &["run", "two-spheres", "--set", "radius=-0.5"],
        &["radius", "-0.5", "(0, 100]"],
    ),
    (
        &["run", "two-spheres", "--set", "density=0"],
        &["density", "0", "(0, 30000]"],
    ),
    (
        &["run", "sphere-on-plane", "--set", "impact_degrees=91"],
        &["impact_degrees", "91", "[0, 90]"],
    ),
    (
        &["run", "bagnold", "--set", "grid.cells=-3"],
        &["grid.cells", "-3", "[4, 4096]"],
    ),
    (
        &["run", "bagnold", "--set", "grid.columns=2"],
        &["grid.columns", "2", "3 to 256"],
    ),
    (
        &["run", "bagnold", "--set", "slope_degrees=60"],
        &["slope_degrees", "60", "39.18"],
    ),
    (
        &["run", "bagnold", "--set", "rheology.mu_2=0.1"],
        &["rheology.mu_2", "0.1", "0.506"],
    ),
    (
        &["run", "bagnold", "--set", "rheology.law=coulombe"],
        &["rheology.law", "coulombe", "barker-gray"],
    ),
    (
        &["run", "bagnold", "--set", "rheology.alpha=1.5"],
        &["rheology.alpha", "1.5", "mu-i", "mu_s, mu_2, i_0"],
    ),
    (
        &["run", "bagnold", "--set", "rheology.law=table"],
        &["rheology.table", "missing", "[[I, mu], ...]"],
    ),
    (
        &[
            "run",
            "bagnold",
            "--set",
            "rheology.law=table",
            "--set",
            "rheology.table=[[0, 0.5], [0.1, 0.4]]",
        ],
        &["rheology.table", "0.4", "the point before, 0.5"],
    ),
    (
        &["run", "bagnold", "--set", "rheology.law=coulomb"],
        &["slope_degrees", "33", "26.8394"],
    ),
    (
        &["run", "bagnold", "--set", "rheology.file=missing.toml"],
        &["rheology.file", "missing.toml", "cannot read"],
    ),
    (
        &[
            "run",
            "bagnold",
            "--set",
            "rheology.file=law.toml",
            "--set",
            "rheology.mu_s=0.4",
        ],
        &["rheology.file", "rheology.mu_s", "exclude"],
    ),
    (
        &["run", "bagnold", "--set", "rheology.file=law.toml"],
        &["rheology.file", "law.toml", "mu_2", "0.1"],
    ),
    (
        &["run", "bagnold", "--set", "rheology.file=not.toml"],
        &["rheology.file", "not.toml"],
    ),
    (&["run", "absent.toml"], &["absent.toml", "cannot read"]),
    (
        &["run", "bagnoldd"],
        &["bagnoldd", "did you mean `bagnold`"],
    ),
    (&["run", "broken.toml"], &["broken.toml", "line 2"]),
    (
        &["run", "unknown-kind.toml"],
        &["scene", "landslide", "bagnold"],
    ),
    (&["run", "no-kind.toml"], &["scene", "missing", "bagnold"]),
    (&["run", "bagnold", "--threads", "0"], &["--threads", "0"]),
    (&["run", "bagnold", "--resume"], &["--resume", "--out"]),
    (
        &["run", "bagnold", "--out", "broken.toml"],
        &["--out", "broken.toml", "file"],
    ),
    (
        &["run", "bagnold", "--out", "broken.toml/deep"],
        &["--out", "broken.toml/deep", "cannot write"],
    ),
    (
        &["run", "bagnold", "--out", "others"],
        &["--out", "others", "not empty"],
    ),
    (&["calibrate", "bagnold"], &["bagnold", "incline-moderate"]),
    (
        &["pareto", "bagnold", "--vary", "grid.cells"],
        &["--vary", "grid.cells", "KEY=A,B,C"],
    ),
    (
        &["pareto", "bagnold", "--vary", "grid.cells=16,-1"],
        &["grid.cells", "-1", "[4, 4096]"],
    ),
    (
        &["pareto", "incline-glass", "--vary", "seed=1,2"],
        &["incline-glass", "--reference"],
    ),
    (&["report", "nowhere"], &["nowhere", "summary.json"]),
    (&["scenes", "show", "nothing"], &["nothing", "bagnold"]),
    (&["walk"], &["walk"]),
    (
        &["run", "incline-moderate", "--set", "scale=0.5"],
        &["scale", "0.5", "[0.84, 50]"],
    ),
    (
        &[
            "calibrate",
            "incline-moderate",
            "--set",
            "calibration.flow_degrees=[0.0]",
        ],
        &["calibration.flow_degrees[0]", "0", "(0, 90)"],
    ),
    (
        &[
            "run",
            "incline-moderate",
            "--set",
            "grains.count=1000000",
            "--set",
            "scale=50",
        ],
        &["grains.count", "1000000", "at most 8000 at scale 50"],
    ),
    (
        &[
            "run",
            "incline-moderate",
            "--set",
            "floor.length_diameters=1000",
            "--set",
            "floor.width_diameters=1000",
            "--set",
            "scale=3",
        ],
        &["floor.length_diameters", "1000", "at most 222"],
    ),
    (
        &["run", "incline-moderate", "--set", "grains.diameter=1e-200"],
        &["grains.diameter", "heavier"],
    ),
    (
        &[
            "run",
            "bagnold",
            "--set",
            "grid.cells=4096",
            "--set",
            "grid.columns=256",
        ],
        &["grid.cells", "4096", "200000", "grid.columns"],
    ),
    (
        &["run", "bagnold", "--set", "rheology.valid_i=[0.5, 0.1]"],
        &["rheology.valid_i", "[0.5, 0.1]", "low < high"],
    ),
    (
        &["run", "bagnold", "--set", "rheology.file=steep.toml"],
        &["rheology.file", "steep.toml", "rheology.mu_s", "[0, 5]"],
    ),
    (
        &[
            "run",
            "two-spheres",
            "--set",
            "speed=1e-9",
            "--set",
            "gap=1",
        ],
        &["two-spheres", "speed", "0.000000001", "1e9 steps"],
    ),
    (
        &["run", "two-spheres", "--set", "duration=1e4"],
        &["duration", "10000", "1e9 steps"],
    ),
    (
        &["run", "two-spheres", "--set", "radius=1e-200"],
        &["radius", "heavier"],
    ),
    (
        &[
            "run",
            "incline-moderate",
            "--set",
            "seed=99999999999999999999",
        ],
        &[
            "seed",
            "100000000000000000000",
            "is not allowed",
            "9007199254740991",
        ],
    ),
    (
        &["pareto", "bagnold", "--vary", "grid.cells=16,16"],
        &["--vary", "grid.cells", "16", "same run"],
    ),
    (
        &["pareto", "bagnold", "--vary", "grid.cell=16,32"],
        &["--vary: unknown key", "grid.cell", "`grid.cells`"],
    ),
    (
        &["run", "mine/scene.toml", "--out", "mine"],
        &["--out", "mine", "not empty"],
    ),
    (
        &["run", "chute", "--set", "scale=1.5"],
        &["scale", "1.5", "whole number"],
    ),
    (
        &["run", "chute", "--set", "timestep=0.01"],
        &[
            "chute",
            "timestep",
            "0.01",
            "(0, 0.00304)",
            "unstable",
            "would do",
        ],
    ),
    (
        &["run", "chute", "--set", "steps=10", "--set", "duration=1"],
        &["steps", "duration", "exclude"],
    ),
    (
        &["run", "chute", "--set", "duration=1e7"],
        &["duration", "10000000", "1e9 steps"],
    ),
    (
        &["run", "chute", "--set", "start=nowhere.csv"],
        &["start", "nowhere.csv", "allowed"],
    ),
    (
        &["run", "chute", "--set", "coarse_graining=0.5"],
        &["coarse_graining", "0.5", "[1, 10]"],
    ),
    (
        &["run", "chute", "--set", "contact.frction=1"],
        &["contact.frction", "`contact.friction`"],
    ),
    (
        &["run", "chute", "--set", "contact.normal=hertzian"],
        &[
            "contact.normal",
            "hertzian",
            "hooke, hertz, viscoelastic, jkr",
        ],
    ),
    (
        &["run", "chute", "--set", "contact.normal=hertz"],
        &["contact.restitution", "missing", "in [0.01, 1]"],
    ),
    (
        &["run", "chute", "--set", "contact.tangential=mindlin"],
        &["chute", "contact.tangential", "mindlin", "Hertz"],
    ),
    (
        &["run", "chute", "--set", "contact.rolling=jkr"],
        &["contact.rolling", "jkr", "JKR normal law"],
    ),
    (
        &["run", "chute", "--set", "contact.dissipation=1e-5"],
        &["contact.dissipation", "not read", "hooke", "stiffness"],
    ),
    (
        &[
            "run",
            "chute",
            "--set",
            "contact.restitution=0.5",
            "--set",
            "contact.damping_rate=1",
        ],
        &["contact.restitution", "contact.damping_rate", "exclude"],
    ),
    (
        &["run", "settle", "--set", "floor.width=0.004"],
        &["floor.width", "0.004", "at least 0.0063"],
    ),
    (
        &["run", "settle", "--set", "contact.poissons_ratio=0.6"],
        &["contact.poissons_ratio", "0.6", "(-1, 0.5]"],
    ),
    (
        &["run", "settle", "--set", "contact.tangential=linear"],
        &["contact.tangential_stiffness", "missing", "N/m"],
    ),
    (
        &[
            "run",
            "settle",
            "--set",
            "grains.count=10000000",
            "--set",
            "scale=50",
        ],
        &["scale", "2e7 grains"],
    ),
    (
        &["run", "settle", "--set", "timestep=1e-3"],
        &["settle", "timestep", "0.001", "unstable", "would do"],
    ),
    (
        &[
            "run",
            "two-spheres",
            "--set",
            "steps_per_contact=10",
            "--set",
            "safety=9",
        ],
        &["two-spheres", "safety", "9", "unstable", "1.0 would do"],
    ),
    (
        &[
            "run",
            "incline-moderate",
            "--set",
            "timestep.steps_per_contact=10",
            "--set",
            "timestep.safety=9",
        ],
        &["timestep.safety", "9", "unstable", "1.0 would do"],
    ),
    (
        &[
            "calibrate",
            "incline-moderate",
            "--set",
            "timestep.safety=4",
            "--set",
            "timestep.steps_per_contact=10",
        ],
        &["timestep.safety", "4", "unstable", "would do"],
    ),
    (
        &["run", "incline-glass", "--set", "timestep.safety=0"],
        &["timestep.safety", "0", "[0.01, 10]"],
    ),
    (
        &[
            "run",
            "two-spheres",
            "--set",
            "friction=0.2",
            "--set",
            "contact.friction=0.3",
        ],
        &["friction", "contact.friction", "exclude"],
    ),
    (
        &["run", "two-spheres", "--set", "contact.cohesion=dmt"],
        &["two-spheres", "contact.work_of_adhesion", "missing"],
    ),
    (
        &["pareto", "chute", "--vary", "timestep=1e-4,2e-4"],
        &["chute", "--reference"],
    ),
];

#[test]
fn bad_input_ends_with_status_2_and_leaves_nothing() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    fs::write(
        at("broken.toml"),
        "scene = \"bagnold\"\nslope_degrees = = 3\n",
    )
    .unwrap();
    fs::write(at("unknown-kind.toml"), "scene = \"landslide\"\n").unwrap();
    fs::write(at("no-kind.toml"), "slope_degrees = 3.0\n").unwrap();
    fs::write(
        at("law.toml"),
        "mu_s = 0.4\nmu_2 = 0.1\ni_0 = 0.3\ndiameter = 0.01\nsolid_fraction = 0.5\n",
    )
    .unwrap();
    fs::write(
        at("steep.toml"),
        "mu_s = 7.0\nmu_2 = 8.0\ni_0 = 0.3\ndiameter = 0.01\nsolid_fraction = 0.5\n",
    )
    .unwrap();
    // A folder of the user's own, with a scene file in it.
    fs::create_dir(at("mine")).unwrap();
    fs::write(at("mine/scene.toml"), "scene = \"bagnold\"\n").unwrap();
    fs::write(at("mine/profile.csv"), "mine").unwrap();
    fs::write(at("not.toml"), "{ \"json\": true }").unwrap();
    fs::create_dir(at("others")).unwrap();
    fs::write(at("others/diary.md"), "mine").unwrap();
    let listing = || {
        let mut names: Vec<_> = fs::read_dir(folder.path())
            .unwrap()
            .map(|e| e.unwrap().file_name())
            .collect();
        names.sort();
        names
    };
    let before = listing();
    for (arguments, wanted) in CASES {
        let done = colluvium(folder.path(), arguments);
        let message = String::from_utf8_lossy(&done.stderr);
        assert_eq!(done.status.code(), Some(2), "{arguments:?}: {message}");
        for part in *wanted {
            assert!(
                message.contains(part),
                "{arguments:?}: `{part}` is not in: {message}"
            );
        }
        assert_eq!(listing(), before, "{arguments:?} left something behind");
    }
    assert_eq!(fs::read_dir(at("others")).unwrap().count(), 1);
    assert_eq!(fs::read_dir(at("mine")).unwrap().count(), 2);
}

#[test]
fn a_step_that_is_said_to_do_does() {
    let folder = tempfile::tempdir().unwrap();
    for (scene, key, set) in [
        ("chute", "timestep", "scale=1"),
        ("settle", "timestep", "coarse_graining=2"),
        ("two-spheres", "safety", "steps_per_contact=10"),
    ] {
        let check = |value: &str| {
            let step = format!("{key}={value}");
            let arguments = ["check", scene, "--set", set, "--set", &step];
            colluvium(folder.path(), &arguments)
        };
        let refused = check(if key == "safety" { "9" } else { "0.01" });
        assert_eq!(refused.status.code(), Some(2), "{scene}");
        let message = String::from_utf8_lossy(&refused.stderr).into_owned();
        let number = |before: &str, after: &str| -> f64 {
            let (_, rest) = message.split_once(before).unwrap();
            let (number, _) = rest.split_once(after).unwrap();
            number.rsplit(' ').next().unwrap().parse().unwrap()
        };
        let (below, does) = (number("allowed: (0, ", ")"), number("; ", " would do"));
        assert!(does < below, "{message}");
        for (value, status) in [(does, 0), (0.99 * below, 0), (1.01 * below, 2)] {
            let done = check(&format!("{value:e}"));
            assert_eq!(done.status.code(), Some(status), "{scene} {value}");
        }
    }
    // A file of one's own is named.
    fs::write(
        folder.path().join("mine.toml"),
        "scene = \"chute\"\ntimestep = 0.01\n",
    )
    .unwrap();
    let refused = colluvium(folder.path(), &["run", "mine.toml"]);
    assert_eq!(refused.status.code(), Some(2));
    assert!(String::from_utf8_lossy(&refused.stderr).contains("mine.toml: key `timestep`"));
}

#[test]
fn a_run_of_ours_may_be_replaced_and_nothing_else() {
    let folder = tempfile::tempdir().unwrap();
    let run = |out: &str| {
        colluvium(
            folder.path(),
            &["run", "bagnold", "--set", "grid.cells=8", "--out", out],
        )
    };
    assert!(run("a/b").status.success());
    fs::write(folder.path().join("a/b/notes.md"), "mine").unwrap();
    assert!(run("a/b").status.success());
    assert!(folder.path().join("a/b/notes.md").exists());
    assert_eq!(run("a").status.code(), Some(2));
}

#[test]
fn a_run_that_the_new_one_reads_from_is_not_replaced() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    let small = ["run", "bagnold", "--set", "grid.cells=8", "--out", "a"];
    assert!(colluvium(folder.path(), &small).status.success());
    fs::write(
        at("a/rheology.toml"),
        "mu_s = 0.4\nmu_2 = 0.8\ni_0 = 0.3\ndiameter = 0.01\nsolid_fraction = 0.5\n",
    )
    .unwrap();
    for arguments in [
        vec!["run", "a/scene.toml", "--out", "a"],
        vec![
            "run",
            "bagnold",
            "--set",
            "rheology.file=a/rheology.toml",
            "--out",
            "a",
        ],
    ] {
        let done = colluvium(folder.path(), &arguments);
        let message = String::from_utf8_lossy(&done.stderr);
        assert_eq!(done.status.code(), Some(2), "{message}");
        assert!(message.contains("read from"), "{message}");
        assert!(at("a/rheology.toml").exists() && at("a/report.html").exists());
    }
}

#[test]
fn bad_input_does_not_cost_an_earlier_run() {
    let folder = tempfile::tempdir().unwrap();
    let run = |more: &[&str]| {
        let mut list = vec!["run", "two-spheres", "--out", "a"];
        list.extend(more);
        colluvium(folder.path(), &list)
    };
    assert!(run(&[]).status.success());
    let page = fs::read(folder.path().join("a/report.html")).unwrap();
    assert_eq!(
        run(&["--set", "speed=1e-9", "--set", "gap=1"])
            .status
            .code(),
        Some(2)
    );
    assert_eq!(fs::read(folder.path().join("a/report.html")).unwrap(), page);
    // Resuming says that it is done; another command's directory is refused.
    let again = run(&["--resume"]);
    assert!(again.status.success());
    assert!(String::from_utf8_lossy(&again.stdout).contains("already done"));
    let other = colluvium(
        folder.path(),
        &["calibrate", "incline-moderate", "--out", "a", "--resume"],
    );
    assert_eq!(other.status.code(), Some(2));
    assert!(String::from_utf8_lossy(&other.stderr).contains("`run`, not by `calibrate`"));
}
