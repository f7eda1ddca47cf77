//! The plan of an incline with a continuum.

use super::{Lines, measured_rate};
use crate::failure::Failure;
use crate::run;
use crate::run::{continuum_incline, joined_incline, step};
use crate::scene::{InclineModel, InclineScene, OverlapKeys, RheologyKeys, Scene};
use colluvium_coupling::overlap::{NormalMotion, Resolved, StressKernel};

pub(super) fn plan(
    scene: &Scene,
    body: &InclineScene,
    keys: (&RheologyKeys, &OverlapKeys),
) -> Result<String, Failure> {
    let mut lines = Lines::default();
    let what = match body.model {
        InclineModel::Hybrid => "grains below and continuum above",
        _ => "a layer of μ(I) material",
    };
    lines.say(
        "scene",
        &format!(
            "{}: {what} on a rough plane at {} degrees",
            scene.name, body.slope_degrees
        ),
    );
    lines.say_rheology(keys.0);
    for remark in keys.0.remarks() {
        lines.say("warning", &remark);
    }
    flow(&mut lines, body, keys.0);
    let settings = joined_incline::resolved(scene, body)?;
    match body.model {
        InclineModel::Hybrid => hybrid(&mut lines, body, keys, &settings),
        _ => continuum(&mut lines, scene, body)?,
    }
    Ok(lines.0)
}

/// The steady flow that the law gives at this slope.
fn flow(lines: &mut Lines, body: &InclineScene, law: &RheologyKeys) {
    let slope = body.slope_degrees.to_radians();
    let mu_i = law.mu_i();
    let text = if slope.tan() <= mu_i.mu_s {
        "none: friction holds the layer".into()
    } else if slope.tan() >= mu_i.mu_2 {
        "none that is steady: the slope is steeper than mu_2".into()
    } else {
        let number = mu_i.inertial_number_at(slope.tan());
        let out = law.valid_i.as_deref().is_some_and(|valid| match valid {
            [low, high] => number < *low || number > *high,
            _ => false,
        });
        format!(
            "I = {number:.4} throughout the continuum once it is steady{}; both begin with {}",
            if out {
                ", OUTSIDE what the law was measured for"
            } else {
                ""
            },
            body.start_inertial_number
        )
    };
    lines.say("flow", &text);
}

fn continuum(lines: &mut Lines, scene: &Scene, body: &InclineScene) -> Result<(), Failure> {
    let grid = continuum_incline::grid(scene, body)?;
    lines.say(
        "grid",
        &format!(
            "{} cells across {:.4} m, the depth of as much mass as all grains have",
            grid.cells, grid.depth
        ),
    );
    lines.say("left out", &continuum_incline::LEFT_OUT.join(", "));
    lines.say(
        "time step",
        &format!(
            "{:.4e} s, {} steps; implicit in stress and yield: no stability limit",
            grid.step, grid.steps
        ),
    );
    lines.say("cost", "well under a second per 10 000 cell-steps");
    Ok(())
}

