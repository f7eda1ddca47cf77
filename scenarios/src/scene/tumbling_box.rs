//! A lander that falls on a bed of grains on a small body (Thuillet 2019, chapter 4).

use super::world::{
    GrainMaterialKeys, Materials, OutputKeys, Place, StepKeys, SurfaceKeys, materials,
};
use super::{LawKeys, SceneError};
use colluvium_dem::{Body, Part};
use nalgebra::{UnitQuaternion, Vector3};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// Which side of the lander comes down first.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Attitude {
    /// The bottom, with its bump.
    Flat,
    /// A bottom corner that trails.
    BackCornerFirst,
    /// A bottom corner that leads.
    FrontCornerFirst,
}

/// The lander: a cuboid with a bump on its bottom.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct LanderKeys {
    /// Which side comes down first.
    pub orientation: Attitude,
    /// Angle of the velocity from the vertical (degrees).
    #[schemars(extend("minimum" = 0.0, "exclusiveMaximum" = 90.0))]
    pub impact_degrees: f64,
    /// Speed (m/s).
    #[schemars(extend("exclusiveMinimum" = 0.0, "maximum" = 1.0e3))]
    pub speed: f64,
    /// Height of its lowest point over the bed at the start (m).
    #[schemars(extend("exclusiveMinimum" = 0.0, "maximum" = 1.0e3))]
    pub height: f64,
    /// Mass (kg).
    #[schemars(extend("exclusiveMinimum" = 0.0, "maximum" = 1.0e6))]
    pub mass: f64,
    /// Lengths of its edges: along the flight, across, upright (m).
    pub sides: [f64; 3],
    /// Those of the bump in the middle of the bottom's front edge (m).
    pub bump: [f64; 3],
    /// Radius of its edges and corners (m).
    #[schemars(extend("exclusiveMinimum" = 0.0, "maximum" = 1.0e3))]
    pub rounding: f64,
}

/// The bed.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct BedKeys {
    /// Its depth (m).
    #[schemars(extend("minimum" = 0.05, "maximum" = 10.0))]
    pub depth: f64,
    /// Gravity while it is poured (m/s²).
    #[schemars(extend("exclusiveMinimum" = 0.0, "maximum" = 100.0))]
    pub pour_gravity: f64,
}

/// A lander on a bed.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct TumblingBoxScene {
    /// Seed of all random numbers.
    #[schemars(extend("minimum" = 0, "maximum" = 9007199254740991_i64))]
    pub seed: u64,
    /// 1 is the bed of the thesis; parcels grow with its inverse.
    #[schemars(extend("minimum" = 0.25, "maximum" = 1.0))]
    pub scale: f64,
    /// Time after the preparation at most (s).
    #[schemars(extend("exclusiveMinimum" = 0.0, "maximum" = 1.0e6))]
    pub duration: f64,
    /// Gravity during the impact (m/s²).
    #[schemars(extend("exclusiveMinimum" = 0.0, "maximum" = 100.0))]
    pub gravity: f64,
    /// A packing to start from: a name or a file.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub packing: Option<String>,
    /// The step.
    pub timestep: StepKeys,
    /// What is written.
    pub output: OutputKeys,
    /// The lander.
    pub lander: LanderKeys,
    /// The bed.
    pub bed: BedKeys,
    /// The law of all contacts.
    pub contact: LawKeys,
    /// The grains.
    pub grains: BTreeMap<String, GrainMaterialKeys>,
    /// What `lander` and `container` are made of.
    pub surfaces: BTreeMap<String, SurfaceKeys>,
}

/// Narrowest container, for the lander to have room (m), and that of the thesis.
const DIAMETERS: [f64; 2] = [0.8, 1.5];

impl TumblingBoxScene {
    /// Its materials, of parcels.
    pub fn materials(&self, origin: &str) -> Result<Materials, SceneError> {
        let factor = 1.0 / self.scale;
        materials(&self.grains, &self.surfaces, &self.contact, factor, origin)
    }

