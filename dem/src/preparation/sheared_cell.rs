//! Grains of a cell that has been sheared to a steady state, to be tiled, turned and cut.
//!
//! The cell is a lattice of images a_k, with Lees and Edwards' offset in the last one, so that a contact across its boundary is a
//! contact of two of its images. A piece cut out of it keeps its contacts with their springs: vectors among them turn as the
//! piece does. Nothing is scaled.

use crate::grains::Grain;
use crate::patch::Patch;
use crate::simulation::Simulation;
use nalgebra::{Matrix3, Rotation3, Vector3};
use std::collections::BTreeMap;

/// A contact of a grain of the cell with an image of another.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ImageContact {
    /// Both grains.
    pub pair: [u32; 2],
    /// The image of the second, in cells along the lattice.
    pub image: [i32; 3],
}

/// A cell in steady shear, dv_x/dz > 0, at an instant (SI).
#[derive(Clone, Debug, PartialEq)]
pub struct ShearedCell {
    /// Vectors from a grain to its images.
    pub lattice: [Vector3<f64>; 3],
    /// Grains of one cell: velocities and spins against the mean flow γ̇ z and half of its rotation.
    pub grains: Vec<Grain>,
    /// Contacts that had a history.
    pub contacts: Vec<ImageContact>,
    /// The histories, one after the other.
    pub histories: Vec<f64>,
    /// How many vectors each of them begins with.
    pub vectors: usize,
    /// Rate of shear γ̇ (1/s).
    pub rate: f64,
    /// Pressure p, a third of the trace of the mean stress (Pa).
    pub pressure: f64,
    /// I = γ̇ d √(ρ_s/p).
    pub inertial: f64,
    /// |τ|/p.
    pub friction: f64,
    /// Solid fraction.
    pub solid_fraction: f64,
}

/// Numbers of a cell in front of its grains, of a grain, and of a contact without its history.
const HEAD: usize = 18;
const OF_GRAIN: usize = 12;
const OF_CONTACT: usize = 5;

impl ShearedCell {
    /// The cell of a simulation that is sheared along x, across z, at a rate (1/s), its grains taken out; or that rests, at 0.
    pub fn of(simulation: &mut Simulation, rate: f64) -> Self {
        let cell = simulation.cell();
        let lengths = cell.domain.lengths();
        let lattice = [
            lengths.x * Vector3::x(),
            lengths.y * Vector3::y(),
            Vector3::new(cell.drift.offset, 0.0, lengths.z),
        ];
        let vectors = simulation.layout.flips / 3;
        let mut patch = simulation.take_out(|_| true);
        for grain in &mut patch.grains {
            grain.velocity -= cell.stream(&grain.position);
            grain.spin.y -= 0.5 * rate;
            let home = grain.position - cell.domain.lower;
            grain.position = home - shift(&lattice, turns(&lattice, &home, f64::floor));
        }
        let place = |id: u32| patch.ids.binary_search(&id).unwrap_or_default();
        let contact = |ids: &[u32; 2]| {
            let pair = ids.map(place);
            let [a, b] = pair.map(|k| patch.grains[k].position);
            ImageContact {
                pair: pair.map(|k| k as u32),
                image: turns(&lattice, &(a - b), f64::round_ties_even),
            }
        };
        let solid: f64 = patch.grains.iter().map(Grain::volume).sum();
        Self {
            contacts: patch.pairs.iter().map(contact).collect(),
            histories: patch.histories,
            grains: patch.grains,
            lattice,
            vectors,
            rate,
            pressure: 0.0,
            inertial: 0.0,
            friction: 0.0,
            solid_fraction: solid / lengths.product(),
        }
    }

