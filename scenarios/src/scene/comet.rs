//! The material of a comet's surface: dust and ice in one of the mixtures of Kappel et al. (2020, §2–3).
//!
//! Both kinds have the same sizes, elasticity and cohesion; they differ in density, and only ice sinters.
//! The solid fraction is what gives the mixture the bulk density of the comet,
//!
//! ```text
//! φ = ρ_b (p_d + p_i)/(p_d ρ_d + p_i ρ_i)        p parts by volume; ρ_b = 538 kg/m³ for 67P
//! ```

use super::world::{
    GrainMaterialKeys, Materials, Place, SizeKeys, SizeKind, SurfaceKeys, materials,
};
use super::{CohesionKind, LawKeys, SceneError};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// Mixtures of dust and ice by volume.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum MixKind {
    /// Dust alone.
    Dust,
    /// Two parts of dust, one of ice.
    TwoToOne,
    /// As much dust as ice.
    OneToOne,
    /// Ice alone.
    Ice,
}

impl MixKind {
    /// Parts of dust and of ice by volume.
    pub fn parts(self) -> [f64; 2] {
        match self {
            MixKind::Dust => [1.0, 0.0],
            MixKind::TwoToOne => [2.0, 1.0],
            MixKind::OneToOne => [1.0, 1.0],
            MixKind::Ice => [0.0, 1.0],
        }
    }

    /// In words.
    pub fn words(self) -> &'static str {
        match self {
            MixKind::Dust => "dust",
            MixKind::TwoToOne => "dust and ice 2:1",
            MixKind::OneToOne => "dust and ice 1:1",
            MixKind::Ice => "ice",
        }
    }
}

/// What the material is.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct CometKeys {
    /// Dust and ice by volume.
    pub mix: MixKind,
    /// Whether ice that touches ice is bonded.
    pub sintered: bool,
    /// Diameter of the smallest grains (m).
    #[schemars(extend("exclusiveMinimum" = 0.0, "maximum" = 1.0))]
    pub smallest_diameter: f64,
    /// Diameter of the largest grains (m).
    #[schemars(extend("exclusiveMinimum" = 0.0, "maximum" = 1.0))]
    pub largest_diameter: f64,
    /// Index of the size law: N(> r) ∝ r^-index.
    #[schemars(extend("minimum" = -20.0, "maximum" = 20.0))]
    pub size_index: f64,
    /// Equally spaced radii that the law is gathered on.
    #[schemars(extend("minimum" = 1, "maximum" = 1000))]
    pub size_bins: usize,
    /// Density of dust grains (kg/m³).
    #[schemars(extend("exclusiveMinimum" = 0.0, "maximum" = 30000.0))]
    pub dust_density: f64,
    /// Density of ice grains (kg/m³).
    #[schemars(extend("exclusiveMinimum" = 0.0, "maximum" = 30000.0))]
    pub ice_density: f64,
    /// Density of the whole (kg/m³).
    #[schemars(extend("exclusiveMinimum" = 0.0, "maximum" = 30000.0))]
    pub bulk_density: f64,
}

/// How a block of the material is made.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct CometBlockKeys {
    /// E while grains are pressed together (Pa): soft grains allow long steps; then it is raised in steps.
    #[schemars(extend("exclusiveMinimum" = 0.0, "maximum" = 1.0e13))]
    pub youngs_modulus: f64,
    /// Restitution while the block is made.
    #[schemars(extend("minimum" = 0.01, "maximum" = 1.0))]
    pub restitution: f64,
    /// Friction and rolling friction while the block is made: the less, the more contacts it ends with.
    #[schemars(extend("minimum" = 0.0, "maximum" = 10.0))]
    pub friction: f64,
    /// Speed at which neighbours close in at the end (m/s).
    #[schemars(extend("exclusiveMinimum" = 0.0, "maximum" = 10.0))]
    pub speed: f64,
    /// Material around what is cut out of the block, in mean diameters of parcels.
    #[schemars(extend("minimum" = 0.0, "maximum" = 100.0))]
    pub margin: f64,
}

impl CometBlockKeys {
    /// What grains are like meanwhile.
    pub fn softness(&self) -> Softness {
        Softness {
            youngs_modulus: self.youngs_modulus,
            restitution: self.restitution,
            friction: Some(self.friction),
        }
    }
}

/// What grains are like while they are put in place.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Softness {
    /// E (Pa), below that of the scene's law.
    pub youngs_modulus: f64,
    /// Restitution.
    pub restitution: f64,
    /// Friction and rolling friction, where they are not those of the scene's law.
    pub friction: Option<f64>,
}

