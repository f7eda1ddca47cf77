//! Flat-bottomed silos that run out of round openings, beside Beverloo's law.
//!
//! ```text
//! W = C ρ_b √g (D - k d)^{5/2}          C = 0.58, k = 1.4 for round grains and sharp rims
//! ```
//! W mass rate, ρ_b bulk density at rest, D diameter of the opening, d of the grains. Sources: Beverloo,
//! Leniger & van de Velde, Chem. Eng. Sci. 15 (1961) 260; C and k as in Nedderman, Statics and Kinematics
//! of Granular Materials (1992), §10.2: k 1.4 ± 0.1 for spheres.

mod beverloo;

use super::world::workshop::{Surroundings, step_for};
use super::world::{Expected, Ran, Recipe, RecipeKeys, Workshop, World};
use crate::failure::Failure;
use crate::run_directory::toml_table;
use crate::scene::world::{Materials, Place};
use crate::scene::{SiloScene, layers};
use crate::summary::{Figure, Quantity, Summary};
use crate::table::Table;
use beverloo::{Rate, fit};
use colluvium_dem::preparation::{Amount, Packing, Relaxation, Rest, solid_fraction};
use colluvium_dem::walls::Mesh;
use colluvium_dem::{Grain, Outlet, Region, Simulation, Snapshot, Wall};
use nalgebra::Vector3;
use std::f64::consts::{PI, TAU};
use std::sync::Arc;

/// Solid fraction at which grains are let fall.
const LOOSE: f64 = 0.25;
/// Solid fraction that a filling is expected to have.
const DENSE: f64 = 0.58;
/// Edges of the polygon that stands for an opening: its area is right to 1e-3.
const EDGES: usize = 96;
/// Room between two silos, in mean diameters.
const ROOM: f64 = 3.0;
/// Where fallen grains are taken out, in mean diameters below the floor.
const CATCH: f64 = 12.0;
/// Steps between two looks for them.
const CATCH_EVERY: u64 = 100;
/// A filling that is about to flow need not be quieter than this.
const QUIET: Rest = Rest {
    kinetic: 1e-4,
    unbalanced: 0.1,
};
/// Times √(H/g) that a cloud of height H takes to fall and settle, for the plan (measured: 3.0).
const SETTLING: f64 = 3.5;

/// One of the silos, all lengths in m.
#[derive(Clone, Copy, Debug)]
struct Vessel {
    axis: f64,
    radius: f64,
    opening: f64,
    grains: usize,
}

impl Vessel {
    fn holds(&self, x: f64) -> bool {
        (x - self.axis).abs() <= self.radius
    }
}

impl SiloScene {
    /// Mean diameter of the grains by number (m).
    fn diameter(&self, materials: &Materials) -> f64 {
        2.0 * materials.ingredients[0].sizes.mean()
    }

    fn depth(&self, materials: &Materials) -> f64 {
        self.scale * self.depth_diameters * self.diameter(materials)
    }

    fn vessels(&self, materials: &Materials) -> Vec<Vessel> {
        let d = self.diameter(materials);
        let grain = PI / 6.0 * d.powi(3);
        let mut edge = 0.0;
        let vessel = |&size: &f64| {
            let radius = 0.5 * self.scale * self.container_ratio * size * d;
            let axis = edge + radius;
            edge = axis + radius + ROOM * d;
            let volume = PI * radius * radius * self.depth(materials);
            Vessel {
                axis,
                radius,
                opening: size * d,
                grains: (DENSE * volume / grain).round().max(1.0) as usize,
            }
        };
        self.openings_diameters.iter().map(vessel).collect()
    }

    fn cloud(&self, materials: &Materials) -> f64 {
        // Grains lie whole in the cloud: its rim is emptier.
        1.2 * self.depth(materials) * DENSE / LOOSE
    }

    fn down(&self) -> Vector3<f64> {
        Vector3::new(0.0, 0.0, -self.gravity)
    }

    fn wall_material(&self, materials: &Materials, origin: &str) -> Result<u16, Failure> {
        let top = Place {
            origin,
            section: "",
        };
        Ok(match &self.wall_material {
            Some(name) => materials.number(name, "wall_material", top)?,
            None => 0,
        })
    }

