//! What acts on the grains near the edge.
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
//!
//! These forces are formed every few steps of the grains and held in between; what they give is booked every step.

use super::angular::{AngularBook, Counterpart, Parts};
use super::edge::ZoneEdge;
use super::joint::inertia;
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

/// Sums over the grains of what acts on them: forces while they are laid (N, N m), or the impulses that those
/// have given (N s, N m s).
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Given {
    /// Of relaxation along the flow, by node.
    pub relaxation: Vec<f64>,
    /// Moments of relaxation, by node.
    pub spin: Vec<f64>,
    /// Of traction along the flow.
    pub shear: f64,
    /// Of the continuum's pressure along n.
    pub pressure: f64,
    /// Of the impedance along n.
    pub impedance: f64,
}

impl Given {
    /// Nothing, for so many nodes.
    pub fn nothing(nodes: usize) -> Self {
        Self {
            relaxation: vec![0.0; nodes],
            spin: vec![0.0; nodes],
            ..Self::default()
        }
    }

    /// Back to nothing.
    pub fn clear(&mut self) {
        self.relaxation.fill(0.0);
        self.spin.fill(0.0);
        (self.shear, self.pressure, self.impedance) = (0.0, 0.0, 0.0);
    }

    /// Adds the impulses of forces that act for a time (s).
    pub fn add(&mut self, forces: &Given, time: f64) {
        let nodes = [
            (&mut self.relaxation, &forces.relaxation),
            (&mut self.spin, &forces.spin),
        ];
        for (sums, forces) in nodes {
            for (sum, force) in sums.iter_mut().zip(forces) {
                *sum += force * time;
            }
        }
        self.shear += forces.shear * time;
        self.pressure += forces.pressure * time;
        self.impedance += forces.impedance * time;
    }

    /// All sums, those of the nodes first.
    pub fn numbers(&self) -> Vec<f64> {
        let edge = [self.shear, self.pressure, self.impedance];
        [&self.relaxation[..], &self.spin, &edge].concat()
    }

    /// From such numbers.
    pub fn from_numbers(n: &[f64], nodes: usize) -> Result<Self, String> {
        match n.split_at_checked(2 * nodes) {
            Some((of_nodes, &[shear, pressure, impedance])) => Ok(Self {
                relaxation: of_nodes[..nodes].to_vec(),
                spin: of_nodes[nodes..].to_vec(),
                shear,
                pressure,
                impedance,
            }),
            _ => Err(format!(
                "{} numbers of what the grains are given instead of {}",
                n.len(),
                2 * nodes + 3
            )),
        }
    }
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
pub(super) const PULL: usize = 15;

/// Forces on one grain, by origin.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct Pull {
    traction: Vector3<f64>,
    impedance: Vector3<f64>,
    relaxation: Vector3<f64>,
    moment: Vector3<f64>,
    /// Powers of traction, impedance and relaxation when they were laid (W).
    powers: [f64; 3],
}

impl Pull {
    fn is_nothing(&self) -> bool {
        *self == Pull::default()
    }

    fn powers(&self, grain: &GrainSample) -> [f64; 3] {
        let (v, spin) = (&grain.velocity, &grain.spin);
        [
            self.traction.dot(v),
            self.impedance.dot(v),
            self.relaxation.dot(v) + self.moment.dot(spin),
        ]
    }
}

/// Lays the loads and keeps their books.
#[derive(Clone, Debug, Default)]
pub struct Shell {
    loads: Vec<Load>,
    near: Vec<Near>,
    /// By grain number.
    pulls: Vec<Pull>,
    /// Forces that are laid.
    pub laid: Given,
    /// Work since the start, by the mean of the powers before and after; that of what is laid now is not yet booked.
    pub work: Work,
    /// For how long the present forces have acted (s).
    pub acted: f64,
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
    pub fn new(grains: usize, nodes: usize) -> Self {
        Self {
            loads: Vec::with_capacity(grains),
            near: Vec::with_capacity(grains),
            laid: Given::nothing(nodes),
            ..Self::default()
        }
    }

