//! A cliff whose grains become a continuum when it has come down.
//!
//! Up to then it is the cliff of grains, the same to the bit: it stands, the crack opens, it fails, falls and hits. Once
//! the kinetic energy is past its peak and down to a share of it and the debris lies no steeper than a slope (pieces that
//! stand may tip over, which their contacts decide), all that lay before the crack or has come before it changes hands as a whole (`coupling::handover`); the grains behind are held from then on. The continuum runs out over
//! what is left of the cliff (`runout.rs`) until it rests.
//!
//! Where the debris as a whole stands more steeply, the part of it that lies (`lying.rs`) goes by itself; what stands goes on as
//! grains, with the continuum as ground that takes their push (`standing.rs`, `coupling::debris_ground`), until more of it lies.

mod broken;
mod findings;
mod lying;
mod standing;

use super::debris::Pile;
use super::record::CliffRecord;
use super::runout::{Runout, nothing_yet};
use super::watch::EDGE;
use super::{STILL, STILL_LOOKS, bonds_that_survive, comet};
use crate::failure::Failure;
use crate::run::world::boulders::boulders;
use crate::run::world::{Course, Expected, Ran, Recipe, as_the_scene, fragments};
use crate::scene::CliffScene;
use crate::scene::world::Materials;
use crate::summary::Summary;
use crate::table::Table;
use crate::vtkhdf::Frame;
use broken::Broken;
use colluvium_dem::{Grain, Simulation, Snapshot};
use standing::{Standing, clock, free_grains};
use std::collections::BTreeSet;
use std::sync::{Mutex, MutexGuard, PoisonError};

/// A cliff, and what is alive of its debris.
pub struct JoinedCliff<'a> {
    scene: &'a CliffScene,
    origin: String,
    live: Mutex<Option<Live>>,
}

impl std::fmt::Debug for JoinedCliff<'_> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "a joined cliff of {}", self.origin)
    }
}

/// What was broken when the grains became continuum, and the continuum.
struct Live {
    broken: Broken,
    runout: Runout,
    /// What went on as grains beside it, if not all was handed over at once.
    standing: Option<Standing>,
}

impl Live {
    /// What stands beside the continuum now.
    fn beside(&mut self) -> Option<(&mut Runout, &mut Standing)> {
        match &mut self.standing {
            Some(standing) if standing.free > 0 => Some((&mut self.runout, standing)),
            _ => None,
        }
    }
}

/// What is to become continuum: numbers of grains, and whether nothing stands after it.
struct Due {
    grains: BTreeSet<u32>,
    last: bool,
}

impl<'a> JoinedCliff<'a> {
    /// Before anything runs.
    pub fn new(scene: &'a CliffScene, origin: &str) -> Self {
        Self {
            scene,
            origin: origin.to_owned(),
            live: Mutex::new(None),
        }
    }

    fn live(&self) -> MutexGuard<'_, Option<Live>> {
        self.live.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// The record of the cliff and what follows it in a memory; none at the start.
    fn parts(memory: &[f64]) -> (Vec<f64>, &[f64]) {
        match memory.split_first() {
            Some((length, rest)) => {
                let (record, rest) = rest.split_at((*length as usize).min(rest.len()));
                (record.to_vec(), rest)
            }
            None => (Vec::new(), &[]),
        }
    }

    /// Brings back what is alive, if the grains have been handed over.
    fn recall(&self, guard: &mut Option<Live>, memory: &[f64]) -> Result<(), Failure> {
        if guard.is_some() {
            return Ok(());
        }
        let (_, rest) = Self::parts(memory);
        if rest.is_empty() {
            return Ok(());
        }
        let damaged = || Failure::damaged("recipe/state");
        let (broken, rest) = Broken::read(rest).ok_or_else(damaged)?;
        let (stands, rest) = rest.split_first().ok_or_else(damaged)?;
        let (standing, rest) = if *stands > 0.0 {
            let (standing, rest) = Standing::read(rest).ok_or_else(damaged)?;
            (Some(standing), rest)
        } else {
            (None, rest)
        };
        let runout = Runout::read(self.scene, &self.origin, rest).ok_or_else(damaged)?;
        *guard = Some(Live {
            broken,
            runout,
            standing,
        });
        Ok(())
    }

