//! The collapse of a column that is grains in front and a continuum behind.
//!
//! The whole column is settled as grains, the same as with `model = "dem"`; when the gate goes, what lies behind the
//! edge becomes continuum (`coupling::overlap::material_edge`). Preparation, walls and step are those of the column
//! of grains. Heights are those of the grains beyond the handshake surface and of the continuum behind it, smeared
//! in the same way.

mod findings;
mod oracle;
mod pictures;

use super::column_of_grains::{BEGUN, FRONTS, PROFILE_EVERY, STILL, STILL_LOOKS};
use super::heap::{HeapCourse, edge};
use super::world::{Course, Expected, Ran, Recipe, as_the_scene};
use super::{Findings, Under};
use crate::failure::Failure;
use crate::rheology_file::RheologyFile;
use crate::scene::world::Materials;
use crate::scene::{CollapseScene, Scene};
use crate::summary::Summary;
use crate::table::Table;
use crate::vtkhdf::Frame;
use colluvium_continuum::column_collapse::{CollapseCase, CollapseGround};
use colluvium_continuum::rheology::MuI;
use colluvium_coupling::overlap::OverlapError;
use colluvium_coupling::overlap::material_edge::{GrainZone, MaterialEdge, MaterialEdgeSpec, Side};
use colluvium_coupling::zones::Oracle;
use colluvium_dem::preparation::solid_fraction;
use colluvium_dem::{Simulation, Snapshot};
use std::path::Path;
use std::sync::{Mutex, MutexGuard, PoisonError};

/// A column, and what is alive of it while it runs.
#[derive(Debug)]
pub struct JoinedColumn<'a> {
    scene: &'a CollapseScene,
    origin: String,
    /// What the oracle says of the edge, if it was asked, in words and by place.
    oracle: Option<(String, Table)>,
    live: Mutex<Option<Live>>,
}

/// What the recipe's memory holds, in a form that goes on.
struct Live {
    zone: GrainZone,
    course: HeapCourse,
}

impl std::fmt::Debug for Live {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(
            f,
            "a joined column after {} exchanges",
            self.zone.exchanges()
        )
    }
}

/// Numbers in front of the zone's in the memory: solid fraction, and how many the zone has.
const HEAD: usize = 2;

/// Checks the scene before anything is written.
pub(super) fn check(scene: &Scene, body: &CollapseScene) -> Result<(), Failure> {
    with_edge(body, &scene.origin, |column| {
        let named = |why: String| Failure::Input(format!("{}: {why}", scene.origin));
        let specs = column.specs(crate::scene::DENSE)?;
        for spec in &specs {
            spec.case.validate().map_err(|why| named(why.to_string()))?;
            spec.options
                .validate()
                .map_err(|why| named(why.to_string()))?;
        }
        if let Some(ground) = column.ground()? {
            GrainZone::check_ground(&specs, &ground).map_err(|why| named(why.to_string()))?;
        }
        super::world::course::check(scene, column)
    })
}

/// Runs it.
pub(super) fn run(scene: &CollapseScene, under: &mut Under) -> Result<Findings, Failure> {
    let origin = under.scene.origin.clone();
    with_edge(scene, &origin, |column| {
        let mut findings = super::world::course::run(column, under)?;
        if let Some((words, table)) = &column.oracle {
            findings.summary.remarks.push(format!("Edge {words}."));
            findings.summary.figures.push(oracle::figure());
            findings.tables.push(table.clone());
        }
        Ok(findings)
    })
}

