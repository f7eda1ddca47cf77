//! The scenes of a bed, `chute` and `settle`, and the contact laws by name.

use crate::command::{colluvium, hash, succeed, summary, table, value};
use std::path::Path;
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

/// LAMMPS 22 Jul 2025 from the same start: step, kinetic energy of translation as printed.
const LAMMPS: [(u64, &str); 5] = [
    (200, "4866.2732"),
    (600, "3721.5526"),
    (1000, "3071.9466"),
    (1400, "2620.8282"),
    (2400, "1999.0591"),
];

/// A few grains that fall for a short time, at a quarter of the floor's edges.
const SMALL: [&str; 6] = [
    "--set",
    "scale=0.25",
    "--set",
    "grains.count=3200",
    "--set",
    "duration=0.1",
];

fn run<'a>(scene: &'a str, out: &'a str, sets: &[&'a str]) -> Vec<&'a str> {
    let mut list = vec!["run", scene, "--out", out];
    for set in sets {
        list.extend(["--set", set]);
    }
    list
}

/// Interrupts a run as soon as it computes; false where it was done before that.
fn interrupt(folder: &Path, arguments: &[&str], out: &str) -> bool {
    let mut child = Command::new(env!("CARGO_BIN_EXE_colluvium"))
        .args(arguments)
        .current_dir(folder)
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .spawn()
        .unwrap();
    let begun = || {
        std::fs::read_to_string(folder.join(out).join("log.txt"))
            .is_ok_and(|log| log.contains("threads"))
    };
    let start = Instant::now();
    while !begun() && start.elapsed() < Duration::from_secs(120) {
        std::thread::sleep(Duration::from_millis(10));
    }
    let id = child.id().to_string();
    let kill = Command::new("kill").args(["-INT", &id]).status().unwrap();
    assert!(kill.success());
    child.wait().unwrap().code() == Some(130)
}

#[test]
fn the_chute_is_that_of_lammps_to_all_printed_digits() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    let mut one = run("chute", "one", &[]);
    one.extend(["--threads", "1"]);
    succeed(folder.path(), &one);
    let found = summary(&at("one"));
    for (step, printed) in LAMMPS {
        let name = format!("kinetic_energy_at_step_{step}");
        assert_eq!(format!("{:.4}", value(&found, &name)), printed, "{step}");
        let reference = found["results"][&name]["reference"].as_f64().unwrap();
        assert_eq!(format!("{reference:.4}"), printed);
    }
    let (header, rows) = table(&at("one/energy.csv"));
    assert_eq!(
        header[..5],
        ["t", "step", "translation", "rotation", "kinetic_energy"]
    );
    assert_eq!(rows.len(), 13);
    assert!(found["ledger"]["momentum_relative"].as_f64().unwrap() < 1e-10);

    // Two threads, stopped in between: the same digits, all that a number has, as long as it runs.
    let mut two = run("chute", "two", &["steps=800"]);
    two.extend(["--threads", "2"]);
    assert!(interrupt(folder.path(), &two, "two"));
    two.push("--resume");
    succeed(folder.path(), &two);
    let energy = |d: &str| std::fs::read_to_string(at(d).join("energy.csv")).unwrap();
    let (short, long) = (energy("two"), energy("one"));
    assert_eq!(short.lines().count(), 6, "{short}");
    assert!(long.starts_with(&short), "{short}\n{long}");
}

