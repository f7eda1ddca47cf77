//! Packings in steady shear: a periodic cell sheared by its boundaries at a given rate and pressure.
//!
//! ```text
//! γ̇ = I √(p/ρ_s)/d,     φ → φ + g ln(p/p̄) I        after every stretch of shear, at most ± δ
//! ```
//! p̄ is the mean over the stretch: near its solid fraction φ_c a flow of hard grains has p ∝ (I(φ))⁻², φ_c − φ ∝ I (da Cruz et
//! al., *Phys. Rev. E* 72 (2005) 021309), so that ln p is steeper in φ the smaller I is. The box is made larger or smaller between
//! two stretches with its grains carried: shear stands still for a fiftieth of unit strain after each twentieth, its profile kept. A cell
//! whose mean pressure is more than twice or less than half of what was asked for is refused. What comes out is [`ShearedCell`], with the means over the last part of the strain.

use super::ingredients::Ingredient;
use super::insertion::insert_in_cube;
use super::sheared_cell::ShearedCell;
use super::watch::{Look, Watch, stopped};
use crate::boundaries::{BoxMotion, Edge};
use crate::contact::Laws;
use crate::grains::Grain;
use crate::setup::{Setup, SetupError, Threads, check};
use crate::simulation::Simulation;
use nalgebra::{Matrix3, Vector3};
use serde::{Deserialize, Serialize};
use std::fmt;

/// A cell to be sheared (SI).
#[derive(Clone, Debug)]
pub struct Shearing {
    /// Grains in it.
    pub grains: usize,
    /// What they are.
    pub ingredients: Vec<Ingredient>,
    /// Laws of their contacts.
    pub laws: Laws,
    /// Diameter d (m) and density ρ_s (kg/m³) that I is taken with.
    pub diameter: f64,
    /// See `diameter`.
    pub density: f64,
    /// Wanted pressure p (Pa).
    pub pressure: f64,
    /// Wanted inertial number I.
    pub inertial: f64,
    /// Shear from the start (–).
    pub strain: f64,
    /// Time step (s).
    pub timestep: f64,
    /// Seed of all random numbers.
    pub seed: u64,
}

/// How a cell came out.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ShearingReport {
    /// Mean over the last part of the strain: solid fraction, pressure (Pa), I and |τ|/p.
    pub solid_fraction: f64,
    /// See `solid_fraction`.
    pub pressure: f64,
    /// See `solid_fraction`.
    pub inertial: f64,
    /// See `solid_fraction`.
    pub friction: f64,
    /// Steps made.
    pub steps: u64,
}

impl fmt::Display for ShearingReport {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        write!(
            f,
            "sheared at I = {:.4} under {:.4e} Pa: solid fraction {:.4}, |tau|/p {:.4}; {} steps",
            self.inertial, self.pressure, self.solid_fraction, self.friction, self.steps
        )
    }
}

/// Solid fraction of the cloud, and that from which on it is sheared.
const CLOUD: f64 = 0.28;
const LOOSE: f64 = 0.5;
/// Shear of a stretch, looks at the stress in it, and shear for whose time the box changes between two.
const STRETCH: f64 = 0.05;
const LOOKS: u64 = 8;
const CHANGE: f64 = 0.02;
/// Factor by which the pressure of a cell may miss what was asked for.
const AWAY: f64 = 2.0;
/// g and δ.
const GAIN: f64 = 0.03;
const MOST: f64 = 0.01;
/// Part of the strain at its end over which means are taken.
const LAST: f64 = 0.4;

impl Shearing {
    fn validate(&self) -> Result<(), SetupError> {
        let positive = |key: &str, value: f64| {
            let key = format!("shearing.{key}");
            check(&key, value, "> 0", |v| v > 0.0)
        };
        positive("diameter", self.diameter)?;
        positive("density", self.density)?;
        positive("pressure", self.pressure)?;
        positive("timestep", self.timestep)?;
        check("shearing.grains", self.grains as f64, "at least 64", |n| {
            n >= 64.0
        })?;
        check("shearing.inertial", self.inertial, "in [1e-4, 1]", |i| {
            (1e-4..=1.0).contains(&i)
        })?;
        check("shearing.strain", self.strain, "in [1, 1000]", |s| {
            (1.0..=1000.0).contains(&s)
        })
    }

    /// γ̇ (1/s).
    pub fn rate(&self) -> f64 {
        self.inertial * (self.pressure / self.density).sqrt() / self.diameter
    }

