//! A chute that is fed and open: from the scene to depths, speeds and the balance of volume.

use super::channel;
use super::collapse::options_of;
use super::collapse_ground::contact;
use super::surface_fields::{self, SurfaceFields};
use super::surface_run::{self, Course, Followed};
use super::{Findings, Under};
use crate::failure::Failure;
use crate::scene::{OpenChuteScene, Scene};
use crate::summary::{Quantity, Summary};
use crate::table::Table;
use crate::vtkhdf::{Cells, Frame};
use colluvium_continuum::Error;
use colluvium_continuum::free_surface::{SurfaceOptions, SurfaceState, SurfaceStep};
use colluvium_continuum::open_chute::{Across, Feed, OpenChute, OpenChuteCase, Sides, SpaceChute};
use colluvium_continuum::rheology::AnyLaw;
use colluvium_continuum::units::Units;

/// What the continuum leaves out.
const LEFT_OUT: [&str; 5] = [
    "grains",
    "air",
    "dilatancy (constant solid fraction)",
    "the third dimension",
    "non-local effects near the base",
];
/// The same in space.
const LEFT_OUT_IN_SPACE: [&str; 4] = [
    "grains",
    "air",
    "dilatancy (constant solid fraction)",
    "non-local effects near the base and walls",
];

/// What the continuum of a scene leaves out.
pub fn left_out(scene: &OpenChuteScene) -> &'static [&'static str] {
    match scene.in_space {
        None => &LEFT_OUT,
        Some(_) => &LEFT_OUT_IN_SPACE,
    }
}

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

/// What the chute of a scene is across, if it is in space.
pub fn across(scene: &OpenChuteScene) -> Option<Across> {
    let keys = scene.in_space.as_ref()?;
    Some(Across {
        breadth: keys.breadth,
        cells: scene.cells_across(keys),
        whole: keys.whole || keys.walls.is_none(),
        sides: match &keys.walls {
            Some(walls) => Sides::Walls(contact(walls.contact, walls.friction)),
            None => Sides::Periodic,
        },
    })
}

/// The solver's settings.
pub fn options(scene: &OpenChuteScene) -> SurfaceOptions {
    match scene.in_space {
        None => options_of(&scene.solver),
        Some(_) => channel::options(&scene.solver),
    }
}

/// Speed of the surface of what enters (m/s).
pub fn entering_speed(scene: &Scene, body: &OpenChuteScene) -> Result<f64, Failure> {
    let named =
        |error: colluvium_continuum::Error| Failure::Input(format!("{}: {error}", scene.origin));
    let case = case(body, body.rheology.any_law().map_err(named)?);
    let across = across(body).map_or(Ok(()), |across| across.validate());
    case.validate().and(across).map_err(named)?;
    Ok(case.speed(case.depth))
}

/// Checks the case and the settings before anything is written.
pub(super) fn check(scene: &Scene, body: &OpenChuteScene) -> Result<(), Failure> {
    options(body)
        .validate()
        .map_err(|error| Failure::Input(format!("{}: {error}", scene.origin)))?;
    entering_speed(scene, body).map(drop)
}

/// A chute as a run follows it.
struct Fed<'a, const D: usize, const C: usize, const V: usize> {
    chute: OpenChute<AnyLaw, D, C, V>,
    scene: &'a OpenChuteScene,
}

/// What a chute shows in a plane and in space.
trait Shown {
    /// Cells with material, x along the chute and z normal to it, with their fields; d √ρ_s of the grains is given.
    fn frame(&self, inertia: f64) -> Frame;
    /// How far it is from its mirror image, if all of its breadth is computed.
    fn asymmetry(&self) -> Option<f64>;
}

impl Shown for OpenChute<AnyLaw> {
    fn frame(&self, inertia: f64) -> Frame {
        let cells = self.fields();
        let fields = SurfaceFields::of_material(&cells, inertia);
        Frame {
            time: self.time(),
            cells: Cells::Quadrilaterals,
            points: fields.quadrilaterals().collect(),
            fields: fields.of_plane(),
        }
    }

    fn asymmetry(&self) -> Option<f64> {
        None
    }
}

impl Shown for SpaceChute<AnyLaw> {
    fn frame(&self, inertia: f64) -> Frame {
        let cells = self.fields();
        let fields = SurfaceFields::of_material(&cells, inertia);
        fields.of_space(&[], self.time())
    }

    fn asymmetry(&self) -> Option<f64> {
        self.is_whole().then(|| self.flow().asymmetry_across())
    }
}

