//! An edge that goes with the flow: grains where material moves, continuum where it has come to rest.
//!
//! What lies behind the edge is kept as the grains it was, in *strips* of one width by their labels, with their
//! contacts ([`Patch`]), and goes where the continuum goes. After an exchange the edge may make one move of that width:
//!
//! - *outwards*, when the grains that would become continuum, or its overlap, have rested for a time: their rms speed
//!   was below v_rest all the while, and the grains beyond are faster: where nothing flows any more a move spares no
//!   steps, and shakes what rests. The continuum's copy already weighs what they weigh; they are put by as a strip;
//! - *inwards*, when the continuum of the last strip moves faster than v_wake > v_rest, or is sheared faster, or the grains
//!   beside it are looser or warmer, than a continuum can be ([`DenseLimits`]): its grains are put back with the continuum's velocity. Where one of them would lie in a grain that has come there meanwhile, it is laid on top
//!   of the heap instead, so that no mass is lost.
//!
//! A move gives all labels anew, by where grains are: what has mixed since they were given is cut along a clean edge.
//! Each return doubles the rest that the next move outwards waits for: the two thresholds and this keep the edge from
//! going to and fro. A move inwards that a budget of grains does not allow is refused, and so is one to where the ground is not
//! level; it is counted once until it is made or no longer wanted, or refused for the other reason. Mass changes hands at the edge alone, by whole strips; momentum that goes with it is booked. Every move is kept with its reason
//! ([`Move`]).

use super::{Continuum, MaterialEdge, OverlapError};
use crate::overlap::dense_limits::{DenseLimits, Reason};
use crate::overlap::sighting::free_count;
use colluvium_dem::{Grain, GrainSample, Patch, Simulation};
use nalgebra::Vector3;

/// When an edge moves (SI).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Travel {
    /// Width of a strip (m); less than buffer and inner overlap together.
    pub width: f64,
    /// Grains with a smaller rms speed rest, v_rest (m/s).
    pub rest: f64,
    /// Continuum that is faster moves, v_wake (m/s).
    pub wake: f64,
    /// How long grains have to rest (s).
    pub hold: f64,
    /// Most free grains of all that are held, on either side of the overlap; those that are fixed do not count.
    pub budget: f64,
    /// Fewest free grains beyond the overlap.
    pub fewest: f64,
    /// What else grains are needed for.
    pub dense: DenseLimits,
}

/// A move of the edge.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Move {
    /// When (s).
    pub time: f64,
    /// Label, from the edge's first place, that the edge has after it (m).
    pub edge: f64,
    /// Why.
    pub reason: Reason,
    /// What was the reason: the rms speed of grains that rested, or of the continuum that moved (m/s), the inertial number, the
    /// solid fraction over that at the start, or the share of the pressure.
    pub value: f64,
    /// Mass that became grains; negative: that became continuum (kg).
    pub mass: f64,
    /// Free and fixed grains after it.
    pub grains: f64,
}

/// Rms speeds (m/s) of the grains that would be continuum or overlap after a move outwards and of those beyond, and how many
/// the latter are.
struct Beside {
    speed: f64,
    front: f64,
    count: f64,
}

/// Numbers of a move.
pub(super) const NUMBERS: usize = 6;

impl Move {
    /// All of it in a row of numbers.
    pub(super) fn numbers(&self) -> [f64; NUMBERS] {
        let reason = self.reason.number() as f64;
        [
            self.time,
            self.edge,
            reason,
            self.value,
            self.mass,
            self.grains,
        ]
    }

    /// From such numbers; none of what are not.
    pub(super) fn of(&[time, edge, reason, value, mass, grains]: &[f64; NUMBERS]) -> Option<Self> {
        Some(Self {
            time,
            edge,
            reason: *Reason::ALL.get(reason as usize)?,
            value,
            mass,
            grains,
        })
    }
}

/// What an edge that travels remembers.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Journey {
    /// Strips behind the edge, the nearest last.
    pub strips: Vec<Patch>,
    pub moves: Vec<Move>,
    /// Exchanges for which the grains beside the edge have rested.
    pub resting: f64,
    /// Moves inwards so far, those that a budget refused, and those for which the ground was not level.
    pub returns: f64,
    pub refused: f64,
    /// How many, and when the first (s).
    pub stopped: [f64; 2],
    /// Why the move inwards that is wanted now is not made: [`NOT_REFUSED`], [`BY_BUDGET`] or [`BY_GROUND`].
    pub refusing: f64,
    /// Grains that were laid on top because their place was taken.
    pub displaced: f64,
}

/// What refuses a move inwards, as numbers of a record.
pub(super) const NOT_REFUSED: f64 = 0.0;
pub(super) const BY_BUDGET: f64 = 1.0;
pub(super) const BY_GROUND: f64 = 2.0;

