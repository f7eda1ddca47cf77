//! A bed that is grains about the ball and a continuum beyond.
//!
//! The whole bed is settled as grains, the same as with `model = "dem"`; at the start what lies beyond the box becomes
//! continuum (`coupling::overlap::bowl`). Preparation, walls, ball and step are those of the bed of grains.

mod findings;
mod plan;

use super::super::surface_fields::space_frame;
use super::super::world::{Course, Expected, Ran, Recipe, as_the_scene};
use super::of_ball;
use super::{moves, sheared_packings};
use crate::failure::Failure;
use crate::rheology_file::RheologyFile;
use crate::run_directory::RunDirectory;
use crate::scene::world::Materials;
use crate::scene::{BallImpactScene, DENSE};
use crate::state_hash;
use crate::summary::{Quantity, Summary};
use crate::table::Table;
use crate::vtkhdf::Frame;
use colluvium_continuum::free_surface::SurfaceOptions;
use colluvium_continuum::rheology::MuI;
use colluvium_coupling::overlap::OverlapError;
use colluvium_coupling::overlap::bowl::{Bowl, BowlSpec};
use colluvium_dem::preparation::{ShearedCell, solid_fraction};
use colluvium_dem::{Simulation, Snapshot};
use std::path::Path;
use std::sync::{Mutex, MutexGuard, PoisonError};

/// Numbers in front of the bowl's in the memory: solid fraction and surface of the bed.
const HEAD: usize = 3;

/// A bed, and what is alive of it while it runs.
pub struct JoinedBed<'a> {
    scene: &'a BallImpactScene,
    origin: String,
    live: Mutex<Option<Bowl>>,
    /// Packings in steady shear.
    packings: Mutex<Vec<ShearedCell>>,
}

impl std::fmt::Debug for JoinedBed<'_> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "a joined bed of {}", self.origin)
    }
}

impl JoinedBed<'_> {
    /// What an error of the coupling means for the process, in the scene's own keys.
    fn failure(&self, error: OverlapError) -> Failure {
        match error {
            OverlapError::OutOfRange {
                key,
                value,
                allowed,
            } => {
                let scale = self.scene.scale;
                let floor = self.scene.container.floor;
                let (key, value) = match key {
                    "x" if self.scene.zones.x.is_some() => {
                        ("zones.x, from edge to edge", value / scale)
                    }
                    "y" if self.scene.zones.y.is_some() => {
                        ("zones.y, from edge to edge", value / scale)
                    }
                    "x" | "y" => ("zones.half_width", 0.5 * value / scale),
                    "sides" => (
                        "zones.depth with zones.half_width, zones.x, zones.y: sides of the box",
                        value,
                    ),
                    "bottom" => ("zones.depth, whose bottom lies at z", floor + value / scale),
                    _ => (key, value),
                };
                let origin = &self.origin;
                Failure::Input(format!("{origin}: key {key} = {value}: must be {allowed}"))
            }
            OverlapError::Record(why) => Failure::Input(why),
            error => Failure::Run(error.to_string()),
        }
    }
}

impl<'a> JoinedBed<'a> {
    /// Before anything runs.
    pub fn new(scene: &'a BallImpactScene, origin: &str) -> Self {
        Self {
            scene,
            origin: origin.to_owned(),
            live: Mutex::new(None),
            packings: Mutex::new(Vec::new()),
        }
    }

    /// The law of the continuum at a solid fraction, and the inertial number up to which it was measured: none is known of
    /// numbers that the scene gives itself.
    fn law(&self, solid_fraction: f64) -> Result<(MuI, f64), Failure> {
        let keys = &self.scene.continuum;
        let materials = self.scene.materials(&self.origin)?;
        let (calibrated, valid) = match keys.calibrated.word() {
            Some(word) => {
                let file = RheologyFile::read(Path::new(word))?;
                let valid = file.valid_i.map_or(f64::INFINITY, |[_, high]| high);
                ([file.mu_s, file.mu_2, file.i_0], valid)
            }
            None => ([f64::NAN; 3], f64::INFINITY),
        };
        let is_own = [keys.mu_s, keys.mu_2, keys.i_0].iter().any(Option::is_some);
        let law = MuI {
            mu_s: keys.mu_s.unwrap_or(calibrated[0]),
            mu_2: keys.mu_2.unwrap_or(calibrated[1]),
            i_0: keys.i_0.unwrap_or(calibrated[2]),
            diameter: self.scene.grain_diameter(&materials),
            solid_fraction,
            grain_density: self.scene.grain_density(&materials),
            cohesion: 0.0,
        };
        Ok((law, if is_own { f64::INFINITY } else { valid }))
    }

