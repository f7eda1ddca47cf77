//! Transport of volume and momentum with the flow.
//!
//! Volume moves through the faces of cells as the reconstructed planes say, one axis after the
//! other. A cell that is more than half full and without divergence keeps its dilatation c ∂u/∂x in
//! each sweep, with c fixed for the step, which leaves every fraction in [0, 1] while
//! Δt Σ |u|/h ≤ ½ (Weymouth & Yue, *J. Comput. Phys.* 229 (2010) 2853). A longer step is moved in parts of
//! that size with one and the same velocity.
//!
//! The mass of a velocity is the mean over the two cells of its face, so the volume fluxes of cells
//! average to the fluxes between velocities, and momentum moves with exactly the mass that moves: a
//! uniform velocity stays uniform to the last bits, and momentum is conserved to round-off.

use super::faces::ACTIVE;
use super::fraction::{reconstruct, volume_in};
use super::ground::Ground;
use super::ground::settling::Settling;
use super::open_ends::OpenEnds;
use super::plane::Plane;
use super::topology::{NONE, Topology};
use crate::grid::DIMENSIONS;

/// A velocity whose mass is below this fraction of a cell has no momentum of its own.
pub(crate) const MASSLESS: f64 = 1e-12;

/// Less of a cell than this is nothing, far below the round-off of what surrounds it.
const NOTHING: f64 = 1e-20;

/// Velocities on all faces, component by component.
pub(crate) type Velocity<const D: usize = DIMENSIONS> = [Vec<f64>; D];

/// Work arrays of the transport on one grid.
#[derive(Debug)]
pub(crate) struct Transport<const D: usize = DIMENSIONS> {
    planes: Vec<Option<Plane>>,
    /// Volume through each face of the axis of the sweep, in cell volumes.
    fluxes: Vec<f64>,
    dilatation: Vec<f64>,
    total_dilatation: Vec<f64>,
    /// Cells that keep their dilatation in the sweeps of a part.
    dilates: Vec<bool>,
    next: Vec<f64>,
    /// Matter and ground together.
    filled: Vec<f64>,
    settling: Settling,
    /// Cells that the last settling left as they should not be.
    unsettled: usize,
    /// Velocities that are carried, before the step.
    start: Velocity<D>,
    /// Momentum of each velocity of a component.
    momentum: Vec<f64>,
    /// Fractions and velocities before a part that is made in several orders.
    before: (Vec<f64>, Velocity<D>),
    /// Fractions and momenta, their mean over the orders.
    mean: (Vec<f64>, Velocity<D>),
    /// Volumes that flowed in and out through open ends in the last step, in cell volumes.
    passed: [f64; 2],
}

/// What moves, and how fast.
pub(crate) struct Motion<'a, const D: usize = DIMENSIONS> {
    pub topology: &'a Topology<D>,
    /// What carries.
    pub carrier: &'a Velocity<D>,
    /// Parts of the step, each of which is carried by the same velocity.
    pub passes: usize,
    /// Δt of a part over the cell size along each axis.
    pub courant: [f64; D],
    /// Axes to sweep over, in this order; of several orders the mean is taken.
    pub orders: &'a [Vec<usize>],
    /// Cells without divergence.
    pub incompressible: &'a [bool],
    /// Ground that cuts cells and faces.
    pub ground: Option<&'a Ground<D>>,
    /// Ends of x that are open.
    pub ends: Option<&'a OpenEnds>,
}

impl<const D: usize> Motion<'_, D> {
    /// Whether more than half of what is free of a cell is filled.
    fn is_active(&self, cell: usize, fraction: f64) -> bool {
        match self.ground {
            None => fraction > ACTIVE,
            Some(ground) => fraction > ACTIVE * ground.free[cell],
        }
    }
}

impl<const D: usize> Default for Transport<D> {
    fn default() -> Self {
        let components = || std::array::from_fn(|_| Vec::new());
        Self {
            planes: Vec::new(),
            fluxes: Vec::new(),
            dilatation: Vec::new(),
            total_dilatation: Vec::new(),
            dilates: Vec::new(),
            next: Vec::new(),
            filled: Vec::new(),
            settling: Settling::default(),
            unsettled: 0,
            start: components(),
            momentum: Vec::new(),
            before: (Vec::new(), components()),
            mean: (Vec::new(), components()),
            passed: [0.0; 2],
        }
    }
}

