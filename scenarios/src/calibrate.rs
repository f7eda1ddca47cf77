//! Calibration: a campaign of inclined-plane runs, the μ(I) law fitted to it, and the continuum
//! with that law beside the grains.

mod comparison;
mod design;
mod findings;
mod material;

use design::flows_of_depths;
pub use design::{designs, flow_degrees};
pub use material::published_material;

use crate::cost::Cost;
use crate::failure::{Failure, Resumes};
use crate::interruption;
use crate::progress::{Bar, Bars};
use crate::report::calibration::Campaign;
use crate::rheology_file::{FitRow, Provenance, RheologyFile};
use crate::run::{self, Ended, RunOptions, incline, precheck};
use crate::run_directory::{ANGLES, RunDirectory};
use crate::scene::{InclineModel, InclineScene, Scene, SceneBody};
use crate::summary::Status;
use colluvium_coupling::calibration::{MuIFit, friction_table};
use colluvium_coupling::campaign::{
    Bracket, CampaignError, CampaignEvent, CampaignResult, CampaignSpec, FlowsOfDepth, GuessedLaw,
    OtherBed, run_campaign,
};
use colluvium_coupling::incline::{InclineResult, Purpose};
use colluvium_dem::Threads;
use colluvium_dem::preparation::Bed;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::sync::Mutex;
use std::time::Instant;

/// The whole campaign, for reports.
pub const CAMPAIGN: &str = "campaign.json";
/// The fitted law.
pub const RHEOLOGY: &str = "rheology.toml";
/// Samples of the posterior of the fitted law, as a table.
pub const POSTERIOR: &str = "posterior";

/// Runs the campaign of an incline scene and writes its directory.
pub fn calibrate(scene: &Scene, options: &RunOptions) -> Result<Ended, Failure> {
    let SceneBody::Incline(body) = &scene.body else {
        return Err(Failure::Input(format!(
            "calibrate: `{}` is not an incline; allowed: incline-moderate, incline-gravel, incline-glass, or a scene file of one of these kinds",
            scene.name
        )));
    };
    if body.model != InclineModel::Dem {
        let range = "dem: a campaign measures grains; set model=dem";
        return Err(scene.out_of_range("model", body.model.word(), range).into());
    }
    interruption::listen();
    precheck::incline(scene, body)?;
    let spec = campaign_spec(scene, body, &precheck::stand_in_bed(body), Beds::default());
    precheck::campaign(scene, &spec)?;
    let threads = options.threads.unwrap_or_else(rayon::current_num_threads);
    let (directory, before) = run::open_directory(scene, options, "calibrate")?;
    if before.is_some_and(|s| s.status == Status::Done) {
        if Campaign::read(directory.path()).is_some() {
            return run::already_done(&directory);
        }
        // Its record is of another version, or gone: the runs stay, and what they say is worked out again.
        let note = format!("{CAMPAIGN} cannot be read: evaluated again from its runs");
        directory.journal.note(&note);
    }
    let before = finished_angles(&directory, options.resume)?;
    if options.resume {
        directory.journal.note("resumed");
    }
    directory.mark_running()?;
    directory
        .journal
        .note(&format!("calibrate {} with {threads} threads", scene.name));
    let start = Instant::now();
    let wall_before = before.wall_s;
    let done = run::pool(threads)
        .and_then(|pool| pool.install(|| campaign(scene, body, &directory, before, threads)));
    match done {
        Ok(warnings) => Ok(Ended {
            directory: directory.path().to_owned(),
            already_done: false,
            warnings,
        }),
        Err(failure) => {
            // All input was checked before the directory was made: whatever fails now is the run,
            // and the angles that are finished stay.
            let wall_s = wall_before + start.elapsed().as_secs_f64();
            Err(directory.mark_ended(failure.after_work(), wall_s))
        }
    }
}

/// The user's wish to stop, as a failure.
fn stopped(directory: &RunDirectory) -> Failure {
    Failure::Interrupted {
        directory: directory.path().to_owned(),
        resumes: Resumes::from_saved(directory.file(ANGLES).exists()),
    }
}

