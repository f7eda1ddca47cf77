//! How grains are put in place: `[[prepare]]`, one step after the other.

use super::gravity::read_rows;
use super::{Place, RegionKeys, Triple, region};
use crate::scene::SceneError;
use colluvium_dem::Region;
use colluvium_dem::preparation::{Amount, Growth};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// What a step does.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum PrepareKind {
    /// Loose grains at random places `within`, none touching another.
    Insert,
    /// Grains at given `points`, or where the rows of a `file` have them.
    Put,
    /// Grains poured from `within` between the walls, until they rest.
    Pour,
    /// Everything comes to rest between the walls.
    Relax,
    /// Rest under each of `gravities` in turn, with its own stiffness and step.
    Stages,
    /// A cloud pulled to `point` until it has a `solid_fraction` in a ball of `radius`.
    Compact,
    /// A jammed packing of `count` grains in a periodic cube; the box becomes that cube.
    Jam,
    /// A ballistic aggregate of `count` grains about the origin.
    Grow,
    /// Grains outside `within` are taken away.
    Trim,
    /// Grains `within` are fixed.
    Glue,
    /// All lengths are multiplied by `factor`.
    Scale,
    /// Grains are turned about the origin and moved to `point`.
    Place,
}

/// A step of a preparation; which keys are read is its kind's.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct PrepareKeys {
    /// What it does.
    pub r#do: PrepareKind,
    /// Where: where all of these are.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub within: Vec<RegionKeys>,
    /// Clumps that insert and pour put in, by their name in `[clumps]`; left out: grains.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub clumps: Option<String>,
    /// Grains of insert, pour, jam and grow; clumps of insert and pour, where they are of `clumps`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend("minimum" = 1, "maximum" = 20000000))]
    pub count: Option<usize>,
    /// Centres of grains of put (m).
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub points: Option<Vec<Triple>>,
    /// Their radii (m); left out: the mean of their kind's law.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub radii: Option<Vec<f64>>,
    /// CSV file of put with the columns radius, x, y, z (m).
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub file: Option<String>,
    /// Kind of the grains of put; left out: the first.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub material: Option<String>,
    /// Solid fraction of insert, compact.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend("exclusiveMinimum" = 0.0, "maximum" = 0.75))]
    pub solid_fraction: Option<f64>,
    /// Mass of insert and pour (kg).
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend("exclusiveMinimum" = 0.0, "maximum" = 1.0e15))]
    pub mass: Option<f64>,
    /// Velocity of insert, put and pour (m/s); left out: at rest.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub velocity: Option<Triple>,
    /// Time from batch to batch of pour (s); left out: in which grains leave the source.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend("exclusiveMinimum" = 0.0, "maximum" = 1.0e9))]
    pub interval: Option<f64>,
    /// Magnitudes of gravity of stages (m/s²).
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub gravities: Option<Vec<f64>>,
    /// Centre of compact, place of place (m); left out: the origin.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub point: Option<Triple>,
    /// Ball in which compact measures (m).
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend("exclusiveMinimum" = 0.0, "maximum" = 1.0e6))]
    pub radius: Option<f64>,
    /// First and largest acceleration of compact (m/s²).
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub accelerations: Option<[f64; 2]>,
    /// Relative tolerance of compact; left out: 0.02.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend("exclusiveMinimum" = 0.0, "maximum" = 0.2))]
    pub tolerance: Option<f64>,
    /// Damping of relax, pour, stages, compact over √(a/d); left out: 0.5, in stages 0.2.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend("minimum" = 0.0, "maximum" = 100.0))]
    pub damping: Option<f64>,
    /// Longest time of relax, pour, stages, compact in √(d/a); left out: 1000.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend("exclusiveMinimum" = 0.0, "maximum" = 1.0e6))]
    pub patience: Option<f64>,
    /// How grow grows; left out: cluster by cluster.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub growth: Option<GrowthKind>,
    /// Whether trim keeps whole grains only; left out: those whose centres lie within.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub whole: Option<bool>,
    /// Factor of scale.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend("exclusiveMinimum" = 0.0, "maximum" = 1.0e9))]
    pub factor: Option<f64>,
    /// Turn of place: a vector along the axis, its length the angle (degrees).
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub turn_degrees: Option<Triple>,
    /// Friction of all contacts during this step, instead of the scene's own.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend("minimum" = 0.0, "maximum" = 10.0))]
    pub friction: Option<f64>,
}

