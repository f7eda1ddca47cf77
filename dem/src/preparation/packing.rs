//! Grains taken out of a simulation, to be kept, cut, moved, scaled and used again.

use super::coordination::{Coordination, HELD_BY_FRICTION, HELD_FRICTIONLESS};
use super::rest::RestMeasures;
use super::solid_fraction::solid_fraction;
use crate::bodies::MassProperties;
use crate::clumps::Clump;
use crate::contact::Tangential;
use crate::domain::Domain;
use crate::grains::Grain;
use crate::region::Region;
use crate::setup::{SetupError, check};
use crate::simulation::Simulation;
use crate::snapshot::{Partner, Snapshot};
use crate::walls::Pose;
use nalgebra::{UnitQuaternion, Vector3};
use serde::{Deserialize, Serialize};
use std::fmt;

/// Grains with the pairs of them that touch and those that move as one.
#[derive(Clone, Debug, PartialEq)]
pub struct Packing {
    /// The box.
    pub domain: Domain,
    /// The grains.
    pub grains: Vec<Grain>,
    /// Pairs of grains that touch, each once.
    pub contacts: Vec<[u32; 2]>,
    /// Grains that move as one, by their places in `grains`; their densities are such that a grain's mass is the
    /// least that a push on the clump feels (see [`super::ClumpShape::grains`]).
    pub clumps: Vec<Clump>,
}

/// How a packing came out.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct PackingReport {
    /// Free grains.
    pub grains: usize,
    /// Fixed grains.
    pub fixed: usize,
    /// Clumps that free grains make.
    #[serde(default)]
    pub clumps: usize,
    /// Solid fraction.
    pub solid_fraction: f64,
    /// Where it was measured.
    pub measured_in: String,
    /// Contacts of the free grains.
    pub coordination: Coordination,
    /// Largest overlap of the present contacts, over the harmonic mean radius.
    pub largest_overlap: f64,
    /// How close to rest it is.
    pub rest: RestMeasures,
}

impl fmt::Display for PackingReport {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        write!(f, "{} free grains, {} fixed", self.grains, self.fixed)?;
        if self.clumps > 0 {
            write!(f, ", {} clumps", self.clumps)?;
        }
        writeln!(f)?;
        writeln!(
            f,
            "solid fraction {:.4} in {}",
            self.solid_fraction, self.measured_in
        )?;
        writeln!(f, "{}", self.coordination)?;
        write!(f, "overlap ≤ {:.2e} R; {}", self.largest_overlap, self.rest)
    }
}

impl PackingReport {
    /// Measures a simulation: φ in a region, rest against an acceleration (m/s²).
    ///
    /// Rattlers are grains with fewer than 4 contacts where no law has friction, else fewer than 2.
    pub fn of(
        simulation: &mut Simulation,
        region: &Region,
        acceleration: f64,
    ) -> Result<PackingReport, SetupError> {
        region.validate("region")?;
        let mut snapshot = Snapshot::default();
        simulation.snapshot(&mut snapshot);
        let grains = simulation.grain_list();
        let fixed = grains.iter().filter(|g| g.fixed).count();
        let smooth = simulation
            .law()
            .laws()
            .iter()
            .all(|law| !rubs(&law.tangential));
        let least = if smooth {
            HELD_FRICTIONLESS
        } else {
            HELD_BY_FRICTION
        };
        let overlap = |c: &crate::ContactSample| {
            let own = 1.0 / snapshot.grains[c.grain].radius;
            match c.partner {
                Partner::Grain(j) => 0.5 * c.overlap * (own + 1.0 / snapshot.grains[j].radius),
                _ => c.overlap * own,
            }
        };
        Ok(PackingReport {
            grains: grains.len() - fixed,
            fixed,
            clumps: simulation.clump_count(),
            solid_fraction: solid_fraction(&grains, simulation.domain(), region),
            measured_in: region.to_string(),
            coordination: Coordination::of(&snapshot, least),
            largest_overlap: snapshot.contacts.iter().map(overlap).fold(0.0, f64::max),
            rest: simulation.rest_measures(acceleration),
        })
    }
}

