//! Every file of tests belongs to a binary: the crates name theirs themselves (`autotests = false`), so a file that
//! neither a module nor a manifest names would never run. Nor would a test or an example where a manifest says that there is none.

use std::fs::read_to_string;
use std::path::{Path, PathBuf};

/// Rust files and folders with a `mod.rs` in a folder, without its own root.
fn modules(folder: &Path) -> Vec<(String, PathBuf)> {
    let entries = std::fs::read_dir(folder).unwrap();
    let paths = entries.map(|entry| entry.unwrap().path());
    let known = paths.filter(|path| {
        path.join("mod.rs").exists() || path.extension().is_some_and(|end| end == "rs")
    });
    let named = known.map(|path| {
        let name = path.file_stem().unwrap().to_str().unwrap();
        (name.to_owned(), path)
    });
    named
        .filter(|(name, _)| !["main", "mod"].contains(&name.as_str()))
        .collect()
}

/// Files of tests of a crate that nothing names.
fn strays(package: &Path) -> Vec<PathBuf> {
    let manifest = read_to_string(package.join("Cargo.toml")).unwrap();
    let mut folders = vec![(package.join("tests"), "main.rs")];
    let mut strays = Vec::new();
    while let Some((folder, root)) = folders.pop() {
        let root_text = read_to_string(folder.join(root)).unwrap();
        for (name, path) in modules(&folder) {
            let a_module = root_text
                .lines()
                .any(|line| line.strip_prefix("pub ").unwrap_or(line) == format!("mod {name};"));
            let a_binary = root == "main.rs" && manifest.contains(&format!("name = \"{name}\""));
            if !a_module && !a_binary {
                strays.push(path.clone());
            }
            if path.is_dir() {
                folders.push((path, "mod.rs"));
            }
        }
    }
    strays
}

/// Rust files below a folder.
fn sources(folder: &Path) -> Vec<PathBuf> {
    let entries = std::fs::read_dir(folder).unwrap();
    let paths = entries.map(|entry| entry.unwrap().path());
    let deep = paths.flat_map(|path| match path.is_dir() {
        true => sources(&path),
        false => vec![path],
    });
    deep.filter(|path| path.extension().is_some_and(|end| end == "rs"))
        .collect()
}

/// Whether documentation has an example that could be run.
fn has_example(source: &str) -> bool {
    let mut open = false;
    for line in source.lines().map(str::trim_start) {
        let text = line.strip_prefix("///").or(line.strip_prefix("//!"));
        let Some(words) = text.and_then(|text| text.trim().strip_prefix("```")) else {
            continue;
        };
        open = !open;
        if open
            && words
                .split(',')
                .all(|word| !["text", "toml", "sh"].contains(&word))
        {
            return true;
        }
    }
    false
}

/// Sources with tests or examples that the manifest of their crate keeps from being run.
fn unseen(package: &Path) -> Vec<PathBuf> {
    let manifest = read_to_string(package.join("Cargo.toml")).unwrap();
    let without = |key: &str| manifest.lines().any(|line| line == key);
    let mut unseen = Vec::new();
    for path in sources(&package.join("src")) {
        let source = read_to_string(&path).unwrap();
        let own = path.strip_prefix(package.join("src")).unwrap();
        let a_binary = own == "main.rs" || own.starts_with("bin");
        let test = a_binary && without("test = false") && source.contains("#[test]");
        if test || without("doctest = false") && has_example(&source) {
            unseen.push(path);
        }
    }
    unseen
}

#[test]
fn what_a_manifest_leaves_out_has_no_tests_and_no_examples() {
    let workspace = Path::new(env!("CARGO_MANIFEST_DIR")).parent().unwrap();
    for package in [
        "dem",
        "continuum",
        "coupling",
        "scenarios",
        "tests",
        "benchmarks",
    ] {
        assert_eq!(unseen(&workspace.join(package)), Vec::<PathBuf>::new());
    }
}

#[test]
fn a_test_or_an_example_that_is_left_out_is_found() {
    let package = tempfile::tempdir().unwrap();
    let at = |name: &str| package.path().join(name);
    std::fs::create_dir_all(at("src/bin")).unwrap();
    let manifest = |text: &str| std::fs::write(at("Cargo.toml"), text).unwrap();
    let example = "//! ```text\n//! a = b\n//! ```\n/// ```\n/// f();\n/// ```\nfn f() {}\n";
    for (name, text) in [
        ("lib.rs", example),
        (
            "other.rs",
            "//! ```text\n//! a\n//! ```\n#[test]\nfn g() {}\n",
        ),
        ("bin/tool.rs", "#[test]\nfn h() {}\n"),
    ] {
        std::fs::write(at("src").join(name), text).unwrap();
    }
    manifest("[lib]\n[[bin]]\n");
    assert!(unseen(package.path()).is_empty());
    manifest("[lib]\ndoctest = false\n[[bin]]\ntest = false\n");
    let mut found = unseen(package.path());
    found.sort();
    assert_eq!(found, [at("src/bin/tool.rs"), at("src/lib.rs")]);
}

#[test]
fn every_file_of_tests_belongs_to_a_binary() {
    let workspace = Path::new(env!("CARGO_MANIFEST_DIR")).parent().unwrap();
    let mut packages = 0;
    for entry in std::fs::read_dir(workspace).unwrap() {
        let package = entry.unwrap().path();
        let manifest = read_to_string(package.join("Cargo.toml")).unwrap_or_default();
        if manifest.contains("autotests = false") {
            packages += 1;
            assert_eq!(strays(&package), Vec::<PathBuf>::new());
        }
    }
    assert_eq!(packages, 5);
}

#[test]
fn a_file_that_nothing_names_is_found() {
    let package = tempfile::tempdir().unwrap();
    let write = |name: &str, text: &str| {
        let path = package.path().join(name);
        std::fs::create_dir_all(path.parent().unwrap()).unwrap();
        std::fs::write(path, text).unwrap();
    };
    write(
        "Cargo.toml",
        "autotests = false\n[[test]]\nname = \"alone\"\n",
    );
    write("tests/main.rs", "mod named;\nmod folder;\n");
    write("tests/folder/mod.rs", "mod inner;\npub mod shared;\n");
    for name in ["alone", "named", "folder/inner", "folder/shared"] {
        write(&format!("tests/{name}.rs"), "");
    }
    assert!(strays(package.path()).is_empty());
    write("tests/forgotten.rs", "");
    write("tests/folder/lost.rs", "");
    let mut found = strays(package.path());
    found.sort();
    let at = |name: &str| package.path().join("tests").join(name);
    assert_eq!(found, [at("folder/lost.rs"), at("forgotten.rs")]);
}
