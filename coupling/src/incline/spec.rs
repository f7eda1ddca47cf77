//! What an inclined-plane run starts from.

use crate::coarse_graining::AveragerError;
use crate::steady_state::ENOUGH_SAMPLES;
use colluvium_dem::{ContactLaw, Diverged, Domain, Grain, Setup, SetupError, Threads, Wall};
use nalgebra::Vector3;
use serde::{Deserialize, Serialize};

/// Solid fraction of a flow, for the starting velocity only.
pub(super) const FLOWING_SOLID_FRACTION: f64 = 0.55;

/// Velocity at the start.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Start {
    /// The bed as prepared, gravity tilted at once.
    Rest,
    /// Bagnold's profile of a uniform inertial number; above 0.5 the bed is stretched along z to the solid
    /// fraction of a flow.
    Flow {
        /// The inertial number.
        inertial_number: f64,
    },
}

/// What a run is for: this decides when it may end early.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Purpose {
    /// Relax, then average.
    Measure,
    /// Does a flow stop at this slope? Ends at rest, or when the flow is steady or speeds up.
    StopSearch,
    /// Does a bed at rest start to flow? Ends at rest, or when it has moved a diameter and speeds up.
    OnsetSearch,
}

/// One inclined-plane run.
#[derive(Clone, Debug)]
pub struct InclineSpec {
    /// Slope θ (rad).
    pub slope: f64,
    /// Gravity [m/s²].
    pub gravity: f64,
    /// Mean diameter of the grains d (m).
    pub diameter: f64,
    /// Density of the grains' material [kg/m³].
    pub grain_density: f64,
    /// Contact law.
    pub law: ContactLaw,
    /// The box; periodic in x and y.
    pub domain: Domain,
    /// The prepared bed over its fixed base.
    pub bed: Vec<Grain>,
    /// Velocity at the start.
    pub start: Start,
    /// What the run is for.
    pub purpose: Purpose,
    /// Time step (s).
    pub timestep: f64,
    /// Least time before averaging begins, or before a search may end as flowing (s).
    pub relax_time: f64,
    /// Averaging time (s); of a measuring run, at least 40 samples long.
    pub average_time: f64,
    /// Longest time of the whole run (s); averaging begins `average_time` before it at the latest.
    pub max_time: f64,
    /// Steps between samples.
    pub sample_every: u64,
    /// Thickness of the averaging layers (m).
    pub layer: f64,
    /// Drift of the mean velocity, relative, that still counts as steady.
    pub steady_tolerance: f64,
    /// Sharing of a step over threads.
    pub threads: Threads,
}

