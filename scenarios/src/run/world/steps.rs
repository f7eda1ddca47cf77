//! The steps `[[prepare]]` of a scene, done one after the other in the workshop.

use super::workshop::{Surroundings, Workshop, with_friction};
use crate::failure::Failure;
use crate::scene::world::{ClumpKeys, Materials, Place, PrepareKeys, PrepareKind};
use colluvium_dem::preparation::{
    Aggregate, Amount, CentralCompaction, Insertion, Relaxation, Stages, TRIES,
};
use colluvium_dem::{Domain, Grain, Wall};
use nalgebra::{UnitQuaternion, Vector3};
use std::collections::BTreeMap;

/// Acceleration that rest is measured by where nothing pulls (m/s²).
const NONE: f64 = 1e-3;

/// What surrounds the grains of all steps: the scene's own walls and its gravity at the start.
#[derive(Clone, Debug)]
pub struct Around {
    /// Walls.
    pub walls: Vec<Wall>,
    /// Uniform acceleration (m/s²).
    pub gravity: Vector3<f64>,
}

impl Around {
    /// Acceleration that rest is measured by (m/s²).
    pub fn acceleration(&self) -> f64 {
        let g = self.gravity.norm();
        if g > 0.0 { g } else { NONE }
    }
}

/// Solid fraction of the densest random heap of many equal grains (Scott and Kilgour, J. Phys. D 2 (1969): 0.637); also a bound for
/// random places of those that differ by less than a factor of two, which fill far less.
const HEAP: f64 = 0.64;
/// Largest grains whose volume makes a region wide: a few may fill one that is made for them.
const MANY: f64 = 1000.0;

/// Whether grains that are inserted can find room in their regions at all.
pub fn check_room(
    steps: &[PrepareKeys],
    materials: &Materials,
    (domain, seed): (Domain, u64),
    origin: &str,
) -> Result<(), Failure> {
    for (k, keys) in steps.iter().enumerate() {
        // Regions after these lie in another box.
        let moves = [
            PrepareKind::Jam,
            PrepareKind::Grow,
            PrepareKind::Scale,
            PrepareKind::Place,
        ];
        if moves.contains(&keys.r#do) {
            break;
        }
        if keys.r#do != PrepareKind::Insert || keys.clumps.is_some() {
            continue;
        }
        let section = format!("prepare[{k}]");
        let at = Place {
            origin,
            section: &section,
        };
        let step = keys.step(at)?;
        let Some(amount) = step.amount else {
            continue;
        };
        let kinds = &materials.ingredients;
        let insertion = Insertion {
            region: step.region,
            domain,
            ingredients: kinds.clone(),
            amount,
            gap: 0.0,
            velocity: Vector3::zeros(),
            tries: TRIES,
            seed,
        };
        let [solid, volume] = insertion
            .volumes()
            .map_err(|error| Failure::Input(format!("{origin}: {section}: {error}")))?;
        let largest = kinds.iter().map(|i| i.sizes.largest()).fold(0.0, f64::max);
        let smallest = kinds.iter().map(|i| i.sizes.smallest());
        let smallest = smallest.fold(f64::INFINITY, f64::min);
        let alike = largest <= 2.0 * smallest;
        let wide = volume > MANY * Grain::at_rest(Vector3::zeros(), largest, 1.0).volume();
        let densest = if alike && wide { HEAP } else { 1.0 };
        let asked = solid / volume;
        if asked > densest {
            let (key, value) = match amount {
                Amount::Grains(count) => ("count", count.to_string()),
                Amount::SolidFraction(share) => ("solid_fraction", share.to_string()),
                Amount::Mass(mass) => ("mass", mass.to_string()),
            };
            let room = format!(
                "what fills less than {densest} of its region (`within`), where random places end near 0.38 for equal \
                 grains; this would fill {asked:.3}"
            );
            return Err(at.refuse(key, value, room).into());
        }
    }
    Ok(())
}

/// Does all steps.
pub fn prepare(
    shop: &mut Workshop,
    steps: &[PrepareKeys],
    clumps: &BTreeMap<String, ClumpKeys>,
    around: &Around,
    origin: &str,
) -> Result<(), Failure> {
    for (k, keys) in steps.iter().enumerate() {
        let section = format!("prepare[{k}]");
        let place = Place {
            origin,
            section: &section,
        };
        step(shop, keys, clumps, around, place)?;
    }
    Ok(())
}

