//! A plane continuum as the ground of grains: they rest on its surface and hit it, and it takes what they push.
//!
//! A grain of mass m that overlaps the surface by δ and nears it by u_n, u_t along it, bears
//!
//! ```text
//! F_n = max(0, m' ω² (δ − δ₀) + 2 ζ m' ω u_n),      F_t = min(μ F_n, m' ω |u_t|),      M = min(μ R F_n, ⅖ m R² ω |Ω|)
//! m' = m m_c/(m_c + Σ m)
//! ```
//!
//! against its motion. ω = 1/T with the time T between two exchanges: a grain that comes with speed u sinks by u T or little
//! more. m_c = Σ m_f W_f is the mass of the continuum that takes the push (below), Σ m that of all grains that press within its reach: as it takes each
//! exchange's impulse at its end, no spring may be stiffer than ω² times the lighter of both. A film carries nobody: a grain goes
//! through it to the ground below.
//! δ₀ is what the grain overlapped when its neighbours became continuum: it presses from there on, and grows out of it.
//!
//! The opposite impulse is spread over the faces of cells about the place of contact, by a kernel W,
//!
//! ```text
//! Δu_f = J W_f / Σ m_f W_f
//! ```
//!
//! so that its momentum is exact whatever cells hold, and thin ones are not thrown. What grains give across the plane, along y, and
//! their moments have no place in a plane continuum.

mod line;

pub use line::{Near, SurfaceLine};

use crate::handover::{Room, around, kernel};
use colluvium_dem::{GrainSample, Load};
use nalgebra::Vector3;
use std::collections::BTreeMap;

/// Reach of the kernel by which the continuum takes a push, in cells.
const SPREAD: f64 = 2.0;

/// How grains meet the surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SurfaceContact {
    /// ω (1/s).
    pub frequency: f64,
    /// ζ of the dashpot.
    pub damping: f64,
    /// μ, of sliding and rolling.
    pub friction: f64,
    /// Whether the continuum takes the opposite; without, momentum is lost.
    pub reacts: bool,
}

/// What has been exchanged; N s, along x and z, and m.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct SurfaceLedger {
    /// Impulse that grains got along x, y, z.
    pub given: [f64; 3],
    /// Momentum that the continuum's velocities took.
    pub taken: [f64; 2],
    /// Impulse that it has yet to take.
    pub pending: [f64; 2],
    /// Sum of the sizes of all impulses.
    pub size: f64,
    /// Largest share of its diameter that a grain sank beyond what it overlapped at an instalment.
    pub deepest: f64,
}

impl SurfaceLedger {
    /// What is missing between both sides, over the size of what was exchanged.
    pub fn residual(&self) -> f64 {
        let off = |c: usize, given: f64| (given + self.taken[c] + self.pending[c]).abs();
        let worst = off(0, self.given[0]).max(off(1, self.given[2]));
        if self.size > 0.0 {
            worst / self.size
        } else {
            0.0
        }
    }
}

/// The ground that a continuum is.
#[derive(Clone, Debug, PartialEq)]
pub struct DebrisGround {
    /// How grains meet it.
    pub contact: SurfaceContact,
    /// Its surface at the last exchange.
    pub line: SurfaceLine,
    /// Books.
    pub ledger: SurfaceLedger,
    /// δ₀ of grains, by number (m).
    embedded: BTreeMap<u32, f64>,
    /// Velocity that faces have yet to take (m/s).
    owed: [Vec<f64>; 2],
}

/// Numbers before the lists in a memory.
const HEAD: usize = 13;

/// Faces of a component with matter about a place (m): number, weight, and what they carry in whole cells.
fn weights<'a>(
    room: &'a Room<'_>,
    fractions: &'a [f64],
    c: usize,
    at: [f64; 2],
) -> impl Iterator<Item = (usize, f64, f64)> + 'a {
    let reach = SPREAD * room.spacing;
    let faces = room.faces(c);
    let near = move |a: usize| {
        let first = room.face(c, [0, 0])[a] - 0.5 * room.spacing;
        around(at[a], reach, first, room.spacing, faces[a])
    };
    let places = near(1).flat_map(move |k| near(0).map(move |i| [i, k]));
    places.filter_map(move |[i, k]| {
        let face = i + faces[0] * k;
        let load = room.carried(c, face, fractions);
        let place = room.face(c, [i, k]);
        let square = (place[0] - at[0]).powi(2) + (place[1] - at[1]).powi(2);
        (load > 0.0).then(|| (face, kernel(square, reach), load))
    })
}

