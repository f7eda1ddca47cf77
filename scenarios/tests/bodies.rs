//! Rigid bodies in scenes of one's own: a lander on a bed, a pendulum, a paddle, what is refused.

use crate::command::{colluvium, hash, pause, succeed, summary, table, value};
use std::path::Path;
use std::process::{Command, Stdio};

/// Grains on a floor within a tube, and a law for all.
const BED: &str = r#"
scene = "grains"
seed = 4
duration = 0.3

[output]
rows = 60
frames = 0
pictures = 1
ledger = true

[contact]
normal = "hertz"
youngs_modulus = 2.0e6
poissons_ratio = 0.3
restitution = 0.5
friction = 0.5

[grains.gravel]
density = 2500.0
sizes = { law = "uniform", smallest = 0.006, largest = 0.008 }

[surfaces.steel]
contact = { youngs_modulus = 1.0e7, friction = 0.3 }

[gravity]
uniform = [0.0, 0.0, -9.81]

[walls.floor]
shape = "plane"
axis = [0.0, 0.0, 1.0]

[walls.tube]
shape = "cylinder"
axis = [0.0, 0.0, 1.0]
radius = 0.07
"#;

const POUR: &str = r#"
[[prepare]]
do = "pour"
count = 250
within = [
    { shape = "cylinder", axis = [0.0, 0.0, 1.0], point = [0.0, 0.0, 0.0], radius = 0.062 },
    { shape = "block", lower = [-1.0, -1.0, 0.05], upper = [1.0, 1.0, 0.15] },
]
"#;

/// A cuboid with a round horn below it, of a mass that is given.
const LANDER: &str = r#"
[bodies.lander]
point = [0.0, 0.0, 0.13]
turn_degrees = [12.0, 0.0, 0.0]
velocity = [0.1, 0.0, -0.5]
spin = [0.0, 1.0, 0.0]
mass = 0.2
material = "steel"
parts = [
    { shape = "cuboid", sides = [0.05, 0.04, 0.03], rounding = 0.003 },
    { shape = "cylinder", radius = 0.006, length = 0.02, point = [0.0, 0.0, -0.02], rounding = 0.002 },
]
"#;

fn write(folder: &Path, name: &str, sections: &[&str]) {
    std::fs::write(folder.join(name), sections.concat()).unwrap();
}

/// A column of a table by name.
fn column(path: &Path, name: &str) -> Vec<f64> {
    let (header, rows) = table(path);
    let at = header.iter().position(|h| h == name).unwrap();
    rows.iter().map(|row| row[at]).collect()
}

