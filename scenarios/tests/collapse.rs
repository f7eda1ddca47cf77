//! The collapse of a column from the command line.

use crate::command::{
    colluvium, shares_say_what_the_summary_says, steps_say_what_the_summary_says, succeed, summary,
    table, value,
};
use colluvium::vtkhdf;
use std::path::Path;
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

#[test]
fn collapse_writes_front_and_deposit() {
    let folder = tempfile::tempdir().unwrap();
    // The bundled column in small: grains of a thirtieth of its height.
    let mut run = vec!["run", "column-collapse", "--out", "c"];
    for set in ["scale=0.5", "height=0.2", "rheology.diameter=0.0066666667"] {
        run.extend(["--set", set]);
    }
    succeed(folder.path(), &run);
    let (header, fronts) = table(&folder.path().join("c/front.csv"));
    assert_eq!(header, ["t", "x_front", "height"]);
    let (header, deposit) = table(&folder.path().join("c/deposit.csv"));
    assert_eq!(header, ["x", "h"]);
    assert_eq!(deposit.len(), 64);
    // All of the column, 0.2 m high and 0.4 m wide, lies in the deposit.
    let spacing = deposit[1][0] - deposit[0][0];
    let area: f64 = deposit.iter().map(|row| row[1] * spacing).sum();
    assert!((area / 0.08 - 1.0).abs() < 1e-9, "{area}");
    // It stands at first and does not run back.
    assert!(fronts.len() > 100 && fronts[0][0] == 0.0);
    // The edge of a grid of 64 cells is known to a cell and a half.
    assert!((fronts[0][1] / 0.4 - 1.0).abs() < 0.08);
    for pair in fronts.windows(2) {
        assert!(pair[1][0] > pair[0][0] && pair[1][1] > pair[0][1] - 0.01);
    }
    let summary = summary(&folder.path().join("c"));
    assert_eq!(summary["status"], "done");
    let runout = value(&summary, "runout_scaled");
    assert!((1.0..1.25).contains(&runout), "{runout}");
    // In units of √(height/gravity) it takes 5 to 8.
    let time = value(&summary, "time_of_rest") / (0.2_f64 / 9.81).sqrt();
    assert!((5.0..8.0).contains(&time), "{time}");
    assert!(summary["ledger"]["mass_relative"].as_f64().unwrap().abs() < 1e-12);
    let report = std::fs::read_to_string(folder.path().join("c/report.html")).unwrap();
    assert!(report.contains("Profiles through time"));
    fields_say_what_the_tables_say(&folder.path().join("c"), &deposit);
    steps_say_what_the_summary_says(&folder.path().join("c"));
}

/// The fields at rest: their volume, their columns' heights, and pressure under the weight above.
fn fields_say_what_the_tables_say(run: &Path, deposit: &[Vec<f64>]) {
    let frames = vtkhdf::read_series(&run.join("fields.vtkhdf")).unwrap();
    assert!(frames.len() > 5 && frames[0].time == 0.0 && !run.join("frames").exists());
    let (_, flowing) = table(&run.join("flowing.csv"));
    // Nothing flows before the column is let go or at the end; in between most of it does.
    let most = flowing.iter().map(|row| row[1]).fold(0.0, f64::max);
    assert!(flowing[0][1] == 0.0 && flowing.last().unwrap()[1] < 0.02 && most > 0.3);
    shares_say_what_the_summary_says(run);
    let last = frames.last().unwrap();
    let scalars = |name: &str| {
        let field = last.fields.iter().find(|f| f.name == name).unwrap();
        let vtkhdf::Values::Scalars(values) = &field.values else {
            panic!("{name} is not a number a cell")
        };
        values.clone()
    };
    let (fraction, pressure) = (scalars("fraction"), scalars("pressure"));
    let edge = last.points[1][0] - last.points[0][0];
    let area: f64 = fraction.iter().sum::<f64>() * edge * edge;
    assert!((area / 0.08 - 1.0).abs() < 1e-2, "{area}");
    for (cell, corners) in last.points.as_chunks::<4>().0.iter().enumerate() {
        let column = (corners[0][0] / edge).round() as usize;
        let above = deposit[column][1] - 0.5 * (corners[0][2] + corners[2][2]);
        // ρ g of the bundled material; a pile's pressure is not hydrostatic, but bounded by friction.
        let weight = 1500.0 * 9.81 * above;
        if above > 0.05 {
            let ratio = pressure[cell] / weight;
            assert!((0.6..1.2).contains(&ratio), "{corners:?}: {ratio}");
        }
    }
}

