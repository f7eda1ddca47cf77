//! One inclined-plane run: grains on a rough slope, followed until they rest or flow steadily, then averaged.
//!
//! Axes: x downslope, y across, z normal to the plane; the top of the fixed base is at z ≈ 0 and gravity is
//! g (sin θ, 0, −cos θ).

mod order;
mod result;
mod spec;

pub use result::{Cost, InclineResult, Outcome, SeriesPoint, Unsettled};
pub use spec::{InclineError, InclineSpec, Purpose, Start};

use crate::calibration::{PointRules, flow_height, local_points};
use crate::coarse_graining::{Averager, Layering, Layers};
use crate::steady_state::{SteadyTest, Trend, steady_test};
use colluvium_dem::{Record, Simulation, Snapshot};
use nalgebra::Vector3;
use std::time::Instant;

/// Where a run stands.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Phase {
    Relaxing,
    Averaging,
    Done,
}

/// Why a run ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum End {
    /// Not yet, or its time was over.
    Time,
    Rest,
    Moved,
}

/// A run in progress. It gives the same result in any number of pieces, and after a restart.
#[derive(Debug)]
pub struct InclineRun {
    spec: InclineSpec,
    simulation: Simulation,
    snapshot: Snapshot,
    averager: Averager<Layers>,
    phase: Phase,
    end: End,
    series: Vec<SeriesPoint>,
    /// Index into `series` where averaging began.
    averaging_from: usize,
    /// Since when the grains have been still without a break (s); negative if they are not.
    resting_since: f64,
    /// `distance` at that time (m).
    distance_at_stop: f64,
    /// ∫ mean velocity dt (m).
    distance: f64,
    wall_s: f64,
}

impl InclineRun {
    /// Checks the numbers and sets the bed on its slope, with its starting velocity.
    ///
    /// # Errors
    /// If a number is out of range or the grains cannot be simulated.
    pub fn new(spec: InclineSpec) -> Result<Self, InclineError> {
        spec.validate()?;
        let mut simulation = Simulation::new(spec.setup())?;
        if let Some(flow) = spec.starting_flow(spec.bed_height() * spec.starting_stretch()) {
            simulation.give_velocity(|grain| Vector3::x() * flow(grain.position.z));
        }
        Self::around(spec, simulation)
    }

    fn around(spec: InclineSpec, simulation: Simulation) -> Result<Self, InclineError> {
        // Room for grains between those of the base, and for a flow that dilates.
        let above = (1.5 * spec.bed_height() / spec.layer).ceil() as usize + 8;
        let below = (2.0 * spec.diameter / spec.layer).ceil();
        let layers = Layering {
            lower: -below * spec.layer,
            thickness: spec.layer,
            count: above + below as usize,
        };
        Ok(Self {
            snapshot: Snapshot {
                time: 0.0,
                domain: spec.domain,
                gravity: Vector3::zeros(),
                grains: Vec::new(),
                contacts: Vec::new(),
                bonds: Vec::new(),
                bodies: Vec::new(),
                body_contacts: Vec::new(),
            },
            averager: Averager::new(Layers, layers)?,
            simulation,
            phase: Phase::Relaxing,
            end: End::Time,
            series: Vec::new(),
            averaging_from: 0,
            resting_since: -1.0,
            distance_at_stop: 0.0,
            distance: 0.0,
            wall_s: 0.0,
            spec,
        })
    }

    /// The specification.
    pub fn spec(&self) -> &InclineSpec {
        &self.spec
    }

    /// Integrates up to `steps` steps; fewer if the run finishes.
    ///
    /// # Errors
    /// If the grains fly apart.
    pub fn advance(&mut self, steps: u64) -> Result<(), InclineError> {
        let start = Instant::now();
        let last = self.simulation.steps_done() + steps;
        while self.phase != Phase::Done && self.simulation.steps_done() < last {
            let done = self.simulation.steps_done();
            let to_sample = self.spec.sample_every - done % self.spec.sample_every;
            self.simulation.advance(to_sample.min(last - done))?;
            if self
                .simulation
                .steps_done()
                .is_multiple_of(self.spec.sample_every)
            {
                self.sample();
            }
        }
        self.wall_s += start.elapsed().as_secs_f64();
        Ok(())
    }

    fn sample(&mut self) {
        self.simulation.snapshot(&mut self.snapshot);
        let point = SeriesPoint::of(&self.snapshot);
        let interval = self.spec.sample_interval();
        self.distance += point.mean_velocity * interval;
        self.series.push(point);
        if self.phase == Phase::Averaging {
            self.averager.sample(&self.snapshot);
        }
        if self.rests(&point) {
            self.phase = Phase::Done;
            self.end = End::Rest;
            return;
        }
        match self.phase {
            Phase::Relaxing => self.end_relaxing(&point),
            Phase::Averaging => {
                let samples = self.series.len() - self.averaging_from;
                if samples as f64 * interval >= self.spec.average_time {
                    self.phase = Phase::Done;
                }
            }
            Phase::Done => {}
        }
    }

