//! Bonds between grains, `[bonds.NAME]`, and cracks through them, `[cracks.NAME]`.

use super::{Materials, Place, RegionKeys, region};
use crate::scene::SceneError;
use colluvium_dem::{BondRule, Cement};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// Bonds of one cement (Potyondy & Cundall 2004).
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct BondKeys {
    /// Kinds of grains that bond to each other and among themselves; left out: all.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub materials: Vec<String>,
    /// Largest gap between surfaces over the mean of the two radii.
    #[schemars(extend("minimum" = 0.0, "maximum" = 1.0))]
    pub gap: f64,
    /// E of the cement (Pa).
    #[schemars(extend("exclusiveMinimum" = 0.0, "maximum" = 1.0e13))]
    pub youngs_modulus: f64,
    /// Normal over tangential stiffness.
    #[schemars(extend("exclusiveMinimum" = 0.0, "maximum" = 1.0e3))]
    pub stiffness_ratio: f64,
    /// Radius of a bond over that of its smaller grain.
    #[schemars(extend("exclusiveMinimum" = 0.0, "maximum" = 1.0))]
    pub radius_ratio: f64,
    /// Tensile strength of the cement (Pa); left out: unbreakable.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend("exclusiveMinimum" = 0.0, "maximum" = 1.0e13))]
    pub tensile_strength: Option<f64>,
    /// Shear strength of the cement (Pa); left out: unbreakable.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend("exclusiveMinimum" = 0.0, "maximum" = 1.0e13))]
    pub shear_strength: Option<f64>,
    /// Where the contact point must lie: where all of these are; left out: everywhere.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub within: Vec<RegionKeys>,
}

/// A part of space in which no bond holds from the start.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct CrackKeys {
    /// Where all of these are.
    pub within: Vec<RegionKeys>,
}

impl BondKeys {
    /// The rule, with the numbers of its materials.
    pub fn rule(&self, materials: &Materials, at: Place) -> Result<BondRule, SceneError> {
        let number = |name: &String| materials.number(name, "materials", at);
        let within = format!("{}.within", at.section);
        Ok(BondRule {
            cement: Cement {
                youngs_modulus: self.youngs_modulus,
                stiffness_ratio: self.stiffness_ratio,
                radius_ratio: self.radius_ratio,
                tensile_strength: self.tensile_strength.unwrap_or(f64::INFINITY),
                shear_strength: self.shear_strength.unwrap_or(f64::INFINITY),
            },
            gap: self.gap,
            materials: self
                .materials
                .iter()
                .map(number)
                .collect::<Result<_, _>>()?,
            within: region(
                &self.within,
                Place {
                    section: &within,
                    ..at
                },
            )?,
        })
    }
}

/// All rules of a scene, in the order of their names.
pub fn bond_rules(
    bonds: &BTreeMap<String, BondKeys>,
    materials: &Materials,
    origin: &str,
) -> Result<Vec<BondRule>, SceneError> {
    let rule = |(name, keys): (&String, &BondKeys)| {
        let section = format!("bonds.{name}");
        let at = Place {
            origin,
            section: &section,
        };
        keys.rule(materials, at)
    };
    bonds.iter().map(rule).collect()
}
