//! The layer of an incline as continuum alone: the same mass, the same start and the same time as of the grains.

use super::joined_incline::{self, findings, keys};
use super::precheck::stand_in_bed;
use super::steady_layer::failure;
use super::step_table::StepTable;
use super::{Findings, Under, incline};
use crate::cost::Cost;
use crate::failure::Failure;
use crate::progress::Bar;
use crate::scene::{InclineScene, RheologyKeys, Scene};
use crate::state_hash;
use crate::summary::{Model, Quantity, Summary};
use crate::table::Table;
use colluvium_continuum::column::{Column, ColumnCase};
use colluvium_continuum::grid::Boundary;
use colluvium_continuum::rheology::MuI;
use colluvium_continuum::yield_step::FlowState;
use colluvium_coupling::overlap::joined_incline::ContinuumRow;
use colluvium_dem::{Record, Threads};

/// What is not computed.
pub const LEFT_OUT: [&str; 5] = [
    "grains",
    "granular temperature",
    "dilatancy (constant solid fraction)",
    "air",
    "non-local effects near the base",
];

/// Strain-rate floor of the yield step, in √(g/H).
const STRAIN_RATE_FLOOR: f64 = 1e-6;

/// Cells and time steps.
#[derive(Clone, Copy, Debug)]
pub struct Grid {
    /// Depth of the layer (m).
    pub depth: f64,
    /// Cells across it.
    pub cells: usize,
    /// Steps of the run.
    pub steps: u64,
    /// Time step (s).
    pub step: f64,
}

/// The grid that a scene asks for: cells and steps of the overlap's.
pub fn grid(scene: &Scene, body: &InclineScene) -> Result<Grid, Failure> {
    let settings = joined_incline::resolved(scene, body)?;
    let depth = body.continuum_depth(keys(body)?.0);
    let time = body.time.relax + body.time.average;
    let steps = (time / settings.exchange_time).ceil().max(1.0);
    Ok(Grid {
        depth,
        cells: (depth / settings.cell).round() as usize,
        steps: steps as u64,
        step: time / steps,
    })
}

fn column(
    body: &InclineScene,
    rheology: &RheologyKeys,
    grid: &Grid,
) -> Result<Column<MuI>, colluvium_continuum::Error> {
    let slope = body.slope_degrees.to_radians();
    let case = ColumnCase {
        length: grid.depth,
        cells: grid.cells,
        acceleration: [body.gravity * slope.sin(), -body.gravity * slope.cos()],
        ends: [Boundary::NoSlip { velocity: 0.0 }, Boundary::FreeSurface],
        rheology: rheology.mu_i(),
        strain_rate_floor: STRAIN_RATE_FLOOR,
    };
    let mut column = case.begin()?;
    let spec = incline::spec(body, &stand_in_bed(body), Threads::Serial);
    if let Some(flow) = spec.starting_flow(grid.depth) {
        for k in 0..grid.cells {
            column.set_velocity(k, flow((k as f64 + 0.5) * column.spacing()));
        }
    }
    Ok(column)
}

/// Checks the case before anything is written.
pub(super) fn check(scene: &Scene, body: &InclineScene) -> Result<(), Failure> {
    let grid = grid(scene, body)?;
    let made = column(body, keys(body)?.0, &grid);
    made.map(drop)
        .map_err(|error| Failure::Input(format!("{}: {error}", scene.origin)))
}

/// What is summed up beside the state: u, p, τ by cell, samples, and rows (t, mean and surface velocity, and the shares that have yielded
/// and that have yielded where the equations are ill posed).
#[derive(Clone, Debug, Default)]
struct Course {
    sums: Vec<f64>,
    samples: u64,
    steps: u64,
    history: Vec<[f64; 5]>,
    all: StepTable,
}

impl Course {
    fn see(&mut self, column: &Column<MuI>, time: f64, measures: bool) {
        let cells = column.cells();
        let velocities = (0..cells).map(|k| column.velocity(k));
        let mean = velocities.sum::<f64>() / cells as f64;
        let [flows, ill_posed] = column.yielded_and_ill_posed();
        let surface = column.velocity(cells - 1);
        self.history.push([time, mean, surface, flows, ill_posed]);
        for part in column.parts() {
            self.all.book_layer(part, column.units());
        }
        if !measures {
            return;
        }
        for (k, sums) in self.sums.chunks_exact_mut(3).enumerate() {
            sums[0] += column.velocity(k);
            sums[1] += column.cell_pressure(k);
            sums[2] += 0.5 * (column.shear_stress(k) + column.shear_stress(k + 1));
        }
        self.samples += 1;
    }

    fn rows(&self, spacing: f64) -> Vec<ContinuumRow> {
        let samples = self.samples.max(1) as f64;
        let cells = self.sums.chunks_exact(3).enumerate();
        cells
            .map(|(k, sums)| ContinuumRow {
                z: (k as f64 + 0.5) * spacing,
                u: sums[0] / samples,
                p: sums[1] / samples,
                tau: sums[2] / samples,
                is_copy: false,
            })
            .collect()
    }

    fn record(&self, column: &Column<MuI>) -> Record {
        let (state, time) = column.state();
        let mut record = Record::default();
        let mut put = |name: &str, values: Vec<f64>| {
            record.numbers.insert(name.to_owned(), values);
        };
        put("flow/u", state.u.clone());
        put("flow/p", state.p.clone());
        put("flow/s", state.s.iter().flatten().copied().collect());
        put("flow/time", vec![time]);
        put("course/sums", self.sums.clone());
        put("course/history", self.history.as_flattened().to_vec());
        let counts = vec![self.samples, self.steps];
        record.counts.insert("course/counts".into(), counts);
        self.all.put_into(&mut record);
        record
    }

