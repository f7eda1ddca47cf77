//! A box that grows where grains are needed and shrinks where nothing moves.
//!
//! What lies outside the box, and its shell, is kept as the grains it was when the bed was cut, with their contacts ([`Patch`]), and goes
//! where the continuum goes. After an exchange a side of the box may make one move of the buffer's width:
//!
//! - *outwards*, where the ball has come nearer to the overlap's inner end than asked for, or where the grains of the
//!   inner overlap, their rms speed with its fluctuations, are faster than v_wake: the stored grains there are put back with
//!   their numbers and springs, and with the continuum's velocity. The shell of that side goes: its grains were held by
//!   tractions instead of neighbours and have lost their places, so that it is kept as it was, too, and put back with the
//!   rest. What would still lie deeper in others than any contact of the bed did is moved out of them (`room.rs`);
//! - *inwards*, where the grains that would be continuum or overlap have been slower than v_rest < v_wake for a time while
//!   others beyond are faster, and the ball is far: they are put by with their contacts. Each move outwards of a side doubles
//!   the time that its next one inwards waits for.
//!
//! The continuum's surface stays where it was in each column of cells. Stored grains weigh what they weigh and the
//! continuum in their place what its law says: the difference is taken off the surface of the continuum, evenly, so that a
//! move changes no mass; that of momenta the continuum gives back with what it owes. A move outwards beyond a budget of
//! grains is refused and counted. Every move is kept with its reason ([`Move`]).

use super::journey::{Growth, Move, Reason};
use super::room::{Overlaps, make_room};
use super::zone::{SIDES, Side, Zone};
use super::{Bowl, OverlapError};
use crate::overlap::sighting::free_mass;
use colluvium_dem::{Grain, GrainSample, Partner, Patch, Simulation};
use nalgebra::Vector3;

/// What the grains beside a side do.
#[derive(Clone, Copy, Debug, Default)]
struct Beside {
    /// Rms speed in the inner overlap (m/s).
    inner: f64,
    /// Of what would be continuum or overlap after a move inwards, and of the grains beyond (m/s).
    outer: f64,
    front: f64,
    /// How many those beyond are.
    count: f64,
}

impl Bowl {
    /// Moves of the box so far.
    pub fn moves(&self) -> &[Move] {
        &self.journey.moves
    }

    /// Moves outwards that were refused.
    pub fn refused_moves(&self) -> f64 {
        self.journey.refused
    }

    /// Grains put by outside the box, and its shell as it was put by.
    pub fn stored(&self) -> &Patch {
        &self.journey.store
    }

    /// The same, for whoever knows better how they lie.
    pub fn stored_mut(&mut self) -> &mut Patch {
        &mut self.journey.store
    }

    /// Puts by what lies outside the box when the bed is cut, and how its shell lay.
    pub(super) fn put_by(&mut self, simulation: &mut Simulation) -> Result<(), OverlapError> {
        let seen = &self.sighting.snapshot;
        let depths = seen.contacts.iter().filter_map(|contact| {
            let Partner::Grain(other) = contact.partner else {
                return None;
            };
            let [a, b] = [contact.grain, other].map(|n| &seen.grains[n]);
            Some(1.0 - (a.position - b.position).norm() / (a.radius + b.radius))
        });
        let depths: Vec<f64> = depths.collect();
        self.journey.overlaps = Overlaps {
            usual: depths.iter().sum::<f64>() / depths.len().max(1) as f64,
            deepest: depths.iter().copied().fold(0.0, f64::max),
        };
        let zone = self.layout.zone.clone();
        self.journey.store = self.take_outside(&zone, simulation)?;
        Ok(())
    }

    /// Takes what lies outside a box out of the run; with it, as it is, what lies in its shell and stays.
    fn take_outside(
        &self,
        zone: &Zone,
        simulation: &mut Simulation,
    ) -> Result<Patch, OverlapError> {
        let (cells, shell, belongs) = (self.layout.cells, self.shell(), self.spec.belongs());
        let patch = simulation.take_out(|g| belongs(g) && zone.label(&cells, &g.position) < shell);
        let stays = |_, g: &Grain| zone.label(&cells, &g.position) >= 0.0;
        simulation.put_back(&patch.clone().split(stays))?;
        Ok(patch)
    }

    /// Width of the shell in cells.
    fn shell(&self) -> f64 {
        self.spec.settings.shell / self.spec.settings.cell
    }

