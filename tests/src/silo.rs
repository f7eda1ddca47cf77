//! Grains between walls: columns after Janssen, hoppers after Beverloo.
//!
//! Units d = m = g = 1; round grains with friction 0.5, ε = 0.5.

use crate::DENSITY;
use colluvium_dem::{
    ContactLaw, Domain, Grain, GrainSample, Hooke, Laws, Partner, Setup, SetupError, Simulation,
    Snapshot, TangentialSpring, Threads, Wall, timestep,
};
use nalgebra::Vector3;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use std::f64::consts::TAU;

/// k_n d/(m g): grains overlap by a few thousandths of d under 20 d of others and at 4 √(g d).
const STIFFNESS: f64 = 1e4;

/// Contact time over 20.
fn step() -> f64 {
    timestep::step(1.0, STIFFNESS, 20.0)
}

/// Round grains, ε = 0.5, by their coefficient of friction.
pub fn round(friction: f64) -> ContactLaw {
    ContactLaw::linear(
        Hooke::matched(STIFFNESS, 0.5),
        TangentialSpring::matched(2.0 / 7.0, 0.5, friction),
        None,
    )
}

/// A loose lattice over z = 0 and a floor: radii uniform within 10 %, slow random motion.
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
        let wall = |point: [f64; 2], normal: [f64; 2]| {
            Wall::plane(
                Vector3::new(point[0], point[1], 0.0),
                Vector3::new(normal[0], normal[1], 0.0),
            )
            .material(1)
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
            walls: vec![
                wall([0.0, 0.0], [1.0, 0.0]),
                wall([edge, 0.0], [-1.0, 0.0]),
                wall([0.0, 0.0], [0.0, 1.0]),
                wall([0.0, edge], [0.0, -1.0]),
            ],
            bodies: Vec::new(),
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
                Partner::Wall(_) | Partner::Body(_) => {
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
    /// and their normal force; the last layers lie on the floor.
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

/// Janssen's law with what a column shows of its walls.
///
/// ```text
/// F(h) = w λ (1 - e^{-h/λ}),   λ = L/(4 K μ)       F load below h of grains, w their weight a length
/// ```
/// L edge of the section; K μ ratio of the walls' shear stress to the vertical stress.
#[derive(Clone, Copy, Debug)]
pub struct Janssen {
    /// K μ, measured on the walls.
    pub wall_ratio: f64,
    /// Shear force of the walls over their normal force.
    pub mobilised: f64,
    /// Bottom load by the law.
    pub bottom: f64,
    /// Root mean square deviation of the loads of all layers from the law, over the largest of them.
    pub deviation: f64,
}

impl Janssen {
    /// Measures the walls of a column and compares its loads.
    pub fn of(column: &Column, loads: &Loads) -> Janssen {
        let all = loads.profile();
        // Ends left out: loose grains on top, and the floor, which carries some of its layer's friction.
        let inner = &all[2..all.len() - 2];
        let sum = |f: &dyn Fn(&[f64; 4]) -> f64| inner.iter().map(f).sum::<f64>();
        let (load, weight, shear, normal) = (
            sum(&|l| l[0] - 0.5 * (l[1] - l[2])),
            sum(&|l| l[1]) / inner.len() as f64,
            sum(&|l| l[2]),
            sum(&|l| l[3]),
        );
        // A layer is 1 d: its walls' shear stress is shear/(4 L), its vertical stress load/L².
        let wall_ratio = shear / load * column.edge / 4.0;
        let length = column.edge / (4.0 * wall_ratio);
        let law = |height: f64| weight * length * (1.0 - (-height / length).exp());
        // Height by weight, so that a ragged top does not matter.
        let mut above = 0.0;
        let mut squares = 0.0;
        let mut largest: f64 = 0.0;
        for layer in &all {
            above += layer[1];
            squares += (layer[0] - law(above / weight)).powi(2);
            largest = largest.max(layer[0]);
        }
        Janssen {
            wall_ratio,
            mobilised: shear / normal,
            bottom: law(above / weight),
            deviation: (squares / all.len() as f64).sqrt() / largest,
        }
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

/// A flat-bottomed hopper, periodic sideways, of which grains fall freely.
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

/// Where fallen grains are caught (d).
const CATCH: f64 = -25.0;

impl Hopper {
    /// Fills the hopper over a time, with its opening open, and lets grains fall; when each of the next
    /// `count` grains passed the opening, to a twentieth of a time unit.
    ///
    /// # Errors
    /// If the hopper cannot be set up or its step is too long.
    pub fn discharge(&self, fill: f64, count: usize) -> Result<Vec<f64>, SetupError> {
        let [length, width] = self.floor;
        let shift = Vector3::new(0.5 * length, 0.5 * width, 0.0);
        let grains = loose(self.grains, self.floor, self.seed)
            .into_iter()
            .map(|g| Grain {
                position: g.position - shift,
                ..g
            });
        let mut simulation = Simulation::new(Setup {
            domain: Domain {
                lower: -shift + CATCH * Vector3::z(),
                upper: shift + self.grains as f64 * Vector3::z(),
                periodic: [true, true, false],
            },
            gravity: -Vector3::z(),
            law: round(0.5).into(),
            grains: self.bottom().chain(grains).collect(),
            walls: vec![],
            bodies: Vec::new(),
            timestep: step(),
            threads: Threads::Serial,
        })?;
        simulation.advance((fill / simulation.timestep()) as u64)?;
        let mut snapshot = Snapshot::default();
        let below = |snapshot: &Snapshot| {
            let fallen = |g: &&GrainSample| g.position.z < -1.0;
            snapshot.grains.iter().filter(fallen).count()
        };
        simulation.snapshot(&mut snapshot);
        let before = below(&snapshot);
        let start = simulation.time();
        let look = (0.05 / simulation.timestep()) as u64;
        let mut times = Vec::new();
        while times.len() < count && simulation.time() < start + 200.0 {
            simulation.advance(look)?;
            simulation.snapshot(&mut snapshot);
            let now = (below(&snapshot) - before).min(count);
            times.resize(now, simulation.time() - start);
            if snapshot
                .grains
                .iter()
                .any(|g| !g.fixed && g.position.z < CATCH)
            {
                // Held where they are, well below and apart from what still falls.
                simulation.fix(|g| g.position.z < CATCH)?;
            }
        }
        Ok(times)
    }

    /// Fixed grains with their tops at z = 0, the rim's surfaces at the opening's edge exactly.
    fn bottom(&self) -> impl Iterator<Item = Grain> + use<> {
        let radius = 0.5;
        let [length, width] = self.floor;
        let rim = 0.5 * self.size + radius;
        let mut places = Vec::new();
        match self.opening {
            Opening::Slot => {
                let lanes = (width / 0.9).round() as usize;
                let room = length - 2.0 * rim;
                let rows = (room / 0.9).ceil() as usize;
                for row in 0..=rows {
                    let x = rim + room * row as f64 / rows as f64;
                    for lane in 0..lanes {
                        let y = (lane as f64 + 0.5) * width / lanes as f64;
                        places.push([x, y - 0.5 * width]);
                    }
                }
            }
            Opening::Hole => {
                let mut ring = rim;
                while ring < 0.5 * length.hypot(width) + radius {
                    let around = (TAU * ring / 0.9).ceil();
                    for k in 0..around as usize {
                        let (s, c) = (TAU * k as f64 / around).sin_cos();
                        let (x, y) = (ring * c, ring * s);
                        if x.abs() < 0.5 * length && y.abs() < 0.5 * width {
                            places.push([x, y]);
                        }
                    }
                    ring += 0.9;
                }
            }
        }
        places.into_iter().map(move |[x, y]| Grain {
            fixed: true,
            ..Grain::at_rest(Vector3::new(x, y, -radius), radius, DENSITY)
        })
    }
}