/// Does something with the column, whose edge the oracle has put if it is to.
///
/// # Errors
/// What the oracle refuses, and what is done with the column fails with.
pub fn with_edge<T>(
    body: &CollapseScene,
    origin: &str,
    act: impl FnOnce(&JoinedColumn<'_>) -> Result<T, Failure>,
) -> Result<T, Failure> {
    match oracle::survey(body, origin)? {
        None => act(&JoinedColumn::new(body, origin)),
        Some(surveyed) => {
            let mut column = JoinedColumn::new(&surveyed.scene, origin);
            column.oracle = Some((surveyed.words, surveyed.table));
            act(&column)
        }
    }
}

/// What an error of the coupling means for the process.
fn failure(error: OverlapError) -> Failure {
    match error {
        OverlapError::OutOfRange { .. } | OverlapError::Record(_) => {
            Failure::Input(error.to_string())
        }
        error => Failure::Run(error.to_string()),
    }
}

/// An overlap has come to where the ground is not level: grains have to begin or to end farther back.
fn off_level_ground(reached: f64, level: f64, what: &str, keys: &str) -> Failure {
    Failure::Run(format!(
        "the overlap of grains and continuum has come to x = {reached:.4} m, where the ground is no longer level ({level} m): grains \
         have to {what} farther back ({keys})"
    ))
}

impl<'a> JoinedColumn<'a> {
    /// Before anything runs.
    pub fn new(scene: &'a CollapseScene, origin: &str) -> Self {
        Self {
            scene,
            origin: origin.to_owned(),
            oracle: None,
            live: Mutex::new(None),
        }
    }

    /// The law of the continuum, at a solid fraction: that which the grains were calibrated to, or the scene's.
    fn law(&self, solid_fraction: f64) -> Result<MuI, Failure> {
        let scene = self.scene;
        let own = match scene.grains.calibrated.word() {
            Some(word) => {
                let file = RheologyFile::read(Path::new(word))?;
                [file.mu_s, file.mu_2, file.i_0]
            }
            None => {
                let law = scene.rheology.mu_i();
                [law.mu_s, law.mu_2, law.i_0]
            }
        };
        let [mu_s, mu_2, i_0] = own;
        Ok(MuI {
            mu_s,
            mu_2,
            i_0,
            diameter: scene.grains.diameter,
            solid_fraction,
            grain_density: scene.grains.density,
            cohesion: 0.0,
        })
    }

    /// Judges a continuum of this law by what its calibration tells of itself.
    fn judge(&self, law: MuI) -> Result<Oracle, Failure> {
        let word = self.scene.grains.calibrated.word();
        let file = word.map(|word| RheologyFile::read(Path::new(word)));
        let file = file.transpose()?;
        Ok(Oracle {
            law,
            window: file.as_ref().and_then(|file| file.valid_i),
            covariance: file.and_then(|file| file.covariance),
        })
    }

    /// The ground under a continuum that has the front, if there is terrain.
    pub(super) fn ground(&self) -> Result<Option<CollapseGround>, Failure> {
        match self.scene.has_front_of_continuum() {
            true => self.scene.land_of_continuum(&self.origin),
            false => Ok(None),
        }
    }

    /// What the column is joined from at each edge, at a solid fraction.
    pub(super) fn specs(&self, solid_fraction: f64) -> Result<Vec<MaterialEdgeSpec>, Failure> {
        let edges = self.scene.edges();
        let of = |(k, &edge): (usize, &(Side, f64))| {
            let other = match edge.0 {
                Side::Below => k.checked_sub(1),
                Side::Above => Some(k + 1),
            };
            let other = other.and_then(|k| edges.get(k)).map(|(_, place)| *place);
            self.spec(edge, other, solid_fraction)
        };
        edges.iter().enumerate().map(of).collect()
    }

    /// What it is joined from at an edge, and at the other end of the same continuum if that has one, at places along x (m).
    fn spec(
        &self,
        (side, place): (Side, f64),
        other: Option<f64>,
        solid_fraction: f64,
    ) -> Result<MaterialEdgeSpec, Failure> {
        let scene = self.scene;
        let settings = scene.overlap_settings(&self.origin)?;
        let overlap = settings.inner + settings.buffer;
        let [wall, back] = match (side, other) {
            (Side::Below, None) => [scene.rest(); 2],
            (Side::Below, Some(other)) => [0.0, other - overlap],
            (Side::Above, other) => {
                let back = other.map_or(scene.width(), |other| other + overlap);
                [scene.length(), back].map(|x| side.along(x))
            }
        };
        // The face of the column is that of the continuum that has its front.
        let overhang_degrees = match (side, other) {
            (Side::Above, None) => scene.overhang_degrees,
            _ => 0.0,
        };
        Ok(MaterialEdgeSpec {
            case: CollapseCase {
                aspect: scene.aspect,
                height: scene.height,
                gravity: scene.gravity,
                rheology: self.law(solid_fraction)?,
                cells: scene.joined_cells(),
                length_scaled: scene.grid.length_scaled,
                overhang_degrees,
            },
            options: super::collapse::options(scene),
            side,
            place: side.along(place),
            wall,
            back,
            slab: scene.slab(),
            travel: scene.travel(&settings),
            settings,
        })
    }

    /// What the edges are called in tables and summaries.
    fn names(&self) -> Vec<String> {
        let count = self.scene.edges().len();
        let name = |k: usize| match (count, k) {
            (1, _) => "edge".to_owned(),
            (2, 0) => "low_edge".to_owned(),
            (2, _) => "high_edge".to_owned(),
            _ => format!("edge_{}", k + 1),
        };
        (0..count).map(name).collect()
    }

    fn live(&self) -> MutexGuard<'_, Option<Live>> {
        self.live.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// From a recipe's memory.
    fn recalled(&self, simulation: &Simulation, memory: &[f64]) -> Result<Live, Failure> {
        let damaged = || Failure::damaged("recipe/state");
        let (head, rest) = memory.split_at_checked(HEAD).ok_or_else(damaged)?;
        let (own, course) = rest
            .split_at_checked(head[1] as usize)
            .ok_or_else(damaged)?;
        let (specs, ground) = (self.specs(head[0])?, self.ground()?);
        let zone = GrainZone::read(&specs, ground.as_ref(), own, simulation).map_err(failure)?;
        let course =
            HeapCourse::read(course, self.scene.heap_axis().columns).ok_or_else(damaged)?;
        Ok(Live { zone, course })
    }

    /// Cuts the column when the gate goes.
    fn begin(&self, simulation: &mut Simulation) -> Result<Live, Failure> {
        let solid = solid_fraction(
            &simulation.grain_list(),
            simulation.domain(),
            &self.scene.middle(),
        );
        let (specs, ground) = (self.specs(solid)?, self.ground()?);
        let zone = GrainZone::cut(&specs, ground.as_ref(), simulation).map_err(failure)?;
        let mut live = Live {
            zone,
            course: HeapCourse {
                solid_fraction: solid,
                ..HeapCourse::default()
            },
        };
        self.see(simulation, &mut live, true);
        Ok(live)
    }

    /// Exchanges between two looks at the front.
    fn exchanges_of_a_front(&self, zone: &GrainZone) -> u64 {
        (self.scene.duration() / FRONTS / zone.exchange_time())
            .round()
            .max(1.0) as u64
    }

    /// Heights of grains beyond the handshake surface and of the continuum behind it; `part` of the slab and the
    /// grains that it takes.
    fn heights(
        &self,
        simulation: &Simulation,
        live: &Live,
        part: f64,
        f: impl Fn(f64) -> bool,
    ) -> Vec<f64> {
        let solid = |radius: f64| 4.0 / 3.0 * std::f64::consts::PI * radius.powi(3);
        let mut grains: Vec<(u32, [f64; 2])> = simulation
            .held(|x| f(x.y))
            .filter(|g| live.zone.counts(g))
            .map(|g| (g.id, [g.position.x, solid(g.radius)]))
            .collect();
        grains.sort_unstable_by_key(|(id, _)| *id);
        let parcels = live.zone.parcels();
        let behind = parcels.into_iter().map(|[x, volume]| [x, part * volume]);
        let rows = grains.into_iter().map(|(_, row)| row).chain(behind);
        let base = live.course.solid_fraction * self.scene.slab() * part;
        self.scene.heap_axis().heights(rows, base)
    }

    fn see(&self, simulation: &Simulation, live: &mut Live, profile: bool) {
        let heights = self.heights(simulation, live, 1.0, |_| true);
        let places = self.scene.heap_axis().positions();
        let front = edge(&places, &heights, self.scene.threshold());
        let highest = heights.iter().copied().fold(0.0, f64::max);
        let time = simulation.time();
        live.course.fronts.push([time, front, highest]);
        if profile {
            live.course.profiles.push((time, heights));
        }
    }

    /// Refuses to go on where an overlap has come to a slope, or a continuum that has a level floor, with its copy of the overlap.
    fn stands_on_level_ground(&self, live: &Live) -> Result<(), Failure> {
        let Some(land) = self.scene.land(&self.origin)? else {
            return Ok(());
        };
        let least = 0.5 * self.scene.spacing();
        let reached = live
            .zone
            .continua()
            .iter()
            .filter(|continuum| !continuum.has_ground())
            .fold(0.0, |most: f64, continuum| {
                let (x, h) = continuum.heights();
                let filled = x.iter().zip(&h).filter(|(_, h)| **h > least);
                filled.fold(most, |most, (x, _)| most.max(*x))
            });
        let (level, keys) = (
            land.level_up_to(self.scene.spacing()),
            "zones.edge_scaled, zones.tolerance",
        );
        if reached + least > level {
            return Err(off_level_ground(reached, level, "begin", keys));
        }
        // Where nothing is exchanged grains fall out of an edge, and nobody takes them for a joint.
        let edges = live.zone.edges().iter();
        let mut joined = edges.filter(|edge| !edge.spec().settings.uncoupled);
        match joined.find_map(MaterialEdge::beyond_level_ground) {
            None => Ok(()),
            Some([reached, level]) => Err(off_level_ground(reached, level, "end", "zones.x")),
        }
    }

    fn remember(live: &Live, state: &mut Vec<f64>) {
        let mut zone = Vec::with_capacity(state.len());
        live.zone.write(&mut zone);
        let mut course = Vec::new();
        live.course.write(&mut course);
        state.clear();
        state.extend([live.course.solid_fraction, zone.len() as f64]);
        state.append(&mut zone);
        state.append(&mut course);
    }

    /// Whether both sides together have come to rest, by the measure of a column of grains: what rests behind the edge
    /// counts as it would there, or the same heap would have to be calmer the fewer of it are grains.
    fn rests(&self, simulation: &mut Simulation, live: &mut Live) -> bool {
        let unit = live.zone.whole_mass() * self.scene.gravity * self.scene.grains.diameter;
        let kinetic = self.scene.kinetic_of_the_heap(simulation) + live.zone.continuum_kinetic();
        let still = simulation.time() > BEGUN * self.scene.time_unit() && kinetic < STILL * unit;
        live.course.resting = if still {
            live.course.resting + 1.0
        } else {
            0.0
        };
        live.course.resting >= STILL_LOOKS
    }
}

impl Recipe for JoinedColumn<'_> {
    fn about(&self) -> String {
        let rest = match self.scene.rest() {
            0.0 => String::new(),
            rest => format!(", of which {rest:.4} m rest and are not computed"),
        };
        let scene = self.scene;
        let over = match scene.terrain {
            Some(_) => ", which runs out over the terrain",
            None => "",
        };
        let of = |ends: [Option<f64>; 2]| match ends {
            [Some(low), Some(high)] => {
                format!("between {low:.4} and {high:.4} m from the wall is a continuum")
            }
            [Some(low), None] => format!("beyond {low:.4} m is a continuum{over}"),
            [None, high] => format!(
                "within {:.4} m of the wall is a continuum{rest}",
                high.unwrap_or(0.0)
            ),
        };
        let places: Vec<String> = scene.continua().into_iter().map(of).collect();
        format!(
            "{}; what lies {}",
            scene.about(),
            places.join(", and what lies ")
        )
    }

    as_the_scene!();

    fn expected(&self, materials: &Materials) -> Expected {
        let all = self.scene.expected(materials);
        Expected {
            grains: all.grains * self.expected_share(),
            ..all
        }
    }

    fn left_out(&self) -> Vec<&'static str> {
        let mut own = self.scene.left_out();
        own.extend([
            "granular temperature and dilatancy of the continuum",
            "exchange of mass through the edge but by whole strips (it moves with the material)",
        ]);
        own
    }

    fn plan(&self) -> Vec<(String, String)> {
        self.zones_in_words()
    }

    fn steer_every(&self, timestep: f64) -> u64 {
        let settings = self.scene.overlap_settings(&self.origin);
        settings.map_or(u64::MAX, |s| s.steps_of_loads(timestep))
    }

    fn steer(&self, simulation: &mut Simulation, state: &mut Vec<f64>) -> Result<Course, Failure> {
        let mut guard = self.live();
        if state.is_empty() {
            let live = self.begin(simulation)?;
            Self::remember(&live, state);
            *guard = Some(live);
            return Ok(Course::On);
        }
        if guard.is_none() {
            *guard = Some(self.recalled(simulation, state)?);
        }
        let Some(live) = guard.as_mut() else {
            return Ok(Course::On);
        };
        live.zone.go_on(simulation).map_err(failure)?;
        if !live.zone.at_exchange() {
            live.zone.write_over(&mut state[HEAD..]);
            return Ok(Course::On);
        }
        let mut over = false;
        if live
            .zone
            .exchanges()
            .is_multiple_of(self.exchanges_of_a_front(&live.zone))
        {
            let profile = live.course.fronts.len().is_multiple_of(PROFILE_EVERY);
            self.see(simulation, live, profile);
            self.stands_on_level_ground(live)?;
            over = self.rests(simulation, live);
        }
        Self::remember(live, state);
        Ok(if over { Course::Over } else { Course::On })
    }

    fn columns(&self) -> Vec<(String, &'static str)> {
        let all = [
            ("x_front", "m"),
            ("height", "m"),
            ("continuum_kinetic", "J"),
        ];
        let mut columns = all.map(|(name, unit)| (name.to_owned(), unit)).to_vec();
        for named in self.names() {
            columns.extend(["foot", "top", "label"].map(|part| (format!("{named}_{part}"), "m")));
        }
        columns
    }

    fn look(&self, simulation: &mut Simulation, _: &Snapshot, state: &[f64]) -> Vec<f64> {
        let mut guard = self.live();
        // A row may come before the first loads after a restart.
        if guard.is_none() && !state.is_empty() {
            *guard = self.recalled(simulation, state).ok();
        }
        let Some(live) = guard.as_ref() else {
            return vec![f64::NAN; self.columns().len()];
        };
        let last = live.course.fronts.last();
        let [_, front, height] = last.copied().unwrap_or([f64::NAN; 3]);
        let mut row = vec![front, height, live.zone.continuum_kinetic()];
        for edge in live.zone.edges() {
            let (places, spec) = (edge.handshake(), edge.spec());
            let along = |place: f64| spec.side.along(place);
            let end = |place: Option<&f64>| place.map_or(f64::NAN, |place| along(*place));
            row.extend([
                end(places.first()),
                end(places.last()),
                along(spec.place + edge.travelled()),
            ]);
        }
        row
    }

    fn has_continuum(&self) -> bool {
        true
    }

    fn continuum(&self, simulation: &Simulation, state: &[f64]) -> Option<Frame> {
        let mut guard = self.live();
        if guard.is_none() && !state.is_empty() {
            *guard = self.recalled(simulation, state).ok();
        }
        let live = guard.as_ref()?;
        Some(pictures::cells(&live.zone, simulation.time()))
    }

    fn conclude(&self, ran: &mut Ran, summary: &mut Summary) -> Result<Vec<Table>, Failure> {
        self.find(ran, summary)
    }
}