fn hybrid(
    lines: &mut Lines,
    body: &InclineScene,
    (rheology, overlap): (&RheologyKeys, &OverlapKeys),
    settings: &Resolved,
) {
    let d = body.grains.diameter;
    let edge = overlap.height_diameters;
    let depth = body.continuum_depth(rheology) / d;
    let [inner, buffer, shell] = [settings.inner, settings.buffer, settings.shell].map(|w| w / d);
    lines.say(
        "zones",
        &format!(
            "grains to {edge} d of {depth:.1} d; overlap from a = {:.1} d over m = {:.1} d to b = {edge} d; traction on the last {shell:.1} d",
            edge - inner - buffer,
            edge - buffer
        ),
    );
    lines.say(
        "",
        if overlap.from > 0.0 {
            "all are grains at first; what lies above b is handed over at overlap.from"
        } else {
            "grains are made below b only; what lies above is continuum from the start"
        },
    );
    let settled = joined_incline::bed(body, (rheology, overlap)).grains;
    lines.say(
        "grains",
        &format!("{settled} of {} are settled", body.free_grains()),
    );
    lines.say("left out", &joined_incline::left_out(body).join(", "));
    say_settings(lines, overlap, settings, d);
    let choice = run::incline::step(body);
    let step = choice.seconds;
    lines.say_step(step, &step::chosen(&choice), &choice);
    let time = body.time.relax + body.time.average;
    let steps = time / step;
    let [length, width] = body.floor_edges();
    let base = length * width / (d * d);
    let all = body.free_grains() as f64;
    let kept = all * (edge / depth).min(1.0);
    let alone = overlap.from / time;
    let work = steps * (base + alone * all + (1.0 - alone) * kept);
    let cells = (depth - edge + inner + buffer) * d / settings.cell;
    let exchanges = (time - overlap.from) / settings.exchange_time;
    lines.say(
        "cost",
        &format!(
            "{work:.3e} grain-steps, {:.2} of those of all grains, and {:.3e} cell-steps; the settling of the bed beside them",
            work / (steps * (base + all)),
            exchanges * cells
        ),
    );
    if let Some(rate) = measured_rate(body) {
        lines.say(
            "rate",
            &format!(
                "{rate:.3e} grain-steps/s on one thread, measured now: {:.0} s",
                work / rate
            ),
        );
    }
}

/// Every setting with where its value comes from.
fn say_settings(lines: &mut Lines, keys: &OverlapKeys, settings: &Resolved, d: f64) {
    let from = |given: bool| if given { "given" } else { "computed" };
    let of = |part: Option<f64>| part.or(keys.width).is_some();
    for (key, value, given) in [
        ("cell", settings.cell, keys.cell_diameters.is_some()),
        ("inner", settings.inner, of(keys.inner_diameters)),
        ("buffer", settings.buffer, of(keys.buffer_diameters)),
        ("shell", settings.shell, of(keys.shell_diameters)),
    ] {
        let text = format!(
            "overlap.{key}_diameters = {:.4} ({})",
            value / d,
            from(given)
        );
        lines.say("", &text);
    }
    let width = settings.inner + settings.buffer;
    let text = format!(
        "overlap.width = {width:.4e} m, inner overlap and buffer together ({})",
        from(keys.width.is_some())
    );
    lines.say("", &text);
    let kernel = match settings.kernel {
        StressKernel::Layer => "the mean over a cell".into(),
        StressKernel::Lucy(half_width) => format!("Lucy, {:.4} d", half_width / d),
    };
    lines.say("", &format!("stress kernel: {kernel}"));
    for (key, value, given) in [
        (
            "stress_time",
            settings.stress_time,
            keys.stress_time.is_some(),
        ),
        (
            "relaxation_time",
            settings.relaxation_time,
            keys.relaxation_time.is_some(),
        ),
        (
            "following_time",
            settings.following_time,
            keys.following_time.is_some(),
        ),
        ("spin_time", settings.spin_time, keys.spin_time.is_some()),
        (
            "exchange_time",
            settings.exchange_time,
            keys.exchange_time.is_some(),
        ),
        ("load_time", settings.load_time, keys.load_time.is_some()),
    ] {
        lines.say(
            "",
            &format!("overlap.{key} = {value:.4e} s ({})", from(given)),
        );
    }
    lines.say(
        "",
        &format!(
            "overlap.impedance = {:.4e} Pa s/m ({})",
            settings.impedance,
            from(keys.impedance.is_some())
        ),
    );
    let motion = match settings.normal_motion {
        NormalMotion::Riding => "riding: a rigid mass on the grains, the edge moves with it",
        NormalMotion::Held => "held",
    };
    let given = from(keys.normal_motion.is_some());
    lines.say("", &format!("overlap.normal_motion = {motion} ({given})"));
}
