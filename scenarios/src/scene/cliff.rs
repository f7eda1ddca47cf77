//! Keys of the collapse of a cliff.

use super::boulder::GroundKeys;
use super::cliff_runout::CliffRunoutKeys;
use super::cliff_terrain::CliffTerrainKeys;
use super::comet::{CometBlockKeys, CometKeys};
use super::world::{BondKeys, Materials, OutputKeys, Place, StepKeys, SurfaceKeys};
use super::{CohesionKind, LawKeys, SceneError};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// What computes a cliff.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum CliffModel {
    /// Grains.
    Dem,
    /// Grains where the cliff breaks and hits, a continuum where its debris runs out.
    Hybrid,
}

/// A cliff of cometary material that a crack brings down (Kappel et al. 2020, §3.2).
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct CliffScene {
    /// What computes it.
    pub model: CliffModel,
    /// Seed of all random numbers.
    #[schemars(extend("minimum" = 0, "maximum" = 9007199254740991_i64))]
    pub seed: u64,
    /// Size of the computed parcels over that of the grains.
    #[schemars(extend("minimum" = 1.0, "maximum" = 1.0e6))]
    pub coarse_graining: f64,
    /// Magnitude of gravity (m/s²).
    #[schemars(extend("exclusiveMinimum" = 0.0, "maximum" = 1.0e3))]
    pub gravity: f64,
    /// Time for which the cliff stands by itself before the crack opens (s).
    #[schemars(extend("minimum" = 0.0, "maximum" = 1.0e7))]
    pub standing: f64,
    /// Longest time after that; rest ends it (s).
    #[schemars(extend("exclusiveMinimum" = 0.0, "maximum" = 1.0e7))]
    pub duration: f64,
    /// A packing to start from: a name, under which the settled cliff is kept and found again, or a file
    /// `packing.h5` of an earlier run.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub packing: Option<String>,
    /// Its shape.
    pub shape: CliffShapeKeys,
    /// The crack.
    pub crack: CliffCrackKeys,
    /// What it is made of.
    pub material: CometKeys,
    /// How it is made.
    pub preparation: CometBlockKeys,
    /// What the ground is like, and a wall below.
    pub ground: GroundKeys,
    /// What lies before it, where that is not a plane.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub terrain: Option<CliffTerrainKeys>,
    /// The law of all contacts.
    pub contact: LawKeys,
    /// Bonds of ice to ice in the top layer, where the material is sintered.
    pub sinter: BondKeys,
    /// Its debris as a continuum, with `model = "hybrid"`.
    #[serde(default)]
    pub runout: CliffRunoutKeys,
    /// The step.
    #[serde(default)]
    pub timestep: StepKeys,
    /// What is written.
    #[serde(default)]
    pub output: OutputKeys,
}

/// A cliff in section: its face leans forward, its back is held.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct CliffShapeKeys {
    /// Height of its top over the ground (m).
    #[schemars(extend("exclusiveMinimum" = 0.0, "maximum" = 1.0e5))]
    pub height: f64,
    /// Height of an upright wall that its lower part is; 0 for none (m).
    #[schemars(extend("minimum" = 0.0, "maximum" = 1.0e5))]
    pub wall: f64,
    /// How far the face above leans forward from the vertical (degrees).
    #[schemars(extend("minimum" = 0.0, "maximum" = 60.0))]
    pub overhang_degrees: f64,
    /// Thickness of the cliff behind the crack's head (m).
    #[schemars(extend("exclusiveMinimum" = 0.0, "maximum" = 1.0e5))]
    pub behind: f64,
    /// Width along the cliff, which is periodic (m).
    #[schemars(extend("exclusiveMinimum" = 0.0, "maximum" = 1.0e5))]
    pub width: f64,
    /// Thickness of the sintered top layer (m).
    #[schemars(extend("minimum" = 0.0, "maximum" = 1.0e5))]
    pub sintered: f64,
    /// Length beyond the lip over which debris is looked for and on which its continuum runs out, over the height.
    #[schemars(extend("minimum" = 1.0, "maximum" = 1000.0))]
    pub room_scaled: f64,
}

/// The crack: a tilted slab without bonds and without cohesion, from the top down towards the foot of the face.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct CliffCrackKeys {
    /// How far it leans back from the vertical (degrees).
    #[schemars(extend("minimum" = 0.0, "maximum" = 60.0))]
    pub degrees: f64,
    /// How deep it reaches from the top, over the height of the face; 0 for no crack.
    #[schemars(extend("minimum" = 0.0, "maximum" = 1.0))]
    pub depth_scaled: f64,
    /// Its thickness over the mean diameter of the parcels.
    #[schemars(extend("exclusiveMinimum" = 0.0, "maximum" = 100.0))]
    pub thickness_diameters: f64,
}

/// Fewest of the largest parcels across the slab and through the sintered layer.
const FEWEST: f64 = 3.0;

impl CliffScene {
    /// Its materials, of parcels: dust, ice, the crack's, the ground's and a support's.
    pub fn materials(&self, origin: &str) -> Result<Materials, SceneError> {
        let ground = LawKeys {
            restitution: Some(self.ground.restitution),
            youngs_modulus: Some(self.ground.youngs_modulus),
            ..LawKeys::default()
        };
        let crack = LawKeys {
            cohesion: Some(CohesionKind::None),
            ..LawKeys::default()
        };
        let reads = self.contact.parts().reads();
        let none = |key: &str| reads.contains(&key).then_some(0.0);
        let support = LawKeys {
            friction: none("friction"),
            rolling_friction: none("rolling_friction"),
            ..crack
        };
        let surfaces = [("crack", crack), ("ground", ground), ("support", support)];
        let surfaces = surfaces.map(|(name, contact)| (name.to_owned(), SurfaceKeys { contact }));
        let surfaces = BTreeMap::from(surfaces);
        self.material
            .materials(&self.contact, &surfaces, self.coarse_graining, origin)
    }

    /// Height of the face (m).
    pub fn face(&self) -> f64 {
        self.shape.height - self.shape.wall
    }

    pub(super) fn check_together(&self, origin: &str) -> Result<(), SceneError> {
        let at = |section| Place { origin, section };
        self.check_runout(origin)?;
        if let Some(terrain) = &self.terrain {
            terrain.source().check_together(origin)?;
        }
        self.material.check_together(origin)?;
        self.preparation
            .softness()
            .check_together(&self.contact, origin)?;
        self.materials(origin)?;
        let shape = &self.shape;
        if shape.wall >= shape.height {
            let range = format!("below the height, {} m", shape.height);
            return Err(at("shape").refuse("wall", shape.wall, range));
        }
        let widest = self.coarse_graining * self.material.largest_diameter;
        let narrowest = shape.width.min(shape.behind).min(self.face());
        if FEWEST * widest > narrowest {
            let most = narrowest / (FEWEST * self.material.largest_diameter);
            let range = format!(
                "at most {most:.3}: {FEWEST} of the largest parcels across the width, behind the crack and up the face"
            );
            return Err(at("").refuse("coarse_graining", self.coarse_graining, range));
        }
        Ok(())
    }
}
