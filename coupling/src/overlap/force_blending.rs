//! Blending of forces in the overlap, kept as the comparison: what state exchange is measured against.
//!
//! Between a and b energies are shared out, w to the grains and 1 − w to the continuum, with w falling linearly
//! from 1 to [`LEAST_WEIGHT`]. Grains and continuum obey
//!
//! ```text
//! wᵢ mᵢ aᵢ = Σ w_c f_c + wᵢ mᵢ g − ∇w·σ Vᵢ,        (1 − w) ρ ∂u/∂t = (1 − w)(∂τ/∂n + ρ g_t),
//! ```
//! with w at the contact for contact forces and at the centre for masses, and after every step of the grains the
//! mean velocities along the flow are made equal, node by node, by the weighted masses. The stress σ of the term
//! in ∇w is the continuum's: without it the split of stress between the two is free, and the overlap loosens.
//! Even so single grains are not held where w → 0, and w_c/wᵢ near the edge works on them: they heat up.
//!
//! Sources: Yue et al., *ACM Trans. Graph.* 37 (2018) 283 for the projection of velocities; Wellmann &
//! Wriggers, *Comput. Methods Appl. Mech. Eng.* 205–208 (2012) 46 for the weighting of energies.

use super::averages::{Averages, Sight};
use super::edge::{FlatEdge, ZoneEdge};
use super::far_side::FarSide;
use super::settings::Resolved;
use super::start::Start;
use super::strip::{Strip, interpolate};
use super::{OverlapError, OverlapSpec};
use colluvium_continuum::rheology::ShearLaw;
use colluvium_dem::{Load, Partner, Simulation, Snapshot};
use nalgebra::Vector3;

/// Weight of the grains at b.
pub const LEAST_WEIGHT: f64 = 0.02;

/// Grains and continuum joined by blended forces at a flat edge.
pub struct ForceBlending<L> {
    settings: Resolved,
    edge: FlatEdge,
    strip: Strip,
    continuum: FarSide<L>,
    averages: Averages,
    /// Bulk density of the continuum (kg/m³).
    density: f64,
    snapshot: Snapshot,
    /// Force and moment that are added on each grain, in the order of the snapshot.
    extra: Vec<[Vector3<f64>; 2]>,
    loads: Vec<Load>,
    stresses: [Vec<f64>; 2],
    steps: u64,
    made: u64,
}

impl<L: ShearLaw + Copy> ForceBlending<L> {
    /// Hands all grains beyond the edge over to the continuum.
    ///
    /// # Errors
    /// Settings out of range, or nothing beyond the edge.
    pub fn replace(
        spec: OverlapSpec<L>,
        simulation: &mut Simulation,
    ) -> Result<Self, OverlapError> {
        let density = spec.rheology.bulk_density();
        // Where the copy begins its weight vanishes: no stress of its own there.
        let own = |_: &Strip, face: usize| if face == 0 { 1.0 } else { 0.0 };
        let start = Start::of(&spec, simulation, own)?;
        let (edge, strip) = (start.edge, start.strip);
        simulation.remove(|g| !g.fixed && edge.distance(&g.position) > 0.0);
        let steps = start.settings.exchange_time / simulation.timestep();
        let faces = strip.nodes() + 1;
        let mut blending = Self {
            averages: Averages::new(&strip, start.settings.kernel),
            settings: start.settings,
            edge,
            strip,
            continuum: start.continuum,
            density,
            snapshot: start.sighting.snapshot,
            extra: Vec::new(),
            loads: Vec::new(),
            stresses: [vec![0.0; faces], vec![0.0; faces]],
            steps: steps.round().max(1.0) as u64,
            made: 0,
        };
        let velocities = blending.continuum.velocities().to_vec();
        blending.step_continuum(blending.settings.exchange_time)?;
        for (k, velocity) in velocities.into_iter().enumerate() {
            blending.continuum.set_velocity(k, velocity);
        }
        Ok(blending)
    }

    /// Velocities of the continuum's cells from a outwards (m/s).
    pub fn velocities(&self) -> &[f64] {
        self.continuum.velocities()
    }

    /// Advances by so many steps of the grains.
    ///
    /// # Errors
    /// If the grains fly apart or the continuum's step fails.
    pub fn advance(&mut self, simulation: &mut Simulation, steps: u64) -> Result<(), OverlapError> {
        for _ in 0..steps {
            simulation.snapshot(&mut self.snapshot);
            self.lay(simulation.timestep());
            simulation.set_loads(&self.loads)?;
            simulation.advance(1)?;
            self.made += 1;
            if self.made.is_multiple_of(self.steps) {
                self.step_continuum(self.steps as f64 * simulation.timestep())?;
            }
        }
        Ok(())
    }

