//! Which folders a run may be written into.

use crate::command::colluvium;
use std::fs;

#[test]
fn a_run_of_ours_may_be_replaced_and_nothing_else() {
    let folder = tempfile::tempdir().unwrap();
    let run = |out: &str| {
        colluvium(
            folder.path(),
            &["run", "bagnold", "--set", "grid.cells=8", "--out", out],
        )
    };
    assert!(run("a/b").status.success());
    fs::write(folder.path().join("a/b/notes.md"), "mine").unwrap();
    // A table or a series of another kind of run would pass for one of the new run.
    let foreign = ["front.csv", "continuum.vtkhdf", "fields_species_1.csv"];
    for name in foreign {
        fs::write(folder.path().join("a/b").join(name), "old").unwrap();
    }
    assert!(run("a/b").status.success());
    assert!(folder.path().join("a/b/notes.md").exists());
    for name in foreign {
        assert!(!folder.path().join("a/b").join(name).exists(), "{name}");
    }
    assert_eq!(run("a").status.code(), Some(2));
}

#[test]
fn a_run_that_the_new_one_reads_from_is_not_replaced() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    let small = ["run", "bagnold", "--set", "grid.cells=8", "--out", "a"];
    assert!(colluvium(folder.path(), &small).status.success());
    fs::write(
        at("a/rheology.toml"),
        "mu_s = 0.4\nmu_2 = 0.8\ni_0 = 0.3\ndiameter = 0.01\nsolid_fraction = 0.5\n",
    )
    .unwrap();
    for arguments in [
        vec!["run", "a/scene.toml", "--out", "a"],
        vec![
            "run",
            "bagnold",
            "--set",
            "rheology.file=a/rheology.toml",
            "--out",
            "a",
        ],
    ] {
        let done = colluvium(folder.path(), &arguments);
        let message = String::from_utf8_lossy(&done.stderr);
        assert_eq!(done.status.code(), Some(2), "{message}");
        assert!(message.contains("read from"), "{message}");
        assert!(at("a/rheology.toml").exists() && at("a/report.html").exists());
    }
}

#[test]
fn bad_input_does_not_cost_an_earlier_run() {
    let folder = tempfile::tempdir().unwrap();
    let run = |more: &[&str]| {
        let mut list = vec!["run", "two-spheres", "--out", "a"];
        list.extend(more);
        colluvium(folder.path(), &list)
    };
    assert!(run(&[]).status.success());
    let page = fs::read(folder.path().join("a/report.html")).unwrap();
    assert_eq!(
        run(&["--set", "speed=1e-9", "--set", "gap=1"])
            .status
            .code(),
        Some(2)
    );
    assert_eq!(fs::read(folder.path().join("a/report.html")).unwrap(), page);
    // Resuming says that it is done; another command's directory is refused.
    let again = run(&["--resume"]);
    assert!(again.status.success());
    assert!(String::from_utf8_lossy(&again.stdout).contains("already done"));
    let other = colluvium(
        folder.path(),
        &["calibrate", "incline-moderate", "--out", "a", "--resume"],
    );
    assert_eq!(other.status.code(), Some(2));
    assert!(String::from_utf8_lossy(&other.stderr).contains("`run`, not by `calibrate`"));
}
