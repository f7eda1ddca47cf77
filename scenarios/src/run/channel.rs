//! The collapse of a column in a channel, in space: from the scene to front and deposit.

use super::collapse::{self, options_of};
use super::collapse_ground::contact;
use super::surface_fields::{self, space_frame};
use super::surface_run::{self, Course, Deposit, Followed, yields};
use super::{Findings, Under};
use crate::failure::Failure;
use crate::scene::{CollapseScene, CollapseSolver};
use crate::summary::{Quantity, Summary};
use crate::table::Table;
use crate::vtkhdf::Frame;
use colluvium_continuum::Error;
use colluvium_continuum::channel_collapse::{ChannelCase, ChannelCollapse};
use colluvium_continuum::free_surface::{SpaceState, SurfaceOptions, SurfaceStep};
use colluvium_continuum::strain::SPACE_COMPONENTS;
use colluvium_continuum::units::Units;

/// What the continuum leaves out.
const LEFT_OUT: [&str; 4] = [
    "grains",
    "air",
    "dilatancy (constant solid fraction)",
    "non-local effects near walls",
];

/// The case that a scene describes, if it asks for a channel in space.
pub fn case(scene: &CollapseScene) -> Option<ChannelCase> {
    let walls = scene.side_walls.as_ref()?;
    let keys = scene.channel()?;
    Some(ChannelCase {
        column: collapse::case(scene, scene.rheology.mu_i()),
        width: walls.width,
        cells_across: scene.cells_across(keys),
        whole: keys.whole,
        walls: contact(keys.contact, Some(walls.friction)),
        floor: contact(keys.floor.contact, keys.floor.friction),
    })
}

/// A collapse as a run follows it.
struct Falling<'a> {
    collapse: ChannelCollapse,
    scene: &'a CollapseScene,
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

    /// The front of the mean profile, and those beside the wall and farthest from it.
    fn row(&self) -> Vec<f64> {
        let height = self.scene.front_height_scaled * self.scene.height;
        let f = self.collapse.front(height);
        let [at_wall, inside] = self.collapse.fronts_at_wall_and_inside(height);
        vec![f.time, f.position, f.height, at_wall, inside]
    }

    fn shares(&self) -> [f64; 3] {
        surface_fields::shares(&self.collapse.fields(), &self.scene.rheology)
    }

    fn frame(&self) -> Frame {
        let collapse = &self.collapse;
        space_frame(
            &collapse.fields(),
            &[],
            collapse.rheology(),
            collapse.time(),
        )
    }
}

/// Larger ones were measured in the plane only.
const LARGEST_COURANT: f64 = 0.45;

/// The solver's settings in space.
pub fn options(solver: &CollapseSolver) -> SurfaceOptions {
    let mut options = options_of(solver);
    options.courant = options.courant.min(LARGEST_COURANT);
    options
}

pub(super) fn run(scene: &CollapseScene, under: &mut Under) -> Result<Findings, Failure> {
    let refused = |error: Error| Failure::Input(format!("{}: {error}", under.scene.origin));
    let Some(case) = case(scene) else {
        return Err(Failure::Input(format!(
            "{}: key `side_walls.in_space` is missing",
            under.scene.origin
        )));
    };
    let collapse = ChannelCollapse::new(&case, &options(&scene.solver)).map_err(refused)?;
    let end = scene.duration_scaled * collapse.units().time();
    let mut falling = Falling { collapse, scene };
    let course = surface_run::follow(&mut falling, end, under)?;
    let wall_s = under.wall_s();
    surface_run::join(&falling, end, under)?;
    let mut summary = surface_run::summary(&falling, &course, &LEFT_OUT, under, wall_s);
    describe(&mut summary, &falling, &course);
    let (x, h) = falling.collapse.profile();
    let tables = vec![
        Table::new("front")
            .with("t", "s", course.column(0))
            .with("x_front", "m", course.column(1))
            .with("height", "m", course.column(2))
            .with("x_at_wall", "m", course.column(3))
            .with("x_inside", "m", course.column(4)),
        Table::new("deposit").with("x", "m", x).with("h", "m", h),
        course.profiles("x"),
        course.flowing(),
        course.steps.all.table(),
    ];
    Ok(Findings {
        summary,
        tables,
        grains: None,
    })
}

fn describe(summary: &mut Summary, falling: &Falling, course: &Course) {
    let Falling { collapse, scene } = falling;
    summary.remarks.extend(scene.rheology.remarks());
    let last = course.last().unwrap_or(&[0.0; 5]);
    let width = scene.height / scene.aspect;
    for (name, value, unit, source) in [
        (
            "x_front",
            last[1],
            "m",
            "where the mean height across the channel is front_height_scaled",
        ),
        (
            "runout_scaled",
            (last[1] - width) / width,
            "1",
            "(x_front − width)/width",
        ),
        (
            "deposit_height",
            last[2],
            "m",
            "greatest height at the end, a mean across the channel",
        ),
        (
            "front_lag",
            last[4] - last[3],
            "m",
            "how far the front beside the wall is behind the one farthest from it",
        ),
        (
            "symmetry_error",
            collapse.asymmetry(),
            "1",
            "largest difference of a cell's fraction from that of its mirror image; 0 where half of the channel is computed",
        ),
        (
            "volume_error",
            collapse.volume_drift(),
            "1",
            "volume gained since the start",
        ),
    ] {
        summary.put(name, Quantity::new(value, unit).from(source));
    }
    surface_run::describe_shares(summary, course, &scene.rheology);
    let deposit = Deposit {
        height: 2,
        rest_speed: collapse.rest_speed(),
        yields: yields(collapse.rheology()),
    };
    surface_run::describe_rest(summary, falling, course, &deposit);
    surface_run::describe_steps(summary, falling, course, scene.solver.strain_rate_floor);
    let (x, _) = collapse.profile();
    if last[1] >= x.last().copied().unwrap_or(0.0) {
        summary.remarks.push(
            "The heap reached the end of the grid: grid.length_scaled is too small for its run-out.".into(),
        );
    }
}
