//! What preparations of cometary material share: its numbers, its laws while it is soft, and how it is made stiff.
//!
//! Grains are soft while they are put in place, which allows long steps, and are then made stiff by factors
//! of two:
//!
//! ```text
//! U(δ) = 2/5 δ^{5/2} - δ < 0  at  δ_0 = s^{2/3}        while s < 2.5
//! ```
//! in units of the new depth of rest and the pull-off force: a pair that rests at its old depth δ_0 when E is
//! raised by the factor s does not let go.
//!
//! ```text
//! σ_R = 1.1 φ/(1 - φ) F_c/d²        Rumpf's estimate of the strength (1962); F_c pull-off force of two mean
//!                                    grains, d their diameter
//! ```

use super::world::Workshop;
use super::world::workshop::Surroundings;
use crate::failure::Failure;
use crate::scene::world::Materials;
use crate::scene::{CometKeys, LawKeys, Softness};
use colluvium_dem::preparation::{Aggregate, Growth, Packing, Relaxation, Rest, Weight};
use colluvium_dem::{Grain, Normal};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use std::collections::BTreeMap;
use std::f64::consts::PI;

/// Factor by which grains are made stiffer at a time.
const STIFFER: f64 = 2.0;
/// Time of a stage over the time in which two mean grains part, √(m d/F_c) √(depth/d).
const OSCILLATIONS: f64 = 60.0;

/// A material, and what it is while it is put in place.
#[derive(Clone, Copy, Debug)]
pub struct Comet<'a> {
    /// The material.
    pub material: &'a CometKeys,
    /// What its grains are like meanwhile.
    pub soft: Softness,
    /// The contact law.
    pub contact: &'a LawKeys,
    /// Size of parcels over that of grains.
    pub coarse_graining: f64,
}

/// Mean diameter by number (m).
pub fn diameter(materials: &Materials) -> f64 {
    2.0 * materials.ingredients[0].sizes.mean()
}

/// Pull-off force of two mean grains (N).
pub fn pull_off(materials: &Materials) -> f64 {
    let reduced = 0.25 * diameter(materials);
    materials.first_law().cohesion.force(reduced)
}

/// Rest of grains that nothing but their cohesion moves: its acceleration is the unit. Contacts at rest
/// carry nothing, so their forces are no measure.
pub fn relaxation(materials: &Materials) -> Relaxation {
    let first = &materials.ingredients[0];
    let mass = first.density * PI / 6.0 * diameter(materials).powi(3);
    Relaxation {
        rest: Rest {
            kinetic: 1e-7,
            unbalanced: 1e9,
        },
        ..Relaxation::under(pull_off(materials) / mass)
    }
}

/// Depth at which two mean grains of Hertz' law rest under their cohesion, over their diameter.
fn depth(materials: &Materials) -> f64 {
    let d = diameter(materials);
    match materials.first_law().normal {
        Normal::Hertz(hertz) => {
            let reduced: f64 = 0.25 * d;
            let force = pull_off(materials);
            (0.75 * force / (hertz.effective_modulus * reduced.sqrt())).powf(2.0 / 3.0) / d
        }
        _ => 0.0,
    }
}

impl Comet<'_> {
    /// Rumpf's strength (Pa); the same for grains and for parcels.
    pub fn rumpf(&self, materials: &Materials) -> f64 {
        let solid = self.material.solid_fraction();
        let d = diameter(materials);
        1.1 * solid / (1.0 - solid) * pull_off(materials) / (d * d)
    }

    /// Mean grains that a volume of the material holds (m³).
    pub fn grains_in(&self, volume: f64, materials: &Materials) -> f64 {
        let sizes = &materials.ingredients[0].sizes;
        let mut random = ChaCha8Rng::seed_from_u64(0);
        let draws = 4000;
        let cubes: f64 = (0..draws).map(|_| sizes.draw(&mut random).powi(3)).sum();
        let mean = 4.0 / 3.0 * PI * cubes / f64::from(draws);
        debug_assert!(sizes.weight == Weight::Number);
        self.material.solid_fraction() * volume / mean
    }

    /// Grows a ballistic aggregate of soft grains about the origin: solid fraction 0.15, a tree of contacts.
    pub fn grow(
        &self,
        shop: &mut Workshop,
        soft: &Materials,
        grains: usize,
    ) -> Result<(), Failure> {
        let first = &soft.ingredients[0];
        shop.grow(&Aggregate {
            growth: Growth::ParticleCluster,
            grains,
            sizes: first.sizes.clone(),
            density: first.density,
            material: first.material,
            overlap: 0.5 * depth(soft),
            seed: shop.seed,
        })?;
        mix(soft, &mut shop.packing, shop.seed);
        Ok(())
    }

    /// The law under which a preparation ends: as stiff as the scene's own, with the preparation's
    /// restitution, so that the packing does not depend on the restitution that is tested.
    pub fn last(&self, origin: &str) -> Result<Surroundings, Failure> {
        let own = Comet {
            soft: Softness {
                friction: None,
                ..self.soft
            },
            ..*self
        };
        let materials = own.at_stiffness(self.stiff(), origin)?;
        Ok(Surroundings::none(materials.laws))
    }

    /// The materials while they are put in place, at this E (Pa).
    pub fn at_stiffness(&self, modulus: f64, origin: &str) -> Result<Materials, Failure> {
        let keys = self.soft.contact(self.contact, modulus);
        let none = BTreeMap::new();
        Ok(self
            .material
            .materials(&keys, &none, self.coarse_graining, origin)?)
    }

    /// E of the scene's own law (Pa).
    fn stiff(&self) -> f64 {
        self.contact.youngs_modulus.unwrap_or_default()
    }

    /// Makes soft grains as stiff as the scene's own law, and lets them rest.
    pub fn stiffen(&self, shop: &mut Workshop, origin: &str) -> Result<(), Failure> {
        let (soft, stiff) = (self.soft.youngs_modulus, self.stiff());
        let mut modulus = soft;
        let mut stages = 0;
        while modulus < stiff {
            modulus = (STIFFER * modulus).min(stiff);
            let materials = self.at_stiffness(modulus, origin)?;
            let unit = relaxation(&materials).acceleration;
            let time = OSCILLATIONS * (diameter(&materials) * depth(&materials) / unit).sqrt();
            shop.let_go(&Surroundings::none(materials.laws), time)?;
            stages += 1;
        }
        shop.note(
            "stiffen",
            format!("E from {soft:.3e} to {stiff:.3e} Pa in {stages} stages"),
        );
        let own = relaxation(shop.materials);
        shop.relax(&self.last(origin)?, &own)
    }
}

/// Gives grains their materials, so that the parts by volume are met to one grain.
fn mix(materials: &Materials, packing: &mut Packing, seed: u64) {
    let mut random = ChaCha8Rng::seed_from_u64(seed ^ MIXING);
    let mut order: Vec<usize> = (0..packing.grains.len()).collect();
    for k in (1..order.len()).rev() {
        order.swap(k, random.random_range(0..=k));
    }
    let mut filled = vec![0.0; materials.ingredients.len()];
    for k in order {
        let behind = |i: &usize| filled[*i] / materials.ingredients[*i].parts_by_volume;
        let next = (0..filled.len()).min_by(|a, b| behind(a).total_cmp(&behind(b)));
        let Some(i) = next else { continue };
        let grain: &mut Grain = &mut packing.grains[k];
        filled[i] += grain.volume();
        grain.material = materials.ingredients[i].material;
        grain.density = materials.ingredients[i].density;
    }
}

/// Sets the shuffle of materials apart from the growth.
const MIXING: u64 = 0x6d69_7865;