    fn remember(record: &[f64], live: Option<&Live>, state: &mut Vec<f64>) {
        state.clear();
        state.push(record.len() as f64);
        state.extend(record);
        if let Some(live) = live {
            live.broken.write(state);
            state.push(f64::from(u8::from(live.standing.is_some())));
            if let Some(standing) = &live.standing {
                standing.write(state);
            }
            live.runout.write(state);
        }
    }

    /// Numbers of the grains that are debris: free, and before the crack at the start or now.
    fn debris(&self, record: &CliffRecord, simulation: &Simulation) -> BTreeSet<u32> {
        let before: BTreeSet<u32> = record.face.iter().map(|g| g[0] as u32).collect();
        let free = free_grains(simulation).into_iter();
        free.filter(|g| before.contains(&g.id) || self.scene.before_crack(&g.position))
            .map(|g| g.id)
            .collect()
    }

    /// The grains that are to become continuum now; none if it is not the time.
    fn due(
        &self,
        record: &CliffRecord,
        simulation: &mut Simulation,
        live: Option<&Live>,
    ) -> Option<Due> {
        let [peak, when] = record.times.peak;
        let kinetic = simulation.energy().kinetic();
        let calm = !record.times.failed.is_nan()
            && simulation.time() > when
            && kinetic <= self.scene.runout.kinetic_share * peak;
        let d = self.scene.diameter()?;
        if !calm {
            return None;
        }
        let debris = match live {
            None => self.debris(record, simulation),
            // What is behind the crack is held by now: all that is free came down or stands before it.
            Some(_) => free_grains(simulation).iter().map(|g| g.id).collect(),
        };
        if debris.is_empty() {
            return None;
        }
        let parcels = live.map_or_else(Vec::new, |live| live.runout.parcels());
        let base = record.heap.solid_fraction * simulation.domain().lengths().y;
        // With what has run out as a continuum a pillar beside it would be part of a flat wedge.
        if live.is_none() && self.lies(simulation, (d, base)) {
            return Some(Due {
                grains: debris,
                last: true,
            });
        }
        let least = self.scene.runout.least_share;
        if least >= 1.0 {
            return None;
        }
        let grains = self.scene.lying(simulation, &debris, parcels, (d, base));
        let rows = free_grains(simulation).into_iter();
        let volume = rows.filter(|g| grains.contains(&g.id));
        let volume = volume.map(|g| 4.0 / 3.0 * std::f64::consts::PI * g.radius.powi(3));
        let whole = base * self.scene.areas()[1];
        let enough = volume.sum::<f64>() >= least * whole;
        let last = grains.len() == debris.len();
        enough.then_some(Due { grains, last })
    }

    /// Whether the debris lies rather than stands, by its thickness alone: on a steep slope what lies is no pillar.
    fn lies(&self, simulation: &mut Simulation, (d, base): (f64, f64)) -> bool {
        let axis = self.scene.heap_axis(d);
        let heights = self.scene.heights(&simulation.grain_list(), &axis, base);
        let pile = Pile::of([&axis.positions(), &heights], 0.0, EDGE * d, |_| 0.0);
        pile.is_none_or(|p| p.wedge_degrees() <= self.scene.runout.steepest_degrees)
    }

    /// How broken what is still grains is.
    fn broken(&self, record: &CliffRecord, simulation: &mut Simulation, begun: f64) -> Broken {
        let mut ids: Vec<u32> = simulation.held(|_| true).map(|g| g.id).collect();
        ids.sort_unstable();
        let listed = simulation.grain_list();
        let now = fragments::touching(simulation).into_iter();
        let now: BTreeSet<[u32; 2]> = now.map(|pair| pair.map(|k| ids[k as usize])).collect();
        let here = |id: &u32| ids.binary_search(id).is_ok();
        let pairs = record.pairs.iter().filter(|pair| pair.iter().all(here));
        let held = pairs.clone().filter(|pair| now.contains(*pair)).count();
        // The face's grains go by their numbers.
        let mut face = CliffRecord::default();
        let mut grains = Vec::new();
        for row in &record.face {
            if let Ok(k) = ids.binary_search(&(row[0] as u32)) {
                face.face.push([grains.len() as f64, row[1], row[2]]);
                grains.push(listed[k]);
            }
        }
        let table = boulders(&simulation.clusters(), self.scene.material.solid_fraction());
        Broken {
            counts: [begun, grains.len() as f64],
            held: held as f64 / pairs.count().max(1) as f64,
            turned: self.scene.turned(&face, &grains),
            bonds: bonds_that_survive(simulation),
            boulders: table.columns.iter().map(|c| c.values.clone()).collect(),
        }
    }

