//! Grains that go on beside the continuum that others have become: when they look at its surface and when it takes their push.

use crate::failure::Failure;
use crate::run::cliff::runout::Runout;
use crate::scene::CliffScene;
use colluvium_coupling::debris_ground::{DebrisGround, SurfaceContact};
use colluvium_dem::{GrainSample, Simulation};

/// Times that loads are laid between two exchanges.
const LAYINGS: u64 = 10;
/// Numbers in front of the ground in a memory.
const HEAD: usize = 5;

/// What stands beside a continuum.
#[derive(Debug)]
pub struct Standing {
    /// The continuum as their ground.
    pub ground: DebrisGround,
    /// Steps for which loads are kept.
    kept: u64,
    /// Step of the last exchange, and of the last laying of loads.
    exchanged: u64,
    laid: u64,
    /// Free grains; none: it is over.
    pub free: u64,
    /// Their steps since the first instalment.
    pub grain_steps: u64,
}

/// Free grains as they are held, in the order of their numbers.
pub fn free_grains(simulation: &Simulation) -> Vec<GrainSample> {
    let mut grains: Vec<GrainSample> = simulation.held(|_| true).filter(|g| !g.fixed).collect();
    grains.sort_unstable_by_key(|grain| grain.id);
    grains
}

/// Steps for which loads are kept, and the time between two exchanges (s), for parcels of a diameter (m) and a step (s).
pub fn clock(scene: &CliffScene, diameter: f64, timestep: f64) -> (u64, f64) {
    let fall = (2.0 * scene.gravity * scene.shape.height).sqrt();
    let wanted = scene.runout.sinking_diameters * diameter / fall;
    let kept = (wanted / (LAYINGS as f64 * timestep)).round().max(1.0);
    (kept as u64, LAYINGS as f64 * kept * timestep)
}

impl Standing {
    /// After the first instalment.
    pub fn begin(scene: &CliffScene, runout: &Runout, simulation: &Simulation) -> Self {
        let (kept, interval) = clock(scene, runout.diameter(), simulation.timestep());
        let bounce = scene.ground.restitution.max(f64::EPSILON).ln();
        let contact = SurfaceContact {
            frequency: 1.0 / interval,
            damping: -bounce / bounce.hypot(std::f64::consts::PI),
            friction: scene.runout.mu_s,
            reacts: true,
        };
        let line = runout.surface(None);
        let ground = runout.with_cells(|(room, _, _)| DebrisGround::new(contact, line, room));
        let now = simulation.steps_done();
        let mut standing = Self {
            ground,
            kept,
            exchanged: now,
            laid: now,
            free: 0,
            grain_steps: 0,
        };
        standing.admit(runout, simulation);
        standing
    }

    /// After an instalment.
    pub fn admit(&mut self, runout: &Runout, simulation: &Simulation) {
        let grains = free_grains(simulation);
        self.free = grains.len() as u64;
        self.ground
            .admit(runout.surface(None), &grains, runout.spacing());
        self.exchanged = simulation.steps_done();
    }

    /// Step of the next laying of loads.
    pub fn next(&self) -> u64 {
        self.laid + self.kept
    }

    /// Counts the steps since the last laying; exchanges if it is time to or asked for.
    pub fn go_on(
        &mut self,
        runout: &mut Runout,
        simulation: &Simulation,
        now: bool,
    ) -> Result<(), Failure> {
        let step = simulation.steps_done();
        self.grain_steps += (step - self.laid) * self.free;
        self.laid = step;
        let since = step - self.exchanged;
        if since > 0 && (now || since >= LAYINGS * self.kept) {
            runout.take(&mut self.ground)?;
            runout.go_on(simulation.time())?;
            let elapsed = since as f64 * simulation.timestep();
            self.ground.line = runout.surface(Some((&self.ground.line, elapsed)));
            self.exchanged = step;
        }
        Ok(())
    }

    /// Lays the loads of the present places, to be kept up to a step.
    pub fn lay(
        &mut self,
        runout: &Runout,
        simulation: &mut Simulation,
        until: u64,
    ) -> Result<(), Failure> {
        let step = simulation.steps_done();
        let later = (step - self.exchanged) as f64 * simulation.timestep();
        let steps = until.saturating_sub(step).max(1) - 1;
        let kept = simulation.next_kick() + steps as f64 * simulation.timestep();
        let grains = free_grains(simulation);
        let loads = runout.with_cells(|cells| self.ground.press(&grains, cells, [later, kept]));
        simulation
            .set_loads(&loads)
            .map_err(|why| Failure::Run(why.to_string()))
    }

    /// Appends all that it goes on from.
    pub fn write(&self, memory: &mut Vec<f64>) {
        let counts = [
            self.kept,
            self.exchanged,
            self.laid,
            self.free,
            self.grain_steps,
        ];
        memory.extend(counts.map(|n| n as f64));
        self.ground.write(memory);
    }

    /// Reads it from the front of a memory, and says what follows.
    pub fn read(memory: &[f64]) -> Option<(Self, &[f64])> {
        let (head, rest) = memory.split_first_chunk::<HEAD>()?;
        let [kept, exchanged, laid, free, grain_steps] = head.map(|n| n as u64);
        let (ground, rest) = DebrisGround::read(rest)?;
        let standing = Self {
            ground,
            kept,
            exchanged,
            laid,
            free,
            grain_steps,
        };
        Some((standing, rest))
    }
}
