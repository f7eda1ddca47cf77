//! The collapse of a cylinder in space, from the command line.

use crate::command::{
    colluvium, shares_say_what_the_summary_says, steps_say_what_the_summary_says, succeed, summary,
    table, value,
};
use colluvium::vtkhdf;

#[test]
fn cylinder_writes_front_deposit_and_fields() {
    let folder = tempfile::tempdir().unwrap();
    let run = ["run", "cylinder-collapse", "--out", "c"];
    succeed(folder.path(), &[&run[..], &["--set", "scale=0.6"]].concat());
    let at = |name: &str| folder.path().join("c").join(name);
    let (header, fronts) = table(&at("front.csv"));
    assert_eq!(header, ["t", "r_front", "height", "r_axis", "r_diagonal"]);
    // It stands at first, 0.1 m in radius and in height, and does not run back.
    assert!(fronts.len() > 50 && fronts[0][0] == 0.0);
    // The edge of a grid of 14 cells is known to a cell, a fifth of the radius.
    assert!((fronts[0][1] / 0.1 - 1.0).abs() < 0.25 && (fronts[0][2] / 0.1 - 1.0).abs() < 1e-9);
    for pair in fronts.windows(2) {
        assert!(pair[1][0] > pair[0][0] && pair[1][1] > pair[0][1] - 0.003);
    }
    let (header, deposit) = table(&at("deposit.csv"));
    assert_eq!(header, ["r", "h"]);
    // Rings one cell wide, of a heap that falls outwards.
    assert!(deposit.windows(2).all(|pair| pair[1][0] > pair[0][0]));
    assert!(
        deposit
            .windows(2)
            .all(|pair| pair[1][1] < pair[0][1] + 1e-3)
    );
    let found = summary(&folder.path().join("c"));
    assert_eq!(found["status"], "done");
    steps_say_what_the_summary_says(&folder.path().join("c"));
    shares_say_what_the_summary_says(&folder.path().join("c"));
    let runout = value(&found, "runout_over_aspect");
    assert!((0.93..1.69).contains(&runout), "{runout}");
    // The linear systems are solved to 1e-12: what is left is round-off, which the flow amplifies.
    assert!(value(&found, "symmetry_error") < 1e-11);
    assert!(value(&found, "volume_error").abs() < 1e-12);
    // In units of √(height/gravity); experiments say 3.
    let time = value(&found, "time_of_rest") / (0.1_f64 / 9.81).sqrt();
    assert!((2.0..6.0).contains(&time), "{time}");
    assert!(value(&found, "memory_per_cell") > 0.0 && value(&found, "time_per_cell_step") > 0.0);
    let report = std::fs::read_to_string(at("report.html")).unwrap();
    assert!(report.contains("Profiles through time") && report.contains("r [m]"));
    // A quarter of the cylinder's volume lies in the cells of every instant.
    let frames = vtkhdf::read_series(&at("fields.vtkhdf")).unwrap();
    let quarter = 0.25 * std::f64::consts::PI * 1e-3;
    assert!(frames.len() > 5);
    for frame in &frames {
        let scalars = |name: &str| {
            let field = frame.fields.iter().find(|f| f.name == name).unwrap();
            let vtkhdf::Values::Scalars(values) = &field.values else {
                panic!("{name} is not a number a cell")
            };
            values
        };
        assert_eq!(frame.cells, vtkhdf::Cells::Hexahedra);
        let sizes = frame.points.as_chunks::<8>().0.iter();
        let sizes = sizes.map(|corners| {
            let sides = (0..3).map(|axis| corners[6][axis] - corners[0][axis]);
            sides.product::<f64>()
        });
        let volume: f64 = sizes
            .zip(scalars("fraction"))
            .map(|(size, fraction)| size * fraction)
            .sum();
        assert!((volume / quarter - 1.0).abs() < 1e-2, "{volume} {quarter}");
    }
}

