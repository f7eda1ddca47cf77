//! The collapse of a column: from the scene to front and deposit.

mod beside_continuum;

use super::bagnold::failure;
use super::surface_fields::{SurfaceFields, field};
use super::surface_steps::{FRONTS, PROFILES, Steps, columns, join_pictures, put_state, state_of};
use super::{Findings, Under, collapse_ground, joined_column, world};
use crate::cost::Cost;
use crate::failure::Failure;
use crate::frames;
use crate::progress::Bar;
use crate::scene::{
    CollapseModel, CollapseScene, CollapseSolver, LawVisitor, Scene, ThinLayerKind,
};
use crate::state_hash;
use crate::summary::{Model, Quantity, Summary};
use crate::table::Table;
use crate::vtkhdf::{Cells, Frame, Values};
use colluvium_continuum::column_collapse::{Collapse, CollapseCase, Front};
use colluvium_continuum::free_surface::{SurfaceOptions, SurfaceState, SurfaceStep, ThinLayer};
use colluvium_continuum::rheology::ShearLaw;
use colluvium_continuum::wall_friction::{SideWalls, WallFriction};
use colluvium_dem::Record;

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
    let check = Check {
        scene: body,
        origin: &scene.origin,
    };
    body.rheology.visit_law(check).map_err(named)?
}

/// Checks the case with its law.
struct Check<'a> {
    scene: &'a CollapseScene,
    origin: &'a str,
}

impl LawVisitor for Check<'_> {
    type Output = Result<(), Failure>;

    fn visit<L: ShearLaw + Clone>(self, law: L) -> Self::Output {
        let case = case(self.scene, law);
        case.validate()
            .map_err(|error| Failure::Input(format!("{}: {error}", self.origin)))?;
        // Ground shows whether it fits when the grid is cut.
        if self.scene.terrain.is_some() {
            begun(&case, self.scene, self.origin)?;
        }
        Ok(())
    }
}

/// The column before it is let go.
fn begun<L: ShearLaw + Clone>(
    case: &CollapseCase<L>,
    scene: &CollapseScene,
    origin: &str,
) -> Result<Collapse<L>, Failure> {
    let (options, walls) = (options(scene), walls(scene));
    match (collapse_ground::ground(scene, origin)?, walls) {
        (Some(ground), walls) => Collapse::over_ground(case, &options, &ground, walls),
        (None, None) => Collapse::new(case, &options),
        (None, Some(walls)) => Collapse::between_side_walls(case, &options, walls),
    }
    .map_err(|error| Failure::Input(format!("{origin}: {error}")))
}

/// What was found on the way, beside the state.
#[derive(Clone, Debug, Default, PartialEq)]
struct Course {
    /// Heights of the ground under the columns of cells; none on a level floor.
    ground: Vec<f64>,
    fronts: Vec<Front>,
    /// Time, position and height, row by row.
    profiles: [Vec<f64>; 3],
    /// Time, share of the volume that flows, and that flows where the equations are ill posed.
    flowing: [Vec<f64>; 3],
    steps: Steps,
}

impl Course {
    /// Takes the front down, once an instant: a run may end at one that was just seen.
    fn see_front<L: ShearLaw + Clone>(&mut self, collapse: &Collapse<L>, threshold: f64) {
        let front = collapse.front(threshold);
        if self.fronts.last().is_none_or(|last| last.time < front.time) {
            self.fronts.push(front);
            let [flows, ill] = collapse.flowing_shares();
            for (column, value) in self.flowing.iter_mut().zip([front.time, flows, ill]) {
                column.push(value);
            }
        }
    }

    fn see_profile<L: ShearLaw + Clone>(&mut self, collapse: &Collapse<L>) {
        let (x, h) = collapse.profile();
        let [times, positions, heights] = &mut self.profiles;
        times.extend(std::iter::repeat_n(collapse.time(), x.len()));
        positions.extend(x);
        heights.extend(h);
    }