impl Journey {
    /// Notes why a move inwards is not made; whether it is another one than was refused for that before.
    pub fn refuse(&mut self, why: f64) -> bool {
        std::mem::replace(&mut self.refusing, why) != why
    }
}

/// Share of the sum of radii by which a grain that is put back may overlap with one that is there.
const DEEPEST: f64 = 0.05;

/// Which strip behind the edge a grain belongs to, from 0; none: it stays.
fn strip_of(label: Option<f64>, fixed: bool, floor: f64, width: f64) -> Option<usize> {
    let behind = match (label, fixed) {
        (Some(label), _) => -label,
        (None, true) => floor,
        (None, false) => return None,
    };
    (behind > 0.0).then(|| (behind / width) as usize)
}

impl MaterialEdge {
    /// Moves of the edge so far.
    pub fn moves(&self) -> &[Move] {
        &self.journey.moves
    }

    /// Moves inwards that the budget did not allow.
    pub fn refused_moves(&self) -> f64 {
        self.journey.refused
    }

    /// Grains that were laid on top of the heap because their place was taken when they were put back.
    pub fn displaced(&self) -> f64 {
        self.journey.displaced
    }

    /// Label, from its first place, that the edge has now (m).
    pub fn travelled(&self) -> f64 {
        self.labels.edge
    }

    /// Puts by what lies behind the edge when it is cut, as strips, as far as the edge may ever come back.
    pub(super) fn put_by(&mut self, travel: &Travel, simulation: &mut Simulation) {
        let [behind, _] = self.ours;
        // Of a continuum with an edge at each end, each may take its half.
        let (end, part) = match behind > self.spec.back {
            true => (behind, 0.5),
            false => (self.spec.back, 1.0),
        };
        let least = part * super::LEAST_CELLS * self.cells.spacing;
        let room = self.spec.place - end - least;
        let strips = (room / travel.width).max(0.0) as usize;
        for strip in (0..strips).rev() {
            let patch = simulation.take_out(|g| self.strip(g, travel.width) == Some(strip));
            self.journey.strips.push(patch);
        }
    }

    fn strip(&self, grain: &GrainSample, width: f64) -> Option<usize> {
        let grain = &self.spec.side.grain(*grain);
        if grain.fixed && grain.position.x < self.ours[0] {
            return None;
        }
        let base = self.labels.base.iter().copied();
        let floor = base.fold(f64::INFINITY, f64::min) - self.spec.settings.inner;
        let fixed = grain.fixed;
        strip_of(
            self.labels.of(grain),
            fixed,
            floor - grain.position.x,
            width,
        )
    }

    /// After an exchange: a move of the edge, if there is reason for one. Outwards it may go if `room` (m) of grains that belong to
    /// no overlap have a strip to spare. Says whether it moved.
    ///
    /// # Errors
    /// If the continuum or the grains refuse.
    pub(super) fn travel(
        &mut self,
        room: f64,
        continuum: &mut Continuum,
        simulation: &mut Simulation,
    ) -> Result<bool, OverlapError> {
        let Some(travel) = self.spec.travel.filter(|_| !self.spec.settings.uncoupled) else {
            return Ok(false);
        };
        self.carry_strips();
        if !self.journey.strips.is_empty()
            && let Some(reason) = self.needs_grains(&travel)
        {
            self.journey.resting = 0.0;
            return self.come_back(&travel, reason, simulation);
        }
        self.journey.refusing = NOT_REFUSED;
        let Beside {
            speed,
            front,
            count,
        } = self.speed_beside(travel.width);
        let has_room = count >= travel.fewest && room >= travel.width;
        let rests = speed < travel.rest && front > travel.rest && has_room;
        self.journey.resting = if rests {
            self.journey.resting + 1.0
        } else {
            0.0
        };
        let hold = travel.hold * 2.0_f64.powf(self.journey.returns);
        if self.journey.resting * self.exchange_time() > hold {
            self.journey.resting = 0.0;
            self.go_out(&travel, (Reason::Rest, speed), continuum, simulation)?;
            return Ok(true);
        }
        Ok(false)
    }

    /// What is kept goes where the continuum has gone since the last exchange.
    fn carry_strips(&mut self) {
        let dt = self.exchange_time();
        let side = self.spec.side;
        for strip in &mut self.journey.strips {
            for grain in strip.grains.iter_mut().filter(|g| !g.fixed) {
                let at = side.along(grain.position.x);
                let hats = self.cells.hats(at, grain.position.z);
                let velocity = self.view.velocity_at(&hats).unwrap_or_default();
                let [u, w] = side.in_plane(velocity.into());
                grain.position += dt * Vector3::new(u, 0.0, w);
                grain.velocity = Vector3::new(u, 0.0, w);
            }
        }
    }

