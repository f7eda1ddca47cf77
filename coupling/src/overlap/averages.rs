//! What the continuum gets to know of the grains: stresses on its faces, mean velocities and spins at its nodes.

use super::edge::ZoneEdge;
use super::joint::{inertia, over};
use super::settings::StressKernel;
use super::strip::{Shares, Strip, interpolate};
use crate::coarse_graining::{Kernel, Layers, Lucy};
use colluvium_dem::{GrainSample, Partner, Snapshot};
use nalgebra::Vector3;

/// Sums over the grains of one node, weighted by their hat functions.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Node {
    /// Σ m (kg).
    pub mass: f64,
    /// Σ m v along the flow (kg m/s).
    pub momentum: f64,
    /// Σ m u of the continuum's velocity at the grains (kg m/s).
    pub continuum: f64,
    /// Σ I (kg m²).
    pub inertia: f64,
    /// Σ I ω about n × t (kg m²/s).
    pub spin: f64,
    /// Σ m |v′|² (J), about the grains' own mean velocity.
    pub fluctuation: f64,
    /// Σ (m v′)² along the flow, with the squares of the hats: variance of `momentum` if grains move independently (N² s²).
    pub variance: f64,
}

impl Node {
    /// Mean velocity of the grains (m/s).
    pub fn velocity(&self) -> f64 {
        over(self.momentum, self.mass)
    }

    /// Mean velocity of the continuum where the grains are, minus theirs (m/s).
    ///
    /// Both are weighted by the same masses, so that equal profiles differ by nothing however unevenly the
    /// grains lie.
    pub fn slip(&self) -> f64 {
        over(self.continuum - self.momentum, self.mass)
    }

    /// Mean spin (rad/s).
    pub fn mean_spin(&self) -> f64 {
        over(self.spin, self.inertia)
    }
}

/// Stress of the grains on a face with outward normal n (Pa).
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct FaceStress {
    /// σ_tn, positive where the outer side pulls the inner one forwards.
    pub shear: f64,
    /// −σ_nn.
    pub pressure: f64,
}

/// Averages of the grains on one strip.
#[derive(Clone, Debug)]
pub struct Averages {
    kernel: StressKernel,
    /// Exponential averages, one for each face.
    pub faces: Vec<FaceStress>,
    /// Sums of the last sample, one for each node.
    pub nodes: Vec<Node>,
    /// Whether `faces` hold anything.
    pub started: bool,
    instant: Vec<FaceStress>,
    velocities: Vec<f64>,
}

/// What a sample is taken of.
pub struct Sight<'a, E> {
    /// Grains and contacts.
    pub snapshot: &'a Snapshot,
    /// The edge.
    pub edge: &'a E,
    /// Faces and nodes.
    pub strip: &'a Strip,
    /// Velocities of the continuum's cells, from a outwards.
    pub continuum: &'a [f64],
}

impl Averages {
    /// Empty averages.
    pub fn new(strip: &Strip, kernel: StressKernel) -> Self {
        let faces = vec![FaceStress::default(); strip.nodes() + 1];
        Self {
            kernel,
            instant: faces.clone(),
            faces,
            nodes: vec![Node::default(); strip.nodes()],
            velocities: vec![0.0; strip.nodes()],
            started: false,
        }
    }

    /// Takes in one instant: nodes as they are, stresses with the weight 1 − exp(−Δt/t) against those before,
    /// where `lapse` is Δt/t.
    pub fn sample<E: ZoneEdge>(&mut self, sight: &Sight<'_, E>, lapse: f64) {
        self.sum_nodes(sight);
        self.instant.fill(FaceStress::default());
        match self.kernel {
            StressKernel::Layer => self.sum_stresses(sight, &Layers),
            StressKernel::Lucy(half_width) => self.sum_stresses(sight, &Lucy { half_width }),
        }
        let weight = if self.started {
            -(-lapse).exp_m1()
        } else {
            1.0
        };
        for (mean, now) in self.faces.iter_mut().zip(&self.instant) {
            mean.shear += weight * (now.shear - mean.shear);
            mean.pressure += weight * (now.pressure - mean.pressure);
        }
        self.started = true;
    }

    fn sum_nodes<E: ZoneEdge>(&mut self, sight: &Sight<'_, E>) {
        let strip = sight.strip;
        self.nodes.fill(Node::default());
        for (grain, s, shares) in inside(sight) {
            let (n, t) = (
                sight.edge.normal(&grain.position),
                sight.edge.tangent(&grain.position),
            );
            let velocity = grain.velocity.dot(&t);
            let continuum = interpolate(sight.continuum, strip.node(0), strip.cell, s);
            let inertia = inertia(grain);
            let spin = grain.spin.dot(&n.cross(&t));
            for (k, h) in shares {
                let node = &mut self.nodes[k];
                node.mass += h * grain.mass;
                node.momentum += h * grain.mass * velocity;
                node.continuum += h * grain.mass * continuum;
                node.inertia += h * inertia;
                node.spin += h * inertia * spin;
            }
        }
        for (velocity, node) in self.velocities.iter_mut().zip(&self.nodes) {
            *velocity = node.velocity();
        }
        for (grain, s, shares) in inside(sight) {
            let t = sight.edge.tangent(&grain.position);
            let mean = interpolate(&self.velocities, strip.node(0), strip.cell, s);
            let apart = grain.velocity - mean * t;
            let fluctuation = grain.mass * apart.norm_squared();
            let along = grain.mass * apart.dot(&t);
            for (k, h) in shares {
                self.nodes[k].fluctuation += h * fluctuation;
                self.nodes[k].variance += (h * along).powi(2);
            }
        }
    }