    /// The tubes; their lower ends stand on the floor.
    fn tubes(&self, materials: &Materials, material: u16) -> Vec<(String, Wall)> {
        let height = 2.0 * self.cloud(materials);
        let tube = |(k, v): (usize, &Vessel)| {
            let middle = Vector3::new(v.axis, 0.0, 0.5 * height);
            let wall = Wall::tube(middle, Vector3::z(), v.radius, height);
            (format!("tube_{}", k + 1), wall.material(material))
        };
        self.vessels(materials)
            .iter()
            .enumerate()
            .map(tube)
            .collect()
    }

    /// The lower half of a filling, without the layer on the floor: where ρ_b is measured.
    fn lower_half(&self, packing: &Packing, vessel: &Vessel) -> Region {
        let inside = packing.grains.iter().filter(|g| vessel.holds(g.position.x));
        let (sum, count) = inside.fold((0.0, 0.0), |(s, n), g| (s + g.position.z, n + 1.0));
        let d = 2.0 * packing.grains.iter().map(|g| g.radius).fold(0.0, f64::max);
        let top = (1.2 * sum / count).max(2.0 * d);
        Region::All(vec![
            Region::Cylinder {
                point: Vector3::new(vessel.axis, 0.0, 0.0),
                axis: Vector3::z(),
                radius: vessel.radius,
            },
            Region::Block {
                lower: Vector3::new(vessel.axis - vessel.radius, -vessel.radius, d),
                upper: Vector3::new(vessel.axis + vessel.radius, vessel.radius, top),
            },
        ])
    }
}

/// A flat ring in the plane z = 0: a floor with a round hole with a sharp rim.
fn ring(axis: f64, inner: f64, outer: f64) -> Result<Wall, String> {
    let corner = |radius: f64, k: usize| {
        let (s, c) = (TAU * k as f64 / EDGES as f64).sin_cos();
        Vector3::new(axis + radius * c, radius * s, 0.0)
    };
    let vertices = (0..EDGES).flat_map(|k| [corner(inner, k), corner(outer, k)]);
    let triangles: Vec<[u32; 3]> = (0..EDGES as u32)
        .flat_map(|k| {
            let next = (k + 1) % EDGES as u32;
            let (a, b, c, d) = (2 * k, 2 * k + 1, 2 * next, 2 * next + 1);
            [[a, b, d], [a, d, c]]
        })
        .collect();
    let mesh = Mesh::new(vertices.collect(), &triangles);
    Ok(Wall::mesh(Arc::new(
        mesh.map_err(|error| error.to_string())?,
    )))
}

impl Recipe for SiloScene {
    fn about(&self) -> String {
        let sizes: Vec<String> = self.openings_diameters.iter().map(f64::to_string).collect();
        format!(
            "flat-bottomed silos that run out of openings of {} mean grain diameters, for {} s",
            sizes.join(", "),
            self.duration
        )
    }

    fn materials(&self, origin: &str) -> Result<Materials, Failure> {
        Ok(SiloScene::materials(self, origin)?)
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
        for later in ["duration", "packing", "output"] {
            keys.remove(later);
        }
        for step in ["seconds", "safety"] {
            layers::remove(&mut keys, &format!("timestep.{step}"));
        }
        Ok(Some(keys))
    }

    fn prepare(&self, shop: &mut Workshop, origin: &str) -> Result<(), Failure> {
        let material = self.wall_material(shop.materials, origin)?;
        let mut walls = self.tubes(shop.materials, material);
        let floor = Wall::plane(Vector3::zeros(), Vector3::z()).material(material);
        walls.push(("floor".into(), floor));
        let around = Surroundings {
            walls: walls.into_iter().map(|(_, wall)| wall).collect(),
            gravity: self.down(),
            ..Surroundings::none(shop.materials.laws.clone())
        };
        for vessel in self.vessels(shop.materials) {
            let cloud = Region::All(vec![
                Region::Cylinder {
                    point: Vector3::new(vessel.axis, 0.0, 0.0),
                    axis: Vector3::z(),
                    radius: vessel.radius,
                },
                Region::Block {
                    lower: Vector3::new(vessel.axis - vessel.radius, -vessel.radius, 0.0),
                    upper: Vector3::new(
                        vessel.axis + vessel.radius,
                        vessel.radius,
                        self.cloud(shop.materials),
                    ),
                },
            ]);
            shop.insert(cloud, Amount::Grains(vessel.grains), Vector3::zeros())?;
        }
        let rest = Relaxation {
            rest: QUIET,
            ..Relaxation::under(self.gravity)
        };
        shop.relax(&around, &rest)?;
        let first = self.vessels(shop.materials)[0];
        let lower = self.lower_half(&shop.packing, &first);
        shop.measure(&around, &lower, self.gravity).map(drop)
    }

