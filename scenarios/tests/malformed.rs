//! Broken scenes, start files, rheologies and run directories: no panic, status 2, a message that names
//! file and key, nothing written.

use crate::command::{colluvium, succeed};
use colluvium::failure::{BAD_INPUT, Failure};
use colluvium::scene::{self, Scene};
use colluvium::{run, start_file};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use std::fs;
use std::path::Path;

/// Values that few keys take.
const ODD: [&str; 18] = [
    "nan",
    "inf",
    "-inf",
    "-1",
    "-1.5",
    "0",
    "1e308",
    "-1e308",
    "5e-324",
    "9223372036854775807",
    "true",
    "\"\"",
    "\"text\"",
    "[]",
    "[1, [2, \"x\"]]",
    "{ a = 1 }",
    "1979-05-27",
    "\"\\u0000\"",
];

/// Reads and checks a scene file as every command does first.
fn check(path: &Path) -> Result<(), Failure> {
    let scene = Scene::load(&path.display().to_string(), &[])?;
    run::check(&scene)
}

/// Dotted paths of all keys of a table that hold values.
fn keys(table: &toml::Table, path: &str, found: &mut Vec<String>) {
    for (key, value) in table {
        let dotted = if path.is_empty() {
            key.clone()
        } else {
            format!("{path}.{key}")
        };
        match value {
            toml::Value::Table(inner) => keys(inner, &dotted, found),
            _ => found.push(dotted),
        }
    }
}

/// Keys of `upper` laid over those of `lower`.
fn laid_over(lower: &toml::Table, upper: toml::Table) -> toml::Table {
    let mut all = lower.clone();
    for (key, value) in upper {
        let value = match (all.get(&key), value) {
            (Some(toml::Value::Table(below)), toml::Value::Table(above)) => {
                laid_over(below, above).into()
            }
            (_, value) => value,
        };
        all.insert(key, value);
    }
    all
}

/// Keys that the bundled scene does not give, but the kind reads.
const FURTHER: [(&str, &[&str]); 6] = [
    (
        "bagnold",
        &[
            "rheology.file",
            "rheology.valid_i",
            "rheology.source",
            "rheology.good",
        ],
    ),
    (
        "chute",
        &[
            "start",
            "duration",
            "contact.beta",
            "contact.rolling",
            "contact.surface_energy",
        ],
    ),
    (
        "settle",
        &[
            "start",
            "duration",
            "contact.cohesion",
            "contact.tangential",
            "contact.memory",
        ],
    ),
    (
        "two-spheres",
        &[
            "contact.normal",
            "contact.youngs_modulus",
            "rolling.beta",
            "rolling",
        ],
    ),
    (
        "incline",
        &[
            "overlap.cell_diameters",
            "overlap.inner_diameters",
            "overlap.buffer_diameters",
            "overlap.shell_diameters",
            "overlap.kernel_diameters",
            "overlap.stress_time",
            "overlap.exchange_time",
            "overlap.load_time",
            "overlap.impedance",
            "overlap.normal_motion",
            "rheology.mu_s",
            "rheology.solid_fraction",
        ],
    ),
    (
        "incline-glass",
        &[
            "contact.rolling.beta",
            "contact.rolling",
            "contact.stiffness",
        ],
    ),
];

