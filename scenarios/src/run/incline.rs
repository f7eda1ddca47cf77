//! Grains on an inclined plane: from the scene to profiles.

use super::impact::shape;
use super::step;
use super::{Findings, Under};
use crate::checkpoint::Checkpoint;
use crate::cost::Cost;
use crate::failure::Failure;
use crate::interruption;
use crate::progress::Bar;
use crate::scene::{InclineScene, InclineStart, SizeLaw};
use crate::summary::{Model, Quantity, Summary};
use crate::table::Table;
use colluvium_coupling::coarse_graining::{Estimate, Profile, ProfileRow};
use colluvium_coupling::incline::{
    InclineError, InclineResult, InclineRun, InclineSpec, Outcome, Purpose, SeriesPoint, Start,
};
use colluvium_dem::preparation::{
    Bed, InclineBed, RadiusLaw, settle_incline_bed, settle_incline_bed_from,
};
use colluvium_dem::timestep::{self, Choice, Conditions, Shares};
use colluvium_dem::{
    ContactLaw, Grain, Hooke, SetupError, Simulation, Snapshot, TangentialSpring, Threads,
};
use nalgebra::Vector3;
use std::ops::ControlFlow;

/// Steps between two looks at the clock.
pub(super) const STEPS_PER_LOOK: u64 = 500;

/// Name of the stage in a checkpoint.
pub(super) const STAGE: &str = "flow";

/// What the scene does not name and is not computed.
pub fn left_out(scene: &InclineScene) -> Vec<String> {
    let mut list: Vec<String> = [
        "cohesion",
        "bonds",
        "air",
        "side walls (periodic)",
        "breakage of grains",
    ]
    .map(String::from)
    .to_vec();
    if scene.contact.rolling.is_none() {
        list.push("rolling and twisting resistance".into());
    }
    list
}

/// The contact law of a scene.
pub fn law(scene: &InclineScene) -> ContactLaw {
    let contact = &scene.contact;
    ContactLaw::linear(
        Hooke::matched(scene.stiffness(), contact.restitution),
        TangentialSpring::matched(
            contact.stiffness_ratio,
            contact.tangential_restitution,
            contact.friction,
        ),
        shape(contact.rolling.as_ref()),
    )
}

/// The time step of a scene: that of two mean grains (Eq. 2.7) unless another limit of the smallest
/// needs a finer one.
pub fn step(scene: &InclineScene) -> Choice {
    let contact_time = timestep::step(scene.mean_mass(), scene.stiffness(), 1.0);
    let smallest = Grain::at_rest(
        Vector3::zeros(),
        scene.smallest_radius(),
        scene.grains.density,
    );
    // Grains of dense flows meet at no more than the speed of a fall through one diameter.
    let conditions = Conditions {
        speed: (2.0 * scene.gravity * scene.grains.diameter).sqrt(),
        ..Conditions::default()
    };
    let shares = Shares {
        steps_per_contact: scene.timestep.steps_per_contact,
        contact_time: Some(contact_time),
        safety: scene.timestep.safety,
        ..Shares::default()
    };
    step::choose(&law(scene), &[smallest], false, &conditions, &shares)
}

/// The bed that a scene asks for.
pub fn bed(scene: &InclineScene) -> InclineBed {
    let radius = 0.5 * scene.grains.diameter;
    let spread = scene.grains.spread;
    let [length, width] = scene.floor_edges();
    InclineBed {
        grains: scene.free_grains(),
        radius: match scene.grains.sizes {
            SizeLaw::Gaussian => RadiusLaw::Gaussian {
                mean: radius,
                relative_deviation: spread,
                cut: scene.grains.cut,
            },
            SizeLaw::Uniform => RadiusLaw::Uniform {
                low: radius * (1.0 - spread),
                high: radius * (1.0 + spread),
            },
        },
        density: scene.grains.density,
        length,
        width,
        law: law(scene),
        gravity: scene.gravity,
        timestep: step(scene).seconds,
        seed: scene.seed,
    }
}

/// Velocity at the start.
pub fn start(scene: &InclineScene) -> Start {
    match scene.start {
        InclineStart::Rest => Start::Rest,
        InclineStart::Flow => Start::Flow {
            inertial_number: scene.start_inertial_number,
        },
    }
}

