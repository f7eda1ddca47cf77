//! Debris that changes hands as a whole: at an instant, grains become matter of a continuum.
//!
//! A slab of grains of width `w`, periodic across, becomes the section of a continuum of solid fraction `φ_s`. Where the
//! matter is, is decided by the grains' smoothed solid fraction, taken over what the ground leaves free,
//!
//! ```text
//! φ(x) = Σ_i V_i W(x - x_i) / (w ∫_free W(x - y) dy),    W(r) = (1 - r²/c²)²  for r < c
//! ```
//!
//! (a normalised convolution: without the integral matter would shrink from the ground). The places of largest φ are
//! filled until the area is `Σ V_i/(φ_s w)`, so the volume is exact and the outline is a level of φ. Velocities are the
//! grains' means, `u = Σ m_i v_i W/Σ m_i W`, and all of them are moved by one small velocity that makes the momentum that of
//! the grains. What is lost is what a continuum cannot hold: agitation about the mean and spin; it is reported.
//!
//! Debris may come in instalments: what comes later fills what matter and ground leave free ([`Debris::join`]).

use colluvium_continuum::column_collapse::{Collapse, Matter};
use colluvium_continuum::rheology::ShearLaw;
use colluvium_continuum::terrain::Profile;
use colluvium_dem::Grain;

mod joining;

/// Parts of a cell's edge on which φ is looked at.
const PARTS: usize = 4;
/// A cell is closed where ground leaves less of it than this.
const CLOSED: f64 = 1e-9;

/// What a hand-over cannot do.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum HandoverError {
    /// There is nothing to hand over.
    #[error("no grain is to become continuum")]
    Nothing,
    /// The grid has too little room about the grains.
    #[error(
        "the matter needs {needed:.4e} m² in section and finds room for {found:.4e} m² within the grid, around its grains"
    )]
    NoRoom {
        /// Area that the matter has (m²).
        needed: f64,
        /// Area found (m²).
        found: f64,
    },
}

/// The cells that matter may fill; SI units.
#[derive(Clone, Debug)]
pub struct Room<'a> {
    /// Lower corner of the grid in the coordinates of the grains (m).
    pub origin: [f64; 2],
    /// Edge of a cell (m).
    pub spacing: f64,
    /// Cells along x and z.
    pub counts: [usize; 2],
    /// Part of each cell that ground leaves free, x fastest.
    pub free: Vec<f64>,
    /// The ground in the coordinates of the grains.
    pub ground: &'a Profile,
}

impl<'a> Room<'a> {
    /// Of a continuum whose x is 0 at `low` (m) in the coordinates of the grains, in which `ground` is given, too.
    pub fn of<L: ShearLaw + Clone>(collapse: &Collapse<L>, low: f64, ground: &'a Profile) -> Self {
        let [x, z] = collapse.origin();
        let flow = collapse.flow();
        let counts = flow.grid().cell_counts();
        let cells = counts.iter().product();
        Self {
            origin: [low + x, z],
            spacing: collapse.spacing(),
            counts,
            free: flow
                .free_parts()
                .map_or_else(|| vec![1.0; cells], <[f64]>::to_vec),
            ground,
        }
    }

    /// Kinetic energy (J) of matter of which a whole cell weighs so much (kg), with velocities in m/s.
    pub fn kinetic(&self, fractions: &[f64], velocity: [&[f64]; 2], cell_mass: f64) -> f64 {
        let of = |c: usize| {
            let faces = velocity[c].iter().enumerate();
            faces.map(move |(face, u)| 0.5 * u * u * self.carried(c, face, fractions))
        };
        cell_mass * of(0).chain(of(1)).sum::<f64>()
    }

    /// Faces of a component: one more than cells along it.
    pub(crate) fn faces(&self, component: usize) -> [usize; 2] {
        let mut faces = self.counts;
        faces[component] += 1;
        faces
    }

    /// Middle of a face (m).
    pub(crate) fn face(&self, component: usize, index: [usize; 2]) -> [f64; 2] {
        std::array::from_fn(|a| {
            let within = if a == component { 0.0 } else { 0.5 };
            self.origin[a] + (index[a] as f64 + within) * self.spacing
        })
    }

