//! An inclined-plane run whose upper part becomes continuum on the way.
//!
//! Grains alone flow until a given time; then all above the edge is handed over, and the joined flow goes on and is
//! averaged. Or the upper part is continuum from the start, and no grain of it is ever made. Axes as in
//! [`crate::incline`].

mod result;
mod spec;

pub use result::{ContinuumRow, HistoryPoint, JoinedInclineResult};
pub use spec::{JoinedInclineError, JoinedInclineSpec};

use super::{Overlap, OverlapError};
use crate::coarse_graining::{Averager, Layers};
use crate::incline::InclineRun;
use colluvium_continuum::rheology::MuI;
use colluvium_dem::{Record, Simulation, StateHash};

enum Stage {
    /// Grains alone.
    Alone(Box<InclineRun>),
    /// Both.
    Joined(Box<Joined>),
}

struct Joined {
    simulation: Simulation,
    overlap: Overlap<MuI>,
    averager: Averager<Layers>,
    /// Σ u, Σ p, Σ τ by cell, from a outwards.
    sums: Vec<[f64; 3]>,
    history: Vec<HistoryPoint>,
    samples: u64,
    /// Grain-steps before the continuum took over, and steps then.
    before: [u64; 2],
}

/// A run in progress. It gives the same result in any number of pieces, and after a restart.
pub struct JoinedInclineRun {
    spec: JoinedInclineSpec,
    stage: Stage,
}

impl JoinedInclineRun {
    /// Sets the bed on its slope.
    ///
    /// # Errors
    /// If a number is out of range or the grains cannot be simulated.
    pub fn new(spec: JoinedInclineSpec) -> Result<Self, JoinedInclineError> {
        spec.validate()?;
        let mut alone = InclineRun::new(spec.incline.clone())?;
        let mass = spec.total_mass();
        alone.start_as_layer(spec.depth_of(mass), mass);
        Ok(Self {
            spec,
            stage: Stage::Alone(Box::new(alone)),
        })
    }

    fn end(&self) -> f64 {
        self.spec.incline.relax_time + self.spec.incline.average_time
    }

    /// Nothing is left to do.
    pub fn finished(&self) -> bool {
        match &self.stage {
            Stage::Alone(_) => false,
            Stage::Joined(joined) => joined.simulation.time() >= self.end() * (1.0 - 1e-12),
        }
    }

    /// Share of the run that is done, from 0 to 1.
    pub fn progress(&self) -> f64 {
        let steps = match &self.stage {
            Stage::Alone(run) => run.steps_done(),
            Stage::Joined(joined) => joined.simulation.steps_done(),
        };
        (steps as f64 * self.spec.incline.timestep / self.end()).min(1.0)
    }

    /// Makes up to `steps` steps of the grains; fewer if the run finishes.
    ///
    /// # Errors
    /// If the grains fly apart, nothing lies above the edge, or the continuum's step fails.
    pub fn advance(&mut self, steps: u64) -> Result<(), JoinedInclineError> {
        let every = self.spec.incline.sample_every;
        let mut left = steps;
        while left > 0 && !self.finished() {
            match &mut self.stage {
                Stage::Alone(run) => {
                    let alone = (self.spec.from / self.spec.incline.timestep).round() as u64;
                    let part = left.min(alone.saturating_sub(run.steps_done()));
                    run.advance(part)?;
                    left -= part;
                    // A run of grains that have come to rest ends before its time.
                    if run.steps_done() >= alone || run.finished() {
                        self.join()?;
                    }
                }
                Stage::Joined(joined) => {
                    let done = joined.simulation.steps_done();
                    let part = left.min(every - done % every);
                    joined.overlap.advance(&mut joined.simulation, part)?;
                    left -= part;
                    if joined.simulation.steps_done().is_multiple_of(every) {
                        joined.sample(joined.simulation.time() > self.spec.incline.relax_time);
                    }
                }
            }
        }
        Ok(())
    }

