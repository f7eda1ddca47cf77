//! A run of a flow with a moving surface: its steps up to the end, with rows, profiles, fields and checkpoints.

use super::Under;
use super::steady_layer::failure;
use super::surface_steps::{FRONTS, PROFILES, Steps, columns, join_pictures, put_state, state_of};
use crate::cost::Cost;
use crate::failure::Failure;
use crate::frames;
use crate::progress::Bar;
use crate::scene::RheologyKeys;
use crate::state_hash;
use crate::summary::{Model, Quantity, Summary};
use crate::table::Table;
use crate::vtkhdf::Frame;
use colluvium_continuum::Error;
use colluvium_continuum::free_surface::{SurfaceState, SurfaceStep};
use colluvium_continuum::rheology::ShearLaw;
use colluvium_continuum::units::Units;
use colluvium_dem::Record;

/// What a run asks of its flow; SI units but for the state and what steps report.
pub(super) trait Followed<const D: usize, const C: usize> {
    /// Its natural units.
    fn units(&self) -> &Units;
    /// Time (s).
    fn time(&self) -> f64;
    /// The state.
    fn state(&self) -> &SurfaceState<D, C>;
    /// Goes on from another state.
    fn set_state(&mut self, state: SurfaceState<D, C>) -> Result<(), Error>;
    /// Makes a step that ends at a time (s) at the latest.
    fn step(&mut self, until: f64) -> Result<SurfaceStep, Error>;
    /// Whether a step left everything at rest, so that the run may end.
    fn is_at_rest(&self, step: &SurfaceStep) -> bool;
    /// Volume gained, relative.
    fn volume_drift(&self) -> f64;
    /// Places and heights of the surface (m).
    fn profile(&self) -> (Vec<f64>, Vec<f64>);
    /// What is noted at every instant, the time first.
    fn row(&self) -> Vec<f64>;
    /// Shares of the material's volume: see [`super::surface_fields::shares`].
    fn shares(&self) -> [f64; 3];
    /// The fields of now.
    fn frame(&self) -> Frame;
    /// Heights of the ground, if there is any: a run goes on over the same only.
    fn ground(&self) -> Vec<f64> {
        Vec::new()
    }
}

/// What was found on the way, beside the state.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Course {
    /// Rows of every instant, one behind the other.
    rows: Vec<f64>,
    /// Numbers of a row.
    width: usize,
    /// [`Followed::shares`] at every instant of the rows.
    shares: Vec<[f64; 3]>,
    /// Time, place and height, row by row.
    profiles: [Vec<f64>; 3],
    /// Heights of the ground; none on a level floor.
    pub ground: Vec<f64>,
    /// What the steps add up to.
    pub steps: Steps,
}

impl Course {
    /// Nothing yet.
    fn of<const D: usize, const C: usize>(flow: &impl Followed<D, C>) -> Self {
        Self {
            width: flow.row().len(),
            ground: flow.ground(),
            ..Self::default()
        }
    }

    /// Takes a row down, once an instant: a run may end at one that was just seen.
    fn see<const D: usize, const C: usize>(&mut self, flow: &impl Followed<D, C>) {
        let row = flow.row();
        if self.last().is_none_or(|last| last[0] < row[0]) {
            self.rows.extend(row);
            self.shares.push(flow.shares());
        }
    }

    fn see_profile<const D: usize, const C: usize>(&mut self, flow: &impl Followed<D, C>) {
        let (x, h) = flow.profile();
        let [times, places, heights] = &mut self.profiles;
        times.extend(std::iter::repeat_n(flow.time(), x.len()));
        places.extend(x);
        heights.extend(h);
    }

    /// The last row.
    pub fn last(&self) -> Option<&[f64]> {
        self.rows.chunks_exact(self.width.max(1)).next_back()
    }

    /// A column of the rows.
    pub fn column(&self, number: usize) -> Vec<f64> {
        let rows = self.rows.chunks_exact(self.width.max(1));
        rows.map(|row| row[number]).collect()
    }

    /// How fast a height falls (m/s) over the last instants.
    fn fall(&self, number: usize) -> f64 {
        let last = self.shares.len().saturating_sub(1);
        let first = last.saturating_sub(FALL);
        let [times, heights] = [self.column(0), self.column(number)];
        (heights[first] - heights[last]) / (times[last] - times[first])
    }

    /// The largest number of a column, at least 0.
    pub fn largest(&self, number: usize) -> f64 {
        self.column(number).into_iter().fold(0.0, f64::max)
    }

    /// The table of shares that flow, flow where the equations are ill posed, and flow faster than the law was measured
    /// for if it says so.
    pub fn flowing(&self) -> Table {
        let share = |number: usize| -> Vec<f64> { self.shares.iter().map(|s| s[number]).collect() };
        let beyond = share(2);
        let table = Table::new("flowing")
            .with("t", "s", self.column(0))
            .with("flowing_share", "1", share(0))
            .with("ill_posed_share", "1", share(1));
        match beyond.iter().all(|share| share.is_nan()) {
            true => table,
            false => table.with("beyond_calibration_share", "1", beyond),
        }
    }

