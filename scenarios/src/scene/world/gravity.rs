//! `[gravity]`: uniform, in time, of a heavy sphere, of the grains themselves.

use super::{Place, Triple};
use crate::failure::Failure;
use crate::scene::SceneError;
use colluvium_dem::{GRAVITATION, HeavySphere, Schedule, SelfGravity};
use nalgebra::Vector3;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::path::Path;

/// What pulls the grains.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct GravityKeys {
    /// Uniform acceleration (m/s²); left out: none.
    pub uniform: Triple,
    /// Uniform acceleration in time: rows of t (s) and its three components (m/s²), straight lines
    /// between them.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub schedule: Option<Vec<[f64; 4]>>,
    /// The same from a CSV file with the columns t, gx, gy, gz.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub file: Option<String>,
    /// A heavy sphere, or a point mass.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub sphere: Option<HeavySphereKeys>,
    /// Attraction of the grains by each other.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub own: Option<SelfGravityKeys>,
}

/// A heavy sphere that nothing moves.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct HeavySphereKeys {
    /// Its centre (m).
    pub center: Triple,
    /// G M (m³/s²).
    #[schemars(extend("exclusiveMinimum" = 0.0, "maximum" = 1.0e20))]
    pub parameter: f64,
    /// Its radius (m), 0 for a point.
    #[schemars(extend("minimum" = 0.0, "maximum" = 1.0e9))]
    pub radius: f64,
}

/// Attraction of all grains by each other.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SelfGravityKeys {
    /// G (m³/(kg s²)); left out: Newton's.
    #[serde(default = "newton")]
    #[schemars(extend("exclusiveMinimum" = 0.0, "maximum" = 1.0e6))]
    pub constant: f64,
    /// Opening angle of the tree; 0 sums over all pairs.
    #[serde(default = "opening")]
    #[schemars(extend("minimum" = 0.0, "maximum" = 0.9))]
    pub opening: f64,
}

fn newton() -> f64 {
    GRAVITATION
}

fn opening() -> f64 {
    SelfGravity::newton().opening
}

impl GravityKeys {
    /// Uniform acceleration at the start (m/s²).
    pub fn start(&self, origin: &str) -> Result<Vector3<f64>, Failure> {
        Ok(match self.schedule(origin)? {
            Some(schedule) => schedule.at(0.0),
            None => self.uniform.into(),
        })
    }

    /// Uniform acceleration in time, where it changes.
    pub fn schedule(&self, origin: &str) -> Result<Option<Schedule>, Failure> {
        let at = Place {
            origin,
            section: "gravity",
        };
        let rows = match (&self.schedule, &self.file) {
            (Some(_), Some(_)) => {
                return Err(SceneError::Conflict {
                    file: origin.to_owned(),
                    first: "gravity.schedule".into(),
                    second: "gravity.file".into(),
                }
                .into());
            }
            (Some(rows), None) => rows.clone(),
            (None, Some(file)) => read(file, at)?,
            (None, None) => return Ok(None),
        };
        let points = rows
            .into_iter()
            .map(|[t, x, y, z]| (t, Vector3::new(x, y, z)));
        let schedule = Schedule::new(points.collect())
            .map_err(|error| Failure::Input(format!("{origin}: {error}")))?;
        Ok(Some(schedule))
    }

    /// The heavy sphere, if there is one.
    pub fn sphere(&self) -> Option<HeavySphere> {
        self.sphere.as_ref().map(|keys| HeavySphere {
            center: keys.center.into(),
            parameter: keys.parameter,
            radius: keys.radius,
        })
    }

    /// Attraction by each other, if there is any.
    pub fn own(&self) -> Option<SelfGravity> {
        self.own.as_ref().map(|keys| SelfGravity {
            constant: keys.constant,
            opening: keys.opening,
        })
    }
}

/// Rows of a CSV file with a time and three columns.
pub(super) fn read_rows(file: &str, columns: [&str; 4]) -> Result<Vec<[f64; 4]>, String> {
    let table = crate::table::Table::from_csv(Path::new(file)).map_err(|e| e.to_string())?;
    let column = |name: &str| -> Result<&[f64], String> {
        match table.column(name) {
            [] => Err(format!("no column `{name}`, or nothing in it")),
            values => Ok(values),
        }
    };
    let [t, x, y, z] = [
        column(columns[0])?,
        column(columns[1])?,
        column(columns[2])?,
        column(columns[3])?,
    ];
    let rows: Vec<[f64; 4]> = (0..t.len()).map(|k| [t[k], x[k], y[k], z[k]]).collect();
    match rows
        .iter()
        .position(|row| row.iter().any(|x| !x.is_finite()))
    {
        Some(k) => Err(format!("row {} is not four numbers", k + 1)),
        None => Ok(rows),
    }
}

fn read(file: &str, at: Place) -> Result<Vec<[f64; 4]>, SceneError> {
    read_rows(file, ["t", "gx", "gy", "gz"]).map_err(|why| {
        at.refuse(
            "file",
            file,
            format!("a CSV file with the columns t, gx, gy, gz ({why})"),
        )
    })
}
