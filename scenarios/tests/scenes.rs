//! Scenes from the command line to their results.

use crate::command::{colluvium, succeed, summary, table, value};
use colluvium::scene::BUNDLED;
use std::f64::consts::PI;

#[test]
fn bagnold_meets_the_exact_profile() {
    let folder = tempfile::tempdir().unwrap();
    succeed(
        folder.path(),
        &["run", "bagnold", "--out", "b", "--set", "slope_degrees=31"],
    );
    let (header, rows) = table(&folder.path().join("b/profile.csv"));
    assert_eq!(header[..3], ["z", "u", "p"]);
    // The formula, on its own: u = (2/3)(I/d) √(φ g cos θ) [h^{3/2} − (h − z)^{3/2}].
    let (theta, h, g, d, phi) = (31.0 * PI / 180.0, 0.24_f64, 9.81, 0.01, 0.5);
    let (mu_s, mu_2, i_0): (f64, f64, f64) = (0.506, 0.815, 0.332);
    let i = i_0 * (f64::tan(theta) - mu_s) / (mu_2 - f64::tan(theta));
    let scale = 2.0 / 3.0 * i / d * (phi * g * f64::cos(theta)).sqrt();
    let (mut miss, mut size) = (0.0, 0.0);
    for row in &rows {
        let (z, u, p) = (row[0], row[1], row[2]);
        let exact = scale * (h.powf(1.5) - (h - z).powf(1.5));
        miss += (u - exact) * (u - exact);
        size += exact * exact;
        let weight = phi * 2500.0 * g * f64::cos(theta) * (h - z);
        assert!((p - weight).abs() < 1e-6 * weight, "p = {p} at {z}");
    }
    assert_eq!(rows.len(), 64);
    assert!(
        (miss / size).sqrt() < 1e-4,
        "relative L2 error {}",
        (miss / size).sqrt()
    );
    let summary = summary(&folder.path().join("b"));
    assert_eq!(summary["format"], 1);
    assert_eq!(summary["status"], "done");
    assert!((value(&summary, "inertial_number") - i).abs() < 1e-9);
    for file in ["scene.toml", "report.html", "results.h5", "log.txt"] {
        assert!(folder.path().join("b").join(file).exists(), "{file}");
    }
    assert!(!folder.path().join("b/checkpoint.h5").exists());
}

#[test]
fn bagnold_converges_at_second_order() {
    let folder = tempfile::tempdir().unwrap();
    let shown = succeed(
        folder.path(),
        &[
            "pareto",
            "bagnold",
            "--vary",
            "grid.cells=16,32,64",
            "--out",
            "p",
        ],
    );
    assert!(shown.contains("grid.cells"), "{shown}");
    let (header, rows) = table(&folder.path().join("p/pareto.csv"));
    let order = header.iter().position(|h| h == "order").unwrap();
    assert!(rows[1..].iter().all(|row| row[order] > 1.8), "{rows:?}");
}

#[test]
fn a_rheology_file_is_read_and_its_validity_flagged() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(
        folder.path().join("law.toml"),
        "mu_s = 0.4\nmu_2 = 0.8\ni_0 = 0.3\ndiameter = 0.01\nsolid_fraction = 0.55\nvalid_i = [0.05, 0.2]\n",
    )
    .unwrap();
    let run = |slope: &str, out: &str| {
        let set = format!("slope_degrees={slope}");
        let law = "rheology.file=law.toml";
        succeed(
            folder.path(),
            &["run", "bagnold", "--set", law, "--set", &set, "--out", out],
        );
        summary(&folder.path().join(out))["remarks"].to_string()
    };
    assert!(!run("26", "inside").contains("Outside"));
    let remarks = run("35", "outside");
    assert!(remarks.contains("Outside the calibration"), "{remarks}");
    let report = std::fs::read_to_string(folder.path().join("outside/report.html")).unwrap();
    assert!(report.contains("Outside the calibration"));
    // The resolved scene stands alone.
    std::fs::remove_file(folder.path().join("law.toml")).unwrap();
    succeed(
        folder.path(),
        &["run", "inside/scene.toml", "--out", "again"],
    );
    let hash = |out: &str| summary(&folder.path().join(out))["state_hash"].clone();
    assert_eq!(hash("again"), hash("inside"));
}

