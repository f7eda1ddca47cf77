//! `rheology.toml`: a μ(I) law with its errors, its validity and its provenance.

mod normal_stress;

use crate::failure::Failure;
use crate::map::MapFile;
use crate::run_directory::toml_text;
use crate::scene::{SceneError, check_continuum_keys, layers};
use colluvium_coupling::calibration::SolidFractionFit;
use serde::{Deserialize, Serialize};
use std::path::{Path, PathBuf};
use toml::{Table, Value};

/// Keys of a scene that a rheology file takes the place of.
pub const ALTERNATIVES: &[&[&str]] = &[
    &["rheology.file", "rheology.mu_s"],
    &["rheology.file", "rheology.mu_2"],
    &["rheology.file", "rheology.i_0"],
    &["rheology.file", "rheology.table"],
    &["rheology.file", "rheology.diameter"],
    &["rheology.file", "rheology.solid_fraction"],
    &["rheology.file", "rheology.grain_density"],
    &["rheology.file", "rheology.valid_i"],
    &["rheology.file", "rheology.identified"],
    &["rheology.file", "rheology.good"],
    &["rheology.file", "rheology.source"],
    &["rheology.from", "rheology.file"],
    &["rheology.from", "rheology.mu_s"],
    &["rheology.from", "rheology.mu_2"],
    &["rheology.from", "rheology.i_0"],
    &["rheology.from", "rheology.table"],
    &["rheology.from", "rheology.solid_fraction"],
    &["rheology.from", "rheology.valid_i"],
    &["rheology.from", "rheology.identified"],
    &["rheology.from", "rheology.good"],
    &["rheology.from", "rheology.source"],
];

/// Which stress friction is measured against.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum FrictionOf {
    /// |τ|/p, p = trace/3.
    Pressure,
    /// |τ|/σ_zz.
    NormalStress,
}

/// A fitted rheology as it stands in a file; SI units.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct RheologyFile {
    /// Friction at I → 0.
    pub mu_s: f64,
    /// Its standard error.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub mu_s_error: Option<f64>,
    /// Friction at I → ∞.
    pub mu_2: f64,
    /// Its standard error.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub mu_2_error: Option<f64>,
    /// Inertial number half way between.
    pub i_0: f64,
    /// Its standard error.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub i_0_error: Option<f64>,
    /// Grain diameter (m).
    pub diameter: f64,
    /// Solid volume fraction in the flow.
    pub solid_fraction: f64,
    /// Its standard error.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub solid_fraction_error: Option<f64>,
    /// φ(I) = intercept − slope I of the same layers; a continuum carries one φ, this says how far it is from the truth.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub solid_fraction_of_i: Option<SolidFractionFit>,
    /// Density of the grains (kg/m³).
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub grain_density: Option<f64>,
    /// Inertial numbers between which the law was measured.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub valid_i: Option<[f64; 2]>,
    /// Points (I, μ) of the measured friction, for a scene with `rheology.law = "table"`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub table: Option<Vec<[f64; 2]>>,
    /// Whether the data determine all three parameters.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub identified: Option<bool>,
    /// Whether the law was judged fit to feed a continuum within `valid_i`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub good: Option<bool>,
    /// Covariance of (mu_s, mu_2, i_0).
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub covariance: Option<[[f64; 3]; 3]>,
    /// The same fit for |τ|/σ_zz in place of |τ|/p.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub mu_zz: Option<FitRow>,
    /// Where the numbers come from.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub provenance: Option<Provenance>,
}

/// One fit of μ(I) with standard errors.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct FitRow {
    /// Friction at I → 0.
    pub mu_s: f64,
    /// Its standard error.
    pub mu_s_error: f64,
    /// Friction at I → ∞.
    pub mu_2: f64,
    /// Its standard error.
    pub mu_2_error: f64,
    /// Inertial number half way between.
    pub i_0: f64,
    /// Its standard error.
    pub i_0_error: f64,
}

/// How a rheology was measured.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Provenance {
    /// Version of Colluvium.
    pub version: String,
    /// The scene.
    pub scene: String,
    /// Slopes of the runs whose points the fit uses (degrees).
    pub flow_degrees: Vec<f64>,
    /// Seed of the bed.
    pub seed: u64,
    /// Which friction is meant.
    pub friction: String,
    /// Whether the law describes the material, in words.
    pub verdict: String,
}

/// Calibrated laws that come with the program, by name: what `rheology.file` may say in the place of a path.
pub const BUNDLED: [(&str, &str); 3] = [
    ("moderate", include_str!("../rheologies/moderate.toml")),
    ("gravel", include_str!("../rheologies/gravel.toml")),
    ("glass", include_str!("../rheologies/glass.toml")),
];

