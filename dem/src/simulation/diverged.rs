//! Runs that no longer follow the motion: how it is found, and which step would do.

use super::Simulation;
use crate::grains::vector;
use crate::setup::{FARTHEST, SetupError};
use crate::timestep::{self, Body, Classes, Conditions, Remedy, Shares};

/// The step no longer follows the motion.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum Diverged {
    /// A position is no longer a number.
    #[error(
        "grain {grain} has left the range of numbers at t = {time:e} s: the time step of \
         {timestep:e} s is too long for the stiffness and speeds of this scene; {remedy}"
    )]
    Escape {
        /// Number of the grain.
        grain: u32,
        /// When it was found (s).
        time: f64,
        /// The step (s).
        timestep: f64,
        /// A step that would do.
        remedy: Remedy,
    },
    /// A body's position is no longer a number.
    #[error(
        "body {body} has left the range of numbers at t = {time:e} s: the time step of \
         {timestep:e} s is too long for the stiffness and speeds of this scene; {remedy}"
    )]
    Lost {
        /// Number of the body.
        body: usize,
        /// When it was found (s).
        time: f64,
        /// The step (s).
        timestep: f64,
        /// A step that would do.
        remedy: Remedy,
    },
    /// Grains or bodies have run through each other.
    #[error(
        "grains or bodies overlapped by {overlap:.2} of their radius before t = {time:e} s: the time step of \
         {timestep:e} s is too long, or the grains are too soft for their speeds; {remedy}"
    )]
    Overlap {
        /// Overlap over the harmonic mean radius.
        overlap: f64,
        /// When it was found (s).
        time: f64,
        /// The step (s).
        timestep: f64,
        /// A step that would do.
        remedy: Remedy,
    },
    /// A moving box has become too narrow.
    #[error("at t = {time:e} s: {narrow}")]
    Narrow {
        /// When (s).
        time: f64,
        /// Which axis, and what it must be.
        narrow: Box<SetupError>,
    },
    /// Grains move against each other by more than the search can follow.
    #[error(
        "grains approached each other by more than {skin:e} m in the one step before t = {time:e} s: \
         the time step of {timestep:e} s is too long for their speeds; {remedy}"
    )]
    Leap {
        /// The list's skin (m).
        skin: f64,
        /// When it was found (s).
        time: f64,
        /// The step (s).
        timestep: f64,
        /// A step that would do.
        remedy: Remedy,
    },
}

/// An overlap, over the harmonic mean radius, that no run of ours means: grains half way through.
const RUN_THROUGH: f64 = 1.0;

/// Overlap over the harmonic mean radius for which a failed run's better step is computed.
const FAILING_OVERLAP: f64 = 0.1;

impl Simulation {
    /// Checks the state before a list of this age (s) is made anew: one that does not outlive one step
    /// cannot promise that no contact was missed.
    pub(super) fn outlived(&self, age: f64) -> Result<(), Diverged> {
        self.check()?;
        if age < 1.5 * self.timestep {
            return Err(Diverged::Leap {
                skin: self.skin,
                time: self.time(),
                timestep: self.timestep,
                remedy: self.remedy(true),
            });
        }
        Ok(())
    }

    pub(super) fn check(&self) -> Result<(), Diverged> {
        let (time, timestep) = (self.time(), self.timestep);
        if self.deepest > RUN_THROUGH {
            return Err(Diverged::Overlap {
                overlap: self.deepest,
                time,
                timestep,
                remedy: self.remedy(false),
            });
        }
        let mut bodies = self.bodies.rigid.iter();
        let lost = |x: &f64| x.is_nan() || x.abs() >= 1e150;
        if let Some(body) = bodies.position(|body| body.state().iter().any(lost)) {
            return Err(Diverged::Lost {
                body,
                time,
                timestep,
                remedy: self.remedy(false),
            });
        }
        let n = self.grains.len();
        let lost = |x: &[f64; 4]| !x.iter().all(|c| c.abs() < FARTHEST);
        match self.grains.place[..n].iter().position(lost) {
            None => Ok(()),
            Some(i) => Err(Diverged::Escape {
                grain: self.grains.id[i],
                time,
                timestep,
                remedy: self.remedy(false),
            }),
        }
    }

    /// What limits the step: classes of grains alike, and the walls.
    ///
    /// A member counts with the mass that a push on it feels at the least, by its lever; and at most with its
    /// share of its clump's, for all members may be pushed at once.
    pub(crate) fn classes(&self) -> Classes {
        let mut masses = self.grains.mass.clone();
        self.each_lightest(|row, least| masses[row] = least.min(masses[row]));
        let bodies = (0..self.grains.len()).map(|i| Body {
            material: self.grains.material[i],
            radius: self.grains.place[i][3],
            mass: masses[i],
            fixed: self.grains.is_fixed(i),
        });
        let walls = self.walls.iter().filter(|w| w.carrier.is_none());
        let walls: Vec<u16> = walls.map(|w| w.wall.material).collect();
        Classes::of(bodies.chain(self.bodies.classes(&self.walls)), &walls)
    }

    /// A step that would do for these grains: that of contacts under a large overlap, and in a `leap`
    /// that of the speeds, unless the contacts themselves have blown up.
    fn remedy(&self, leap: bool) -> Remedy {
        let classes = self.classes();
        let choice = |speed: f64| {
            let conditions = Conditions {
                speed,
                overlap: FAILING_OVERLAP,
                pressure: 0.0,
            };
            let shares = Shares::default();
            let mut limits = timestep::limits_of(&classes, &self.law, &conditions, &shares);
            limits.extend(self.bond_limit());
            timestep::choose(limits, 1.0)
        };
        let mut choice_now = choice(0.0);
        if leap && self.timestep <= choice_now.seconds {
            // Two grains may meet head on.
            let n = self.grains.len();
            let speeds = self.grains.motion[..n].iter().map(|v| vector(v).norm());
            choice_now = choice(2.0 * speeds.fold(0.0, f64::max));
        }
        Remedy {
            seconds: choice_now.seconds,
            limit: choice_now.binding,
            exceeded: self.timestep > choice_now.seconds,
        }
    }
}
