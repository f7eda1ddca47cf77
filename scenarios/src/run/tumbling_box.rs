//! A lander on a bed of grains: when it touches, how deep it goes, how it leaves.

use super::world::workshop::{Surroundings, step_for};
use super::world::{Course, Expected, Ran, Recipe, RecipeKeys, Workshop, World};
use crate::failure::Failure;
use crate::run_directory::toml_table;
use crate::scene::world::{Materials, Place};
use crate::scene::{TumblingBoxScene, layers};
use crate::summary::{Figure, Quantity, Summary};
use crate::table::Table;
use colluvium_dem::preparation::{Amount, Packing, Relaxation, Rest};
use colluvium_dem::{BodySample, Region, Side, Simulation, Snapshot, Wall};
use nalgebra::Vector3;
use std::f64::consts::PI;

/// Seconds between two looks at the lander.
const LOOK: f64 = 5e-3;

/// Grains poured over those that the bed holds: the rest is cut off.
const OVERFILL: f64 = 1.35;

/// Height of the space that grains are poured from (m).
const SOURCE: f64 = 0.6;

/// Times √(H/g) that a bed takes until it rests under a last height of fall H, for the plan; measured 8 and 18 in two beds.
const SETTLING: f64 = 12.0;

/// Solid fraction of the bed, for the number of grains.
const SOLID: f64 = 0.54;

/// The lander's course so far.
#[derive(Clone, Copy, Debug)]
struct Landing {
    /// First contact (s), not a number before.
    touched: f64,
    /// When all corners were above the rim again (s).
    left: f64,
    /// Lowest corner so far (m).
    lowest: f64,
    /// Speed (m/s) and kinetic energies of translation and rotation (J) at both times.
    speeds: [f64; 2],
    translation: [f64; 2],
    rotation: [f64; 2],
    /// Angle of the velocity from the vertical (degrees) and spin (rad/s) when it left.
    angle: f64,
    spin: f64,
}

impl Landing {
    fn of(state: &[f64]) -> Landing {
        let get = |k: usize| state.get(k).copied().unwrap_or(f64::NAN);
        Landing {
            touched: get(0),
            left: get(1),
            lowest: get(2),
            speeds: [get(3), get(4)],
            translation: [get(5), get(6)],
            rotation: [get(7), get(8)],
            angle: get(9),
            spin: get(10),
        }
    }

    fn state(&self) -> Vec<f64> {
        let Landing {
            speeds: [s, t],
            translation: [a, b],
            rotation: [c, d],
            ..
        } = *self;
        let own = [self.touched, self.left, self.lowest];
        [&own[..], &[s, t, a, b, c, d, self.angle, self.spin]].concat()
    }
}

impl TumblingBoxScene {
    fn walls(&self, materials: &Materials, origin: &str) -> Result<Vec<(String, Wall)>, Failure> {
        let at = Place {
            origin,
            section: "surfaces",
        };
        let material = materials.number("container", "container", at)?;
        let zero = Vector3::zeros();
        let side = Wall::cylinder(zero, Vector3::z(), self.container(), Side::Inside);
        let floor = Wall::plane(zero, Vector3::z());
        Ok(vec![
            ("side".into(), side.material(material)),
            ("floor".into(), floor.material(material)),
        ])
    }

    /// Grain-steps of the bed, right to a factor of two.
    fn pouring(&self, materials: &Materials) -> Option<f64> {
        let around = Surroundings {
            gravity: -Vector3::z() * self.bed.pour_gravity,
            ..Surroundings::none(materials.laws.clone())
        };
        let step = step_for(materials, &around, self.timestep.preparation)?;
        let fall = ((self.bed.depth + SOURCE) / self.bed.pour_gravity).sqrt();
        Some(OVERFILL * self.count(materials) * SETTLING * fall / step)
    }

    /// Grains that fill the bed.
    fn count(&self, materials: &Materials) -> f64 {
        let radius = materials.ingredients[0].sizes.mean();
        let bed = PI * self.container().powi(2) * self.bed.depth;
        bed * SOLID / (4.0 / 3.0 * PI * radius.powi(3))
    }

    /// Height of the lowest corner (m).
    fn lowest(&self, lander: &BodySample) -> f64 {
        let corners = self.corners().into_iter();
        let heights = corners.map(|c| (lander.pose.position + lander.pose.outward(&c)).z);
        heights.fold(f64::INFINITY, f64::min)
    }

