//! The collapse of a cylinder in space: from the scene to front and deposit.

use super::collapse::options_of;
use super::collapse_ground::contact;
use super::surface_fields::{self, space_frame};
use super::surface_run::{self, Course, Deposit, Followed, yields};
use super::{Findings, Under, cylinder_ground};
use crate::failure::Failure;
use crate::scene::{CylinderScene, Scene};
use crate::summary::{Quantity, Summary};
use crate::table::Table;
use crate::vtkhdf::Frame;
use colluvium_continuum::Error;
use colluvium_continuum::cylinder_collapse::{CylinderCase, CylinderCollapse};
use colluvium_continuum::free_surface::{SpaceState, SurfaceStep};
use colluvium_continuum::strain::SPACE_COMPONENTS;
use colluvium_continuum::units::Units;

/// What the continuum leaves out.
pub const LEFT_OUT: [&str; 4] = [
    "grains",
    "air",
    "dilatancy (constant solid fraction)",
    "non-local effects near the base",
];

/// What the asymmetry is.
const MIRRORED: &str = "largest difference of a cell's fraction from that of its mirror images, at any instant of front.csv";

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
        floor: contact(scene.floor.contact, scene.floor.friction),
    }
}

/// Checks the case and the settings before anything is written.
pub(super) fn check(scene: &Scene, body: &CylinderScene) -> Result<(), Failure> {
    let named =
        |error: colluvium_continuum::Error| Failure::Input(format!("{}: {error}", scene.origin));
    case(body).validate().map_err(named)?;
    options_of(&body.solver).validate().map_err(named)?;
    // Ground shows whether it fits when the grid is cut.
    if body.terrain.is_some() {
        begun(body, &scene.origin)?;
    }
    Ok(())
}

/// The cylinder before it is let go.
fn begun(scene: &CylinderScene, origin: &str) -> Result<CylinderCollapse, Failure> {
    let (case, options) = (case(scene), options_of(&scene.solver));
    match cylinder_ground::ground(scene, origin)? {
        Some(ground) => CylinderCollapse::over_ground(&case, &options, &ground),
        None => CylinderCollapse::new(&case, &options),
    }
    .map_err(|error| Failure::Input(format!("{origin}: {error}")))
}

/// A collapse as a run follows it.
struct Falling<'a> {
    collapse: CylinderCollapse,
    scene: &'a CylinderScene,
}

impl Followed<3, SPACE_COMPONENTS> for Falling<'_> {
    fn units(&self) -> &Units {
        self.collapse.units()
    }

    fn time(&self) -> f64 {
        self.collapse.time()
    }

    fn state(&self) -> &SpaceState {
        self.collapse.flow().state()
    }

    fn set_state(&mut self, state: SpaceState) -> Result<(), Error> {
        self.collapse.set_state(state)
    }

    fn step(&mut self, until: f64) -> Result<SurfaceStep, Error> {
        self.collapse.step(until)
    }

    fn is_at_rest(&self, step: &SurfaceStep) -> bool {
        yields(self.collapse.rheology()) && self.collapse.is_at_rest(step)
    }

    fn volume_drift(&self) -> f64 {
        self.collapse.volume_drift()
    }

    fn profile(&self) -> (Vec<f64>, Vec<f64>) {
        self.collapse.profile()
    }

    /// The front, and the asymmetry; over ground the reach along x and y instead of that along axis and diagonal.
    fn row(&self) -> Vec<f64> {
        let scene = self.scene;
        let threshold = scene.front_height_scaled * scene.height;
        let f = self.collapse.front(threshold);
        let asymmetry = self.collapse.asymmetry();
        if scene.terrain.is_some() {
            let radius = (self.collapse.covered_area(threshold) / std::f64::consts::PI).sqrt();
            let [[x_low, x_high], [y_low, y_high]] = self.collapse.reach(threshold);
            let height = self.collapse.heights().into_iter().fold(0.0, f64::max);
            return vec![
                f.time, radius, x_low, x_high, height, asymmetry, y_low, y_high,
            ];
        }
        vec![
            f.time,
            f.radius,
            f.along_axis,
            f.along_diagonal,
            f.height,
            asymmetry,
        ]
    }

    fn shares(&self) -> [f64; 3] {
        surface_fields::shares(&self.collapse.fields(), &self.scene.rheology)
    }

    fn frame(&self) -> Frame {
        frame(&self.collapse)
    }

    fn ground(&self) -> Vec<f64> {
        self.collapse.ground_heights().to_vec()
    }
}

pub(super) fn run(scene: &CylinderScene, under: &mut Under) -> Result<Findings, Failure> {
    let collapse = begun(scene, &under.scene.origin)?;
    let end = scene.duration_scaled * collapse.units().time();
    let mut falling = Falling { collapse, scene };
    let course = surface_run::follow(&mut falling, end, under)?;
    let wall_s = under.wall_s();
    surface_run::join(&falling, end, under)?;
    let mut summary = surface_run::summary(&falling, &course, &LEFT_OUT, under, wall_s);
    describe(&mut summary, &falling, &course, wall_s);
    Ok(Findings {
        summary,
        tables: tables(&falling.collapse, &course),
        grains: None,
    })
}

