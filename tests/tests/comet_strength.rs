//! Tensile strength of cometary dust and ice against Kappel et al. (2020, §4.3): by mixture, size of grains,
//! restitution, time step, sintering, and what must not hold.
//!
//! Samples of some 400 parcels, seven across, five seeds each, softened to 10 MPa (the strength is that of
//! 100 MPa within its error, the step three times as long). Fifteen minutes on a quiet core: run by
//! `validate.sh`. The short forms are `scenarios/tests/comet.rs`.

use colluvium::report;
use colluvium::run::{RunOptions, run};
use colluvium::scene::Scene;
use std::path::Path;

const SAMPLES: &str = "samples=5";
const SOFTER: &str = "contact.youngs_modulus=1e7";
const ICY: &str = "material.mix=one-to-one";

/// What a run found: a value (Pa) and its standard error.
#[derive(Clone, Copy, Debug)]
struct Found {
    value: f64,
    error: f64,
}

/// Strength, and the largest pull that was carried.
struct Pulled {
    strength: Found,
    carried: Found,
    /// Strength of each sample (Pa).
    samples: Vec<f64>,
}

fn pulled(folder: &Path, name: &str, sets: &[&str]) -> Pulled {
    let sets = [&[SAMPLES, SOFTER], sets].concat();
    let sets: Vec<String> = sets.iter().map(|set| (*set).to_owned()).collect();
    let scene = Scene::load("tensile-test", &sets).unwrap();
    let options = RunOptions {
        out: Some(folder.join(name)),
        threads: Some(1),
        ..RunOptions::default()
    };
    let ended = run(&scene, &options).unwrap();
    let summary = report::read_summary(&ended.directory).unwrap();
    let found = |name: &str| {
        let quantity = &summary.results[name];
        Found {
            value: quantity.value.unwrap(),
            error: quantity.error.unwrap(),
        }
    };
    let rows = std::fs::read_to_string(folder.join(name).join("samples.csv")).unwrap();
    let number = |line: &str| line.split(',').nth(1)?.parse().ok();
    let (strength, carried) = (found("strength"), found("carried_stress"));
    println!(
        "{name}: {:.3} ± {:.3} Pa, carried {:.3} ± {:.3} Pa",
        strength.value, strength.error, carried.value, carried.error
    );
    Pulled {
        strength,
        carried,
        samples: rows.lines().skip(1).filter_map(number).collect(),
    }
}

/// Mean of the ratios of the samples of two runs less one, with its standard error.
fn change(new: &[f64], old: &[f64]) -> Found {
    let changes: Vec<f64> = new.iter().zip(old).map(|(a, b)| a / b - 1.0).collect();
    let n = changes.len() as f64;
    let value = changes.iter().sum::<f64>() / n;
    let spread: f64 = changes.iter().map(|c| (c - value).powi(2)).sum();
    let error = (spread / (n - 1.0) / n).sqrt();
    println!("change {:.2} ± {:.2} %", 100.0 * value, 100.0 * error);
    Found { value, error }
}

#[test]
#[ignore = "long: eighteen samples"]
fn mixtures_with_more_contacts_are_stronger_and_only_rigid_ones_carry() {
    let folder = tempfile::tempdir().unwrap();
    let of = |mix: &str| {
        let set = format!("material.mix={mix}");
        pulled(folder.path(), mix, &[&set])
    };
    let [dust, two, one] = ["dust", "two-to-one", "one-to-one"].map(of);
    // Measured: 0.65 ± 0.06, 1.51 ± 0.15, 2.41 ± 0.16 Pa where the paper has 2.25, 3.95, 4.65; finer parcels
    // (3 for 5) leave the icy one at 2.35 ± 0.02 Pa. Bands of four standard errors.
    for (found, [low, high]) in [(&dust, [0.4, 0.9]), (&two, [0.9, 2.1]), (&one, [1.8, 3.1])] {
        let value = found.strength.value;
        assert!((low..high).contains(&value), "{value} of {low} to {high}");
    }
    // Contacts resist in five of the six freedoms of a grain (twisting is free): a network of fewer than 2.4
    // contacts a grain has no rest under load. Dust has 2.15, the icy mixture 2.84.
    assert!(dust.carried.value < 0.6 * dust.strength.value);
    assert!(one.carried.value > 0.85 * one.strength.value);
    // Without resistance to rolling four contacts are needed: the icy mixture must fail as well.
    let smooth = pulled(
        folder.path(),
        "smooth",
        &[ICY, "contact.rolling_friction=0.01", "samples=3"],
    );
    assert!(smooth.strength.value < 0.5 * one.strength.value);
    assert!(smooth.carried.value < 0.2 * one.strength.value);
}