impl RheologyFile {
    /// Reads and checks a file, or the bundled law of that name.
    pub fn read(path: &Path) -> Result<RheologyFile, SceneError> {
        let fail = |message: String| SceneError::Rheology {
            path: path.display().to_string(),
            message,
        };
        let bundled = BUNDLED.iter().find(|(name, _)| path == Path::new(name));
        let text = match bundled {
            Some((_, text)) if !path.exists() => (*text).to_owned(),
            _ => std::fs::read_to_string(path).map_err(|error| {
                let names = BUNDLED.map(|(name, _)| name).join(", ");
                fail(format!(
                    "cannot read the file: {error} (bundled laws: {names})"
                ))
            })?,
        };
        let law: RheologyFile =
            toml::from_str(&text).map_err(|error| fail(error.to_string().trim().to_owned()))?;
        law.check().map_err(fail)?;
        Ok(law)
    }

    /// Says what would make a scene refuse the file; with its range for each number.
    pub fn check(&self) -> Result<(), String> {
        let least = |key: &str, value: f64, above: f64| {
            if value.is_finite() && value > above {
                Ok(())
            } else {
                Err(format!(
                    "key `{key}` = {value} is not allowed; allowed: ({above}, inf)"
                ))
            }
        };
        if !(self.mu_s >= 0.0 && self.mu_s.is_finite()) {
            return Err(format!(
                "key `mu_s` = {} is not allowed; allowed: [0, inf)",
                self.mu_s
            ));
        }
        if !(self.mu_2 >= self.mu_s && self.mu_2.is_finite()) {
            return Err(format!(
                "key `mu_2` = {} is not allowed; allowed: at least mu_s = {}",
                self.mu_2, self.mu_s
            ));
        }
        least("i_0", self.i_0, 0.0)?;
        least("diameter", self.diameter, 0.0)?;
        least("solid_fraction", self.solid_fraction, 0.0)?;
        if self.solid_fraction > 1.0 {
            return Err(format!(
                "key `solid_fraction` = {} is not allowed; allowed: (0, 1]",
                self.solid_fraction
            ));
        }
        if let Some(law) = &self.solid_fraction_of_i {
            let range = 0.0..=1.0;
            if !(range.contains(&law.intercept) && law.slope.is_finite()) {
                return Err(format!(
                    "key `solid_fraction_of_i`: intercept = {}, slope = {} is not allowed; allowed: an intercept in [0, 1], a finite slope",
                    law.intercept, law.slope
                ));
            }
        }
        if let Some(density) = self.grain_density {
            least("grain_density", density, 0.0)?;
        }
        if let Some([low, high]) = self.valid_i
            && !(low >= 0.0 && high > low && high.is_finite())
        {
            return Err(format!(
                "key `valid_i` = [{low}, {high}] is not allowed; allowed: [low, high] with 0 <= low < high"
            ));
        }
        // The ranges of the scene's own keys, so that what is written here can be read there.
        let mut table = Table::new();
        table.insert("rheology".into(), Value::Table(self.scene_keys("a fit")));
        check_continuum_keys(&table, "as a scene").map_err(|error| error.to_string())
    }

    /// The file's text.
    pub fn to_toml(&self) -> Result<String, Failure> {
        let body = toml_text("the law", self)?;
        Ok(format!(
            "# μ(I) law fitted by colluvium calibrate. SI units.\n\
             # μ = |τ|/p with p = trace/3; [mu_zz] holds the fit for |τ|/σ_zz instead.\n\
             # Outside valid_i (inertial numbers) the law was not measured.\n\
             # [solid_fraction_of_i]: phi = intercept - slope I.\n{body}"
        ))
    }

    /// The keys of a scene's `rheology` table.
    fn scene_keys(&self, source: &str) -> Table {
        let mut keys = Table::new();
        let mut put = |key: &str, value: Value| keys.insert(key.to_owned(), value);
        put("mu_s", Value::Float(self.mu_s));
        put("mu_2", Value::Float(self.mu_2));
        put("i_0", Value::Float(self.i_0));
        put("diameter", Value::Float(self.diameter));
        put("solid_fraction", Value::Float(self.solid_fraction));
        if let Some(density) = self.grain_density {
            put("grain_density", Value::Float(density));
        }
        if let Some(range) = self.valid_i {
            put("valid_i", Value::Array(range.map(Value::Float).to_vec()));
        }
        if let Some(points) = &self.table {
            let rows = points.iter();
            let rows = rows.map(|p| Value::Array(p.map(Value::Float).to_vec()));
            put("table", Value::Array(rows.collect()));
        }
        for (key, value) in [("identified", self.identified), ("good", self.good)] {
            if let Some(value) = value {
                put(key, Value::Boolean(value));
            }
        }
        put("source", Value::String(source.to_owned()));
        keys
    }
}

