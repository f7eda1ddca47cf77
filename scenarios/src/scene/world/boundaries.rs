//! `[boundaries]`: the box, its periodic axes, how it moves, and where grains leave the world.

use super::gravity::read_rows;
use super::{Place, RegionKeys, Triple, region};
use crate::scene::SceneError;
use colluvium_dem::{BoxMotion, Domain, Edge, Outlet, StressServo};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// The box that grains live in.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct BoundaryKeys {
    /// Lower corner (m). Only periodic axes are held in.
    pub lower: Triple,
    /// Upper corner (m).
    pub upper: Triple,
    /// Which axes wrap around; left out: none.
    #[serde(default)]
    pub periodic: [bool; 3],
    /// How a periodic box moves; left out: it rests.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub motion: Option<BoxMotionKeys>,
    /// Where grains may be; what leaves it is taken out.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub outlet: Option<OutletKeys>,
}

/// Ways in which a periodic box moves.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum BoxMotionKind {
    /// Edges grow at `speeds`.
    Stretch,
    /// Lengths of the edges follow a `file`.
    Table,
    /// All edges follow `pressure`.
    Servo,
    /// Planes across y or z slide along x at a shear `rate`.
    Shear,
}

/// Motion of a periodic box.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct BoxMotionKeys {
    /// Which way.
    pub kind: BoxMotionKind,
    /// Speeds at which the edges grow (m/s), of stretch.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub speeds: Option<Triple>,
    /// CSV file of table with the columns t, x, y, z (s, m): rising times, lengths of the edges, straight lines between
    /// them.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub file: Option<String>,
    /// Pressure wanted (Pa), of servo.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub pressure: Option<f64>,
    /// Largest rate of strain of servo, rate of shear (1/s).
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub rate: Option<f64>,
    /// Steps between two looks at the stress, of servo; left out: 20.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend("minimum" = 1, "maximum" = 1000000))]
    pub every: Option<u64>,
    /// Axis across which the box is sheared: 1 is y, 2 is z; left out: 2.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend("minimum" = 1, "maximum" = 2))]
    pub across: Option<usize>,
    /// Whether grains are carried where the rate changes, of stretch, table and shear; left out: yes.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub carry: Option<bool>,
}

/// Where grains may be.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct OutletKeys {
    /// Grains whose centre leaves it are taken out: where all of these are.
    pub keep: Vec<RegionKeys>,
    /// Steps between two looks; left out: 100.
    #[serde(default = "hundred")]
    #[schemars(extend("minimum" = 1, "maximum" = 1000000))]
    pub every: u64,
}

fn hundred() -> u64 {
    100
}

impl BoundaryKeys {
    /// The box.
    pub fn domain(&self, origin: &str) -> Result<Domain, SceneError> {
        let at = Place {
            origin,
            section: "boundaries",
        };
        for k in 0..3 {
            if self.upper[k] <= self.lower[k] {
                let range = format!("above {}, the lower corner's", self.lower[k]);
                return Err(at.refuse(&format!("upper[{k}]"), self.upper[k], range));
            }
        }
        Ok(Domain {
            lower: self.lower.into(),
            upper: self.upper.into(),
            periodic: self.periodic,
        })
    }

    /// The box's motion.
    pub fn motion(&self, origin: &str) -> Result<BoxMotion, SceneError> {
        let at = Place {
            origin,
            section: "boundaries.motion",
        };
        let Some(keys) = &self.motion else {
            return Ok(BoxMotion::Rest);
        };
        keys.check_unread(at)?;
        Ok(match keys.kind {
            BoxMotionKind::Stretch => BoxMotion::Stretch {
                edges: at
                    .need(&keys.speeds, "speeds", "three speeds in m/s")?
                    .map(|v| if v == 0.0 { Edge::Rest } else { Edge::Speed(v) }),
                carry: keys.carry.unwrap_or(true),
            },
            BoxMotionKind::Table => BoxMotion::Stretch {
                edges: self.edges(keys, at)?,
                carry: keys.carry.unwrap_or(true),
            },
            BoxMotionKind::Servo => BoxMotion::Servo(StressServo {
                pressure: at.need(&keys.pressure, "pressure", "Pa")?,
                rate: at.need(&keys.rate, "rate", "1/s")?,
                every: keys.every.unwrap_or(20),
            }),
            BoxMotionKind::Shear => BoxMotion::Shear {
                across: keys.across.unwrap_or(2),
                rate: at.need(&keys.rate, "rate", "1/s")?,
                carry: keys.carry.unwrap_or(true),
            },
        })
    }

    /// Lengths of the edges from a file.
    fn edges(&self, keys: &BoxMotionKeys, at: Place) -> Result<[Edge; 3], SceneError> {
        let file = at.need(&keys.file, "file", "a CSV file")?;
        let rows = read_rows(&file, ["t", "x", "y", "z"]).map_err(|why| {
            let range = format!("a CSV file with the columns t, x, y, z ({why})");
            at.refuse("file", &file, range)
        })?;
        for (k, axis) in ["x", "y", "z"].iter().enumerate() {
            let (length, first) = (self.upper[k] - self.lower[k], rows[0][k + 1]);
            if (first / length - 1.0).abs() > 1e-9 {
                let range = format!(
                    "a file whose first row has the lengths of the box: {axis} is {first}, not {length}"
                );
                return Err(at.refuse("file", &file, range));
            }
        }
        Ok([0, 1, 2].map(|k| {
            let length = self.upper[k] - self.lower[k];
            let stays = |row: &[f64; 4]| (row[k + 1] / length - 1.0).abs() < 1e-12;
            if rows.iter().all(stays) {
                return Edge::Rest;
            }
            Edge::Lengths(rows.iter().map(|row| (row[0], row[k + 1])).collect())
        }))
    }

    /// Where grains may be.
    pub fn outlet(&self, origin: &str) -> Result<Option<Outlet>, SceneError> {
        let Some(keys) = &self.outlet else {
            return Ok(None);
        };
        let at = Place {
            origin,
            section: "boundaries.outlet.keep",
        };
        Ok(Some(Outlet {
            keep: region(&keys.keep, at)?,
            every: keys.every,
        }))
    }
}

impl BoxMotionKeys {
    fn check_unread(&self, at: Place) -> Result<(), SceneError> {
        use BoxMotionKind::{Servo, Shear, Stretch, Table};
        let only = |given: bool, kinds: &[BoxMotionKind]| given && !kinds.contains(&self.kind);
        at.unread(
            &[
                ("speeds", only(self.speeds.is_some(), &[Stretch])),
                ("file", only(self.file.is_some(), &[Table])),
                ("pressure", only(self.pressure.is_some(), &[Servo])),
                ("rate", only(self.rate.is_some(), &[Servo, Shear])),
                ("every", only(self.every.is_some(), &[Servo])),
                ("across", only(self.across.is_some(), &[Shear])),
                (
                    "carry",
                    only(self.carry.is_some(), &[Stretch, Table, Shear]),
                ),
            ],
            &format!("a box motion of the kind {:?}", self.kind).to_lowercase(),
        )
    }
}
