//! Ballistic aggregates: clusters that fly into each other and stick where they first touch.
//!
//! *Cluster–cluster* (BCCA): two clusters of equal size, both grown in this way, meet at a random
//! orientation and a random impact parameter; fractal dimension 1.9. *Particle–cluster* (BPCA): single
//! grains meet one growing cluster; dimension 3. There are no further motions: a grain touches exactly
//! the one it came to. BCCA are what Tatsuuma et al. (2019) compress and pull apart.
//!
//! ```text
//! |x_j + t u - x_i| = (r_i + r_j)(1 - δ)        the largest root t over all pairs: first touch along -u
//! ```

use super::packing::Packing;
use super::sizes::SizeLaw;
use crate::domain::Domain;
use crate::grains::Grain;
use crate::setup::{SetupError, check};
use nalgebra::{Quaternion, UnitQuaternion, Vector3};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use serde::{Deserialize, Serialize};
use std::fmt;

/// How clusters grow.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Growth {
    /// Equal clusters meet (BCCA): a power of two of grains.
    ClusterCluster,
    /// Single grains meet one cluster (BPCA).
    ParticleCluster,
}

/// An aggregate to be grown.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Aggregate {
    /// How it grows.
    pub growth: Growth,
    /// Grains.
    pub grains: usize,
    /// Their sizes.
    pub sizes: SizeLaw,
    /// Their density (kg/m³).
    pub density: f64,
    /// Their material.
    pub material: u16,
    /// δ: overlap of a contact over the sum of its radii; 0 touches exactly, an adhesive law has its own.
    pub overlap: f64,
    /// Seed of all random numbers.
    pub seed: u64,
}

/// An aggregate's measures.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct AggregateReport {
    /// Grains.
    pub grains: usize,
    /// Radius of gyration (m).
    pub gyration: f64,
    /// Radius of the ball of the same gyration, √(5/3) times that (m).
    pub characteristic_radius: f64,
    /// Grains' volume over that ball's.
    pub solid_fraction: f64,
    /// Contacts a grain has: 2(N - 1)/N.
    pub coordination: f64,
    /// Encounters that missed.
    pub misses: u64,
}

impl fmt::Display for AggregateReport {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        write!(
            f,
            "{} grains, radius of gyration {:.4e} m, solid fraction {:.4} in the ball of the same gyration \
             (radius {:.4e} m), {:.3} contacts a grain, {} encounters missed",
            self.grains,
            self.gyration,
            self.solid_fraction,
            self.characteristic_radius,
            self.coordination,
            self.misses
        )
    }
}

/// A cluster about its centre of mass.
#[derive(Clone, Debug, Default)]
struct Cluster {
    /// Centres (m).
    places: Vec<Vector3<f64>>,
    /// Radii (m).
    radii: Vec<f64>,
    contacts: Vec<[u32; 2]>,
}

/// Grows an aggregate about the origin.
pub fn grow(spec: &Aggregate) -> Result<(Packing, AggregateReport), SetupError> {
    spec.validate()?;
    let mut random = ChaCha8Rng::seed_from_u64(spec.seed);
    let mut misses = 0;
    let mut meet = |a: &Cluster, b: &Cluster, random: &mut ChaCha8Rng| loop {
        if let Some(joined) = a.met_by(b, spec.overlap, random) {
            return joined;
        }
        misses += 1;
    };
    let single = |random: &mut ChaCha8Rng| Cluster {
        places: vec![Vector3::zeros()],
        radii: vec![spec.sizes.draw(random)],
        contacts: Vec::new(),
    };
    let cluster = match spec.growth {
        Growth::ClusterCluster => {
            // One half grown of each size waits for its partner, so that few are kept at a time.
            let mut waiting: Vec<Cluster> = Vec::new();
            for _ in 0..spec.grains {
                let mut grown = single(&mut random);
                while waiting
                    .last()
                    .is_some_and(|w| w.radii.len() == grown.radii.len())
                {
                    if let Some(other) = waiting.pop() {
                        grown = meet(&other, &grown, &mut random);
                    }
                }
                waiting.push(grown);
            }
            waiting.pop().unwrap_or_default()
        }
        Growth::ParticleCluster => {
            let mut grown = single(&mut random);
            for _ in 1..spec.grains {
                let next = single(&mut random);
                grown = meet(&grown, &next, &mut random);
            }
            grown
        }
    };
    let report = cluster.report(misses);
    Ok((cluster.packing(spec), report))
}

