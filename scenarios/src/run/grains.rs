//! A scene of grains of one's own.

use super::world::boulders::{boulders, size_index};
use super::world::fragments;
use super::world::steps::{self, Around};
use super::world::workshop::{Surroundings, open_space};
use super::world::{Expected, Ran, Recipe, RecipeKeys, Workshop, World};
use crate::failure::Failure;
use crate::run_directory::toml_table;
use crate::scene::world::{
    Materials, Place, PrepareKind, bodies, bond_rules, clumps, region, walls,
};
use crate::scene::{GrainsScene, layers};
use crate::summary::{Figure, Quantity, Summary};
use crate::table::Table;
use colluvium_dem::preparation::{Packing, solid_fraction};
use colluvium_dem::{BoxMotion, Region, Simulation};
use nalgebra::Vector3;

impl GrainsScene {
    fn around(&self, materials: &Materials, origin: &str) -> Result<Around, Failure> {
        let mut walls = walls(&self.walls, materials, origin)?;
        // Time begins when the grains are in place.
        walls
            .iter_mut()
            .for_each(|wall| wall.motion = colluvium_dem::Motion::Fixed);
        Ok(Around {
            walls,
            gravity: self.gravity.start(origin)?,
        })
    }
}

impl Recipe for GrainsScene {
    fn about(&self) -> String {
        format!("grains as the file says, for {} s", self.duration)
    }

