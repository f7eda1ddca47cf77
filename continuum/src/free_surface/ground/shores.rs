//! The surface of matter where it meets ground inside a cell or beside it.
//!
//! The planes of matter and ground together ([`reconstruct`](crate::free_surface::fraction::reconstruct)) follow the ground
//! where it stands out of the matter. At such a *shore* the surface is the plane that holds what there is in its own cell
//! and misses the matter above ground least in the neighbours, in the sense of least squares (LVIRA, Pilliod & Puckett,
//! *J. Comput. Phys.* 199 (2004) 465, with what the ground takes up cut away):
//!
//! ```text
//! V(under the plane) − V(under the plane and under the ground).
//! ```
//!
//! Gauss's and Newton's method turns it from the best one of the planes at hand: those of the cell and of the cells beside it, and a level
//! one. Only the misses decide: a plane surface is found exactly, level or not, up to the last cell of the shore. Ground that bends within a
//! cell is taken piece by piece ([`Bend`](super::volumes::Bend)), so that this holds over any broken line and any triangles, on both
//! sides of a ridge within a cell as well. Where parts of a cell have no way to each other one fraction cannot tell how full each
//! is.
//!
//! It counts as far as it fits and as far as the matter is at rest, w between 0 and 1:
//!
//! ```text
//! w = [1 − v²/(0.01 g h)]₊ · f(sum of squares of the misses),
//! ```
//!
//! v the speed in the cell, h its size: beyond a dynamic pressure of half a per cent of ρ g h the surface stays that of matter
//! and ground. A front has no plane, and the best of bad fits differs from matter and ground at random: in fast matter
//! it drives fronts, and what is alike but for round-off parts. At rest pressures are those of depths. Both factors change
//! gently: one that falls within 10⁻³ cells makes differences grow in each step.

use super::fitted_planes::seen_from;
use super::{DUST, Ground};
use crate::free_surface::faces::ACTIVE;
use crate::free_surface::fraction::{EXACT, Neighbourhood};
use crate::free_surface::plane::Plane;
use crate::free_surface::topology::{NONE, Topology};

/// Times that planes are handed on from cell to cell: the shore cell itself is the second one from those whose
/// neighbours know nothing of it.
const PASSES: usize = 2;
/// Sums of squares of the misses, in cells: up to the first the plane counts wholly, beyond the second not at all.
const FITS: [f64; 2] = [1e-4, 1e-3];
/// Square of the speed, over g h, beyond which matter is not at rest.
const SLOW: f64 = 0.01;
/// How far from ground without an active cell above it shores are looked for, in cells: a layer half a cell thick ends within them on
/// slopes of 0.07 and more.
const REACH: usize = 8;
/// Less ground than this part of a cell does not stand out of matter.
pub(super) const STANDS_OUT: f64 = 1e-9;

/// Cells at a shore and the surface in them, in the order of the cells.
#[derive(Debug, Default)]
pub(crate) struct Shores {
    cells: Vec<Shore>,
    next: Vec<Shore>,
    /// Whether such ground lies within [`REACH`] of a cell with matter, and within one cell less.
    is_near: Vec<bool>,
    is_nearer: Vec<bool>,
}

/// How matter moves.
pub(crate) struct Motion<'a, const D: usize> {
    /// Velocities on faces.
    pub velocity: &'a [Vec<f64>; D],
    /// −g h along each axis: in cells' coordinates the way up, as long as the square of the speed of a fall through a cell.
    pub falls: [f64; D],
}

impl<const D: usize> Motion<'_, D> {
    /// How far a cell counts as at rest, by the mean square of the velocities on its faces, weighed by mass.
    fn rest(&self, topology: &Topology<D>, fractions: &[f64], cell: usize) -> f64 {
        let (mut mass, mut square) = (0.0, 0.0);
        for (axis, velocity) in self.velocity.iter().enumerate() {
            for face in topology.cell_faces[cell][axis] {
                if face != NONE {
                    let own = topology.face_mean(axis, face, fractions);
                    mass += own;
                    square += own * velocity[face] * velocity[face];
                }
            }
        }
        let unit = self.falls.iter().fold(0.0, |sum, fall| sum + fall.abs());
        let limit = SLOW * unit * mass;
        if square < limit {
            1.0 - square / limit
        } else {
            0.0
        }
    }
}

/// The surface in a cell.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Shore {
    cell: usize,
    /// The plane that fits best.
    pub fitted: Plane,
    /// How much it counts.
    pub weight: f64,
    /// The surface: that plane, that of matter and ground, or one between them.
    plane: Plane,
    /// How far the cell is at rest.
    rest: f64,
    /// Whether the plane of matter and ground misses nothing.
    is_exact: bool,
}

impl Shores {
    /// The surface in a cell, if it lies at a shore.
    pub(crate) fn plane(&self, cell: usize) -> Option<&Plane> {
        let shore = self.at(cell)?;
        (shore.weight > 0.0).then_some(&shore.plane)
    }

    /// The same and how far it is known.
    pub(crate) fn at(&self, cell: usize) -> Option<&Shore> {
        let at = self.cells.binary_search_by_key(&cell, |shore| shore.cell);
        Some(&self.cells[at.ok()?])
    }