/// Whether a tangential part has friction.
fn rubs(tangential: &Tangential) -> bool {
    match tangential {
        Tangential::None => false,
        Tangential::Linear(spring) => spring.friction > 0.0,
        Tangential::Mindlin(mindlin) => mindlin.friction > 0.0,
        Tangential::Jkr => true,
    }
}

impl Simulation {
    /// All grains as they are now, in the order of their numbers, inside the box along periodic axes.
    pub fn grain_list(&mut self) -> Vec<Grain> {
        let samples = self.samples();
        let mut order: Vec<usize> = (0..samples.len()).collect();
        order.sort_by_key(|&i| samples[i].id);
        order
            .into_iter()
            .map(|i| {
                let s = &samples[i];
                let mut grain = Grain::at_rest(s.position, s.radius, 1.0);
                grain.density = s.mass / grain.volume();
                grain.velocity = s.velocity;
                grain.spin = s.spin;
                grain.fixed = s.fixed;
                grain.material = self.grains.material[i];
                grain
            })
            .collect()
    }
}

impl Packing {
    /// The grains of a simulation and their contacts.
    pub fn of(simulation: &mut Simulation) -> Packing {
        let mut grains = simulation.grain_list();
        let mut snapshot = Snapshot::default();
        simulation.snapshot(&mut snapshot);
        let mut ids: Vec<u32> = snapshot.grains.iter().map(|g| g.id).collect();
        ids.sort_unstable();
        let of_number = |number: u32| ids.partition_point(|&id| id < number) as u32;
        let place = |i: usize| of_number(snapshot.grains[i].id);
        let pair = |c: &crate::ContactSample| match c.partner {
            Partner::Grain(j) => {
                let (a, b) = (place(c.grain), place(j));
                Some([a.min(b), a.max(b)])
            }
            _ => None,
        };
        let mut contacts: Vec<[u32; 2]> = snapshot.contacts.iter().filter_map(pair).collect();
        contacts.sort_unstable();
        let mut clumps = Vec::new();
        for (mut clump, lightest) in simulation.clump_list() {
            for grain in &mut clump.grains {
                *grain = of_number(*grain);
                let own = &mut grains[*grain as usize];
                own.density = lightest / own.volume();
            }
            clumps.push(clump);
        }
        Packing {
            domain: *simulation.domain(),
            grains,
            contacts,
            clumps,
        }
    }

    /// Keeps grains whose centres lie in a region; a clump goes as a whole.
    pub fn trim(&mut self, region: &Region) -> Result<usize, SetupError> {
        self.keep(region, |_| 0.0)
    }

    /// Keeps grains that lie in a region as a whole; a clump goes as a whole.
    pub fn trim_whole(&mut self, region: &Region) -> Result<usize, SetupError> {
        self.keep(region, |g| g.radius)
    }

    /// Takes out grains that lie less deep in a region than asked; says how many.
    fn keep(
        &mut self,
        region: &Region,
        depth: impl Fn(&Grain) -> f64,
    ) -> Result<usize, SetupError> {
        region.validate("trim.region")?;
        let inside = |g: &Grain| region.depth(&g.position) >= depth(g);
        let stays = self.grains.iter().map(inside).collect();
        Ok(self.keep_those(stays))
    }

    /// Takes out grains, by their places, that are not to stay; a clump goes as a whole. Says how many went.
    pub fn keep_those(&mut self, mut stays: Vec<bool>) -> usize {
        let before = self.grains.len();
        stays.resize(before, false);
        self.clumps.retain(|clump| {
            let all = clump.grains.iter().all(|&g| stays[g as usize]);
            clump.grains.iter().for_each(|&g| stays[g as usize] = all);
            all
        });
        let mut left = 0;
        let number = |stays: bool| {
            left += u32::from(stays);
            stays.then(|| left - 1)
        };
        let places: Vec<Option<u32>> = stays.into_iter().map(number).collect();
        let mut stays = places.iter().map(Option::is_some);
        self.grains.retain(|_| stays.next().unwrap_or(false));
        let moved = |&[a, b]: &[u32; 2]| Some([places[a as usize]?, places[b as usize]?]);
        self.contacts = self.contacts.iter().filter_map(moved).collect();
        for grain in self.clumps.iter_mut().flat_map(|clump| &mut clump.grains) {
            *grain = places[*grain as usize].unwrap_or(*grain);
        }
        before - self.grains.len()
    }

