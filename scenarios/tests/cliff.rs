//! Cliffs in small.

use crate::command::{
    INSTALMENTS, SMALL_COMET_CLIFF, colluvium, hash, succeed, summary, table, value,
};
use crate::packings::{CLIFF_OF_GRAINS, COMET_CLIFF};

fn run<'a>(out: &'a str, sets: &[&'a str]) -> Vec<&'a str> {
    let mut list = vec!["run", "cliff", "--out", out];
    for set in SMALL_COMET_CLIFF.iter().chain(sets) {
        list.extend(["--set", set]);
    }
    list
}

/// The crack brings the cliff down; without it, from the same packing, it stands.
#[test]
fn cliff_falls_along_its_crack() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    COMET_CLIFF.put(folder.path());
    succeed(folder.path(), &run("c", &["output.frames=6"]));
    let found = summary(&at("c"));
    assert_eq!(found["status"], "done");
    let failure = value(&found, "time_of_failure");
    let rest = value(&found, "time_of_rest");
    // After a free fall of the height at the earliest, and within the paper's hour or so.
    assert!((10.0..900.0).contains(&failure), "{failure}");
    assert!((300.0..3600.0).contains(&rest) && rest > failure, "{rest}");
    // Most of what the crack parted lies before the foot, in a pile that ends.
    let share = value(&found, "debris_share");
    assert!((0.4..1.4).contains(&share), "{share}");
    let [height, runout, repose] = ["pile_height", "runout", "repose"].map(|n| value(&found, n));
    assert!(
        height < 25.0 && (2.0..60.0).contains(&runout),
        "{height} {runout}"
    );
    assert!((repose - (height / runout).atan().to_degrees()).abs() < 1e-9);
    assert!(value(&found, "held_contact_share") < 0.9);
    // The deposit has the section's area, whatever fell.
    let (_, deposit) = table(&at("c/deposit.csv"));
    let spacing = deposit[1][0] - deposit[0][0];
    let area: f64 = deposit.iter().map(|row| row[1] * spacing).sum();
    let (_, profiles) = table(&at("c/profiles.csv"));
    let before: f64 = profiles[..deposit.len()]
        .iter()
        .map(|row| row[2] * spacing)
        .sum();
    assert!((area / before - 1.0).abs() < 1e-9, "{area} {before}");
    let (header, _) = table(&at("c/boulders.csv"));
    assert_eq!(header[..4], ["grains", "bonds", "mass", "diameter"]);
    let report = std::fs::read_to_string(at("c/report.html")).unwrap();
    assert!(report.contains("Profiles through time") && report.contains("The fall"));
    // Beside what the paper says of a cliff of 30 m, which is not how high its pile is, and that it stands of coarser grains only.
    let beside = |name: &str| found["results"][name]["reference"].as_f64();
    let said = [
        "stood",
        "time_of_impact",
        "time_of_rest",
        "smallest_diameter",
        "pile_height",
    ];
    assert_eq!(
        said.map(beside),
        [None, Some(600.0), Some(3600.0), Some(6e-3), None]
    );
    // Negative control, from the same packing: no crack.
    let whole = ["crack.depth_scaled=0", "duration=700", "output.frames=0"];
    succeed(folder.path(), &run("w", &whole));
    let stands = summary(&at("w"));
    assert_eq!(value(&stands, "stood"), 1.0);
    assert!(stands["results"]["time_of_failure"]["value"].is_null());
    assert!(value(&stands, "debris_share") < 0.8);
}

/// Debris that becomes a continuum: the same fall up to then, no volume or momentum lost, and an end where its grains end.
/// Without friction it runs away.
#[test]
fn debris_runs_out_as_a_continuum() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    COMET_CLIFF.put(folder.path());
    CLIFF_OF_GRAINS.put(folder.path());
    // Its wedge stands: with the slope of the scene, as a whole, it stays grains, and the run is theirs.
    let whole = ["model=hybrid", "runout.least_share=1", "output.frames=0"];
    succeed(folder.path(), &run("g", &whole));
    assert_eq!(hash(&at("g")), hash(&at("c")));
    assert!(summary(&at("g"))["results"]["time_of_handover"].is_null());
    let standing = "runout.steepest_degrees=90";
    succeed(
        folder.path(),
        &run("h", &["model=hybrid", standing, "output.frames=10"]),
    );
    let slippery = [
        "model=hybrid",
        standing,
        "runout.mu_s=0.01",
        "runout.mu_2=0.01",
        "runout.cohesion=0",
        "output.frames=0",
    ];
    succeed(folder.path(), &run("s", &slippery));
    let [grains, joined, control] = ["c", "h", "s"].map(|name| summary(&at(name)));
    for name in ["x_front", "pile_height", "debris_slope", "time_of_rest"] {
        println!(
            "{name}: {:?}",
            [&grains, &joined, &control].map(|s| s["results"][name]["value"].as_f64())
        );
    }
    for name in ["time_of_failure", "sunk_standing", "loosened_grains"] {
        assert_eq!(value(&grains, name), value(&joined, name), "{name}");
    }
    for name in ["handed_volume_error", "handed_momentum_error"] {
        let error = value(&joined, name);
        assert!(error.abs() < 1e-12, "{name} {error}");
    }
    let drift = joined["ledger"]["mass_relative"].as_f64().unwrap();
    assert!(drift.abs() < 1e-12, "{drift}");
    // The deposit has the area that the cliff had: what is held and what ran out together.
    let (_, deposit) = table(&at("h/deposit.csv"));
    let spacing = deposit[1][0] - deposit[0][0];
    let area = |rows: &[Vec<f64>], k: usize| rows.iter().map(|row| row[k] * spacing).sum::<f64>();
    let (_, profiles) = table(&at("h/profiles.csv"));
    let before = area(&profiles[..deposit.len()], 2);
    assert!((area(&deposit, 1) / before - 1.0).abs() < 1e-9);
    assert!(value(&joined, "time_of_rest") > 300.0);
    let [own, theirs, away] = [&joined, &grains, &control].map(|s| value(s, "x_front"));
    assert!((own / theirs - 1.0).abs() < 0.3, "{own} {theirs}");
    assert!(away > 1.5 * theirs, "{away} {theirs}");
    assert!(at("h/continuum.vtkhdf").exists() && at("h/animation.gif").exists());
    let saved = joined["cost"]["grain_steps"].as_f64().unwrap();
    assert!(saved < grains["cost"]["grain_steps"].as_f64().unwrap());
}

