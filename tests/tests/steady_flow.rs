//! Flows that the calibrated laws have not seen, long enough to be steady, beside what the laws say of them.

use colluvium::rheology_file::RheologyFile;
use colluvium::run::{RunOptions, run};
use colluvium::scene::Scene;
use colluvium_coupling::calibration::mu_of_i;
use std::path::Path;

/// A layer of the bulk: I, |τ|/p, |τ|/σ_zz, φ.
type Layer = [f64; 4];

/// Settled for 300 √(d/g) and averaged over 200, at a slope between those of the fit.
fn flow(scene: &str, slope: f64, start: f64, set: &[&str]) -> Vec<Layer> {
    let folder = tempfile::tempdir().unwrap();
    let own = [
        format!("slope_degrees={slope}"),
        format!("start_inertial_number={start}"),
        "time.relax=9.58".to_owned(),
        "time.average=6.38".to_owned(),
        "time.limit=15.97".to_owned(),
    ];
    let set: Vec<String> = set.iter().map(|s| (*s).to_owned()).chain(own).collect();
    let out = folder.path().join("flow");
    let options = RunOptions {
        out: Some(out.clone()),
        threads: Some(1),
        ..RunOptions::default()
    };
    run(&Scene::load(scene, &set).unwrap(), &options).unwrap();
    let summary = std::fs::read_to_string(out.join("summary.json")).unwrap();
    assert!(summary.contains("the flow is steady"), "{summary}");
    let text = std::fs::read_to_string(out.join("points.csv")).unwrap();
    let mut lines = text.lines();
    let names: Vec<&str> = lines.next().unwrap().split(',').collect();
    let column = |name| names.iter().position(|n| *n == name).unwrap();
    let columns = ["i", "mu", "mu_zz", "phi"].map(column);
    lines
        .map(|line| {
            let values: Vec<f64> = line.split(',').map(|v| v.parse().unwrap()).collect();
            columns.map(|c| values[c])
        })
        .collect()
}

/// Standard error of μ(I) by the covariance of the law's parameters.
fn error(law: &RheologyFile, i: f64) -> f64 {
    let share = i / (i + law.i_0);
    let lever = [
        1.0 - share,
        share,
        -(law.mu_2 - law.mu_s) * i / (i + law.i_0).powi(2),
    ];
    let covariance = law.covariance.unwrap();
    let terms = (0..3).flat_map(|a| (0..3).map(move |b| (a, b)));
    let variance: f64 = terms
        .map(|(a, b)| lever[a] * covariance[a][b] * lever[b])
        .sum();
    variance.sqrt()
}

/// What flows scatter by about the law, in μ, and layers about φ(I): as the campaigns found, rounded up.
const FLOWS: f64 = 0.003;

fn stands_by_its_law(layers: &[Layer], law: &RheologyFile, slope: f64) {
    let mean =
        |of: &dyn Fn(&Layer) -> f64| layers.iter().map(of).sum::<f64>() / layers.len() as f64;
    let i = mean(&|l| l[0]);
    let [low, high] = law.valid_i.unwrap();
    assert!(low < i && i < high, "{i}");
    let miss = |more: f64| mean(&|l| l[1] - more * mu_of_i(law.mu_s, law.mu_2, law.i_0, l[0]));
    let band = error(law, i).hypot(FLOWS);
    let phi = law.solid_fraction_of_i.unwrap();
    let phi_miss = mean(&|l| l[3] - (phi.intercept - phi.slope * l[0]));
    let tangent = mean(&|l| l[2]) / slope.to_radians().tan() - 1.0;
    println!(
        "{} layers, I {i:.4}: μ less the law {:+.4} (band {band:.4}), φ less φ(I) {phi_miss:+.4} (layers scatter by {:.4}), \
         |τ|/σ_zz over tan θ {tangent:+.4}",
        layers.len(),
        miss(1.0),
        phi.rms_residual
    );
    assert!(miss(1.0).abs() < 2.0 * band, "{}", miss(1.0));
    assert!(phi_miss.abs() < phi.rms_residual, "{phi_miss}");
    assert!(tangent.abs() < 0.01, "{tangent}");
    // A law of 2 % more friction is not that of these grains.
    assert!(miss(1.02).abs() > 2.0 * band, "{}", miss(1.02));
}

#[test]
#[ignore = "minutes"]
fn a_steady_flow_of_moderate_friction_stands_by_its_law() {
    let law = RheologyFile::read(Path::new("moderate")).unwrap();
    stands_by_its_law(&flow("incline-moderate", 32.5, 0.35, &[]), &law, 32.5);
}

#[test]
#[ignore = "minutes"]
fn a_steady_flow_of_glass_stands_by_its_law() {
    let law = RheologyFile::read(Path::new("glass")).unwrap();
    // The quarter of the floor that the law was measured on.
    let floor = [
        "grains.count=1500",
        "floor.length_diameters=10",
        "floor.width_diameters=5",
    ];
    stands_by_its_law(&flow("incline-glass", 25.0, 0.17, &floor), &law, 25.0);
}