impl<const D: usize> Transport<D> {
    /// Moves material and the momentum of a velocity; walls let nothing through.
    pub(crate) fn advance(
        &mut self,
        motion: &Motion<'_, D>,
        fractions: &mut Vec<f64>,
        velocity: &mut Velocity<D>,
    ) {
        self.start.clone_from(velocity);
        self.passed = [0.0; 2];
        for _ in 0..motion.passes {
            match motion.orders {
                [order] => self.pass(motion, order, fractions, velocity),
                orders => self.mean_pass(motion, orders, fractions, velocity),
            }
        }
    }

    /// The mean of volume and momentum over several orders of the sweeps.
    fn mean_pass(
        &mut self,
        motion: &Motion<'_, D>,
        orders: &[Vec<usize>],
        fractions: &mut Vec<f64>,
        velocity: &mut Velocity<D>,
    ) {
        let topology = motion.topology;
        let nothing = || (Vec::new(), std::array::from_fn(|_| Vec::new()));
        let mut before = std::mem::replace(&mut self.before, nothing());
        let mut mean = std::mem::replace(&mut self.mean, nothing());
        before.0.clone_from(fractions);
        before.1.clone_from(velocity);
        let share = 1.0 / orders.len() as f64;
        let passed = self.passed;
        for (nth, order) in orders.iter().enumerate() {
            if nth > 0 {
                fractions.clone_from(&before.0);
                velocity.clone_from(&before.1);
            }
            self.pass(motion, order, fractions, velocity);
            add_share(&mut mean.0, nth == 0, fractions.iter().map(|f| share * f));
            for (c, (mean, u)) in mean.1.iter_mut().zip(velocity.iter()).enumerate() {
                let momenta = u.iter().enumerate();
                let momenta = momenta.map(|(face, u)| topology.face_mean(c, face, fractions) * u);
                add_share(mean, nth == 0, momenta.map(|m| share * m));
            }
        }
        fractions.clone_from(&mean.0);
        for (c, u) in velocity.iter_mut().enumerate() {
            for (face, u) in u.iter_mut().enumerate() {
                let mass = topology.face_mean(c, face, fractions);
                *u = if mass > MASSLESS && !topology.is_edge(c, face) {
                    mean.1[c][face] / mass
                } else {
                    before.1[c][face]
                };
            }
        }
        for (sum, before) in self.passed.iter_mut().zip(passed) {
            *sum = before + share * (*sum - before);
        }
        self.before = before;
        self.mean = mean;
    }

    fn pass(
        &mut self,
        motion: &Motion<'_, D>,
        order: &[usize],
        fractions: &mut Vec<f64>,
        velocity: &mut Velocity<D>,
    ) {
        self.total_dilatation.clear();
        self.total_dilatation.resize(fractions.len(), 0.0);
        self.dilates.clear();
        let full = fractions.iter().zip(motion.incompressible).enumerate();
        self.dilates.extend(
            full.map(|(cell, (f, incompressible))| *incompressible && motion.is_active(cell, *f)),
        );
        for (nth, &axis) in order.iter().enumerate() {
            match motion.ground {
                None => {
                    reconstruct(motion.topology, fractions, &mut self.planes);
                    self.volume_fluxes(motion, fractions, axis);
                    if let (Some(ends), 0) = (motion.ends, axis) {
                        self.pass_ends(motion, ends, fractions);
                    }
                    if axis + 1 == D {
                        self.pass_outlet(motion, fractions);
                    }
                }
                Some(ground) => {
                    ground.fill(fractions, &mut self.filled);
                    reconstruct(motion.topology, &self.filled, &mut self.planes);
                    self.volume_fluxes_over(motion, ground, fractions, axis);
                }
            }
            self.update_fractions(motion, fractions, axis, nth + 1 == order.len());
            for component in 0..D {
                self.move_momentum(motion, fractions, velocity, axis, component);
            }
            std::mem::swap(fractions, &mut self.next);
        }
        if let Some(ground) = motion.ground {
            self.unsettled = ground.settle(motion.topology, fractions, &mut self.settling);
        }
    }

    /// Velocities that were carried, before the last step.
    pub(crate) fn carried(&self) -> &Velocity<D> {
        &self.start
    }

    /// Cells beside ground that hold more than they can or less than nothing after the last step.
    pub(crate) fn unsettled(&self) -> usize {
        self.unsettled
    }

    /// Volumes that flowed in and out in the last step, in cell volumes.
    pub(crate) fn passed(&self) -> [f64; 2] {
        self.passed
    }