    /// Makes continuum of what is due. At the first time what lies behind the crack is held, at the last all that is left.
    fn hand_over(
        &self,
        record: &CliffRecord,
        simulation: &mut Simulation,
        live: Option<Live>,
        due: &Due,
    ) -> Result<Live, Failure> {
        let scene = self.scene;
        let broken = match &live {
            Some(live) => live.broken.clone(),
            None => self.broken(record, simulation, simulation.steps_done() as f64),
        };
        let mut ids: Vec<u32> = simulation.held(|_| true).map(|g| g.id).collect();
        ids.sort_unstable();
        let listed = simulation.grain_list();
        let all = match &live {
            None => self.debris(record, simulation),
            Some(_) => free_grains(simulation).iter().map(|g| g.id).collect(),
        };
        let of = |set: &BTreeSet<u32>| -> Vec<Grain> {
            let rows = ids.iter().zip(&listed).filter(|(id, _)| set.contains(id));
            rows.map(|(_, grain)| *grain).collect()
        };
        let (time, going) = (simulation.time(), of(&due.grains));
        let (mut runout, mut standing) = match live {
            Some(mut live) => {
                live.runout.join(scene, &going, time)?;
                (live.runout, live.standing)
            }
            None => {
                // Its law is that of all that may become continuum.
                let debris = of(&all);
                let mass: f64 = debris.iter().map(Grain::mass).sum();
                let volume: f64 = debris.iter().map(Grain::volume).sum();
                let materials = CliffScene::materials(scene, &self.origin)?;
                let d = comet::diameter(&materials);
                let law = scene
                    .runout
                    .law(d, mass / volume, record.heap.solid_fraction);
                let interval = match due.last {
                    true => 0.0,
                    false => clock(scene, d, simulation.timestep()).1,
                };
                let across = simulation.domain().lengths().y;
                let slab = [across, interval];
                let begun = Runout::begin(scene, &self.origin, law, slab, &going, time)?;
                (begun, None)
            }
        };
        simulation.remove(|g| due.grains.contains(&g.id));
        if due.last {
            simulation
                .set_loads(&[])
                .map_err(|why| Failure::Run(why.to_string()))?;
        }
        simulation
            .fix(|g| due.last || !all.contains(&g.id))
            .map_err(|why| Failure::Run(why.to_string()))?;
        match (&mut standing, due.last) {
            (Some(standing), last) => {
                standing.admit(&runout, simulation);
                if last {
                    runout = runout.alone(scene, &self.origin)?;
                }
            }
            (None, true) => {}
            (None, false) => standing = Some(Standing::begin(scene, &runout, simulation)),
        }
        Ok(Live {
            broken,
            runout,
            standing,
        })
    }

    /// Whether nine in ten of the grains beside the continuum are as still as they have to be.
    fn stands_still(&self, simulation: &Simulation, d: f64) -> bool {
        let mut speeds: Vec<f64> = free_grains(simulation)
            .iter()
            .map(|g| g.velocity.norm())
            .collect();
        speeds.sort_unstable_by(f64::total_cmp);
        let speed = speeds.get(speeds.len() * 9 / 10).copied().unwrap_or(0.0);
        speed < STILL * (self.scene.gravity * d).sqrt()
    }

    /// Looks at grains and continuum, and hands over what is due.
    fn look_beside(
        &self,
        live: Live,
        record: &mut CliffRecord,
        simulation: &mut Simulation,
    ) -> Result<Live, Failure> {
        let axis = self.scene.heap_axis(live.runout.diameter());
        let heights = self.heights(simulation, &live, record.heap.solid_fraction);
        record.see(simulation.time(), &axis, heights);
        let beside = live.standing.as_ref().is_some_and(|s| s.free > 0);
        let still = self.rests(&live.runout)
            && (!beside || self.stands_still(simulation, live.runout.diameter()));
        record.heap.resting = if still {
            record.heap.resting + 1.0
        } else {
            0.0
        };
        if !beside || record.heap.resting >= STILL_LOOKS {
            return Ok(live);
        }
        let kinetic = simulation.energy().kinetic();
        if kinetic > record.times.peak[0] {
            record.times.peak = [kinetic, simulation.time()];
        }
        match self.due(record, simulation, Some(&live)) {
            Some(due) => self.hand_over(record, simulation, Some(live), &due),
            None => Ok(live),
        }
    }

