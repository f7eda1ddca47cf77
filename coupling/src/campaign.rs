//! A calibration campaign: inclined-plane runs at several slopes, the slopes where flow stops and starts, and
//! the rheology fitted to them.

mod candidates;
mod causes;
mod design;
mod plan;
mod search;
mod threshold;
mod verdict;

pub use design::{
    Depths, Flow, Precision, Prospect, choose_flows, choose_slopes, cost, prospect,
    prospect_of_flows,
};
pub use plan::{Bracket, CampaignError, CampaignSpec, FlowsOfDepth, GuessedLaw, OtherBed};
pub use threshold::{NonLocal, Threshold, Trial, non_local_length, threshold};
pub use verdict::Verdict;

use crate::calibration::thesis::{EstimatorFit, VelocityProfile, estimator_fits};
use crate::calibration::{
    Alternative, BulkFlow, FluidityFit, FreeForm, JointComparison, LeftOut, LocalPoint, MuIFit,
    Posterior, ResidualTests, Stress, compare_joint_laws, compare_laws, fit_free_form, fit_mu_i,
    left_out, pressure_ratio, residual_tests, sample_posterior,
};
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
        /// Which bed; 0 for the first.
        bed: u64,
    },
    /// A run has come so far.
    Progress {
        /// Slope (degrees).
        slope_degrees: f64,
        /// What it is for.
        purpose: Purpose,
        /// Which bed; 0 for the first.
        bed: u64,
        /// From 0 to 1.
        fraction: f64,
    },
    /// A run is done: keep its result, and a campaign that is stopped can go on from there.
    Finished(&'a InclineResult),
}

/// Result of a campaign.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct CampaignResult {
    /// All runs: measured flows by rising slope, then those of other depths, then the search for the stop, then for the onset, then those of other
    /// depths for the stop.
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
    /// The slope where half of the beds stop, with its error.
    #[serde(default)]
    pub stop: Option<Threshold>,
    /// The slope where half of the beds set off.
    #[serde(default)]
    pub onset: Option<Threshold>,
    /// Where layers stop, by thickness, the full one last: h_stop(θ).
    #[serde(default)]
    pub stop_curve: Vec<Threshold>,
    /// The non-local length that this curve gives.
    #[serde(default)]
    pub non_local: Option<NonLocal>,
    /// Is what the fit leaves noise?
    #[serde(default)]
    pub residuals: Option<ResidualTests>,
    /// Competing laws of |τ|/p, the best supported first.
    #[serde(default)]
    pub alternatives: Vec<Alternative>,
    /// Laws of |τ|/p and φ together: one φ, φ(I), φ(I) and dilatancy.
    #[serde(default)]
    pub joint: Option<JointComparison>,
    /// Non-local fluidity against the local law, on the profiles through the depth.
    #[serde(default)]
    pub fluidity: Option<FluidityFit>,
    /// A table of |τ|/p that only rises and bends downwards.
    #[serde(default)]
    pub free_form: Option<FreeForm>,
    /// Samples of the posterior of the fit of |τ|/p.
    #[serde(default)]
    pub posterior: Option<Posterior>,
    /// The same of |τ|/σ_zz.
    #[serde(default)]
    pub posterior_zz: Option<Posterior>,
    /// p/σ_zz of the points: mean and standard deviation.
    #[serde(default)]
    pub pressure_ratio: Option<(f64, f64)>,
    /// Each flow beside the laws of |τ|/p and then of |τ|/σ_zz that were fitted without it.
    #[serde(default)]
    pub left_out: Vec<LeftOut>,
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
/// order, so their bits depend on neither threads nor timing. Runs found in `done` (by slope, purpose, bed
/// and start) are not run again.
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
        Depth(usize),
        Flow(f64, usize),
    }
    let mut tasks = Vec::new();
    if spec.searches {
        tasks.extend([Task::Stop, Task::Onset]);
        tasks.extend(spec.depth_beds().map(Task::Depth));
    }
    let searches = tasks.len();
    let elsewhere = spec.flows_elsewhere().into_iter().rev();
    tasks.extend(elsewhere.map(|(angle, bed)| Task::Flow(angle, bed)));
    let angles = spec.sorted_flow_angles().into_iter().rev();
    let flow_beds = spec.full_beds().take(spec.flow_beds.max(1)).rev();
    tasks.extend(angles.flat_map(|angle| flow_beds.clone().map(move |bed| Task::Flow(angle, bed))));
    let all_beds = |make: &(dyn Fn(usize) -> InclineSpec + Sync)| {
        let runs = spec.full_beds().into_par_iter().with_max_len(1);
        runs.map(|bed| watch.run(make(bed), bed)).collect()
    };
    let finished: Vec<Result<Vec<InclineResult>, CampaignError>> = tasks
        .into_par_iter()
        .with_max_len(1)
        .map(|task| match task {
            Task::Flow(angle, bed) => Ok(vec![watch.run(spec.flow_run(angle, bed), bed)?]),
            Task::Stop => search(&spec.stop, &|angle| {
                all_beds(&|bed| spec.stop_run(angle, bed))
            }),
            Task::Onset => search(&spec.onset, &|angle| {
                all_beds(&|bed| spec.onset_run(angle, bed))
            }),
            Task::Depth(bed) => search(&spec.stop, &|angle| {
                Ok(vec![watch.run(spec.stop_run(angle, bed), bed)?])
            }),
        })
        .collect();
    let mut groups = Vec::new();
    for group in finished {
        groups.push(group?);
    }
    let flows: Vec<InclineResult> = groups
        .split_off(searches)
        .into_iter()
        .rev()
        .flatten()
        .collect();
    let mut groups = groups.into_iter();
    let stop_runs = groups.next().unwrap_or_default();
    let onset_runs = groups.next().unwrap_or_default();
    let depth_runs: Vec<Vec<InclineResult>> = groups.collect();
    Ok(evaluate(spec, flows, stop_runs, onset_runs, depth_runs))
}