    /// Speeds beside the edge, where strips have this width (m).
    fn speed_beside(&self, width: f64) -> Beside {
        let end = width + self.spec.zones()[1];
        let (mut sums, mut masses, mut count) = ([0.0; 2], [0.0; 2], 0.0);
        for grain in &self.sighting.snapshot.grains {
            let Some(label) = self.labels.of(grain) else {
                continue;
            };
            let side = usize::from(label >= end);
            sums[side] += grain.mass * grain.velocity.norm_squared();
            masses[side] += grain.mass;
            count += side as f64;
        }
        let speed = |side: usize| crate::overlap::joint::over(sums[side], masses[side]).sqrt();
        Beside {
            speed: speed(0),
            front: speed(1),
            count,
        }
    }

    /// Looks at the grains after another edge has moved, and gives labels to those of its own that came with it: they lie as far from
    /// this edge as it is now.
    pub(super) fn see_newcomers(&mut self, known: &[u32], simulation: &mut Simulation) {
        self.look(simulation);
        for grain in self.sighting.snapshot.grains.iter().filter(|g| !g.fixed) {
            if known.binary_search(&grain.id).is_ok() {
                continue;
            }
            let rows = self.cells.rows(grain.position.z).into_iter();
            let edge: f64 = rows.map(|(row, hat)| hat * self.held.rows[row].place).sum();
            if let Some(label) = self.labels.given_to(grain.id) {
                *label = grain.position.x - edge;
            }
        }
    }

    /// Numbers of the free grains that it saw when it looked, rising.
    pub(super) fn seen(&self) -> Vec<u32> {
        let free = self.sighting.snapshot.grains.iter().filter(|g| !g.fixed);
        free.map(|g| g.id).collect()
    }

    /// Gives its grains labels anew, for an edge at these places row by row (m).
    fn give_labels(&mut self, places: Vec<f64>) {
        self.labels.base = places;
        for grain in self.sighting.snapshot.grains.iter().filter(|g| !g.fixed) {
            let base = self.labels.base_at(&self.cells, grain.position.z);
            if let Some(label) = self.labels.given_to(grain.id) {
                *label = grain.position.x - base;
            }
        }
    }

    fn go_out(
        &mut self,
        travel: &Travel,
        reason: (Reason, f64),
        continuum: &mut Continuum,
        simulation: &mut Simulation,
    ) -> Result<(), OverlapError> {
        let places = self.surface_of(travel.width);
        self.give_labels(places);
        self.labels.edge += travel.width;
        // The copy of what changes hands says all that its grains say.
        self.see_grains();
        self.copy_the_grains(continuum, f64::INFINITY)?;
        let before = self.held_momentum(simulation);
        let patch = simulation.take_out(|g| self.strip(g, travel.width).is_some());
        let mass = -patch.mass();
        self.journey.strips.push(patch);
        self.handed(reason, mass, before, simulation);
        Ok(())
    }

    pub(super) fn come_back(
        &mut self,
        travel: &Travel,
        reason: (Reason, f64),
        simulation: &mut Simulation,
    ) -> Result<bool, OverlapError> {
        if !self.has_level_ground_for(travel, simulation.time()) {
            return Ok(false);
        }
        let strips = &self.journey.strips;
        let more = strips.last().map_or(0, |patch| {
            patch.grains.iter().filter(|grain| !grain.fixed).count()
        });
        let now = free_count(simulation);
        if (now + more) as f64 > travel.budget {
            let is_new = self.journey.refuse(BY_BUDGET);
            self.journey.refused += f64::from(u8::from(is_new));
            return Ok(false);
        }
        let Some(mut patch) = self.journey.strips.pop() else {
            return Ok(false);
        };
        self.journey.refusing = NOT_REFUSED;
        for grain in &mut patch.grains {
            grain.spin = Vector3::zeros();
        }
        let side = self.spec.side;
        let there = self.sighting.snapshot.grains.iter();
        let there = there.map(|g| (side.turned(g.position), g.radius)).collect();
        self.journey.displaced += make_room(&mut patch.grains, there, self.spec.slab);
        let before = self.held_momentum(simulation);
        let mass = patch.mass();
        simulation.put_back(&patch)?;
        let mut places = self.surface_of(0.0);
        for place in &mut places {
            *place -= travel.width;
        }
        self.look(simulation);
        self.give_labels(places);
        self.labels.edge -= travel.width;
        self.journey.returns += 1.0;
        let handshake = self.held.handshake.clone();
        self.handed(reason, mass, before, simulation);
        self.believe_the_continuum(&handshake);
        Ok(true)
    }

