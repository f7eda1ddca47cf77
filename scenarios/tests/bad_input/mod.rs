//! Bad input: exit status 2, one message that names key, value and range, nothing written.

mod command_line;
mod continuum;
mod grains;
mod inclines;
mod replaced_runs;

use crate::command::colluvium;
use std::fs;

/// Arguments, and what the message has to contain.
type Case = (&'static [&'static str], &'static [&'static str]);

#[test]
fn bad_input_ends_with_status_2_and_leaves_nothing() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    fs::write(
        at("broken.toml"),
        "scene = \"bagnold\"\nslope_degrees = = 3\n",
    )
    .unwrap();
    fs::write(at("unknown-kind.toml"), "scene = \"landslide\"\n").unwrap();
    fs::write(at("no-kind.toml"), "slope_degrees = 3.0\n").unwrap();
    fs::write(
        at("law.toml"),
        "mu_s = 0.4\nmu_2 = 0.1\ni_0 = 0.3\ndiameter = 0.01\nsolid_fraction = 0.5\n",
    )
    .unwrap();
    fs::write(
        at("steep.toml"),
        "mu_s = 7.0\nmu_2 = 8.0\ni_0 = 0.3\ndiameter = 0.01\nsolid_fraction = 0.5\n",
    )
    .unwrap();
    // A folder of the user's own, with a scene file in it.
    fs::create_dir(at("mine")).unwrap();
    fs::write(at("mine/scene.toml"), "scene = \"bagnold\"\n").unwrap();
    fs::write(at("mine/profile.csv"), "mine").unwrap();
    fs::write(at("not.toml"), "{ \"json\": true }").unwrap();
    fs::create_dir(at("others")).unwrap();
    fs::write(at("others/diary.md"), "mine").unwrap();
    let listing = || {
        let mut names: Vec<_> = fs::read_dir(folder.path())
            .unwrap()
            .map(|e| e.unwrap().file_name())
            .collect();
        names.sort();
        names
    };
    let before = listing();
    let all = [
        inclines::CASES,
        continuum::CASES,
        grains::CASES,
        command_line::CASES,
    ];
    for (arguments, wanted) in all.into_iter().flatten() {
        let done = colluvium(folder.path(), arguments);
        let message = String::from_utf8_lossy(&done.stderr);
        assert_eq!(done.status.code(), Some(2), "{arguments:?}: {message}");
        for part in *wanted {
            assert!(
                message.contains(part),
                "{arguments:?}: `{part}` is not in: {message}"
            );
        }
        assert_eq!(listing(), before, "{arguments:?} left something behind");
    }
    assert_eq!(fs::read_dir(at("others")).unwrap().count(), 1);
    assert_eq!(fs::read_dir(at("mine")).unwrap().count(), 2);
}
