//! Runs of real grains down a slope.

use colluvium_coupling::campaign::{
    Bracket, CampaignError, CampaignEvent, CampaignSpec, FlowsOfDepth, GuessedLaw, OtherBed,
    evaluate, run_campaign,
};
use colluvium_coupling::incline::{
    InclineError, InclineResult, InclineRun, InclineSpec, Outcome, Purpose, Start,
};
use colluvium_dem::preparation::{Bed, InclineBed, RadiusLaw, settle_incline_bed};
use colluvium_dem::{ContactLaw, Grain, Hooke, ShapeParameter, TangentialSpring, Threads};
use std::ops::ControlFlow;
use std::sync::Mutex;
use std::sync::OnceLock;
use std::sync::atomic::{AtomicBool, Ordering};

const DENSITY: f64 = 6.0 / std::f64::consts::PI;
const STEP: f64 = 6e-4;

/// Moderate friction of the thesis in units d = g = 1.
fn law() -> ContactLaw {
    ContactLaw::linear(
        Hooke::matched(2e4, 0.5),
        TangentialSpring::matched(2.0 / 7.0, 0.5, 1.0),
        Some(ShapeParameter {
            beta: 0.2,
            rolling_friction: 1.05,
            twisting_friction: 1.3,
        }),
    )
}

fn settle(grains: usize, length: f64, width: f64) -> Bed {
    let spec = InclineBed {
        grains,
        radius: RadiusLaw::Gaussian {
            mean: 0.5,
            relative_deviation: 0.1,
            cut: 1.0,
        },
        density: DENSITY,
        length,
        width,
        law: law(),
        gravity: 1.0,
        timestep: STEP,
        seed: 7,
    };
    settle_incline_bed(&spec, Threads::Serial, &mut |_| ControlFlow::Continue(()))
        .expect("the bed settles")
}

/// About nine layers in a small box.
fn small_bed() -> &'static Bed {
    static BED: OnceLock<Bed> = OnceLock::new();
    BED.get_or_init(|| settle(300, 6.0, 5.0))
}

fn spec(
    bed: &Bed,
    slope_degrees: f64,
    start: Start,
    purpose: Purpose,
    times: [f64; 3],
) -> InclineSpec {
    InclineSpec {
        slope: slope_degrees.to_radians(),
        gravity: 1.0,
        diameter: 1.0,
        grain_density: DENSITY,
        law: law(),
        domain: bed.domain,
        bed: bed.grains.clone(),
        start,
        purpose,
        timestep: STEP,
        relax_time: times[0],
        average_time: times[1],
        max_time: times[2],
        sample_every: 25,
        layer: 1.0,
        steady_tolerance: 0.05,
        threads: Threads::Serial,
    }
}

fn run(spec: InclineSpec) -> InclineResult {
    let mut run = InclineRun::new(spec).expect("the specification is sound");
    while !run.finished() {
        run.advance(1000).expect("the grains stay together");
    }
    run.finish()
}

/// Local friction and solid fraction of this material at 33° by LAMMPS 22 Jul 2025 (1700 grains in a box of
/// 12 × 6, same stiffness and step, layers from 6 to 22 d): I, |τ|/p, φ.
const LAMMPS: [[f64; 3]; 14] = [
    [0.313337, 0.653007, 0.497266],
    [0.293849, 0.657273, 0.498738],
    [0.270083, 0.657023, 0.507281],
    [0.250525, 0.646371, 0.505846],
    [0.235237, 0.629288, 0.513765],
    [0.235386, 0.641172, 0.508543],
    [0.234887, 0.638085, 0.507822],
    [0.227052, 0.647029, 0.506045],
    [0.211267, 0.636843, 0.510776],
    [0.211679, 0.626905, 0.510549],
    [0.225526, 0.628349, 0.506796],
    [0.234574, 0.640416, 0.509451],
    [0.225446, 0.630047, 0.51836],
    [0.236322, 0.62226, 0.513954],
];

