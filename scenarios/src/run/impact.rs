//! One impact: two spheres, or a sphere on the plane z = 0.

use super::impact_scales;
use super::step;
use super::{Findings, Under};
use crate::cost::Cost;
use crate::failure::Failure;
use crate::progress::Bar;
use crate::scene::{ImpactScene, RollingKeys, Scene, SceneError};
use crate::summary::{Model, Quantity, Summary};
use crate::table::Table;
use colluvium_dem::timestep::{Choice, Conditions, Shares};
use colluvium_dem::{
    Cohesion, ContactLaw, Damping, Domain, Grain, GrainSample, Normal, Record, Setup, SetupError,
    ShapeParameter, Simulation, Snapshot, Threads, Wall,
};
use nalgebra::Vector3;

/// What one impact leaves out.
pub const LEFT_OUT: [&str; 3] = [
    "bonds",
    "plasticity",
    "rotation about other axes at the start",
];

/// Steps between two looks at the clock.
const STEPS_PER_LOOK: u64 = 20_000;

/// An impact ready to run.
#[derive(Clone, Debug)]
pub struct Impact {
    /// The simulation's start.
    pub setup: Setup,
    /// m_1 m_2/(m_1 + m_2), or the sphere's mass against a plane (kg).
    pub reduced_mass: f64,
    /// Duration of the contact (s): √(m_red (π² + ln² ε_n)/k_n) of a linear spring, else that of the
    /// undamped contact.
    pub contact_time: f64,
    /// Largest overlap without damping (m).
    pub overlap: f64,
    /// The law.
    pub law: ContactLaw,
    /// Duration (s).
    pub duration: f64,
    /// Time step.
    pub step: Choice,
}

impl Impact {
    /// Steps of the whole run; not a whole number beyond 2^53.
    pub fn steps(&self) -> f64 {
        (self.duration / self.step.seconds).ceil()
    }
}

/// Most steps of an impact: about an hour.
const MOST_STEPS: f64 = 1e9;

/// Checks an impact before anything is written.
pub(super) fn check(scene: &Scene, body: &ImpactScene) -> Result<(), Failure> {
    let impact = prepare(body, scene.name == "two-spheres")?;
    if !impact.step.seconds.is_normal() || !impact.contact_time.is_finite() {
        let range = format!(
            "such that the time step, here {:e} s, is a number a computer can hold",
            impact.step.seconds
        );
        let modulus = body.contact.and_then(|c| c.youngs_modulus);
        let (key, value) = match impact.law.normal {
            Normal::Hooke(_) => ("stiffness", body.stiffness),
            _ => ("contact.youngs_modulus", modulus.unwrap_or(f64::NAN)),
        };
        return Err(scene.out_of_range(key, value, &range).into());
    }
    let steps = impact.steps();
    if steps > MOST_STEPS {
        // The key that makes it long: the duration as given, or the flight up to the contact.
        let (key, value) = if body.duration > 0.0 {
            ("duration", body.duration)
        } else if impact.duration > 4.0 * impact.contact_time {
            ("speed", body.speed)
        } else {
            ("steps_per_contact", body.steps_per_contact)
        };
        let range = format!(
            "such that the run takes at most {MOST_STEPS:e} steps; it would take {steps:.3e}, over {:e} s with a gap of {} m",
            impact.duration, body.gap
        );
        return Err(scene.out_of_range(key, value, &range).into());
    }
    let seconds = impact.step.seconds;
    step::check(scene, &impact.step, seconds, "safety", body.safety)?;
    Simulation::new(impact.setup)
        .map(drop)
        .map_err(|error| Failure::Input(format!("{}: {error}", scene.origin)))
}

/// Rolling and twisting springs of a scene.
pub fn shape(keys: Option<&RollingKeys>) -> Option<ShapeParameter> {
    keys.map(|k| ShapeParameter {
        beta: k.beta,
        rolling_friction: k.rolling_friction,
        twisting_friction: k.twisting_friction,
    })
}

