//! How walls move.
//!
//! A motion that is told beforehand is a pure function of time, so that a restart finds the same bits.
//! A servo answers to forces; its state is part of a checkpoint.

use super::pose::Pose;
use super::servo::Servo;
use super::shape::unit;
use crate::setup::{SetupError, check};
use nalgebra::{UnitQuaternion, UnitVector3, Vector3};
use std::f64::consts::TAU;

/// What a wall does in time.
#[derive(Clone, Debug, Default, PartialEq)]
pub enum Motion {
    /// It stands.
    #[default]
    Fixed,
    /// It moves at this velocity from time zero on (m/s).
    Steady(Vector3<f64>),
    /// It shakes.
    Sine(Sine),
    /// It jumps.
    Staircase(Staircase),
    /// It turns.
    Rotation(Rotation),
    /// It follows a table.
    Table(Table),
    /// It keeps up a force or a pressure.
    Servo(Servo),
}

/// Shaking, axis by axis: `x_k(t) = A_k sin(2π f_k t + φ_k)` about where the wall was put.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Sine {
    /// Amplitudes A (m).
    pub amplitude: Vector3<f64>,
    /// Frequencies f (Hz).
    pub frequency: Vector3<f64>,
    /// Phases φ (rad).
    pub phase: Vector3<f64>,
}

/// Jumps at regular times (Tancredi et al. 2012, Fig. 7): the wall moves at a speed for a short while,
/// rests, and moves on from there with the next jump.
///
/// ```text
/// jump n = 0, 1, …   starts at  t_1 + n T,  lasts τ,  at velocity  v min(1, (n + 1)/N)
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Staircase {
    /// Velocity v of a jump once they have grown (m/s).
    pub velocity: Vector3<f64>,
    /// Duration τ of a jump (s).
    pub duration: f64,
    /// Time T from one jump to the next (s).
    pub period: f64,
    /// When the first one starts, t_1 (s).
    pub first: f64,
    /// Number N of jumps over which their speed grows linearly; 1 for the full speed at once.
    pub growing: u32,
}

/// Turning about an axis in space; the angle is rate · t.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Rotation {
    /// A point of the axis (m).
    pub point: Vector3<f64>,
    /// Unit vector along the axis.
    pub axis: Vector3<f64>,
    /// Angular velocity (rad/s), right-handed about the axis.
    pub rate: f64,
}

/// Displacements at given times, linear in between and at rest before and after.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Table {
    /// Rising times (s).
    pub times: Vec<f64>,
    /// Displacement from where the wall was put, at each of them (m).
    pub displacements: Vec<Vector3<f64>>,
}

impl Sine {
    fn displacement(&self, t: f64) -> Vector3<f64> {
        Vector3::from_fn(|k, _| {
            self.amplitude[k] * (TAU * self.frequency[k] * t + self.phase[k]).sin()
        })
    }

    /// Mean velocity between two times; the difference of sines as a product keeps its digits.
    fn velocity(&self, from: f64, to: f64) -> Vector3<f64> {
        Vector3::from_fn(|k, _| {
            let rate = TAU * self.frequency[k];
            let middle = rate * 0.5 * (from + to) + self.phase[k];
            let half = rate * 0.5 * (to - from);
            2.0 * self.amplitude[k] * middle.cos() * half.sin() / (to - from)
        })
    }
}

impl Staircase {
    /// The sum of min(1, (n + 1)/N) over the first `jumps` jumps.
    fn grown(&self, jumps: f64) -> f64 {
        let growing = f64::from(self.growing);
        let early = jumps.min(growing);
        early * (early + 1.0) / (2.0 * growing) + (jumps - early)
    }

    fn displacement(&self, t: f64) -> Vector3<f64> {
        if t <= self.first {
            return Vector3::zeros();
        }
        let done = ((t - self.first) / self.period).floor();
        let into = (t - self.first - done * self.period).min(self.duration);
        let share = ((done + 1.0) / f64::from(self.growing)).min(1.0);
        self.velocity * (self.duration * self.grown(done) + into * share)
    }
}

impl Table {
    fn displacement(&self, t: f64) -> Vector3<f64> {
        let after = self.times.partition_point(|&time| time <= t);
        if after == 0 {
            return self.displacements[0];
        }
        let Some(&next) = self.times.get(after) else {
            return self.displacements[after - 1];
        };
        let before = self.times[after - 1];
        let share = (t - before) / (next - before);
        let from = self.displacements[after - 1];
        from + (self.displacements[after] - from) * share
    }
}

