//! Ground that cuts the cells of a staggered grid under a flow with a moving surface.
//!
//! What is free of ground is known exactly ([`Relief::cut`] on a grid of half the cell size): of each
//! part of a cell at one of its corners, of each face, and of the *edges* across each face, which reach from the
//! centre of one of its cells to that of the other: a segment in a plane, in space a rectangle across each of the
//! other two axes. Parts make up the cells, whose faces carry the flux, and the cells around the lines between
//! them, whose edges carry the shear:
//!
//! ```text
//! V ∂u/∂x = Σ ± A_f u_f,    V_c ∂u/∂z = Σ ± E_f u_f      (Gauss; the ground has no velocity),
//! ```
//!
//! with A_f the free area of a face, E_f that of an edge, V and V_c the free volumes. Each velocity sees
//! the same edge from both sides, so a uniform stress exerts no force on any, and a velocity that grows
//! in proportion to the distance from a plane wall has its exact gradient.
//!
//! The unknown of a face is the mean velocity over its edge (in space over that across the axis that the ground
//! leans to; where it leans to two, between them). The means over the face itself and over its edges are larger or
//! smaller in proportion to the distances of their centres from the ground ([`Ground::swell`]). A face
//! with less than half of its edge free has no unknown: it moves with the next one away from the ground,
//! in proportion to its distance. A cell without any unknown belongs to the pressure of a neighbour.
//!
//! Where matter slides on the ground it has the velocity next to it: differences take the harmonic mean of
//! their two free areas, a uniform motion along plane ground meets no stress, and Coulomb friction acts on
//! the ground's surface in each cell against the velocity along it.

pub(crate) mod contact;
mod cuts;
pub(crate) mod faces;
mod fitted_planes;
mod foot;
mod layers;
mod operators;
mod points;
pub(crate) mod settling;
pub(crate) mod shores;
mod transport;
mod volumes;

use serde::{Deserialize, Serialize};

use self::cuts::{Cuts, Sheet, centre_of, corner_of_face, lines_of, mean, near};
use self::volumes::Bend;
use super::operators::points_of;
use super::plane::Plane;
use super::topology::{NONE, Topology};
use crate::error::{Error, require};
use crate::grid::{Axis, Boundary, DIMENSIONS, Grid};
use crate::terrain::{Profile, Relief};
use crate::wall_friction::WallFriction;

/// What holds on the surface of ground, or on a wall.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Contact {
    /// Matter at the ground stands still.
    #[default]
    NoSlip,
    /// It slides once the ground bears all the shear stress it can.
    Coulomb(WallFriction),
    /// It slides freely.
    FreeSlip,
}

impl Contact {
    /// Whether matter at the ground has a velocity.
    pub(crate) fn slides(self) -> bool {
        self != Contact::NoSlip
    }

    /// The same on a wall of the grid, at rest.
    pub(crate) fn on_wall(self) -> Boundary {
        match self {
            Contact::NoSlip => Boundary::NoSlip { velocity: 0.0 },
            Contact::Coulomb(friction) => Boundary::CoulombWall {
                velocity: 0.0,
                friction,
            },
            Contact::FreeSlip => Boundary::FreeSlip,
        }
    }
}

/// Ground under a flow, in the units of its grid: under a [`Profile`] in a plane, under a
/// [`Surface`](crate::terrain::Surface) in space.
#[derive(Debug, Clone, PartialEq)]
pub struct Terrain<S = Profile, const D: usize = DIMENSIONS> {
    /// Its surface.
    pub shape: S,
    /// Position of the lower corner of the grid.
    pub origin: [f64; D],
    /// What holds on it.
    pub contact: Contact,
    /// Cells by which the ground rises along the last axis over the period of each other axis, if that is periodic.
    pub rise: [usize; D],
}

/// Cells with a smaller free part are ground: in a plane, and in space, where what is left at a corner is less and the
/// faces around it are still as wide.
const SMALLEST_CELL: [f64; 2] = [1e-3, 1e-5];
/// Cells that miss less of being free are.
const FULL: f64 = 1e-12;
/// Faces with a smaller free part are closed.
const SMALLEST_FACE: f64 = 1e-3;
/// Smallest free part of the edge of a face with an unknown.
const SMALLEST_EDGE: f64 = 0.5 - 1e-9;
/// Largest velocity on a face over that on its edge.
const LARGEST_SWELL: f64 = 3.0;
/// Less material than this in a cell is dust, which has no surface to be reckoned with.
pub(crate) const DUST: f64 = 1e-9;
/// Distances from the ground are at least this part of a cell.
const NEAREST: f64 = 1e-3;
/// Cells from the ground to the farthest face that others at it may follow.
const HOSTS: usize = 3;
/// Ways out of a cell that differ by less than this part are alike: then it goes with the cell above.
const ALIKE: f64 = 1e-9;