    /// The continuum takes over.
    fn join(&mut self) -> Result<(), JoinedInclineError> {
        let Stage::Alone(run) = &mut self.stage else {
            return Ok(());
        };
        let mut simulation = run.simulation().clone();
        let steps = simulation.steps_done();
        let before = [steps * simulation.grain_count() as u64, steps];
        let mut spec = self.spec.overlap();
        let flow = self.spec.flow();
        if self.spec.mass.is_some() {
            let grains = simulation.held(|_| true).filter(|g| !g.fixed);
            spec.edge.position = self.spec.cut(grains.map(|g| (g.position.z, g.mass)));
        }
        // The bed is denser than the flow that comes of it: below the edge lies as much mass as below `height`.
        let lift = self.spec.height - spec.edge.position;
        let flow = flow.map(|flow| move |z: f64| flow(z + lift));
        let velocity = flow.as_ref().map(|flow| flow as &dyn Fn(f64) -> f64);
        let overlap = Overlap::begin(spec, &mut simulation, velocity)?;
        let joined = Joined::around(simulation, overlap, self.spec.averager()?, before);
        self.stage = Stage::Joined(Box::new(joined));
        Ok(())
    }

    /// The whole state.
    pub fn checkpoint(&mut self) -> Record {
        match &mut self.stage {
            Stage::Alone(run) => run.checkpoint(),
            Stage::Joined(joined) => joined.checkpoint(),
        }
    }

    /// Goes on from a checkpoint of a run with the same specification.
    ///
    /// # Errors
    /// If the checkpoint lacks something or does not belong to this specification.
    pub fn resume(spec: JoinedInclineSpec, record: &Record) -> Result<Self, JoinedInclineError> {
        spec.validate()?;
        let stage = if record.counts.contains_key("joined.counts") {
            Stage::Joined(Box::new(Joined::resume(&spec, record)?))
        } else {
            Stage::Alone(Box::new(InclineRun::resume(spec.incline.clone(), record)?))
        };
        Ok(Self { spec, stage })
    }

    /// Outcome of a finished run; nothing of one in which the continuum has not taken over.
    pub fn finish(self) -> Option<JoinedInclineResult> {
        match self.stage {
            Stage::Alone(_) => None,
            Stage::Joined(joined) => Some(joined.finish(&self.spec)),
        }
    }
}

impl Joined {
    fn around(
        simulation: Simulation,
        overlap: Overlap<MuI>,
        averager: Averager<Layers>,
        before: [u64; 2],
    ) -> Self {
        Self {
            sums: vec![[0.0; 3]; overlap.continuum().cells()],
            history: Vec::new(),
            simulation,
            overlap,
            averager,
            samples: 0,
            before,
        }
    }

    /// Looks at both, and takes them into the averages where these have begun.
    fn sample(&mut self, measures: bool) {
        let (overlap, simulation) = (&mut self.overlap, &mut self.simulation);
        if measures && self.samples == 0 {
            overlap.watch();
        }
        overlap.sighting.look(simulation);
        let snapshot = &overlap.sighting.snapshot;
        let (continuum, area) = (&overlap.continuum, overlap.edge.area);
        let velocities = continuum.velocities();
        let (cell, beyond) = (
            area * continuum.cell_mass(),
            &velocities[overlap.strip.nodes()..],
        );
        let grains = snapshot.grains.iter().filter(|g| !g.fixed);
        let momentum: f64 = grains.map(|g| g.mass * g.velocity.x).sum();
        self.history.push(HistoryPoint {
            time: simulation.time(),
            mean_velocity: (momentum + cell * beyond.iter().sum::<f64>())
                / (overlap.grain_mass + cell * beyond.len() as f64),
            edge_velocity: beyond.first().copied().unwrap_or(0.0),
            surface_velocity: beyond.last().copied().unwrap_or(0.0),
            edge_height: overlap.edge.position,
        });
        if !measures {
            return;
        }
        self.averager.sample(snapshot);
        for (k, sum) in self.sums.iter_mut().enumerate() {
            let shear = 0.5 * (continuum.shear_stress(k) + continuum.shear_stress(k + 1));
            let now = [velocities[k], continuum.cell_pressure(k), shear];
            sum.iter_mut().zip(now).for_each(|(sum, now)| *sum += now);
        }
        self.samples += 1;
    }

    fn checkpoint(&mut self) -> Record {
        let mut record = Record::default();
        record.insert("dem", self.simulation.checkpoint());
        record.insert("overlap", self.overlap.checkpoint());
        self.averager.save("average", &mut record);
        let sums = self.sums.iter().flatten().copied().collect();
        record.numbers.insert("joined.sums".into(), sums);
        let history = self.history.iter().flat_map(|p| {
            [
                p.time,
                p.mean_velocity,
                p.edge_velocity,
                p.surface_velocity,
                p.edge_height,
            ]
        });
        record
            .numbers
            .insert("joined.history".into(), history.collect());
        let [work, steps] = self.before;
        record
            .counts
            .insert("joined.counts".into(), vec![self.samples, work, steps]);
        record
    }

