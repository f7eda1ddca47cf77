//! The collapse of a column: from the scene to front and deposit.

mod beside_continuum;

use super::surface_fields::{self, SurfaceFields, field};
use super::surface_run::{self, Course, Deposit, Followed, yields};
use super::{Findings, Under, channel, collapse_ground, joined_column, world};
use crate::failure::Failure;
use crate::scene::{CollapseModel, CollapseScene, CollapseSolver, Scene, ThinLayerKind};
use crate::summary::{Quantity, Summary};
use crate::table::Table;
use crate::vtkhdf::{Cells, Frame, Values};
use colluvium_continuum::Error;
use colluvium_continuum::column_collapse::{Collapse, CollapseCase};
use colluvium_continuum::free_surface::{SurfaceOptions, SurfaceState, SurfaceStep, ThinLayer};
use colluvium_continuum::rheology::AnyLaw;
use colluvium_continuum::units::Units;
use colluvium_continuum::wall_friction::{SideWalls, WallFriction};

/// What the continuum leaves out.
pub const LEFT_OUT: [&str; 5] = [
    "grains",
    "air",
    "dilatancy (constant solid fraction)",
    "the third dimension",
    "non-local effects near the base",
];

/// The case that a scene describes, of a material with this law.
pub fn case<L>(scene: &CollapseScene, rheology: L) -> CollapseCase<L> {
    CollapseCase {
        aspect: scene.aspect,
        height: scene.height,
        gravity: scene.gravity,
        rheology,
        cells: scene.cells(),
        length_scaled: scene.grid.length_scaled,
        overhang_degrees: scene.overhang_degrees,
    }
}

/// The side walls that a scene describes.
fn walls(scene: &CollapseScene) -> Option<SideWalls> {
    scene.side_walls.as_ref().map(|walls| SideWalls {
        width: walls.width,
        friction: WallFriction {
            friction: walls.friction,
            cohesion: 0.0,
        },
    })
}

/// The solver's settings that a scene describes.
pub fn options(scene: &CollapseScene) -> SurfaceOptions {
    options_of(&scene.solver)
}

/// The solver's settings.
pub(super) fn options_of(keys: &CollapseSolver) -> SurfaceOptions {
    let mut options = SurfaceOptions {
        courant: keys.courant,
        largest_step: keys.largest_step_scaled,
        thin_layer: match keys.thin_layer {
            ThinLayerKind::DepthAveraged => ThinLayer::DepthAveraged,
            ThinLayerKind::Frozen => ThinLayer::Frozen,
            ThinLayerKind::Following => ThinLayer::Following,
        },
        ..SurfaceOptions::default()
    };
    options.solver.strain_rate_floor = keys.strain_rate_floor;
    if let Some(tolerance) = keys.linear_tolerance {
        options.solver.linear_tolerance = tolerance;
    }
    options
}

/// Checks the case and the settings before anything is written.
pub(super) fn check(scene: &Scene, body: &CollapseScene) -> Result<(), Failure> {
    match body.model {
        CollapseModel::Dem => return world::course::check(scene, body),
        CollapseModel::Hybrid => return joined_column::check(scene, body),
        CollapseModel::Continuum => {}
    }
    let named =
        |error: colluvium_continuum::Error| Failure::Input(format!("{}: {error}", scene.origin));
    options(body).validate().map_err(named)?;
    if let Some(case) = channel::case(body) {
        return case.validate().map_err(named);
    }
    let case = case(body, body.rheology.any_law().map_err(named)?);
    case.validate().map_err(named)?;
    // Ground shows whether it fits when the grid is cut.
    if body.terrain.is_some() {
        begun(&case, body, &scene.origin)?;
    }
    Ok(())
}

/// The column before it is let go.
fn begun(
    case: &CollapseCase<AnyLaw>,
    scene: &CollapseScene,
    origin: &str,
) -> Result<Collapse<AnyLaw>, Failure> {
    let (options, walls) = (options(scene), walls(scene));
    match (collapse_ground::ground(scene, origin)?, walls) {
        (Some(ground), walls) => Collapse::over_ground(case, &options, &ground, walls),
        (None, None) => Collapse::new(case, &options),
        (None, Some(walls)) => Collapse::between_side_walls(case, &options, walls),
    }
    .map_err(|error| Failure::Input(format!("{origin}: {error}")))
}

/// A collapse as a run follows it.
struct Falling<'a> {
    collapse: Collapse<AnyLaw>,
    scene: &'a CollapseScene,
}

