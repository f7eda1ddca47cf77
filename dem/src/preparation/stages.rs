//! A bed settled under strong gravity and taken to weaker ones, each with its own stiffness and step.
//!
//! Grains dropped at the final gravity of a small body would need hours of its time; dropped at 1 g and
//! released at once they would burst apart. So gravity falls in stages, and at each the stiffness and
//! the step are chosen anew (Thuillet 2019, §4.2.1 and §5.1.3, where both were found by trial). Here the
//! stiffness follows gravity (`stiffness.rs`) and contacts keep their springs, as displacements, from
//! stage to stage: all forces then fall together and the bed stays in balance.

use super::relaxation::{Relaxation, relax_along};
use super::rest::{Rest, RestMeasures};
use super::stiffness::{self, MeanGrain};
use super::watch::{Trail, Watch, out_of_place};
use crate::clumps::Clump;
use crate::contact::{LawTable, Laws};
use crate::grains::Grain;
use crate::setup::{Setup, SetupError, check, check_gravity};
use crate::simulation::Simulation;
use crate::timestep::{self, Conditions, Shares};
use nalgebra::Vector3;
use serde::{Deserialize, Serialize};
use std::fmt;

/// Magnitudes of gravity and how grains come to rest under each.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Stages {
    /// Magnitudes (m/s²), as a rule falling; the direction is that of the setup's gravity.
    pub gravities: Vec<f64>,
    /// Largest overlap wanted, over the smallest radius.
    pub largest_overlap: f64,
    /// Steps of a contact.
    pub steps_per_contact: f64,
    /// γ of the damping (see [`Relaxation`]).
    pub damping: f64,
    /// When a stage is done.
    pub rest: Rest,
    /// Longest time of a stage, in √(d̄/g).
    pub patience: f64,
}

impl Stages {
    /// The thesis' choices (overlap of 1 %, 30 steps a contact), lightly damped.
    pub fn at(gravities: &[f64]) -> Stages {
        Stages {
            gravities: gravities.to_vec(),
            largest_overlap: 0.01,
            steps_per_contact: 30.0,
            damping: 0.2,
            rest: Rest::default(),
            patience: 1000.0,
        }
    }

    fn validate(&self) -> Result<(), SetupError> {
        let count = self.gravities.len() as f64;
        check("stages.gravities", count, "at least one", |n| n > 0.0)?;
        for (k, &g) in self.gravities.iter().enumerate() {
            check(&format!("stages.gravities[{k}]"), g, "> 0 m/s²", |g| {
                g > 0.0
            })?;
        }
        check(
            "stages.largest_overlap",
            self.largest_overlap,
            "in (0, 0.1]",
            |x| x > 0.0 && x <= 0.1,
        )?;
        check(
            "stages.steps_per_contact",
            self.steps_per_contact,
            "≥ 10",
            |n| n >= 10.0,
        )
    }
}

/// How a stage went.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct StageReport {
    /// Magnitude of gravity (m/s²).
    pub gravity: f64,
    /// Factor on the stiffnesses of the setup's laws.
    pub stiffness_factor: f64,
    /// Step (s).
    pub timestep: f64,
    /// Steps made.
    pub steps: u64,
    /// Largest overlap met, over the harmonic mean radius.
    pub largest_overlap: f64,
    /// How far the centre of mass sank (m).
    pub sank: f64,
    /// How close to rest it ended.
    pub rest: RestMeasures,
}

impl fmt::Display for StageReport {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        write!(
            f,
            "g = {:.3e} m/s²: stiffness × {:.3e}, step {:.3e} s, {} steps, overlap ≤ {:.2e} R, sank {:.3e} m; {}",
            self.gravity,
            self.stiffness_factor,
            self.timestep,
            self.steps,
            self.largest_overlap,
            self.sank,
            self.rest
        )
    }
}

