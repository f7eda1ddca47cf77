//! Cliffs of cometary material at two sizes of parcels half a decade apart, and at sizes of grains at which they stand
//! or do not (Kappel et al. 2020, §2.5, 3.2 and 4.2).
//!
//! Half an hour on a quiet core: run by `validate.sh`. The short form is `scenarios/tests/cliff.rs`.

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
        ..RunOptions::default()
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

/// Parcels of one size, in five packings, and of a third of it: all cliffs fail within minutes and rest within the hour, and
/// the fine one ends among the coarse ones. Those differ by more than a factor of two among themselves: some of 250 parcels
/// do not wait for the crack, and a wedge that slides down stands or tips over.
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
    let at = |name: &str, own: [&str; 2]| cliff(folder.path(), name, &[&room[..], &own].concat());
    let seeds = ["seed=1", "seed=2", "seed=3", "seed=4", "seed=5"];
    let coarse = seeds.map(|seed| at(seed, ["coarse_graining=600", seed]));
    let fine = at("fine", ["coarse_graining=190", "seed=1"]);
    for found in coarse.iter().chain([&fine]) {
        assert!((5.0..600.0).contains(&found("time_of_failure")));
        assert!(found("time_of_rest") < 3000.0);
        assert!((0.25..1.5).contains(&found("debris_share")));
    }
    assert_eq!([coarse[0]("stood"), fine("stood")], [1.0; 2]);
    for name in ["x_front", "time_of_impact", "debris_slope"] {
        let all = coarse.each_ref().map(|found| found(name));
        let [low, high] = all
            .iter()
            .fold([f64::INFINITY, 0.0_f64], |[a, b], &v| [a.min(v), b.max(v)]);
        let found = fine(name);
        assert!(
            (0.8 * low..1.2 * high).contains(&found),
            "{name}: {found}, {low} to {high}"
        );
    }
}

/// Debris that becomes a continuum ends where its grains do, for cliffs that its cohesion was not chosen by; without
/// cohesion their standing wedge runs out.
#[test]
#[ignore = "minutes: run by validate.sh"]
fn debris_of_finer_parcels_ends_where_its_grains_do() {
    let folder = tempfile::tempdir().unwrap();
    let room = [
        "shape.width=11",
        "shape.behind=11",
        "standing=300",
        "duration=3000",
        "coarse_graining=250",
    ];
    let made = folder.path().join("grains/packing.h5");
    let stored = format!("packing={}", made.display());
    let grains = cliff(folder.path(), "grains", &room);
    let hybrid = [&room[..], &["model=hybrid", &stored]].concat();
    let joined = cliff(folder.path(), "joined", &hybrid);
    let loose = cliff(
        folder.path(),
        "loose",
        &[&hybrid[..], &["runout.cohesion=0"]].concat(),
    );
    let [own, theirs, control] = [&joined, &grains, &loose].map(|found| found("x_front"));
    println!("front: joined {own:.2} m, grains {theirs:.2} m, without cohesion {control:.2} m");
    assert!((own / theirs - 1.0).abs() < 0.2, "{own} {theirs}");
    assert!(control > 1.2 * theirs, "{control} {theirs}");
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

/// What a crack cuts off stands on its foot like a triangle on a corner (Kappel et al. 2020, §3.2): a crack as steep as the
/// overhang tips it forward, one that leans back farther lets it slide down along the cliff.
#[test]
#[ignore = "minutes: run by validate.sh"]
fn a_crack_that_leans_back_farther_than_the_overhang_tips_nothing_forward() {
    let folder = tempfile::tempdir().unwrap();
    let [as_steep, flatter] = [("steep", "crack.degrees=10"), ("flat", "crack.degrees=20")]
        .map(|(name, crack)| cliff(folder.path(), name, &[crack]));
    for found in [&as_steep, &flatter] {
        assert_eq!(found("stood"), 1.0);
        assert!(found("time_of_failure") < 600.0 && found("time_of_rest") < 3600.0);
    }
    let [forward, back] = [&as_steep, &flatter].map(|found| found("forward_turn"));
    assert!(forward > 30.0 && back < 10.0, "{forward} {back}");
}