    /// Finds them anew where matter is at rest; `planes` are those of matter and ground together.
    pub(crate) fn find<const D: usize>(
        &mut self,
        ground: &Ground<D>,
        topology: &Topology<D>,
        fractions: &[f64],
        planes: &[Option<Plane>],
        motion: &Motion<'_, D>,
    ) {
        self.cells.clear();
        self.mark(ground, topology, fractions, planes);
        for (cell, plane) in planes.iter().enumerate() {
            let Some(plane) = plane.filter(|_| fractions[cell] > DUST) else {
                continue;
            };
            let rest = motion.rest(topology, fractions, cell);
            if rest == 0.0 {
                continue;
            }
            if !self.is_near[cell] {
                continue;
            }
            let around = Neighbourhood::around(topology, fractions, cell);
            let miss = ground.miss(&around, &plane, FITS[1]);
            self.cells.push(Shore {
                cell,
                fitted: plane,
                weight: rest * fit(miss),
                plane,
                rest,
                is_exact: miss <= EXACT,
            });
        }
        let mut up = [0.0; 3];
        up[..D].copy_from_slice(&motion.falls);
        for pass in 0..PASSES {
            let is_first = pass == 0;
            self.next.clear();
            for shore in &self.cells {
                if shore.is_exact {
                    self.next.push(*shore);
                    continue;
                }
                let around = Neighbourhood::around(topology, fractions, shore.cell);
                let beside = (0..2 * D).filter_map(|way| {
                    let (axis, side) = (way / 2, way % 2);
                    let at = topology.cell_neighbours[shore.cell][axis][side];
                    if at == NONE {
                        return None;
                    }
                    let plane = self.plane(at).or(planes[at].as_ref())?;
                    let mut back = [0.0; 3];
                    back[axis] = if side == 1 { -1.0 } else { 1.0 };
                    Some(seen_from(plane, back))
                });
                let own = planes[shore.cell].unwrap_or(shore.plane);
                let level = is_first.then(|| ground.holding(shore.cell, up, around.fraction()));
                let at_hand = std::iter::once(shore.fitted).chain(beside).chain(level);
                let found = ground.shore(&around, &own, at_hand, shore.rest);
                self.next.push(found.unwrap_or(*shore));
            }
            std::mem::swap(&mut self.cells, &mut self.next);
        }
    }

    /// Notes which cells with a surface lie near ground that is dry, or nearly: an island may be narrower than a cell.
    fn mark<const D: usize>(
        &mut self,
        ground: &Ground<D>,
        topology: &Topology<D>,
        fractions: &[f64],
        planes: &[Option<Plane>],
    ) {
        let is_dry = |at: usize| {
            fractions[at] <= ACTIVE * ground.free[at]
                && ground.free[at] > 0.0
                && (ground.solid[at] > 0.0 || ground.wall[at] != [0.0; D])
        };
        let beside = |cell: usize, holds: &dyn Fn(usize) -> bool| {
            planes[cell].is_some() && Neighbourhood::around(topology, fractions, cell).any(holds)
        };
        self.is_near.clear();
        self.is_near
            .extend((0..planes.len()).map(|cell| beside(cell, &is_dry)));
        for _ in 1..REACH {
            std::mem::swap(&mut self.is_near, &mut self.is_nearer);
            let is_nearer = &self.is_nearer;
            self.is_near.clear();
            self.is_near
                .extend((0..planes.len()).map(|cell| beside(cell, &|at| is_nearer[at])));
        }
    }
}

/// How much a plane counts that misses by a sum of squares.
fn fit(miss: f64) -> f64 {
    ((FITS[1] - miss) / (FITS[1] - FITS[0])).clamp(0.0, 1.0)
}

impl<const D: usize> Ground<D> {
    /// The surface in a cell at rest so far, `own` the plane of matter and ground, if a plane fits and ground stands out of it.
    fn shore(
        &self,
        around: &Neighbourhood<'_, D>,
        own: &Plane,
        at_hand: impl Iterator<Item = Plane>,
        rest: f64,
    ) -> Option<Shore> {
        let (fitted, miss) = self.fitted_plane(around, at_hand)?;
        let weight = rest * fit(miss);
        let stands_out = |(cell, low, _): (usize, [f64; 3], f64)| {
            self.standing_out(cell, &seen_from(&fitted, low)) > STANDS_OUT
        };
        if weight == 0.0 || !around.places().any(stands_out) {
            return None;
        }
        let normal = std::array::from_fn(|axis| {
            weight * fitted.normal[axis] + (1.0 - weight) * own.normal[axis]
        });
        let is_turned_over = normal == [0.0; 3];
        let plane = if weight == 1.0 || is_turned_over {
            fitted
        } else {
            self.holding(around.cell(), normal, around.fraction())
        };
        Some(Shore {
            cell: around.cell(),
            fitted,
            weight,
            plane,
            rest,
            is_exact: false,
        })
    }

    /// Ground in a cell that stands out of a plane, in cells.
    pub(super) fn standing_out(&self, cell: usize, plane: &Plane) -> f64 {
        let all = plane.volume_in([0.0; 3], [1.0; 3]);
        self.solid[cell] - (all - self.matter_under(cell, plane))
    }
}