/// Puts the numbers of the file in the place of `rheology.file`, or those of a place on a map in the place of
/// `rheology.from`; gives the file's path.
///
/// The resolved scene then stands alone: it can be run again when the file has gone.
pub fn resolve(table: &mut Table, friction: FrictionOf) -> Result<Option<PathBuf>, SceneError> {
    let Some(Value::Table(rheology)) = table.get_mut("rheology") else {
        return Ok(None);
    };
    let place = rheology.remove("from");
    let on_a_map = place.is_some();
    let (mut law, path, mut source) = match (rheology.remove("file"), place) {
        (Some(Value::String(path)), _) => {
            let law = RheologyFile::read(Path::new(&path))?;
            (law, Some(PathBuf::from(&path)), path)
        }
        (_, Some(Value::Table(place))) => on_map(&place)?,
        _ => return Ok(None),
    };
    if friction == FrictionOf::NormalStress && law.mu_zz.is_some() {
        law = law
            .against_normal_stress()
            .map_err(|message| SceneError::Rheology {
                path: source.clone(),
                message: format!("[mu_zz]: {message}"),
            })?;
        source.push_str(", friction and I against sigma_zz");
    }
    let mut keys = law.scene_keys(&source);
    // Grains of another size obey the same law: a map's numbers give way to what is written beside it.
    if on_a_map {
        keys.retain(|key, _| !rheology.contains_key(key));
    }
    rheology.extend(keys);
    Ok(path)
}

/// The law at a place on a map, the map's file if it is not the bundled one, and where the law is from.
fn on_map(place: &Table) -> Result<(RheologyFile, Option<PathBuf>, String), SceneError> {
    let number = |key: &str| match place.get(key) {
        Some(Value::Float(x)) => *x,
        Some(Value::Integer(n)) => *n as f64,
        _ => f64::NAN,
    };
    let path = place.get("map").and_then(Value::as_str).map(PathBuf::from);
    let (beta, mu_r) = (number("beta"), number("mu_r"));
    let named = || path.as_ref().map(|path| path.display().to_string());
    let fail = |message: String| SceneError::Rheology {
        path: named().unwrap_or_else(|| "the bundled map".into()),
        message: format!("rheology.from: {message}"),
    };
    let map = match &path {
        Some(path) => MapFile::read(path)?,
        None => MapFile::bundled()?,
    };
    let law = map
        .rheology(beta, mu_r)
        .map_err(|error| fail(error.to_string()))?;
    law.check().map_err(fail)?;
    let told = law.provenance.as_ref().map(|p| p.scene.clone());
    let told = told.unwrap_or_default();
    let with = |value: f64, error: Option<f64>| format!("{value:.3} ± {:.3}", error.unwrap_or(0.0));
    let source = format!(
        "{told}: mu_s {}, mu_2 {}, I_0 {}",
        with(law.mu_s, law.mu_s_error),
        with(law.mu_2, law.mu_2_error),
        with(law.i_0, law.i_0_error)
    );
    Ok((law, path, source))
}

/// Makes the path of a rheology file in a scene file relative to that file's folder, unless it is the name of a bundled
/// law.
pub fn anchor(table: &mut Table, folder: &Path) {
    let named = layers::get(table, "rheology.file").and_then(Value::as_str);
    let bundled = named.is_some_and(|path| BUNDLED.iter().any(|(name, _)| *name == path));
    if !bundled || named.is_some_and(|path| folder.join(path).exists()) {
        layers::anchor_path(table, "rheology.file", folder);
    }
    layers::anchor_path(table, "rheology.from.map", folder);
}

/// Removes from a layer what it says about its law where the layer above gives other numbers: the
/// range and the verdict belong to the fit, the source to all its numbers.
pub fn drop_stale_notes(below: &mut Table, above: &Table) {
    let Some(Value::Table(above)) = above.get("rheology") else {
        return;
    };
    let Some(Value::Table(below)) = below.get_mut("rheology") else {
        return;
    };
    let law = ["mu_s", "mu_2", "i_0", "table"];
    let grains = ["diameter", "solid_fraction", "grain_density"];
    let changes = |keys: &[&str]| keys.iter().any(|k| above.contains_key(*k));
    if changes(&law) {
        for key in ["valid_i", "identified", "good"] {
            below.remove(key);
        }
    }
    if changes(&law) || changes(&grains) {
        below.remove("source");
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn law(mu_s: f64, mu_2: f64, i_0: f64) -> RheologyFile {
        toml::from_str(&format!(
            "mu_s = {mu_s:e}\nmu_2 = {mu_2:e}\ni_0 = {i_0:e}\ndiameter = 0.01\nsolid_fraction = 0.5\n"
        ))
        .unwrap()
    }

    #[test]
    fn a_law_that_can_be_written_can_be_read() {
        // A fit whose μ_2 and I_0 run away together is still a law.
        assert_eq!(law(0.5, 40.0, 1e3).check(), Ok(()));
        for bad in [law(-0.1, 0.8, 0.3), law(0.5, 0.4, 0.3), law(0.5, 1e9, 0.3)] {
            assert!(bad.check().is_err(), "{bad:?}");
        }
        let again: RheologyFile = toml::from_str(&law(0.5, 40.0, 1e3).to_toml().unwrap()).unwrap();
        assert_eq!(again, law(0.5, 40.0, 1e3));
    }
}
