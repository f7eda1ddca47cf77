//! The collapse of a cylinder of grains on a layer of fixed grains, and the continuum of their calibrated law beside it.
//!
//! Grains fall into a smooth tube, settle and are cut level; the run begins when the tube has gone. Heights are taken in
//! rings a diameter wide about the axis,
//!
//! ```text
//! h(r) = Σ V_i w(r - r_i) / (2π φ ∫ s w(r - s) ds)
//! ```
//!
//! with the weights w of `heap.rs`, mirrored at the axis, and φ the solid fraction of the cylinder before: a level layer is
//! level up to the axis. The integral is r, but for r < b = 2 d it is r + (b - r)³/(3 b²).

mod beside;

use super::column_of_grains::{BEGUN, FLOOR, FRONTS, PROFILE_EVERY, STILL, STILL_LOOKS, kinetic};
use super::heap::{HeapAxis, HeapCourse, edge};
use super::world::workshop::{Surroundings, softened};
use super::world::{Course, Expected, Ran, Recipe, RecipeKeys, Workshop, World};
use crate::failure::Failure;
use crate::run_directory::toml_table;
use crate::scene::world::{Materials, Place};
use crate::scene::{DENSE, GrainCylinderScene, layers};
use crate::summary::{Figure, Quantity, Summary};
use crate::table::Table;
use colluvium_dem::preparation::{Amount, Packing, Relaxation, Rest, solid_fraction};
use colluvium_dem::{Domain, Grain, Region, Side, Simulation, Snapshot, Wall};
use nalgebra::Vector3;
use std::f64::consts::{PI, TAU};

/// Solid fraction at which grains are let fall.
const LOOSE: f64 = 0.25;
/// Solid fraction that more than fills the cylinder: the rest is cut off.
const OVERFULL: f64 = 0.66;
/// Stiffness of the grains while they fall, over their own.
const SOFT: f64 = 0.1;
/// Radius of the disc about the axis over which the heap's top is taken, in mean diameters.
const TOP: f64 = 3.0;
/// Grains this many diameters beyond the edge do not belong to the heap.
const STRAY: f64 = 2.0;
/// A cylinder that is about to fall need not be quieter than this.
const QUIET: Rest = Rest {
    kinetic: 1e-5,
    unbalanced: 0.03,
};

/// ∫ |s| w(r − s) ds of hats that reach over two rings so wide (m).
fn smeared(r: f64, ring: f64) -> f64 {
    let reach = 2.0 * ring;
    r + (reach - r).max(0.0).powi(3) / (3.0 * reach * reach)
}

impl GrainCylinderScene {
    fn time_unit(&self) -> f64 {
        (self.height / self.gravity).sqrt()
    }

    fn duration(&self) -> f64 {
        self.duration_scaled * self.time_unit()
    }

    fn threshold(&self) -> f64 {
        self.front_height_scaled * self.height
    }

    fn grain_volume(&self) -> f64 {
        PI / 6.0 * self.grains.diameter.powi(3)
    }

    fn down(&self) -> Vector3<f64> {
        -self.gravity * Vector3::z()
    }

    /// Rings a diameter wide over the whole floor.
    fn rings(&self) -> HeapAxis {
        HeapAxis {
            start: 0.0,
            spacing: self.grains.diameter,
            columns: (self.length() / self.grains.diameter).ceil() as usize,
            mirrored: true,
        }
    }

    /// Heights (m) of the free grains that `f` takes, which are a `part` of the whole about the axis.
    fn heights(
        &self,
        grains: &[Grain],
        solid_fraction: f64,
        part: f64,
        f: impl Fn(&Grain) -> bool,
    ) -> Vec<f64> {
        let free = grains.iter().filter(|g| !g.fixed && f(g));
        let rows = free.map(|g| [g.position.xy().norm(), g.volume()]);
        let axis = self.rings();
        let mut heights = axis.heights(rows, part * solid_fraction);
        for (r, h) in axis.positions().into_iter().zip(&mut heights) {
            *h /= TAU * smeared(r, axis.spacing);
        }
        heights
    }