/// Sets an impact up; `pair` for two spheres, else the plane z = 0.
pub fn prepare(scene: &ImpactScene, pair: bool) -> Result<Impact, SceneError> {
    let law = scene.law("contact")?;
    let mass = scene.mass();
    let reduced_mass = if pair { 0.5 * mass } else { mass };
    let reduced_radius = if pair {
        0.5 * scene.radius
    } else {
        scene.radius
    };
    let struck = impact_scales::overlap(&law, reduced_mass, reduced_radius, scene.speed);
    let overlap = struck.max(-scene.gap);
    // A step resolves the swing at the deepest overlap; a linear spring has one swing.
    let undamped = if overlap > 0.0 {
        impact_scales::half_period(&law, reduced_mass, reduced_radius, overlap)
    } else {
        impact_scales::duration(&law, reduced_mass, reduced_radius, 0.0)
    };
    let contact_time = match &law.normal {
        Normal::Hooke(hooke) => {
            let damped = hooke.contact_time(reduced_mass);
            // A dashpot of its own strength may be too strong for the spring to swing back.
            if damped.is_finite() {
                damped
            } else {
                2.0 * undamped
            }
        }
        _ => impact_scales::duration(&law, reduced_mass, reduced_radius, scene.speed),
    };

    let angle = scene.impact_degrees.to_radians();
    let (tangential, normal) = (scene.speed * angle.sin(), scene.speed * angle.cos());
    // A grazing flight never closes the gap: it starts beside the contact point.
    let closes = normal > 1e-9 * scene.speed && normal > 0.0 && scene.gap > 0.0;
    let approach = if closes { scene.gap / normal } else { 0.0 };
    let radius = scene.radius;
    let rest_height = if pair { 2.0 * radius } else { radius };
    let mut moving = Grain::at_rest(
        Vector3::new(-tangential * approach, 0.0, rest_height + scene.gap),
        radius,
        scene.density,
    );
    moving.velocity = Vector3::new(tangential, 0.0, -normal);
    moving.spin = Vector3::new(0.0, scene.spin, 0.0);
    let mut grains = vec![moving];
    let mut walls = Vec::new();
    if pair {
        grains.push(Grain::at_rest(Vector3::zeros(), radius, scene.density));
    } else {
        walls.push(Wall::plane(Vector3::zeros(), Vector3::z()));
    }
    let duration = if scene.duration > 0.0 {
        scene.duration
    } else {
        approach + 2.0 * contact_time
    };
    let reach = 20.0 * radius + scene.gap;
    let conditions = Conditions {
        speed: scene.speed,
        overlap: overlap.max(0.0) / radius,
        ..Conditions::default()
    };
    let shares = Shares {
        steps_per_contact: scene.steps_per_contact,
        contact_time: Some(undamped),
        safety: scene.safety,
        ..Shares::default()
    };
    let step = step::choose(&law, &grains, !pair, &conditions, &shares);
    Ok(Impact {
        overlap,
        law,
        setup: Setup {
            domain: Domain {
                lower: Vector3::repeat(-reach),
                upper: Vector3::repeat(reach),
                periodic: [false; 3],
            },
            gravity: Vector3::new(0.0, 0.0, -scene.gravity),
            law: law.into(),
            grains,
            walls,
            bodies: Vec::new(),
            timestep: step.seconds,
            threads: Threads::Serial,
        },
        reduced_mass,
        contact_time,
        duration,
        step,
    })
}

/// What is read off while the spheres fly.
#[derive(Clone, Debug, Default)]
struct Watch {
    rows: Vec<Vec<f64>>,
    /// Time, gap and normal velocity at the last look.
    last: Option<(f64, f64, f64)>,
    begin: Option<f64>,
    end: Option<f64>,
    speed_in: f64,
    speed_out: f64,
}

impl Watch {
    /// Sees gap and normal velocity of separation.
    fn see(&mut self, time: f64, gap: f64, opening: f64) {
        if let Some((t, before, speed)) = self.last {
            let crossing = || t + (time - t) * before / (before - gap);
            if before > 0.0 && gap <= 0.0 && self.begin.is_none() {
                (self.begin, self.speed_in) = (Some(crossing()), speed);
            }
            if before <= 0.0 && gap > 0.0 && self.begin.is_some() && self.end.is_none() {
                (self.end, self.speed_out) = (Some(crossing()), opening);
            }
        }
        self.last = Some((time, gap, opening));
    }

    /// As arrays, so that a run goes on with its trajectory.
    fn save(&self, record: &mut Record) {
        let flat = self.rows.iter().flatten().copied().collect();
        record.numbers.insert("watch/rows".into(), flat);
        let (t, gap, opening) = self.last.unwrap_or((f64::NAN, 0.0, 0.0));
        let none = f64::NAN;
        let state = vec![
            t,
            gap,
            opening,
            self.begin.unwrap_or(none),
            self.end.unwrap_or(none),
            self.speed_in,
            self.speed_out,
        ];
        record.numbers.insert("watch/state".into(), state);
    }

