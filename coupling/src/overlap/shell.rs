//! What acts on the grains near the edge, every step of theirs.
//!
//! On a grain of the shell, with q its weight ([`Strip::traction_weight`]) and Q = Σ q,
//!
//! ```text
//! F = (q/Q) A [σ_tn t − (p + Z (v̄ − w)) n],        v̄ = Σ q v·n/Q,
//! ```
//! the traction of the continuum on the edge's area A. Its normal part is that of a layer of impedance Z that
//! moves with w: a wave of the grains leaves through the edge instead of coming back.
//!
//! On a grain of the buffer, F = m Σ_k h_k a_k and, about n × t, M = I Σ_k h_k α_k: accelerations of nodes, which
//! shift mean velocities and spins and leave those of single grains about the mean alone.

use super::edge::ZoneEdge;
use super::strip::Strip;
use colluvium_dem::{GrainSample, Load, SetupError, Simulation};
use nalgebra::Vector3;

/// Traction of the continuum, held over an exchange, and the accelerations of nodes.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Held {
    /// σ_tn on the edge (Pa).
    pub shear: f64,
    /// p on the edge (Pa).
    pub pressure: f64,
    /// Accelerations of the grains' means along the flow, one for each node (m/s²).
    pub accelerations: Vec<f64>,
    /// Angular accelerations about n × t (rad/s²).
    pub spins: Vec<f64>,
}

/// Impulses given to the grains since the last exchange.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Given {
    /// Of relaxation along the flow, by node (N s).
    pub relaxation: Vec<f64>,
    /// Moments of relaxation, by node (N m s).
    pub spin: Vec<f64>,
    /// Of traction along the flow (N s).
    pub shear: f64,
    /// Of the continuum's pressure along n (N s).
    pub pressure: f64,
    /// Of the impedance along n (N s).
    pub impedance: f64,
    /// Kicks (s).
    pub time: f64,
}

/// Work of what acts on the grains (J).
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Work {
    /// Of the continuum's shear stress and pressure.
    pub traction: f64,
    /// Of the impedance; negative where it absorbs.
    pub impedance: f64,
    /// Of the relaxation of velocities and spins.
    pub relaxation: f64,
}

/// Numbers of a grain in [`Shell::pulls`].
pub(super) const PULL: usize = 12;

/// Forces on one grain in the present step, by origin.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct Pull {
    traction: Vector3<f64>,
    impedance: Vector3<f64>,
    relaxation: Vector3<f64>,
    moment: Vector3<f64>,
}

/// Lays the loads of each step and keeps their books.
#[derive(Clone, Debug, Default)]
pub struct Shell {
    loads: Vec<Load>,
    near: Vec<Near>,
    /// By grain number.
    pulls: Vec<Pull>,
    /// Work since the start; that of the last kick is half booked.
    pub work: Work,
    /// Length of the last kick (s).
    pub last_kick: f64,
    /// Grains beyond the edge by more than a cell, now.
    pub beyond: usize,
}

/// A grain near the edge in one step.
#[derive(Clone, Copy, Debug)]
struct Near {
    grain: GrainSample,
    /// Distance from the edge (m).
    s: f64,
    /// Weight of its traction (kg).
    weight: f64,
    normal: Vector3<f64>,
}

impl Shell {
    /// For a number of grains that does not grow: nothing is allocated later.
    pub fn new(grains: usize) -> Self {
        Self {
            loads: Vec::with_capacity(grains),
            near: Vec::with_capacity(grains),
            ..Self::default()
        }
    }