/// How ground cuts the cells and faces of a grid.
#[derive(Debug, Clone)]
pub(crate) struct Ground<const D: usize = DIMENSIONS> {
    pub contact: Contact,
    /// Part of each cell that is free of ground.
    pub free: Vec<f64>,
    /// The rest of it.
    pub solid: Vec<f64>,
    /// Surface of the ground in each cell that it cuts.
    pub planes: Vec<Option<Plane>>,
    /// Ground in cells within which its surface bends.
    bends: Vec<(usize, Bend)>,
    /// Free part of each part of a cell, in cells, cell by cell.
    parts_of_cells: Vec<f64>,
    /// Free part of each face.
    pub aperture: [Vec<f64>; D],
    /// Free part of the edges of each face, by the axis that they lie across.
    pub edge: [Vec<[f64; D]>; D],
    /// Distance from the ground of each face, by its own axis, and of its edges, by theirs.
    distance: [Vec<[f64; D]>; D],
    /// Distance from the ground at which the unknown of each face is the velocity.
    reference: [Vec<f64>; D],
    /// Whether a face may have an unknown.
    pub open: [Vec<bool>; D],
    /// The cell whose pressure a cell has; [`NONE`] in ground.
    pub master: Vec<usize>,
    /// Cells that belong to the pressure of each cell besides itself.
    pub parts: Vec<(usize, usize)>,
    /// ∫ n dA of the ground's surface in each cell, out of the ground.
    pub wall: Vec<[f64; D]>,
}

impl<const D: usize> Ground<D> {
    /// Matter and ground together in each cell, without dust.
    pub(crate) fn fill(&self, fractions: &[f64], filled: &mut Vec<f64>) {
        filled.clear();
        filled.extend(fractions.iter().zip(&self.solid).map(|(fraction, solid)| {
            if *fraction > DUST {
                fraction + solid
            } else {
                *solid
            }
        }));
    }

    /// Free part of a part of a cell, in cells.
    pub(crate) fn part(&self, cell: usize, corner: usize) -> f64 {
        self.parts_of_cells[cell * points_of(D) + corner]
    }

