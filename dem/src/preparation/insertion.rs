//! Loose grains at random places, none touching another.
//!
//! Grains are drawn first and placed in falling order of size, each at the first random place where it
//! fits (random sequential addition). Equal spheres end near a solid fraction of 0.38; up to 0.3 it is
//! quick. Placed grains stand in cell lists by levels of size a factor of two apart, so that a try costs
//! the same however many there are and however different their sizes.

use super::ingredients::{Amount, Ingredient, draw};
use super::size_report::SizeReport;
use super::sizes::SizeLaw;
use super::solid_fraction::volume;
use crate::domain::Domain;
use crate::grains::Grain;
use crate::grid::Grid;
use crate::region::Region;
use crate::setup::{SetupError, check};
use nalgebra::Vector3;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use serde::{Deserialize, Serialize};
use std::fmt;

/// What to insert where.
#[derive(Clone, Debug)]
pub struct Insertion {
    /// Whole grains lie in it; along open axes of the box it must be bounded.
    pub region: Region,
    /// The box; its periodic axes wrap around.
    pub domain: Domain,
    /// What the grains are.
    pub ingredients: Vec<Ingredient>,
    /// How much of them.
    pub amount: Amount,
    /// Least gap between grains (m).
    pub gap: f64,
    /// Velocity of all of them (m/s).
    pub velocity: Vector3<f64>,
    /// Tries for one grain before the region counts as full.
    pub tries: u32,
    /// Seed of all random numbers.
    pub seed: u64,
}

/// Tries for one grain that fill up to 0.3 without fail.
pub const TRIES: u32 = 20_000;

/// Grains whose mean volume stands for that of more.
const SAMPLE: usize = 10_000;

/// What was inserted.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct InsertionReport {
    /// Grains inserted.
    pub grains: usize,
    /// Volume of the region inside the box (m³).
    pub region_volume: f64,
    /// Volume of the grains over that of the region.
    pub solid_fraction: f64,
    /// Random places tried.
    pub tries: u64,
    /// Sizes of each ingredient against its law.
    pub sizes: Vec<SizeReport>,
}

impl fmt::Display for InsertionReport {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        write!(
            f,
            "{} grains inserted, solid fraction {:.4} (their volume over the region's {:.4e} m³), {} places tried",
            self.grains, self.solid_fraction, self.region_volume, self.tries
        )?;
        self.sizes
            .iter()
            .enumerate()
            .try_for_each(|(k, sizes)| write!(f, "\ningredient {k}: {sizes}"))
    }
}

/// So many grains, none touching another, in a periodic cube of which cubes around grains of the largest mean size would take
/// the part `solid`.
///
/// # Errors
/// If a number is out of its range or a grain finds no room.
pub(super) fn insert_in_cube(
    ingredients: &[Ingredient],
    grains: usize,
    seed: u64,
    solid: f64,
) -> Result<(Domain, Vec<Grain>, InsertionReport), SetupError> {
    let means = ingredients.iter().map(|i| i.sizes.mean());
    let radius = means.fold(0.0, f64::max);
    let edge = (grains as f64 * 8.0 * radius.powi(3) / solid).cbrt();
    let domain = Domain {
        lower: Vector3::zeros(),
        upper: Vector3::repeat(edge),
        periodic: [true; 3],
    };
    let insertion = Insertion {
        region: Region::Everywhere,
        domain,
        ingredients: ingredients.to_vec(),
        amount: Amount::Grains(grains),
        gap: 0.0,
        velocity: Vector3::zeros(),
        tries: TRIES,
        seed,
    };
    let (grains, report) = insert_loose(&insertion, &[])?;
    Ok((domain, grains, report))
}

/// Inserts grains that touch neither each other nor any of `among`; the largest come first.
///
/// # Errors
/// If a number is out of its range or a grain finds no room.
pub fn insert_loose(
    spec: &Insertion,
    among: &[Grain],
) -> Result<(Vec<Grain>, InsertionReport), SetupError> {
    spec.validate()?;
    let volume = spec.volume()?;
    let mut random = ChaCha8Rng::seed_from_u64(spec.seed);
    let mut grains = draw(&spec.ingredients, spec.amount, volume, &mut random)?;
    let drawn: Vec<Vec<f64>> = spec.ingredients.iter().map(|i| i.radii(&grains)).collect();
    grains.sort_by(|a, b| b.radius.total_cmp(&a.radius));
    let asked: f64 = grains.iter().map(Grain::volume).sum();
    let mut places = Places::new(spec, among, &grains)?;
    let mut placed = 0.0;
    for k in 0..grains.len() {
        if let Some(position) = places.find(grains[k].radius, &mut random) {
            grains[k].position = position;
            grains[k].velocity = spec.velocity;
            places.put(&grains[k]);
            placed += grains[k].volume();
            continue;
        }
        return Err(SetupError::Full {
            grain: k,
            grains: grains.len(),
            radius: grains[k].radius,
            tries: spec.tries,
            reached: placed / volume,
            asked: asked / volume,
        });
    }
    let laws = spec.ingredients.iter().map(|i| &i.sizes);
    let report = InsertionReport {
        grains: grains.len(),
        region_volume: volume,
        solid_fraction: placed / volume,
        tries: places.tries,
        sizes: laws
            .zip(&drawn)
            .map(|(law, radii): (&SizeLaw, _)| SizeReport::of(law, radii))
            .collect(),
    };
    Ok((grains, report))
}

