//! Coarse-grained fields gathered while a run goes on.

use super::build::Stand;
use super::recipe::Recipe;
use crate::averages::Averages;
use crate::failure::Failure;
use crate::scene::world::{AverageKeys, Place};
use crate::table::Table;
use crate::vtkhdf;
use colluvium_dem::{Domain, Grain, GrainSample, Record, Simulation, Snapshot};
use std::path::Path;

/// Name of a window's numbers in a checkpoint.
const SAVED: &str = "averages/window";

/// Numbers that all windows together may take: 4 GB.
const MOST_NUMBERS: usize = 500_000_000;

/// What is gathered of a run, window by window.
#[derive(Debug)]
pub struct LiveAverages {
    windows: Vec<Averages>,
    /// First and last step of the time that is averaged over.
    span: [u64; 2],
    /// Steps between instants; an instant is the nearest whole step.
    every: f64,
    /// Length of a step (s).
    timestep: f64,
    /// What is averaged over, along axes that are not periodic.
    space: Domain,
}

impl LiveAverages {
    /// Nothing gathered yet; none where the scene asks for none.
    ///
    /// # Errors
    /// Which key cannot be.
    pub fn new(
        recipe: &dyn Recipe,
        stand: &Stand,
        origin: &str,
    ) -> Result<Option<LiveAverages>, Failure> {
        let Some(keys) = &recipe.keys().output.average else {
            return Ok(None);
        };
        let place = Place {
            origin,
            section: "output.average",
        };
        let choice = keys.choice(place)?;
        let timestep = stand.setup.timestep;
        let steps = |time: f64| (time / timestep).round() as u64;
        let end = keys.to.map_or(stand.steps, |to| steps(to).min(stand.steps));
        let span = [steps(keys.from), end];
        if span[0] >= span[1] {
            let last = stand.steps as f64 * timestep;
            let range = format!("earlier than the end of the run, {last} s");
            return Err(place.refuse("from", keys.from, range).into());
        }
        let every = (keys.every / timestep).max(1.0);
        // One step short of it is still the whole.
        if every > (span[1] - span[0] + 1) as f64 {
            let longest = (span[1] - span[0]) as f64 * timestep;
            let range = format!("at most what is averaged over, {longest} s");
            return Err(place.refuse("every", keys.every, range).into());
        }
        let space = space(keys, &stand.setup.domain, &stand.setup.grains, place)?;
        let grains: Vec<GrainSample> = stand.setup.grains.iter().map(sample).collect();
        let refused = |why: String| Failure::Input(format!("{origin}: [output.average]: {why}"));
        let one = Averages::begin(&choice, &space, &grains).map_err(refused)?;
        let numbers = one.save().len() * keys.windows as usize;
        if numbers > MOST_NUMBERS {
            let cell = keys.cell.map_or("left out".into(), |c| c.to_string());
            let range = format!(
                "such that all cells and windows take {MOST_NUMBERS} numbers at most, and not {numbers}"
            );
            return Err(place.refuse("cell", cell, range).into());
        }
        Ok(Some(LiveAverages {
            windows: vec![one; keys.windows as usize],
            span,
            every,
            timestep,
            space,
        }))
    }

    fn step_of(&self, instant: u64) -> u64 {
        let step = self.span[0] + (instant as f64 * self.every).round() as u64;
        // What rounding has put one step beyond the end belongs to it.
        if step == self.span[1] + 1 {
            self.span[1]
        } else {
            step
        }
    }

    /// The next step that is looked at, after this one.
    pub fn next(&self, done: u64) -> Option<u64> {
        let passed = done.saturating_sub(self.span[0]) as f64 / self.every;
        let from = (passed as u64).saturating_sub(1);
        (from..=from + 3)
            .map(|k| self.step_of(k))
            .find(|&step| step > done)
            .filter(|&step| step <= self.span[1])
    }

