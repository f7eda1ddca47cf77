//! A loose cloud pulled to its centre until it has the wanted solid fraction.
//!
//! ```text
//! F = -m a (x - c)/max(|x - c|, d̄)        on every free grain; c centre, a acceleration
//! ```
//! So Kappel et al. (2020, §3.1) make their boulders. Where the cloud comes to rest too loose, a grows;
//! where it has the solid fraction in a ball about c, it is stopped and let go. What springs back is
//! pulled in once more, to a fraction as much higher. Cohesive grains then stay where they are; others
//! only as far as their friction holds them.

use super::coordination::{Coordination, HELD_BY_FRICTION};
use super::relaxation::{Relaxation, time_unit};
use super::rest::RestMeasures;
use super::solid_fraction::solid_fraction;
use super::watch::{Trail, Watch, out_of_place};
use crate::loads::Load;
use crate::region::Region;
use crate::setup::{SetupError, check};
use crate::simulation::Simulation;
use crate::snapshot::Snapshot;
use nalgebra::Vector3;
use serde::{Deserialize, Serialize};
use std::fmt;

/// How a cloud is compacted.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CentralCompaction {
    /// c (m).
    pub center: Vector3<f64>,
    /// Radius of the ball about c in which the solid fraction is measured (m).
    pub probe: f64,
    /// Solid fraction wanted.
    pub solid_fraction: f64,
    /// How close to it, relative.
    pub tolerance: f64,
    /// Acceleration that it begins with, and the largest (m/s²).
    pub accelerations: [f64; 2],
    /// How grains are brought to rest, in units of the first acceleration.
    pub relaxation: Relaxation,
}

/// How the compaction went.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct CompactionReport {
    /// Solid fraction wanted.
    pub asked: f64,
    /// Solid fraction in the ball, grains let go and at rest.
    pub solid_fraction: f64,
    /// Radius of that ball (m).
    pub probe: f64,
    /// Acceleration that it took (m/s²).
    pub acceleration: f64,
    /// Pulls that it took.
    pub pulls: u32,
    /// How close to rest it ended.
    pub rest: RestMeasures,
}

impl fmt::Display for CompactionReport {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        write!(
            f,
            "solid fraction {:.4} ({:.4} asked for; porosity {:.1} %) in a ball of radius {:.4e} m, after {} \
             pulls at up to {:.3e} m/s²; {}",
            self.solid_fraction,
            self.asked,
            100.0 * (1.0 - self.solid_fraction),
            self.probe,
            self.pulls,
            self.acceleration,
            self.rest
        )
    }
}

/// Pulls of what has sprung back.
const PULLS: u32 = 12;
/// Factor from one pull to the next where grains rest too loose.
const HARDER: f64 = 1.4;
/// Looks at the solid fraction in the time √(d̄/a).
const LOOKS: f64 = 10.0;