/// Finished runs of a campaign, as they are saved.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
struct Angles {
    /// Wall time of the parts that made them (s).
    wall_s: f64,
    /// The runs.
    runs: Vec<InclineResult>,
}

/// The runs that an interrupted campaign had finished.
fn finished_angles(directory: &RunDirectory, resume: bool) -> Result<Angles, Failure> {
    let path = directory.file(ANGLES);
    if !resume || !path.exists() {
        return Ok(Angles::default());
    }
    let refuse = |why: String| {
        Failure::Input(format!(
            "--resume: {} cannot be used: {why}; nothing was changed",
            path.display()
        ))
    };
    let text = std::fs::read_to_string(&path).map_err(|error| refuse(error.to_string()))?;
    let angles: Angles = serde_json::from_str(&text).map_err(|error| refuse(error.to_string()))?;
    directory
        .journal
        .note(&format!("{} runs were finished before", angles.runs.len()));
    Ok(angles)
}

/// Beds besides the first.
#[derive(Default)]
struct Beds {
    others: Vec<OtherBed>,
    depths: Vec<OtherBed>,
    /// Of the depths of flows, in the order of the design.
    of_flows: Vec<OtherBed>,
    /// Grain-steps that settling them took.
    grain_steps: u64,
}

/// Settles the beds of other seeds and depths, side by side; nothing if the user stopped it.
fn more_beds(body: &InclineScene) -> Result<Option<Beds>, Failure> {
    let keys = &body.calibration;
    let mut scenes: Vec<InclineScene> = (1..keys.beds)
        .map(|k| InclineScene {
            seed: body.seed + k,
            ..body.clone()
        })
        .collect();
    let of_flows = flows_of_depths(body);
    // Of other depths the stop alone is sought.
    let depths: &[f64] = if keys.search { &keys.depths } else { &[] };
    let factors = depths.iter().chain(of_flows.iter().map(|(f, _)| f));
    scenes.extend(factors.map(|factor| {
        let mut shallow = body.clone();
        shallow.grains.count = (body.grains.count as f64 * factor).round().max(50.0) as u64;
        shallow
    }));
    let settled: Vec<Result<Option<Bed>, Failure>> = scenes
        .par_iter()
        .with_max_len(1)
        .map(|scene| incline::settle(&incline::bed(scene), Threads::Serial, &Bar::hidden()))
        .collect();
    let mut beds = Beds::default();
    for (k, bed) in settled.into_iter().enumerate() {
        let Some(bed) = bed? else { return Ok(None) };
        beds.grain_steps += bed.report.grain_steps;
        let list = match k + 1 {
            n if n < keys.beds as usize => &mut beds.others,
            n if n < keys.beds as usize + depths.len() => &mut beds.depths,
            _ => &mut beds.of_flows,
        };
        list.push(OtherBed {
            domain: bed.domain,
            grains: bed.grains,
        });
    }
    Ok(Some(beds))
}

fn campaign_spec(scene: &Scene, body: &InclineScene, bed: &Bed, beds: Beds) -> CampaignSpec {
    let keys = &body.calibration;
    let bracket = |b: crate::scene::Bracket| Bracket {
        low: b.low,
        high: b.high,
        resolution: b.resolution,
    };
    // Where beds are not settled yet, the first stands for them.
    let mut of_flows = beds.of_flows.into_iter();
    let flows_of_depth = flows_of_depths(body)
        .into_iter()
        .map(|(_, slopes_degrees)| {
            let first = || OtherBed {
                domain: bed.domain,
                grains: bed.grains.clone(),
            };
            FlowsOfDepth {
                bed: of_flows.next().unwrap_or_else(first),
                slopes_degrees,
            }
        });
    CampaignSpec {
        flows_of_depth: flows_of_depth.collect(),
        // Angles run side by side, each on one thread: no bit depends on their number.
        base: incline::spec(body, bed, Threads::Serial),
        published_material: published_material(scene).map(String::from),
        flow_angles_degrees: flow_degrees(body),
        guessed_law: GuessedLaw {
            mu_s: keys.guess.mu_s,
            mu_2: keys.guess.mu_2,
            i_0: keys.guess.i_0,
        },
        searches: keys.search,
        stop: bracket(keys.stop),
        onset: bracket(keys.onset),
        search_time: keys.search_time,
        search_inertial_number: keys.search_inertial_number,
        usable_drift: keys.usable_drift,
        other_beds: beds.others,
        flow_beds: keys.flow_beds as usize,
        depths: beds.depths,
        seed: body.seed,
    }
}