    fn see(&self, simulation: &mut Simulation, course: &mut HeapCourse, profile: bool) {
        let heights = self.heights(&simulation.grain_list(), course.solid_fraction, 1.0, |_| {
            true
        });
        let front = edge(&self.rings().positions(), &heights, self.threshold());
        let time = simulation.time();
        course.fronts.push([time, front, self.top(&heights)]);
        if profile {
            course.profiles.push((time, heights));
        }
    }

    /// Mean height about the axis (m): a ring has few grains there.
    fn top(&self, heights: &[f64]) -> f64 {
        let within = TOP * self.grains.diameter;
        let places = self.rings().positions();
        let inner = places.iter().zip(heights).filter(|(r, _)| **r < within);
        let (volume, area) = inner.fold((0.0, 0.0), |(v, a), (r, h)| {
            let share = smeared(*r, self.grains.diameter);
            (v + share * h, a + share)
        });
        volume / area
    }

    fn domain(&self) -> Domain {
        let (l, d) = (self.length(), self.grains.diameter);
        Domain {
            lower: Vector3::new(-l, -l, -2.0 * d),
            upper: Vector3::new(l, l, 2.0 * self.height),
            periodic: [false; 3],
        }
    }

    /// An upright cylinder about the axis between two heights (m).
    fn about_axis(&self, radius: f64, low: f64, high: f64) -> Region {
        let far = 2.0 * self.length();
        Region::All(vec![
            Region::Cylinder {
                point: Vector3::zeros(),
                axis: Vector3::z(),
                radius,
            },
            Region::Block {
                lower: Vector3::new(-far, -far, low),
                upper: Vector3::new(far, far, high),
            },
        ])
    }

    /// The middle of the cylinder.
    fn middle(&self) -> Region {
        self.about_axis(0.85 * self.radius(), 0.1 * self.height, 0.85 * self.height)
    }

    fn smooth(materials: &Materials, origin: &str) -> Result<u16, Failure> {
        let at = Place {
            origin,
            section: "grains",
        };
        Ok(materials.number("smooth", "floor", at)?)
    }

    fn floor(&self, smooth: u16) -> (String, Wall) {
        let below = -FLOOR[1] * self.grains.diameter;
        let plane = Wall::plane(below * Vector3::z(), Vector3::z());
        ("floor".to_owned(), plane.material(smooth))
    }

    fn floor_grains(&self) -> f64 {
        FLOOR[0] * PI * (self.length() / self.grains.diameter).powi(2)
    }

    /// Solid volume of a full cylinder at a solid fraction (m³).
    fn solid(&self, solid_fraction: f64) -> f64 {
        solid_fraction * PI * self.radius().powi(2) * self.height
    }
}

impl Recipe for GrainCylinderScene {
    fn about(&self) -> String {
        format!(
            "an upright cylinder of grains {} m high and {:.4} m in radius collapses on a floor of fixed grains",
            self.height,
            self.radius()
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
            "duration_scaled",
            "front_height_scaled",
            "grid.cells",
            "output",
            "grains.packing",
            "grains.calibrated",
            "timestep.seconds",
            "timestep.safety",
        ] {
            layers::remove(&mut keys, later);
        }
        Ok(Some(keys))
    }

    fn prepare(&self, shop: &mut Workshop, origin: &str) -> Result<(), Failure> {
        let d = self.grains.diameter;
        let smooth = Self::smooth(shop.materials, origin)?;
        let tube = Wall::cylinder(Vector3::zeros(), Vector3::z(), self.radius(), Side::Inside);
        let around = Surroundings {
            walls: vec![self.floor(smooth).1, tube.material(smooth)],
            gravity: self.down(),
            ..Surroundings::none(shop.materials.laws.clone())
        };
        shop.packing.domain = self.domain();
        let layer = self.about_axis(self.length(), -FLOOR[1] * d, 0.0);
        let count = Amount::Grains(self.floor_grains().ceil() as usize);
        shop.insert(layer, count, Vector3::zeros())?;
        shop.glue(&Region::Everywhere)?;
        let solid = self.solid(OVERFULL);
        // Whole grains lie in the tube: centres have half a diameter less room.
        let room = PI * (self.radius() - 0.5 * d).powi(2);
        let cloud = self.about_axis(self.radius(), 0.0, solid / (LOOSE * room) + d);
        let count = Amount::Grains((solid / self.grain_volume()).ceil() as usize);
        shop.insert(cloud, count, Vector3::zeros())?;
        let rest = Relaxation {
            rest: QUIET,
            ..Relaxation::under(self.gravity)
        };
        let soft = Surroundings {
            laws: softened(&shop.materials.laws, SOFT),
            ..around.clone()
        };
        shop.relax(&soft, &rest)?;
        let far = 2.0 * self.length();
        let below = Region::Block {
            lower: Vector3::repeat(-far),
            upper: Vector3::new(far, far, self.height),
        };
        shop.trim(&below, true)?;
        shop.relax(&around, &rest)?;
        shop.measure(&around, &self.middle(), self.gravity)
            .map(drop)
    }

