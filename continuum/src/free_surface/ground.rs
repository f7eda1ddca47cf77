//! Ground that cuts the cells of a staggered grid under a flow with a moving surface.
//!
//! What is free of ground is known exactly ([`Profile::cut`] on a grid of half the cell size): of each
//! quarter of a cell, of each face, and of the *edge* across each face, the segment between the centres
//! of its two cells. Quarters make up the cells, whose faces carry the flux, and the cells around the
//! corners, whose edges carry the shear:
//!
//! ```text
//! V ∂u/∂x = Σ ± A_f u_f,    V_c ∂u/∂z = Σ ± E_f u_f      (Gauss; the ground has no velocity),
//! ```
//!
//! with A_f the free area of a face, E_f that of its edge, V and V_c the free volumes. Each velocity sees
//! the same edge from both sides, so a uniform stress exerts no force on any, and a velocity that grows
//! in proportion to the distance from a plane wall has its exact gradient.
//!
//! The unknown of a face is the mean velocity over its edge. The mean over the face itself is larger or
//! smaller in proportion to the distances of their centres from the ground ([`Ground::swell`]). A face
//! with less than half of its edge free has no unknown: it moves with the next one away from the ground,
//! in proportion to its distance. A cell without any unknown belongs to the pressure of a neighbour.
//!
//! Where matter slides on the ground it has the velocity next to it: differences take the harmonic mean of
//! their two free areas, a uniform motion along plane ground meets no stress, and Coulomb friction acts on
//! the ground's surface in each cell against the velocity along it.

pub(crate) mod contact;
pub(crate) mod faces;
mod operators;
mod points;
mod transport;

use serde::{Deserialize, Serialize};

use super::operators::POINTS;
use super::plane::Plane;
use super::topology::{NONE, Topology};
use crate::error::{Error, require};
use crate::grid::{Axis, Boundary, DIMENSIONS, Grid};
use crate::terrain::{CutCells, GridLines, Profile};
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

/// Ground under a flow, in the units of its grid.
#[derive(Debug, Clone, PartialEq)]
pub struct Terrain {
    /// Its surface.
    pub profile: Profile,
    /// Position of the lower left corner of the grid.
    pub origin: [f64; DIMENSIONS],
    /// What holds on it.
    pub contact: Contact,
    /// Cells by which the ground rises over the period of a periodic axis x.
    pub rise: usize,
}

/// Cells with a smaller free part are ground.
const SMALLEST_CELL: f64 = 1e-3;
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
    /// Free part of each quarter of a cell, in cells.
    pub quarters: Vec<[f64; POINTS]>,
    /// Free part of each face.
    pub aperture: [Vec<f64>; D],
    /// Free part of the edge across each face.
    pub edge: [Vec<f64>; D],
    /// Distances of face and edge from the ground.
    distance: [Vec<[f64; 2]>; D],
    /// Whether a face may have an unknown.
    pub open: [Vec<bool>; D],
    /// The cell whose pressure a cell has; [`NONE`] in ground.
    pub master: Vec<usize>,
    /// Cells that belong to the pressure of each cell besides itself.
    pub parts: Vec<(usize, usize)>,
    /// ∫ n dA of the ground's surface in each cell, out of the ground.
    pub wall: Vec<[f64; D]>,
}

/// Halves of the faces and of the lines through the middles of cells that are free.
struct Halves {
    quarters: Vec<[f64; POINTS]>,
    /// For each component and face, its two halves.
    faces: [Vec<[f64; 2]>; DIMENSIONS],
    /// For each cell, the halves of the line across it that is normal to an axis.
    middles: Vec<[[f64; 2]; DIMENSIONS]>,
}

impl Halves {
    fn of(grid: &Grid, fine: &CutCells<2>) -> Self {
        let [columns, rows] = [grid.axes()[0].cells(), grid.axes()[1].cells()];
        let cells = (0..rows).flat_map(|k| (0..columns).map(move |i| [2 * i, 2 * k]));
        let quarters = cells.clone().map(|[i, k]| {
            std::array::from_fn(|q| 0.25 * fine.volume_fraction([i + q % 2, k + q / 2]))
        });
        let middles = cells.map(|[i, k]| {
            [
                [0, 1].map(|side| fine.aperture(0, [i + 1, k + side])),
                [0, 1].map(|side| fine.aperture(1, [i + side, k + 1])),
            ]
        });
        let faces = std::array::from_fn(|c| {
            let [width, height] = grid.faces(c);
            (0..width * height)
                .map(|face| {
                    let index = [2 * (face % width), 2 * (face / width)];
                    [0, 1].map(|side| {
                        let mut at = index;
                        at[1 - c] += side;
                        fine.aperture(c, at)
                    })
                })
                .collect()
        });
        Self {
            quarters: quarters.collect(),
            faces,
            middles: middles.collect(),
        }
    }