    /// The two cells of a face, none beyond the edge.
    fn cells_of(&self, component: usize, index: [usize; 2]) -> [Option<usize>; 2] {
        let at = |[i, k]: [usize; 2]| i + self.counts[0] * k;
        let mut below = index;
        let low = index[component].checked_sub(1).map(|before| {
            below[component] = before;
            at(below)
        });
        let high = (index[component] < self.counts[component]).then(|| at(index));
        [low, high]
    }
}

/// Grains that become continuum.
#[derive(Clone, Copy, Debug)]
pub struct Debris<'a> {
    /// They themselves.
    pub grains: &'a [Grain],
    /// Solid fraction of the continuum.
    pub solid_fraction: f64,
    /// Density of its grains (kg/m³).
    pub grain_density: f64,
    /// Width of the slab (m).
    pub width: f64,
    /// Reach c of the smoothing (m).
    pub reach: f64,
}

/// How a hand-over went; SI units.
#[derive(Clone, Copy, Debug, PartialEq, Default)]
pub struct Handed {
    /// How many grains.
    pub grains: usize,
    /// Their mass (kg).
    pub mass: f64,
    /// Volume of the grains over φ_s, and that of the continuum (m³).
    pub volume: [f64; 2],
    /// Momentum along x and z of the grains, and of the continuum (kg m/s).
    pub momentum: [[f64; 2]; 2],
    /// Kinetic energy of the grains: translation along x and z, and the rest of it, across and of spin; and that of the
    /// continuum (J).
    pub kinetic: [f64; 3],
    /// By how much all velocities were moved to make the momentum that of the grains (m/s).
    pub moved: [f64; 2],
}

/// (1 − r²/c²)² within its reach.
pub(crate) fn kernel(square: f64, reach: f64) -> f64 {
    let q = 1.0 - square / (reach * reach);
    if q > 0.0 { q * q } else { 0.0 }
}

/// Numbers of the fine cells along an axis whose middles lie within a reach of a place.
pub(crate) fn around(
    place: f64,
    reach: f64,
    origin: f64,
    spacing: f64,
    count: usize,
) -> std::ops::Range<usize> {
    let at = |x: f64| ((x - origin) / spacing).clamp(0.0, count as f64) as usize;
    at(place - reach)..(at(place + reach) + 1).min(count)
}