#[test]
fn a_lander_falls_on_a_bed_with_accounts_closed_and_resumes_to_the_bit() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    write(folder.path(), "lander.toml", &[BED, LANDER, POUR]);
    let plan = succeed(folder.path(), &["plan", "lander.toml"]);
    assert!(plan.contains("lander") && plan.contains("cuboid"), "{plan}");
    succeed(folder.path(), &["run", "lander.toml", "--out", "a"]);
    let found = summary(&at("a"));
    assert!(found["ledger"]["momentum_relative"].as_f64().unwrap() < 1e-9);
    let history = at("a/history.csv");
    let errors = column(&history, "ledger_error");
    assert!(errors.iter().all(|e| e.abs() < 1e-9), "{errors:?}");
    // Free flight before the bed is met.
    let (t, z, x) = (
        column(&history, "t"),
        column(&history, "lander_z"),
        column(&history, "lander_x"),
    );
    let fz = column(&history, "lander_fz");
    let free: Vec<usize> = (1..t.len()).take_while(|&k| fz[k] == 0.0).collect();
    assert!(free.len() > 3, "{fz:?}");
    for k in free {
        let fall = z[0] - 0.5 * t[k] - 0.5 * 9.81 * t[k] * t[k];
        assert!((z[k] - fall).abs() < 1e-9, "{}", z[k] - fall);
        assert!((x[k] - x[0] - 0.1 * t[k]).abs() < 1e-9);
    }
    // It comes to lie on the bed, which bears it.
    let rest = value(&found, "lander_z");
    assert!((0.02..0.1).contains(&rest), "{rest}");
    assert!(value(&found, "lander_speed") < 0.1);
    let last: f64 = fz[fz.len() - 10..].iter().sum::<f64>() / 10.0;
    assert!((last / (0.2 * 9.81) - 1.0).abs() < 0.2, "{last}");
    let q = ["q0", "q1", "q2", "q3"].map(|q| column(&history, &format!("lander_{q}")));
    let length: f64 = q.iter().map(|q| q[30] * q[30]).sum();
    assert!((length - 1.0).abs() < 1e-12);
    let views = std::fs::read_dir(at("a")).unwrap();
    let names = views.map(|v| v.unwrap().file_name().into_string().unwrap());
    assert!(names.filter(|n| n.starts_with("view_")).count() >= 3);
    // Two threads, killed on the way: the same bits.
    let mut two = vec!["run", "lander.toml", "--out", "two"];
    two.extend(["--threads", "2", "--checkpoint-every", "0"]);
    let mut child = Command::new(env!("CARGO_BIN_EXE_colluvium"))
        .args(&two)
        .current_dir(folder.path())
        .stdout(Stdio::null())
        .spawn()
        .unwrap();
    while !at("two/checkpoint.h5").exists() && child.try_wait().unwrap().is_none() {
        pause();
    }
    child.kill().unwrap();
    child.wait().unwrap();
    two.push("--resume");
    succeed(folder.path(), &two);
    assert_eq!(hash(&at("two")), hash(&at("a")));
    assert_eq!(
        std::fs::read(at("two/history.csv")).unwrap(),
        std::fs::read(history).unwrap()
    );
}

#[test]
fn bodies_alone_swing_turn_and_stand() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    // A pendulum of a ball, a paddle that is turned, a mesh that is held, a top of a given inertia.
    let octahedron = "v 1 0 0\nv -1 0 0\nv 0 1 0\nv 0 -1 0\nv 0 0 1\nv 0 0 -1\n\
        f 1 3 5\nf 3 2 5\nf 2 4 5\nf 4 1 5\nf 3 1 6\nf 2 3 6\nf 4 2 6\nf 1 4 6\n";
    std::fs::write(at("eight.obj"), octahedron).unwrap();
    let bodies = r#"
[bodies.pendulum]
freedom = "hinged"
point = [0.2, 0.0, 0.4]
hinge = { point = [0.0, 0.0, 0.4], axis = [0.0, 1.0, 0.0] }
parts = [{ shape = "sphere", radius = 0.01, density = 2000.0 }]

[bodies.paddle]
freedom = "driven"
point = [0.0, 0.5, 0.5]
motion = { kind = "rotation", point = [0.0, 0.5, 0.5], axis = [0.0, 0.0, 1.0], rate = 2.0 }
parts = [{ shape = "cuboid", sides = [0.2, 0.01, 0.1] }]

[bodies.rock]
freedom = "held"
point = [1.0, 0.0, 1.0]
parts = [{ shape = "mesh", file = "eight.obj", unit = 0.1, rounding = 0.001 }]

