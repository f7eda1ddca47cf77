//! Calibration: a campaign of inclined-plane runs, the μ(I) law fitted to it, and the continuum
//! with that law beside the grains.

mod findings;

use crate::cost::Cost;
use crate::failure::Failure;
use crate::interruption;
use crate::progress::{Bar, Bars};
use crate::report::calibration::{Campaign, Comparison, FrictionOf};
use crate::rheology_file::{FitRow, Provenance, RheologyFile};
use crate::run::{self, RunOptions, bagnold, incline};
use crate::run_directory::RunDirectory;
use crate::scene::{InclineScene, Scene, SceneBody};
use crate::summary::{Status, Summary};
use colluvium_coupling::calibration::MuIFit;
use colluvium_coupling::campaign::{
    Bracket, CampaignError, CampaignEvent, CampaignResult, CampaignSpec, GuessedLaw, run_campaign,
};
use colluvium_coupling::incline::{InclineResult, Purpose};
use colluvium_dem::Threads;
use colluvium_dem::preparation::Bed;
use std::collections::BTreeMap;
use std::ops::ControlFlow;
use std::path::PathBuf;
use std::sync::Mutex;
use std::time::Instant;

/// Finished runs of a campaign that may be stopped and resumed.
const ANGLES: &str = "angles.json";
/// The whole campaign, for reports.
pub const CAMPAIGN: &str = "campaign.json";
/// The fitted law.
pub const RHEOLOGY: &str = "rheology.toml";

/// Runs the campaign of an incline scene and writes its directory; gives the directory's path.
pub fn calibrate(scene: &Scene, options: &RunOptions) -> Result<PathBuf, Failure> {
    let SceneBody::Incline(body) = &scene.body else {
        return Err(Failure::Input(format!(
            "calibrate: `{}` is not an incline; allowed: incline-moderate, incline-gravel, incline-glass, or a scene file of one of these kinds",
            scene.name
        )));
    };
    interruption::listen();
    let threads = options.threads.unwrap_or_else(rayon::current_num_threads);
    let directory = run::open_directory(scene, options)?;
    let pool = rayon::ThreadPoolBuilder::new()
        .num_threads(threads)
        .build()
        .map_err(|error| Failure::Run(format!("cannot start {threads} threads: {error}")))?;
    let done = finished_angles(&directory, options.resume)?;
    let mut summary = Summary::begun(&scene.name, "calibrate");
    directory.write_summary(&summary)?;
    directory
        .journal
        .note(&format!("calibrate {} with {threads} threads", scene.name));
    match pool.install(|| campaign(scene, body, &directory, &done, threads)) {
        Ok(()) => Ok(directory.path().to_owned()),
        Err(failure @ (Failure::Scene(_) | Failure::Input(_))) => {
            directory.abandon();
            Err(failure)
        }
        Err(failure) => {
            let interrupted = matches!(failure, Failure::Interrupted { .. });
            summary.status = if interrupted {
                Status::Interrupted
            } else {
                Status::Failed
            };
            summary.remarks.push(failure.to_string());
            directory.journal.note(&failure.to_string());
            directory.write_summary(&summary)?;
            Err(failure)
        }
    }
}

/// The runs that an interrupted campaign had finished.
fn finished_angles(directory: &RunDirectory, resume: bool) -> Result<Vec<InclineResult>, Failure> {
    let path = directory.file(ANGLES);
    if !resume || !path.exists() {
        return Ok(Vec::new());
    }
    let refuse = |why: String| {
        Failure::Input(format!(
            "--resume: {} cannot be used: {why}; nothing was changed",
            path.display()
        ))
    };
    let text = std::fs::read_to_string(&path).map_err(|error| refuse(error.to_string()))?;
    let runs: Vec<InclineResult> =
        serde_json::from_str(&text).map_err(|error| refuse(error.to_string()))?;
    directory
        .journal
        .note(&format!("{} runs were finished before", runs.len()));
    Ok(runs)
}

fn campaign_spec(scene: &Scene, body: &InclineScene, bed: &Bed) -> CampaignSpec {
    let keys = &body.calibration;
    let bracket = |b: crate::scene::Bracket| Bracket {
        low: b.low,
        high: b.high,
        resolution: b.resolution,
    };
    CampaignSpec {
        // Angles run side by side, each on one thread: no bit depends on their number.
        base: incline::spec(body, bed, Threads::Serial),
        published_material: published_material(&scene.name).map(String::from),
        flow_angles_degrees: keys.flow_degrees.clone(),
        guessed_law: GuessedLaw {
            mu_s: keys.guess.mu_s,
            mu_2: keys.guess.mu_2,
            i_0: keys.guess.i_0,
        },
        stop: bracket(keys.stop),
        onset: bracket(keys.onset),
        search_time: keys.search_time,
        search_inertial_number: keys.search_inertial_number,
        usable_drift: keys.usable_drift,
    }
}

