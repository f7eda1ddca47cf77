//! Scenes of cometary material in small: the tensile test and the boulder drop.

use crate::command::{colluvium, succeed, summary, table, value};
use serde_json::Value;
use std::path::Path;

fn run<'a>(scene: &'a str, out: &'a str, sets: &[&'a str]) -> Vec<&'a str> {
    let mut list = vec!["run", scene, "--out", out];
    for set in sets {
        list.extend(["--set", set]);
    }
    list
}

/// Two samples of some 250 parcels each; softer grains than the paper's allow longer steps.
const SMALL: [&str; 5] = [
    "coarse_graining=6",
    "samples=2",
    "material.mix=one-to-one",
    "contact.youngs_modulus=1e7",
    "packing=mixture",
];

#[test]
fn small_samples_break_at_a_stress_of_the_papers_order() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    succeed(folder.path(), &run("tensile-test", "one", &SMALL));
    let found = summary(&at("one"));
    // Porosity 63 % within what so few parcels scatter by, a network that hangs together: 2.9 contacts a grain in
    // the bulk (Kappel et al. 2020, §4.1), fewer on the surface, where half of these parcels are.
    let solid = value(&found, "solid_fraction");
    assert!((solid / 0.3685 - 1.0).abs() < 0.12, "{solid}");
    let contacts = value(&found, "contacts_per_grain");
    assert!((2.2..3.2).contains(&contacts), "{contacts}");
    let strength = value(&found, "strength");
    let reference = found["results"]["strength"]["reference"].as_f64();
    assert_eq!(reference, Some(4.65));
    assert!((1.0..4.65).contains(&strength), "{strength}");
    assert!(value(&found, "carried_stress") <= 1.12 * strength);
    // Each sample stands for itself, the result is their mean.
    let (header, rows) = table(&at("one").join("samples.csv"));
    let column = |name: &str| header.iter().position(|n| n == name).unwrap();
    let strengths: Vec<f64> = rows.iter().map(|row| row[column("strength")]).collect();
    assert_eq!(strengths.len(), 2);
    assert!((0.5 * (strengths[0] + strengths[1]) - strength).abs() < 1e-12);
    assert!(strengths[0] != strengths[1]);
    assert!(rows.iter().all(|row| row[column("broken")] == 1.0));
    let error = found["results"]["strength"]["error"].as_f64().unwrap();
    assert!((error - 0.5 * (strengths[0] - strengths[1]).abs()).abs() < 1e-12);
    // Once a sample has given way, most of the pull no longer reaches its clamp.
    let (header, rows) = table(&at("one").join("history.csv"));
    let column = |name: &str| header.iter().position(|n| n == name).unwrap();
    let last = rows.last().unwrap();
    for k in ["1", "2"] {
        let applied = last[column(&format!("applied_stress_{k}"))];
        assert!(applied > 1.5 * last[column(&format!("clamp_stress_{k}"))]);
    }
    // Momentum says what the clamp feels: the account of it is closed.
    let momentum = found["ledger"]["momentum_relative"].as_f64().unwrap();
    assert!(momentum < 1e-9, "{momentum:e}");
    // A pull that ends early leaves the same samples whole, and the scene says so.
    let weak = [&SMALL[..], &["pull.limit=0.03"]].concat();
    succeed(folder.path(), &run("tensile-test", "whole", &weak));
    let whole = summary(&at("whole"));
    let remark = whole["remarks"][0].as_str().unwrap();
    assert!(remark.contains("lower bound"), "{remark}");
    assert!(value(&whole, "strength") < strength);
}

/// One sample, softer still.
const HELD: [&str; 6] = [
    "coarse_graining=6",
    "samples=1",
    "material.mix=one-to-one",
    "contact.youngs_modulus=1e6",
    "contact.work_of_adhesion=0.056",
    "output.pictures=0",
];

#[test]
fn a_cone_that_is_a_wall_holds_its_sample_and_a_straight_tube_does_not() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    let with = |more: &[&'static str]| [&HELD[..], more].concat();
    let cone = "clamp.kind=wall";
    succeed(folder.path(), &run("tensile-test", "gripped", &with(&[])));
    succeed(folder.path(), &run("tensile-test", "wall", &with(&[cone])));
    let [gripped, wall] = ["gripped", "wall"].map(|name| summary(&at(name)));
    // The wall holds by friction and cohesion alone: nothing is glued to it.
    assert!(value(&gripped, "held_share") > 0.05);
    assert_eq!(value(&wall, "held_share"), 0.0);
    let (most, least) = (value(&gripped, "strength"), value(&wall, "strength"));
    assert!(least > 0.25 * most && least < 1.1 * most, "{least} {most}");
    let momentum = wall["ledger"]["momentum_relative"].as_f64().unwrap();
    assert!(momentum < 1e-9, "{momentum:e}");
    // What the cone bears before it lets go is what is pulled.
    let (header, rows) = table(&at("wall").join("history.csv"));
    let column = |name: &str| header.iter().position(|n| n == name).unwrap();
    let (clamp, cone) = (column("clamp_stress_1"), column("clamp_1_fz"));
    let strongest = rows
        .iter()
        .max_by(|a, b| a[clamp].total_cmp(&b[clamp]))
        .unwrap();
    let area = std::f64::consts::PI * 0.025f64.powi(2);
    let borne = -strongest[cone] / area;
    assert!((borne / least - 1.0).abs() < 0.3, "{borne} {least}");
    // The control: a tube without a slope lets it slide through, and the message says what would help.
    let straight = with(&["clamp.kind=wall", "clamp.angle_degrees=0"]);
    let done = colluvium(folder.path(), &run("tensile-test", "straight", &straight));
    let message = String::from_utf8_lossy(&done.stderr).into_owned();
    assert_eq!(done.status.code(), Some(1), "{message}");
    for word in ["clamp.kind", "slides through", "clamp.height"] {
        assert!(message.contains(word), "{message}");
    }
}

