//! Checks a TOML table against the JSON Schema of its scene: names, types and ranges.
//!
//! The schema comes from the scene's own structs, so what `colluvium schema` prints, what is
//! checked and what is read cannot drift apart.

use super::SceneError;
use serde_json::Value;

/// Names and values of all keys that are there; says nothing about keys left out.
pub fn check(table: &toml::Table, schema: &Value, file: &str) -> Result<(), SceneError> {
    Checker { root: schema, file }.table(table, schema, "")
}

/// Every required key is there.
pub fn require(table: &toml::Table, schema: &Value, file: &str) -> Result<(), SceneError> {
    Checker { root: schema, file }.required(table, schema, "")
}

/// The name nearest to `name`, if one is near enough to be a slip.
pub fn nearest<'a>(name: &str, known: impl Iterator<Item = &'a str>) -> Option<String> {
    known
        .map(|k| (strsim::jaro_winkler(name, k), k))
        .filter(|(score, _)| *score > 0.75)
        .max_by(|a, b| a.0.total_cmp(&b.0))
        .map(|(_, k)| k.to_owned())
}

struct Checker<'a> {
    root: &'a Value,
    file: &'a str,
}

impl Checker<'_> {
    /// Follows `$ref` and the first alternative of an optional value that is not null.
    fn definition<'s>(&'s self, schema: &'s Value) -> &'s Value {
        self.alternative(None, schema)
    }

    /// The same, where a value may be of several shapes: the alternative whose shape it has.
    fn alternative<'s>(&'s self, value: Option<&toml::Value>, schema: &'s Value) -> &'s Value {
        if let Some(Value::String(path)) = schema.get("$ref") {
            let pointer = path.trim_start_matches('#');
            let found = self.root.pointer(pointer);
            return found.map_or(schema, |found| self.alternative(value, found));
        }
        let Some(Value::Array(options)) = schema.get("anyOf") else {
            return schema;
        };
        let mut options = options.iter().filter(|o| o["type"] != "null");
        let fits = |o: &&Value| value.is_some_and(|value| self.has_shape(value, o));
        match options.clone().find(fits).or(options.next()) {
            Some(option) => self.alternative(value, option),
            None => schema,
        }
    }

    /// Whether a value is of the type of a schema, an array with its first value.
    fn has_shape(&self, value: &toml::Value, schema: &Value) -> bool {
        let schema = self.alternative(Some(value), schema);
        match (value, kind(schema)) {
            (toml::Value::Array(items), "array") => items
                .first()
                .is_none_or(|item| self.has_shape(item, &schema["items"])),
            (toml::Value::Integer(_) | toml::Value::Float(_), "number" | "integer")
            | (toml::Value::String(_), "string")
            | (toml::Value::Boolean(_), "boolean")
            | (toml::Value::Table(_), "object") => true,
            _ => false,
        }
    }

    fn table(&self, table: &toml::Table, schema: &Value, path: &str) -> Result<(), SceneError> {
        let empty = serde_json::Map::new();
        let properties = schema["properties"].as_object().unwrap_or(&empty);
        for (key, value) in table {
            let dotted = join(path, key);
            let Some(property) = properties.get(key).or_else(|| named(schema)) else {
                return Err(SceneError::UnknownKey {
                    file: self.file.to_owned(),
                    nearest: nearest(key, properties.keys().map(String::as_str))
                        .map(|n| join(path, &n)),
                    known: properties.keys().cloned().collect::<Vec<_>>().join(", "),
                    key: dotted,
                });
            };
            self.value(value, property, &dotted)?;
        }
        Ok(())
    }

    fn required(&self, table: &toml::Table, schema: &Value, path: &str) -> Result<(), SceneError> {
        for key in schema["required"]
            .as_array()
            .into_iter()
            .flatten()
            .filter_map(Value::as_str)
        {
            if !table.contains_key(key) {
                return Err(SceneError::MissingKey {
                    file: self.file.to_owned(),
                    key: join(path, key),
                    wanted: describe(self.definition(&schema["properties"][key])),
                });
            }
        }
        for (key, value) in table {
            let property = schema["properties"].get(key).or_else(|| named(schema));
            let Some(definition) = property.map(|p| self.definition(p)) else {
                continue;
            };
            match value {
                toml::Value::Table(inner) => self.required(inner, definition, &join(path, key))?,
                toml::Value::Array(items) => {
                    let item = self.definition(&definition["items"]);
                    for (n, inner) in items.iter().enumerate() {
                        if let toml::Value::Table(inner) = inner {
                            self.required(inner, item, &format!("{}[{n}]", join(path, key)))?;
                        }
                    }
                }
                _ => {}
            }
        }
        Ok(())
    }

    fn value(&self, value: &toml::Value, property: &Value, key: &str) -> Result<(), SceneError> {
        let schema = self.alternative(Some(value), property);
        if let toml::Value::Table(inner) = value
            && kind(schema) == "object"
        {
            return self.table(inner, schema, key);
        }
        if let toml::Value::Array(items) = value
            && kind(schema) == "array"
        {
            return self.array(value, items, schema, key);
        }
        let wrong_type = || SceneError::WrongType {
            file: self.file.to_owned(),
            key: key.to_owned(),
            value: value.to_string(),
            found: value.type_str().to_owned(),
            wanted: describe(schema),
        };
        let number = match (kind(schema), value) {
            ("number", toml::Value::Float(x)) => *x,
            ("number" | "integer", toml::Value::Integer(n)) => *n as f64,
            // An integer that was too large to be read as one.
            ("integer", toml::Value::Float(x)) if x.abs() >= 9.2e18 && x.fract() == 0.0 => *x,
            ("string", toml::Value::String(text)) => {
                return if words(schema).is_empty() || words(schema).contains(&text.as_str()) {
                    Ok(())
                } else {
                    Err(self.out_of_range(value, schema, key))
                };
            }
            ("boolean", toml::Value::Boolean(_)) => return Ok(()),
            _ => return Err(wrong_type()),
        };
        let readable = kind(schema) == "number" || value.is_integer();
        if readable && inside(number, schema) {
            Ok(())
        } else {
            Err(self.out_of_range(value, schema, key))
        }
    }

    fn array(
        &self,
        value: &toml::Value,
        items: &[toml::Value],
        schema: &Value,
        key: &str,
    ) -> Result<(), SceneError> {
        let count = items.len() as u64;
        let least = schema["minItems"].as_u64().unwrap_or(0);
        let most = schema["maxItems"].as_u64().unwrap_or(u64::MAX);
        if count < least || count > most {
            return Err(self.out_of_range(value, schema, key));
        }
        for (n, item) in items.iter().enumerate() {
            self.value(item, &schema["items"], &format!("{key}[{n}]"))?;
        }
        Ok(())
    }

    fn out_of_range(&self, value: &toml::Value, schema: &Value, key: &str) -> SceneError {
        SceneError::OutOfRange {
            file: self.file.to_owned(),
            key: key.to_owned(),
            value: value.to_string(),
            range: describe(schema),
        }
    }
}

