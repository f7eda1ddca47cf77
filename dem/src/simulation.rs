//! The simulation: one state, one step.

mod diverged;
mod lists;

pub use diverged::Diverged;
pub(crate) use lists::Layout;

use crate::bodies::Bodies;
use crate::bonds::Bonds;
use crate::boundaries::{Drain, MovingBox};
use crate::clumps::Clumps;
use crate::contact::composition::Visitor;
use crate::contact::{Interaction, LawTable, Step};
use crate::contacts::Touching;
use crate::domain::{Domain, Images};
use crate::forces::Field;
use crate::grains::Grains;
use crate::gravity::Gravity;
use crate::lanes::Width;
use crate::ledger::EnergyLedger;
use crate::loads::Loads;
use crate::motion::{self, Motion};
use crate::neighbours::Neighbours;
use crate::places::Places;
use crate::reach::Reach;
use crate::rows::Rows;
use crate::setup::{Setup, SetupError, Threads, check_gravity};
use crate::snapshot::GrainSample;
use crate::sweep::{self, Pass, Sweep};
use crate::team::OwnTeam;
use crate::walls::{Course, Scene, Span, Standing, Wall, WallContacts};
use lists::{LayoutOf, SKIN, hold_of, skin_of};
use nalgebra::Vector3;
use std::sync::Arc;

/// Most steps between two offers to threads to stand by.
const STEPS_A_CALL: u64 = 100;

/// A pass over all grains under the scene's law.
struct RunPass<'a> {
    simulation: &'a mut Simulation,
    pass: Pass,
    kick: f64,
}

impl Visitor for RunPass<'_> {
    type Output = f64;
    fn visit<I: Interaction>(self, law: &I) -> f64 {
        self.simulation.pass_law(law, self.pass, self.kick)
    }
}

/// Grains in motion.
#[derive(Clone, Debug)]
pub struct Simulation {
    pub(crate) domain: Domain,
    pub(crate) gravity: Vector3<f64>,
    pub(crate) law: Arc<LawTable>,
    pub(crate) layout: Layout,
    /// Largest gap that any established contact holds across (m).
    pub(crate) hold: f64,
    pub(crate) walls: Vec<Standing>,
    pub(crate) timestep: f64,
    pub(crate) parallel: bool,
    pub(crate) team: OwnTeam,
    /// Registers that steps use; all give the same bits.
    pub(crate) width: Width,
    pub(crate) skin: f64,
    pub(crate) grains: Grains,
    /// Grains of the setup, and the number that the next grain will get.
    pub(crate) setup_grains: usize,
    pub(crate) next_id: u32,
    pub(crate) list: Neighbours,
    pub(crate) reach: Reach,
    pub(crate) wall_contacts: WallContacts,
    /// Bodies; their parts stand behind the walls.
    pub(crate) bodies: Bodies,
    /// Grains that move as one.
    pub(crate) clumps: Clumps,
    pub(crate) loads: Loads,
    pub(crate) bonds: Bonds,
    pub(crate) fields: Gravity,
    pub(crate) moving_box: MovingBox,
    pub(crate) drain: Drain,
    /// Rows by grain number, as of the last build of lists with loads.
    pub(crate) places: Places,
    /// Histories on their way to new lists.
    touching: Touching,
    /// For each row, the square of the largest speed against its drift (m²/s²).
    pub(crate) fastest: Vec<f64>,
    /// Fixed grains in order, and the momentum each has taken since it was last counted (N s).
    fixed: Vec<u32>,
    taken: Vec<[f64; 4]>,
    /// Momentum taken by fixed grains and walls since the start (N s).
    pub(crate) impulse: [f64; 3],
    /// Momentum that grains and walls together must hold by now: that of the start plus what gravity
    /// gave (N s).
    pub(crate) account: Vector3<f64>,
    /// Mass of the free grains (kg).
    weighed: f64,
    /// Whether slots and totals hold the forces of the present positions.
    current: bool,
    /// Sums of all grains, for observers.
    pub(crate) totals: Vec<[[f64; 4]; 3]>,
    /// Whether springs are already stretched to the present positions.
    pub(crate) springs_current: bool,
    /// The same, before the forces of the present positions were looked at out of turn.
    springs_were_current: bool,
    pub(crate) steps: u64,
    /// Steps since velocities were last given: the first kick after that is half a step.
    pub(crate) steps_since_start: u64,
    pub(crate) deepest: f64,
    pub(crate) ledger: Option<EnergyLedger>,
    rebuilds: u64,
}

/// Walls at the start.
fn stand(walls: Vec<Wall>, timestep: f64) -> Vec<Standing> {
    let before = Span::ending(0, timestep);
    let walls = walls.into_iter();
    walls
        .map(|wall| Standing::at(wall, before, Course::default()))
        .collect()
}

