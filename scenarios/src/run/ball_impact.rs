//! A ball that falls into a bed of grains.

mod bed_file;
pub mod joined;
mod moves;
mod sheared_packings;

use super::world::workshop::{Surroundings, softened, step_for};
use super::world::{Expected, Ran, Recipe, RecipeKeys, Workshop, World};
use crate::failure::Failure;
use crate::run_directory::toml_table;
use crate::scene::world::{Materials, Place};
use crate::scene::{BallImpactScene, layers};
use crate::summary::{Figure, Quantity, Summary};
use crate::table::Table;
use colluvium_dem::preparation::{
    Amount, Coordination, HELD_BY_FRICTION, Packing, Relaxation, Rest, solid_fraction,
};
use colluvium_dem::{Grain, GrainSample, Region, Simulation, Snapshot, Wall};
use nalgebra::Vector3;

/// Solid fraction at which grains are let fall.
const LOOSE: f64 = 0.25;
/// Stiffness of the grains while they fall, over their own: steps are three times as long.
const SOFT: f64 = 0.1;
/// A bed that a ball of some metres a second hits need not be quieter than this.
const QUIET: Rest = Rest {
    kinetic: 1e-5,
    unbalanced: 0.05,
};
/// Times √(H/g) that a cloud of height H takes to fall and settle, for the plan (measured: 2.8).
const SETTLING: f64 = 3.5;

/// The benchmark's own bed, from the places of its 25 000 grains (Dosta et al., Comput. Phys. Commun. 296
/// (2024) 109066, case 3): solid fraction between an eighth and three quarters of its depth, between walls 98 mm and 60 mm
/// apart, and contacts of a grain, those with walls included.
const PUBLISHED_BED: [f64; 2] = [0.570, 4.40];

impl BallImpactScene {
    fn walls(&self, materials: &Materials, origin: &str) -> Result<Vec<(String, Wall)>, Failure> {
        let at = Place {
            origin,
            section: "container",
        };
        let material = materials.number(&self.container.material, "material", at)?;
        let half =
            0.5 * self.scale * Vector3::new(self.container.length, self.container.width, 0.0);
        let wall = |name: &str, point: Vector3<f64>, normal: Vector3<f64>| {
            (
                name.to_owned(),
                Wall::plane(point, normal).material(material),
            )
        };
        let floor = Vector3::new(0.0, 0.0, self.floor());
        Ok(vec![
            wall("floor", floor, Vector3::z()),
            wall("left", -half, Vector3::x()),
            wall("right", half, -Vector3::x()),
            wall("front", -half, Vector3::y()),
            wall("back", half, -Vector3::y()),
        ])
    }

    fn down(&self) -> Vector3<f64> {
        Vector3::new(0.0, 0.0, -self.gravity)
    }

    fn area(&self) -> f64 {
        self.scale.powi(2) * self.container.length * self.container.width
    }

    /// Height of the loose cloud over the floor (m).
    fn cloud(&self, materials: &Materials) -> f64 {
        let parts: f64 = materials
            .ingredients
            .iter()
            .map(|i| i.parts_by_volume)
            .sum();
        let volumes = materials.ingredients.iter();
        let mean: f64 = volumes
            .map(|i| i.parts_by_volume / parts / i.sizes.mean().powi(3))
            .sum();
        let grain = 4.0 / 3.0 * std::f64::consts::PI / mean;
        let largest = materials.ingredients.iter().map(|i| i.sizes.largest());
        // Grains lie whole in the cloud: its rim is emptier.
        let rim = 2.0 * largest.fold(0.0, f64::max);
        let [length, width] =
            [self.container.length, self.container.width].map(|e| self.scale * e - rim);
        self.count() as f64 * grain / (LOOSE * (length * width).max(0.05 * self.area())) + rim
    }

    /// The bed as in the file of the scene.
    fn given_bed(&self, path: &str, materials: &Materials) -> Result<Vec<Grain>, Failure> {
        let first = &materials.ingredients[0];
        let refused = |why: String| Failure::Input(format!("key `bed` = \"{path}\": {why}"));
        let grains = bed_file::read(path, first.density, first.material).map_err(refused)?;
        let half = [0.5 * self.container.length, 0.5 * self.container.width];
        let outside = |g: &Grain| {
            g.position.x.abs() > half[0]
                || g.position.y.abs() > half[1]
                || g.position.z < self.floor()
        };
        match grains.iter().position(outside) {
            Some(k) => Err(refused(format!(
                "grain {} at {:?} m lies outside of the container",
                k + 1,
                <[f64; 3]>::from(grains[k].position)
            ))),
            None => Ok(grains),
        }
    }

    /// Height of the bed's surface (m): twice that of its centre of mass.
    fn surface(&self, bed: &[Grain]) -> f64 {
        let (mut mass, mut moment) = (0.0, 0.0);
        for grain in bed.iter().filter(|g| !g.fixed) {
            mass += grain.mass();
            moment += grain.mass() * (grain.position.z - self.floor());
        }
        self.floor() + 2.0 * moment / mass
    }

