//! Which velocities are unknowns when material fills part of a grid.
//!
//! A cell more than half full is *active*: its centre lies in the material and carries a pressure. A
//! face of an active cell carries an unknown velocity. What lies in less filled cells above them
//! *follows*: such a face moves with the nearest unknown towards the material and adds its mass to
//! it, so mass and momentum of a step are complete. Material that nothing active touches is
//! *loose*: it flies. A layer less than half a cell deep on material that fills its cells slides on it
//! with a velocity of its own ([`super::layers_on_material`]).

use super::operators::EMPTY;
use super::topology::{NONE, Topology};
use super::transport::{MASSLESS, Velocity};
use crate::grid::{DIMENSIONS, Grid};

/// How a layer thinner than half a cell moves over a rough wall: it has no pressure of its own.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum ThinLayer {
    /// As a depth-averaged layer: it is driven by the slope of its surface and its own weight, and
    /// held by friction under the pressure of its weight.
    #[default]
    DepthAveraged,
    /// It sticks.
    Frozen,
    /// It follows the nearest thicker material, and slides freely where there is none.
    Following,
}

/// What a face does.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Face {
    /// Its velocity is an unknown.
    Own(usize),
    /// It moves with an unknown of another face.
    Follows(usize),
    /// It moves with unknowns of other components, as a thin layer does along a slope: the number of its
    /// [`Faces::sliders`].
    Slides(usize),
    /// It stands still: a wall, or a layer stuck to one.
    Still,
    /// It flies freely, or there is no material near.
    Loose,
}

impl Face {
    /// The unknown that moves the face.
    pub(crate) fn unknown(self) -> Option<usize> {
        match self {
            Face::Own(j) | Face::Follows(j) => Some(j),
            Face::Slides(_) | Face::Still | Face::Loose => None,
        }
    }
}

/// Nothing moves a face.
pub(super) const NOBODY: [(usize, f64); 2] = [(NONE, 0.0); 2];
/// Directions whose merits differ by less than this part are alike.
pub(super) const ALIKE: f64 = 1e-4;
/// Cells fuller than this are active.
pub(crate) const ACTIVE: f64 = 0.5;
/// Layers thinner than this part of a cell stick to a rough wall.
pub(super) const THINNEST_LAYER: f64 = 1e-3;
/// Layers on material that are thinner than this part of a cell move with it. Flow through such a cell jumps by this part
/// of the difference of two velocities where the layer begins to slide; thinner ones cost iterations.
const THINNEST_SLIDING: f64 = 0.1;

/// Less than this part of what has landed in the cell below may hang over it: of a face's mass nearly all has landed then,
/// and it must not fall.
const HANGING: f64 = 0.1;

/// Roles of cells and faces.
#[derive(Debug, Clone)]
pub(crate) struct Faces<const D: usize = DIMENSIONS> {
    /// Number of the unknown pressure of each cell, or [`NONE`].
    pub pressure: Vec<usize>,
    /// Cells with a pressure.
    pub active: Vec<usize>,
    /// Role of each face of each component.
    pub role: [Vec<Face>; D],
    /// Component and face of each unknown velocity.
    pub own: Vec<(usize, usize)>,
    /// Whether an unknown velocity belongs to a thin layer on a wall.
    pub is_thin: Vec<bool>,
    /// The face below an unknown velocity of a layer that slides on material, or [`NONE`].
    pub lies_on: Vec<usize>,
    /// Over ground: velocity of each face, by its own axis, and of the edges across it, by theirs, over the unknown that
    /// moves it.
    pub shares: Option<[Vec<[f64; D]>; D]>,
    /// Unknowns of other components that move a face, and their factors; [`NONE`] where there are fewer.
    pub sliders: Vec<[(usize, f64); 2]>,
    pub(super) acceleration: [f64; D],
}

impl<const D: usize> Faces<D> {
    /// No roles yet, for so many cells.
    pub(super) fn empty(cells: usize, acceleration: [f64; D]) -> Self {
        Self {
            pressure: vec![NONE; cells],
            active: Vec::new(),
            role: std::array::from_fn(|_| Vec::new()),
            own: Vec::new(),
            is_thin: Vec::new(),
            lies_on: Vec::new(),
            shares: None,
            sliders: Vec::new(),
            acceleration,
        }
    }

