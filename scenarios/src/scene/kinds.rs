//! The scenes that stand on the shared sections of grains: one line each.
//!
//! A scene is a struct of keys, a recipe (`run::world::Recipe`) and a bundled file of the same name.

use super::{
    AngleOfReposeScene, BallImpactScene, BallModel, BoulderScene, CliffModel, CliffScene,
    GrainCylinderScene, GrainsScene, SceneError, SiloScene, TensileScene, TumblingBoxScene,
};
use crate::run::ball_impact::joined::JoinedBed;
use crate::run::cliff::joined::JoinedCliff;
use crate::run::world::Recipe;
use serde_json::Value;

macro_rules! kinds {
    ($($(#[$doc:meta])* $variant:ident($keys:ty) = $name:literal),* $(,)?) => {
        /// A scene of grains.
        #[derive(Clone, Debug, PartialEq)]
        pub enum Kind {
            $($(#[$doc])* $variant(Box<$keys>)),*
        }

        impl Kind {
            /// Their names.
            pub const NAMES: &[&str] = &[$($name),*];

            /// Reads the keys of the scene of this name.
            ///
            /// # Errors
            /// Keys that the scene does not have; a name that is not of [`Kind::NAMES`].
            pub fn read(name: &str, table: toml::Table) -> Result<Kind, toml::de::Error> {
                match name {
                    $($name => table.try_into().map(|keys| Kind::$variant(Box::new(keys))),)*
                    _ => Err(serde::de::Error::custom(format!("no scene is called `{name}`"))),
                }
            }

            /// The JSON Schema of the scene of this name, null where there is none.
            pub fn schema(name: &str) -> Value {
                match name {
                    $($name => schemars::schema_for!($keys).to_value(),)*
                    _ => Value::Null,
                }
            }

            /// Every key as it was read.
            pub fn to_table(&self) -> Result<toml::Table, toml::ser::Error> {
                match self {
                    $(Kind::$variant(keys) => toml::Table::try_from(keys),)*
                }
            }

            /// Limits that involve more than one key.
            pub(super) fn check_together(&self, origin: &str) -> Result<(), SceneError> {
                match self {
                    $(Kind::$variant(keys) => keys.check_together(origin),)*
                }
            }

            /// What it does.
            pub fn recipe(&self) -> &dyn Recipe {
                match self {
                    $(Kind::$variant(keys) => keys.as_ref(),)*
                }
            }
        }
    };
}

kinds! {
    /// A recipe of one's own.
    Grains(GrainsScene) = "grains",
    /// A cylinder pulled to its breaking point.
    Tensile(TensileScene) = "tensile-test",
    /// A boulder dropped on a plane.
    Boulder(BoulderScene) = "boulder-drop",
    /// The angle at which an avalanche comes to rest.
    AngleOfRepose(AngleOfReposeScene) = "angle-of-repose",
    /// A cylinder of grains that collapses.
    CylinderOfGrains(GrainCylinderScene) = "cylinder-of-grains",
    /// Silos that run out.
    Silo(SiloScene) = "silo",
    /// A ball that falls into a bed.
    BallImpact(BallImpactScene) = "ball-impact",
    /// A lander on a bed.
    TumblingBox(TumblingBoxScene) = "tumbling-box",
    /// A cliff that a crack brings down.
    Cliff(CliffScene) = "cliff",
    /// The Aswan cliff.
    CliffAswan(CliffScene) = "cliff-aswan",
}

impl Kind {
    /// Does something with what it does, told the scene file for messages: a bed with a continuum in it is alive in
    /// between.
    pub fn act<T>(&self, origin: &str, act: impl FnOnce(&dyn Recipe) -> T) -> T {
        match self {
            Kind::BallImpact(keys) if keys.model == BallModel::Hybrid => {
                act(&JoinedBed::new(keys, origin))
            }
            Kind::Cliff(keys) | Kind::CliffAswan(keys) if keys.model == CliffModel::Hybrid => {
                act(&JoinedCliff::new(keys, origin))
            }
            _ => act(self.recipe()),
        }
    }
}

/// Dotted paths of files in scenes of grains, besides every key `file`.
const FILES: [&str; 3] = ["bed", "terrain.heights", "terrain.mesh"];

/// Makes relative paths of a scene file relative to that file's folder.
pub(super) fn anchor(table: &mut toml::Table, folder: &std::path::Path) {
    for path in FILES {
        super::layers::anchor_path(table, path, folder);
    }
    anchor_files(table, folder);
    anchor_packing(table, "packing", folder);
}

/// Makes the path of a packing relative to a folder; its name stays a name.
pub(super) fn anchor_packing(table: &mut toml::Table, key: &str, folder: &std::path::Path) {
    let named = |value: &toml::Value| value.as_str().is_some_and(|s| !s.ends_with(".h5"));
    if !super::layers::get(table, key).is_some_and(named) {
        super::layers::anchor_path(table, key, folder);
    }
}

/// Every `file` of a table and of the tables in it.
fn anchor_files(table: &mut toml::Table, folder: &std::path::Path) {
    super::layers::anchor_path(table, "file", folder);
    for (_, value) in table.iter_mut() {
        match value {
            toml::Value::Table(inner) => anchor_files(inner, folder),
            toml::Value::Array(listed) => {
                for inner in listed.iter_mut().filter_map(toml::Value::as_table_mut) {
                    anchor_files(inner, folder);
                }
            }
            _ => {}
        }
    }
}

/// The files that keys of a scene of grains name.
pub fn inputs(table: &toml::Table) -> Vec<std::path::PathBuf> {
    let mut found = Vec::new();
    for path in FILES {
        let file = super::layers::get(table, path).and_then(toml::Value::as_str);
        found.extend(file.map(Into::into));
    }
    gather_files(table, &mut found);
    let packing = table.get("packing").and_then(toml::Value::as_str);
    found.extend(packing.filter(|s| s.ends_with(".h5")).map(Into::into));
    found
}

fn gather_files(table: &toml::Table, into: &mut Vec<std::path::PathBuf>) {
    for (key, value) in table {
        match value {
            toml::Value::String(file) if key == "file" => into.push(file.into()),
            toml::Value::Table(inner) => gather_files(inner, into),
            toml::Value::Array(listed) => {
                for inner in listed.iter().filter_map(toml::Value::as_table) {
                    gather_files(inner, into);
                }
            }
            _ => {}
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn files_are_found_at_any_depth_and_lie_beside_their_scene() {
        let mut table: toml::Table = r#"
            packing = "named"
            [terrain]
            heights = "hill.asc"
            [boundaries.motion]
            file = "box.csv"
            [walls.drum.motion]
            file = "/abroad/drum.csv"
            [[prepare]]
            do = "put"
            file = "grains.csv"
            within = [{ kind = "any", of = [{ kind = "mesh", file = "cone.stl" }] }]
        "#
        .parse()
        .unwrap();
        anchor(&mut table, std::path::Path::new("/home/scenes"));
        let mut found = inputs(&table);
        found.sort();
        let beside = |name: &str| std::path::Path::new("/home/scenes").join(name);
        let mut expected = vec!["/abroad/drum.csv".into()];
        expected.extend(["box.csv", "cone.stl", "grains.csv", "hill.asc"].map(beside));
        assert_eq!(found, expected);
    }
}
