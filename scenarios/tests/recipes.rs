//! Recipes say what the program takes.

use crate::command::succeed;

/// Words of a line, as a shell splits them; quotes are single ones, and # begins a comment.
fn words(line: &str) -> Vec<String> {
    let mut words = Vec::new();
    for (n, part) in line.split('\'').enumerate() {
        if n % 2 == 1 {
            words.push(part.to_owned());
            continue;
        }
        let (part, is_last) = part
            .split_once('#')
            .map_or((part, false), |(p, _)| (p, true));
        words.extend(part.split_whitespace().map(str::to_owned));
        if is_last {
            break;
        }
    }
    words
}

/// What an option and its value set; of values that vary the first one.
fn key_and_value(pair: &[String]) -> Option<String> {
    match pair[0].as_str() {
        "--set" => Some(pair[1].clone()),
        "--vary" => pair[1].split(',').next().map(str::to_owned),
        _ => None,
    }
}

/// Every scene that a recipe or the readme runs, calibrates or varies is a good one with the keys it sets.
#[test]
fn recipes_are_good_scenes() {
    let readme = include_str!("../../README.md").replace("cargo run --release --", "colluvium");
    let text = readme + &include_str!("../RECIPES.md").replace("\\\n", " ");
    let folder = tempfile::tempdir().unwrap();
    let mut checked = 0;
    for line in text.lines() {
        let words = words(line);
        let [program, command, scene, options @ ..] = words.as_slice() else {
            continue;
        };
        let is_run = ["run", "calibrate", "pareto"].contains(&command.as_str());
        // These name files of the user's.
        let has_file = scene.ends_with(".toml") || line.contains("rheology.file");
        if program != "colluvium" || !is_run || has_file {
            continue;
        }
        let mut arguments = vec!["check", scene.as_str()];
        let sets: Vec<String> = options.windows(2).filter_map(key_and_value).collect();
        for set in &sets {
            arguments.extend(["--set", set]);
        }
        succeed(folder.path(), &arguments);
        checked += 1;
    }
    assert!(checked > 25, "{checked}");
}
