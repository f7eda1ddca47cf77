//! What there is of both sides, each counted on its own side of the handshake surface.

use super::MaterialEdge;
use colluvium_dem::Simulation;

impl MaterialEdge {
    /// Error of the continuum's volume against what it began with and its copy was given since, relative.
    pub fn volume_error(&self) -> f64 {
        let now = self.collapse.flow().volume();
        let start = now / (1.0 + self.collapse.volume_drift());
        (now - start - self.account.copied) / start
    }

    /// Mass of grains and of continuum that totals count, over that of all grains at the start, less 1: what the
    /// handshake surface gained or lost by differences of both sides' motion.
    pub fn mass_error(&self, simulation: &Simulation) -> f64 {
        let mut masses: Vec<(u32, f64)> = simulation
            .held(|_| true)
            .filter(|g| self.counts(g))
            .map(|g| (g.id, g.mass))
            .collect();
        masses.sort_unstable_by_key(|m| m.0);
        let grains: f64 = masses.iter().map(|m| m.1).sum();
        let solid: f64 = self.parcels().iter().map(|[_, volume]| volume).sum();
        let continuum = solid * self.spec.case.rheology.grain_density;
        (grains + continuum) / self.account.mass - 1.0
    }

    /// The continuum behind the handshake surface, and what rests behind it, as parcels: places along x (m) and
    /// volumes of grains in them (m³).
    pub fn parcels(&self) -> Vec<[f64; 2]> {
        const PARTS: usize = 4;
        let [columns, rows] = self.cells.counts;
        let places = &self.held.handshake;
        let (h, solid) = (self.cells.spacing, self.spec.case.rheology.solid_fraction);
        let volume = self.cells.volume() * solid / PARTS as f64;
        let fractions = &self.collapse.flow().state().fractions;
        let resting = self.rest_mass / self.spec.case.rheology.grain_density;
        let slices = (PARTS as f64 * self.spec.wall / h).ceil();
        let mut parcels: Vec<[f64; 2]> = (0..slices as usize)
            .map(|slice| {
                let place = (slice as f64 + 0.5) / slices * self.spec.wall;
                [place, resting / slices]
            })
            .collect();
        for (k, &end) in places.iter().enumerate().take(rows) {
            for i in 0..columns {
                let fraction = fractions[i + columns * k];
                if fraction <= 0.0 {
                    continue;
                }
                for part in 0..PARTS {
                    let low = self.cells.face(i) + part as f64 / PARTS as f64 * h;
                    let width = h / PARTS as f64;
                    let share = ((end - low) / width).clamp(0.0, 1.0);
                    if share > 0.0 {
                        parcels.push([low + 0.5 * share * width, fraction * share * volume]);
                    }
                }
            }
        }
        parcels
    }
}