#[test]
fn other_numbers_over_a_rheology_file_drop_what_it_says_of_its_own() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(
        folder.path().join("law.toml"),
        "mu_s = 0.4\nmu_2 = 0.8\ni_0 = 0.3\ndiameter = 0.01\nsolid_fraction = 0.55\n\
         valid_i = [0.05, 0.2]\nidentified = false\ngood = false\n",
    )
    .unwrap();
    std::fs::write(
        folder.path().join("own.toml"),
        "scene = \"bagnold\"\nslope_degrees = 26.0\nrheology.file = \"law.toml\"\n",
    )
    .unwrap();
    succeed(folder.path(), &["run", "own.toml", "--out", "a"]);
    let remarks = summary(&folder.path().join("a"))["remarks"].to_string();
    assert!(remarks.contains("Not identified"), "{remarks}");
    let set = [
        "run",
        "own.toml",
        "--set",
        "rheology.mu_s=0.45",
        "--out",
        "b",
    ];
    succeed(folder.path(), &set);
    let resolved = std::fs::read_to_string(folder.path().join("b/scene.toml")).unwrap();
    for key in ["source", "valid_i", "identified", "good"] {
        assert!(!resolved.contains(key), "{resolved}");
    }
}

/// Each law of the layer runs and meets its exact profile; the resolved scene holds what the law
/// reads and nothing else, and a rheology file feeds the law that the scene names.
#[test]
fn layer_takes_every_law_of_friction() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(
        folder.path().join("law.toml"),
        "mu_s = 0.4\nmu_2 = 0.8\ni_0 = 0.3\ndiameter = 0.01\nsolid_fraction = 0.5\n\
         table = [[0.0, 0.4], [0.1, 0.5], [0.5, 0.65], [1.0, 0.7]]\n",
    )
    .unwrap();
    let cases: [(&str, &[&str], &[&str]); 4] = [
        (
            "a",
            &["rheology.law=barker-gray"],
            &["alpha", "mu_infinity"],
        ),
        (
            "b",
            &[
                "rheology.law=coulomb",
                "rheology.mu_s=0.3",
                "rheology.viscosity=5",
            ],
            &["mu_s", "viscosity"],
        ),
        (
            "c",
            &["rheology.file=law.toml", "rheology.law=table"],
            &["table"],
        ),
        ("d", &["rheology.file=law.toml"], &["mu_s", "mu_2", "i_0"]),
    ];
    for (out, settings, keys) in cases {
        let mut arguments = vec!["run", "bagnold", "--out", out];
        for setting in settings {
            arguments.extend(["--set", setting]);
        }
        succeed(folder.path(), &arguments);
        let error = &summary(&folder.path().join(out))["results"]["velocity_error_l2"]["value"];
        assert!(error.as_f64().unwrap() < 2e-4, "{settings:?}: {error}");
        let scene = std::fs::read_to_string(folder.path().join(out).join("scene.toml")).unwrap();
        for key in ["mu_s", "mu_2", "alpha", "mu_infinity", "viscosity", "table"] {
            let is_there = scene.contains(&format!("\n{key} = "));
            let is_read = keys.contains(&key) || (out == "a" && key.starts_with("mu_"));
            assert_eq!(is_there, is_read, "{out} {key}\n{scene}");
        }
    }
}

#[test]
fn a_fast_rolling_spring_shortens_the_step() {
    let folder = tempfile::tempdir().unwrap();
    let plan = succeed(folder.path(), &["plan", "incline-moderate"]);
    assert!(plan.contains("s: contact time: 1/30 of "), "{plan}");
    let sets = [
        "contact.rolling.beta=5",
        "grains.spread=0.5",
        "timestep.steps_per_contact=10",
    ];
    let mut arguments = vec!["plan", "incline-moderate"];
    for set in sets {
        arguments.extend(["--set", set]);
    }
    let plan = succeed(folder.path(), &arguments);
    assert!(plan.contains("s: rolling dashpot: 0.300 of "), "{plan}");
    assert!(plan.contains("30 % of the stability limit"), "{plan}");
}

#[test]
fn a_safety_factor_changes_the_step_and_is_said() {
    let folder = tempfile::tempdir().unwrap();
    let model = |safety: &str| {
        let set = format!("safety={safety}");
        let arguments = ["run", "two-spheres", "--set", &set, "--out", "a"];
        succeed(folder.path(), &arguments);
        let model = summary(&folder.path().join("a"))["model"].clone();
        let limit = model["dt_limit"].as_str().unwrap().to_owned();
        (model["dt_s"].as_f64().unwrap(), limit)
    };
    let (step, limit) = model("1");
    assert!(limit.starts_with("contact time: 1/2000 of "), "{limit}");
    for (safety, factor) in [("0.5", 0.5), ("4", 4.0)] {
        let (scaled, said) = model(safety);
        assert_eq!(scaled, factor * step);
        assert_eq!(said, format!("safety factor {safety} on {limit}"));
    }
}

#[test]
fn under_gravity_no_balance_of_angular_momentum_is_reported() {
    let folder = tempfile::tempdir().unwrap();
    for (gravity, reported) in [("0", true), ("9.81", false)] {
        let set = format!("gravity={gravity}");
        succeed(
            folder.path(),
            &["run", "two-spheres", "--set", &set, "--out", "a"],
        );
        let ledger = summary(&folder.path().join("a"))["ledger"].clone();
        assert_eq!(ledger["angular_momentum_relative"].is_number(), reported);
    }
}

