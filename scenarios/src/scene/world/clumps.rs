//! Clumps of grains: `[clumps.NAME]`, balls that move as one. Those with a `count` are put in at random places when
//! the grains are in place; steps `[[prepare]]` insert or pour them by name.

use super::{Materials, Place, RegionKeys, Triple, region};
use crate::failure::Failure;
use colluvium_dem::preparation::{ClumpShape, Scattered, Scattering, scatter};
use colluvium_dem::{Clump, Domain, Grain, MassProperties};
use nalgebra::Matrix3;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// A ball of a clump, in the clump's own axes.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct BallKeys {
    /// Its centre (m).
    pub point: Triple,
    /// Its radius (m).
    #[schemars(extend("exclusiveMinimum" = 0.0, "maximum" = 1.0e6))]
    pub radius: f64,
}

/// Clumps of one shape. Forces on their balls move and turn them as rigid bodies; their balls meet whatever grains
/// meet, but not each other.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ClumpKeys {
    /// Its balls; they may overlap.
    #[schemars(length(min = 1))]
    pub balls: Vec<BallKeys>,
    /// How many are put in after the preparation; left out: those of the steps `[[prepare]]` alone.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend("minimum" = 1, "maximum" = 5000000))]
    pub count: Option<usize>,
    /// Where they are put, at random, turned at random, clear of each other and of grains: where all of these are.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub within: Vec<RegionKeys>,
    /// Their velocity at the start (m/s); left out: at rest.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub velocity: Option<Triple>,
    /// Kind of grains that they are of; left out: the first.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub material: Option<String>,
    /// Mass (kg); left out: the volume of the balls, where they overlap counted once, of the material's density.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend("exclusiveMinimum" = 0.0, "maximum" = 1.0e12))]
    pub mass: Option<f64>,
    /// Inertia tensor about the centre of mass in its own axes: xx, yy, zz, yz, zx, xy (kg m²); left out: as
    /// that volume spreads the mass.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub inertia: Option<[f64; 6]>,
    /// Centre of mass in its own axes, with `inertia` (m); left out: the origin.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub centre: Option<Triple>,
}

impl ClumpKeys {
    /// The shape.
    pub fn shape(&self, materials: &Materials, at: Place) -> Result<ClumpShape, Failure> {
        let without = self.centre.is_some() && self.inertia.is_none();
        at.unread(&[("centre", without)], "a clump without `inertia`")?;
        let material = match &self.material {
            Some(name) => materials.number(name, "material", at)?,
            None => 0,
        };
        let density = materials.densities.get(usize::from(material)).copied();
        let density = density.ok_or_else(|| {
            let kinds = materials.names[..materials.densities.len()].join(", ");
            let named = self.material.clone().unwrap_or_default();
            at.refuse("material", named, format!("a kind of grains: {kinds}"))
        })?;
        let balls = self.balls.iter().map(|b| (b.point.into(), b.radius));
        let mut shape = ClumpShape::of_balls(balls.collect(), density);
        shape.material = material;
        if let Some([xx, yy, zz, yz, zx, xy]) = self.inertia {
            shape.mass = MassProperties {
                mass: at.need(&self.mass, "mass", "kg, with an inertia")?,
                centre: self.centre.unwrap_or_default().into(),
                inertia: Matrix3::new(xx, xy, zx, xy, yy, yz, zx, yz, zz),
            };
        } else if let Some(mass) = self.mass {
            shape.mass = shape.mass.scaled_to(mass);
        }
        shape
            .validate(at.section)
            .map_err(|error| Failure::Input(format!("{}: {error}", at.origin)))?;
        Ok(shape)
    }
}

/// All clumps of a scene.
#[derive(Clone, Debug, Default)]
pub struct AllClumps {
    /// Their grains, behind those of the packing in number.
    pub grains: Vec<Grain>,
    /// Grains by clump.
    pub clumps: Vec<Clump>,
}

/// Puts the clumps of a scene among grains in a box, in the order of their names.
pub fn clumps(
    keys: &BTreeMap<String, ClumpKeys>,
    materials: &Materials,
    (domain, among): (Domain, &[Grain]),
    seed: u64,
    origin: &str,
) -> Result<AllClumps, Failure> {
    let mut all = AllClumps::default();
    let mut taken = if keys.is_empty() {
        Vec::new()
    } else {
        among.to_vec()
    };
    for (k, (name, keys)) in keys.iter().enumerate() {
        let section = format!("clumps.{name}");
        let at = Place {
            origin,
            section: &section,
        };
        let within = at.key("within");
        let region_at = Place {
            section: &within,
            ..at
        };
        let shape = keys.shape(materials, at)?;
        let Some(count) = keys.count else {
            continue;
        };
        if keys.within.is_empty() {
            return Err(at.missing("within", "regions: [{ shape, … }]").into());
        }
        let spec = Scattering {
            shape,
            region: region(&keys.within, region_at)?,
            domain,
            count,
            velocity: keys.velocity.unwrap_or_default().into(),
            // A kind of its own numbers.
            seed: seed.wrapping_add(0x9e37_79b9_7f4a_7c15_u64.wrapping_mul(k as u64 + 1)),
        };
        let first = (among.len() + all.grains.len()) as u32;
        let put: Scattered = scatter(&spec, &taken, first).map_err(|error| {
            Failure::Input(format!(
                "{origin}: key `clumps.{name}.count` = {count}: {error}"
            ))
        })?;
        taken.extend(put.hulls);
        all.grains.extend(put.grains);
        all.clumps.extend(put.clumps);
    }
    Ok(all)
}