impl Rotation {
    fn turn(&self, t: f64) -> UnitQuaternion<f64> {
        let axis = UnitVector3::new_unchecked(self.axis);
        UnitQuaternion::from_axis_angle(&axis, self.rate * t)
    }
}

impl Motion {
    /// Where a wall that was put at `start` is at time `t` (s); `along` is how far a servo has come (m).
    pub fn pose(&self, start: &Pose, t: f64, along: f64) -> Pose {
        let displacement = match self {
            Motion::Fixed => return *start,
            Motion::Steady(velocity) => velocity * t,
            Motion::Sine(sine) => sine.displacement(t),
            Motion::Staircase(staircase) => staircase.displacement(t),
            Motion::Table(table) => table.displacement(t),
            Motion::Servo(servo) => servo.axis * along,
            Motion::Rotation(rotation) => {
                return start.turned_about(&rotation.point, &rotation.turn(t));
            }
        };
        Pose {
            position: start.position + displacement,
            orientation: start.orientation,
        }
    }

    /// Mean velocity of the origin of a wall between two times, and its angular velocity.
    pub(crate) fn velocity(&self, start: &Pose, from: f64, to: f64) -> [Vector3<f64>; 2] {
        let mean = |a: Vector3<f64>, b: Vector3<f64>| (b - a) / (to - from);
        match self {
            // A servo's velocity is its own state.
            Motion::Fixed | Motion::Servo(_) => [Vector3::zeros(); 2],
            Motion::Steady(velocity) => [*velocity, Vector3::zeros()],
            Motion::Sine(sine) => [sine.velocity(from, to), Vector3::zeros()],
            Motion::Staircase(staircase) => {
                let ends = [from, to].map(|t| staircase.displacement(t));
                [mean(ends[0], ends[1]), Vector3::zeros()]
            }
            Motion::Table(table) => {
                let ends = [from, to].map(|t| table.displacement(t));
                [mean(ends[0], ends[1]), Vector3::zeros()]
            }
            Motion::Rotation(rotation) => {
                // The chord of the step, written so that no digits cancel.
                let arm = start.position - rotation.point;
                let half = 0.5 * rotation.rate * (to - from);
                let chord = rotation.turn(0.5 * (from + to)) * rotation.axis.cross(&arm);
                let speed = half.sin() / (0.5 * (to - from));
                [chord * speed, rotation.axis * rotation.rate]
            }
        }
    }

    /// Checks the numbers of a motion; `key` says whose they are.
    pub fn validate(&self, key: &str) -> Result<(), SetupError> {
        match self {
            Motion::Fixed => Ok(()),
            Motion::Steady(velocity) => finite(&format!("{key}.velocity"), velocity),
            Motion::Sine(sine) => {
                finite(&format!("{key}.amplitude"), &sine.amplitude)?;
                finite(&format!("{key}.frequency"), &sine.frequency)?;
                finite(&format!("{key}.phase"), &sine.phase)
            }
            Motion::Staircase(jumps) => jumps.validate(key),
            Motion::Rotation(rotation) => {
                finite(&format!("{key}.point"), &rotation.point)?;
                unit(&format!("{key}.axis"), &rotation.axis)?;
                check(
                    &format!("{key}.rate"),
                    rotation.rate,
                    "finite, rad/s",
                    |_| true,
                )
            }
            Motion::Table(table) => table.validate(key),
            Motion::Servo(servo) => servo.validate(key),
        }
    }
}

impl Staircase {
    fn validate(&self, key: &str) -> Result<(), SetupError> {
        finite(&format!("{key}.velocity"), &self.velocity)?;
        check(&format!("{key}.first"), self.first, "≥ 0 s", |v| v >= 0.0)?;
        check(&format!("{key}.period"), self.period, "> 0 s", |v| v > 0.0)?;
        check(
            &format!("{key}.duration"),
            self.duration,
            "> 0 s and at most the period",
            |v| v > 0.0 && v <= self.period,
        )?;
        let growing = f64::from(self.growing);
        check(&format!("{key}.growing"), growing, "≥ 1", |v| v >= 1.0)
    }
}