/// A column of some 450 grains, ten across.
const GRAINS: [&str; 5] = [
    "model=dem",
    "aspect=1",
    "grains.diameter=0.1",
    "grains.width_diameters=4",
    "grid.cells=48",
];

fn of_grains<'a>(out: &'a str, sets: &[&'a str]) -> Vec<&'a str> {
    let mut list = vec!["run", "column-collapse", "--out", out];
    for set in GRAINS.iter().chain(sets) {
        list.extend(["--set", set]);
    }
    list
}

/// Grains run out as the experiments do, and stand beside the continuum with their calibrated law; grains without friction do
/// neither.
#[test]
fn column_of_grains_stands_beside_its_continuum() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    let shown = succeed(folder.path(), &of_grains("g", &["output.pictures=1"]));
    assert!(
        shown.contains("the continuum with their calibrated law"),
        "{shown}"
    );
    let found = summary(&at("g"));
    let (header, fronts) = table(&at("g/front.csv"));
    assert_eq!(header, ["t", "x_front", "height"]);
    let (header, deposit) = table(&at("g/deposit.csv"));
    assert_eq!(header, ["x", "h"]);
    // The deposit has the area of the column that stood before.
    let area: f64 = deposit.iter().map(|row| row[1] * 0.1).sum();
    let height = value(&found, "column_height");
    assert!((area / height - 1.0).abs() < 1e-9, "{area} {height}");
    assert!((height - 1.0).abs() < 0.08, "{height}");
    assert!((0.5..0.6).contains(&value(&found, "solid_fraction")));
    // It stands at first: the edge of a column is known to a diameter and a half.
    assert!((fronts[0][1] - 1.0).abs() < 0.15, "{}", fronts[0][1]);
    // Experiments at a = 1: 1.2 to 2.2 (Lajeunesse et al. 2005, Lube et al. 2005); a column ten grains wide runs out by
    // less (1.1 with an error of 0.15), one of thirty by 1.41.
    let runout = value(&found, "runout_scaled");
    assert!((0.9..2.0).contains(&runout), "{runout}");
    let connected = value(&found, "connected_front") - value(&found, "x_front");
    assert!(connected.abs() < 0.5, "{connected}");
    // In units of √(height/gravity).
    let time = value(&found, "time_of_rest") / (1.0_f64 / 9.81).sqrt();
    assert!((3.0..12.0).contains(&time), "{time}");
    // Two models of one material: nearer than a quarter, not the same.
    let continuum = value(&found, "continuum_runout_scaled");
    let difference = value(&found, "runout_difference");
    assert!((difference - (continuum / runout - 1.0)).abs() < 1e-12);
    assert!((0.01..0.3).contains(&difference.abs()), "{difference}");
    assert!((0.01..0.2).contains(&value(&found, "deposit_difference")));
    let (_, beside) = table(&at("g/beside.csv"));
    assert_eq!(beside.len(), deposit.len());
    let report = std::fs::read_to_string(at("g/report.html")).unwrap();
    assert!(report.contains("Both fronts in time") && report.contains("Profiles through time"));
    // Negative control: without friction nothing holds the heap.
    let slippery = [
        "grains.calibrated=none",
        "grains.floor=smooth",
        "contact.friction=0",
        "contact.rolling_friction=0",
        "contact.twisting_friction=0",
        "duration_scaled=4",
        "output.pictures=0",
    ];
    succeed(folder.path(), &of_grains("s", &slippery));
    let control = summary(&at("s"));
    assert!(value(&control, "runout_scaled") > 2.5);
    assert!(control["results"].get("continuum_runout_scaled").is_none());
}

