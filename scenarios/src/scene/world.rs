//! Sections that every scene of grains may have: what grains and walls are, where they stand, what binds
//! and pulls them, how they are put in place.
//!
//! A file for each section, with the keys as users write them and the way to the engine's own types. A
//! scene takes the sections it needs into its struct; `grains` takes all of them.

mod averages;
mod bodies;
mod bonds;
mod boundaries;
mod clumps;
mod gravity;
mod materials;
mod motion;
mod output;
mod preparation;
mod region;
mod sizes;
mod walls;

pub use averages::{AverageKeys, GeometryKind, KernelKind};
pub use bodies::{BodyKeys, FreedomKind, HingeKeys, PartKeys, PartKind, bodies};
pub use bonds::{BondKeys, CrackKeys, bond_rules};
pub use boundaries::{BoundaryKeys, BoxMotionKeys, BoxMotionKind, OutletKeys};
pub use clumps::{AllClumps, BallKeys, ClumpKeys, clumps};
pub use gravity::{GravityKeys, HeavySphereKeys, SelfGravityKeys};
pub use materials::{GrainMaterialKeys, Materials, SurfaceKeys, materials};
pub use motion::{MotionKeys, MotionKind};
pub use output::{OutputKeys, StepKeys};
pub use preparation::{PrepareKeys, PrepareKind, PrepareStep};
pub use region::{RegionKeys, RegionKind, region};
pub use sizes::{SizeKeys, SizeKind, WeightKind};
pub use walls::{SideKind, WallKeys, WallKind, walls};

use super::SceneError;
use nalgebra::Vector3;

/// A vector as it stands in a scene.
pub type Triple = [f64; 3];

/// Where a section stands: its file and its dotted path, for messages.
#[derive(Clone, Copy, Debug)]
pub struct Place<'a> {
    /// The file.
    pub origin: &'a str,
    /// The section.
    pub section: &'a str,
}

impl Place<'_> {
    /// The dotted path of one of its keys.
    pub fn key(&self, key: &str) -> String {
        if self.section.is_empty() {
            key.to_owned()
        } else {
            format!("{}.{key}", self.section)
        }
    }

    /// The error that a key of it has a value that is not allowed.
    pub fn refuse(&self, key: &str, value: impl ToString, range: impl ToString) -> SceneError {
        SceneError::OutOfRange {
            file: self.origin.to_owned(),
            key: self.key(key),
            value: value.to_string(),
            range: range.to_string(),
        }
    }

    /// The value of a key that has to be there.
    pub fn need<T: Clone>(
        &self,
        value: &Option<T>,
        key: &str,
        wanted: &str,
    ) -> Result<T, SceneError> {
        value.clone().ok_or_else(|| self.missing(key, wanted))
    }

    /// The error that a key has to be there.
    pub fn missing(&self, key: &str, wanted: &str) -> SceneError {
        SceneError::MissingKey {
            file: self.origin.to_owned(),
            key: self.key(key),
            wanted: wanted.to_owned(),
        }
    }

    /// Refuses keys that are given though a choice does not read them.
    pub fn unread(&self, given: &[(&str, bool)], choice: &str) -> Result<(), SceneError> {
        match given.iter().find(|(_, given)| *given) {
            Some((key, _)) => Err(SceneError::Unneeded {
                file: self.origin.to_owned(),
                key: self.key(key),
                choice: choice.to_owned(),
            }),
            None => Ok(()),
        }
    }

    /// A direction as a unit vector.
    pub fn direction(&self, v: Triple, key: &str) -> Result<Vector3<f64>, SceneError> {
        let vector = Vector3::from(v);
        let length = vector.norm();
        if length > 0.0 && length.is_finite() {
            // A direction along an axis keeps its exact numbers.
            return Ok(if length == 1.0 {
                vector
            } else {
                vector / length
            });
        }
        Err(self.refuse(key, format!("{v:?}"), "a direction: longer than 0"))
    }
}
