//! What all couplings at an edge begin with: the grains beyond it become the continuum.

use super::averages::velocity_profile;
use super::edge::{FlatEdge, ZoneEdge};
use super::far_side::{FarSide, sets_pressure};
use super::settings::{Resolved, check};
use super::sighting::Sighting;
use super::strip::Strip;
use super::{OverlapError, OverlapSpec};
use colluvium_continuum::rheology::ShearLaw;
use colluvium_dem::Simulation;

/// Grains as they are and the continuum that takes over from those beyond the edge.
pub(super) struct Start<L> {
    pub settings: Resolved,
    pub edge: FlatEdge,
    pub strip: Strip,
    pub continuum: FarSide<L>,
    /// Mass of the grains beyond the edge (kg).
    pub mass_beyond: f64,
    /// All grains, those beyond the edge included.
    pub sighting: Sighting,
}

impl<L: ShearLaw + Copy> Start<L> {
    /// Cells are cut so that the mass of the grains beyond the edge fills a whole number of them; their velocities
    /// are those of the grains, layer by layer.
    pub fn of(
        spec: &OverlapSpec<L>,
        simulation: &mut Simulation,
        share: impl Fn(&Strip, usize) -> f64,
    ) -> Result<Self, OverlapError> {
        let edge = spec.edge;
        let mut sighting = Sighting::default();
        sighting.look(simulation);
        let free = sighting.snapshot.grains.iter().filter(|g| !g.fixed);
        let sums = free.fold([0.0; 2], |[stay, leave], g| {
            if edge.distance(&g.position) > 0.0 {
                [stay, leave + g.mass]
            } else {
                [stay + g.mass, leave]
            }
        });
        let mass_beyond = spec.mass.map_or(sums[1], |mass| mass - sums[0]);
        let depth = mass_beyond / (spec.rheology.bulk_density() * edge.area());
        let cell = spec.resolved()?.cell;
        check(
            "edge.position",
            edge.position,
            depth >= cell,
            "where matter of at least one cell's depth lies beyond it",
        )?;
        let beyond = (depth / cell).round().max(1.0);
        let mut start = Self::of_cells(
            spec,
            simulation,
            (depth / beyond, beyond as usize),
            mass_beyond,
            share,
        )?;
        start.sighting = sighting;
        let profile = velocity_profile(
            &start.sighting.snapshot.grains,
            &edge,
            start.strip.face(0),
            start.strip.cell,
            start.continuum.cells(),
        );
        for (k, velocity) in profile.into_iter().enumerate() {
            start.continuum.set_velocity(k, velocity);
        }
        Ok(start)
    }

    /// The continuum at rest, of cells of this height and so many beyond the edge.
    pub fn of_cells(
        spec: &OverlapSpec<L>,
        simulation: &Simulation,
        (cell, beyond): (f64, usize),
        mass_beyond: f64,
        share: impl Fn(&Strip, usize) -> f64,
    ) -> Result<Self, OverlapError> {
        let settings = spec.resolved()?;
        let edge = spec.edge;
        let strip = Strip::new(&settings, cell);
        check(
            "shell",
            settings.shell,
            strip.shell <= (strip.buffer as f64 + 1e-9) * strip.cell,
            "at most the buffer's width in whole cells",
        )?;
        let continuum = FarSide::new(
            &edge,
            &strip,
            beyond,
            &simulation.gravity(),
            spec.far_end,
            (spec.rheology, spec.strain_rate_floor),
            |face| share(&strip, face),
        )?;
        Ok(Self {
            settings,
            edge,
            strip,
            continuum,
            mass_beyond,
            sighting: Sighting::default(),
        })
    }
}

impl<L> OverlapSpec<L> {
    /// The settings with nothing left out.
    pub(super) fn resolved(&self) -> Result<Resolved, OverlapError> {
        let free = sets_pressure(&self.far_end);
        let settings = self.settings.resolve(&self.scales, free)?;
        settings.check_layers()?;
        Ok(settings)
    }
}
