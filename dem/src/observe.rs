//! Looking at a simulation: snapshots, energies, sums, hash.

use crate::bodies::Touched;
use crate::chunk::Chunk;
use crate::contact::composition::Visitor;
use crate::contact::{HISTORY_MAX, Interaction, Stored};
use crate::energy::Energy;
use crate::grains::{SPHERE_INERTIA, vector};
use crate::simulation::Simulation;
use crate::snapshot::{ContactSample, GrainSample, Partner, Snapshot};
use crate::state_hash::StateHash;
use nalgebra::Vector3;

/// Energy stored by one contact.
struct Store<'a> {
    pair: usize,
    overlap: f64,
    curvature: f64,
    history: &'a [f64],
}

impl Visitor for Store<'_> {
    type Output = Stored;
    fn visit<I: Interaction>(self, law: &I) -> Stored {
        let coefficients = &law.table()[self.pair];
        law.stored(coefficients, self.overlap, self.curvature, self.history)
    }
}

impl Simulation {
    /// Velocity and angular velocity of a grain at the time of its position.
    pub(crate) fn synchronised(&self, i: usize) -> (Vector3<f64>, Vector3<f64>) {
        let (v, s) = (&self.grains.motion[i], &self.grains.turn[i]);
        let (inverse_mass, inverse_radius) = (v[3], s[3]);
        let mut velocity = vector(v);
        let mut turn = vector(s);
        if self.clumps.carry(i) {
            return self.member_kicked(i, self.half_step()).into();
        }
        if self.steps_since_start > 0 && inverse_mass > 0.0 {
            let [force, torque, moment] = self.totals[i];
            let half = 0.5 * self.timestep;
            velocity += half * (vector(&force) * inverse_mass + self.gravity);
            turn += half / SPHERE_INERTIA
                * inverse_mass
                * (vector(&torque) + vector(&moment) * inverse_radius);
        }
        (velocity, turn * inverse_radius)
    }

    pub(crate) fn grain_sample(&self, i: usize) -> GrainSample {
        let (velocity, spin) = self.synchronised(i);
        let (position, image) = self.cell().wrap(vector(&self.grains.place[i]));
        GrainSample {
            id: self.grains.id[i],
            position,
            velocity: velocity - image,
            spin,
            radius: self.grains.place[i][3],
            mass: self.grains.mass[i],
            fixed: self.grains.is_fixed(i),
            clump: self.clumps.number(i),
        }
    }

    /// All grains at this instant, in the order of their rows.
    pub(crate) fn samples(&mut self) -> Vec<GrainSample> {
        self.observe();
        (0..self.grains.len())
            .map(|i| self.grain_sample(i))
            .collect()
    }

    /// Shows all grains and touching contacts; the buffers of `into` are reused.
    pub fn snapshot(&mut self, into: &mut Snapshot) {
        self.observe();
        into.time = self.time();
        into.domain = self.domain;
        into.gravity = self.gravity;
        into.grains.clear();
        into.grains
            .extend((0..self.grains.len()).map(|i| self.grain_sample(i)));
        into.contacts.clear();
        let (rows, cell) = (self.slot_rows(), self.cell());
        for (chunk, k) in self.reach.pairs() {
            let [i, j] = chunk.pair(k);
            let (a, b) = (&self.grains.place[i], &self.grains.place[j]);
            let (apart, _) = cell.nearest(vector(a) - vector(b));
            let (distance, radii) = (apart.norm(), a[3] + b[3]);
            if distance >= radii && !self.holds(&self.history_of(chunk, k)) {
                continue;
            }
            let slot = &chunk.slots[k * rows..][..rows];
            let (turn, moment) = (
                vector(&slot[1]),
                slot.get(2).map_or_else(Vector3::zeros, vector),
            );
            // The contact point divides the line of centres as the radii do.
            into.contacts.push(ContactSample {
                grain: i,
                partner: Partner::Grain(j),
                overlap: radii - distance,
                force: vector(&slot[0]),
                arm: -apart * (a[3] / radii),
                partner_arm: apart * (b[3] / radii),
                torque: turn * a[3] + moment,
                partner_torque: turn * b[3] - moment,
            });
        }
        for contact in self.wall_contacts.touching() {
            let i = contact.grain as usize;
            let distance = self.grains.place[i][3] - contact.overlap;
            into.contacts.push(ContactSample {
                grain: i,
                partner: match self.touched(contact.wall as usize) {
                    Touched::Wall(wall) => Partner::Wall(wall),
                    Touched::Body(body) => Partner::Body(body),
                },
                overlap: contact.overlap,
                force: vector(&contact.slot[0]),
                arm: -Vector3::from(contact.normal) * distance,
                partner_arm: Vector3::zeros(),
                torque: vector(&contact.slot[1]) * self.grains.place[i][3]
                    + vector(&contact.slot[2]),
                partner_torque: Vector3::zeros(),
            });
        }
        self.bond_samples(&mut into.bonds);
        self.body_samples(&mut into.bodies, &mut into.body_contacts);
    }