    fn weight(&self, x: &Vector3<f64>) -> f64 {
        weight(&self.strip, self.edge.distance(x))
    }

    /// Loads that turn the engine's forces into blended ones, and those that make mean velocities equal.
    fn lay(&mut self, dt: f64) {
        let grains = &self.snapshot.grains;
        self.extra.clear();
        self.extra.resize(grains.len(), [Vector3::zeros(); 2]);
        for contact in &self.snapshot.contacts {
            let i = contact.grain;
            let (strip, edge) = (self.strip, self.edge);
            let weight = |x: &Vector3<f64>| weight(&strip, edge.distance(x));
            let at_contact = weight(&(grains[i].position + contact.arm));
            let factor = |i: usize| at_contact / weight(&grains[i].position) - 1.0;
            let own = factor(i);
            self.extra[i][0] += own * contact.force;
            self.extra[i][1] += own * contact.torque;
            if let Partner::Grain(j) = contact.partner {
                let other = factor(j);
                self.extra[j][0] -= other * contact.force;
                self.extra[j][1] += other * contact.partner_torque;
            }
        }
        self.read_stresses();
        let accelerations = self.project(dt);
        let (strip, edge) = (&self.strip, &self.edge);
        let width = -strip.face(0);
        self.loads.clear();
        for (i, grain) in self.snapshot.grains.iter().enumerate() {
            let s = edge.distance(&grain.position);
            if grain.fixed || s < strip.face(0) - strip.cell {
                continue;
            }
            let (n, t) = (edge.normal(&grain.position), edge.tangent(&grain.position));
            let [shear, pressure] = [0, 1].map(|part| {
                interpolate(&self.stresses[part], strip.face(0), strip.cell, s.min(0.0))
            });
            let mut force = self.extra[i][0];
            if s > strip.face(0) {
                // −∇w·σ = σ·n/L over the volume of the grain's matter.
                let volume = grain.mass / self.density;
                let weight = self.weight(&grain.position);
                force += (volume / (width * weight)) * (shear * t - pressure * n);
            }
            let projected: f64 = strip
                .shares(s)
                .iter()
                .map(|&(k, h)| h * accelerations[k])
                .sum();
            self.loads.push(Load {
                grain: grain.id,
                force: force + grain.mass * projected * t,
                moment: self.extra[i][1],
            });
        }
    }

    fn read_stresses(&mut self) {
        for f in 0..=self.strip.nodes() {
            self.stresses[0][f] = self.continuum.shear_stress(f);
            self.stresses[1][f] = self.continuum.pressure(f);
        }
        // At a the continuum bears nothing of its own: its stress is continued from the faces beyond.
        self.stresses[0][0] = 2.0 * self.stresses[0][1] - self.stresses[0][2];
    }

    /// Makes the mean velocities of each node equal, by weighted masses: accelerations of the grains over the next
    /// step; the continuum is changed at once.
    fn project(&mut self, dt: f64) -> Vec<f64> {
        let sight = Sight {
            snapshot: &self.snapshot,
            edge: &self.edge,
            strip: &self.strip,
            continuum: self.continuum.velocities(),
        };
        self.averages.sample(&sight, 1.0);
        let area = self.edge.area();
        let cell_mass = area * self.continuum.cell_mass();
        let mut accelerations = vec![0.0; self.strip.nodes()];
        for (k, acceleration) in accelerations.iter_mut().enumerate() {
            let node = &self.averages.nodes[k];
            let weight = weight(&self.strip, self.strip.node(k));
            let (grains, continuum) = (weight * node.mass, (1.0 - weight) * cell_mass);
            let slip = node.slip();
            *acceleration = slip * continuum / (grains + continuum) / dt;
            let velocity = self.continuum.velocities()[k];
            self.continuum
                .set_velocity(k, velocity - slip * grains / (grains + continuum));
        }
        accelerations
    }

    fn step_continuum(&mut self, dt: f64) -> Result<(), OverlapError> {
        self.read_stresses();
        let (shear, pressure) = (self.stresses[0][0], self.stresses[1][0]);
        self.continuum
            .step(dt, |f| if f == 0 { shear } else { 0.0 }, |_| 0.0, pressure)?;
        Ok(())
    }
}

/// Weight of the grains at a place: 1 at a, the least one from b on, linear between.
fn weight(strip: &Strip, s: f64) -> f64 {
    LEAST_WEIGHT + (1.0 - LEAST_WEIGHT) * (s / strip.face(0)).clamp(0.0, 1.0)
}