impl Aggregate {
    fn validate(&self) -> Result<(), SetupError> {
        self.sizes.validate()?;
        let (count, allowed) = match self.growth {
            Growth::ClusterCluster => (self.grains.is_power_of_two(), "a power of two"),
            Growth::ParticleCluster => (true, "> 0"),
        };
        check("aggregate.grains", self.grains as f64, allowed, |n| {
            count && n > 0.0
        })?;
        check(
            "aggregate.grains",
            self.grains as f64,
            "at most 2²⁰",
            |n| n <= 1_048_576.0,
        )?;
        check("aggregate.density", self.density, "> 0 kg/m³", |v| v > 0.0)?;
        check("aggregate.overlap", self.overlap, "in [0, 0.2]", |v| {
            (0.0..=0.2).contains(&v)
        })
    }
}

impl Cluster {
    /// Farthest surface from the centre (m).
    fn extent(&self) -> f64 {
        let surfaces = self.places.iter().zip(&self.radii);
        surfaces.map(|(x, r)| x.norm() + r).fold(0.0, f64::max)
    }

    /// Sends `other` in on a random straight line; none if it misses.
    fn met_by(&self, other: &Cluster, overlap: f64, random: &mut ChaCha8Rng) -> Option<Cluster> {
        let turn = random_turn(random);
        let frame = random_turn(random);
        let (along, across) = (
            frame * Vector3::z(),
            [frame * Vector3::x(), frame * Vector3::y()],
        );
        let reach = self.extent() + other.extent();
        let offset = reach * random.random::<f64>().sqrt();
        let (sin, cos) = (std::f64::consts::TAU * random.random::<f64>()).sin_cos();
        let aim = offset * (across[0] * cos + across[1] * sin);
        let turned: Vec<Vector3<f64>> = other.places.iter().map(|x| turn * x + aim).collect();
        let (t, i, j) = self.first_touch(&turned, &other.radii, along, overlap)?;
        let mut joined = self.clone();
        let first = self.radii.len() as u32;
        joined.places.extend(turned.iter().map(|x| x + along * t));
        joined.radii.extend(&other.radii);
        let moved = other.contacts.iter().map(|[a, b]| [a + first, b + first]);
        joined.contacts.extend(moved);
        joined.contacts.push([i as u32, first + j as u32]);
        joined.touch_exactly(i, first as usize + j, overlap, first as usize);
        joined.center();
        Some(joined)
    }

    /// How far along a direction others are when they first touch on their way back, and which pair does.
    fn first_touch(
        &self,
        others: &[Vector3<f64>],
        radii: &[f64],
        along: Vector3<f64>,
        overlap: f64,
    ) -> Option<(f64, usize, usize)> {
        // Lengths along and across the way, once for each grain.
        let split = |x: &Vector3<f64>| {
            let depth = x.dot(&along);
            (depth, x - along * depth)
        };
        let others: Vec<_> = others.iter().map(split).collect();
        let mut first: Option<(f64, usize, usize)> = None;
        for (i, (x, r)) in self.places.iter().zip(&self.radii).enumerate() {
            let (depth, aside) = split(x);
            for (j, ((other_depth, other_aside), other_radius)) in
                others.iter().zip(radii).enumerate()
            {
                let reach = (r + other_radius) * (1.0 - overlap);
                let square = reach * reach - (other_aside - aside).norm_squared();
                if square < 0.0 {
                    continue;
                }
                let t = depth - other_depth + square.sqrt();
                if first.is_none_or(|f| t > f.0) {
                    first = Some((t, i, j));
                }
            }
        }
        first
    }

    /// Takes round-off out of the new contact: the newcomers move along its line of centres.
    fn touch_exactly(&mut self, i: usize, j: usize, overlap: f64, newcomers: usize) {
        let reach = (self.radii[i] + self.radii[j]) * (1.0 - overlap);
        let apart = self.places[j] - self.places[i];
        let shift = apart * (reach / apart.norm() - 1.0);
        self.places[newcomers..]
            .iter_mut()
            .for_each(|x| *x += shift);
    }

    /// Volumes stand for masses: one density.
    fn weights(&self) -> impl Iterator<Item = f64> {
        self.radii.iter().map(|r| r.powi(3))
    }

    /// Moves the centre of mass to the origin.
    fn center(&mut self) {
        let moment: Vector3<f64> = self
            .places
            .iter()
            .zip(self.weights())
            .map(|(x, w)| x * w)
            .sum();
        let center = moment / self.weights().sum::<f64>();
        self.places.iter_mut().for_each(|x| *x -= center);
    }

    fn report(&self, misses: u64) -> AggregateReport {
        let n = self.radii.len();
        let volume: f64 = self
            .radii
            .iter()
            .map(|&r| super::size_report::ball_volume(r))
            .sum();
        // Each ball adds its own 3/5 r².
        let terms = self.places.iter().zip(self.weights()).zip(&self.radii);
        let sum: f64 = terms
            .map(|((x, w), r)| w * (x.norm_squared() + 0.6 * r * r))
            .sum();
        let gyration = (sum / self.weights().sum::<f64>()).sqrt();
        let characteristic_radius = (5.0_f64 / 3.0).sqrt() * gyration;
        AggregateReport {
            grains: n,
            gyration,
            characteristic_radius,
            solid_fraction: volume / super::size_report::ball_volume(characteristic_radius),
            coordination: 2.0 * self.contacts.len() as f64 / n as f64,
            misses,
        }
    }

