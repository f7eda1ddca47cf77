//! A calibration campaign: inclined-plane runs at several slopes, the slopes where flow stops and starts, and
//! the rheology fitted to them.

mod plan;
mod search;
mod verdict;

pub use plan::{Bracket, CampaignError, CampaignSpec, GuessedLaw};
pub use verdict::Verdict;

use crate::calibration::thesis::{EstimatorFit, VelocityProfile, estimator_fits};
use crate::calibration::{LocalPoint, MuIFit, Stress, fit_mu_i};
use crate::incline::{Cost, InclineResult, InclineRun, InclineSpec, Purpose, Start};
use rayon::prelude::*;
use search::{bracket, search};
use serde::{Deserialize, Serialize};
use std::sync::atomic::{AtomicBool, Ordering};

/// What a campaign tells its observer. Events of different runs come from different threads.
#[derive(Clone, Copy, Debug)]
pub enum CampaignEvent<'a> {
    /// A run begins.
    Started {
        /// Slope (degrees).
        slope_degrees: f64,
        /// What it is for.
        purpose: Purpose,
    },
    /// A run has come so far.
    Progress {
        /// Slope (degrees).
        slope_degrees: f64,
        /// What it is for.
        purpose: Purpose,
        /// From 0 to 1.
        fraction: f64,
    },
    /// A run is done: keep its result, and a campaign that is stopped can go on from there.
    Finished(&'a InclineResult),
}

/// Result of a campaign.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct CampaignResult {
    /// All runs: measured flows by rising slope, then the search for the stop, then for the onset.
    pub runs: Vec<InclineResult>,
    /// Lowest slope where a flow goes on, and the highest below it where one stops (degrees).
    pub stop_bracket_degrees: Option<(f64, f64)>,
    /// Lowest slope where a bed starts to flow, and the highest below it where one stays at rest (degrees).
    pub onset_bracket_degrees: Option<(f64, f64)>,
    /// All points that the fits use.
    pub points: Vec<LocalPoint>,
    /// μ = |τ|/p, p = trace/3: the rheology.
    pub fit: Option<MuIFit>,
    /// μ = |τ|/σ_zz.
    pub fit_zz: Option<MuIFit>,
    /// μ = tan θ.
    pub fit_slope: Option<MuIFit>,
    /// The thesis' estimators.
    pub estimators: Vec<EstimatorFit>,
    /// Good enough or not, and why.
    pub verdict: Verdict,
    /// Steps and time of all runs together (the time as if they ran one after the other).
    pub cost: Cost,
}

/// Steps between looks at the stop flag.
const STEPS_BETWEEN_LOOKS: u64 = 400;
/// Steps between progress events.
const STEPS_BETWEEN_EVENTS: u64 = 4000;

/// Who watches and who may stop.
struct Watch<'a> {
    events: &'a (dyn Fn(CampaignEvent) + Sync),
    stop: &'a AtomicBool,
    done: &'a [InclineResult],
}

/// Runs the campaign side by side on the current rayon pool; each run is serial, and results are collected in
/// order, so their bits depend on neither threads nor timing. Runs found in `done` (by slope, purpose and
/// start) are not run again.
///
/// # Errors
/// If a number is out of range, a run fails, or `stop` was set ([`CampaignError::Stopped`]).
pub fn run_campaign(
    spec: &CampaignSpec,
    done: &[InclineResult],
    events: &(dyn Fn(CampaignEvent) + Sync),
    stop: &AtomicBool,
) -> Result<CampaignResult, CampaignError> {
    spec.validate()?;
    let watch = Watch { events, stop, done };
    // The two searches are chains of runs, one after the other; the flows are single runs. Chains first, so
    // that the pool is not left waiting for one at the end.
    enum Task {
        Stop,
        Onset,
        Flow(f64),
    }
    let mut tasks = vec![Task::Stop, Task::Onset];
    tasks.extend(spec.sorted_flow_angles().into_iter().rev().map(Task::Flow));
    let finished: Vec<Result<Vec<InclineResult>, CampaignError>> = tasks
        .into_par_iter()
        .with_max_len(1)
        .map(|task| match task {
            Task::Flow(angle) => Ok(vec![watch.run(spec.flow_run(angle))?]),
            Task::Stop => search(&spec.stop, &|angle| watch.run(spec.stop_run(angle))),
            Task::Onset => search(&spec.onset, &|angle| watch.run(spec.onset_run(angle))),
        })
        .collect();
    let mut groups = Vec::new();
    for group in finished {
        groups.push(group?);
    }
    let mut groups = groups.into_iter();
    let stop_runs = groups.next().unwrap_or_default();
    let onset_runs = groups.next().unwrap_or_default();
    let flows: Vec<InclineResult> = groups.rev().flatten().collect();
    Ok(evaluate(spec, flows, stop_runs, onset_runs))
}