/// The schema of sections with names of the user's own, as in `[walls.NAME]`.
fn named(schema: &Value) -> Option<&Value> {
    schema.get("additionalProperties").filter(|s| s.is_object())
}

fn join(path: &str, key: &str) -> String {
    if path.is_empty() {
        key.to_owned()
    } else {
        format!("{path}.{key}")
    }
}

/// The schema's type, leaving out the null of an optional key.
fn kind(schema: &Value) -> &str {
    match &schema["type"] {
        Value::String(kind) => kind,
        Value::Array(kinds) => kinds
            .iter()
            .filter_map(Value::as_str)
            .find(|k| *k != "null")
            .unwrap_or(""),
        // An enumeration with a comment on each word has no type of its own.
        _ if schema.get("oneOf").is_some() || schema.get("enum").is_some() => "string",
        _ => "",
    }
}

/// The words of an enumeration, however the schema spells it.
fn words(schema: &Value) -> Vec<&str> {
    let mut words: Vec<&str> = schema["enum"]
        .as_array()
        .into_iter()
        .flatten()
        .filter_map(Value::as_str)
        .collect();
    for option in schema["oneOf"].as_array().into_iter().flatten() {
        words.extend(option["const"].as_str());
        words.extend(
            option["enum"]
                .as_array()
                .into_iter()
                .flatten()
                .filter_map(Value::as_str),
        );
    }
    words
}

fn inside(x: f64, schema: &Value) -> bool {
    let limit = |name: &str| schema[name].as_f64();
    x.is_finite()
        && limit("minimum").is_none_or(|l| x >= l)
        && limit("exclusiveMinimum").is_none_or(|l| x > l)
        && limit("maximum").is_none_or(|l| x <= l)
        && limit("exclusiveMaximum").is_none_or(|l| x < l)
}

/// Type and range in words, as in "number in (0, 1]".
fn describe(schema: &Value) -> String {
    let limit = |name: &str| schema[name].as_f64();
    let name = match kind(schema) {
        "string" if !words(schema).is_empty() => {
            return format!("one of {}", words(schema).join(", "));
        }
        "array" => {
            let (least, most) = (schema["minItems"].as_u64(), schema["maxItems"].as_u64());
            return match (least, most) {
                (Some(a), Some(b)) if a == b => format!("array of {a} values"),
                (Some(a), Some(b)) => format!("array of {a} to {b} values"),
                _ => "array".to_owned(),
            };
        }
        "object" => return "table".to_owned(),
        name => name,
    };
    let low = limit("minimum")
        .map(|l| format!("[{l}"))
        .or_else(|| limit("exclusiveMinimum").map(|l| format!("({l}")));
    let high = limit("maximum")
        .map(|l| format!("{l}]"))
        .or_else(|| limit("exclusiveMaximum").map(|l| format!("{l})")));
    match (low, high) {
        (None, None) => name.to_owned(),
        (low, high) => format!(
            "{name} in {}, {}",
            low.unwrap_or_else(|| "(-inf".into()),
            high.unwrap_or_else(|| "inf)".into())
        ),
    }
}