    pub(crate) fn of(
        grid: &Grid<D>,
        topology: &Topology<D>,
        fractions: &[f64],
        acceleration: [f64; D],
        thin_layer: ThinLayer,
    ) -> Self {
        let mut faces = Self::empty(topology.cells(), acceleration);
        for (cell, &fraction) in fractions.iter().enumerate() {
            if fraction > ACTIVE {
                faces.pressure[cell] = faces.active.len();
                faces.active.push(cell);
            }
        }
        for component in 0..D {
            let role = (0..topology.faces(component))
                .map(|face| faces.own_role(grid, topology, fractions, thin_layer, component, face))
                .collect();
            faces.role[component] = role;
        }
        for component in 0..D {
            for face in 0..topology.faces(component) {
                if faces.role[component][face] == Face::Loose
                    && let Some(host) = faces.host(topology, fractions, component, face)
                    && !faces.hangs(topology, fractions, component, face, host)
                {
                    faces.role[component][face] = Face::Follows(host);
                }
            }
        }
        faces.land(topology, fractions);
        faces
    }

    /// Whether a face would hold material up over a cell that has room for it, by moving with the one below that cell.
    pub(super) fn hangs(
        &self,
        topology: &Topology<D>,
        fractions: &[f64],
        component: usize,
        face: usize,
        host: usize,
    ) -> bool {
        let (axis, downwards) = self.fall();
        let cells = topology.face_cells[component][face];
        let (lower, upper) = (cells[downwards], cells[1 - downwards]);
        component == axis
            && !cells.contains(&NONE)
            && may_fall(fractions, lower, upper)
            && self.own_at(
                component,
                topology.face_neighbours[component][face][axis][downwards],
            ) == Some(host)
    }

    /// The axis that gravity points along most, and the side it points to (0 low, 1 high).
    fn fall(&self) -> (usize, usize) {
        let steeper = |best: usize, axis: usize| {
            if self.acceleration[axis].abs() > self.acceleration[best].abs() {
                axis
            } else {
                best
            }
        };
        let axis = (0..D).fold(D - 1, steeper);
        (axis, usize::from(self.acceleration[axis] > 0.0))
    }

    /// What has landed moves with the face below: its uppermost faces, through which hardly anything falls and under which
    /// nothing can, so that a velocity of their own would grow for ever; then faces beside it, which would slide without
    /// friction.
    pub(super) fn land(&mut self, topology: &Topology<D>, fractions: &[f64]) {
        let (axis, downwards) = self.fall();
        for face in 0..topology.faces(axis) {
            let cells = topology.face_cells[axis][face];
            if self.role[axis][face] == Face::Loose
                && !cells.contains(&NONE)
                && fractions[cells[downwards]] > MASSLESS
                && !may_fall(fractions, cells[downwards], cells[1 - downwards])
            {
                let lower = topology.cell_faces[cells[downwards]][axis][downwards];
                if self.role[axis][lower] == Face::Still {
                    self.role[axis][face] = Face::Still;
                } else {
                    self.lend(axis, lower, face);
                }
            }
        }
        let lies = |faces: &Self, cell: usize| {
            let below = topology.cell_faces[cell][axis][downwards];
            fractions[cell] <= MASSLESS || faces.role[axis][below] != Face::Loose
        };
        for component in (0..D).filter(|&component| component != axis) {
            for face in 0..topology.faces(component) {
                let cells = topology.face_cells[component][face];
                let base = topology.face_neighbours[component][face][axis][downwards];
                if self.role[component][face] == Face::Loose
                    && base != NONE
                    && topology.face_mean(component, face, fractions) > MASSLESS
                    && cells.into_iter().all(|cell| lies(self, cell))
                {
                    self.lend(component, base, face);
                }
            }
        }
    }

