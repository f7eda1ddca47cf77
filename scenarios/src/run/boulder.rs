//! A boulder of cometary material dropped on a plane.
//!
//! The boulder is cut out of a block of the material (`comet_block.rs`), bonded where it is sintered, put on the
//! ground and given its impact velocity at once (Kappel et al. 2020, §3.1). A fragment is what hangs together
//! by contacts that were there before the impact and have not opened. The run is over when everything rests,
//! or when nothing has come apart for as long as the boulder took to move by its own diameter.

use super::comet::{self, Comet};
use super::comet_block::CometBlock;
use super::world::fragments::{self, Fragment};
use super::world::{Course, Expected, Ran, Recipe, RecipeKeys, Workshop, World};
use crate::failure::Failure;
use crate::run_directory::toml_table;
use crate::scene::world::{Materials, Place};
use crate::scene::{BoulderScene, layers};
use crate::summary::{Figure, Quantity, Summary};
use crate::table::Table;
use colluvium_dem::preparation::Packing;
use colluvium_dem::{Region, Simulation, Snapshot, Wall};
use nalgebra::{UnitQuaternion, Vector3};
use std::collections::BTreeSet;
use std::f64::consts::PI;

/// Kinetic energy over that of the impact at which everything has come to rest.
const REST: f64 = 1e-5;
/// Gap between boulder and ground at the start, over the radius.
const GAP: f64 = 1e-4;
/// Looks at whether everything rests, in the whole duration.
const LOOKS: f64 = 400.0;

/// Shares of the mass in the largest fragment above which a boulder survives, and below which it has
/// disintegrated.
const SURVIVES: f64 = 0.8;
const DISINTEGRATES: f64 = 0.2;

/// What became of a boulder.
fn outcome(share: f64) -> (f64, &'static str) {
    if share >= SURVIVES {
        (2.0, "survives")
    } else if share > DISINTEGRATES {
        (1.0, "breaks")
    } else {
        (0.0, "disintegrates")
    }
}

impl BoulderScene {
    fn radius(&self) -> f64 {
        0.5 * self.diameter
    }

    fn comet(&self) -> Comet<'_> {
        Comet {
            material: &self.material,
            soft: self.preparation.softness(),
            contact: &self.contact,
            coarse_graining: self.coarse_graining,
        }
    }

    fn block(&self) -> CometBlock<'_> {
        CometBlock {
            comet: self.comet(),
            preparation: &self.preparation,
            needed: Vector3::repeat(self.diameter),
        }
    }

    /// Time without a contact that opens after which nothing more comes apart (s): that in which the boulder
    /// moved by its own diameter. Pieces that have been thrown up fly for minutes under so little gravity; they
    /// come down more slowly than they went up.
    fn quiet(&self) -> f64 {
        self.diameter / self.impact.speed
    }

    fn velocity(&self) -> Vector3<f64> {
        let angle = self.impact.degrees.to_radians();
        self.impact.speed * Vector3::new(angle.sin(), 0.0, -angle.cos())
    }
}

/// Numbers of the memory before the pairs: the energy of the impact (J), the fewest contacts that have held
/// so far, and when the last of them opened (s).
const HEAD: usize = 3;

/// The recipe's memory: its head, then the pairs that touched before the impact.
fn remember(simulation: &mut Simulation) -> Vec<f64> {
    let energy = simulation.energy().kinetic();
    let pairs = fragments::touching(simulation);
    let head = [energy, pairs.len() as f64, simulation.time()];
    let flat = pairs.into_iter().flatten().map(f64::from);
    head.into_iter().chain(flat).collect()
}

/// Pairs that touched before the impact, by the recipe's memory.
fn pairs(state: &[f64]) -> impl ExactSizeIterator<Item = [u32; 2]> {
    let pairs = state.get(HEAD..).unwrap_or_default().as_chunks::<2>().0;
    pairs.iter().map(|pair| pair.map(|id| id as u32))
}

/// Those of them that touch now.
fn held(simulation: &mut Simulation, state: &[f64]) -> Vec<[u32; 2]> {
    let now: BTreeSet<[u32; 2]> = fragments::touching(simulation).into_iter().collect();
    pairs(state).filter(|pair| now.contains(pair)).collect()
}

