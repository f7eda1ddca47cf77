//! Cliffs of cometary material at two sizes of parcels half a decade apart, and at sizes of grains at which they stand
//! or do not (Kappel et al. 2020, §2.5, 3.2 and 4.2).
//!
//! Half an hour on a quiet core: run by `validate.sh`. The short form is `scenarios/tests/cliff.rs`.

#![allow(clippy::unwrap_used)] // a test may panic

use colluvium::report;
use colluvium::run::{RunOptions, run};
use colluvium::scene::Scene;
use std::path::Path;

/// Results of a cliff by name; not a number where there is none.
fn cliff(folder: &Path, name: &str, sets: &[&str]) -> impl Fn(&str) -> f64 + use<> {
    let own = ["output.pictures=0"];
    let sets: Vec<String> = own.iter().chain(sets).map(|s| (*s).to_owned()).collect();
    let scene = Scene::load("cliff", &sets).unwrap();
    let options = RunOptions {
        out: Some(folder.join(name)),
        threads: Some(1),
        resume: false,
        checkpoint_every: None,
    };
    let ended = run(&scene, &options).unwrap();
    let summary = report::read_summary(&ended.directory).unwrap();
    let found = move |name: &str| {
        let quantity = summary.results.get(name);
        quantity.and_then(|q| q.value).unwrap_or(f64::NAN)
    };
    println!(
        "{name}: stood {}, failure {:.0} s, impact {:.0} s, rest {:.0} s; pile {:.1} m, run-out {:.1} m, repose {:.1}°, wedge {:.1}°; \
         debris {:.2}, contacts held {:.2}, bonds {:.2}, turned {:.0}°",
        found("stood"),
        found("time_of_failure"),
        found("time_of_impact"),
        found("time_of_rest"),
        found("pile_height"),
        found("runout"),
        found("repose"),
        found("debris_slope"),
        found("debris_share"),
        found("held_contact_share"),
        found("bond_survival"),
        found("forward_turn"),
    );
    found
}

/// Parcels of one size and of a third of it: both cliffs stand, fall within minutes, and their debris ends at about the
/// same place.
#[test]
#[ignore = "minutes: run by validate.sh"]
fn parcels_half_a_decade_apart_fall_alike() {
    let folder = tempfile::tempdir().unwrap();
    let room = [
        "shape.width=11",
        "shape.behind=11",
        "standing=300",
        "duration=3000",
    ];
    let at = |factor: &str| {
        let set = format!("coarse_graining={factor}");
        cliff(folder.path(), factor, &[&room[..], &[&set]].concat())
    };
    let (coarse, fine) = (at("600"), at("190"));
    for found in [&coarse, &fine] {
        assert_eq!(found("stood"), 1.0);
        assert!((5.0..600.0).contains(&found("time_of_failure")));
        assert!(found("time_of_rest") < 3000.0);
        assert!((0.5..1.5).contains(&found("debris_share")));
    }
    let ratio = coarse("x_front") / fine("x_front");
    assert!((0.5..2.0).contains(&ratio), "{ratio}");
}

/// Grains of the paper's size for this overhang, 6 to 12 mm, do not carry the cliff: our material is weaker than theirs. Grains
/// of half that size do.
#[test]
#[ignore = "minutes: run by validate.sh"]
fn cliffs_stand_where_their_grains_are_fine_enough() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str, smallest: f64| {
        let sizes = [
            format!("material.smallest_diameter={smallest}"),
            format!("material.largest_diameter={}", 2.0 * smallest),
            // The same parcels, of more or fewer grains.
            format!("coarse_graining={}", 0.75 / smallest),
        ];
        let sizes: Vec<&str> = sizes.iter().map(String::as_str).collect();
        cliff(
            folder.path(),
            name,
            &[&sizes[..], &["duration=1500"]].concat(),
        )
    };
    let weak = at("6 to 12 mm", 6e-3);
    assert_eq!(weak("stood"), 0.0);
    assert!(weak("time_of_failure") < 600.0);
    let strong = at("3 to 6 mm", 3e-3);
    assert_eq!(strong("stood"), 1.0);
    assert!(strong("sunk_standing") < 0.3 && strong("debris_share") > 0.5);
}
