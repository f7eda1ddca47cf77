//! What varies in a comparison: keys, their values, and a scene for each combination of them.

use crate::failure::Failure;
use crate::scene::Scene;

/// Most runs of a comparison.
const MOST_RUNS: usize = 1000;
/// Longest name of a run's folder (bytes), which file systems take.
const LONGEST_NAME: usize = 200;

/// A key and its values, as written.
pub type Varied = (String, Vec<String>);

/// The scene with one combination of values.
#[derive(Clone, Debug)]
pub struct Variant {
    /// A value of each key, as written.
    pub values: Vec<String>,
    /// Name of its run's folder.
    pub folder: String,
    /// The scene with them.
    pub scene: Scene,
}

/// Keys and values of `--vary KEY=A,B,C`, which may be given several times.
pub fn parse(vary: &[String]) -> Result<Vec<Varied>, Failure> {
    let mut all: Vec<Varied> = Vec::new();
    for vary in vary {
        let malformed = || {
            Failure::Input(format!(
                "--vary {vary}: wanted KEY=A,B,C with at least two values, as in `--vary grid.cells=16,32,64`"
            ))
        };
        let (key, values) = vary.split_once('=').ok_or_else(malformed)?;
        let key = key.trim();
        let values: Vec<String> = values.split(',').map(|v| v.trim().to_owned()).collect();
        if values.len() < 2 || key.is_empty() || values.iter().any(String::is_empty) {
            return Err(malformed());
        }
        if all.iter().any(|(other, _)| other == key) {
            return Err(Failure::Input(format!(
                "--vary {key}: given twice; allowed: each key once, with all of its values"
            )));
        }
        all.push((key.to_owned(), values));
    }
    Ok(all)
}

/// A scene for each combination, the last key's values changing first.
pub fn variants(scene: &Scene, varied: &[Varied]) -> Result<Vec<Variant>, Failure> {
    let keys: Vec<String> = varied.iter().map(|(key, _)| key.clone()).collect();
    let counts = varied.iter().map(|(_, values)| values.len());
    let runs = counts.fold(1_usize, usize::saturating_mul);
    if runs > MOST_RUNS {
        return Err(Failure::Input(format!(
            "--vary {}: {runs} runs; allowed: at most {MOST_RUNS}",
            keys.join(", ")
        )));
    }
    let mut rows: Vec<Vec<String>> = vec![Vec::new()];
    for (_, values) in varied {
        let longer = rows.iter().flat_map(|row| {
            let with = |value: &String| [row.as_slice(), std::slice::from_ref(value)].concat();
            values.iter().map(with)
        });
        rows = longer.collect();
    }
    let mut all: Vec<Variant> = Vec::new();
    for values in rows {
        let sets = keys.iter().zip(&values);
        let sets: Vec<String> = sets.map(|(key, value)| format!("{key}={value}")).collect();
        let folders = keys.iter().zip(&values);
        let folders: Vec<String> = folders.map(|(k, v)| folder_name(k, v)).collect();
        let variant = Variant {
            folder: folders.join("_"),
            scene: scene.with(&sets, "--vary")?,
            values,
        };
        if variant.folder.len() > LONGEST_NAME {
            return Err(Failure::Input(format!(
                "--vary {}: the name of a run, {}, has {} bytes; allowed: at most {LONGEST_NAME}",
                keys.join(", "),
                variant.folder,
                variant.folder.len()
            )));
        }
        let twin = all
            .iter()
            .find(|other| other.folder == variant.folder || other.scene == variant.scene);
        if let Some(twin) = twin {
            return Err(Failure::Input(format!(
                "--vary {}: the values {} and {} are the same run; allowed: each value once",
                keys.join(", "),
                twin.values.join(", "),
                variant.values.join(", ")
            )));
        }
        all.push(variant);
    }
    Ok(all)
}

/// "key = value", for all keys of a run.
pub fn label(keys: &[String], values: &[String]) -> String {
    let pairs = keys.iter().zip(values);
    let pairs: Vec<String> = pairs
        .map(|(key, value)| format!("{key} = {value}"))
        .collect();
    pairs.join(", ")
}

/// A folder name from a setting; characters that file systems dislike become dashes.
fn folder_name(key: &str, value: &str) -> String {
    let plain = |c: char| {
        if c.is_alphanumeric() || "._-+".contains(c) {
            c
        } else {
            '-'
        }
    };
    format!("{key}-{value}").chars().map(plain).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn keys_that_vary_are_read_and_refused() {
        let given = |all: &[&str]| parse(&all.iter().map(|v| (*v).to_owned()).collect::<Vec<_>>());
        let read = given(&["a.b=1, 2", "c=x,y,z"]).unwrap();
        assert_eq!(read[0].1, ["1", "2"]);
        assert_eq!(
            read[1],
            ("c".into(), ["x", "y", "z"].map(String::from).to_vec())
        );
        for wrong in [&["a=1"][..], &["=1,2"], &["a=1,"], &["a"]] {
            assert!(given(wrong).is_err(), "{wrong:?}");
        }
        let twice = given(&["a=1,2", "a=3,4"]).unwrap_err();
        assert!(format!("{twice:?}").contains("given twice"));
    }
}
