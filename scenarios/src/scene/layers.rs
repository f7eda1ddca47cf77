//! Layers of a scene: the bundled defaults, the scene file, and the settings of the command line.

use super::SceneError;
use std::path::Path;
use toml::{Table, Value};

/// Reads TOML.
pub fn parse(text: &str, origin: &str) -> Result<Table, SceneError> {
    text.parse::<Table>()
        .map_err(|error| SceneError::Unreadable {
            file: origin.to_owned(),
            message: match error.span() {
                Some(span) => {
                    let line = text[..span.start.min(text.len())].matches('\n').count() + 1;
                    format!("line {line}: {}", error.message())
                }
                None => error.message().to_owned(),
            },
        })
}

/// `KEY=VALUE` settings as one table. VALUE is TOML; what is not TOML is taken as a bare string.
pub fn parse_settings(settings: &[String], option: &str) -> Result<Table, SceneError> {
    let mut table = Table::new();
    for text in settings {
        let malformed = || SceneError::Setting {
            option: option.to_owned(),
            text: text.clone(),
        };
        let (key, value) = text.split_once('=').ok_or_else(malformed)?;
        let (key, value) = (key.trim(), value.trim());
        if key.is_empty() || value.is_empty() || key.split('.').any(|part| part.is_empty()) {
            return Err(malformed());
        }
        if key == "scene" {
            return Err(SceneError::OutOfRange {
                file: option.to_owned(),
                key: "scene".into(),
                value: value.into(),
                range: "not to be set: give the other scene's name instead".into(),
            });
        }
        insert(&mut table, key, setting_value(value)).map_err(|at| SceneError::WrongType {
            file: option.to_owned(),
            key: at,
            value: text.clone(),
            found: "value".into(),
            wanted: "table".into(),
        })?;
    }
    Ok(table)
}

fn setting_value(text: &str) -> Value {
    let parsed = format!("value = {text}").parse::<Table>();
    match parsed {
        // More than one key means that the text held a line break: not one value.
        Ok(mut table) if table.len() == 1 => table
            .remove("value")
            .unwrap_or_else(|| Value::String(text.to_owned())),
        // TOML has no integers of more than 64 bits: the range check should see a number.
        _ => match text.replace('_', "").parse::<f64>() {
            Ok(number) if text.trim_start_matches(['+', '-']).bytes().all(is_digit) => {
                Value::Float(number)
            }
            _ => Value::String(text.to_owned()),
        },
    }
}

fn is_digit(byte: u8) -> bool {
    byte.is_ascii_digit() || byte == b'_'
}

/// Inserts at a dotted path; the error is the path of something that is in the way.
fn insert(table: &mut Table, key: &str, value: Value) -> Result<(), String> {
    match key.split_once('.') {
        None => {
            table.insert(key.to_owned(), value);
            Ok(())
        }
        Some((head, rest)) => {
            let inner = table
                .entry(head)
                .or_insert_with(|| Value::Table(Table::new()));
            match inner {
                Value::Table(inner) => {
                    insert(inner, rest, value).map_err(|at| format!("{head}.{at}"))
                }
                _ => Err(head.to_owned()),
            }
        }
    }
}

/// The value at a dotted path.
pub fn get<'a>(table: &'a Table, key: &str) -> Option<&'a Value> {
    match key.split_once('.') {
        None => table.get(key),
        Some((head, rest)) => table.get(head)?.as_table().and_then(|t| get(t, rest)),
    }
}

/// Takes away what is at a dotted path.
pub fn remove(table: &mut Table, key: &str) {
    match key.split_once('.') {
        None => {
            table.remove(key);
        }
        Some((head, rest)) => {
            if let Some(Value::Table(inner)) = table.get_mut(head) {
                remove(inner, rest);
            }
        }
    }
}

/// Keys that exclude each other are not given together.
pub fn check_choices(table: &Table, choices: &[&[&str]], file: &str) -> Result<(), SceneError> {
    for keys in choices {
        let mut given = keys.iter().filter(|k| get(table, k).is_some());
        if let (Some(first), Some(second)) = (given.next(), given.next()) {
            return Err(SceneError::Conflict {
                file: file.to_owned(),
                first: (*first).to_string(),
                second: (*second).to_string(),
            });
        }
    }
    Ok(())
}

/// `upper` laid over `base`; a key of `upper` drops the alternatives that `base` had for it.
pub fn merge(mut base: Table, upper: Table, choices: &[&[&str]]) -> Table {
    for keys in choices {
        if keys.iter().any(|k| get(&upper, k).is_some()) {
            for key in *keys {
                remove(&mut base, key);
            }
        }
    }
    lay(&mut base, upper);
    base
}

fn lay(base: &mut Table, upper: Table) {
    for (key, value) in upper {
        match (base.get_mut(&key), value) {
            (Some(Value::Table(inner)), Value::Table(value)) => lay(inner, value),
            (_, value) => {
                base.insert(key, value);
            }
        }
    }
}

/// Makes a relative path at a dotted key of a scene file relative to that file's folder.
pub fn anchor_path(table: &mut Table, key: &str, folder: &Path) {
    match key.split_once('.') {
        Some((head, rest)) => {
            if let Some(Value::Table(inner)) = table.get_mut(head) {
                anchor_path(inner, rest, folder);
            }
        }
        None => {
            if let Some(Value::String(path)) = table.get_mut(key)
                && Path::new(path.as_str()).is_relative()
            {
                *path = folder.join(path.as_str()).display().to_string();
            }
        }
    }
}