impl Simulation {
    /// Checks a setup and makes it ready to step.
    pub fn new(setup: Setup) -> Result<Simulation, SetupError> {
        let mut simulation = Simulation::unlisted(setup)?;
        simulation.rebuild();
        simulation.open_account();
        Ok(simulation)
    }

    /// A simulation whose lists are still to be built or restored.
    pub(crate) fn unlisted(setup: Setup) -> Result<Simulation, SetupError> {
        let radii = || setup.grains.iter().map(|g| g.radius);
        let smallest = radii().fold(f64::INFINITY, f64::min);
        let largest_radius = radii().fold(0.0, f64::max);
        let skin = skin_of(smallest);
        // Grains that are still to come bring their own skin, and meet this check when they do.
        let own = if setup.grains.is_empty() { 0.0 } else { skin };
        let law = setup.validate(own)?;
        let mut walls = stand(setup.walls, setup.timestep);
        let bodies = Bodies::new(setup.bodies, &mut walls, &law, setup.timestep)?;
        Ok(Simulation {
            domain: setup.domain,
            gravity: setup.gravity,
            layout: law.visit(LayoutOf),
            hold: hold_of(&law, largest_radius),
            law: Arc::new(law),
            walls,
            bodies,
            clumps: Clumps::default(),
            timestep: setup.timestep,
            parallel: setup.threads == Threads::Rayon,
            team: OwnTeam::default(),
            width: Width::widest(),
            skin,
            grains: Grains::new(&setup.grains),
            setup_grains: setup.grains.len(),
            next_id: setup.grains.len() as u32,
            list: Neighbours::default(),
            reach: Reach::new(skin / SKIN),
            wall_contacts: WallContacts::default(),
            loads: Loads::default(),
            bonds: Bonds::default(),
            fields: Gravity::default(),
            moving_box: MovingBox::default(),
            drain: Drain::default(),
            places: Places::default(),
            touching: Touching::default(),
            fastest: Vec::new(),
            fixed: Vec::new(),
            taken: Vec::new(),
            impulse: [0.0; 3],
            account: Vector3::zeros(),
            weighed: 0.0,
            current: false,
            totals: Vec::new(),
            springs_current: false,
            springs_were_current: false,
            steps: 0,
            steps_since_start: 0,
            deepest: 0.0,
            ledger: None,
            rebuilds: 0,
        })
    }

    /// Integrates `steps` steps.
    pub fn advance(&mut self, steps: u64) -> Result<(), Diverged> {
        let helpers = if self.parallel {
            self.reach.chunks.len().min(rayon::current_num_threads()) - 1
        } else {
            0
        };
        let team = self.team.share();
        let mut left = steps;
        while left > 0 {
            // Threads that could not be taken on come again with the next call.
            let now = left.min(STEPS_A_CALL);
            team.with_helpers(helpers, || (0..now).try_for_each(|_| self.step()))?;
            left -= now;
        }
        self.check()
    }

    fn step(&mut self) -> Result<(), Diverged> {
        let started = self.steps_since_start > 0;
        let kick = if started { 1.0 } else { 0.5 } * self.timestep;
        if self.ledger.is_some() {
            self.evaluate_forces();
            self.book_energy(kick);
        }
        self.pass(
            if self.current {
                Pass::Motion
            } else {
                Pass::Step
            },
            kick,
        );
        self.keep_accounts(kick);
        self.move_box();
        self.steps += 1;
        self.steps_since_start += 1;
        self.follow_schedule();
        self.current = false;
        self.springs_current = false;
        self.keep_lists()?;
        self.steer_box();
        self.let_out();
        Ok(())
    }

    /// Evaluates the forces of the present positions for an observer, remembering the springs as
    /// they were: a checkpoint taken afterwards goes on with the same bits.
    pub(crate) fn observe(&mut self) {
        if self.current {
            return;
        }
        self.reach.remember();
        self.bonds.remember();
        self.wall_contacts.remember();
        self.bodies.remember();
        self.springs_were_current = self.springs_current;
        self.evaluate_forces();
    }

    /// Takes back an observation's stretching of springs.
    pub(crate) fn forget_observation(&mut self) {
        if !self.current {
            return;
        }
        self.reach.recall();
        self.bonds.recall();
        self.wall_contacts.recall();
        self.bodies.recall();
        self.springs_current = self.springs_were_current;
        self.current = false;
    }

    /// Forces of the present positions into the slots of all pairs and the totals of all grains.
    fn evaluate_forces(&mut self) {
        if !self.current {
            self.pass(Pass::Forces, 0.0);
            self.totals.resize(self.grains.len(), [[0.0; 4]; 3]);
            let (walls, rows) = (&self.wall_contacts, self.slot_rows());
            motion::total(&self.reach, walls, &self.loads, rows, &mut self.totals);
            self.current = true;
        }
    }

