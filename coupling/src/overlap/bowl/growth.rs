//! A box that grows where grains are needed and shrinks where nothing moves.
//!
//! What lies outside the box, and its shell, is kept as the grains it was when the bed was cut, with their contacts ([`Patch`]), and goes
//! where the continuum goes. After an exchange a side of the box may make one move of the buffer's width:
//!
//! - *outwards*: the stored grains there are put back with
//!   their numbers and springs, and with the continuum's velocity. The shell of that side goes: its grains were held by
//!   tractions instead of neighbours and have lost their places, so that it is kept as it was, too, and put back with the
//!   rest. What would still lie deeper in others than any contact of the bed did is moved out of them (`room.rs`). Where the
//!   continuum has sheared what was stored too far for its contacts to mean anything, grains of a stored sheared packing come
//!   in its place if there are any (`returning.rs`);
//! - *inwards*: the strip's grains and the new shell are put by with their contacts.
//!
//! `oracle.rs` says when.
//!
//! The continuum's surface stays where it was in each column of cells. Stored grains weigh what they weigh and the
//! continuum in their place what its law says: the difference is taken off the surface of the continuum, evenly, so that a
//! move changes no mass; that of momenta the continuum gives back with what it owes. A move outwards beyond a budget of
//! free grains is refused and counted. Every move is kept with its reason ([`Move`]).

use super::gradients::{gradient_at, gradients};
use super::journey::{Growth, Move};
use super::room::Overlaps;
use super::store::{Store, stretched};
use super::zone::{SIDES, Side, Zone};
use super::{Bowl, OverlapError};
use crate::overlap::dense_limits::Reason;
use crate::overlap::sighting::{free_count, free_mass};
use colluvium_dem::{Grain, Partner, Patch, Simulation};
use nalgebra::{Matrix3, Vector3};

impl Bowl {
    /// Moves of the box so far.
    pub fn moves(&self) -> &[Move] {
        &self.journey.moves
    }

    /// Moves outwards that were refused; one that is refused at exchange after exchange counts once.
    pub fn refused_moves(&self) -> f64 {
        self.journey.refused
    }

    /// Grains put by outside the box, and its shell as it was put by.
    pub fn stored(&self) -> &Patch {
        &self.journey.store.patch
    }

    /// The same, for whoever knows better how they lie.
    pub fn stored_mut(&mut self) -> &mut Patch {
        &mut self.journey.store.patch
    }

    /// Deforms what is stored about a place by F = 1 + `step`, as the continuum would.
    pub fn deform_stored(&mut self, about: &Vector3<f64>, step: &Matrix3<f64>) {
        let Store { patch, stretch } = &mut self.journey.store;
        for (grain, stretch) in patch.grains.iter_mut().zip(stretch) {
            grain.position += step * (grain.position - about);
            *stretch = stretched(stretch, step);
        }
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
        let (cells, zone, shell) = (self.layout.cells, self.layout.zone.clone(), self.shell());
        let depth = |at: &Vector3<f64>| zone.label(&cells, at);
        self.journey.store = Store::fresh(self.take_outside(shell, depth, simulation)?);
        Ok(())
    }

    /// Takes what lies less deep than a shell out of the run; with it, as it is, what lies in the shell and stays.
    fn take_outside(
        &self,
        shell: f64,
        depth: impl Fn(&Vector3<f64>) -> f64,
        simulation: &mut Simulation,
    ) -> Result<Patch, OverlapError> {
        let belongs = self.spec.belongs();
        let patch = simulation.take_out(|g| belongs(g) && depth(&g.position) < shell);
        let stays = |_, g: &Grain| depth(&g.position) >= 0.0;
        simulation.put_back(&patch.clone().split(stays))?;
        Ok(patch)
    }

    /// Puts by the strip that a side of the box moves over inwards, and that side's new shell. Grains in the shell of another
    /// side bear its traction and have lost their places: of those that are kept from before, as they lay among their
    /// neighbours, nothing new is kept.
    fn put_by_strip(
        &mut self,
        zone: &Zone,
        side: usize,
        simulation: &mut Simulation,
    ) -> Result<(), OverlapError> {
        let (cells, shell) = (self.layout.cells, self.shell());
        let (own, others): (Vec<Side>, Vec<Side>) =
            zone.sides.iter().partition(|s| s.number() == side);
        let &[own] = own.as_slice() else {
            return Ok(());
        };
        let depth = |at: &Vector3<f64>| zone.depth(&cells, &own, at);
        let mut patch = self.take_outside(shell, depth, simulation)?;
        let store = &mut self.journey.store;
        let borne = |at: &Vector3<f64>| others.iter().any(|s| zone.depth(&cells, s, at) < shell);
        patch.split(|id, g| store.has(id) && borne(&g.position));
        let patch = Store::fresh(patch);
        store.split(|id, _| patch.has(id));
        store.merge(&patch);
        Ok(())
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
        self.journey.refused += f64::from(u8::from(outwards && !moved));
        self.lay(simulation)?;
        Ok(moved)
    }

    fn side(&self, number: usize) -> Option<Side> {
        let mut sides = self.layout.zone.sides.iter();
        sides.find(|side| side.number() == number).copied()
    }

    /// Cells by which a side moves.
    pub(super) fn stride(&self) -> isize {
        self.layout.widths[0] as isize
    }

    /// What is kept goes where the continuum has gone since the last exchange, and is sheared as it is.
    fn carry(&mut self) {
        let dt = self.exchange_time();
        let cells = &self.layout.cells;
        self.gradients = gradients(&self.view, cells);
        let Store { patch, stretch } = &mut self.journey.store;
        let rows = patch.grains.iter_mut().zip(stretch);
        for (grain, stretch) in rows.filter(|(g, _)| !g.fixed) {
            let hats = cells.hats(&grain.position);
            let u = self.view.velocity_at(&hats).unwrap_or_default();
            let gradient = gradient_at(&self.view, &self.gradients, &hats);
            *stretch = stretched(stretch, &(dt * gradient));
            grain.position += dt * u;
            grain.velocity = u;
        }
    }

    /// Moves a side of the box; says whether it did.
    pub(super) fn shift(
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
            let free = self.stored().grains.iter().filter(|g| !g.fixed);
            let grains = free.filter(|g| joins(g));
            let again = grains
                .clone()
                .filter(|g| old.label(&cells, &g.position) >= 0.0);
            let more = grains.count() as f64 - again.count() as f64;
            let all = free_count(simulation) as f64 + more;
            // Without any side there would be no continuum left.
            if all > growth.travel.budget || zone.sides.is_empty() {
                return Ok(false);
            }
        } else {
            let filled = cells.counts[2] - super::ROOM;
            if zone.inside(side.axis, filled, self.layout.widths[1]) < 1.0 {
                return Ok(false);
            }
        }
        self.gradients = gradients(&self.view, &cells);
        let before = self.counted();
        let heights = self.heights();
        let momentum = self.grain_momentum(simulation);
        let mass = free_mass(simulation);
        let [displaced, replaced] = if outwards {
            let coming = self.journey.store.split(|_, g| joins(g));
            simulation.remove(|g| coming.has(g.id));
            self.sighting.look(simulation);
            let below = |at: &Vector3<f64>| zone.label(&cells, at) < shell;
            self.bring_back(coming, &heights, below, simulation)?
        } else {
            self.put_by_strip(&zone, side.number(), simulation)?;
            [0.0; 2]
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
            replaced,
            remainder,
        });
        Ok(true)
    }
}
