//! What makes a step of second order in Δt: stress and advection at the middle of the time by which the velocity moves.
//!
//! Forces of positions are there already. Two things are not, and are known from the step before:
//!
//! Stress is implicit, s = p m(γ), with γ of the end of [t, t + Δt] and p of the middle (the pressure is the multiplier
//! that belongs to the positions). At the middle it is
//!
//! ```text
//! s − ½ Δt p ∂m/∂t,    ∂m/∂t = (m_n − m_{n−1})/Δt_n,    m = s/p,
//! ```
//!
//! and the difference is a load of the step. For u′ = λu with λΔt → −∞ both roots of this scheme have |ξ|² = ½ if steps are alike, r/2 for steps that grow by r.
//!
//! Momentum moves from the positions at t_n to those at t_{n+1}, so what is carried is the velocity w that matter has when
//! it passes t_n, and what carries it is the field of the middle of the step, c = w − ½ Δt (u·∇)u: the velocity of the
//! state. The advection of a step, as its transport made it, gives the lead c − w of the next (Adams & Bashforth for
//! advection). Σ m w is the momentum, conserved to round-off as before; free fall and rest have no lead.

use crate::discretisation::{COMPONENTS, Discretisation};
use crate::free_surface::faces::{Face, Faces};
use crate::free_surface::topology::{NONE, Topology};
use crate::free_surface::transport::{MASSLESS, Velocity};
use crate::grid::DIMENSIONS;
use crate::rheology::squared_norm;
use crate::yield_step::{FlowState, PRESSURE_FLOOR};

/// A step longer than the one before by more than this factor takes nothing from it.
const LONGEST_REACH: f64 = 2.0;
/// A face whose mass is below this part of a cell has no advection of its own: it takes that of the faces beside it.
const LIGHTEST: f64 = 0.25;
/// Stands for a lead that is not known.
const UNKNOWN: f64 = f64::INFINITY;

/// What a step knows of the one before. Where that is nothing the step is of first order.
#[derive(Debug, PartialEq)]
pub struct History<const D: usize = DIMENSIONS, const C: usize = COMPONENTS> {
    /// What advection adds to the velocity of each face from the time of the fractions to that of the velocity; may be
    /// empty.
    pub lead: [Vec<f64>; D],
    /// Pressure in the threshold of each stress, zero where there is none; may be empty.
    pub pressure: Vec<f64>,
    /// By how much stress over pressure changed when the velocity last moved on, at each stress; may be empty.
    pub friction_change: Vec<[f64; C]>,
    /// Time by which the velocity last moved on.
    pub push: f64,
}

impl<const D: usize, const C: usize> Clone for History<D, C> {
    fn clone(&self) -> Self {
        let mut copy = Self::default();
        copy.clone_from(self);
        copy
    }

    /// Into the memory that is there.
    fn clone_from(&mut self, other: &Self) {
        let Self {
            lead,
            pressure,
            friction_change,
            push,
        } = other;
        self.lead.clone_from(lead);
        self.pressure.clone_from(pressure);
        self.friction_change.clone_from(friction_change);
        self.push = *push;
    }
}

impl<const D: usize, const C: usize> Default for History<D, C> {
    fn default() -> Self {
        Self {
            lead: std::array::from_fn(|_| Vec::new()),
            pressure: Vec::new(),
            friction_change: Vec::new(),
            push: 0.0,
        }
    }
}

impl<const D: usize, const C: usize> History<D, C> {
    /// Whether it may belong to so many faces and stresses.
    pub(super) fn fits(&self, faces: impl Fn(usize) -> usize, stresses: usize) -> bool {
        let fits = |found: usize, expected: usize| found == 0 || found == expected;
        (0..D).all(|c| fits(self.lead[c].len(), faces(c)))
            && fits(self.friction_change.len(), stresses)
            && self.pressure.len() == self.friction_change.len()
    }

    /// Adds the load by which the stress of the middle of `dt` differs from that of its end.
    pub(super) fn add_load<const V: usize>(
        &self,
        discretisation: &Discretisation<D, C, V>,
        places: &[usize],
        dt: f64,
        load: &mut [f64],
    ) {
        if self.friction_change.is_empty() || dt > LONGEST_REACH * self.push {
            return;
        }
        let half = 0.5 * dt / self.push;
        for (point, &place) in discretisation.points().iter().zip(places) {
            let factor = half * self.pressure[place];
            let s = self.friction_change[place].map(|change| factor * change);
            for (slot, &j) in point.velocities().iter().enumerate() {
                load[j] += point.weight * point.force(slot, &s);
            }
        }
    }

