//! The command line, scene files, where results go.

use super::Case;

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