    /// At rest: kinetic energy per grain below 10⁻³ m g d, and the grains no further than 10⁻² d from where they
    /// were 5 √(d/g) before. A bed that has stopped rings like a bell, its long waves hardly damped, so neither
    /// velocity nor energy at one instant tells; and a bed just tilted also starts out still.
    fn rests(&mut self, point: &SeriesPoint) -> bool {
        let (g, d) = (self.spec.gravity, self.spec.diameter);
        let window = 5.0 * (d / g).sqrt();
        let still = point.kinetic_energy < 1e-3 * point.mass * g * d;
        let moved = (self.distance - self.distance_at_stop).abs() > 1e-2 * d;
        if !still || moved || self.resting_since < 0.0 {
            self.resting_since = if still { point.time } else { -1.0 };
            self.distance_at_stop = self.distance;
            return false;
        }
        point.time - self.resting_since >= window
    }

    fn end_relaxing(&mut self, point: &SeriesPoint) {
        let t = point.time;
        let check = self.series.len().is_multiple_of(50);
        match self.spec.purpose {
            Purpose::Measure => {
                let latest = self.spec.max_time - self.spec.average_time;
                let steady = || self.test_since(t - self.spec.relax_time).trend == Trend::Steady;
                if t >= latest || (check && t >= self.spec.relax_time && steady()) {
                    self.phase = Phase::Averaging;
                    self.averaging_from = self.series.len();
                }
            }
            Purpose::StopSearch => {
                let flows = || {
                    let trend = self.test_since(0.5 * t).trend;
                    trend == Trend::Steady || trend == Trend::Rising
                };
                if t >= self.spec.max_time || (check && t >= self.spec.relax_time && flows()) {
                    self.phase = Phase::Done;
                }
            }
            Purpose::OnsetSearch => {
                // Past one diameter on average and faster than on the way there: it runs away.
                let faster = point.mean_velocity * t > 1.2 * self.distance;
                if self.distance > self.spec.diameter && faster {
                    self.phase = Phase::Done;
                    self.end = End::Moved;
                } else if t >= self.spec.max_time {
                    self.phase = Phase::Done;
                }
            }
        }
    }

    /// Stationarity of the mean velocity from a time on.
    fn test_since(&self, time: f64) -> SteadyTest {
        let from = self.series.partition_point(|p| p.time < time);
        let velocities: Vec<f64> = self.series[from..]
            .iter()
            .map(|p| p.mean_velocity)
            .collect();
        steady_test(
            &velocities,
            self.spec.sample_interval(),
            self.spec.steady_tolerance,
        )
    }

    /// Share of the run that is done, from 0 to 1; jumps where a run ends early.
    pub fn progress(&self) -> f64 {
        if self.phase == Phase::Done {
            1.0
        } else {
            (self.simulation.time() / self.spec.max_time).min(1.0)
        }
    }

    /// Nothing is left to do.
    pub fn finished(&self) -> bool {
        self.phase == Phase::Done
    }

    /// Steps done.
    pub fn steps_done(&self) -> u64 {
        self.simulation.steps_done()
    }

    /// Series so far.
    pub fn series(&self) -> &[SeriesPoint] {
        &self.series
    }

    /// Hash of the grains' state (see [`Simulation::state_hash`]).
    pub fn state_hash(&mut self) -> String {
        self.simulation.state_hash()
    }

    /// Starts anew with the velocities of a layer of this depth (m) and mass (kg): a grain has the velocity of the place below
    /// which as much mass lies. A settled bed is denser than the flow that comes of it, and Bagnold's profile of its own
    /// height is that of a shallower one. Nothing happens where the start is from rest.
    pub fn start_as_layer(&mut self, depth: f64, mass: f64) {
        let Some(flow) = self.spec.starting_flow(depth) else {
            return;
        };
        self.simulation.snapshot(&mut self.snapshot);
        let mut grains: Vec<_> = self.snapshot.grains.iter().filter(|g| !g.fixed).collect();
        grains.sort_by(|a, b| a.position.z.total_cmp(&b.position.z).then(a.id.cmp(&b.id)));
        let last = grains.iter().map(|g| g.id as usize + 1).max().unwrap_or(0);
        let mut velocities = vec![0.0; last];
        let mut below = 0.0;
        for grain in grains {
            velocities[grain.id as usize] = flow((below + 0.5 * grain.mass) / mass * depth);
            below += grain.mass;
        }
        let of = |id: u32| velocities.get(id as usize).copied().unwrap_or(0.0);
        self.simulation
            .give_velocity(|grain| Vector3::x() * of(grain.id));
    }

    /// The simulation, for output of grains.
    pub fn simulation(&mut self) -> &mut Simulation {
        &mut self.simulation
    }

