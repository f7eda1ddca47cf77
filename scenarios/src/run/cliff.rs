//! The collapse of a cliff of cometary material (Kappel et al. 2020, §3.2 and 4.2).
//!
//! A block of the material (`comet_block.rs`) is cut to the cliff's shape (`cliff/section.rs`); its back and
//! its bottom layer are held, as the massif and the ground hold them, and it settles under gravity while its face
//! is supported. Then the top is sintered and the support taken away. It stands by itself for a time; then
//! the crack opens: grains in it lose their cohesion and their bonds. The run is over when the debris rests.

mod debris;
mod findings;
pub mod joined;
mod land;
mod record;
mod runout;
mod section;
mod watch;

use super::comet::{self, Comet};
use super::comet_block::CometBlock;
use super::land::Land;
use super::world::boulders::boulders;
use super::world::workshop::Surroundings;
use super::world::{Course, Expected, Ran, Recipe, RecipeKeys, Workshop, World, fragments};
use crate::failure::Failure;
use crate::run_directory::toml_table;
use crate::scene::world::{Materials, Place};
use crate::scene::{CliffScene, layers};
use crate::summary::{Figure, Summary};
use crate::table::Table;
use colluvium_dem::preparation::{Packing, Relaxation, Rest};
use colluvium_dem::{Domain, Region, Simulation, Snapshot};
use debris::volume_beyond;
use nalgebra::{UnitQuaternion, Vector3};
use record::CliffRecord;
use std::collections::BTreeSet;

/// Looks in the whole time.
const LOOKS: f64 = 400.0;
/// Share of its height by which the part before the crack has sunk when it has failed.
const FAILED: f64 = 0.01;
/// Speed over √(g d) that nine grains in ten of what fell stay below when it rests, and for how many looks in
/// a row. Single grains that hang by one contact swing for hours: they do not count.
const STILL: f64 = 0.02;
const STILL_LOOKS: f64 = 3.0;
/// Layers that hold the cliff at its back and its bottom, in mean diameters.
const HELD: f64 = 1.0;
/// Grain-steps of block and settled cliff over the block's own, for the plan: measured 1.1, 1.8 and 2.2 with 300, 4 000 and
/// 9 000 parcels.
const SETTLED: f64 = 1.6;
/// A cliff that has settled need not be quieter than this.
const QUIET: Rest = Rest {
    kinetic: 1e-6,
    unbalanced: 0.05,
};
impl CliffScene {
    fn comet(&self) -> Comet<'_> {
        Comet {
            material: &self.material,
            soft: self.preparation.softness(),
            contact: &self.contact,
            coarse_graining: self.coarse_graining,
        }
    }

    /// Mean diameter of the parcels (m).
    fn diameter(&self) -> Option<f64> {
        let materials = CliffScene::materials(self, "").ok()?;
        Some(comet::diameter(&materials))
    }

    /// The block that the cliff is cut out of, for parcels of this mean diameter (m).
    fn block(&self, diameter: f64) -> CometBlock<'_> {
        let margin = 2.0 * self.preparation.margin * diameter;
        CometBlock {
            comet: self.comet(),
            preparation: &self.preparation,
            needed: Vector3::new(
                self.lip() - self.back(),
                (self.shape.width - margin).max(0.5 * self.shape.width),
                self.face(),
            ),
        }
    }
}

impl Recipe for CliffScene {
    fn about(&self) -> String {
        format!(
            "a cliff of {}, {} m high, its face leaning forward by {} degrees, comes down along a crack that leans back \
             by {} degrees (Kappel et al. 2020, §3.2)",
            self.material.mix.words(),
            self.shape.height,
            self.shape.overhang_degrees,
            self.crack.degrees
        )
    }

