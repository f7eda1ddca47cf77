//! Angular momentum of the grains about the origin, by what gave it: an account that is opened where it is asked for.
//!
//! ```text
//! ΔL = weight + traction + relaxation + moments + handed − walls,      L = Σ (m x × v + I ω)
//! ```
//! A step kicks velocities and spins at fixed places and then drifts, which leaves x × v as it is: L(n+1) − L(n) =
//! Δt Σ (xₙ × F + M). Forces are held while grains move, so the account looks at their places before every step; contacts
//! between grains have no share, and walls say themselves what they took. This closes to round-off, about every axis in a box
//! with walls, about the periodic one alone where one axis is periodic, and not where grains are held in place.
//!
//! What the continuum gets is equal and opposite as a force, but not along the same line: it has faces and cells where the
//! grains lie around them. Such a pair is a couple of force times arm; [`AngularBook::arms`] says how long arms are in the
//! mean. It is the one part of angular momentum that grains and continuum do not give each other.

use colluvium_dem::Simulation;
use nalgebra::Vector3;

/// What a load consists of.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Parts {
    /// Of the continuum's traction and of the impedance (N).
    pub traction: Vector3<f64>,
    /// Of the relaxation, and of what carries a grain in the continuum (N).
    pub relaxation: Vector3<f64>,
    /// Moment about the grain's centre (N m).
    pub moment: Vector3<f64>,
}

/// What the continuum has for it, where it has it: its sign is that of the grains' part.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Counterpart {
    /// Moments about the origin of the traction on faces, and of the relaxation on cells (N m).
    pub moments: [Vector3<f64>; 2],
    /// Σ |force| of both (N).
    pub sizes: [f64; 2],
}

impl Counterpart {
    /// Adds a force at a place: 0 of traction, 1 of relaxation.
    pub(super) fn add(&mut self, kind: usize, at: &Vector3<f64>, force: &Vector3<f64>) {
        self.moments[kind] += at.cross(force);
        self.sizes[kind] += force.norm();
    }
}

/// Angular impulses about the origin since the account was opened (N m s).
#[derive(Clone, Debug, Default, PartialEq)]
pub struct AngularBook {
    /// Angular momentum at the start, spins included.
    pub before: Vector3<f64>,
    /// Of the weight.
    pub weight: Vector3<f64>,
    /// Of the continuum's traction and of the impedance.
    pub traction: Vector3<f64>,
    /// Of the relaxation of velocities.
    pub relaxation: Vector3<f64>,
    /// Of moments: the relaxation of spins.
    pub moments: Vector3<f64>,
    /// Of grains that came, less that of those which went.
    pub handed: Vector3<f64>,
    /// What walls had taken at the start.
    walls_before: Vector3<f64>,
    /// Of the same forces where the continuum has them: traction and relaxation, and Σ ∫ |force| dt (N s).
    pub counterparts: [Vector3<f64>; 2],
    sizes: [f64; 2],
    /// Loads that are laid, by grain number, and what the continuum has for them.
    laid: Vec<Option<Parts>>,
    counterpart: Counterpart,
}

/// Angular impulse about the origin that walls have taken since the start (N m s): contacts with fixed walls.
fn taken_by_walls(simulation: &Simulation) -> Vector3<f64> {
    let walls = 0..simulation.wall_count();
    walls
        .map(|wall| {
            let taken = simulation.wall_taken(wall);
            let origin = simulation.wall_pose(wall).position;
            taken.angular + origin.cross(&taken.impulse)
        })
        .sum()
}

impl AngularBook {
    /// Opens the account with what there is now, before loads are laid.
    pub(super) fn open(simulation: &Simulation) -> Self {
        Self {
            before: simulation.leapfrog_angular_momentum(),
            walls_before: taken_by_walls(simulation),
            ..Self::default()
        }
    }

    /// Books the kick of the step that comes next.
    pub(super) fn see(&mut self, simulation: &Simulation) {
        let (kick, gravity) = (simulation.next_kick(), simulation.gravity());
        let mut moment = Vector3::zeros();
        for grain in simulation.held(|_| true).filter(|grain| !grain.fixed) {
            let x = grain.position;
            moment += grain.mass * x;
            if let Some(Some(parts)) = self.laid.get(grain.id as usize) {
                self.traction += kick * x.cross(&parts.traction);
                self.relaxation += kick * x.cross(&parts.relaxation);
                self.moments += kick * parts.moment;
            }
        }
        self.weight += kick * moment.cross(&gravity);
        for kind in 0..2 {
            self.counterparts[kind] += kick * self.counterpart.moments[kind];
            self.sizes[kind] += kick * self.counterpart.sizes[kind];
        }
    }

    /// Forgets the loads that were laid.
    pub(super) fn begin(&mut self) {
        self.laid.fill(None);
        self.counterpart = Counterpart::default();
    }

    /// The continuum has this for the loads that are laid.
    pub(super) fn answered_by(&mut self, counterpart: &Counterpart) {
        for kind in 0..2 {
            self.counterpart.moments[kind] += counterpart.moments[kind];
            self.counterpart.sizes[kind] += counterpart.sizes[kind];
        }
    }

    /// Notes a load on a grain, with what it bears already.
    pub(super) fn lay(&mut self, grain: u32, parts: Parts) {
        let grain = grain as usize;
        if self.laid.len() <= grain {
            self.laid.resize(grain + 1, None);
        }
        let sum = self.laid[grain].get_or_insert_default();
        sum.traction += parts.traction;
        sum.relaxation += parts.relaxation;
        sum.moment += parts.moment;
    }

    /// Notes what grains brought that came, less what those took that went.
    pub(super) fn hand(&mut self, angular_momentum: &Vector3<f64>) {
        self.handed += angular_momentum;
    }

    /// Mean arms (m) of the couples that grains and continuum do not share, about these axes: of traction, and of
    /// relaxation. A slab has a counterpart about its own axis alone.
    pub fn arms(&self, axes: &[usize]) -> [f64; 2] {
        let own = [self.traction, self.relaxation];
        [0, 1].map(|kind| {
            let couple = own[kind] - self.counterparts[kind];
            let square: f64 = axes.iter().map(|&axis| couple[axis] * couple[axis]).sum();
            match self.sizes[kind] > 0.0 {
                true => square.sqrt() / self.sizes[kind],
                false => 0.0,
            }
        })
    }

    /// How far angular momentum is from what this account says about an axis, over the largest entry about any.
    pub fn error(&self, simulation: &Simulation, axis: usize) -> f64 {
        let now = simulation.leapfrog_angular_momentum();
        let walls = taken_by_walls(simulation) - self.walls_before;
        let given = [
            self.weight,
            self.traction,
            self.relaxation,
            self.moments,
            self.handed,
            -walls,
        ];
        let miss = now - self.before - given.iter().sum::<Vector3<f64>>();
        let entries = given.iter().chain([&now, &self.before]);
        let largest = entries.fold(0.0, |most: f64, entry| most.max(entry.amax()));
        if largest > 0.0 {
            miss[axis].abs() / largest
        } else {
            miss[axis].abs()
        }
    }
}