/// What can be wrong with a run.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum InclineError {
    /// A number is out of range.
    #[error("incline.{key} = {value}: must be {allowed}")]
    OutOfRange {
        /// Name of the key.
        key: &'static str,
        /// The value found.
        value: f64,
        /// What is allowed.
        allowed: &'static str,
    },
    /// The grains cannot be simulated.
    #[error(transparent)]
    Setup(#[from] SetupError),
    /// The grains flew apart.
    #[error(transparent)]
    Diverged(#[from] Diverged),
    /// The averages cannot be taken.
    #[error(transparent)]
    Averager(#[from] AveragerError),
    /// A checkpoint does not belong to this run.
    #[error("checkpoint: {0}")]
    Record(String),
}

impl InclineSpec {
    /// Checks every number.
    ///
    /// # Errors
    /// The first number out of range, by name.
    pub fn validate(&self) -> Result<(), InclineError> {
        let check = |key, value: f64, ok: bool, allowed| {
            if ok && value.is_finite() {
                Ok(())
            } else {
                Err(InclineError::OutOfRange {
                    key,
                    value,
                    allowed,
                })
            }
        };
        let degrees = self.slope.to_degrees();
        check(
            "slope_degrees",
            degrees,
            (0.0..90.0).contains(&degrees),
            "at least 0 and below 90",
        )?;
        for (key, value) in [
            ("gravity", self.gravity),
            ("diameter", self.diameter),
            ("grain_density", self.grain_density),
            ("timestep", self.timestep),
            ("max_time", self.max_time),
            ("layer", self.layer),
            ("steady_tolerance", self.steady_tolerance),
        ] {
            check(key, value, value > 0.0, "positive")?;
        }
        check(
            "relax_time",
            self.relax_time,
            self.relax_time >= 0.0,
            "at least 0 s",
        )?;
        check(
            "average_time",
            self.average_time,
            self.average_time >= 0.0,
            "at least 0 s",
        )?;
        if self.purpose == Purpose::Measure {
            let needed = self.relax_time + self.average_time;
            let allowed = "at least relax_time + average_time";
            check(
                "max_time",
                self.max_time,
                self.max_time >= needed * (1.0 - 1e-12),
                allowed,
            )?;
        }
        check(
            "sample_every",
            self.sample_every as f64,
            self.sample_every > 0,
            "at least 1 step",
        )?;
        if self.purpose == Purpose::Measure {
            // With fewer, whether the flow drifts while it is averaged would stay unknown.
            let enough = ENOUGH_SAMPLES as f64 * self.sample_interval();
            check(
                "average_time",
                self.average_time,
                self.average_time >= enough * (1.0 - 1e-12),
                "at least 40 times the time between samples",
            )?;
        }
        if let Start::Flow { inertial_number } = self.start {
            check(
                "start.inertial_number",
                inertial_number,
                inertial_number > 0.0,
                "positive",
            )?;
        }
        let free = self.bed.iter().filter(|g| !g.fixed).count();
        check("grains", free as f64, free > 0, "at least 1 free grain")?;
        let periodic = self.domain.periodic[0] && self.domain.periodic[1];
        check("domain.periodic", 0.0, periodic, "periodic in x and y")?;
        // The averages keep an array for every layer: an absurd thickness must not exhaust the memory.
        let layers = self.bed_height() / self.layer;
        check(
            "layer",
            self.layer,
            layers < 10_000.0,
            "at least 1/10000 of the bed's height",
        )
    }

    /// Height of the highest free grain's top over z = 0 (m).
    pub fn bed_height(&self) -> f64 {
        let tops = self
            .bed
            .iter()
            .filter(|g| !g.fixed)
            .map(|g| g.position.z + g.radius);
        tops.fold(0.0, f64::max)
    }

    /// The velocity that a flowing start of this depth (m) has at a height (m): Bagnold's profile with a loose φ,
    /// u(z) = (2/3)(I/d) √(φ g cos θ) [H^{3/2} − (H − z)^{3/2}].
    pub fn starting_flow(&self, depth: f64) -> Option<impl Fn(f64) -> f64 + use<>> {
        let Start::Flow { inertial_number } = self.start else {
            return None;
        };
        let scale = 2.0 / 3.0 * inertial_number / self.diameter
            * (FLOWING_SOLID_FRACTION * self.gravity * self.slope.cos()).sqrt();
        Some(move |height: f64| {
            let z = height.clamp(0.0, depth);
            scale * (depth.powf(1.5) - (depth - z).powf(1.5))
        })
    }

    /// Time between samples (s).
    pub fn sample_interval(&self) -> f64 {
        self.sample_every as f64 * self.timestep
    }

    /// The floor that the base stands on. Without it a fast grain that is pressed through a gap of the base falls for
    /// ever, and takes ever more energy with it.
    fn floor(&self, grains: &[Grain]) -> Option<Wall> {
        let fixed = grains.iter().filter(|g| g.fixed);
        let lowest = fixed.map(|g| g.position.z - g.radius).reduce(f64::min)?;
        Some(Wall::plane(Vector3::z() * lowest, Vector3::z()))
    }

    pub(crate) fn setup(&self) -> Setup {
        let mut grains = self.bed.clone();
        let stretch = self.starting_stretch();
        for grain in grains.iter_mut().filter(|g| !g.fixed && g.position.z > 0.0) {
            grain.position.z *= stretch;
        }
        Setup {
            domain: self.domain,
            gravity: self.gravity * Vector3::new(self.slope.sin(), 0.0, -self.slope.cos()),
            law: self.law.into(),
            walls: self.floor(&grains).into_iter().collect(),
            grains,
            bodies: Vec::new(),
            timestep: self.timestep,
            threads: self.threads,
        }
    }

    /// By how much a bed that is to flow fast is stretched along z: down to φ = 0.53 − 0.1 I, about what flows
    /// have. Settled beds set in motion with I ≈ 0.9 as they are have to dilate at once, and burst: overlaps of a
    /// third of the radius, and grains thrown up by tens of diameters. Slower starts are better left as they are:
    /// a stretched bed falls back and swings.
    pub(super) fn starting_stretch(&self) -> f64 {
        const FAST: f64 = 0.5;
        let inertial_number = match self.start {
            Start::Flow { inertial_number } if inertial_number > FAST => inertial_number,
            _ => return 1.0,
        };
        let flowing = (0.53 - 0.1 * inertial_number).max(0.4);
        let volume: f64 = self
            .bed
            .iter()
            .filter(|g| !g.fixed)
            .map(|g| 4.0 / 3.0 * std::f64::consts::PI * g.radius.powi(3))
            .sum();
        let settled = volume / (self.domain.floor_area() * self.bed_height());
        (settled / flowing).clamp(1.0, 1.6)
    }
}
