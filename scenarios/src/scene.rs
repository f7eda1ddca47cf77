//! Scenes: what is to be simulated, as TOML.
//!
//! A scene file names its kind with `scene = "bagnold"`; keys it leaves out take the value of the
//! bundled scene of that kind, so every default has one home: the bundled file. The same schema
//! that `colluvium schema` prints is what input is checked against.

mod angle_of_repose;
mod bagnold;
mod ball_impact;
mod ball_zones;
mod bed;
mod boulder;
mod bundled;
mod check;
mod chute;
mod cliff;
mod cliff_runout;
mod cliff_terrain;
mod collapse;
mod collapse_grains;
mod collapse_terrain;
mod collapse_zones;
mod comet;
mod contact;
mod cylinder;
mod cylinder_of_grains;
mod cylinder_terrain;
mod error;
mod family;
mod friction_keys;
mod friction_law;
mod grain_intervals;
mod grains;
mod ground_source;
mod impact;
mod incline;
mod kinds;
mod law;
mod law_layers;
mod layer_case;
pub mod layers;
mod open_chute;
mod overlap;
mod overlap_width;
mod settle;
mod sheared;
mod silo;
mod silo_discharge;
mod tensile;
mod tumbling_box;
pub mod world;

pub use angle_of_repose::AngleOfReposeScene;
pub use bagnold::{BagnoldGrid, BagnoldScene, FrictionLaw, RheologyKeys, SolverKeys, SolverMethod};
pub use ball_impact::{BallImpactScene, BallModel};
pub use bed::Pace;
pub use boulder::BoulderScene;
pub use bundled::{BUNDLED, bundled};
pub use chute::ChuteScene;
pub use cliff::{CliffCrackKeys, CliffModel, CliffScene, CliffShapeKeys};
pub use cliff_runout::CliffRunoutKeys;
pub use cliff_terrain::CliffTerrainKeys;
pub use collapse::{
    ChannelKeys, CollapseGrid, CollapseModel, CollapseScene, CollapseSolver, CollapseWalls,
    ThinLayerKind,
};
pub use collapse_grains::{CalibratedKind, ColumnFloorKind, ColumnGrainKeys};
pub use collapse_terrain::{ContactKind, TerrainKeys};
pub use collapse_zones::{ColumnOverlapKeys, ColumnZoneKeys, DENSE, overlap_words};
pub use comet::{CometBlockKeys, CometKeys, MixKind, Softness};
pub use contact::SurfaceKeys;
pub use cylinder::{CylinderGrid, CylinderScene};
pub use cylinder_of_grains::{GrainCylinderGrid, GrainCylinderKeys, GrainCylinderScene};
pub use cylinder_terrain::ReliefKeys;
pub use error::SceneError;
pub use family::SceneBody;
pub use grain_intervals::GrainIntervals;
pub use grains::GrainsScene;
pub use ground_source::GroundSource;
pub use impact::{ImpactScene, RollingKeys};
pub use incline::{
    Bracket, CalibrationKeys, ContactKeys, FloorKeys, GrainKeys, GuessKeys, InclineScene,
    InclineStart, SizeLaw, TimeKeys, TimestepKeys,
};
pub use kinds::{Kind, inputs as grain_inputs};
pub use law::{
    CohesionKind, LawKeys, LeverKind, MemoryKind, NormalKind, Parts, RollingKind, TangentialKind,
};
pub use layer_case::LayerCase;
pub use open_chute::{AcrossKeys, InflowKeys, OpenChuteGrid, OpenChuteScene};
pub use overlap::{InclineModel, NormalMotionKind, OverlapKeys};
pub use settle::{SettleFloor, SettleGrains, SettleScene};
pub use sheared::{ExactFlow, ShearedCase, ShearedScene};
pub use silo::SiloScene;
pub use silo_discharge::{SiloDischargeScene, SiloGrid};
pub use tensile::{ClampKind, TensileScene};
pub use tumbling_box::{Attitude, BedKeys, LanderKeys, TumblingBoxScene};

use crate::failure::Failure;
use crate::{rheology_file, run_directory};
use bundled::base_of;
use family::Family;
use serde_json::{Value, json};
use std::path::{Path, PathBuf};

/// A checked scene.
#[derive(Clone, Debug)]
pub struct Scene {
    /// The kind, which is also the name of the bundled scene it builds on.
    pub name: String,
    /// What its kind decides.
    pub body: SceneBody,
    /// Every key with the value that will be used.
    pub resolved: toml::Table,
    /// The scene file, or the bundled scene's name, for messages.
    pub origin: String,
    /// The files it was read from.
    pub inputs: Vec<PathBuf>,
}

