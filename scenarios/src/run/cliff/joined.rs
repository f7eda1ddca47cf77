//! A cliff whose grains become a continuum when it has come down.
//!
//! Up to then it is the cliff of grains, the same to the bit: it stands, the crack opens, it fails, falls and hits. Once
//! the kinetic energy is past its peak and down to a share of it and the debris lies no steeper than a slope (pieces that
//! stand may tip over, which their contacts decide), all that lay before the crack or has come before it changes hands as a whole (`coupling::handover`); the grains behind are held from then on. The continuum runs out over
//! what is left of the cliff (`runout.rs`) until it rests.

mod broken;
mod findings;

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
        let (_, rest) = Self::parts(memory);
        if guard.is_some() || rest.is_empty() {
            return Ok(());
        }
        let damaged = || Failure::Input("--resume: the checkpoint is damaged: recipe/state".into());
        let (broken, rest) = Broken::read(rest).ok_or_else(damaged)?;
        let runout = Runout::read(self.scene, &self.origin, rest).ok_or_else(damaged)?;
        *guard = Some(Live { broken, runout });
        Ok(())
    }

    fn remember(record: &[f64], live: Option<&Live>, state: &mut Vec<f64>) {
        state.clear();
        state.push(record.len() as f64);
        state.extend(record);
        if let Some(live) = live {
            live.broken.write(state);
            live.runout.write(state);
        }
    }

    /// Whether the grains are to become continuum now.
    fn is_due(&self, record: &CliffRecord, simulation: &mut Simulation) -> bool {
        let [peak, when] = record.times.peak;
        let kinetic = simulation.energy().kinetic();
        let calm = !record.times.failed.is_nan()
            && simulation.time() > when
            && kinetic <= self.scene.runout.kinetic_share * peak;
        calm && self.lies(record, simulation)
    }

    /// Whether the debris lies rather than stands, by its thickness alone: on a steep slope what lies is no pillar.
    fn lies(&self, record: &CliffRecord, simulation: &mut Simulation) -> bool {
        let Some(d) = self.scene.diameter() else {
            return false;
        };
        let axis = self.scene.heap_axis(d);
        let base = record.heap.solid_fraction * simulation.domain().lengths().y;
        let heights = self.scene.heights(&simulation.grain_list(), &axis, base);
        let pile = Pile::of([&axis.positions(), &heights], 0.0, EDGE * d, |_| 0.0);
        pile.is_none_or(|p| p.wedge_degrees() <= self.scene.runout.steepest_degrees)
    }

    /// Makes continuum of what lay before the crack or has come before it, and holds the rest.
    fn hand_over(
        &self,
        record: &CliffRecord,
        simulation: &mut Simulation,
    ) -> Result<Live, Failure> {
        let scene = self.scene;
        let grains = simulation.grain_list();
        let before: BTreeSet<u32> = record.face.iter().map(|g| g[0] as u32).collect();
        let goes = |id: u32, g: &Grain| {
            !g.fixed && (before.contains(&id) || scene.before_crack(&g.position))
        };
        let numbered = grains.iter().enumerate().map(|(k, g)| (k as u32, g));
        let marked: BTreeSet<u32> = numbered
            .filter(|(id, g)| goes(*id, g))
            .map(|(id, _)| id)
            .collect();
        let debris: Vec<Grain> = marked.iter().map(|id| grains[*id as usize]).collect();
        let mass: f64 = debris.iter().map(Grain::mass).sum();
        let volume: f64 = debris.iter().map(Grain::volume).sum();
        let now: BTreeSet<[u32; 2]> = fragments::touching(simulation).into_iter().collect();
        let held = record.pairs.iter().filter(|pair| now.contains(*pair));
        let table = boulders(&simulation.clusters(), scene.material.solid_fraction());
        let broken = Broken {
            counts: [simulation.steps_done() as f64, debris.len() as f64],
            held: held.count() as f64 / record.pairs.len().max(1) as f64,
            turned: scene.turned(record, &grains),
            bonds: bonds_that_survive(simulation),
            boulders: table.columns.iter().map(|c| c.values.clone()).collect(),
        };
        let materials = CliffScene::materials(scene, &self.origin)?;
        let law = scene.runout.law(
            comet::diameter(&materials),
            mass / volume,
            record.heap.solid_fraction,
        );
        let across = simulation.domain().lengths().y;
        let runout = Runout::begin(scene, &self.origin, law, across, &debris, simulation.time())?;
        simulation.remove(|g| marked.contains(&g.id));
        simulation.fix(|_| true);
        Ok(Live { broken, runout })
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
                 than {} degrees; then all that lay before the crack or has come before it is a continuum",
                keys.kinetic_share, keys.steepest_degrees
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

    fn steer(&self, simulation: &mut Simulation, state: &mut Vec<f64>) -> Result<Course, Failure> {
        let mut guard = self.live();
        self.recall(&mut guard, state)?;
        let (mut memory, _) = Self::parts(state);
        let columns = |d: f64| self.scene.heap_axis(d).columns;
        let damaged = || Failure::Input("--resume: the checkpoint is damaged: recipe/state".into());
        if let Some(live) = guard.as_mut() {
            live.runout.go_on(simulation.time())?;
            let mut record =
                CliffRecord::read(&memory, columns(live.runout.diameter())).ok_or_else(damaged)?;
            let heights = self.heights(simulation, live, record.heap.solid_fraction);
            let axis = self.scene.heap_axis(live.runout.diameter());
            record.see(simulation.time(), &axis, heights);
            record.heap.resting = if self.rests(&live.runout) {
                record.heap.resting + 1.0
            } else {
                0.0
            };
            record.write(&mut memory);
            Self::remember(&memory, Some(live), state);
            let over = record.heap.resting >= STILL_LOOKS;
            return Ok(if over { Course::Over } else { Course::On });
        }
        let course = self.scene.steer(simulation, &mut memory)?;
        let record = self
            .scene
            .diameter()
            .and_then(|d| CliffRecord::read(&memory, columns(d)))
            .ok_or_else(damaged)?;
        if course == Course::On && self.is_due(&record, simulation) {
            *guard = Some(self.hand_over(&record, simulation)?);
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
