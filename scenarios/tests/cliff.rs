//! Cliffs in small.

#![allow(clippy::unwrap_used)] // a test may panic

mod command;

use command::{colluvium, succeed, summary, table, value};

/// A cliff of some 250 parcels; softer grains than the paper's allow longer steps.
const SMALL: [&str; 9] = [
    "coarse_graining=960",
    "material.smallest_diameter=1.5e-3",
    "material.largest_diameter=3e-3",
    "shape.width=9",
    "shape.behind=9",
    "timestep.safety=1",
    "standing=300",
    "output.pictures=1",
    "packing=small",
];

fn run<'a>(out: &'a str, sets: &[&'a str]) -> Vec<&'a str> {
    let mut list = vec!["run", "cliff", "--out", out];
    for set in SMALL.iter().chain(sets) {
        list.extend(["--set", set]);
    }
    list
}

/// The crack brings the cliff down; without it, from the same packing, it stands.
#[test]
fn cliff_falls_along_its_crack() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    succeed(folder.path(), &run("c", &[]));
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
    // Negative control, from the same packing: no crack.
    let whole = ["crack.depth_scaled=0", "duration=700"];
    succeed(folder.path(), &run("w", &whole));
    let stands = summary(&at("w"));
    assert_eq!(value(&stands, "stood"), 1.0);
    assert!(stands["results"]["time_of_failure"]["value"].is_null());
    assert!(value(&stands, "debris_share") < 0.8);
}

#[test]
fn bad_cliffs_are_refused_by_key() {
    let folder = tempfile::tempdir().unwrap();
    for (set, key, allowed) in [
        ("model=hybrid", "model", "dem"),
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