    fn restore(record: &Record, width: usize) -> Result<Watch, String> {
        let rows = record
            .numbers("watch/rows")?
            .chunks(width)
            .map(<[f64]>::to_vec)
            .collect();
        let [t, gap, opening, begin, end, speed_in, speed_out] = record.numbers("watch/state")?
        else {
            return Err("array `watch/state` must have 7 numbers".into());
        };
        let some = |x: f64| (!x.is_nan()).then_some(x);
        Ok(Watch {
            rows,
            last: some(*t).map(|t| (t, *gap, *opening)),
            begin: some(*begin),
            end: some(*end),
            speed_in: *speed_in,
            speed_out: *speed_out,
        })
    }
}

pub(super) fn run(scene: &ImpactScene, under: &mut Under) -> Result<Findings, Failure> {
    let pair = under.scene.name == "two-spheres";
    let impact = prepare(scene, pair)?;
    let timestep = impact.setup.timestep;
    let steps = impact.steps() as u64;
    let stride = (steps / scene.rows.max(1)).max(1);
    let bodies = if pair { 2 } else { 1 };
    let width = 1 + 9 * bodies;

    let before = start_energy(&impact)?;
    let (mut simulation, mut watch) = match &under.resumed {
        Some(saved) => (
            Simulation::resume(impact.setup.clone(), &saved.record).map_err(refused)?,
            Watch::restore(&saved.record, width).map_err(Failure::Input)?,
        ),
        None => (
            Simulation::new(impact.setup.clone()).map_err(refused)?,
            Watch::default(),
        ),
    };
    under.begin()?;
    let bar = Bar::new(&under.scene.name);
    let mut snapshot = Snapshot::default();
    if simulation.steps_done() == 0 {
        look(&mut simulation, &mut snapshot, &mut watch, true, pair);
    }
    while simulation.steps_done() < steps {
        simulation
            .advance(1)
            .map_err(|error| Failure::Run(error.to_string()))?;
        let done = simulation.steps_done();
        let row = done.is_multiple_of(stride) || done == steps;
        look(&mut simulation, &mut snapshot, &mut watch, row, pair);
        if done.is_multiple_of(STEPS_PER_LOOK) {
            bar.set(done as f64 / steps as f64);
            under.checkpoint("impact", || {
                let mut record = simulation.checkpoint();
                watch.save(&mut record);
                record
            })?;
        }
    }
    bar.clear();
    let mut summary = Summary::begun(&under.scene.name, "run");
    summary.model = Model {
        grains: bodies as u64,
        cells: 0,
        dt_s: timestep,
        dt_limit: step::chosen(&impact.step),
        left_out: left_out(scene),
    };
    summary.cost = Cost::measured(under.wall_s(), 1, steps * bodies as u64, 0);
    summary.state_hash = simulation.state_hash();
    describe(
        &mut summary,
        scene,
        &impact,
        &watch,
        &mut simulation,
        before,
    );
    Ok(Findings {
        summary,
        tables: vec![trajectory(&watch, bodies)],
        grains: None,
    })
}

/// What the scene does not name and is not computed.
pub fn left_out(scene: &ImpactScene) -> Vec<String> {
    let mut list = super::bed::left_out(scene.law_keys().parts(), &LEFT_OUT);
    if scene.gravity == 0.0 {
        list.push("gravity".into());
    }
    list
}

/// The restitution that the law is made for, and where that is said.
fn matched(impact: &Impact) -> Option<(f64, &'static str)> {
    if impact.law.cohesion != Cohesion::None {
        return None;
    }
    match &impact.law.normal {
        Normal::Hooke(hooke) => match hooke.damping {
            Damping::Restitution(e) => Some((e, "scene key restitution")),
            Damping::MassProportional(_) => Some((
                hooke.restitution(impact.reduced_mass),
                "exp(-γ τ/2) of the dashpot",
            )),
        },
        Normal::Hertz(hertz) => Some((hertz.restitution, "scene key restitution")),
        Normal::Viscoelastic(_) | Normal::Jkr(_) => None,
    }
}

fn refused(error: SetupError) -> Failure {
    Failure::Input(error.to_string())
}

fn start_energy(impact: &Impact) -> Result<f64, Failure> {
    let mut start = Simulation::new(impact.setup.clone()).map_err(refused)?;
    Ok(start.energy().kinetic())
}

fn look(
    simulation: &mut Simulation,
    snapshot: &mut Snapshot,
    watch: &mut Watch,
    row: bool,
    pair: bool,
) {
    simulation.snapshot(snapshot);
    let mut grains: Vec<&GrainSample> = snapshot.grains.iter().collect();
    grains.sort_by_key(|g| g.id);
    let Some(first) = grains.first() else { return };
    let (gap, opening) = match grains.get(1) {
        Some(second) if pair => {
            let line = first.position - second.position;
            let normal = line.normalize();
            let approach = first.velocity - second.velocity;
            (
                line.norm() - first.radius - second.radius,
                approach.dot(&normal),
            )
        }
        _ => (first.position.z - first.radius, first.velocity.z),
    };
    watch.see(snapshot.time, gap, opening);
    if row {
        let mut values = vec![snapshot.time];
        for grain in grains {
            for vector in [grain.position, grain.velocity, grain.spin] {
                values.extend(vector.iter());
            }
        }
        watch.rows.push(values);
    }
}