    fn materials(&self, origin: &str) -> Result<Materials, Failure> {
        Ok(GrainsScene::materials(self, origin)?)
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

    /// All that decides a preparation; bonds, cracks and what happens afterwards do not.
    fn provenance(&self) -> Result<Option<toml::Table>, Failure> {
        if self.prepare.is_empty() {
            return Ok(None);
        }
        let mut keys = toml_table("the preparation", self)?;
        for later in [
            "duration", "packing", "velocity", "output", "bodies", "bonds", "cracks",
        ] {
            keys.remove(later);
        }
        for clump in self.clumps.keys() {
            if self.prepares(clump) {
                // What it is; those that come afterwards do not matter.
                for later in ["count", "within", "velocity"] {
                    layers::remove(&mut keys, &format!("clumps.{clump}.{later}"));
                }
            } else {
                layers::remove(&mut keys, &format!("clumps.{clump}"));
            }
        }
        if !self.clumps.keys().any(|clump| self.prepares(clump)) {
            keys.remove("clumps");
        }
        for step in ["seconds", "safety"] {
            layers::remove(&mut keys, &format!("timestep.{step}"));
        }
        // Walls stand while grains are put in place.
        for wall in self.walls.keys() {
            layers::remove(&mut keys, &format!("walls.{wall}.motion"));
        }
        Ok(Some(keys))
    }

    fn check_room(&self, materials: &Materials, origin: &str) -> Result<(), Failure> {
        let domain = match &self.boundaries {
            Some(boundaries) => boundaries.domain(origin)?,
            None => open_space(),
        };
        steps::check_room(&self.prepare, materials, (domain, self.seed), origin)
    }

    fn prepare(&self, shop: &mut Workshop, origin: &str) -> Result<(), Failure> {
        if let Some(boundaries) = &self.boundaries {
            shop.packing.domain = boundaries.domain(origin)?;
        }
        let around = self.around(shop.materials, origin)?;
        steps::prepare(shop, &self.prepare, &self.clumps, &around, origin)?;
        if shop.packing.grains.is_empty() {
            // Bodies alone.
            return Ok(());
        }
        let all = Surroundings {
            walls: around.walls.clone(),
            gravity: around.gravity,
            ..Surroundings::none(shop.materials.laws.clone())
        };
        let middle = shop.middle();
        shop.measure(&all, &middle, around.acceleration()).map(drop)
    }

    fn world(
        &self,
        packing: &Packing,
        materials: &Materials,
        origin: &str,
    ) -> Result<World, Failure> {
        let named = self.walls.keys().cloned();
        let mut world = World {
            gravity: self.gravity.start(origin)?,
            schedule: self.gravity.schedule(origin)?,
            sphere: self.gravity.sphere(),
            own_gravity: self.gravity.own(),
            walls: named.zip(walls(&self.walls, materials, origin)?).collect(),
            bodies: bodies(&self.bodies, materials, origin)?,
            bonds: bond_rules(&self.bonds, materials, origin)?,
            velocity: self.velocity.map(Vector3::from),
            ..World::empty(self.duration)
        };
        world.speed =
            self.velocity.map_or(0.0, |v| Vector3::from(v).norm()) + world.speed_of_bodies(packing);
        let domain = match &self.boundaries {
            Some(boundaries) => boundaries.domain(origin)?,
            None => packing.domain,
        };
        let place = (domain, packing.grains.as_slice());
        let clumps = clumps(&self.clumps, materials, place, self.seed, origin)?;
        world.grains = clumps.grains;
        world.clumps.clone_from(&packing.clumps);
        world.clumps.extend(clumps.clumps);
        for (name, crack) in &self.cracks {
            let section = format!("cracks.{name}.within");
            let at = Place {
                origin,
                section: &section,
            };
            world.cracks.push(region(&crack.within, at)?);
        }
        if let Some(boundaries) = &self.boundaries {
            // A jammed packing brings a box of its own.
            let jams = self.prepare.iter().any(|s| s.r#do == PrepareKind::Jam);
            world.domain = (!jams).then_some(boundaries.domain(origin)?);
            world.box_motion = boundaries.motion(origin)?;
            world.outlet = boundaries.outlet(origin)?;
        }
        Ok(world)
    }

    fn expected(&self, materials: &Materials) -> Expected {
        let mean = &materials.ingredients[0].sizes;
        let volume = 4.0 / 3.0 * std::f64::consts::PI * mean.mean().powi(3);
        let balls = |name: &String| self.clumps.get(name).map_or(1, |clump| clump.balls.len());
        let counts = self.prepare.iter().map(|step| match step.count {
            Some(count) => (count * step.clumps.as_ref().map_or(1, balls)) as f64,
            None if step.points.is_some() => step.points.as_ref().map_or(0, Vec::len) as f64,
            None => step.mass.map_or(f64::NAN, |m| {
                m / (materials.ingredients[0].density * volume)
            }),
        });
        let known: f64 = counts.filter(|n| n.is_finite()).sum();
        let members = self
            .clumps
            .values()
            .map(|c| c.count.unwrap_or(0) * c.balls.len());
        let known = known + members.sum::<usize>() as f64;
        Expected {
            grains: known,
            preparation: None,
            duration: self.duration,
        }
    }

    fn left_out(&self) -> Vec<&'static str> {
        let mut list = vec!["air", "breakage of grains"];
        let g = &self.gravity;
        if g.uniform == [0.0; 3] && g.schedule.is_none() && g.file.is_none() && g.sphere.is_none() {
            list.push("gravity from outside");
        }
        if g.own.is_none() {
            list.push("attraction of the grains by each other");
        }
        list
    }

    fn plan(&self) -> Vec<(String, String)> {
        let put = self.prepare.iter().filter_map(|step| {
            let (name, count) = (step.clumps.as_ref()?, step.count?);
            let balls = self.clumps.get(name)?.balls.len();
            let how = if step.r#do == PrepareKind::Pour {
                "poured"
            } else {
                "inserted"
            };
            let text = format!("{count} clumps {name} of {balls} balls {how} by the preparation");
            Some(("clumps".to_owned(), text))
        });
        put.collect()
    }

    fn groups(&self, simulation: &mut Simulation, _: &[f64]) -> Option<Vec<Option<usize>>> {
        (!self.bonds.is_empty()).then(|| fragments::by_bonds(simulation))
    }

