//! Cliffs before which the ground is no plane.

use crate::command::{SMALL_COMET_CLIFF, colluvium, hash, succeed, summary, table, value};
use crate::packings::{CLIFF_OF_GRAINS, COMET_CLIFF};
use std::path::Path;

fn run<'a>(out: &'a str, sets: &[&'a str]) -> Vec<&'a str> {
    let mut list = vec!["run", "cliff", "--out", out];
    for set in SMALL_COMET_CLIFF.iter().chain(sets) {
        list.extend(["--set", set]);
    }
    list
}

/// A slope of 1 : 4 from the foot on, down to a level 25 m below.
const VALLEY: &str = "terrain.profile=[[0,0],[100,-25],[140,-25]]";

/// Debris runs farther down a slope than over a plane, as grains and as a continuum, and both end at the same place; the
/// cliff stands and fails as before a plane. Level land is the plane.
#[test]
fn debris_runs_down_into_a_valley() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    let level = "terrain.profile=[[0,0],[140,0]]";
    COMET_CLIFF.put(folder.path());
    CLIFF_OF_GRAINS.put(folder.path());
    for (out, sets) in [
        ("level", &[level, "output.frames=0"][..]),
        ("grains", &[VALLEY, "output.frames=4"]),
        ("joined", &[VALLEY, "model=hybrid", "output.frames=4"]),
    ] {
        succeed(folder.path(), &run(out, sets));
    }
    let all = ["c", "level", "grains", "joined"].map(|name| summary(&at(name)));
    for name in [
        "time_of_failure",
        "x_front",
        "pile_height",
        "repose",
        "reach_angle",
        "time_of_rest",
    ] {
        println!(
            "{name}: {:?}",
            all.each_ref().map(|s| s["results"][name]["value"].as_f64())
        );
    }
    let of = |name: &str| all.each_ref().map(|s| value(s, name));
    let [plane, level, ..] = of("sunk_standing");
    assert!((level / plane - 1.0).abs() < 1e-9, "{level} {plane}");
    let [plane, level, grains, joined] = of("x_front");
    assert!((level / plane - 1.0).abs() < 1e-6, "{level} {plane}");
    assert!(grains > 1.2 * plane && joined > 1.2 * plane);
    assert!((joined / grains - 1.0).abs() < 0.3, "{joined} {grains}");
    let drift = all[3]["ledger"]["mass_relative"].as_f64().unwrap();
    assert!(drift.abs() < 1e-12, "{drift}");
    for (out, depth) in [("grains", 0.25), ("joined", 0.25), ("level", 0.0)] {
        let (header, rows) = table(&at(out).join("deposit.csv"));
        assert_eq!(header, ["x", "h", "z_ground"]);
        for row in &rows {
            let exact = -depth * row[0].clamp(0.0, 100.0);
            assert!((row[2] - exact).abs() < 1e-9, "{out} {row:?}");
        }
    }
    // The ground is there to be looked at beside the frames.
    let ground =
        colluvium::mesh_files::read_surface(&at("grains").join("wall_ground.vtu")).unwrap();
    let lowest = ground.vertices.iter().map(|v| v.z).fold(0.0, f64::min);
    assert_eq!((ground.triangles.len(), lowest), (8, -25.0));
    // The angle of reach is that of the line from the crack's head to the end.
    let head = 30.0 * 10f64.to_radians().tan();
    let reach = ((30.0 + 0.25 * grains) / (grains + head)).atan();
    assert!((of("reach_angle")[2] - reach.to_degrees()).abs() < 1e-9);
}

