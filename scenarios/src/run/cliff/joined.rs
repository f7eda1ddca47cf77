//! A cliff whose grains become a continuum when it has come down.
//!
//! Up to then it is the cliff of grains, the same to the bit: it stands, the crack opens, it fails, falls and hits. Once
//! the kinetic energy is past its peak and down to a share of it, all that lay before the crack or has come before it
//! changes hands as a whole (`coupling::handover`); the grains behind are held from then on. The continuum runs out over
//! what is left of the cliff (`runout.rs`) until it rests.

use super::record::CliffRecord;
use super::runout::{Runout, nothing_yet};
use super::{STILL, STILL_LOOKS, bonds_that_survive, comet};
use crate::failure::Failure;
use crate::run::world::boulders::boulders;
use crate::run::world::{Course, Expected, Ran, Recipe, as_the_scene, fragments};
use crate::scene::CliffScene;
use crate::scene::world::Materials;
use crate::state_hash;
use crate::summary::{Figure, Quantity, Summary};
use crate::table::Table;
use crate::vtkhdf::Frame;
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

/// How broken the cliff was at the hand-over: what a continuum cannot tell.
#[derive(Clone, Debug, Default, PartialEq)]
struct Broken {
    /// Steps made, and grains handed over.
    counts: [f64; 2],
    /// Share of the contacts before the crack that still held.
    held: f64,
    /// How far the sintered part had turned forward (degrees).
    turned: f64,
    /// Share of the bonds that the crack left that were whole; not a number where there were none.
    bonds: f64,
    /// Columns of the boulders' table.
    boulders: Vec<Vec<f64>>,
}

impl Broken {
    fn write(&self, memory: &mut Vec<f64>) {
        memory.extend(self.counts);
        memory.extend([self.held, self.turned, self.bonds]);
        let rows = self.boulders.first().map_or(0, Vec::len);
        memory.extend([self.boulders.len() as f64, rows as f64]);
        memory.extend(self.boulders.iter().flatten());
    }

    /// Reads it from the front of a memory, and says what follows.
    fn read(memory: &[f64]) -> Option<(Broken, &[f64])> {
        let (&[steps, grains, held, turned, bonds, columns, rows], rest) =
            memory.split_first_chunk::<7>()?;
        let (columns, rows) = (columns as usize, rows as usize);
        let (numbers, rest) = rest.split_at_checked(columns * rows)?;
        let boulders = (0..columns).map(|c| numbers[c * rows..(c + 1) * rows].to_vec());
        Some((
            Broken {
                counts: [steps, grains],
                held,
                turned,
                bonds,
                boulders: boulders.collect(),
            },
            rest,
        ))
    }
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
        let runout = Runout::read(self.scene, rest).ok_or_else(damaged)?;
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
        !record.times.failed.is_nan()
            && simulation.time() > when
            && kinetic <= self.scene.runout.kinetic_share * peak
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
        let runout = Runout::begin(scene, law, across, &debris, simulation.time())?;
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
            "{}; its debris runs out as a continuum once its kinetic energy has fallen to {} of the peak",
            self.scene.about(),
            self.scene.runout.kinetic_share
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
        Runout::check(self.scene, law)
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
                "grains until the cliff has failed and their kinetic energy has fallen to {} of its peak; then all that lay before \
                 the crack or has come before it is a continuum",
                keys.kinetic_share
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
                "All of it stayed grains: it never failed, or never fell to that share of its kinetic energy.".into(),
            );
            return self.scene.conclude(ran, summary);
        };
        self.find(live, &memory, ran, summary)
    }
}

