//! Granular gas of smooth spheres in a periodic box, and what kinetic theory says of it.
//!
//! Units d = m = 1, T₀ = 1; T = m⟨v²⟩/3 without the mean velocity. With Carnahan & Starling's value of
//! the pair distribution at contact, Enskog's theory of hard spheres gives
//!
//! ```text
//! g₀ = (1 - φ/2)/(1 - φ)³
//! ω  = 24 φ g₀ √(T/π)                       collisions of a grain per unit of time
//! dT/dt = -(1 - e²) ω T/3                   so T = T₀/(1 + t/t_c)², t_c = 6/((1 - e²) ω₀)
//! p  = n T [1 + 2 (1 + e) φ g₀]             n = 6φ/π
//! ```
//! Source: Haff 1983; Carnahan & Starling 1969; Garzó & Dufty 1999, without the correction for the
//! velocities' distribution (0.3 % in t_c at e = 0.9).
//!
//! Grains here are soft. Two that meet come nearer than d, so that as hard ones they look smaller by
//! √(πT/2k) (Barker & Henderson's diameter of a linear spring); a grain in contact is not free to
//! collide. Both are of the order of contact time over free time, ω τ.

use colluvium_dem::{
    Cohesion, ContactLaw, Domain, Grain, Hooke, Lever, Normal, Partner, Rolling, Setup, SetupError,
    Simulation, Snapshot, Tangential, Threads,
};
use nalgebra::Vector3;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use std::f64::consts::PI;

use crate::DENSITY;

/// A gas to be made.
#[derive(Clone, Copy, Debug)]
pub struct Gas {
    /// Grains along an edge of the cubic box.
    pub edge: usize,
    /// Solid fraction φ.
    pub solid_fraction: f64,
    /// Restitution e.
    pub restitution: f64,
    /// k_n, in m T₀/(m d²).
    pub stiffness: f64,
    /// Steps a contact.
    pub steps_per_contact: f64,
    /// Seed of the velocities.
    pub seed: u64,
}

impl Gas {
    /// Smooth grains.
    pub fn law(&self) -> ContactLaw {
        ContactLaw {
            normal: Normal::Hooke(Hooke::matched(self.stiffness, self.restitution)),
            tangential: Tangential::None,
            rolling: Rolling::None,
            cohesion: Cohesion::None,
            lever: Lever::ContactPoint,
        }
    }

    fn grains(&self) -> f64 {
        self.edge.pow(3) as f64
    }

    /// Number of grains over volume (1/d³).
    pub fn number_density(&self) -> f64 {
        6.0 * self.solid_fraction / PI
    }

    fn setup(&self, grains: Vec<Grain>) -> Setup {
        let law = self.law();
        let length = (self.grains() / self.number_density()).cbrt();
        Setup {
            domain: Domain {
                lower: Vector3::zeros(),
                upper: Vector3::repeat(length),
                periodic: [true; 3],
            },
            gravity: Vector3::zeros(),
            bodies: Vec::new(),
            timestep: law.contact_time(0.5, 0.25, 1.0) / self.steps_per_contact,
            law: law.into(),
            grains,
            walls: vec![],
            threads: Threads::Serial,
        }
    }

    /// Elastic grains from a lattice until the lattice is forgotten, then with their restitution, at
    /// rest on the whole and with T = 1.
    ///
    /// # Errors
    /// If the gas cannot be set up or its step is too long.
    pub fn mixed(&self) -> Result<Simulation, SetupError> {
        let mut random = ChaCha8Rng::seed_from_u64(self.seed);
        let elastic = Gas {
            restitution: 1.0,
            ..*self
        };
        let n = self.edge;
        let spacing = (self.grains() / self.number_density()).cbrt() / n as f64;
        let grains = (0..n * n * n)
            .map(|k| {
                let at = Vector3::new(k % n, k / n % n, k / (n * n)).map(|c| c as f64 + 0.5);
                Grain {
                    velocity: Vector3::from_fn(|_, _| StandardNormal.sample(&mut random)),
                    ..Grain::at_rest(at * spacing, 0.5, DENSITY)
                }
            })
            .collect();
        let mut simulation = Simulation::new(elastic.setup(grains))?;
        let time = 8.0 / elastic.collision_rate(1.0) + 2.0 * spacing;
        simulation.advance((time / simulation.timestep()) as u64)?;
        let mut snapshot = Snapshot::default();
        simulation.snapshot(&mut snapshot);
        let drift = mean_velocity(&snapshot);
        let speed = temperature(&snapshot).sqrt();
        let grains = snapshot
            .grains
            .iter()
            .map(|g| Grain {
                velocity: (g.velocity - drift) / speed,
                ..Grain::at_rest(g.position, g.radius, DENSITY)
            })
            .collect();
        Simulation::new(self.setup(grains))
    }

    /// ω at a temperature, of hard grains.
    pub fn collision_rate(&self, temperature: f64) -> f64 {
        24.0 * self.solid_fraction * contact_value(self.solid_fraction) * (temperature / PI).sqrt()
    }

    /// t_c of Haff's law at T₀ = 1.
    pub fn cooling_time(&self) -> f64 {
        6.0 / ((1.0 - self.restitution.powi(2)) * self.collision_rate(1.0))
    }

    /// p/(n T) of hard grains.
    pub fn compressibility(&self) -> f64 {
        let phi = self.solid_fraction;
        1.0 + 2.0 * (1.0 + self.restitution) * phi * contact_value(phi)
    }

    /// The same gas as hard grains of the diameter that soft ones have at a temperature.
    pub fn hardened(&self, temperature: f64) -> Gas {
        let diameter = 1.0 - (PI * temperature / (2.0 * self.stiffness)).sqrt();
        Gas {
            solid_fraction: self.solid_fraction * diameter.powi(3),
            ..*self
        }
    }
}

/// g₀ of Carnahan & Starling.
pub fn contact_value(solid_fraction: f64) -> f64 {
    (1.0 - 0.5 * solid_fraction) / (1.0 - solid_fraction).powi(3)
}

fn mean_velocity(snapshot: &Snapshot) -> Vector3<f64> {
    let sum: Vector3<f64> = snapshot.grains.iter().map(|g| g.velocity).sum();
    sum / snapshot.grains.len() as f64
}

/// T of equal grains of mass 1; the mean velocity takes three degrees of freedom.
pub fn temperature(snapshot: &Snapshot) -> f64 {
    let mean = mean_velocity(snapshot);
    let sum: f64 = snapshot
        .grains
        .iter()
        .map(|g| (g.velocity - mean).norm_squared())
        .sum();
    sum / (3.0 * (snapshot.grains.len() - 1) as f64)
}

/// Pressure in a periodic box, compression positive: kinetic part and contacts' part.
///
/// `σ V = Σ m c c + Σ f (x_i - x_j)`, f the force on i; its trace over three.
pub fn pressure(snapshot: &Snapshot) -> [f64; 2] {
    let mean = mean_velocity(snapshot);
    let volume = snapshot.domain.lengths().product();
    let kinetic: f64 = snapshot
        .grains
        .iter()
        .map(|g| g.mass * (g.velocity - mean).norm_squared())
        .sum();
    let contacts: f64 = snapshot
        .contacts
        .iter()
        .filter(|c| matches!(c.partner, Partner::Grain(_)))
        .map(|c| c.force.dot(&(c.partner_arm - c.arm)))
        .sum();
    [kinetic, contacts].map(|sum| sum / (3.0 * volume))
}