/// The run that a scene asks for, on a settled bed.
pub fn spec(scene: &InclineScene, bed: &Bed, threads: Threads) -> InclineSpec {
    let timestep = step(scene).seconds;
    InclineSpec {
        slope: scene.slope_degrees.to_radians(),
        gravity: scene.gravity,
        diameter: scene.grains.diameter,
        grain_density: scene.grains.density,
        law: law(scene),
        domain: bed.domain,
        bed: bed.grains.clone(),
        start: start(scene),
        purpose: Purpose::Measure,
        timestep,
        relax_time: scene.time.relax,
        average_time: scene.time.average,
        max_time: scene.time.limit,
        sample_every: (scene.time.sample_every / timestep).round().max(1.0) as u64,
        layer: scene.time.layer_diameters * scene.grains.diameter,
        steady_tolerance: scene.time.steady_tolerance,
        threads,
    }
}

/// Stage of a checkpoint in which the bed settles.
const SETTLING: &str = "bed";

/// Lets a bed settle; gives nothing if the user stopped it.
pub fn settle(bed: &InclineBed, threads: Threads, bar: &Bar) -> Result<Option<Bed>, Failure> {
    bed_or_stopped(settle_incline_bed(bed, threads, &mut |share| {
        bar.set(share);
        if interruption::requested() {
            ControlFlow::Break(())
        } else {
            ControlFlow::Continue(())
        }
    }))
}

/// Lets the bed of a run settle, from where it was stopped if it was. For a run that goes on from a later state it settles anew:
/// the same seed gives the same bits.
pub fn settle_of_run(bed: &InclineBed, under: &mut Under, bar: &Bar) -> Result<Bed, Failure> {
    let settling = |saved: &Checkpoint| saved.stage == SETTLING;
    let flows = under.resumed.as_ref().is_some_and(|saved| !settling(saved));
    if under.resumed.is_none() {
        under.begin()?;
    }
    let state = under.resumed.take_if(|saved| settling(saved));
    let state = state.as_ref().map(|saved| &saved.record);
    if state.is_some() {
        under.directory.journal.note("the bed goes on settling");
    }
    let mut failure = None;
    let mut pass = |share, simulation: &mut Simulation| {
        bar.set(share);
        let passed = match (flows, interruption::requested()) {
            (true, true) => Err(under.interrupted()),
            (true, false) => Ok(()),
            (false, _) => under
                .begin()
                .and_then(|()| under.checkpoint(SETTLING, || simulation.checkpoint())),
        };
        match passed {
            Ok(()) => ControlFlow::Continue(()),
            Err(why) => {
                failure = Some(why);
                ControlFlow::Break(())
            }
        }
    };
    let made = settle_incline_bed_from(state, bed, under.threads_of_one_run(), &mut pass);
    match (bed_or_stopped(made)?, failure) {
        (Some(bed), _) => {
            bar.clear();
            under.directory.journal.note(&settled(&bed));
            Ok(bed)
        }
        (None, Some(why)) => Err(why),
        (None, None) => Err(under.interrupted()),
    }
}

fn bed_or_stopped(made: Result<Bed, SetupError>) -> Result<Option<Bed>, Failure> {
    match made {
        Ok(bed) => Ok(Some(bed)),
        Err(SetupError::Interrupted) => Ok(None),
        Err(SetupError::Record(why)) => Err(Failure::damaged(&why)),
        Err(SetupError::Diverged(error)) => Err(Failure::Run(error.to_string())),
        Err(error) => Err(Failure::Input(error.to_string())),
    }
}

/// How a bed has settled, in words.
fn settled(bed: &Bed) -> String {
    format!(
        "bed: {} grains over {} fixed, depth {:.4} m, solid fraction {:.4}, {:.2} contacts a grain",
        bed.report.grains,
        bed.report.base_grains,
        bed.report.depth,
        bed.report.solid_fraction,
        bed.report.coordination
    )
}

/// What an error of a run means for the process.
pub fn failure(error: InclineError) -> Failure {
    match error {
        InclineError::OutOfRange { .. } | InclineError::Setup(_) | InclineError::Record(_) => {
            Failure::Input(error.to_string())
        }
        error => Failure::Run(error.to_string()),
    }
}

