//! A chute that is fed and open: from the scene to depths, speeds and the balance of volume.

use super::bagnold::failure;
use super::collapse::options_of;
use super::surface_fields::SurfaceFields;
use super::surface_steps::{
    FRONTS, PROFILES, Steps, columns, join_pictures, put_passed, put_state, state_with_passed,
};
use super::{Findings, Under};
use crate::cost::Cost;
use crate::failure::Failure;
use crate::frames;
use crate::progress::Bar;
use crate::scene::{LawVisitor, OpenChuteScene, Scene};
use crate::state_hash;
use crate::summary::{Model, Quantity, Summary};
use crate::table::Table;
use crate::vtkhdf::{Cells, Frame};
use colluvium_continuum::free_surface::SurfaceState;
use colluvium_continuum::open_chute::{Feed, OpenChute, OpenChuteCase};
use colluvium_continuum::rheology::ShearLaw;
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
fn case<L>(scene: &OpenChuteScene, rheology: L) -> OpenChuteCase<L> {
    OpenChuteCase {
        slope: scene.slope_degrees.to_radians(),
        depth: scene.depth,
        gravity: scene.gravity,
        rheology,
        feed: match (scene.inflow.bagnold_factor, scene.inflow.speed) {
            (_, Some(speed)) => Feed::Plug(speed),
            (factor, None) => Feed::Bagnold(factor.unwrap_or(f64::NAN)),
        },
        cells: scene.cells(),
        length_scaled: scene.grid.length_scaled,
        room_scaled: scene.grid.room_scaled,
    }
}

/// Checks the case, and says how fast the surface of what enters is (m/s).
struct Check<'a> {
    scene: &'a OpenChuteScene,
    origin: &'a str,
}

impl LawVisitor for Check<'_> {
    type Output = Result<f64, Failure>;

    fn visit<L: ShearLaw + Clone>(self, law: L) -> Self::Output {
        let case = case(self.scene, law);
        case.validate()
            .map_err(|error| Failure::Input(format!("{}: {error}", self.origin)))?;
        Ok(case.speed(case.depth))
    }
}

/// Speed of the surface of what enters (m/s).
pub fn entering_speed(scene: &Scene, body: &OpenChuteScene) -> Result<f64, Failure> {
    let named =
        |error: colluvium_continuum::Error| Failure::Input(format!("{}: {error}", scene.origin));
    let check = Check {
        scene: body,
        origin: &scene.origin,
    };
    body.rheology.visit_law(check).map_err(named)?
}

/// Checks the case and the settings before anything is written.
pub(super) fn check(scene: &Scene, body: &OpenChuteScene) -> Result<(), Failure> {
    options_of(&body.solver)
        .validate()
        .map_err(|error| Failure::Input(format!("{}: {error}", scene.origin)))?;
    entering_speed(scene, body).map(drop)
}

/// What was found on the way, beside the state.
#[derive(Clone, Debug, Default, PartialEq)]
struct Course {
    /// Time, volume in the chute, and what has come in and gone out.
    balance: [Vec<f64>; 4],
    /// Time, distance from the upper end and depth, row by row.
    profiles: [Vec<f64>; 3],
    steps: Steps,
}

impl Course {
    /// Takes the volumes down, once an instant: a run may end at one that was just seen.
    fn see_balance<L: ShearLaw + Clone>(&mut self, chute: &OpenChute<L>) {
        let time = chute.time();
        if self.balance[0].last().is_none_or(|last| *last < time) {
            let [volume, entered, left] = chute.volumes();
            let row = [time, volume, entered, left];
            for (column, value) in self.balance.iter_mut().zip(row) {
                column.push(value);
            }
        }
    }

    fn see_profile<L: ShearLaw + Clone>(&mut self, chute: &OpenChute<L>) {
        let (x, h) = chute.profile();
        let [times, positions, depths] = &mut self.profiles;
        times.extend(std::iter::repeat_n(chute.time(), x.len()));
        positions.extend(x);
        depths.extend(h);
    }