    fn world(&self, _: &Packing, materials: &Materials, origin: &str) -> Result<World, Failure> {
        let smooth = Self::smooth(materials, origin)?;
        Ok(World {
            domain: Some(self.domain()),
            gravity: self.down(),
            walls: vec![self.floor(smooth)],
            // A free fall through the height, and as fast against each other.
            speed: 2.0 * (2.0 * self.gravity * self.height).sqrt(),
            ..World::empty(self.duration())
        })
    }

    fn expected(&self, _: &Materials) -> Expected {
        Expected {
            grains: self.solid(DENSE) / self.grain_volume() + self.floor_grains(),
            preparation: None,
            duration: self.duration(),
        }
    }

    fn left_out(&self) -> Vec<&'static str> {
        vec!["air", "breakage of grains", "the gate's own motion"]
    }

    fn plan(&self) -> Vec<(String, String)> {
        let beside = match self.grains.calibrated.word() {
            Some(word) => format!(
                "afterwards, in space, with the law calibrated for `{word}`: at {} cells from the axis to the edge, and at {}",
                self.grid.cells,
                self.coarse_cells()
            ),
            None => "none".into(),
        };
        vec![("continuum".into(), beside)]
    }

    fn steer_every(&self, timestep: f64) -> u64 {
        (self.duration() / FRONTS / timestep).round() as u64
    }

    fn steer(&self, simulation: &mut Simulation, state: &mut Vec<f64>) -> Result<Course, Failure> {
        let rings = self.rings().columns;
        let mut course = HeapCourse::read(state, rings).unwrap_or_else(|| HeapCourse {
            solid_fraction: solid_fraction(
                &simulation.grain_list(),
                simulation.domain(),
                &self.middle(),
            ),
            ..HeapCourse::default()
        });
        let profile = course.fronts.len().is_multiple_of(PROFILE_EVERY);
        self.see(simulation, &mut course, profile);
        let unit = simulation.free_mass() * self.gravity * self.grains.diameter;
        let still = simulation.time() > BEGUN * self.time_unit()
            && self.kinetic_of_the_heap(simulation, &course) < STILL * unit;
        course.resting = if still { course.resting + 1.0 } else { 0.0 };
        let over = course.resting >= STILL_LOOKS;
        course.write(state);
        Ok(if over { Course::Over } else { Course::On })
    }

    fn columns(&self) -> Vec<(String, &'static str)> {
        vec![("r_front".into(), "m"), ("height".into(), "m")]
    }

    fn look(&self, _: &mut Simulation, _: &Snapshot, state: &[f64]) -> Vec<f64> {
        let course = HeapCourse::read(state, self.rings().columns);
        let last = course.and_then(|c| c.fronts.last().copied());
        last.map_or(vec![f64::NAN; 2], |[_, front, height]| vec![front, height])
    }

    fn conclude(&self, ran: &mut Ran, summary: &mut Summary) -> Result<Vec<Table>, Failure> {
        let places = self.rings().positions();
        let mut course = HeapCourse::read(&ran.state, places.len()).unwrap_or_default();
        if course
            .fronts
            .last()
            .is_none_or(|f| f[0] < ran.simulation.time())
        {
            self.see(&mut ran.simulation, &mut course, false);
        }
        let grains = ran.simulation.grain_list();
        let solid = course.solid_fraction;
        let deposit = self.heights(&grains, solid, 1.0, |_| true);
        let front = edge(&places, &deposit, self.threshold());
        // Four quarters tell what chance does to the edge.
        let quarters: [f64; 4] = std::array::from_fn(|k| {
            let own = |g: &Grain| {
                let [x, y] = [g.position.x > 0.0, g.position.y > 0.0].map(usize::from);
                x + 2 * y == k
            };
            let heights = self.heights(&grains, solid, 0.25, own);
            edge(&places, &heights, self.threshold())
        });
        let mean = quarters.iter().sum::<f64>() / 4.0;
        let squares: f64 = quarters.iter().map(|q| (q - mean).powi(2)).sum();
        let error = (squares / 12.0).sqrt();
        let radius = self.radius();
        let mut put = |name: &str, quantity: Quantity, source: &str| {
            summary.put(name, quantity.from(source));
        };
        let (m, one) = (
            |value: f64| Quantity::new(value, "m"),
            |value: f64| Quantity::new(value, "1"),
        );
        put(
            "r_front",
            m(front).with_error(error),
            "where the heap is front_height_scaled high; error from four quarters",
        );
        put(
            "runout_scaled",
            one((front - radius) / radius).with_error(error / radius),
            "(r_front − radius)/radius; experiments 1.24 aspect (Lube et al. 2004, aspect < 1.7), 1.35 aspect (Lajeunesse et al. 2004)",
        );
        put(
            "runout_over_aspect",
            one((front - radius) / (radius * self.aspect))
                .with_error(error / (radius * self.aspect)),
            "experiments 1.24 and 1.35",
        );
        let source = "mean height at the end within 3 d of the axis";
        put("deposit_height", m(self.top(&deposit)), source);
        put(
            "solid_fraction",
            one(solid),
            "in the middle of the cylinder before",
        );
        let volume: f64 = grains.iter().filter(|g| !g.fixed).map(Grain::volume).sum();
        let height = volume / (solid * PI * radius * radius);
        put(
            "cylinder_height",
            m(height),
            "of the cylinder before: what its grains fill at their solid fraction",
        );
        let away = grains
            .iter()
            .filter(|g| !g.fixed && g.position.xy().norm() > self.length());
        put(
            "grains_away",
            one(away.count() as f64),
            "that have rolled beyond the floor",
        );
        let rests = course.resting >= STILL_LOOKS;
        let time = if rests {
            ran.simulation.time()
        } else {
            f64::NAN
        };
        put(
            "time_of_rest",
            Quantity::new(time, "s"),
            "kinetic energy of the heap below 1e-4 m g d a grain; null where the run ended before",
        );
        if !rests {
            summary
                .remarks
                .push("Still moving at the end: duration_scaled is too short.".into());
        }
        let grains_found = beside::Found {
            deposit: (places.clone(), deposit.clone()),
            height,
            runout: (front - radius) / radius,
        };
        let mut tables = course.tables_along("r", places, deposit);
        tables.extend(self.set_beside(&grains_found, summary)?);
        summary.figures.push(Figure::history(
            "length [m]",
            &[("r_front", "front"), ("height", "height")],
            "The collapse: radius of the heap's edge and its height about the axis in time.",
        ));
        Ok(tables)
    }

    fn compared(&self) -> Vec<&'static str> {
        vec!["r_front", "deposit_height"]
    }
}

impl GrainCylinderScene {
    /// Kinetic energy (J) of grains up to its edge: single ones that roll away do so for a long time.
    fn kinetic_of_the_heap(&self, simulation: &mut Simulation, course: &HeapCourse) -> f64 {
        let edge = course.fronts.last().map_or(f64::INFINITY, |f| f[1]);
        let reach = edge + STRAY * self.grains.diameter;
        let grains = simulation.grain_list();
        let there = grains
            .iter()
            .filter(|g| !g.fixed && g.position.xy().norm() <= reach);
        there.map(kinetic).sum()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_level_layer_is_level_up_to_the_axis() {
        let rings = HeapAxis {
            start: 0.0,
            spacing: 0.5,
            columns: 12,
            mirrored: true,
        };
        let step = 1e-4;
        let layer = (0..60_000).map(|k| {
            let r = step * (f64::from(k) + 0.5);
            [r, TAU * r * step]
        });
        let heights = rings.heights(layer, 1.0);
        for (r, h) in rings.positions().into_iter().zip(heights).take(9) {
            let level = h / (TAU * smeared(r, rings.spacing));
            assert!((level - 1.0).abs() < 1e-6, "{r} {level}");
        }
    }
}
