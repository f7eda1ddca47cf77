//! Boxes that move, in scenes of one's own: what `history.csv` says of them against what is exact.

use super::{grains, run, write};
use crate::command::{colluvium, hash, succeed};
use std::f64::consts::PI;

/// A law and a kind of grains.
pub const BASE: &str = r#"
scene = "grains"
seed = 3
duration = 0.3
output = { rows = 100, pictures = 0, ledger = true }

[contact]
normal = "hooke"
stiffness = 2.0e3
restitution = 0.4
tangential = "linear"
stiffness_ratio = 0.2857142857142857
tangential_restitution = 0.4
friction = 0.1

[grains.ball]
density = 1000.0
sizes = { law = "uniform", smallest = 0.045, largest = 0.055 }
"#;

/// A loose cloud that fills a periodic box; how it moves is still to be said.
pub const BOX: &str = r#"
[boundaries]
lower = [0.0, 0.0, 0.0]
upper = [0.8, 0.8, 0.8]
periodic = [true, true, true]

[[prepare]]
do = "insert"
solid_fraction = 0.3
within = [{ shape = "block", lower = [0.0, 0.0, 0.0], upper = [0.8, 0.8, 0.8] }]
"#;

#[test]
fn a_box_shrinks_until_it_carries_its_pressure() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    let servo = "\n[boundaries.motion]\nkind = \"servo\"\npressure = 500.0\nrate = 1.0\n";
    write(at, "box.toml", &[BASE, BOX, servo]);
    let plan = succeed(at, &["plan", "box.toml"]);
    assert!(plan.contains("follow a pressure of 500 Pa"), "{plan}");
    let seen = run(at, "box.toml", "a", &["duration=2"]);
    let late = seen.of("t").len() - 20..seen.of("t").len();
    let pressure = |k: usize| {
        ["xx", "yy", "zz"]
            .iter()
            .map(|a| -seen.of(&format!("box_stress_{a}"))[k] / 3.0)
            .sum::<f64>()
    };
    let mean = late.clone().map(pressure).sum::<f64>() / 20.0;
    assert!((mean / 500.0 - 1.0).abs() < 0.01, "{mean}");
    // All edges alike, and as dense as grains of that friction get.
    let edge = seen.last("box_length_x");
    assert!(edge < 0.8);
    for axis in ["y", "z"] {
        assert!((seen.last(&format!("box_length_{axis}")) / edge - 1.0).abs() < 1e-12);
    }
    let radii = grains(&at.join("a"), ["radius"]);
    let volume: f64 = radii.iter().map(|[r]| 4.0 / 3.0 * PI * r.powi(3)).sum();
    let solid = volume / edge.powi(3);
    assert!((0.56..0.72).contains(&solid), "{solid}");
    assert!(seen.last("box_work") > 0.0);
    // Two threads, the same bits.
    let two = [
        "run",
        "box.toml",
        "--out",
        "two",
        "--threads",
        "2",
        "--set",
        "duration=2",
    ];
    succeed(at, &two);
    assert_eq!(hash(&at.join("two")), hash(&at.join("a")));
}

#[test]
fn a_sheared_box_keeps_its_gradient_and_pays_for_it() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    let shear = "\n[boundaries.motion]\nkind = \"shear\"\nrate = 4.0\nacross = 2\n";
    let denser = BOX.replace("solid_fraction = 0.3", "solid_fraction = 0.35");
    write(at, "shear.toml", &[BASE, &denser, shear]);
    write(at, "still.toml", &[BASE, &denser]);
    let sheared = run(
        at,
        "shear.toml",
        "a",
        &["duration=2", "output.rows=2000", "timestep.safety=0.25"],
    );
    let still = run(at, "still.toml", "b", &["duration=0.1"]);
    let slope = |out: &str| {
        let rows = grains(&at.join(out), ["z", "vx"]);
        let sums = rows.iter().fold([0.0; 2], |s, [z, vx]| {
            let z = z - 0.4;
            [s[0] + z * vx, s[1] + z * z]
        });
        sums[0] / sums[1]
    };
    assert!((slope("a") / 4.0 - 1.0).abs() < 0.1, "{}", slope("a"));
    assert!(slope("b").abs() < 1e-9, "{}", slope("b"));
    assert_eq!(still.last("box_work"), 0.0);
    // Dashpots push half a step late: at the usual step the stress is told a tenth too high.
    // What the boundary gave is stress times rate times volume, as far as 1000 looks tell.
    let t = sheared.of("t");
    let half = t.len() / 2;
    let stress = &sheared.of("box_stress_xz")[half..];
    let mean = stress.iter().sum::<f64>() / stress.len() as f64;
    let work = sheared.of("box_work");
    let given = work[t.len() - 1] - work[half];
    let told = mean * 4.0 * 0.512 * (t[t.len() - 1] - t[half]);
    assert!(
        given > 0.0 && (told / given - 1.0).abs() < 0.05,
        "{told} {given}"
    );
}