    fn record(&self, state: &SurfaceState) -> Record {
        let mut record = Record::default();
        for (name, values) in [
            ("course/balance", self.balance.concat()),
            ("course/profiles", self.profiles.concat()),
        ] {
            record.numbers.insert(name.to_owned(), values);
        }
        self.steps.put_into(&mut record);
        put_state(state, &mut record);
        put_passed(state, &mut record);
        record
    }

    fn restored(record: &Record) -> Option<(Course, SurfaceState)> {
        let course = Course {
            balance: columns(record.numbers.get("course/balance")?),
            profiles: columns(record.numbers.get("course/profiles")?),
            steps: Steps::of(record)?,
        };
        Some((course, state_with_passed(record)?))
    }
}

pub(super) fn run(scene: &OpenChuteScene, under: &mut Under) -> Result<Findings, Failure> {
    let origin = under.scene.origin.clone();
    let law = &scene.rheology;
    law.visit_law(Run { scene, under })
        .map_err(|error| Failure::Input(format!("{origin}: {error}")))?
}

/// Computes the flow of a material with its law.
struct Run<'a, 'b, 'c> {
    scene: &'a OpenChuteScene,
    under: &'b mut Under<'c>,
}

impl LawVisitor for Run<'_, '_, '_> {
    type Output = Result<Findings, Failure>;

    fn visit<L: ShearLaw + Clone>(self, law: L) -> Self::Output {
        flow(&case(self.scene, law), self.scene, self.under)
    }
}

fn flow<L: ShearLaw + Clone>(
    case: &OpenChuteCase<L>,
    scene: &OpenChuteScene,
    under: &mut Under,
) -> Result<Findings, Failure> {
    let mut chute = OpenChute::new(case, &options_of(&scene.solver))
        .map_err(|error| Failure::Input(format!("{}: {error}", under.scene.origin)))?;
    let end = scene.duration_scaled * chute.units().time();
    let mut course = Course::default();
    let fresh = under.resumed.is_none();
    if let Some(checkpoint) = &under.resumed {
        let damaged =
            || Failure::Input("--resume: the checkpoint misses a part; nothing was changed".into());
        let (before, state) = Course::restored(&checkpoint.record).ok_or_else(damaged)?;
        course = before;
        chute
            .set_state(state)
            .map_err(|error| Failure::Input(format!("--resume: {error}; nothing was changed")))?;
    } else {
        course.see_balance(&chute);
        course.see_profile(&chute);
    }
    under.begin()?;
    if fresh {
        picture(under, scene, &chute, 0)?;
    }
    let bar = Bar::new(&under.scene.name);
    while chute.time() < end * (1.0 - 1e-9) {
        // Steps end at the instants of the tables, whenever a run was begun or resumed.
        let next = (chute.time() / end * FRONTS + 1e-6).floor() + 1.0;
        let step = chute
            .step((next / FRONTS * end).min(end))
            .map_err(failure)?;
        course.steps.book(&step, false);
        if (chute.time() / end * FRONTS - next).abs() < 1e-6 {
            course.see_balance(&chute);
            if (next * PROFILES / FRONTS).fract() < 1e-6 {
                course.see_profile(&chute);
                picture(under, scene, &chute, next as u64)?;
            }
        }
        bar.set(chute.time() / end);
        bar.say(&format!("{:.3} s", chute.time()));
        under.checkpoint("flow", || course.record(chute.flow().state()))?;
    }
    bar.clear();
    let wall_s = under.wall_s();
    course.see_balance(&chute);
    join_pictures(under, chute.time() / end, |last| {
        picture(under, scene, &chute, last)
    })?;
    let mut summary = Summary::begun(&under.scene.name, "run");
    describe(&mut summary, (case, scene), &chute, &course, wall_s);
    Ok(Findings {
        summary,
        tables: tables(case, &chute, &course),
        grains: None,
    })
}

/// Writes the fields at an instant of the balance, cells with material as quadrilaterals: x along the chute, z
/// normal to it.
fn picture<L: ShearLaw + Clone>(
    under: &Under,
    scene: &OpenChuteScene,
    chute: &OpenChute<L>,
    instant: u64,
) -> Result<(), Failure> {
    let cells = chute.fields();
    let grains = &scene.rheology;
    let fields = SurfaceFields {
        cells: &cells,
        inertia: grains.diameter * grains.grain_density.sqrt(),
        others: 0,
    };
    let frame = Frame {
        time: chute.time(),
        cells: Cells::Quadrilaterals,
        points: fields.quadrilaterals().collect(),
        fields: fields.of_plane(),
    };
    frames::put(under.directory.path(), frames::FIELDS, instant, frame)
}

