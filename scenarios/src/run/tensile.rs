//! Cylinders of cometary material pulled to their breaking point.
//!
//! A sample is cut out of a block of the material (`comet_block.rs`). Its head is held in a truncated cone;
//! grains of its lowest layer are pulled downwards by a force that rises in steps (`tensile/pull.rs`). The
//! strength is the largest mean force on the clamp between two looks over the cross-section (Kappel et al.
//! 2020, §3.3), and the largest pull that was carried stands beside it. Several samples, each with a seed of
//! its own, hang side by side; the result is their mean with its standard error. The pull is given in units of
//! Rumpf's estimate of the strength.

mod pull;
mod sample;

use super::comet;
use super::world::fragments;
use super::world::workshop::Surroundings;
use super::world::{Course, Expected, Ran, Recipe, RecipeKeys, Workshop, World};
use crate::failure::Failure;
use crate::run_directory::toml_table;
use crate::scene::world::{Materials, Place};
use crate::scene::{ClampKind, MixKind, TensileScene, layers};
use crate::summary::{Figure, Quantity, Summary};
use crate::table::Table;
use colluvium_dem::preparation::{Packing, Relaxation, Rest, solid_fraction};
use colluvium_dem::{Grain, Simulation, Snapshot};
use nalgebra::{UnitQuaternion, Vector3};
use pull::{BROKEN, LAG};
use std::f64::consts::PI;

/// Weight that seats a sample in a wall, over its strength by Rumpf.
const SEATING: f64 = 0.01;
/// Damping of the seating, over √(g/d).
const SEATING_DAMPING: f64 = 10.0;
/// Kinetic energy at which a sample counts as seated (m g d): drag bears a tenth of the weight then; in free fall it
/// bears all of it, at a hundred times this.
const SEATED: f64 = 5e-5;
/// Longest time of it, in √(d/g): so damped, a sample falls two diameters in it.
const SEATING_PATIENCE: f64 = 20.0;

/// Strengths of 1–2 mm grains (Pa): Kappel et al. (2020, §4.3) give them for 10–20 mm and 0.2–0.4 mm, scaled
/// by 1/R; means of the two.
const KAPPEL: [(MixKind, f64); 3] = [
    (MixKind::Dust, 2.25),
    (MixKind::TwoToOne, 3.95),
    (MixKind::OneToOne, 4.65),
];

impl TensileScene {
    /// Time between two steps of the pull (s).
    fn interval(&self) -> f64 {
        self.pull.step / self.pull.rate
    }

    /// Time of a pull to its limit that waits at every step (s).
    fn longest(&self) -> f64 {
        self.pull.patience * self.pull.limit / self.pull.rate
    }

    /// The paper's strength for these grains, where it has one (Pa).
    fn reference(&self) -> Option<f64> {
        let m = &self.material;
        let same = |a: f64, b: f64| (a / b - 1.0).abs() < 1e-9;
        let alike = same(m.largest_diameter, 2.0 * m.smallest_diameter)
            && m.size_index == 2.5
            && self.contact.work_of_adhesion == Some(0.028)
            && self.contact.asperity_radius.is_none();
        let known = KAPPEL.iter().find(|(mix, _)| *mix == m.mix);
        known
            .filter(|_| alike)
            .map(|(_, strength)| strength * 1e-3 / m.smallest_diameter)
    }
}

impl Recipe for TensileScene {
    fn about(&self) -> String {
        format!(
            "{} of {}, {} m x {} m, pulled to the breaking point (Kappel et al. 2020, §3.3)",
            match self.samples {
                1 => "a cylinder".to_owned(),
                n => format!("{n} cylinders"),
            },
            self.material.mix.words(),
            self.sample.diameter,
            self.sample.height
        )
    }

    fn materials(&self, origin: &str) -> Result<Materials, Failure> {
        Ok(TensileScene::materials(self, origin)?)
    }