#[test]
fn a_stretched_row_of_bonds_takes_the_work_of_the_box() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    // Ten grains of one size right round the box, bonded: springs in a row.
    let spacing = 0.1001;
    let base = BASE.replace(
        "law = \"uniform\", smallest = 0.045, largest = 0.055",
        "law = \"equal\", radius = 0.05",
    );
    let frame = format!(
        "\n[boundaries]\nlower = [0.0, 0.0, 0.0]\nupper = [{}, 0.6, 0.6]\nperiodic = [true, true, true]\n\
         \n[bonds.glue]\ngap = 0.1\nyoungs_modulus = 1.0e6\nstiffness_ratio = 3.5\nradius_ratio = 0.5\n",
        10.0 * spacing
    );
    let points: Vec<String> = (0..10)
        .map(|k| format!("[{}, 0.3, 0.3]", spacing * (f64::from(k) + 0.5)))
        .collect();
    let row = format!(
        "\n[[prepare]]\ndo = \"put\"\npoints = [{}]\n",
        points.join(", ")
    );
    let stretch = "\n[boundaries.motion]\nkind = \"stretch\"\nspeeds = [0.1, 0.0, 0.0]\n";
    std::fs::write(
        at.join("edges.csv"),
        format!(
            "t,x,y,z\n0,{0},0.6,0.6\n1,{1},0.6,0.6\n",
            10.0 * spacing,
            10.0 * spacing + 0.1
        ),
    )
    .unwrap();
    let tabled = "\n[boundaries.motion]\nkind = \"table\"\nfile = \"edges.csv\"\n";
    write(at, "stretch.toml", &[&base, &frame, &row, stretch]);
    write(at, "tabled.toml", &[&base, &frame, &row, tabled]);
    let by_speed = run(at, "stretch.toml", "a", &["duration=0.2"]);
    let by_table = run(at, "tabled.toml", "b", &["duration=0.2"]);
    // A bond of two equal grains is a spring of E A/(2 R), A of half the grains' radius.
    let stiffness = 1.0e6 * PI * 0.025f64.powi(2) / 0.1 / 10.0;
    for seen in [&by_speed, &by_table] {
        let grown = seen.last("box_length_x") - 10.0 * spacing;
        assert!((grown / 0.02 - 1.0).abs() < 1e-2, "{grown}");
        let stored = 0.5 * stiffness * grown * grown;
        // The ledger begins with the grains carried along.
        let work = seen.last("box_work");
        assert!((work / stored - 1.0).abs() < 1e-9, "{work} {stored}");
        assert!((-seen.last("bond_work") / stored - 1.0).abs() < 1e-9);
    }
}

#[test]
fn what_leaves_an_open_box_is_taken_out() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    let open = r#"
gravity = { uniform = [0.0, 0.0, -9.81] }
boundaries = { lower = [0.0, 0.0, 0.0], upper = [0.8, 0.8, 0.8], outlet = { every = 10, keep = [
    { shape = "block", lower = [-9.0, -9.0, -0.5] },
] } }
"#;
    let cloud = &BOX[BOX.find("[[prepare]]").unwrap()..];
    write(at, "open.toml", &[open, BASE, "\n", cloud]);
    let seen = run(at, "open.toml", "a", &["duration=0.6"]);
    let left = seen.of("grains");
    assert!(left[0] > 100.0 && *left.last().unwrap() == 0.0, "{left:?}");
    assert!(left.is_sorted_by(|a, b| a >= b));
    // Free fall: the lowest leave after √(2 · 0.5/g), the highest √(2 · 1.3/g).
    let gone = |share: f64| {
        let k = left.iter().position(|n| *n <= share * left[0]).unwrap();
        seen.of("t")[k]
    };
    assert!(gone(0.99) > (2.0f64 * 0.5 / 9.81).sqrt() && gone(0.0) < (2.0f64 * 1.31 / 9.81).sqrt());
}

#[test]
fn boxes_that_cannot_be_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    write(at, "box.toml", &[BASE, BOX]);
    std::fs::write(
        at.join("short.csv"),
        "t,x,y,z\n0,0.7,0.8,0.8\n1,0.6,0.8,0.8\n",
    )
    .unwrap();
    for (motion, words) in [
        (
            "{kind=\"stretch\"}",
            &["boundaries.motion.speeds", "missing"][..],
        ),
        ("{kind=\"table\"}", &["boundaries.motion.file", "missing"]),
        (
            "{kind=\"table\",file=\"short.csv\"}",
            &["boundaries.motion.file", "0.7", "0.8"],
        ),
        (
            "{kind=\"table\",file=\"none.csv\"}",
            &["boundaries.motion.file", "none.csv"],
        ),
        (
            "{kind=\"servo\",pressure=500}",
            &["boundaries.motion.rate", "missing"],
        ),
        (
            "{kind=\"servo\",pressure=500,rate=1,speeds=[1,0,0]}",
            &["boundaries.motion.speeds", "servo"],
        ),
        (
            "{kind=\"shear\",rate=1,across=3}",
            &["boundaries.motion.across", "3"],
        ),
        ("{kind=\"squash\"}", &["boundaries.motion.kind", "stretch"]),
    ] {
        let set = format!("boundaries.motion={motion}");
        let done = colluvium(at, &["run", "box.toml", "--out", "bad", "--set", &set]);
        let message = String::from_utf8_lossy(&done.stderr).into_owned();
        assert_eq!(done.status.code(), Some(2), "{set}: {message}");
        for word in words {
            assert!(message.contains(word), "{set}: no `{word}` in: {message}");
        }
        assert!(!at.join("bad").exists(), "{set}");
    }
}