/// Pulls grains together; loads there were are taken off.
///
/// # Errors
/// If a number is out of its range, gravity is on, or the solid fraction is not met.
pub fn compact(
    simulation: &mut Simulation,
    spec: &CentralCompaction,
    watch: &mut dyn Watch,
) -> Result<CompactionReport, SetupError> {
    spec.validate(simulation)?;
    let mut trail = Trail::of(watch);
    let mut reached = spec.measure(simulation);
    let (first, mut target, mut acceleration, mut pulled) = match trail.next()? {
        Some([pull, target, acceleration, pulled]) => {
            let [target, acceleration] = [target, acceleration].map(f64::from_bits);
            let pull = u32::try_from(pull)
                .ok()
                .filter(|pull| (1..=PULLS).contains(pull));
            let pull = pull.filter(|_| target > 0.0 && acceleration > 0.0);
            (
                pull.ok_or_else(out_of_place)?,
                target,
                acceleration,
                pulled != 0,
            )
        }
        None if reached > spec.solid_fraction * (1.0 + spec.tolerance) => {
            return Err(spec.missed(reached, "the cloud is denser before it is pulled"));
        }
        None => (1, spec.solid_fraction, spec.accelerations[0], false),
    };
    for pull in first..=PULLS {
        let counts = |acceleration: f64, pulled: bool| {
            let [target, acceleration] = [target, acceleration].map(f64::to_bits);
            [pull.into(), target, acceleration, pulled.into()]
        };
        if !pulled {
            trail.enter(&counts(acceleration, false));
            spec.pull(simulation, (target, &mut acceleration), &mut trail, watch)?;
            trail.leave(4);
        }
        trail.enter(&counts(acceleration, true));
        let rest = spec.let_go(simulation, &mut trail, watch)?;
        trail.leave(4);
        pulled = false;
        reached = spec.measure(simulation);
        let missing = spec.solid_fraction - reached;
        if missing.abs() <= spec.tolerance * spec.solid_fraction {
            return Ok(CompactionReport {
                asked: spec.solid_fraction,
                solid_fraction: reached,
                probe: spec.probe,
                acceleration,
                pulls: pull,
                rest,
            });
        }
        if missing < 0.0 {
            return Err(spec.missed(
                reached,
                "the pull is too hard for so loose a packing: begin softer",
            ));
        }
        target += 0.7 * missing;
    }
    Err(spec.missed(reached, "the grains spring back when they are let go"))
}

/// Whether grains have nearly the contacts of a tree, 2(N - 1)/N, or more.
fn hangs_together(simulation: &mut Simulation) -> bool {
    let mut snapshot = Snapshot::default();
    simulation.snapshot(&mut snapshot);
    Coordination::of(&snapshot, HELD_BY_FRICTION).all > 1.7
}

impl CentralCompaction {
    fn validate(&self, simulation: &Simulation) -> Result<(), SetupError> {
        for c in self.center.iter() {
            check("compaction.center", *c, "finite", |_| true)?;
        }
        check("compaction.probe", self.probe, "> 0 m", |v| v > 0.0)?;
        check(
            "compaction.solid_fraction",
            self.solid_fraction,
            "in (0, 0.7]",
            |v| v > 0.0 && v <= 0.7,
        )?;
        check("compaction.tolerance", self.tolerance, "in (0, 0.2]", |v| {
            v > 0.0 && v <= 0.2
        })?;
        let [first, most] = self.accelerations;
        check("compaction.acceleration", first, "> 0 m/s²", |v| v > 0.0)?;
        check(
            "compaction.largest_acceleration",
            most,
            "≥ the first",
            |v| v >= first,
        )?;
        let g = simulation.gravity().norm();
        check("gravity", g, "0 while a cloud is compacted", |g| g == 0.0)
    }

    fn missed(&self, reached: f64, why: &'static str) -> SetupError {
        SetupError::Density {
            reached,
            asked: self.solid_fraction,
            why,
        }
    }

    fn measure(&self, simulation: &mut Simulation) -> f64 {
        let probe = Region::Ball {
            center: self.center,
            radius: self.probe,
        };
        let grains = simulation.grain_list();
        solid_fraction(&grains, simulation.domain(), &probe)
    }