/// Points, heights and triangles of the same ground are the same ground.
#[test]
fn ground_comes_from_points_a_raster_or_a_mesh() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    // Heights of 1000 m and more over the sea; the foot at (40, 20).
    let heights = [1004.0, 1003.0, 1000.0, 996.0, 999.0, 990.0, 990.0];
    let row: String = heights.iter().map(|z| format!("{z} ")).collect();
    let raster = format!(
        "ncols 7\nnrows 3\nxllcenter 0\nyllcenter 0\ncellsize 40\nNODATA_value -9\n{}",
        format!("{row}\n").repeat(3)
    );
    std::fs::write(at("valley.asc"), raster).unwrap();
    std::fs::write(at("valley.obj"), object(&heights)).unwrap();
    let points = "terrain.profile=[[-40,4],[0,3],[40,0],[80,-4],[120,-1],[160,-10],[200,-10]]";
    let short = [
        "standing=100",
        "duration=50",
        "output.pictures=0",
        "output.frames=0",
    ];
    COMET_CLIFF.put(folder.path());
    let sources = [
        ("points", vec![points]),
        (
            "raster",
            vec!["terrain.heights=valley.asc", "terrain.start=[40,20]"],
        ),
        (
            "mesh",
            vec!["terrain.mesh=valley.obj", "terrain.start=[40,20]"],
        ),
    ];
    for (out, keys) in &sources {
        let sets: Vec<&str> = short.iter().chain(keys).copied().collect();
        succeed(folder.path(), &run(out, &sets));
    }
    let [points, raster, mesh] = ["points", "raster", "mesh"].map(|out| hash(&at(out)));
    assert_eq!((&raster, &mesh), (&points, &points));
    // Another ground is another state.
    let other = ["terrain.profile=[[0,0],[140,-1]]"];
    let sets: Vec<&str> = short.iter().chain(&other).copied().collect();
    succeed(folder.path(), &run("other", &sets));
    assert_ne!(hash(&at("other")), points);
}

/// A strip of triangles through heights (m) 40 m apart, 80 m wide, facing up.
fn object(heights: &[f64]) -> String {
    let corners = heights
        .iter()
        .enumerate()
        .flat_map(|(k, z)| [0, 80].map(|y| format!("v {} {y} {z}\n", 40 * k)));
    let faces = (0..heights.len() - 1).flat_map(|k| {
        let n = 2 * k + 1;
        [[n, n + 2, n + 1], [n + 1, n + 2, n + 3]].map(|[a, b, c]| format!("f {a} {b} {c}\n"))
    });
    corners.chain(faces).collect()
}

#[test]
fn bad_ground_is_refused_by_key() {
    let folder = tempfile::tempdir().unwrap();
    let short =
        "ncols 2\nnrows 2\nxllcenter 0\nyllcenter 0\ncellsize 40\nNODATA_value -9\n0 0\n0 0\n";
    std::fs::write(folder.path().join("short.asc"), short).unwrap();
    for (set, key, allowed) in [
        ("terrain.profile=[[0,0]]", "terrain.profile", "at least 2"),
        (
            "terrain.profile=[[0,0],[50,0]]",
            "terrain.profile",
            "125.289",
        ),
        (
            "terrain.profile=[[1,0],[150,0]]",
            "terrain.profile",
            "or before it",
        ),
        (
            "terrain.profile=[[0,0],[90,0],[80,-1],[150,0]]",
            "terrain.profile",
            "does not turn back",
        ),
        (
            "terrain.profile=[[0,0],[3,25],[150,25]]",
            "terrain.profile",
            "below the face",
        ),
        ("terrain.heights=short.asc", "terrain.heights", "125.289"),
        ("terrain.heights=none.asc", "terrain.heights", "none.asc"),
        ("terrain.start=[1,1]", "terrain.profile", "missing"),
        ("terrain.depth=3", "terrain.depth", "unknown key"),
        ("shape.room_scaled=0.5", "shape.room_scaled", "1"),
    ] {
        for model in ["model=dem", "model=hybrid"] {
            let arguments = ["run", "cliff", "--out", "x", "--set", set, "--set", model];
            let refused = colluvium(folder.path(), &arguments);
            let message = String::from_utf8_lossy(&refused.stderr).into_owned();
            assert_eq!(refused.status.code(), Some(2), "{set}: {message}");
            assert!(
                message.contains(key) && message.contains(allowed),
                "{set}: {message}"
            );
            assert!(!Path::exists(&folder.path().join("x")));
        }
    }
}