/// What lies becomes a continuum while what stands goes on as grains beside it: books close, cost falls, it ends where grains do.
#[test]
fn what_lies_changes_hands_before_what_stands() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    COMET_CLIFF.put(folder.path());
    CLIFF_OF_GRAINS.put(folder.path());
    let sets = [INSTALMENTS, &["output.frames=0"]].concat();
    succeed(folder.path(), &run("i", &sets));
    let [grains, found] = ["c", "i"].map(|name| summary(&at(name)));
    println!("{}", found["results"]);
    let of = |name: &str| value(&found, name);
    assert!(of("instalments") >= 2.0);
    for name in [
        "handed_volume_error",
        "handed_momentum_error",
        "exchange_error",
    ] {
        assert!(of(name).abs() < 1e-12, "{name} {}", of(name));
    }
    assert!(found["ledger"]["mass_relative"].as_f64().unwrap().abs() < 1e-12);
    let (header, rows) = table(&at("i/instalments.csv"));
    assert_eq!(header[..2], ["t", "grains"]);
    assert_eq!(rows.len() as f64, of("instalments"));
    assert!(
        of("deepest_in_continuum") < 0.5,
        "{}",
        of("deepest_in_continuum")
    );
    assert!(of("grain_step_share") < 0.8);
    let saved = found["cost"]["grain_steps"].as_f64().unwrap();
    assert!(saved < grains["cost"]["grain_steps"].as_f64().unwrap());
    let (_, deposit) = table(&at("i/deposit.csv"));
    let spacing = deposit[1][0] - deposit[0][0];
    let area = |rows: &[Vec<f64>], k: usize| rows.iter().map(|row| row[k] * spacing).sum::<f64>();
    let (_, profiles) = table(&at("i/profiles.csv"));
    let before = area(&profiles[..deposit.len()], 2);
    assert!((area(&deposit, 1) / before - 1.0).abs() < 1e-9);
    let [own, theirs] = [&found, &grains].map(|s| value(s, "x_front"));
    assert!((own / theirs - 1.0).abs() < 0.05, "{own} {theirs}");
}

#[test]
fn bad_cliffs_are_refused_by_key() {
    let folder = tempfile::tempdir().unwrap();
    for (set, key, allowed) in [
        ("runout.mu_2=0.1", "runout.mu_2", "at least mu_s"),
        ("runout.friction=0.4", "runout.friction", "coulomb"),
        ("runout.contact=coulomb", "runout.friction", "coulomb"),
        ("runout.kinetic_share=0", "runout.kinetic_share", "(0, 1]"),
        (
            "runout.steepest_degrees=91",
            "runout.steepest_degrees",
            "(0, 90]",
        ),
        ("runout.least_share=0", "runout.least_share", "(0, 1]"),
        (
            "runout.sinking_diameters=0.6",
            "runout.sinking_diameters",
            "0.5",
        ),
        ("coarse_graining=400", "coarse_graining", "at most 333.333"),
        ("shape.wall=30", "shape.wall", "below the height"),
        ("shape.overhang_degrees=61", "shape.overhang_degrees", "60"),
        ("contact.cohesion=none", "contact.cohesion", "dmt"),
        ("crack.depth_scaled=1.5", "crack.depth_scaled", "1"),
    ] {
        let refused = colluvium(folder.path(), &["run", "cliff", "--out", "x", "--set", set]);
        let message = String::from_utf8_lossy(&refused.stderr).into_owned();
        assert_eq!(refused.status.code(), Some(2), "{set}: {message}");
        assert!(
            message.contains(key) && message.contains(allowed),
            "{set}: {message}"
        );
        assert!(!folder.path().join("x").exists());
    }
}