impl Insertion {
    /// Volume of the grains that are asked for, where there are many by the mean of 10 000, and that of the region
    /// (m³). Random places end near a part of 0.38 for equal grains.
    ///
    /// # Errors
    /// If a number is out of its range.
    pub fn volumes(&self) -> Result<[f64; 2], SetupError> {
        self.validate()?;
        let volume = self.volume()?;
        let mut random = ChaCha8Rng::seed_from_u64(self.seed);
        let mut drawn = |count: usize| -> Result<f64, SetupError> {
            let amount = Amount::Grains(count.min(SAMPLE));
            let grains = draw(&self.ingredients, amount, volume, &mut random)?;
            let sum: f64 = grains.iter().map(Grain::volume).sum();
            Ok(sum * count as f64 / grains.len().max(1) as f64)
        };
        self.amount.validate()?;
        let asked = match self.amount {
            Amount::Grains(count) => drawn(count)?,
            Amount::SolidFraction(share) => share * volume,
            Amount::Mass(mass) => {
                let kinds = self.ingredients.iter();
                let parts: f64 = kinds.clone().map(|i| i.parts_by_volume).sum();
                mass * parts / kinds.map(|i| i.parts_by_volume * i.density).sum::<f64>()
            }
        };
        Ok([asked, volume])
    }

    pub(super) fn validate(&self) -> Result<(), SetupError> {
        self.region.validate("insertion.region")?;
        check("insertion.gap", self.gap, "≥ 0 m", |v| v >= 0.0)?;
        check("insertion.tries", f64::from(self.tries), "> 0", |v| v > 0.0)?;
        for c in self.velocity.iter() {
            check("insertion.velocity", *c, "finite, m/s", |_| true)?;
        }
        self.ingredients
            .iter()
            .enumerate()
            .try_for_each(|(k, i)| i.validate(&format!("ingredients[{k}]")))
    }

    /// The block in which places are tried (m).
    pub(super) fn block(&self) -> Result<[Vector3<f64>; 2], SetupError> {
        let [mut low, mut high] = self.region.bounds();
        for k in 0..3 {
            if self.domain.periodic[k] {
                low[k] = low[k].max(self.domain.lower[k]);
                high[k] = high[k].min(self.domain.upper[k]);
            }
            let key = format!("insertion.region: extent along axis {k}");
            let extent = high[k] - low[k];
            check(&key, extent, "> 0 m and bounded", |v| v > 0.0)?;
        }
        Ok([low, high])
    }

    /// Volume of the region inside the box (m³).
    pub(super) fn volume(&self) -> Result<f64, SetupError> {
        let volume = volume(&self.region, self.block()?);
        check("insertion.region: volume", volume, "> 0 m³", |v| v > 0.0)?;
        Ok(volume)
    }
}

/// Grains of sizes within a factor of two, by cells.
struct Level {
    /// Largest radius (m).
    radius: f64,
    grid: Grid,
    /// First grain of each cell, and the next one of each grain: both counted from 1.
    first: Vec<u32>,
    next: Vec<u32>,
    grains: Vec<[f64; 4]>,
}

/// Places taken so far.
pub(super) struct Places<'a> {
    spec: &'a Insertion,
    block: [Vector3<f64>; 2],
    /// Axes along which the region meets itself: whole grains need not fit in there.
    wraps: [bool; 3],
    levels: Vec<Level>,
    cells: [Vec<usize>; 3],
    /// Places tried.
    pub tries: u64,
}

/// Places outside the region that may be drawn for one inside it.
const MISSES: u64 = 200;