fn tables<L: ShearLaw + Clone>(
    case: &OpenChuteCase<L>,
    chute: &OpenChute<L>,
    course: &Course,
) -> Vec<Table> {
    let [time, volume, entered, left] = course.balance.clone();
    let [times, positions, depths] = course.profiles.clone();
    let (z, u) = chute.speeds();
    let steady: Option<Vec<f64>> = z.iter().map(|&z| case.steady_speed(z)).collect();
    let mut speeds = Table::new("speeds").with("z", "m", z).with("u", "m/s", u);
    if let Some(steady) = steady {
        speeds = speeds.with("u_steady", "m/s", steady);
    }
    vec![
        Table::new("balance")
            .with("t", "s", time)
            .with("volume", "m²", volume)
            .with("entered", "m²", entered)
            .with("left", "m²", left),
        Table::new("profiles")
            .with("t", "s", times)
            .with("x", "m", positions)
            .with("h", "m", depths),
        speeds,
    ]
}

fn describe<L: ShearLaw + Clone>(
    summary: &mut Summary,
    (case, scene): (&OpenChuteCase<L>, &OpenChuteScene),
    chute: &OpenChute<L>,
    course: &Course,
    wall_s: f64,
) {
    let units = chute.units();
    let state = chute.flow().state();
    let [_, cell_steps] = course.steps.work();
    summary.model = Model {
        grains: 0,
        cells: state.fractions.len() as u64,
        dt_s: course.steps.last.dt * units.time(),
        dt_limit: "courant, with solver.largest_step_scaled".into(),
        left_out: LEFT_OUT.map(String::from).to_vec(),
    };
    summary.cost = Cost::measured(wall_s, 1, 0, cell_steps);
    summary.ledger.mass_relative = chute.volume_drift();
    let [u, w] = &state.velocity;
    summary.state_hash = state_hash::of(&[&state.fractions, u, w, &state.pressure]);
    summary.remarks.extend(scene.rheology.remarks());
    let mut put = |name: &str, value: f64, unit: &str, source: &str| {
        summary.put(name, Quantity::new(value, unit).from(source));
    };
    let [volume, entered, left] = chute.volumes();
    put("volume", volume, "m²", "in the chute, per width");
    put("entered", entered, "m²", "since the start, per width");
    put("left", left, "m²", "since the start, per width");
    put(
        "volume_error",
        chute.volume_drift(),
        "1",
        "gained beside what came in and went out, over what was there and came in",
    );
    let (_, depths) = chute.profile();
    put(
        "depth_at_end",
        depths.last().copied().unwrap_or(0.0),
        "m",
        "in the last column before the open end",
    );
    let (z, u) = chute.speeds();
    put(
        "surface_speed",
        u.last().copied().unwrap_or(0.0),
        "m/s",
        "in the uppermost cell half way down",
    );
    let steady: Option<Vec<f64>> = z.iter().map(|&z| case.steady_speed(z)).collect();
    if let Some(steady) = steady {
        let miss: f64 = u.iter().zip(&steady).map(|(u, s)| (u - s) * (u - s)).sum();
        let size: f64 = steady.iter().map(|s| s * s).sum();
        put(
            "velocity_from_steady",
            (miss / size).sqrt(),
            "1",
            "relative L2 distance half way down from the steady profile of a layer as deep as what enters",
        );
    }
    course.steps.describe(
        summary,
        course.steps.last.max_speed * units.velocity,
        scene.solver.strain_rate_floor / units.time(),
    );
    let room = scene.grid.room_scaled * scene.depth;
    let deepest = depths.iter().fold(0.0_f64, |most, h| most.max(*h));
    if deepest > room - 2.0 * scene.depth / scene.cells() as f64 {
        summary.remarks.push(
            "The layer reached the top of the grid, which is a smooth wall: grid.room_scaled is too small.".into(),
        );
    }
}