impl Softness {
    /// The law in which grains are put in place, at this E (Pa).
    pub fn contact(&self, contact: &LawKeys, youngs_modulus: f64) -> LawKeys {
        LawKeys {
            youngs_modulus: Some(youngs_modulus),
            restitution: Some(self.restitution),
            friction: contact.friction.map(|own| self.friction.unwrap_or(own)),
            rolling_friction: contact
                .rolling_friction
                .map(|own| self.friction.unwrap_or(own)),
            ..*contact
        }
    }

    /// The law has an E that can be raised to.
    pub fn check_together(&self, contact: &LawKeys, origin: &str) -> Result<(), SceneError> {
        let at = Place {
            origin,
            section: "preparation",
        };
        let law = Place {
            origin,
            section: "contact",
        };
        let cohesion = contact.parts().cohesion;
        if cohesion == CohesionKind::None {
            let range = "one that holds the grains together: dmt, scheeres or constant";
            return Err(law.refuse("cohesion", cohesion.word(), range));
        }
        let stiff = contact.youngs_modulus.ok_or_else(|| {
            law.missing(
                "youngs_modulus",
                "E in Pa: grains are made softer while they are put in place",
            )
        })?;
        if self.youngs_modulus > stiff {
            let range = format!("at most that of [contact], {stiff} Pa");
            return Err(at.refuse("youngs_modulus", self.youngs_modulus, range));
        }
        Ok(())
    }
}

impl CometKeys {
    /// Its materials under a contact law, of parcels `factor` times as large.
    pub fn materials(
        &self,
        contact: &LawKeys,
        surfaces: &BTreeMap<String, SurfaceKeys>,
        factor: f64,
        origin: &str,
    ) -> Result<Materials, SceneError> {
        materials(&self.grains(), surfaces, contact, factor, origin)
    }

    /// The kinds of grains, `dust` and `ice`.
    pub fn grains(&self) -> BTreeMap<String, GrainMaterialKeys> {
        let sizes = SizeKeys {
            law: SizeKind::BinnedPowerLaw,
            radius: None,
            smallest: Some(0.5 * self.smallest_diameter),
            largest: Some(0.5 * self.largest_diameter),
            index: Some(self.size_index),
            bins: Some(self.size_bins),
            relative_deviation: None,
            cut: None,
            radii: None,
            shares: None,
            by: None,
        };
        let kind = |density: f64, parts: f64| GrainMaterialKeys {
            density,
            parts,
            sizes: sizes.clone(),
            contact: None,
        };
        let [dust, ice] = self.mix.parts();
        BTreeMap::from([
            ("dust".to_owned(), kind(self.dust_density, dust)),
            ("ice".to_owned(), kind(self.ice_density, ice)),
        ])
    }

    /// Density of the grains' material (kg/m³).
    pub fn solid_density(&self) -> f64 {
        let [dust, ice] = self.mix.parts();
        (dust * self.dust_density + ice * self.ice_density) / (dust + ice)
    }

    /// Solid fraction that the bulk density asks for.
    pub fn solid_fraction(&self) -> f64 {
        self.bulk_density / self.solid_density()
    }

    /// Sizes and solid fraction within what can be made.
    pub fn check_together(&self, origin: &str) -> Result<(), SceneError> {
        let refuse = |key: &str, value: f64, range: String| {
            Err(SceneError::OutOfRange {
                file: origin.to_owned(),
                key: format!("material.{key}"),
                value: value.to_string(),
                range,
            })
        };
        if self.largest_diameter < self.smallest_diameter {
            let range = format!("at least the smallest diameter, {}", self.smallest_diameter);
            return refuse("largest_diameter", self.largest_diameter, range);
        }
        let solid = self.solid_fraction();
        if !(MIN_SOLID..=MAX_SOLID).contains(&solid) {
            let range = format!(
                "such that the solid fraction of {} lies in [{MIN_SOLID}, {MAX_SOLID}]; it would be {solid:.3}",
                self.mix.words()
            );
            return refuse("bulk_density", self.bulk_density, range);
        }
        Ok(())
    }
}

/// Solid fractions between which grains hang together and are not yet pressed.
const MIN_SOLID: f64 = 0.16;
const MAX_SOLID: f64 = 0.6;

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn mixtures_have_the_papers_porosities() {
        let keys = |mix| CometKeys {
            mix,
            sintered: false,
            smallest_diameter: 1e-3,
            largest_diameter: 2e-3,
            size_index: 2.5,
            size_bins: 8,
            dust_density: 2000.0,
            ice_density: 920.0,
            bulk_density: 538.0,
        };
        // 73 % of dust, 63 % of the 1:1 mixture (Kappel et al. 2020, §4.1).
        assert!((1.0 - keys(MixKind::Dust).solid_fraction() - 0.73).abs() < 0.005);
        assert!((1.0 - keys(MixKind::OneToOne).solid_fraction() - 0.63).abs() < 0.005);
        assert!((keys(MixKind::OneToOne).solid_density() - 1460.0).abs() < 1e-9);
    }
}