#[test]
fn a_start_file_of_ones_own_is_laid_side_by_side_and_cut_for_parcels() {
    let folder = tempfile::tempdir().unwrap();
    let mut text = String::from("type,radius,density,x,y,z,vx,vy,vz\n");
    for k in 0..36 {
        let (x, y) = (f64::from(k % 6) + 0.5, f64::from(k / 6) + 0.5);
        text.push_str(&format!("2,0.5,1.9,{x},{y},0,0,0,0\n"));
        text.push_str(&format!("1,0.5,1.9,{x},{y},1.2,0.1,0,0\n"));
    }
    std::fs::write(folder.path().join("own.csv"), text).unwrap();
    let sets = ["start=own.csv", "length=6", "width=6", "steps=50"];
    let grains = |more: &[&str], out: &str| {
        let mut all = sets.to_vec();
        all.extend(more);
        succeed(folder.path(), &run("chute", out, &all));
        let found = summary(&folder.path().join(out));
        // Figures of another start have nothing to do with LAMMPS'.
        assert!(!found["results"].to_string().contains("LAMMPS"));
        found["model"]["grains"].as_u64().unwrap()
    };
    assert_eq!(grains(&[], "a"), 72);
    assert_eq!(grains(&["scale=2"], "b"), 288);
    assert!(grains(&["coarse_graining=1.5"], "c") < 40);

    // What is wrong with a start is said with its name, and the run is not begun.
    for (name, text, wanted) in [
        (
            "far.csv",
            "radius,density,x,y,z,vx,vy,vz\n0.5,1,7,0,0,0,0,0\n",
            "outside",
        ),
        (
            "bad.csv",
            "radius,density,x,y,z,vx,vy,vz\n0.5,heavy,1,0,0,0,0,0\n",
            "line: 2",
        ),
        (
            "thin.csv",
            "radius,density,x,y,z,vx,vy,vz\n-0.5,1,1,0,0,0,0,0\n",
            "radius = -0.5",
        ),
        ("no.csv", "x,y\n1,2\n", "radius"),
    ] {
        std::fs::write(folder.path().join(name), text).unwrap();
        let start = format!("start={name}");
        let done = colluvium(
            folder.path(),
            &run("chute", "refused", &[&start, "length=6", "width=6"]),
        );
        let message = String::from_utf8_lossy(&done.stderr).into_owned();
        assert_eq!(done.status.code(), Some(2), "{message}");
        assert!(
            message.contains(name) && message.contains(wanted),
            "{message}"
        );
        assert!(!folder.path().join("refused").exists());
    }
}

#[test]
fn grains_settle_the_same_way_on_any_number_of_threads() {
    let folder = tempfile::tempdir().unwrap();
    for (threads, out) in [("1", "one"), ("2", "two")] {
        let mut arguments = vec!["run", "settle", "--out", out, "--threads", threads];
        arguments.extend(SMALL);
        succeed(folder.path(), &arguments);
    }
    let at = |name: &str| folder.path().join(name);
    assert_eq!(hash(&at("one")), hash(&at("two")));
    let found = summary(&at("one"));
    assert_eq!(found["model"]["grains"], 200);
    for name in [
        "solid_fraction",
        "coordination",
        "centre_of_mass_height",
        "kinetic_energy",
    ] {
        assert!(value(&found, name) > 0.0, "{name}");
    }
    let (header, rows) = table(&at("one/energy.csv"));
    assert_eq!(header.last().unwrap(), "contacts");
    assert_eq!(rows.last().unwrap()[1], 5000.0);
    // Fewer parcels of the same mass take fewer and longer steps.
    let mut parcels = vec![
        "run",
        "settle",
        "--out",
        "parcels",
        "--set",
        "coarse_graining=2",
    ];
    parcels.extend(SMALL);
    succeed(folder.path(), &parcels);
    let found = summary(&at("parcels"));
    assert_eq!(found["model"]["grains"], 25);
    assert_eq!(found["model"]["dt_s"], 4e-5);
}

