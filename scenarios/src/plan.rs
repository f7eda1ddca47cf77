//! The plan of a scene: what would be modelled and why, what is left out, what it would cost.

mod bed;
mod collapse;
mod cylinder;
mod joined_incline;
mod law;
mod open_chute;
mod sheared;
mod silo_discharge;
mod world;

use crate::calibrate;
use crate::failure::Failure;
use crate::run;
use crate::run::step;
use crate::scene::{
    BagnoldScene, CollapseModel, FrictionLaw, ImpactScene, InclineScene, InclineStart, LayerCase,
    RheologyKeys, Scene, SceneBody, SolverKeys,
};
use colluvium_coupling::incline::{InclineRun, InclineSpec};
use colluvium_dem::preparation::settle_incline_bed;
use colluvium_dem::timestep::Choice;
use colluvium_dem::{Normal, Threads};
use std::fmt::Write;
use std::ops::ControlFlow;
use std::time::Instant;

/// The plan as text.
pub fn plan(scene: &Scene) -> Result<String, Failure> {
    match &scene.body {
        SceneBody::Incline(body) => match body.continuum_keys() {
            None => incline(scene, body),
            Some(keys) => joined_incline::plan(scene, body, keys),
        },
        SceneBody::Bagnold(body) => bagnold(body),
        SceneBody::Sheared(body) => sheared::sheared(body),
        SceneBody::Collapse(body) if body.model == CollapseModel::Dem => {
            world::plan(scene, body.as_ref())
        }
        SceneBody::Collapse(body) if body.model == CollapseModel::Hybrid => {
            run::joined_column::with_edge(body, &scene.origin, |column| world::plan(scene, column))
        }
        SceneBody::Collapse(body) => {
            let ground = run::collapse_ground::ground(body, &scene.origin)?;
            Ok(collapse::collapse(body, ground.as_ref()))
        }
        SceneBody::Cylinder(body) => {
            let ground = run::cylinder_ground::ground(body, &scene.origin)?;
            Ok(cylinder::cylinder(body, ground.as_ref()))
        }
        SceneBody::OpenChute(body) => open_chute::open_chute(scene, body),
        SceneBody::SiloDischarge(body) => silo_discharge::silo_discharge(scene, body),
        SceneBody::Impact(body) => impact(scene, body),
        SceneBody::Chute(body) => bed::chute(body),
        SceneBody::Settle(body) => bed::settle(body),
        SceneBody::Grains(kind) => kind.act(&scene.origin, |recipe| world::plan(scene, recipe)),
    }
}

/// Who needs more steps than a collapse on the level.
fn whose_steps(terrain: bool) -> &'static str {
    match terrain {
        true => " (more where the ground falls away: what falls farther is faster)",
        false => "",
    }
}

/// Lines of a plan: a topic and what is said about it.
#[derive(Default)]
struct Lines(String);

impl Lines {
    fn say(&mut self, topic: &str, text: &str) {
        // Writing to a string does not fail.
        let _ = writeln!(self.0, "{topic:<16} {text}");
    }

    fn say_rheology(&mut self, law: &RheologyKeys) {
        self.say(
            "rheology",
            &format!(
                "{}{}, d {} m, φ {}, ρ_s {} kg/m³ ({})",
                law.law.word(),
                numbers_of_the_law(law),
                law.diameter,
                law.solid_fraction,
                law.grain_density,
                law.source.as_deref().unwrap_or("by numbers")
            ),
        );
    }

    /// The grid across a layer.
    fn say_layer_grid(&mut self, cells: usize, columns: Option<usize>) {
        let along = match columns {
            Some(columns) => format!("{columns} columns, periodic along the flow"),
            None => "no axis along the flow: nothing varies along it".to_owned(),
        };
        self.say("grid", &format!("{cells} cells across the layer, {along}"));
    }

    /// The implicit march to a steady flow, its first step over a natural time (s), and what it costs.
    fn say_march(&mut self, solver: &SolverKeys, natural_time: f64) {
        self.say(
            "time step",
            &format!(
                "{:.4e} s first, growing by {} a step; implicit in pressure, stress and yield: no stability limit",
                solver.timestep_scaled * natural_time,
                solver.growth
            ),
        );
        self.say("cost", "well under a second per 1000 cells and 50 steps");
    }

    /// A step, what is said of it, and every other limit with the step that it would allow.
    fn say_step(&mut self, step: f64, words: &str, choice: &Choice) {
        self.say("time step", &format!("{step:.4e} s: {words}"));
        for limit in choice.all.iter().skip(1) {
            let allowed = choice.safety * limit.step();
            self.say("", &format!("{allowed:.4e} s would be {limit}"));
        }
        if let Some(hard) = choice.hard() {
            self.say(
                "",
                &format!(
                    "{:.0} % of the stability limit of one contact, {:.4e} s ({})",
                    100.0 * step / hard.seconds,
                    hard.seconds,
                    hard.name
                ),
            );
        }
    }
}