impl<const D: usize, const C: usize, const V: usize> Followed<D, C> for Fed<'_, D, C, V>
where
    OpenChute<AnyLaw, D, C, V>: Shown,
{
    fn units(&self) -> &Units {
        self.chute.units()
    }

    fn time(&self) -> f64 {
        self.chute.time()
    }

    fn state(&self) -> &SurfaceState<D, C> {
        self.chute.flow().state()
    }

    fn set_state(&mut self, state: SurfaceState<D, C>) -> Result<(), Error> {
        self.chute.set_state(state)
    }

    fn step(&mut self, until: f64) -> Result<SurfaceStep, Error> {
        self.chute.step(until)
    }

    fn is_at_rest(&self, _: &SurfaceStep) -> bool {
        false
    }

    fn volume_drift(&self) -> f64 {
        self.chute.volume_drift()
    }

    fn profile(&self) -> (Vec<f64>, Vec<f64>) {
        self.chute.profile()
    }

    /// Volume in the chute, and what has come in and gone out.
    fn row(&self) -> Vec<f64> {
        let [volume, entered, left] = self.chute.volumes();
        vec![self.chute.time(), volume, entered, left]
    }

    fn shares(&self) -> [f64; 3] {
        surface_fields::shares(&self.chute.fields(), &self.scene.rheology)
    }

    fn frame(&self) -> Frame {
        let grains = &self.scene.rheology;
        self.chute
            .frame(grains.diameter * grains.grain_density.sqrt())
    }
}

pub(super) fn run(scene: &OpenChuteScene, under: &mut Under) -> Result<Findings, Failure> {
    let origin = under.scene.origin.clone();
    let refused = |error: Error| Failure::Input(format!("{origin}: {error}"));
    let law = scene.rheology.any_law().map_err(refused)?;
    let (case, options) = (case(scene, law), options(scene));
    match across(scene) {
        None => {
            let chute = OpenChute::new(&case, &options).map_err(refused)?;
            flow(chute, &case, scene, under)
        }
        Some(across) => {
            let chute = SpaceChute::in_space(&case, &across, &options).map_err(refused)?;
            flow(chute, &case, scene, under)
        }
    }
}

fn flow<const D: usize, const C: usize, const V: usize>(
    chute: OpenChute<AnyLaw, D, C, V>,
    case: &OpenChuteCase<AnyLaw>,
    scene: &OpenChuteScene,
    under: &mut Under,
) -> Result<Findings, Failure>
where
    OpenChute<AnyLaw, D, C, V>: Shown,
{
    let end = scene.duration_scaled * chute.units().time();
    let mut fed = Fed { chute, scene };
    let course = surface_run::follow(&mut fed, end, under)?;
    let wall_s = under.wall_s();
    surface_run::join(&fed, end, under)?;
    let mut summary = surface_run::summary(&fed, &course, left_out(scene), under, wall_s);
    describe(&mut summary, case, &fed, &course);
    Ok(Findings {
        summary,
        tables: tables(case, &fed.chute, &course),
        grains: None,
    })
}

fn tables<const D: usize, const C: usize, const V: usize>(
    case: &OpenChuteCase<AnyLaw>,
    chute: &OpenChute<AnyLaw, D, C, V>,
    course: &Course,
) -> Vec<Table> {
    let (z, u) = chute.speeds();
    let steady: Option<Vec<f64>> = z.iter().map(|&z| case.steady_speed(z)).collect();
    let mut speeds = Table::new("speeds").with("z", "m", z).with("u", "m/s", u);
    if let Some(steady) = steady {
        speeds = speeds.with("u_steady", "m/s", steady);
    }
    vec![
        Table::new("balance")
            .with("t", "s", course.column(0))
            .with("volume", "m²", course.column(1))
            .with("entered", "m²", course.column(2))
            .with("left", "m²", course.column(3)),
        course.profiles("x"),
        speeds,
        course.flowing(),
        course.steps.all.table(),
    ]
}

fn describe<const D: usize, const C: usize, const V: usize>(
    summary: &mut Summary,
    case: &OpenChuteCase<AnyLaw>,
    fed: &Fed<D, C, V>,
    course: &Course,
) where
    OpenChute<AnyLaw, D, C, V>: Shown,
{
    let Fed { chute, scene } = fed;
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
    if let Some(asymmetry) = chute.asymmetry() {
        put(
            "symmetry_error",
            asymmetry,
            "1",
            "largest difference of a cell's fraction from that of its mirror image across the chute",
        );
    }
    surface_run::describe_shares(summary, course, &scene.rheology);
    surface_run::describe_steps(summary, fed, course, scene.solver.strain_rate_floor);
    let room = scene.grid.room_scaled * scene.depth;
    let deepest = depths.iter().fold(0.0_f64, |most, h| most.max(*h));
    if deepest > room - 2.0 * scene.depth / scene.cells() as f64 {
        summary.remarks.push(
            "The layer reached the top of the grid, which is a smooth wall: grid.room_scaled is too small.".into(),
        );
    }
}
