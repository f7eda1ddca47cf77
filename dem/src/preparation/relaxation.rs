//! Grains brought to rest, by their own dissipation and a damping of all velocities.
//!
//! ```text
//! v → v e^{-γ Δt √(a/d̄)}        at every look, Δt apart; γ the damping, a the acceleration
//! ```
//! The damping is a drag against the resting frame: it takes energy that contacts leave in slow swings of
//! the whole packing, and changes no state of rest.

use super::rest::{Rest, RestMeasures};
use super::watch::{Trail, Watch, out_of_place};
use crate::setup::{SetupError, check};
use crate::simulation::Simulation;
use serde::{Deserialize, Serialize};

/// How grains are brought to rest.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Relaxation {
    /// Acceleration (m/s²) that measures energy and time: gravity's, or whatever pulls the grains.
    pub acceleration: f64,
    /// γ (–): drag over √(a/d̄). 0 leaves it to the contacts.
    pub damping: f64,
    /// When it is done.
    pub rest: Rest,
    /// Longest time, in √(d̄/a).
    pub patience: f64,
}

impl Relaxation {
    /// Light damping under an acceleration (m/s²).
    pub fn under(acceleration: f64) -> Relaxation {
        Relaxation {
            acceleration,
            damping: 0.5,
            rest: Rest::default(),
            patience: 1000.0,
        }
    }

    fn validate(&self) -> Result<(), SetupError> {
        check(
            "relaxation.acceleration",
            self.acceleration,
            "> 0 m/s²",
            |v| v > 0.0,
        )?;
        check("relaxation.damping", self.damping, "in [0, 100]", |v| {
            (0.0..=100.0).contains(&v)
        })?;
        check("relaxation.rest.kinetic", self.rest.kinetic, "> 0", |v| {
            v > 0.0
        })?;
        let unbalanced = self.rest.unbalanced;
        check("relaxation.rest.unbalanced", unbalanced, "> 0", |v| v > 0.0)?;
        check("relaxation.patience", self.patience, "> 0", |v| v > 0.0)
    }
}

/// Looks in the time √(d̄/a).
const LOOKS: f64 = 20.0;
/// Looks between measures of rest.
const MEASURE_EVERY: u64 = 5;

/// Advances until the grains rest.
///
/// # Errors
/// If they do not within the time given, or fly apart.
pub fn relax(
    simulation: &mut Simulation,
    spec: &Relaxation,
    watch: &mut dyn Watch,
) -> Result<RestMeasures, SetupError> {
    let mut trail = Trail::of(watch);
    relax_along(simulation, spec, &mut trail, watch)
}

/// The same within another preparation.
pub(super) fn relax_along(
    simulation: &mut Simulation,
    spec: &Relaxation,
    trail: &mut Trail,
    watch: &mut dyn Watch,
) -> Result<RestMeasures, SetupError> {
    spec.validate()?;
    // Sums of radii go by the order of the grains, which changes on the way.
    let (done, unit) = match trail.last()? {
        Some([look, unit]) => (look, f64::from_bits(unit)),
        None => (0, time_unit(simulation, spec.acceleration)),
    };
    let steps = (unit / LOOKS / simulation.timestep()).ceil().max(1.0);
    let keep = (-spec.damping * steps * simulation.timestep() / unit).exp();
    let looks = (spec.patience * unit / (steps * simulation.timestep())).ceil() as u64;
    if !(unit > 0.0 && unit.is_finite() && done <= looks.max(MEASURE_EVERY)) {
        return Err(out_of_place());
    }
    let mut measures = simulation.rest_measures(spec.acceleration);
    for look in done + 1..=looks.max(MEASURE_EVERY) {
        simulation.advance(steps as u64)?;
        if keep < 1.0 {
            simulation.damp(keep);
        }
        if look % MEASURE_EVERY > 0 {
            continue;
        }
        measures = simulation.rest_measures(spec.acceleration);
        if spec.rest.holds(&measures) {
            return Ok(measures);
        }
        trail.show(watch, simulation, (&measures, &[look, unit.to_bits()]))?;
    }
    Err(SetupError::Restless {
        measures: Box::new(measures),
        asked: spec.rest,
        patience: spec.patience,
    })
}

/// √(d̄/a) of the grains (s).
pub(super) fn time_unit(simulation: &Simulation, acceleration: f64) -> f64 {
    let n = simulation.grains.len();
    let radii = simulation.grains.place[..n].iter().map(|x| x[3]);
    (2.0 * radii.sum::<f64>() / n.max(1) as f64 / acceleration).sqrt()
}

impl Simulation {
    /// Multiplies velocities and spins of all free grains by a factor. Accounts of momentum and energy
    /// start anew.
    pub fn damp(&mut self, factor: f64) {
        self.forget_observation();
        for i in 0..self.grains.len() {
            if self.grains.is_fixed(i) {
                continue;
            }
            for row in [&mut self.grains.motion[i], &mut self.grains.turn[i]] {
                row[..3].iter_mut().for_each(|c| *c *= factor);
            }
        }
        self.damp_clumps(factor);
        self.open_account();
    }
}