/// Scenes are the same if they compute the same, wherever they were read.
impl PartialEq for Scene {
    fn eq(&self, other: &Scene) -> bool {
        self.resolved == other.resolved
    }
}

impl Scene {
    /// Reads a bundled scene or a scene file and applies `KEY=VALUE` settings.
    pub fn load(name_or_path: &str, settings: &[String]) -> Result<Scene, SceneError> {
        let (own, origin, folder) = match bundled(name_or_path) {
            Some(text) => (
                layers::parse(text, name_or_path)?,
                name_or_path.to_owned(),
                None,
            ),
            None => {
                let path = Path::new(name_or_path);
                let text = read(path)?;
                let origin = path.display().to_string();
                (
                    layers::parse(&text, &origin)?,
                    origin,
                    path.parent().map(PathBuf::from),
                )
            }
        };
        let file = folder.is_some().then(|| PathBuf::from(name_or_path));
        let mut scene = Scene::from_layers(own, &origin, folder.as_deref(), (settings, "--set"))?;
        scene.inputs.extend(file);
        Ok(scene)
    }

    /// Reads the resolved scene of a run directory.
    pub fn from_text(text: &str, origin: &str) -> Result<Scene, SceneError> {
        Scene::from_layers(layers::parse(text, origin)?, origin, None, (&[], "--set"))
    }

    fn from_layers(
        mut own: toml::Table,
        origin: &str,
        folder: Option<&Path>,
        (settings, option): (&[String], &str),
    ) -> Result<Scene, SceneError> {
        let name = kind_of(&mut own, origin)?;
        let mut base = layers::parse(base_of(&name), &name)?;
        base.remove("scene");
        let schema = SceneBody::schema(&name);

        let family = Family::of(&name);
        let choices = family.alternatives();
        let drops = family.defaults_to_drop();
        let impact = family == Family::Impact;
        let lawful = family.has_contact_law();
        check::check(&own, &schema, origin)?;
        layers::check_choices(&own, choices, origin)?;
        if let Some(folder) = folder {
            family.anchor(&mut own, folder);
        }
        // What was written, before a file's numbers take their places.
        let mut written = own.clone();
        let friction = family.friction();
        rheology_file::resolve(&mut base, friction)?;
        friction_keys::forget_defaults(&mut written, &base);
        let mut inputs = Vec::new();
        inputs.extend(rheology_file::resolve(&mut own, friction)?);
        let mut set = layers::parse_settings(settings, option)?;
        let set_by_hand = set.clone();
        check::check(&set, &schema, option)?;
        layers::check_choices(&set, choices, option)?;
        inputs.extend(rheology_file::resolve(&mut set, friction)?);
        rheology_file::drop_stale_notes(&mut base, &own);
        if impact {
            law_layers::lift(&mut own, origin)?;
            law_layers::lift(&mut set, option)?;
            law_layers::check_settings(&set, option)?;
            law_layers::give_way(&mut base, &own);
        }
        let mut table = layers::merge(base, own.clone(), drops);
        rheology_file::drop_stale_notes(&mut table, &set);
        if impact {
            law_layers::give_way(&mut table, &set);
        }
        let mut table = layers::merge(table, set.clone(), drops);
        if lawful {
            // A setting that chooses another law leaves a file's numbers behind without complaint.
            if !law_layers::chooses(&set) {
                law_layers::check_read(&table, &own, (impact, false), origin)?;
            }
            law_layers::check_read(&table, &set, (impact, true), option)?;
            law_layers::drop_unread(&mut table, impact);
        }
        let of_incline = family == Family::Incline && table.contains_key("rheology");
        if of_incline || family.has_continuum() {
            // A bundled scene has the numbers of all laws, as defaults.
            if folder.is_some() && !friction_keys::chooses(&set) {
                friction_keys::check_read(&table, &written, origin)?;
            }
            friction_keys::check_read(&table, &set_by_hand, option)?;
            if folder.is_some() {
                friction_keys::check_calibrated(&table, &written, origin)?;
            }
            friction_keys::check_calibrated(&table, &set_by_hand, option)?;
            friction_keys::drop_unread(&mut table);
            friction_keys::check_complete(&table, origin)?;
        }
        check::check(&table, &schema, origin)?;
        check::require(&table, &schema, origin)?;

        let body = SceneBody::read(&name, table).map_err(|error| SceneError::Unreadable {
            file: origin.to_owned(),
            message: error.message().to_owned(),
        })?;
        let mut resolved = toml::Table::new();
        resolved.insert("scene".into(), toml::Value::String(name.clone()));
        resolved.extend(body.to_table());
        inputs.extend(body.inputs(&resolved));
        let scene = Scene {
            name,
            body,
            resolved,
            origin: origin.to_owned(),
            inputs,
        };
        scene.body.check_together(origin)?;
        Ok(scene)
    }