/// Bars and files of a campaign under way; events come from several threads.
struct Observer<'a> {
    directory: &'a RunDirectory,
    bars: Bars,
    shown: Mutex<BTreeMap<String, Bar>>,
    finished: Mutex<Angles>,
    wall_before: f64,
    start: Instant,
    /// Why a finished run could not be saved, which stops the campaign.
    unwritten: Mutex<Option<Failure>>,
}

impl Observer<'_> {
    fn see(&self, event: CampaignEvent) {
        match event {
            CampaignEvent::Started {
                slope_degrees,
                purpose,
                bed,
            } => {
                let label = label(slope_degrees, purpose, bed);
                self.directory.journal.note(&format!("{label} begins"));
                if let Ok(mut shown) = self.shown.lock() {
                    shown.insert(label.clone(), self.bars.add(&label));
                }
            }
            CampaignEvent::Progress {
                slope_degrees,
                purpose,
                bed,
                fraction,
            } => {
                if let Ok(shown) = self.shown.lock()
                    && let Some(bar) = shown.get(&label(slope_degrees, purpose, bed))
                {
                    bar.set(fraction);
                }
            }
            CampaignEvent::Finished(result) => self.keep(result),
        }
    }

    /// Saves a finished run, so that a campaign that is stopped goes on from there.
    fn keep(&self, result: &InclineResult) {
        let label = label(result.slope_degrees, result.purpose, result.bed);
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
            finished.runs.push(result.clone());
            finished.wall_s = self.wall_before + self.start.elapsed().as_secs_f64();
            let saved = serde_json::to_vec(&*finished)
                .map_err(|error| Failure::Run(error.to_string()))
                .and_then(|text| self.directory.write(ANGLES, &text));
            if let (Err(failure), Ok(mut unwritten)) = (saved, self.unwritten.lock()) {
                // What follows could not be saved either: the campaign ends here, and goes on when there is room.
                interruption::request();
                unwritten.get_or_insert(failure);
            }
        }
    }
}

fn label(slope_degrees: f64, purpose: Purpose, bed: u64) -> String {
    let what = match purpose {
        Purpose::Measure => "flow",
        Purpose::StopSearch => "stop?",
        Purpose::OnsetSearch => "onset?",
    };
    if bed == 0 {
        format!("{what} {slope_degrees:.2} degrees")
    } else {
        format!("{what} {slope_degrees:.2} degrees, bed {}", bed + 1)
    }
}