/// Lets the grains of a setup, some of them as clumps, come to rest under each gravity in turn.
///
/// The setup's step is not used, its laws up to a factor on their stiffness. The simulation is handed
/// back under the last stage's laws, step and gravity, its time counted from that stage's beginning.
///
/// # Errors
/// If a number is out of its range, a stage does not come to rest or the grains fly apart.
pub fn settle_in_stages(
    setup: Setup,
    clumps: &[Clump],
    stages: &Stages,
    watch: &mut dyn Watch,
) -> Result<(Simulation, Vec<StageReport>), SetupError> {
    stages.validate()?;
    let weight = setup.gravity.norm();
    check("gravity", weight, "a direction: longer than 0", |g| g > 0.0)?;
    let (down, laws) = (setup.gravity / weight, setup.law.clone());
    let mut trail = Trail::of(watch);
    let (mut simulation, mut reports, mut begun) = match watch.goes_on() {
        Some(midway) => {
            let (begun, reports) = Begun::gone_on(&mut trail)?;
            let &g = stages
                .gravities
                .get(reports.len())
                .ok_or_else(|| SetupError::Record("a stage of more than there are".into()))?;
            let setup = Setup {
                law: stiffness::scaled(&laws, begun.factor),
                gravity: down * g,
                timestep: begun.step,
                ..setup
            };
            (
                Simulation::resume(setup, &midway.record)?,
                reports,
                Some(begun),
            )
        }
        None => (stages.start(setup, clumps, &down)?, Vec::new(), None),
    };
    for &g in &stages.gravities[reports.len()..] {
        let stage = match begun.take() {
            Some(begun) => begun,
            None => stages.begin(&mut simulation, &laws, (&down, g))?,
        };
        let relaxation = Relaxation {
            damping: stages.damping,
            rest: stages.rest,
            patience: stages.patience,
            acceleration: g,
        };
        let counts = stage.counts(&reports);
        trail.enter(&counts);
        let rest = relax_along(&mut simulation, &relaxation, &mut trail, watch)?;
        trail.leave(counts.len());
        reports.push(StageReport {
            gravity: g,
            stiffness_factor: stage.factor,
            timestep: stage.step,
            steps: simulation.steps_done(),
            largest_overlap: simulation.largest_overlap(),
            sank: stage.before - height(&simulation, &down),
            rest,
        });
    }
    Ok((simulation, reports))
}

/// A stage that has begun.
struct Begun {
    factor: f64,
    /// Step (s).
    step: f64,
    /// Height of the centre of mass before it (m).
    before: f64,
}

impl Begun {
    /// The stage and the reports of those before it, as counts of a loop.
    fn counts(&self, reports: &[StageReport]) -> Vec<u64> {
        let own = [self.factor, self.step, self.before].map(f64::to_bits);
        let mut counts = vec![reports.len() as u64];
        counts.extend(own);
        counts.extend(reports.iter().flat_map(StageReport::counts));
        counts
    }

    /// The same of stages that go on.
    fn gone_on(trail: &mut Trail) -> Result<(Begun, Vec<StageReport>), SetupError> {
        let cut = || SetupError::Record("the stages of the preparation are cut short".into());
        let [done, own @ ..] = trail.next::<4>()?.ok_or_else(cut)?;
        let [factor, step, before] = own.map(f64::from_bits);
        let positive = |x: f64| x > 0.0 && x.is_finite();
        if !(positive(factor) && positive(step) && before.is_finite()) {
            return Err(out_of_place());
        }
        let mut reports = Vec::new();
        for _ in 0..done {
            reports.push(StageReport::of_counts(trail.next()?.ok_or_else(cut)?));
        }
        let begun = Begun {
            factor,
            step,
            before,
        };
        Ok((begun, reports))
    }
}

impl StageReport {
    fn counts(&self) -> [u64; 10] {
        let rest = &self.rest;
        let [a, b, c] = [self.gravity, self.stiffness_factor, self.timestep].map(f64::to_bits);
        let [d, e] = [self.largest_overlap, self.sank].map(f64::to_bits);
        let rest = [rest.kinetic, rest.unbalanced, rest.acceleration, rest.time];
        let [f, g, h, i] = rest.map(f64::to_bits);
        [a, b, c, self.steps, d, e, f, g, h, i]
    }

    fn of_counts(counts: [u64; 10]) -> StageReport {
        let [a, b, c, _, d, e, f, g, h, i] = counts.map(f64::from_bits);
        StageReport {
            gravity: a,
            stiffness_factor: b,
            timestep: c,
            steps: counts[3],
            largest_overlap: d,
            sank: e,
            rest: RestMeasures {
                kinetic: f,
                unbalanced: g,
                acceleration: h,
                time: i,
            },
        }
    }
}

/// What a stage runs with.
struct Chosen {
    laws: Laws,
    factor: f64,
    conditions: Conditions,
}

