//! What a joined incline run starts from.

use crate::coarse_graining::{Averager, AveragerError, Layering, Layers};
use crate::incline::{InclineError, InclineSpec};
use crate::overlap::settings::check;
use crate::overlap::{FlatEdge, OverlapError, OverlapSettings, OverlapSpec, Resolved, Scales};
use colluvium_continuum::grid::Boundary;
use colluvium_continuum::rheology::MuI;
use std::f64::consts::PI;

/// What to run.
#[derive(Clone, Debug)]
pub struct JoinedInclineSpec {
    /// The run of grains that it begins as; averages are taken over its `average_time` from its `relax_time` on.
    pub incline: InclineSpec,
    /// Height of the edge above the base (m).
    pub height: f64,
    /// When the continuum takes over (s).
    pub from: f64,
    /// Mass of all material (kg), where the bed is only its lower part and the rest is continuum from the start:
    /// `from` is 0 then, and the edge lies where the grains below it fill `height` at the continuum's density. Without
    /// it the bed is all.
    pub mass: Option<f64>,
    /// Material of the continuum.
    pub rheology: MuI,
    /// Normal stiffness of a contact of two mean grains (N/m).
    pub stiffness: f64,
    /// Settings of the overlap.
    pub settings: OverlapSettings,
}

/// Why such a run cannot be made or go on.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum JoinedInclineError {
    /// The overlap.
    #[error(transparent)]
    Overlap(#[from] OverlapError),
    /// The grains.
    #[error(transparent)]
    Incline(#[from] InclineError),
}

impl From<AveragerError> for JoinedInclineError {
    fn from(error: AveragerError) -> Self {
        JoinedInclineError::Incline(error.into())
    }
}

impl JoinedInclineSpec {
    /// What is joined at the edge.
    pub(super) fn overlap(&self) -> OverlapSpec<MuI> {
        let incline = &self.incline;
        OverlapSpec {
            edge: FlatEdge::across(&incline.domain, 2, 0, true, self.height),
            rheology: self.rheology,
            mass: self.mass,
            far_end: Boundary::FreeSurface,
            scales: Scales {
                diameter: incline.diameter,
                time: (incline.diameter / incline.gravity).sqrt(),
                density: self.rheology.bulk_density(),
                stiffness: self.stiffness,
            },
            settings: self.settings,
            strain_rate_floor: 1e-6,
        }
    }

    /// The settings with nothing left out.
    ///
    /// # Errors
    /// The first number out of range, by name.
    pub fn resolved(&self) -> Result<Resolved, OverlapError> {
        self.overlap().resolved()
    }

    /// Checks what can be checked before anything has flowed.
    ///
    /// # Errors
    /// The first number out of range, by name.
    pub fn validate(&self) -> Result<(), JoinedInclineError> {
        self.incline.validate()?;
        let settings = self.resolved()?;
        self.rheology.validate().map_err(OverlapError::from)?;
        check(
            "from",
            self.from,
            (0.0..=self.incline.relax_time).contains(&self.from),
            "0 s to the time when averages begin",
        )?;
        let least = settings.inner + settings.buffer + settings.cell;
        check(
            "height",
            self.height,
            self.height >= least,
            "at least a cell over the widths of inner overlap and buffer",
        )?;
        let Some(mass) = self.mass else { return Ok(()) };
        check(
            "from",
            self.from,
            self.from == 0.0,
            "0 s where the bed is only the lower part",
        )?;
        let least = self.lower_mass() + self.area() * settings.cell * self.rheology.bulk_density();
        check(
            "mass",
            mass,
            mass >= least,
            "that of the material below the edge and at least a cell above it",
        )?;
        check(
            "height",
            self.height,
            self.bed_mass() >= self.lower_mass(),
            "at most what the grains of the bed reach to",
        )?;
        Ok(())
    }

    /// Area of the floor (m²).
    fn area(&self) -> f64 {
        self.incline.domain.floor_area()
    }

    /// Mass of the material below the edge at the continuum's density (kg).
    fn lower_mass(&self) -> f64 {
        self.height * self.area() * self.rheology.bulk_density()
    }

    /// Bagnold's profile that the continuum starts with, where the bed is only the lower part and flows from the start:
    /// velocity (m/s) over height (m).
    pub(super) fn flow(&self) -> Option<impl Fn(f64) -> f64 + use<>> {
        self.incline.starting_flow(self.depth_of(self.mass?))
    }

    /// Mass of all material (kg).
    pub(super) fn total_mass(&self) -> f64 {
        self.mass.unwrap_or_else(|| self.bed_mass())
    }

    /// Mass of the free grains of the bed (kg).
    fn bed_mass(&self) -> f64 {
        let free = self.incline.bed.iter().filter(|g| !g.fixed);
        let volume: f64 = free.map(|g| 4.0 / 3.0 * PI * g.radius.powi(3)).sum();
        volume * self.incline.grain_density
    }

    /// Depth of so much material (kg) at the continuum's density (m).
    pub(super) fn depth_of(&self, mass: f64) -> f64 {
        mass / (self.area() * self.rheology.bulk_density())
    }

    /// Height over which a bed that is only the lower part has the mass that belongs below the edge (m).
    pub(super) fn cut(&self, grains: impl Iterator<Item = (f64, f64)>) -> f64 {
        let mut grains: Vec<(f64, f64)> = grains.collect();
        grains.sort_by(|a, b| a.0.total_cmp(&b.0));
        let mut left = self.lower_mass();
        let cut = grains.iter().find(|(_, mass)| {
            left -= mass;
            left < 0.0
        });
        cut.map_or(f64::INFINITY, |(height, _)| *height)
    }

    pub(super) fn averager(&self) -> Result<Averager<Layers>, JoinedInclineError> {
        let layer = self.incline.layer;
        let below = (2.0 * self.incline.diameter / layer).ceil();
        let layers = Layering {
            lower: -below * layer,
            thickness: layer,
            count: (1.3 * self.height / layer).ceil() as usize + below as usize + 8,
        };
        Ok(Averager::new(Layers, layers)?)
    }
}