/// Grains of the small bed on which the rate is measured, and steps.
const PROBE_GRAINS: u64 = 300;
const PROBE_STEPS: u64 = 2000;

/// Measures grain-steps per second and thread on a small flow of the same material.
fn measured_rate(scene: &InclineScene) -> Option<f64> {
    let mut small = scene.clone();
    small.grains.count = PROBE_GRAINS;
    small.scale = 1.0;
    small.floor.length_diameters = 7.0;
    small.floor.width_diameters = 5.0;
    small.start = InclineStart::Flow;
    // Soft and coarse: only the rate counts, and a soft bed settles in few steps.
    small.contact.stiffness_scaled = Some(2.0e3);
    small.contact.stiffness = None;
    small.contact.stiffness_from_speed = None;
    let bed = settle_incline_bed(&run::incline::bed(&small), Threads::Serial, &mut |_| {
        ControlFlow::Continue(())
    })
    .ok()?;
    let spec = InclineSpec {
        max_time: 1.0e6,
        ..run::incline::spec(&small, &bed, Threads::Serial)
    };
    let mut flow = InclineRun::new(spec).ok()?;
    let start = Instant::now();
    flow.advance(PROBE_STEPS).ok()?;
    Some((flow.steps_done() * bed.grains.len() as u64) as f64 / start.elapsed().as_secs_f64())
}

fn incline(scene: &Scene, body: &InclineScene) -> Result<String, Failure> {
    let mut lines = Lines::default();
    let choice = run::incline::step(body);
    let step = choice.seconds;
    let grains = body.free_grains();
    let [length, width] = body.floor_edges();
    let mass = body.mean_mass();
    let stiffness = body.stiffness();
    // A dense random packing, for the depth only.
    let depth = grains as f64 * mass / (body.grains.density * 0.57 * length * width);
    lines.say(
        "scene",
        &format!(
            "{}: grains on a rough plane at {} degrees",
            scene.name, body.slope_degrees
        ),
    );
    lines.say(
        "grains",
        &format!(
            "{grains} free over a base of fixed ones, floor {length:.3} m x {width:.3} m periodic, about {:.0} d deep",
            depth / body.grains.diameter
        ),
    );
    lines.say(
        "contact law",
        "linear spring and dashpot, tangential spring with history and Coulomb cap (Thuillet 2019, Eq. 2.1-2.10)",
    );
    match &body.contact.rolling {
        Some(rolling) => lines.say(
            "rotation",
            &format!(
                "yes, with rolling and twisting springs: β = {} stands for angular grains (Eq. 2.11-2.13)",
                rolling.beta
            ),
        ),
        None => lines.say("rotation", "yes, without rolling resistance: the scene's grains are spheres"),
    }
    lines.say("left out", &run::incline::left_out(body).join(", "));
    lines.say("stiffness", &format!("k_n = {stiffness:.4e} N/m"));
    let weight = body.grains.density * 0.57 * body.gravity * depth;
    let pressed = weight * body.grains.diameter.powi(2) / stiffness;
    let speed = 0.5 * (body.gravity * body.grains.diameter).sqrt();
    let struck = speed * (mass / stiffness).sqrt();
    lines.say(
        "overlap",
        &format!(
            "about {:.2} % of the radius under the weight at the base, {:.2} % in impacts at √(g d)/2",
            100.0 * pressed / (0.5 * body.grains.diameter),
            100.0 * struck / (0.5 * body.grains.diameter)
        ),
    );
    lines.say_step(step, &step::chosen(&choice), &choice);
    let least = ((body.time.relax + body.time.average) / step).ceil();
    let most = (body.time.limit / step).ceil();
    lines.say(
        "steps",
        &format!("{least:.3e} if steady after time.relax, at most {most:.3e}"),
    );
    // All grains count, the fixed base too: it has about one on each square diameter.
    let base = length * width / body.grains.diameter.powi(2);
    let moved = grains as f64 + base;
    let work = least * moved;
    match measured_rate(body) {
        Some(rate) => {
            lines.say(
                "rate",
                &format!(
                    "{rate:.3e} grain-steps/s on one thread, measured now on {PROBE_GRAINS} grains"
                ),
            );
            lines.say(
                "cost",
                &format!(
                    "{work:.3e} to {:.3e} grain-steps: {:.0} s to {:.0} s on one thread, and the settling of the bed",
                    most * moved,
                    work / rate,
                    most * moved / rate
                ),
            );
        }
        None => lines.say(
            "cost",
            &format!("{work:.3e} grain-steps at least; the rate could not be measured"),
        ),
    }
    let c = &body.calibration;
    let designs = calibrate::designs(body);
    lines.say(
        "calibrate",
        &format!(
            "flows at {}, where a flow stops in [{}, {}], where rest ends in [{}, {}]",
            told(&designs[0].flows),
            c.stop.low,
            c.stop.high,
            c.onset.low,
            c.onset.high
        ),
    );
    let [own, slopes, both] = designs.each_ref().map(|design| {
        let [a, b, c] = design.prospect.errors;
        format!(
            "±{a:.3}, ±{b:.3}, ±{c:.3}, at the cost of {:.1} full flows",
            design.cost
        )
    });
    lines.say(
        "design",
        &format!(
            "if the guess is true these flows tell mu_s, mu_2, i_0 to {own}; as many D-optimal slopes (flow_degrees = []) to {slopes}"
        ),
    );
    let chosen = &designs[2];
    let ratio = designs[1].prospect.determinant / chosen.prospect.determinant;
    lines.say(
        "depths",
        &format!(
            "slopes and depths chosen together (depth_choices): {} tell them to {both}: errors {:.2} times those of slopes alone; thinner \
             flows waste the 7 d that are cut and hold by their length, deeper ones pay for layers that share one error",
            told(&chosen.flows),
            ratio.powf(1.0 / 6.0)
        ),
    );
    Ok(lines.0)
}