    fn resume(spec: &JoinedInclineSpec, record: &Record) -> Result<Self, JoinedInclineError> {
        let broken = |why: String| JoinedInclineError::Overlap(OverlapError::Record(why));
        let setup = spec.incline.setup();
        let simulation = Simulation::resume(setup, &record.extract("dem"))
            .map_err(|error| JoinedInclineError::Incline(error.into()))?;
        let overlap = Overlap::resume(spec.overlap(), &simulation, &record.extract("overlap"))?;
        let mut averager = spec.averager()?;
        averager.load("average", record)?;
        let &[samples, work, steps] = record.counts("joined.counts").map_err(broken)? else {
            return Err(broken("array `joined.counts` must have 3 numbers".into()));
        };
        let mut joined = Self::around(simulation, overlap, averager, [work, steps]);
        joined.samples = samples;
        let sums = record.numbers("joined.sums").map_err(broken)?;
        let rows = sums.as_chunks::<3>().0;
        if sums.len() != 3 * joined.sums.len() {
            let (found, cells) = (sums.len(), joined.sums.len());
            return Err(broken(format!(
                "array `joined.sums` has {found} numbers for {cells} cells"
            )));
        }
        joined.sums.copy_from_slice(rows);
        let history = record.numbers("joined.history").map_err(broken)?;
        let points = history.as_chunks::<5>().0.iter();
        joined.history = points
            .map(|&[time, mean, edge, surface, height]| HistoryPoint {
                time,
                mean_velocity: mean,
                edge_velocity: edge,
                surface_velocity: surface,
                edge_height: height,
            })
            .collect();
        Ok(joined)
    }

    fn finish(mut self, spec: &JoinedInclineSpec) -> JoinedInclineResult {
        let (strip, edge) = (*self.overlap.strip(), *self.overlap.edge());
        let samples = self.samples.max(1) as f64;
        let cells = self.sums.iter().enumerate();
        let continuum: Vec<ContinuumRow> = cells
            .map(|(k, sums)| ContinuumRow {
                z: edge.position + strip.node(k),
                u: sums[0] / samples,
                p: sums[1] / samples,
                tau: sums[2] / samples,
                is_copy: k < strip.nodes(),
            })
            .collect();
        let cells = continuum.len();
        let steps = self.simulation.steps_done() - self.before[1];
        let grains = self.simulation.grain_count();
        let exchanges = steps / self.overlap.steps_of_an_exchange();
        JoinedInclineResult {
            profile: self
                .averager
                .profile(spec.incline.diameter, spec.incline.grain_density),
            continuum,
            history: std::mem::take(&mut self.history),
            report: self.overlap.report(),
            settings: *self.overlap.settings(),
            steps_held: [
                self.overlap.steps_of_loads(),
                self.overlap.steps_of_an_exchange(),
            ],
            ledger: self.overlap.ledger(),
            ledger_errors: self.overlap.ledger_errors(&mut self.simulation),
            work: self.overlap.work(&self.simulation),
            sizes: [grains, cells],
            work_done: [
                self.before[0] + steps * grains as u64,
                exchanges * cells as u64,
            ],
            heights: [
                edge.position + strip.face(0),
                edge.position + strip.handshake(),
                edge.position,
                edge.position + (cells - strip.nodes()) as f64 * strip.cell,
            ],
            state_hash: self.state_hash(),
            snapshot: {
                self.overlap.sighting.look(&mut self.simulation);
                self.overlap.sighting.snapshot
            },
        }
    }

    fn state_hash(&mut self) -> String {
        let mut hash = StateHash::default();
        let mut record = self.overlap.checkpoint();
        // Accounts count what walls have taken, whose sums are formed where a run is cut.
        record.numbers.remove("ledger");
        let numbers = record.numbers.values().flatten();
        numbers.for_each(|x| hash.take(x.to_bits()));
        let grains = self.simulation.state_hash();
        grains.bytes().for_each(|byte| hash.take(u64::from(byte)));
        hash.finish()
    }
}