/// Fragments now, and the share of the contacts of the start that have held.
fn fragments_now(simulation: &mut Simulation, state: &[f64]) -> (Vec<Fragment>, f64) {
    let before = pairs(state).len();
    let held = held(simulation, state);
    let masses: Vec<f64> = simulation.grain_list().iter().map(|g| g.mass()).collect();
    let share = held.len() as f64 / before.max(1) as f64;
    (fragments::joined(&masses, &held), share)
}

impl Recipe for BoulderScene {
    fn about(&self) -> String {
        format!(
            "a boulder of {}, {} m across, hits the ground at {} m/s, {} degrees from the normal (Kappel et al. 2020, §3.1)",
            self.material.mix.words(),
            self.diameter,
            self.impact.speed,
            self.impact.degrees
        )
    }

    fn materials(&self, origin: &str) -> Result<Materials, Failure> {
        Ok(BoulderScene::materials(self, origin)?)
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
            "impact",
            "ground",
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
        self.block().make(shop, origin)?;
        let ball = |radius: f64| Region::Ball {
            center: Vector3::zeros(),
            radius,
        };
        shop.trim(&ball(self.radius()), true)?;
        let around = self.comet().last(origin)?;
        let relaxation = comet::relaxation(shop.materials);
        shop.relax(&around, &relaxation)?;
        shop.measure(&around, &ball(0.8 * self.radius()), relaxation.acceleration)?;
        let bottoms = shop.packing.grains.iter().map(|g| g.position.z - g.radius);
        let lowest = bottoms.fold(f64::INFINITY, f64::min);
        let up = Vector3::new(0.0, 0.0, GAP * self.radius() - lowest);
        shop.place(UnitQuaternion::identity(), up)
    }

    fn world(
        &self,
        _packing: &Packing,
        materials: &Materials,
        origin: &str,
    ) -> Result<World, Failure> {
        let at = Place {
            origin,
            section: "sinter",
        };
        let ground = Wall::plane(Vector3::zeros(), Vector3::z());
        let ground = ground.material(materials.number("ground", "ground", at)?);
        let mut world = World {
            gravity: Vector3::new(0.0, 0.0, -self.impact.gravity),
            walls: vec![("ground".into(), ground)],
            velocity: Some(self.velocity()),
            ..World::empty(self.impact.duration)
        };
        if self.material.sintered {
            world.bonds.push(self.sinter.rule(materials, at)?);
        }
        Ok(world)
    }

    fn expected(&self, materials: &Materials) -> Expected {
        let volume = 4.0 / 3.0 * PI * self.radius().powi(3);
        Expected {
            grains: self.comet().grains_in(volume, materials),
            preparation: Some(self.block().grain_steps(materials)),
            duration: self.impact.duration,
        }
    }