    /// Notes what the solution of a step changed of the stresses `before`, of all places.
    pub(super) fn note<const V: usize>(
        &mut self,
        discretisation: &Discretisation<D, C, V>,
        places: &[usize],
        solution: &FlowState<C>,
        before: &[[f64; C]],
        dt: f64,
    ) {
        self.push = dt;
        self.pressure.resize(before.len(), 0.0);
        self.friction_change.clear();
        self.friction_change.resize(before.len(), [0.0; C]);
        let points = discretisation.points().iter().zip(&solution.s);
        for ((point, s), &place) in points.zip(places) {
            let p = point.pressure(&solution.p);
            let earlier = self.pressure[place];
            if p > PRESSURE_FLOOR && earlier > PRESSURE_FLOOR {
                let old = before[place];
                let change: [f64; C] = std::array::from_fn(|a| s[a] / p - old[a] / earlier);
                // Cohesion and viscosity leave a stress where there is hardly a pressure, so that s/p has no bound; where
                // stress passes through zero the bound holds the change back, too.
                let (size, most) = (p * squared_norm(&change).sqrt(), squared_norm(s).sqrt());
                let part = if size > most { most / size } else { 1.0 };
                self.friction_change[place] = change.map(|change| part * change);
            }
        }
        self.pressure.fill(0.0);
        for (point, &place) in discretisation.points().iter().zip(places) {
            let p = point.pressure(&solution.p);
            if p > PRESSURE_FLOOR {
                self.pressure[place] = p;
            }
        }
    }

    /// Forgets stresses.
    pub(super) fn forget_stress(&mut self) {
        self.pressure.clear();
        self.friction_change.clear();
    }

    /// Takes the lead from the velocities, and leaves 1 for faces with enough mass in its place, 0 for others.
    pub(super) fn take_lead(
        &mut self,
        topology: &Topology<D>,
        fractions: &[f64],
        velocity: &mut Velocity<D>,
    ) {
        for (c, (lead, u)) in self.lead.iter_mut().zip(velocity).enumerate() {
            for (u, lead) in u.iter_mut().zip(lead.iter()) {
                *u -= lead;
            }
            lead.clear();
            let heavy = |face| f64::from(topology.face_mean(c, face, fractions) > LIGHTEST);
            lead.extend((0..u.len()).map(heavy));
        }
    }

    /// Faces that stand still, or move with others, have no momentum of their own to be carried.
    pub(super) fn drop_lead(&mut self, faces: &Faces<D>) {
        for (lead, roles) in self.lead.iter_mut().zip(&faces.role) {
            for (lead, role) in lead.iter_mut().zip(roles) {
                if matches!(role, Face::Still | Face::Slides(_)) {
                    *lead = 0.0;
                }
            }
        }
    }

    /// Gives velocities the lead that follows from what transport made of `carried`, times a factor. What has only just
    /// come to a face has no advection yet, which at a front is always so: it takes that of the faces beside it.
    pub(super) fn give_lead(
        &mut self,
        topology: &Topology<D>,
        fractions: &[f64],
        carried: &Velocity<D>,
        velocity: &mut Velocity<D>,
        factor: f64,
        own: &mut Vec<f64>,
    ) {
        for (c, (lead, u)) in self.lead.iter_mut().zip(velocity).enumerate() {
            let mass = |face: usize| topology.face_mean(c, face, fractions);
            own.clear();
            own.extend(lead.iter().enumerate().map(|(face, was_heavy)| {
                if *was_heavy == 0.0 || mass(face) <= LIGHTEST || topology.is_edge(c, face) {
                    UNKNOWN
                } else {
                    factor * (u[face] - carried[c][face])
                }
            }));
            for (face, (lead, u)) in lead.iter_mut().zip(u).enumerate() {
                *lead = if own[face] < UNKNOWN {
                    own[face]
                } else if mass(face) > MASSLESS && !topology.is_edge(c, face) {
                    mean_beside(topology, c, face, own)
                } else {
                    0.0
                };
                *u += *lead;
            }
        }
    }
}

/// The mean lead of the faces beside one that have their own, zero if none has.
fn mean_beside<const D: usize>(
    topology: &Topology<D>,
    component: usize,
    face: usize,
    own: &[f64],
) -> f64 {
    let (mut sum, mut count) = (0.0, 0.0);
    // By pairs, so that what mirrors itself stays so to the last bits.
    for pair in topology.face_neighbours[component][face] {
        let known = pair.map(|at| {
            if at == NONE || own[at] == UNKNOWN {
                None
            } else {
                Some(own[at])
            }
        });
        sum += known[0].unwrap_or(0.0) + known[1].unwrap_or(0.0);
        count += known.iter().flatten().count() as f64;
    }
    if count > 0.0 { sum / count } else { 0.0 }
}
