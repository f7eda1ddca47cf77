//! Which keys of `[rheology]` the chosen law reads.
//!
//! A default that another law does not read is dropped; a key that somebody wrote and the law does not
//! read is refused. What a rheology file brings may serve several laws: what is not read of it is left.

use super::bagnold::FrictionLaw;
use super::{SceneError, layers};
use toml::{Table, Value};

/// Numbers of laws, of which each law reads some.
const LAW_KEYS: [&str; 7] = [
    "mu_s",
    "mu_2",
    "i_0",
    "alpha",
    "mu_infinity",
    "viscosity",
    "table",
];

impl FrictionLaw {
    /// The numbers that the law reads, besides those of the grains.
    pub fn reads(self) -> &'static [&'static str] {
        match self {
            FrictionLaw::MuI => &["mu_s", "mu_2", "i_0"],
            FrictionLaw::Coulomb => &["mu_s", "viscosity"],
            FrictionLaw::BarkerGray => &["mu_s", "mu_2", "i_0", "alpha", "mu_infinity"],
            FrictionLaw::Table => &["table"],
        }
    }

    /// The law's name in a scene.
    pub fn word(self) -> &'static str {
        match self {
            FrictionLaw::MuI => "mu-i",
            FrictionLaw::Coulomb => "coulomb",
            FrictionLaw::BarkerGray => "barker-gray",
            FrictionLaw::Table => "table",
        }
    }
}

/// The law that a table of merged layers names.
fn chosen(table: &Table) -> FrictionLaw {
    layers::get(table, "rheology.law")
        .and_then(|value| value.clone().try_into().ok())
        .unwrap_or_default()
}

/// Whether a layer chooses the law.
pub fn chooses(layer: &Table) -> bool {
    layers::get(layer, "rheology.law").is_some()
}

/// Takes out of what was written the numbers of laws that repeat a default: a copy of a bundled scene has
/// them all.
pub fn forget_defaults(written: &mut Table, defaults: &Table) {
    let Some(Value::Table(rheology)) = written.get_mut("rheology") else {
        return;
    };
    rheology.retain(|key, value| {
        !(LAW_KEYS.contains(&key) || MATERIAL_KEYS.contains(&key))
            || layers::get(defaults, &format!("rheology.{key}")) != Some(&*value)
    });
}

/// Refuses numbers that a layer has and the law of the merged table does not read.
pub fn check_read(table: &Table, layer: &Table, file: &str) -> Result<(), SceneError> {
    let law = chosen(table);
    let Some(Value::Table(rheology)) = layer.get("rheology") else {
        return Ok(());
    };
    for (key, value) in rheology {
        if LAW_KEYS.contains(&key.as_str()) && !law.reads().contains(&key.as_str()) {
            return Err(SceneError::Unread {
                file: file.to_owned(),
                key: format!("rheology.{key}"),
                value: value.to_string(),
                law: format!(
                    "rheology.law {}; its keys: {}",
                    law.word(),
                    law.reads().join(", ")
                ),
            });
        }
    }
    Ok(())
}

/// Keys that say what the continuum's material does, beside the numbers of its law.
const MATERIAL_KEYS: [&str; 4] = ["law", "cohesion", "file", "from"];

/// Refuses what a layer says of the continuum beside grains where that takes the law calibrated for them.
pub fn check_calibrated(table: &Table, layer: &Table, file: &str) -> Result<(), SceneError> {
    let word = |key: &str| layers::get(table, key).and_then(Value::as_str);
    if word("model") != Some("hybrid") {
        return Ok(());
    }
    let (Some(calibrated), Some(Value::Table(rheology))) =
        (word("grains.calibrated"), layer.get("rheology"))
    else {
        return Ok(());
    };
    let said =
        |key: &&String| LAW_KEYS.contains(&key.as_str()) || MATERIAL_KEYS.contains(&key.as_str());
    match rheology.keys().find(said) {
        Some(key) if calibrated != "none" => Err(SceneError::Unneeded {
            file: file.to_owned(),
            key: format!("rheology.{key}"),
            choice: format!(
                "model = \"hybrid\" with grains.calibrated = \"{calibrated}\", whose law the continuum has (with \"none\" it is read)"
            ),
        }),
        _ => Ok(()),
    }
}

/// Drops numbers that the law of the merged table does not read.
pub fn drop_unread(table: &mut Table) {
    let law = chosen(table);
    if let Some(Value::Table(rheology)) = table.get_mut("rheology") {
        rheology.retain(|key, _| !LAW_KEYS.contains(&key) || law.reads().contains(&key));
    }
}

/// Says which number of the law is missing.
pub fn check_complete(table: &Table, file: &str) -> Result<(), SceneError> {
    let law = chosen(table);
    match law
        .reads()
        .iter()
        .find(|key| layers::get(table, &format!("rheology.{key}")).is_none())
    {
        None => Ok(()),
        Some(key) => Err(SceneError::MissingKey {
            file: file.to_owned(),
            key: format!("rheology.{key}"),
            wanted: if *key == "table" {
                "points [[I, mu], ...] for rheology.law = \"table\"".into()
            } else {
                format!("a number for rheology.law = \"{}\"", law.word())
            },
        }),
    }
}