impl<'a> Places<'a> {
    /// Nothing placed yet but the grains of `among`; room for those to `come`.
    pub fn new(
        spec: &'a Insertion,
        among: &[Grain],
        come: &[Grain],
    ) -> Result<Places<'a>, SetupError> {
        let block = spec.block()?;
        let wraps = std::array::from_fn(|k| {
            spec.domain.periodic[k]
                && block[0][k] == spec.domain.lower[k]
                && block[1][k] == spec.domain.upper[k]
        });
        let mut places = Places {
            spec,
            block,
            wraps,
            levels: Vec::new(),
            cells: Default::default(),
            tries: 0,
        };
        places.lay(among, come);
        among.iter().for_each(|grain| places.put(grain));
        Ok(places)
    }

    /// Lays levels for all grains.
    fn lay(&mut self, among: &[Grain], come: &[Grain]) {
        let all = || among.iter().chain(come);
        let inside = |low: Vector3<f64>, high: Vector3<f64>, grain: &Grain| {
            (low.inf(&grain.position), high.sup(&grain.position))
        };
        let (low, high) = among
            .iter()
            .fold((self.block[0], self.block[1]), |(low, high), grain| {
                inside(low, high, grain)
            });
        let mut radii: Vec<f64> = all().map(|g| g.radius).collect();
        radii.sort_by(|a, b| b.total_cmp(a));
        while let Some(&radius) = radii.first() {
            let count = radii.partition_point(|&r| r > 0.5 * radius);
            radii.drain(..count);
            let reach = 2.0 * radius + self.spec.gap;
            let grid = Grid::lay(count, [low.into(), high.into()], &self.spec.domain, reach);
            self.levels.push(Level {
                radius,
                first: vec![0; grid.cells.iter().product()],
                next: Vec::new(),
                grains: Vec::new(),
                grid,
            });
        }
    }

    /// Takes a place.
    pub fn put(&mut self, grain: &Grain) {
        let x = self.spec.domain.wrap(grain.position);
        let row = [x.x, x.y, x.z, grain.radius];
        let level = self.levels.iter_mut().rev();
        if let Some(level) = level.into_iter().find(|l| l.radius >= grain.radius) {
            let cell = level.grid.index(&row);
            level.grains.push(row);
            level.next.push(level.first[cell]);
            level.first[cell] = level.grains.len() as u32;
        }
    }

    /// A random place for a grain (m), if one is found.
    pub fn find(&mut self, radius: f64, random: &mut ChaCha8Rng) -> Option<Vector3<f64>> {
        let (mut tries, mut misses) = (0, 0);
        while tries < self.spec.tries && misses < MISSES * u64::from(self.spec.tries) {
            let [low, high] = self.block;
            let x = Vector3::from_fn(|k, _| low[k] + (high[k] - low[k]) * random.random::<f64>());
            if !self.holds(&x, radius) {
                misses += 1;
                continue;
            }
            tries += 1;
            self.tries += 1;
            if self.is_free(&x, radius) {
                return Some(x);
            }
        }
        None
    }

    /// Whether a whole grain lies in the region and the block.
    fn holds(&self, x: &Vector3<f64>, radius: f64) -> bool {
        let [low, high] = self.block;
        let between = |k: usize| x[k] - radius >= low[k] && x[k] + radius <= high[k];
        if !(0..3).all(|k| self.wraps[k] || between(k)) {
            return false;
        }
        // A region that is bounded by the periodic box alone goes on beyond it.
        match &self.spec.region {
            Region::Block { .. } => true,
            region => region.depth(x) >= radius,
        }
    }

    fn is_free(&mut self, x: &Vector3<f64>, radius: f64) -> bool {
        let (spec, cells) = (self.spec, &mut self.cells);
        let row = [x.x, x.y, x.z, radius];
        for level in &self.levels {
            let grid = &level.grid;
            let reach = radius + level.radius + spec.gap;
            for axis in 0..3 {
                let c = grid.coordinate(axis, x[axis]);
                let span = (reach * grid.inverse_cell[axis]).ceil() as isize;
                grid.around(axis, [c, c], span, &mut cells[axis]);
                // Most places are taken by a grain of the very cell: look there first.
                if let Some(own) = cells[axis].iter().position(|&other| other == c) {
                    cells[axis].swap(0, own);
                }
            }
            let [a, b] = grid.across;
            for &i in &cells[a] {
                for &j in &cells[b] {
                    for &k in &cells[grid.along] {
                        let cell = grid.row_at([i, j]) * grid.row_cells() + k;
                        if level.meets(cell, &row, spec) {
                            return false;
                        }
                    }
                }
            }
        }
        true
    }
}

impl Level {
    /// Whether a grain comes too close to one of a cell.
    fn meets(&self, cell: usize, grain: &[f64; 4], spec: &Insertion) -> bool {
        let mut at = self.first[cell];
        while at > 0 {
            let other = &self.grains[at as usize - 1];
            let apart = Vector3::from_fn(|k, _| grain[k] - other[k]);
            let apart = spec.domain.nearest_image(apart).norm_squared();
            let least = grain[3] + other[3] + spec.gap;
            if apart < least * least {
                return true;
            }
            at = self.next[at as usize - 1];
        }
        false
    }
}
