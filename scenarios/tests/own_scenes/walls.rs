//! Walls in scenes of one's own: a mesh from Gmsh against a plane, every motion, a servo, what `history.csv` says of them.

use super::{run, write};
use crate::command::{Columns, colluvium, succeed};
use std::f64::consts::TAU;
use std::fmt::Write;

/// A law, a kind of grains, the weight.
const BASE: &str = r#"
scene = "grains"
seed = 2
duration = 0.25
output = { rows = 50, pictures = 0 }
gravity = { uniform = [0.0, 0.0, -9.81] }

[contact]
normal = "hertz"
youngs_modulus = 2.0e6
poissons_ratio = 0.3
restitution = 0.6
friction = 0.4

[grains.gravel]
density = 2500.0
sizes = { law = "equal", radius = 0.005 }
"#;

/// One grain at a place.
fn grain_at([x, y, z]: [f64; 3], velocity: &str) -> String {
    format!("\n[[prepare]]\ndo = \"put\"\npoints = [[{x}, {y}, {z}]]\nvelocity = {velocity}\n")
}

/// A square in z = 0 cut into triangles, as Gmsh writes it (`msh` 2.2).
fn gmsh_floor(half: f64, cells: usize) -> String {
    let side = cells + 1;
    let mut text = format!(
        "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$Nodes\n{}\n",
        side * side
    );
    for k in 0..side * side {
        let at = |n: usize| -half + 2.0 * half * n as f64 / cells as f64;
        writeln!(text, "{} {} {} 0", k + 1, at(k % side), at(k / side)).unwrap();
    }
    writeln!(text, "$EndNodes\n$Elements\n{}", 2 * cells * cells).unwrap();
    for k in 0..cells * cells {
        let first = k / cells * side + k % cells + 1;
        let (right, up, over) = (first + 1, first + side, first + side + 1);
        writeln!(text, "{} 2 2 1 1 {first} {right} {over}", 2 * k + 1).unwrap();
        writeln!(text, "{} 2 2 1 1 {first} {over} {up}", 2 * k + 2).unwrap();
    }
    text + "$EndElements\n"
}

#[test]
fn a_floor_from_gmsh_is_the_plane() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    std::fs::write(at.join("floor.msh"), gmsh_floor(0.2, 13)).unwrap();
    let thrown = [
        grain_at([0.0, 0.0, 0.02], "[0.3, 0.11, -0.4]"),
        grain_at([-0.05, 0.03, 0.012], "[0.2, -0.07, 0.0]"),
    ]
    .concat();
    let floor = |keys: &str| format!("\n[walls.floor]\n{keys}\n");
    let plane = floor("shape = \"plane\"\naxis = [0.0, 0.0, 1.0]");
    let mesh = |z: f64| {
        floor(&format!(
            "shape = \"mesh\"\nfile = \"floor.msh\"\npoint = [0.0, 0.0, {z}]"
        ))
    };
    write(at, "plane.toml", &[BASE, &plane, &thrown]);
    write(at, "mesh.toml", &[BASE, &mesh(0.0), &thrown]);
    write(at, "low.toml", &[BASE, &mesh(-1e-4), &thrown]);
    let [plane, mesh, low] =
        ["plane", "mesh", "low"].map(|name| run(at, &format!("{name}.toml"), name, &[]));
    let apart = |other: &Columns| {
        let of = |name: &str| {
            let pairs = plane.of(name).iter().zip(other.of(name));
            pairs.map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
        };
        ["x", "y", "z", "rotation"]
            .map(of)
            .into_iter()
            .fold(0.0, f64::max)
    };
    // They bounce, roll and slide over many edges.
    assert!(plane.of("contacts").iter().sum::<f64>() > 20.0);
    assert!(plane.of("rotation").last().unwrap() > &1e-7);
    assert!(apart(&mesh) < 1e-11, "{:e}", apart(&mesh));
    // The control: a floor a tenth of a millimetre lower.
    assert!(apart(&low) > 1e-5, "{:e}", apart(&low));
    // The floor has taken the momentum that gravity gave and the grains lost.
    let mass = 2500.0 * 2.0 / 3.0 * TAU * 0.005f64.powi(3);
    for columns in [&plane, &mesh] {
        let taken: f64 = columns.of("floor_jz").iter().sum();
        let (t, vz) = (columns.of("t"), columns.of("vz"));
        let last = t.len() - 1;
        let given = 2.0 * mass * (vz[0] - vz[last] - 9.81 * t[last]);
        // Impulses are those of whole steps, velocities stand half a step further.
        assert!((taken / given - 1.0).abs() < 1e-3, "{taken} {given}");
        // Impulse is mean force times the time from row to row.
        for k in 1..t.len() {
            let mean = columns.of("floor_fz")[k] * (t[k] - t[k - 1]);
            assert!((mean - columns.of("floor_jz")[k]).abs() < 1e-9 * given.abs());
        }
    }
}

#[test]
fn every_motion_goes_where_it_is_told() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    std::fs::write(
        at.join("way.csv"),
        "t,x,y,z\n0,0,0,0\n0.1,0,0.02,0\n0.2,0.01,0.02,-0.03\n",
    )
    .unwrap();
    let walls = r#"
