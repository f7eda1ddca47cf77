//! What grains and walls are made of: `[grains.NAME]`, `[surfaces.NAME]`, and the law `[contact]` that all
//! share where they do not say otherwise.

use super::{Place, SizeKeys};
use crate::scene::{LawKeys, SceneError};
use colluvium_dem::preparation::Ingredient;
use colluvium_dem::{ContactLaw, LawTable, Laws};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// One kind of grains.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct GrainMaterialKeys {
    /// Density of the material (kg/m³).
    #[schemars(extend("exclusiveMinimum" = 0.0, "maximum" = 30000.0))]
    pub density: f64,
    /// Its part of the volume of all grains, in any unit; left out: 1.
    #[serde(default = "one")]
    #[schemars(extend("minimum" = 0.0, "maximum" = 1.0e6))]
    pub parts: f64,
    /// Law of its radii.
    pub sizes: SizeKeys,
    /// Numbers of the contact law that differ from `[contact]`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub contact: Option<LawKeys>,
}

fn one() -> f64 {
    1.0
}

/// A material of walls alone.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SurfaceKeys {
    /// Numbers of the contact law that differ from `[contact]`.
    pub contact: LawKeys,
}

/// All materials of a scene, grains first, each kind in the order of names.
#[derive(Clone, Debug)]
pub struct Materials {
    /// Names; their order is their number in the law table.
    pub names: Vec<String>,
    /// Contact laws of all, of parcels where there are any.
    pub laws: Laws,
    /// What grains are drawn from; kinds without a part are left out.
    pub ingredients: Vec<Ingredient>,
    /// Densities of the kinds of grains (kg/m³).
    pub densities: Vec<f64>,
}

impl Materials {
    /// The number of a material.
    pub fn number(&self, name: &str, key: &str, at: Place) -> Result<u16, SceneError> {
        let place = self.names.iter().position(|known| known == name);
        place
            .map(|k| k as u16)
            .ok_or_else(|| at.refuse(key, name, format!("one of {}", self.names.join(", "))))
    }

    /// The law of the first kind.
    pub fn first_law(&self) -> &ContactLaw {
        &self.laws.own[0]
    }
}

/// Numbers of `upper` laid over those of `base`.
fn laid_over(base: &LawKeys, upper: &LawKeys) -> LawKeys {
    let both = (toml::Table::try_from(base), toml::Table::try_from(upper));
    let (Ok(mut table), Ok(upper)) = both else {
        return *base;
    };
    table.extend(upper);
    table.try_into().unwrap_or(*base)
}

/// The materials of a scene whose parcels are `factor` times as large as its grains.
pub fn materials(
    grains: &BTreeMap<String, GrainMaterialKeys>,
    surfaces: &BTreeMap<String, SurfaceKeys>,
    contact: &LawKeys,
    factor: f64,
    origin: &str,
) -> Result<Materials, SceneError> {
    let top = Place {
        origin,
        section: "",
    };
    if grains.is_empty() {
        return Err(top.missing("grains", "a section [grains.NAME] at least"));
    }
    let law = |own: Option<&LawKeys>, section: &str| -> Result<ContactLaw, SceneError> {
        let keys = match own {
            Some(own) => {
                check_own(contact, own, origin, section)?;
                laid_over(contact, own)
            }
            None => *contact,
        };
        Ok(keys.law(origin)?.coarse_grained(factor))
    };
    let mut found = Materials {
        names: Vec::new(),
        laws: Laws::default(),
        ingredients: Vec::new(),
        densities: Vec::new(),
    };
    for (name, keys) in grains {
        let section = format!("grains.{name}");
        let sizes = format!("{section}.sizes");
        let sizes = keys.sizes.law(
            factor,
            Place {
                origin,
                section: &sizes,
            },
        )?;
        if keys.parts > 0.0 {
            found.ingredients.push(Ingredient {
                sizes,
                density: keys.density,
                material: found.names.len() as u16,
                parts_by_volume: keys.parts,
            });
        }
        found.densities.push(keys.density);
        found.names.push(name.clone());
        found.laws.own.push(law(keys.contact.as_ref(), &section)?);
    }
    for (name, keys) in surfaces {
        if grains.contains_key(name) {
            let range = "a name that no grains have: grains may be the material of a wall";
            return Err(top.refuse(&format!("surfaces.{name}"), name, range));
        }
        found.names.push(name.clone());
        let section = format!("surfaces.{name}");
        found.laws.own.push(law(Some(&keys.contact), &section)?);
    }
    if found.ingredients.is_empty() {
        return Err(top.refuse("grains.*.parts", 0, "above 0 for one kind at least"));
    }
    LawTable::new(&found.laws).map_err(|error| SceneError::Unreadable {
        file: origin.to_owned(),
        message: error.to_string(),
    })?;
    Ok(found)
}

/// Refuses keys of a material that the law does not read.
fn check_own(base: &LawKeys, own: &LawKeys, origin: &str, section: &str) -> Result<(), SceneError> {
    let reads = base.parts().reads();
    let table = toml::Table::try_from(own).unwrap_or_default();
    let stray = table.iter().find(|(key, _)| !reads.contains(&key.as_str()));
    match stray {
        Some((key, value)) => Err(SceneError::Unread {
            file: origin.to_owned(),
            key: format!("{section}.contact.{key}"),
            value: value.to_string(),
            law: format!("that of [contact]; its keys: {}", reads.join(", ")),
        }),
        None => Ok(()),
    }
}