    /// Kinetic and elastic energy at this instant.
    pub fn energy(&mut self) -> Energy {
        self.observe();
        let mut energy = Energy::default();
        for i in (0..self.grains.len()).filter(|&i| self.moves_alone(i)) {
            let (v, w) = self.synchronised(i);
            let (m, r) = (self.grains.mass[i], self.grains.place[i][3]);
            energy.translation += 0.5 * m * v.norm_squared();
            energy.rotation += 0.5 * SPHERE_INERTIA * m * r * r * w.norm_squared();
        }
        let (width, cell) = (self.layout.history, self.cell());
        for (chunk, k) in self.reach.pairs() {
            let [i, j] = chunk.pair(k);
            let (a, b) = (&self.grains.place[i], &self.grains.place[j]);
            let apart = cell.nearest(vector(a) - vector(b)).0.norm();
            let history = self.history_of(chunk, k);
            let pair = self.pair(i, self.grains.material[j]);
            let curvature = self.grains.turn[i][3] + self.grains.turn[j][3];
            self.add_stored(
                &mut energy,
                pair,
                a[3] + b[3] - apart,
                curvature,
                &history[..width],
            );
        }
        for contact in self.wall_contacts.touching() {
            let i = contact.grain as usize;
            let wall = &self.walls[contact.wall as usize];
            let pair = self.pair(i, wall.wall.material);
            self.add_stored(
                &mut energy,
                pair,
                contact.overlap,
                self.grains.turn[i][3] + wall.curvature(),
                &contact.history[..width],
            );
        }
        let [translation, rotation] = self.clump_kinetic();
        energy.translation += translation;
        energy.rotation += rotation;
        energy.bonds = self.bond_energy();
        energy.potential = self.fields.potential();
        self.add_body_energy(&mut energy);
        energy
    }

    /// History of a pair within reach.
    fn history_of(&self, chunk: &Chunk, pair: usize) -> [f64; HISTORY_MAX] {
        let mut history = [0.0; HISTORY_MAX];
        chunk.history(pair, &mut history[..self.layout.history]);
        history
    }

    /// Whether a history is that of an adhesive contact, which may hold across a gap.
    fn holds(&self, history: &[f64]) -> bool {
        self.layout.holds && history[self.layout.history - 1] != 0.0
    }

    /// Row of the law table for a grain and a material.
    fn pair(&self, grain: usize, material: u16) -> usize {
        usize::from(self.grains.material[grain]) * self.law.materials() + usize::from(material)
    }

    fn add_stored(
        &self,
        energy: &mut Energy,
        pair: usize,
        overlap: f64,
        curvature: f64,
        history: &[f64],
    ) {
        // A contact that holds across a gap is known by its history.
        if overlap <= 0.0 && !self.holds(history) {
            return;
        }
        let stored = self.law.visit(Store {
            pair,
            overlap,
            curvature,
            history,
        });
        energy.normal += stored.normal;
        energy.cohesion += stored.cohesion;
        energy.tangential += stored.tangential;
        energy.rolling += stored.rolling;
        energy.twisting += stored.twisting;
    }

    /// Momentum of the free grains and bodies at this instant (N s).
    pub fn momentum(&mut self) -> Vector3<f64> {
        let samples = self.samples();
        let alone = (0..samples.len()).filter(|&i| self.moves_alone(i));
        alone
            .map(|i| samples[i].mass * samples[i].velocity)
            .sum::<Vector3<f64>>()
            + self.clump_momentum_now()
            + self.body_momentum_now()
    }

    /// Momentum that fixed grains, walls and bodies that are not free have taken from free grains and
    /// bodies since the start (N s).
    ///
    /// With constant gravity g: `momentum(t) + wall_impulse(t) - m g t` is constant to round-off, up
    /// to half a step's force, since velocities inside live half a step back.
    pub fn wall_impulse(&mut self) -> Vector3<f64> {
        self.fold_impulses();
        Vector3::from(self.impulse)
    }

