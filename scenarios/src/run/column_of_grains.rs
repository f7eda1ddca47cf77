//! The collapse of a column of grains: a slab, periodic across, on fixed grains beside a smooth wall.
//!
//! Grains fall into the gap between that wall and a gate, settle and are cut level. The run begins when the
//! gate has gone. Fronts and profiles are taken as those of the continuum (`heap.rs`).

use super::column_seen::SeenColumn;
use super::heap::{HeapAxis, HeapCourse, edge, place_of_share};
use super::land::Land;
use super::world::workshop::{Surroundings, softened, step_for};
use super::world::{Course, Expected, Ran, Recipe, RecipeKeys, Workshop, World, fragments};
use crate::failure::Failure;
use crate::run_directory::toml_table;
use crate::scene::world::{Materials, Place};
use crate::scene::{CollapseScene, ColumnFloorKind, DENSE, layers};
use crate::summary::{Quantity, Summary};
use crate::table::Table;
use colluvium_dem::preparation::{Amount, Packing, Relaxation, Rest, solid_fraction};
use colluvium_dem::{Domain, Grain, Region, Simulation, Snapshot, Wall};
use nalgebra::Vector3;
use std::f64::consts::PI;

/// Solid fraction at which grains are let fall.
const LOOSE: f64 = 0.25;
/// Solid fraction that more than fills the column: the rest is cut off.
const OVERFULL: f64 = 0.64;
/// Stiffness of the grains while they fall, over their own: steps are three times as long.
const SOFT: f64 = 0.1;
/// Fixed grains on a square diameter of the floor, and the thickness of their layer over d.
pub(super) const FLOOR: [f64; 2] = [0.6, 1.25];
/// A column that is about to fall need not be quieter than this.
const QUIET: Rest = Rest {
    kinetic: 1e-5,
    unbalanced: 0.03,
};
/// Times √(h/g) that a cloud of height h takes to fall and settle, for the plan (measured: 2.8).
const SETTLING: f64 = 3.5;
/// Instants of the front over the duration, and fronts between two profiles.
pub(super) const FRONTS: f64 = 240.0;
pub(super) const PROFILE_EVERY: usize = 10;
/// Kinetic energy over m g d a grain below which a heap rests, and for how many looks in a row: what is left
/// then are elastic swings of the whole, which fade slowly and move no grain past another.
pub(super) const STILL: f64 = 1e-4;
pub(super) const STILL_LOOKS: f64 = 3.0;
/// Times √(H/g) before which a column that has just been let go is not looked at for rest.
pub(super) const BEGUN: f64 = 1.0;

/// Share of a heap's area up to which `x_of_share` reaches, in words.
pub(super) const FRONT_SHARE: f64 = 0.99;
pub(super) const OF_SHARE: &str = "up to which 99 % of the heap's area lies: a front that hangs on no single grain; error from both halves of the slab";

/// Kinetic energy of a ball, translation and rotation (J).
pub(super) fn kinetic(g: &Grain) -> f64 {
    let moment = 0.4 * g.mass() * g.radius * g.radius;
    0.5 * (g.mass() * g.velocity.norm_squared() + moment * g.spin.norm_squared())
}

impl CollapseScene {
    pub(super) fn time_unit(&self) -> f64 {
        (self.height / self.gravity).sqrt()
    }

    pub(super) fn duration(&self) -> f64 {
        self.duration_scaled * self.time_unit()
    }

    pub(super) fn slab(&self) -> f64 {
        self.scale * self.grains.width_diameters * self.grains.diameter
    }

    pub(super) fn length(&self) -> f64 {
        self.grid.length_scaled * self.height
    }

    pub(super) fn grain_volume(&self) -> f64 {
        PI / 6.0 * self.grains.diameter.powi(3)
    }

    fn down(&self) -> Vector3<f64> {
        -self.gravity * Vector3::z()
    }

    /// Columns a diameter wide over the whole floor.
    pub(super) fn heap_axis(&self) -> HeapAxis {
        HeapAxis {
            start: 0.0,
            spacing: self.grains.diameter,
            columns: (self.length() / self.grains.diameter).ceil() as usize,
            mirrored: true,
        }
    }