impl Table {
    fn validate(&self, key: &str) -> Result<(), SetupError> {
        let rows = self.times.len() as f64;
        check(&format!("{key}.times, their number"), rows, "≥ 1", |v| {
            v >= 1.0
        })?;
        check(
            &format!("{key}.displacements, their number"),
            self.displacements.len() as f64,
            "that of the times",
            |v| v == rows,
        )?;
        let mut before = f64::NEG_INFINITY;
        for (row, (time, displacement)) in self.times.iter().zip(&self.displacements).enumerate() {
            let allowed = "finite and later than the time before";
            check(&format!("{key}.times[{row}]"), *time, allowed, |t| {
                t > before
            })?;
            finite(&format!("{key}.displacements[{row}]"), displacement)?;
            before = *time;
        }
        Ok(())
    }
}

pub(crate) fn finite(key: &str, vector: &Vector3<f64>) -> Result<(), SetupError> {
    vector
        .iter()
        .try_for_each(|c| check(key, *c, "finite", |_| true))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn start() -> Pose {
        Pose::at(Vector3::new(0.5, 0.0, 1.0))
    }

    #[test]
    fn every_velocity_is_the_mean_rate_of_the_pose() {
        let table = Table {
            times: vec![0.1, 0.3, 0.4],
            displacements: vec![Vector3::x(), Vector3::y(), Vector3::zeros()],
        };
        let motions = [
            Motion::Steady(Vector3::new(1.0, -2.0, 0.5)),
            Motion::Sine(Sine {
                amplitude: Vector3::new(0.1, 0.2, 0.3),
                frequency: Vector3::new(3.0, 5.0, 7.0),
                phase: Vector3::new(0.0, 1.0, 2.0),
            }),
            Motion::Staircase(Staircase {
                velocity: Vector3::z(),
                duration: 0.02,
                period: 0.1,
                first: 0.05,
                growing: 3,
            }),
            Motion::Rotation(Rotation {
                point: Vector3::new(0.0, 0.2, 0.0),
                axis: Vector3::new(0.6, 0.0, 0.8),
                rate: 4.0,
            }),
            Motion::Table(table),
        ];
        for motion in motions {
            for step in 0..50 {
                let (from, to) = (f64::from(step) * 0.01, f64::from(step + 1) * 0.01);
                let a = motion.pose(&start(), from, 0.0).position;
                let b = motion.pose(&start(), to, 0.0).position;
                let [velocity, _] = motion.velocity(&start(), from, to);
                let error = ((b - a) / (to - from) - velocity).norm();
                assert!(error < 1e-12, "{motion:?} at {from}: {error:e}");
            }
        }
    }

    #[test]
    fn a_sine_follows_its_closed_form() {
        let sine = Sine {
            amplitude: Vector3::new(0.0, 0.0, 0.01),
            frequency: Vector3::new(0.0, 0.0, 50.0),
            phase: Vector3::new(0.0, 0.0, std::f64::consts::FRAC_PI_2),
        };
        let at = |t| Motion::Sine(sine).pose(&start(), t, 0.0).position.z - 1.0;
        assert!((at(0.0) - 0.01).abs() < 1e-16);
        assert!((at(0.01) + 0.01).abs() < 1e-15);
        let [v, _] = Motion::Sine(sine).velocity(&start(), 0.005 - 1e-7, 0.005 + 1e-7);
        assert!((v.z + TAU * 50.0 * 0.01).abs() < 1e-6, "{}", v.z);
    }

    #[test]
    fn jumps_grow_and_stay() {
        let jumps = Staircase {
            velocity: Vector3::new(0.0, 0.0, 5.0),
            duration: 0.1,
            period: 2.0,
            first: 1.0,
            growing: 20,
        };
        let height = |t| jumps.displacement(t).z;
        assert_eq!(height(0.5), 0.0);
        assert!((height(1.05) - 0.05 * 5.0 / 20.0).abs() < 1e-14);
        assert_eq!(height(1.1), height(2.9));
        // Twenty growing jumps: v τ (1 + … + 20)/20, then v τ each.
        let after = |n: f64| height(1.0 + 2.0 * n - 0.5);
        assert!((after(20.0) - 0.5 * 10.5).abs() < 1e-12, "{}", after(20.0));
        assert!((after(23.0) - 0.5 * 13.5).abs() < 1e-12);
    }
}