    /// Speed ratio that the thesis fits to the means of its runs on a bed of moderate friction (Eq. 4.3).
    fn thesis_ratio(&self) -> f64 {
        let t = self.lander.impact_degrees;
        -8.14e-7 * t.powi(3) + 1.84e-4 * t * t - 2.54e-3 * t + 0.0127
    }
}

impl Recipe for TumblingBoxScene {
    fn about(&self) -> String {
        format!(
            "a lander of {} kg comes down at {} m/s, {}° from the vertical, on a bed {} m deep",
            self.lander.mass, self.lander.speed, self.lander.impact_degrees, self.bed.depth
        )
    }

    fn materials(&self, origin: &str) -> Result<Materials, Failure> {
        Ok(TumblingBoxScene::materials(self, origin)?)
    }

    fn keys(&self) -> RecipeKeys<'_> {
        RecipeKeys {
            contact: &self.contact,
            seed: self.seed,
            coarse_graining: 1.0 / self.scale,
            step: &self.timestep,
            output: &self.output,
            packing: self.packing.as_deref(),
        }
    }

    /// All that decides a bed; the lander does not.
    fn provenance(&self) -> Result<Option<toml::Table>, Failure> {
        let mut keys = toml_table("the preparation", self)?;
        for later in ["duration", "packing", "output", "lander"] {
            keys.remove(later);
        }
        for step in ["timestep.seconds", "timestep.safety", "surfaces.lander"] {
            layers::remove(&mut keys, step);
        }
        Ok(Some(keys))
    }

    fn prepare(&self, shop: &mut Workshop, origin: &str) -> Result<(), Failure> {
        let walls = self.walls(shop.materials, origin)?;
        let laws = shop.materials.laws.clone();
        let (depth, largest) = (
            self.bed.depth,
            shop.materials.ingredients[0].sizes.largest(),
        );
        let mut around = Surroundings {
            walls: walls.into_iter().map(|(_, wall)| wall).collect(),
            gravity: -Vector3::z() * self.bed.pour_gravity,
            ..Surroundings::none(laws)
        };
        let over = depth + 0.35;
        let slab = Region::Slab {
            point: Vector3::z() * (over + 0.5 * SOURCE),
            normal: Vector3::z(),
            thickness: SOURCE,
        };
        let within = Region::Cylinder {
            point: Vector3::zeros(),
            axis: Vector3::z(),
            radius: self.container() - largest,
        };
        let count = OVERFILL * self.count(shop.materials);
        let rest = |acceleration: f64| Relaxation {
            // The thesis lets beds rest at 2e-5 m/s rms under 2.5e-4 m/s²: some 1e-5 of m a d.
            rest: Rest {
                kinetic: 1e-5,
                unbalanced: 1.0,
            },
            ..Relaxation::under(acceleration)
        };
        shop.pour(
            &around,
            (
                Region::All(vec![within, slab]),
                Amount::Grains(count.ceil() as usize),
            ),
            (Vector3::zeros(), None),
            &rest(self.bed.pour_gravity),
        )?;
        let open = f64::INFINITY;
        let below = Region::Block {
            lower: Vector3::repeat(-open),
            upper: Vector3::new(open, open, depth),
        };
        shop.trim(&below, true)?;
        around.gravity = -Vector3::z() * self.gravity;
        shop.relax(&around, &rest(self.gravity))?;
        let middle = shop.middle();
        shop.measure(&around, &middle, self.gravity).map(drop)
    }

    fn world(
        &self,
        packing: &Packing,
        materials: &Materials,
        origin: &str,
    ) -> Result<World, Failure> {
        let at = Place {
            origin,
            section: "surfaces",
        };
        let material = materials.number("lander", "lander", at)?;
        let tops = packing.grains.iter().map(|g| g.position.z + g.radius);
        let surface = tops.fold(0.0, f64::max);
        Ok(World {
            gravity: -Vector3::z() * self.gravity,
            walls: self.walls(materials, origin)?,
            bodies: vec![("lander".into(), self.body(surface, material, origin)?)],
            speed: self.lander.speed,
            ..World::empty(self.duration)
        })
    }

    fn expected(&self, materials: &Materials) -> Expected {
        Expected {
            grains: self.count(materials),
            preparation: self.pouring(materials),
            duration: self.duration,
        }
    }

    fn left_out(&self) -> Vec<&'static str> {
        vec![
            "air",
            "breakage of grains",
            "what moves inside the lander",
            "attraction of the grains by each other",
        ]
    }

    fn steer_every(&self, timestep: f64) -> u64 {
        (LOOK / timestep).ceil() as u64
    }

    fn steer(&self, simulation: &mut Simulation, state: &mut Vec<f64>) -> Result<Course, Failure> {
        let time = simulation.time();
        let lander = simulation.body(0);
        let mut landing = Landing::of(state);
        let lowest = self.lowest(&lander);
        landing.lowest = landing.lowest.min(lowest);
        let touches = lander.force != Vector3::zeros();
        let speed = lander.velocity.norm();
        let at = usize::from(!landing.touched.is_nan());
        if at == 0 {
            landing.speeds[0] = speed;
            [landing.translation[0], landing.rotation[0]] = lander.kinetic;
            if touches {
                landing.touched = time;
            }
        } else if lowest > self.bed.depth && !touches && lander.velocity.z > 0.0 {
            landing.left = time;
            landing.speeds[1] = speed;
            [landing.translation[1], landing.rotation[1]] = lander.kinetic;
            landing.angle = (lander.velocity.z / speed).acos().to_degrees();
            landing.spin = lander.spin.norm();
        }
        *state = landing.state();
        if landing.left.is_nan() {
            Ok(Course::On)
        } else {
            Ok(Course::Over)
        }
    }

    fn columns(&self) -> Vec<(String, &'static str)> {
        vec![("lander_lowest".into(), "m")]
    }

    fn look(&self, _: &mut Simulation, seen: &Snapshot, _: &[f64]) -> Vec<f64> {
        let lander = seen.bodies.first();
        vec![lander.map_or(f64::NAN, |lander| self.lowest(lander))]
    }

    fn conclude(&self, ran: &mut Ran, summary: &mut Summary) -> Result<Vec<Table>, Failure> {
        let landing = Landing::of(&ran.state);
        let bounced = !landing.left.is_nan();
        // The thesis counts a lander that stays as one that leaves at no speed.
        let ratio = |a: f64, b: f64| if bounced { a / b } else { 0.0 };
        let mut put = |name: &str, value: f64, unit: &str, about: &str| {
            summary.put(name, Quantity::new(value, unit).from(about));
        };
        let after = |pair: [f64; 2]| pair[1];
        put(
            "bounced",
            f64::from(u8::from(bounced)),
            "1",
            "1 if it left the bed",
        );
        put(
            "penetration",
            self.bed.depth - landing.lowest,
            "m",
            "of the lowest corner below the rim",
        );
        let [came, went] = landing.translation;
        let total_in = came + landing.rotation[0];
        let total_out = went + after(landing.rotation);
        put(
            "energy_ratio",
            ratio(total_out, total_in),
            "1",
            "outgoing over incoming, with rotation",
        );
        let turning = after(landing.rotation);
        put(
            "rotation_over_incoming",
            ratio(turning, came),
            "1",
            "energy of rotation after over that of translation before",
        );
        put(
            "rotation_over_outgoing",
            ratio(turning, went),
            "1",
            "energy of rotation over that of translation after",
        );
        if bounced {
            put(
                "contact_time",
                landing.left - landing.touched,
                "s",
                "from the first contact until all corners are above the rim",
            );
            put(
                "outgoing_degrees",
                landing.angle,
                "degrees",
                "of the velocity from the vertical",
            );
            put("spin", landing.spin, "rad/s", "when it left");
        }
        let speeds = ratio(landing.speeds[1], landing.speeds[0]);
        let speeds = Quantity::new(speeds, "1").against(
            self.thesis_ratio(),
            "Thuillet 2019, Eq. 4.3: fit to the means over depths and orientations, moderate friction",
        );
        summary.put("speed_ratio", speeds);
        summary.figures.push(Figure::history(
            "height [m]",
            &[("lander_z", "centre"), ("lander_lowest", "lowest corner")],
            "The lander's centre of mass and its lowest corner in time.",
        ));
        summary.figures.push(Figure::history(
            "spin [rad/s]",
            &[
                ("lander_wx", "about x"),
                ("lander_wy", "about y"),
                ("lander_wz", "about z"),
            ],
            "The lander's spin in time.",
        ));
        Ok(Vec::new())
    }

    fn compared(&self) -> Vec<&'static str> {
        vec!["speed_ratio", "penetration", "energy_ratio"]
    }
}