    /// Lays the loads of the next step. Returns v̄ (m/s), or nothing where the shell is empty.
    pub fn lay<E: ZoneEdge>(
        &mut self,
        simulation: &mut Simulation,
        (edge, strip): (&E, &Strip),
        (impedance, continuum_velocity): (f64, f64),
        held: &Held,
        given: &mut Given,
    ) -> Result<Option<f64>, SetupError> {
        let kick = simulation.next_kick();
        let [weight, momentum] = self.weigh(simulation, edge, strip);
        let mean = (weight > 0.0).then(|| momentum / weight);
        let area = edge.area();
        let through = mean.map_or(0.0, |v| impedance * (v - continuum_velocity));
        let per_weight = area / weight.max(f64::MIN_POSITIVE);
        self.loads.clear();
        for near in &self.near {
            let grain = &near.grain;
            let (n, t) = (near.normal, edge.tangent(&grain.position));
            let share = near.weight * per_weight;
            let (mut rate, mut turn) = (0.0, 0.0);
            let inertia = 0.4 * grain.mass * grain.radius * grain.radius;
            for (k, h) in strip.shares(near.s) {
                let acceleration = h * held.accelerations[k];
                let spin = h * held.spins[k];
                rate += acceleration;
                turn += spin;
                given.relaxation[k] += grain.mass * acceleration * kick;
                given.spin[k] += inertia * spin * kick;
            }
            let pull = Pull {
                traction: share * (held.shear * t - held.pressure * n),
                impedance: -share * through * n,
                relaxation: grain.mass * rate * t,
                moment: inertia * turn * n.cross(&t),
            };
            if pull == Pull::default() {
                continue;
            }
            given.shear += share * held.shear * kick;
            given.pressure -= share * held.pressure * kick;
            given.impedance -= share * through * kick;
            self.loads.push(Load {
                grain: grain.id,
                force: pull.traction + pull.impedance + pull.relaxation,
                moment: pull.moment,
            });
            self.work
                .add(&pull, (&grain.velocity, &grain.spin), 0.5 * kick);
            self.pulls[grain.id as usize] = pull;
        }
        given.time += kick;
        self.last_kick = kick;
        simulation.set_loads(&self.loads)?;
        Ok(mean)
    }

    /// Finds the grains on which anything may act, books the second half of the last kick's work on them, and
    /// weighs the shell: Σ q and Σ q v·n.
    fn weigh<E: ZoneEdge>(&mut self, simulation: &Simulation, edge: &E, strip: &Strip) -> [f64; 2] {
        // The innermost node of the buffer reaches half a cell beyond m; what was pulled at in the last step has
        // hardly moved.
        let reach = strip.handshake() - strip.cell;
        let (mut weight, mut momentum) = (0.0, 0.0);
        self.beyond = 0;
        self.near.clear();
        let last = 0.5 * self.last_kick;
        let beyond_reach = |x: &Vector3<f64>| edge.distance(x) > reach;
        for grain in simulation.held(beyond_reach).filter(|grain| !grain.fixed) {
            let id = grain.id as usize;
            if id >= self.pulls.len() {
                self.pulls.resize(id + 1, Pull::default());
            }
            let pull = std::mem::take(&mut self.pulls[id]);
            if pull != Pull::default() {
                self.work.add(&pull, (&grain.velocity, &grain.spin), last);
            }
            let s = edge.distance(&grain.position);
            let normal = edge.normal(&grain.position);
            let q = strip.traction_weight(grain.mass, s);
            weight += q;
            momentum += q * grain.velocity.dot(&normal);
            self.beyond += usize::from(s > strip.cell);
            self.near.push(Near {
                grain,
                s,
                weight: q,
                normal,
            });
        }
        [weight, momentum]
    }

    /// Forces in the present step, by grain number, for a checkpoint.
    pub fn pulls(&self) -> Vec<f64> {
        let vectors = |p: &Pull| [p.traction, p.impedance, p.relaxation, p.moment];
        let flat = self.pulls.iter().flat_map(vectors);
        flat.flat_map(|v| [v.x, v.y, v.z]).collect()
    }

    /// Reads them back.
    pub fn take_up(&mut self, flat: &[f64]) {
        self.pulls = flat
            .as_chunks::<PULL>()
            .0
            .iter()
            .map(|p| {
                let v = |k: usize| Vector3::new(p[3 * k], p[3 * k + 1], p[3 * k + 2]);
                Pull {
                    traction: v(0),
                    impedance: v(1),
                    relaxation: v(2),
                    moment: v(3),
                }
            })
            .collect();
    }
}

impl Work {
    fn add(&mut self, pull: &Pull, (v, spin): (&Vector3<f64>, &Vector3<f64>), time: f64) {
        self.traction += time * pull.traction.dot(v);
        self.impedance += time * pull.impedance.dot(v);
        self.relaxation += time * (pull.relaxation.dot(v) + pull.moment.dot(spin));
    }
}