    fn domain(&self, land: Option<&Land>) -> Domain {
        let d = self.grains.diameter;
        let [low, high] = Land::span(land);
        Domain {
            lower: Vector3::new(0.0, 0.0, low - 2.0 * d),
            upper: Vector3::new(self.length(), self.slab(), high + 2.0 * self.height),
            periodic: [false, true, false],
        }
    }

    /// Outward normal of the face.
    fn outward(&self) -> Vector3<f64> {
        let (s, c) = self.overhang_degrees.to_radians().sin_cos();
        Vector3::new(c, 0.0, -s)
    }

    /// What lies behind the face, however high.
    fn behind_face(&self) -> Region {
        let far = 1e3 * (self.length() + self.height);
        Region::Slab {
            point: self.width() * Vector3::x() - 0.5 * far * self.outward(),
            normal: self.outward(),
            thickness: far,
        }
    }

    /// What lies over the floor from x = 0 to `length`, between two heights (m).
    fn over(&self, length: f64, low: f64, high: f64) -> Region {
        Region::Block {
            lower: Vector3::new(0.0, 0.0, low),
            upper: Vector3::new(length, self.slab(), high),
        }
    }

    /// The mirror and what is below the grains; with a gate during the preparation.
    fn walls(
        &self,
        materials: &Materials,
        land: Option<&Land>,
        gate: bool,
        origin: &str,
    ) -> Result<Vec<(String, Wall)>, Failure> {
        let at = Place {
            origin,
            section: "grains",
        };
        let smooth = materials.number("smooth", "floor", at)?;
        let mut walls = vec![
            ("mirror", Wall::plane(Vector3::zeros(), Vector3::x())),
            ("floor", self.floor(land)?),
        ];
        if gate {
            let face = Wall::plane(self.width() * Vector3::x(), -self.outward());
            walls.push(("gate", face));
        }
        let wall = |(name, wall): (&str, Wall)| (name.to_owned(), wall.material(smooth));
        Ok(walls.into_iter().map(wall).collect())
    }

    /// Free grains that are let fall, and the height of their cloud (m).
    fn cloud(&self) -> (usize, f64) {
        let d = self.grains.diameter;
        let solid = OVERFULL * self.section(self.height) * self.slab();
        // Whole grains lie between mirror and gate: centres have a diameter less room.
        let room = self.width() / (self.width() - d) * solid / (LOOSE * self.slab());
        (
            (solid / self.grain_volume()).ceil() as usize,
            self.height_of(room) + d,
        )
    }

    /// The middle of the column.
    pub(super) fn middle(&self) -> Region {
        let x = |share: f64| share * self.width();
        Region::Block {
            lower: Vector3::new(x(0.1), 0.0, 0.1 * self.height),
            upper: Vector3::new(x(0.9), self.slab(), 0.85 * self.height),
        }
    }

    /// Heights of the heap now (m), of the grains that `f` takes, in a slab `width` wide.
    pub(super) fn heights(
        &self,
        grains: &[Grain],
        base: f64,
        f: impl Fn(&Grain) -> bool,
    ) -> Vec<f64> {
        let free = grains.iter().filter(|g| !g.fixed && f(g));
        let rows = free.map(|g| [g.position.x, g.volume()]);
        self.heap_axis().heights(rows, base)
    }

    fn see(&self, simulation: &mut Simulation, course: &mut HeapCourse, profile: bool) {
        let grains = simulation.grain_list();
        let heights = self.heights(&grains, course.solid_fraction * self.slab(), |_| true);
        let places = self.heap_axis().positions();
        let front = edge(&places, &heights, self.threshold());
        let time = simulation.time();
        let highest = heights.iter().copied().fold(0.0, f64::max);
        course.fronts.push([time, front, highest]);
        if profile {
            course.profiles.push((time, heights));
        }
    }

