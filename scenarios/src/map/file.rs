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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{Scene, SceneBody};
    use colluvium_coupling::calibration::{Curve, WithError, mu_of_i};

    /// A map of two by two whose laws are made up.
    fn made_up() -> MapFile {
        let i = [0.1, 0.25, 0.5];
        let mut cell = Vec::new();
        for (beta, mu_s, repose) in [(0.1, 0.45, 25.0), (1.0, 0.75, 38.0)] {
            for (mu_r, more) in [(0.5, 0.0), (2.0, 0.03)] {
                let law = |zz: f64| Curve {
                    friction: i.map(|i| mu_of_i(mu_s + more - zz, 0.95 - zz, 0.4, i)),
                    covariance: [[1e-6, 0.0, 0.0], [0.0, 1e-6, 0.0], [0.0, 0.0, 1e-6]],
                };
                let number = |value, error| WithError { value, error };
                cell.push(MapCell {
                    beta,
                    mu_r,
                    curve: law(0.0),
                    curve_zz: Some(law(0.04)),
                    repose: number(repose + 30.0 * more, 0.5),
                    solid_fraction: number(0.5, 0.002),
                    valid_i: [0.05, 0.8],
                });
            }
        }
        MapFile {
            inertial_numbers: i,
            diameter: 0.01,
            grain_density: 2500.0,
            version: "0".into(),
            measured: "made up".into(),
            interpolation_error: FrictionMap::new(i, cell.clone()).unwrap().error(),
            cell,
        }
    }

    #[test]
    fn a_map_in_a_file_gives_laws_inside_and_refuses_places_outside() {
        let file = made_up();
        let again: MapFile = toml::from_str(&file.to_toml().unwrap()).unwrap();
        assert_eq!(again, file);
        for (beta, mu_r) in [(0.1, 0.5), (1.0, 2.0), (0.3, 1.0)] {
            let law = file.rheology(beta, mu_r).unwrap();
            assert_eq!(law.check(), Ok(()));
            assert!(law.mu_s_error.unwrap() > 0.0 && law.covariance.is_some());
        }
        let why = file.rheology(3.0, 1.05).unwrap_err().to_string();
        assert!(
            why.contains("beta = 3") && why.contains("[0.1, 1]"),
            "{why}"
        );
    }

    #[test]
    fn a_scene_takes_its_law_from_a_place_on_a_map() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("map.toml");
        std::fs::write(&path, made_up().to_toml().unwrap()).unwrap();
        let from = |beta: f64| {
            format!(
                "rheology.from={{beta={beta:?}, mu_r=1.0, map=\"{}\"}}",
                path.display()
            )
        };
        let load = |scene: &str, more: &[String]| Scene::load(scene, more);
        let scene = load("bagnold", &[from(0.3)]).unwrap();
        let SceneBody::Bagnold(body) = &scene.body else {
            panic!("{}", scene.name)
        };
        let law = made_up().rheology(0.3, 1.0).unwrap();
        assert_eq!(body.rheology.mu_s, Some(law.mu_s));
        assert_eq!(body.rheology.solid_fraction, 0.5);
        assert_eq!(body.rheology.valid_i, Some(vec![0.05, 0.8]));
        let source = body.rheology.source.clone().unwrap();
        assert!(
            source.contains("angle of repose 31.7") && source.contains('±'),
            "{source}"
        );
        // The resolved scene stands alone, and another size of grains is no other law.
        let text = scene.to_toml().unwrap();
        assert!(!text.contains("from"), "{text}");
        let set = [from(0.3), "rheology.diameter=0.002".to_owned()];
        let finer = load("bagnold", &set).unwrap();
        let SceneBody::Bagnold(body) = &finer.body else {
            panic!("{}", finer.name)
        };
        assert_eq!(
            (body.rheology.mu_s, body.rheology.diameter),
            (Some(law.mu_s), 0.002)
        );
        // Outside, two sources of one number, a misspelt key.
        let refused = |more: &[String]| load("bagnold", more).unwrap_err().to_string();
        let why = refused(&[from(1.5)]);
        assert!(
            why.contains("beta = 1.5") && why.contains("map.toml"),
            "{why}"
        );
        let why = refused(&[from(0.3), "rheology.mu_s=0.4".to_owned()]);
        assert!(why.contains("rheology.from"), "{why}");
        let why = refused(&["rheology.from={beta=0.3, mu_R=1.0}".to_owned()]);
        assert!(why.contains("mu_R") || why.contains("mu_r"), "{why}");
    }

    /// The map in `rheologies/`: sound, and near the campaigns of other beds that are no part of it.
    #[test]
    fn the_measured_map_is_near_campaigns_that_are_no_part_of_it() {
        let file = MapFile::bundled().unwrap();
        assert!(file.interpolation_error.friction.iter().all(|e| *e > 0.0));
        for cell in &file.cell {
            assert_eq!(file.rheology(cell.beta, cell.mu_r).unwrap().check(), Ok(()));
        }
        let moderate = RheologyFile::read(Path::new("moderate")).unwrap();
        let law = file.rheology(0.2, 1.05).unwrap();
        for (i, error) in file
            .inertial_numbers
            .iter()
            .zip(file.interpolation_error.friction)
        {
            let friction = |f: &RheologyFile| mu_of_i(f.mu_s, f.mu_2, f.i_0, *i);
            let off = friction(&law) - friction(&moderate);
            println!("β 0.2, μ_R 1.05, I {i}: map less campaign {off:+.4}, error told {error:.4}");
            assert!(off.abs() < 2.5 * error, "{off} {error}");
        }
    }

    #[test]
    fn a_file_that_is_no_map_is_refused_with_its_name() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("map.toml");
        std::fs::write(&path, "inertial_numbers = [0.1, 0.2]\n").unwrap();
        let why = MapFile::read(&path).unwrap_err().to_string();
        assert!(why.contains("map.toml"), "{why}");
        let why = MapFile::read(&folder.path().join("none.toml"));
        assert!(why.unwrap_err().to_string().contains("none.toml"));
    }
}