    /// The other cells that share the pressure of a cell.
    pub(crate) fn parts_of(&self, cell: usize) -> impl Iterator<Item = usize> + '_ {
        let first = self.parts.partition_point(|&(master, _)| master < cell);
        self.parts[first..]
            .iter()
            .take_while(move |&&(master, _)| master == cell)
            .map(|&(_, part)| part)
    }

    /// Whether the grid is free of it, so that it is no more than the floor below.
    pub(crate) fn lies_below(&self) -> bool {
        self.free.iter().all(|free| *free == 1.0)
    }

    pub(crate) fn new<S: Relief<D>>(
        grid: &Grid<D>,
        topology: &Topology<D>,
        terrain: &Terrain<S, D>,
    ) -> Result<Self, Error> {
        for axis in grid.axes() {
            require(
                *axis != Axis::Flat,
                "terrain",
                0.0,
                "a grid with cells along all axes",
            )?;
        }
        if let Contact::Coulomb(friction) = terrain.contact {
            friction.validate()?;
        }
        let lines = lines_of(grid, terrain.origin);
        let mut cuts = Cuts::of(grid, &lines, &terrain.shape)?;
        for cell in 0..topology.cells() {
            if cuts.of_cell(cell).iter().sum::<f64>() < SMALLEST_CELL[D - 2] {
                cuts.make_solid(topology, cell);
            }
        }
        let distance = terrain.shape.distances(&lines);
        let mut ground = Self::of_cuts(grid, terrain, &distance, topology, &cuts);
        // What no neighbour takes in is ground, which may close off others.
        loop {
            let closed: Vec<usize> = (0..topology.cells())
                .filter(|&cell| ground.master[cell] == NONE && ground.free[cell] > 0.0)
                .collect();
            if closed.is_empty() {
                break;
            }
            for cell in closed {
                cuts.make_solid(topology, cell);
            }
            ground = Self::of_cuts(grid, terrain, &distance, topology, &cuts);
        }
        for (cell, wall) in ground.wall.iter().enumerate() {
            let (solid, free) = (ground.solid[cell], ground.free[cell]);
            if solid > 0.0 && free > 0.0 && *wall != [0.0; D] {
                // In the coordinates of a cell, which need not be a cube.
                let mut normal = [0.0; 3];
                for (axis, n) in unit(*wall).into_iter().enumerate() {
                    normal[axis] = n * lines.spacing[axis];
                }
                ground.planes[cell] = Some(Plane::of_fraction(normal, solid));
            }
        }
        let pieces = terrain.shape.bends(&lines);
        let by_cell = pieces.chunk_by(|a, b| a.cell == b.cell);
        ground.bends = by_cell
            .filter(|pieces| {
                let cell = pieces[0].cell;
                ground.free[cell] > 0.0 && ground.solid[cell] > 0.0
            })
            .map(|pieces| (pieces[0].cell, Bend::of(pieces)))
            .collect();
        Ok(ground)
    }

    fn of_cuts<S>(
        grid: &Grid<D>,
        terrain: &Terrain<S, D>,
        distance: &impl Fn([f64; D]) -> f64,
        topology: &Topology<D>,
        cuts: &Cuts<D>,
    ) -> Self {
        let count = topology.cells();
        let free: Vec<f64> = (0..count)
            .map(|cell| match cuts.of_cell(cell).iter().sum::<f64>() {
                all if all > 1.0 - FULL => 1.0,
                part => part,
            })
            .collect();
        let mut ground = Self {
            contact: terrain.contact,
            solid: free.iter().map(|free| 1.0 - free).collect(),
            planes: vec![None; count],
            bends: Vec::new(),
            parts_of_cells: cuts.parts.clone(),
            aperture: std::array::from_fn(|_| Vec::new()),
            edge: std::array::from_fn(|_| Vec::new()),
            distance: std::array::from_fn(|_| Vec::new()),
            reference: std::array::from_fn(|_| Vec::new()),
            open: std::array::from_fn(|_| Vec::new()),
            master: vec![NONE; count],
            parts: Vec::new(),
            wall: cuts.wall.clone(),
            free,
        };
        let has_ground = |cell: usize| ground.free[cell] < 1.0 || ground.wall[cell] != [0.0; D];
        let is_near = near(topology, has_ground, HOSTS);
        let lines = lines_of(grid, terrain.origin);
        for c in 0..D {
            for face in 0..topology.faces(c) {
                let cells = topology.face_cells[c][face];
                let is_closed = cells
                    .iter()
                    .any(|&cell| cell == NONE || ground.free[cell] == 0.0);
                let (index, corner) = corner_of_face(grid, &lines, c, face);
                // Where rows close on themselves only to have neighbours, nothing passes.
                let (last, rise) = (D - 1, terrain.rise[c]);
                let is_seam = c < last
                    && rise > 0
                    && index[c] == 0
                    && index[last] + rise >= lines.cells[last];
                let normal = ground.normal_at(topology, c, face);
                let own = &cuts.faces[c][face];
                let part = mean::<D>(own, c);
                let mut edge = [0.0; D];
                let mut sheets = [[0.0; cuts::MOST_PARTS]; D];
                for across in (0..D).filter(|&across| across != c) {
                    sheets[across] = cuts.edge(topology, c, face, across);
                    edge[across] = mean::<D>(&sheets[across], across);
                }
                let is_whole =
                    part == 1.0 && (0..D).all(|across| across == c || edge[across] == 1.0);
                let distances = if cells.iter().any(|&cell| cell != NONE && is_near[cell]) {
                    let place = |across: usize, sheet: &Sheet| {
                        place_of(&lines, c, corner, across, sheet, normal)
                    };
                    let mut all = [distance(place(c, own)); D];
                    for across in (0..D).filter(|&across| across != c && !is_whole) {
                        all[across] = distance(place(across, &sheets[across]));
                    }
                    let nearest = lines.spacing.iter().fold(f64::INFINITY, |m, h| h.min(m));
                    all.map(|d| d.max(NEAREST * nearest))
                } else {
                    [lines.spacing[D - 1] * HOSTS as f64; D]
                };
                let weights = weights_of(c, normal);
                let weighted = |of: &[f64; D]| {
                    let parts = (0..D).filter(|&across| across != c);
                    parts.fold(0.0, |sum, across| sum + weights[across] * of[across])
                };
                let (centre, reference) = (weighted(&edge), weighted(&distances));
                let aperture = if is_closed || part < SMALLEST_FACE || is_seam {
                    0.0
                } else {
                    part
                };
                ground.aperture[c].push(aperture);
                // Where matter slides freely it has no velocity of its own beside a closed face.
                let is_beside = aperture == 0.0 && terrain.contact.slides();
                ground.edge[c].push(if is_beside { [0.0; D] } else { edge });
                ground.distance[c].push(distances);
                ground.reference[c].push(reference);
                let is_steady =
                    terrain.contact.slides() || distances[c] <= LARGEST_SWELL * reference;
                ground.open[c].push(aperture > 0.0 && is_steady && centre >= SMALLEST_EDGE);
            }
        }
        ground.join_cells(topology);
        ground
    }

    /// Gives cells without an unknown face of their own to the neighbour that they are most open to.
    fn join_cells(&mut self, topology: &Topology<D>) {
        let sides = || (0..D).flat_map(|axis| [(axis, 0), (axis, 1)]);
        let has_own = |cell: usize| {
            sides().any(|(axis, side)| {
                let face = topology.cell_faces[cell][axis][side];
                face != NONE && self.open[axis][face]
            })
        };
        let way =
            |cell: usize, axis: usize, side: usize| match topology.cell_faces[cell][axis][side] {
                NONE => 0.0,
                face => self.aperture[axis][face],
            };
        let mut next: Vec<usize> = vec![NONE; topology.cells()];
        for (cell, next) in next.iter_mut().enumerate() {
            if self.free[cell] == 0.0 {
                continue;
            }
            if has_own(cell) {
                *next = cell;
                continue;
            }
            let mut most = 0.0;
            for (axis, side) in sides() {
                if way(cell, axis, side) > most {
                    most = way(cell, axis, side);
                    *next = topology.cell_neighbours[cell][axis][side];
                }
            }
            // In space it goes up where that is as good, and where no one way out is the best: of two alike neither may be
            // preferred to its mirror image.
            let alike =
                sides().filter(|&(axis, side)| way(cell, axis, side) >= (1.0 - ALIKE) * most);
            let up = way(cell, D - 1, 1);
            if D > 2 && up > 0.0 && (up >= (1.0 - ALIKE) * most || alike.count() > 1) {
                *next = topology.cell_neighbours[cell][D - 1][1];
            }
        }
        for cell in 0..next.len() {
            let mut root = next[cell];
            // Two cells that point at each other have no root.
            for _ in 0..4 {
                root = if root == NONE { NONE } else { next[root] };
            }
            self.master[cell] = if root != NONE && next[root] == root {
                root
            } else {
                NONE
            };
            if self.master[cell] != NONE && self.master[cell] != cell {
                self.parts.push((self.master[cell], cell));
            }
        }
        self.parts.sort_unstable();
    }

    /// ∫ n dA of the ground's surface in the cells of a face.
    fn normal_at(&self, topology: &Topology<D>, component: usize, face: usize) -> [f64; D] {
        let mut normal = [0.0; D];
        for &cell in &topology.face_cells[component][face] {
            if cell != NONE {
                for (n, wall) in normal.iter_mut().zip(self.wall[cell]) {
                    *n += wall;
                }
            }
        }
        normal
    }

    /// Whether ground touches a face's surroundings, so that its velocity depends on its distance.
    pub(crate) fn touches(&self, topology: &Topology<D>, component: usize, face: usize) -> bool {
        let edge = &self.edge[component][face];
        self.aperture[component][face] < 1.0
            || (0..D).any(|across| across != component && edge[across] < 1.0)
            || topology.face_cells[component][face]
                .iter()
                .any(|&cell| cell != NONE && self.wall[cell] != [0.0; D])
    }

    /// Velocity on an open face, by its own axis, and on its edges, by theirs, over its unknown.
    pub(crate) fn swell(&self, component: usize, face: usize) -> [f64; D] {
        if self.contact.slides() {
            return [1.0; D];
        }
        let reference = self.reference[component][face];
        self.distance[component][face].map(|d| d / reference)
    }

    /// The same over the unknown of another face, which it follows.
    pub(crate) fn shares(&self, component: usize, face: usize, host: (usize, usize)) -> [f64; D] {
        if self.contact.slides() {
            return [1.0; D];
        }
        let far = self.reference[host.0][host.1];
        self.distance[component][face].map(|d| (d / far).min(1.0))
    }
}