    fn pass(&mut self, pass: Pass, kick: f64) {
        let law = Arc::clone(&self.law);
        let deepest = law.visit(RunPass {
            simulation: self,
            pass,
            kick,
        });
        self.deepest = self.deepest.max(deepest);
    }

    /// Sweeps over all grains; springs stretch by the step just made.
    fn pass_law<I: Interaction>(&mut self, law: &I, pass: Pass, kick: f64) -> f64 {
        let stretch = self.steps_since_start > 0 && !self.springs_current;
        let step = Step {
            stretch: if stretch { self.timestep } else { 0.0 },
        };
        self.springs_current = true;
        let lever = self.law.lever();
        let team = self.team.share();
        let mut walls = if pass == Pass::Motion {
            0.0
        } else {
            let scene = Scene {
                grains: &self.grains,
                domain: &self.domain,
                lever,
                step,
                threads: self.reach.chunks.len(),
                team: &team,
            };
            self.wall_contacts.evaluate(law, &mut self.walls, &scene)
        };
        if pass != Pass::Motion {
            if !self.bodies.is_empty() {
                self.lay_body_loads();
                let bodies = &mut self.bodies;
                walls = walls.max(bodies.evaluate(law, &mut self.walls, &self.domain, step));
            }
            self.evaluate_loads(step.stretch);
        }
        let (g, images) = (self.gravity, Images::of(&self.cell()));
        let grains = &mut self.grains;
        // SAFETY: a sweep moves the grains of each chunk, and writes what is theirs, on one thread; other
        // chunks read copies, which are made before anything is moved (`sweep.rs`).
        let rows = unsafe {
            Rows::of(
                &mut grains.place,
                &mut grains.motion,
                &mut grains.turn,
                &mut self.fastest,
                &mut self.taken,
            )
        };
        let sweep = Sweep {
            pass,
            width: self.width,
            parallel: self.parallel && self.reach.parallel,
            team: &team,
            field: Field {
                rows,
                material: &grains.material,
                dummy: grains.id.len() as u32,
                images,
                lever,
                hold: self.hold,
                step,
            },
            walls: &self.wall_contacts,
            loads: &self.loads,
            totals: &self.totals,
            rows: &self.list.rows,
            motion: Motion {
                gravity: [g.x, g.y, g.z, 0.0],
                kick,
                drift: self.timestep,
            },
            fixed: &self.fixed,
        };
        let pairs = sweep::run(law, &sweep, &mut self.reach.chunks);
        pairs.max(walls)
    }

    /// Books what a step has done to momentum and to the lists' lifetimes, and moves the walls.
    fn keep_accounts(&mut self, kick: f64) {
        let next = Span::ending(self.steps + 1, self.timestep);
        let walls = self.walls.iter_mut();
        for wall in walls.filter(|wall| wall.carrier.is_none()) {
            for (sum, force) in self.impulse.iter_mut().zip(wall.load.force.iter()) {
                *sum += kick * force;
            }
            wall.impulse.take(&wall.load, kick);
            wall.advance(next);
        }
        if !self.bodies.is_empty() {
            self.step_bodies(kick);
        }
        if !self.clumps.is_empty() {
            self.step_clumps(kick);
        }
        self.account += kick * (self.weighed * self.gravity + self.loads.external);
        self.list.age += self.timestep;
        self.reach.age += self.timestep;
        self.reach.steps += 1;
        let (dt, mut farthest) = (self.timestep, 0.0);
        // Of two grains seen through a moving boundary each takes half of its speed.
        let images = 0.5 * self.moving_box.drift.fastest();
        for (r, fastest) in self.fastest.iter().enumerate() {
            let travel = dt * (fastest.sqrt() + images);
            self.list.travel[r] += travel;
            self.reach.travel[r] += travel;
            // Not a number stays.
            if travel > farthest || travel.is_nan() {
                farthest = travel;
            }
        }
        let list = &mut self.list;
        list.watch.spend(&mut list.allowance, farthest, dt);
        list.watch.spend(&mut self.reach.allowance, farthest, dt);
    }

    /// Adds what fixed grains have taken to the total, in their order.
    pub(crate) fn fold_impulses(&mut self) {
        for taken in &mut self.taken {
            for (sum, taken) in self.impulse.iter_mut().zip(std::mem::take(taken)) {
                *sum += taken;
            }
        }
    }

    /// Rows of a contact's slot under the scene's law.
    pub(crate) fn slot_rows(&self) -> usize {
        self.layout.slot_rows
    }