    /// A loose cloud in a periodic cube.
    fn cloud(&self) -> Result<Simulation, SetupError> {
        let (mut domain, mut grains, _) =
            insert_in_cube(&self.ingredients, self.grains, self.seed, CLOUD)?;
        let edge = domain.lengths().x;
        // Grains of one size less than the mean leave room: the box is the smallest that is loose.
        let solid: f64 = grains.iter().map(Grain::volume).sum();
        let factor = (solid / CLOUD).cbrt() / edge;
        if factor > 1.0 {
            domain.upper *= factor;
            grains.iter_mut().for_each(|g| g.position *= factor);
        }
        Simulation::new(Setup {
            domain,
            gravity: Vector3::zeros(),
            law: self.laws.clone(),
            grains,
            walls: Vec::new(),
            bodies: Vec::new(),
            timestep: self.timestep,
            threads: Threads::Serial,
        })
    }
}

/// Shears a cell to a steady state and keeps it.
///
/// # Errors
/// If a number is out of its range, the pressure was not reached, the grains fly apart, or `watch` stops it.
pub fn shear(
    spec: &Shearing,
    watch: &mut dyn Watch,
) -> Result<(ShearedCell, ShearingReport), SetupError> {
    let (mut simulation, report) = steady_shear(spec, watch)?;
    let mut cell = ShearedCell::of(&mut simulation, spec.rate());
    (cell.pressure, cell.friction) = (report.pressure, report.friction);
    cell.inertial = report.inertial;
    Ok((cell, report))
}

/// The cell in steady shear, as a run that goes on.
///
/// # Errors
/// As [`shear`].
pub fn steady_shear(
    spec: &Shearing,
    watch: &mut dyn Watch,
) -> Result<(Simulation, ShearingReport), SetupError> {
    spec.validate()?;
    let rate = spec.rate();
    let mut simulation = spec.cloud()?;
    let solid: f64 = simulation.grain_list().iter().map(Grain::volume).sum();
    let steps = |strain: f64| (strain / (rate * spec.timestep)).ceil().max(1.0) as u64;
    resize(&mut simulation, solid / LOOSE, steps(1.0))?;
    let mut strain = 0.0;
    let (mut sum, mut count) = (Matrix3::zeros(), 0.0);
    let (mut fractions, mut blocks) = (0.0, 0.0);
    let each = steps(STRETCH / LOOKS as f64);
    while strain < spec.strain {
        simulation.set_box_motion(BoxMotion::Shear {
            across: 2,
            rate,
            carry: true,
        })?;
        let mut stress = Matrix3::zeros();
        for _ in 0..LOOKS {
            simulation.advance(each)?;
            stress += simulation.stress() / LOOKS as f64;
        }
        let measures = simulation.rest_measures(rate * rate * spec.diameter);
        stopped(watch.look(&mut Look::passing(&measures)))?;
        strain += LOOKS as f64 * each as f64 * spec.timestep * rate;
        let volume = simulation.domain().lengths().product();
        if strain > (1.0 - LAST) * spec.strain {
            sum += stress;
            count += 1.0;
            fractions += solid / volume;
            blocks += 1.0;
        }
        if strain < spec.strain {
            let pressure = (-stress.trace() / 3.0).max(1e-3 * spec.pressure);
            let way = GAIN * spec.inertial.max(0.01) * (spec.pressure / pressure).ln();
            let wanted = solid / volume + way.clamp(-MOST, MOST);
            resize(&mut simulation, solid / wanted, steps(CHANGE))?;
        }
    }
    let stress = sum / count;
    let pressure = -stress.trace() / 3.0;
    // A cell that never jammed, or was shut in, is no packing of the flow asked for.
    let reached = pressure / spec.pressure;
    if !(1.0 / AWAY..=AWAY).contains(&reached) {
        return Err(SetupError::OutOfRange {
            key: "pressure of the sheared cell over the one asked for".into(),
            value: reached,
            allowed: "between a half and two: shear it by more, or faster",
        });
    }
    let report = ShearingReport {
        solid_fraction: fractions / blocks,
        pressure,
        inertial: rate * spec.diameter * (spec.density / pressure).sqrt(),
        friction: 0.5 * (stress[(0, 2)] + stress[(2, 0)]).abs() / pressure,
        steps: simulation.steps_done(),
    };
    Ok((simulation, report))
}

/// Brings a box to a volume (m³) in so many steps, its grains carried.
fn resize(simulation: &mut Simulation, volume: f64, steps: u64) -> Result<(), SetupError> {
    let (time, lengths) = (simulation.time(), simulation.domain().lengths());
    let factor = (volume / lengths.product()).cbrt();
    let end = time + steps as f64 * simulation.timestep();
    let edge = |k: usize| Edge::Lengths(vec![(time, lengths[k]), (end, factor * lengths[k])]);
    simulation.set_box_motion(BoxMotion::Stretch {
        edges: [edge(0), edge(1), edge(2)],
        carry: true,
    })?;
    simulation.advance(steps)?;
    simulation.set_box_motion(BoxMotion::Rest)
}