    /// Volume through open ends.
    fn pass_ends(&mut self, motion: &Motion<'_, D>, ends: &OpenEnds, fractions: &[f64]) {
        let start = &motion.carrier[0];
        for (first, last, filled) in ends.faces(start.len()) {
            let length = |face: usize| (start[face] * motion.courant[0]).max(0.0);
            self.fluxes[first] = length(first) * filled;
            let (donor, through) = (motion.topology.face_cells[0][last][0], length(last));
            let (from, to) = ([1.0 - through, 0.0, 0.0], [1.0; 3]);
            let volume = volume_in(fractions[donor], self.planes[donor].as_ref(), from, to);
            self.fluxes[last] = volume.clamp(0.0, fractions[donor].max(0.0));
            self.passed[0] += self.fluxes[first];
            self.passed[1] += self.fluxes[last];
        }
    }

    /// Volume through an outlet.
    fn pass_outlet(&mut self, motion: &Motion<'_, D>, fractions: &[f64]) {
        let axis = D - 1;
        for face in motion.topology.outlet.clone() {
            let mut to = [1.0; 3];
            to[axis] = (-motion.carrier[axis][face] * motion.courant[axis]).max(0.0);
            let volume = volume_in(fractions[face], self.planes[face].as_ref(), [0.0; 3], to);
            let volume = volume.clamp(0.0, fractions[face].max(0.0));
            self.fluxes[face] = -volume;
            self.passed[1] += volume;
        }
    }

    /// Volume through the free parts of faces.
    fn volume_fluxes_over(
        &mut self,
        motion: &Motion<'_, D>,
        ground: &Ground<D>,
        fractions: &[f64],
        axis: usize,
    ) {
        let (planes, start) = (&self.planes, &motion.carrier[axis]);
        let topology = motion.topology;
        let flux = |face: usize| {
            let ([low, high], u) = (topology.face_cells[axis][face], start[face]);
            let aperture = ground.aperture[axis][face];
            let length = u * motion.courant[axis];
            if low == NONE || high == NONE || length == 0.0 || aperture == 0.0 {
                return 0.0;
            }
            let (mut from, mut to) = ([0.0; 3], [1.0; 3]);
            let donor = if length > 0.0 {
                from[axis] = (1.0 - length).max(0.0);
                low
            } else {
                to[axis] = (-length).min(1.0);
                high
            };
            let share = ground.matter(donor, fractions[donor], planes[donor].as_ref(), from, to);
            (aperture * length.abs() * share).clamp(0.0, fractions[donor].max(0.0))
                * length.signum()
        };
        self.fluxes.clear();
        self.fluxes.extend((0..topology.faces(axis)).map(flux));
    }

    fn volume_fluxes(&mut self, motion: &Motion<'_, D>, fractions: &[f64], axis: usize) {
        let (planes, start) = (&self.planes, &motion.carrier[axis]);
        self.fluxes.clear();
        self.fluxes
            .extend(
                motion.topology.face_cells[axis]
                    .iter()
                    .zip(start)
                    .map(|(&[low, high], u)| {
                        let length = u * motion.courant[axis];
                        if low == NONE || high == NONE || length == 0.0 {
                            return 0.0;
                        }
                        let (mut from, mut to) = ([0.0; 3], [1.0; 3]);
                        let donor = if length > 0.0 {
                            from[axis] = 1.0 - length;
                            low
                        } else {
                            to[axis] = -length;
                            high
                        };
                        let volume = volume_in(fractions[donor], planes[donor].as_ref(), from, to);
                        volume.clamp(0.0, fractions[donor].max(0.0)) * length.signum()
                    }),
            );
    }

    fn update_fractions(
        &mut self,
        motion: &Motion<'_, D>,
        fractions: &[f64],
        axis: usize,
        is_last: bool,
    ) {
        let topology = motion.topology;
        self.next.clear();
        self.dilatation.clear();
        for (cell, &fraction) in fractions.iter().enumerate() {
            let [low, high] = topology.cell_faces[cell][axis];
            // The last sweep takes back what the others gave, so that nothing is left to the
            // residual of the divergence.
            let dilatation = if !self.dilates[cell] {
                0.0
            } else if is_last {
                -self.total_dilatation[cell]
            } else if let Some(ground) = motion.ground {
                let through =
                    |face: usize| motion.carrier[axis][face] * ground.aperture[axis][face];
                (through(high) - through(low)) * motion.courant[axis]
            } else {
                (motion.carrier[axis][high] - motion.carrier[axis][low]) * motion.courant[axis]
            };
            self.total_dilatation[cell] += dilatation;
            self.dilatation.push(dilatation);
            let mut next = fraction - (self.fluxes[high] - self.fluxes[low]) + dilatation;
            // In space dust gets everywhere, and thinner with every step.
            if D > 2 && next.abs() < NOTHING {
                next = 0.0;
            }
            self.next.push(next);
        }
    }