[bodies.top]
point = [5.0, 0.0, 500.0]
spin = [0.3, 2.0, 0.1]
mass = 1.0
inertia = [0.01, 0.02, 0.03, 0.0, 0.0, 0.0]
parts = [{ shape = "frustum", radii = [0.1, 0.0], length = 0.2, axis = [1.0, 0.0, 0.0] }]
"#;
    let bed = BED.replace(
        "[walls.tube]\nshape = \"cylinder\"\naxis = [0.0, 0.0, 1.0]\nradius = 0.07\n",
        "",
    );
    write(folder.path(), "alone.toml", &[&bed, bodies]);
    succeed(
        folder.path(),
        &[
            "run",
            "alone.toml",
            "--out",
            "a",
            "--set",
            "timestep.seconds=1e-5",
        ],
    );
    // Without a packing there is something to resume as well.
    let mut stopped = vec!["run", "alone.toml", "--out", "b", "--checkpoint-every", "0"];
    stopped.extend(["--set", "timestep.seconds=1e-5"]);
    let mut child = Command::new(env!("CARGO_BIN_EXE_colluvium"))
        .args(&stopped)
        .current_dir(folder.path())
        .stdout(Stdio::null())
        .spawn()
        .unwrap();
    while !at("b/checkpoint.h5").exists() && child.try_wait().unwrap().is_none() {
        pause();
    }
    child.kill().unwrap();
    child.wait().unwrap();
    stopped.push("--resume");
    succeed(folder.path(), &stopped);
    assert_eq!(hash(&at("b")), hash(&at("a")));
    let history = at("a/history.csv");
    let of = |name: &str| column(&history, name);
    // The pendulum keeps its energy: 7/5 of a point's... ω²/2 (L² + 2/5 r²) = g (z_0 - z).
    let (z, w) = (of("pendulum_z"), of("pendulum_wy"));
    for (z, w) in z.iter().zip(&w) {
        let turning = 0.5 * w * w * (0.04 + 0.4 * 1e-4);
        let fallen = 9.81 * (0.4 - z);
        assert!((turning - fallen).abs() < 1e-6, "{turning} {fallen}");
    }
    assert!(z.iter().copied().fold(1.0, f64::min) < 0.21);
    // The paddle turns by 2 rad/s: half the angle is in the quaternion.
    let (t, q3) = (of("t"), of("paddle_q3"));
    for (t, q) in t.iter().zip(&q3) {
        assert!((q - t.sin()).abs() < 1e-9, "{q} {t}");
    }
    assert!(of("rock_x").iter().all(|x| (x - 1.0).abs() < 1e-12));
    // The top keeps its energy, and falls.
    let energy = |k: usize| {
        let q = nalgebra::UnitQuaternion::from_quaternion(nalgebra::Quaternion::new(
            of("top_q0")[k],
            of("top_q1")[k],
            of("top_q2")[k],
            of("top_q3")[k],
        ));
        let w = nalgebra::Vector3::new(of("top_wx")[k], of("top_wy")[k], of("top_wz")[k]);
        let own = q.inverse_transform_vector(&w);
        own.component_mul(&own)
            .dot(&nalgebra::Vector3::new(0.01, 0.02, 0.03))
    };
    let last = t.len() - 1;
    assert!((energy(last) / energy(0) - 1.0).abs() < 1e-10);
    assert!((of("top_vz")[last] + 9.81 * t[last]).abs() < 1e-9);
}