/// A vector over its length.
pub(super) fn unit<const D: usize>(vector: [f64; D]) -> [f64; D] {
    let length = vector.iter().map(|x| x * x).sum::<f64>().sqrt();
    if length > 0.0 {
        vector.map(|x| x / length)
    } else {
        vector
    }
}

/// How the edges of a face count, by the axis that they lie across: by how much ground of a normal leans there.
fn weights_of<const D: usize>(component: usize, normal: [f64; D]) -> [f64; D] {
    let mut weights = normal.map(|n| n * n);
    weights[component] = 0.0;
    if weights.iter().all(|w| *w == 0.0) {
        weights = [1.0; D];
        weights[component] = 0.0;
    }
    let sum: f64 = weights.iter().sum();
    weights.map(|w| w / sum)
}

/// Centre of the free part of a face of a component, or of its edge across another axis.
fn place_of<const D: usize>(
    lines: &crate::terrain::GridLines<D>,
    component: usize,
    corner: [f64; D],
    across: usize,
    sheet: &Sheet,
    normal: [f64; D],
) -> [f64; D] {
    let mut centre = centre_of(sheet, across, normal);
    if across != component {
        // An edge lies half in one cell and half in the other, and in their middle.
        centre[across] = 0.5;
        centre[component] -= 0.5;
    }
    std::array::from_fn(|a| corner[a] + centre[a] * lines.spacing[a])
}