impl Debris<'_> {
    /// Puts the debris into a room.
    ///
    /// # Errors
    /// If there is none, or no room for it.
    pub fn hand_over(&self, room: &Room) -> Result<(Matter, Handed), HandoverError> {
        if self.grains.is_empty() {
            return Err(HandoverError::Nothing);
        }
        let nothing = vec![0.0; room.free.len()];
        let (fractions, left) = self.fill(room, &nothing, self.area(), self.reach);
        if left > 0.0 {
            let needed = self.area();
            let found = needed - left;
            return Err(HandoverError::NoRoom { needed, found });
        }
        let mut velocity = [0, 1].map(|c| self.means(room, c, &fractions));
        let handed = self.settle(room, &fractions, &mut velocity);
        Ok((
            Matter {
                fractions,
                velocity,
            },
            handed,
        ))
    }

    /// Area that the debris takes in section (m²).
    fn area(&self) -> f64 {
        let volume: f64 = self.grains.iter().map(Grain::volume).sum();
        volume / (self.solid_fraction * self.width)
    }

    /// Fills the places of largest smoothed solid fraction, beside the parts of cells that are taken, until the area (m²) is
    /// there; says what is filled and what area is left over.
    fn fill(&self, room: &Room, taken: &[f64], needed: f64, reach: f64) -> (Vec<f64>, f64) {
        let h = room.spacing / PARTS as f64;
        let [columns, rows] = room.counts.map(|n| n * PARTS);
        let place = |i: usize, a: usize| room.origin[a] + (i as f64 + 0.5) * h;
        let cell_of = |i: usize, k: usize| i / PARTS + room.counts[0] * (k / PARTS);
        let is_free: Vec<bool> = (0..rows * columns)
            .map(|at| {
                let (i, k) = (at % columns, at / columns);
                let above = room
                    .ground
                    .height_at(place(i, 0))
                    .is_none_or(|z| place(k, 1) > z);
                above && room.free[cell_of(i, k)] - taken[cell_of(i, k)] > CLOSED
            })
            .collect();
        let mut dense = vec![0.0; rows * columns];
        let near = |x: f64, a: usize| around(x, reach, room.origin[a], h, [columns, rows][a]);
        for grain in self.grains {
            let [x, z] = [grain.position.x, grain.position.z];
            for k in near(z, 1) {
                for i in near(x, 0) {
                    let square = (place(i, 0) - x).powi(2) + (place(k, 1) - z).powi(2);
                    dense[i + columns * k] += grain.volume() * kernel(square, reach);
                }
            }
        }
        // Over what ground and matter leave free of the kernel.
        let mut candidates: Vec<(f64, usize)> = Vec::new();
        for at in (0..dense.len()).filter(|&at| dense[at] > 0.0 && is_free[at]) {
            let [x, z] = [place(at % columns, 0), place(at / columns, 1)];
            let mut whole = 0.0;
            for k in near(z, 1) {
                for i in near(x, 0) {
                    if is_free[i + columns * k] {
                        let square = (place(i, 0) - x).powi(2) + (place(k, 1) - z).powi(2);
                        let cell = cell_of(i, k);
                        let open = 1.0 - taken[cell] / room.free[cell];
                        whole += open * kernel(square, reach);
                    }
                }
            }
            candidates.push((dense[at] / whole, at));
        }
        candidates.sort_unstable_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
        let mut parts = vec![0_usize; room.free.len()];
        for at in (0..is_free.len()).filter(|&at| is_free[at]) {
            parts[cell_of(at % columns, at / columns)] += 1;
        }
        let mut fractions = vec![0.0; room.free.len()];
        let mut left = needed / (room.spacing * room.spacing);
        for (_, at) in candidates {
            let cell = cell_of(at % columns, at / columns);
            let part = (room.free[cell] - taken[cell]) / parts[cell] as f64;
            fractions[cell] += part.min(left);
            left -= part.min(left);
            if left <= 0.0 {
                break;
            }
        }
        (fractions, left.max(0.0) * room.spacing * room.spacing)
    }

    /// Mean velocity of the grains about each face of a component that matter touches; none at the edge and at closed cells.
    fn means(&self, room: &Room, component: usize, fractions: &[f64]) -> Vec<f64> {
        // Matter may lie a reach from the nearest grain, its faces half a cell farther.
        let reach = self.reach + room.spacing;
        let faces = room.faces(component);
        let count = faces[0] * faces[1];
        let (mut momentum, mut mass) = (vec![0.0; count], vec![0.0; count]);
        for grain in self.grains {
            let at = [grain.position.x, grain.position.z];
            let v = [grain.velocity.x, grain.velocity.z][component];
            let near = |a: usize| {
                let first = room.face(component, [0, 0])[a] - 0.5 * room.spacing;
                around(at[a], reach, first, room.spacing, faces[a])
            };
            for k in near(1) {
                for i in near(0) {
                    let place = room.face(component, [i, k]);
                    let square = (place[0] - at[0]).powi(2) + (place[1] - at[1]).powi(2);
                    let weight = grain.mass() * kernel(square, reach);
                    momentum[i + faces[0] * k] += weight * v;
                    mass[i + faces[0] * k] += weight;
                }
            }
        }
        (0..count)
            .map(|face| {
                let carries = room.carried(component, face, fractions) > 0.0;
                if carries && mass[face] > 0.0 {
                    momentum[face] / mass[face]
                } else {
                    0.0
                }
            })
            .collect()
    }

    /// Mass of a whole cell of the continuum (kg).
    fn cell_mass(&self, room: &Room) -> f64 {
        self.grain_density * self.solid_fraction * room.spacing * room.spacing * self.width
    }

    /// Makes the momentum that of the grains, and says how the hand-over went.
    fn settle(&self, room: &Room, fractions: &[f64], velocity: &mut [Vec<f64>; 2]) -> Handed {
        let area: f64 = fractions.iter().sum();
        let unit = self.cell_mass(room);
        let mut handed = Handed {
            grains: self.grains.len(),
            mass: self.grains.iter().map(Grain::mass).sum(),
            volume: [
                self.grains.iter().map(Grain::volume).sum::<f64>() / self.solid_fraction,
                area * room.spacing * room.spacing * self.width,
            ],
            ..Handed::default()
        };
        for (c, velocity) in velocity.iter_mut().enumerate() {
            let of = |g: &Grain| [g.velocity.x, g.velocity.z][c];
            let grains: f64 = self.grains.iter().map(|g| g.mass() * of(g)).sum();
            let loads: Vec<f64> = (0..velocity.len())
                .map(|face| unit * room.carried(c, face, fractions))
                .collect();
            let sum = |u: &[f64]| loads.iter().zip(u).map(|(m, u)| m * u).sum::<f64>();
            let carried: f64 = loads.iter().sum();
            // Matter of a single cell has no face of its own along an axis.
            let moved = if carried > 0.0 {
                (grains - sum(velocity)) / carried
            } else {
                0.0
            };
            for (u, load) in velocity.iter_mut().zip(&loads) {
                *u += if *load > 0.0 { moved } else { 0.0 };
            }
            handed.moved[c] = moved;
            handed.momentum[0][c] = grains;
            handed.momentum[1][c] = sum(velocity);
            let kinetic = self.grains.iter().map(|g| 0.5 * g.mass() * of(g).powi(2));
            handed.kinetic[0] += kinetic.sum::<f64>();
            let squares: Vec<f64> = velocity.iter().map(|u| 0.5 * u * u).collect();
            handed.kinetic[2] += sum(&squares);
        }
        let other = self.grains.iter().map(|g| {
            let spin = 0.4 * g.mass() * g.radius.powi(2) * g.spin.norm_squared();
            0.5 * (g.mass() * g.velocity.y.powi(2) + spin)
        });
        handed.kinetic[1] = other.sum();
        handed
    }
}

