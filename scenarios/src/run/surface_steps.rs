//! Flows with a moving surface: what their steps add up to, and their state in checkpoints.

use super::Under;
use super::step_table::StepTable;
use crate::failure::Failure;
use crate::frames;
use crate::summary::{Quantity, Summary};
use colluvium_continuum::free_surface::{History, SurfaceState, SurfaceStep};
use colluvium_continuum::units::Units;
use colluvium_dem::Record;

/// Instants of the front over the duration.
pub(super) const FRONTS: f64 = 240.0;

/// How many steps of about this length a run of this duration takes (s): every instant of the front ends one.
pub fn steps_of(duration: f64, step: f64) -> f64 {
    FRONTS * (duration / FRONTS / step - 1e-9).ceil()
}

/// Instants of profile and fields over the duration.
pub(super) const PROFILES: f64 = 24.0;
/// Steps at rest after which a run ends.
const REST_STEPS: u64 = 3;

/// What the steps of a run add up to.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Steps {
    /// The last one.
    pub last: SurfaceStep,
    /// Steps, Newton iterations, cuts, cell-steps and steps at rest.
    counts: [u64; 5],
    /// Largest residuals of momentum, divergence and stress of any step.
    residuals: [f64; 3],
    /// Each of them.
    pub all: StepTable,
}

impl Steps {
    /// Adds a step, after which everything may be at rest and volume was gained.
    pub fn book(&mut self, step: &SurfaceStep, at_rest: bool, units: &Units, volume_error: f64) {
        self.all.book(step, units, volume_error);
        let [steps, iterations, cuts, cell_steps, resting] = &mut self.counts;
        *steps += 1;
        *iterations += step.newton_iterations as u64;
        *cuts += step.cuts as u64;
        *cell_steps += step.active_cells as u64;
        *resting = if at_rest { *resting + 1 } else { 0 };
        let r = &step.residuals;
        for (most, now) in self
            .residuals
            .iter_mut()
            .zip([r.momentum, r.divergence, r.stress])
        {
            *most = most.max(now);
        }
        self.last = *step;
    }

    /// Whether the last steps left everything at rest.
    pub fn rest(&self) -> bool {
        self.counts[4] >= REST_STEPS
    }

    /// Steps made, and cells with a pressure summed over them.
    pub fn work(&self) -> [u64; 2] {
        [self.counts[0], self.counts[3]]
    }

    pub fn put_into(&self, record: &mut Record) {
        let mut put = |name: &str, values: Vec<f64>| {
            record.numbers.insert(name.to_owned(), values);
        };
        put("course/residuals", self.residuals.to_vec());
        put("course/step", vec![self.last.dt, self.last.max_speed]);
        let counts = self.counts.to_vec();
        record.counts.insert("course/counts".into(), counts);
        self.all.put_into(record);
    }

    pub fn of(record: &Record) -> Option<Self> {
        let step = record.numbers.get("course/step")?;
        let residuals = record.numbers.get("course/residuals")?;
        let counts = record.counts.get("course/counts")?;
        Some(Self {
            last: SurfaceStep {
                dt: *step.first()?,
                max_speed: *step.get(1)?,
                ..SurfaceStep::default()
            },
            counts: counts.clone().try_into().ok()?,
            residuals: residuals.clone().try_into().ok()?,
            all: StepTable::of(record)?,
        })
    }

    /// Says what the steps were, with the largest speed in m/s and the strain-rate floor in 1/s.
    pub fn describe(&self, summary: &mut Summary, speed: f64, strain_rate_floor: f64) {
        let mut put = |name: &str, value: f64, unit: &str, source: &str| {
            summary.put(name, Quantity::new(value, unit).from(source));
        };
        let [steps, iterations, cuts, _, _] = self.counts;
        put("largest_speed", speed, "m/s", "at the end");
        put("steps", steps as f64, "1", "");
        put(
            "newton_iterations",
            iterations as f64,
            "1",
            "failed attempts included",
        );
        put("steps_cut", cuts as f64, "1", "halved and tried again");
        let [momentum, divergence, stress] = self.residuals;
        put(
            "momentum_residual",
            momentum,
            "1",
            "largest of any step, over gravity",
        );
        put(
            "divergence_residual",
            divergence,
            "1",
            "largest of any step, over √(gravity/height)",
        );
        put(
            "stress_residual",
            stress,
            "1",
            "largest of any step, relative",
        );
        put(
            "strain_rate_floor",
            strain_rate_floor,
            "1/s",
            "at which rigid matter creeps",
        );
    }
}