    fn restored(record: &Record, column: &mut Column<MuI>) -> Result<Course, String> {
        let &[samples, steps] = record.counts("course/counts")? else {
            return Err("array `course/counts` must have 2 numbers".into());
        };
        let &[time] = record.numbers("flow/time")? else {
            return Err("array `flow/time` must have 1 number".into());
        };
        let state = FlowState {
            u: record.numbers("flow/u")?.to_vec(),
            p: record.numbers("flow/p")?.to_vec(),
            s: record.numbers("flow/s")?.as_chunks::<2>().0.to_vec(),
        };
        column.take_up(state, time)?;
        let all =
            StepTable::of(record).ok_or("array `course/step_rows` is not ten numbers a step")?;
        let sums = record.numbers("course/sums")?.to_vec();
        if sums.len() != 3 * column.cells() {
            return Err("array `course/sums` is not three numbers a cell".into());
        }
        let history = record
            .numbers("course/history")?
            .as_chunks::<5>()
            .0
            .to_vec();
        Ok(Course {
            sums,
            samples,
            steps,
            history,
            all,
        })
    }
}

pub(super) fn run(scene: &InclineScene, under: &mut Under) -> Result<Findings, Failure> {
    let grid = grid(under.scene, scene)?;
    let rheology = keys(scene)?.0;
    let mut column = column(scene, rheology, &grid).map_err(failure)?;
    let mut course = Course {
        sums: vec![0.0; 3 * grid.cells],
        ..Course::default()
    };
    if let Some(saved) = &under.resumed {
        course = Course::restored(&saved.record, &mut column)
            .map_err(|why| Failure::Input(format!("--resume: {why}; nothing was changed")))?;
    }
    under.begin()?;
    let bar = Bar::new(&format!(
        "{}, continuum, at {} degrees",
        under.scene.name, scene.slope_degrees
    ));
    let nothing = vec![0.0; grid.cells + 1];
    while course.steps < grid.steps {
        column
            .step(grid.step, &nothing, &nothing[1..], [0.0; 2])
            .map_err(failure)?;
        course.steps += 1;
        let time = course.steps as f64 * grid.step;
        let measures = time > scene.time.relax;
        course.see(&column, time, measures);
        bar.set(course.steps as f64 / grid.steps as f64);
        under.checkpoint(incline::STAGE, || course.record(&column))?;
    }
    bar.clear();
    Ok(found((scene, rheology), &grid, &column, &course, under))
}

fn found(
    (scene, rheology): (&InclineScene, &RheologyKeys),
    grid: &Grid,
    column: &Column<MuI>,
    course: &Course,
    under: &Under,
) -> Findings {
    let mut summary = Summary::begun(&under.scene.name, "run");
    summary.model = Model {
        grains: 0,
        cells: grid.cells as u64,
        dt_s: grid.step,
        dt_limit: "none: the step is implicit; it is that of the overlap".into(),
        left_out: LEFT_OUT.map(String::from).to_vec(),
    };
    summary.cost = Cost::measured(under.wall_s(), 1, 0, grid.cells as u64 * grid.steps);
    let (state, _) = column.state();
    summary.state_hash = state_hash::of(&[&state.u, &state.p]);
    let averaged = || {
        course
            .history
            .iter()
            .filter(|row| row[0] > scene.time.relax)
    };
    let mean = |at: usize| averaged().map(|row| row[at]).sum::<f64>() / averaged().count() as f64;
    let mut told = |name: &str, value: f64, unit: &str, source: &str| {
        summary.put(name, Quantity::new(value, unit).from(source));
    };
    told(
        "height",
        grid.depth,
        "m",
        "of all material at the density of [rheology]",
    );
    told("mean_velocity", mean(1), "m/s", "over the averaging time");
    told(
        "surface_velocity",
        mean(2),
        "m/s",
        "of the uppermost cell, over the averaging time",
    );
    let [first, last] =
        [averaged().next(), averaged().next_back()].map(|r| r.map_or(f64::NAN, |r| r[1]));
    told(
        "drift",
        last / first - 1.0,
        "1",
        "of the mean velocity over the averaging time",
    );
    told(
        "residual",
        column.residual(),
        "1",
        "of momentum in the last step, over gravity",
    );
    let largest = |at: usize| course.history.iter().map(|row| row[at]).fold(0.0, f64::max);
    told(
        "largest_flowing_share",
        largest(3),
        "1",
        "of the volume, at any instant of history.csv",
    );
    told(
        "largest_ill_posed_share",
        largest(4),
        "1",
        "of the volume: has yielded where short waves grow without bound, C(I) > 0",
    );
    summary.remarks.extend(rheology.remarks());
    let profile = course.rows(column.spacing());
    let rows = |at: usize| course.history.iter().map(|row| row[at]).collect();
    Findings {
        summary,
        tables: vec![
            findings::continuum_table("profile", scene, rheology, &profile),
            Table::new("history")
                .with("t", "s", rows(0))
                .with("mean_velocity", "m/s", rows(1))
                .with("surface_velocity", "m/s", rows(2))
                .with("flowing_share", "1", rows(3))
                .with("ill_posed_share", "1", rows(4)),
            course.all.table(),
        ],
        grains: None,
    }
}
