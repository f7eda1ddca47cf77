//! Grains on one side of an edge, continuum on the other, and an overlap in which they exchange their states.
//!
//! From the grains outwards: *inner overlap* from a to the handshake surface m, *buffer* from m to the edge b,
//! where the grains end. Grains have their full mass, weight and contacts everywhere; the continuum keeps a copy of
//! full mass from a to b, which weighs what the grains there weigh. Totals count grains inside m and continuum outside. What is exchanged:
//!
//! - *stresses*: faces of the copy bear w σ_grains + (1 − w) σ_continuum, with w from 1 at a to 0 at m, and
//!   σ_grains coarse-grained (contact and kinetic) and averaged exponentially ([`Averages`]);
//! - *traction*: the outermost grains bear the continuum's stress on the edge, whose normal part yields to
//!   waves as an impedance does (`shell.rs`);
//! - *velocity*: in the buffer, mean velocities relax to each other, equal and opposite, and mean spins to half
//!   the vorticity, whose couple the continuum takes as an antisymmetric stress; in the inner overlap the copy
//!   follows the grains;
//! - *mass*: the continuum is what the total has beyond the grains' own masses.
//!
//! Grains make explicit steps inside one implicit step of the continuum. Forces are never blended: that has no
//! unique split of stress between the two
//! ([`force_blending`]).
//!
//! # What it cannot do
//! The continuum has no granular temperature: over a rough base it must not stand under flowing grains. One
//! edge, flat and normal to an axis, is joined to one column ([`FlatEdge`]); what acts on grains goes by the
//! questions of [`ZoneEdge`] alone.

mod angular;
mod averages;
pub mod bowl;
mod cell_joint;
mod cell_memory;
mod cell_monitors;
mod dense_limits;
mod edge;
mod exchange;
mod far_side;
mod following;
pub mod force_blending;
pub mod joined_incline;
mod joint;
mod ledger;
pub mod material_edge;
mod monitors;
mod record;
mod rest_stress;
mod settings;
mod shell;
mod sighting;
mod slips;
mod start;
mod state_rows;
mod strip;
pub mod windows;

pub use angular::AngularBook;
pub use averages::{Averages, FaceStress, Node};
pub use dense_limits::{DenseLimits, Reason};
pub use edge::{FlatEdge, ZoneEdge};
pub use far_side::FarSide;
pub use ledger::Ledger;
pub use monitors::{Monitors, Report};
pub use settings::{NormalMotion, OverlapSettings, Resolved, Scales, StressKernel};
pub use shell::{Held, Work};
pub use strip::Strip;

use colluvium_continuum::grid::Boundary;
use colluvium_continuum::rheology::ShearLaw;
use colluvium_dem::{Diverged, Record, SetupError, Simulation};
use shell::{Given, Shell};
use sighting::{Sighting, free_mass};
use start::Start;