/// Fits and verdict from finished runs, without running anything.
pub fn evaluate(
    spec: &CampaignSpec,
    flows: Vec<InclineResult>,
    stop_runs: Vec<InclineResult>,
    onset_runs: Vec<InclineResult>,
) -> CampaignResult {
    let used: Vec<&InclineResult> = flows.iter().filter(|r| spec.is_usable(r)).collect();
    let points: Vec<LocalPoint> = used.iter().flat_map(|r| r.points.iter().copied()).collect();
    let profiles: Vec<VelocityProfile> = used
        .iter()
        .filter_map(|r| {
            let slope = r.slope_degrees.to_radians();
            let profile = r.profile.as_ref()?;
            Some(VelocityProfile::of(
                profile,
                slope,
                spec.base.gravity,
                spec.base.diameter,
            ))
        })
        .collect();
    let fits = [
        Stress::MeanPressure,
        Stress::NormalPressure,
        Stress::TangentOfSlope,
    ]
    .map(|stress| fit_mu_i(&points, stress));
    let estimators = estimator_fits(&profiles);
    // A flow that was to be measured and stopped, or went on, tells about the stop as well.
    let stop = bracket(stop_runs.iter().chain(&flows));
    let onset = bracket(onset_runs.iter());
    let mut cost = Cost::default();
    for run in flows.iter().chain(&stop_runs).chain(&onset_runs) {
        cost.steps += run.cost.steps;
        cost.grain_steps += run.cost.grain_steps;
        cost.wall_s += run.cost.wall_s;
    }
    let verdict = verdict::judge(&verdict::Evidence {
        spec,
        flows: &flows,
        used: used.len(),
        fit: &fits[0],
        fit_zz: &fits[1],
        estimators: &estimators,
        stop: &stop,
        onset: &onset,
    });
    let [fit, fit_zz, fit_slope] = fits.map(Result::ok);
    CampaignResult {
        runs: flows
            .into_iter()
            .chain(stop_runs)
            .chain(onset_runs)
            .collect(),
        stop_bracket_degrees: stop.ok(),
        onset_bracket_degrees: onset.ok(),
        points,
        fit,
        fit_zz,
        fit_slope,
        estimators,
        verdict,
        cost,
    }
}

impl Watch<'_> {
    fn run(&self, spec: InclineSpec) -> Result<InclineResult, CampaignError> {
        let slope_degrees = (spec.slope.to_degrees() * 1e9).round() / 1e9;
        let purpose = spec.purpose;
        let same_start = |s: &Start| match (s, &spec.start) {
            (Start::Rest, Start::Rest) => true,
            (Start::Flow { inertial_number: a }, Start::Flow { inertial_number: b }) => {
                (a - b).abs() <= 1e-9 * b.abs()
            }
            _ => false,
        };
        let known = self.done.iter().find(|r| {
            (r.slope_degrees - slope_degrees).abs() < 1e-9
                && r.purpose == purpose
                && same_start(&r.start)
        });
        if let Some(result) = known {
            return Ok(result.clone());
        }
        (self.events)(CampaignEvent::Started {
            slope_degrees,
            purpose,
        });
        let mut run = InclineRun::new(spec)?;
        let mut next_event = STEPS_BETWEEN_EVENTS;
        while !run.finished() {
            if self.stop.load(Ordering::Relaxed) {
                return Err(CampaignError::Stopped);
            }
            run.advance(STEPS_BETWEEN_LOOKS)?;
            if run.steps_done() >= next_event {
                next_event += STEPS_BETWEEN_EVENTS;
                let fraction = run.progress();
                (self.events)(CampaignEvent::Progress {
                    slope_degrees,
                    purpose,
                    fraction,
                });
            }
        }
        let result = run.finish();
        (self.events)(CampaignEvent::Finished(&result));
        Ok(result)
    }
}