#[test]
fn odd_values_of_every_key_of_every_scene_are_refused_by_name_or_taken() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("odd.toml");
    for (name, text) in scene::BUNDLED {
        let table: toml::Table = text.parse().unwrap();
        let mut all = Vec::new();
        keys(&table, "", &mut all);
        all.retain(|key| key != "scene");
        let further = FURTHER.iter().find(|(kind, _)| *kind == name);
        all.extend(
            further
                .iter()
                .flat_map(|(_, keys)| keys.iter().map(|k| k.to_string())),
        );
        all.extend(["nonsense", "contact.nonsense", "\"\"", "scene.x"].map(String::from));
        let (mut refused, mut taken) = (0, Vec::new());
        for key in &all {
            for odd in ODD {
                let own = format!("scene = \"{name}\"\n{key} = {odd}\n");
                // Such a scene stands for itself: the odd value among all others, if it can be read.
                let text = match own.parse() {
                    Ok(over) if name == "grains" => laid_over(&table, over).to_string(),
                    _ => own,
                };
                fs::write(&path, text).unwrap();
                match check(&path) {
                    Ok(()) => taken.push(format!("{key} = {odd}")),
                    Err(failure) => {
                        let message = failure.to_string();
                        assert_eq!(failure.exit_status(), BAD_INPUT, "{message}");
                        // Limits of several keys together name one of them, laws their section, and a
                        // number that vanishes in the arithmetic is refused for what it makes.
                        let mut parts = key.split('.');
                        let named = parts.any(|part| message.contains(part));
                        assert!(
                            message.contains("key `")
                                || message.contains("odd.toml") && (named || odd == "5e-324"),
                            "{name}: {key} = {odd}: {message}"
                        );
                        assert!(message.len() < 1000, "{message}");
                        refused += 1;
                    }
                }
            }
        }
        println!(
            "{name}: {} keys, {refused} refused, {} taken",
            all.len(),
            taken.len()
        );
        // Nothing that is no number is taken for one.
        let strange = taken
            .iter()
            .filter(|t| t.contains("nan") || t.contains("1979") || t.contains("{ a"));
        assert_eq!(strange.count(), 0, "{name}: {taken:?}");
        assert!(refused > 10 * all.len(), "{name}: {taken:?}");
    }
}

/// Breaks bytes somewhere: cuts them off, flips bits, drops, doubles or replaces a word.
fn broken(bytes: &[u8], random: &mut ChaCha8Rng) -> Vec<u8> {
    let mut bytes = bytes.to_vec();
    let at = random.random_range(0..bytes.len());
    let end = (at + random.random_range(1..12)).min(bytes.len());
    match random.random_range(0..6) {
        0 => bytes.truncate(at),
        1 => bytes[at] ^= 1 << random.random_range(0..8),
        2 => bytes[at..end].fill(0xff),
        3 => drop(bytes.drain(at..end)),
        4 => {
            let copy = bytes[at..end].to_vec();
            drop(bytes.splice(at..at, copy));
        }
        _ => {
            let odd = ODD[random.random_range(0..ODD.len())];
            drop(bytes.splice(at..end, odd.bytes()));
        }
    }
    bytes
}

#[test]
fn scenes_with_broken_bytes_are_refused_or_taken() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("broken.toml");
    let mut random = ChaCha8Rng::seed_from_u64(21);
    let mut refused = 0;
    for (name, text) in scene::BUNDLED {
        // Comments only dilute what is tried.
        let bare: Vec<&str> = text
            .lines()
            .filter(|line| !line.starts_with('#'))
            .map(|line| line.split(" #").next().unwrap_or(line).trim_end())
            .collect();
        let bare = bare.join("\n");
        for _ in 0..60 {
            fs::write(&path, broken(bare.as_bytes(), &mut random)).unwrap();
            if let Err(failure) = check(&path) {
                let message = failure.to_string();
                assert_eq!(failure.exit_status(), BAD_INPUT, "{message}");
                assert!(message.contains("broken.toml"), "{name}: {message}");
                refused += 1;
            }
        }
    }
    println!("{refused} of {} refused", 60 * scene::BUNDLED.len());
    assert!(refused > 30 * scene::BUNDLED.len(), "{refused}");
}

/// Texts that no scene is, and what the message must say besides the file's name.
fn hopeless() -> Vec<(&'static str, Vec<u8>, &'static str)> {
    let deep = |open: &str, inner: &str, close: &str| {
        let n = 100_000;
        let text = format!(
            "scene = \"settle\"\nseed = {}{inner}{}\n",
            open.repeat(n),
            close.repeat(n)
        );
        text.into_bytes()
    };
    let dotted = format!("scene = \"settle\"\n{}a = 1\n", "a.".repeat(100_000));
    vec![
        ("empty.toml", Vec::new(), "scene"),
        (
            "latin.toml",
            b"scene = \"settle\"\n# \xe9t\xe9\n".to_vec(),
            "UTF-8",
        ),
        ("binary.toml", (0..=255).collect(), ""),
        (
            "twice.toml",
            b"scene = \"settle\"\nseed = 1\nseed = 2\n".to_vec(),
            "line 3",
        ),
        ("kinds.toml", b"scene = [\"settle\"]\n".to_vec(), "scene"),
        (
            "table.toml",
            b"[scene]\nname = \"settle\"\n".to_vec(),
            "scene",
        ),
        ("arrays.toml", deep("[", "", "]"), ""),
        ("tables.toml", deep("{ a = ", "1", " }"), ""),
        ("dotted.toml", dotted.into_bytes(), ""),
        (
            "huge.toml",
            b"scene = \"settle\"\nseed = 1e999999999\n".to_vec(),
            "line 2",
        ),
        (
            "long.toml",
            format!("scene = \"settle\"\n{} = 1\n", "k".repeat(1 << 20)).into(),
            "unknown key",
        ),
    ]
}