#[test]
fn cylinders_are_planned_and_bad_ones_refused_by_key() {
    let folder = tempfile::tempdir().unwrap();
    let planned = colluvium(folder.path(), &["plan", "cylinder-collapse"]);
    let planned = String::from_utf8_lossy(&planned.stdout).into_owned();
    assert!(
        planned.contains("a quarter of it") && planned.contains("cell-steps"),
        "{planned}"
    );
    for (set, key, allowed) in [
        (
            "grid.length_scaled=0.9",
            "grid.length_scaled",
            "greater than",
        ),
        ("grid.cells=500", "grid.cells", "at most 40000"),
        ("grid.cells=8", "grid.cells", "at least"),
        ("rheology.mu_2=0.1", "rheology.mu_2", "at least"),
        ("solver.courant=2", "solver.courant", "1"),
        ("grid.hole=true", "grid.hole", "whole"),
    ] {
        let arguments = ["run", "cylinder-collapse", "--out", "x", "--set", set];
        let refused = colluvium(folder.path(), &arguments);
        assert_eq!(refused.status.code(), Some(2), "{set}");
        let message = String::from_utf8_lossy(&refused.stderr).into_owned();
        assert!(
            message.contains(key) && message.contains(allowed),
            "{set}: {message}"
        );
        assert!(!folder.path().join("x").exists());
    }
}

/// On a floor of little friction the cylinder slides farther than where it stands still at the floor.
#[test]
fn cylinder_slides_on_a_floor_of_little_friction() {
    let folder = tempfile::tempdir().unwrap();
    let runout = |out: &str, floor: &str| {
        let list = [
            "run",
            "cylinder-collapse",
            "--out",
            out,
            "--set",
            "scale=0.5",
        ];
        succeed(folder.path(), &[&list[..], &["--set", floor]].concat());
        let found = summary(&folder.path().join(out));
        assert!(value(&found, "volume_error").abs() < 1e-12);
        assert!(value(&found, "symmetry_error") < 1e-11);
        value(&found, "runout_scaled")
    };
    let rough = runout("rough", "floor.contact=\"no-slip\"");
    let sliding = runout("sliding", "floor={contact=\"coulomb\",friction=0.2}");
    assert!(sliding > 1.1 * rough, "{rough} {sliding}");
}

/// A column in a channel in space: rubbing walls hold it back, most beside them; smooth ones do not.
#[test]
fn column_in_a_channel_with_walls_in_space() {
    let folder = tempfile::tempdir().unwrap();
    let run = |out: &str, contact: &str| {
        let walls = format!(
            "side_walls={{width=0.5,friction=0.3,in_space={{cells=4,contact=\"{contact}\"}}}}"
        );
        let list = [
            "run",
            "column-collapse",
            "--out",
            out,
            "--set",
            "scale=0.25",
        ];
        let list = [&list[..], &["--set", "aspect=0.8", "--set", &walls]].concat();
        succeed(folder.path(), &list);
        summary(&folder.path().join(out))
    };
    let rubbing = run("rubbing", "coulomb");
    let smooth = run("smooth", "free-slip");
    let (header, fronts) = table(&folder.path().join("rubbing/front.csv"));
    assert_eq!(header, ["t", "x_front", "height", "x_at_wall", "x_inside"]);
    assert!(fronts.len() > 20);
    for found in [&rubbing, &smooth] {
        assert_eq!(found["status"], "done");
        assert!(value(found, "volume_error").abs() < 1e-12);
    }
    let [held, free] = [&rubbing, &smooth].map(|found| value(found, "runout_scaled"));
    assert!(held > 0.3 && held < 0.9 * free, "{held} {free}");
    assert!(value(&rubbing, "front_lag") >= 0.0 && value(&smooth, "front_lag").abs() < 1e-6);
    for (set, key, allowed) in [
        (
            "side_walls={width=0.5,friction=0.3,in_space={cells=2,floor={contact=\"coulomb\"}}}",
            "side_walls.in_space.floor.friction",
            "coulomb",
        ),
        (
            "side_walls={width=0.5,friction=0.3,in_space={cells=0}}",
            "side_walls.in_space.cells",
            "1",
        ),
    ] {
        let arguments = ["run", "column-collapse", "--out", "x", "--set", set];
        let refused = colluvium(folder.path(), &arguments);
        assert_eq!(refused.status.code(), Some(2), "{set}");
        let message = String::from_utf8_lossy(&refused.stderr).into_owned();
        assert!(
            message.contains(key) && message.contains(allowed),
            "{set}: {message}"
        );
        assert!(!folder.path().join("x").exists());
    }
}

