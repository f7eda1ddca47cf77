//! A cylinder of cometary material pulled to its breaking point.
//!
//! The sample is cut out of a ball of the material (`comet_ball.rs`). Its head is held in a truncated cone; grains of its lowest layer are pulled downwards by a force that rises in
//! steps, shared out by mass. The clamp feels the same force once the wave is through, until the sample
//! breaks: the strength is the largest mean force of a step on the clamp over the cross-section
//! (Kappel et al. 2020, §3.3).
//! The pull is given in units of Rumpf's estimate of the strength.

use super::comet_ball::{self, CometBall};
use super::world::fragments;
use super::world::workshop::Surroundings;
use super::world::{Course, Expected, Ran, Recipe, Workshop, World};
use crate::failure::Failure;
use crate::scene::world::{Materials, OutputKeys, Place, StepKeys};
use crate::scene::{ClampKind, LawKeys, MixKind, TensileScene, layers};
use crate::summary::{Figure, Quantity, Summary};
use crate::table::Table;
use colluvium_dem::preparation::{Packing, Relaxation, Rest};
use colluvium_dem::walls::{Ends, Frustum};
use colluvium_dem::{Load, Region, Side, Simulation, Snapshot, Wall};
use nalgebra::Vector3;
use std::f64::consts::PI;

/// Thickness of the layer that is pulled, and of the one that is gripped, in mean diameters.
const LAYER: f64 = 1.5;
/// The clamp's force has fallen below this share of its largest: the sample is broken.
const BROKEN: f64 = 0.5;
/// Weight that seats a sample in a wall, over its strength by Rumpf.
const SEATING: f64 = 0.01;
/// Damping of the seating, over √(g/d).
const SEATING_DAMPING: f64 = 10.0;

/// Strengths of 1–2 mm grains (Pa): Kappel et al. (2020, §4.3) give them for 10–20 mm and 0.2–0.4 mm, scaled
/// by 1/R; means of the two.
const KAPPEL: [(MixKind, f64); 3] = [
    (MixKind::Dust, 2.25),
    (MixKind::TwoToOne, 3.95),
    (MixKind::OneToOne, 4.65),
];

/// What the recipe remembers: a head, then the numbers of the grains that are pulled.
#[derive(Clone, Copy, Debug, Default)]
struct Memory {
    /// Stress applied now (Pa).
    applied: f64,
    /// Momentum that the clamp had taken at the last look (N s), and when (s).
    taken: f64,
    time: f64,
    /// Mean stress on the clamp since the look before (Pa).
    stress: f64,
    /// The largest so far, and the stress applied then (Pa).
    strength: f64,
    applied_then: f64,
    /// Looks in a row at which the clamp felt little.
    low: f64,
}

/// Looks in a row with little force on the clamp after which the sample counts as broken: waves pass.
const LOOKS: f64 = 3.0;

const HEAD: usize = 7;

impl Memory {
    fn read(state: &[f64]) -> Memory {
        match *state {
            [
                applied,
                taken,
                time,
                stress,
                strength,
                applied_then,
                low,
                ..,
            ] => Memory {
                applied,
                taken,
                time,
                stress,
                strength,
                applied_then,
                low,
            },
            _ => Memory::default(),
        }
    }

    /// Whether the sample has broken.
    fn is_over(&self) -> bool {
        self.low >= LOOKS
    }

    fn write(&self, state: &mut [f64]) {
        let head = [
            self.applied,
            self.taken,
            self.time,
            self.stress,
            self.strength,
            self.applied_then,
            self.low,
        ];
        state[..HEAD].copy_from_slice(&head);
    }
}

impl TensileScene {
    fn radius(&self) -> f64 {
        0.5 * self.sample.diameter
    }

    fn area(&self) -> f64 {
        PI * self.radius().powi(2)
    }

    /// Radius of the clamp at its top (m).
    fn top_radius(&self) -> f64 {
        self.radius() + self.clamp.height * self.clamp.angle_degrees.to_radians().tan()
    }