    /// Adds this instant, if it is one of those.
    ///
    /// # Errors
    /// If the kernel does not fit into the box any more.
    pub fn take(
        &mut self,
        simulation: &mut Simulation,
        seen: &mut Snapshot,
    ) -> Result<(), Failure> {
        let done = simulation.steps_done();
        let [first, last] = self.span;
        let due = done == first || done > 0 && self.next(done - 1) == Some(done);
        if !due {
            return Ok(());
        }
        simulation.snapshot(seen);
        // The box of a scene may be open space.
        for axis in (0..3).filter(|&axis| !seen.domain.periodic[axis]) {
            seen.domain.lower[axis] = self.space.lower[axis];
            seen.domain.upper[axis] = self.space.upper[axis];
        }
        let count = self.windows.len();
        let window = ((done - first) as f64 / (last - first) as f64 * count as f64) as usize;
        self.windows[window.min(count - 1)]
            .add(seen)
            .map_err(|error| Failure::Run(format!("[output.average]: {error}")))
    }

    /// Puts what has been gathered into a checkpoint.
    pub fn save(&self, record: &mut Record) {
        for (k, window) in self.windows.iter().enumerate() {
            record.numbers.insert(format!("{SAVED}/{k}"), window.save());
        }
    }

    /// Takes back what a checkpoint holds.
    ///
    /// # Errors
    /// What is missing.
    pub fn restore(&mut self, record: &Record) -> Result<(), String> {
        for (k, window) in self.windows.iter_mut().enumerate() {
            window.restore(record.numbers(&format!("{SAVED}/{k}"))?)?;
        }
        Ok(())
    }

    /// Tables over all windows together; writes `fields.vtkhdf`, an instant for each window that has any.
    ///
    /// # Errors
    /// If the file cannot be written.
    pub fn conclude(&self, directory: &Path) -> Result<Vec<Table>, Failure> {
        let mut all = self.windows[0].clone();
        for window in &self.windows[1..] {
            all.join(window);
        }
        let length = (self.span[1] - self.span[0]) as f64 / self.windows.len() as f64;
        let filled = self.windows.iter().enumerate();
        let frames = filled
            .filter(|(_, w)| w.sums().samples() > 0)
            .map(|(k, w)| {
                let middle = self.span[0] as f64 + (k as f64 + 0.5) * length;
                Ok(w.frame(middle * self.timestep))
            });
        if all.sums().samples() > 0 {
            vtkhdf::write(&directory.join("fields.vtkhdf"), frames)?;
        }
        Ok(all.tables())
    }
}

/// A grain at the start.
fn sample(grain: &Grain) -> GrainSample {
    GrainSample {
        id: 0,
        position: grain.position,
        velocity: grain.velocity,
        spin: grain.spin,
        radius: grain.radius,
        mass: grain.mass(),
        fixed: grain.fixed,
        clump: None,
    }
}

/// The box that is averaged over.
fn space(
    keys: &AverageKeys,
    domain: &Domain,
    grains: &[Grain],
    place: Place,
) -> Result<Domain, Failure> {
    let mut space = *domain;
    for axis in 0..3 {
        if !domain.periodic[axis] {
            let free = || grains.iter().filter(|g| !g.fixed);
            let low = free().map(|g| g.position[axis] - g.radius);
            let high = free().map(|g| g.position[axis] + g.radius);
            space.lower[axis] = low.fold(f64::INFINITY, f64::min);
            space.upper[axis] = high.fold(f64::NEG_INFINITY, f64::max);
        }
        let given = [("lower", keys.lower), ("upper", keys.upper)];
        for ((key, corner), end) in given.into_iter().zip([&mut space.lower, &mut space.upper]) {
            let Some(corner) = corner else { continue };
            if domain.periodic[axis] && corner[axis] != end[axis] {
                let range = format!("{} along this axis, where the box is periodic", end[axis]);
                return Err(place.refuse(key, corner[axis], range).into());
            }
            end[axis] = corner[axis];
        }
        let size = space.upper[axis] - space.lower[axis];
        if size.is_nan() || size <= 0.0 {
            let range = format!("above the lower corner, {} m", space.lower[axis]);
            return Err(place.refuse("upper", space.upper[axis], range).into());
        }
    }
    Ok(space)
}
