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
mod tensile;
mod tumbling_box;
pub mod world;

pub use angle_of_repose::AngleOfReposeScene;
pub use bagnold::{BagnoldGrid, BagnoldScene, FrictionLaw, RheologyKeys, SolverKeys, SolverMethod};
pub use ball_impact::{BallImpactScene, BallModel};
pub use bed::Pace;
pub use boulder::BoulderScene;
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
pub use friction_law::LawVisitor;
pub use grain_intervals::GrainIntervals;
pub use grains::GrainsScene;
pub use ground_source::GroundSource;
pub use impact::{ImpactScene, RollingKeys};
pub use incline::{
    Bracket, CalibrationKeys, ContactKeys, FloorKeys, GrainKeys, GuessKeys, InclineScene,
    InclineStart, SizeLaw, TimeKeys, TimestepKeys,
};
pub use kinds::Kind;
pub use law::{
    CohesionKind, LawKeys, LeverKind, MemoryKind, NormalKind, Parts, RollingKind, TangentialKind,
};
pub use layer_case::{LayerCase, LayerVisitor};
pub use open_chute::{AcrossKeys, InflowKeys, OpenChuteGrid, OpenChuteScene};
pub use overlap::{InclineModel, NormalMotionKind, OverlapKeys};
pub use settle::{SettleFloor, SettleGrains, SettleScene};
pub use sheared::{ExactFlow, ShearedCase, ShearedScene};
pub use silo::SiloScene;
pub use tensile::{ClampKind, TensileScene};
pub use tumbling_box::{Attitude, BedKeys, LanderKeys, TumblingBoxScene};

use crate::rheology_file::{self, FrictionOf};
use serde_json::{Value, json};
use std::path::{Path, PathBuf};

/// The names and texts of the bundled scenes.
pub const BUNDLED: [(&str, &str); 25] = [
    ("incline", include_str!("../scenes/incline.toml")),
    (
        "incline-moderate",
        include_str!("../scenes/incline-moderate.toml"),
    ),
    (
        "incline-gravel",
        include_str!("../scenes/incline-gravel.toml"),
    ),
    (
        "incline-glass",
        include_str!("../scenes/incline-glass.toml"),
    ),
    ("bagnold", include_str!("../scenes/bagnold.toml")),
    ("plane-shear", include_str!("../scenes/plane-shear.toml")),
    (
        "vertical-chute",
        include_str!("../scenes/vertical-chute.toml"),
    ),
    ("two-spheres", include_str!("../scenes/two-spheres.toml")),
    (
        "sphere-on-plane",
        include_str!("../scenes/sphere-on-plane.toml"),
    ),
    ("chute", include_str!("../scenes/chute.toml")),
    ("settle", include_str!("../scenes/settle.toml")),
    ("grains", include_str!("../scenes/grains.toml")),
    ("tensile-test", include_str!("../scenes/tensile-test.toml")),
    ("boulder-drop", include_str!("../scenes/boulder-drop.toml")),
    (
        "angle-of-repose",
        include_str!("../scenes/angle-of-repose.toml"),
    ),
    (
        "cylinder-of-grains",
        include_str!("../scenes/cylinder-of-grains.toml"),
    ),
    ("silo", include_str!("../scenes/silo.toml")),
    ("ball-impact", include_str!("../scenes/ball-impact.toml")),
    ("tumbling-box", include_str!("../scenes/tumbling-box.toml")),
    (
        "column-collapse",
        include_str!("../scenes/column-collapse.toml"),
    ),
    (
        "cylinder-collapse",
        include_str!("../scenes/cylinder-collapse.toml"),
    ),
    ("open-chute", include_str!("../scenes/open-chute.toml")),
    ("cliff", include_str!("../scenes/cliff.toml")),
    ("cliff-aswan", include_str!("../scenes/cliff-aswan.toml")),
    ("cliff-plain", include_str!("../scenes/cliff-plain.toml")),
];

/// The text of a bundled scene.
pub fn bundled(name: &str) -> Option<&'static str> {
    BUNDLED
        .iter()
        .find(|(n, _)| *n == name)
        .map(|(_, text)| *text)
}

