//! A block of cometary material of a wanted porosity.
//!
//! A block is cut out of a ballistic aggregate of single grains (solid fraction 0.15, a tree of contacts) and
//! put into a periodic box of its size, which shrinks about its middle until the solid fraction is the wanted
//! one: the faces meet, chains bend, and further contacts form. The block is the same everywhere, has no rim,
//! and hangs together.

use super::comet::{self, Comet};
use super::world::Workshop;
use super::world::workshop::Squeeze;
use crate::failure::Failure;
use crate::scene::CometBlockKeys;
use crate::scene::world::Materials;
use colluvium_dem::preparation::{Packing, solid_fraction};
use colluvium_dem::{Domain, Grain, Region};
use nalgebra::Vector3;
use std::f64::consts::PI;

/// Solid fraction of a ballistic aggregate, at its least.
const AGGREGATE: f64 = 0.13;
/// Radius of the aggregate over that of the ball around the block: it is looser where it last grew.
const RIM: f64 = 1.3;
/// Edges of the middle of a block over its own.
const INNER: f64 = 0.5;
/// Solid fractions that are made one after the other, over the wanted one: the middle does not shrink quite
/// as the box does.
const STAGES: [f64; 3] = [0.85, 0.97, 1.0];

/// Steps that a block takes from its aggregate to its rest, for the plan: shrinking is a small part of them, the rests in
/// between and the stages of stiffness are the most. Measured 3.2e4 (dust) to 1.3e5 (boulders of the 2:1 mixture).
const STEPS: f64 = 7e4;

/// What a block is made of, and how large it must be.
#[derive(Clone, Copy, Debug)]
pub struct CometBlock<'a> {
    /// The material.
    pub comet: Comet<'a>,
    /// How it is put together.
    pub preparation: &'a CometBlockKeys,
    /// Edges of what is to be cut out of it (m).
    pub needed: Vector3<f64>,
}

impl CometBlock<'_> {
    /// Edges of the block (m).
    fn edges(&self, materials: &Materials) -> Vector3<f64> {
        self.needed
            .add_scalar(2.0 * self.preparation.margin * comet::diameter(materials))
    }

    /// Grain-steps that it takes to make, right to a factor of two.
    pub fn grain_steps(&self, materials: &Materials) -> f64 {
        STEPS
            * self
                .comet
                .grains_in(self.edges(materials).product(), materials)
    }

    /// Makes the block about the origin, in open space, at rest and as stiff as the scene's own law.
    pub fn make(&self, shop: &mut Workshop, origin: &str) -> Result<(), Failure> {
        let soft = self
            .comet
            .at_stiffness(self.comet.soft.youngs_modulus, origin)?;
        let solid = self.comet.material.solid_fraction();
        // As wide as the loosest aggregate would have to be; a denser one is cut smaller.
        let half = 0.5 * (solid / AGGREGATE).cbrt() * self.edges(&soft);
        let volume = 4.0 / 3.0 * PI * (RIM * half.norm()).powi(3);
        let grains = self.comet.grains_in(volume, &soft) * AGGREGATE / solid;
        shop.packing.domain = super::world::workshop::open_space();
        self.comet.grow(shop, &soft, grains.ceil() as usize)?;
        let block = Region::Block {
            lower: -half,
            upper: half,
        };
        shop.trim(&block, false)?;
        shop.packing.domain = Domain {
            lower: -half,
            upper: half,
            periodic: [true; 3],
        };
        part_faces(&mut shop.packing);
        let mut widths = 2.0 * half;
        for share in STAGES {
            // Faces are looser than the middle, which is to have the wanted solid fraction.
            let grains = &shop.packing.grains;
            let volume: f64 = grains.iter().map(Grain::volume).sum();
            let whole = volume / widths.product();
            let inner = Region::Block {
                lower: -0.5 * INNER * widths,
                upper: 0.5 * INNER * widths,
            };
            let middle = solid_fraction(grains, &shop.packing.domain, &inner);
            let widened = (share * solid / middle).cbrt();
            // The strain rate at the end is (L_0/L_1 - 1)/T, and neighbours a diameter apart close in by it.
            let time = comet::diameter(&soft) * (widened - 1.0).abs() / self.preparation.speed;
            let squeeze = Squeeze {
                solid_fraction: share * solid * whole / middle,
                time,
            };
            shop.squeeze(&soft.laws, &squeeze, &comet::relaxation(&soft))?;
            widths = shop.packing.domain.lengths();
        }
        self.comet.stiffen(shop, origin)?;
        shop.open();
        Ok(())
    }
}

/// Takes away, of every two grains that the periodic faces have put into each other, the smaller one.
fn part_faces(packing: &mut Packing) {
    let lengths = packing.domain.lengths();
    let largest = packing.grains.iter().map(|g| g.radius).fold(0.0, f64::max);
    let near = |grain: &Grain| {
        let above = grain.position - packing.domain.lower;
        let below = packing.domain.upper - grain.position;
        above.inf(&below).min() < 2.0 * largest
    };
    let rim: Vec<usize> = (0..packing.grains.len())
        .filter(|&i| near(&packing.grains[i]))
        .collect();
    let mut gone = vec![false; packing.grains.len()];
    for (k, &i) in rim.iter().enumerate() {
        for &j in &rim[..k] {
            let (a, b) = (&packing.grains[i], &packing.grains[j]);
            let apart = a.position - b.position;
            let images = apart.component_div(&lengths).map(f64::round);
            // Pairs within the block are those of the aggregate.
            if images == Vector3::zeros() || gone[i] || gone[j] {
                continue;
            }
            let distance = (apart - images.component_mul(&lengths)).norm();
            if distance < a.radius + b.radius {
                gone[if a.radius < b.radius { i } else { j }] = true;
            }
        }
    }
    let mut at = 0;
    packing.grains.retain(|_| {
        at += 1;
        !gone[at - 1]
    });
    packing.contacts.clear();
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn faces_lose_the_smaller_of_two_grains_that_meet() {
        let grain = |x: f64, radius: f64| Grain::at_rest(Vector3::new(x, 0.0, 0.0), radius, 1.0);
        let mut packing = Packing {
            domain: Domain {
                lower: Vector3::repeat(-10.0),
                upper: Vector3::repeat(10.0),
                periodic: [true; 3],
            },
            // The middle pair touches within the block; the outer two meet across the face.
            grains: vec![
                grain(-9.5, 1.0),
                grain(0.0, 1.0),
                grain(1.9, 1.0),
                grain(9.6, 0.5),
            ],
            contacts: Vec::new(),
            clumps: Vec::new(),
        };
        part_faces(&mut packing);
        let places: Vec<f64> = packing.grains.iter().map(|g| g.position.x).collect();
        assert_eq!(places, [-9.5, 0.0, 1.9]);
    }
}