pub(super) fn run(scene: &InclineScene, under: &mut Under) -> Result<Findings, Failure> {
    let threads = under.threads_of_one_run();
    let bed = settle_of_run(&bed(scene), under, &Bar::new("settling the bed"))?;
    let spec = spec(scene, &bed, threads);
    let mut run = match &under.resumed {
        Some(saved) => InclineRun::resume(spec.clone(), &saved.record),
        None => InclineRun::new(spec.clone()),
    }
    .map_err(failure)?;
    under.begin()?;
    if under.resumed.is_some() {
        // It has begun as it did.
    } else if let Some(rheology) = &scene.rheology {
        // As the other models of this scene begin.
        let free = bed.grains.iter().filter(|g| !g.fixed);
        let mass = free
            .map(|g| 4.0 / 3.0 * std::f64::consts::PI * g.radius.powi(3))
            .sum::<f64>()
            * scene.grains.density;
        run.start_as_layer(scene.continuum_depth(rheology), mass);
    }
    let bar = Bar::new(&format!(
        "{} at {} degrees",
        under.scene.name, scene.slope_degrees
    ));
    while !run.finished() {
        run.advance(STEPS_PER_LOOK).map_err(failure)?;
        bar.set(run.progress());
        if let Some(point) = run.series().last() {
            bar.say(&format!(
                "t = {:.2} s, {:.3} m/s",
                point.time, point.mean_velocity
            ));
        }
        under.checkpoint(STAGE, || run.checkpoint())?;
    }
    bar.clear();
    let energy = run.simulation().energy();
    let mut snapshot = Snapshot::default();
    run.simulation().snapshot(&mut snapshot);
    let momentum_error = run.simulation().momentum_error();
    let result = run.finish();
    let mut summary = Summary::begun(&under.scene.name, "run");
    summary.model = model(scene, &bed);
    let grain_steps = result.cost.grain_steps + bed.report.grain_steps;
    summary.cost = Cost::measured(under.wall_s(), under.threads, grain_steps, 0);
    for (name, value) in [
        ("translation_J", energy.translation),
        ("rotation_J", energy.rotation),
        ("elastic_J", energy.elastic()),
    ] {
        summary.ledger.energy.insert(name.into(), value);
    }
    describe(&mut summary, scene, &result, &bed);
    summary.ledger.momentum_relative = Some(momentum_error);
    let mut tables = vec![energy_table(&result.series)];
    if let Some(profile) = &result.profile {
        tables.push(profile_table("profile", profile));
        tables.push(stress_table(profile));
    }
    tables.push(points_table(std::slice::from_ref(&result)));
    Ok(Findings {
        summary,
        tables,
        grains: Some(super::grain_table::of(&snapshot)),
    })
}

/// What was modelled.
pub fn model(scene: &InclineScene, bed: &Bed) -> Model {
    let step = step(scene);
    Model {
        grains: bed.grains.len() as u64,
        cells: 0,
        dt_s: step.seconds,
        dt_limit: step::chosen(&step),
        left_out: left_out(scene),
    }
}

fn describe(summary: &mut Summary, scene: &InclineScene, result: &InclineResult, bed: &Bed) {
    let scale = scene.grains.diameter;
    summary.state_hash = result.state_hash.clone();
    if let Some(checks) = &result.checks {
        summary.ledger.mass_relative = checks.mass_relative;
        summary.put(
            "weight_error",
            Quantity::new(checks.weight_relative, "1").against(
                0.0,
                "σ_zz against the weight above, largest over the layers",
            ),
        );
        summary.put(
            "acceleration",
            Quantity::new(checks.acceleration, "m/s²").from("mean, downslope, while averaging"),
        );
    }
    summary.remarks.push(outcome_words(result));
    summary.put(
        "flows",
        Quantity::new(f64::from(u8::from(result.flows())), "1").from("1 = yes"),
    );
    summary.put("height", Quantity::new(result.height, "m"));
    summary.put(
        "grain_steps_settling",
        Quantity::new(bed.report.grain_steps as f64, "1").from("for the bed of grains"),
    );
    summary.put(
        "bed_solid_fraction",
        Quantity::new(bed.report.solid_fraction, "1").from("at rest"),
    );
    summary.put(
        "largest_overlap",
        Quantity::new(result.largest_overlap, "R").from("of the smaller grain's radius"),
    );
    summary.put(
        "mean_velocity",
        Quantity::new(result.steady.mean, "m/s")
            .with_error(result.steady.mean_error)
            .from("over the averaging time"),
    );
    summary.put(
        "height_diameters",
        Quantity::new(result.height / scale, "d"),
    );
    let points = &result.points;
    if points.is_empty() {
        return;
    }
    let n = points.len() as f64;
    let mut mean = |name: &str, value: &dyn Fn(usize) -> f64, error: &dyn Fn(usize) -> f64| {
        let average = (0..points.len()).map(value).sum::<f64>() / n;
        // Layers of one flow share their fluctuations: the mean is not better than one layer by √n.
        let spread = (0..points.len()).map(error).sum::<f64>() / n;
        summary.put(
            name,
            Quantity::new(average, "1")
                .with_error(spread)
                .from("mean over layers off the base and the surface"),
        );
    };
    mean("inertial_number", &|k| points[k].inertial_number, &|k| {
        points[k].inertial_number_error
    });
    mean("friction", &|k| points[k].friction, &|k| {
        points[k].friction_error
    });
    mean("friction_zz", &|k| points[k].friction_zz, &|k| {
        points[k].friction_zz_error
    });
    mean("solid_fraction", &|k| points[k].solid_fraction, &|k| {
        points[k].solid_fraction_error
    });
}

