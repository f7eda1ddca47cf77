//! A bed that is grains about the ball and a continuum beyond.
//!
//! The whole bed is settled as grains, the same as with `model = "dem"`; at the start what lies beyond the box becomes
//! continuum (`coupling::overlap::bowl`). Preparation, walls, ball and step are those of the bed of grains.

use super::super::surface_fields::space_frame;
use super::super::world::{Course, Expected, Ran, Recipe, as_the_scene};
use super::of_ball;
use super::{moves, sheared_packings};
use crate::failure::Failure;
use crate::rheology_file::RheologyFile;
use crate::run_directory::RunDirectory;
use crate::scene::world::Materials;
use crate::scene::{BallImpactScene, DENSE, overlap_words};
use crate::state_hash;
use crate::summary::{Quantity, Summary};
use crate::table::Table;
use crate::vtkhdf::Frame;
use colluvium_continuum::free_surface::SurfaceOptions;
use colluvium_continuum::rheology::MuI;
use colluvium_coupling::overlap::OverlapError;
use colluvium_coupling::overlap::bowl::{Bowl, BowlSpec, Growth};
use colluvium_dem::preparation::{ShearedCell, solid_fraction};
use colluvium_dem::{Simulation, Snapshot};
use std::path::Path;
use std::sync::{Mutex, MutexGuard, PoisonError};