    /// Lays the loads of grains beside the continuum up to the next time they are laid.
    fn lay(&self, live: &mut Live, simulation: &mut Simulation) -> Result<(), Failure> {
        let every = self.steer_every(simulation.timestep()).max(1);
        let done = simulation.steps_done();
        let look = (done / every + 1) * every;
        match live.beside() {
            Some((runout, standing)) => {
                let until = standing.next().clamp(done + 1, look);
                standing.lay(runout, simulation, until)
            }
            None => Ok(()),
        }
    }

    /// Whether the continuum is as still as grains would have to be, by the root of its mean square velocity.
    fn rests(&self, runout: &Runout) -> bool {
        let speed = (2.0 * runout.kinetic() / runout.mass()).sqrt();
        speed < STILL * (self.scene.gravity * runout.diameter()).sqrt()
    }

    /// Heights of the continuum and of the grains that are held, over the places of an axis.
    fn heights(&self, simulation: &mut Simulation, live: &Live, solid_fraction: f64) -> Vec<f64> {
        let axis = self.scene.heap_axis(live.runout.diameter());
        let base = solid_fraction * simulation.domain().lengths().y;
        let mut heights = self.scene.heights(&simulation.grain_list(), &axis, base);
        let more = axis.heights(live.runout.parcels(), base);
        heights.iter_mut().zip(more).for_each(|(h, m)| *h += m);
        heights
    }
}