    /// The table of profiles over the places of this name.
    pub fn profiles(&self, place: &str) -> Table {
        let [times, places, heights] = self.profiles.clone();
        Table::new("profiles")
            .with("t", "s", times)
            .with(place, "m", places)
            .with("h", "m", heights)
    }

    fn record<const D: usize, const C: usize>(&self, state: &SurfaceState<D, C>) -> Record {
        let mut record = Record::default();
        for (name, values) in [
            ("course/rows", self.rows.clone()),
            ("course/shares", self.shares.as_flattened().to_vec()),
            ("course/profiles", self.profiles.concat()),
            ("ground", self.ground.clone()),
        ] {
            if !values.is_empty() {
                record.numbers.insert(name.to_owned(), values);
            }
        }
        self.steps.put_into(&mut record);
        put_state(state, &mut record);
        record
    }

    /// The course of a checkpoint, with rows of as many numbers as these have, and its state.
    fn restored<const D: usize, const C: usize>(
        &self,
        record: &Record,
    ) -> Option<(Course, SurfaceState<D, C>)> {
        let numbers = |name: &str| record.numbers.get(name);
        let rows = numbers("course/rows")?.clone();
        let course = Course {
            width: self.width,
            shares: numbers("course/shares")?.as_chunks().0.to_vec(),
            profiles: columns(numbers("course/profiles")?),
            ground: numbers("ground").cloned().unwrap_or_default(),
            steps: Steps::of(record)?,
            rows,
        };
        let fits = course.rows.len() == course.shares.len() * self.width;
        fits.then_some(())?;
        Some((course, state_of(record)?))
    }
}

/// Follows a flow up to a time (s) or to its rest, from the start or from where the run stood.
pub(super) fn follow<const D: usize, const C: usize>(
    flow: &mut impl Followed<D, C>,
    end: f64,
    under: &mut Under,
) -> Result<Course, Failure> {
    let mut course = Course::of(flow);
    let fresh = under.resumed.is_none();
    if let Some(checkpoint) = &under.resumed {
        let damaged =
            || Failure::Input("--resume: the checkpoint misses a part; nothing was changed".into());
        let (before, state) = course.restored(&checkpoint.record).ok_or_else(damaged)?;
        if before.ground != course.ground {
            return Err(Failure::Input(
                "--resume: the file of the terrain has other heights than when the run was begun; nothing was changed".into(),
            ));
        }
        course = before;
        flow.set_state(state)
            .map_err(|error| Failure::Input(format!("--resume: {error}; nothing was changed")))?;
    } else {
        course.see(flow);
        course.see_profile(flow);
    }
    under.begin()?;
    if fresh {
        picture(under, flow, 0)?;
    }
    let bar = Bar::new(&under.scene.name);
    while flow.time() < end * (1.0 - 1e-9) && !course.steps.rest() {
        // Steps end at the instants of the tables, whenever a run was begun or resumed.
        let next = (flow.time() / end * FRONTS + 1e-6).floor() + 1.0;
        let step = flow.step((next / FRONTS * end).min(end)).map_err(failure)?;
        let (at_rest, volume_error) = (flow.is_at_rest(&step), flow.volume_drift());
        course
            .steps
            .book(&step, at_rest, flow.units(), volume_error);
        if (flow.time() / end * FRONTS - next).abs() < 1e-6 {
            course.see(flow);
            if (next * PROFILES / FRONTS).fract() < 1e-6 {
                course.see_profile(flow);
                picture(under, flow, next as u64)?;
            }
        }
        bar.set(flow.time() / end);
        let speed = step.max_speed * flow.units().velocity;
        bar.say(&format!("{:.3} s, {speed:.3} m/s", flow.time()));
        under.checkpoint("flow", || course.record(flow.state()))?;
    }
    bar.clear();
    course.see(flow);
    Ok(course)
}

/// Joins the fields of a run that has come to its end (s).
pub(super) fn join<const D: usize, const C: usize>(
    flow: &impl Followed<D, C>,
    end: f64,
    under: &Under,
) -> Result<(), Failure> {
    join_pictures(under, flow.time() / end, |last| picture(under, flow, last))
}

/// Writes the fields at an instant.
fn picture<const D: usize, const C: usize>(
    under: &Under,
    flow: &impl Followed<D, C>,
    instant: u64,
) -> Result<(), Failure> {
    frames::put(
        under.directory.path(),
        frames::FIELDS,
        instant,
        flow.frame(),
    )
}

