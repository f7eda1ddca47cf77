//! A wall that keeps up a force or a pressure along an axis.
//!
//! ```text
//! M dv/dt = F_wanted − F − v/G,      |v| ≤ v_max
//! (M/Δt + 1/G) v(n+1/2) = M/Δt v(n−1/2) + F_wanted − F(n)
//! ```
//! F (N) is the force that the grains resist with along −axis, v (m/s) the wall's speed along the axis,
//! M (kg) its mass and G (m/(s N)) its gain, the inverse of a dashpot. Without a mass v = G (F_wanted − F).
//! At rest the wall carries exactly what it should, whatever M and G are. The dashpot is taken at the end
//! of the step, so a small gain cannot blow up; a large one can, above about 2/(k Δt) for a bed of stiffness
//! k when there is no mass.

use super::shape::unit;
use crate::setup::{SetupError, check};
use nalgebra::Vector3;

/// What a servo keeps up.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Target {
    /// A force (N).
    Force(f64),
    /// A pressure on an area.
    Pressure {
        /// Pressure (Pa), positive in compression.
        pressure: f64,
        /// Area it acts on (m²).
        area: f64,
    },
}

impl Target {
    /// The force wanted (N).
    pub fn force(&self) -> f64 {
        match *self {
            Target::Force(force) => force,
            Target::Pressure { pressure, area } => pressure * area,
        }
    }
}

/// A driven wall.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Servo {
    /// Unit vector along which it moves and pushes, into the grains.
    pub axis: Vector3<f64>,
    /// What it keeps up.
    pub target: Target,
    /// Mass M (kg), 0 for none.
    pub mass: f64,
    /// Gain G (m/(s N)).
    pub gain: f64,
    /// Largest speed v_max (m/s).
    pub speed_limit: f64,
}

/// How far a servo has come, and how fast it goes.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Course {
    /// Way along the axis (m).
    pub along: f64,
    /// Speed along the axis, half a step back (m/s).
    pub speed: f64,
}

impl Servo {
    /// A step later, under the force that the grains exert on the wall (N).
    pub(crate) fn next(&self, course: &Course, force: &Vector3<f64>, dt: f64) -> Course {
        let missing = self.target.force() + force.dot(&self.axis);
        let inertia = self.mass / dt;
        let speed = (inertia * course.speed + missing) / (inertia + 1.0 / self.gain);
        let speed = speed.clamp(-self.speed_limit, self.speed_limit);
        Course {
            along: course.along + dt * speed,
            speed,
        }
    }

    pub(super) fn validate(&self, key: &str) -> Result<(), SetupError> {
        unit(&format!("{key}.axis"), &self.axis)?;
        match self.target {
            Target::Force(force) => check(&format!("{key}.force"), force, "finite, N", |_| true)?,
            Target::Pressure { pressure, area } => {
                check(&format!("{key}.pressure"), pressure, "finite, Pa", |_| true)?;
                check(&format!("{key}.area"), area, "> 0 m²", |v| v > 0.0)?;
            }
        }
        check(&format!("{key}.mass"), self.mass, "≥ 0 kg", |v| v >= 0.0)?;
        check(&format!("{key}.gain"), self.gain, "> 0 m/(s N)", |v| {
            v > 0.0
        })?;
        let key = format!("{key}.speed_limit");
        check(&key, self.speed_limit, "> 0 m/s", |v| v > 0.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn servo(mass: f64) -> Servo {
        Servo {
            axis: -Vector3::z(),
            target: Target::Pressure {
                pressure: 50.0,
                area: 0.2,
            },
            mass,
            gain: 2e-3,
            speed_limit: 0.05,
        }
    }

    #[test]
    fn a_spring_is_loaded_to_what_was_asked() {
        for mass in [0.0, 3.0] {
            let (servo, stiffness, dt) = (servo(mass), 1e3, 1e-3);
            let mut course = Course::default();
            let mut fastest: f64 = 0.0;
            for _ in 0..20_000 {
                // A spring that begins a centimetre below the wall pushes it up.
                let force = Vector3::z() * stiffness * (course.along - 0.01).max(0.0);
                course = servo.next(&course, &force, dt);
                fastest = fastest.max(course.speed.abs());
            }
            assert!((course.along - 0.02).abs() < 1e-12, "{}", course.along);
            assert!(fastest <= 0.05);
        }
    }
}
