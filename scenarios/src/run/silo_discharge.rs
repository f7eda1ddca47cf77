//! A silo that runs out as a continuum: from the scene to rates, profiles and the balance of volume.

use super::collapse::options_of;
use super::collapse_ground::contact;
use super::surface_fields::{self, SurfaceFields};
use super::surface_run::{self, Course, Followed};
use super::{Findings, Under};
use crate::failure::Failure;
use crate::scene::{Scene, SiloDischargeScene};
use crate::summary::{Quantity, Summary};
use crate::table::Table;
use crate::vtkhdf::{Cells, Frame};
use colluvium_continuum::Error;
use colluvium_continuum::free_surface::{SurfaceState, SurfaceStep};
use colluvium_continuum::rheology::AnyLaw;
use colluvium_continuum::silo::{Silo, SiloCase};
use colluvium_continuum::units::Units;

/// What the continuum leaves out.
pub const LEFT_OUT: [&str; 6] = [
    "grains",
    "air",
    "dilatancy (constant solid fraction)",
    "the third dimension",
    "non-local effects near the base and the walls",
    "the jet below the slot (no pressure on its plane)",
];

/// The case that a scene describes, of a material with this law.
fn case<L>(scene: &SiloDischargeScene, rheology: L) -> SiloCase<L> {
    SiloCase {
        width: scene.width,
        outlet: scene.outlet,
        height: scene.height,
        gravity: scene.gravity,
        rheology,
        cells: scene.cells(),
        walls: contact(scene.walls.contact, scene.walls.friction),
        floor: contact(scene.floor.contact, scene.floor.friction),
        whole: scene.grid.whole,
    }
}

/// The case without its material, once both are found good.
pub fn shape(scene: &Scene, body: &SiloDischargeScene) -> Result<SiloCase<()>, Failure> {
    let named = |error: Error| Failure::Input(format!("{}: {error}", scene.origin));
    let law = body.rheology.any_law().map_err(named)?;
    case(body, law).validate().map_err(named)?;
    Ok(case(body, ()))
}

/// Checks the case and the settings before anything is written.
pub(super) fn check(scene: &Scene, body: &SiloDischargeScene) -> Result<(), Failure> {
    options_of(&body.solver)
        .validate()
        .map_err(|error| Failure::Input(format!("{}: {error}", scene.origin)))?;
    shape(scene, body).map(drop)
}

/// A silo as a run follows it.
struct RunningOut<'a> {
    silo: Silo<AnyLaw>,
    scene: &'a SiloDischargeScene,
}

impl Followed<2, 2> for RunningOut<'_> {
    fn units(&self) -> &Units {
        self.silo.units()
    }

    fn time(&self) -> f64 {
        self.silo.time()
    }

    fn state(&self) -> &SurfaceState {
        self.silo.flow().state()
    }

    fn set_state(&mut self, state: SurfaceState) -> Result<(), Error> {
        self.silo.set_state(state)
    }

    fn step(&mut self, until: f64) -> Result<SurfaceStep, Error> {
        self.silo.step(until)
    }

    fn is_at_rest(&self, _: &SurfaceStep) -> bool {
        false
    }

    fn volume_drift(&self) -> f64 {
        self.silo.volume_drift()
    }

    fn profile(&self) -> (Vec<f64>, Vec<f64>) {
        self.silo.profile()
    }

    /// Volume in the silo, and what has left it.
    fn row(&self) -> Vec<f64> {
        self.silo.instant().to_vec()
    }

    fn shares(&self) -> [f64; 3] {
        surface_fields::shares(&self.silo.fields(), &self.scene.rheology)
    }

    fn frame(&self) -> Frame {
        let (cells, grains) = (self.silo.fields(), &self.scene.rheology);
        let inertia = grains.diameter * grains.grain_density.sqrt();
        let fields = SurfaceFields::of_material(&cells, inertia);
        Frame {
            time: self.silo.time(),
            cells: Cells::Quadrilaterals,
            points: fields.quadrilaterals().collect(),
            fields: fields.of_plane(),
        }
    }
}

