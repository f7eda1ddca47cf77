//! A packing put into its world: laws, walls, fields, bonds, and the step.

use super::recipe::Recipe;
use crate::failure::Failure;
use crate::scene::world::Materials;
use colluvium_dem::preparation::Packing;
use colluvium_dem::timestep::{self, Choice, Conditions, Shares};
use colluvium_dem::{
    Body, BondRule, BoxMotion, Clump, Domain, Freedom, Grain, HeavySphere, Outlet, Partner, Record,
    Region, Schedule, SelfGravity, Setup, SetupError, Simulation, Snapshot, Threads, Touched, Wall,
};
use nalgebra::Vector3;

/// What surrounds the grains.
#[derive(Clone, Debug)]
pub struct World {
    /// The box; none: open space around the packing.
    pub domain: Option<Domain>,
    /// Uniform acceleration at the start (m/s²).
    pub gravity: Vector3<f64>,
    /// Uniform acceleration in time.
    pub schedule: Option<Schedule>,
    /// A heavy sphere.
    pub sphere: Option<HeavySphere>,
    /// Attraction of the grains by each other.
    pub own_gravity: Option<SelfGravity>,
    /// Walls with their names.
    pub walls: Vec<(String, Wall)>,
    /// Rigid bodies with their names.
    pub bodies: Vec<(String, Body)>,
    /// Grains that move as one, by number.
    pub clumps: Vec<Clump>,
    /// Bonds that are made at the start.
    pub bonds: Vec<BondRule>,
    /// Where bonds are taken away again.
    pub cracks: Vec<Region>,
    /// How a periodic box moves.
    pub box_motion: BoxMotion,
    /// Where grains leave the world.
    pub outlet: Option<Outlet>,
    /// Grains that join the packing at the start, behind it in number.
    pub grains: Vec<Grain>,
    /// Velocity that all free grains are given (m/s).
    pub velocity: Option<Vector3<f64>>,
    /// Largest speed of two surfaces against each other beyond that of the start and of a fall (m/s).
    pub speed: f64,
    /// Time that is simulated at most (s).
    pub duration: f64,
}

impl World {
    /// Open space, no gravity, no walls, for a time (s).
    pub fn empty(duration: f64) -> World {
        World {
            domain: None,
            gravity: Vector3::zeros(),
            schedule: None,
            sphere: None,
            own_gravity: None,
            walls: Vec::new(),
            bodies: Vec::new(),
            clumps: Vec::new(),
            bonds: Vec::new(),
            cracks: Vec::new(),
            box_motion: BoxMotion::Rest,
            outlet: None,
            grains: Vec::new(),
            velocity: None,
            speed: 0.0,
            duration,
        }
    }
}

/// Everything that a run is made from.
#[derive(Clone, Debug)]
pub struct Stand {
    /// The world.
    pub world: World,
    /// Grains, walls, laws and the step.
    pub setup: Setup,
    /// The limits of the step and what they allow.
    pub choice: Choice,
    /// Steps of the whole run.
    pub steps: u64,
}

/// Deepest overlap of a body at the start, over the radius of a grain or the rounding of its edges.
const DEEPEST: f64 = 0.2;

/// Most steps of a run.
const MOST_STEPS: f64 = 1.0e10;

impl Stand {
    /// A packing in the world of a recipe.
    pub fn new(
        recipe: &dyn Recipe,
        packing: &Packing,
        materials: &Materials,
        threads: Threads,
        origin: &str,
    ) -> Result<Stand, Failure> {
        let world = recipe.world(packing, materials, origin)?;
        let refused = |error: SetupError| Failure::Input(format!("{origin}: {error}"));
        let mut grains = packing.grains.clone();
        if let Some(velocity) = world.velocity {
            for grain in grains.iter_mut().filter(|g| !g.fixed) {
                grain.velocity += velocity;
            }
        }
        grains.extend(&world.grains);
        let mut setup = Setup {
            domain: world.domain.unwrap_or(packing.domain),
            gravity: world.gravity,
            law: materials.laws.clone(),
            grains,
            walls: world.walls.iter().map(|(_, wall)| wall.clone()).collect(),
            bodies: world.bodies.iter().map(|(_, body)| body.clone()).collect(),
            timestep: 1.0,
            threads,
        };
        let choice = world
            .choose_step(&setup, recipe.keys().step.safety)
            .map_err(refused)?;
        setup.timestep = match recipe.keys().step.seconds {
            Some(seconds) => seconds * recipe.keys().coarse_graining * recipe.keys().step.safety,
            None => choice.seconds,
        };
        if !(setup.timestep.is_finite() && setup.timestep > 0.0) {
            return Err(Failure::Input(format!(
                "{origin}: nothing limits the step: key `timestep.seconds` is missing; wanted: a step in s"
            )));
        }
        if let Some(limit) = choice.broken_by(setup.timestep) {
            return Err(Failure::Input(format!(
                "{origin}: key `timestep` asks for steps of {:.4e} s; allowed: below {:.4e} s, from where on one \
                 contact is unstable ({}, {}); {:.3e} s would do",
                setup.timestep,
                limit.seconds,
                limit.name,
                limit.pair,
                choice.allowed()
            )));
        }
        let steps = (world.duration / setup.timestep - 1e-6).ceil();
        if steps > MOST_STEPS {
            return Err(Failure::Input(format!(
                "{origin}: the run would take {steps:.3e} steps of {:.3e} s; allowed: at most {MOST_STEPS:e}: a shorter time, \
                 larger parcels (key `coarse_graining`) or softer grains (key `contact`)",
                setup.timestep
            )));
        }
        Ok(Stand {
            steps: (steps as u64).max(1),
            world,
            setup,
            choice,
        })
    }