    /// The halves of the edge across a face, which lie in the cells on both sides of it.
    fn edge(&self, topology: &Topology, component: usize, face: usize) -> [f64; 2] {
        let [low, high] = topology.face_cells[component][face];
        let half = |cell: usize, side: usize| match cell {
            NONE => 0.0,
            cell => self.middles[cell][1 - component][side],
        };
        [half(low, 1), half(high, 0)]
    }

    fn make_solid(&mut self, topology: &Topology, cell: usize) {
        self.quarters[cell] = [0.0; POINTS];
        self.middles[cell] = [[0.0; 2]; DIMENSIONS];
        for (axis, pair) in topology.cell_faces[cell].iter().enumerate() {
            for &face in pair {
                self.faces[axis][face] = [0.0; 2];
            }
        }
    }
}

fn mean(halves: [f64; 2]) -> f64 {
    0.5 * (halves[0] + halves[1])
}

/// Where the centre of the free part of a segment lies, in its length from its low end.
fn centre_of(halves: [f64; 2]) -> f64 {
    let part = mean(halves);
    match halves[0] - halves[1] {
        more if more.abs() < 1e-12 => 0.5,
        more if more > 0.0 => 0.5 * part,
        _ => 1.0 - 0.5 * part,
    }
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

    /// The other cells that share the pressure of a cell.
    pub(crate) fn parts_of(&self, cell: usize) -> impl Iterator<Item = usize> + '_ {
        let first = self.parts.partition_point(|&(master, _)| master < cell);
        self.parts[first..]
            .iter()
            .take_while(move |&&(master, _)| master == cell)
            .map(|&(_, part)| part)
    }
}

impl Ground {
    pub(crate) fn new(grid: &Grid, topology: &Topology, terrain: &Terrain) -> Result<Self, Error> {
        for axis in grid.axes() {
            require(
                *axis != Axis::Flat,
                "terrain",
                0.0,
                "a grid with cells along both axes",
            )?;
        }
        if let Contact::Coulomb(friction) = terrain.contact {
            friction.validate()?;
        }
        let spacing = [0, 1].map(|axis| grid.axes()[axis].spacing());
        let cells = [0, 1].map(|axis| grid.axes()[axis].cells());
        let lines = GridLines {
            origin: terrain.origin,
            spacing,
            cells,
        };
        let whole = terrain.profile.cut(&lines)?;
        let fine = terrain.profile.cut(&GridLines {
            origin: terrain.origin,
            spacing: spacing.map(|h| 0.5 * h),
            cells: cells.map(|n| 2 * n),
        })?;
        let mut halves = Halves::of(grid, &fine);
        for cell in 0..topology.cells() {
            if halves.quarters[cell].iter().sum::<f64>() < SMALLEST_CELL {
                halves.make_solid(topology, cell);
            }
        }
        let mut ground = Self::of_halves(terrain, &lines, topology, &halves);
        // What no neighbour takes in is ground, which may close off others.
        loop {
            let closed: Vec<usize> = (0..topology.cells())
                .filter(|&cell| ground.master[cell] == NONE && ground.free[cell] > 0.0)
                .collect();
            if closed.is_empty() {
                break;
            }
            for cell in closed {
                halves.make_solid(topology, cell);
            }
            ground = Self::of_halves(terrain, &lines, topology, &halves);
        }
        let area = 1.0 / (spacing[0] * spacing[1]).sqrt();
        for cell in 0..topology.cells() {
            let index = [cell % cells[0], cell / cells[0]];
            if let Some(wall) = whole.wall(index) {
                ground.wall[cell] = wall.area_vector.map(|a| a * area);
                let [x, z] = wall.normal();
                if ground.solid[cell] > 0.0 && ground.free[cell] > 0.0 && (x, z) != (0.0, 0.0) {
                    // In the coordinates of a cell, which need not be a square.
                    let normal = [x * spacing[0], z * spacing[1], 0.0];
                    ground.planes[cell] = Some(Plane::of_fraction(normal, ground.solid[cell]));
                }
            }
        }
        Ok(ground)
    }