    /// State from which [`InclineRun::resume`] goes on with the same bits.
    pub fn checkpoint(&mut self) -> Record {
        let mut record = Record::default();
        record.insert("dem", self.simulation.checkpoint());
        self.averager.save("average", &mut record);
        record.numbers.insert(
            "incline.state".into(),
            vec![
                self.resting_since,
                self.distance_at_stop,
                self.distance,
                self.wall_s,
            ],
        );
        let flat = self.series.iter().flat_map(|p| {
            [
                p.time,
                p.kinetic_energy,
                p.mean_velocity,
                p.mass,
                p.mean_height,
            ]
        });
        record
            .numbers
            .insert("incline.series".into(), flat.collect());
        let phase = match self.phase {
            Phase::Relaxing => 0,
            Phase::Averaging => 1,
            Phase::Done => 2,
        };
        let end = match self.end {
            End::Time => 0,
            End::Rest => 1,
            End::Moved => 2,
        };
        record.counts.insert(
            "incline.phase".into(),
            vec![phase, end, self.averaging_from as u64],
        );
        record
    }

    /// Goes on from a checkpoint of a run with the same specification.
    ///
    /// # Errors
    /// If the checkpoint lacks something or does not belong to this specification.
    pub fn resume(spec: InclineSpec, record: &Record) -> Result<Self, InclineError> {
        spec.validate()?;
        let simulation = Simulation::resume(spec.setup(), &record.extract("dem"))?;
        let mut run = Self::around(spec, simulation)?;
        run.averager.load("average", record)?;
        let missing =
            |name: &str| InclineError::Record(format!("array `{name}` is missing or too short"));
        let state = record
            .numbers("incline.state")
            .map_err(InclineError::Record)?;
        let [resting_since, distance_at_stop, distance, wall_s] =
            state.try_into().map_err(|_| missing("incline.state"))?;
        (run.resting_since, run.distance_at_stop) = (resting_since, distance_at_stop);
        (run.distance, run.wall_s) = (distance, wall_s);
        let series = record
            .numbers("incline.series")
            .map_err(InclineError::Record)?;
        run.series = series
            .chunks_exact(5)
            .map(|c| SeriesPoint {
                time: c[0],
                kinetic_energy: c[1],
                mean_velocity: c[2],
                mass: c[3],
                mean_height: c[4],
            })
            .collect();
        let phase = record
            .counts("incline.phase")
            .map_err(InclineError::Record)?;
        let [phase, end, from] = phase.try_into().map_err(|_| missing("incline.phase"))?;
        run.phase = match phase {
            0 => Phase::Relaxing,
            1 => Phase::Averaging,
            _ => Phase::Done,
        };
        run.end = match end {
            0 => End::Time,
            1 => End::Rest,
            _ => End::Moved,
        };
        run.averaging_from = usize::try_from(from)
            .unwrap_or(usize::MAX)
            .min(run.series.len());
        Ok(run)
    }

    /// Outcome, profile and points of a finished run (of an unfinished one: so far).
    pub fn finish(mut self) -> InclineResult {
        let test = if self.phase == Phase::Relaxing || self.averager.samples() == 0 {
            let end = self.series.last().map_or(0.0, |p| p.time);
            self.test_since(0.5 * end)
        } else {
            let from = self.series.get(self.averaging_from).map_or(0.0, |p| p.time);
            self.test_since(from)
        };
        let outcome = match (self.end, test.trend) {
            (End::Rest, _) => Outcome::Rest,
            (End::Moved, _) | (End::Time, Trend::Rising) => Outcome::Accelerating,
            (End::Time, Trend::Steady) => Outcome::Steady,
            (End::Time, Trend::Falling) => Outcome::Decelerating,
            (End::Time, Trend::Undecided) => Outcome::Undecided,
        };
        // Radians and back leave digits behind that nobody asked for.
        let slope_degrees = (self.spec.slope.to_degrees() * 1e9).round() / 1e9;
        let averaged = self.averager.samples() > 0 && self.end != End::Rest;
        let profile = averaged.then(|| {
            self.averager
                .profile(self.spec.diameter, self.spec.grain_density)
        });
        let rules = PointRules::for_diameter(self.spec.diameter);
        let points = profile
            .as_ref()
            .map_or_else(Vec::new, |p| local_points(p, slope_degrees, &rules));
        let height = profile.as_ref().map_or_else(
            || self.spec.bed_height(),
            |p| flow_height(p, rules.surface_solid_fraction),
        );
        let steps = self.simulation.steps_done();
        // Before that a flow is as it was set in motion.
        let unit = (self.spec.diameter / self.spec.gravity).sqrt();
        let settled = self.series.partition_point(|p| p.time < 10.0 * unit);
        self.simulation.snapshot(&mut self.snapshot);
        InclineResult {
            bed: 0,
            grains: self.snapshot.grains.iter().filter(|g| !g.fixed).count() as u64,
            sudden_loss: order::sudden_loss(&self.series[settled..], 3.0 * unit),
            bond_order: order::bond_order(&self.snapshot),
            slope_degrees,
            purpose: self.spec.purpose,
            start: self.spec.start,
            outcome,
            steady: test,
            distance: self.distance,
            diameter: self.spec.diameter,
            checks: profile.as_ref().map(|p| p.balance),
            height,
            points,
            profile,
            cost: Cost {
                steps,
                grain_steps: steps * self.simulation.grain_count() as u64,
                wall_s: self.wall_s,
            },
            largest_overlap: self.simulation.largest_overlap(),
            state_hash: self.simulation.state_hash(),
            series: self.series,
        }
    }
}