    /// A face moves as another of its component does, if an unknown moves that.
    fn lend(&mut self, component: usize, base: usize, face: usize) {
        if let Some(j) = self.role[component][base].unknown() {
            self.role[component][face] = Face::Follows(j);
            if let Some(shares) = &mut self.shares {
                shares[component][face] = shares[component][base];
            }
        }
    }

    /// The role of a face by itself; unknowns get their numbers.
    fn own_role(
        &mut self,
        grid: &Grid<D>,
        topology: &Topology<D>,
        fractions: &[f64],
        thin_layer: ThinLayer,
        component: usize,
        face: usize,
    ) -> Face {
        let cells = topology.face_cells[component][face];
        if topology.is_outlet(component, face) {
            // What an outlet has not enough of for a pressure moves with what is above, or falls.
            return match self.pressure[face] {
                NONE => Face::Loose,
                _ => self.take(component, face, false, NONE),
            };
        }
        if cells.contains(&NONE) {
            return Face::Still;
        }
        let is_thin = cells.iter().all(|&cell| self.pressure[cell] == NONE);
        if is_thin {
            let mass = topology.face_mean(component, face, fractions);
            if lies_on_wall(topology, fractions, component, face) {
                return Face::Still;
            }
            let base = self.material_under(topology, fractions, component, face);
            if base != NONE {
                return self.take(component, face, false, base);
            }
            let on_wall = self.wall_under(grid, topology, component, face).is_some();
            if !on_wall || mass <= MASSLESS || thin_layer == ThinLayer::Following {
                return Face::Loose;
            }
            if thin_layer == ThinLayer::Frozen || mass < THINNEST_LAYER {
                return Face::Still;
            }
        }
        self.take(component, face, is_thin, NONE)
    }

    /// Makes the velocity of a face an unknown.
    pub(super) fn take(
        &mut self,
        component: usize,
        face: usize,
        is_thin: bool,
        lies_on: usize,
    ) -> Face {
        self.own.push((component, face));
        self.is_thin.push(is_thin);
        self.lies_on.push(lies_on);
        Face::Own(self.own.len() - 1)
    }

    /// The face below one along the last axis, if a layer slides on it: it lies between active cells, gravity points to it
    /// rather than along it, and the layer is not too thin.
    pub(super) fn material_under(
        &self,
        topology: &Topology<D>,
        fractions: &[f64],
        component: usize,
        face: usize,
    ) -> usize {
        let last = D - 1;
        let along = self.acceleration[component].abs();
        if component == last
            || weight_onto(&self.acceleration, last, 0) <= along
            || topology.face_mean(component, face, fractions) <= THINNEST_SLIDING
        {
            return NONE;
        }
        let base = topology.face_neighbours[component][face][last][0];
        let is_active = |cell: usize| cell != NONE && self.pressure[cell] != NONE;
        if base != NONE
            && topology.face_cells[component][base]
                .into_iter()
                .all(is_active)
        {
            base
        } else {
            NONE
        }
    }

    /// The unknown of the nearest face that has one, the direction into the material first.
    pub(super) fn host(
        &self,
        topology: &Topology<D>,
        fractions: &[f64],
        component: usize,
        face: usize,
    ) -> Option<usize> {
        let beside = topology.face_neighbours[component][face];
        let mass = |at: usize| {
            if at == NONE {
                0.0
            } else {
                let mass = topology.face_mean(component, at, fractions);
                // In space dust lies here or there as round-off has it.
                if D > 2 && mass < EMPTY { 0.0 } else { mass }
            }
        };
        let mut directions: [(f64, usize, usize); D] = std::array::from_fn(|axis| {
            let [low, high] = beside[axis].map(mass);
            ((high - low).abs(), axis, usize::from(high >= low))
        });
        directions.sort_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
        if D > 2 {
            return self.unbiased_host(topology, component, face, directions);
        }
        let own = |at: usize| self.own_at(component, at);
        let along = directions.iter().map(|&(_, axis, side)| beside[axis][side]);
        let diagonal = directions
            .iter()
            .enumerate()
            .flat_map(|(nth, &(_, axis, side))| {
                let first = beside[axis][side];
                directions[nth + 1..]
                    .iter()
                    .map(move |&(_, axis, side)| match first {
                        NONE => NONE,
                        first => topology.face_neighbours[component][first][axis][side],
                    })
            });
        let against = directions
            .iter()
            .map(|&(_, axis, side)| beside[axis][1 - side]);
        along.chain(diagonal).chain(against).find_map(own)
    }