[walls.floor]
shape = "plane"
axis = [0.0, 0.0, 1.0]

[walls.steady]
shape = "disk"
axis = [0.0, 0.0, 1.0]
radius = 0.01
point = [1.0, 0.0, 0.0]
motion = { kind = "steady", velocity = [0.1, 0.0, -0.2] }

[walls.sine]
shape = "sphere"
side = "outside"
radius = 0.01
point = [2.0, 0.0, 0.0]
motion = { kind = "sine", amplitude = [0.01, 0.02, 0.0], frequency = [5.0, 9.0, 0.0], phase = [0.0, 1.2, 0.0] }

[walls.stairs]
shape = "rectangle"
half_sides = [[0.01, 0.0, 0.0], [0.0, 0.02, 0.0]]
point = [3.0, 0.0, 0.0]
motion = { kind = "staircase", velocity = [0.0, 0.0, 0.5], duration = 0.02, period = 0.05, first = 0.03, growing = 2 }

[walls.turning]
shape = "frustum"
capped = true
axis = [0.0, 0.0, 1.0]
length = 0.05
radii = [0.01, 0.02]
point = [4.0, 0.1, 0.0]
motion = { kind = "rotation", point = [4.0, 0.0, 0.0], axis = [0.0, 0.0, 1.0], rate = 7.0 }

[walls.led]
shape = "cylinder"
side = "outside"
axis = [0.0, 1.0, 0.0]
radius = 0.01
length = 0.1
point = [5.0, 0.0, 0.0]
motion = { kind = "table", file = "way.csv" }
"#;
    write(
        at,
        "walls.toml",
        &[BASE, walls, &grain_at([0.0, 0.0, 0.005], "[0.0, 0.0, 0.0]")],
    );
    let plan = succeed(at, &["plan", "walls.toml"]);
    for word in [
        "moving steadily",
        "shaking",
        "jumping",
        "turning",
        "following a table",
    ] {
        assert!(plan.contains(word), "{word}: {plan}");
    }
    let seen = run(at, "walls.toml", "a", &[]);
    let stairs = |t: f64| {
        // Jumps of 0.02 s at 0.03, 0.08, …, the first at half the speed.
        let jump = |n: f64| (t - 0.03 - 0.05 * n).clamp(0.0, 0.02);
        0.5 * (0.5 * jump(0.0) + (1..5).map(|n| jump(f64::from(n))).sum::<f64>())
    };
    let straight = |points: [(f64, f64); 3], t: f64| {
        let [(a, x), (b, y), (c, z)] = points;
        match t {
            t if t < b => x + (y - x) * (t - a) / (b - a),
            t if t < c => y + (z - y) * (t - b) / (c - b),
            _ => z,
        }
    };
    for (k, &t) in seen.of("t").iter().enumerate() {
        let place = |wall: &str| ["x", "y", "z"].map(|axis| seen.of(&format!("{wall}_{axis}"))[k]);
        let wanted = [
            ("steady", [1.0 + 0.1 * t, 0.0, -0.2 * t]),
            (
                "sine",
                [
                    2.0 + 0.01 * (TAU * 5.0 * t).sin(),
                    0.02 * (TAU * 9.0 * t + 1.2).sin(),
                    0.0,
                ],
            ),
            ("stairs", [3.0, 0.0, stairs(t)]),
            (
                "turning",
                [4.0 - 0.1 * (7.0 * t).sin(), 0.1 * (7.0 * t).cos(), 0.0],
            ),
            (
                "led",
                [
                    5.0 + straight([(0.0, 0.0), (0.1, 0.0), (0.2, 0.01)], t),
                    straight([(0.0, 0.0), (0.1, 0.02), (0.2, 0.02)], t),
                    straight([(0.0, 0.0), (0.1, 0.0), (0.2, -0.03)], t),
                ],
            ),
        ];
        for (wall, wanted) in wanted {
            let found = place(wall);
            for (a, b) in found.iter().zip(wanted) {
                assert!((a - b).abs() < 1e-9, "{wall} at {t}: {found:?} {wanted:?}");
            }
        }
    }
    // A wall at rest has no columns of its place.
    assert!(seen.find("floor_x").is_none() && seen.find("floor_tx").is_some());
}

#[test]
fn a_weight_beside_the_middle_turns_its_plate() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    let plate = r#"
[walls.plate]
shape = "rectangle"
half_sides = [[0.1, 0.0, 0.0], [0.0, 0.1, 0.0]]
"#;
    let resting = grain_at([0.03, -0.02, 0.005], "[0.0, 0.0, 0.0]");
    write(at, "plate.toml", &[BASE, plate, &resting]);
    let seen = run(at, "plate.toml", "a", &[]);
    let weight = 2500.0 * 2.0 / 3.0 * TAU * 0.005f64.powi(3) * 9.81;
    let last = |name: &str| *seen.of(name).last().unwrap();
    assert!(
        (last("plate_fz") / -weight - 1.0).abs() < 1e-3,
        "{}",
        last("plate_fz")
    );
    // r × F with r = (0.03, -0.02), F = -w: (0.02, 0.03) w.
    for (name, wanted) in [("plate_tx", 0.02 * weight), ("plate_ty", 0.03 * weight)] {
        assert!(
            (last(name) / wanted - 1.0).abs() < 1e-3,
            "{name} {}",
            last(name)
        );
    }
    assert!(last("plate_tz").abs() < 1e-9 * weight);
    let t = seen.of("t");
    let interval = t[t.len() - 1] - t[t.len() - 2];
    assert!((last("plate_ly") - last("plate_ty") * interval).abs() < 1e-12 * weight);
}