    /// After an exchange: moves of the sides for which there is reason.
    ///
    /// # Errors
    /// If the continuum or the grains refuse.
    pub(super) fn grow(&mut self, simulation: &mut Simulation) -> Result<(), OverlapError> {
        let Some(growth) = self.spec.growth.filter(|_| !self.spec.settings.uncoupled) else {
            return Ok(());
        };
        self.carry();
        for number in 0..SIDES {
            if let Some(side) = self.side(number) {
                self.consider(&growth, side, simulation)?;
            }
        }
        Ok(())
    }

    /// A move of a side that the caller wants, right after [`go_on`](Self::go_on): outwards, or inwards. Says whether it
    /// was made.
    ///
    /// # Errors
    /// If the continuum or the grains refuse.
    pub fn move_side(
        &mut self,
        number: usize,
        outwards: bool,
        simulation: &mut Simulation,
    ) -> Result<bool, OverlapError> {
        let (Some(growth), Some(side)) = (self.spec.growth, self.side(number)) else {
            return Ok(false);
        };
        let moved = self.shift(&growth, side, outwards, (Reason::Asked, 0.0), simulation)?;
        self.lay(simulation)?;
        Ok(moved)
    }

    fn side(&self, number: usize) -> Option<Side> {
        let mut sides = self.layout.zone.sides.iter();
        sides.find(|side| side.number() == number).copied()
    }

    /// Cells by which a side moves.
    fn stride(&self) -> isize {
        self.layout.widths[0] as isize
    }

    /// What is kept goes where the continuum has gone since the last exchange.
    fn carry(&mut self) {
        let dt = self.exchange_time();
        let cells = &self.layout.cells;
        for grain in self.journey.store.grains.iter_mut().filter(|g| !g.fixed) {
            let hats = cells.hats(&grain.position);
            let u = self.view.velocity_at(&hats).unwrap_or_default();
            grain.position += dt * u;
            grain.velocity = u;
        }
    }

    fn consider(
        &mut self,
        growth: &Growth,
        side: Side,
        simulation: &mut Simulation,
    ) -> Result<(), OverlapError> {
        let travel = &growth.travel;
        let number = side.number();
        let ball = self.ball_way(&side);
        let beside = self.speeds_beside(&side);
        let near = ball.is_some_and(|way| way < growth.near);
        if near || beside.inner > travel.wake {
            self.journey.resting[number] = 0.0;
            let reason = match (near, ball) {
                (true, Some(way)) => (Reason::Ball, way),
                _ => (Reason::Speed, beside.inner),
            };
            return self.shift(growth, side, true, reason, simulation).map(drop);
        }
        let rests = beside.outer < travel.rest
            && beside.front > travel.rest
            && beside.count >= travel.fewest;
        let resting = &mut self.journey.resting[number];
        *resting = if rests { *resting + 1.0 } else { 0.0 };
        let hold = travel.hold * 2.0_f64.powf(self.journey.returns[number]);
        if self.journey.resting[number] * self.exchange_time() <= hold {
            return Ok(());
        }
        // A box that let the ball come near at once would go to and fro.
        let stride = self.stride() as f64 * self.layout.cells.spacing[side.axis];
        if ball.is_none_or(|way| way - stride > 1.5 * growth.near) {
            self.journey.resting[number] = 0.0;
            let reason = (Reason::Rest, beside.outer);
            self.shift(growth, side, false, reason, simulation)?;
        }
        Ok(())
    }

    /// Distance between the ball and the inner end of a side's overlap (m).
    fn ball_way(&self, side: &Side) -> Option<f64> {
        let layout = &self.layout;
        let number = self.spec.ball?;
        let grains = &self.sighting.snapshot.grains;
        let ball = &grains[grains.binary_search_by_key(&number, |g| g.id).ok()?];
        let depth = layout.zone.depth(&layout.cells, side, &ball.position) - layout.widths[1];
        Some(depth * layout.cells.spacing[side.axis] - ball.radius)
    }

    fn speeds_beside(&self, side: &Side) -> Beside {
        let (cells, zone) = (&self.layout.cells, &self.layout.zone);
        let [handshake, inner] = self.layout.widths;
        let outer = inner + self.stride() as f64;
        let (mut squares, mut masses, mut count) = ([0.0; 3], [0.0; 3], 0.0);
        let belongs = self.spec.belongs();
        let mut add = |zone: usize, grain: &GrainSample| {
            squares[zone] += grain.mass * grain.velocity.norm_squared();
            masses[zone] += grain.mass;
        };
        for grain in self.sighting.snapshot.grains.iter().filter(|g| belongs(g)) {
            let depth = zone.depth(cells, side, &grain.position);
            if (handshake..inner).contains(&depth) {
                add(0, grain);
            }
            add(if depth < outer { 1 } else { 2 }, grain);
            count += f64::from(u8::from(depth >= outer));
        }
        let speed =
            |zone: usize| f64::sqrt(squares[zone] / f64::max(masses[zone], f64::MIN_POSITIVE));
        Beside {
            inner: speed(0),
            outer: speed(1),
            front: speed(2),
            count,
        }
    }