    fn of_halves(
        terrain: &Terrain,
        lines: &GridLines<2>,
        topology: &Topology,
        halves: &Halves,
    ) -> Self {
        let count = topology.cells();
        let free: Vec<f64> = halves
            .quarters
            .iter()
            .map(|quarters| match quarters.iter().sum::<f64>() {
                all if all > 1.0 - SMALLEST_CELL * 1e-9 => 1.0,
                part => part,
            })
            .collect();
        let mut ground = Self {
            contact: terrain.contact,
            solid: free.iter().map(|free| 1.0 - free).collect(),
            planes: vec![None; count],
            quarters: halves.quarters.clone(),
            aperture: Default::default(),
            edge: Default::default(),
            distance: Default::default(),
            open: Default::default(),
            master: vec![NONE; count],
            parts: Vec::new(),
            wall: vec![[0.0; DIMENSIONS]; count],
            free,
        };
        for c in 0..DIMENSIONS {
            let along = 1 - c;
            let width = lines.cells[0] + usize::from(c == 0 && topology.faces(0) > count);
            let closed = |face: usize| {
                let cells = topology.face_cells[c][face];
                cells
                    .iter()
                    .any(|&cell| cell == NONE || ground.free[cell] == 0.0)
            };
            for face in 0..topology.faces(c) {
                let own = halves.faces[c][face];
                let edge = halves.edge(topology, c, face);
                let part = mean(own);
                // Where rows close on themselves only to have neighbours, nothing passes.
                let is_seam =
                    c == 0 && face % width == 0 && face / width + terrain.rise >= lines.cells[1];
                let aperture =
                    if closed(face) || part < SMALLEST_FACE || (is_seam && terrain.rise > 0) {
                        0.0
                    } else {
                        part
                    };
                // The lower end of the face, and the middle of its edge.
                let corner = [0, 1].map(|a| {
                    lines.origin[a] + [face % width, face / width][a] as f64 * lines.spacing[a]
                });
                let mut at = corner;
                at[along] += centre_of(own) * lines.spacing[along];
                let mut across = corner;
                across[along] += 0.5 * lines.spacing[along];
                across[c] += (centre_of(edge) - 0.5) * lines.spacing[c];
                let distances = if part == 1.0 && mean(edge) == 1.0 {
                    [terrain.profile.distance(at); 2]
                } else {
                    [at, across].map(|point| terrain.profile.distance(point))
                };
                let nearest = NEAREST * lines.spacing[along];
                let distances = distances.map(|d| d.max(nearest));
                ground.aperture[c].push(aperture);
                // Where matter slides freely it has no velocity of its own beside a closed face.
                let is_beside = aperture == 0.0 && terrain.contact.slides();
                ground.edge[c].push(if is_beside { 0.0 } else { mean(edge) });
                ground.distance[c].push(distances);
                let is_steady =
                    terrain.contact.slides() || distances[0] <= LARGEST_SWELL * distances[1];
                ground.open[c].push(aperture > 0.0 && is_steady && mean(edge) >= SMALLEST_EDGE);
            }
        }
        ground.join_cells(topology);
        ground
    }

    /// Gives cells without an unknown face of their own to the neighbour that they are most open to.
    fn join_cells(&mut self, topology: &Topology) {
        let faces_of = |cell: usize| {
            (0..DIMENSIONS).flat_map(move |axis| {
                [0, 1]
                    .map(|side| (axis, side))
                    .map(move |(a, s)| (a, s, cell))
            })
        };
        let has_own = |cell: usize| {
            faces_of(cell).any(|(axis, side, cell)| {
                let face = topology.cell_faces[cell][axis][side];
                face != NONE && self.open[axis][face]
            })
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
            for (axis, side, cell) in faces_of(cell) {
                let face = topology.cell_faces[cell][axis][side];
                if face != NONE && self.aperture[axis][face] > most {
                    most = self.aperture[axis][face];
                    *next = topology.cell_neighbours[cell][axis][side];
                }
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

    /// Whether ground touches a face's surroundings, so that its velocity depends on its distance.
    pub(crate) fn touches(&self, topology: &Topology, component: usize, face: usize) -> bool {
        self.aperture[component][face] < 1.0
            || self.edge[component][face] < 1.0
            || topology.face_cells[component][face]
                .iter()
                .any(|&cell| cell != NONE && self.wall[cell] != [0.0; DIMENSIONS])
    }

    /// Velocity on an open face over that on its edge.
    pub(crate) fn swell(&self, component: usize, face: usize) -> f64 {
        if self.contact.slides() {
            return 1.0;
        }
        let [own, edge] = self.distance[component][face];
        own / edge
    }

    /// Velocities on a face and on its edge over that on the edge of another one, which it follows.
    pub(crate) fn shares(&self, component: usize, face: usize, host: (usize, usize)) -> [f64; 2] {
        if self.contact.slides() {
            return [1.0; 2];
        }
        let [_, far] = self.distance[host.0][host.1];
        self.distance[component][face].map(|d| (d / far).min(1.0))
    }
}
