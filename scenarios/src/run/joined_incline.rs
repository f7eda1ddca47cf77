//! Grains below and continuum above on an incline: from the scene to both profiles.

pub(super) mod findings;

use super::{Findings, Under, incline};
use crate::failure::Failure;
use crate::progress::Bar;
use crate::scene::{InclineScene, OverlapKeys, RheologyKeys, Scene, SceneError};
use colluvium_coupling::overlap::joined_incline::{
    JoinedInclineError, JoinedInclineRun, JoinedInclineSpec,
};
use colluvium_coupling::overlap::{OverlapError, Resolved};
use colluvium_dem::Threads;
use colluvium_dem::preparation::{Bed, InclineBed};

/// Layers that are settled above the edge and then cut, in diameters: the surface of a bed is uneven, and the mean
/// mass of so many grains is not that of all.
const SURPLUS: f64 = 2.5;

/// What is not computed.
pub fn left_out(scene: &InclineScene) -> Vec<String> {
    let mut list = incline::left_out(scene);
    list.extend(
        [
            "grains above the edge",
            "granular temperature of the continuum",
            "dilatancy of the continuum (constant solid fraction)",
            "exchange of mass through the edge (it moves with the grains)",
        ]
        .map(String::from),
    );
    list
}

/// The bed of grains that is settled: all of it where the flow begins as grains alone, else up to the edge.
pub fn bed(scene: &InclineScene, (rheology, overlap): (&RheologyKeys, &OverlapKeys)) -> InclineBed {
    let all = incline::bed(scene);
    if overlap.from > 0.0 {
        return all;
    }
    let [length, width] = scene.floor_edges();
    let reach = (overlap.height_diameters + SURPLUS) * scene.grains.diameter;
    let mass = reach * length * width * rheology.solid_fraction * rheology.grain_density;
    InclineBed {
        grains: ((mass / scene.expected_mass()).ceil() as usize).min(all.grains),
        ..all
    }
}

/// The run that a scene asks for, on a settled bed.
pub fn spec(
    scene: &InclineScene,
    (rheology, overlap): (&RheologyKeys, &OverlapKeys),
    bed: &Bed,
    threads: Threads,
) -> JoinedInclineSpec {
    JoinedInclineSpec {
        incline: incline::spec(scene, bed, threads),
        height: overlap.height_diameters * scene.grains.diameter,
        from: overlap.from,
        mass: (overlap.from == 0.0).then(|| scene.total_mass()),
        rheology: rheology.mu_i(),
        stiffness: scene.stiffness(),
        settings: overlap.settings(scene.grains.diameter),
    }
}

/// The settings of the overlap with nothing left out.
pub fn resolved(scene: &Scene, body: &InclineScene) -> Result<Resolved, Failure> {
    let keys = keys(body)?;
    let bed = super::precheck::stand_in_bed(body);
    let spec = spec(body, keys, &bed, Threads::Serial);
    spec.resolved()
        .map_err(|error| explain(scene, body, error.into()))
}

/// Law and edge, which the scene's check has seen to be there.
pub(super) fn keys(scene: &InclineScene) -> Result<(&RheologyKeys, &OverlapKeys), Failure> {
    scene
        .continuum_keys()
        .ok_or_else(|| Failure::Input("rheology and overlap are missing".into()))
}

/// Checks the overlap before anything is written.
pub(super) fn check(scene: &Scene, body: &InclineScene) -> Result<(), Failure> {
    let keys = keys(body)?;
    let bed = super::precheck::stand_in_bed(body);
    let spec = JoinedInclineSpec {
        mass: None,
        ..spec(body, keys, &bed, Threads::Serial)
    };
    let checked = spec.validate().and_then(|()| Ok(spec.resolved()?));
    let settings = checked.map_err(|error| explain(scene, body, error))?;
    let d = body.grains.diameter;
    let most = (body.continuum_depth(keys.0) - settings.cell) / d;
    if keys.1.height_diameters > most {
        let least = (settings.inner + settings.buffer + settings.cell) / d;
        let range = format!("[{least:.4}, {most:.4}]: a cell below the surface of all material");
        return Err(scene
            .out_of_range("overlap.height_diameters", keys.1.height_diameters, &range)
            .into());
    }
    Ok(())
}

/// An error of a joined run in the words of the scene.
fn explain(scene: &Scene, body: &InclineScene, error: JoinedInclineError) -> Failure {
    match error {
        JoinedInclineError::Overlap(error) => overlap_error(scene, body, error).into(),
        JoinedInclineError::Incline(error) => super::precheck::explain(scene, error),
    }
}

fn overlap_error(scene: &Scene, body: &InclineScene, error: OverlapError) -> SceneError {
    match error {
        OverlapError::OutOfRange {
            key,
            value,
            allowed,
        } => {
            let (key, length) = OverlapKeys::key(key);
            let unit = if length { body.grains.diameter } else { 1.0 };
            // Diameters there and back leave digits behind that nobody wrote.
            let value = (value / unit * 1e9).round() / 1e9;
            scene.out_of_range(&key, value, allowed)
        }
        other => SceneError::Unreadable {
            file: scene.origin.clone(),
            message: other.to_string(),
        },
    }
}

/// What an error of a run means for the process.
fn failure(error: JoinedInclineError) -> Failure {
    match error {
        JoinedInclineError::Overlap(OverlapError::OutOfRange { .. } | OverlapError::Record(_)) => {
            Failure::Input(error.to_string())
        }
        JoinedInclineError::Incline(error) => incline::failure(error),
        error => Failure::Run(error.to_string()),
    }
}

pub(super) fn run(scene: &InclineScene, under: &mut Under) -> Result<Findings, Failure> {
    let keys = keys(scene)?;
    let threads = under.threads_of_one_run();
    let bar = Bar::new("settling the bed");
    let bed = incline::settle_of_run(&bed(scene, keys), under, &bar)?;
    let spec = spec(scene, keys, &bed, threads);
    let mut run = match &under.resumed {
        Some(saved) => JoinedInclineRun::resume(spec, &saved.record),
        None => JoinedInclineRun::new(spec),
    }
    .map_err(failure)?;
    under.begin()?;
    let bar = Bar::new(&format!(
        "{}, hybrid, at {} degrees",
        under.scene.name, scene.slope_degrees
    ));
    while !run.finished() {
        run.advance(incline::STEPS_PER_LOOK).map_err(failure)?;
        bar.set(run.progress());
        under.checkpoint(incline::STAGE, || run.checkpoint())?;
    }
    bar.clear();
    let Some(result) = run.finish() else {
        return Err(Failure::Run(
            "the run ended before the continuum took over".into(),
        ));
    };
    Ok(findings::of(scene, keys.0, &bed, result, under))
}
