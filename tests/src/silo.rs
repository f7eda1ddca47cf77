//! Grains between walls: columns after Janssen, hoppers after Beverloo.
//!
//! Units d = m = g = 1; round grains with friction 0.5, ε = 0.5, k_n 2e4 m g/d.

use crate::{DENSITY, STIFFNESS, step};
use colluvium_dem::{
    ContactLaw, Domain, Grain, Hooke, Laws, Partner, Plane, Setup, SetupError, Simulation,
    Snapshot, TangentialSpring, Threads,
};
use nalgebra::Vector3;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// Round grains, ε = 0.5, by their coefficient of friction.
pub fn round(friction: f64) -> ContactLaw {
    ContactLaw::linear(
        Hooke::matched(STIFFNESS, 0.5),
        TangentialSpring::matched(2.0 / 7.0, 0.5, friction),
        None,
    )
}

/// A loose lattice over z = 0 in a box of that floor: radii uniform within 10 %, slow random motion.
fn loose(count: usize, [length, width]: [f64; 2], seed: u64) -> Vec<Grain> {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let spacing = 1.12;
    let (columns, lanes) = ((length / spacing) as usize, (width / spacing) as usize);
    let (dx, dy) = (length / columns as f64, width / lanes as f64);
    (0..count)
        .map(|k| {
            let (layer, at) = (k / (columns * lanes), k % (columns * lanes));
            let position = Vector3::new(
                ((at % columns) as f64 + 0.5) * dx,
                ((at / columns) as f64 + 0.5) * dy,
                (layer as f64 + 0.5) * spacing,
            );
            let radius = 0.45 + 0.1 * random.random::<f64>();
            Grain {
                velocity: Vector3::from_fn(|_, _| 0.5 * (2.0 * random.random::<f64>() - 1.0)),
                ..Grain::at_rest(position, radius, DENSITY)
            }
        })
        .collect()
}

/// A container of square section, closed by four planes and a floor of fixed grains.
#[derive(Clone, Copy, Debug)]
pub struct Column {
    /// Edge of the section (d).
    pub edge: f64,
    /// Grains.
    pub grains: usize,
    /// Friction of grains on the walls.
    pub wall_friction: f64,
    /// Speed at which the floor sinks (√(g d)): friction of the walls then points up everywhere.
    pub sinking: f64,
    /// Seed of the grains.
    pub seed: u64,
}

impl Column {
    /// Grains over the floor, falling.
    ///
    /// # Errors
    /// If the column cannot be set up.
    pub fn fill(&self) -> Result<Simulation, SetupError> {
        let edge = self.edge;
        let wall = |point: [f64; 2], normal: [f64; 2]| Plane {
            point: Vector3::new(point[0], point[1], 0.0),
            normal: Vector3::new(normal[0], normal[1], 0.0),
            material: 1,
        };
        let across = (edge / 0.9).round() as usize;
        let cell = edge / across as f64;
        let floor = (0..across * across).map(|k| {
            let at = Vector3::new(k % across, k / across, 0).map(|c| (c as f64 + 0.5) * cell);
            let position = Vector3::new(at.x, at.y, -0.5);
            Grain {
                fixed: true,
                velocity: Vector3::new(0.0, 0.0, -self.sinking),
                ..Grain::at_rest(position, 0.5, DENSITY)
            }
        });
        let grains: Vec<Grain> = floor
            .chain(loose(self.grains, [edge; 2], self.seed))
            .collect();
        let inner = round(0.5);
        Simulation::new(Setup {
            domain: Domain {
                lower: Vector3::new(0.0, 0.0, -1.0),
                upper: Vector3::new(edge, edge, 2.0 * self.grains as f64 / (edge * edge)),
                periodic: [false; 3],
            },
            gravity: Vector3::new(0.0, 0.0, -1.0),
            law: Laws {
                own: vec![inner, inner],
                pairs: vec![(0, 1, round(self.wall_friction))],
            },
            grains,
            planes: vec![
                wall([0.0, 0.0], [1.0, 0.0]),
                wall([edge, 0.0], [-1.0, 0.0]),
                wall([0.0, 0.0], [0.0, 1.0]),
                wall([0.0, edge], [0.0, -1.0]),
            ],
            timestep: step(),
            threads: Threads::Serial,
        })
    }
}

/// Loads of a column, sums over looks.
#[derive(Clone, Debug, Default)]
pub struct Loads {
    looks: f64,
    weight: f64,
    bottom: f64,
    /// By layers one grain thick, counted from the top grain's centre down: weight, what walls
    /// carry, and the walls' normal force.
    layers: Vec<[f64; 3]>,
}

impl Loads {
    /// Adds what a snapshot shows.
    pub fn look(&mut self, snapshot: &Snapshot) {
        self.looks += 1.0;
        let free = snapshot.grains.iter().filter(|g| !g.fixed);
        let top = free.clone().map(|g| g.position.z).fold(f64::MIN, f64::max);
        let layers = &mut self.layers;
        let mut add = |z: f64, what: usize, amount: f64| {
            let layer = (top - z) as usize;
            if layers.len() <= layer {
                layers.resize(layer + 1, [0.0; 3]);
            }
            layers[layer][what] += amount;
        };
        for g in free {
            self.weight += g.mass;
            add(g.position.z, 0, g.mass);
        }
        for c in &snapshot.contacts {
            let g = &snapshot.grains[c.grain];
            match c.partner {
                Partner::Plane(_) => {
                    add(g.position.z, 1, c.force.z);
                    add(g.position.z, 2, c.force.xy().norm());
                }
                Partner::Grain(other) => {
                    if g.fixed != snapshot.grains[other].fixed {
                        self.bottom += if g.fixed { -c.force.z } else { c.force.z };
                    }
                }
            }
        }
    }