    /// The part of the bed that its solid fraction is measured in.
    fn middle(&self, bed: &[Grain]) -> Region {
        let half =
            0.5 * self.scale * Vector3::new(self.container.length, self.container.width, 0.0);
        let depth = self.surface(bed) - self.floor();
        let at = |share: f64| Vector3::new(0.0, 0.0, self.floor() + share * depth);
        Region::Block {
            lower: at(0.125) - half,
            upper: at(0.75) + half,
        }
    }

    fn ball(&self, materials: &Materials, origin: &str) -> Result<Grain, Failure> {
        let at = Place {
            origin,
            section: "ball",
        };
        let place = Vector3::new(0.0, 0.0, self.scale * self.ball.height);
        Ok(Grain {
            velocity: Vector3::new(0.0, 0.0, -self.speed),
            material: materials.number(&self.ball.material, "material", at)?,
            ..Grain::at_rest(place, self.ball_radius(), self.ball.density)
        })
    }
}

/// What is looked at of the ball: height (m) and velocity upwards (m/s).
fn of_ball(ball: Option<&GrainSample>) -> Vec<f64> {
    let z = |read: fn(&GrainSample) -> f64| ball.map_or(f64::NAN, read);
    vec![z(|b| b.position.z), z(|b| b.velocity.z)]
}

/// The ball: it joined last.
fn ball(seen: &Snapshot) -> Option<&GrainSample> {
    seen.grains.iter().max_by_key(|g| g.id)
}

impl Recipe for BallImpactScene {
    fn about(&self) -> String {
        format!(
            "a ball of {} m falls at {} m/s into a bed of {} grains",
            2.0 * self.ball_radius(),
            self.speed,
            self.count()
        )
    }

    fn materials(&self, origin: &str) -> Result<Materials, Failure> {
        Ok(BallImpactScene::materials(self, origin)?)
    }