    /// Mass of the free grains (kg).
    pub fn free_mass(&self) -> f64 {
        (0..self.grains.len())
            .filter(|&i| !self.grains.is_fixed(i))
            .map(|i| self.grains.mass[i])
            .sum()
    }

    /// Momentum of the free grains and bodies as the integrator holds it, half a step back (N s).
    ///
    /// `leapfrog_momentum(t) + wall_impulse(t)` changes by exactly the weight times time.
    pub fn leapfrog_momentum(&self) -> Vector3<f64> {
        let mut sum = Vector3::zeros();
        for i in (0..self.grains.len()).filter(|&i| self.moves_alone(i)) {
            sum += self.grains.mass[i] * vector(&self.grains.motion[i]);
        }
        sum + self.clump_momentum().0 + self.body_momentum().0
    }

    /// How far the momentum of grains and walls is from that of the start plus gravity's, relative to
    /// the largest of the terms: round-off, unless a force had no counterforce.
    pub fn momentum_error(&mut self) -> f64 {
        let (held, taken) = (self.leapfrog_momentum(), self.wall_impulse());
        let free = (0..self.grains.len()).filter(|&i| self.moves_alone(i));
        let size: f64 = free
            .map(|i| self.grains.mass[i] * vector(&self.grains.motion[i]).norm())
            .sum();
        let size = size + self.clump_momentum().1 + self.body_momentum().1;
        let scale = size.max(taken.norm()).max(self.account.norm());
        if scale > 0.0 {
            (held + taken - self.account).norm() / scale
        } else {
            0.0
        }
    }

    /// Angular momentum of the free grains and bodies about the origin, spins included, as the integrator holds
    /// it: positions now, velocities half a step back (N m s). Without walls, gravity and periodic axes
    /// it is conserved to round-off.
    pub fn leapfrog_angular_momentum(&self) -> Vector3<f64> {
        let mut sum = Vector3::zeros();
        for i in (0..self.grains.len()).filter(|&i| self.moves_alone(i)) {
            let (x, v, turn) = (
                vector(&self.grains.place[i]),
                vector(&self.grains.motion[i]),
                vector(&self.grains.turn[i]),
            );
            let radius = self.grains.place[i][3];
            sum += self.grains.mass[i] * (x.cross(&v) + SPHERE_INERTIA * radius * turn);
        }
        sum + self.clump_angular_momentum() + self.body_angular_momentum()
    }

    /// Hash of the bits of all positions, velocities, spins and springs, in the grains' own order.
    ///
    /// 64-bit FNV-1a, in hex. The same for any number of threads and after a restart.
    pub fn state_hash(&mut self) -> String {
        self.observe();
        let n = self.grains.len();
        let mut by_id: Vec<usize> = (0..n).collect();
        by_id.sort_by_key(|&i| self.grains.id[i]);
        let mut hash = StateHash::default();
        for i in by_id {
            for rows in [&self.grains.place, &self.grains.motion, &self.grains.turn] {
                rows[i].iter().for_each(|x| hash.take(x.to_bits()));
            }
        }
        let width = self.layout.history;
        let mut contacts: Vec<_> = self
            .reach
            .pairs()
            .map(|(chunk, k)| {
                let [i, j] = chunk.pair(k);
                (self.grains.id[i], self.grains.id[j], chunk, k)
            })
            .collect();
        contacts.sort_by_key(|&(a, b, ..)| (a.min(b), a.max(b)));
        for (a, b, chunk, k) in contacts {
            let history = self.history_of(chunk, k);
            // Pairs within reach that do not touch are an accident of the lists.
            if history.iter().all(|&h| h == 0.0) {
                continue;
            }
            hash.take(u64::from(a) << 32 | u64::from(b));
            history[..width].iter().for_each(|h| hash.take(h.to_bits()));
        }
        let mut walls: Vec<_> = self.wall_contacts.touching().collect();
        walls.sort_by_key(|c| (self.grains.id[c.grain as usize], c.wall));
        for c in walls
            .into_iter()
            .filter(|c| c.history.iter().any(|&h| h != 0.0))
        {
            c.history.iter().for_each(|h| hash.take(h.to_bits()));
        }
        self.bonds.hash(&mut hash);
        self.bodies.hash(&mut hash);
        self.clumps.hash(&mut hash);
        hash.finish()
    }
}