    /// Kinetic energy (J) of grains on the floor. A plane has no end; beyond terrain grains fall for ever.
    pub(super) fn kinetic_of_the_heap(&self, simulation: &mut Simulation) -> f64 {
        if self.terrain.is_none() {
            return simulation.energy().kinetic();
        }
        let grains = simulation.grain_list();
        let there = grains
            .iter()
            .filter(|g| !g.fixed && g.position.x <= self.length());
        there.map(kinetic).sum()
    }

    pub(super) fn threshold(&self) -> f64 {
        self.front_height_scaled * self.height
    }
}

impl Recipe for CollapseScene {
    fn about(&self) -> String {
        format!(
            "a column of grains {} m high and {:.4} m wide, its face leaning out by {} degrees, in a slab {:.4} m wide, periodic \
             across, beside a smooth wall",
            self.height,
            self.width(),
            self.overhang_degrees,
            self.slab()
        )
    }

    fn materials(&self, origin: &str) -> Result<Materials, Failure> {
        Ok(self.grain_materials(origin)?)
    }

    fn keys(&self) -> RecipeKeys<'_> {
        RecipeKeys {
            contact: &self.contact,
            seed: self.grains.seed,
            coarse_graining: 1.0,
            step: &self.timestep,
            output: &self.output,
            packing: self.grains.packing.as_deref(),
        }
    }

    fn provenance(&self) -> Result<Option<toml::Table>, Failure> {
        let mut keys = toml_table("the preparation", self)?;
        for later in [
            "model",
            "duration_scaled",
            "front_height_scaled",
            "rheology",
            "grid.cells",
            "solver",
            "output",
            "grains.packing",
            "grains.calibrated",
            "timestep.seconds",
            "timestep.safety",
            "zones",
            "overlap",
        ] {
            layers::remove(&mut keys, later);
        }
        // Floor grains lie along the ground itself, whatever file it came from.
        if let Ok(Some(land)) = self.land("")
            && let Ok(points) = toml::Value::try_from(land.line().points())
        {
            keys.insert("terrain".into(), points);
        }
        Ok(Some(keys))
    }

    fn prepare(&self, shop: &mut Workshop, origin: &str) -> Result<(), Failure> {
        let land = self.land(origin)?;
        let land = land.as_ref();
        let walls = self.walls(shop.materials, land, true, origin)?;
        let around = Surroundings {
            walls: walls.into_iter().map(|(_, wall)| wall).collect(),
            gravity: self.down(),
            ..Surroundings::none(shop.materials.laws.clone())
        };
        let d = self.grains.diameter;
        shop.packing.domain = self.domain(land);
        if self.grains.floor == ColumnFloorKind::Rough {
            let [density, thickness] = FLOOR;
            let count = density * self.length() * self.slab() / (d * d);
            let layer = self.over(self.length(), -thickness * d, 0.0);
            let floor = Amount::Grains(count.ceil() as usize);
            shop.insert(layer, floor, Vector3::zeros())?;
            for grain in &mut shop.packing.grains {
                grain.position.z += Land::height(land, grain.position.x);
            }
            shop.glue(&Region::Everywhere)?;
        }
        let (count, height) = self.cloud();
        let widest = self.width() + self.overhang() * height;
        let cloud = Region::All(vec![self.over(widest, 0.0, height), self.behind_face()]);
        shop.insert(cloud, Amount::Grains(count), Vector3::zeros())?;
        let rest = Relaxation {
            rest: QUIET,
            ..Relaxation::under(self.gravity)
        };
        let soft = Surroundings {
            laws: softened(&shop.materials.laws, SOFT),
            ..around.clone()
        };
        shop.relax(&soft, &rest)?;
        let endless = f64::INFINITY;
        let mut kept = vec![Region::Block {
            lower: Vector3::repeat(-endless),
            upper: Vector3::new(endless, endless, self.height),
        }];
        if let Some(land) = land {
            // A floor that rises above the column's top.
            kept.push(Region::Block {
                lower: Vector3::new(land.level_up_to(self.spacing()), -endless, -endless),
                upper: Vector3::repeat(endless),
            });
        }
        shop.trim(&Region::Any(kept), true)?;
        shop.relax(&around, &rest)?;
        shop.measure(&around, &self.middle(), self.gravity)
            .map(drop)
    }

    fn world(&self, _: &Packing, materials: &Materials, origin: &str) -> Result<World, Failure> {
        let land = self.land(origin)?;
        let land = land.as_ref();
        let fall = self.height - Land::span(land)[0];
        Ok(World {
            domain: Some(self.domain(land)),
            gravity: self.down(),
            walls: self.walls(materials, land, false, origin)?,
            // A free fall through the height, and as fast against each other.
            speed: 2.0 * (2.0 * self.gravity * fall).sqrt(),
            ..World::empty(self.duration())
        })
    }

    fn expected(&self, materials: &Materials) -> Expected {
        let d = self.grains.diameter;
        let floor = match self.grains.floor {
            ColumnFloorKind::Rough => FLOOR[0] * self.length() * self.slab() / (d * d),
            ColumnFloorKind::Smooth => 0.0,
        };
        let column = self.section(self.height) * self.slab() / self.grain_volume();
        let soft = Surroundings {
            gravity: self.down(),
            ..Surroundings::none(softened(&materials.laws, SOFT))
        };
        let (falling, cloud) = self.cloud();
        let steps = step_for(materials, &soft, self.timestep.preparation)
            .map(|step| SETTLING * (cloud / self.gravity).sqrt() / step);
        Expected {
            grains: DENSE * column + floor,
            preparation: steps.map(|steps| steps * (falling as f64 + floor)),
            duration: self.duration(),
        }
    }

    fn left_out(&self) -> Vec<&'static str> {
        vec!["air", "breakage of grains", "side walls (periodic across)"]
    }

    fn plan(&self) -> Vec<(String, String)> {
        let beside = match self.grains.calibrated.word() {
            Some(word) => format!(
                "afterwards, with the law calibrated for `{word}`: once at {} cells, three times at half of them",
                self.cells()
            ),
            None => "none".into(),
        };
        let mut lines = vec![("continuum".into(), beside)];
        lines.extend(self.terrain_in_words());
        lines
    }

    fn steer_every(&self, timestep: f64) -> u64 {
        (self.duration() / FRONTS / timestep).round() as u64
    }

    fn steer(&self, simulation: &mut Simulation, state: &mut Vec<f64>) -> Result<Course, Failure> {
        let columns = self.heap_axis().columns;
        let mut seen = match SeenColumn::read(state, columns) {
            Some(seen) => seen,
            None => {
                let grains = simulation.grain_list();
                let solid = solid_fraction(&grains, simulation.domain(), &self.middle());
                SeenColumn::of_packing(solid)
            }
        };
        seen.through_joint(self, simulation)?;
        let course = &mut seen.course;
        let profile = course.fronts.len().is_multiple_of(PROFILE_EVERY);
        self.see(simulation, course, profile);
        let unit = simulation.free_mass() * self.gravity * self.grains.diameter;
        let still = simulation.time() > BEGUN * self.time_unit()
            && self.kinetic_of_the_heap(simulation) < STILL * unit;
        course.resting = if still { course.resting + 1.0 } else { 0.0 };
        let over = course.resting >= STILL_LOOKS;
        seen.write(state);
        Ok(if over { Course::Over } else { Course::On })
    }

    fn columns(&self) -> Vec<(String, &'static str)> {
        vec![("x_front".into(), "m"), ("height".into(), "m")]
    }

    fn look(&self, _: &mut Simulation, _: &Snapshot, state: &[f64]) -> Vec<f64> {
        let seen = SeenColumn::read(state, self.heap_axis().columns);
        let last = seen.and_then(|s| s.course.fronts.last().copied());
        last.map_or(vec![f64::NAN; 2], |[_, front, height]| vec![front, height])
    }

    fn conclude(&self, ran: &mut Ran, summary: &mut Summary) -> Result<Vec<Table>, Failure> {
        let axis = self.heap_axis();
        let places = axis.positions();
        let seen = SeenColumn::read(&ran.state, axis.columns).unwrap_or_default();
        let (force, mut course) = (seen.force(), seen.course);
        if course
            .fronts
            .last()
            .is_none_or(|f| f[0] < ran.simulation.time())
        {
            self.see(&mut ran.simulation, &mut course, false);
        }
        let grains = ran.simulation.grain_list();
        let base = course.solid_fraction * self.slab();
        let deposit = self.heights(&grains, base, |_| true);
        let front = edge(&places, &deposit, self.threshold());
        // Both halves of the slab tell what a column more or less of grains changes.
        let half = |upper: bool| {
            let across = |g: &Grain| g.position.y.rem_euclid(self.slab()) > 0.5 * self.slab();
            let heights = self.heights(&grains, 0.5 * base, |g| across(g) == upper);
            [
                edge(&places, &heights, self.threshold()),
                place_of_share(&places, &heights, FRONT_SHARE),
            ]
        };
        let [upper, lower] = [half(true), half(false)];
        let [error, error_of_share] = [0, 1].map(|k| 0.5 * (upper[k] - lower[k]).abs());
        let width = self.width();
        let mut put = |name: &str, quantity: Quantity, source: &str| {
            summary.put(name, quantity.from(source));
        };
        let m = |value: f64| Quantity::new(value, "m");
        let one = |value: f64| Quantity::new(value, "1");
        put(
            "x_front",
            m(front).with_error(error),
            "where the heap is front_height_scaled high; error from both halves of the slab",
        );
        put(
            "runout_scaled",
            one((front - width) / width).with_error(error / width),
            "(x_front − width)/width",
        );
        put(
            "x_of_share",
            m(place_of_share(&places, &deposit, FRONT_SHARE)).with_error(error_of_share),
            OF_SHARE,
        );
        if let Some(force) = force {
            put(
                "force_of_grains",
                Quantity::new(force, "N"),
                "along x through the surface that would be a joined column's handshake surface, of contacts and velocity fluctuations, mean in time",
            );
        }
        let highest = deposit.iter().copied().fold(0.0, f64::max);
        put("deposit_height", m(highest), "greatest height at the end");
        let rests = course.resting >= STILL_LOOKS;
        let time = if rests {
            ran.simulation.time()
        } else {
            f64::NAN
        };
        put(
            "time_of_rest",
            Quantity::new(time, "s"),
            "kinetic energy below 1e-4 m g d a grain; null where the run ended before",
        );
        put(
            "connected_front",
            m(fragments::farthest(&ran.seen)),
            "surface of the farthest grain that hangs together with most others by contacts of free grains",
        );
        put(
            "solid_fraction",
            one(course.solid_fraction),
            "in the middle of the column before",
        );
        let inside = Region::Block {
            lower: Vector3::new(0.0, 0.0, 0.1 * highest),
            upper: Vector3::new(0.6 * width, self.slab(), 0.6 * highest),
        };
        put(
            "deposit_solid_fraction",
            one(solid_fraction(&grains, ran.simulation.domain(), &inside)),
            "in the middle of the deposit",
        );
        let solid: f64 = grains.iter().filter(|g| !g.fixed).map(Grain::volume).sum();
        put(
            "column_height",
            m(self.height_of(solid / base)),
            "of the column before: what its grains fill at their solid fraction, on its foot",
        );
        if front >= places[places.len() - 2] {
            summary.remarks.push(
                "The heap reached the end of the floor: grid.length_scaled is too small for its run-out."
                    .into(),
            );
        }
        if !rests {
            summary.remarks.push(format!(
                "Still moving at the end: kinetic energy of {:.1e} m g d a grain.",
                ran.simulation.energy().kinetic()
                    / (ran.simulation.free_mass() * self.gravity * self.grains.diameter)
            ));
        }
        let land = self.land("")?;
        let tables = course.tables(places.clone(), deposit);
        Ok(Land::beside(land.as_ref(), &places, tables))
    }

    fn compared(&self) -> Vec<&'static str> {
        vec!["x_front", "deposit_height"]
    }
}