/// A cliff of grains seven across whose face leans out, and the same of a continuum: both fall at once, over the lip.
#[test]
fn dry_cliff_falls_without_its_support() {
    let folder = tempfile::tempdir().unwrap();
    let lip = 30.0 * (1.0 + 10f64.to_radians().tan());
    let run = |out: &str, sets: &[&str]| {
        let mut list = vec!["run", "cliff-plain", "--out", out];
        for set in ["output.pictures=0", "grains.calibrated=none"]
            .iter()
            .chain(sets)
        {
            list.extend(["--set", set]);
        }
        succeed(folder.path(), &list);
        let (_, fronts) = table(&folder.path().join(out).join("front.csv"));
        let found = summary(&folder.path().join(out));
        (fronts[0][1], value(&found, "runout_scaled"))
    };
    let grains = ["grains.diameter=4.2", "grains.width_diameters=4"];
    let (start, of_grains) = run("g", &grains);
    assert!((start - lip).abs() < 6.0, "{start} {lip}");
    // An edge is known to a cell and a half, of 3.1 m.
    let (start, of_continuum) = run("c", &["model=continuum", "grid.cells=48"]);
    assert!((start - lip).abs() < 4.7, "{start} {lip}");
    for runout in [of_grains, of_continuum] {
        assert!((0.8..2.5).contains(&runout), "{of_grains} {of_continuum}");
    }
}

#[test]
fn interrupted_column_of_grains_goes_on_to_the_same_state() {
    let sets = ["grains.calibrated=none", "output.pictures=0"];
    goes_on_to_the_same_state("packing: ", |out| of_grains(out, &sets));
}

#[test]
fn interrupted_collapse_goes_on_to_the_same_state() {
    goes_on_to_the_same_state("run column-collapse", |out| {
        let mut list = vec!["run", "column-collapse", "--out", out];
        for set in ["scale=0.5", "aspect=0.7", "duration_scaled=3"] {
            list.extend(["--set", set]);
        }
        list
    });
}

/// The same over ground that cuts the cells.
#[test]
fn interrupted_collapse_on_terrain_goes_on_to_the_same_state() {
    goes_on_to_the_same_state("run column-collapse", |out| {
        let mut list = vec!["run", "column-collapse", "--out", out];
        for set in [
            "scale=0.5",
            "aspect=0.7",
            "duration_scaled=3",
            "terrain={profile=[[0.0,1.0],[2.0,1.0],[2.2,0.3],[6.0,0.0]]}",
        ] {
            list.extend(["--set", set]);
        }
        list
    });
}

#[test]
fn interrupted_cylinder_goes_on_to_the_same_state() {
    goes_on_to_the_same_state("run cylinder-collapse", |out| {
        let mut list = vec!["run", "cylinder-collapse", "--out", out];
        list.extend(["--set", "scale=0.5", "--set", "duration_scaled=1.5"]);
        list
    });
}

/// What has come in and gone out is part of the state.
#[test]
fn interrupted_open_chute_goes_on_to_the_same_state() {
    goes_on_to_the_same_state("run open-chute", |out| {
        let mut list = vec!["run", "open-chute", "--out", out];
        list.extend(["--set", "scale=0.75", "--set", "duration_scaled=3"]);
        list
    });
}

/// So is what has run out of a silo.
#[test]
fn interrupted_silo_goes_on_to_the_same_state() {
    goes_on_to_the_same_state("run silo-discharge", |out| {
        let mut list = vec!["run", "silo-discharge", "--out", out];
        list.extend(["--set", "duration_scaled=1.5"]);
        list
    });
}

/// The same in space.
#[test]
fn interrupted_open_chute_in_space_goes_on_to_the_same_state() {
    goes_on_to_the_same_state("run open-chute", |out| {
        let mut list = vec!["run", "open-chute", "--out", out];
        let across = "in_space={breadth=0.05,cells=6,walls={contact=\"free-slip\"}}";
        for set in ["scale=0.5", "duration_scaled=0.5", across] {
            list.extend(["--set", set]);
        }
        list
    });
}

