//! What grains and bodies do to a wall.

use super::{Pose, Standing, Wall};
use crate::simulation::Simulation;
use nalgebra::Vector3;

/// Force and torque on a wall at one instant.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct WallLoad {
    /// Force (N).
    pub force: Vector3<f64>,
    /// Torque about the wall's origin, where its pose puts it now (N m).
    pub torque: Vector3<f64>,
}

/// What a wall has taken since it was last asked to forget.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct WallImpulse {
    /// ∫ force dt (N s).
    pub impulse: Vector3<f64>,
    /// ∫ torque dt, each instant's about the wall's origin at that instant (N m s).
    pub angular: Vector3<f64>,
    /// Time over which forces were taken (s); the mean force is `impulse / duration`.
    pub duration: f64,
}

impl WallImpulse {
    /// How many numbers a checkpoint holds of it.
    pub(crate) const NUMBERS: usize = 7;

    pub(crate) fn numbers(&self) -> [f64; Self::NUMBERS] {
        let (p, l) = (&self.impulse, &self.angular);
        [p.x, p.y, p.z, l.x, l.y, l.z, self.duration]
    }

    pub(crate) fn from_numbers(&[px, py, pz, lx, ly, lz, duration]: &[f64; Self::NUMBERS]) -> Self {
        WallImpulse {
            impulse: Vector3::new(px, py, pz),
            angular: Vector3::new(lx, ly, lz),
            duration,
        }
    }

    pub(crate) fn take(&mut self, load: &WallLoad, kick: f64) {
        self.impulse += load.force * kick;
        self.angular += load.torque * kick;
        self.duration += kick;
    }
}

impl Simulation {
    /// Walls alone; parts of bodies stand behind them.
    fn standing(&self) -> &[Standing] {
        &self.walls[..self.wall_count()]
    }

    /// Number of walls. The others of these functions panic on a number that is not below it.
    pub fn wall_count(&self) -> usize {
        let standing = self.walls.iter().filter(|wall| wall.carrier.is_none());
        standing.count()
    }

    /// A wall as it was set up.
    pub fn wall(&self, wall: usize) -> &Wall {
        &self.standing()[wall].wall
    }

    /// Where a wall is now.
    pub fn wall_pose(&self, wall: usize) -> Pose {
        self.standing()[wall].pose
    }

    /// Mean velocity of a wall's origin over the last step (m/s), and its angular velocity (rad/s).
    pub fn wall_velocity(&self, wall: usize) -> [Vector3<f64>; 2] {
        let wall = &self.standing()[wall];
        [wall.velocity, wall.spin]
    }

    /// Force and torque of grains and bodies on a wall at this instant.
    pub fn wall_load(&mut self, wall: usize) -> WallLoad {
        self.observe();
        self.standing()[wall].load
    }

    /// What a wall has taken since the start, or since [`Simulation::forget_wall_taken`].
    pub fn wall_taken(&self, wall: usize) -> WallImpulse {
        self.standing()[wall].impulse
    }

    /// Starts a new interval of [`Simulation::wall_taken`] for a wall.
    pub fn forget_wall_taken(&mut self, wall: usize) {
        let walls = self.wall_count();
        self.walls[..walls][wall].impulse = WallImpulse::default();
    }
}
