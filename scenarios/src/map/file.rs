//! `map.toml`: laws and angles of repose on a grid of β and μ_R, with where they come from.

use crate::failure::Failure;
use crate::rheology_file::{FitRow, Provenance, RheologyFile};
use crate::run_directory::unwritten;
use crate::scene::SceneError;
use colluvium_coupling::calibration::{FrictionMap, InterpolationError, MapCell, MapError};
use serde::{Deserialize, Serialize};
use std::path::Path;

/// A map as it stands in a file; SI units.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct MapFile {
    /// Inertial numbers at which the curves μ(I) of the cells are given.
    pub inertial_numbers: [f64; 3],
    /// Diameter of the grains (m).
    pub diameter: f64,
    /// Their density (kg/m³).
    pub grain_density: f64,
    /// Version that measured the map.
    pub version: String,
    /// How it was measured.
    pub measured: String,
    /// What the interpolation misses, root mean square: grid points left out, or campaigns off the grid. The larger of this
    /// and of what the cells tell counts.
    pub interpolation_error: InterpolationError,
    /// The campaigns.
    pub cell: Vec<MapCell>,
}

/// The map that comes with the program: what `rheology.from` reads where it names no map of its own.
const BUNDLED: &str = include_str!("../../rheologies/map.toml");

impl MapFile {
    /// The map that comes with the program.
    pub fn bundled() -> Result<MapFile, SceneError> {
        toml::from_str(BUNDLED).map_err(|error| SceneError::Rheology {
            path: "the bundled map".into(),
            message: error.to_string().trim().to_owned(),
        })
    }

    /// Reads a file.
    pub fn read(path: &Path) -> Result<MapFile, SceneError> {
        let fail = |message: String| SceneError::Rheology {
            path: path.display().to_string(),
            message,
        };
        let text = std::fs::read_to_string(path)
            .map_err(|error| fail(format!("cannot read the file: {error}")))?;
        toml::from_str(&text).map_err(|error| fail(error.to_string().trim().to_owned()))
    }

    /// The map itself.
    pub fn map(&self) -> Result<FrictionMap, MapError> {
        let map = FrictionMap::new(self.inertial_numbers, self.cell.clone())?;
        Ok(map.with_error(self.interpolation_error))
    }

    /// The law at a place, as a rheology with errors.
    pub fn rheology(&self, beta: f64, mu_r: f64) -> Result<RheologyFile, MapError> {
        let map = self.map()?;
        let found = map.at(beta, mu_r)?;
        let unknown = map.error().friction == [0.0; 3];
        let error = |c: &[[f64; 3]; 3], k: usize| c[k][k].max(0.0).sqrt();
        let [mu_s, mu_2, i_0] = found.law;
        let known = |value: f64, error: f64| error < 0.5 * value.abs();
        let identified = (0..3).all(|k| known(found.law[k], error(&found.covariance, k)));
        let source = format!(
            "the map at beta = {beta}, mu_r = {mu_r}{}; angle of repose {:.1} ± {:.1} degrees",
            if unknown {
                " (error of the interpolation not known)"
            } else {
                ""
            },
            found.repose.value,
            found.repose.error
        );
        Ok(RheologyFile {
            mu_s,
            mu_s_error: Some(error(&found.covariance, 0)),
            mu_2,
            mu_2_error: Some(error(&found.covariance, 1)),
            i_0,
            i_0_error: Some(error(&found.covariance, 2)),
            diameter: self.diameter,
            solid_fraction: found.solid_fraction.value,
            solid_fraction_error: Some(found.solid_fraction.error),
            solid_fraction_of_i: None,
            grain_density: Some(self.grain_density),
            valid_i: Some(found.valid_i),
            table: None,
            identified: Some(identified),
            good: None,
            covariance: Some(found.covariance),
            mu_zz: found.law_zz.map(|([mu_s, mu_2, i_0], c)| FitRow {
                mu_s,
                mu_s_error: error(&c, 0),
                mu_2,
                mu_2_error: error(&c, 1),
                i_0,
                i_0_error: error(&c, 2),
            }),
            provenance: Some(Provenance {
                version: self.version.clone(),
                scene: source,
                flow_degrees: Vec::new(),
                seed: 0,
                friction: "|tau|/p, p = trace/3".into(),
                verdict: self.measured.clone(),
            }),
        })
    }

    /// The file's text.
    pub fn to_toml(&self) -> Result<String, Failure> {
        let body = toml::to_string(self).map_err(|error| unwritten("the map", error))?;
        Ok(format!(
            "# Laws and angles of repose by the contact law's beta and mu_R, measured by colluvium map. SI units, degrees.\n\
             # friction: mu at the three inertial_numbers; curve: |tau|/p with p = trace/3; curve_zz: |tau|/sigma_zz.\n{body}"
        ))
    }
}