    fn record(&self, state: &SurfaceState) -> Record {
        let mut record = Record::default();
        let mut put = |name: &str, values: Vec<f64>| {
            record.numbers.insert(name.to_owned(), values);
        };
        if !self.ground.is_empty() {
            put("ground", self.ground.clone());
        }
        let fronts = self.fronts.iter();
        put(
            "course/fronts",
            fronts
                .flat_map(|f| [f.time, f.position, f.height])
                .collect(),
        );
        put("course/profiles", self.profiles.concat());
        put("course/flowing", self.flowing.concat());
        self.steps.put_into(&mut record);
        put_state(state, &mut record);
        record
    }

    fn restored(record: &Record) -> Option<(Course, SurfaceState)> {
        let numbers = |name: &str| record.numbers.get(name).cloned();
        let fronts = numbers("course/fronts")?;
        let profiles = numbers("course/profiles")?;
        let flowing = numbers("course/flowing")?;
        let course = Course {
            ground: numbers("ground").unwrap_or_default(),
            fronts: fronts
                .chunks_exact(3)
                .map(|f| Front {
                    time: f[0],
                    position: f[1],
                    height: f[2],
                })
                .collect(),
            profiles: columns(&profiles),
            flowing: columns(&flowing),
            steps: Steps::of(record)?,
        };
        Some((course, state_of(record)?))
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
    let origin = under.scene.origin.clone();
    let law = &scene.rheology;
    law.visit_law(Run { scene, under })
        .map_err(|error| Failure::Input(format!("{origin}: {error}")))?
}

/// Computes the collapse of a material with its law.
struct Run<'a, 'b, 'c> {
    scene: &'a CollapseScene,
    under: &'b mut Under<'c>,
}

impl LawVisitor for Run<'_, '_, '_> {
    type Output = Result<Findings, Failure>;

    fn visit<L: ShearLaw + Clone>(self, law: L) -> Self::Output {
        continuum(&case(self.scene, law), self.scene, self.under)
    }
}

