//! Families of scenes: kinds whose keys are one struct and are laid over each other alike.
//!
//! A new family is one line of `families!`, and an arm wherever it differs from the others below.

use super::{
    BagnoldScene, ChuteScene, CollapseScene, CylinderScene, ImpactScene, InclineScene, Kind,
    OpenChuteScene, ReliefKeys, SceneError, SettleScene, ShearedScene, SiloDischargeScene, bed,
    kinds, law, layers, open_chute,
};
use crate::rheology_file::{self, FrictionOf};
use serde_json::Value;
use std::path::{Path, PathBuf};

/// What each family has in common, from one line each.
macro_rules! families {
    ($($(#[$doc:meta])* $variant:ident($keys:ty)),* $(,)?) => {
        /// The part of a scene that its kind decides.
        #[derive(Clone, Debug, PartialEq)]
        pub enum SceneBody {
            $($(#[$doc])* $variant(Box<$keys>)),*
        }

        /// Scenes of the same keys.
        #[derive(Clone, Copy, Debug, PartialEq, Eq)]
        pub(super) enum Family {
            $($(#[$doc])* $variant),*
        }

        impl SceneBody {
            /// Reads the keys of the scene of this name.
            pub(super) fn read(name: &str, table: toml::Table) -> Result<SceneBody, toml::de::Error> {
                Ok(match Family::of(name) {
                    $(Family::$variant => SceneBody::$variant(Box::new(<$keys>::read(name, table)?))),*
                })
            }

            /// The JSON Schema of the scene of this name, without the key `scene`.
            pub(super) fn schema(name: &str) -> Value {
                match Family::of(name) {
                    $(Family::$variant => <$keys>::schema(name)),*
                }
            }

            /// Every key as it was read, so that `31` and `31.0` are the same scene.
            pub(super) fn to_table(&self) -> toml::Table {
                match self {
                    $(SceneBody::$variant(keys) => keys.to_table()),*
                }
                .unwrap_or_default()
            }

            /// Limits that involve more than one key.
            pub(super) fn check_together(&self, origin: &str) -> Result<(), SceneError> {
                match self {
                    $(SceneBody::$variant(keys) => keys.check_together(origin)),*
                }
            }
        }
    };
}

families! {
    /// Grains on a rough inclined plane.
    Incline(InclineScene),
    /// The μ(I) continuum on an incline.
    Bagnold(BagnoldScene),
    /// The continuum between plates or walls, beside its exact solution.
    Sheared(ShearedScene),
    /// One impact of two spheres, or of a sphere on a plane.
    Impact(ImpactScene),
    /// Grains on a rough chute, from a start file.
    Chute(ChuteScene),
    /// Grains that settle in a box.
    Settle(SettleScene),
    /// Grains with walls, bonds, gravity and a preparation.
    Grains(Kind),
    /// A column of material that collapses.
    Collapse(CollapseScene),
    /// A cylinder of material that collapses, in space.
    Cylinder(CylinderScene),
    /// A layer that enters a chute at one end and leaves it at the other.
    OpenChute(OpenChuteScene),
    /// A silo that runs out of a slot, as a continuum.
    SiloDischarge(SiloDischargeScene),
}

/// A struct of keys of its own, read as it stands.
trait OneScene: serde::Serialize + serde::de::DeserializeOwned + schemars::JsonSchema {
    fn read(_name: &str, table: toml::Table) -> Result<Self, toml::de::Error> {
        table.try_into()
    }

    fn schema(_name: &str) -> Value {
        schema_of::<Self>()
    }

    fn to_table(&self) -> Result<toml::Table, toml::ser::Error> {
        toml::Table::try_from(self)
    }
}

/// The JSON Schema of these keys, without the key `scene`.
pub(super) fn schema_of<K: schemars::JsonSchema>() -> Value {
    schemars::schema_for!(K).to_value()
}

impl OneScene for InclineScene {}
impl OneScene for BagnoldScene {}
impl OneScene for ImpactScene {}
impl OneScene for ChuteScene {}
impl OneScene for SettleScene {}
impl OneScene for CollapseScene {}
impl OneScene for CylinderScene {}
impl OneScene for OpenChuteScene {}
impl OneScene for SiloDischargeScene {}

impl SceneBody {
    /// The start file, where the scene names one.
    pub fn start_file(&self) -> Option<&str> {
        match self {
            SceneBody::Chute(scene) => scene.start.as_deref(),
            SceneBody::Settle(scene) => scene.start.as_deref(),
            _ => None,
        }
    }

    /// The files that the scene reads besides rheologies, its keys resolved as given.
    pub(super) fn inputs(&self, resolved: &toml::Table) -> Vec<PathBuf> {
        let mut files: Vec<PathBuf> = self.start_file().map(PathBuf::from).into_iter().collect();
        let mut terrain = None;
        match self {
            SceneBody::Grains(_) => files.extend(kinds::inputs(resolved)),
            SceneBody::Collapse(scene) => {
                let packing = scene.grains.packing.as_deref();
                files.extend(packing.filter(|s| s.ends_with(".h5")).map(PathBuf::from));
                terrain = scene.terrain.as_ref().and_then(|keys| keys.source().file());
            }
            SceneBody::Cylinder(scene) => {
                terrain = scene.terrain.as_ref().and_then(ReliefKeys::file);
            }
            _ => {}
        }
        files.extend(terrain.map(|(_, file)| PathBuf::from(file)));
        files
    }
}

impl Family {
    /// The family of the bundled scene of this name.
    pub fn of(name: &str) -> Family {
        match name {
            "bagnold" => Family::Bagnold,
            "plane-shear" | "vertical-chute" => Family::Sheared,
            "two-spheres" | "sphere-on-plane" => Family::Impact,
            "chute" => Family::Chute,
            "settle" => Family::Settle,
            _ if Kind::NAMES.contains(&name) => Family::Grains,
            "column-collapse" | "cliff-plain" => Family::Collapse,
            "cylinder-collapse" => Family::Cylinder,
            "open-chute" => Family::OpenChute,
            "silo-discharge" => Family::SiloDischarge,
            _ => Family::Incline,
        }
    }

    /// Keys of which exactly one may be given: naming one drops the others' defaults.
    pub fn alternatives(self) -> &'static [&'static [&'static str]] {
        match self {
            Family::Incline => &INCLINE_CHOICES,
            Family::Bagnold | Family::Sheared | Family::Cylinder | Family::SiloDischarge => {
                rheology_file::ALTERNATIVES
            }
            Family::Collapse => &COLLAPSE_CHOICES,
            Family::OpenChute => &CHUTE_CHOICES,
            Family::Impact | Family::Grains => &law::CHOICES,
            Family::Chute | Family::Settle => &BED_CHOICES,
        }
    }

    /// Those of them whose defaults are still there when layers are laid over each other: a rheology
    /// file has been replaced by its numbers before.
    pub fn defaults_to_drop(self) -> &'static [&'static [&'static str]] {
        match self {
            Family::Bagnold | Family::Sheared | Family::Cylinder | Family::SiloDischarge => &[],
            Family::Collapse => &law::CHOICES,
            Family::Incline => &INCLINE_CHOICES[..1],
            Family::OpenChute => &CHUTE_CHOICES[..1],
            Family::Impact | Family::Chute | Family::Settle | Family::Grains => self.alternatives(),
        }
    }

    /// Whether it has a contact law whose keys depend on each other.
    pub fn has_contact_law(self) -> bool {
        matches!(
            self,
            Family::Impact | Family::Chute | Family::Settle | Family::Grains | Family::Collapse
        )
    }

    /// Whether it has a continuum, whatever its keys say. An incline has one if it names a rheology.
    pub fn has_continuum(self) -> bool {
        matches!(
            self,
            Family::Bagnold
                | Family::Sheared
                | Family::Collapse
                | Family::Cylinder
                | Family::OpenChute
                | Family::SiloDischarge
        )
    }

    /// What a rheology file's friction is measured against: a flow down a slope goes by |τ|/σ_zz, which
    /// its weight gives.
    pub fn friction(self) -> FrictionOf {
        match self {
            Family::Incline => FrictionOf::NormalStress,
            _ => FrictionOf::Pressure,
        }
    }

    /// Makes relative paths of a scene file relative to that file's folder.
    pub fn anchor(self, own: &mut toml::Table, folder: &Path) {
        rheology_file::anchor(own, folder);
        match self {
            Family::Chute | Family::Settle => layers::anchor_path(own, "start", folder),
            Family::Grains => kinds::anchor(own, folder),
            _ => {}
        }
        if self == Family::Collapse {
            kinds::anchor_packing(own, "grains.packing", folder);
        }
        if matches!(self, Family::Collapse | Family::Cylinder) {
            layers::anchor_path(own, "terrain.heights", folder);
            layers::anchor_path(own, "terrain.mesh", folder);
        }
    }
}

/// One choice and a rheology file or numbers.
const fn beside_rheology(
    first: &'static [&'static str],
) -> [&'static [&'static str]; 1 + rheology_file::ALTERNATIVES.len()] {
    let mut choices = [first; 1 + rheology_file::ALTERNATIVES.len()];
    let mut k = 0;
    while k < rheology_file::ALTERNATIVES.len() {
        choices[k + 1] = rheology_file::ALTERNATIVES[k];
        k += 1;
    }
    choices
}

/// Alternatives of inclines: the stiffness, and a rheology file or numbers.
const INCLINE_CHOICES: [&[&str]; 1 + rheology_file::ALTERNATIVES.len()] = beside_rheology(&[
    "contact.stiffness_scaled",
    "contact.stiffness",
    "contact.stiffness_from_speed",
]);

/// Alternatives of fed chutes: what enters, and a rheology file or numbers.
const CHUTE_CHOICES: [&[&str]; 1 + rheology_file::ALTERNATIVES.len()] =
    beside_rheology(open_chute::INFLOWS);

/// Alternatives of the scenes of a bed: its length, and those of the law.
const BED_CHOICES: [&[&str]; 4] = [
    bed::LENGTH,
    law::CHOICES[0],
    law::CHOICES[1],
    law::CHOICES[2],
];

/// Alternatives of the collapse: those of its continuum and of its grains.
const COLLAPSE_CHOICES: [&[&str]; rheology_file::ALTERNATIVES.len() + law::CHOICES.len()] = {
    let mut all: [&[&str]; rheology_file::ALTERNATIVES.len() + law::CHOICES.len()] =
        [&[]; rheology_file::ALTERNATIVES.len() + law::CHOICES.len()];
    let (first, mut k) = (rheology_file::ALTERNATIVES.len(), 0);
    while k < all.len() {
        all[k] = if k < first {
            rheology_file::ALTERNATIVES[k]
        } else {
            law::CHOICES[k - first]
        };
        k += 1;
    }
    all
};