    fn conclude(&self, ran: &mut Ran, summary: &mut Summary) -> Result<Vec<Table>, Failure> {
        let last = |name: &str| ran.history.column(name).last().copied().unwrap_or(f64::NAN);
        let kinetic = last("translation") + last("rotation");
        summary.put(
            "kinetic_energy",
            Quantity::new(kinetic, "J").from("at the end, translation and rotation"),
        );
        for axis in ["x", "y", "z"] {
            let name = format!("centre_of_mass_{axis}");
            let place = Quantity::new(last(axis), "m").from("of the free grains at the end");
            summary.put(&name, place);
        }
        for (body, name) in self.bodies.keys().enumerate() {
            let sample = ran.simulation.body(body);
            for (axis, x) in ["x", "y", "z"].into_iter().zip(sample.centre.iter()) {
                let place = Quantity::new(*x, "m").from("of its centre of mass at the end");
                summary.put(&format!("{name}_{axis}"), place);
            }
            let speed = Quantity::new(sample.velocity.norm(), "m/s").from("at the end");
            summary.put(&format!("{name}_speed"), speed);
            let spin = Quantity::new(sample.spin.norm(), "rad/s").from("at the end");
            summary.put(&format!("{name}_spin"), spin);
        }
        let domain = *ran.simulation.domain();
        if domain.periodic == [true; 3] && self.boundaries.as_ref().is_none_or(moves_not) {
            let grains = ran.simulation.grain_list();
            let solid = solid_fraction(&grains, &domain, &Region::Everywhere);
            summary.put(
                "solid_fraction",
                Quantity::new(solid, "1").from("of the box at the end"),
            );
        }
        summary.figures.push(Figure::history(
            "energy [J]",
            &[
                ("translation", "translation"),
                ("rotation", "rotation"),
                ("elastic", "elastic"),
            ],
            "Energies of the grains in time.",
        ));
        for name in self.bodies.keys() {
            let columns = ["x", "y", "z"].map(|axis| (format!("{name}_{axis}"), axis));
            let columns: Vec<(&str, &str)> =
                columns.iter().map(|(c, w)| (c.as_str(), *w)).collect();
            let text = format!("The centre of mass of the body {name} in time.");
            let figure = Figure::history(&format!("{name} [m]"), &columns, &text);
            summary.figures.push(figure);
        }
        if !self.bonds.is_empty() {
            let columns = [("bonds", "whole"), ("broken_bonds", "broken")];
            let figure =
                Figure::history("bonds", &columns, "Bonds that hold, and that have broken.");
            summary.figures.push(figure);
            return Ok(vec![put_boulders(ran, summary)]);
        }
        Ok(Vec::new())
    }

    fn compared(&self) -> Vec<&'static str> {
        vec!["kinetic_energy", "coordination", "centre_of_mass_z"]
    }
}

/// Boulders at the end: how many, the largest, the law of their sizes, and their table.
fn put_boulders(ran: &mut Ran, summary: &mut Summary) -> Table {
    // Of the volume of the grains alone: what is between them is the scene's own affair.
    let table = boulders(&ran.simulation.clusters(), 1.0);
    let diameters = table.column("diameter");
    summary.put(
        "boulders",
        Quantity::new(diameters.len() as f64, "1").from("of two grains and more, joined by bonds"),
    );
    let largest = diameters.first().copied().unwrap_or(f64::NAN);
    summary.put(
        "largest_boulder",
        Quantity::new(largest, "m").from("diameter of the ball of its grains' volume"),
    );
    let [index, error] = size_index(diameters);
    let source = "a of N(> D) ∝ D^-a by the largest likelihood (Hill 1975); null for fewer than ten boulders";
    summary.put(
        "boulder_size_index",
        Quantity::new(index, "1").with_error(error).from(source),
    );
    table
}

fn moves_not(boundaries: &crate::scene::world::BoundaryKeys) -> bool {
    boundaries
        .motion("")
        .is_ok_and(|motion| motion == BoxMotion::Rest)
}