    fn ball(&self) -> CometBall<'_> {
        CometBall {
            material: &self.material,
            preparation: &self.preparation,
            contact: &self.contact,
            coarse_graining: self.coarse_graining,
            radius: self
                .radius()
                .hypot(0.5 * self.sample.height)
                .max(self.top_radius().hypot(0.5 * self.sample.height)),
        }
    }

    /// Rumpf's strength (Pa).
    fn rumpf(&self, materials: &Materials) -> f64 {
        self.ball().rumpf(materials)
    }

    /// The cone from its lower end.
    fn cone(&self, inset: f64) -> Region {
        let radii = [self.radius(), self.top_radius()].map(|r| (r - inset).max(0.0));
        Region::Frustum {
            point: Vector3::new(0.0, 0.0, self.sample.height - self.clamp.height),
            axis: Vector3::z(),
            length: self.clamp.height,
            radii,
        }
    }

    /// The sample: a cylinder with its head.
    fn shape(&self) -> Region {
        let body = Region::All(vec![
            Region::Cylinder {
                point: Vector3::zeros(),
                axis: Vector3::z(),
                radius: self.radius(),
            },
            Region::Block {
                lower: Vector3::new(f64::NEG_INFINITY, f64::NEG_INFINITY, 0.0),
                upper: Vector3::new(f64::INFINITY, f64::INFINITY, self.sample.height),
            },
        ]);
        Region::Any(vec![body, self.cone(0.0)])
    }

    /// Grains of the head that the clamp grips.
    fn gripped(&self, diameter: f64) -> Region {
        let slant = self.clamp.angle_degrees.to_radians().cos();
        Region::All(vec![
            self.cone(0.0),
            Region::Outside(Box::new(self.cone(LAYER * diameter / slant))),
        ])
    }

    fn wall(&self) -> Wall {
        let foot = Vector3::new(0.0, 0.0, self.sample.height - self.clamp.height);
        Wall::frustum(
            foot,
            Frustum {
                axis: Vector3::z(),
                // The side goes on above the sample, so that nothing touches its upper edge.
                height: 2.0 * self.clamp.height,
                radii: [self.radius(), 2.0 * self.top_radius() - self.radius()],
                ends: Ends::Open(Side::Inside),
            },
        )
    }

    /// Time between two steps of the pull (s).
    fn interval(&self) -> f64 {
        self.pull.step / self.pull.rate
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
            "a cylinder of {}, {} m x {} m, is pulled to its breaking point (Kappel et al. 2020, §3.3)",
            self.material.mix.words(),
            self.sample.diameter,
            self.sample.height
        )
    }

    fn materials(&self, origin: &str) -> Result<Materials, Failure> {
        Ok(TensileScene::materials(self, origin)?)
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
        Some(keys)
    }

    fn prepare(&self, shop: &mut Workshop, origin: &str) -> Result<(), Failure> {
        let middle = Vector3::new(0.0, 0.0, 0.5 * self.sample.height);
        self.ball().make(shop, middle, origin)?;
        let laws = shop.materials.laws.clone();
        let diameter = comet_ball::diameter(shop.materials);
        let relaxation = comet_ball::relaxation(shop.materials);
        shop.trim(&self.shape(), false)?;
        let mut around = Surroundings::none(laws);
        match self.clamp.kind {
            ClampKind::Gripped => {
                shop.glue(&self.gripped(diameter))?;
                shop.relax(&around, &relaxation)?;
            }
            ClampKind::Wall => {
                around.walls = vec![self.wall()];
                shop.relax(&around, &relaxation)?;
                let weight = SEATING * self.rumpf(shop.materials);
                let g = weight / (self.material.bulk_density * self.sample.height);
                around.gravity = Vector3::new(0.0, 0.0, -g);
                let seating = Relaxation {
                    damping: SEATING_DAMPING,
                    rest: Rest {
                        kinetic: 1e-8,
                        unbalanced: 1e9,
                    },
                    ..Relaxation::under(g)
                };
                shop.relax(&around, &seating)?;
            }
        }
        let middle = Region::All(vec![
            Region::Cylinder {
                point: Vector3::zeros(),
                axis: Vector3::z(),
                radius: 0.7 * self.radius(),
            },
            Region::Block {
                lower: Vector3::new(
                    f64::NEG_INFINITY,
                    f64::NEG_INFINITY,
                    0.2 * self.sample.height,
                ),
                upper: Vector3::new(f64::INFINITY, f64::INFINITY, 0.8 * self.sample.height),
            },
        ]);
        let acceleration = relaxation.acceleration;
        shop.measure(&around, &middle, acceleration).map(drop)
    }

    fn world(
        &self,
        _packing: &Packing,
        materials: &Materials,
        origin: &str,
    ) -> Result<World, Failure> {
        let mut world = World::empty(self.pull.limit / self.pull.rate);
        if self.clamp.kind == ClampKind::Wall {
            world.walls.push(("clamp".into(), self.wall()));
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
        let ball = self.ball();
        let sample = self.area() * self.sample.height + head;
        Expected {
            grains: ball.grains_in(sample, materials),
            preparation: None,
            duration: self.pull.limit / self.pull.rate,
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
                    "porosity {:.1} % from a bulk density of {} kg/m³; cut out of a ball of the material",
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
                    "on the lowest layer, by {} of Rumpf's strength every {:.3e} s, until the clamp feels less than {BROKEN} of its largest force",
                    self.pull.step,
                    self.interval()
                ),
            ),
        ]
    }

    fn steer_every(&self, timestep: f64) -> u64 {
        (self.interval() / timestep).round() as u64
    }

    fn steer(&self, simulation: &mut Simulation, state: &mut Vec<f64>) -> Result<Course, Failure> {
        let origin = "pull";
        let materials = TensileScene::materials(self, origin)?;
        if state.is_empty() {
            let layer = LAYER * comet_ball::diameter(&materials);
            let pulled = pulled(simulation, layer);
            if pulled.is_empty() {
                return Err(Failure::Run(
                    "no grains are left in the layer that is pulled".into(),
                ));
            }
            state.resize(HEAD, 0.0);
            state.extend(pulled.into_iter().map(f64::from));
        }
        let mut memory = Memory::read(state);
        let (time, taken) = (simulation.time(), -simulation.wall_impulse().z);
        if time > memory.time {
            memory.stress = (taken - memory.taken) / (time - memory.time) / self.area();
            if memory.stress > memory.strength {
                (memory.strength, memory.applied_then) = (memory.stress, memory.applied);
            }
        }
        (memory.taken, memory.time) = (taken, time);
        let step = self.pull.step * self.rumpf(&materials);
        // Early waves take the clamp's force up and down.
        let little = memory.stress < BROKEN * memory.strength && memory.strength > 3.0 * step;
        memory.low = if little { memory.low + 1.0 } else { 0.0 };
        memory.write(state);
        if memory.is_over() {
            return Ok(Course::Over);
        }
        memory.applied += step;
        memory.write(state);
        self.pull(simulation, state, memory.applied)?;
        Ok(Course::On)
    }

    fn columns(&self) -> Vec<(String, &'static str)> {
        vec![
            ("applied_stress".into(), "Pa"),
            ("clamp_stress".into(), "Pa"),
        ]
    }

    fn look(&self, _: &mut Simulation, _: &Snapshot, state: &[f64]) -> Vec<f64> {
        let memory = Memory::read(state);
        vec![memory.applied, memory.stress]
    }

    fn groups(&self, simulation: &mut Simulation, _: &[f64]) -> Option<Vec<Option<usize>>> {
        self.material
            .sintered
            .then(|| fragments::by_bonds(simulation))
    }

    fn conclude(&self, ran: &mut Ran, summary: &mut Summary) -> Result<Vec<Table>, Failure> {
        let materials = TensileScene::materials(self, "")?;
        let memory = Memory::read(&ran.state);
        let strength = Quantity::new(memory.strength, "Pa");
        summary.put(
            "strength",
            match self.reference() {
                Some(reference) => strength.against(
                    reference,
                    "largest mean stress on the clamp; Kappel et al. 2020, §4.3, scaled by 1/R",
                ),
                None => strength.from("largest mean stress on the clamp"),
            },
        );
        summary.put(
            "applied_stress_at_failure",
            Quantity::new(memory.applied_then, "Pa").from("pull over the cross-section"),
        );
        summary.put(
            "strength_over_rumpf",
            Quantity::new(memory.strength / self.rumpf(&materials), "1")
                .from("Rumpf 1962: 1.1 φ/(1-φ) F/d²"),
        );
        let held = ran.packing.grains.iter().filter(|g| g.fixed).count();
        let share = held as f64 / ran.packing.grains.len() as f64;
        summary.put(
            "held_share",
            Quantity::new(share, "1").from("parcels in the clamp's grip"),
        );
        if !memory.is_over() {
            summary.remarks.push(format!(
                "The sample did not break below {:.3} Pa: the strength is a lower bound.",
                memory.applied
            ));
        }
        summary.figures.push(Figure::history(
            "stress [Pa]",
            &[
                ("clamp_stress", "on the clamp"),
                ("applied_stress", "applied"),
            ],
            "Pull on the sample's bottom, and what reaches the clamp, over the cross-section.",
        ));
        Ok(Vec::new())
    }

    fn compared(&self) -> Vec<&'static str> {
        vec!["strength"]
    }
}