/// Joins the fields at all instants of the profile up to the last one of the front, at a time over the
/// duration, and those of the end, which `picture` writes.
pub(super) fn join_pictures(
    under: &Under,
    time: f64,
    picture: impl FnOnce(u64) -> Result<(), Failure>,
) -> Result<(), Failure> {
    let last = (time * FRONTS + 1e-6) as u64;
    let every = (FRONTS / PROFILES) as u64;
    let mut instants: Vec<u64> = (0..=last).step_by(every as usize).collect();
    if !last.is_multiple_of(every) {
        picture(last)?;
        instants.push(last);
    }
    frames::join(under.directory.path(), frames::FIELDS, &instants)
}

/// Names of a vector's components.
fn components<const D: usize>(vector: &str) -> impl Iterator<Item = String> {
    let all: &[&str] = if D == 2 {
        &["x", "z"]
    } else {
        &["x", "y", "z"]
    };
    all.iter().map(move |axis| format!("{vector}/{axis}"))
}

/// Puts a state into a checkpoint.
pub(super) fn put_state<const D: usize, const C: usize>(
    state: &SurfaceState<D, C>,
    record: &mut Record,
) {
    let mut put = |name: &str, values: Vec<f64>| {
        record.numbers.insert(name.to_owned(), values);
    };
    put("fractions", state.fractions.clone());
    let history = &state.history;
    for (vector, values) in [("velocity", &state.velocity), ("lead", &history.lead)] {
        for (name, values) in components::<D>(vector).zip(values) {
            put(&name, values.clone());
        }
    }
    put("pressure", state.pressure.clone());
    put("stress", state.stress.iter().flatten().copied().collect());
    put("threshold_pressure", history.pressure.clone());
    let changes = history.friction_change.iter().flatten();
    put("friction_change", changes.copied().collect());
    put(
        "time",
        vec![
            state.time,
            state.velocity_time,
            state.next_step,
            history.push,
        ],
    );
    put("passed", state.passed.to_vec());
    let steps = vec![state.steps as u64];
    record.counts.insert("steps".into(), steps);
}

/// The state in a checkpoint.
pub(super) fn state_of<const D: usize, const C: usize>(
    record: &Record,
) -> Option<SurfaceState<D, C>> {
    let numbers = |name: &str| record.numbers.get(name).cloned();
    let time = numbers("time")?;
    let vector = |name: &str| -> Option<[Vec<f64>; D]> {
        let rows = components::<D>(name).map(|name| numbers(&name));
        rows.collect::<Option<Vec<_>>>()?.try_into().ok()
    };
    let stresses = |name: &str| Some(numbers(name)?.as_chunks::<C>().0.to_vec());
    Some(SurfaceState {
        fractions: numbers("fractions")?,
        velocity: vector("velocity")?,
        pressure: numbers("pressure")?,
        stress: stresses("stress")?,
        history: History {
            lead: vector("lead")?,
            pressure: numbers("threshold_pressure")?,
            friction_change: stresses("friction_change")?,
            push: *time.get(3)?,
        },
        time: *time.first()?,
        velocity_time: *time.get(1)?,
        next_step: *time.get(2)?,
        steps: *record.counts.get("steps")?.first()? as usize,
        passed: numbers("passed")?.try_into().ok()?,
    })
}

/// The rows of columns that were stored one after the other.
pub(super) fn columns<const N: usize>(all: &[f64]) -> [Vec<f64>; N] {
    let rows = all.len() / N;
    std::array::from_fn(|n| all[n * rows..(n + 1) * rows].to_vec())
}