    fn materials(&self, origin: &str) -> Result<Materials, Failure> {
        Ok(CliffScene::materials(self, origin)?)
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
            "model",
            "packing",
            "standing",
            "duration",
            "output",
            "runout",
            "sinter",
            "terrain",
            "shape.room_scaled",
            "shape.sintered",
            "crack.depth_scaled",
            "crack.thickness_diameters",
            "material.sintered",
            "timestep.seconds",
            "timestep.safety",
        ] {
            layers::remove(&mut keys, later);
        }
        Ok(Some(keys))
    }

    fn prepare(&self, shop: &mut Workshop, origin: &str) -> Result<(), Failure> {
        let d = comet::diameter(shop.materials);
        self.block(d).make(shop, origin)?;
        let across = [shop.packing.domain.lower.y, shop.packing.domain.upper.y];
        let middle = Vector3::new(
            0.5 * (self.lip() + self.back()),
            0.0,
            self.shape.wall + 0.5 * self.face(),
        );
        shop.place(UnitQuaternion::identity(), middle)?;
        shop.packing.domain = Domain {
            lower: Vector3::new(self.back() - d, across[0], -d),
            upper: Vector3::new(
                self.lip() + self.shape.height,
                across[1],
                self.shape.height + d,
            ),
            periodic: [false, true, false],
        };
        shop.trim(&self.body(), true)?;
        let endless = f64::INFINITY;
        let layer = |upper: Vector3<f64>| Region::Block {
            lower: Vector3::repeat(-endless),
            upper,
        };
        shop.glue(&Region::Any(vec![
            layer(Vector3::new(self.back() + HELD * d, endless, endless)),
            layer(Vector3::new(endless, endless, self.shape.wall + HELD * d)),
        ]))?;
        let at = Place {
            origin,
            section: "ground",
        };
        let [ground, support] =
            ["ground", "support"].map(|name| shop.materials.number(name, "material", at));
        let walls = self.ground(ground?, across[1] - across[0]);
        let mut walls: Vec<_> = walls.into_iter().map(|(_, wall)| wall).collect();
        walls.push(self.support(support?));
        let around = Surroundings {
            walls,
            gravity: -self.gravity * Vector3::z(),
            ..Surroundings::none(shop.materials.laws.clone())
        };
        let rest = Relaxation {
            rest: QUIET,
            ..Relaxation::under(self.gravity)
        };
        shop.relax(&around, &rest)?;
        let inside = Region::Block {
            lower: Vector3::new(self.back() + 2.0 * d, across[0], self.shape.wall + 2.0 * d),
            upper: Vector3::new(-d, across[1], self.shape.height - 2.0 * d),
        };
        shop.measure(&around, &inside, self.gravity).map(drop)
    }

    fn world(
        &self,
        packing: &Packing,
        materials: &Materials,
        origin: &str,
    ) -> Result<World, Failure> {
        let at = Place {
            origin,
            section: "sinter",
        };
        let ground = materials.number("ground", "ground", at)?;
        let land = self.land(origin)?;
        let across = packing.domain.lengths().y;
        let walls = self.ground_on(land.as_ref(), ground, across)?;
        let fall = (2.0 * self.gravity * (self.shape.height - Land::span(land.as_ref())[0])).sqrt();
        let mut world = World {
            gravity: -self.gravity * Vector3::z(),
            walls,
            speed: 2.0 * fall,
            ..World::empty(self.standing + self.duration)
        };
        if self.material.sintered {
            let rule = self.sinter.rule(materials, at)?;
            let within = Region::All(vec![rule.within.clone(), self.sintered_layer()]);
            world.bonds.push(colluvium_dem::BondRule { within, ..rule });
        }
        Ok(world)
    }

    fn expected(&self, materials: &Materials) -> Expected {
        Expected {
            grains: self
                .comet()
                .grains_in(self.areas()[0] * self.shape.width, materials),
            preparation: Some(
                SETTLED
                    * self
                        .block(comet::diameter(materials))
                        .grain_steps(materials),
            ),
            duration: self.standing + self.duration,
        }
    }

    fn left_out(&self) -> Vec<&'static str> {
        vec![
            "attraction of the grains by each other",
            "air and outgassing",
            "breakage of grains",
            "ends of the cliff (periodic along it)",
        ]
    }

    fn plan(&self) -> Vec<(String, String)> {
        let [whole, before] = self.areas();
        let fall = (2.0 * self.face() / self.gravity).sqrt();
        let before_it = match self.terrain.as_ref().map(|keys| keys.source().file()) {
            None => "a plane".to_owned(),
            Some(None) => "the line of terrain.profile".to_owned(),
            Some(Some((_, file))) => format!("a section of {file}"),
        };
        vec![
            (
                "ground".into(),
                format!(
                    "before the cliff {before_it}; debris is looked for up to x = {:.0} m",
                    self.far_end()
                ),
            ),
            (
                "cliff".into(),
                format!(
                    "{whole:.0} m² in section, {before:.0} m² of it before the crack, {} m along it",
                    self.shape.width
                ),
            ),
            (
                "times".into(),
                format!(
                    "it stands for {} s, a free fall from its top takes {fall:.0} s",
                    self.standing
                ),
            ),
        ]
    }

    fn steer_every(&self, timestep: f64) -> u64 {
        ((self.standing + self.duration) / LOOKS / timestep).round() as u64
    }

    fn steer(&self, simulation: &mut Simulation, state: &mut Vec<f64>) -> Result<Course, Failure> {
        let Some(d) = self.diameter() else {
            return Ok(Course::Over);
        };
        let axis = self.heap_axis(d);
        let mut record = match CliffRecord::read(state, axis.columns) {
            Some(record) => record,
            None => self.begin(simulation),
        };
        let (grains, time) = (simulation.grain_list(), simulation.time());
        let sunk = CliffScene::sunk(&record, &grains);
        if record.times.failed.is_nan() && sunk > FAILED * self.face() {
            record.times.failed = time;
        }
        // A cliff that came down by itself needs no crack.
        let half_a_step = 0.5 * simulation.timestep();
        if record.times.opened.is_nan()
            && record.times.failed.is_nan()
            && time > self.standing - half_a_step
        {
            record.times.opened = time;
            record.times.sunk_standing = sunk;
            record.times.loosened = self.open(simulation, d)?;
        }
        self.see(simulation, &mut record, &axis);
        let kinetic = simulation.energy().kinetic();
        if kinetic > record.times.peak[0] {
            record.times.peak = [kinetic, time];
        }
        let waited = time - record.times.opened > (2.0 * self.face() / self.gravity).sqrt();
        let still = CliffScene::speed(&record, &grains) < STILL * (self.gravity * d).sqrt();
        let settled = still && (waited || !record.times.failed.is_nan());
        record.heap.resting = if settled {
            record.heap.resting + 1.0
        } else {
            0.0
        };
        record.write(state);
        let over = record.heap.resting >= STILL_LOOKS;
        Ok(if over { Course::Over } else { Course::On })
    }

    fn columns(&self) -> Vec<(String, &'static str)> {
        vec![
            ("x_front".into(), "m"),
            ("sunk".into(), "m"),
            ("forward_turn".into(), "degrees"),
        ]
    }

    fn look(&self, simulation: &mut Simulation, _: &Snapshot, state: &[f64]) -> Vec<f64> {
        let axis = self.diameter().map(|d| self.heap_axis(d));
        let record = axis.and_then(|axis| CliffRecord::read(state, axis.columns));
        let Some(record) = record else {
            return vec![f64::NAN; 3];
        };
        let grains = simulation.grain_list();
        let front = record.heap.fronts.last().map_or(f64::NAN, |f| f[1]);
        vec![
            front,
            CliffScene::sunk(&record, &grains),
            self.turned(&record, &grains),
        ]
    }

    fn groups(&self, simulation: &mut Simulation, _: &[f64]) -> Option<Vec<Option<usize>>> {
        self.material
            .sintered
            .then(|| fragments::by_bonds(simulation))
    }

    fn conclude(&self, ran: &mut Ran, summary: &mut Summary) -> Result<Vec<Table>, Failure> {
        let none = || Failure::Run("the cliff was never looked at".into());
        let d = self.diameter().ok_or_else(none)?;
        let axis = self.heap_axis(d);
        let places = axis.positions();
        let record = CliffRecord::read(&ran.state, axis.columns).ok_or_else(none)?;
        let across = ran.simulation.domain().lengths().y;
        let grains = ran.simulation.grain_list();
        let base = record.heap.solid_fraction * across;
        let deposit = self.heights(&grains, &axis, base);
        let land = self.land("")?;
        self.put_times(&record, ran, summary);
        self.put_pile([&places, &deposit], d, land.as_ref(), summary);
        let beyond = volume_beyond(&ran.seen.grains, 0.0) / record.heap.solid_fraction;
        let share = beyond / (across * self.areas()[1]);
        let now: BTreeSet<[u32; 2]> = fragments::touching(&mut ran.simulation)
            .into_iter()
            .collect();
        let held = record.pairs.iter().filter(|pair| now.contains(*pair));
        let held = held.count() as f64 / record.pairs.len().max(1) as f64;
        let turned = self.turned(&record, &grains);
        self.put_broken(share, [held, turned], &record, summary);
        let clusters = ran.simulation.clusters();
        let sizes = boulders(&clusters, self.material.solid_fraction());
        self.put_boulders(bonds_that_survive(&mut ran.simulation), &sizes, summary);
        summary.figures.push(Figure::history(
            "kinetic energy [J]",
            &[("translation", "translation"), ("rotation", "rotation")],
            "The fall: kinetic energy of all grains in time.",
        ));
        summary.figures.push(Figure::history(
            "length [m]",
            &[("sunk", "sunk on the mean"), ("x_front", "front")],
            "How far what stood before the crack has sunk, and where the debris ends.",
        ));
        let tables = record.heap.tables(places.clone(), deposit);
        let mut tables = Land::beside(land.as_ref(), &places, tables);
        tables.push(sizes);
        Ok(tables)
    }

    fn compared(&self) -> Vec<&'static str> {
        vec!["x_front", "pile_height", "debris_slope"]
    }
}

/// Share of the bonds that the crack left that are whole; not a number where there are none.
fn bonds_that_survive(simulation: &mut Simulation) -> f64 {
    let bonds = simulation.bond_count();
    if bonds.whole + bonds.torn + bonds.sheared > 0 {
        1.0 - bonds.broken_share()
    } else {
        f64::NAN
    }
}