/// The part of a scene that its kind decides.
#[derive(Clone, Debug, PartialEq)]
pub enum SceneBody {
    /// Grains on a rough inclined plane.
    Incline(Box<InclineScene>),
    /// The μ(I) continuum on an incline.
    Bagnold(Box<BagnoldScene>),
    /// The continuum between plates or walls, beside its exact solution.
    Sheared(ShearedScene),
    /// One impact of two spheres, or of a sphere on a plane.
    Impact(Box<ImpactScene>),
    /// Grains on a rough chute, from a start file.
    Chute(Box<ChuteScene>),
    /// Grains that settle in a box.
    Settle(Box<SettleScene>),
    /// Grains with walls, bonds, gravity and a preparation.
    Grains(Box<Kind>),
    /// A column of material that collapses.
    Collapse(Box<CollapseScene>),
    /// A cylinder of material that collapses, in space.
    Cylinder(Box<CylinderScene>),
    /// A layer that enters a chute at one end and leaves it at the other.
    OpenChute(Box<OpenChuteScene>),
}

impl SceneBody {
    /// Every key as it was read, so that `31` and `31.0` are the same scene.
    fn to_table(&self) -> toml::Table {
        match self {
            SceneBody::Incline(scene) => toml::Table::try_from(scene),
            SceneBody::Bagnold(scene) => toml::Table::try_from(scene),
            SceneBody::Sheared(scene) => scene.to_table(),
            SceneBody::Impact(scene) => toml::Table::try_from(scene),
            SceneBody::Chute(scene) => toml::Table::try_from(scene),
            SceneBody::Settle(scene) => toml::Table::try_from(scene),
            SceneBody::Grains(kind) => kind.to_table(),
            SceneBody::Collapse(scene) => toml::Table::try_from(scene),
            SceneBody::Cylinder(scene) => toml::Table::try_from(scene),
            SceneBody::OpenChute(scene) => toml::Table::try_from(scene),
        }
        .unwrap_or_default()
    }