    /// What the bed is joined from, at a solid fraction and with its surface at a height (m).
    fn spec(&self, [solid, surface, ball]: [f64; HEAD]) -> Result<BowlSpec, Failure> {
        let scene = self.scene;
        let (law, valid) = self.law(solid)?;
        let size = [scene.container.length, scene.container.width].map(|e| scene.scale * e);
        let settings = scene.overlap_settings(&self.origin)?;
        Ok(BowlSpec {
            low: [-0.5 * size[0], -0.5 * size[1], scene.floor()],
            size,
            gravity: scene.gravity,
            options: SurfaceOptions::default(),
            edges: scene.zone_edges(law.diameter),
            bottom: (surface - scene.zone_depth(law.diameter) - scene.floor()).max(0.0),
            growth: scene.growth(law.diameter, &settings, valid),
            settings,
            ball: Some(ball as u32),
            law,
        })
    }

    fn live(&self) -> MutexGuard<'_, Option<Bowl>> {
        self.live.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn recalled(&self, simulation: &Simulation, memory: &[f64]) -> Result<Bowl, Failure> {
        let damaged = || Failure::damaged("recipe/state");
        let (head, rest) = memory.split_first_chunk::<HEAD>().ok_or_else(damaged)?;
        let spec = self.spec(*head)?;
        let bowl = Bowl::read(spec, rest, simulation).map_err(|why| self.failure(why))?;
        Ok(self.stocked(bowl))
    }

    /// The bowl with the packings that it takes grains from.
    fn stocked(&self, mut bowl: Bowl) -> Bowl {
        let packings = self.packings.lock();
        bowl.set_packings(packings.unwrap_or_else(PoisonError::into_inner).clone());
        bowl
    }

    /// Cuts the bed.
    fn begin(&self, simulation: &mut Simulation) -> Result<([f64; HEAD], Bowl), Failure> {
        let ball = last(simulation);
        let mut bed = simulation.grain_list();
        // The ball joined last.
        bed.pop();
        let solid = solid_fraction(&bed, simulation.domain(), &self.scene.middle(&bed));
        let head = [solid, self.scene.surface(&bed), f64::from(ball)];
        let bowl = Bowl::cut(self.spec(head)?, simulation).map_err(|why| self.failure(why))?;
        Ok((head, self.stocked(bowl)))
    }

    fn remember(head: &[f64], bowl: &Bowl, state: &mut Vec<f64>) {
        let mut memory = Vec::with_capacity(state.len());
        memory.extend(head);
        bowl.write(&mut memory);
        *state = memory;
    }

    /// Height of the bed (m), before it is there to be measured.
    fn expected_height(&self, diameter: f64) -> f64 {
        let scene = self.scene;
        let volume = scene.count() as f64 * std::f64::consts::PI / 6.0 * diameter.powi(3);
        volume / (DENSE * scene.area())
    }

    /// Share of the bed's volume that is grains: at the start, and in a box as deep as one that stays would be if this one
    /// grows.
    fn expected_shares(&self) -> [f64; 2] {
        let scene = self.scene;
        let Ok(materials) = scene.materials(&self.origin) else {
            return [1.0; 2];
        };
        let d = scene.grain_diameter(&materials);
        let edges = scene.zone_edges(d).into_iter().zip(scene.container_edges());
        let across: f64 = edges
            .map(|([low, high], wall)| (high.min(wall) - low.max(-wall)) / (2.0 * wall))
            .product();
        let start = scene.zone_depth(d);
        let last = match scene.zones.moving {
            true => start.max(scene.lasting_depth(d)),
            false => start,
        };
        [start, last].map(|depth| across * (depth / self.expected_height(d)).min(1.0))
    }
}

/// Number of the ball before grains of packings come in: it joined last.
fn last(simulation: &Simulation) -> u32 {
    simulation.held(|_| true).map(|g| g.id).max().unwrap_or(0)
}