    /// Radius of the container (m).
    pub fn container(&self) -> f64 {
        let [narrow, wide] = DIAMETERS;
        0.5 * narrow.max(wide * self.scale)
    }

    /// Velocity of the lander at the start (m/s).
    pub fn velocity(&self) -> Vector3<f64> {
        let (s, c) = self.lander.impact_degrees.to_radians().sin_cos();
        self.lander.speed * Vector3::new(s, 0.0, -c)
    }

    /// Corners of the lander in its own axes, those of the bump last (m).
    pub fn corners(&self) -> Vec<Vector3<f64>> {
        let half = Vector3::from(self.lander.sides) * 0.5;
        let bump = Vector3::from(self.lander.bump) * 0.5;
        let corner = |half: Vector3<f64>, k: usize| {
            Vector3::from_fn(|axis, _| {
                if k >> axis & 1 == 1 {
                    half[axis]
                } else {
                    -half[axis]
                }
            })
        };
        let own = (0..8).map(|k| corner(half, k));
        own.chain((0..8).map(|k| self.bump_place() + corner(bump, k)))
            .collect()
    }

    fn bump_place(&self) -> Vector3<f64> {
        let (sides, bump) = (self.lander.sides, self.lander.bump);
        let x = 0.5 * (sides[0] - bump[0]) - 2.0 * self.lander.rounding;
        Vector3::new(x, 0.0, -0.5 * (sides[2] + bump[2]))
    }

    /// The lander over a bed whose surface is at a height (m), of a material.
    pub fn body(&self, surface: f64, material: u16, origin: &str) -> Result<Body, SceneError> {
        let lander = &self.lander;
        let at = Place {
            origin,
            section: "lander",
        };
        let block = |sides: [f64; 3]| {
            let part = Part::cuboid(Vector3::from(sides) * 0.5, 1.0);
            part.rounded(lander.rounding).material(material)
        };
        let parts = vec![
            block(lander.sides),
            block(lander.bump).at(self.bump_place()),
        ];
        let body = Body::new(parts).weighing(lander.mass);
        let body = body.map_err(|e| at.refuse("mass, sides, bump", lander.mass, e))?;
        let half = Vector3::from(lander.sides) * 0.5;
        let corner = |sign: f64| {
            let corner = Vector3::new(sign * half.x, -half.y, -half.z);
            UnitQuaternion::rotation_between(&corner, &-Vector3::z()).unwrap_or_default()
        };
        let turn = match lander.orientation {
            Attitude::Flat => UnitQuaternion::identity(),
            Attitude::BackCornerFirst => corner(-1.0),
            Attitude::FrontCornerFirst => corner(1.0),
        };
        let heights = self.corners().into_iter().map(|c| (turn * c).z);
        let lowest = heights.fold(f64::INFINITY, f64::min);
        let height = surface + lander.height - lowest;
        Ok(body
            .at(Vector3::z() * height)
            .turned(turn)
            .moving(self.velocity(), Vector3::zeros()))
    }

    pub(super) fn check_together(&self, origin: &str) -> Result<(), SceneError> {
        let top = Place {
            origin,
            section: "surfaces",
        };
        for name in ["lander", "container"] {
            let given = self.surfaces.get(name).map(|_| ());
            top.need(&given, name, "what it is made of")?;
        }
        let at = Place {
            origin,
            section: "lander",
        };
        for (key, sides) in [("sides", self.lander.sides), ("bump", self.lander.bump)] {
            let least = 2.0 * self.lander.rounding;
            if !sides
                .iter()
                .all(|side| *side > least && *side < self.container())
            {
                let range = format!(
                    "above twice the rounding, {least} m, and below the container's radius, {} m",
                    self.container()
                );
                return Err(at.refuse(key, format!("{sides:?}"), range));
            }
        }
        self.materials(origin)?;
        self.body(0.0, 0, origin).map(drop)
    }
}