/// Slopes, and depths where they are not the full one.
fn told(flows: &[colluvium_coupling::campaign::Flow]) -> String {
    let mut list: Vec<(f64, Vec<f64>)> = Vec::new();
    for flow in flows {
        match list.iter_mut().find(|(depth, _)| *depth == flow.depth) {
            Some((_, slopes)) => slopes.push(flow.slope_degrees),
            None => list.push((flow.depth, vec![flow.slope_degrees])),
        }
    }
    let parts: Vec<String> = list
        .iter()
        .map(|(depth, slopes)| match *depth {
            1.0 => format!("{slopes:?} degrees"),
            _ => format!("{slopes:?} degrees at {depth} of the depth"),
        })
        .collect();
    parts.join(", ")
}

fn bagnold(body: &BagnoldScene) -> Result<String, Failure> {
    let mut lines = Lines::default();
    let layer = LayerCase::of(body).map_err(run::steady_layer::failure)?;
    let r = &body.rheology;
    lines.say(
        "scene",
        &format!(
            "bagnold: a layer of μ(I) material, {} m deep, at {} degrees, from rest to steady flow",
            body.depth, body.slope_degrees
        ),
    );
    lines.say_rheology(&body.rheology);
    lines.say_layer_grid(body.cells(), body.grid.columns());
    lines.say("left out", &run::bagnold::LEFT_OUT.join(", "));
    if layer.rests() {
        lines.say("flow", "none: friction and cohesion hold the layer");
    } else {
        let inertial_number = run::bagnold::base_inertial_number(body, &layer);
        lines.say(
            "flow",
            &format!(
                "I = {inertial_number:.4} {}, {:.4} m/s at the surface (exact), {}",
                if r.cohesion > 0.0 || r.law == FrictionLaw::Coulomb {
                    "on the base"
                } else {
                    "throughout"
                },
                layer.surface_velocity(),
                if layer.base().1 {
                    "well posed"
                } else {
                    "ill posed in 2D and 3D"
                }
            ),
        );
        if let Some(remark) = run::bagnold::validity_remark(body, inertial_number) {
            lines.say("warning", &remark);
        }
    }
    for remark in body.rheology.remarks() {
        lines.say("warning", &remark);
    }
    lines.say_march(&body.solver, (body.depth / body.gravity).sqrt());
    Ok(lines.0)
}

/// The numbers that the law reads, for a line of text.
fn numbers_of_the_law(r: &RheologyKeys) -> String {
    let named = [
        ("μ_s", r.mu_s),
        ("μ_2", r.mu_2),
        ("I_0", r.i_0),
        ("α", r.alpha),
        ("μ_∞", r.mu_infinity),
        ("η (Pa s)", r.viscosity),
        ("points", r.table.as_ref().map(|t| t.len() as f64)),
    ];
    named
        .iter()
        .filter_map(|(name, value)| value.map(|v| format!(", {name} {v}")))
        .collect()
}

fn impact(scene: &Scene, body: &ImpactScene) -> Result<String, Failure> {
    let mut lines = Lines::default();
    let pair = scene.name == "two-spheres";
    let impact = run::impact::prepare(body, pair)?;
    let what = if pair {
        "a sphere hits an equal sphere at rest"
    } else {
        "a sphere hits the plane z = 0"
    };
    lines.say(
        "scene",
        &format!(
            "{}: {what} at {} m/s, {} degrees from the normal",
            scene.name, body.speed, body.impact_degrees
        ),
    );
    law::say(&mut lines, &impact.law);
    lines.say("left out", &run::impact::left_out(body).join(", "));
    let share = 100.0 * impact.overlap / body.radius;
    let stiffness = match impact.law.normal {
        Normal::Hooke(hooke) => format!("k_n = {:.4e} N/m, ", hooke.stiffness),
        _ => String::new(),
    };
    lines.say(
        "contact",
        &format!(
            "{stiffness}contact time {:.4e} s, largest overlap about {share:.2} % of the radius",
            impact.contact_time,
        ),
    );
    let step = &impact.step;
    lines.say_step(step.seconds, &step::chosen(step), step);
    lines.say(
        "steps",
        &format!("{:.0}, well under a second per million", impact.steps()),
    );
    Ok(lines.0)
}