impl Recipe for JoinedCliff<'_> {
    fn about(&self) -> String {
        format!(
            "{}; its debris runs out as a continuum once its kinetic energy has fallen to {} of the peak and it lies no steeper than {} degrees",
            self.scene.about(),
            self.scene.runout.kinetic_share,
            self.scene.runout.steepest_degrees
        )
    }

    as_the_scene!();

    fn check(&self) -> Result<(), Failure> {
        let materials = CliffScene::materials(self.scene, &self.origin)?;
        let solid = self.scene.material.solid_fraction();
        let density = self.scene.material.bulk_density / solid;
        let law = self
            .scene
            .runout
            .law(comet::diameter(&materials), density, solid);
        Runout::check(self.scene, &self.origin, law)
            .map_err(|why| Failure::Input(format!("{}: section runout: {why}", self.origin)))
    }

    fn expected(&self, materials: &Materials) -> Expected {
        self.scene.expected(materials)
    }

    fn left_out(&self) -> Vec<&'static str> {
        let mut own = self.scene.left_out();
        own.extend([
            "boulders, bonds and compaction of the debris once it is a continuum",
            "motion of what is behind the crack, from then on",
        ]);
        own
    }

    fn plan(&self) -> Vec<(String, String)> {
        let keys = &self.scene.runout;
        let mut lines = self.scene.plan();
        lines.push((
            "zones".into(),
            format!(
                "grains until the cliff has failed, their kinetic energy has fallen to {} of its peak and what came down lies no steeper \
                 than {} degrees; then all that lay before the crack or has come before it is a continuum, or before that the part that \
                 lies, if it is {} of what stood before the crack",
                keys.kinetic_share, keys.steepest_degrees, keys.least_share
            ),
        ));
        lines.push((
            "continuum".into(),
            format!(
                "μ(I) with μ_s {}, μ_2 {}, I_0 {}, cohesion {} Pa; cells of {} mean diameters; grains smoothed over {} of them",
                keys.mu_s, keys.mu_2, keys.i_0, keys.cohesion, keys.cell_diameters, keys.reach_diameters
            ),
        ));
        lines
    }

    fn steer_every(&self, timestep: f64) -> u64 {
        self.scene.steer_every(timestep)
    }

    fn next_steer(&self, done: u64, timestep: f64, state: &[f64]) -> u64 {
        let every = self.steer_every(timestep).max(1);
        let look = (done / every).saturating_add(1).saturating_mul(every);
        let mut guard = self.live();
        // A damaged memory is told by what steers.
        if self.recall(&mut guard, state).is_err() {
            return look;
        }
        let beside = guard.as_mut().and_then(Live::beside);
        beside.map_or(look, |(_, standing)| standing.next().clamp(done + 1, look))
    }

    fn keep(&self, state: &mut Vec<f64>) {
        let guard = self.live();
        if let Some(live) = guard.as_ref() {
            let (record, _) = Self::parts(state);
            Self::remember(&record, Some(live), state);
        }
    }

    fn steer(&self, simulation: &mut Simulation, state: &mut Vec<f64>) -> Result<Course, Failure> {
        let mut guard = self.live();
        self.recall(&mut guard, state)?;
        let (mut memory, _) = Self::parts(state);
        let columns = |d: f64| self.scene.heap_axis(d).columns;
        let damaged = || Failure::damaged("recipe/state");
        if let Some(mut live) = guard.take() {
            let every = self.steer_every(simulation.timestep()).max(1);
            let looks = simulation.steps_done().is_multiple_of(every);
            match live.beside() {
                Some((runout, standing)) => standing.go_on(runout, simulation, looks)?,
                None => live.runout.go_on(simulation.time())?,
            }
            let mut over = false;
            if looks {
                let mut record = CliffRecord::read(&memory, columns(live.runout.diameter()))
                    .ok_or_else(damaged)?;
                live = self.look_beside(live, &mut record, simulation)?;
                over = record.heap.resting >= STILL_LOOKS;
                record.write(&mut memory);
            }
            if !over {
                self.lay(&mut live, simulation)?;
            }
            if looks {
                Self::remember(&memory, Some(&live), state);
            }
            *guard = Some(live);
            return Ok(if over { Course::Over } else { Course::On });
        }
        let course = self.scene.steer(simulation, &mut memory)?;
        let record = self
            .scene
            .diameter()
            .and_then(|d| CliffRecord::read(&memory, columns(d)))
            .ok_or_else(damaged)?;
        if course == Course::On
            && let Some(due) = self.due(&record, simulation, None)
        {
            let mut live = self.hand_over(&record, simulation, None, &due)?;
            self.lay(&mut live, simulation)?;
            *guard = Some(live);
        }
        Self::remember(&memory, guard.as_ref(), state);
        Ok(course)
    }

    fn columns(&self) -> Vec<(String, &'static str)> {
        let mut own = self.scene.columns();
        own.push(("continuum_kinetic".into(), "J"));
        own
    }

    fn look(&self, simulation: &mut Simulation, seen: &Snapshot, state: &[f64]) -> Vec<f64> {
        let mut guard = self.live();
        if self.recall(&mut guard, state).is_err() {
            return vec![f64::NAN; 4];
        }
        let (memory, _) = Self::parts(state);
        match guard.as_ref() {
            None => {
                let mut row = self.scene.look(simulation, seen, &memory);
                row.push(0.0);
                row
            }
            Some(live) => {
                let columns = self.scene.heap_axis(live.runout.diameter()).columns;
                let record = CliffRecord::read(&memory, columns);
                let front = record.and_then(|r| r.heap.fronts.last().map(|f| f[1]));
                let none = f64::NAN;
                vec![front.unwrap_or(none), none, none, live.runout.kinetic()]
            }
        }
    }

    fn groups(&self, simulation: &mut Simulation, state: &[f64]) -> Option<Vec<Option<usize>>> {
        self.scene.groups(simulation, state)
    }

    fn has_continuum(&self) -> bool {
        true
    }

    fn continuum(&self, simulation: &Simulation, state: &[f64]) -> Option<Frame> {
        let mut guard = self.live();
        self.recall(&mut guard, state).ok()?;
        let time = simulation.time();
        let live = guard.as_ref();
        Some(live.map_or_else(|| nothing_yet(time), |live| live.runout.frame(time)))
    }

    fn conclude(&self, ran: &mut Ran, summary: &mut Summary) -> Result<Vec<Table>, Failure> {
        let mut guard = self.live();
        self.recall(&mut guard, &ran.state)?;
        let (memory, _) = Self::parts(&ran.state);
        let Some(live) = guard.as_ref() else {
            ran.state = memory;
            summary.remarks.push(
                "All of it stayed grains: it never failed, never fell to that share of its kinetic energy, or came to stand more steeply than a continuum would."
                    .into(),
            );
            return self.scene.conclude(ran, summary);
        };
        self.find(live, &memory, ran, summary)
    }
}