/// The paper prints F = 2π R* w with the reduced radius, half the radius of equal grains. Its strengths are those of twice this
/// force: of all three mixtures at once, and of the sintered one, whose bonds then matter less than cohesion does.
#[test]
#[ignore = "long: twenty samples"]
fn twice_the_printed_pull_off_force_gives_the_printed_strengths() {
    let folder = tempfile::tempdir().unwrap();
    let twice = "contact.work_of_adhesion=0.056";
    let of = |mix: &str| {
        let set = format!("material.mix={mix}");
        pulled(folder.path(), mix, &[&set, twice])
    };
    let [dust, two, one] = ["dust", "two-to-one", "one-to-one"].map(of);
    // Measured: 1.78 ± 0.36, 3.64 ± 0.32, 5.55 ± 0.62 Pa.
    for (found, published) in [(&dust, 2.25), (&two, 3.95), (&one, 4.65)] {
        let Found { value, error } = found.strength;
        let off = value - published;
        assert!(off.abs() < 3.0 * error, "{value} ± {error}: {published}");
        assert!(off.abs() < 0.35 * published, "{value}: {published}");
    }
    let sintered = pulled(
        folder.path(),
        "sintered",
        &[ICY, twice, "material.sintered=true"],
    );
    // Measured: +10 ± 7 %, of which one sample makes +36 %.
    let change = change(&sintered.samples, &one.samples);
    assert!(change.value.abs() < 0.25 && change.value < 0.10 + 3.0 * change.error);
}

#[test]
#[ignore = "long: fifteen samples"]
fn strength_falls_as_one_over_the_size_of_grains() {
    let folder = tempfile::tempdir().unwrap();
    // The same parcels stand for grains of three sizes.
    let of = |(small, large, factor): (&str, &str, &str)| {
        let sets = [
            ICY.to_owned(),
            format!("material.smallest_diameter={small}"),
            format!("material.largest_diameter={large}"),
            format!("coarse_graining={factor}"),
        ];
        let sets: Vec<&str> = sets.iter().map(String::as_str).collect();
        let strength = pulled(folder.path(), small, &sets).strength;
        let size: f64 = small.parse().unwrap();
        (
            size.ln(),
            strength.value.ln(),
            strength.error / strength.value,
        )
    };
    let points = [
        ("2e-4", "4e-4", "25"),
        ("5e-4", "1e-3", "10"),
        ("1e-3", "2e-3", "5"),
    ]
    .map(of);
    // Weighted straight line through the logarithms.
    let weights = points.map(|(.., error)| error.powi(-2));
    let sum = |f: &dyn Fn(usize) -> f64| (0..points.len()).map(f).sum::<f64>();
    let whole = sum(&|k| weights[k]);
    let (x, y) = (
        sum(&|k| weights[k] * points[k].0) / whole,
        sum(&|k| weights[k] * points[k].1) / whole,
    );
    let square = sum(&|k| weights[k] * (points[k].0 - x).powi(2));
    let slope = sum(&|k| weights[k] * (points[k].0 - x) * (points[k].1 - y)) / square;
    let error = square.powf(-0.5);
    println!("exponent of the size {slope:.3} ± {error:.3}");
    assert!(error < 0.12, "{error}");
    assert!((slope + 1.0).abs() < 3.0 * error, "{slope} ± {error}");
}

#[test]
#[ignore = "long: five pulls of five samples"]
fn restitution_and_step_change_less_than_the_scatter_and_sintering_little() {
    let folder = tempfile::tempdir().unwrap();
    let base = pulled(folder.path(), "base", &[ICY]).samples;
    let packing = folder.path().join("base/packing.h5");
    let same = format!("packing={}", packing.display());
    let with = |name: &str, set: &str| {
        let new = pulled(folder.path(), name, &[ICY, &same, set]).samples;
        change(&new, &base)
    };
    // Measured, by the same five samples: 0.0 ± 0.4, -5 ± 5, 0.01 ± 0.02 % (paper: each below 1 %).
    let dull = with("dull", "contact.restitution=0.1");
    assert!(dull.value.abs() < 0.02, "{dull:?}");
    let bouncy = with("bouncy", "contact.restitution=0.8");
    assert!(bouncy.value.abs() < 0.15, "{bouncy:?}");
    let fine = with("fine", "timestep.safety=0.3");
    assert!(fine.value.abs() < 0.005, "{fine:?}");
    // Measured +22 ± 11 % (paper: less than 10 %); bonds must not make it weaker.
    let sintered = with("sintered", "material.sintered=true");
    assert!(sintered.value > -2.0 * sintered.error, "{sintered:?}");
    assert!(sintered.value < 0.5, "{sintered:?}");
}
