//! The command line, scene files, where results go.

use super::Case;
use crate::command::colluvium;

/// Arguments, and what the message has to contain.
pub const CASES: &[Case] = &[
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
        &[
            "coarse-grain",
            "none",
            "--gravity",
            "0,x,0,-9.81",
            "--out",
            "new",
        ],
        &["--gravity", "`x`", "3 numbers"],
    ),
    (
        &["coarse-grain", "none", "--gravity", "0,0", "--out", "new"],
        &["--gravity", "2 numbers", "3 numbers"],
    ),
    (&["report", "nowhere"], &["nowhere", "summary.json"]),
    (&["scenes", "show", "nothing"], &["nothing", "bagnold"]),
    (&["walk"], &["walk"]),
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
        &["validate", "inclin", "--out", "new"],
        &["inclin", "incline"],
    ),
    (
        &["map", "incline-glass", "--out", "new"],
        &["incline-glass", "incline-moderate"],
    ),
    (
        &["map", "bagnold", "--out", "new"],
        &["bagnold", "incline-moderate"],
    ),
    (
        &["map", "incline-moderate", "--beta", "0.1", "--out", "new"],
        &["--beta", "0.1"],
    ),
    (
        &["map", "incline-moderate", "--beta=0.1,-1", "--out", "new"],
        &["--beta", "-1", "positive"],
    ),
    (
        &["map", "incline-moderate", "--beta=0.1,1e9", "--out", "new"],
        &["beta", "1000000000", "allowed"],
    ),
];

#[test]
fn too_many_runs_and_too_long_names_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let said = |varied: &[String]| {
        let mut arguments = vec!["pareto", "bagnold"];
        for one in varied {
            arguments.extend(["--vary", one]);
        }
        let done = colluvium(folder.path(), &arguments);
        assert_eq!(done.status.code(), Some(2));
        String::from_utf8_lossy(&done.stderr).into_owned()
    };
    let many: Vec<String> = (4..=43).map(|n| n.to_string()).collect();
    let of = |key: &str| format!("{key}={}", many.join(","));
    let runs = said(&[of("grid.cells"), of("grid.columns")]);
    assert!(runs.contains("1600 runs"), "{runs}");
    let name = said(&[format!("depth=1.{},2.0", "0".repeat(300))]);
    assert!(name.contains("at most 200"), "{name}");
    assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 0);
}