    fn packing(self, spec: &Aggregate) -> Packing {
        let half = Vector3::repeat(self.extent());
        let grain = |(x, r): (&Vector3<f64>, &f64)| Grain {
            material: spec.material,
            ..Grain::at_rest(*x, *r, spec.density)
        };
        Packing {
            domain: Domain {
                lower: -half,
                upper: half,
                periodic: [false; 3],
            },
            grains: self.places.iter().zip(&self.radii).map(grain).collect(),
            contacts: self.contacts,
            clumps: Vec::new(),
        }
    }
}

/// A turn drawn evenly from all: four normal numbers make a quaternion.
fn random_turn(random: &mut ChaCha8Rng) -> UnitQuaternion<f64> {
    let mut normal = || -> f64 { StandardNormal.sample(random) };
    UnitQuaternion::new_normalize(Quaternion::new(normal(), normal(), normal(), normal()))
}

#[cfg(test)]
mod tests {
    use super::super::RadiusLaw;
    use super::*;

    fn spec(growth: Growth, grains: usize, seed: u64) -> Aggregate {
        Aggregate {
            growth,
            grains,
            sizes: RadiusLaw::Uniform {
                low: 1e-7,
                high: 1e-7,
            }
            .into(),
            density: 1000.0,
            material: 0,
            overlap: 0.0,
            seed,
        }
    }

    /// Slope of ln N over ln R_g of mean radii between two sizes, with its error from the scatter.
    fn dimension(growth: Growth, sizes: [usize; 2], aggregates: u64) -> (f64, f64) {
        let logs = sizes.map(|n| {
            let logs: Vec<f64> = (0..aggregates)
                .map(|seed| grow(&spec(growth, n, seed)).unwrap().1.gyration.ln())
                .collect();
            let count = logs.len() as f64;
            let mean = logs.iter().sum::<f64>() / count;
            let variance = logs.iter().map(|l| (l - mean).powi(2)).sum::<f64>() / (count - 1.0);
            (mean, variance / count)
        });
        let (grown, rise) = (
            (sizes[1] as f64 / sizes[0] as f64).ln(),
            logs[1].0 - logs[0].0,
        );
        let error = (logs[0].1 + logs[1].1).sqrt();
        (grown / rise, grown / rise * error / rise)
    }

    #[test]
    fn clusters_that_meet_clusters_have_a_dimension_of_1_9() {
        let (d, error) = dimension(Growth::ClusterCluster, [32, 1024], 40);
        println!("BCCA: {d:.3} ± {error:.3}");
        assert!(error < 0.06, "{d} ± {error}");
        // 1.91 ± 0.03 (Okuzumi et al. 2009), 1.95 (Meakin 1991).
        assert!((d - 1.92).abs() < 3.0 * error + 0.03, "{d} ± {error}");
        // Grains that meet one cluster fill space.
        let (d, error) = dimension(Growth::ParticleCluster, [128, 4096], 16);
        println!("BPCA: {d:.3} ± {error:.3}");
        assert!((d - 3.0).abs() < 0.15 && error < 0.06, "{d} ± {error}");
    }

    #[test]
    fn grains_touch_exactly_in_a_tree_without_loops() {
        let mut spec = spec(Growth::ClusterCluster, 256, 3);
        for (overlap, low) in [(0.0, 1e-7), (0.01, 0.5e-7)] {
            spec.overlap = overlap;
            spec.sizes = RadiusLaw::Uniform { low, high: 1e-7 }.into();
            let (packing, report) = grow(&spec).unwrap();
            assert_eq!(packing.contacts.len(), 255);
            assert!((report.coordination - 2.0 * 255.0 / 256.0).abs() < 1e-12);
            let gap = |a: usize, b: usize| {
                let (a, b) = (&packing.grains[a], &packing.grains[b]);
                (a.position - b.position).norm() / (a.radius + b.radius) - (1.0 - overlap)
            };
            for [a, b] in &packing.contacts {
                assert!(gap(*a as usize, *b as usize).abs() < 1e-13);
            }
            for a in 0..256 {
                for b in 0..a {
                    assert!(gap(a, b) > -1e-13);
                }
            }
            assert!(packing.center().norm() < 1e-18);
            assert_eq!(grow(&spec).unwrap().0, packing, "the seed decides");
        }
        let mut odd = spec;
        odd.grains = 100;
        let message = grow(&odd).unwrap_err().to_string();
        assert!(
            message.contains("aggregate.grains = 100: must be a power of two"),
            "{message}"
        );
    }
}
