//! Grains poured into a running simulation, batch by batch.
//!
//! All grains are drawn at the start, in one order. Every `interval` the next ones are put at random
//! places of the source, as many as fit loosely, without touching what is there.

use super::ingredients::{Amount, Ingredient, draw};
use super::insertion::{Insertion, Places};
use super::relaxation::{Relaxation, relax_along};
use super::rest::RestMeasures;
use super::size_report::SizeReport;
use super::watch::{Trail, Watch, out_of_place};
use crate::grains::Grain;
use crate::region::Region;
use crate::setup::{SetupError, check};
use crate::simulation::Simulation;
use nalgebra::Vector3;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use serde::{Deserialize, Serialize};
use std::fmt;

/// What is poured from where.
#[derive(Clone, Debug)]
pub struct Pouring {
    /// Where grains appear; whole grains lie in it.
    pub source: Region,
    /// What they are.
    pub ingredients: Vec<Ingredient>,
    /// How much in all; a solid fraction is one of the source and seldom meant.
    pub amount: Amount,
    /// Their velocity (m/s).
    pub velocity: Vector3<f64>,
    /// Time from batch to batch (s); none: the time in which grains leave the source.
    pub interval: Option<f64>,
    /// Solid fraction of the source up to which a batch fills it.
    pub fill: f64,
    /// Seed of all random numbers.
    pub seed: u64,
}

/// A fill at which a grain finds its place in a few tries.
pub const FILL: f64 = 0.15;

/// Tries for one grain of a batch; where it finds no room it waits for the next one.
const TRIES: u32 = 500;
/// Batches in a row that may find no room at all.
const PATIENCE: u32 = 1000;

/// How the pouring went.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct PouringReport {
    /// Grains poured.
    pub grains: usize,
    /// Batches it took.
    pub batches: u32,
    /// Time from batch to batch (s).
    pub interval: f64,
    /// Sizes of each ingredient against its law.
    pub sizes: Vec<SizeReport>,
    /// How close to rest it ended.
    pub rest: RestMeasures,
}

impl fmt::Display for PouringReport {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        write!(
            f,
            "{} grains poured in {} batches, {:.3e} s apart; {}",
            self.grains, self.batches, self.interval, self.rest
        )?;
        let mut sizes = self.sizes.iter().enumerate();
        sizes.try_for_each(|(k, sizes)| write!(f, "\ningredient {k}: {sizes}"))
    }
}

/// Pours grains in and lets them come to rest.
///
/// # Errors
/// If a number is out of its range, the source stays blocked, or the grains do not come to rest.
pub fn pour(
    simulation: &mut Simulation,
    spec: &Pouring,
    relaxation: &Relaxation,
    watch: &mut dyn Watch,
) -> Result<PouringReport, SetupError> {
    let mut enter = |simulation: &mut Simulation, batch: &[Grain], _: &mut ChaCha8Rng| {
        simulation.insert(batch).map(drop)
    };
    pour_by(simulation, spec, relaxation, watch, &mut enter)
}

/// Puts what stands for a batch into a simulation.
pub(super) type Enter<'a> =
    &'a mut dyn FnMut(&mut Simulation, &[Grain], &mut ChaCha8Rng) -> Result<(), SetupError>;

/// The same with a way of its own in which a batch of balls comes in.
pub(super) fn pour_by(
    simulation: &mut Simulation,
    spec: &Pouring,
    relaxation: &Relaxation,
    watch: &mut dyn Watch,
    enter: Enter,
) -> Result<PouringReport, SetupError> {
    let source = spec.source(simulation);
    source.validate()?;
    check("pouring.fill", spec.fill, "in (0, 0.3]", |v| {
        v > 0.0 && v <= 0.3
    })?;
    let volume = source.volume()?;
    let mut random = ChaCha8Rng::seed_from_u64(spec.seed);
    let grains = draw(&spec.ingredients, spec.amount, volume, &mut random)?;
    let interval = spec.interval(simulation, &source)?;
    let steps = (interval / simulation.timestep()).ceil().max(1.0) as u64;
    let mut trail = Trail::of(watch);
    let (mut next, mut batches, mut blocked) = (0, 0, 0);
    if let Some(counts) = trail.next()? {
        (next, batches, blocked) = gone_on(counts, &grains, &mut random)?;
    }
    while next < grains.len() {
        let batch = place(
            simulation,
            &source,
            &grains[next..],
            spec.fill * volume,
            &mut random,
        )?;
        enter(simulation, &batch, &mut random)?;
        next += batch.len();
        batches += 1;
        blocked = if batch.is_empty() { blocked + 1 } else { 0 };
        if blocked > PATIENCE {
            return Err(SetupError::Full {
                grain: next,
                grains: grains.len(),
                radius: grains[next].radius,
                tries: TRIES * PATIENCE,
                reached: 0.0,
                asked: spec.fill,
            });
        }
        simulation.advance(steps)?;
        let measures = simulation.rest_measures(relaxation.acceleration);
        let counts = counts_of((next, batches, blocked), &random);
        trail.show(watch, simulation, (&measures, &counts))?;
    }
    trail.enter(&counts_of((next, batches, blocked), &random));
    let rest = relax_along(simulation, relaxation, &mut trail, watch)?;
    let sizes = spec.ingredients.iter();
    Ok(PouringReport {
        grains: grains.len(),
        batches,
        interval,
        sizes: sizes
            .map(|i| SizeReport::of(&i.sizes, &i.radii(&grains)))
            .collect(),
        rest,
    })
}

