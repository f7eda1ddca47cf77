//! Impacts and beds: sizes, laws, steps.

use super::Case;
use crate::command::colluvium;
use std::fs;

/// Arguments, and what the message has to contain.
pub const CASES: &[Case] = &[
    (
        &["run", "two-spheres", "--set", "radius=-0.5"],
        &["radius", "-0.5", "(0, 100]"],
    ),
    (
        &["run", "two-spheres", "--set", "density=0"],
        &["density", "0", "(0, 30000]"],
    ),
    (
        &["run", "sphere-on-plane", "--set", "impact_degrees=91"],
        &["impact_degrees", "91", "[0, 90]"],
    ),
    (
        &[
            "run",
            "two-spheres",
            "--set",
            "speed=1e-9",
            "--set",
            "gap=1",
        ],
        &["two-spheres", "speed", "0.000000001", "1e9 steps"],
    ),
    (
        &["run", "two-spheres", "--set", "duration=1e4"],
        &["duration", "10000", "1e9 steps"],
    ),
    (
        &["run", "two-spheres", "--set", "radius=1e-200"],
        &["radius", "heavier"],
    ),
    (
        &["run", "chute", "--set", "scale=1.5"],
        &["scale", "1.5", "whole number"],
    ),
    (
        &["run", "chute", "--set", "timestep=0.01"],
        &[
            "chute",
            "timestep",
            "0.01",
            "(0, 0.00304)",
            "unstable",
            "would do",
        ],
    ),
    (
        &["run", "chute", "--set", "steps=10", "--set", "duration=1"],
        &["steps", "duration", "exclude"],
    ),
    (
        &["run", "chute", "--set", "duration=1e7"],
        &["duration", "10000000", "1e9 steps"],
    ),
    (
        &["run", "chute", "--set", "start=nowhere.csv"],
        &["start", "nowhere.csv", "allowed"],
    ),
    (
        &["run", "chute", "--set", "coarse_graining=0.5"],
        &["coarse_graining", "0.5", "[1, 10]"],
    ),
    (
        &["run", "chute", "--set", "contact.frction=1"],
        &["contact.frction", "`contact.friction`"],
    ),
    (
        &["run", "chute", "--set", "contact.normal=hertzian"],
        &[
            "contact.normal",
            "hertzian",
            "hooke, hertz, viscoelastic, jkr",
        ],
    ),
    (
        &["run", "chute", "--set", "contact.normal=hertz"],
        &["contact.restitution", "missing", "in [0.01, 1]"],
    ),
    (
        &["run", "chute", "--set", "contact.tangential=mindlin"],
        &["chute", "contact.tangential", "mindlin", "Hertz"],
    ),
    (
        &["run", "chute", "--set", "contact.rolling=jkr"],
        &["contact.rolling", "jkr", "JKR normal law"],
    ),
    (
        &["run", "chute", "--set", "contact.dissipation=1e-5"],
        &["contact.dissipation", "not read", "hooke", "stiffness"],
    ),
    (
        &[
            "run",
            "chute",
            "--set",
            "contact.restitution=0.5",
            "--set",
            "contact.damping_rate=1",
        ],
        &["contact.restitution", "contact.damping_rate", "exclude"],
    ),
    (
        &["run", "settle", "--set", "floor.width=0.004"],
        &["floor.width", "0.004", "at least 0.0063"],
    ),
    (
        &["run", "settle", "--set", "contact.poissons_ratio=0.6"],
        &["contact.poissons_ratio", "0.6", "(-1, 0.5]"],
    ),
    (
        &["run", "settle", "--set", "contact.tangential=linear"],
        &["contact.tangential_stiffness", "missing", "N/m"],
    ),
    (
        &[
            "run",
            "settle",
            "--set",
            "grains.count=10000000",
            "--set",
            "scale=50",
        ],
        &["scale", "2e7 grains"],
    ),
    (
        &["run", "settle", "--set", "timestep=1e-3"],
        &["settle", "timestep", "0.001", "unstable", "would do"],
    ),
    (
        &[
            "run",
            "two-spheres",
            "--set",
            "steps_per_contact=10",
            "--set",
            "safety=9",
        ],
        &["two-spheres", "safety", "9", "unstable", "1.0 would do"],
    ),
    (
        &[
            "run",
            "two-spheres",
            "--set",
            "friction=0.2",
            "--set",
            "contact.friction=0.3",
        ],
        &["friction", "contact.friction", "exclude"],
    ),
    (
        &["run", "two-spheres", "--set", "contact.cohesion=dmt"],
        &["two-spheres", "contact.work_of_adhesion", "missing"],
    ),
    (
        &["pareto", "chute", "--vary", "timestep=1e-4,2e-4"],
        &["chute", "--reference"],
    ),
];

#[test]
fn a_step_that_is_said_to_do_does() {
    let folder = tempfile::tempdir().unwrap();
    for (scene, key, set) in [
        ("chute", "timestep", "scale=1"),
        ("settle", "timestep", "coarse_graining=2"),
        ("two-spheres", "safety", "steps_per_contact=10"),
    ] {
        let check = |value: &str| {
            let step = format!("{key}={value}");
            let arguments = ["check", scene, "--set", set, "--set", &step];
            colluvium(folder.path(), &arguments)
        };
        let refused = check(if key == "safety" { "9" } else { "0.01" });
        assert_eq!(refused.status.code(), Some(2), "{scene}");
        let message = String::from_utf8_lossy(&refused.stderr).into_owned();
        let number = |before: &str, after: &str| -> f64 {
            let (_, rest) = message.split_once(before).unwrap();
            let (number, _) = rest.split_once(after).unwrap();
            number.rsplit(' ').next().unwrap().parse().unwrap()
        };
        let (below, does) = (number("allowed: (0, ", ")"), number("; ", " would do"));
        assert!(does < below, "{message}");
        for (value, status) in [(does, 0), (0.99 * below, 0), (1.01 * below, 2)] {
            let done = check(&format!("{value:e}"));
            assert_eq!(done.status.code(), Some(status), "{scene} {value}");
        }
    }
    // A file of one's own is named.
    fs::write(
        folder.path().join("mine.toml"),
        "scene = \"chute\"\ntimestep = 0.01\n",
    )
    .unwrap();
    let refused = colluvium(folder.path(), &["run", "mine.toml"]);
    assert_eq!(refused.status.code(), Some(2));
    assert!(String::from_utf8_lossy(&refused.stderr).contains("mine.toml: key `timestep`"));
}
