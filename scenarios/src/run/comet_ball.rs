//! A ball of cometary material of a wanted porosity.
//!
//! A ballistic aggregate of single grains (solid fraction 0.15, a tree of contacts) is pulled to its centre
//! until it is dense enough: so it hangs together at porosities that a loose cloud pulled to its centre
//! would leave in flight.

use super::comet::Comet;
use super::world::Workshop;
use super::world::workshop::Surroundings;
use crate::failure::Failure;
use crate::scene::CometPreparationKeys;
use crate::scene::world::Materials;
use colluvium_dem::preparation::{CentralCompaction, Relaxation, Rest};
use nalgebra::{UnitQuaternion, Vector3};
use std::f64::consts::PI;

/// Drag of the pulled grains, over √(a/d): they come in slowly, so that the pull can be taken off in time.
const DRAG: f64 = 3.0;
/// Ball in which the solid fraction is measured, over the one that is needed.
const PROBE: f64 = 0.8;

/// What a ball is made of, and how large it must be.
#[derive(Clone, Copy, Debug)]
pub struct CometBall<'a> {
    /// The material.
    pub comet: Comet<'a>,
    /// How it is put together.
    pub preparation: &'a CometPreparationKeys,
    /// Radius that is needed (m).
    pub radius: f64,
}

impl CometBall<'_> {
    /// Grains of the whole ball.
    pub fn grains(&self, materials: &Materials) -> usize {
        let radius = self.preparation.margin * self.radius;
        self.comet
            .grains_in(4.0 / 3.0 * PI * radius.powi(3), materials)
            .ceil() as usize
    }

    /// Makes the ball about a point (m), at rest and as stiff as the scene's own law.
    pub fn make(
        &self,
        shop: &mut Workshop,
        center: Vector3<f64>,
        origin: &str,
    ) -> Result<(), Failure> {
        let soft = self
            .comet
            .at_stiffness(self.comet.soft.youngs_modulus, origin)?;
        self.comet.grow(shop, &soft, self.grains(&soft))?;
        self.compact(shop, &soft)?;
        self.comet.stiffen(shop, origin)?;
        shop.place(UnitQuaternion::identity(), center)
    }

    fn compact(&self, shop: &mut Workshop, soft: &Materials) -> Result<(), Failure> {
        let rumpf = self.comet.rumpf(soft);
        // The pull lays ρ a R on the middle of the ball.
        let acceleration =
            self.preparation.pull * rumpf / (self.comet.material.bulk_density * self.radius);
        let spec = CentralCompaction {
            center: Vector3::zeros(),
            probe: PROBE * self.radius,
            solid_fraction: self.comet.material.solid_fraction(),
            tolerance: 0.02,
            accelerations: [acceleration, 1000.0 * acceleration],
            relaxation: Relaxation {
                damping: DRAG,
                patience: 500.0,
                rest: Rest {
                    kinetic: 1e-3,
                    unbalanced: 0.1,
                },
                ..Relaxation::under(acceleration)
            },
        };
        let around = Surroundings {
            speed: super::world::steps::compaction_speed(shop, acceleration, Vector3::zeros()),
            ..Surroundings::none(soft.laws.clone())
        };
        shop.compact(&around, &spec)
    }
}
