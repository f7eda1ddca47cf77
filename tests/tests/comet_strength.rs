//! Tensile strength of cometary dust and ice against Kappel et al. (2020, §4.3): by mixture, size of grains,
//! restitution, time step, sintering, size of parcels.
//!
//! Half an hour on a quiet core: run by `validate.sh`. The short forms are `scenarios/tests/comet.rs`.

#![allow(clippy::unwrap_used)] // a test may panic

use colluvium::report;
use colluvium::run::{RunOptions, run};
use colluvium::scene::Scene;
use std::path::Path;

/// Strength (Pa) of a sample; `packing` is a file that a run of the same sample has left, where there is one.
fn strength(folder: &Path, name: &str, sets: &[&str]) -> f64 {
    let sets: Vec<String> = sets.iter().map(|set| (*set).to_owned()).collect();
    let scene = Scene::load("tensile-test", &sets).unwrap();
    let options = RunOptions {
        out: Some(folder.join(name)),
        threads: Some(1),
        resume: false,
        checkpoint_every: None,
    };
    let ended = run(&scene, &options).unwrap();
    let summary = report::read_summary(&ended.directory).unwrap();
    let strength = summary.results["strength"].value.unwrap();
    println!("{name}: {strength:.4} Pa");
    strength
}

fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len() as f64
}

#[test]
#[ignore = "long: nine samples"]
fn icier_mixtures_are_stronger_and_of_the_papers_order() {
    let folder = tempfile::tempdir().unwrap();
    let of = |mix: &str| {
        let seeds = ["seed=1", "seed=2", "seed=3"];
        let mix = format!("material.mix={mix}");
        let one = |seed: &&str| strength(folder.path(), &format!("{mix}-{seed}"), &[&mix, seed]);
        mean(&seeds.iter().map(one).collect::<Vec<_>>())
    };
    let [dust, two, one] = ["dust", "two-to-one", "one-to-one"].map(of);
    // Parcels of a tenth of the sample's diameter leave it weaker than the paper's thousands.
    for (found, paper) in [(dust, 2.25), (two, 3.95), (one, 4.65)] {
        assert!((0.35..1.5).contains(&(found / paper)), "{found} {paper}");
    }
    assert!(dust < two && two < one, "{dust} {two} {one}");
}

#[test]
#[ignore = "long: three samples"]
fn strength_falls_as_one_over_the_size_of_grains() {
    let folder = tempfile::tempdir().unwrap();
    // The same parcels stand for grains of three sizes.
    let of = |(small, large, factor): (&str, &str, &str)| {
        let sets = [
            format!("material.smallest_diameter={small}"),
            format!("material.largest_diameter={large}"),
            format!("coarse_graining={factor}"),
        ];
        let sets: Vec<&str> = sets.iter().map(String::as_str).collect();
        strength(folder.path(), small, &sets) * small.parse::<f64>().unwrap()
    };
    let products = [
        ("2e-4", "4e-4", "25"),
        ("5e-4", "1e-3", "10"),
        ("1e-3", "2e-3", "5"),
    ]
    .map(of);
    let middle = mean(&products);
    for product in products {
        assert!((product / middle - 1.0).abs() < 0.25, "{products:?}");
    }
}

#[test]
#[ignore = "long: five pulls of one sample, two of another"]
fn restitution_step_and_sintering_change_little() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| {
        format!(
            "packing={}",
            folder.path().join(name).join("packing.h5").display()
        )
    };
    let base = strength(folder.path(), "base", &["coarse_graining=5"]);
    let same = at("base");
    for (name, set, most) in [
        ("bouncy", "contact.restitution=0.8", 0.05),
        ("dull", "contact.restitution=0.1", 0.02),
        ("fine", "timestep.safety=0.3", 0.03),
    ] {
        let other = strength(folder.path(), name, &["coarse_graining=5", &same, set]);
        assert!((other / base - 1.0).abs() < most, "{name}: {other} {base}");
    }
    let mix = "material.mix=one-to-one";
    let plain = strength(folder.path(), "plain", &["coarse_graining=5", mix]);
    let same = at("plain");
    let sintered = ["coarse_graining=5", mix, "material.sintered=true", &same];
    let sintered = strength(folder.path(), "sintered", &sintered);
    assert!(
        (0.95..1.25).contains(&(sintered / plain)),
        "{sintered} {plain}"
    );
}