/// Runs a command that must end as bad input and write nothing; gives its message.
fn refused(folder: &Path, arguments: &[&str]) -> String {
    let listing = || {
        let entries = fs::read_dir(folder).unwrap().flatten();
        let mut names: Vec<_> = entries.map(|e| e.file_name()).collect();
        names.sort();
        names
    };
    let before = listing();
    let done = colluvium(folder, arguments);
    let message = String::from_utf8_lossy(&done.stderr).into_owned();
    assert_eq!(
        done.status.code(),
        Some(2),
        "{arguments:?}: {message:.2000}"
    );
    assert!(!message.contains("panicked"), "{message}");
    assert_eq!(listing(), before, "{arguments:?} left something behind");
    message
}

#[test]
fn texts_that_are_no_scene_end_with_status_2() {
    let folder = tempfile::tempdir().unwrap();
    for (file, bytes, wanted) in hopeless() {
        fs::write(folder.path().join(file), bytes).unwrap();
        let message = refused(folder.path(), &["run", file, "--out", "out"]);
        assert!(
            message.contains(file) && message.contains(wanted),
            "{message:.500}"
        );
    }
    fs::create_dir(folder.path().join("folder.toml")).unwrap();
    let message = refused(folder.path(), &["run", "folder.toml", "--out", "out"]);
    assert!(message.contains("folder.toml"), "{message}");
}

#[test]
fn broken_start_files_are_refused_with_their_name_or_read() {
    let mut text = String::from("type,radius,density,x,y,z,vx,vy,vz,omegax,omegay,omegaz\n");
    for k in 0..20 {
        let (x, y) = (f64::from(k % 5) + 0.5, f64::from(k / 5) + 0.5);
        text.push_str(&format!("{},0.5,1.9,{x},{y},0,0,0,0,0,0,0\n", 1 + k % 2));
    }
    let mut random = ChaCha8Rng::seed_from_u64(22);
    let mut gz = flate2::write::GzEncoder::new(Vec::new(), flate2::Compression::fast());
    std::io::Write::write_all(&mut gz, text.as_bytes()).unwrap();
    for (file, sample) in [
        ("a.csv", text.into_bytes()),
        ("a.csv.gz", gz.finish().unwrap()),
    ] {
        let mut count = 0;
        for _ in 0..300 {
            if let Err(error) = start_file::parse(file, &broken(&sample, &mut random)) {
                assert!(error.to_string().contains(file), "{error}");
                count += 1;
            }
        }
        println!("{file}: {count} of 300 refused");
        assert!(count > 80, "{file}: {count}");
    }
}

#[test]
fn odd_numbers_in_a_start_file_are_bad_input() {
    let folder = tempfile::tempdir().unwrap();
    let good = ["0.5", "1.9", "2", "2", "2", "0", "0", "0"];
    let names = ["radius", "density", "x", "y", "z", "vx", "vy", "vz"];
    let mut count = 0;
    for (k, name) in names.iter().enumerate() {
        for odd in ["nan", "inf", "-inf", "1e308", "-1e308", "-3", "x", ""] {
            let mut row = good;
            row[k] = odd;
            let csv = format!("{}\n{}\n", names.join(","), row.join(","));
            fs::write(folder.path().join("odd.csv"), csv).unwrap();
            let start = folder.path().join("odd.csv").display().to_string();
            let path = folder.path().join("scene.toml");
            fs::write(
                &path,
                format!("scene = \"chute\"\nstart = \"{start}\"\nlength = 6\nwidth = 6\n"),
            )
            .unwrap();
            match check(&path) {
                // A grain may fly backwards, or lie below zero.
                Ok(()) => assert!(
                    odd == "-3" && (name.starts_with('v') || *name == "z"),
                    "{name} {odd}"
                ),
                Err(failure) => {
                    let message = failure.to_string();
                    assert_eq!(failure.exit_status(), BAD_INPUT, "{message}");
                    // Heavy grains make the scene's step too short, large ones its box too narrow.
                    let named = ["odd.csv", "key `timestep`", "key `length`"]
                        .iter()
                        .any(|part| message.contains(part));
                    assert!(named, "{name} = {odd}: {message}");
                    count += 1;
                }
            }
        }
    }
    assert_eq!(count, 8 * 8 - 4);
}