    /// Sets the velocities of all free grains; spins and contacts stay. A clump gets the momentum of its
    /// members, less what its turning gives them.
    pub fn give_velocity(&mut self, mut f: impl FnMut(&GrainSample) -> Vector3<f64>) {
        self.wrap_grains();
        let samples = self.samples();
        let mut given = Vec::with_capacity(samples.len());
        for (i, sample) in samples.iter().enumerate() {
            if sample.fixed {
                given.push(Vector3::zeros());
                continue;
            }
            let (v, s) = (f(sample), sample.spin * sample.radius);
            given.push(v);
            self.grains.motion[i][..3].copy_from_slice(v.as_slice());
            self.grains.turn[i][..3].copy_from_slice(s.as_slice());
        }
        self.launch_clumps(&given);
        self.restart_motion();
    }

    /// Holds still every free grain for which `f` says so, with all others of its clump; it becomes part of the
    /// walls.
    ///
    /// # Errors
    /// If the box moves. Nothing has changed then.
    pub fn fix(&mut self, mut f: impl FnMut(&GrainSample) -> bool) -> Result<(), SetupError> {
        let marks = self.marked(|sample| !sample.fixed && f(sample));
        let count = marks.iter().filter(|&&marked| marked).count();
        self.refuse_in_moving_box("grains to be fixed, their number", count)?;
        let mut any = false;
        self.drop_clumps(&marks);
        for (i, marked) in marks.into_iter().enumerate() {
            if marked {
                self.grains.motion[i] = [0.0; 4];
                self.grains.turn[i][..3].fill(0.0);
                any = true;
            }
        }
        if any {
            // The row's drift was the mean of other velocities: let the bound start afresh.
            self.rebuild();
            self.open_account();
        }
        Ok(())
    }

    /// Velocities now belong to the time of the positions, not to half a step before.
    fn restart_motion(&mut self) {
        self.synchronise_bodies();
        self.steps_since_start = 0;
        self.bodies.place(&mut self.walls);
        self.rebuild();
        self.open_account();
    }

    /// Starts the momentum account with what there is now.
    pub(crate) fn open_account(&mut self) {
        self.weigh();
        self.account = self.leapfrog_momentum() + self.wall_impulse();
        if self.ledger.is_some() {
            self.open_energy_ledger();
        }
    }

    /// Notes the mass that gravity acts on.
    pub(crate) fn weigh(&mut self) {
        let bodies = self.bodies.rigid.iter().map(|body| body.free_mass());
        self.weighed = self.free_mass() + bodies.sum::<f64>();
    }

    /// Time since the start (s).
    pub fn time(&self) -> f64 {
        self.steps as f64 * self.timestep
    }

    /// Steps since the start.
    pub fn steps_done(&self) -> u64 {
        self.steps
    }

    /// Length of a step (s).
    pub fn timestep(&self) -> f64 {
        self.timestep
    }

    /// The box.
    pub fn domain(&self) -> &Domain {
        &self.domain
    }

    /// The laws of all pairs of materials.
    pub fn law(&self) -> &LawTable {
        &self.law
    }

    /// Acceleration of gravity (m/s²).
    pub fn gravity(&self) -> Vector3<f64> {
        self.gravity
    }

    /// Changes gravity from the next step on; a schedule ends.
    ///
    /// # Errors
    /// If a number is not finite. Nothing has changed then.
    pub fn set_gravity(&mut self, gravity: Vector3<f64>) -> Result<(), SetupError> {
        check_gravity(&gravity)?;
        self.fields.schedule = None;
        self.gravity = gravity;
        Ok(())
    }

    /// Number of grains, fixed ones included.
    pub fn grain_count(&self) -> usize {
        self.grains.len()
    }

    /// Largest overlap of any contact at any step since the start, over the harmonic mean of the two
    /// radii (the radius, for equal grains and for walls).
    pub fn largest_overlap(&self) -> f64 {
        self.deepest
    }

    /// How often the Verlet list was built.
    pub fn list_builds(&self) -> u64 {
        self.rebuilds
    }

    /// Lets steps use these registers instead of the widest: slower, and the same bits. False, and nothing is changed, where
    /// the processor does not have them.
    #[must_use]
    pub fn set_width(&mut self, width: Width) -> bool {
        let present = Width::present().any(|has| has == width);
        if present {
            self.width = width;
        }
        present
    }

    /// Shares steps out over the current rayon pool, or not. The results are the same bits.
    pub fn set_threads(&mut self, threads: Threads) {
        let parallel = threads == Threads::Rayon;
        if parallel != self.parallel {
            self.parallel = parallel;
            self.forget_observation();
            self.deal_anew();
        }
    }
}
