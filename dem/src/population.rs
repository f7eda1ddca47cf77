//! Grains that come and go during a run.
//!
//! All others keep their contacts and histories bit for bit. Numbers of grains (`id`) are given once
//! and never again. The momentum account takes in what comes and gives out what goes; an energy
//! ledger that is open is opened anew.

use crate::clumps::Clump;
use crate::grains::{Grain, SPHERE_INERTIA, vector};
use crate::setup::{SetupError, check_grains};
use crate::simulation::Simulation;
use crate::snapshot::GrainSample;
use nalgebra::Vector3;
use std::ops::Range;

impl Simulation {
    /// Puts grains in; their velocities belong to the time of their positions. Returns their numbers.
    ///
    /// In a run the velocities of all grains live half a step back. New grains are taken back there
    /// by half a kick of the forces of this instant, so that their first whole kick makes up for it.
    ///
    /// # Errors
    /// If a number is out of its range, a periodic box too narrow for a new grain, or a fixed one is to come
    /// into a box that moves. Nothing has changed then.
    pub fn insert(&mut self, grains: &[Grain]) -> Result<Range<u32>, SetupError> {
        let ids = self.enter(grains)?;
        if !ids.is_empty() {
            if self.steps_since_start > 0 {
                let new = self.places_of(|id| ids.contains(&id));
                self.take_back(&new);
            }
            self.seat(|id| ids.contains(&id));
        }
        Ok(ids)
    }

    /// Puts in grains that move as clumps from the start; `clumps` count them from 0, the first of `grains`.
    /// Returns their numbers. Members may overlap: forces are looked at when they are clumps.
    ///
    /// # Errors
    /// Those of [`Simulation::insert`] and [`Simulation::clump`]. No grain has come then.
    pub fn insert_clumped(
        &mut self,
        grains: &[Grain],
        clumps: &[Clump],
    ) -> Result<Range<u32>, SetupError> {
        let (deepest, account) = (self.deepest, self.account);
        let ids = self.enter(grains)?;
        let numbered = |clump: &Clump| Clump {
            // Beyond the last number there is no grain, which is refused.
            grains: (clump.grains.iter().map(|k| ids.start.saturating_add(*k))).collect(),
            ..clump.clone()
        };
        let numbered: Vec<Clump> = clumps.iter().map(numbered).collect();
        if let Err(error) = self.clump(&numbered) {
            self.remove(|grain| ids.contains(&grain.id));
            // Nobody has booked them.
            (self.deepest, self.account) = (deepest, account);
            return Err(error);
        }
        if self.steps_since_start > 0 {
            let new = self.places_of(|id| ids.contains(&id));
            self.take_back(&new);
        }
        self.open_account();
        Ok(ids)
    }

    /// Adds grains to the lists, with velocities as they are.
    fn enter(&mut self, grains: &[Grain]) -> Result<Range<u32>, SetupError> {
        let [small, large] = self.admit(grains)?;
        let fixed = grains.iter().filter(|grain| grain.fixed).count();
        self.refuse_in_moving_box("grains: fixed ones, their number", fixed)?;
        if grains.is_empty() {
            return Ok(self.next_id..self.next_id);
        }
        let end = u32::try_from(grains.len())
            .ok()
            .and_then(|count| self.next_id.checked_add(count))
            .ok_or(SetupError::OutOfRange {
                key: "grains inserted so far".into(),
                value: f64::from(self.next_id) + grains.len() as f64,
                allowed: "below 2³²",
            })?;
        let ids = self.next_id..end;
        self.forget_observation();
        self.size_lists(small, large);
        self.grains.append(grains, ids.start);
        self.next_id = end;
        self.rebuild();
        Ok(ids)
    }

    /// Checks grains that are to come; the smallest and the largest radius with them (m).
    pub(crate) fn admit(&self, grains: &[Grain]) -> Result<[f64; 2], SetupError> {
        let largest = check_grains(grains, self.law.materials())?;
        let present = self.grains.place[..self.grains.len()].iter();
        let (small, large) = present.fold((f64::INFINITY, largest), |(small, large), x| {
            (small.min(x[3]), large.max(x[3]))
        });
        let small = grains.iter().fold(small, |small, g| small.min(g.radius));
        if !grains.is_empty() {
            self.check_box(large, small)?;
        }
        Ok([small, large])
    }

    fn places_of(&self, new: impl Fn(u32) -> bool) -> Vec<usize> {
        let places = self.grains.id.iter().enumerate();
        places.filter(|(_, id)| new(**id)).map(|(i, _)| i).collect()
    }

    /// Books new grains.
    pub(crate) fn seat(&mut self, new: impl Fn(u32) -> bool) {
        for i in self.places_of(new) {
            self.account += self.held_momentum(i);
        }
        self.population_changed();
    }

    /// Takes out all grains for which `f` says so, with all others of their clumps, and says how many.
    pub fn remove(&mut self, f: impl FnMut(&GrainSample) -> bool) -> usize {
        let goes = self.marked(f);
        let count = goes.iter().filter(|&&goes| goes).count();
        if count == 0 {
            return 0;
        }
        self.forget_observation();
        for i in (0..goes.len()).filter(|&i| goes[i]) {
            self.account -= self.held_momentum(i);
        }
        let gone = self.drop_clumps(&goes);
        self.account -= gone;
        let mut left = 0;
        let remaining = goes.iter().map(|&goes| {
            left += u32::from(!goes);
            if goes { GONE } else { left - 1 }
        });
        let remaining: Vec<u32> = remaining.collect();
        self.fold_impulses();
        self.grains.keep(&goes);
        self.rebuild_from(&|old| remaining[old as usize]);
        self.population_changed();
        count
    }

    /// Momentum of a free grain as the integrator holds it; that of a clump is none of its members'.
    pub(crate) fn held_momentum(&self, i: usize) -> Vector3<f64> {
        if self.moves_alone(i) {
            self.grains.mass[i] * vector(&self.grains.motion[i])
        } else {
            Vector3::zeros()
        }
    }

    /// Takes the velocities of grains, and of the clumps they are in, half a step back.
    fn take_back(&mut self, grains: &[usize]) {
        self.observe();
        let half = 0.5 * self.timestep;
        for &i in grains {
            let inverse_mass = self.grains.motion[i][3];
            if !self.moves_alone(i) {
                continue;
            }
            let [force, torque, moment] = self.totals[i].map(|sum| vector(&sum));
            let inverse_radius = self.grains.turn[i][3];
            let back = half * (force * inverse_mass + self.gravity);
            let turn = half / SPHERE_INERTIA * inverse_mass * (torque + moment * inverse_radius);
            for k in 0..3 {
                self.grains.motion[i][k] -= back[k];
                self.grains.turn[i][k] -= turn[k];
            }
        }
        if !self.clumps.is_empty() {
            self.take_back_clumps(grains);
        }
        self.forget_observation();
    }

    fn population_changed(&mut self) {
        self.weigh();
        if self.ledger.is_some() {
            self.open_energy_ledger();
        }
    }
}

/// The new place of a grain that has gone.
pub(crate) const GONE: u32 = u32::MAX;