    fn keys(&self) -> RecipeKeys<'_> {
        RecipeKeys {
            contact: &self.contact,
            seed: self.seed,
            coarse_graining: 1.0,
            step: &self.timestep,
            output: &self.output,
            packing: self.packing.as_deref(),
        }
    }

    fn provenance(&self) -> Result<Option<toml::Table>, Failure> {
        let mut keys = toml_table("the preparation", self)?;
        for later in [
            "model",
            "speed",
            "duration",
            "packing",
            "output",
            "ball",
            "zones",
            "overlap",
            "continuum",
        ] {
            keys.remove(later);
        }
        for step in ["seconds", "safety"] {
            layers::remove(&mut keys, &format!("timestep.{step}"));
        }
        Ok(Some(keys))
    }

    fn prepare(&self, shop: &mut Workshop, origin: &str) -> Result<(), Failure> {
        let walls = self.walls(shop.materials, origin)?;
        let around = Surroundings {
            walls: walls.into_iter().map(|(_, wall)| wall).collect(),
            gravity: self.down(),
            ..Surroundings::none(shop.materials.laws.clone())
        };
        let rest = Relaxation {
            rest: QUIET,
            ..Relaxation::under(self.gravity)
        };
        match &self.bed {
            Some(path) => {
                shop.packing.grains = self.given_bed(path, shop.materials)?;
                let count = shop.packing.grains.len();
                shop.note("bed", format!("{count} grains from {path}"));
            }
            None => {
                let half = 0.5
                    * self.scale
                    * Vector3::new(self.container.length, self.container.width, 0.0);
                let floor = Vector3::new(0.0, 0.0, self.floor());
                let cloud = Region::Block {
                    lower: floor - half,
                    upper: floor + half + self.cloud(shop.materials) * Vector3::z(),
                };
                shop.insert(cloud, Amount::Grains(self.count()), Vector3::zeros())?;
                let soft = Surroundings {
                    laws: softened(&shop.materials.laws, SOFT),
                    ..around.clone()
                };
                shop.relax(&soft, &rest)?;
                shop.relax(&around, &rest)?;
            }
        }
        let middle = self.middle(&shop.packing.grains);
        shop.measure(&around, &middle, self.gravity).map(drop)
    }

    fn world(&self, _: &Packing, materials: &Materials, origin: &str) -> Result<World, Failure> {
        // A bed that cannot be read is found before anything is written.
        if let Some(path) = &self.bed {
            self.given_bed(path, materials)?;
        }
        let fall = self.scale * (self.ball.height - self.container.floor);
        Ok(World {
            gravity: self.down(),
            walls: self.walls(materials, origin)?,
            grains: vec![self.ball(materials, origin)?],
            speed: (self.speed.powi(2) + 2.0 * self.gravity * fall).sqrt(),
            ..World::empty(self.scale * self.duration)
        })
    }

    fn expected(&self, materials: &Materials) -> Expected {
        let soft = Surroundings {
            gravity: self.down(),
            ..Surroundings::none(softened(&materials.laws, SOFT))
        };
        let steps = step_for(materials, &soft, self.timestep.preparation)
            .map(|step| SETTLING * (self.cloud(materials) / self.gravity).sqrt() / step);
        Expected {
            grains: self.count() as f64 + 1.0,
            preparation: match self.bed {
                Some(_) => Some(0.0),
                None => steps.map(|steps| steps * self.count() as f64),
            },
            duration: self.scale * self.duration,
        }
    }

    fn left_out(&self) -> Vec<&'static str> {
        vec![
            "air",
            "breakage of grains",
            "rotation of the ball at the start",
        ]
    }

    fn plan(&self) -> Vec<(String, String)> {
        let full = if self.scale == 1.0 {
            "the full size of the penetration benchmark (Dosta et al. 2024, case 3)".to_owned()
        } else {
            format!(
                "{} of the lengths of the penetration benchmark (Dosta et al. 2024, case 3), grains of the same size; \
                 scale = 1 takes {:.0} times as long",
                self.scale,
                self.scale.powi(-4)
            )
        };
        vec![("size".into(), full)]
    }

    fn columns(&self) -> Vec<(String, &'static str)> {
        vec![("ball_z".into(), "m"), ("ball_vz".into(), "m/s")]
    }

    fn look(&self, _: &mut Simulation, seen: &Snapshot, _: &[f64]) -> Vec<f64> {
        of_ball(ball(seen))
    }

    fn conclude(&self, ran: &mut Ran, summary: &mut Summary) -> Result<Vec<Table>, Failure> {
        let column = |name: &str| ran.history.column(name).to_vec();
        let (t, z, vz) = (column("t"), column("ball_z"), column("ball_vz"));
        let surface = self.surface(&ran.packing.grains);
        let radius = self.ball_radius();
        let touch = surface + radius;
        let lowest = (0..z.len())
            .min_by(|&a, &b| z[a].total_cmp(&z[b]))
            .unwrap_or(0);
        let struck = (1..z.len()).find(|&k| z[k] <= touch);
        let struck = struck.map_or(f64::NAN, |k| {
            t[k - 1] + (t[k] - t[k - 1]) * (z[k - 1] - touch) / (z[k - 1] - z[k])
        });
        summary.put(
            "surface",
            Quantity::new(surface, "m").from("twice the height of the bed's centre of mass"),
        );
        summary.put(
            "impact_time",
            Quantity::new(struck, "s").from("the ball's underside at the surface"),
        );
        summary.put(
            "penetration",
            Quantity::new(touch - z[lowest], "m")
                .from("of the ball's underside below the surface, the deepest"),
        );
        summary.put(
            "stopping_time",
            Quantity::new(t[lowest] - struck, "s").from("from the surface to the deepest"),
        );
        let under = z[lowest] - radius - self.floor();
        let d = 2.0 * ran.stand.setup.grains[0].radius;
        summary.put(
            "clearance",
            Quantity::new(under / d, "d").from("between ball and floor, the least"),
        );
        let last = z.len() - 1;
        summary.put(
            "final_height",
            Quantity::new(z[last], "m").from("of the ball's centre"),
        );
        summary.put(
            "final_velocity",
            Quantity::new(vz[last], "m/s").from("of the ball, upwards"),
        );
        let domain = ran.packing.domain;
        let solid = solid_fraction(
            &ran.packing.grains,
            &domain,
            &self.middle(&ran.packing.grains),
        );
        let source = "the benchmark's own bed, from its places (Dosta et al. 2024)";
        let [published, touching] = PUBLISHED_BED;
        summary.put(
            "bed_solid_fraction",
            Quantity::new(solid, "1").against(published, source),
        );
        let mut at_rest = ran.stand.start().map_err(|e| Failure::Run(e.to_string()))?;
        let mut seen = Snapshot::default();
        at_rest.snapshot(&mut seen);
        let contacts = Coordination::of(&seen, HELD_BY_FRICTION).all;
        summary.put(
            "bed_coordination",
            Quantity::new(contacts, "1").against(touching, source),
        );
        summary.remarks.push(format!(
            "The ball stops {:.1} grain diameters above the floor: the bed is {:.1} ball radii deep.",
            under / d,
            (surface - self.floor()) / radius
        ));
        summary.figures.push(Figure::history(
            "height of the ball's centre [m]",
            &[("ball_z", "ball")],
            "The ball on its way into the bed.",
        ));
        summary.figures.push(Figure::history(
            "velocity of the ball [m/s]",
            &[("ball_vz", "ball")],
            "Its velocity, upwards.",
        ));
        let path = Table::new("ball")
            .with("t", "s", t)
            .with("z", "m", z)
            .with("vz", "m/s", vz);
        Ok(vec![path])
    }

    fn compared(&self) -> Vec<&'static str> {
        vec!["penetration", "stopping_time", "final_height"]
    }
}