/// The row of the thesis' Table 2.6 that a scene can be compared with.
pub fn published_material(scene: &str) -> Option<&'static str> {
    match scene {
        "incline-moderate" => Some("moderate"),
        "incline-gravel" => Some("gravel"),
        _ => None,
    }
}

/// Bars and files of a campaign under way; events come from several threads.
struct Observer<'a> {
    directory: &'a RunDirectory,
    bars: Bars,
    shown: Mutex<BTreeMap<String, Bar>>,
    finished: Mutex<Vec<InclineResult>>,
    unwritten: Mutex<Option<Failure>>,
}

impl Observer<'_> {
    fn see(&self, event: CampaignEvent) {
        match event {
            CampaignEvent::Started {
                slope_degrees,
                purpose,
            } => {
                let label = label(slope_degrees, purpose);
                self.directory.journal.note(&format!("{label} begins"));
                if let Ok(mut shown) = self.shown.lock() {
                    shown.insert(label.clone(), self.bars.add(&label));
                }
            }
            CampaignEvent::Progress {
                slope_degrees,
                purpose,
                fraction,
            } => {
                if let Ok(shown) = self.shown.lock()
                    && let Some(bar) = shown.get(&label(slope_degrees, purpose))
                {
                    bar.set(fraction);
                }
            }
            CampaignEvent::Finished(result) => self.keep(result),
        }
    }

    /// Saves a finished run, so that a campaign that is stopped goes on from there.
    fn keep(&self, result: &InclineResult) {
        let label = label(result.slope_degrees, result.purpose);
        let how = incline::outcome_words(result);
        self.directory
            .journal
            .note(&format!("{label} is done: {how}"));
        if let Ok(shown) = self.shown.lock()
            && let Some(bar) = shown.get(&label)
        {
            bar.finish(if result.flows() { "flows" } else { "rests" });
        }
        if let Ok(mut finished) = self.finished.lock() {
            finished.push(result.clone());
            let saved = serde_json::to_vec(&*finished)
                .map_err(|error| Failure::Run(error.to_string()))
                .and_then(|text| self.directory.write(ANGLES, &text));
            if let (Err(failure), Ok(mut unwritten)) = (saved, self.unwritten.lock()) {
                *unwritten = Some(failure);
            }
        }
    }
}

fn label(slope_degrees: f64, purpose: Purpose) -> String {
    let what = match purpose {
        Purpose::Measure => "flow",
        Purpose::StopSearch => "stop?",
        Purpose::OnsetSearch => "onset?",
    };
    format!("{what} {slope_degrees:.2} degrees")
}

fn campaign(
    scene: &Scene,
    body: &InclineScene,
    directory: &RunDirectory,
    done: &[InclineResult],
    threads: usize,
) -> Result<(), Failure> {
    let start = Instant::now();
    let stopped = || Failure::Interrupted {
        directory: directory.path().to_owned(),
    };
    let bar = Bar::new("settling the bed");
    let sharing = if threads > 1 {
        Threads::Rayon
    } else {
        Threads::Serial
    };
    let bed = incline::settle(body, sharing, &bar)?.ok_or_else(stopped)?;
    bar.clear();
    directory.journal.note(&format!(
        "bed: {} grains over {} fixed, depth {:.4} m, solid fraction {:.4}",
        bed.report.grains, bed.report.base_grains, bed.report.depth, bed.report.solid_fraction
    ));
    let spec = campaign_spec(scene, body, &bed);
    let observer = Observer {
        directory,
        bars: Bars::default(),
        shown: Mutex::default(),
        finished: Mutex::new(done.to_vec()),
        unwritten: Mutex::default(),
    };
    let result = run_campaign(
        &spec,
        done,
        &|event| observer.see(event),
        interruption::flag(),
    );
    if let Ok(Some(failure)) = observer.unwritten.into_inner() {
        return Err(failure);
    }
    let result = result.map_err(|error| match error {
        CampaignError::Stopped => stopped(),
        CampaignError::OutOfRange { .. } => Failure::Input(error.to_string()),
        CampaignError::Run(error) => incline::failure(error),
    })?;
    let dem_wall = start.elapsed().as_secs_f64();
    directory.journal.note(&result.verdict.text);
    let comparisons = compare(body, &result, directory)?;
    if let Some(fit) = &result.fit {
        let file = rheology_file(scene, body, &result, fit);
        directory.write(RHEOLOGY, file.to_toml().as_bytes())?;
    }
    let record = Campaign {
        result,
        comparisons,
        gravity: body.gravity,
        diameter: body.grains.diameter,
    };
    let text = serde_json::to_vec(&record).map_err(|error| Failure::Run(error.to_string()))?;
    directory.write(CAMPAIGN, &text)?;

    let mut summary = findings::summarise(scene, &record);
    summary.model = incline::model(body, &bed);
    let grain_steps = record.result.cost.grain_steps + bed.report.grain_steps;
    summary.cost = Cost::measured(dem_wall, threads, grain_steps, 0);
    let tables = findings::tables(&record);
    run::finish(
        scene,
        directory,
        run::Findings {
            summary,
            tables,
            grains: None,
        },
    )
}