    fn keys(&self) -> RecipeKeys<'_> {
        RecipeKeys {
            contact: &self.contact,
            seed: self.seed,
            coarse_graining: self.coarse_graining,
            step: &self.timestep,
            output: &self.output,
            packing: self.packing.as_deref(),
        }
    }

    fn provenance(&self) -> Result<Option<toml::Table>, Failure> {
        let mut keys = toml_table("the preparation", self)?;
        for later in [
            "packing",
            "pull",
            "sinter",
            "output",
            "material.sintered",
            "contact.restitution",
            "timestep.safety",
            "timestep.seconds",
        ] {
            layers::remove(&mut keys, later);
        }
        Ok(Some(keys))
    }

    fn prepare(&self, shop: &mut Workshop, origin: &str) -> Result<(), Failure> {
        let mut all = Packing {
            domain: super::world::workshop::open_space(),
            grains: Vec::new(),
            contacts: Vec::new(),
            clumps: Vec::new(),
        };
        for k in 0..self.samples {
            shop.seed = self.seed + k as u64;
            self.prepare_one(shop, origin)?;
            shop.place(UnitQuaternion::identity(), self.foot(k))?;
            let before = all.grains.len() as u32;
            let pairs = shop.packing.contacts.drain(..);
            all.contacts
                .extend(pairs.map(|pair| pair.map(|i| i + before)));
            all.grains.append(&mut shop.packing.grains);
        }
        shop.packing = all;
        Ok(())
    }

    fn world(
        &self,
        _packing: &Packing,
        materials: &Materials,
        origin: &str,
    ) -> Result<World, Failure> {
        let mut world = World::empty(self.longest());
        if self.clamp.kind == ClampKind::Wall {
            let named = |k: usize| (format!("clamp_{}", k + 1), self.wall(k));
            world.walls.extend((0..self.samples).map(named));
        }
        if self.material.sintered {
            let at = Place {
                origin,
                section: "sinter",
            };
            world.bonds.push(self.sinter.rule(materials, at)?);
        }
        // A piece that breaks off is pulled away by at most this in a few steps of the pull.
        let pull = self.rumpf(materials) / (self.material.bulk_density * self.sample.height);
        world.speed = pull * 2.0 * self.interval();
        Ok(world)
    }

    fn expected(&self, materials: &Materials) -> Expected {
        let head =
            0.5 * PI * self.clamp.height * (self.top_radius().powi(2) - self.radius().powi(2));
        let sample = self.area() * self.sample.height + head;
        Expected {
            grains: self.samples as f64 * self.comet().grains_in(sample, materials),
            preparation: Some(self.samples as f64 * self.block().grain_steps(materials)),
            duration: self.longest(),
        }
    }

    fn left_out(&self) -> Vec<&'static str> {
        vec!["gravity", "air", "breakage of grains"]
    }

    fn plan(&self) -> Vec<(String, String)> {
        let solid = self.material.solid_fraction();
        vec![
            (
                "sample".into(),
                format!(
                    "porosity {:.1} % from a bulk density of {} kg/m³; cut out of a block of the material",
                    100.0 * (1.0 - solid),
                    self.material.bulk_density
                ),
            ),
            (
                "clamp".into(),
                match self.clamp.kind {
                    ClampKind::Gripped => "grains near a truncated cone are held fast".into(),
                    ClampKind::Wall => "a truncated cone as a wall".to_owned(),
                },
            ),
            (
                "pull".into(),
                format!(
                    "on the lowest layer, by {} of Rumpf's strength every {:.3e} s, later where the clamp feels it by more than {LAG} too little \
                     (at most {} times that), until the clamp feels less than {BROKEN} of its largest force",
                    self.pull.step,
                    self.interval(),
                    self.pull.patience
                ),
            ),
        ]
    }

    fn steer_every(&self, timestep: f64) -> u64 {
        (self.interval() / timestep).round() as u64
    }

    fn steer(&self, simulation: &mut Simulation, state: &mut Vec<f64>) -> Result<Course, Failure> {
        let materials = TensileScene::materials(self, "pull")?;
        Ok(match self.pull_on(simulation, state, &materials)? {
            true => Course::On,
            false => Course::Over,
        })
    }

    fn columns(&self) -> Vec<(String, &'static str)> {
        let both = |k| [format!("applied_stress_{k}"), format!("clamp_stress_{k}")];
        let names = (1..=self.samples).flat_map(both);
        names.map(|name| (name, "Pa")).collect()
    }

    fn look(&self, _: &mut Simulation, _: &Snapshot, state: &[f64]) -> Vec<f64> {
        let pulls = pull::read(state);
        pulls.iter().flat_map(|p| [p.applied, p.stress]).collect()
    }

    fn groups(&self, simulation: &mut Simulation, _: &[f64]) -> Option<Vec<Option<usize>>> {
        self.material
            .sintered
            .then(|| fragments::by_bonds(simulation))
    }

    fn conclude(&self, ran: &mut Ran, summary: &mut Summary) -> Result<Vec<Table>, Failure> {
        let materials = TensileScene::materials(self, "")?;
        let pulls = pull::read(&ran.state);
        let of = |f: &dyn Fn(&pull::Pull) -> f64| -> Vec<f64> { pulls.iter().map(f).collect() };
        let strengths = of(&|p| p.strength);
        let (strength, error) = mean(&strengths);
        let quantity = Quantity::new(strength, "Pa").with_error(error);
        summary.put(
            "strength",
            match self.reference() {
                Some(reference) => quantity.against(
                    reference,
                    "largest mean stress on the clamp; Kappel et al. 2020, §4.3, scaled by 1/R",
                ),
                None => quantity.from("largest mean stress on the clamp"),
            },
        );
        let carried = of(&|p| p.carried);
        let (mean_carried, error) = mean(&carried);
        summary.put(
            "carried_stress",
            Quantity::new(mean_carried, "Pa")
                .with_error(error)
                .from("largest pull that came to stand against the clamp"),
        );
        summary.put(
            "strength_over_rumpf",
            Quantity::new(strength / self.rumpf(&materials), "1")
                .from("Rumpf 1962: 1.1 φ/(1-φ) F/d²"),
        );
        let samples = self.packings(&ran.packing);
        let (solid, error) = mean(&samples.iter().map(|s| s.solid_fraction).collect::<Vec<_>>());
        summary.put(
            "solid_fraction",
            Quantity::new(solid, "1").with_error(error).against(
                self.material.solid_fraction(),
                "in the samples' middle; bulk density over that of the grains",
            ),
        );
        let (touches, error) = mean(&samples.iter().map(|s| s.coordination).collect::<Vec<_>>());
        summary.put(
            "contacts_per_grain",
            Quantity::new(touches, "1")
                .with_error(error)
                .from("before the pull, grains of the surface included"),
        );
        let held = ran.packing.grains.iter().filter(|g| g.fixed).count();
        let share = held as f64 / ran.packing.grains.len() as f64;
        summary.put(
            "held_share",
            Quantity::new(share, "1").from("parcels in the clamp's grip"),
        );
        let whole = pulls.iter().filter(|p| !p.is_over()).count();
        if whole > 0 {
            summary.remarks.push(format!(
                "{whole} of {} samples did not break: the strength is a lower bound.",
                self.samples
            ));
        }
        let curves: Vec<[String; 2]> = (1..=self.samples)
            .map(|k| [format!("clamp_stress_{k}"), format!("sample {k}")])
            .collect();
        let curves: Vec<(&str, &str)> = curves.iter().map(|[a, b]| (&**a, &**b)).collect();
        summary.figures.push(Figure::history(
            "stress on the clamp [Pa]",
            &curves,
            "What of the pull on a sample's bottom reaches its clamp, over the cross-section.",
        ));
        let seeds = (0..self.samples).map(|k| (self.seed + k as u64) as f64);
        Ok(vec![
            Table::new("samples")
                .with("seed", "1", seeds.collect())
                .with("strength", "Pa", strengths)
                .with("carried", "Pa", carried)
                .with("applied_at_strength", "Pa", of(&|p| p.applied_then))
                .with("broken", "1", of(&|p| f64::from(u8::from(p.is_over()))))
                .with(
                    "parcels",
                    "1",
                    samples.iter().map(|s| s.grains as f64).collect(),
                )
                .with(
                    "solid_fraction",
                    "1",
                    samples.iter().map(|s| s.solid_fraction).collect(),
                )
                .with(
                    "contacts_per_grain",
                    "1",
                    samples.iter().map(|s| s.coordination).collect(),
                ),
        ])
    }

    fn compared(&self) -> Vec<&'static str> {
        vec!["strength"]
    }
}

