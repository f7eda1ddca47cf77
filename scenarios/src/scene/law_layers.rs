//! How the keys of a contact law lie over each other in the layers of a scene.
//!
//! An impact has the keys of its linear law at the top; the same names in `[contact]` are moved there,
//! so that each has one home. A default that another law does not read is dropped; a key that
//! somebody wrote and the law does not read is refused.

use super::impact::{AT_THE_TOP, INSTEAD};
use super::law::KINDS;
use super::{ImpactScene, LawKeys, SceneError, layers};
use toml::{Table, Value};

/// Moves keys of an impact's `[contact]` to their home at the top.
pub fn lift(layer: &mut Table, file: &str) -> Result<(), SceneError> {
    for key in AT_THE_TOP {
        let Some(Value::Table(contact)) = layer.get_mut("contact") else {
            break;
        };
        let Some(value) = contact.remove(key) else {
            continue;
        };
        if layer.contains_key(key) {
            return Err(SceneError::Conflict {
                file: file.to_owned(),
                first: key.to_owned(),
                second: format!("contact.{key}"),
            });
        }
        layer.insert(key.to_owned(), value);
    }
    Ok(())
}

/// Settings of one meaning exclude each other. A file may have both: the keys at the top always have
/// a value, and what `[contact]` puts in their place goes before them.
pub fn check_settings(set: &Table, option: &str) -> Result<(), SceneError> {
    for (top, inside) in INSTEAD {
        let inside = format!("contact.{inside}");
        if set.contains_key(top) && layers::get(set, &inside).is_some() {
            return Err(SceneError::Conflict {
                file: option.to_owned(),
                first: top.to_owned(),
                second: inside,
            });
        }
    }
    Ok(())
}

/// Drops from an impact's lower layer what the upper one replaces.
pub fn give_way(lower: &mut Table, upper: &Table) {
    for (top, inside) in INSTEAD {
        let inside = format!("contact.{inside}");
        if upper.contains_key(top) {
            layers::remove(lower, &inside);
        }
    }
    // Springs at the top are an option; the other keys there always have a value.
    if layers::get(upper, "contact.rolling").is_some() {
        lower.remove("rolling");
    }
}

/// Whether a layer chooses a part of the law.
pub fn chooses(layer: &Table) -> bool {
    KINDS
        .iter()
        .any(|kind| layers::get(layer, &format!("contact.{kind}")).is_some())
}

/// The law that the merged layers name; its types are checked.
fn keys(table: &Table, impact: bool) -> LawKeys {
    if impact {
        let body: Result<ImpactScene, _> = table.clone().try_into();
        return body.map(|body| body.law_keys()).unwrap_or_default();
    }
    let contact = table.get("contact").cloned();
    contact.and_then(|c| c.try_into().ok()).unwrap_or_default()
}

/// Refuses keys of a layer that the law of the merged table does not read. Keys at the top of an
/// impact have defaults for the linear law, so they only count where `top` says so.
pub fn check_read(
    table: &Table,
    layer: &Table,
    (impact, top): (bool, bool),
    file: &str,
) -> Result<(), SceneError> {
    let parts = keys(table, impact).parts();
    let reads = parts.reads();
    let refuse = |key: String, value: &Value| {
        let mut numbers: Vec<&str> = reads
            .iter()
            .copied()
            .filter(|key| !KINDS.contains(key))
            .collect();
        numbers.sort_unstable();
        numbers.dedup();
        Err(SceneError::Unread {
            file: file.to_owned(),
            key,
            value: value.to_string(),
            law: format!(
                "normal {}, tangential {}, rolling {}, cohesion {}; its keys: {}",
                parts.normal.word(),
                parts.tangential.word(),
                parts.rolling.word(),
                parts.cohesion.word(),
                numbers.join(", ")
            ),
        })
    };
    if let Some(Value::Table(contact)) = layer.get("contact") {
        for (key, value) in contact {
            if !reads.contains(&key.as_str()) {
                return refuse(format!("contact.{key}"), value);
            }
        }
    }
    if top {
        for key in AT_THE_TOP {
            if let Some(value) = layer.get(key)
                && !reads.contains(&key)
            {
                return refuse(key.to_owned(), value);
            }
        }
    }
    Ok(())
}

/// Drops defaults that the law of the merged table does not read.
pub fn drop_unread(table: &mut Table, impact: bool) {
    let reads = keys(table, impact).parts().reads();
    if let Some(Value::Table(contact)) = table.get_mut("contact") {
        contact.retain(|key, _| reads.contains(&key));
    }
}
