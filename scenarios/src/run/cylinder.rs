//! The collapse of a cylinder in space: from the scene to front and deposit.

use super::bagnold::failure;
use super::collapse::options_of;
use super::surface_fields::SurfaceFields;
use super::surface_steps::{FRONTS, PROFILES, Steps, columns, join_pictures, put_state, state_of};
use super::{Findings, Under};
use crate::cost::Cost;
use crate::failure::Failure;
use crate::frames;
use crate::progress::Bar;
use crate::scene::{CylinderScene, Scene};
use crate::state_hash;
use crate::summary::{Model, Quantity, Summary};
use crate::table::Table;
use crate::vtkhdf::{Cells, Frame};
use colluvium_continuum::cylinder_collapse::{CylinderCase, CylinderCollapse, CylinderFront};
use colluvium_continuum::free_surface::{SpaceFields, SpaceState};
use colluvium_continuum::strain::deviator;
use colluvium_dem::Record;

/// What the continuum leaves out.
pub const LEFT_OUT: [&str; 4] = [
    "grains",
    "air",
    "dilatancy (constant solid fraction)",
    "non-local effects near the base",
];

/// The case that a scene describes.
pub fn case(scene: &CylinderScene) -> CylinderCase {
    CylinderCase {
        aspect: scene.aspect,
        height: scene.height,
        gravity: scene.gravity,
        rheology: scene.rheology.mu_i(),
        cells: scene.cells(),
        length_scaled: scene.grid.length_scaled,
        whole: scene.grid.whole,
    }
}

/// Checks the case and the settings before anything is written.
pub(super) fn check(scene: &Scene, body: &CylinderScene) -> Result<(), Failure> {
    let named =
        |error: colluvium_continuum::Error| Failure::Input(format!("{}: {error}", scene.origin));
    case(body).validate().map_err(named)?;
    options_of(&body.solver).validate().map_err(named)
}

/// What was found on the way, beside the state.
#[derive(Clone, Debug, Default, PartialEq)]
struct Course {
    fronts: Vec<CylinderFront>,
    /// Time, distance from the axis and height, row by row.
    profiles: [Vec<f64>; 3],
    /// Largest asymmetry at any instant of the front.
    asymmetry: f64,
    steps: Steps,
}

impl Course {
    /// Takes the front down, once an instant: a run may end at one that was just seen.
    fn see_front(&mut self, collapse: &CylinderCollapse, threshold: f64) {
        let front = collapse.front(threshold);
        if self.fronts.last().is_none_or(|last| last.time < front.time) {
            self.fronts.push(front);
        }
        self.asymmetry = self.asymmetry.max(collapse.asymmetry());
    }

    fn see_profile(&mut self, collapse: &CylinderCollapse) {
        let (r, h) = collapse.profile();
        let [times, distances, heights] = &mut self.profiles;
        times.extend(std::iter::repeat_n(collapse.time(), r.len()));
        distances.extend(r);
        heights.extend(h);
    }

    fn record(&self, state: &SpaceState) -> Record {
        let mut record = Record::default();
        let rows = |f: &CylinderFront| [f.time, f.radius, f.along_axis, f.along_diagonal, f.height];
        for (name, values) in [
            ("course/fronts", self.fronts.iter().flat_map(rows).collect()),
            ("course/profiles", self.profiles.concat()),
            ("course/asymmetry", vec![self.asymmetry]),
        ] {
            record.numbers.insert(name.to_owned(), values);
        }
        self.steps.put_into(&mut record);
        put_state(state, &mut record);
        record
    }

    fn restored(record: &Record) -> Option<(Course, SpaceState)> {
        let numbers = |name: &str| record.numbers.get(name);
        let fronts = numbers("course/fronts")?.as_chunks().0.iter();
        let front =
            |&[time, radius, along_axis, along_diagonal, height]: &[f64; 5]| CylinderFront {
                time,
                radius,
                along_axis,
                along_diagonal,
                height,
            };
        let course = Course {
            fronts: fronts.map(front).collect(),
            profiles: columns(numbers("course/profiles")?),
            asymmetry: *numbers("course/asymmetry")?.first()?,
            steps: Steps::of(record)?,
        };
        Some((course, state_of(record)?))
    }
}