/// Grains that are in, batches and batches in a row without room; then the place in the stream of random words.
fn counts_of((next, batches, blocked): (usize, u32, u32), random: &ChaCha8Rng) -> [u64; 5] {
    let word = random.get_word_pos();
    let [low, high] = [word as u64, (word >> 64) as u64];
    [next as u64, batches.into(), blocked.into(), low, high]
}

/// The same of a pouring that goes on.
fn gone_on(
    [next, batches, blocked, low, high]: [u64; 5],
    grains: &[Grain],
    random: &mut ChaCha8Rng,
) -> Result<(usize, u32, u32), SetupError> {
    random.set_word_pos(u128::from(high) << 64 | u128::from(low));
    match (next as usize, batches.try_into(), blocked.try_into()) {
        (next, Ok(batches), Ok(blocked)) if next <= grains.len() && blocked <= PATIENCE => {
            Ok((next, batches, blocked))
        }
        _ => Err(out_of_place()),
    }
}

impl Pouring {
    fn source(&self, simulation: &Simulation) -> Insertion {
        Insertion {
            region: self.source.clone(),
            domain: *simulation.domain(),
            ingredients: self.ingredients.clone(),
            amount: self.amount,
            gap: 0.0,
            velocity: self.velocity,
            tries: TRIES,
            seed: self.seed,
        }
    }

    /// The time given, or that of a fall from the source's top to below its bottom:
    /// h = v t + g t²/2 along gravity.
    fn interval(&self, simulation: &Simulation, source: &Insertion) -> Result<f64, SetupError> {
        if let Some(interval) = self.interval {
            check("pouring.interval", interval, "> 0 s", |v| v > 0.0)?;
            return Ok(interval);
        }
        let gravity = simulation.gravity();
        let g = gravity.norm();
        check("gravity", g, "> 0 m/s², or give pouring.interval", |g| {
            g > 0.0
        })?;
        let down = gravity / g;
        let [low, high] = source.block()?;
        let height = (high - low).component_mul(&down).abs().sum();
        let v = self.velocity.dot(&down).max(0.0);
        Ok(2.0 * height / (v + (v * v + 2.0 * g * height).sqrt()))
    }
}

/// Places the next grains, up to a volume (m³), where there is room.
fn place(
    simulation: &mut Simulation,
    source: &Insertion,
    grains: &[Grain],
    volume: f64,
    random: &mut ChaCha8Rng,
) -> Result<Vec<Grain>, SetupError> {
    let mut filled = 0.0;
    // A source smaller than a grain's share still lets one through at a time.
    let fits = |grain: &&Grain| {
        let first = filled == 0.0;
        filled += grain.volume();
        first || filled <= volume
    };
    let grains: Vec<Grain> = grains.iter().take_while(fits).copied().collect();
    let most = grains.iter().map(|g| g.radius).fold(0.0, f64::max);
    let [low, high] = source.block()?;
    // Only grains that reach into the source stand in the way.
    let periodic = simulation.domain().periodic;
    let near = |g: &Grain| {
        let reach = g.radius + most;
        let beside = |k: usize| g.position[k] + reach > low[k] && g.position[k] - reach < high[k];
        (0..3).all(|k| periodic[k] || beside(k))
    };
    let mut present = simulation.grain_list();
    present.retain(near);
    let mut places = Places::new(source, &present, &grains)?;
    let mut batch = Vec::new();
    for grain in grains {
        let Some(position) = places.find(grain.radius, random) else {
            break;
        };
        let grain = Grain {
            position,
            velocity: source.velocity,
            ..grain
        };
        places.put(&grain);
        batch.push(grain);
    }
    Ok(batch)
}
