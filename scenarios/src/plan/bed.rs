//! Plans of the scenes of a bed: `chute` and `settle`.

use super::{Lines, law};
use crate::failure::Failure;
use crate::run;
use crate::run::bed::Bed;
use crate::run::step;
use crate::scene::{ChuteScene, SettleScene};
use colluvium_dem::{Simulation, Threads};
use std::time::Instant;

/// Grain-steps of the probe that the rate is measured by.
const PROBE: u64 = 1_500_000;

/// The plan of a chute.
pub fn chute(body: &ChuteScene) -> Result<String, Failure> {
    let mut lines = Lines::default();
    let bed = run::chute::prepare(body, Threads::Serial)?;
    lines.say(
        "scene",
        &format!(
            "chute: grains on a rough periodic chute at {} degrees, start from {}",
            body.slope_degrees,
            body.start.as_deref().unwrap_or("the bundled bed")
        ),
    );
    let [length, width] = body.edges();
    let free = bed.free();
    lines.say(
        "grains",
        &format!(
            "{free} free over {} frozen, floor {length} m x {width} m periodic, {} x {} copies of the start",
            bed.setup.grains.len() - free,
            body.copies(),
            body.copies()
        ),
    );
    if body.coarse_graining > 1.0 {
        lines.say(
            "parcels",
            &format!(
                "{} times the grains' size: the start enlarged about the tops of its base and cut to the same box and mass",
                body.coarse_graining
            ),
        );
    }
    rest(
        &mut lines,
        bed,
        body.coarse_graining,
        &run::chute::left_out(body),
    )?;
    Ok(lines.0)
}

/// The plan of settling.
pub fn settle(body: &SettleScene) -> Result<String, Failure> {
    let mut lines = Lines::default();
    let bed = run::settle::prepare(body, Threads::Serial)?;
    let start = match &body.start {
        Some(path) => format!("start from {path}"),
        None => format!("drawn loose from the seed {}", body.seed),
    };
    lines.say(
        "scene",
        &format!("settle: grains fall into a box with walls, {start}"),
    );
    let [length, width] = body.edges();
    lines.say(
        "grains",
        &format!(
            "{}, floor {length} m x {width} m between four walls of the same material",
            bed.setup.grains.len()
        ),
    );
    if body.coarse_graining > 1.0 {
        lines.say(
            "parcels",
            &format!(
                "{} times the grains' size, drawn from the seed with the grains' mass",
                body.coarse_graining
            ),
        );
    }
    rest(
        &mut lines,
        bed,
        body.coarse_graining,
        &run::settle::left_out(body),
    )?;
    Ok(lines.0)
}

fn rest(
    lines: &mut Lines,
    bed: Bed,
    coarse_graining: f64,
    left_out: &[String],
) -> Result<(), Failure> {
    law::say(lines, &bed.law);
    if coarse_graining > 1.0 {
        lines.say(
            "scaling",
            "law of the parcels: forces as the square of their size at a scaled overlap, so that stress, velocity and solid fraction stay (Kappel et al. 2020, §2.5); cost falls as the fourth power",
        );
    }
    lines.say("left out", &left_out.join(", "));
    let pace = bed.pace;
    lines.say(
        "overlap",
        &format!(
            "about {:.2} % of the radius in an impact at {:.3} m/s, the fastest to be expected",
            100.0 * bed.struck(),
            bed.speed
        ),
    );
    let choice = bed
        .allowed_step()
        .map_err(|error| Failure::Input(error.to_string()))?;
    lines.say_step(pace.timestep, &step::given(pace.timestep, &choice), &choice);
    let grains = bed.setup.grains.len() as u64;
    let work = pace.steps * grains;
    lines.say(
        "steps",
        &format!(
            "{}, {:.4e} s; a row of energy.csv every {}",
            pace.steps,
            pace.steps as f64 * pace.timestep,
            pace.record_every
        ),
    );
    let rate = measured_rate(bed, grains)?;
    lines.say(
        "rate",
        &format!("{rate:.3e} grain-steps/s on one thread, measured now on the first steps"),
    );
    lines.say(
        "cost",
        &format!(
            "{:.3e} grain-steps: {:.0} s on one thread",
            work as f64,
            work as f64 / rate
        ),
    );
    Ok(())
}

/// Grain-steps per second of the first steps.
fn measured_rate(bed: Bed, grains: u64) -> Result<f64, Failure> {
    let steps = (PROBE / grains.max(1)).clamp(1, bed.pace.steps.max(1));
    let failed = |error: String| Failure::Run(error);
    let mut simulation = Simulation::new(bed.setup).map_err(|e| failed(e.to_string()))?;
    if bed.ledger {
        simulation.open_energy_ledger();
    }
    let start = Instant::now();
    simulation
        .advance(steps)
        .map_err(|e| failed(e.to_string()))?;
    Ok((steps * grains) as f64 / start.elapsed().as_secs_f64().max(1e-9))
}