/// Ways in which aggregates grow.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum GrowthKind {
    /// Equal clusters meet (BCCA).
    ClusterCluster,
    /// Single grains meet one cluster (BPCA).
    ParticleCluster,
}

/// A step with what it needs.
#[derive(Clone, Debug, PartialEq)]
pub struct PrepareStep<'a> {
    /// The keys.
    pub keys: &'a PrepareKeys,
    /// Where.
    pub region: Region,
    /// How much, of insert and pour.
    pub amount: Option<Amount>,
}

impl PrepareKeys {
    /// Checks a step and what it needs.
    pub fn step(&self, at: Place) -> Result<PrepareStep<'_>, SceneError> {
        use PrepareKind::{
            Compact, Glue, Grow, Insert, Jam, Place as Move, Pour, Put, Relax, Scale, Stages, Trim,
        };
        let kind = self.r#do;
        let within = format!("{}.within", at.section);
        let region = region(
            &self.within,
            Place {
                section: &within,
                ..at
            },
        )?;
        let bounded = [Insert, Pour, Trim, Glue];
        if bounded.contains(&kind) && self.within.is_empty() {
            return Err(at.missing("within", "a list of regions"));
        }
        let amounts = [
            self.count.map(Amount::Grains),
            self.solid_fraction.map(Amount::SolidFraction),
            self.mass.map(Amount::Mass),
        ];
        let mut amount = None;
        if self.clumps.is_some() && [Insert, Pour].contains(&kind) {
            at.need(&self.count, "count", "a number of clumps")?;
            at.unread(
                &[
                    ("solid_fraction", self.solid_fraction.is_some()),
                    ("mass", self.mass.is_some()),
                ],
                "a step with `clumps`, which asks for their count",
            )?;
        }
        if [Insert, Pour].contains(&kind) {
            let mut given = amounts.into_iter().flatten();
            amount = given.next();
            if amount.is_none() || given.next().is_some() {
                let wanted = "exactly one of count, solid_fraction, mass";
                return Err(at.missing("count", wanted));
            }
        }
        if [Jam, Grow].contains(&kind) {
            at.need(&self.count, "count", "a number of grains")?;
        }
        if kind == Put {
            self.places(at)?;
        }
        if kind == Compact {
            at.need(&self.solid_fraction, "solid_fraction", "in (0, 0.75]")?;
            at.need(&self.radius, "radius", "of the ball it is measured in, m")?;
            at.need(
                &self.accelerations,
                "accelerations",
                "the first and the largest, m/s²",
            )?;
        }
        if kind == Stages {
            at.need(&self.gravities, "gravities", "a list in m/s²")?;
        }
        if kind == Scale {
            at.need(&self.factor, "factor", "above 0")?;
        }
        let only = |given: bool, kinds: &[PrepareKind]| given && !kinds.contains(&kind);
        let moving = [Relax, Pour, Stages, Compact];
        at.unread(
            &[
                ("within", only(!self.within.is_empty(), &bounded)),
                (
                    "count",
                    only(self.count.is_some(), &[Insert, Pour, Jam, Grow]),
                ),
                (
                    "solid_fraction",
                    only(self.solid_fraction.is_some(), &[Insert, Pour, Compact]),
                ),
                ("mass", only(self.mass.is_some(), &[Insert, Pour])),
                ("clumps", only(self.clumps.is_some(), &[Insert, Pour])),
                (
                    "velocity",
                    only(self.velocity.is_some(), &[Insert, Put, Pour]),
                ),
                ("points", only(self.points.is_some(), &[Put])),
                ("radii", only(self.radii.is_some(), &[Put])),
                ("file", only(self.file.is_some(), &[Put])),
                ("material", only(self.material.is_some(), &[Put])),
                ("interval", only(self.interval.is_some(), &[Pour])),
                ("gravities", only(self.gravities.is_some(), &[Stages])),
                ("point", only(self.point.is_some(), &[Compact, Move])),
                ("radius", only(self.radius.is_some(), &[Compact])),
                (
                    "accelerations",
                    only(self.accelerations.is_some(), &[Compact]),
                ),
                ("tolerance", only(self.tolerance.is_some(), &[Compact])),
                ("damping", only(self.damping.is_some(), &moving)),
                ("patience", only(self.patience.is_some(), &moving)),
                ("growth", only(self.growth.is_some(), &[Grow])),
                ("whole", only(self.whole.is_some(), &[Trim])),
                ("factor", only(self.factor.is_some(), &[Scale])),
                ("turn_degrees", only(self.turn_degrees.is_some(), &[Move])),
                ("friction", only(self.friction.is_some(), &moving)),
            ],
            &format!("the step {kind:?}").to_lowercase(),
        )?;
        Ok(PrepareStep {
            keys: self,
            region,
            amount,
        })
    }

    /// Where put puts grains: centres (m), with radii (m) where they are given.
    pub fn places(&self, at: Place) -> Result<Vec<(Triple, Option<f64>)>, SceneError> {
        let places: Vec<(Triple, Option<f64>)> = match (&self.points, &self.file) {
            (Some(_), Some(_)) => {
                return Err(SceneError::Conflict {
                    file: at.origin.to_owned(),
                    first: at.key("points"),
                    second: at.key("file"),
                });
            }
            (None, None) => return Err(at.missing("points", "centres of grains in m, or a file")),
            (None, Some(file)) => {
                at.unread(&[("radii", self.radii.is_some())], "a step with a `file`")?;
                let rows = read_rows(file, ["radius", "x", "y", "z"]).map_err(|why| {
                    let range = format!("a CSV file with the columns radius, x, y, z ({why})");
                    at.refuse("file", file, range)
                })?;
                let place = |[r, x, y, z]: [f64; 4]| ([x, y, z], Some(r));
                rows.into_iter().map(place).collect()
            }
            (Some(points), None) => {
                let radii = match &self.radii {
                    Some(radii) if radii.len() != points.len() => {
                        let range = format!("as many as points, {}", points.len());
                        return Err(at.refuse("radii", format!("{} numbers", radii.len()), range));
                    }
                    Some(radii) => radii.iter().copied().map(Some).collect(),
                    None => vec![None; points.len()],
                };
                points.iter().copied().zip(radii).collect()
            }
        };
        let key = if self.file.is_some() {
            "file"
        } else {
            "points"
        };
        if places.is_empty() {
            return Err(at.refuse(key, "nothing", "a grain at least"));
        }
        for (k, (point, radius)) in places.iter().enumerate() {
            if !point.iter().all(|x| x.abs() < 1e6) {
                let value = format!("grain {k} at {point:?}");
                return Err(at.refuse(key, value, "within 1e6 m of the origin"));
            }
            if !radius.is_none_or(|r| r > 0.0 && r < 1e6) {
                let value = format!("grain {k} of radius {}", radius.unwrap_or(f64::NAN));
                return Err(at.refuse(key, value, "a radius in (0, 1e6) m"));
            }
        }
        Ok(places)
    }

    /// How an aggregate grows.
    pub fn growth(&self) -> Growth {
        match self.growth {
            Some(GrowthKind::ParticleCluster) => Growth::ParticleCluster,
            _ => Growth::ClusterCluster,
        }
    }
}