    /// Fixes grains whose centres lie in a region, a clump as a whole: a glued base. Says how many.
    pub fn glue(&mut self, region: &Region) -> Result<usize, SetupError> {
        region.validate("glue.region")?;
        let inside = |g: &Grain| region.contains(&g.position);
        let mut glued: Vec<bool> = self.grains.iter().map(inside).collect();
        self.clumps.retain(|clump| {
            let any = clump.grains.iter().any(|&g| glued[g as usize]);
            clump.grains.iter().for_each(|&g| glued[g as usize] = any);
            !any
        });
        let mut count = 0;
        for (grain, glued) in self.grains.iter_mut().zip(glued) {
            if !grain.fixed && glued {
                grain.fixed = true;
                (grain.velocity, grain.spin) = (Vector3::zeros(), Vector3::zeros());
                count += 1;
            }
        }
        Ok(count)
    }

    /// Multiplies all lengths by a factor; densities stay, velocities go to zero.
    pub fn scale(&mut self, factor: f64) -> Result<(), SetupError> {
        check("packing.scale", factor, "> 0", |f| f > 0.0)?;
        self.domain.lower *= factor;
        self.domain.upper *= factor;
        for grain in &mut self.grains {
            *grain = Grain {
                position: grain.position * factor,
                radius: grain.radius * factor,
                velocity: Vector3::zeros(),
                spin: Vector3::zeros(),
                ..*grain
            };
        }
        for mass in self.clump_masses() {
            *mass = MassProperties {
                mass: mass.mass * factor.powi(3),
                centre: mass.centre * factor,
                inertia: mass.inertia * factor.powi(5),
            };
        }
        Ok(())
    }

    fn clump_masses(&mut self) -> impl Iterator<Item = &mut MassProperties> {
        self.clumps
            .iter_mut()
            .filter_map(|clump| clump.mass.as_mut())
    }

    /// Turns grains about a point (m), then moves them (m); for packings without periodic axes.
    pub fn place(
        &mut self,
        about: Vector3<f64>,
        turn: UnitQuaternion<f64>,
        by: Vector3<f64>,
    ) -> Result<(), SetupError> {
        let wraps = self.domain.periodic.iter().filter(|&&p| p).count() as f64;
        check(
            "packing: periodic axes",
            wraps,
            "none where it is turned or moved",
            |n| n == 0.0,
        )?;
        for grain in &mut self.grains {
            grain.position = about + turn * (grain.position - about) + by;
            grain.velocity = turn * grain.velocity;
            grain.spin = turn * grain.spin;
        }
        let pose = Pose {
            position: about - turn * about + by,
            orientation: turn,
        };
        for mass in self.clump_masses() {
            *mass = mass.put(&pose);
        }
        let open = |low: f64, x: f64| low.min(x);
        for grain in &self.grains {
            let (low, high) = (&mut self.domain.lower, &mut self.domain.upper);
            for k in 0..3 {
                low[k] = open(low[k], grain.position[k] - grain.radius);
                high[k] = -open(-high[k], -grain.position[k] - grain.radius);
            }
        }
        Ok(())
    }

    /// Masses (kg) with their centres (m): of grains alone and of clumps.
    fn weights(&self) -> impl Iterator<Item = (f64, Vector3<f64>)> {
        let mut alone = vec![true; self.grains.len()];
        let given = self.clumps.iter().filter(|clump| clump.mass.is_some());
        let carried = given.flat_map(|clump| &clump.grains);
        carried.for_each(|&grain| alone[grain as usize] = false);
        let grains = self.grains.iter().zip(alone);
        let grains = grains
            .filter(|(_, alone)| *alone)
            .map(|(g, _)| (g.mass(), g.position));
        let clumps = self.clumps.iter().filter_map(|clump| clump.mass);
        grains.chain(clumps.map(|m| (m.mass, m.centre)))
    }

    /// Mass of everything (kg).
    pub fn mass(&self) -> f64 {
        self.weights().map(|(mass, _)| mass).sum()
    }

    /// Centre of mass (m).
    pub fn center(&self) -> Vector3<f64> {
        let moment: Vector3<f64> = self.weights().map(|(mass, at)| mass * at).sum();
        moment / self.mass()
    }
}