#[test]
fn a_ledger_accounts_for_the_energy_of_a_bed_and_changes_nothing() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    let epsd = "contact.rolling=epsd contact.rolling_friction=0.2 contact.rolling_damping=0.3";
    let start = |out: &str, threads: &str, ledger: bool| {
        let set = format!("ledger={ledger}");
        let mut sets: Vec<&str> = epsd.split(' ').collect();
        sets.push(&set);
        let mut arguments = run("settle", out, &sets);
        arguments.extend(["--threads", threads]);
        arguments.extend(SMALL);
        arguments
            .iter()
            .map(|a| (*a).to_owned())
            .collect::<Vec<_>>()
    };
    let go = |arguments: &[String]| {
        let arguments: Vec<&str> = arguments.iter().map(String::as_str).collect();
        succeed(folder.path(), &arguments);
    };
    go(&start("without", "1", false));
    go(&start("one", "1", true));
    assert_eq!(hash(&at("one")), hash(&at("without")));

    let (header, rows) = table(&at("one/energy.csv"));
    let column = |name: &str| header.iter().position(|h| h == name).unwrap();
    let sum = |row: &[f64], names: &[&str]| names.iter().map(|n| row[column(n)]).sum::<f64>();
    let held = [
        "kinetic_energy",
        "normal",
        "tangential",
        "rolling",
        "twisting",
        "cohesion",
    ];
    let lost = [
        "normal_loss",
        "tangential_loss",
        "rolling_loss",
        "twisting_loss",
    ];
    let before = sum(&rows[0], &held);
    let last = rows.last().unwrap();
    let fall = |row: &[f64]| rows[0][column("height")] - row[column("height")];
    let weight = last[column("gravity_work")] / fall(last);
    for row in &rows[1..] {
        let gravity = row[column("gravity_work")];
        let now = sum(row, &held) + sum(row, &lost);
        assert!((now - before - gravity).abs() < 1e-10 * gravity, "{row:?}");
        assert!(row[column("ledger_error")] < 1e-11, "{row:?}");
        // Gravity's work is that of the centre of mass.
        assert!((gravity - weight * fall(row)).abs() < 2e-3 * gravity);
    }
    for channel in &lost[..3] {
        assert!(last[column(channel)] > 0.0, "{channel}: {last:?}");
    }
    let energy = summary(&at("one"))["ledger"]["energy"].clone();
    assert_eq!(
        energy["rolling_loss_J"].as_f64().unwrap(),
        last[column("rolling_loss")]
    );

    // Two threads, stopped in between: the same rows.
    let mut two = start("two", "2", true);
    let arguments: Vec<&str> = two.iter().map(String::as_str).collect();
    assert!(interrupt(folder.path(), &arguments, "two"));
    two.push("--resume".into());
    go(&two);
    let bytes = |d: &str| std::fs::read(at(d).join("energy.csv")).unwrap();
    assert_eq!(bytes("two"), bytes("one"));
}

