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

/// Every scene that a recipe runs or calibrates is a good one with the keys it sets.
#[test]
fn recipes_are_good_scenes() {
    let text = include_str!("../RECIPES.md").replace("\\\n", " ");
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
        for pair in options.windows(2).filter(|pair| pair[0] == "--set") {
            arguments.extend(pair.iter().map(String::as_str));
        }
        succeed(folder.path(), &arguments);
        checked += 1;
    }
    assert!(checked > 25, "{checked}");
}