#[test]
fn a_flow_carries_its_weight_and_has_the_friction_of_lammps() {
    let bed = settle(700, 8.0, 6.0);
    let start = Start::Flow {
        inertial_number: 0.26,
    };
    let result = run(spec(
        &bed,
        33.0,
        start,
        Purpose::Measure,
        [15.0, 25.0, 40.0],
    ));
    assert_ne!(result.outcome, Outcome::Rest);
    let checks = result.checks.unwrap();
    println!(
        "{checks:?} {:?} overlap {}",
        result.steady, result.largest_overlap
    );
    assert!(checks.mass_relative < 1e-10 && checks.mass_outside == 0.0);
    assert!(checks.weight_relative < 0.01, "{}", checks.weight_relative);
    assert!(checks.normal_relative < 0.01 && checks.downslope_relative < 0.02);
    assert!(result.points.len() >= 5, "{}", result.points.len());

    // At equal I: lines I → μ and I → φ through LAMMPS' layers.
    let line = |column: usize, i: f64| {
        let n = LAMMPS.len() as f64;
        let mean = |f: &dyn Fn(&[f64; 3]) -> f64| LAMMPS.iter().map(f).sum::<f64>() / n;
        let (x, y) = (mean(&|r| r[0]), mean(&|r| r[column]));
        let slope = mean(&|r| (r[0] - x) * (r[column] - y)) / mean(&|r| (r[0] - x).powi(2));
        y + slope * (i - x)
    };
    let (mut mu, mut phi, mut count) = (0.0, 0.0, 0.0);
    for p in result
        .points
        .iter()
        .filter(|p| (0.18..0.35).contains(&p.inertial_number))
    {
        println!(
            "z {} I {:.3} mu {:.4} ± {:.4} (LAMMPS {:.4}) phi {:.4} ({:.4})",
            p.z,
            p.inertial_number,
            p.friction,
            p.friction_error,
            line(1, p.inertial_number),
            p.solid_fraction,
            line(2, p.inertial_number)
        );
        mu += p.friction / line(1, p.inertial_number) - 1.0;
        phi += p.solid_fraction - line(2, p.inertial_number);
        count += 1.0;
    }
    assert!(count >= 3.0, "{:?}", result.points);
    println!(
        "mean deviation: mu {:+.2} %, phi {:+.4}",
        100.0 * mu / count,
        phi / count
    );
    assert!((mu / count).abs() < 0.03 && (phi / count).abs() < 0.01);
}

#[test]
fn steep_slopes_set_a_bed_in_motion_and_gentle_ones_do_not() {
    let times = [0.0, 0.0, 40.0];
    let gentle = run(spec(
        small_bed(),
        20.0,
        Start::Rest,
        Purpose::OnsetSearch,
        times,
    ));
    assert_eq!(gentle.outcome, Outcome::Rest);
    assert!(!gentle.flows() && gentle.profile.is_none());
    // Ended early, at rest.
    assert!(gentle.series.last().unwrap().time < 39.0);
    let steep = run(spec(
        small_bed(),
        42.0,
        Start::Rest,
        Purpose::OnsetSearch,
        times,
    ));
    assert_eq!(steep.outcome, Outcome::Accelerating);
    assert!(steep.flows() && steep.distance > 1.0);
    // A flow on a gentle slope stops.
    let flow = Start::Flow {
        inertial_number: 0.05,
    };
    let stopped = run(spec(
        small_bed(),
        20.0,
        flow,
        Purpose::StopSearch,
        [20.0, 0.0, 40.0],
    ));
    println!("stopped after {}", stopped.series.last().unwrap().time);
    assert_eq!(stopped.outcome, Outcome::Rest);
    assert!(stopped.distance > 0.1);
}

#[test]
fn a_restart_gives_the_same_bits() {
    let start = Start::Flow {
        inertial_number: 0.2,
    };
    let spec = spec(small_bed(), 32.0, start, Purpose::Measure, [1.0, 2.0, 3.0]);
    let whole = run(spec.clone());
    let mut first = InclineRun::new(spec.clone()).unwrap();
    first.advance(1703).unwrap();
    let record = first.checkpoint();
    drop(first);
    let mut second = InclineRun::resume(spec, &record).unwrap();
    while !second.finished() {
        second.advance(77).unwrap();
    }
    let second = second.finish();
    assert_eq!(whole.state_hash, second.state_hash);
    assert_eq!(whole.profile, second.profile);
    assert_eq!(whole.series, second.series);
}

#[test]
fn bad_numbers_are_named() {
    let good = spec(
        small_bed(),
        32.0,
        Start::Rest,
        Purpose::Measure,
        [1.0, 1.0, 3.0],
    );
    let message = |change: &dyn Fn(&mut InclineSpec)| {
        let mut bad = good.clone();
        change(&mut bad);
        let error = InclineRun::new(bad).expect_err("refused");
        assert!(matches!(
            error,
            InclineError::OutOfRange { .. } | InclineError::Setup(_)
        ));
        error.to_string()
    };
    assert!(message(&|s| s.slope = 2.0).contains("slope_degrees = 114.59"));
    assert!(message(&|s| s.layer = -1.0).contains("layer = -1"));
    assert!(message(&|s| s.layer = 1e-9).contains("layer"));
    // 0.6 s are 40 samples; a search takes no averages.
    assert!(message(&|s| s.average_time = 0.59).contains("average_time = 0.59"));
    let mut search = good.clone();
    (search.purpose, search.average_time) = (Purpose::StopSearch, 0.0);
    assert_eq!(search.validate(), Ok(()));
    assert!(message(&|s| s.max_time = 1.5).contains("max_time = 1.5"));
    assert!(message(&|s| s.bed.retain(|g| g.fixed)).contains("free grain"));
    assert!(
        message(&|s| s.start = Start::Flow {
            inertial_number: f64::NAN
        })
        .contains("inertial")
    );
    assert!(message(&|s| s.timestep = 0.0).contains("timestep"));
}