impl Room<'_> {
    /// Matter that a face carries, in whole cells: half of that of its two cells; none at the edge and beside closed cells.
    pub(crate) fn carried(&self, component: usize, face: usize, fractions: &[f64]) -> f64 {
        let along = self.faces(component)[0];
        match self.cells_of(component, [face % along, face / along]) {
            [Some(low), Some(high)] if self.free[low] > CLOSED && self.free[high] > CLOSED => {
                0.5 * (fractions[low] + fractions[high])
            }
            _ => 0.0,
        }
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)] // a test may panic
    use super::*;
    use nalgebra::Vector3;

    /// A lattice of grains over level ground, moving as a field says.
    pub(super) fn lattice(
        columns: usize,
        rows: usize,
        field: impl Fn(f64, f64) -> [f64; 2],
    ) -> Vec<Grain> {
        let mut grains = Vec::new();
        for k in 0..rows {
            for j in 0..4 {
                for i in 0..columns {
                    let (x, z) = (4.5 + i as f64, 0.5 + k as f64);
                    let [u, w] = field(x, z);
                    grains.push(Grain {
                        velocity: Vector3::new(u, 0.0, w),
                        ..Grain::at_rest(Vector3::new(x, 0.5 + j as f64, z), 0.5, 2.0)
                    });
                }
            }
        }
        grains
    }

    pub(super) fn level() -> Profile {
        Profile::new(vec![[-1.0, 0.0], [100.0, 0.0]]).unwrap()
    }

    /// Cells of edge 0.8 from below the ground at z = −0.8 on.
    pub(super) fn room(ground: &Profile) -> Room<'_> {
        let counts = [30, 20];
        Room {
            origin: [0.0, -0.8],
            spacing: 0.8,
            counts,
            free: (0..600).map(|at| f64::from(u8::from(at >= 30))).collect(),
            ground,
        }
    }

    pub(super) fn debris(grains: &[Grain]) -> Debris<'_> {
        Debris {
            grains,
            solid_fraction: std::f64::consts::PI / 6.0,
            grain_density: 2.0,
            width: 4.0,
            reach: 2.0,
        }
    }

    #[test]
    fn a_block_keeps_its_volume_its_place_and_its_motion() {
        let grains = lattice(12, 8, |_, _| [0.3, -0.2]);
        let ground = level();
        let room = room(&ground);
        let (matter, handed) = debris(&grains).hand_over(&room).unwrap();
        let area = 0.64 * matter.fractions.iter().sum::<f64>();
        assert!((area / 96.0 - 1.0).abs() < 1e-13, "{area}");
        assert!((handed.volume[0] / handed.volume[1] - 1.0).abs() < 1e-13);
        for c in 0..2 {
            let [grains, continuum] = [handed.momentum[0][c], handed.momentum[1][c]];
            assert!((grains / continuum - 1.0).abs() < 1e-12);
        }
        // In its place: the block 4..16 by 0..8, of which the corners are rounded.
        let mut off = 0.0;
        for k in 0..20 {
            for i in 0..30 {
                let (x, z) = (0.8 * i as f64, -0.8 + 0.8 * k as f64);
                let part =
                    |low: f64, from: f64, to: f64| ((low + 0.8).min(to) - low.max(from)).max(0.0);
                let exact = part(x, 4.0, 16.0) * part(z, 0.0, 8.0) / 0.64;
                off += 0.64 * (matter.fractions[i + 30 * k] - exact).abs();
                assert!(matter.fractions[i + 30 * k] <= room.free[i + 30 * k] + 1e-12);
            }
        }
        assert!(off / 96.0 < 0.03, "{off}");
        // All of one velocity; what the lowest faces lack is spread over all.
        let moving = matter.velocity[0].iter().filter(|u| **u != 0.0);
        let [least, most] = moving.fold([f64::INFINITY, 0.0], |[a, b], u| [u.min(a), u.max(b)]);
        assert!(
            (most - least).abs() < 1e-12 && (most - 0.3).abs() < 0.02,
            "{least} {most}"
        );
        assert!(handed.kinetic[2] / handed.kinetic[0] > 0.9);
    }

    /// Without the integral over what is free the matter would leave the ground.
    #[test]
    fn matter_lies_on_the_ground() {
        let grains = lattice(12, 8, |_, _| [0.0, 0.0]);
        let ground = level();
        let open = room(&ground);
        let (matter, _) = debris(&grains).hand_over(&open).unwrap();
        let lowest: f64 = matter.fractions[30..60].iter().sum();
        assert!((lowest * 0.8 - 12.0).abs() < 0.8, "{lowest}");
        // The same grains where nothing is below them: the lowest rows are rounded off.
        let deep = Profile::new(vec![[-1.0, -50.0], [100.0, -50.0]]).unwrap();
        let free = Room {
            free: vec![1.0; 600],
            ..room(&deep)
        };
        let (matter, _) = debris(&grains).hand_over(&free).unwrap();
        let below: f64 = matter.fractions[30..60].iter().sum();
        assert!(below < lowest - 0.5, "{below} {lowest}");
    }

    #[test]
    fn a_shear_is_handed_over_and_agitation_is_told_as_lost() {
        let grains = lattice(12, 8, |_, z| [0.1 * z, 0.0]);
        let ground = level();
        let room = room(&ground);
        let (matter, handed) = debris(&grains).hand_over(&room).unwrap();
        let column = 12;
        for k in 4..8 {
            let z = -0.8 + 0.8 * (k as f64 + 0.5);
            let u = matter.velocity[0][column + 31 * k];
            assert!((u - 0.1 * z).abs() < 0.03, "{z} {u}");
        }
        let kept = handed.kinetic[2] / handed.kinetic[0];
        let mut shaken = grains.clone();
        for (at, grain) in shaken.iter_mut().enumerate() {
            grain.velocity.z += if at % 2 == 0 { 0.5 } else { -0.5 };
            grain.spin.y = 1.0;
        }
        let (_, handed) = debris(&shaken).hand_over(&room).unwrap();
        assert!(handed.kinetic[2] / handed.kinetic[0] < kept - 0.2);
        assert!(handed.kinetic[1] > 0.0);
    }

    #[test]
    fn what_finds_no_room_is_refused() {
        let grains = lattice(12, 8, |_, _| [0.0, 0.0]);
        let ground = level();
        let tight = Room {
            counts: [30, 8],
            free: vec![1.0; 240],
            ..room(&ground)
        };
        let few = Debris {
            solid_fraction: 0.2,
            ..debris(&grains)
        };
        assert!(matches!(
            few.hand_over(&tight),
            Err(HandoverError::NoRoom { .. })
        ));
        let none = debris(&[]).hand_over(&tight);
        assert_eq!(none.unwrap_err(), HandoverError::Nothing);
    }
}
