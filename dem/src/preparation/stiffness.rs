//! Stiffness for preparing: as soft as the expected speeds and loads allow.
//!
//! ```text
//! linear     x = max( v √(m/k_n),  4 p R²/k_n )                k_n = m (v/x)² is Thuillet 2019, Eq. 2.6
//! elastic    x = max( impact,  (3 p R²/(E* √R))^{2/3} )        Hertz; the impact's x falls as E*^{-2/5}
//! ```
//! is the overlap of the mean grain (mass m, radius R) with a wall at speed v and pressure p. All stiffnesses of a scene are
//! multiplied by one factor, so that x is a stated share of the smallest radius. Restitutions,
//! frictions and the force of cohesion stay. With v² and p in proportion to gravity the stiffness is
//! too: overlaps, and all springs as displacements, are then the same at every gravity.

use crate::contact::{
    ContactLaw, Damping, Laws, Normal, SpringStiffness, Tangential, hertz::impact_overlap,
};
use crate::grains::Grain;
use crate::setup::{SetupError, check};
use crate::timestep::Conditions;

/// The mean grain of a scene.
#[derive(Clone, Copy, Debug)]
pub(super) struct MeanGrain {
    pub mass: f64,
    pub radius: f64,
    pub smallest: f64,
}

impl MeanGrain {
    pub fn of(grains: &[Grain]) -> Result<MeanGrain, SetupError> {
        let count = grains.len() as f64;
        check("grains", count, "some", |n| n > 0.0)?;
        Ok(MeanGrain {
            mass: grains.iter().map(Grain::mass).sum::<f64>() / count,
            radius: grains.iter().map(|g| g.radius).sum::<f64>() / count,
            smallest: grains
                .iter()
                .map(|g| g.radius)
                .fold(f64::INFINITY, f64::min),
        })
    }
}

/// The factor on all stiffnesses at which the softest material meets the overlap (a share of the
/// smallest radius) under these conditions. Elastic moduli, being those of a material, never grow.
pub(super) fn factor(
    laws: &Laws,
    grain: &MeanGrain,
    conditions: &Conditions,
    overlap: f64,
) -> Result<f64, SetupError> {
    let allowed = overlap * grain.smallest;
    let mut largest: f64 = 0.0;
    for law in &laws.own {
        largest = largest.max(factor_of(law, grain, conditions, allowed)?);
    }
    check(
        "stages: factor of stiffness",
        largest,
        "> 0 (grains move or weigh)",
        |f| f > 0.0,
    )?;
    Ok(largest)
}

fn factor_of(
    law: &ContactLaw,
    grain: &MeanGrain,
    conditions: &Conditions,
    allowed: f64,
) -> Result<f64, SetupError> {
    let MeanGrain { mass, radius, .. } = *grain;
    let load = conditions.pressure * 4.0 * radius * radius;
    match &law.normal {
        Normal::Hooke(hooke) => {
            let moving = crate::timestep::stiffness(mass, conditions.speed, allowed);
            Ok(moving.max(load / allowed) / hooke.stiffness)
        }
        Normal::Jkr(_) => Err(SetupError::Composition(
            "JKR contacts have no free stiffness: their adhesion depends on it",
        )),
        elastic => {
            let modulus = elastic.elastic_modulus().unwrap_or(f64::NAN);
            // x falls as E^{-2/5} in an impact and as E^{-2/3} under a load.
            let struck = impact_overlap(modulus, mass, radius, conditions.speed);
            let pressed = (0.75 * load / (modulus * radius.sqrt())).powf(2.0 / 3.0);
            let needed = (struck / allowed)
                .powf(2.5)
                .max((pressed / allowed).powf(1.5));
            Ok(needed.min(1.0))
        }
    }
}

/// The same laws with all stiffnesses times a factor.
pub(super) fn scaled(laws: &Laws, factor: f64) -> Laws {
    Laws {
        own: laws.own.iter().map(|law| scaled_law(law, factor)).collect(),
        pairs: laws
            .pairs
            .iter()
            .map(|(a, b, law)| (*a, *b, scaled_law(law, factor)))
            .collect(),
    }
}

fn scaled_law(law: &ContactLaw, factor: f64) -> ContactLaw {
    let mut law = *law;
    // A rate of damping keeps its restitution if it follows the frequency of the contact.
    let rate = |damping: &mut Damping| {
        if let Damping::MassProportional(rate) = damping {
            *rate *= factor.sqrt();
        }
    };
    match &mut law.normal {
        Normal::Hooke(hooke) => {
            hooke.stiffness *= factor;
            rate(&mut hooke.damping);
        }
        Normal::Hertz(hertz) => hertz.effective_modulus *= factor,
        Normal::Viscoelastic(v) => {
            v.effective_modulus *= factor;
            // The restitution is a function of A E^{2/5} v^{1/5}.
            v.dissipation *= factor.powf(-0.4);
        }
        Normal::Jkr(_) => {}
    }
    match &mut law.tangential {
        Tangential::Linear(spring) => {
            if let SpringStiffness::Absolute(stiffness) = &mut spring.stiffness {
                *stiffness *= factor;
            }
            rate(&mut spring.damping);
        }
        Tangential::Mindlin(mindlin) => mindlin.effective_shear *= factor,
        Tangential::None | Tangential::Jkr => {}
    }
    law
}