pub(super) fn run(scene: &SiloDischargeScene, under: &mut Under) -> Result<Findings, Failure> {
    let refused = |error: Error| Failure::Input(format!("{}: {error}", under.scene.origin));
    let case = case(scene, scene.rheology.any_law().map_err(refused)?);
    let silo = Silo::new(&case, &options_of(&scene.solver)).map_err(refused)?;
    let end = scene.duration_scaled * silo.units().time();
    let mut flow = RunningOut { silo, scene };
    let course = surface_run::follow(&mut flow, end, under)?;
    let wall_s = under.wall_s();
    surface_run::join(&flow, end, under)?;
    let mut summary = surface_run::summary(&flow, &course, &LEFT_OUT, under, wall_s);
    describe(&mut summary, &case, &flow, &course);
    Ok(Findings {
        summary,
        tables: tables(&course),
        grains: None,
    })
}

/// Instants of time, volume inside and volume that has left.
fn instants(course: &Course) -> Vec<[f64; 3]> {
    let [t, inside, left] = [0, 1, 2].map(|number| course.column(number));
    let volumes = inside.into_iter().zip(left);
    let rows = t.into_iter().zip(volumes);
    rows.map(|(t, (inside, left))| [t, inside, left]).collect()
}

fn tables(course: &Course) -> Vec<Table> {
    let instants = instants(course);
    // The mean rate since the instant before; there is none at the first.
    let rate = instants
        .windows(2)
        .map(|pair| (pair[1][2] - pair[0][2]) / (pair[1][0] - pair[0][0]));
    vec![
        Table::new("discharge")
            .with("t", "s", course.column(0))
            .with("volume", "m²", course.column(1))
            .with("discharged", "m²", course.column(2))
            .with(
                "rate",
                "m²/s",
                std::iter::once(f64::NAN).chain(rate).collect(),
            ),
        course.profiles("x"),
        course.flowing(),
        course.steps.all.table(),
    ]
}

fn describe(summary: &mut Summary, case: &SiloCase<AnyLaw>, flow: &RunningOut, course: &Course) {
    let RunningOut { silo, scene } = flow;
    summary.remarks.extend(scene.rheology.remarks());
    let mut put = |name: &str, value: f64, unit: &str, source: &str| {
        summary.put(name, Quantity::new(value, unit).from(source));
    };
    let [_, volume, discharged] = silo.instant();
    put(
        "volume",
        volume,
        "m²",
        "in the silo, per length of the slot",
    );
    put(
        "discharged",
        discharged,
        "m²",
        "since the start, per length of the slot",
    );
    put(
        "volume_error",
        silo.volume_drift(),
        "1",
        "gained beside what has left, over what was there",
    );
    let steady = case.steady_rate(&instants(course));
    let of = |value: fn(&colluvium_continuum::silo::SteadyRate) -> f64| {
        steady.as_ref().map_or(f64::NAN, value)
    };
    let window = "from 4 √(outlet/gravity) on, down to a mean depth of half the width; null where the run is too short";
    put("rate", of(|s| s.rate), "m²/s", window);
    put(
        "rate_scaled",
        of(|s| s.rate) / case.rate_unit(),
        "1",
        "rate over √gravity outlet^(3/2)",
    );
    put(
        "rate_change",
        of(|s| s.change()),
        "1",
        "from the first to the second half of the steady window: 0 where the rate does not depend on what is left",
    );
    put(
        "steady_from",
        of(|s| s.from),
        "s",
        "start of the steady window",
    );
    put("steady_to", of(|s| s.to), "s", "end of the steady window");
    surface_run::describe_shares(summary, course, &scene.rheology);
    surface_run::describe_steps(summary, flow, course, scene.solver.strain_rate_floor);
}
