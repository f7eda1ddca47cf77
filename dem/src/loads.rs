//! Forces and moments on grains besides those of contacts.
//!
//! One pair of rows a grain, filled at the start of a step from the present positions and added to
//! the grain's sum after its pairs and walls:
//!
//! ```text
//! d(m v)/dt = Σ F_contact + m g + F_load        d(I ω)/dt = Σ M_contact + M_load
//! ```
//! Rows exist only where a scene has loads, so that others pay one comparison a grain; where only some grains have
//! any, only those have rows.

use crate::bonds::{Bond, Bonds};
use crate::grains::{Grains, vector};
use crate::places::Places;
use crate::population::GONE;
use crate::record::Record;
use crate::setup::{SetupError, check};
use crate::simulation::Simulation;
use nalgebra::Vector3;

/// A steady force and moment on one grain, from outside.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Load {
    /// Number of the grain (see [`crate::GrainSample::id`]).
    pub grain: u32,
    /// Force at the centre (N).
    pub force: Vector3<f64>,
    /// Moment about the centre (N m).
    pub moment: Vector3<f64>,
}

/// Mark of a grain without a row.
const NO_ROW: u32 = u32::MAX;

/// Loads of all grains in the present step.
#[derive(Clone, Debug, Default)]
pub(crate) struct Loads {
    /// Force (N) and moment (N m) on grains; empty where a scene has no loads.
    rows: Vec<[[f64; 4]; 2]>,
    /// Row of each grain, or [`NO_ROW`]; empty where each grain has its own.
    index: Vec<u32>,
    /// Steady loads by grain number.
    given: Vec<Load>,
    /// Rows of the grains in `given`.
    places: Vec<u32>,
    /// Sum of the forces on free grains that come from outside (N).
    pub external: Vector3<f64>,
}

impl Loads {
    /// Force and moment on a grain.
    #[inline(always)]
    pub fn of(&self, grain: usize) -> Option<&[[f64; 4]; 2]> {
        match self.index.get(grain) {
            None => self.rows.get(grain),
            Some(&NO_ROW) => None,
            Some(&row) => self.rows.get(row as usize),
        }
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.rows.is_empty()
    }

    /// Finds the grains again after they have been sorted; loads of grains that have gone are dropped.
    fn settle(&mut self, places: &Places) {
        self.given.retain(|load| places.of(load.grain) != GONE);
        self.places.clear();
        self.places
            .extend(self.given.iter().map(|load| places.of(load.grain)));
    }

    /// Makes room for the loads of a step, of so many grains.
    fn clear(&mut self, grains: usize) {
        self.external = Vector3::zeros();
        self.index.clear();
        self.rows.clear();
        self.rows.resize(grains, [[0.0; 4]; 2]);
    }

    /// Lays the steady loads alone, on the grains that have any.
    fn lay_given(&mut self, grains: &Grains) {
        self.clear(0);
        self.index.resize(grains.len(), NO_ROW);
        for (&at, load) in self.places.iter().zip(&self.given) {
            let at = at as usize;
            if grains.is_fixed(at) {
                continue;
            }
            let row = &mut self.index[at];
            if *row == NO_ROW {
                *row = self.rows.len() as u32;
                self.rows.push([[0.0; 4]; 2]);
            }
            add(&mut self.rows[*row as usize], &load.force, &load.moment);
            self.external += load.force;
        }
    }

    /// Adds the steady loads.
    fn add_given(&mut self, grains: &Grains) {
        for (&at, load) in self.places.iter().zip(&self.given) {
            let at = at as usize;
            // What holds a fixed grain takes its load as well.
            if !grains.is_fixed(at) {
                add(&mut self.rows[at], &load.force, &load.moment);
                self.external += load.force;
            }
        }
    }

    /// Adds what fields of gravity do.
    fn add_fields(&mut self, pulls: &[[f64; 4]]) {
        for (row, pull) in self.rows.iter_mut().zip(pulls) {
            let force = vector(pull);
            add(row, &force, &Vector3::zeros());
            self.external += force;
        }
    }

    /// Adds what bonds do.
    fn add_bonds(&mut self, bonds: &Bonds) {
        for Bond { rows, pull, .. } in bonds.whole() {
            let [i, j] = rows.map(|row| row as usize);
            add(&mut self.rows[i], &pull.force, &pull.moments[0]);
            add(&mut self.rows[j], &-pull.force, &pull.moments[1]);
        }
    }

    /// The steady loads with the rows of their grains.
    pub fn given(&self) -> impl Iterator<Item = (usize, &Load)> {
        self.places.iter().map(|&at| at as usize).zip(&self.given)
    }