/// Why an overlap cannot be made or go on.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum OverlapError {
    /// A number is out of range.
    #[error("overlap.{key} = {value}: must be {allowed}")]
    OutOfRange {
        /// Name of the key.
        key: &'static str,
        /// The value found.
        value: f64,
        /// What is allowed.
        allowed: &'static str,
    },
    /// The grains refuse a load.
    #[error(transparent)]
    Setup(#[from] SetupError),
    /// The grains flew apart.
    #[error(transparent)]
    Diverged(#[from] Diverged),
    /// The continuum's step failed.
    #[error("continuum of the overlap: {0}")]
    Continuum(#[from] colluvium_continuum::Error),
    /// A checkpoint does not belong to this overlap.
    #[error("checkpoint: {0}")]
    Record(String),
}

/// What an overlap is made from.
#[derive(Clone, Debug)]
pub struct OverlapSpec<L> {
    /// Where grains end.
    pub edge: FlatEdge,
    /// Material of the continuum.
    pub rheology: L,
    /// Mass of grains and continuum together (kg), of which the continuum is what the grains inside the edge lack;
    /// none: that of all free grains, those beyond the edge included.
    pub mass: Option<f64>,
    /// What holds at its far end.
    pub far_end: Boundary,
    /// What defaults are formed from.
    pub scales: Scales,
    /// Settings.
    pub settings: OverlapSettings,
    /// Strain-rate floor of the continuum's yield step, in √(g/H).
    pub strain_rate_floor: f64,
}

/// Share of the grains' stress on a face of the copy.
fn shares<L>(spec: &OverlapSpec<L>) -> impl Fn(&Strip, usize) -> f64 + use<L> {
    let uncoupled = spec.settings.uncoupled;
    move |strip, face| if uncoupled { 0.0 } else { strip.share(face) }
}

/// Grains and continuum joined at one edge. The grains are the caller's: every call needs the same simulation.
pub struct Overlap<L> {
    settings: Resolved,
    edge: FlatEdge,
    strip: Strip,
    continuum: FarSide<L>,
    averages: Averages,
    shell: Shell,
    held: Held,
    given: Given,
    monitors: Monitors,
    ledger: Ledger,
    /// Steps of the grains in one of the continuum, those for which loads are held, and those made since the last
    /// exchange.
    steps: u64,
    steps_of_loads: u64,
    made: u64,
    /// Velocity of the continuum along n (m/s).
    normal_velocity: f64,
    /// Mass of the continuum beyond the edge (kg).
    mass_beyond: f64,
    /// Mass of the free grains (kg).
    grain_mass: f64,
    sighting: Sighting,
    /// The account of angular momentum, and whether it is to be opened with the next loads.
    angular: Option<AngularBook>,
    opens_angular: bool,
}

impl<L: ShearLaw + Copy> Overlap<L> {
    /// Hands all grains beyond the edge over to the continuum: their mass becomes its mass, and its velocity is
    /// theirs, layer by layer.
    ///
    /// # Errors
    /// Settings out of range, or nothing beyond the edge.
    pub fn replace(
        spec: OverlapSpec<L>,
        simulation: &mut Simulation,
    ) -> Result<Self, OverlapError> {
        Self::begin(spec, simulation, None)
    }

    /// The same, with these velocities of the continuum (m/s) over its coordinate along the normal (m), or those of
    /// the grains it takes the places of.
    fn begin(
        spec: OverlapSpec<L>,
        simulation: &mut Simulation,
        velocity: Option<&dyn Fn(f64) -> f64>,
    ) -> Result<Self, OverlapError> {
        let share = shares(&spec);
        let mut start = Start::of(&spec, simulation, share)?;
        if let Some(velocity) = velocity {
            for k in 0..start.continuum.cells() {
                let place = spec.edge.position + spec.edge.sign() * start.strip.node(k);
                start.continuum.set_velocity(k, velocity(place));
            }
        }
        let edge = start.edge;
        let mut overlap = Self::around(start, simulation);
        // Stresses as they are while all grains are still there.
        overlap.sample(1.0);
        if overlap.settings.normal_motion == NormalMotion::Riding {
            let (grains, a) = (&overlap.sighting.snapshot.grains, overlap.strip.face(0));
            overlap.normal_velocity = averages::normal_velocity(grains, &edge, a);
        }
        simulation.remove(|g| !g.fixed && edge.distance(&g.position) > 0.0);
        overlap.grain_mass = free_mass(simulation);
        overlap.prime(overlap.exchange_time(simulation))?;
        overlap.open(simulation);
        overlap.agree(simulation);
        Ok(overlap)
    }

    /// Goes on from the checkpoint of an overlap with the same specification; the simulation is the one that was
    /// joined, resumed itself.
    ///
    /// # Errors
    /// If the checkpoint lacks something or does not belong to this specification.
    pub fn resume(
        spec: OverlapSpec<L>,
        simulation: &Simulation,
        record: &Record,
    ) -> Result<Self, OverlapError> {
        let (cells, mass_beyond) = record::cells(record).map_err(OverlapError::Record)?;
        let share = shares(&spec);
        let start = Start::of_cells(&spec, simulation, cells, mass_beyond, share)?;
        let mut overlap = Self::around(start, simulation);
        overlap.take_up(record)?;
        Ok(overlap)
    }

    /// Nothing exchanged yet.
    fn around(start: Start<L>, simulation: &Simulation) -> Self {
        let Start {
            settings,
            edge,
            strip,
            continuum,
            mass_beyond,
            sighting,
        } = start;
        let nodes = strip.nodes();
        let of_loads = settings.steps_of_loads(simulation.timestep());
        let loads = settings.loads_of_exchange(simulation.timestep());
        Self {
            averages: Averages::new(&strip, settings.kernel),
            settings,
            edge,
            strip,
            continuum,
            shell: Shell::new(simulation.grain_count(), nodes),
            held: Held {
                accelerations: vec![0.0; nodes],
                spins: vec![0.0; nodes],
                ..Held::default()
            },
            given: Given::nothing(nodes),
            monitors: Monitors::new(&strip, &settings),
            ledger: Ledger::default(),
            steps: of_loads * loads,
            steps_of_loads: of_loads,
            made: 0,
            normal_velocity: 0.0,
            mass_beyond,
            grain_mass: free_mass(simulation),
            sighting,
            angular: None,
            opens_angular: false,
        }
    }

    /// A step of the continuum that is taken back but for its stress and pressure, for grains to meet at once.
    fn prime(&mut self, dt: f64) -> Result<(), OverlapError> {
        let velocities = self.continuum.velocities().to_vec();
        self.step_continuum(dt)?;
        for (k, velocity) in velocities.into_iter().enumerate() {
            self.continuum.set_velocity(k, velocity);
        }
        Ok(())
    }

    /// Momentum of the grains along the flow and outwards, with what walls have taken (N s).
    fn grain_momentum(&self, simulation: &mut Simulation) -> [f64; 2] {
        let momentum = simulation.leapfrog_momentum() + simulation.wall_impulse();
        let n = self.edge.normal(&momentum);
        [momentum[self.edge.flow_axis], momentum.dot(&n)]
    }

    /// Momentum of the continuum along the flow, copy included (N s).
    fn continuum_momentum(&self) -> f64 {
        let mass = self.edge.area() * self.continuum.cell_mass();
        mass * self.continuum.velocities().iter().sum::<f64>()
    }

    /// Settings in use.
    pub fn settings(&self) -> &Resolved {
        &self.settings
    }

    /// The edge as it is now.
    pub fn edge(&self) -> &FlatEdge {
        &self.edge
    }

    /// Faces and nodes.
    pub fn strip(&self) -> &Strip {
        &self.strip
    }

    /// The continuum.
    pub fn continuum(&self) -> &FarSide<L> {
        &self.continuum
    }

    /// Averages of the grains.
    pub fn averages(&self) -> &Averages {
        &self.averages
    }

    /// What acts on the grains until the next exchange.
    pub fn held(&self) -> &Held {
        &self.held
    }

    /// Work of what acts on the grains since the start (J).
    pub fn work(&self, simulation: &Simulation) -> Work {
        self.shell.work_until_now(simulation)
    }

    /// Books angular momentum from the next loads on; a checkpoint does not hold the account.
    pub fn open_angular_book(&mut self) {
        self.opens_angular = true;
    }

    /// The account of angular momentum, if it is open.
    pub fn angular_book(&self) -> Option<&AngularBook> {
        self.angular.as_ref()
    }

    /// Velocity of the continuum along n (m/s).
    pub fn normal_velocity(&self) -> f64 {
        self.normal_velocity
    }

    /// Accounts since the start, with what the grains have been given since the last exchange.
    pub fn ledger(&self) -> Ledger {
        let mut ledger = self.ledger;
        ledger.shear += self.given.shear;
        ledger.pressure += self.given.pressure;
        ledger.impedance += self.given.impedance;
        ledger.relaxation += self.given.relaxation.iter().sum::<f64>();
        ledger
    }

    /// Starts the monitors anew.
    pub fn watch(&mut self) {
        self.monitors.clear();
    }

    /// What the monitors say.
    pub fn report(&self) -> Report {
        self.monitors.report()
    }

    /// Relative errors of the ledger: mass, momentum of the grains, momentum of the continuum.
    pub fn ledger_errors(&self, simulation: &mut Simulation) -> [f64; 3] {
        let mass = simulation.free_mass() + self.mass_beyond;
        [
            (mass / self.ledger.mass_before - 1.0).abs(),
            self.ledger().grains_error(self.grain_momentum(simulation)),
            self.ledger.continuum_error(self.continuum_momentum()),
        ]
    }

    /// Steps of the grains for which forces on them are held.
    pub fn steps_of_loads(&self) -> u64 {
        self.steps_of_loads
    }

    /// Steps of the grains in one step of the continuum.
    pub fn steps_of_an_exchange(&self) -> u64 {
        self.steps
    }

    /// Whether an exchange has just been made.
    pub fn at_exchange(&self) -> bool {
        self.made == 0
    }
}