impl DebrisGround {
    /// Of a surface, in a room.
    pub fn new(contact: SurfaceContact, line: SurfaceLine, room: &Room<'_>) -> Self {
        Self {
            contact,
            line,
            ledger: SurfaceLedger::default(),
            embedded: BTreeMap::new(),
            owed: [0, 1].map(|c| vec![0.0; room.faces(c).iter().product()]),
        }
    }

    /// How deep a grain is in the surface so much after the last exchange (s).
    fn overlap(&self, grain: &GrainSample, later: f64, spacing: f64) -> Option<(f64, Near)> {
        let at = [grain.position.x, grain.position.z];
        let near = self.line.near(at, grain.radius + 2.0 * spacing, later)?;
        let overlap = grain.radius - near.distance;
        (overlap > 0.0).then_some((overlap, near))
    }

    /// Takes another surface after an instalment: what free grains overlap of it now they press from here on.
    pub fn admit(&mut self, line: SurfaceLine, grains: &[GrainSample], spacing: f64) {
        self.line = line;
        self.embedded.clear();
        for grain in grains.iter().filter(|g| !g.fixed) {
            if let Some((overlap, _)) = self.overlap(grain, 0.0, spacing) {
                self.embedded.insert(grain.id, overlap);
            }
        }
    }

    /// Loads on free grains, given in the order of their numbers as they are held, so much after the last exchange (s), that are
    /// kept for a time (s); the continuum, of which a whole cell weighs so much (kg), owes the opposite.
    pub fn press(
        &mut self,
        grains: &[GrainSample],
        (room, fractions, cell_mass): (&Room<'_>, &[f64], f64),
        [later, kept]: [f64; 2],
    ) -> Vec<Load> {
        let SurfaceContact {
            frequency,
            damping,
            friction,
            reacts,
        } = self.contact;
        let mut loads = Vec::new();
        let mut touches: Vec<(&GrainSample, f64, Near)> = Vec::new();
        for grain in grains.iter().filter(|g| !g.fixed) {
            let found = self.overlap(grain, later, room.spacing);
            let before = self.embedded.get(&grain.id).copied().unwrap_or(0.0);
            let Some((overlap, near)) = found else {
                self.embedded.remove(&grain.id);
                continue;
            };
            if overlap <= before {
                self.embedded.insert(grain.id, overlap);
                continue;
            }
            touches.push((grain, overlap - before, near));
        }
        for &(grain, depth, near) in &touches {
            let normal = Vector3::new(near.normal[0], 0.0, near.normal[1]);
            let surface = Vector3::new(near.velocity[0], 0.0, near.velocity[1]);
            let arm = -grain.radius * normal;
            let v = grain.velocity - surface;
            let apart = v.dot(&normal);
            let slip = v - apart * normal + grain.spin.cross(&arm);
            let patch = self.patch(room, fractions, cell_mass, near.place);
            let beside = touches.iter().filter(|(_, _, other)| {
                let apart = [0, 1].map(|a| other.place[a] - near.place[a]);
                apart[0].hypot(apart[1]) < SPREAD * room.spacing
            });
            let pressing: f64 = beside.map(|(other, _, _)| other.mass).sum();
            if patch <= 0.0 {
                continue;
            }
            let m = grain.mass * patch / (patch + pressing);
            let push = m * frequency * (frequency * depth - 2.0 * damping * apart);
            let push = push.max(0.0);
            let limited = |most: f64, free: f64| if free > most { most / free } else { 1.0 };
            let drag = -m * frequency * slip;
            let drag = drag * limited(friction * push, drag.norm());
            let inertia = 0.4 * grain.mass * grain.radius.powi(2);
            let turn = -inertia * frequency * grain.spin;
            let turn = turn * limited(friction * grain.radius * push, turn.norm());
            let force = push * normal + drag;
            loads.push(Load {
                grain: grain.id,
                force,
                moment: arm.cross(&drag) + turn,
            });
            let impulse = kept * force;
            let ledger = &mut self.ledger;
            ledger.deepest = ledger.deepest.max(0.5 * depth / grain.radius);
            for (sum, part) in ledger.given.iter_mut().zip(impulse.iter()) {
                *sum += part;
            }
            ledger.size += impulse.norm();
            if reacts {
                self.owe(
                    room,
                    fractions,
                    cell_mass,
                    near.place,
                    [-impulse.x, -impulse.z],
                );
            }
        }
        loads
    }

    /// Mass Σ m_f W_f (kg) about a place (m) that takes what is pushed there: the less of both components.
    fn patch(&self, room: &Room<'_>, fractions: &[f64], cell_mass: f64, at: [f64; 2]) -> f64 {
        let of = |c: usize| -> f64 {
            let faces = weights(room, fractions, c, at);
            faces.map(|(_, weight, load)| weight * load).sum()
        };
        cell_mass * of(0).min(of(1))
    }

    /// Spreads an impulse (N s) over the faces about a place (m).
    fn owe(
        &mut self,
        room: &Room<'_>,
        fractions: &[f64],
        cell_mass: f64,
        at: [f64; 2],
        impulse: [f64; 2],
    ) {
        for (c, impulse) in impulse.into_iter().enumerate() {
            let faces = weights(room, fractions, c, at);
            let whole = cell_mass * faces.map(|(_, weight, load)| weight * load).sum::<f64>();
            // Where there is no mass nothing was pushed.
            if whole <= 0.0 {
                continue;
            }
            self.ledger.pending[c] += impulse;
            for (face, weight, _) in weights(room, fractions, c, at) {
                self.owed[c][face] += impulse * weight / whole;
            }
        }
    }

    /// Gives velocities (m/s) what they are owed, and books it by what the faces hold.
    pub fn deliver(
        &mut self,
        (room, fractions, cell_mass): (&Room<'_>, &[f64], f64),
        velocity: [&mut [f64]; 2],
    ) {
        self.ledger.pending = [0.0; 2];
        for (c, velocity) in velocity.into_iter().enumerate() {
            for (face, (u, owed)) in velocity.iter_mut().zip(&mut self.owed[c]).enumerate() {
                if *owed != 0.0 {
                    let mass = cell_mass * room.carried(c, face, fractions);
                    self.ledger.taken[c] += mass * *owed;
                    *u += std::mem::take(owed);
                }
            }
        }
    }

    /// Appends all that it goes on from.
    pub fn write(&self, memory: &mut Vec<f64>) {
        let (c, l) = (&self.contact, &self.ledger);
        let reacts = f64::from(u8::from(c.reacts));
        memory.extend([c.frequency, c.damping, c.friction, reacts]);
        memory.extend(l.given);
        memory.extend(l.taken);
        memory.extend(l.pending);
        memory.extend([l.size, l.deepest]);
        self.line.write(memory);
        memory.push(self.embedded.len() as f64);
        for (id, depth) in &self.embedded {
            memory.extend([f64::from(*id), *depth]);
        }
        for row in &self.owed {
            memory.push(row.len() as f64);
            memory.extend(row);
        }
    }

    /// Reads it from the front of a memory, and says what follows.
    pub fn read(memory: &[f64]) -> Option<(Self, &[f64])> {
        let (h, rest) = memory.split_first_chunk::<HEAD>()?;
        let (line, rest) = SurfaceLine::read(rest)?;
        let mut rest = rest;
        let mut take = |width: usize| {
            let (count, after) = rest.split_first()?;
            let (row, after) = after.split_at_checked(width * *count as usize)?;
            rest = after;
            Some(row.to_vec())
        };
        let embedded = take(2)?;
        let owed = [take(1)?, take(1)?];
        let ground = Self {
            contact: SurfaceContact {
                frequency: h[0],
                damping: h[1],
                friction: h[2],
                reacts: h[3] > 0.0,
            },
            line,
            ledger: SurfaceLedger {
                given: [h[4], h[5], h[6]],
                taken: [h[7], h[8]],
                pending: [h[9], h[10]],
                size: h[11],
                deepest: h[12],
            },
            embedded: embedded
                .as_chunks::<2>()
                .0
                .iter()
                .map(|[id, depth]| (*id as u32, *depth))
                .collect(),
            owed,
        };
        Some((ground, rest))
    }
}