pub(super) fn run(scene: &CylinderScene, under: &mut Under) -> Result<Findings, Failure> {
    let mut collapse = CylinderCollapse::new(&case(scene), &options_of(&scene.solver))
        .map_err(|error| Failure::Input(format!("{}: {error}", under.scene.origin)))?;
    let end = scene.duration_scaled * collapse.units().time();
    let threshold = scene.front_height_scaled * scene.height;
    let mut course = Course::default();
    let fresh = under.resumed.is_none();
    if let Some(checkpoint) = &under.resumed {
        let damaged =
            || Failure::Input("--resume: the checkpoint misses a part; nothing was changed".into());
        let (before, state) = Course::restored(&checkpoint.record).ok_or_else(damaged)?;
        course = before;
        collapse
            .set_state(state)
            .map_err(|error| Failure::Input(format!("--resume: {error}; nothing was changed")))?;
    } else {
        course.see_front(&collapse, threshold);
        course.see_profile(&collapse);
    }
    under.begin()?;
    if fresh {
        picture(under, &collapse, 0)?;
    }
    let bar = Bar::new(&under.scene.name);
    while collapse.time() < end * (1.0 - 1e-9) && !course.steps.rest() {
        // Steps end at the instants of the tables, whenever a run was begun or resumed.
        let next = (collapse.time() / end * FRONTS + 1e-6).floor() + 1.0;
        let step = collapse
            .step((next / FRONTS * end).min(end))
            .map_err(failure)?;
        course.steps.book(&step, collapse.is_at_rest(&step));
        if (collapse.time() / end * FRONTS - next).abs() < 1e-6 {
            course.see_front(&collapse, threshold);
            if (next * PROFILES / FRONTS).fract() < 1e-6 {
                course.see_profile(&collapse);
                picture(under, &collapse, next as u64)?;
            }
        }
        bar.set(collapse.time() / end);
        bar.say(&format!("{:.3} s", collapse.time()));
        under.checkpoint("flow", || course.record(collapse.flow().state()))?;
    }
    bar.clear();
    let wall_s = under.wall_s();
    course.see_front(&collapse, threshold);
    join_pictures(under, collapse.time() / end, |last| {
        picture(under, &collapse, last)
    })?;
    let mut summary = Summary::begun(&under.scene.name, "run");
    describe(&mut summary, scene, &collapse, &course, wall_s);
    Ok(Findings {
        summary,
        tables: tables(&collapse, &course),
        grains: None,
    })
}

/// Writes the fields at an instant of the front.
fn picture(under: &Under, collapse: &CylinderCollapse, instant: u64) -> Result<(), Failure> {
    let frame = frame(collapse);
    frames::put(under.directory.path(), frames::FIELDS, instant, frame)
}

/// The cells with material as hexahedra, with the fields over them. The deviatoric stress, positive in tension,
/// has τ_zz = −τ_xx − τ_yy.
pub fn frame(collapse: &CylinderCollapse) -> Frame {
    let cells = collapse.fields();
    let law = collapse.rheology();
    let fields = SurfaceFields {
        cells: &cells,
        inertia: law.diameter * law.grain_density.sqrt(),
        others: 0,
    };
    let stresses = vec![
        fields.scalars("deviatoric_stress_xx", "Pa", &|c| deviator(c.stress)[0]),
        fields.scalars("deviatoric_stress_yy", "Pa", &|c| deviator(c.stress)[1]),
        fields.scalars("shear_stress_xy", "Pa", &|c| c.stress[2]),
        fields.scalars("shear_stress_xz", "Pa", &|c| c.stress[3]),
        fields.scalars("shear_stress_yz", "Pa", &|c| c.stress[4]),
    ];
    Frame {
        time: collapse.time(),
        cells: Cells::Hexahedra,
        points: cells.iter().flat_map(corners).collect(),
        fields: fields.all(|velocity| velocity, stresses),
    }
}

/// Corners of a cell: round its base, then round its top.
fn corners(cell: &SpaceFields) -> [[f64; 3]; 8] {
    let ([x0, y0, z0], [x1, y1, z1]) = (cell.lower, cell.upper);
    let round = |z: f64| [[x0, y0, z], [x1, y0, z], [x1, y1, z], [x0, y1, z]];
    let ([a, b, c, d], [e, f, g, h]) = (round(z0), round(z1));
    [a, b, c, d, e, f, g, h]
}