    /// Pulls until the solid fraction is there, harder where grains rest before. A cloud is pulled until
    /// it rests, for in flight it may have any fraction, but nothing carries it.
    fn pull(
        &self,
        simulation: &mut Simulation,
        (target, acceleration): (f64, &mut f64),
        trail: &mut Trail,
        watch: &mut dyn Watch,
    ) -> Result<(), SetupError> {
        // Sums of radii go by the order of the grains, which changes on the way.
        let (mut gathered, mut done, mut unit) = match trail.last()? {
            Some([gathered, look, pull, unit]) => {
                *acceleration = f64::from_bits(pull);
                (gathered != 0, look, f64::from_bits(unit))
            }
            None => {
                let unit = time_unit(simulation, *acceleration);
                (hangs_together(simulation), 0, unit)
            }
        };
        loop {
            let steps = (unit / LOOKS / simulation.timestep()).ceil().max(1.0);
            let keep = (-self.relaxation.damping * steps * simulation.timestep() / unit).exp();
            let looks = (self.relaxation.patience * LOOKS) as u64;
            let finite = unit.is_finite() && acceleration.is_finite();
            if !(finite && unit > 0.0 && *acceleration > 0.0 && done <= looks.max(1)) {
                return Err(out_of_place());
            }
            for look in done + 1..=looks.max(1) {
                self.load(simulation, *acceleration)?;
                simulation.advance(steps as u64)?;
                simulation.damp(keep);
                if gathered && self.measure(simulation) >= target {
                    return Ok(());
                }
                let rest = simulation.rest_measures(*acceleration);
                if self.relaxation.rest.holds(&rest) {
                    break;
                }
                let counts = [acceleration.to_bits(), unit.to_bits()];
                let counts = [gathered.into(), look, counts[0], counts[1]];
                trail.show(watch, simulation, (&rest, &counts))?;
            }
            (gathered, done) = (true, 0);
            let reached = self.measure(simulation);
            if reached >= target {
                return Ok(());
            }
            if *acceleration >= self.accelerations[1] {
                return Err(self.missed(reached, "the largest acceleration packs no denser"));
            }
            *acceleration = (HARDER * *acceleration).min(self.accelerations[1]);
            unit = time_unit(simulation, *acceleration);
        }
    }

    fn load(&self, simulation: &mut Simulation, acceleration: f64) -> Result<(), SetupError> {
        let samples = simulation.samples();
        let diameters: f64 = samples.iter().map(|g| 2.0 * g.radius).sum();
        let mean = diameters / samples.len().max(1) as f64;
        let load = |g: &crate::GrainSample| {
            let away = g.position - self.center;
            Load {
                grain: g.id,
                force: -g.mass * acceleration / away.norm().max(mean) * away,
                moment: Vector3::zeros(),
            }
        };
        let loads: Vec<Load> = samples.iter().map(load).collect();
        simulation.set_loads(&loads)
    }

    /// Stops the grains, takes the pull off and waits until they rest; without a pull there may be no
    /// contacts left whose forces could be compared.
    fn let_go(
        &self,
        simulation: &mut Simulation,
        trail: &mut Trail,
        watch: &mut dyn Watch,
    ) -> Result<RestMeasures, SetupError> {
        let (acceleration, relaxation) = (self.accelerations[0], &self.relaxation);
        let looks = (relaxation.patience * LOOKS) as u64;
        let (mut quiet, done, unit) = match trail.last()? {
            Some([quiet, look, unit]) => (quiet, look, f64::from_bits(unit)),
            None => {
                simulation.set_loads(&[])?;
                simulation.damp(0.0);
                (0, 0, time_unit(simulation, acceleration))
            }
        };
        if !(unit > 0.0 && unit.is_finite() && quiet < 3 && done <= looks) {
            return Err(out_of_place());
        }
        let steps = (unit / LOOKS / simulation.timestep()).ceil().max(1.0);
        let keep = (-relaxation.damping * steps * simulation.timestep() / unit).exp();
        for look in done + 1..=looks {
            simulation.advance(steps as u64)?;
            simulation.damp(keep);
            let rest = simulation.rest_measures(acceleration);
            quiet = if rest.kinetic <= relaxation.rest.kinetic {
                quiet + 1
            } else {
                0
            };
            if quiet >= 3 {
                return Ok(rest);
            }
            trail.show(watch, simulation, (&rest, &[quiet, look, unit.to_bits()]))?;
        }
        Err(SetupError::Restless {
            measures: Box::new(simulation.rest_measures(acceleration)),
            asked: self.relaxation.rest,
            patience: relaxation.patience,
        })
    }
}