fn continuum<L: ShearLaw + Clone>(
    case: &CollapseCase<L>,
    scene: &CollapseScene,
    under: &mut Under,
) -> Result<Findings, Failure> {
    let mut collapse = begun(case, scene, &under.scene.origin)?;
    let unit = collapse.units().time();
    let end = scene.duration_scaled * unit;
    let threshold = scene.front_height_scaled * scene.height;
    let mut course = Course::default();
    if scene.terrain.is_some() {
        course.ground = collapse.ground_heights();
    }
    if let Some(checkpoint) = &under.resumed {
        let damaged =
            || Failure::Input("--resume: the checkpoint misses a part; nothing was changed".into());
        let (before, state) = Course::restored(&checkpoint.record).ok_or_else(damaged)?;
        if before.ground != course.ground {
            return Err(Failure::Input(
                "--resume: the file of the terrain has other heights than when the run was begun; nothing was changed".into(),
            ));
        }
        course = before;
        collapse
            .set_state(state)
            .map_err(|error| Failure::Input(format!("--resume: {error}; nothing was changed")))?;
    } else {
        course.see_front(&collapse, threshold);
        course.see_profile(&collapse);
    }
    let fresh = under.resumed.is_none();
    under.begin()?;
    if fresh {
        picture(under, scene, &collapse, 0)?;
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
                picture(under, scene, &collapse, next as u64)?;
            }
        }
        bar.set(collapse.time() / end);
        bar.say(&format!(
            "{:.3} s, {:.3} m/s",
            collapse.time(),
            speed(&collapse, &step)
        ));
        under.checkpoint("flow", || course.record(collapse.flow().state()))?;
    }
    bar.clear();
    let wall_s = under.wall_s();
    course.see_front(&collapse, threshold);
    join_pictures(under, collapse.time() / end, |last| {
        picture(under, scene, &collapse, last)
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
fn picture<L: ShearLaw + Clone>(
    under: &Under,
    scene: &CollapseScene,
    collapse: &Collapse<L>,
    instant: u64,
) -> Result<(), Failure> {
    let frame = fields(scene, collapse);
    frames::put(under.directory.path(), frames::FIELDS, instant, frame)
}

/// Cells with material as quadrilaterals in the plane y = 0, then the ground under each column of cells
/// if there is any.
fn fields<L: ShearLaw + Clone>(scene: &CollapseScene, collapse: &Collapse<L>) -> Frame {
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

fn speed<L: ShearLaw + Clone>(collapse: &Collapse<L>, step: &SurfaceStep) -> f64 {
    step.max_speed * collapse.units().velocity
}

fn tables<L: ShearLaw + Clone>(collapse: &Collapse<L>, course: &Course) -> Vec<Table> {
    let (x, h) = collapse.profile();
    let fronts = &course.fronts;
    let [times, positions, heights] = &course.profiles;
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
            .with("t", "s", fronts.iter().map(|f| f.time).collect())
            .with("x_front", "m", fronts.iter().map(|f| f.position).collect())
            .with("height", "m", fronts.iter().map(|f| f.height).collect()),
        on_ground(Table::new("deposit").with("x", "m", x).with("h", "m", h)),
        on_ground(
            Table::new("profiles")
                .with("t", "s", times.clone())
                .with("x", "m", positions.clone())
                .with("h", "m", heights.clone()),
        ),
        Table::new("flowing")
            .with("t", "s", course.flowing[0].clone())
            .with("flowing_share", "1", course.flowing[1].clone())
            .with("ill_posed_share", "1", course.flowing[2].clone()),
    ]
}

fn describe<L: ShearLaw + Clone>(
    summary: &mut Summary,
    scene: &CollapseScene,
    collapse: &Collapse<L>,
    course: &Course,
    wall_s: f64,
) {
    let units = collapse.units();
    let state = collapse.flow().state();
    let [_, cell_steps] = course.steps.work();
    summary.model = Model {
        grains: 0,
        cells: state.fractions.len() as u64,
        dt_s: course.steps.last.dt * units.time(),
        dt_limit: "courant, with solver.largest_step_scaled".into(),
        left_out: LEFT_OUT.map(String::from).to_vec(),
    };
    summary.cost = Cost::measured(wall_s, 1, 0, cell_steps);
    summary.ledger.mass_relative = collapse.volume_drift();
    summary.state_hash = state_hash::of(&[
        &state.fractions,
        &state.velocity[0],
        &state.velocity[1],
        &state.pressure,
    ]);
    summary.remarks.extend(scene.rheology.remarks());
    let front = course.fronts.last().copied().unwrap_or_default();
    let width = scene.height / scene.aspect;
    let mut put = |name: &str, value: f64, unit: &str, source: &str| {
        summary.put(name, Quantity::new(value, unit).from(source));
    };
    put(
        "x_front",
        front.position,
        "m",
        "where the heap is front_height_scaled high",
    );
    put(
        "runout_scaled",
        (front.position - width) / width,
        "1",
        "(x_front − width)/width",
    );
    put(
        "deposit_height",
        front.height,
        "m",
        "greatest height at the end",
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
    let [_, flowing, ill_posed] = &course.flowing;
    let most = |shares: &[f64]| shares.iter().copied().fold(0.0, f64::max);
    put(
        "largest_flowing_share",
        most(flowing),
        "1",
        "of the volume, at any instant of flowing.csv",
    );
    put(
        "largest_ill_posed_share",
        most(ill_posed),
        "1",
        "of the volume: flows where short waves grow without bound, C(I) > 0",
    );
    course.steps.describe(
        summary,
        speed(collapse, &course.steps.last),
        scene.solver.strain_rate_floor / units.time(),
    );
    let (x, _) = collapse.profile();
    if front.position >= x.last().copied().unwrap_or(0.0) {
        summary.remarks.push(
            "The heap reached the end of the grid: grid.length_scaled is too small for its run-out.".into(),
        );
    }
}
