//! How a wall moves: `motion = { kind = "steady", velocity = [0, 0, -0.01] }`.

use super::gravity::read_rows;
use super::{Place, Triple};
use crate::scene::SceneError;
use colluvium_dem::Motion;
use colluvium_dem::walls::{Rotation, Servo, Sine, Staircase, Table, Target};
use nalgebra::Vector3;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Kinds of motion.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum MotionKind {
    /// At one velocity.
    Steady,
    /// Shaking, axis by axis.
    Sine,
    /// Jumps at regular times.
    Staircase,
    /// Turning about an axis.
    Rotation,
    /// Displacements from a file.
    Table,
    /// Keeping up a force or a pressure.
    Servo,
}

/// A motion; which keys are read is its kind's.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct MotionKeys {
    /// Its kind.
    pub kind: MotionKind,
    /// Velocity of steady, and of a jump of staircase (m/s).
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub velocity: Option<Triple>,
    /// Amplitudes of sine (m).
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub amplitude: Option<Triple>,
    /// Frequencies of sine (Hz).
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub frequency: Option<Triple>,
    /// Phases of sine (rad); left out: 0.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub phase: Option<Triple>,
    /// Duration of a jump of staircase (s).
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub duration: Option<f64>,
    /// Time from jump to jump of staircase (s).
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub period: Option<f64>,
    /// When the first jump of staircase starts (s); left out: 0.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub first: Option<f64>,
    /// Jumps of staircase over which their speed grows; left out: 1.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend("minimum" = 1, "maximum" = 1000000))]
    pub growing: Option<u32>,
    /// A point of the axis of rotation (m).
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub point: Option<Triple>,
    /// Axis of rotation; the way that a servo moves and pushes, into the grains.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub axis: Option<Triple>,
    /// Angular velocity of rotation (rad/s).
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub rate: Option<f64>,
    /// CSV file of table with the columns t, x, y, z (s, m).
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub file: Option<String>,
    /// Force of servo (N); or give a pressure and an area.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub force: Option<f64>,
    /// Pressure of servo (Pa).
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub pressure: Option<f64>,
    /// Area of that pressure (m²).
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub area: Option<f64>,
    /// Mass of servo (kg); left out: none.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub mass: Option<f64>,
    /// Gain of servo (m/(s N)).
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub gain: Option<f64>,
    /// Largest speed of servo (m/s).
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub speed_limit: Option<f64>,
}

impl MotionKeys {
    /// The motion.
    pub fn motion(&self, at: Place) -> Result<Motion, SceneError> {
        let vector = |value: &Option<Triple>, key: &str| -> Result<Vector3<f64>, SceneError> {
            Ok(at.need(value, key, "three numbers")?.into())
        };
        let number = |value: &Option<f64>, key: &str, unit: &str| at.need(value, key, unit);
        let axis = || at.direction(at.need(&self.axis, "axis", "a direction")?, "axis");
        let motion = match self.kind {
            MotionKind::Steady => Motion::Steady(vector(&self.velocity, "velocity")?),
            MotionKind::Sine => Motion::Sine(Sine {
                amplitude: vector(&self.amplitude, "amplitude")?,
                frequency: vector(&self.frequency, "frequency")?,
                phase: self.phase.unwrap_or_default().into(),
            }),
            MotionKind::Staircase => Motion::Staircase(Staircase {
                velocity: vector(&self.velocity, "velocity")?,
                duration: number(&self.duration, "duration", "s")?,
                period: number(&self.period, "period", "s")?,
                first: self.first.unwrap_or(0.0),
                growing: self.growing.unwrap_or(1),
            }),
            MotionKind::Rotation => Motion::Rotation(Rotation {
                point: vector(&self.point, "point")?,
                axis: axis()?,
                rate: number(&self.rate, "rate", "rad/s")?,
            }),
            MotionKind::Table => {
                let file = at.need(&self.file, "file", "a CSV file")?;
                let rows = read_rows(&file, ["t", "x", "y", "z"]).map_err(|why| {
                    let range = format!("a CSV file with the columns t, x, y, z ({why})");
                    at.refuse("file", &file, range)
                })?;
                Motion::Table(Table {
                    times: rows.iter().map(|row| row[0]).collect(),
                    displacements: rows
                        .iter()
                        .map(|&[_, x, y, z]| Vector3::new(x, y, z))
                        .collect(),
                })
            }
            MotionKind::Servo => Motion::Servo(Servo {
                axis: axis()?,
                target: self.target(at)?,
                mass: self.mass.unwrap_or(0.0),
                gain: number(&self.gain, "gain", "m/(s N)")?,
                speed_limit: number(&self.speed_limit, "speed_limit", "m/s")?,
            }),
        };
        self.check_unread(at)?;
        motion
            .validate(at.section)
            .map_err(|error| SceneError::Unreadable {
                file: at.origin.to_owned(),
                message: error.to_string(),
            })?;
        Ok(motion)
    }

    fn target(&self, at: Place) -> Result<Target, SceneError> {
        match (self.force, self.pressure) {
            (Some(_), Some(_)) => Err(SceneError::Conflict {
                file: at.origin.to_owned(),
                first: at.key("force"),
                second: at.key("pressure"),
            }),
            (Some(force), None) => Ok(Target::Force(force)),
            (None, pressure) => Ok(Target::Pressure {
                pressure: at.need(&pressure, "pressure", "Pa, or give force in N")?,
                area: at.need(&self.area, "area", "m²")?,
            }),
        }
    }

    fn check_unread(&self, at: Place) -> Result<(), SceneError> {
        use MotionKind::{Rotation, Servo, Sine, Staircase, Steady, Table};
        let only = |given: bool, kinds: &[MotionKind]| given && !kinds.contains(&self.kind);
        let servo = |given: bool| only(given, &[Servo]);
        let jumps = |given: bool| only(given, &[Staircase]);
        let sine = |given: bool| only(given, &[Sine]);
        at.unread(
            &[
                (
                    "velocity",
                    only(self.velocity.is_some(), &[Steady, Staircase]),
                ),
                ("amplitude", sine(self.amplitude.is_some())),
                ("frequency", sine(self.frequency.is_some())),
                ("phase", sine(self.phase.is_some())),
                ("duration", jumps(self.duration.is_some())),
                ("period", jumps(self.period.is_some())),
                ("first", jumps(self.first.is_some())),
                ("growing", jumps(self.growing.is_some())),
                ("point", only(self.point.is_some(), &[Rotation])),
                ("rate", only(self.rate.is_some(), &[Rotation])),
                ("axis", only(self.axis.is_some(), &[Rotation, Servo])),
                ("file", only(self.file.is_some(), &[Table])),
                ("force", servo(self.force.is_some())),
                ("pressure", servo(self.pressure.is_some())),
                ("area", servo(self.area.is_some())),
                ("mass", servo(self.mass.is_some())),
                ("gain", servo(self.gain.is_some())),
                ("speed_limit", servo(self.speed_limit.is_some())),
            ],
            &format!("a motion of the kind {:?}", self.kind).to_lowercase(),
        )
    }
}