    fn world(&self, _: &Packing, materials: &Materials, origin: &str) -> Result<World, Failure> {
        let material = self.wall_material(materials, origin)?;
        let d = self.diameter(materials);
        let mut walls = self.tubes(materials, material);
        for (k, v) in self.vessels(materials).iter().enumerate() {
            // Beyond the tube, so that no corner is open.
            let floor = ring(v.axis, 0.5 * v.opening, v.radius + 0.4 * ROOM * d);
            let floor = floor.map_err(|error| {
                Failure::Input(format!(
                    "{origin}: key `openings_diameters`: grains of {d} m leave no floor with such an opening: {error}"
                ))
            })?;
            walls.push((format!("floor_{}", k + 1), floor.material(material)));
        }
        let below = -CATCH * d;
        let everywhere = f64::INFINITY;
        Ok(World {
            gravity: self.down(),
            walls,
            outlet: Some(Outlet {
                keep: Region::Block {
                    lower: Vector3::new(-everywhere, -everywhere, below),
                    upper: Vector3::repeat(everywhere),
                },
                every: CATCH_EVERY,
            }),
            // Grains that fall out meet nothing any more.
            speed: (2.0 * self.gravity * CATCH * d).sqrt(),
            ..World::empty(self.duration)
        })
    }

    fn expected(&self, materials: &Materials) -> Expected {
        let grains: usize = self.vessels(materials).iter().map(|v| v.grains).sum();
        let around = Surroundings {
            gravity: self.down(),
            ..Surroundings::none(materials.laws.clone())
        };
        let steps = step_for(materials, &around, self.timestep.preparation)
            .map(|step| SETTLING * (self.cloud(materials) / self.gravity).sqrt() / step);
        Expected {
            grains: grains as f64,
            preparation: steps.map(|steps| steps * grains as f64),
            duration: self.duration,
        }
    }