/// `begun` is what the log says when there is a run to stop.
fn goes_on_to_the_same_state(begun: &str, arguments: impl Fn(&'static str) -> Vec<&'static str>) {
    let folder = tempfile::tempdir().unwrap();
    succeed(folder.path(), &arguments("whole"));
    let mut child = Command::new(env!("CARGO_BIN_EXE_colluvium"))
        .args(arguments("parts"))
        .current_dir(folder.path())
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .spawn()
        .unwrap();
    let has_begun = || {
        std::fs::read_to_string(folder.path().join("parts/log.txt"))
            .is_ok_and(|log| log.contains(begun))
    };
    let start = Instant::now();
    while !has_begun() && start.elapsed() < Duration::from_secs(60) {
        std::thread::sleep(Duration::from_millis(5));
    }
    std::thread::sleep(Duration::from_millis(50));
    let id = child.id().to_string();
    Command::new("kill").args(["-INT", &id]).status().unwrap();
    assert_eq!(child.wait().unwrap().code(), Some(130));
    let mut resume = arguments("parts");
    resume.extend(["--resume", "--threads", "1"]);
    succeed(folder.path(), &resume);
    let hash = |out: &str| summary(&folder.path().join(out))["state_hash"].clone();
    assert_eq!(hash("whole"), hash("parts"));
    let text = |out: &str| std::fs::read_to_string(folder.path().join(out)).unwrap();
    for name in [
        "front.csv",
        "balance.csv",
        "discharge.csv",
        "profiles.csv",
        "steps.csv",
        "flowing.csv",
    ] {
        // A chute has no front, what collapses no balance, and grains neither steps of a solver nor cells.
        if folder.path().join("whole").join(name).exists() {
            assert_eq!(
                text(&format!("whole/{name}")),
                text(&format!("parts/{name}"))
            );
        }
    }
}

/// Any law of friction collapses: the well-posed form of μ(I) runs out less far than μ(I), because it bears
/// more at large I; a table of one friction runs as far as Coulomb's law with it.
#[test]
fn columns_of_any_law() {
    let folder = tempfile::tempdir().unwrap();
    let runout = |out: &str, sets: &[&str]| {
        let mut list = vec!["run", "column-collapse", "--out", out];
        for set in ["scale=0.375", "aspect=1.42", "duration_scaled=8"] {
            list.extend(["--set", set]);
        }
        for set in sets {
            list.extend(["--set", set]);
        }
        succeed(folder.path(), &list);
        value(&summary(&folder.path().join(out)), "runout_scaled")
    };
    let mu_i = runout("mu-i", &[]);
    let regularised = runout(
        "barker-gray",
        &[
            "rheology.law=\"barker-gray\"",
            "rheology.alpha=1.9",
            "rheology.mu_infinity=0.05",
        ],
    );
    let coulomb = runout(
        "coulomb",
        &[
            "rheology.law=\"coulomb\"",
            "rheology.mu_s=0.4",
            "rheology.viscosity=0",
        ],
    );
    let flat = runout(
        "table",
        &[
            "rheology.law=\"table\"",
            "rheology.table=[[0.01,0.4],[1.0,0.4]]",
        ],
    );
    laws_with_a_yield_stress_rest_and_others_creep(folder.path());
    assert!(
        regularised < mu_i && regularised > 0.7 * mu_i,
        "{mu_i} {regularised}"
    );
    assert!((flat / coulomb - 1.0).abs() < 1e-3, "{flat} {coulomb}");
}

/// μ(I) comes to rest and says below which speeds; the regularised law still creeps, by what summary and report tell, and
/// rises nowhere.
fn laws_with_a_yield_stress_rest_and_others_creep(folder: &Path) {
    let [rests, creeps] = ["mu-i", "barker-gray"].map(|out| summary(&folder.join(out)));
    let report = |out: &str| std::fs::read_to_string(folder.join(out).join("report.html")).unwrap();
    assert!(value(&rests, "largest_speed") < value(&rests, "rest_speed"));
    assert!(rests["results"].get("creep_speed").is_none());
    assert!(
        report("mu-i").contains("At rest: speeds below")
            && !report("mu-i").contains("no yield stress")
    );
    assert!(creeps["results"]["time_of_rest"]["value"].is_null());
    assert!(creeps["results"].get("rest_speed").is_none());
    let (speed, fall) = (
        value(&creeps, "creep_speed"),
        value(&creeps, "top_fall_rate"),
    );
    assert_eq!(speed, value(&creeps, "largest_speed"));
    assert!(
        speed > 0.0 && fall.abs() < 1e-3 * 9.81_f64.sqrt(),
        "{speed} {fall}"
    );
    let (_, fronts) = table(&folder.join("barker-gray/front.csv"));
    // It is followed to the end, where the other one has long ended.
    assert_eq!(fronts.len(), 241);
    let [first, last] = [&fronts[fronts.len() - 11], &fronts[fronts.len() - 1]];
    let told = (first[2] - last[2]) / (last[0] - first[0]);
    assert!((fall - told).abs() < 1e-12, "{fall} {told}");
    // The bundled column is 1 m high.
    let scaled = value(&creeps, "creep_speed_scaled");
    assert!(
        (scaled * 9.81_f64.sqrt() / speed - 1.0).abs() < 1e-9,
        "{scaled}"
    );
    assert!(report("barker-gray").contains("no yield stress"));
}

/// Side walls hold the material back.
#[test]
fn narrow_channel_shortens_the_runout() {
    let folder = tempfile::tempdir().unwrap();
    let runout = |out: &str, walls: &[&str]| {
        let mut list = vec!["run", "column-collapse", "--out", out];
        list.extend(["--set", "scale=0.375", "--set", "aspect=0.7"]);
        list.extend(walls);
        succeed(folder.path(), &list);
        let summary = summary(&folder.path().join(out));
        summary["results"]["runout_scaled"]["value"]
            .as_f64()
            .unwrap()
    };
    let plane = runout("plane", &[]);
    let walls = ["side_walls.width=0.6", "side_walls.friction=0.3"];
    let channel = runout("channel", &["--set", walls[0], "--set", walls[1]]);
    assert!(channel > 0.3 && channel < 0.85 * plane, "{plane} {channel}");
}

#[test]
fn bad_collapses_are_refused_by_key() {
    let folder = tempfile::tempdir().unwrap();
    for (set, key, allowed) in [
        ("model=\"gas\"", "model", "continuum"),
        ("grid.length_scaled=1.5", "grid.length_scaled", "2"),
        ("grid.cells=8", "grid.cells", "at least"),
        (
            "side_walls={width=0.0,friction=0.2}",
            "side_walls.width",
            "(0, 100000]",
        ),
        ("solver.courant=1.5", "solver.courant", "1"),
        ("rheology.mu_2=0.1", "rheology.mu_2", "0.32"),
        ("aspect=0", "aspect", "0.05"),
        (
            "rheology.law=\"barker-gray\"",
            "rheology.alpha",
            "barker-gray",
        ),
        ("rheology.alpha=1.9", "rheology.alpha", "mu-i"),
        ("grains.floor=\"sand\"", "grains.floor", "smooth"),
        (
            "contact.youngs_modulus=1e6",
            "contact.youngs_modulus",
            "hooke",
        ),
    ] {
        let refused = colluvium(
            folder.path(),
            &["run", "column-collapse", "--out", "x", "--set", set],
        );
        assert_eq!(refused.status.code(), Some(2), "{set}");
        let message = String::from_utf8_lossy(&refused.stderr).into_owned();
        assert!(
            message.contains(key) && message.contains(allowed),
            "{set}: {message}"
        );
        assert!(!folder.path().join("x").exists());
    }
    for (set, key, allowed) in [
        ("grains.diameter=0.5", "grains.diameter", "at most 0.25"),
        (
            "grid.length_scaled=0.9",
            "grid.length_scaled",
            "greater than",
        ),
        (
            "side_walls={width=1.0,friction=0.2}",
            "side_walls",
            "periodic across",
        ),
    ] {
        let refused = colluvium(folder.path(), &of_grains("x", &[set]));
        assert_eq!(refused.status.code(), Some(2), "{set}");
        let message = String::from_utf8_lossy(&refused.stderr).into_owned();
        assert!(
            message.contains(key) && message.contains(allowed),
            "{message}"
        );
        assert!(!folder.path().join("x").exists());
    }
}

/// A column on a plateau runs over its edge: the same bits with one thread and two, and by points, a raster and a mesh of the same ground.
#[test]
fn collapse_on_terrain() {
    let folder = tempfile::tempdir().unwrap();
    let heights = [1.0, 1.0, 1.0, 0.875, 0.625, 0.25, 0.125, 0.0, 0.0];
    let spacing = 0.5;
    let points: Vec<String> = heights
        .iter()
        .enumerate()
        .map(|(n, z)| format!("[{:?},{z:?}]", n as f64 * spacing))
        .collect();
    let row = heights.map(|z| z.to_string()).join(" ");
    let raster = format!(
        "ncols 9\nnrows 2\nxllcenter 100\nyllcenter 50\ncellsize {spacing}\n{row}\n{row}\n"
    );
    std::fs::write(folder.path().join("hill.asc"), raster).unwrap();
    let mut mesh = String::new();
    for (n, z) in heights.iter().enumerate() {
        let x = n as f64 * spacing;
        mesh += &format!("v {x} -1 {z}\nv {x} 1 {z}\n");
    }
    for n in 0..heights.len() - 1 {
        let [a, b, c, d] = [1, 3, 4, 2].map(|k| 2 * n + k);
        mesh += &format!("f {a} {b} {c}\nf {a} {c} {d}\n");
    }
    std::fs::write(folder.path().join("hill.obj"), mesh).unwrap();
    let profile = format!("terrain={{profile=[{}]}}", points.join(","));
    let run = |out: &str, terrain: &str, threads: &str| {
        let mut list = vec!["run", "column-collapse", "--out", out, "--threads", threads];
        for set in [
            "aspect=1.0",
            "grid.cells=40",
            "grid.length_scaled=4.0",
            "duration_scaled=3.0",
        ] {
            list.extend(["--set", set]);
        }
        list.extend(["--set", terrain]);
        succeed(folder.path(), &list);
        summary(&folder.path().join(out))["state_hash"].clone()
    };
    let points = run("points", &profile, "1");
    assert_eq!(points, run("two", &profile, "2"));
    let file = "terrain={heights=\"hill.asc\",start=[100.0,50.2]}";
    assert_eq!(points, run("raster", file, "1"));
    run("mesh", "terrain={mesh=\"hill.obj\",start=[0.0,0.3]}", "1");
    // Triangles put more points on the same line.
    let front = |out: &str| value(&summary(&folder.path().join(out)), "x_front");
    assert!((front("mesh") / front("points") - 1.0).abs() < 1e-3);
    let out = folder.path().join("points");
    let summary = summary(&out);
    assert!(summary["ledger"]["mass_relative"].as_f64().unwrap().abs() < 1e-12);
    let (header, deposit) = table(&out.join("deposit.csv"));
    assert_eq!(header, ["x", "h", "z_ground"]);
    assert!((deposit[0][2] - 1.0).abs() < 1e-12 && deposit[39][2].abs() < 0.1);
    // The fields show the ground: all that lies under the profile, down to the lower edge of the grid.
    let frames = vtkhdf::read_series(&out.join("fields.vtkhdf")).unwrap();
    let last = frames.last().unwrap();
    let is_ground = last.fields.iter().find(|f| f.name == "ground").unwrap();
    let vtkhdf::Values::Counts(is_ground) = &is_ground.values else {
        panic!("flags");
    };
    let ground: f64 = is_ground
        .iter()
        .zip(last.points.chunks_exact(4))
        .filter(|(ground, _)| **ground == 1)
        .map(|(_, q)| (q[1][0] - q[0][0]) * (0.5 * (q[2][2] + q[3][2]) - q[0][2]))
        .sum();
    // The trapezoids of the profile, and a row of cells below it.
    let under: f64 = heights
        .windows(2)
        .map(|z| 0.5 * (z[0] + z[1]) * spacing)
        .sum();
    assert!(
        (ground - under - 0.1 * 4.0).abs() < 1e-9,
        "{ground} {under}"
    );
    let report = std::fs::read_to_string(out.join("report.html")).unwrap();
    assert!(report.contains("ground") && report.contains("height z [m]"));
    let planned = colluvium(
        folder.path(),
        &[
            "plan",
            "column-collapse",
            "--set",
            &profile,
            "--set",
            "grid.length_scaled=4.0",
        ],
    );
    let planned = String::from_utf8_lossy(&planned.stdout).into_owned();
    assert!(
        planned.contains("terrain") && planned.contains("9 points"),
        "{planned}"
    );
}

#[test]
fn bad_terrain_is_refused_by_key() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("flat.asc"), "ncols 2\n").unwrap();
    for (set, key, allowed) in [
        ("terrain={}", "terrain.profile", "terrain.mesh"),
        ("terrain={profile=[[0.0,0.0]]}", "terrain.profile", "2"),
        (
            "terrain={profile=[[0.0,0.0],[2.0,0.0]]}",
            "terrain.profile",
            "ground at all x",
        ),
        (
            "terrain={profile=[[0.0,0.0],[9.0,0.0]],mesh=\"a.stl\"}",
            "terrain.mesh",
            "only one of",
        ),
        (
            "terrain={profile=[[0.0,0.0],[9.0,0.0]],friction=0.3}",
            "terrain.friction",
            "coulomb",
        ),
        (
            "terrain={profile=[[0.0,0.0],[9.0,0.0]],contact=\"coulomb\"}",
            "terrain.friction",
            "coefficient",
        ),
        (
            "terrain={heights=\"none.asc\"}",
            "terrain.heights",
            "none.asc",
        ),
        (
            "terrain={heights=\"flat.asc\"}",
            "terrain.heights",
            "flat.asc",
        ),
        ("terrain={mesh=\"a.txt\"}", "terrain.mesh", "stl"),
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
