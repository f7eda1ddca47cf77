//! The collapse of a cliff of cometary material (Kappel et al. 2020, §3.2 and 4.2).
//!
//! A block of the material (`comet_block.rs`) is cut to the cliff's shape (`cliff/section.rs`); its back and
//! its bottom layer are held, as the massif and the ground hold them, and it settles under gravity while its face
//! is supported. Then the top is sintered and the support taken away. It stands by itself for a time; then
//! the crack opens: grains in it lose their cohesion and their bonds. The run is over when the debris rests.

mod debris;
mod record;
mod section;

use super::comet::{self, Comet};
use super::comet_block::CometBlock;
use super::heap::{HeapAxis, edge};
use super::world::boulders::{boulders, size_index};
use super::world::workshop::Surroundings;
use super::world::{Course, Expected, Ran, Recipe, Workshop, World, fragments};
use crate::failure::Failure;
use crate::scene::world::{Materials, OutputKeys, Place, StepKeys};
use crate::scene::{CliffScene, LawKeys, layers};
use crate::summary::{Figure, Quantity, Summary};
use crate::table::Table;
use colluvium_dem::preparation::{Packing, Relaxation, Rest};
use colluvium_dem::{Domain, Grain, Region, Simulation, Snapshot};
use debris::{Pile, forward_turn, volume_beyond};
use nalgebra::{UnitQuaternion, Vector3};
use record::{CliffRecord, CliffTimes};
use std::collections::BTreeSet;

/// Looks in the whole time, and looks between two profiles.
const LOOKS: f64 = 400.0;
const PROFILE_EVERY: usize = 20;
/// Share of its height by which the part before the crack has sunk when it has failed.
const FAILED: f64 = 0.01;
/// Speed over √(g d) that nine grains in ten of what fell stay below when it rests, and for how many looks in
/// a row. Single grains that hang by one contact swing for hours: they do not count.
const STILL: f64 = 0.02;
const STILL_LOOKS: f64 = 3.0;
/// Height over the mean diameter of parcels at which debris ends: half a layer of single parcels.
const EDGE: f64 = 0.25;
/// Layers that hold the cliff at its back and its bottom, in mean diameters.
const HELD: f64 = 1.0;
/// A cliff that has settled need not be quieter than this.
const QUIET: Rest = Rest {
    kinetic: 1e-6,
    unbalanced: 0.05,
};
/// Heights of the cliff beyond its lip in which debris is looked for.
const ROOM: f64 = 4.0;