    /// A piece: the grains whose centres lie where `keep` says, out of the tiled cell turned by `frame` about `origin`,
    /// within a box of two corners. Numbers count from 0; velocities are those against the mean flow.
    pub fn cut(
        &self,
        frame: &Rotation3<f64>,
        origin: &Vector3<f64>,
        [low, high]: [Vector3<f64>; 2],
        mut keep: impl FnMut(&Vector3<f64>) -> bool,
    ) -> Patch {
        // Tiles that the turned box may meet.
        let (mut first, mut last) = ([i32::MAX; 3], [i32::MIN; 3]);
        let columns = Matrix3::from_columns(&self.lattice);
        let inverse = columns.try_inverse().unwrap_or_default();
        for corner in 0..8 {
            let at = Vector3::from_fn(|k, _| [low[k], high[k]][corner >> k & 1]);
            let turned = inverse * (frame.inverse() * (at - origin));
            for k in 0..3 {
                let tile = turned[k].floor() as i32;
                first[k] = first[k].min(tile);
                last[k] = last[k].max(tile);
            }
        }
        let mut patch = Patch::default();
        let mut numbers: BTreeMap<([i32; 3], u32), u32> = BTreeMap::new();
        for z in first[2]..=last[2] {
            for y in first[1]..=last[1] {
                for x in first[0]..=last[0] {
                    let tile = [x, y, z];
                    let by = shift(&self.lattice, tile);
                    for (number, grain) in self.grains.iter().enumerate() {
                        let position = origin + frame * (grain.position + by);
                        let in_box = (0..3).all(|k| (low[k]..=high[k]).contains(&position[k]));
                        if !in_box || !keep(&position) {
                            continue;
                        }
                        let id = patch.ids.len() as u32;
                        numbers.insert((tile, number as u32), id);
                        patch.ids.push(id);
                        patch.grains.push(Grain {
                            position,
                            velocity: frame * grain.velocity,
                            spin: frame * grain.spin,
                            ..*grain
                        });
                    }
                }
            }
        }
        let width = self.histories.len().checked_div(self.contacts.len());
        let width = width.unwrap_or(0);
        for (tile, number) in numbers.keys() {
            let of = self.contacts.partition_point(|c| c.pair[0] < *number);
            let own = self.contacts[of..].iter().enumerate();
            for (k, contact) in own.take_while(|(_, c)| c.pair[0] == *number) {
                let other: [i32; 3] = std::array::from_fn(|k| tile[k] + contact.image[k]);
                let ids = [(*tile, *number), (other, contact.pair[1])].map(|at| numbers.get(&at));
                let [Some(a), Some(b)] = ids else { continue };
                patch.pairs.push([*a, *b]);
                let row = &self.histories[(of + k) * width..(of + k + 1) * width];
                let (vectors, rest) = row.split_at(3 * self.vectors);
                for vector in vectors.as_chunks::<3>().0 {
                    let turned = frame * Vector3::from(*vector);
                    patch.histories.extend(turned.iter());
                }
                patch.histories.extend(rest);
            }
        }
        patch
    }

    /// All of it as numbers, for a file.
    pub fn numbers(&self) -> Vec<f64> {
        let (grains, contacts) = (self.grains.len(), self.contacts.len());
        let counts = [grains, contacts, self.histories.len(), self.vectors];
        let mut row: Vec<f64> = counts.iter().map(|n| *n as f64).collect();
        row.extend(self.lattice.iter().flat_map(|a| [a.x, a.y, a.z]));
        row.extend([self.rate, self.pressure, self.inertial, self.friction]);
        row.push(self.solid_fraction);
        for grain in &self.grains {
            for vector in [&grain.position, &grain.velocity, &grain.spin] {
                row.extend(vector.iter());
            }
            row.extend([grain.radius, grain.density, f64::from(grain.material)]);
        }
        for contact in &self.contacts {
            row.extend(contact.pair.map(f64::from));
            row.extend(contact.image.map(f64::from));
        }
        row.extend(&self.histories);
        row
    }

    /// From such numbers; none if they are none of a cell.
    pub fn of_numbers(numbers: &[f64]) -> Option<Self> {
        let (head, rest) = numbers.split_first_chunk::<HEAD>()?;
        let [grains, contacts, histories, vectors] = [0, 1, 2, 3].map(|k| head[k] as usize);
        let (rows, rest) = rest.split_at_checked(OF_GRAIN * grains)?;
        let (pairs, rest) = rest.split_at_checked(OF_CONTACT * contacts)?;
        let vector = |row: &[f64]| Vector3::new(row[0], row[1], row[2]);
        let grain = |row: &[f64; OF_GRAIN]| Grain {
            position: vector(&row[..3]),
            velocity: vector(&row[3..6]),
            spin: vector(&row[6..9]),
            material: row[11] as u16,
            ..Grain::at_rest(Vector3::zeros(), row[9], row[10])
        };
        let contact = |row: &[f64; OF_CONTACT]| ImageContact {
            pair: [row[0] as u32, row[1] as u32],
            image: [row[2] as i32, row[3] as i32, row[4] as i32],
        };
        let cell = Self {
            lattice: [4, 7, 10].map(|k| vector(&head[k..])),
            grains: rows.as_chunks().0.iter().map(grain).collect(),
            contacts: pairs.as_chunks().0.iter().map(contact).collect(),
            histories: rest.to_vec(),
            vectors,
            rate: head[13],
            pressure: head[14],
            inertial: head[15],
            friction: head[16],
            solid_fraction: head[17],
        };
        let ends = |c: &ImageContact| c.pair.iter().all(|k| (*k as usize) < grains);
        let fits = rest.len() == histories && cell.contacts.iter().all(ends);
        fits.then_some(cell)
    }
}

/// Cells along the lattice that a way is, rounded so; the last vector first, whose turns shift the others.
fn turns(lattice: &[Vector3<f64>; 3], way: &Vector3<f64>, round: impl Fn(f64) -> f64) -> [i32; 3] {
    let mut left = *way;
    let mut turns = [0; 3];
    for k in [2, 1, 0] {
        let n = round(left[k] / lattice[k][k]);
        left -= n * lattice[k];
        turns[k] = n as i32;
    }
    turns
}

fn shift(lattice: &[Vector3<f64>; 3], turns: [i32; 3]) -> Vector3<f64> {
    (0..3).map(|k| f64::from(turns[k]) * lattice[k]).sum()
}
