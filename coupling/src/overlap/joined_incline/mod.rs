//! An inclined-plane run whose upper part becomes continuum on the way.
//!
//! Grains alone flow until a given time; then all above the edge is handed over, and the joined flow goes on and is
//! averaged. Axes as in [`crate::incline`].

use super::{
    FlatEdge, Ledger, Overlap, OverlapError, OverlapSettings, OverlapSpec, Report, Scales, Work,
};
use crate::coarse_graining::{Averager, AveragerError, Layering, Layers, Profile};
use crate::incline::{InclineError, InclineRun, InclineSpec};
use colluvium_continuum::grid::Boundary;
use colluvium_continuum::rheology::MuI;
use colluvium_dem::{Record, Simulation, Snapshot, StateHash};

/// What to run.
#[derive(Clone, Debug)]
pub struct JoinedInclineSpec {
    /// The run of grains that it begins as; averages are taken over its `average_time` from its `relax_time` on.
    pub incline: InclineSpec,
    /// Height of the edge above the base (m).
    pub height: f64,
    /// When the continuum takes over (s).
    pub from: f64,
    /// Material of the continuum.
    pub rheology: MuI,
    /// Normal stiffness of a contact of two mean grains (N/m).
    pub stiffness: f64,
    /// Settings of the overlap.
    pub settings: OverlapSettings,
}

/// Why such a run cannot be made or go on.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum JoinedInclineError {
    /// The overlap.
    #[error(transparent)]
    Overlap(#[from] OverlapError),
    /// The grains.
    #[error(transparent)]
    Incline(#[from] InclineError),
}

impl From<AveragerError> for JoinedInclineError {
    fn from(error: AveragerError) -> Self {
        JoinedInclineError::Incline(error.into())
    }
}

/// Mean of the continuum in one cell.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ContinuumRow {
    /// Middle of the cell (m).
    pub z: f64,
    /// Velocity along the flow (m/s).
    pub u: f64,
    /// Pressure (Pa).
    pub p: f64,
    /// Shear stress of the continuum's own (Pa): the mean of the two faces.
    pub tau: f64,
    /// Whether the cell is part of the copy, where grains are too.
    pub is_copy: bool,
}

/// What came out.
#[derive(Clone, Debug)]
pub struct JoinedInclineResult {
    /// Averages of the grains; in the shell their stress is not that of the flow.
    pub profile: Profile,
    /// Averages of the continuum, from below.
    pub continuum: Vec<ContinuumRow>,
    /// What the monitors say of the averaging time.
    pub report: Report,
    /// Accounts since the continuum took over.
    pub ledger: Ledger,
    /// Errors of mass and of the momenta of grains and continuum, relative.
    pub ledger_errors: [f64; 3],
    /// Work of the exchange on the grains (J).
    pub work: Work,
    /// Grains left, the fixed ones included, and cells.
    pub sizes: [usize; 2],
    /// Steps of all grains together, and of all cells.
    pub work_done: [u64; 2],
    /// Height of the edge at the end, and of the continuum's surface (m).
    pub heights: [f64; 2],
    /// Hash of grains and continuum.
    pub state_hash: String,
}

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
    snapshot: Snapshot,
    /// Σ u, Σ p, Σ τ by cell, from a outwards.
    sums: Vec<[f64; 3]>,
    samples: u64,
    /// Grain-steps before the continuum took over, and steps then.
    before: [u64; 2],
}

/// A run in progress. It gives the same result in any number of pieces, and after a restart.
pub struct JoinedInclineRun {
    spec: JoinedInclineSpec,
    stage: Stage,
}

impl JoinedInclineSpec {
    /// What is joined at the edge.
    fn overlap(&self) -> OverlapSpec<MuI> {
        let incline = &self.incline;
        OverlapSpec {
            edge: FlatEdge::across(&incline.domain, 2, 0, true, self.height),
            rheology: self.rheology,
            far_end: Boundary::FreeSurface,
            scales: Scales {
                diameter: incline.diameter,
                time: (incline.diameter / incline.gravity).sqrt(),
                density: self.rheology.bulk_density(),
                stiffness: self.stiffness,
            },
            settings: self.settings,
            strain_rate_floor: 1e-6,
        }
    }

    /// Checks what can be checked before anything has flowed.
    ///
    /// # Errors
    /// The first number out of range, by name.
    pub fn validate(&self) -> Result<(), JoinedInclineError> {
        self.incline.validate()?;
        let spec = self.overlap();
        let settings = spec.settings.resolve(&spec.scales, true)?;
        self.rheology.validate().map_err(OverlapError::from)?;
        super::settings::check(
            "from",
            self.from,
            (0.0..=self.incline.relax_time).contains(&self.from),
            "0 s to the time when averages begin",
        )?;
        let least = settings.inner + settings.buffer + settings.cell;
        super::settings::check(
            "height",
            self.height,
            self.height >= least,
            "at least a cell over the widths of inner overlap and buffer",
        )?;
        Ok(())
    }

    fn averager(&self) -> Result<Averager<Layers>, JoinedInclineError> {
        let layer = self.incline.layer;
        let below = (2.0 * self.incline.diameter / layer).ceil();
        let layers = Layering {
            lower: -below * layer,
            thickness: layer,
            count: (1.3 * self.height / layer).ceil() as usize + below as usize + 8,
        };
        Ok(Averager::new(Layers, layers)?)
    }
}

impl JoinedInclineRun {
    /// Sets the bed on its slope.
    ///
    /// # Errors
    /// If a number is out of range or the grains cannot be simulated.
    pub fn new(spec: JoinedInclineSpec) -> Result<Self, JoinedInclineError> {
        spec.validate()?;
        let alone = InclineRun::new(spec.incline.clone())?;
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
                    let measures = joined.simulation.time() > self.spec.incline.relax_time;
                    if measures && joined.simulation.steps_done().is_multiple_of(every) {
                        joined.sample();
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
        let overlap = Overlap::replace(self.spec.overlap(), &mut simulation)?;
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
            simulation,
            overlap,
            averager,
            snapshot: Snapshot::default(),
            samples: 0,
            before,
        }
    }

    fn sample(&mut self) {
        if self.samples == 0 {
            self.overlap.watch();
        }
        self.simulation.snapshot(&mut self.snapshot);
        self.averager.sample(&self.snapshot);
        let continuum = self.overlap.continuum();
        for (k, sum) in self.sums.iter_mut().enumerate() {
            let shear = 0.5 * (continuum.shear_stress(k) + continuum.shear_stress(k + 1));
            let now = [continuum.velocities()[k], continuum.cell_pressure(k), shear];
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
            report: self.overlap.report(),
            ledger: *self.overlap.ledger(),
            ledger_errors: self.overlap.ledger_errors(&mut self.simulation),
            work: self.overlap.work(),
            sizes: [grains, cells],
            work_done: [
                self.before[0] + steps * grains as u64,
                exchanges * cells as u64,
            ],
            heights: [
                edge.position,
                edge.position + (cells - strip.nodes()) as f64 * strip.cell,
            ],
            state_hash: self.state_hash(),
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
