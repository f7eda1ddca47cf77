//! What a preparation has come to: solid fraction, coordination, rest, and sizes against their laws.

use super::{Surroundings, Workshop, refused};
use crate::failure::Failure;
use colluvium_dem::preparation::{PackingReport, SizeReport};
use colluvium_dem::{Grain, Region};

impl Workshop<'_> {
    /// Where a packing is measured unless its scene knows better: all of a periodic box; else a ball about
    /// the centre of mass that goes six tenths of the way to the nearest side of the block around all grains.
    pub fn middle(&self) -> Region {
        let packing = &self.packing;
        if packing.domain.periodic == [true; 3] || packing.grains.is_empty() {
            return Region::Everywhere;
        }
        let center = packing.center();
        let to_side =
            |grain: &Grain, k: usize, sign: f64| sign * (grain.position - center)[k] + grain.radius;
        let side = |k: usize, sign: f64| {
            let reaches = packing.grains.iter().map(|g| to_side(g, k, sign));
            reaches.fold(0.0, f64::max)
        };
        let nearest = (0..3)
            .flat_map(|k| [side(k, 1.0), side(k, -1.0)])
            .fold(f64::INFINITY, f64::min);
        Region::Ball {
            center,
            radius: 0.6 * nearest,
        }
    }

    /// Measures the packing in a region, rest against an acceleration (m/s²).
    pub fn measure(
        &mut self,
        around: &Surroundings,
        region: &Region,
        acceleration: f64,
    ) -> Result<PackingReport, Failure> {
        let mut simulation = self.simulation(around)?;
        let report = PackingReport::of(&mut simulation, region, acceleration).map_err(refused)?;
        self.note("packing", &report);
        Ok(report)
    }

    /// Compares the radii of what was made with the laws asked for, kind by kind; balls of clumps are drawn from none.
    pub fn compare_sizes(&mut self) {
        let mut loose = vec![true; self.packing.grains.len()];
        for &grain in self.packing.clumps.iter().flat_map(|clump| &clump.grains) {
            if let Some(loose) = loose.get_mut(grain as usize) {
                *loose = false;
            }
        }
        let materials = self.materials;
        for kind in &materials.ingredients {
            let own = self.packing.grains.iter().zip(&loose);
            let own = own.filter(|(grain, loose)| **loose && grain.material == kind.material);
            let radii: Vec<f64> = own.map(|(grain, _)| grain.radius).collect();
            if !radii.is_empty() {
                let name = &materials.names[usize::from(kind.material)];
                let report = SizeReport::of(&kind.sizes, &radii);
                self.note("sizes", format!("{name}: {report}"));
            }
        }
    }
}