impl Stages {
    /// The grains under the first stage's laws, no step made.
    fn start(
        &self,
        mut setup: Setup,
        clumps: &[Clump],
        down: &Vector3<f64>,
    ) -> Result<Simulation, SetupError> {
        setup.gravity = down * self.gravities[0];
        setup.law = self.choose(&setup.law, &setup.grains, setup.gravity)?.laws;
        // Any will do: each stage sets its own before a step is made.
        setup.timestep = 1.0;
        let mut simulation = Simulation::new(setup)?;
        if !clumps.is_empty() {
            simulation.clump(clumps)?;
        }
        Ok(simulation)
    }

    /// Goes on to the stage of a gravity.
    fn begin(
        &self,
        simulation: &mut Simulation,
        laws: &Laws,
        (down, g): (&Vector3<f64>, f64),
    ) -> Result<Begun, SetupError> {
        let grains = simulation.grain_list();
        let chosen = self.choose(laws, &grains, down * g)?;
        let step = simulation.choose_step(&chosen.laws, &chosen.conditions, &self.shares())?;
        simulation.go_on_under(&chosen.laws, down * g, step)?;
        Ok(Begun {
            factor: chosen.factor,
            step,
            before: height(simulation, down),
        })
    }

    fn choose(
        &self,
        laws: &Laws,
        grains: &[Grain],
        gravity: Vector3<f64>,
    ) -> Result<Chosen, SetupError> {
        let conditions = Conditions::of(grains, &gravity);
        let mean = MeanGrain::of(grains)?;
        let factor = stiffness::factor(laws, &mean, &conditions, self.largest_overlap)?;
        Ok(Chosen {
            laws: stiffness::scaled(laws, factor),
            factor,
            conditions,
        })
    }

    fn shares(&self) -> Shares {
        Shares {
            steps_per_contact: self.steps_per_contact,
            ..Shares::default()
        }
    }
}

/// Height of the free grains' centre of mass against gravity (m).
fn height(simulation: &Simulation, down: &Vector3<f64>) -> f64 {
    let (mut moment, mut mass) = (0.0, 0.0);
    for i in 0..simulation.grains.len() {
        if !simulation.grains.is_fixed(i) {
            let m = simulation.grains.mass[i];
            let x = Vector3::from_fn(|k, _| simulation.grains.place[i][k]);
            moment -= m * x.dot(down);
            mass += m;
        }
    }
    moment / mass
}

impl Simulation {
    /// The step that laws and conditions allow for these grains and walls (s).
    fn choose_step(
        &self,
        laws: &Laws,
        conditions: &Conditions,
        shares: &Shares,
    ) -> Result<f64, SetupError> {
        let table = LawTable::new(laws)?;
        let limits = timestep::limits_of(&self.classes(), &table, conditions, shares);
        Ok(timestep::choose(limits, shares.safety).seconds)
    }

    /// Goes on under other laws of the same composition, another gravity and another step.
    ///
    /// Contacts keep their springs as displacements. Time, steps, the largest overlap and the accounts
    /// of momentum and energy start anew.
    ///
    /// # Errors
    /// If a number is out of its range, the laws need other springs, or a wall or the box moves. Nothing
    /// has changed then.
    pub fn go_on_under(
        &mut self,
        laws: &Laws,
        gravity: Vector3<f64>,
        timestep: f64,
    ) -> Result<(), SetupError> {
        let table = LawTable::new(laws)?;
        check("timestep", timestep, "> 0 s", |v| v > 0.0)?;
        check_gravity(&gravity)?;
        if table.composition() != self.law.composition()
            || table.materials() != self.law.materials()
        {
            return Err(SetupError::Composition(
                "a run goes on only under laws of the same parts, for as many materials",
            ));
        }
        let speed = self.moving_box.drift.fastest();
        let rule = "0 m/s, as time starts anew";
        check("speed of the box's images", speed, rule, |v| v == 0.0)?;
        let moving = self.walls.iter().position(|wall| wall.moves());
        if let Some(wall) = moving {
            let rule = "a resting wall, as time starts anew";
            return check(&format!("walls[{wall}]: motion"), 1.0, rule, |_| false);
        }
        // Velocities come to the time of the positions, where the new step can start from.
        self.give_velocity(|grain| grain.velocity);
        self.set_laws(table);
        self.set_gravity(gravity)?;
        self.timestep = timestep;
        self.steps = 0;
        self.deepest = 0.0;
        self.rebuild();
        self.open_account();
        Ok(())
    }
}