    /// Weight of the grains, load of the floor, load of the walls.
    pub fn total(&self) -> [f64; 3] {
        let walls: f64 = self.layers.iter().map(|l| l[1]).sum();
        [self.weight, self.bottom, walls].map(|sum| sum / self.looks)
    }

    /// Load that passes through the bottom of each layer, the layer's weight, what its walls carry,
    /// and their normal force.
    pub fn profile(&self) -> Vec<[f64; 4]> {
        let mut load = 0.0;
        self.layers
            .iter()
            .map(|l| {
                load += (l[0] - l[1]) / self.looks;
                [
                    load,
                    l[0] / self.looks,
                    l[1] / self.looks,
                    l[2] / self.looks,
                ]
            })
            .collect()
    }
}

/// Shape of a hopper's opening.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Opening {
    /// All along y.
    Slot,
    /// Round.
    Hole,
}

/// A flat-bottomed hopper that fills itself: the box is periodic along z too, so that what falls
/// through the bottom comes back from above. The level stays, and the flow is as long as one likes.
/// A roof of fixed grains under the opening throws the stream aside: it would else fall on the very
/// place it came from and push the flow.
#[derive(Clone, Copy, Debug)]
pub struct Hopper {
    /// The opening.
    pub opening: Opening,
    /// Its width or diameter (d).
    pub size: f64,
    /// Floor (d).
    pub floor: [f64; 2],
    /// Grains.
    pub grains: usize,
    /// Seed of the grains.
    pub seed: u64,
}

impl Hopper {
    /// Grains above the bottom, falling.
    ///
    /// # Errors
    /// If the hopper cannot be set up.
    pub fn fill(&self) -> Result<Simulation, SetupError> {
        let [length, width] = self.floor;
        let grains = loose(self.grains, self.floor, self.seed);
        // Settled, at a solid fraction of 0.58.
        let level = self.grains as f64 / (length * width * 0.58 * DENSITY);
        let highest = grains.iter().map(|g| g.position.z).fold(0.0, f64::max);
        let height = (level + self.fall()).max(highest + self.fall());
        let setup = Setup {
            domain: Domain {
                lower: Vector3::new(-0.5 * length, -0.5 * width, -1.0),
                upper: Vector3::new(0.5 * length, 0.5 * width, height - 1.0),
                periodic: [true; 3],
            },
            gravity: Vector3::new(0.0, 0.0, -1.0),
            law: round(0.5).into(),
            grains: vec![],
            planes: vec![],
            timestep: step(),
            threads: Threads::Serial,
        };
        let shift = Vector3::new(0.5 * length, 0.5 * width, 0.0);
        let grains = grains.into_iter().map(|g| Grain {
            position: g.position - shift,
            ..g
        });
        Simulation::new(Setup {
            grains: self.bottom(height).chain(grains).collect(),
            ..setup
        })
    }

    /// Height from the bottom down to the surface that the stream falls on, roughly: room for the
    /// roof and for grains to roll off it.
    fn fall(&self) -> f64 {
        6.0 + 0.7 * self.size
    }

    /// Fixed grains: the bottom with its tops at z = 0 and the rim's surfaces at the opening's edge
    /// exactly, and the roof below, seen from the next image of the box.
    fn bottom(&self, height: f64) -> impl Iterator<Item = Grain> + use<> {
        let radius = 0.5;
        let [length, width] = self.floor;
        let mut places = Vec::new();
        let eaves = 0.5 * self.size + radius;
        // Two grains below the rim, as steep as grains need to run off.
        let roof = |away: f64| height - 3.0 - 1.2 * away;
        match self.opening {
            Opening::Slot => {
                let lanes = (width / 0.9).round() as usize;
                let room = length - 2.0 * eaves;
                let rows = (room / 0.9).ceil() as usize;
                let beams = (eaves / 0.9).ceil() as isize;
                let bottom = (0..=rows).map(|r| (eaves + room * r as f64 / rows as f64, -radius));
                let beams = (-beams..=beams).map(|b| (0.9 * b as f64, roof(0.9 * b.abs() as f64)));
                for (x, z) in bottom.chain(beams) {
                    for lane in 0..lanes {
                        let y = (lane as f64 + 0.5) * width / lanes as f64;
                        places.push(Vector3::new(x, y - 0.5 * width, z));
                    }
                }
            }
            Opening::Hole => {
                let mut circle = |ring: f64, z: f64| {
                    let around = (std::f64::consts::TAU * ring / 0.9).ceil().max(1.0);
                    for k in 0..around as usize {
                        let (s, c) = (std::f64::consts::TAU * k as f64 / around).sin_cos();
                        let (x, y) = (ring * c, ring * s);
                        if x.abs() < 0.5 * length && y.abs() < 0.5 * width {
                            places.push(Vector3::new(x, y, z));
                        }
                    }
                };
                let mut ring = 0.0;
                while ring < eaves + 0.9 {
                    circle(ring, roof(ring));
                    ring += 0.9;
                }
                let mut ring = eaves;
                while ring < 0.5 * length.hypot(width) + radius {
                    circle(ring, -radius);
                    ring += 0.9;
                }
            }
        }
        places.into_iter().map(move |position| Grain {
            fixed: true,
            ..Grain::at_rest(position, radius, DENSITY)
        })
    }
}
