//! Processor time and error of joined flows beside flows of grains alone, by depth: one Markdown table.
//!
//! `cargo run --release -p colluvium-benchmarks --bin hybrid-cost -- 26 60 100`
//!
//! Spheres on 8 × 6 d at 24°, started with the profile of their law; grains reach to 16 d in the joined run, and those
//! above are never made. Both runs go on in turns, on one thread. Errors are relative, root mean square through zones:
//! grains from 4 d to the handshake surface, and from there (continuum) to 3 d below the surface. One run's velocity
//! scatters by 2–3 %.

use std::error::Error;
use std::ops::ControlFlow;

use colluvium_benchmarks::peers::machine::processor_time;
use colluvium_continuum::rheology::MuI;
use colluvium_coupling::coarse_graining::ProfileRow;
use colluvium_coupling::incline::{InclineRun, InclineSpec, Purpose, Start};
use colluvium_coupling::overlap::OverlapSettings;
use colluvium_coupling::overlap::joined_incline::{
    ContinuumRow, JoinedInclineRun, JoinedInclineSpec,
};
use colluvium_dem::preparation::{InclineBed, RadiusLaw, settle_incline_bed};
use colluvium_dem::{ContactLaw, Hooke, TangentialSpring, Threads};

type Outcome<T> = Result<T, Box<dyn Error>>;

const STIFFNESS: f64 = 5000.0;
const STEP: f64 = 2e-3;
const DENSITY: f64 = 6.0 / std::f64::consts::PI;
const SLOPE_DEGREES: f64 = 24.0;
const FLOOR: [f64; 2] = [8.0, 6.0];
/// Where grains end in the joined run.
const EDGE: f64 = 16.0;
/// Time before averages begin, and over which they are taken.
const WINDOW: [f64; 2] = [50.0, 40.0];
/// Steps of one run before the other has its turn.
const TURN: u64 = 500;

/// Fitted to flows of these grains at 24° and 26°.
fn rheology() -> MuI {
    MuI::new(0.309, 0.701, 0.3, 1.0, 0.5655, DENSITY)
}

/// A flow of grains on a bed of so many.
fn flow(grains: usize, seed: u64) -> Outcome<(InclineSpec, u64)> {
    let law = ContactLaw::linear(
        Hooke::matched(STIFFNESS, 0.6),
        TangentialSpring::matched(2.0 / 7.0, 0.6, 0.5),
        None,
    );
    let bed = InclineBed {
        grains,
        radius: RadiusLaw::Uniform {
            low: 0.45,
            high: 0.55,
        },
        density: DENSITY,
        length: FLOOR[0],
        width: FLOOR[1],
        law,
        gravity: 1.0,
        timestep: STEP,
        seed,
    };
    let bed = settle_incline_bed(&bed, Threads::Serial, &mut |_| ControlFlow::Continue(()))?;
    let slope = SLOPE_DEGREES.to_radians();
    let spec = InclineSpec {
        slope,
        gravity: 1.0,
        diameter: 1.0,
        grain_density: DENSITY,
        law,
        domain: bed.domain,
        bed: bed.grains,
        start: Start::Flow {
            inertial_number: rheology().inertial_number_at(slope.tan()),
        },
        purpose: Purpose::Measure,
        timestep: STEP,
        relax_time: WINDOW[0],
        average_time: WINDOW[1],
        max_time: WINDOW[0] + WINDOW[1],
        sample_every: 100,
        layer: 1.0,
        steady_tolerance: 0.05,
        threads: Threads::Serial,
    };
    Ok((spec, bed.report.grain_steps))
}

/// Mass of a grain of this size law on average: ⟨(1 + x)³⟩ with x uniform within ±0.1.
const MEAN_MASS: f64 = 1.01;

fn spent(since: &mut f64) -> Outcome<f64> {
    let now = processor_time().ok_or("no processor time on this system")?;
    let part = now - *since;
    *since = now;
    Ok(part)
}

/// Relative L2 error of a value against rows of grains between two heights, signed by its mean.
fn error(
    rows: &[ProfileRow],
    right: fn(&ProfileRow) -> f64,
    ours: &dyn Fn(f64) -> Option<f64>,
    [low, high]: [f64; 2],
) -> f64 {
    let mut sums = [0.0; 3];
    for row in rows.iter().filter(|r| r.z > low && r.z < high) {
        let Some(value) = ours(row.z) else { continue };
        let miss = value - right(row);
        let parts = [miss * miss, miss, right(row).powi(2)];
        sums.iter_mut().zip(parts).for_each(|(s, p)| *s += p);
    }
    (sums[0] / sums[2]).sqrt().copysign(sums[1])
}

fn of_grains(rows: &[ProfileRow], value: fn(&ProfileRow) -> f64) -> impl Fn(f64) -> Option<f64> {
    move |z| rows.iter().find(|r| (r.z - z).abs() < 1e-9).map(value)
}