fn tiny_campaign() -> CampaignSpec {
    let base = spec(
        small_bed(),
        0.0,
        Start::Rest,
        Purpose::Measure,
        [2.0, 5.0, 7.0],
    );
    CampaignSpec {
        base,
        published_material: Some("moderate".into()),
        flow_angles_degrees: vec![37.0, 31.0, 33.0, 35.0],
        flows_of_depth: Vec::new(),
        guessed_law: GuessedLaw {
            mu_s: 0.45,
            mu_2: 0.95,
            i_0: 0.6,
        },
        searches: true,
        stop: Bracket {
            low: 20.0,
            high: 34.0,
            resolution: 7.0,
        },
        onset: Bracket {
            low: 20.0,
            high: 44.0,
            resolution: 12.0,
        },
        search_time: 20.0,
        search_inertial_number: 0.05,
        usable_drift: 10.0,
        other_beds: Vec::new(),
        flow_beds: 1,
        depths: Vec::new(),
        seed: 1,
    }
}

#[test]
fn a_campaign_does_not_depend_on_threads_and_goes_on_where_it_stopped() {
    let mut campaign = tiny_campaign();
    // One more flow, of the lower half of the bed.
    let grains = &campaign.base.bed;
    let highest = grains.iter().fold(0.0f64, |h, g| h.max(g.position.z));
    let low = |g: &&Grain| g.fixed || g.position.z < 0.5 * highest;
    let bed = OtherBed {
        domain: campaign.base.domain,
        grains: grains.iter().filter(low).cloned().collect(),
    };
    campaign.flows_of_depth = vec![FlowsOfDepth {
        bed,
        slopes_degrees: vec![33.0],
    }];
    let never = AtomicBool::new(false);
    let pool = |n| {
        rayon::ThreadPoolBuilder::new()
            .num_threads(n)
            .build()
            .unwrap()
    };
    let started = Mutex::new(0);
    let count = |e: CampaignEvent| {
        if matches!(e, CampaignEvent::Started { .. }) {
            *started.lock().unwrap() += 1;
        }
    };
    let mut two = pool(2)
        .install(|| run_campaign(&campaign, &[], &count, &never))
        .unwrap();
    println!(
        "{:#?} {:?} {:?}",
        two.verdict, two.stop_bracket_degrees, two.onset_bracket_degrees
    );
    let runs = two.runs.len();
    assert_eq!(*started.lock().unwrap(), runs);
    let (low, high) = two.stop_bracket_degrees.unwrap();
    assert!(low >= 19.9 && high <= 34.1 && high - low <= 7.1);
    let (low, high) = two.onset_bracket_degrees.unwrap();
    assert!(low >= 19.9 && high <= 44.1 && high - low <= 12.1);
    let angles: Vec<f64> = two.runs[..4]
        .iter()
        .map(|r| r.slope_degrees.round())
        .collect();
    assert_eq!(angles, [31.0, 33.0, 35.0, 37.0]);
    let (deep, shallow) = (&two.runs[1], &two.runs[4]);
    assert_eq!((deep.bed, shallow.bed, shallow.slope_degrees), (0, 1, 33.0));
    assert!(shallow.purpose == Purpose::Measure && shallow.height < 0.7 * deep.height);
    assert!(shallow.steady.mean < deep.steady.mean);
    assert!(two.verdict.text.contains("top, with Phi"));
    assert!(!two.points.is_empty() && two.estimators.len() == 6);
    // Averages this short may not determine a law; then the verdict says so.
    assert!(!two.verdict.good);
    assert_eq!(two.fit.is_none(), two.verdict.text.contains("No rheology"));

    // Go on from all but two results, on one thread: the rest is made anew, with the same bits.
    let stop_now = AtomicBool::new(true);
    let stopped = pool(1).install(|| run_campaign(&campaign, &two.runs[2..], &count, &stop_now));
    assert!(matches!(stopped, Err(CampaignError::Stopped)));
    *started.lock().unwrap() = 0;
    never.store(false, Ordering::Relaxed);
    let mut one = pool(1)
        .install(|| run_campaign(&campaign, &two.runs[2..], &count, &never))
        .unwrap();
    assert_eq!(*started.lock().unwrap(), 2);
    for result in [&mut one, &mut two] {
        result.cost.wall_s = 0.0;
        result.runs.iter_mut().for_each(|r| r.cost.wall_s = 0.0);
    }
    assert_eq!(one, two);

    the_rule_of_drifts_decides(&campaign, &one.runs);

    let mut bad = tiny_campaign();
    bad.stop.low = 40.0;
    let message = run_campaign(&bad, &[], &count, &never)
        .unwrap_err()
        .to_string();
    assert!(message.contains("stop.high - stop.low"), "{message}");
}