    /// The start file, where the scene names one.
    pub fn start_file(&self) -> Option<&str> {
        match self {
            SceneBody::Chute(scene) => scene.start.as_deref(),
            SceneBody::Settle(scene) => scene.start.as_deref(),
            _ => None,
        }
    }
}

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
        let schema = body_schema(&name);

        let choices = alternatives(&name);
        // A rheology file is replaced by its numbers before layers are laid over each other, so
        // only the stiffness keys have defaults to drop.
        let kind = family(&name);
        let drops: &[&[&str]] = match kind {
            Family::Bagnold | Family::Sheared | Family::Cylinder => &[],
            Family::Collapse => &law::CHOICES,
            Family::Incline => &INCLINE_CHOICES[..1],
            Family::OpenChute => &CHUTE_CHOICES[..1],
            _ => choices,
        };
        let impact = matches!(kind, Family::Impact);
        let lawful = matches!(
            kind,
            Family::Impact | Family::Chute | Family::Settle | Family::Grains | Family::Collapse
        );
        check::check(&own, &schema, origin)?;
        layers::check_choices(&own, choices, origin)?;
        if let Some(folder) = folder {
            rheology_file::anchor(&mut own, folder);
            if matches!(kind, Family::Chute | Family::Settle) {
                layers::anchor_path(&mut own, "start", folder);
            }
            if matches!(kind, Family::Grains) {
                kinds::anchor(&mut own, folder);
            }
            if matches!(kind, Family::Collapse) {
                kinds::anchor_packing(&mut own, "grains.packing", folder);
            }
            if matches!(kind, Family::Collapse | Family::Cylinder) {
                layers::anchor_path(&mut own, "terrain.heights", folder);
                layers::anchor_path(&mut own, "terrain.mesh", folder);
            }
        }
        // What was written, before a file's numbers take their places.
        let mut written = own.clone();
        // A flow down a slope goes by |τ|/σ_zz, which its weight gives.
        let friction = match kind {
            Family::Incline => FrictionOf::NormalStress,
            _ => FrictionOf::Pressure,
        };
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
        let of_incline = matches!(kind, Family::Incline) && table.contains_key("rheology");
        let of_continuum = matches!(
            kind,
            Family::Bagnold
                | Family::Sheared
                | Family::Collapse
                | Family::Cylinder
                | Family::OpenChute
        );
        if of_incline || of_continuum {
            // A bundled scene has the numbers of all laws, as defaults.
            if folder.is_some() && !friction_keys::chooses(&set) {
                friction_keys::check_read(&table, &written, origin)?;
            }
            friction_keys::check_read(&table, &set_by_hand, option)?;
            friction_keys::drop_unread(&mut table);
            friction_keys::check_complete(&table, origin)?;
        }
        check::check(&table, &schema, origin)?;
        check::require(&table, &schema, origin)?;

        let body = body(&name, &table).map_err(|message| SceneError::Unreadable {
            file: origin.to_owned(),
            message,
        })?;
        let mut resolved = toml::Table::new();
        resolved.insert("scene".into(), toml::Value::String(name.clone()));
        resolved.extend(body.to_table());
        inputs.extend(body.start_file().map(PathBuf::from));
        match &body {
            SceneBody::Grains(_) => inputs.extend(kinds::inputs(&resolved)),
            SceneBody::Collapse(scene) => {
                let packing = scene.grains.packing.as_deref();
                inputs.extend(packing.filter(|s| s.ends_with(".h5")).map(PathBuf::from));
            }
            _ => {}
        }
        let terrain = match &body {
            SceneBody::Collapse(body) => {
                body.terrain.as_ref().and_then(|keys| keys.source().file())
            }
            SceneBody::Cylinder(body) => body.terrain.as_ref().and_then(ReliefKeys::file),
            _ => None,
        };
        inputs.extend(terrain.map(|(_, file)| PathBuf::from(file)));
        let scene = Scene {
            name,
            body,
            resolved,
            origin: origin.to_owned(),
            inputs,
        };
        scene.check_together(origin)?;
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

    /// The resolved scene as TOML.
    pub fn to_toml(&self) -> String {
        let body = toml::to_string_pretty(&self.resolved).unwrap_or_default();
        format!("# Resolved scene: every key with the value that was used. SI units.\n{body}")
    }

    /// Limits that involve more than one key.
    fn check_together(&self, origin: &str) -> Result<(), SceneError> {
        match &self.body {
            SceneBody::Incline(scene) => scene.check_together(origin),
            SceneBody::Bagnold(scene) => scene.check_together(origin),
            SceneBody::Sheared(scene) => scene.check_together(origin),
            SceneBody::Impact(scene) => scene.check_together(origin),
            SceneBody::Chute(scene) => scene.check_together(origin),
            SceneBody::Settle(scene) => scene.check_together(origin),
            SceneBody::Grains(kind) => kind.check_together(origin),
            SceneBody::Collapse(scene) => scene.check_together(origin),
            SceneBody::Cylinder(scene) => scene.check_together(origin),
            SceneBody::OpenChute(scene) => scene.check_together(origin),
        }
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

fn body(name: &str, table: &toml::Table) -> Result<SceneBody, String> {
    let table = table.clone();
    Ok(match family(name) {
        Family::Incline => SceneBody::Incline(table.try_into().map_err(plain)?),
        Family::Bagnold => SceneBody::Bagnold(table.try_into().map_err(plain)?),
        Family::Sheared => SceneBody::Sheared(ShearedScene::read(name, table).map_err(plain)?),
        Family::Impact => SceneBody::Impact(table.try_into().map_err(plain)?),
        Family::Chute => SceneBody::Chute(table.try_into().map_err(plain)?),
        Family::Settle => SceneBody::Settle(table.try_into().map_err(plain)?),
        Family::Grains => match Kind::read(name, table) {
            Some(kind) => SceneBody::Grains(Box::new(kind.map_err(plain)?)),
            None => return Err(format!("no scene is called `{name}`")),
        },
        Family::Collapse => SceneBody::Collapse(table.try_into().map_err(plain)?),
        Family::Cylinder => SceneBody::Cylinder(table.try_into().map_err(plain)?),
        Family::OpenChute => SceneBody::OpenChute(table.try_into().map_err(plain)?),
    })
}

fn plain(error: toml::de::Error) -> String {
    error.message().to_owned()
}

/// A sphere lighter than this (kg) is a slip of the keyboard, and its mass soon rounds to zero.
const LEAST_MASS: f64 = 1e-100;

enum Family {
    Incline,
    Bagnold,
    Sheared,
    Impact,
    Chute,
    Settle,
    Grains,
    Collapse,
    Cylinder,
    OpenChute,
}

/// What a scene of this kind builds on. A `grains` scene stands for itself: walls and grains of the
/// bundled example are nobody's defaults.
fn base_of(name: &str) -> &'static str {
    match name {
        "grains" => "",
        _ => bundled(name).unwrap_or_default(),
    }
}