fn rheology_file(
    scene: &Scene,
    body: &InclineScene,
    result: &CampaignResult,
    fit: &MuIFit,
) -> RheologyFile {
    RheologyFile {
        mu_s: fit.mu_s,
        mu_s_error: Some(fit.mu_s_error),
        mu_2: fit.mu_2,
        mu_2_error: Some(fit.mu_2_error),
        i_0: fit.i_0,
        i_0_error: Some(fit.i_0_error),
        diameter: body.grains.diameter,
        solid_fraction: fit.solid_fraction,
        solid_fraction_error: Some(fit.solid_fraction_error),
        grain_density: Some(body.grains.density),
        valid_i: Some(fit.valid_i),
        covariance: Some(fit.covariance),
        mu_zz: result.fit_zz.as_ref().map(|f| FitRow {
            mu_s: f.mu_s,
            mu_s_error: f.mu_s_error,
            mu_2: f.mu_2,
            mu_2_error: f.mu_2_error,
            i_0: f.i_0,
            i_0_error: f.i_0_error,
        }),
        provenance: Some(Provenance {
            version: env!("CARGO_PKG_VERSION").into(),
            scene: scene.name.clone(),
            flow_degrees: body.calibration.flow_degrees.clone(),
            seed: body.seed,
            friction: "|tau|/p, p = trace/3".into(),
            verdict: result.verdict.text.clone(),
        }),
    }
}

/// Runs the continuum with the fitted laws at the angles of `calibration.compare_degrees`.
fn compare(
    body: &InclineScene,
    result: &CampaignResult,
    directory: &RunDirectory,
) -> Result<Vec<Comparison>, Failure> {
    let mut comparisons = Vec::new();
    let fits = [
        (FrictionOf::Pressure, &result.fit),
        (FrictionOf::NormalStress, &result.fit_zz),
    ];
    for angle in &body.calibration.compare_degrees {
        let run = result.runs.iter().find(|r| {
            r.purpose == Purpose::Measure
                && (r.slope_degrees - angle).abs() < 1e-9
                && r.profile.is_some()
        });
        let Some(run) = run else {
            directory.journal.note(&format!(
                "no flow was measured at {angle} degrees: not compared"
            ));
            continue;
        };
        for (friction, fit) in fits {
            let Some(fit) = fit else { continue };
            if angle.to_radians().tan() >= fit.mu_2 {
                directory.journal.note(&format!(
                    "{angle} degrees lies above atan(mu_2) = {:.3}: not compared",
                    fit.mu_2
                ));
                continue;
            }
            let settings = layer_settings(body, fit, *angle, run.height);
            let scene = Scene::load("bagnold", &settings)?;
            let SceneBody::Bagnold(layer) = &scene.body else {
                continue;
            };
            let (solution, wall_s) = bagnold::solve(layer, &mut |_| ControlFlow::Continue(()))
                .map_err(bagnold::failure)?;
            let inertial_number = bagnold::case(layer)
                .rheology
                .inertial_number_at(angle.to_radians().tan());
            comparisons.push(Comparison {
                slope_degrees: *angle,
                friction,
                inertial_number,
                inside_valid_i: (fit.valid_i[0]..=fit.valid_i[1]).contains(&inertial_number),
                velocity_error: solution.velocity_error_l2_relative,
                wall_s,
                z: solution.z,
                u: solution.u,
                p: solution.p,
                exact_u: solution.exact_u,
            });
        }
    }
    Ok(comparisons)
}

/// The continuum layer that stands beside a flow of grains.
fn layer_settings(body: &InclineScene, fit: &MuIFit, angle: f64, depth: f64) -> Vec<String> {
    // TOML wants a point or an exponent in a number that is not whole; `{:e}` always gives one.
    let real = |key: &str, value: f64| format!("{key}={value:e}");
    vec![
        real("slope_degrees", angle),
        real("depth", depth),
        real("gravity", body.gravity),
        real("rheology.mu_s", fit.mu_s.max(0.0)),
        real("rheology.mu_2", fit.mu_2),
        real("rheology.i_0", fit.i_0),
        real("rheology.diameter", body.grains.diameter),
        real("rheology.solid_fraction", fit.solid_fraction),
        real("rheology.grain_density", body.grains.density),
        format!("grid.cells={}", body.calibration.compare_cells),
    ]
}