/// What every summary of such a run begins with: model, cost and state.
pub(super) fn summary<const D: usize, const C: usize>(
    flow: &impl Followed<D, C>,
    course: &Course,
    left_out: &[&str],
    under: &Under,
    wall_s: f64,
) -> Summary {
    let mut summary = Summary::begun(&under.scene.name, "run");
    let state = flow.state();
    let [_, cell_steps] = course.steps.work();
    summary.model = Model {
        grains: 0,
        cells: state.fractions.len() as u64,
        dt_s: course.steps.last.dt * flow.units().time(),
        dt_limit: "courant, with solver.largest_step_scaled".into(),
        left_out: left_out.iter().copied().map(String::from).collect(),
    };
    summary.cost = Cost::measured(wall_s, under.threads, 0, cell_steps);
    summary.ledger.mass_relative = flow.volume_drift();
    let mut arrays = vec![state.fractions.as_slice()];
    arrays.extend(state.velocity.iter().map(Vec::as_slice));
    arrays.push(&state.pressure);
    summary.state_hash = state_hash::of(&arrays);
    summary
}

/// Says what the steps were.
pub(super) fn describe_steps<const D: usize, const C: usize>(
    summary: &mut Summary,
    flow: &impl Followed<D, C>,
    course: &Course,
    strain_rate_floor: f64,
) {
    let units = flow.units();
    course.steps.describe(
        summary,
        course.steps.last.max_speed * units.velocity,
        strain_rate_floor / units.time(),
    );
}

/// Says which shares of the material flowed, flowed where the equations are ill posed, and flowed faster than the law was
/// measured for.
pub(super) fn describe_shares(summary: &mut Summary, course: &Course, law: &RheologyKeys) {
    let largest = |number: usize| {
        let all = course.shares.iter().map(|s| s[number]);
        Quantity::new(all.fold(0.0, f64::max), "1")
    };
    summary.put(
        "largest_flowing_share",
        largest(0).from("of the volume, at any instant of flowing.csv"),
    );
    summary.put(
        "largest_ill_posed_share",
        largest(1).from("of the volume: flows where short waves grow without bound"),
    );
    let Some([_, fastest]) = law.valid_inertial_numbers() else {
        return;
    };
    let beyond = largest(2);
    let share = beyond.value.unwrap_or(0.0);
    if share > 0.0 {
        summary.remarks.push(format!(
            "Outside the calibration: the rheology was measured for I up to {fastest:.4}; at the instant of flowing.csv where most \
             of it does, {:.1} % of the material's volume flows faster.",
            100.0 * share
        ));
    }
    summary.put(
        "largest_beyond_calibration_share",
        beyond.from("of the volume: flows with I above rheology.valid_i"),
    );
}

/// What a deposit's rest or creep is told from.
pub(super) struct Deposit {
    /// Which number of a row is its greatest height (m).
    pub height: usize,
    /// Speed (m/s) below which everything is at rest.
    pub rest_speed: f64,
    /// Whether the material bears shear at rest: without a yield stress every slope creeps.
    pub yields: bool,
}

/// Whether a law has a yield stress.
pub(super) fn yields(law: &impl ShearLaw) -> bool {
    law.friction_limits()[0] > 0.0 || law.cohesion() > 0.0
}

/// Instants over which the fall of a top is taken.
const FALL: usize = 10;

/// Says when a run came to rest and what rest is, or how fast the deposit of a law without yield stress creeps.
pub(super) fn describe_rest<const D: usize, const C: usize>(
    summary: &mut Summary,
    flow: &impl Followed<D, C>,
    course: &Course,
    deposit: &Deposit,
) {
    let rests = course.steps.rest();
    let time = if rests { flow.time() } else { f64::NAN };
    summary.put(
        "time_of_rest",
        Quantity::new(time, "s").from("speeds below 5 ε height; null where the run ended before"),
    );
    let unit = flow.units().velocity;
    if rests {
        summary.put(
            "rest_speed",
            Quantity::new(deposit.rest_speed, "m/s").from("at rest all speeds are below it"),
        );
        summary.remarks.push(format!(
            "At rest: speeds below {:.2e} m/s, {:.1e} √(gravity height).",
            deposit.rest_speed,
            deposit.rest_speed / unit
        ));
    }
    if deposit.yields {
        return;
    }
    let speed = course.steps.last.max_speed * unit;
    let fall = course.fall(deposit.height);
    for (name, value, what) in [
        ("creep_speed", speed, "largest speed at the end"),
        (
            "top_fall_rate",
            fall,
            "of the greatest height, over the last ten instants of front.csv",
        ),
    ] {
        summary.put(name, Quantity::new(value, "m/s").from(what));
        summary.put(
            &format!("{name}_scaled"),
            Quantity::new(value / unit, "1").from("over √(gravity height)"),
        );
    }
    summary.remarks.push(format!(
        "This law has no yield stress, so every slope of the deposit creeps for ever: at the end of the run its fastest \
         material moves with {speed:.2e} m/s, {:.1e} √(gravity height), and its top falls with {fall:.2e} m/s, {:.1e} \
         √(gravity height). Under a law with a yield stress all below {:.1e} m/s would count as at rest.",
        speed / unit,
        fall / unit,
        deposit.rest_speed
    ));
}