    /// Cells in front of the edge that lay behind the handshake surface, then at these places row by row (m), have averages of no grains,
    /// or of a shell that bore forces from outside: they take the continuum's stress until their grains have one.
    fn believe_the_continuum(&mut self, before: &[f64]) {
        let columns = self.cells.counts[0];
        for (cell, stress) in self.sums.stress.iter_mut().enumerate() {
            let (centre, k) = (self.cells.centre(cell % columns), cell / columns);
            let is_new = centre < before[k] && centre > self.held.rows[k].place;
            if is_new && self.view.is_full(cell) {
                *stress = self.view.stress_of_grains(cell, 1.0);
            }
        }
    }

    /// Books a move, and agrees on what holds after it.
    fn handed(
        &mut self,
        (reason, value): (Reason, f64),
        mass: f64,
        before: [f64; 2],
        simulation: &mut Simulation,
    ) {
        let now = self.held_momentum(simulation);
        for axis in 0..2 {
            self.account.handed[axis] += now[axis] - before[axis];
        }
        self.look(simulation);
        self.see_grains();
        self.agree();
        self.journey.moves.push(Move {
            time: simulation.time(),
            edge: self.labels.edge,
            reason,
            value,
            mass,
            grains: simulation.grain_count() as f64,
        });
    }
}

/// Lays those free grains on top of all others whose place is taken by one that is `there`, with centres and radii (m), in
/// a slab periodic across; says how many.
fn make_room(grains: &mut [Grain], mut there: Vec<(Vector3<f64>, f64)>, slab: f64) -> f64 {
    let across = |dy: f64| dy - slab * (dy / slab).round();
    let apart = |a: &Vector3<f64>, b: &Vector3<f64>| {
        let [dx, dy, dz] = [a.x - b.x, across(a.y - b.y), a.z - b.z];
        (dx.hypot(dy), dz)
    };
    let taken = |grain: &Grain, there: &[(Vector3<f64>, f64)]| {
        there.iter().any(|(place, radius)| {
            let (level, dz) = apart(&grain.position, place);
            level.hypot(dz) < (1.0 - DEEPEST) * (grain.radius + radius)
        })
    };
    let moves: Vec<bool> = grains
        .iter()
        .map(|g| !g.fixed && taken(g, &there))
        .collect();
    let stay = grains.iter().zip(&moves).filter(|(_, moves)| !**moves);
    there.extend(stay.map(|(g, _)| (g.position, g.radius)));
    let mut count = 0.0;
    for (grain, _) in grains.iter_mut().zip(&moves).filter(|(_, moves)| **moves) {
        // As high as it touches the first below.
        let on = there.iter().filter_map(|(place, radius)| {
            let (level, _) = apart(&grain.position, place);
            let reach = grain.radius + radius;
            (level < reach).then(|| place.z + (reach * reach - level * level).sqrt())
        });
        grain.position.z = on.fold(grain.position.z, f64::max);
        grain.velocity = Vector3::zeros();
        there.push((grain.position, grain.radius));
        count += 1.0;
    }
    count
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_grain_whose_place_is_taken_is_laid_on_top() {
        let at = |x: f64, y: f64, z: f64| Grain::at_rest(Vector3::new(x, y, z), 0.5, 1.0);
        let mut grains = vec![at(0.0, 0.1, 0.5), at(0.0, 0.0, 1.5), at(3.0, 0.0, 0.5)];
        // One lies in the first, across the periodic end, one beside the third.
        let there = vec![
            (Vector3::new(0.0, 3.9, 0.5), 0.5),
            (Vector3::new(3.99, 0.0, 0.5), 0.5),
        ];
        let untouched = [grains[1].position, grains[2].position];
        assert_eq!(make_room(&mut grains, there, 4.0), 1.0);
        assert_eq!([grains[1].position, grains[2].position], untouched);
        let top = &grains[0].position;
        assert!((top - grains[1].position).norm() > 1.0 - 1e-12, "{top}");
        assert!((top.z - 1.5 - (1.0_f64 - 0.01).sqrt()).abs() < 1e-12);
    }

    #[test]
    fn a_move_that_goes_on_being_refused_is_one() {
        let mut journey = Journey::default();
        let (budget, ground) = (BY_BUDGET, BY_GROUND);
        let told = [budget, budget, ground, ground, budget].map(|why| journey.refuse(why));
        assert_eq!(told, [true, false, true, false, true]);
        journey.refusing = NOT_REFUSED;
        assert!(journey.refuse(budget));
    }

    #[test]
    fn strips_are_counted_from_the_edge() {
        assert_eq!(strip_of(Some(-0.5), false, 9.0, 3.0), Some(0));
        assert_eq!(strip_of(Some(-3.5), false, 9.0, 3.0), Some(1));
        assert_eq!(strip_of(Some(0.5), false, 9.0, 3.0), None);
        assert_eq!(strip_of(None, true, 4.0, 3.0), Some(1));
        assert_eq!(strip_of(None, true, -4.0, 3.0), None);
        assert_eq!(strip_of(None, false, 4.0, 3.0), None);
    }
}