    /// σ = (1/V) [Σ f ⊗ a ∫W − Σ m v′ ⊗ v′ W] in layers of a cell around each face; the line between two centres
    /// bears the force of their contact.
    fn sum_stresses<E: ZoneEdge, K: Kernel>(&mut self, sight: &Sight<'_, E>, kernel: &K) {
        let (strip, snapshot) = (sight.strip, sight.snapshot);
        let volume = sight.edge.area() * strip.cell;
        let lowest = strip.face(0) - 0.5 * strip.cell - kernel.reach();
        for contact in &snapshot.contacts {
            let grain = &snapshot.grains[contact.grain];
            let other = match contact.partner {
                Partner::Grain(j) => Some(&snapshot.grains[j]).filter(|other| !other.fixed),
                Partner::Wall(_) | Partner::Body(_) => None,
            };
            // What is held in place is wall: its half of the line is not material.
            let (start, force, branch) = match (grain.fixed, other) {
                (false, Some(_)) => (
                    &grain.position,
                    contact.force,
                    contact.arm - contact.partner_arm,
                ),
                (false, None) => (&grain.position, contact.force, contact.arm),
                (true, Some(other)) => (&other.position, -contact.force, contact.partner_arm),
                (true, None) => continue,
            };
            let (n, t) = (sight.edge.normal(start), sight.edge.tangent(start));
            let s = sight.edge.distance(start);
            let end = s + branch.dot(&n);
            if s.max(end) < lowest {
                continue;
            }
            let (along, across) = (force.dot(&t) / volume, force.dot(&n) / volume);
            self.spread(strip, kernel, [s, end], |face, climb, _| {
                face.shear += along * climb;
                face.pressure -= across * climb;
            });
        }
        for grain in snapshot.grains.iter().filter(|g| !g.fixed) {
            let s = sight.edge.distance(&grain.position);
            if s < lowest {
                continue;
            }
            let (n, t) = (
                sight.edge.normal(&grain.position),
                sight.edge.tangent(&grain.position),
            );
            let mean = interpolate(&self.velocities, strip.node(0), strip.cell, s);
            let across = grain.velocity.dot(&n);
            let along = grain.velocity.dot(&t) - mean;
            let mass = grain.mass / sight.edge.area() / strip.cell;
            self.spread(strip, kernel, [s, s], |face, _, share| {
                face.shear -= mass * along * across * share;
                face.pressure += mass * across * across * share;
            });
        }
    }

    /// Hands each layer that a line from s to e touches a_n ∫₀¹W and, for a point, its share of it.
    fn spread<K: Kernel>(
        &mut self,
        strip: &Strip,
        kernel: &K,
        [s, e]: [f64; 2],
        mut put: impl FnMut(&mut FaceStress, f64, f64),
    ) {
        let (h, reach) = (strip.cell, kernel.reach());
        let origin = strip.face(0) - 0.5 * h;
        let first = ((s.min(e) - reach - origin) / h).floor().max(0.0) as usize;
        let last = ((s.max(e) + reach - origin) / h).floor();
        if last < 0.0 {
            return;
        }
        let last = (last as usize).min(self.instant.len() - 1);
        for f in first..=last {
            let low = origin + f as f64 * h;
            let high = low + h;
            let below = kernel.double_cumulative(low - s) - kernel.double_cumulative(low - e);
            let above = kernel.double_cumulative(high - s) - kernel.double_cumulative(high - e);
            let share = kernel.cumulative(high - s) - kernel.cumulative(low - s);
            put(&mut self.instant[f], above - below, share);
        }
    }
}

/// Free grains that belong to any node, with their places and shares.
fn inside<'a, E: ZoneEdge>(
    sight: &'a Sight<'_, E>,
) -> impl Iterator<Item = (&'a GrainSample, f64, Shares)> {
    let free = sight.snapshot.grains.iter().filter(|g| !g.fixed);
    free.filter_map(|grain| {
        let s = sight.edge.distance(&grain.position);
        let shares = sight.strip.shares(s);
        (shares[0].1 + shares[1].1 > 0.0).then_some((grain, s, shares))
    })
}

/// Mean velocities of grains along the flow in cells of height `cell` from the place `first` (a face) outwards;
/// cells without grains have those of the one before.
pub fn velocity_profile<E: ZoneEdge>(
    grains: &[GrainSample],
    edge: &E,
    first: f64,
    cell: f64,
    cells: usize,
) -> Vec<f64> {
    let mut sums = vec![[0.0; 2]; cells];
    for grain in grains.iter().filter(|g| !g.fixed) {
        let at = ((edge.distance(&grain.position) - first) / cell).floor();
        if at >= 0.0 {
            let sum = &mut sums[(at as usize).min(cells - 1)];
            sum[0] += grain.mass;
            sum[1] += grain.mass * grain.velocity.dot(&edge.tangent(&grain.position));
        }
    }
    let mut last = 0.0;
    sums.iter()
        .map(|&[mass, momentum]| {
            if mass > 0.0 {
                last = momentum / mass;
            }
            last
        })
        .collect()
}

/// Mean velocity of grains normal to the edge beyond a place (m/s).
pub fn normal_velocity<E: ZoneEdge>(grains: &[GrainSample], edge: &E, beyond: f64) -> f64 {
    let beyond = |g: &&GrainSample| !g.fixed && edge.distance(&g.position) > beyond;
    let sums = grains.iter().filter(beyond).fold([0.0; 2], |[m, p], g| {
        let n: Vector3<f64> = edge.normal(&g.position);
        [m + g.mass, p + g.mass * g.velocity.dot(&n)]
    });
    over(sums[1], sums[0])
}