/// Which flows enter the fit, by the drift of finished runs and of the same runs with other drifts.
fn the_rule_of_drifts_decides(campaign: &CampaignSpec, runs: &[InclineResult]) {
    let flows: Vec<InclineResult> = runs[..4].to_vec();
    let strict = |limit: f64| CampaignSpec {
        usable_drift: limit,
        ..campaign.clone()
    };
    let reach = |r: &InclineResult| r.steady.drift.abs() + r.steady.drift_error;
    for flow in &flows {
        assert!(flow.steady.drift_known && flow.profile.is_some());
        assert!(strict(1.001 * reach(flow)).is_usable(flow));
        // The drift alone would pass.
        assert!(flow.steady.drift.abs() < 0.999 * reach(flow));
        assert!(!strict(0.999 * reach(flow)).is_usable(flow));
        let mut unknown = flow.clone();
        unknown.steady.drift_known = false;
        (unknown.steady.drift, unknown.steady.drift_error) = (0.0, 0.0);
        assert!(!strict(0.25).is_usable(&unknown));
    }
    // With a limit between the second and the third, two flows are left out of points, fit and estimators.
    let mut reaches: Vec<f64> = flows.iter().map(reach).collect();
    println!("drift and its error: {reaches:.3?}");
    reaches.sort_by(f64::total_cmp);
    let half = strict(0.5 * (reaches[1] + reaches[2]));
    let result = evaluate(&half, flows, Vec::new(), Vec::new(), Vec::new());
    let text = &result.verdict.text;
    assert!(text.contains("2 of 4 flows left out"), "{text}");
    let used = result.runs.iter().filter(|r| half.is_usable(r));
    assert_eq!(
        result.points.len(),
        used.map(|r| r.points.len()).sum::<usize>()
    );
    // Flows alone, none of which stopped.
    assert!(result.stop_bracket_degrees.is_none());
    for why in [
        "no bracket, because every bed flows, down to the lowest slope of 31.00°",
        "no bracket, because no slope was tried",
    ] {
        assert!(text.contains(why), "{text}");
    }
    assert!(!text.contains("overlap") || text.contains("at any step since the start"));
}

#[test]
fn a_grain_under_the_base_is_held_by_the_floor() {
    // Pressed through a gap of the base, it would fall for ever.
    let bed = small_bed();
    let mut spec = spec(
        bed,
        20.0,
        Start::Rest,
        Purpose::OnsetSearch,
        [1.0, 1.0, 6.0],
    );
    let lowest = bed.grains.iter().filter(|g| g.fixed);
    let floor = lowest.map(|g| g.position.z - g.radius).fold(0.0, f64::min);
    // A small one between the grains of the base, on its way down.
    let gap = |x: f64, y: f64| {
        let near = bed.grains.iter().filter(|g| g.fixed);
        let apart = near.map(|g| (g.position.x - x).hypot(g.position.y - y) - g.radius);
        apart.fold(f64::INFINITY, f64::min)
    };
    let spots =
        (0..60).flat_map(|i| (0..50).map(move |j| (0.1 * f64::from(i), 0.1 * f64::from(j))));
    let (x, y) = spots
        .max_by(|a, b| gap(a.0, a.1).total_cmp(&gap(b.0, b.1)))
        .unwrap();
    let mut lost = bed.grains.iter().find(|g| !g.fixed).copied().unwrap();
    lost.radius = 0.8 * gap(x, y).min(0.4);
    lost.position = nalgebra::Vector3::new(x, y, floor + 1.1 * lost.radius);
    lost.velocity = nalgebra::Vector3::new(0.0, 0.0, -1.0);
    spec.bed.push(lost);
    let mut run = InclineRun::new(spec).unwrap();
    run.advance(8000).unwrap();
    let mut snapshot = colluvium_dem::Snapshot::default();
    run.simulation().snapshot(&mut snapshot);
    let lowest = snapshot
        .grains
        .iter()
        .map(|g| g.position.z - g.radius)
        .fold(0.0, f64::min);
    assert!(lowest > floor - 0.1, "{lowest} {floor}");
}