    /// The same where no direction may be preferred to its mirror image: faces of equal merit are asked
    /// together, and answer only if one of them alone has an unknown.
    fn unbiased_host(
        &self,
        topology: &Topology<D>,
        component: usize,
        face: usize,
        directions: [(f64, usize, usize); D],
    ) -> Option<usize> {
        let step = |at: usize, axis: usize, side: usize| match at {
            NONE => NONE,
            at => topology.face_neighbours[component][at][axis][side],
        };
        // Number of the first of the directions that are as good.
        let most = directions[0].0;
        let mut rank = [0; D];
        for n in 1..D {
            let alike = directions[n - 1].0 - directions[n].0 <= ALIKE * most;
            rank[n] = if alike { rank[n - 1] } else { n };
        }
        let level = |n: usize| directions[n].0 <= ALIKE * most;
        let mut any = None;
        let mut single = |faces: &mut dyn Iterator<Item = usize>| {
            let mut found = faces.filter_map(|at| self.own_at(component, at));
            let first = found.next();
            any = any.or(first);
            first.filter(|host| found.all(|other| other == *host))
        };
        let towards = |n: usize| step(face, directions[n].1, directions[n].2);
        let against = |n: usize| step(face, directions[n].1, 1 - directions[n].2);
        for group in (0..D).filter(|&n| rank[n] == n) {
            let members = || (0..D).filter(move |&n| rank[n] == group);
            let host = if level(group) {
                single(&mut members().flat_map(|n| [towards(n), against(n)]))
            } else {
                let pairs = members().flat_map(|n| members().map(move |m| (n, m)));
                let between = pairs
                    .filter(|(n, m)| n < m)
                    .map(|(n, m)| step(towards(n), directions[m].1, directions[m].2));
                single(&mut members().map(towards)).or_else(|| single(&mut { between }))
            };
            if host.is_some() {
                return host;
            }
        }
        for first in (0..D).filter(|&n| rank[n] == n && !level(n)) {
            for second in (0..D).filter(|&n| rank[n] == n && n > first && !level(n)) {
                let pairs = (0..D).filter(|&n| rank[n] == first).flat_map(|n| {
                    let others = (0..D).filter(move |&m| rank[m] == second);
                    others.map(move |m| (n, m))
                });
                let mut diagonal =
                    pairs.map(|(n, m)| step(towards(n), directions[m].1, directions[m].2));
                let host = single(&mut diagonal);
                if host.is_some() {
                    return host;
                }
            }
        }
        // Towards the material along all axes at once: on the diagonal of what mirrors itself this is on it, too.
        let sloping = (0..D).filter(|&n| !level(n));
        let corner = sloping.fold(face, |at, n| step(at, directions[n].1, directions[n].2));
        if let Some(host) = self.own_at(component, corner) {
            return Some(host);
        }
        for group in (0..D).filter(|&n| rank[n] == n && !level(n)) {
            let host = single(&mut (0..D).filter(|&n| rank[n] == group).map(against));
            if host.is_some() {
                return host;
            }
        }
        // Material must not be lost; what is empty may do without, and what lies over ground is an unknown then.
        any.filter(|_| most > 0.0 && self.shares.is_none())
    }

    /// The unknown of a face itself.
    fn own_at(&self, component: usize, at: usize) -> Option<usize> {
        match at {
            NONE => None,
            at => match self.role[component][at] {
                Face::Own(j) => Some(j),
                _ => None,
            },
        }
    }