/// A boulder of some 200 parcels for a few seconds; softer grains than the paper's allow longer steps.
const BOULDER: [&str; 4] = [
    "coarse_graining=150",
    "contact.youngs_modulus=1e7",
    "impact.duration=6",
    "output.frames=0",
];

#[test]
fn small_grains_survive_the_fall_that_large_ones_do_not() {
    let folder = tempfile::tempdir().unwrap();
    let held = |name: &str, sets: &[&str]| {
        let sets = [&BOULDER[..], sets].concat();
        succeed(folder.path(), &run("boulder-drop", name, &sets));
        summary(&folder.path().join(name))
    };
    // The same parcels stand for grains of 0.1 and of 20 mm.
    let fine = held(
        "fine",
        &[
            "material.smallest_diameter=1e-4",
            "material.largest_diameter=2e-4",
            "coarse_graining=1500",
        ],
    );
    let coarse = held(
        "coarse",
        &[
            "material.smallest_diameter=1e-2",
            "material.largest_diameter=2e-2",
            "coarse_graining=15",
        ],
    );
    let largest = |found: &Value| value(found, "largest_fragment_share");
    assert!(largest(&fine) > 0.8, "{}", largest(&fine));
    assert_eq!(value(&fine, "outcome"), 2.0);
    assert!(
        largest(&coarse) < 0.5 * largest(&fine),
        "{}",
        largest(&coarse)
    );
    assert!(value(&coarse, "held_contact_share") < value(&fine, "held_contact_share"));
    let fragments = folder.path().join("coarse/fragments.csv");
    let (header, rows) = table(&fragments);
    let share = header.iter().position(|n| n == "mass_share").unwrap();
    // A single grain can be heavier than every fragment of several; the table has only those.
    let shares: Vec<f64> = rows.iter().map(|row| row[share]).collect();
    assert!(shares[0] <= largest(&coarse) && shares.is_sorted_by(|a, b| a >= b));
    assert!(shares.iter().sum::<f64>() <= 1.0 + 1e-12);
    let pictures = |out: &str| {
        let entries = std::fs::read_dir(folder.path().join(out)).unwrap();
        let names = entries.map(|e| e.unwrap().file_name().into_string().unwrap());
        names.filter(|n| n.ends_with("_groups.png")).count()
    };
    assert_eq!(pictures("coarse"), 1);
}

#[test]
fn what_cannot_be_made_is_refused_with_its_key() {
    let folder = tempfile::tempdir().unwrap();
    for (scene, set, words) in [
        (
            "tensile-test",
            "contact.cohesion=none",
            &["contact.cohesion", "dmt"][..],
        ),
        (
            "tensile-test",
            "material.bulk_density=1500",
            &["material.bulk_density", "0.6"],
        ),
        (
            "tensile-test",
            "material.largest_diameter=1e-4",
            &["material.largest_diameter"],
        ),
        (
            "tensile-test",
            "coarse_graining=20",
            &["coarse_graining", "at most 6.25"],
        ),
        (
            "tensile-test",
            "clamp.height=0.06",
            &["clamp.height", "0.05"],
        ),
        (
            "tensile-test",
            "preparation.youngs_modulus=1e9",
            &["preparation.youngs_modulus", "100000000"],
        ),
        (
            "tensile-test",
            "material.mix=mud",
            &["material.mix", "two-to-one"],
        ),
        (
            "boulder-drop",
            "sinter.materials=[\"mud\"]",
            &["sinter.materials", "dust, ice"],
        ),
        (
            "boulder-drop",
            "impact.degrees=90",
            &["impact.degrees", "90"],
        ),
        (
            "boulder-drop",
            "timestep.seconds=1",
            &["timestep", "unstable"],
        ),
    ] {
        let done = colluvium(folder.path(), &run(scene, "bad", &[set]));
        let message = String::from_utf8_lossy(&done.stderr).into_owned();
        assert_eq!(done.status.code(), Some(2), "{set}: {message}");
        for word in words {
            assert!(message.contains(word), "{set}: no `{word}` in: {message}");
        }
        assert!(!Path::new(folder.path()).join("bad").exists(), "{set}");
    }
}