/// The cells with material as hexahedra, with the fields over them.
pub fn frame(collapse: &CylinderCollapse) -> Frame {
    let (ground, law) = (collapse.ground_blocks(), collapse.rheology());
    space_frame(&collapse.fields(), &ground, law, collapse.time())
}

fn tables(collapse: &CylinderCollapse, course: &Course) -> Vec<Table> {
    let (r, h) = collapse.profile();
    let column = |number: usize| course.column(number);
    if !collapse.ground_heights().is_empty() {
        return tables_over_ground(collapse, course);
    }
    vec![
        Table::new("front")
            .with("t", "s", column(0))
            .with("r_front", "m", column(1))
            .with("height", "m", column(4))
            .with("r_axis", "m", column(2))
            .with("r_diagonal", "m", column(3)),
        Table::new("deposit").with("r", "m", r).with("h", "m", h),
        course.profiles("r"),
        course.flowing(),
        course.steps.all.table(),
    ]
}

/// The tables of a heap that need not be round: its reach, rings with the ground's height beside its own, and the heights
/// of all columns of cells at the end.
fn tables_over_ground(collapse: &CylinderCollapse, course: &Course) -> Vec<Table> {
    let (r, h) = collapse.profile();
    let ground = collapse.ground_profile();
    let profiles = course.profiles("r");
    let instants = profiles.rows() / ground.len().max(1);
    let middles = collapse.middles();
    let [x, y]: [Vec<f64>; 2] = [
        middles.iter().flat_map(|_| middles.clone()).collect(),
        middles
            .iter()
            .flat_map(|y| vec![*y; middles.len()])
            .collect(),
    ];
    vec![
        Table::new("front")
            .with("t", "s", course.column(0))
            .with("r_front", "m", course.column(1))
            .with("height", "m", course.column(4))
            .with("x_low", "m", course.column(2))
            .with("x_high", "m", course.column(3))
            .with("y_low", "m", course.column(6))
            .with("y_high", "m", course.column(7)),
        Table::new("deposit")
            .with("r", "m", r)
            .with("h", "m", h)
            .with("z_ground", "m", ground.clone()),
        profiles.with("z_ground", "m", ground.repeat(instants)),
        Table::new("map")
            .with("x", "m", x)
            .with("y", "m", y)
            .with("z_ground", "m", collapse.ground_heights().to_vec())
            .with("h", "m", collapse.heights()),
        course.flowing(),
        course.steps.all.table(),
    ]
}

fn describe(summary: &mut Summary, falling: &Falling, course: &Course, wall_s: f64) {
    let Falling { collapse, scene } = falling;
    let [steps, cell_steps] = course.steps.work();
    summary.remarks.extend(scene.rheology.remarks());
    let last = course.last().unwrap_or(&[0.0; 8]);
    let [_, front, along_axis, along_diagonal, height, _] = std::array::from_fn(|k| last[k]);
    let radius = case(scene).radius();
    let runout = front / radius - 1.0;
    let memory = summary.cost.peak_memory_bytes as f64;
    let mut put = |name: &str, value: f64, unit: &str, source: &str| {
        summary.put(name, Quantity::new(value, unit).from(source));
    };
    put(
        "r_front",
        front,
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
    put("deposit_height", height, "m", "greatest height at the end");
    if let Some(terrain) = &scene.terrain {
        let reach = [along_axis, along_diagonal, last[6], last[7]];
        for (name, place) in ["x_low", "x_high", "y_low", "y_high"].iter().zip(reach) {
            put(
                name,
                place,
                "m",
                "how far the heap is front_height_scaled high at the end",
            );
        }
        if terrain.is_radial() {
            put("symmetry_error", course.largest(5), "1", MIRRORED);
        }
    } else {
        put(
            "anisotropy",
            (along_diagonal - along_axis) / front,
            "1",
            "how much farther the front is along the diagonal of the grid than along its axes",
        );
        put("symmetry_error", course.largest(5), "1", MIRRORED);
    }
    put(
        "volume_error",
        collapse.volume_drift(),
        "1",
        "volume gained since the start",
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
    surface_run::describe_shares(summary, course, &scene.rheology);
    let deposit = Deposit {
        height: 4,
        rest_speed: collapse.rest_speed(),
        yields: yields(collapse.rheology()),
    };
    surface_run::describe_rest(summary, falling, course, &deposit);
    surface_run::describe_steps(summary, falling, course, scene.solver.strain_rate_floor);
    let (r, _) = collapse.profile();
    let farthest = match scene.terrain {
        Some(_) => last[2..4]
            .iter()
            .chain(&last[6..8])
            .fold(0.0_f64, |most, x| most.max(x.abs())),
        None => along_axis.max(front),
    };
    let end = match scene.terrain {
        // The middle of the outermost column is the farthest that a heap can be seen.
        Some(_) => {
            let length = scene.grid.length_scaled * scene.height;
            length - 0.51 * length / scene.cells() as f64
        }
        None => r.last().copied().unwrap_or(0.0),
    };
    if farthest >= end {
        summary.remarks.push(
            "The heap reached the end of the grid: grid.length_scaled is too small for its run-out."
                .into(),
        );
    }
}