/// How a run ended, in words.
pub fn outcome_words(result: &InclineResult) -> String {
    let slope = result.slope_degrees;
    match result.outcome {
        Outcome::Rest => format!("At {slope} degrees the grains are at rest."),
        Outcome::Steady => format!("At {slope} degrees the flow is steady."),
        Outcome::Accelerating => format!("At {slope} degrees the flow still gains speed."),
        Outcome::Decelerating => format!("At {slope} degrees the flow still loses speed."),
        Outcome::Undecided => format!(
            "At {slope} degrees the grains move, and the run is too short to say whether steadily."
        ),
    }
}

/// Kinetic energy and mean velocity in time.
pub fn energy_table(series: &[SeriesPoint]) -> Table {
    let column = |f: fn(&SeriesPoint) -> f64| series.iter().map(f).collect();
    Table::new("energy")
        .with("t", "s", column(|p| p.time))
        .with("kinetic_energy", "J", column(|p| p.kinetic_energy))
        .with("mean_velocity", "m/s", column(|p| p.mean_velocity))
        .with("mean_height", "m", column(|p| p.mean_height))
}

/// Values and their standard errors.
type Pair = (Vec<f64>, Vec<f64>);

/// Averages through the depth, with their standard errors behind them.
pub fn profile_table(name: &str, profile: &Profile) -> Table {
    let rows = &profile.rows;
    let values = |f: &dyn Fn(&ProfileRow) -> Option<Estimate>| -> Pair {
        rows.iter()
            .map(|row| f(row).map_or((f64::NAN, f64::NAN), |e| (e.value, e.error)))
            .unzip()
    };
    let columns: [(&str, &str, Pair); 9] = [
        ("phi", "1", values(&|r| Some(r.phi))),
        ("u", "m/s", values(&|r| Some(r.u))),
        ("p", "Pa", values(&|r| Some(r.p))),
        ("sigma_zz", "Pa", values(&|r| Some(r.sigma_zz))),
        ("tau", "Pa", values(&|r| Some(r.tau))),
        ("i", "1", values(&|r| r.i)),
        ("mu", "1", values(&|r| r.mu)),
        ("mu_zz", "1", values(&|r| r.mu_zz)),
        ("temperature", "m²/s²", values(&|r| Some(r.temperature))),
    ];
    let mut table = Table::new(name).with("z", "m", rows.iter().map(|r| r.z).collect());
    for (name, unit, (value, _)) in &columns {
        table = table.with(name, unit, value.clone());
    }
    for (name, unit, (_, error)) in columns {
        table = table.with(&format!("{name}_error"), unit, error);
    }
    table
}

/// The full stress tensor through the depth, positive in tension.
fn stress_table(profile: &Profile) -> Table {
    let rows = &profile.rows;
    let mut table = Table::new("stress").with("z", "m", rows.iter().map(|r| r.z).collect());
    for (a, x) in ["x", "y", "z"].into_iter().enumerate() {
        for (b, y) in ["x", "y", "z"].into_iter().enumerate() {
            let values = rows.iter().map(|r| r.stress[a][b].value).collect();
            table = table.with(&format!("s_{x}{y}"), "Pa", values);
        }
    }
    table
}

/// Local points (I, μ, φ) of one or more runs.
pub fn points_table(results: &[InclineResult]) -> Table {
    let points: Vec<_> = results.iter().flat_map(|r| &r.points).collect();
    macro_rules! column {
        ($field:ident) => {
            points.iter().map(|p| p.$field).collect()
        };
    }
    Table::new("points")
        .with("slope_degrees", "degree", column!(slope_degrees))
        .with("z", "m", column!(z))
        .with("i", "1", column!(inertial_number))
        .with("i_error", "1", column!(inertial_number_error))
        .with("mu", "1", column!(friction))
        .with("mu_error", "1", column!(friction_error))
        .with("mu_zz", "1", column!(friction_zz))
        .with("mu_zz_error", "1", column!(friction_zz_error))
        .with("phi", "1", column!(solid_fraction))
        .with("phi_error", "1", column!(solid_fraction_error))
}