fn of_continuum(
    rows: &[ContinuumRow],
    value: fn(&ContinuumRow) -> f64,
) -> impl Fn(f64) -> Option<f64> {
    move |z| {
        let after = rows.iter().position(|r| r.z >= z)?.max(1);
        let (a, b) = (&rows[after - 1], &rows[after]);
        Some(value(a) + (z - a.z) / (b.z - a.z) * (value(b) - value(a)))
    }
}

/// One depth (in diameters): a row of the table.
fn compare(depth: f64, seed: u64) -> Outcome<String> {
    let area = FLOOR[0] * FLOOR[1];
    let mass = depth * area * rheology().bulk_density();
    let all = (mass / MEAN_MASS).round() as usize;
    let lower = ((EDGE + 2.5) * area * rheology().bulk_density() / MEAN_MASS).ceil() as usize;
    let mut clock = processor_time().ok_or("no processor time on this system")?;
    let (spec, full_settling) = flow(all, seed)?;
    let mut full = InclineRun::new(spec)?;
    full.start_as_layer(depth, all as f64 * MEAN_MASS);
    let settling = spent(&mut clock)?;
    let (incline, joined_settling) = flow(lower.min(all), seed)?;
    let mut joined = JoinedInclineRun::new(JoinedInclineSpec {
        incline,
        height: EDGE,
        from: 0.0,
        mass: Some(all as f64 * MEAN_MASS),
        rheology: rheology(),
        stiffness: STIFFNESS,
        settings: OverlapSettings::default(),
    })?;
    let settling = [settling, spent(&mut clock)?];
    let mut times = [0.0; 2];
    while !(full.finished() && joined.finished()) {
        full.advance(TURN)?;
        times[0] += spent(&mut clock)?;
        joined.advance(TURN)?;
        times[1] += spent(&mut clock)?;
    }
    let (full, joined) = (full.finish(), joined.finish().ok_or("nothing was joined")?);
    let profile = full.profile.as_ref().ok_or("the grains came to rest")?;
    let (rows, grains) = (&profile.rows, &joined.profile.rows);
    let [_, handshake, _, _] = joined.heights;
    let below = [4.0, handshake];
    let above = [handshake, full.height - 3.0];
    let errors = [
        error(
            rows,
            |r| r.u.value,
            &of_grains(grains, |r| r.u.value),
            below,
        ),
        error(
            rows,
            |r| r.u.value,
            &of_continuum(&joined.continuum, |r| r.u),
            above,
        ),
        error(
            rows,
            |r| r.sigma_zz.value,
            &of_grains(grains, |r| r.sigma_zz.value),
            below,
        ),
        error(
            rows,
            |r| r.tau.value,
            &of_grains(grains, |r| r.tau.value),
            below,
        ),
        error(
            rows,
            |r| r.phi.value,
            &of_grains(grains, |r| r.phi.value),
            below,
        ),
    ];
    let percent: Vec<String> = errors
        .iter()
        .map(|e| format!("{:+.1}", 100.0 * e))
        .collect();
    let steps = [full.cost.grain_steps, joined.work_done[0]];
    let report = &joined.report;
    let drift = {
        let at = |t: f64| {
            full.series
                .iter()
                .find(|p| p.time >= t)
                .map_or(f64::NAN, |p| p.mean_velocity)
        };
        at(WINDOW[0] + WINDOW[1] - 1.0) / at(1.0) - 1.0
    };
    Ok(format!(
        "| {depth} | {seed} | {all} | {:.3} | {:.3} | {:.3} | {} | {:+.1} | {:+.2}, {:.3}, {:.3} |",
        steps[1] as f64 / steps[0] as f64,
        times[1] / times[0],
        (settling[1] + times[1]) / (settling[0] + times[0]),
        percent.join(" | "),
        100.0 * drift,
        100.0 * report.slip,
        report.shear_ratio.unwrap_or(f64::NAN),
        report.pressure_ratio.unwrap_or(f64::NAN),
    ) + &format!(
        " <!-- CPU s: full {:.2}, joined {:.2}, settling {:.2}, {:.2}; settling grain-steps {full_settling}, {joined_settling} -->",
        times[0], times[1], settling[0], settling[1]
    ))
}

fn main() -> Outcome<()> {
    let arguments: Vec<f64> = std::env::args()
        .skip(1)
        .map(|a| a.parse())
        .collect::<Result<_, _>>()?;
    let depths = if arguments.is_empty() {
        vec![26.0, 60.0]
    } else {
        arguments
    };
    println!(
        "| depth [d] | seed | grains | grain-steps | CPU of the flow | CPU with settling | u below m [%] | u above m | σ_zz below | τ below | φ below | change of ⟨u⟩ since the start | slip [%], τ and p ratio at m |"
    );
    println!("|---|---|---|---|---|---|---|---|---|---|---|---|---|");
    for depth in depths {
        println!("{}", compare(depth, 7)?);
    }
    Ok(())
}
