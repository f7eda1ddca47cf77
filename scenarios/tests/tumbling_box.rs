//! A lander on a bed: accounts, restarts, what is refused.

use crate::command::{colluvium, succeed, summary, value};

/// A thin bed, met early, under a stronger pull: a short run.
const SHORT: [&str; 12] = [
    "--set",
    "bed.depth=0.08",
    "--set",
    "bed.pour_gravity=1.0",
    "--set",
    "gravity=0.05",
    "--set",
    "lander.height=0.005",
    "--set",
    "duration=0.6",
    "--set",
    "output.pictures=0",
];

#[test]
fn a_lander_touches_sinks_in_and_loses_energy_with_its_accounts_closed() {
    let folder = tempfile::tempdir().unwrap();
    let run = |out: &'static str| [&["run", "tumbling-box", "--out", out], &SHORT[..]].concat();
    succeed(folder.path(), &run("one"));
    let found = summary(&folder.path().join("one"));
    assert_eq!(found["status"], "done");
    let momentum = found["ledger"]["momentum_relative"].as_f64().unwrap();
    assert!(momentum < 1e-9, "{momentum:e}");
    let depth = value(&found, "penetration");
    assert!(depth > -0.02 && depth < 0.08, "{depth}");
    assert!(value(&found, "energy_ratio") < 1.0);
    assert!(value(&found, "largest_overlap") < 0.5);
    let history = std::fs::read_to_string(folder.path().join("one/history.csv")).unwrap();
    assert!(history.lines().next().unwrap().contains("lander_wz"));
    succeed(
        folder.path(),
        &[&run("two")[..], &["--threads", "2"]].concat(),
    );
    let again = summary(&folder.path().join("two"));
    assert_eq!(again["state_hash"], found["state_hash"]);
}

#[test]
fn a_lander_that_cannot_be_is_refused_by_key() {
    let folder = tempfile::tempdir().unwrap();
    for (set, word) in [
        ("lander.rounding=0.02", "lander.bump"),
        ("lander.sides=[0.29, 2.0, 0.2]", "lander.sides"),
        ("lander.speed=-1", "lander.speed"),
        ("scale=3", "scale"),
    ] {
        let refused = colluvium(folder.path(), &["check", "tumbling-box", "--set", set]);
        let message = String::from_utf8_lossy(&refused.stderr).into_owned();
        assert_eq!(refused.status.code(), Some(2), "{message}");
        assert!(message.contains(word), "{set}: {message}");
    }
}
