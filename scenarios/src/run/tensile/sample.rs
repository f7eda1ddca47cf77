//! The sample: a cylinder whose head widens into the clamp, and where it stands among the others.

use crate::run::comet::{self, Comet};
use crate::run::comet_block::CometBlock;
use crate::scene::TensileScene;
use crate::scene::world::Materials;
use colluvium_dem::walls::{Ends, Frustum};
use colluvium_dem::{Grain, Region, Side, Wall};
use nalgebra::Vector3;
use std::f64::consts::PI;

/// Thickness of the layer that is pulled, and of the one that is gripped, in mean diameters.
pub const LAYER: f64 = 1.5;
/// Distance of the axes of two samples over the diameter of the head.
const APART: f64 = 2.0;

impl TensileScene {
    pub(super) fn radius(&self) -> f64 {
        0.5 * self.sample.diameter
    }

    /// The cross-section (m²).
    pub(super) fn area(&self) -> f64 {
        PI * self.radius().powi(2)
    }

    /// Radius of the clamp at its top (m).
    pub(super) fn top_radius(&self) -> f64 {
        self.radius() + self.clamp.height * self.clamp.angle_degrees.to_radians().tan()
    }

    /// Height of the clamp's lower end (m).
    pub(super) fn clamp_foot(&self) -> f64 {
        self.sample.height - self.clamp.height
    }

    pub(super) fn comet(&self) -> Comet<'_> {
        Comet {
            material: &self.material,
            soft: self.preparation.softness(),
            contact: &self.contact,
            coarse_graining: self.coarse_graining,
        }
    }

    pub(super) fn block(&self) -> CometBlock<'_> {
        let width = 2.0 * self.top_radius();
        CometBlock {
            comet: self.comet(),
            preparation: &self.preparation,
            needed: Vector3::new(width, width, self.sample.height),
        }
    }

    /// Rumpf's strength (Pa).
    pub(super) fn rumpf(&self, materials: &Materials) -> f64 {
        self.comet().rumpf(materials)
    }

    /// Foot of the axis of sample `k`.
    pub(super) fn foot(&self, k: usize) -> Vector3<f64> {
        Vector3::new(APART * 2.0 * self.top_radius() * k as f64, 0.0, 0.0)
    }

    /// The sample that something at this place at the start belongs to.
    pub(super) fn sample_at(&self, place: &Vector3<f64>) -> usize {
        let at = (place.x / self.foot(1).x).round().max(0.0) as usize;
        at.min(self.samples - 1)
    }

    fn cylinder(&self, radius: f64, [low, high]: [f64; 2]) -> Region {
        let far = f64::INFINITY;
        Region::All(vec![
            Region::Cylinder {
                point: Vector3::zeros(),
                axis: Vector3::z(),
                radius,
            },
            Region::Block {
                lower: Vector3::new(-far, -far, low),
                upper: Vector3::new(far, far, high),
            },
        ])
    }

    /// The cone from its lower end.
    fn cone(&self, inset: f64) -> Region {
        let radii = [self.radius(), self.top_radius()].map(|r| (r - inset).max(0.0));
        Region::Frustum {
            point: Vector3::new(0.0, 0.0, self.clamp_foot()),
            axis: Vector3::z(),
            length: self.clamp.height,
            radii,
        }
    }

    /// The sample: a cylinder with its head.
    pub(super) fn shape(&self) -> Region {
        let body = self.cylinder(self.radius(), [0.0, self.sample.height]);
        Region::Any(vec![body, self.cone(0.0)])
    }

    /// Where its solid fraction is measured.
    pub(super) fn middle(&self) -> Region {
        let ends = [0.2, 0.8].map(|share| share * self.sample.height);
        self.cylinder(0.7 * self.radius(), ends)
    }

    /// Grains of the head that the clamp grips.
    pub(super) fn gripped(&self, materials: &Materials) -> Region {
        let slant = self.clamp.angle_degrees.to_radians().cos();
        let depth = LAYER * comet::diameter(materials) / slant;
        Region::All(vec![
            self.cone(0.0),
            Region::Outside(Box::new(self.cone(depth))),
        ])
    }

    /// Whether a grain belongs to a sample that a wall holds: its centre lies within, and no part of it in the wall. Below
    /// the cone the cross-section is that of a gripped sample: cut by centres.
    pub(super) fn is_clear_of_wall(&self, grain: &Grain) -> bool {
        let p = grain.position;
        let (out, up) = (p.x.hypot(p.y) - self.radius(), p.z - self.clamp_foot());
        let (sin, cos) = self.clamp.angle_degrees.to_radians().sin_cos();
        let from_wall = if out * sin + up * cos < 0.0 {
            out.hypot(up)
        } else {
            up * sin - out * cos
        };
        self.shape().contains(&p) && from_wall >= grain.radius
    }

    /// The clamp of sample `k` as a wall.
    pub(super) fn wall(&self, k: usize) -> Wall {
        let foot = self.foot(k) + Vector3::new(0.0, 0.0, self.clamp_foot());
        Wall::frustum(
            foot,
            Frustum {
                axis: Vector3::z(),
                // The side goes on above the sample, so that nothing touches its upper edge.
                height: 2.0 * self.clamp.height,
                radii: [self.radius(), 2.0 * self.top_radius() - self.radius()],
                ends: Ends::Open(Side::Inside),
            },
        )
    }
}