    fn left_out(&self) -> Vec<&'static str> {
        vec![
            "air",
            "breakage of grains",
            "lids of the openings (they are gone at once)",
        ]
    }

    fn columns(&self) -> Vec<(String, &'static str)> {
        let vessels = 1..=self.openings_diameters.len();
        vessels.map(|k| (format!("mass_{k}"), "kg")).collect()
    }

    /// Mass that is still above the floor of each silo.
    fn look(&self, _: &mut Simulation, seen: &Snapshot, _: &[f64]) -> Vec<f64> {
        let Ok(materials) = SiloScene::materials(self, "") else {
            return vec![f64::NAN; self.openings_diameters.len()];
        };
        let vessels = self.vessels(&materials);
        let mut masses = vec![0.0; vessels.len()];
        for grain in seen.grains.iter().filter(|g| g.position.z > 0.0) {
            if let Some(k) = vessels.iter().position(|v| v.holds(grain.position.x)) {
                masses[k] += grain.mass;
            }
        }
        masses
    }

    fn conclude(&self, ran: &mut Ran, summary: &mut Summary) -> Result<Vec<Table>, Failure> {
        let materials = SiloScene::materials(self, "")?;
        let (d, vessels) = (self.diameter(&materials), self.vessels(&materials));
        let time = ran.history.column("t");
        let mut rates = Vec::new();
        let mut bulk = Vec::new();
        for (k, vessel) in vessels.iter().enumerate() {
            let mass = ran.history.column(&format!("mass_{}", k + 1));
            let region = self.lower_half(&ran.packing, vessel);
            let phi = solid_fraction(&ran.packing.grains, &ran.packing.domain, &region);
            let inside: Vec<&Grain> = ran
                .packing
                .grains
                .iter()
                .filter(|g| vessel.holds(g.position.x))
                .collect();
            let density = inside.iter().map(|g| g.density).sum::<f64>() / inside.len() as f64;
            bulk.push(phi * density);
            let unit = (vessel.opening / self.gravity).sqrt();
            match Rate::of(time, mass, 2.0 * unit) {
                Some(rate) => rates.push((vessel.opening, rate, phi * density)),
                None => summary.remarks.push(format!(
                    "The opening of {} diameters gives no rate: it clogged, or the silo ran out too soon.",
                    self.openings_diameters[k]
                )),
            }
        }
        let named = |size: f64| {
            format!("{:.3}", size / d)
                .trim_end_matches('0')
                .trim_end_matches('.')
                .replace('.', "_")
        };
        for (opening, rate, bulk) in &rates {
            let law = beverloo::rate(*opening, d, *bulk, self.gravity);
            let name = format!("rate_{}", named(*opening));
            let quantity = Quantity::new(rate.mean, "kg/s").with_error(rate.error);
            summary.put(
                &name,
                quantity.against(law, "Beverloo, C = 0.58, k = 1.4 (Nedderman 1992)"),
            );
            summary.put(
                &format!("{name}_drift"),
                Quantity::new(rate.drift, "1")
                    .from("second over first half of the discharge, less 1; 0 for Beverloo"),
            );
        }
        let mean_bulk = bulk.iter().sum::<f64>() / bulk.len() as f64;
        summary.put(
            "bulk_density",
            Quantity::new(mean_bulk, "kg/m³").from("at rest, lower half of the fillings"),
        );
        if let Some(found) = fit(&rates, d, self.gravity) {
            let source = "Nedderman 1992";
            summary.put(
                "k",
                Quantity::new(found.k, "1")
                    .with_error(found.k_error)
                    .against(1.4, source),
            );
            summary.put(
                "c",
                Quantity::new(found.c, "1")
                    .with_error(found.c_error)
                    .against(0.58, source),
            );
            summary.put(
                "exponent",
                Quantity::new(found.exponent, "1").against(2.5, "of D - 1.4 d, Beverloo"),
            );
            summary.put(
                "exponent_of_bare_opening",
                Quantity::new(found.bare, "1").from("of D itself: the control, it is not 5/2"),
            );
        }
        let openings: Vec<f64> = rates.iter().map(|(o, _, _)| *o).collect();
        let table = Table::new("rates")
            .with("opening", "m", openings.clone())
            .with(
                "opening_diameters",
                "d",
                openings.iter().map(|o| o / d).collect(),
            )
            .with(
                "rate",
                "kg/s",
                rates.iter().map(|(_, r, _)| r.mean).collect(),
            )
            .with(
                "rate_error",
                "kg/s",
                rates.iter().map(|(_, r, _)| r.error).collect(),
            )
            .with(
                "beverloo",
                "kg/s",
                rates
                    .iter()
                    .map(|(o, _, b)| beverloo::rate(*o, d, *b, self.gravity))
                    .collect(),
            );
        let columns: Vec<(String, String)> = self
            .openings_diameters
            .iter()
            .enumerate()
            .map(|(k, size)| (format!("mass_{}", k + 1), format!("{size} d")))
            .collect();
        let columns: Vec<(&str, &str)> = columns
            .iter()
            .map(|(a, b)| (a.as_str(), b.as_str()))
            .collect();
        summary.figures.push(Figure::history(
            "mass above the floor [kg]",
            &columns,
            "What is left in the silos: straight lines, whatever stands above.",
        ));
        summary.figures.push(Figure::Curves {
            table: "rates".into(),
            x: ["opening_diameters".into(), "opening D/d".into()],
            y_label: "rate [kg/s]".into(),
            y: vec![
                ["rate".into(), "grains".into()],
                ["beverloo".into(), "Beverloo, C = 0.58, k = 1.4".into()],
            ],
            log: true,
            caption: "Rates of discharge beside Beverloo's law.".into(),
        });
        Ok(vec![table])
    }

    fn compared(&self) -> Vec<&'static str> {
        vec!["k", "c", "exponent"]
    }
}