impl JoinedCliff<'_> {
    /// What the run has come to, with a continuum at its end.
    fn find(
        &self,
        live: &Live,
        memory: &[f64],
        ran: &mut Ran,
        summary: &mut Summary,
    ) -> Result<Vec<Table>, Failure> {
        let Live { broken, runout } = live;
        let none = || Failure::Run("the cliff was never looked at".into());
        let axis = self.scene.heap_axis(runout.diameter());
        let record = CliffRecord::read(memory, axis.columns).ok_or_else(none)?;
        let deposit = self.heights(&mut ran.simulation, live, record.heap.solid_fraction);
        let places = axis.positions();
        self.scene.put_times(&record, ran, summary);
        self.scene
            .put_pile(&places, &deposit, runout.diameter(), summary);
        let across = ran.simulation.domain().lengths().y;
        let beyond = runout.parcels().into_iter().filter(|[x, _]| *x > 0.0);
        let beyond: f64 = beyond.map(|[_, volume]| volume).sum();
        let share = beyond / (record.heap.solid_fraction * across * self.scene.areas()[1]);
        // The columns' names are those of any boulders.
        let mut sizes = boulders(
            &ran.simulation.clusters(),
            self.scene.material.solid_fraction(),
        );
        for (column, values) in sizes.columns.iter_mut().zip(&broken.boulders) {
            column.values.clone_from(values);
        }
        let broken_at = [broken.held, broken.turned];
        self.scene.put_broken(share, broken_at, &record, summary);
        self.scene.put_boulders(broken.bonds, &sizes, summary);
        summary.remarks.push(format!(
            "Its grains became a continuum {:.0} s after the start; contacts, turn, bonds and boulders are those of then.",
            runout.begun
        ));
        self.book(live, ran, summary);
        summary.figures.push(Figure::history(
            "kinetic energy [J]",
            &[
                ("translation", "grains, translation"),
                ("rotation", "grains, rotation"),
                ("continuum_kinetic", "continuum"),
            ],
            "The fall and the run-out: kinetic energy of grains and continuum in time.",
        ));
        summary.figures.push(Figure::history(
            "length [m]",
            &[("sunk", "sunk on the mean"), ("x_front", "front")],
            "How far what stood before the crack has sunk while it was grains, and where the debris ends.",
        ));
        let mut tables = record.heap.tables(places, deposit);
        tables.push(sizes);
        Ok(tables)
    }

    /// The hand-over, cost, and the ledger.
    fn book(&self, live: &Live, ran: &mut Ran, summary: &mut Summary) {
        let Live { broken, runout } = live;
        let grains = ran.packing.grains.len() as f64;
        let [steps, handed_over] = broken.counts;
        // Grains that are held cost nothing that counts as a grain-step.
        let counted = ran.simulation.steps_done() as f64 * grains;
        let spared = counted - steps * grains;
        summary.cost.grain_steps -= (spared as u64).min(summary.cost.grain_steps);
        let [made, iterations, cuts, cell_steps] = runout.steps;
        summary.cost.cell_steps = cell_steps;
        if summary.cost.wall_s > 0.0 {
            summary.cost.grain_steps_per_s = summary.cost.grain_steps as f64 / summary.cost.wall_s;
            summary.cost.cell_steps_per_s = cell_steps as f64 / summary.cost.wall_s;
        }
        summary.model.cells = runout.cells();
        let h = &runout.handed;
        summary.ledger.mass_relative = runout.volume_drift();
        let scale = (2.0 * h.kinetic[0] * runout.mass()).sqrt();
        let off = (0..2).map(|c| (h.momentum[1][c] - h.momentum[0][c]).abs());
        let off = off.fold(0.0, f64::max) / scale;
        let mut put = |name: &str, value: f64, unit: &str, source: &str| {
            summary.put(name, Quantity::new(value, unit).from(source));
        };
        put(
            "time_of_handover",
            runout.begun,
            "s",
            "when the grains became a continuum, from the start of the run",
        );
        put("handed_grains", handed_over, "1", "that became a continuum");
        put(
            "handed_volume_error",
            h.volume[1] / h.volume[0] - 1.0,
            "1",
            "volume of the continuum over that of the grains at the cliff's solid fraction, less 1",
        );
        put(
            "handed_momentum_error",
            off,
            "1",
            "over √(2 mass × kinetic energy)",
        );
        put(
            "handed_kinetic_share",
            h.kinetic[2] / (h.kinetic[0] + h.kinetic[1]),
            "1",
            "kinetic energy of the continuum over that of its grains: spin and agitation about the mean are left",
        );
        put("continuum_steps", made as f64, "1", "");
        put(
            "newton_iterations",
            iterations as f64,
            "1",
            "failed attempts included",
        );
        put("steps_cut", cuts as f64, "1", "halved and tried again");
        summary.state_hash = state_hash::of_hashes(
            [ran.simulation.state_hash(), state_hash::of(&[&ran.state])]
                .iter()
                .map(String::as_str),
        );
    }
}
