//! What all couplings at an edge begin with: the grains beyond it become the continuum.

use super::averages::velocity_profile;
use super::edge::{FlatEdge, ZoneEdge};
use super::far_side::{FarSide, sets_pressure};
use super::settings::{Resolved, check};
use super::strip::Strip;
use super::{OverlapError, OverlapSpec};
use colluvium_continuum::rheology::ShearLaw;
use colluvium_dem::{Simulation, Snapshot};

/// Grains as they are and the continuum that takes over from those beyond the edge.
pub(super) struct Start<L> {
    pub settings: Resolved,
    pub edge: FlatEdge,
    pub strip: Strip,
    pub continuum: FarSide<L>,
    /// Mass of the grains beyond the edge (kg).
    pub mass_beyond: f64,
    /// All grains, those beyond the edge included.
    pub snapshot: Snapshot,
}

impl<L: ShearLaw> Start<L> {
    /// Cells are cut so that the mass of the grains beyond the edge fills a whole number of them.
    pub fn of(
        spec: OverlapSpec<L>,
        simulation: &mut Simulation,
        share: impl Fn(&Strip, usize) -> f64,
    ) -> Result<Self, OverlapError> {
        let settings = spec
            .settings
            .resolve(&spec.scales, sets_pressure(&spec.far_end))?;
        let edge = spec.edge;
        let mut snapshot = Snapshot::default();
        simulation.snapshot(&mut snapshot);
        let free = snapshot.grains.iter().filter(|g| !g.fixed);
        let leaves = free.filter(|g| edge.distance(&g.position) > 0.0);
        let mass_beyond: f64 = leaves.map(|g| g.mass).sum();
        let depth = mass_beyond / (spec.rheology.bulk_density() * edge.area());
        check(
            "edge.position",
            edge.position,
            depth >= settings.cell,
            "where grains of at least one cell's depth lie beyond it",
        )?;
        let cells_beyond = (depth / settings.cell).round().max(1.0);
        let strip = Strip::new(&settings, depth / cells_beyond);
        check(
            "shell",
            settings.shell,
            strip.shell <= (strip.buffer as f64 + 1e-9) * strip.cell,
            "at most the buffer's width in whole cells",
        )?;
        let mut continuum = FarSide::new(
            &edge,
            &strip,
            cells_beyond as usize,
            &simulation.gravity(),
            spec.far_end,
            (spec.rheology, spec.strain_rate_floor),
            |face| share(&strip, face),
        )?;
        let profile = velocity_profile(
            &snapshot.grains,
            &edge,
            strip.face(0),
            strip.cell,
            continuum.cells(),
        );
        for (k, velocity) in profile.into_iter().enumerate() {
            continuum.set_velocity(k, velocity);
        }
        Ok(Self {
            settings,
            edge,
            strip,
            continuum,
            mass_beyond,
            snapshot,
        })
    }
}