    /// Writes the steady loads into a checkpoint.
    pub fn record(&self, record: &mut Record) {
        let grains = self.given.iter().map(|load| u64::from(load.grain));
        record.counts.insert("loads/grain".into(), grains.collect());
        let vectors = self.given.iter().flat_map(|load| [load.force, load.moment]);
        let numbers = vectors.flat_map(|v| [v.x, v.y, v.z]).collect();
        record.numbers.insert("loads/force_moment".into(), numbers);
    }

    /// Reads them back.
    pub fn read(&mut self, record: &Record, grains: &Grains) -> Result<(), String> {
        let of = record.counts("loads/grain")?;
        let vectors = record.numbers("loads/force_moment")?;
        if vectors.len() != 6 * of.len() {
            return Err(
                "arrays `loads/grain` and `loads/force_moment` do not fit each other".into(),
            );
        }
        self.given = of
            .iter()
            .zip(vectors.as_chunks::<6>().0)
            .map(|(&grain, &[fx, fy, fz, mx, my, mz])| {
                let grain = u32::try_from(grain).map_err(|_| unknown_grain(grain))?;
                Ok(Load {
                    grain,
                    force: Vector3::new(fx, fy, fz),
                    moment: Vector3::new(mx, my, mz),
                })
            })
            .collect::<Result<_, String>>()?;
        let mut places = Places::default();
        places.lay(grains);
        let lost = self.given.iter().find(|l| places.of(l.grain) == GONE);
        if let Some(load) = lost {
            return Err(unknown_grain(load.grain.into()));
        }
        self.settle(&places);
        Ok(())
    }
}

fn unknown_grain(grain: u64) -> String {
    format!("array `loads/grain` names grain {grain}, which is not there")
}

fn add(row: &mut [[f64; 4]; 2], force: &Vector3<f64>, moment: &Vector3<f64>) {
    for (sum, part) in row.iter_mut().zip([force, moment]) {
        for (sum, part) in sum.iter_mut().zip(part.iter()) {
            *sum += part;
        }
    }
}

impl Simulation {
    /// Lays the loads of the present positions; bonds stretch by a step of this length (s).
    pub(crate) fn evaluate_loads(&mut self, stretch: f64) {
        let (grains, cell) = (&self.grains, self.cell());
        if !self.looks_up() && !self.fields.has_fields() {
            self.loads.clear(0);
            return;
        }
        if self.bonds.is_empty() && !self.fields.has_fields() {
            self.loads.lay_given(grains);
            return;
        }
        self.loads.clear(grains.len());
        self.loads.add_given(grains);
        if self.fields.has_fields() {
            self.fields.evaluate(grains, self.parallel);
            self.loads.add_fields(&self.fields.pulls);
        }
        self.bonds.evaluate(grains, &cell, stretch, self.parallel);
        self.loads.add_bonds(&self.bonds);
    }

    /// Whether grains are looked up by number.
    fn looks_up(&self) -> bool {
        !self.loads.given.is_empty() || !self.bonds.is_empty()
    }

    /// Finds grains with loads and bonds again after they have been sorted.
    pub(crate) fn settle_loads(&mut self) {
        if self.looks_up() {
            self.places.lay(&self.grains);
            self.loads.settle(&self.places);
            self.bonds.settle(&self.places);
        }
    }

    /// Puts steady loads on grains, in place of those there were; they act from now on. Nothing is allocated as
    /// long as their number does not double.
    ///
    /// On a fixed grain a load does nothing. Removing a grain drops its load.
    ///
    /// # Errors
    /// If a number is not finite or a grain is not there. Nothing has changed then.
    pub fn set_loads(&mut self, loads: &[Load]) -> Result<(), SetupError> {
        self.places.lay(&self.grains);
        for (k, load) in loads.iter().enumerate() {
            // Names are formed for what is refused only: loads may change every step.
            let known = self.places.of(load.grain) != GONE;
            let finite = |v: &Vector3<f64>| v.iter().all(|c| c.is_finite());
            if known && finite(&load.force) && finite(&load.moment) {
                continue;
            }
            let key = format!("loads[{k}].grain");
            check(&key, f64::from(load.grain), "the number of a grain", |_| {
                known
            })?;
            for (name, v) in [("force", &load.force), ("moment", &load.moment)] {
                for c in v.iter() {
                    check(&format!("loads[{k}].{name}"), *c, "finite", |_| true)?;
                }
            }
        }
        self.forget_observation();
        self.loads.given.clear();
        if self.loads.given.capacity() < loads.len() {
            // Where loads change every step their number does too.
            self.loads.given.reserve(2 * loads.len());
            self.loads.places.reserve(2 * loads.len());
            self.loads.rows.reserve(2 * loads.len());
        }
        self.loads.given.extend_from_slice(loads);
        self.loads.settle(&self.places);
        Ok(())
    }
}