#[test]
fn a_body_that_cannot_be_is_refused_by_key_and_nothing_is_written() {
    let folder = tempfile::tempdir().unwrap();
    write(folder.path(), "lander.toml", &[BED, LANDER, POUR]);
    let open = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";
    std::fs::write(folder.path().join("open.obj"), open).unwrap();
    let cases: [(&str, &[&str]); 22] = [
        ("bodies.lander.mass=-1", &["bodies.lander.mass", "-1", "(0"]),
        (
            "bodies.lander.mas=1",
            &["bodies.lander.mas", "bodies.lander.mass"],
        ),
        ("bodies.lander.parts=[]", &["bodies.lander.parts"]),
        (
            "bodies.lander.material=\"wood\"",
            &["bodies.lander.material", "wood", "steel"],
        ),
        (
            "bodies.lander.parts=[{shape=\"cube\"}]",
            &["bodies.lander.parts[0].shape", "cuboid"],
        ),
        (
            "bodies.lander.parts=[{shape=\"cuboid\"}]",
            &["bodies.lander.parts[0].sides", "missing"],
        ),
        (
            "bodies.lander.parts=[{shape=\"cuboid\",sides=[0.1,0.1,-0.1]}]",
            &["bodies.lander.parts[0].half_sides[2]", "-0.05"],
        ),
        (
            "bodies.lander.parts=[{shape=\"cuboid\",sides=[0.1,0.1,0.1],rounding=0.2}]",
            &["bodies.lander.parts[0].rounding", "0.2"],
        ),
        (
            "bodies.lander.parts=[{shape=\"sphere\",radius=0.1,length=1}]",
            &["bodies.lander.parts[0].length", "sphere"],
        ),
        (
            "bodies.lander.parts=[{shape=\"frustum\",radii=[0.1,-0.1],length=1}]",
            &["bodies.lander.parts[0].radii[1]", "-0.1"],
        ),
        (
            "bodies.lander.parts=[{shape=\"mesh\",file=\"none.stl\"}]",
            &["bodies.lander.parts[0].file", "none.stl"],
        ),
        (
            "bodies.lander.parts=[{shape=\"mesh\",file=\"open.obj\"}]",
            &["bodies.lander.parts[0].mesh", "open"],
        ),
        (
            "bodies.lander.parts=[{shape=\"cylinder\",radius=0.1,length=1,axis=[0,0,0]}]",
            &["bodies.lander.parts[0].axis", "longer than 0"],
        ),
        (
            "bodies.lander.inertia=[1,1,5,0,0,0]",
            &["bodies.lander", "inertia"],
        ),
        (
            "bodies.lander.centre=[0,0,0]",
            &["bodies.lander.centre", "inertia"],
        ),
        (
            "bodies.lander.freedom=\"held\"",
            &["bodies.lander.velocity", "held"],
        ),
        (
            "bodies.lander.freedom=\"loose\"",
            &["bodies.lander.freedom", "hinged"],
        ),
        (
            "bodies.lander.hinge={point=[0,0,0],axis=[0,0,1]}",
            &["bodies.lander.hinge", "free"],
        ),
        (
            "bodies.lander.motion={kind=\"steady\",velocity=[0,0,1]}",
            &["bodies.lander.motion"],
        ),
        (
            "bodies.tube={parts=[{shape=\"sphere\",radius=0.1,density=1}]}",
            &["bodies.tube", "wall"],
        ),
        (
            "bodies.ball={parts=[{shape=\"sphere\",radius=0.1}]}",
            &["bodies.ball.parts[0].density", "missing"],
        ),
        (
            "bodies.ball={freedom=\"driven\",motion={kind=\"servo\",axis=[0,0,1],force=1,gain=1,speed_limit=1},parts=[{shape=\"sphere\",radius=0.1}]}",
            &["bodies.ball.motion", "servo"],
        ),
    ];
    for (set, words) in cases {
        let arguments = ["run", "lander.toml", "--out", "none", "--set", set];
        let refused = colluvium(folder.path(), &arguments);
        let message = String::from_utf8_lossy(&refused.stderr).into_owned();
        assert_eq!(refused.status.code(), Some(2), "{set}: {message}");
        let named = message.contains("lander.toml") || message.contains("--set");
        assert!(named, "{set}: {message}");
        for word in words {
            assert!(message.contains(word), "{set}: {word}: {message}");
        }
        assert!(!folder.path().join("none").exists(), "{set}");
    }
    // Whether there is room is known when the grains are in place.
    let low = ["bodies.lander.point=[0.0, 0.0, 0.03]", "duration=0.01"];
    let arguments = [
        "run",
        "lander.toml",
        "--out",
        "low",
        "--set",
        low[0],
        "--set",
        low[1],
    ];
    let refused = colluvium(folder.path(), &arguments);
    let message = String::from_utf8_lossy(&refused.stderr).into_owned();
    assert_eq!(refused.status.code(), Some(1), "{message}");
    for word in ["bodies.lander", "reaches", "grain", "point"] {
        assert!(message.contains(word), "{message}");
    }
}