#[test]
fn every_law_of_the_engine_has_a_name() {
    let folder = tempfile::tempdir().unwrap();
    let elastic = "contact.youngs_modulus=1e8 contact.poissons_ratio=0.3";
    let epsd = "contact.rolling=epsd contact.rolling_friction=0.1 contact.rolling_damping=0.3";
    let shape = "contact.rolling=shape contact.beta=0.2 contact.rolling_friction=1 contact.twisting_friction=1";
    let linear = "contact.tangential=linear contact.tangential_stiffness=1e4";
    let viscous = "contact.normal=viscoelastic contact.dissipation=1e-5";
    let hertz = "contact.normal=hertz";
    let jkr = "contact.normal=jkr contact.surface_energy=0.1 contact.damping_rate=1e3 contact.critical_rolling=1e-9";
    let laws = [
        String::new(),
        "contact.tangential=none".into(),
        "contact.damping_rate=100".into(),
        epsd.into(),
        shape.into(),
        "contact.cohesion=dmt contact.work_of_adhesion=0.1".into(),
        "contact.cohesion=scheeres contact.cleanliness=0.5 contact.asperity_radius=1e-6".into(),
        "contact.cohesion=constant contact.strength=10 contact.beta=0.3".into(),
        "contact.lever=radius".into(),
        format!("{hertz} {elastic} contact.tangential=none"),
        format!("{hertz} {elastic} {linear}"),
        format!("{hertz} {elastic} {linear} {epsd}"),
        format!("{hertz} {elastic}"),
        format!("{hertz} {elastic} contact.memory=displacement"),
        format!("{hertz} {elastic} {epsd}"),
        format!("{hertz} {elastic} {shape}"),
        format!("{viscous} {elastic} contact.tangential=none"),
        format!("{viscous} {elastic} {linear}"),
        format!("{viscous} {elastic} {linear} {epsd}"),
        format!("{viscous} {elastic}"),
        format!("{viscous} {elastic} {epsd}"),
        format!("{jkr} {elastic} contact.tangential=none contact.rolling=none"),
        format!("{jkr} {elastic} contact.rolling=none"),
        format!("{jkr} {elastic}"),
    ];
    let mut hashes = std::collections::BTreeSet::new();
    for law in &laws {
        let mut sets: Vec<&str> = law.split_whitespace().collect();
        sets.extend(["impact_degrees=30", "steps_per_contact=200", "spin=20"]);
        succeed(folder.path(), &run("two-spheres", "a", &sets));
        let before = value(&summary(&folder.path().join("a")), "energy_before");
        let after = value(&summary(&folder.path().join("a")), "energy_after");
        assert!(after <= before * (1.0 + 1e-6), "{law}: {after} {before}");
        assert!(hashes.insert(hash(&folder.path().join("a"))), "{law}");
        // The resolved scene is a scene, and means the same.
        succeed(folder.path(), &["run", "a/scene.toml", "--out", "b"]);
        assert_eq!(
            hash(&folder.path().join("a")),
            hash(&folder.path().join("b"))
        );
        let plan = run("two-spheres", "a", &sets);
        let mut plan: Vec<&str> = plan
            .into_iter()
            .filter(|a| !["--out", "a"].contains(a))
            .collect();
        plan[0] = "plan";
        let said = succeed(folder.path(), &plan);
        assert!(
            said.contains("normal ") && said.contains("left out"),
            "{said}"
        );
    }
    // Keys at the top and in the section are one.
    for (set, out) in [("friction=0.2", "top"), ("contact.friction=0.2", "section")] {
        succeed(
            folder.path(),
            &run("sphere-on-plane", out, &[set, "impact_degrees=50"]),
        );
    }
    let at = |name: &str| folder.path().join(name);
    assert_eq!(hash(&at("top")), hash(&at("section")));
}

#[test]
fn a_hertz_impact_recovers_its_restitution() {
    let folder = tempfile::tempdir().unwrap();
    for restitution in ["0.3", "0.8"] {
        let e = format!("restitution={restitution}");
        let elastic = ["contact.youngs_modulus=1e8", "contact.poissons_ratio=0.3"];
        let sets = ["contact.normal=hertz", elastic[0], elastic[1], &e];
        succeed(folder.path(), &run("sphere-on-plane", "a", &sets));
        let found = value(&summary(&folder.path().join("a")), "restitution");
        let wanted: f64 = restitution.parse().unwrap();
        assert!((found - wanted).abs() < 2e-2, "{found}");
    }
}

#[test]
fn error_against_cost_of_a_bed_is_a_table() {
    let folder = tempfile::tempdir().unwrap();
    let mut arguments = vec![
        "pareto",
        "settle",
        "--vary",
        "timestep=2e-5,4e-5",
        "--reference",
        "timestep=1e-5",
        "--out",
        "p",
    ];
    arguments.extend(SMALL);
    let shown = succeed(folder.path(), &arguments);
    for word in ["speed-up", "kinetic_energy", "coordination", "timestep"] {
        assert!(shown.contains(word), "{shown}");
    }
    let (header, rows) = table(&folder.path().join("p/pareto.csv"));
    let column = |name: &str| header.iter().position(|h| h == name).unwrap();
    assert_eq!(rows.len(), 2);
    // Half the steps each time: all runs last equally long.
    let steps = column("grain_and_cell_steps");
    assert_eq!(rows[0][steps], 2.0 * rows[1][steps]);
    for row in &rows {
        assert!(row[column("error")] >= row[column("error_solid_fraction")]);
        assert!(row[column("error_kinetic_energy")] < 0.1, "{row:?}");
    }
    let again = colluvium(
        folder.path(),
        &["pareto", "settle", "--vary", "timestep=1e-5,2e-5"],
    );
    assert_eq!(again.status.code(), Some(2));
    assert!(String::from_utf8_lossy(&again.stderr).contains("--reference"));
}