/// A box of grains under a lid.
const LIDDED: &str = r#"
[boundaries]
lower = [0.0, 0.0, 0.0]
upper = [0.05, 0.05, 1.0]
periodic = [true, true, false]

[walls.floor]
shape = "plane"
axis = [0.0, 0.0, 1.0]

[[prepare]]
do = "pour"
count = 150
within = [{ shape = "block", lower = [0.0, 0.0, 0.06], upper = [0.05, 0.05, 0.16] }]
"#;

#[test]
fn a_lid_keeps_its_pressure_to_a_hundredth() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    let lid = |target: &str| {
        format!(
            "\n[walls.lid]\nshape = \"plane\"\naxis = [0.0, 0.0, -1.0]\npoint = [0.0, 0.0, 0.17]\n\
             motion = {{ kind = \"servo\", axis = [0.0, 0.0, -1.0], {target}, gain = 0.02, speed_limit = 0.5 }}\n"
        )
    };
    // The same push, as a pressure on the box's cross-section and as a force; the control asks for less.
    let cases = [
        ("pressure", "pressure = 2000.0, area = 0.0025", 5.0),
        ("force", "force = 5.0", 5.0),
        ("less", "force = 4.0", 4.0),
    ];
    for (name, target, wanted) in cases {
        write(at, "lid.toml", &[BASE, LIDDED, &lid(target)]);
        let seen = run(at, "lid.toml", name, &["duration=2", "packing=lidded"]);
        let late: Vec<usize> = (0..seen.of("t").len())
            .filter(|&k| seen.of("t")[k] > 1.5)
            .collect();
        let mean = |column: &str| {
            late.iter().map(|&k| seen.of(column)[k]).sum::<f64>() / late.len() as f64
        };
        let push = mean("lid_fz");
        assert!((push / wanted - 1.0).abs() < 0.01, "{name}: {push}");
        // The floor bears that and the weight of the grains.
        let weight = 150.0 * 2500.0 * 2.0 / 3.0 * TAU * 0.005f64.powi(3) * 9.81;
        assert!((-mean("floor_fz") / (push + weight) - 1.0).abs() < 0.01);
        let sunk = seen.of("lid_z");
        assert!(
            sunk.last().unwrap() < &0.07 && sunk.last().unwrap() > &0.03,
            "{sunk:?}"
        );
    }
}

#[test]
fn motions_that_cannot_be_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    std::fs::write(
        at.join("back.csv"),
        "t,x,y,z\n0,0,0,0\n0.2,0,0,0\n0.1,0,0,0\n",
    )
    .unwrap();
    std::fs::write(at.join("short.csv"), "t,x,y\n0,0,0\n").unwrap();
    let floor = "\n[walls.floor]\nshape = \"plane\"\naxis = [0.0, 0.0, 1.0]\n";
    write(
        at,
        "own.toml",
        &[BASE, floor, &grain_at([0.0, 0.0, 0.01], "[0.0, 0.0, 0.0]")],
    );
    for (motion, words) in [
        (
            "{kind=\"table\",file=\"none.csv\"}",
            &["walls.floor.motion.file", "none.csv"][..],
        ),
        (
            "{kind=\"table\",file=\"short.csv\"}",
            &["walls.floor.motion.file", "`z`"],
        ),
        (
            "{kind=\"table\",file=\"back.csv\"}",
            &["walls.floor.motion", "time"],
        ),
        (
            "{kind=\"staircase\",velocity=[0,0,1],duration=0.2,period=0.1}",
            &["walls.floor.motion", "duration"],
        ),
        (
            "{kind=\"servo\",axis=[0,0,-1],gain=1,speed_limit=1}",
            &["walls.floor.motion.pressure", "missing"],
        ),
        (
            "{kind=\"servo\",axis=[0,0,-1],force=1,pressure=1,area=1,gain=1,speed_limit=1}",
            &["walls.floor.motion.force", "walls.floor.motion.pressure"],
        ),
        (
            "{kind=\"rotation\",point=[0,0,0],axis=[0,0,0],rate=1}",
            &["walls.floor.motion.axis"],
        ),
    ] {
        let set = format!("walls.floor.motion={motion}");
        let done = colluvium(at, &["run", "own.toml", "--out", "bad", "--set", &set]);
        let message = String::from_utf8_lossy(&done.stderr).into_owned();
        assert_eq!(done.status.code(), Some(2), "{set}: {message}");
        for word in words {
            assert!(message.contains(word), "{set}: no `{word}` in: {message}");
        }
        assert!(!at.join("bad").exists(), "{set}");
    }
}
