//! Checksums of the files that a run was computed from: it goes on from the same bytes only.

use crate::failure::Failure;
use crate::scene::Scene;
use crate::seal;
use std::path::{Path, PathBuf};

/// Name of the checksums in a run directory.
pub const INPUTS: &str = "inputs.toml";

/// CRC-32 (hex) of files, by path.
pub fn checksums_of(files: Vec<PathBuf>) -> Result<toml::Table, Failure> {
    let mut sums = toml::Table::new();
    for path in files {
        let sum = seal::of_file(&path).map_err(|error| {
            Failure::Input(format!("{}: cannot be read: {error}", path.display()))
        })?;
        sums.insert(path.display().to_string(), sum.into());
    }
    Ok(sums)
}

/// The text of [`INPUTS`]; none where everything is in the scene.
pub fn checksums(scene: &Scene) -> Result<Option<String>, Failure> {
    let sums = checksums_of(scene.files())?;
    if sums.is_empty() {
        return Ok(None);
    }
    let body = super::toml_text(INPUTS, &sums)?;
    Ok(Some(format!(
        "# CRC-32 of the files that this run was computed from.\n{body}"
    )))
}

/// Refuses to go on with files that have changed. A run of a version that wrote no checksums goes on unchecked.
pub fn refuse_others(directory: &Path, scene: &Scene) -> Result<(), Failure> {
    let path = directory.join(INPUTS);
    if !path.exists() {
        return Ok(());
    }
    let refuse = |why: String| Failure::Input(format!("--resume: {why}; nothing was changed"));
    let unreadable = |why: String| refuse(format!("{} cannot be used: {why}", path.display()));
    let text = std::fs::read_to_string(&path).map_err(|error| unreadable(error.to_string()))?;
    let before: toml::Table = text
        .parse()
        .map_err(|error: toml::de::Error| unreadable(error.message().to_owned()))?;
    for (file, sum) in &checksums_of(scene.files())? {
        if before.get(file) != Some(sum) {
            return Err(refuse(format!(
                "{} holds a run that began from another {file}: its contents have changed; allowed: the file as it was, or a new run in another directory",
                directory.display()
            )));
        }
    }
    Ok(())
}