    /// Moves a side of the box; says whether it did.
    fn shift(
        &mut self,
        growth: &Growth,
        side: Side,
        outwards: bool,
        (reason, value): (Reason, f64),
        simulation: &mut Simulation,
    ) -> Result<bool, OverlapError> {
        let (cells, old) = (self.layout.cells, self.layout.zone.clone());
        let by = if outwards {
            self.stride()
        } else {
            -self.stride()
        };
        let zone = old.moved(&cells, &side, by);
        let shell = self.shell();
        let joins = |g: &Grain| {
            let depth = old.depth(&cells, &side, &g.position);
            depth < shell && zone.label(&cells, &g.position) >= 0.0
        };
        if outwards {
            let grains = self.journey.store.grains.iter().filter(|g| joins(g));
            let again = grains
                .clone()
                .filter(|g| old.label(&cells, &g.position) >= 0.0);
            let more = grains.count() as f64 - again.count() as f64;
            let all = simulation.grain_count() as f64 + more;
            // Without any side there would be no continuum left.
            if all > growth.travel.budget || zone.sides.is_empty() {
                self.journey.refused += 1.0;
                return Ok(false);
            }
        } else {
            let filled = cells.counts[2] - super::ROOM;
            if zone.inside(side.axis, filled, self.layout.widths[1]) < 1.0 {
                return Ok(false);
            }
        }
        let before = self.counted();
        let heights = self.heights();
        let momentum = self.grain_momentum(simulation);
        let mass = free_mass(simulation);
        let displaced = if outwards {
            let mut patch = self.journey.store.split(|_, g| joins(g));
            let mut kept = patch.clone();
            simulation.remove(|g| patch.ids.binary_search(&g.id).is_ok());
            self.sighting.look(simulation);
            let displaced = self.fit(&mut patch);
            simulation.put_back(&patch)?;
            let shell = kept.split(|_, g| zone.label(&cells, &g.position) < shell);
            self.journey.store.merge(&shell);
            displaced
        } else {
            let patch = self.take_outside(&zone, simulation)?;
            let again = |id, _: &Grain| patch.ids.binary_search(&id).is_ok();
            self.journey.store.split(again);
            self.journey.store.merge(&patch);
            0.0
        };
        let mass = free_mass(simulation) - mass;
        self.journey.farthest = self.farthest_moved();
        self.take_zone(zone);
        self.grain_mass = free_mass(simulation);
        self.account.handed += self.grain_momentum(simulation) - momentum;
        self.sighting.look(simulation);
        self.see_grains();
        self.keep_heights(&heights);
        if outwards {
            self.believe_the_continuum(&old);
        }
        self.copy_the_grains(if outwards { 0.0 } else { f64::INFINITY })?;
        let remainder = self.settle(before)?;
        self.agree();
        self.journey.returns[side.number()] += f64::from(u8::from(outwards));
        let place = side.face as isize + if side.outwards > 0.0 { by } else { -by };
        let most = cells.counts[side.axis] as isize;
        self.journey.moves.push(Move {
            time: simulation.time(),
            side: side.number(),
            place: cells.low[side.axis] + place.clamp(0, most) as f64 * cells.spacing[side.axis],
            reason,
            value,
            mass,
            grains: simulation.grain_count() as f64,
            displaced,
            remainder,
        });
        Ok(true)
    }

    /// Makes room for a patch among the grains that are there; says how many grains of it were moved.
    fn fit(&self, patch: &mut Patch) -> f64 {
        for grain in &mut patch.grains {
            grain.spin = Vector3::zeros();
        }
        let there = self.sighting.snapshot.grains.iter();
        let there: Vec<_> = there.map(|g| (g.position, g.radius)).collect();
        let (low, size, allowed) = (self.spec.low, self.spec.size, self.journey.overlaps);
        let inside = |at: &mut Vector3<f64>, radius: f64| {
            // Walls are as stiff as half of a pair: grains lie at most as deep in them.
            let reach = (1.0 - 2.0 * allowed.deepest) * radius;
            for axis in 0..2 {
                at[axis] = at[axis].clamp(low[axis] + reach, low[axis] + size[axis] - reach);
            }
            at.z = at.z.max(low[2] + reach);
        };
        let room = make_room(&mut patch.grains, &there, allowed, inside);
        room.moved
    }
}
