//! A scene of grains of one's own: all sections, nothing taken for granted.
//!
//! A file of this kind stands for itself: keys it leaves out are left out, and not those of the bundled
//! example.

use super::world::{
    BodyKeys, BondKeys, BoundaryKeys, ClumpKeys, CrackKeys, GrainMaterialKeys, GravityKeys,
    Materials, OutputKeys, Place, PrepareKeys, StepKeys, SurfaceKeys, Triple, WallKeys, materials,
};
use super::{LawKeys, SceneError};
use colluvium_dem::BoxMotion;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// Grains, walls, bonds, gravity and a preparation, as the file says.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct GrainsScene {
    /// Seed of all random numbers.
    #[serde(default)]
    #[schemars(extend("minimum" = 0, "maximum" = 9007199254740991_i64))]
    pub seed: u64,
    /// Size of the computed parcels over that of the grains; left out: 1.
    #[serde(default = "one")]
    #[schemars(extend("minimum" = 1.0, "maximum" = 1.0e6))]
    pub coarse_graining: f64,
    /// Time that is simulated after the preparation (s).
    #[schemars(extend("exclusiveMinimum" = 0.0, "maximum" = 1.0e9))]
    pub duration: f64,
    /// A packing to start from: a name, under which the preparation is kept and found again, or a file
    /// of an earlier run, `packing.h5`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub packing: Option<String>,
    /// Velocity that all free grains are given at the start (m/s).
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub velocity: Option<Triple>,
    /// The step.
    #[serde(default)]
    pub timestep: StepKeys,
    /// What is written.
    #[serde(default)]
    pub output: OutputKeys,
    /// The law of all contacts.
    pub contact: LawKeys,
    /// Kinds of grains by name.
    pub grains: BTreeMap<String, GrainMaterialKeys>,
    /// Materials of walls by name.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub surfaces: BTreeMap<String, SurfaceKeys>,
    /// Walls by name.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub walls: BTreeMap<String, WallKeys>,
    /// Rigid bodies by name; they are put in after the preparation.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub bodies: BTreeMap<String, BodyKeys>,
    /// Clumps of grains by name; they are put in after the preparation, or by its steps.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub clumps: BTreeMap<String, ClumpKeys>,
    /// Bonds by name; they are made after the preparation.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub bonds: BTreeMap<String, BondKeys>,
    /// Cracks by name.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub cracks: BTreeMap<String, CrackKeys>,
    /// What pulls the grains.
    #[serde(default)]
    pub gravity: GravityKeys,
    /// The box; left out: open space.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub boundaries: Option<BoundaryKeys>,
    /// How grains are put in place.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub prepare: Vec<PrepareKeys>,
}

fn one() -> f64 {
    1.0
}

impl GrainsScene {
    /// Its materials, of parcels where there are any.
    pub fn materials(&self, origin: &str) -> Result<Materials, SceneError> {
        materials(
            &self.grains,
            &self.surfaces,
            &self.contact,
            self.coarse_graining,
            origin,
        )
    }

    pub(super) fn check_together(&self, origin: &str) -> Result<(), SceneError> {
        self.materials(origin)?;
        if self.prepare.is_empty()
            && self.packing.is_none()
            && self.bodies.is_empty()
            && self.clumps.is_empty()
        {
            return Err(SceneError::MissingKey {
                file: origin.to_owned(),
                key: "prepare".into(),
                wanted:
                    "steps [[prepare]], a `packing` to start from, or bodies or clumps alone: [bodies.NAME], [clumps.NAME]"
                        .into(),
            });
        }
        if let Some(name) = self
            .bodies
            .keys()
            .find(|name| self.walls.contains_key(*name))
        {
            let at = Place {
                origin,
                section: "bodies",
            };
            return Err(at.refuse(name, name, "a name that no wall has"));
        }
        for (k, step) in self.prepare.iter().enumerate() {
            let section = format!("prepare[{k}]");
            let at = Place {
                origin,
                section: &section,
            };
            step.step(at)?;
            if let Some(name) = step
                .material
                .as_ref()
                .filter(|n| !self.grains.contains_key(*n))
            {
                let known: Vec<&str> = self.grains.keys().map(String::as_str).collect();
                return Err(at.refuse("material", name, format!("one of {}", known.join(", "))));
            }
            if let Some(name) = step
                .clumps
                .as_ref()
                .filter(|n| !self.clumps.contains_key(*n))
            {
                let known: Vec<&str> = self.clumps.keys().map(String::as_str).collect();
                let allowed = format!("a name in [clumps]: {}", known.join(", "));
                return Err(at.refuse("clumps", name, allowed));
            }
        }
        let unused = |name: &&String| self.clumps[*name].count.is_none() && !self.prepares(name);
        if let Some(name) = self.clumps.keys().find(unused) {
            let section = format!("clumps.{name}");
            let at = Place {
                origin,
                section: &section,
            };
            return Err(at.missing("count", "how many, or a step [[prepare]] that names them"));
        }
        self.check_clumps_in_box(origin)
    }

    /// Whether a step of the preparation puts clumps of a name in.
    pub fn prepares(&self, clumps: &str) -> bool {
        let mut named = self
            .prepare
            .iter()
            .filter_map(|step| step.clumps.as_deref());
        named.any(|name| name == clumps)
    }

    /// Clumps of the preparation meet the run's box only when it is done: too late to refuse them.
    fn check_clumps_in_box(&self, origin: &str) -> Result<(), SceneError> {
        let Some(boundaries) = &self.boundaries else {
            return Ok(());
        };
        let clumps = self.prepare.iter().any(|step| step.clumps.is_some());
        if clumps && boundaries.motion(origin)? != BoxMotion::Rest {
            let at = Place {
                origin,
                section: "boundaries",
            };
            let allowed = "a box at rest: clumps do not go through boundaries that move";
            return Err(at.refuse("motion", "a box that moves", allowed));
        }
        Ok(())
    }
}