    /// The axis and the side (0 low, 1 high) of a wall along a face that carries the weight of what
    /// lies on it, if there is one.
    pub(crate) fn wall_under(
        &self,
        grid: &Grid<D>,
        topology: &Topology<D>,
        component: usize,
        face: usize,
    ) -> Option<(usize, usize)> {
        let other = (0..D).filter(|&axis| axis != component);
        other
            .flat_map(|axis| [(axis, 0), (axis, 1)])
            .find(|&(axis, side)| {
                let ends = topology.face_neighbours[component][face][axis][side] == NONE;
                let edge = [0, grid.axes()[axis].cells()][side];
                let rigid = grid.axes()[axis]
                    .boundary_at(edge)
                    .is_some_and(|boundary| boundary.outer_pressure().is_none());
                let along = self.acceleration[component].abs();
                let weight = weight_onto(&self.acceleration, axis, side);
                // In a corner it is the wall that carries the most.
                let is_floor = (0..D)
                    .filter(|&other| other != component)
                    .all(|other| weight >= self.acceleration[other].abs());
                let is_closed = topology.face_cells[component][face]
                    .into_iter()
                    .all(|cell| !topology.opens(cell, axis, side));
                ends && rigid && is_closed && weight > along && is_floor
            })
    }

    /// Velocity on a face over the unknown that moves it.
    #[inline]
    pub(crate) fn share(&self, component: usize, face: usize) -> f64 {
        match &self.shares {
            None => 1.0,
            Some(shares) => shares[component][face][component],
        }
    }

    /// The unknowns that move a face, of whatever component, and how fast it moves, on the face itself or on its edge
    /// across another axis.
    #[inline]
    pub(super) fn moved_by(
        &self,
        component: usize,
        face: usize,
        across: usize,
    ) -> [(usize, f64); 2] {
        match self.role[component][face] {
            Face::Own(j) | Face::Follows(j) => {
                let share = self.shares.as_ref().map(|all| all[component][face][across]);
                [(j, share.unwrap_or(1.0)), NOBODY[1]]
            }
            Face::Slides(n) => self.sliders[n],
            Face::Still | Face::Loose => NOBODY,
        }
    }

    /// Gives every face that follows the velocity of its unknown.
    pub(crate) fn spread(&self, unknowns: &[f64], velocity: &mut Velocity<D>) {
        if self.shares.is_some() {
            for (component, u) in velocity.iter_mut().enumerate() {
                for (face, u) in u.iter_mut().enumerate() {
                    if self.role[component][face] != Face::Loose {
                        let movers = self.moved_by(component, face, component).into_iter();
                        let moving = movers.filter(|(j, _)| *j != NONE);
                        *u = moving.fold(0.0, |u, (j, share)| u + share * unknowns[j]);
                    }
                }
            }
            return;
        }
        for (role, u) in self.role.iter().zip(velocity) {
            for (role, u) in role.iter().zip(u) {
                match role.unknown() {
                    Some(j) => *u = unknowns[j],
                    None if *role == Face::Still => *u = 0.0,
                    None => {}
                }
            }
        }
    }
}

/// Whether a face lies above all material of the cell beside a wall, which cannot fall further.
///
/// In space dust above does not count.
fn lies_on_wall<const D: usize>(
    topology: &Topology<D>,
    fractions: &[f64],
    component: usize,
    face: usize,
) -> bool {
    let empty = if D == 2 { 0.0 } else { EMPTY };
    (0..2).any(|side| {
        let cell = topology.face_cells[component][face][side];
        let other = topology.face_cells[component][face][1 - side];
        topology.cell_neighbours[cell][component][side] == NONE
            && !topology.opens(cell, component, side)
            && fractions[other] <= empty
    })
}

/// Whether so much lies over what has landed in a cell that it falls.
fn may_fall(fractions: &[f64], lower: usize, upper: usize) -> bool {
    fractions[upper] > EMPTY.max(HANGING * fractions[lower])
}

/// Gravity normal to a wall on one side of an axis, positive towards the wall.
pub(crate) fn weight_onto<const D: usize>(
    acceleration: &[f64; D],
    axis: usize,
    side: usize,
) -> f64 {
    let towards = if side == 1 { 1.0 } else { -1.0 };
    (towards * acceleration[axis]).max(0.0)
}
