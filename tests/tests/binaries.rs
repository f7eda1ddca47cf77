//! Every file of tests belongs to a binary: the crates name theirs themselves (`autotests = false`), so a file that
//! neither a module nor a manifest names would never run.

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
            let a_module = root_text.lines().any(|line| line == format!("mod {name};"));
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
    write("tests/folder/mod.rs", "mod inner;\n");
    for name in ["alone", "named", "folder/inner"] {
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