impl TensileScene {
    /// Shares a stress (Pa) out over the pulled grains by mass.
    fn pull(&self, simulation: &mut Simulation, state: &[f64], stress: f64) -> Result<(), Failure> {
        let pulled = &state[HEAD..];
        let grains = simulation.grain_list();
        let mass = |id: &f64| grains[*id as usize].mass();
        let whole: f64 = pulled.iter().map(mass).sum();
        let force = -stress * self.area() / whole;
        let load = |id: &f64| Load {
            grain: *id as u32,
            force: Vector3::new(0.0, 0.0, force * mass(id)),
            moment: Vector3::zeros(),
        };
        let loads: Vec<Load> = pulled.iter().map(load).collect();
        simulation
            .set_loads(&loads)
            .map_err(|error| Failure::Run(error.to_string()))
    }
}

/// Numbers of the free grains of the lowest layer of this thickness (m).
fn pulled(simulation: &mut Simulation, thickness: f64) -> Vec<u32> {
    let grains = simulation.grain_list();
    let lowest = grains
        .iter()
        .map(|g| g.position.z)
        .fold(f64::INFINITY, f64::min);
    let within =
        |(_, g): &(u32, &colluvium_dem::Grain)| !g.fixed && g.position.z <= lowest + thickness;
    let numbered = (0..).zip(&grains);
    numbered.filter(within).map(|(id, _)| id).collect()
}