fn step(
    shop: &mut Workshop,
    keys: &PrepareKeys,
    clumps: &BTreeMap<String, ClumpKeys>,
    around: &Around,
    at: Place,
) -> Result<(), Failure> {
    let step = keys.step(at)?;
    let acceleration = around.acceleration();
    let laws = match keys.friction {
        Some(friction) => with_friction(&shop.materials.laws, friction),
        None => shop.materials.laws.clone(),
    };
    let surroundings = Surroundings {
        laws,
        walls: around.walls.clone(),
        gravity: around.gravity,
        speed: 0.0,
    };
    let relaxation = |acceleration: f64| {
        let usual = Relaxation::under(acceleration);
        Relaxation {
            damping: keys.damping.unwrap_or(usual.damping),
            patience: keys.patience.unwrap_or(usual.patience),
            ..usual
        }
    };
    let velocity = Vector3::from(keys.velocity.unwrap_or_default());
    let point = Vector3::from(keys.point.unwrap_or_default());
    let shape = match keys
        .clumps
        .as_ref()
        .and_then(|name| clumps.get_key_value(name))
    {
        Some((name, clump)) => {
            let section = format!("clumps.{name}");
            let own = Place {
                section: &section,
                ..at
            };
            Some(clump.shape(shop.materials, own)?)
        }
        None => None,
    };
    match (keys.r#do, step.amount) {
        (PrepareKind::Insert, Some(amount)) => match (shape, amount) {
            (Some(shape), Amount::Grains(count)) => {
                shop.insert_clumps(shape, (step.region, count), velocity)
            }
            _ => shop.insert(step.region, amount, velocity),
        },
        (PrepareKind::Put, _) => {
            let number = match &keys.material {
                Some(name) => shop.materials.number(name, "material", at)?,
                None => shop.materials.ingredients[0].material,
            };
            let kind = shop
                .materials
                .ingredients
                .iter()
                .find(|i| i.material == number);
            let Some(kind) = kind else {
                let name = keys.material.clone().unwrap_or_default();
                return Err(at
                    .refuse(
                        "material",
                        name,
                        "a kind of grains with a part of the volume",
                    )
                    .into());
            };
            let (mean, density) = (kind.sizes.mean(), kind.density);
            let grain = |(point, radius): ([f64; 3], Option<f64>)| Grain {
                velocity,
                material: number,
                ..Grain::at_rest(point.into(), radius.unwrap_or(mean), density)
            };
            let grains = keys.places(at)?.into_iter().map(grain).collect();
            shop.put(grains);
            Ok(())
        }
        (PrepareKind::Pour, Some(amount)) => {
            let surroundings = Surroundings {
                speed: velocity.norm(),
                ..surroundings
            };
            let how = (velocity, keys.interval);
            let rest = relaxation(acceleration);
            if let (Some(shape), Amount::Grains(count)) = (shape, amount) {
                return shop.pour_clumps(&surroundings, (shape, step.region, count), how, &rest);
            }
            shop.pour(&surroundings, (step.region, amount), how, &rest)
        }
        (PrepareKind::Relax, _) => shop.relax(&surroundings, &relaxation(acceleration)),
        (PrepareKind::Stages, _) => {
            let usual = Stages::at(&keys.gravities.clone().unwrap_or_default());
            let stages = Stages {
                damping: keys.damping.unwrap_or(usual.damping),
                patience: keys.patience.unwrap_or(usual.patience),
                ..usual
            };
            shop.stages(&surroundings, &stages)
        }
        (PrepareKind::Compact, _) => {
            let accelerations = keys.accelerations.unwrap_or([acceleration; 2]);
            let spec = CentralCompaction {
                center: point,
                probe: keys.radius.unwrap_or_default(),
                solid_fraction: keys.solid_fraction.unwrap_or_default(),
                tolerance: keys.tolerance.unwrap_or(0.02),
                accelerations,
                relaxation: relaxation(accelerations[0]),
            };
            let fall = compaction_speed(shop, accelerations[1], point);
            let surroundings = Surroundings {
                walls: Vec::new(),
                gravity: Vector3::zeros(),
                speed: fall,
                ..surroundings
            };
            shop.compact(&surroundings, &spec)
        }
        (PrepareKind::Jam, _) => shop.jam(keys.count.unwrap_or_default()),
        (PrepareKind::Grow, _) => {
            let first = &shop.materials.ingredients[0];
            let spec = Aggregate {
                growth: keys.growth(),
                grains: keys.count.unwrap_or_default(),
                sizes: first.sizes.clone(),
                density: first.density,
                material: first.material,
                overlap: 0.0,
                seed: shop.seed,
            };
            shop.grow(&spec)
        }
        (PrepareKind::Trim, _) => shop.trim(&step.region, keys.whole.unwrap_or(false)),
        (PrepareKind::Glue, _) => shop.glue(&step.region),
        (PrepareKind::Scale, _) => shop.scale(keys.factor.unwrap_or(1.0)),
        (PrepareKind::Place, _) => {
            let turn = Vector3::from(keys.turn_degrees.unwrap_or_default()) * 1f64.to_radians();
            shop.place(UnitQuaternion::from_scaled_axis(turn), point)
        }
        // Every step that needs an amount has been checked to have one.
        (PrepareKind::Insert | PrepareKind::Pour, None) => Ok(()),
    }
}

/// Speed of two grains that meet after a fall to the point from the farthest place (m/s).
pub fn compaction_speed(shop: &Workshop, acceleration: f64, point: Vector3<f64>) -> f64 {
    let away = shop
        .packing
        .grains
        .iter()
        .map(|g| (g.position - point).norm());
    let farthest = away.fold(0.0, f64::max);
    2.0 * (2.0 * acceleration * farthest).sqrt()
}