/// A sample before it is pulled.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Prepared {
    grains: usize,
    solid_fraction: f64,
    coordination: f64,
}

/// Mean and its standard error.
fn mean(values: &[f64]) -> (f64, f64) {
    let n = values.len() as f64;
    let mean = values.iter().sum::<f64>() / n;
    let spread = values.iter().map(|v| (v - mean).powi(2)).sum::<f64>();
    (mean, (spread / (n - 1.0) / n).sqrt())
}

impl TensileScene {
    /// One sample with its foot at the origin.
    fn prepare_one(&self, shop: &mut Workshop, origin: &str) -> Result<(), Failure> {
        self.block().make(shop, origin)?;
        let up = Vector3::new(0.0, 0.0, 0.5 * self.sample.height);
        shop.place(UnitQuaternion::identity(), up)?;
        let relaxation = comet::relaxation(shop.materials);
        match self.clamp.kind {
            ClampKind::Gripped => shop.trim(&self.shape(), false)?,
            // A wall must not cut through grains.
            ClampKind::Wall => shop
                .keep_where(&format!("{}, clear of the cone", self.shape()), |g| {
                    self.is_clear_of_wall(g)
                })?,
        }
        let mut around = self.comet().last(origin)?;
        match self.clamp.kind {
            ClampKind::Gripped => {
                shop.glue(&self.gripped(shop.materials))?;
                shop.relax(&around, &relaxation)?;
            }
            ClampKind::Wall => {
                around.walls = vec![self.wall(0)];
                // Grains that were cut off would fall for ever.
                shop.keep_heaviest();
                shop.relax(&around, &relaxation)?;
                self.seat(shop, &mut around)?;
            }
        }
        let acceleration = relaxation.acceleration;
        shop.measure(&around, &self.middle(), acceleration)
            .map(drop)
    }