fn family(name: &str) -> Family {
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
        _ => Family::Incline,
    }
}

/// Keys of which exactly one may be given: naming one drops the others' defaults.
fn alternatives(name: &str) -> &'static [&'static [&'static str]] {
    match family(name) {
        Family::Incline => &INCLINE_CHOICES,
        Family::Bagnold | Family::Sheared | Family::Cylinder => rheology_file::ALTERNATIVES,
        Family::Collapse => &COLLAPSE_CHOICES,
        Family::OpenChute => &CHUTE_CHOICES,
        Family::Impact | Family::Grains => &law::CHOICES,
        Family::Chute | Family::Settle => &BED_CHOICES,
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

/// The JSON Schema of one kind, without the key `scene`.
fn body_schema(name: &str) -> Value {
    let schema = match family(name) {
        Family::Incline => schemars::schema_for!(InclineScene),
        Family::Bagnold => schemars::schema_for!(BagnoldScene),
        Family::Sheared => return ShearedScene::schema(name),
        Family::Impact => schemars::schema_for!(ImpactScene),
        Family::Chute => schemars::schema_for!(ChuteScene),
        Family::Settle => schemars::schema_for!(SettleScene),
        Family::Grains => return Kind::schema(name).unwrap_or_default(),
        Family::Collapse => schemars::schema_for!(CollapseScene),
        Family::Cylinder => schemars::schema_for!(CylinderScene),
        Family::OpenChute => schemars::schema_for!(OpenChuteScene),
    };
    schema.to_value()
}

/// Checks a table of keys of the continuum scene as a scene file would be.
pub fn check_continuum_keys(table: &toml::Table, origin: &str) -> Result<(), SceneError> {
    check::check(table, &body_schema("bagnold"), origin)
}

/// The JSON Schema of scene files, for editors.
///
/// Only `scene` is required: keys left out take the value of the bundled scene.
pub fn json_schema() -> Value {
    let mut kinds = Vec::new();
    let mut definitions = serde_json::Map::new();
    for (name, _) in BUNDLED {
        let mut schema = body_schema(name);
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_bundled_scene_is_complete_and_survives_a_round_trip() {
        for (name, _) in BUNDLED {
            let scene = Scene::load(name, &[]).unwrap();
            assert_eq!(scene.name, name);
            let again = Scene::from_text(&scene.to_toml(), "resolved").unwrap();
            assert_eq!(scene, again);
        }
    }

    #[test]
    fn a_setting_reaches_its_key_and_drops_the_alternatives() {
        let settings = [
            "slope_degrees=31".to_owned(),
            "contact.stiffness=5e4".to_owned(),
        ];
        let scene = Scene::load("incline-moderate", &settings).unwrap();
        let SceneBody::Incline(incline) = scene.body else {
            panic!("wrong kind")
        };
        assert_eq!(incline.slope_degrees, 31.0);
        assert_eq!(incline.contact.stiffness, Some(5e4));
        assert_eq!(incline.contact.stiffness_scaled, None);
    }

    #[test]
    fn mistakes_name_key_value_and_range() {
        let message = |set: &str| {
            Scene::load("incline-moderate", &[set.to_owned()])
                .unwrap_err()
                .to_string()
        };
        let m = message("slope_degrees=95");
        assert!(
            m.contains("slope_degrees") && m.contains("95") && m.contains("90"),
            "{m}"
        );
        let m = message("contact.fricton=0.3");
        assert!(
            m.contains("contact.fricton") && m.contains("contact.friction"),
            "{m}"
        );
        let m = message("seed=\"one\"");
        assert!(
            m.contains("seed") && m.contains("one") && m.contains("integer"),
            "{m}"
        );
    }
}
