//! The flows between plates and in a vertical chute, from the command line to their exact solutions.

use crate::command::{colluvium, succeed, summary, table, value};

/// Columns z, u, p of a run's profile.
fn profile(folder: &std::path::Path) -> [Vec<f64>; 3] {
    let (header, rows) = table(&folder.join("profile.csv"));
    assert_eq!(header[..3], ["z", "u", "p"]);
    [0, 1, 2].map(|k| rows.iter().map(|row| row[k]).collect())
}

#[test]
fn plates_shear_material_at_one_rate() {
    let folder = tempfile::tempdir().unwrap();
    succeed(folder.path(), &["run", "plane-shear", "--out", "s"]);
    let run = folder.path().join("s");
    let [z, u, p] = profile(&run);
    assert_eq!(z.len(), 32);
    for ((z, u), p) in z.iter().zip(&u).zip(&p) {
        assert!((u - 2.0 * z / 0.04).abs() < 1e-7, "{u} m/s at {z}");
        assert!((p - 1000.0).abs() < 1e-5, "{p} Pa at {z}");
    }
    // I = (U/H) d √(ρ_s/P) and τ = μ(I) P.
    let i = 2.0 / 0.04 * 0.002 * (2500.0_f64 / 1000.0).sqrt();
    let tau = 1000.0 * (0.382 + (0.643 - 0.382) * i / (0.279 + i));
    let summary = summary(&run);
    assert!((value(&summary, "inertial_number") - i).abs() < 1e-12);
    assert!((value(&summary, "wall_shear_stress") / tau - 1.0).abs() < 1e-7);
    assert!(summary["ledger"]["momentum_relative"].as_f64().unwrap() < 1e-7);
}

/// u(y) by the rule of midpoints from γ̇ = (I_0/d) √(P/ρ_s) (m − μ_s)/(μ_2 − m), m = ρ g y/P.
fn chute_velocity(y: f64) -> f64 {
    let (w, load, weight) = (0.02, 560.0, 0.6 * 2500.0 * 9.81);
    let rate = |y: f64| {
        let m: f64 = weight * y / load;
        let excess = (m - 0.382).max(0.0);
        0.279 / 0.002 * (load / 2500.0_f64).sqrt() * excess / (0.643 - m)
    };
    let parts = 20_000;
    let width = (w - y) / f64::from(parts);
    let at = |k: i32| y + (f64::from(k) + 0.5) * width;
    (0..parts).map(|k| width * rate(at(k))).sum()
}

#[test]
fn a_vertical_chute_has_its_plug_and_its_profile() {
    let folder = tempfile::tempdir().unwrap();
    succeed(folder.path(), &["run", "vertical-chute", "--out", "c"]);
    let run = folder.path().join("c");
    let [y, u, p] = profile(&run);
    assert_eq!(y.len(), 64);
    let exact: Vec<f64> = y.iter().map(|&y| chute_velocity(y)).collect();
    let miss: f64 = u.iter().zip(&exact).map(|(u, e)| (u - e) * (u - e)).sum();
    let size: f64 = exact.iter().map(|e| e * e).sum();
    let error = (miss / size).sqrt();
    println!("relative error of u {error:.2e}, {} cells", y.len());
    assert!(error < 2e-3, "{error}");
    assert!(p.iter().all(|p| (p - 560.0).abs() < 1e-4));
    // The plug moves as one, and what lies outside does not.
    let plug = 0.382 * 560.0 / (0.6 * 2500.0 * 9.81);
    let apart = |inside: bool| {
        let pairs = y.iter().zip(&u);
        let chosen = pairs.filter(|(y, _)| (**y < plug - 0.001) == inside);
        let speeds: Vec<f64> = chosen.map(|(_, u)| *u).collect();
        let fastest = speeds.iter().copied().fold(f64::MIN, f64::max);
        fastest - speeds.iter().copied().fold(f64::MAX, f64::min)
    };
    assert!(apart(true) < 1e-3 * u[0], "{}", apart(true));
    assert!(apart(false) > 0.9 * u[0], "{}", apart(false));
    let summary = summary(&run);
    assert!((value(&summary, "plug_half_width") - plug).abs() < 1e-12);
    let weight = 0.6 * 2500.0 * 9.81 * 0.02;
    assert!((value(&summary, "wall_shear_stress") / weight - 1.0).abs() < 1e-7);
    // A law with another μ_s has another plug, which this profile does not have.
    succeed(
        folder.path(),
        &[
            "run",
            "vertical-chute",
            "--set",
            "rheology.mu_s=0.3",
            "--out",
            "other",
        ],
    );
    let [_, other, _] = profile(&folder.path().join("other"));
    assert!((other[0] / exact[0] - 1.0).abs() > 0.2);
}