#[test]
fn odd_rheologies_are_bad_input() {
    let folder = tempfile::tempdir().unwrap();
    let good = [
        ("mu_s", "0.4"),
        ("mu_2", "0.8"),
        ("i_0", "0.3"),
        ("diameter", "0.01"),
        ("solid_fraction", "0.5"),
        ("grain_density", "2500.0"),
        ("valid_i", "[0.01, 1.0]"),
    ];
    let law = folder.path().join("law.toml");
    let path = folder.path().join("scene.toml");
    fs::write(
        &path,
        format!(
            "scene = \"bagnold\"\nrheology.file = \"{}\"\nslope_degrees = 25\n",
            law.display()
        ),
    )
    .unwrap();
    let write = |changed: Option<(usize, &str)>| {
        let lines = good
            .iter()
            .enumerate()
            .map(|(k, (key, value))| match changed {
                Some((at, odd)) if at == k => format!("{key} = {odd}\n"),
                _ => format!("{key} = {value}\n"),
            });
        fs::write(&law, lines.collect::<String>()).unwrap();
    };
    write(None);
    check(&path).unwrap();
    let mut taken = Vec::new();
    for (k, (key, _)) in good.iter().enumerate() {
        for odd in ODD {
            write(Some((k, odd)));
            match check(&path) {
                Ok(()) => taken.push(format!("{key} = {odd}")),
                Err(failure) => {
                    let message = failure.to_string();
                    assert_eq!(failure.exit_status(), BAD_INPUT, "{message}");
                    assert!(
                        message.contains("law.toml") && message.contains(key),
                        "{key} = {odd}: {message}"
                    );
                }
            }
        }
    }
    // The smallest number of all is above zero; what comes of it is the run's business.
    taken.retain(|t| !t.ends_with("5e-324"));
    assert_eq!(taken, ["mu_s = 0"]);
}

#[test]
fn damaged_run_directories_are_refused_and_not_touched() {
    let folder = tempfile::tempdir().unwrap();
    let a = folder.path().join("a");
    let run = [
        "run",
        "settle",
        "--set",
        "scale=0.2",
        "--set",
        "steps=100",
        "--out",
        "a",
    ];
    let resume = [&run[..], &["--resume"]].concat();
    succeed(folder.path(), &run);
    // As a killed run leaves it.
    let text = fs::read_to_string(a.join("summary.json")).unwrap();
    let text = text.replace("\"done\"", "\"running\"");
    let sound = fs::read(a.join("scene.toml")).unwrap();
    let mut random = ChaCha8Rng::seed_from_u64(23);
    let all = || {
        let entries = fs::read_dir(&a).unwrap().flatten();
        let mut files: Vec<_> = entries
            .map(|e| (e.file_name(), fs::read(e.path()).unwrap()))
            .collect();
        files.retain(|(name, _)| name != "log.txt" && name != "run.lock");
        files.sort();
        files
    };
    for k in 0..30 {
        fs::write(a.join("summary.json"), &text).unwrap();
        fs::write(a.join("scene.toml"), &sound).unwrap();
        let what = ["summary.json", "scene.toml", "checkpoint.h5"][k % 3];
        match k % 3 {
            0 => fs::write(
                a.join(what),
                &text[..random.random_range(0..text.len() / 2)],
            )
            .unwrap(),
            1 => {
                let cut = random.random_range(0..sound.len() / 2);
                fs::write(a.join(what), [&sound[..cut], b"\nx = = 3\n"].concat()).unwrap();
            }
            _ => {
                let length = random.random_range(0..5000);
                let noise: Vec<u8> = (0..length).map(|_| random.random()).collect();
                fs::write(a.join(what), noise).unwrap();
            }
        }
        let before = all();
        let message = refused(folder.path(), &resume);
        assert!(message.contains(what), "{what}: {message}");
        assert_eq!(all(), before);
        let _ = fs::remove_file(a.join("checkpoint.h5"));
    }
}