/// Limits of the monitors: slip over the ball's speed, ratio of forces less 1.
const MOST_SLIP: f64 = 0.01;
const MOST_RATIO: f64 = 0.05;
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
                    "x" if self.scene.zones.x.is_some() => ("zones.x[1]", value / scale),
                    "y" if self.scene.zones.y.is_some() => ("zones.y[1]", value / scale),
                    "x" | "y" => ("zones.half_width", value / scale),
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

    /// The law of the continuum at a solid fraction.
    /// And the inertial number up to which it was measured.
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
        let law = MuI {
            mu_s: keys.mu_s.unwrap_or(calibrated[0]),
            mu_2: keys.mu_2.unwrap_or(calibrated[1]),
            i_0: keys.i_0.unwrap_or(calibrated[2]),
            diameter: self.scene.grain_diameter(&materials),
            solid_fraction,
            grain_density: self.scene.grain_density(&materials),
            cohesion: 0.0,
        };
        Ok((law, valid))
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
        let damaged = || Failure::Input("--resume: the checkpoint is damaged: recipe/state".into());
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

    /// What else a side goes outwards for, and what comes back.
    fn strips(&self, growth: &Growth) -> String {
        let scene = self.scene;
        let limit = |value: f64, key: &str| match value.is_finite() {
            true => format!("{value:.3} ({key})"),
            false => format!("none ({key} left out)"),
        };
        let back = match scene.returns_sheared() {
            true => format!(
                "there grains of packings come in their place: of {} grains each, sheared before the run at I of {:?} under one or two \
                 pressures (zones.returning, zones.sheared_inertial, zones.sheared_grains)",
                scene.sheared_grains(),
                scene.sheared_inertial(),
            ),
            false => "stored grains come back where the continuum has carried them".into(),
        };
        format!(
            "a side goes outwards, too, where the continuum beside it is sheared faster than I = {}, or what is stored there has been \
             sheared by more than {}; {back}",
            match (scene.zones.fastest_inertial, growth.fastest.is_finite()) {
                (None, true) => format!(
                    "{:.3} (computed: the calibrated law's range ends there; zones.fastest_inertial left out)",
                    growth.fastest
                ),
                _ => limit(growth.fastest, "zones.fastest_inertial"),
            },
            limit(growth.misplaced, "zones.misplaced_shear"),
        )
    }

    /// Where the box ends along x and y.
    fn edges_in_words(&self, d: f64) -> String {
        let scene = self.scene;
        let axes = [("x", scene.zones.x), ("y", scene.zones.y)].into_iter();
        let edges = scene.zone_edges(d).into_iter().zip(scene.container_edges());
        let words: Vec<String> = axes
            .zip(edges)
            .map(|((name, given), (edges, wall))| {
                let why = match (given, scene.zones.half_width) {
                    (Some(_), _) => format!("zones.{name} given"),
                    (None, Some(_)) => "zones.half_width given".into(),
                    (None, None) => "zones.half_width computed".into(),
                };
                let [low, high] = edges.map(|edge| match edge.abs() >= wall {
                    true => "the wall".into(),
                    false => format!("{edge:.4} m ({:.1} d)", edge / d),
                });
                format!("{name} from {low} to {high} ({why})")
            })
            .collect();
        words.join(", ")
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
            "spins across the box",
            match self.scene.zones.moving {
                true => "exchange of mass through the box but by whole strips",
                false => "exchange of mass through the box (it stays, and little moves there)",
            },
            "friction of the container's side walls on the continuum, slip on its floor",
        ]);
        own
    }

    fn plan(&self) -> Vec<(String, String)> {
        let mut lines = self.scene.plan();
        let scene = self.scene;
        let (Ok(materials), Ok(s)) = (
            scene.materials(&self.origin),
            scene.overlap_settings(&self.origin),
        ) else {
            return lines;
        };
        let d = scene.grain_diameter(&materials);
        let why = |given: Option<f64>| match given {
            Some(_) => "given",
            None => "computed",
        };
        lines.push((
            "zones".into(),
            format!(
                "grains in a box: {} (from the axis), {:.4} m ({:.1} d; zones.depth {}) deep below the surface, continuum beyond; {:.0} % of \
                 the grain-steps of a bed of grains",
                self.edges_in_words(d),
                scene.zone_depth(d),
                scene.zone_depth(d) / d,
                why(scene.zones.depth),
                100.0 * self.expected_shares()[0]
            ),
        ));
        let valid = self.law(DENSE).map_or(f64::INFINITY, |(_, valid)| valid);
        if let Some(growth) = scene.growth(d, &s, valid) {
            let travel = &growth.travel;
            let most = match scene.zones.budget {
                Some(most) => format!(
                    "to no more than {most} stored grains and the ball (zones.budget; packings may bring a few per cent more)"
                ),
                None => "as far as the container reaches (zones.budget left out)".into(),
            };
            lines.push((
                "box".into(),
                format!(
                    "moves by {:.4} m: a side goes outwards where the ball is nearer than {:.4} m (zones.near_diameters {}) to the inner end of its \
                     overlap, or grains beside that are faster than {:.3e} m/s (zones.wake_speed_scaled), {most}; inwards where they have been slower \
                     than {:.3e} m/s (zones.rest_speed_scaled) for {:.3e} s (zones.hold_scaled); predicted, if it comes to be as deep as a box that \
                     stays: {:.0} % of the grain-steps of a bed of grains in the end",
                    s.buffer,
                    growth.near,
                    why(scene.zones.near_diameters),
                    travel.wake,
                    travel.rest,
                    travel.hold,
                    100.0 * self.expected_shares()[1]
                ),
            ));
            lines.push(("strips".into(), self.strips(&growth)));
        }
        lines.push((
            "overlap".into(),
            format!(
                "from the box's sides inwards: {}, sideways pressure at rest forgotten in a strain of {}",
                overlap_words(&s, d),
                s.rest_strain
            ),
        ));
        let law = scene.continuum.calibrated.word().unwrap_or("none");
        lines.push((
            "continuum".into(),
            format!(
                "in space, the law calibrated for `{law}` (|τ|/p), cells of about {:.1} d",
                scene.zones.cell_diameters
            ),
        ));
        lines
    }

    fn steer_every(&self, timestep: f64) -> u64 {
        let settings = self.scene.overlap_settings(&self.origin);
        settings.map_or(u64::MAX, |s| Bowl::steps_of_loads(&s, timestep))
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

impl JoinedBed<'_> {
    /// Cost, mass and momentum.
    fn book(&self, ran: &mut Ran, bowl: &Bowl, summary: &mut Summary) {
        let steps = ran.simulation.steps_done();
        let before = ran.packing.grains.len() + 1;
        let monitors = bowl.monitors();
        let counted = summary.cost.grain_steps.min(steps * before as u64);
        summary.cost.grain_steps += monitors.grain_steps as u64;
        summary.cost.grain_steps -= counted;
        summary.cost.cell_steps = monitors.steps[1] as u64;
        if summary.cost.wall_s > 0.0 {
            summary.cost.grain_steps_per_s = summary.cost.grain_steps as f64 / summary.cost.wall_s;
            summary.cost.cell_steps_per_s = monitors.steps[1] / summary.cost.wall_s;
        }
        summary.model.grains = ran.simulation.grain_count() as u64;
        summary.model.cells = bowl.cells().count() as u64;
        let one = |value: f64| Quantity::new(value, "1");
        let share = monitors.grain_steps / (steps * before as u64) as f64;
        summary.put(
            "grain_steps_share",
            one(share).from("grain-steps of the run over those of the whole bed"),
        );
        let account = bowl.account(&ran.simulation);
        let grains = account.grains_error(bowl.grain_momentum(&mut ran.simulation));
        let exchange = account.exchange_error(bowl.owed(&ran.simulation));
        summary.ledger.mass_relative = bowl.volume_error();
        summary.ledger.momentum_relative = Some(grains.max(exchange));
        for (name, value, source) in [
            (
                "handshake_mass",
                bowl.mass_error(&ran.simulation),
                "mass of grains and continuum on their sides of the handshake surface over that of the bed, less 1",
            ),
            (
                "ledger_grains",
                grains,
                "momentum of grains and ball against its account, relative to the largest entry",
            ),
            (
                "ledger_exchange",
                exchange,
                "what the relaxation gave to both sides, relative to the largest entry",
            ),
        ] {
            summary.put(name, one(value).against(0.0, source));
        }
        for (name, impulse, source) in [
            ("weight", account.weight, "of grains and ball"),
            (
                "traction",
                account.traction,
                "of the continuum on the grains",
            ),
            ("impedance", account.impedance, "on the grains"),
            (
                "relaxation",
                account.relaxation,
                "on the grains; the continuum takes the opposite",
            ),
        ] {
            let name = format!("impulse_{name}_z");
            summary.put(&name, Quantity::new(impulse.z, "N s").from(source));
        }
    }

    /// What the monitors say, and in words what they should not.
    fn watch(&self, bowl: &Bowl, summary: &mut Summary) {
        let monitors = bowl.monitors();
        let d = bowl.spec().law.diameter;
        let slip = monitors.mean_slip() / self.scene.speed;
        let ratio = monitors.force_ratio();
        for (name, value, right, source) in [
            (
                "slip",
                slip,
                0.0,
                "rms difference of mean velocities at the handshake surface over the ball's speed, mean in time; to be below 1 %",
            ),
            (
                "largest_slip",
                monitors.largest_slip / self.scene.speed,
                0.0,
                "the same, at its largest",
            ),
            (
                "force_ratio",
                ratio,
                1.0,
                "of normal forces through the handshake surface, grains over continuum, means in time; to be within 5 %",
            ),
            (
                "rest_ratio",
                bowl.rest_ratio(),
                1.0,
                "K_0: horizontal over vertical stress of the grains when the box was cut, which the continuum remembers until it is sheared",
            ),
            (
                "relaxation_share",
                monitors.relaxation_share(),
                0.0,
                "impulse of the relaxation over that of the traction",
            ),
            (
                "grains_escaped",
                monitors.escaped,
                0.0,
                "most grains beyond the box by more than a diameter, at any exchange",
            ),
            (
                "box_moved",
                bowl.farthest_moved() / d,
                0.0,
                "farthest mean way of grains through a face of the box, outwards, in diameters: it should be small",
            ),
        ] {
            summary.put(name, Quantity::new(value, "1").against(right, source));
        }
        summary.put(
            "newton_iterations",
            Quantity::new(monitors.iterations / monitors.steps[0], "1")
                .from("of the continuum, a step"),
        );
        summary.put(
            "momentum_residual",
            Quantity::new(monitors.residual, "1").from("of the continuum, largest of any step"),
        );
        let misses = [
            (slip > MOST_SLIP, "the slip", slip),
            (
                (ratio - 1.0).abs() > MOST_RATIO,
                "the ratio of forces",
                ratio,
            ),
            (
                monitors.escaped > 0.0,
                "the number of grains beyond the box",
                monitors.escaped,
            ),
        ];
        for (_, what, value) in misses.into_iter().filter(|(misses, ..)| *misses) {
            summary
                .remarks
                .push(format!("Overlap: {what} is {value:.4}, outside its limit."));
        }
    }
}