    fn left_out(&self) -> Vec<&'static str> {
        vec![
            "attraction of the grains by each other",
            "air",
            "breakage of grains",
        ]
    }

    fn plan(&self) -> Vec<(String, String)> {
        let fall = self.impact.speed.powi(2) / (2.0 * self.impact.gravity);
        vec![
            (
                "boulder".into(),
                format!(
                    "porosity {:.1} %, {:.0} kg",
                    100.0 * (1.0 - self.material.solid_fraction()),
                    self.material.bulk_density * 4.0 / 3.0 * PI * self.radius().powi(3)
                ),
            ),
            ("impact".into(), format!("as after a fall of {fall:.1} m")),
        ]
    }

    fn steer_every(&self, timestep: f64) -> u64 {
        (self.impact.duration / LOOKS / timestep).round() as u64
    }

    fn steer(&self, simulation: &mut Simulation, state: &mut Vec<f64>) -> Result<Course, Failure> {
        if state.is_empty() {
            *state = remember(simulation);
        }
        let held = held(simulation, state).len() as f64;
        let time = simulation.time();
        if held < state[1] {
            (state[1], state[2]) = (held, time);
        }
        let rests = simulation.energy().kinetic() < REST * state[0];
        Ok(if rests || time - state[2] > self.quiet() {
            Course::Over
        } else {
            Course::On
        })
    }

    fn columns(&self) -> Vec<(String, &'static str)> {
        ["largest_fragment", "held_contacts", "fragments"]
            .map(|name| (name.to_owned(), "1"))
            .into()
    }

    fn look(&self, simulation: &mut Simulation, _: &Snapshot, state: &[f64]) -> Vec<f64> {
        let (fragments, held) = fragments_now(simulation, state);
        let whole: f64 = fragments.iter().map(|f| f.mass).sum();
        let largest = fragments.first().map_or(0.0, |f| f.mass / whole);
        let count = fragments.iter().filter(|f| f.grains.len() > 1).count();
        vec![largest, held, count as f64]
    }

    fn groups(&self, simulation: &mut Simulation, state: &[f64]) -> Option<Vec<Option<usize>>> {
        let (fragments, _) = fragments_now(simulation, state);
        Some(fragments::ranks(&fragments, simulation.grain_count()))
    }

    fn conclude(&self, ran: &mut Ran, summary: &mut Summary) -> Result<Vec<Table>, Failure> {
        let (fragments, held) = fragments_now(&mut ran.simulation, &ran.state);
        let grains = ran.simulation.grain_list();
        let whole: f64 = fragments.iter().map(|f| f.mass).sum();
        let largest = fragments.first().map_or(0.0, |f| f.mass / whole);
        let (code, word) = outcome(largest);
        summary.remarks.push(format!(
            "The boulder {word}: {:.1} % of its mass hang together.",
            100.0 * largest
        ));
        summary.put(
            "outcome",
            Quantity::new(code, "1").from("2 survives, 1 breaks, 0 disintegrates"),
        );
        summary.put(
            "largest_fragment_share",
            Quantity::new(largest, "1").from("of the mass, joined by contacts that have held"),
        );
        summary.put(
            "held_contact_share",
            Quantity::new(held, "1").from("of the contacts before the impact"),
        );
        let extent = |k: usize| {
            let high = grains.iter().map(|g| g.position[k] + g.radius);
            let low = grains.iter().map(|g| g.position[k] - g.radius);
            high.fold(f64::NEG_INFINITY, f64::max) - low.fold(f64::INFINITY, f64::min)
        };
        let sides = [("length", 0), ("width", 1), ("height", 2)];
        for (name, k) in sides {
            let size = Quantity::new(extent(k), "m").from("of all grains at the end");
            summary.put(&format!("debris_{name}"), size);
        }
        let kinetic = ran.simulation.energy().kinetic() / ran.state[0];
        let left = Quantity::new(kinetic, "1").from("kinetic energy over that of the impact");
        summary.put("kinetic_energy_left", left);
        let (time, last) = (ran.simulation.time(), ran.state[2]);
        summary.put(
            "last_opening",
            Quantity::new(last, "s").from("when the last contact of the start opened"),
        );
        if kinetic >= REST && time - last <= self.quiet() {
            summary.remarks.push(format!(
                "Still coming apart at the end: a contact opened {:.1} s before it, and {kinetic:.1e} of the \
                 impact's kinetic energy are left.",
                time - last
            ));
        }
        summary.figures.push(Figure::history(
            "share",
            &[
                ("largest_fragment", "mass in the largest fragment"),
                ("held_contacts", "contacts that have held"),
            ],
            "How the boulder comes apart.",
        ));
        Ok(vec![table(&fragments, &grains, whole)])
    }

    fn compared(&self) -> Vec<&'static str> {
        vec!["largest_fragment_share", "held_contact_share"]
    }
}

/// All fragments of two grains and more, the heaviest first.
fn table(fragments: &[Fragment], grains: &[colluvium_dem::Grain], whole: f64) -> Table {
    let large: Vec<&Fragment> = fragments.iter().filter(|f| f.grains.len() > 1).collect();
    let of = |f: &dyn Fn(&Fragment) -> f64| large.iter().map(|fragment| f(fragment)).collect();
    let volume = |f: &Fragment| f.grains.iter().map(|&k| grains[k].volume()).sum::<f64>();
    let center = |f: &Fragment, axis: usize| {
        let moment = f
            .grains
            .iter()
            .map(|&k| grains[k].mass() * grains[k].position[axis]);
        moment.sum::<f64>() / f.mass
    };
    Table::new("fragments")
        .with("grains", "1", of(&|f| f.grains.len() as f64))
        .with("mass_share", "1", of(&|f| f.mass / whole))
        .with(
            "solid_diameter",
            "m",
            of(&|f| (6.0 / PI * volume(f)).cbrt()),
        )
        .with("x", "m", of(&|f| center(f, 0)))
        .with("y", "m", of(&|f| center(f, 1)))
        .with("z", "m", of(&|f| center(f, 2)))
}