    /// The simulation at its start.
    pub fn start(&self) -> Result<Simulation, SetupError> {
        let world = &self.world;
        let mut simulation = Simulation::new(self.setup.clone())?;
        if !world.clumps.is_empty() {
            simulation.clump(&world.clumps)?;
        }
        for rule in &world.bonds {
            simulation.bond(rule)?;
        }
        for crack in &world.cracks {
            simulation.cut_bonds(crack);
        }
        simulation.set_gravity_schedule(world.schedule.clone());
        simulation.set_heavy_sphere(world.sphere)?;
        simulation.set_self_gravity(world.own_gravity)?;
        if world.box_motion != BoxMotion::Rest {
            simulation.set_box_motion(world.box_motion.clone())?;
        }
        simulation.set_outlet(world.outlet.clone())?;
        Ok(simulation)
    }

    /// Checks that bodies have room at the start.
    pub fn check_room(&self, simulation: &mut Simulation, origin: &str) -> Result<(), Failure> {
        let names = |body: usize| self.world.bodies[body].0.as_str();
        let refuse = |body: usize, reaches: String| {
            // The grains are in place by now: a run has begun.
            Err(Failure::Run(format!(
                "{origin}: bodies.{}: {reaches}; allowed: a place where it has room: keys `point`, `turn_degrees`",
                names(body)
            )))
        };
        let mut seen = Snapshot::default();
        simulation.snapshot(&mut seen);
        for contact in &seen.contacts {
            let Partner::Body(body) = contact.partner else {
                continue;
            };
            let grain = &seen.grains[contact.grain];
            if contact.overlap > DEEPEST * grain.radius {
                let at = grain.position;
                let reaches = format!(
                    "it reaches {:.3e} m into grain {} of radius {:.3e} m at ({:.4e}, {:.4e}, {:.4e})",
                    contact.overlap, grain.id, grain.radius, at.x, at.y, at.z
                );
                return refuse(body, reaches);
            }
        }
        for contact in &seen.body_contacts {
            let parts = &self.world.bodies[contact.body].1.parts;
            let rounding = parts
                .iter()
                .map(|p| p.rounding)
                .fold(f64::INFINITY, f64::min);
            if contact.overlap > DEEPEST * rounding {
                let other = match contact.partner {
                    Touched::Wall(wall) => format!("the wall {}", self.world.walls[wall].0),
                    Touched::Body(body) => format!("the body {}", names(body)),
                };
                return refuse(
                    contact.body,
                    format!("it reaches {:.3e} m into {other}", contact.overlap),
                );
            }
        }
        Ok(())
    }

    /// The simulation at a checkpoint of it.
    pub fn resume(&self, record: &Record) -> Result<Simulation, SetupError> {
        let mut simulation = Simulation::resume(self.setup.clone(), record)?;
        // All else is in the record.
        simulation.set_outlet(self.world.outlet.clone())?;
        Ok(simulation)
    }
}

impl World {
    /// Largest speed of the bodies at the start, with a fall to the lowest grain or wall (m/s).
    pub fn speed_of_bodies(&self, packing: &Packing) -> f64 {
        let g = self.gravity.norm();
        let depth = |x: &Vector3<f64>| x.dot(&self.gravity) / g.max(f64::MIN_POSITIVE);
        let grains = packing.grains.iter().map(|grain| depth(&grain.position));
        let walls = self.walls.iter().map(|(_, w)| depth(&w.pose.position));
        let lowest = grains.chain(walls).fold(f64::NEG_INFINITY, f64::max);
        let speed = |body: &Body| {
            let fall = (lowest - depth(&body.pose.position)).max(0.0);
            let fall = if fall.is_finite() { fall } else { 0.0 };
            let parts = body.parts.iter();
            let far = parts.map(|p| p.pose.position.norm() + p.solid.extent());
            let turning = body.spin.norm() * far.fold(0.0, f64::max);
            body.velocity.norm() + turning + (2.0 * g * fall).sqrt()
        };
        let bodies = self
            .bodies
            .iter()
            .filter(|(_, b)| b.freedom == Freedom::Free);
        bodies.map(|(_, body)| speed(body)).fold(0.0, f64::max)
    }

    /// The limits of the step and the step they allow: contacts at the speeds to be expected, and bonds.
    fn choose_step(&self, setup: &Setup, safety: f64) -> Result<Choice, SetupError> {
        let fall = Conditions::of(&setup.grains, &self.gravity);
        let conditions = Conditions {
            speed: fall.speed + self.speed,
            ..fall
        };
        let choice = setup.choose_step(&conditions, &Shares::default())?;
        let mut limits = choice.all;
        for rule in &self.bonds {
            let bonds =
                |g: &&Grain| rule.materials.is_empty() || rule.materials.contains(&g.material);
            let lightest = setup
                .grains
                .iter()
                .filter(bonds)
                .min_by(|a, b| a.radius.total_cmp(&b.radius));
            if let Some(grain) = lightest {
                rule.cement.validate()?;
                limits.push(rule.cement.limit(grain, grain));
            }
        }
        Ok(timestep::choose(limits, safety))
    }
}