    /// The scene with other settings on top, which came by the named option.
    pub fn with(&self, settings: &[String], option: &str) -> Result<Scene, SceneError> {
        let resolved = self.resolved.clone();
        let mut scene = Scene::from_layers(resolved, &self.origin, None, (settings, option))?;
        scene.inputs.extend(self.inputs.iter().cloned());
        Ok(scene)
    }

    /// The error that a key of this scene has a value that is not allowed.
    pub fn out_of_range(&self, key: &str, value: impl ToString, range: &str) -> SceneError {
        SceneError::OutOfRange {
            file: self.origin.clone(),
            key: key.to_owned(),
            value: value.to_string(),
            range: range.to_owned(),
        }
    }

    /// The files whose numbers are not keys of the resolved scene.
    pub fn files(&self) -> Vec<PathBuf> {
        self.body.inputs(&self.resolved)
    }

    /// The resolved scene as TOML.
    pub fn to_toml(&self) -> Result<String, Failure> {
        let body = run_directory::toml_text("the resolved scene", &self.resolved)?;
        Ok(format!(
            "# Resolved scene: every key with the value that was used. SI units.\n{body}"
        ))
    }
}

fn read(path: &Path) -> Result<String, SceneError> {
    std::fs::read_to_string(path).map_err(|source| {
        let name = path.display().to_string();
        let names = BUNDLED.map(|(n, _)| n);
        SceneError::Missing {
            nearest: check::nearest(&name, names.iter().copied()),
            names: names.join(", "),
            name,
            source,
        }
    })
}

/// Takes the key `scene` out of a table.
fn kind_of(table: &mut toml::Table, origin: &str) -> Result<String, SceneError> {
    let names = BUNDLED.map(|(n, _)| n);
    match table.remove("scene") {
        Some(toml::Value::String(kind)) if bundled(&kind).is_some() => Ok(kind),
        Some(value) => Err(SceneError::OutOfRange {
            file: origin.to_owned(),
            key: "scene".into(),
            value: value.to_string(),
            range: format!("one of {}", names.join(", ")),
        }),
        None => Err(SceneError::MissingKey {
            file: origin.to_owned(),
            key: "scene".into(),
            wanted: format!("one of {}", names.join(", ")),
        }),
    }
}

/// A sphere lighter than this (kg) is a slip of the keyboard, and its mass soon rounds to zero.
const LEAST_MASS: f64 = 1e-100;

/// Checks a table of keys of the continuum scene as a scene file would be.
pub fn check_continuum_keys(table: &toml::Table, origin: &str) -> Result<(), SceneError> {
    check::check(table, &family::schema_of::<BagnoldScene>(), origin)
}

/// The JSON Schema of scene files, for editors.
///
/// Only `scene` is required: keys left out take the value of the bundled scene.
pub fn json_schema() -> Value {
    let mut kinds = Vec::new();
    let mut definitions = serde_json::Map::new();
    for (name, _) in BUNDLED {
        let mut schema = SceneBody::schema(name);
        if let Some(object) = schema.as_object_mut() {
            if let Some(Value::Object(inner)) = object.remove("$defs") {
                for (key, mut definition) in inner {
                    if let Some(d) = definition.as_object_mut() {
                        d.remove("required");
                    }
                    definitions.insert(key, definition);
                }
            }
            object.remove("$schema");
            object.insert("title".into(), json!(name));
            object.insert("required".into(), json!(["scene"]));
            if let Some(Value::Object(properties)) = object.get_mut("properties") {
                properties.insert("scene".into(), json!({ "const": name }));
            }
        }
        kinds.push(schema);
    }
    json!({
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        "title": "Colluvium scene",
        "description": "SI units. Keys left out take the value of the bundled scene of the same kind.",
        "oneOf": kinds,
        "$defs": definitions,
    })
}