/// On a cone it runs farther out than on the level, and the tables and fields have the ground. What does not fit is
/// refused by its key.
#[test]
fn cylinders_run_out_over_terrain() {
    let folder = tempfile::tempdir().unwrap();
    let small = ["--set", "grid.cells=9", "--set", "grid.length_scaled=2.4"];
    let run = |out: &str, more: &[&str]| {
        let base = [
            "run",
            "cylinder-collapse",
            "--out",
            out,
            "--set",
            "duration_scaled=2.5",
        ];
        succeed(folder.path(), &[&base[..], &small, more].concat());
        summary(&folder.path().join(out))
    };
    let level = run("level", &["--set", "terrain.radial=[[0.0,0.0],[0.2,0.0]]"]);
    let cone = run("cone", &["--set", "terrain.radial=[[0.0,0.05],[0.2,0.0]]"]);
    let [level, down] = [&level, &cone].map(|found| value(found, "r_front"));
    assert!(down > 1.04 * level, "{down} {level}");
    assert!(value(&cone, "volume_error").abs() < 1e-12);
    let (header, map) = table(&folder.path().join("cone/map.csv"));
    assert_eq!(header, ["x", "y", "z_ground", "h"]);
    for row in map.iter().filter(|row| row[0].hypot(row[1]) < 0.18) {
        let exact = 0.05 - 0.25 * row[0].hypot(row[1]);
        assert!((row[2] - exact).abs() < 3e-3, "{row:?}");
    }
    let (header, _) = table(&folder.path().join("cone/deposit.csv"));
    assert_eq!(header, ["r", "h", "z_ground"]);
    let frames = vtkhdf::read_series(&folder.path().join("cone/fields.vtkhdf")).unwrap();
    let ground = frames[0]
        .fields
        .iter()
        .find(|f| f.name == "ground")
        .unwrap();
    let vtkhdf::Values::Counts(ground) = &ground.values else {
        panic!("ground is not a flag")
    };
    assert_eq!(ground.iter().filter(|n| **n == 1).count(), 81);

    let refused = |more: &[&str], words: &[&str]| {
        let base = ["run", "cylinder-collapse", "--out", "bad"];
        let output = colluvium(folder.path(), &[&base[..], &small, more].concat());
        let said = String::from_utf8_lossy(&output.stderr).into_owned();
        assert_eq!(output.status.code(), Some(2), "{said}");
        for word in words {
            assert!(said.contains(word), "{word}: {said}");
        }
        assert!(!folder.path().join("bad").exists());
    };
    let incline = "terrain.along_x=[[-0.3,0.1],[0.3,-0.1]]";
    refused(&["--set", incline], &["grid.whole", "along_x"]);
    let lone = "terrain.radial=[[0.0,0.1]]";
    refused(&["--set", lone], &["terrain.radial", "2 points"]);
    refused(
        &["--set", "terrain.contact=\"coulomb\""],
        &["terrain.along_x", "missing"],
    );
    let both = ["--set", incline, "--set", "terrain.heights=\"none.asc\""];
    refused(&both, &["terrain.heights", "along_x"]);
    let rough = [
        "--set",
        "terrain.radial=[[0.0,0.1],[0.2,0.0]]",
        "--set",
        "floor.contact=\"free-slip\"",
    ];
    refused(&rough, &["floor.contact"]);
    // A raster that does not reach as far as the grid.
    let rows = "0 0 0\n0 0 0\n0 0 0\n";
    let raster = format!("ncols 3\nnrows 3\nxllcorner -0.1\nyllcorner -0.1\ncellsize 0.1\n{rows}");
    std::fs::write(folder.path().join("small.asc"), raster).unwrap();
    let file = [
        "--set",
        "terrain.heights=\"small.asc\"",
        "--set",
        "grid.whole=true",
    ];
    refused(&file, &["terrain.heights", "small.asc", "no ground"]);
}