/// What §4.2 of the paper says of the Aswan cliff: the pile's height (m), its distance from the wall (m), the
/// run-out from there (m), the mean angle of repose (degrees), the share of bonds that survives, the size of the
/// largest boulders (m).
const ASWAN: [f64; 6] = [28.0, 15.0, 70.0, 22.0, 0.98, 10.0];
const ASWAN_SOURCE: &str = "Kappel et al. 2020, §4.2, from 270 000 parcels";
/// Height of that cliff (m).
const ASWAN_HEIGHT: f64 = 130.0;

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

    fn heap_axis(&self, diameter: f64) -> HeapAxis {
        let length = self.lip() - self.back() + ROOM * self.shape.height;
        HeapAxis {
            start: self.back(),
            spacing: diameter,
            columns: (length / diameter).ceil() as usize,
            mirrored: false,
        }
    }

    /// What a look at the start remembers.
    fn begin(&self, simulation: &mut Simulation) -> CliffRecord {
        let grains = simulation.grain_list();
        let solid: f64 = grains.iter().map(Grain::volume).sum();
        let room = self.areas()[0] * simulation.domain().lengths().y;
        let before = |g: &Grain| !g.fixed && self.before_crack(&g.position);
        let face = grains.iter().enumerate().filter(|(_, g)| before(g));
        let face = face.map(|(k, g)| [k as f64, g.position.x, g.position.z]);
        let mut record = CliffRecord {
            times: CliffTimes {
                opened: f64::NAN,
                failed: f64::NAN,
                ..CliffTimes::default()
            },
            face: face.collect(),
            ..CliffRecord::default()
        };
        record.heap.solid_fraction = solid / room;
        let own: BTreeSet<u32> = record.face.iter().map(|g| g[0] as u32).collect();
        let pairs = fragments::touching(simulation).into_iter();
        record.pairs = pairs
            .filter(|pair| pair.iter().all(|id| own.contains(id)))
            .collect();
        record
    }

    /// Opens the crack: says how many grains it made loose.
    fn open(&self, simulation: &mut Simulation, diameter: f64) -> Result<f64, Failure> {
        let Some(region) = self.crack_region(diameter) else {
            return Ok(0.0);
        };
        let materials = CliffScene::materials(self, "")?;
        let at = Place {
            origin: "",
            section: "crack",
        };
        let loose = materials.number("crack", "crack", at)?;
        simulation.cut_bonds(&region);
        let loosened = simulation
            .convert(|g| (!g.fixed && region.contains(&g.position)).then_some(loose))
            .map_err(|error| Failure::Run(error.to_string()))?;
        Ok(loosened as f64)
    }

    /// How far the part before the crack has sunk, on the mean (m).
    fn sunk(record: &CliffRecord, grains: &[Grain]) -> f64 {
        let sunk = record
            .face
            .iter()
            .map(|[k, _, z]| z - grains[*k as usize].position.z);
        sunk.sum::<f64>() / record.face.len().max(1) as f64
    }

    /// How far the sintered part before the crack has turned forward (degrees).
    fn turned(&self, record: &CliffRecord, grains: &[Grain]) -> f64 {
        let low = self.shape.height - self.shape.sintered;
        let cap = record.face.iter().filter(|g| g[2] > low);
        let cap: Vec<_> = cap.collect();
        let before: Vec<[f64; 2]> = cap.iter().map(|g| [g[1], g[2]]).collect();
        let at = |k: f64| &grains[k as usize];
        let now = cap.iter().map(|g| at(g[0]).position).map(|x| [x.x, x.z]);
        let weights: Vec<f64> = cap.iter().map(|g| at(g[0]).mass()).collect();
        forward_turn(&before, &now.collect::<Vec<_>>(), &weights)
    }

    /// Speed that nine grains in ten of what stood before the crack stay below (m/s).
    fn speed(record: &CliffRecord, grains: &[Grain]) -> f64 {
        let speeds = record.face.iter();
        let mut speeds: Vec<f64> = speeds
            .map(|g| grains[g[0] as usize].velocity.norm())
            .collect();
        speeds.sort_by(f64::total_cmp);
        speeds.get(speeds.len() * 9 / 10).copied().unwrap_or(0.0)
    }

    fn heights(&self, grains: &[Grain], axis: &HeapAxis, base: f64) -> Vec<f64> {
        // The wall below is part of the heap's height.
        let rows = grains.iter().map(|g| [g.position.x, g.volume()]);
        let mut heights = axis.heights(rows, base);
        for (x, h) in axis.positions().into_iter().zip(&mut heights) {
            if x < 0.0 {
                *h += self.shape.wall;
            }
        }
        heights
    }

    fn see(&self, simulation: &mut Simulation, record: &mut CliffRecord, axis: &HeapAxis) {
        let grains = simulation.grain_list();
        let base = record.heap.solid_fraction * simulation.domain().lengths().y;
        let heights = self.heights(&grains, axis, base);
        let front = edge(&axis.positions(), &heights, EDGE * axis.spacing);
        let (time, highest) = (
            simulation.time(),
            heights.iter().copied().fold(0.0, f64::max),
        );
        if record.heap.fronts.len().is_multiple_of(PROFILE_EVERY) {
            record.heap.profiles.push((time, heights));
        }
        record.heap.fronts.push([time, front, highest]);
    }

    /// Reference of the Aswan cliff, where the scene is one.
    fn reference(&self, k: usize, quantity: Quantity, source: &str) -> Quantity {
        if self.shape.height == ASWAN_HEIGHT {
            quantity.against(ASWAN[k], ASWAN_SOURCE)
        } else {
            quantity.from(source)
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

    fn contact(&self) -> &LawKeys {
        &self.contact
    }

    fn seed(&self) -> u64 {
        self.seed
    }

    fn coarse_graining(&self) -> f64 {
        self.coarse_graining
    }

    fn step(&self) -> &StepKeys {
        &self.timestep
    }

    fn output(&self) -> &OutputKeys {
        &self.output
    }

    fn packing(&self) -> Option<&str> {
        self.packing.as_deref()
    }

    fn provenance(&self) -> Option<toml::Table> {
        let mut keys = toml::Table::try_from(self).unwrap_or_default();
        for later in [
            "model",
            "packing",
            "standing",
            "duration",
            "output",
            "sinter",
            "shape.sintered",
            "crack.depth_scaled",
            "crack.thickness_diameters",
            "material.sintered",
            "timestep.seconds",
            "timestep.safety",
        ] {
            layers::remove(&mut keys, later);
        }
        Some(keys)
    }

    fn prepare(&self, shop: &mut Workshop, origin: &str) -> Result<(), Failure> {
        let d = comet::diameter(shop.materials);
        let margin = 2.0 * self.preparation.margin * d;
        let needed = Vector3::new(
            self.lip() - self.back(),
            (self.shape.width - margin).max(0.5 * self.shape.width),
            self.face(),
        );
        let block = CometBlock {
            comet: self.comet(),
            preparation: &self.preparation,
            needed,
        };
        block.make(shop, origin)?;
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
        let fall = (2.0 * self.gravity * self.shape.height).sqrt();
        let mut world = World {
            gravity: -self.gravity * Vector3::z(),
            walls: self.ground(ground, packing.domain.lengths().y),
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
            preparation: None,
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
        vec![
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
        self.put_times(&record, ran, summary);
        self.put_pile(&places, &deposit, d, summary);
        let beyond = volume_beyond(&ran.seen.grains, 0.0) / record.heap.solid_fraction;
        let source =
            "beyond the foot, at the cliff's solid fraction, over what stood before the crack";
        let share = beyond / (across * self.areas()[1]);
        summary.put("debris_share", Quantity::new(share, "1").from(source));
        let now: BTreeSet<[u32; 2]> = fragments::touching(&mut ran.simulation)
            .into_iter()
            .collect();
        let held = record.pairs.iter().filter(|pair| now.contains(*pair));
        let held = held.count() as f64 / record.pairs.len().max(1) as f64;
        let source = "of the contacts before the crack at the start";
        summary.put("held_contact_share", Quantity::new(held, "1").from(source));
        let source = "of the sintered part before the crack, forward positive";
        let turn = Quantity::new(self.turned(&record, &grains), "degrees").from(source);
        summary.put("forward_turn", turn);
        summary.put(
            "solid_fraction",
            Quantity::new(record.heap.solid_fraction, "1").from("of the cliff before"),
        );
        let clusters = ran.simulation.clusters();
        let sizes = boulders(&clusters, self.material.solid_fraction());
        self.put_boulders(ran, &sizes, summary);
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
        let mut tables = record.heap.tables(places, deposit);
        tables.push(sizes);
        Ok(tables)
    }

    fn compared(&self) -> Vec<&'static str> {
        vec!["x_front", "pile_height", "debris_slope"]
    }
}

impl CliffScene {
    fn put_times(&self, record: &CliffRecord, ran: &Ran, summary: &mut Summary) {
        let times = &record.times;
        let rests = record.heap.resting >= STILL_LOOKS;
        let failed = !times.failed.is_nan();
        let stood = !times.opened.is_nan();
        let since = |time: f64| time - if stood { times.opened } else { 0.0 };
        let mut put = |name: &str, value: f64, unit: &str, source: &str| {
            summary.put(name, Quantity::new(value, unit).from(source));
        };
        put(
            "stood",
            f64::from(u8::from(stood)),
            "1",
            "1 if it stood until the crack opened",
        );
        put(
            "time_of_failure",
            since(times.failed),
            "s",
            "after the crack opened, or after the support was taken away where it did not stand: what stood before the crack \
             has sunk by a hundredth of the face's height; null where it did not",
        );
        put(
            "time_of_impact",
            since(times.peak[1]),
            "s",
            "the same, of the largest kinetic energy; a free fall of 30 m takes 577 s (some 10 minutes in the paper)",
        );
        let end = if rests {
            since(ran.simulation.time())
        } else {
            f64::NAN
        };
        put(
            "time_of_rest",
            end,
            "s",
            "the same, of rest: up to 3600 s in the paper; null where the run ended before",
        );
        put(
            "sunk_standing",
            times.sunk_standing,
            "m",
            "on the mean, what stood before the crack while the cliff stood by itself",
        );
        put(
            "loosened_grains",
            times.loosened,
            "1",
            "in the crack, that lost their cohesion",
        );
        let word = match (stood, failed) {
            (false, _) => format!(
                "The cliff does not stand by itself: it fails {:.0} s after its support is taken away, before the crack opens.",
                times.failed
            ),
            (true, true) => format!(
                "The cliff stands by itself and fails {:.0} s after the crack has opened.",
                since(times.failed)
            ),
            (true, false) => "The cliff stands, and the crack does not bring it down.".into(),
        };
        summary.remarks.push(word);
        if !rests {
            summary
                .remarks
                .push("Still moving at the end: a longer duration is needed.".into());
        }
    }

    fn put_pile(&self, places: &[f64], deposit: &[f64], d: f64, summary: &mut Summary) {
        let pile = Pile::of(places, deposit, 0.0, EDGE * d);
        let of = |f: &dyn Fn(&Pile) -> f64| pile.as_ref().map_or(f64::NAN, f);
        let m = |value: f64| Quantity::new(value, "m");
        let degrees = |value: f64| Quantity::new(value, "degrees");
        let end = m(of(&|p| p.end)).from("where the debris is a quarter of a mean parcel high");
        summary.put("x_front", end);
        let height = m(of(&|p| p.height));
        let source = "greatest height of the pile beyond the foot";
        summary.put("pile_height", self.reference(0, height, source));
        let top = m(of(&|p| p.top));
        let source = "where the pile is highest, from the foot";
        summary.put("pile_top", self.reference(1, top, source));
        let runout = m(of(&|p| p.end - p.top));
        let source = "of the debris from the pile's top";
        summary.put("runout", self.reference(2, runout, source));
        let repose = degrees(of(&Pile::repose_degrees));
        let source =
            "atan(pile's height over run-out from its top); 20 to 30 on 67P (Vincent et al. 2016)";
        summary.put("repose", self.reference(3, repose, source));
        let wedge = degrees(of(&Pile::wedge_degrees));
        let source = "of the wedge from the foot with the debris' area and length: atan(2 A/L²)";
        summary.put("debris_slope", wedge.from(source));
    }

    fn put_boulders(&self, ran: &mut Ran, sizes: &Table, summary: &mut Summary) {
        let diameters = sizes.column("diameter");
        let count = Quantity::new(diameters.len() as f64, "1");
        summary.put(
            "boulders",
            count.from("of two grains and more, joined by bonds"),
        );
        let largest = diameters.first().copied().unwrap_or(f64::NAN);
        let source = "diameter of the ball that its grains fill at the cliff's solid fraction";
        let largest = self.reference(5, Quantity::new(largest, "m"), source);
        summary.put("largest_boulder", largest);
        let [index, error] = size_index(diameters);
        let index = Quantity::new(index, "1").with_error(error);
        summary.put(
            "boulder_size_index",
            index.against(
                3.6,
                "observed at Aswan (Pajola et al. 2017); null for fewer than ten boulders",
            ),
        );
        let bonds = ran.simulation.bond_count();
        let survive = Quantity::new(1.0 - bonds.broken_share(), "1");
        let source = "of the bonds that the crack left";
        if bonds.whole + bonds.torn + bonds.sheared > 0 {
            summary.put("bond_survival", self.reference(4, survive, source));
        }
    }
}