#[test]
fn a_comparison_without_a_value_says_so() {
    let folder = tempfile::tempdir().unwrap();
    let vary = "impact_degrees=0,90";
    let shown = succeed(
        folder.path(),
        &["pareto", "two-spheres", "--vary", vary, "--out", "p"],
    );
    assert!(shown.contains("none") && !shown.contains("NaN"), "{shown}");
    let summary = summary(&folder.path().join("p"));
    assert_eq!(summary["status"], "done");
    assert!(
        summary["remarks"]
            .to_string()
            .contains("No error at impact_degrees = 90")
    );
}

#[test]
fn impacts_recover_restitution_and_contact_time() {
    let folder = tempfile::tempdir().unwrap();
    for (scene, bodies) in [("two-spheres", 2), ("sphere-on-plane", 1)] {
        for (restitution, angle) in [("0.2", "0"), ("0.5", "0"), ("0.9", "35"), ("1", "70")] {
            let e = format!("restitution={restitution}");
            let a = format!("impact_degrees={angle}");
            let e_t = "tangential_restitution=1";
            succeed(
                folder.path(),
                &[
                    "run", scene, "--out", "i", "--set", &e, "--set", &a, "--set", e_t,
                ],
            );
            let summary = summary(&folder.path().join("i"));
            let wanted: f64 = restitution.parse().unwrap();
            let found = value(&summary, "restitution");
            // In an oblique impact the line of centres turns while they touch, by v_t τ/(2 R).
            let allowed = if angle == "0" { 1e-3 } else { 1e-2 };
            assert!(
                (found - wanted).abs() < allowed,
                "{scene} {restitution} {angle}: {found}"
            );
            let mass = 2500.0 * 4.0 / 3.0 * PI * 0.005_f64.powi(3);
            let reduced = mass / f64::from(bodies);
            let time = (reduced * (PI * PI + wanted.ln().powi(2)) / 2.6e5).sqrt();
            assert!((value(&summary, "contact_time") / time - 1.0).abs() < 2.0 * allowed);
            let before = value(&summary, "energy_before");
            assert!(value(&summary, "energy_after") <= before * (1.0 + 1e-6));
            assert!(summary["ledger"]["momentum_relative"].as_f64().unwrap() < 1e-12);
            let (header, rows) = table(&folder.path().join("i/trajectory.csv"));
            assert_eq!(
                header[..10],
                [
                    "t", "x1", "y1", "z1", "vx1", "vy1", "vz1", "wx1", "wy1", "wz1"
                ]
            );
            assert_eq!(header.len(), 1 + 9 * bodies as usize);
            assert!(rows.len() >= 1000);
        }
    }
}

#[test]
fn every_bundled_scene_can_be_listed_shown_checked_and_planned() {
    let folder = tempfile::tempdir().unwrap();
    let list = succeed(folder.path(), &["scenes"]);
    for line in list.lines() {
        let name = line.split_whitespace().next().unwrap();
        let text = succeed(folder.path(), &["scenes", "show", name]);
        std::fs::write(folder.path().join("own.toml"), text).unwrap();
        succeed(folder.path(), &["check", "own.toml"]);
        let plan = succeed(folder.path(), &["plan", name]);
        for topic in ["left out", "time step"] {
            assert!(plan.contains(topic), "{name}: {plan}");
        }
    }
    assert_eq!(list.lines().count(), BUNDLED.len());
}

#[test]
fn the_schema_is_json_and_knows_every_scene() {
    let folder = tempfile::tempdir().unwrap();
    let text = succeed(folder.path(), &["schema"]);
    let schema: serde_json::Value = serde_json::from_str(&text).unwrap();
    assert_eq!(schema["oneOf"].as_array().unwrap().len(), BUNDLED.len());
    // Every reference leads somewhere.
    for part in text.split("\"$ref\": \"#").skip(1) {
        let pointer = part.split('"').next().unwrap();
        assert!(schema.pointer(pointer).is_some(), "{pointer}");
    }
}

#[test]
fn several_runs_make_one_report() {
    let folder = tempfile::tempdir().unwrap();
    succeed(folder.path(), &["run", "two-spheres", "--out", "a"]);
    succeed(
        folder.path(),
        &["run", "bagnold", "--set", "grid.cells=8", "--out", "b"],
    );
    succeed(folder.path(), &["report", "a", "b", "--out", "both.html"]);
    let page = std::fs::read_to_string(folder.path().join("both.html")).unwrap();
    assert!(page.contains("Run of two-spheres") && page.contains("Run of bagnold"));
    // Self-contained: nothing is fetched.
    assert!(!page.contains("src=") && !page.contains("<link"));
    assert_eq!(
        colluvium(folder.path(), &["report", "a", "nowhere"])
            .status
            .code(),
        Some(2)
    );
}