impl Recipe for JoinedBed<'_> {
    fn about(&self) -> String {
        format!(
            "{}; beyond a box about the ball{} the bed is a continuum",
            self.scene.about(),
            match self.scene.zones.moving {
                true => ", which grows where it has to,",
                false => "",
            }
        )
    }

    as_the_scene!();

    fn check(&self) -> Result<(), Failure> {
        let materials = self.scene.materials(&self.origin)?;
        let height = self.expected_height(self.scene.grain_diameter(&materials));
        let spec = self.spec([DENSE, self.scene.floor() + height, 0.0])?;
        spec.check(height).map_err(|why| self.failure(why))
    }

    fn stock(
        &self,
        materials: &Materials,
        timestep: f64,
        directory: &RunDirectory,
    ) -> Result<(), Failure> {
        if self.scene.returns_sheared() {
            let depth = self.expected_height(self.scene.grain_diameter(materials));
            let wanted = sheared_packings::wanted(self.scene, materials, depth, timestep);
            let made = sheared_packings::packings(&wanted, &self.origin, directory)?;
            *self.packings.lock().unwrap_or_else(PoisonError::into_inner) = made;
        }
        Ok(())
    }

    fn expected(&self, materials: &Materials) -> Expected {
        let all = self.scene.expected(materials);
        Expected {
            grains: all.grains * self.expected_shares()[1],
            ..all
        }
    }

    fn left_out(&self) -> Vec<&'static str> {
        let mut own = self.scene.left_out();
        own.extend([
            "granular temperature, dilatancy and compaction of the continuum",
            match self.scene.zones.moving {
                true => "exchange of mass through the box but by whole strips",
                false => "exchange of mass through the box (it stays, and little moves there)",
            },
            "friction of the container's side walls on the continuum, slip on its floor",
        ]);
        own
    }

    fn plan(&self) -> Vec<(String, String)> {
        self.plan_lines()
    }

    fn steer_every(&self, timestep: f64) -> u64 {
        let settings = self.scene.overlap_settings(&self.origin);
        settings.map_or(u64::MAX, |s| s.steps_of_loads(timestep))
    }

    fn steer(&self, simulation: &mut Simulation, state: &mut Vec<f64>) -> Result<Course, Failure> {
        let mut guard = self.live();
        if state.is_empty() {
            let (head, bowl) = self.begin(simulation)?;
            Self::remember(&head, &bowl, state);
            *guard = Some(bowl);
            return Ok(Course::On);
        }
        if guard.is_none() {
            *guard = Some(self.recalled(simulation, state)?);
        }
        let Some(bowl) = guard.as_mut() else {
            return Ok(Course::On);
        };
        bowl.go_on(simulation).map_err(|why| self.failure(why))?;
        if bowl.at_exchange() {
            let head = [state[0], state[1], state[2]];
            Self::remember(&head, bowl, state);
            // What the ball does to the continuum, and the continuum to it, nobody computes.
            if bowl.ball_clearance(simulation).is_some_and(|c| c <= 0.0) {
                return Ok(Course::Over);
            }
        } else {
            bowl.write_over(&mut state[HEAD..]);
        }
        Ok(Course::On)
    }

    fn columns(&self) -> Vec<(String, &'static str)> {
        self.scene.columns()
    }

    fn look(&self, simulation: &mut Simulation, seen: &Snapshot, state: &[f64]) -> Vec<f64> {
        match state.get(HEAD - 1) {
            // Grains of packings have joined after the ball.
            Some(number) => of_ball(seen.grains.iter().find(|g| f64::from(g.id) == *number)),
            None => self.scene.look(simulation, seen, state),
        }
    }

    fn has_continuum(&self) -> bool {
        true
    }

    /// Cells of the continuum behind the handshake surface, as the last exchange left them.
    fn continuum(&self, simulation: &Simulation, state: &[f64]) -> Option<Frame> {
        let mut guard = self.live();
        if guard.is_none() && !state.is_empty() {
            *guard = self.recalled(simulation, state).ok();
        }
        let bowl = guard.as_ref()?;
        let law = &bowl.spec().law;
        Some(space_frame(&bowl.fields(), &[], law, simulation.time()))
    }

    fn conclude(&self, ran: &mut Ran, summary: &mut Summary) -> Result<Vec<Table>, Failure> {
        let mut tables = self.scene.conclude(ran, summary)?;
        let bowl = self.recalled(&ran.simulation, &ran.state)?;
        self.book(ran, &bowl, summary);
        self.watch(&bowl, summary);
        let clearance = bowl.ball_clearance(&ran.simulation).unwrap_or(f64::NAN);
        summary.put(
            "overlap_clearance",
            Quantity::new(clearance, "m")
                .from("between the ball and the handshake surface at the end"),
        );
        if clearance <= 0.0 {
            summary.remarks.push(format!(
                "The ball came to the overlap after {:.4} s and the run ended there: the continuum knows of no ball. {}",
                ran.simulation.time(),
                match self.scene.zones.moving {
                    true => "The box could not grow as fast as needed: see the moves that were refused, and zones.near_diameters.",
                    false => "zones.depth or zones.half_width (or zones.x, zones.y) is too small for it; zones.moving = true lets the box grow.",
                }
            ));
        }
        if self.scene.zones.moving {
            tables.extend(moves::table(&bowl, summary));
        }
        summary.state_hash = state_hash::of_hashes(
            [ran.simulation.state_hash(), state_hash::of(&[&ran.state])]
                .iter()
                .map(String::as_str),
        );
        Ok(tables)
    }
}