    /// Seats a sample in its cone under a small weight; what comes loose of it meanwhile is taken away.
    fn seat(&self, shop: &mut Workshop, around: &mut Surroundings) -> Result<(), Failure> {
        let weight = SEATING * self.rumpf(shop.materials);
        let g = weight / (self.material.bulk_density * self.sample.height);
        around.gravity = Vector3::new(0.0, 0.0, -g);
        let seating = Relaxation {
            damping: SEATING_DAMPING,
            rest: Rest {
                kinetic: SEATED,
                unbalanced: 1e9,
            },
            patience: SEATING_PATIENCE,
            ..Relaxation::under(g)
        };
        while !shop.relax_as_far(around, &seating)? {
            // What has come loose falls on.
            if shop.keep_heaviest() == 0 {
                return Err(Failure::Run(format!(
                    "the sample does not come to rest in a cone that is a wall (key `clamp.kind`) under a weight of {weight:.2e} \
                     Pa, {SEATING} of its strength by Rumpf: it slides through; a head that is higher (key `clamp.height` = {}) \
                     or parcels that are smaller (key `coarse_graining` = {}) may hold; \"gripped\" does",
                    self.clamp.height, self.coarse_graining
                )));
            }
        }
        Ok(())
    }

    /// The samples of a packing.
    fn packings(&self, packing: &Packing) -> Vec<Prepared> {
        let of = |k: usize| {
            let own = |grain: &&Grain| self.sample_at(&grain.position) == k;
            let foot = self.foot(k);
            let grains: Vec<Grain> = packing.grains.iter().filter(own).copied().collect();
            let at_origin: Vec<Grain> = grains
                .iter()
                .map(|g| Grain {
                    position: g.position - foot,
                    ..*g
                })
                .collect();
            let inside =
                |pair: &&[u32; 2]| self.sample_at(&packing.grains[pair[0] as usize].position) == k;
            let contacts = packing.contacts.iter().filter(inside).count();
            Prepared {
                grains: grains.len(),
                solid_fraction: solid_fraction(&at_origin, &packing.domain, &self.middle()),
                coordination: 2.0 * contacts as f64 / grains.len().max(1) as f64,
            }
        };
        (0..self.samples).map(of).collect()
    }
}
