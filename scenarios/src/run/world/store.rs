//! Packings by name: made once, found again by every scene that asks for the same.
//!
//! `packing = "NAME"` is the file `packings/NAME.h5` below the folder in which the program runs; where it is
//! not there yet the scene prepares it and puts it there. `packing = "some/packing.h5"` is a file that must
//! be there. Either is refused where it was made by another recipe.

use super::packing_file::{self, Stored};
use super::recipe::Recipe;
use crate::failure::Failure;
use crate::run_directory::{checksums_of, differing_keys};
use crate::scene::grain_inputs;
use crate::scene::world::Materials;
use std::path::{Path, PathBuf};

/// Folder of named packings.
const FOLDER: &str = "packings";

/// Where the packing of a scene is, or will be.
pub fn place(named: &str) -> PathBuf {
    if named.ends_with(".h5") {
        PathBuf::from(named)
    } else {
        Path::new(FOLDER).join(format!("{named}.h5"))
    }
}

/// The packing that a scene names; none where it has to be prepared.
pub fn find(
    recipe: &dyn Recipe,
    materials: &Materials,
    origin: &str,
) -> Result<Option<Stored>, Failure> {
    let Some(named) = recipe.keys().packing else {
        return Ok(None);
    };
    let plain = |c: char| c.is_alphanumeric() || "-_.".contains(c);
    let refuse = |why: String| {
        Failure::Input(format!(
            "{origin}: key `packing` = \"{named}\": {why}; allowed: a name of letters, digits, dots and dashes, under \
             which the preparation is kept in {FOLDER}/, or a file packing.h5 of a run of the same preparation"
        ))
    };
    if named.is_empty() || (!named.ends_with(".h5") && !named.chars().all(plain)) {
        return Err(refuse("not a name and not a file".into()));
    }
    let path = place(named);
    if !named.ends_with(".h5") && !path.exists() {
        return Ok(None);
    }
    let stored =
        packing_file::read(&path).map_err(|why| refuse(format!("{}: {why}", path.display())))?;
    if let Some(why) = mismatch(recipe, materials, &stored)? {
        return Err(refuse(format!("{}: {why}", path.display())));
    }
    Ok(Some(stored))
}

/// What a preparation goes by: the recipe's keys and the checksums of the files they name.
pub fn provenance(recipe: &dyn Recipe) -> Result<Option<toml::Table>, Failure> {
    let Some(mut keys) = recipe.provenance()? else {
        return Ok(None);
    };
    let sums = checksums_of(grain_inputs(&keys))?;
    if !sums.is_empty() {
        keys.insert("contents".into(), sums.into());
    }
    Ok(Some(keys))
}

/// Why a packing is not the one a scene asks for.
fn mismatch(
    recipe: &dyn Recipe,
    materials: &Materials,
    stored: &Stored,
) -> Result<Option<String>, Failure> {
    let own = provenance(recipe)?;
    let differing = own.map_or_else(Vec::new, |own| differing_keys(&stored.provenance, &own, ""));
    if !differing.is_empty() {
        return Ok(Some(format!(
            "it was made by another recipe; differing: {}",
            differing.join(", ")
        )));
    }
    // Numbers of materials stand for names.
    let known = materials.names.starts_with(&stored.materials)
        || stored.materials.starts_with(&materials.names);
    Ok((!known).then(|| {
        format!(
            "its materials are {}, those of the scene {}",
            stored.materials.join(", "),
            materials.names.join(", ")
        )
    }))
}

/// Keeps a packing under the name that its scene gives it, if it gives one.
pub fn keep(recipe: &dyn Recipe, scene: &str, stored: &Stored) -> Result<Option<PathBuf>, Failure> {
    let Some(named) = recipe
        .keys()
        .packing
        .filter(|named| !named.ends_with(".h5"))
    else {
        return Ok(None);
    };
    let path = place(named);
    std::fs::create_dir_all(FOLDER)
        .map_err(|error| Failure::Run(format!("cannot make the folder {FOLDER}: {error}")))?;
    packing_file::write(&path, scene, stored)?;
    Ok(Some(path))
}