    /// Moves the momentum of one component in the sweep along `axis`.
    fn move_momentum(
        &mut self,
        motion: &Motion<'_, D>,
        fractions: &[f64],
        velocity: &mut Velocity<D>,
        axis: usize,
        component: usize,
    ) {
        let topology = motion.topology;
        let u = &velocity[component];
        let mass = |face: usize| topology.face_mean(component, face, fractions);
        self.momentum.clear();
        self.momentum.extend(u.iter().enumerate().map(|(face, u)| {
            mass(face) * u
                + topology.face_mean(component, face, &self.dilatation)
                    * self.start[component][face]
        }));
        for face in 0..u.len() {
            let next = topology.face_neighbours[component][face][axis][1];
            if next == NONE {
                continue;
            }
            // The volume that crosses between the two velocities.
            let volume = if axis == component {
                // Through the middle of the cell between them.
                let cell = topology.face_cells[component][face][1];
                let [low, high] = topology.cell_faces[cell][axis];
                0.5 * (self.fluxes[low] + self.fluxes[high])
            } else {
                let half = |cell: usize| {
                    if cell == NONE {
                        0.0
                    } else {
                        self.fluxes[topology.cell_faces[cell][axis][1]]
                    }
                };
                let [low, high] = topology.face_cells[component][face];
                0.5 * (half(low) + half(high))
            };
            if volume == 0.0 {
                continue;
            }
            let (donor, receiver, beyond) = if volume > 0.0 {
                (
                    face,
                    next,
                    topology.face_neighbours[component][face][axis][0],
                )
            } else {
                (
                    next,
                    face,
                    topology.face_neighbours[component][next][axis][1],
                )
            };
            let own = mass(donor);
            let slope = if beyond != NONE && mass(beyond) > MASSLESS && mass(receiver) > MASSLESS {
                limited(u[donor] - u[beyond], u[receiver] - u[donor])
            } else {
                0.0
            };
            let carried = u[donor] + 0.5 * slope * (1.0 - (volume.abs() / own).min(1.0));
            self.momentum[face] -= volume * carried;
            self.momentum[next] += volume * carried;
        }
        if let (Some(ends), 0) = (motion.ends, axis)
            && component > 0
        {
            // What leaves takes its momentum along.
            let columns = ends.columns;
            for face in (columns - 1..u.len()).step_by(columns) {
                let out = topology.face_cells[component][face].map(|cell| match cell {
                    NONE => 0.0,
                    cell => self.fluxes[topology.cell_faces[cell][0][1]],
                });
                self.momentum[face] -= 0.5 * (out[0] + out[1]) * u[face];
            }
        }
        if axis + 1 == D {
            self.take_through_outlet(topology, component, &velocity[component]);
        }
        for (face, u) in velocity[component].iter_mut().enumerate() {
            let mass = topology.face_mean(component, face, &self.next);
            if mass > MASSLESS && !topology.is_edge(component, face) {
                *u = self.momentum[face] / mass;
            }
        }
    }
}

impl<const D: usize> Transport<D> {
    /// What leaves through an outlet takes its momentum along: that of the faces in it, or of those that lie over it with
    /// one of their cells or both.
    fn take_through_outlet(&mut self, topology: &Topology<D>, component: usize, u: &[f64]) {
        for cell in topology.outlet.clone() {
            let flux = self.fluxes[cell];
            if component + 1 == D {
                self.momentum[cell] += flux * u[cell];
                continue;
            }
            for face in topology.cell_faces[cell][component] {
                if face != NONE {
                    self.momentum[face] += 0.5 * flux * u[face];
                }
            }
        }
    }
}

/// Begins or goes on with a sum of values.
fn add_share(sums: &mut Vec<f64>, is_first: bool, values: impl Iterator<Item = f64>) {
    if is_first {
        sums.clear();
        sums.extend(values);
    } else {
        for (sum, value) in sums.iter_mut().zip(values) {
            *sum += value;
        }
    }
}

/// Slope between two differences, of the smaller curvature and never beyond either neighbour
/// (monotonised central, van Leer, *J. Comput. Phys.* 23 (1977) 276).
fn limited(left: f64, right: f64) -> f64 {
    if left * right <= 0.0 {
        return 0.0;
    }
    let size = (0.5 * (left + right))
        .abs()
        .min(2.0 * left.abs())
        .min(2.0 * right.abs());
    size * left.signum()
}

#[cfg(test)]
mod space_tests;
#[cfg(test)]
mod tests;