fn campaign(
    scene: &Scene,
    body: &InclineScene,
    directory: &RunDirectory,
    before: Angles,
    threads: usize,
) -> Result<Vec<String>, Failure> {
    let start = Instant::now();
    let stopped = || stopped(directory);
    let bar = Bar::new("settling the bed");
    let sharing = if threads > 1 {
        Threads::Rayon
    } else {
        Threads::Serial
    };
    let bed = incline::settle(&incline::bed(body), sharing, &bar)?.ok_or_else(stopped)?;
    bar.clear();
    directory.journal.note(&format!(
        "bed: {} grains over {} fixed, depth {:.4} m, solid fraction {:.4}",
        bed.report.grains, bed.report.base_grains, bed.report.depth, bed.report.solid_fraction
    ));
    let beds = more_beds(body)?.ok_or_else(stopped)?;
    let settling = bed.report.grain_steps + beds.grain_steps;
    let spec = campaign_spec(scene, body, &bed, beds);
    let observer = Observer {
        directory,
        bars: Bars::default(),
        shown: Mutex::default(),
        finished: Mutex::new(before.clone()),
        wall_before: before.wall_s,
        start,
        unwritten: Mutex::default(),
    };
    let result = run_campaign(
        &spec,
        &before.runs,
        &|event| observer.see(event),
        interruption::flag(),
    );
    if let Ok(Some(failure)) = observer.unwritten.into_inner() {
        return Err(failure);
    }
    let mut result = result.map_err(|error| match error {
        CampaignError::Stopped => stopped(),
        CampaignError::OutOfRange { .. } => Failure::Input(error.to_string()),
        CampaignError::Run(error) => incline::failure(error),
    })?;
    // Grain-steps count the angles of earlier parts, so their time counts too.
    let dem_wall = before.wall_s + start.elapsed().as_secs_f64();
    let mut warnings = Vec::new();
    match law_to_write(scene, body, &result) {
        Ok(file) => directory.write(RHEOLOGY, file.to_toml()?.as_bytes())?,
        Err(why) => {
            let sentence = format!("No {RHEOLOGY} was written: {why}.");
            result.verdict.good = false;
            result.verdict.text = format!("{sentence} {}", result.verdict.text);
            warnings.push(sentence);
        }
    }
    directory.journal.note(&result.verdict.text);
    let mut record = Campaign {
        result,
        comparisons: Vec::new(),
        gravity: body.gravity,
        diameter: body.grains.diameter,
    };
    // The grains' results first: the comparison must not put them at risk.
    write_record(directory, &record)?;
    let (comparisons, remarks) = comparison::compare(body, &record.result, directory)?;
    record.comparisons = comparisons;
    write_record(directory, &record)?;

    let mut summary = findings::summarise(scene, &record);
    summary.remarks.extend(remarks);
    summary.model = incline::model(body, &bed);
    let grain_steps = record.result.cost.grain_steps + settling;
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
    )?;
    Ok(warnings)
}

fn write_record(directory: &RunDirectory, record: &Campaign) -> Result<(), Failure> {
    let text = serde_json::to_vec(record).map_err(|error| Failure::Run(error.to_string()))?;
    directory.write(CAMPAIGN, &text)
}

/// The fitted law as a file, or why it cannot be one.
fn law_to_write(
    scene: &Scene,
    body: &InclineScene,
    result: &CampaignResult,
) -> Result<RheologyFile, String> {
    let Some(fit) = &result.fit else {
        return Err("no law could be fitted".into());
    };
    let numbers = [fit.mu_s, fit.mu_2, fit.i_0];
    let physical = numbers.iter().all(|x| x.is_finite())
        && fit.mu_s >= 0.0
        && fit.mu_2 > fit.mu_s
        && fit.i_0 > 0.0;
    if !physical {
        return Err(format!(
            "the fit is unphysical: mu_s = {:.4}, mu_2 = {:.4}, i_0 = {:.4}; allowed: 0 <= mu_s < mu_2, i_0 > 0",
            fit.mu_s, fit.mu_2, fit.i_0
        ));
    }
    let file = rheology_file(scene, body, result, fit);
    file.check()?;
    Ok(file)
}

fn rheology_file(
    scene: &Scene,
    body: &InclineScene,
    result: &CampaignResult,
    fit: &MuIFit,
) -> RheologyFile {
    // Runs at rest or drifting are left out of the fit.
    let mut flow_degrees: Vec<f64> = result.points.iter().map(|p| p.slope_degrees).collect();
    flow_degrees.sort_by(f64::total_cmp);
    flow_degrees.dedup();
    RheologyFile {
        mu_s: fit.mu_s,
        mu_s_error: Some(fit.mu_s_error),
        mu_2: fit.mu_2,
        mu_2_error: Some(fit.mu_2_error),
        i_0: fit.i_0,
        i_0_error: Some(fit.i_0_error),
        diameter: body.grains.diameter,
        solid_fraction: fit.solid_fraction,
        solid_fraction_error: fit.solid_fraction_error,
        solid_fraction_of_i: fit.solid_fraction_of_i,
        grain_density: Some(body.grains.density),
        valid_i: Some(fit.valid_i),
        table: friction_table(&result.points),
        identified: Some(fit.identified),
        good: Some(result.verdict.good),
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
            flow_degrees,
            seed: body.seed,
            friction: "|tau|/p, p = trace/3".into(),
            verdict: result.verdict.text.clone(),
        }),
    }
}