    /// Lays the loads of the next steps.
    pub fn lay<E: ZoneEdge>(
        &mut self,
        simulation: &mut Simulation,
        (edge, strip): (&E, &Strip),
        (impedance, continuum_velocity): (f64, f64),
        held: &Held,
        mut book: Option<&mut AngularBook>,
    ) -> Result<(), SetupError> {
        if let Some(book) = &mut book {
            book.begin();
        }
        let mut answer = Counterpart::default();
        let [weight, momentum] = self.weigh(simulation, edge, strip);
        let mean = (weight > 0.0).then(|| momentum / weight);
        let area = edge.area();
        let through = mean.map_or(0.0, |v| impedance * (v - continuum_velocity));
        let per_weight = area / weight.max(f64::MIN_POSITIVE);
        self.loads.clear();
        self.laid.clear();
        let laid = &mut self.laid;
        for near in &self.near {
            let grain = &near.grain;
            let (n, t) = (near.normal, edge.tangent(&grain.position));
            let share = near.weight * per_weight;
            let (mut rate, mut turn) = (0.0, 0.0);
            let inertia = inertia(grain);
            for (k, h) in strip.shares(near.s) {
                let acceleration = h * held.accelerations[k];
                let spin = h * held.spins[k];
                rate += acceleration;
                turn += spin;
                laid.relaxation[k] += grain.mass * acceleration;
                laid.spin[k] += inertia * spin;
                let node = grain.position + (strip.node(k) - near.s) * n;
                answer.add(1, &node, &(grain.mass * acceleration * t));
            }
            let mut pull = Pull {
                traction: share * (held.shear * t - held.pressure * n),
                impedance: -share * through * n,
                relaxation: grain.mass * rate * t,
                moment: inertia * turn * n.cross(&t),
                powers: [0.0; 3],
            };
            if pull.is_nothing() {
                continue;
            }
            pull.powers = pull.powers(grain);
            laid.shear += share * held.shear;
            laid.pressure -= share * held.pressure;
            laid.impedance -= share * through;
            self.loads.push(Load {
                grain: grain.id,
                force: pull.traction + pull.impedance + pull.relaxation,
                moment: pull.moment,
            });
            self.pulls[grain.id as usize] = pull;
            let traction = pull.traction + pull.impedance;
            answer.add(0, &(grain.position - near.s * n), &traction);
            if let Some(book) = &mut book {
                let parts = Parts {
                    traction,
                    relaxation: pull.relaxation,
                    moment: pull.moment,
                };
                book.lay(grain.id, parts);
            }
        }
        if let Some(book) = book {
            book.answered_by(&answer);
        }
        self.acted = 0.0;
        simulation.set_loads(&self.loads)
    }

    /// Finds the grains on which anything may act, books the work of the last forces on them, and weighs the
    /// shell: Σ q and Σ q v·n.
    fn weigh<E: ZoneEdge>(&mut self, simulation: &Simulation, edge: &E, strip: &Strip) -> [f64; 2] {
        // The innermost node of the buffer reaches half a cell beyond m; what was pulled at in the last step has
        // hardly moved.
        let reach = strip.handshake() - strip.cell;
        let (mut weight, mut momentum) = (0.0, 0.0);
        self.near.clear();
        let half = 0.5 * self.acted;
        let beyond_reach = |x: &Vector3<f64>| edge.distance(x) > reach;
        for grain in simulation.held(beyond_reach).filter(|grain| !grain.fixed) {
            let id = grain.id as usize;
            if id >= self.pulls.len() {
                self.pulls.resize(id + 1, Pull::default());
            }
            let s = edge.distance(&grain.position);
            let normal = edge.normal(&grain.position);
            self.near.push(Near {
                grain,
                s,
                weight: strip.traction_weight(grain.mass, s),
                normal,
            });
        }
        // Rows may stand in another order after a restart, and sums over them end in other bits.
        self.near.sort_unstable_by_key(|near| near.grain.id);
        for near in &self.near {
            let pull = std::mem::take(&mut self.pulls[near.grain.id as usize]);
            if !pull.is_nothing() {
                self.work.add(pull.powers, half);
                self.work.add(pull.powers(&near.grain), half);
            }
            weight += near.weight;
            momentum += near.weight * near.grain.velocity.dot(&near.normal);
        }
        [weight, momentum]
    }

    /// Work since the start, that of the present forces included.
    pub fn work_until_now(&self, simulation: &Simulation) -> Work {
        let mut work = self.work;
        for grain in simulation.held(|_| true) {
            if let Some(pull) = self.pulls.get(grain.id as usize) {
                work.add(pull.powers, 0.5 * self.acted);
                work.add(pull.powers(&grain), 0.5 * self.acted);
            }
        }
        work
    }

    /// Present forces by grain number, for a checkpoint.
    pub fn pulls(&self) -> Vec<f64> {
        let numbers = |p: &Pull| {
            let vectors = [p.traction, p.impedance, p.relaxation, p.moment];
            [vectors.map(|v| [v.x, v.y, v.z]).as_flattened(), &p.powers].concat()
        };
        self.pulls.iter().flat_map(numbers).collect()
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
                    powers: [p[12], p[13], p[14]],
                }
            })
            .collect();
    }
}

impl Work {
    fn add(&mut self, [traction, impedance, relaxation]: [f64; 3], time: f64) {
        self.traction += time * traction;
        self.impedance += time * impedance;
        self.relaxation += time * relaxation;
    }
}