fn trajectory(watch: &Watch, bodies: usize) -> Table {
    let column = |n: usize| watch.rows.iter().map(|row| row[n]).collect();
    let mut table = Table::new("trajectory").with("t", "s", column(0));
    for body in 0..bodies {
        for (n, (name, unit)) in [
            ("x", "m"),
            ("y", "m"),
            ("z", "m"),
            ("vx", "m/s"),
            ("vy", "m/s"),
            ("vz", "m/s"),
            ("wx", "rad/s"),
            ("wy", "rad/s"),
            ("wz", "rad/s"),
        ]
        .into_iter()
        .enumerate()
        {
            table = table.with(
                &format!("{name}{}", body + 1),
                unit,
                column(1 + 9 * body + n),
            );
        }
    }
    table
}

fn describe(
    summary: &mut Summary,
    scene: &ImpactScene,
    impact: &Impact,
    watch: &Watch,
    simulation: &mut Simulation,
    before: f64,
) {
    if let (Some(begin), Some(end)) = (watch.begin, watch.end) {
        let restitution = Quantity::new(-watch.speed_out / watch.speed_in, "1");
        let time = Quantity::new(end - begin, "s");
        let (restitution, time) = match matched(impact) {
            Some(wanted) => (
                restitution.against(wanted.0, wanted.1),
                match impact.law.normal {
                    Normal::Hooke(_) => {
                        time.against(impact.contact_time, "√(m_red (π² + ln² ε_n)/k_n)")
                    }
                    _ => time.from("from first to last touch"),
                },
            ),
            None => (
                restitution.from("follows from the law; no closed form here"),
                time.from("from first to last touch"),
            ),
        };
        summary.put("restitution", restitution);
        summary.put("contact_time", time);
    } else {
        summary
            .remarks
            .push("No contact was seen from its beginning to its end.".into());
    }
    let energy = simulation.energy();
    summary.put(
        "energy_before",
        Quantity::new(before, "J").from("kinetic, at the start"),
    );
    summary.put(
        "energy_after",
        Quantity::new(energy.kinetic(), "J").from("kinetic, at the end"),
    );
    summary.put(
        "largest_overlap",
        Quantity::new(simulation.largest_overlap(), "R"),
    );
    for (name, value) in [
        ("translation_J", energy.translation),
        ("rotation_J", energy.rotation),
        ("elastic_J", energy.elastic()),
    ] {
        summary.ledger.energy.insert(name.into(), value);
    }
    let initial: Vector3<f64> = impact
        .setup
        .grains
        .iter()
        .map(|g| g.mass() * g.velocity)
        .sum();
    if scene.gravity == 0.0 && initial.norm() > 0.0 {
        let drift = simulation.leapfrog_momentum() + simulation.wall_impulse() - initial;
        summary.ledger.momentum_relative = Some(drift.norm() / initial.norm());
    }
    // Gravity has a moment about the origin: its angular momentum is not kept.
    if scene.gravity == 0.0 && impact.setup.walls.is_empty() {
        summary.ledger.angular_momentum_relative = angular_momentum_error(impact, watch);
    }
}

/// Relative change of the angular momentum of two spheres from first to last row.
fn angular_momentum_error(impact: &Impact, watch: &Watch) -> Option<f64> {
    let grains = &impact.setup.grains;
    let total = |row: &Vec<f64>| -> (Vector3<f64>, f64) {
        let mut sum = Vector3::zeros();
        let mut size = 0.0;
        for (n, grain) in grains.iter().enumerate() {
            let at = |k: usize| Vector3::new(row[k], row[k + 1], row[k + 2]);
            let base = 1 + 9 * n;
            let (x, v, w) = (at(base), at(base + 3), at(base + 6));
            let inertia = 0.4 * grain.mass() * grain.radius * grain.radius;
            sum += grain.mass() * x.cross(&v) + inertia * w;
            size += grain.mass() * grain.radius * v.norm() + inertia * w.norm();
        }
        (sum, size)
    };
    let (first, last) = (watch.rows.first()?, watch.rows.last()?);
    let ((a, size), (b, _)) = (total(first), total(last));
    (size > 0.0).then(|| (b - a).norm() / size)
}