#[test]
fn a_chute_converges_at_second_order() {
    let folder = tempfile::tempdir().unwrap();
    succeed(
        folder.path(),
        &[
            "pareto",
            "vertical-chute",
            "--vary",
            "grid.cells=16,32,64",
            "--out",
            "p",
        ],
    );
    let (header, rows) = table(&folder.path().join("p/pareto.csv"));
    let column = header.iter().position(|name| name == "error").unwrap();
    let errors: Vec<f64> = rows.iter().map(|row| row[column]).collect();
    println!("{errors:?}");
    assert!(
        errors[1] / errors[2] > 3.4 && errors[0] / errors[2] > 12.0,
        "{errors:?}"
    );
}

#[test]
fn what_has_no_steady_or_no_definite_flow_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    for (scene, set, parts) in [
        (
            "vertical-chute",
            &["load=400"][..],
            ["load", "400", "greater than"],
        ),
        (
            "vertical-chute",
            &["gravity=0"],
            ["gravity", "0", "0, 1000"],
        ),
        (
            "plane-shear",
            &["rheology.law=coulomb"],
            ["rheology.viscosity", "not determined", "strain rate"],
        ),
        (
            "plane-shear",
            &["rheology.mu_2=0.382"],
            ["rheology.mu_2", "not determined", "0.382"],
        ),
        // I = 0.158 lies beyond the table, where friction is constant.
        (
            "plane-shear",
            &[
                "rheology.law=table",
                "rheology.table=[[0.001,0.38],[0.1,0.5]]",
            ],
            ["rheology.table", "not determined", "0.5"],
        ),
        (
            "plane-shear",
            &["wall_velocity=-1"],
            ["wall_velocity", "-1", "0, 100000"],
        ),
        (
            "plane-shear",
            &["grid.columns=2"],
            ["grid.columns", "2", "3 to 256"],
        ),
        (
            "plane-shear",
            &["slope_degrees=3"],
            ["slope_degrees", "wall_velocity", ""],
        ),
    ] {
        let mut arguments = vec!["run", scene, "--out", "bad"];
        for setting in set {
            arguments.extend(["--set", setting]);
        }
        let output = colluvium(folder.path(), &arguments);
        let message = String::from_utf8_lossy(&output.stderr).into_owned();
        assert_eq!(output.status.code(), Some(2), "{message}");
        for part in parts {
            assert!(message.contains(part), "{set:?}: {message}");
        }
        println!("{message}");
        assert!(!folder.path().join("bad").exists());
    }
    // With a viscosity Coulomb's friction has a definite flow.
    let viscous = [
        "run",
        "plane-shear",
        "--set",
        "rheology.law=coulomb",
        "--set",
        "rheology.viscosity=2",
    ];
    succeed(
        folder.path(),
        &[&viscous[..], &["--out", "viscous"]].concat(),
    );
    let summary = summary(&folder.path().join("viscous"));
    assert!((value(&summary, "wall_shear_stress") / (382.0 + 2.0 * 50.0) - 1.0).abs() < 1e-7);
}