/// Fits and verdict from finished runs, without running anything; `depth_runs` are the searches of the other depths.
pub fn evaluate(
    spec: &CampaignSpec,
    flows: Vec<InclineResult>,
    stop_runs: Vec<InclineResult>,
    onset_runs: Vec<InclineResult>,
    depth_runs: Vec<Vec<InclineResult>>,
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
    let full = |r: &&InclineResult| spec.full_beds().contains(&(r.bed as usize));
    let stop = bracket(stop_runs.iter().chain(flows.iter().filter(full)));
    let onset = bracket(onset_runs.iter());
    // Where half of the beds stop: by all runs of that depth that started from flow.
    let outcome = |r: &InclineResult| (r.slope_degrees, r.flows());
    let full_stops: Vec<(f64, bool)> = stop_runs
        .iter()
        .chain(flows.iter().filter(full))
        .map(outcome)
        .collect();
    let height = spec.base.bed_height();
    let stop_threshold = threshold(&full_stops, height);
    let onset_threshold = threshold(&onset_runs.iter().map(outcome).collect::<Vec<_>>(), height);
    let mut stop_curve: Vec<Threshold> = depth_runs
        .iter()
        .filter_map(|runs| {
            // A bed that stopped has its height at rest; one that never did, that of its flow.
            let own = runs.iter().map(|r| r.height).fold(f64::INFINITY, f64::min);
            threshold(&runs.iter().map(outcome).collect::<Vec<_>>(), own)
        })
        .collect();
    stop_curve.extend(stop_threshold.clone());
    stop_curve.sort_by(|a, b| a.height.total_cmp(&b.height));
    let non_local = non_local_length(&stop_curve, spec.base.diameter);
    let mean_pressure = Stress::MeanPressure;
    let fit_p = fits[0].as_ref().ok();
    let residuals = fit_p.and_then(|fit| residual_tests(&points, fit));
    let posterior = fit_p.and_then(|fit| sample_posterior(&points, fit, spec.seed));
    let fit_zz = fits[1].as_ref().ok();
    let posterior_zz = fit_zz.and_then(|fit| sample_posterior(&points, fit, spec.seed));
    let alternatives = compare_laws(&points, mean_pressure).unwrap_or_default();
    let joint = compare_joint_laws(&points, mean_pressure).ok();
    let knots = (points.len() / 8).clamp(4, 12);
    let free_form = fit_free_form(&points, mean_pressure, knots, true).ok();
    let mut cost = Cost::default();
    let shallow = depth_runs.iter().flatten();
    for run in flows
        .iter()
        .chain(&stop_runs)
        .chain(&onset_runs)
        .chain(shallow)
    {
        cost.steps += run.cost.steps;
        cost.grain_steps += run.cost.grain_steps;
        cost.wall_s += run.cost.wall_s;
    }
    let bulks: Vec<BulkFlow> = used.iter().filter_map(|r| bulk(spec, r)).collect();
    let left_out: Vec<LeftOut> = [Stress::MeanPressure, Stress::NormalPressure]
        .iter()
        .flat_map(|stress| left_out(&bulks, *stress, spec.seed))
        .collect();
    let fluidity = fit_p.and_then(|fit| candidates::fluidity(&spec.base, &used, &bulks, fit));
    let verdict = verdict::judge(&verdict::Evidence {
        spec,
        flows: &flows,
        used: used.len(),
        fit: &fits[0],
        fit_zz: &fits[1],
        estimators: &estimators,
        stop: &stop,
        onset: &onset,
        thresholds: [&stop_threshold, &onset_threshold],
        non_local: &non_local,
        residuals: &residuals,
        alternatives: &alternatives,
        joint: &joint,
        posterior: &posterior,
        points: &points,
        candidates: candidates::Candidates {
            fluidity: &fluidity,
            non_local: &non_local,
            used: &used,
            fit: fit_p,
            left_out: &left_out,
        },
    });
    let pressure_ratio = pressure_ratio(&points);
    let [fit, fit_zz, fit_slope] = fits.map(Result::ok);
    CampaignResult {
        runs: flows
            .into_iter()
            .chain(stop_runs)
            .chain(onset_runs)
            .chain(depth_runs.into_iter().flatten())
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
        stop: stop_threshold,
        onset: onset_threshold,
        stop_curve,
        non_local,
        residuals,
        alternatives,
        joint,
        fluidity,
        free_form,
        posterior,
        posterior_zz,
        pressure_ratio,
        left_out,
    }
}

/// The bulk of a flow, as a law is to predict it.
pub fn bulk(spec: &CampaignSpec, run: &InclineResult) -> Option<BulkFlow> {
    let base = &spec.base;
    BulkFlow::of(
        run.profile.as_ref()?,
        &run.points,
        base.diameter,
        base.grain_density,
    )
}

impl Watch<'_> {
    fn run(&self, spec: InclineSpec, bed: usize) -> Result<InclineResult, CampaignError> {
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
                && r.bed == bed as u64
                && same_start(&r.start)
        });
        if let Some(result) = known {
            return Ok(result.clone());
        }
        (self.events)(CampaignEvent::Started {
            slope_degrees,
            purpose,
            bed: bed as u64,
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
                    bed: bed as u64,
                    fraction,
                });
            }
        }
        let mut result = run.finish();
        result.bed = bed as u64;
        (self.events)(CampaignEvent::Finished(&result));
        Ok(result)
    }
}