fn tables(collapse: &CylinderCollapse, course: &Course) -> Vec<Table> {
    let (r, h) = collapse.profile();
    let column = |of: &dyn Fn(&CylinderFront) -> f64| course.fronts.iter().map(of).collect();
    let [times, distances, heights] = course.profiles.clone();
    vec![
        Table::new("front")
            .with("t", "s", column(&|f| f.time))
            .with("r_front", "m", column(&|f| f.radius))
            .with("height", "m", column(&|f| f.height))
            .with("r_axis", "m", column(&|f| f.along_axis))
            .with("r_diagonal", "m", column(&|f| f.along_diagonal)),
        Table::new("deposit").with("r", "m", r).with("h", "m", h),
        Table::new("profiles")
            .with("t", "s", times)
            .with("r", "m", distances)
            .with("h", "m", heights),
    ]
}

fn describe(
    summary: &mut Summary,
    scene: &CylinderScene,
    collapse: &CylinderCollapse,
    course: &Course,
    wall_s: f64,
) {
    let units = collapse.units();
    let state = collapse.flow().state();
    let [steps, cell_steps] = course.steps.work();
    summary.model = Model {
        grains: 0,
        cells: state.fractions.len() as u64,
        dt_s: course.steps.last.dt * units.time(),
        dt_limit: "courant, with solver.largest_step_scaled".into(),
        left_out: LEFT_OUT.map(String::from).to_vec(),
    };
    summary.cost = Cost::measured(wall_s, 1, 0, cell_steps);
    summary.ledger.mass_relative = collapse.volume_drift();
    let [u, v, w] = &state.velocity;
    summary.state_hash = state_hash::of(&[&state.fractions, u, v, w, &state.pressure]);
    summary.remarks.extend(scene.rheology.remarks());
    let front = course.fronts.last().copied().unwrap_or_default();
    let radius = case(scene).radius();
    let runout = front.radius / radius - 1.0;
    let memory = summary.cost.peak_memory_bytes as f64;
    let mut put = |name: &str, value: f64, unit: &str, source: &str| {
        summary.put(name, Quantity::new(value, unit).from(source));
    };
    put(
        "r_front",
        front.radius,
        "m",
        "radius of the disc of the area where the heap is front_height_scaled high",
    );
    put(
        "runout_scaled",
        runout,
        "1",
        "(r_front − radius)/radius; experiments 1.24 aspect (Lube et al. 2004, aspect < 1.7), 1.35 aspect (Lajeunesse et al. 2004)",
    );
    put(
        "runout_over_aspect",
        runout / scene.aspect,
        "1",
        "experiments 1.24 and 1.35",
    );
    put(
        "deposit_height",
        front.height,
        "m",
        "greatest height at the end",
    );
    put(
        "anisotropy",
        (front.along_diagonal - front.along_axis) / front.radius,
        "1",
        "how much farther the front is along the diagonal of the grid than along its axes",
    );
    put(
        "symmetry_error",
        course.asymmetry,
        "1",
        "largest difference of a cell's fraction from that of its mirror images, at any instant of front.csv",
    );
    put(
        "volume_error",
        collapse.volume_drift(),
        "1",
        "volume gained since the start",
    );
    put(
        "time_of_rest",
        if course.steps.rest() {
            collapse.time()
        } else {
            f64::NAN
        },
        "s",
        "speeds below 5 ε height; null where the run ended before",
    );
    let cells = cell_steps as f64 / steps.max(1) as f64;
    put("cells_with_pressure", cells, "1", "mean of all steps");
    put(
        "time_per_cell_step",
        wall_s / cell_steps.max(1) as f64,
        "s",
        "wall time over steps times cells with a pressure",
    );
    put(
        "memory_per_cell",
        memory / cells.max(1.0),
        "1",
        "bytes: peak memory of the process over cells with a pressure",
    );
    course.steps.describe(
        summary,
        course.steps.last.max_speed * units.velocity,
        scene.solver.strain_rate_floor / units.time(),
    );
    let (r, _) = collapse.profile();
    let farthest = front.along_axis.max(front.radius);
    if farthest >= r.last().copied().unwrap_or(0.0) {
        summary.remarks.push(
            "The heap reached the end of the grid: grid.length_scaled is too small for its run-out."
                .into(),
        );
    }
}
