//! Fields that pull, in scenes of one's own.

use super::boundaries::{BASE, BOX};
use super::{grains, run, write};
use crate::command::{hash, summary, value};
use std::f64::consts::{PI, TAU};

#[test]
fn gravity_comes_from_a_file_or_a_schedule_alike() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    std::fs::write(
        at.join("tilt.csv"),
        "t,gx,gy,gz\n0,0,0,-2\n0.1,0,0,-2\n0.2,1.2,0,-1.6\n",
    )
    .unwrap();
    let cloud = &BOX[BOX.find("[[prepare]]").unwrap()..];
    let by_file = "\n[gravity]\nfile = \"tilt.csv\"\n\n";
    let by_rows = "\n[gravity]\nschedule = [[0.0, 0.0, 0.0, -2.0], [0.1, 0.0, 0.0, -2.0], [0.2, 1.2, 0.0, -1.6]]\n\n";
    write(at, "file.toml", &[BASE, by_file, cloud]);
    write(at, "rows.toml", &[BASE, by_rows, cloud]);
    let seen = run(at, "file.toml", "a", &[]);
    run(at, "rows.toml", "b", &[]);
    assert_eq!(hash(&at.join("a")), hash(&at.join("b")));
    // ∫ g dt: level until 0.1 s, tilted by 37 degrees from 0.2 s on.
    for (k, &t) in seen.of("t").iter().enumerate() {
        let (ramp, after) = ((t - 0.1).clamp(0.0, 0.1), (t - 0.2).max(0.0));
        let share = ramp * ramp / 0.2 + after;
        assert!((seen.of("vx")[k] - 1.2 * share).abs() < 1e-3, "{t}");
        assert!(
            (seen.of("vz")[k] + 2.0 * t - 0.4 * share).abs() < 1e-3,
            "{t}"
        );
    }
}

/// Two balls that circle each other, and one about a heavy point.
#[test]
fn orbits_close_in_a_scene() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    let ball = |x: f64, v: f64| {
        format!(
            "\n[[prepare]]\ndo = \"put\"\npoints = [[{x}, 0.0, 0.0]]\nvelocity = [0.0, {v}, 0.0]\n"
        )
    };
    let base = BASE.replace(
        "law = \"uniform\", smallest = 0.045, largest = 0.055",
        "law = \"equal\", radius = 0.05",
    );
    let mass = 1000.0 * 4.0 / 3.0 * PI * 0.05f64.powi(3);
    // Apart by 1 m, G such that a turn takes 1 s: ω² = G 2 m/d³.
    let constant = TAU * TAU / (2.0 * mass);
    let own = format!("\n[gravity]\nown = {{ constant = {constant}, opening = 0.5 }}\n");
    let speed = 0.5 * TAU;
    write(
        at,
        "two.toml",
        &[&base, &own, &ball(-0.5, -speed), &ball(0.5, speed)],
    );
    let heavy = format!(
        "\n[gravity]\nsphere = {{ center = [0.0, 0.0, 0.0], parameter = {}, radius = 0.0 }}\n",
        TAU * TAU
    );
    write(at, "one.toml", &[&base, &heavy, &ball(1.0, TAU)]);
    let sets = ["timestep.seconds=2e-4", "duration=1.0"];
    let two = run(at, "two.toml", "a", &sets);
    let mut places = grains(&at.join("a"), ["x", "y"]);
    places.sort_by(|a, b| a[0].total_cmp(&b[0]));
    for (place, wanted) in places.iter().zip([-0.5, 0.5]) {
        assert!(
            (place[0] - wanted).abs() < 1e-5 && place[1].abs() < 1e-5,
            "{place:?}"
        );
    }
    // The centre stays.
    assert!(two.of("x").iter().all(|x| x.abs() < 1e-12));
    let one = run(at, "one.toml", "b", &sets);
    assert!((one.last("x") - 1.0).abs() < 1e-5 && one.last("y").abs() < 1e-5);
    let farthest = one.of("x").iter().copied().fold(f64::INFINITY, f64::min);
    assert!((farthest + 1.0).abs() < 1e-3, "{farthest}");
    // With a speed a tenth too high it does not close (control).
    write(at, "fast.toml", &[&base, &heavy, &ball(1.0, 1.1 * TAU)]);
    let fast = run(at, "fast.toml", "c", &sets);
    assert!((fast.last("x") - 1.0).abs() > 0.1);
}

#[test]
fn a_tree_tells_how_far_it_is_from_the_direct_sum() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    let cloud = r#"
[gravity]
own = { constant = 1.0e-3, opening = 0.8 }

[[prepare]]
do = "insert"
count = 400
within = [{ shape = "ball", point = [0.0, 0.0, 0.0], radius = 1.0 }]
"#;
    write(at, "cloud.toml", &[BASE, cloud]);
    let error = |out: &str, opening: &str| {
        let opening = format!("gravity.own.opening={opening}");
        run(at, "cloud.toml", out, &[&opening, "duration=0.01"]);
        value(&summary(&at.join(out)), "self_gravity_rms_error")
    };
    let [wide, narrow, none] =
        [("a", "0.8"), ("b", "0.3"), ("c", "0.0")].map(|(out, opening)| error(out, opening));
    assert!(
        wide < 0.1 && narrow < 0.05 * wide && none < 1e-14,
        "{wide:e} {narrow:e} {none:e}"
    );
}