impl Followed<2, 2> for Falling<'_> {
    fn units(&self) -> &Units {
        self.collapse.units()
    }

    fn time(&self) -> f64 {
        self.collapse.time()
    }

    fn state(&self) -> &SurfaceState {
        self.collapse.flow().state()
    }

    fn set_state(&mut self, state: SurfaceState) -> Result<(), Error> {
        self.collapse.set_state(state)
    }

    fn step(&mut self, until: f64) -> Result<SurfaceStep, Error> {
        self.collapse.step(until)
    }

    fn is_at_rest(&self, step: &SurfaceStep) -> bool {
        // Without a yield stress what is slow still creeps, and how fast is to be seen.
        yields(self.collapse.rheology()) && self.collapse.is_at_rest(step)
    }

    fn volume_drift(&self) -> f64 {
        self.collapse.volume_drift()
    }

    fn profile(&self) -> (Vec<f64>, Vec<f64>) {
        self.collapse.profile()
    }

    /// The front.
    fn row(&self) -> Vec<f64> {
        let scene = self.scene;
        let f = self
            .collapse
            .front(scene.front_height_scaled * scene.height);
        vec![f.time, f.position, f.height]
    }

    fn shares(&self) -> [f64; 3] {
        surface_fields::shares(&self.collapse.fields(), &self.scene.rheology)
    }

    fn frame(&self) -> Frame {
        fields(self.scene, &self.collapse)
    }

    fn ground(&self) -> Vec<f64> {
        match self.scene.terrain {
            Some(_) => self.collapse.ground_heights(),
            None => Vec::new(),
        }
    }
}

pub(super) fn run(scene: &CollapseScene, under: &mut Under) -> Result<Findings, Failure> {
    if scene.model == CollapseModel::Dem {
        let mut findings = world::course::run(scene, under)?;
        beside_continuum::set_beside(scene, &mut findings, under)?;
        return Ok(findings);
    }
    if scene.model == CollapseModel::Hybrid {
        return joined_column::run(scene, under);
    }
    if scene.channel().is_some() {
        return channel::run(scene, under);
    }
    let law = scene.rheology.any_law();
    let law = law.map_err(|error| Failure::Input(format!("{}: {error}", under.scene.origin)))?;
    let collapse = begun(&case(scene, law), scene, &under.scene.origin)?;
    let end = scene.duration_scaled * collapse.units().time();
    let mut falling = Falling { collapse, scene };
    let course = surface_run::follow(&mut falling, end, under)?;
    let wall_s = under.wall_s();
    surface_run::join(&falling, end, under)?;
    let mut summary = surface_run::summary(&falling, &course, &LEFT_OUT, under, wall_s);
    describe(&mut summary, &falling, &course);
    Ok(Findings {
        summary,
        tables: tables(&falling.collapse, &course),
        grains: None,
    })
}

/// Cells with material as quadrilaterals in the plane y = 0, then the ground under each column of cells
/// if there is any.
fn fields(scene: &CollapseScene, collapse: &Collapse<AnyLaw>) -> Frame {
    let cells = collapse.fields();
    let grains = &scene.rheology;
    let outline = collapse.ground_outline();
    let fields = SurfaceFields {
        cells: &cells,
        inertia: grains.diameter * grains.grain_density.sqrt(),
        others: outline.len(),
    };
    let ground = outline.iter().flatten().map(|&[x, z]| [x, 0.0, z]);
    let mut frame = Frame {
        time: collapse.time(),
        cells: Cells::Quadrilaterals,
        points: fields.quadrilaterals().chain(ground).collect(),
        fields: fields.of_plane(),
    };
    if !outline.is_empty() {
        let material = std::iter::repeat_n(0, cells.len());
        let is_ground = material.chain(std::iter::repeat_n(1, outline.len()));
        let values = Values::Counts(is_ground.collect());
        frame.fields.push(field("ground", "1", values));
    }
    frame
}

fn tables(collapse: &Collapse<AnyLaw>, course: &Course) -> Vec<Table> {
    let (x, h) = collapse.profile();
    // On ground, its height beside the depth of the material on it.
    let on_ground = |table: Table| {
        if course.ground.is_empty() {
            return table;
        }
        let instants = table.rows() / course.ground.len();
        table.with("z_ground", "m", course.ground.repeat(instants))
    };
    vec![
        Table::new("front")
            .with("t", "s", course.column(0))
            .with("x_front", "m", course.column(1))
            .with("height", "m", course.column(2)),
        on_ground(Table::new("deposit").with("x", "m", x).with("h", "m", h)),
        on_ground(course.profiles("x")),
        course.flowing(),
        course.steps.all.table(),
    ]
}

fn describe(summary: &mut Summary, falling: &Falling, course: &Course) {
    let Falling { collapse, scene } = falling;
    summary.remarks.extend(scene.rheology.remarks());
    let last = course.last().unwrap_or(&[0.0; 3]);
    let [front, height] = [last[1], last[2]];
    let width = scene.height / scene.aspect;
    let mut put = |name: &str, value: f64, unit: &str, source: &str| {
        summary.put(name, Quantity::new(value, unit).from(source));
    };
    put(
        "x_front",
        front,
        "m",
        "where the heap is front_height_scaled high",
    );
    put(
        "runout_scaled",
        (front - width) / width,
        "1",
        "(x_front − width)/width",
    );
    put("deposit_height", height, "m", "greatest height at the end");
    surface_run::describe_shares(summary, course, &scene.rheology);
    let deposit = Deposit {
        height: 2,
        rest_speed: collapse.rest_speed(),
        yields: yields(collapse.rheology()),
    };
    surface_run::describe_rest(summary, falling, course, &deposit);
    surface_run::describe_steps(summary, falling, course, scene.solver.strain_rate_floor);
    let (x, _) = collapse.profile();
    if front >= x.last().copied().unwrap_or(0.0) {
        summary.remarks.push(
            "The heap reached the end of the grid: grid.length_scaled is too small for its run-out.".into(),
        );
    }
}
